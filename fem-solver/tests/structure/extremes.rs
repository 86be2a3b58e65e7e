//! Extremes, on both sides of their limits: stiffness, length and mass far apart, mechanisms, slack and flat nets, cables
//! that snap taut, steps short and long, a million steps.

use crate::common::{Run, off, scene};
use fem_solver::FemSolver;
use interface_defs::solver::Solver;
use toolkit::program::Options;

/// A soft and a stiff cable in a row, pulled along; E A of the stiff one is `ratio` times that of the soft.
fn row(ratio: f64) -> String {
    format!(
        r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
supports = [{{ nodes = [0] }}, {{ nodes = [1, 2], directions = "yz" }}]
loads = [{{ nodes = [2], force = [10.0, 0.0, 0.0] }}]
cables = [{{ nodes = [0, 1], young = 1e6 }}, {{ nodes = [1, 2], young = {:?} }}]
cable = {{ young = 1.0, area = 1e-4, density = 0.0 }}
[fem]
integrator = "static"
"#,
        1e6 * ratio
    )
}

#[test]
fn stiffnesses_eight_decades_apart_are_told_apart() {
    // E A e l / L = 10 with E A = 100 in the soft one: x^3 - x = 0.2, x = l / L.
    let soft = (0..60).fold(1.1_f64, |x, _| x - (x * x * x - x - 0.2) / (3.0 * x * x - 1.0));
    for ratio in [1.0, 1e8] {
        let b = Run::alone(&row(ratio), 0.1);
        let x = |run: &Run, node: usize| run.ready.mesh.coordinates[3 * node];
        assert!(off(x(&b, 1), soft) < 1e-9, "{ratio}: {}", x(&b, 1));
        if ratio == 1e8 {
            // The stiff one: e = 10 / 1e10, of which the position keeps eps of 2 m.
            let stretch = x(&b, 2) - x(&b, 1) - 1.0;
            assert!((stretch - 1e-9).abs() < 2e-15, "{stretch}");
        }
        assert!(off(b.value("reaction_x"), -10.0) < 1e-6, "{}", b.value("reaction_x"));
    }
    // At 1e16 the rounding of a position, 1e-17 m, is some 10 N in the stiff one, at both its ends: said, and not computed.
    let mut solver = FemSolver::new(&scene(&row(1e16)), &Options { out: None, shortcuts: true }).unwrap();
    let message =
        solver.prepare(&Default::default(), &mut |_| Ok(())).expect_err("is too stiff").diagnostic.message;
    let at_an_end = message.contains("largest at node 1") || message.contains("largest at node 2");
    assert!(message.contains("did not converge") && at_an_end, "{message}");
}

/// Two cables of 10 m with one of `short` between.
fn with_a_short_one(short: f64) -> String {
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [{:?}, 0.0, 0.0], [{:?}, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}, {{ nodes = [1, 2] }}, {{ nodes = [2, 3] }}]
cable = {{ young = 1e10, area = 1e-4, density = 7850.0, prestress = 1e6 }}
supports = [{{ nodes = [0, 3] }}]
[fem]
integrator = "static"
"#,
        10.0 + short,
        20.0 + short
    )
}

#[test]
fn elements_of_a_tenth_of_a_millimetre_hang_beside_those_of_ten_metres() {
    let run = Run::alone(&with_a_short_one(1e-4), 0.1);
    assert!(off(run.value("reaction_z"), 7850.0 * 1e-4 * 20.0001 * 9.81) < 1e-9);
    let z = |node: usize| run.ready.mesh.coordinates[3 * node + 2];
    assert!((z(1) - z(2)).abs() < 1e-9 && z(1) < -0.1, "{} {}", z(1), z(2));
    // The other end: what no number tells apart from a point is refused.
    let message = refused(&with_a_short_one(1e-16));
    assert!(message.contains("the cable between nodes 1 and 2 has no length"), "{message}");
}

/// Two cables of half a kilogram each, N0 = 1000 N, with a mass between them.
fn heavy(mass: f64, more: &str) -> String {
    format!(
        r#"
end_time = 1e12
[structure]
nodes = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
masses = [{{ nodes = [1], mass = {mass:?} }}]
supports = [{{ nodes = [0, 2] }}]
{more}
[[gauge]]
name = "mass"
at = [0.0, 0.0, 0.0]
quantity = "displacement"
"#
    )
}

const ROPES: &str = r#"
cables = [{ nodes = [0, 1] }, { nodes = [1, 2] }]
cable = { young = 1e9, area = 1e-4, density = 5000.0, prestress = 1e7 }
"#;

#[test]
fn a_thousand_tonnes_swing_on_a_net_of_a_kilogram() {
    // k = 2 N0 / L at small swings: half a period, cut into 400 steps; and so do masses of 1 g and of 1e12 kg, there is no
    // limit of accuracy.
    for mass in [1e-3, 1e6, 1e12] {
        let more = format!(
            "loads = [{{ nodes = [1], force = [0.0, 0.0, 0.02] }}]\nform_finding = \"none\"\n{ROPES}\n[fem]\nintegrator = \
             \"generalized_alpha\"\n"
        );
        // Half of each rope swings with it.
        let half = std::f64::consts::PI * ((mass + 0.5) / 2000.0_f64).sqrt();
        let mut run = Run::alone(&heavy(mass, &more), half / 400.0);
        (0..400).for_each(|_| run.step(half / 400.0, &[]));
        // Twice the static deflection after half a period, to (w h)^2 / 12 of the period: second order at a peak.
        assert!(off(run.value("mass_uz"), 2e-5) < 1e-5, "{mass}: {}", run.value("mass_uz"));
    }
    // Explicitly, too, in steps of its lightest parts: 1000 of them in which it falls as if nothing held it.
    let text = heavy(1e6, ROPES).replace("end_time", "gravity = [0.0, 0.0, -9.81]\nend_time");
    let mut run = Run::alone(&text.replace("supports", "form_finding = \"none\"\nsupports"), 1e-4);
    (0..1000).for_each(|_| run.step(1e-4, &[]));
    let (fall, exact) = (run.value("mass_uz"), -0.5 * 9.81 * 0.01);
    // Ropes of some 1e3 to 3e3 N hold back 1e7 N of weight: 1e-4 of it, by the slope u / L = 0.05 even less.
    assert!(
        off(fall, exact) < 1e-4 && run.balance().abs() < 1e-6 * 9.81e6 * fall.abs(),
        "{fall} {}",
        run.balance()
    );
}

#[test]
fn what_a_net_of_a_kilogram_cannot_hold_is_said_before_a_run() {
    let ropes = |force: f64| {
        format!(
            r#"
[[structure.parts]]
name = "ropes"
element = "cable"
cells = [[0, 1, 2]]
young = 1e9
area = 1e-4
density = 5000.0
prestress = 1e7
rupture_force = {force:?}
[fem]
integrator = "static"
"#
        )
    };
    let hung = |mass: f64, force: f64| {
        heavy(mass, &ropes(force)).replace("end_time", "gravity = [0.0, 0.0, -9.81]\nend_time")
    };
    // 10 kg: E A u^3 + 2 N0 u = P (V-F3), a tension of some N0. 1e6 kg stretch the ropes to five times their length.
    let run = Run::alone(&hung(10.0, 5e4), 0.1);
    let u = -run.ready.mesh.coordinates[5];
    let weight = 10.5 * 9.81;
    assert!(off(1e5 * u * u * u + 2e3 * u, weight) < 1e-9, "{u}");
    let message = refused_at_start(&hung(1e6, 5e4));
    let broken = "element 0 of ropes, (-1.0 0.0 0.0) to (0.0 0.0 0.0) breaks under 100 % of the dead load";
    assert!(message.contains(broken), "{message}");
    // Ropes that cannot break hang, however deep.
    let run = Run::alone(&hung(1e6, 1e300), 0.1);
    let u = -run.ready.mesh.coordinates[5];
    assert!(off(1e5 * u * u * u + 2e3 * u, (1e6 + 0.5) * 9.81) < 1e-9, "{u}");
}

#[test]
fn a_slack_cable_that_snaps_taut_catches_the_mass_and_keeps_the_energy() {
    // 10 kg fall 0.1 m, then stretch a cable of 1 m, E A = 1e5 N: m g (0.1 + d) = E A / 8 ((1 + d)^2 - 1)^2.
    let energy = |d: f64| 1e5 / 8.0 * ((1.0 + d).powi(2) - 1.0).powi(2) - 98.1 * (0.1 + d);
    let (mut low, mut high) = (0.0, 0.1);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if energy(middle) > 0.0 { high = middle } else { low = middle }
    }
    let strain = 0.5 * ((1.0 + low).powi(2) - 1.0);
    let exact = 1e5 * strain * (1.0 + low);
    for fem in ["time_step = 1e-5", "integrator = \"generalized_alpha\"\ntime_step = 2e-5"] {
        let text = format!(
            r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [0.0, 0.0, -0.9]]
cables = [{{ nodes = [0, 1], length = 1.0 }}]
cable = {{ young = 1e9, area = 1e-4, density = 0.0 }}
supports = [{{ nodes = [0] }}]
masses = [{{ nodes = [1], mass = 10.0 }}]
form_finding = "none"
[fem]
{fem}
"#
        );
        let mut run = Run::alone(&text, 1e-3);
        (0..400).for_each(|_| run.step(1e-3, &[]));
        // The peak lasts some (h w)^2 / 8 less than the steps see.
        assert!(
            off(run.measure("max_cable_force"), exact) < 1e-4,
            "{} {exact}",
            run.measure("max_cable_force")
        );
        assert!(run.balance().abs() < 1e-3 * 98.1 * 0.1, "{}", run.balance());
    }
}

#[test]
fn a_slack_cable_that_is_not_reached_carries_nothing() {
    // 0.1 m of slack: 10 kg fall for less than sqrt(0.2 / g) = 0.1428 s, then for a little longer.
    for (end, taut) in [(0.142, false), (0.144, true)] {
        let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [0.0, 0.0, -0.9]]
cables = [{ nodes = [0, 1], length = 1.0 }]
cable = { young = 1e9, area = 1e-4, density = 0.0 }
supports = [{ nodes = [0] }]
masses = [{ nodes = [1], mass = 10.0 }]
form_finding = "none"
[fem]
time_step = 1e-5
"#;
        let mut run = Run::alone(text, 1e-3);
        (0..(end * 1e3) as usize).for_each(|_| run.step(1e-3, &[]));
        let force = run.measure("max_cable_force");
        assert!(if taut { force > 100.0 } else { force == 0.0 }, "{end}: {force}");
    }
}

#[test]
fn a_net_hangs_alike_just_slack_and_just_taut() {
    // A strain of 1e-9 on either side of none, against one of some 1e-5 by the weight: the sag changes by half of 1e-4 of
    // itself at most. Without tension as modelled the tangent is singular across the net.
    let sag = |prestress: f64| {
        let mut run = Run::alone(
            &format!(
                r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = {{ type = "rectangular_net", cells = [10, 10], spacing = 0.15 }}
cable = {{ young = 1e11, area = 1.25e-5, density = 7850.0, prestress = {prestress:?} }}
"#
            ),
            1e-4,
        );
        run.measure("sag")
    };
    let (slack, none, taut) = (sag(-100.0), sag(0.0), sag(100.0));
    assert!(slack > none && none > taut, "{slack} {none} {taut}");
    assert!(off(slack, none) < 1e-4 && off(taut, none) < 1e-4, "{slack} {none} {taut}");
    // And far on both sides: a strain e of slack hangs as an inextensible net of that length, a tension as a film; from
    // -1e-4 to -4e-4 the depth doubles, from 4e-4 to 1e-3 it falls by 2.5, where the weight's own strain is small.
    assert!(off(sag(-4e8) / sag(-1e8), 2.0) < 0.02, "{}", sag(-4e8) / sag(-1e8));
    assert!(off(sag(4e7) / sag(1e8), 2.5) < 0.02, "{}", sag(4e7) / sag(1e8));
}

/// Two unstressed bars in a line, E A = 1e5 N, loaded across by `load`.
fn flat(load: f64) -> String {
    format!(
        r#"
end_time = 1.0
[structure]
nodes = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}, {{ nodes = [1, 2] }}]
cable = {{ young = 1e9, area = 1e-4, density = 0.0, tension_only = false }}
loads = [{{ nodes = [1], force = [0.0, 0.0, {load:?}] }}]
supports = [{{ nodes = [0, 2] }}, {{ nodes = [1], directions = "y" }}]
[fem]
integrator = "static"
"#
    )
}

#[test]
fn a_flat_unstressed_structure_carries_any_load_across_and_none_is_a_mechanism() {
    // V-F3 with N0 = 0: E A u^3 = P.
    for load in [1e-6, 1e-3, 1.0, 1e3] {
        let run = Run::alone(&flat(load), 0.1);
        let (u, exact) = (run.ready.mesh.coordinates[5], (load / 1e5).cbrt());
        assert!(off(u, exact) < 1e-9, "{load}: {u} is not {exact}");
    }
    let message = refused_at_start(&flat(0.0));
    assert!(message.contains("mechanism: node 1 at (0, 0, 0) in z can move"), "{message}");
}

/// Message with which the numbers of a scene are refused.
fn refused(text: &str) -> String {
    match FemSolver::new(&scene(text), &Options::default()) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("must be refused"),
    }
}

/// Message of a structure that is refused as a run starts.
fn refused_at_start(text: &str) -> String {
    let mut solver = FemSolver::new(&scene(text), &Options { out: None, shortcuts: true }).unwrap();
    solver.prepare(&Default::default(), &mut |_| Ok(())).expect_err("must be refused").diagnostic.message
}

/// A square of four bars on two hinges, and a diagonal of the section `diagonal` where that is above 0.
fn frame(diagonal: f64) -> String {
    let brace =
        if diagonal > 0.0 { format!(", {{ nodes = [0, 2], area = {diagonal:?} }}") } else { String::new() };
    format!(
        r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
cables = [{{ nodes = [1, 2] }}, {{ nodes = [2, 3] }}, {{ nodes = [3, 0] }}{brace}]
cable = {{ young = 1e11, area = 1e-4, density = 0.0, tension_only = false }}
supports = [{{ nodes = [0, 1] }}, {{ nodes = [2, 3], directions = "y" }}]
[fem]
integrator = "static"
"#
    )
}

#[test]
fn a_mechanism_is_refused_with_the_node_that_is_free_and_its_direction() {
    let message = refused_at_start(&frame(0.0));
    // Node 2 and node 3 sway together, along x: either may be named.
    assert!(
        message.contains("mechanism: node 2 at (1, 0, 1) in x")
            || message.contains("node 3 at (0, 0, 1) in x"),
        "{message}"
    );
    // The thinnest of braces makes a structure of it: 1e-8 of the bars' section.
    let mut run = Run::alone(&frame(1e-12), 0.1);
    run.step(0.1, &[]);
    assert!(run.value("reaction_x").abs() < 1e-12, "{}", run.value("reaction_x"));
    // With inertia it may swing: said, and computed.
    let swinging =
        frame(0.0).replace("density = 0.0", "density = 7850.0").replace("integrator = \"static\"", "");
    Run::alone(&swinging, 1e-5).step(1e-5, &[]);
}

/// A pendulum of 10 kg on an elastic bar, released level.
fn pendulum(scheme: &str, step: f64, window: f64) -> Run {
    Run::alone(
        &format!(
            r#"
end_time = 1e5
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}]
cable = {{ young = 1e9, area = 1e-4, density = 0.0, tension_only = false }}
supports = [{{ nodes = [0] }}]
masses = [{{ nodes = [1], mass = 10.0 }}]
form_finding = "none"
[fem]
integrator = "{scheme}"
time_step = {step:?}
newton.tolerance = 1e-12
"#
        ),
        window,
    )
}

#[test]
fn a_million_steps_let_no_energy_drift() {
    let mut run = pendulum("generalized_alpha", 0.005, 5.0);
    let mut worst = 0.0_f64;
    for _ in 0..1000 {
        run.step(5.0, &[]);
        worst = worst.max(run.balance().abs());
    }
    // Each step leaves the tolerance of Newton, 1e-12 of the forces over some mm, or the rounding of u at w h ~ 1.
    assert!(worst < 1e-8 * 98.1, "{worst} J");
    // The other side: the trapezoidal rule, which keeps the energy of linear structures only, loses 100 times as much in
    // its first thousand.
    let mut newmark = pendulum("newmark", 0.005, 5.0);
    newmark.step(5.0, &[]);
    assert!(newmark.balance().abs() > 1e-6 * 98.1, "{} J", newmark.balance());
}

#[test]
fn steps_from_a_tenth_of_a_microsecond_to_a_tenth_of_a_second_keep_the_energy() {
    // And further down without end: displacements count from where they began, so that nothing is lost beside a position.
    for step in [1e-15, 1e-11, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1] {
        let mut run = pendulum("generalized_alpha", step, step);
        (0..100).for_each(|_| run.step(step, &[]));
        // The energy that has turned from one kind to another, m (g t)^2 / 2; u rounds to eps, which M / h^2 turns into force
        // over the way of a step.
        let turned = (0.5 * 10.0 * (9.81 * 100.0 * step).powi(2)).min(98.1);
        let rounding = 100.0 * f64::EPSILON * 10.0 / (step * step) * (step * step * 10.0).max(1e-12) + 1e-8;
        assert!(run.balance().abs() < rounding.min(1e-9 * turned + 1e-8 * step), "{step}: {}", run.balance());
    }
}

#[test]
fn steps_beyond_a_tenth_of_a_second_are_shortened_and_said_or_refused() {
    // A tenth of the pendulum's period and more: where Newton fails the window is begun anew with shorter steps, and counted;
    // an answer keeps the energy, whatever it took.
    let mut troubled = 0;
    for step in [0.1, 0.2, 0.3, 1.0] {
        let mut run = pendulum("generalized_alpha", step, step);
        for _ in 0..20 {
            match run.solve(step, &[]) {
                Ok(()) => run.commit(step),
                Err(fault) => {
                    assert!(
                        step > 0.1 && fault.diagnostic.message.contains("a shorter window"),
                        "{}",
                        fault.diagnostic.message
                    );
                    troubled += 1;
                    break;
                }
            }
        }
        let warnings = run.solver.finish().expect("is prepared").warnings;
        let said = warnings.iter().any(|w| w.message.contains("were begun anew with shorter steps"));
        assert_eq!(run.count("refined_windows") > 0, said, "{warnings:?}");
        troubled += u64::from(said);
    }
    assert!(troubled > 0);
    // 10 s: an eighth of it is too long still.
    for scheme in ["generalized_alpha", "newmark", "bossak"] {
        let mut run = pendulum(scheme, 10.0, 10.0);
        let failed = (0..3).find_map(|_| {
            let fault = run.solve(10.0, &[]).err();
            if fault.is_none() {
                run.commit(10.0);
            }
            fault
        });
        let message = failed.expect("is too long").diagnostic.message;
        assert!(message.contains("node 1 at (1, 0, 0)") && message.contains("a shorter window"), "{message}");
    }
    // The trapezoidal rule keeps the energy of linear structures only: below 1 % of it at 0.01 s, not at 0.3 s, where its
    // balance says so.
    let lost = |step: f64| {
        let mut run = pendulum("newmark", step, step);
        (0..100).for_each(|_| run.step(step, &[]));
        run.balance().abs() / 98.1
    };
    assert!(lost(0.01) < 0.01 && lost(0.3) > 0.01, "{} {}", lost(0.01), lost(0.3));
}
