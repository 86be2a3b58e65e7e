//! One scene, one machine, the same bytes: twice, side by side, and without processes at all.

use coupler::coupling::Coupling;
use coupler::records::Records;
use in_process::{Any, InProcess};
use std::path::Path;
use tests::{Bench, scene};
use toolkit::limits::Limits;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// Contact with friction and slip, halved windows, strong coupling: all that has a history.
const SCENES: [(&str, &[&str]); 3] = [
    ("walenstadt-exp1", &["end_time=0.68", "dem.time_step=2e-5"]),
    ("walenstadt-exp1", &["end_time=0.66", "coupling.scheme=strong", "coupling.time_window=2e-4"]),
    (
        "cable-net",
        &[
            "end_time=0.05",
            "coupling.scheme=strong",
            "coupling.time_window=5e-4",
            "coupling.max_iterations=8",
        ],
    ),
];

fn arguments<'a>(sets: &[&'a str]) -> Vec<&'a str> {
    sets.iter().flat_map(|set| ["--set", set]).collect()
}

fn in_process(path: &Path, sets: &[&str], out: &Path) {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let scene = Scene::load(path, &sets).unwrap();
    let options = Options { out: None, shortcuts: true };
    let dem = (dem_solver::PROGRAM.build)(&scene, &options).unwrap();
    let fem = (fem_solver::PROGRAM.build)(&scene, &options).unwrap();
    let (mut dem, mut fem) = (InProcess::new("dem", Any(dem)), InProcess::new("fem", Any(fem)));
    let settings = coupler::settings::CouplingSettings::of(&scene).unwrap();
    let end = scene.end_time().unwrap();
    let output = toolkit::output::Output::of(&scene).unwrap();
    std::fs::create_dir_all(out).unwrap();
    let mut records = Records::new(out, end, &output, None);
    let mut coupling = Coupling::new(settings, end, &mut dem, &mut fem);
    coupling.limits = Limits::of(&scene).unwrap();
    coupling.run(&mut records, &mut |_| Ok(())).unwrap();
    coupling.finish().unwrap();
}

#[test]
fn three_processes_and_one_give_equal_histories() {
    for (name, sets) in SCENES {
        let bench = Bench::new();
        let three = bench.done(&scene(name), "three", &arguments(sets));
        in_process(&scene(name), sets, &bench.path("one"));
        let one = std::fs::read_to_string(bench.path("one/history.csv")).unwrap();
        assert!(three.rows() > 10);
        assert!(one == three.history(), "{name} {sets:?}");
    }
}

#[test]
fn two_runs_one_after_the_other_and_two_at_once_give_equal_bytes() {
    let (name, sets) = SCENES[0];
    let bench = Bench::new();
    let first = bench.done(&scene(name), "first", &arguments(sets));
    let spawn = |out: &str| bench.rockfall(&scene(name), out, &arguments(sets)).spawn().unwrap();
    let (second, third) = (spawn("second"), spawn("third"));
    for (child, out) in [(second, "second"), (third, "third")] {
        let ended = tests::wait(child, bench.path(out));
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        assert!(ended.history() == first.history());
    }
}

/// The record of a run is a scene that runs again as it is: from another directory, with every default filled in.
#[test]
fn a_resolved_scene_run_again_from_elsewhere_gives_equal_bytes() {
    for (name, sets) in [
        ("slope-cube", &[][..]),
        ("settling-box", &["end_time=0.01"]),
        ("walenstadt-compare", &["end_time=0.66"]),
        ("cable-net", &["end_time=0.02"]),
    ] {
        let bench = Bench::new();
        let first = bench.done(&scene(name), "first", &arguments(sets));
        let again = bench.done(&first.out.join("scene.toml"), "again", &[]);
        for file in ["history.csv", "trajectory.csv"] {
            let read = |out: &Path| std::fs::read(out.join(file)).unwrap_or_default();
            assert!(read(&first.out) == read(&again.out), "{name}: {file}");
        }
        let scene = |out: &Path| std::fs::read_to_string(out.join("scene.toml")).unwrap();
        let (one, two) = (scene(&first.out), scene(&again.out));
        assert_eq!(one.lines().skip(1).collect::<Vec<_>>(), two.lines().skip(1).collect::<Vec<_>>());
    }
}

#[test]
fn shortcuts_change_nothing_that_counts() {
    let (name, sets) = SCENES[0];
    let bench = Bench::new();
    let with = bench.done(&scene(name), "with", &arguments(sets));
    let mut words = arguments(sets);
    words.push("--no-shortcuts");
    let without = bench.done(&scene(name), "without", &words);
    let skipped = |ended: &tests::Ended| {
        let counts = ended.summary()["cost"]["processes"].to_string();
        assert!(counts.contains("skipped_windows") && counts.contains("flight_windows"), "{counts}");
        ended.summary()["cost"]["processes"]["dem"]["counts"]["flight_windows"].as_u64().unwrap()
    };
    assert!(skipped(&with) > 0);
    assert_eq!(skipped(&without), 0);
    // Flight in closed form rounds once where stepping rounds thousands of times; in contact the
    // difference of 1e-13 m grows with the motion, not with an instability.
    for column in ["rock_z_m", "centre_uz_m"] {
        let (a, b) = (with.column(column), without.column(column));
        assert_eq!(a.len(), b.len());
        let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-8, "{column}: {worst:e} m");
    }
}
