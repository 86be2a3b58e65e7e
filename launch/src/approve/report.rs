//! What the test came to: `approval.json`, `approval.csv`, and `approval.txt`, which is what the screen shows.

use super::judge::{CATEGORIES, Criterion, Result as Judged, category};
use super::measured::{Launch, Row, TORN};
use super::site::{Block, Kit, Which};
use super::{Case, RUNS, folder};
use crate::run::progress::far;
use crate::run::sweep::is_kept;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};
use toolkit::columns::Columns;
use toolkit::exit::Exit;
use toolkit::files::{self, Dir};
use toolkit::numbers::three;
use toolkit::provenance;
use toolkit::run_dir::APPROVAL;

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// The numbers of all launches, a row each.
const TABLE: &str = "approval.csv";
/// What the screen shows.
pub const TEXT: &str = "approval.txt";
/// Columns of the screen: title, number of a launch, factor to its unit there.
const OF_LAUNCH: [(&str, &str, f64); 9] = [
    ("impact kJ", "impact_energy", 1e-3),
    ("absorbed kJ", "absorbed_energy", 1e-3),
    ("elongation m", "max_elongation", 1.0),
    ("braking s", "braking_time", 1.0),
    ("mean kN", "block_force_mean", 1e-3),
    ("peak 1 ms kN", "block_force_peak_1ms", 1e-3),
    ("h_N m", "h_N", 1.0),
    ("h_R m", "h_R", 1.0),
    ("h_R/h_N", SHARE, 1.0),
];
/// The residual height in that before.
const SHARE: &str = "h_R/h_N";

impl Case {
    /// A number of a launch.
    fn value(&self, which: Which, name: &str) -> Option<f64> {
        self.launches.iter().find(|launch| launch.which == which)?.value(name)
    }

    /// The largest utilisation of each part in any launch: name, share, what it has come to. What tore comes first, then the largest.
    fn utilisation(&self) -> Vec<(String, f64, &'static str, Which)> {
        let of_launch = |launch: &Launch| {
            let which = launch.which;
            launch.utilisation().into_iter().map(move |(name, share, to)| (name, share, to, which))
        };
        let mut all: Vec<_> = self.launches.iter().flat_map(of_launch).collect();
        all.sort_by(|a, b| (b.2 == TORN).cmp(&(a.2 == TORN)).then(b.1.total_cmp(&a.1)));
        let mut names = HashSet::new();
        all.retain(|(name, ..)| names.insert(name.clone()));
        all
    }

    /// All criteria with a result.
    fn criteria_of(&self, result: Judged) -> String {
        let of = self.criteria.iter().filter(|criterion| criterion.result == result);
        let named =
            |of: &Criterion| format!("{} {} {}", of.launch, of.name, of.number()).trim_end().to_owned();
        let named: Vec<String> = of.map(named).collect();
        if named.is_empty() { "-".into() } else { named.join(", ") }
    }

    /// Its verdict, with the criteria that decide it.
    fn decided(&self) -> String {
        let verdict = self.verdict();
        format!("{}: {}", verdict.words(), self.criteria_of(verdict))
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
    let count = |of: Judged| cases.iter().filter(|case| case.verdict() == of).count();
    let mut text = format!("{} ({} of {} cases failed", verdict.words(), count(Judged::Fail), cases.len());
    if count(Judged::NotSettled) > 0 {
        text += &format!(", {} not settled", count(Judged::NotSettled));
    }
    text += ")";
    for case in cases.iter().filter(|case| case.verdict() != verdict) {
        text += &format!("; {} makes it {}", case.name, case.decided());
    }
    if cases.len() < all { text + &format!("; {} are still to run", all - cases.len()) } else { text }
}

/// What follows for the kit, in sentences.
fn conclusion(kit: &Kit, cases: &[Case]) -> String {
    let Some((first, varied)) = cases.split_first() else { return String::new() };
    let what = match first.verdict() {
        Judged::Pass => "it keeps every criterion that was assessed".into(),
        _ => first.decided(),
    };
    let other = varied.iter().filter(|case| case.verdict() != first.verdict()).count();
    let stands = match varied.len() {
        0 => "How far it depends on brakes, friction and place of impact is not known: nothing was varied"
            .into(),
        all => format!("{other} of {all} variations change that"),
    };
    let energy = three(1e-3 * kit.mel);
    format!(
        "{} at {energy} kJ, as defined: {what}. {stands}. This is a computation, and no approval.",
        kit.name
    )
}

/// The category of a case, and what it is.
fn category_of(case: &Case) -> String {
    let [a, b] = CATEGORIES.map(|(least, name)| format!("{name} from {least}"));
    let Some(share) = case.value(Which::Mel, SHARE) else {
        let why = case.launches.iter().find(|launch| launch.which == Which::Mel).map(Launch::no_height);
        return format!("category -: at MEL {}", why.unwrap_or_default());
    };
    let named = category(share);
    format!("category {named}: h_R/h_N {} after MEL ({a}, {b}, else C; no criterion)", three(share))
}

/// Everything as JSON. Nothing of it depends on when and where the runs were made.
pub fn json(kit: &Kit, cases: &[Case], all: usize) -> Value {
    let of_launch = |case: &str, launch: &Launch| {
        let torn: Vec<String> = launch.torn.iter().flatten().map(ToString::to_string).collect();
        json!({
            "launch": launch.which.name(), "run": format!("{RUNS}/{}/{}", folder(case), launch.run), "accurate": launch.finer, "fate": launch.fate, "doubt": launch.doubt, "broken": torn, "numbers": launch.rows,
            "category": launch.value(SHARE).filter(|_| launch.which == Which::Mel).map(category),
        })
    };
    let of_case = |case: &Case| {
        let used = case.utilisation().into_iter().map(|(name, share, to, which)| {
            json!({ "name": name, "share": share, "of": to, "launch": which.name() })
        });
        json!({
            "case": case.name, "verdict": case.verdict(), "criteria": case.criteria,
            "launches": case.launches.iter().map(|launch| of_launch(&case.name, launch)).collect::<Vec<_>>(), "utilisation": used.collect::<Vec<_>>(),
        })
    };
    let block = |energy: f64| {
        let block = kit.block(energy);
        json!({ "energy_J": energy, "mass_kg": block.mass, "edge_m": block.size })
    };
    json!({
        "kit": kit.name, "class": kit.class, "kit_file": kit.file.file_name().map(|name| name.to_string_lossy()), "kit_hash": kit.hash,
        "version": VERSION, "site": "vertical: gravity along the motion of the block",
        "speed_m_per_s": kit.speed, "density_kg_per_m3": kit.density,
        "mel": block(kit.mel), "sel": kit.sel.map(block),
        "h_N_m": cases.first().and_then(|case| case.launches.first()?.value("h_N")),
        "verdict": cases.first().map(Case::verdict), "stands": stands(cases, all), "conclusion": conclusion(kit, cases),
        "all_cases": all, "cases": cases.iter().map(of_case).collect::<Vec<_>>(),
    })
}

/// How far the test in `dir` is: cases that are judged, runs that have begun and not ended, the verdict so far.
pub fn status(dir: &Path, running: Option<String>) -> (String, Exit) {
    let report: Value = files::read_json(&dir.join(APPROVAL)).unwrap_or_default();
    let cases = report["cases"].as_array().map_or(&[][..], Vec::as_slice);
    let verdict = |case: &Value| case["verdict"].as_str().unwrap_or("unknown").replace('_', " ");
    let all = report["all_cases"].as_u64().unwrap_or(0) as usize;
    let mut text = format!("{}: a test for approval, {} of {all} cases judged\n", dir.display(), cases.len());
    for case in cases {
        text += &format!("  {}: {}\n", case["case"].as_str().unwrap_or_default(), verdict(case));
    }
    let within = |dir: &Path| -> Vec<PathBuf> {
        let names = Dir::open(dir).and_then(|dir| dir.entries()).unwrap_or_default();
        names.iter().map(|(name, _)| dir.join(name)).filter(|path| path.is_dir()).collect()
    };
    for run in within(&dir.join(RUNS)).iter().flat_map(|case| within(case)).filter(|run| !is_kept(run)) {
        let name = run.strip_prefix(dir.join(RUNS)).unwrap_or(&run).display();
        text += &format!("  begun: {name}: {}\n", far(&run));
    }
    if let Some(stands) = report["stands"].as_str().filter(|_| !cases.is_empty()) {
        text += &format!("  verdict so far: {stands}\n");
    }
    let killed = "no process of this machine is at work: the same command goes on";
    let (last, exit) = match running {
        Some(running) => (format!("  {running}\n"), Exit::Done),
        None if cases.len() < all => (format!("  {killed}\n"), Exit::Failed),
        None if cases.iter().any(|case| case["verdict"] == json!(Judged::NotSettled)) => {
            (String::new(), Exit::Unreliable)
        }
        None => (String::new(), Exit::Done),
    };
    (text + &last, exit)
}

/// Write both files.
pub fn write(kit: &Kit, cases: &[Case], all: usize, out: &Path) -> io::Result<()> {
    files::write_json(&out.join(APPROVAL), &json(kit, cases, all))?;
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

/// What the screen shows; all numbers are in the other files, and in the report.
pub fn screen(kit: &Kit, cases: &[Case], out: &Path) -> String {
    let Some(first) = cases.first() else { return String::new() };
    let of_launch = Columns::new()
        .with("launch", |launch: &Launch| launch.which.name().into())
        .with("run again", |launch| if launch.finer { "accurate".into() } else { "-".into() })
        .with("fate", Launch::words);
    let of_launch = OF_LAUNCH.iter().fold(of_launch, |table, (title, name, factor)| {
        table.number(*title, move |launch| launch.value(name).map(|value| factor * value))
    });
    let of_criterion = Columns::new()
        .with("launch", |of: &Criterion| of.launch.into())
        .with("criterion", |of| of.name.into())
        .with("result", |of| of.result.words().into())
        .with("number", Criterion::number)
        .with("how", |of| of.why.clone());
    let of_case = Columns::new()
        .with("case", |case: &Case| case.name.clone())
        .with("verdict", |case| case.verdict().words().into())
        .with("failed criteria", |case| case.criteria_of(Judged::Fail))
        .with("not settled", |case| case.criteria_of(Judged::NotSettled));
    let Block { mass, size } = kit.block(kit.mel);
    let [mass, size, speed] = [mass, size, kit.speed].map(three);
    let (Kit { name, class, hash, .. }, file, out, date) =
        (kit, kit.file.display(), out.display(), provenance::now());
    let (category, stands, conclusion) =
        (category_of(first), stands(cases, cases.len()), conclusion(kit, cases));
    format!(
        "{name}: class {class}; block of {mass} kg, {size} m, {speed} m/s; vertical site\nkit file {file}, {hash}; rockfall {VERSION}; \
         {date}\n\n{}\n{}\n{category}\n\n{}\nverdict: {stands}\n{conclusion}\n\
         results: {out}/{APPROVAL}, {TABLE}, {TEXT}; runs: {out}/{RUNS}\n",
        of_launch.aligned(&first.launches),
        of_criterion.aligned(&first.criteria),
        of_case.aligned(cases),
    )
}
