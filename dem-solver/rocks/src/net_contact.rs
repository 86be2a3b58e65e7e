//! The stiffest contact that a rock may come into with the structure, in numbers for `rockfall check`.

use crate::model::Model;
use crate::model::critical::DEEP;
use dem_contact::law::Law;
use dem_contact::rock::Rock;
use dem_contact::settings::{EffectiveMass, RockSettings, STRUCTURE};
use std::collections::BTreeMap;

/// The contact of the rocks with the structure under the law that holds between them; laws for terrain and between rocks do not
/// count. Empty where no law is for the structure.
pub fn numbers(model: &Model) -> BTreeMap<String, f64> {
    let speed = model.steps.speed.max(f64::MIN_POSITIVE);
    // A flat landing on a rigid, fixed structure: an upper bound of each contact's stiffness.
    let landing = |(rock, table): (&Rock, &RockSettings)| {
        let laws = model.laws.as_ref()?;
        let law = &laws.surfaces[laws.number(&table.material, STRUCTURE)?];
        let (radius, contacts) = (rock.smallest_radius, rock.facing);
        let overlap = law.normal.deepest(radius, rock.mass / contacts, speed).min(DEEP * radius);
        // The largest sphere is the stiffest at an overlap, and it counts for as many of the smallest. What limits a linear
        // contact is its onset; the share of it that is allowed was measured with the smallest sphere.
        let largest = if exponent(law) > 0.0 { rock.largest_outer_radius() } else { radius };
        let load = law.normal.load(largest, overlap);
        let alike = load.stiffness / law.normal.load(radius, overlap).stiffness;
        let contacts = (contacts / alike).max(1.0);
        let mut extents: [f64; 3] = (rock.highest_corner - rock.lowest_corner).into();
        extents.sort_by(f64::total_cmp);
        // Half the width of what of a sphere lies below the surface that it is pressed into, and the distance of the spheres in a face.
        let patch = (2.0 * largest * overlap).sqrt();
        let pitch = (extents[1] * extents[2] / contacts).sqrt();
        Some((load, [patch, pitch, contacts], law, rock.mass))
    };
    let landings = model.rocks.iter().zip(&model.settings.rocks).filter_map(landing);
    let stiffest = landings.clone().max_by(|a, b| a.0.stiffness.total_cmp(&b.0.stiffness));
    let Some((load, [patch, pitch, contacts], law, _)) = stiffest else { return BTreeMap::new() };
    let heaviest = landings.map(|(.., mass)| mass).fold(0.0, f64::max);
    let mut numbers = vec![
        ("contact_stiffness_n_per_m", load.stiffness),
        ("contact_force_n", load.force),
        ("contact_energy_j", load.energy),
        ("contact_exponent", exponent(law)),
        ("contact_patch_m", patch),
        ("sphere_pitch_m", pitch),
        ("facing_spheres", contacts),
        ("landing_energy_j", 0.5 * heaviest * speed * speed),
    ];
    if let Some(damping) = &law.damping {
        numbers.push(("dashpot_ratio", damping.ratio));
        numbers.extend((damping.mass == EffectiveMass::Rock).then_some(("dashpot_mass_kg", heaviest)));
    }
    if let Some(tangential) = &law.tangential {
        numbers.extend([("tangential_ratio", tangential.stiffness_ratio), ("friction", tangential.friction)]);
    }
    numbers.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// The power of the force with which the stiffness of a contact grows.
fn exponent(law: &Law) -> f64 {
    law.normal.stiffening() / (law.normal.powers().overlap - 1.0)
}
