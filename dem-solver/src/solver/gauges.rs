//! Gauges: value at the window's end, smallest and largest over its steps.

use super::Model;
use super::state::State;
use crate::rock::Rock;
use crate::settings::{RockSettings, Settings};
use interface_defs::message::{Gauge, Role};
use nalgebra::Vector3;

/// Numbers per rock: position, velocity, lowest point, angular velocity, orientation.
const PER_ROCK: usize = 14;
/// Numbers of all rocks together: five energies and the contacts.
const TOGETHER: usize = 6;
/// Place of the stored energy among those.
const STORED: usize = 2;

/// When the gauges are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// At the end of a step.
    Step,
    /// At the end of the window.
    End,
}

/// What the gauges are read against.
#[derive(Debug, Clone)]
pub struct Gauges {
    /// What is added to local positions.
    origin: Vector3<f64>,
    origins: Vec<Vector3<f64>>,
    down: Vector3<f64>,
    /// Energy of all springs in the middle of the step under way [J].
    springs: f64,
    values: Vec<f64>,
}

impl Gauges {
    /// Those of a scene.
    pub fn new(settings: &Settings, origin: Vector3<f64>) -> Self {
        let start = |r: &RockSettings| Vector3::from(r.position) - origin;
        Self {
            origin,
            origins: settings.rocks.iter().map(start).collect(),
            down: settings.down(),
            springs: 0.0,
            values: Vec::with_capacity(PER_ROCK * settings.rocks.len() + TOGETHER),
        }
    }

    /// Their number.
    pub fn count(rocks: &[Rock]) -> usize {
        PER_ROCK * rocks.len() + TOGETHER
    }

    /// Their names, in order.
    pub fn declared(rocks: &[Rock]) -> Vec<Gauge> {
        let mut gauges = Vec::with_capacity(Self::count(rocks));
        for rock in rocks {
            for (name, unit) in [
                ("x", "m"),
                ("y", "m"),
                ("z", "m"),
                ("vx", "m/s"),
                ("vy", "m/s"),
                ("vz", "m/s"),
                ("lowest", "m"),
                ("wx", "rad/s"),
                ("wy", "rad/s"),
                ("wz", "rad/s"),
                ("orientation_w", "1"),
                ("orientation_x", "1"),
                ("orientation_y", "1"),
                ("orientation_z", "1"),
            ] {
                gauges.push(Gauge::new(format!("{}_{name}", rock.name), unit));
            }
        }
        for (name, role) in [
            ("energy_kinetic_dem", Role::Kinetic),
            ("energy_potential_dem", Role::Potential),
            ("energy_stored_dem", Role::Stored),
            ("energy_dissipated_dem", Role::Dissipated),
            ("energy_received_dem", Role::Received),
        ] {
            gauges.push(Gauge { role, ..Gauge::new(name, "J") });
        }
        gauges.push(Gauge::new("contacts", "1"));
        gauges
    }

    /// A window begins: smallest and largest are still open.
    pub fn begin(&mut self, state: &State, output: &mut [f64]) {
        self.springs = 0.0;
        debug_assert_eq!(output.len() / 3, PER_ROCK * state.bodies.len() + TOGETHER);
        for gauge in output.chunks_exact_mut(3) {
            (gauge[1], gauge[2]) = (f64::INFINITY, f64::NEG_INFINITY);
        }
    }

    /// The energy of a rock's springs in the middle of a step, when its forces are known; after the last
    /// rock's, that of the springs between rocks [J].
    pub fn spring(&mut self, rock: usize, energy: f64) {
        self.springs = if rock == 0 { energy } else { self.springs + energy };
    }

    /// Read all gauges of `state`.
    ///
    /// During a window the stored energy is that of the middle of the steps, where the forces are
    /// known; at its end that of the end.
    pub fn take(&mut self, model: &Model, state: &State, moment: Moment, output: &mut [f64]) {
        self.read(model, state);
        if moment == Moment::Step {
            self.values[PER_ROCK * model.rocks.len() + STORED] = self.springs;
        }
        for (gauge, &value) in output.chunks_exact_mut(3).zip(&self.values) {
            gauge[0] = value;
            gauge[1] = if value < gauge[1] { value } else { gauge[1] };
            gauge[2] = if value > gauge[2] { value } else { gauge[2] };
        }
    }

    /// All gauges at t = 0.
    pub fn first(&mut self, model: &Model, state: &State, output: &mut [f64]) {
        self.read(model, state);
        for (gauge, &value) in output.chunks_exact_mut(3).zip(&self.values) {
            gauge.fill(value);
        }
    }

    fn read(&mut self, model: &Model, state: &State) {
        self.values.clear();
        let (mut kinetic, mut potential, mut stored, mut contacts) = (0.0, 0.0, 0.0, 0);
        for ((rock, body), origin) in model.rocks.iter().zip(&state.bodies).zip(&self.origins) {
            let motion = &body.motion;
            self.values.extend_from_slice((motion.position + self.origin).as_slice());
            self.values.extend_from_slice(motion.velocity.as_slice());
            self.values.push(-rock.depth(motion, &self.down) - self.origin.dot(&self.down));
            self.values.extend_from_slice(rock.spin(motion).as_slice());
            let turned = rock.shape_orientation(motion);
            self.values.extend([turned.w, turned.i, turned.j, turned.k]);
            kinetic += rock.kinetic_energy(motion);
            potential -= rock.mass * model.settings.gravity.dot(&(motion.position - origin));
            stored += body.elastic + body.sheared;
            contacts += body.contacts;
        }
        let met = &state.encounters;
        stored += met.elastic + met.sheared;
        contacts += met.contacts;
        self.values.extend([kinetic, potential, stored, state.dissipated, state.received, contacts as f64]);
    }
}
