//! The trajectory of a rock over terrain, as far as it is followed step by step: impacts, largest values, how it ended.
//!
//! An impact is a touch after a flight that lasted longer than the shortest contact. Jump height is that
//! of the rock's lowest point above the ground under its centre, along gravity, evaluated twenty times in a
//! second of flight and where the flight ends; a peak between two of these is searched where it may be the highest (it rises
//! less than the rock moves in between, over ground of up to 60 degrees). A rock has come to rest when its
//! fastest point stayed slower than `rest_speed` for `rest_time` while it touched the ground; it is out when its centre
//! has left the terrain sideways, or has fallen below all of it.

use crate::model::Model;
use dem_contact::rock::{Motion, Rock, rotation};
use dem_contact::settings::Settings;
use dem_terrain::Terrain;
use interface_defs::verdict::Fate;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Time between two evaluations of the height of a flying rock [s].
pub const HEIGHT_INTERVAL: f64 = 0.05;
/// Sections of the time between two evaluations in search of a peak: it is found to less than 1e-4 s.
const SECTIONS: usize = 13;

/// What is known of a rock's trajectory so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RunOut {
    /// Since when it has been slow and touching [s].
    pub slow_since: Option<f64>,
    /// When it last touched [s]; the start of the run before that.
    pub touched: f64,
    /// When the present touch began [s].
    pub contact_since: Option<f64>,
    /// Number of impacts.
    pub impacts: u64,
    /// Time in contact [s].
    pub in_contact: f64,
    /// Largest speed of the centre, and when [m/s, s].
    pub fastest: (f64, f64),
    /// Largest jump height, and when [m, s].
    pub highest: (f64, f64),
    /// Jump height when it was evaluated last, and when [m, s].
    pub looked: (f64, f64),
    /// Largest kinetic energy, and when [J, s].
    pub most_energy: (f64, f64),
    /// When the last row of it was written [s].
    pub row: f64,
    /// Until when it has been judged whether it has ended [s].
    pub judged: f64,
    /// How it ended, as far as is known: a rock at rest may be set in motion again by another.
    pub ending: Option<End>,
}

/// The end of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// How: [`Fate::AtRest`] or [`Fate::LeftTerrain`].
    pub how: Fate,
    /// When [s].
    pub time: f64,
    /// Centre of mass then [m].
    pub position: Vector3<f64>,
    /// Its velocity [m/s].
    pub velocity: Vector3<f64>,
}

impl End {
    /// The motion then of a rock that has flown on with the motion `now`.
    pub fn motion(&self, now: &Motion) -> Motion {
        Motion { position: self.position, velocity: self.velocity, ..*now }
    }
}

/// A step of a rock over terrain that has been taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    /// When it ended [s].
    pub end: f64,
    /// Its length [s].
    pub h: f64,
    /// True if there were contacts in its middle.
    pub touching: bool,
    /// True if the height over the terrain is to be looked at.
    pub look: bool,
}

impl RunOut {
    /// The start of the run, with the jump height there.
    pub fn begin(&mut self, rock: &Rock, motion: &Motion, height: Option<f64>) {
        self.see(rock, motion, 0.0);
        self.height(height, 0.0);
    }

    /// True if the rock has left the terrain: where it goes then, while others still move, counts no more.
    pub fn has_left(&self) -> bool {
        self.ending.is_some_and(|end| end.how == Fate::LeftTerrain)
    }

    /// Take in a step of rock number `rock` that ends with the motion `after`, `outside` of the terrain or not ([`is_out`]).
    pub fn step(&mut self, model: &Model, rock: usize, after: &Motion, passed: Passed, outside: bool) {
        let (Some(terrain), rock) = (&model.settings.terrain, &model.rocks[rock]) else { return };
        let Passed { end, h, touching, .. } = passed;
        if self.has_left() {
            return;
        }
        // One that flies over the border has crossed it somewhere before: found when the window ends.
        if touching || !outside {
            self.see(rock, after, end);
        }
        if touching && outside {
            let (position, velocity) = (after.position, after.velocity);
            self.ending = Some(End { how: Fate::LeftTerrain, time: end, position, velocity });
            return;
        }
        if !touching {
            (self.contact_since, self.slow_since) = (None, None);
            self.go_on(end);
            return;
        }
        if self.contact_since.is_none() {
            self.contact_since = Some(end);
            self.impacts += u64::from(self.impacts == 0 || end - self.touched > model.steps.contact);
        }
        self.touched = end;
        // What lies at rest while others move is not counted, unless they set it in motion again.
        self.in_contact += if self.ending.is_some() { 0.0 } else { h };
        if rock.fastest(after) > terrain.rest_speed {
            self.slow_since = None;
            self.go_on(end);
        } else if self.slow_since.is_none() {
            self.slow_since = Some(end);
        }
    }

    /// It moves at `time` [s]: if it was at rest, it lay there until then, and that was not the end.
    fn go_on(&mut self, time: f64) {
        if let Some(rest) = self.ending.take_if(|end| end.how == Fate::AtRest) {
            self.in_contact += time - rest.time;
        }
    }

    /// Take in a flight that ends at `end` [s] with the motion `after`, `outside` of the terrain or not.
    pub fn flew(&mut self, rock: &Rock, after: &Motion, end: f64, outside: bool) {
        (self.contact_since, self.slow_since) = (None, None);
        self.go_on(end);
        if !outside {
            self.see(rock, after, end);
        }
    }

    fn see(&mut self, rock: &Rock, motion: &Motion, time: f64) {
        if self.has_left() {
            return;
        }
        let speed = motion.velocity.norm();
        if speed > self.fastest.0 {
            self.fastest = (speed, time);
        }
        let energy = rock.kinetic_energy(motion);
        if energy > self.most_energy.0 {
            self.most_energy = (energy, time);
        }
    }

    /// Take in the jump height at `time` [s].
    fn height(&mut self, height: Option<f64>, time: f64) {
        if let Some(height) = height.filter(|h| *h > self.highest.0 && !self.has_left()) {
            self.highest = (height, time);
        }
    }

    /// Take in the jump height of rock number `rock`, which has flown to the motion `now` at `time` [s], and any higher peak
    /// since it was evaluated last.
    pub fn look(&mut self, model: &Model, rock: usize, now: &Motion, time: f64) {
        let Some(height) = jump_height(model, rock, now) else { return };
        self.height(Some(height), time);
        let (before, since) = if self.looked.1 > self.touched { self.looked } else { (0.0, self.touched) };
        self.looked = (height, time);
        let flight = time - since;
        if before.max(height) + now.velocity.norm() * flight <= self.highest.0 {
            return;
        }
        let at = |ago: f64| {
            jump_height(model, rock, &flown_back(model, rock, now, ago)).unwrap_or(f64::NEG_INFINITY)
        };
        let middle = at(0.5 * flight);
        // A peak lies below the line through an end and the middle.
        if middle < before.max(height) || 2.0 * middle - before.min(height) <= self.highest.0 {
            return;
        }
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let (mut late, mut early) = (0.0, flight);
        for _ in 0..SECTIONS {
            let [later, earlier] = [early - golden * (early - late), late + golden * (early - late)];
            if at(later) > at(earlier) { early = earlier } else { late = later }
        }
        let peak = 0.5 * (late + early);
        self.height(Some(at(peak)), time - peak);
    }

    /// True if the trajectory has ended by `time` [s].
    pub fn judge(&mut self, model: &Model, ground: &Terrain, rock: usize, motion: &Motion, time: f64) {
        let since = std::mem::replace(&mut self.judged, time).max(self.touched);
        let settings = &model.settings;
        let Some(terrain) = settings.terrain.as_ref().filter(|_| self.ending.is_none()) else { return };
        let (position, velocity) = (motion.position, motion.velocity);
        if self.slow_since.is_some_and(|since| time - since >= terrain.rest_time) {
            self.ending = Some(End { how: Fate::AtRest, time, position, velocity });
        } else if is_out(ground, &settings.down(), &position) {
            let end = exit(ground, settings, motion, time, time - since);
            self.see(&model.rocks[rock], &end.motion(motion), end.time);
            self.ending = Some(end);
        }
    }
}

/// Motion of a flying rock `ago` [s] before the motion `now`.
fn flown_back(model: &Model, rock: usize, now: &Motion, ago: f64) -> Motion {
    let gravity = model.settings.gravity;
    Motion {
        position: now.position - now.velocity * ago + gravity * (0.5 * ago * ago),
        velocity: now.velocity - gravity * ago,
        orientation: rotation::turn(
            &now.orientation,
            &now.angular_momentum,
            &model.rocks[rock].inertia,
            -ago,
        ),
        ..*now
    }
}

/// Height of the lowest point of rock number `rock` above the ground under its centre [m].
pub fn jump_height(model: &Model, rock: usize, motion: &Motion) -> Option<f64> {
    let down = model.settings.down();
    let below = model.rocks[rock].depth(motion, &down) - motion.position.dot(&down);
    model.ground.as_ref()?.height(&motion.position, &down).map(|height| height - below)
}

/// When and where a rock crossed the border of the terrain that is beside it at `time` [s], in flight for the last `flight` [s].
fn exit(ground: &Terrain, settings: &Settings, motion: &Motion, time: f64, flight: f64) -> End {
    let (gravity, down) = (settings.gravity, settings.down());
    let at = |ago: f64| motion.position - motion.velocity * ago + gravity * (0.5 * ago * ago);
    let (mut outside, mut inside) = (0.0, flight);
    // Halved to rounding. Where the start of the flight counts as outside too, nothing better is known than now.
    for _ in 0..if is_out(ground, &down, &at(flight)) { 0 } else { 50 } {
        let middle = 0.5 * (outside + inside);
        *(if is_out(ground, &down, &at(middle)) { &mut outside } else { &mut inside }) = middle;
    }
    let velocity = motion.velocity - gravity * outside;
    End { how: Fate::LeftTerrain, time: time - outside, position: at(outside), velocity }
}

/// True if a point lies beside the terrain, or below all of it. Sideways are the two axes that gravity
/// follows least.
pub fn is_out(ground: &Terrain, down: &Vector3<f64>, position: &Vector3<f64>) -> bool {
    let upright = down.iamax();
    (0..3).any(|axis| {
        let (below, above) = (position[axis] < ground.lowest[axis], position[axis] > ground.highest[axis]);
        let sunk = if down[axis] > 0.0 { above } else { below };
        if axis == upright { sunk } else { below || above }
    })
}
