//! The page of a study.

use super::page::{Page, escape, file_name, list, picture};
use super::run::{FIRST, all_of, measures, ranked, verdict};
use serde_json::Value;
use std::io;
use std::path::Path;
use toolkit::files::{self, Dir};
use toolkit::run_dir::{BARRIER, REPORT, STUDY_RECORD};
use toolkit::summary::Summary;

/// Bytes of all maps that are shown.
const MAPS: usize = 9 << 20;

/// The page of the study in `dir`, which has a summary.
pub fn page(dir: &Path) -> io::Result<Page> {
    let summary = Summary::read(dir)?;
    let record: Value = files::read_json(&dir.join(STUDY_RECORD)).unwrap_or_default();
    let study: toml::Table =
        files::read_text(&dir.join("study.toml")).ok().and_then(|text| text.parse().ok()).unwrap_or_default();
    let title =
        study.get("title").and_then(toml::Value::as_str).map_or_else(|| file_name(dir), str::to_owned);
    let mut page = Page::new(&title, summary.status);
    let version = record["version"].as_str().unwrap_or("not recorded");
    let facts = format!(
        "{} members, version {version}, study {}",
        record["members"],
        record["study"].as_str().map_or(String::new(), |path| file_name(Path::new(path)))
    );
    page.section("What was computed", &format!("<p>{}</p>", escape(&facts)));
    page.section("Trust", &verdict(&summary));
    let all = ranked(&summary);
    page.section(
        "The measures that matter most",
        &measures("All of them stand further down.", &all[..FIRST.min(all.len())]),
    );
    let (maps, left) = maps(&dir.join("maps"))?;
    if !maps.is_empty() {
        page.section("Maps", &format!("<div id=\"maps\">{maps}</div>{left}"));
    }
    for name in names(&dir.join("lines")) {
        let Some(line) = name.strip_suffix(".svg") else { continue };
        let picture = picture(&dir.join("lines").join(&name), &format!("Exceedance at line {line}"))?;
        let design = design(&dir.join("lines").join(format!("{line}_design.csv")))?;
        page.section(&format!("Line {line}"), &(design + &picture));
    }
    let barrier = dir.join(BARRIER);
    if let Ok(worst) = Summary::read(&barrier) {
        let runs = names(&barrier).into_iter().filter(|name| barrier.join(name).join(REPORT).is_file());
        let links: String = runs
            .map(|run| {
                format!(
                    "<li><a href=\"{BARRIER}/{run}/{REPORT}\">member {run}</a></li>\n",
                    run = escape(&run)
                )
            })
            .collect();
        page.section(
            "Worst members against the barrier",
            &format!("{}<ul>{links}</ul>{}", verdict(&worst), measures("", &ranked(&worst))),
        );
    }
    page.section("All measures", &measures("", &all));
    page.section(
        "Distributions and settings",
        &list(study.iter().map(|(key, value)| format!("{key} = {value}"))),
    );
    page.section("Input files", &record.as_object().map_or(String::new(), all_of));
    Ok(page)
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
    if !file.exists() {
        return Ok(String::new());
    }
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(files::source(file)?);
    let mut text = String::new();
    for (number, row) in reader.records().enumerate() {
        let tag = if number == 0 { "th" } else { "td" };
        let cells: String = row?.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
        text += &format!("<tr>{cells}</tr>\n");
    }
    Ok(format!(
        "<div class=\"wide\"><table><caption>Design against capacity</caption>\n{text}</table></div>\n"
    ))
}
