//! `rockfall trade` with the real programs, on the smallest coupled scene.

use std::path::Path;
use std::process::{Command, Stdio};
use tests::{Bench, Ended, program, scene};

fn trade(bench: &Bench, out: &str, arguments: &[&str]) -> Ended {
    trade_of(&scene("sphere-on-cable"), bench, out, arguments)
}

fn trade_of(scene: &Path, bench: &Bench, out: &str, arguments: &[&str]) -> Ended {
    let mut command = Command::new(program("rockfall"));
    command.arg("trade").arg(scene).args(["--set", "end_time=0.02"]);
    command.arg("--out").arg(bench.path(out)).args(arguments).current_dir(bench.path(""));
    Ended::of(command.stdin(Stdio::null()).output().expect("started"), bench.path(out))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).expect("written")
}

/// Settings are recommended, hold when they are run by hand, and nothing is computed twice.
#[test]
#[ignore = "long"]
fn a_recommendation_holds_and_a_study_goes_on() {
    let bench = Bench::new();
    let first = trade(&bench, "study", &["--budget", "20s"]);
    assert_eq!(first.code, Some(0), "{}", first.stderr);
    let page = read(&first.out.join("trade.md"));
    let runs = read(&first.out.join("trade.csv")).lines().count() - 1;
    assert!(runs > 5 && std::fs::read_dir(first.out.join("runs")).expect("runs").count() == runs, "{page}");
    assert!(read(&first.out.join("trade.svg")).contains("<circle"));
    // The same recommendations and picture as one page.
    let report = read(&first.out.join("report.html"));
    let lines: Vec<&str> = page.lines().filter(|line| line.starts_with("rockfall run ")).collect();
    assert!(!lines.is_empty() && lines.iter().all(|line| report.contains(line)), "{report}");
    assert!(report.contains("<h2>Recommended</h2>") && report.contains("src=\"data:image/svg+xml;base64,"));
    assert!(
        read(&first.out.join("runs/002/scene.toml")).contains("time_window"),
        "resolved settings are kept"
    );

    // The line for 1 %, as a user would copy it, against the reference on the page.
    let line = page.lines().find(|line| line.starts_with("rockfall run ") && line.contains("--set coupling"));
    let words: Vec<&str> = line.expect("a line to copy").split(' ').skip(3).collect();
    let by_hand = bench.done(&scene("sphere-on-cable"), "by_hand", &words);
    let row = page.lines().find(|line| line.starts_with("| `max_deflection` ")).expect("a reference");
    let value = row.split('|').nth(3).and_then(|cell| cell.trim().strip_suffix(" m")).expect("a value");
    let reference: f64 = value.parse().expect("a number");
    let found = by_hand.summary()["measures"]["max_deflection"]["value"].as_f64().expect("a measure");
    assert!((found / reference - 1.0).abs() < 0.1, "{found} against {reference}");

    // The same command: all runs are there. Another scene: refused.
    let again = trade(&bench, "study", &["--budget", "5s"]);
    assert_eq!(again.code, Some(0), "{}", again.stderr);
    assert_eq!(read(&again.out.join("trade.csv")).lines().count() - 1, runs);
    let other = trade(&bench, "study", &["--set", "rock.0.mass=11.0"]);
    assert_eq!(other.code, Some(2), "{}", other.stderr);
    assert!(
        other.stderr.contains("of another scene") && other.stderr.contains("--force"),
        "{}",
        other.stderr
    );
}

/// What `rockfall check` says of the longest weak window is never above what breaks, and within a factor of 4 of what holds: a run
/// is right beyond it as long as its measures are. What holds and what breaks are within the factor that is promised.
#[test]
#[ignore = "long"]
fn limits_that_are_found_are_those_of_theory() {
    let bench = Bench::new();
    let ended =
        trade(&bench, "atlas", &["--atlas", "--budget", "10m", "--set", "end_time=0.12", "--knob", "window"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let table = read(&ended.out.join("atlas.csv"));
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = table.lines().skip(1).map(cells).collect();
    let weak = rows.iter().find(|row| row[0] == "window" && row[1] == "the scene as it is").expect("pushed");
    let number = |at: usize| weak[at].parse::<f64>().unwrap_or_else(|_| panic!("{weak:?}"));
    let (theory, holds, breaks) = (number(3), number(4), number(5));
    assert!(theory < breaks && holds < 4.0 * theory, "{weak:?}");
    assert!(holds < breaks && breaks < 1.11 * holds, "{weak:?}");
    // Both sides, by runs of their own, without the bound that only repeats what theory says.
    for (window, done) in [(0.9 * theory, true), (1.1 * breaks, false)] {
        let window = format!("coupling.time_window={window:e}");
        let sets = ["--set", &window, "--set", "limits.weak_window=1e9"];
        let ended = bench.run(&scene("sphere-on-cable"), &format!("by_hand_{done}"), &sets);
        assert_eq!(ended.code == Some(0), done, "{window}: {}", ended.stderr);
    }
}

/// The scene with nothing said of its coupling and its steps.
fn open(bench: &Bench) -> std::path::PathBuf {
    let text = read(&scene("sphere-on-cable"));
    let named = ["scheme", "time_window", "time_step"];
    let kept = text.lines().filter(|line| !named.iter().any(|key| line.starts_with(key)));
    bench.scene(&kept.map(|line| format!("{line}\n")).collect::<String>())
}

/// Where a scene leaves scheme and steps open, what was chosen for it stays while its window grows: else a window that weak
/// coupling does not bear would be computed strongly.
#[test]
fn nothing_but_the_knob_moves_in_a_push() {
    let bench = Bench::new();
    let words = ["--atlas", "--budget", "10m", "--set", "end_time=0.12", "--knob", "window"];
    let ended = trade_of(&open(&bench), &bench, "atlas", &words);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let computed = |run: std::path::PathBuf| {
        let kept: serde_json::Value = serde_json::from_str(&read(&run.join("task.json"))).expect("kept");
        let pushed = kept["run"]["purpose"] == "atlas";
        let moves = ["#", "time_window", "longest_weak_window"];
        let rest = |line: &&str| !moves.iter().any(|key| line.starts_with(key));
        pushed.then(|| {
            read(&run.join("scene.toml")).lines().filter(rest).map(str::to_owned).collect::<Vec<_>>()
        })
    };
    let runs = std::fs::read_dir(ended.out.join("runs")).expect("runs").map(|run| run.expect("a run").path());
    let all: Vec<_> = runs.filter_map(computed).collect();
    assert!(all.len() > 4, "{}", all.len());
    assert!(all.iter().all(|scene| *scene == all[0]), "{:?}", all[0]);
    assert!(all[0].iter().any(|line| line.starts_with("scheme = ")), "{:?}", all[0]);
}

/// Presets are among the first that are tried, with all that they set named, and the answer says what it knows nothing of.
#[test]
#[ignore = "long"]
fn presets_are_tried_and_what_is_not_varied_is_named() {
    let bench = Bench::new();
    let ended = trade_of(&open(&bench), &bench, "study", &["--budget", "10m", "--knob", "preset"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let table = read(&ended.out.join("trade.csv"));
    // `balanced` is what the scene gets that names none.
    for preset in ["fast", "accurate"] {
        let row = table.lines().find(|row| row.contains(&format!("preset {preset},"))).expect("tried");
        let named = [
            "coupling.scheme=strong",
            "coupling.yielding_net=true",
            "coupling.samples=",
            "coupling.yielding_share=",
        ];
        let steps = ["coupling.time_window=", "dem.time_step=", "fem.time_step="];
        assert!(named.iter().chain(&steps).all(|set| row.contains(set)), "{row}");
    }
    assert!(
        ended.stdout.contains("not in it: ") && ended.stdout.contains("the mesh of the structure"),
        "{}",
        ended.stdout
    );
    let measures = table.lines().next().expect("a head");
    assert!(measures.contains("max_deflection,") && measures.contains("max_cable_force,"), "{measures}");
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let bench = Bench::new();
    let misspelt = trade(&bench, "a", &["--measure", "max_deflexion"]);
    assert_eq!(misspelt.code, Some(2), "{}", misspelt.stderr);
    assert!(misspelt.stderr.contains("did you mean `max_deflection`?"), "{}", misspelt.stderr);
    let refused = trade(&bench, "b", &["--set", "dem.time_stepp=1e-5"]);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    assert!(!refused.out.exists(), "nothing was started");
}
