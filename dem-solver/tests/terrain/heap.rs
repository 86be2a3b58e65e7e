//! Rocks on a terrain that meet each other.

use crate::bench::{Bench, G, plane};
use interface_defs::Solver;

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
    assert!(state.encounters.contacts >= 4 && state.bodies[0].contacts >= 4, "{state:?}");
    // What still swings at less than the speed of rest: a hundredth of the weight.
    let force = state.bodies[1].motion.acceleration * 100.0;
    assert!(force.norm() < 0.05 * 100.0 * G, "{force}");
}

/// The same with every step taken: closed-form flight changes rounding, which an impact of 64 spheres magnifies.
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
