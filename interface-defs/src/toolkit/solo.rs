//! A run of one solver alone: windows of the output interval, rows from its gauges.

use super::energy::{self, Balance, Energies};
use super::history::{History, gauge_column};
use super::input_error::InputError;
use super::limits::{ENERGY_ERROR, Evidence, Limits, cure, percent};
use super::output::Output;
use super::owner::Owner;
use super::progress::{Line, Reporter};
use super::run_dir::HISTORY;
use super::scene::Scene;
use super::summary::{RunStatus, Summary, totals};
use crate::ipc::interrupt;
use crate::ipc::serve::{cpu_seconds, peak_memory};
use crate::message::{Fault, FaultKind, Gauge, Measure, Plan, Progress, Ready, Statistics};
use crate::solver::{Solver, Window};
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Value, smallest and largest of each gauge, as an answer with an empty plan has them.
type Values = Vec<f64>;

/// Where the results go, and who looks on.
pub(crate) struct Stage<'a> {
    /// Name of the solver's part: `dem`.
    pub role: &'a str,
    /// Directory of the results.
    pub owner: &'a Owner,
    /// Process whose end ends the run.
    pub supervisor: Option<u32>,
    /// Bounds of trust.
    pub limits: Limits,
    /// To whom is reported how far the run is.
    pub reporter: Reporter,
}

impl Stage<'_> {
    /// Whether the run must end before its time.
    fn look(&self) -> Result<(), Fault> {
        if interrupt::requested() {
            return Err(Fault::new(FaultKind::Interrupted, "interrupted"));
        }
        let parent = || rustix::process::getppid().map_or(0, |p| p.as_raw_nonzero().get() as u32);
        match self.supervisor {
            Some(pid) if parent() != pid => {
                Err(Fault::broken(format!("the launcher (process {pid}) was lost")))
            }
            _ => Ok(()),
        }
    }

    fn preparing(&mut self, end: f64, progress: &Progress) -> Result<(), Fault> {
        tracing::info!("{}", progress.what);
        self.reporter.report(|| Line { end, what: progress.what.clone(), ..Line::default() });
        self.look()
    }
}

/// The smallest or largest value so far, and the end of the window in which it was.
#[derive(Clone, Copy)]
struct Extreme {
    value: f64,
    time: f64,
}

struct Solo<'a> {
    solver: &'a mut dyn Solver,
    gauges: Vec<Gauge>,
    values: Values,
    extremes: Vec<[Extreme; 2]>,
    balance: Option<Balance>,
    row: Vec<f64>,
    history: History,
    windows: u64,
}

/// Run `solver` over the scene's time; rows and summary go to `out`.
///
/// The summary has been written when this returns `Ok`, whatever its status. An error is bad input
/// that only the preparation could find.
pub(crate) fn run(stage: &mut Stage, solver: &mut dyn Solver, scene: &Scene) -> Result<Summary, InputError> {
    let owner = stage.owner;
    let out = owner.dir();
    let output = Output::of(scene)?;
    let end_time = scene.end_time()?;
    // The solver may not take windows as long as the interval of the rows.
    let parts = (output.interval.min(end_time) / solver.hello().largest_window).ceil().max(1.0);
    let plan = Plan { end_time, window: output.interval.min(end_time) / parts, ..Plan::default() };
    let started = Instant::now();
    let ready = match solver.prepare(&plan, &mut |progress| stage.preparing(end_time, &progress)) {
        Ok(ready) => ready,
        Err(fault) if fault.kind == FaultKind::Input => return Err(InputError::new(fault.message)),
        Err(fault) => return Ok(failed_at_start(&fault, owner)),
    };
    let prepared = started.elapsed().as_secs_f64();
    let warnings = ready.warnings.clone();
    let mut summary = Summary::new(RunStatus::Done);
    let outcome = Solo::new(solver, ready, out).and_then(|mut solo| {
        let outcome = solo.advance(stage, end_time, output.interval, parts as u64);
        solo.describe(&mut summary);
        outcome.and_then(|()| solo.history.sync().map_err(|e| unwritable(out, &e)))
    });
    if let Err(fault) = outcome {
        (summary.status, summary.message) = ended_by(&fault);
    }
    let gauges = std::mem::take(&mut summary.measures);
    summary.warnings.splice(0..0, warnings);
    let statistics = solver.finish().unwrap_or_else(|fault| {
        summary.warnings.push(format!("no statistics: {fault}"));
        Statistics::default()
    });
    summary.take(&statistics);
    summary.measures.extend(gauges);
    stage.limits.judge(&mut summary, &Evidence { energy: cure(stage.role).into(), ..Evidence::default() });
    cost(&mut summary, stage.role, &statistics, prepared, started.elapsed().as_secs_f64());
    write(&mut summary, owner);
    Ok(summary)
}

fn ended_by(fault: &Fault) -> (RunStatus, Option<String>) {
    match fault.kind {
        FaultKind::Interrupted => (RunStatus::Interrupted, Some("interrupted".into())),
        _ => (RunStatus::Failed, Some(fault.message.clone())),
    }
}

fn failed_at_start(fault: &Fault, owner: &Owner) -> Summary {
    let (status, message) = ended_by(fault);
    let mut summary = Summary { message, ..Summary::new(status) };
    write(&mut summary, owner);
    summary
}

fn write(summary: &mut Summary, owner: &Owner) {
    if let Err(what) = owner.write_summary(summary) {
        summary.status = RunStatus::Failed;
        summary.message = Some(match summary.message.take() {
            Some(before) => format!("{before}\n{what}"),
            None => what,
        });
    }
}

fn cost(summary: &mut Summary, role: &str, own: &Statistics, prepared: f64, total: f64) {
    let cpu = if own.cpu_seconds > 0.0 { own.cpu_seconds } else { cpu_seconds() };
    let memory = if own.peak_memory > 0 { own.peak_memory } else { peak_memory() };
    let counts: serde_json::Map<_, _> = own.counts.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    summary.cost.insert("wall_s".into(), json!(total));
    summary.cost.insert("stages".into(), json!({ "prepare_s": prepared, "loop_s": total - prepared }));
    let process = json!({ "cpu_s": cpu, "peak_memory_bytes": memory, "counts": counts });
    totals(&mut summary.cost, &[own]);
    summary.cost.insert("peak_memory_bytes".into(), json!(memory));
    summary.cost.insert("processes".into(), json!({ role: process }));
}

impl<'a> Solo<'a> {
    fn new(solver: &'a mut dyn Solver, ready: Ready, out: &Path) -> Result<Self, Fault> {
        let gauges = ready.gauges;
        if ready.initial.len() != 3 * gauges.len() {
            let (got, due) = (ready.initial.len(), 3 * gauges.len());
            return Err(Fault::broken(format!(
                "the solver's first answer has {got} numbers instead of {due}"
            )));
        }
        let columns: Vec<String> =
            std::iter::once("time_s".into()).chain(gauges.iter().map(gauge_column)).collect();
        let history = History::create(&out.join(HISTORY), &columns).map_err(|e| unwritable(out, &e))?;
        let mut solo = Self {
            balance: energy::has_roles(&gauges).then(|| Balance::new(energies(&gauges, &ready.initial, 0))),
            extremes: ready
                .initial
                .chunks_exact(3)
                .map(|g| [g[1], g[2]].map(|value| Extreme { value, time: 0.0 }))
                .collect(),
            row: Vec::with_capacity(columns.len()),
            values: ready.initial,
            windows: 0,
            solver,
            gauges,
            history,
        };
        solo.write_row(0.0).map_err(|e| unwritable(out, &e))?;
        Ok(solo)
    }

    /// Windows until `end_time`, a row after each `interval`.
    fn advance(&mut self, stage: &mut Stage, end_time: f64, interval: f64, parts: u64) -> Result<(), Fault> {
        let rows = ((end_time / interval) * (1.0 - 1e-9)).ceil().max(1.0) as u64;
        // Every time is a product, never a sum: rounding does not add up over the run.
        let time = |row: u64, part: u64| {
            if row >= rows {
                end_time
            } else {
                (interval * (row as f64 + part as f64 / parts as f64)).min(end_time)
            }
        };
        for row in 0..rows {
            for part in 0..parts {
                let start = time(row, part);
                let end = if part + 1 == parts { time(row + 1, 0) } else { time(row, part + 1) };
                if end <= start {
                    continue;
                }
                stage.look()?;
                self.windows += 1;
                let window = Window { number: self.windows, iteration: 1, start, length: end - start };
                self.solver
                    .solve(&window, &[], &mut self.values)
                    .and_then(|()| self.solver.commit())
                    .map_err(|fault| Fault {
                        message: format!("from {start} s to {end} s: {}", fault.message),
                        ..fault
                    })?;
                self.check_finite(&window)?;
                self.check_energy(stage, &window)?;
                for (so_far, g) in self.extremes.iter_mut().zip(self.values.chunks_exact(3)) {
                    if g[1] < so_far[0].value {
                        so_far[0] = Extreme { value: g[1], time: end };
                    }
                    if g[2] > so_far[1].value {
                        so_far[1] = Extreme { value: g[2], time: end };
                    }
                }
                let windows = self.windows;
                stage.reporter.report(|| Line { t: end, end: end_time, windows, ..Line::default() });
            }
            self.write_row(time(row + 1, 0))
                .map_err(|e| Fault::broken(format!("history.csv cannot be written: {e}")))?;
            if self.solver.has_ended() {
                break;
            }
        }
        Ok(())
    }

    fn check_finite(&self, window: &Window) -> Result<(), Fault> {
        match self.values.iter().position(|v| !v.is_finite()) {
            Some(at) => Err(Fault::broken(format!(
                "from {} s to {} s: {} became {}; the computation has diverged, try a smaller time step",
                window.start,
                window.end(),
                self.gauges[at / 3].name,
                self.values[at]
            ))),
            None => Ok(()),
        }
    }

    /// Book the energies of a window (a structure's prestress is no contact); an error far beyond the bound ends the run at once.
    fn check_energy(&mut self, stage: &Stage, window: &Window) -> Result<(), Fault> {
        let Some(balance) = &mut self.balance else { return Ok(()) };
        let now = energies(&self.gauges, &self.values, 0);
        balance.update(window.end(), &now, if stage.role == "dem" { now.stored } else { 0.0 });
        balance.impact(energies(&self.gauges, &self.values, 2).kinetic);
        let bound = stage.limits.fatal_energy_error();
        if !balance.has_left(bound) {
            return Ok(());
        }
        let (created, reference) = (balance.imbalance, balance.reference().unwrap_or(0.0));
        let end = window.end();
        self.write_row(end).map_err(|e| Fault::broken(format!("history.csv cannot be written: {e}")))?;
        Err(Fault::broken(format!(
            "the computation has diverged: at t = {end} s {created:.3e} J have come from nowhere (or are lost), {} of the \
             {reference:.3e} J at impact, above ten times limits.energy_error = {}; {}",
            percent(created.abs() / reference),
            percent(stage.limits.energy_error),
            cure(stage.role)
        )))
    }

    fn write_row(&mut self, time: f64) -> std::io::Result<()> {
        self.row.clear();
        self.row.push(time);
        self.row.extend(self.values.iter().step_by(3));
        self.history.row(&self.row)
    }

    /// What the gauges have shown.
    fn describe(&self, summary: &mut Summary) {
        for (gauge, [smallest, largest]) in self.gauges.iter().zip(&self.extremes).filter(|(g, _)| g.extremes)
        {
            for (suffix, extreme) in [("min", smallest), ("max", largest)] {
                let Extreme { value, time } = *extreme;
                let name = format!("{}_{suffix}", gauge.name);
                summary.measures.push(Measure { name, value, unit: gauge.unit.clone(), time: Some(time) });
            }
        }
        self.describe_energy(summary);
        summary.cost.insert("windows".into(), json!(self.windows));
    }
    fn describe_energy(&self, summary: &mut Summary) {
        let Some(balance) = &self.balance else {
            summary.warnings.push("energy_error is absent: the solver does not report its energies".into());
            return;
        };
        summary.energy.insert("imbalance_largest_J".into(), json!(balance.largest.0));
        summary.energy.insert("kinetic_largest_J".into(), json!(balance.kinetic));
        let (Some(reference), Some(value)) = (balance.reference(), balance.error()) else {
            summary.warnings.push(energy::NOTHING_MOVED.into());
            return;
        };
        summary.energy.insert("reference_J".into(), json!(reference));
        summary.energy.insert(ENERGY_ERROR.into(), json!(value));
        let time = Some(balance.largest.1);
        summary.measures.push(Measure { name: ENERGY_ERROR.into(), value, unit: "1".into(), time });
    }
}

/// Energies of an answer: of each gauge's three numbers the one at `place` (0 value, 2 largest).
fn energies(gauges: &[Gauge], values: &[f64], place: usize) -> Energies {
    Energies::of(gauges.iter().map(|g| g.role).zip(values.chunks_exact(3).map(|v| v[place])))
}

fn unwritable(out: &Path, e: &std::io::Error) -> Fault {
    Fault::broken(format!("{}: history.csv cannot be written: {e}", out.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{Hello, Role};
    use crate::solver::OnProgress;
    use crate::toolkit::owner::Claim;

    /// A body in free fall; past `fails_at` it cannot be solved.
    struct Fall {
        /// What its potential energy is reported as, relative to what it is.
        shown: f64,
        committed: [f64; 2],
        trial: [f64; 2],
        fails_at: f64,
        longest: f64,
        windows: Vec<Window>,
    }

    const G: f64 = 10.0;

    impl Fall {
        fn new(fails_at: f64, longest: f64) -> Self {
            Self { shown: 1.0, committed: [0.0; 2], trial: [0.0; 2], fails_at, longest, windows: Vec::new() }
        }

        fn answer(state: [f64; 2]) -> [f64; 9] {
            let [z, v] = state;
            let (kinetic, potential) = (0.5 * v * v, G * z);
            [z, z, z + 1.0, kinetic, kinetic, kinetic, potential, potential, potential]
        }
    }

    impl Solver for Fall {
        fn hello(&self) -> Hello {
            Hello { program: "fall".into(), largest_window: self.longest, ..Hello::default() }
        }

        fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
            assert!(plan.window <= self.longest);
            progress(Progress { what: "nothing to do".into(), done: 1.0, ..Progress::default() })?;
            let gauge = |name: &str, unit, role| Gauge { role, ..Gauge::new(name, unit) };
            let gauges = vec![
                Gauge { extremes: true, ..Gauge::new("z", "m") },
                gauge("energy_kinetic", "J", Role::Kinetic),
                gauge("energy_potential", "J", Role::Potential),
            ];
            Ok(Ready { gauges, initial: Self::answer([0.0; 2]).to_vec(), ..Ready::default() })
        }

        fn solve(&mut self, window: &Window, _: &[f64], output: &mut [f64]) -> Result<(), Fault> {
            if window.end() > self.fails_at {
                return Err(Fault::window("the ground is missing"));
            }
            let ([z, v], h) = (self.committed, window.length);
            self.trial = [z + v * h - 0.5 * G * h * h, v - G * h];
            self.windows.push(*window);
            output.copy_from_slice(&Self::answer(self.trial));
            output[6..].iter_mut().for_each(|potential| *potential *= self.shown);
            Ok(())
        }

        fn commit(&mut self) -> Result<(), Fault> {
            self.committed = self.trial;
            Ok(())
        }

        fn finish(&mut self) -> Result<Statistics, Fault> {
            Ok(Statistics { counts: vec![("flights".into(), 3)], ..Statistics::default() })
        }
    }

    fn run_fall(fall: &mut Fall, text: &str) -> (Summary, Vec<Vec<f64>>) {
        let dir = tempfile::tempdir().expect("a directory");
        let scene = Scene::from_text("s.toml", text).expect("TOML");
        let owner = Owner::claim(dir.path(), &Claim::default()).expect("free");
        let limits = Limits::of(&scene).expect("valid");
        let mut stage =
            Stage { role: "dem", owner: &owner, supervisor: None, limits, reporter: Reporter::default() };
        let summary = run(&mut stage, fall, &scene).expect("good input");
        assert_eq!(Summary::read(dir.path()).expect("written").status, summary.status);
        let history = std::fs::read_to_string(dir.path().join(HISTORY)).expect("rows");
        let mut lines = history.lines();
        assert_eq!(lines.next(), Some("time_s,z_m,energy_kinetic_J,energy_potential_J"));
        let number = |text: &str| text.parse::<f64>().expect("a number");
        (summary, lines.map(|line| line.split(',').map(number).collect()).collect())
    }

    #[test]
    fn a_solver_alone_gives_a_row_per_interval_and_the_end() {
        let mut fall = Fall::new(f64::INFINITY, f64::INFINITY);
        let (summary, rows) = run_fall(&mut fall, "end_time = 1.0\noutput.interval = 0.3");
        assert_eq!(rows.iter().map(|r| r[0]).collect::<Vec<_>>(), [0.0, 0.3, 0.6, 0.3 * 3.0, 1.0]);
        // Exact solution; a handful of roundings of numbers of order 5.
        assert!((rows[4][1] + 0.5 * G).abs() < 1e-14 * 5.0 * 10.0, "{:?}", rows[4]);
        assert_eq!((summary.status, summary.message.as_deref()), (RunStatus::Done, None));
        let measures: Vec<_> = summary.measures.iter().map(|m| (m.name.as_str(), m.value, m.time)).collect();
        assert_eq!(measures[..2], [("z_min", rows[4][1], Some(1.0)), ("z_max", 1.0, Some(0.0))]);
        assert_eq!(measures[2].0, "energy_error");
        assert_eq!(summary.cost["windows"], 4);
        assert_eq!(summary.cost["processes"]["dem"]["counts"]["flights"], 3);
        assert!(summary.energy["energy_error"].as_f64().expect("a number") < 1e-14);
    }

    #[test]
    fn the_largest_window_of_the_solver_is_kept_and_rows_stay_where_they_are() {
        let mut fall = Fall::new(f64::INFINITY, 0.1);
        let (_, rows) = run_fall(&mut fall, "end_time = 1.0\noutput.interval = 0.25");
        assert_eq!(rows.iter().map(|r| r[0]).collect::<Vec<_>>(), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(fall.windows.len(), 12);
        for pair in fall.windows.windows(2) {
            assert!((pair[1].start - pair[0].end()).abs() <= f64::EPSILON, "no gap: {pair:?}");
        }
    }

    #[test]
    fn energy_that_comes_from_nowhere_is_a_warning() {
        let mut fall = Fall::new(f64::INFINITY, f64::INFINITY);
        assert!(run_fall(&mut fall, "end_time = 1.0").0.warnings.is_empty());
        let mut fall = Fall { shown: 0.98, ..Fall::new(f64::INFINITY, f64::INFINITY) };
        let (summary, _) = run_fall(&mut fall, "end_time = 1.0");
        // 1 J of 50 J of potential energy is not reported: it seems created, and does not count in the 50 J of speed.
        let error = summary.measure("energy_error").expect("a number");
        assert!((error - 1.0 / 49.0).abs() < 1e-9, "{error}");
        assert_eq!(summary.status, RunStatus::Done);
        assert!(
            summary.warnings[0].starts_with("energy_error is 2.04 % at 1.000000 s"),
            "{:?}",
            summary.warnings
        );
        let mut fall = Fall { shown: 0.8, ..Fall::new(f64::INFINITY, f64::INFINITY) };
        let (summary, _) = run_fall(&mut fall, "end_time = 1.0");
        assert_eq!(summary.status, RunStatus::Unreliable);
        let message = summary.message.expect("says why");
        assert!(
            message.starts_with(
                "unreliable: energy_error is 25 % at 1.000000 s, above limits.energy_error = 10 %"
            ),
            "{message}"
        );
        let mut fall = Fall { shown: 0.8, ..Fall::new(f64::INFINITY, f64::INFINITY) };
        let (summary, _) = run_fall(&mut fall, "end_time = 1.0\nlimits.energy_error = 0.3");
        assert_eq!(summary.status, RunStatus::Done);
    }

    #[test]
    fn a_run_whose_energy_explodes_ends_at_once_and_keeps_its_rows() {
        let mut fall = Fall { shown: 0.2, ..Fall::new(f64::INFINITY, f64::INFINITY) };
        let (summary, rows) = run_fall(&mut fall, "end_time = 1.0\noutput.interval = 0.1");
        assert_eq!(summary.status, RunStatus::Failed);
        // Three windows in a row beyond ten times the bound, then the end.
        assert_eq!(rows.len(), 4);
        let message = summary.message.expect("says why");
        assert!(
            message.contains("diverged: at t = 0.3") && message.contains("shorten the steps"),
            "{message}"
        );
        assert!((summary.measures.last().expect("one").value - 4.0).abs() < 1e-9, "{:?}", summary.measures);
    }

    #[test]
    fn rows_default_to_two_hundred() {
        let (_, rows) = run_fall(&mut Fall::new(f64::INFINITY, f64::INFINITY), "end_time = 0.7");
        assert_eq!(rows.len(), 201);
    }

    #[test]
    fn a_run_that_fails_keeps_its_rows_and_says_when_and_why() {
        let (summary, rows) =
            run_fall(&mut Fall::new(0.55, f64::INFINITY), "end_time = 1\noutput.interval = 0.25");
        assert_eq!(rows.len(), 3);
        assert_eq!(summary.status, RunStatus::Failed);
        assert_eq!(summary.message.as_deref(), Some("from 0.5 s to 0.75 s: the ground is missing"));
    }
}
