//! The yielding net: the contact solver advances the nodes in reach itself, and windows of 1 ms take one iteration.
//!
//! All is compared with weak coupling in windows as short as its stability asks for, which advances no node of the net.

use std::path::Path;
use tests::in_process::{Computed, computed};

/// Passes: one for most windows, a second one or halves about the first touch and where parts of a window lose energy.
///
/// The drop test just above the net, to the end of the braking.
const NEAR: [&str; 4] = [
    "end_time=0.16",
    "rock.0.position=[0.0,0.0,0.16]",
    "rock.0.velocity=[0.0,0.0,-6.2565]",
    "limits.weak_window=1e9",
];

fn run(scene: &str, sets: &[&str]) -> Computed {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch/scenes").join(scene);
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let computed = computed(&scene, &sets).expect("runs");
    assert_eq!(computed.error, None, "{sets:?}");
    computed
}

fn yields(scene: &str, window: &str, sets: &[&str]) -> Computed {
    let window = format!("coupling.time_window={window}");
    let own = ["coupling.scheme=strong", "coupling.yielding_net=true", &window];
    run(scene, &[sets, &own].concat())
}

fn weak(scene: &str, sets: &[&str]) -> Computed {
    let own = ["coupling.scheme=weak", "coupling.time_window=1e-5", "fem.time_step=1e-5"];
    run(scene, &[sets, &own].concat())
}

fn off(value: f64, reference: f64) -> f64 {
    (value / reference - 1.0).abs()
}

fn agree(yielding: &Computed, reference: &Computed, passes: f64) {
    let of = |name: &str| (yielding.measure(name), reference.measure(name));
    let (d, d_reference) = of("max_deflection");
    assert!(off(d, d_reference) < 1e-3, "deflection {d}, {d_reference}");
    let (r, r_reference) = of("max_reaction_1ms");
    assert!(off(r, r_reference) < 1e-2, "reaction {r}, {r_reference}");
    assert!(yielding.energy_error < 1e-3, "energy error {}", yielding.energy_error);
    assert!((yielding.passes as f64) < passes, "{} passes", yielding.passes);
}

#[test]
fn windows_of_a_millisecond_take_one_pass_at_any_stiffness() {
    for young in ["1e7", "1e9"] {
        let young = format!("contact.0.young={young}");
        let sets = [&NEAR[..], &[&young]].concat();
        let reference = weak("walenstadt-compare.toml", &[&sets[..], &["dem.time_step=5e-6"]].concat());
        agree(&yields("walenstadt-compare.toml", "1e-3", &sets), &reference, 1.3 * 160.0);
    }
}

#[test]
fn friction_and_wires_with_a_radius_need_no_shorter_windows() {
    let sets = [&NEAR[..], &["contact.0.friction=0.4", "structure.cable.radius=0.002"]].concat();
    let reference = weak("walenstadt-compare.toml", &[&sets[..], &["dem.time_step=5e-6"]].concat());
    agree(&yields("walenstadt-compare.toml", "1e-3", &sets), &reference, 1.3 * 160.0);
    agree(&yields("walenstadt-compare.toml", "2e-3", &sets), &reference, 2.2 * 80.0);
}

#[test]
fn an_implicit_structure_yields_too() {
    let implicit = [&NEAR[..], &["fem.integrator=generalized_alpha", "fem.time_step=1.25e-4"]].concat();
    let reference = weak("walenstadt-compare.toml", &NEAR);
    agree(&yields("walenstadt-compare.toml", "1e-3", &implicit), &reference, 1.3 * 160.0);
}

/// The same bytes with and without what is only a saving, and in every run.
#[test]
fn the_same_run_twice_has_the_same_measures() {
    let sets = [&NEAR[..], &["end_time=0.02"]].concat();
    let [a, b] = [0, 1].map(|_| yields("walenstadt-compare.toml", "1e-3", &sets));
    assert_eq!((a.energy_error, a.passes), (b.energy_error, b.passes));
    for measure in &a.measures {
        assert_eq!(measure.value.to_bits(), b.measure(&measure.name).to_bits(), "{}", measure.name);
    }
}
