//! A foreign solver in the place of one of ours: by one line of the scene, and by `run.sh`.

use std::process::{Command, Stdio};
use tests::{Bench, Ended, example, program, repository, scene, until};

const SPHERE: &str = r#"
end_time = 0.02
gravity = [0.0, 0.0, -9.81]
[[rock]]
position = [0.0, 0.0, 0.1]
velocity = [0.0, 0.0, -3.13209195]
density = 2500.0
shape = { type = "sphere", radius = 0.1 }
[[contact]]
law = "hertz_mindlin"
young = 1e9
poisson = 0.25
restitution = 1.0
[dem]
time_step = 1e-5
[coupling]
scheme = "weak"
time_window = 1e-5
"#;

fn on_oscillator(bench: &Bench) -> std::path::PathBuf {
    bench.scene(&format!("{SPHERE}\n[processes]\nfem = \"{}\"\n", example("oscillator").display()))
}

/// V-C3 at t = 0.01 s: the plate has gone down 16.97 mm, to the step's error (order 2, 1e-5 s of a
/// contact of 2 ms).
fn looks_like_v_c3(ended: &Ended) {
    let (time, u) = (ended.column("time_s"), ended.column("oscillator_uz_m"));
    let at = time.iter().position(|t| (t - 0.01).abs() < 1e-9).expect("a row at 0.01 s");
    // V-C3's sphere has gravity, and so has its plate: but that one is at rest in its own equilibrium.
    assert!((u[at] + 0.0169657067).abs() < 2e-5, "{}", u[at]);
}

#[test]
fn an_oscillator_takes_the_place_of_the_structure_by_one_line() {
    let bench = Bench::new();
    let ended = bench.done(&on_oscillator(&bench), "out", &[]);
    looks_like_v_c3(&ended);
    let summary = ended.summary();
    let warnings = ended.warnings();
    assert!(warnings.iter().any(|w| w.contains("energy_error is absent")), "{warnings:?}");
    assert!(summary["measures"]["energy_error"].is_null());
    assert!(ended.measure("oscillator_uz_min") < -0.016);
}

#[test]
fn a_solver_of_ones_own_has_fewer_than_60_lines() {
    let lines = include_str!("../../interface-defs/examples/oscillator.rs").lines().count();
    assert!(lines < 60, "{lines}");
}

#[test]
fn three_processes_started_by_hand_do_the_same() {
    let bench = Bench::new();
    let scene = on_oscillator(&bench);
    let run = format!("hand-{}", std::process::id());
    let out = bench.path("out");
    let start = |program: std::path::PathBuf, words: &[&str]| {
        let mut command = Command::new(program);
        command.args(words).arg(&scene).args(["--run", &run]).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    };
    // The solvers first, to show that the order does not matter.
    let fem = start(example("oscillator"), &["serve"]).args(["--as", "fem"]).spawn().unwrap();
    let dem = start(program("dem-solver"), &["serve"]).arg("--out").arg(&out).spawn().unwrap();
    let coupler = start(program("coupler"), &["run"]).arg("--out").arg(&out).spawn().unwrap();
    let coupler = tests::wait(coupler, out);
    assert_eq!(coupler.code, Some(0), "{}", coupler.stderr);
    looks_like_v_c3(&coupler);
    for child in [fem, dem] {
        assert_eq!(tests::wait(child, bench.path("out")).code, Some(0));
    }
    assert!(until("shared memory is empty", || tests::shared_memory_of(&run).is_empty().then_some(true)));
}

#[test]
fn run_sh_starts_all_three_and_returns_the_couplers_exit_code() {
    let bench = Bench::new();
    let run = |scene: &std::path::Path, id: &str| {
        let mut command = Command::new(repository().join("launch/run.sh"));
        command.arg(scene).arg(id).current_dir(bench.path(""));
        command.env("ROCKFALL_BIN", program("rockfall").parent().unwrap());
        command.output().unwrap()
    };
    let id = format!("sh-{}", std::process::id());
    let output = run(&scene("sphere-on-plate-spring"), &id);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(bench.path("out/sphere-on-plate-spring/summary.json").exists());
    let bad = bench.scene("end_time = -1.0\n");
    assert_eq!(run(&bad, &id).status.code(), Some(2));
}

#[test]
fn a_weight_takes_the_place_of_the_contact_solver_by_one_line() {
    let bench = Bench::new();
    let text = std::fs::read_to_string(scene("sphere-on-cable")).unwrap();
    let (before, after) = (text.find("[[rock]]").unwrap(), text.find("[structure]").unwrap());
    let text = format!("{}{}", &text[..before], &text[after..]).replace("[dem]\ntime_step = 1e-5\n", "");
    let scene = bench.scene(&format!("{text}\n[processes]\ndem = \"{}\"\n", example("weight").display()));
    let ended = bench.done(&scene, "out", &["--set", "end_time=0.01"]);
    // 0.5 N pull the middle node of 0.1 kg down: 5 m/s2 against a cable of 2 N0/L = 2000 N/m.
    let lowest = ended.measure("centre_uz_min");
    assert!(lowest < -1e-4 && lowest > -6e-4, "{lowest}");
}
