//! Cost of many separate spheres: CPU time per sphere and step, loose (all in flight, some collisions)
//! and dense (at rest under their weight, every contact with dashpot and friction).
//!
//! `cargo run --release -p dem-solver --example settling_box [SPHERES] [THREADS]`

use dem_solver::granular::GranularSolver;
use interface_defs::ipc::serve::cpu_seconds;
use interface_defs::{Plan, Solver, Window};
use toolkit::program::Options;
use toolkit::scene::Scene;

struct Box {
    solver: GranularSolver,
    output: Vec<f64>,
    windows: u64,
    time: f64,
}

impl Box {
    fn new(text: &str) -> Self {
        let scene = Scene::from_text("settling_box.toml", text).unwrap_or_else(|e| panic!("{e}"));
        let mut solver = GranularSolver::new(&scene, &Options { out: None, shortcuts: true })
            .unwrap_or_else(|e| panic!("{e}"));
        let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        Self { solver, output: ready.initial, windows: 0, time: 0.0 }
    }

    /// Advance by `steps` steps; CPU time per sphere and step [s].
    fn advance(&mut self, steps: u64) -> f64 {
        let length = self.solver.model().steps.step * steps as f64;
        self.windows += 1;
        let window = Window { number: self.windows, iteration: 1, start: self.time, length };
        let started = cpu_seconds();
        self.solver.solve(&window, &[], &mut self.output).unwrap_or_else(|f| panic!("{f}"));
        self.solver.commit().unwrap_or_else(|f| panic!("{f}"));
        self.time += length;
        (cpu_seconds() - started) / (steps as f64 * self.solver.state().position.len() as f64)
    }

    fn line(&mut self, what: &str, steps: u64) {
        let mut times: Vec<f64> = (0..5).map(|_| self.advance(steps / 5)).collect();
        times.sort_by(f64::total_cmp);
        let spheres = self.solver.state().position.len() as f64;
        println!(
            "{what}: {:.3} us per sphere and step (least {:.3}), {:.2} contacts per sphere, fastest {:.3} m/s",
            times[2] * 1e6,
            times[0] * 1e6,
            self.solver.state().contacts as f64 / spheres,
            self.output[15]
        );
    }
}

fn scene(count: usize, edge: f64, gravity: f64, scatter: f64) -> String {
    format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, {:?}]\n[[spheres]]\ncount = {count}\nradius = [0.009, 0.011]\ndensity = 2500.0\n\
         velocity_scatter = {scatter:?}\n[box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [{edge:?}, {edge:?}, {edge:?}]\n\
         [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e7\npoisson = 0.3\nrestitution = 0.3\nfriction = 0.5\n",
        -gravity
    )
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut next = |default: usize| arguments.next().and_then(|a| a.parse().ok()).unwrap_or(default);
    let count = next(10_000);
    // Share of the volume: 0.05 loose, 0.35 before it settles to some 0.6.
    let edge = |share: f64| (count as f64 * 4.0 / 3.0 * std::f64::consts::PI * 1e-6 / share).cbrt();
    println!("{count} spheres");
    let mut loose = Box::new(&scene(count, edge(0.05), 0.0, 0.5));
    loose.advance(500);
    loose.line("loose", 2000);
    let mut dense = Box::new(&scene(count, edge(0.35), 9.81, 0.0));
    println!("settling, step {:.3e} s", dense.solver.model().steps.step);
    while dense.time < 0.4 {
        dense.advance(500);
    }
    dense.line("dense", 2000);
}
