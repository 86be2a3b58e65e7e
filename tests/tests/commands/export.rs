//! `rockfall export`: the neutral document needs no Python, other formats do, and what is wrong is said before anything is computed.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tests::{Bench, program, scene};

fn export(bench: &Bench, scene: &Path, to: &str, path: Option<&str>) -> Output {
    let mut command = Command::new(program("rockfall"));
    command.arg("export").arg(scene).arg("--to").arg(bench.path(to));
    if let Some(path) = path {
        command.env("PATH", path);
    }
    command.output().expect("started")
}

fn said(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

#[test]
fn a_structure_is_a_document_and_from_it_a_file_of_another_program() {
    let bench = Bench::new();
    let net = scene("cable-net");
    for (to, path) in [("structure.json", Some("/nowhere")), ("net.inp", None), ("net.MSH", None)] {
        let output = export(&bench, &net, to, path);
        let text = said(&output);
        assert_eq!(output.status.code(), Some(0), "{text}");
        assert!(text.contains(": 441 nodes, 840 elements, 9 sets"), "{text}");
        assert!(text.contains("warning: not in this file: damping"), "{text}");
    }
    let text = std::fs::read_to_string(bench.path("structure.json")).expect("written");
    let document: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&document["version"], &document["units"]), (&1.into(), &"SI".into()));
    assert_eq!(document["elements"][0]["kind"], "line2");
    assert_eq!(document["sections"][0]["form"]["kind"], "truss");
    assert_eq!(document["nodes"].as_array().map(Vec::len), Some(441));
    let text = std::fs::read_to_string(bench.path("net.inp")).expect("written");
    assert!(text.starts_with("** structure of a rockfall scene, as modelled; m, kg, s, N\n"), "{text}");
}

#[test]
fn without_python_the_cure_is_said_and_nothing_is_written() {
    let bench = Bench::new();
    let output = export(&bench, &scene("cable-net"), "net.mdpa", Some("/nowhere"));
    let text = said(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("python3 cannot be started") && text.contains("--to structure.json"), "{text}");
    assert!(!bench.path("net.mdpa").exists());
}

#[test]
fn a_name_that_a_format_cannot_have_is_refused() {
    let bench = Bench::new();
    let net = bench.scene(
        "end_time = 1.0\ngravity = [0.0, 0.0, 0.0]\n[structure]\ndead_load = false\n\
         nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]\ncables = [{ nodes = [0, 1] }]\n\
         cable = { young = 1e9, area = 1e-4, density = 7850.0, prestress = 1e7 }\n\
         groups = [{ name = \"left, low\", nodes = [0] }]\nsupports = [{ group = \"left, low\" }]\n",
    );
    let output = export(&bench, &net, "net.inp", None);
    let text = said(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("net.inp: the set `left, low` can have no such name in this format"), "{text}");
    assert!(text.contains("rename it in the scene or its mesh"), "{text}");
    assert!(!bench.path("net.inp").exists());
}
