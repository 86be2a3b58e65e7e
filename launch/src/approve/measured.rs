//! The numbers of a launch, from the summary and the history of its runs. Definitions: EAD 340059-00-0106, as far as it could be read
//! (docs/approval.md).

use super::layout::{BarrierPart, Layout, OWN};
use super::site::{BLOCK, Block, CORNER, GRAVITY, Test, Which};
use crate::front::stop::Stop;
use crate::report::table::Table;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::Measure;
use interface_defs::verdict::{Fate, Torn};
use interface_defs::{PartUse, ShareOf, Utilisation};
use serde::Serialize;
use std::path::Path;
use toolkit::numbers::three;
use toolkit::run_dir::HISTORY;
use toolkit::summary::{RunStatus, Summary};

/// Length of the mean that a peak force is of, beside the raw one [s].
const MEAN: f64 = 1e-3;
/// The end of a run in which what still swings is looked for [s].
const TAIL: f64 = 0.3;
/// What the work of brakes is.
const PLASTIC: &str = "force times plastic travel; what is elastic comes back";
/// Share of its stroke from which on a brake is at its end stop, less rounding.
const FULL: f64 = 1.0 - 1e-3;
/// What the peak of a part is of.
const STEP: &str = "of a single step";
/// What a part has come to that tore, and a brake at the end of its stroke.
pub const TORN: &str = "torn";
pub const END_STOP: &str = "at the end stop";
/// The nominal height: that of the top rope before the first launch.
pub const NOMINAL: &str = "h_N";
/// Column of the time.
const TIME: &str = "time_s";

impl Table {
    /// The last value of a column.
    pub fn last(&self, name: &str) -> f64 {
        self.column(name).last().copied().unwrap_or(f64::NAN)
    }

    /// Least and largest value of a column in the last rows.
    fn tail(&self, name: &str) -> (f64, f64) {
        let from = self.times().partition_point(|t| *t < self.last(TIME) - TAIL);
        let tail = self.column(name).get(from..).unwrap_or_default();
        let of = |better: fn(f64, f64) -> f64, worst| tail.iter().copied().fold(worst, better);
        (of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY))
    }

    /// Three columns, as vectors.
    fn vectors(&self, before: &str, after: &str) -> Vec<[f64; 3]> {
        self.vector(before, ["x", "y", "z"].map(|axis| format!("{axis}{after}"))).unwrap_or_default()
    }

    fn times(&self) -> &[f64] {
        self.column(TIME)
    }

    /// The last row up to a time [s].
    fn row_at(&self, time: f64) -> usize {
        self.times().partition_point(|t| *t <= time).saturating_sub(1)
    }

    /// The largest of values, a row each, with its time and row.
    fn largest(&self, values: impl Iterator<Item = f64>) -> Option<(f64, f64, usize)> {
        let all = values.zip(self.times()).enumerate().map(|(row, (value, time))| (value, *time, row));
        all.max_by(|a, b| a.0.total_cmp(&b.0))
    }
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
    /// What it came to.
    pub summary: Summary,
    /// Whether it was refused, and never began.
    pub refused: bool,
    /// Whether it was made again with finer windows and steps.
    pub finer: bool,
    /// Its rows.
    pub history: Table,
}

impl Ended {
    /// The run in `dir`; one without a summary was refused with these errors.
    pub fn of(dir: &Path, of: String, found: Option<Summary>, errors: Vec<Diagnostic>) -> Result<Self, Stop> {
        let refused = found.is_none();
        let failed = || Summary { reasons: errors, ..Summary::new(RunStatus::Failed) };
        let summary = found.unwrap_or_else(failed);
        // What lies there of a run that was refused is of another one, and a run that failed at once has no rows.
        let unread = |why: String| {
            Stop::failed(code::FILE_CONTENT, format!("{}: {HISTORY} cannot be read: {why}", dir.display()))
        };
        let history = if refused { Ok(Table::default()) } else { Table::read(&dir.join(HISTORY)) };
        let history = history.map_err(|e| unread(e.to_string()))?;
        if !refused && summary.status != RunStatus::Failed && history.rows() == 0 {
            return Err(unread("it is not there, or has no rows".into()));
        }
        let name = dir.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, of, summary, refused, finer: false, history })
    }

    /// What became of the block.
    pub fn fate(&self) -> Option<Fate> {
        self.summary.verdict.first().map(|verdict| verdict.fate)
    }

    /// Whether the block was stopped, and is with the net at the end. One that has left the net again for a moment is, too.
    pub fn is_caught(&self) -> bool {
        matches!(self.summary.status, RunStatus::Done | RunStatus::Unreliable)
            && matches!(self.fate(), Some(Fate::Stopped | Fate::Rebounded))
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
        let tails = [format!("{BLOCK}_y_m"), left()].map(|column| self.history.tail(&column));
        tails.iter().all(|(least, most)| most - least <= near)
    }

    /// Why its numbers do not count; without the place of the run, which is no result.
    pub fn doubt(&self) -> Option<String> {
        let Summary { status, reasons, .. } = &self.summary;
        let why = reasons.iter().map(|reason| Diagnostic { place: None, ..reason.clone() }.headline());
        let why = || why.collect::<Vec<_>>().join("; ").replace('\n', "; ");
        (*status != RunStatus::Done).then(|| format!("{}: {}", status.word(), why()))
    }

    /// How it ended, in words. Of one that `settles` without a verdict on the block, which was judged in the launch before.
    pub fn words(&self, settles: bool) -> String {
        let torn = || self.summary.torn.iter().flatten().map(ToString::to_string);
        let height = || format!("residual height {} m", three(self.history.last(&left())));
        let all = if settles {
            std::iter::once(height()).chain(torn()).collect()
        } else {
            self.summary.sentences()
        };
        self.doubt().unwrap_or(if all.is_empty() { "done".into() } else { all.join("; ") })
    }

    fn measure(&self, name: &str) -> Option<&Measure> {
        self.summary.measures.iter().find(|measure| measure.name == name)
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
    /// Name of the directory of its run.
    pub run: String,
    /// Name of the directory of its last run, and what that is of.
    pub last: [String; 2],
    /// Why its numbers do not count; of the run that brings the block to rest, too.
    pub doubt: Option<String>,
    /// What became of the block.
    pub fate: Option<Fate>,
    /// Whether it was stopped, and stayed with the net in the settling phase.
    pub stopped: bool,
    /// Whether its run was made again with finer windows and steps.
    pub finer: bool,
    /// What tore; `None`: nothing of the structure can.
    pub torn: Option<Vec<Torn>>,
    /// The largest utilisation of each part, that of the settling phase, too.
    pub used: Vec<(String, Utilisation)>,
    /// Its numbers.
    pub rows: Vec<Row>,
}

impl Launch {
    /// From its run, and that in which the block came to rest. `now` is the structure before it; `None`: it never started.
    /// The nominal height `h_N` of the second one of two is that before the `first`.
    pub fn of(
        which: Which,
        test: &Test,
        first: Option<&Launch>,
        now: Option<&Layout>,
        run: Ended,
        rest: Option<Ended>,
    ) -> Self {
        let runs = || std::iter::once(&run).chain(&rest);
        let any = runs().any(|ended| ended.summary.torn.is_some());
        let torn =
            any.then(|| runs().flat_map(|ended| ended.summary.torn.iter().flatten()).cloned().collect());
        let last = rest.as_ref().unwrap_or(&run);
        let settling = || last.doubt().map(|why| format!("settling phase {why}"));
        let mut used: Vec<(String, Utilisation)> = Vec::new();
        for PartUse { part, utilisation, .. } in runs().flat_map(|ended| &ended.summary.parts) {
            match used.iter_mut().find(|(name, _)| name == part) {
                Some((_, most)) => *most = utilisation.filter(|now| now.share > most.share).unwrap_or(*most),
                None => used.extend(utilisation.map(|most| (part.clone(), most))),
            }
        }
        let nominal = first.and_then(|first| first.value(NOMINAL));
        let block = test.kit.block(test.kit.energy(which));
        let mut rows = LaunchNumbers { block, nominal, run: &run, rows: Vec::new() };
        if let Some(now) = now.filter(|_| !run.history.times().is_empty()) {
            rows.all(test, now, rest.as_ref(), torn.as_deref().unwrap_or_default());
        }
        let mut launch = Self {
            which,
            run: run.name.clone(),
            last: [last.name.clone(), last.of.clone()],
            doubt: run.doubt().or_else(settling),
            fate: run.fate(),
            stopped: run.is_caught() && !rest.as_ref().is_some_and(|rest| rest.has_left(test)),
            rows: rows.rows,
            finer: run.finer,
            torn,
            used,
        };
        let why = format!("not examined: {}", launch.no_height());
        let height = launch.rows.iter_mut().find(|row| row.name == "h_R" && row.value.is_none());
        height.into_iter().for_each(|row| row.note = Some(why.clone()));
        launch
    }

    /// The utilisation of each part that has a strength or a stroke, or yields: name, share, and what it has come to. What tore is used
    /// up, whatever its share.
    pub fn utilisation(&self) -> Vec<(String, f64, &'static str)> {
        let tore = |name: &str| self.torn.iter().flatten().any(|torn| torn.part == name);
        let of = |(name, most): &(String, Utilisation)| {
            let come_to = match most.of {
                _ if tore(name) => TORN,
                ShareOf::Force if most.share >= 1.0 => "above its strength",
                ShareOf::Travel if most.share >= FULL => END_STOP,
                of => of.word(),
            };
            (name.clone(), if tore(name) { most.share.max(1.0) } else { most.share }, come_to)
        };
        self.used.iter().map(of).collect()
    }

    /// What became of the block, of the settling phase, too.
    pub fn words(&self) -> String {
        let Some(fate) = self.fate else { return "no verdict".into() };
        let words = match fate {
            Fate::Rebounded => "stopped, then thrown back",
            Fate::Undecided => "still being stopped",
            other => other.words(),
        };
        let left = !self.stopped && matches!(fate, Fate::Stopped | Fate::Rebounded);
        words.to_owned() + if left { ", and left the net in the settling phase" } else { "" }
    }

    /// Why its residual height is not known.
    pub fn no_height(&self) -> String {
        match self.stopped {
            _ if self.doubt.is_some() => "the run does not count".into(),
            true => "the block was not brought to rest".into(),
            false => format!("the block: {}", self.words()),
        }
    }

    /// A number.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.rows.iter().find(|row| row.name == name)?.value
    }
}

/// A value with its time [s], where there is one.
type Timed = Option<(f64, f64)>;

/// The numbers of a launch in the making.
struct LaunchNumbers<'a> {
    block: Block,
    /// Height of the top rope before the first launch [m]; `None`: this is the first.
    nominal: Option<f64>,
    run: &'a Ended,
    rows: Vec<Row>,
}

impl LaunchNumbers<'_> {
    /// One more; an empty note is none.
    fn add(&mut self, name: &str, value: Option<f64>, unit: &'static str, note: &str) -> &mut Row {
        let note = Some(note.to_owned()).filter(|note| !note.is_empty());
        self.rows.push(Row { name: name.into(), value, unit, note, ..Row::default() });
        self.rows.last_mut().expect("it was pushed")
    }

    /// The same with its time.
    fn add_timed(&mut self, name: &str, found: Timed, unit: &'static str, note: &str) -> &mut Row {
        let row = self.add(name, found.map(|(value, _)| value), unit, note);
        row.time_s = found.map(|(_, time)| time);
        row
    }

    /// A measure of the run, with its share of `most`; one that is absent is left out.
    fn peak(&mut self, name: &str, measure: &str, unit: &'static str, most: Option<f64>, note: &str) {
        let Some(found) = self.run.measure(measure) else { return };
        let row = self.add(name, Some(found.value), unit, note);
        (row.time_s, row.member) = (found.time, found.member.clone());
        row.share = most.map(|most| found.value.abs() / most);
    }

    fn all(&mut self, test: &Test, now: &Layout, rest: Option<&Ended>, torn: &[Torn]) {
        let (block, history) = (self.block, &self.run.history);
        let measure = |name: &str| self.run.measure(name).map(|measure| measure.value);
        let (energy, elongation) = (measure("impact_energy"), measure("max_elongation"));
        let touch = measure("time_of_impact").unwrap_or(f64::NAN);
        let end = self.run.measure("max_elongation").and_then(|of| of.time).unwrap_or(f64::NAN);
        let absorbed = energy.zip(elongation).map(|(kinetic, path)| kinetic + block.mass * GRAVITY * path);
        // A block that was not stopped has no braking time.
        let stop = if self.run.is_caught() { end } else { f64::NAN };
        let braking = Some(stop - touch).filter(|t| t.is_finite());
        let own = history.column(&format!("{OWN}_top_height_m")).get(history.row_at(touch)).copied();
        let before = self.nominal.or(own);
        // At rest, block still in the net.
        let rest = rest.filter(|rest| !rest.history.times().is_empty() && !rest.has_left(test));
        let left = rest.map(|rest| (rest.history.last(&left()), rest.history.tail(&left())));
        let share = left.zip(before).map(|((height, _), before)| height / before);
        // How far block, with its corners however it has turned, and net stay from the reference slope.
        let least = |column: &str, off: f64| {
            let values = history.column(column).iter().take(history.row_at(end) + 1).copied();
            values.reduce(f64::min).map(|least| least - off)
        };
        let clear_block = least(&format!("{BLOCK}_z_m"), CORNER * block.size);
        let clear_net = least(&format!("{OWN}_net_height_m"), 0.0);
        let place = history.row_at(touch);
        for (name, axis, middle) in
            [("offset_along", 'x', test.middle[0]), ("offset_up", 'z', test.middle[1])]
        {
            let at = history.column(&format!("{BLOCK}_{axis}_m")).get(place);
            self.add(
                name,
                at.map(|at| at - middle),
                "m",
                "of the block's centre from the middle of the middle field, at first contact",
            );
        }
        self.add("fields", Some(test.layout.number("fields")), "1", "");
        self.add("block_mass", Some(block.mass), "kg", "");
        self.add("block_edge", Some(block.size), "m", "");
        self.peak("impact_speed", "impact_speed", "m/s", None, "");
        self.add("impact_energy", energy, "J", "");
        self.add("absorbed_energy", absorbed, "J", "m v2/2 + m g e");
        self.add("max_elongation", elongation, "m", "").time_s = Some(end);
        self.add("braking_time", braking, "s", "from the first contact to the largest elongation");
        self.block_force(touch, stop);
        self.add(NOMINAL, before, "m", "before the first launch");
        let of_rest = "at rest, block still in the net; least of all fields";
        self.add("h_R", left.map(|(height, _)| height), "m", of_rest);
        if let Some((_, (least, most))) = left {
            for (name, value) in [("h_R_least", least), ("h_R_most", most)] {
                self.add(name, Some(value), "m", &format!("in the last {TAIL} s of the settling phase"));
            }
            self.add("h_R/h_N", share, "1", "");
        }
        let note = "of the sphere around it from the slope through the feet";
        self.add("clearance_block", clear_block, "m", note);
        self.add("clearance_net", clear_net, "m", "of the net where the block hits, from the same");
        for Torn { part, elements, first, force, member, .. } in torn {
            let (name, note) = (format!("broken {part}"), format!("the first under {:.1} kN", 1e-3 * force));
            self.add_timed(&name, Some((*elements as f64, *first)), "1", &note).member = Some(member.clone());
        }
        self.peak("plastic strain", "max_plastic_strain", "1", None, "");
        test.layout.parts.iter().for_each(|part| self.part(part, now));
        for (name, _) in test.layout.supports() {
            self.support(&name);
        }
        let brakes = test.layout.parts.iter().filter(|part| part.element == "brake");
        let work = |(part, i): (&BarrierPart, usize)| work(history, part, i, history.row_at(end));
        let brakes = brakes.flat_map(|part| (0..part.members.len()).map(move |i| (part, i)));
        self.energies(brakes.filter_map(work).sum(), end, absorbed);
    }

    /// Force of the structure on the block, from its motion: `m (dv/dt - g)`.
    fn block_force(&mut self, touch: f64, end: f64) {
        let (history, mass) = (&self.run.history, self.block.mass);
        let (times, speeds) = (history.times(), history.vectors(&format!("{BLOCK}_v"), "_m_per_s"));
        let mean = |from: usize, to: usize| {
            let step = times[to] - times[from];
            let [x, y, z] = [0, 1, 2].map(|k| (speeds[to][k] - speeds[from][k]) / step);
            mass * x.hypot(y - GRAVITY).hypot(z)
        };
        let (first, last) = (history.row_at(touch), history.row_at(end));
        let largest = |least: f64| {
            let at = |to: usize| {
                let begin = times[to] - least * (1.0 - 1e-9);
                let from = times[..to].partition_point(|t| *t <= begin).checked_sub(1)?;
                (from >= first && to > from).then(|| (mean(from, to), times[to]))
            };
            (first + 1..times.len()).filter_map(at).max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let (smooth, raw) = (largest(MEAN), largest(0.0));
        let braked =
            (last > first).then(|| (mean(first, last), (times[last] - times[first]) / (last - first) as f64));
        let windows = braked.map_or(String::new(), |(_, step)| format!(", {:.3} ms on average", 1e3 * step));
        self.add("block_force_mean", braked.map(|(force, _)| force), "N", "over the braking time");
        self.add_timed("block_force_peak_1ms", smooth, "N", "means over 1 ms");
        self.add_timed("block_force_peak_raw", raw, "N", &format!("means over a window{windows}"));
    }

    /// What is reported of a part depends on what it is made of: of ropes and nets of all together, of brakes and posts of each.
    fn part(&mut self, part: &BarrierPart, now: &Layout) {
        let force = |name, end| (name, end, "N", part.strength);
        let table = match part.element.as_str() {
            _ if part.members.is_empty() => vec![force("tension", "tension_max")],
            "brake" => vec![force("force", "tension_max")],
            _ => vec![
                force("compression", "tension_min"),
                force("tension", "tension_max"),
                ("bending_moment", "bending_moment_max", "N m", None),
            ],
        };
        for i in 0..part.members.len().max(1) {
            let whole = || (part.name.clone(), part.gauge());
            let member = |_: &Vec<u32>| (format!("{} {}", part.name, i + 1), part.member(i));
            let (name, gauge) = part.members.get(i).map_or_else(whole, member);
            for (what, measure, unit, most) in &table {
                self.peak(&format!("{name} {what}"), &format!("{gauge}_{measure}"), unit, *most, STEP);
            }
            if let Some(post) = part.members.get(i).filter(|_| part.element == "beam") {
                self.tilt(&name, &gauge, [post[0], post[post.len() - 1]].map(|node| now.node(node)));
            } else if let Some(ends) = part.members.get(i) {
                self.travel(&name, part, i, [0, 1].map(|end| now.node(ends[end])));
                let work = work(&self.run.history, part, i, usize::MAX);
                self.add(&format!("{name} work"), work, "J", PLASTIC);
            }
        }
    }

    /// The plastic travel of brake number `i` of `part`, whose nodes stand at `ends` at the start: what its stroke and its utilisation
    /// count, too.
    fn travel(&mut self, name: &str, part: &BarrierPart, i: usize, [a, b]: [[f64; 3]; 2]) {
        let at_start = self.run.history.column(&format!("{}_elongation_m", part.member(i))).first();
        let modelled = size(&[0, 1, 2].map(|k| b[k] - a[k])) - at_start.unwrap_or(&0.0);
        let slack = part.length.map_or(0.0, |length| modelled - length);
        let travels = plastic(&self.run.history, part, i).into_iter().map(|travel| (travel + slack).max(0.0));
        let largest = self.run.history.largest(travels).map(|(travel, time, _)| (travel, time));
        let share = largest.zip(part.stroke).map(|((travel, _), stroke)| travel / stroke);
        let note = if share >= Some(FULL) { END_STOP } else { "plastic" };
        self.add_timed(&format!("{name} travel"), largest, "m", note).share = share;
    }

    /// The largest angle by which a post has turned from where it stood.
    fn tilt(&mut self, name: &str, gauge: &str, [foot, head]: [[f64; 3]; 2]) {
        let post = [0, 1, 2].map(|k| head[k] - foot[k]);
        let moves = self.run.history.vectors(&format!("{gauge}_head_u"), "_m");
        let angle = |u: &[f64; 3]| {
            let now = [0, 1, 2].map(|k| post[k] + u[k]);
            let cosine = (0..3).map(|k| post[k] * now[k]).sum::<f64>() / (size(&post) * size(&now));
            cosine.clamp(-1.0, 1.0).acos().to_degrees()
        };
        let largest = self.run.history.largest(moves.iter().map(angle));
        self.add_timed(&format!("{name} tilt"), largest.map(|(angle, time, _)| (angle, time)), "deg", "");
    }

    /// The largest force of a support on the structure.
    fn support(&mut self, name: &str) {
        let forces = self.run.history.vectors(&format!("{OWN}_{name}_f"), "_N");
        let largest = self.run.history.largest(forces.iter().map(size));
        let note = "of the support on the structure, mean over a row of history.csv";
        let row = self.add_timed(&format!("{name} force"), largest.map(|(f, t, _)| (f, t)), "N", note);
        row.vector = largest.map(|(.., at)| forces[at]);
    }

    /// Where the energy is at the largest elongation.
    fn energies(&mut self, brakes: f64, end: f64, absorbed: Option<f64>) {
        let history = &self.run.history;
        let change = |name: &str| {
            let values = history.column(&format!("energy_{name}_J"));
            Some(values.get(history.row_at(end))? - values.first()?)
        };
        let of_structure = "brakes, plastic strain, friction of ropes, rupture";
        for (name, value, note) in [
            ("brakes", Some(brakes), PLASTIC),
            ("structure_dissipated", change("dissipated_fem"), of_structure),
            ("structure_stored", change("stored_fem"), "elastic"),
            ("structure_kinetic", change("kinetic_fem"), ""),
            (
                "contact_dissipated",
                change("dissipated_dem"),
                "restitution and friction between block and net",
            ),
            ("error", change("imbalance"), "what the balance lacks"),
        ] {
            let row = self.add(&format!("energy {name}"), value, "J", note);
            row.share = value.zip(absorbed).map(|(energy, absorbed)| energy / absorbed);
            row.time_s = Some(end);
        }
        let over = history.times().last().copied();
        for part in &self.run.summary.parts {
            for (what, energy) in [("dissipated", part.dissipated), ("stored", part.stored)] {
                let name = format!("energy {} {what}", part.part);
                let row =
                    self.add_timed(&name, over.map(|end| (energy, end)), "J", "at the end of the launch");
                row.share = absorbed.map(|absorbed| energy / absorbed);
            }
        }
    }
}

/// Length of a vector.
fn size(v: &[f64; 3]) -> f64 {
    v[0].hypot(v[1]).hypot(v[2])
}

/// Elongation of brake number `i` of `part` less what of it is elastic, in each row [m].
fn plastic(history: &Table, part: &BarrierPart, i: usize) -> Vec<f64> {
    let column = |end| history.column(&format!("{}_{end}", part.member(i)));
    let elastic = |force: &f64| part.stiffness.map_or(0.0, |of| force / of);
    column("elongation_m").iter().zip(column("tension_N")).map(|(e, force)| e - elastic(force)).collect()
}

/// What brake number `i` of `part` has dissipated up to a row [J]: its force over its plastic travel, which is the largest elongation less
/// that of its force. Over the elongation itself a brake that stays elastic comes to a work of either sign: rows are samples, and do not
/// see where it goes slack.
fn work(history: &Table, part: &BarrierPart, i: usize, row: usize) -> Option<f64> {
    let (forces, travels) =
        (history.column(&format!("{}_tension_N", part.member(i))), plastic(history, part, i));
    let last = row.min(travels.len().checked_sub(1)?);
    let (mut work, mut most) = (0.0, travels[0]);
    for row in 1..=last {
        let further = (travels[row] - most).max(0.0);
        work += 0.5 * (forces[row] + forces[row - 1]) * further;
        most += further;
    }
    Some(work)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(columns: &[&str], rows: Vec<Vec<f64>>) -> Table {
        let directory = tempfile::tempdir().expect("a directory");
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let numbers = rows.iter().map(|row| line(row.iter().map(f64::to_string).collect()));
        let text = line(columns.iter().map(ToString::to_string).collect()) + &numbers.collect::<String>();
        let path = directory.path().join(HISTORY);
        std::fs::write(&path, text).expect("written");
        Table::read(&path).expect("a table")
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
        let block = Block { mass: 2.0, size: 0.1 };
        let mut rows = LaunchNumbers { block, nominal: None, run: &run, rows: Vec::new() };
        rows.block_force(f64::from(fall) * step, f64::from(brake) * step);
        let [mean, smooth, raw] = [0, 1, 2].map(|i| rows.rows[i].value.expect("a force"));
        assert!((mean / (2.0 * (100.0 + GRAVITY)) - 1.0).abs() < 1e-9, "{mean}");
        assert!((raw / (2.0 * (400.0 + GRAVITY)) - 1.0).abs() < 1e-9, "{raw}");
        // Half of the last millisecond.
        assert!((smooth / (2.0 * (250.0 + GRAVITY)) - 1.0).abs() < 1e-9, "{smooth}");
    }

    #[test]
    fn the_work_of_a_brake_is_its_force_over_its_plastic_travel_and_none_while_it_is_elastic() {
        let brake = BarrierPart {
            name: "b".into(),
            element: "brake".into(),
            strength: None,
            can_break: false,
            stiffness: Some(1e4),
            stroke: Some(1.0),
            length: None,
            members: vec![vec![0, 1]],
        };
        let of = |rows: Vec<Vec<f64>>| history(&["approve_b_1_tension_N", "approve_b_1_elongation_m"], rows);
        let slips = of(vec![vec![0.0, 0.0], vec![100.0, 0.01], vec![100.0, 0.51], vec![0.0, 0.5]]);
        let work_up_to = |row| work(&slips, &brake, 0, row).expect("a brake");
        assert!((work_up_to(2) - 50.0).abs() < 1e-9 && (work_up_to(usize::MAX) - 50.0).abs() < 1e-9);
        assert_eq!(work(&slips, &brake, 1, 2), None);
        // Its travel is that of its law, which begins at its own length.
        for (length, travel) in [(None, 0.5), (Some(0.5), 1.0)] {
            let brake = BarrierPart { length, ..brake.clone() };
            let columns = ["time_s", "approve_b_1_tension_N", "approve_b_1_elongation_m"];
            let rows = [[0.0, 0.0, 0.0], [1.0, 100.0, 0.01], [2.0, 100.0, 0.51], [3.0, 0.0, 0.5]];
            let run = Ended { history: history(&columns, rows.map(Vec::from).into()), ..Ended::default() };
            let block = Block { mass: 2.0, size: 0.1 };
            let mut rows = LaunchNumbers { block, nominal: None, run: &run, rows: Vec::new() };
            rows.travel("b 1", &brake, 0, [[0.0; 3], [1.0, 0.0, 0.0]]);
            let row = &rows.rows[0];
            assert!(
                (row.value.expect("a travel") - travel).abs() < 1e-12 && row.share == row.value,
                "{row:?}"
            );
            assert_eq!(row.note.as_deref() == Some(END_STOP), travel == 1.0, "{row:?}");
        }
        // It begins under tension, goes slack between two rows, and is pulled again.
        let slack = of(vec![vec![100.0, 0.01], vec![0.0, -0.02], vec![50.0, 0.005], vec![0.0, -0.01]]);
        assert!(work(&slack, &brake, 0, usize::MAX).expect("a brake").abs() < 1e-12);
    }
}
