//! The internal force: force, energy and history of all elements and springs at given displacements, in one order of sums.
//!
//! [`InternalForce`] is that answer; statics, Newton's iteration, arc length, form finding, explicit and implicit steps and the
//! start of a run all ask it. Begin here, then:
//!
//! - [`assembly`]: the elements one by one; what breaks within a step
//! - [`kernel`]: all plain cables at once, fast
//! - [`line_contact`]: lines of the structure that touch each other, in explicit steps
//! - [`tangent`]: the sparse stiffness of all, and masses for longer steps
//!
//! Loads are not part of it: `force` holds them when [`InternalForce::subtract`] takes the internal force from it. What is left
//! at a degree of freedom that a support holds is minus the support's reaction.

pub mod assembly;
pub mod kernel;
pub mod line_contact;
pub mod tangent;

use crate::element::Energy;
use crate::linear_algebra::lanes::longest_displacement;
use crate::model::Model;
use assembly::Assembly;
use kernel::Kernel;
use line_contact::LineContact;

/// Displacements at which the internal force is asked for.
#[derive(Debug, Clone, Copy)]
pub enum Displacements<'a> {
    /// At these [m].
    At(&'a [f64]),
    /// Over an implicit step: plain cables with the mean stress between the displacements `before` and `after`
    /// ([`Kernel::pull_between`]), all else at those in the `middle` [m].
    Step {
        /// At the step's start.
        before: &'a [f64],
        /// At its end.
        after: &'a [f64],
        /// In its middle.
        middle: &'a [f64],
    },
}

/// Plain cables, all other elements, and grounded springs of a structure, with the memory that their sums need.
///
/// Vectors run over all degrees of freedom, component-major.
pub struct InternalForce {
    /// All plain cables.
    pub cables: Kernel,
    /// The other elements: their histories, and what of them breaks.
    pub elements: Assembly,
    /// Lines that touch each other, which explicit steps ask by themselves.
    pub contact: Option<LineContact>,
    springs: Vec<(usize, f64)>,
}

impl InternalForce {
    /// Of `model`, which every call names again.
    pub fn new(model: &Model) -> Self {
        Self {
            cables: Kernel::new(&model.cables, model.node_count()),
            elements: Assembly::with_blocks(model),
            contact: model.contact.as_ref().map(|lines| LineContact::new(model, lines)),
            springs: model.spring_dofs(),
        }
    }

    /// Take the internal force from `force` [N]: cables, elements, springs. Returns the largest axial force of cables, ropes,
    /// rings and brakes, squared [N2].
    pub fn subtract(&mut self, model: &Model, at: Displacements, history: &[f64], force: &mut [f64]) -> f64 {
        let (mut largest, u) = match at {
            Displacements::At(u) => (self.cables.pull(u, force), u),
            Displacements::Step { before, after, middle } => {
                (self.cables.pull_between(before, after, force), middle)
            }
        };
        largest = largest.max(self.elements.subtract(&model.elements, u, history, force));
        self.subtract_springs(u, force);
        largest
    }

    /// The same over an explicit step from the displacements `start`, at those in its `middle`: `history` becomes that at the
    /// middle, and what breaks within the step pulls until it does ([`Assembly::broken`]).
    pub fn subtract_and_advance(
        &mut self,
        model: &Model,
        (start, middle): (&[f64], &[f64]),
        history: &mut [f64],
        force: &mut [f64],
    ) -> f64 {
        let of_cables = self.cables.pull(middle, force);
        let u = (start, middle);
        let farthest = longest_displacement(start, middle, model.node_count());
        let of_elements = self.elements.subtract_and_advance(&model.elements, (u, farthest), history, force);
        self.subtract_springs(middle, force);
        of_cables.max(of_elements)
    }

    fn subtract_springs(&self, u: &[f64], force: &mut [f64]) {
        for (dof, k) in &self.springs {
            force[*dof] -= k * u[*dof];
        }
    }

    /// Energies of cables, springs and elements at `u` [J].
    pub fn energy(&mut self, model: &Model, u: &[f64], history: &[f64]) -> Energy {
        let springs: f64 = self.springs.iter().map(|(dof, k)| 0.5 * k * u[*dof] * u[*dof]).sum();
        let plain = self.cables.energy(u) + springs;
        let others = self.elements.energy(&model.elements, u, history);
        Energy { stored: plain + others.stored, dissipated: others.dissipated }
    }

    /// Number of tiles of the plain cables, where they are all that the structure consists of: an explicit step sweeps over them.
    pub fn tile_count(&self) -> Option<usize> {
        (self.elements.is_empty() && self.springs.is_empty() && self.contact.is_none())
            .then_some(self.cables.tile_count())
    }
}
