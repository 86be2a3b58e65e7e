//! What became of each rock.
//!
//! With a net, by what was seen last of the rock:
//! - *was stopped*: it touched, came to no speed along its impact direction, and was in contact at the end, or had lost
//!   contact so late that it had not moved on by its own size.
//! - *rebounded*: it was stopped, then lost contact on the rebound.
//! - *went through*, *passed over*, *beside*, *under*: contact was lost, and one rock's size further the net lay behind it,
//!   seen along the impact direction ([`crate::results::outline`]), the net as it was deformed then. A rock that never touched is judged
//!   on its flight at its closest approach to the net at rest, seen along its velocity there.
//!   The net is called *torn* where elements of it have broken; who came within its outline at rest has then gone *through*.
//! - *was still being stopped*: none of these when the time was over.
//!
//! Then how it ended: *came to rest* on the terrain, *left the terrain* ([`crate::model::runout`]), *still moved*.

use crate::model::impact::Impact;
use crate::model::state::{Body, State};
use crate::model::{Model, name_of};
use crate::results::outline::{Outline, clearance, side};
use dem_contact::interface_mesh::{AtRest, ContactMesh};
use dem_contact::rock::Motion;
use dem_terrain::queries::Parabola;
use interface_defs::verdict::{Ending, Fate, Touch, Verdict};
use nalgebra::Vector3;

/// Slower than this a rock counts as at rest where no terrain decides it [m/s].
const REST: f64 = 1e-3;

/// Share of the impact speed above which the speed across the impact direction is reported of a rock that was stopped along it.
const TRANSVERSE: f64 = 0.1;

/// The verdict on each rock.
pub fn verdicts(model: &Model, state: &State, net: Option<(&ContactMesh, &AtRest)>) -> Vec<Verdict> {
    (0..model.settings.named()).map(|at| verdict(model, at, state, net)).collect()
}

fn verdict(model: &Model, at: usize, state: &State, net: Option<(&ContactMesh, &AtRest)>) -> Verdict {
    let body = &state.bodies[at];
    let end = ending(model, body, state.time);
    let free = Verdict::of(name_of(model, at), end);
    let at_net = match (&body.track.touch, net) {
        (Some(impact), _) => Some(after_touch(model, body, impact, state, free.clone())),
        (None, Some(net)) => without_touch(model, at, state, net, free.clone()),
        (None, None) => None,
    };
    let held = body.track.touching && body.track.stopped.is_some();
    match at_net {
        // Of a rock that the net holds only that it came to rest is worth saying.
        Some(first) => {
            Verdict { then: Some(end).filter(|end| !held || end.fate != Fate::StillMoving), ..first }
        }
        None => Verdict { then: Some(end).filter(|end| end.fate == Fate::AtRest && !end.on_terrain), ..free },
    }
}

/// What the net did to a rock that touched it.
fn after_touch(model: &Model, body: &Body, impact: &Impact, state: &State, free: Verdict) -> Verdict {
    let track = &body.track;
    let touched = Verdict {
        impact: Some(Touch { time: impact.time, speed: impact.velocity.norm() }),
        travel: Some(track.travel.map_or(0.0, |(travel, _)| travel.max(0.0))),
        net_torn: state.broken > 0,
        ..free
    };
    if let (Some(fate), Some(lost)) = (track.passed, track.lost) {
        return touched.at_net(fate, lost.time, lost.velocity.norm(), Some(place(model, &lost.position)));
    }
    let Some(stopped) = track.stopped else {
        let along = body.motion.velocity.dot(&impact.direction);
        let here = place(model, &body.motion.position);
        return touched.at_net(Fate::Undecided, state.time, along, Some(here));
    };
    // A rock that a post catches is turned aside; without speed along the impact direction it is not at rest.
    let turned = track.transverse_speed > TRANSVERSE * impact.velocity.norm();
    let stop = Verdict {
        braking_time: Some(stopped - impact.time),
        transverse_speed: turned.then_some(track.transverse_speed),
        gap: track.gap,
        ..touched
    };
    match track.rebound.filter(|_| !track.touching) {
        Some((speed, lost)) => stop.at_net(Fate::Rebounded, lost, speed, None),
        None => stop.at_net(Fate::Stopped, stopped, track.transverse_speed, None),
    }
}

/// Where a rock got past the net that it never touched; `None`: nowhere.
fn without_touch(
    model: &Model,
    rock: usize,
    state: &State,
    (contact_mesh, rest): (&ContactMesh, &AtRest),
    free: Verdict,
) -> Option<Verdict> {
    let (since, motion) = state.bodies[rock].track.beside?;
    let speed = motion.velocity.norm();
    let gravity = model.settings.gravity;
    // Where it rolls, gravity does not bend its trajectory.
    let flies = motion.acceleration == gravity;
    let flight = Parabola {
        position: motion.position,
        velocity: motion.velocity,
        gravity: if flies { gravity } else { Vector3::zeros() },
    };
    let horizon = (rest.reach + (motion.position - rest.centre).norm()) / speed;
    let outline = Outline { contact_mesh, at: |n: u32| contact_mesh.nodes[n as usize] };
    let (after, at, near) = outline.approach(&flight, horizon)?;
    let when = since + after;
    if when > state.time {
        return None;
    }
    let direction = (motion.velocity + flight.gravity * after).try_normalize(0.0)?;
    let up = -model.settings.down();
    let position = Some(place(model, &at));
    if outline.before(&at, &direction).is_some() {
        return Some(free.at_net(Fate::WentThrough, when, speed, position));
    }
    let across = near.to_point - direction * near.to_point.dot(&direction);
    let distance = clearance(&model.rocks[rock], &Motion { position: at, ..motion }, &near);
    let passed = free.at_net(side(&-across, &up), when, speed, position);
    Some(Verdict { clearance: Some(distance.max(0.0)), ..passed })
}

/// End of its trajectory.
fn ending(model: &Model, body: &Body, time: f64) -> Ending {
    if let Some(end) = &body.path.ending {
        let (position, speed, on_terrain) =
            (place(model, &end.position), end.velocity.norm(), end.how == Fate::AtRest);
        return Ending { fate: end.how, time: end.time, position, speed, on_terrain };
    }
    let speed = body.motion.velocity.norm();
    let rests = speed < REST || body.track.rests(&model.settings, time);
    let fate = if rests { Fate::AtRest } else { Fate::StillMoving };
    Ending { fate, time, position: place(model, &body.motion.position), speed, on_terrain: false }
}

/// A point in the user's coordinates.
fn place(model: &Model, position: &Vector3<f64>) -> [f64; 3] {
    (position + model.origin).into()
}
