//! Forty lies of a structure and forty of a contact solver, half of which begin late: what `conform` says of each, and what becomes of a run.
//!
//! A run with a lie is ended with its clause, or its energy error makes it unreliable, or its result is right to 5 %. What nothing can
//! reveal stands in the tables with the reason.

use super::common::honest::{Ball, NODES, Net, swing};
use coupler::conform::{Judged, conform, text};
use coupler::coupling::{Committed, Coupling, Observer};
use coupler::guard::Outcome;
use coupler::settings::{CouplingSettings, Scheme};
use coupler::side::Side;
use in_process::InProcess;
use interface_defs::solver::OnProgress;
use interface_defs::*;
use toolkit::limits::Limits;

/// What a liar does to what goes in and comes out of an honest solver.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Lie {
    /// The window is longer or shorter by this factor.
    Clock(f64),
    IgnoresLength,
    Forgets,
    NeverCommits,
    /// A new window is taken for the commit of the one before.
    CommitsByNumber,
    /// What was solved first in a window is committed, not what was solved last.
    CommitsFirst,
    /// A field of the answer, all of it.
    Gives(&'static str, f64),
    /// The z component alone.
    GivesZ(&'static str, f64),
    Noise(&'static str, f64),
    /// At the place of the next node.
    Beside(&'static str),
    /// As it was in the solve before.
    Before(&'static str),
    /// The samples in reverse.
    Reversed(&'static str),
    /// What comes in, all of it.
    Takes(&'static str, f64),
    TakesZ(&'static str, f64),
    TakesBeside(&'static str),
    TakesBefore(&'static str),
    /// The first part of the window alone counts.
    TakesFirst(&'static str),
    /// Gauges with this role.
    Tells(Role, f64),
    TellsNothing(Role),
    /// Force and the work of it, both.
    ForceAndWork(f64),
    Nan(&'static str),
    NanGauge,
    /// Smallest and largest are those of something else.
    Range,
    /// The motion of bodies is not that of the committed state.
    Frozen,
    Masses(f64),
    EqualMasses,
    HeldMasses,
    FreeHeld,
    Displaced,
    Short,
    OtherScene,
    /// Its mesh has other nodes.
    OtherMesh,
    Fails,
}

use Lie::*;

struct Liar<S> {
    honest: S,
    lie: Lie,
    /// Windows that are committed before it begins.
    after: u64,
    commits: u64,
    solves: u64,
    window: f64,
    takes: Layout,
    gives: Layout,
    gauges: Vec<Gauge>,
    before: Vec<f64>,
    came: Vec<f64>,
    number: u64,
}

impl<S: Solver> Liar<S> {
    fn new(honest: S, lie: Lie, after: u64) -> Self {
        let (takes, gives) = (Layout::default(), Layout::default());
        let (before, came) = (Vec::new(), Vec::new());
        Self {
            honest,
            lie,
            after,
            commits: 0,
            solves: 0,
            window: 0.0,
            takes,
            gives,
            gauges: Vec::new(),
            before,
            came,
            number: 0,
        }
    }

    fn lies(&self) -> bool {
        self.commits >= self.after
    }

    /// All samples of a field.
    fn places(layout: &Layout, what: &str) -> Vec<std::ops::Range<usize>> {
        let fields = layout.fields().filter(|field| field.name == what);
        fields
            .flat_map(|field| {
                (0..field.sample_count()).filter_map(|i| layout.sample(what, field.sampling, i))
            })
            .collect()
    }

    fn distort_input(&self, input: &[f64]) -> Vec<f64> {
        let mut input = input.to_vec();
        match self.lie {
            Takes(what, factor) => {
                Self::places(&self.takes, what)
                    .into_iter()
                    .for_each(|p| input[p].iter_mut().for_each(|x| *x *= factor));
            }
            TakesZ(what, factor) => Self::places(&self.takes, what)
                .into_iter()
                .for_each(|p| input[p].iter_mut().skip(2).step_by(3).for_each(|x| *x *= factor)),
            TakesBeside(what) => {
                Self::places(&self.takes, what).into_iter().for_each(|p| input[p].rotate_left(3))
            }
            TakesBefore(what) if self.came.len() == input.len() => Self::places(&self.takes, what)
                .into_iter()
                .for_each(|p| input[p.clone()].copy_from_slice(&self.came[p])),
            TakesFirst(what) => {
                let places = Self::places(&self.takes, what);
                places.iter().skip(1).for_each(|p| input.copy_within(places[0].clone(), p.start));
            }
            _ => {}
        }
        input
    }

    fn distort_output(&self, output: &mut [f64]) {
        let gauges = self.gives.gauges().start;
        let scale = |output: &mut [f64], what, factor: f64| {
            for place in Self::places(&self.gives, what) {
                output[place].iter_mut().for_each(|x| *x *= factor);
            }
        };
        let tell = |output: &mut [f64], role, factor: f64| {
            for (at, _) in self.gauges.iter().enumerate().filter(|(_, gauge)| gauge.role == role) {
                output[gauges + 3 * at..gauges + 3 * at + 3].iter_mut().for_each(|x| *x *= factor);
            }
        };
        match self.lie {
            Gives(what, factor) => scale(output, what, factor),
            GivesZ(what, factor) => Self::places(&self.gives, what)
                .into_iter()
                .for_each(|p| output[p].iter_mut().skip(2).step_by(3).for_each(|x| *x *= factor)),
            Noise(what, size) => scale(output, what, 1.0 + size * swing(self.solves)),
            Beside(what) => {
                Self::places(&self.gives, what).into_iter().for_each(|p| output[p].rotate_left(3))
            }
            Before(what) if self.before.len() == output.len() => Self::places(&self.gives, what)
                .into_iter()
                .for_each(|p| output[p.clone()].copy_from_slice(&self.before[p])),
            Reversed(what) => {
                let places = Self::places(&self.gives, what);
                let all: Vec<Vec<f64>> = places.iter().map(|p| output[p.clone()].to_vec()).collect();
                places
                    .into_iter()
                    .zip(all.iter().rev())
                    .for_each(|(p, numbers)| output[p].copy_from_slice(numbers));
            }
            Tells(role, factor) => tell(output, role, factor),
            TellsNothing(role) => tell(output, role, 0.0),
            ForceAndWork(factor) => {
                scale(output, name::FORCE, factor);
                tell(output, Role::Received, factor);
            }
            Nan(what) => output[Self::places(&self.gives, what)[0].start + 2] = f64::NAN,
            NanGauge => output[gauges] = f64::NAN,
            Range => output[gauges..]
                .chunks_exact_mut(3)
                .for_each(|gauge| (gauge[1], gauge[2]) = (gauge[0] + 1.0, gauge[0] + 2.0)),
            Frozen if self.before.len() == output.len() => {
                output[gauges..].copy_from_slice(&self.before[gauges..]);
            }
            _ => {}
        }
    }
}

impl<S: Solver> Solver for Liar<S> {
    fn hello(&self) -> Hello {
        let mut hello = self.honest.hello();
        if self.lie == OtherScene {
            hello.scene = "fnv1a64:2".into();
        }
        hello
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        let mut ready = self.honest.prepare(plan, progress)?;
        self.window = plan.window;
        self.takes = Layout::new(&plan.takes, &ready.mesh, 0);
        self.gives = Layout::new(&plan.gives, &ready.mesh, ready.gauges.len());
        self.gauges.clone_from(&ready.gauges);
        let masses = &mut ready.mesh.masses;
        match self.lie {
            Masses(factor) => masses.iter_mut().for_each(|mass| *mass *= factor),
            EqualMasses => {
                masses.iter_mut().enumerate().for_each(|(node, mass)| *mass *= 1.0 + 0.5 * (node % 2) as f64)
            }
            HeldMasses => masses.iter_mut().for_each(|mass| *mass = mass.min(1.0)),
            FreeHeld => masses[NODES / 2] = f64::INFINITY,
            Displaced => Self::places(&self.gives, name::DISPLACEMENT)
                .into_iter()
                .for_each(|p| ready.initial[p].iter_mut().for_each(|u| *u = 0.05)),
            Short => ready.initial.truncate(self.gives.gauges().start),
            OtherMesh => {
                ready.mesh.coordinates.truncate(3 * (NODES - 1));
                ready.mesh.masses.truncate(NODES - 1);
            }
            _ => {}
        }
        self.before.clone_from(&ready.initial);
        Ok(ready)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.solves += 1;
        if !self.lies() {
            self.number = window.number;
            self.honest.solve(window, input, output)?;
            self.before = output.to_vec();
            self.came = input.to_vec();
            return Ok(());
        }
        let mut window = *window;
        match self.lie {
            Clock(factor) => window.length *= factor,
            IgnoresLength => window.length = self.window,
            Forgets => self.honest.commit()?,
            CommitsByNumber if self.number != window.number && self.solves > 1 => self.honest.commit()?,
            CommitsFirst if self.number == window.number && window.iteration > 1 => {
                // The first solve stands: later ones are answered, and leave no state.
                let mut other = output.to_vec();
                self.honest.solve(&window, &self.distort_input(input), output)?;
                other.copy_from_slice(output);
                self.honest.solve(&window, &self.came.clone(), output)?;
                output.copy_from_slice(&other);
                return Ok(());
            }
            Fails if self.solves.is_multiple_of(3) => return Err(Fault::window("no reason")),
            _ => {}
        }
        if self.number != window.number {
            self.came = input.to_vec();
        }
        self.number = window.number;
        let distorted = self.distort_input(input);
        self.honest.solve(&window, &distorted, output)?;
        let honest = output.to_vec();
        self.distort_output(output);
        self.before = honest;
        if matches!(self.lie, TakesBefore(_)) {
            self.came = input.to_vec();
        }
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        let lies = self.lies();
        self.commits += 1;
        match self.lie {
            NeverCommits | CommitsByNumber if lies => Ok(()),
            _ => self.honest.commit(),
        }
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        self.honest.finish()
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

const WINDOW: f64 = 1e-3;
const END: f64 = 0.12;

fn settings(scheme: Scheme) -> (CouplingSettings, f64) {
    let strong = CouplingSettings {
        tolerance: 1e-6,
        absolute_tolerance: 1e-9,
        max_iterations: 40,
        ..CouplingSettings::new(scheme, WINDOW)
    };
    (CouplingSettings { samples: 2, scene: Some(super::common::SCENE.into()), ..strong }, END)
}

/// How a run has ended: with a message, with its energy error, and the lowest place of the ball [m].
#[derive(Debug)]
enum Ended {
    Named(&'static str),
    Failed(String),
    Unreliable(f64),
    Done(f64),
}

fn run<D: Solver, F: Solver>(dem: D, fem: F, lowest: impl Fn(&D) -> f64) -> Ended {
    let (settings, end) = settings(Scheme::Strong);
    let (mut dem, mut fem) = (InProcess::new("dem", dem), InProcess::new("fem", fem));
    let mut coupling = Coupling::new(settings, end, &mut dem, &mut fem);
    coupling.limits = Limits::default();
    let ended = coupling.run(&mut Silent, &mut |_| Ok(()));
    let error = coupling.balance.system.error().filter(|_| coupling.has_balance).unwrap_or(0.0);
    let most = coupling.limits.energy_error;
    let finished = coupling.finish();
    match ended {
        Err(coupler::coupling::CouplingError::Failed(Failure::Contract { clause: Some(clause), .. })) => {
            Ended::Named(clause)
        }
        Err(error) => Ended::Failed(error.to_string()),
        Ok(()) if error > most => Ended::Unreliable(error),
        Ok(()) => {
            finished.expect("in order");
            Ended::Done(lowest(&dem.solver))
        }
    }
}

fn ball() -> Ball {
    Ball::new(true, true)
}

fn net() -> Net {
    Net::new(false, true)
}

fn conforms(
    of: &str,
    dem: &mut dyn Participant,
    fem: &mut dyn Participant,
    scheme: Scheme,
) -> Result<Vec<Judged>, String> {
    conform(of, settings(scheme), (dem, fem)).map_err(|error| error.to_string())
}

fn broken(judged: &[Judged]) -> Vec<&'static str> {
    judged.iter().filter(|judged| judged.outcome == Outcome::Broken).map(|judged| judged.clause).collect()
}

/// What becomes of a run with a lie.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Run {
    /// It is ended with this clause.
    Named(&'static str),
    /// It is ended with another message that names the solver, its windows or its energy.
    Failed,
    /// Its energy error is beyond the bound.
    Unreliable,
    /// It is done, and right to 5 %.
    Right,
    /// It is done and wrong, and nothing can reveal it: what it cannot be told from.
    Unseen(&'static str),
}

use Run::*;

/// A lie; the clause that `conform` says is broken (empty: none), and what becomes of a run, where it begins at once and after 40 windows.
type Row = (Lie, [&'static str; 2], [Run; 2]);

const STRUCTURE: &[Row] = &[
    (Clock(1.05), ["5.9", "5.9"], [Named("5.9"), Named("5.9")]),
    (Clock(0.5), ["5.11", "5.9"], [Named("5.11"), Named("5.9")]),
    (IgnoresLength, ["5.7", "5.7"], [Named("5.7"), Named("5.7")]),
    (Forgets, ["5.5", "5.5"], [Named("5.5"), Named("5.5")]),
    (NeverCommits, ["5.6", "5.6"], [Named("5.6"), Named("5.6")]),
    (CommitsByNumber, ["5.6", "5.6"], [Right, Right]),
    (CommitsFirst, ["5.9", "5.6"], [Named("5.9"), Named("5.6")]),
    (Gives(name::DISPLACEMENT, 1.1), ["5.9", "5.9"], [Named("5.9"), Named("5.9")]),
    (Gives(name::VELOCITY, 0.0), ["5.9", "5.9"], [Named("5.9"), Named("5.9")]),
    (Gives(name::VELOCITY, 1.2), ["5.11", "5.9"], [Named("5.11"), Named("5.9")]),
    (Gives(name::VELOCITY, -1.0), ["5.12", "5.9"], [Named("5.12"), Named("5.9")]),
    (GivesZ(name::DISPLACEMENT, 0.0), ["5.12", "5.9"], [Named("5.12"), Named("5.9")]),
    (Noise(name::DISPLACEMENT, 1e-6), ["5.8", "5.5"], [Named("5.8"), Named("5.5")]),
    (Noise(name::VELOCITY, 0.01), ["5.8", "5.5"], [Named("5.8"), Named("5.5")]),
    (Beside(name::DISPLACEMENT), ["5.6", "5.9"], [Named("5.6"), Named("5.9")]),
    (Before(name::VELOCITY), ["5.5", "5.8"], [Named("5.5"), Named("5.8")]),
    (Reversed(name::VELOCITY), ["5.3", "5.3"], [Named("5.3"), Named("5.3")]),
    (Takes(name::FORCE, 0.0), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Takes(name::FORCE, 0.5), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Takes(name::FORCE, 2.0), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Takes(name::FORCE, -1.0), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (TakesZ(name::FORCE, 0.0), ["", "5.12"], [Unseen("it is a net that is held in z"), Named("5.12")]),
    (TakesBeside(name::FORCE), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (TakesBefore(name::FORCE), ["5.5", "5.5"], [Named("5.5"), Named("5.5")]),
    (TakesFirst(name::FORCE), ["5.12", ""], [Named("5.12"), Right]),
    (Tells(Role::Received, 0.5), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (TellsNothing(Role::Stored), ["", ""], [Unreliable, Unreliable]),
    (Tells(Role::Kinetic, 2.0), ["", ""], [Right, Right]),
    (Nan(name::VELOCITY), ["4.3", "4.3"], [Named("4.3"), Named("4.3")]),
    (NanGauge, ["4.3", "4.3"], [Named("4.3"), Named("4.3")]),
    (Range, ["4.3", "4.3"], [Named("4.3"), Named("4.3")]),
    (Masses(2.0), ["5.11", "5.11"], [Named("5.11"), Named("5.11")]),
    (Masses(0.5), ["5.11", "5.11"], [Named("5.11"), Named("5.11")]),
    (Masses(1.05), ["", ""], [Right, Right]),
    (EqualMasses, ["5.11", "5.11"], [Named("5.11"), Named("5.11")]),
    (HeldMasses, ["", ""], [Right, Right]),
    (FreeHeld, ["5.10", "5.10"], [Named("5.10"), Named("5.10")]),
    (Displaced, ["5.4", "5.4"], [Named("5.4"), Named("5.4")]),
    (Short, ["5.3", "5.3"], [Named("5.3"), Named("5.3")]),
    (OtherScene, ["5.1", "5.1"], [Failed, Failed]),
    (OtherMesh, ["5.2", "5.2"], [Named("5.2"), Named("5.2")]),
    (Fails, ["4.1", "4.1"], [Failed, Failed]),
    (Frozen, ["5.5", "5.5"], [Named("5.5"), Named("5.5")]),
];

const CONTACT: &[Row] = &[
    (Clock(1.05), ["5.9", "5.9"], [Named("5.9"), Named("5.9")]),
    (Clock(0.5), ["5.9", "5.9"], [Named("5.9"), Named("5.9")]),
    (IgnoresLength, ["5.7", "5.7"], [Named("5.7"), Named("5.7")]),
    (Forgets, ["5.5", "5.9"], [Named("5.5"), Named("5.9")]),
    (NeverCommits, ["5.6", "5.6"], [Named("5.6"), Named("5.6")]),
    (CommitsByNumber, ["5.6", "5.6"], [Right, Right]),
    (CommitsFirst, ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (
        Gives(name::FORCE, 0.0),
        ["", "5.12"],
        [Unseen("it is a rock that hits something of its own, and no net"), Failed],
    ),
    (Gives(name::FORCE, 0.5), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Gives(name::FORCE, 2.0), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Gives(name::FORCE, -1.0), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (GivesZ(name::FORCE, 0.8), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (ForceAndWork(2.0), ["5.13", "5.12"], [Failed, Named("5.12")]),
    (ForceAndWork(-1.0), ["5.13", "5.13"], [Named("5.13"), Named("5.13")]),
    (ForceAndWork(1.2), ["5.13", "5.12"], [Unreliable, Named("5.12")]),
    (Noise(name::FORCE, 1e-6), ["5.8", "5.8"], [Named("5.8"), Named("5.8")]),
    (Noise(name::FORCE, 0.1), ["5.5", "5.5"], [Named("5.5"), Named("5.5")]),
    (Beside(name::FORCE), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Before(name::FORCE), ["5.5", "5.5"], [Named("5.5"), Named("5.5")]),
    (Reversed(name::FORCE), ["", ""], [Right, Right]),
    (Takes(name::DISPLACEMENT, 0.0), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Takes(name::DISPLACEMENT, 0.5), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Takes(name::DISPLACEMENT, -1.0), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (TakesBeside(name::DISPLACEMENT), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (TakesBefore(name::DISPLACEMENT), ["5.5", "5.5"], [Named("5.5"), Named("5.5")]),
    (TakesFirst(name::DISPLACEMENT), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (Clock(1.5), ["5.9", "5.9"], [Named("5.9"), Named("5.9")]),
    (GivesZ(name::FORCE, -1.0), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (TellsNothing(Role::Potential), ["", ""], [Failed, Unreliable]),
    (Tells(Role::Received, 0.5), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (TellsNothing(Role::Received), ["5.12", "5.12"], [Named("5.12"), Named("5.12")]),
    (TellsNothing(Role::Stored), ["", ""], [Unreliable, Unreliable]),
    (Tells(Role::Kinetic, 2.0), ["5.13", "5.13"], [Failed, Unreliable]),
    (Nan(name::FORCE), ["4.3", "4.3"], [Named("4.3"), Named("4.3")]),
    (NanGauge, ["4.3", "4.3"], [Named("4.3"), Named("4.3")]),
    (Range, ["4.3", "4.3"], [Named("4.3"), Named("4.3")]),
    (Frozen, ["5.5", "5.5"], [Named("5.5"), Named("5.5")]),
    (Short, ["5.2", "5.2"], [Named("5.2"), Named("5.2")]),
    (OtherScene, ["5.1", "5.1"], [Failed, Failed]),
    (OtherMesh, ["5.2", "5.2"], [Named("5.2"), Named("5.2")]),
    (Fails, ["4.1", "4.1"], [Failed, Failed]),
];

/// Of a contact solver that tells neither of motion nor of energy.
const BARE: &[Row] = &[
    (Clock(1.05), ["", ""], [Right, Right]),
    (Forgets, ["5.5", "5.5"], [Named("5.5"), Named("5.5")]),
    (NeverCommits, ["", ""], [Unseen("it is a rock that hangs in the air"), Right]),
    (
        Gives(name::FORCE, 0.5),
        ["", ""],
        [Unseen("it is a rock of half the stiffness and twice the mass"), Right],
    ),
    (
        Gives(name::FORCE, 2.0),
        ["", ""],
        [Unseen("it is a rock of twice the stiffness and half the mass"), Right],
    ),
    (Gives(name::FORCE, -1.0), ["5.13", "5.13"], [Named("5.13"), Named("5.13")]),
    (Noise(name::FORCE, 1e-6), ["5.8", "5.8"], [Named("5.8"), Named("5.8")]),
    (Beside(name::FORCE), ["", ""], [Unseen("it is a rock that falls beside"), Right]),
    (Takes(name::DISPLACEMENT, 0.0), ["", ""], [Unseen("it is a load that depends on time alone"), Right]),
    (Takes(name::DISPLACEMENT, 0.5), ["", ""], [Unseen("it is a rock of another shape"), Right]),
];

/// Windows that are committed before a lie begins that begins late.
const LATE: [u64; 2] = [0, 40];

fn tell(
    rows: &[Row],
    truth: f64,
    examine: impl Fn(Lie, u64) -> Result<Vec<Judged>, String>,
    go: impl Fn(Lie, u64) -> Ended,
) {
    for (lie, clauses, runs) in rows {
        for at in 0..2 {
            let judged = examine(*lie, LATE[at]).unwrap_or_else(|e| panic!("{lie:?}: {e}"));
            let (all, due) = (broken(&judged), clauses[at]);
            let agrees = if due.is_empty() { all.is_empty() } else { all.contains(&due) };
            assert!(
                agrees,
                "{lie:?} after {} windows: {due} is not in {all:?}:\n{}",
                LATE[at],
                text(&judged)
            );
            let ended = go(*lie, LATE[at]);
            let agrees = match (&ended, runs[at]) {
                (Ended::Named(clause), Named(due)) => *clause == due,
                (Ended::Failed(why), Failed) => !why.is_empty(),
                (Ended::Unreliable(error), Unreliable) => *error > Limits::default().energy_error,
                (Ended::Done(lowest), Right) => (lowest / truth - 1.0).abs() <= 0.05,
                (Ended::Done(lowest), Unseen(why)) => (lowest / truth - 1.0).abs() > 0.05 && !why.is_empty(),
                _ => false,
            };
            assert!(agrees, "{lie:?} after {} windows: {:?} is not {ended:?}", LATE[at], runs[at]);
        }
    }
}

fn truth() -> f64 {
    let Ended::Done(lowest) = run(ball(), net(), |ball| ball.lowest) else { panic!("an honest run fails") };
    lowest
}

#[test]
fn forty_lies_of_a_structure_are_named_or_make_the_run_unreliable_or_harm_nothing() {
    assert!(STRUCTURE.len() >= 40);
    let liar = |lie, after| Liar::new(net(), lie, after);
    let judge = |lie, after| {
        let (mut dem, mut fem) = (InProcess::new("dem", ball()), InProcess::new("fem", liar(lie, after)));
        conforms("fem", &mut dem, &mut fem, Scheme::Strong)
    };
    tell(STRUCTURE, truth(), judge, |lie, after| run(ball(), liar(lie, after), |ball| ball.lowest));
}

#[test]
fn forty_lies_of_a_contact_solver_are_named_or_make_the_run_unreliable_or_harm_nothing() {
    assert!(CONTACT.len() >= 40);
    for (rows, tells) in [(CONTACT, true), (BARE, false)] {
        let liar = |lie, after| Liar::new(Ball::new(tells, tells), lie, after);
        let judge = |lie, after| {
            let (mut dem, mut fem) = (InProcess::new("dem", liar(lie, after)), InProcess::new("fem", net()));
            conforms("dem", &mut dem, &mut fem, Scheme::Strong)
        };
        tell(rows, truth(), judge, |lie, after| run(liar(lie, after), net(), |liar| liar.honest.lowest));
    }
}

#[test]
fn who_does_not_lie_is_believed() {
    for samples in [1, 5] {
        for (leapfrog, tells) in [(false, true), (true, true), (false, false), (true, false)] {
            for scheme in [Scheme::Strong, Scheme::Weak] {
                for ball in [
                    Ball::new(true, true),
                    Ball::new(true, false),
                    Ball::new(false, true),
                    Ball::new(false, false),
                ] {
                    let (mut settings, end) = settings(scheme);
                    settings.samples = samples;
                    for of in ["dem", "fem"] {
                        let (mut dem, mut fem) = (
                            InProcess::new("dem", ball.clone()),
                            InProcess::new("fem", Net::new(leapfrog, tells)),
                        );
                        let judged = conform(of, (settings.clone(), end), (&mut dem, &mut fem))
                            .unwrap_or_else(|e| panic!("{e}"));
                        assert_eq!(
                            broken(&judged),
                            [""; 0],
                            "leapfrog {leapfrog}, {samples} samples, {scheme:?}:\n{}",
                            text(&judged)
                        );
                    }
                }
            }
        }
    }
}

/// A solver that cannot go back: what it has solved it is.
struct Once<S>(S);

impl<S: Solver> Solver for Once<S> {
    fn hello(&self) -> Hello {
        Hello { repeats: None, ..self.0.hello() }
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        self.0.prepare(plan, progress)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.0.solve(window, input, output)?;
        self.0.commit()
    }

    fn commit(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        self.0.finish()
    }
}

#[test]
fn who_says_that_it_cannot_repeat_a_window_is_asked_for_none_again() {
    for (of, tells) in [("dem", true), ("dem", false), ("fem", true)] {
        let (mut dem, mut fem) = (
            InProcess::new("dem", Once(Ball::new(tells, tells))),
            InProcess::new("fem", Once(Net::new(false, true))),
        );
        let judged = conforms(of, &mut dem, &mut fem, Scheme::Weak).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(broken(&judged), [""; 0], "{of}:\n{}", text(&judged));
        // Motion is watched in every window.
        let motion = judged.iter().find(|judged| judged.clause == "5.9").map(|judged| judged.outcome);
        assert_eq!(motion, Some(if tells { Outcome::Kept } else { Outcome::NotExamined }), "{of}");
    }
}
