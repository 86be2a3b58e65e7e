//! Where a rock starts: its whole surface outside of the terrain and of the net, tested by true overlap.

use super::lengths::{distance, height};
use super::units::{Judged, LIMIT, likely};
use super::{place, reach};
use crate::model::{Model, halved};
use dem_contact::contact::broad_phase::cell_grid::Plane;
use dem_contact::interface_mesh::{ContactMesh, Kind};
use dem_contact::law::Law;
use dem_contact::rock::{Motion, Rock};
use dem_contact::settings::STRUCTURE;
use dem_solid::geometry::bounds;
use dem_solid::geometry::closest::on_face;
use dem_solid::geometry::sphere::Sphere;
use dem_terrain::Terrain;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use toolkit::numbers::four;
use toolkit::scene::Scene;

/// Overlap over the sphere's radius that counts as a touch: what rounded coordinates leave.
const TOUCH: f64 = 3e-3;
/// The same over the overlap under the rock's own weight on this one sphere: at rest it may be as deep.
const RESTING: f64 = 1.5;
/// Halvings with which the free position is found.
const HALVINGS: usize = 12;

/// The deepest overlap of a rock.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Deepest {
    /// Overlap [m].
    overlap: f64,
    /// Number of the sphere.
    sphere: u32,
    /// Number of the element, if it is one of the net.
    element: u32,
}

/// Rock number `at` in the motion in which it starts, in local coordinates.
struct StartPose<'a> {
    model: &'a Model,
    at: usize,
    rock: &'a Rock,
    motion: Motion,
}

impl<'a> StartPose<'a> {
    fn of(model: &'a Model, at: usize) -> Self {
        Self { model, at, rock: &model.rocks[at], motion: model.start(at) }
    }

    fn radius(&self, sphere: u32) -> f64 {
        self.rock.spheres[sphere as usize].radius
    }

    /// What overlaps deepest, unless its sphere only touches: the rock's weight may rest on it by one of these laws.
    fn stuck<'b>(&self, deepest: Option<Deepest>, laws: impl Iterator<Item = &'b Law>) -> Option<Deepest> {
        let Deepest { overlap, sphere, .. } = deepest?;
        let (radius, weight) = (self.radius(sphere), self.rock.mass * self.model.settings.gravity.norm());
        let resting = laws.map(|law| resting(law, radius, weight)).fold(0.0, f64::max);
        deepest.filter(|_| overlap > (TOUCH * radius).max(RESTING * resting))
    }

    /// Its place moved along the unit vector `direction` until `overlap` is nothing, rounded to whole millimetres away from where
    /// it is.
    fn free(&self, direction: &Vector3<f64>, overlap: impl Fn(&Motion) -> Option<Deepest>) -> String {
        let moved = |by: f64| Motion { position: self.motion.position + direction * by, ..self.motion };
        let inside = |by: f64| overlap(&moved(by)).is_some_and(|d| d.overlap > 0.0);
        let mut high = 0.1 * self.rock.smallest_radius;
        while inside(high) && high < 1e9 {
            high *= 2.0;
        }
        let by = halved(0.0, high, HALVINGS, inside);
        let settings = &self.model.settings;
        let position = settings.rocks[self.at].position;
        let to = |axis: usize| {
            let millimetres = 1e3 * (position[axis] + direction[axis] * by);
            match direction[axis] {
                w if w > 1e-9 => millimetres.ceil() / 1e3,
                w if w < -1e-9 => millimetres.floor() / 1e3,
                _ => position[axis],
            }
        };
        // A sphere of a table has no key of its own.
        let key = if self.at < settings.named() { "position = " } else { "" };
        format!("try {key}{:?}", [0, 1, 2].map(to))
    }

    /// That it starts where it cannot.
    fn refused(&self, scene: &Scene, what: String, cure: String) -> Diagnostic {
        let refused = scene.invalid(&self.model.settings.place_key(self.at), what);
        refused.coded(code::PLACE).try_instead(cure)
    }
}

/// Overlap at which a law carries `force` [N] [m], by halving; 0 without force.
fn resting(law: &Law, radius: f64, force: f64) -> f64 {
    // Where it carries less at most, that is the most.
    halved(0.0, 2.0 * radius, 60, |overlap| law.normal.load(radius, overlap).force < force)
}

/// Refuse rock number `at` if it starts beside all of the terrain, below it, or with its surface in it.
pub fn on_terrain(model: &Model, ground: &Terrain, at: usize, scene: &Scene) -> Result<(), Diagnostic> {
    let (settings, start) = (&model.settings, StartPose::of(model, at));
    let table = &settings.rocks[at];
    let down = settings.down();
    let name = &start.rock.name;
    let refuse = |what: String, cure: String| Err(start.refused(scene, what, cure));
    let free = || start.free(&-down, |motion| in_terrain(&start, ground, motion, &down));
    let centre = Vector3::from(table.position);
    let [low, high] = ground.extent();
    match height(ground, settings, at) {
        Some(height) if height < 0.0 => {
            let other = place::other_heights(table.position[2] - height, table.position[2]);
            let cure = other.map_or_else(free, |other| format!("{}; {other}", free()));
            return refuse(format!("rock `{name}` starts {:.2} m below the terrain", -height), cure);
        }
        None if beside(&centre, &low, &high, &down) => {
            let meant = place::beside(&centre, &low, &high, 2.0 * start.rock.reach);
            return refuse(
                format!(
                    "rock `{name}` starts beside the terrain, at ({}, {}, {})",
                    centre.x, centre.y, centre.z
                ),
                format!(
                    "the terrain lies from ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1})",
                    low.x, low.y, low.z, high.x, high.y, high.z
                ) + &meant.map_or(String::new(), |meant| format!("; {meant}")),
            );
        }
        _ => {}
    }
    let row = model.ground_rows.get(at).into_iter().flatten();
    let laws = row.map(|n| &model.surfaces()[usize::from(*n)]);
    let deepest = in_terrain(&start, ground, &start.motion, &down);
    let Some(Deepest { overlap, sphere, .. }) = start.stuck(deepest, laws) else { return Ok(()) };
    let (depth, radius) = (four(overlap), four(start.radius(sphere)));
    refuse(
        format!(
            "rock `{name}` starts in the terrain: its surface reaches {depth} m into it (sphere {sphere} of radius {radius} m)"
        ),
        free(),
    )
}

/// Refuse rocks that start with their surface beyond a side of the box.
pub fn in_box(model: &Model, scene: &Scene) -> Result<(), Diagnostic> {
    for at in 0..model.rocks.len() {
        let start = StartPose::of(model, at);
        let Some(row) = model.side_rows.get(at) else { return Ok(()) };
        for plane in &model.planes {
            let deepest = beyond(&start, plane, &start.motion);
            let laws = row.iter().map(|n| &model.surfaces()[usize::from(*n)]);
            let Some(Deepest { overlap, sphere, .. }) = start.stuck(deepest, laws) else { continue };
            let axis = plane.normal.iamax();
            let sign = if plane.normal[axis] > 0.0 { "+" } else { "-" };
            let (name, axis, [depth, radius]) =
                (&start.rock.name, ["x", "y", "z"][axis], [overlap, start.radius(sphere)].map(four));
            let what = format!(
                "rock `{name}` starts {depth} m beyond the side `{sign}{axis}` of the box (sphere {sphere} of radius {radius} m)"
            );
            let free = start.free(&-plane.normal, |motion| beyond(&start, plane, motion));
            return Err(start.refused(scene, what, free));
        }
    }
    Ok(())
}

/// The sphere of a rock that reaches furthest beyond a plane, if any does.
fn beyond(start: &StartPose, plane: &Plane, motion: &Motion) -> Option<Deepest> {
    let overlap = |sphere: &Sphere| {
        let centre = motion.position + motion.orientation * sphere.centre;
        sphere.radius + plane.normal.dot(&centre) - plane.offset
    };
    let all = (0..).zip(&start.rock.spheres).map(|(sphere, it)| (sphere, overlap(it)));
    let (sphere, overlap) = all.filter(|(_, overlap)| *overlap > 0.0).max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Deepest { overlap, sphere, element: 0 })
}

/// True if a line along `down` through a point misses the box between two corners, judged across the axis that `down`
/// follows most.
fn beside(point: &Vector3<f64>, low: &Vector3<f64>, high: &Vector3<f64>, down: &Vector3<f64>) -> bool {
    let upright = down.iamax();
    (0..3).any(|axis| axis != upright && !(low[axis]..=high[axis]).contains(&point[axis]))
}

/// The sphere that reaches deepest into the terrain, if any does.
fn in_terrain(start: &StartPose, ground: &Terrain, motion: &Motion, down: &Vector3<f64>) -> Option<Deepest> {
    let below = |point: &Vector3<f64>| ground.height(point, down).filter(|h| *h < 0.0);
    if below(&motion.position).is_none() && !ground.is_near(&motion.position, start.rock.reach) {
        return None;
    }
    let mut deepest: Option<Deepest> = None;
    for (number, sphere) in (0..).zip(&start.rock.spheres) {
        let centre = motion.position + motion.orientation * sphere.centre;
        let sunk = below(&centre);
        let mut nearest = sunk.map_or(sphere.radius, |height| -height);
        ground.about(&centre, nearest, |t| {
            let [a, b, c] = &ground.corners(t);
            nearest = nearest.min(on_face(&centre, [a, b, c]).to_point.norm());
        });
        let overlap = sphere.radius - if sunk.is_some() { -nearest } else { nearest };
        if overlap > deepest.map_or(0.0, |d| d.overlap) {
            deepest = Some(Deepest { overlap, sphere: number, element: 0 });
        }
    }
    deepest
}

/// Refuse rocks that start with their surface in the net, which is `contact_mesh`; what the user should know of others.
pub fn in_net(model: &Model, contact_mesh: &ContactMesh, scene: &Scene) -> Judged {
    let settings = &model.settings;
    for at in 0..model.rocks.len() {
        let start = StartPose::of(model, at);
        let deepest = in_elements(&start, contact_mesh, &start.motion);
        let Some(deepest) = start.stuck(deepest, model.surfaces().iter()) else { continue };
        let element = &contact_mesh.elements[deepest.element as usize];
        let [a, b, c] = element.nodes;
        let what = match element.kind {
            Kind::Line => format!("the line between nodes {a} and {b}"),
            Kind::Face => format!("the face of nodes {a}, {b} and {c}"),
            Kind::Point => format!("node {a}"),
        };
        let [x, y, z] = (contact_mesh.nodes[a as usize] + model.origin).into();
        let (name, sphere, [radius, depth]) =
            (&start.rock.name, deepest.sphere, [start.radius(deepest.sphere), deepest.overlap].map(four));
        let what = format!(
            "rock `{name}` starts inside the net: its sphere {sphere} of radius {radius} m overlaps {what} at ({x:.3}, {y:.3}, {z:.3}) by {depth} m"
        );
        // Back where it comes from; a rock at rest comes from above.
        let direction = -start.motion.velocity.try_normalize(1e-9).unwrap_or_else(|| settings.down());
        let free = start.free(&direction, |motion| in_elements(&start, contact_mesh, motion));
        return Err(start.refused(scene, what, free));
    }
    let mut warnings = reach::check(model, contact_mesh);
    warnings.extend((0..settings.named()).filter_map(|at| slips_through(model, contact_mesh, at)));
    warnings.extend((0..settings.named()).filter_map(|at| too_soft(model, contact_mesh, at)));
    Ok(warnings)
}

/// Lines of a net from which on their length is that of its openings, and share of it that a rock is too small for.
const LINES: usize = 100;
const OPEN: f64 = 0.9;

/// What is said of a rock that fits through the openings of a net of lines.
fn slips_through(model: &Model, net: &ContactMesh, at: usize) -> Option<Diagnostic> {
    let lines = net.elements.iter().filter(|element| element.kind == Kind::Line);
    let length = |element: &dem_contact::interface_mesh::Element| {
        let [a, b, _] = element.nodes.map(|node| net.nodes[node as usize]);
        (b - a).norm() - 2.0 * element.radius
    };
    let mut lengths: Vec<f64> = lines.map(length).collect();
    if lengths.len() < LINES || lengths.len() < net.elements.len() {
        return None;
    }
    lengths.sort_by(f64::total_cmp);
    let (opening, wide) = (lengths[lengths.len() / 2], 2.0 * model.rocks[at].reach);
    (wide < OPEN * opening).then(|| {
        let name = &model.rocks[at].name;
        let [wide, opening] = [wide, opening].map(four);
        let what = format!(
            "rock `{name}` is {wide} m wide, and the lines of the net are {opening} m apart: it may fly through"
        );
        let cure = "smaller cells in the net, or a larger rock";
        Diagnostic::warning(code::UNUSUAL_VALUE, what).about(model.settings.table(at)).try_instead(cure)
    })
}

/// Share of the middle one of a net's three extents over which it brakes a rock at the longest.
const BRAKES: f64 = 0.25;

/// What is said of a rock that a net would hold only deep inside its spheres: its weight alone, on those that touch a plane
/// together, presses them in that far; or the largest force of a spring that brakes it presses them through the net.
fn too_soft(model: &Model, net: &ContactMesh, at: usize) -> Option<Diagnostic> {
    let (settings, rock) = (&model.settings, &model.rocks[at]);
    let laws = model.laws.as_ref().filter(|_| !net.nodes.is_empty())?;
    let number = laws.number(&settings.rocks[at].material, STRUCTURE)?;
    let (radius, weight) = (rock.smallest_radius, rock.mass * settings.gravity.norm());
    let share = resting(&laws.surfaces[number], radius, weight / rock.facing) / radius;
    let contact = settings.contacts.get(number)?;
    let key = contact.strength().map_or("young", |(key, _)| key);
    let about = format!("contact.{number}.{key}");
    let cure = "1000 kN/m is stiffness = 1e6, 1 GPa is young = 1e9";
    let [low, high] = bounds(net.nodes.iter().copied());
    let mut extents: [f64; 3] = (high - low).into();
    extents.sort_by(f64::total_cmp);
    let distance = BRAKES * extents[1];
    let force = rock.mass * model.start(at).velocity.norm_squared() / distance;
    let (name, smallest) = (&rock.name, four(radius));
    // A modulus makes deep contacts stiffer.
    let judged = key == "stiffness" && share <= LIMIT && extents[1] > 2.0 * rock.reach;
    if judged && resting(&laws.surfaces[number], radius, force / rock.facing) > 0.5 * radius {
        let distance = four(distance);
        let what = format!(
            "the net presses rock `{name}` in by more than half the radius of its spheres (smallest {smallest} m) where it brakes it over \
             {distance} m: the rock may go through it"
        );
        return Some(likely(&about, what, cure));
    }
    (share > LIMIT).then(|| {
        let what = format!(
            "rock `{name}` at rest on the net overlaps it by more than {LIMIT} of the radius of its spheres (smallest {smallest} m, above \
             {LIMIT} the law does not hold)"
        );
        likely(&about, what, cure)
    })
}

/// The deepest overlap of a rock's spheres with the elements of a net, if there is any.
fn in_elements(start: &StartPose, contact_mesh: &ContactMesh, motion: &Motion) -> Option<Deepest> {
    let mut deepest: Option<Deepest> = None;
    for (number, element) in (0..).zip(&contact_mesh.elements) {
        let nodes = element.nodes.map(|n| contact_mesh.nodes[n as usize]);
        let reach = start.rock.reach + element.radius;
        if distance(element, &motion.position, &nodes) > reach {
            continue;
        }
        let own = nodes.map(|n| motion.orientation.inverse_transform_vector(&(n - motion.position)));
        let low = own[0].inf(&own[1]).inf(&own[2]).add_scalar(-element.radius);
        let high = own[0].sup(&own[1]).sup(&own[2]).add_scalar(element.radius);
        start.model.trees[start.at].near(&low, &high, |k| {
            let sphere = &start.rock.spheres[k as usize];
            let overlap = sphere.radius + element.radius - distance(element, &sphere.centre, &own);
            if overlap > deepest.map_or(0.0, |d| d.overlap) {
                deepest = Some(Deepest { overlap, sphere: k, element: number });
            }
        });
    }
    deepest
}
