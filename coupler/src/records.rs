//! Result files of a coupled run: `history.csv`, `iterations.csv`, and the measures for `summary.json`.

use crate::coupling::{Committed, Coupling, Iteration, Observer};
use crate::handshake::Side;
use interface_defs::toolkit::alloc::allocations;
use interface_defs::toolkit::history::{History, gauge_column};
use interface_defs::toolkit::progress::{Form, Line, Reporter};
use interface_defs::toolkit::run_dir;
use interface_defs::toolkit::summary::Summary;
use interface_defs::{Gauge, Measure, Statistics};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Writes the rows of a run.
pub struct Records {
    dir: PathBuf,
    end_time: f64,
    iterations_wanted: bool,
    progress: Reporter,
    history: Option<History>,
    iterations: Option<History>,
    row: Vec<f64>,
    gauges: Vec<Tracked>,
    dem_gauges: usize,
    warnings: Vec<String>,
    counts: (u64, u64),
    prepared_at: Option<Instant>,
    window_started: Instant,
    allocations: Option<u64>,
}

/// A gauge and its extremes over the committed windows.
struct Tracked {
    gauge: Gauge,
    smallest: (f64, f64),
    largest: (f64, f64),
}

impl Records {
    /// Records of a run to `end_time` [s] in `dir`; with `progress`, lines on stdout.
    pub fn new(dir: &Path, end_time: f64, iterations: bool, progress: Option<Form>) -> Self {
        let now = Instant::now();
        Self {
            dir: dir.into(),
            end_time,
            iterations_wanted: iterations,
            progress: Reporter::new(progress),
            history: None,
            iterations: None,
            row: Vec::new(),
            gauges: Vec::new(),
            dem_gauges: 0,
            warnings: Vec::new(),
            counts: (0, 0),
            prepared_at: None,
            window_started: now,
            allocations: None,
        }
    }

    /// When both solvers were prepared.
    pub fn prepared_at(&self) -> Option<Instant> {
        self.prepared_at
    }

    /// Memory allocations of this process after its first window, if there was one.
    pub fn allocations(&self) -> Option<u64> {
        self.allocations.map(|first| allocations() - first)
    }

    /// All rows are on the disk itself when this returns.
    pub fn sync(&self) -> Result<(), String> {
        match &self.history {
            Some(history) => history.sync().map_err(|e| format!("cannot write {}: {e}", run_dir::HISTORY)),
            None => Ok(()),
        }
    }

    /// What both solvers said while preparing.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Extremes of the gauges that are results of their own.
    pub fn extremes(&self) -> Vec<Measure> {
        let measure = |g: &Gauge, which: &str, (value, time): (f64, f64)| Measure {
            name: format!("{}_{which}", g.name),
            value,
            unit: g.unit.clone(),
            time: Some(time),
        };
        let seen = self.gauges.iter().filter(|t| t.gauge.extremes && t.smallest.0.is_finite());
        seen.flat_map(|t| [measure(&t.gauge, "min", t.smallest), measure(&t.gauge, "max", t.largest)])
            .collect()
    }

    fn create(&self, name: &str, columns: &[String]) -> Result<History, String> {
        let path = self.dir.join(name);
        History::create(&path, columns).map_err(|e| format!("cannot write {}: {e}", path.display()))
    }
}

impl Observer for Records {
    fn prepared(&mut self, dem: &Side, fem: &Side, warnings: &[String]) -> Result<(), String> {
        self.prepared_at = Some(Instant::now());
        self.window_started = Instant::now();
        self.warnings.extend_from_slice(warnings);
        self.dem_gauges = dem.gauges.len();
        let none = ((f64::INFINITY, 0.0), (f64::NEG_INFINITY, 0.0));
        self.gauges = dem
            .gauges
            .iter()
            .chain(&fem.gauges)
            .map(|gauge| Tracked { gauge: gauge.clone(), smallest: none.0, largest: none.1 })
            .collect();
        let mut columns = vec!["time_s".to_string()];
        columns.extend(self.gauges.iter().map(|t| gauge_column(&t.gauge)));
        columns.extend(
            ["energy_imbalance_J", "energy_interface_defect_J", "iterations", "residual"].map(String::from),
        );
        if let Some(twice) = columns.iter().enumerate().find(|(i, c)| columns[..*i].contains(c)) {
            return Err(format!("two gauges are named \"{}\"; rename a rock or a gauge", twice.1));
        }
        self.row = Vec::with_capacity(columns.len());
        self.history = Some(self.create(run_dir::HISTORY, &columns)?);
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
            self.iterations = Some(self.create(run_dir::ITERATIONS, &columns.map(String::from))?);
        }
        Ok(())
    }

    fn iteration(&mut self, iteration: &Iteration) -> Result<(), String> {
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
        .map_err(|e| format!("cannot write {}: {e}", run_dir::ITERATIONS))
    }

    fn committed(&mut self, c: &Committed) -> Result<(), String> {
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
        let defect = c.balance.structure_work - c.balance.wall_work;
        self.row.extend([c.balance.imbalance, defect, c.iterations.into(), c.residual.displacement]);
        let history = self.history.as_mut().expect("created when both were prepared");
        history.row(&self.row).map_err(|e| format!("cannot write {}: {e}", run_dir::HISTORY))?;
        let (windows, iterations) = self.counts;
        let residual = Some(c.residual.displacement);
        let end = self.end_time;
        self.progress.report(|| Line { t: time, end, windows, iterations, residual, what: String::new() });
        // The first window may grow what later ones use again.
        if self.allocations.is_none() {
            self.allocations = Some(allocations());
        }
        Ok(())
    }
}

/// Names of measures that speak of energy at impact, to which `energy_error` relates.
const IMPACT_ENERGY: &str = "impact_energy";

/// Fill `summary` with what is known of the run, finished or not.
pub fn describe(
    summary: &mut Summary,
    coupling: &Coupling,
    records: &Records,
    statistics: Option<&(Statistics, Statistics)>,
) {
    summary.warnings.extend_from_slice(records.warnings());
    let (dem, fem) = statistics.map_or((None, None), |(dem, fem)| (Some(dem), Some(fem)));
    for told in [dem, fem].into_iter().flatten() {
        summary.measures.extend(told.measures.iter().cloned());
        summary.warnings.extend(told.warnings.iter().cloned());
    }
    if statistics.is_none() {
        summary
            .warnings
            .push("the solvers' measures are absent: the run ended before they could tell".into());
    }
    summary.measures.extend(records.extremes());
    describe_energy(summary, coupling);
    let counts = &coupling.counts;
    let (windows, failed) = (counts.windows, counts.halved);
    summary.coupling = [
        ("windows", json!(windows)),
        ("iterations", json!(counts.iterations)),
        ("iterations_per_window", json!(counts.iterations as f64 / (windows.max(1)) as f64)),
        ("most_iterations", json!(counts.most_iterations)),
        ("windows_halved", json!(failed)),
        ("windows_shortened", json!(counts.short)),
        ("windows_unconverged", json!(counts.unconverged)),
        ("residual_largest_m", json!(counts.largest_residual)),
    ]
    .into_iter()
    .map(|(key, value)| (key.to_string(), value))
    .collect();
    if counts.unconverged > 0 {
        summary.warnings.push(format!(
            "{} of {windows} windows were accepted although they had not converged (coupling.on_no_convergence = \
             \"accept\"); largest residual {:.2e} m",
            counts.unconverged, counts.largest_residual
        ));
    }
}

fn describe_energy(summary: &mut Summary, coupling: &Coupling) {
    let balance = &coupling.balance;
    let energy = &mut summary.energy;
    energy.insert("interface_work_structure_J".into(), json!(balance.structure_work));
    energy.insert("interface_work_wall_J".into(), json!(balance.wall_work));
    energy.insert("interface_defect_J".into(), json!(balance.defect));
    if !coupling.has_balance {
        summary.warnings.push(
            "energy_error is absent: a solver does not tell its kinetic, potential, stored, dissipated energy and \
             received work"
                .into(),
        );
        return;
    }
    energy.insert("imbalance_largest_J".into(), json!(balance.largest.0));
    let impact = summary.measures.iter().find(|m| m.name == IMPACT_ENERGY).map(|m| m.value);
    let reference = impact.unwrap_or(balance.largest_kinetic);
    if reference > 0.0 {
        let value = balance.largest.0 / reference;
        let time = Some(balance.largest.1);
        summary.measures.push(Measure { name: "energy_error".into(), value, unit: "1".into(), time });
        if value > ENERGY_BOUND {
            summary.warnings.push(format!(
                "energy_error is {:.2} %, above {} %: a shorter window or step, or strong coupling, is due",
                100.0 * value,
                100.0 * ENERGY_BOUND
            ));
        }
    } else {
        summary.warnings.push("energy_error is absent: nothing has moved".into());
    }
}

/// Share of the energy at impact that may be lost or gained before it is a warning.
const ENERGY_BOUND: f64 = 0.01;
