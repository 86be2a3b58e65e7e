//! Gauges: value at the window's end, smallest and largest over its steps.

use crate::model::Model;
use crate::model::state::State;
use dem_contact::settings::{RockSettings, Settings};
use interface_defs::message::{Gauge, Role};
use nalgebra::Vector3;

/// Place of the stored energy among the numbers of all rocks together.
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
#[derive(Debug, Clone, Default)]
pub struct Gauges {
    /// What is added to local positions.
    origin: Vector3<f64>,
    origins: Vec<Vector3<f64>>,
    down: Vector3<f64>,
    /// Energy of all springs in the middle of the present step [J].
    springs: f64,
    values: Vec<f64>,
    /// Place of the numbers of all rocks together.
    together: usize,
}

/// The energies that every run of rocks has.
pub fn energies() -> [Gauge; 4] {
    [
        ("energy_kinetic_dem", Role::Kinetic),
        ("energy_potential_dem", Role::Potential),
        ("energy_stored_dem", Role::Stored),
        ("energy_dissipated_dem", Role::Dissipated),
    ]
    .map(|(name, role)| Gauge { role, ..Gauge::new(name, "J") })
}

impl Gauges {
    /// Those of a scene.
    pub fn new(settings: &Settings, origin: Vector3<f64>) -> Self {
        let start = |r: &RockSettings| Vector3::from(r.position) - origin;
        Self {
            origin,
            origins: settings.rocks.iter().map(start).collect(),
            down: settings.down(),
            ..Self::default()
        }
    }

    /// Their names, in order.
    pub fn declared(model: &Model) -> Vec<Gauge> {
        let settings = &model.settings;
        let mut gauges = Vec::new();
        for rock in model.rocks.iter().take(settings.named()) {
            for (names, unit) in [
                (&["x", "y", "z"][..], "m"),
                (&["vx", "vy", "vz"], "m/s"),
                (&["lowest"], "m"),
                (&["wx", "wy", "wz"], "rad/s"),
                (&["orientation_w", "orientation_x", "orientation_y", "orientation_z"], "1"),
            ] {
                gauges.extend(names.iter().map(|name| Gauge::new(format!("{}_{name}", rock.name), unit)));
            }
        }
        gauges.extend(energies());
        gauges.push(Gauge { role: Role::Received, ..Gauge::new("energy_received_dem", "J") });
        gauges.push(Gauge::new("contacts", "1"));
        for group in &settings.spheres {
            gauges.push(Gauge::new(format!("{}_fastest", group.name), "m/s"));
            let centre = ["x", "y", "z"].map(|axis| format!("{}_centre_of_mass_{axis}", group.name));
            gauges.extend(centre.map(|name| Gauge::new(name, "m")));
        }
        gauges
    }

    /// A window begins: smallest and largest are still open.
    pub fn begin(&mut self, output: &mut [f64]) {
        self.springs = 0.0;
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
            self.values[self.together + STORED] = self.springs;
        }
        for (gauge, &value) in output.chunks_exact_mut(3).zip(&self.values) {
            gauge[0] = value;
            gauge[1] = if value < gauge[1] { value } else { gauge[1] };
            gauge[2] = if value > gauge[2] { value } else { gauge[2] };
        }
    }

    fn read(&mut self, model: &Model, state: &State) {
        self.values.clear();
        let (mut kinetic, mut potential, mut stored, mut contacts) = (0.0, 0.0, 0.0, 0);
        let named = model.settings.named();
        for (number, (rock, body)) in model.rocks.iter().zip(&state.bodies).enumerate() {
            let (motion, origin) = (&body.motion, &self.origins[number]);
            if number < named {
                self.values.extend_from_slice((motion.position + self.origin).as_slice());
                self.values.extend_from_slice(motion.velocity.as_slice());
                self.values.push(-rock.depth(motion, &self.down) - self.origin.dot(&self.down));
                self.values.extend_from_slice(rock.spin(motion).as_slice());
                let turned = rock.shape_orientation(motion);
                self.values.extend([turned.w, turned.i, turned.j, turned.k]);
            }
            kinetic += rock.kinetic_energy(motion);
            potential -= rock.mass * model.settings.gravity.dot(&(motion.position - origin));
            stored += body.elastic + body.tangential_energy;
            contacts += body.contacts;
        }
        let rock_contacts = &state.between_rocks;
        stored += rock_contacts.elastic + rock_contacts.tangential_energy;
        contacts += rock_contacts.contacts;
        self.together = self.values.len();
        self.values.extend([kinetic, potential, stored, state.dissipated, state.received, contacts as f64]);
        for number in 0..model.settings.spheres.len() {
            self.read_group(model, state, number);
        }
    }

    /// The numbers of table number `number` of separate spheres.
    fn read_group(&mut self, model: &Model, state: &State, number: usize) {
        let named = model.settings.named();
        let (mut fastest, mut mass, mut centre) = (0.0_f64, 0.0, Vector3::zeros());
        for (k, _) in model.settings.group.iter().enumerate().filter(|(_, g)| usize::from(**g) == number) {
            let (rock, motion) = (&model.rocks[named + k], &state.bodies[named + k].motion);
            fastest = fastest.max(motion.velocity.norm());
            mass += rock.mass;
            centre += motion.position * rock.mass;
        }
        self.values.push(fastest);
        self.values.extend_from_slice((centre / mass + self.origin).as_slice());
    }
}
