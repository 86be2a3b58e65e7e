//! Gauges of groups: smallest and largest of the members, each with its name; sums and means are called so.

use crate::common::{Run, off};
use interface_defs::message::{Measure, Worse};
use interface_defs::solver::Solver;

/// Three posts under loads of their own, hinged at their feet and guided at their heads; a cable holds the third one back.
fn posts(fem: &str, loads: [f64; 3]) -> String {
    let load = |i: usize| format!("{{ nodes = [{}], force = [0.0, 0.0, {:?}] }}", 3 + i, loads[i]);
    format!(
        r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 4.0], [1.0, 0.0, 4.0], [2.0, 0.0, 4.0]]
supports = [{{ nodes = [0, 1, 2], rotations = "xyz" }}, {{ nodes = [3, 4, 5], directions = "xy", rotations = "xyz" }}]
loads = [{}, {}, {}]
groups = [{{ name = "feet", nodes = [2, 0, 1] }}, {{ name = "heads", nodes = [3, 4, 5] }}]
[[structure.parts]]
name = "posts"
element = "beam"
cells = [[0, 3], [1, 4], [2, 5]]
young = 2e11
area = 1e-3
inertia = [1e-5, 1e-5]
density = 7850.0
[[gauge]]
name = "posts"
group = "posts"
quantity = "tension"
[[gauge]]
name = "posts"
group = "posts"
quantity = "elongation"
[[gauge]]
name = "feet"
group = "feet"
quantity = "force"
[[gauge]]
name = "one"
at = [1.0, 0.0, 0.0]
quantity = "tension"
[[gauge]]
name = "heads"
group = "heads"
quantity = "displacement"
[fem]
{fem}
"#,
        load(0),
        load(1),
        load(2)
    )
}

fn measures(run: &mut Run) -> Vec<Measure> {
    run.solver.finish().expect("is prepared").measures
}

/// Value, time and member of the measure `name`.
fn member(run: &mut Run, name: &str) -> (f64, f64, String) {
    let all = measures(run);
    let found = all.iter().find(|m| m.name == name);
    let measure = found.unwrap_or_else(|| panic!("there is no measure {name}: {all:?}"));
    let worse = if name.ends_with("_min") { Worse::Smaller } else { Worse::Larger };
    assert_eq!((measure.rank, measure.worse), (Measure::ORDINARY, worse));
    let member = measure.member.clone().expect("names its member");
    (measure.value, measure.time.expect("has a time"), member)
}

#[test]
fn the_most_compressed_post_is_reported_with_its_place_and_not_the_least_loaded_one() {
    // Statics: each post carries its own load, E A = 2e8 N over 4 m.
    let loads = [-1000.0, -5000.0, 300.0];
    let mut run = Run::alone(&posts("integrator = \"static\"", loads), 0.1);
    run.step(0.1, &[]);
    for (end, load, which) in [
        ("min", -5000.0, "element 1 of posts, (1.0 0.0 0.0) to (1.0 0.0 4.0)"),
        ("max", 300.0, "element 2 of posts, (2.0 0.0 0.0) to (2.0 0.0 4.0)"),
    ] {
        let column = run.value(&format!("posts_tension_{end}"));
        // A small post is shortened by 1e-4 of itself at most, and leans by nothing.
        assert!(off(column, load) < 1e-6, "{end}: {column}");
        let (value, time, name) = member(&mut run, &format!("posts_tension_{end}"));
        assert!(
            off(value, load) < 1e-6 && name == which && (0.0..=0.1).contains(&time),
            "{value} {time} {name}"
        );
        let stretch = run.value(&format!("posts_elongation_{end}"));
        assert!(off(stretch, load * 4.0 / 2e8) < 1e-6, "{stretch}");
        assert!(member(&mut run, &format!("posts_elongation_{end}")).2 == which);
    }
    // One member has the plain name and no other.
    assert!(off(run.value("one_tension"), -5000.0) < 1e-6, "{}", run.value("one_tension"));
    assert!(run.ready.gauges.iter().all(|g| !g.name.starts_with("one_tension_")));
    // Supports: sum of all, largest and smallest magnitude of one.
    assert!(off(run.value("feet_fz_sum"), 5700.0) < 1e-6, "{}", run.value("feet_fz_sum"));
    assert!(
        off(run.value("feet_force_max"), 5000.0) < 1e-6 && off(run.value("feet_force_min"), 300.0) < 1e-6
    );
    let (value, _, name) = member(&mut run, "feet_force_max");
    assert!(off(value, 5000.0) < 1e-6 && name == "node 1 at (1, 0, 0)", "{value} {name}");
    // Heads go down by P L / E A each: the mean of three.
    assert!(off(run.value("heads_uz_mean") + 1.0, 1.0) < 1e-9, "rest is the loaded state");
}

#[test]
fn extremes_of_members_are_those_of_all_steps_and_not_of_the_rows() {
    // Let go at once: each post swings between 0 and twice its static force, E A / L against half its mass. Rows lie at
    // whole periods, where the force is 0 again: they see nothing of it.
    let loads = [-1000.0, -5000.0, 3000.0];
    let (k, m): (f64, f64) = (2e8 / 4.0, 0.5 * 7850.0 * 1e-3 * 4.0);
    let period = 2.0 * std::f64::consts::PI * (m / k).sqrt();
    for fem in [
        format!("time_step = {:?}", period / 200.0),
        format!("integrator = \"generalized_alpha\"\ntime_step = {:?}", period / 200.0),
        format!("integrator = \"newmark\"\ntime_step = {:?}", period / 200.0),
    ] {
        let text = posts(&fem, loads).replace("[structure]", "[structure]\nform_finding = \"none\"");
        let mut run = Run::alone(&text, period);
        (0..3).for_each(|_| run.step(period, &[]));
        assert!(run.value("posts_tension_min") > -100.0, "{}", run.value("posts_tension_min"));
        for (end, exact, post) in [("min", -10000.0, 1), ("max", 6000.0, 2)] {
            let (value, time, name) = member(&mut run, &format!("posts_tension_{end}"));
            // The peak between two steps, and the phase of the scheme: (w h)^2.
            assert!(off(value, exact) < 2e-3, "{fem}: {end} {value}");
            assert!(name.starts_with(&format!("element {post} of posts")), "{name}");
            let cycle = (time / period).fract();
            assert!((cycle - 0.5).abs() < 0.02, "{fem}: {time} is no half period");
        }
    }
}

#[test]
fn windows_that_are_thrown_away_leave_no_extreme() {
    let text = posts("time_step = 1e-5", [-1000.0, -5000.0, 300.0]);
    let mut run = Run::coupled(&text, 1e-3, interface_defs::field::Sampling::Means);
    let mut wild = vec![0.0; run.force_len];
    wild[3 * 3 + 2] = -1e6;
    run.solve(1e-3, &wild).unwrap();
    let nothing = vec![0.0; run.force_len];
    run.step(1e-3, &nothing);
    let (value, _, name) = member(&mut run, "posts_tension_min");
    assert!(off(value, -5000.0) < 1e-6 && name.starts_with("element 1 "), "{value} {name}");
}

/// A beam and a cable of a mesh file, with numbers of its own.
const MESH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 1 \"posts\"\n0 2 \"feet\"\n\
    $EndPhysicalNames\n$Nodes\n4\n11 0 0 0\n12 1 0 0\n13 0 0 4\n14 1 0 4\n$EndNodes\n$Elements\n4\n701 15 2 2 1 11\n\
    702 15 2 2 2 12\n803 1 2 1 1 11 13\n804 1 2 1 1 12 14\n$EndElements\n";

#[test]
fn members_of_a_mesh_file_have_its_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = dir.path().join("posts.msh");
    std::fs::write(&mesh, MESH).unwrap();
    let text = format!(
        r#"
end_time = 1.0
[structure]
mesh = {mesh:?}
supports = [{{ group = "feet", rotations = "xyz" }}, {{ at = [0.0, 0.0, 4.0], directions = "xy", rotations = "xyz" }}, {{ at = [1.0, 0.0, 4.0], directions = "xy", rotations = "xyz" }}]
loads = [{{ at = [1.0, 0.0, 4.0], force = [0.0, 0.0, -2000.0] }}]
[[structure.parts]]
name = "posts"
element = "beam"
young = 2e11
area = 1e-3
inertia = [1e-5, 1e-5]
density = 7850.0
[[gauge]]
name = "posts"
group = "posts"
quantity = "tension"
[[gauge]]
name = "feet"
group = "feet"
quantity = "force"
[fem]
integrator = "static"
"#
    );
    let mut run = Run::alone(&text, 0.1);
    run.step(0.1, &[]);
    let (value, _, name) = member(&mut run, "posts_tension_min");
    assert!(off(value, -2000.0) < 1e-6, "{value}");
    assert_eq!(name, "element 804 of posts, (1.0 0.0 0.0) to (1.0 0.0 4.0)");
    assert_eq!(member(&mut run, "feet_force_max").2, "node 12 at (1, 0, 0)");
}

#[test]
fn a_row_of_statics_is_of_its_end() {
    // A support goes up by 1 mm over 0.1 s: k = E A / L = 5e7 N/m. Force and tension of one row belong to one state.
    let text = posts("integrator = \"static\"", [0.0, 0.0, 0.0]).replace(
        "supports = [",
        "supports = [{ nodes = [5], directions = \"z\", motion = [[0.0, 0.0, 0.0, 0.0], [0.1, 0.0, 0.0, 1e-3]] }, ",
    );
    let mut run = Run::alone(&text, 0.02);
    for row in 1..=5 {
        run.step(0.02, &[]);
        let exact = 5e7 * 1e-3 * f64::from(row) / 5.0;
        let (tension, force) = (run.value("posts_tension_max"), run.value("feet_force_max"));
        assert!(off(tension, exact) < 1e-6, "row {row}: {tension}, not {exact}");
        assert!(off(force, tension) < 1e-9, "row {row}: {force} beside {tension}");
        assert!(off(run.value("feet_fz_sum"), -tension) < 1e-9, "row {row}: {}", run.value("feet_fz_sum"));
        // Foot and head hold each other.
        assert!(run.value("reaction_z").abs() < 1e-6 * tension, "row {row}: {}", run.value("reaction_z"));
    }
    assert!(off(run.measure("max_reaction") + 1.0, 1.0) < 1e-2);
}

#[test]
fn the_largest_cable_force_is_that_of_all_cables_at_any_step_and_of_the_start() {
    let net = |fem: &str| {
        format!(
            r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = {{ type = "rectangular_net", cells = [6, 5], spacing = 0.15 }}
cable = {{ young = 8e9, area = 1.2e-5, density = 7850.0, prestress = 1e7 }}
[[gauge]]
name = "net"
group = "net"
quantity = "tension"
[fem]
{fem}
"#
        )
    };
    // Newmark balances at the end of each step, where the gauge is read; central differences half a step before.
    for (fem, sampling, allowed) in [
        ("integrator = \"newmark\"", interface_defs::field::Sampling::AtEnds, 1e-12),
        ("time_step = 2e-5", interface_defs::field::Sampling::Means, 2e-2),
    ] {
        let mut run = Run::coupled(&net(fem), 2e-5, sampling);
        let at_rest = run.value("net_tension_max");
        assert!(off(run.measure("max_cable_force"), at_rest) < 1e-12, "{at_rest}");
        let (mut largest, mut when) = (at_rest, 0.0);
        let mut push = vec![0.0; run.force_len];
        push[3 * 17 + 2] = -200.0;
        for _ in 0..400 {
            run.step(2e-5, &push);
            let now = run.value("net_tension_max");
            if now > largest {
                (largest, when) = (now, run.time);
            }
        }
        assert!(largest > 1.2 * at_rest, "{largest} {at_rest}");
        let force = run.measure("max_cable_force");
        assert!(off(force, largest) < allowed, "{fem}: {force}, by the rows {largest}");
        let (value, time, name) = member(&mut run, "net_tension_max");
        assert!(value == largest && (time - when).abs() < 1e-9, "{value} at {time}, {largest} at {when}");
        assert!(name.contains(" of net, ("), "{name}");
    }
}
