//! Measures of impacts on the net, and of how deep spheres were pressed in. What they count from: [`crate::model::impact`].

use crate::model::critical::DEEP;
use crate::model::impact::ImpactRecord;
use crate::model::state::{Against, State};
use crate::model::{Model, prefix};
use crate::settings::Settings;
use interface_defs::message::Measure;
use nalgebra::Vector3;

/// Largest angle between impact direction and gravity at which a depth measures the impact [degrees].
const STEEP: f64 = 30.0;

/// Measures of the committed state, and warnings: a reason for each that is absent.
pub fn results(model: &Model, state: &State, net: bool, out: &mut Vec<Measure>, warnings: &mut Vec<String>) {
    for (number, rock) in model.rocks.iter().enumerate().take(model.settings.named()) {
        let (body, prefix) = (&state.bodies[number], prefix(model, number));
        let mut report = Reporter { prefix: &prefix, rock: &rock.name, out, warnings };
        if net {
            // With nothing to hit an impact is not missed.
            one_impact(&body.track, &model.settings, state.broken > 0, &mut report);
        }
        if let Some((depth, time)) = body.deepest.largest() {
            report.value("max_penetration", depth, "1", Some(time));
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
            report.warnings.push(format!(
                "rock `{}`: overlap of {depth:.2} radii with {} at {time:.4} s, beyond {DEEP} the contact law does not \
                 hold: {cure}",
                rock.name,
                partner.words()
            ));
        }
    }
    for (number, group) in model.settings.spheres.iter().enumerate() {
        of_group(model, state, number, &group.name, out, warnings);
    }
    // The same of all rocks together, under the name that it had.
    let of_rocks = state.bodies.iter().map(|body| body.deepest.of(Against::Rocks));
    if let Some((depth, time)) = of_rocks.filter(|d| d.0 > 0.0).reduce(|a, b| if b.0 > a.0 { b } else { a }) {
        let name = "max_penetration_of_rocks".into();
        out.push(Measure { name, value: depth, unit: "1".into(), time: Some(time) });
    }
}

/// The deepest overlap of any sphere of table number `number`, which is named `name`.
fn of_group(
    model: &Model,
    state: &State,
    number: usize,
    name: &str,
    out: &mut Vec<Measure>,
    warnings: &mut Vec<String>,
) {
    let (named, group) = (model.settings.named(), &model.settings.group);
    let own = state.bodies[named..].iter().zip(group).filter(|(_, g)| usize::from(**g) == number);
    let all = own.flat_map(|(body, _)| body.deepest.each());
    let Some((partner, depth, time)) = all.reduce(|a, b| if b.1 > a.1 { b } else { a }) else { return };
    let measure = format!("{name}_max_penetration");
    out.push(Measure { name: measure, value: depth, unit: "1".into(), time: Some(time) });
    if depth > DEEP {
        warnings.push(format!(
            "spheres `{name}`: overlap of {depth:.2} radii with {} at {time:.4} s, beyond {DEEP} the contact law does not \
             hold: raise contact.young",
            partner.words()
        ));
    }
}

/// Where measures of one rock go.
struct Reporter<'a> {
    prefix: &'a str,
    rock: &'a str,
    out: &'a mut Vec<Measure>,
    warnings: &'a mut Vec<String>,
}

impl Reporter<'_> {
    fn value(&mut self, name: &str, value: f64, unit: &str, time: Option<f64>) {
        self.out.push(Measure { name: format!("{}{name}", self.prefix), value, unit: unit.into(), time });
    }

    fn vector(&mut self, name: &str, value: &Vector3<f64>, unit: &str, time: Option<f64>) {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(value.iter()) {
            self.value(&format!("{name}_{axis}"), *value, unit, time);
        }
    }

    fn absent(&mut self, names: &str, why: &str) {
        self.warnings.push(format!("{names} of rock `{}` absent: {why}", self.rock));
    }
}

const ALL: &str = "impact_speed, impact_velocity, impact_time, impact_energy, max_deflection, max_travel, \
                   max_elongation, braking_time, rebound_speed";

fn one_impact(track: &ImpactRecord, settings: &Settings, torn: bool, report: &mut Reporter) {
    let Some(impact) = track.touch else {
        return report.absent(ALL, "it has not touched the net");
    };
    let at = Some(impact.time);
    report.value("impact_speed", impact.velocity.norm(), "m/s", at);
    for name in ["impact_time", "time_of_impact"] {
        report.value(name, impact.time, "s", at);
    }
    report.vector("impact_velocity", &impact.velocity, "m/s", at);
    report.vector("impact_direction", &impact.direction, "1", at);
    report.value("impact_energy", impact.energy, "J", at);
    match track.passed {
        Some(passing) => report.absent(
            "max_deflection, max_travel",
            &format!("the net did not stop it, it went {} it", passing.words()),
        ),
        None => distances(track, settings, report),
    }
    match track.elongation {
        Some((elongation, time)) => {
            report.value("max_elongation", elongation, "m", Some(time));
            if torn {
                report.warnings.push(format!(
                    "max_elongation of rock `{}` is that before something of the structure tore: loose parts fly farther",
                    report.rock
                ));
            }
        }
        None if torn => {
            report.absent("max_elongation", "something of the structure had torn before the impact")
        }
        None => {}
    }
    match (track.stopped, track.passed) {
        (Some(time), _) => report.value("braking_time", time - impact.time, "s", Some(time)),
        (None, Some(_)) => report.absent("braking_time", "the net did not stop it"),
        (None, None) => report.absent(
            "braking_time",
            "it still moved along the impact direction at the end; max_deflection and max_travel are those reached by \
             then; raise end_time",
        ),
    }
    match track.rebound {
        Some((speed, time)) => report.value("rebound_speed", speed, "m/s", Some(time)),
        None => report.absent("rebound_speed", "no contact ended on the rebound"),
    }
    if let Some(time) = track.behind {
        report.warnings.push(format!(
            "rock `{}`: from {time:.4} s on the net lay behind the centres of its outer spheres, in gaps between \
             them, where the contact is weaker than its law; forces are less sure than deflections; raise \
             contact.young",
            report.rock
        ));
    }
}

/// How far it went.
fn distances(track: &ImpactRecord, settings: &Settings, report: &mut Reporter) {
    match (track.steepness(settings), track.deepest) {
        (Some(angle), Some((depth, time))) if angle <= STEEP && depth > 0.0 => {
            report.value("max_deflection", depth, "m", Some(time));
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
        report.value("max_travel", travel.max(0.0), "m", Some(time));
    }
}
