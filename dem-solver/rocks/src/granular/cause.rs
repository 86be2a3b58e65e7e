//! Why a step of many spheres went wrong, with the numbers.

use super::GranularModel;
use super::state::GranularState;
use crate::gate::landing::LIMIT;

/// How much faster than start and gravity make a sphere shows that contact forces gain energy.
const GAINED: f64 = 1.05;

/// Why spheres overlap too deep, or are nowhere any more, in a step of `h` [s].
pub fn of(model: &GranularModel, state: &GranularState, h: f64) -> String {
    let steps = &model.steps;
    if h > steps.critical * (1.0 + 1e-9) {
        return format!(
            "the step of {h:.3e} s is above the critical step of {:.3e} s, contact forces grow from step to step: shorten \
             dem.time_step below it, or leave it out",
            steps.critical
        );
    }
    let fastest = state.velocity.iter().map(|v| v.norm()).fold(0.0, f64::max);
    // Two that collide head on are assumed there.
    let possible = 0.5 * steps.speed;
    let lost = state.velocity.iter().any(|v| !v.norm().is_finite());
    if lost || fastest > GAINED * possible {
        return format!(
            "a sphere moves with {fastest:.4e} m/s, start and gravity give {possible:.4} m/s: contact forces have made energy; \
             shorten dem.time_step ({h:.3e} s)"
        );
    }
    // Two of the smallest, head on; for a given density the overlap over the radius is the same for all sizes.
    let (radius, speed) = (model.smallest, 2.0 * fastest);
    let at = model.radius.iter().position(|r| *r == radius).unwrap_or(0);
    let deepest = |law: &dem_contact::law::Law| {
        let overlap = law.normal.deepest(0.5 * radius, 0.5 * model.mass[at], speed) / radius;
        (overlap / LIMIT).powf(law.normal.powers().overlap)
    };
    let times = model.laws.iter().map(deepest).fold(0.0, f64::max);
    let seen = format!("fastest sphere {fastest:.4} m/s, smallest radius {radius:.3e} m");
    if times <= 1.0 {
        return format!(
            "what lies on them presses them further than their own speed does; raise contact.young ({seen})"
        );
    }
    let young = model.settings.contacts.iter().filter_map(|c| c.young).fold(f64::INFINITY, f64::min);
    let stiffness = if young.is_finite() {
        format!("raise contact.young from {young:.3e} to {:.2e} Pa", young * times)
    } else {
        format!("make it {times:.1} times as stiff (contact.stiffness)")
    };
    format!("the contact is too soft for that speed, {stiffness} ({seen})")
}
