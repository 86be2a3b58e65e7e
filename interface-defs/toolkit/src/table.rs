//! The end of a run on the screen: verdict, the numbers that matter, warnings, where the files are.

use super::exit::Exit;
use super::run_dir::SUMMARY;
use super::screen::{complain, show};
use super::summary::{RunStatus, Summary, short};
use interface_defs::diagnostic::{Diagnostic, Severity, code};
use interface_defs::message::Measure;
use std::fmt::Write as _;
use std::path::Path;

/// Numbers that are shown; all others are in `summary.json`.
const SHOWN: usize = 10;

/// Warnings of one kind that are shown, such as ruptures; all are in `summary.json`.
const OF_A_KIND: usize = 3;

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
    [m.name.clone(), short_in(&m.unit, m.value), format!("{unit:<4} {time}{member}")]
}

/// Six significant digits; of metres to the millimetre where that is more: coordinates of a survey are large.
fn short_in(unit: &str, value: f64) -> String {
    // From here on six digits are coarser than a millimetre.
    let large = value.is_finite() && value.abs() >= 999.999_5;
    if unit == "m" && large { ((value * 1000.0).round() / 1000.0).to_string() } else { short(value) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::message::Worse;

    fn measure(name: &str, value: f64, time: Option<f64>) -> Measure {
        Measure::new(name, value, "m").at(time)
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
