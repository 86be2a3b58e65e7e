//! Where a rock starts: over the terrain, not beside it and not in it.

use super::Ground;
use crate::rock::Rock;
use crate::settings::{RockSettings, Settings};
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use nalgebra::Vector3;

/// Height [m] of the centre of mass over the terrain at the start; `None` where there is none below it.
pub fn height(ground: &Ground, settings: &Settings, table: &RockSettings) -> Option<f64> {
    ground.height(&(Vector3::from(table.position) - ground.origin), &settings.down())
}

/// Refuse rock number `at` of the scene if its centre starts below the terrain or beside all of it.
pub fn check(
    ground: &Ground,
    settings: &Settings,
    at: usize,
    rock: &Rock,
    scene: &Scene,
) -> Result<(), InputError> {
    let table = &settings.rocks[at];
    let place = Vector3::from(table.position);
    let refuse = |what: String, advice: String| {
        Err(scene.invalid(&format!("rock.{at}.position"), what).try_instead(advice))
    };
    let (low, high) = (ground.lowest + ground.origin, ground.highest + ground.origin);
    match height(ground, settings, table) {
        Some(height) if height < 0.0 => {
            // As high as its furthest point reaches, and a little.
            let free = place - settings.down() * (1.02 * rock.reach - height);
            let [x, y, z] = free.map(|c| (c * 100.0).ceil() / 100.0).into();
            refuse(
                format!("rock `{}` starts {:.2} m below the terrain", rock.name, -height),
                format!("just above it is position = [{x}, {y}, {z}]"),
            )
        }
        None if beside(&place, &low, &high, &settings.down()) => refuse(
            format!(
                "rock `{}` starts beside the terrain, at ({}, {}, {})",
                rock.name, place.x, place.y, place.z
            ),
            format!(
                "the terrain lies from ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1})",
                low.x, low.y, low.z, high.x, high.y, high.z
            ),
        ),
        _ => Ok(()),
    }
}

/// Whether a line along `down` through a point misses the box between two corners, judged across the axis that `down`
/// follows most.
fn beside(point: &Vector3<f64>, low: &Vector3<f64>, high: &Vector3<f64>, down: &Vector3<f64>) -> bool {
    let upright = down.iamax();
    (0..3).any(|axis| axis != upright && !(low[axis]..=high[axis]).contains(&point[axis]))
}
