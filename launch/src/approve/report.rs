//! What the test came to: `approval.json`, `approval.csv`, and the screen.

use super::Case;
use super::judge::{Criterion, Result as Judged, category};
use super::measured::{Launch, Row, Which};
use super::site::Kit;
use serde_json::{Value, json};
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::numbers::{percent, three};

/// Everything.
const JSON: &str = "approval.json";
/// The numbers of all launches, a row each.
const TABLE: &str = "approval.csv";
/// Most rows of utilisation on the screen.
const SHOWN: usize = 6;

impl Case {
    fn launch(&self, which: Which) -> Option<&Launch> {
        self.launches.iter().find(|launch| launch.which == which)
    }

    /// What uses most of its strength or stroke in any launch, each part once, the largest first.
    fn utilisation(&self) -> Vec<(&Row, Which)> {
        let all =
            self.launches.iter().flat_map(|launch| launch.rows.iter().map(move |row| (row, launch.which)));
        let mut all: Vec<_> =
            all.filter(|(row, _)| row.share.is_some() && !row.name.starts_with("energy")).collect();
        all.sort_by(|a, b| b.0.share.unwrap_or(0.0).total_cmp(&a.0.share.unwrap_or(0.0)));
        let mut found: Vec<(&Row, Which)> = Vec::new();
        for (row, which) in all {
            if found.iter().all(|(known, _)| known.name != row.name) {
                found.push((row, which));
            }
        }
        found
    }

    /// Why it does not pass: the first criterion that decides.
    fn decides(&self) -> Option<&Criterion> {
        let verdict = self.verdict();
        self.criteria.iter().find(|criterion| verdict != Judged::Pass && criterion.result == verdict)
    }
}

impl Criterion {
    fn number(&self) -> String {
        match (self.value, self.bound) {
            (Some(value), Some(bound)) => {
                let unit = if self.unit == "1" { String::new() } else { format!(" {}", self.unit) };
                format!("{}{unit} (bound {})", three(value), three(bound))
            }
            _ => String::new(),
        }
    }
}

/// How the verdict stands against what is varied, in a sentence.
fn stands(cases: &[Case], all: usize) -> String {
    let Some(first) = cases.first() else { return String::new() };
    let verdict = first.verdict();
    let same = cases.iter().filter(|case| case.verdict() == verdict).count();
    let turned = cases.iter().filter(|case| case.verdict() != verdict).map(|case| {
        let decides =
            case.decides().map_or(String::new(), |c| format!(": {} {} {}", c.launch, c.name, c.number()));
        format!("{} makes it {}{}", case.title(), case.verdict().words(), decides.trim_end())
    });
    let open =
        if cases.len() < all { format!("; {} are still to run", all - cases.len()) } else { String::new() };
    let turned: Vec<String> = turned.collect();
    let turned = if turned.is_empty() { String::new() } else { format!("; {}", turned.join("; ")) };
    format!("{} in {same} of {} cases{turned}{open}", verdict.words(), cases.len())
}

/// Everything as JSON. Nothing of it depends on when and where the runs were made.
pub fn json(kit: &Kit, cases: &[Case], all: usize) -> Value {
    let of_launch = |launch: &Launch| {
        let torn: Vec<String> = launch.torn.iter().flatten().map(ToString::to_string).collect();
        json!({
            "launch": launch.which.name(), "fate": launch.fate, "doubt": launch.doubt, "broken": torn, "numbers": launch.rows,
            "category": launch.value("h_R/h_N").filter(|_| launch.which == Which::Mel).map(category),
        })
    };
    let of_case = |case: &Case| {
        let used = case.utilisation().into_iter().map(|(row, which)| {
            json!({ "name": row.name, "share": row.share, "launch": which.name(), "member": row.member })
        });
        json!({
            "case": case.title(), "verdict": case.verdict(), "criteria": case.criteria,
            "launches": case.launches.iter().map(of_launch).collect::<Vec<_>>(), "utilisation": used.collect::<Vec<_>>(),
        })
    };
    let block = |energy: f64| {
        let block = kit.block(energy);
        json!({ "energy_J": energy, "mass_kg": block.mass, "edge_m": block.size })
    };
    json!({
        "kit": kit.name(), "class": kit.class(), "site": "vertical: gravity along the motion of the block",
        "speed_m_per_s": kit.speed, "density_kg_per_m3": kit.density,
        "mel": block(kit.mel), "sel": kit.sel.map(block),
        "h_N_m": cases.first().and_then(|case| case.launches.first()?.value("h_N")),
        "verdict": cases.first().map(Case::verdict), "stands": stands(cases, all),
        "cases": cases.iter().map(of_case).collect::<Vec<_>>(),
    })
}

/// Write both files.
pub fn write(kit: &Kit, cases: &[Case], all: usize, out: &Path) -> io::Result<()> {
    files::write_json(&out.join(JSON), &json(kit, cases, all))?;
    type Line<'a> = (&'a Case, &'a Launch, &'a Row);
    let of = |case| move |launch| (case, launch);
    let lines: Vec<Line> = (cases.iter())
        .flat_map(|case| case.launches.iter().map(of(case)))
        .flat_map(|(case, launch): (&Case, &Launch)| launch.rows.iter().map(move |row| (case, launch, row)))
        .collect();
    let table = Columns::new()
        .text("case", |line: &Line| line.0.title().into())
        .with("launch", |line: &Line| line.1.which.name().into())
        .text("name", |line: &Line| line.2.name.clone())
        .number("value", |line: &Line| line.2.value)
        .with("unit", |line: &Line| line.2.unit.into())
        .number("time_s", |line: &Line| line.2.time_s)
        .number("share", |line: &Line| line.2.share)
        .numbers(["x", "y", "z"], |line: &Line| line.2.vector)
        .text("member", |line: &Line| line.2.member.clone().unwrap_or_default())
        .text("note", |line: &Line| line.2.note.clone().unwrap_or_default());
    files::write(&out.join(TABLE), table.csv(&lines)?.as_bytes())
}

/// What the screen shows.
pub fn screen(kit: &Kit, cases: &[Case], out: &Path) -> String {
    let Some(first) = cases.first() else { return String::new() };
    let block = kit.block(kit.mel);
    let height = first.launches.first().and_then(|launch| launch.value("h_N")).map_or("-".into(), three);
    let mut text = format!(
        "{}: class {}, h_N {height} m; block of {} kg, {} m, {} m/s; vertical site\n\n",
        kit.name(),
        kit.class(),
        three(block.mass),
        three(block.size),
        three(kit.speed)
    );
    let of = |launch: &&Launch, name: &str, factor: f64| launch.value(name).map(|value| factor * value);
    let launches: Vec<&Launch> = first.launches.iter().collect();
    text += &Columns::new()
        .with("launch", |launch: &&Launch| launch.which.name().into())
        .with("fate", |launch| launch.fate.map_or("-", |fate| fate.words()).into())
        .number("impact kJ", |launch| of(launch, "impact_energy", 1e-3))
        .number("absorbed kJ", |launch| of(launch, "absorbed_energy", 1e-3))
        .number("elongation m", |launch| of(launch, "max_elongation", 1.0))
        .number("braking s", |launch| of(launch, "braking_time", 1.0))
        .number("mean kN", |launch| of(launch, "block_force_mean", 1e-3))
        .number("peak 1 ms kN", |launch| of(launch, "block_force_peak_1ms", 1e-3))
        .number("h_R m", |launch| of(launch, "h_R", 1.0))
        .number("h_R/h_N", |launch| of(launch, "h_R/h_N", 1.0))
        .with("broken", |launch| {
            launch.torn.iter().flatten().map(|torn| torn.elements).sum::<u64>().to_string()
        })
        .aligned(&launches);
    text += "\n";
    let criteria: Vec<&Criterion> = first.criteria.iter().collect();
    text += &Columns::new()
        .with("launch", |of: &&Criterion| of.launch.into())
        .with("criterion", |of| of.name.into())
        .with("result", |of| of.result.words().into())
        .with("number", |of| of.number())
        .with("how", |of| of.why.clone())
        .aligned(&criteria);
    if let Some(share) = first.launch(Which::Mel).and_then(|mel| mel.value("h_R/h_N")) {
        text += &format!("\ncategory {} (h_R/h_N {} after MEL)\n", category(share), three(share));
    }
    text += "\nshare of strength or stroke, largest first:\n";
    for (row, which) in first.utilisation().into_iter().take(SHOWN) {
        text += &format!("  {:<28} {:>7}  {}\n", row.name, percent(row.share.unwrap_or(0.0)), which.name());
    }
    if cases.len() > 1 {
        let all: Vec<&Case> = cases.iter().collect();
        let mel = |case: &&Case, name: &str| case.launch(Which::Mel).and_then(|launch| launch.value(name));
        text += "\n";
        text += &Columns::new()
            .with("case", |case: &&Case| case.title().into())
            .with("verdict", |case| case.verdict().words().into())
            .number("elongation m", |case| mel(case, "max_elongation"))
            .number("braking s", |case| mel(case, "braking_time"))
            .number("peak 1 ms kN", |case| mel(case, "block_force_peak_1ms").map(|force| 1e-3 * force))
            .number("h_R/h_N", |case| mel(case, "h_R/h_N"))
            .number("SEL 1 h_R/h_N", |case| {
                case.launch(Which::Sel1).and_then(|launch| launch.value("h_R/h_N"))
            })
            .with("most used", |case| {
                let most = case.utilisation().into_iter().next();
                most.map_or("-".into(), |(row, _)| {
                    format!("{} {}", percent(row.share.unwrap_or(0.0)), row.name)
                })
            })
            .with("decided by", |case| {
                case.decides().map_or(String::new(), |c| format!("{} {}", c.launch, c.name))
            })
            .aligned(&all);
    }
    let out = out.display();
    text + &format!(
        "\nverdict: {}\nresults: {out}/{JSON}, {TABLE}; runs: {out}/runs\n",
        stands(cases, cases.len())
    )
}
