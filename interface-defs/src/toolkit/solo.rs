//! A run of one solver alone: windows of the output interval, rows from its gauges.

use super::energy::Balance;
use super::history::{History, gauge_column};
use super::input_error::InputError;
use super::output::Output;
use super::run_dir::HISTORY;
use super::scene::Scene;
use super::summary::{Status, Summary};
use crate::ipc::{interrupt, serve::peak_memory};
use crate::message::{Fault, FaultKind, Gauge, Measure, Plan, Ready, Statistics};
use crate::solver::{Solver, Window};
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Value, smallest and largest of each gauge, as an answer with an empty plan has them.
type Values = Vec<f64>;

struct Solo<'a> {
    solver: &'a mut dyn Solver,
    gauges: Vec<Gauge>,
    values: Values,
    extremes: Vec<[f64; 2]>,
    balance: Option<Balance>,
    row: Vec<f64>,
    history: History,
    windows: u64,
}

/// Run `solver` over the scene's time; rows and summary go to `out`.
///
/// The summary has been written when this returns `Ok`, whatever its status. An error is bad input
/// that only the preparation could find.
pub(crate) fn run(
    role: &str,
    solver: &mut dyn Solver,
    scene: &Scene,
    out: &Path,
) -> Result<Summary, InputError> {
    let output = Output::of(scene)?;
    let end_time = scene.end_time()?;
    // The solver may not take windows as long as the interval of the rows.
    let parts = (output.interval.min(end_time) / solver.hello().largest_window).ceil().max(1.0);
    let plan = Plan { end_time, window: output.interval.min(end_time) / parts, ..Plan::default() };
    let started = Instant::now();
    let ready = match solver.prepare(&plan, &mut on_progress) {
        Ok(ready) => ready,
        Err(fault) if fault.kind == FaultKind::Input => return Err(InputError::new(fault.message)),
        Err(fault) => return Ok(failed_at_start(&fault, out)),
    };
    let prepared = started.elapsed().as_secs_f64();
    let warnings = ready.warnings.clone();
    let mut summary = Summary::new(Status::Done);
    let outcome = Solo::new(solver, ready, out).and_then(|mut solo| {
        let outcome = solo.advance(end_time, output.interval, parts as u64);
        solo.describe(&mut summary);
        outcome
    });
    if let Err(fault) = outcome {
        (summary.status, summary.message) = ended_by(&fault);
    }
    let statistics = solver.finish().unwrap_or_else(|fault| {
        summary.warnings.push(format!("no statistics: {fault}"));
        Statistics::default()
    });
    summary.measures.splice(0..0, statistics.measures.iter().cloned());
    summary.warnings.splice(0..0, warnings.into_iter().chain(statistics.warnings.iter().cloned()));
    cost(&mut summary, role, &statistics, prepared, started.elapsed().as_secs_f64());
    write(&mut summary, out);
    Ok(summary)
}

fn on_progress(progress: crate::message::Progress) -> Result<(), Fault> {
    tracing::info!("{}", progress.what);
    if interrupt::requested() { Err(interrupted()) } else { Ok(()) }
}

fn interrupted() -> Fault {
    Fault { kind: FaultKind::Interrupted, message: "interrupted".into() }
}

fn ended_by(fault: &Fault) -> (Status, Option<String>) {
    match fault.kind {
        FaultKind::Interrupted => (Status::Interrupted, Some("interrupted".into())),
        _ => (Status::Failed, Some(fault.message.clone())),
    }
}

fn failed_at_start(fault: &Fault, out: &Path) -> Summary {
    let (status, message) = ended_by(fault);
    let mut summary = Summary { message, ..Summary::new(status) };
    write(&mut summary, out);
    summary
}

fn write(summary: &mut Summary, out: &Path) {
    if let Err(e) = summary.write(out) {
        summary.status = Status::Failed;
        summary.message = Some(format!("{}: summary.json cannot be written: {e}", out.display()));
    }
}

fn cost(summary: &mut Summary, role: &str, told: &Statistics, prepared: f64, total: f64) {
    let cpu = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    let cpu =
        if told.cpu_seconds > 0.0 { told.cpu_seconds } else { cpu.tv_sec as f64 + cpu.tv_nsec as f64 * 1e-9 };
    let memory = if told.peak_memory > 0 { told.peak_memory } else { peak_memory() };
    let counts: serde_json::Map<_, _> = told.counts.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    summary.cost.insert("wall_s".into(), json!(total));
    summary.cost.insert("stages".into(), json!({ "prepare_s": prepared, "loop_s": total - prepared }));
    let process = json!({ "cpu_s": cpu, "peak_memory_bytes": memory, "counts": counts });
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
            balance: Balance::new(&gauges, ready.initial.iter().step_by(3).copied()),
            extremes: ready.initial.chunks_exact(3).map(|g| [g[1], g[2]]).collect(),
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
    fn advance(&mut self, end_time: f64, interval: f64, parts: u64) -> Result<(), Fault> {
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
                if interrupt::requested() {
                    return Err(interrupted());
                }
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
                for (so_far, g) in self.extremes.iter_mut().zip(self.values.chunks_exact(3)) {
                    *so_far = [so_far[0].min(g[1]), so_far[1].max(g[2])];
                }
            }
            if let Some(balance) = &mut self.balance {
                balance.update(self.values.iter().step_by(3).copied());
            }
            self.write_row(time(row + 1, 0))
                .map_err(|e| Fault::broken(format!("history.csv cannot be written: {e}")))?;
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
            for (suffix, value) in [("min", *smallest), ("max", *largest)] {
                let name = format!("{}_{suffix}", gauge.name);
                summary.measures.push(Measure { name, value, unit: gauge.unit.clone(), time: None });
            }
        }
        if let Some(balance) = &self.balance {
            summary.energy.insert("imbalance_J".into(), json!(balance.imbalance));
            summary.energy.insert("kinetic_max_J".into(), json!(balance.kinetic));
            if let Some(error) = balance.error() {
                summary.energy.insert("error".into(), json!(error));
            }
        }
        summary.cost.insert("windows".into(), json!(self.windows));
    }
}

fn unwritable(out: &Path, e: &std::io::Error) -> Fault {
    Fault::broken(format!("{}: history.csv cannot be written: {e}", out.display()))
}
