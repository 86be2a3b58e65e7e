//! Masses made larger for the sake of longer steps.

use crate::internal_force::tangent::Tangent;
use crate::model::Model;

/// Add to the masses of nodes that move what they need for steps of `step` [s], by Gershgorin's bound of the highest
/// frequency of the structure as modelled: `m_a >= (step / 2)^2 sum_b |K_ab|`. Weights stay.
pub fn scale_masses(model: &mut Model, step: f64) {
    let (u, history) = (vec![0.0; model.dof_count()], model.start_history());
    let rows = Tangent::new(model).row_sums(model, &u, &history);
    let need = |dof: usize| 0.25 * step * step * rows[dof];
    for node in 0..model.nodes.len() {
        let most = (0..3).map(|c| need(model.dof(node, c))).fold(model.mass[node], f64::max);
        model.added_mass += most - model.mass[node];
        model.mass[node] = most;
    }
    for (number, node) in model.turning.iter().enumerate() {
        let needs = (0..3).filter_map(|c| model.rotation(*node, c)).map(need);
        model.inertia[number] = needs.fold(model.inertia[number], f64::max);
    }
}
