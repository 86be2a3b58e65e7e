//! The balance of energy: kinetic + potential + stored + dissipated - received is constant, with an
//! error that falls with the step. Nothing in it is taken from what the balance lacks.

use crate::bench::{Bench, Setup, cube, fixed_plane};
use crate::wires::{tangled, wave};
use nalgebra::Vector3;

/// Largest imbalance over `time`, relative to the kinetic energy at the start.
fn imbalance(bench: &mut Bench, step: f64, time: f64, moves: bool) -> f64 {
    let kinetic = bench.value("energy_kinetic_dem");
    let start = bench.energy();
    let mut worst = 0.0_f64;
    for _ in 0..(time / step).round() as usize {
        if moves {
            // It rises, shifts and tilts.
            for (sample, t) in [(0, bench.time), (1, bench.time + step)] {
                let (tilt, shift) = (0.2 * (40.0 * t).sin(), 0.05 * (60.0 * t).sin());
                bench.displace(sample, |_, x| Vector3::new(shift, 0.3 * t, 0.5 * t + tilt * x.x));
            }
        }
        bench.advance(step);
        worst = worst.max((bench.energy() - start).abs());
    }
    assert!(bench.value("energy_stored_dem") >= 0.0 && bench.value("energy_dissipated_dem") >= 0.0);
    worst / kinetic
}

fn corner(contact: &str, step: f64) -> Bench {
    let more = "position = [0.0, 0.0, 0.33]\nvelocity = [0.5, 0.2, -3.0]\norientation = [0.92, 0.25, 0.2, 0.1]\n\
                angular_velocity = [1.0, -2.0, 0.7]";
    let scene = format!(
        "end_time = 0.1\ngravity = [0.0, 0.0, -9.81]\n{}[[contact]]\n{contact}\n[dem]\ntime_step = {step:e}\n",
        cube(64, more)
    );
    Setup::new(scene, fixed_plane(4.0, 2)).build()
}

#[test]
fn without_dashpot_and_friction_the_energy_error_is_of_second_order() {
    let law = "law = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\nrestitution = 1.0";
    let [coarse, fine] = [1e-4, 2.5e-5].map(|h| imbalance(&mut corner(law, h), h, 0.08, false));
    assert!(coarse < 1e-3, "{coarse:.2e}");
    let order = (coarse / fine).log2() / 2.0;
    assert!(order > 1.8, "order {order:.2}: {coarse:.2e} {fine:.2e}");
}

/// Touch in the middle of a step, slip that turns within it: between first and second order.
#[test]
fn with_dashpot_and_friction_the_energy_error_falls_faster_than_the_step() {
    let law = "law = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\nrestitution = 0.5\nfriction = 0.4";
    let [coarse, fine] = [1e-4, 1.25e-5].map(|h| imbalance(&mut corner(law, h), h, 0.08, false));
    assert!(coarse < 5e-3, "{coarse:.2e}");
    let order = (coarse / fine).log2() / 3.0;
    assert!(order > 1.0, "order {order:.2}: {coarse:.2e} {fine:.2e}");
}

/// A mesh that moves brings work with it, and the balance still closes.
#[test]
fn with_a_moving_wall_the_received_work_closes_the_balance() {
    let law = "law = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\nrestitution = 0.5\nfriction = 0.4";
    let [coarse, fine] = [1e-4, 1.25e-5].map(|h| {
        let mut bench = corner(law, h);
        let work = |bench: &Bench| bench.value("energy_received_dem").abs();
        let worst = imbalance(&mut bench, h, 0.08, true);
        assert!(work(&bench) > 100.0, "the wall has worked: {}", work(&bench));
        worst
    });
    assert!(coarse < 5e-3, "{coarse:.2e}");
    assert!((coarse / fine).log2() / 3.0 > 1.0, "{coarse:.2e} {fine:.2e}");
}

/// A tilted cube in a waving net, wires coming and going under its spheres.
#[test]
fn in_a_waving_net_the_balance_closes_as_well() {
    let [coarse, fine] = [2e-5, 5e-6].map(|h: f64| {
        let mut setup = tangled(64, 1);
        setup.scene = setup.scene.replace("time_step = 2e-5", &format!("time_step = {h:e}"));
        let mut bench = setup.build();
        let (kinetic, start) = (bench.value("energy_kinetic_dem"), bench.energy());
        let mut worst = 0.0_f64;
        for _ in 0..(0.03 / h).round() as usize {
            wave(&mut bench, 1, h);
            bench.advance(h);
            worst = worst.max((bench.energy() - start).abs());
        }
        assert!(bench.value("energy_dissipated_dem") > 10.0 && bench.value("energy_received_dem") < -100.0);
        worst / kinetic
    });
    assert!(coarse < 1e-4, "{coarse:.2e}");
    assert!((coarse / fine).log2() / 2.0 > 1.0, "{coarse:.2e} {fine:.2e}");
}

/// What slides to a stop has rubbed off its kinetic energy, to the energy still in the springs.
#[test]
fn a_cube_that_slides_to_a_stop_has_dissipated_its_kinetic_energy() {
    let scene = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n{}[[contact]]\nlaw = \"linear\"\nstiffness = 1e6\npoisson = 0.2\n\
         restitution = 0.3\nfriction = 0.5\n[dem]\ntime_step = 1e-4\n",
        cube(64, "position = [-0.5, 0.0, 0.2049]\nvelocity = [2.0, 0.0, 0.0]")
    );
    let mut bench = Setup::new(scene, fixed_plane(4.0, 2)).build();
    for _ in 0..1000 {
        bench.advance(1e-3);
    }
    assert!(bench.velocity().norm() < 1e-3 && bench.spin().norm() < 1e-2, "{}", bench.velocity());
    let dissipated = bench.value("energy_dissipated_dem");
    // Sliding leaves the way v^2 / (2 mu g); the cube leans on its leading edge on the way.
    assert!((dissipated / 360.0 - 1.0).abs() < 0.01, "{dissipated}");
    assert!((bench.value("rock_x") + 0.5 - 4.0 / (2.0 * 0.5 * 9.81)).abs() < 0.02);
}
