//! A net of square cells.

use super::generated::{Generated, named};
use crate::config::generator::{Held, RectangularNet};
use crate::read::mesh::{Kind, Mesh};
use nalgebra::Vector3;

/// A net of square cells in the plane of x and y.
///
/// Nodes run along x first. So do the cables of each row, along x and then towards the next row:
/// neighbouring cables have neighbouring nodes, which is what the kernel is fast on.
pub fn rectangular_net(generator: &RectangularNet) -> Generated {
    let [cells_x, cells_y] = generator.cells;
    let (columns, rows) = (cells_x + 1, cells_y + 1);
    let half = Vector3::new(cells_x as f64, cells_y as f64, 0.0) * (0.5 * generator.spacing);
    let origin = match generator.center {
        Some(center) => Vector3::from(center) - half,
        None => Vector3::from(generator.origin.unwrap_or_default()),
    };
    let number = |i: usize, j: usize| j * columns + i;
    let mut mesh = Mesh::default();
    for j in 0..rows {
        for i in 0..columns {
            mesh.nodes.push(origin + generator.spacing * Vector3::new(i as f64, j as f64, 0.0));
        }
        let along_frame = j == 0 || j == cells_y;
        if !along_frame || generator.boundary_cables {
            for i in 0..cells_x {
                mesh.push(Kind::Line2, &[number(i, j), number(i + 1, j)]);
            }
        }
        if j < cells_y {
            for i in (0..columns).filter(|i| generator.boundary_cables || (*i != 0 && *i != cells_x)) {
                mesh.push(Kind::Line2, &[number(i, j), number(i, j + 1)]);
            }
        }
    }
    let select = |chosen: &dyn Fn(usize, usize) -> bool| {
        let all = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        all.filter(|(i, j)| chosen(*i, *j)).map(|(i, j)| number(i, j)).collect::<Vec<_>>()
    };
    let (x_edge, y_edge) = (|i: usize| i == 0 || i == cells_x, |j: usize| j == 0 || j == cells_y);
    let edges = select(&|i, j| x_edge(i) || y_edge(j));
    let corners = select(&|i, j| x_edge(i) && y_edge(j));
    mesh.node_groups = vec![
        named("edges", &edges),
        named("corners", &corners),
        named("interior", &select(&|i, j| !x_edge(i) && !y_edge(j))),
        named("x_min", &select(&|i, _| i == 0)),
        named("x_max", &select(&|i, _| i == cells_x)),
        named("y_min", &select(&|_, j| j == 0)),
        named("y_max", &select(&|_, j| j == cells_y)),
    ];
    let held = match generator.held {
        Held::Edges => edges,
        Held::Corners => corners,
        Held::None => Vec::new(),
    };
    Generated::of_one_part(mesh, "net", "cable", held)
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
