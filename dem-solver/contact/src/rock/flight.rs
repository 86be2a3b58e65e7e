//! A rock in free flight.
//!
//! While nothing acts on a rock, its motion is computed from the instant at which it took off, not from the step before. So
//! its numbers are the same to the last bit, whether the time since then was covered in many steps, in a few looks or at once:
//! a rolling rock makes any difference large, and how long windows are, or which steps are skipped, must not decide where
//! it goes.

use crate::rock::Motion;
use crate::rock::rotation::{is_spherical, turn};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Largest turn between two orientations that are kept [rad]: one short series each.
const TURN: f64 = 0.05;

/// A flight under way. Time is counted in steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Flight {
    /// Motion at its start.
    start: Motion,
    /// Length of a step [s].
    h: f64,
    /// Steps since.
    steps: u64,
    /// Steps between two orientations that are kept, each computed from the one before; 0 where the start alone is.
    stride: u64,
    /// The last of them.
    kept: UnitQuaternion<f64>,
}

impl Flight {
    /// A flight that starts with `start`, in steps of `h` [s], of a rock with the principal moments `inertia` [kg m2].
    pub fn new(inertia: &Vector3<f64>, start: &Motion, h: f64) -> Self {
        let fastest = start.angular_momentum.norm() / inertia.min();
        let stride = match is_spherical(inertia) || fastest == 0.0 {
            true => 0,
            false => (TURN / (fastest * h)).clamp(1.0, 1e9) as u64,
        };
        Self { start: *start, h, steps: 0, stride, kept: start.orientation }
    }

    /// Go on with the flight `under_way`, if its steps are of `h` [s]; else one starts with `now`.
    pub fn resume(under_way: Option<Self>, inertia: &Vector3<f64>, now: &Motion, h: f64) -> Self {
        under_way.filter(|flight| flight.h == h).unwrap_or_else(|| Self::new(inertia, now, h))
    }

    /// Fly `steps` further; the motion then.
    pub fn advance(&mut self, inertia: &Vector3<f64>, gravity: &Vector3<f64>, steps: u64) -> Motion {
        let Self { start, h, stride, .. } = *self;
        let before = self.steps.checked_div(stride).unwrap_or(0);
        self.steps += steps;
        let momentum = start.angular_momentum;
        let later = |q: &UnitQuaternion<f64>, steps: u64| turn(q, &momentum, inertia, steps as f64 * h);
        for _ in before..self.steps.checked_div(stride).unwrap_or(0) {
            self.kept = later(&self.kept, stride);
        }
        let rest = self.steps.checked_rem(stride).unwrap_or(self.steps);
        let time = self.steps as f64 * h;
        Motion {
            position: start.position + (start.velocity + gravity * (0.5 * time)) * time,
            velocity: start.velocity + gravity * time,
            orientation: if rest == 0 { self.kept } else { later(&self.kept, rest) },
            angular_momentum: momentum,
            acceleration: *gravity,
            torque: Vector3::zeros(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

    fn start() -> Motion {
        Motion {
            position: Vector3::new(1.0, 2.0, 30.0),
            velocity: Vector3::new(3.0, -1.0, 2.0),
            orientation: UnitQuaternion::identity(),
            angular_momentum: Vector3::new(4.0, 1.0, -7.0),
            acceleration: GRAVITY,
            torque: Vector3::zeros(),
        }
    }

    #[test]
    fn its_numbers_do_not_depend_on_when_it_was_looked_at() {
        for inertia in [Vector3::new(1.0, 2.0, 2.5), Vector3::new(2.0, 2.0, 2.0)] {
            let of = |looks: &[u64]| {
                let mut flight = Flight::new(&inertia, &start(), 1e-3);
                looks.iter().map(|steps| flight.advance(&inertia, &GRAVITY, *steps)).last().expect("a look")
            };
            let once = of(&[1000]);
            assert_eq!(of(&[1; 1000]), once);
            assert_eq!(of(&[17, 400, 3, 580]), once);
            // By another way: the height of fall, and one turn of all the time.
            assert!((once.position - Vector3::new(4.0, 1.0, 32.0 - 4.905)).norm() < 1e-13);
            let turned = turn(&start().orientation, &start().angular_momentum, &inertia, 1.0);
            assert!(turned.angle_to(&once.orientation) < 1e-13);
        }
    }

    #[test]
    fn other_steps_begin_another_flight() {
        let inertia = Vector3::new(1.0, 2.0, 2.5);
        let mut flight = Flight::new(&inertia, &start(), 1e-3);
        let now = flight.advance(&inertia, &GRAVITY, 10);
        assert_eq!(Flight::resume(Some(flight), &inertia, &now, 1e-3), flight);
        assert_eq!(Flight::resume(Some(flight), &inertia, &now, 2e-3), Flight::new(&inertia, &now, 2e-3));
    }
}
