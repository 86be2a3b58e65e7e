//! A chosen member, and what became of it at the barrier.

use crate::stop::Stop;
use crate::sweep::{self, Ran};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::verdict::Fate;
use serde::Deserialize;
use serde_json::Value;
use std::io;
use std::path::Path;
use toolkit::files;
use toolkit::input_file;
use toolkit::summary::{RunStatus, Summary};

/// What the rocks' program leaves: which members, and what they bring to the line.
#[derive(Debug, Deserialize)]
pub struct Chosen {
    /// Members of the study.
    pub members: u64,
    /// How many of them reach the line.
    pub reach: u64,
    /// What is known of each chosen one, in order.
    pub columns: Vec<String>,
    /// A table for each chosen one.
    pub chosen: Vec<Value>,
}

impl Chosen {
    /// Read the file.
    pub fn read(path: &Path) -> Result<Self, Stop> {
        let text = files::read_text(path);
        let read = text.and_then(|text| serde_json::from_str(&text).map_err(io::Error::from));
        read.map_err(|e| {
            let what = format!("{}: {e}; are all programs of one version?", path.display());
            Stop::failed(code::FILE_CONTENT, what)
        })
    }
}

/// A chosen member with what became of it.
#[derive(Debug)]
pub struct Case {
    /// What it brings to the line.
    pub entry: Value,
    /// How its run ended.
    pub status: RunStatus,
    /// Why it is not done.
    pub reasons: Vec<Diagnostic>,
    /// What it came to, where it was computed.
    pub summary: Option<Summary>,
    /// What its run warns of, without places in its own scene.
    pub warnings: Vec<Diagnostic>,
}

impl Case {
    /// The case whose run in `place` has ended before, of the same scene. An error: programs of another build computed it.
    pub fn finished(entry: &Value, place: &Path) -> Result<Option<Self>, Diagnostic> {
        let Some((of, ())) = sweep::kept(place)? else { return Ok(None) };
        let Ok(summary) = Summary::read(place) else { return Ok(None) };
        let case = Self::of(entry, summary);
        // A process that was lost says nothing of the scene.
        let lost = case.status == RunStatus::Interrupted
            || case.reasons.iter().any(|reason| reason.code == code::PROCESS);
        let same = scene(place).is_ok_and(|now| now == of);
        Ok(Some(case).filter(|_| same && !lost))
    }

    /// The case whose run has ended now.
    pub fn ended(entry: &Value, place: &Path, ran: Ran) -> Result<Self, Stop> {
        let Some(summary) = ran.summary else {
            let (entry, status, reasons) = (entry.clone(), RunStatus::Failed, ran.errors);
            return Ok(Self { entry, status, reasons, summary: None, warnings: Vec::new() });
        };
        let of = scene(place).map_err(|e| Stop::failed(code::FILE, format!("{}: {e}", place.display())))?;
        sweep::keep(place, &of, ())?;
        Ok(Self::of(entry, summary))
    }

    fn of(entry: &Value, summary: Summary) -> Self {
        let placeless = |warning: &Diagnostic| Diagnostic { place: None, ..warning.clone() };
        // Which measures are not there is of less weight than what is wrong.
        let (absent, mut warnings): (Vec<_>, Vec<_>) =
            summary.warnings.iter().map(placeless).partition(|warning| warning.code == code::ABSENT_MEASURE);
        warnings.extend(absent);
        let reasons = summary.reasons.clone();
        Self { entry: entry.clone(), status: summary.status, reasons, summary: Some(summary), warnings }
    }

    /// Its number.
    pub fn member(&self) -> u64 {
        self.entry["member"].as_u64().unwrap_or_default()
    }

    /// A number that it brings to the line.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.entry[key].as_f64()
    }

    /// What became of it, in a sentence.
    pub fn sentence(&self) -> Option<String> {
        let sentences = self.summary.as_ref()?.sentences();
        (!sentences.is_empty()).then(|| sentences.join("; "))
    }

    /// What became of its rock; `None`: it could not be computed.
    pub fn fate(&self) -> Option<Fate> {
        let computed = self.summary.as_ref().filter(|summary| summary.status != RunStatus::Failed)?;
        computed.verdict.first().map(|verdict| verdict.fate)
    }

    /// A result of its run.
    pub fn measure(&self, name: &str) -> Option<f64> {
        self.summary.as_ref()?.measure(name)
    }

    /// Why it is not done, in one line.
    pub fn reason(&self) -> String {
        let all: Vec<String> = self.reasons.iter().map(Diagnostic::headline).collect();
        all.join("; ").replace('\n', "; ")
    }

    /// The same, and what its run warns of.
    pub fn notes(&self) -> String {
        let reason = Some(self.reason()).filter(|reason| !reason.is_empty());
        let warnings = self.warnings.iter().map(|warning| format!("warning: {warning}"));
        reason.into_iter().chain(warnings).collect::<Vec<_>>().join("; ").replace('\n', "; ")
    }

    /// What the screen shows of it.
    pub fn words(&self) -> String {
        match self.status {
            RunStatus::Done => self.sentence().unwrap_or_else(|| "no verdict".into()),
            status => format!("{}: {}", status.word(), self.reason()),
        }
    }
}

/// Hash of the scene that the run in `place` is of.
fn scene(place: &Path) -> io::Result<String> {
    files::read(&place.with_extension("toml"), files::TEXT).map(|bytes| input_file::hash(&bytes))
}
