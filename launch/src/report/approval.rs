//! The page of a test for approval: the rows of a test report for each launch of the kit as it is defined, and what varies.

use super::curves;
use super::page::{Page, escape, list, moment, number, table, unless_noise};
use super::run::{bar, pairs};
use crate::report::table::Table;
use serde_json::Value;
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::numbers::{percent, short, three};
use toolkit::once::each_once;
use toolkit::run_dir::{APPROVAL, HISTORY, RECORD, REPORT};
use toolkit::summary::{RunStatus, Summary};

/// Numbers of a launch that a row of the cases has.
const OF_CASE: [(&str, &str); 7] = [
    ("MEL", "max_elongation"),
    ("MEL", "braking_time"),
    ("MEL", "block_force_mean"),
    ("MEL", "block_force_peak_1ms"),
    ("MEL", "h_R"),
    ("MEL", "h_R/h_N"),
    ("SEL 1", "h_R/h_N"),
];

/// What no launch examines.
const NEVER: [&str; 3] = [
    "Components of this kit against tests of them: pull of ropes, ring chains and panels, brakes slow and at impact speed, posts. What the \
     library of parts is held to is in docs/rings.md and docs/barrier.md.",
    "Anchors: they are no part of the kit and are rigid here. Their forces are given as vectors.",
    "An inclined site, corrosion, ageing, installation.",
];

/// The page of the test in `dir`.
pub fn page(dir: &Path) -> io::Result<Page> {
    let all: Value = files::read_json(&dir.join(APPROVAL))?;
    let cases = listed(&all["cases"]);
    let open = cases.iter().any(|case| case["verdict"] == "not_settled");
    let status = match all["all_cases"].as_u64() {
        Some(count) if count > cases.len() as u64 => RunStatus::Interrupted,
        _ if open => RunStatus::Unreliable,
        _ => RunStatus::Done,
    };
    let mut page = Page::new(&format!("{}: test for approval", text(&all["kit"])), status);
    let first = dir.join(plain(&all["cases"][0]["launches"][0]["run"]));
    let record: Value = files::read_json(&first.join(RECORD)).unwrap_or_default();
    page.section("What was tested", &tested(&all, &record));
    let verdict = text(&all["verdict"]).replace('_', " ");
    let words = [format!("Verdict: {verdict}"), text(&all["conclusion"]), text(&all["stands"])];
    let [first, varied @ ..] = cases else { return Ok(page) };
    let criteria = Columns::new()
        .with("launch", |of: &Value| text(&of["launch"]))
        .with("criterion", |of| text(&of["name"]))
        .with("result", |of| match of["result"].as_str() {
            Some("fail") => "<strong>FAIL</strong>".into(),
            _ => text(&of["result"]).replace('_', " "),
        })
        .with("number", |of| value(of, "value"))
        .with("bound", |of| value(of, "bound"))
        .with("how", |of| text(&of["why"]));
    page.section("Verdict", &(list(words.into_iter()) + &table("", &criteria, listed(&first["criteria"]))));
    let launches = listed(&first["launches"]);
    let of_kind = |kind: fn(&str, &Value) -> bool| numbers(launches, kind);
    let is_part = |name: &str, row: &Value| {
        name.contains(' ') && !name.starts_with("energy ") && row["vector"].is_null()
    };
    page.section("Launches", &(replays(dir, launches) + &of_kind(|name, _| !name.contains(' '))));
    page.section("What broke; ropes, net, brakes and posts", &of_kind(is_part));
    page.section("Feet and anchors", &of_kind(|_, row| !row["vector"].is_null()));
    page.section(
        "Energy, and its share of what was absorbed",
        &of_kind(|name, _| name.starts_with("energy ")),
    );
    let used = Columns::new()
        .with("part", |of: &Value| text(&of["name"]))
        .with("utilisation", |of| {
            let share = of["share"].as_f64().unwrap_or_default();
            bar(share, &number(share, &percent(share)))
        })
        .with("of", |of| text(&of["of"]))
        .with("launch", |of| text(&of["launch"]));
    page.section(
        "Utilisation",
        &table("The largest of each part in any launch.", &used, listed(&first["utilisation"])),
    );
    let charts = charts(dir, launches)?;
    if !charts.is_empty() {
        page.section("Over time", "<div id=\"curves\"></div>");
        page.data("charts", charts);
    }
    page.section("What varies", &spread(first, cases, varied.len()));
    let unexamined = listed(&first["criteria"]).iter().filter(|of| of["result"] == "not_examined");
    let unexamined = unexamined
        .map(|of| format!("{}, {}: {}", plain(&of["launch"]), plain(&of["name"]), plain(&of["why"])));
    let none =
        (varied.is_empty()).then(|| "Brakes, friction and place of impact: nothing was varied.".to_owned());
    page.section("What was not examined", &list(unexamined.chain(none).chain(NEVER.map(str::to_owned))));
    Ok(page)
}

fn listed(of: &Value) -> &[Value] {
    of.as_array().map_or(&[], Vec::as_slice)
}

fn plain(of: &Value) -> String {
    of.as_str().unwrap_or_default().to_owned()
}

fn text(of: &Value) -> String {
    escape(&of.as_str().map_or_else(|| of.to_string(), str::to_owned))
}

/// A number of a row in the unit in which people read it.
fn value(row: &Value, key: &str) -> String {
    let Some(value) = row[key].as_f64() else { return String::new() };
    let (factor, unit) = match row["unit"].as_str().unwrap_or_default() {
        "1" => (1.0, String::new()),
        unit if ["J", "N", "N m"].contains(&unit) => (1e-3, format!("&nbsp;k{unit}")),
        unit => (1.0, format!("&nbsp;{unit}")),
    };
    number(value, &short(factor * unless_noise(value))) + &unit
}

/// Kit, site and blocks.
fn tested(all: &Value, record: &Value) -> String {
    let row = |name: &str, key: &str| (name.to_owned(), text(&all[key]));
    let block = |key: &str| {
        let of = &all[key];
        let [energy, mass, edge] =
            ["energy_J", "mass_kg", "edge_m"].map(|key| of[key].as_f64().unwrap_or_default());
        format!("{} kJ, {} kg, edge {} m", three(1e-3 * energy), three(mass), three(edge))
    };
    let number = |key: &str, unit: &str| {
        format!("{} {unit}", number(&all[key], &three(all[key].as_f64().unwrap_or_default())))
    };
    let mut rows = vec![
        row("kit", "kit"),
        row("class", "class"),
        row("file of the kit", "kit_file"),
        row("its hash", "kit_hash"),
        row("version", "version"),
        ("date of the first run".into(), text(&record["date"])),
        row("site; reference slope through the feet", "site"),
        ("nominal height h_N".into(), number("h_N_m", "m")),
        ("speed of the block".into(), number("speed_m_per_s", "m/s")),
        ("its density".into(), number("density_kg_per_m3", "kg/m3")),
        ("MEL".into(), block("mel")),
    ];
    if !all["sel"].is_null() {
        rows.push(("each SEL".into(), block("sel")));
    }
    pairs(&rows)
}

/// A table of the numbers of a kind, a column for each launch.
fn numbers(launches: &[Value], kind: fn(&str, &Value) -> bool) -> String {
    let rows = launches.iter().flat_map(|launch| listed(&launch["numbers"]));
    let named = rows.map(|row| (row["name"].as_str().unwrap_or_default(), row));
    let names = each_once(named.filter(|(name, row)| kind(name, row)).map(|(name, _)| name));
    let mut columns = Columns::new().with("number", |name: &&str| format!("<code>{}</code>", escape(name)));
    for launch in launches {
        columns = columns
            .with(plain(&launch["launch"]), move |name| found(launch, name).map_or(String::new(), cell));
    }
    let note = move |name: &&str| launches.iter().find_map(|launch| found(launch, name)?["note"].as_str());
    table(
        "",
        &columns.with("definition", move |name| {
            note(name).map_or(String::new(), |note| format!("<span class=\"note\">{}</span>", escape(note)))
        }),
        &names,
    )
}

fn found<'a>(launch: &'a Value, name: &str) -> Option<&'a Value> {
    listed(&launch["numbers"]).iter().find(|row| row["name"] == name)
}

/// A number with its share, vector, time and member.
fn cell(row: &Value) -> String {
    let mut text = value(row, "value");
    if let Some(share) = row["share"].as_f64() {
        text += &format!(" {}", bar(share, &number(share, &percent(unless_noise(share)))));
    }
    if let Some(vector) = row["vector"].as_array() {
        let parts: Vec<String> = vector
            .iter()
            .filter_map(Value::as_f64)
            .map(|part| number(part, &short(1e-3 * unless_noise(part))))
            .collect();
        text += &format!("<br><small>({}) kN</small>", parts.join(", "));
    }
    if let Some(time) = row["time_s"].as_f64() {
        text += &format!("<br><small>at {} s</small>", moment(time, &short(time)));
    }
    if let Some(member) = row["member"].as_str().filter(|member| !member.is_empty()) {
        text += &format!(" <small>{}</small>", escape(member));
    }
    text
}

/// How each launch ended, with its own page, which has the replay where the kit writes frames.
fn replays(dir: &Path, launches: &[Value]) -> String {
    let item = |launch: &Value| {
        let run = plain(&launch["run"]);
        let name = text(&launch["launch"]);
        let name = if dir.join(&run).join(REPORT).exists() {
            format!("<a href=\"{}/{REPORT}\">{name}</a>", escape(&run))
        } else {
            name
        };
        let doubt = launch["doubt"].as_str().map_or(String::new(), |doubt| format!("; {}", escape(doubt)));
        let again = if launch["accurate"] == true { "; run again, accurate" } else { "" };
        let broken: Vec<String> = listed(&launch["broken"]).iter().map(text).collect();
        let broken = if broken.is_empty() { "nothing broke".into() } else { broken.join("; ") };
        let category = launch["category"].as_str().map_or(String::new(), |of| format!("; category {of}"));
        format!(
            "<li>{name}: {}{category}; {broken}{again}{doubt}</li>\n",
            text(&launch["fate"]).replace('_', " ")
        )
    };
    format!("<ul>{}</ul>", launches.iter().map(item).collect::<String>())
}

/// Curves of the launches: the block, each kind of rope, brakes. Of supports and single posts the peaks are in the tables.
fn charts(dir: &Path, launches: &[Value]) -> io::Result<Vec<Value>> {
    let mut all = Vec::new();
    for launch in launches {
        let run = dir.join(plain(&launch["run"]));
        let Ok(summary) = Summary::read(&run) else { continue };
        let history = Table::read(&run.join(HISTORY))?.filtered(|name| {
            !(["_fx_N", "_fy_N", "_fz_N"].iter().any(|end| name.ends_with(end))
                || name.contains("_head_u")
                || name.contains("posts_"))
        });
        for mut chart in curves::charts(&history, &Table::default(), &summary) {
            for curve in chart["curves"].as_array_mut().into_iter().flatten() {
                curve["name"] = plain(&curve["name"]).trim_start_matches("approve ").into();
            }
            chart["title"] = format!("{}: {}", plain(&launch["launch"]), plain(&chart["title"])).into();
            all.push(chart);
        }
    }
    Ok(all)
}

/// All cases, and how far their numbers lie apart.
fn spread(first: &Value, cases: &[Value], varied: usize) -> String {
    let of = |case: &Value, (launch, name): (&str, &str)| {
        let launch = listed(&case["launches"]).iter().find(|of| of["launch"] == launch);
        launch.and_then(|launch| found(launch, name)).cloned()
    };
    let mut columns = Columns::new()
        .with("case", |case: &Value| text(&case["case"]))
        .with("verdict", |case| text(&case["verdict"]).replace('_', " "));
    for which in OF_CASE {
        columns = columns.with(format!("{} {}", which.0, which.1), move |case| {
            of(case, which).map_or(String::new(), |row| value(&row, "value"))
        });
    }
    let apart = OF_CASE.iter().filter_map(|which| {
        let values: Vec<f64> = cases.iter().filter_map(|case| of(case, *which)?["value"].as_f64()).collect();
        let own = of(first, *which)?["value"].as_f64()?;
        let (low, high) =
            values.iter().fold((own, own), |(low, high), value| (value.min(low), value.max(high)));
        let [low, high] = [low, high].map(|end| percent((end - own) / own));
        Some(format!("{} {}: {low} to {high} beside that as defined", which.0, which.1))
    });
    let apart = if varied == 0 { String::new() } else { list(apart) };
    table("One thing at a time is varied; the first row is the kit as defined.", &columns, cases) + &apart
}
