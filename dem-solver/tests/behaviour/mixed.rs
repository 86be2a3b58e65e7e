//! Rocks in a box, and separate spheres beside rocks and on terrain.

use crate::bench::{Bench, Setup};
use dem_solver::DemSolver;
use dem_solver::check::check;
use dem_solver::contact::broad_phase::rock_pairs::NearRocks;
use dem_solver::granular::{GranularSolver, are_alone};
use interface_defs::{Plan, Solver, Window};
use nalgebra::Vector3;
use toolkit::program::Options;
use toolkit::scene::Scene;

const OPTIONS: Options = Options { out: None, shortcuts: true };

fn free(scene: &str) -> Bench {
    Setup { contact_mesh: None, ..Setup::new(scene, Default::default()) }.build()
}

fn law(more: &str) -> String {
    format!("[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e7\npoisson = 0.3\n{more}\n")
}

/// 60 spheres in a box that is open above.
fn in_a_box() -> String {
    "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [0.2, 0.2, 0.4]\n\
     open = [\"+z\"]\n[dem]\ntime_step = 1e-5\n\
     [[spheres]]\ncount = 60\nradius = [0.015, 0.02]\ndensity = 2500.0\nvelocity_scatter = 0.5\n"
        .to_owned()
}

/// The same equations by two programs: separate spheres on a grid, and rocks of one sphere each, once a rock far above makes
/// them so. Without dashpots, whose mass a rock shares among the sides that it touches. Rounding grows with each collision.
#[test]
fn spheres_beside_a_distant_rock_move_as_spheres_alone() {
    let text = in_a_box() + &law("restitution = 1.0\nfriction = 0.3");
    let alone = Scene::from_text("test.toml", &text).expect("a scene");
    let rock = "[[rock]]\nname = \"far\"\nposition = [0.1, 0.1, 60.0]\nvelocity = [0.0, 0.0, 2.0]\nmass = 1.0\n\
                shape = { type = \"sphere\", radius = 0.05 }\n";
    let mut beside = free(&(text + rock));
    assert!(are_alone(&alone));
    let mut solver = GranularSolver::new(&alone, &OPTIONS).unwrap_or_else(|e| panic!("{e}"));
    let mut output = solver.prepare(&Plan::default(), &mut |_| Ok(())).expect("prepared").initial;
    let length = 2e-3;
    for number in 0..75_u64 {
        let window = Window { number: number + 1, iteration: 1, start: number as f64 * length, length };
        solver.solve(&window, &[], &mut output).unwrap_or_else(|f| panic!("{f}"));
        solver.commit().expect("committed");
        beside.advance(length);
    }
    let apart = solver.state().position.iter().zip(&beside.solver.state().bodies[1..]);
    let furthest = apart.map(|(x, body)| (x - body.motion.position).norm()).fold(0.0, f64::max);
    let spins = solver.state().spin.iter().filter(|spin| spin.norm() > 1.0).count();
    println!("furthest {furthest:.2e} m, {spins} of 60 spin");
    assert!(furthest < 1e-9, "{furthest:.2e} m");
    assert!(spins > 50, "{spins} of 60 have touched something and spin");
    // The columns of the table are those of all its spheres.
    let mass: f64 = solver.model().mass.iter().sum();
    let weighted: Vector3<f64> =
        solver.state().position.iter().zip(&solver.model().mass).map(|(x, m)| x * *m).sum();
    assert!((beside.value("spheres_centre_of_mass_z") - weighted.z / mass).abs() < 1e-10);
    let fastest = solver.state().velocity.iter().map(|v| v.norm()).fold(0.0, f64::max);
    assert!((beside.value("spheres_fastest") - fastest).abs() < 1e-6);
}

/// A sphere of a table and a rock that is a sphere are one thing.
#[test]
fn a_sphere_of_a_table_falls_rolls_and_rebounds_as_a_rock_of_one_sphere() {
    let dir = tempfile::tempdir().expect("a directory");
    let slope = "v -3 -3 1\nv 9 -3 -3\nv 9 3 -3\nv -3 3 1\nf 1 2 3\nf 1 3 4\n";
    std::fs::write(dir.path().join("t.obj"), slope).expect("written");
    std::fs::write(dir.path().join("s.xyzr"), "0.0 0.2 0.5 0.1\n").expect("written");
    let path = dir.path().join("s.toml").display().to_string();
    let head = "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[terrain]\nfile = \"t.obj\"\n";
    let law = law("restitution = 0.5\nfriction = 0.4\nrolling_friction = 0.02");
    let run = |table: &str| {
        let scene = Scene::from_text(&path, &format!("{head}{table}{law}")).expect("a scene");
        assert!(!are_alone(&scene));
        let mut solver = DemSolver::new(&scene, &OPTIONS).unwrap_or_else(|e| panic!("{e}"));
        let mut output = solver.prepare(&Plan::default(), &mut |_| Ok(())).expect("prepared").initial;
        for number in 0..100_u64 {
            let window =
                Window { number: number + 1, iteration: 1, start: number as f64 * 1e-2, length: 1e-2 };
            solver.solve(&window, &[], &mut output).unwrap_or_else(|f| panic!("{f}"));
            solver.commit().expect("committed");
        }
        let place = solver.state().bodies[0].motion.position + solver.model().origin;
        assert!(place.x > 0.5, "it has rolled: {place}");
        solver.state().clone()
    };
    let table = run("[[spheres]]\nfile = \"s.xyzr\"\ndensity = 2500.0\n");
    let rock = run(
        "[[rock]]\nposition = [0.0, 0.2, 0.5]\ndensity = 2500.0\nshape = { type = \"sphere\", radius = 0.1 }\n",
    );
    assert_eq!(table.bodies, rock.bodies);
}

/// A cube with eight spheres between six planes: what the elastic contacts store they give back.
#[test]
fn a_rock_in_a_smooth_box_keeps_its_energy_and_its_place() {
    let scene = "end_time = 1.0\n[box]\nlowest = [-0.5, -0.6, -0.7]\nhighest = [0.5, 0.6, 0.7]\n\
                 [[rock]]\nposition = [0.0, 0.0, 0.0]\nvelocity = [3.0, 2.0, -4.0]\nangular_velocity = [3.0, -2.0, 5.0]\n\
                 mass = 50.0\nshape = { type = \"box\", size = [0.3, 0.3, 0.3] }\ncluster.spheres = 8\n"
        .to_owned()
        + &law("restitution = 1.0");
    let mut bench = free(&scene);
    let start = bench.energy();
    let (mut worst, mut touches) = (0.0_f64, 0);
    for _ in 0..1000 {
        bench.advance(1e-3);
        worst = worst.max((bench.energy() / start - 1.0).abs());
        touches += usize::from(bench.gauge("contacts")[2] > 0.0);
        let place = bench.position();
        assert!((0..3).all(|a| place[a].abs() < [0.5, 0.6, 0.7][a]), "{place}");
    }
    assert!(touches > 50, "{touches} windows with contact");
    // At the default step, of second order.
    assert!(worst < 1e-3, "{worst:.2e}");
}

/// A ball of Hertz against a plane: rebound as the restitution says, and it comes to rest on the floor, at the overlap that
/// carries its weight.
#[test]
fn a_ball_in_a_box_rebounds_with_its_restitution_and_rests_on_the_floor() {
    let scene = |time: f64, more: &str| {
        format!(
            "end_time = {time:?}\ngravity = [0.0, 0.0, -9.81]\n[box]\nlowest = [0.0, 0.0, 0.0]\nhighest = [1.0, 1.0, 2.0]\n\
             [[rock]]\nposition = [0.5, 0.5, 0.6]\nmass = 10.0\nshape = {{ type = \"sphere\", radius = 0.1 }}\n{more}"
        ) + &law("restitution = 0.5")
    };
    let mut bench = free(&scene(0.6, ""));
    let mut fastest_up = 0.0_f64;
    for _ in 0..400 {
        bench.advance(1e-3);
        fastest_up = fastest_up.max(bench.value("rock_vz"));
    }
    let landing = (2.0 * 9.81 * 0.5_f64).sqrt();
    // Less what gravity takes while they touch, some 5 ms.
    assert!((fastest_up / landing - 0.5).abs() < 0.02, "{}", fastest_up / landing);
    let mut resting = free(&scene(5.0, ""));
    (0..5000).for_each(|_| resting.advance(1e-3));
    let modulus = 1e7 / (1.0 - 0.09);
    let overlap = (0.75 * 10.0 * 9.81 / (modulus * 0.1_f64.sqrt())).powf(2.0 / 3.0);
    assert!((resting.value("rock_z") - 0.1 + overlap).abs() < 1e-3 * overlap, "{}", resting.value("rock_z"));
}

/// A rock that falls on loose spheres: energy and horizontal momentum with all that is booked.
#[test]
fn a_rock_that_falls_on_loose_spheres_loses_the_energy_that_is_booked() {
    let rock = "[[rock]]\nposition = [0.1, 0.1, 0.45]\nmass = 2.0\nvelocity = [0.0, 0.0, -2.0]\n\
                shape = { type = \"box\", size = [0.08, 0.08, 0.08] }\ncluster.spheres = 27\n";
    let text =
        in_a_box().replace("time_step = 1e-5\n", "") + rock + &law("restitution = 0.4\nfriction = 0.4");
    let mut bench = free(&text);
    let start = bench.energy();
    let mut worst = 0.0_f64;
    for _ in 0..300 {
        bench.advance(1e-3);
        worst = worst.max((bench.energy() - start).abs());
    }
    let lost = bench.value("energy_dissipated_dem");
    println!("{} contacts, {worst:.2e} J of {lost:.2e} J", bench.solver.state().between_rocks.contacts);
    assert!(bench.solver.state().between_rocks.contacts > 20 && lost > 3.0, "{lost} J");
    assert!(worst < 1e-3 * lost, "{worst} J of {lost} J");
}

/// Contact with a box over terrain is none with the terrain: no impact is counted there and the verdict does not name it.
#[test]
fn a_rock_that_rests_on_a_box_over_terrain_has_not_come_to_rest_on_the_terrain() {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("t.obj"), "v -3 -3 0\nv 3 -3 0\nv 3 3 0\nv -3 3 0\nf 1 2 3\nf 1 3 4\n")
        .expect("written");
    let path = dir.path().join("s.toml").display().to_string();
    let text = "end_time = 3.0\ngravity = [0.0, 0.0, -9.81]\n[terrain]\nfile = \"t.obj\"\n[box]\nlowest = [-1, -1, 0.5]\nhighest = [1, 1, 3]\n\
                [[rock]]\nposition = [0, 0, 0.8]\nmass = 10.0\nshape = { type = \"sphere\", radius = 0.1 }\n"
        .to_owned()
        + &law("restitution = 0.3");
    let scene = Scene::from_text(&path, &text).expect("a scene");
    let mut solver = DemSolver::new(&scene, &OPTIONS).unwrap_or_else(|e| panic!("{e}"));
    let mut output = solver.prepare(&Plan::default(), &mut |_| Ok(())).expect("prepared").initial;
    for number in 0..300_u64 {
        let window = Window { number: number + 1, iteration: 1, start: number as f64 * 1e-2, length: 1e-2 };
        solver.solve(&window, &[], &mut output).unwrap_or_else(|f| panic!("{f}"));
        solver.commit().expect("committed");
    }
    let told = solver.finish().expect("finished");
    let impacts = told.measures.iter().find(|m| m.name == "impacts").expect("counted");
    assert_eq!(impacts.value, 0.0);
    let verdict = told.verdicts[0].to_string();
    assert!(!verdict.contains("terrain") && verdict.contains("0.60)"), "{verdict}");
}

#[test]
fn near_rocks_are_those_that_a_look_at_every_pair_finds_whenever_the_list_was_made() {
    let mut x = 1_u64;
    let mut random = || {
        x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (x >> 11) as f64 / (1_u64 << 53) as f64
    };
    let reach: Vec<f64> = (0..200).map(|_| 0.02 + 0.05 * random()).collect();
    let mut place: Vec<Vector3<f64>> =
        (0..200).map(|_| Vector3::new(random(), random(), 0.3 * random())).collect();
    let mut near = NearRocks::new(reach.clone());
    let mut remade = 0;
    for _ in 0..60 {
        remade += u32::from(near.update(place.iter().copied()));
        let listed: Vec<[usize; 2]> = near.pairs().collect();
        let order: Vec<[usize; 2]> = listed.iter().map(|[a, b]| [*b, *a]).collect();
        assert!(order.is_sorted() && listed.iter().all(|[a, b]| a < b));
        for b in 0..200 {
            for a in 0..b {
                if (place[a] - place[b]).norm() < reach[a] + reach[b] {
                    assert!(listed.contains(&[a, b]), "{a} {b}");
                }
            }
        }
        place.iter_mut().for_each(|p| *p += Vector3::new(random(), random(), random()) * 2e-3);
    }
    assert!(remade > 3 && remade < 60, "{remade}");
}

#[test]
fn what_makes_no_sense_of_boxes_and_spheres_beside_rocks_is_refused_with_its_place() {
    let rock = "[[rock]]\nname = \"stone\"\nposition = [0.1, 0.1, 0.45]\nmass = 2.0\n\
                shape = { type = \"sphere\", radius = 0.04 }\n";
    let text = in_a_box() + rock + &law("restitution = 0.5");
    let cases = [
        (text.replace("0.45]", "0.02]"), "s.toml:", "starts 0.02 m beyond the side `-z` of the box"),
        (text.replace("[0.1, 0.1, 0.45]", "[0.19, 0.1, 0.45]"), "s.toml:", "position = [0.16, 0.1, 0.45]"),
        (text.replace("0.45]", "0.2]"), "[[spheres]]", "overlap at the start"),
        (text.replace("\"stone\"", "\"spheres\""), "[[spheres]]", "is the name of a rock"),
        (
            text.replace("[[contact]]", "[[contact]]\nbetween = [\"rock\", \"rock\"]"),
            "[box]",
            "no table [[contact]] is for `rock` and `wall`",
        ),
        (text.replace("highest = [0.2", "highest = [-0.2"), "highest = ", "reaches from"),
        (text.replace("[\"+z\"]", "[\"+z\", \"+z\"]"), "open = ", "named twice"),
        (
            text.replace("[\"+z\"]", "[\"-x\", \"+x\", \"-y\", \"+y\", \"-z\", \"+z\"]"),
            "open = ",
            "all six sides are open",
        ),
        (text[..text.find("[[contact]]").expect("there")].to_owned(), "[box]", "no contact law"),
    ];
    for (text, place, expected) in cases {
        let scene = Scene::from_text("s.toml", &text).expect("a scene");
        let message = check(&scene).expect_err(expected).to_string();
        assert!(message.contains(expected) && message.contains(place), "{expected:?} {place:?}:\n{message}");
    }
}

#[test]
fn the_resolved_scene_of_a_rock_with_spheres_in_a_box_reads_back_to_the_same_check() {
    let rock =
        "[[rock]]\nposition = [0.1, 0.1, 0.45]\nmass = 2.0\nshape = { type = \"sphere\", radius = 0.04 }\n";
    let text = in_a_box() + rock + &law("restitution = 0.5");
    let first = check(&Scene::from_text("a.toml", &text).expect("a scene")).expect("checked");
    let again = format!("end_time = 1.0\n{}", first.resolved);
    let second = check(&Scene::from_text("a.toml", &again).expect("a scene")).expect("checked");
    assert_eq!(first, second);
    assert_eq!(first.numbers["spheres"], 61.0);
    assert!(
        first.builds.iter().any(|line| line.contains("60 spheres of 0.015 to 0.02 m radius")),
        "{:?}",
        first.builds
    );
}
