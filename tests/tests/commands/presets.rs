//! The presets of `[coupling]` keep what `rockfall check` quotes of them.

use tests::manual::holds;
use tests::{Bench, program, scene};

/// A scene of the project without its tables `[coupling]`, `[dem]` and `[fem]`.
fn open(name: &str) -> String {
    let text = std::fs::read_to_string(scene(name)).expect("a scene");
    let mut taken = true;
    let kept = text.lines().filter(|line| {
        if line.starts_with('[') {
            taken = !["[coupling]", "[dem]", "[fem]", "[output]"].iter().any(|table| line.starts_with(table));
        }
        taken
    });
    kept.map(|line| format!("{line}\n")).collect()
}

/// The number [%] that `check` prints behind these words.
fn quoted(text: &str, what: &str) -> f64 {
    let line = text.lines().find(|line| line.starts_with("preset, as measured")).expect("a quote");
    let rest = line.split(&format!("{what} within ")).nth(1).unwrap_or_else(|| panic!("{what} in {line}"));
    rest.split(' ').next().and_then(|number| number.parse().ok()).expect("a number")
}

fn keeps(name: &str, common: &[&str], measures: [&str; 2]) {
    let bench = Bench::new();
    let path = bench.scene(&open(name));
    let run = |own: &[&str]| {
        let words: Vec<&str> =
            common.iter().chain(own).flat_map(|set| ["--set", *set]).chain(["--force"]).collect();
        bench.done(&path, "out", &words)
    };
    let exact = run(&[
        "coupling.scheme=weak",
        "coupling.time_window=1e-5",
        "dem.time_step=1e-5",
        "fem.time_step=1e-5",
    ]);
    for preset in ["fast", "balanced", "accurate"] {
        let set = format!("coupling.preset={preset}");
        let found = run(&[&set]);
        let check = std::process::Command::new(program("rockfall"))
            .arg("check")
            .arg(&path)
            .args(["--set", &set])
            .output()
            .expect("started");
        let text = String::from_utf8_lossy(&check.stdout).into_owned();
        for (measure, what) in measures.into_iter().zip(["deflection", "reaction (1 ms)"]) {
            let off = 100.0 * (found.measure(measure) / exact.measure(measure) - 1.0).abs();
            assert!(off <= quoted(&text, what), "{name}, {preset}: {measure} is {off} % off");
        }
        let (energy, own) = (found.measure("energy_error"), exact.measure("energy_error"));
        let bound = quoted(&text, "energy") / 100.0;
        assert!(energy <= bound.max(1.1 * own), "{name}, {preset}: energy {energy}, weakly {own}");
        let resolved = std::fs::read_to_string(found.out.join("scene.toml")).expect("a resolved scene");
        assert!(resolved.contains("yielding_net = true") && !resolved.contains("preset"), "{resolved}");
        let coupling = &resolved.parse::<toml::Table>().expect("TOML")["coupling"];
        let parts = coupling["samples"].as_integer().expect("a count") as f64;
        let share = coupling["yielding_share"].as_float().expect("a share");
        holds("docs/coupling.md", &format!("| {preset} | {{}} | {{}} |"), &[parts, share]);
    }
}

const NEAR: [&str; 5] = [
    "limits.weak_window=2.0",
    "end_time=0.2",
    "rock.0.position=[0.0, 0.0, 0.155]",
    "rock.0.velocity=[0.0, 0.0, -6.26418391]",
    "dem.contact_selection=nearest",
];

#[test]
#[ignore = "long"]
fn on_the_drop_test_with_friction() {
    let common: Vec<&str> =
        NEAR.into_iter().chain(["contact.0.friction=0.4", "structure.cable.radius=0.002"]).collect();
    keeps("walenstadt-compare", &common, ["max_deflection", "max_reaction_1ms"]);
}

#[test]
#[ignore = "long"]
fn on_the_drop_test_with_a_stiff_contact() {
    let common: Vec<&str> = NEAR.into_iter().chain(["contact.0.young=1e9"]).collect();
    keeps("walenstadt-compare", &common, ["max_deflection", "max_reaction_1ms"]);
}

/// The public case is that soft: the rock sinks into the wires, and its energy does not close in any scheme.
#[test]
fn on_the_cable_net() {
    let common = [
        "dem.contact_selection=nearest",
        "contact.0.effective_mass=local",
        "limits.penetration=2.0",
        "limits.energy_error=10.0",
    ];
    keeps("cable-net", &common, ["centre_uz_min", "max_reaction_1ms"]);
}
