//! A run that starts from the end of another: a second impact on what the first has left behind.

use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;
use tests::{Bench, Ended, rows, until};

/// A sphere of 60 kg falls into a trampoline: an elastic net of 1.5 m between four brakes of `force` [N].
fn trampoline(force: f64) -> String {
    // Nodes row by row, five by five; then the anchors of the corners.
    let at = |i: usize| 0.375 * i as f64;
    let mut nodes: Vec<String> =
        (0..25).map(|n| format!("[{:?}, {:?}, 0.0]", at(n % 5), at(n / 5))).collect();
    nodes.extend(
        ["[-0.5, -0.5, 0.0]", "[2.0, -0.5, 0.0]", "[-0.5, 2.0, 0.0]", "[2.0, 2.0, 0.0]"].map(String::from),
    );
    let across = (0..25).filter(|n| n % 5 < 4).map(|n| format!("{{ nodes = [{n}, {}] }}", n + 1));
    let up = (0..20).map(|n| format!("{{ nodes = [{n}, {}] }}", n + 5));
    let cables: Vec<String> = across.chain(up).collect();
    format!(
        r#"
end_time = 0.3
gravity = [0.0, 0.0, -9.81]

[[rock]]
name = "ball"
position = [0.75, 0.75, 0.16]
velocity = [0.0, 0.0, -5.0]
mass = 60.0
shape = {{ type = "sphere", radius = 0.15 }}

[[contact]]
law = "linear"
stiffness = 1e6
restitution = 1.0

[structure]
nodes = [{}]
cables = [{}]
supports = [{{ nodes = [25, 26, 27, 28] }}]
damping = 2.0

[structure.cable]
young = 1e9
area = 2e-5
density = 7850.0
prestress = 1e6
radius = 0.002

[[structure.parts]]
name = "brakes"
element = "brake"
cells = [[25, 0], [26, 4], [27, 20], [28, 24]]
stiffness = 1e6
curve = [[0.01, {force:?}], [1.0, {:?}]]
stroke = 1.0
mass = 1.0

[[gauge]]
name = "brakes"
group = "brakes"
quantity = "elongation"

[[gauge]]
name = "middle"
at = [0.75, 0.75, 0.0]
quantity = "displacement"

[fem]
integrator = "central_difference"
time_step = 5e-5

[coupling]
scheme = "weak"
time_window = 5e-5
"#,
        nodes.join(", "),
        cables.join(", "),
        1.2 * force
    )
}

fn start_from(ended: &Ended) -> String {
    format!("start_from={}", ended.out.display())
}

fn refused(bench: &Bench, scene: &Path, out: &str, arguments: &[&str], what: &str) {
    let ended = bench.run(scene, out, arguments);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains(what), "{}", ended.stderr);
}

#[test]
fn a_second_impact_starts_with_what_the_first_has_used_up() {
    let bench = Bench::new();
    let scene = bench.scene(&trampoline(1e3));
    let first = bench.done(&scene, "first", &[]);
    let second = bench.done(&scene, "second", &["--set", &start_from(&first)]);
    let third = bench.done(&scene, "third", &["--set", &start_from(&second)]);
    let of = |ended: &Ended, column: &str| {
        let all = ended.column(column);
        (all[0], all[all.len() - 1])
    };
    let mut used = 0.0;
    for (ended, name) in [(&first, "first"), (&second, "second"), (&third, "third")] {
        let (before, after) = of(ended, "brakes_elongation_max_m");
        // The weight of the net alone stretches a brake by a fraction of a millimetre, its force by 1 mm.
        assert!((before - used).abs() < 3e-3, "{name}: {before} m, {used} m were used up");
        assert!(after > used + 0.02, "{name}: {after} m after {used} m");
        assert!(ended.measure("energy_error") < 5e-3, "{name}: {}", ended.measure("energy_error"));
        assert!(ended.measure("impact_speed") > 4.9, "{name}");
        used = after;
    }
    // What has been used up does no work a second time: the books of each run are its own.
    for (ended, name) in [(&second, "second"), (&third, "third")] {
        assert_eq!(of(ended, "energy_dissipated_fem_J").0, 0.0, "{name}");
        assert_eq!(of(ended, "energy_received_fem_J").0, 0.0, "{name}");
    }
    // The resolved scene runs again as it is, and the file that it starts from is among its inputs.
    let resolved = std::fs::read_to_string(second.out.join("scene.toml")).expect("written");
    assert!(resolved.contains("[start_from]") && resolved.contains("at = \"rest\""), "{resolved}");
    let record = std::fs::read_to_string(second.out.join("run.json")).expect("written");
    assert!(record.contains("first/structure.state\": \"fnv1a64:"), "{record}");
    let again = bench.done(&second.out.join("scene.toml"), "again", &[]);
    assert_eq!(again.history(), second.history());
}

#[test]
fn what_is_elastic_gives_the_answer_of_the_first_impact_again() {
    let bench = Bench::new();
    // Brakes that never give way.
    let text = trampoline(1e3).replace("curve = [[0.01, 1000.0], [1.0, 1200.0]]\nstroke = 1.0\n", "");
    assert!(!text.contains("curve"));
    let scene = bench.scene(&text);
    let first = bench.done(&scene, "first", &[]);
    let second = bench.done(&scene, "second", &["--set", &start_from(&first)]);
    for measure in [
        "max_deflection",
        "max_reaction",
        "max_reaction_1ms",
        "max_cable_force",
        "braking_time",
        "middle_uz_min",
    ] {
        let (a, b) = (first.measure(measure), second.measure(measure));
        assert!((b / a - 1.0).abs() < 1e-6, "{measure}: {a} {b}");
    }
}

#[test]
fn a_run_that_is_killed_or_interrupted_leaves_no_state() {
    for signal in [Signal::KILL, Signal::TERM] {
        let bench = Bench::new();
        let scene = bench.scene(&trampoline(1e3));
        let child = bench.rockfall(&scene, "out", &["--set", "end_time=1000"]).spawn().expect("started");
        let out = bench.path("out");
        until("rows are written", || (rows(&out) > 50).then_some(()));
        let pid = Pid::from_raw(child.id() as i32).expect("a process");
        kill_process(pid, signal).expect("there");
        let ended = tests::wait(child, out.clone());
        assert_ne!(ended.code, Some(0));
        let word = bench.path("").display().to_string();
        until("every process ends", || tests::processes_with(&word).is_empty().then_some(()));
        let left: Vec<_> =
            std::fs::read_dir(&out).expect("there").map(|e| e.expect("an entry").file_name()).collect();
        assert!(!left.iter().any(|name| name.to_string_lossy().contains("state")), "{left:?}");
        refused(&bench, &scene, "next", &["--set", &start_from(&ended)], "come to its end");
        assert!(!bench.path("next").exists());
    }
}

#[test]
fn what_cannot_be_started_from_is_refused_and_nothing_is_lost() {
    let bench = Bench::new();
    let scene = bench.scene(&trampoline(1e3));
    let first = bench.done(&scene, "first", &["--set", "end_time=0.01"]);
    let own = start_from(&first);
    refused(&bench, &scene, "first", &["--force", "--set", &own], "its own directory of results");
    assert!(first.out.join("structure.state").exists() && first.out.join("history.csv").exists());
    refused(&bench, &scene, "next", &["--set", "start_from=nowhere"], "there is no directory");
    let other = bench.path("other.toml");
    std::fs::write(&other, trampoline(2e3)).expect("written");
    refused(&bench, &other, "next", &["--set", &own], "strength of the part `brakes` is another");
    let rock = bench.path("rock.toml");
    std::fs::write(&rock, "end_time = 0.1\n[[rock]]\nname = \"a\"\nposition = [0.0, 0.0, 0.0]\nmass = 1.0\nshape = { type = \"sphere\", radius = 0.1 }\n")
        .expect("written");
    refused(&bench, &rock, "next", &["--set", &own], "nothing will use `start_from`");
    // One of rocks alone leaves no state.
    let alone = bench.done(&rock, "alone", &[]);
    refused(&bench, &scene, "next", &["--set", &start_from(&alone)], "has left no state of a structure");
    assert!(!bench.path("next").exists());
}
