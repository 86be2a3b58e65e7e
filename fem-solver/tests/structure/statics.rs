//! Static equilibrium against closed forms and published nets (verification F1 to F5, the drop test).

use crate::common::{Run, WALENSTADT, off};

/// Two bars, half span 1, rise 0.25, E A = 2.1e7 N; what is added holds or loads the apex.
fn truss(more: &str) -> String {
    format!(
        r#"
end_time = 1.0
[structure]
nodes = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.25], [1.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}, {{ nodes = [1, 2] }}]
cable = {{ young = 210e9, area = 1e-4, density = 0.0, tension_only = false }}
[fem]
integrator = "static"
{more}
[[gauge]]
name = "apex"
at = [0.0, 0.0, 0.25]
quantity = "displacement"
"#
    )
}

#[test]
fn a_shallow_truss_follows_its_snap_through_curve_under_prescribed_displacement() {
    // V-F1, driven beyond its limit point by a moving support; 10 digits are printed.
    let text = truss(
        "[[structure.supports]]\nnodes = [0, 2]\n[[structure.supports]]\nnodes = [1]\n\
         motion = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, -0.5]]",
    );
    let text = format!("{text}\n[[gauge]]\nname = \"push\"\nat = [0.0, 0.0, 0.25]\nquantity = \"force\"");
    let mut run = Run::alone(&text, 0.1);
    let mut force_at = |w: f64| {
        run.solve(2.0 * w, &[]).unwrap();
        assert!((run.value("apex_uz") + w).abs() < 1e-15);
        assert!(run.value("reaction_z").abs() < 1e-7, "the three supports are in balance");
        -run.value("push_fz")
    };
    assert!(off(force_at(0.05), 86285.615307) < 1e-11);
    assert!(off(force_at(0.10), 115047.487076) < 1e-11);
    let limit = force_at(0.105662432703);
    assert!(off(limit, 115317.183391) < 1e-11, "{limit}");
    assert!(force_at(0.1056) < limit && force_at(0.1057) < limit);
    assert!(off(force_at(0.394337567297), -115317.183391) < 1e-11);
    // P = K w (1 - 1.5 w / h + ...): the slope at the start to 1e-6 w.
    assert!(off(force_at(1e-7) / 1e-7, 2396822.64742) < 1e-6);
}

#[test]
fn a_shallow_truss_carries_the_loads_of_its_curve() {
    for (load, w) in [(86285.615307, 0.05), (115047.487076, 0.10)] {
        let supports =
            "[[structure.supports]]\nnodes = [0, 2]\n[[structure.supports]]\nnodes = [1]\ndirections = \"y\"";
        let text =
            truss(&format!("{supports}\n[[structure.loads]]\nnodes = [1]\nforce = [0.0, 0.0, {}]", -load));
        let mut run = Run::alone(&text, 0.1);
        let mesh = &run.ready.mesh;
        let down = 0.25 - mesh.coordinates[5];
        // Loads are printed to 12 digits; near the limit dw/dP = 5 times that at the start.
        assert!((down - w).abs() < 1e-9, "{down} is not {w}");
        run.step(0.1, &[]);
        assert!(run.value("apex_uz").abs() < 1e-13, "the state at rest stays");
        assert!(off(run.value("reaction_z"), load) < 1e-9, "{}", run.value("reaction_z"));
    }
}

/// The truss under a load on its apex that follows its path.
fn path(window: f64) -> Run {
    let supports =
        "[[structure.supports]]\nnodes = [0, 2]\n[[structure.supports]]\nnodes = [1]\ndirections = \"y\"";
    let loads = "[[structure.loads]]\nnodes = [1]\nforce = [0.0, 0.0, -1.0]";
    let text = truss(&format!("{supports}\n{loads}"));
    Run::alone(&text.replace("integrator = \"static\"", "integrator = \"static\"\npath_speed = 1.0"), window)
}

/// V-F1: the load of the truss at the depth `w` of its apex.
fn truss_load(w: f64) -> f64 {
    2.1e7 * (0.5 * w - w * w) * (0.25 - w) / 1.0625_f64.powf(1.5)
}

#[test]
fn a_shallow_truss_snaps_through_along_its_path_of_equilibrium() {
    // V-F1 by arc length: the load rises to its limit, falls through 0 to its other limit, and rises again.
    let mut run = path(0.01);
    let (mut most, mut least, mut worst) = (0.0_f64, 0.0_f64, 0.0_f64);
    for step in 1..=60 {
        run.step(0.01, &[]);
        let (w, load) = (-run.value("apex_uz"), run.value("load_factor"));
        assert!((w - 0.01 * f64::from(step)).abs() < 1e-12, "the apex goes its way: {w}");
        worst = worst.max((load - truss_load(w)).abs());
        assert!((run.value("reaction_z") - load).abs() < 1e-6);
        if w < 0.5 {
            (most, least) = (most.max(load), least.min(load));
        }
    }
    assert!(worst < 1e-9 * 115317.183391, "{worst} N");
    // Points of the path 0.01 m apart lie within P'' w^2 / 8 of the limits: P'' = 6 (h - w) E A / L0^3.
    let near = 6.0 * 0.1443 * 2.1e7 / 1.0952 * 0.01 * 0.01 / 8.0;
    assert!(most < 115317.1834 && most > 115317.1834 - near, "{most}");
    assert!(least > -115317.1834 && least < -115317.1834 + near, "{least}");
    assert!(run.value("load_factor") > 1.2e5, "beyond, it bears more than ever");
}

#[test]
fn a_truss_under_a_soft_spring_snaps_back_along_its_path() {
    // A bar of 1 m and 9e5 N/m between load and apex is softer than the truss is unstable (-1.2e6 N/m): beyond the limit
    // the load's own way turns back, and so does the load. In series all carry the same.
    let text = path_text_with_spring();
    let mut run = Run::alone(&text, 0.01);
    let (mut back, mut before) = (false, 0.0);
    for _ in 0..130 {
        run.step(0.01, &[]);
        let (w, load, v) = (-run.value("apex_uz"), run.value("load_factor"), -run.value("load_uz"));
        assert!((load - truss_load(w)).abs() < 1e-7 * 115317.0, "{w}: {load} {}", truss_load(w));
        back |= v < before - 1e-3;
        before = v;
    }
    assert!(back, "the path turns back");
    assert!(-run.value("apex_uz") > 0.5, "and comes through");
}

fn path_text_with_spring() -> String {
    let supports =
        "[[structure.supports]]\nnodes = [0, 2]\n[[structure.supports]]\nnodes = [1, 3]\ndirections = \"xy\"";
    let loads = "[[structure.loads]]\nnodes = [3]\nforce = [0.0, 0.0, -1.0]";
    let gauge = "[[gauge]]\nname = \"load\"\nat = [0.0, 0.0, -0.75]\nquantity = \"displacement\"";
    truss(&format!("{supports}\n{loads}\n{gauge}"))
        .replace("integrator = \"static\"", "integrator = \"static\"\npath_speed = 1.0")
        .replace("[1.0, 0.0, 0.0]]", "[1.0, 0.0, 0.0], [0.0, 0.0, -0.75]]")
        .replace("{ nodes = [1, 2] }]", "{ nodes = [1, 2] }, { nodes = [1, 3], area = 4.3e-6 }]")
}

#[test]
fn the_limit_load_is_the_last_one_with_an_equilibrium_near_by() {
    let limit = 115317.183391;
    let with_load = |load: f64| {
        let supports =
            "[[structure.supports]]\nnodes = [0, 2]\n[[structure.supports]]\nnodes = [1]\ndirections = \"y\"";
        let text =
            truss(&format!("{supports}\n[[structure.loads]]\nnodes = [1]\nforce = [0.0, 0.0, {}]", -load));
        let mut solver = crate::common::solver(&text);
        use interface_defs::solver::Solver;
        let ready = solver.prepare(&Default::default(), &mut |_| Ok(()));
        ready.map(|ready| 0.25 - ready.mesh.coordinates[5])
    };
    // w_limit - w = sqrt(2 dP / |P''|), P'' = 6 (h - w) E A / L^3: 1e-6 of the load below the limit is 1.6e-4 m.
    let below = with_load(limit * (1.0 - 1e-6)).unwrap();
    assert!((below - 0.105662432703).abs() < 2e-4, "{below}");
    // Beyond it nothing is near: it has snapped through, or nothing is found; never something in between.
    if let Ok(beyond) = with_load(limit * (1.0 + 1e-4)) {
        assert!(beyond > 0.5, "{beyond}");
    }
}

/// A cable of `bars` bars over a span of 10 m, 11 m unstretched, 10 N/m.
fn catenary(bars: usize) -> Run {
    let nodes: Vec<String> =
        (0..=bars).map(|i| format!("[{:?}, 0.0, 0.0]", 10.0 * i as f64 / bars as f64)).collect();
    let length = 11.0 / bars as f64;
    let cables: Vec<String> =
        (0..bars).map(|i| format!("{{ nodes = [{i}, {}], length = {length:?} }}", i + 1)).collect();
    let text = format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -10.0]
[structure]
nodes = [{}]
cables = [{}]
cable = {{ young = 1e13, area = 1e-4, density = 1e4 }}
[[structure.supports]]
nodes = [0, {bars}]
[fem]
integrator = "static"
[[gauge]]
name = "left"
at = [0.0, 0.0, 0.0]
quantity = "force"
[[gauge]]
name = "all"
group = "whole"
quantity = "tension"
[[structure.groups]]
name = "whole"
nodes = [{}]
"#,
        nodes.join(", "),
        cables.join(", "),
        (0..=bars).map(|i| i.to_string()).collect::<Vec<_>>().join(", "),
    );
    Run::alone(&text, 0.1)
}

#[test]
fn a_cable_hangs_in_a_catenary_with_an_error_of_second_order() {
    // V-F2, all but inextensible: strain T / E A = 1e-7 moves the sag by some 11 m times that.
    let (sag, pull, strain) = (2.00300790736, 65.4963947637, 1e-6);
    let numbers = |bars: usize| {
        let mut run = catenary(bars);
        (run.measure("sag"), -run.value("left_fx"), run.value("left_fz"), run.value("all_tension_max"))
    };
    let (coarse, fine) = (numbers(20), numbers(40));
    let ratio = (coarse.0 - sag) / (fine.0 - sag);
    // Next term of the error: (1/40)^4 against (1/40)^2 / 10, some percent.
    assert!((ratio - 4.0).abs() < 0.1, "errors fall by {ratio}");
    let richardson = |a: f64, b: f64| b + (b - a) / 3.0;
    assert!((richardson(coarse.0, fine.0) - sag).abs() < 1e-5 + strain, "{coarse:?} {fine:?}");
    assert!(off(richardson(coarse.1, fine.1), pull) < 1e-5, "{coarse:?} {fine:?}");
    // Half of the weight on each side, the half element at the support included: exact at any fineness.
    assert!(off(fine.2, 55.0) < 1e-9, "{}", fine.2);
    // The last bar ends half a bar below the support.
    assert!(off(fine.3, 85.526) < 0.02, "{}", fine.3);
}

/// Two prestressed cables of length 1, N0 = 1000, E A = 1e5, without mass; load across.
#[test]
fn a_prestressed_cable_carries_a_load_across() {
    for (load, exact) in [(100.0, 0.0453397651516), (1000.0, 0.184741903783), (10000.0, 0.449800711381)] {
        let run = Run::alone(
            &format!(
                r#"
end_time = 1.0
[structure]
nodes = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
cables = [{{ nodes = [0, 1] }}, {{ nodes = [1, 2] }}]
cable = {{ young = 1e9, area = 1e-4, density = 0.0, prestress = 1e7 }}
loads = [{{ at = [0.0, 0.0, 0.0], force = [0.0, 0.0, {:?}] }}]
supports = [{{ nodes = [0, 2] }}]
[fem]
integrator = "static"
"#,
                -load
            ),
            0.1,
        );
        // V-F3, printed to 12 digits.
        let u = -run.ready.mesh.coordinates[5];
        assert!(off(u, exact) < 2e-12, "{u} is not {exact}");
    }
}

/// V-F5: a square net, its edges held, E A / A and prestress given; centre and reaction.
fn net(young: f64, prestress: f64) -> Run {
    Run::alone(
        &format!(
            r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = {{ type = "rectangular_net", cells = [20, 20], spacing = 0.15, center = [0.0, 0.0, 0.0] }}
cable = {{ young = {young:?}, area = 1.256637061e-5, density = 7850.0, prestress = {prestress:?}, tension_only = false }}
[[gauge]]
name = "force"
group = "edges"
quantity = "force"
"#
        ),
        1e-4,
    )
}

fn centre(run: &Run) -> f64 {
    let nodes = run.ready.mesh.node_count();
    run.ready.mesh.coordinates[3 * (nodes / 2) + 2]
}

#[test]
fn nets_under_dead_load_hang_as_deep_as_they_should() {
    let area = 1.256637061e-5;
    // a) prestressed, elastic; 10 digits and 3 of the force.
    let a = net(2.638937828e6 / area, 100.0 / area);
    assert!(off(centre(&a), -0.008473657752) < 1e-9, "{:.12}", centre(&a));
    assert!(off(a.value("force_fz_sum"), 121.932386242) < 1e-9, "{}", a.value("force_fz_sum"));
    assert_eq!(a.value("force_fz_sum"), a.value("reaction_z"));
    // b) all but a force-density net: 12 digits.
    let b = net(7e5, 1e9);
    assert!(off(centre(&b), -0.000101919268584) < 1e-9, "{:.15}", centre(&b));
    // c) without any tension at the start.
    let c = net(2.638937828e6 / area, 0.0);
    assert!(off(centre(&c), -0.0119697076) < 1e-8, "{:.12}", centre(&c));
}

#[test]
fn the_largest_tension_of_a_net_is_that_of_the_reference() {
    let area = 1.256637061e-5;
    // S A = N L / l; the strains are some 1e-5, so N differs from it in the fifth digit.
    let mut a = net(2.638937828e6 / area, 100.0 / area);
    assert!(off(a.measure("max_cable_force"), 160.5352) < 1e-4);
    let mut c = net(2.638937828e6 / area, 0.0);
    assert!(off(c.measure("max_cable_force"), 122.35598) < 1e-4);
}

#[test]
fn a_coarse_net_with_nodal_loads_takes_its_shape() {
    // V-F5 d), 12 digits.
    let run = Run::alone(
        r#"
end_time = 1.0
[structure]
generator = { type = "rectangular_net", cells = [4, 4], spacing = 1.0 }
cable = { young = 1e8, area = 1e-4, density = 1.0, prestress = 1e7 }
loads = [{ group = "interior", force = [0.0, 0.0, -10.0] }]
"#,
        1e-4,
    );
    let z = |i: usize, j: usize| run.ready.mesh.coordinates[3 * (5 * j + i) + 2];
    for (value, exact) in
        [(z(2, 2), -0.0112479531712), (z(1, 2), -0.00874841757852), (z(1, 1), -0.00687384001246)]
    {
        assert!(off(value, exact) < 2e-11, "{value} is not {exact}");
    }
}

#[test]
fn both_walenstadt_nets_sag_as_they_were_tuned_to_and_weigh_on_their_frame() {
    for (prestress, sag) in [("0.0", 0.05), ("-1.35898e7", 0.1)] {
        let text = WALENSTADT.replace("prestress = 0.0", &format!("prestress = {prestress}"));
        let mut run = Run::alone(&text, 5e-5);
        let measured = run.measure("sag");
        // Digits printed of stiffness and slack strain: 5e-8 m and 2e-7 m of sag.
        assert!((measured - sag).abs() < 5e-7, "{measured} is not {sag}");
        assert!((run.value("reaction_z") - 188.705).abs() < 1e-3, "{}", run.value("reaction_z"));
        // In balance: what is left on the free nodes lies at rounding, below 1e-10 of the weight.
        run.step(5e-5, &[]);
        assert!((run.value("reaction_z") - 188.705).abs() < 1e-3);
        assert_eq!(run.value("energy_kinetic_fem"), 0.0);
        assert_eq!(run.count("skipped_windows"), 1);
        assert_eq!(run.ready.mesh.lines.len(), 1300);
    }
}

#[test]
fn what_is_left_of_the_residual_moves_nothing_when_the_net_is_computed_all_the_same() {
    use toolkit::program::Options;
    let scene = crate::common::scene(WALENSTADT);
    let solver = fem_solver::FemSolver::new(&scene, &Options { out: None, shortcuts: false }).unwrap();
    let mut run = Run::of(solver, crate::common::coupled_plan(5e-5, interface_defs::Sampling::Means, 1, 1));
    for _ in 0..200 {
        run.step(5e-5, &[]);
    }
    assert_eq!(run.count("skipped_windows"), 0);
    // A residual of 1e-10 of 0.3 N on 0.03 kg over 10 ms moves 1e-13 m.
    let middle = run.displacement(13 * 27 + 13);
    assert!(middle.iter().all(|u| u.abs() < 1e-13), "{middle:?}");
    assert!(run.value("energy_kinetic_fem") < 1e-18);
}

#[test]
fn what_becomes_unstable_in_two_directions_at_once_is_followed_and_reported() {
    // Two trusses side by side that do not know of each other: both snap through at one load.
    let pair = |load: f64| {
        let text = format!(
            r#"
end_time = 1.0
[structure]
nodes = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.25], [1.0, 0.0, 0.0], [-1.0, 5.0, 0.0], [0.0, 5.0, 0.25], [1.0, 5.0, 0.0]]
cables = [{{ nodes = [0, 1] }}, {{ nodes = [1, 2] }}, {{ nodes = [3, 4] }}, {{ nodes = [4, 5] }}]
cable = {{ young = 210e9, area = 1e-4, density = 0.0, tension_only = false }}
supports = [{{ nodes = [0, 2, 3, 5] }}, {{ nodes = [1, 4], directions = "xy" }}]
loads = [{{ nodes = [1], force = [0.0, 0.0, -1.0] }}, {{ nodes = [4], force = [0.0, 0.0, {load:?}] }}]
[fem]
integrator = "static"
path_speed = 1.0
[[gauge]]
name = "apex"
at = [0.0, 0.0, 0.25]
quantity = "displacement"
"#
        );
        let mut run = Run::alone(&text, 0.005);
        let mut most = 0.0_f64;
        for _ in 0..25 {
            run.step(0.005, &[]);
            most = most.max(run.value("negative_pivots"));
            let w = -run.value("apex_uz");
            assert!((run.value("load_factor") - truss_load(w)).abs() < 1e-7 * 115317.0, "{w}");
        }
        let measures = interface_defs::solver::Solver::finish(&mut run.solver).unwrap().measures;
        let found: Vec<_> = measures.iter().filter(|m| m.name.contains("_point_")).collect();
        // V-F1: the limit load, found between two rows.
        assert!(off(found[0].value, 115317.183391) < 1e-6, "{found:?}");
        let names: Vec<_> = found.iter().map(|m| m.name.clone()).collect();
        (most, names)
    };
    // The limit is at w = 0.1057, which is passed before 25 steps of 0.005 are done. Both at once: a limit and a branch.
    assert_eq!(pair(-1.0), (2.0, vec!["limit_point_1".to_string(), "branch_point_1".to_string()]));
    // With half the load on the other one truss snaps alone.
    assert_eq!(pair(-0.5), (1.0, vec!["limit_point_1".to_string()]));
}
