//! Rocks on a terrain that meet each other.

use crate::bench::{Bench, G, plane};
use interface_defs::{Solver, Window};

/// A cube that lies on a flat terrain, a second one that falls on it, and what is to be with them.
fn scene(more: &str) -> String {
    let rock = |name: &str, z: f64, more: &str| {
        format!(
            "[[rock]]\nname = \"{name}\"\nmass = 100.0\nshape = {{ type = \"box\", size = [0.4, 0.4, 0.4] }}\n\
             cluster.spheres = 64\nposition = [0.0, 0.0, {z:?}]\n{more}\n"
        )
    };
    "end_time = 5.0\ngravity = [0.0, 0.0, -9.81]\n".to_owned()
        + &rock("low", 0.2, "")
        + &rock("high", 0.65, "orientation = [0.98, 0.0, 0.0, 0.2]")
        + "[terrain]\nfile = \"t.obj\"\n[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.25\n\
           restitution = 0.3\nfriction = 0.6\n"
        + more
}

/// It lies between the tops of spheres of radius r = 0.07 m, 1.25 r apart, and the hollows between four of them:
/// 2 r - sqrt(4 r^2 - (1.25 r)^2 / 2) = 0.0144 m; the overlaps are below a millimetre. Energy that is not dissipated never grows by more than the scheme's error.
#[test]
fn a_cube_that_falls_on_another_which_lies_on_terrain_comes_to_rest_on_top_of_it() {
    let mut bench = Bench::new(&plane(0.0, [-10.0, 10.0], 4, 4), &scene(""), true);
    let energy = |bench: &Bench| bench.energy() + bench.value("energy_dissipated_dem");
    let (start, drop) = (energy(&bench), 100.0 * G * 0.05);
    let mut worst = 0.0_f64;
    while !bench.solver.has_ended() {
        assert!(bench.time < 5.0, "still moving");
        bench.advance(1e-3);
        worst = worst.max((energy(&bench) - start).abs());
    }
    println!("at rest at {:.3} s, imbalance {worst:.2e} of {drop:.0} J", bench.time);
    assert!(worst < 1e-3 * drop, "{worst:.2e} of {drop:.0} J");
    assert!((bench.value("low_z") - 0.2).abs() < 2e-3, "{}", bench.value("low_z"));
    let high = bench.value("high_z");
    assert!(high < 0.6 && high > 0.6 - 0.0144 - 2e-3, "{high}");
    let state = bench.solver.state();
    assert!(state.between_rocks.contacts >= 4 && state.bodies[0].contacts >= 4, "{state:?}");
    // What still swings at less than the speed of rest: a hundredth of the weight.
    let force = state.bodies[1].motion.acceleration * 100.0;
    assert!(force.norm() < 0.05 * 100.0 * G, "{force}");
}

/// A ball that has come to rest is hit by another, two seconds later: its run-out is that of the second rest, and all of the time
/// that it lay there counts as contact, once. One that lies still while another rolls on ends when it came to rest.
#[test]
fn a_rock_at_rest_that_another_sets_in_motion_has_not_ended() {
    let ball = |name: &str, x: f64, y: f64, more: &str| {
        format!(
            "[[rock]]\nname = \"{name}\"\nmass = 100.0\nshape = {{ type = \"sphere\", radius = 0.2 }}\n\
             position = [{x:?}, {y:?}, 0.2]\n{more}\n"
        )
    };
    let scene = "end_time = 60.0\ngravity = [0.0, 0.0, -9.81]\n".to_owned()
        + &ball("hit", 0.0, 0.0, "")
        + &ball("still", 0.0, 4.0, "velocity = [0.5, 0.0, 0.0]")
        + &ball("rolls", -8.0, 0.0, "velocity = [4.5, 0.0, 0.0]\nangular_velocity = [0.0, 22.5, 0.0]")
        + "[terrain]\nfile = \"t.obj\"\n[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.25\n\
           restitution = 0.3\nfriction = 0.6\nrolling_friction = 0.05\nrolling = \"spring\"\nrolling_damping = 0.3\n";
    let mut bench = Bench::new(&plane(0.0, [-20.0, 20.0], 4, 4), &scene, true);
    let (mut rested, mut hit) = (false, false);
    while !bench.solver.has_ended() {
        assert!(bench.time < 30.0, "still moving");
        bench.advance(5e-3);
        let path = &bench.solver.state().bodies[0].path;
        hit |= rested && path.ending.is_none();
        rested |= path.ending.is_some();
    }
    assert!(rested && hit, "at rest: {rested}, and hit after that: {hit}");
    let ended = bench.time;
    let state = bench.solver.state().clone();
    let measures = bench.solver.finish().expect("finished").measures;
    let measure = |name: &str| {
        let found = measures.iter().find(|m| m.name == name);
        found.unwrap_or_else(|| panic!("no {name}: {measures:?}")).value
    };
    for (body, name) in state.bodies.iter().zip(["hit", "still", "rolls"]) {
        let end = body.path.ending.expect("all lie still");
        let share = measure(&format!("{name}_contact_time_fraction"));
        println!("{name}: at rest at {:.3} s of {ended:.3} s, in contact for {share:.4} of it", end.time);
        // None is in the air for longer than a bounce of the collision.
        assert!(share > 0.9 && share <= 1.0, "{name}: {share}");
        let place = body.motion.position + bench.solver.model().origin;
        assert!((measure(&format!("{name}_rest_x")) - place.x).abs() < 1e-3, "{name}");
    }
    assert!(measure("hit_rest_x") > 0.5 && measure("still_runout_distance") < 1.0);
    assert!(state.bodies[1].path.ending.expect("lies").time < 0.5 * ended);
}

/// The two cubes with every step taken: closed-form flight changes rounding, which an impact of 64 spheres magnifies.
#[test]
fn two_rocks_over_terrain_fly_in_closed_form_until_they_can_meet() {
    let scene = scene("[dem]\ntime_step = 5e-5\n")
        .replace("position = [0.0, 0.0, 0.2]", "position = [0.0, 0.0, 1.9]");
    let build = |shortcuts| Bench::new(&plane(0.0, [-10.0, 10.0], 4, 4), &scene, shortcuts);
    let (mut fast, mut slow) = (build(true), build(false));
    fast.run(0.01, 0.8);
    slow.run(0.01, 0.8);
    for name in ["low_x", "low_z", "high_x", "high_z", "high_vz"] {
        let (a, b) = (fast.value(name), slow.value(name));
        assert!((a - b).abs() < 1e-7 * (1.0 + b.abs()), "{name}: {a} {b}");
    }
    assert!(slow.value("energy_dissipated_dem") > 10.0, "they have met the ground");
    let flown = |bench: &mut Bench| {
        let counts = bench.solver.finish().expect("finished").counts;
        counts.iter().find(|(name, _)| name == "flight_steps").expect("counted").1
    };
    let (some, none) = (flown(&mut fast), flown(&mut slow));
    assert!(some > 0 && none == 0, "{some} {none}");
}

/// A light ball hangs over the ground; a heavy one, a thousand times its mass, comes down obliquely at 30 m/s and throws it against
/// the ground faster than anything falls. However long the step that the scene asks for, it never passes through unseen: it bounces, or
/// the window fails and says what to do.
#[test]
fn a_light_rock_that_a_heavy_one_throws_at_the_ground_does_not_pass_through_it() {
    let scene = |dem: &str| {
        let ball = |name: &str, radius: f64, mass: f64, at: [f64; 3], velocity: [f64; 3]| {
            format!(
                "[[rock]]\nname = \"{name}\"\nmass = {mass:?}\nshape = {{ type = \"sphere\", radius = {radius:?} }}\n\
                 position = {at:?}\nvelocity = {velocity:?}\n"
            )
        };
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n".to_owned()
            + &ball("light", 0.05, 1.0, [0.0, 0.0, 0.6], [0.0; 3])
            + &ball("heavy", 0.5, 1000.0, [-0.9, 0.0, 1.5], [15.0, 0.0, -15.0])
            + "[terrain]\nfile = \"t.obj\"\n[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.25\n\
               restitution = 0.9\nfriction = 0.3\n"
            + dem
    };
    let mesh = plane(0.0, [-10.0, 10.0], 4, 4);
    // The step that the solver takes itself, and those that it is told to take.
    let (mut bounced, mut refused) = (0, 0);
    for dem in [
        String::new(),
        "[dem]\nsteps_per_contact = 20\n".into(),
        "[dem]\ntime_step = 2e-4\nallow_unstable = true\n".into(),
        "[dem]\ntime_step = 1e-3\nallow_unstable = true\n".into(),
        "[dem]\ntime_step = 5e-3\nallow_unstable = true\n".into(),
    ] {
        let mut bench = Bench::new(&mesh, &scene(&dem), true);
        let (mut fastest, mut fault) = (0.0_f64, None);
        while bench.time < 0.2 && fault.is_none() {
            let window = Window { number: bench.windows + 1, iteration: 1, start: bench.time, length: 0.005 };
            match bench.solver.solve(&window, &[], &mut bench.output) {
                Ok(()) => bench.solver.commit().expect("committed"),
                Err(error) => fault = Some(error.diagnostic.message),
            }
            bench.windows += 1;
            bench.time += 0.005;
            let light = bench.solver.state().bodies[0].motion;
            fastest = fastest.max(light.velocity.norm());
            // An overlap of a radius fails the window, here and in the step.
            assert!(
                light.position.z + bench.solver.model().origin.z > 0.0,
                "{dem}: through at {}",
                bench.time
            );
        }
        match fault {
            None => {
                assert!(fastest > 30.0, "{dem}: thrown at {fastest} m/s");
                assert!(bench.solver.state().bodies[0].path.impacts > 0, "{dem}: met the ground");
                bounced += 1;
            }
            Some(message) => {
                assert!(message.contains("dem.time_step") && message.contains("`light`"), "{dem}: {message}");
                assert!(!dem.is_empty(), "the solver's own step is short enough: {message}");
                refused += 1;
            }
        }
    }
    assert!(bounced >= 2 && refused >= 2, "{bounced} bounced, {refused} refused");
}
