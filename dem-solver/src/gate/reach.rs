//! Whether a rock reaches the net at all: signs, axes and units of its start, and `end_time`.

use super::units::short;
use crate::solver::Model;
use crate::wall::Wall;
use nalgebra::Vector3;

/// Times at which the flight of a rock is looked at.
const INSTANTS: u32 = 400;

/// What the user should know of rocks that never reach the net, as a throw through empty space: nothing can turn them.
pub fn check(model: &Model, wall: &Wall) -> Vec<String> {
    let settings = &model.settings;
    if model.ground.is_some() || model.rocks.len() > 1 || wall.nodes.is_empty() {
        return Vec::new();
    }
    let low = wall.nodes.iter().fold(Vector3::repeat(f64::INFINITY), |l, n| l.inf(n));
    let high = wall.nodes.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |h, n| h.sup(n));
    // A net sways and sags: a rock that passes it by less than this may still touch it.
    let margin = 0.05 * (high - low).norm();
    let rock = &model.rocks[0];
    let mut start = rock.start(&settings.rocks[0], settings.gravity);
    start.position -= model.origin;
    let gravity = settings.gravity;
    let gap = |time: f64| {
        let place = start.position + start.velocity * time + gravity * (0.5 * time * time);
        let outside = (low - place).sup(&(place - high)).sup(&Vector3::zeros());
        outside.norm() - rock.reach - margin
    };
    let times = (0..=INSTANTS).map(|i| settings.end_time * f64::from(i) / f64::from(INSTANTS));
    let Some((time, nearest)) = times.map(|t| (t, gap(t))).min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Vec::new();
    };
    // Between two instants a fast rock is at neither.
    let speed = start.velocity.norm() + gravity.norm() * settings.end_time;
    if nearest <= speed * settings.end_time / f64::from(INSTANTS) {
        return Vec::new();
    }
    let [low, high] = [low, high].map(|corner| {
        let [x, y, z] = (corner + model.origin).into();
        format!("({x:.3}, {y:.3}, {z:.3})")
    });
    let why = if time >= settings.end_time { "at end_time" } else { "and moves away from there on" };
    vec![format!(
        "rock `{}` does not reach the net, which lies from {low} to {high}: it is nearest at {} s, {} m from it, {why}; look at \
         its position and velocity, at gravity and end_time",
        rock.name,
        short(time),
        short(nearest + margin)
    )]
}
