//! Sixty combinations of window, scheme, stiffness, friction, restitution, predictor, samples and integrator on three small
//! scenes: what comes out, beside the converged answer of the same physics, and whether the run says so.
//!
//! `cargo run --release -p tests --example limits`: a line per run; last those that are wrong by more than 1 % in deflection
//! or 1 ms reaction and end with the status `done`.

use std::process::Command;
use tests::{Bench, Ended, program, scene};

/// A scene, what makes it short, its measure of deflection, and its steps when converged [s].
struct Setup {
    name: &'static str,
    common: &'static [&'static str],
    deflection: &'static str,
    fine: f64,
}

const SETUPS: [Setup; 3] = [
    Setup {
        name: "walenstadt-exp1",
        common: &[
            "end_time=0.2",
            "rock.0.position=[0.0, 0.0, 0.156]",
            "rock.0.velocity=[0.0, 0.0, -6.26418391]",
            "output.fields=10.0",
        ],
        deflection: "max_deflection",
        fine: 5e-6,
    },
    Setup {
        name: "cable-net",
        // The scene raises its bounds to show a scheme that fails; here they are what they are by default.
        common: &[
            "contact.0.effective_mass=local",
            "limits.energy_error=0.1",
            "limits.residual=0.5",
            "limits.weak_window=1.0",
        ],
        deflection: "centre_uz_min",
        fine: 1e-5,
    },
    Setup { name: "sphere-on-cable", common: &[], deflection: "max_deflection", fine: 2e-6 },
];

/// One of the sixty.
struct Case {
    setup: &'static Setup,
    physics: Vec<String>,
    numerics: Vec<String>,
    factor: f64,
    weak: bool,
    implicit: bool,
}

fn pick<T: Copy>(from: &[T], at: usize) -> T {
    from[at % from.len()]
}

/// Number `n` of the sixty: numbers that share no factor spread the values over each other.
fn case(n: usize) -> Case {
    let setup = &SETUPS[[0, 1, 0, 2, 0][n % 5]];
    let physics = match setup.name {
        "walenstadt-exp1" => vec![
            format!("contact.0.young={}", pick(&["1e8", "1e9", "1e7"], n / 2)),
            format!("contact.0.friction={}", pick(&["0.4", "0.0", "1.0"], n / 5)),
            format!("contact.0.restitution={}", pick(&["0.9", "0.5", "1.0", "0.9"], n / 3)),
        ],
        "cable-net" => vec![
            format!("contact.0.young={}", pick(&["1e5", "1e6", "1e7"], n / 5)),
            format!("contact.0.friction={}", pick(&["0.4", "0.0", "1.0"], n / 7)),
        ],
        _ => vec![
            format!("contact.0.stiffness={}", pick(&["1e6", "1e7", "1e8"], n / 5)),
            format!("contact.0.restitution={}", pick(&["1.0", "0.5"], n / 10)),
        ],
    };
    let integrator = pick(
        &["central_difference", "central_difference", "newmark", "central_difference", "generalized_alpha"],
        n / 4,
    );
    let weak = n % 3 != 2;
    let mut numerics = vec![
        format!("coupling.scheme={}", if weak { "weak" } else { "strong" }),
        format!("coupling.predictor={}", pick(&[1, 1, 0, 1], n / 2)),
        format!("coupling.samples={}", pick(&[1, 1, 4, 2], n / 3)),
        format!("fem.integrator={integrator}"),
    ];
    let implicit = integrator != "central_difference";
    if implicit {
        numerics.push("fem.time_step=1e-3".into());
    }
    Case { setup, physics, numerics, factor: pick(&[0.25, 1.0, 4.0, 0.5, 2.0, 1.0], n), weak, implicit }
}

/// The longest weak window that `rockfall check` reports [s].
fn promised(name: &str, sets: &[String]) -> Option<f64> {
    let mut command = Command::new(program("rockfall"));
    command.arg("check").arg(scene(name));
    sets.iter().for_each(|set| {
        command.args(["--set", set]);
    });
    let text = String::from_utf8(command.output().expect("started").stdout).expect("text");
    let line = text.lines().find_map(|l| l.strip_prefix("longest weak window"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Run to the end that it takes.
fn run(bench: &Bench, name: &str, sets: &[String]) -> Ended {
    let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", set.as_str()]).collect();
    bench.run(&scene(name), "out", &words)
}

/// A measure; NaN where it is absent.
fn measure(summary: &serde_json::Value, name: &str) -> f64 {
    summary["measures"][name]["value"].as_f64().unwrap_or(f64::NAN)
}

fn off(value: f64, exact: f64) -> f64 {
    (value / exact - 1.0).abs()
}

fn main() {
    let mut slipped = 0;
    println!("number scene factor window status off_deflection off_reaction energy_error settings");
    let numbers: Vec<usize> = std::env::args().skip(1).filter_map(|n| n.parse().ok()).collect();
    let mut references: Vec<(String, [f64; 2])> = Vec::new();
    for n in (0..60).filter(|n| numbers.is_empty() || numbers.contains(n)) {
        let Case { setup, physics, numerics, factor, weak, implicit } = case(n);
        let common: Vec<String> =
            setup.common.iter().map(ToString::to_string).chain(physics.clone()).collect();
        let key = format!("{} {physics:?}", setup.name);
        let exact = match references.iter().find(|(k, _)| *k == key) {
            Some((_, exact)) => *exact,
            None => {
                let own = ["coupling.time_window", "dem.time_step", "fem.time_step"]
                    .map(|k| format!("{k}={:e}", setup.fine));
                let sets: Vec<_> =
                    common.iter().cloned().chain(["coupling.scheme=weak".into()]).chain(own).collect();
                let bench = Bench::new();
                let summary = run(&bench, setup.name, &sets).summary();
                let exact = [setup.deflection, "max_reaction_1ms"].map(|name| measure(&summary, name));
                references.push((key, exact));
                exact
            }
        };
        let sets: Vec<String> = common.into_iter().chain(numerics.iter().cloned()).collect();
        let Some(limit) = promised(setup.name, &sets) else {
            println!("{n} {} no longest window: {sets:?}", setup.name);
            continue;
        };
        // Strong windows are compared with what weak ones could be; thousands of Newton steps are spared.
        let least = if implicit { 4e-5 } else { 5e-6 };
        let window = if weak { factor * limit } else { factor * 4.0 * limit };
        let window = window.clamp(least, 2e-3);
        let bench = Bench::new();
        let own =
            [format!("coupling.time_window={window:e}"), format!("dem.time_step={:e}", window.min(1e-4))];
        let sets: Vec<_> = sets.into_iter().chain(own).collect();
        let ended = run(&bench, setup.name, &sets);
        if !ended.out.join("summary.json").exists() {
            println!("{n} {} refused: {}", setup.name, ended.stderr.lines().next().unwrap_or_default());
            continue;
        }
        let summary = ended.summary();
        let status = summary["status"].as_str().unwrap_or("-").to_owned();
        let offs = [off(measure(&summary, setup.deflection), exact[0]), {
            off(measure(&summary, "max_reaction_1ms"), exact[1])
        }];
        // What is absent, with its reason, is not wrong.
        let slips = status == "done" && offs.iter().any(|off| *off > 0.01);
        slipped += usize::from(slips);
        println!(
            "{n} {} {factor} {window:.2e} {status} {:.2e} {:.2e} {:.2e} {}{} {}",
            setup.name,
            offs[0],
            offs[1],
            measure(&summary, "energy_error"),
            if slips { "SLIPPED " } else { "" },
            physics.join(" "),
            numerics.join(" ")
        );
    }
    println!("{slipped} are wrong by more than 1 % and done");
}
