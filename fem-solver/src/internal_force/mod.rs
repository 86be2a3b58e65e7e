//! What the structure answers to displacements: force, energy, history of all its elements and springs, in one order of sums.
//!
//! [`InternalForce`] is that answer; statics, Newton's iteration, arc length, form finding, explicit and implicit steps and the
//! start of a run all ask it. Begin here, then:
//!
//! - [`assembly`]: the elements one by one; what breaks within a step
//! - [`kernel`]: all plain cables at once, fast
//! - [`tangent`]: the sparse stiffness of all
//! - [`mass_scaling`]: masses for longer steps
//!
//! Loads are not part of it: `force` holds them when [`InternalForce::subtract`] takes the internal force from it. What is left
//! at a degree of freedom that a support holds is minus the support's reaction.

pub mod assembly;
pub mod kernel;
pub mod mass_scaling;
pub mod tangent;

use crate::element::Energy;
use crate::model::Model;
use assembly::{Assembly, Broken};
use kernel::Kernel;
use nalgebra::Vector3;
use std::ops::Range;

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
    cables: Kernel,
    elements: Assembly,
    springs: Vec<(usize, f64)>,
}

impl InternalForce {
    /// Of `model`, which every call names again.
    pub fn new(model: &Model) -> Self {
        Self {
            cables: Kernel::new(&model.cables, model.node_count()),
            elements: Assembly::with_blocks(model),
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
        if !self.elements.is_empty() {
            largest = largest.max(self.elements.subtract(&model.elements, u, history, force));
        }
        self.subtract_springs(u, force);
        largest
    }

    /// The same over an explicit step from the displacements `start`, at those in its `middle`: `history` becomes that at the
    /// middle, and what breaks within the step pulls until it does ([`InternalForce::broken`]).
    pub fn subtract_and_advance(
        &mut self,
        model: &Model,
        (start, middle): (&[f64], &[f64]),
        history: &mut [f64],
        force: &mut [f64],
    ) -> f64 {
        let mut largest = self.cables.pull(middle, force);
        if !self.elements.is_empty() {
            let (elements, u) = (&model.elements, (start, middle));
            largest = largest.max(self.elements.subtract_and_advance(elements, u, history, force));
        }
        self.subtract_springs(middle, force);
        largest
    }

    fn subtract_springs(&self, u: &[f64], force: &mut [f64]) {
        for (dof, k) in &self.springs {
            force[*dof] -= k * u[*dof];
        }
    }

    /// `history` becomes that at `u`; what breaks there is in [`InternalForce::broken`].
    pub fn advance(&mut self, model: &Model, u: &[f64], history: &mut [f64]) {
        self.elements.advance(&model.elements, u, history);
    }

    /// `history` becomes that at `u` where nodes turn, and stays as it is elsewhere.
    pub fn advance_rotations(&mut self, model: &Model, u: &[f64], history: &mut [f64]) {
        self.elements.advance_rotations(&model.elements, u, history);
    }

    /// What broke as the history was last advanced.
    pub fn broken(&self) -> &[Broken] {
        self.elements.broken()
    }

    /// Energy [J] that the last explicit step took beyond what the histories say: see [`Assembly::book_rupture`].
    pub fn book_rupture(&mut self, model: &Model, u: &[f64], history: &[f64]) -> f64 {
        self.elements.book_rupture(&model.elements, u, history)
    }

    /// Energies of cables, springs and elements at `u` [J].
    pub fn energy(&mut self, model: &Model, u: &[f64], history: &[f64]) -> Energy {
        let springs: f64 = self.springs.iter().map(|(dof, k)| 0.5 * k * u[*dof] * u[*dof]).sum();
        let plain = self.cables.energy(u) + springs;
        let others = self.elements.energy(&model.elements, u, history);
        Energy { stored: plain + others.stored, dissipated: others.dissipated }
    }

    /// Sum of what the ground pushes and holds [N].
    pub fn ground_force(&mut self, model: &Model, u: &[f64], history: &[f64]) -> Vector3<f64> {
        self.elements.ground_force(model, u, history)
    }

    /// Number of tiles of the plain cables, where they are all that the structure consists of: an explicit step sweeps over them.
    pub fn tile_count(&self) -> Option<usize> {
        (self.elements.is_empty() && self.springs.is_empty()).then_some(self.cables.tile_count())
    }

    /// Nodes of a tile, and the end of those that the tiles up to it pull on.
    pub fn tile(&self, tile: usize) -> (Range<usize>, usize) {
        self.cables.tile(tile)
    }

    /// The part of [`InternalForce::subtract`] that the cables with their lower nodes in one tile contribute.
    pub fn subtract_tile(&mut self, tile: usize, u: &[f64], force: &mut [f64]) -> f64 {
        self.cables.pull_tile(tile, u, force)
    }

    /// The plain cables.
    pub fn cables(&self) -> &Kernel {
        &self.cables
    }
}
