//! `summary.json`: verdict, outcome, measures, energy, coupling, cost, warnings; and the end of a run on the screen: verdict, the
//! numbers that matter, warnings, where the files are.

use super::exit::Exit;
use super::files;
use super::numbers::{percent, rounded, short, short_in, to_place};
use super::picture;
use super::run_dir::SUMMARY;
use super::screen::{complain, show};
use interface_defs::message::{Found, Interval};
use interface_defs::verdict::{Fate, NOTHING_TORE};
use interface_defs::{Diagnostic, Measure, PartUse, Severity, Statistics, Torn, Verdict, code};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value};
use std::fmt::Write as _;
use std::io;
use std::path::Path;

interface_defs::worded! {
    /// How the run ended.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum RunStatus with word {
        /// To its end.
        #[default]
        Done = "done",
        /// To its end, but a bound of `[limits]` was passed: not to be trusted.
        Unreliable = "unreliable",
        /// It failed; what was computed until then is there.
        Failed = "failed",
        /// The user has interrupted it.
        Interrupted = "interrupted",
    }
}

/// What a run came to.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// What became of each rock.
    #[serde(default, serialize_with = "with_sentences")]
    pub verdict: Vec<Verdict>,
    /// The program that gave each; not written.
    #[serde(skip)]
    pub judges: Vec<String>,
    /// What tore of the structure, a part each; `None`: nothing of it can.
    #[serde(default)]
    pub torn: Option<Vec<Torn>>,
    /// How far each part of the structure was used, the largest utilisation first; left out where the structure does not say.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartUse>,
    /// How it ended.
    pub status: RunStatus,
    /// Id of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run: Option<String>,
    /// Why, unless it is done: for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// The same as data.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reasons: Vec<Diagnostic>,
    /// Results, in order.
    #[serde(with = "measures")]
    pub measures: Vec<Measure>,
    /// Balance of energy.
    pub energy: Map<String, Value>,
    /// What the coupling did.
    pub coupling: Map<String, Value>,
    /// Seconds, memory, counts.
    pub cost: Map<String, Value>,
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
}

impl Summary {
    /// An empty one.
    pub fn new(status: RunStatus) -> Self {
        Self { status, ..Self::default() }
    }

    /// One of a run that ended so, and why.
    pub fn ended(status: RunStatus, why: Diagnostic) -> Self {
        Self { message: Some(why.to_string()), reasons: vec![why], ..Self::new(status) }
    }

    /// The run came to its end, and is not to be trusted for these reasons.
    pub fn doubt(&mut self, reasons: Vec<Diagnostic>) {
        let sentence = |reason: &Diagnostic| match &reason.hint {
            Some(cure) => format!("{}: {cure}", reason.headline()),
            None => reason.headline(),
        };
        let sentences: Vec<String> = reasons.iter().map(sentence).collect();
        self.status = RunStatus::Unreliable;
        self.message = Some(format!("unreliable: {}", sentences.join("; ")));
        self.reasons = reasons;
    }

    /// From when on measures depend on what small differences decide, and on what [s].
    pub fn chance(&self) -> Option<(f64, Found)> {
        let torn = self.torn.iter().flatten().map(|torn| (torn.first, Found::Rupture));
        let passes = |of: &&Verdict| matches!(of.fate, Fate::WentThrough | Fate::Undecided);
        let passages = self.verdict.iter().filter(passes).filter_map(|of| of.impact);
        let passages = passages.map(|touch| (touch.time, Found::Passage));
        torn.chain(passages).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The run failed for one more reason.
    pub fn fail(&mut self, why: Diagnostic) {
        self.status = RunStatus::Failed;
        self.message = Some(match self.message.take() {
            Some(before) => format!("{before}\n{why}"),
            None => why.to_string(),
        });
        self.reasons.push(why);
    }

    /// Take in what the solver `program` reports at the end.
    ///
    /// # Errors
    /// If it gives a measure that another program has given, or the verdict on a rock that has one: both measures and the second verdict are
    /// left out.
    pub fn take(&mut self, program: &str, statistics: &Statistics) -> Result<(), Diagnostic> {
        let mut clashes = Vec::new();
        for measure in &statistics.measures {
            let source = if measure.source.is_empty() { program } else { &measure.source };
            let there = self.measures.iter().position(|m| m.name == measure.name && m.source != source);
            if let Some(at) = there {
                let other = self.measures.remove(at).source;
                clashes.push(format!("the measure {} is given by {other} and by {source}", measure.name));
            } else {
                self.add(Measure { source: source.into(), ..measure.clone() });
            }
        }
        for verdict in &statistics.verdicts {
            let mut known = self.verdict.iter().zip(&self.judges);
            if let Some((_, other)) = known.find(|(known, _)| known.rock == verdict.rock) {
                let rock = &verdict.rock;
                clashes.push(format!("the verdict on rock `{rock}` is given by {other} and by {program}"));
            } else {
                self.verdict.push(verdict.clone());
                self.judges.push(program.to_owned());
            }
        }
        if let Some(torn) = &statistics.torn {
            self.torn.get_or_insert_default().extend(torn.iter().cloned());
        }
        let torn = self.torn.as_deref().unwrap_or_default();
        self.verdict.iter_mut().for_each(|verdict| verdict.torn = torn.to_vec());
        self.parts.extend(statistics.parts.iter().flatten().cloned());
        self.warnings.extend_from_slice(&statistics.warnings);
        if clashes.is_empty() {
            return Ok(());
        }
        Err(Diagnostic::error(code::NAME_TAKEN, clashes.join("; "))
            .try_instead("a name belongs to one program: rename it in the solver that is yours"))
    }

    /// Add a measure. Of one that the same program has given already the larger magnitude stays: it is the same
    /// quantity, seen by two parts of it.
    pub fn add(&mut self, measure: Measure) {
        match self.measures.iter_mut().find(|m| m.name == measure.name) {
            Some(there) if measure.value.abs() > there.value.abs() => *there = measure,
            Some(_) => {}
            None => self.measures.push(measure),
        }
    }

    /// The value of a measure; `None` if it is absent.
    pub fn measure(&self, name: &str) -> Option<f64> {
        self.measures.iter().find(|m| m.name == name).map(|m| m.value)
    }

    /// What became of each rock and of the structure, a sentence each; of parts, those that tore or were used beyond what they bear.
    pub fn sentences(&self) -> Vec<String> {
        let rocks = self.verdict.iter().map(Verdict::to_string);
        let torn = self.torn.iter().flatten().map(Torn::to_string);
        let nothing = self.torn.as_ref().is_some_and(Vec::is_empty).then(|| NOTHING_TORE.to_owned());
        let tore = |part: &str| self.torn.iter().flatten().any(|torn| torn.part == part);
        let beyond = self.parts.iter().filter(|part| part.is_beyond() && !tore(&part.part));
        rocks.chain(torn).chain(nothing).chain(beyond.map(PartUse::to_string)).collect()
    }

    /// Write `summary.json` to `dir`: as a whole or not at all. Pictures there say from then on whether they are to be trusted.
    ///
    /// A number that is not finite is left out, and a warning names it.
    pub fn write(&self, dir: &Path) -> io::Result<()> {
        if self.status == RunStatus::Unreliable {
            picture::reveal(dir)?;
        }
        files::write_json(&dir.join(SUMMARY), &self.finite())
    }

    /// Read `summary.json` of `dir`.
    pub fn read(dir: &Path) -> io::Result<Self> {
        files::read_json(&dir.join(SUMMARY))
    }

    /// The same without what is not finite.
    fn finite(&self) -> Self {
        let mut out = self.clone();
        let mut lost = Vec::new();
        out.measures.retain_mut(|m| {
            if m.value.is_finite() {
                m.time = m.time.filter(|t| t.is_finite());
                let known = |end: Option<f64>| end.filter(|end| end.is_finite());
                m.interval = m.interval.map(|of| Interval { low: known(of.low), high: known(of.high) });
                return true;
            }
            let what =
                format!("the value {} of this measure is not a finite number; it is left out", m.value);
            lost.push(Diagnostic::warning(code::NOT_FINITE, what).about(&m.name));
            false
        });
        out.parts.retain(|part| {
            let finite = part.share().is_finite() && part.dissipated.is_finite() && part.stored.is_finite();
            if !finite {
                let what = "not all numbers of this part are finite; it is left out";
                lost.push(Diagnostic::warning(code::NOT_FINITE, what).about(&part.part));
            }
            finite
        });
        for (section, map) in
            [("energy", &mut out.energy), ("coupling", &mut out.coupling), ("cost", &mut out.cost)]
        {
            drop_null(section, map, &mut lost);
        }
        out.warnings.append(&mut lost);
        out
    }
}

/// Counts of work done and skipped, over all solvers, and their peak memory: what `cost` shows beside each process.
pub fn totals(cost: &mut Map<String, Value>, solvers: &[&Statistics]) {
    for solver in solvers {
        for (name, count) in solver.counts.iter().filter(|(name, _)| !name.starts_with("allocations")) {
            let so_far = cost.get(name).and_then(Value::as_u64).unwrap_or(0);
            cost.insert(name.clone(), (so_far + count).into());
        }
    }
    let memory = solvers.iter().map(|solver| solver.peak_memory).max().unwrap_or(0);
    if memory > 0 {
        cost.insert("peak_memory_bytes".into(), memory.into());
    }
}

/// A float that is not finite has become null: drop it and say so.
fn drop_null(name: &str, map: &mut Map<String, Value>, lost: &mut Vec<Diagnostic>) {
    map.retain(|key, value| {
        let name = format!("{name}.{key}");
        if let Value::Object(inner) = value {
            drop_null(&name, inner, lost);
        } else if value.is_null() {
            let what = "this is not a finite number; it is left out";
            lost.push(Diagnostic::warning(code::NOT_FINITE, what).about(name));
        }
        !value.is_null()
    });
}

fn with_sentences<S: Serializer>(verdicts: &[Verdict], to: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Written<'a> {
        #[serde(flatten)]
        verdict: &'a Verdict,
        sentence: String,
    }
    to.collect_seq(verdicts.iter().map(|verdict| Written { verdict, sentence: verdict.to_string() }))
}

mod measures {
    use indexmap::IndexMap;
    use interface_defs::message::{Found, Interval, Measure, Uncertainty, Worse};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Written {
        value: f64,
        unit: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        member: Option<String>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        time_s: Option<f64>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        uncertainty: Option<f64>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        uncertainty_by: Option<Found>,
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        unreliable: bool,
        /// The interval; of one that a sample is too small for, null.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        interval: Option<[Option<f64>; 2]>,
        rank: u16,
        worse: Worse,
        source: String,
    }

    pub fn serialize<S: Serializer>(measures: &[Measure], to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(measures.iter().map(|m| {
            let of = m.uncertainty;
            let written = Written {
                value: m.value,
                unit: m.unit.clone(),
                member: m.member.clone(),
                time_s: m.time,
                uncertainty: of.and_then(|of| of.value),
                uncertainty_by: of.map(|of| of.by),
                unreliable: of.is_some_and(|of| of.beyond),
                interval: m.interval.map(|of| [of.low, of.high]),
                rank: m.rank,
                worse: m.worse,
                source: m.source.clone(),
            };
            (&m.name, written)
        }))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Measure>, D::Error> {
        let measure = |(name, it): (String, Written)| {
            let (value, beyond) = (it.uncertainty, it.unreliable);
            Measure {
                time: it.time_s,
                source: it.source,
                uncertainty: it.uncertainty_by.map(|by| Uncertainty { value, by, beyond }),
                interval: it.interval.map(|[low, high]| Interval { low, high }),
                ..Measure::new(name, it.value, it.unit).of_member(it.member).ranked(it.rank, it.worse)
            }
        };
        Ok(IndexMap::<String, Written>::deserialize(from)?.into_iter().map(measure).collect())
    }
}

impl Exit {
    /// The code of a run that ended so.
    pub fn of(status: RunStatus) -> Self {
        match status {
            RunStatus::Done => Self::Done,
            RunStatus::Unreliable => Self::Unreliable,
            RunStatus::Failed | RunStatus::Interrupted => Self::Failed,
        }
    }
}

/// Numbers that are shown; all others are in `summary.json`.
const SHOWN: usize = 10;

/// Warnings of one kind that are shown, such as ruptures; all are in `summary.json`.
const OF_A_KIND: usize = 3;

/// Parts that are shown, the most used ones; all are in `summary.json`.
const PARTS: usize = 8;

impl Summary {
    /// The short text for the screen; `out` is where the files are.
    pub fn table(&self, out: &Path) -> String {
        let mut text = String::new();
        for sentence in self.sentences() {
            let _ = writeln!(text, "{sentence}");
        }
        let shown = shown(&self.measures);
        let rows: Vec<[String; 3]> = shown.iter().map(|m| row(m)).collect();
        let width = |column: usize| rows.iter().map(|r| r[column].chars().count()).max().unwrap_or(0);
        let (names, numbers) = (width(0).max(12), width(1));
        let _ = writeln!(text, "{:names$}  {}", "status", self.status.word());
        for [name, number, rest] in &rows {
            let line = format!("{name:names$}  {number:>numbers$} {rest}");
            let _ = writeln!(text, "{}", line.trim_end());
        }
        self.show_parts(&mut text, names);
        let mut kinds: Vec<(String, usize)> = Vec::new();
        for warning in &self.warnings {
            let kind = kind(warning);
            let at = kinds.iter().position(|(known, _)| *known == kind).unwrap_or_else(|| {
                kinds.push((kind, 0));
                kinds.len() - 1
            });
            kinds[at].1 += 1;
            if kinds[at].1 <= OF_A_KIND {
                let label = if warning.severity == Severity::Note { "" } else { "warning: " };
                let _ = writeln!(text, "{label}{warning}");
            }
        }
        for (kind, count) in kinds.iter().filter(|(_, count)| *count > OF_A_KIND) {
            let _ = writeln!(text, "warning: {} more of `{kind}`, in {SUMMARY}", count - OF_A_KIND);
        }
        let more = match self.measures.len() - shown.len() {
            0 => String::new(),
            more => format!(" ({more} more measures in {SUMMARY})"),
        };
        let _ = writeln!(text, "{:names$}  {}{more}", "results", out.display());
        text
    }

    /// The parts that were used most, a row each, behind the names of the rows above.
    fn show_parts(&self, text: &mut String, names: usize) {
        let used = self.parts.iter().filter_map(|part| Some((part, part.utilisation?))).take(PARTS);
        let used: Vec<_> = used.collect();
        let names = used.iter().map(|(part, _)| part.part.chars().count()).fold(names, usize::max);
        if !used.is_empty() {
            let _ = writeln!(text, "{:names$}  utilisation, at    dissipated [kJ]", "part");
        }
        for (part, largest) in used {
            let (word, lost) = (largest.of.word(), part.dissipated / 1e3);
            let share = format!("{:.2} of {word:<7} {:.4} s", largest.share, largest.time);
            let _ = writeln!(text, "{:names$}  {share} {lost:>11.1}", part.part);
        }
    }

    /// Print why the run is not done on stderr.
    pub fn complain(&self) {
        if self.status == RunStatus::Unreliable {
            let all = self.message.clone().unwrap_or_default();
            complain(&Diagnostic { message: all, hint: None, ..self.reasons[0].clone() });
        } else {
            self.reasons.iter().for_each(complain);
        }
    }

    /// Print it, unless `quiet`, and why the run is not done; returns the exit code of the run.
    pub fn present(&self, out: &Path, quiet: bool) -> Exit {
        if !quiet {
            self.print_table(out);
        }
        if self.status != RunStatus::Done {
            self.complain();
        }
        Exit::of(self.status)
    }

    /// Print it on stdout.
    pub fn print_table(&self, out: &Path) {
        show(&self.table(out));
    }
}

/// The measures that matter most, in that order; in places that are left, the others as they come.
fn shown(measures: &[Measure]) -> Vec<&Measure> {
    let mut shown: Vec<&Measure> = measures.iter().collect();
    shown.sort_by_key(|m| m.rank);
    shown.truncate(SHOWN);
    shown
}

/// What makes warnings alike: the last name of the key that they are about, else their code. Absent measures are alike.
fn kind(warning: &Diagnostic) -> String {
    let is_name = |part: &&str| !part.bytes().all(|b| b.is_ascii_digit());
    let key = warning.key.as_deref().filter(|_| warning.code != code::ABSENT_MEASURE);
    let key = key.and_then(|key| key.rsplit('.').find(is_name));
    key.unwrap_or(warning.code.as_str()).to_owned()
}

/// Name, number, and unit with time and member.
fn row(m: &Measure) -> [String; 3] {
    let unit = if m.unit == "1" { "" } else { &m.unit };
    let time = m.time.map_or(String::new(), |t| format!("at {} s", short(t)));
    let member = m.member.as_ref().map_or(String::new(), |member| format!(" ({member})"));
    let off = m.uncertainty.map_or(String::new(), |of| match (of.value, m.unit.as_str()) {
        // A share of nothing means nothing.
        (Some(value), unit) if unit == "1" || m.value == 0.0 => format!("+- {} ", short(rounded(value, 2))),
        (Some(value), _) => {
            let mark = if of.beyond { "(unreliable) " } else { "" };
            format!("+- {} {mark}", percent(rounded(value / m.value.abs(), 2)))
        }
        (None, _) => "+- ? ".to_owned(),
    });
    let (number, interval) = match m.interval {
        Some(of) => within(m.value, of),
        None => (short_in(&m.unit, m.value), String::new()),
    };
    [m.name.clone(), number, format!("{unit:<4} {interval}{off}{time}{member}")]
}

/// A number and its interval with no more digits than two of half its width.
fn within(value: f64, Interval { low, high }: Interval) -> (String, String) {
    let widest = [low, high].into_iter().flatten().map(|end| (end - value).abs()).fold(0.0, f64::max);
    let half = low.zip(high).map_or(widest, |(low, high)| 0.5 * (high - low));
    let written = |value: f64| short(if half > 0.0 { to_place(value, half) } else { value });
    let end = |end: Option<f64>| end.map_or("too few".into(), written);
    (written(value), format!("[{}, {}] ", end(low), end(high)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::message::Worse;
    use interface_defs::verdict::Ending;
    use interface_defs::{ShareOf, Utilisation};

    fn measure(name: &str, value: f64, time: Option<f64>) -> Measure {
        Measure::new(name, value, "m").at(time)
    }

    #[test]
    fn a_summary_reads_back_in_order_and_leaves_no_half_file() {
        let dir = tempfile::tempdir().expect("a directory");
        let mut summary = Summary::new(RunStatus::Done);
        summary.measures = vec![measure("z", 1.5, Some(0.25)), measure("a", -2e-9, None)];
        summary.cost.insert("windows".into(), 7.into());
        summary.warnings.push(Diagnostic::warning(code::OTHER, "mind the gap"));
        summary.write(dir.path()).expect("written");
        assert_eq!(Summary::read(dir.path()).expect("read"), summary);
        assert_eq!(std::fs::read_dir(dir.path()).expect("a directory").count(), 1);
    }

    #[test]
    fn numbers_that_are_not_finite_become_warnings_that_name_them() {
        let dir = tempfile::tempdir().expect("a directory");
        let mut summary = Summary::new(RunStatus::Failed);
        summary.measures = vec![measure("peak", f64::NAN, None), measure("depth", 1.0, Some(f64::INFINITY))];
        summary.energy.insert("error".into(), f64::INFINITY.into());
        summary.write(dir.path()).expect("written");
        let read = Summary::read(dir.path()).expect("read");
        assert_eq!(read.measures, vec![measure("depth", 1.0, None)]);
        assert!(read.energy.is_empty());
        assert!(
            read.warnings.iter().filter_map(|w| w.key.as_deref()).eq(["peak", "energy.error"]),
            "{read:?}"
        );
    }

    #[test]
    fn a_verdict_stands_with_its_fate_its_numbers_and_its_sentence() {
        let dir = tempfile::tempdir().expect("a directory");
        let ending =
            Ending { fate: Fate::AtRest, time: 4.0, position: [0.0; 3], speed: 0.0, on_terrain: true };
        let torn = Torn {
            part: "rope".into(),
            elements: 1,
            first: 0.3,
            last: 0.3,
            force: 3e5,
            member: "element 7".into(),
        };
        let verdicts = vec![Verdict::of("block", ending)];
        let mut summary = Summary::new(RunStatus::Done);
        summary.take("dem-solver", &Statistics { verdicts, ..Statistics::default() }).expect("the first");
        let of_structure = Statistics { torn: Some(vec![torn.clone()]), ..Statistics::default() };
        summary.take("fem-solver", &of_structure).expect("another");
        summary.write(dir.path()).expect("written");
        let json: Value =
            serde_json::from_str(&std::fs::read_to_string(dir.path().join(SUMMARY)).expect("a file"))
                .expect("JSON");
        let verdict = &json["verdict"][0];
        assert_eq!((&verdict["fate"], &verdict["time"]), (&"at_rest".into(), &4.0.into()));
        assert_eq!(verdict["torn"][0]["part"], "rope");
        assert_eq!(verdict["sentence"], summary.verdict[0].to_string());
        let written = Summary { judges: Vec::new(), ..summary.clone() };
        assert_eq!(Summary::read(dir.path()).expect("read"), written);
        assert_eq!(summary.sentences(), [summary.verdict[0].to_string(), torn.to_string()]);
        let nothing = Summary { torn: Some(Vec::new()), ..Summary::new(RunStatus::Done) };
        assert_eq!(nothing.sentences(), [NOTHING_TORE]);
    }

    #[test]
    fn the_parts_that_were_used_most_are_shown_and_one_beyond_what_it_bears_has_a_sentence() {
        let part = |name: &str, share: f64, of: ShareOf| PartUse {
            part: name.into(),
            utilisation: Some(Utilisation { share, of, time: 0.25 }).filter(|_| share > 0.0),
            dissipated: 81234.0,
            stored: 0.0,
        };
        let mut parts = vec![part("posts", 0.95, ShareOf::Yielded), part("brakes", 0.92, ShareOf::Travel)];
        parts.extend((0..8).map(|i| part(&format!("rope_{i}"), 0.5, ShareOf::Force)));
        parts.push(part("the rest", 0.0, ShareOf::Force));
        let dir = tempfile::tempdir().expect("a directory");
        let mut summary = Summary::new(RunStatus::Done);
        let of_structure = Statistics { parts: Some(parts), ..Statistics::default() };
        summary.take("fem-solver", &of_structure).expect("the first");
        let of_posts = "`posts` yielded: it came to 0.95 times what its plastic section bears at 0.2500 s";
        assert_eq!(summary.sentences(), [of_posts]);
        let text = summary.table(dir.path());
        assert!(text.contains("brakes        0.92 of travel  0.2500 s        81.2\n"), "{text}");
        assert!(text.contains("rope_5") && !text.contains("rope_6") && !text.contains("the rest"), "{text}");
        summary.write(dir.path()).expect("written");
        let json: Value =
            serde_json::from_str(&std::fs::read_to_string(dir.path().join(SUMMARY)).expect("a file"))
                .expect("JSON");
        assert_eq!(json["parts"][1]["utilisation"]["of"], "travel");
        assert_eq!(Summary::read(dir.path()).expect("read"), summary);
        let torn = Torn {
            part: "posts".into(),
            elements: 1,
            first: 0.25,
            last: 0.25,
            force: 1.0,
            member: String::new(),
        };
        summary.torn = Some(vec![torn.clone()]);
        assert_eq!(summary.sentences(), [torn.to_string()], "it is named once");
        summary.parts[0].stored = f64::NAN;
        assert_eq!(summary.finite().parts.len(), 10);
    }

    #[test]
    fn the_member_of_a_group_stands_beside_the_value_and_reads_back() {
        let dir = tempfile::tempdir().expect("a directory");
        let mut summary = Summary::new(RunStatus::Done);
        summary.add(measure("posts_tension_min", -482e3, Some(0.5)).of_member(Some("post 3".into())));
        summary.write(dir.path()).expect("written");
        let text = std::fs::read_to_string(dir.path().join(SUMMARY)).expect("a file");
        let json: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(json["measures"]["posts_tension_min"]["member"], "post 3");
        let read = Summary::read(dir.path()).expect("read");
        assert_eq!(read, summary);
        assert_eq!(read.measure("posts_tension_min"), Some(-482e3));
    }

    /// Half of 40 is 20: two digits of it end with the ones. An end for which there are too few rocks is said as such.
    #[test]
    fn an_interval_stands_beside_its_number_with_digits_that_it_warrants_and_reads_back() {
        let of = |low, high| Measure {
            interval: Some(Interval { low, high }),
            ..measure("road_energy_q95", 123.456_789, None)
        };
        for (low, high, due) in [
            (Some(100.123), Some(140.123), ["123", "m    [100, 140] "]),
            (Some(120.0), Some(124.2), ["123.5", "m    [120, 124.2] "]),
            (Some(-877.0), Some(1123.0), ["100", "m    [-900, 1100] "]),
            (Some(100.123), None, ["123", "m    [100, too few] "]),
            (None, None, ["123.457", "m    [too few, too few] "]),
        ] {
            assert_eq!(row(&of(low, high))[1..], due);
            let dir = tempfile::tempdir().expect("a directory");
            let summary = Summary { measures: vec![of(low, high)], ..Summary::new(RunStatus::Done) };
            summary.write(dir.path()).expect("written");
            assert_eq!(Summary::read(dir.path()).expect("read"), summary);
        }
    }

    #[test]
    fn a_name_that_two_programs_give_is_refused_and_names_both() {
        let of = |value| Statistics {
            measures: vec![measure("max_deflection", value, None)],
            ..Statistics::default()
        };
        let mut summary = Summary::new(RunStatus::Done);
        summary.take("dem-solver 1", &of(1.0)).expect("the first");
        summary.take("dem-solver 1", &of(2.0)).expect("the same program");
        assert_eq!(
            (summary.measure("max_deflection"), summary.measures[0].source.as_str()),
            (Some(2.0), "dem-solver 1")
        );
        let refused = summary.take("theirs", &of(3.0)).expect_err("taken");
        assert_eq!(refused.code, code::NAME_TAKEN);
        assert!(refused.message.contains("dem-solver 1") && refused.message.contains("theirs"), "{refused}");
        assert_eq!(summary.measure("max_deflection"), None);
        let ending =
            Ending { fate: Fate::AtRest, time: 4.0, position: [0.0; 3], speed: 0.0, on_terrain: true };
        let judged = Statistics { verdicts: vec![Verdict::of("block", ending)], ..Statistics::default() };
        summary.take("dem-solver 1", &judged).expect("the first");
        let refused = summary.take("theirs", &judged).expect_err("a second");
        assert!(refused.message.contains("dem-solver 1") && refused.message.contains("theirs"), "{refused}");
        assert_eq!(summary.verdict.len(), 1);
    }

    #[test]
    fn a_measure_that_two_parts_report_stands_once_with_its_larger_value() {
        let mut summary = Summary::new(RunStatus::Done);
        for value in [0.2, 0.4, 0.3] {
            summary.add(measure("max_penetration", value, Some(value)));
        }
        assert_eq!(summary.measures, [measure("max_penetration", 0.4, Some(0.4))]);
    }

    #[test]
    fn verdict_numbers_warnings_and_files_stand_in_this_order() {
        let mut summary = Summary::new(RunStatus::Unreliable);
        summary.torn = Some(Vec::new());
        summary.measures = vec![
            measure("rest_x", 2_600_120.263_49, None),
            measure("posts_height_min", 1.5, None).of_member(Some("post 3".into())),
            measure("max_deflection", 0.351_234_567, Some(0.5)).ranked(50, Worse::Larger),
        ];
        summary.warnings.push(Diagnostic::warning(code::OTHER, "mind the gap"));
        summary.warnings.push(Diagnostic::of(Severity::Note, code::OTHER, "it went on from 1 s"));
        summary.cost.insert("wall_s".into(), 0.25.into());
        let expected = "nothing of the structure tore\n\
                        status            unreliable\n\
                        max_deflection       0.351235 m    at 0.5 s\n\
                        rest_x            2600120.263 m\n\
                        posts_height_min          1.5 m     (post 3)\n\
                        warning: mind the gap\n\
                        it went on from 1 s\n\
                        results           out/x\n";
        assert_eq!(summary.table(Path::new("out/x")), expected);
    }

    #[test]
    fn of_many_warnings_of_one_kind_the_first_are_shown_and_how_many_more_there_are() {
        let mut summary = Summary::new(RunStatus::Done);
        let rupture = |i| Diagnostic::warning(code::RUPTURE, format!("element {i} of net broke at {i}.5 s"));
        summary.warnings = (0..7).map(rupture).collect();
        summary.warnings.push(Diagnostic::warning(code::OTHER, "the last one"));
        assert_eq!(
            shown_warnings(&summary),
            [
                "element 0 of net broke at 0.5 s",
                "element 1 of net broke at 1.5 s",
                "element 2 of net broke at 2.5 s",
                "the last one",
                "4 more of `rupture`, in summary.json"
            ]
        );
    }

    fn shown_warnings(summary: &Summary) -> Vec<String> {
        let table = summary.table(Path::new("out"));
        table.lines().filter_map(|line| line.strip_prefix("warning: ").map(str::to_owned)).collect()
    }

    /// What a scene's keys are warned of is alike where the key is: one of a zone is not lost behind those of contacts.
    #[test]
    fn warnings_at_places_of_the_scene_are_of_the_kind_of_their_key() {
        let mut summary = Summary::new(RunStatus::Done);
        let of = |key: &str| Diagnostic::warning(code::UNUSUAL_VALUE, "it is uncalibrated").about(key);
        summary.warnings = (0..4).map(|i| of(&format!("contact.{i}.preset"))).collect();
        summary.warnings.push(of("terrain.zone.1.forest"));
        let shown = shown_warnings(&summary);
        assert_eq!(
            shown[3..],
            ["terrain.zone.1.forest: it is uncalibrated", "1 more of `preset`, in summary.json"]
        );
        for (key, due) in [("line.0.points", "points"), ("vary.contact.0", "contact")] {
            assert_eq!(kind(&of(key)), due);
        }
    }

    #[test]
    fn ten_numbers_are_shown_and_how_many_more_there_are() {
        let mut summary = Summary::new(RunStatus::Done);
        summary.measures = (0..12).map(|i| measure(&format!("gauge{i}_min"), 1.0, None)).collect();
        summary.measures.push(measure("block_max_deflection", 2.0, None).ranked(50, Worse::Larger));
        summary.measures.push(measure("energy_error", 1e-3, None).ranked(40, Worse::Larger));
        let table = summary.table(Path::new("out"));
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines.len(), 1 + SHOWN + 1);
        assert!(
            lines[1].starts_with("energy_error") && lines[2].starts_with("block_max_deflection"),
            "{table}"
        );
        assert!(lines[11].ends_with("out (4 more measures in summary.json)"), "{table}");
    }
}
