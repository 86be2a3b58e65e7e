//! When a window is accepted: displacement and velocity each relative or absolute.

use std::ops::Range;

/// Tolerances of `[coupling]`.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    /// Relative to the window's increment.
    pub relative: f64,
    /// Absolute [m]; velocities count times the window's length.
    pub absolute: f64,
}

/// Largest residual of one iteration over the judged nodes, and the largest increment beside it.
///
/// Largest, not mean: "no node in reach is off by more than this".
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Residual {
    /// Displacement residual [m].
    pub displacement: f64,
    /// Increment of displacement in the window [m].
    pub displacement_increment: f64,
    /// Velocity residual times the window's length [m].
    pub velocity: f64,
    /// Increment of velocity times the window's length [m].
    pub velocity_increment: f64,
}

impl Residual {
    /// Nothing is known: no number.
    pub const UNKNOWN: Self = Self {
        displacement: f64::NAN,
        displacement_increment: f64::NAN,
        velocity: f64::NAN,
        velocity_increment: f64::NAN,
    };

    /// Whether displacement and velocity each pass one of the two tolerances.
    pub fn passes(&self, tolerance: &Tolerance) -> bool {
        let one = |residual: f64, increment: f64| {
            residual <= tolerance.absolute || residual <= tolerance.relative * increment
        };
        one(self.displacement, self.displacement_increment) && one(self.velocity, self.velocity_increment)
    }
}

/// Largest distance of `a` and `b` (three components per node) over the ranges of nodes `nodes`.
///
/// Squares of several nodes side by side and one root at the end: thousands of nodes in a microsecond.
pub fn largest_distance(a: &[f64], b: &[f64], nodes: &[Range<usize>]) -> f64 {
    let mut lanes = [0.0_f64; NODES];
    for range in nodes {
        let range = 3 * range.start..3 * range.end;
        let (a, b) = (&a[range.clone()], &b[range]);
        let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<{ 3 * NODES }>(), b.as_chunks::<{ 3 * NODES }>());
        for (a, b) in a.iter().zip(b) {
            let squares: [f64; 3 * NODES] = std::array::from_fn(|i| (a[i] - b[i]) * (a[i] - b[i]));
            for (n, lane) in lanes.iter_mut().enumerate() {
                *lane = larger(*lane, squares[3 * n] + squares[3 * n + 1] + squares[3 * n + 2]);
            }
        }
        for (a, b) in a_rest.as_chunks::<3>().0.iter().zip(b_rest.as_chunks::<3>().0) {
            let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
            lanes[0] = larger(lanes[0], d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        }
    }
    lanes.into_iter().fold(0.0, larger).sqrt()
}

/// Without the care of [`f64::max`] for NaN, which costs more than all the rest: answers are finite.
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Nodes that are worked on side by side.
const NODES: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn displacement_and_velocity_must_each_pass_one_of_the_two() {
        let tolerance = Tolerance { relative: 1e-3, absolute: 1e-6 };
        let r = |displacement, velocity| Residual {
            displacement,
            displacement_increment: 1e-2,
            velocity,
            velocity_increment: 0.0,
        };
        assert!(r(1e-5, 1e-6).passes(&tolerance), "relative, absolute");
        assert!(!r(1.1e-5, 0.0).passes(&tolerance));
        assert!(!r(0.0, 1.1e-6).passes(&tolerance));
        assert!(!r(f64::NAN, 0.0).passes(&tolerance), "NaN never passes");
    }

    #[test]
    fn a_window_in_which_nothing_moves_passes() {
        assert!(Residual::default().passes(&Tolerance { relative: 0.0, absolute: 0.0 }));
    }

    #[test]
    fn the_largest_distance_is_that_of_the_worst_node_in_the_ranges() {
        let a: Vec<f64> = (0..60).map(f64::from).collect();
        let mut b = a.clone();
        b[3 * 17] += 3.0;
        b[3 * 17 + 2] -= 4.0;
        b[3 * 2 + 1] += 1.0;
        assert_eq!(largest_distance(&a, &b, &[0..12, 12..20]), 5.0);
        assert_eq!(largest_distance(&a, &b, &[0..9, 10..17, 18..20]), 1.0);
        assert_eq!(largest_distance(&a, &b, &[]), 0.0);
    }
}
