//! Loads with a history, pressure on faces, velocities at t = 0: closed forms, work, faults of the input.

use crate::common::{Run, coupled_plan, off, scene};
use crate::pressures::octant;
use fem_solver::FemSolver;
use interface_defs::{Plan, Sampling};
use std::f64::consts::PI;
use toolkit::alloc::allocations;
use toolkit::program::Options;

/// Every integrator in time, as it stands in a scene.
pub const SCHEMES: [&str; 6] = [
    "integrator = \"central_difference\"",
    "integrator = \"generalized_alpha\"",
    "integrator = \"generalized_alpha\"\nrho_inf = 0.5",
    "integrator = \"generalized_alpha\"\nrho_inf = 0.0",
    "integrator = \"newmark\"",
    "integrator = \"bossak\"\nalpha = -0.1",
];
const MIDPOINT: &str = SCHEMES[1];

/// A mass of 1 kg on a spring of 100 N/m along z, 100 N times the factors of `history` on it.
pub fn oscillator(scheme: &str, step: f64, history: &str) -> String {
    format!(
        r#"
end_time = 10.0
[structure]
nodes = [[0.0, 0.0, 0.0]]
masses = [{{ nodes = [0], mass = 1.0 }}]
springs = [{{ nodes = [0], stiffness = [0.0, 0.0, 100.0] }}]
loads = [{{ nodes = [0], force = [0.0, 0.0, 100.0], history = {history} }}]
supports = [{{ nodes = [0], directions = "xy" }}]
[[gauge]]
name = "mass"
at = [0.0, 0.0, 0.0]
quantity = "displacement"
[fem]
time_step = {step:?}
{scheme}
"#
    )
}

#[test]
fn a_ramp_swings_an_oscillator_as_its_closed_form_says_with_an_error_of_second_order() {
    // w = 10: under a ramp over T, u = t/T - sin(w t)/(w T); then 1 + (sin w(t - T) - sin w t)/(w T). The corner at T lies
    // within a step.
    let (w, length) = (10.0, 0.5005);
    let exact = |t: f64| match t {
        t if t < length => t / length - (w * t).sin() / (w * length),
        _ => 1.0 + ((w * (t - length)).sin() - (w * t).sin()) / (w * length),
    };
    for scheme in SCHEMES {
        let worst = |step: f64| {
            let mut run = Run::alone(&oscillator(scheme, step, "[[0.0, 0.0], [0.5005, 1.0]]"), 0.05);
            let mut worst = 0.0_f64;
            for n in 1..=40 {
                run.step(0.05, &[]);
                worst = worst.max((run.value("mass_uz") - exact(0.05 * f64::from(n))).abs());
            }
            worst
        };
        let (coarse, fine) = (worst(2e-3), worst(1e-3));
        // w t (w h)^2 / 12 of the swing of 0.2 m at most, times 2 for the schemes that damp.
        assert!(fine < 2.0 * 20.0 * 1e-4 / 12.0 && coarse / fine > 3.0, "{scheme}: {coarse:.2e} {fine:.2e}");
    }
}

#[test]
fn a_half_sine_leaves_the_swing_of_its_closed_form() {
    // After sin(pi t / T) over T: u = -r / (1 - r^2) (sin w t + sin w (t - T)), r = pi / (T w).
    let (w, length, rows) = (10.0, 0.2, 100);
    let history: Vec<String> = (0..=rows)
        .map(|i| f64::from(i) / f64::from(rows))
        .map(|x| format!("[{:?}, {:?}]", x * length, (PI * x).sin()))
        .collect();
    let history = format!("[{}]", history.join(", "));
    let r = PI / (length * w);
    for scheme in [SCHEMES[0], MIDPOINT] {
        let mut run = Run::alone(&oscillator(scheme, 5e-4, &history), 0.05);
        for n in 1..=40 {
            run.step(0.05, &[]);
            let t = 0.05 * f64::from(n);
            let exact = -r / (1.0 - r * r) * ((w * t).sin() + (w * (t - length)).sin());
            // The table cuts pi^2 / (12 rows^2) off the impulse, the step shifts the phase by w t (w h)^2 / 12.
            let error = (run.value("mass_uz") - exact).abs();
            assert!(t < length || error < 2e-4, "{scheme} at {t}: off by {error:.2e}");
        }
    }
}

#[test]
fn the_work_of_a_load_with_a_history_closes_the_balance() {
    let history = "[[0.0, 0.0], [0.1234, 1.5], [0.2, -1.0], [0.7, 0.3]]";
    for scheme in SCHEMES {
        let error = |step: f64| {
            let mut run = Run::alone(&oscillator(scheme, step, history), 0.05);
            let start = run.balance();
            let mut most = 0.0_f64;
            for _ in 0..20 {
                run.step(0.05, &[]);
                most = most.max((run.balance() - start).abs());
            }
            assert!(run.value("energy_loads_fem").abs() > 1.0 && run.value("energy_potential_fem") == 0.0);
            most / run.value("energy_loads_fem").abs()
        };
        let (coarse, fine) = (error(2e-3), error(1e-3));
        // The midpoint rule has no error but Newton's.
        assert!(fine < 1e-8 || (fine < 1e-3 && coarse / fine > 3.0), "{scheme}: {coarse:.2e} {fine:.2e}");
    }
}

#[test]
fn before_its_history_begins_a_structure_rests_and_its_windows_are_skipped() {
    let history = "[[0.5, 0.4], [0.6, 1.0]]";
    let mut run = Run::alone(&oscillator(MIDPOINT, 1e-3, history), 0.1);
    // It hangs under the load of t = 0 in equilibrium.
    assert!((run.ready.mesh.coordinates[2] - 0.4).abs() < 1e-12);
    (0..10).for_each(|_| run.step(0.1, &[]));
    assert_eq!(run.count("skipped_windows"), 5);
    assert!(run.value("mass_uz").abs() > 0.1);
}

#[test]
fn statics_follows_the_history_of_its_loads_with_exact_work() {
    let mut run =
        Run::alone(&oscillator("integrator = \"static\"", 1.0, "[[0.0, 0.0], [1.0, 2.0], [1.5, 0.0]]"), 0.25);
    for n in 1..=6 {
        run.step(0.25, &[]);
        let t = 0.25 * f64::from(n);
        let factor = if t <= 1.0 { 2.0 * t } else { 2.0 * (1.5 - t) / 0.5 };
        assert!((run.value("mass_uz") - factor).abs() < 1e-9, "{t}: {}", run.value("mass_uz"));
        assert!((run.value("energy_loads_fem") + 50.0 * factor * factor).abs() < 1e-6);
        assert!((run.value("reaction_z") + 100.0 * factor).abs() < 1e-6);
    }
}

/// A bar of 1 m in 50 pieces along x, 1e7 Pa, 1e-4 m2, 1000 kg/m3 (c = 100 m/s), its first node held; all of it starts with
/// the velocity `v` along x.
fn bar(v: f64, scheme: &str) -> String {
    let nodes: Vec<_> = (0..=50).map(|i| [0.02 * f64::from(i), 0.0, 0.0]).collect();
    let cables: Vec<_> = (0..50).map(|i| format!("{{ nodes = [{i}, {}] }}", i + 1)).collect();
    let all: Vec<_> = (0..=50).collect();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
cables = [{}]
cable = {{ young = 1e7, area = 1e-4, density = 1000.0, tension_only = false }}
supports = [{{ nodes = [0] }}, {{ group = "all", directions = "yz" }}]
groups = [{{ name = "all", nodes = {all:?} }}]
velocities = [{{ group = "all", velocity = [{v:?}, 0.0, 0.0] }}]
[fem]
{scheme}
"#,
        cables.join(", ")
    )
}

#[test]
fn a_bar_that_hits_a_wall_carries_rho_c_v_and_rebounds() {
    // The wave runs there and back in 2 L / c = 20 ms; the wall gives A rho c v = 10 N as long, 2 m v = 0.2 N s in all (less
    // what the half mass of the held node does not have).
    for scheme in ["time_step = 1e-4", "time_step = 1e-4\nintegrator = \"generalized_alpha\""] {
        let mut run = Run::alone(&bar(-1.0, scheme), 2e-3);
        let moving = 0.1 * (1.0 - 0.01);
        assert!(off(run.value("energy_kinetic_fem"), 0.5 * moving) < 1e-12);
        let start = run.balance();
        let mut impulse = 0.0;
        for n in 0..10 {
            run.step(2e-3, &[]);
            impulse += 2e-3 * run.value("reaction_x");
            // Strains are 1 %, and a bar that is compressed is softer by 1.5 times that.
            if (1..8).contains(&n) {
                assert!(
                    off(run.value("reaction_x"), 10.0) < 0.03,
                    "{scheme} {n}: {}",
                    run.value("reaction_x")
                );
            }
            assert!((run.balance() - start).abs() < 2e-3 * start, "{scheme}: {}", run.balance() - start);
        }
        assert!(off(impulse, 2.0 * moving) < 0.02, "{scheme}: {impulse}");
        assert!(off(run.value("energy_kinetic_fem"), 0.5 * moving) < 0.05, "it flies back");
    }
}

/// The message with which a scene is refused.
pub fn refused(text: &str) -> String {
    match FemSolver::new(&scene(text), &Options::default()) {
        Ok(_) => panic!("must be refused: {text}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn what_no_one_can_mean_is_refused_where_it_stands() {
    let swing = |history: &str| oscillator(MIDPOINT, 1e-3, history);
    let message = refused(&swing("[[1.0, 0.0], [0.5, 1.0]]"));
    assert!(message.starts_with("test.toml:7:") && message.contains("0.5 s follows 1 s"), "{message}");
    let path =
        swing("[[0.0, 0.0], [1.0, 1.0]]").replace(MIDPOINT, "integrator = \"static\"\npath_speed = 1.0");
    assert!(refused(&path).contains("there is no history"), "{}", refused(&path));

    assert!(refused(&swing("[]")).contains("a history without rows"), "{}", refused(&swing("[]")));

    let skin = |pressures: &str| octant(2, "young = [1e9]", pressures, "integrator = \"static\"");
    let message = refused(&skin("pressures = [{ group = \"skinn\", pressure = 1.0 }]"));
    assert!(message.starts_with("test.toml:9:") && message.contains("`skin`"), "{message}");
    let turned = skin("pressures = [{ group = \"skin\", pressure = 1.0 }]").replace("[0, 1, 2]", "[0, 2, 1]");
    assert!(refused(&turned).contains("normals to opposite sides"), "{}", refused(&turned));

    let message = refused(&bar(-1.0, "integrator = \"static\""));
    assert!(message.starts_with("test.toml:9:") && message.contains("statics has no inertia"), "{message}");
    assert!(refused(&bar(-30000.0, "")).contains("faster than sound in steel"));
    let twice =
        bar(1.0, "").replace("velocities = [", "velocities = [{ nodes = [3], velocity = [0.5, 0.0, 0.0] }, ");
    assert!(refused(&twice).contains("has two velocities"), "{}", refused(&twice));
}

#[test]
fn what_is_unusual_is_warned_of() {
    let warned = |text: &str| {
        FemSolver::new(&scene(text), &Options::default())
            .unwrap()
            .model()
            .warnings
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert!(warned(&oscillator(MIDPOINT, 1e-3, "[[0.0, 0.0], [1.0, 0.0]]")).contains("it loads nothing"));
    assert!(warned(&oscillator(MIDPOINT, 1e-3, "[[0.0, 0.0], [5000.0, 1.0]]")).contains("100 ms is 0.1"));
    assert!(
        warned(&oscillator(MIDPOINT, 1e-3, "[[5000.0, 0.0], [5001.0, 1.0]]"))
            .contains("it is 0 until 5000 s")
    );
    let held = bar(1.0, "").replace("velocity = [1.0, 0.0, 0.0]", "velocity = [0.0, 1.0, 0.0]");
    assert!(warned(&held).contains("they stay at rest"), "{}", warned(&held));
    let skin = |pressure: &str| {
        let of = format!("pressures = [{{ group = \"skin\", pressure = {pressure} }}]");
        warned(&octant(2, "young = [1e9]", &of, "integrator = \"static\""))
    };
    assert!(skin("0.0").contains("0 Pa load nothing"));
    assert!(skin("1e12").contains("bar"));
    assert!(!skin("1e5").contains("structure.pressures"), "{}", skin("1e5"));
}

/// A pulse of 4 ms in the middle between two instants 10 ms apart: the mean of a step has it, an instant does not.
#[test]
fn rows_between_two_instants_of_a_step_are_said_to_be_unseen() {
    let pulse = "[[0.012, 0.0], [0.014, 50.0], [0.016, 0.0]]";
    let said = |fem: &str, step: f64| {
        let text = oscillator(fem, step, pulse);
        let plan = Plan { end_time: 0.1, window: step, ..Plan::default() };
        Run::with(&text, plan).ready.warnings.iter().any(|w| w.message.contains("is not seen"))
    };
    assert!(said("integrator = \"newmark\"", 1e-2));
    assert!(said("integrator = \"static\"", 1e-2));
    assert!(!said("integrator = \"newmark\"", 1e-3));
    assert!(!said(MIDPOINT, 1e-2));
}

/// A membrane under a pressure with a history, held at one corner until 2 ms, thrown.
fn everything(fem: &str) -> String {
    let extra = "velocities = [{ group = \"skin\", velocity = [0.0, 0.0, 1.0] }]\n\
                 loads = [{ nodes = [0], force = [1.0, 0.0, 0.0], history = [[0.0, 0.0], [0.003, 5.0]] }]\n\
                 pressures = [{ group = \"skin\", pressure = 1e4, history = [[0.0, 0.5], [0.01, 1.0]] }]";
    octant(3, "young = [1e8]\npoisson = 0.3\nwrinkles = false", extra, fem).replace(
        "supports = [",
        "supports = [{ nodes = [0], released_at = 0.002 }, { nodes = [7], directions = \"z\", released_at = 0.004, motion = \
         [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 1.0]] }, ",
    )
}

#[test]
fn windows_of_loads_and_supports_in_time_are_repeatable_and_allocate_nothing() {
    for (fem, sampling) in [
        ("time_step = 1e-4", Sampling::Means),
        ("integrator = \"generalized_alpha\"\ntime_step = 5e-4", Sampling::Means),
        ("integrator = \"newmark\"\ntime_step = 5e-4", Sampling::AtEnds),
        ("integrator = \"static\"\nload_steps = { first = 1e-3 }", Sampling::AtEnds),
    ] {
        let text = everything(fem);
        let text = if fem.contains("static") { text.replace("velocities = ", "# ") } else { text };
        let mut run = Run::with(&text, coupled_plan(1e-3, sampling, 1, 1));
        let force: Vec<f64> = (0..run.force_len).map(|i| (i as f64).sin()).collect();
        let other: Vec<f64> = force.iter().map(|f| -2.0 * f).collect();
        for window in 0..6 {
            let before = allocations();
            run.solve(1e-3, &force).unwrap();
            let first = run.output.iter().map(|x| x.to_bits()).fold(0_u64, |h, x| h.rotate_left(7) ^ x);
            run.solve(5e-4, &other).unwrap();
            run.solve(1e-3, &force).unwrap();
            let again = run.output.iter().map(|x| x.to_bits()).fold(0_u64, |h, x| h.rotate_left(7) ^ x);
            assert_eq!(first, again, "{fem}, window {window}");
            run.commit(1e-3);
            assert!(
                window == 0 || allocations() == before,
                "{fem}, window {window}: {}",
                allocations() - before
            );
        }
    }
}
