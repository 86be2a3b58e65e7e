//! What a window of the structure costs a coupler: `cargo run --release -p fem-solver --example window_cost [-- SCENE [KEY=VALUE]...]`.
//!
//! Windows of 1 ms with 10 bins of force and 10 samples of motion; the force acts on 100 nodes. All nodes of the interface
//! mesh, or these 100 selected; without and with what a contact solver needs to move nodes itself. The cases take turns, round
//! by round, so that a busy machine disturbs all alike; a quarter of the rounds is faster than what is printed. Then the same with other numbers
//! of samples: parts of a window that are no multiple of the structure's own step cost steps.

use fem_solver::FemSolver;
use interface_defs::field::{FieldSpec, Items, Layout, Place, Sampling, name};
use interface_defs::message::Plan;
use interface_defs::selection::Selection;
use interface_defs::solver::{Solver, Window};
use std::path::PathBuf;
use std::time::Instant;
use toolkit::program::Options;
use toolkit::scene::Scene;

const WINDOW: f64 = 1e-3;
const NODES: usize = 100;
const ROUNDS: usize = 60;

/// A structure and the part of its interface mesh that is sent.
struct Case {
    name: String,
    solver: FemSolver,
    input: Vec<f64>,
    output: Vec<f64>,
    number: u64,
    /// Seconds of each round.
    solved: Vec<f64>,
}

fn plan(samples: u32, local: bool) -> Plan {
    let sampled = |name, sampling| FieldSpec { samples, ..FieldSpec::nodal(name, 3, sampling) };
    let once =
        |name, components, place| FieldSpec { place, ..FieldSpec::nodal(name, components, Sampling::Once) };
    let mut gives = vec![
        sampled(name::DISPLACEMENT, Sampling::AtEnds),
        sampled(name::VELOCITY, Sampling::AtEnds),
        once(name::TRAVEL, 1, Place::Whole),
    ];
    if local {
        gives.extend([
            once(name::LOCAL_FORCE, 3, Place::Node),
            once(name::LOCAL_FORCE_RATE, 3, Place::Node),
            once(name::LOCAL_TANGENT, 9, Place::Pair),
            once(name::LOCAL_DAMPING, 1, Place::Whole),
        ]);
    }
    let takes = vec![sampled(name::FORCE, Sampling::Means)];
    Plan { end_time: 1e3, window: WINDOW, takes, gives, ..Plan::default() }
}

impl Case {
    fn new(scene: &Scene, samples: u32, select: bool, local: bool) -> Self {
        let options = Options { out: None, shortcuts: true };
        let mut solver = FemSolver::new(scene, &options).unwrap_or_else(|e| panic!("{e}"));
        let plan = plan(samples, local);
        let ready = solver.prepare(&plan, &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        let mesh = ready.mesh;
        // Those nearest to the middle of the mesh that are not held.
        let count = mesh.node_count();
        let place = |node: usize| -> [f64; 3] {
            mesh.coordinates[3 * node..][..3].try_into().expect("three numbers")
        };
        let middle = [0, 1, 2].map(|c: usize| (0..count).map(|n| place(n)[c]).sum::<f64>() / count as f64);
        let away = |node: &usize| place(*node).iter().zip(middle).map(|(x, m)| (x - m).powi(2)).sum::<f64>();
        let mut nodes: Vec<usize> = (0..count).filter(|n| mesh.masses[*n].is_finite()).collect();
        nodes.sort_by(|a, b| away(a).total_cmp(&away(b)));
        nodes.truncate(NODES);
        nodes.sort_unstable();
        let mut selection = Selection::new(&mesh);
        selection.set(&mesh, nodes.iter().map(|n| *n as u32)).unwrap_or_else(|e| panic!("{e}"));
        let mut items = Items::of(&mesh);
        if select {
            solver.select(Some(&mut selection)).unwrap_or_else(|e| panic!("{e}"));
            items = selection.items();
        }
        let length = |fields: &[FieldSpec], gauges: usize| {
            let mut layout = Layout::new(fields, &mesh, gauges);
            layout.resize(&items);
            layout.len()
        };
        let mut input = vec![0.0; length(&plan.takes, 0)];
        let sent = if select { nodes.len() } else { count };
        for sample in 0..samples as usize {
            for (at, node) in nodes.iter().enumerate() {
                let at = sample * sent + if select { at } else { *node };
                input[3 * at + 2] = -20.0;
            }
        }
        let name = format!(
            "{} nodes, {samples:>2} samples, {} pairs{}",
            items.nodes,
            items.pairs,
            if local { ", local fields" } else { "" }
        );
        let output = vec![0.0; length(&plan.gives, ready.gauges.len())];
        Self { name, solver, input, output, number: 0, solved: Vec::new() }
    }

    /// Some windows, solved and accepted.
    fn round(&mut self) {
        const WINDOWS: u32 = 10;
        let started = Instant::now();
        for _ in 0..WINDOWS {
            let start = self.number as f64 * WINDOW;
            self.number += 1;
            let window = Window { number: self.number, iteration: 1, start, length: WINDOW };
            self.solver.solve(&window, &self.input, &mut self.output).unwrap_or_else(|e| panic!("{e}"));
            self.solver.commit().unwrap_or_else(|e| panic!("{e}"));
        }
        self.solved.push(started.elapsed().as_secs_f64() / f64::from(WINDOWS));
    }

    fn report(&mut self) {
        self.solved.sort_by(f64::total_cmp);
        let [least, quarter] = [0, self.solved.len() / 4].map(|at| 1e6 * self.solved[at]);
        let statistics = self.solver.finish().unwrap_or_else(|e| panic!("{e}"));
        let count = statistics.counts.iter().find(|(name, _)| name == "sub_steps");
        let steps = count.map_or(f64::NAN, |(_, steps)| *steps as f64 / self.number as f64);
        println!("{:<52} {quarter:>8.1} us per window (least {least:.1}), {steps:.0} steps", self.name);
    }
}

fn main() {
    let scenes = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../launch/scenes"));
    let path = std::env::args().nth(1).map_or(scenes.join("walenstadt-compare.toml"), PathBuf::from);
    let sets: Vec<String> = std::env::args().skip(2).collect();
    let scene = Scene::load(&path, &sets).unwrap_or_else(|e| panic!("{e}"));
    let kinds = [(false, false), (true, false), (false, true), (true, true)];
    let mut cases: Vec<Case> =
        kinds.iter().map(|(select, local)| Case::new(&scene, 10, *select, *local)).collect();
    cases.extend([1, 8, 16, 20].map(|samples| Case::new(&scene, samples, true, true)));
    for _ in 0..ROUNDS {
        cases.iter_mut().for_each(Case::round);
    }
    cases.iter_mut().for_each(Case::report);
}
