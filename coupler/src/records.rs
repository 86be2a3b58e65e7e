//! Result files of a coupled run: `history.csv`, `iterations.csv`, and for `summary.json` the measures and the cost.

use crate::coupling::{Committed, Counts, Coupling, Iteration, KeptRun, Observer};
use crate::fields::{Fields, KeptFields};
use crate::interface::Moved;
use crate::rows::{OWN_COLUMNS, Pending, Rows};
use crate::side::Side;
use interface_defs::{
    Diagnostic, Fault, Gauge, Statistics, code,
    ipc::{Remote, serve::with_cost},
};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;
use toolkit::alloc::allocations;
use toolkit::checkpoint::{Checkpoint, Store, pack, unpack};
use toolkit::energy;
use toolkit::history::{History, Mark};
use toolkit::numbers::{percent, short};
use toolkit::output::Output;
use toolkit::owner::note_programs;
use toolkit::progress::{Form, Line, Reporter};
use toolkit::recorder::{KeptRows, Recorder, describe_processes, open, unwritable};
use toolkit::run_dir;
use toolkit::summary::{Summary, totals};
use toolkit::uncertainty::{self, Known};

/// Writes the rows of a run.
pub struct Records {
    dir: PathBuf,
    end_time: f64,
    interval: f64,
    iterations_wanted: bool,
    progress: Reporter,
    recorder: Option<Recorder>,
    iterations: Option<History>,
    rows: Rows,
    /// Interval of the fields of the interface [s], if they are written.
    fields_interval: Option<f64>,
    fields: Option<Fields>,
    warnings: Vec<Diagnostic>,
    /// Who the two solvers are.
    programs: [String; 2],
    /// When both solvers were prepared.
    prepared_at: Option<Instant>,
    /// When the first window in which something touches the structure was on record.
    touched_at: Option<Instant>,
    window_started: Instant,
    /// Memory allocations of this process when its first window was on record, and its latest. What ends a run, its summary above all,
    /// allocates, and does not count.
    allocations: Option<(u64, u64)>,
    checkpoints: Store,
    /// Where these records go on, if they do not begin.
    kept: Option<KeptRecords>,
}

/// What is kept of the records themselves.
#[derive(Serialize, Deserialize)]
struct KeptRecords {
    pending: Pending,
    rows: KeptRows,
    /// `iterations.csv` as it was.
    iterations: Option<Mark>,
    fields: Option<KeptFields>,
}

/// Names of the parts of a checkpoint: both solvers, the loop, the records.
const KEPT: [&str; 4] = ["dem", "fem", "coupling", "records"];

/// Columns of `iterations.csv`.
const ITERATIONS: [&str; 9] = [
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

impl Records {
    /// Records of a run to `end_time` [s] in `dir`, as `output` says; with `progress`, lines on stdout.
    pub fn new(dir: &Path, end_time: f64, output: &Output, progress: Option<Form>) -> Self {
        Self {
            dir: dir.into(),
            end_time,
            interval: output.interval,
            iterations_wanted: output.iterations,
            progress: Reporter::new(progress),
            recorder: None,
            iterations: None,
            rows: Rows::new(0, Vec::new(), output.interval),
            fields_interval: None,
            fields: None,
            warnings: Vec::new(),
            programs: Default::default(),
            prepared_at: None,
            touched_at: None,
            window_started: Instant::now(),
            allocations: None,
            checkpoints: Store::none(),
            kept: None,
        }
    }

    /// Write `checkpoints`. Of a run that goes on from `resume`, the state of the rest of it.
    ///
    /// # Errors
    /// If a part of that state is missing or cannot be read.
    pub fn keep_in(
        &mut self,
        checkpoints: Store,
        resume: Option<&Checkpoint>,
    ) -> Result<Option<KeptRun>, Fault> {
        self.checkpoints = checkpoints;
        let Some(from) = resume else { return Ok(None) };
        let [dem, fem, coupling, records] = KEPT.map(|name| from.part(name));
        self.kept = Some(unpack(records?)?);
        Ok(Some(KeptRun { dem: dem?.to_vec(), fem: fem?.to_vec(), coupling: coupling?.to_vec() }))
    }

    /// Write the interface over time, every `interval` [s], for a structure that writes no fields of its own.
    pub fn with_fields(&mut self, interval: Option<f64>) {
        self.fields_interval = interval;
    }

    /// Whether both solvers were prepared.
    pub fn have_begun(&self) -> bool {
        self.prepared_at.is_some()
    }

    /// All committed windows are in the rows, and those on the disk itself, when this returns.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn sync(&mut self) -> Result<(), Diagnostic> {
        let Some(recorder) = &mut self.recorder else { return Ok(()) };
        let (_, file) = recorder.row();
        self.rows.flush(&mut |row| file.row(row)).map_err(|e| unwritable(Path::new(run_dir::HISTORY), &e))?;
        if let Some(fields) = &mut self.fields {
            fields.finish().map_err(|e| unwritable(Path::new(run_dir::FIELDS), &e))?;
        }
        recorder.sync()
    }
}

impl Observer for Records {
    fn prepared(&mut self, dem: &Side, fem: &Side, warnings: &[Diagnostic]) -> Result<(), Diagnostic> {
        self.prepared_at = Some(Instant::now());
        self.window_started = Instant::now();
        self.warnings.extend_from_slice(warnings);
        self.programs = [dem.program.clone(), fem.program.clone()];
        let said = [("dem", dem), ("fem", fem)]
            .map(|(part, Side { hello, .. })| (part, &*hello.program, hello.build()));
        note_programs(&self.dir, said).map_err(|e| unwritable(&self.dir.join(run_dir::RECORD), &e))?;
        let gauges = dem.gauges.iter().chain(&fem.gauges);
        let columns = 1 + gauges.clone().count() + OWN_COLUMNS.len();
        // The first column is the time, and those behind the gauges are the force of the contact.
        let means = gauges.map(Gauge::is_mean).chain([true; 3]).zip(1..);
        let means = means.filter_map(|(is_mean, column)| is_mean.then_some(column)).collect();
        self.rows = Rows::new(columns, means, self.interval);
        let programs = [dem, fem].map(|side| (side.program.as_str(), &side.gauges[..]));
        let (mut rows, mut iterations, mut fields) = (None, None, None);
        if let Some(kept) = self.kept.take() {
            self.rows.go_on(kept.pending)?;
            (rows, iterations, fields) = (Some(kept.rows), kept.iterations, kept.fields);
        }
        if let Some(interval) = self.fields_interval {
            let dir = self.dir.join(run_dir::FIELDS);
            self.fields = Some(Fields::new(&dir, interval, fields).map_err(|e| unwritable(&dir, &e))?);
        }
        self.recorder = Some(Recorder::open(&self.dir, &programs, &OWN_COLUMNS, rows)?);
        if self.iterations_wanted {
            let path = self.dir.join(run_dir::ITERATIONS);
            self.iterations = Some(open(&path, &ITERATIONS.map(String::from), iterations.as_ref())?);
        }
        Ok(())
    }

    fn moved(&mut self, moved: &Moved) -> Result<(), Diagnostic> {
        let Some(fields) = &mut self.fields else { return Ok(()) };
        fields.add(moved).map_err(|e| unwritable(Path::new(run_dir::FIELDS), &e))
    }

    fn iteration(&mut self, iteration: &Iteration) -> Result<(), Diagnostic> {
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
        .map_err(|e| unwritable(Path::new(run_dir::ITERATIONS), &e))
    }

    fn is_due(&mut self, interrupted: bool) -> bool {
        self.checkpoints.is_due(interrupted)
    }

    fn keep(&mut self, time: f64, run: KeptRun) {
        let Some(recorder) = &self.recorder else { return };
        let fields = match self.fields.as_mut().map(Fields::kept).transpose() {
            Ok(fields) => fields,
            Err(e) => return tracing::warn!("no checkpoint is written: the fields of the interface: {e}"),
        };
        let kept = KeptRecords {
            pending: self.rows.kept(),
            rows: recorder.kept(),
            iterations: self.iterations.as_ref().map(History::mark),
            fields,
        };
        self.checkpoints.keep(time, || {
            recorder.sync()?;
            let states = [run.dem, run.fem, run.coupling, pack(&kept)];
            Ok(KEPT.map(str::to_owned).into_iter().zip(states).collect())
        });
    }

    fn cannot_keep(&mut self, solver: &str) {
        tracing::warn!("no checkpoints are written: {solver} cannot write its state down");
        self.checkpoints = Store::none();
    }

    fn committed(&mut self, c: &Committed) -> Result<(), Diagnostic> {
        let _span = interface_defs::profile!("record", window = c.span.number);
        let recorder = self.recorder.as_mut().expect("opened when both were prepared");
        let time = c.span.end();
        recorder.take(time, c.dem.as_chunks().0.iter().chain(c.fem.as_chunks().0));
        let defect = c.balance.structure_work - c.balance.mesh_work;
        let (row, file) = recorder.row();
        row.extend(c.contact);
        row.extend([c.balance.imbalance, defect, c.iterations.into(), c.residual.displacement]);
        self.rows
            .take(c.span.start, row, c.touches, |row| file.row(row))
            .map_err(|e| unwritable(Path::new(run_dir::HISTORY), &e))?;
        if c.touches && self.touched_at.is_none() {
            self.touched_at = Some(Instant::now());
        }
        let Counts { windows, iterations, .. } = *c.counts;
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
    summary.warnings.extend_from_slice(&records.warnings);
    if let Some(what) = &coupling.examination.unsettled {
        let what = format!("{} may break the interface contract (PROTOCOL.md): {what}", records.programs[1]);
        let hint = "rockfall conform examines it with windows of its own";
        summary.warnings.push(Diagnostic::warning(code::CONTRACT, what).try_instead(hint));
    }
    match statistics {
        Some((dem, fem)) => {
            for (program, statistics) in records.programs.iter().zip([dem, fem]) {
                take(summary, program, statistics);
            }
            take(summary, "coupler", &coupling.derived.fill([dem, fem]));
            name_absent(summary, &records.programs, [dem, fem]);
        }
        None => {
            let what = "the solvers' measures are absent: the run ended before they could report them";
            summary.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
        }
    }
    let extremes = records.recorder.iter().flat_map(Recorder::measures).collect();
    take(summary, "coupler", &Statistics { measures: extremes, ..Statistics::default() });
    drop_unresolved(summary, coupling.sample_length());
    describe_energy(summary, coupling, records);
    describe_coupling(summary, coupling);
    let balance = &coupling.balance;
    // A net that yields moves within a window; else there is one force for each part of it.
    let mean = if coupling.counts.selections > 0 { 0.0 } else { coupling.sample_length() };
    let known =
        Known { balance: coupling.has_balance.then_some(&balance.system), chance: summary.chance(), mean };
    uncertainty::estimate(&mut summary.measures, known);
    let mut evidence = coupling.causes().evidence();
    let windows = uncertainty::of_windows(&summary.measures, mean);
    if balance.system.error().is_some_and(|error| error < windows) {
        evidence.energy = format!(
            "the force is one mean over {} s, {} of the time in which the rock is stopped: shorten coupling.time_window, or leave \
             out coupling.scheme, so that the net yields",
            short(mean),
            percent(windows)
        );
    }
    coupling.limits.judge(summary, &evidence);
    uncertainty::scatter(&mut summary.measures);
}

/// Take in what a program reports; a name that another one has given fails the run.
fn take(summary: &mut Summary, program: &str, statistics: &Statistics) {
    if let Err(taken) = summary.take(program, statistics) {
        summary.fail(taken);
    }
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
    let per_window = counts.iterations as f64 / windows.max(1) as f64;
    let Value::Object(section) = json!({
        "windows": windows,
        "iterations": counts.iterations,
        "iterations_per_window": per_window,
        "most_iterations": counts.most_iterations,
        "windows_halved": counts.halved,
        "windows_diverged": counts.diverged,
        "windows_shortened": counts.short,
        "windows_unconverged": counts.unconverged,
        "residual_largest_m": counts.largest_residual,
    }) else {
        unreachable!("an object")
    };
    summary.coupling = section;
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
    let mut add = |name: &str, joules: f64| summary.energy.insert(name.into(), json!(joules));
    add("interface_work_structure_J", balance.structure_work);
    add("interface_work_mesh_J", balance.mesh_work);
    add("interface_defect_J", balance.defect);
    if coupling.has_balance {
        let [dem, fem, interface] = balance.origins();
        add("imbalance_contact_solver_J", dem);
        add("imbalance_structure_J", fem);
        add("imbalance_interface_J", interface);
        balance.system.describe(summary);
        let own = summary.measures.iter_mut().filter(|measure| measure.source.is_empty());
        own.for_each(|measure| measure.source = "coupler".into());
    } else if records.prepared_at.is_some() {
        let why =
            "a solver does not report its kinetic, potential, stored, dissipated energy and received work";
        summary.warnings.push(energy::absent(why));
    }
}

/// When the run began, and when its loop ended.
pub(crate) struct Clock {
    /// The program has read its command line.
    pub started: Instant,
    /// The last window is committed, or the run has failed.
    pub loop_ended: Instant,
}

/// Fill `cost` of `summary`; `statistics` are those of the contact solver and of the structure's, if they could report them.
pub(crate) fn describe_cost(
    summary: &mut Summary,
    records: &Records,
    clock: &Clock,
    statistics: Option<&(Statistics, Statistics)>,
    remotes: &[Remote],
) {
    let Clock { started, loop_ended } = *clock;
    let prepared = records.prepared_at.unwrap_or(loop_ended);
    let looping = (loop_ended - prepared).as_secs_f64();
    let exchanges: u64 = remotes.iter().map(|remote| remote.sequence).sum();
    let waited: f64 = remotes.iter().map(|remote| remote.waited).sum();
    let of_solvers: Vec<&Statistics> = statistics.iter().flat_map(|(dem, fem)| [dem, fem]).collect();
    if !of_solvers.is_empty() {
        describe_exchange(summary, exchanges, waited, &of_solvers);
    }
    let cost = &mut summary.cost;
    cost.insert("wall_s".into(), json!(started.elapsed().as_secs_f64()));
    cost.insert("loop_s".into(), json!(looping));
    let preparing = (prepared - started).as_secs_f64();
    let flying = (records.touched_at.unwrap_or(loop_ended) - prepared).as_secs_f64();
    let stages =
        [("prepare_s", preparing), ("flight_s", flying), ("impact_s", looping - flying), ("loop_s", looping)];
    cost.insert(
        "stages".into(),
        stages.map(|(stage, seconds)| (stage.to_owned(), json!(seconds))).into_iter().collect(),
    );
    cost.insert("exchanges".into(), json!(exchanges));
    cost.insert("windows".into(), summary.coupling.get("windows").cloned().unwrap_or_default());
    cost.insert("iterations".into(), summary.coupling.get("iterations").cloned().unwrap_or_default());
    totals(cost, &of_solvers);
    // A run that ended before its second window has none to count.
    let allocations = records.allocations;
    let allocations =
        allocations.map(|(first, last)| ("allocations_after_first_window".into(), last - first));
    let counts = allocations.into_iter().collect();
    let own = with_cost(Statistics { counts, ..Statistics::default() }, 0.0);
    let solvers = ["dem", "fem"].into_iter().zip(of_solvers);
    describe_processes(summary, std::iter::once(("coupler", &own)).chain(solvers));
}

/// The mean time of an exchange beside the computing of the solvers.
fn describe_exchange(summary: &mut Summary, exchanges: u64, waited: f64, of_solvers: &[&Statistics]) {
    let inside: f64 = of_solvers.iter().map(|s| s.solve_seconds).sum();
    if of_solvers.iter().all(|s| s.solve_seconds > 0.0) && exchanges > 0 {
        let each = (waited - inside) / exchanges as f64;
        summary.cost.insert("exchange_microseconds".into(), json!(1e6 * each));
    } else {
        let why = "a solver does not report its seconds inside solve";
        summary.warnings.push(Diagnostic::absent("exchange_microseconds", why));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::Measure;
    use toolkit::summary::RunStatus;

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
        assert_eq!(said(sag.clone()), [of_contact, "max_cable_force is absent: fem (b) does not report it"]);
        // Who explains what is absent without a key explains all of it.
        assert_eq!(said(Diagnostic { key: None, ..sag }), [of_contact]);
        assert_eq!(said(Diagnostic::warning(code::OTHER, "sag, max_cable_force")).len(), 2);
    }
}
