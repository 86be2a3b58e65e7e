//! The contact of a rock as a whole: landings do not depend on how finely spheres cover it.

use crate::bench::{Bench, Mesh, dropped, plane, random};

/// What came of a landing.
#[derive(Debug, Clone, Copy)]
struct Landing {
    /// Time in contact [s].
    time: f64,
    /// Speed of the centre after over before it.
    rebound: f64,
    /// Spin after it [rad/s].
    spin: f64,
    /// Deepest overlap over the rock's radius.
    overlap: f64,
    /// How far the energy balance is off, over the kinetic energy.
    imbalance: f64,
}

/// A block of granite of 0.8 m that comes down with 15 m/s and more.
fn scene(law: &str, spheres: u32, turn: [f64; 4], restitution: f64, friction: f64, more: &str) -> String {
    format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [0.0, 0.0, 1.2]\nvelocity = [0.0, 0.0, -15.0]\n\
         orientation = {turn:?}\ndensity = 2700.0\nshape = {{ type = \"box\", size = [0.8, 0.8, 0.8] }}\n\
         cluster = {{ spheres = {spheres} }}\n[terrain]\nfile = \"t.obj\"\n[[contact]]\nlaw = \"{law}\"\nyoung = 3e10\n\
         poisson = 0.2\nrestitution = {restitution:?}\nfriction = {friction:?}\n{more}"
    )
}

fn land(mesh: &Mesh, text: &str) -> Landing {
    let mut bench = Bench::new(mesh, text, true);
    let (start, mut first, mut last, mut before) = (bench.energy(), None, 0.0, 0.0_f64);
    let mut kinetic = 0.0_f64;
    while bench.time < 0.2 {
        bench.advance(20e-6);
        let body = &bench.solver.state().bodies[0];
        kinetic = kinetic.max(bench.value("energy_kinetic_dem"));
        if body.contacts > 0 {
            first.get_or_insert(bench.time);
            last = bench.time;
        } else if first.is_none() {
            before = before.min(body.motion.velocity.z);
        } else if bench.time > last + 5e-3 {
            break;
        }
    }
    let (model, body) = (bench.solver.model(), &bench.solver.state().bodies[0]);
    let balance = bench.energy() + bench.value("energy_dissipated_dem") - start;
    let overlap = body.deepest.largest().map_or(0.0, |(overlap, _)| overlap);
    Landing {
        time: last - first.expect("it lands"),
        rebound: -(body.motion.velocity.z + 9.81 * (bench.time - last)) / before,
        spin: model.rocks[0].spin(&body.motion).norm(),
        overlap,
        imbalance: balance.abs() / kinetic,
    }
}

fn flat() -> Mesh {
    plane(0.0, [-10.0, 10.0], 3, 3)
}

/// On a face, on an edge, on a corner; what the force goes through is the centre of mass.
const STRAIGHT: [(&str, [f64; 4]); 3] = [
    ("face", [1.0, 0.0, 0.0, 0.0]),
    ("edge", [0.923_879_532_511_287, 0.382_683_432_365_09, 0.0, 0.0]),
    ("corner", [0.888_073_833_977_115, 0.325_057_583_671_868, 0.325_057_583_671_868, 0.0]),
];

#[test]
fn the_restitution_asked_for_is_met_on_a_face_an_edge_and_a_corner_whatever_the_spheres() {
    for (name, turn) in STRAIGHT {
        for spheres in [64, 512, 4096] {
            let found = land(&flat(), &scene("hertz_rock", spheres, turn, 0.3, 0.0, ""));
            println!("{name} {spheres} {found:?}");
            // Gravity acts in the contact, too: 1e-3 of the rebound in 4 ms.
            assert!((found.rebound / 0.3 - 1.0).abs() < 0.02, "{name} {spheres}: {found:?}");
            assert!(found.spin < 0.05 && found.overlap < 0.05, "{name} {spheres}: {found:?}");
            assert!(found.imbalance < 2e-3, "{name} {spheres}: {found:?}");
        }
    }
}

/// What is left is the shape's: more spheres make flatter faces and sharper corners.
#[test]
fn elastic_landings_take_as_long_whatever_the_spheres_and_give_all_energy_back() {
    for (name, turn) in STRAIGHT {
        let found: Vec<Landing> = [64, 512, 4096]
            .iter()
            .map(|spheres| land(&flat(), &scene("hertz_rock", *spheres, turn, 1.0, 0.0, "")))
            .collect();
        println!("{name} {found:?}");
        let times = found.iter().map(|l| l.time);
        let (short, long) = (times.clone().fold(f64::MAX, f64::min), times.fold(0.0, f64::max));
        assert!(long / short < 1.12, "{name}: {short} to {long} s");
        assert!(
            found.iter().all(|l| l.imbalance < 1e-4 && (l.rebound - 1.0).abs() < 2e-3),
            "{name}: {found:?}"
        );
    }
}

/// 20 degrees off the face, with friction: what the impact turns into spin goes with the lever of the edge, whose spheres have
/// their centres a radius inside.
#[test]
fn a_landing_beside_the_centre_gives_spin_by_its_lever_whatever_the_spheres() {
    let turn = [10_f64.to_radians().cos(), 10_f64.to_radians().sin(), 0.0, 0.0];
    let spins = [(64, 0.1), (512, 0.05), (4096, 0.025)].map(|(spheres, radius)| {
        let found = land(&flat(), &scene("hertz_rock", spheres, turn, 0.3, 0.6, ""));
        println!("{spheres} {found:?}");
        found.spin / (0.4 - radius)
    });
    let (least, most) = spins.iter().fold((f64::MAX, 0.0_f64), |(a, b), s| (a.min(*s), b.max(*s)));
    assert!(least > 20.0 && most / least < 1.05, "{spins:?}");
}

/// A ball with a small knob below it: the knob alone carries the landing under the paper's law, and is pushed through.
#[test]
fn where_a_small_sphere_is_pushed_through_the_rock_as_a_whole_lands() {
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("knob.xyzr");
    std::fs::write(&file, "0 0 0 0.4\n0 0 -0.43 0.01\n").expect("written");
    let text = |law: &str| {
        scene(law, 64, [1.0, 0.0, 0.0, 0.0], 0.3, 0.0, "").replace(
            "cluster = { spheres = 64 }",
            &format!("cluster = {{ file = {:?} }}", file.display().to_string()),
        )
    };
    let stopped = std::panic::catch_unwind(|| land(&flat(), &text("hertz_mindlin")));
    let why = stopped.expect_err("stopped");
    let why = why.downcast_ref::<String>().expect("a message");
    assert!(why.contains("pushed past the centre"), "{why}");
    let found = land(&flat(), &text("hertz_rock"));
    println!("{found:?}");
    assert!(found.overlap < 0.15 && (found.rebound / 0.3 - 1.0).abs() < 0.02, "{found:?}");
    assert!(found.imbalance < 2e-3, "{found:?}");
}

/// One ball: the law of Hertz and Mindlin, with damping, friction and spin.
#[test]
fn a_ball_bounces_as_under_the_law_of_single_spheres() {
    let run = |law: &str| {
        let text = dropped(30.0, 1e8, 0.5, 0.4, "").replace("hertz_mindlin", law);
        let mut bench = Bench::new(&plane(30.0, [-10.0, 60.0], 3, 3), &text, true);
        bench.run(1e-3, 1.5);
        let body = &bench.solver.state().bodies[0];
        (body.motion.position, body.motion.velocity, body.motion.angular_momentum, body.path.impacts)
    };
    let (ours, known) = (run("hertz_rock"), run("hertz_mindlin"));
    assert!(known.3 >= 2, "{known:?}");
    // The steps are others.
    assert!((ours.0 - known.0).norm() < 2e-3 && (ours.1 - known.1).norm() < 1e-2, "{ours:?} {known:?}");
    assert!((ours.2 - known.2).norm() < 5e-3 * known.2.norm(), "{ours:?} {known:?}");
}

/// Terrain with kinks, an elastic block without friction: the overlap is continuous over edges and nodes, outside and inside. What the
/// energy errs by is the integrator's, and falls with the step.
#[test]
fn over_rough_ground_no_energy_is_made() {
    let mut mesh = plane(0.0, [-4.0, 4.0], 32, 80);
    let mut seed = 3;
    mesh.nodes.iter_mut().for_each(|n| n.z += 0.1 * random(&mut seed));
    let error = |spheres: u32, steps: f64| {
        let more = format!("[dem]\nsteps_per_contact = {steps:?}\n");
        let turn = [0.8, 0.3, -0.4, 0.2];
        let text = scene("hertz_rock", spheres, turn, 1.0, 0.0, &more);
        land(&mesh, &text).imbalance
    };
    for spheres in [64, 4096] {
        let found = [20.0, 40.0, 80.0].map(|steps| error(spheres, steps));
        println!("{spheres}: {found:?}");
        assert!(found[0] < 3e-3 && found[2] < 5e-4, "{spheres}: {found:?}");
    }
}

/// Half of the block lands on the plane's border, half beside it, lower than the border at last: nothing pulls or pushes there.
#[test]
fn beside_the_border_of_a_terrain_nothing_is_inside() {
    let mesh = plane(0.0, [-0.3, 10.0], 7, 9);
    let text = scene("hertz_rock", 512, [0.99, 0.0, 0.14, 0.0], 0.3, 0.3, "");
    let found = land(&mesh, &text);
    println!("{found:?}");
    assert!(found.overlap < 0.1 && found.imbalance < 5e-3, "{found:?}");
    assert!(found.rebound.abs() < 1.0 && found.spin < 60.0, "{found:?}");
}

#[test]
fn half_of_the_laws_of_a_rock_with_terrain_cannot_be_of_the_whole() {
    use dem_solver::DemSolver;
    use toolkit::program::Options;
    use toolkit::scene::Scene;
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("t.obj"), flat().obj()).expect("written");
    let law = |between: &str, law: &str| {
        format!("[[contact]]\n{between}\nlaw = \"{law}\"\nyoung = 1e9\npoisson = 0.2\nrestitution = 0.5\n")
    };
    let text = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [0.0, 0.0, 1.0]\nmass = 100.0\n\
         shape = {{ type = \"sphere\", radius = 0.2 }}\n[terrain]\nfile = \"t.obj\"\n[[terrain.zone]]\nmaterial = \"scree\"\n\
         polygon = [[0.0, -90.0], [90.0, -90.0], [90.0, 90.0], [0.0, 90.0]]\n{}{}",
        law("", "hertz_rock"),
        law("between = [\"rock\", \"scree\"]", "linear")
    );
    let name = dir.path().join("s.toml").display().to_string();
    let scene = Scene::from_text(&name, &text).expect("a scene");
    let refused = DemSolver::new(&scene, &Options { out: None, shortcuts: true }).err().expect("refused");
    let refused = refused.to_string();
    assert!(refused.contains("another law") && refused.contains("in all its tables"), "{refused}");
}
