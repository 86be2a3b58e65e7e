//! What a program answers to `check`: what it would build, from which numbers, at what cost.

use super::files;
use super::input_file;
use super::screen::show;
use interface_defs::{Diagnostic, InterfaceMesh};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Form of the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Format {
    /// For people.
    #[default]
    Text,
    /// One JSON object, for programs.
    Json,
}

/// What a program would build of a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CheckReport {
    /// What it would build, one line each, with numbers.
    pub builds: Vec<String>,
    /// Numbers by name, the unit in the name. One that is not finite is left out of the JSON form.
    #[serde(serialize_with = "finite_only")]
    pub numbers: BTreeMap<String, f64>,
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
    /// Its top-level tables with every default filled in. Travels as TOML text, in which every
    /// number reads back bit for bit.
    #[serde(with = "as_toml")]
    pub resolved: toml::Table,
    /// Of a structure: the mesh that it offers to contact at t = 0, after form finding, without masses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interface: Option<InterfaceMesh>,
    /// Of rocks: the file with the spheres that were made for each, by its name, so that a run need not make them again.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub clusters: BTreeMap<String, String>,
}

impl CheckReport {
    /// As JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("text and finite numbers are valid JSON")
    }

    /// From JSON.
    pub fn from_json(text: &str) -> Result<Self, Diagnostic> {
        serde_json::from_str(text).map_err(|e| Diagnostic::new(format!("this is no report of a check: {e}")))
    }

    /// For people.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for line in &self.builds {
            let _ = writeln!(text, "{line}");
        }
        let width = self.numbers.keys().map(String::len).max().unwrap_or(0);
        for (name, value) in &self.numbers {
            let _ = writeln!(text, "  {name:width$}  {}", super::numbers::short(*value));
        }
        for warning in &self.warnings {
            let _ = writeln!(text, "warning: {warning}");
        }
        text
    }

    /// Print it on stdout.
    pub fn print(&self, format: Format) {
        match format {
            Format::Text => show(&self.to_text()),
            Format::Json => show(&(self.to_json() + "\n")),
        }
    }
}

/// The interface mesh in a JSON file, `-` for stdin.
pub fn read_interface(path: &Path) -> Result<InterfaceMesh, Diagnostic> {
    let fault = |what: String| Diagnostic::in_file(path.display(), what);
    let text = match path.to_str() {
        Some("-") => std::io::read_to_string(std::io::stdin())
            .map_err(|e| fault(format!("the interface mesh cannot be read: {e}")))?
            .into_bytes(),
        _ => input_file::read(path, files::TEXT)?,
    };
    let mesh: InterfaceMesh =
        serde_json::from_slice(&text).map_err(|e| fault(format!("this is no interface mesh: {e}")))?;
    mesh.check().map_err(fault)?;
    Ok(mesh)
}

fn finite_only<S: serde::Serializer>(numbers: &BTreeMap<String, f64>, to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(numbers.iter().filter(|(_, value)| value.is_finite()))
}

mod as_toml {
    use serde::{Deserialize, Deserializer, Serializer, de, ser};

    pub fn serialize<S: Serializer>(table: &toml::Table, to: S) -> Result<S::Ok, S::Error> {
        let mut table = table.clone();
        table.retain(|_, value| keep_finite(value));
        to.serialize_str(&toml::to_string(&table).map_err(ser::Error::custom)?)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<toml::Table, D::Error> {
        String::deserialize(from)?.parse().map_err(de::Error::custom)
    }

    /// A default that is infinite means "no limit", which a scene says by leaving the key out.
    fn keep_finite(value: &mut toml::Value) -> bool {
        match value {
            toml::Value::Float(number) => number.is_finite(),
            toml::Value::Table(table) => {
                table.retain(|_, inner| keep_finite(inner));
                true
            }
            toml::Value::Array(items) => {
                items.retain_mut(keep_finite);
                true
            }
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::diagnostic::code;

    #[test]
    fn a_report_reads_back_from_json_with_every_bit_and_without_infinity() {
        let resolved =
            "[dem]\nlimit = inf\nlist = [1.0, 2]\ntime_step = 0.30000000000000004\n[[rock]]\nmass = 180.0\n";
        let mut report = CheckReport {
            builds: vec!["one \"rock\"".into()],
            numbers: [("time_step_s".to_owned(), 0.1 + 0.2), ("critical_step_s".to_owned(), f64::INFINITY)]
                .into(),
            warnings: vec![Diagnostic::warning(code::OTHER, "none")],
            resolved: resolved.parse().expect("TOML"),
            interface: Some(InterfaceMesh {
                coordinates: vec![0.5, 0.0, -1e-3],
                lines: vec![[0, 0]],
                ..InterfaceMesh::default()
            }),
            clusters: [("rock".into(), "0 0 0 1\n".into())].into(),
        };
        let read = CheckReport::from_json(&report.to_json()).expect("JSON");
        report.numbers.remove("critical_step_s");
        report.resolved["dem"].as_table_mut().expect("a table").remove("limit");
        assert_eq!(read.resolved, report.resolved);
        assert_eq!((read.builds, read.warnings), (report.builds, report.warnings));
        assert_eq!((read.interface, read.clusters), (report.interface, report.clusters));
        // serde_json may be off by one unit in the last place when it reads; these numbers are for show.
        assert!((read.numbers["time_step_s"] - report.numbers["time_step_s"]).abs() <= f64::EPSILON);
        assert_eq!(read.numbers.len(), 1);
    }
}
