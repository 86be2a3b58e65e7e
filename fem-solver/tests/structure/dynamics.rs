//! Motion in time against closed forms: orders, energies, work (verification F4, F10, F11).

use crate::common::{Run, coupled_plan, off, random};
use interface_defs::Sampling;

/// Every integrator in time, as it stands in a scene, with the load that it takes.
const SCHEMES: [(&str, Sampling); 6] = [
    ("integrator = \"central_difference\"\nallow_unstable = true", Sampling::Means),
    ("integrator = \"generalized_alpha\"", Sampling::Means),
    ("integrator = \"generalized_alpha\"\nrho_inf = 0.5", Sampling::Means),
    ("integrator = \"generalized_alpha\"\nrho_inf = 0.0", Sampling::AtEnds),
    ("integrator = \"newmark\"", Sampling::AtEnds),
    ("integrator = \"bossak\"\nalpha = -0.1", Sampling::AtEnds),
];

/// A mass of 1 kg on a spring of 100 N/m along z, at rest where the spring is free; a load of 100 N
/// stretches it to 1 m. Released, it swings about there: `u = 1 - cos(10 t)`.
fn oscillator(scheme: &str, step: f64) -> Run {
    Run::alone(
        &format!(
            r#"
end_time = 10.0
[structure]
nodes = [[0.0, 0.0, 0.0]]
masses = [{{ nodes = [0], mass = 1.0 }}]
springs = [{{ nodes = [0], stiffness = [0.0, 0.0, 100.0] }}]
loads = [{{ nodes = [0], force = [0.0, 0.0, 100.0] }}]
supports = [{{ nodes = [0], directions = "xy" }}]
form_finding = "none"
[[gauge]]
name = "mass"
at = [0.0, 0.0, 0.0]
quantity = "displacement"
[fem]
time_step = {step:?}
{scheme}
"#
        ),
        step,
    )
}

#[test]
fn the_period_of_a_linear_oscillator_is_off_by_what_its_scheme_is_known_for() {
    // V-F11: numerical over exact period at w h = 0.1, 0.2, 0.5.
    let trapezoid = [1.000832779, 1.003324491, 1.020497038];
    let central = [0.999583038, 0.998328587, 0.989392701];
    for (scheme, ratios) in [
        ("integrator = \"central_difference\"", central),
        ("integrator = \"newmark\"", trapezoid),
        ("integrator = \"generalized_alpha\"", trapezoid),
    ] {
        for (wh, ratio) in [0.1, 0.2, 0.5].into_iter().zip(ratios) {
            let step = wh / 10.0;
            let mut run = oscillator(scheme, step);
            for n in 1..=400 {
                run.step(step, &[]);
                let exact = 1.0 - (f64::from(n) * wh / ratio).cos();
                // Ratios are printed to 5e-10, which 400 steps turn into n w h times that; Newton's
                // tolerance of 1e-10 adds up as does its error of velocity.
                let allowed = 400.0 * wh * 1e-9 + 400.0 * 1e-10;
                let u = run.value("mass_uz");
                assert!(
                    (u - exact).abs() < allowed,
                    "{scheme} at w h = {wh}: {u} is not {exact} after {n} steps"
                );
            }
        }
    }
}

#[test]
fn central_differences_are_stable_up_to_two_over_the_frequency_and_no_further() {
    let growth = |wh: f64| {
        let mut run = oscillator("integrator = \"central_difference\"\nallow_unstable = true", wh / 10.0);
        let mut largest = [0.0_f64; 2];
        for n in 0..80 {
            run.step(wh / 10.0, &[]);
            let at = usize::from(n >= 40);
            largest[at] = largest[at].max((run.value("mass_uz") - 1.0).abs());
        }
        (largest[1] / largest[0]).powf(1.0 / 40.0)
    };
    assert!((growth(1.99) - 1.0).abs() < 1e-3);
    // Per step 1.326584; the mode that decays is gone after some steps.
    assert!((growth(2.02) / 1.326584 - 1.0).abs() < 1e-6, "{}", growth(2.02));
}

/// V-F10: mass of 10 kg in the middle of two massless cables, E A = 1e5, N0 = 1000, released at `a0`.
fn duffing(a0: f64, scheme: &str, step: f64, more: &str) -> Run {
    let text = format!(
        r#"
end_time = 10.0
[structure]
nodes = [[-1.0, 0.0, 0.0], [0.0, 0.0, {a0:?}], [1.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1], length = 1.0 }}, {{ nodes = [1, 2], length = 1.0 }}]
cable = {{ young = 1e9, area = 1e-4, density = 0.0, prestress = 1e7 }}
masses = [{{ nodes = [1], mass = 10.0 }}]
supports = [{{ nodes = [0, 2] }}]
form_finding = "none"
{more}
[[gauge]]
name = "mass"
at = [0.0, 0.0, {a0:?}]
quantity = "displacement"
[[gauge]]
name = "mass"
at = [0.0, 0.0, {a0:?}]
quantity = "velocity"
[fem]
time_step = {step:?}
{scheme}
"#
    );
    Run::alone(&text, step)
}

const PERIODS: [(f64, f64, f64); 3] = [
    (0.05, 0.424885916295, 0.728868986856),
    (0.2, 0.283147441685, 4.0),
    (0.5, 0.140404421438, 19.0394327647),
];

#[test]
fn every_scheme_is_of_second_order_on_a_nonlinear_oscillator() {
    let (a0, period, _) = PERIODS[1];
    for (scheme, _) in SCHEMES {
        // A quarter of the period: the mass passes the middle, where the error of its phase shows.
        let error = |steps: u32| {
            let step = 0.25 * period / f64::from(steps);
            let mut run = duffing(a0, scheme, step, "");
            (0..steps).for_each(|_| run.step(step, &[]));
            run.value("mass_uz") + a0
        };
        let (coarse, fine) = (error(50), error(100));
        let order = (coarse / fine).abs().log2();
        // Errors of third order are some percent of those of second order at these steps.
        assert!((order - 2.0).abs() < 0.05, "{scheme}: order {order}, errors {coarse:.2e} {fine:.2e}");
        // Extrapolated it passes the middle when it must: an order that is off by 0.05 leaves 4/3 (2^0.05 - 1).
        assert!((fine + (fine - coarse) / 3.0).abs() < 0.05 * fine.abs(), "{scheme}");
    }
}

#[test]
fn a_nonlinear_oscillator_has_its_exact_period_and_speed() {
    for (a0, period, speed) in PERIODS {
        let steps = 2000;
        let step = period / f64::from(steps);
        let mut run = duffing(a0, SCHEMES[0].0, step, "");
        let mut fastest = 0.0_f64;
        for _ in 0..steps {
            run.step(step, &[]);
            fastest = fastest.max(run.gauge("mass_vz")[2].abs().max(run.gauge("mass_vz")[1].abs()));
        }
        // (w h)^2 / 24 relative error of the period for w h = 2 pi / 2000, three times that where the
        // spring stiffens; where it turns, u'' (dt)^2 / 2 of that is left.
        let phase = (2.0 * std::f64::consts::PI / f64::from(steps)).powi(2) / 8.0;
        assert!(run.value("mass_uz").abs() < a0 * phase, "{a0}: {}", run.value("mass_uz"));
        assert!(off(fastest, speed) < 10.0 * phase, "{a0}: {fastest}");
        let energy = run.value("energy_stored_fem") + run.value("energy_kinetic_fem");
        assert!(energy.abs() < 1e-3 * 5.0 * speed * speed * phase * 1e3, "{a0}: {energy}");
    }
}

/// V-F4: a bar of 10 kg at its end, E A = 1e5, released horizontally.
fn pendulum(scheme: &str, step: f64) -> Run {
    let text = format!(
        r#"
end_time = 10.0
gravity = [0.0, -9.81, 0.0]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}]
cable = {{ young = 1e9, area = 1e-4, density = 0.0, tension_only = false }}
masses = [{{ nodes = [1], mass = 10.0 }}]
supports = [{{ nodes = [0] }}]
form_finding = "none"
[fem]
time_step = {step:?}
{scheme}
"#
    );
    Run::coupled(&text, 0.2, Sampling::Means)
}

#[test]
fn an_elastic_pendulum_swings_as_the_exact_one() {
    let exact = [
        (0.981441144, -0.194716871),
        (0.720885888, -0.695983948),
        (-0.031194522, -1.002438081),
        (-0.755484203, -0.658101756),
        (-0.986194408, -0.168557779),
    ];
    for (scheme, order) in [(SCHEMES[0].0, 2.0), (SCHEMES[1].0, 2.0)] {
        let path = |step: f64| -> Vec<[f64; 2]> {
            let mut run = pendulum(scheme, step);
            (0..5)
                .map(|_| {
                    run.step(0.2, &[]);
                    let u = run.displacement(1);
                    [1.0 + u[0], u[1]]
                })
                .collect()
        };
        let (coarse, fine) = (path(2e-4), path(1e-4));
        for ((c, f), (x, y)) in coarse.iter().zip(&fine).zip(exact) {
            for (c, f, exact) in [(c[0], f[0], x), (c[1], f[1], y)] {
                let extrapolated = f + (f - c) / (2.0_f64.powf(order) - 1.0);
                // 9 digits are printed; the term of fourth order is (100 rad/s * 2e-4 s)^2 of the second.
                let allowed = 2e-9 + 4e-4 * 5.0 * (f - c).abs();
                assert!((extrapolated - exact).abs() < allowed, "{scheme}: {extrapolated} is not {exact}");
            }
        }
    }
}

#[test]
fn a_pendulum_swings_with_its_exact_period_and_pulls_as_it_should_at_the_bottom() {
    // V-F4: periods and N / m g = 3 - 2 cos(a) at the bottom, of a rigid pendulum. The bar has E A = 1e10 N: its strain is
    // 5e-8 at most. It starts under the tension that holds it, m g cos(a), so that it does not ring.
    for (degrees, period, pull) in [
        (30.0_f64, 2.04098988952, 1.26794919),
        (90.0, 2.36784194758, 3.0),
        (170.0, 4.89352427411, 4.96961551),
    ] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let (x, z) = (sine, -cosine);
        let steps = 4000;
        let step = 0.25 * period / f64::from(steps);
        let text = format!(
            r#"
end_time = 10.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [{x:?}, 0.0, {z:?}]]
cables = [{{ nodes = [0, 1] }}]
cable = {{ young = 1e14, area = 1e-4, density = 0.0, prestress = {:?}, tension_only = false }}
masses = [{{ nodes = [1], mass = 10.0 }}]
supports = [{{ nodes = [0] }}]
form_finding = "none"
[[gauge]]
name = "mass"
at = [{x:?}, 0.0, {z:?}]
quantity = "displacement"
[[gauge]]
name = "bar"
at = [{x:?}, 0.0, {z:?}]
quantity = "tension"
[fem]
integrator = "generalized_alpha"
"#,
            98.1 * cosine / 1e-4
        );
        let mut run = Run::alone(&text, step);
        (0..steps).for_each(|_| run.step(step, &[]));
        // A quarter of the period takes it to the bottom, where it is fastest: an error of phase of second order, of some
        // (w h)^2 / 12 = 1e-8, more where it starts slowly; and half the strain.
        let fastest = (2.0 * 9.81 * (1.0 - cosine)).sqrt();
        let late = (x + run.value("mass_ux")) / (fastest * period);
        assert!(late.abs() < 1e-6, "{degrees} degrees: late by {late} periods");
        assert!(
            off(run.value("bar_tension"), 98.1 * pull) < 1e-5,
            "{degrees}: {}",
            run.value("bar_tension") / 98.1
        );
    }
}

#[test]
fn a_pendulum_keeps_its_energy_over_many_swings() {
    // Explicit: an error of (w h)^2 / 8 of what the bar itself stores, and no drift: w h = 0.1, and 3 m g
    // stretch the bar by 3e-3 m, 0.43 J of 98.1 J. Midpoint: what Newton leaves, 1e-10 of 300 N times
    // the way of 1e-3 m in each of 20 000 steps; steps of w h = 2 keep it as well.
    for (scheme, step, allowed) in
        [(SCHEMES[0].0, 1e-3, 1e-4), (SCHEMES[1].0, 1e-3, 1e-8), (SCHEMES[1].0, 0.02, 1e-8)]
    {
        let mut run = pendulum(scheme, step);
        let start = run.balance();
        let mut worst = 0.0_f64;
        for _ in 0..100 {
            run.step(0.2, &[]);
            worst = worst.max((run.balance() - start).abs());
        }
        assert!(worst / 98.1 < allowed, "{scheme} at {step} s: {worst} J");
    }
}

#[test]
fn a_net_that_goes_slack_and_taut_keeps_its_energy_under_the_midpoint_rule() {
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = { type = "rectangular_net", cells = [6, 5], spacing = 0.15 }
cable = { young = 8e9, area = 1.2e-5, density = 7850.0, prestress = -1e7 }
[[gauge]]
name = "one"
group = "one"
quantity = "tension"
[[structure.groups]]
name = "one"
nodes = [16, 17]
[fem]
integrator = "generalized_alpha"
newton = { tolerance = 1e-12 }
"#;
    let mut run = Run::coupled(text, 2e-4, Sampling::Means);
    let start = run.balance();
    let (mut slack, mut most) = (0, 0.0_f64);
    for window in 0..300 {
        let mut force = vec![0.0; run.force_len];
        if window < 20 {
            [16, 17, 23, 24].iter().for_each(|node| force[3 * node + 2] = 200.0);
        }
        run.step(2e-4, &force);
        slack += u32::from(run.value("one_tension") == 0.0);
        most = most.max(run.value("energy_kinetic_fem"));
        // 1e-12 of some 1e4 N over some 1e-3 m in each of 300 steps.
        assert!((run.balance() - start).abs() < 3e-9, "window {window}: {}", run.balance() - start);
    }
    assert!(slack > 0 && most > 1.0, "{slack} windows slack, {most} J");
}

/// Six grounded springs in a chain of masses: linear, so that work and energy can be exact.
fn linear(scheme: &str, damping: f64) -> String {
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
masses = [{{ nodes = [0, 1, 2], mass = 2.0 }}]
springs = [{{ nodes = [0, 1], stiffness = [100.0, 200.0, 300.0] }}, {{ nodes = [2], stiffness = [50.0, 60.0, 70.0] }}]
damping = {damping:?}
[fem]
time_step = 0.003
{scheme}
"#
    )
}

#[test]
fn the_midpoint_rule_closes_the_balance_of_a_linear_structure_to_rounding() {
    for damping in [0.0, 3.0] {
        let mut run = Run::with(&linear(SCHEMES[1].0, damping), coupled_plan(0.01, Sampling::Means, 2, 1));
        let mut noise = random(5);
        let start = run.balance();
        let mut moved = 0.0_f64;
        for _ in 0..200 {
            let force: Vec<f64> = (0..run.force_len).map(|_| 100.0 * noise()).collect();
            run.step(0.01, &force);
            moved = moved.max(run.value("energy_kinetic_fem"));
            // Newton leaves 1e-10 of the forces, some 200 N over some 0.01 m in each of 800 steps.
            assert!((run.balance() - start).abs() < 800.0 * 2e-8 * 1e-2, "{}", run.balance() - start);
        }
        assert!(moved > 0.1, "{moved} J: it must have moved");
        assert_eq!(run.value("energy_dissipated_fem") > 0.0, damping > 0.0);
    }
}

#[test]
fn work_received_is_the_mean_force_times_the_displacement_whatever_the_sub_steps() {
    for scheme in [SCHEMES[0].0, SCHEMES[1].0] {
        let mut run = Run::with(&linear(scheme, 1.0), coupled_plan(0.01, Sampling::Means, 1, 1));
        let mut noise = random(9);
        let (mut received, mut before) = (0.0, [[0.0; 3]; 3]);
        for _ in 0..50 {
            let force: Vec<f64> = (0..9).map(|_| 100.0 * noise()).collect();
            run.step(0.01, &force);
            let now = [0, 1, 2].map(|node| run.displacement(node));
            for (node, force) in force.as_chunks::<3>().0.iter().enumerate() {
                received += (0..3).map(|c| force[c] * (now[node][c] - before[node][c])).sum::<f64>();
            }
            before = now;
            // Both sides sum products of some 50 N and 1 m: rounding.
            assert!((run.value("energy_received_fem") - received).abs() < 50.0 * 50.0 * 1e-15);
        }
    }
}

#[test]
fn the_imbalance_of_explicit_steps_falls_with_their_square() {
    let worst = |step: f64| {
        let text = linear("integrator = \"central_difference\"", 3.0).replace("0.003", &format!("{step:?}"));
        let mut run = Run::coupled(&text, 0.016, Sampling::Means);
        let mut noise = random(3);
        let start = run.balance();
        let mut worst = 0.0_f64;
        for _ in 0..100 {
            let force: Vec<f64> = (0..9).map(|_| 100.0 * noise()).collect();
            run.step(0.016, &force);
            worst = worst.max((run.balance() - start).abs());
        }
        worst
    };
    let ratio = worst(0.004) / worst(0.002);
    assert!((ratio - 4.0).abs() < 0.2, "{ratio}");
}

#[test]
fn a_support_that_moves_gives_its_work_to_the_balance() {
    for (scheme, _) in SCHEMES {
        let error = |step: f64| {
            let moving = "damping = 1.0\n[[structure.supports]]\nnodes = [0]\n\
                          motion = [[0.0, 0.0, 0.0, 0.0], [0.1, 0.02, 0.0, 0.1], [0.2, 0.0, 0.0, 0.05]]";
            let text = duffing_text_with(moving, scheme, step);
            let mut run = Run::alone(&text, 0.05);
            let start = run.balance();
            for _ in 0..6 {
                run.step(0.05, &[]);
            }
            assert!(run.value("energy_supports_fem").abs() > 1.0);
            (run.balance() - start).abs() / run.value("energy_supports_fem").abs()
        };
        let (coarse, fine) = (error(1e-3), error(2.5e-4));
        // Numerical damping is of third order in h per unit of time, the rest of second; the midpoint
        // rule has no error at all.
        assert!(fine < 1e-10 || (fine < 2e-3 && fine < coarse / 8.0), "{scheme}: {coarse:.1e} {fine:.1e}");
    }
}

fn duffing_text_with(more: &str, scheme: &str, step: f64) -> String {
    format!(
        r#"
end_time = 10.0
[structure]
nodes = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.1], [1.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1], length = 1.0 }}, {{ nodes = [1, 2], length = 1.0 }}]
cable = {{ young = 1e9, area = 1e-4, density = 0.0, prestress = 1e7 }}
masses = [{{ nodes = [1], mass = 10.0 }}]
form_finding = "none"
{more}
[[structure.supports]]
nodes = [2]
[fem]
time_step = {step:?}
{scheme}
"#
    )
}

#[test]
fn scaled_masses_allow_the_step_that_was_asked_for_and_are_told() {
    // A bar of 1 mm in a rope of bars of 1 m: its critical step is a thousandth of the others'.
    let text = |scaling: &str| {
        format!(
            r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.001, 0.0, 0.0], [2.001, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}, {{ nodes = [1, 2] }}, {{ nodes = [2, 3] }}]
cable = {{ young = 1e10, area = 1e-4, density = 7850.0, prestress = 1e6 }}
supports = [{{ nodes = [0, 3] }}]
[fem]
time_step = 2e-4
{scaling}
"#
        )
    };
    let check = |scaling: &str| fem_solver::solver::check::check(&crate::common::scene(&text(scaling)), None);
    assert!(check("").expect_err("is too long").to_string().contains("critical"));
    let report = check("mass_scaling = 3e-4").expect("is slow enough");
    // As modelled; sagged, strains of 1e-3 stiffen it by three times that.
    assert!(report.numbers["critical_step_s"] >= 3e-4 * (1.0 - 1e-2), "{:?}", report.numbers);
    assert!(
        report.warnings.iter().any(|w| w.message.contains("mass scaling added")),
        "{:?}",
        report.warnings
    );
    // Weight is that of the rope, whatever its mass.
    let run = Run::alone(&text("mass_scaling = 3e-4"), 2e-4);
    assert!(off(run.value("reaction_z"), 7850.0 * 1e-4 * 2.001 * 9.81) < 1e-9, "{}", run.value("reaction_z"));
}

/// At rest two wires in line hold a node of a net; drawn to a narrow cone four pull it one way.
#[test]
fn the_critical_step_of_a_loaded_net_is_that_of_its_nodes_drawn_to_a_cone() {
    let check = |ends: [[f64; 3]; 4]| {
        let text = format!(
            r#"
end_time = 1.0
gravity = [0.0, 0.0, 0.0]
[structure]
nodes = [[0.0, 0.0, 0.0], {}]
cables = [{{ nodes = [0, 1] }}, {{ nodes = [0, 2] }}, {{ nodes = [0, 3] }}, {{ nodes = [0, 4] }}]
cable = {{ young = 1e10, area = 1e-4, density = 7850.0, prestress = 0.0 }}
supports = [{{ nodes = [1, 2, 3, 4] }}]
form_finding = "none"
"#,
            ends.map(|end| format!("{end:?}")).join(", ")
        );
        let report = fem_solver::solver::check::check(&crate::common::scene(&text), None).expect("a scene");
        ["critical_step_s", "loaded_critical_step_s"].map(|name| report.numbers[name])
    };
    let e = 1e-3;
    let [at_rest, loaded] = check([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]);
    let [cone, _] = check([[e, 0.0, 1.0], [-e, 0.0, 1.0], [0.0, e, 1.0], [0.0, -e, 1.0]]);
    // 2 k / m with k = 1e6 N/m each and four halves of 0.785 kg.
    assert!(off(at_rest, 2.0 / (2e6_f64 / 1.57).sqrt()) < 1e-9, "{at_rest}");
    assert!(off(loaded, cone) < 1e-5, "{loaded} {cone}");
}
