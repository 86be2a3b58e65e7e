//! Where elements meet: vertices of many triangles, duplicate and degenerate ones, kinks and crossings of
//! wires.

use crate::bench::{Bench, Setup, plane, sphere};
use interface_defs::{InterfaceMesh, Sampling};
use nalgebra::Vector3;

fn contact(more: &str) -> String {
    format!("[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e7\npoisson = 0.3\nrestitution = 1.0\n{more}\n")
}

/// A sphere of 0.1 m at rest at `position`.
fn placed(mut mesh: InterfaceMesh, position: Vector3<f64>, more: &str) -> Bench {
    mesh.masses = vec![f64::INFINITY; mesh.node_count()];
    let at = format!("position = {:?}", position.as_slice());
    Setup::new(format!("end_time = 1.0\n{}{}", sphere(0.1, 2500.0, &at), contact(more)), mesh).build()
}

/// Six triangles around the origin in the plane z = `rise` times the distance from it.
fn fan(rise: f64) -> InterfaceMesh {
    let mut mesh = InterfaceMesh { coordinates: vec![0.0; 3], ..InterfaceMesh::default() };
    for k in 0..6_u32 {
        let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
        mesh.coordinates.extend([cos, sin, rise]);
        mesh.faces.push([0, 1 + k, 1 + (k + 1) % 6]);
    }
    mesh
}

/// Force of the plane z = 0 on a sphere with its centre 0.095 m above it.
fn of_a_plane() -> f64 {
    4.0 / 3.0 * 1e7 / 0.91 * 0.1_f64.sqrt() * 5e-3_f64.powf(1.5)
}

#[test]
fn a_sphere_exactly_on_a_vertex_of_six_triangles_has_one_contact_in_the_plane_and_on_a_peak() {
    for rise in [0.0, -0.3] {
        let bench = placed(
            fan(rise),
            Vector3::new(0.0, 0.0, 0.095),
            "friction = 0.5\n[dem]\ncontact_selection = \"nearest\"",
        );
        assert_eq!(bench.value("contacts"), 1.0, "rise {rise}");
        let force = bench.total_force(Sampling::AtEnds);
        // The overlap is a difference of 0.1 and 0.095: 1e-17 / 5e-3, times 1.5.
        assert!((force + Vector3::z() * of_a_plane()).norm() < 1e-13 * of_a_plane(), "{force}");
    }
    // Beside it as on it: a foot this near to three edges is as exact as a foot anywhere.
    for power in [-300, -17, -15, -12, -9, -6, -4] {
        for k in 0..13_u32 {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 13.0).sin_cos();
            let off = 10.0_f64.powi(power);
            let at = Vector3::new(cos * off, sin * off, 0.095);
            let bench = placed(fan(0.0), at, "friction = 0.5\n[dem]\ncontact_selection = \"nearest\"");
            assert_eq!(bench.value("contacts"), 1.0, "{off:e} m beside, direction {k}");
            let force = bench.total_force(Sampling::AtEnds);
            assert!((force + Vector3::z() * of_a_plane()).norm() < 1e-12 * of_a_plane(), "{off:e}: {force}");
        }
    }
    // In a pit of the same slope all six faces are met alike.
    let bench = placed(fan(0.3), Vector3::new(0.0, 0.0, 0.1), "[dem]\ncontact_selection = \"nearest\"");
    assert_eq!(bench.value("contacts"), 6.0);
    let force = bench.total_force(Sampling::AtEnds);
    assert!(force.x.abs() + force.y.abs() < 1e-12 * force.z.abs(), "{force}");
}

/// Twins, triangles that are a line or a point, and slivers of 1 : 1e4 over the same plane.
#[test]
fn duplicate_degenerate_and_sliver_triangles_add_no_contact() {
    let mut mesh = plane(1.0, 4);
    let faces = mesh.faces.clone();
    mesh.faces.extend(faces.iter().map(|[a, b, c]| [*b, *c, *a]));
    mesh.faces.extend(faces.iter().flat_map(|[a, b, _]| [[*a, *b, *a], [*a, *a, *a]]));
    let from = mesh.node_count() as u32;
    mesh.coordinates.extend([-0.5, 1e-3, 0.0, 0.5, 1e-3, 0.0, 0.5, 1.1e-3, 0.0]);
    mesh.faces.push([from, from + 1, from + 2]);
    for (x, y) in [(0.0, 0.0), (0.011, 0.0007), (0.25, 0.25), (-0.1, 0.00105)] {
        let bench = placed(mesh.clone(), Vector3::new(x, y, 0.095), "friction = 0.5");
        assert_eq!(bench.value("contacts"), 1.0, "{x} {y}");
        let force = bench.total_force(Sampling::AtEnds);
        // Feet on a sliver are as exact as its area.
        assert!((force + Vector3::z() * of_a_plane()).norm() < 1e-9 * of_a_plane(), "{force}");
    }
}

/// Two wires that cross at the origin with kinks towards the sphere, in segments of 0.15 m.
fn crossing(rise: f64) -> InterfaceMesh {
    let mut mesh = InterfaceMesh { coordinates: vec![0.0; 3], ..InterfaceMesh::default() };
    for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let first = mesh.node_count() as u32;
        for k in 1..=2 {
            let r = 0.15 * f64::from(k);
            mesh.coordinates.extend([x * r, y * r, rise * r]);
        }
        mesh.lines.extend([[0, first], [first, first + 1]]);
    }
    mesh
}

/// Force on the sphere and stored energy.
fn force_and_energy(mesh: &InterfaceMesh, position: Vector3<f64>, selection: &str) -> (Vector3<f64>, f64) {
    let bench = placed(mesh.clone(), position, &format!("[dem]\ncontact_selection = \"{selection}\""));
    (-bench.total_force(Sampling::AtEnds), bench.value("energy_stored_dem"))
}

/// Along a path over a crossing: the continuous selection changes its force by no more than the stiffness
/// times the path (four wires, each k = 2 E* sqrt(R d)), the nearest one jumps by a share of the whole.
#[test]
fn over_a_crossing_with_kinks_the_continuous_selection_has_no_jump_and_is_the_gradient_of_its_energy() {
    let mesh = crossing(0.08);
    let (from, path) = (Vector3::new(-0.06, -0.021, 0.088), Vector3::new(0.12, 0.043, 0.004));
    let steps = 240;
    let largest = |selection: &str| {
        let at =
            |i: u32| force_and_energy(&mesh, from + path * (f64::from(i) / f64::from(steps)), selection).0;
        let mut last = at(0);
        let (mut jump, mut most) = (0.0_f64, 0.0_f64);
        for i in 1..=steps {
            let force = at(i);
            jump = jump.max((force - last).norm());
            most = most.max(force.norm());
            last = force;
        }
        (jump, most)
    };
    let stiffness = 4.0 * 2.0 * 1e7 / 0.91 * (0.1_f64 * 0.02).sqrt();
    let allowed = stiffness * path.norm() / f64::from(steps);
    let (smooth, most) = largest("continuous");
    assert!(smooth < allowed, "{smooth} N, at most {allowed} N");
    let (rough, _) = largest("nearest");
    assert!(rough > 2.0 * allowed && rough > 0.2 * most, "{rough} {allowed} {most}");
    for i in 0..40 {
        let x = from + path * (f64::from(i) / 40.0);
        let force = force_and_energy(&mesh, x, "continuous").0;
        let step = 1e-6;
        let slope = Vector3::from_fn(|a, _| {
            let mut e = Vector3::zeros();
            e[a] = step;
            let energy = |x| force_and_energy(&mesh, x, "continuous").1;
            (energy(x - e) - energy(x + e)) / (2.0 * step)
        });
        // Where a segment sets in between the two, the second difference has a kink: k step / 2.
        assert!((slope - force).norm() < 1e-5 * most + stiffness * step, "{i}: {slope} {force}");
    }
}

/// The head of a post with ropes of other radii: the same, and the energy is never below 0. With one radius for all ropes at the
/// node, that of the post, they pulled the sphere in.
#[test]
fn at_the_head_of_a_post_with_thin_ropes_force_is_the_gradient_of_an_energy_that_is_never_negative() {
    for through in [false, true] {
        let mut mesh = InterfaceMesh { coordinates: vec![0.0; 3], ..InterfaceMesh::default() };
        let back = if through { (-0.3, 0.0) } else { (-0.1, -0.3) };
        for (x, y, z, radius) in [
            (0.3, 0.0, 0.0, 0.01),
            (back.0, back.1, 0.0, 0.01),
            (0.1, 0.25, -0.2, 0.02),
            (0.0, 0.0, -0.4, 0.06),
        ] {
            mesh.lines.push([0, mesh.node_count() as u32]);
            mesh.coordinates.extend([x, y, z]);
            mesh.line_radius.push(radius);
        }
        let (from, way) = (Vector3::new(-0.14, -0.12, 0.05), Vector3::new(0.28, 0.26, 0.03));
        // Four wires, each k = 2 E* sqrt(R d), d below 0.1 m.
        let stiffness = 4.0 * 2.0 * 1e7 / 0.91 * (0.1_f64 * 0.1).sqrt();
        let steps = 240;
        let mut last: Option<Vector3<f64>> = None;
        let mut most = 0.0_f64;
        for i in 0..=steps {
            let x = from + way * (f64::from(i) / f64::from(steps));
            let (force, energy) = force_and_energy(&mesh, x, "continuous");
            assert!(energy >= 0.0, "{through} {i}: {energy} J");
            let jump = last.replace(force).map_or(0.0, |last| (force - last).norm());
            assert!(jump < stiffness * way.norm() / f64::from(steps), "{through} {i}: {jump} N");
            most = most.max(force.norm());
            if i % 8 == 0 {
                let step = 1e-6;
                let slope = Vector3::from_fn(|a, _| {
                    let mut e = Vector3::zeros();
                    e[a] = step;
                    let energy = |x| force_and_energy(&mesh, x, "continuous").1;
                    (energy(x - e) - energy(x + e)) / (2.0 * step)
                });
                assert!((slope - force).norm() < 1e-5 * most + stiffness * step, "{i}: {slope} {force}");
            }
        }
        assert!(most > 100.0, "it touches");
        // Right above the head the post alone is felt, with its own radius.
        let (force, _) = force_and_energy(&mesh, Vector3::new(0.0, 0.0, 0.15), "continuous");
        let expected = 4.0 / 3.0 * 1e7 / 0.91 * 0.1_f64.sqrt() * 0.01_f64.powf(1.5);
        assert!((force - Vector3::z() * expected).norm() < 1e-9 * expected, "{through}: {force} {expected}");
    }
}

/// V-D9 for wires: a straight wire is one contact, however it is divided and whichever selection it has.
#[test]
fn a_straight_wire_is_one_contact_however_it_is_divided() {
    for parts in [1_u32, 2, 7, 40] {
        let mut mesh = InterfaceMesh::default();
        for i in 0..=parts {
            mesh.coordinates.extend([f64::from(i) / f64::from(parts) - 0.5, 0.0, 0.0]);
            if i > 0 {
                mesh.lines.push([i - 1, i]);
            }
        }
        for x in [0.0, 0.1, 0.013, 0.5, 0.53] {
            let position = Vector3::new(x, 0.03, 0.085);
            let [near, smooth] = ["nearest", "continuous"].map(|h| force_and_energy(&mesh, position, h));
            assert!(
                (near.0 - smooth.0).norm() < 1e-11 * near.0.norm(),
                "{parts} {x}: {} {}",
                near.0,
                smooth.0
            );
            assert!(near.0.norm() > 0.0);
            let bench = placed(mesh.clone(), position, "[dem]\ncontact_selection = \"continuous\"");
            assert_eq!(bench.value("contacts"), 1.0, "{parts} parts, {x}");
        }
    }
}

/// A ball rolls along a wire with friction over its nodes: no kick, with either selection.
#[test]
fn a_ball_that_slides_along_a_divided_wire_is_not_kicked_by_its_nodes() {
    let run = |parts: u32, selection: &str| {
        let mut mesh = InterfaceMesh::default();
        for i in 0..=parts {
            mesh.coordinates.extend([2.0 * f64::from(i) / f64::from(parts) - 1.0, 0.0, 0.0]);
            if i > 0 {
                mesh.lines.push([i - 1, i]);
            }
        }
        mesh.masses = vec![f64::INFINITY; mesh.node_count()];
        let more = "position = [-0.5, 0.0, 0.0995]\nvelocity = [1.0, 0.0, -0.02]";
        let text = format!(
            "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n{}{}[dem]\ntime_step = 1e-4\ncontact_selection = \"{selection}\"\n",
            sphere(0.1, 2500.0, more),
            contact("friction = 0.3").replace("restitution = 1.0", "restitution = 0.5")
        );
        let mut bench = Setup::new(text, mesh).build();
        for _ in 0..800 {
            bench.advance(1e-3);
        }
        (bench.position(), bench.velocity(), bench.spin())
    };
    let whole = run(1, "nearest");
    for selection in ["nearest", "continuous"] {
        let parts = run(23, selection);
        // Handed over in the tangent plane, which differs by rounding.
        assert!((parts.0 - whole.0).norm() < 1e-9, "{selection}: {} {}", parts.0, whole.0);
        assert!((parts.1 - whole.1).norm() + (parts.2 - whole.2).norm() < 1e-8, "{selection}");
    }
}
