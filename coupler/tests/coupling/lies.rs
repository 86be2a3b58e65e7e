//! Twelve structures that do other things than they say: each is named with its clause of `PROTOCOL.md`, or harms nothing.

use coupler::coupling::{Committed, Coupling, CouplingError, Observer};
use coupler::guard::clause;
use coupler::records::{Records, describe};
use coupler::settings::{CouplingSettings, Scheme};
use coupler::side::Side;
use in_process::InProcess;
use interface_defs::diagnostic::code;
use interface_defs::solver::OnProgress;
use interface_defs::verdict::{Ending, Fate, Verdict};
use interface_defs::*;
use toolkit::output::Output;
use toolkit::scene::Scene;
use toolkit::summary::{RunStatus, Summary};

#[derive(Debug, Clone, Copy, PartialEq)]
enum Lie {
    None,
    IgnoresLength,
    ForgetsCommittedState,
    NeverCommits,
    ZeroVelocity,
    DisplacedStart,
    HeldNodesMove,
    WrongMasses,
    HalfTheForce,
    WrongMesh,
    WrongSamples,
    WrongScene,
    RepeatsRoughly,
    /// A gauge with the name of one of the other solver.
    TakenGauge,
    /// A measure with the name of one of the other solver, and a verdict on its rock.
    TakenMeasure,
}

/// Two masses on springs and a held node between them, along x. Position Verlet under the mean force of each part.
#[derive(Clone)]
struct Net {
    lie: Lie,
    /// Velocity at t = 0 [m/s].
    thrown: f64,
    repeats: Option<f64>,
    samples: usize,
    window: f64,
    committed: State,
    trial: State,
    solves: u32,
}

#[derive(Clone, Copy, Default, PartialEq, Debug)]
struct State {
    u: [f64; NODES],
    v: [f64; NODES],
    received: f64,
}

const NODES: usize = 3;
const MASS: f64 = 2.0;
const SPRING: f64 = 2000.0;
const HELD: usize = 1;
const WINDOW: f64 = 1e-3;
const SCENE: &str = "fnv1a64:1";
const STEPS: usize = 4;

impl Net {
    fn new(lie: Lie, repeats: Option<f64>) -> Self {
        let (committed, trial) = (State::default(), State::default());
        Self { lie, thrown: 0.0, repeats, samples: 1, window: 0.0, committed, trial, solves: 0 }
    }

    fn fields(&self, state: &State, sample: usize, out: &mut [f64]) {
        let half = 3 * NODES * self.samples;
        for node in 0..NODES {
            let at = 3 * (sample * NODES + node);
            out[at] = state.u[node];
            out[half + at] = if self.lie == Lie::ZeroVelocity { 0.0 } else { state.v[node] };
        }
    }

    /// One step of `h` [s] under `force`.
    fn step(&self, state: &mut State, h: f64, force: &[f64; NODES]) {
        for node in 0..NODES {
            if node == HELD && self.lie != Lie::HeldNodesMove {
                continue;
            }
            let force = if self.lie == Lie::HalfTheForce { 0.5 * force[node] } else { force[node] };
            let before = state.u[node];
            let middle = before + 0.5 * h * state.v[node];
            state.v[node] += h * (force - SPRING * middle) / MASS;
            state.u[node] = middle + 0.5 * h * state.v[node];
            state.received += force * (state.u[node] - before);
        }
    }
}

impl Solver for Net {
    fn hello(&self) -> Hello {
        let many = |name, sampling| FieldSpec { samples: 8, ..FieldSpec::nodal(name, 3, sampling) };
        Hello {
            program: format!("net ({:?})", self.lie),
            scene: if self.lie == Lie::WrongScene { "fnv1a64:2".into() } else { SCENE.into() },
            repeats: self.repeats,
            // Eight windows of the scene are what it takes to distinguish wrong masses from half a kick at the start.
            largest_window: 8.0 * WINDOW,
            takes: vec![many(name::FORCE, Sampling::Means)],
            gives: vec![many(name::DISPLACEMENT, Sampling::AtEnds), many(name::VELOCITY, Sampling::AtEnds)],
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        self.samples = plan.gives[0].samples as usize;
        self.window = plan.window;
        let reported = if self.lie == Lie::WrongMasses { 1.0 } else { MASS };
        let mut masses = vec![reported; NODES];
        masses[HELD] = f64::INFINITY;
        let mut coordinates: Vec<f64> = (0..NODES).flat_map(|n| [n as f64, 0.0, 0.0]).collect();
        if self.lie == Lie::WrongMesh {
            coordinates.truncate(6);
            masses.truncate(2);
        }
        let gauge = if self.lie == Lie::TakenGauge { "energy_received_pull" } else { "energy_received_net" };
        let gauges = vec![Gauge { role: Role::Received, ..Gauge::new(gauge, "J") }];
        let mut initial = vec![0.0; 6 * NODES * self.samples + 3];
        self.committed.v = [self.thrown, 0.0, 0.0];
        (0..self.samples).for_each(|sample| self.fields(&self.committed, sample, &mut initial));
        if self.lie == Lie::DisplacedStart {
            self.committed.u = [0.1, 0.0, 0.1];
        }
        let mesh = InterfaceMesh { coordinates, masses, ..Default::default() };
        Ok(Ready { mesh, gauges, initial, ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.solves += 1;
        let mut state = if self.lie == Lie::ForgetsCommittedState { self.trial } else { self.committed };
        let length = if self.lie == Lie::IgnoresLength { self.window } else { window.length };
        for sample in 0..self.samples {
            let force = std::array::from_fn(|node| input[3 * (sample * NODES + node)]);
            for _ in 0..STEPS {
                self.step(&mut state, length / (STEPS * self.samples) as f64, &force);
            }
            self.fields(&state, sample, output);
        }
        if self.lie == Lie::WrongSamples {
            (0..self.samples).for_each(|sample| self.fields(&state, sample, output));
        }
        if self.lie == Lie::RepeatsRoughly {
            let noise = 1.0 + NOISE * f64::from(self.solves % 7);
            state.v.iter_mut().for_each(|v| *v *= noise);
            self.fields(&state, self.samples - 1, output);
        }
        self.trial = state;
        let gauges = output.len() - 3;
        output[gauges..].fill(state.received);
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        if self.lie != Lie::NeverCommits {
            self.committed = self.trial;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        if self.lie == Lie::TakenMeasure {
            return Ok(report());
        }
        Ok(Statistics::default())
    }
}

/// Relative noise of who repeats only roughly.
const NOISE: f64 = 1e-7;

/// A measure and a verdict.
fn report() -> Statistics {
    let ending =
        Ending { fate: Fate::StillMoving, time: 1.0, position: [0.0; 3], speed: 1.0, on_terrain: false };
    Statistics {
        measures: vec![Measure::new("max_travel", 1.0, "m")],
        verdicts: vec![Verdict::of("point", ending)],
        ..Statistics::default()
    }
}

/// Pulls every node towards a point that swings.
#[derive(Default)]
struct Pull {
    samples: usize,
    received: f64,
    trial: f64,
}

impl Solver for Pull {
    fn hello(&self) -> Hello {
        let many = |name, sampling| FieldSpec { samples: 8, ..FieldSpec::nodal(name, 3, sampling) };
        Hello {
            program: "pull".into(),
            repeats: Some(0.0),
            takes: vec![many(name::DISPLACEMENT, Sampling::FromStart)],
            gives: vec![many(name::FORCE, Sampling::Means)],
            ..Hello::default()
        }
    }
    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mesh = plan.partner_mesh.clone().unwrap_or_default();
        self.samples = plan.gives[0].samples as usize;
        let gauges = vec![Gauge { role: Role::Received, ..Gauge::new("energy_received_pull", "J") }];
        let initial = vec![0.0; Layout::new(&plan.gives, &mesh, 1).len()];
        Ok(Ready { mesh, gauges, initial, ..Ready::default() })
    }
    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let numbers = input.len() / (self.samples + 1);
        let part = window.length / self.samples as f64;
        self.trial = self.received;
        for sample in 0..self.samples {
            let time = window.start + part * (sample as f64 + 0.5);
            for i in 0..numbers {
                let (from, to) = (input[sample * numbers + i], input[(sample + 1) * numbers + i]);
                let point = if i % 3 == 0 { 0.01 * (20.0 * time).sin() } else { 0.0 };
                let force = 500.0 * (point - 0.5 * (from + to));
                output[sample * numbers + i] = force;
                self.trial -= force * (to - from);
            }
        }
        let gauges = output.len() - 3;
        output[gauges..].fill(self.trial);
        Ok(())
    }
    fn commit(&mut self) -> Result<(), Fault> {
        self.received = self.trial;
        Ok(())
    }
    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(report())
    }
}

struct Silent;

impl Observer for Silent {
    fn prepared(&mut self, _: &Side, _: &Side, _: &[Diagnostic]) -> Result<(), Diagnostic> {
        Ok(())
    }
    fn committed(&mut self, _: &Committed) -> Result<(), Diagnostic> {
        Ok(())
    }
}

/// The state at the end, or the message.
fn run(net: Net, scheme: Scheme, samples: u32) -> Result<State, String> {
    let (mut dem, mut fem) = (InProcess::new("dem", Pull::default()), InProcess::new("fem", net));
    let mut settings = CouplingSettings { samples, ..CouplingSettings::new(scheme, WINDOW) };
    settings.scene = Some(SCENE.into());
    // The last window is shorter than the others.
    let mut coupling = Coupling::new(settings, 50.5 * WINDOW, &mut dem, &mut fem);
    coupling.run(&mut Silent, &mut |_| Ok(())).map_err(|e| e.to_string())?;
    coupling.finish().map_err(|e| e.to_string())?;
    Ok(fem.solver.trial)
}

fn named(net: Net, scheme: Scheme, samples: u32, clause: &str) {
    let lie = net.lie;
    let message = match run(net, scheme, samples) {
        Err(message) => message,
        Ok(_) => panic!("{lie:?}, {scheme:?}: nobody noticed"),
    };
    println!("{lie:?}: {message}");
    assert!(message.contains(&format!("PROTOCOL.md, clause {clause})")), "{lie:?}, {scheme:?}: {message}");
    assert!(message.contains("fem"), "{lie:?}: {message}");
}

#[test]
fn twelve_lies_of_a_structure_that_can_be_examined_are_named_by_their_clauses() {
    for (lie, clause) in [
        (Lie::IgnoresLength, clause::LENGTH),
        (Lie::ForgetsCommittedState, clause::COMMITTED),
        (Lie::NeverCommits, clause::COMMIT),
        (Lie::ZeroVelocity, clause::VELOCITY),
        (Lie::DisplacedStart, clause::INITIAL),
        (Lie::HeldNodesMove, clause::HELD),
        (Lie::WrongMasses, clause::MASSES),
        (Lie::HalfTheForce, clause::FORCE),
        (Lie::WrongMesh, clause::MESH),
        (Lie::WrongSamples, clause::SAMPLES),
        (Lie::WrongScene, clause::SCENE),
        (Lie::RepeatsRoughly, clause::REPEATS),
    ] {
        named(Net::new(lie, Some(0.0)), Scheme::Strong, 2, clause);
        named(Net::new(lie, Some(0.0)), Scheme::Weak, 2, clause);
    }
    // A net that moves at t = 0.
    for (lie, clause) in
        [(Lie::IgnoresLength, clause::LENGTH), (Lie::ForgetsCommittedState, clause::COMMITTED)]
    {
        named(Net { thrown: 5.0, ..Net::new(lie, Some(0.0)) }, Scheme::Strong, 1, clause);
    }
}

/// Who says that it cannot repeat a window is not asked for one: what it does in the run shows the lie.
#[test]
fn lies_of_a_structure_that_cannot_repeat_show_in_the_run() {
    for samples in [1, 2] {
        for (lie, clause) in [
            (Lie::IgnoresLength, clause::LENGTH),
            (Lie::NeverCommits, clause::COMMIT),
            (Lie::ZeroVelocity, clause::VELOCITY),
            (Lie::DisplacedStart, clause::INITIAL),
            (Lie::HalfTheForce, clause::FORCE),
            (Lie::WrongMesh, clause::MESH),
            (Lie::WrongScene, clause::SCENE),
        ] {
            named(Net::new(lie, None), Scheme::Weak, samples, clause);
        }
    }
    named(Net::new(Lie::WrongSamples, None), Scheme::Weak, 2, clause::VELOCITY);
}

/// What is left of the twelve, where no window is repeated: the coupler uses neither masses nor held nodes, and a state that is
/// forgotten between two solves of a window is forgotten nowhere.
#[test]
fn lies_that_do_not_show_harm_nothing() {
    let truth = run(Net::new(Lie::None, None), Scheme::Weak, 2).expect("no lie");
    for lie in [Lie::ForgetsCommittedState, Lie::WrongMasses] {
        assert_eq!(run(Net::new(lie, None), Scheme::Weak, 2).as_ref(), Ok(&truth), "{lie:?}: the same bytes");
    }
    let rough = run(Net::new(Lie::RepeatsRoughly, None), Scheme::Weak, 2).expect("not noticed");
    // At most six times the noise in each of 51 windows.
    let most = 6.0 * NOISE * 51.0;
    let apart = (rough.u[0] / truth.u[0] - 1.0).abs();
    assert!(apart > 0.0 && apart < most, "{apart:e}, at most {most:e}");
}

#[test]
fn who_does_not_lie_is_believed_and_left_as_it_was() {
    for samples in [1, 2, 5] {
        for thrown in [0.0, 5.0] {
            let net = |repeats| Net { thrown, ..Net::new(Lie::None, repeats) };
            let unasked = run(net(None), Scheme::Weak, samples).expect("true");
            assert_eq!(
                run(net(Some(0.0)), Scheme::Weak, samples),
                Ok(unasked),
                "the probe leaves nothing behind"
            );
            run(net(Some(0.0)), Scheme::Strong, samples).expect("true");
            // Noise below what it promises.
            let rough = Net { lie: Lie::RepeatsRoughly, ..net(Some(1e-5)) };
            run(rough, Scheme::Strong, samples).expect("as good as it says");
        }
    }
}

#[test]
fn a_gauge_with_the_name_of_one_of_the_other_solver_is_refused_before_the_start_and_both_are_named() {
    let net = Net::new(Lie::TakenGauge, Some(0.0));
    let (mut dem, mut fem) = (InProcess::new("dem", Pull::default()), InProcess::new("fem", net));
    let mut coupling =
        Coupling::new(CouplingSettings::new(Scheme::Weak, WINDOW), 5.0 * WINDOW, &mut dem, &mut fem);
    let error = coupling.run(&mut Silent, &mut |_| Ok(())).expect_err("the name is taken");
    let CouplingError::Failed(failure) = &error else { panic!("{error}") };
    assert!(failure.is_input(), "exit code 2");
    let why = Diagnostic::from(&error);
    assert_eq!(why.code, code::NAME_TAKEN);
    for part in ["dem (pull)", "fem (net (TakenGauge))", "energy_received_pull_J"] {
        assert!(why.message.contains(part), "{why}");
    }
    assert_eq!(fem.solver.solves, 0);
}

#[test]
fn a_measure_and_a_verdict_that_both_solvers_give_fail_the_run_and_name_both() {
    let ended = |lie| {
        let dir = tempfile::tempdir().expect("a directory");
        let net = Net::new(lie, Some(0.0));
        let (mut dem, mut fem) = (InProcess::new("dem", Pull::default()), InProcess::new("fem", net));
        let settings = CouplingSettings::new(Scheme::Weak, WINDOW);
        let mut coupling = Coupling::new(settings, 5.0 * WINDOW, &mut dem, &mut fem);
        let scene = Scene::from_text("s.toml", "end_time = 0.005").expect("TOML");
        let output = Output::of(&scene).expect("valid");
        let mut records = Records::new(dir.path(), 5.0 * WINDOW, &output, None);
        coupling.run(&mut records, &mut |_| Ok(())).expect("nothing is wrong in a window");
        let statistics = coupling.finish().expect("reported");
        let mut summary = Summary::new(RunStatus::Done);
        describe(&mut summary, &coupling, &records, Some(&statistics));
        summary
    };
    let summary = ended(Lie::None);
    assert_eq!((summary.status, summary.verdict.len()), (RunStatus::Done, 1));
    assert_eq!(summary.measure("max_travel"), Some(1.0));
    assert!(summary.measures.iter().all(|m| m.source == "dem (pull)"), "{:?}", summary.measures);
    let summary = ended(Lie::TakenMeasure);
    assert_eq!((summary.status, summary.reasons.len()), (RunStatus::Failed, 1));
    let why = &summary.reasons[0];
    assert_eq!(why.code, code::NAME_TAKEN);
    for part in ["max_travel", "`point`", "dem (pull)", "fem (net (TakenMeasure))"] {
        assert!(why.message.contains(part), "{why}");
    }
}
