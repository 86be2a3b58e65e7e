//! What the number of spheres of a rock, and the law of its contact, mean for falls down a hillside.
//!
//! `cargo run --release -p dem-solver --example hillside [foot | meadow [RELEASES [LAW [COUNT ...]]]]` (default foot, 200,
//! hertz_rock, 64 300 1000 4000; some minutes)
//!
//! A norm rock of 0.5 m3 on a rough slope of 35 degrees; E 3e10 Pa, restitution 0.3, friction 0.6. `foot`: 220 m down to the foot, where
//! the terrain ends. `meadow`: 50 m, and to rest on a meadow. Each release has a place, a turn and a speed of its own, the same for each
//! count. With CLUSTERS=DIR clusters that have been made before are read, DIR/norm_rock_111N.xyzr.

mod statistics;

use dem_solver::DemSolver;
use dem_solver::random::SplitMix;
use dem_solver::rock::Motion;
use dem_solver::terrain::raster::Raster;
use interface_defs::verdict::Fate;
use interface_defs::{Plan, Solver, Window};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use statistics::{distance, quantile, with_error};
use std::path::Path;
use std::time::Instant;
use toolkit::program::Options;
use toolkit::scene::Scene;

#[path = "../tests/support/slope.rs"]
mod slope;
use slope::Slope;

const WINDOW: f64 = 0.05;
const END: f64 = 40.0;

fn scene(law: &str, spheres: usize) -> String {
    // Clusters that have been made before are read.
    let made = std::env::var("CLUSTERS").map(|dir| format!("file = \"{dir}/norm_rock_111{spheres}.xyzr\""));
    let cluster = made.unwrap_or_else(|_| format!("spheres = {spheres}"));
    format!(
        "end_time = {END:?}\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [40.0, 100.0, 200.0]\ndensity = 2600.0\n\
         shape = {{ type = \"norm_rock\", form = \"111\", volume = 0.5 }}\ncluster = {{ {cluster} }}\n\
         [terrain]\nfile = \"slope.asc\"\n[[contact]]\nlaw = \"{law}\"\nyoung = 3e10\npoisson = 0.25\n\
         restitution = 0.3\nfriction = 0.6\n"
    )
}

/// A fall; numbers in the order of [`NAMES`].
struct Fall {
    numbers: [f64; 9],
    rests: bool,
    imbalance: f64,
}

const NAMES: [&str; 9] = [
    "run-out [m]",
    "to the side [m]",
    "time [s]",
    "mean contact [ms]",
    "largest jump [m]",
    "largest speed [m/s]",
    "largest spin [rad/s]",
    "largest overlap",
    "impacts",
];

/// Release number `k`; `Err`: it has been stopped.
fn fall(solver: &mut DemSolver, output: &mut [f64], k: usize) -> Result<Fall, String> {
    let part = |f: f64| (k as f64 * f).fract();
    let model = solver.model();
    let ground = model.ground.as_ref().expect("a terrain");
    let at = Vector3::new(6.0, 70.0 + 60.0 * part(0.618_034), 0.0);
    let above = Vector3::new(at.x, at.y, ground.highest.z + ground.origin.z + 1.0) - ground.origin;
    let z = above.z - ground.height(&above, &-Vector3::z()).expect("on the slope") + ground.origin.z;
    let turn = Quaternion::new(1.0, part(0.414_214) - 0.5, part(0.732_051) - 0.5, part(0.236_068) - 0.5);
    let start = Motion {
        position: Vector3::new(at.x, at.y, z + 2.0),
        velocity: Vector3::new(2.0 + 4.0 * part(0.302_776), 0.0, -2.0),
        orientation: UnitQuaternion::from_quaternion(turn),
        angular_momentum: Vector3::zeros(),
        acceleration: model.settings.gravity,
        torque: Vector3::zeros(),
    };
    solver.release(0, start);
    let from = solver.state().bodies[0].motion.position;
    let (mut number, mut first) = (0_u32, None);
    let (mut imbalance, mut fastest, mut spin) = (0.0_f64, 0.0_f64, 0.0_f64);
    while !solver.has_ended() && WINDOW * f64::from(number) < END {
        let start = WINDOW * f64::from(number);
        let window = Window { number: u64::from(number) + 1, iteration: 1, start, length: WINDOW };
        solver.solve(&window, &[], output).map_err(|f| f.to_string())?;
        solver.commit().expect("committed");
        number += 1;
        let (state, rock) = (solver.state(), &solver.model().rocks[0]);
        let body = &state.bodies[0];
        let kinetic = rock.kinetic_energy(&body.motion);
        let height = body.motion.position.dot(&solver.model().settings.gravity) * rock.mass;
        let energy = kinetic - height + body.elastic + body.tangential_energy + state.dissipated;
        fastest = fastest.max(kinetic);
        spin = spin.max(rock.spin(&body.motion).norm());
        imbalance = imbalance.max((energy - *first.get_or_insert(energy)).abs());
    }
    let body = &solver.state().bodies[0];
    let path = &body.path;
    let overlap = body.deepest.largest().map_or(0.0, |(overlap, _)| overlap);
    let end = path.ending.map_or(body.motion.position, |end| end.position);
    let travel = end - from;
    Ok(Fall {
        numbers: [
            travel.xy().norm(),
            travel.y,
            path.ending.map_or(END, |end| end.time),
            1e3 * path.in_contact / path.impacts.max(1) as f64,
            path.highest.0,
            path.fastest.0,
            spin,
            overlap,
            path.impacts as f64,
        ],
        rests: path.ending.is_some_and(|end| end.how == Fate::AtRest),
        imbalance: imbalance / fastest,
    })
}

/// All releases; how many were stopped, why the first one was, and how long one took [s].
fn falls(dir: &Path, law: &str, spheres: usize, releases: usize) -> (Vec<Fall>, usize, Option<String>, f64) {
    let name = dir.join("s.toml").display().to_string();
    let scene = Scene::from_text(&name, &scene(law, spheres)).expect("a scene");
    let options = Options { out: None, shortcuts: true };
    let mut solver = DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
    let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
    let mut output = ready.initial;
    let begun = Instant::now();
    let (mut done, mut stopped, mut why) = (Vec::new(), 0, None);
    for k in 0..releases {
        match fall(&mut solver, &mut output, k) {
            Ok(fall) => done.push(fall),
            Err(what) => {
                stopped += 1;
                why.get_or_insert(what);
            }
        }
    }
    (done, stopped, why, begun.elapsed().as_secs_f64() / releases as f64)
}

/// 35 degrees over `slope` metres along x, then flat up to `end`.
fn hillside(slope: f64, end: f64) -> Raster {
    let across = 2 * (end / 0.5) as usize + 1;
    let along = (end / 0.5) as usize + 1;
    let rough = Slope {
        corner: [0.0, 0.0],
        spacing: 0.5,
        counts: [along, across.min(401)],
        drop: 0.0,
        foot: 0.0,
        benches: 0,
        roughness: 0.08,
        seed: 5,
    };
    let mut raster = rough.raster();
    for (at, height) in raster.heights.iter_mut().enumerate() {
        *height += (slope - 0.5 * (at % along) as f64).max(0.0) * 35_f64.to_radians().tan();
    }
    raster
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let [slope, end] = match arguments.next().as_deref() {
        None | Some("foot") => [180.0, 181.0],
        Some("meadow") => [41.0, 400.0],
        Some(other) => panic!("`{other}` is neither foot nor meadow"),
    };
    let releases = arguments.next().map_or(200, |a| a.parse().expect("a number of releases"));
    let law = arguments.next().unwrap_or_else(|| "hertz_rock".into());
    let mut counts: Vec<usize> = arguments.map(|a| a.parse().expect("a number of spheres")).collect();
    if counts.is_empty() {
        counts = vec![64, 300, 1000, 4000];
    }
    let dir = tempfile::tempdir().expect("a directory");
    hillside(slope, end).write_asc(&dir.path().join("slope.asc")).expect("written");
    println!("{law}, {releases} releases: median (values one standard error of its rank away), 90 %");
    let mut before: Option<Vec<Fall>> = None;
    for spheres in counts {
        let (done, stopped, why, cost) = falls(dir.path(), &law, spheres, releases);
        println!("{spheres} spheres: {stopped} stopped, {:.1} ms each", 1e3 * cost);
        if let Some(why) = why {
            println!("  the first: {why}");
        }
        if done.is_empty() {
            continue;
        }
        let rests = done.iter().filter(|f| f.rests).count();
        let lost: Vec<f64> = done.iter().map(|f| f.imbalance).collect();
        println!(
            "  {rests} at rest; energy error median {:.1e}, largest {:.1e}",
            quantile(&lost, 0.5),
            quantile(&lost, 1.0)
        );
        for (at, name) in NAMES.into_iter().enumerate() {
            let of = |falls: &[Fall]| falls.iter().map(|f| f.numbers[at]).collect::<Vec<_>>();
            let own = of(&done);
            let against = before.as_ref().map_or(String::new(), |before| {
                let (most, limit) = distance(&of(before), &own);
                format!("; distance from the count before {most:.3}, 5 % level {limit:.3}")
            });
            println!(
                "  {name}: {}, {}; largest {:.4}{against}",
                with_error(&own, 0.5),
                with_error(&own, 0.9),
                quantile(&own, 1.0)
            );
        }
        before = Some(done);
    }
}
