//! What tears within explicit steps keeps its energy, and loses what it held at its strength.

use crate::common::{Run, coupled_plan, off};
use interface_defs::Sampling;
use interface_defs::diagnostic::code;
use interface_defs::solver::Solver;

/// Nodes of the net below, along one side.
const SIDE: usize = 13;

/// A net of 12 x 12 cells; nine nodes in its middle of 10 kg each get 20 m/s from a push of 2 ms.
fn net(fem: &str) -> Run {
    let middle: Vec<usize> = (5..8).flat_map(|j| (5..8).map(move |i| j * SIDE + i)).collect();
    let text = format!(
        r#"
end_time = 1.0
[structure]
generator = {{ type = "rectangular_net", cells = [12, 12], spacing = 0.3 }}
masses = [{{ nodes = {middle:?}, mass = 10.0 }}]
form_finding = "none"
cable = {{ young = 8.2e9, area = 1.25e-5, density = 7850.0 }}
[[structure.parts]]
name = "net"
element = "cable"
rupture_force = 5e3
[fem]
{fem}
"#
    );
    let mut run = Run::with(&text, coupled_plan(1e-3, Sampling::Means, 1, 1));
    let mut force = vec![0.0; run.force_len];
    middle.iter().for_each(|node| force[3 * node + 2] = -1e5);
    run.step(1e-3, &force);
    run.step(1e-3, &force);
    run
}

/// What came of a run of the net, of 0.05 s.
struct Impact {
    /// Largest imbalance over the energy received.
    error: f64,
    deflection: f64,
    torn: usize,
}

fn impact(fem: &str) -> Impact {
    let mut run = net(fem);
    let (mut error, mut deflection) = (0.0_f64, 0.0_f64);
    let received = run.value("energy_received_fem");
    for _ in 0..48 {
        run.step(1e-3, &[]);
        error = error.max(run.balance().abs() / received);
        deflection = deflection.min(run.displacement(SIDE * SIDE / 2)[2]);
    }
    let warnings = run.solver.finish().unwrap().warnings;
    let torn = warnings.iter().filter(|w| w.code == code::RUPTURE).count();
    Impact { error, deflection, torn }
}

#[test]
fn a_net_that_tears_keeps_its_energy_at_the_default_step_and_below() {
    let mut run = net("");
    run.step(1e-3, &[]);
    // Nothing is torn yet: three windows of equal steps.
    let step = 3e-3 / run.count("sub_steps") as f64;
    let runs = [1.0, 0.5, 0.25].map(|part| impact(&format!("time_step = {:?}", part * step)));
    for run in &runs {
        assert!(run.torn > 10 && run.error < 1e-3, "{} torn, {}", run.torn, run.error);
        assert!(off(run.deflection, runs[2].deflection) < 2e-3, "{} {}", run.deflection, runs[2].deflection);
    }
}

/// One element of part `weak` between a held node and one of 0.5 kg, which a strong cable draws away at 20 m/s.
fn drawn(weak: &str, fem: &str) -> Run {
    let text = format!(
        r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [0.15, 0.0, 0.0], [0.3, 0.0, 0.0]]
form_finding = "none"
masses = [{{ nodes = [1], mass = 0.5 }}]
cable = {{ young = 8.2e9, area = 1.25e-5, density = 7850.0 }}
[[structure.supports]]
nodes = [0]
rotations = "xyz"
[[structure.supports]]
nodes = [2]
motion = [[0.0, 0.0, 0.0, 0.0], [0.01, 0.2, 0.0, 0.0]]
[[structure.parts]]
name = "strong"
element = "cable"
cells = [[1, 2]]
[[structure.parts]]
name = "weak"
cells = [[0, 1]]
{weak}
[fem]
{fem}
"#
    );
    Run::alone(&text, 2e-3)
}

/// Energy [J] of an elastic bar of 0.15 m with `E A` [N] under `force`: `E A L e^2 / 2` where `E A e sqrt(1 + 2 e)` is the force.
fn held(rigidity: f64, force: f64) -> f64 {
    let mut strain = force / rigidity;
    (0..50).for_each(|_| strain = force / rigidity / (1.0 + 2.0 * strain).sqrt());
    0.5 * rigidity * 0.15 * strain * strain
}

#[test]
fn what_tears_loses_what_it_held_at_its_strength() {
    let bar = 8.2e9 * 1.25e-5;
    let rope =
        "element = \"sliding_cable\"\nyoung = 8.2e9\narea = 1.25e-5\ndensity = 7850.0\nrupture_force = 3e3";
    let cases = [
        ("element = \"cable\"\nrupture_force = 3e3", held(bar, 3e3)),
        (rope, held(bar, 3e3)),
        (
            "element = \"brake\"\nstiffness = 5e5\ncurve = [[0.02, 1e4]]\nrupture_force = 3e3",
            3e3_f64.powi(2) / 1e6,
        ),
        // Yields at 2e3 N and hardens by 1e5 N/m over its travel to 3e3 N.
        (
            "element = \"brake\"\nstiffness = 5e5\ncurve = [[0.004, 2e3], [0.016, 3e3], [0.028, 4e3]]\nrupture_force = 3e3",
            3e3_f64.powi(2) / 1e6 + 0.5 * (2e3 + 3e3) * 1e-2,
        ),
        (
            "element = \"beam\"\nyoung = 8.2e9\narea = 1.25e-5\ninertia = [1e-10, 1e-10]\ndensity = 7850.0\nrupture_force = 3e3",
            0.15 * 3e3_f64.powi(2) / (2.0 * bar),
        ),
    ];
    for (weak, exact) in cases {
        // Explicit steps: the books hold f . du, which differs from the energy at the strength by the square of the step.
        // An implicit step ends within a hundredth of the strength; energies are squares of it, and plastic ones twice that.
        for (fem, share) in [
            ("", 3e-2),
            ("time_step = 1e-5", 2e-3),
            ("integrator = \"generalized_alpha\"\ntime_step = 1e-4", 3e-2),
            ("integrator = \"newmark\"\ntime_step = 1e-4", 3e-2),
        ] {
            let mut run = drawn(weak, fem);
            let (mut worst, mut supplied) = (0.0_f64, 0.0_f64);
            for _ in 0..5 {
                run.step(2e-3, &[]);
                supplied = supplied.max(-run.value("energy_supports_fem"));
                worst = worst.max(run.balance().abs());
            }
            let lost = run.value("energy_dissipated_fem");
            assert!(off(lost, exact) < share, "{weak}, {fem}: {lost} J, not {exact} J");
            assert!(worst < 5e-3 * supplied, "{weak}, {fem}: {worst} J of {supplied} J");
        }
    }
}

#[test]
fn a_bar_that_a_mass_runs_away_from_breaks_at_its_strength_however_long_the_step() {
    // 5 kg at 20 m/s on 0.15 m of wire: the default step is three times as long as the wire needs to its strength.
    let text = |fem: &str| {
        format!(
            r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [0.15, 0.0, 0.0]]
supports = [{{ nodes = [0] }}]
masses = [{{ nodes = [1], mass = 5.0 }}]
velocities = [{{ nodes = [1], velocity = [20.0, 0.0, 0.0] }}]
form_finding = "none"
cable = {{ young = 8.2e9, area = 1.25e-5, density = 7850.0 }}
[[structure.parts]]
name = "wire"
element = "cable"
cells = [[0, 1]]
rupture_force = 3e3
[fem]
{fem}
"#
        )
    };
    let exact = held(8.2e9 * 1.25e-5, 3e3);
    let mut before = f64::INFINITY;
    for (fem, share) in [("", 3e-2), ("time_step = 5e-5", 2e-3), ("time_step = 1e-5", 1e-4)] {
        let mut run = Run::alone(&text(fem), 4e-3);
        let start = run.balance();
        run.step(4e-3, &[]);
        let (lost, error) = (run.value("energy_dissipated_fem"), (run.balance() - start).abs() / start);
        assert!(off(lost, exact) < share && off(lost, exact) <= before, "{fem}: {lost} J, not {exact} J");
        // Nothing swings behind it: what is left is the quadrature of a strain that is no straight line over a step.
        assert!(error < 1e-5, "{fem}: {error}");
        before = off(lost, exact);
    }
}

#[test]
fn a_ring_loses_what_it_held_and_a_rope_with_friction_keeps_the_balance() {
    let text = |weak: &str| {
        format!(
            r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [0.15, -0.15, 0.0], [0.3, 0.0, 0.0], [0.15, 0.15, 0.0], [0.45, 0.0, 0.0]]
form_finding = "none"
masses = [{{ nodes = [1, 3], mass = 0.2 }}, {{ nodes = [2], mass = 0.5 }}]
cable = {{ young = 8.2e9, area = 1.25e-5, density = 7850.0 }}
[[structure.supports]]
nodes = [0]
[[structure.supports]]
nodes = [4]
motion = [[0.0, 0.0, 0.0, 0.0], [0.02, 0.4, 0.0, 0.0]]
[[structure.parts]]
name = "strong"
element = "cable"
cells = [[2, 4]]
[[structure.parts]]
name = "weak"
{weak}
[fem]
time_step = 5e-5 # before anything breaks, the ring flows at the default step already with an error of 0.6 %
"#
        )
    };
    let ring = "element = \"ring\"\ncells = [[0, 1, 2, 3]]\ndiameter = 0.3\nperimeter = 0.85\nperimeter_stiffness = 1e5\n\
                bending_stiffness = 1e-6\nmass = 0.4\nrupture_force = 3e3";
    // Friction at its inner node, which swings.
    let rope = "element = \"sliding_cable\"\ncells = [[0, 1, 2]]\nyoung = 8.2e9\narea = 1.25e-5\ndensity = 7850.0\n\
                friction = 0.2\nrupture_force = 3e3";
    // The force of a ring's perimeter is k u: it held F^2 / 2 k.
    for (weak, exact) in [(ring, Some(45.0)), (rope, None)] {
        let mut run = Run::alone(&text(weak), 2e-3);
        let (mut worst, mut supplied) = (0.0_f64, 0.0_f64);
        for _ in 0..10 {
            run.step(2e-3, &[]);
            supplied = supplied.max(-run.value("energy_supports_fem"));
            worst = worst.max(run.balance().abs());
        }
        let lost = run.value("energy_dissipated_fem");
        assert!(lost > 0.0 && exact.is_none_or(|exact| off(lost, exact) < 1e-2), "{lost} J, not {exact:?} J");
        assert!(worst < 5e-3 * supplied, "{worst} J of {supplied} J");
    }
}

#[test]
fn a_brake_at_the_end_of_its_stroke_keeps_the_balance() {
    // Nothing breaks: all that it moved swings between the stop and a spring, at the highest frequency that there is. The energy
    // at an instant is wrong by (w h / 2)^2 of the kinetic one then, and comes back.
    let brake = "element = \"brake\"\nstiffness = 5e5\ncurve = [[0.004, 2e3]]\nstroke = 0.01";
    let error = |fem: &str| {
        let mut run = drawn(brake, fem);
        let (mut worst, mut supplied) = (0.0_f64, 0.0_f64);
        for _ in 0..40 {
            run.step(1e-4, &[]);
            supplied = supplied.max(-run.value("energy_supports_fem"));
            worst = worst.max(run.balance().abs());
        }
        // Its travel is 0.01 m under 2e3 N, and its end stop holds the rest.
        assert!(
            off(run.value("energy_dissipated_fem"), 20.0) < 1e-12,
            "{}",
            run.value("energy_dissipated_fem")
        );
        worst / supplied
    };
    let (coarse, fine) = (error("time_step = 1e-4"), error("time_step = 2.5e-5"));
    assert!(coarse < 5e-3 && fine < coarse / 10.0, "{coarse} {fine}");
}

/// Two cables beside a spring, drawn by a support until both tear in the first step of statics: what is not there any more
/// takes no work from the support, and that the step went far beyond the strength is said.
#[test]
fn in_statics_a_support_works_on_nothing_that_is_torn() {
    let text = r#"
end_time = 0.05
[structure]
form_finding = "none"
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.5, 0.0, 0.0]]
supports = [{ nodes = [0] }, { nodes = [1], directions = "yz" }, { nodes = [2], motion = [[0.0, 0.0, 0.0, 0.0], [0.05, 0.2, 0.0, 0.0]] }]
springs = [{ nodes = [1], stiffness = [1e5, 0.0, 0.0] }]
[[structure.parts]]
name = "rope"
element = "cable"
young = 1e9
area = 1e-4
density = 7850.0
rupture_force = 3000.0
cells = [[0, 1], [1, 2]]
[fem]
integrator = "static"
"#;
    let mut run = Run::alone(text, 0.025);
    run.step(0.025, &[]);
    let first = run.value("energy_supports_fem");
    assert!(first < -100.0, "{first}");
    run.step(0.025, &[]);
    assert_eq!(run.value("energy_supports_fem"), first);
    let told = run.solver.finish().expect("is prepared").warnings;
    assert!(told.iter().any(|w| w.message.contains("times the strength of what broke in it")), "{told:?}");
}

#[test]
fn no_window_allocates_while_a_net_tears() {
    use toolkit::alloc::allocations;
    let mut run = net("");
    run.step(1e-3, &[]);
    let (before, lost) = (allocations(), run.value("energy_dissipated_fem"));
    (0..40).for_each(|_| run.step(1e-3, &[]));
    assert_eq!(allocations() - before, 0);
    assert!(run.value("energy_dissipated_fem") > lost, "nothing tore");
}

/// A lower rope and an upper one of three pieces over two fields; that in the middle of field 1 tears at once.
fn torn_rope(weak: &str) -> String {
    format!(
        r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [12.0, 0.0, 0.0],
         [0.0, 0.0, 3.0], [3.0, 0.0, 3.0], [6.0, 0.0, 3.0], [9.0, 0.0, 3.0], [12.0, 0.0, 2.5]]
form_finding = "none"
cables = [{{ nodes = [0, 1] }}, {{ nodes = [1, 2] }}, {{ nodes = [3, 4] }}, {{ nodes = [5, 6] }}, {{ nodes = [6, 7] }}]
cable = {{ young = 1e9, area = 1e-4, density = 7850.0 }}
supports = [{{ nodes = [0, 1, 2, 3, 6, 7] }}, {{ nodes = [4, 5], directions = "yz" }}]
groups = [{{ name = "bottom", nodes = [0, 1, 2] }}, {{ name = "top", nodes = [3, 4, 5, 6, 7] }}, {{ name = "feet", nodes = [0, 1, 2] }}]
velocities = [{{ nodes = [4], velocity = [-20.0, 0.0, 0.0] }}]
[[structure.parts]]
name = "weak"
element = "cable"
young = 1e9
area = 1e-4
density = 7850.0
cells = [[4, 5]]
{weak}
[[gauge]]
name = "left"
group = "top"
above = "bottom"
posts = "feet"
normal = [0.0, 0.0, 1.0]
quantity = "height"
"#
    )
}

#[test]
fn a_field_whose_rope_is_torn_has_no_height() {
    let heights = |weak: &str| {
        let mut run = Run::alone(&torn_rope(weak), 2e-3);
        run.step(2e-3, &[]);
        ["left_height_1_end", "left_height_2_end", "left_height_end"].map(|name| run.measure(name))
    };
    assert_eq!(heights(""), [3.0, 2.5, 2.5]);
    // The upper rope lies at both posts of field 1, and is missing between 3 m and 6 m.
    assert_eq!(heights("rupture_force = 200.0"), [0.0, 2.5, 0.0]);
    // A second cable beside it holds.
    let beside = "rupture_force = 200.0\n[[structure.parts]]\nname = \"spare\"\nelement = \"cable\"\nyoung = 1e9\narea = 1e-4\n\
                  density = 7850.0\ncells = [[4, 5]]";
    assert_eq!(heights(beside), [3.0, 2.5, 2.5]);
}
