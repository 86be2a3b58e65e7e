//! The state of a structure at one instant.

pub mod inherited;

use crate::internal_force::assembly::Event;
use crate::internal_force::line_contact::LineTouch;
use crate::linear_algebra::lanes::dot;
use crate::model::Model;
use interface_defs::Utilisation;
use serde::{Deserialize, Serialize};

/// Root mean square of the velocities below which a structure is at rest [m/s]: around a rock that lies still in it, a net of the
/// drop test goes on humming with 0.014 m/s.
const REST: f64 = 0.05;

/// Everything that a step starts from. Vectors are component-major over all degrees of freedom.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Displacement from the structure as modelled [m].
    pub displacement: Vec<f64>,
    /// Velocity [m/s].
    pub velocity: Vec<f64>,
    /// Acceleration [m/s2]; implicit schemes only.
    pub acceleration: Vec<f64>,
    /// Force of load and elements on each degree of freedom [N]; schemes that balance at the end only.
    pub force: Vec<f64>,
    /// Interface force at this instant [N]; schemes that balance at the end only.
    pub load: Vec<f64>,
    /// History of all elements: plastic strains, slips, reference rotations, what is broken.
    pub history: Vec<f64>,
    /// Lines that touch each other and hold each other by friction, by their numbers.
    pub touches: Vec<LineTouch>,
    /// Ruptures so far.
    pub events: Vec<Event>,
    /// Yieldings so far.
    pub yields: Vec<Event>,
    /// Factor of the loads that grow along a path of equilibrium, and that at the start of the last step.
    pub factor: f64,
    /// See `factor`.
    pub factor_before: f64,
    /// Progress of the path.
    pub along: Along,
    /// Limit points and branch points passed so far.
    pub critical: Vec<Critical>,
    /// Energy dissipated by damping since t = 0 [J].
    pub dissipated: f64,
    /// Work of the interface force since t = 0 [J].
    pub received: f64,
    /// Work of moving supports since t = 0 [J].
    pub support_work: f64,
    /// Work of loads with a history and of pressure since t = 0 [J].
    pub load_work: f64,
    /// Largest share of its strength that anything used in the explicit steps of the last window.
    pub used: f64,
    /// Each element that is close to breaking, and the largest share of its strength that it used.
    pub close: Vec<(u32, f64)>,
    /// Each that was, and then was far from it at the end of a window, whether it broke later or not.
    pub spared: Vec<(u32, f64)>,
    /// Largest utilisation so far of each of [`Model::accounted`].
    pub used_parts: Vec<Utilisation>,
    /// Ends of sliding ropes whose brake is jammed, and since when [s].
    pub jammed: Vec<(u32, f64)>,
    /// At rest in static equilibrium, as it was at t = 0.
    pub at_rest: bool,
    /// Largest values so far.
    pub peaks: Peaks,
    /// Smallest and largest of the members of each group that is gauged, so far.
    pub groups: Vec<Range>,
}

/// Progress along a path of equilibrium.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Along {
    /// Length of the next step [m], of a load step [s]; 0 before the first.
    pub stride: f64,
    /// Change of the load factor per way of the degree of freedom that moves most [1/m].
    pub rate: f64,
    /// Its largest magnitude so far, per norm of all displacements [1/m].
    pub steepest: f64,
    /// Negative pivots of the tangent: directions that are unstable.
    pub negative: usize,
    /// Smallest and largest load factor of the window.
    pub lowest: f64,
    /// See `lowest`.
    pub highest: f64,
    /// The next step has nothing to be compared with: something broke in the last, or the path turns into a branch.
    pub anew: bool,
    /// The step at hand ends at a branch point, and turns.
    pub turned: bool,
    /// Number of critical points that are known and reported.
    pub critical: usize,
    /// Time [s] and load factor of the end of the first step that was unstable.
    pub unstable_from: Option<(f64, f64)>,
}

/// A point of a path of equilibrium at which its tangent is singular.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Critical {
    /// When along the path [s].
    pub time: f64,
    /// Load factor.
    pub factor: f64,
    /// Directions that are unstable behind it.
    pub negative: usize,
    /// Which.
    pub kind: CriticalKind,
}

interface_defs::worded! {
    /// Kind of a critical point.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    pub enum CriticalKind with name {
        /// The load turns back.
        Limit = "limit",
        /// Another path crosses.
        Branch = "branch",
    }
}

/// A value of one member of a group.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extreme {
    /// Value.
    pub value: f64,
    /// Number of the member.
    pub member: u32,
    /// When [s].
    pub time: f64,
}

/// Smallest and largest value of any member of a group.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Smallest.
    pub smallest: Extreme,
    /// Largest.
    pub largest: Extreme,
}

impl Default for Range {
    fn default() -> Self {
        let nothing = |value| Extreme { value, member: 0, time: 0.0 };
        Self { smallest: nothing(f64::INFINITY), largest: nothing(f64::NEG_INFINITY) }
    }
}

impl Range {
    /// The `next` member has this value at `time` [s].
    pub fn take(&mut self, value: f64, next: &mut u32, time: f64) {
        let extreme = Extreme { value, member: *next, time };
        if value < self.smallest.value {
            self.smallest = extreme;
        }
        if value > self.largest.value {
            self.largest = extreme;
        }
        *next += 1;
    }

    /// Take what is smaller or larger in `other`.
    pub fn merge(&mut self, other: &Self) {
        if other.smallest.value < self.smallest.value {
            self.smallest = other.smallest;
        }
        if other.largest.value > self.largest.value {
            self.largest = other.largest;
        }
    }
}

/// A largest value and when it occurred.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Value.
    pub value: f64,
    /// When [s].
    pub time: f64,
}

impl Peak {
    /// Take `value` at `time` if it is larger.
    pub fn take(&mut self, value: f64, time: f64) {
        if value > self.value {
            *self = Self { value, time };
        }
    }
}

/// Largest values of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Peaks {
    /// Total support reaction [N].
    pub reaction: Peak,
    /// Its means over any 1 ms, and over any 10 ms [N].
    pub mean_reaction: [Peak; 2],
    /// Axial force of a cable [N].
    pub cable_force: Peak,
    /// The largest axial forces of the last two steps, the last one first [N].
    pub tensions: [f64; 2],
    /// Mean of those of the steps before and after that of the largest axial force of all [N].
    pub cable_force_beside: f64,
}

impl Peaks {
    /// The largest axial force of a step is `tension` [N], at `time` [s].
    pub fn take_tension(&mut self, tension: f64, time: f64) {
        let [last, before] = self.tensions;
        if last == self.cable_force.value {
            self.cable_force_beside = 0.5 * (before + tension);
        }
        self.cable_force.take(tension, time);
        self.tensions = [tension, last];
    }
}

impl State {
    /// Whether hardly anything moves.
    pub fn rests(&self) -> bool {
        dot(&self.velocity, &self.velocity) <= REST * REST * self.velocity.len() as f64
    }

    /// A support has moved the degree of freedom `dof` by `du` [m] in a step of `h` [s] that began at the velocity `v0`: its
    /// work, and what the inertia of its node adds to its `force` [N], if there is any.
    pub fn book_support(
        &mut self,
        model: &Model,
        force: &mut f64,
        dof: usize,
        du: f64,
        inertia: Option<(f64, f64)>,
    ) {
        self.support_work -= *force * du;
        let Some((h, v0)) = inertia else { return };
        let (mass, v1) = (model.dof_mass(dof), self.velocity[dof]);
        *force -= mass * ((v1 - v0) / h + model.damping * 0.5 * (v0 + v1));
        if !model.held[dof] {
            // What is let go later takes the kinetic energy along that its support has given it.
            self.support_work += 0.5 * mass * (v1 * v1 - v0 * v0);
        }
    }

    /// Become equal to `other`, in the memory that is there.
    pub fn copy_from(&mut self, other: &Self) {
        self.displacement.copy_from_slice(&other.displacement);
        self.velocity.copy_from_slice(&other.velocity);
        self.acceleration.copy_from_slice(&other.acceleration);
        self.force.copy_from_slice(&other.force);
        self.load.copy_from_slice(&other.load);
        self.history.copy_from_slice(&other.history);
        self.touches.clone_from(&other.touches);
        self.events.clear();
        self.events.extend_from_slice(&other.events);
        self.yields.clear();
        self.yields.extend_from_slice(&other.yields);
        (self.factor, self.factor_before) = (other.factor, other.factor_before);
        self.along = other.along;
        self.critical.clear();
        self.critical.extend_from_slice(&other.critical);
        self.dissipated = other.dissipated;
        self.received = other.received;
        self.support_work = other.support_work;
        self.load_work = other.load_work;
        self.used = other.used;
        self.close.clear();
        self.close.extend_from_slice(&other.close);
        self.spared.clear();
        self.spared.extend_from_slice(&other.spared);
        self.used_parts.copy_from_slice(&other.used_parts);
        self.jammed.clear();
        self.jammed.extend_from_slice(&other.jammed);
        self.at_rest = other.at_rest;
        self.peaks = other.peaks;
        self.groups.copy_from_slice(&other.groups);
    }
}
