//! Contact steps for an instruction count: a cluster that lands on, tumbles and slides down a slope of 100 352
//! triangles. Looks at no clock, so that callgrind can run it; `examples/README.md` has the command and the counts.
//!
//! `cargo run --release -p dem-solver --example instructions SPHERES [own | fixed] [LAW]`
//!
//! `fixed` takes every step as long as the shortest possible contact asks for, `own` (the default) as the contact at hand does. `LAW` is `hertz_mindlin` (the default), `hertz_rock` or a preset of ground.

use dem_solver::DemSolver;
use dem_solver::random::SplitMix;
use dem_solver::rock::Motion;
use dem_solver::terrain::raster::Raster;
use interface_defs::{Plan, Solver, Window};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::path::Path;
use toolkit::program::Options;
use toolkit::scene::Scene;

#[path = "../tests/support/slope.rs"]
mod slope;
use slope::Slope;

/// Windows, and their length [s].
const WINDOWS: u64 = 60;
const LENGTH: f64 = 0.1;

fn solver(dir: &Path, spheres: &str, law: &str, dem: &str) -> DemSolver {
    let law = match law.starts_with("hertz") {
        true => format!("law = \"{law}\"\nyoung = 1e10\npoisson = 0.25\nrestitution = 0.35\nfriction = 0.6"),
        false => format!("preset = \"{law}\""),
    };
    let text = format!(
        "end_time = 120.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [8.0, 30.0, 70.0]\ndensity = 2600.0\n\
         shape = {{ type = \"box\", size = [0.8, 0.8, 0.8] }}\ncluster.spheres = {spheres}\n[terrain]\nfile = \"t.asc\"\n\
         [[contact]]\n{law}\n[dem]\n{dem}\n"
    );
    let scene = Scene::from_text(&dir.join("s.toml").display().to_string(), &text).expect("a scene");
    let options = Options { out: None, shortcuts: true };
    DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"))
}

fn main() {
    let spheres = std::env::args().nth(1).unwrap_or_else(|| "1000".into());
    let fixed = std::env::args().nth(2).is_some_and(|a| a == "fixed");
    let law = std::env::args().nth(3).unwrap_or_else(|| "hertz_mindlin".into());
    let dir = tempfile::tempdir().expect("a directory");
    let slope = Slope {
        corner: [0.0, 0.0],
        spacing: 0.5,
        counts: [225, 225],
        drop: 60.0,
        foot: 0.0,
        benches: 4,
        roughness: 0.08,
        seed: 5,
    };
    slope.raster().write_asc(&dir.path().join("t.asc")).expect("written");
    let mut it = solver(dir.path(), &spheres, &law, "steps_per_contact = 30.0");
    if fixed {
        let step = it.model().steps.step;
        it = solver(dir.path(), &spheres, &law, &format!("time_step = {step:?}"));
    }
    let mut output = it.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}")).initial;
    let ground = it.model().ground.as_ref().expect("a terrain");
    let above = Vector3::new(8.0, 30.0, ground.highest.z + ground.origin.z + 1.0) - ground.origin;
    let height = above.z - ground.height(&above, &-Vector3::z()).expect("on the slope") + ground.origin.z;
    let motion = Motion {
        position: Vector3::new(8.0, 30.0, height + 1.2),
        velocity: Vector3::new(4.0, 0.0, -2.0),
        orientation: UnitQuaternion::from_quaternion(Quaternion::new(1.0, 0.1, 0.3, 0.05)),
        angular_momentum: Vector3::zeros(),
        acceleration: it.model().settings.gravity,
        torque: Vector3::zeros(),
    };
    it.release(0, motion);
    for number in 1..=WINDOWS {
        let start = (number - 1) as f64 * LENGTH;
        let window = Window { number, iteration: 1, start, length: LENGTH };
        it.solve(&window, &[], &mut output).unwrap_or_else(|e| panic!("{e}"));
        it.commit().expect("committed");
    }
    for (name, count) in it.finish().expect("counts").counts {
        println!("{name} {count}");
    }
}
