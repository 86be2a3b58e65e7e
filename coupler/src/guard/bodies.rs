//! Bodies of a contact solver, as far as its gauges give them: place, velocity, spin, energy.

use super::Motion;
use super::motion::Answered;
use crate::schedule::Span;
use crate::side::Side;
use interface_defs::{Failure, Role};
use serde::{Deserialize, Serialize};

/// Names of the gauges of a body: place, velocity, spin.
const NAMES: [([&str; 3], &str); 3] =
    [(["_x", "_y", "_z"], "m"), (["_vx", "_vy", "_vz"], "m/s"), (["_wx", "_wy", "_wz"], "rad/s")];

/// Which gauges are of bodies, and the motion of these through the run.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Bodies {
    /// Places in an answer's gauges, three for each body; spins for all bodies or none.
    place: Vec<usize>,
    velocity: Vec<usize>,
    spin: Vec<usize>,
    kinetic: Option<usize>,
    motion: Motion,
    now: (Vec<f64>, Vec<f64>),
    next: ([Vec<f64>; 1], [Vec<f64>; 1]),
    /// Acceleration in the last window without a touch, and whether it was that of the window before [m/s2].
    flight: Vec<f64>,
    flies: bool,
}

/// What a single body without spin says of itself.
pub(super) struct Single {
    pub mass: f64,
    pub place: [f64; 3],
    pub velocity: [f64; 3],
    /// Acceleration while nothing touches it [m/s2].
    pub flight: [f64; 3],
    /// Whether it gives its spin.
    pub tells_spin: bool,
}

impl Bodies {
    /// Of a contact solver with windows of at most `window` [s].
    pub fn new(side: &Side, window: f64) -> Self {
        let mut bodies = Self::default();
        let find =
            |name: String, unit: &str| side.gauges.iter().position(|g| g.name == name && g.unit == unit);
        for gauge in &side.gauges {
            let Some(name) = gauge.name.strip_suffix(NAMES[0].0[0]) else { continue };
            let all = NAMES.map(|(ends, unit)| ends.map(|end| find(format!("{name}{end}"), unit)));
            if let [[Some(x), Some(y), Some(z)], [Some(vx), Some(vy), Some(vz)], spin] = all {
                bodies.place.extend([3 * x, 3 * y, 3 * z]);
                bodies.velocity.extend([3 * vx, 3 * vy, 3 * vz]);
                bodies.spin.extend(spin.into_iter().flatten().map(|at| 3 * at));
            }
        }
        bodies.kinetic = side.gauges.iter().position(|g| g.role == Role::Kinetic).map(|at| 3 * at);
        let start = &side.initial[side.layout.gauges()];
        bodies.now = (read(&bodies.place, start), read(&bodies.velocity, start));
        bodies.next = ([bodies.now.0.clone()], [bodies.now.1.clone()]);
        bodies.motion = Motion::new(&bodies.now.0, &bodies.now.1, window);
        bodies
    }

    /// Whether there are any.
    pub fn is_empty(&self) -> bool {
        self.place.is_empty()
    }

    /// The window `span` of `solver` is to be accepted with these gauges.
    pub fn watch(&mut self, solver: &str, span: Span, gauges: &[f64], touches: bool) -> Result<(), Failure> {
        if self.is_empty() {
            return Ok(());
        }
        let Self { place, velocity, motion, now, next: ([u], [v]), .. } = self;
        u.iter_mut().zip(&*place).for_each(|(u, at)| *u = gauges[*at]);
        v.iter_mut().zip(&*velocity).for_each(|(v, at)| *v = gauges[*at]);
        let answered =
            Answered { start: (&now.0, &now.1), u: std::slice::from_ref(u), v: std::slice::from_ref(v) };
        motion.watch(solver, span, &answered)?;
        if !touches {
            let gained = v.iter().zip(&now.1).map(|(v, v0)| (v - v0) / span.length);
            let apart = |a: f64, b: f64| (a - b).abs() > 1e-2 * (1.0 + a.abs());
            self.flies =
                self.flight.len() == v.len() && !gained.clone().zip(&self.flight).any(|(a, b)| apart(a, *b));
            self.flight.clear();
            self.flight.extend(gained);
        }
        std::mem::swap(&mut now.0, u);
        std::mem::swap(&mut now.1, v);
        Ok(())
    }

    /// The run is over.
    pub fn end(&mut self, solver: &str) -> Result<(), Failure> {
        self.motion.end(solver)
    }

    /// Places and velocities by these gauges.
    pub fn read(&self, gauges: &[f64]) -> [Vec<f64>; 2] {
        [read(&self.place, gauges), read(&self.velocity, gauges)]
    }

    /// Spins by these gauges.
    pub(super) fn spins(&self, gauges: &[f64]) -> Vec<f64> {
        read(&self.spin, gauges)
    }

    /// The only body, if it flew without spin until it touched the net and gives its energy; its mass follows from that.
    pub(super) fn single(&self, gauges: &[f64]) -> Option<Single> {
        let [place, velocity] = self.read(gauges).map(|numbers| numbers.try_into().ok());
        let (place, velocity): ([f64; 3], [f64; 3]) = (place?, velocity?);
        let square: f64 = velocity.iter().map(|v| v * v).sum();
        let mass = 2.0 * gauges[self.kinetic?] / square;
        let flight = self.flight.clone().try_into().ok()?;
        let still = self.flies && self.spins(gauges).iter().all(|w| *w == 0.0) && mass.is_finite();
        still.then_some(Single { mass, place, velocity, flight, tells_spin: !self.spin.is_empty() })
    }
}

fn read(places: &[usize], gauges: &[f64]) -> Vec<f64> {
    places.iter().map(|at| gauges[*at]).collect()
}
