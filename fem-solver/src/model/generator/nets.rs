//! Plain nets: of square cells, and of rings, each in contact with four neighbours.

use crate::config::generator::{Held, RectangularNet, RingNet};
use crate::read::mesh::{ElementGroup, Kind, Mesh};
use interface_defs::mesh::Group;
use nalgebra::Vector3;

/// A generated structure.
#[derive(Debug, Clone)]
pub struct Generated {
    /// Nodes, elements, named groups.
    pub mesh: Mesh,
    /// Nodes that are held in all directions.
    pub held: Vec<usize>,
    /// Purpose of the elements of each group.
    pub parts: Vec<MadeFor>,
}

/// A named part of a generated structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MadeFor {
    /// The group of its elements.
    pub group: &'static str,
    /// The element that they are made for, as `[[structure.parts]]` calls it.
    pub element: &'static str,
}

/// A named set of nodes.
pub(super) fn named(name: &str, nodes: &[usize]) -> Group {
    Group { name: name.into(), nodes: nodes.iter().map(|n| *n as u32).collect() }
}

/// A plain net of elements in the plane of x and y: nodes at `places`, in cells of `size` [m] from its first corner, which is
/// stated by itself or by the middle of `counts` cells.
fn plain_net(
    mut mesh: Mesh,
    element: &'static str,
    places: &[[f64; 2]],
    (counts, size): ([usize; 2], f64),
    (origin, center): (Option<[f64; 3]>, Option<[f64; 3]>),
    held: Held,
) -> Generated {
    let [x_end, y_end] = counts.map(|count| count as f64);
    let half = Vector3::new(x_end, y_end, 0.0) * (0.5 * size);
    let of_center = center.map(|center| Vector3::from(center) - half);
    let corner = of_center.unwrap_or_else(|| Vector3::from(origin.unwrap_or_default()));
    mesh.nodes.extend(places.iter().map(|[x, y]| corner + size * Vector3::new(*x, *y, 0.0)));
    let select = |chosen: &dyn Fn(f64, f64) -> bool| {
        (0..places.len()).filter(|n| chosen(places[*n][0], places[*n][1])).collect::<Vec<_>>()
    };
    let (x_edge, y_edge) = (|x: f64| x == 0.0 || x == x_end, |y: f64| y == 0.0 || y == y_end);
    let edges = select(&|x, y| x_edge(x) || y_edge(y));
    let corners = select(&|x, y| x_edge(x) && y_edge(y));
    mesh.node_groups.push(named("edges", &edges));
    // Rings have no contact there.
    mesh.node_groups.extend((!corners.is_empty()).then(|| named("corners", &corners)));
    mesh.node_groups.extend([
        named("interior", &select(&|x, y| !x_edge(x) && !y_edge(y))),
        named("x_min", &select(&|x, _| x == 0.0)),
        named("x_max", &select(&|x, _| x == x_end)),
        named("y_min", &select(&|_, y| y == 0.0)),
        named("y_max", &select(&|_, y| y == y_end)),
    ]);
    let held = match held {
        Held::Edges => edges,
        Held::Corners => corners,
        Held::None => Vec::new(),
    };
    let (group, elements) = ("net", (0..mesh.elements.len() as u32).collect());
    mesh.element_groups.push(ElementGroup { name: group.into(), elements });
    mesh.name_nodes();
    Generated { mesh, held, parts: vec![MadeFor { group, element }] }
}

/// A net of square cells in the plane of x and y.
///
/// Nodes run along x first. So do the cables of each row, along x and then towards the next row:
/// neighbouring cables have neighbouring nodes, which is what the kernel is fast on.
pub fn rectangular_net(net: &RectangularNet) -> Generated {
    let [cells_x, cells_y] = net.cells;
    let number = |i: usize, j: usize| j * (cells_x + 1) + i;
    let mut mesh = Mesh::default();
    for j in 0..=cells_y {
        let along_frame = j == 0 || j == cells_y;
        if !along_frame || net.boundary_cables {
            for i in 0..cells_x {
                mesh.push(Kind::Line2, &[number(i, j), number(i + 1, j)]);
            }
        }
        if j < cells_y {
            for i in (0..=cells_x).filter(|i| net.boundary_cables || (*i != 0 && *i != cells_x)) {
                mesh.push(Kind::Line2, &[number(i, j), number(i, j + 1)]);
            }
        }
    }
    let places: Vec<_> = corners(net.cells).collect();
    plain_net(mesh, "cable", &places, (net.cells, net.spacing), (net.origin, net.center), net.held)
}

/// Numbers of the contacts of `rings` rings in two directions: those between rows (`between`, where
/// rings touch the row below) and those beside (`beside`, where they touch the ring before). A row
/// of the first kind and one of the second take turns, so that a ring's contacts are close by.
#[derive(Debug, Clone, Copy)]
pub struct Contacts {
    /// Rings of the net in both directions.
    pub rings: [usize; 2],
}

impl Contacts {
    /// Below the ring in column `i` and row `j`; `j = rows` is the upper edge.
    pub fn between(self, i: usize, j: usize) -> usize {
        j * (2 * self.rings[0] + 1) + i
    }

    /// Before the ring in column `i` and row `j`; `i = columns` is the far edge.
    pub fn beside(self, i: usize, j: usize) -> usize {
        j * (2 * self.rings[0] + 1) + self.rings[0] + i
    }

    /// The four contacts of a ring, around it.
    pub fn of_ring(self, i: usize, j: usize) -> [usize; 4] {
        [self.beside(i + 1, j), self.between(i, j + 1), self.beside(i, j), self.between(i, j)]
    }

    /// Places of all contacts in order, in cells from the first corner.
    pub fn places(self) -> impl Iterator<Item = [f64; 2]> {
        let [n, m] = self.rings;
        (0..=m).flat_map(move |j| {
            let between = (0..n).map(move |i| [i as f64 + 0.5, j as f64]);
            let beside = (0..=n).filter(move |_| j < m).map(move |i| [i as f64, j as f64 + 0.5]);
            between.chain(beside)
        })
    }
}

/// Rings of rows at 45 degrees: the corners of every second one of `cells`, whose nodes are numbered along x first.
pub fn diagonal_rings([columns, rows]: [usize; 2]) -> impl Iterator<Item = [usize; 4]> {
    let number = move |i: usize, j: usize| j * (columns + 1) + i;
    let cells =
        (0..rows).flat_map(move |j| (0..columns).map(move |i| (i, j))).filter(|(i, j)| (i + j) % 2 == 0);
    cells.map(move |(i, j)| [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)])
}

/// Corners of `cells`, in cells from the first, along x first.
fn corners([columns, rows]: [usize; 2]) -> impl Iterator<Item = [f64; 2]> {
    (0..=rows).flat_map(move |j| (0..=columns).map(move |i| [i as f64, j as f64]))
}

/// A net of rings in the plane of x and y; each ring is a quadrilateral of its four contacts.
pub fn ring_net(net: &RingNet) -> Generated {
    let [columns, rows] = net.rings;
    let contacts = Contacts { rings: net.rings };
    let mut mesh = Mesh::default();
    if net.diagonal {
        diagonal_rings(net.rings).for_each(|ring| {
            mesh.push(Kind::Quad4, &ring);
        });
        let (places, side) = (corners(net.rings).collect::<Vec<_>>(), net.diameter / 2.0_f64.sqrt());
        return plain_net(mesh, "ring", &places, (net.rings, side), (net.origin, net.center), net.held);
    }
    for k in 0..columns * rows {
        mesh.push(Kind::Quad4, &contacts.of_ring(k % columns, k / columns));
    }
    let places: Vec<_> = contacts.places().collect();
    plain_net(mesh, "ring", &places, (net.rings, net.diameter), (net.origin, net.center), net.held)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn net(cells: [usize; 2], boundary_cables: bool) -> Generated {
        rectangular_net(&RectangularNet {
            cells,
            spacing: 0.15,
            origin: None,
            center: Some([0.0, 0.0, 1.0]),
            held: Held::Edges,
            boundary_cables,
        })
    }

    #[test]
    fn the_walenstadt_net_has_729_nodes_and_1300_cables() {
        let net = net([26, 26], false);
        assert_eq!((net.mesh.nodes.len(), net.mesh.elements.len(), net.held.len()), (729, 1300, 104));
        assert!((net.mesh.nodes[13 * 27 + 13] - Vector3::new(0.0, 0.0, 1.0)).norm() < 1e-15);
    }

    #[test]
    fn every_cable_spans_one_cell() {
        let mesh = net([3, 5], true).mesh;
        assert_eq!(mesh.elements.len(), 3 * 6 + 4 * 5);
        for element in &mesh.elements {
            let [a, b] = mesh.nodes_of(element) else { panic!("a cable has two nodes") };
            assert!(((mesh.nodes[*b as usize] - mesh.nodes[*a as usize]).norm() - 0.15).abs() < 1e-15);
        }
    }
}

#[cfg(test)]
mod ring_tests {
    use super::*;

    fn net(rings: [usize; 2]) -> Generated {
        made(rings, false)
    }

    fn made(rings: [usize; 2], diagonal: bool) -> Generated {
        let (center, held) = (Some([0.0, 0.0, 2.0]), Held::Edges);
        ring_net(&RingNet { rings, diameter: 0.3, diagonal, origin: None, center, held })
    }

    #[test]
    fn rows_at_45_degrees_are_closer_by_the_root_of_two_and_reach_all_corners() {
        let Generated { mesh, held, .. } = made([5, 7], true);
        assert_eq!((mesh.nodes.len(), mesh.elements.len(), held.len()), (6 * 8, 18, 24));
        let rings: Vec<_> = mesh.elements.iter().map(|ring| mesh.nodes_of(ring)).collect();
        let middle = |ring: &[u32]| ring.iter().map(|n| mesh.nodes[*n as usize]).sum::<Vector3<f64>>() / 4.0;
        for (k, a) in rings.iter().enumerate() {
            let spokes: Vec<_> = a.iter().map(|n| mesh.nodes[*n as usize] - middle(a)).collect();
            assert!(spokes.iter().all(|spoke| (spoke.norm() - 0.15).abs() < 1e-15));
            assert!((0..4).all(|n| spokes[n].cross(&spokes[(n + 1) % 4]).z > 0.0), "ring {k}");
            for b in &rings[..k] {
                let shared = a.iter().filter(|n| b.contains(n)).count();
                let apart = (middle(a) - middle(b)).norm();
                assert_eq!(shared, usize::from((apart - 0.3).abs() < 1e-12), "{apart} m");
            }
        }
        for corner in [0, 5, 42, 47] {
            assert!(rings.iter().any(|ring| ring.contains(&corner)), "{corner}");
        }
    }

    #[test]
    fn every_ring_is_closed_through_four_contacts_on_its_circle() {
        let Generated { mesh, held, .. } = net([4, 3]);
        assert_eq!((mesh.nodes.len(), mesh.elements.len()), (5 * 3 + 4 * 4, 12));
        assert_eq!(held.len(), 2 * 3 + 2 * 4);
        for (k, ring) in mesh.elements.iter().enumerate() {
            let (i, j) = (k % 4, k / 4);
            let middle = Vector3::new(0.3 * (i as f64 + 0.5 - 2.0), 0.3 * (j as f64 + 0.5 - 1.5), 2.0);
            let nodes: Vec<_> =
                mesh.nodes_of(ring).iter().map(|n| mesh.nodes[*n as usize] - middle).collect();
            for (n, spoke) in nodes.iter().enumerate() {
                assert!((spoke.norm() - 0.15).abs() < 1e-15, "ring {k}: a contact at {} m", spoke.norm());
                // A quarter turn to the next, always the same way round.
                let turn = spoke.cross(&nodes[(n + 1) % 4]);
                assert!((turn.z - 0.15 * 0.15).abs() < 1e-15, "ring {k}: {turn}");
            }
        }
    }

    #[test]
    fn neighbours_share_the_node_of_their_contact_and_nothing_else() {
        let mesh = net([5, 4]).mesh;
        let nodes = |k: usize| mesh.nodes_of(&mesh.elements[k]);
        for a in 0..20_usize {
            for b in 0..a {
                let (da, db) = ((a % 5).abs_diff(b % 5), (a / 5).abs_diff(b / 5));
                let shared = nodes(a).iter().filter(|n| nodes(b).contains(n)).count();
                assert_eq!(shared, usize::from(da + db == 1), "rings {a} and {b}");
            }
        }
        let interior = &mesh.node_groups.iter().find(|g| g.name == "interior").unwrap().nodes;
        assert_eq!(interior.len(), 4 * 4 + 5 * 3, "a node for each contact of two rings");
    }
}
