//! Within what the solver is tested: beyond it a scene runs, with a warning that says so.
//!
//! Inside, `tests/behaviour/extremes.rs` and `limits.rs` assert that answers are right or refused with a reason. What cannot be (a mass of 0, a
//! restitution above 1, a step above the critical one) is refused everywhere.

use super::{ContactSettings, RockSettings};
use interface_defs::diagnostic::{Diagnostic, code};
use toolkit::numbers::rounded;

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

/// What is said of a value of `key` outside `[low, high]`.
fn outside(key: String, what: &str, value: f64, unit: &str, [low, high]: [f64; 2]) -> Option<Diagnostic> {
    let (code, mega) = match unit == "Pa" && value < low {
        true => (code::LIKELY_UNIT, format!("; were it in MPa, it would be {:e} Pa", 1e6 * value)),
        false => (code::UNUSUAL_VALUE, String::new()),
    };
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let range = match (low == f64::NEG_INFINITY, high == f64::INFINITY) {
        (true, _) => format!("up to {high:e}{unit}"),
        (_, true) => format!("from {low:e}{unit} on"),
        _ => format!("from {low:e} to {high:e}{unit}"),
    };
    (!(low..=high).contains(&value)).then(|| {
        let what = format!("{what} of {value:e}{unit}: this solver is tested {range}");
        Diagnostic::warning(code, what).about(key).try_instead(format!("check its result{mega}"))
    })
}

/// Warnings about the laws of contact.
pub fn of_contacts(contacts: &[ContactSettings]) -> Vec<Diagnostic> {
    let of_one = |(number, contact): (usize, &ContactSettings)| {
        let of = |key: &str, value: Option<f64>, unit: &str, range: [f64; 2]| {
            outside(format!("contact.{number}.{key}"), &format!("a {key}"), value?, unit, range)
        };
        [
            of("young", contact.young, "Pa", YOUNG),
            of("partner_young", contact.partner_young, "Pa", YOUNG),
            of("restitution", contact.restitution, "", [RESTITUTION, f64::INFINITY]),
            of("friction", Some(contact.friction), "", [f64::NEG_INFINITY, FRICTION]),
        ]
    };
    contacts.iter().enumerate().flat_map(of_one).flatten().collect()
}

/// Warnings about rock number `at`, of `mass` [kg].
pub fn of_rock(at: usize, rock: &RockSettings, mass: f64) -> Vec<Diagnostic> {
    let mass = rounded(mass, 4);
    let of = |key: &str, what: &str, value: f64, unit: &str, range: [f64; 2]| {
        outside(format!("rock.{at}.{key}"), &format!("rock `{}`: a {what}", rock.name), value, unit, range)
    };
    let speed = rock.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
    let furthest = rock.position.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let up_to = |highest: f64| [f64::NEG_INFINITY, highest];
    [
        of("mass", "mass", mass, "kg", MASS),
        of("velocity", "speed", speed, "m/s", up_to(SPEED)),
        of("position", "coordinate", furthest, "m", up_to(COORDINATE)),
    ]
    .into_iter()
    .flatten()
    .collect()
}
