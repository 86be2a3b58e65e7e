//! Where a rock starts: its whole surface outside of the terrain and of the net, tested by true overlap.

use super::lengths::{distance, height};
use super::units::{Judged, LIMIT, short};
use super::{place, reach};
use crate::model::{Model, halved};
use dem_contact::contact::broad_phase::cell_grid::Plane;
use dem_contact::interface_mesh::{ContactMesh, Kind};
use dem_contact::law::Law;
use dem_contact::rock::{Motion, Rock};
use dem_contact::settings::{STRUCTURE, Settings};
use dem_solid::geometry::closest::on_face;
use dem_solid::geometry::sphere::Sphere;
use dem_solid::geometry::sphere_tree::SphereTree;
use dem_terrain::Terrain;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
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
    rock: &'a Rock,
    tree: &'a SphereTree,
    motion: Motion,
}

impl<'a> StartPose<'a> {
    fn of(model: &'a Model, at: usize) -> Self {
        Self { rock: &model.rocks[at], tree: &model.trees[at], motion: model.start(at) }
    }

    /// Overlap up to which the sphere only touches: `weight` [N] rests on it.
    fn touches(&self, sphere: u32, laws: &[&Law], weight: f64) -> f64 {
        let radius = self.rock.spheres[sphere as usize].radius;
        let resting = laws.iter().map(|law| resting(law, radius, weight)).fold(0.0, f64::max);
        (TOUCH * radius).max(RESTING * resting)
    }

    /// How far along the unit vector `direction` the rock must be moved until `overlap` is nothing [m].
    fn until_free(&self, direction: &Vector3<f64>, overlap: impl Fn(&Motion) -> Option<Deepest>) -> f64 {
        let moved = |by: f64| Motion { position: self.motion.position + direction * by, ..self.motion };
        let inside = |by: f64| overlap(&moved(by)).is_some_and(|d| d.overlap > 0.0);
        let mut high = 0.1 * self.rock.smallest_radius;
        while inside(high) && high < 1e9 {
            high *= 2.0;
        }
        halved(0.0, high, HALVINGS, inside)
    }
}

/// Overlap at which a law carries `force` [N] [m], by halving; 0 without force.
fn resting(law: &Law, radius: f64, force: f64) -> f64 {
    // Where it carries less at most, that is the most.
    halved(0.0, 2.0 * radius, 60, |overlap| law.normal.load(radius, overlap).force < force)
}

/// That rock number `at` starts where it cannot.
fn misplaced(settings: &Settings, at: usize, scene: &Scene, what: String) -> Diagnostic {
    scene.invalid(&settings.place_key(at), what).coded(code::PLACE)
}

/// `position` moved by `by` along `direction`, rounded to whole millimetres away from where it is.
fn freed(settings: &Settings, at: usize, direction: &Vector3<f64>, by: f64) -> String {
    let position = settings.rocks[at].position;
    let places: Vec<String> = (0..3)
        .map(|axis| {
            let to = position[axis] + direction[axis] * by;
            let millimetres = 1e3 * to;
            match direction[axis] {
                w if w > 1e-9 => format!("{:?}", millimetres.ceil() / 1e3),
                w if w < -1e-9 => format!("{:?}", millimetres.floor() / 1e3),
                _ => format!("{:?}", position[axis]),
            }
        })
        .collect();
    // A sphere of a table has no key of its own.
    let key = if at < settings.named() { "position = " } else { "" };
    format!("free is {key}[{}]", places.join(", "))
}

/// Refuse rock number `at` if it starts beside all of the terrain, below it, or with its surface in it.
pub fn on_terrain(model: &Model, ground: &Terrain, at: usize, scene: &Scene) -> Result<(), Diagnostic> {
    let (settings, start) = (&model.settings, StartPose::of(model, at));
    let table = &settings.rocks[at];
    let down = settings.down();
    let name = &start.rock.name;
    let refuse = |what: String, cure: String| Err(misplaced(settings, at, scene, what).try_instead(cure));
    let free = || {
        let by = start.until_free(&-down, |motion| in_terrain(&start, ground, motion, &down));
        freed(settings, at, &-down, by)
    };
    let centre = Vector3::from(table.position);
    let (low, high) = (ground.lowest + ground.origin, ground.highest + ground.origin);
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
    let Some(deepest) = in_terrain(&start, ground, &start.motion, &down) else { return Ok(()) };
    let laws = model.laws.as_ref().map_or(&[][..], |laws| &laws.surfaces);
    let row: Vec<&Law> =
        model.ground_rows.get(at).into_iter().flatten().map(|n| &laws[*n as usize]).collect();
    let weight = start.rock.mass * settings.gravity.norm();
    if deepest.overlap <= start.touches(deepest.sphere, &row, weight) {
        return Ok(());
    }
    let sphere = &start.rock.spheres[deepest.sphere as usize];
    refuse(
        format!(
            "rock `{name}` starts in the terrain: its surface reaches {} m into it (sphere {} of radius {} m)",
            short(deepest.overlap),
            deepest.sphere,
            short(sphere.radius)
        ),
        free(),
    )
}

/// Refuse rocks that start with their surface beyond a side of the box.
pub fn in_box(model: &Model, scene: &Scene) -> Result<(), Diagnostic> {
    for at in 0..model.rocks.len() {
        let start = StartPose::of(model, at);
        let Some(row) = model.side_rows.get(at) else { return Ok(()) };
        let laws: Vec<&Law> =
            model.laws.iter().flat_map(|laws| row.iter().map(|n| &laws.surfaces[usize::from(*n)])).collect();
        let weight = start.rock.mass * model.settings.gravity.norm();
        for plane in &model.planes {
            let deepest = beyond(&start, plane, &start.motion);
            let Some(deepest) = deepest.filter(|d| d.overlap > start.touches(d.sphere, &laws, weight)) else {
                continue;
            };
            let direction = -plane.normal;
            let by = start.until_free(&direction, |motion| beyond(&start, plane, motion));
            let axis = plane.normal.iamax();
            let side =
                format!("{}{}", if plane.normal[axis] > 0.0 { "+" } else { "-" }, ["x", "y", "z"][axis]);
            let what = format!(
                "rock `{}` starts {} m beyond the side `{side}` of the box (sphere {} of radius {} m)",
                start.rock.name,
                short(deepest.overlap),
                deepest.sphere,
                short(start.rock.spheres[deepest.sphere as usize].radius)
            );
            let refused = misplaced(&model.settings, at, scene, what);
            return Err(refused.try_instead(freed(&model.settings, at, &direction, by)));
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

/// Whether a line along `down` through a point misses the box between two corners, judged across the axis that `down`
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
    let laws = model.laws.as_ref().map_or(&[][..], |laws| &laws.surfaces);
    for at in 0..model.rocks.len() {
        let start = StartPose::of(model, at);
        let Some(deepest) = in_elements(&start, contact_mesh, &start.motion) else { continue };
        let weight = start.rock.mass * settings.gravity.norm();
        let all: Vec<&Law> = laws.iter().collect();
        if deepest.overlap <= start.touches(deepest.sphere, &all, weight) {
            continue;
        }
        // Back where it comes from; a rock at rest comes from above.
        let direction = -start.motion.velocity.try_normalize(1e-9).unwrap_or_else(|| settings.down());
        let by = start.until_free(&direction, |motion| in_elements(&start, contact_mesh, motion));
        let element = &contact_mesh.elements[deepest.element as usize];
        let [a, b, c] = element.nodes;
        let what = match element.kind {
            Kind::Line => format!("the line between nodes {a} and {b}"),
            Kind::Face => format!("the face of nodes {a}, {b} and {c}"),
            Kind::Point => format!("node {a}"),
        };
        let [x, y, z] = (contact_mesh.nodes[a as usize] + model.origin).into();
        let what = format!(
            "rock `{}` starts inside the net: its sphere {} of radius {} m overlaps {what} at ({x:.3}, {y:.3}, {z:.3}) by {} m",
            start.rock.name,
            deepest.sphere,
            short(start.rock.spheres[deepest.sphere as usize].radius),
            short(deepest.overlap)
        );
        let refused = misplaced(settings, at, scene, what);
        return Err(refused.try_instead(freed(settings, at, &direction, by)));
    }
    let mut warnings = reach::check(model, contact_mesh);
    warnings.extend((0..settings.named()).filter_map(|at| too_soft(model, at)));
    Ok(warnings)
}

/// What is said of a rock that a net would hold only deep inside its spheres: its weight alone, on those that touch a plane
/// together, presses them in that far.
fn too_soft(model: &Model, at: usize) -> Option<Diagnostic> {
    let (settings, rock) = (&model.settings, &model.rocks[at]);
    let laws = model.laws.as_ref()?;
    let number = laws.number(&settings.rocks[at].material, STRUCTURE)?;
    let (radius, weight) = (rock.smallest_radius, rock.mass * settings.gravity.norm());
    let share = resting(&laws.surfaces[number], radius, weight / rock.facing) / radius;
    let contact = settings.contacts.get(number)?;
    let key = contact.strength().map_or("young", |(key, _)| key);
    (share > LIMIT).then(|| {
        let what = format!(
            "rock `{}` at rest on the net overlaps it by more than {} of the radius of its spheres \
             (smallest {} m, above {LIMIT} the law does not hold)",
            rock.name,
            short(LIMIT),
            short(radius)
        );
        Diagnostic::warning(code::LIKELY_UNIT, what)
            .about(format!("contact.{number}.{key}"))
            .try_instead("1000 kN/m is stiffness = 1e6, 1 GPa is young = 1e9")
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
        start.tree.near(&low, &high, |k| {
            let sphere = &start.rock.spheres[k as usize];
            let overlap = sphere.radius + element.radius - distance(element, &sphere.centre, &own);
            if overlap > deepest.map_or(0.0, |d| d.overlap) {
                deepest = Some(Deepest { overlap, sphere: k, element: number });
            }
        });
    }
    deepest
}
