//! Measures of a trajectory over terrain.

use crate::model::state::{Body, State};
use crate::model::{Model, prefix};
use dem_terrain::Terrain;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::{Measure, Worse};
use interface_defs::verdict::Fate;
use nalgebra::Vector3;

/// Those that are worse when larger.
const LARGER: [&str; 5] =
    ["runout_distance", "exit_distance", "max_jump_height", "max_speed", "max_kinetic_energy"];

/// Measures of the trajectory of rock number `at`; where it has not ended, a warning says so.
pub fn results(
    model: &Model,
    ground: &Terrain,
    at: usize,
    state: &State,
    measures: &mut Vec<Measure>,
    warnings: &mut Vec<Diagnostic>,
) {
    let (rock, settings, prefix) = (&model.rocks[at], &model.settings, prefix(model, at));
    let Body { motion, path, .. } = &state.bodies[at];
    let start = Vector3::from(settings.rocks[at].position) - model.origin;
    let mut report = |name: &str, value: f64, unit: &str, time: Option<f64>, rank: u16| {
        let worse = if LARGER.contains(&name) { Worse::Larger } else { Worse::Neither };
        measures.push(Measure::new(format!("{prefix}{name}"), value, unit).at(time).ranked(rank, worse));
    };
    let mut absent = |why: String, cure: Option<&str>| {
        let what = format!("runout_distance, rest_x, rest_y, rest_z of rock `{}` absent: {why}", rock.name);
        warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what).try_if(cure.map(str::to_owned)));
    };
    let down = settings.down();
    // A rock that has ended may have gone on while others had not.
    let (end, last) = path.ending.map_or((state.time, motion.position), |end| (end.time, end.position));
    let moved = last - start;
    let level = moved - down * moved.dot(&down);
    let place = last + ground.origin;
    match path.ending.map(|end| end.how) {
        Some(Fate::AtRest) => {
            report("runout_distance", level.norm(), "m", Some(end), 140);
            for (axis, name) in ["rest_x", "rest_y", "rest_z"].into_iter().enumerate() {
                report(name, place[axis], "m", Some(end), 220 + axis as u16);
            }
        }
        Some(_) => {
            report("exit_distance", level.norm(), "m", Some(end), 150);
            let near = format!("({:.2}, {:.2}, {:.2})", place.x, place.y, place.z);
            absent(format!("it left the terrain at {end:.3} s near {near}"), None);
        }
        None => {
            let speed = motion.velocity.norm();
            absent(
                format!("it still moved at {speed:.3} m/s when the time was over"),
                Some("raise end_time"),
            );
        }
    }
    report("max_jump_height", path.highest.0, "m", Some(path.highest.1), 190);
    report("max_speed", path.fastest.0, "m/s", Some(path.fastest.1), 180);
    report("max_kinetic_energy", path.most_energy.0, "J", Some(path.most_energy.1), 200);
    report("impacts", path.impacts as f64, "1", None, 210);
    if end > 0.0 {
        report("contact_time_fraction", path.in_contact / end, "1", None, Measure::ORDINARY);
    }
}
