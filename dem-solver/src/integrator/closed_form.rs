//! Flight in closed form, for windows in which no rock can meet the mesh.
//!
//! Position, velocity and orientation are exact at any time, as those of the steps are. Switching this off changes no more than rounding.

use crate::rock::rotation::{is_spherical, turn};
use crate::rock::{Motion, Rock};
use nalgebra::Vector3;

/// The steps (1 to `steps`) whose ends must be looked at so that smallest and largest values are those
/// of all steps: every one where a rock turns, else the first, the last and those beside an apex.
pub fn instants(
    starts: &[Motion],
    rocks: &[Rock],
    gravity: &Vector3<f64>,
    steps: usize,
    h: f64,
    found: &mut Vec<usize>,
) {
    found.clear();
    if starts.iter().zip(rocks).any(|(m, _)| m.angular_momentum != Vector3::zeros()) {
        found.extend(1..=steps);
        return;
    }
    let mut beside = |apex: f64| {
        if apex > 0.0 && apex < steps as f64 {
            found.extend([apex.floor() as usize, apex.ceil() as usize]);
        }
    };
    for start in starts {
        for axis in 0..3 {
            beside(-start.velocity[axis] / (gravity[axis] * h));
        }
        beside(-start.velocity.dot(gravity) / (gravity.norm_squared() * h));
    }
    found.extend([1, steps]);
    found.retain(|s| *s > 0);
    found.sort_unstable();
    found.dedup();
}

/// Motion at `time` [s] after `start`. `before` is the motion at `earlier` [s] after it.
pub fn motion_at(
    rock: &Rock,
    start: &Motion,
    (before, earlier): (&Motion, f64),
    gravity: &Vector3<f64>,
    time: f64,
) -> Motion {
    let momentum = &start.angular_momentum;
    let orientation = if is_spherical(&rock.inertia) {
        turn(&start.orientation, momentum, &rock.inertia, time)
    } else {
        // On from the last look: a turn costs what its angle is.
        turn(&before.orientation, momentum, &rock.inertia, time - earlier)
    };
    Motion {
        position: start.position + (start.velocity + gravity * (0.5 * time)) * time,
        velocity: start.velocity + gravity * time,
        orientation,
        angular_momentum: *momentum,
        acceleration: *gravity,
        torque: Vector3::zeros(),
    }
}
