//! Guards of a step: stop where the answer would be wrong and look calm; [`cause`] says why it came to that.

pub mod cause;

use crate::model::state::Against;
use cause::Case;
use dem_contact::contact::pipeline::Sums;
use dem_contact::contact::whole_rock::Whole;
use dem_contact::rock::{Motion, Rock};
use dem_terrain::Terrain;
use interface_defs::Fault;

/// Overlap over radius from which on it is tested whether the surface is behind a centre: two spheres
/// 1.25 radii apart cover the line between their centres with 0.375 each.
const PASSING: f64 = 0.2;

/// How far the surface may lie behind the centres of the outer spheres, in radii. At a rim a loaded wire
/// rests in the gap between two spheres, up to the line of their centres and a little beyond (21 952
/// spheres in the drop test): that is reported as a warning. This much further no layer holds it.
const DEEPEST: f64 = 0.5;

/// The same of a rock that touches as a whole, in its radius: centres are tested twice as deep inside.
pub const STRIDE_OF_WHOLE: f64 = 0.25;

/// Largest travel of the surface past a rock in one step, as a share of its spheres' radius.
pub const LARGEST_STRIDE: f64 = 0.5;

/// Fail the window if, in the step of `case`, the surface has passed a rock too fast to be seen, or has been
/// pushed too far past the centres of its outer spheres. Otherwise: whether it lies behind them at all, between
/// two spheres, where the contact is weaker than its law. `passed` says which sphere has been passed by so many
/// radii, and by what.
pub fn watch(
    case: &Case,
    now: &Motion,
    sums: &Sums,
    passed: impl Fn(f64) -> Option<(u32, String)>,
) -> Result<bool, Fault> {
    let rock = case.rock();
    let speed = sums.fastest + surface_speed(rock, now);
    let share = if case.by_faces() { STRIDE_OF_WHOLE } else { LARGEST_STRIDE };
    case.check_stride(now, speed, share, "the surface moves past it")?;
    if sums.penetration <= PASSING {
        return Ok(false);
    }
    if let Some((sphere, what)) = passed(DEEPEST) {
        let whose = match case.by_faces() {
            true => format!("deep below face {sphere} of the rock (radius {:.3e} m", rock.mean_radius()),
            false => format!(
                "past the centre of sphere {sphere} (radius {:.3e} m",
                rock.spheres[sphere as usize].radius
            ),
        };
        let (deep, modulus) = (sums.penetration, case.modulus(", "));
        let what = format!(": {what} has been pushed {whose}, overlap of {deep:.2} radii{modulus})");
        return Err(case.too_deep(now.velocity.norm(), &what, &case.why_too_deep(now, speed)));
    }
    Ok(passed(0.0).is_some())
}

/// Largest speed of a rock's surface past its centre [m/s].
fn surface_speed(rock: &Rock, now: &Motion) -> f64 {
    now.angular_momentum.norm() / rock.inertia.min() * rock.arm
}

/// Fail the window if a rock that touches terrain, or the side of a box, as a whole moves so far in the step of `case`, or is in so deep, that a sphere may no
/// longer find the surface which it came through.
pub fn watch_whole(case: &Case, whole: &Whole, now: &Motion, sums: &Sums) -> Result<(), Fault> {
    let partner = if matches!(case.against, Against::Sides) { "a side of the box" } else { "the terrain" };
    let speed = now.velocity.norm();
    let fastest = speed + surface_speed(case.rock(), now);
    case.check_stride(now, fastest, STRIDE_OF_WHOLE, &format!("it moves past {partner}"))?;
    if sums.penetration <= 1.0 {
        return Ok(());
    }
    let what =
        format!(": it is {:.2} of its radius {:.3e} m deep in {partner}", sums.penetration, whole.radius);
    let key = match case.model.gives_way(case.rock) {
        true => "ground_modulus (or the key of its strength that the scene names)",
        false => "young",
    };
    Err(case.too_deep(
        speed,
        &what,
        &format!("the contact is too soft for this landing: raise contact.{key}"),
    ))
}

/// Fail the window if, in the step of `case`, a rock moves so far past a terrain that is near and that it does not touch at `now` that it
/// might be through it when contacts are found next.
pub fn watch_gap(case: &Case, ground: &Terrain, now: &Motion) -> Result<(), Fault> {
    let (model, rock) = (case.model, case.rock);
    let speed = now.velocity.norm() + surface_speed(case.rock(), now);
    let share = if model.wholes[rock].is_some() { STRIDE_OF_WHOLE } else { LARGEST_STRIDE };
    let stride = speed * case.span.h;
    if stride > share * case.radius() && !ground.is_near(&now.position, model.trees[rock].reach + stride) {
        return Ok(());
    }
    case.check_stride(now, speed, share, "it moves past the terrain")
}
