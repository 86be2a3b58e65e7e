//! Measures of impacts on the net, of trajectories over terrain, and of how deep spheres were pressed in. What they count from: [`crate::model::impact`].

use crate::model::critical::DEEP;
use crate::model::impact::ImpactRecord;
use crate::model::state::{Against, Body, State};
use crate::model::{Model, name_of};
use dem_contact::settings::Settings;
use dem_terrain::Terrain;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::{Measure, Statistics, Worse};
use interface_defs::verdict::Fate;
use nalgebra::Vector3;

/// Largest angle between impact direction and gravity at which a depth measures the impact [degrees].
const STEEP: f64 = 30.0;

/// Measures of the committed state, and warnings: a reason for each that is absent.
pub fn results(model: &Model, state: &State, net: bool, out: &mut Statistics) {
    for (number, body) in state.bodies.iter().enumerate().take(model.settings.named()) {
        let mut report = Reporter::of(model, number, out);
        if net {
            // With nothing to hit an impact is not missed.
            one_impact(&body.track, &model.settings, state.broken > 0, &mut report);
        }
        if let Some((depth, time)) = body.deepest.largest() {
            report.add(penetration("max_penetration", depth, time));
        }
        for (partner, depth, time) in body.deepest.each().filter(|(_, depth, _)| *depth > DEEP) {
            let cure = match partner {
                Against::Net => "beyond it wires may pass between spheres; raise contact.young",
                Against::Terrain if model.gives_way(number) => {
                    "deeper prints are meant where the scene says [limits] penetration = 1.0; else raise contact.ground_modulus"
                }
                Against::Terrain if model.wholes[number].is_some() => "raise contact.young",
                Against::Terrain => "raise contact.young or cluster.smallest_radius",
                Against::Rocks => "of the smaller sphere; raise contact.young",
                Against::Sides => "raise contact.young",
            };
            let name = format!("rock `{}`", report.rock);
            report.out.warnings.push(too_deep(&name, partner, depth, time, cure));
        }
    }
    // Of each table of spheres the deepest of any.
    let loose = || state.bodies[model.settings.named()..].iter().zip(&model.settings.group);
    for (number, group) in model.settings.spheres.iter().enumerate() {
        let own = loose().filter(|(_, group)| usize::from(**group) == number);
        let all = own.flat_map(|(body, _)| body.deepest.each());
        let Some((partner, depth, time)) = all.reduce(|a, b| if b.1 > a.1 { b } else { a }) else { continue };
        out.measures.push(penetration(format!("{}_max_penetration", group.name), depth, time));
        if depth > DEEP {
            let name = format!("spheres `{}`", group.name);
            out.warnings.push(too_deep(&name, partner, depth, time, "raise contact.young"));
        }
    }
    // The same of all rocks together.
    let of_rocks = state.bodies.iter().map(|body| body.deepest.of(Against::Rocks));
    if let Some((depth, time)) = of_rocks.filter(|d| d.0 > 0.0).reduce(|a, b| if b.0 > a.0 { b } else { a }) {
        let deepest = penetration("max_penetration_of_rocks", depth, time);
        out.measures.push(deepest.ranked(Measure::ORDINARY, Worse::Larger));
    }
}

/// Measures of the trajectory of rock number `at`; where it has not ended, a warning says so.
pub fn of_trajectory(model: &Model, ground: &Terrain, at: usize, state: &State, out: &mut Statistics) {
    const OF_REST: &str = "runout_distance, rest_x, rest_y, rest_z";
    let mut report = Reporter::of(model, at, out);
    let Body { motion, path, .. } = &state.bodies[at];
    let down = model.settings.down();
    // A rock that has ended may have gone on while others had not.
    let (end, last) = path.ending.map_or((state.time, motion.position), |end| (end.time, end.position));
    let moved = last - (Vector3::from(model.settings.rocks[at].position) - model.origin);
    let level = (moved - down * moved.dot(&down)).norm();
    let place = last + ground.origin;
    match path.ending.map(|end| end.how) {
        Some(Fate::AtRest) => {
            report.add(Measure::new("runout_distance", level, "m").at(end).ranked(140, Worse::Larger));
            for (rank, (name, value)) in
                (220..).zip(["rest_x", "rest_y", "rest_z"].into_iter().zip(place.iter()))
            {
                report.add(Measure::new(name, *value, "m").at(end).ranked(rank, Worse::Neither));
            }
        }
        Some(_) => {
            report.add(Measure::new("exit_distance", level, "m").at(end).ranked(150, Worse::Larger));
            let near = format!("({:.2}, {:.2}, {:.2})", place.x, place.y, place.z);
            report.absent(OF_REST, &format!("it left the terrain at {end:.3} s near {near}"));
        }
        None => {
            let why = format!("it still moved at {:.3} m/s when the time was over", motion.velocity.norm());
            report.absent_with_cure(OF_REST, &why, Some("raise end_time"));
        }
    }
    for (name, (value, time), unit, rank) in [
        ("max_jump_height", path.highest, "m", 190),
        ("max_speed", path.fastest, "m/s", 180),
        ("max_kinetic_energy", path.most_energy, "J", 200),
    ] {
        report.add(Measure::new(name, value, unit).at(time).ranked(rank, Worse::Larger));
    }
    report.add(Measure::new("impacts", path.impacts as f64, "1").ranked(210, Worse::Neither));
    if end > 0.0 {
        report.add(Measure::new("contact_time_fraction", path.in_contact / end, "1"));
    }
}

/// The deepest overlap of a sphere over its radius, which was at `time` [s].
pub fn penetration(name: impl Into<String>, depth: f64, time: f64) -> Measure {
    Measure::new(name, depth, "1").at(time).ranked(80, Worse::Larger)
}

/// That what `name` says overlaps deeper than its law holds.
fn too_deep(name: &str, partner: Against, depth: f64, time: f64, cure: &str) -> Diagnostic {
    let what = format!("{name}: overlap of {depth:.2} radii with {} at {time:.4} s", partner.words());
    let what = format!("{what}, beyond {DEEP} the contact law does not hold");
    Diagnostic::warning(code::TRUST, what).try_instead(cure)
}

/// Where measures of one rock go.
struct Reporter<'a> {
    /// What their names begin with: its name where there are several rocks.
    prefix: String,
    rock: &'a str,
    out: &'a mut Statistics,
}

impl<'a> Reporter<'a> {
    fn of(model: &'a Model, rock: usize, out: &'a mut Statistics) -> Self {
        let name = name_of(model, rock);
        let prefix = if model.settings.named() > 1 { format!("{name}_") } else { String::new() };
        Self { prefix, rock: name, out }
    }

    fn add(&mut self, measure: Measure) {
        self.out.measures.push(Measure { name: format!("{}{}", self.prefix, measure.name), ..measure });
    }

    fn vector(&mut self, name: &str, value: &Vector3<f64>, unit: &str, time: f64) {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(value.iter()) {
            self.add(Measure::new(format!("{name}_{axis}"), *value, unit).at(time));
        }
    }

    fn absent(&mut self, names: &str, why: &str) {
        self.absent_with_cure(names, why, None);
    }

    /// The same, and what to try.
    fn absent_with_cure(&mut self, names: &str, why: &str, cure: Option<&str>) {
        let what = format!("{names} of rock `{}` absent: {why}", self.rock);
        let absent = Diagnostic::warning(code::ABSENT_MEASURE, what);
        self.out.warnings.push(absent.try_if(cure.map(str::to_owned)));
    }
}

const ALL: &str = "impact_speed, impact_velocity, time_of_impact, impact_energy, max_deflection, max_travel, \
                   max_elongation, braking_time, rebound_speed";

fn one_impact(track: &ImpactRecord, settings: &Settings, torn: bool, report: &mut Reporter) {
    let Some(impact) = track.touch else {
        return report.absent(ALL, "it has not touched the net");
    };
    let at = impact.time;
    let speed = Measure::new("impact_speed", impact.velocity.norm(), "m/s").at(at);
    report.add(speed.ranked(90, Worse::Larger));
    report.add(Measure::new("time_of_impact", at, "s").at(at));
    report.vector("impact_velocity", &impact.velocity, "m/s", at);
    report.vector("impact_direction", &impact.direction, "1", at);
    report.add(Measure::new("impact_energy", impact.energy, "J").at(at).ranked(100, Worse::Larger));
    match track.passed {
        Some(fate) => report.absent(
            "max_deflection, max_travel",
            &format!("the net did not stop it: it {} the net", fate.words()),
        ),
        None => distances(track, settings, report),
    }
    match track.elongation {
        Some((elongation, time)) => {
            let elongation = Measure::new("max_elongation", elongation, "m").at(time);
            report.add(elongation.ranked(250, Worse::Larger));
            if torn {
                let what = format!(
                    "max_elongation of rock `{}` is that before something of the structure tore: loose parts fly farther",
                    report.rock
                );
                report.out.warnings.push(Diagnostic::warning(code::TRUST, what));
            }
        }
        None if torn => {
            report.absent("max_elongation", "something of the structure had torn before the impact")
        }
        None => {}
    }
    match (track.stopped, track.passed) {
        (Some(time), _) => {
            let braking = Measure::new("braking_time", time - impact.time, "s").at(time);
            report.add(braking.ranked(120, Worse::Neither));
        }
        (None, Some(_)) => report.absent("braking_time", "the net did not stop it"),
        (None, None) => report.absent(
            "braking_time",
            "it still moved along the impact direction at the end; max_deflection and max_travel are those reached by \
             then; raise end_time",
        ),
    }
    match track.rebound {
        Some((speed, time)) => {
            report.add(Measure::new("rebound_speed", speed, "m/s").at(time).ranked(130, Worse::Larger));
        }
        None => report.absent("rebound_speed", "no contact ended on the rebound"),
    }
    if let Some(time) = track.behind {
        let what = format!(
            "rock `{}`: from {time:.4} s on the net lay behind the centres of its outer spheres, in gaps between \
             them, where the contact is weaker than its law; forces are less sure than deflections",
            report.rock
        );
        report.out.warnings.push(Diagnostic::warning(code::TRUST, what).try_instead("raise contact.young"));
    }
}

/// Measures of the distance that it went.
fn distances(track: &ImpactRecord, settings: &Settings, report: &mut Reporter) {
    match (track.steepness(settings), track.deepest) {
        (Some(angle), Some((depth, time))) if angle <= STEEP && depth > 0.0 => {
            report.add(Measure::new("max_deflection", depth, "m").at(time).ranked(50, Worse::Larger));
        }
        (Some(angle), _) if angle <= STEEP => {
            report.absent("max_deflection", "its lowest point never lay below the lowest node of the net at rest");
        }
        (Some(angle), _) => report.absent(
            "max_deflection",
            &format!(
                "the impact direction is {angle:.1} degrees from gravity, a depth measures impacts within {STEEP}; \
                 max_travel is counted along the impact direction"
            ),
        ),
        (None, _) => report.absent("max_deflection", "there is no gravity; max_travel is counted along the impact direction"),
    }
    if let Some((travel, time)) = track.travel {
        report.add(Measure::new("max_travel", travel.max(0.0), "m").at(time).ranked(110, Worse::Larger));
    }
}
