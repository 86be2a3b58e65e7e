//! Prints the tables of docs/measured/drop-test.md and net-cost.md: runs the scenes and says what came out, one line per run.
//!
//! `cargo run --release -p tests --example figures -- cable-net|drop-test|cost`

use tests::manual::without;
use tests::{Bench, Ended, scene};

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("cable-net") => cable_net(),
        Some("drop-test") => drop_test(),
        Some("cost") => cost(),
        _ => eprintln!("usage: figures cable-net | drop-test | cost"),
    }
}

fn run(name: &str, sets: &[&str]) -> Ended {
    let bench = Bench::new();
    let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let ended = bench.run(&scene(name), "out", &words);
    if ended.code != Some(0) {
        println!("FAILED {sets:?}: {}", ended.stderr.lines().last().unwrap_or_default());
    }
    // The directory goes with the bench: keep what is looked at.
    let kept = std::env::temp_dir().join(format!("rockfall-figures-{}", std::process::id()));
    let _ = std::fs::create_dir_all(&kept);
    let _ = std::fs::copy(ended.out.join("summary.json"), kept.join("summary.json"));
    Ended { out: kept, ..ended }
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// V-C6, with both masses in the dashpot: windows, peak, halved share, solver calls per simulated millisecond.
fn cable_net() {
    println!("mass scheme window_s samples peak_m time_s halved_share unconverged calls_per_ms energy_error");
    for mass in ["rock", "local"] {
        let mass_set = format!("contact.0.effective_mass={mass}");
        let weak = ["1e-5", "2e-5", "5e-5", "1e-4"].map(|window| ("weak", window, "1"));
        let strong = ["2e-4", "5e-4", "1e-3"].map(|window| ("strong", window, "1"));
        let finer = [("strong", "1e-3", "4")];
        for (scheme, window, samples) in weak.into_iter().chain(strong).chain(finer) {
            let step = if scheme == "weak" { window } else { "2e-5" };
            let sets = [
                mass_set.clone(),
                format!("coupling.scheme={scheme}"),
                format!("coupling.time_window={window}"),
                format!("coupling.samples={samples}"),
                format!("dem.time_step={step}"),
            ];
            let ended = run("cable-net", &sets.each_ref().map(String::as_str));
            let summary = ended.summary();
            let coupling = &summary["coupling"];
            let windows = number(&coupling["windows"]) + number(&coupling["windows_halved"]);
            println!(
                "{mass} {scheme} {window} {samples} {:.6} {:.5} {:.3} {} {:.1} {:.2e}",
                ended.measure("centre_uz_min"),
                number(&summary["measures"]["centre_uz_min"]["time_s"]),
                number(&coupling["windows_halved"]) / windows,
                coupling["windows_unconverged"],
                2.0 * number(&coupling["iterations"]) / 200.0,
                ended.measure("energy_error"),
            );
        }
    }
}

/// The drop test over clusters and schemes, each beside its own run at half the window.
fn drop_test() {
    println!(
        "case spheres scheme window_s max_deflection_m max_reaction_1ms_N raw_N impact_speed sag_m energy_error iterations_per_window"
    );
    let exp2 = ["structure.cable.prestress=-1.35898e7", "rock.0.position=[0.0, 0.0, 2.105]"];
    for (case, extra) in [("exp_1", &[][..]), ("exp_2", &exp2)] {
        let counts: &[u32] = if case == "exp_1" { &[1, 64, 512, 4_096, 21_952] } else { &[64] };
        for spheres in counts {
            let all = [
                ("weak", "5e-5", "central_difference", "5e-5"),
                ("weak", "2.5e-5", "central_difference", "2.5e-5"),
                ("strong", "2e-4", "central_difference", "5e-5"),
                ("strong", "1e-4", "central_difference", "5e-5"),
                ("strong", "2e-4", "generalized_alpha", "2e-4"),
                ("strong", "1e-4", "generalized_alpha", "1e-4"),
            ];
            for (scheme, window, integrator, step) in all {
                let implicit = integrator != "central_difference";
                if implicit && !(*spheres == 64 || *spheres == 1) {
                    continue;
                }
                let owned = [
                    format!("rock.0.cluster.spheres={spheres}"),
                    format!("coupling.scheme={scheme}"),
                    format!("coupling.time_window={window}"),
                    format!("fem.integrator={integrator}"),
                    format!("fem.time_step={step}"),
                    "end_time=0.78".to_string(),
                ];
                let sets: Vec<&str> = owned.iter().map(String::as_str).chain(extra.iter().copied()).collect();
                let ended = run("walenstadt-compare", &sets);
                let name = if implicit { format!("{scheme}-implicit") } else { scheme.to_string() };
                println!(
                    "{case} {spheres} {name} {window} {:.5} {:.0} {:.0} {:.4} {:.5} {:.1e} {:.2}",
                    ended.measure("max_deflection"),
                    ended.measure("max_reaction_1ms"),
                    ended.measure("max_reaction"),
                    ended.measure("impact_speed"),
                    ended.measure("sag"),
                    ended.measure("energy_error"),
                    number(&ended.summary()["coupling"]["iterations_per_window"]),
                );
            }
        }
    }
}

/// Time loop for 0.5 s from just above the net: medians of five, interleaved. The rows of docs/measured/net-cost.md.
fn cost() {
    let weak = |spheres: &str, step: &str| {
        let steps =
            ["coupling.time_window", "dem.time_step", "fem.time_step"].map(|key| format!("{key}={step}"));
        [&steps[..], &[format!("rock.0.cluster.spheres={spheres}"), "coupling.scheme=weak".into()]].concat()
    };
    let preset = |name: &str, own: &[&str]| {
        own.iter().map(|set| (*set).to_owned()).chain([format!("coupling.preset={name}")]).collect()
    };
    let strong =
        ["coupling.scheme=strong", "coupling.time_window=2e-4", "dem.time_step=1e-5", "fem.time_step=5e-5"];
    let stiff = "contact.0.young=1e9";
    let many = "rock.0.cluster.spheres=21952";
    let cases: [(&str, &str, Vec<String>); 13] = [
        ("weak, 1.2e-4 s", "compare", weak("64", "1.2e-4")),
        ("weak, 1e-4 s", "compare", weak("64", "1e-4")),
        ("weak, 5e-5 s", "compare", weak("64", "5e-5")),
        ("weak, 5e-5 s, 21 952 spheres", "compare", weak("21952", "5e-5")),
        ("`preset = \"fast\"`", "compare", preset("fast", &[])),
        ("`preset = \"balanced\"`", "compare", preset("balanced", &[])),
        ("`preset = \"accurate\"`", "compare", preset("accurate", &[])),
        ("balanced, 1e9 Pa", "compare", preset("balanced", &[stiff])),
        ("balanced, 21 952 spheres of 1e9 Pa", "compare", preset("balanced", &[many, stiff])),
        ("balanced, 21 952 spheres of 1e8 Pa", "compare", preset("balanced", &[many])),
        ("`walenstadt-exp1`, strong, 2e-4 s", "exp1", strong.map(str::to_owned).to_vec()),
        ("`walenstadt-exp1`, fast", "exp1", preset("fast", &[])),
        ("`walenstadt-exp1`, balanced", "exp1", preset("balanced", &[])),
    ];
    // The fall is left out: the rock starts at the net with the speed it would have there.
    let common =
        ["end_time=0.5", "rock.0.position=[0.0, 0.0, 0.155]", "rock.0.velocity=[0.0, 0.0, -6.26418391]"];
    let bench = Bench::new();
    let mut runs = vec![Vec::new(); cases.len()];
    for _ in 0..5 {
        for (runs, (_, scene, sets)) in runs.iter_mut().zip(&cases) {
            let path = without(
                &bench,
                &format!("walenstadt-{scene}"),
                &["[coupling]", "[dem]", "[fem]", "[output]"],
            );
            let words: Vec<&str> =
                sets.iter().map(String::as_str).chain(common).flat_map(|set| ["--set", set]).collect();
            let ended = bench.run(&path, "out", &[&words[..], &["--force"]].concat());
            let (summary, deflection) = (ended.summary(), ended.measure("max_deflection"));
            let cost = &summary["cost"];
            let process = |name: &str, key: &str| number(&cost["processes"][name][key]);
            let status = summary["status"].as_str().expect("a word").to_owned();
            let solved = [process("dem", "solve_s"), process("fem", "solve_s")];
            let fixed = (status, number(&cost["exchanges"]), deflection);
            runs.push((
                [number(&cost["loop_s"]), solved[0], solved[1], number(&cost["stages"]["prepare_s"])],
                fixed,
            ));
        }
    }
    println!(
        "| run | loop [s] | contact solver [s] | structure [s] | start [s] | exchanges | deflection [m] | status |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for ((name, _, _), runs) in cases.iter().zip(&runs) {
        let times = [0, 1, 2, 3].map(|at| {
            let mut all: Vec<f64> = runs.iter().map(|(times, _)| times[at]).collect();
            all.sort_by(f64::total_cmp);
            format!("{:.3}", all[all.len() / 2])
        });
        let (status, exchanges, deflection) = &runs[0].1;
        println!("| {name} | {} | {exchanges} | {deflection:.5} | {status} |", times.join(" | "));
    }
}
