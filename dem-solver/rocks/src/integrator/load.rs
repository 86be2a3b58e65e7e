//! What acts on a rock in the middle of a step.

use dem_contact::contact::pipeline::Sums;
use nalgebra::Vector3;

/// What acts on a rock in the middle of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepLoad {
    /// Force of all contacts [N].
    pub force: Vector3<f64>,
    /// Torque about the centre of mass [N m].
    pub torque: Vector3<f64>,
    /// Energy of the normal springs on mesh and terrain [J].
    pub elastic: f64,
    /// Energy of the tangential springs there after the step [J].
    pub tangential_energy: f64,
    /// Energy that those on the mesh have taken up between the window before and this one [J].
    pub jump_energy: f64,
    /// Energy that dashpots and friction take there in the step [J].
    pub lost: f64,
    /// Contacts with terrain and other rocks, not with the sides of a box.
    pub touching: usize,
    /// With contacts on the mesh: how long the first has lasted [s].
    pub touched: Option<f64>,
    /// Whether the mesh lies behind the centres of the outer spheres.
    pub behind: bool,
}

impl StepLoad {
    /// True if nothing acts.
    pub fn is_none(&self) -> bool {
        self.force == Vector3::zeros() && self.torque == Vector3::zeros()
    }

    /// Take in the contacts with something that stands still, in a step of `h` [s].
    pub fn add(&mut self, sums: &Sums, h: f64) {
        self.force += sums.force;
        self.torque += sums.torque;
        self.elastic += sums.elastic;
        self.tangential_energy += sums.tangential_energy;
        self.lost += (sums.damping_power + sums.friction_power) * h + sums.yielded;
    }
}
