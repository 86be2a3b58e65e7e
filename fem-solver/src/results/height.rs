//! The height that is left between two ropes, of the whole or field by field.
//!
//! EAD 340059 takes the residual height as the least distance between the lower and the upper bearing rope, normal to the
//! reference slope. In the plane of the posts (along the barrier, and along that normal) each rope is the row of its lines;
//! their distance along the normal is least at a node of one of them, or at a post. What is broken is no part of a rope: where
//! nothing else closes the gap, the rope is missing in that field, and the height of the field is 0.

use crate::config::GaugeConfig;

use crate::model::Model;
use crate::state::State;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Matrix3, Vector3};
use std::cell::RefCell;
use std::ops::Range;
use toolkit::scene::Scene;

/// Part of the length of the barrier up to which nodes along it are of one post, which may lean that way.
const ONE_PLACE: f64 = 5e-3;

/// The same of the extent of the structure, for nodes that are at one place but for rounding.
const ROUNDING: f64 = 1e-9;

/// A place along the barrier and a height [m].
type Point = [f64; 2];

/// A group above another.
#[derive(Debug, Clone)]
pub struct Height {
    nodes: Vec<usize>,
    above: Vec<usize>,
    normal: Vector3<f64>,
    fields: Option<BarrierFields>,
}

/// The fields between posts.
#[derive(Debug, Clone)]
struct BarrierFields {
    along: Vector3<f64>,
    /// Nodes of each post, in order along the barrier.
    posts: Vec<Vec<usize>>,
    /// Lines of the upper and of the lower rope.
    ropes: [Vec<RopePiece>; 2],
    /// Those of one field. Written before it is read.
    memory: RefCell<[Vec<[Point; 2]>; 2]>,
}

/// A line of a rope.
#[derive(Debug, Clone)]
struct RopePiece {
    nodes: [usize; 2],
    /// Of an element that can break: its number, and where its history lies.
    breakable: Option<(usize, Range<usize>)>,
}

impl RopePiece {
    fn is_broken(&self, model: &Model, history: &[f64]) -> bool {
        let broken = |(element, own): &(usize, Range<usize>)| {
            model.elements[*element].is_broken(&history[own.clone()])
        };
        self.breakable.as_ref().is_some_and(broken)
    }
}

impl Height {
    /// Of the gauge with the key `key`, whose group has the nodes `nodes`.
    pub fn of(
        scene: &Scene,
        key: &str,
        model: &Model,
        nodes: Vec<usize>,
        gauge: &GaugeConfig,
    ) -> Result<Self, Diagnostic> {
        let Some(below) = gauge.above.as_deref() else {
            let what = format!("the gauge `{}` does not say above what its height is taken", gauge.name);
            return scene.refuse(key, what, "add above = \"name of a group\"");
        };
        let above = model.group(scene, &format!("{key}.above.group"), below)?;
        let normal = normal(scene, key, model, gauge)?;
        let Some(name) = gauge.posts.as_deref() else {
            return Ok(Self { nodes, above, normal, fields: None });
        };
        let posts = format!("{key}.posts");
        if gauge.at.is_some() {
            let what = format!("the gauge `{}` is at a point: no rope is above the other", gauge.name);
            let hint = "group = \"name of the upper rope\" in place of `at`, or leave out posts";
            return scene.refuse(&posts, what, hint);
        }
        let upper = gauge.group.as_deref();
        let ropes = [(upper, &nodes), (Some(below), &above)].map(|(name, nodes)| lines(model, name, nodes));
        let at_posts = model.group(scene, &format!("{posts}.group"), name)?;
        let fields = BarrierFields::new(model, &at_posts, &normal, ropes);
        if fields.posts.len() < 2 {
            let what = format!(
                "the nodes of `{name}` stand at one place along the barrier: there is no field between them"
            );
            let hint = "a group with nodes of each post, as \"posts\" of the generated barrier";
            return scene.refuse(&posts, what, hint);
        }
        fields.check(scene, key, (model, &normal), [upper.unwrap_or_default(), below])?;
        Ok(Self { nodes, above, normal, fields: Some(fields) })
    }

    /// Numbers that it gives: the least height, then that of each field if there are several.
    pub fn count(&self) -> usize {
        let fields = self.fields.as_ref().map_or(1, |fields| fields.posts.len() - 1);
        1 + if fields > 1 { fields } else { 0 }
    }

    /// Ending of the name of number `slot` of them.
    pub fn suffix(slot: usize) -> String {
        if slot == 0 { "height".into() } else { format!("height_{slot}") }
    }

    /// Show `take` the number and the value [m] of each, the least one last.
    pub fn scan(&self, model: &Model, state: &State, mut take: impl FnMut(usize, f64)) {
        let place = |node: usize| model.nodes[node] + model.vector(&state.displacement, node);
        let height = |node: &usize| self.normal.dot(&place(*node));
        let Some(fields) = &self.fields else {
            let lowest = self.nodes.iter().map(height).fold(f64::INFINITY, f64::min);
            return take(0, lowest - self.above.iter().map(height).fold(f64::NEG_INFINITY, f64::max));
        };
        let along = |node: &usize| fields.along.dot(&place(*node));
        let torn =
            fields.ropes.each_ref().map(|rope| rope.iter().any(|p| p.is_broken(model, &state.history)));
        let mut least = f64::INFINITY;
        for field in 0..fields.posts.len() - 1 {
            let (from, to) = fields.ends(field, along);
            let mut memory = fields.memory.borrow_mut();
            for (own, rope) in memory.iter_mut().zip(&fields.ropes) {
                own.clear();
                let left = rope.iter().filter(|piece| !piece.is_broken(model, &state.history));
                let points = left.map(|piece| piece.nodes.map(|node| [along(&node), height(&node)]));
                own.extend(points.filter(|[a, b]| a[0].min(b[0]) <= to && from <= a[0].max(b[0])));
            }
            let missing = torn.iter().zip(memory.iter()).any(|(torn, own)| *torn && !spans(own, from, to));
            let own = if missing { 0.0 } else { least_distance(&memory[0], &memory[1], from, to) };
            // No line of a rope is left in this field.
            let own = if own.is_finite() { own } else { 0.0 };
            least = least.min(own);
            if self.count() > 1 {
                take(field + 1, own);
            }
        }
        take(0, least);
    }
}

impl BarrierFields {
    fn new(model: &Model, nodes: &[usize], normal: &Vector3<f64>, ropes: [Vec<RopePiece>; 2]) -> Self {
        let (along, extent) = direction(model, nodes, normal);
        // Nodes at one place are one post, however far rounding has them apart.
        let near = f64::max(ONE_PLACE * extent, ROUNDING * model.extent());
        let place = |node: usize| along.dot(&model.nodes[node]);
        let mut nodes = nodes.to_vec();
        nodes.sort_by(|a, b| place(*a).total_cmp(&place(*b)));
        let mut posts: Vec<Vec<usize>> = Vec::new();
        for node in nodes {
            match posts.last_mut() {
                Some(post) if place(node) - place(post[0]) <= near => post.push(node),
                _ => posts.push(vec![node]),
            }
        }
        let memory = ropes.each_ref().map(|lines| Vec::with_capacity(lines.len()));
        Self { along, posts, ropes, memory: RefCell::new(memory) }
    }

    /// Begin and end of a field along the barrier, by the place of each node.
    fn ends(&self, field: usize, along: impl Fn(&usize) -> f64) -> (f64, f64) {
        let from = self.posts[field].iter().map(&along).fold(f64::NEG_INFINITY, f64::max);
        (from, self.posts[field + 1].iter().map(along).fold(f64::INFINITY, f64::min).max(from))
    }

    /// Refuse ropes that are not one above the other anywhere in a field, as modelled.
    fn check(
        &self,
        scene: &Scene,
        key: &str,
        (model, normal): (&Model, &Vector3<f64>),
        names: [&str; 2],
    ) -> Result<(), Diagnostic> {
        let along = |node: &usize| self.along.dot(&model.nodes[*node]);
        for field in 0..self.posts.len() - 1 {
            let (from, to) = self.ends(field, along);
            // A rope that ends at its post is not in the field behind it.
            let ropes = self.ropes.each_ref().map(|rope| {
                let points = rope
                    .iter()
                    .map(|piece| piece.nodes.map(|node| [along(&node), normal.dot(&model.nodes[node])]));
                points.filter(|[a, b]| a[0].min(b[0]) < to && from < a[0].max(b[0])).collect::<Vec<_>>()
            });
            if least_distance(&ropes[0], &ropes[1], from, to).is_finite() {
                continue;
            }
            let place = format!("field {}, from {from:.4} to {to:.4} m along the barrier", field + 1);
            let empty = names.iter().zip(&ropes).find(|(_, rope)| rope.is_empty());
            let what = match empty {
                Some((name, _)) => format!("`{name}` has no line in {place}"),
                None => {
                    format!("`{}` and `{}` have no lines one above the other in {place}", names[0], names[1])
                }
            };
            return scene.refuse(key, what, "a group with all nodes of each rope from post to post; normal = [x, y, z] is across the barrier");
        }
        Ok(())
    }
}

/// Lines of the part or the group of elements `name`, or those with both ends among `nodes`.
fn lines(model: &Model, name: Option<&str>, nodes: &[usize]) -> Vec<RopePiece> {
    let part = model.parts.iter().find(|p| Some(p.name.as_str()) == name);
    let mut inside = vec![false; model.node_count()];
    nodes.iter().for_each(|n| inside[*n] = true);
    let belongs = |line: &[usize; 2]| part.is_some() || line.iter().all(|n| inside[*n]);
    let cables = model.cables.iter().enumerate();
    let cables = cables.filter(|(i, _)| part.is_none_or(|p| p.cables.contains(i))).map(|(_, c)| c.nodes);
    let mut all: Vec<_> = cables.map(|nodes| RopePiece { nodes, breakable: None }).collect();
    for (number, (element, history)) in model.elements.iter().zip(model.histories()).enumerate() {
        if part.is_none_or(|p| p.elements.contains(&number)) {
            let breakable = element.constants().can_break.then_some((number, history));
            let lines = element.lines().into_iter();
            all.extend(lines.map(|nodes| RopePiece { nodes, breakable: breakable.clone() }));
        }
    }
    all.retain(|piece| belongs(&piece.nodes));
    all
}

/// The direction in which a height counts.
fn normal(scene: &Scene, key: &str, model: &Model, gauge: &GaugeConfig) -> Result<Vector3<f64>, Diagnostic> {
    let Some(normal) = gauge.normal else {
        return model.down.map(|down| -down).ok_or_else(|| {
            scene
                .invalid(key, "a height counts against gravity, and there is none")
                .try_instead("add normal = [x, y, z], the normal of the slope")
        });
    };
    let normal = Vector3::from(normal);
    normal.try_normalize(0.0).ok_or_else(|| {
        scene.invalid(&format!("{key}.normal"), "the normal of the slope is [0, 0, 0]: it has no direction")
    })
}

/// The direction along a barrier with posts at `nodes`, across `normal`: that in which they extend most; and how far [m].
fn direction(model: &Model, nodes: &[usize], normal: &Vector3<f64>) -> (Vector3<f64>, f64) {
    let flat = |node: &usize| model.nodes[*node] - normal * normal.dot(&model.nodes[*node]);
    let middle = nodes.iter().map(flat).sum::<Vector3<f64>>() / nodes.len().max(1) as f64;
    let spread: Matrix3<f64> = nodes.iter().map(|n| flat(n) - middle).map(|d| d * d.transpose()).sum();
    if spread.trace() <= (ROUNDING * model.extent()).powi(2) {
        return (Vector3::zeros(), 0.0);
    }
    let modes = spread.symmetric_eigen();
    let along = modes.eigenvectors.column(modes.eigenvalues.imax()).into_owned();
    // BarrierFields count in the direction of the largest axis.
    let along = if along[along.iamax()] < 0.0 { -along } else { along };
    let places = || nodes.iter().map(|n| along.dot(&flat(n)));
    (along, places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min))
}

/// Least distance of two ropes between two places along the barrier; infinite where one of them is nowhere.
fn least_distance(upper: &[[Point; 2]], lower: &[[Point; 2]], from: f64, to: f64) -> f64 {
    let lowest = |place: f64| crossings(upper, place).fold(f64::INFINITY, f64::min);
    let highest = |place: f64| crossings(lower, place).fold(f64::NEG_INFINITY, f64::max);
    let nodes = upper.iter().chain(lower).flatten().map(|p| p[0]);
    let places = nodes.filter(|place| from < *place && *place < to).chain([from, to]);
    places.map(|place| lowest(place) - highest(place)).fold(f64::INFINITY, f64::min)
}

/// Whether a rope goes all the way between two places along the barrier.
fn spans(rope: &[[Point; 2]], from: f64, to: f64) -> bool {
    let begins = rope.iter().any(|[a, b]| a[0].min(b[0]) <= from && from <= a[0].max(b[0]));
    let ends = rope.iter().map(|[a, b]| a[0].max(b[0])).filter(|end| from <= *end && *end < to);
    let goes_on = |end: f64| rope.iter().any(|[a, b]| a[0].min(b[0]) <= end && end < a[0].max(b[0]));
    begins && ends.into_iter().all(goes_on)
}

/// Heights of a rope at a place along the barrier.
fn crossings(rope: &[[Point; 2]], place: f64) -> impl Iterator<Item = f64> {
    let over = rope.iter().filter(move |[a, b]| a[0].min(b[0]) <= place && place <= a[0].max(b[0]));
    over.flat_map(move |[a, b]| {
        let width = b[0] - a[0];
        // An upright line is there with both of its ends.
        let share = |end: f64| if width == 0.0 { end } else { (place - a[0]) / width };
        [0.0, 1.0].map(|end| a[1] + (b[1] - a[1]) * share(end))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the same lines sampled finely; the upper one folds back, the lower one has an upright line.
    #[test]
    fn the_least_distance_of_two_ropes_is_at_a_node_or_at_a_post() {
        let rope = |points: &[Point]| points.windows(2).map(|two| [two[0], two[1]]).collect::<Vec<_>>();
        let upper = rope(&[[-1.0, 4.0], [0.5, 3.0], [2.0, 3.6], [1.6, 2.9], [5.0, 4.0], [9.0, 4.0]]);
        let lower = rope(&[[-1.0, 0.0], [1.5, 1.2], [3.0, 0.4], [3.0, 1.0], [9.0, 2.0]]);
        for (from, to) in [(0.0, 1.0), (0.0, 3.0), (1.0, 2.5), (2.2, 2.3), (4.0, 6.0), (3.0, 8.0)] {
            let sampled = (0..=200_000)
                .map(|i| from + (to - from) * f64::from(i) / 200_000.0)
                .map(|x| {
                    let least = crossings(&upper, x).fold(f64::INFINITY, f64::min);
                    least - crossings(&lower, x).fold(f64::NEG_INFINITY, f64::max)
                })
                .fold(f64::INFINITY, f64::min);
            let height = least_distance(&upper, &lower, from, to);
            assert!((height - sampled).abs() < 5e-5, "{from} to {to}: {height} {sampled}");
        }
        assert_eq!(crossings(&lower, 3.0).collect::<Vec<_>>().len(), 6);
        assert_eq!(least_distance(&[], &lower, 0.0, 1.0), f64::INFINITY);
    }
}
