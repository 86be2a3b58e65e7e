//! Ends of sliding ropes that a brake lets go. As the brake lengthens, the end comes nearer to the next point that the rope slides
//! through: the foot of a post. Once it is there the brake is jammed, and the rope carries what comes.

use super::Model;
use crate::element::AnyElement;
use crate::state::State;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;

/// Part of its room that is left to an end that has come to the next point.
const LEFT: f64 = 0.02;

/// The end of a sliding rope at a brake.
#[derive(Debug, Clone)]
pub struct RopeEnd {
    /// The rope, as an element.
    pub rope: usize,
    /// The brake, as an element.
    pub brake: usize,
    /// The end, and the next node of the rope.
    nodes: [usize; 2],
    /// From the one to the other as modelled [m].
    span: Vector3<f64>,
}

impl RopeEnd {
    /// Elongation of the brake at which the end comes to the next point, as modelled [m].
    pub fn room(&self) -> f64 {
        self.span.norm()
    }

    fn is_jammed(&self, u: &[f64], nodes: usize) -> bool {
        let [end, next] = self.nodes;
        let moved = |c: usize| u[c * nodes + next] - u[c * nodes + end];
        (self.span + Vector3::from_fn(|c, _| moved(c))).norm() <= LEFT * self.room()
    }
}

impl Model {
    /// Ends of sliding ropes at brakes.
    pub fn rope_ends(&self) -> Vec<RopeEnd> {
        let bars = self.elements.iter().enumerate().filter_map(|(at, element)| match element {
            AnyElement::Bar(bar) if bar.is_brake() => Some((at, bar.nodes)),
            _ => None,
        });
        let bars: Vec<_> = bars.collect();
        let ropes = self.elements.iter().enumerate().filter_map(|(at, element)| match element {
            AnyElement::SlidingCable(rope) => Some((at, &rope.nodes)),
            _ => None,
        });
        let ends = ropes.flat_map(|(rope, nodes)| {
            let last = nodes.len() - 1;
            [[nodes[0], nodes[1]], [nodes[last], nodes[last - 1]]].map(|nodes| (rope, nodes))
        });
        ends.filter_map(|(rope, nodes)| {
            let brake = bars.iter().find(|(_, ends)| ends.contains(&nodes[0]))?.0;
            Some(RopeEnd { rope, brake, nodes, span: self.nodes[nodes[1]] - self.nodes[nodes[0]] })
        })
        .collect()
    }
}

/// Note in `state`, at `time` [s], the ends that have come to the next point of their rope since.
pub fn watch(ends: &[RopeEnd], model: &Model, state: &mut State, time: f64) {
    for (at, end) in ends.iter().enumerate() {
        let at = at as u32;
        if !state.jammed.iter().any(|(seen, _)| *seen == at)
            && end.is_jammed(&state.displacement, model.node_count())
        {
            state.jammed.push((at, time));
        }
    }
}

/// Warnings about the ends that are jammed.
pub fn warnings(ends: &[RopeEnd], model: &Model, state: &State) -> Vec<Diagnostic> {
    let jammed = state.jammed.iter().map(|(at, time)| {
        let end = &ends[*at as usize];
        let (brake, node) = (model.member_name(end.brake, None), model.node_name(end.nodes[1]));
        let room = end.room();
        let what = format!(
            "{brake} ran into {node}, which its rope slides through, at {time:.4} s, after {room:.3} m: from there on the rope gives way no more"
        );
        Diagnostic::warning(code::LIMIT, what).try_instead("anchors that lie further beyond the post, or a shorter brake")
    });
    jammed.collect()
}
