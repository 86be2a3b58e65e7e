//! Measures of an impact, followed step by step and told of the committed windows.
//!
//! Depth is that of the rock's lowest point (of its spheres) below the furthest-down node of the wall
//! at rest. The impact is the moment at which that depth passes zero before anything is touched; a
//! rock that touches first, as one beside a hanging net does, has its impact at that touch.

use super::state::State;
use crate::critical::DEEP;
use crate::rock::{Motion, Rock};
use crate::settings::Settings;
use interface_defs::message::Measure;
use nalgebra::Vector3;

/// One step, or a stretch of free flight.
pub struct Passage<'a> {
    /// Time at its start [s].
    pub start: f64,
    /// Length [s].
    pub length: f64,
    /// Motion at its start.
    pub before: &'a Motion,
    /// Motion at its end.
    pub after: &'a Motion,
    /// With contacts in its middle: how long the first has lasted, by its overlap and its rate [s].
    pub touched: Option<f64>,
    /// Largest overlap over radius.
    pub penetration: f64,
    /// Whether the wall lies behind the centres of the outer spheres, in a gap between them.
    pub behind: bool,
}

/// A moment of an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// Time [s].
    pub time: f64,
    /// Speed of the centre of mass [m/s].
    pub speed: f64,
    /// Kinetic energy [J].
    pub energy: f64,
}

/// What has been seen of one rock so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Track {
    /// Last time that the lowest point passed the wall's level at rest, before any contact.
    pub passing: Option<Impact>,
    /// First contact.
    pub touch: Option<Impact>,
    /// Largest depth, once there was a contact, and when [m, s].
    pub deepest: Option<(f64, f64)>,
    /// Speed and time when the last contact was lost on the way up [m/s, s].
    pub rebound: Option<(f64, f64)>,
    /// Largest overlap over radius, and when.
    pub penetration: Option<(f64, f64)>,
    /// When the wall first lay behind the centres of the outer spheres [s].
    pub behind: Option<f64>,
    /// Whether it still moves down at the end.
    pub sinking: bool,
    /// Whether it touches.
    pub touching: bool,
    /// Whether it has fallen again after a rebound, which ends the watch on it.
    over: bool,
}

impl Track {
    /// Take in one step; `level` is the depth of the wall at rest along down.
    pub fn follow(&mut self, rock: &Rock, settings: &Settings, level: Option<f64>, passage: &Passage) {
        let Some(level) = level else { return };
        let down = settings.down();
        let end = passage.start + passage.length;
        let depth = rock.depth(passage.after, &down) - level;
        let sinks = passage.after.velocity.dot(&down) > 0.0;
        self.sinking = sinks;
        if self.touch.is_none() {
            // Until the touch the rock flies.
            let gravity = &settings.gravity;
            let ago = passage.touched.map(|ago| (0.5 * passage.length - ago).clamp(0.0, passage.length));
            self.touch = ago.map(|since| impact(rock, passage, gravity, since));
            let from = rock.depth(passage.before, &down) - level;
            if from < 0.0 && depth >= 0.0 {
                let bend = gravity.dot(&down);
                let rate = match ago {
                    None => (depth - from) / passage.length - 0.5 * bend * passage.length,
                    Some(_) => passage.before.velocity.dot(&down),
                };
                let since = crossing(from, rate, bend).clamp(0.0, passage.length);
                // Both at once, as on a flat wall, is a passing: the date of a touch is of second order.
                if ago.is_none_or(|touch| since <= touch + 1e-3 * passage.length) {
                    self.passing = Some(impact(rock, passage, gravity, since));
                }
            }
        }
        if self.touch.is_some() && self.deepest.is_none_or(|(most, _)| depth > most) {
            self.deepest = Some((depth, end));
        }
        if passage.penetration > self.penetration.map_or(0.0, |(most, _)| most) {
            self.penetration = Some((passage.penetration, passage.start + 0.5 * passage.length));
        }
        if passage.behind && self.behind.is_none() {
            self.behind = Some(passage.start + 0.5 * passage.length);
        }
        let touches = passage.touched.is_some();
        if self.touching && !touches && !sinks && !self.over {
            self.rebound = Some((passage.before.velocity.norm(), passage.start));
        }
        self.over |= self.rebound.is_some() && !touches && sinks;
        self.touching = touches;
    }

    /// The impact: the passing of the wall's level, or the first contact.
    pub fn impact(&self) -> Option<Impact> {
        self.touch.map(|touch| self.passing.unwrap_or(touch))
    }
}

/// First root of `from + rate t + bend t^2 / 2` for `from` < 0, in the form that does not cancel.
fn crossing(from: f64, rate: f64, bend: f64) -> f64 {
    let root = (rate * rate - 2.0 * bend * from).max(0.0).sqrt();
    -2.0 * from / (rate + root)
}

/// The moment `since` [s] after the start of a passage that begins in free flight.
fn impact(rock: &Rock, passage: &Passage, gravity: &Vector3<f64>, since: f64) -> Impact {
    let mut motion = *passage.before;
    motion.velocity += gravity * since;
    Impact {
        time: passage.start + since,
        speed: motion.velocity.norm(),
        energy: rock.kinetic_energy(&motion),
    }
}

/// Measures of the committed state, and warnings: a reason for each that is absent.
pub fn results(rocks: &[Rock], state: &State, wall: bool) -> (Vec<Measure>, Vec<String>) {
    let mut measures = Vec::new();
    let mut warnings = Vec::new();
    if !wall {
        // Nothing to hit: an impact is not missed.
        return (measures, warnings);
    }
    for (rock, body) in rocks.iter().zip(&state.bodies) {
        let prefix = if rocks.len() > 1 { format!("{}_", rock.name) } else { String::new() };
        one_rock(rock, &body.track, &prefix, &mut measures, &mut warnings);
    }
    (measures, warnings)
}

/// How deep rocks have pressed into each other; nothing where none have met.
pub fn encounters(state: &State, measures: &mut Vec<Measure>, warnings: &mut Vec<String>) {
    let (share, time) = state.encounters.deepest;
    if share > 0.0 {
        let name = "max_penetration_of_rocks".into();
        measures.push(Measure { name, value: share, unit: "1".into(), time: Some(time) });
    }
    if share > DEEP {
        warnings.push(format!(
            "two rocks overlapped by {share:.2} radii of the smaller sphere at {time:.4} s, beyond {DEEP} the contact \
             law does not hold; raise contact.young"
        ));
    }
}

fn one_rock(
    rock: &Rock,
    track: &Track,
    prefix: &str,
    measures: &mut Vec<Measure>,
    warnings: &mut Vec<String>,
) {
    let mut tell = |name: &str, value: f64, unit: &str, time: Option<f64>| {
        measures.push(Measure { name: format!("{prefix}{name}"), value, unit: unit.into(), time });
    };
    let mut absent = |names: &str, why: &str| {
        warnings.push(format!("{names} of rock `{}` absent: {why}", rock.name));
    };
    let Some(impact) = track.impact() else {
        absent(
            "impact_speed, time_of_impact, impact_energy, max_deflection, braking_time, rebound_speed, max_penetration",
            "it has touched nothing",
        );
        return;
    };
    tell("impact_speed", impact.speed, "m/s", Some(impact.time));
    tell("time_of_impact", impact.time, "s", Some(impact.time));
    tell("impact_energy", impact.energy, "J", Some(impact.time));
    let touch = track.touch.expect("an impact has a touch");
    match track.deepest {
        Some((depth, time)) if depth > 0.0 => {
            tell("max_deflection", depth, "m", Some(time));
            if track.sinking && !track.over {
                absent(
                    "braking_time",
                    "it still moved down at the end; max_deflection is that reached by then",
                );
            } else {
                tell("braking_time", time - touch.time, "s", Some(time));
            }
        }
        _ => absent(
            "max_deflection, braking_time",
            "its lowest point never lay below the lowest node of the net at rest",
        ),
    }
    match track.rebound {
        Some((speed, time)) => tell("rebound_speed", speed, "m/s", Some(time)),
        None => absent("rebound_speed", "no contact ended on the rebound"),
    }
    if let Some((share, time)) = track.penetration {
        tell("max_penetration", share, "1", Some(time));
        if share > DEEP {
            warnings.push(format!(
                "rock `{}`: overlap of {share:.2} radii at {time:.4} s, beyond {DEEP} the contact law does not hold \
                 and wires may pass between spheres; raise contact.young",
                rock.name
            ));
        }
    }
    if let Some(time) = track.behind {
        warnings.push(format!(
            "rock `{}`: from {time:.4} s on the net lay behind the centres of its outer spheres, in gaps between \
             them, where the contact is weaker than its law; forces are less sure than deflections; raise \
             contact.young",
            rock.name
        ));
    }
}
