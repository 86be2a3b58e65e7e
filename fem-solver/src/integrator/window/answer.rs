//! The fields of an answer: their layout, and writing them.

use crate::integrator::shown::Shown;
use crate::linear_algebra::lanes::longest_displacement;
use crate::state::State;
use interface_defs::field::{Items, Layout, Sampling, name};
use interface_defs::mesh::InterfaceMesh;
use interface_defs::message::Plan;
use num_integer::lcm;
use std::ops::Range;

/// The fields of an answer, for the whole interface mesh or for what is selected of it.
pub(super) struct WindowAnswer {
    pub(super) layout: Layout,
    /// Number of items of the whole mesh that the fields are laid out for.
    pub(super) whole: Items,
    /// The nodes that fields are laid out for.
    pub(super) shown: Shown,
    /// Samples of displacement and of velocity.
    samples: [usize; 2],
}

impl WindowAnswer {
    /// The fields of `plan` on all of `mesh`.
    pub(super) fn new(plan: &Plan, mesh: &InterfaceMesh) -> Self {
        let samples = |field: &str| {
            plan.gives
                .iter()
                .find(|f| f.name == field && f.sampling == Sampling::AtEnds)
                .map_or(0, |f| f.samples as usize)
        };
        Self {
            layout: Layout::new(&plan.gives, mesh, 0),
            whole: Items::of(mesh),
            shown: Shown::all(mesh.node_count()),
            samples: [samples(name::DISPLACEMENT), samples(name::VELOCITY)],
        }
    }

    /// Fewest equal parts of a window at the ends of which all samples lie.
    pub(super) fn parts(&self) -> usize {
        lcm(self.samples[0].max(1), self.samples[1].max(1))
    }

    /// Lay the fields out for `nodes` and `items`, or for the whole mesh.
    pub(super) fn select(&mut self, selected: Option<(&[u32], Items)>) {
        self.shown.select(selected.map(|(nodes, _)| nodes));
        self.layout.resize(&selected.map_or(self.whole, |(_, items)| items));
    }

    /// Range of a field with one value for the window.
    pub(super) fn place(&self, field: &str) -> Option<Range<usize>> {
        self.layout.sample(field, Sampling::Once, 0)
    }

    /// Write the samples of motion that lie at the end of step `step` of `steps`.
    pub(super) fn write(
        &self,
        (step, steps): (usize, usize),
        state: &State,
        origin: &[f64],
        output: &mut [f64],
    ) {
        for (velocity, count) in self.samples.into_iter().enumerate().filter(|(_, count)| *count > 0) {
            if (step * count).is_multiple_of(steps) {
                self.write_sample(velocity > 0, step * count / steps - 1, state, origin, output);
            }
        }
    }

    /// Write `state` as every sample of motion.
    pub(super) fn write_all(&self, state: &State, origin: &[f64], output: &mut [f64]) {
        for (velocity, count) in self.samples.into_iter().enumerate() {
            (0..count).for_each(|sample| self.write_sample(velocity > 0, sample, state, origin, output));
        }
    }

    fn write_sample(&self, velocity: bool, sample: usize, state: &State, origin: &[f64], output: &mut [f64]) {
        let field = if velocity { name::VELOCITY } else { name::DISPLACEMENT };
        let Some(at) = self.layout.sample(field, Sampling::AtEnds, sample) else { return };
        if velocity {
            self.shown.take(&state.velocity, &mut output[at]);
        } else {
            self.shown.difference(&state.displacement, origin, &mut output[at]);
        }
    }

    /// Write how far any interface node has moved in the window [m], where that is asked for.
    pub(super) fn write_travel(&self, travel: f64, output: &mut [f64]) {
        if let Some(at) = self.place(name::TRAVEL) {
            output[at].fill(travel);
        }
    }
}

/// Largest distance of any of so many nodes between two displacements [m], those of `left_out` (ascending) aside.
pub(super) fn travel(from: &[f64], to: &[f64], nodes: usize, left_out: &[u32]) -> f64 {
    if left_out.is_empty() {
        return longest_displacement(from, to, nodes);
    }
    let mut largest = 0.0;
    let mut left_out = left_out.iter().peekable();
    for node in 0..nodes {
        if left_out.next_if(|out| **out as usize == node).is_some() {
            continue;
        }
        let [x, y, z] = [node, nodes + node, 2 * nodes + node].map(|dof| to[dof] - from[dof]);
        let square = x * x + y * y + z * z;
        largest = if square > largest { square } else { largest };
    }
    f64::sqrt(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_way_is_found_wherever_it_is() {
        let nodes = 19;
        let from: Vec<f64> = (0..3 * nodes).map(|i| (i as f64).sin()).collect();
        for node in 0..nodes {
            let mut to: Vec<f64> = from.iter().map(|x| x + 0.1).collect();
            [2.0, -3.0, 6.0].into_iter().enumerate().for_each(|(c, way)| {
                to[c * nodes + node] = from[c * nodes + node] + way;
            });
            assert!((travel(&from, &to, nodes, &[]) - 7.0).abs() < 1e-14, "{node}");
        }
        assert_eq!(travel(&from, &from, nodes, &[]), 0.0);
    }
}
