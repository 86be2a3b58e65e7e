//! Faces at kinks: with `contact_selection = "continuous"` neither force nor energy jumps.

use crate::bench::{Setup, sphere};
use interface_defs::{InterfaceMesh, Sampling};
use nalgebra::Vector3;

/// 6 x 6 squares of 0.1 m, cut along either diagonal, their nodes up to 20 mm up or down: kinks of up to some 20 degrees either way.
fn relief() -> InterfaceMesh {
    let (n, mut seed) = (7_u32, 11_u64);
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut mesh = InterfaceMesh::default();
    for j in 0..n {
        for i in 0..n {
            mesh.coordinates.extend([0.1 * f64::from(i) - 0.3, 0.1 * f64::from(j) - 0.3, 0.04 * random()]);
        }
    }
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let a = j * n + i;
            let [b, c, d] = [a + 1, a + n, a + n + 1];
            let cut = if random() > 0.0 { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] };
            mesh.faces.extend(cut);
        }
    }
    mesh.masses = vec![f64::INFINITY; mesh.node_count()];
    mesh
}

/// Force on a sphere of 0.1 m and the energy of its contacts.
fn force_and_energy(mesh: &InterfaceMesh, position: Vector3<f64>, selection: &str) -> (Vector3<f64>, f64) {
    let at = format!("position = {:?}", position.as_slice());
    let scene = format!(
        "end_time = 1.0\n{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e7\npoisson = 0.3\nrestitution = 1.0\n\
         [dem]\ncontact_selection = \"{selection}\"\n",
        sphere(0.1, 2500.0, &at)
    );
    let bench = Setup::new(scene, mesh.clone()).build();
    (-bench.total_force(Sampling::AtEnds), bench.value("energy_stored_dem"))
}

/// Along a path over the relief at 0.1 mm a step, overlaps of some 15 mm: the stiffness of a contact is below 2 E* sqrt(R d), that of the
/// seven that a corner of six faces may have together seven times it. The nearest selection jumps by more.
#[test]
fn over_a_relief_the_continuous_selection_has_no_jump_and_its_force_is_the_gradient_of_its_energy() {
    let mesh = relief();
    let modulus = 1e7 / 0.91;
    let stiffness = 2.0 * modulus * (0.1_f64 * 0.03).sqrt();
    let at = |k: usize| Vector3::new(-0.12 + 1e-4 * k as f64, -0.03 + 0.4e-4 * k as f64, 0.088);
    let jump = |selection: &str| {
        let forces: Vec<Vector3<f64>> =
            (0..2400).map(|k| force_and_energy(&mesh, at(k), selection).0).collect();
        let apart = (at(1) - at(0)).norm();
        forces.windows(2).map(|w| (w[1] - w[0]).norm() / (stiffness * apart)).fold(0.0, f64::max)
    };
    let (continuous, nearest) = (jump("continuous"), jump("nearest"));
    println!("largest change of force over stiffness times distance: {continuous:.2}, nearest {nearest:.2}");
    assert!(continuous < 7.0 && nearest > 30.0, "{continuous} {nearest}");
    // Differences over 2e-6 m: the third derivative of d^2.5, and rounding of the energy over the difference.
    for k in (0..2400).step_by(60) {
        let (force, energy) = force_and_energy(&mesh, at(k), "continuous");
        let slope = |axis: usize| {
            let mut off = Vector3::zeros();
            off[axis] = 1e-6;
            let [plus, minus] =
                [at(k) + off, at(k) - off].map(|p| force_and_energy(&mesh, p, "continuous").1);
            (plus - minus) / 2e-6
        };
        let gradient = Vector3::new(slope(0), slope(1), slope(2));
        assert!(energy > 0.0);
        assert!((force + gradient).norm() < 1e-4 * force.norm(), "{k}: {force} {gradient}");
    }
}

/// What the sum counts: one contact on a plane, a ridge and a peak, as the nearest selection; in a groove two, less the edge where
/// the sphere holds it.
#[test]
fn planes_ridges_and_peaks_are_one_contact_in_both_selections() {
    let fan = |rise: f64| {
        let mut mesh = InterfaceMesh { coordinates: vec![0.0; 3], ..InterfaceMesh::default() };
        for k in 0..6_u32 {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
            mesh.coordinates.extend([cos, sin, rise]);
            mesh.faces.push([0, 1 + k, 1 + (k + 1) % 6]);
        }
        // Twins, a line and a point among them.
        mesh.faces.extend([[1, 2, 0], [0, 1, 0], [3, 3, 3]]);
        mesh.masses = vec![f64::INFINITY; mesh.node_count()];
        mesh
    };
    for (rise, places) in
        [(0.0, [[0.0, 0.0], [0.02, 0.0], [0.03, 0.01]]), (-0.3, [[0.0, 0.0], [1e-3, 0.0], [1e-3, 1e-3]])]
    {
        for [x, y] in places {
            let at = Vector3::new(x, y, 0.09);
            let [(a, u), (b, v)] = ["nearest", "continuous"].map(|h| force_and_energy(&fan(rise), at, h));
            assert!(
                (a - b).norm() < 1e-12 * a.norm() && (u - v).abs() < 1e-12 * u,
                "{rise} {x} {y}: {a} {b}"
            );
        }
    }
    // A flat pit: six faces less six edges and with the corner, all within the sphere, between the corner's force and that of one face.
    let at = Vector3::new(0.0, 0.0, 0.09);
    let of = |rise: f64| force_and_energy(&fan(rise), at, "continuous").0.z;
    assert!((of(0.01) / of(0.0) - 1.0).abs() < 0.05, "{} {}", of(0.01), of(0.0));
}
