//! Lines of equal height through the middles of a grid's cells.

use super::shade::ShadedGrid;
use std::collections::BTreeMap;

/// An edge between two neighbouring middles: that of the first, and the axis along which the second lies.
type CellEdge = (usize, usize, usize);

/// Polylines at `level` [m], in metres.
pub fn lines(grid: &ShadedGrid, level: f64) -> Vec<Vec<(f64, f64)>> {
    let mut joined = Joined::default();
    for j in 1..grid.counts[1] {
        for i in 1..grid.counts[0] {
            let corners = [(i - 1, j - 1), (i, j - 1), (i, j), (i - 1, j)];
            let four = corners.map(|(i, j)| grid.at(i, j));
            let [Some(a), Some(b), Some(c), Some(d)] = four else { continue };
            let heights = [a, b, c, d];
            let edges = [(i - 1, j - 1, 0), (i, j - 1, 1), (i - 1, j, 0), (i - 1, j - 1, 1)];
            let crossed: Vec<CellEdge> = (0..4)
                .filter(|k| (heights[*k] < level) != (heights[(*k + 1) % 4] < level))
                .map(|k| edges[k])
                .collect();
            for pair in crossed.chunks_exact(2) {
                joined.add(pair[0], pair[1]);
            }
        }
    }
    let point = |(i, j, axis): &CellEdge| {
        let from = grid.at(*i, *j).unwrap_or(level);
        let to = grid.at(i + (1 - axis), j + axis).unwrap_or(level);
        let share = if to == from { 0.5 } else { (level - from) / (to - from) };
        let (dx, dy) = if *axis == 0 { (share, 0.0) } else { (0.0, share) };
        (
            grid.corner[0] + grid.cell * (*i as f64 + 0.5 + dx),
            grid.corner[1] + grid.cell * (*j as f64 + 0.5 + dy),
        )
    };
    joined.chains().iter().map(|chain| chain.iter().map(point).collect()).collect()
}

/// Pieces that share an edge are one line.
#[derive(Default)]
struct Joined {
    neighbours: BTreeMap<CellEdge, [Option<CellEdge>; 2]>,
}

impl Joined {
    fn add(&mut self, a: CellEdge, b: CellEdge) {
        for (from, to) in [(a, b), (b, a)] {
            let both = self.neighbours.entry(from).or_default();
            if both[0].is_none() {
                both[0] = Some(to);
            } else {
                both[1] = Some(to);
            }
        }
    }

    /// Each line once: first those with ends, then closed ones.
    fn chains(mut self) -> Vec<Vec<CellEdge>> {
        let ends: Vec<CellEdge> =
            self.neighbours.iter().filter(|(_, n)| n[1].is_none()).map(|(edge, _)| *edge).collect();
        let mut chains: Vec<Vec<CellEdge>> = ends.into_iter().filter_map(|end| self.take(end)).collect();
        while let Some(start) = self.neighbours.keys().next().copied() {
            let Some(mut ring) = self.take(start) else { break };
            ring.push(start);
            chains.push(ring);
        }
        chains
    }

    /// The line from `start` on, which is removed.
    fn take(&mut self, start: CellEdge) -> Option<Vec<CellEdge>> {
        let mut next = self.neighbours.remove(&start)?;
        let mut chain = vec![start];
        while let Some((edge, beyond)) =
            next.into_iter().flatten().find_map(|edge| Some((edge, self.neighbours.remove(&edge)?)))
        {
            chain.push(edge);
            next = beyond;
        }
        Some(chain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_has_one_closed_line_of_its_radius_and_a_plane_a_straight_one() {
        let cone = |x: f64, y: f64| Some(10.0 - x.hypot(y));
        let grid = ShadedGrid::new([[-8.0, -8.0], [8.0, 8.0]], 160, &cone);
        let found = lines(&grid, 5.0);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].first(), found[0].last());
        assert!(found[0].iter().all(|(x, y)| (x.hypot(*y) - 5.0).abs() < 1e-3));
        let plane = |x: f64, _: f64| Some(x);
        let found = lines(&ShadedGrid::new([[0.0, 0.0], [10.0, 10.0]], 20, &plane), 3.3);
        assert_eq!((found.len(), found[0].len()), (1, 20));
        assert!(found[0].iter().all(|(x, _)| (x - 3.3).abs() < 1e-12));
    }
}
