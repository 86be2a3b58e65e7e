//! How often each node of wires is to be subtracted where contacts are continuous over kinks and crossings
//! ([`crate::contact::narrow_phase::selection`] has the rule and its source).

use super::element::{Element, Kind};
use nalgebra::Vector3;

/// How often each node of the wires is to be subtracted, and with which radius: a post that ropes end at reaches further than they do.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Crossings {
    /// All radii of wires, ascending [m].
    radii: Vec<f64>,
    /// For each node as many numbers as there are radii.
    excess: Vec<f64>,
}

/// Numbers of nodes and edges lie below two to this power.
const RADII: u32 = 26;

/// Two segments go straight on if they turn by less than 60 degrees.
const STRAIGHT: f64 = -0.5;

/// A segment at a node: away from the node, and its radius [m].
type Arm = (Vector3<f64>, f64);

impl Crossings {
    /// Of a mesh at t = 0: `nodes` [m] and `elements`, of which the lines count.
    pub fn new<'a>(nodes: &[Vector3<f64>], elements: impl IntoIterator<Item = &'a Element>) -> Self {
        let mut arms: Vec<Vec<Arm>> = vec![Vec::new(); nodes.len()];
        let mut radii = Vec::new();
        for element in elements.into_iter().filter(|e| e.kind == Kind::Line) {
            let [a, b] = [element.nodes[0] as usize, element.nodes[1] as usize];
            let direction = (nodes[b] - nodes[a]).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            arms[a].push((direction, element.radius));
            arms[b].push((-direction, element.radius));
            radii.push(element.radius);
        }
        radii.sort_by(f64::total_cmp);
        radii.dedup();
        let mut it = Self { excess: vec![0.0; nodes.len() * radii.len()], radii };
        for (node, arms) in arms.iter().enumerate() {
            for radius in subtracted(arms) {
                let at = node * it.radii.len() + it.thickness(radius);
                it.excess[at] += 1.0;
            }
        }
        it
    }

    /// Number of a radius among those of the wires.
    pub fn thickness(&self, radius: f64) -> usize {
        self.radii.iter().position(|r| *r == radius).unwrap_or_default()
    }

    /// How often node number `node` is to be subtracted with the radius of this number.
    pub fn excess(&self, node: u32, thickness: usize) -> f64 {
        // Where all wires are broken there is nothing to subtract.
        self.excess.get(node as usize * self.radii.len() + thickness).copied().unwrap_or_default()
    }

    /// A number for a node with a radius, beyond those of all nodes and edges where it is not the thinnest.
    pub fn key(node: u32, thickness: usize) -> u32 {
        node.wrapping_add((thickness as u32) << RADII)
    }
}

/// With which radii a node of these segments is subtracted: once for each segment but one of each wire that goes on, the thicker
/// one; at least one segment stays, and the thickest always does.
fn subtracted(arms: &[Arm]) -> Vec<f64> {
    let mut all: Vec<f64> = arms.iter().map(|(_, radius)| *radius).collect();
    let thickest = all.iter().copied().fold(0.0, f64::max);
    let mut stay: Vec<f64> = straight_pairs(arms).into_iter().map(|(a, b)| all[a].max(all[b])).collect();
    match stay.iter_mut().max_by(|a, b| a.total_cmp(b)) {
        Some(most) => *most = thickest,
        None => stay.extend(all.first().map(|_| thickest)),
    }
    for radius in stay {
        let at = all.iter().position(|r| *r == radius);
        all.swap_remove(at.expect("it is that of a segment, and each has its own"));
    }
    all
}

/// Pairs of segments that go straight on, the straightest first, each in one pair.
fn straight_pairs(arms: &[Arm]) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(f64, usize, usize)> = (0..arms.len())
        .flat_map(|b| (0..b).map(move |a| (a, b)))
        .map(|(a, b)| (arms[a].0.dot(&arms[b].0), a, b))
        .filter(|(cos, ..)| *cos < STRAIGHT)
        .collect();
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut taken = vec![false; arms.len()];
    pairs.retain(|&(_, a, b)| {
        let free = !taken[a] && !taken[b];
        if free {
            (taken[a], taken[b]) = (true, true);
        }
        free
    });
    pairs.into_iter().map(|(_, a, b)| (a, b)).collect()
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
            assert!((1..=directions.len()).all(|i| crossings.excess(i as u32, 0) == 0.0), "ends");
            crossings.excess(0, 0)
        };
        assert_eq!(count(&[0.0]), 0.0);
        assert_eq!(count(&[0.0, 170.0]), 1.0);
        assert_eq!(count(&[0.0, 90.0]), 1.0);
        assert_eq!(count(&[0.0, 180.0, 90.0]), 2.0);
        assert_eq!(count(&[0.0, 90.0, 180.0, 270.0]), 2.0);
        assert_eq!(count(&[5.0, 125.0, 180.0, 240.0, 300.0, 60.0]), 3.0);
    }

    #[test]
    fn the_thickest_segment_stays_and_each_other_is_subtracted_with_its_own_radius() {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
        let of = |arms: &[Arm]| {
            let mut all = subtracted(arms);
            all.sort_by(f64::total_cmp);
            all
        };
        assert!(of(&[]).is_empty() && of(&[(x, 0.08)]).is_empty());
        // A post with ropes that end at it; with one that goes on over its head; that goes on itself.
        assert_eq!(of(&[(x, 0.01), (-z, 0.08), (y, 0.02)]), [0.01, 0.02]);
        assert_eq!(of(&[(x, 0.01), (-x, 0.01), (-z, 0.08)]), [0.01, 0.01]);
        assert_eq!(of(&[(x, 0.01), (-x, 0.02), (-z, 0.08), (z, 0.08)]), [0.01, 0.08]);
        // A thin rope in line with a thick one.
        assert_eq!(of(&[(x, 0.01), (-x, 0.02)]), [0.01]);
    }
}
