//! Eight of the sixty combinations of `examples/limits.rs`: no run is wrong by more than 1 % and ends with status `done`.

use tests::{Bench, Ended, scene};

/// What makes a scene short and its bounds the default ones; its measure of deflection; its steps when converged [s].
type Setup = (&'static str, &'static [&'static str], &'static str, &'static str);

const DROP: Setup = (
    "walenstadt-exp1",
    &[
        "end_time=0.2",
        "rock.0.position=[0.0, 0.0, 0.156]",
        "rock.0.velocity=[0.0, 0.0, -6.26418391]",
        "output.fields=10.0",
    ],
    "max_deflection",
    "5e-6",
);
const NET: Setup = (
    "cable-net",
    &[
        "contact.0.effective_mass=local",
        "limits.energy_error=0.1",
        "limits.residual=0.5",
        "limits.weak_window=1.0",
    ],
    "centre_uz_min",
    "1e-5",
);
const CABLE: Setup = ("sphere-on-cable", &[], "max_deflection", "2e-6");

const STEPS: [&str; 3] = ["coupling.time_window", "dem.time_step", "fem.time_step"];

/// Scene, physics, numerics, window [s], contact step [s].
type Case = (Setup, &'static [&'static str], &'static [&'static str], &'static str, &'static str);

const SOFT: &[&str] = &["contact.0.young=1e5"];
const STIFF: &[&str] = &["contact.0.young=1e7", "contact.0.friction=0.0"];
const BOUNCING: &[&str] = &["contact.0.stiffness=1e7"];
const ROUGH: &[&str] = &["contact.0.young=1e7", "contact.0.restitution=0.5"];
const NEWMARK: &[&str] =
    &["coupling.scheme=strong", "coupling.samples=4", "fem.integrator=newmark", "fem.time_step=1e-3"];
const LONG: &[&str] = &["coupling.scheme=strong", "coupling.samples=4"];
const WEAK: &[&str] = &["coupling.scheme=weak"];
const STRONG: &[&str] = &["coupling.scheme=strong"];

const CASES: [Case; 8] = [
    (CABLE, BOUNCING, NEWMARK, "2.09e-4", "1e-4"),
    (CABLE, &[], WEAK, "1e-5", "1e-5"),
    (CABLE, BOUNCING, WEAK, "1e-4", "1e-4"),
    (NET, SOFT, WEAK, "2e-4", "1e-4"),
    (NET, STIFF, LONG, "1.54e-3", "1e-4"),
    (NET, STIFF, STRONG, "2e-4", "1e-4"),
    (DROP, ROUGH, WEAK, "2.5e-4", "1e-4"),
    (DROP, ROUGH, STRONG, "2e-4", "1e-4"),
];

fn run(bench: &Bench, setup: &Setup, sets: &[String]) -> Ended {
    let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", set.as_str()]).chain(["--force"]).collect();
    bench.run(&scene(setup.0), "out", &words)
}

/// Largest deviation of those measures that are given, and the status.
fn judged(bench: &Bench, case: &Case) -> (f64, String, bool) {
    let (setup, physics, numerics, window, step) = case;
    let common: Vec<String> = setup.1.iter().chain(*physics).map(ToString::to_string).collect();
    let fine: Vec<String> = common
        .iter()
        .cloned()
        .chain(["coupling.scheme=weak".into()])
        .chain(STEPS.map(|key| format!("{key}={}", setup.3)))
        .collect();
    let exact = run(bench, setup, &fine).summary();
    let own = [format!("coupling.time_window={window}"), format!("dem.time_step={step}")];
    let sets: Vec<String> =
        common.into_iter().chain(numerics.iter().map(ToString::to_string)).chain(own).collect();
    let summary = run(bench, setup, &sets).summary();
    let measure = |summary: &serde_json::Value, name: &str| summary["measures"][name]["value"].as_f64();
    let off = [setup.2, "max_reaction_1ms"].map(|name| {
        let exact = measure(&exact, name).expect("the converged answer is known");
        measure(&summary, name).map_or(0.0, |value| (value / exact - 1.0).abs())
    });
    let status = summary["status"].as_str().expect("a status").to_owned();
    let resolved = measure(&summary, "max_reaction_1ms").is_some();
    (off[0].max(off[1]), status, resolved)
}

#[test]
#[ignore = "long"]
fn what_is_wrong_by_more_than_a_percent_is_not_done_and_what_is_right_is() {
    let bench = Bench::new();
    let judged: Vec<_> = CASES.iter().map(|case| judged(&bench, case)).collect();
    for (case, (off, status, resolved)) in CASES.iter().zip(&judged) {
        println!("{} {:?} {} {off:.2e} {status} {resolved}", case.0.0, case.2, case.3);
    }
    for (case, (off, status, _)) in CASES.iter().zip(&judged) {
        assert!(status != "done" || *off < 0.01, "{case:?}: {off} and {status}");
    }
    // Those that are coupled as they should be are not accused, and some of the others are wrong indeed.
    for right in [1, 5, 7] {
        assert_eq!(judged[right].1, "done", "{:?}", CASES[right]);
    }
    assert!(judged.iter().filter(|(off, ..)| *off > 0.01).count() >= 2, "{judged:?}");
    assert!(!judged[4].2, "a mean over 1 ms out of parts of 0.385 ms");
}
