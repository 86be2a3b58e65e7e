//! The stiffest contact that a rock may come into with the structure, in numbers for `rockfall check`.

use crate::model::Model;
use crate::model::critical::DEEP;
use dem_contact::law::Law;
use dem_contact::settings::{EffectiveMass, STRUCTURE};
use std::collections::BTreeMap;

/// A flat landing on a rigid, fixed structure: an upper bound of each contact's stiffness.
struct NetLanding {
    /// Stiffness of each contact [N/m].
    stiffness: f64,
    /// Force in it [N].
    force: f64,
    /// Energy that it stores [J].
    stored: f64,
    /// Half the width of what of a sphere lies below the surface that it is pressed into [m].
    patch: f64,
    /// Distance of the spheres in a face [m].
    pitch: f64,
    /// Contacts among which the rock is shared.
    contacts: f64,
    /// Kinetic energy of the rock [J].
    energy: f64,
}

/// The contact of the rocks with the structure under the law that holds between them; laws for terrain and between rocks do not
/// count. Empty where no law is for the structure.
pub fn numbers(model: &Model) -> BTreeMap<String, f64> {
    let mut numbers = BTreeMap::new();
    let Some(laws) = &model.laws else { return numbers };
    let speed = model.steps.speed.max(f64::MIN_POSITIVE);
    let landings = model.rocks.iter().zip(&model.settings.rocks).filter_map(|(rock, table)| {
        let law = &laws.surfaces[laws.number(&table.material, STRUCTURE)?];
        let (radius, contacts) = (rock.smallest_radius, rock.facing);
        let overlap = law.normal.deepest(radius, rock.mass / contacts, speed).min(DEEP * radius);
        // The largest sphere is the stiffest at an overlap, and it counts for as many of the smallest. What limits a linear
        // contact is its onset; the share of it that is allowed was measured with the smallest sphere.
        let largest = if exponent(law) > 0.0 { rock.largest_outer_radius() } else { radius };
        let load = law.normal.load(largest, overlap);
        let alike = load.stiffness / law.normal.load(radius, overlap).stiffness;
        let contacts = (contacts / alike).max(1.0);
        let energy = 0.5 * rock.mass * speed * speed;
        let mut extents: [f64; 3] = (rock.highest_corner - rock.lowest_corner).into();
        extents.sort_by(f64::total_cmp);
        let landing = NetLanding {
            stiffness: load.stiffness,
            force: load.force,
            stored: load.energy,
            patch: (2.0 * largest * overlap).sqrt(),
            pitch: (extents[1] * extents[2] / contacts).sqrt(),
            contacts,
            energy,
        };
        Some((landing, law, rock.mass))
    });
    let Some((landing, law, _)) = landings.clone().max_by(|a, b| a.0.stiffness.total_cmp(&b.0.stiffness))
    else {
        return numbers;
    };
    let mut report = |name: &str, value: f64| numbers.insert(name.to_owned(), value);
    report("contact_stiffness_n_per_m", landing.stiffness);
    report("contact_force_n", landing.force);
    report("contact_energy_j", landing.stored);
    report("contact_exponent", exponent(law));
    report("contact_patch_m", landing.patch);
    report("sphere_pitch_m", landing.pitch);
    report("facing_spheres", landing.contacts);
    report("landing_energy_j", landings.clone().map(|(l, ..)| l.energy).fold(0.0, f64::max));
    if let Some(damping) = &law.damping {
        report("dashpot_ratio", damping.ratio);
        if damping.mass == EffectiveMass::Rock {
            report("dashpot_mass_kg", landings.map(|(.., mass)| mass).fold(0.0, f64::max));
        }
    }
    if let Some(tangential) = &law.tangential {
        report("tangential_ratio", tangential.stiffness_ratio);
        report("friction", tangential.friction);
    }
    numbers
}

/// The power of the force with which the stiffness of a contact grows.
fn exponent(law: &Law) -> f64 {
    law.normal.stiffening() / (law.normal.powers().overlap - 1.0)
}
