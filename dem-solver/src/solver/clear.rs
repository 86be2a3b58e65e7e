//! For how many steps a rock is certain to meet nothing of the terrain: then it flies in closed form.
//!
//! First the sphere around the whole rock is swept along its parabola; where that sphere comes near, the
//! distance of the rock's spheres bounds the time until any point of them can be there. The answer
//! follows from the state alone, so that equal input gives equal bytes.

use super::Model;
use crate::ground::Ground;
use crate::ground::look::Parabola;
use crate::rock::Motion;
use crate::search::terrain::gap;

/// Farthest that spheres are looked for, as a share of the rock's reach.
const FARTHEST: f64 = 1.0;

/// Share of the reach by which the swept sphere is larger than the rock, for rounding.
const ROUNDING: f64 = 1e-9;

/// Steps of `h` [s], at most `most`, that rock number `rock` flies freely from `now`, touching nothing
/// at their middles and ends.
pub fn clear_steps(model: &Model, ground: &Ground, rock: usize, now: &Motion, h: f64, most: usize) -> usize {
    let it = &model.rocks[rock];
    let gravity = model.settings.gravity;
    let flight = Parabola { position: now.position, velocity: now.velocity, gravity };
    let free = ground.free_steps(&flight, it.reach * (1.0 + ROUNDING), h, most);
    if free > 0 {
        return free;
    }
    let least = gap(it, &model.trees[rock], ground, now, FARTHEST * it.reach) - ROUNDING * it.reach;
    if least <= 0.0 {
        return 0;
    }
    // No point is faster than this, plus what gravity adds.
    let speed = now.velocity.norm() + now.angular_momentum.norm() / it.inertia.min() * it.arm;
    let root = (speed * speed + 2.0 * gravity.norm() * least).sqrt();
    let time = 2.0 * least / (speed + root);
    // A rock at rest without gravity never comes.
    let steps = (time / h).floor();
    if steps < most as f64 { steps as usize } else { most }
}
