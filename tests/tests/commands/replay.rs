//! `rockfall run --record` and `rockfall replay`: one solver alone against what was recorded.

use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Command, Output};
use tests::{Bench, example, program, word};

/// Above the oscillator at the start [m], and speed [m/s].
const GAP: f64 = 0.005;
const SPEED: f64 = 3.13209195;

/// A recording of a sphere on the example `oscillator`: 2 000 windows.
fn recorded(bench: &Bench) -> PathBuf {
    let scene = bench.sphere_on(&word(example("oscillator")), "strong", GAP);
    let file = bench.path("crossed.recording");
    bench.done(&scene, "out", &["--record", file.to_str().expect("text")]);
    file
}

fn replay(file: &PathBuf, arguments: &[&str], command: &[PathBuf]) -> Output {
    let mut replay = Command::new(program("rockfall"));
    replay.arg("replay").arg(file).args(arguments).args(["--format", "json"]);
    if !command.is_empty() {
        replay.arg("--").args(command);
    }
    replay.output().expect("started")
}

fn report(output: &Output) -> serde_json::Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text)
        .unwrap_or_else(|e| panic!("{e}: {text}{}", String::from_utf8_lossy(&output.stderr)))
}

#[test]
fn both_solvers_answer_a_recording_to_the_byte_and_another_one_is_found_at_its_first_difference() {
    let bench = Bench::new();
    let file = recorded(&bench);
    for (role, command) in [("dem", vec![]), ("fem", vec![example("oscillator")])] {
        let output = replay(&file, &["--role", role], &command);
        let report = report(&output);
        assert_eq!(output.status.code(), Some(0), "{report}");
        let exchanges = report["exchanges"].as_u64().expect("a count");
        assert!(exchanges >= 2000, "{report}");
        assert_eq!(report["equal"].as_u64(), Some(exchanges), "{report}");
    }

    // A contact solver that is a tenth too stiff.
    let wrong = bench.path("wrong.sh");
    let text = format!(
        "#!/bin/sh\nsed 's/^young = .*/young = 1.1e9/' \"$2\" > \"$2.other\"\nother=$2.other\nshift 2\nexec {} serve \"$other\" \"$@\"\n",
        word(program("dem-solver"))
    );
    std::fs::write(&wrong, text).expect("written");
    std::fs::set_permissions(&wrong, std::fs::Permissions::from_mode(0o755)).expect("set");
    let output = replay(&file, &["--role", "dem", "--tolerance", "1e-6"], &[wrong]);
    let report = report(&output);
    assert_eq!(output.status.code(), Some(1), "{report}");
    // Before it touches it falls, hardly faster than at the start: within 2 %.
    let time = report["first"]["time"].as_f64().expect("a time");
    assert!((0.98..1.02).contains(&(time * SPEED / GAP)), "{report}");
    assert!(report["first"]["what"].as_str().expect("words").contains("force"), "{report}");
}

#[test]
fn a_recording_that_is_cut_or_none_is_refused() {
    let bench = Bench::new();
    let file = recorded(&bench);
    let cut = std::fs::read(&file).expect("the recording");
    std::fs::write(&file, &cut[..cut.len() / 2]).expect("cut");
    let output = replay(&file, &["--role", "fem"], &[example("oscillator")]);
    assert_eq!(output.status.code(), Some(1), "a recording that was cut off has no end");
    std::fs::write(&file, b"something else").expect("written");
    assert_eq!(replay(&file, &["--role", "fem"], &[]).status.code(), Some(2));
}
