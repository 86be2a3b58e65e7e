//! Measures of a trajectory over terrain.

use crate::model::runout::Ending;
use crate::model::state::{Body, State};
use crate::model::{Model, prefix};
use crate::terrain::Terrain;
use interface_defs::message::Measure;
use nalgebra::Vector3;

/// Measures of the trajectory of rock number `at`; where it has not ended, a warning says so.
pub fn results(
    model: &Model,
    ground: &Terrain,
    at: usize,
    state: &State,
    measures: &mut Vec<Measure>,
    warnings: &mut Vec<String>,
) {
    let (rock, settings, prefix) = (&model.rocks[at], &model.settings, prefix(model, at));
    let Body { motion, path, .. } = &state.bodies[at];
    let start = Vector3::from(settings.rocks[at].position) - model.origin;
    let mut report = |name: &str, value: f64, unit: &str, time: Option<f64>| {
        measures.push(Measure { name: format!("{prefix}{name}"), value, unit: unit.into(), time });
    };
    let down = settings.down();
    // A rock that has ended may have gone on while others had not.
    let (end, last) = path.ending.map_or((state.time, motion.position), |end| (end.time, end.position));
    let moved = last - start;
    let level = moved - down * moved.dot(&down);
    let place = last + ground.origin;
    match path.ending.map(|end| end.how) {
        Some(Ending::Rest) => {
            for name in ["runout_distance", "run_out"] {
                report(name, level.norm(), "m", Some(end));
            }
            for (axis, name) in ["rest_x", "rest_y", "rest_z"].into_iter().enumerate() {
                report(name, place[axis], "m", Some(end));
            }
        }
        Some(Ending::Out) => {
            for name in ["exit_distance", "way_out"] {
                report(name, level.norm(), "m", Some(end));
            }
            warnings.push(format!(
                "runout_distance, rest_x, rest_y, rest_z of rock `{}` absent: it left the terrain at {end:.3} s near ({:.2}, \
                 {:.2}, {:.2})",
                rock.name, place.x, place.y, place.z
            ));
        }
        None => warnings.push(format!(
            "runout_distance, rest_x, rest_y, rest_z of rock `{}` absent: it still moved at {:.3} m/s when the time was over; \
             raise end_time",
            rock.name,
            motion.velocity.norm()
        )),
    }
    report("max_jump_height", path.highest.0, "m", Some(path.highest.1));
    report("max_speed", path.fastest.0, "m/s", Some(path.fastest.1));
    report("max_kinetic_energy", path.most_energy.0, "J", Some(path.most_energy.1));
    report("impacts", path.impacts as f64, "1", None);
    if end > 0.0 {
        for name in ["contact_time_fraction", "contact_share"] {
            report(name, path.in_contact / end, "1", None);
        }
    }
}
