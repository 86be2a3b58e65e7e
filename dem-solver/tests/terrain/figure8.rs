//! V-T6 without anybody's data: the scenes of Figure 7 as they are shipped. What Figure 8 shows of them is that two
//! shapes that begin at one place go down one slope in bounces, and not on one way.

use dem_solver::DemSolver;
use interface_defs::verdict::Fate;
use interface_defs::{Plan, Solver, Window};
use nalgebra::Vector3;
use std::path::Path;
use toolkit::program::Options;
use toolkit::scene::Scene;

const WINDOW: f64 = 0.05;

struct Way {
    /// Each 0.05 s [m].
    places: Vec<Vector3<f64>>,
    impacts: u64,
    ending: Option<Fate>,
    highest: f64,
}

fn run(name: &str) -> Way {
    let file = format!("{}/../launch/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let scene = Scene::load(Path::new(&file), &[]).unwrap_or_else(|e| panic!("{e}"));
    let mut solver =
        DemSolver::new(&scene, &Options { out: None, shortcuts: true }).unwrap_or_else(|e| panic!("{e}"));
    let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
    let mut output = ready.initial;
    let start = solver.state().bodies[0].motion;
    assert_eq!(start.velocity, -10.0 * Vector3::z());
    let mut places = vec![start.position];
    for number in 1..=1200 {
        let window = Window { number, iteration: 1, start: (number - 1) as f64 * WINDOW, length: WINDOW };
        solver.solve(&window, &[], &mut output).unwrap_or_else(|e| panic!("{e}"));
        solver.commit().expect("committed");
        places.push(solver.state().bodies[0].motion.position);
        if solver.has_ended() {
            break;
        }
    }
    let path = &solver.state().bodies[0].path;
    Way { places, impacts: path.impacts, ending: path.ending.map(|end| end.how), highest: path.highest.0 }
}

#[test]
fn two_shapes_dropped_at_one_place_bounce_down_one_slope_on_ways_of_their_own() {
    let ways = ["slope-cube", "slope-edge"].map(run);
    for way in &ways {
        let (first, last) = (way.places[0], way.places[way.places.len() - 1]);
        println!(
            "{} impacts, {:.1} m down, jumps of {:.2} m, {:?}",
            way.impacts,
            first.z - last.z,
            way.highest,
            way.ending
        );
        // Higher than the rock is wide: it flies, and does not only roll.
        assert!(way.ending.is_some() && way.impacts > 5 && way.highest > 1.0);
        assert!(first.z - last.z > 10.0 && last.x - first.x > 10.0);
    }
    let [cube, edge] = &ways;
    // One place but for what a turned rock needs more of height.
    assert!((cube.places[0] - edge.places[0]).norm() < 1.0);
    let apart = cube.places.iter().zip(&edge.places).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart > 5.0, "{apart}");
}
