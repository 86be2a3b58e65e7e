//! What is booked: work on both sides of the interface, and memory.

use coupler::coupling::{Committed, Coupling, Observer};
use coupler::records::Records;
use coupler::side::Side;
use in_process::{Any, InProcess};
use interface_defs::Diagnostic;
use interface_defs::message::{Fault, Hello, Plan, Ready, Role, Statistics};
use interface_defs::solver::{OnProgress, Solver, Window};
use interface_defs::{Layout, Sampling, name};
use std::cell::RefCell;
use std::rc::Rc;
use tests::{Bench, scene};
use toolkit::alloc::allocations;
use toolkit::limits::Limits;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// Displacement before and after, and mean force, as they crossed the border of a solver.
#[derive(Default)]
struct Crossed {
    start: Vec<f64>,
    end: Vec<f64>,
    force: Vec<f64>,
}

/// A solver, and what crossed its border in the last solve.
struct Watched {
    solver: Box<dyn Solver>,
    takes: Layout,
    gives: Layout,
    crossed: Rc<RefCell<Crossed>>,
}

impl Solver for Watched {
    fn hello(&self) -> Hello {
        self.solver.hello()
    }
    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        let ready = self.solver.prepare(plan, progress)?;
        self.takes = Layout::new(&plan.takes, &ready.mesh, 0);
        self.gives = Layout::new(&plan.gives, &ready.mesh, ready.gauges.len());
        Ok(ready)
    }
    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.solver.solve(window, input, output)?;
        let mut crossed = self.crossed.borrow_mut();
        let Crossed { start, end, force } = &mut *crossed;
        let keep = |to: &mut Vec<f64>, from: &[f64]| {
            to.clear();
            to.extend_from_slice(from);
        };
        if let Some(place) = self.takes.sample(name::DISPLACEMENT, Sampling::FromStart, 0) {
            keep(start, &input[place]);
        }
        if let Some(place) = self.takes.last(name::DISPLACEMENT, Sampling::FromStart) {
            keep(end, &input[place]);
            keep(force, &output[self.gives.last(name::FORCE, Sampling::Means).unwrap()]);
        } else {
            keep(end, &output[self.gives.last(name::DISPLACEMENT, Sampling::AtEnds).unwrap()]);
            keep(force, &input[self.takes.last(name::FORCE, Sampling::Means).unwrap()]);
        }
        Ok(())
    }
    fn commit(&mut self) -> Result<(), Fault> {
        self.solver.commit()
    }
    fn finish(&mut self) -> Result<Statistics, Fault> {
        self.solver.finish()
    }
}

/// Checks the books of every committed window.
struct Auditor {
    dem: Rc<RefCell<Crossed>>,
    fem: Rc<RefCell<Crossed>>,
    /// Places of the gauges that tell the received work.
    received: (usize, usize),
    /// Totals so far: work on structure and wall as booked, as received by structure and rocks.
    before: [f64; 4],
    windows: u64,
    windows_with_force: u64,
    largest_defect: f64,
}

impl Observer for Auditor {
    fn prepared(&mut self, dem: &Side, fem: &Side, _: &[Diagnostic]) -> Result<(), Diagnostic> {
        let place = |side: &Side| side.gauges.iter().position(|g| g.role == Role::Received).unwrap();
        self.received = (place(dem), place(fem));
        Ok(())
    }

    fn committed(&mut self, c: &Committed) -> Result<(), Diagnostic> {
        let (dem, fem) = (self.dem.borrow(), self.fem.borrow());
        let now = [
            c.balance.structure_work,
            c.balance.mesh_work,
            c.fem[3 * self.received.1],
            -c.dem[3 * self.received.0],
        ];
        let [structure, wall, of_fem, of_dem]: [f64; 4] = std::array::from_fn(|i| now[i] - self.before[i]);
        self.before = now;
        assert_eq!(dem.force, fem.force, "equal meshes: what is given is taken");
        // Displacements of up to 1 m are rounded to 1e-16 m, by either side and in their difference;
        // totals of up to 1e4 J to 1e-12 J.
        let size: f64 = dem.force.iter().map(|f| f.abs()).sum();
        let rounding = 1e-15 * size + 4e-12;
        let close = |what: &str, a: f64, b: f64| {
            assert!((a - b).abs() <= rounding, "window {}: {what}: {a:e} J and {b:e} J", c.span.number);
        };
        let residual = fem.end.iter().zip(&dem.end).map(|(answer, iterate)| answer - iterate);
        let defect: f64 = dem.force.iter().zip(residual).map(|(f, r)| f * r).sum();
        close("booked difference, mean force times residual", structure - wall, defect);
        close("work on the structure, as booked and as it received it", structure, of_fem);
        close("work on the wall, as booked and as the rocks gave it", wall, of_dem);
        self.windows += 1;
        self.windows_with_force += u64::from(size > 0.0);
        self.largest_defect = self.largest_defect.max(defect.abs());
        Ok(())
    }
}

fn solvers(name: &str, sets: &[&str]) -> (Scene, Box<dyn Solver>, Box<dyn Solver>) {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let scene = Scene::load(&scene(name), &sets).unwrap();
    let options = Options { out: None, shortcuts: true };
    let dem = (dem_solver::PROGRAM.build)(&scene, &options).unwrap();
    let fem = (fem_solver::PROGRAM.build)(&scene, &options).unwrap();
    (scene, dem, fem)
}

fn audit(name: &str, sets: &[&str]) -> Auditor {
    let (scene, dem, fem) = solvers(name, sets);
    let crossed = || Rc::new(RefCell::new(Crossed::default()));
    let mut auditor = Auditor {
        dem: crossed(),
        fem: crossed(),
        received: (0, 0),
        before: [0.0; 4],
        windows: 0,
        windows_with_force: 0,
        largest_defect: 0.0,
    };
    let watched = |solver, crossed: &Rc<RefCell<Crossed>>| {
        let (takes, gives) = (Layout::default(), Layout::default());
        Watched { solver, takes, gives, crossed: Rc::clone(crossed) }
    };
    let mut dem = InProcess::new("dem", watched(dem, &auditor.dem));
    let mut fem = InProcess::new("fem", watched(fem, &auditor.fem));
    let settings = coupler::settings::CouplingSettings::of(&scene).unwrap();
    let mut coupling = Coupling::new(settings, scene.end_time().unwrap(), &mut dem, &mut fem);
    coupling.limits = Limits::of(&scene).unwrap();
    coupling.run(&mut auditor, &mut |_| Ok(())).unwrap();
    assert!(auditor.windows_with_force > 20, "{} of {}", auditor.windows_with_force, auditor.windows);
    auditor
}

#[test]
fn the_books_of_both_sides_differ_by_mean_force_times_residual_in_every_window() {
    let weak =
        audit("walenstadt-exp1", &["end_time=0.68", "coupling.scheme=weak", "coupling.time_window=5e-5"]);
    let strong = audit("walenstadt-exp1", &["end_time=0.68"]);
    let halved = audit(
        "cable-net",
        &[
            "end_time=0.06",
            "coupling.scheme=strong",
            "coupling.time_window=5e-4",
            "coupling.max_iterations=8",
        ],
    );
    assert!(weak.largest_defect > 100.0 * strong.largest_defect, "iterations close the gap");
    assert!(halved.windows > 120, "some windows were halved");
}

/// Counts allocations from one committed window to the next, files and all.
struct Counted {
    records: Records,
    counts: Vec<u64>,
}

impl Observer for Counted {
    fn prepared(&mut self, dem: &Side, fem: &Side, warnings: &[Diagnostic]) -> Result<(), Diagnostic> {
        self.records.prepared(dem, fem, warnings)
    }
    fn committed(&mut self, c: &Committed) -> Result<(), Diagnostic> {
        self.records.committed(c)?;
        self.counts.push(allocations());
        Ok(())
    }
}

#[test]
fn nothing_is_allocated_in_a_window_after_the_first() {
    for sets in [
        &["end_time=0.75"][..],
        &["end_time=0.75", "coupling.scheme=weak", "coupling.time_window=5e-5"],
        &[
            "end_time=0.75",
            "coupling.scheme=strong",
            "coupling.time_window=2e-4",
            "coupling.acceleration.type=iqn_ils",
        ],
    ] {
        let bench = Bench::new();
        let (scene, dem, fem) = solvers("walenstadt-exp1", sets);
        let (mut dem, mut fem) = (InProcess::new("dem", Any(dem)), InProcess::new("fem", Any(fem)));
        let settings = coupler::settings::CouplingSettings::of(&scene).unwrap();
        let end = scene.end_time().unwrap();
        let output = toolkit::output::Output::of(&scene).unwrap();
        std::fs::create_dir_all(bench.path("out")).unwrap();
        let records = Records::new(&bench.path("out"), end, &output, None);
        let mut counted = Counted { records, counts: Vec::with_capacity(100_000) };
        let mut coupling = Coupling::new(settings, end, &mut dem, &mut fem);
        coupling.limits = Limits::of(&scene).unwrap();
        coupling.run(&mut counted, &mut |_| Ok(())).unwrap();
        // It falls in long windows, and touches in more than five hundred.
        assert!(counted.counts.len() > 500);
        let grown = counted.counts.windows(2).position(|pair| pair[0] != pair[1]);
        assert_eq!(grown, None, "{sets:?}: {:?}", counted.counts.last().unwrap() - counted.counts[0]);
    }
}

/// The transport itself keeps a count of the borrowers of each request in memory of its own, 48 bytes
/// that come and go with the request (iceoryx2 0.10, `ChunkMutSharedState`). Nothing else may be added.
#[test]
fn over_shared_memory_only_the_transport_allocates_once_per_request() {
    let bench = Bench::new();
    // Field files are not asked for: writing one allocates, and is counted.
    let sets = ["end_time=0.75", "coupling.scheme=strong", "coupling.time_window=2e-4"];
    let words = sets.iter().flat_map(|set| ["--set", set]).chain(["--force"]).collect::<Vec<_>>();
    // Where an answer takes more than 0.1 s, as a machine with other work may have it, the coupler looks whether its
    // partners live: the transport then reads its list of nodes, some thousand allocations. A run without one counts.
    let above = || {
        let ended = bench.done(&scene("walenstadt-compare"), "out", &words);
        let cost = &ended.summary()["cost"];
        let count = |process: &str| {
            cost["processes"][process]["counts"]["allocations_after_first_window"].as_u64().unwrap()
        };
        assert_eq!((count("dem"), count("fem")), (0, 0));
        let (made, exchanges) = (count("coupler"), cost["exchanges"].as_u64().unwrap());
        // Less those of the first window: the transport is seen to be counted at all.
        assert!(made > exchanges - 100, "{made} allocations in {exchanges} exchanges");
        made.saturating_sub(exchanges)
    };
    let mut tried = Vec::new();
    while tried.last() != Some(&0) && tried.len() < 10 {
        tried.push(above());
    }
    assert_eq!(tried.last(), Some(&0), "allocations beyond one for each exchange: {tried:?}");
}
