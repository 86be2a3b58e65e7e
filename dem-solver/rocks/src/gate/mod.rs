//! What can be known of a scene before it starts: an error where it is certainly wrong, a warning where it is
//! possible, but unusual.
//!
//! - [`gravity`]: none, not downward, in another unit
//! - [`ground`]: ground that gives way as contact of something else than terrain
//! - [`units`]: density, size, speed and turn of the rocks
//! - [`contacts`]: stiffness, friction and damping of contacts, strength of the ground
//! - [`clusters`]: a file of spheres that is of another body
//! - [`start`]: the surface of a rock in the terrain, in the net or in another rock
//! - [`landing`]: the overlap that a landing on terrain will give
//! - [`place`]: a start beside, below or high above the terrain: in which other units or axes it would be on it
//! - [`reach`]: a rock that flies past the net
//! - [`duration`]: whether the simulated time fits

pub mod clusters;
pub mod contacts;
pub mod duration;
pub mod gravity;
pub mod ground;
pub mod landing;
pub mod lengths;
pub mod place;
pub mod reach;
pub mod start;
pub mod units;

use crate::model::Model;
use dem_contact::rock::Rock;
use dem_contact::settings::{ContactSettings, STRUCTURE, Settings};
use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;
use units::Judged;

/// What is wrong with gravity and with the units and the spheres of the rocks; else what the user should know of them.
pub fn of_scene(settings: &Settings, rocks: &[Rock], scene: &Scene) -> Judged {
    let mut warnings = gravity::check(settings.gravity, settings.terrain.is_some(), scene)?;
    for (at, (rock, table)) in rocks.iter().zip(&settings.rocks).enumerate().take(settings.named()) {
        warnings.extend(units::of_rock(at, rock, table, scene)?);
        warnings.extend(clusters::check(at, rock, table, scene)?);
    }
    of_tables(settings, scene, warnings)
}

fn of_tables(settings: &Settings, scene: &Scene, mut warnings: Vec<Diagnostic>) -> Judged {
    for (at, group) in settings.spheres.iter().enumerate() {
        warnings.extend(units::of_spheres(at, group, scene)?);
    }
    for (number, contact) in settings.contacts.iter().enumerate() {
        warnings.extend(contacts::of_contact(number, contact, scene)?);
    }
    Ok(warnings)
}

/// The same for many spheres.
pub fn of_spheres(settings: &Settings, scene: &Scene) -> Judged {
    let mut warnings = gravity::check(settings.gravity, false, scene)?;
    warnings.extend(units::of_region(settings));
    of_tables(settings, scene, warnings)
}

/// The same for rocks that start in the terrain, and for how they come down on it.
pub fn of_model(model: &Model, scene: &Scene) -> Judged {
    let mut warnings = duration::check(model);
    start::in_box(model, scene)?;
    if let Some(ground) = &model.ground {
        warnings.extend(place::below_all_land(ground));
        warnings.extend(place::heights(ground));
        let of_ground = |law: &ContactSettings| !law.between.iter().flatten().any(|name| name == STRUCTURE);
        let laws = model.settings.contacts.iter().enumerate().filter(|(_, law)| of_ground(law));
        warnings.extend(laws.flat_map(|(number, law)| contacts::lossless(number, law)));
        for at in 0..model.rocks.len() {
            start::on_terrain(model, ground, at, scene)?;
        }
        for at in model.settings.examples() {
            warnings.extend(place::above(model, ground, at));
        }
        warnings.extend(landing::check(model, ground));
    }
    Ok(warnings)
}
