//! `rockfall conform`: programs of ours and the examples keep the contract, and who breaks it is told the clause.

use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use tests::{Bench, Ended, example, program};

/// `rockfall conform --role ROLE ARGUMENTS -- COMMAND`.
fn conform(role: &str, arguments: &[&str], command: &[&str]) -> Ended {
    let mut rockfall = Command::new(program("rockfall"));
    rockfall.args(["conform", "--role", role]).args(arguments).arg("--").args(command).stdin(Stdio::null());
    Ended::of(rockfall.output().expect("started"), PathBuf::new())
}

fn path(program: PathBuf) -> String {
    program.display().to_string()
}

/// What is said of each clause.
fn clauses(ended: &Ended) -> Vec<(String, String)> {
    let answer: Value =
        serde_json::from_str(&ended.stdout).unwrap_or_else(|e| panic!("{e}: {}", ended.stderr));
    assert_eq!(answer["conforms"], ended.code == Some(0));
    let text = |value: &Value| value.as_str().expect("a text").to_owned();
    let all = answer["clauses"].as_array().expect("a list").iter();
    all.map(|judged| (text(&judged["clause"]), text(&judged["outcome"]))).collect()
}

#[test]
fn our_programs_and_the_examples_keep_the_contract() {
    for (role, program, least) in [
        ("fem", program("fem-solver"), 14),
        ("dem", program("dem-solver"), 13),
        ("fem", example("oscillator"), 13),
        ("dem", example("weight"), 9),
    ] {
        let ended = conform(role, &["--format", "json"], &[&path(program)]);
        let all = clauses(&ended);
        let kept = all.iter().filter(|(_, outcome)| outcome == "kept").count();
        assert!(ended.code == Some(0) && kept >= least, "{role}: {}\n{}", ended.stdout, ended.stderr);
    }
    let ended = conform("fem", &["--set", "coupling.samples=4"], &[&path(program("fem-solver"))]);
    assert!(ended.stdout.contains("5.3   kept"), "{}", ended.stdout);
}

#[test]
fn a_scene_of_ones_own_brings_its_data_and_its_partner() {
    let scene = path(tests::scene("sphere-on-cable"));
    let arguments = ["--scene", &scene, "--set", "end_time=0.01", "--format", "json"];
    for (role, solver) in [("fem", "fem-solver"), ("dem", "dem-solver")] {
        let ended = conform(role, &arguments, &[&path(program(solver))]);
        assert!(ended.code == Some(0), "{role}: {}\n{}", ended.stdout, ended.stderr);
    }
}

#[test]
fn who_breaks_a_clause_is_told_which() {
    for (lie, clause) in
        [("length", "2.3"), ("nan", "4.3"), ("short", "4.3"), ("protocol", "3.5"), ("two-meshes", "5.2")]
    {
        let ended = conform("fem", &["--format", "json"], &[&path(example("liar")), lie]);
        let broken: Vec<String> = clauses(&ended)
            .into_iter()
            .filter(|(_, outcome)| outcome == "broken")
            .map(|(clause, _)| clause)
            .collect();
        assert_eq!((ended.code, &broken[..]), (Some(1), &[clause.to_owned()][..]), "{lie}: {}", ended.stdout);
    }
}

#[test]
#[ignore = "long"]
fn who_never_joins_and_what_cannot_be_started_are_told_apart() {
    let ended = conform("fem", &[], &["true"]);
    assert_eq!(ended.code, Some(1), "{}", ended.stdout);
    assert!(ended.stderr.contains("fem ended before it joined: exit code 0"), "{}", ended.stderr);
    let ended = conform("fem", &["--set", "processes.timeout=1"], &[&path(example("liar")), "mute"]);
    assert_eq!(ended.code, Some(1));
    assert!(ended.stdout.contains("4.1   BROKEN"), "{}\n{}", ended.stdout, ended.stderr);
    let ended = conform("dem", &[], &["./no-such-program"]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("there is no program"), "{}", ended.stderr);
    let bench = Bench::new();
    let scene = path(bench.scene("end_time = -1.0\n"));
    assert_eq!(conform("dem", &["--scene", &scene], &["true"]).code, Some(2));
}
