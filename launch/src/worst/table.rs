//! What the barrier did to all chosen members: a row for each, counts, envelopes.

use super::case::{Case, Chosen, UNDECIDED, fates};
use interface_defs::message::Measure;
use interface_defs::toolkit::summary::{RunStatus, Summary, short, split_member};
use serde_json::{Value, json};
use std::fmt::Write;
use std::io;
use std::path::Path;

/// One row for each member.
pub const VERDICTS: &str = "verdicts.csv";
/// Measures of which the largest says nothing: places, directions and times of impacts.
const NO_ENVELOPE: [&str; 4] = ["impact_velocity_", "impact_direction_", "impact_time", "time_of_impact"];
/// Most members that a warning names.
const NAMED: usize = 5;

/// Names and units of all measures, in the order in which they are first found.
fn measures(cases: &[Case]) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    for measure in cases.iter().filter_map(|case| case.summary.as_ref()).flat_map(|summary| &summary.measures)
    {
        let name = split_member(&measure.name).0;
        if !found.iter().any(|(known, _)| known == name) {
            found.push((name.to_owned(), measure.unit.clone()));
        }
    }
    found
}

/// The name of a column with its unit.
fn column((name, unit): &(String, String)) -> String {
    match unit.as_str() {
        "1" => name.clone(),
        unit => format!("{name}_{}", unit.replace('/', "_per_").replace('*', "_")),
    }
}

/// Write the rows.
pub fn write_rows(keys: &[String], cases: &[Case], dir: &Path) -> io::Result<()> {
    let path = dir.join(format!("{VERDICTS}.part"));
    let mut table = csv::Writer::from_path(&path)?;
    let measures = measures(cases);
    let own = ["verdict", "status"].map(String::from);
    let columns = measures.iter().map(column);
    let last = ["sentence", "message"].map(String::from);
    table.write_record(keys.iter().cloned().chain(own).chain(columns).chain(last))?;
    for case in cases {
        let known = keys.iter().map(|key| match &case.entry[key] {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            number => number.to_string(),
        });
        let own = [case.fate().unwrap_or_default().to_owned(), case.status.word().to_owned()];
        let values = measures.iter().map(|(name, _)| {
            case.summary.as_ref().and_then(|s| s.measure(name)).map_or(String::new(), |v| v.to_string())
        });
        let last = [case.sentence().unwrap_or_default(), case.notes()];
        table.write_record(known.chain(own).chain(values).chain(last))?;
    }
    table.flush()?;
    std::fs::rename(path, dir.join(VERDICTS))
}

/// What the runs warn of, each once, whatever its numbers, with how many members it is said of. Where the numbers differ, those of the first
/// are said to be its own.
fn warnings(cases: &[Case]) -> Vec<String> {
    let mut found: Vec<(String, &str, Vec<u64>, bool)> = Vec::new();
    for (case, warning) in cases.iter().flat_map(|case| case.warnings.iter().map(move |w| (case, w))) {
        let same: String =
            warning.split(|c: char| c.is_ascii_digit()).filter(|part| !part.is_empty()).collect();
        match found.iter_mut().find(|(known, ..)| *known == same) {
            Some((_, first, members, differ)) => {
                *differ |= *first != warning;
                if members.last() != Some(&case.member()) {
                    members.push(case.member());
                }
            }
            None => found.push((same, warning, vec![case.member()], false)),
        }
    }
    let said = |members: &[u64]| format!("{} of {} members: {}", members.len(), cases.len(), listed(members));
    let line = |(_, warning, members, differ): &(String, &str, Vec<u64>, bool)| match differ {
        false => format!("{warning} ({})", said(members)),
        true => format!(
            "member {}: {warning} (likewise, each with numbers of its own, {})",
            members[0],
            said(members)
        ),
    };
    found.iter().map(line).collect()
}

fn listed(members: &[u64]) -> String {
    let names: Vec<String> = members.iter().take(NAMED).map(u64::to_string).collect();
    names.join(", ") + if members.len() > NAMED { ", ..." } else { "" }
}

/// Members of whose fate nothing can be said, and what to do.
fn undecided(cases: &[Case], barrier: &str) -> Option<String> {
    let open: Vec<u64> =
        cases.iter().filter(|case| case.fate() == Some(UNDECIDED)).map(Case::member).collect();
    let said = || {
        format!(
            "{} of {} members are {UNDECIDED} at the end of their runs ({}): raise end_time of {barrier}",
            open.len(),
            cases.len(),
            listed(&open)
        )
    };
    (!open.is_empty()).then(said)
}

/// Counts of verdicts; of every measure the largest, with its member. Members that were chosen as the worst are no sample:
/// there are no quantiles. `barrier` is the file of its scene.
pub fn summary(chosen: &Chosen, cases: &[Case], barrier: &str) -> Summary {
    let bad: Vec<&Case> = cases.iter().filter(|case| case.status != RunStatus::Done).collect();
    let mut summary = Summary::new(if bad.is_empty() { RunStatus::Done } else { RunStatus::Unreliable });
    let count = |word: &str| cases.iter().filter(|case| case.fate() == Some(word)).count();
    let uncounted = cases.iter().filter(|case| case.fate().is_none()).count();
    let mut words: Vec<String> = fates()
        .map(|word| (word, count(word)))
        .filter(|(_, n)| *n > 0)
        .map(|(w, n)| format!("{n} {w}"))
        .collect();
    if uncounted > 0 {
        words.push(format!("{uncounted} failed"));
    }
    let (of, reach, line) = (chosen.members, chosen.reach, &chosen.line);
    summary.verdict.push(format!(
        "{reach} of {of} members reach the line `{line}`; of the {} worst: {}",
        cases.len(),
        words.join(", ")
    ));
    let mut report = |name: String, value: f64, unit: &str| {
        summary.measures.push(Measure { name, value, unit: unit.into(), time: None });
    };
    report("members".into(), of as f64, "1");
    report("members_at_line".into(), reach as f64, "1");
    report("members_computed".into(), (cases.len() - uncounted) as f64, "1");
    for word in fates() {
        report(format!("members_{}", word.replace(' ', "_")), count(word) as f64, "1");
    }
    report("members_failed".into(), uncounted as f64, "1");
    for (name, unit) in measures(cases)
        .into_iter()
        .filter(|(name, _)| !NO_ENVELOPE.iter().any(|start| name.starts_with(start)))
    {
        let value = |case: &Case| Some((case.summary.as_ref()?.measure(&name)?, case.member()));
        let trusted = cases.iter().filter(|case| case.status == RunStatus::Done);
        let mut values: Vec<(f64, u64)> = trusted.filter_map(value).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (Some(low), Some(high)) = (values.first(), values.last()) else { continue };
        // Of a quantity that is worse the lower it is, such as a compression.
        let (end, (most, member)) =
            if name.ends_with("_min") { ("smallest", low) } else { ("largest", high) };
        report(format!("{name}_{end} @ member {member}"), *most, &unit);
    }
    summary.warnings.extend(undecided(cases, barrier));
    summary.warnings.extend(warnings(cases));
    let wall: f64 = cases.iter().filter_map(|case| case.summary.as_ref()?.cost.get("wall_s")?.as_f64()).sum();
    summary.cost.insert("wall_s".into(), json!(wall));
    if let Some(first) = bad.first() {
        let what = format!(
            "{} of {} members failed or are unreliable and are left out of the envelopes; the first, member {}: {}",
            bad.len(),
            cases.len(),
            first.member(),
            first.message.lines().next().unwrap_or_default()
        );
        summary.message = Some(format!("unreliable: {what}"));
    }
    summary
}

/// What the screen shows: a row for each member, then the counts.
pub fn screen(summary: &Summary, cases: &[Case], dir: &Path) -> String {
    let head = [
        "member",
        "chosen for",
        "energy",
        "height",
        "speed",
        "verdict",
        "elongation",
        "reaction 1 ms",
        "status",
    ];
    let mut rows: Vec<[String; 9]> = vec![head.map(String::from)];
    for case in cases {
        let of = |key: &str, scale: f64, unit: &str| {
            case.number(key).map_or("-".into(), |value| format!("{} {unit}", short(scale * value)))
        };
        let measure = |name: &str, scale: f64, unit: &str| {
            let value = case.summary.as_ref().and_then(|summary| summary.measure(name));
            value.map_or("-".into(), |value| format!("{} {unit}", short(scale * value)))
        };
        rows.push([
            case.member().to_string(),
            format!("{} {}", case.entry["chosen_for"].as_str().unwrap_or_default(), case.entry["rank"]),
            of("kinetic_energy_J", 1e-3, "kJ"),
            of("passing_height_m", 1.0, "m"),
            of("speed_m_per_s", 1.0, "m/s"),
            case.fate().unwrap_or("-").into(),
            measure("max_elongation", 1.0, "m"),
            measure("max_reaction_1ms", 1e-3, "kN"),
            case.status.word().into(),
        ]);
    }
    let widths: Vec<usize> =
        (0..head.len()).map(|k| rows.iter().map(|row| row[k].len()).max().unwrap_or(0)).collect();
    let mut text = String::new();
    for row in &rows {
        let line: Vec<String> =
            row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
        let _ = writeln!(text, "{}", line.join("  ").trim_end());
    }
    text + "\n" + &summary.table(dir)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(member: u64, status: RunStatus, verdict: &str, elongation: f64) -> Case {
        let mut summary = Summary::new(status);
        summary.verdict.push(verdict.into());
        summary.measures.push(Measure {
            name: "max_elongation".into(),
            value: elongation,
            unit: "m".into(),
            time: None,
        });
        let name = "posts_tension_min @ post 2".to_owned();
        summary.measures.push(Measure { name, value: -elongation, unit: "N".into(), time: None });
        let message = if status == RunStatus::Done { String::new() } else { "why".into() };
        Case {
            entry: json!({ "member": member, "chosen_for": "energy" }),
            status,
            message,
            summary: Some(summary),
            warnings: Vec::new(),
        }
    }

    #[test]
    fn verdicts_are_counted_and_envelopes_name_their_member() {
        let chosen = Chosen {
            line: "barrier".into(),
            members: 200,
            reach: 50,
            columns: Vec::new(),
            chosen: Vec::new(),
        };
        let mut cases = vec![
            case(7, RunStatus::Done, "rock `r` was stopped by the net", 1.0),
            case(9, RunStatus::Done, "rock `r` went through the net", 3.0),
            case(4, RunStatus::Done, "rock `r` was stopped by the net", 2.0),
        ];
        let done = summary(&chosen, &cases, "b.toml");
        assert_eq!(done.status, RunStatus::Done);
        assert!(done.verdict[0].ends_with("of the 3 worst: 2 stopped, 1 went through"), "{:?}", done.verdict);
        assert!(
            done.measures.iter().any(|m| m.name == "max_elongation_largest @ member 9" && m.value == 3.0)
        );
        assert!(
            done.measures
                .iter()
                .any(|m| m.name == "posts_tension_min_smallest @ member 9" && m.value == -3.0)
        );
        // The worst are no sample.
        assert!(done.measures.iter().all(|m| !m.name.contains("_q")), "{:?}", done.measures);
        assert_eq!(
            (done.measure("members_stopped"), done.measure("members_passed_over")),
            (Some(2.0), Some(0.0))
        );
        cases.push(case(1, RunStatus::Unreliable, "rock `r` was stopped by the net", 9.0));
        let bad = summary(&chosen, &cases, "b.toml");
        assert_eq!((bad.status, bad.measure("max_elongation_largest")), (RunStatus::Unreliable, Some(3.0)));
        assert!(bad.message.unwrap_or_default().contains("1 of 4 members"), "what is left out is said");
        let dir = tempfile::tempdir().expect("a directory");
        write_rows(&["member", "chosen_for"].map(String::from), &cases, dir.path()).expect("written");
        let text = std::fs::read_to_string(dir.path().join(VERDICTS)).expect("a table");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "member,chosen_for,verdict,status,max_elongation_m,posts_tension_min_N,sentence,message"
        );
        assert_eq!(lines[4], "1,energy,stopped,unreliable,9,-9,rock `r` was stopped by the net,why");
    }
    #[test]
    fn warnings_of_the_runs_are_told_once_with_their_members() {
        let mut cases = vec![
            case(7, RunStatus::Done, "rock `r` was stopped by the net", 1.0),
            case(9, RunStatus::Done, "rock `r` was still being stopped by the net", 3.0),
            case(4, RunStatus::Done, "rock `r` still moved with 3 m/s", 2.0),
        ];
        cases[0].warnings = vec!["posts have turned by 76 degrees".into(), "other".into()];
        cases[2].warnings = vec!["posts have turned by 8 degrees".into()];
        let chosen = Chosen {
            line: "barrier".into(),
            members: 200,
            reach: 50,
            columns: Vec::new(),
            chosen: Vec::new(),
        };
        let summary = summary(&chosen, &cases, "b.toml");
        assert_eq!(
            summary.warnings,
            [
                "2 of 3 members are not decided at the end of their runs (9, 4): raise end_time of b.toml",
                "member 7: posts have turned by 76 degrees (likewise, each with numbers of its own, 2 of 3 members: 7, 4)",
                "other (1 of 3 members: 7)",
            ]
        );
        assert_eq!(summary.measure("members_not_decided"), Some(2.0));
        assert_eq!(cases[0].notes(), "warning: posts have turned by 76 degrees; warning: other");
        cases[2].message = "why\nthis".into();
        assert_eq!(cases[2].notes(), "why; this; warning: posts have turned by 8 degrees");
    }
}
