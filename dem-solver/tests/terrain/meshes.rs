//! V-T4: how a plane is cut into triangles changes nothing.

use crate::bench::{Bench, G, Mesh, dropped, plane, random};
use nalgebra::Vector3;

/// 2, 200 and 20 000 triangles; random diagonals; nodes moved within the plane.
fn cuts(slope: f64) -> Vec<(&'static str, Mesh)> {
    let span = [-10.0, 60.0];
    let mut diagonals = plane(slope, span, 40, 10);
    let mut seed = 7;
    for pair in diagonals.triangles.chunks_exact_mut(2) {
        if random(&mut seed) > 0.0 {
            let ([a, b, c], [_, _, d]) = (pair[0], pair[1]);
            (pair[0], pair[1]) = ([a, b, d], [b, c, d]);
        }
    }
    let mut moved = diagonals.clone();
    let (sin, cos) = slope.to_radians().sin_cos();
    for node in &mut moved.nodes {
        let s = node.x * cos - node.z * sin;
        if s > -9.9 && s < 59.9 && node.y.abs() < 9.9 {
            *node += Vector3::new(cos, 0.0, -sin) * (0.6 * random(&mut seed));
            node.y += 0.6 * random(&mut seed);
        }
    }
    vec![
        ("2", plane(slope, span, 1, 1)),
        ("200", plane(slope, span, 20, 5)),
        ("20 000", plane(slope, span, 200, 50)),
        ("random diagonals", diagonals),
        ("moved nodes", moved),
    ]
}

/// Position and speed after `end` on each of the cuts, against those on the first.
fn compare(name: &str, slope: f64, scene: &str, end: f64, tolerance: f64) {
    let mut first = None;
    for (cut, mesh) in cuts(slope) {
        let mut bench = Bench::new(&mesh, scene, true);
        bench.run(0.05, end);
        let motion = bench.solver.state().bodies[0].motion;
        let place = motion.position + bench.solver.model().origin;
        let (at, speed) = *first.get_or_insert((place, motion.velocity));
        let apart = (place - at).norm().max((motion.velocity - speed).norm());
        println!("{name}, {cut}: {apart:.1e}");
        assert!(apart < tolerance, "{name}, {cut}: {apart:.2e}");
    }
}

#[test]
fn frictionless_bounces_are_the_same_on_every_cut() {
    compare("V-T1", 30.0, &dropped(30.0, 1e10, 1.0, 0.0, ""), 3.5, 1e-10);
    compare("V-T2", 30.0, &dropped(30.0, 1e10, 0.5, 0.0, ""), 2.5, 1e-10);
    let continuous = "[dem]\ncontact_selection = \"continuous\"\n";
    compare("V-T2, continuous", 30.0, &dropped(30.0, 1e10, 0.5, 0.0, continuous), 2.5, 1e-10);
    compare("V-T3, continuous", 30.0, &dropped(30.0, 1e10, 0.5, 0.05, continuous), 2.5, 1e-6);
}

/// Every triangle is there twice; a line and a point stand beside it; and along one of its edges a sliver is cut off, as high as
/// `height` times its length.
fn spoiled(slope: f64, height: f64) -> Mesh {
    let mut mesh = plane(slope, [-10.0, 60.0], 40, 10);
    for [a, b, c] in std::mem::take(&mut mesh.triangles) {
        let [p, q, r] = [a, b, c].map(|n| mesh.nodes[n as usize]);
        let new = mesh.nodes.len() as u32;
        let middle = (p + q) * 0.5;
        mesh.nodes.push(middle + (r - middle) * height);
        mesh.triangles.extend([[a, b, new], [b, c, new], [c, a, new], [c, new, b], [a, b, a], [c, c, c]]);
    }
    mesh
}

/// Slivers of 1 : 1e4 (a height of 1e-4 m over an edge of 1.75 m, whose nodes are rounded to 1e-15 m, tilts their normals by
/// 1e-11) and thinner ones, up to where they count as without area: those are left out, and a notice says so. The ball comes down the very line
/// along which they are cut; a landing on a sliver takes its tilt times the speed, and each one makes some three times as much of
/// what differs, ten times over, as in `flight_in_closed_form_changes_no_more_than_rounding`.
#[test]
fn double_degenerate_and_sliver_triangles_of_a_terrain_change_nothing() {
    for (height, dropped_too, tolerance) in
        [(1e-4, false, 1e-8), (1e-6, false, 1e-6), (1e-8, true, 1e-8), (1e-14, true, 1e-8)]
    {
        let scene = dropped(30.0, 1e10, 0.5, 0.05, "");
        let run = |mesh: &Mesh| {
            let mut bench = Bench::new(mesh, &scene, true);
            bench.run(0.05, 2.5);
            let motion = bench.solver.state().bodies[0].motion;
            (motion.position + bench.solver.model().origin, motion.velocity, bench.ready.warnings.clone())
        };
        let (clean, mesh) = (run(&plane(30.0, [-10.0, 60.0], 40, 10)), spoiled(30.0, height));
        let spoiled = run(&mesh);
        let apart = (spoiled.0 - clean.0).norm().max((spoiled.1 - clean.1).norm());
        println!("slivers of 1 : {height:e}: {apart:.1e}; {:?}", spoiled.2);
        assert!(apart < tolerance, "slivers of {height:e}: {apart:.2e}");
        // Lines and points, a third of all; of the thinnest slivers a sixth more.
        let count = mesh.triangles.len() / 6 * if dropped_too { 3 } else { 2 };
        assert!(
            spoiled.2.iter().any(|w| w.message.contains(&format!("{count} triangles without area"))),
            "{:?}",
            spoiled.2
        );
    }
}

#[test]
fn bounces_and_rolling_with_friction_are_the_same_on_every_cut() {
    compare("V-T3", 30.0, &dropped(30.0, 1e10, 0.5, 0.05, ""), 2.5, 1e-6);
    // V-D8: rolls down 20 degrees from its static overlap.
    let (sin, cos) = 20_f64.to_radians().sin_cos();
    let mass = 4.0 / 3.0 * std::f64::consts::PI * 0.008 * 2500.0;
    let modulus = 1e9 / (1.0 - 0.25 * 0.25);
    let overlap = (mass * G * cos / (4.0 / 3.0 * modulus * 0.2_f64.sqrt())).powf(2.0 / 3.0);
    let height = 0.2 - overlap;
    let scene = dropped(20.0, 1e9, 0.5, 0.3, "").replace(
        &format!("{:?}", [0.2 * sin, 0.0, 0.2 * cos + 1.0]),
        &format!("{:?}", [height * sin, 0.013, height * cos]),
    );
    compare("V-D8", 20.0, &scene, 2.0, 1e-6);
}
