//! Whether a rock reaches the net at all: signs, axes and units of its start, and `end_time`.

use super::lengths::distance;
use crate::model::Model;
use crate::model::state::{Body, State};
use dem_contact::interface_mesh::ContactMesh;
use dem_contact::rock::Rock;
use dem_solid::geometry::bounds;
use dem_terrain::Terrain;
use dem_terrain::queries::Parabola;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use toolkit::numbers::four;

/// Times at which the flight of a rock is evaluated.
const INSTANTS: u32 = 400;
/// The same where the distance to every element is computed.
const FEW: u32 = 50;
/// Longest flight that is tried for an `end_time` that would do [s].
const LONGEST: f64 = 60.0;
/// Distance of a net from the map of the terrain from which on something is said [m].
const APART: f64 = 5.0;

/// The nodes of the net at rest, and the box around them.
pub struct NetExtent {
    low: Vector3<f64>,
    high: Vector3<f64>,
    nodes: Vec<Vector3<f64>>,
}

impl NetExtent {
    /// Around nodes at these places, local; `None`: there are none.
    pub fn around(nodes: Vec<Vector3<f64>>) -> Option<Self> {
        let [low, high] = (!nodes.is_empty()).then(|| bounds(nodes.iter().copied()))?;
        Some(Self { low, high, nodes })
    }

    /// True if a rock may touch a node, or one within so long [s]. The box around a barrier holds its anchors, too.
    pub fn is_near(&self, model: &Model, state: &State, time: f64) -> bool {
        let near = |(body, rock): (&Body, &Rock)| {
            let (at, within) = (&body.motion.position, rock.reach + body.motion.velocity.norm() * time);
            self.gap(at) <= within && self.nodes.iter().any(|node| (node - at).norm() <= within)
        };
        state.bodies.iter().zip(&model.rocks).any(near)
    }

    fn gap(&self, place: &Vector3<f64>) -> f64 {
        (self.low - place).sup(&(place - self.high)).sup(&Vector3::zeros()).norm()
    }

    /// The first instant at which the throw comes within `reach` of the box.
    fn arrival(&self, throw: &Parabola, reach: f64, end: f64) -> Option<f64> {
        instants(INSTANTS, end).find(|t| self.gap(&throw.at(*t)) <= reach)
    }
}

/// What the user should know of rocks that never reach the net.
pub fn check(model: &Model, contact_mesh: &ContactMesh) -> Vec<Diagnostic> {
    let Some(net) = NetExtent::around(contact_mesh.nodes.clone()) else { return Vec::new() };
    let of_rock = |at| match &model.ground {
        Some(ground) => on_terrain(model, ground, &net, at),
        None => in_flight(model, contact_mesh, &net, at),
    };
    (0..model.settings.named()).filter_map(of_rock).collect()
}

/// When the first rock comes in free flight to the box around a net [s]; `None`: over terrain, or none does.
pub fn arrival(model: &Model, net: &NetExtent) -> Option<f64> {
    if model.ground.is_some() {
        return None;
    }
    let end = model.settings.end_time;
    let of = |at: usize| net.arrival(&throw(model, at), model.rocks[at].reach, end);
    (0..model.settings.named()).filter_map(of).reduce(f64::min)
}

fn instants(count: u32, end: f64) -> impl Iterator<Item = f64> {
    (0..=count).map(move |i| end * f64::from(i) / f64::from(count))
}

fn throw(model: &Model, at: usize) -> Parabola {
    let start = model.start(at);
    Parabola { position: start.position, velocity: start.velocity, gravity: model.settings.gravity }
}

/// Without terrain nothing but another rock can turn a rock.
fn in_flight(model: &Model, contact_mesh: &ContactMesh, net: &NetExtent, at: usize) -> Option<Diagnostic> {
    let (rock, end) = (&model.rocks[at], model.settings.end_time);
    let throw = throw(model, at);
    if touches_another(model, &throw, at) {
        return None;
    }
    if throw.velocity == Vector3::zeros() && throw.gravity == Vector3::zeros() {
        let what =
            format!("rock `{}` has no velocity, and there is no gravity: it stays where it is", rock.name);
        let found = Diagnostic::warning(code::PLACE, what).about("gravity");
        return Some(found.try_instead("write gravity = [0.0, 0.0, -9.81], or a velocity"));
    }
    // A net sways and sags: a rock that passes it by less than this may still touch it.
    let margin = 0.05 * (net.high - net.low).norm();
    let (time, nearest) = instants(INSTANTS, end)
        .map(|t| (t, net.gap(&throw.at(t)) - rock.reach - margin))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    // Between two instants a fast rock is at neither.
    let speed = throw.velocity.norm() + throw.gravity.norm() * end;
    let passes = nearest > speed * end / f64::from(INSTANTS);
    if !passes && !leaves(contact_mesh, &throw, end) {
        return None;
    }
    let from_it = four(nearest + margin);
    let how = match (passes, time >= end) {
        (true, true) => format!("it is nearest at end_time = {} s, {from_it} m from it", four(end)),
        (true, false) => {
            let time = four(time);
            format!("it is nearest at {time} s, {from_it} m from it, and moves away from there on")
        }
        (false, _) => "it starts beside it and moves away from the first moment on".into(),
    };
    let [low, high] = [net.low, net.high].map(|corner| point(&(corner + model.origin)));
    Some(missed(model, at, &format!("which lies from {low} to {high}: {how}"), cure(model, net, &throw, at)))
}

/// True if it never comes nearer to any element than it is at the start.
fn leaves(contact_mesh: &ContactMesh, throw: &Parabola, end: f64) -> bool {
    let nearest = |time: f64| {
        let place = throw.at(time);
        let to = |e: &dem_contact::interface_mesh::Element| {
            distance(e, &place, &e.nodes.map(|n| contact_mesh.nodes[n as usize]))
        };
        contact_mesh.elements.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    let first = nearest(0.0);
    // The first moments count most: a rock may be through in one of the instants.
    let soon = instants(FEW, end / f64::from(FEW));
    soon.chain(instants(FEW, end)).skip(1).all(|t| nearest(t) >= first)
}

/// True if its trajectory crosses that of another rock. Both fall alike, so that one moves straight past the other.
fn touches_another(model: &Model, throw: &Parabola, at: usize) -> bool {
    (0..model.rocks.len()).filter(|other| *other != at).any(|other| {
        let theirs = self::throw(model, other);
        let (apart, speed) = (theirs.position - throw.position, theirs.velocity - throw.velocity);
        let time = if speed == Vector3::zeros() { 0.0 } else { -apart.dot(&speed) / speed.norm_squared() };
        let closest = apart + speed * time.clamp(0.0, model.settings.end_time);
        closest.norm() <= model.rocks[at].reach + model.rocks[other].reach
    })
}

/// The one change with which the rock would reach the net.
fn cure(model: &Model, net: &NetExtent, throw: &Parabola, at: usize) -> String {
    let (reach, end) = (model.rocks[at].reach, model.settings.end_time);
    let reaches = |changed: Parabola, end: f64| net.arrival(&changed, reach, end);
    let (g, v) = (throw.gravity, throw.velocity);
    let longer = end.max(2.0);
    // Away from the net from the first moment on.
    let away = net.gap(&throw.at(1e-3)) > net.gap(&throw.position) || net.gap(&throw.position) == 0.0;
    if away && v != Vector3::zeros() && reaches(Parabola { velocity: -v, ..*throw }, longer).is_some() {
        return format!("is the sign of its velocity wrong? velocity = {}", vector(&-v));
    }
    if let Some(time) = reaches(*throw, LONGEST).filter(|time| *time > end) {
        let enough = (20.0 * (time + 0.5)).ceil() / 20.0;
        return format!("it gets there at {} s: end_time = {enough:?}", four(time));
    }
    let end = longer;
    // Who writes gravity along -z means it.
    let usual = g.z < -0.9 * g.norm();
    if !usual && reaches(Parabola { gravity: -g, ..*throw }, end).is_some() {
        return format!("is the sign of gravity wrong? gravity = {}", vector(&-g));
    }
    let own = Vector3::from(model.settings.rocks[at].position);
    let [x, y, z] = own.into();
    for (what, [x, y, z]) in [
        ("is the sign of its height wrong?", [x, y, -z]),
        ("is the sign of a coordinate wrong?", [x, -y, z]),
        ("is the sign of a coordinate wrong?", [-x, y, z]),
        ("are two coordinates exchanged?", [x, z, y]),
        ("are two coordinates exchanged?", [y, x, z]),
    ] {
        let position = Vector3::new(x, y, z) - model.origin;
        if reaches(Parabola { position, ..*throw }, end).is_some() {
            return format!("{what} position = [{x:?}, {y:?}, {z:?}]");
        }
    }
    let middle = 0.5 * (net.low + net.high) + model.origin;
    let middle = point(&middle);
    format!("the middle of the net is at {middle}: put the rock before it, against its velocity and gravity")
}

/// On a terrain a rock goes where the ground leads it, but never higher than its energy, and not far beside the map.
fn on_terrain(model: &Model, ground: &Terrain, net: &NetExtent, at: usize) -> Option<Diagnostic> {
    let rock = &model.rocks[at];
    let throw = throw(model, at);
    let g = throw.gravity.norm();
    let top = throw.position.z
        + rock.reach
        + if g > 0.0 { 0.5 * throw.velocity.norm_squared() / g } else { f64::INFINITY };
    let beside = (ground.lowest - net.high).sup(&(net.low - ground.highest));
    let far = beside.x.max(beside.y);
    let why = if far > APART {
        format!("it is {} m beside the terrain", four(far))
    } else if net.low.z > top {
        format!("it is {} m above all that the rock can get to", four(net.low.z - top))
    } else {
        return None;
    };
    let [low, high, from, to] =
        [net.low, net.high, ground.lowest, ground.highest].map(|corner| point(&(corner + model.origin)));
    let places = format!("which lies from {low} to {high}: {why}, which lies from {from} to {to}");
    Some(missed(model, at, &places, "write the structure in the terrain's coordinates".into()))
}

/// That rock number `at` does not reach the net, whose `places` say why.
fn missed(model: &Model, at: usize, places: &str, cure: String) -> Diagnostic {
    let what = format!("rock `{}` does not reach the net, {places}", model.rocks[at].name);
    Diagnostic::warning(code::PLACE, what).about(format!("rock.{at}.position")).try_instead(cure)
}

fn point(at: &Vector3<f64>) -> String {
    format!("({:.3}, {:.3}, {:.3})", at.x, at.y, at.z)
}

fn vector(v: &Vector3<f64>) -> String {
    let [x, y, z] = (*v + Vector3::zeros()).into();
    format!("[{x:?}, {y:?}, {z:?}]")
}
