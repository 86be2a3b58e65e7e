//! What moves of a rock.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// What moves of a rock, all at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Centre of mass [m].
    pub position: Vector3<f64>,
    /// Velocity of the centre of mass [m/s].
    pub velocity: Vector3<f64>,
    /// From the rock's own frame to space.
    pub orientation: UnitQuaternion<f64>,
    /// Angular momentum about the centre of mass, along the axes of space [kg m2/s].
    pub angular_momentum: Vector3<f64>,
    /// Acceleration in the middle of the last step [m/s2]: from it the velocity in the middle of the
    /// next one is predicted, for the forces that depend on it.
    pub acceleration: Vector3<f64>,
    /// Torque in the middle of the last step [N m], for the same purpose.
    pub torque: Vector3<f64>,
}

impl Motion {
    /// Rotation matrix, own frame to space.
    #[inline]
    pub fn rotation(&self) -> Matrix3<f64> {
        self.orientation.to_rotation_matrix().into_inner()
    }

    /// True if every number is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        let sum = self.position.sum() + self.velocity.sum() + self.angular_momentum.sum();
        (sum + self.orientation.coords.sum()).is_finite()
    }
}
