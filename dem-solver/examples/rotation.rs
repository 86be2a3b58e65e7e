//! Error and cost of the schemes of rotation at equal steps: a tumbling rock, and scenes that are named.
//!
//! `cargo run --release -p dem-solver --example rotation [SCENE ...]`

use dem_solver::DemSolver;
use dem_solver::settings::Rotation;
use interface_defs::ipc::serve::cpu_seconds;
use interface_defs::toolkit::program::Options;
use interface_defs::toolkit::scene::Scene;
use interface_defs::{Plan, Solver, Window};
use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;

const SCHEMES: [(Rotation, &str); 4] = [
    (Rotation::Exact, "exact"),
    (Rotation::Midpoint, "midpoint"),
    (Rotation::Splitting, "splitting"),
    (Rotation::RungeKutta, "runge_kutta"),
];

/// A slab of 1.2 x 0.8 x 0.5 m at 10 rad/s about its middle axis, for ten seconds.
fn tumbling() {
    let inertia = Vector3::new(0.89, 1.69, 2.08) * 104.0;
    let momentum = inertia.component_mul(&Vector3::new(0.1, 10.0, 0.2));
    let start = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0);
    let end = Rotation::Exact.turn(&start, &momentum, &inertia, 10.0);
    let energy = |q: &UnitQuaternion<f64>| {
        let own = q.inverse_transform_vector(&momentum);
        own.dot(&own.component_div(&inertia))
    };
    println!("slab of three moments, 10 rad/s about the middle axis, 10 s:");
    for h in [1e-3, 1e-4, 1e-5] {
        for (scheme, name) in SCHEMES {
            let steps = (10.0_f64 / h).round() as usize;
            // The median of five: the machine is not ours alone.
            let mut costs = [0.0; 5];
            let mut q = start;
            for cost in &mut costs {
                let clock = cpu_seconds();
                q = (0..steps).fold(start, |q, _| scheme.turn(&q, &momentum, &inertia, h));
                *cost = (cpu_seconds() - clock) / steps as f64;
            }
            costs.sort_by(f64::total_cmp);
            println!(
                "    h = {h:.0e} s, {name:11}: {:4.0} ns per turn, orientation off by {:.1e} rad, energy by {:.1e}",
                1e9 * costs[2],
                q.angle_to(&end),
                (energy(&q) / energy(&start) - 1.0).abs()
            );
        }
    }
}

/// A scene to its end or to rest, in windows of 0.05 s: cost, and how far the rock is from where the exact scheme has it
/// when it has parted from its first, second, third impact.
fn scene(file: &Path) {
    println!("{}:", file.display());
    let mut exact: Vec<Vector3<f64>> = Vec::new();
    for (_, name) in SCHEMES {
        let scene = Scene::load(file, &[format!("dem.rotation={name}")]).unwrap_or_else(|e| panic!("{e}"));
        let mut solver =
            DemSolver::new(&scene, &Options { out: None, shortcuts: true }).unwrap_or_else(|e| panic!("{e}"));
        let mut output =
            solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}")).initial;
        let (length, mut number, mut places, mut impacts) = (0.01, 0_u32, Vec::new(), 0);
        let clock = cpu_seconds();
        while !solver.has_ended() && length * f64::from(number) < 60.0 {
            let window = Window {
                number: u64::from(number) + 1,
                iteration: 1,
                start: length * f64::from(number),
                length,
            };
            solver.solve(&window, &[], &mut output).unwrap_or_else(|f| panic!("{f}"));
            solver.commit().unwrap_or_else(|f| panic!("{f}"));
            number += 1;
            let body = &solver.state().bodies[0];
            if body.path.impacts > impacts && body.contacts == 0 {
                impacts = body.path.impacts;
                places.push(body.motion.position);
            }
        }
        let cost = cpu_seconds() - clock;
        let counts = solver.finish().expect("finished").counts;
        let count = |name: &str| counts.iter().find(|(n, _)| n == name).map_or(0, |(_, c)| *c) as f64;
        if name == "exact" {
            exact.clone_from(&places);
        }
        let apart: Vec<String> =
            places.iter().zip(&exact).take(4).map(|(a, b)| format!("{:.1e}", (a - b).norm())).collect();
        println!(
            "    {name:11}: {:.3} s for {:.0} contact steps and {:.0} flown ones, {:.2} us per contact step; {} m apart from exact \
             after impacts 1, 2, ...",
            cost,
            count("sub_steps"),
            count("flight_steps"),
            1e6 * cost / count("sub_steps"),
            apart.join(", ")
        );
    }
}

fn main() {
    tumbling();
    std::env::args().skip(1).for_each(|file| scene(Path::new(&file)));
}
