//! While nothing is in reach, windows are as long as the flight, in every scheme, and nothing else changes by it.

use std::collections::BTreeMap;
use std::path::Path;
use tests::{Bench, Ended, scene};

/// The drop test to shortly after the touch.
fn drop(bench: &Bench, out: &str, sets: &[&str], shortcuts: bool) -> Ended {
    let common = ["end_time=0.7", "output.interval=0.05"];
    let mut words: Vec<&str> = common.iter().chain(sets).flat_map(|set| ["--set", *set]).collect();
    if !shortcuts {
        words.push("--no-shortcuts");
    }
    bench.done(&scene("walenstadt-compare"), out, &words)
}

fn is_harmless(sets: &[&str], window: f64) {
    let bench = Bench::new();
    let (long, short) = (drop(&bench, "long", sets, true), drop(&bench, "short", sets, false));
    let windows = |ended: &Ended| ended.summary()["coupling"]["windows"].as_f64().expect("counted");
    // It falls for 0.638 s of the 0.7.
    let all = (0.7 / window).ceil();
    // A few more where some were halved.
    assert!(windows(&short) >= all);
    assert!(windows(&long) < 0.3 * all, "{} of {all} windows", windows(&long));
    let time = |ended: &Ended| ended.measure("time_of_impact");
    assert!((time(&long) - time(&short)).abs() < 1e-9, "{} and {}", time(&long), time(&short));
    for (measure, least) in [("impact_speed", 1e-9), ("max_travel", 1e-6), ("max_reaction", 1e-4)] {
        let off = long.measure(measure) / short.measure(measure) - 1.0;
        assert!(off.abs() < least, "{measure}: {off}");
    }
}

#[test]
fn in_weak_windows() {
    is_harmless(&["coupling.scheme=weak", "coupling.time_window=1e-4"], 1e-4);
}

#[test]
fn in_strong_windows() {
    is_harmless(&["coupling.scheme=strong", "coupling.time_window=2e-4"], 2e-4);
}

#[test]
fn with_a_yielding_net() {
    let sets = ["coupling.scheme=strong", "coupling.time_window=1e-3", "coupling.yielding_net=true"];
    is_harmless(&sets, 1e-3);
}

/// Place and velocity of the rock at the time of each row, as they are written.
fn motions(history: &Path) -> BTreeMap<String, Vec<String>> {
    let text = std::fs::read_to_string(history).expect("rows");
    let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = rows.next().expect("a header");
    let names = ["x_m", "y_m", "z_m", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s"].map(|n| format!("block_{n}"));
    let columns = names.map(|name| head.iter().position(|h| *h == name).expect("a column"));
    rows.map(|row| (row[0].to_owned(), columns.iter().map(|c| row[*c].to_owned()).collect())).collect()
}

/// A block bounces down a slope into a barrier. Until it touches the net it goes the same way to the last digit, whether the
/// structure is awake in each window or not.
#[test]
#[ignore = "long"]
fn a_fall_over_terrain_is_the_same_with_the_structure_always_awake() {
    let open = ["--set", "end_time=0.85"];
    let sets = ["end_time=1.1", "terrain.forest=medium", "terrain.forest_height=3.0"];
    let forest = sets.map(|set| ["--set", set]).concat();
    for more in [&open[..], &forest] {
        let bench = Bench::new();
        let common = ["output.interval=0.01", "rock.0.position=[0.0, -5.0, 6.0]"];
        let sets = common.iter().flat_map(|set| ["--set", *set]).chain(more.iter().copied());
        let sets: Vec<&str> = sets.collect();
        let run =
            |out: &str, more: &[&str]| bench.done(&scene("slope-barrier"), out, &[&sets[..], more].concat());
        let (long, short) = (run("long", &[]), run("short", &["--no-shortcuts"]));
        let windows = |ended: &Ended| ended.summary()["coupling"]["windows"].as_f64().expect("counted");
        let touch = long.measure("time_of_impact");
        // A net that is awake swings about its rest by rounding.
        let other = short.measure("time_of_impact");
        assert!((touch - other).abs() < 1e-12, "{touch} {other}");
        println!("{} and {} windows, touch at {touch} s", windows(&long), windows(&short));
        assert!(windows(&long) < 0.6 * windows(&short));
        let (all, few) = (motions(&short.out.join("history.csv")), motions(&long.out.join("history.csv")));
        let before = few.iter().filter(|(time, _)| time.parse::<f64>().expect("a time") < touch);
        let compared = before.filter(|(time, row)| {
            all.get(*time).is_some_and(|other| {
                assert_eq!(other, *row, "at {time} s");
                true
            })
        });
        assert!(compared.count() as f64 > 50.0 * touch, "most rows of 10 ms");
        let off = long.measure("max_travel") / short.measure("max_travel") - 1.0;
        assert!(off.abs() < 1e-4, "{off}");
    }
}
