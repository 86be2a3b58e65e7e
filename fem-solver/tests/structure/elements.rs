//! Elements in structures: sliding ropes, brakes, rupture (verification F9, F12).

use crate::common::{Run, coupled_plan, off, random, scene};
use interface_defs::Sampling;
use interface_defs::diagnostic::code;
use interface_defs::solver::Solver;

fn slider(rigidity: f64, friction: f64) -> Run {
    Run::alone(
        &format!(
            r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [2.4, 0.0, -2.7], [4.0, 0.0, -1.0]]
supports = [{{ nodes = [0, 2] }}]
loads = [{{ nodes = [1], force = [0.0, 0.0, -1000.0] }}]
[[structure.parts]]
name = "rope"
element = "sliding_cable"
cells = [[0, 1, 2]]
young = {:?}
area = 1e-4
density = 0.0
length = 6.0
friction = {friction:?}
[fem]
integrator = "static"
[[gauge]]
name = "rope"
group = "rope"
quantity = "tension"
"#,
            rigidity / 1e-4
        ),
        0.1,
    )
}

#[test]
fn a_load_on_a_slider_hangs_where_one_tension_holds_it() {
    // V-F9, printed to 12 digits.
    for (rigidity, tension, x, z) in [
        (1e5, 667.336484437, 2.44197056855, -2.76259409827),
        (1e4, 643.507850492, 2.40509548707, -2.9685537902),
    ] {
        let run = slider(rigidity, 0.0);
        let at = &run.ready.mesh.coordinates[3..6];
        assert!(off(run.value("rope_tension_max"), tension) < 1e-10, "{}", run.value("rope_tension_max"));
        assert!((at[0] - x).abs() < 1e-10 && (at[2] - z).abs() < 1e-10, "{at:?}");
    }
}

#[test]
fn friction_holds_a_slider_short_of_where_it_would_slide_to() {
    let free = slider(1e5, 0.0).ready.mesh.coordinates[3];
    let held = slider(1e5, 0.1).ready.mesh.coordinates[3];
    // It stood left of its frictionless place, and friction of mu phi = 0.1 (1.5 rad) is less than what drives it.
    assert!(held < free && held > 2.3, "{held} {free}");
}

/// A loop of 9 m through two held nodes and a loaded one, 1 000 N: wherever it begins, it hangs alike.
#[test]
fn a_closed_rope_hangs_alike_wherever_it_begins() {
    let hang = |nodes: &str| {
        let text = format!(
            r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [2.4, 0.0, -2.7], [4.0, 0.0, -1.0]]
supports = [{{ nodes = [0, 2] }}]
loads = [{{ nodes = [1], force = [0.0, 0.0, -1000.0] }}]
[[structure.parts]]
name = "rope"
element = "sliding_cable"
cells = [{nodes}]
young = 1e8
area = 1e-4
density = 0.0
length = 9.0
[fem]
integrator = "static"
[[gauge]]
name = "rope"
group = "rope"
quantity = "tension"
"#
        );
        let report = fem_solver::solver::check::check(&scene(&text), None).expect("a scene").builds.join(" ");
        let words: Vec<&str> = report.split_whitespace().collect();
        let at = words.windows(2).position(|pair| pair == ["Newton", "iterations)"]).expect("are counted");
        let iterations: u32 = words[at - 1].trim_start_matches('(').parse().expect("a number");
        assert!(iterations < 10, "{nodes}: {iterations} iterations");
        let run = Run::alone(&text, 0.1);
        let at: [f64; 3] = run.ready.mesh.coordinates[3..6].try_into().expect("three numbers");
        (at, run.value("rope_tension_max"))
    };
    let (at, tension) = hang("[1, 2, 0, 1]");
    let (other, _) = hang("[0, 1, 2, 0]");
    for c in 0..3 {
        assert!((at[c] - other[c]).abs() < 1e-9, "{at:?} {other:?}");
    }
    // Equilibrium by hand: one tension along both lines to the held nodes, and its elongation.
    let to = |x: f64, z: f64| [(x - at[0]), (z - at[2])];
    let (first, second) = (to(0.0, 0.0), to(4.0, -1.0));
    let (a, b) = (first[0].hypot(first[1]), second[0].hypot(second[1]));
    let pull = |c: usize| tension * (first[c] / a + second[c] / b);
    assert!(pull(0).abs() < 1e-5 && (pull(1) - 1000.0).abs() < 1e-5, "{} {}", pull(0), pull(1));
    let length = a + b + 17.0_f64.sqrt();
    let stretch = length / 9.0;
    assert!(off(tension, 1e4 * 0.5 * stretch * (stretch * stretch - 1.0)) < 1e-9, "{tension} N at {stretch}");
}

#[test]
fn two_masses_over_a_frictionless_node_fall_as_atwood_says() {
    // V-F9: a = 2.4525 m/s2, T = 36.7875 N; the rope starts under that tension, so nothing swings.
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [0.0, 0.0, -1.5]]
supports = [{ nodes = [1] }]
masses = [{ nodes = [0], mass = 3.0 }, { nodes = [2], mass = 5.0 }]
form_finding = "none"
[[structure.parts]]
name = "rope"
element = "sliding_cable"
cells = [[0, 1, 2]]
young = 1e9
area = 1e-4
density = 0.0
prestress = 367875.0
[[gauge]]
name = "rope"
group = "rope"
quantity = "tension"
[fem]
time_step = 1e-4
"#;
    let mut run = Run::with(text, coupled_plan(1e-4, Sampling::Means, 1, 1));
    let start = run.balance();
    for _ in 0..2000 {
        run.step(1e-4, &[]);
    }
    let fallen = -run.displacement(2)[2];
    // Position Verlet is exact under a constant force; 2000 additions round.
    assert!((fallen - 0.5 * 2.4525 * 0.04).abs() < 1e-9, "{fallen}");
    assert!((run.value("rope_tension_max") - 36.7875).abs() < 1e-5, "{}", run.value("rope_tension_max"));
    assert!((run.balance() - start).abs() < 1e-7, "{}", run.balance() - start);
}

#[test]
fn a_brake_in_a_structure_takes_the_energy_of_its_curve() {
    // V-F12, driven to 0.02 m and back to where its force is 0.
    let text = r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
[[structure.supports]]
nodes = [0]
[[structure.supports]]
nodes = [1]
motion = [[0.0, 0.0, 0.0, 0.0], [0.5, 0.02, 0.0, 0.0], [1.0, 0.009803921569, 0.0, 0.0]]
[[structure.parts]]
name = "brake"
element = "brake"
cells = [[0, 1]]
stiffness = 5e6
curve = [[0.01, 5e4], [1.03, 1.5e5]]
[fem]
integrator = "static"
[[gauge]]
name = "brake"
group = "brake"
quantity = "tension"
[[gauge]]
name = "brake"
group = "brake"
quantity = "elongation"
"#;
    // The curve of the case: slope k H / (k + H) over the elongation beyond yield.
    let slope = 5e6 * 1e5 / 5.1e6;
    let text = text.replace("[1.03, 1.5e5]", &format!("[1.01, {:?}]", 5e4 + slope));
    let mut run = Run::alone(&text, 0.05);
    for _ in 0..10 {
        run.step(0.05, &[]);
    }
    assert!(off(run.value("brake_tension"), 50980.392157) < 1e-10, "{}", run.value("brake_tension"));
    assert!((run.value("brake_elongation") - 0.02).abs() < 1e-14);
    for _ in 0..10 {
        run.step(0.05, &[]);
    }
    assert!(run.value("brake_tension").abs() < 1e-4, "{}", run.value("brake_tension"));
    assert!(off(run.value("energy_dissipated_fem"), 495.0019) < 1e-7);
}

const BREAKING: &str = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, -2.0]]
supports = [{ nodes = [0] }]
masses = [{ nodes = [1, 2], mass = 10.0 }]
form_finding = "none"
[[structure.parts]]
name = "upper"
element = "cable"
cells = [[0, 1]]
young = 1e9
area = 1e-5
density = 0.0
rupture_force = 300.0
[[structure.parts]]
name = "lower"
element = "cable"
cells = [[1, 2]]
young = 1e9
area = 1e-5
density = 0.0
"#;

#[test]
fn what_tears_says_where_and_when_and_its_energy_is_booked() {
    for fem in ["time_step = 2e-5", "integrator = \"generalized_alpha\"\ntime_step = 1e-4"] {
        let mut run = Run::alone(&format!("{BREAKING}[fem]\n{fem}\n"), 1e-3);
        let mut torn = None;
        for window in 0..200 {
            run.step(1e-3, &[]);
            if torn.is_none() && run.value("energy_dissipated_fem") > 0.0 {
                torn = Some(window);
            }
        }
        // 300 N in E A = 1e4 N: some 3e4^2 / 2e4 J were stored; the balance closes to the square of the steps.
        let dissipated = run.value("energy_dissipated_fem");
        assert!(torn.is_some() && (4.0..5.5).contains(&dissipated), "{torn:?} {dissipated}");
        assert!(run.balance().abs() < 2e-2 * dissipated, "{} of {dissipated}", run.balance());
        let warnings = run.solver.finish().unwrap().warnings;
        let told = warnings.iter().find(|w| w.code == code::RUPTURE).expect("is told");
        assert!(told.message.contains("element 0 of upper, (0.0 0.0 0.0) to (0.0 0.0 -1.0) broke"), "{told}");
    }
}

#[test]
fn below_its_strength_nothing_tears() {
    // The static force is 196.2 N, the dynamic one at most twice that.
    let strong = BREAKING.replace("300.0", "400.0");
    let mut run = Run::alone(&format!("{strong}[fem]\ntime_step = 2e-5\n"), 1e-3);
    for _ in 0..300 {
        run.step(1e-3, &[]);
    }
    assert_eq!(run.value("energy_dissipated_fem"), 0.0);
    assert!(run.measure("max_cable_force") < 400.0 && run.measure("max_cable_force") > 380.0);
}

#[test]
fn a_dashpot_takes_what_the_mass_loses() {
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0]]
masses = [{ nodes = [0], mass = 2.0 }]
dampers = [{ nodes = [0], viscosity = [0.0, 0.0, 8.0] }]
form_finding = "none"
[[gauge]]
name = "mass"
at = [0.0, 0.0, 0.0]
quantity = "velocity"
"#;
    for fem in ["time_step = 1e-3", "integrator = \"generalized_alpha\"", "integrator = \"newmark\""] {
        let mut run = Run::alone(&format!("{text}[fem]\n{fem}\n"), 1e-3);
        for _ in 0..500 {
            run.step(1e-3, &[]);
        }
        // v = -(m g / c) (1 - exp(-c t / m)); second order: (c h / m)^2 / 12.
        let exact = -2.0 * 9.81 / 8.0 * (1.0 - (-2.0_f64).exp());
        assert!(off(run.value("mass_vz"), exact) < 1e-5, "{fem}: {}", run.value("mass_vz"));
        assert!(run.balance().abs() < 1e-4 * run.value("energy_dissipated_fem"), "{fem}: {}", run.balance());
    }
}

/// A post, a rope with friction over its head, a brake at its end: everything with a history.
fn barrier(fem: &str) -> String {
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 2.0], [-1.5, 0.3, 0.0], [-2.0, 0.4, 0.0], [4.0, 0.1, 2.0]]
supports = [{{ nodes = [0], rotations = "xyz" }}, {{ nodes = [5, 6] }}]
damping = 5.0
form_finding = "none"
masses = [{{ nodes = [3], mass = 5.0 }}, {{ nodes = [4], mass = 1.0 }}]
[[structure.parts]]
name = "post"
element = "beam"
cells = [[0, 1], [1, 2]]
young = 2e8
area = 1e-3
inertia = [1e-6, 2e-6]
density = 7850.0
[[structure.parts]]
name = "rope"
element = "sliding_cable"
cells = [[6, 3, 2, 4]]
young = 1e8
area = 1e-4
density = 7850.0
prestress = 1e6
friction = 0.1
[[structure.parts]]
name = "brake"
element = "brake"
cells = [[4, 5]]
stiffness = 1e5
curve = [[0.002, 150.0], [0.5, 400.0]]
mass = 1.0
[[structure.parts]]
name = "tie"
element = "cable"
cells = [[3, 6]]
young = 1e8
area = 1e-5
density = 7850.0
rupture_force = 1e5
hardening = [[0.0, 1e6], [0.1, 5e6]]
[fem]
{fem}
"#
    )
}

#[test]
fn a_structure_with_histories_answers_alike_whatever_was_asked_in_between() {
    for (fem, sampling) in [
        ("", Sampling::Means),
        ("integrator = \"generalized_alpha\"\nnewton.max_iterations = 100", Sampling::Means),
        ("integrator = \"newmark\"\nnewton.max_iterations = 100", Sampling::AtEnds),
    ] {
        let mut runs = [0, 1].map(|_| Run::coupled(&barrier(fem), 2e-4, sampling));
        let mut noise = random(3);
        for window in 0..40 {
            let mut force = vec![0.0; runs[0].force_len];
            force[3 * 3 + 2] = -600.0;
            force[3 * 3 + 1] = 200.0 * noise();
            let wild: Vec<f64> = force.iter().map(|f| 2.0 * f).collect();
            runs[1].solve(1e-4, &wild).unwrap();
            runs.iter_mut().for_each(|run| run.step(2e-4, &force));
            let bits = |run: &Run| run.output.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&runs[0]), bits(&runs[1]), "{fem}, window {window}");
        }
        assert!(runs[0].value("energy_dissipated_fem") > 0.0);
    }
}

#[test]
fn the_balance_of_a_structure_with_histories_closes_as_steps_are_shortened() {
    let lack = |step: f64| {
        let mut run = Run::coupled(&barrier(&format!("time_step = {step:?}")), 1e-3, Sampling::Means);
        let start = run.balance();
        let mut force = vec![0.0; run.force_len];
        force[3 * 3 + 2] = -600.0;
        let mut worst = 0.0_f64;
        for _ in 0..60 {
            run.step(1e-3, &force);
            worst = worst.max((run.balance() - start).abs());
        }
        (worst, run.value("energy_received_fem"))
    };
    let (coarse, received) = lack(2e-5);
    let (fine, _) = lack(5e-6);
    // Slip and yield begin within a step: first order, with an error of some percent at worst.
    assert!(coarse < 0.02 * received && fine < 0.4 * coarse, "{coarse} {fine} of {received}");
}

#[test]
fn no_window_with_elements_allocates_after_the_first() {
    use toolkit::alloc::allocations;
    for (fem, sampling) in [("", Sampling::Means), ("integrator = \"newmark\"", Sampling::AtEnds)] {
        let mut run = Run::coupled(&barrier(fem), 2e-4, sampling);
        let force = vec![0.0; run.force_len];
        (0..2).for_each(|_| run.step(2e-4, &force));
        let before = allocations();
        (0..5).for_each(|_| run.step(2e-4, &force));
        assert_eq!(allocations() - before, 0, "{fem}");
    }
}
