//! A preCICE participant as the structure of a rockfall run: force goes to it, its motion comes back.
//!
//! The run is an implicit coupling of preCICE whose iterations are the solves of the coupler. Nobody knows at a solve whether it will be
//! the accepted one, so each is an iteration that does not converge: the datum `Iteration`, on which the one convergence measure
//! stands, is another number each time. A commit is one more iteration with the same force and the same number: it converges, and
//! shows how well the participant repeats the window.

use crate::join::enter;
use crate::names::Names;
use crate::{input, said};
use interface_defs::{
    Failure, Fault, FieldSpec, Hello, InterfaceMesh, Measure, OnProgress, Plan, Ready, Sampling, Solver,
    Statistics, Window, name,
};
use precice::Participant;
use rustix::process::{Pid, Signal, kill_process_group};
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// What says to preCICE whether a window is over.
const ITERATION: &str = "Iteration";

/// What preCICE is given to say itself that its partner is gone.
const GRACE: Duration = Duration::from_secs(1);

/// The structure.
pub struct StandIn {
    names: Names,
    force: String,
    at_end: bool,
    mesh: InterfaceMesh,
    start: Option<String>,
    repeats: f64,
    run: Option<Run>,
}

/// A run that has begun.
struct Run {
    it: Participant,
    child: Option<Started>,
    ids: Vec<i32>,
    plan: Plan,
    /// The number of [`ITERATION`], at every node.
    number: Vec<f64>,
    force: Vec<f64>,
    /// Displacement and velocity of the last solve.
    answer: [Vec<f64>; 2],
    data: [String; 2],
    /// Length of the window at hand [s], which preCICE cannot change.
    length: Option<f64>,
    /// Largest difference between a committed window and its solve, over the largest number of its field.
    differs: f64,
    windows: u64,
    iterations: u64,
}

impl StandIn {
    /// Of the participant `names`, for a structure with this mesh.
    pub fn new(
        names: Names,
        mesh: InterfaceMesh,
        start: Option<&str>,
        repeats: f64,
    ) -> Result<Self, Failure> {
        let found = Names::of(&names.writes, "Force").next().map(|(data, at_end)| (data.to_owned(), at_end));
        let (force, at_end) = found.ok_or_else(|| input(format!("{} writes no Force", names.participant)))?;
        if names.scheme.kind != "serial-implicit" || names.scheme.order[0] != names.participant {
            let what =
                format!("{} must be the first participant of a serial-implicit scheme", names.participant);
            return Err(input(what));
        }
        for (list, word) in
            [(&names.writes, ITERATION), (&names.reads, "Displacement"), (&names.reads, "Velocity")]
        {
            if Names::of(list, word).next().is_none() {
                return Err(input(format!("{} does not exchange {word}", names.participant)));
            }
        }
        Ok(Self { names, force, at_end, mesh, start: start.map(str::to_owned), repeats, run: None })
    }

    fn sampling(&self) -> Sampling {
        if self.at_end { Sampling::AtEnds } else { Sampling::Means }
    }

    fn begin(&self, plan: &Plan) -> Result<(Run, Vec<f64>), Failure> {
        let Names { scheme, .. } = &self.names;
        if scheme.window > 0.0 && (scheme.window - plan.window).abs() > 1e-9 * plan.window {
            let (ours, theirs) = (plan.window, scheme.window);
            return Err(input(format!(
                "coupling.time_window is {ours} s, <time-window-size> of preCICE {theirs} s"
            )));
        }
        if scheme.end_time < plan.end_time * (1.0 - 1e-9) {
            let (ours, theirs) = (plan.end_time, scheme.end_time);
            return Err(input(format!("end_time is {ours} s, <max-time> of preCICE {theirs} s")));
        }
        let child = self.start.as_deref().map(Started::new).transpose()?;
        let (it, ids) = enter(&self.names, &self.mesh)?;
        let nodes = self.mesh.node_count();
        let data = ["Displacement", "Velocity"].map(|word| {
            let (data, _) = Names::of(&self.names.reads, word).next().expect("checked at the start");
            data.to_owned()
        });
        let mut run = Run {
            it,
            child,
            ids,
            plan: plan.clone(),
            number: vec![0.0; nodes],
            force: vec![0.0; 3 * nodes],
            answer: [vec![0.0; 3 * nodes], vec![0.0; 3 * nodes]],
            data,
            length: None,
            differs: 0.0,
            windows: 0,
            iterations: 0,
        };
        run.it.initialize().map_err(said)?;
        let initial = run.read(&self.names, 0.0)?.concat();
        Ok((run, initial))
    }
}

impl Run {
    fn read(&self, names: &Names, at: f64) -> Result<[Vec<f64>; 2], Failure> {
        let mut both = self.answer.clone();
        for (data, values) in self.data.iter().zip(&mut both) {
            self.it.read_data(&names.mesh, data, &self.ids, at, values).map_err(said)?;
        }
        Ok(both)
    }

    /// One iteration with the force and the number at hand; whether the window has converged.
    fn iterate(&mut self, names: &Names, force: &str, length: f64) -> Result<bool, Failure> {
        self.it.requires_writing_checkpoint().map_err(said)?;
        self.it.write_data(&names.mesh, force, &self.ids, &self.force).map_err(said)?;
        self.it.write_data(&names.mesh, ITERATION, &self.ids, &self.number).map_err(said)?;
        // Of lengths that differ by rounding, preCICE takes its own alone.
        let whole = self.it.get_max_time_step_size().map_err(said)?;
        let length = if (whole - length).abs() < 1e-9 * length { whole } else { length };
        self.it.advance(length).map_err(said)?;
        self.iterations += 1;
        Ok(!self.it.requires_reading_checkpoint().map_err(said)?)
    }
}

fn fault(failure: Failure) -> Fault {
    match failure {
        Failure::Fault { fault, .. } => fault,
        other => Fault::broken(other.to_string()),
    }
}

impl Solver for StandIn {
    fn hello(&self) -> Hello {
        let at_end = |name| FieldSpec::nodal(name, 3, Sampling::AtEnds);
        let [first, second] = &self.names.scheme.order;
        let other = if *first == self.names.participant { second } else { first };
        Hello {
            program: format!("preCICE participant {other}"),
            repeats: Some(self.repeats),
            takes: vec![FieldSpec::nodal(name::FORCE, 3, self.sampling())],
            gives: vec![at_end(name::DISPLACEMENT), at_end(name::VELOCITY)],
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let (run, initial) = self.begin(plan).map_err(fault)?;
        self.run = Some(run);
        Ok(Ready { mesh: self.mesh.clone(), initial, ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, forces: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let (names, force) = (&self.names, &self.force);
        let run = self.run.as_mut().expect("prepared before the first window");
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9 * run.plan.window;
        let usual = near(window.length, run.plan.window) || near(window.end(), run.plan.end_time);
        let fits = run.length.map_or(usual, |length| length == window.length);
        if !fits {
            let what = format!(
                "a window of {} s: preCICE solves those of {} s, the last one as long as it must be, and cannot change the length of one that \
                 it has begun",
                window.length, run.plan.window
            );
            return Err(Fault::window(what));
        }
        run.length = Some(window.length);
        run.force.copy_from_slice(forces);
        run.number.iter_mut().for_each(|number| *number += 1.0);
        if run.iterate(names, force, window.length).map_err(fault)? {
            let what = format!(
                "preCICE accepts the window at t = {} s before the coupler does: its scheme needs one <absolute-convergence-measure \
                 data=\"{ITERATION}\" limit=\"0.5\"> and a <max-iterations> that is never reached",
                window.start
            );
            return Err(Fault::broken(what));
        }
        run.answer = run.read(names, window.length).map_err(fault)?;
        let [u, v] = &run.answer;
        output[..u.len()].copy_from_slice(u);
        output[u.len()..].copy_from_slice(v);
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        let (names, force) = (&self.names, &self.force);
        let run = self.run.as_mut().expect("prepared before the first window");
        let length = run.length.take().ok_or_else(|| Fault::broken("a commit without a solve"))?;
        if !run.iterate(names, force, length).map_err(fault)? {
            return Err(Fault::broken("preCICE goes on with a window that the coupler has accepted"));
        }
        let again = run.read(names, 0.0).map_err(fault)?;
        for (again, solved) in again.iter().zip(&run.answer) {
            let largest = solved.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
            let apart = again.iter().zip(solved).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            run.differs = run.differs.max(apart / largest);
        }
        run.windows += 1;
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let Some(mut run) = self.run.take() else { return Ok(Statistics::default()) };
        let mut statistics = Statistics::default();
        statistics.measures.push(Measure::new("participant_repeats_to", run.differs, "1"));
        statistics.counts =
            vec![("precice_windows".into(), run.windows), ("precice_iterations".into(), run.iterations)];
        if !run.it.is_coupling_ongoing().map_err(|e| fault(said(e)))? {
            run.it.finalize().map_err(|e| fault(said(e)))?;
            if let Some(child) = run.child.take() {
                child.wait();
            }
        }
        Ok(statistics)
    }
}

/// The other participant, where this program has started it.
struct Started {
    group: Option<Pid>,
    ended: Arc<AtomicBool>,
    watch: Option<JoinHandle<()>>,
}

impl Started {
    fn new(command: &str) -> Result<Self, Failure> {
        let mut shell = Command::new("sh");
        // A group of its own, so that all of it can be ended.
        shell.args(["-c", command]).process_group(0).stdout(Stdio::null());
        let mut child = shell.spawn().map_err(|e| input(format!("--start: {e}")))?;
        let group = Pid::from_raw(child.id() as i32);
        let ended = Arc::new(AtomicBool::new(false));
        let (expected, command) = (Arc::clone(&ended), command.to_owned());
        // preCICE waits for ever for a participant that never comes.
        let watch = std::thread::spawn(move || {
            let status = child.wait();
            let is_unexpected =
                || status.as_ref().is_ok_and(|s| !s.success()) && !expected.load(Ordering::Relaxed);
            if is_unexpected() {
                std::thread::sleep(GRACE);
            }
            if is_unexpected() {
                let status = status.as_ref().map(ToString::to_string).unwrap_or_default();
                eprintln!("error: the participant has ended with {status}: {command}");
                std::process::exit(1);
            }
        });
        Ok(Self { group, ended, watch: Some(watch) })
    }

    /// Until it ends by itself.
    fn wait(mut self) {
        self.group = None;
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(group) = self.group {
            let _ = kill_process_group(group, Signal::TERM);
        }
        let _ = self.watch.take().map(JoinHandle::join);
    }
}
