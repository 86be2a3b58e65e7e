//! Wires against spheres in any pose: force, its transfer to the nodes, its work.

use crate::bench::{Bench, Setup, cube, net, sphere};
use interface_defs::{InterfaceMesh, Sampling, name};
use nalgebra::Vector3;
use proptest::prelude::*;

fn point(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-limit..limit).prop_map(Vector3::from)
}

fn line(a: Vector3<f64>, b: Vector3<f64>, radius: f64) -> InterfaceMesh {
    InterfaceMesh {
        coordinates: [a.as_slice(), b.as_slice()].concat(),
        lines: vec![[0, 1]],
        line_radius: vec![radius],
        masses: vec![0.03, 0.05],
        ..InterfaceMesh::default()
    }
}

/// A frictionless contact whose force is known: F = 4/3 E* sqrt(R) d^1.5 along the shortest line.
fn expected(a: Vector3<f64>, b: Vector3<f64>, reach: f64, radius: f64) -> (Vector3<f64>, f64) {
    let eta = (-a.dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
    let foot = a + (b - a) * eta;
    let overlap = (reach - foot.norm()).max(0.0);
    let modulus = 1e8 / (1.0 - 0.04);
    (foot.normalize() * (4.0 / 3.0 * modulus * radius.sqrt() * overlap.powf(1.5)), eta)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_wire_in_any_pose_gets_the_force_of_its_closest_point(
        a in point(0.2), edge in point(0.3), turn in prop::array::uniform4(-1.0..1.0_f64), wire in 0.0..0.01_f64,
        shift in point(3.0),
    ) {
        let b = a + edge;
        prop_assume!(edge.norm() > 0.01 && turn.iter().map(|q| q * q).sum::<f64>() > 0.01);
        let (force, eta) = expected(a, b, 0.1 + wire, 0.1);
        let foot = a + edge * eta;
        prop_assume!(foot.norm() > 0.01);
        let more = format!("position = {:?}\norientation = {turn:?}", shift.as_slice());
        let scene = format!(
            "end_time = 1e-3\n{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\nrestitution = 1.0\n",
            sphere(0.1, 2500.0, &more)
        );
        let bench = Setup::new(scene, line(a + shift, b + shift, wire)).build();
        let seen = bench.force(Sampling::AtEnds, 0);
        // Overlap to 1e-16 of coordinates of 3 m, relative to the overlap; then the power 1.5.
        let overlap = (0.1 + wire - foot.norm()).abs().max(1e-12);
        let tolerance = 1e-10 + force.norm() * 4e-15 / overlap;
        prop_assert!((seen[0] - force * (1.0 - eta)).norm() < tolerance, "{} {force} {eta}", seen[0]);
        prop_assert!((seen[1] - force * eta).norm() < tolerance);
    }
}

/// A turned, spinning cube in a net, with friction and dashpots.
pub fn tangled(spheres: u32, samples: u32) -> Setup {
    let more = "position = [0.013, -0.021, 0.232]\nvelocity = [0.4, -0.3, -3.0]\norientation = [0.95, 0.2, 0.05, 0.1]\n\
                angular_velocity = [1.0, -2.0, 0.7]";
    let scene = format!(
        "end_time = 0.5\ngravity = [0.0, 0.0, -9.81]\n{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\n\
         restitution = 0.8\nfriction = 0.4\n[dem]\ntime_step = 2e-5\n",
        cube(spheres, more)
    );
    Setup { samples, ..Setup::new(scene, net(12, 0.15, 0.0)) }
}

/// A mesh that goes down with the rock and waves, every node out of step with the others; from rest,
/// and continuous from window to window.
pub fn wave(bench: &mut Bench, samples: u32, length: f64) {
    let place = |node: usize, x: &Vector3<f64>, t: f64| {
        let phase = 300.0 * t + 5.0 * x.x + 3.0 * x.y + node as f64;
        Vector3::new(1e-3 * phase.sin(), 1e-3 * phase.cos(), -2.0 * t + 5e-4 * (phase * 1.3).sin())
    };
    for s in 0..=samples {
        let t = bench.time + length * f64::from(s) / f64::from(samples);
        bench.displace(s as usize, |node, x| place(node, &x, t) - place(node, &x, 0.0));
    }
}

/// Mean force times displacement is the work that the solver books, sample by sample, with steps that
/// are no multiple of the samples too: to rounding of sums of some hundred terms.
#[test]
fn received_work_is_mean_force_times_displacement() {
    for (samples, steps) in [(1, 1), (1, 7), (4, 8), (4, 6), (3, 1)] {
        let mut bench = tangled(64, samples).build();
        let length = f64::from(steps) * 2e-5;
        let (mut worked, mut received) = (0.0_f64, 0.0);
        let mut most = 0.0_f64;
        for _ in 0..400 {
            wave(&mut bench, samples, length);
            bench.advance(length);
            for s in 0..samples as usize {
                let u = |s| bench.takes.sample(name::DISPLACEMENT, Sampling::FromStart, s).expect("planned");
                let (start, end) = (&bench.input[u(s)], &bench.input[u(s + 1)]);
                let mean = bench.force(Sampling::Means, s);
                for (a, f) in mean.iter().enumerate() {
                    for c in 0..3 {
                        let part = f[c] * (end[3 * a + c] - start[3 * a + c]);
                        worked += part;
                        most += part.abs();
                    }
                }
            }
            received = bench.value("energy_received_dem");
        }
        assert!(received.abs() > 10.0, "there was work: {received} J");
        assert!(
            (received + worked).abs() < 1e-13 * most.max(received.abs()),
            "{samples} {steps}: {received} {worked}"
        );
    }
}

/// Forces on the nodes are the reaction to what changes the rock's momentum and angular momentum.
#[test]
fn force_and_moment_on_the_wall_balance_momentum_and_angular_momentum_of_the_rock() {
    let mut bench = tangled(64, 1).build();
    let (h, mass) = (2e-5, 180.0);
    let gravity = Vector3::z() * -9.81;
    let mut touched = false;
    for _ in 0..1000 {
        let before = bench.solver.state().bodies[0].motion;
        wave(&mut bench, 1, h);
        bench.advance(h);
        let after = bench.solver.state().bodies[0].motion;
        let on_mesh = bench.total_force(Sampling::Means);
        let gained = (after.velocity - before.velocity) * mass;
        let scale = mass * before.velocity.norm();
        assert!((gained - (gravity * mass - on_mesh) * h).norm() < 1e-14 * scale);
        // Moments about the rock's centre in the middle of the step, at which the forces act.
        let middle = before.position + before.velocity * (0.5 * h);
        let u = |s| bench.takes.sample(name::DISPLACEMENT, Sampling::FromStart, s).expect("planned");
        let mut moment = Vector3::zeros();
        for (a, f) in bench.force(Sampling::Means, 0).iter().enumerate() {
            let at = |i: usize| {
                bench.ready.mesh.coordinates[i] + 0.5 * (bench.input[u(0)][i] + bench.input[u(1)][i])
            };
            let node = Vector3::new(at(3 * a), at(3 * a + 1), at(3 * a + 2));
            moment += (node - middle).cross(f);
        }
        let turned = after.angular_momentum - before.angular_momentum;
        assert!(
            (turned + moment * h).norm() < 1e-13 * (before.angular_momentum.norm() + on_mesh.norm() * h),
            "{turned} {moment}"
        );
        touched |= on_mesh.norm() > 1e3;
    }
    assert!(touched);
}

/// Walenstadt's trap: a thin wire in the middle plane between two rows of spheres meets a force, as
/// the spheres overlap.
#[test]
fn a_wire_between_two_rows_of_spheres_is_held() {
    let (a, b) = (Vector3::new(0.0, -1.0, 0.0), Vector3::new(0.0, 1.0, 0.0));
    for along in [2_u32, 4, 8, 16] {
        let (spheres, s) = (along.pow(3), 0.41 / (f64::from(along) + 0.6));
        // The groove between two rows is 0.1755 s deep; half a radius further in.
        let height = 0.205 - 0.1755 * s - 0.4 * s;
        let more = format!("position = [0.0, 0.0, {height:?}]\nvelocity = [0.0, 0.0, -0.1]");
        let scene = format!(
            "end_time = 1.0\n{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\nrestitution = 1.0\n",
            cube(spheres, &more)
        );
        let mut mesh = line(a, b, 0.0);
        mesh.masses = vec![f64::INFINITY; 2];
        let mut bench = Setup::new(scene, mesh).build();
        bench.advance(1e-3);
        assert!(
            bench.value("contacts") > 0.0 && bench.total_force(Sampling::Means).z < -100.0,
            "{spheres} spheres"
        );
    }
}
