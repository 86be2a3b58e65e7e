//! A run of one solver alone: windows of the output interval, rows from its gauges.

use super::checkpoint::{self, Checkpoint, Store, Subject};
use super::energy::{self, Balance, Energies};
use super::files;
use super::history::{History, Mark, gauge_column};
use super::limits::{ENERGY_ERROR, Evidence, Limits, cure, percent};
use super::output::Output;
use super::owner::Owner;
use super::progress::{Line, Reporter};
use super::run_dir::HISTORY;
use super::scene::Scene;
use super::summary::{RunStatus, Summary, totals};
use crate::diagnostic::{Diagnostic, code};
use crate::ipc::interrupt;
use crate::ipc::serve::{cpu_seconds, peak_memory};
use crate::message::{Fault, FaultKind, Gauge, Measure, Plan, Progress, Ready, Statistics, capability};
use crate::solver::{Solver, Window};
use serde::{Deserialize, Serialize};
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
    /// From where the run goes on, if it does not begin.
    pub resume: Option<Checkpoint>,
}

impl Stage<'_> {
    /// Whether the run must end before its time.
    fn look(&self) -> Result<(), Fault> {
        if interrupt::requested() {
            return Err(Fault::interrupted());
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
#[derive(Clone, Copy, Serialize, Deserialize)]
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
    /// The window that comes next.
    next: Place,
    /// Checkpoints; none where the solver cannot write its state down.
    store: Option<Store>,
}

/// A window: its row, and which part of that.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Place {
    row: u64,
    part: u64,
}

/// What is kept of a run beside the state of its solver.
#[derive(Serialize, Deserialize)]
struct Kept {
    values: Values,
    extremes: Vec<[Extreme; 2]>,
    balance: Option<Balance>,
    windows: u64,
    next: Place,
    /// Where `history.csv` was.
    history: Mark,
}

/// Name of the part of a checkpoint that is [`Kept`].
const KEPT: &str = "run";

/// Run `solver` over the scene's time; rows and summary go to `out`.
///
/// The summary has been written when this returns `Ok`, whatever its status. An error is bad input
/// that only the preparation could find.
pub(crate) fn run(stage: &mut Stage, solver: &mut dyn Solver, scene: &Scene) -> Result<Summary, Diagnostic> {
    let owner = stage.owner;
    let out = owner.dir();
    let output = Output::of(scene)?;
    let end_time = scene.end_time()?;
    // The solver may not take windows as long as the interval of the rows.
    let parts = (output.interval.min(end_time) / solver.hello().largest_window).ceil().max(1.0);
    let plan = Plan { end_time, window: output.interval.min(end_time) / parts, ..Plan::default() };
    let started = Instant::now();
    let resume = stage.resume.take();
    let asked = resume.as_ref().map_or(Ok(()), |from| solver.resume(from.part(stage.role)?));
    let prepare = |solver: &mut dyn Solver, stage: &mut Stage| {
        asked.and_then(|()| solver.prepare(&plan, &mut |progress| stage.preparing(end_time, &progress)))
    };
    let ready = match prepare(solver, stage) {
        Ok(ready) => ready,
        Err(fault) if fault.kind == FaultKind::Input => return Err(*fault.diagnostic),
        Err(fault) => return Ok(failed_at_start(fault, owner)),
    };
    let prepared = started.elapsed().as_secs_f64();
    let warnings = ready.warnings.clone();
    let mut summary = Summary::new(RunStatus::Done);
    let can = solver.hello().can(capability::CHECKPOINT);
    let store = match can && output.checkpoint > 0.0 {
        true => Some(Store::new(out, Subject::of(scene)?, output.checkpoint, resume.as_ref())),
        false => None,
    };
    let outcome = Solo::new(solver, ready, out, resume.as_ref()).and_then(|mut solo| {
        solo.store = store;
        let outcome = solo.advance(stage, end_time, output.interval, parts as u64);
        solo.describe(&mut summary);
        outcome.and_then(|()| solo.history.sync().map_err(|e| unwritable(out, &e)))
    });
    if let Err(fault) = outcome {
        let Summary { status, message, reasons, .. } = ended_by(fault);
        summary = Summary { status, message, reasons, ..summary };
    }
    let gauges = std::mem::take(&mut summary.measures);
    summary.warnings.splice(0..0, warnings);
    summary.warnings.extend(resume.map(|from| checkpoint::of_last_part(from.time)));
    let statistics = solver.finish().unwrap_or_else(|fault| {
        summary.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, format!("no statistics: {fault}")));
        Statistics::default()
    });
    if let Err(taken) = summary.take(&solver.hello().program, &statistics) {
        summary.fail(taken);
    }
    summary.measures.extend(gauges);
    stage.limits.judge(&mut summary, &Evidence { energy: cure(stage.role).into(), ..Evidence::default() });
    cost(&mut summary, stage.role, &statistics, prepared, started.elapsed().as_secs_f64());
    write(&mut summary, owner);
    checkpoint::remove_if_over(&summary, out);
    // What was interrupted goes on, and must end at once.
    if summary.status != RunStatus::Interrupted
        && let Err(e) = owner.seal()
    {
        tracing::warn!("{}: no manifest: {e}", out.display());
    }
    Ok(summary)
}

fn ended_by(fault: Fault) -> Summary {
    let status = match fault.kind {
        FaultKind::Interrupted => RunStatus::Interrupted,
        _ => RunStatus::Failed,
    };
    Summary::ended(status, *fault.diagnostic)
}

fn failed_at_start(fault: Fault, owner: &Owner) -> Summary {
    let mut summary = ended_by(fault);
    write(&mut summary, owner);
    summary
}

fn write(summary: &mut Summary, owner: &Owner) {
    if let Err(what) = owner.write_summary(summary) {
        summary.fail(Diagnostic::error(code::NOT_WRITTEN, what));
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
    fn new(
        solver: &'a mut dyn Solver,
        ready: Ready,
        out: &Path,
        resume: Option<&Checkpoint>,
    ) -> Result<Self, Fault> {
        let gauges = ready.gauges;
        if ready.initial.len() != 3 * gauges.len() {
            let (got, due) = (ready.initial.len(), 3 * gauges.len());
            return Err(Fault::broken(format!(
                "the solver's first answer has {got} numbers instead of {due}"
            )));
        }
        let columns: Vec<String> =
            std::iter::once("time_s".into()).chain(gauges.iter().map(gauge_column)).collect();
        let kept: Option<Kept> =
            resume.map(|from| from.part(KEPT).and_then(checkpoint::unpack)).transpose()?;
        let history = match &kept {
            Some(kept) => History::go_on(&out.join(HISTORY), &columns, &kept.history),
            None => History::create(&out.join(HISTORY), &columns),
        };
        let history = history.map_err(files::fault)?;
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
            next: Place::default(),
            store: None,
        };
        match kept {
            None => solo.write_row(0.0).map_err(|e| unwritable(out, &e))?,
            Some(kept) => {
                (solo.values, solo.extremes, solo.balance) = (kept.values, kept.extremes, kept.balance);
                (solo.windows, solo.next) = (kept.windows, kept.next);
            }
        }
        Ok(solo)
    }

    /// Write a checkpoint of what is committed. One that cannot be written is missed, and the run goes on.
    fn keep(&mut self, role: &str, time: f64) {
        let Some(store) = &mut self.store else { return };
        let kept = Kept {
            values: self.values.clone(),
            extremes: self.extremes.clone(),
            balance: self.balance.clone(),
            windows: self.windows,
            next: self.next,
            history: self.history.mark(),
        };
        let written = self.solver.save().map_err(|fault| fault.to_string()).and_then(|state| {
            self.history.sync().map_err(|e| e.to_string())?;
            let parts = vec![(role.to_owned(), state), (KEPT.to_owned(), checkpoint::pack(&kept))];
            store.write(time, parts).map_err(|e| e.to_string())
        });
        if let Err(what) = written {
            tracing::warn!("no checkpoint at t = {time} s, the next is tried in its time: {what}");
        }
    }

    /// Before a window: whether the run must end, and a checkpoint if it is time for one, or if the user has interrupted the run.
    fn look(&mut self, stage: &Stage, time: f64) -> Result<(), Fault> {
        let looked = stage.look();
        let interrupted = matches!(&looked, Err(fault) if fault.kind == FaultKind::Interrupted);
        if interrupted || self.store.as_ref().is_some_and(Store::is_due) {
            self.keep(stage.role, time);
        }
        looked
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
        let first = self.next;
        for row in first.row..rows {
            for part in if row == first.row { first.part } else { 0 }..parts {
                self.next = Place { row, part };
                let start = time(row, part);
                let end = if part + 1 == parts { time(row + 1, 0) } else { time(row, part + 1) };
                if end <= start {
                    continue;
                }
                self.look(stage, start)?;
                self.windows += 1;
                let window = Window { number: self.windows, iteration: 1, start, length: end - start };
                self.solver
                    .solve(&window, &[], &mut self.values)
                    .and_then(|()| self.solver.commit())
                    .map_err(|mut fault| {
                        let message = &mut fault.diagnostic.message;
                        *message = format!("from {start} s to {end} s: {message}");
                        fault
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
                summary.measures.push(Measure::new(name, value, gauge.unit.clone()).at(time));
            }
        }
        self.describe_energy(summary);
        summary.cost.insert("windows".into(), json!(self.windows));
    }
    fn describe_energy(&self, summary: &mut Summary) {
        let Some(balance) = &self.balance else {
            summary.warnings.push(energy::absent("the solver does not report its energies"));
            return;
        };
        summary.energy.insert("imbalance_largest_J".into(), json!(balance.largest.0));
        summary.energy.insert("kinetic_largest_J".into(), json!(balance.kinetic));
        let (Some(reference), Some(value)) = (balance.reference(), balance.error()) else {
            summary.warnings.push(energy::absent(energy::NOTHING_MOVED));
            return;
        };
        summary.energy.insert("reference_J".into(), json!(reference));
        summary.energy.insert(ENERGY_ERROR.into(), json!(value));
        summary.measures.push(energy::error_measure(value, balance.largest.1));
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
mod tests;
