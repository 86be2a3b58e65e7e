//! Each contact node follows the structure node that is nearest at t = 0.

use super::{Identity, Mapper, Matrix};
use interface_defs::InterfaceMesh;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Nearest structure node; of several at one distance the one with the lowest number.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearestNeighbor {}

impl Mapper for NearestNeighbor {
    fn matrix(&self, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Result<Matrix, String> {
        if structure.same_nodes(contact) {
            return Identity {}.matrix(structure, contact);
        }
        if structure.node_count() == 0 {
            return Err("the structure's interface mesh has no nodes".into());
        }
        let grid = Grid::new(&structure.coordinates);
        let rows = contact.coordinates.chunks_exact(3).map(|p| vec![(grid.nearest([p[0], p[1], p[2]]), 1.0)]);
        Ok(Matrix::from_rows(structure.node_count(), rows))
    }
}

/// Structure nodes in cubic cells, about one node a cell.
struct Grid<'a> {
    points: &'a [f64],
    low: [f64; 3],
    cell: f64,
    cells: BTreeMap<[i64; 3], Vec<u32>>,
    /// Rings of cells that hold every node, seen from anywhere inside.
    span: i64,
}

impl<'a> Grid<'a> {
    fn new(points: &'a [f64]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points.chunks_exact(3) {
            for i in 0..3 {
                low[i] = low[i].min(p[i]);
                high[i] = high[i].max(p[i]);
            }
        }
        let size = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
        // A net is a surface: square root, not cube root, of the number of nodes.
        let cell = (size / ((points.len() / 3) as f64).sqrt()).max(f64::MIN_POSITIVE);
        let mut grid = Self { points, low, cell, cells: BTreeMap::new(), span: 1 };
        for (node, p) in points.chunks_exact(3).enumerate() {
            let key = grid.key([p[0], p[1], p[2]]);
            grid.cells.entry(key).or_default().push(node as u32);
        }
        grid.span = (size / cell).ceil() as i64 + 1;
        grid
    }

    fn key(&self, p: [f64; 3]) -> [i64; 3] {
        std::array::from_fn(|i| ((p[i] - self.low[i]) / self.cell).floor() as i64)
    }

    fn nearest(&self, p: [f64; 3]) -> u32 {
        // A point outside searches from the nearest cell inside; distances are still its own.
        let centre = self.key(p).map(|k| k.clamp(0, self.span));
        let outside = (0..3)
            .map(|i| {
                let x = (p[i] - self.low[i]) / self.cell;
                (x - x.clamp(0.0, self.span as f64 + 1.0)).abs()
            })
            .fold(0.0, f64::max);
        let mut best = (f64::INFINITY, u32::MAX);
        for ring in 0..=self.span {
            // Nodes in further rings are at least `ring - 1` cells away (less what the point is outside).
            let reach = (ring as f64 - 1.0 - outside).max(0.0) * self.cell;
            if best.1 != u32::MAX && best.0 < reach * reach {
                break;
            }
            self.visit_ring(centre, ring, |node| {
                let q = &self.points[3 * node as usize..][..3];
                let distance = (0..3).map(|i| (p[i] - q[i]) * (p[i] - q[i])).sum::<f64>();
                if (distance, node) < best {
                    best = (distance, node);
                }
            });
        }
        best.1
    }

    fn visit_ring(&self, centre: [i64; 3], ring: i64, mut visit: impl FnMut(u32)) {
        let range = |i: usize| (centre[i] - ring).max(0)..=(centre[i] + ring).min(self.span);
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    let far = (x - centre[0]).abs().max((y - centre[1]).abs()).max((z - centre[2]).abs());
                    if far == ring {
                        self.cells.get(&[x, y, z]).into_iter().flatten().for_each(|&n| visit(n));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_grid_finds_what_a_search_through_all_nodes_finds(
            nodes in prop::collection::vec((-2.0..2.0f64, -1.0..1.0f64, -0.1..0.1f64), 1..60),
            points in prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64, -1.0..1.0f64), 1..20),
        ) {
            let flat: Vec<f64> = nodes.iter().flat_map(|n| [n.0, n.1, n.2]).collect();
            let grid = Grid::new(&flat);
            for p in points {
                let d = |n: &(f64, f64, f64)| {
                    (p.0 - n.0) * (p.0 - n.0) + (p.1 - n.1) * (p.1 - n.1) + (p.2 - n.2) * (p.2 - n.2)
                };
                let all = nodes.iter().map(d).fold(f64::INFINITY, f64::min);
                let found = grid.nearest([p.0, p.1, p.2]) as usize;
                prop_assert_eq!(d(&nodes[found]), all);
            }
        }
    }
}
