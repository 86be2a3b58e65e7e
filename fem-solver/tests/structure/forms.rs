//! Form finding, each way of it, and the membrane that a pressure bulges.

use crate::common::{Run, off, scene};
use fem_solver::FemSolver;
use interface_defs::solver::Solver;
use toolkit::program::Options;

/// A clamped disc of membrane, radius 1 m, E h = 1e6 N/m, under q = 100 N/m2 down: depth of its centre [m], larger principal
/// force of the triangles there and of those at its edge, mean over each [N/m].
fn hencky(rings: usize, poisson: f64) -> [f64; 3] {
    let mut nodes = vec![[0.0, 0.0]];
    let first = |ring: usize| if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    for ring in 1..=rings {
        for i in 0..6 * ring {
            let angle = std::f64::consts::TAU * i as f64 / (6 * ring) as f64;
            let r = ring as f64 / rings as f64;
            nodes.push([r * angle.cos(), r * angle.sin()]);
        }
    }
    let mut cells = Vec::new();
    for ring in 1..=rings {
        let (outer, inner) = (6 * ring, 6 * (ring - 1));
        for sector in 0..6 {
            for i in 0..ring {
                let at = |n: usize| first(ring) + (sector * ring + n) % outer;
                let below = |n: usize| {
                    if ring == 1 { 0 } else { first(ring - 1) + (sector * (ring - 1) + n) % inner }
                };
                cells.push([at(i), at(i + 1), below(i)]);
                if i + 1 < ring {
                    cells.push([at(i + 1), below(i + 1), below(i)]);
                }
            }
        }
    }
    let mut share = vec![0.0; nodes.len()];
    for cell in &cells {
        let [a, b, c] = cell.map(|n| nodes[n]);
        let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
        cell.iter().for_each(|n| share[*n] += area / 3.0);
    }
    let list = |items: Vec<String>| items.join(", ");
    let text = format!(
        r#"
end_time = 1.0
[structure]
nodes = [{}]
supports = [{{ nodes = {:?} }}]
loads = [{}]
[[structure.parts]]
name = "skin"
element = "membrane"
cells = {cells:?}
thickness = 1e-3
density = 0.0
young = [1e9]
poisson = {poisson:?}
wrinkles = false
[fem]
integrator = "static"
"#,
        list(nodes.iter().map(|[x, y]| format!("[{x:?}, {y:?}, 0.0]")).collect()),
        (first(rings)..nodes.len()).collect::<Vec<_>>(),
        list(
            (0..first(rings))
                .map(|n| format!("{{ nodes = [{n}], force = [0.0, 0.0, {:?}] }}", -100.0 * share[n]))
                .collect()
        ),
    );
    let run = Run::alone(&text, 0.1);
    let (model, now) = (run.solver.model(), &run.ready.mesh.coordinates);
    let force = |at: &dyn Fn(usize) -> bool| {
        let all = model.elements.iter().filter(|e| e.nodes().iter().any(|n| at(*n)));
        let forces: Vec<f64> = all
            .map(|e| {
                let moved = |n: &usize| [0, 1, 2].map(|c| now[3 * n + c] - model.nodes[*n][c]);
                let u: Vec<f64> = e.nodes().iter().flat_map(moved).collect();
                1e-3 * e.face_stresses(&u)[0]
            })
            .collect();
        forces.iter().sum::<f64>() / forces.len() as f64
    };
    let edge = first(rings);
    [-now[2], force(&|n| n == 0), force(&|n| n >= edge)]
}

#[test]
fn a_circular_membrane_bulges_as_hencky_says() {
    // V-F8: w0 = W a (q a / E h)^(1/3); strains of 1e-3, agreement to 0.5 % asked.
    for (poisson, shape) in [(0.2, 0.677435326), (0.3, 0.653443345), (0.34, 0.642998037)] {
        let exact = shape * 1e-4_f64.cbrt();
        let ([coarse, ..], [fine, ..]) = (hencky(8, poisson), hencky(16, poisson));
        let extrapolated = fine + (fine - coarse) / 3.0;
        assert!(off(extrapolated, exact) < 2e-3, "{poisson}: {coarse} {fine} {extrapolated} {exact}");
        assert!(off(fine, exact) < 5e-3, "{poisson}: {fine} {exact}");
    }
    // N = B (E h q^2 a^2)^(1/3) in the middle and at the edge; triangles of constant strain see it at their own middles, of
    // first order at the edge, where it falls.
    let [_, middle, edge] = hencky(16, 0.3);
    let unit = 1e10_f64.cbrt();
    assert!(off(middle, 0.431101016 * unit) < 1e-2, "{}", middle / unit);
    assert!(off(edge, 0.332956807 * unit) < 3e-2, "{}", edge / unit);
}

#[test]
fn every_way_of_form_finding_comes_to_the_same_form() {
    let net = |prestress: f64, way: &str| {
        let area = 1.256637061e-5;
        let run = Run::alone(
            &format!(
                r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = {{ type = "rectangular_net", cells = [20, 20], spacing = 0.15 }}
cable = {{ young = {:?}, area = {area:?}, density = 7850.0, prestress = {:?}, tension_only = false }}
form_finding = "{way}"
"#,
                2.638937828e6 / area,
                prestress / area
            ),
            1e-4,
        );
        run.ready.mesh.coordinates[3 * 220 + 2]
    };
    // V-F5 a) and c).
    for way in ["static", "force_density", "dynamic_relaxation"] {
        assert!(off(net(100.0, way), -0.008473657752) < 1e-9, "{way}: {}", net(100.0, way));
    }
    assert!(off(net(0.0, "static"), -0.0119697076) < 1e-8);
}

#[test]
fn a_slack_ring_net_hangs_after_dynamic_relaxation_or_is_refused_with_what_to_try() {
    // Rings of 0.3 m in cells of less: nothing is taut as modelled, and each has many ways to fold.
    let net = |cell: f64, way: &str| {
        format!(
            r#"
end_time = 0.1
gravity = [0.0, 0.0, -9.81]
[structure]
generator = {{ type = "ring_net", rings = [6, 6], diameter = {cell:?} }}
form_finding = "{way}"
[[structure.parts]]
name = "net"
element = "ring"
diameter = 0.3
perimeter = 0.94
perimeter_stiffness = 8e6
bending_stiffness = 5e4
mass = 0.5
"#
        )
    };
    let mut run = Run::alone(&net(0.28, "dynamic_relaxation"), 1e-5);
    assert!(off(run.value("reaction_z"), 36.0 * 0.5 * 9.81) < 1e-9 && run.measure("sag") > 0.05);
    let refused = |text: &str| {
        let mut solver = FemSolver::new(&scene(text), &Options { out: None, shortcuts: true }).unwrap();
        solver.prepare(&Default::default(), &mut |_| Ok(())).err().map(|fault| fault.diagnostic.message)
    };
    // Where even that fails (cells of 0.15 m), the message says what is left to try; where Newton alone fails, relaxation.
    for (cell, way, advice) in
        [(0.15, "static", "\"dynamic_relaxation\""), (0.15, "dynamic_relaxation", "with damping")]
    {
        if let Some(message) = refused(&net(cell, way)) {
            assert!(message.contains("no static equilibrium") && message.contains(advice), "{message}");
        }
    }
}
