//! Solvers for tests. Spring-mass solvers of a few lines: a node on a spring (the structure), a sphere behind a contact spring (the contact
//! solver), both moving along x; in `honest` a net and a ball with all gauges.

#![allow(dead_code, reason = "each test uses some of it")]

pub mod honest;

use interface_defs::solver::OnProgress;
use interface_defs::*;

/// Fingerprint of the scene.
pub const SCENE: &str = "fnv1a64:1";

/// How the node takes its load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Load {
    /// Newmark (1/4, 1/2) with the force at the window's end.
    End,
    /// Implicit midpoint with the mean force.
    Mean,
    /// Newmark with the mean force taken for the end force: the half-step lag of handbook 3.7 (e).
    MeanAtEnd,
}

/// A mass on a spring to ground, free if `stiffness` is 0.
#[derive(Debug, Clone)]
pub struct Node {
    pub mass: f64,
    pub stiffness: f64,
    pub load: Load,
    pub state: [f64; 3],
    trial: [f64; 3],
    received: f64,
    trial_received: f64,
    force: f64,
    trial_force: f64,
    pub solves: u64,
    /// Windows longer than this fail.
    pub longest: f64,
    /// Whether it declares that it solves a window again from the committed state.
    pub repeatable: bool,
}

impl Node {
    pub fn new(mass: f64, stiffness: f64, load: Load, u: f64, v: f64) -> Self {
        let state = [u, v, -stiffness * u / mass];
        Self {
            mass,
            stiffness,
            load,
            state,
            trial: state,
            received: 0.0,
            trial_received: 0.0,
            force: 0.0,
            trial_force: 0.0,
            solves: 0,
            longest: f64::INFINITY,
            repeatable: true,
        }
    }

    pub fn received(&self) -> f64 {
        self.received
    }

    fn write(&self, [u, v, _]: [f64; 3], received: f64, out: &mut [f64]) {
        out[..6].copy_from_slice(&[u, 0.0, 0.0, v, 0.0, 0.0]);
        let kinetic = 0.5 * self.mass * v * v;
        let stored = 0.5 * self.stiffness * u * u;
        for (i, x) in [kinetic, 0.0, stored, 0.0, received, u].into_iter().enumerate() {
            out[6 + 3 * i..9 + 3 * i].fill(x);
        }
    }
}

pub fn energies(who: &str) -> Vec<Gauge> {
    use Role::*;
    [
        ("kinetic", Kinetic),
        ("potential", Potential),
        ("stored", Stored),
        ("dissipated", Dissipated),
        ("received", Received),
    ]
    .map(|(name, role)| Gauge { role, ..Gauge::new(format!("energy_{name}_{who}"), "J") })
    .to_vec()
}

impl Solver for Node {
    fn hello(&self) -> Hello {
        let sampling = if self.load == Load::End { Sampling::AtEnds } else { Sampling::Means };
        Hello {
            program: "node".into(),
            repeats: self.repeatable.then_some(0.0),
            takes: vec![FieldSpec::nodal(name::FORCE, 3, sampling)],
            gives: vec![
                FieldSpec::nodal(name::DISPLACEMENT, 3, Sampling::AtEnds),
                FieldSpec::nodal(name::VELOCITY, 3, Sampling::AtEnds),
            ],
            ..Hello::default()
        }
    }

    fn prepare(&mut self, _: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mut mesh =
            InterfaceMesh { coordinates: vec![0.0; 3], masses: vec![self.mass], ..Default::default() };
        let mut gauges = energies("node");
        if self.load == Load::MeanAtEnd {
            // It takes half of a force at first. Shown is what this does to energy: what would give it away at once is not said.
            mesh.masses.clear();
            gauges.iter_mut().filter(|gauge| gauge.role == Role::Received).for_each(|g| g.role = Role::None);
        }
        gauges.push(Gauge { extremes: true, ..Gauge::new("node_ux", "m") });
        let mut initial = vec![0.0; 6 + 3 * gauges.len()];
        self.write(self.state, 0.0, &mut initial);
        Ok(Ready { mesh, gauges, initial, ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.solves += 1;
        if window.length > self.longest {
            return Err(Fault::window(format!("{} s is too long", window.length)));
        }
        let ([u, v, a], h, f) = (self.state, window.length, input[0]);
        let (m, k) = (self.mass, self.stiffness);
        self.trial = match self.load {
            Load::Mean => {
                let v1 = (m * v + h * (f - k * (u + 0.25 * h * v))) / (m + 0.25 * h * h * k);
                let u1 = u + 0.5 * h * (v + v1);
                [u1, v1, 0.0]
            }
            Load::End | Load::MeanAtEnd => {
                let ahead = u + h * v + 0.25 * h * h * a;
                let a1 = (f - k * ahead) / (m + 0.25 * h * h * k);
                [ahead + 0.25 * h * h * a1, v + 0.5 * h * (a + a1), a1]
            }
        };
        // A Newmark load works at the mean of its two ends (handbook 3.6).
        let mean = if self.load == Load::Mean { f } else { 0.5 * (self.force + f) };
        self.trial_force = f;
        self.trial_received = self.received + mean * (self.trial[0] - u);
        self.write(self.trial, self.trial_received, output);
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        (self.state, self.received, self.force) = (self.trial, self.trial_received, self.trial_force);
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(Statistics { counts: vec![("solves".into(), self.solves)], ..Default::default() })
    }
}

/// A sphere behind a linear contact spring: overlap = wall - sphere along x, the wall pushes the
/// sphere ahead. An infinite mass stays where it is.
#[derive(Debug, Clone)]
pub struct Sphere {
    pub mass: f64,
    pub contact: f64,
    /// Whether the contact pulls, too (linear analysis).
    pub glued: bool,
    pub steps: u32,
    /// How far its mesh lies beside that of the structure [m].
    pub beside: f64,
    /// How long it always says that nothing will touch [s], whatever comes.
    pub free: f64,
    pub state: [f64; 2],
    trial: [f64; 2],
    received: f64,
    trial_received: f64,
}

impl Sphere {
    pub fn new(mass: f64, contact: f64, glued: bool, steps: u32, x: f64, v: f64) -> Self {
        let state = [x, v];
        Self {
            mass,
            contact,
            glued,
            steps,
            beside: 0.0,
            free: 0.0,
            state,
            trial: state,
            received: 0.0,
            trial_received: 0.0,
        }
    }

    pub fn received(&self) -> f64 {
        self.received
    }

    fn overlap(&self, wall: f64, x: f64) -> f64 {
        let d = wall - x;
        if self.glued { d } else { d.max(0.0) }
    }

    fn energy(&self, wall: f64, x: f64) -> f64 {
        let d = self.overlap(wall, x);
        0.5 * self.contact * d * d
    }

    fn write(&self, [x, v]: [f64; 2], wall: f64, received: f64, gauges: &mut [f64]) {
        let kinetic = if self.mass.is_finite() { 0.5 * self.mass * v * v } else { 0.0 };
        for (i, e) in [kinetic, 0.0, self.energy(wall, x), 0.0, received].into_iter().enumerate() {
            gauges[3 * i..3 * i + 3].fill(e);
        }
    }
}

impl Solver for Sphere {
    fn hello(&self) -> Hello {
        Hello {
            program: "sphere".into(),
            repeats: Some(0.0),
            takes: vec![FieldSpec::nodal(name::DISPLACEMENT, 3, Sampling::FromStart)],
            gives: vec![
                FieldSpec::nodal(name::FORCE, 3, Sampling::Means),
                FieldSpec::nodal(name::FORCE, 3, Sampling::AtEnds),
                FieldSpec { place: Place::Whole, ..FieldSpec::nodal(name::FREE_TIME, 1, Sampling::Once) },
            ],
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mut mesh = plan.partner_mesh.clone().unwrap_or_default();
        mesh.coordinates.iter_mut().for_each(|x| *x += self.beside);
        let gauges = energies("sphere");
        let fields = Layout::new(&plan.gives, &mesh, 0).len();
        let mut initial = vec![0.0; fields + 3 * gauges.len()];
        self.write(self.state, 0.0, 0.0, &mut initial[fields..]);
        Ok(Ready { mesh, gauges, initial, ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let (from, to) = (input[0], input[3]);
        let h = window.length / f64::from(self.steps);
        let [mut x, mut v] = self.state;
        let mut impulse = 0.0;
        for step in 0..self.steps {
            let at = |part: f64| from + (to - from) * (f64::from(step) + part) / f64::from(self.steps);
            let (w0, w1) = (at(0.0), at(1.0));
            // Mean force over the step for a wall that moves straight: exact for a sphere at rest.
            let force = if self.mass.is_finite() || w1 == w0 {
                let middle = x + 0.5 * h * v;
                -self.contact * self.overlap(at(0.5), middle)
            } else {
                -(self.energy(w1, x) - self.energy(w0, x)) / (w1 - w0)
            };
            let pushed = if self.mass.is_finite() { v - h * force / self.mass } else { v };
            x += 0.5 * h * (v + pushed);
            v = pushed;
            impulse += h * force;
        }
        self.trial = [x, v];
        let mean = impulse / window.length;
        self.trial_received = self.received - mean * (to - from);
        let gauges = output.len() - 15;
        output[..gauges].fill(0.0);
        let end = -self.contact * self.overlap(to, x);
        // Only what was agreed is there: end force alone or with the mean, in the order of the plan.
        if gauges % 3 == 1 {
            output[gauges - 1] = self.free;
        }
        match gauges / 3 {
            1 => output[0] = mean,
            _ => (output[0], output[3]) = (end, mean),
        }
        self.write(self.trial, to, self.trial_received, &mut output[gauges..]);
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        (self.state, self.received) = (self.trial, self.trial_received);
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(Statistics::default())
    }
}
