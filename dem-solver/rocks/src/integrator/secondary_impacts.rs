//! How far another rock, the terrain or a box may throw a rock off its flight within a window: what a flight alone does not
//! reach of the mesh may then be reached all the same.

use crate::integrator::box_stage::is_near;
use crate::integrator::rock_stage::RockStage;
use crate::model::Model;
use crate::model::state::{Body, State};
use dem_terrain::Terrain;

/// Bounds for all rocks, by their numbers; buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct SecondaryImpacts {
    /// Furthest that any point of the rock may get off its flight [m]; 0 where nothing is near enough.
    pub displacements: Vec<f64>,
    earlier: Vec<f64>,
}

impl SecondaryImpacts {
    /// For a window of `length` [s] that begins with `state`; it follows from these alone.
    ///
    /// A kick reverses the speed v of two rocks' surfaces past each other at most: an impulse of `2 m* v`, with
    /// `1/m* = 1/M_1 + 1/M_2`, whose lever makes spin of it as well. What stands still adds no energy. Who is kicked may come upon
    /// others: pairs are asked again until no more are near. That a second kick may be harder for the first is left out.
    pub fn find(&mut self, model: &Model, rock_stage: &RockStage, state: &State, length: f64) {
        let (displacements, earlier) = (&mut self.displacements, &mut self.earlier);
        for buffer in [&mut *displacements, &mut *earlier] {
            buffer.clear();
            buffer.resize(model.rocks.len(), 0.0);
        }
        let stands = model.ground.is_some() || !model.planes.is_empty();
        if rock_stage.is_empty() && !stands {
            return;
        }
        // Speed of a rock's surface past its centre, and displacement of its surface by an impulse of 1 N s.
        let surface = |r: usize| {
            let (rock, motion) = (&model.rocks[r], &state.bodies[r].motion);
            motion.angular_momentum.norm() / rock.inertia.min() * rock.reach
        };
        let yields = |r: usize| {
            let rock = &model.rocks[r];
            length * (1.0 / rock.mass + rock.reach * rock.reach / rock.inertia.min())
        };
        let pull = model.settings.gravity.norm() * length;
        // Ground and sides stand still: what they give a rock is what it has, in another direction, or as spin for velocity.
        let thrown_back = |r: usize, thrown: f64| {
            let (rock, body) = (&model.rocks[r], &state.bodies[r]);
            let energy = rock.kinetic_energy(&body.motion) + body.elastic.max(0.0);
            let more = pull + thrown / length;
            let speed = (2.0 * energy / rock.mass).sqrt() + more;
            let turn = ((2.0 * energy / rock.inertia.min()).sqrt() + more / rock.reach) * length;
            // However far it turns, a point of the rock stays within its reach.
            2.0 * speed * length + turn.min(2.0) * rock.reach
        };
        let mut near = 0;
        for _ in 0..=model.rocks.len() {
            earlier.copy_from_slice(displacements);
            displacements.fill(0.0);
            let mut now = 0;
            for [a, b] in rock_stage.pairs() {
                let [first, second] = [a, b].map(|r| &state.bodies[r].motion);
                let past = (second.velocity - first.velocity).norm();
                let reach = model.trees[a].reach + model.trees[b].reach + earlier[a] + earlier[b];
                if (second.position - first.position).norm() > reach + past * length {
                    continue;
                }
                now += 1;
                let mass = 1.0 / (1.0 / model.rocks[a].mass + 1.0 / model.rocks[b].mass);
                let impulse = 2.0 * mass * (past + surface(a) + surface(b));
                displacements[a] += impulse * yields(a);
                displacements[b] += impulse * yields(b);
            }
            for (r, displacement) in displacements.iter_mut().enumerate().filter(|_| stands) {
                let motion = &state.bodies[r].motion;
                let speed = motion.velocity.norm() + pull;
                let reach = model.trees[r].reach + speed * length + earlier[r];
                let on_terrain = || model.ground.as_ref().is_some_and(|g| g.is_near(&motion.position, reach));
                if on_terrain() || is_near(model, r, motion, reach - model.trees[r].reach) {
                    now += 1;
                    *displacement += thrown_back(r, *displacement);
                }
            }
            if now == near {
                break;
            }
            near = now;
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::DemSolver;
    use interface_defs::{Plan, Solver, Window};
    use toolkit::program::Options;
    use toolkit::scene::Scene;

    const LIGHT: &str =
        "[[rock]]\nname = \"light\"\nmass = 1.0\nshape = { type = \"box\", size = [0.2, 0.3, 0.25] }\n";
    const HEAVY: &str =
        "[[rock]]\nname = \"heavy\"\nmass = 1e4\nshape = { type = \"sphere\", radius = 1.0 }\n";
    const THIRD: &str =
        "[[rock]]\nname = \"third\"\nmass = 0.1\nshape = { type = \"sphere\", radius = 0.1 }\n";

    /// Furthest that each rock gets off its flight in a window of 20 ms, and the bound.
    fn thrown(rocks: &str) -> Vec<(f64, f64)> {
        let text = format!(
            "end_time = 1.0\n{rocks}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e9\npoisson = 0.2\nrestitution = 1.0\n\
             friction = 0.8\n"
        );
        let scene = Scene::from_text("test.toml", &text).expect("a scene");
        let options = Options { out: None, shortcuts: true };
        let mut solver = DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
        let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        let mut output = ready.initial;
        let (length, start) = (0.02, solver.state().clone());
        let mut secondary_impacts = SecondaryImpacts::default();
        secondary_impacts.find(solver.model(), &RockStage::new(solver.model()), &start, length);
        let window = Window { number: 1, iteration: 1, start: 0.0, length };
        solver.solve(&window, &[], &mut output).unwrap_or_else(|f| panic!("{f}"));
        solver.commit().expect("committed");
        let bodies = solver.state().bodies.iter().zip(&start.bodies).zip(&secondary_impacts.displacements);
        let off = |((after, before), displacement): (
            (&crate::model::state::Body, &crate::model::state::Body),
            &f64,
        )| {
            let flight = before.motion.position + before.motion.velocity * length;
            ((after.motion.position - flight).norm(), *displacement)
        };
        bodies.map(off).collect()
    }

    fn at(rock: &str, x: f64, velocity: f64) -> String {
        let z = if x == 0.0 { 0.05 } else { 0.0 };
        format!("{rock}position = [{x:?}, 0.0, {z:?}]\nvelocity = [{velocity:?}, 0.0, 0.0]\n")
    }

    #[test]
    fn a_light_rock_that_a_heavy_one_throws_stays_within_the_bound_and_so_does_the_next() {
        // The heavy one at 50 m/s comes from 0.3 m behind; the third waits beyond the light one's reach.
        let rocks = at(LIGHT, 0.0, 0.0) + &at(HEAVY, -1.4, 50.0) + &at(THIRD, 0.5, 0.0);
        let seen = thrown(&rocks);
        println!("off the flight and bound [m]: {seen:?}");
        assert!(seen[0].0 > 0.5 && seen[2].0 > 0.3, "both are thrown: {seen:?}");
        assert!(seen.iter().all(|(off, displacement)| off <= displacement), "{seen:?}");
        // No more than a few times what happens.
        assert!(seen[0].1 < 20.0 * seen[0].0, "{seen:?}");
    }

    #[test]
    fn what_spins_on_the_floor_stays_within_the_bound() {
        // Its edges pass the floor at 40 m/s, so that the floor throws it along; then one that falls fast and bounces.
        for (height, down, spin) in [(0.13, -1.0, 200.0), (0.4, -30.0, 0.0), (0.3, -10.0, 60.0)] {
            let rocks = LIGHT.to_owned()
                + &format!(
                    "position = [0.0, 0.0, {height:?}]\nvelocity = [0.0, 0.0, {down:?}]\nangular_velocity = [0.0, {spin:?}, 0.0]\n"
                )
                + "[box]\nlowest = [-9.0, -9.0, 0.0]\nhighest = [9.0, 9.0, 9.0]\n";
            let seen = thrown(&rocks);
            println!("off the flight and bound [m]: {seen:?}");
            assert!(seen[0].0 > 0.05 && seen[0].0 <= seen[0].1, "{seen:?}");
            assert!(seen[0].1 < 20.0 * seen[0].0, "{seen:?}");
        }
    }

    #[test]
    fn rocks_that_cannot_meet_in_the_window_have_no_bound() {
        let rocks = at(LIGHT, 0.0, 0.0) + &at(HEAVY, -4.0, 50.0);
        assert_eq!(thrown(&rocks), [(0.0, 0.0), (0.0, 0.0)]);
    }
}
