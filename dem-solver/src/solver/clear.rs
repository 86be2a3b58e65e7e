//! For how many steps a rock is certain to meet nothing of the terrain: then it flies in closed form.
//!
//! First the sphere around the whole rock is swept along its parabola; where that sphere comes near, the gaps
//! of the rock's spheres, and how fast each closes, bound the time until one can touch. The answer follows from the state alone, so that equal input gives equal bytes.

use super::Model;
use super::state::{Body, State};
use crate::ground::Ground;
use crate::ground::look::Parabola;
use crate::rock::Motion;
use crate::search::terrain::free_time;

/// Farthest that spheres are looked for, as a share of the rock's reach.
const FARTHEST: f64 = 1.0;

/// Steps of a cluster in which no look at its spheres is worth it.
const ENOUGH: usize = 64;

/// Share of the reach by which the swept sphere is larger than the rock, for rounding.
const ROUNDING: f64 = 1e-9;

/// Steps of `h` [s], at most `most`, that rock number `rock` flies freely from `now`, touching nothing
/// at their middles and ends.
pub fn clear_steps(model: &Model, ground: &Ground, rock: usize, now: &Motion, h: f64, most: usize) -> usize {
    let (it, tree) = (&model.rocks[rock], &model.trees[rock]);
    let gravity = model.settings.gravity;
    let flight = Parabola { position: now.position, velocity: now.velocity, gravity };
    let free = ground.free_steps(&flight, tree.reach * (1.0 + ROUNDING), h, most);
    // Of a single sphere this is all; of a cluster it says enough where it does not come near.
    if free >= most.min(ENOUGH) || it.spheres.len() == 1 {
        return free;
    }
    let horizon = h * most as f64;
    let time = free_time(it, tree, ground, now, &gravity, FARTHEST * tree.reach, horizon);
    if time < horizon { free.max((time / h) as usize) } else { most }
}

/// Steps, at most `most`, that all rocks fly freely over the terrain; 0 while one touches.
pub fn clear_of_all(model: &Model, state: &State, h: f64, most: usize) -> usize {
    let Some(ground) = &model.ground else { return 0 };
    if state.bodies.iter().any(|body| body.contacts > 0) {
        return 0;
    }
    let fewer = |clear: usize, (rock, body): (usize, &Body)| match clear {
        0 => 0,
        _ => clear_steps(model, ground, rock, &body.motion, h, clear),
    };
    state.bodies.iter().enumerate().fold(most, fewer)
}
