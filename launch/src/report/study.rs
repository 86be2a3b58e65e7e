//! The page of a study.

use super::curves::floats;
use super::page::{Page, escape, file_name, list, number, picture, table};
use super::run::{FIRST, bar, facts, measures, pairs, ranked, verdict};
use interface_defs::Measure;
use interface_defs::diagnostic::code;
use interface_defs::verdict::Fate;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files::{self, Dir};
use toolkit::history::column;
use toolkit::numbers::{percent, short, three};
use toolkit::run_dir::{BARRIER, REPORT, STUDY_RECORD};
use toolkit::scene::{self, STUDY, Scene, at};
use toolkit::summary::Summary;

/// Bytes of all maps that are shown.
const MAPS: usize = 9 << 20;
/// Most hits of a line that are drawn: those of most energy.
const HITS: usize = 2000;
/// Study and scene as they were, in its directory.
const FILES: [&str; 2] = ["study.toml", "scene.toml"];
/// Rows of a table by the names of its columns.
type Rows = Vec<HashMap<String, String>>;

/// The page of the study in `dir`, which has a summary.
pub fn page(dir: &Path) -> io::Result<Page> {
    let summary = Summary::read(dir)?;
    let record: Value = files::read_json(&dir.join(STUDY_RECORD)).unwrap_or_default();
    let study = settings(dir, &record);
    let title =
        study.get("title").and_then(toml::Value::as_str).map_or_else(|| file_name(dir), str::to_owned);
    let mut page = Page::new(&title, summary.status);
    let barrier = dir.join(BARRIER);
    let worst = Summary::read(&barrier).ok();
    page.section("What was computed", &facts(&summary, &record, "study"));
    page.section("Trust", &(verdict(&summary) + &trust(&summary)));
    let all = ranked(&summary);
    page.section(
        "The measures that matter most",
        &measures("All of them stand further down.", &all[..FIRST.min(all.len())]),
    );
    page.section("What became of the rocks", &fates(&summary, worst.as_ref()));
    let (maps, left) = maps(&dir.join("maps"))?;
    if !maps.is_empty() {
        page.section("Maps", &format!("<div id=\"maps\">{maps}</div>{left}"));
    }
    let chosen = rows(&barrier.join("verdicts.csv"))?;
    let mut hits = Vec::new();
    for name in names(&dir.join("lines")) {
        let Some(line) = name.strip_suffix(".svg") else { continue };
        let settings =
            toml_list(&study, "line").find(|of| of.get("name").and_then(toml::Value::as_str) == Some(line));
        let crossings = rows(&dir.join("lines").join(format!("{line}.csv")))?;
        let height = number_at(settings, "barrier.height").or(number_at(settings, "design.barrier_height"));
        let is_own = line == barrier_line(dir);
        let height = height.or_else(|| if is_own { generated_height(&barrier, &chosen) } else { None });
        if let Some(found) = elevation(line, &crossings, if is_own { &chosen } else { &[] }, height) {
            hits.push(found);
        }
        let picture = picture(&dir.join("lines").join(&name), &format!("Exceedance at line {line}"))?;
        let design = design(&dir.join("lines").join(format!("{line}_design.csv")))?;
        let place = format!("<div data-hits=\"{}\"></div>", escape(line));
        page.section(
            &format!("Line {line}"),
            &(capacity(dir, line, &all, settings)? + &design + &place + &picture),
        );
    }
    page.data("hits", hits);
    if let Some(worst) = &worst {
        let content = verdict(worst)
            + &members(&barrier, &chosen)
            + &measures("The worst of each measure.", &ranked(worst));
        page.section("Worst members against the barrier", &content);
    }
    page.section("What was not examined", &list(unexamined(&study, &summary, worst.is_some()).into_iter()));
    page.section("Inputs and their sources", &inputs(dir, &study, &record));
    page.section("All measures", &measures("", &all));
    Ok(page)
}

/// The study as it was computed, with what was set on the command line.
fn settings(dir: &Path, record: &Value) -> toml::Table {
    let file = dir.join(FILES[0]);
    let sets = record["sets"].as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned);
    let whole = Scene::load_as(&STUDY, &file, &sets.collect::<Vec<_>>()).and_then(|study| study.document());
    let plain = || files::read_text(&file).ok().and_then(|text| text.parse().ok());
    whole.ok().or_else(plain).unwrap_or_default()
}

/// How many members there are, and of how many nothing is to be believed.
fn trust(summary: &Summary) -> String {
    let note = "Intervals hold the true number, that of endlessly many members of this study, with a confidence of 95 %. They say nothing of \
                the ground, the terrain and the distributions.";
    let row = |(name, key): (&str, &str)| Some((name.to_owned(), count(summary, key)?));
    let rows = [
        ("members", "members"),
        ("failed", "members_failed"),
        ("unreliable", "members_unreliable"),
        ("still moving at the end", "members_moving"),
    ];
    pairs(&rows.into_iter().filter_map(row).collect::<Vec<_>>()) + &format!("<p class=\"note\">{note}</p>")
}

/// A number of members.
fn count(summary: &Summary, name: &str) -> Option<String> {
    summary.measure(name).map(|count| number(count, &short(count)))
}

/// What became of the rocks of all members, and of the worst against the barrier.
fn fates(summary: &Summary, worst: Option<&Summary>) -> String {
    let chart = |caption: &str, of: &Summary, all: f64, kinds: Vec<(&str, String)>| {
        let found =
            kinds.into_iter().filter_map(|(words, name)| Some((words.to_owned(), of.measure(&name)?)));
        let found: Vec<(String, f64)> = found.filter(|(_, count)| *count > 0.0).collect();
        let columns = Columns::new()
            .with("fate", |(words, _): &(String, f64)| escape(words))
            .with("members", |(_, count)| number(*count, &short(*count)))
            .with("share", |(_, count)| bar(count / all, &percent(count / all)));
        table(caption, &columns, &found)
    };
    let all = summary.measure("members").unwrap_or(1.0);
    let endings =
        [("at rest", "rest"), ("left the terrain", "left"), ("still moving", "moving"), ("failed", "failed")];
    let name = |ending: &str| format!("members_{}", if ending == "rest" { "at_rest" } else { ending });
    let endings = endings.map(|(words, ending)| (words, name(ending)));
    let mut text = chart("All members, without a barrier in their way.", summary, all, endings.into());
    if let Some(worst) = worst {
        let kinds: Vec<(&str, String)> =
            Fate::ALL.into_iter().map(|fate| (fate.words(), name(fate.name()))).collect();
        let all = kinds.iter().filter_map(|(_, name)| worst.measure(name)).sum();
        text += &chart("The worst members against the barrier.", worst, all, kinds);
    }
    text
}

/// Tables of a list of a study.
fn toml_list<'a>(study: &'a toml::Table, key: &str) -> impl Iterator<Item = &'a toml::Table> {
    study.get(key).and_then(toml::Value::as_array).into_iter().flatten().filter_map(toml::Value::as_table)
}

/// A number of a table.
fn number_at(table: Option<&toml::Table>, key: &str) -> Option<f64> {
    at(table?, key).and_then(scene::number)
}

/// What comes to a line against what the barrier there bears, where that is known.
fn capacity(dir: &Path, line: &str, all: &[&Measure], settings: Option<&toml::Table>) -> io::Result<String> {
    let has = |key: &str| {
        number_at(settings, &format!("barrier.{key}"))
            .or(number_at(settings, &format!("design.barrier_{key}")))
    };
    // Statistics of which a barrier has a bound stand first.
    let bounds = [("energy", has("energy")), ("centre_height", has("height"))];
    let ends = ["q50", "q95", "q99", "largest", "10_years", "30_years", "100_years", "300_years"];
    // Which statistics there are, the table of exceedance says: names of lines may begin like those of others.
    let statistics = header(&dir.join("lines").join(format!("{line}_exceedance.csv")))?;
    let place = |measure: &Measure| {
        let rest = measure.name.strip_prefix(line)?.strip_prefix('_')?;
        let of_end = |(at, end): (usize, &&str)| Some((at, rest.strip_suffix(end)?.strip_suffix('_')?));
        let (end, what) = ends.iter().enumerate().find_map(of_end)?;
        let statistic = statistics.iter().position(|name| *name == column(what, &measure.unit))?;
        let own = bounds.iter().position(|(of, _)| *of == what).unwrap_or(bounds.len());
        Some(((own, statistic, end), bounds.get(own).and_then(|(_, has)| *has)))
    };
    let mut found: Vec<_> =
        all.iter().filter_map(|measure| place(measure).map(|(at, has)| (at, *measure, has))).collect();
    found.sort_by_key(|(at, ..)| *at);
    let found: Vec<(&Measure, Option<f64>)> = found.into_iter().map(|(_, of, has)| (of, has)).collect();
    let bound = |end: Option<f64>| end.map_or("too few".into(), |end| number(end, &short(end)));
    let columns = Columns::new()
        .with("measure", |(of, _): &(&Measure, Option<f64>)| format!("<code>{}</code>", escape(&of.name)))
        .with("value", |(of, _)| number(of.value, &short(of.value)))
        .with("unit", |(of, _)| escape(&of.unit))
        .with("95 % interval", |(of, _)| {
            of.interval.map_or(String::new(), |of| format!("[{}, {}]", bound(of.low), bound(of.high)))
        })
        .with("the barrier bears", |(_, has)| has.map_or(String::new(), short))
        .with("used, by the upper bound", |(of, has)| {
            let Some(has) = has else { return String::new() };
            let upper = of.interval.map_or(Some(of.value), |interval| interval.high);
            upper.map_or("too few members".into(), |upper| bar(upper / has, &percent(upper / has)))
        });
    let caption = match bounds[0].1.or(bounds[1].1) {
        Some(_) => "What comes to the line, against what the barrier there bears.",
        None => {
            "What comes to the line. What a barrier there bears is not given ([line.barrier], [line.design])."
        }
    };
    Ok(table(caption, &columns, &found))
}

/// Names of the columns of a table; none where there is no file.
fn header(file: &Path) -> io::Result<Vec<String>> {
    let Some(file) = files::if_there(files::source(file))? else { return Ok(Vec::new()) };
    Ok(csv::Reader::from_reader(file).headers()?.iter().map(str::to_owned).collect())
}

/// All rows of a table; none where there is no file.
fn rows(file: &Path) -> io::Result<Rows> {
    let Some(file) = files::if_there(files::source(file))? else { return Ok(Rows::new()) };
    csv::Reader::from_reader(file).into_deserialize().map(|row| row.map_err(io::Error::from)).collect()
}

fn number_of(row: &HashMap<String, String>, key: &str) -> Option<f64> {
    row.get(key)?.parse().ok()
}

/// Name of the line of the barrier: that of its own where the study had none there.
fn barrier_line(dir: &Path) -> &'static str {
    if dir.join("lines").join(format!("{BARRIER}.csv")).exists() { BARRIER } else { "" }
}

/// Height of the posts in the scenes of the chosen members [m].
fn generated_height(dir: &Path, chosen: &Rows) -> Option<f64> {
    let scene = dir.join(format!("{}.toml", chosen.first()?.get("member")?));
    number_at(files::read_text(&scene).ok()?.parse().ok().as_ref(), "structure.generator.height")
}

/// Where rocks cross a line: along it, and their centre above the ground, with energies [J]; the chosen members by their fate.
fn elevation(
    line: &str,
    crossings: &Rows,
    chosen: &[HashMap<String, String>],
    height: Option<f64>,
) -> Option<Value> {
    let of = |row: &HashMap<String, String>| {
        Some([
            number_of(row, "along_m")?,
            number_of(row, "centre_height_m")?,
            number_of(row, "kinetic_energy_J")?,
        ])
    };
    let firsts = crossings.iter().filter(|row| row.get("crossing").is_some_and(|number| number == "1"));
    let mut all: Vec<[f64; 3]> = firsts.filter_map(of).collect();
    all.sort_by(|a, b| b[2].total_cmp(&a[2]));
    let count = all.len();
    all.truncate(HITS);
    let chosen = chosen.iter().filter_map(|row| {
        let fate = row.get("fate")?;
        let held = [Fate::Stopped, Fate::Rebounded].iter().any(|held| held.name() == fate);
        Some(json!({ "place": of(row)?, "member": row.get("member")?, "fate": fate.replace('_', " "), "held": held }))
    });
    let chosen: Vec<Value> = chosen.collect();
    (count > 0).then(|| json!({ "line": line, "count": count, "hits": floats(all.into_iter().flatten()), "chosen": chosen, "height": height }))
}

/// The chosen members with what became of them, each with its own report.
fn members(dir: &Path, chosen: &Rows) -> String {
    let text = |row: &HashMap<String, String>, key: &str| {
        row.get(key).map_or(String::new(), |text| escape(text).replace('_', " "))
    };
    let cell = |row: &HashMap<String, String>, key: &str| {
        number_of(row, key).map_or(String::new(), |of| number(of, &three(of)))
    };
    let mut columns = Columns::new()
        .with("member", |row: &HashMap<String, String>| {
            let member = text(row, "member");
            if !dir.join(&member).join(REPORT).is_file() {
                return member;
            }
            format!("<a href=\"{BARRIER}/{member}/{REPORT}\">{member}</a>")
        })
        .with("chosen for", |row| format!("{} {}", text(row, "chosen_for"), text(row, "rank")));
    for (name, key) in [
        ("energy [J]", "kinetic_energy_J"),
        ("height of centre [m]", "centre_height_m"),
        ("speed [m/s]", "speed_m_per_s"),
    ] {
        columns = columns.with(name, move |row| cell(row, key));
    }
    let columns = columns
        .with("fate", |row| text(row, "fate"))
        .with("elongation [m]", |row| cell(row, "max_elongation_m"))
        .with("largest reaction [N]", |row| cell(row, "max_reaction_1ms_N"))
        .with("status", |row| text(row, "status"));
    table(
        "A number opens the report of its run, with its replay where the scene of the barrier writes frames ([output] fields).",
        &columns,
        chosen,
    )
}

/// What this study says nothing of.
fn unexamined(study: &toml::Table, summary: &Summary, barrier: bool) -> Vec<String> {
    let has = |list: &str, key: &str| toml_list(study, list).any(|table| table.contains_key(key));
    let absent = [
        (study.contains_key("line"), "What passes a place: the study has no [[line]]."),
        (
            has("release", "blocks_per_year"),
            "How often blocks fall: releases have no blocks_per_year, so shares are of all members and no hazard follows.",
        ),
        (has("line", "design"), "The requirements of a standard: no line has [line.design]."),
        (barrier, "Whether a net holds: no barrier was computed with the rocks (--barrier SCENE --worst N)."),
        (study.contains_key("maps"), "Where rocks pass off the lines: the study has no [maps]."),
        (study.contains_key("vary"), "What varies between falls: the study has no [vary]."),
    ];
    let always = "Blocks that break, blocks that strike each other, and ground that a block changes for those behind it. A barrier does not stop \
                  rocks in the maps.";
    let kept = summary
        .warnings
        .iter()
        .filter(|warning| warning.code == code::ABSENT_MEASURE)
        .map(ToString::to_string);
    absent
        .into_iter()
        .filter(|(there, _)| !there)
        .map(|(_, what)| what.to_owned())
        .chain(kept)
        .chain([always.to_owned()])
        .collect()
}

/// Distributions and settings, files with their hashes, and study and scene as they were written: there the sources stand.
fn inputs(dir: &Path, study: &toml::Table, record: &Value) -> String {
    let shown = |(key, value): (&String, &toml::Value)| (escape(key), escape(&value.to_string()));
    let varied = at(study, "vary").and_then(toml::Value::as_table).into_iter().flatten();
    let mut settings = study.clone();
    settings.remove("vary");
    let mut text = pairs(
        &varied
            .map(|(key, value)| (format!("vary: {}", escape(key)), escape(&value.to_string())))
            .chain(settings.iter().map(shown))
            .collect::<Vec<_>>(),
    );
    // Their names alone: where they lay is nobody's business who is handed the page.
    let hashes =
        record["inputs"].as_object().into_iter().flatten().map(|(path, hash)| {
            (escape(&file_name(Path::new(path))), escape(hash.as_str().unwrap_or_default()))
        });
    let sets = record["sets"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let sets = sets.map(|set| ("--set".to_owned(), escape(set)));
    text += &pairs(&hashes.chain(sets).collect::<Vec<_>>());
    for name in FILES {
        if let Ok(file) = files::read_text(&dir.join(name)) {
            text += &format!(
                "<details><summary>{name}, as it was</summary><pre>{}</pre></details>",
                escape(&file)
            );
        }
    }
    text
}

/// Names of what lies in a directory; none where it is not there.
fn names(dir: &Path) -> Vec<String> {
    let all = Dir::open(dir).and_then(|dir| dir.entries()).unwrap_or_default();
    all.into_iter().map(|(name, _)| name.to_string_lossy().into_owned()).collect()
}

/// Pictures of the maps, as many as there is room for, and what is left out.
fn maps(dir: &Path) -> io::Result<(String, String)> {
    let (mut text, mut left) = (String::new(), Vec::new());
    for name in names(dir) {
        let Some(layer) = name.strip_suffix(".svg") else { continue };
        let shown = picture(&dir.join(&name), &layer.replace('_', " "))?;
        if text.len() + shown.len() > MAPS { left.push(name) } else { text += &shown }
    }
    let left = if left.is_empty() {
        String::new()
    } else {
        format!("<p class=\"note\">Not shown here: {}</p>", escape(&left.join(", ")))
    };
    Ok((text, left))
}

/// A table as its file has it; nothing where there is none.
fn design(file: &Path) -> io::Result<String> {
    let Some(file) = files::if_there(files::source(file))? else { return Ok(String::new()) };
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(file);
    let mut text = String::new();
    for (number, row) in reader.records().enumerate() {
        let tag = if number == 0 { "th" } else { "td" };
        let cells: String = row?.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
        text += &format!("<tr>{cells}</tr>\n");
    }
    Ok(format!(
        "<div class=\"wide\"><table><caption>Design by standards against capacity: upper_bound is that of the quantile</caption>\n{text}</table></div>\n"
    ))
}
