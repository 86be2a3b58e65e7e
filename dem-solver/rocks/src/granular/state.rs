//! What a window of many spheres starts from and ends with, all at one instant. One array for each
//! quantity; a sphere's number is its place.

use crate::model::state::refilled;
use dem_contact::law::contact_point::History;
use dem_contact::settings::placement::Start;
use nalgebra::Vector3;

/// State of all spheres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GranularState {
    /// Time [s].
    pub time: f64,
    /// Centre [m].
    pub position: Vec<Vector3<f64>>,
    /// Velocity [m/s].
    pub velocity: Vec<Vector3<f64>>,
    /// Angular velocity [rad/s].
    pub spin: Vec<Vector3<f64>>,
    /// Acceleration in the middle of the last step [m/s2].
    pub acceleration: Vec<Vector3<f64>>,
    /// Angular acceleration in the middle of the last step [rad/s2].
    pub turning: Vec<Vector3<f64>>,
    /// Histories of pairs that touch, by first and second; what acts on the first.
    pub histories: Vec<(u32, u32, History)>,
    /// Energy of the tangential and rolling springs [J].
    pub tangential_energy: f64,
    /// Energy of the normal springs [J].
    pub elastic: f64,
    /// Energy dissipated since t = 0 [J].
    pub dissipated: f64,
    /// Number of contacts.
    pub contacts: usize,
    /// Deepest overlap so far over the radius of the smaller sphere, and when [1, s].
    pub deepest: (f64, f64),
}

impl GranularState {
    /// At t = 0.
    pub fn new(start: &Start, gravity: Vector3<f64>) -> Self {
        let count = start.position.len();
        Self {
            position: start.position.clone(),
            velocity: start.velocity.clone(),
            spin: vec![Vector3::zeros(); count],
            acceleration: vec![gravity; count],
            turning: vec![Vector3::zeros(); count],
            ..Self::default()
        }
    }

    /// Become `other`, without allocating while its histories fit.
    pub fn copy(&mut self, other: &Self) {
        *self = Self {
            position: refilled(&mut self.position, &other.position),
            velocity: refilled(&mut self.velocity, &other.velocity),
            spin: refilled(&mut self.spin, &other.spin),
            acceleration: refilled(&mut self.acceleration, &other.acceleration),
            turning: refilled(&mut self.turning, &other.turning),
            histories: refilled(&mut self.histories, &other.histories),
            ..*other
        };
    }
}
