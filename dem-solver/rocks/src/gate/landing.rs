//! How deep the spheres of a rock will overlap when it lands on terrain.
//!
//! All of its energy at the first touch is stored in the contacts of the spheres that a plane presses at once, in the
//! worst of many turns: on a corner few small spheres carry what on a face many share. Dashpots and spin leave less.

use super::lengths::height as height_at_start;
pub use super::units::LIMIT;
use crate::model::{Model, halved};
use dem_contact::contact::whole_rock::Whole;
use dem_contact::law::normal::Normal;
use dem_contact::rock::{Motion, Rock};
use dem_solid::geometry::sphere::direction;
use dem_terrain::Terrain;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use toolkit::numbers::four;

/// Modulus of steel [Pa]: no rock is stiffer.
const STIFFEST: f64 = 2.1e11;
/// Turns that are tried.
const TURNS: usize = 60;
/// Halvings.
const HALVINGS: usize = 40;

/// What the user should know of the first landing of each rock.
pub fn check(model: &Model, ground: &Terrain) -> Vec<Diagnostic> {
    model.settings.examples().into_iter().filter_map(|at| of_rock(model, ground, at)).collect()
}

fn of_rock(model: &Model, ground: &Terrain, at: usize) -> Option<Diagnostic> {
    let (settings, rock) = (&model.settings, &model.rocks[at]);
    let height = height_at_start(ground, settings, at)?;
    let motion = Motion { position: Vector3::zeros(), ..model.start(at) };
    // Its lowest point falls no further than to the terrain below the centre.
    let fall = (height - rock.depth(&motion, &settings.down())).max(0.0);
    let speed = (motion.velocity.norm_squared() + 2.0 * settings.gravity.norm() * fall).sqrt();
    let energy = 0.5 * rock.mass * speed * speed;
    // Of the terrain where no zone lies; a zone may never be touched.
    let law = usize::from(*model.ground_rows.get(at)?.first()?);
    let normal = &model.surfaces()[law].normal;
    let contact = &settings.contacts[law];
    let doubted = |what: String, cure: String| {
        let what = format!("rock `{}` lands on the terrain with up to {what}, above {LIMIT}", rock.name);
        Some(Diagnostic::warning(code::DEPTH_EXPECTED, what).about(settings.table(at)).try_instead(cure))
    };
    if let Some(whole) = &model.wholes[at] {
        let deepest = worst_whole(rock, whole, normal, energy);
        if deepest <= LIMIT {
            return None;
        }
        // What a contact stores is in proportion to its stiffness.
        let times = least_above(|times| worst_whole(rock, whole, normal, energy / times) <= LIMIT);
        let (key, value) = contact.strength().expect("checked: the law needs it");
        let unit = if key == "ground_stiffness" { "N/m" } else { "Pa" };
        let (energy, deepest, radius) = (four(energy), four(deepest), four(whole.radius));
        return doubted(
            format!("{energy} J and is expected to go in by up to {deepest} of its radius of {radius} m"),
            format!("{key} = {} {unit} keeps it below", four(value * times)),
        );
    }
    let deepest = worst(rock, normal, energy);
    if deepest <= LIMIT {
        return None;
    }
    let times = stiffer(rock, normal, energy);
    let stiffness = contact.strength().and_then(|(key, value)| match key {
        "young" => (value * times <= STIFFEST).then(|| format!("young = {} Pa", four(value * times))),
        "stiffness" => Some(format!("stiffness = {} N/m", four(value * times))),
        _ => Some(format!("{key} = {}", four(value * times))),
    });
    let law = contact.law.kind().as_whole.map(|whole| format!("contact.{law}.law = \"{whole}\""));
    let radius = larger(rock, deepest).map(|r| format!("cluster.smallest_radius = {} m (about)", four(r)));
    let cures: Vec<String> = [law, radius, stiffness].into_iter().flatten().collect();
    let cure = match cures.join(" or ") {
        none if none.is_empty() => "larger spheres keep".into(),
        cures => format!("{cures} keeps"),
    };
    let overlap = if deepest.is_finite() { four(deepest) } else { "more than twice".into() };
    let (speed, radius) = (four(speed), four(rock.smallest_radius));
    doubted(
        format!(
            "{speed} m/s: its spheres (smallest radius {radius} m) are expected to overlap by up to {overlap} of their radius"
        ),
        format!("{cure} it below"),
    )
}

/// How deep a rock that touches as a whole goes into a plane with `energy` [J], over its radius, in the worst of the turns.
pub fn worst_whole(rock: &Rock, whole: &Whole, normal: &Normal, energy: f64) -> f64 {
    let of = |turn: usize| {
        let down = direction(turn, TURNS);
        let ends: Vec<f64> = rock.spheres.iter().map(|s| s.centre.dot(&down) + s.radius).collect();
        let first = ends.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let stored = |travel: f64| {
            let overlaps = ends.iter().enumerate().map(|(k, end)| (k as u32, travel - (first - end)));
            let sum = overlaps.filter(|(_, d)| *d > 0.0).map(|(k, d)| whole.part(k, d)).sum();
            normal.load(whole.radius, whole.equivalent(sum)).energy
        };
        halved(0.0, 2.0 * whole.radius, HALVINGS, |travel| stored(travel) < energy) / whole.radius
    };
    (0..TURNS).map(of).fold(0.0, f64::max)
}

/// Smallest radius for the limit to hold [m], where the rock has spheres of that size: the overlap over the radius falls
/// with the radius to the power of 1.2 where one sphere carries all, and less where several share.
fn larger(rock: &Rock, deepest: f64) -> Option<f64> {
    let radius = rock.smallest_radius * deepest / LIMIT;
    (radius < rock.largest_radius).then_some(radius)
}

/// How many times as stiff the contact must be for the limit to hold.
pub fn stiffer(rock: &Rock, normal: &Normal, energy: f64) -> f64 {
    // What a contact stores is in proportion to its stiffness.
    least_above(|times| worst(rock, normal, energy / times) <= LIMIT)
}

/// The least number above 1, to half a per cent, from which on `holds` does; 1e12 where none is.
fn least_above(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high): (f64, f64) = (1.0, 2.0);
    while !holds(high) && high < 1e12 {
        low = high;
        high *= 2.0;
    }
    for _ in 0..8 {
        let middle = f64::sqrt(low * high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

/// Deepest overlap over its radius of any sphere of a rock that is pressed on a plane with `energy` [J], in the worst of
/// the turns; infinite beyond twice the largest radius.
pub fn worst(rock: &Rock, normal: &Normal, energy: f64) -> f64 {
    (0..TURNS).map(|turn| pressed(rock, normal, energy, &direction(turn, TURNS))).fold(0.0, f64::max)
}

fn pressed(rock: &Rock, normal: &Normal, energy: f64, down: &Vector3<f64>) -> f64 {
    // How far each sphere stays behind the first, up to where none can be reached.
    let most = 2.0 * rock.largest_radius;
    let depth = |s: &dem_solid::geometry::sphere::Sphere| s.centre.dot(down) + s.radius;
    let first = rock.spheres.iter().map(depth).fold(f64::NEG_INFINITY, f64::max);
    let near: Vec<(f64, f64)> = rock
        .spheres
        .iter()
        .map(|s| (first - depth(s), s.radius))
        .filter(|(behind, _)| *behind < most)
        .collect();
    let stored = |travel: f64| {
        let of = |(behind, radius): &(f64, f64)| normal.load(*radius, (travel - behind).max(0.0)).energy;
        near.iter().map(of).sum::<f64>()
    };
    if stored(most) < energy {
        return f64::INFINITY;
    }
    let high = halved(0.0, most, HALVINGS, |travel| stored(travel) < energy);
    near.iter().map(|(behind, radius)| (high - behind) / radius).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dem_contact::law::normal::hertz::Hertz;
    use dem_contact::law::normal::linear::Linear;
    use dem_contact::settings::{Cluster, RockSettings, Shape};
    use toolkit::scene::{Scene, read_value};

    fn rock(shape: Shape, spheres: u32, mass: f64) -> Rock {
        with(shape, Cluster::of(spheres), mass)
    }

    fn with(shape: Shape, cluster: Cluster, mass: f64) -> Rock {
        let text = "position = [0.0, 0.0, 0.0]\nmass = 1.0\nshape = { type = \"sphere\", radius = 1.0 }";
        let table: toml::Table = text.parse().expect("TOML");
        let mut settings: RockSettings = read_value("rock", &table.into()).expect("a rock");
        settings.mass = Some(mass);
        settings.shape = shape;
        settings.cluster = Some(cluster);
        let scene = Scene::from_text("test.toml", "").expect("a scene");
        Rock::new(0, &settings, &scene, &[]).unwrap_or_else(|e| panic!("{e}")).0
    }

    /// One sphere: the closed form of Hertz.
    #[test]
    fn a_single_sphere_overlaps_as_the_closed_form_says() {
        let ball = rock(Shape::Sphere { radius: 0.2 }, 1, 80.0);
        for law in [
            Normal::HertzMindlin(Hertz { modulus: 2e8 }),
            Normal::Linear(Linear { stiffness: 3e6, per_radius: false }),
        ] {
            let exact = law.deepest(0.2, 80.0, 5.0) / 0.2;
            assert!((worst(&ball, &law, 0.5 * 80.0 * 25.0) / exact - 1.0).abs() < 1e-9);
        }
    }

    /// Of one ball the closed form; of a cube the corner, and the modulus that is proposed keeps it at the limit.
    #[test]
    fn a_rock_as_a_whole_goes_in_as_deep_as_the_closed_form_says() {
        let ball = rock(Shape::Sphere { radius: 0.2 }, 1, 80.0);
        let exact = Normal::HertzMindlin(Hertz { modulus: 2e8 }).deepest(0.2, 80.0, 5.0) / 0.2;
        let law = |modulus| Normal::HertzRock(Hertz { modulus });
        let found = worst_whole(&ball, &Whole::new(&ball), &law(2e8), 0.5 * 80.0 * 25.0);
        assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
        let cube = rock(Shape::Box { size: [0.8; 3] }, 512, 1382.4);
        let (whole, energy) = (Whole::new(&cube), 0.5 * 1382.4 * 15.8_f64.powi(2));
        let corner = worst_whole(&cube, &whole, &law(3.2e10), energy);
        // An elastic landing on its corner, computed: 0.0257 (tests/terrain/whole.rs).
        assert!((corner / 0.0257 - 1.0).abs() < 0.1, "{corner}");
        let times = least_above(|times| worst_whole(&cube, &whole, &law(1e6), energy / times) <= LIMIT);
        let kept = worst_whole(&cube, &whole, &law(1e6 * times), energy);
        assert!(kept <= LIMIT && kept > 0.95 * LIMIT, "{kept}");
    }

    /// The spheres of an irregular block reach down to small ones; with the radius that is proposed they carry the landing.
    #[test]
    fn the_smallest_radius_that_is_proposed_keeps_the_overlap_below_the_limit() {
        let shape = Shape::RandomConvex { size: [1.5, 1.1, 0.9], seed: 3, points: 40 };
        let law = Normal::HertzMindlin(Hertz { modulus: 2e10 });
        let energy = 0.5 * 1900.0 * 16.7_f64.powi(2);
        let fine = rock(shape.clone(), 300, 1900.0);
        let before = worst(&fine, &law, energy);
        assert!(before > LIMIT, "{before}");
        let radius = larger(&fine, before).expect("a radius");
        let after = worst(
            &with(shape, Cluster { smallest_radius: Some(radius), ..Cluster::of(300) }, 1900.0),
            &law,
            energy,
        );
        assert!(after <= LIMIT, "{before} {after} with {radius} m");
    }

    /// Three spheres at equal depth share the energy; the worst turn of a cube is on a corner or near it, where one sphere is first.
    #[test]
    fn a_cube_overlaps_less_on_its_face_than_at_worst_and_never_more_than_one_sphere_alone() {
        let cube = rock(Shape::Box { size: [0.4; 3] }, 64, 170.0);
        let law = Normal::HertzMindlin(Hertz { modulus: 2e8 });
        let energy = 0.5 * 170.0 * 9.0;
        let face = pressed(&cube, &law, energy, &Vector3::z());
        let radius = cube.smallest_radius;
        let shared = law.deepest(radius, 170.0 / 16.0, 3.0) / radius;
        assert!((face / shared - 1.0).abs() < 1e-9, "{face} {shared}");
        let alone = law.deepest(radius, 170.0, 3.0) / radius;
        let most = worst(&cube, &law, energy);
        assert!(most > 1.5 * face && most <= alone * (1.0 + 1e-9), "{face} {most} {alone}");
        let times = stiffer(&cube, &law, energy);
        let modulus = law.modulus().expect("by Hertz");
        let kept = worst(&cube, &Normal::HertzMindlin(Hertz { modulus: modulus * times }), energy);
        assert!(kept <= LIMIT && (most <= LIMIT || kept > 0.9 * LIMIT), "{kept}");
    }
}
