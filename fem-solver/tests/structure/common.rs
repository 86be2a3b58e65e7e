//! A structure driven window by window, as a coupler would.

use fem_solver::FemSolver;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::field::{FieldSpec, Layout, Sampling, name};
use interface_defs::message::{Fault, Plan, Ready, Role};
use interface_defs::solver::{Solver, Window};
use toolkit::check::CheckReport;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// The two nets of `walenstadt.md` and how they are cut and damped.
pub const WALENSTADT: &str = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]

[structure]
generator = { type = "rectangular_net", cells = [26, 26], spacing = 0.15, boundary_cables = false }
damping = 15.0

[structure.cable]
young = 8.227864894e9
area = 1.256637061e-5
density = 7850.0
prestress = 0.0
"#;

/// What `check` says of a scene without a trial.
pub fn check(scene: &Scene) -> Result<CheckReport, Diagnostic> {
    fem_solver::solver::check::check(scene, None)
}

/// A scene from text.
pub fn scene(text: &str) -> Scene {
    Scene::from_text("test.toml", text).unwrap_or_else(|e| panic!("{e}"))
}

/// The solver of a scene, shortcuts on, without files.
pub fn solver(text: &str) -> FemSolver {
    FemSolver::new(&scene(text), &Options { out: None, shortcuts: true }).unwrap_or_else(|e| panic!("{e}"))
}

/// A prepared structure, its time and its last answer.
pub struct Run {
    pub solver: FemSolver,
    pub ready: Ready,
    pub output: Vec<f64>,
    pub layout: Layout,
    pub force_len: usize,
    nothing: Vec<f64>,
    pub time: f64,
    pub number: u64,
}

impl Run {
    /// Without interface force or motion.
    pub fn alone(text: &str, window: f64) -> Self {
        Self::with(text, Plan { end_time: 1.0, window, ..Plan::default() })
    }

    /// With a force of one sample and motion at the window's end.
    pub fn coupled(text: &str, window: f64, sampling: Sampling) -> Self {
        Self::with(text, coupled_plan(window, sampling, 1, 1))
    }

    pub fn with(text: &str, plan: Plan) -> Self {
        Self::of(solver(text), plan)
    }

    pub fn of(mut solver: FemSolver, plan: Plan) -> Self {
        let ready = solver.prepare(&plan, &mut |_| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        let layout = Layout::new(&plan.gives, &ready.mesh, ready.gauges.len());
        let force_len = Layout::new(&plan.takes, &ready.mesh, 0).len();
        let output = ready.initial.clone();
        let nothing = vec![0.0; force_len];
        Self { solver, ready, output, layout, force_len, nothing, time: 0.0, number: 0 }
    }

    /// Solve a window of `length` without force, or with, and accept it.
    pub fn step(&mut self, length: f64, force: &[f64]) {
        self.solve(length, force).unwrap_or_else(|e| panic!("{e}"));
        self.commit(length);
    }

    pub fn solve(&mut self, length: f64, force: &[f64]) -> Result<(), Fault> {
        let window = Window { number: self.number + 1, iteration: 1, start: self.time, length };
        let force = if force.is_empty() { &self.nothing } else { force };
        self.solver.solve(&window, force, &mut self.output)
    }

    pub fn commit(&mut self, length: f64) {
        self.solver.commit().unwrap_or_else(|e| panic!("{e}"));
        self.time += length;
        self.number += 1;
    }

    /// `[value, smallest, largest]` of a gauge.
    pub fn gauge(&self, name: &str) -> [f64; 3] {
        let at = self.ready.gauges.iter().position(|g| g.name == name);
        let at = at.unwrap_or_else(|| panic!("there is no gauge {name}: {:?}", self.ready.gauges));
        self.output[self.layout.gauge(at)].try_into().expect("three numbers")
    }

    pub fn value(&self, name: &str) -> f64 {
        self.gauge(name)[0]
    }

    /// Kinetic + potential + stored + dissipated energy less received work.
    pub fn balance(&self) -> f64 {
        self.ready
            .gauges
            .iter()
            .enumerate()
            .map(|(i, gauge)| {
                let value = self.output[self.layout.gauge(i)][0];
                match gauge.role {
                    Role::None => 0.0,
                    Role::Received => -value,
                    _ => value,
                }
            })
            .sum()
    }

    /// Displacement of a node at the window's end.
    pub fn displacement(&self, node: usize) -> [f64; 3] {
        let at = self.layout.last(name::DISPLACEMENT, Sampling::AtEnds).expect("is in the plan");
        self.output[at][3 * node..][..3].try_into().expect("three numbers")
    }

    pub fn measure(&mut self, name: &str) -> f64 {
        let statistics = self.solver.finish().expect("is prepared");
        let found = statistics.measures.iter().find(|m| m.name == name);
        found.unwrap_or_else(|| panic!("there is no measure {name}")).value
    }

    pub fn count(&mut self, name: &str) -> u64 {
        let statistics = self.solver.finish().expect("is prepared");
        statistics.counts.iter().find(|(n, _)| n == name).expect("is counted").1
    }
}

pub fn coupled_plan(window: f64, sampling: Sampling, force_samples: u32, motion_samples: u32) -> Plan {
    let field = |name, sampling, samples| FieldSpec { samples, ..FieldSpec::nodal(name, 3, sampling) };
    Plan {
        end_time: 1.0,
        window,
        takes: vec![field(name::FORCE, sampling, force_samples)],
        gives: vec![
            field(name::DISPLACEMENT, Sampling::AtEnds, motion_samples),
            field(name::VELOCITY, Sampling::AtEnds, motion_samples),
        ],
        ..Plan::default()
    }
}

/// Numbers between -1/2 and 1/2, the same each time.
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    }
}

/// Relative difference.
pub fn off(value: f64, exact: f64) -> f64 {
    (value / exact - 1.0).abs()
}
