//! Supports that give way: springs until their strength, and nothing behind it.

use crate::common::{Run, off, scene};
use fem_solver::FemSolver;
use interface_defs::solver::Solver;
use std::f64::consts::TAU;
use toolkit::program::Options;

const SCHEMES: [&str; 4] = [
    "time_step = 2e-5",
    "integrator = \"generalized_alpha\"\ntime_step = 1e-4",
    "integrator = \"newmark\"\ntime_step = 1e-4",
    "integrator = \"static\"",
];

/// 10 kg below a support of 1e6 N/m, on a cable; `support` is added to its row.
fn hanging(support: &str, more: &str, fem: &str) -> String {
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -10.0]
[structure]
nodes = [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}]
cable = {{ young = 1e10, area = 1e-4, density = 0.0 }}
masses = [{{ nodes = [0], mass = 1e-3 }}, {{ nodes = [1], mass = 9.999 }}]
groups = [{{ name = "anchors", nodes = [0] }}]
supports = [{{ group = "anchors", stiffness = 1e6{support} }}]
{more}
[[gauge]]
name = "anchor"
group = "anchors"
quantity = "force"
[fem]
{fem}
"#
    )
}

#[test]
fn a_support_gives_by_its_force_over_its_stiffness_and_reports_it() {
    for form in ["static", "dynamic_relaxation"] {
        for fem in SCHEMES {
            let more = format!("form_finding = \"{form}\"");
            let text = hanging(", strength = 200.0", "", fem)
                .replace("[structure]\n", &format!("[structure]\n{more}\n"));
            let mut run = Run::coupled(&text, 1e-3, interface_defs::Sampling::Means);
            run.step(1e-3, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
            let force = run.value("anchor_fz");
            assert!(off(force, 100.0) < 1e-6 && run.value("anchor_fx").abs() < 1e-6, "{fem}: {force}");
            assert_eq!(run.value("reaction_z"), force);
            // Half of m g / k times m g, the cable's own of 1e6 N/m, and nothing lost.
            assert!(off(run.value("energy_stored_fem"), 0.01) < 2e-4, "{}", run.value("energy_stored_fem"));
            assert_eq!(run.value("energy_dissipated_fem"), 0.0);
            assert_eq!(run.solver.finish().unwrap().torn, Some(Vec::new()));
        }
    }
}

#[test]
fn a_mass_on_a_support_swings_with_its_period() {
    let text = r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0]]
masses = [{ nodes = [0], mass = 4.0 }]
velocities = [{ nodes = [0], velocity = [1.0, 2.0, 2.0] }]
supports = [{ nodes = [0], stiffness = 1e4 }]
[fem]
time_step = 1e-4
"#;
    let period = TAU * (4.0_f64 / 1e4).sqrt();
    let mut run = Run::coupled(text, 0.25 * period, interface_defs::Sampling::Means);
    run.step(0.25 * period, &[]);
    let [x, y, z] = run.displacement(0);
    // At its amplitude, v / w; isotropic.
    assert!(off(x, 0.02) < 1e-5 && off(y, 0.04) < 1e-5 && off(z, 0.04) < 1e-5, "{x} {y} {z}");
    assert!(run.solver.finish().unwrap().torn.is_none(), "nothing can tear");
}

#[test]
fn what_tears_is_listed_and_loses_what_its_spring_held_at_its_strength() {
    // Drawn down at 0.5 m/s by the mass: tears under 300 N, with 300^2 / 2e6 J.
    for (fem, share) in [(SCHEMES[0], 5e-3), (SCHEMES[1], 3e-2), (SCHEMES[2], 3e-2)] {
        let more = "velocities = [{ nodes = [1], velocity = [0.0, 0.0, -0.5] }]";
        let mut run = Run::alone(&hanging(", strength = 300.0", more, fem), 1e-3);
        let start = run.balance();
        (0..20).for_each(|_| run.step(1e-3, &[]));
        let lost = run.value("energy_dissipated_fem");
        assert!(off(lost, 0.045) < share, "{fem}: {lost}");
        assert!((run.balance() - start).abs() < 1e-2, "{fem}: {}", run.balance() - start);
        assert_eq!(run.value("anchor_fz"), 0.0);
        let statistics = run.solver.finish().unwrap();
        let torn = statistics.torn.expect("it can tear");
        assert_eq!((torn.len(), torn[0].part.as_str(), torn[0].elements), (1, "anchors", 1));
        assert_eq!(torn[0].member, "element 0 of anchors, at (0.0 0.0 1.0)");
        assert!(off(torn[0].force, 300.0) < 0.02 && torn[0].first < 2e-2, "{torn:?}");
        assert_eq!(statistics.measures.iter().find(|m| m.name == "max_cable_force").unwrap().member, None);
    }
}

#[test]
fn the_force_of_a_support_is_none_of_a_cable() {
    // The support carries the weight of the node at it as well, of 5 kg, which the cable does not.
    let text = hanging("", "", SCHEMES[0]).replace("mass = 1e-3", "mass = 5.0");
    let mut run = Run::alone(&text, 1e-3);
    run.step(1e-3, &[]);
    assert!(off(run.measure("max_cable_force"), 99.99) < 1e-6, "{}", run.measure("max_cable_force"));
    assert!(off(run.value("anchor_fz"), 149.99) < 1e-6);
}

#[test]
fn in_statics_it_tears_where_the_load_passes_its_strength() {
    // 100 N of weight and a load that grows to 100 N more: 150 N at half of the time; a second cable holds it all then.
    let more = "loads = [{ nodes = [1], force = [0.0, 0.0, -100.0], history = [[0.0, 0.0], [1.0, 1.0]] }]";
    let text = hanging(", strength = 150.0", more, "integrator = \"static\"")
        .replace("[0.0, 0.0, 0.0]]\n", "[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]\n")
        .replace(
            "cables = [{ nodes = [0, 1] }]",
            "cables = [{ nodes = [0, 1] }, { nodes = [0, 2], length = 1.01 }]",
        )
        .replace("supports = [", "supports = [{ nodes = [2] }, ");
    let mut run = Run::alone(&text, 0.125);
    for step in 1..=8 {
        run.step(0.125, &[]);
        let (time, force) = (0.125 * f64::from(step), run.value("anchor_fz"));
        if time <= 0.5 {
            assert!(off(force, 100.0 + 100.0 * time) < 1e-6, "{time}: {force}");
        }
    }
    assert_eq!(run.value("anchor_fz"), 0.0);
    assert!(off(run.value("reaction_z"), 200.0) < 1e-6, "{}", run.value("reaction_z"));
}

#[test]
fn a_base_hinge_keeps_its_axis_when_it_has_torn() {
    // A post of 2 m with its foot held about z; 1 m/s sideways at its foot tears it off.
    let text = r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]
groups = [{ name = "feet", nodes = [0] }]
supports = [{ group = "feet", rotations = "z", stiffness = 1e8, strength = 2e3 }]
velocities = [{ nodes = [0, 1], velocity = [1.0, 0.5, 0.0] }]
[[structure.parts]]
name = "posts"
element = "beam"
cells = [[0, 1]]
section = "HE 160 B"
steel = "S235"
[fem]
"#;
    let mut run = Run::alone(text, 1e-3);
    let start = run.balance();
    (0..20).for_each(|_| run.step(1e-3, &[]));
    let torn = run.solver.finish().unwrap().torn.expect("can tear");
    assert_eq!(torn[0].part, "feet");
    assert!(
        off(run.value("energy_dissipated_fem"), 2e3 * 2e3 / 2e8) < 5e-2,
        "{}",
        run.value("energy_dissipated_fem")
    );
    assert!((run.balance() - start).abs() < 1e-3 * start, "{} {start}", run.balance());
}

#[test]
fn what_a_row_of_supports_cannot_mean_is_refused_with_a_way_out() {
    let row = "stiffness = 1e6";
    let both = |other: &str| format!("stiffness = 1e6, strength = 1e3 }}, {other}");
    for (to, words) in [
        ("strength = 1e3".to_owned(), "stiffness = 2e7 [N/m] beside it"),
        ("stiffness = -1.0".into(), "must lie above 0"),
        ("stiffness = 1e6, strength = 0.0".into(), "must lie above 0"),
        ("stiffness = 1e6, released_at = 0.5".into(), "has no motion, turning or released_at"),
        (
            "stiffness = 1e6, directions = \"\", rotations = \"x\"".into(),
            "leaves nothing for a spring to hold",
        ),
        (both("{ nodes = [0], directions = \"z\""), "another support holds node 0"),
        (both("{ nodes = [0], stiffness = 1e5"), "another support holds node 0"),
    ] {
        let text = hanging("", "", SCHEMES[0]).replace(row, &to);
        let error = FemSolver::new(&scene(&text), &Options::default()).err().expect(&to).to_string();
        assert!(error.contains(words) && error.contains("test.toml:10"), "{to}: {error}");
    }
}
