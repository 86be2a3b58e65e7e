//! What a run leaves behind, made the same by a solver alone, by the coupler and by the members of a study: windows and the rows
//! that they end ([`Windows`]), the balance of energy of one solver ([`Ledger`]), `history.csv` with the extremes of gauges
//! ([`Recorder`]), and the cost of processes ([`describe_processes`]).

use super::energy::{Balance, Energies, has_roles};
use super::history::{History, Mark, gauge_column};
use super::limits::Limits;
use super::run_dir::HISTORY;
use super::summary::Summary;
use interface_defs::{Diagnostic, Fault, FaultKind, Gauge, Measure, Ready, Solver, Statistics, Window, code};
use serde::{Deserialize, Serialize};
use serde_json::{Map, json};
use std::path::Path;

/// The windows of a solver alone: equal parts of the interval between two rows, no longer than the solver takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Windows {
    end_time: f64,
    interval: f64,
    rows: u64,
    parts: u64,
    /// The window that comes next.
    row: u64,
    part: u64,
    /// Windows so far.
    solved: u64,
}

/// A window, and whether a row ends with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The window.
    pub window: Window,
    /// Its end [s], to the last bit.
    pub end: f64,
    /// Whether a row ends with it.
    pub ends_row: bool,
}

impl Windows {
    /// From 0 to `end_time`, with a row each `interval`; no window is longer than `longest` [s].
    pub fn new(end_time: f64, interval: f64, longest: f64) -> Self {
        let interval = interval.min(end_time);
        let parts = (interval / longest).ceil().max(1.0);
        let rows = ((end_time / interval) * (1.0 - 1e-9)).ceil().max(1.0);
        Self { end_time, interval, rows: rows as u64, parts: parts as u64, row: 0, part: 0, solved: 0 }
    }

    /// Length of a whole window [s].
    pub fn length(&self) -> f64 {
        self.interval / self.parts as f64
    }

    /// Windows so far.
    pub fn solved(&self) -> u64 {
        self.solved
    }

    /// Go on where `kept` stood.
    ///
    /// # Errors
    /// If those are windows of another run.
    pub fn go_on(&mut self, kept: Self) -> Result<(), Fault> {
        let same = *self == Self { row: self.row, part: self.part, solved: self.solved, ..kept.clone() };
        *self = kept;
        if same { Ok(()) } else { Err(of_others("windows").into()) }
    }

    /// Every time is a product, never a sum: rounding does not add up over the run.
    fn time(&self, row: u64, part: u64) -> f64 {
        if row >= self.rows {
            return self.end_time;
        }
        (self.interval * (row as f64 + part as f64 / self.parts as f64)).min(self.end_time)
    }

    /// The window that comes next; `None`: the end is reached.
    pub fn current(&self) -> Option<Step> {
        if self.row >= self.rows {
            return None;
        }
        let (start, row_end) = (self.time(self.row, self.part), self.time(self.row + 1, 0));
        let end = if self.part + 1 == self.parts { row_end } else { self.time(self.row, self.part + 1) };
        let window = Window { number: self.solved + 1, iteration: 1, start, length: end - start };
        // The last row may be shorter than the others: parts behind its end are none.
        Some(Step { window, end, ends_row: end >= row_end })
    }
}

impl Iterator for Windows {
    type Item = Step;

    fn next(&mut self) -> Option<Step> {
        let step = self.current()?;
        self.solved += 1;
        self.part += 1;
        if step.ends_row {
            (self.row, self.part) = (self.row + 1, 0);
        }
        Some(step)
    }
}

/// The gauges of one solver that runs alone: their last values, and its balance of energy.
#[derive(Debug, Clone)]
pub struct Ledger {
    gauges: Vec<Gauge>,
    /// Value, smallest and largest of each gauge in the last window.
    values: Vec<f64>,
    /// Its energies; `None`: it does not report them.
    pub balance: Option<Balance>,
    /// Whether what it stores is held in contacts. A structure's prestress is not.
    holds: bool,
}

/// What a [`Ledger`] keeps in a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeptLedger {
    values: Vec<f64>,
    balance: Option<Balance>,
}

impl Ledger {
    /// Of a solver that has answered `ready`; `holds`: what it stores is held in contacts.
    ///
    /// # Errors
    /// If the answer has not three finite numbers for each gauge.
    pub fn new(ready: Ready, holds: bool) -> Result<Self, Fault> {
        let (gauges, values) = (ready.gauges, ready.initial);
        let (got, due) = (values.len(), 3 * gauges.len());
        if got != due {
            let what = format!("the solver's first answer has {got} numbers instead of {due}");
            return Err(broken(Diagnostic::error(code::CONTRACT, what)));
        }
        let start = has_roles(&gauges).then(|| Balance::new(energies(&gauges, &values, 0)));
        let ledger = Self { gauges, values, balance: start, holds };
        ledger.check_finite("at t = 0")?;
        Ok(ledger)
    }

    /// The gauges.
    pub fn gauges(&self) -> &[Gauge] {
        &self.gauges
    }

    /// Value, smallest and largest of each gauge in the last window.
    pub fn values(&self) -> &[[f64; 3]] {
        self.values.as_chunks().0
    }

    /// Solve and commit a window, and book its energies.
    ///
    /// # Errors
    /// The solver's own; or a gauge is not finite.
    pub fn solve(&mut self, solver: &mut dyn Solver, step: &Step) -> Result<(), Fault> {
        let Step { window, end, .. } = step;
        let when = |end: f64| format!("from {} s to {end} s", window.start);
        let _span = interface_defs::profile!("solve", window = window.number, iteration = window.iteration);
        solver.solve(window, &[], &mut self.values).and_then(|()| solver.commit()).map_err(|mut fault| {
            if fault.kind != FaultKind::Interrupted {
                fault.diagnostic.message = format!("{}: {}", when(*end), fault.diagnostic.message);
            }
            fault
        })?;
        self.check_finite(&when(window.end()))?;
        let Some(balance) = &mut self.balance else { return Ok(()) };
        let now = energies(&self.gauges, &self.values, 0);
        balance.update(window.end(), &now, if self.holds { now.stored } else { 0.0 });
        balance.impact(energies(&self.gauges, &self.values, 2).kinetic);
        Ok(())
    }

    fn check_finite(&self, when: &str) -> Result<(), Fault> {
        let Some(at) = self.values.iter().position(|v| !v.is_finite()) else { return Ok(()) };
        let (name, value) = (&self.gauges[at / 3].name, self.values[at]);
        let what = format!("{when}: {name} became {value}; the computation has diverged");
        Err(broken(Diagnostic::error(code::NOT_FINITE, what).try_instead("try a smaller time step")))
    }

    /// What is said if the energy error has left its bound for good, `cure` being what to try. To be asked once per window.
    pub fn diverged(&mut self, time: f64, limits: &Limits, cure: &str) -> Option<Fault> {
        let balance = self.balance.as_mut()?;
        balance.has_left(limits.fatal_energy_error()).then(|| broken(balance.diverged(time, limits, cure)))
    }

    /// What a checkpoint keeps of it.
    pub fn kept(&self) -> KeptLedger {
        KeptLedger { values: self.values.clone(), balance: self.balance.clone() }
    }

    /// Go on from there.
    ///
    /// # Errors
    /// If what was kept is of other gauges.
    pub fn go_on(&mut self, kept: KeptLedger) -> Result<(), Fault> {
        let same = (kept.values.len(), kept.balance.is_some()) == (self.values.len(), self.balance.is_some());
        (self.values, self.balance) = (kept.values, kept.balance);
        if same { Ok(()) } else { Err(of_others("gauges").into()) }
    }
}

/// Energies of an answer: of each gauge's three numbers the one at `place` (0 value, 2 largest).
fn energies(gauges: &[Gauge], values: &[f64], place: usize) -> Energies {
    Energies::of(gauges.iter().map(|g| g.role).zip(values.chunks_exact(3).map(|v| v[place])))
}

/// The run cannot go on.
pub(super) fn broken(why: Diagnostic) -> Fault {
    Fault::new(FaultKind::Broken, why)
}

/// A checkpoint that does not belong to the run that goes on from it.
pub fn of_others(what: &str) -> Diagnostic {
    let what = format!("the checkpoint is of a run with other {what}: another scene, or other programs");
    Diagnostic::error(code::PROVENANCE, what).try_instead("run it anew with --force")
}

/// A file of results that cannot be written.
pub fn unwritable(path: &Path, e: &std::io::Error) -> Diagnostic {
    Diagnostic::error(code::NOT_WRITTEN, format!("{} cannot be written: {e}", path.display()))
}

/// A file of rows: a new one, or as it was at `mark`.
///
/// # Errors
/// If it cannot be written.
pub fn open(path: &Path, columns: &[String], mark: Option<&Mark>) -> Result<History, Diagnostic> {
    let opened = match mark {
        None => History::create(path, columns),
        Some(mark) => History::go_on(path, columns, mark),
    };
    opened.map_err(|e| e.downcast().unwrap_or_else(|e| unwritable(path, &e)))
}

/// Writes `history.csv`, and follows the extremes of the gauges.
pub struct Recorder {
    /// Each with the program that reports it.
    gauges: Vec<(String, Gauge)>,
    /// Smallest and largest of each gauge.
    extremes: Vec<[Extreme; 2]>,
    history: History,
    row: Vec<f64>,
}

/// An extreme of a gauge, and the end of the window in which it was [s].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Extreme {
    value: f64,
    time: f64,
}

/// What a [`Recorder`] keeps in a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeptRows {
    extremes: Vec<[Extreme; 2]>,
    /// Bytes of the file.
    history: Mark,
}

impl Recorder {
    /// A row has its time, the values of the gauges of these `programs`, and the numbers of the columns `more`. The file is a new one in `out`, or goes on
    /// from what was kept.
    ///
    /// # Errors
    /// If the file cannot be written, or what was kept is of other gauges.
    pub fn open(
        out: &Path,
        programs: &[(&str, &[Gauge])],
        more: &[&str],
        kept: Option<KeptRows>,
    ) -> Result<Self, Diagnostic> {
        let of_one = |(program, gauges): &(&str, &[Gauge])| -> Vec<_> {
            gauges.iter().map(|gauge| ((*program).to_owned(), gauge.clone())).collect()
        };
        let gauges: Vec<(String, Gauge)> = programs.iter().flat_map(of_one).collect();
        let own = gauges.iter().map(|(_, gauge)| gauge_column(gauge));
        let columns: Vec<String> =
            std::iter::once("time_s".to_owned()).chain(own).chain(more.iter().map(|c| (*c).into())).collect();
        let none = [f64::INFINITY, f64::NEG_INFINITY].map(|value| Extreme { value, time: 0.0 });
        let (extremes, mark) = match kept {
            None => (vec![none; gauges.len()], None),
            Some(kept) => (kept.extremes, Some(kept.history)),
        };
        if extremes.len() != gauges.len() {
            return Err(of_others("gauges"));
        }
        let history = open(&out.join(HISTORY), &columns, mark.as_ref())?;
        Ok(Self { gauges, extremes, history, row: Vec::with_capacity(columns.len()) })
    }

    /// Begin the row of the window that ends at `time` [s] with these values, smallest and largest.
    pub fn take<'v>(&mut self, time: f64, values: impl IntoIterator<Item = &'v [f64; 3]>) {
        self.row.clear();
        self.row.push(time);
        for (extremes, [value, least, most]) in self.extremes.iter_mut().zip(values) {
            self.row.push(*value);
            if *least < extremes[0].value {
                extremes[0] = Extreme { value: *least, time };
            }
            if *most > extremes[1].value {
                extremes[1] = Extreme { value: *most, time };
            }
        }
    }

    /// The row behind the values of the gauges, to which the columns that are no gauges are added, and the file.
    pub fn row(&mut self) -> (&mut Vec<f64>, &mut History) {
        (&mut self.row, &mut self.history)
    }

    /// Write the row.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self) -> Result<(), Diagnostic> {
        self.history.row(&self.row).map_err(|e| unwritable(Path::new(HISTORY), &e))
    }

    /// All rows are on the disk itself when this returns.
    ///
    /// # Errors
    /// If the file cannot be written, or is not in its place any more.
    pub fn sync(&self) -> Result<(), Diagnostic> {
        self.history.sync().map_err(|e| unwritable(Path::new(HISTORY), &e))
    }

    /// Extremes of the gauges that are results of their own.
    pub fn measures(&self) -> impl Iterator<Item = Measure> {
        let seen = self.gauges.iter().zip(&self.extremes).filter(|(_, of)| of[0].value.is_finite());
        seen.filter(|((_, gauge), _)| gauge.extremes).flat_map(|((program, gauge), of)| {
            [("min", of[0]), ("max", of[1])].map(|(end, Extreme { value, time })| Measure {
                source: program.clone(),
                ..Measure::new(format!("{}_{end}", gauge.name), value, gauge.unit.clone()).at(time)
            })
        })
    }

    /// What a checkpoint keeps of it.
    pub fn kept(&self) -> KeptRows {
        KeptRows { extremes: self.extremes.clone(), history: self.history.mark() }
    }
}

/// Write into the cost of a run what each of these processes has spent.
pub fn describe_processes<'s>(
    summary: &mut Summary,
    processes: impl IntoIterator<Item = (&'s str, &'s Statistics)>,
) {
    let spent = |process: &Statistics| {
        let counts: Map<_, _> = process.counts.iter().map(|(name, n)| (name.clone(), json!(n))).collect();
        let (cpu, memory) = (process.cpu_seconds, process.peak_memory);
        let mut spent = json!({ "cpu_s": cpu, "peak_memory_bytes": memory, "counts": counts });
        if process.solve_seconds > 0.0 {
            spent["solve_s"] = json!(process.solve_seconds);
        }
        spent
    };
    let processes = processes.into_iter().map(|(name, process)| (name.to_owned(), spent(process)));
    summary.cost.insert("processes".into(), processes.collect());
}

#[cfg(test)]
mod tests;
