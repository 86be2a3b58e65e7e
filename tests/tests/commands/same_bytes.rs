//! One scene, the same bytes: twice, side by side, without processes at all, and by each code path.

use coupler::coupling::Coupling;
use coupler::records::Records;
use in_process::{Any, InProcess};
use std::path::Path;
use std::process::{Command, Stdio};
use tests::{Bench, Ended, program, scene};
use toolkit::limits::Limits;
use toolkit::program::Options;
use toolkit::scene::Scene;
use toolkit::simd;

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

/// Result files of `rockfall COMMAND SCENE` by the code path `simd`.
fn by_path(bench: &Bench, simd: &str, command: &str, name: &str, sets: &[&str]) -> Vec<Vec<u8>> {
    let out = bench.path(&format!("{name}-{simd}"));
    let mut rockfall = Command::new(program("rockfall"));
    rockfall.arg(command).arg(scene(name)).arg("--quiet").arg("--out").arg(&out).args(arguments(sets));
    let output = rockfall.env(simd::VARIABLE, simd).stdin(Stdio::null()).output().expect("started");
    let ended = Ended::of(output, out);
    assert!(matches!(ended.code, Some(0 | 3)), "{name} {simd}: {}", ended.stderr);
    let record = std::fs::read_to_string(ended.out.join("run.json")).unwrap_or_default();
    assert!(command == "ensemble" || record.contains(&format!("\"simd\": \"{simd}\"")), "{record}");
    let files = ["history.csv", "trajectory.csv", "members.csv"];
    files.iter().map(|file| std::fs::read(ended.out.join(file)).unwrap_or_default()).collect()
}

/// Each of these commands gives the same bytes by every code path that this processor has.
fn equal_by_all_paths(runs: &[(&str, &str, &[&str])]) {
    let there = || simd::PATHS.iter().filter(|(path, _)| path.is_there()).map(|(_, name)| *name);
    for (command, name, sets) in runs {
        let bench = Bench::new();
        std::fs::create_dir_all(bench.path("studies")).expect("a directory");
        let found: Vec<_> = there().map(|path| by_path(&bench, path, command, name, sets)).collect();
        assert!(found[0].iter().any(|file| file.len() > 500), "{name}");
        for (path, files) in there().zip(&found) {
            assert!(files == &found[0], "{name} {sets:?}: {path} differs");
        }
    }
}

#[test]
fn every_code_path_gives_equal_bytes() {
    equal_by_all_paths(&[
        ("run", "cable-net", &["end_time=0.004", "coupling.scheme=strong", "coupling.time_window=5e-4"]),
        ("run", "slope-cube", &["end_time=3.0"]),
        ("ensemble", "studies/slope", &["release.0.count=4"]),
    ]);
}

/// Statics and rings, a net that yields, implicit steps with friction, terrain by nearest contact.
#[test]
#[ignore = "long"]
fn every_code_path_gives_equal_bytes_in_long_scenes() {
    equal_by_all_paths(&[
        ("run", "barrier-impact", &["end_time=0.05"]),
        ("run", "barrier-cables", &[]),
        (
            "run",
            "walenstadt-exp1",
            &["end_time=0.67", "coupling.yielding_net=true", "coupling.time_window=1e-3"],
        ),
        ("run", "walenstadt-exp1", &["end_time=0.67", "fem.integrator=generalized_alpha"]),
        ("run", "slope-cube", &["dem.contact_selection=nearest"]),
        ("ensemble", "studies/slope", &["release.0.count=60"]),
    ]);
}

#[test]
fn a_code_path_that_is_not_there_is_refused_by_every_program() {
    let bench = Bench::new();
    let scene = scene("free-fall").display().to_string();
    for (name, words) in [
        ("rockfall", ["run", &scene]),
        ("dem-solver", ["run", &scene]),
        ("fem-solver", ["run", &scene]),
        ("coupler", ["check", &scene]),
    ] {
        let mut command = Command::new(program(name));
        command.args(words).current_dir(bench.path("")).env(simd::VARIABLE, "avx1024").stdin(Stdio::null());
        let ended = Ended::of(command.output().expect("started"), bench.path("out"));
        assert_eq!(ended.code, Some(2), "{name}: {}", ended.stderr);
        for part in ["ROCKFALL_SIMD = avx1024: no such code path", "portable"] {
            assert!(ended.stderr.contains(part), "{name}: {}", ended.stderr);
        }
        assert!(!bench.path("out").exists(), "{name} has begun");
    }
}

/// The C library's elementary functions differ between versions and processors: no program asks for one.
#[test]
fn no_program_needs_the_mathematical_library_of_the_system() {
    for name in ["rockfall", "dem-solver", "fem-solver", "coupler"] {
        let bytes = std::fs::read(program(name)).expect("a program");
        assert!(!bytes.windows(7).any(|word| word == b"libm.so"), "{name}: see toolkit/src/elementary.rs");
    }
}
