//! Within what the solver is tested: beyond it a scene runs, with a warning that says so.
//!
//! Inside, `tests/behaviour/extremes.rs` and `limits.rs` assert that answers are right or refused with a reason. What cannot be (a mass of 0, a
//! restitution above 1, a step above the critical one) is refused everywhere.

use super::{ContactSettings, RockSettings};

/// Mass of a rock [kg].
pub const MASS: [f64; 2] = [1e-3, 1e6];
/// Fastest start [m/s].
pub const SPEED: f64 = 100.0;
/// Young's moduli [Pa].
pub const YOUNG: [f64; 2] = [1e5, 1e12];
/// Least restitution.
pub const RESTITUTION: f64 = 0.01;
/// Largest Coulomb coefficient.
pub const FRICTION: f64 = 10.0;
/// Largest coordinate [m]: doubles are 2e-9 m apart there.
pub const COORDINATE: f64 = 1e7;

/// What is said of a value outside `[lowest, highest]`.
fn outside(what: &str, value: f64, unit: &str, [lowest, highest]: [f64; 2]) -> Option<String> {
    let mega = if unit == "Pa" && value < lowest {
        format!("; were it in MPa, it would be {:e} Pa", 1e6 * value)
    } else {
        String::new()
    };
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let range = match (lowest == f64::NEG_INFINITY, highest == f64::INFINITY) {
        (true, _) => format!("up to {highest:e}{unit}"),
        (_, true) => format!("from {lowest:e}{unit} on"),
        _ => format!("from {lowest:e} to {highest:e}{unit}"),
    };
    (!(lowest..=highest).contains(&value))
        .then(|| format!("{what} of {value:e}{unit}: this solver is tested {range}; check its result{mega}"))
}

/// Warnings about the laws of contact.
pub fn of_contacts(contacts: &[ContactSettings]) -> Vec<String> {
    let mut found = Vec::new();
    for (number, contact) in contacts.iter().enumerate() {
        let name = |key: &str| format!("contact.{number}.{key}: a {key}");
        let up_to = |highest: f64| [f64::NEG_INFINITY, highest];
        let moduli = [("young", contact.young), ("partner_young", contact.partner_young)];
        found.extend(moduli.into_iter().filter_map(|(key, value)| outside(&name(key), value?, "Pa", YOUNG)));
        let least = [RESTITUTION, f64::INFINITY];
        found.extend(contact.restitution.and_then(|e| outside(&name("restitution"), e, "", least)));
        found.extend(outside(&name("friction"), contact.friction, "", up_to(FRICTION)));
    }
    found
}

/// Warnings about rock number `at`, of `mass` [kg].
pub fn of_rock(at: usize, rock: &RockSettings, mass: f64) -> Vec<String> {
    let mass: f64 = format!("{mass:.3e}").parse().unwrap_or(mass);
    let name = |key: &str, what: &str| format!("rock.{at}.{key}: rock `{}`: a {what}", rock.name);
    let speed = rock.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
    let furthest = rock.position.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let up_to = |highest: f64| [f64::NEG_INFINITY, highest];
    [
        outside(&name("mass", "mass"), mass, "kg", MASS),
        outside(&name("velocity", "speed"), speed, "m/s", up_to(SPEED)),
        outside(&name("position", "coordinate"), furthest, "m", up_to(COORDINATE)),
    ]
    .into_iter()
    .flatten()
    .collect()
}
