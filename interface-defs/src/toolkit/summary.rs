//! `summary.json`: outcome, measures, energy, coupling, cost, warnings; and the table on the screen.

use super::files;
use super::run_dir::SUMMARY;
use crate::message::Measure;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fmt::Write as _;
use std::io;
use std::path::Path;

/// How the run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// To its end.
    Done,
    /// It failed; what was computed until then is there.
    Failed,
    /// The user has interrupted it.
    Interrupted,
}

/// What a run came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// How it ended.
    pub status: Status,
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
    pub fn new(status: Status) -> Self {
        Self {
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

    /// The short table for the screen.
    pub fn table(&self) -> String {
        let mut text = String::new();
        let width = self.measures.iter().map(|m| m.name.len()).max().unwrap_or(0).max(12);
        let status = match self.status {
            Status::Done => "done",
            Status::Failed => "failed",
            Status::Interrupted => "interrupted",
        };
        let _ = writeln!(text, "{:width$}  {status}", "status");
        let numbers: Vec<String> = self.measures.iter().map(|m| short_in(&m.unit, m.value)).collect();
        let number_width = numbers.iter().map(String::len).max().unwrap_or(0);
        for (m, number) in self.measures.iter().zip(&numbers) {
            let unit = if m.unit == "1" { "" } else { &m.unit };
            let time = m.time.map_or(String::new(), |t| format!("at {} s", short(t)));
            let line = format!("{:width$}  {number:>number_width$} {unit:<4} {time}", m.name);
            let _ = writeln!(text, "{}", line.trim_end());
        }
        for (name, section) in [("energy", &self.energy), ("coupling", &self.coupling), ("cost", &self.cost)]
        {
            let parts: Vec<String> = section
                .iter()
                .filter_map(|(key, value)| match value {
                    Value::Number(n) => Some(format!("{key} {}", short(n.as_f64()?))),
                    Value::String(s) => Some(format!("{key} {s}")),
                    _ => None,
                })
                .collect();
            if !parts.is_empty() {
                let _ = writeln!(text, "{name:width$}  {}", parts.join(", "));
            }
        }
        for warning in &self.warnings {
            let _ = writeln!(text, "warning: {warning}");
        }
        text
    }

    /// Print the short table on stdout.
    pub fn print_table(&self) {
        super::screen::tell(&self.table());
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

/// The same; of metres to the millimetre where that is more: coordinates of a survey are large.
fn short_in(unit: &str, value: f64) -> String {
    // From here on six digits are coarser than a millimetre.
    let large = value.is_finite() && value.abs() >= 999.999_5;
    if unit == "m" && large { ((value * 1000.0).round() / 1000.0).to_string() } else { short(value) }
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
    use crate::message::Measure;
    use serde::de::{MapAccess, Visitor};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::fmt;

    #[derive(Serialize, Deserialize)]
    struct Entry {
        value: f64,
        unit: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        time_s: Option<f64>,
    }

    pub fn serialize<S: Serializer>(measures: &[Measure], to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(
            measures
                .iter()
                .map(|m| (&m.name, Entry { value: m.value, unit: m.unit.clone(), time_s: m.time })),
        )
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
                while let Some((name, entry)) = map.next_entry::<String, Entry>()? {
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
        let mut summary = Summary::new(Status::Done);
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
        let mut summary = Summary::new(Status::Failed);
        summary.measures = vec![measure("peak", f64::NAN, None), measure("depth", 1.0, Some(f64::INFINITY))];
        summary.energy.insert("error".into(), f64::INFINITY.into());
        summary.write(dir.path()).expect("written");
        let read = Summary::read(dir.path()).expect("read");
        assert_eq!(read.measures, vec![measure("depth", 1.0, None)]);
        assert!(read.energy.is_empty());
        assert!(read.warnings[0].contains("peak") && read.warnings[1].contains("energy.error"), "{read:?}");
    }

    #[test]
    fn the_table_is_short_and_names_value_unit_and_time() {
        let mut summary = Summary::new(Status::Interrupted);
        summary.measures = vec![measure("max_deflection", 0.351_234_567, Some(0.5))];
        summary.cost.insert("wall_s".into(), 0.25.into());
        summary.measures.push(measure("rest_x", 2_600_120.263_49, None));
        let expected = "status          interrupted\n\
                        max_deflection     0.351235 m    at 0.5 s\n\
                        rest_x          2600120.263 m\n\
                        cost            wall_s 0.25\n";
        assert_eq!(summary.table(), expected);
    }
}
