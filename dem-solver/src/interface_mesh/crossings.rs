//! How often each node of wires is to be subtracted where contacts are continuous over kinks and crossings
//! ([`crate::contact::narrow_phase::selection`] has the rule and its source).

use super::element::{Element, Kind};
use nalgebra::Vector3;

/// How often each node of the wires is to be subtracted.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Crossings {
    excess: Vec<f64>,
}

/// Two segments go straight on if they turn by less than 60 degrees.
const STRAIGHT: f64 = -0.5;

impl Crossings {
    /// Of a mesh at t = 0: `nodes` [m] and `elements`, of which the lines count.
    pub fn new<'a>(nodes: &[Vector3<f64>], elements: impl IntoIterator<Item = &'a Element>) -> Self {
        let mut directions: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); nodes.len()];
        for element in elements.into_iter().filter(|e| e.kind == Kind::Line) {
            let [a, b] = [element.nodes[0] as usize, element.nodes[1] as usize];
            let direction = (nodes[b] - nodes[a]).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            directions[a].push(direction);
            directions[b].push(-direction);
        }
        let excess = |directions: &Vec<Vector3<f64>>| match directions.len() {
            0 => 0.0,
            k => (k - straight_pairs(directions).max(1)) as f64,
        };
        Self { excess: directions.iter().map(excess).collect() }
    }

    /// How often node number `node` is to be subtracted.
    pub fn excess(&self, node: u32) -> f64 {
        self.excess[node as usize]
    }
}

/// Pairs of `directions` that go straight on, the straightest first, each direction in one pair.
fn straight_pairs(directions: &[Vector3<f64>]) -> usize {
    let mut pairs: Vec<(f64, usize, usize)> = (0..directions.len())
        .flat_map(|b| (0..b).map(move |a| (a, b)))
        .map(|(a, b)| (directions[a].dot(&directions[b]), a, b))
        .filter(|(cos, ..)| *cos < STRAIGHT)
        .collect();
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut taken = vec![false; directions.len()];
    let mut count = 0;
    for (_, a, b) in pairs {
        if !taken[a] && !taken[b] {
            (taken[a], taken[b]) = (true, true);
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_is_subtracted_once_for_each_wire_that_goes_on_and_for_each_that_ends() {
        let directions = |degrees: &[f64]| -> Vec<Vector3<f64>> {
            let direction = |d: &f64| Vector3::new(d.to_radians().cos(), d.to_radians().sin(), 0.0);
            degrees.iter().map(direction).collect()
        };
        let count = |degrees: &[f64]| {
            let directions = directions(degrees);
            let mut nodes = vec![Vector3::zeros()];
            nodes.extend(&directions);
            let line = |i: usize| Element { kind: Kind::Line, nodes: [i as u32, 0, i as u32], radius: 0.0 };
            let lines: Vec<Element> = (1..=directions.len()).map(line).collect();
            let crossings = Crossings::new(&nodes, &lines);
            assert!((1..=directions.len()).all(|i| crossings.excess(i as u32) == 0.0), "ends");
            crossings.excess(0)
        };
        assert_eq!(count(&[0.0]), 0.0);
        assert_eq!(count(&[0.0, 170.0]), 1.0);
        assert_eq!(count(&[0.0, 90.0]), 1.0);
        assert_eq!(count(&[0.0, 180.0, 90.0]), 2.0);
        assert_eq!(count(&[0.0, 90.0, 180.0, 270.0]), 2.0);
        assert_eq!(count(&[5.0, 125.0, 180.0, 240.0, 300.0, 60.0]), 3.0);
    }
}
