//! A scene that names no scheme, window, tolerance or step is computed right, at about the cost of the best settings known.

use std::path::{Path, PathBuf};
use tests::manual::holds;
use tests::{Bench, Ended, scene};

/// A scene of the project without its tables `[coupling]`, `[dem]` and `[fem]`, in the directory of `bench`.
fn open(bench: &Bench, name: &str) -> PathBuf {
    let text = std::fs::read_to_string(scene(name)).expect("a scene");
    let mut taken = true;
    let kept = text.lines().filter(|line| {
        if line.starts_with('[') {
            taken = !["[coupling]", "[dem]", "[fem]", "[output]"].iter().any(|table| line.starts_with(table));
        }
        taken
    });
    bench.scene(&kept.map(|line| format!("{line}\n")).collect::<String>())
}

fn run(bench: &Bench, scene: &Path, sets: &[&str]) -> Ended {
    let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", *set]).chain(["--force"]).collect();
    bench.done(scene, "out", &words)
}

/// Solver calls and steps weighed by what they cost on one core of 2.5 GHz [us]: two exchanges with `processes.wait = "event"`, a
/// step of the contact solver, a step of the structure. Measured on the three scenes: 56 to 96, 2.4 to 6.1, 5.5 to 10.7.
fn cost(ended: &Ended, fem_step: f64) -> f64 {
    let summary = ended.summary();
    let cost = &summary["cost"];
    let steps = |side: &str| cost["processes"][side]["counts"]["sub_steps"].as_f64().expect("counted");
    let passes = summary["coupling"]["iterations"].as_f64().expect("counted");
    70.0 * passes + 4.0 * steps("dem") + fem_step * steps("fem")
}

/// Largest deviation of the two measures by which settings are judged.
fn deviation(ended: &Ended, exact: &Ended, measures: [&str; 2]) -> f64 {
    measures.iter().map(|m| (ended.measure(m) / exact.measure(m) - 1.0).abs()).fold(0.0, f64::max)
}

/// The defaults alone beside the converged answer and the best settings known.
fn compare(name: &str, common: &[&str], converged: &[&str], best: &[&str], measures: [&str; 2]) {
    let bench = Bench::new();
    let all = |more: &[&str]| common.iter().chain(more).map(ToString::to_string).collect::<Vec<_>>();
    let run_with = |path: &Path, sets: Vec<String>| {
        run(&bench, path, &sets.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let open_scene = open(&bench, name);
    let chosen = run_with(&open_scene, all(&[]));
    let cheap = (chosen.measure(measures[0]), chosen.measure(measures[1]), cost(&chosen, 6.0));
    let resolved = std::fs::read_to_string(chosen.out.join("scene.toml")).expect("a resolved scene");
    assert!(resolved.contains("time_window = "), "{resolved}");
    let exact = run_with(&scene(name), all(converged));
    let off = [
        (cheap.0 / exact.measure(measures[0]) - 1.0).abs(),
        (cheap.1 / exact.measure(measures[1]) - 1.0).abs(),
    ];
    let best = run_with(&scene(name), all(best));
    let share = cheap.2 / cost(&best, 6.0);
    println!(
        "{name}: {} {:.6} and {} {:.0}, off by {off:.6?}; {share:.2} of the best known cost; best off by {:.4}",
        measures[0],
        cheap.0,
        measures[1],
        cheap.1,
        deviation(&best, &exact, measures)
    );
    assert!(off[0] < 0.01 && off[1] < 0.01, "{name}: off by {off:?}");
    holds(
        "docs/measured/defaults.md",
        &format!("| `{name}` | {{}} % | {{}} % | {{}} |"),
        &[100.0 * off[0], 100.0 * off[1], share],
    );
    assert!(share < 1.3, "{name}: {share} of the best known cost");
}

// The best settings known lie a little beyond the windows that are vouched for.
const DROP: [&str; 5] = [
    "limits.weak_window=2.0",
    "end_time=0.25",
    "rock.0.position=[0.0, 0.0, 0.155]",
    "rock.0.velocity=[0.0, 0.0, -6.26418391]",
    "processes.wait=event",
];

#[test]
#[ignore = "long"]
fn the_drop_test() {
    let weak = |window: &str| {
        [
            "coupling.scheme=weak".to_owned(),
            format!("coupling.time_window={window}"),
            format!("dem.time_step={window}"),
        ]
    };
    let (fine, best) = (weak("1e-5"), weak("1.2e-4"));
    let fine: Vec<&str> = fine.iter().map(String::as_str).chain(["fem.time_step=1e-5"]).collect();
    let best: Vec<&str> = best.iter().map(String::as_str).chain(["fem.time_step=1.2e-4"]).collect();
    compare("walenstadt-compare", &DROP, &fine, &best, ["max_deflection", "max_reaction_1ms"]);
}

#[test]
#[ignore = "long"]
fn the_drop_test_with_friction() {
    let weak = |window: &str| {
        [
            "coupling.scheme=weak".to_owned(),
            format!("coupling.time_window={window}"),
            format!("dem.time_step={window}"),
        ]
    };
    let (fine, best) = (weak("1e-5"), weak("1.2e-4"));
    let fine: Vec<&str> = fine.iter().map(String::as_str).chain(["fem.time_step=1e-5"]).collect();
    let best: Vec<&str> = best.iter().map(String::as_str).chain(["fem.time_step=1.2e-4"]).collect();
    let common: Vec<&str> = DROP.into_iter().chain(["output.fields=10.0"]).collect();
    compare("walenstadt-exp1", &common, &fine, &best, ["max_deflection", "max_reaction_1ms"]);
}

#[test]
#[ignore = "long"]
fn the_cable_net() {
    // The public case is that soft: the rock sinks into the wires. The selection is physics here, no step.
    let common = [
        "dem.contact_selection=nearest",
        "contact.0.effective_mass=local",
        "processes.wait=event",
        "limits.penetration=2.0",
    ];
    let fine = ["coupling.time_window=1e-5", "dem.time_step=1e-5", "fem.time_step=1e-5"];
    let best = ["coupling.time_window=1e-4", "dem.time_step=1e-4", "fem.time_step=1e-4"];
    compare("cable-net", &common, &fine, &best, ["centre_uz_min", "max_reaction_1ms"]);
}

#[test]
fn the_coupler_alone_says_who_chooses() {
    let bench = Bench::new();
    let path = open(&bench, "sphere-on-cable");
    let output = std::process::Command::new(tests::program("coupler"))
        .args(["run", path.to_str().expect("text"), "--run", "open-1", "--out"])
        .arg(bench.path("out"))
        .output()
        .expect("started");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("coupling.scheme is not named") && message.contains("--resolved"), "{message}");
    // What is written out is what the coupler takes.
    let file = bench.path("resolved.toml");
    let output = std::process::Command::new(tests::program("rockfall"))
        .args(["check", path.to_str().expect("text"), "--resolved"])
        .arg(&file)
        .output()
        .expect("started");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("coupling.time_window = "), "{printed}");
    let scene = toolkit::scene::Scene::load(&file, &[]).expect("a scene");
    let settings = coupler::settings::CouplingSettings::of(&scene).expect("named");
    assert!(settings.time_window > 0.0);
    let said = format!("coupling.time_window = {}", toolkit::numbers::short(settings.time_window));
    assert!(printed.contains(&said), "{said} is not in {printed}");
}

#[test]
fn what_cannot_be_computed_has_to_be_named() {
    let bench = Bench::new();
    let path = bench.scene("end_time = 1.0\n[processes]\ndem = \"sh\"\nfem = \"sh\"\n");
    let ended = bench.run(&path, "out", &[]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(
        ended.stderr.contains("scheme and time_window are not given and cannot be computed"),
        "{}",
        ended.stderr
    );
    assert!(ended.stderr.contains("add [coupling] with scheme"), "{}", ended.stderr);
    assert!(!bench.path("out").exists());
}
