//! What a window of many spheres starts from and ends with, all at one instant. One array for each
//! quantity; a sphere's number is its place.

use crate::law::contact_point::Past;
use crate::settings::placement::Start;
use nalgebra::Vector3;

/// What a pair that touches remembers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Held {
    /// Overlap in the middle of the last step [m]; 0: the pair did not touch.
    pub overlap: f64,
    /// Force of the tangential spring on the first [N].
    pub spring: Vector3<f64>,
    /// Moment of the rolling spring on the first [N m].
    pub moment: Vector3<f64>,
}

impl Held {
    /// What the contact has from it.
    #[inline]
    pub fn past(&self) -> Past {
        Past { spring: self.spring, moment: self.moment, overlap: self.overlap, ..Past::default() }
    }
}

/// State of all spheres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
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
    /// Pairs that touch and remember, by first and second.
    pub memories: Vec<(u32, u32, Held)>,
    /// Energy of the tangential and rolling springs [J].
    pub sheared: f64,
    /// Energy of the normal springs [J].
    pub elastic: f64,
    /// Energy dissipated since t = 0 [J].
    pub dissipated: f64,
    /// Number of contacts.
    pub contacts: usize,
    /// Deepest overlap so far over the radius of the smaller sphere, and when [1, s].
    pub deepest: (f64, f64),
}

impl State {
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

    /// Become `other`, without allocating while its memories fit.
    pub fn copy(&mut self, other: &Self) {
        self.position.clone_from(&other.position);
        self.velocity.clone_from(&other.velocity);
        self.spin.clone_from(&other.spin);
        self.acceleration.clone_from(&other.acceleration);
        self.turning.clone_from(&other.turning);
        self.memories.clone_from(&other.memories);
        (self.time, self.sheared, self.elastic) = (other.time, other.sheared, other.elastic);
        (self.dissipated, self.contacts, self.deepest) = (other.dissipated, other.contacts, other.deepest);
    }
}
