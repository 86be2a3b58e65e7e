//! `report.html`: its numbers are those of the files, and a browser opens it without an error or a request.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tests::browser::{between, browser, shown};
use tests::{Bench, Ended, program, repository, scene};
use toolkit::vtu::{Loaded, series};

/// Frames of a net that moves: 13 of them.
const FRAMES: &str = "output.fields=0.01";

fn page(dir: &Path) -> String {
    std::fs::read_to_string(dir.join("report.html")).expect("a report")
}

/// A page with what is set as code between backquotes, as the programs write it.
fn without_code(page: &str) -> String {
    page.replace("<code>", "`").replace("</code>", "`")
}

fn report(dir: &Path, arguments: &[&str], path: Option<&Path>) -> Output {
    let mut command = Command::new(program("rockfall"));
    command.arg("report").arg(dir).args(arguments).stdin(Stdio::null());
    if let Some(path) = path {
        command.env("PATH", path);
    }
    command.output().expect("started")
}

/// Every measure of the summary stands in the page with all of its digits, and what is shown of it is that number.
fn has_all_measures(dir: &Path) -> usize {
    let page = page(dir);
    let summary: Value =
        serde_json::from_str(&std::fs::read_to_string(dir.join("summary.json")).expect("a summary"))
            .expect("JSON");
    let measures = summary["measures"].as_object().expect("measures");
    for (name, measure) in measures {
        let rows: Vec<&str> = page
            .split("<tr>")
            .filter_map(|row| row.split("</tr>").next())
            .filter(|row| row.contains(&format!("<code>{name}</code>")))
            .collect();
        assert!(!rows.is_empty(), "{name} is not in the page");
        for row in rows {
            let numbers: Vec<(f64, f64)> = row
                .split("<data value=\"")
                .skip(1)
                .map(|data| {
                    let (exact, rest) = data.split_once("\">").expect("a number");
                    let shown = rest.split_once("</data>").expect("its end").0;
                    (exact.parse().expect("a number"), shown.parse().expect("a number"))
                })
                .collect();
            let mut expected = vec![measure["value"].as_f64().expect("a number")];
            for end in measure["interval"].as_array().into_iter().flatten() {
                expected.extend(end.as_f64());
            }
            expected.extend(measure["uncertainty"].as_f64());
            expected.extend(measure["time_s"].as_f64());
            assert_eq!(numbers.iter().map(|(exact, _)| *exact).collect::<Vec<_>>(), expected, "{name}");
            for (exact, shown) in numbers {
                // An uncertainty has two digits, all others six.
                assert!((exact - shown).abs() <= 0.05 * exact.abs() + 1e-9, "{name}: {shown} for {exact}");
            }
            let (exact, shown) = (expected[0], between(row, "\">", "</data>").expect("a value"));
            let shown: f64 = shown.parse().expect("a number");
            assert!((exact - shown).abs() <= 5.1e-6 * exact.abs() + 1e-9, "{name}: {shown} for {exact}");
        }
    }
    measures.len()
}

#[test]
#[ignore = "long"]
fn every_number_of_the_page_is_that_of_the_summary_and_the_same_run_gives_the_same_page() {
    let bench = Bench::new();
    let coupled = bench.done(&scene("sphere-on-cable"), "coupled", &["--set", FRAMES]);
    assert!(has_all_measures(&coupled.out) >= 20);
    let first = page(&coupled.out);
    // A browser refuses requests by itself; none is named either, but for the names of formats.
    assert!(first.contains("default-src 'none'"));
    let addresses = first.split("://").count() - first.split("http://www.w3.org/").count();
    assert_eq!(addresses, 0);
    assert!(first.contains("Sphere on a cable, V-C5") && first.contains(env!("CARGO_PKG_VERSION")));
    let record: Value =
        serde_json::from_str(&std::fs::read_to_string(coupled.out.join("run.json")).expect("a record"))
            .expect("JSON");
    for key in ["date", "run"] {
        assert!(first.contains(record[key].as_str().expect("a text")), "{key}");
    }
    let hash = &record["inputs"][record["scene"].as_str().expect("a path")];
    assert!(first.contains(hash.as_str().expect("a hash")));
    let plain = without_code(&first);
    for sentence in toolkit::summary::Summary::read(&coupled.out).expect("a summary").sentences() {
        assert!(plain.contains(&sentence), "{sentence}");
    }
    let again = report(&coupled.out, &[], None);
    assert_eq!(again.status.code(), Some(0));
    assert!(page(&coupled.out) == first, "another page of the same run");
    let verified =
        Command::new(program("rockfall")).arg("verify").arg(&coupled.out).output().expect("started");
    assert_eq!(verified.status.code(), Some(0), "{}", String::from_utf8_lossy(&verified.stdout));

    let fall = bench.done(&scene("slope-fall"), "fall", &[]);
    assert!(has_all_measures(&fall.out) >= 10);
    assert!(page(&fall.out).contains("src=\"data:image/svg+xml;base64,"));
}

/// A study of `rockfall` in `out`, with these arguments.
fn study(out: &Path, arguments: &[&str]) {
    let mut command = Command::new(program("rockfall"));
    command.args(["ensemble", "--out"]).arg(out).args(arguments).stdin(Stdio::null());
    let ended = command.arg(repository().join("launch/scenes/studies/slope.toml")).output().expect("started");
    assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
}

#[test]
#[ignore = "long"]
fn a_study_ends_with_its_page_and_its_numbers_are_those_of_the_files() {
    let bench = Bench::new();
    let out = bench.path("study");
    // What a line bears is judged afterwards, and changes no fall.
    study(&out, &["--set", "line.0.barrier={energy=2e5,height=3.0}"]);
    assert!(has_all_measures(&out) > 50);
    let first = page(&out);
    assert!(first.len() < 15 << 20, "{} bytes", first.len());
    for picture in ["share", "kinetic energy q95", "Exceedance at line road"] {
        assert!(first.contains(&format!("<figcaption>{picture}</figcaption>")), "{picture}");
    }
    let summary = toolkit::summary::Summary::read(&out).expect("a summary");
    let section =
        |title: &str| between(&first, &format!("<h2>{title}</h2>"), "</section>").expect("a section");
    let count = summary.measure("members_at_rest").expect("a count");
    assert!(
        section("What became of the rocks")
            .contains(&format!("<td>at rest</td><td><data value=\"{count:?}\""))
    );
    // What the barrier bears stands beside what comes, and the bound of that over it is the bar's.
    let energy = summary.measures.iter().find(|of| of.name == "road_energy_q95").expect("a measure");
    let line = section("Line road");
    let row = between(line, "<code>road_energy_q95</code>", "</tr>").expect("a row");
    let high = energy.interval.expect("an interval").high.expect("its end");
    assert!(
        row.contains(&format!("<td>{}</td>", toolkit::numbers::short(2e5)))
            && row.contains(&toolkit::numbers::percent(high / 2e5)),
        "{row}"
    );
    assert!(section("What was not examined").contains("blocks_per_year"));
    assert!(section("Inputs and their sources").contains("lognormal"));
    // The same page from its directory, and nothing that its manifest does not have.
    assert_eq!(report(&out, &[], None).status.code(), Some(0));
    assert!(page(&out) == first, "another page of the same study");
    let verified = Command::new(program("rockfall")).arg("verify").arg(&out).output().expect("started");
    assert_eq!(verified.status.code(), Some(0), "{}", String::from_utf8_lossy(&verified.stdout));
    if let Some(browser) = browser() {
        let (shown, _) = shown(&browser, &out, 0.0);
        // Every member that passes is a mark at its first crossing.
        let marks = between(&shown, "<div data-hits=\"road\">", "</figure>")
            .expect("hits")
            .matches("<circle")
            .count();
        assert_eq!(marks as f64, summary.measure("road_passing").expect("a count"));
    }
    study(&out, &["--resume", "--set", "report=false"]);
    assert!(!out.join("report.html").exists());
}

#[test]
fn a_run_that_is_not_to_be_trusted_says_so_on_every_page() {
    let bench = Bench::new();
    let error = bench.done(&scene("sphere-on-cable"), "trusted", &[]).measure("energy_error");
    // Ten times the bound would end it.
    let bound = format!("limits.energy_error={:e}", error / 3.0);
    let ended = bench.run(&scene("sphere-on-cable"), "out", &["--set", &bound]);
    assert_eq!(ended.code, Some(3), "{}", ended.stderr);
    let page = without_code(&page(&ended.out));
    assert!(page.contains("<body class=\"unreliable\">") && page.contains("do not use the numbers"));
    let message = ended.summary()["message"].as_str().expect("why").to_owned();
    assert!(page.contains(message.split(['<', '>', '&', '"', '`']).next().expect("a begin")), "{message}");
    // Printed across each page, and at its foot.
    assert!(page.contains("<div class=\"across\" aria-hidden=\"true\">unreliable</div>"));
    assert!(page.contains("@bottom-left { content: \"Sphere on a cable, V-C5 (unreliable)\""));
    assert!(has_all_measures(&ended.out) > 0);
}

#[test]
fn it_is_left_out_where_the_scene_says_so_and_refused_where_there_is_no_run() {
    let bench = Bench::new();
    let ended = bench.done(&scene("free-fall"), "out", &["--set", "output.report=false"]);
    assert!(!ended.out.join("report.html").exists());
    let refused = |output: Output, what: &str| {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(what), "{said}");
    };
    // Before anything is written.
    let nowhere = bench.path("nowhere");
    std::fs::create_dir(&nowhere).expect("created");
    refused(report(&ended.out, &["--pdf"], Some(&nowhere)), "no browser is on PATH");
    assert!(!ended.out.join("report.html").exists());
    refused(report(&nowhere, &[], None), "there is no summary.json");
}

/// The row of `history.csv` at or next after `time` [s].
fn row(ended: &Ended, name: &str, time: f64) -> f64 {
    let at = ended.column("time_s").iter().position(|row| *row >= time - 1e-9).expect("a row");
    ended.column(name)[at]
}

#[test]
fn a_browser_opens_it_without_an_error_or_a_request_and_shows_the_moment_that_is_chosen() {
    let Some(browser) = browser() else { return };
    let bench = Bench::new();
    let ended = bench.done(&scene("sphere-on-cable"), "out", &["--set", FRAMES]);
    let frames = series(&ended.out.join("fields"), "structure").expect("a series");
    let points =
        |k: usize| Loaded::open(&frames[k].1).and_then(|file| file.floats("Points")).expect("points");
    // At a frame, between two, and at the end.
    for (time, before) in
        [(frames[4].0, 4), (0.3 * frames[7].0 + 0.7 * frames[8].0, 7), (0.12, frames.len() - 1)]
    {
        let (_, known) = shown(&browser, &ended.out, time);
        assert!((known["time"].as_f64().expect("a number") - time).abs() < 1e-8, "{known}");
        let (low, high) = (points(before), points((before + 1).min(frames.len() - 1)));
        let share = match frames.get(before + 1) {
            Some((after, _)) => (time - frames[before].0) / (after - frames[before].0),
            None => 0.0,
        };
        let origin = points(0);
        let places = known["points"].as_array().expect("places");
        assert_eq!(places.len(), low.len());
        for (k, place) in places.iter().enumerate() {
            let expected = low[k] + share * (high[k] - low[k]) - origin[k % 3];
            let place = place.as_f64().expect("a number");
            // The net is 2 m long: a place is one of 65 535.
            assert!(
                (place - expected).abs() < 2.0 * 2.0 / 65_535.0,
                "{k}: {place} for {expected} at {time} s"
            );
        }
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            let place = known["rocks"][0][k].as_f64().expect("a number") + origin[k];
            let expected = row(&ended, &format!("sphere_{axis}_m"), time);
            assert!((place - expected).abs() < 2e-3, "{axis}: {place} for {expected} at {time} s");
        }
        // What stands beside the curves is what their file has.
        let values = known["values"].as_array().expect("values");
        let beside = |name: &str| {
            let found =
                values.iter().find(|pair| pair[0].as_str().is_some_and(|text| text.starts_with(name)));
            let text = found.unwrap_or_else(|| panic!("no {name} in {known}"))[1].as_str().expect("a text");
            text.parse::<f64>().expect("a number")
        };
        let expected = 1e-3 * row(&ended, "energy_kinetic_dem_J", time);
        let near = (beside("kinetic of rocks") - expected).abs();
        assert!(near <= 0.01 * expected.abs() + 1e-4, "{near} from {expected} at {time} s");
    }
}

#[test]
fn a_page_with_terrain_and_one_without_frames_open_without_an_error_and_print() {
    let Some(browser) = browser() else { return };
    let bench = Bench::new();
    let short = ["--set", "end_time=0.7", "--set", "output.fields=0.1"];
    let barrier = bench.run(&scene("slope-barrier"), "barrier", &short);
    assert!(matches!(barrier.code, Some(0 | 3)), "{}", barrier.stderr);
    let (page, known) = shown(&browser, &barrier.out, 0.6);
    assert_eq!(known["error"], 0, "{known}");
    assert!(page.contains("<canvas") && page.matches("<figcaption>").count() >= 6, "{page}");
    assert!(page.len() < 5 << 20);

    let fall = bench.done(&scene("slope-fall"), "fall", &[]);
    let (page, known) = shown(&browser, &fall.out, 3.0);
    assert!(!page.contains("<canvas") && known["curves"].as_u64().expect("a count") >= 3, "{known}");
    let printed = report(&fall.out, &["--pdf"], None);
    assert_eq!(printed.status.code(), Some(0), "{}", String::from_utf8_lossy(&printed.stderr));
    let pdf = std::fs::read(fall.out.join("report.pdf")).expect("printed");
    assert!(pdf.starts_with(b"%PDF") && pdf.len() > 20_000, "{} bytes", pdf.len());
}
