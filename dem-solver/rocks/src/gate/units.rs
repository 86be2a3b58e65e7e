//! Units: values that are right in another unit than the one that the scene is written in.

use dem_contact::rock::Rock;
use dem_contact::settings::{RockSettings, Settings, Shape, SpheresSettings};
use dem_solid::geometry::sphere::extent;
use interface_defs::diagnostic::{Diagnostic, Severity, code};
use std::f64::consts::{PI, TAU};
use toolkit::numbers::four;
use toolkit::ranges::{Gate, refused};
use toolkit::scene::Scene;

/// Overlap over the radius beyond which the answer is not to be trusted; the bound of `[limits] penetration`.
pub const LIMIT: f64 = 0.5;
/// Rock and concrete are usual; the rest is of no solid.
pub(super) const DENSITY: Gate = Gate {
    key: "density",
    unit: "kg/m3",
    possible: [100.0, 25_000.0],
    usual: [1_000.0, 4_000.0],
    units: &[("g/cm3 or t/m3", 1e3), ("lb/ft3", 16.018_463), ("g/m3", 1e-3), ("mg/m3", 1e-6)],
    hint: "rock has 2000 to 3000 kg/m3",
    ..Gate::ANY
};
/// Longest edge of a rock of which nothing is said, and of one that is refused [m].
const LARGE: f64 = 20.0;
const LARGEST: f64 = 30.0;
/// Longest edge below which something is said [m].
const SMALL: f64 = 2e-3;
/// Largest volume of a norm rock of which nothing is said [m3].
const LARGEST_NORM: f64 = 20.0;
/// Share of a box that spheres fill, below which something is said.
const EMPTY: f64 = 1e-6;
const SPEED: Gate = Gate {
    key: "velocity",
    unit: "m/s",
    possible: [0.0, 1_000.0],
    usual: [0.0, 60.0],
    says: ["", "is faster than any rock falls"],
    units: &[("km/h", 1.0 / 3.6)],
    hint: "it is written in m/s; 25 m/s are 90 km/h",
};
const SPIN: Gate = Gate {
    key: "angular_velocity",
    unit: "rad/s",
    usual: [0.0, 60.0],
    units: &[("degrees per second", PI / 180.0)],
    hint: "no rock was seen to turn as fast",
    ..Gate::ANY
};

/// What is refused; else what the user should know.
pub type Judged = Result<Vec<Diagnostic>, Diagnostic>;

/// That a value of `key` is certainly wrong, and what it may have been.
fn wrong(key: &str, what: String, hint: String) -> Diagnostic {
    Diagnostic::error(code::LIKELY_UNIT, what).about(key).try_instead(hint)
}

/// That it is possible, but unusual.
pub(super) fn doubted(key: &str, what: String, hint: impl Into<String>) -> Diagnostic {
    Diagnostic::warning(code::UNUSUAL_VALUE, what).about(key).try_instead(hint)
}

/// That it is likely in another unit.
pub(super) fn likely(key: &str, what: String, hint: impl Into<String>) -> Diagnostic {
    doubted(key, what, hint).coded(code::LIKELY_UNIT)
}

/// What was found of keys of `table`: the first that is certainly wrong is an error at its place.
pub(super) fn judged(found: Vec<Diagnostic>, table: &str, scene: &Scene) -> Judged {
    let of = |found: Diagnostic| {
        let key = format!("{table}.{}", found.key.as_deref().unwrap_or_default());
        refused(found.about(key), scene)
    };
    found.into_iter().map(of).collect()
}

/// A rock with its edges.
struct Measured<'a> {
    rock: &'a Rock,
    table: &'a RockSettings,
    /// Edges of the box around it, in words.
    edges: String,
    /// The longest of them [m].
    longest: f64,
}

/// Of rock number `at`: refuse what is certainly wrong; else what the user should know.
pub fn of_rock(at: usize, rock: &Rock, table: &RockSettings, scene: &Scene) -> Judged {
    judged(all_of_rock(rock, table), &format!("rock.{at}"), scene)
}

/// All that is found of a rock, wherever its numbers are written, about keys of its table.
pub fn all_of_rock(rock: &Rock, table: &RockSettings) -> Vec<Diagnostic> {
    let size = extent(rock.solid.drawn.points.iter().map(|p| (*p, 0.0)));
    let longest = size.iter().copied().fold(0.0, f64::max);
    let edges = extents(size);
    let it = Measured { rock, table, edges, longest };
    let mut all = it.size();
    all.extend(it.density());
    if let Some(bound) = table.cluster.as_ref().and_then(|c| c.largest_error).filter(|bound| *bound > longest)
    {
        all.push(doubted(
            "cluster.largest_error",
            format!("is shorter than its largest_error of {bound} m, so that every cluster is within it"),
            "20 mm is 0.02",
        ));
    }
    all.extend(it.speed());
    all.extend(of_turning(table));
    for found in &mut all {
        let colon = if found.severity == Severity::Error { ":" } else { "" };
        found.message = format!("rock `{}`{colon} {}", rock.name, found.message);
    }
    all
}

/// Edges of a box [m], in words.
pub(super) fn extents(size: [f64; 3]) -> String {
    size.map(|edge| format!("{} m", four(edge))).join(" x ")
}

/// What a volume [m3] that few rocks have may have been.
pub fn in_litres(volume: f64) -> Option<String> {
    (volume > LARGEST_NORM).then(|| format!("were it in litres, it would be {} m3", four(1e-3 * volume)))
}

impl Measured<'_> {
    fn size(&self) -> Vec<Diagnostic> {
        let edges = &self.edges;
        let in_metres = in_metres(self.longest, &self.table.shape);
        if self.longest > LARGEST {
            return vec![wrong("shape", format!("it is {edges} large"), in_metres)];
        }
        let mut all = Vec::new();
        if !(SMALL..=LARGE).contains(&self.longest) {
            all.push(doubted("shape", format!("is {edges} large"), in_metres));
        }
        if let Shape::NormRock { volume, .. } = self.table.shape.scaled(self.table.scale.unwrap_or(1.0))
            && let Some(in_litres) = in_litres(volume)
        {
            let what = format!("has {} m3, and norm rocks have up to 2", four(volume));
            all.push(doubted("shape.volume", what, in_litres));
        }
        all
    }

    fn density(&self) -> Option<Diagnostic> {
        let (mass, volume, edges) = (self.rock.mass, self.rock.solid.volume(), &self.edges);
        let (density, stated) = (mass / volume, self.table.density);
        let found = DENSITY.judge("", stated.unwrap_or(density))?;
        let [in_words, kilograms, cubic] = [density, mass, volume].map(four);
        let message = format!("has a density of {in_words} kg/m3: {kilograms} kg in {cubic} m3 ({edges})");
        match (stated, found.severity) {
            (Some(_), Severity::Error) => Some(found),
            (Some(_), _) => Some(Diagnostic { message, ..found }),
            (None, _) if density < DENSITY.possible[0] && DENSITY.judge("", 1e3 * density).is_none() => {
                let what = format!(
                    "a mass of {kilograms} kg in {cubic} m3 ({edges}), a density of {in_words} kg/m3, as in tonnes"
                );
                Some(wrong("mass", what, format!("in kg that is mass = {:?}", 1e3 * mass)))
            }
            (None, _) => Some(doubted("mass", message, DENSITY.hint)),
        }
    }

    fn speed(&self) -> Option<Diagnostic> {
        let speed = norm(&self.table.velocity);
        let found = SPEED.judge("", speed)?;
        if found.severity == Severity::Error {
            return Some(found);
        }
        let message = format!("starts with {} m/s, {} km/h", four(speed), four(3.6 * speed));
        Some(Diagnostic { message, ..found })
    }
}

/// Of `[[spheres]]` number `at`: refuse a density that no solid has; else what the user should know.
pub fn of_spheres(at: usize, group: &SpheresSettings, scene: &Scene) -> Judged {
    let speed = Gate { usual: SPEED.possible, ..SPEED };
    let scatter = Gate { key: "velocity_scatter", ..speed };
    let found = [
        DENSITY.judge("", group.density),
        speed.judge("", norm(&group.velocity)),
        scatter.judge("", group.velocity_scatter),
    ];
    let named = found.into_iter().flatten().map(|found| {
        let message = format!("spheres `{}`: {}", group.name, found.message);
        Diagnostic { message, ..found }
    });
    judged(named.collect(), &format!("spheres.{at}"), scene)
}

/// What is said of a [box] in which all spheres together are next to nothing.
pub fn of_region(settings: &Settings) -> Option<Diagnostic> {
    let sides = settings.sides.as_ref()?;
    let edges = [0, 1, 2].map(|axis| sides.highest[axis] - sides.lowest[axis]);
    let largest = settings.spheres.iter().map(|group| group.radii()[1]).fold(0.0, f64::max);
    let ball = |group: &SpheresSettings| group.total() as f64 * 4.2 * group.radii()[1].powi(3);
    let share = settings.spheres.iter().map(ball).sum::<f64>() / edges.iter().product::<f64>();
    (share < EMPTY).then(|| {
        let (edges, largest) = (extents(edges), four(largest));
        let what = format!("{edges} for spheres of up to {largest} m radius, which fill {share:.0e} of it");
        likely("box", what, "lengths are in metres: 200 mm is 0.2")
    })
}

fn of_turning(table: &RockSettings) -> Vec<Diagnostic> {
    let mut all = Vec::new();
    let spin = norm(&table.angular_velocity);
    all.extend(SPIN.judge("", spin).map(|found| {
        let message = format!("spins with {} rad/s, {} turns a second", four(spin), four(spin / TAU));
        Diagnostic { message, ..found }
    }));
    let length = norm(&table.orientation);
    if !(0.5..=2.0).contains(&length) {
        let what =
            format!("has an orientation [w, x, y, z] of length {}, which is scaled to 1", four(length));
        let hint = "an angle a in radians about the unit axis e is [cos(a/2), sin(a/2) e]";
        all.push(doubted("orientation", what, hint));
    }
    if table.orientation == [0.0, 0.0, 0.0, 1.0] {
        let what =
            "has the orientation [0, 0, 0, 1], which is half a turn about z, as the order is [w, x, y, z]";
        all.push(doubted("orientation", what.into(), "no turn is [1, 0, 0, 0]"));
    }
    all
}

/// How a rock whose longest edge is `longest` [m] may have been meant.
fn in_metres(longest: f64, shape: &Shape) -> String {
    let (unit, size) = match longest {
        _ if longest > 200.0 => ("millimetres", 1e-3),
        _ if longest > LARGE => ("centimetres", 1e-2),
        _ => ("kilometres", 1e3),
    };
    match shape {
        Shape::Mesh { scale, .. } if size > 1.0 && *scale < 1.0 => {
            "is the file in metres? Then leave scale out".into()
        }
        Shape::Mesh { scale, .. } => format!("in {unit}? Then write scale = {:?}", size * scale),
        _ => {
            format!("lengths are in metres; were they in {unit}, it would be {} m long", four(size * longest))
        }
    }
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}
