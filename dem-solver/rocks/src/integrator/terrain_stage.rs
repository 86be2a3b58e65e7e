//! The contacts of rocks with the terrain in a step, for how long they fly freely over it, and the rows of their trajectories.

use crate::guard::cause::Case;
use crate::guard::{watch, watch_gap, watch_whole};
use crate::integrator::sub_stepping::{self, SubSteps};
use crate::model::critical::DEEP;
use crate::model::runout::{HEIGHT_INTERVAL, Passed, is_out};
use crate::model::state::{Against, Body, State};
use crate::model::{Model, Span};
use crate::results::trajectory::Row;
use dem_contact::contact::broad_phase::terrain_pairs::TerrainPairs;
use dem_contact::contact::pipeline::Sums;
use dem_contact::contact::terrain::SurfaceContacts;
use dem_contact::contact::whole_rock::terrain::WholeRockContacts;
use dem_contact::law::Law;
use dem_contact::law::table::SurfaceLaws;
use dem_contact::law::yielding::PlasticIndentation;
use dem_contact::rock::Motion;
use dem_terrain::Terrain;
use dem_terrain::forest::Stands;
use dem_terrain::queries::Parabola;
use interface_defs::Fault;
use interface_defs::verdict::Fate;
use nalgebra::Vector3;
use std::sync::Arc;

/// Rows in the shortest contact.
const ROWS_PER_CONTACT: f64 = 10.0;
/// Rows per row of `history.csv` in a contact that lasts.
const ROWS_PER_INTERVAL: f64 = 5.0;

/// Distance up to which triangles are looked for, as a share of the rock's reach.
const FAR: f64 = 0.5;
/// Share of the reach by which the swept sphere is larger than the rock, for rounding.
const ROUNDING: f64 = 1e-9;

/// The laws of a rock with the terrain.
fn laws_on<'a>(model: &'a Model, ground: &'a Terrain, rock: usize) -> SurfaceLaws<'a> {
    SurfaceLaws { laws: model.surfaces(), row: &model.ground_rows[rock], materials: &ground.zones }
}

/// The laws with the friction that has grown over the distance `slip` [m].
fn grow(laws: &[Law], slip: f64, grown: &mut Vec<Law>) {
    grown.clear();
    grown.extend(laws.iter().map(|law| {
        let mut law = law.clone();
        if let (Some(tangential), Some(growing)) = (&mut law.tangential, &law.growing) {
            tangential.friction = growing.coefficient(tangential.friction, slip);
        }
        law
    }));
}

/// What surrounds the rocks, and the rows of their trajectories.
#[derive(Debug, Clone)]
pub struct TerrainStage {
    ground: Arc<Terrain>,
    /// What is near each rock.
    pub around: Vec<TerrainPairs>,
    standing: Vec<SurfaceContacts>,
    landed: Vec<WholeRockContacts>,
    /// Forests.
    stands: Stands,
    /// The laws with friction as it has grown for the rock at hand.
    grown: Vec<Law>,
    /// Rows of the window under way; none are kept where nobody writes them.
    pub rows: Option<Vec<Row>>,
}

impl TerrainStage {
    /// For the rocks of a model on its `ground`.
    pub fn new(model: &Model, ground: &Arc<Terrain>, rows: bool) -> Self {
        let mut it = Self {
            ground: ground.clone(),
            around: Vec::new(),
            standing: Vec::new(),
            landed: Vec::new(),
            stands: Stands::new(ground, &model.settings.down()),
            grown: Vec::with_capacity(model.surfaces().len()),
            rows: rows.then(Vec::new),
        };
        for (at, (rock, whole)) in model.rocks.iter().zip(&model.wholes).enumerate() {
            let spheres = rock.spheres.len();
            let (deep, standing, landed) = match whole {
                // Ground that gives way lets a rock in until the guard stops it.
                Some(whole) => {
                    let share = if model.gives_way(at) { 1.0 } else { DEEP };
                    (share * whole.radius, SurfaceContacts::default(), spheres)
                }
                None => (0.0, SurfaceContacts::new(4 * spheres + 64), 0),
            };
            it.around.push(TerrainPairs::new(rock, deep));
            it.standing.push(standing);
            it.landed.push(WholeRockContacts::new(landed));
        }
        it
    }

    /// Force of a forest on a rock in the motion `now` [N].
    pub fn forest(&self, model: &Model, now: &Motion) -> Option<Vector3<f64>> {
        if self.stands.are_none() {
            return None;
        }
        self.stands.force(&self.ground, &now.position, &now.velocity, &model.settings.down())
    }

    /// Steps of `h` [s], at most `most`, that all rocks fly freely over the terrain; 0 while one touches.
    pub fn clear_steps(&mut self, model: &Model, state: &State, h: f64, most: usize) -> usize {
        if state.bodies.iter().any(|body| body.contacts > 0) {
            return 0;
        }
        let gravity = model.settings.gravity;
        let mut clear = most;
        for motion in state.bodies.iter().map(|body| &body.motion).filter(|_| !self.stands.are_none()) {
            let flight = Parabola { position: motion.position, velocity: motion.velocity, gravity };
            clear = self.stands.steps_outside(&flight, h, clear);
        }
        for (rock, (body, around)) in state.bodies.iter().zip(&mut self.around).enumerate() {
            if clear > 0 {
                clear = clear_steps(model, &self.ground, around, rock, &body.motion, h, clear);
            }
        }
        clear
    }

    /// Times that pairs were searched, and that triangles were looked for.
    pub fn searches(&self) -> [u64; 2] {
        let sum = |of: fn(&TerrainPairs) -> u64| self.around.iter().map(of).sum();
        [sum(|a| a.searches), sum(|a| a.refreshes)]
    }

    /// The steps that the rock takes next together, of at most `most` steps of `h` [s]: several at once, and cut as its
    /// contact asks for, where the scene leaves that open and one rock alone touches.
    pub fn sub_steps(&mut self, model: &Model, bodies: &[Body], h: f64, most: usize) -> SubSteps {
        let ([body], ground) = (bodies, &self.ground) else { return SubSteps::ONE };
        if body.contacts == 0 || model.settings.dem.time_step.is_some() {
            return SubSteps::ONE;
        }
        let near = (&mut self.around[0], &mut self.landed[0]);
        sub_stepping::next(model, ground, laws_on(model, ground, 0), near, body, h, most)
    }

    /// Forces on rock number `rock` at `now`, in the middle of a step. The histories after the step are `body`'s.
    pub fn forces(
        &mut self,
        model: &Model,
        rock: usize,
        body: &mut Body,
        now: &Motion,
        span @ Span { start: time, h }: Span,
    ) -> Result<Sums, Fault> {
        let (ground, it) = (&*self.ground, &model.rocks[rock]);
        let mut laws = laws_on(model, ground, rock);
        let (around, standing) = (&mut self.around[rock], &mut self.standing[rock]);
        around.update(it, &model.trees[rock], ground, now, h, 0.0);
        let speed = now.velocity.norm();
        let grows = !around.pairs.is_empty() && laws.any(|law| law.growing.is_some());
        if grows {
            grow(laws.laws, body.slip.at(time) + 0.5 * h * speed, &mut self.grown);
            laws.laws = &self.grown;
        }
        let slide = |body: &mut Body, first: Option<u32>| {
            let touched = first.filter(|_| grows).and_then(|triangle| laws.of(triangle).growing);
            if let Some(growing) = touched {
                body.slip.touch(time, h, speed, growing.relaxation);
            }
        };
        let case = Case::new(model, rock, Against::Terrain, span);
        if around.pairs.is_empty() {
            watch_gap(&case, ground, now)?;
            body.terrain_histories.clear();
            body.dent = PlasticIndentation::default();
            return Ok(Sums::default());
        }
        if let Some(whole) = &model.wholes[rock] {
            let landed = &mut self.landed[rock];
            landed.find(it, whole, ground, around, now, 0.0);
            let memory = (&body.terrain_histories[..], &mut body.dent);
            let sums = landed.forces(it, whole, laws, now, h, memory);
            watch_whole(&case, whole, now, &sums)?;
            std::mem::swap(&mut body.terrain_histories, &mut landed.histories);
            slide(body, landed.contacts.first().map(|c| c.element));
            return Ok(sums);
        }
        standing.find(it, ground, around, now);
        let sums = standing.forces(it, laws, Some(ground), now, h, &body.terrain_histories);
        watch(&case, now, &sums, |depth| {
            let sphere = standing.passed_centre(it, now, h, depth)?;
            let [x, y, z] = (now.position + ground.origin).into();
            Some((sphere, format!("near ({x:.2}, {y:.2}, {z:.2}) the terrain")))
        })?;
        std::mem::swap(&mut body.terrain_histories, &mut standing.histories);
        slide(body, standing.contacts.first().map(|c| c.element));
        Ok(sums)
    }

    /// Elastic energy [J] and number of contacts of rock number `rock`, whose state is `body`.
    pub fn energy(&mut self, model: &Model, rock: usize, body: &Body) -> (f64, usize) {
        let (ground, it, now) = (&*self.ground, &model.rocks[rock], &body.motion);
        let laws = laws_on(model, ground, rock);
        let (around, standing) = (&mut self.around[rock], &mut self.standing[rock]);
        around.update(it, &model.trees[rock], ground, now, model.steps.step, 0.0);
        if let Some(whole) = &model.wholes[rock] {
            let landed = &mut self.landed[rock];
            landed.find(it, whole, ground, around, now, 0.0);
            return (landed.energy(whole, laws, &body.dent), landed.contacts.len());
        }
        standing.find(it, ground, around, now);
        (standing.energy(laws), standing.contacts.len())
    }

    /// A window begins.
    pub fn begin(&mut self) {
        if let Some(rows) = &mut self.rows {
            rows.clear();
        }
    }

    /// Follow a rock's trajectory over a step from the motion `before` to that in `body`.
    pub fn stepped(&mut self, model: &Model, rock: usize, before: &Motion, body: &mut Body, passed: Passed) {
        let Passed { end, h, touching, look } = passed;
        let touched = body.path.contact_since.is_some();
        let outside = is_out(&self.ground, &model.settings.down(), &body.motion.position);
        let had_left = body.path.has_left();
        if touching && !touched && !outside {
            body.path.look(model, rock, before, end - h);
        }
        body.path.step(model, rock, &body.motion, passed, outside);
        if look && !touching && !outside {
            body.path.look(model, rock, &body.motion, end);
        }
        let Some(rows) = self.rows.as_mut().filter(|_| rock < model.settings.named()) else { return };
        let shortest = model.steps.contact;
        let most = model.settings.interval / ROWS_PER_INTERVAL;
        let every = match body.path.contact_since {
            Some(since) if end - since <= 2.0 * shortest => most.min(shortest / ROWS_PER_CONTACT),
            _ => most,
        };
        // Half a step less: a row is due at the step that is nearest.
        let due = touching && end - body.path.row >= every - 0.5 * h;
        if (touching != touched || due || body.path.has_left()) && !had_left {
            body.path.row = end;
            rows.push(Row::of(model, rock, body, end, touching));
        }
    }

    /// Follow a rock's trajectory to the instant `end` [s] of a flight. `look`: whether its height is due.
    pub fn flew(&mut self, model: &Model, rock: usize, body: &mut Body, end: f64, look: bool) {
        let outside = is_out(&self.ground, &model.settings.down(), &body.motion.position);
        body.path.flew(&model.rocks[rock], &body.motion, end, outside);
        if look && !outside {
            body.path.look(model, rock, &body.motion, end);
        }
    }

    /// A window ends at `state.time`: has a trajectory ended with it?
    pub fn end(&mut self, model: &Model, state: &mut State) {
        for (number, body) in state.bodies.iter_mut().enumerate() {
            let had_left = body.path.has_left();
            body.path.judge(model, &self.ground, number, &body.motion, state.time);
            // The last row of a rock that has left is that at the border.
            let exit = body.path.ending.filter(|end| end.how == Fate::LeftTerrain);
            let time = exit.map_or(state.time, |end| end.time);
            if let Some(rows) = &mut self.rows
                && number < model.settings.named()
                && body.path.row < time
                && !had_left
            {
                body.path.row = time;
                let now = body.motion;
                body.motion = exit.map_or(now, |end| end.motion(&now));
                rows.push(Row::of(model, number, body, time, exit.is_none() && body.contacts > 0));
                body.motion = now;
            }
        }
    }
}

/// Steps of `h` [s] between two looks at the height of a flying rock.
pub fn steps_per_look(h: f64) -> usize {
    (HEIGHT_INTERVAL / h).round().max(1.0) as usize
}

/// Steps of `h` [s], at most `most`, that rock number `rock` flies freely from `now`, touching nothing
/// at their middles and ends.
///
/// First the triangles around it are asked when it may touch them; where there are none, the sphere around the whole
/// rock is swept along its parabola. The answer follows from the state alone, so that equal input gives equal bytes.
fn clear_steps(
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
