//! The structure's mesh as things that have a nearest point: faces, lines, and nodes that neither holds.

use interface_defs::InterfaceMesh;
use nalgebra::Vector3;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

type Vector = Vector3<f64>;

/// A node, a line or a face.
#[derive(Debug, Clone, PartialEq)]
struct Element {
    /// Its number, by which the first of several at one distance is chosen.
    number: usize,
    nodes: [u32; 3],
    corners: [Vector; 3],
    /// Nodes that it has.
    count: usize,
}

/// All elements of a mesh, and how large these are around each node.
pub struct Elements {
    tree: RTree<Element>,
    /// Mean length of the lines and edges at each node [m]; of a node without any the distance to the nearest other one, else 0.
    pub sizes: Vec<f64>,
}

/// The point of the mesh that is nearest to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Nearest {
    /// Nodes between which it lies, with their shares; those without a share are left out.
    pub shares: Vec<(u32, f64)>,
    /// How far it is [m].
    pub distance: f64,
}

impl Elements {
    /// Of the structure's mesh.
    pub fn new(mesh: &InterfaceMesh) -> Self {
        let at = |node: u32| Vector::from_column_slice(&mesh.coordinates[3 * node as usize..][..3]);
        let mut elements: Vec<Element> = Vec::new();
        let mut add = |nodes: [u32; 3], count| {
            elements.push(Element { number: elements.len(), nodes, corners: nodes.map(at), count });
        };
        let mut held = vec![false; mesh.node_count()];
        for &[a, b] in &mesh.lines {
            add([a, b, b], 2);
        }
        for &face in &mesh.faces {
            add(face, 3);
        }
        for &node in mesh.lines.iter().flatten().chain(mesh.faces.iter().flatten()) {
            held[node as usize] = true;
        }
        for node in (0..held.len() as u32).filter(|node| !held[*node as usize]) {
            add([node; 3], 1);
        }
        Self { tree: RTree::bulk_load(elements), sizes: sizes(mesh) }
    }

    /// The nearest point to `point`; of several the one on the first element, lines first. `None`: the mesh is empty.
    pub fn nearest(&self, point: [f64; 3]) -> Option<Nearest> {
        let element = self.tree.nearest_neighbors(&point).into_iter().min_by_key(|element| element.number)?;
        let (shares, square) = element.closest(point.into());
        let shares = element.nodes.into_iter().zip(shares).filter(|(_, share)| *share != 0.0).collect();
        Some(Nearest { shares, distance: square.sqrt() })
    }
}

/// Mean length of what hangs on each node [m].
fn sizes(mesh: &InterfaceMesh) -> Vec<f64> {
    let at = |node: u32| Vector::from_column_slice(&mesh.coordinates[3 * node as usize..][..3]);
    let mut sums = vec![(0.0, 0_u32); mesh.node_count()];
    let edges = mesh.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    for [a, b] in mesh.lines.iter().copied().chain(edges) {
        let length = (at(a) - at(b)).norm();
        for node in [a, b] {
            let (sum, count) = &mut sums[node as usize];
            (*sum, *count) = (*sum + length, *count + 1);
        }
    }
    let nodes: Vec<[f64; 3]> = mesh.coordinates.as_chunks::<3>().0.to_vec();
    let tree = RTree::bulk_load(nodes.clone());
    let lone = |node: usize| {
        let mut others = tree.nearest_neighbor_iter_with_distance_2(nodes[node]).skip(1);
        others.next().map_or(0.0, |(_, square)| square.sqrt())
    };
    let of = |(node, (sum, count)): (usize, (f64, u32))| {
        if count > 0 { sum / f64::from(count) } else { lone(node) }
    };
    sums.into_iter().enumerate().map(of).collect()
}

impl Element {
    /// Shares of its nodes in its nearest point to `p`, and the square of the distance.
    fn closest(&self, p: Vector) -> ([f64; 3], f64) {
        let [a, b, c] = self.corners;
        let of = |shares: [f64; 3]| {
            let point = a * shares[0] + b * shares[1] + c * shares[2];
            (shares, (p - point).norm_squared())
        };
        match self.count {
            1 => of([1.0, 0.0, 0.0]),
            2 => {
                let [s, t] = on_line(a, b, p);
                of([s, t, 0.0])
            }
            _ => of(within(a, b, c, p).unwrap_or_else(|| {
                let ([s, t], [u, v], [w, x]) = (on_line(a, b, p), on_line(b, c, p), on_line(c, a, p));
                let edges = [[s, t, 0.0], [0.0, u, v], [x, 0.0, w]];
                edges.into_iter().min_by(|l, r| of(*l).1.total_cmp(&of(*r).1)).expect("three edges")
            })),
        }
    }
}

/// Shares of `a` and `b` in the point of the line that is nearest to `p`.
fn on_line(a: Vector, b: Vector, p: Vector) -> [f64; 2] {
    let square = (b - a).norm_squared();
    let t = if square > 0.0 { ((p - a).dot(&(b - a)) / square).clamp(0.0, 1.0) } else { 0.0 };
    [1.0 - t, t]
}

/// Shares of the corners in the foot of the perpendicular from `p`, if it lies in the triangle and the triangle has an area.
/// Source: Heidrich (2005), J. Graphics Tools 10(3), 9.
fn within(a: Vector, b: Vector, c: Vector, p: Vector) -> Option<[f64; 3]> {
    let (u, v, w) = (b - a, c - a, p - a);
    let normal = u.cross(&v);
    let square = normal.norm_squared();
    let third = u.cross(&w).dot(&normal) / square;
    let second = w.cross(&v).dot(&normal) / square;
    let shares = [1.0 - second - third, second, third];
    shares.iter().all(|share| (0.0..=1.0).contains(share)).then_some(shares)
}

impl RTreeObject for Element {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(self.corners.map(<[f64; 3]>::from).iter())
    }
}

impl PointDistance for Element {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        self.closest((*point).into()).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh() -> InterfaceMesh {
        InterfaceMesh {
            coordinates: [
                [0.0, 0.0, 0.0],
                [2.0, 0.0, 0.0],
                [0.0, 2.0, 0.0],
                [5.0, 0.0, 0.0],
                [9.0, 0.0, 0.0],
            ]
            .concat(),
            lines: vec![[1, 3]],
            faces: vec![[0, 1, 2]],
            ..Default::default()
        }
    }

    #[test]
    fn the_nearest_point_lies_in_a_face_on_an_edge_on_a_line_or_at_a_node() {
        let elements = Elements::new(&mesh());
        let nearest = |p| elements.nearest(p).expect("a mesh");
        assert_eq!(
            nearest([0.5, 1.0, 3.0]),
            Nearest { shares: vec![(0, 0.25), (1, 0.25), (2, 0.5)], distance: 3.0 }
        );
        assert_eq!(nearest([1.0, -2.0, 0.0]), Nearest { shares: vec![(0, 0.5), (1, 0.5)], distance: 2.0 });
        assert_eq!(
            nearest([2.0, 2.0, 0.0]),
            Nearest { shares: vec![(1, 0.5), (2, 0.5)], distance: f64::sqrt(2.0) }
        );
        assert_eq!(nearest([3.5, 0.0, 1.0]), Nearest { shares: vec![(1, 0.5), (3, 0.5)], distance: 1.0 });
        assert_eq!(
            nearest([8.0, 0.0, 0.0]),
            Nearest { shares: vec![(4, 1.0)], distance: 1.0 },
            "a lone node"
        );
        assert_eq!(nearest([-3.0, -4.0, 0.0]), Nearest { shares: vec![(0, 1.0)], distance: 5.0 });
    }

    #[test]
    fn sizes_are_mean_lengths_and_of_a_lone_node_the_distance_to_the_next() {
        let sizes = Elements::new(&mesh()).sizes;
        let diagonal = f64::sqrt(8.0);
        let expected = [2.0, (3.0 + 2.0 + diagonal) / 3.0, (2.0 + diagonal) / 2.0, 3.0, 4.0];
        for (size, expected) in sizes.iter().zip(expected) {
            assert!((size - expected).abs() < 1e-15, "{size} {expected}");
        }
    }

    #[test]
    fn a_face_without_an_area_is_its_edges() {
        let mesh = InterfaceMesh {
            coordinates: [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]].concat(),
            faces: vec![[0, 1, 2]],
            ..Default::default()
        };
        let nearest = Elements::new(&mesh).nearest([1.5, 1.0, 0.0]).expect("a mesh");
        assert_eq!((nearest.distance, nearest.shares.len()), (1.0, 2));
    }
}
