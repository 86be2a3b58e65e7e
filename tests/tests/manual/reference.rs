//! The schema for editors and the reference: what the programs read and write is what they say.

use serde_json::Value;
use std::process::Command;
use tests::{Bench, Ended, program, repository, scene};
use toolkit::schema::Share;

fn printed(arguments: &[&str]) -> String {
    let output = Command::new(program("rockfall")).arg("schema").args(arguments).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

fn schema() -> Value {
    serde_json::from_str(&printed(&[])).expect("JSON")
}

/// What of `value` does not fit `schema`, for as much of draft 7 as the schema uses; any other word is a failure.
fn faults(value: &Value, schema: &Value, root: &Value, at: &str, found: &mut Vec<String>) {
    if schema == &Value::Bool(true) {
        return;
    }
    let one = |schema: &Value, at: &str| {
        let mut own = Vec::new();
        faults(value, schema, root, at, &mut own);
        own
    };
    for (word, rule) in schema.as_object().expect("a schema") {
        let mut refuse = |what: String| found.push(format!("{at}: {what}"));
        match word.as_str() {
            "description" | "default" | "writeOnly" | "title" | "$schema" | "definitions" => {}
            "type" if rule == "number" && value.is_number() => {}
            "type" if rule == kind(value) => {}
            "type" if rule.as_array().is_some_and(|kinds| kinds.iter().any(|one| one == kind(value))) => {}
            "type" => refuse(format!("{value} is no {rule}")),
            "const" if rule != value => refuse(format!("{value} is not {rule}")),
            "const" => {}
            "minimum" if value.as_f64() < rule.as_f64() => refuse(format!("{value} is below {rule}")),
            "maximum" if value.as_f64() > rule.as_f64() => refuse(format!("{value} is above {rule}")),
            "exclusiveMinimum" if value.as_f64() <= rule.as_f64() => {
                refuse(format!("{value} is not above {rule}"))
            }
            "minimum" | "maximum" | "exclusiveMinimum" => {}
            "minItems" if value.as_array().map(Vec::len) < rule.as_u64().map(|n| n as usize) => {
                refuse(format!("{value} is short"))
            }
            "maxItems"
                if value.as_array().is_some_and(|v| v.len() as u64 > rule.as_u64().expect("a count")) =>
            {
                refuse(format!("{value} is long"));
            }
            "minItems" | "maxItems" => {}
            "items" => {
                for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                    faults(item, rule, root, &format!("{at}.{i}"), found);
                }
            }
            "required" => {
                for key in rule.as_array().expect("keys").iter().filter_map(Value::as_str) {
                    if value.is_object() && value.get(key).is_none() {
                        refuse(format!("`{key}` is missing"));
                    }
                }
            }
            "properties" => {
                for (key, inner) in value.as_object().into_iter().flatten() {
                    if let Some(own) = rule.get(key) {
                        faults(inner, own, root, &format!("{at}.{key}"), found);
                    }
                }
            }
            "additionalProperties" if rule == &Value::Bool(false) => {
                let known = schema.get("properties");
                for key in value.as_object().into_iter().flatten().map(|(key, _)| key) {
                    if known.and_then(|k| k.get(key)).is_none() {
                        refuse(format!("unknown key `{key}`"));
                    }
                }
            }
            "additionalProperties" => {}
            "$ref" => {
                let name =
                    rule.as_str().and_then(|r| r.strip_prefix("#/definitions/")).expect("a definition");
                faults(value, &root["definitions"][name], root, at, found);
            }
            "allOf" => rule.as_array().expect("schemas").iter().for_each(|s| found.extend(one(s, at))),
            "oneOf" | "anyOf" => {
                let tried: Vec<_> = rule.as_array().expect("schemas").iter().map(|s| one(s, at)).collect();
                let fitting = tried.iter().filter(|t| t.is_empty()).count();
                if fitting == 0 || (word == "oneOf" && fitting > 1) {
                    refuse(format!("{fitting} of {} choices fit: {tried:?}", tried.len()));
                }
            }
            other => refuse(format!("the schema says `{other}`, which this test does not know")),
        }
    }
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(n) if n.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

fn unfit(scene: &str, schema: &Value) -> Vec<String> {
    let mut found = Vec::new();
    faults(&document(scene), schema, schema, "scene", &mut found);
    found
}

fn document(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().expect("TOML")).expect("JSON")
}

#[test]
fn every_scene_that_comes_with_the_project_fits_the_schema() {
    let schema = schema();
    let files = std::fs::read_dir(repository().join("launch/scenes")).expect("scenes");
    let mut count = 0;
    for path in files.map(|f| f.expect("a file").path()) {
        if path.extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(&path).expect("readable");
            let found = unfit(&text, &schema);
            assert!(found.is_empty(), "{}: {found:#?}", path.display());
            count += 1;
        }
    }
    assert!(count > 10, "{count} scenes");
}

/// Names of all definitions that `value` refers to.
fn referred(value: &Value, names: &mut Vec<String>) {
    match value {
        Value::Object(all) => {
            names.extend(all.get("$ref").and_then(Value::as_str).map(str::to_owned));
            all.values().for_each(|value| referred(value, names));
        }
        Value::Array(all) => all.iter().for_each(|value| referred(value, names)),
        _ => {}
    }
}

#[test]
fn the_schema_refers_to_what_is_in_it_and_takes_a_preset_in_place_of_a_law() {
    let (schema, mut names) = (schema(), Vec::new());
    referred(&schema, &mut names);
    let missing = |name: &&String| schema.pointer(name.trim_start_matches('#')).is_none();
    assert!(names.len() > 20 && !names.iter().any(|name| missing(&name)), "{names:?}");
    let text = |law: &str| format!("end_time = 1.0\n[[contact]]\n{law}\nfriction = 0.5\n");
    assert!(unfit(&text("preset = \"soft_soil\""), &schema).is_empty());
    assert!(unfit(&text("law = \"ground\"\nrestitution_law = \"walton\""), &schema).is_empty());
    assert!(!unfit(&text("restitution = 0.5"), &schema).is_empty());
}

#[test]
fn what_a_program_refuses_at_sight_the_schema_refuses_too() {
    let schema = schema();
    let text = std::fs::read_to_string(scene("barrier-impact")).expect("readable");
    let text = text + "[coupling]\nscheme = \"weak\"\n";
    assert!(unfit(&text, &schema).is_empty());
    for (from, to) in [
        ("[coupling]", "[couplng]"),
        ("position =", "postion ="),
        ("scheme = \"weak\"", "scheme = \"week\""),
        ("end_time =", "end_tme ="),
        ("law = \"linear\"", "law = 3"),
        ("element = \"brake\"", "element = \"break\""),
        ("stiffness =", "stifness ="),
        ("gravity = [0.0, 9.81, 0.0]", "gravity = [0.0, 9, 81, 0.0]"),
    ] {
        assert!(text.contains(from), "{from} is in the scene");
        assert!(!unfit(&text.replacen(from, to, 1), &schema).is_empty(), "{to} must be refused");
    }
}

/// What the study's reader refuses at sight its schema refuses too; the studies that come with the project fit it.
#[test]
fn a_study_fits_its_schema_and_a_misspelt_key_does_not() {
    let schema: Value = serde_json::from_str(&printed(&["--study"])).expect("JSON");
    let unfit = |text: &str| {
        let mut found = Vec::new();
        faults(&document(text), &schema, &schema, "study", &mut found);
        found
    };
    let text =
        std::fs::read_to_string(repository().join("launch/scenes/studies/slope.toml")).expect("readable");
    assert!(unfit(&text).is_empty(), "{:#?}", unfit(&text));
    for (from, to) in [
        ("scene =", "scen ="),
        ("\"latin_hypercube\"", "\"latin\""),
        ("[[release]]", "[[relase]]"),
        ("polygon =", "polygn ="),
        ("volume =", "volum ="),
        ("lognormal", "lognormel"),
        ("[maps]\ncell", "[maps]\nsell"),
        ("[[line]]\nname", "[[line]]\nnam"),
    ] {
        assert!(text.contains(from), "{from} is in the study");
        assert!(!unfit(&text.replacen(from, to, 1)).is_empty(), "{to} must be refused");
    }
}

/// The same without what a whole file must have.
fn of_parts(schema: &Value) -> Value {
    match schema {
        Value::Object(all) => {
            let kept = all.iter().filter(|(word, _)| *word != "required");
            let word = |word: &str| if word == "oneOf" { "anyOf" } else { word }.to_owned();
            Value::Object(kept.map(|(name, rule)| (word(name), of_parts(rule))).collect())
        }
        Value::Array(all) => all.iter().map(of_parts).collect(),
        other => other.clone(),
    }
}

/// A block of a page is a scene, a study, a calibration or a kit, or a part of one.
#[test]
fn every_block_in_toml_of_every_page_fits_a_schema() {
    let kinds: [&[&str]; 4] = [&[], &["--study"], &["--calibration"], &["--kit"]];
    let schemas = kinds.map(|kind| of_parts(&serde_json::from_str(&printed(kind)).expect("JSON")));
    let mut count = 0;
    for page in tests::manual::pages() {
        for text in tests::manual::blocks_in(&page, "toml") {
            count += 1;
            let unfit = schemas.each_ref().map(|schema| unfit(&text, schema));
            assert!(unfit.iter().any(Vec::is_empty), "{page}:\n{text}\n{unfit:#?}");
        }
    }
    assert!(count > 20, "{count}");
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
        let fits = |e: &&toolkit::schema::Entry| {
            e.file == "summary.json"
                && (e.describes(name) || e.describes(own))
                && (e.unit.is_empty() || e.unit == unit)
        };
        if !results.results.iter().any(|e| fits(&e)) {
            missing.push(format!("summary.json: {name} [{unit}]"));
        }
    }
    for part in ["energy", "coupling", "cost"] {
        let file = format!("summary.json: {part}");
        let of_solvers = ["dem", "fem", "coupler"].map(|name| &summary["cost"]["processes"][name]["counts"]);
        let counts =
            of_solvers.into_iter().filter(|_| part == "cost").filter_map(|counts| counts.as_object());
        let keys = summary[part].as_object().into_iter().chain(counts).flat_map(|table| table.keys());
        missing.extend(keys.filter(|key| !described(&file, key)).map(|key| format!("{file}: {key}")));
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
        assert!(missing.is_empty(), "{name}: without an entry in the program's results.txt: {missing:#?}");
    }
}

/// The options that a help text lists, and the values that they can have.
fn options(program_name: &str) -> Vec<String> {
    let output = Command::new(program(program_name)).args(["cluster", "--help"]).output().expect("it runs");
    let text = String::from_utf8(output.stdout).expect("text");
    let listed = |line: &&str| line.starts_with('-') || line.starts_with("[possible values");
    text.lines().map(str::trim).filter(listed).map(str::to_owned).collect()
}

#[test]
fn rockfall_offers_the_options_of_a_cluster_that_dem_solver_takes() {
    let (own, takes) = (options("rockfall"), options("dem-solver"));
    assert!(takes.len() > 10 && takes.iter().any(|o| o.contains("--smallest-radius")), "{takes:?}");
    let sorted = |mut all: Vec<String>| {
        all.sort();
        all
    };
    assert_eq!(sorted(own), sorted(takes));
}
