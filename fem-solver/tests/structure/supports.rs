//! Supports that let go, and supports that turn.

use crate::common::{Run, coupled_plan, off, scene};
use fem_solver::FemSolver;
use interface_defs::Sampling;
use interface_defs::message::Plan;
use toolkit::program::Options;

const SCHEMES: [&str; 4] = [
    "time_step = 2.5e-4",
    "integrator = \"generalized_alpha\"\ntime_step = 1e-3",
    "integrator = \"newmark\"\ntime_step = 1e-3",
    "integrator = \"bossak\"\ntime_step = 1e-3",
];

fn with_motion(text: &str, window: f64) -> Run {
    Run::with(text, Plan { takes: Vec::new(), ..coupled_plan(window, Sampling::Means, 1, 1) })
}

/// A rope of 11 m in ten pieces over a span of 10 m, 1.1 kg; both ends let go at 0.1 s.
fn rope(scheme: &str) -> String {
    let nodes: Vec<_> = (0..=10).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    let cables: Vec<_> = (0..10).map(|i| format!("{{ nodes = [{i}, {}], length = 1.1 }}", i + 1)).collect();
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -10.0]
[structure]
nodes = {nodes:?}
cables = [{}]
cable = {{ young = 1e8, area = 1e-4, density = 1000.0 }}
supports = [{{ nodes = [0, 10], released_at = 0.1 }}]
groups = [{{ name = "ends", nodes = [0, 10] }}]
[[gauge]]
name = "ends"
group = "ends"
quantity = "force"
[fem]
{scheme}
"#,
        cables.join(", ")
    )
}

#[test]
fn a_rope_that_is_let_go_falls_freely() {
    for scheme in SCHEMES {
        let mut run = with_motion(&rope(scheme), 0.02);
        let mass = run.solver.model().mass.clone();
        let all: f64 = mass.iter().sum();
        let start = run.balance();
        assert!(off(all, 1.1) < 1e-12);
        for n in 1..=25 {
            run.step(0.02, &[]);
            let time = 0.02 * f64::from(n);
            let fallen = -(0..11).map(|node| mass[node] * run.displacement(node)[2]).sum::<f64>() / all;
            let free = f64::max(time - 0.1, 0.0);
            // Rounding, and Newton's residual of 1e-10 of the forces.
            assert!((fallen - 5.0 * free * free).abs() < 1e-6, "{scheme} at {time}: {fallen}");
            let reaction = run.value("reaction_z");
            let expected = if n <= 5 { 11.0 } else { 0.0 };
            assert!((reaction - expected).abs() < 1e-6, "{scheme} at {time}: {reaction}");
            assert_eq!(run.value("ends_fz_sum"), reaction);
            let lost = (run.balance() - start) / (11.0 * 5.0 * 0.4 * 0.4);
            let allowed = if scheme.contains("bossak") { 0.05 } else { 2e-3 };
            assert!(lost.abs() < allowed, "{scheme} at {time}: {lost:.1e}");
        }
        assert!(run.count("skipped_windows") == 5, "it rests until then");
    }
}

#[test]
fn a_bar_that_is_let_go_swings_as_a_pendulum() {
    // From the horizontal: at the bottom after 1.8540747 sqrt(L / g), at sqrt(2 g L).
    let text = |scheme: &str| {
        format!(
            r#"
end_time = 1.0
gravity = [0.0, 0.0, -10.0]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}]
cable = {{ young = 1e10, area = 1e-4, density = 0.0, tension_only = false }}
masses = [{{ nodes = [1], mass = 1.0 }}]
supports = [{{ nodes = [0] }}, {{ nodes = [1], directions = "y" }}, {{ nodes = [1], released_at = 0.0 }}]
[fem]
{scheme}
"#
        )
    };
    for scheme in SCHEMES {
        let bottom = 1.854_074_677 * 0.1_f64.sqrt();
        let mut run = with_motion(&text(scheme), bottom);
        run.step(bottom, &[]);
        let [x, y, z] = run.displacement(1);
        let allowed = if scheme.contains("bossak") { 2e-2 } else { 2e-3 };
        assert!((x + 1.0).abs() < allowed && y == 0.0 && (z + 1.0).abs() < 2e-3, "{scheme}: {x} {z}");
        assert!(off(run.value("energy_kinetic_fem"), 10.0) < 1e-2, "{scheme}");
    }
}

#[test]
fn what_a_support_has_set_in_motion_flies_on_when_it_is_let_go() {
    // 2 kg dragged along x at 3 m/s against a dashpot for 0.1 s: then no force acts.
    for scheme in SCHEMES {
        let text = format!(
            r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0]]
masses = [{{ nodes = [0], mass = 2.0 }}]
supports = [{{ nodes = [0], motion = [[0.0, 0.0, 0.0, 0.0], [1.0, 3.0, 0.0, 0.0]], released_at = 0.1 }}]
[fem]
{scheme}
"#
        );
        let mut run = with_motion(&text, 0.02);
        for n in 1..=10 {
            run.step(0.02, &[]);
            let time = 0.02 * f64::from(n);
            assert!((run.displacement(0)[0] - 3.0 * time).abs() < 1e-9, "{scheme} {time}");
            assert!(
                (run.value("energy_kinetic_fem") - 9.0).abs() < 1e-8,
                "{scheme}: the support has done it"
            );
            assert!(run.balance().abs() < 1e-8, "{scheme}: {}", run.balance());
        }
    }
}

#[test]
fn statics_finds_the_equilibrium_without_a_support_that_has_let_go() {
    // A mass on two springs of a rope: the second end lets go, and the first carries all.
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -10.0]
[structure]
nodes = [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, -2.0]]
cables = [{ nodes = [0, 1] }, { nodes = [1, 2] }]
cable = { young = 1e8, area = 1e-4, density = 0.0, tension_only = false }
masses = [{ nodes = [1], mass = 10.0 }]
supports = [{ nodes = [0] }, { nodes = [1], directions = "xy" }, { nodes = [2], directions = "xy" },
            { nodes = [2], directions = "z", released_at = 0.5 }]
groups = [{ name = "foot", nodes = [2] }, { name = "head", nodes = [0] }]
[[gauge]]
name = "head"
group = "head"
quantity = "force"
[[gauge]]
name = "foot"
group = "foot"
quantity = "force"
[fem]
integrator = "static"
"#;
    let mut run = Run::alone(text, 0.25);
    for n in 1..=4 {
        run.step(0.25, &[]);
        let (head, foot) = (run.value("head_fz"), run.value("foot_fz"));
        assert!((head + foot - 100.0).abs() < 1e-6);
        let exact = if n <= 2 { 50.0 } else { 0.0 };
        // Half each, but for the stiffening of the stretched one: strains are 5e-3.
        assert!((foot - exact).abs() < 1.0 && (n <= 2 || foot == 0.0), "{n}: {foot}");
    }
}

/// `point` turned about the axis (1, 2, 2) / 3 through (0.5, 0, 0) by `angle`.
fn turned(point: [f64; 3], angle: f64) -> [f64; 3] {
    let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(1.0, 2.0, 2.0));
    let through = nalgebra::Vector3::new(0.5, 0.0, 0.0);
    let turn = nalgebra::Rotation3::from_axis_angle(&axis, angle);
    (through + turn * (nalgebra::Vector3::from(point) - through)).into()
}

#[test]
fn a_post_whose_foot_turns_goes_along_rigidly() {
    let nodes: Vec<_> = (0..=5).map(|i| [0.0, 0.0, 0.4 * f64::from(i)]).collect();
    let cells: Vec<_> = (0..5).map(|i| [i, i + 1]).collect();
    let text = format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
[[structure.supports]]
nodes = [0]
rotations = "xyz"
turning = {{ through = [0.5, 0.0, 0.0], axis = [1.0, 2.0, 2.0], angles = [[0.0, 0.0], [1.0, 2.5]] }}
[[structure.parts]]
name = "post"
element = "beam"
cells = {cells:?}
young = 2e11
area = 1e-3
inertia = [1e-6, 2e-6]
density = 7850.0
[fem]
integrator = "static"
"#
    );
    let mut run = with_motion(&text, 0.1);
    for n in 1..=10 {
        run.step(0.1, &[]);
        for (node, start) in nodes.iter().enumerate() {
            let (u, end) = (run.displacement(node), turned(*start, 0.25 * f64::from(n)));
            for c in 0..3 {
                assert!((start[c] + u[c] - end[c]).abs() < 1e-8, "{n}: node {node}: {u:?}");
            }
        }
        // A bend by 1e-3 rad would store 50 J.
        assert!(run.value("energy_stored_fem") < 1e-6, "{}", run.value("energy_stored_fem"));
    }
}

#[test]
fn a_ring_of_supports_that_turns_takes_its_net_along_without_strain() {
    let text = |scheme: &str| {
        format!(
            r#"
end_time = 1.0
[structure]
generator = {{ type = "rectangular_net", cells = [4, 4], spacing = 0.25, held = "none", boundary_cables = false }}
damping = 20.0
cable = {{ young = 1e9, area = 1e-5, density = 7850.0, prestress = 1e7 }}
[[structure.supports]]
group = "boundary"
turning = {{ through = [0.5, 0.5, 0.0], axis = [0.0, 0.0, 2.0], angles = [[0.0, 0.0], [1.0, 1.5707963267948966]] }}
[[gauge]]
name = "net"
group = "all"
quantity = "tension"
[fem]
{scheme}
"#
        )
    };
    let boundary = "[0, 1, 2, 3, 4, 5, 9, 10, 14, 15, 19, 20, 21, 22, 23, 24]";
    let all = (0..25).map(|n| n.to_string()).collect::<Vec<_>>().join(", ");
    let groups = format!(
        "groups = [{{ name = \"boundary\", nodes = {boundary} }}, {{ name = \"all\", nodes = [{all}] }}]\ndamping"
    );
    let mut run = with_motion(&text("integrator = \"static\"").replace("damping", &groups), 0.2);
    let start = run.ready.mesh.coordinates.clone();
    for _ in 0..5 {
        run.step(0.2, &[]);
        assert!(
            off(run.value("net_tension_min"), 100.0) < 1e-9
                && off(run.value("net_tension_max"), 100.0) < 1e-9
        );
    }
    // A quarter turn about the middle.
    for (node, p) in start.chunks(3).enumerate() {
        let u = run.displacement(node);
        let end = [0.5 - (p[1] - 0.5), 0.5 + (p[0] - 0.5)];
        assert!(
            (p[0] + u[0] - end[0]).abs() < 1e-9 && (p[1] + u[1] - end[1]).abs() < 1e-9,
            "{node}: {p:?} {u:?}"
        );
    }
}

/// The message with which a scene is refused.
fn refused(text: &str) -> String {
    match FemSolver::new(&scene(text), &Options::default()) {
        Ok(_) => panic!("must be refused: {text}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn supports_that_no_one_can_mean_are_refused() {
    let with = |what: &str| rope(SCHEMES[0]).replace("released_at = 0.1", what);
    let message = refused(&with("released_at = -1.0"));
    assert!(message.starts_with("test.toml:8:") && message.contains("before the run begins"), "{message}");
    let turning = |axis: &str, angles: &str| {
        with(&format!("turning = {{ through = [0.0, 0.0, 0.0], axis = {axis}, angles = {angles} }}"))
    };
    assert!(refused(&turning("[0.0, 0.0, 0.0]", "[[0.0, 0.0]]")).contains("no direction"));
    assert!(refused(&turning("[0.0, 0.0, 1.0]", "[]")).contains("nothing turns"));
    assert!(refused(&turning("[0.0, 0.0, 1e-200]", "[[0.0, 0.0]]")).contains("no direction"));
    // Both ends lie on this axis.
    let message = refused(&turning("[1.0, 0.0, 0.0]", "[[0.0, 0.0], [1.0, 0.5]]"));
    assert!(message.starts_with("test.toml:") && message.contains("nothing turns: its nodes"), "{message}");
    assert!(message.contains("rotations = \"xyz\""), "{message}");
    let message =
        refused(&with("directions = \"xy\", motion = [[0.0, 0.0, 0.0, 0.0], [0.1, 0.0, 0.0, 0.5]]"));
    assert!(message.contains("in z is to move by up to 0.5 m, and directions = \"xy\""), "{message}");
    assert!(refused(&turning("[0.0, 0.0, 1.0]", "[[1.0, 0.0], [0.0, 1.0]]")).contains("must increase"));
    let both = with(
        "motion = [[0.0, 0.0, 0.0, 0.0]], turning = { through = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0], angles = [[0.0, 0.0]] }",
    );
    assert!(refused(&both).contains("either motion or turning"), "{}", refused(&both));
}

#[test]
fn releases_after_the_end_and_angles_in_degrees_are_warned_of() {
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
    assert!(
        warned(&rope(SCHEMES[0]).replace("= 0.1 }", "= 100.0 }")).contains("the run ends at end_time = 1 s")
    );
    let turning =
        "turning = { through = [5.0, 0.0, 0.0], axis = [0.0, 0.0, 1.0], angles = [[0.0, 0.0], [1.0, 90.0]] }";
    assert!(
        warned(&rope(SCHEMES[0]).replace("released_at = 0.1", turning))
            .contains("90 rad are more than two turns")
    );
    assert!(!warned(&rope(SCHEMES[0])).contains("nothing holds the structure"));
}
