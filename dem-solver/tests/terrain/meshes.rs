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
