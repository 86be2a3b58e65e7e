//! A foreign solver in the place of one of ours: by one line of the scene, and by `run.sh`.

use std::process::{Command, Stdio};
use tests::{Bench, Ended, example, program, repository, scene, until, word};

fn on_oscillator(bench: &Bench) -> std::path::PathBuf {
    bench.sphere_on(&word(example("oscillator")), "weak", 0.0)
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
fn the_interface_of_a_foreign_structure_is_written_for_paraview() {
    let bench = Bench::new();
    let scene = on_oscillator(&bench);
    let ended = bench.done(&scene, "out", &["--set", "output.fields=0.002"]);
    let list = std::fs::read_to_string(ended.out.join("fields/interface.pvd")).expect("the series");
    // Every 2 ms of 20 ms.
    assert!((10..=11).contains(&list.matches("interface_").count()), "{list}");
    let last = std::fs::read_to_string(ended.out.join("fields/interface_000010.vtu"));
    let text = last.unwrap_or_else(|e| e.to_string());
    for field in ["displacement", "velocity", "contact_force", "residual"] {
        assert!(
            text.contains(&format!("Name=\"{field}\"")),
            "{field}: {}",
            text.lines().take(20).collect::<String>()
        );
    }
    // Fields that nobody asks for are not there, nor those of a structure that writes its own.
    assert!(!bench.done(&scene, "none", &[]).out.join("fields").exists());
    let own = bench.done(&tests::scene("sphere-on-plate-spring"), "own", &["--set", "output.fields=0.005"]);
    assert!(!own.out.join("fields/interface.pvd").exists());
}

#[test]
fn a_solver_of_ones_own_has_fewer_than_60_lines() {
    let lines = include_str!("../../../interface-defs/examples/oscillator.rs").lines().count();
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
fn run_sh_starts_what_the_scene_names_and_returns_the_leaders_exit_code() {
    let bench = Bench::new();
    let run = |scene: &std::path::Path, words: &[&str]| {
        let mut command = Command::new(repository().join("launch/run.sh"));
        command.arg(scene).args(words).current_dir(bench.path(""));
        command.env("ROCKFALL_BIN", program("rockfall").parent().unwrap());
        Ended::of(command.output().unwrap(), bench.path("out of/it"))
    };
    let id = format!("sh-{}", std::process::id());
    let scene_with_oscillator = on_oscillator(&bench);
    let ended = run(&scene_with_oscillator, &[&id, "--out", "out of/it", "--set", "output.interval=5e-4"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    looks_like_v_c3(&ended);
    let read = std::fs::read_to_string(bench.path("out of/it/scene.toml")).unwrap();
    assert!(read.contains("interval = 0.0005"), "{read}");
    // The same bytes as under supervision, and without a run id.
    let supervised = bench.done(&scene_with_oscillator, "out", &["--set", "output.interval=5e-4"]);
    assert_eq!(ended.history(), supervised.history());
    let again = run(&scene_with_oscillator, &["--out", "out of/it", "--force"]);
    assert_eq!(again.code, Some(0), "{}", again.stderr);
    let alone = run(&scene("free-fall"), &["--out", "out of/it", "--force", "--set", "end_time=0.1"]);
    assert_eq!(alone.code, Some(0), "a scene of one program: {}", alone.stderr);
    assert_eq!(run(&bench.scene("end_time = -1.0\n"), &[&id]).code, Some(2));
}

#[test]
fn a_weight_takes_the_place_of_the_contact_solver_by_one_line() {
    let bench = Bench::new();
    let text = std::fs::read_to_string(scene("sphere-on-cable")).unwrap();
    let (before, after) = (text.find("[[rock]]").unwrap(), text.find("[structure]").unwrap());
    let text = format!("{}{}", &text[..before], &text[after..]).replace("[dem]\ntime_step = 1e-5\n", "");
    let scene = bench.scene(&format!("{text}\n[processes]\ndem = \"{}\"\n", word(example("weight"))));
    let ended = bench.done(&scene, "out", &["--set", "end_time=0.01"]);
    // 0.5 N pull the middle node of 0.1 kg down: 5 m/s2 against a cable of 2 N0/L = 2000 N/m.
    let lowest = ended.measure("centre_uz_min");
    assert!(lowest < -1e-4 && lowest > -6e-4, "{lowest}");
}
