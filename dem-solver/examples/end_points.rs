//! What the step in contact means for where a rock ends: how two ways of one release part from impact to impact, and
//! whether the run-outs of many releases are distributed alike.
//!
//! `cargo run --release -p dem-solver --example end_points [RELEASES [cube | cube-continuous | ball]]` (default 128, all three; some
//! minutes)
//!
//! A way over terrain is chaotic: whatever differs by a millionth of a metre at one impact differs by some times that at the
//! next. A finer step therefore does not bring the end point of one release nearer to any limit; what converges is what many
//! releases have in common.
//!
//! Measured with the cube of 1 000 spheres and the continuous hierarchy, 400 releases: ways with 20 and with 80 steps per contact are (median) 0.2 mm
//! apart after the first impact, 2 mm after the second, 0.1 m after the fifth, 12 m after the tenth; so are two ways with 80 steps that
//! begin 1e-9 m apart: 1e-9, 1e-9, 9e-8, 0.02 m, and 103 m at the end. Run-out, median and 90 %: 353 (346 to 363) and 399.7 (399.1 to
//! 401.1) m with 20 steps, 351 (346 to 358) and 397.5 (396.5 to 398.5) m with 80: the distributions differ by 0.047, two of one
//! sort by 0.042, the 5 % level is 0.096. At rest on the slope end 96 and 122 of 400, two standard errors apart.

use dem_solver::DemSolver;
use dem_solver::model::runout::Ending;
use dem_solver::rock::Motion;
use dem_solver::terrain::slope::Slope;
use interface_defs::toolkit::program::Options;
use interface_defs::toolkit::scene::Scene;
use interface_defs::{Plan, Solver, Window};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::path::Path;

const WINDOW: f64 = 0.02;
const END: f64 = 120.0;
const IMPACTS: [usize; 4] = [1, 2, 5, 10];

/// A rock, and what it meets.
const ROCKS: [(&str, &str, &str); 3] = [
    ("cube", CUBE, "young = 3e9"),
    ("cube-continuous", CUBE, "young = 3e9\nhierarchy = \"continuous\""),
    (
        "ball",
        "shape = { type = \"sphere\", radius = 0.5 }",
        "young = 1e8\nrolling_friction = 0.5\nrolling = \"spring\"\nrolling_damping = 0.3",
    ),
];
const CUBE: &str = "shape = { type = \"box\", size = [0.8, 0.8, 0.8] }\ncluster.spheres = 1000";

fn scene([_, shape, contact]: [&str; 3], steps: f64) -> String {
    format!(
        "end_time = {END:?}\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [40.0, 100.0, 210.0]\ndensity = 2600.0\n{shape}\n\
         [terrain]\nfile = \"slope.asc\"\n[[contact]]\nlaw = \"hertz_mindlin\"\npoisson = 0.25\nrestitution = 0.35\n\
         friction = 0.6\n{contact}\n[dem]\nsteps_per_contact = {steps:?}\n"
    )
}

/// The flights after each impact, and where and how the way ended.
struct Way {
    flights: Vec<(f64, Motion)>,
    run_out: f64,
    end: Vector3<f64>,
    rests: bool,
    /// Largest imbalance of energy over the largest kinetic one.
    imbalance: f64,
    impacts: u64,
}

/// Release number `k`, moved by `shift` [m] along the slope.
fn way(solver: &mut DemSolver, output: &mut [f64], k: usize, shift: f64) -> Way {
    let part = |f: f64| (k as f64 * f).fract();
    let model = solver.model();
    let ground = model.ground.as_ref().expect("a terrain");
    let at = Vector3::new(8.0 + shift, 20.0 + 160.0 * part(0.618_034), 0.0);
    let above = Vector3::new(at.x, at.y, ground.highest.z + ground.origin.z + 1.0) - ground.origin;
    let z = above.z - ground.height(&above, &-Vector3::z()).expect("on the slope") + ground.origin.z;
    let turn = Quaternion::new(1.0, part(0.414_214) - 0.5, part(0.732_051) - 0.5, part(0.236_068) - 0.5);
    let start = Motion {
        position: Vector3::new(at.x, at.y, z + 1.5),
        velocity: Vector3::new(4.0, 0.0, -2.0),
        orientation: UnitQuaternion::from_quaternion(turn),
        angular_momentum: Vector3::zeros(),
        acceleration: model.settings.gravity,
        torque: Vector3::zeros(),
    };
    solver.release(0, start);
    let from = solver.state().bodies[0].motion.position;
    let (mut flights, mut number, mut first) = (Vec::new(), 0_u32, None);
    let (mut imbalance, mut fastest) = (0.0_f64, 0.0_f64);
    while !solver.has_ended() && WINDOW * f64::from(number) < END {
        let start = WINDOW * f64::from(number);
        let window = Window { number: u64::from(number) + 1, iteration: 1, start, length: WINDOW };
        solver.solve(&window, &[], output).unwrap_or_else(|f| panic!("{f}"));
        solver.commit().expect("committed");
        number += 1;
        let (state, rock) = (solver.state(), &solver.model().rocks[0]);
        let body = &state.bodies[0];
        if body.contacts == 0 && body.path.impacts as usize > flights.len() {
            // One that was followed by the next within the window has no flight of its own to show.
            flights.resize(body.path.impacts as usize, (state.time, body.motion));
        }
        let kinetic = rock.kinetic_energy(&body.motion);
        let height = body.motion.position.dot(&solver.model().settings.gravity) * rock.mass;
        let energy = kinetic - height + body.elastic + body.sheared + state.dissipated;
        fastest = fastest.max(kinetic);
        imbalance = imbalance.max((energy - *first.get_or_insert(energy)).abs());
    }
    let body = &solver.state().bodies[0];
    let level = (body.motion.position - from).xy().norm();
    Way {
        flights,
        run_out: level,
        end: body.motion.position,
        rests: body.path.ending.is_some_and(|end| end.how == Ending::Rest),
        imbalance: imbalance / fastest,
        impacts: body.path.impacts,
    }
}

/// All releases with so many steps in a contact.
fn ways(dir: &Path, rock: [&str; 3], steps: f64, releases: usize, shift: f64) -> Vec<Way> {
    let scene =
        Scene::from_text(&dir.join("s.toml").display().to_string(), &scene(rock, steps)).expect("a scene");
    let options = Options { out: None, shortcuts: true };
    let mut solver = DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
    let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
    let mut output = ready.initial;
    (0..releases).map(|k| way(&mut solver, &mut output, k, shift)).collect()
}

/// The value below which `share` of them lie.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = share * (values.len() - 1) as f64;
    let (low, high) = (values[at.floor() as usize], values[at.ceil() as usize]);
    low + (high - low) * at.fract()
}

/// How far apart two ways are in the flight after impact `number`: both at the first one's time.
fn apart(a: &Way, b: &Way, number: usize) -> Option<f64> {
    let ((ta, a), (tb, b)) = (a.flights.get(number - 1)?, b.flights.get(number - 1)?);
    let later = ta - tb;
    let there = b.position + (b.velocity - Vector3::z() * (0.5 * 9.81 * later)) * later;
    Some((there - a.position).norm())
}

fn part(name: &str, a: &[Way], b: &[Way]) {
    let of = |number: usize| {
        let mut found: Vec<f64> = a.iter().zip(b).filter_map(|(a, b)| apart(a, b, number)).collect();
        if found.is_empty() {
            return "-".to_owned();
        }
        format!("{:.1e} ({:.1e})", quantile(&mut found, 0.5), quantile(&mut found, 0.9))
    };
    let mut ends: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a.end - b.end).norm()).collect();
    let after = IMPACTS.map(of).join(", ");
    println!(
        "    {name}: {after}; at the end {:.1} ({:.1})",
        quantile(&mut ends, 0.5),
        quantile(&mut ends, 0.9)
    );
}

/// Median and 90 % quantile of the run-out, each with the values one standard error of its rank away.
fn distribution(name: &str, ways: &[Way]) {
    let n = ways.len() as f64;
    let mut outs: Vec<f64> = ways.iter().map(|w| w.run_out).collect();
    let mut of = |share: f64| {
        let error = (share * (1.0 - share) / n).sqrt();
        let [low, value, high] =
            [share - error, share, (share + error).min(1.0)].map(|s| quantile(&mut outs, s));
        format!("{value:.1} ({low:.1} to {high:.1})")
    };
    let (median, most) = (of(0.5), of(0.9));
    let rests = ways.iter().filter(|w| w.rests).count();
    let impacts = ways.iter().map(|w| w.impacts as f64).sum::<f64>() / n;
    let mut lost: Vec<f64> = ways.iter().map(|w| w.imbalance).collect();
    println!(
        "    {name}: run-out median {median} m, 90 % {most} m; {rests} at rest, {impacts:.1} impacts on average; energy error \
         median {:.1e}, largest {:.1e}",
        quantile(&mut lost, 0.5),
        quantile(&mut lost, 1.0)
    );
}

/// Largest distance of two distributions, and that which one pair of samples in twenty exceeds (Kolmogorov, Smirnov).
fn compare(name: &str, a: &[Way], b: &[Way]) {
    let below =
        |ways: &[Way], x: f64| ways.iter().filter(|w| w.run_out <= x).count() as f64 / ways.len() as f64;
    let points = a.iter().chain(b).map(|w| w.run_out);
    let most = points.map(|x| (below(a, x) - below(b, x)).abs()).fold(0.0, f64::max);
    let limit = 1.36 * (2.0 / a.len() as f64).sqrt();
    let verdict = if most < limit { "equal within sampling error" } else { "not equal" };
    println!("    run-outs {name}: largest distance {most:.3}, 5 % level {limit:.3}: {verdict}");
}

fn main() {
    let releases = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(128);
    let only = std::env::args().nth(2);
    let dir = tempfile::tempdir().expect("a directory");
    let slope = Slope {
        corner: [0.0, 0.0],
        spacing: 0.4,
        counts: [1001, 501],
        drop: 200.0,
        foot: 0.0,
        benches: 4,
        roughness: 0.08,
        seed: 5,
    };
    slope.raster().write_asc(&dir.path().join("slope.asc")).expect("written");
    for (name, shape, contact) in ROCKS {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let run = |steps: f64, shift: f64| ways(dir.path(), [name, shape, contact], steps, releases, shift);
        println!("{name}, {releases} releases on a slope of 400 m, restitution 0.35, friction 0.6");
        let [coarse, middle, fine] = [20.0, 40.0, 80.0].map(|steps| run(steps, 0.0));
        let moved = run(80.0, 1e-9);
        println!("  apart [m] in the flight after impacts 1, 2, 5, 10: median (90 %)");
        part("20 against 80 steps per contact", &coarse, &fine);
        part("40 against 80 steps per contact", &middle, &fine);
        part("80 steps, released 1e-9 m further", &moved, &fine);
        println!("  all releases: value (values at the standard error of its rank)");
        distribution("20 steps per contact", &coarse);
        distribution("40 steps per contact", &middle);
        distribution("80 steps per contact", &fine);
        compare("at 20 and 80 steps", &coarse, &fine);
        compare("at 80 steps, released 1e-9 m further", &moved, &fine);
    }
}
