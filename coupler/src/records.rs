//! Result files of a coupled run: `history.csv`, `iterations.csv`, and the measures for `summary.json`.

use crate::coupling::{Committed, Coupling, Iteration, KeptRun, Observer};
use crate::rows::{OWN_COLUMNS, Rows};
use crate::side::Side;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::toolkit::alloc::allocations;
use interface_defs::toolkit::checkpoint::{Checkpoint, Store, pack, unpack};
use interface_defs::toolkit::energy::{self, NOTHING_MOVED};
use interface_defs::toolkit::history::{History, Mark};
use interface_defs::toolkit::limits::ENERGY_ERROR;
use interface_defs::toolkit::output::Output;
use interface_defs::toolkit::progress::{Form, Line, Reporter};
use interface_defs::toolkit::run_dir;
use interface_defs::toolkit::summary::Summary;
use interface_defs::{Fault, Gauge, Measure, Statistics};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Writes the rows of a run.
pub struct Records {
    dir: PathBuf,
    end_time: f64,
    interval: f64,
    iterations_wanted: bool,
    progress: Reporter,
    history: Option<History>,
    iterations: Option<History>,
    row: Vec<f64>,
    rows: Rows,
    gauges: Vec<Tracked>,
    dem_gauges: usize,
    warnings: Vec<Diagnostic>,
    /// Who the two solvers are.
    programs: [String; 2],
    counts: (u64, u64),
    prepared_at: Option<Instant>,
    touched_at: Option<Instant>,
    window_started: Instant,
    /// Of this process when its first window was on record, and its latest.
    allocations: Option<(u64, u64)>,
    /// Checkpoints; none are written without it.
    store: Option<Store>,
    /// Where these records go on, if they do not begin.
    kept: Option<KeptRecords>,
}

/// What is kept of the records themselves.
#[derive(Serialize, Deserialize)]
struct KeptRecords {
    rows: Rows,
    /// Smallest and largest of each gauge, with their times.
    extremes: Vec<[(f64, f64); 2]>,
    /// Windows and iterations.
    counts: (u64, u64),
    /// Bytes of `history.csv` and of `iterations.csv`.
    history: Mark,
    iterations: Option<Mark>,
}

/// Names of the parts of a checkpoint: both solvers, the loop, the records.
const KEPT: [&str; 4] = ["dem", "fem", "coupling", "records"];

/// A gauge and its extremes over the committed windows.
struct Tracked {
    gauge: Gauge,
    smallest: (f64, f64),
    largest: (f64, f64),
}

impl Records {
    /// Records of a run to `end_time` [s] in `dir`, as `output` says; with `progress`, lines on stdout.
    pub fn new(dir: &Path, end_time: f64, output: &Output, progress: Option<Form>) -> Self {
        let now = Instant::now();
        Self {
            dir: dir.into(),
            end_time,
            interval: output.interval,
            iterations_wanted: output.iterations,
            progress: Reporter::new(progress),
            history: None,
            iterations: None,
            row: Vec::new(),
            rows: Rows::new(0, Vec::new(), output.interval),
            gauges: Vec::new(),
            dem_gauges: 0,
            warnings: Vec::new(),
            programs: Default::default(),
            counts: (0, 0),
            prepared_at: None,
            touched_at: None,
            window_started: now,
            allocations: None,
            store: None,
            kept: None,
        }
    }

    /// Write checkpoints to `store`. Of a run that goes on from `resume`, the state of the rest of it.
    pub fn keep_in(&mut self, store: Store, resume: Option<&Checkpoint>) -> Result<Option<KeptRun>, Fault> {
        self.store = Some(store).filter(Store::is_wanted);
        let Some(from) = resume else { return Ok(None) };
        let [dem, fem, coupling, records] = KEPT.map(|name| from.part(name));
        self.kept = Some(unpack(records?)?);
        Ok(Some(KeptRun { dem: dem?.to_vec(), fem: fem?.to_vec(), coupling: coupling?.to_vec() }))
    }

    fn write_checkpoint(&mut self, time: f64, run: KeptRun) -> Result<(), String> {
        let (Some(store), Some(history)) = (&mut self.store, &self.history) else { return Ok(()) };
        let kept = KeptRecords {
            rows: self.rows.clone(),
            extremes: self.gauges.iter().map(|g| [g.smallest, g.largest]).collect(),
            counts: self.counts,
            history: history.mark(),
            iterations: self.iterations.as_ref().map(History::mark),
        };
        let states = [run.dem, run.fem, run.coupling, pack(&kept)];
        let parts = KEPT.iter().map(|name| (*name).to_owned()).zip(states).collect();
        history.sync().and_then(|()| store.write(time, parts)).map_err(|e| e.to_string())
    }

    /// When both solvers were prepared.
    pub fn prepared_at(&self) -> Option<Instant> {
        self.prepared_at
    }

    /// When the first window in which something touches the structure was on record.
    pub fn touched_at(&self) -> Option<Instant> {
        self.touched_at
    }

    /// Memory allocations of this process from the end of its first window to that of its last, if there was one. What
    /// ends a run, its summary above all, allocates, and does not count.
    pub fn allocations(&self) -> Option<u64> {
        self.allocations.map(|(first, last)| last - first)
    }

    /// All committed windows are in the rows, and those on the disk itself, when this returns.
    pub fn sync(&mut self) -> Result<(), Diagnostic> {
        let Some(history) = &mut self.history else { return Ok(()) };
        self.rows
            .flush(&mut |row| history.row(row))
            .and_then(|()| history.sync())
            .map_err(|e| unwritable(run_dir::HISTORY, &e))
    }

    /// What both solvers reported while preparing.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }

    /// Extremes of the gauges that are results of their own.
    pub fn extremes(&self) -> Vec<Measure> {
        let measure = |g: &Gauge, which: &str, (value, time): (f64, f64)| {
            Measure::new(format!("{}_{which}", g.name), value, g.unit.clone()).at(time)
        };
        let seen = self.gauges.iter().filter(|t| t.gauge.extremes && t.smallest.0.is_finite());
        seen.flat_map(|t| [measure(&t.gauge, "min", t.smallest), measure(&t.gauge, "max", t.largest)])
            .collect()
    }

    /// A file of rows: a new one, or as it was at `mark`.
    fn open(&self, name: &str, columns: &[String], mark: Option<&Mark>) -> Result<History, Diagnostic> {
        let path = self.dir.join(name);
        let opened = match mark {
            None => History::create(&path, columns),
            Some(mark) => History::go_on(&path, columns, mark),
        };
        opened.map_err(|e| unwritable(&path.display().to_string(), &e))
    }
}

fn unwritable(file: &str, e: &std::io::Error) -> Diagnostic {
    Diagnostic::error(code::NOT_WRITTEN, format!("cannot write {file}: {e}"))
}

impl Observer for Records {
    fn prepared(&mut self, dem: &Side, fem: &Side, warnings: &[Diagnostic]) -> Result<(), Diagnostic> {
        self.prepared_at = Some(Instant::now());
        self.window_started = Instant::now();
        self.warnings.extend_from_slice(warnings);
        self.dem_gauges = dem.gauges.len();
        self.programs = [dem.program.clone(), fem.program.clone()];
        let none = ((f64::INFINITY, 0.0), (f64::NEG_INFINITY, 0.0));
        self.gauges = dem
            .gauges
            .iter()
            .chain(&fem.gauges)
            .map(|gauge| Tracked { gauge: gauge.clone(), smallest: none.0, largest: none.1 })
            .collect();
        let mut columns = vec!["time_s".to_string()];
        columns.extend(dem.columns().chain(fem.columns()));
        columns.extend(OWN_COLUMNS.map(String::from));
        self.row = Vec::with_capacity(columns.len());
        let means = (0..self.gauges.len()).filter(|i| self.gauges[*i].gauge.is_mean()).map(|i| i + 1);
        self.rows = Rows::new(columns.len(), means.collect(), self.interval);
        let kept = self.kept.take();
        let length = kept.as_ref().map(|kept| &kept.history);
        self.history = Some(self.open(run_dir::HISTORY, &columns, length)?);
        if self.iterations_wanted {
            let columns = [
                "window",
                "iteration",
                "start_s",
                "length_s",
                "residual_displacement_m",
                "residual_velocity_m",
                "increment_m",
                "factor",
                "seconds_s",
            ];
            let length = kept.as_ref().and_then(|kept| kept.iterations.as_ref());
            self.iterations = Some(self.open(run_dir::ITERATIONS, &columns.map(String::from), length)?);
        }
        if let Some(kept) = kept {
            (self.rows, self.counts) = (kept.rows, kept.counts);
            for (gauge, [smallest, largest]) in self.gauges.iter_mut().zip(kept.extremes) {
                (gauge.smallest, gauge.largest) = (smallest, largest);
            }
        }
        Ok(())
    }

    fn iteration(&mut self, iteration: &Iteration) -> Result<(), Diagnostic> {
        self.counts.1 += 1;
        let Some(file) = &mut self.iterations else { return Ok(()) };
        let r = &iteration.residual;
        let seconds = self.window_started.elapsed().as_secs_f64();
        self.window_started = Instant::now();
        file.row(&[
            iteration.span.number as f64,
            iteration.iteration.into(),
            iteration.span.start,
            iteration.span.length,
            r.displacement,
            r.velocity,
            r.displacement_increment,
            iteration.factor,
            seconds,
        ])
        .map_err(|e| unwritable(run_dir::ITERATIONS, &e))
    }

    fn is_due(&mut self, interrupted: bool) -> bool {
        self.store.as_ref().is_some_and(|store| interrupted || store.is_due())
    }

    fn keep(&mut self, time: f64, run: KeptRun) {
        if let Err(what) = self.write_checkpoint(time, run) {
            tracing::warn!("no checkpoint at t = {time} s, and none from here on: {what}");
            self.store = None;
        }
    }

    fn cannot_keep(&mut self, solver: &str) {
        tracing::warn!("no checkpoints are written: {solver} cannot write its state down");
        self.store = None;
    }

    fn committed(&mut self, c: &Committed) -> Result<(), Diagnostic> {
        self.counts.0 += 1;
        let time = c.span.end();
        self.row.clear();
        self.row.push(time);
        let answers = c.dem.chunks_exact(3).chain(c.fem.chunks_exact(3));
        for (tracked, gauge) in self.gauges.iter_mut().zip(answers) {
            self.row.push(gauge[0]);
            if gauge[1] < tracked.smallest.0 {
                tracked.smallest = (gauge[1], time);
            }
            if gauge[2] > tracked.largest.0 {
                tracked.largest = (gauge[2], time);
            }
        }
        let defect = c.balance.structure_work - c.balance.mesh_work;
        self.row.extend([c.balance.imbalance, defect, c.iterations.into(), c.residual.displacement]);
        let history = self.history.as_mut().expect("created when both were prepared");
        self.rows
            .take(c.span.start, &self.row, c.touches, |row| history.row(row))
            .map_err(|e| unwritable(run_dir::HISTORY, &e))?;
        if c.touches && self.touched_at.is_none() {
            self.touched_at = Some(Instant::now());
        }
        let (windows, iterations) = self.counts;
        let residual = Some(c.residual.displacement);
        let end = self.end_time;
        self.progress.report(|| Line { t: time, end, windows, iterations, residual, what: String::new() });
        // The first window may grow what later ones use again.
        let now = allocations();
        self.allocations = Some((self.allocations.map_or(now, |(first, _)| first), now));
        Ok(())
    }
}

/// Measures that a run with a net is expected to have, and the side that reports them.
const EXPECTED: [(usize, &[&str]); 2] = [
    (
        0,
        &[
            "impact_speed",
            "time_of_impact",
            "max_deflection",
            "braking_time",
            "rebound_speed",
            "max_penetration",
        ],
    ),
    (1, &["max_reaction", "max_reaction_1ms", "max_cable_force", "sag"]),
];

/// Fill `summary` with what is known of the run, finished or not.
pub fn describe(
    summary: &mut Summary,
    coupling: &Coupling,
    records: &Records,
    statistics: Option<&(Statistics, Statistics)>,
) {
    summary.warnings.extend_from_slice(records.warnings());
    match statistics {
        Some((dem, fem)) => {
            for (program, statistics) in records.programs.iter().zip([dem, fem]) {
                if let Err(taken) = summary.take(program, statistics) {
                    summary.fail(taken);
                }
            }
            name_absent(summary, &records.programs, [dem, fem]);
        }
        None => {
            let what = "the solvers' measures are absent: the run ended before they could report them";
            summary.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
        }
    }
    records.extremes().into_iter().for_each(|measure| summary.add(measure));
    drop_unresolved(summary, coupling.sample_length());
    describe_energy(summary, coupling, records);
    describe_coupling(summary, coupling);
    coupling.limits.judge(summary, &coupling.causes().evidence());
}

/// Time over which `max_reaction_1ms` is a mean [s].
const MEAN: f64 = 1e-3;

/// Least number of parts of that time: with fewer of them the mean, and the net that moves in a straight line through
/// each, were found up to 1.7 % wrong without anything else that shows it (`tests/examples/limits.rs`).
const PARTS: f64 = 4.0;

/// A mean over 1 ms is left out where the force between rock and net is constant over longer parts of it.
fn drop_unresolved(summary: &mut Summary, sample: f64) {
    let name = "max_reaction_1ms";
    if sample > MEAN / PARTS * (1.0 + 1e-9) && summary.measure(name).is_some() {
        summary.measures.retain(|m| m.name != name);
        let why =
            format!("the contact force is known as means over {sample:e} s, longer than a quarter of 1 ms");
        let hint = "shorten coupling.time_window, or raise coupling.samples";
        summary.warnings.push(Diagnostic::absent(name, &why).try_instead(hint));
    }
}

/// A warning for the expected measures that are absent and of which their solver has not said so. One that names no measure as its
/// key speaks of all that are absent.
fn name_absent(summary: &mut Summary, programs: &[String; 2], statistics: [&Statistics; 2]) {
    for (side, names) in EXPECTED {
        // Those of a rock begin with its name.
        let has = |name: &str| summary.measures.iter().any(|m| m.name.ends_with(name));
        let explains = |w: &Diagnostic, name: &str| {
            w.code == code::ABSENT_MEASURE && w.key.as_ref().is_none_or(|key| key.ends_with(name))
        };
        let said = |name: &str| statistics[side].warnings.iter().any(|w| explains(w, name));
        let absent: Vec<&str> = names.iter().copied().filter(|name| !has(name) && !said(name)).collect();
        if !absent.is_empty() {
            let (is, them) = if absent.len() == 1 { ("is", "it") } else { ("are", "them") };
            let (names, who) = (absent.join(", "), &programs[side]);
            let what = format!("{names} {is} absent: {who} does not report {them}");
            summary.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
        }
    }
}

fn describe_coupling(summary: &mut Summary, coupling: &Coupling) {
    let counts = &coupling.counts;
    let windows = counts.windows;
    summary.coupling = [
        ("windows", json!(windows)),
        ("iterations", json!(counts.iterations)),
        ("iterations_per_window", json!(counts.iterations as f64 / (windows.max(1)) as f64)),
        ("most_iterations", json!(counts.most_iterations)),
        ("windows_halved", json!(counts.halved)),
        ("windows_diverged", json!(counts.diverged)),
        ("windows_shortened", json!(counts.short)),
        ("windows_unconverged", json!(counts.unconverged)),
        ("residual_largest_m", json!(counts.largest_residual)),
    ]
    .into_iter()
    .map(|(key, value)| (key.to_string(), value))
    .collect();
    if counts.selections > 0 {
        summary.coupling.insert("selections".into(), json!(counts.selections));
    }
    if let Some(share) = coupling.balance.residual_share(coupling.has_balance) {
        summary.coupling.insert("residual_energy_share".into(), json!(share));
    }
    if counts.unconverged > 0 {
        let what = format!(
            "{} of {windows} windows were accepted although they had not converged (coupling.on_no_convergence = \
             \"accept\"); largest residual {:.2e} m",
            counts.unconverged, counts.largest_residual
        );
        summary.warnings.push(Diagnostic::warning(code::NOT_CONVERGED, what));
    }
}

fn describe_energy(summary: &mut Summary, coupling: &Coupling, records: &Records) {
    let balance = &coupling.balance;
    let [dem, fem, interface] = balance.origins();
    let energy = &mut summary.energy;
    for (name, joules) in [
        ("interface_work_structure_J", balance.structure_work),
        ("interface_work_mesh_J", balance.mesh_work),
        ("interface_defect_J", balance.defect),
        ("imbalance_contact_solver_J", dem),
        ("imbalance_structure_J", fem),
        ("imbalance_interface_J", interface),
        ("imbalance_largest_J", balance.system.largest.0),
    ]
    .into_iter()
    .take(if coupling.has_balance { 7 } else { 3 })
    {
        energy.insert(name.into(), json!(joules));
    }
    if records.prepared_at().is_none() {
        return;
    }
    if !coupling.has_balance {
        let why =
            "a solver does not report its kinetic, potential, stored, dissipated energy and received work";
        summary.warnings.push(energy::absent(why));
        return;
    }
    let (Some(reference), Some(value)) = (balance.system.reference(), balance.system.error()) else {
        summary.warnings.push(energy::absent(NOTHING_MOVED));
        return;
    };
    energy.insert("reference_J".into(), json!(reference));
    energy.insert(ENERGY_ERROR.into(), json!(value));
    summary.measures.push(energy::error_measure(value, balance.system.largest.1));
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::toolkit::summary::RunStatus;

    #[test]
    fn a_mean_over_a_millisecond_is_left_out_where_less_than_four_parts_lie_in_it() {
        for (sample, kept) in [(2.5e-4, 2), (2.6e-4, 1)] {
            let mut summary = Summary::new(RunStatus::Done);
            summary.measures =
                ["max_reaction", "max_reaction_1ms"].map(|name| Measure::new(name, 1.0, "N")).to_vec();
            drop_unresolved(&mut summary, sample);
            assert_eq!((summary.measures.len(), summary.warnings.len()), (kept, 2 - kept));
        }
    }

    #[test]
    fn an_expected_measure_that_nobody_reports_is_named_with_its_solver() {
        let names = ["rock_impact_speed", "rock_max_penetration", "max_reaction", "max_reaction_1ms"];
        let programs = ["dem (a)".into(), "fem (b)".into()];
        let said = |warning: Diagnostic| {
            let mut summary = Summary::new(RunStatus::Done);
            summary.measures = names.map(|name| Measure::new(name, 1.0, "1")).to_vec();
            let of_structure = Statistics { warnings: vec![warning], ..Statistics::default() };
            name_absent(&mut summary, &programs, [&Statistics::default(), &of_structure]);
            summary.warnings.iter().map(Diagnostic::to_string).collect::<Vec<_>>()
        };
        let sag = Diagnostic::absent("sag", "no weight acts on the structure");
        let of_contact = "time_of_impact, max_deflection, braking_time, rebound_speed are absent: dem (a) does not report them";
        assert_eq!(
            said(sag.clone().about("sag")),
            [of_contact, "max_cable_force is absent: fem (b) does not report it"]
        );
        // Who explains what is absent without a key explains all of it.
        assert_eq!(said(sag), [of_contact]);
        assert_eq!(said(Diagnostic::warning(code::OTHER, "sag, max_cable_force")).len(), 2);
    }
}
