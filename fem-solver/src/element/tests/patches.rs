//! Patch tests: elements of unlike size and shape in a state of constant strain leave no force at the nodes that they share.

use super::checks::patch;
use crate::element::material::Law;
use crate::element::material::Rupture;
use crate::element::membrane::{Fabric, Membrane};
use crate::element::sliding_cable::RopeMemory;
use crate::element::{Bar, Beam, Element, Shell, SlidingCable};
use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};

/// Along this line, at these places.
const PLACES: [f64; 4] = [0.0, 0.3, 0.5, 1.2];

fn along() -> Vector3<f64> {
    Vector3::new(2.0, -1.0, 2.0) / 3.0
}

/// Sums of a few products of this size; forces of a strain of a tenth are differences of terms ten times as large and more.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Displacements of nodes on the line that is stretched by a tenth and turned.
fn stretched() -> Vec<f64> {
    let turn = UnitQuaternion::new(Vector3::new(0.4, 0.3, -0.2));
    PLACES.iter().flat_map(|x| <[f64; 3]>::from(turn * along() * (1.1 * x) - along() * *x)).collect()
}

#[test]
fn bars_and_brakes_of_unlike_length_in_a_row_pass_on_one_force() {
    let law = |limit| Law { hardening: vec![(0.0, 1e8), (0.5, 2e8)], limit, ..Law::elastic(8e9, 1e7, true) };
    let bars: Vec<Bar> = (0..3)
        .map(|i| Bar {
            nodes: [i, i + 1],
            span: along() * (PLACES[i + 1] - PLACES[i]),
            length: (PLACES[i + 1] - PLACES[i]) / 1.01,
            section: Some(1e-4),
            mass: 1.0,
            radius: 0.0,
            law: law(f64::INFINITY),
            rupture: Rupture::NEVER,
        })
        .collect();
    let all: Vec<&dyn Element> = bars.iter().map(|bar| bar as &dyn Element).collect();
    assert!(patch(&all, &stretched(), &[], &[1, 2]) < ROUNDING);
    // The law of a brake is one of elongations: the longer one has as much less stiffness, force and hardening alike.
    let brakes: Vec<Bar> = (0..3)
        .map(|i| {
            let length = PLACES[i + 1] - PLACES[i];
            let law = Law {
                hardening: vec![(0.0, 5e4), (0.5 * length, 1e5)],
                limit: 0.5 * length,
                ..Law::elastic(5e6 / length, 0.0, true)
            };
            let (span, nodes) = (along() * length, [i, i + 1]);
            Bar { nodes, span, length, section: None, mass: 1.0, radius: 0.0, law, rupture: Rupture::NEVER }
        })
        .collect();
    let all: Vec<&dyn Element> = brakes.iter().map(|brake| brake as &dyn Element).collect();
    // Elongations are differences of lengths, of which 5e6 N/m make forces of some 6e4 N.
    assert!(patch(&all, &stretched(), &[], &[1, 2]) < 100.0 * ROUNDING);
}

#[test]
fn nodes_on_a_straight_sliding_rope_feel_nothing_with_and_without_friction() {
    for friction in [0.0, 0.3] {
        let rope = SlidingCable {
            nodes: vec![0, 1, 2, 3],
            spans: PLACES.windows(2).map(|x| along() * (x[1] - x[0])).collect(),
            lengths: PLACES.windows(2).map(|x| x[1] - x[0]).collect(),
            young: 1e9,
            area: 1e-4,
            density: 7850.0,
            prestress: 0.0,
            friction,
            radius: 0.0,
            rupture: Rupture::NEVER,
            memory: RopeMemory::default(),
        };
        assert!(patch(&[&rope], &stretched(), &[], &[1, 2]) < 100.0 * ROUNDING);
    }
}

#[test]
fn beams_of_unlike_length_pass_on_stretch_twist_and_constant_curvature() {
    let across = along().cross(&Vector3::z()).normalize();
    let axes = [across, along().cross(&across)];
    let beams: Vec<Beam> = (0..3)
        .map(|i| Beam {
            nodes: [i, i + 1],
            span: along() * (PLACES[i + 1] - PLACES[i]),
            axes,
            area: 1e-3,
            axial: 3e5,
            bending: [2e3, 5e3],
            torsion: 1e3,
            line_mass: 8.0,
            gyration: 0.05,
            radius: 0.0,
            rupture: Rupture::NEVER,
            fibres: None,
        })
        .collect();
    let all: Vec<&dyn Element> = beams.iter().map(|beam| beam as &dyn Element).collect();
    let still = UnitQuaternion::identity();
    let pulled: Vec<f64> = PLACES
        .iter()
        .flat_map(|x| [along() * (0.01 * x), Vector3::zeros()])
        .flat_map(<[f64; 3]>::from)
        .collect();
    assert!(patch(&all, &pulled, &[still; 4], &[1, 2]) < 100.0 * ROUNDING);
    let twisted = PLACES.map(|x| UnitQuaternion::new(along() * (0.1 * x)));
    assert!(patch(&all, &[0.0; 24], &twisted, &[1, 2]) < 1e-2, "the sine of a twist of 0.07");
    let twisted = PLACES.map(|x| UnitQuaternion::new(along() * (1e-4 * x)));
    assert!(patch(&all, &[0.0; 24], &twisted, &[1, 2]) < 1e-8);
    // On a circle of radius 1/k: every chord turns by half of what its ends do, whatever its length. Exact moments are
    // E I k; those of angles against a chord err by their squares.
    for (k, error) in [(1e-4, 1e-8), (1e-2, 1e-4)] {
        let mut u = Vec::new();
        let turns = PLACES.map(|x| UnitQuaternion::new(axes[1] * (k * x)));
        for x in PLACES {
            // In the plane of the first cross axis, turning about the second.
            let side = axes[1].cross(&along());
            let place = (along() * (k * x).sin() + side * (1.0 - (k * x).cos())) / k;
            u.extend(<[f64; 3]>::from(place - along() * x));
            u.extend([0.0; 3]);
        }
        // Chords are shorter than arcs by (k L)^2 / 24: the axial force of that, which differs from one to the next, beside moments
        // of E I k.
        let left = patch(&all, &u, &turns, &[1, 2]);
        let axial = 3e5 * (k * 0.7_f64).powi(2) / 24.0;
        assert!(left < error + axial / (2e3 * k), "{left}");
    }
}

/// Five nodes in a plane in space, one of them inside, and the triangles around it.
fn triangles() -> ([Vector3<f64>; 5], [[usize; 3]; 4], Matrix3<f64>) {
    let flat = [[0.0, 0.0], [1.3, 0.1], [1.1, 0.9], [-0.1, 1.2], [0.4, 0.5]];
    let turn = *UnitQuaternion::new(Vector3::new(0.5, -0.7, 0.3)).to_rotation_matrix().matrix();
    let points = flat.map(|[x, y]| turn * Vector3::new(x, y, 0.0));
    (points, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], turn)
}

fn membranes(fabric: &dyn Fn(usize) -> Fabric) -> Vec<Membrane> {
    let (points, cells, turn) = triangles();
    let along = turn * Vector3::x();
    let made = cells.iter().enumerate().map(|(i, cell)| {
        let point = Membrane::geometry(&cell.map(|n| points[n]), &along).expect("has an area");
        Membrane::new(*cell, point, 0.01, 900.0, fabric(i))
    });
    made.collect()
}

/// Displacements by the deformation gradient `f` in the plane, and turned as a whole.
fn strained(f: Matrix3<f64>) -> Vec<Vector3<f64>> {
    let (points, _, turn) = triangles();
    let whole = UnitQuaternion::new(Vector3::new(-0.3, 0.8, 0.5));
    points.iter().map(|x| whole * (turn * f * turn.transpose() * x) - x).collect()
}

#[test]
fn triangles_of_membrane_in_constant_strain_are_in_balance_taut_wrinkled_and_of_fibres() {
    let isotropic = |wrinkles| {
        move |_: usize| Fabric::Isotropic { young: 2e8, poisson: 0.3, prestress: [1e6, 0.0, 2e5], wrinkles }
    };
    let fibres = |_: usize| Fabric::Fibres {
        directions: [Vector2::new(0.8, 0.6), Vector2::new(-0.6, 0.8)],
        young: [3e8, 1e8],
        prestress: [1e6, -2e6],
        shear: 1e6,
    };
    let taut = Matrix3::new(1.1, 0.05, 0.0, 0.0, 1.2, 0.0, 0.0, 0.0, 1.0);
    let wrinkled = Matrix3::new(1.1, 0.05, 0.0, 0.0, 0.7, 0.0, 0.0, 0.0, 1.0);
    for f in [taut, wrinkled] {
        let u: Vec<f64> = strained(f).into_iter().flat_map(<[f64; 3]>::from).collect();
        let fabrics: [&dyn Fn(usize) -> Fabric; 3] = [&isotropic(false), &isotropic(true), &fibres];
        for fabric in fabrics {
            let membranes = membranes(fabric);
            let all: Vec<&dyn Element> = membranes.iter().map(|m| m as &dyn Element).collect();
            let left = patch(&all, &u, &[], &[4]);
            assert!(left < 100.0 * ROUNDING, "{left}");
        }
    }
}

#[test]
fn triangles_of_shell_in_constant_strain_and_constant_curvature_are_in_balance() {
    let (points, _, turn) = triangles();
    let shells: Vec<Shell> = membranes(&|_| Shell::fabric(1e6, 0.3))
        .into_iter()
        .map(|membrane| Shell::new(Membrane { thickness: 0.1, ..membrane }, 1e6, 0.3))
        .collect();
    let all: Vec<&dyn Element> = shells.iter().map(|s| s as &dyn Element).collect();
    // Strained alike in both directions, so that the nodes turn with the whole and with nothing else.
    let whole = UnitQuaternion::new(Vector3::new(-0.3, 0.8, 0.5));
    let u: Vec<f64> = strained(Matrix3::from_diagonal(&Vector3::new(1.02, 1.02, 1.0)))
        .into_iter()
        .flat_map(|u| [u.x, u.y, u.z, 0.0, 0.0, 0.0])
        .collect();
    let left = patch(&all, &u, &[whole; 5], &[4]);
    assert!(left < 100.0 * ROUNDING, "{left}");
    // w = (k_1 x^2 + k_2 y^2) / 2 + k_3 x y, normals tilted by -grad w: moments are alike in all triangles. Membrane forces grow
    // with the squares of slopes: 1e-5 of E t, beside moments of D k.
    let k = [1e-5, -0.6e-5, 0.4e-5];
    let (mut u, mut turns) = (Vec::new(), Vec::new());
    for point in points {
        let own = turn.transpose() * point;
        let (x, y) = (own.x, own.y);
        let w = 0.5 * (k[0] * x * x + k[1] * y * y) + k[2] * x * y;
        let (slope_x, slope_y) = (k[0] * x + k[2] * y, k[1] * y + k[2] * x);
        u.extend(<[f64; 3]>::from(turn * Vector3::new(0.0, 0.0, w)));
        u.extend([0.0; 3]);
        turns.push(UnitQuaternion::new(turn * Vector3::new(slope_y, -slope_x, 0.0)));
    }
    let left = patch(&all, &u, &turns, &[4]);
    assert!(left < 1e-2, "{left}");
}
