//! Rocks that meet each other.

use crate::bench::{Bench, Setup, fixed_plane, sphere};
use dem_solver::DemSolver;
use interface_defs::Solver;
use interface_defs::message::FaultKind;
use nalgebra::Vector3;
use std::f64::consts::PI;
use toolkit::alloc::allocations;
use toolkit::program::Options;
use toolkit::scene::Scene;

fn free(scene: String) -> Bench {
    Setup { contact_mesh: None, ..Setup::new(scene, Default::default()) }.build()
}

fn contact(young: f64, poisson: f64, more: &str) -> String {
    format!("[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = {young:?}\npoisson = {poisson:?}\n{more}\n")
}

/// Momentum, and angular momentum about the origin, of all rocks.
fn momenta(bench: &Bench) -> [Vector3<f64>; 2] {
    let (model, state) = (bench.solver.model(), bench.solver.state());
    let mut sums = [Vector3::zeros(); 2];
    for (rock, body) in model.rocks.iter().zip(&state.bodies) {
        let linear = body.motion.velocity * rock.mass;
        sums[0] += linear;
        sums[1] += body.motion.position.cross(&linear) + body.motion.angular_momentum;
    }
    sums
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|x| x.to_bits()).collect()
}

/// V-D1, the rows of two spheres. 200 steps per contact: the deepest point lies within half a step of
/// one that is seen, (pi / 400)^2 / 2 = 3e-5 of it, and the scheme is of second order with the same
/// factor; both dates of a duration are known to one step.
#[test]
fn two_equal_spheres_press_as_deep_and_as_long_as_hertz_says_and_part_as_fast_as_they_came() {
    for (young, nu, density, overlap, force, duration) in [
        (20e9, 0.25, 2500.0, 3.68304026e-4, 7108.24128, 5.42010049e-5),
        (48e9, 0.20, 2800.0, 2.74112702e-4, 10696.889, 4.03394557e-5),
    ] {
        let h = duration / 200.0;
        let a = sphere(0.01, density, "position = [0.0, 0.0, 0.0]\nvelocity = [10.0, 0.0, 0.0]");
        let b = sphere(0.01, density, "position = [0.0201, 0.0, 0.0]\nvelocity = [-10.0, 0.0, 0.0]");
        let scene = format!("end_time = 1.0\n{a}{b}{}", contact(young, nu, "restitution = 1.0"))
            + &format!("[dem]\ntime_step = {h:?}\n");
        let mut bench = free(scene);
        let mass = 4.0 / 3.0 * PI * 1e-6 * density;
        let (mut strongest, mut steps) = (0.0_f64, 0);
        for _ in 0..400 {
            bench.advance(h);
            let pressed = bench.solver.state().bodies[0].motion.acceleration.norm() * mass;
            strongest = strongest.max(pressed);
            steps += u32::from(pressed > 0.0);
        }
        let measures = bench.solver.finish().expect("finished").measures;
        let deepest = measures.iter().find(|m| m.name == "max_penetration_of_rocks").expect("they met");
        assert!((deepest.value * 0.01 / overlap - 1.0).abs() < 1e-4, "{}", deepest.value * 0.01);
        assert!((strongest / force - 1.0).abs() < 1.5e-4, "{strongest}");
        assert!((f64::from(steps) - 200.0).abs() <= 1.0, "{steps}");
        let [first, second] = ["rock_vx", "rock_2_vx"].map(|name| bench.value(name));
        assert!((first + 10.0).abs() < 1e-3 && first + second == 0.0, "{first} {second}");
    }
}

/// V-D7, test 7: their surfaces move together, so that nothing slips. The lever arms of both are equal
/// but for rounding.
#[test]
fn spheres_that_turn_like_gears_part_with_the_spin_that_they_had() {
    let ball = |name: &str, x: f64, speed: f64, spin: f64| {
        let motion = format!("velocity = [{speed:?}, 0.0, 0.0]\nangular_velocity = [0.0, 0.0, {spin:?}]");
        sphere(0.1, 2700.0, &format!("name = \"{name}\"\nposition = [{x:?}, 0.0, 0.0]\n{motion}"))
    };
    for spin in [0.5, 10.0, 100.0] {
        let scene = "end_time = 1.0\n".to_owned()
            + &ball("a", 0.0, 0.2, spin)
            + &ball("b", 0.2001, -0.2, -spin)
            + &contact(70e9, 0.33, "restitution = 0.5\nfriction = 0.4")
            + "[dem]\nsteps_per_contact = 1000\n";
        let mut bench = free(scene);
        bench.until_separated(1e-5);
        assert!((bench.value("a_vx") + 0.1).abs() < 1e-4, "{}", bench.value("a_vx"));
        for (rock, sign) in [(0, 1.0), (1, -1.0)] {
            let (it, motion) = (&bench.solver.model().rocks[rock], &bench.solver.state().bodies[rock].motion);
            assert!((it.spin(motion).z * sign / spin - 1.0).abs() < 1e-13, "{}", it.spin(motion));
            assert!(motion.velocity.y.abs() < 1e-13 * spin, "{}", motion.velocity);
        }
    }
}

/// Two cubes of 64 spheres that hit each other askew while they turn; with `more` in their law.
fn cubes(step: f64, more: &str) -> String {
    let cube = |name: &str, size: [f64; 3], more: &str| {
        format!(
            "[[rock]]\nname = \"{name}\"\ndensity = 2500.0\nshape = {{ type = \"box\", size = {size:?} }}\n\
             cluster.spheres = 64\n{more}\n"
        )
    };
    let a = "position = [0.0, 0.0, 0.0]\nvelocity = [2.0, 0.0, 0.3]\nangular_velocity = [1.0, -2.0, 0.5]";
    let b = "position = [0.52, 0.11, 0.07]\nvelocity = [-3.0, 0.4, 0.0]\norientation = [0.9, 0.3, -0.1, 0.2]\n\
             angular_velocity = [0.0, 3.0, -1.0]";
    "end_time = 1.0\n".to_owned()
        + &cube("a", [0.4; 3], a)
        + &cube("b", [0.3, 0.3, 0.35], b)
        + &contact(1e8, 0.2, more)
        + &format!("[dem]\ntime_step = {step:?}\n")
}

/// Every pair of forces is one vector, acting at one point: what is left are the roundings of some
/// thousand sums of numbers of the size of the momenta.
#[test]
fn two_cubes_that_collide_keep_momentum_and_angular_momentum_whatever_the_law() {
    for more in [
        "restitution = 1.0",
        "restitution = 0.4\nfriction = 0.6",
        "restitution = 0.6\nfriction = 0.3\nrolling_friction = 0.2\nrolling = \"spring\"\nrolling_damping = 0.3",
    ] {
        let mut bench = free(cubes(2e-5, more));
        let before = momenta(&bench);
        let mut contacts = 0.0;
        for _ in 0..200 {
            bench.advance(1e-3);
            contacts += bench.gauge("contacts")[2];
        }
        let after = momenta(&bench);
        assert!(contacts > 20.0 && bench.value("contacts") == 0.0, "{contacts}");
        for (now, then) in after.iter().zip(before) {
            let error = (now - then).norm();
            assert!(error < 1e4 * f64::EPSILON * 500.0, "{more}: {error:.3e} of {}", then.norm());
        }
        let change = bench.energy();
        assert!(change.is_finite() && bench.value("energy_stored_dem") == 0.0);
        assert_eq!(bench.value("energy_dissipated_dem") > 1.0, more != "restitution = 1.0");
    }
}

/// Halving the step leaves a quarter of the error; contacts that begin anywhere in a step make it uneven.
#[test]
fn the_energy_of_two_cubes_that_collide_is_of_second_order_in_the_step() {
    for more in ["restitution = 1.0", "restitution = 0.5\nfriction = 0.5"] {
        let error = |step: f64| {
            let mut bench = free(cubes(step, more));
            let before = bench.energy();
            let mut worst = 0.0_f64;
            for _ in 0..60 {
                bench.advance(1e-3);
                worst = worst.max((bench.energy() / before - 1.0).abs());
            }
            worst
        };
        let errors = [8e-5, 4e-5, 2e-5, 1e-5].map(error);
        println!("{more}: {errors:?}");
        assert!(errors[0] < 1e-3 && errors[3] < errors[0] / 30.0, "{more}: {errors:?}");
    }
}

fn three(more: &str) -> String {
    let at = |x: f64, v: f64| {
        let motion =
            format!("position = [{x:?}, 0.0, 0.0]\nvelocity = [{v:?}, 0.0, 0.0]\ncluster.spheres = 64");
        format!("[[rock]]\nmass = 100.0\nshape = {{ type = \"box\", size = [0.4, 0.4, 0.4] }}\n{motion}\n")
    };
    "end_time = 1.0\n".to_owned()
        + &at(0.0, 0.0)
        + &at(-0.45, 3.0)
        + &at(0.45, -3.0)
        + &contact(1e8, 0.2, more)
        + "[dem]\ntime_step = 2e-5\n"
}

/// A mirrored scene has a mirrored answer, but for the order in which forces are added up.
#[test]
fn a_rock_that_two_others_hit_from_both_sides_at_once_stays_where_it_is() {
    let mut bench = free(three("restitution = 0.5\nfriction = 0.5"));
    let before = bench.energy();
    let mut most = 0.0_f64;
    for _ in 0..100 {
        bench.advance(1e-3);
        most = most.max(bench.gauge("contacts")[2]);
    }
    // 16 spheres of each face: each touches one of the other's, on both sides.
    assert_eq!((most, bench.value("contacts")), (32.0, 0.0));
    assert!(bench.value("rock_x").abs() < 1e-13 && bench.value("rock_vx").abs() < 1e-12);
    let [left, right] = ["rock_2_vx", "rock_3_vx"].map(|name| bench.value(name));
    assert!(left < -1.0 && (left + right).abs() < 1e-12, "{left} {right}");
    assert!((bench.energy() / before - 1.0).abs() < 1e-4, "{} {before}", bench.energy());
}

/// Three rocks on a plane, friction and all.
fn heap() -> Setup {
    let rock = |at: &str, more: &str| {
        format!(
            "[[rock]]\nmass = 100.0\nshape = {{ type = \"box\", size = [0.4, 0.4, 0.4] }}\ncluster.spheres = 64\n\
             position = {at}\n{more}\n"
        )
    };
    let scene = "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n".to_owned()
        + &rock("[0.0, 0.0, 0.21]", "")
        + &rock("[0.15, 0.1, 0.65]", "velocity = [0.0, 0.0, -2.0]")
        + &rock("[0.8, 0.0, 0.6]", "velocity = [-1.0, 0.0, -2.0]\norientation = [0.9, 0.2, 0.3, 0.1]")
        + &contact(1e8, 0.2, "restitution = 0.5\nfriction = 0.5")
        + "[dem]\ntime_step = 5e-5\n";
    Setup { reach: true, ..Setup::new(scene, fixed_plane(4.0, 4)) }
}

#[test]
fn rocks_in_a_heap_solve_a_then_b_then_a_to_the_bytes_of_a_and_allocate_nothing() {
    let mut bench = heap().build();
    let (mut rock_contacts, mut made) = (0, 0);
    for window in 0..300 {
        let before = allocations();
        bench.solve(1e-3).expect("solved");
        if window > 0 {
            made += allocations() - before;
        }
        let a = bits(&bench.output);
        // Another length, long enough for other candidates.
        bench.solve(2.3e-2).expect("solved");
        bench.solve(1e-3).expect("solved");
        assert_eq!(bits(&bench.output), a, "window {window}");
        bench.commit(1e-3);
        rock_contacts += bench.solver.state().between_rocks.contacts;
    }
    assert!(rock_contacts > 100 && made == 0, "{rock_contacts} contacts between rocks, {made} allocations");
}

#[test]
fn candidates_of_any_age_give_the_same_bytes() {
    let run = |detours: bool| {
        let mut bench = heap().build();
        let mut history = Vec::new();
        for window in 0..200 {
            if detours && window % 3 == 0 {
                bench.solve(1.7e-2).expect("solved");
            }
            bench.advance(1e-3);
            history.extend(bits(&bench.output));
        }
        history
    };
    assert_eq!(run(false), run(true));
}

/// 2000 sums of rounding against one formula, as for one rock; then they meet, and what differs is
/// the rounding that the impact magnifies.
#[test]
fn rocks_fly_in_closed_form_until_they_can_meet_and_meet_as_if_they_had_stepped() {
    let scene = "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n".to_owned()
        + &sphere(0.2, 2500.0, "position = [0.0, 0.0, 0.0]\nvelocity = [0.0, 0.0, 6.0]")
        + &sphere(0.3, 2500.0, "position = [0.1, 0.0, 2.0]")
        + &contact(1e8, 0.2, "restitution = 0.8\nfriction = 0.4")
        + "[dem]\ntime_step = 5e-5\n";
    let build = |shortcuts| {
        Setup { contact_mesh: None, shortcuts, ..Setup::new(scene.clone(), Default::default()) }.build()
    };
    let (mut fast, mut slow) = (build(true), build(false));
    let mut rock_contacts = 0.0;
    for _ in 0..150 {
        fast.advance(4e-3);
        slow.advance(4e-3);
        rock_contacts += fast.gauge("contacts")[2];
        for name in ["rock_x", "rock_z", "rock_vx", "rock_vz", "rock_2_x", "rock_2_vz"] {
            let (a, b) = (fast.value(name), slow.value(name));
            assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{name} at {}: {a} {b}", fast.time);
        }
    }
    let counts = fast.solver.finish().expect("finished").counts;
    let flights = counts.iter().find(|(name, _)| name == "flight_windows").expect("counted").1;
    assert!(rock_contacts > 0.0 && flights > 100, "{rock_contacts} contacts, {flights} windows of flight");
}

fn refusal(text: &str) -> String {
    let scene = Scene::from_text("test.toml", text).expect("a scene");
    let options = Options { out: None, shortcuts: true };
    DemSolver::new(&scene, &options).err().map(|e| e.to_string()).expect("refused")
}

#[test]
fn rocks_that_start_inside_each_other_or_without_a_law_are_refused_with_their_names() {
    let two = |x: f64, between: &str| {
        "end_time = 1.0\n".to_owned()
            + &sphere(0.2, 2500.0, "name = \"low\"\nmaterial = \"granite\"\nposition = [0.0, 0.0, 0.0]")
            + &sphere(
                0.2,
                2500.0,
                &format!("name = \"high\"\nmaterial = \"gneiss\"\nposition = [{x:?}, 0.0, 0.0]"),
            )
            + &contact(1e8, 0.2, &format!("restitution = 0.8\n{between}"))
    };
    let error = refusal(&two(0.2, ""));
    assert!(error.contains("`low` and rock `high` overlap at the start, by 1.00 radii"), "{error}");
    let error = refusal(&two(1.0, "between = [\"granite\", \"structure\"]"));
    assert!(error.contains("no table [[contact]] is for `granite` and `gneiss`"), "{error}");
    let alone = "end_time = 1.0\n".to_owned()
        + &sphere(0.2, 2500.0, "position = [0.0, 0.0, 0.0]")
        + &sphere(0.2, 2500.0, "position = [0.1, 0.0, 0.0]");
    let scene = Scene::from_text("test.toml", &alone).expect("a scene");
    let solver =
        DemSolver::new(&scene, &Options { out: None, shortcuts: true }).unwrap_or_else(|e| panic!("{e}"));
    assert!(
        solver.notices().iter().any(|n| n.message.contains("fall through each other")),
        "{:?}",
        solver.notices()
    );
}

#[test]
fn rocks_too_fast_or_too_soft_to_meet_fail_the_window_with_their_names() {
    let two = |young: f64, speed: f64, step: f64| {
        let moving = format!("name = \"b\"\nposition = [1.0, 0.0, 0.0]\nvelocity = [-{speed:?}, 0.0, 0.0]");
        let scene = "end_time = 1.0\n".to_owned()
            + &sphere(0.2, 2500.0, "name = \"a\"\nposition = [0.0, 0.0, 0.0]")
            + &sphere(0.2, 2500.0, &moving)
            + &contact(young, 0.2, "restitution = 1.0")
            + &format!("[dem]\ntime_step = {step:?}\nallow_unstable = true\n");
        Setup { contact_mesh: None, window: 1e-2, ..Setup::new(scene, Default::default()) }.build()
    };
    for (young, speed, step, expected) in [
        (1e8, 100.0, 2e-3, "might pass through unseen"),
        (1e3, 20.0, 1e-4, "too soft, raise contact.young from 1.000e3"),
    ] {
        let mut bench = two(young, speed, step);
        let fault = (0..200).find_map(|_| match bench.solve(1e-2) {
            Ok(()) => {
                bench.commit(1e-2);
                None
            }
            Err(fault) => Some(fault),
        });
        let fault = fault.expect("a fault");
        assert_eq!(fault.kind, FaultKind::Window);
        assert!(
            fault.diagnostic.message.contains("`a` and `b`") && fault.diagnostic.message.contains(expected),
            "{fault}"
        );
    }
}
