//! What the test came to: `approval.json`, `approval.csv`, and the screen.

use super::judge::{Criterion, Result as Judged, category};
use super::measured::{Launch, Row};
use super::site::{Block, Kit, Which};
use super::{Case, RUNS};
use interface_defs::verdict::Fate;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::numbers::{percent, three};

/// Everything.
pub const JSON: &str = "approval.json";
/// The numbers of all launches, a row each.
const TABLE: &str = "approval.csv";
/// Most rows of utilisation on the screen.
const SHOWN: usize = 6;
/// A column of the screen.
type Column = (&'static str, &'static str, f64);
/// Columns of the screen: title, number of a launch, factor to its unit there.
const OF_LAUNCH: [Column; 8] = [
    ("impact kJ", "impact_energy", 1e-3),
    ("absorbed kJ", "absorbed_energy", 1e-3),
    ("elongation m", "max_elongation", 1.0),
    ("braking s", "braking_time", 1.0),
    ("mean kN", "block_force_mean", 1e-3),
    ("peak 1 ms kN", "block_force_peak_1ms", 1e-3),
    ("h_R m", "h_R", 1.0),
    ("h_R/h_N", SHARE, 1.0),
];
/// Share of the height that is left.
const SHARE: &str = "h_R/h_N";

impl Case {
    /// A number of a launch.
    fn value(&self, which: Which, name: &str) -> Option<f64> {
        self.launches.iter().find(|launch| launch.which == which)?.value(name)
    }

    /// What uses most of its strength or stroke in any launch, each part once, the largest first.
    fn utilisation(&self) -> Vec<(&Row, f64, Which)> {
        let all =
            self.launches.iter().flat_map(|of| of.rows.iter().map(move |row| (row, row.share, of.which)));
        let all = all.filter(|(row, ..)| !row.name.starts_with("energy"));
        let mut all: Vec<_> = all.filter_map(|(row, share, which)| Some((row, share?, which))).collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut names = HashSet::new();
        all.retain(|(row, ..)| names.insert(&row.name));
        all
    }

    /// Why it does not pass: the first criterion that decides.
    fn decides(&self) -> Option<&Criterion> {
        let verdict = self.verdict();
        self.criteria.iter().find(|criterion| verdict != Judged::Pass && criterion.result == verdict)
    }
}

impl Criterion {
    fn number(&self) -> String {
        let unit = if self.unit == "1" { "" } else { &format!(" {}", self.unit) };
        let both = self.value.zip(self.bound);
        both.map_or(String::new(), |(value, bound)| {
            format!("{}{unit} (bound {})", three(value), three(bound))
        })
    }
}

/// How the verdict stands against what is varied, in a sentence.
fn stands(cases: &[Case], all: usize) -> String {
    let Some(verdict) = cases.first().map(Case::verdict) else { return String::new() };
    let (same, turned): (Vec<&Case>, Vec<&Case>) = cases.iter().partition(|case| case.verdict() == verdict);
    let mut text = format!("{} in {} of {} cases", verdict.words(), same.len(), cases.len());
    for case in turned {
        text += &format!("; {} makes it {}", case.name, case.verdict().words());
        let why = case.decides().map(|of| format!(": {} {} {}", of.launch, of.name, of.number()));
        text += why.unwrap_or_default().trim_end();
    }
    if cases.len() < all { text + &format!("; {} are still to run", all - cases.len()) } else { text }
}

/// Everything as JSON. Nothing of it depends on when and where the runs were made.
pub fn json(kit: &Kit, cases: &[Case], all: usize) -> Value {
    let of_launch = |launch: &Launch| {
        let torn: Vec<String> = launch.torn.iter().flatten().map(ToString::to_string).collect();
        json!({
            "launch": launch.which.name(), "fate": launch.fate, "doubt": launch.doubt, "broken": torn, "numbers": launch.rows,
            "category": launch.value(SHARE).filter(|_| launch.which == Which::Mel).map(category),
        })
    };
    let of_case = |case: &Case| {
        let used = case.utilisation().into_iter().map(|(row, share, which)| {
            json!({ "name": row.name, "share": share, "launch": which.name(), "member": row.member })
        });
        json!({
            "case": case.name, "verdict": case.verdict(), "criteria": case.criteria,
            "launches": case.launches.iter().map(of_launch).collect::<Vec<_>>(), "utilisation": used.collect::<Vec<_>>(),
        })
    };
    let block = |energy: f64| {
        let block = kit.block(energy);
        json!({ "energy_J": energy, "mass_kg": block.mass, "edge_m": block.size })
    };
    json!({
        "kit": kit.name, "class": kit.class, "site": "vertical: gravity along the motion of the block",
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
    type Line<'a> = (&'a Case, Which, &'a Row);
    let launches = cases.iter().flat_map(|case| case.launches.iter().map(move |launch| (case, launch)));
    let lines =
        launches.flat_map(|(case, launch)| launch.rows.iter().map(move |row| (case, launch.which, row)));
    let table = Columns::new()
        .text("case", |line: &Line| line.0.name.clone())
        .with("launch", |line| line.1.name().into())
        .text("name", |line| line.2.name.clone())
        .number("value", |line| line.2.value)
        .with("unit", |line| line.2.unit.into())
        .number("time_s", |line| line.2.time_s)
        .number("share", |line| line.2.share)
        .numbers(["x", "y", "z"], |line| line.2.vector)
        .text("member", |line| line.2.member.clone().unwrap_or_default())
        .text("note", |line| line.2.note.clone().unwrap_or_default());
    files::write(&out.join(TABLE), table.csv(&lines.collect::<Vec<_>>())?.as_bytes())
}

/// A table for the screen with these columns of numbers.
fn numbered<'a, R: 'a>(
    table: Columns<'a, R>,
    columns: &'a [Column],
    value: impl Fn(&R, &str) -> Option<f64> + Copy + 'a,
) -> Columns<'a, R> {
    columns.iter().fold(table, |table, (title, name, factor)| {
        table.number(*title, move |row| value(row, name).map(|value| factor * value))
    })
}

/// What the screen shows.
pub fn screen(kit: &Kit, cases: &[Case], out: &Path) -> String {
    let Some(first) = cases.first() else { return String::new() };
    let of_launch = Columns::new()
        .with("launch", |launch: &Launch| launch.which.name().into())
        .with("fate", |launch| launch.fate.map_or("-", Fate::words).into());
    let of_launch = numbered(of_launch, &OF_LAUNCH, Launch::value).with("broken", |launch| {
        launch.torn.iter().flatten().map(|torn| torn.elements).sum::<u64>().to_string()
    });
    let of_criterion = Columns::new()
        .with("launch", |of: &Criterion| of.launch.into())
        .with("criterion", |of| of.name.into())
        .with("result", |of| of.result.words().into())
        .with("number", Criterion::number)
        .with("how", |of| of.why.clone());
    let of_case = Columns::new()
        .with("case", |case: &Case| case.name.clone())
        .with("verdict", |case| case.verdict().words().into());
    let of_case = numbered(of_case, &OF_LAUNCH[2..], |case, name| case.value(Which::Mel, name))
        .number("SEL 1 h_R/h_N", |case| case.value(Which::Sel1, SHARE))
        .with("most used", |case| {
            let most = case.utilisation().into_iter().next();
            most.map_or("-".into(), |(row, share, _)| format!("{} {}", percent(share), row.name))
        })
        .with("decided by", |case| {
            case.decides().map_or(String::new(), |c| format!("{} {}", c.launch, c.name))
        });
    let used = first.utilisation().into_iter().take(SHOWN);
    let used = used.map(|(row, share, which)| format!("{} {} ({})", percent(share), row.name, which.name()));
    let category = first.value(Which::Mel, SHARE).map_or("-", category);
    let Block { mass, size } = kit.block(kit.mel);
    let [mass, size, speed] = [mass, size, kit.speed].map(three);
    let (Kit { name, class, .. }, out) = (kit, out.display());
    format!(
        "{name}: class {class}; block of {mass} kg, {size} m, {speed} m/s; vertical site\n\n{}\n{}\ncategory {category}; most used of \
         strength or stroke: {}\n\n{}\nverdict: {}\nresults: {out}/{JSON}, {TABLE}; runs: {out}/{RUNS}\n",
        of_launch.aligned(&first.launches),
        of_criterion.aligned(&first.criteria),
        used.collect::<Vec<_>>().join(", "),
        of_case.aligned(cases),
        stands(cases, cases.len())
    )
}
