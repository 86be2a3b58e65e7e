//! Bad input: one message with file, line and column, the numbers, what to try; exit code 2; nothing started.

use tests::{Bench, scene};

fn refused(name: &str, change: impl Fn(String) -> String, sets: &[&str], words: &[&str]) {
    let bench = Bench::new();
    let path = bench.scene(&change(std::fs::read_to_string(scene(name)).unwrap()));
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let ended = bench.run(&path, "out", &sets);
    assert_eq!(ended.code, Some(2), "{words:?}: {}", ended.stderr);
    for word in words {
        assert!(ended.stderr.contains(word), "\"{word}\" is not in: {}", ended.stderr);
    }
    assert_eq!(ended.stderr.matches("error:").count(), 1, "one message: {}", ended.stderr);
    assert!(
        !ended.out.join("history.csv").exists() && !ended.out.join("summary.json").exists(),
        "nothing started"
    );
}

fn replaced(from: &'static str, to: &'static str) -> impl Fn(String) -> String {
    move |text| {
        assert!(text.contains(from), "{from} is in the scene");
        text.replacen(from, to, 1)
    }
}

const NET: &str = "walenstadt-compare";

#[test]
fn unknown_keys_tables_and_values_are_named_with_the_nearest_known_one() {
    refused(NET, replaced("poisson =", "poison ="), &[], &["scene.toml:", "poison", "poisson"]);
    refused(NET, replaced("[dem]", "[dme]"), &[], &["scene.toml:", "dme", "dem"]);
    refused(NET, replaced("\"weak\"", "\"week\""), &[], &["scene.toml:", "week", "weak"]);
    refused(NET, replaced("law = \"hertz_mindlin\"", "law = \"herz\""), &[], &["herz", "hertz_mindlin"]);
    refused(NET, replaced("\"central_difference\"", "\"central\""), &[], &["central", "central_difference"]);
    refused(NET, |t| t + "\n[coupling.acceleration]\ntype = \"aitkin\"\n", &[], &["aitkin", "aitken"]);
}

#[test]
fn wrong_types_missing_files_and_senseless_numbers_are_refused_where_they_stand() {
    refused(NET, replaced("mass = 180.0", "mass = \"heavy\""), &[], &["scene.toml:", "heavy"]);
    refused(NET, replaced("mass = 180.0", "mass = -180.0"), &[], &["scene.toml:", "-180", "mass"]);
    refused(NET, replaced("mass = 180.0", "mass = nan"), &[], &["scene.toml:", "mass"]);
    refused(NET, replaced("time_window = 5e-5", "time_window = 0.0"), &[], &["scene.toml:", "time_window"]);
    refused(NET, |t| t, &["coupling.predictor=2"], &["predictor 2 does not exist"]);
    refused(NET, |t| t, &["rock.7.mass=1"], &["rock"]);
    let bench = Bench::new();
    let ended = bench.run(&bench.path("no-such.toml"), "out", &[]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("no-such.toml"), "{}", ended.stderr);
}

#[test]
fn a_node_that_nothing_holds_and_a_step_above_the_critical_one_are_refused_with_the_numbers() {
    let lonely = replaced("nodes = [[-1.0, 0.0, 0.0],", "nodes = [[5.0, 5.0, 5.0], [-1.0, 0.0, 0.0],");
    let lonely =
        move |text: String| lonely(text).replace("[0, 1] }, { nodes = [1, 2]", "[1, 2] }, { nodes = [2, 3]");
    let lonely = move |text: String| {
        lonely(text)
            .replace("nodes = [1], mass", "nodes = [2], mass")
            .replace("nodes = [0, 2] }]", "nodes = [1, 3] }]")
    };
    refused("sphere-on-cable", lonely, &[], &["node 0", "no element"]);
    let words = ["fem.time_step", "0.0002", "critical"];
    refused(NET, |t| t, &["fem.time_step=3e-4", "coupling.time_window=3e-4"], &words[..1]);
    refused(NET, |t| t, &["dem.time_step=1e-2", "coupling.time_window=1e-2"], &["dem.time_step"]);
}

#[test]
fn a_program_that_is_not_there_is_named_and_nothing_is_started() {
    refused(NET, |t| t + "\n[processes]\nfem = \"no-such-solver --fast\"\n", &[], &["no-such-solver"]);
    refused(NET, |t| t + "\n[processes]\ndem = \"./no/such\"\n", &[], &["no/such"]);
}

#[test]
fn a_directory_that_holds_a_run_is_refused_unless_forced() {
    let bench = Bench::new();
    let first = bench.done(&scene("free-fall"), "out", &[]);
    let before = first.history();
    let again = bench.run(&scene("free-fall"), "out", &[]);
    assert_eq!(again.code, Some(2));
    assert!(again.stderr.contains("--force"), "{}", again.stderr);
    assert_eq!(again.history(), before);
    assert_eq!(bench.run(&scene("free-fall"), "out", &["--force"]).code, Some(0));
}

#[test]
fn the_written_scene_runs_again_as_it_is() {
    let bench = Bench::new();
    let first = bench.done(&scene("sphere-on-plate-spring"), "first", &["--set", "end_time=0.01"]);
    let second = bench.done(&bench.path("first/scene.toml"), "second", &[]);
    assert!(first.history() == second.history());
}
