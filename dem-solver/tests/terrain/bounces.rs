//! V-T1 to V-T3 and V-T5: bounces down a plane.

use crate::bench::{Bench, G, dropped, plane};
use dem_solver::model::state::Against;
use dem_solver::rock::rotation::turn;
use nalgebra::Vector3;

const YOUNG: f64 = 2e15;

/// The restitution errs by some 2.5 / N^2 with N steps in a contact: here by 1.6e-5.
const FINE: &str = "[dem]\nsteps_per_contact = 400\n";

/// Time between touches, and way down the slope at each touch, from the first one on; speed down the slope,
/// spin; and the time in contact up to there, which the hard limit does not have.
fn bounces(restitution: f64, friction: f64, end: f64) -> (Vec<[f64; 4]>, f64) {
    let mut bench = Bench::new(
        &plane(30.0, [-10.0, 60.0], 1, 1),
        &dropped(30.0, YOUNG, restitution, friction, FINE),
        true,
    );
    bench.run(0.05, end);
    let touches = bench.touches();
    let along = Vector3::new(30_f64.to_radians().cos(), 0.0, -30_f64.to_radians().sin());
    let way = |row: &[f64]| Vector3::new(row[2], row[3], row[4]).dot(&along);
    let speed = |row: &[f64]| Vector3::new(row[5], row[6], row[7]).dot(&along);
    let first = &touches[0];
    let seen = touches.iter().map(|t| [t[0] - first[0], way(t) - way(first), speed(t), t[9]]).collect();
    let body = &bench.solver.state().bodies[0];
    let path = &body.path;
    let (depth, _) = body.deepest.of(Against::Terrain);
    assert!(depth < 1.2e-4, "overlap {depth:.2e} radii");
    (seen, path.in_contact)
}

/// V-T1. An elastic contact of duration c adds c to each flight and nothing to the speeds, so that touch k
/// is at k (T + c) exactly, up to the step of a row.
#[test]
fn a_frictionless_elastic_ball_bounces_4_12_24_40_m_down_a_slope_of_30_degrees() {
    let (seen, contact) = bounces(1.0, 0.0, 4.5);
    let each = contact / seen.len() as f64;
    let flight = 2.0 * (2.0 * G).sqrt() / G;
    assert!((flight - 0.903_047_282).abs() < 1e-9);
    for (k, (&[time, way, ..], table)) in seen.iter().zip([0.0, 4.0, 12.0, 24.0, 40.0]).enumerate() {
        let t = k as f64 * (flight + each);
        let exact = (2.0 * G).sqrt() * 0.5 * t + 0.25 * G * t * t;
        println!(
            "touch {k}: {time:.6} s, {way:.6} m; with the contact's {each:.2e} s: {t:.6} s, {exact:.6} m; hard: {table} m"
        );
        // Rows are a fiftieth of a contact apart; the last contact may be under way at the end.
        assert!((time - t).abs() < 0.3 * each * (k as f64 + 1.0), "{time} {t}");
        assert!((way - exact).abs() < 25.0 * 0.3 * each * (k as f64 + 1.0), "{way} {exact}");
        assert!((way - table).abs() < 25.0 * 1.3 * each * (k as f64 + 1.0));
    }
    assert_eq!(seen.len(), 5);
}

/// V-T2. Damped contacts last c each, of which the whole run has as much as was counted: in it the ball
/// moves on at up to 6 m/s, and the dates are late by it.
#[test]
fn a_ball_of_restitution_one_half_bounces_as_the_hard_limit_says() {
    let (seen, contact) = bounces(0.5, 0.0, 1.34);
    let times = [0.451523641, 0.677285461, 0.790166372, 0.846606827, 0.874827054];
    let ways = [1.5, 2.625, 3.28125, 3.6328125, 3.814453125];
    for k in 0..5 {
        let [time, way, ..] = seen[k + 1];
        println!("impact {}: {time:.6} s ({:.6}), {way:.6} m ({:.6})", k + 1, times[k], ways[k]);
        // A restitution that is 1.6e-5 off makes the flights as much shorter.
        assert!((time - times[k]).abs() < 2.0 * contact + 1e-5, "{time} {} {contact:.2e}", times[k]);
        assert!((way - ways[k]).abs() < 6.0 * (2.0 * contact + 1e-5), "{way}");
    }
}

/// V-T3. As V-T2, with friction that slides throughout each impact.
#[test]
fn a_ball_that_slides_through_its_impacts_slows_and_spins_as_the_impulses_say() {
    let (seen, contact) = bounces(0.5, 0.05, 1.34);
    let ways = [1.370096189, 2.397668332, 2.997085414, 3.318201709, 3.484111794];
    let speeds = [4.141745901, 5.105257123, 5.587012733, 5.827890538, 5.948329441];
    let spins = [3.596262709, 5.394394063, 6.293459740, 6.742992578, 6.967758998];
    for k in 0..5 {
        let [_, way, speed, spin] = seen[k + 1];
        println!(
            "impact {}: {way:.6} m ({}), {speed:.6} m/s ({}), {spin:.6} rad/s ({})",
            k + 1,
            ways[k],
            speeds[k],
            spins[k]
        );
        assert!((way - ways[k]).abs() < 6.0 * (2.0 * contact + 1e-5), "{way}");
        assert!((speed - speeds[k]).abs() < 5.0 * (2.0 * contact + 1e-5) + 2e-4 * speeds[k], "{speed}");
        // Micro-slip: until the spring has reached its limit the friction is less; the step samples it.
        assert!((spin - spins[k]).abs() < 2e-3 * spins[k], "{spin}");
    }
}

fn cube(spheres: u32, orientation: [f64; 4], restitution: f64, friction: f64) -> String {
    format!(
        "end_time = 5.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [0.0, 0.0, 1.5]\norientation = {orientation:?}\n\
         density = 2500.0\nshape = {{ type = \"box\", size = [0.6, 0.6, 0.6] }}\ncluster.spheres = {spheres}\n[terrain]\n\
         file = \"t.obj\"\n[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e9\npoisson = 0.25\n\
         restitution = {restitution:?}\nfriction = {friction:?}\n"
    )
}

/// Turn about y by `degrees`.
fn turned(degrees: f64) -> [f64; 4] {
    let (sin, cos) = (0.5 * degrees.to_radians()).sin_cos();
    [cos, 0.0, sin, 0.0]
}

/// V-T5. Two spheres on each edge: landing on one that lies across the slope, both carry the same force, and
/// the moment about the point between their contacts closes: T + (x - P) x F = 0 in every step.
#[test]
fn the_moment_about_the_contact_of_an_edge_closes_in_every_step() {
    let slope = 25_f64.to_radians();
    let mut bench =
        Bench::new(&plane(25.0, [-10.0, 30.0], 3, 3), &cube(8, turned(25.0 + 45.0), 0.5, 0.6), true);
    let gravity = Vector3::new(0.0, 0.0, -G);
    let normal = Vector3::new(slope.sin(), 0.0, slope.cos());
    let (mut steps, mut worst, mut size) = (0, 0.0_f64, 0.0_f64);
    let step = bench.solver.model().steps.step;
    while steps < 200 {
        let before = bench.solver.state().bodies[0].motion;
        bench.advance(step);
        let body = &bench.solver.state().bodies[0];
        let rock = &bench.solver.model().rocks[0];
        let force = (body.motion.acceleration - gravity) * rock.mass;
        if force.norm() == 0.0 {
            assert!(bench.time < 2.0, "never touched");
            continue;
        }
        steps += 1;
        // Where the forces were evaluated: half a step from the start, the orientation likewise.
        let middle = before.position + before.velocity * (0.5 * step);
        let turn = turn(&before.orientation, &before.angular_momentum, &rock.inertia, 0.5 * step);
        let origin = bench.solver.model().origin;
        let lowest = rock
            .spheres
            .iter()
            .map(|s| (middle + turn * s.centre + origin).dot(&normal))
            .fold(f64::MAX, f64::min);
        let low: Vec<Vector3<f64>> = rock
            .spheres
            .iter()
            .map(|s| middle + turn * s.centre)
            .filter(|c| ((c + origin).dot(&normal) - lowest).abs() < 1e-9)
            .collect();
        assert_eq!(low.len(), 2, "two spheres carry");
        let centre = (low[0] + low[1]) * 0.5;
        let point = centre - normal * (centre + origin).dot(&normal);
        let lever = (point - middle).cross(&force);
        worst = worst.max((body.motion.torque - lever).norm());
        size = size.max(lever.norm());
    }
    println!("moment about the contact: {worst:.2e} of {size:.2e} N m in {steps} steps");
    assert!(worst < 1e-8 * size, "{worst:.2e} of {size:.2e}");
}

/// V-T5. Energy that is not dissipated never grows by more than the integrator's own error: with 50 steps in
/// a contact, (w h)^2 / 24 of the energy in a contact, here 2e-4.
#[test]
fn the_energy_of_a_cube_that_lands_on_an_edge_or_a_face_never_grows() {
    for (name, turn) in [("edge", 70.0), ("face", 25.0)] {
        let mut bench =
            Bench::new(&plane(25.0, [-10.0, 60.0], 3, 3), &cube(64, turned(turn), 0.5, 0.6), true);
        let (start, mut last, mut gain) = (bench.energy(), bench.energy(), 0.0_f64);
        let mut kinetic = 0.0_f64;
        for _ in 0..2000 {
            bench.advance(1e-3);
            let energy = bench.energy();
            gain = gain.max(energy - last);
            last = last.min(energy);
            kinetic = kinetic.max(bench.value("energy_kinetic_dem"));
            let sum = energy + bench.value("energy_dissipated_dem");
            assert!((sum - start).abs() < 1e-3 * kinetic.max(1.0), "{name}: balance {sum} {start}");
        }
        println!("{name}: largest gain {gain:.2e} J of {kinetic:.2e} J, lost {:.3e} J", start - last);
        assert!(gain < 2e-4 * kinetic, "{name}: {gain:.2e} of {kinetic:.2e}");
        assert!(start - last > 0.1 * kinetic);
    }
}

/// Terrain with kinks, a cube of 64 spheres that lands on it without dashpot and friction: what its energy errs by in the contact. The nearest
/// selection lets contacts set in with a finite overlap, whatever the step; the continuous one leaves the integrator's error,
/// of second order.
#[test]
fn over_rough_ground_the_energy_error_falls_with_the_step_where_the_selection_is_continuous() {
    let mut mesh = plane(0.0, [-4.0, 4.0], 32, 80);
    let mut seed = 3;
    mesh.nodes.iter_mut().for_each(|n| n.z += 0.06 * crate::bench::random(&mut seed));
    let imbalance = |selection: &str, steps: f64, number: u32| {
        let turn = [1.0, 0.3, 0.1 * f64::from(number), -0.2];
        let scene = cube(64, turn, 1.0, 0.0).replace("young = 1e9", "young = 2e8")
            + &format!("[dem]\ncontact_selection = \"{selection}\"\nsteps_per_contact = {steps:?}\n");
        let mut bench = Bench::new(&mesh, &scene, true);
        let (start, mut worst, mut kinetic, mut touched) = (bench.energy(), 0.0_f64, 0.0_f64, false);
        loop {
            bench.advance(2e-3);
            worst = worst.max((bench.energy() - start).abs());
            kinetic = kinetic.max(bench.value("energy_kinetic_dem"));
            touched |= bench.value("contacts") > 0.0;
            if touched && bench.value("contacts") == 0.0 {
                return worst / kinetic;
            }
            assert!(bench.time < 2.0, "lands and leaves");
        }
    };
    let mean =
        |selection: &str, steps: f64| (0..8).map(|k| imbalance(selection, steps, k)).sum::<f64>() / 8.0;
    let [coarse, fine] = [50.0, 200.0].map(|steps| mean("continuous", steps));
    let [jumps, still] = [50.0, 200.0].map(|steps| mean("nearest", steps));
    println!("continuous: {coarse:.1e}, {fine:.1e}; nearest: {jumps:.1e}, {still:.1e}");
    let order = (coarse / fine).log2() / 2.0;
    assert!(order > 1.5, "order {order:.2}: {coarse:.2e} {fine:.2e}");
    assert!(still > 0.3 * jumps && still > 10.0 * fine, "the nearest one: {jumps:.2e} {still:.2e}");
}
