//! A box filled by equal, overlapping spheres.
//!
//! Along the shortest edge a stand k spheres: spacing `s = a / (k + 0.6)`, radius `r = 0.8 s`, the
//! outer ones flush with the faces. The other edges take the fewest spheres of that radius that lie
//! flush with the faces and no further apart than `s`; a cube so gets k x k x k.
//!
//! Spheres must overlap: between spheres that only touch there are planes of zero thickness, through
//! which a thin wire passes without meeting a force.
//!
//! Source: handbook 1.8; data of the drop test.

use super::Sphere;
use crate::cluster::MOST_SPHERES;
use nalgebra::Vector3;

/// A lattice of equal spheres in a box centred at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Spheres along x, y, z.
    pub counts: [u32; 3],
    /// Radius [m].
    pub radius: f64,
    /// Distance of neighbours along x, y, z [m]; 0 where there is one sphere.
    pub spacing: [f64; 3],
}

impl Lattice {
    /// The lattice in a box with edges `size` [m] whose number of spheres is nearest to `asked`
    /// (1 to 50 000); of two equally near ones, the coarser.
    pub fn nearest(size: [f64; 3], asked: u32) -> Self {
        let mut best = Self::with(size, 1);
        for along in 2..=36 {
            let next = Self::with(size, along);
            if next.total() > u64::from(MOST_SPHERES)
                || next.total().abs_diff(asked.into()) >= best.total().abs_diff(asked.into())
            {
                break;
            }
            best = next;
        }
        best
    }

    fn with(size: [f64; 3], along: u32) -> Self {
        let shortest = size.into_iter().fold(f64::INFINITY, f64::min);
        // A single sphere fills the edge: 0.8 / 1.6 = 1/2.
        let radius = 0.8 * shortest / (f64::from(along) + 0.6);
        let rest = size.map(|a| a - 2.0 * radius);
        // The step of one part in a billion keeps rounding from adding a sphere.
        let counts = rest.map(|r| ((r / (1.25 * radius) - 1e-9).ceil().max(0.0) as u32).saturating_add(1));
        let mut spacing = [0.0; 3];
        for axis in 0..3 {
            if counts[axis] > 1 {
                spacing[axis] = rest[axis] / f64::from(counts[axis] - 1);
            }
        }
        Self { counts, radius, spacing }
    }

    /// Number of spheres.
    pub fn total(&self) -> u64 {
        self.counts.iter().fold(1_u64, |product, n| product.saturating_mul((*n).into()))
    }

    /// The spheres: x fastest, z slowest, so that a layer lies together in memory.
    pub fn spheres(&self) -> Vec<Sphere> {
        let [nx, ny, nz] = self.counts;
        // From the middle outwards, so that the cluster is symmetric to the last bit.
        let at = |axis: usize, i: u32| {
            (f64::from(i) - 0.5 * f64::from(self.counts[axis] - 1)) * self.spacing[axis]
        };
        let mut spheres = Vec::with_capacity(self.total() as usize);
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    let centre = Vector3::new(at(0, i), at(1, j), at(2, k));
                    spheres.push(Sphere { centre, radius: self.radius });
                }
            }
        }
        spheres
    }
}

/// The corner spheres of a lattice: whatever the direction, one of them is the furthest.
pub fn outermost([nx, ny, nz]: [u32; 3]) -> Vec<u32> {
    let mut corners: Vec<u32> = (0..8)
        .map(|c| {
            let at = |bit: u32, n: u32| if c & bit == 0 { 0 } else { n - 1 };
            (at(4, nz) * ny + at(2, ny)) * nx + at(1, nx)
        })
        .collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_takes_the_nearest_cube_number() {
        for (asked, along) in
            [(1, 1), (4, 1), (5, 2), (64, 4), (100, 5), (21_952, 28), (22_232, 28), (27_000, 30)]
        {
            let lattice = Lattice::nearest([0.41; 3], asked);
            assert_eq!(lattice.counts, [along; 3], "{asked}");
            let s = 0.41 / (f64::from(along) + 0.6);
            assert!((lattice.radius - 0.8 * s).abs() < 1e-16);
            assert!(along == 1 || (lattice.spacing[0] - s).abs() < 1e-15);
        }
    }

    #[test]
    fn spheres_are_flush_with_the_faces_and_overlap_in_any_box() {
        for size in [[0.41; 3], [0.2, 0.4, 0.6], [1.0, 0.1, 0.1], [0.3, 0.31, 2.0]] {
            for asked in [1, 10, 200, 5000] {
                let lattice = Lattice::nearest(size, asked);
                let spheres = lattice.spheres();
                assert_eq!(spheres.len() as u64, lattice.total());
                for axis in 0..3 {
                    let top = spheres.iter().map(|s| s.centre[axis] + s.radius).fold(f64::MIN, f64::max);
                    assert!((top - size[axis] / 2.0).abs() < 1e-15, "{size:?} {asked}");
                    assert!(lattice.spacing[axis] <= 1.25 * lattice.radius * (1.0 + 1e-8));
                }
            }
        }
    }

    #[test]
    fn a_lattice_is_symmetric_to_the_last_bit() {
        let spheres = Lattice::nearest([0.41; 3], 512).spheres();
        let sum: Vector3<f64> = spheres.iter().map(|s| s.centre).sum();
        let mirrored = spheres.iter().rev().zip(&spheres).all(|(a, b)| a.centre == -b.centre);
        assert!(mirrored, "{sum}");
    }
}
