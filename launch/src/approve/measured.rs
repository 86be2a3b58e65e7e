//! The numbers of a launch, from the summary and the history of its runs. Definitions: EAD 340059-00-0106, as far as it could be read
//! (docs/approval.md).

use super::layout::{Layout, OWN, Part};
use super::site::{BLOCK, Block, CORNER, GRAVITY, Test};
use crate::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::verdict::{Fate, Torn};
use serde::Serialize;
use std::collections::HashMap;
use std::path::Path;
use toolkit::files;
use toolkit::run_dir::HISTORY;
use toolkit::summary::{RunStatus, Summary};

/// Length of the mean that a peak force is of, beside the raw one [s].
const MEAN: f64 = 1e-3;
/// The end of a run in which what still swings is looked for [s].
const TAIL: f64 = 0.3;

/// Which launch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// The first of a third of the energy.
    Sel1,
    /// The second of them, without repair.
    Sel2,
    /// The largest, at a new kit.
    Mel,
}

impl Which {
    /// In words.
    pub fn name(self) -> &'static str {
        ["SEL 1", "SEL 2", "MEL"][self as usize]
    }

    /// Name of the directory of its run.
    pub fn dir(self) -> &'static str {
        ["sel_1", "sel_2", "mel"][self as usize]
    }
}

/// `history.csv`.
#[derive(Default)]
pub struct History {
    columns: HashMap<String, usize>,
    rows: Vec<Vec<f64>>,
}

impl History {
    fn read(dir: &Path) -> Result<Self, csv::Error> {
        let mut table = csv::Reader::from_reader(files::source(&dir.join(HISTORY))?);
        let columns = table.headers()?.iter().enumerate().map(|(at, name)| (name.to_owned(), at)).collect();
        let numbers =
            |row: csv::StringRecord| row.iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        let rows = table.records().map(|row| row.map(numbers)).collect::<Result<_, _>>()?;
        Ok(Self { columns, rows })
    }

    /// A column; empty where there is none.
    fn column(&self, name: &str) -> Vec<f64> {
        let at = self.columns.get(name);
        at.map_or_else(Vec::new, |at| self.rows.iter().map(|row| row[*at]).collect())
    }

    /// Three columns, as vectors.
    fn vectors(&self, name: impl Fn(char) -> String) -> Vec<[f64; 3]> {
        let [x, y, z] = ['x', 'y', 'z'].map(|axis| self.column(&name(axis)));
        x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]).collect()
    }

    /// The last value of a column.
    pub fn last(&self, name: &str) -> f64 {
        self.column(name).last().copied().unwrap_or(f64::NAN)
    }

    /// Least and largest value of a column in the last rows.
    fn tail(&self, name: &str) -> (f64, f64) {
        let times = self.times();
        let from = times.last().map_or(0.0, |end| end - TAIL);
        let column = self.column(name);
        let tail = || times.iter().zip(&column).filter(|(t, _)| **t >= from).map(|(_, value)| *value);
        (tail().fold(f64::INFINITY, f64::min), tail().fold(f64::NEG_INFINITY, f64::max))
    }

    fn times(&self) -> Vec<f64> {
        self.column("time_s")
    }

    /// The last row up to a time [s].
    fn row_at(&self, time: f64) -> usize {
        self.times().partition_point(|t| *t <= time).saturating_sub(1)
    }
}

/// Whether a block that ended so was stopped. One that has left the net again for a moment was, too.
pub fn is_caught(fate: Fate) -> bool {
    matches!(fate, Fate::Stopped | Fate::Rebounded)
}

/// Column of the height between the bearing ropes.
fn left() -> String {
    format!("{OWN}_left_height_m")
}

/// A run that has ended.
#[derive(Default)]
pub struct Ended {
    /// Name of its directory.
    pub name: String,
    /// What it is of.
    pub of: String,
    /// What it came to, where it was not refused.
    pub summary: Option<Summary>,
    /// Why it is not done.
    pub reasons: Vec<Diagnostic>,
    /// Its rows.
    pub history: History,
}

impl Ended {
    /// The run in `dir`.
    pub fn of(
        dir: &Path,
        of: String,
        summary: Option<Summary>,
        errors: Vec<Diagnostic>,
    ) -> Result<Self, Stop> {
        let reasons = summary.as_ref().map_or(errors, |summary| summary.reasons.clone());
        // A run that failed at once has no rows.
        let rows =
            summary.as_ref().is_some_and(|s| s.status != RunStatus::Failed || dir.join(HISTORY).exists());
        let history = if rows { History::read(dir) } else { Ok(History::default()) };
        let history = history.map_err(|e| {
            Stop::failed(code::FILE_CONTENT, format!("{}: {HISTORY} cannot be read: {e}", dir.display()))
        })?;
        let name = dir.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Self { name, of, summary, reasons, history })
    }

    /// How it ended.
    pub fn status(&self) -> RunStatus {
        self.summary.as_ref().map_or(RunStatus::Failed, |summary| summary.status)
    }

    /// What became of the block.
    pub fn fate(&self) -> Option<Fate> {
        self.summary.as_ref()?.verdict.first().map(|verdict| verdict.fate)
    }

    /// Whether the block was stopped, and is with the net at the end.
    pub fn is_caught(&self) -> bool {
        matches!(self.status(), RunStatus::Done | RunStatus::Unreliable) && self.fate().is_some_and(is_caught)
    }

    /// Whether the block is no longer with the net: it is in flight beside it, or below anything that the net could reach. What its
    /// verdict says of a run that begins in flight concerns that flight alone.
    pub fn has_left(&self, test: &Test) -> bool {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.history.last(&format!("{BLOCK}_{axis}_m")));
        let number = |key| test.layout.number(key);
        let (height, half) = (number("height"), 0.5 * number("fields") * number("spacing"));
        let beside = x.abs() > half || z < 0.0 || z > height;
        (beside && self.history.last("contacts") == 0.0) || y > half + height
    }

    /// Whether what is left of its motion is within `near` [m], of the block and of the height between the ropes.
    pub fn is_settled(&self, near: f64) -> bool {
        let still = |column: &str| {
            let (least, most) = self.history.tail(column);
            most - least <= near
        };
        still(&format!("{BLOCK}_y_m")) && still(&left())
    }

    /// Why its numbers do not count.
    pub fn doubt(&self) -> Option<String> {
        let why = || {
            self.reasons.iter().map(Diagnostic::headline).collect::<Vec<_>>().join("; ").replace('\n', "; ")
        };
        (self.status() != RunStatus::Done).then(|| format!("{}: {}", self.status().word(), why()))
    }

    /// How it ended, in words.
    pub fn words(&self) -> String {
        let sentences = self.summary.as_ref().map(|summary| summary.sentences().join("; "));
        self.doubt().or(sentences.filter(|text| !text.is_empty())).unwrap_or_else(|| "done".into())
    }

    fn measure(&self, name: &str) -> Option<(f64, Option<f64>, Option<String>)> {
        let all = &self.summary.as_ref()?.measures;
        all.iter().find(|m| m.name == name).map(|m| (m.value, m.time, m.member.clone()))
    }
}

/// A number of a launch.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Row {
    /// What it is.
    pub name: String,
    /// `None`: not examined, and `note` says why.
    pub value: Option<f64>,
    /// Its unit, `1` for a number without.
    pub unit: &'static str,
    /// When [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Share of the strength, or of the stroke.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// Of a peak force: the vector.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vector: Option<[f64; 3]>,
    /// Which member.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub member: Option<String>,
    /// What should be known of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A launch with its numbers.
pub struct Launch {
    /// Which.
    pub which: Which,
    /// Name of the directory of its last run, and what that is of.
    pub last: [String; 2],
    /// Why its numbers do not count; of the run that brings the block to rest, too.
    pub doubt: Option<String>,
    /// What became of the block.
    pub fate: Option<Fate>,
    /// Whether it was stopped, and stayed with the net while it came to rest.
    pub stopped: bool,
    /// What tore; `None`: nothing of the structure can.
    pub torn: Option<Vec<Torn>>,
    /// Its numbers.
    pub rows: Vec<Row>,
}

impl Launch {
    /// From its run, and that in which the block came to rest. `now` is the structure before it; `None`: it never started.
    pub fn of(
        which: Which,
        test: &Test,
        now: Option<&Layout>,
        block: Block,
        run: Ended,
        rest: Option<Ended>,
    ) -> Self {
        let torn = |ended: &Ended| ended.summary.as_ref().and_then(|summary| summary.torn.clone());
        let both = [torn(&run), rest.as_ref().and_then(torn)];
        let any = both.iter().any(Option::is_some);
        let mut made = Self {
            which,
            last: rest
                .as_ref()
                .map(|rest| [&rest.name, &rest.of])
                .unwrap_or([&run.name, &run.of])
                .map(String::clone),
            doubt: run
                .doubt()
                .or(rest.as_ref().and_then(Ended::doubt).map(|why| format!("coming to rest {why}"))),
            fate: run.fate(),
            stopped: run.is_caught() && !rest.as_ref().is_some_and(|rest| rest.has_left(test)),
            torn: any.then(|| both.into_iter().flatten().flatten().collect()),
            rows: Vec::new(),
        };
        if let Some(now) = now.filter(|_| !run.history.rows.is_empty()) {
            let rows = Rows { now, block, run: &run, rest: rest.as_ref(), rows: Vec::new() };
            made.rows = rows.all(test, made.torn.as_deref().unwrap_or_default());
        }
        made
    }

    /// A number.
    pub fn row(&self, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.name == name)
    }

    /// The same, its value.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.row(name)?.value
    }
}

/// The numbers of a launch in the making.
struct Rows<'a> {
    now: &'a Layout,
    block: Block,
    run: &'a Ended,
    rest: Option<&'a Ended>,
    rows: Vec<Row>,
}

impl Rows<'_> {
    fn add(&mut self, name: impl Into<String>, value: Option<f64>, unit: &'static str) -> &mut Row {
        self.rows.push(Row { name: name.into(), value, unit, ..Row::default() });
        self.rows.last_mut().expect("it was pushed")
    }

    /// A measure of the run; absent ones are left out.
    fn peak(&mut self, name: String, measure: &str, unit: &'static str) -> Option<&mut Row> {
        let (value, time, member) = self.run.measure(measure)?;
        let row = self.add(name, Some(value), unit);
        (row.time_s, row.member) = (time, member);
        Some(row)
    }

    fn all(mut self, test: &Test, torn: &[Torn]) -> Vec<Row> {
        let touch = self.run.measure("time_of_impact").map_or(f64::NAN, |(t, ..)| t);
        let (way, end) = self
            .run
            .measure("max_elongation")
            .map_or((None, f64::NAN), |(way, time, _)| (Some(way), time.unwrap_or(f64::NAN)));
        self.add("block_mass", Some(self.block.mass), "kg");
        self.add("block_edge", Some(self.block.size), "m");
        self.peak("impact_speed".into(), "impact_speed", "m/s");
        let energy = self.run.measure("impact_energy").map(|(energy, ..)| energy);
        self.add("impact_energy", energy, "J");
        let fall = way.map(|way| self.block.mass * GRAVITY * way);
        self.add("absorbed_energy", energy.zip(fall).map(|(kinetic, fall)| kinetic + fall), "J").note =
            Some("m v2/2 + m g e".into());
        self.add("max_elongation", way, "m").time_s = Some(end);
        // A block that was not stopped has no way of braking.
        let stop = if self.run.is_caught() { end } else { f64::NAN };
        self.add("braking_time", Some(stop - touch).filter(|t| t.is_finite()), "s").note =
            Some("from the first contact to the largest elongation".into());
        self.block_force(touch, stop);
        let top = self.run.history.column(&format!("{OWN}_top_height_m"));
        let before = top.get(self.run.history.row_at(touch)).copied();
        self.add("h_N", before, "m");
        self.residual_height(test, before);
        self.clearance(end);
        for part in torn {
            let row = self.add(format!("broken {}", part.part), Some(part.elements as f64), "1");
            (row.time_s, row.member) = (Some(part.first), Some(part.member.clone()));
            row.note = Some(format!("the first under {:.1} kN", 1e-3 * part.force));
        }
        let mut brakes = Vec::new();
        for part in &test.layout.parts {
            self.part(part);
            if part.element == "brake" {
                brakes.extend((0..part.members.len()).map(|i| part.member(i)));
            }
        }
        for (name, _) in test.layout.supports() {
            self.support(&name);
        }
        self.energies(&brakes, end, energy.zip(fall).map(|(kinetic, fall)| kinetic + fall));
        self.rows
    }

    /// Force of the structure on the block, from its motion: `m (dv/dt - g)`.
    fn block_force(&mut self, touch: f64, end: f64) {
        let history = &self.run.history;
        let (times, speeds) = (history.times(), history.vectors(|axis| format!("{BLOCK}_v{axis}_m_per_s")));
        let mass = self.block.mass;
        let mean = |from: usize, to: usize| {
            let step = times[to] - times[from];
            let change =
                |k: usize| (speeds[to][k] - speeds[from][k]) / step - if k == 1 { GRAVITY } else { 0.0 };
            mass * change(0).hypot(change(1)).hypot(change(2))
        };
        let (first, last) = (history.row_at(touch), history.row_at(end));
        let over = (last > first).then(|| mean(first, last));
        let largest = |least: f64| {
            let at = |to: usize| {
                let from =
                    times[..to].partition_point(|t| *t <= times[to] - least * (1.0 - 1e-9)).saturating_sub(1);
                (from >= first && to > from).then(|| (mean(from, to), times[to]))
            };
            (first + 1..times.len()).filter_map(at).max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let (raw, smooth) = (largest(0.0), largest(MEAN));
        let step = (last > first).then(|| (times[last] - times[first]) / (last - first) as f64);
        self.add("block_force_mean", over, "N").note = Some("over the braking time".into());
        let peak = |rows: &mut Self, name: &str, found: Option<(f64, f64)>, note: String| {
            let row = rows.add(name, found.map(|(force, _)| force), "N");
            (row.time_s, row.note) = (found.map(|(_, time)| time), Some(note));
        };
        peak(self, "block_force_peak_1ms", smooth, "means over 1 ms".into());
        let windows = step.map_or(String::new(), |step| format!(", {:.3} ms on average", 1e3 * step));
        peak(self, "block_force_peak_raw", raw, format!("means over a window{windows}"));
    }

    /// The least distance of the bearing ropes at rest, block left in.
    fn residual_height(&mut self, test: &Test, before: Option<f64>) {
        let rest = self.rest.filter(|rest| !rest.history.rows.is_empty() && !rest.has_left(test));
        let Some(rest) = rest.map(|rest| &rest.history) else {
            let why =
                "not examined: not brought to rest, as the block was not stopped, or no height is judged";
            self.add("h_R", None, "m").note = Some(why.into());
            return;
        };
        let ((least, most), height) = (rest.tail(&left()), rest.column(&left()).last().copied());
        self.add("h_R", height, "m").note = Some("at rest, block left in; least of all fields".into());
        self.add("h_R_least", Some(least), "m").note =
            Some(format!("in the last {TAIL} s of coming to rest"));
        self.add("h_R_most", Some(most), "m").note = Some(format!("in the last {TAIL} s of coming to rest"));
        self.add("h_R/h_N", height.zip(before).map(|(height, before)| height / before), "1");
    }

    /// How far block and net stay from the reference slope until the largest elongation.
    fn clearance(&mut self, end: f64) {
        let history = &self.run.history;
        let until = history.row_at(end) + 1;
        let least = |column: &str, off: f64| {
            let values = history.column(column);
            values.iter().take(until).copied().reduce(f64::min).map(|least| least - off)
        };
        // Its corners, however it has turned.
        let block = least(&format!("{BLOCK}_z_m"), CORNER * self.block.size);
        let net = least(&format!("{OWN}_net_height_m"), 0.0);
        self.add("clearance_block", block, "m").note =
            Some("of the sphere around it from the slope through the feet".into());
        self.add("clearance_net", net, "m").note =
            Some("of the net where the block hits, from the same".into());
    }

    fn part(&mut self, part: &Part) {
        let share = |force: f64, of: Option<f64>| of.map(|strength| force.abs() / strength);
        if part.members.is_empty() {
            let name = format!("{} tension", part.name);
            if let Some(row) = self.peak(name, &format!("{}_tension_max", part.gauge()), "N") {
                row.share = row.value.and_then(|force| share(force, part.strength));
            }
        }
        for (i, nodes) in part.members.iter().enumerate() {
            let (gauge, name) = (part.member(i), format!("{} {}", part.name, i + 1));
            if part.element == "brake" {
                if let Some(row) =
                    self.peak(format!("{name} travel"), &format!("{gauge}_elongation_max"), "m")
                {
                    row.share = row.value.and_then(|travel| share(travel, part.stroke));
                }
                if let Some(row) = self.peak(format!("{name} force"), &format!("{gauge}_tension_max"), "N") {
                    row.share = row.value.and_then(|force| share(force, part.strength));
                }
                let work = work(&self.run.history, &gauge, usize::MAX);
                self.add(format!("{name} work"), work, "J");
            } else {
                for (what, end) in [("compression", "min"), ("tension", "max")] {
                    if let Some(row) =
                        self.peak(format!("{name} {what}"), &format!("{gauge}_tension_{end}"), "N")
                    {
                        row.share = row.value.and_then(|force| share(force, part.strength));
                    }
                }
                self.peak(format!("{name} bending_moment"), &format!("{gauge}_bending_moment_max"), "N m");
                self.tilt(&name, &gauge, *nodes);
            }
        }
    }

    /// The largest angle by which a post has turned from where it stood.
    fn tilt(&mut self, name: &str, gauge: &str, [foot, head]: [u32; 2]) {
        let (foot, head) = (self.now.node(foot), self.now.node(head));
        let post = [0, 1, 2].map(|k| head[k] - foot[k]);
        let length = |v: [f64; 3]| v[0].hypot(v[1]).hypot(v[2]);
        let history = &self.run.history;
        let moves = history.vectors(|axis| format!("{gauge}_head_u{axis}_m"));
        let angle = |u: &[f64; 3]| {
            let now = [0, 1, 2].map(|k| post[k] + u[k]);
            let cosine = (0..3).map(|k| post[k] * now[k]).sum::<f64>() / (length(post) * length(now));
            cosine.clamp(-1.0, 1.0).acos().to_degrees()
        };
        let largest = moves.iter().map(angle).zip(history.times()).max_by(|a, b| a.0.total_cmp(&b.0));
        let row = self.add(format!("{name} tilt"), largest.map(|(angle, _)| angle), "deg");
        row.time_s = largest.map(|(_, time)| time);
    }

    /// The largest force of a support on the structure.
    fn support(&mut self, name: &str) {
        let history = &self.run.history;
        let forces = history.vectors(|axis| format!("{OWN}_{name}_f{axis}_N"));
        let size = |f: &[f64; 3]| f[0].hypot(f[1]).hypot(f[2]);
        let largest =
            forces.into_iter().zip(history.times()).max_by(|a, b| size(&a.0).total_cmp(&size(&b.0)));
        let row = self.add(format!("{name} force"), largest.map(|(force, _)| size(&force)), "N");
        (row.vector, row.time_s) = (largest.map(|(force, _)| force), largest.map(|(_, time)| time));
        row.note = Some("of the support on the structure, mean over a row of history.csv".into());
    }

    /// Where the energy is at the largest elongation.
    fn energies(&mut self, brakes: &[String], end: f64, absorbed: Option<f64>) {
        let history = &self.run.history;
        let row = history.row_at(end);
        let change = |name: &str| {
            let values = history.column(&format!("energy_{name}_J"));
            Some(values.get(row)? - values.first()?)
        };
        let in_brakes = Some(brakes.iter().filter_map(|gauge| work(history, gauge, row)).sum::<f64>());
        let found = [
            ("brakes", in_brakes, "work done on them"),
            (
                "structure_dissipated",
                change("dissipated_fem"),
                "brakes, plastic strain, friction of ropes, rupture",
            ),
            ("structure_stored", change("stored_fem"), "elastic"),
            ("structure_kinetic", change("kinetic_fem"), ""),
            (
                "contact_dissipated",
                change("dissipated_dem"),
                "restitution and friction between block and net",
            ),
            ("error", change("imbalance"), "what the balance lacks"),
        ];
        for (name, value, note) in found {
            let row = self.add(format!("energy {name}"), value, "J");
            row.share = value.zip(absorbed).map(|(energy, absorbed)| energy / absorbed);
            (row.time_s, row.note) = (Some(end), Some(note.to_owned()));
        }
        self.add("energy of net, ropes, posts, each", None, "J").note =
            Some("not examined: the history has that of the structure as a whole".into());
    }
}

/// Work done on a brake up to a row [J].
fn work(history: &History, gauge: &str, row: usize) -> Option<f64> {
    let (forces, ways) =
        (history.column(&format!("{gauge}_tension_N")), history.column(&format!("{gauge}_elongation_m")));
    let last = row.min(forces.len().checked_sub(1)?);
    Some((1..=last).map(|i| 0.5 * (forces[i] + forces[i - 1]) * (ways[i] - ways[i - 1])).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::InterfaceMesh;

    fn history(columns: &[&str], rows: Vec<Vec<f64>>) -> History {
        History {
            columns: columns.iter().enumerate().map(|(i, name)| ((*name).to_owned(), i)).collect(),
            rows,
        }
    }

    /// A block of 2 kg falls freely for 10 ms, is braked with 100 m/s2 for 10 ms, and pushed with 400 m/s2 for the last half of a
    /// millisecond: forces of 0, 2 (100 + g) and 2 (400 + g).
    #[test]
    fn the_force_on_a_block_follows_from_its_motion() {
        let (step, fall, brake) = (0.25e-3, 40, 80);
        let speed = |i: i32| {
            let t = |rows: i32| f64::from(rows) * step;
            25.0 + GRAVITY * t(i.min(fall))
                - 100.0 * t((i - fall).clamp(0, brake - fall))
                - 400.0 * t((i - brake).max(0))
        };
        let rows = (0..=brake + 2).map(|i| vec![f64::from(i) * step, 0.0, speed(i), 0.0]).collect();
        let columns = ["time_s", "block_vx_m_per_s", "block_vy_m_per_s", "block_vz_m_per_s"];
        let run = Ended { history: history(&columns, rows), ..Ended::default() };
        let now = Layout { mesh: InterfaceMesh::default(), parts: Vec::new(), resolved: toml::Table::new() };
        let block = Block { mass: 2.0, size: 0.1 };
        let mut rows = Rows { now: &now, block, run: &run, rest: None, rows: Vec::new() };
        rows.block_force(f64::from(fall) * step, f64::from(brake) * step);
        let [mean, smooth, raw] = [0, 1, 2].map(|i| rows.rows[i].value.expect("a force"));
        assert!((mean / (2.0 * (100.0 + GRAVITY)) - 1.0).abs() < 1e-9, "{mean}");
        assert!((raw / (2.0 * (400.0 + GRAVITY)) - 1.0).abs() < 1e-9, "{raw}");
        // Half of the last millisecond.
        assert!((smooth / (2.0 * (250.0 + GRAVITY)) - 1.0).abs() < 1e-9, "{smooth}");
    }

    #[test]
    fn the_work_of_a_brake_is_the_area_under_its_force() {
        let rows = vec![vec![0.0, 0.0], vec![100.0, 0.01], vec![100.0, 0.51], vec![0.0, 0.5]];
        let history = history(&["g_tension_N", "g_elongation_m"], rows);
        assert_eq!(work(&history, "g", 2), Some(50.5));
        assert_eq!(work(&history, "g", usize::MAX), Some(50.0));
        assert_eq!(work(&history, "h", 2), None);
    }
}
