//! A rock that touches as a whole: on wires, in a box, against another rock.

use crate::bench::{Bench, Setup};
use interface_defs::{InterfaceMesh, Sampling};
use nalgebra::Vector3;

const SPEED: f64 = 0.3;
const MASS: f64 = 100.0;

/// On a face, on a corner, and a rod on its end, leaning by 30 degrees; and a step that resolves them [s].
const LANDINGS: [(&str, [f64; 3], [f64; 4], f64); 3] = [
    ("face", [0.4, 0.4, 0.4], [1.0, 0.0, 0.0, 0.0], 2e-7),
    ("corner", [0.4, 0.4, 0.4], [0.820_473_1, 0.175_919_9, 0.424_708_2, 0.339_851_1], 4e-6),
    ("rod", [0.2, 0.2, 1.0], [0.965_925_826_289, 0.258_819_045_103, 0.0, 0.0], 4e-6),
];

/// A block without weight that comes down with [`SPEED`] from `height` [m].
fn scene(size: [f64; 3], turn: [f64; 4], spheres: u32, height: f64, more: &str) -> String {
    format!(
        "end_time = 1.0\n[[rock]]\nposition = [0.0, 0.0, {height:?}]\nvelocity = [0.0, 0.0, -{SPEED:?}]\n\
         orientation = {turn:?}\nmass = {MASS:?}\nshape = {{ type = \"box\", size = {size:?} }}\n\
         cluster = {{ spheres = {spheres} }}\n[[contact]]\nlaw = \"hertz_rock\"\nyoung = 1e10\npoisson = 0.2\n{more}"
    )
}

/// Parallel wires along x that are held, `spacing` apart, as many on either side of the middle: centred landings stay so.
fn held_wires(spacing: f64) -> InterfaceMesh {
    let mut mesh = InterfaceMesh::default();
    for row in -60..60 {
        for (k, x) in [-1.0, -0.33, 0.01, 0.36, 1.0].into_iter().enumerate() {
            let node = (mesh.coordinates.len() / 3) as u32;
            mesh.coordinates.extend([x, (f64::from(row) + 0.5) * spacing, -0.002]);
            mesh.masses.push(f64::INFINITY);
            if k > 0 {
                mesh.lines.push([node - 1, node]);
                mesh.line_radius.push(0.002);
            }
        }
    }
    mesh
}

/// Restitution of a landing without weight: with the impulse J, the energy lost is `J v (1 - e) / 2`, whatever the levers.
fn restitution(mut bench: Bench, step: f64) -> f64 {
    let h = bench.solver.model().steps.step.min(step);
    let kinetic = |bench: &Bench| {
        let (rock, body) = (&bench.solver.model().rocks[0], &bench.solver.state().bodies[0]);
        rock.kinetic_energy(&body.motion)
    };
    let (start, mut touched, mut clear) = (kinetic(&bench), false, 0);
    for _ in 0..200_000 {
        bench.advance(h);
        let body = &bench.solver.state().bodies[0];
        let contacts = body.contacts + body.rock_contacts;
        touched |= contacts > 0;
        clear = if touched && contacts == 0 { clear + 1 } else { 0 };
        if clear > 20 {
            break;
        }
    }
    assert!(clear > 20, "it parts");
    let impulse = MASS * (bench.velocity().z + SPEED);
    1.0 - 2.0 * (start - kinetic(&bench)) / (impulse * SPEED)
}

fn height(size: [f64; 3], turn: [f64; 4]) -> f64 {
    let [w, x, y, z] = turn;
    let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
    let down = turn.inverse_transform_vector(&Vector3::z()).abs();
    0.5 * down.dot(&Vector3::from(size)) + 1e-4
}

fn without_net(scene: String) -> Bench {
    Setup { contact_mesh: None, ..Setup::new(scene, InterfaceMesh::default()) }.build()
}

#[test]
fn the_restitution_asked_for_is_met_on_wires_in_a_box_and_on_another_rock() {
    for (name, size, turn, step) in LANDINGS {
        for e in [0.4, 1.0] {
            let more = format!("restitution = {e:?}\n");
            let high = height(size, turn);
            for spheres in [64, 512] {
                let of = |more: &str| scene(size, turn, spheres, high, more);
                let wires = format!("{more}[structure]\nnet = \"held\"\n");
                let on_wires = restitution(Setup::new(of(&wires), held_wires(0.01)).build(), step);
                let in_box = format!("{more}[box]\nlowest = [-2.0, -2.0, 0.0]\nhighest = [2.0, 2.0, 4.0]\n");
                let in_box = restitution(without_net(of(&in_box)), step);
                // A block that hardly moves, its face up.
                let other = format!(
                    "{more}[[rock]]\nname = \"anvil\"\nposition = [0.0, 0.0, -1.0]\nmass = 1e9\n\
                     shape = {{ type = \"box\", size = [2.0, 2.0, 2.0] }}\ncluster = {{ spheres = 4096 }}\n"
                );
                let on_rock = restitution(without_net(of(&other)), step);
                println!("{name} {spheres} {e}: {on_wires:.4} {in_box:.4} {on_rock:.4}");
                for found in [on_wires, in_box, on_rock] {
                    assert!(
                        (found / e - 1.0).abs() < 0.01,
                        "{name} {spheres} {e}: {on_wires} {in_box} {on_rock}"
                    );
                }
            }
        }
    }
}

/// The foundation of a wire: pi/4 E* for each metre, here of one wire across a face.
#[test]
fn a_wire_is_pressed_as_a_foundation_whatever_the_spheres_and_its_nodes() {
    for (spheres, nodes) in [(1, 2), (64, 2), (512, 9)] {
        let mut mesh = InterfaceMesh::default();
        for k in 0..nodes {
            // 1 m long, 1 mm below the face of the cube of 0.4 m, whose lower face is at 0.
            mesh.coordinates.extend([f64::from(k) / f64::from(nodes - 1) - 0.45, 0.03, 1e-3]);
            mesh.masses.push(0.1);
            if k > 0 {
                mesh.lines.push([k as u32 - 1, k as u32]);
                mesh.line_radius.push(0.0);
            }
        }
        let text = scene(
            [0.4; 3],
            [1.0, 0.0, 0.0, 0.0],
            spheres,
            0.2,
            "restitution = 1.0\n[structure]\nnet = \"held\"\n",
        );
        let bench = Setup::new(text, mesh).build();
        let force = bench.total_force(Sampling::AtEnds);
        // Over the last millimetre at either side another face is nearer.
        let expected = std::f64::consts::FRAC_PI_4 * 1e10 / 0.96 * 1e-3 * (0.4 - 2e-3);
        assert!((force.z / -expected - 1.0).abs() < 1e-12, "{spheres} {nodes}: {force} {expected}");
        assert!(force.x.abs() < 1e-9 * expected && force.y.abs() < 1e-9 * expected, "{force}");
    }
}
