//! What became of each rock, in one sentence.
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

use crate::interface_mesh::{AtRest, ContactMesh};
use crate::model::Model;
use crate::model::impact::{Impact, ImpactRecord, Passing};
use crate::model::runout::{End, Ending};
use crate::model::state::{Body, State};
use crate::results::outline::{Outline, clearance, side};
use crate::rock::{Motion, Rock};
use crate::terrain::queries::Parabola;
use nalgebra::Vector3;

/// What a verdict begins with among the warnings of a solver.
pub const VERDICT: &str = "verdict: ";

/// Slower than this a rock is said to be at rest where no terrain decides it [m/s].
const REST: f64 = 1e-3;

/// Share of the impact speed above which the speed across the impact direction is said of a rock that was stopped along it.
const TRANSVERSE: f64 = 0.1;

/// The verdict on each rock, as warnings that the summary lifts out.
pub fn verdicts(model: &Model, state: &State, net: Option<(&ContactMesh, &AtRest)>) -> Vec<String> {
    let bodies = model.rocks.iter().zip(&state.bodies);
    bodies
        .take(model.settings.named())
        .map(|(rock, body)| format!("{VERDICT}{}", sentence(model, rock, body, state, net)))
        .collect()
}

fn sentence(
    model: &Model,
    rock: &Rock,
    body: &Body,
    state: &State,
    net: Option<(&ContactMesh, &AtRest)>,
) -> String {
    let time = state.time;
    let at_net = match (&body.track.touch, net) {
        (Some(impact), _) => Some(after_touch(model, body, impact, state)),
        (None, Some((contact_mesh, rest))) => {
            without_touch(model, rock, &body.track, time, contact_mesh, rest)
        }
        (None, None) => None,
    };
    let held = body.track.touching && body.track.stopped.is_some();
    match (at_net, ending(model, body, time, held)) {
        (Some(first), Some(then)) => format!("rock `{}` {first}; it {then}", rock.name),
        (Some(first), None) => format!("rock `{}` {first}", rock.name),
        (None, then) => format!("rock `{}` {}", rock.name, then.unwrap_or_default()),
    }
}

/// What the net did to a rock that touched it.
fn after_touch(model: &Model, body: &Body, impact: &Impact, state: &State) -> String {
    let (track, time) = (&body.track, state.time);
    // What has torn hangs lower: a rock that broke a rope is over the net that is left.
    let net = if state.broken > 0 { "the torn structure" } else { "the net" };
    let travel = track.travel.map_or(0.0, |(travel, _)| travel.max(0.0));
    if let (Some(passing), Some(lost)) = (track.passed, track.lost) {
        let verb = if passing == Passing::Through { "went" } else { "passed" };
        return format!(
            "{verb} {} {net}: it touched at {:.4} s with {:.2} m/s and lost contact at {:.4} s near {} with {:.2} m/s",
            passing.words(),
            impact.time,
            impact.velocity.norm(),
            lost.time,
            place(model, &lost.position),
            lost.velocity.norm()
        );
    }
    let Some(stopped) = track.stopped else {
        return format!(
            "was still being stopped by the net at {time:.4} s: {:.2} m/s along its impact direction, {travel:.3} m after \
             its first touch at {:.4} s",
            body.motion.velocity.dot(&impact.direction),
            impact.time
        );
    };
    let braking = stopped - impact.time;
    // What follows the first touch is no braking as long as nothing is touched.
    let gap = track.gap.map_or(String::new(), |gap| {
        format!(
            ", which counts from its first touch: from {:.4} s to {:.4} s nothing of the structure touched it, and it came back to it \
             with {:.2} m/s",
            gap.from, gap.until, gap.speed
        )
    });
    // Who is caught by a post is turned aside; without speed along the impact direction it is not at rest.
    let across = match track.transverse_speed > TRANSVERSE * impact.velocity.norm() {
        true => format!(
            ", where it still moved with {:.2} m/s across its impact direction",
            track.transverse_speed
        ),
        false => String::new(),
    };
    match track.rebound.filter(|_| !track.touching) {
        Some((speed, lost)) => format!(
            "rebounded from the net with {speed:.2} m/s at {lost:.4} s; it had been stopped in {braking:.4} s over \
             {travel:.3} m{across}{gap}"
        ),
        None => format!(
            "was stopped by the net in {braking:.4} s over {travel:.3} m, from {:.2} m/s at {:.4} s{across}{gap}",
            impact.velocity.norm(),
            impact.time
        ),
    }
}

/// Where a rock got past the net that it never touched; `None`: nowhere.
fn without_touch(
    model: &Model,
    rock: &Rock,
    track: &ImpactRecord,
    time: f64,
    contact_mesh: &ContactMesh,
    rest: &AtRest,
) -> Option<String> {
    let (since, motion) = track.beside?;
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
    if when > time {
        return None;
    }
    let direction = (motion.velocity + flight.gravity * after).try_normalize(0.0)?;
    let up = -model.settings.down();
    if outline.before(&at, &direction).is_some() {
        return Some(format!(
            "went through the net without touching it, near {} at {when:.4} s with {speed:.2} m/s",
            place(model, &at)
        ));
    }
    let across = near.to_point - direction * near.to_point.dot(&direction);
    let free = clearance(rock, &Motion { position: at, ..motion }, &near);
    Some(format!(
        "passed {} the net with a clearance of {:.2} m, near {} at {when:.4} s with {speed:.2} m/s",
        side(&-across, &up).words(),
        free.max(0.0),
        place(model, &at)
    ))
}

/// How it ended; of a rock that the net holds only if it came to rest.
fn ending(model: &Model, body: &Body, time: f64, held: bool) -> Option<String> {
    if let Some(End { how, time, position, velocity }) = &body.path.ending {
        let (there, speed) = (place(model, position), velocity.norm());
        return Some(match how {
            Ending::Rest => format!("came to rest on the terrain near {there} at {time:.3} s"),
            Ending::Out => format!("left the terrain near {there} at {time:.3} s with {speed:.2} m/s"),
        });
    }
    let here = place(model, &body.motion.position);
    match body.motion.velocity.norm() {
        _ if held => None,
        speed if speed < REST => Some(format!("was at rest near {here} at the end, at {time:.4} s")),
        speed => Some(format!("still moved with {speed:.2} m/s near {here} at the end, at {time:.4} s")),
    }
}

/// A point in the user's coordinates.
fn place(model: &Model, position: &Vector3<f64>) -> String {
    let at = position + model.origin;
    format!("({:.2}, {:.2}, {:.2})", at.x, at.y, at.z)
}
