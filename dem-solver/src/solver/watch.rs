//! Watches on a step: stop where the answer would be wrong and look calm.

use super::Model;
use crate::contact::evaluate::Sums;
use crate::ground::Ground;
use crate::rock::{Motion, Rock};
use interface_defs::Fault;

/// Overlap over radius from which on it is looked whether the wall is behind a centre: two spheres
/// 1.25 radii apart cover the line between their centres with 0.375 each.
const PASSING: f64 = 0.2;

/// How far the wall may lie behind the centres of the outer spheres, in radii. At a rim a loaded wire
/// rests in the gap between two spheres, up to the line of their centres and a little beyond (21 952
/// spheres in the drop test): that is told as a warning. This much further no layer holds it.
const DEEPEST: f64 = 0.5;

/// Largest way of the wall past a rock in one step, as a share of its spheres' radius.
const LARGEST_STRIDE: f64 = 0.5;

/// Fail the window if, in the step of `h` [s] that began at `time` [s], the wall has passed a rock too
/// fast to be met, or has been pushed too far past the centres of its outer spheres. Otherwise: whether
/// it lies behind them at all, between two spheres, where the contact is weaker than its law. `passed` says which
/// sphere has been passed by so many radii, and by what.
pub fn watch(
    rock: &Rock,
    now: &Motion,
    sums: &Sums,
    h: f64,
    time: f64,
    passed: impl Fn(f64) -> Option<(u32, String)>,
) -> Result<bool, Fault> {
    let spin = now.angular_momentum.norm() / rock.inertia.min() * rock.arm;
    let stride = (sums.fastest + spin) * h;
    if stride > LARGEST_STRIDE * rock.smallest_radius {
        return Err(Fault::window(format!(
            "rock `{}` at {time:.6} s: the surface moves {stride:.3e} m past it in one step of {h:.3e} s, more than \
             half the radius {:.3e} m of its spheres, and might pass through unseen; shorten dem.time_step",
            rock.name, rock.smallest_radius
        )));
    }
    if sums.penetration <= PASSING {
        return Ok(false);
    }
    if let Some((sphere, what)) = passed(DEEPEST) {
        return Err(Fault::window(format!(
            "rock `{}` at {time:.6} s: {what} has been pushed past the centre of sphere {sphere} (radius {:.3e} m); the \
             contact is too soft: raise contact.young, or cluster.smallest_radius, or shorten dem.time_step",
            rock.name, rock.spheres[sphere as usize].radius
        )));
    }
    Ok(passed(0.0).is_some())
}

/// Fail the window if, in the step of `h` [s] that began at `time` [s], rock number `rock` moves so far past a terrain that is
/// near and that it does not touch at `now` that it might be through it the next time anybody looks.
pub fn watch_gap(
    model: &Model,
    ground: &Ground,
    rock: usize,
    now: &Motion,
    h: f64,
    time: f64,
) -> Result<(), Fault> {
    let it = &model.rocks[rock];
    let spin = now.angular_momentum.norm() / it.inertia.min() * it.arm;
    let stride = (now.velocity.norm() + spin) * h;
    if stride <= LARGEST_STRIDE * it.smallest_radius {
        return Ok(());
    }
    if !ground.is_near(&now.position, model.trees[rock].reach + stride) {
        return Ok(());
    }
    Err(Fault::window(format!(
        "rock `{}` at {time:.6} s: it moves {stride:.3e} m past the terrain in one step of {h:.3e} s, more than half the \
         radius {:.3e} m of its spheres, and might pass through unseen; shorten dem.time_step",
        it.name, it.smallest_radius
    )))
}
