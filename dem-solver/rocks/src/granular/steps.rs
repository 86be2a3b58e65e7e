//! The largest stable step of many spheres, and the step that is taken.
//!
//! Two cases, the stiffer counts. An impact: two of the smallest spheres collide as fast as the scene can
//! make them fall, `w^2 = k / m*`. A packing: a sphere of mass m has N = 12 neighbours that move against
//! it, `w^2 <= 2 N k / m` (the largest sum of a row of the stiffness over the mass bounds every
//! frequency), each pressed with the weight of a column of the greatest height. Where friction holds,
//! the tangential springs move a sphere and turn it: `7/2 k_t` instead of `k_n`.
//!
//! With damping ratio z the limit shrinks by `sqrt(1 + 4 z^2) - 2 z` ([`crate::model::critical`]).

use crate::model::critical::{DEEP, critical};
use crate::model::{Steps, halved};
use dem_contact::law::Law;
use dem_contact::law::rolling::STIFFNESS;
use dem_contact::settings::placement::Start;
use dem_contact::settings::{RollingName, Settings};
use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;

/// Most spheres that touch one of equal size.
const NEIGHBOURS: f64 = 12.0;

/// The step for the spheres of `start` under `laws`; one above the critical step is refused unless allowed.
pub fn steps(settings: &Settings, start: &Start, laws: &[Law], scene: &Scene) -> Result<Steps, Diagnostic> {
    let springs = laws.iter().any(|l| l.rolling.is_some_and(|r| r.kind == RollingName::Spring));
    let gravity = settings.gravity.norm();
    let height = height(settings, start);
    let fastest = start.velocity.iter().map(|v| v.norm()).fold(0.0, f64::max);
    // Two may collide head on.
    let speed = 2.0 * (fastest * fastest + 2.0 * gravity * height).sqrt();
    let speed = if speed > 0.0 { speed } else { 1.0 };
    let endless = f64::INFINITY;
    let mut steps = Steps { critical: endless, contact: endless, speed, ..Steps::default() };
    let lightest = (0..start.mass.len()).min_by(|a, b| start.mass[*a].total_cmp(&start.mass[*b]));
    let lightest = lightest.expect("checked: there are spheres");
    let (mass, radius) = (start.mass[lightest], start.radius[lightest]);
    let heaviest = start.mass.iter().copied().fold(0.0, f64::max);
    let widest = start.radius.iter().copied().fold(0.0, f64::max);
    for law in laws {
        // Two of the smallest; a mesh or a large partner makes a contact up to sqrt(2) as stiff.
        let stiffest = |overlap: f64| law.normal.load(radius, overlap.min(DEEP * radius)).stiffness;
        let impact = stiffest(law.normal.deepest(0.5 * radius, 0.5 * mass, speed));
        let column = heaviest * gravity * (height / (2.0 * widest)).max(1.0);
        let pressed = stiffest(overlap_under(law, 0.5 * radius, column));
        let shear = law.tangential.as_ref().map_or(1.0, |t| (3.5 * t.stiffness_ratio).max(1.0));
        let rolling =
            law.rolling.filter(|_| springs).map_or(0.0, |r| 2.5 * STIFFNESS * r.friction * r.friction);
        let share = shear.max(rolling);
        let squares = (2.0 * impact / mass).max(2.0 * NEIGHBOURS * pressed / mass) * share;
        let ratio = law.damping.map_or(0.0, |d| d.ratio);
        steps.critical = steps.critical.min(critical(squares.sqrt(), ratio));
        steps.contact = steps.contact.min(law.normal.impact(0.5 * radius, 0.5 * mass, speed).1);
        steps.stiffness = steps.stiffness.max(impact.max(pressed));
    }
    steps.choose(&settings.dem, f64::INFINITY);
    let impact = format!("impact at {:.2} m/s, contacts of {:.3e} N/m", steps.speed, steps.stiffness);
    steps.check(&settings.dem, &impact, scene)?;
    Ok(steps)
}

/// Largest height that a sphere may fall [m]: through the box, or until `end_time`.
fn height(settings: &Settings, start: &Start) -> f64 {
    let Some(down) = settings.gravity.try_normalize(0.0) else { return 0.0 };
    let free = 0.5 * settings.gravity.norm() * settings.end_time * settings.end_time;
    let fastest = start.velocity.iter().map(|v| v.norm()).fold(0.0, f64::max);
    let fall = free + fastest * settings.end_time;
    settings.sides.as_ref().map_or(fall, |sides| fall.min(sides.height(&down)))
}

/// Overlap at which `law` carries `force` [N] at effective radius `radius`.
fn overlap_under(law: &Law, radius: f64, force: f64) -> f64 {
    // Bisection in powers of two of the radius: the law grows steadily.
    halved(0.0, DEEP * radius, 60, |overlap| law.normal.load(radius, overlap).force < force)
}
