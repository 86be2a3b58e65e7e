//! Measures of a trajectory over terrain.

use super::measures::Reporter;
use crate::model::Model;
use crate::model::state::{Body, State};
use dem_terrain::Terrain;
use interface_defs::message::{Measure, Statistics, Worse};
use interface_defs::verdict::Fate;
use nalgebra::Vector3;

/// Measures of the trajectory of rock number `at`; where it has not ended, a warning says so.
pub fn results(model: &Model, ground: &Terrain, at: usize, state: &State, out: &mut Statistics) {
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
            report.absent_unless(OF_REST, &why, Some("raise end_time"));
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
