//! Cost of the contact search and the forces: the rock of the drop test, pressed into its net, in
//! windows of one step that end with one more evaluation.
//!
//! `cargo run --release -p dem-solver --example cost [SPHERES] [--counts]`

use dem_solver::DemSolver;
use interface_defs::{FieldSpec, InterfaceMesh, Layout, Plan, Sampling, Solver, Window, name};
use std::time::Instant;
use toolkit::program::Options;
use toolkit::scene::Scene;

const STEP: f64 = 5e-5;
const WINDOWS: usize = 40_000;
/// Solves of each window before it is committed, as in strong coupling.
const REPEATS: usize = 64;

/// 26 x 26 cells of 0.15 m, sagging by `sag` [m] in the middle.
fn net(radius: f64, sag: f64) -> InterfaceMesh {
    let (cells, spacing) = (26_u32, 0.15);
    let n = cells + 1;
    let mut mesh = InterfaceMesh::default();
    for j in 0..n {
        for i in 0..n {
            let at = |i: u32| spacing * (f64::from(i) - 0.5 * f64::from(cells));
            let (x, y) = (at(i), at(j));
            mesh.coordinates.extend([x, y, -sag * (1.0 - (x / 1.95).powi(2)) * (1.0 - (y / 1.95).powi(2))]);
            let a = j * n + i;
            if i + 1 < n {
                mesh.lines.push([a, a + 1]);
            }
            if j + 1 < n {
                mesh.lines.push([a, a + n]);
            }
        }
    }
    mesh.line_radius = vec![radius; mesh.lines.len()];
    mesh.masses = vec![0.03; mesh.node_count()];
    mesh
}

fn measure(spheres: u32, contact: &str, radius: f64, ends: bool) {
    let text = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [0.0, 0.0, 0.1515]\nvelocity = [0.0, 0.0, -3.0]\n\
         mass = 180.0\nshape = {{ type = \"box\", size = [0.41, 0.41, 0.41] }}\ncluster.spheres = {spheres}\n\
         [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\n{contact}\n[dem]\ntime_step = {STEP:e}\n"
    );
    let scene = Scene::from_text("cost.toml", &text).expect("a scene");
    let options = Options { out: None, shortcuts: true };
    let mut solver = DemSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
    let mut plan =
        Plan { end_time: 1.0, window: STEP, partner_mesh: Some(net(radius, 0.05)), ..Plan::default() };
    for field in [name::DISPLACEMENT, name::VELOCITY] {
        plan.takes.push(FieldSpec::nodal(field, 3, Sampling::FromStart));
    }
    plan.gives.push(FieldSpec::nodal(name::FORCE, 3, Sampling::Means));
    if ends {
        plan.gives.push(FieldSpec::nodal(name::FORCE, 3, Sampling::AtEnds));
    }
    let ready = solver.prepare(&plan, &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
    let layout = Layout::new(&plan.takes, &ready.mesh, 0);
    let mut input = vec![0.0; layout.len()];
    let mut output = ready.initial.clone();
    // The net moves with the rock, as it does on the way down.
    let (first, last) = (0..2187, 2187..4374);
    let mut times = Vec::with_capacity(WINDOWS);
    let mut contacts = 0.0;
    for number in 0..WINDOWS {
        // A window of contact, again and again from a state that commits move on slowly.
        let sunk = -3.0 * STEP * (number / REPEATS) as f64;
        for (range, depth) in [(&first, sunk), (&last, sunk - 3.0 * STEP)] {
            for z in input[range.clone()].iter_mut().skip(2).step_by(3) {
                *z = depth;
            }
        }
        let start = STEP * (number / REPEATS) as f64;
        let window = Window { number: number as u64 + 1, iteration: 1, start, length: STEP };
        let begun = Instant::now();
        solver.solve(&window, &input, &mut output).unwrap_or_else(|f| panic!("{f}"));
        times.push(begun.elapsed().as_secs_f64());
        if number % REPEATS == REPEATS - 1 {
            solver.commit().expect("committed");
        }
        contacts += output[output.len() - 3];
        if output[output.len() - 3] == 0.0 && number > REPEATS {
            times.truncate(number);
            break;
        }
    }
    let windows = times.len() as f64;
    let mean = times.iter().sum::<f64>() / windows;
    times.sort_by(f64::total_cmp);
    let median = times[times.len() / 10];
    let pairs = contacts / windows;
    println!(
        "{spheres:6} spheres, {contact:32} {}: {pairs:6.1} contacts, {windows:6.0} windows of {:.2} us (a tenth below {:.2}), \
         {:5.1} ns per contact and evaluation",
        if ends { "forces at both" } else { "energy at end " },
        mean * 1e6,
        median * 1e6,
        mean / (2.0 * pairs) * 1e9
    );
    if std::env::args().any(|a| a == "--counts") {
        println!("{:?}", solver.finish().expect("finished").counts);
    }
}

fn main() {
    let asked = std::env::args().find_map(|a| a.parse().ok());
    for spheres in [64, 512, 21_952].into_iter().filter(|s| asked.is_none_or(|a: u32| a == *s)) {
        measure(spheres, "restitution = 1.0", 0.0, false);
        measure(spheres, "restitution = 1.0", 0.0, true);
        measure(spheres, "restitution = 0.9\nfriction = 0.4", 0.002, false);
    }
}
