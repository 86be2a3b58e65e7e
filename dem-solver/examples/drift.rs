//! Energy over many steps of smooth elastic spheres in a smooth box: it walks with the impacts and does
//! not drift.
//!
//! `cargo run --release -p dem-solver --example drift [STEPS]` (default 1e8, some minutes)

use dem_solver::granular::GranularSolver;
use interface_defs::toolkit::program::Options;
use interface_defs::toolkit::scene::Scene;
use interface_defs::{Plan, Solver, Window};

const SCENE: &str = "end_time = 1.0\n[[spheres]]\ncount = 2\nradius = [0.1, 0.1]\ndensity = 2500.0\nvelocity_scatter = 1.0\n\
                     [box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [0.5, 0.6, 0.7]\n\
                     [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.3\nrestitution = 1.0\n";

fn main() {
    let steps = std::env::args().nth(1).and_then(|a| a.parse::<f64>().ok()).unwrap_or(1e8);
    let scene = Scene::from_text("drift.toml", SCENE).unwrap_or_else(|e| panic!("{e}"));
    let options = Options { out: None, shortcuts: true };
    let mut solver = GranularSolver::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
    let ready = solver.prepare(&Plan::default(), &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
    let mut output = ready.initial;
    let energy = |output: &[f64]| (0..4).map(|i| output[3 * i]).sum::<f64>();
    let start = energy(&output);
    let length = solver.model().step * steps / 100.0;
    let mut worst = 0.0_f64;
    for part in 0..100_u64 {
        let window = Window { number: part + 1, iteration: 1, start: length * part as f64, length };
        solver.solve(&window, &[], &mut output).unwrap_or_else(|f| panic!("{f}"));
        solver.commit().unwrap_or_else(|f| panic!("{f}"));
        let off = energy(&output) / start - 1.0;
        worst = worst.max(off.abs());
        if (part + 1) % 10 == 0 {
            println!(
                "{:.1e} steps: energy off by {off:+.2e}, at most {worst:.2e}",
                steps * (part + 1) as f64 / 100.0
            );
        }
    }
}
