//! `rockfall verify`: is a directory what its run or study wrote, file by file?

use std::path::Path;
use std::process::{Command, Stdio};
use tests::{Bench, Ended, program, scene};

/// A rock of spheres that falls on the plane of `slope-barrier`.
const FALL: &str = "end_time = 1.5\ngravity = [0.0, 0.0, -9.81]\n\
    [[rock]]\nname = \"block\"\nposition = [0.0, -9.0, 10.0]\ndensity = 2600.0\n\
    shape = { type = \"box\", size = [0.8, 0.7, 0.7] }\ncluster = { spheres = 40, method = \"medial\" }\n\
    [terrain]\nfile = \"DATA/plane.asc\"\n\
    [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e9\npoisson = 0.25\nrestitution = 0.3\nfriction = 0.4\n\
    [output]\ninterval = 0.05\n";

/// Exit code and answer.
fn verify(dir: &Path) -> (Option<i32>, serde_json::Value) {
    let mut command = Command::new(program("rockfall"));
    command.arg("verify").arg(dir).args(["--format", "json"]).stdin(Stdio::null());
    let ended = Ended::of(command.output().expect("started"), dir.to_path_buf());
    (ended.code, serde_json::from_str(&ended.stdout).unwrap_or_else(|e| panic!("{e}: {}", ended.stderr)))
}

/// All files below `dir` that a manifest covers.
fn files(dir: &Path, below: &str, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(dir.join(below)).expect("a directory") {
        let entry = entry.expect("an entry");
        let name = entry.file_name().into_string().expect("text");
        let path = if below.is_empty() { name.clone() } else { format!("{below}/{name}") };
        match entry.path().is_dir() {
            true => files(dir, &path, found),
            false if name.starts_with('.') || path == "manifest.json" => {}
            false => found.push(path),
        }
    }
}

/// A byte that is changed in `name` is found, and the file named.
fn finds_a_flip(dir: &Path, name: &str) {
    let path = dir.join(name);
    let whole = std::fs::read(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut bytes = whole.clone();
    match bytes.len() / 2 {
        0 => bytes.push(b'x'),
        middle => bytes[middle] ^= 4,
    }
    std::fs::write(&path, bytes).expect("written");
    let (code, answer) = verify(dir);
    assert_eq!((code, &answer["changed"]), (Some(1), &1.into()), "{name}: {answer}");
    let said = &answer["diagnostics"][0];
    assert_eq!((said["code"].as_str(), said["severity"].as_str()), (Some("provenance"), Some("error")));
    assert_eq!(said["place"]["file"].as_str(), path.to_str(), "{answer}");
    std::fs::write(&path, whole).expect("written");
}

/// `out` is what its run wrote, `kinds` are among its files, and a change of any file is found.
fn holds(out: &Path, kinds: &[&str]) {
    let (code, answer) = verify(out);
    assert_eq!((code, answer["diagnostics"].as_array().map(Vec::len)), (Some(0), Some(0)), "{answer}");
    let mut all = Vec::new();
    files(out, "", &mut all);
    for kind in kinds {
        assert!(all.iter().any(|name| name == kind), "{kind}: {all:?}");
    }
    all.iter().for_each(|name| finds_a_flip(out, name));
    assert_eq!(verify(out).0, Some(0));
}

#[test]
fn a_changed_byte_of_a_coupled_run_is_found() {
    let bench = Bench::new();
    let sets = ["--set", "end_time=0.01", "--set", "output.fields=0.005", "--set", "output.iterations=true"];
    let ended = bench.done(&scene("sphere-on-cable"), "out", &sets);
    holds(
        &ended.out,
        &[
            "history.csv",
            "iterations.csv",
            "summary.json",
            "run.json",
            "scene.toml",
            "structure.state",
            "log/coupler.log",
            "log/dem.log",
            "log/fem.log",
            "fields/rocks_000001.vtu",
        ],
    );
    // What came later is no fault; what is missing is one.
    std::fs::write(ended.out.join("notes.txt"), "mine").expect("written");
    let (code, answer) = verify(&ended.out);
    assert_eq!((code, answer["diagnostics"][0]["severity"].as_str()), (Some(0), Some("note")), "{answer}");
    std::fs::remove_file(ended.out.join("history.csv")).expect("removed");
    assert_eq!(verify(&ended.out).0, Some(1));
    // Another run in its place; and a directory that is of none.
    let again = bench.done(&scene("sphere-on-cable"), "out", &["--force", "--set", "end_time=0.01"]);
    assert_eq!(verify(&again.out).0, Some(0));
    assert_eq!(verify(&bench.path("")).0, Some(2));
}

#[test]
fn a_changed_byte_of_a_fall_is_found() {
    let bench = Bench::new();
    let data = scene("slope-barrier").with_file_name("data").display().to_string();
    let ended = bench.done(&bench.scene(&FALL.replace("DATA", &data)), "out", &[]);
    holds(
        &ended.out,
        &["history.csv", "trajectory.csv", "clusters/block.xyzr", "summary.json", "run.json", "log/dem.log"],
    );
}

#[test]
fn a_changed_byte_of_a_study_of_falls_is_found() {
    let bench = Bench::new();
    let mut command = Command::new(program("rockfall"));
    command.arg("ensemble").arg(scene("studies/slope")).args(["--set", "release.0.count=6", "--quiet"]);
    command.arg("--out").arg(bench.path("out")).stdin(Stdio::null());
    let ended = Ended::of(command.output().expect("started"), bench.path("out"));
    assert_eq!((ended.code, &*ended.stderr), (Some(0), ""), "a study is quiet where it is asked to be");
    holds(
        &ended.out,
        &[
            "members.csv",
            "study.toml",
            "study.json",
            "scene.toml",
            "summary.json",
            "chunks/main.journal",
            "maps/count.tif",
            "maps/count.svg",
            "maps/study.gpkg",
            "lines/road.csv",
            "lines/road.svg",
        ],
    );
}

#[test]
fn a_changed_byte_of_a_study_of_settings_is_found() {
    let bench = Bench::new();
    let mut command = Command::new(program("rockfall"));
    command.arg("trade").arg(scene("sphere-on-cable")).args(["--set", "end_time=0.02", "--runs", "9"]);
    command.arg("--out").arg(bench.path("out")).stdin(Stdio::null());
    let ended = Ended::of(command.output().expect("started"), bench.path("out"));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_eq!(verify(&ended.out).0, Some(0));
    for name in ["trade.csv", "trade.md", "study.json", "runs/001/task.json", "runs/001/history.csv"] {
        finds_a_flip(&ended.out, name);
    }
}
