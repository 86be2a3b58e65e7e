//! A block down a slope into a standing barrier: what is counted along the impact direction, again from the rows.

use std::process::Command;
use tests::manual::holds;
use tests::{Bench, program, scene};

#[test]
fn travel_and_braking_are_those_along_the_impact_direction() {
    let bench = Bench::new();
    // Short windows, so that the rows lie close together.
    let sets = ["--set", "end_time=0.9", "--set", "coupling.scheme=weak"];
    let run = bench.done(&scene("slope-barrier"), "out", &sets);
    let axes = ["x", "y", "z"];
    let columns = |what: &str, unit: &str| axes.map(|axis| run.column(&format!("block_{what}{axis}_{unit}")));
    let (place, velocity) = (columns("", "m"), columns("v", "m_per_s"));
    let time = run.column("time_s");
    let impact = run.measure("time_of_impact");
    let first = time.iter().position(|t| *t >= impact).expect("a row of the first touch");
    let before = axes.map(|axis| run.measure(&format!("impact_velocity_{axis}")));
    let speed = before.iter().map(|v| v * v).sum::<f64>().sqrt();
    // It is on the slope still, and slows down there: on a straight line through two rows, the nearest one and the next. The touch may be
    // dated just before the row of the last window without a force, and the row before that lies an interval back.
    let near = if time[first] - impact < impact - time[first - 1] { first } else { first - 1 };
    let share = (impact - time[near]) / (time[near + 1] - time[near]);
    for axis in 0..3 {
        let [last, next] = [velocity[axis][near], velocity[axis][near + 1]];
        let between = last + share * (next - last);
        assert!((between - before[axis]).abs() < 2e-4, "{axis}: {before:?} {between}");
        let direction = run.measure(&format!("impact_direction_{}", axes[axis]));
        assert!((direction - before[axis] / speed).abs() < 1e-9);
    }
    assert!((run.measure("impact_speed") / speed - 1.0).abs() < 1e-9);
    let steep = (-before[2] / speed).acos().to_degrees();
    assert!((60.0..70.0).contains(&steep), "{steep} degrees from gravity");
    let along = |of: &[Vec<f64>; 3], row: usize| (0..3).map(|a| of[a][row] * before[a] / speed).sum::<f64>();
    // Between that row and the touch it moves straight.
    let start = along(&place, near) + speed * (impact - time[near]);
    let travel = (first..time.len()).map(|row| along(&place, row) - start).fold(0.0, f64::max);
    let given = run.measure("max_travel");
    assert!((given / travel - 1.0).abs() < 1e-5, "{given} m, {travel} m by the rows");
    let stop = (first..time.len()).find(|row| along(&velocity, *row) <= 0.0).expect("it is stopped");
    let braking = run.measure("braking_time");
    assert!(
        (braking - (time[stop] - impact)).abs() < 1e-4,
        "{braking} s, {} s by the rows",
        time[stop] - impact
    );
    assert!((1.6..1.8).contains(&given) && (0.27..0.3).contains(&braking), "{given} m, {braking} s");
    holds(
        "docs/runs.md",
        "terrain, block and barrier in one: stopped over {} m in {} s |",
        &[given, braking],
    );
    assert!(run.summary()["measures"]["max_deflection"].is_null(), "no depth, at 65 degrees from gravity");
}

/// The net's contact sets the window; how hard the slope is does not.
#[test]
#[ignore = "long"]
fn the_longest_weak_window_is_that_of_the_net_and_not_of_the_terrain() {
    let limit = |young: &str| {
        let output = Command::new(program("rockfall"))
            .arg("check")
            .arg(scene("slope-barrier"))
            .args(["--set", &format!("contact.{young}")])
            .output()
            .expect("started");
        let text = String::from_utf8(output.stdout).expect("text");
        let line =
            text.lines().find(|l| l.starts_with("longest weak window")).expect("is printed").to_owned();
        line.split_whitespace().nth(3).and_then(|s| s.parse::<f64>().ok()).expect("a number")
    };
    let [soft, hard, net] = ["1.young=1e9", "1.young=1e11", "0.young=1e8"].map(limit);
    assert_eq!(soft, hard);
    assert!(net > 1.5 * soft, "{net} s with a soft net contact, {soft} s with a stiff one");
}
