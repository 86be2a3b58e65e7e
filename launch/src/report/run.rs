//! The page of a run.

use super::curves;
use super::frames;
use super::page::{Page, escape, file_name, list, moment, named, number, picture, table, unless_noise};
use crate::report::table::Table;
use interface_defs::message::Found;
use interface_defs::{Diagnostic, Measure, PartUse, Severity};
use serde_json::{Map, Value};
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::numbers::{rounded, short, short_in, three};
use toolkit::run_dir::{HISTORY, PICTURE, RECORD, SCENE, TRAJECTORY};
use toolkit::summary::{RunStatus, Summary};

/// Measures at the top, as on the screen.
pub const FIRST: usize = 10;

/// Warnings that are listed at once.
const LISTED: usize = 8;

/// The page of the run in `dir`, which has a summary. What else is not there is left out.
pub fn page(dir: &Path) -> io::Result<Page> {
    let summary = Summary::read(dir)?;
    let record: Value = files::read_json(&dir.join(RECORD)).unwrap_or_default();
    let scene: toml::Table =
        files::read_text(&dir.join(SCENE)).ok().and_then(|text| text.parse().ok()).unwrap_or_default();
    let title =
        scene.get("title").and_then(toml::Value::as_str).map_or_else(|| file_name(dir), str::to_owned);
    let mut page = Page::new(&title, summary.status);
    page.section("What was run", &facts(&summary, &record, "scene"));
    page.section("Verdict", &verdict(&summary));
    let all = ranked(&summary);
    page.section(
        "The measures that matter most",
        &measures("All of them stand further down.", &all[..FIRST.min(all.len())]),
    );

    let history = Table::read(&dir.join(HISTORY))?;
    let replay = frames::replay(dir, &summary, &scene, &history)?;
    if let Some(replay) = replay {
        if replay["lines"] != Value::Null {
            page.section("The structure", &structure(&summary));
        }
        page.section("Replay", "<div id=\"replay\"></div>");
        page.data("replay", replay);
    } else {
        page.section(
            "Replay",
            "<p class=\"note\">There is none: no frames were written. <code>--set output.fields=0.05</code> writes one each 0.05 s.</p>",
        );
    }
    let charts = curves::charts(&history, &Table::read(&dir.join(TRAJECTORY))?, &summary);
    if !charts.is_empty() {
        page.section("Over time", "<div id=\"curves\"></div>");
        page.data("charts", charts);
    }
    if dir.join(PICTURE).exists() {
        let what = "Plan and section of the trajectories, jump height, speed and energy along them";
        page.section("Trajectory", &picture(&dir.join(PICTURE), what)?);
    }
    page.section("Parts of the structure", &parts(&summary.parts));
    page.section("All measures", &measures("", &all));
    let maps =
        [("Energy balance", &summary.energy), ("Coupling", &summary.coupling), ("Cost", &summary.cost)];
    maps.iter().for_each(|(title, map)| page.section(title, &all_of(map)));
    let mut record = record.as_object().cloned().unwrap_or_default();
    // Command lines of the programs are for whoever looks into the file.
    record.remove("processes");
    page.section("Programs and input files", &all_of(&record));
    Ok(page)
}

/// All measures, the one that matters most first.
pub fn ranked(summary: &Summary) -> Vec<&Measure> {
    let mut all: Vec<&Measure> = summary.measures.iter().collect();
    all.sort_by_key(|measure| measure.rank);
    all
}

/// Date, version, the file of a scene or study and its hash.
pub fn facts(summary: &Summary, record: &Value, file: &str) -> String {
    let text = |key: &str| record[key].as_str().map(escape);
    let hash = record[file].as_str().and_then(|file| record["inputs"][file].as_str());
    let rows = [
        ("date", text("date")),
        ("version", text("version").map(|of| format!("rockfall {of}"))),
        (file, record[file].as_str().map(|path| escape(&file_name(Path::new(path))))),
        ("its hash", hash.map(escape)),
        ("run", summary.run.as_deref().map(escape)),
    ];
    pairs(&rows.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect::<Vec<_>>())
}

/// What became of rocks and structure, why the run is not to be trusted, and warnings.
pub fn verdict(summary: &Summary) -> String {
    let mut text = match (summary.status, &summary.message) {
        (RunStatus::Done, _) => "<p>It was computed to its end, and no bound of trust was passed.</p>".into(),
        (status, message) => {
            let what = match status {
                RunStatus::Unreliable => {
                    "A bound of trust was passed: do not use the numbers before this is dealt with."
                }
                _ => "The run did not come to its end: what follows is what was computed until then.",
            };
            let why = named(message.as_deref().unwrap_or_default()).replace('\n', "<br>");
            format!("<div class=\"alarm\" role=\"alert\"><strong>{what}</strong><p>{why}</p></div>")
        }
    };
    text += &list(summary.sentences().into_iter());
    let (notes, warnings): (Vec<&Diagnostic>, Vec<_>) =
        summary.warnings.iter().partition(|warning| warning.severity == Severity::Note);
    for (what, of) in [("Warnings", warnings), ("Notes", notes)] {
        if !of.is_empty() {
            // Many alike must not push the numbers from sight; in print all of them are open.
            let open = if of.len() <= LISTED { " open" } else { "" };
            let all = list(of.iter().map(ToString::to_string));
            text += &format!("<details{open}><summary>{what} ({})</summary>{all}</details>", of.len());
        }
    }
    text
}

/// A table of measures.
pub fn measures(caption: &str, measures: &[&Measure]) -> String {
    let is_interval = measures.iter().any(|of| of.interval.is_some());
    let columns = Columns::new()
        .with("measure", |of: &&Measure| format!("<code>{}</code>", escape(&of.name)))
        .with("value", |of| number(of.value, &short_in(&of.unit, unless_noise(of.value))))
        .with("unit", |of| if of.unit == "1" { String::new() } else { escape(&of.unit) })
        .with(if is_interval { "95 % interval" } else { "may be off by" }, |of| uncertainty(of))
        .with("at [s]", |of| of.time.map_or(String::new(), |time| moment(time, &short(time))))
        .with("member", |of| of.member.as_deref().map_or(String::new(), escape))
        .with("by", |of| small(&of.source));
    table(caption, &columns, measures)
}

fn small(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("<small>{}</small>", escape(text)) }
}

/// By how much a measure may be off, and how that was found.
fn uncertainty(of: &Measure) -> String {
    let mut text = of.interval.map_or(String::new(), |interval| {
        let end = |end: Option<f64>| end.map_or("too few".into(), |end| number(end, &short(end)));
        format!("[{}, {}] ", end(interval.low), end(interval.high))
    });
    let Some(off) = of.uncertainty else { return text };
    let how = match off.by {
        Found::Estimate => "estimate",
        Found::Refinement => "run with half the steps",
        Found::Rupture => "not known: something tore before",
        Found::Vibration => "how posts and ropes vibrate",
        Found::Passage => "not known: small differences decide how the rock passes",
    };
    text += &off
        .value
        .map_or(String::new(), |value| format!("&plusmn; {} ", number(value, &short(rounded(value, 2)))));
    text += &small(how);
    if off.beyond { text + " <strong>unreliable</strong>" } else { text }
}

/// Residual heights, and what is drawn.
fn structure(summary: &Summary) -> String {
    let is_height = |of: &&Measure| of.name.ends_with("_end") && of.name.contains("_height");
    let heights: Vec<&Measure> = summary.measures.iter().filter(is_height).collect();
    "<div id=\"views\"></div>".to_owned() + &measures("Height that is left at the end.", &heights)
}

/// Utilisation and energy of each part, with bars.
fn parts(parts: &[PartUse]) -> String {
    let most = parts.iter().map(|part| part.dissipated.abs().max(part.stored.abs())).fold(1.0, f64::max);
    // To whole joules; a zero has no sign.
    let energy = move |value: f64| bar(value / most, &number(value, &three((value.round() + 0.0) / 1e3)));
    let columns = Columns::new()
        .with("part", |part: &PartUse| format!("<code>{}</code>", escape(&part.part)))
        .with("utilisation", |part| {
            part.utilisation
                .map_or("-".into(), |of| bar(of.share, &number(of.share, &format!("{:.3}", of.share))))
        })
        .with("of", |part| part.utilisation.map_or(String::new(), |of| of.of.word().into()))
        .with("at [s]", |part| part.utilisation.map_or(String::new(), |of| moment(of.time, &short(of.time))));
    let columns = columns
        .with("dissipated [kJ]", move |part: &PartUse| energy(part.dissipated))
        .with("stored at the end [kJ]", move |part: &PartUse| energy(part.stored));
    table(
        "Utilisation: 1 is all that a part bears, or its whole stroke. Energies: the longest bar is the largest of both columns.",
        &columns,
        parts,
    )
}

/// A bar as long as `share`, which ends at 1, with a label.
pub fn bar(share: f64, label: &str) -> String {
    let beyond = if share > 1.0 { " class=\"beyond\"" } else { "" };
    format!(
        "<span class=\"bar\"><i{beyond} style=\"width:{:.1}%\"></i></span> {label}",
        100.0 * share.clamp(0.0, 1.0)
    )
}

/// Names and values, HTML each.
pub fn pairs(rows: &[(String, String)]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let rows: String =
        rows.iter().map(|(name, value)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>\n")).collect();
    format!("<dl>\n{rows}</dl>")
}

/// A text; of the path of a file its name: folders of a machine are not for whoever reads the page.
fn without_folders(text: &str) -> String {
    let path = Path::new(text);
    escape(&if path.is_absolute() { file_name(path) } else { text.to_owned() })
}

/// All numbers and texts of a map and of those in it.
fn all_of(map: &Map<String, Value>) -> String {
    let mut rows = Vec::new();
    flat("", map, &mut rows);
    pairs(&rows)
}

fn flat(before: &str, map: &Map<String, Value>, rows: &mut Vec<(String, String)>) {
    for (name, value) in map {
        let name = format!("{before}{}", without_folders(name));
        let shown = match value {
            Value::Null => continue,
            Value::Object(inner) => {
                flat(&format!("{name}: "), inner, rows);
                continue;
            }
            // A count has no digits behind its point.
            Value::Number(of) if of.is_f64() => number(of, &short(of.as_f64().unwrap_or_default())),
            Value::Array(words) => {
                words.iter().filter_map(Value::as_str).map(without_folders).collect::<Vec<_>>().join(" ")
            }
            other => without_folders(other.as_str().unwrap_or(&other.to_string())),
        };
        rows.push((name, shown));
    }
}
