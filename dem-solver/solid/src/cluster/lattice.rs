//! A box filled by equal, overlapping spheres.
//!
//! All edges take the fewest spheres of one radius r that lie flush with the faces and no further apart than
//! `s = r / 0.8`. The radius is the smallest with which they are no more than asked for: it fills some edge a exactly,
//! with k spheres of `s = a / (k + 0.6)`; a cube so gets k x k x k.
//!
//! A cube of edge a so takes n x n x n spheres of radius 0.8 s at `s = a / (n + 0.6)`, as in the published drop test of a block
//! into a net.
//!
//! Spheres must overlap: between spheres that only touch there are planes of zero thickness, through
//! which a thin wire passes without meeting a force.

use super::wish::MOST_SPHERES;
use crate::geometry::sphere::Sphere;
use interface_defs::diagnostic::Diagnostic;
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
    /// The finest lattice of at most `asked` spheres in a box with edges `size` [m]; in `Err` the fewest spheres that
    /// fill it in one layer, where those are more.
    pub fn within(size: [f64; 3], asked: u32) -> Result<Self, u64> {
        let shortest = size.into_iter().fold(f64::INFINITY, f64::min);
        // A single sphere fills the edge: 0.8 / 1.6 = 1/2.
        let coarsest = Self::with(size, 0.8 * shortest / 1.6);
        let asked = asked.min(MOST_SPHERES);
        if coarsest.total() > u64::from(asked) {
            return Err(coarsest.total());
        }
        // With these radii k spheres just fill an edge: between two of them no number changes.
        let just = size.into_iter().flat_map(|a| (1..=asked).map(move |k| 0.8 * a / (f64::from(k) + 0.6)));
        let mut radii: Vec<f64> = just.filter(|r| *r <= coarsest.radius).collect();
        radii.sort_by(|a, b| b.total_cmp(a));
        let fitting = radii.partition_point(|r| Self::with(size, *r).total() <= u64::from(asked));
        Ok(fitting.checked_sub(1).map_or(coarsest, |k| Self::with(size, radii[k])))
    }

    /// Rows of spheres of this radius [m].
    fn with(size: [f64; 3], radius: f64) -> Self {
        let rest = size.map(|a| a - 2.0 * radius);
        // The step of one part in a billion keeps rounding from adding a sphere.
        let counts = rest.map(|r| ((r / (1.25 * radius) - 1e-9).ceil().max(0.0) as u32).saturating_add(1));
        let spacing = [0, 1, 2].map(|a| if counts[a] > 1 { rest[a] / f64::from(counts[a] - 1) } else { 0.0 });
        Self { counts, radius, spacing }
    }

    /// Distance of the box's corners from the spheres [m]: the largest error. Between four neighbours on a face it
    /// is at most 0.53 radii, and no sphere reaches out of the box.
    pub fn largest_error(&self) -> f64 {
        self.radius * (3.0_f64.sqrt() - 1.0)
    }

    /// Number of spheres.
    pub fn total(&self) -> u64 {
        self.counts.iter().fold(1_u64, |product, n| product.saturating_mul((*n).into()))
    }

    /// The spheres: x fastest, z slowest, so that a layer lies together in memory.
    pub fn spheres(&self) -> Vec<Sphere> {
        let [nx, ny, _] = self.counts;
        // From the middle outwards, so that the cluster is symmetric to the last bit.
        let at = |axis: usize, i: u32| {
            (f64::from(i) - 0.5 * f64::from(self.counts[axis] - 1)) * self.spacing[axis]
        };
        let centre = |n: u32| Vector3::new(at(0, n % nx), at(1, n / nx % ny), at(2, n / nx / ny));
        (0..self.total() as u32).map(|n| Sphere { centre: centre(n), radius: self.radius }).collect()
    }
}

/// The lattice of at most `asked` spheres, if there is one and its error is no more than `largest` [m]. `names` are how
/// these two are written, for what to try.
pub fn lattice(
    size: [f64; 3],
    asked: u32,
    largest: Option<f64>,
    names: [&str; 2],
) -> Result<Lattice, Diagnostic> {
    let [a, b, c] = size;
    let [spheres, bound] = names;
    let found = Lattice::within(size, asked).map_err(|fewest| {
        let refused = Diagnostic::new(format!(
            "a lattice in a box of {a} x {b} x {c} m takes at least {fewest} spheres, one layer of them: {asked} were asked for"
        ));
        if fewest > u64::from(MOST_SPHERES) {
            refused.try_instead(format!("{MOST_SPHERES} are possible: the method `medial` takes fewer"))
        } else {
            refused.try_instead(format!("`{spheres} {fewest}`, or the method `medial`, which takes fewer"))
        }
    })?;
    match largest {
        Some(most) if found.largest_error() > most => {
            let radius = most / (3.0_f64.sqrt() - 1.0);
            let required = Lattice::with(size, radius).total();
            let (total, error) = (found.total(), found.largest_error());
            Err(Diagnostic::new(format!(
                "a lattice of {total} spheres lies up to {error:.3e} m from the corners of the box, beyond {bound} {most:e} m"
            ))
            .try_instead(format!("{required} spheres keep it (`{spheres} {required}`; {MOST_SPHERES} are possible)")))
        }
        _ => Ok(found),
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
    fn a_cube_takes_the_largest_cube_number_that_was_asked_for() {
        for (asked, along) in
            [(1, 1), (7, 1), (8, 2), (64, 4), (124, 4), (125, 5), (21_952, 28), (22_232, 28), (27_000, 30)]
        {
            let lattice = Lattice::within([0.41; 3], asked).expect("fits");
            assert_eq!(lattice.counts, [along; 3], "{asked}");
            let s = 0.41 / (f64::from(along) + 0.6);
            assert!((lattice.radius - 0.8 * s).abs() < 1e-16);
            assert!(along == 1 || (lattice.spacing[0] - s).abs() < 1e-15);
        }
    }

    #[test]
    fn spheres_are_flush_with_the_faces_and_overlap_in_any_box() {
        for size in [[0.41; 3], [0.2, 0.4, 0.6], [1.0, 0.1, 0.1], [0.3, 0.31, 2.0]] {
            for asked in [22, 60, 200, 5000] {
                let lattice = Lattice::within(size, asked).expect("fits");
                assert!(lattice.total() <= u64::from(asked));
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

    /// A plate of 2 x 1 x 0.01 m took 51 200 spheres where 64 were asked for, a thinner one all memory.
    #[test]
    fn a_box_that_one_layer_of_so_few_spheres_does_not_fill_is_refused_with_the_fewest() {
        // Spacing of one layer: 0.8^-1 times half the thickness.
        let fewest = |a: f64, b: f64, t: f64| {
            let along = |edge: f64| ((edge - t) / (0.625 * t)).ceil() + 1.0;
            (along(a) * along(b)) as u64
        };
        for thickness in [0.05, 0.01] {
            let found = Lattice::within([2.0, 1.0, thickness], 64);
            assert_eq!(found, Err(fewest(2.0, 1.0, thickness)), "{thickness}");
        }
        assert!(Lattice::within([2.0, 1.0, 1e-12], 50_000).is_err_and(|n| n > 1_000_000_000));
        assert_eq!(Lattice::within([2.0, 1.0, 0.2], 200).map(|l| l.total()), Ok(fewest(2.0, 1.0, 0.2)));
    }

    /// The corner is judged by the distance to every sphere, the faces at points of a grid.
    #[test]
    fn the_error_of_a_lattice_is_that_of_points_on_its_box() {
        for (size, asked) in [([0.41; 3], 64), ([0.2, 0.4, 0.6], 200), ([2.0, 1.0, 0.2], 200)] {
            let lattice = Lattice::within(size, asked).expect("fits");
            let spheres = lattice.spheres();
            let gap = |p: Vector3<f64>| {
                spheres.iter().map(|s| (s.centre - p).norm() - s.radius).fold(f64::INFINITY, f64::min)
            };
            let mut largest = 0.0_f64;
            for (axis, i, j) in
                (0..3).flat_map(|k| (0..=80).flat_map(move |i| (0..=80).map(move |j| (k, i, j))))
            {
                let mut p = Vector3::from(size) * 0.5;
                p[(axis + 1) % 3] *= f64::from(i) / 40.0 - 1.0;
                p[(axis + 2) % 3] *= f64::from(j) / 40.0 - 1.0;
                largest = largest.max(gap(p));
            }
            assert!((largest / lattice.largest_error() - 1.0).abs() < 1e-12, "{size:?}");
        }
    }

    #[test]
    fn a_lattice_is_symmetric_to_the_last_bit() {
        let spheres = Lattice::within([0.41; 3], 512).expect("fits").spheres();
        let sum: Vector3<f64> = spheres.iter().map(|s| s.centre).sum();
        let mirrored = spheres.iter().rev().zip(&spheres).all(|(a, b)| a.centre == -b.centre);
        assert!(mirrored, "{sum}");
    }
}
