//! When a window is accepted: displacement and velocity each relative or absolute.

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
/// Largest, not mean: "no wall node in reach is off by more than this".
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
    /// Whether displacement and velocity each pass one of the two tolerances.
    pub fn passes(&self, tolerance: &Tolerance) -> bool {
        let one = |residual: f64, increment: f64| {
            residual <= tolerance.absolute || residual <= tolerance.relative * increment
        };
        one(self.displacement, self.displacement_increment) && one(self.velocity, self.velocity_increment)
    }

    /// Take in one node: residuals and increments of its three components. Squares are collected, for
    /// the sake of thousands of roots; [`Residual::rooted`] ends it.
    pub fn take(
        &mut self,
        displacement: [f64; 3],
        increment: [f64; 3],
        velocity: [f64; 3],
        change: [f64; 3],
    ) {
        self.displacement = self.displacement.max(square(displacement));
        self.displacement_increment = self.displacement_increment.max(square(increment));
        self.velocity = self.velocity.max(square(velocity));
        self.velocity_increment = self.velocity_increment.max(square(change));
    }

    /// The residual whose squares were collected.
    #[must_use]
    pub fn rooted(self) -> Self {
        Self {
            displacement: self.displacement.sqrt(),
            displacement_increment: self.displacement_increment.sqrt(),
            velocity: self.velocity.sqrt(),
            velocity_increment: self.velocity_increment.sqrt(),
        }
    }
}

fn square(x: [f64; 3]) -> f64 {
    x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
}

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
}
