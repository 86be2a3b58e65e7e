//! The schema for editors and the reference: what the programs read and write is what they say.

use interface_defs::toolkit::schema::Share;
use serde_json::Value;
use std::process::Command;
use tests::{Bench, Ended, program, repository, scene};

fn printed(arguments: &[&str]) -> String {
    let output = Command::new(program("rockfall")).arg("schema").args(arguments).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

fn validator() -> jsonschema::Validator {
    let schema: Value = serde_json::from_str(&printed(&[])).expect("JSON");
    jsonschema::draft7::new(&schema).expect("a schema of draft 7")
}

fn document(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().expect("TOML")).expect("JSON")
}

#[test]
fn every_scene_that_comes_with_the_project_fits_the_schema() {
    let validator = validator();
    let files = std::fs::read_dir(repository().join("launch/scenes")).expect("scenes");
    let mut count = 0;
    for path in files.map(|f| f.expect("a file").path()) {
        if path.extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(&path).expect("readable");
            let faults: Vec<String> = validator
                .iter_errors(&document(&text))
                .map(|e| format!("{}: {e}", e.instance_path()))
                .collect();
            assert!(faults.is_empty(), "{}: {faults:#?}", path.display());
            count += 1;
        }
    }
    assert!(count > 10, "{count} scenes");
}

#[test]
fn what_a_program_refuses_at_sight_the_schema_refuses_too() {
    let validator = validator();
    let text = std::fs::read_to_string(scene("barrier-impact")).expect("readable");
    assert!(validator.is_valid(&document(&text)));
    for (from, to) in [
        ("[coupling]", "[couplng]"),
        ("position =", "postion ="),
        ("scheme = \"weak\"", "scheme = \"week\""),
        ("end_time =", "title ="),
        ("law = \"hertz_mindlin\"", "law = 3"),
        ("element = \"brake\"", "element = \"break\""),
        ("stiffness =", "stifness ="),
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, -9, 81]"),
    ] {
        assert!(text.contains(from), "{from} is in the scene");
        assert!(!validator.is_valid(&document(&text.replacen(from, to, 1))), "{to} must be refused");
    }
}

#[test]
fn the_reference_in_docs_is_the_one_that_the_programs_print() {
    let file = repository().join("docs/reference.md");
    let kept = std::fs::read_to_string(&file).unwrap_or_default();
    let now = printed(&["--reference"]);
    let first = kept.lines().zip(now.lines()).find(|(a, b)| a != b);
    assert!(
        kept == now,
        "{} is out of date, first at {first:#?}; renew it with\n  target/release/rockfall schema --reference > \
         docs/reference.md",
        file.display()
    );
}

/// Every column and measure of `ended` that no entry describes.
fn undescribed(ended: &Ended, results: &Share) -> Vec<String> {
    let described =
        |file: &str, name: &str| results.results.iter().any(|e| e.file == file && e.describes(name));
    let mut missing = Vec::new();
    for file in ["history.csv", "trajectory.csv", "iterations.csv"] {
        let Ok(text) = std::fs::read_to_string(ended.out.join(file)) else { continue };
        let header = text.lines().next().expect("a header").to_owned();
        let names =
            header.split(',').filter(|name| !described(file, name)).map(|name| format!("{file}: {name}"));
        missing.extend(names);
    }
    let summary = ended.summary();
    for (name, measure) in summary["measures"].as_object().expect("measures") {
        let unit = measure["unit"].as_str().expect("a unit");
        // Of several rocks each measure begins with the name of its rock.
        let own = name.strip_prefix("rock_").or(name.strip_prefix("second_")).unwrap_or(name);
        let fits = |e: &&interface_defs::toolkit::schema::Entry| {
            e.file == "summary.json"
                && (e.describes(name) || e.describes(own))
                && (e.unit.is_empty() || e.unit == unit)
        };
        if !results.results.iter().any(|e| fits(&e)) {
            missing.push(format!("summary.json: {name} [{unit}]"));
        }
    }
    missing
}

#[test]
fn every_column_and_measure_stands_in_the_reference_with_its_unit() {
    let mut all = Share::default();
    for name in ["dem-solver", "fem-solver", "coupler"] {
        let output = Command::new(program(name)).arg("schema").output().expect("it runs");
        all.merge(Share::from_json(&String::from_utf8_lossy(&output.stdout)).expect("a share"))
            .expect("agrees");
    }
    let bench = Bench::new();
    let runs: [(&str, &[&str]); 6] = [
        ("free-fall", &[]),
        ("slope-cube", &["--set", "end_time=1.5"]),
        ("settling-box", &["--set", "end_time=1e-3", "--set", "spheres.0.count=50"]),
        ("sphere-on-plate-spring", &["--set", "output.iterations=true"]),
        ("cable-net", &["--set", "end_time=0.02"]),
        ("barrier-cables", &["--set", "end_time=2e-3"]),
    ];
    for (name, sets) in runs {
        let ended = bench.done(&scene(name), name, sets);
        let missing = undescribed(&ended, &all);
        assert!(missing.is_empty(), "{name}: without an entry in the program's reference.rs: {missing:#?}");
    }
}
