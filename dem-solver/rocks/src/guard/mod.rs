//! Guards of a step: stop where the answer would be wrong and look calm; [`cause`] says why it came to that.

pub mod cause;

use crate::model::Model;
use crate::model::state::Against;
use cause::Case;
use dem_contact::contact::pipeline::Sums;
use dem_contact::contact::whole_rock::Whole;
use dem_contact::rock::Motion;
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
    let (rock, h, time) = (case.rock(), case.h, case.time);
    let spin = now.angular_momentum.norm() / rock.inertia.min() * rock.arm;
    let speed = sums.fastest + spin;
    let stride = speed * h;
    if stride > LARGEST_STRIDE * rock.smallest_radius {
        return Err(Fault::window(format!(
            "rock `{}` at {time:.6} s: the surface moves {stride:.3e} m past it in one step of {h:.3e} s, more than \
             half the radius {:.3e} m of its spheres, and might pass through unseen; {}",
            rock.name,
            rock.smallest_radius,
            case.too_far(now, speed, LARGEST_STRIDE)
        )));
    }
    if sums.penetration <= PASSING {
        return Ok(false);
    }
    if let Some((sphere, what)) = passed(DEEPEST) {
        return Err(Fault::window(format!(
            "rock `{}` at {time:.6} s, at {:.4} m/s: {what} has been pushed past the centre of sphere {sphere} (radius \
             {:.3e} m, overlap of {:.2} radii{}); {}",
            rock.name,
            now.velocity.norm(),
            rock.spheres[sphere as usize].radius,
            sums.penetration,
            case.young().map_or(String::new(), |e| format!(", E = {e:.3e} Pa")),
            case.too_deep(now, speed)
        )));
    }
    Ok(passed(0.0).is_some())
}

/// Fail the window if a rock that touches as a whole moves so far in the step of `h` [s] that began at `time` [s], or is in so deep,
/// that a sphere may no longer find the surface which it came through.
pub fn watch_whole(
    model: &Model,
    rock: usize,
    whole: &Whole,
    now: &Motion,
    sums: &Sums,
    h: f64,
    time: f64,
) -> Result<(), Fault> {
    let it = &model.rocks[rock];
    let speed = now.velocity.norm() + now.angular_momentum.norm() / it.inertia.min() * it.arm;
    let case = Case { model, rock, against: Against::Terrain, law: None, pair: None, impact: None, h, time };
    if speed * h > STRIDE_OF_WHOLE * whole.radius {
        return Err(Fault::window(format!(
            "rock `{}` at {time:.6} s: it moves {:.3e} m past the terrain in one step of {h:.3e} s, more than {STRIDE_OF_WHOLE} \
             of its radius {:.3e} m, and might pass through unseen; {}",
            it.name,
            speed * h,
            whole.radius,
            case.too_far(now, speed, STRIDE_OF_WHOLE)
        )));
    }
    if sums.penetration > 1.0 {
        return Err(Fault::window(format!(
            "rock `{}` at {time:.6} s, at {:.4} m/s: it is {:.2} of its radius {:.3e} m deep in the terrain; the contact is too \
             soft for this landing: raise contact.{}",
            it.name,
            now.velocity.norm(),
            sums.penetration,
            whole.radius,
            if model.gives_way(rock) {
                "ground_modulus (or the key of its strength that the scene names)"
            } else {
                "young"
            }
        )));
    }
    Ok(())
}

/// Fail the window if, in the step of `h` [s] that began at `time` [s], rock number `rock` moves so far past a terrain that is
/// near and that it does not touch at `now` that it might be through it when contacts are found next.
pub fn watch_gap(
    model: &Model,
    ground: &Terrain,
    rock: usize,
    now: &Motion,
    h: f64,
    time: f64,
) -> Result<(), Fault> {
    let it = &model.rocks[rock];
    let spin = now.angular_momentum.norm() / it.inertia.min() * it.arm;
    let speed = now.velocity.norm() + spin;
    let stride = speed * h;
    let (share, radius) = match &model.wholes[rock] {
        Some(whole) => (STRIDE_OF_WHOLE, whole.radius),
        None => (LARGEST_STRIDE, it.smallest_radius),
    };
    if stride <= share * radius {
        return Ok(());
    }
    if !ground.is_near(&now.position, model.trees[rock].reach + stride) {
        return Ok(());
    }
    let case = Case { model, rock, against: Against::Terrain, law: None, pair: None, impact: None, h, time };
    Err(Fault::window(format!(
        "rock `{}` at {time:.6} s: it moves {stride:.3e} m past the terrain in one step of {h:.3e} s, more than {share} times \
         the radius {radius:.3e} m of what touches, and might pass through unseen; {}",
        it.name,
        case.too_far(now, speed, share)
    )))
}
