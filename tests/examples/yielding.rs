//! What a yielding net costs and how far off it is: the table of `docs/measured/yielding-net.md`, printed.
//!
//! `cargo run --release -p tests --example yielding [SPHERES,... [KEY=VALUE]...]`: the drop test with the comparison contact, from just above the
//! net to the end of the braking, for three contact moduli, with and without friction and a radius of the wires. The
//! reference is weak coupling in windows of 5e-6 s with steps as long, which advances no node of the net. All in this process.

use std::path::Path;
use tests::in_process::{Computed, computed};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../launch/scenes/walenstadt-compare.toml");
const END: f64 = 0.2;

fn run(physics: &[String], own: &[&str]) -> Result<Computed, String> {
    let near = [
        format!("end_time={END}"),
        "rock.0.position=[0.0,0.0,0.16]".into(),
        "rock.0.velocity=[0.0,0.0,-6.2565]".into(),
        "limits.weak_window=1e9".into(),
    ];
    let sets: Vec<String> =
        near.iter().chain(physics).cloned().chain(own.iter().map(|s| (*s).to_owned())).collect();
    computed(Path::new(SCENE), &sets)
}

fn column(run: &Result<Computed, String>, reference: &Computed) -> String {
    let run = match run {
        Ok(run) if run.error.is_none() => run,
        Ok(run) => return format!("{:.60}", run.error.clone().unwrap_or_default()),
        Err(what) => return format!("{what:.60}"),
    };
    let off = |name: &str| 100.0 * (run.measure(name) / reference.measure(name) - 1.0);
    format!(
        "{:+.3} % | {:+.2} % | {:.3} % | {:.2}",
        off("max_deflection"),
        off("max_reaction_1ms"),
        100.0 * run.energy_error,
        run.passes as f64 / (1e3 * END)
    )
}

fn main() {
    let spheres = std::env::args().nth(1).unwrap_or("64,512".into());
    // What is set for the yielding net alone.
    let own: Vec<String> = std::env::args().skip(2).collect();
    println!(
        "| spheres | E [Pa] | friction | wire [mm] | reference [m] | [N] | 1 ms: deflection | reaction | energy | passes/ms | 2 ms: \
         deflection | reaction | energy | passes/ms |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    for spheres in spheres.split(',') {
        for young in ["1e7", "1e8", "1e9"] {
            for friction in ["0", "0.4"] {
                for radius in ["0", "0.002"] {
                    let physics = [
                        format!("rock.0.cluster.spheres={spheres}"),
                        format!("contact.0.young={young}"),
                        format!("contact.0.friction={friction}"),
                        format!("structure.cable.radius={radius}"),
                    ];
                    let weak = [
                        "coupling.scheme=weak",
                        "coupling.time_window=5e-6",
                        "dem.time_step=5e-6",
                        "fem.time_step=5e-6",
                    ];
                    let reference = run(&physics, &weak).expect("the reference runs");
                    let yields = |window: &str| {
                        let window = format!("coupling.time_window={window}");
                        let sets = ["coupling.scheme=strong", "coupling.yielding_net=true", &window];
                        let sets: Vec<&str> =
                            sets.into_iter().chain(own.iter().map(String::as_str)).collect();
                        run(&physics, &sets)
                    };
                    println!(
                        "| {spheres} | {young} | {friction} | {} | {:.5} | {:.0} | {} | {} |",
                        if radius == "0" { "0" } else { "2" },
                        reference.measure("max_deflection"),
                        reference.measure("max_reaction_1ms"),
                        column(&yields("1e-3"), &reference),
                        column(&yields("2e-3"), &reference)
                    );
                }
            }
        }
    }
}
