//! Energies of a structure, from its state.

use crate::internal_force::InternalForce;
use crate::linear_algebra::lanes::{dot, weighted_square};
use crate::model::Model;
use crate::state::State;
use interface_defs::message::{Gauge, Role};

/// Energies of a state; of a path also its load factor and negative pivots, which stand last: who
/// writes gauges counts on it.
pub struct Energies {
    /// Mass of each degree of freedom that takes part in the kinetic energy; empty in statics.
    mass: Vec<f64>,
}

impl Energies {
    /// For `model`, with inertia or without.
    pub fn new(model: &Model, inertia: bool) -> Self {
        Self { mass: if inertia { model.free_masses() } else { Vec::new() } }
    }

    /// Declarations, in the order of [`Energies::of`].
    pub fn gauges(model: &Model) -> Vec<Gauge> {
        let mut kinds = vec![
            ("energy_kinetic_fem", Role::Kinetic),
            ("energy_potential_fem", Role::Potential),
            ("energy_stored_fem", Role::Stored),
            ("energy_dissipated_fem", Role::Dissipated),
            ("energy_received_fem", Role::Received),
        ];
        if !model.moving.is_empty() {
            // Supports that move are a second source of work; it counts as their potential, negated.
            kinds.push(("energy_supports_fem", Role::Potential));
        }
        if !model.timed.is_empty() {
            kinds.push(("energy_loads_fem", Role::Potential));
        }
        let energies = kinds.into_iter().map(|(name, role)| Gauge { role, ..Gauge::new(name, "J") });
        let ground = ["ground_force_x", "ground_force_y", "ground_force_z"].map(|name| (name, "N"));
        let path = [("load_factor", "1"), ("negative_pivots", "1")];
        let ground = ground.into_iter().filter(|_| !model.ground.is_empty());
        let others = ground.chain(path.into_iter().filter(|_| !model.live_load.is_empty()));
        let others = others.map(|(name, unit)| Gauge { extremes: true, ..Gauge::new(name, unit) });
        energies.chain(others).collect()
    }

    /// The energies of `state` [J]: kinetic, potential, stored, dissipated, received, and what moving
    /// supports and loads with a history have given, negated; the force of the ground [N] where there is any; and of a path the load factor and the negative pivots. Potential and stored energy count from the structure as modelled.
    pub fn of(&self, model: &Model, internal: &mut InternalForce, state: &State, to: &mut Vec<f64>) {
        let u = &state.displacement;
        let kinetic = 0.5 * weighted_square(&self.mass, &state.velocity);
        let potential = -dot(&model.dead_load, u);
        let elements = internal.energy(model, u, &state.history);
        let contact = internal.contact.as_mut().map_or(0.0, |c| c.stored(model, u, &state.touches));
        to.clear();
        let dissipated = state.dissipated + elements.dissipated;
        to.extend([kinetic, potential, elements.stored + contact, dissipated, state.received]);
        if !model.moving.is_empty() {
            to.push(-state.support_work);
        }
        if !model.timed.is_empty() {
            to.push(0.0 - state.load_work);
        }
        if !model.ground.is_empty() {
            to.extend(internal.elements.ground_force(model, u, &state.history).iter());
        }
        if !model.live_load.is_empty() {
            to.extend([state.factor, state.along.negative as f64]);
        }
    }
}
