//! What a study would compute, without a file of it; what is not a study is named.

use super::*;
use dem_solver::check::check_with;
use serde_json::Value;
use std::time::Duration;
use toolkit::scene::Scene;

#[test]
fn a_study_is_checked_and_nothing_is_written() {
    let place = Place::new(&(STUDY.to_owned() + "[line.barrier]\nenergy = 1e5\nheight = 3.0\n"));
    let output = place.run("out", &["--dry-run"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for words in [
        "20, latin_hypercube, seed 3, replicates 1",
        "release `cliff`              14 in 95 m2, on the ground",
        "release `release_2`          6 at 2 points, 2 m above it",
        "speed                      0.5 to 4",
        "dem.steps_per_contact      2 values from 40 to 45",
        "line `road`                  30 m, a barrier of 100 kJ, 3 m high",
        "30 x 20 cells of 2 m",
        "s a member, as 8 of them took",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let output = place.run("out", &["--dry-run", "--format", "json"]);
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&found["members"], &found["members_tried"]), (&20.into(), &8.into()));
    assert!(found["expected_cost_s"].as_f64().is_some_and(|cost| cost > 0.0), "{found}");
    assert!(found["lines"][0]["length_m"] == 30.0 && found["releases"][1]["members"] == 6, "{found}");
    let wrong = place.run("out", &["--dry-run", "--format", "json", "--set", "line.0.barrier.energy=3"]);
    let said: Value = serde_json::from_slice(&wrong.stdout).expect("JSON");
    assert!(wrong.status.code() == Some(2) && said["errors"][0]["message"].is_string(), "{said}");
    assert!(!place.path("out").exists());
}

#[test]
fn what_is_no_study_and_what_belongs_into_its_scene_is_named() {
    let place = Place::new(STUDY);
    let said = |output: Output| {
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for set in ["scene.contact.0.friction=0.5", "contact.0.friction=0.5"] {
        let said = said(place.run("out", &["--set", set]));
        assert!(said.contains("a key of the scene, not of the study"), "{said}");
        assert!(said.contains("--set vary.contact.0.friction=0.5"), "{said}");
    }
    let done = place.run("out", &["--dry-run", "--set", "vary.contact.0.friction=0.5"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    place.write("study.toml", SCENE);
    let scene = said(place.run("no", &[]));
    assert!(scene.contains("this is a scene, and a study is asked for here"), "{scene}");
    let mut calibrate = Command::new(env!("CARGO_BIN_EXE_dem-solver"));
    let scene = said(calibrate.arg("calibrate").arg(place.path("study.toml")).output().expect("started"));
    assert!(scene.contains("this is a scene, and a calibration is asked for here"), "{scene}");
}

/// A fall that is tried to its end is known; one that is cut is as if the rock moved until `end_time`.
#[test]
fn the_cost_of_a_fall_is_tried() {
    let place = Place::new(STUDY);
    let scene = Scene::load(&place.path("fall.toml"), &[]).unwrap_or_else(|e| panic!("{e}"));
    let of = |limit: Option<u64>| {
        let report =
            check_with(&scene, None, limit.map(Duration::from_secs)).unwrap_or_else(|e| panic!("{e}"));
        ["ends_s", "tried_s", "run_s"].map(|name| report.numbers.get(name).copied())
    };
    assert_eq!(of(None), [None; 3]);
    let [ends, tried, run] = of(Some(600));
    assert!(ends == tried && ends.is_some_and(|ends| (1.0..20.0).contains(&ends)), "{ends:?} {tried:?}");
    assert!(run.is_some_and(|run| run > 0.0));
    let [cut, tried, run] = of(Some(0));
    assert!(cut.is_none() && tried.is_some_and(|tried| tried > 0.0) && tried < ends, "{cut:?} {tried:?}");
    assert!(run.is_some_and(|run| run > 0.0));
}

/// What no one can mean is refused, what is unusual is said with its numbers.
#[test]
fn starts_cells_and_heights_that_are_hardly_meant_are_named() {
    let place = Place::new(STUDY);
    let checked = |sets: &[&str]| {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let output = place.run("out", &std::iter::once("--dry-run").chain(sets).collect::<Vec<_>>());
        let text = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        (output.status.code(), text.concat())
    };
    for (set, code, words) in [
        ("release.1.height=200", 0, "200 m above the ground is a start in free fall from there"),
        ("release.1.height=2000", 2, "it must be 0 to 1000 m"),
        ("vary.height={ uniform = [0.0, 1500.0] }", 2, "not from sea level"),
        ("maps.cell=20", 0, "cells of 20 m, and the terrain is 60 m x 40 m large"),
        ("maps.cell=1000", 2, "it would be one"),
    ] {
        let (found, said) = checked(&[set]);
        assert!(found == Some(code) && said.contains(words), "{set}: {found:?} {said}");
    }
    let (_, said) = checked(&[]);
    assert!(!said.contains("warning: "), "{said}");
    let slope = std::fs::read_to_string(place.path("slope.asc")).expect("read");
    let (head, heights) = slope.split_at(slope.find("\n1").expect("heights"));
    let whole = heights.split('\n').map(|row| {
        let all = row.split_whitespace().map(|z| format!("{:.0}", z.parse::<f64>().expect("a height")));
        all.collect::<Vec<_>>().join(" ")
    });
    place.write("slope.asc", &(head.to_owned() + &whole.collect::<Vec<_>>().join("\n") + "\n"));
    let (found, said) = checked(&[]);
    assert!(found == Some(0) && said.contains("heights of the terrain are whole metres"), "{said}");
}
