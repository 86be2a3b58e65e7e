//! Nodes on the ground: rest, slip, energy, nets that are draped over it; what no one can mean.

use crate::common::{Run, check, coupled_plan, off, scene};
use fem_solver::FemSolver;
use interface_defs::Sampling;
use std::fs;
use tempfile::TempDir;
use toolkit::alloc::allocations;
use toolkit::program::Options;

const G: f64 = 9.81;

/// A raster of heights, 0.5 m apart, of 40 m by 40 m around (2600000, 1200000), in a directory of its own.
fn raster(height: impl Fn(f64, f64) -> f64) -> TempDir {
    let dir = tempfile::tempdir().expect("a directory");
    let mut text = "ncols 81\nnrows 81\nxllcenter 2599980\nyllcenter 1199980\ncellsize 0.5\n".to_owned();
    for row in 0..81 {
        let line: Vec<String> = (0..81)
            .map(|i| format!("{:?}", height(f64::from(i) * 0.5 - 20.0, 20.0 - f64::from(row) * 0.5)))
            .collect();
        text += &(line.join(" ") + "\n");
    }
    fs::write(dir.path().join("g.asc"), text).expect("written");
    dir
}

/// A slope that falls along x by `angle` degrees.
fn slope(angle: f64) -> TempDir {
    raster(move |x, _| 500.0 - angle.to_radians().tan() * x)
}

/// `[structure.ground]` with that raster.
fn ground(dir: &TempDir, more: &str) -> String {
    format!("ground = {{ file = {:?}, {more} }}\n", dir.path().join("g.asc"))
}

/// A mass of 2 kg, 0.1 m in radius by nothing, `depth` in the slope at (2600000, 1200000, 500).
fn mass(ground: &str, depth: f64, angle: f64, fem: &str) -> String {
    let (sine, cosine) = angle.to_radians().sin_cos();
    let at = [2.6e6 - depth * sine, 1.2e6, 500.0 - depth * cosine];
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -{G}]
[structure]
nodes = [{at:?}]
masses = [{{ nodes = [0], mass = 2.0 }}]
form_finding = "none"
{ground}
[fem]
{fem}
[[gauge]]
name = "mass"
at = {at:?}
quantity = "displacement"
[[gauge]]
name = "mass"
at = {at:?}
quantity = "velocity"
"#
    )
}

#[test]
fn a_mass_rests_below_the_angle_of_friction_and_slides_above_it() {
    let angle = 30.0_f64;
    let (dir, (sine, cosine)) = (slope(angle), angle.to_radians().sin_cos());
    let (weight, k) = (2.0 * G, 2e5);
    let depth = weight * cosine / k;
    for fem in [
        "time_step = 1e-4",
        "integrator = \"generalized_alpha\"\ntime_step = 2e-4",
        "integrator = \"newmark\"\ntime_step = 2e-4",
    ] {
        // tan 30 is 0.577. It starts at the depth of rest, swings to twice the force of rest at first, slips by less than that way each time,
        // and stays.
        let holds = ground(&dir, "stiffness = 2e5, friction = 0.6, restitution = 1.0");
        let text = mass(&holds, depth, angle, fem).replace("form_finding", "damping = 40.0\nform_finding");
        let mut run = Run::alone(&text, 1e-2);
        (0..100).for_each(|_| run.step(1e-2, &[]));
        let [x, z] = ["mass_ux", "mass_uz"].map(|c| run.value(c));
        let (along, normal) = (x * cosine - z * sine, x * sine + z * cosine);
        // Damping has left exp(-20) of the swing.
        assert!(along < 10.0 * weight * sine / k, "{along} m along the slope, {fem}");
        assert!(normal.abs() < 1e-6 * depth, "{normal} m off the depth of rest, {fem}");
        assert!(
            off(run.value("ground_force_z"), weight) < 1e-6
                && run.value("ground_force_x").abs() < 1e-6 * weight
        );

        let slips = ground(&dir, "stiffness = 2e5, friction = 0.3, restitution = 1.0");
        let mut run = Run::alone(&mass(&slips, depth, angle, fem), 1e-2);
        // The spring of friction is drawn out first, over 0.03 mm in 3 ms.
        let halves = [0, 1].map(|_| {
            (0..50).for_each(|_| run.step(1e-2, &[]));
            let way = run.value("mass_ux").hypot(run.value("mass_uz"));
            [run.value("mass_vx").hypot(run.value("mass_vz")), run.value("energy_dissipated_fem"), way]
        });
        let [speed, rubbed, way] = [0, 1, 2].map(|i| halves[1][i] - halves[0][i]);
        let expected = 0.5 * G * (sine - 0.3 * cosine);
        assert!(off(speed, expected) < 1e-6, "{speed} m/s, {expected} m/s expected, {fem}");
        assert!(off(rubbed, 0.3 * weight * cosine * way) < 1e-6, "{rubbed} J, {fem}");
    }
}

#[test]
fn a_mass_that_is_put_on_a_slope_comes_to_rest_or_slides_as_coulomb_says() {
    let angle = 30.0_f64;
    let (dir, (sine, cosine)) = (slope(angle), angle.to_radians().sin_cos());
    for fem in [
        "time_step = 1e-4",
        "",
        "integrator = \"generalized_alpha\"\ntime_step = 2e-4",
        "integrator = \"newmark\"\ntime_step = 2e-4",
    ] {
        // On the surface, where its weight throws it in: 5 kg, stiffness and restitution as they are by default.
        let of = |friction: f64| {
            let text = mass(&ground(&dir, &format!("friction = {friction}")), 0.0, angle, fem);
            let mut run = Run::alone(&text.replace("mass = 2.0", "mass = 5.0"), 1e-2);
            let start = run.balance();
            let speed = |run: &Run| ["x", "y", "z"].map(|c| run.value(&format!("mass_v{c}")));
            (0..50).for_each(|_| run.step(1e-2, &[]));
            let half = speed(&run);
            (0..50).for_each(|_| run.step(1e-2, &[]));
            let size = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
            let turned = 5.0 * G * 0.5 * sine * sine * (sine - friction * cosine).max(0.0) * G;
            let off = (run.balance() - start).abs() / turned.max(run.value("energy_dissipated_fem"));
            (size(half), size(speed(&run)), off)
        };
        let (_, speed, off_balance) = of(0.7);
        assert!(speed < 1e-6, "{speed} m/s, {fem}");
        assert!(off_balance < 5e-3, "{off_balance}, {fem}");
        let (half, speed, off_balance) = of(0.4);
        let expected = G * (sine - 0.4 * cosine);
        assert!(off(2.0 * (speed - half), expected) < 1e-3, "{} m/s2, {fem}", 2.0 * (speed - half));
        assert!(off(speed, expected) < 0.01, "{speed} m/s, {expected} m/s, {fem}");
        assert!(off_balance < 5e-3, "{off_balance}, {fem}");
    }
}

#[test]
fn a_mass_that_bounces_and_slides_over_hills_keeps_its_books() {
    let dir = raster(|x, y| 500.0 + 0.4 * (0.8 * x).sin() + 0.3 * (0.7 * y + 0.3 * x).cos());
    let balance = |fem: &str, restitution: f64| {
        let table = ground(&dir, &format!("stiffness = 2e5, friction = 0.3, restitution = {restitution}"));
        let text = mass(&table, -0.8, 0.0, fem).replace(
            "form_finding",
            "velocities = [{ nodes = [0], velocity = [3.0, 1.0, 0.0] }]\nform_finding",
        );
        let mut run = Run::alone(&text, 1e-2);
        let (start, mut worst) = (run.balance(), 0.0_f64);
        let kinetic = run.value("energy_kinetic_fem");
        for _ in 0..100 {
            run.step(1e-2, &[]);
            worst = worst.max((run.balance() - start).abs());
        }
        assert!(run.value("energy_dissipated_fem") > 0.1 * kinetic);
        worst / kinetic
    };
    for restitution in [1.0, 0.6] {
        let [coarse, fine] = [4e-4, 1e-4].map(|h| balance(&format!("time_step = {h}"), restitution));
        assert!(fine < 2e-3 && coarse > 2.0 * fine, "{coarse} {fine}");
        let implicit = balance("integrator = \"generalized_alpha\"\ntime_step = 1e-4", restitution);
        assert!(implicit < 5e-3, "{implicit}");
    }
}

/// A chain of `count` cables down the slope, its upper end held.
fn chain(ground: &str, angle: f64, count: usize, length: f64) -> String {
    let (sine, cosine) = angle.to_radians().sin_cos();
    let nodes: Vec<[f64; 3]> = (0..=count)
        .map(|i| i as f64 * length / count as f64)
        .map(|s| [2.6e6 + s * cosine, 1.2e6, 500.0 - s * sine])
        .collect();
    let cables: Vec<String> = (0..count).map(|i| format!("{{ nodes = [{i}, {}] }}", i + 1)).collect();
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -{G}]
[structure]
nodes = {nodes:?}
cables = [{}]
supports = [{{ nodes = [0] }}]
cable = {{ young = 1e11, area = 1e-4, density = 7850.0 }}
{ground}
[[gauge]]
name = "top"
at = {:?}
quantity = "tension"
"#,
        cables.join(", "),
        nodes[0]
    )
}

#[test]
fn a_chain_on_a_slope_pulls_with_its_weight_along_it() {
    let (angle, length, count) = (40.0_f64, 10.0, 20);
    let dir = slope(angle);
    let text = chain(&ground(&dir, "friction = 0.0"), angle, count, length);
    let run = Run::alone(&text, 1e-3);
    let per_metre = 7850.0 * 1e-4 * G;
    // Half of the first cable's weight lies on the support.
    let borne = per_metre * length * (1.0 - 0.5 / count as f64) * angle.to_radians().sin();
    let tension = run.value("top_tension");
    // Depths of 1e-5 m turn the first cable by as much over its 0.5 m.
    assert!(off(tension, borne) < 1e-4, "{tension} N, {borne} N");
    assert!(off(borne, per_metre * length * angle.to_radians().sin()) < 0.03);
    let up = run.value("reaction_z") + run.value("ground_force_z");
    assert!(off(up, per_metre * length) < 1e-9, "{up} N");
    let across = run.value("reaction_x") + run.value("ground_force_x");
    assert!(across.abs() < 1e-9 * per_metre * length, "{across} N");
}

/// A net of 8 by 10 cells of 0.5 m, drawn in the slope and held along its top.
fn net(ground: &str, angle: f64, more: &str) -> String {
    let (sine, cosine) = angle.to_radians().sin_cos();
    let (columns, rows) = (9, 11);
    let nodes: Vec<[f64; 3]> = (0..columns * rows)
        .map(|k| (0.5 * (k % columns) as f64, 0.5 * (k / columns) as f64))
        .map(|(y, s)| [2.6e6 + s * cosine, 1.2e6 + y, 500.01 - s * sine])
        .collect();
    let mut cables = Vec::new();
    for k in 0..columns * rows {
        cables.extend((k % columns < columns - 1).then(|| format!("{{ nodes = [{k}, {}] }}", k + 1)));
        cables.extend((k / columns < rows - 1).then(|| format!("{{ nodes = [{k}, {}] }}", k + columns)));
    }
    let top: Vec<usize> = (0..columns).collect();
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -{G}]
[structure]
nodes = {nodes:?}
cables = [{}]
supports = [{{ nodes = {top:?} }}]
cable = {{ young = 1e11, area = 2e-5, density = 7850.0, radius = 0.005 }}
{ground}
{more}
"#,
        cables.join(", ")
    )
}

#[test]
fn a_draped_net_finds_its_rest_and_friction_keeps_it_there() {
    let angle = 50.0_f64;
    let dir = slope(angle);
    for file in [&dir, &raster(|x, y| 500.0 - 1.19 * x + 0.15 * (2.0 * x).sin() * (1.5 * y).cos())] {
        let text = net(&ground(file, "friction = 0.0"), angle, "");
        let mut run = Run::alone(&text, 1e-2);
        let weight: f64 = run.solver.model().mass.iter().sum::<f64>() * G;
        let sum = ["x", "y", "z"]
            .map(|c| run.value(&format!("reaction_{c}")) + run.value(&format!("ground_force_{c}")));
        assert!(
            off(sum[2], weight) < 1e-9 && sum[0].abs().max(sum[1].abs()) < 1e-9 * weight,
            "{sum:?} of {weight} N"
        );
        if file.path() == dir.path() {
            // Top row: half a cell's weight of its lines, and its own cables.
            let line = 7850.0 * 2e-5 * G * 0.5;
            let free = weight - line * (8.0 + 0.5 * 9.0);
            let (x, z) = (run.value("reaction_x"), run.value("reaction_z") - (weight - free));
            let (sine, cosine) = angle.to_radians().sin_cos();
            // Cables bend by the radius at the top: 5 mm less over 0.5 m.
            let along = z * sine - x * cosine;
            assert!(off(along, free * sine) < 1e-3, "{along} N, {} N", free * sine);
        }
        assert!(run.value("energy_kinetic_fem") == 0.0);
        (0..5).for_each(|_| run.step(1e-2, &[]));
        assert!(run.value("energy_kinetic_fem") == 0.0, "at rest nothing is computed");
    }
    // With friction, and something that moves: steps are taken, and the net stays where it is.
    let text = net(
        &ground(&dir, "friction = 0.8"),
        angle,
        "loads = [{ nodes = [40], force = [0.0, 0.0, -1.0], history = [[0.0, 0.0], [0.02, 1.0]] }]",
    );
    let mut run = Run::alone(&text, 1e-2);
    (0..10).for_each(|_| run.step(1e-2, &[]));
    assert!(run.value("energy_kinetic_fem") > 0.0);
    assert!(run.value("energy_kinetic_fem") + run.value("energy_dissipated_fem") < 0.1, "J");
}

#[test]
fn a_window_depends_on_its_start_and_its_force_alone_and_allocates_nothing() {
    let dir = slope(50.0);
    for (fem, sampling) in [
        ("[fem]\ntime_step = 5e-5\n", Sampling::Means),
        ("[fem]\nintegrator = \"generalized_alpha\"\ntime_step = 2e-4\n", Sampling::Means),
    ] {
        let text = net(&ground(&dir, "friction = 0.4"), 50.0, fem);
        let mut run = Run::with(&text, coupled_plan(1e-3, sampling, 1, 1));
        let force = |amount: f64| {
            let mut force = vec![0.0; run.force_len];
            [40, 41, 49, 50].iter().for_each(|node| force[3 * node + 2] = amount);
            force[3 * 41] = 0.5 * amount.abs();
            force
        };
        let (a, b) = (force(-60.0), force(35.0));
        (0..6).for_each(|_| run.step(1e-3, &a));
        run.solve(1e-3, &a).expect("solved");
        let first = run.output.clone();
        run.solve(1e-3, &b).expect("solved");
        assert_ne!(first, run.output);
        let before = allocations();
        run.solve(1e-3, &a).expect("solved");
        // Where Newton fails, a message is made, and the window is begun anew.
        assert!(allocations() == before || run.count("refined_windows") > 0, "{fem}");
        assert!(first.iter().zip(&run.output).all(|(x, y)| x.to_bits() == y.to_bits()), "{fem}");
        assert!(run.value("energy_dissipated_fem") > 0.0);
    }
}

#[test]
fn the_critical_step_resolves_a_node_on_the_ground_and_is_stable_with_its_dashpot() {
    let dir = slope(10.0);
    let text = mass(&ground(&dir, "restitution = 0.5"), 0.0, 10.0, "");
    let report = check(&scene(&text)).expect("valid");
    // 1e6/s2 times the mass: steps of 2/5 of 1/w, for the energy.
    let critical = report.numbers["critical_step_s"];
    assert!(off(critical, 0.4e-3) < 1e-12, "{critical} s");
    // Of a low restitution the damping ratio decides: h w = 2 (sqrt(1 + g^2) - g).
    let soft = check(&scene(&mass(&ground(&dir, "restitution = 0.01"), 0.0, 10.0, ""))).expect("valid");
    let g = fem_solver::element::ground_contact::damping_ratio(0.01);
    assert!(off(soft.numbers["critical_step_s"], 2e-3 * ((1.0 + g * g).sqrt() - g)) < 1e-12, "{g}");
    let line = report.builds.iter().find(|line| line.starts_with("ground: 1 nodes")).expect("is said");
    assert!(line.contains("2.000e6 N/m") && line.contains("friction 0.5"), "{line}");
    // Far above the ground it counts as well: it may come down.
    let far = check(&scene(&mass(&ground(&dir, "restitution = 0.5"), -3.0, 10.0, ""))).expect("valid");
    assert_eq!(far.numbers["critical_step_s"], critical);
}

#[test]
fn what_no_one_can_mean_is_refused_with_its_place() {
    let dir = slope(30.0);
    let refused = |text: &str| {
        let scene = scene(text);
        match FemSolver::new(&scene, &Options::default()) {
            Err(error) => error.to_string(),
            Ok(_) => check(&scene).expect_err("must be refused").to_string(),
        }
    };
    let with = |more: &str| mass(&ground(&dir, more), 0.0, 30.0, "");
    for (more, words) in [
        ("friction = -0.1", "structure.ground.friction"),
        ("friction = 30.0", "the tangent of the angle"),
        ("restitution = 0.0", "it must lie above 0, and not above 1"),
        ("stiffness = 0.0", "N/m, it must lie above 0"),
        ("groups = [\"nets\"]", "no group `nets`"),
        ("frction = 0.3", "friction"),
    ] {
        let message = refused(&with(more));
        assert!(message.contains(words), "{message}");
    }
    let deep = refused(&mass(&ground(&dir, ""), 3.0, 30.0, ""));
    assert!(
        deep.contains("1 node is modelled more than 1 m below the ground, the deepest by 3.00 m: node 0"),
        "{deep}"
    );
    let beside = refused(&with("").replace("2600000", "2600900"));
    assert!(beside.contains("the ground does not reach below node 0 at (2600900"), "{beside}");
    let nothing = refused(&mass("ground = {}", 0.0, 30.0, ""));
    assert!(
        nothing.contains("file = \\\"FILE.asc\\\"") || nothing.contains("file = \"FILE.asc\""),
        "{nothing}"
    );
    let light = mass(&ground(&dir, ""), 0.0, 30.0, "integrator = \"static\"").replace(
        "masses = [{ nodes = [0], mass = 2.0 }]",
        "springs = [{ nodes = [0], stiffness = [1e3, 1e3, 1e3] }]",
    );
    assert!(refused(&light).contains("has no mass, of which its stiffness in the ground would follow"));
    // In it by less: a word, with the energy that would throw it out.
    let shallow = check(&scene(&mass(&ground(&dir, ""), 0.2, 30.0, ""))).expect("valid");
    let said =
        shallow.warnings.iter().find(|w| w.message.contains("modelled in the ground")).expect("is said");
    assert!(said.message.contains("0.200 m") && said.message.contains("4.000e4 J"), "{said}");
}
