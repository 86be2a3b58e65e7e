//! A chosen member, and what became of it at the barrier.

use crate::stop::Stop;
use crate::verdict::error_in;
use interface_defs::toolkit::files;
use interface_defs::toolkit::summary::{RunStatus, Summary};
use serde::Deserialize;
use serde_json::Value;
use std::io;
use std::path::Path;
use std::process::Output;

/// The scene that a directory has the run of, written when that has ended.
pub const OF: &str = "member.toml";

/// What the rocks' program leaves: which members, and what they bring to the line.
#[derive(Debug, Deserialize)]
pub struct Chosen {
    /// Name of the line in the study.
    pub line: String,
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
        let text = std::fs::read_to_string(path);
        let read = text.and_then(|text| serde_json::from_str(&text).map_err(io::Error::from));
        read.map_err(|e| Stop::failed(format!("{}: {e}; are all programs of one version?", path.display())))
    }
}

/// What is not known when the time is over.
pub const UNDECIDED: &str = "not decided";

/// How verdicts begin behind the name of the rock, and in one word. The rocks' program writes them.
const FATES: [(&str, &str); 8] = [
    ("was stopped by", "stopped"),
    ("rebounded from", "rebounded"),
    ("was still being stopped", UNDECIDED),
    ("went through", "went through"),
    ("passed over", "passed over"),
    ("passed beside", "passed beside"),
    ("passed under", "passed under"),
    // It has not come to the net, and may yet.
    ("still moved", UNDECIDED),
];
/// All other verdicts: it never came to the net.
const AWAY: &str = "did not reach";

/// A verdict in a word.
pub fn fate(verdict: &str) -> &'static str {
    let rest = verdict.split_once("` ").map_or(verdict, |(_, rest)| rest);
    FATES.iter().find(|(begin, _)| rest.starts_with(begin)).map_or(AWAY, |(_, word)| word)
}

/// All words of verdicts, in the order in which they are counted.
pub fn fates() -> impl Iterator<Item = &'static str> {
    // The last of them is there twice.
    FATES[..FATES.len() - 1].iter().map(|(_, word)| *word).chain([AWAY])
}

/// A chosen member with what became of it.
#[derive(Debug)]
pub struct Case {
    /// What it brings to the line.
    pub entry: Value,
    /// How its run ended.
    pub status: RunStatus,
    /// Why it is not done.
    pub message: String,
    /// What it came to, where it was computed.
    pub summary: Option<Summary>,
    /// What its run warns of, without places in its own scene.
    pub warnings: Vec<String>,
}

impl Case {
    /// The case whose run in `place` has ended before, of the same scene.
    pub fn finished(entry: &Value, place: &Path) -> Option<Self> {
        let (own, wanted) =
            (std::fs::read(place.join(OF)).ok()?, std::fs::read(place.with_extension("toml")).ok()?);
        let case = Self::of(entry, place, Summary::read(place).ok()?, String::new());
        // A process that was lost says nothing of the scene.
        let lost = case.status == RunStatus::Interrupted || case.message.contains("was lost");
        (own == wanted && !lost).then_some(case)
    }

    /// The case whose run has ended now.
    pub fn ended(entry: &Value, place: &Path, output: &Output) -> io::Result<Self> {
        let printed = String::from_utf8_lossy(&output.stderr);
        let said = error_in(&printed).unwrap_or_else(|| printed.trim().to_owned());
        let refused = output.status.code() == Some(2);
        if let Some(summary) = Summary::read(place).ok().filter(|_| !refused) {
            files::write(&place.join(OF), &std::fs::read(place.with_extension("toml"))?)?;
            return Ok(Self::of(entry, place, summary, said));
        }
        let message = said.lines().next().unwrap_or_default().to_owned();
        let entry = entry.clone();
        Ok(Self { entry, status: RunStatus::Failed, message, summary: None, warnings: Vec::new() })
    }

    fn of(entry: &Value, place: &Path, summary: Summary, said: String) -> Self {
        let status = summary.status;
        let message = summary.message.clone().unwrap_or(said);
        let message = if status == RunStatus::Done { String::new() } else { message };
        let scene = format!("{}:", place.with_extension("toml").display());
        let warnings = summary.warnings.iter().map(|warning| without_place(warning, &scene));
        // Which measures are not there is of less weight than what is wrong.
        let (absent, mut warnings): (Vec<String>, Vec<String>) =
            warnings.partition(|warning| warning.contains(" absent: "));
        warnings.extend(absent);
        Self { entry: entry.clone(), status, message, summary: Some(summary), warnings }
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
        let verdict = &self.summary.as_ref()?.verdict;
        (!verdict.is_empty()).then(|| verdict.join("; "))
    }

    /// The same in a word; `None`: it could not be computed.
    pub fn fate(&self) -> Option<&'static str> {
        let summary = self.summary.as_ref().filter(|summary| summary.status != RunStatus::Failed)?;
        summary.verdict.first().map(|verdict| fate(verdict))
    }

    /// Why it is not done, and what its run warns of, in one line.
    pub fn notes(&self) -> String {
        let message = Some(&self.message).filter(|message| !message.is_empty()).cloned();
        let warnings = self.warnings.iter().map(|warning| format!("warning: {warning}"));
        message.into_iter().chain(warnings).collect::<Vec<_>>().join("; ").replace('\n', "; ")
    }

    /// What the screen shows of it.
    pub fn words(&self) -> String {
        match self.status {
            RunStatus::Done => self.sentence().unwrap_or_else(|| "no verdict".into()),
            status => format!("{}: {}", status.word(), self.message.lines().next().unwrap_or_default()),
        }
    }
}

/// A warning without `FILE:LINE:COLUMN: ` where that is of `scene` (`FILE:`): another member has other lines.
fn without_place(warning: &str, scene: &str) -> String {
    let behind = warning.strip_prefix(scene).and_then(|rest| rest.split_once(": "));
    behind.map_or(warning, |(_, what)| what).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_is_known_by_its_first_words() {
        for (sentence, word) in [
            ("rock `block` was stopped by the net in 0.28 s over 4.49 m, from 24.1 m/s at 23.6 s", "stopped"),
            ("rock `a b` passed beside the net with a clearance of 1.00 m, near (0, 0, 0)", "passed beside"),
            ("rock `r` went through the torn structure: it touched at 0.1 s", "went through"),
            ("rock `r` was still being stopped by the net at 1.2 s: 9.9 m/s along", "not decided"),
            ("rock `r` still moved with 9.90 m/s near (0, 0, 0) at the end, at 1.2 s", "not decided"),
            ("rock `r` came to rest on the terrain near (0, 0, 0) at 1.0 s", "did not reach"),
        ] {
            assert_eq!(fate(sentence), word);
        }
        assert_eq!(fates().count(), 8);
        assert_eq!(fates().filter(|word| *word == UNDECIDED).count(), 1);
    }

    #[test]
    fn a_warning_is_the_same_for_every_member() {
        assert_eq!(
            without_place("out/b/17.toml:73:9: dem.time_step: x", "out/b/17.toml:"),
            "dem.time_step: x"
        );
        assert_eq!(without_place("posts have turned: x", "out/b/17.toml:"), "posts have turned: x");
    }
}
