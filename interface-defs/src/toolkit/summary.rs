//! `summary.json`: verdict, outcome, measures, energy, coupling, cost, warnings.

use super::files;
use super::run_dir::SUMMARY;
use crate::message::{Measure, Statistics};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::io;
use std::path::Path;

/// How the run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunStatus {
    /// To its end.
    Done,
    /// To its end, but a bound of `[limits]` was passed: not to be trusted.
    Unreliable,
    /// It failed; what was computed until then is there.
    Failed,
    /// The user has interrupted it.
    Interrupted,
}

impl RunStatus {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Unreliable => "unreliable",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        }
    }
}

/// What a warning of a solver begins with that is a sentence of the verdict.
const VERDICT: &str = "verdict: ";

/// What stands between the name of a measure and the member of a group in which it was.
const MEMBER: &str = " @ ";

/// The name of a measure, and the member of a group in which it was, of `posts_tension_min @ post 3`.
pub fn split_member(name: &str) -> (&str, Option<&str>) {
    name.split_once(MEMBER).map_or((name, None), |(name, member)| (name, Some(member)))
}

/// What a run came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// What became of each rock, and what tore: one sentence each.
    #[serde(default)]
    pub verdict: Vec<String>,
    /// How it ended.
    pub status: RunStatus,
    /// Id of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run: Option<String>,
    /// Why, unless it is done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
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
    pub warnings: Vec<String>,
}

impl Summary {
    /// An empty one.
    pub fn new(status: RunStatus) -> Self {
        Self {
            verdict: Vec::new(),
            status,
            run: None,
            message: None,
            measures: Vec::new(),
            energy: Map::new(),
            coupling: Map::new(),
            cost: Map::new(),
            warnings: Vec::new(),
        }
    }

    /// Take in what a solver reports at the end. Of its warnings those of the verdict become the verdict.
    pub fn take(&mut self, statistics: &Statistics) {
        for measure in &statistics.measures {
            self.add(measure.clone());
        }
        for warning in &statistics.warnings {
            match warning.strip_prefix(VERDICT) {
                Some(sentence) => self.verdict.push(sentence.into()),
                None => self.warnings.push(warning.clone()),
            }
        }
    }

    /// Add a measure. Of a name that is there already the larger magnitude stays: it is the same
    /// quantity, seen by two parts of a program.
    pub fn add(&mut self, measure: Measure) {
        let (name, _) = split_member(&measure.name);
        match self.measures.iter_mut().find(|m| split_member(&m.name).0 == name) {
            Some(there) if measure.value.abs() > there.value.abs() => *there = measure,
            Some(_) => {}
            None => self.measures.push(measure),
        }
    }

    /// The value of a measure; `None` if it is absent.
    pub fn measure(&self, name: &str) -> Option<f64> {
        self.measures.iter().find(|m| split_member(&m.name).0 == name).map(|m| m.value)
    }

    /// Write `summary.json` to `dir`: as a whole or not at all.
    ///
    /// A number that is not finite is left out, and a warning names it.
    pub fn write(&self, dir: &Path) -> io::Result<()> {
        let text = serde_json::to_string_pretty(&self.finite()).map_err(io::Error::from)?;
        files::write(&dir.join(SUMMARY), (text + "\n").as_bytes())
    }

    /// Read `summary.json` of `dir`.
    pub fn read(dir: &Path) -> io::Result<Self> {
        let text = std::fs::read_to_string(dir.join(SUMMARY))?;
        serde_json::from_str(&text).map_err(io::Error::from)
    }

    /// The same without what is not finite.
    fn finite(&self) -> Self {
        let mut out = self.clone();
        let mut lost = Vec::new();
        out.measures.retain_mut(|m| {
            if m.value.is_finite() {
                m.time = m.time.filter(|t| t.is_finite());
                return true;
            }
            lost.push(format!(
                "measure {}: its value {} is not a finite number; it is left out",
                m.name, m.value
            ));
            false
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

/// Six significant digits, for a reader.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if (1e-4..1e7).contains(&rounded.abs()) { rounded.to_string() } else { format!("{rounded:e}") }
}

/// Three significant digits, for a reader.
pub fn three(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    short(rounded)
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
fn drop_null(name: &str, map: &mut Map<String, Value>, lost: &mut Vec<String>) {
    map.retain(|key, value| {
        let name = format!("{name}.{key}");
        match value {
            Value::Null => {
                lost.push(format!("{name} is not a finite number; it is left out"));
                false
            }
            Value::Object(inner) => {
                drop_null(&name, inner, lost);
                true
            }
            _ => true,
        }
    });
}

mod measures {
    use super::{MEMBER, split_member};
    use crate::message::Measure;
    use serde::de::{MapAccess, Visitor};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::fmt;

    #[derive(Serialize, Deserialize)]
    struct Written {
        value: f64,
        unit: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        member: Option<String>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        time_s: Option<f64>,
    }

    pub fn serialize<S: Serializer>(measures: &[Measure], to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(measures.iter().map(|m| {
            let (name, member) = split_member(&m.name);
            let member = member.map(String::from);
            (name, Written { value: m.value, unit: m.unit.clone(), member, time_s: m.time })
        }))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Measure>, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Vec<Measure>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("measures by name")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut out = Vec::new();
                while let Some((name, entry)) = map.next_entry::<String, Written>()? {
                    let name = entry.member.map_or(name.clone(), |member| format!("{name}{MEMBER}{member}"));
                    out.push(Measure { name, value: entry.value, unit: entry.unit, time: entry.time_s });
                }
                Ok(out)
            }
        }
        from.deserialize_map(InOrder)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measure(name: &str, value: f64, time: Option<f64>) -> Measure {
        Measure { name: name.into(), value, unit: "m".into(), time }
    }

    #[test]
    fn a_summary_reads_back_in_order_and_leaves_no_half_file() {
        let dir = tempfile::tempdir().expect("a directory");
        let mut summary = Summary::new(RunStatus::Done);
        summary.measures = vec![measure("z", 1.5, Some(0.25)), measure("a", -2e-9, None)];
        summary.cost.insert("windows".into(), 7.into());
        summary.warnings.push("mind the gap".into());
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
        assert!(read.warnings[0].contains("peak") && read.warnings[1].contains("energy.error"), "{read:?}");
    }

    #[test]
    fn sentences_of_the_verdict_are_lifted_out_of_the_warnings() {
        let mut summary = Summary::new(RunStatus::Done);
        let warnings = vec!["verdict: rock: stopped by the net".into(), "mind the gap".into()];
        summary.take(&Statistics { warnings, ..Statistics::default() });
        assert_eq!(summary.verdict, ["rock: stopped by the net"]);
        assert_eq!(summary.warnings, ["mind the gap"]);
    }

    #[test]
    fn the_member_of_a_group_stands_beside_the_value_and_reads_back() {
        let dir = tempfile::tempdir().expect("a directory");
        let mut summary = Summary::new(RunStatus::Done);
        summary.add(measure("posts_tension_min @ post 3", -482e3, Some(0.5)));
        summary.write(dir.path()).expect("written");
        let text = std::fs::read_to_string(dir.path().join(SUMMARY)).expect("a file");
        let json: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(json["measures"]["posts_tension_min"]["member"], "post 3");
        let read = Summary::read(dir.path()).expect("read");
        assert_eq!(read, summary);
        assert_eq!(read.measure("posts_tension_min"), Some(-482e3));
    }

    #[test]
    fn a_measure_that_two_parts_report_stands_once_with_its_larger_value() {
        let mut summary = Summary::new(RunStatus::Done);
        for value in [0.2, 0.4, 0.3] {
            summary.add(measure("max_penetration", value, Some(value)));
        }
        assert_eq!(summary.measures, [measure("max_penetration", 0.4, Some(0.4))]);
    }
}
