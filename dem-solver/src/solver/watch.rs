//! Watches on a step: stop where the answer would be wrong and look calm.

use crate::contact::evaluate::{Evaluation, Scene, Sums};
use crate::rock::Motion;
use crate::wall::surface::Surface;
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
/// it lies behind them at all, between two spheres, where the contact is weaker than its law.
pub fn watch(
    evaluation: &Evaluation,
    scene: Scene,
    now: &Motion,
    sums: &Sums,
    h: f64,
    time: f64,
) -> Result<bool, Fault> {
    let it = scene.rock;
    let spin = now.angular_momentum.norm() / it.inertia.min() * it.arm;
    let stride = (sums.fastest + spin) * h;
    if !scene.list.pairs.is_empty() && stride > LARGEST_STRIDE * it.smallest_radius {
        return Err(Fault::window(format!(
            "rock `{}` at {time:.6} s: the surface moves {stride:.3e} m past it in one step of {h:.3e} s, more than \
             half the radius {:.3e} m of its spheres, and might pass through unseen; shorten dem.time_step",
            it.name, it.smallest_radius
        )));
    }
    if sums.penetration <= PASSING {
        return Ok(false);
    }
    if let Some(contact) = evaluation.passed_centre(scene, now, h, DEEPEST) {
        let what = match scene.surface {
            Surface::Ground(ground) => {
                let [x, y, z] = (now.position + ground.origin).into();
                format!("near ({x:.2}, {y:.2}, {z:.2}) the terrain")
            }
            Surface::Wall(_) => {
                format!("wall element {}", scene.list.elements[contact.element as usize].number)
            }
        };
        return Err(Fault::window(format!(
            "rock `{}` at {time:.6} s: {what} has been pushed past the centre of sphere {} (radius {:.3e} m); the \
             contact is too soft: raise contact.young, or cluster.smallest_radius, or shorten dem.time_step",
            it.name, contact.sphere, it.spheres[contact.sphere as usize].radius
        )));
    }
    Ok(evaluation.passed_centre(scene, now, h, 0.0).is_some())
}
