//! Which spheres may touch each other or a mesh: a list of pairs, found on a grid.
//!
//! A pair is listed while its surfaces are closer than a skin; the list is good until some sphere has
//! moved by half of it. Pairs stand by their first sphere, then by the second, whatever the age of the
//! list: what is summed up in their order does not depend on when the list was made.

pub use crate::settings::spheres::Plane;
use dem_solid::geometry::bounds;
use nalgebra::Vector3;

/// A pair: the second is a sphere, or a mesh (number of spheres plus number of the mesh).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SpherePair {
    /// Number of the second.
    pub second: u32,
    /// Number of the law.
    pub law: u16,
    /// Effective radius [m].
    pub radius: f64,
    /// `sqrt(m*)` [kg^(1/2)].
    pub root_mass: f64,
}

/// The pairs, by first sphere.
#[derive(Debug, Clone, Default)]
pub struct SpherePairs {
    /// For each sphere the first of its pairs, and the end.
    pub start: Vec<u32>,
    /// The pairs.
    pub pairs: Vec<SpherePair>,
    /// For each sphere the first in `back` of those pairs in which it is the second, and the end.
    pub back_start: Vec<u32>,
    /// Numbers of those pairs, ascending, sphere by sphere.
    pub back: Vec<u32>,
    /// Centres when the list was made [m].
    pub reference: Vec<Vector3<f64>>,
    /// Times that it was made.
    pub searches: u64,
    cell_start: Vec<u32>,
    sorted: Vec<u32>,
    cell_of: Vec<u32>,
    found: Vec<u32>,
}

/// Most cells per sphere: a few far-off spheres must not fill the memory with empty cells.
const CELLS_PER_SPHERE: usize = 4;

impl SpherePairs {
    /// List the pairs whose surfaces are closer than `skin` [m]. `complete` fills in what the pair of two
    /// numbers needs beside them.
    pub fn build(
        &mut self,
        position: &[Vector3<f64>],
        radius: &[f64],
        planes: &[Plane],
        skin: f64,
        complete: impl Fn(usize, u32) -> SpherePair,
    ) {
        self.searches += 1;
        self.reference.clear();
        self.reference.extend_from_slice(position);
        let count = position.len();
        let largest = radius.iter().copied().fold(0.0, f64::max);
        let grid = Grid::new(position, 2.0 * largest + skin);
        // The spheres by cells, in each cell by number.
        self.cell_of.clear();
        self.cell_of.extend(position.iter().map(|x| grid.number(grid.cell(x)) as u32));
        let cells = grid.counts.iter().product::<usize>();
        counting_sort(&self.cell_of, cells, &mut self.cell_start, &mut self.sorted);
        self.start.clear();
        self.pairs.clear();
        self.start.push(0);
        for i in 0..count {
            let (x, r) = (&position[i], radius[i] + skin);
            self.found.clear();
            let cell = grid.cell(x);
            let range = |a: usize| cell[a].saturating_sub(1)..=(cell[a] + 1).min(grid.counts[a] - 1);
            for z in range(2) {
                for y in range(1) {
                    // Cells along x lie side by side.
                    let row = |cx: usize| grid.number([cx, y, z]);
                    let first = self.cell_start[row(*range(0).start())] as usize;
                    let last = self.cell_start[row(*range(0).end()) + 1] as usize;
                    for &j in &self.sorted[first..last] {
                        let reach = r + radius[j as usize];
                        if j as usize > i && (position[j as usize] - x).norm_squared() < reach * reach {
                            self.found.push(j);
                        }
                    }
                }
            }
            self.found.sort_unstable();
            for (k, plane) in planes.iter().enumerate() {
                if plane.offset - plane.normal.dot(x) < r {
                    self.found.push((count + k) as u32);
                }
            }
            self.pairs.extend(self.found.iter().map(|&second| complete(i, second)));
            self.start.push(self.pairs.len() as u32);
        }
        // The same pairs by their second.
        self.cell_of.clear();
        self.cell_of.extend(self.pairs.iter().map(|p| p.second.min(count as u32)));
        counting_sort(&self.cell_of, count + 1, &mut self.back_start, &mut self.back);
    }
}

/// Numbers of items by their key, ascending within a key; `start` has for each key its first, and the end.
fn counting_sort(keys: &[u32], count: usize, start: &mut Vec<u32>, sorted: &mut Vec<u32>) {
    start.clear();
    start.resize(count + 1, 0);
    for key in keys {
        start[*key as usize + 1] += 1;
    }
    for k in 0..count {
        start[k + 1] += start[k];
    }
    sorted.clear();
    sorted.resize(keys.len(), 0);
    // `start` serves as the place to fill, which leaves it one key ahead.
    for (i, key) in keys.iter().enumerate() {
        sorted[start[*key as usize] as usize] = i as u32;
        start[*key as usize] += 1;
    }
    start.copy_within(0..count, 1);
    start[0] = 0;
}

/// Equal cells around all spheres.
struct Grid {
    lowest: Vector3<f64>,
    inverse: Vector3<f64>,
    counts: [usize; 3],
}

impl Grid {
    fn new(position: &[Vector3<f64>], width: f64) -> Self {
        let [lowest, highest] = bounds(position.iter().copied());
        let size = highest - lowest;
        let most = (CELLS_PER_SPHERE * position.len() + 64) as f64;
        let mut width = width;
        let counts = |width: f64| size.map(|s| (s / width).floor().max(1.0));
        while counts(width).product() > most {
            width *= 1.25;
        }
        let counts = counts(width);
        // A cell is not narrower than `width`.
        let inverse = counts.component_div(&size).map(|i| if i.is_finite() { i } else { 0.0 });
        Self { lowest, inverse, counts: [0, 1, 2].map(|a| counts[a] as usize) }
    }

    fn cell(&self, x: &Vector3<f64>) -> [usize; 3] {
        let at = (x - self.lowest).component_mul(&self.inverse);
        [0, 1, 2].map(|a| (at[a] as usize).min(self.counts[a] - 1))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_finds_what_a_look_at_every_pair_finds() {
        for count in [1_usize, 2, 30, 400] {
            let at = |i: usize, f: f64| (i as f64 * f).sin();
            let position: Vec<_> =
                (0..count).map(|i| Vector3::new(at(i, 1.3), 3.0 * at(i, 2.7), 0.2 * at(i, 3.1))).collect();
            let radius: Vec<_> = (0..count).map(|i| 0.02 + 0.1 * at(i, 0.7).abs()).collect();
            let planes = [Plane { normal: Vector3::x(), offset: 0.9 }];
            let mut list = SpherePairs::default();
            let pair = |_, second| SpherePair { second, law: 0, radius: 1.0, root_mass: 1.0 };
            list.build(&position, &radius, &planes, 0.03, pair);
            let mut every = Vec::new();
            for i in 0..count {
                for j in i + 1..count {
                    if (position[i] - position[j]).norm() < radius[i] + radius[j] + 0.03 {
                        every.push((i, j));
                    }
                }
                if 0.9 - position[i].x < radius[i] + 0.03 {
                    every.push((i, count));
                }
            }
            let of = |i: usize| list.start[i] as usize..list.start[i + 1] as usize;
            let found: Vec<_> = (0..count)
                .flat_map(|i| of(i).map(move |p| (i, p)))
                .map(|(i, p)| (i, list.pairs[p].second as usize))
                .collect();
            assert_eq!(found, every);
            for j in 0..count {
                let back = &list.back[list.back_start[j] as usize..list.back_start[j + 1] as usize];
                let expected: Vec<u32> = (0..list.pairs.len() as u32)
                    .filter(|p| list.pairs[*p as usize].second == j as u32)
                    .collect();
                assert_eq!(back, expected);
            }
        }
    }
}
