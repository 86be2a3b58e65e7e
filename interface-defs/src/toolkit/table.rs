//! The end of a run on the screen: verdict, the numbers that matter, warnings, where the files are.

use super::run_dir::SUMMARY;
use super::screen::show;
use super::summary::{Summary, short, split_member};
use crate::message::Measure;
use std::fmt::Write as _;
use std::path::Path;

/// Numbers that are shown; all others are in `summary.json`.
const SHOWN: usize = 10;

/// Warnings of one kind that are shown, such as ruptures; all are in `summary.json`.
const OF_A_KIND: usize = 3;

/// Measures by how much they matter, for every kind of run: what a run does not have takes no place. A measure of one of
/// several rocks, `block_impact_speed`, counts as `impact_speed`.
const RANKED: [&str; 28] = [
    "passing_share",
    "energy_q95",
    "energy_q99",
    "height_q95",
    "energy_error",
    "max_deflection",
    "max_reaction_1ms",
    "max_cable_force",
    "max_penetration",
    "impact_speed",
    "impact_energy",
    "max_travel",
    "braking_time",
    "rebound_speed",
    "runout_distance",
    "run_out",
    "exit_distance",
    "way_out",
    "max_speed",
    "max_jump_height",
    "max_kinetic_energy",
    "impacts",
    "rest_x",
    "rest_y",
    "rest_z",
    "max_elongation",
    "max_reaction",
    "sag",
];

/// Names of measures that are kept for one version beside their new ones; shown once.
const ALIASES: [(&str, &str); 4] = [
    ("runout_distance", "run_out"),
    ("exit_distance", "way_out"),
    ("impact_time", "time_of_impact"),
    ("contact_time_fraction", "contact_share"),
];

impl Summary {
    /// The short text for the screen; `out` is where the files are.
    pub fn table(&self, out: &Path) -> String {
        let mut text = String::new();
        for sentence in &self.verdict {
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
        let mut kinds: Vec<(&str, usize)> = Vec::new();
        for warning in &self.warnings {
            let kind = kind(warning);
            let at = kinds.iter().position(|(known, _)| *known == kind).unwrap_or_else(|| {
                kinds.push((kind, 0));
                kinds.len() - 1
            });
            kinds[at].1 += 1;
            if kinds[at].1 <= OF_A_KIND {
                let _ = writeln!(text, "warning: {warning}");
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

    /// Print it on stdout.
    pub fn print_table(&self, out: &Path) {
        show(&self.table(out));
    }
}

/// The measures that matter most, in that order; in places that are left, the others as they come.
fn shown(measures: &[Measure]) -> Vec<&Measure> {
    let has = |name: &str| measures.iter().any(|m| m.name == name);
    let is_alias = |m: &Measure| {
        ALIASES.iter().any(|(new, old)| m.name.ends_with(old) && has(&m.name.replace(old, new)))
    };
    let rank = |m: &Measure| {
        let (name, _) = split_member(&m.name);
        let is =
            |ranked: &&str| name == *ranked || name.strip_suffix(*ranked).is_some_and(|p| p.ends_with('_'));
        RANKED.iter().position(is).unwrap_or(RANKED.len())
    };
    let mut shown: Vec<&Measure> = measures.iter().filter(|m| !is_alias(m)).collect();
    shown.sort_by_key(|m| rank(m));
    shown.truncate(SHOWN);
    shown
}

/// What makes warnings alike: the last name of the key of a scene that they begin with, or their words before the first number or name.
fn kind(warning: &str) -> &str {
    let text = without_place(warning);
    if let Some((key, _)) = text.split_once(": ")
        && key.contains('.')
        && key.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_' || b == b'.')
    {
        let named = |part: &&str| !part.bytes().all(|b| b.is_ascii_digit());
        return key.rsplit('.').find(named).unwrap_or(key);
    }
    let mut within = false;
    let ends = |c: char| {
        let ends = c == '`' || c == ':' || (c.is_ascii_digit() && !within);
        // Digits of a name, as of a file, are a part of it.
        within = c.is_alphanumeric();
        ends
    };
    let end = text.find(ends).unwrap_or(text.len());
    text[..end].trim_end_matches([' ', '='])
}

/// A warning without `FILE:LINE:COLUMN: ` before it.
fn without_place(warning: &str) -> &str {
    let Some((place, text)) = warning.split_once(": ") else { return warning };
    let is_number =
        |part: Option<&str>| part.is_some_and(|p| !p.is_empty() && p.bytes().all(|b| b.is_ascii_digit()));
    let mut parts = place.rsplit(':');
    if is_number(parts.next()) && is_number(parts.next()) { text } else { warning }
}

/// Name, number, and unit with time and member.
fn row(m: &Measure) -> [String; 3] {
    let (name, member) = split_member(&m.name);
    let unit = if m.unit == "1" { "" } else { &m.unit };
    let time = m.time.map_or(String::new(), |t| format!("at {} s", short(t)));
    let member = member.map_or(String::new(), |member| format!(" ({member})"));
    [name.to_owned(), short_in(&m.unit, m.value), format!("{unit:<4} {time}{member}")]
}

/// Six significant digits; of metres to the millimetre where that is more: coordinates of a survey are large.
fn short_in(unit: &str, value: f64) -> String {
    // From here on six digits are coarser than a millimetre.
    let large = value.is_finite() && value.abs() >= 999.999_5;
    if unit == "m" && large { ((value * 1000.0).round() / 1000.0).to_string() } else { short(value) }
}

#[cfg(test)]
mod tests {
    use super::super::summary::RunStatus;
    use super::*;

    fn measure(name: &str, value: f64, time: Option<f64>) -> Measure {
        Measure { name: name.into(), value, unit: "m".into(), time }
    }

    #[test]
    fn verdict_numbers_warnings_and_files_stand_in_this_order() {
        let mut summary = Summary::new(RunStatus::Unreliable);
        summary.verdict.push("block: stopped by the net".into());
        summary.measures = vec![
            measure("rest_x", 2_600_120.263_49, None),
            measure("posts_height_min @ post 3", 1.5, None),
            measure("max_deflection", 0.351_234_567, Some(0.5)),
        ];
        summary.warnings.push("mind the gap".into());
        summary.cost.insert("wall_s".into(), 0.25.into());
        let expected = "block: stopped by the net\n\
                        status            unreliable\n\
                        max_deflection       0.351235 m    at 0.5 s\n\
                        rest_x            2600120.263 m\n\
                        posts_height_min          1.5 m     (post 3)\n\
                        warning: mind the gap\n\
                        results           out/x\n";
        assert_eq!(summary.table(Path::new("out/x")), expected);
    }

    #[test]
    fn of_many_warnings_of_one_kind_the_first_are_shown_and_how_many_more_there_are() {
        let mut summary = Summary::new(RunStatus::Done);
        let ruptures = (0..7).map(|i| format!("rupture at t = {}.5 s: element {i} of net broke", i));
        summary.warnings = ruptures.chain(["the last one".into()]).collect();
        let table = summary.table(Path::new("out"));
        let shown: Vec<&str> = table.lines().filter_map(|line| line.strip_prefix("warning: ")).collect();
        assert_eq!(shown[..3], summary.warnings[..3]);
        assert_eq!(shown[3..], ["the last one", "4 more of `rupture at t`, in summary.json"]);
    }

    /// What a scene's keys are warned of is alike where the key is: one of a zone is not lost behind those of contacts.
    #[test]
    fn warnings_at_places_of_the_scene_are_of_the_kind_of_their_key() {
        let mut summary = Summary::new(RunStatus::Done);
        let presets =
            (0..4).map(|i| format!("206.toml:{i}:10: contact.{i}.preset: \"scree\" is uncalibrated"));
        let zone = "206.toml:18:10: terrain.zone.1.forest: its drag is uncalibrated".to_owned();
        summary.warnings = presets.chain([zone.clone()]).collect();
        let table = summary.table(Path::new("out"));
        let shown: Vec<&str> = table.lines().filter_map(|line| line.strip_prefix("warning: ")).collect();
        assert_eq!(shown[3..], [&zone, "1 more of `preset`, in summary.json"]);
        for (warning, due) in [
            ("a.toml:3:4: the rock is heavy", "the rock is heavy"),
            ("terrain: 4 triangles", "terrain"),
            ("line.0.points: x", "points"),
            ("vary.contact.0: x", "contact"),
        ] {
            assert_eq!(kind(warning), due, "{warning}");
        }
    }

    #[test]
    fn ten_numbers_are_shown_and_how_many_more_there_are() {
        let mut summary = Summary::new(RunStatus::Done);
        summary.measures = (0..12).map(|i| measure(&format!("gauge{i}_min"), 1.0, None)).collect();
        summary.measures.push(measure("block_max_deflection", 2.0, None));
        summary.measures.push(measure("energy_error", 1e-3, None));
        let table = summary.table(Path::new("out"));
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines.len(), 1 + SHOWN + 1);
        assert!(
            lines[1].starts_with("energy_error") && lines[2].starts_with("block_max_deflection"),
            "{table}"
        );
        assert!(lines[11].ends_with("out (4 more measures in summary.json)"), "{table}");
    }

    #[test]
    fn a_measure_under_its_old_and_new_name_is_shown_once() {
        let measures = [measure("run_out", 3.0, None), measure("runout_distance", 3.0, None)];
        let names: Vec<&str> = shown(&measures).iter().map(|m| m.name.as_str()).collect();
        assert_eq!(names, ["runout_distance"]);
    }
}
