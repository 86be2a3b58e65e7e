//! Generated nets.

use super::CellSet;
use crate::config::structure::{Generator, Held};
use interface_defs::mesh::Group;
use nalgebra::Vector3;

/// Nodes, cables (pairs of nodes), named cells, groups and held nodes of a generated structure, or of one that was
/// read from a file.
#[derive(Debug, Clone, Default)]
pub struct Generated {
    /// Nodes [m].
    pub nodes: Vec<Vector3<f64>>,
    /// Two nodes for each cable.
    pub cables: Vec<[usize; 2]>,
    /// Named cells, to which the parts of the scene give elements.
    pub sets: Vec<CellSet>,
    /// Groups.
    pub groups: Vec<Group>,
    /// Nodes that are held in all directions.
    pub held: Vec<usize>,
}

/// A net of square cells in the plane of x and y.
///
/// Nodes run along x first. So do the cables of each row, along x and then towards the next row:
/// neighbouring cables have neighbouring nodes, which is what the kernel is fast on.
pub fn rectangular_net(generator: &Generator) -> Generated {
    let [cells_x, cells_y] = generator.cells;
    let (columns, rows) = (cells_x + 1, cells_y + 1);
    let half = Vector3::new(cells_x as f64, cells_y as f64, 0.0) * (0.5 * generator.spacing);
    let origin = match generator.center {
        Some(center) => Vector3::from(center) - half,
        None => Vector3::from(generator.origin.unwrap_or_default()),
    };
    let number = |i: usize, j: usize| j * columns + i;
    let mut nodes = Vec::with_capacity(columns * rows);
    let mut cables = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            nodes.push(origin + generator.spacing * Vector3::new(i as f64, j as f64, 0.0));
        }
        let along_frame = j == 0 || j == cells_y;
        if !along_frame || generator.boundary_cables {
            cables.extend((0..cells_x).map(|i| [number(i, j), number(i + 1, j)]));
        }
        if j < cells_y {
            let across = (0..columns).filter(|i| generator.boundary_cables || (*i != 0 && *i != cells_x));
            cables.extend(across.map(|i| [number(i, j), number(i, j + 1)]));
        }
    }
    let select = |name: &str, chosen: &dyn Fn(usize, usize) -> bool| Group {
        name: name.into(),
        nodes: (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .filter(|(i, j)| chosen(*i, *j))
            .map(|(i, j)| number(i, j) as u32)
            .collect(),
    };
    let (x_edge, y_edge) = (|i: usize| i == 0 || i == cells_x, |j: usize| j == 0 || j == cells_y);
    let groups = vec![
        select("edges", &|i, j| x_edge(i) || y_edge(j)),
        select("corners", &|i, j| x_edge(i) && y_edge(j)),
        select("interior", &|i, j| !x_edge(i) && !y_edge(j)),
        select("x_min", &|i, _| i == 0),
        select("x_max", &|i, _| i == cells_x),
        select("y_min", &|_, j| j == 0),
        select("y_max", &|_, j| j == cells_y),
    ];
    let held = match generator.held {
        Held::Edges => groups[0].nodes.clone(),
        Held::Corners => groups[1].nodes.clone(),
        Held::None => Vec::new(),
    };
    Generated {
        nodes,
        cables,
        sets: Vec::new(),
        groups,
        held: held.into_iter().map(|n| n as usize).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::structure::GeneratorKind;

    fn net(cells: [usize; 2], boundary_cables: bool) -> Generated {
        rectangular_net(&Generator {
            kind: GeneratorKind::RectangularNet,
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
        assert_eq!((net.nodes.len(), net.cables.len(), net.held.len()), (729, 1300, 104));
        assert!((net.nodes[13 * 27 + 13] - Vector3::new(0.0, 0.0, 1.0)).norm() < 1e-15);
    }

    #[test]
    fn every_cable_spans_one_cell() {
        let net = net([3, 5], true);
        assert_eq!(net.cables.len(), 3 * 6 + 4 * 5);
        for [a, b] in net.cables {
            assert!(((net.nodes[b] - net.nodes[a]).norm() - 0.15).abs() < 1e-15);
        }
    }
}
