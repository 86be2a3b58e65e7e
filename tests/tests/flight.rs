//! While nothing is in reach, windows are as long as the flight, in every scheme, and nothing else changes by it.

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
