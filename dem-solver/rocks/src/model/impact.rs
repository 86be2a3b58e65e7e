//! Measures of an impact on the net, followed step by step.
//!
//! The impact is the first touch of the net; touches of terrain or of other rocks before it do not count. The velocity of the
//! rock's centre at that moment is the impact velocity, its direction the impact direction (of a rock that touches at rest:
//! that of gravity). Travel, braking, rebound and the net's elongation are counted along it.
//!
//! Depth is that of the rock's lowest point (of its spheres) below the furthest-down node of the net at rest; it measures
//! the impact where that goes down.

use dem_contact::interface_mesh::AtRest;
use dem_contact::rock::{Motion, Rock};
use dem_contact::settings::Settings;
use interface_defs::verdict::{Fate, Gap};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// One step, or a piece of free flight.
pub struct Passage<'a> {
    /// Time at its start [s].
    pub start: f64,
    /// Length [s].
    pub length: f64,
    /// Motion at its start.
    pub before: &'a Motion,
    /// Motion at its end.
    pub after: &'a Motion,
    /// With contacts on the net in its middle: how long the first has lasted, by its overlap and its rate [s].
    pub touched: Option<f64>,
    /// True if the net lies behind the centres of the outer spheres, in a gap between them.
    pub behind: bool,
}

/// The first touch of the net.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Impact {
    /// Time [s].
    pub time: f64,
    /// Centre of mass [m].
    pub position: Vector3<f64>,
    /// Its velocity [m/s].
    pub velocity: Vector3<f64>,
    /// The velocity's direction; of a rock at rest that of gravity.
    pub direction: Vector3<f64>,
    /// Kinetic energy [J].
    pub energy: f64,
}

/// When and where contact with the net was lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lost {
    /// Time [s].
    pub time: f64,
    /// Centre of mass [m].
    pub position: Vector3<f64>,
    /// Its velocity [m/s].
    pub velocity: Vector3<f64>,
    /// Where it was last judged whether the net is behind [m].
    judged: Vector3<f64>,
}

/// What has been seen of one rock so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ImpactRecord {
    /// First touch of the net.
    pub touch: Option<Impact>,
    /// Largest depth below the net's level at rest, once there was a touch, and when [m, s].
    pub deepest: Option<(f64, f64)>,
    /// Largest travel from the first touch along the impact direction, and when [m, s].
    pub travel: Option<(f64, f64)>,
    /// Largest displacement of a node of the net along that direction, and when [m, s].
    pub elongation: Option<(f64, f64)>,
    /// Longest time without contact between the first touch and that moment, if the rock moved on by its own size in it: what it
    /// touched first, as a rope above the net, did not stop it.
    pub gap: Option<Gap>,
    /// First moment without speed along that direction [s].
    pub stopped: Option<f64>,
    /// Speed of the centre across it then [m/s].
    pub transverse_speed: f64,
    /// Speed and time when the last contact was lost on the rebound [m/s, s].
    pub rebound: Option<(f64, f64)>,
    /// When the net first lay behind the centres of the outer spheres [s].
    pub behind: Option<f64>,
    /// Motion when contact was lost, unless it touches.
    pub lost: Option<Lost>,
    /// How it got past the net after that.
    pub passed: Option<Fate>,
    /// In flight without a touch so far: when it was beside the middle of the net, nearest to it, and its motion [s].
    pub beside: Option<(f64, Motion)>,
    /// True if it touches.
    pub touching: bool,
    /// Since when it has been slow, once there was a touch [s].
    pub slow_since: Option<f64>,
    /// True if it has moved on again after a rebound, which ends the watch on it.
    over: bool,
}

impl ImpactRecord {
    /// Take in one step; `net` is the net at rest.
    pub fn follow(&mut self, rock: &Rock, settings: &Settings, net: Option<&AtRest>, passage: &Passage) {
        let Some(net) = net else { return };
        if self.touch.is_none() {
            match passage.touched {
                Some(ago) => self.touch = Some(impact(rock, settings, passage, ago)),
                None => self.come_beside(net, passage),
            }
        }
        let Some(impact) = self.touch else { return };
        let (end, after) = (passage.start + passage.length, passage.after);
        let depth = rock.depth(after, &settings.down()) - net.level;
        most(&mut self.deepest, depth, end);
        most(&mut self.travel, (after.position - impact.position).dot(&impact.direction), end);
        self.stop(&impact, passage);
        if passage.behind && self.behind.is_none() {
            self.behind = Some(passage.start + 0.5 * passage.length);
        }
        self.part(rock, &impact, passage);
        let (speed, _) = settings.rest();
        let slow = rock.fastest(after) <= speed;
        self.slow_since = self.slow_since.or(Some(end)).filter(|_| slow);
    }

    /// True if it has come to rest in the net, or on it, by `time` [s]: once it had touched, its fastest point stayed slow. No
    /// rebound is as slow for as long.
    pub fn rests(&self, settings: &Settings, time: f64) -> bool {
        self.slow_since.is_some_and(|since| time - since >= settings.rest().1)
    }

    /// The first moment without speed along the impact direction, linear in the step.
    fn stop(&mut self, impact: &Impact, passage: &Passage) {
        let along = |motion: &Motion| motion.velocity.dot(&impact.direction);
        let (before, after) = (along(passage.before), along(passage.after));
        if self.stopped.is_none() && after <= 0.0 {
            let share = if before > 0.0 { before / (before - after) } else { 0.0 };
            self.stopped = Some((passage.start + share * passage.length).max(impact.time));
            let velocity = passage.before.velocity.lerp(&passage.after.velocity, share);
            self.transverse_speed = (velocity - impact.direction * velocity.dot(&impact.direction)).norm();
        }
    }

    /// Contact lost, or found again.
    fn part(&mut self, rock: &Rock, impact: &Impact, passage: &Passage) {
        let along = |motion: &Motion| motion.velocity.dot(&impact.direction);
        let touches = passage.touched.is_some();
        if let Some(lost) = self.lost.filter(|_| touches && self.stopped.is_none()) {
            let (from, until, speed) = (lost.time, passage.start, passage.before.velocity.norm());
            let apart = (passage.before.position - lost.position).norm() > rock.reach;
            if apart && self.gap.is_none_or(|gap| until - from > gap.until - gap.from) {
                self.gap = Some(Gap { from, until, speed });
            }
        }
        if touches {
            (self.lost, self.passed) = (None, None);
        } else if self.touching {
            let Motion { position, velocity, .. } = *passage.before;
            self.lost = Some(Lost { time: passage.start, position, velocity, judged: position });
            if along(passage.before) < 0.0 && !self.over {
                self.rebound = Some((velocity.norm(), passage.start));
            }
        }
        self.over |= self.rebound.is_some() && !touches && along(passage.after) > 0.0;
        self.touching = touches;
    }

    /// Without a touch: beside the middle of the net is where it no longer comes closer to it, along its velocity.
    fn come_beside(&mut self, net: &AtRest, passage: &Passage) {
        let ahead = |motion: &Motion| passage.after.velocity.dot(&(net.centre - motion.position));
        let distance = |motion: &Motion| (motion.position - net.centre).norm_squared();
        if ahead(passage.before) > 0.0
            && ahead(passage.after) <= 0.0
            && self.beside.is_none_or(|(_, seen)| distance(passage.after) < distance(&seen))
        {
            self.beside = Some((passage.start + passage.length, *passage.after));
        }
    }

    /// True if it must be judged if the net is behind it: contact is lost, it has moved on by its own size since that was last asked, and
    /// not back to where it came from: a net that it has thrown up lies behind a rock that rebounds, too. Its impact direction.
    pub fn is_parting(&mut self, rock: &Rock, motion: &Motion) -> Option<Vector3<f64>> {
        let (lost, impact) = (self.lost.as_mut()?, self.touch?);
        let onwards = (motion.position - lost.position).dot(&impact.direction) > 0.0;
        let moved = (motion.position - lost.judged).norm_squared() > rock.reach * rock.reach;
        (self.passed.is_none() && onwards && moved).then(|| {
            lost.judged = motion.position;
            impact.direction
        })
    }

    /// Take in how far a node of the net is displaced at `time` [s], by its displacements from rest. Not of a torn one, whose loose
    /// parts fly.
    pub fn elongate(&mut self, displacements: &[f64], time: f64) {
        let Some(impact) = self.touch else { return };
        let d = &impact.direction;
        let along = |u: &[f64]| u[0] * d.x + u[1] * d.y + u[2] * d.z;
        // Eight maxima side by side: a single one would wait for itself at every node.
        let mut lanes = [f64::NEG_INFINITY; 8];
        let (eights, rest) = displacements.as_chunks::<24>();
        for nodes in eights {
            for (largest, u) in lanes.iter_mut().zip(nodes.as_chunks::<3>().0) {
                let along = along(u);
                *largest = if along > *largest { along } else { *largest };
            }
        }
        let rest = rest.as_chunks::<3>().0.iter().map(|u| along(u));
        most(&mut self.elongation, rest.chain(lanes).fold(f64::NEG_INFINITY, f64::max), time);
    }

    /// Angle between impact direction and gravity [degrees]; `None` without a touch or without gravity.
    pub fn steepness(&self, settings: &Settings) -> Option<f64> {
        let gravity = settings.gravity.try_normalize(0.0)?;
        Some(self.touch?.direction.angle(&gravity).to_degrees())
    }
}

fn most(largest: &mut Option<(f64, f64)>, value: f64, time: f64) {
    if largest.is_none_or(|(most, _)| value > most) {
        *largest = Some((value, time));
    }
}

/// The first touch, `ago` [s] before the middle of the step.
fn impact(rock: &Rock, settings: &Settings, passage: &Passage, ago: f64) -> Impact {
    // Contacts are seen in the middle of steps: the touch may have been in the second half of the step before.
    let since = (0.5 * passage.length - ago).clamp(-passage.length, passage.length);
    let mut motion = *passage.before;
    // In free flight that of gravity: then all of this is exact.
    let acceleration = motion.acceleration;
    motion.position += (motion.velocity + acceleration * (0.5 * since)) * since;
    motion.velocity += acceleration * since;
    Impact {
        time: (passage.start + since).max(0.0),
        position: motion.position,
        velocity: motion.velocity,
        direction: motion.velocity.try_normalize(0.0).unwrap_or_else(|| settings.down()),
        energy: rock.kinetic_energy(&motion),
    }
}
