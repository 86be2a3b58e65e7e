//! Whether the simulated time fits the scene: long enough for a rock to come down, not longer than anyone waits.

use super::lengths::height as height_at_start;
use crate::model::Model;
use dem_terrain::Terrain;
use dem_terrain::queries::Parabola;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use toolkit::numbers::four;

/// Steps of which something is said: some ten hours of one rock.
const STEPS: f64 = 1e10;
/// Speed of a free fall that is beyond all falls on Earth [m/s].
const FALLEN: f64 = 1_000.0;
/// Pieces in which the flight of a rock is evaluated.
const PIECES: usize = 400;
const END_TIME: &str = "end_time";

/// What the user should know of `end_time`.
pub fn check(model: &Model) -> Vec<Diagnostic> {
    let (settings, step) = (&model.settings, model.steps.step);
    let mut warnings = Vec::new();
    let doubt = |code, what: String| Diagnostic::warning(code, what).about(END_TIME);
    let steps = settings.end_time / step;
    if steps > STEPS {
        let what = format!("{} s is {} steps of {} s", four(settings.end_time), four(steps), four(step));
        warnings.push(doubt(code::SIZE, what).try_instead("times are in seconds"));
    }
    let speed = settings.gravity.norm() * settings.end_time;
    if model.ground.is_none() && settings.sides.is_none() && speed > FALLEN {
        let what = format!("{} s, in which a free fall gets to {} m/s", four(settings.end_time), four(speed));
        let cure =
            format!("were it in milliseconds, it would be end_time = {}", four(1e-3 * settings.end_time));
        warnings.push(doubt(code::LIKELY_UNIT, what).try_instead(cure));
    }
    if let Some(terrain) = settings.terrain.as_ref().filter(|t| t.rest_time > settings.end_time) {
        let [rest, end] = [terrain.rest_time, settings.end_time].map(four);
        let what =
            format!("{rest} s is longer than the run, end_time = {end} s, so no rock counts as at rest");
        let doubted = Diagnostic::warning(code::LIKELY_UNIT, what).about("terrain.rest_time");
        warnings.push(doubted.try_instead("500 ms is 0.5"));
    }
    if let Some(ground) = &model.ground {
        for at in settings.examples() {
            warnings.extend(flight(model, ground, at));
        }
    }
    warnings
}

/// What is said of a rock that is still in its first flight at the end.
fn flight(model: &Model, ground: &Terrain, at: usize) -> Option<Diagnostic> {
    let (settings, rock) = (&model.settings, &model.rocks[at]);
    let start = model.start(at);
    let flight = Parabola { position: start.position, velocity: start.velocity, gravity: settings.gravity };
    // Clear of the terrain over the whole time, with its furthest point in all directions.
    let clear = |time: f64| {
        let place = flight.at(time);
        !ground.is_near(&place, rock.reach) && ground.height(&place, &settings.down()).is_none_or(|h| h > 0.0)
    };
    let ends = (0..=PIECES).all(|piece| clear(settings.end_time * piece as f64 / PIECES as f64));
    let height = height_at_start(ground, settings, at)?;
    let fall = height
        - rock.depth(&dem_contact::rock::Motion { position: Vector3::zeros(), ..start }, &settings.down());
    let g = settings.gravity.norm();
    (ends && g > 0.0 && fall > 0.0).then(|| {
        let speed = flight.velocity.dot(&settings.down());
        let (name, end) = (&rock.name, four(settings.end_time));
        let what = format!("rock `{name}` is still in its first flight at end_time = {end} s");
        let takes = four(dem_terrain::queries::arrival(fall, speed, g));
        let cure = format!("a fall of {} m takes {takes} s", four(fall));
        Diagnostic::warning(code::UNUSUAL_VALUE, what).about(END_TIME).try_instead(cure)
    })
}
