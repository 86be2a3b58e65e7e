//! For how many steps a rock is certain to touch nothing of the terrain: then it flies in closed form.
//!
//! First the triangles around it are asked when it may touch them; where there are none, the sphere around the whole
//! rock is swept along its parabola. The answer follows from the state alone, so that equal input gives equal bytes.

use crate::model::Model;
use crate::model::state::Body;
use dem_contact::contact::broad_phase::terrain_pairs::TerrainPairs;
use dem_contact::rock::Motion;
use dem_terrain::Terrain;
use dem_terrain::queries::Parabola;

/// How far triangles are looked for, as a share of the rock's reach.
const FAR: f64 = 0.5;

/// Share of the reach by which the swept sphere is larger than the rock, for rounding.
const ROUNDING: f64 = 1e-9;

/// Steps of `h` [s], at most `most`, that rock number `rock` flies freely from `now`, touching nothing
/// at their middles and ends.
pub(super) fn clear_steps(
    model: &Model,
    ground: &Terrain,
    around: &mut TerrainPairs,
    rock: usize,
    now: &Motion,
    h: f64,
    most: usize,
) -> usize {
    let (it, tree) = (&model.rocks[rock], &model.trees[rock]);
    let gravity = model.settings.gravity;
    let horizon = h * most as f64;
    let (time, far) = around.free_time(it, tree, ground, (now, &gravity), [FAR * tree.reach, horizon]);
    if time >= horizon {
        return most;
    }
    let near = (time / h) as usize;
    if !far {
        return near;
    }
    let flight = Parabola { position: now.position, velocity: now.velocity, gravity };
    near.max(ground.free_steps(&flight, tree.reach * (1.0 + ROUNDING), h, most))
}

/// How far a forest may take a rock off its flight within `length` [s] [m].
pub(super) fn bend(model: &Model, body: &Body, length: f64) -> f64 {
    let drag = model.ground.as_deref().map_or(0.0, Terrain::largest_forest_drag);
    if drag == 0.0 {
        return 0.0;
    }
    let lightest = model.rocks.iter().map(|rock| rock.mass).fold(f64::INFINITY, f64::min);
    let fastest = body.motion.velocity.norm() + model.settings.gravity.norm() * length;
    0.5 * drag / lightest * fastest * length * length
}
