//! Bad input: refused with a place, a number and a way out.

use crate::common::{WALENSTADT, check, scene};
use fem_solver::FemSolver;
use toolkit::program::Options;

/// The message with which a scene is refused.
fn refused(text: &str) -> String {
    let scene = scene(text);
    match FemSolver::new(&scene, &Options::default()) {
        Err(error) => error.to_string(),
        Ok(_) => check(&scene).expect_err("must be refused").to_string(),
    }
}

const PAIR: &str = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
cables = [{ nodes = [0, 1] }, { nodes = [1, 2] }]
supports = [{ nodes = [0, 2] }]
cable = { young = 1e9, area = 1e-4, density = 7850.0 }
"#;

#[test]
fn the_pair_itself_is_fine() {
    let report = check(&scene(PAIR)).unwrap();
    assert_eq!(report.numbers["nodes"], 3.0);
}

#[test]
fn each_fault_is_named_with_its_place_and_numbers() {
    for (from, to, place, words) in [
        ("young = 1e9", "yuong = 1e9", "test.toml:8:", "young"),
        ("area = 1e-4", "area = -1e-4", "test.toml:8:", "-0.0001 m2, it must lie above 0"),
        ("density = 7850.0", "density = -1.0", "test.toml:8:", "must not lie below 0"),
        (
            "[2.0, 0.0, 0.0]]",
            "[2.0, 0.0, 0.0], [3.0, 1.0, 0.0]]",
            "test.toml:5:",
            "node 3 at (3, 1, 0) is held by no element",
        ),
        ("{ nodes = [1, 2] }]", "{ nodes = [1, 7] }]", "test.toml:6:", "no node 7; nodes are 0 to 2"),
        ("{ nodes = [1, 2] }]", "{ nodes = [1, 1] }]", "test.toml:6:", "has no length"),
        (
            "{ nodes = [1, 2] }]",
            "{ nodes = [0, 1, 2] }]",
            "test.toml:6:",
            "a cable has two nodes, here are 3",
        ),
        ("{ nodes = [0, 2] }", "{ nodes = [0, 2], directions = \"xq\" }", "test.toml:7:", "letters of xyz"),
        ("{ nodes = [0, 2] }", "{ group = \"edge\" }", "test.toml:7:", "no group `edge`"),
        (
            "{ nodes = [0, 2] }",
            "{ at = [0.0, 9.0, 0.0] }",
            "test.toml:7:",
            "no node of the structure lies at",
        ),
        ("{ nodes = [0, 2] }", "{ nodes = [0], group = \"x\" }", "test.toml:7:", "exactly one of"),
        (
            "density = 7850.0",
            "density = 0.0",
            "test.toml:5:",
            "node 1 at (1, 0, 0) is free to move and has no mass",
        ),
        (
            "end_time = 1.0",
            "end_time = 1.0\nfem = { time_step = 1.0 }",
            "test.toml:3:",
            "lies above the critical one",
        ),
        ("end_time = 1.0", "end_time = 1.0\nfem = { integrator = \"newmrk\" }", "test.toml:3:", "newmark"),
        (
            "end_time = 1.0",
            "end_time = 1.0\ngauge = [{ name = \"a\", at = [1.0, 0.0, 0.0], quantity = \"force\" }]",
            "test.toml:3:",
            "no node of the gauge `a` is held",
        ),
        (
            "end_time = 1.0",
            "end_time = 1.0\ngauge = [{ name = \"a\", quantity = \"force\" }]",
            "test.toml:3:",
            "write one of at, group",
        ),
        (
            "supports = [{ nodes = [0, 2] }]",
            "form_finding = \"static\"",
            "test.toml:4:",
            "nothing holds node 0 at (0, 0, 0) and what hangs together with it, 3 nodes in all",
        ),
    ] {
        assert!(PAIR.contains(from), "{from}");
        let message = refused(&PAIR.replace(from, to));
        assert!(message.starts_with(place), "{to}: {message}");
        assert!(message.contains(words), "{to}: {message}");
    }
}

#[test]
fn a_generator_is_checked_too() {
    for (from, to, words) in [
        ("spacing = 0.15", "spacing = 0.0", "must lie above 0"),
        ("cells = [26, 26]", "cells = [26, 0]", "is none"),
        (
            "spacing = 0.15",
            "spacing = 0.15, origin = [0.0, 0.0, 0.0], center = [0.0, 0.0, 0.0]",
            "either origin or center",
        ),
        ("damping = 15.0", "damping = -1.0", "must not lie below 0"),
        ("damping = 15.0", "nodes = [[0.0, 0.0, 0.0]]", "takes no further nodes"),
    ] {
        assert!(WALENSTADT.contains(from), "{from}");
        let message = refused(&WALENSTADT.replace(from, to));
        assert!(message.contains(words), "{message}");
    }
    let without = WALENSTADT.split("[structure.cable]").next().unwrap();
    assert!(refused(without).contains("no table [structure.cable]"));
}

#[test]
fn a_scene_without_a_structure_is_refused() {
    assert!(refused("end_time = 1.0\n").contains("no table [structure]"));
}

#[test]
fn check_tells_the_numbers_of_the_reference_nets() {
    let walenstadt = check(&scene(WALENSTADT)).unwrap();
    let number = |name: &str| walenstadt.numbers[name];
    assert_eq!((number("nodes"), number("elements")), (729.0, 1300.0));
    assert!((number("sag_m") - 0.05).abs() < 5e-7);
    // Four half cables of 7850 kg/m3.
    assert!((number("least_interface_mass_kg") - 2.0 * 7850.0 * 1.256637061e-5 * 0.15).abs() < 1e-12);
    // 1-D bound of the handbook, w^2 <= 4 (E_t + S) A / (L m), m = 2 rho A L: h = L sqrt(2 rho / E); the
    // net without stiffness across sits within the next mode of it.
    let bound = 0.15 * (2.0 * 7850.0 / 8.227864894e9_f64).sqrt();
    assert!((number("critical_step_s") / bound - 1.0).abs() < 5e-3, "{} {bound}", number("critical_step_s"));
    assert_eq!(number("time_step_s"), 0.5 * number("critical_step_s"));

    let cable_net = check(&scene(
        r#"
end_time = 1.0
gravity = [0.0, -6.378103166302658, -6.378103166302658]
[structure]
generator = { type = "rectangular_net", cells = [20, 20], spacing = 0.15 }
cable = { young = 7e5, area = 1.256637061e-5, density = 7850.0, prestress = 1e9, tension_only = false }
damping = 20.0
dead_load = false
"#,
    ))
    .unwrap();
    // All cables at N0: w^2 = 4 q/m (sin^2 + sin^2) with the highest mode k = 19 pi / 40 each way.
    let q = 1e9 * 1.256637061e-5 / 0.15;
    let m = cable_net.numbers["least_interface_mass_kg"];
    let sine = (19.0 * std::f64::consts::PI / 40.0).sin();
    let exact = 2.0 / (8.0 * q / m * sine * sine).sqrt();
    let critical = cable_net.numbers["critical_step_s"];
    // The axial stiffness E A / L = 58.6 N/m beside q = 83776 N/m shortens it by 3e-4 at most.
    assert!((critical / exact - 1.0).abs() < 4e-4, "{critical} {exact}");
    assert!((critical - 4.2e-4).abs() < 0.05e-4);
}

#[test]
fn the_resolved_scene_builds_the_same_structure() {
    let report = check(&scene(WALENSTADT)).unwrap();
    let mut resolved = report.resolved.clone();
    resolved.insert("end_time".into(), 1.0.into());
    resolved.insert("gravity".into(), toml::Value::try_from([0.0, 0.0, -9.81]).unwrap());
    let again = check(&scene(&toml::to_string(&resolved).unwrap())).unwrap();
    assert_eq!(again.resolved, report.resolved);
    assert_eq!(again.numbers["critical_step_s"], report.numbers["critical_step_s"]);
}

#[test]
fn faults_of_parts_are_named_with_their_place_and_numbers() {
    let part = |what: &str| format!("{PAIR}\n[[structure.parts]]\nname = \"p\"\n{what}\n");
    let brake = "element = \"brake\"\ncells = [[0, 1]]\nstiffness = 1e6\n";
    let beam = "element = \"beam\"\ncells = [[0, 1]]\nyoung = 1e9\narea = 1e-3\ndensity = 1.0\n";
    let rope = "element = \"sliding_cable\"\nyoung = 1e9\narea = 1e-4\ndensity = 1.0\n";
    for (text, words) in [
        (part(&format!("{brake}curve = [[0.01, 5e4]]")), "its travel must grow"),
        (part(&format!("{brake}curve = [[0.2, 5e4], [0.1, 6e4]]")), "must increase, 0.1 follows 0.2"),
        (part(&format!("{brake}stroke = -1.0")), "must lie above 0"),
        (part(&brake.replace("[0, 1]", "[0, 1, 2]")), "has 3 nodes, it takes 2"),
        (part(&brake.replace("[0, 1]", "[0, 9]")), "no node 9; nodes are 0 to 2"),
        (part(&format!("{beam}inertia = [0.0, 1e-6]")), "must lie above 0"),
        (part(&format!("{beam}inertia = [1e-6, 1e-6]\nup = [1.0, 0.0, 0.0]")), "`up` lies along the beam"),
        (part(rope), "has no cells"),
        (part(&format!("{rope}cells = [[0, 1, 2]]\nfriction = -0.1")), "must not lie below 0"),
        (part(&format!("{rope}cells = [[0, 1, 2]]\nfrictoin = 0.1")), "frictoin"),
        (
            part(
                "element = \"membrane\"\ncells = [[0, 1, 2]]\nthickness = 1e-3\ndensity = 1.0\nyoung = [1e9]",
            ),
            "has no area",
        ),
        (
            part(
                "element = \"ring\"\ncells = [[0, 1]]\ndiameter = 0.3\nperimeter_stiffness = 1e5\nbending_stiffness = 1e3\nmass = 1.0",
            ),
            "has 2 nodes, it takes 3 to 4",
        ),
        (part("element = \"hawser\"\ncells = [[0, 1]]"), "hawser"),
    ] {
        let message = refused(&text);
        assert!(message.contains("test.toml:") && message.contains(words), "{message}");
    }
}

/// A net between two ropes 2 m apart, which both sag.
const BETWEEN: &str = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [2.0, 0.0, 2.0]]
cables = [{ nodes = [0, 1] }, { nodes = [1, 2] }, { nodes = [3, 4] }, { nodes = [4, 5] }, { nodes = [1, 4], area = 1e-6 }]
supports = [{ nodes = [0, 2, 3, 5] }]
cable = { young = 1e9, area = 1e-4, density = 7850.0, prestress = 1e7 }
groups = [{ name = "lower", nodes = [0, 1, 2] }, { name = "upper", nodes = [3, 4, 5] }]
[[gauge]]
name = "left"
group = "upper"
above = "lower"
quantity = "height"
"#;

#[test]
fn a_height_is_what_is_left_between_two_ropes() {
    let mut run = crate::common::Run::alone(BETWEEN, 1e-4);
    let z = |node: usize| run.ready.mesh.coordinates[3 * node + 2];
    // The lowest of the upper rope is its middle, the highest of the lower rope its ends.
    let height = z(4) - z(0);
    assert!(height < 2.0 && z(1) < 0.0, "{height}");
    run.step(1e-4, &[]);
    assert!((run.value("left_height") - height).abs() < 1e-12, "{}", run.value("left_height"));
    assert_eq!(run.measure("left_height_end"), run.value("left_height"));
    let message = refused(&BETWEEN.replace("above = \"lower\"", ""));
    assert!(message.contains("does not say above what"), "{message}");
    let message = refused(&BETWEEN.replace("above = \"lower\"", "above = \"lowr\""));
    assert!(message.contains("there is no group `lowr`"), "{message}");
    let message = refused(&BETWEEN.replace("quantity = \"height\"", "quantity = \"displacement\""));
    assert!(message.contains("`above` is for quantity"), "{message}");
}

/// The same in another position, cut into two fields by a third pair of nodes of its own; heights by sampling both ropes.
#[test]
fn heights_of_fields_are_the_least_distances_of_two_ropes_along_the_normal() {
    let text = r#"
end_time = 1.0
gravity = [0.0, 5.0, -8.0]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.5, 0.0, 0.1], [5.0, 0.0, 0.0],
         [0.0, 0.0, 2.0], [0.7, 0.0, 2.0], [2.0, 0.0, 2.5], [4.0, 0.0, 2.4], [5.0, 0.0, 2.0], [-3.0, 0.0, 0.0]]
cables = [{ nodes = [0, 1] }, { nodes = [1, 2] }, { nodes = [2, 3] }, { nodes = [3, 4] }, { nodes = [5, 6] }, { nodes = [6, 7] },
          { nodes = [7, 8] }, { nodes = [8, 9] }, { nodes = [10, 5] }, { nodes = [1, 6], area = 1e-6 }, { nodes = [3, 8], area = 1e-6 }]
supports = [{ nodes = [0, 2, 4, 5, 7, 9, 10] }]
loads = [{ nodes = [1], force = [0.0, 0.0, 900.0] }, { nodes = [3], force = [0.0, 0.0, 2500.0] }]
cable = { young = 1e9, area = 1e-4, density = 7850.0, prestress = 1e6 }
groups = [{ name = "lower", nodes = [0, 1, 2, 3, 4] }, { name = "upper", nodes = [10, 5, 6, 7, 8, 9] }, { name = "feet", nodes = [4, 0, 2] },
          { name = "foot", nodes = [2] }]
[[gauge]]
name = "left"
group = "upper"
above = "lower"
posts = "feet"
normal = [0.0, 0.0, 3.0]
quantity = "height"
"#;
    let mut run = crate::common::Run::alone(text, 1e-4);
    let at = |node: usize| [run.ready.mesh.coordinates[3 * node], run.ready.mesh.coordinates[3 * node + 2]];
    let rope = |nodes: &[usize], x: f64| {
        let pieces = nodes.windows(2).map(|pair| (at(pair[0]), at(pair[1])));
        let over = |(a, b): &([f64; 2], [f64; 2])| a[0] <= x && x <= b[0];
        let (a, b) = pieces.clone().find(over).expect("a piece over it");
        a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0])
    };
    let least = |from: f64, to: f64| {
        let places = (0..=100_000).map(|i| from + (to - from) * f64::from(i) / 1e5);
        places
            .map(|x| rope(&[10, 5, 6, 7, 8, 9], x) - rope(&[0, 1, 2, 3, 4], x))
            .fold(f64::INFINITY, f64::min)
    };
    let fields = [least(0.0, 2.0), least(2.0, 5.0)];
    run.step(1e-4, &[]);
    for (name, height) in [
        ("left_height_1", fields[0]),
        ("left_height_2", fields[1]),
        ("left_height", fields[0].min(fields[1])),
    ] {
        assert!((run.value(name) - height).abs() < 1e-5, "{name}: {} {height}", run.value(name));
        assert_eq!(run.measure(&format!("{name}_end")), run.value(name));
    }
    assert!((fields[0] - fields[1]).abs() > 1e-3, "{fields:?}");
    for (a, b, what) in [
        ("posts = \"feet\"", "posts = \"feets\"", "there is no group `feets`"),
        ("posts = \"feet\"", "posts = \"foot\"", "there is no field between them"),
        ("[0.0, 0.0, 3.0]", "[0.0, 0.0, 0.0]", "it has no direction"),
        ("[0.0, 0.0, 3.0]", "[1.0, 0.0, 0.0]", "there is no field between them"),
        ("above = \"lower\"", "", "does not say above what"),
        ("nodes = [10, 5, 6, 7, 8, 9]", "nodes = [10, 5, 6, 7, 2, 9]", "`upper` has no line in field 2"),
        (
            "name = \"lower\", nodes = [0, 1, 2, 3",
            "name = \"lower\", nodes = [0, 10, 2, 3",
            "`lower` has no line in field 1",
        ),
        ("group = \"upper\"", "at = [2.0, 0.0, 2.5]", "is at a point: no rope"),
    ] {
        let message = refused(&text.replace(a, b));
        assert!(message.starts_with("test.toml:") && message.contains(what), "{b}: {message}");
    }
    let message = refused(
        &text.replace("quantity = \"height\"", "quantity = \"velocity\"").replace("above = \"lower\"", ""),
    );
    assert!(message.contains("`posts` is for quantity = \"height\""), "{message}");
}

#[test]
fn check_counts_the_elements_of_each_part() {
    let first = |text: &str| check(&scene(text)).expect("valid").builds.swap_remove(0);
    assert!(first(PAIR).ends_with("kg; 2 cables"), "{}", first(PAIR));
    let part = "[[structure.parts]]\nname = \"rope\"\nelement = \"cable\"\nyoung = 1e9\narea = 1e-4\ndensity = 7850.0\n";
    let text = PAIR.replace("cables = [{ nodes = [0, 1] }, { nodes = [1, 2] }]\n", "");
    let text =
        format!("{text}{part}cells = [[0, 1], [1, 2]]\n[[structure.masses]]\nnodes = [1]\nmass = 1.0\n");
    assert!(first(&text).ends_with("kg; 2 elements of `rope`, 1 point masses"), "{}", first(&text));
}
