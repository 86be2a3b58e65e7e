//! Posts and plates that bend (verification F6, F7).

use crate::common::Run;
use std::f64::consts::PI;

/// A cantilever of length 10 along x, E I = 1000, clamped at its first node; `load` acts on its last.
fn cantilever(elements: usize, axial: f64, supports: &str, load: &str) -> [f64; 3] {
    let nodes: Vec<_> =
        (0..=elements).map(|i| format!("[{:?}, 0.0, 0.0]", 10.0 * i as f64 / elements as f64)).collect();
    let cells: Vec<_> = (0..elements).map(|i| format!("[{i}, {}]", i + 1)).collect();
    let text = format!(
        r#"
end_time = 1.0
[structure]
nodes = [{}]
supports = [{{ nodes = [0], rotations = "xyz" }}{supports}]
loads = [{{ nodes = [{elements}], {load} }}]
[[structure.parts]]
name = "post"
element = "beam"
cells = [{}]
young = {axial:?}
area = 1.0
inertia = [{:?}, {:?}]
density = 1.0
[fem]
integrator = "static"
"#,
        nodes.join(", "),
        cells.join(", "),
        1000.0 / axial,
        1000.0 / axial,
    );
    let run = Run::alone(&text, 0.1);
    run.ready.mesh.coordinates[3 * elements..].try_into().expect("three numbers")
}

#[test]
fn a_cantilever_under_an_end_moment_rolls_up_to_a_circle() {
    // V-F6. The polygon of n chords of the length of their arcs: every point lies (a/2) / sin(a/2) too far out, a = 2 pi f / n.
    let radius = |f: f64| 10.0 / (2.0 * PI * f);
    for f in [0.25, 0.5, 0.75, 1.0] {
        let tip = |elements| {
            // In its plane: a moment that keeps its direction in space tips the ring over, as it should.
            let others: Vec<_> = (1..=elements).collect();
            let plane = format!(", {{ nodes = {others:?}, directions = \"z\", rotations = \"xy\" }}");
            let moment = f * 2.0 * PI * 1000.0 / 10.0;
            cantilever(elements, 1e6, &plane, &format!("moment = [0.0, 0.0, {moment:?}]"))
        };
        let angle = 2.0 * PI * f;
        let exact = [radius(f) * angle.sin(), radius(f) * (1.0 - angle.cos())];
        for elements in [10, 20] {
            let [x, y, z] = tip(elements);
            let half = 0.5 * angle / elements as f64;
            // The factor is known; what is left is the residual, 1e-6 N at most, over stiffnesses of some N/m.
            let allowed = radius(f) * ((half / half.sin() - 1.0) * 2.0) + 1e-6;
            let error = (x - exact[0]).hypot(y - exact[1]);
            assert!(error <= allowed && z.abs() < 1e-9, "f = {f}, {elements}: ({x}, {y}), off by {error}");
        }
    }
}

#[test]
fn a_cantilever_that_points_anywhere_bends_as_one_along_an_axis_but_for_its_error() {
    // Along a, loaded along b across it: V-F7 in space. The plane of bending lies askew to both cross axes, whose angles are
    // taken one by one: another error, which falls with the square of the elements' length as well.
    let [a, b] = [[1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0], [2.0 / 3.0, 1.0 / 3.0, -2.0 / 3.0]];
    let force = 5.0 * 1000.0 / 100.0;
    let tip = |count: usize, along: [f64; 3], across: [f64; 3]| {
        let place = |i: usize| along.map(|x| x * 10.0 * i as f64 / count as f64);
        let nodes: Vec<_> = (0..=count).map(|i| format!("{:?}", place(i))).collect();
        let cells: Vec<_> = (0..count).map(|i| format!("[{i}, {}]", i + 1)).collect();
        let text = format!(
            r#"
end_time = 1.0
[structure]
nodes = [{}]
supports = [{{ nodes = [0], rotations = "xyz" }}]
loads = [{{ nodes = [{count}], force = {:?} }}]
[[structure.parts]]
name = "post"
element = "beam"
cells = [{}]
young = 1e8
area = 1.0
inertia = [1e-5, 1e-5]
density = 1.0
[fem]
integrator = "static"
"#,
            nodes.join(", "),
            across.map(|x| x * force),
            cells.join(", "),
        );
        let end = Run::alone(&text, 0.1).ready.mesh.coordinates[3 * count..].to_vec();
        let on = |v: [f64; 3]| v.iter().zip(&end).map(|(v, x)| v * x).sum::<f64>();
        [on(along), on(across)]
    };
    let apart = |count: usize| {
        let ([x, w], [u, v]) = (tip(count, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]), tip(count, a, b));
        (x - u).hypot(w - v)
    };
    let (coarse, fine) = (apart(10), apart(20));
    assert!(coarse < 0.01 * 10.0 && fine < 0.3 * coarse, "{coarse} {fine}");
}

/// Tip of a strip of shell, 10 m long, 1 m wide, 0.1 m thick, E I = 1000, under the end moment `f 2 pi E I / L`.
fn strip(cells: usize, f: f64) -> [f64; 2] {
    let x = |i: usize| 10.0 * i as f64 / cells as f64;
    let nodes: Vec<_> =
        (0..=cells).flat_map(|i| [0.0, 1.0].map(|y| format!("[{:?}, {y:?}, 0.0]", x(i)))).collect();
    let corner = |i: usize| [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1];
    let triangles: Vec<_> = (0..cells)
        .flat_map(|i| {
            let [a, b, c, d] = corner(i);
            if i % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        })
        .collect();
    let (first, last) = ([0, 1], [2 * cells, 2 * cells + 1]);
    let others: Vec<_> = (2..2 * cells + 2).collect();
    let moment = -0.5 * f * 2.0 * PI * 1000.0 / 10.0;
    let text = format!(
        r#"
end_time = 1.0
[structure]
nodes = [{}]
supports = [{{ nodes = {first:?}, rotations = "xyz" }}, {{ nodes = {others:?}, directions = "y", rotations = "xz" }}]
loads = [{{ nodes = {last:?}, moment = [0.0, {moment:?}, 0.0] }}]
[[structure.parts]]
name = "strip"
element = "shell"
cells = {triangles:?}
thickness = 0.1
density = 1.0
young = 1.2e7
poisson = 0.0
[fem]
integrator = "static"
"#,
        nodes.join(", "),
    );
    let mesh = Run::alone(&text, 0.1).ready.mesh;
    let tip = |c: usize| 0.5 * (mesh.coordinates[3 * last[0] + c] + mesh.coordinates[3 * last[1] + c]);
    [tip(0), tip(2)]
}

#[test]
fn a_strip_of_shell_rolls_up_to_a_circle_with_an_error_of_second_order() {
    // V-F6 with a plate: without Poisson's ratio it is a beam.
    for (f, exact) in [(0.25, [6.36619772368, 6.36619772368]), (0.5, [0.0, 6.36619772368])] {
        let error = |cells: usize| {
            let [x, z] = strip(cells, f);
            (x - exact[0]).hypot(z - exact[1])
        };
        let (coarse, fine) = (error(10), error(20));
        assert!(fine < 0.01 * 10.0, "f = {f}: off by {fine} m");
        // Second order: a quarter, and what the next order leaves of it.
        assert!(fine < 0.35 * coarse, "f = {f}: {coarse} {fine}");
    }
}

#[test]
fn an_elastica_bends_as_far_as_it_should_with_an_error_of_second_order() {
    // V-F7: P L^2 / E I, w / L, (L - x) / L.
    for (load, w, shortening) in [
        (0.5, 0.162143576, 0.015918962),
        (1.0, 0.301720774, 0.056433236),
        (2.0, 0.493457480, 0.160641721),
        (3.0, 0.603253441, 0.254420185),
        (5.0, 0.713791524, 0.387628361),
        (10.0, 0.810609025, 0.554995598),
    ] {
        let tip = |elements| {
            let force = -load * 1000.0 / 100.0;
            // E A so large that the axial strain P / E A is 1e-6 at most.
            let [x, _, z] = cantilever(elements, 1e8, "", &format!("force = [0.0, 0.0, {force:?}]"));
            (-z / 10.0, 1.0 - x / 10.0)
        };
        let (coarse, fine) = (tip(10), tip(20));
        let richardson = |a: f64, b: f64| b + (b - a) / 3.0;
        let (a, b) = (richardson(coarse.0, fine.0), richardson(coarse.1, fine.1));
        // What is left is of fourth order: (kappa h)^4, kappa h = load / 20.
        let allowed = 2e-5 + 0.02 * (load / 20.0_f64).powi(4);
        assert!(
            (a - w).abs() < allowed && (b - shortening).abs() < allowed,
            "{load}: {a} {b} {coarse:?} {fine:?}"
        );
        assert!((fine.0 - w).abs() < 0.3 * (coarse.0 - w).abs() + 1e-6, "{load}: {coarse:?} {fine:?}");
    }
}

/// A cantilever of 2 m along x in four beams, clamped at its first node, 10 N up and 20 N sideways at its tip.
fn loaded(density: &str, fem: &str) -> String {
    format!(
        r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [1.5, 0.0, 0.0], [2.0, 0.0, 0.0]]
supports = [{{ nodes = [0], rotations = "xyz" }}]
loads = [{{ nodes = [4], force = [0.0, 20.0, 10.0] }}]
[[structure.parts]]
name = "post"
element = "beam"
cells = [[0, 1], [1, 2], [2, 3], [3, 4]]
young = 2e11
area = 4e-3
inertia = [2e-5, 8e-6]
{density}
[fem]
{fem}
[[gauge]]
name = "foot"
at = [0.0, 0.0, 0.0]
quantity = "bending_moment"
[[gauge]]
name = "middle"
at = [1.0, 0.0, 0.0]
quantity = "bending_moment"
[[gauge]]
name = "all"
group = "post"
quantity = "bending_moment"
"#
    )
}

#[test]
fn gauges_tell_the_bending_moments_of_beams_which_need_no_density_in_statics() {
    let mut run = Run::alone(&loaded("", "integrator = \"static\""), 0.1);
    run.step(0.1, &[]);
    // Of both planes together: 500^1/2 N times the lever; the tip moves by 1e-5 of it.
    let force = 500.0_f64.sqrt();
    for (gauge, lever) in [
        ("foot_bending_moment", 2.0),
        ("middle_bending_moment_min", 1.0),
        ("middle_bending_moment_max", 1.0),
        ("all_bending_moment_max", 2.0),
        ("all_bending_moment_min", 0.5),
    ] {
        let value = run.value(gauge);
        assert!((value - force * lever).abs() < 1e-3 * force, "{gauge}: {value}");
    }
    let measures = interface_defs::solver::Solver::finish(&mut run.solver).unwrap().measures;
    let most = measures.iter().find(|m| m.name == "all_bending_moment_max").expect("with its member");
    assert_eq!(most.unit, "N m");
    assert!(most.member.as_ref().is_some_and(|m| m.contains("(0.0 0.0 0.0) to (0.5 0.0 0.0)")), "{most:?}");
}

#[test]
fn beams_without_density_do_not_move_in_time() {
    for density in ["", "density = 0.0"] {
        for fem in ["integrator = \"newmark\"", "integrator = \"central_difference\"\ntime_step = 1e-6"] {
            let scene = crate::common::scene(&loaded(density, fem));
            let options = toolkit::program::Options { out: None, shortcuts: true };
            let message = match fem_solver::FemSolver::new(&scene, &options) {
                Err(error) => error.to_string(),
                Ok(_) => panic!("must be refused"),
            };
            assert!(
                message.starts_with("test.toml:7:") && message.contains("`post` have no density"),
                "{message}"
            );
        }
    }
}

#[test]
fn a_gauge_of_bending_moments_wants_beams() {
    let text = loaded("", "integrator = \"static\"").replace("group = \"post\"", "group = \"supports\"");
    let scene = crate::common::scene(&text);
    let options = toolkit::program::Options { out: None, shortcuts: true };
    let error = fem_solver::FemSolver::new(&scene, &options).err().expect("must be refused").to_string();
    assert!(error.contains("there is no beam at the gauge `all`"), "{error}");
}
