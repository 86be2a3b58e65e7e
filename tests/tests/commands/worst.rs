//! `rockfall ensemble STUDY --barrier SCENE --worst N`: the worst members of a study again, against a barrier in its place.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tests::{Bench, LIMIT, program, scene};

/// One fall on the plane of `slope-barrier`, which falls by 0.84 along y.
const FALL: &str = "end_time = 6.0\ngravity = [0.0, 0.0, -9.81]\n\
    [[rock]]\nname = \"block\"\nposition = [0.0, -9.0, 10.0]\ndensity = 2600.0\n\
    shape = { type = \"box\", size = [0.8, 0.7, 0.7] }\ncluster.spheres = 27\n\
    [terrain]\nfile = \"DATA/plane.asc\"\n\
    [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e9\npoisson = 0.25\nrestitution = 0.3\nfriction = 0.4\n\
    [output]\ninterval = 0.05\n";

const STUDY: &str = "scene = \"fall.toml\"\n\
    [[release]]\nline = [[-7.0, -12.0], [7.0, -12.0]]\nheight = 1.0\ncount = 12\n\
    [vary]\nvolume = { uniform = [0.1, 0.5] }\norientation = \"uniform\"\nspeed = { uniform = [6.0, 9.0] }\nazimuth = 0.0\n";

/// Study, fall and barrier in a directory of their own. The barrier is that of `slope-barrier`, with fewer cells.
fn place(bench: &Bench, line: &str) {
    let file = scene("slope-barrier");
    let data = file.parent().expect("a directory").join("data").display().to_string();
    let text = std::fs::read_to_string(&file).expect("a scene");
    let (top, structure) = text.split_once("[structure]").expect("it has a structure");
    let contact = top.find("[[contact]]").expect("a contact");
    let ground = top.rfind("[[contact]]").expect("that of the ground");
    let structure = structure
        .replace("type = \"barrier\"", &format!("type = \"barrier\"\n{line}"))
        .replace("cells = [20, 8]", "cells = [10, 4]")
        .replace("[output]\nfields = 0.1", "[output]\ninterval = 0.05");
    let barrier = format!("end_time = 0.6\n{}[structure]{structure}", &top[contact..ground]);
    std::fs::write(bench.path("barrier.toml"), barrier).expect("written");
    std::fs::write(bench.path("fall.toml"), FALL.replace("DATA", &data)).expect("written");
    std::fs::write(bench.path("study.toml"), STUDY).expect("written");
}

fn command(bench: &Bench, arguments: &[&str]) -> Command {
    let mut command = Command::new(program("rockfall"));
    command.args(["ensemble", "study.toml", "--out", "out", "--barrier", "barrier.toml"]).args(arguments);
    command.current_dir(bench.path("")).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn run(bench: &Bench, arguments: &[&str]) -> Output {
    command(bench, arguments).output().expect("started")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The rows of a table by the names of its columns.
fn rows(path: &Path) -> Vec<HashMap<String, String>> {
    let mut table = csv::Reader::from_path(path).expect("a table");
    let header = table.headers().expect("a header").clone();
    let of =
        |row: csv::StringRecord| header.iter().map(String::from).zip(row.iter().map(String::from)).collect();
    table.records().map(|row| of(row.expect("a row"))).collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or_else(|_| panic!("{name}: {:?}", row.get(name)))
}

/// Members in the order in which they are due, from the table of the line alone.
fn due(out: &Path, count: usize) -> Vec<String> {
    let mut first: Vec<HashMap<String, String>> = Vec::new();
    for row in rows(&out.join("lines/barrier.csv")) {
        if row["crossing"] == "1" {
            first.push(row);
        }
    }
    let order = |key: &dyn Fn(&HashMap<String, String>) -> f64| {
        let mut list: Vec<&HashMap<String, String>> = first.iter().collect();
        list.sort_by(|a, b| key(b).total_cmp(&key(a)));
        list.into_iter().map(|row| row["member"].clone()).collect::<Vec<_>>()
    };
    // The line is 24 m long.
    let lists = [
        order(&|row| number(row, "kinetic_energy_J")),
        order(&|row| number(row, "passing_height_m")),
        order(&|row| -number(row, "along_m").min(24.0 - number(row, "along_m"))),
    ];
    let mut chosen: Vec<String> = Vec::new();
    'all: loop {
        for list in &lists {
            let Some(next) = list.iter().find(|member| !chosen.contains(member)) else { break 'all };
            chosen.push(next.clone());
            if chosen.len() == count {
                break 'all;
            }
        }
    }
    chosen
}

/// Where the rock of a run is at a time, between two rows of its trajectory.
fn position(dir: &Path, time: f64) -> [f64; 3] {
    let rows = rows(&dir.join("trajectory.csv"));
    let after = rows.iter().position(|row| number(row, "time_s") >= time).expect("it lasts longer").max(1);
    let [from, to] = [&rows[after - 1], &rows[after]];
    let share = (time - number(from, "time_s")) / (number(to, "time_s") - number(from, "time_s"));
    ["x_m", "y_m", "z_m"].map(|name| number(from, name) + share * (number(to, name) - number(from, name)))
}

fn runs(bench: &Bench, members: &[String]) -> Vec<String> {
    let of = |member: &String| {
        let path = bench.path(&format!("out/barrier/{member}/run.json"));
        let text = std::fs::read_to_string(path).expect("a record");
        let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        record["run"].as_str().expect("an id").to_owned()
    };
    members.iter().map(of).collect()
}

#[test]
#[ignore = "long"]
fn the_worst_members_are_run_against_the_barrier_once_each_and_put_together() {
    let bench = Bench::new();
    place(&bench, "line = [[-12.0, 0.5], [12.0, 0.5]]");
    let output = run(&bench, &["--worst", "3"]);
    assert!(output.status.success(), "{}", said(&output));
    // Each is told of as it ends, on a terminal or not.
    assert!(said(&output).contains("\n3 of 3: member "), "{}", said(&output));
    let dir = bench.path("out/barrier");
    let table = rows(&dir.join("verdicts.csv"));
    let members: Vec<String> = table.iter().map(|row| row["member"].clone()).collect();
    assert_eq!(members, due(&bench.path("out"), 3));
    let reasons: Vec<&str> = table.iter().map(|row| row["chosen_for"].as_str()).collect();
    assert_eq!(reasons, ["energy", "height", "edge"]);
    let crossings = rows(&bench.path("out/lines/barrier.csv"));
    let mut compared = 0;
    for row in &table {
        let at = crossings.iter().find(|c| c["member"] == row["member"]).expect("it crosses the line");
        for (key, own) in
            [("kinetic_energy_J", "kinetic_energy_J"), ("line_time_s", "time_s"), ("line_x_m", "x_m")]
        {
            // A number of JSON is read to the last bit but one.
            let (found, due) = (number(row, key), number(at, own));
            assert!((found - due).abs() <= f64::EPSILON * due.abs(), "{key}: {found} {due}");
        }
        // It starts in flight, above the anchors 6 m up the slope.
        assert!(
            number(row, "start_time_s") > 0.0 && number(row, "start_time_s") < number(row, "line_time_s")
        );
        let scene = std::fs::read_to_string(dir.join(format!("{}.toml", row["member"]))).expect("a scene");
        let scene: toml::Table = scene.parse().expect("TOML");
        let y = scene["rock"][0]["position"][1].as_float().expect("a number");
        assert!((-12.1..-6.4).contains(&y), "{y}");
        assert_eq!(scene["contact"].as_array().expect("laws").len(), 2);
        assert_eq!(row["status"], "done");
        let passes = number(row, "line_time_s") - number(row, "start_time_s");
        if row["time_of_impact_s"].parse().is_ok_and(|touch: f64| touch > passes) {
            // Until it touches the net it goes where it went in the study; its steps on the ground are others.
            let due = ["line_x_m", "line_y_m", "line_z_m"].map(|name| number(row, name));
            let at = position(&dir.join(&row["member"]), passes);
            assert!((0..3).all(|axis| (at[axis] - due[axis]).abs() < 0.1), "{at:?} {due:?}");
            compared += 1;
        }
        assert!(number(row, "max_elongation_m") > 0.1 && number(row, "max_reaction_1ms_N") > 1e4);
    }
    assert!(compared > 0, "{table:?}");
    // Cells of 0.8 m let a block of 0.7 m through.
    assert!(table.iter().any(|row| row["fate"] == "went_through"), "{table:?}");
    let summary = std::fs::read_to_string(dir.join("summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let measures = &summary["measures"];
    let known = |row: &&HashMap<String, String>| !row["max_elongation_m"].is_empty();
    let most = table
        .iter()
        .filter(known)
        .max_by(|a, b| number(a, "max_elongation_m").total_cmp(&number(b, "max_elongation_m")));
    let most = most.expect("one touches it");
    let largest = &measures["max_elongation_largest"];
    assert_eq!(largest["value"].as_f64(), Some(number(most, "max_elongation_m")));
    assert_eq!(largest["member"].as_str(), Some(format!("member {}", most["member"]).as_str()));
    let through = table.iter().filter(|row| row["fate"] == "went_through").count();
    assert_eq!(measures["members_went_through"]["value"].as_f64(), Some(through as f64));

    // Once more, and one more: what is there is not computed again.
    let before = runs(&bench, &members);
    let again = run(&bench, &["--worst", "4", "--quiet"]);
    assert!(again.status.success(), "{}", said(&again));
    assert_eq!(runs(&bench, &members), before);
    assert_eq!(rows(&dir.join("verdicts.csv")).len(), 4);
    // Another study is refused here, and nothing of this one is lost.
    let kept = std::fs::read(bench.path("out/summary.json")).expect("a summary");
    let other = run(&bench, &["--set", "seed=2"]);
    assert_eq!(other.status.code(), Some(2), "{}", said(&other));
    assert!(said(&other).contains("holds another study: --set seed=2 is new; "), "{}", said(&other));
    let mut without = Command::new(program("rockfall"));
    without.args(["ensemble", "study.toml", "--out", "out", "--resume"]).current_dir(bench.path(""));
    let without = without.output().expect("started");
    assert_eq!(without.status.code(), Some(2), "{}", said(&without));
    assert!(said(&without).contains("barrier.toml is not read now; "), "{}", said(&without));
    assert!(std::fs::read(bench.path("out/summary.json")).is_ok_and(|now| now == kept));
    let chunk = bench.path("out/chunks/00000001-00000002.chunk");
    std::fs::write(&chunk, "not one of this study\n").expect("written");
    let damaged = run(&bench, &[]);
    assert_eq!(damaged.status.code(), Some(2), "{}", said(&damaged));
    assert!(std::fs::read(bench.path("out/summary.json")).is_ok_and(|now| now == kept));
    std::fs::remove_file(chunk).expect("removed");
    // Its scene alone gives the same history.
    let alone = bench.done(&dir.join(format!("{}.toml", members[0])), "alone", &[]);
    let history = |dir: PathBuf| std::fs::read(dir.join("history.csv")).expect("rows");
    assert!(history(alone.out) == history(dir.join(&members[0])));
}

/// A barrier that was hit before: its scene starts from the run of another member, and `--set barrier.KEY` reaches it.
#[test]
fn a_barrier_that_was_hit_before_is_hit_again() {
    let bench = Bench::new();
    place(&bench, "line = [[-12.0, 0.5], [12.0, 0.5]]");
    let first = run(&bench, &["--worst", "1"]);
    assert!(first.status.success(), "{}", said(&first));
    let row = |out: &str| rows(&bench.path(out).join("barrier/verdicts.csv")).remove(0);
    let before = row("out");
    let start = format!("barrier.start_from=out/barrier/{}", before["member"]);
    let sets = ["--worst", "1", "--set", &start, "--set", "barrier.end_time=0.5", "--out", "again"];
    let mut command = Command::new(program("rockfall"));
    command.args(["ensemble", "study.toml", "--barrier", "barrier.toml"]).args(sets);
    let again = command.current_dir(bench.path("")).stdin(Stdio::null()).output().expect("started");
    assert!(again.status.success(), "{}", said(&again));
    let after = row("again");
    assert_eq!(before["member"], after["member"]);
    let scene = std::fs::read_to_string(bench.path(&format!("again/barrier/{}.toml", after["member"])));
    let scene: toml::Table = scene.expect("a scene").parse().expect("TOML");
    assert!(Path::new(scene["start_from"]["run"].as_str().expect("a path")).is_absolute());
    // From where it reaches the line on, rounded up to a hundredth of a second.
    let end = number(&after, "line_time_s") - number(&after, "start_time_s") + 0.5;
    assert!((0.0..0.010_001).contains(&(scene["end_time"].as_float().expect("a time") - end)));
    // The same rock finds another net.
    assert_eq!(before["kinetic_energy_J"], after["kinetic_energy_J"]);
    assert!(before["max_elongation_m"] != after["max_elongation_m"], "{before:?} {after:?}");
    let lost = run(&bench, &["--set", "barrier.coupling.time_windw=1e-4"]);
    assert_eq!(lost.status.code(), Some(2), "{}", said(&lost));
    assert!(said(&lost).contains("unknown key `time_windw`"), "{}", said(&lost));
}

#[test]
fn an_interrupted_command_ends_in_order_and_the_same_one_goes_on() {
    let bench = Bench::new();
    place(&bench, "line = [[-12.0, 0.5], [12.0, 0.5]]");
    let child = command(&bench, &["--worst", "2"]).spawn().expect("started");
    let begun = Instant::now();
    let second = || {
        let chosen = std::fs::read_to_string(bench.path("out/barrier/chosen.json")).ok()?;
        let chosen: serde_json::Value = serde_json::from_str(&chosen).ok()?;
        let member = chosen["chosen"][1]["member"].as_u64()?;
        Some(bench.path(&format!("out/barrier/{member}/scene.toml"))).filter(|path| path.exists())
    };
    while second().is_none() {
        assert!(begun.elapsed() < LIMIT, "the second member is not begun");
        std::thread::sleep(Duration::from_millis(5));
    }
    let process = i32::try_from(child.id()).expect("a number");
    let pid = rustix::process::Pid::from_raw(process).expect("a process");
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).expect("it is there");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("interrupted; 1 of 2 members are computed; the same command goes on"),
        "{}",
        said(&output)
    );
    let first = rows(&bench.path("out/barrier/verdicts.csv"))[0]["member"].clone();
    let before = runs(&bench, std::slice::from_ref(&first));
    let again = run(&bench, &["--worst", "2"]);
    assert!(again.status.success(), "{}", said(&again));
    assert_eq!(runs(&bench, std::slice::from_ref(&first)), before, "the first is not run again");
    assert_eq!(rows(&bench.path("out/barrier/verdicts.csv")).len(), 2);
}

#[test]
fn what_cannot_be_run_is_refused_before_the_study_and_says_what_to_try() {
    let bench = Bench::new();
    let refused = |what: &[&str]| {
        let output = run(&bench, &["--worst", "2"]);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        let text = said(&output);
        assert_eq!(text.matches("error: ").count(), 1, "{text}");
        assert!(what.iter().all(|what| text.contains(what)), "{what:?}: {text}");
    };
    place(&bench, "");
    refused(&["barrier.toml:", "does not stand on a line of the terrain", "line = [[x, y], [x, y]]"]);
    place(&bench, "line = [[-12.0, 0.5], [42.0, 0.5]]");
    refused(&["lies beside the terrain", "--scene-of 1"]);
    place(&bench, "line = [[-12.0, 0.5], [12.0, 0.5]]");
    let text = std::fs::read_to_string(bench.path("barrier.toml")).expect("a scene");
    std::fs::write(bench.path("barrier.toml"), text.replace("end_time = 0.6\n", "")).expect("written");
    refused(&["barrier.toml", "the key `end_time` is missing"]);
    std::fs::write(bench.path("barrier.toml"), format!("{text}[box]\n")).expect("written");
    refused(&["barrier.toml:", "leave `box` out"]);
    std::fs::write(bench.path("barrier.toml"), format!("start_from = \"nowhere\"\n{text}")).expect("written");
    refused(&["there is no directory", "nowhere"]);
    assert!(!bench.path("out").exists(), "nothing is left of what was refused");
    std::fs::write(bench.path("barrier.toml"), &text).expect("written");
    let (_, structure) = text.split_once("[structure]").expect("it has a structure");
    let bare = format!("end_time = 0.6\n[structure]{structure}");
    std::fs::write(bench.path("barrier.toml"), bare).expect("written");
    refused(&[
        "barrier.toml",
        "no [[contact]] of `rock` and `structure`",
        "between = [\"rock\", \"structure\"]",
    ]);
    std::fs::write(bench.path("barrier.toml"), &text).expect("written");
    let long = run(&bench, &["--set", "barrier.dem.time_step=0.01"]);
    assert_eq!(long.status.code(), Some(2), "{}", said(&long));
    let says = said(&long);
    assert!(says.contains("critical step") && says.contains("--scene-of 1"), "{says}");
    assert!(!says.contains("-member.toml") && !bench.path("out").exists(), "{says}");
    let other = "[[line]]\nname = \"barrier\"\npoints = [[-5.0, 3.0], [5.0, 3.0]]\n";
    std::fs::write(bench.path("study.toml"), format!("{STUDY}{other}")).expect("written");
    refused(&[
        "study.toml:",
        "the line `barrier` of the study is not where",
        "points = [[-12.0, 0.5], [12.0, 0.5]]",
    ]);
    // Upslope of all releases: nothing comes there.
    place(&bench, "line = [[-6.0, -30.0], [6.0, -30.0]]");
    refused(&["no member of the study reaches the line `barrier`", "maps/share.svg"]);
}
