//! What a free turn errs, and that it loses no angular momentum.

use super::*;

/// V-D11.
const INERTIA: Vector3<f64> = Vector3::new(1.0, 2.0, 3.0);
const START: Vector3<f64> = Vector3::new(0.01, 1.0, 0.02);

fn energy(w: &Vector3<f64>) -> f64 {
    0.5 * w.dot(&INERTIA.component_mul(w))
}

/// One turn: orientation, angular momentum, moments of inertia, time.
type FreeTurn = fn(&UnitQuaternion<f64>, &Vector3<f64>, &Vector3<f64>, f64) -> UnitQuaternion<f64>;

/// Angular velocity in the body's own axes [rad/s].
fn spin(q: &UnitQuaternion<f64>, angular_momentum: &Vector3<f64>, inertia: &Vector3<f64>) -> Vector3<f64> {
    q.inverse_transform_vector(angular_momentum).component_div(inertia)
}

/// Angular velocity in body axes and orientation after `time`, and the largest relative error of energy.
fn tumble(one: FreeTurn, step: f64, time: f64) -> (Vector3<f64>, UnitQuaternion<f64>, f64) {
    let momentum = INERTIA.component_mul(&START);
    let mut q = UnitQuaternion::identity();
    let mut worst = 0.0_f64;
    for _ in 0..(time / step).round() as usize {
        q = one(&q, &momentum, &INERTIA, step);
        worst = worst.max((energy(&spin(&q, &momentum, &INERTIA)) / energy(&START) - 1.0).abs());
    }
    (spin(&q, &momentum, &INERTIA), q, worst)
}

/// V-D11: flips about the intermediate axis; the tables have ten digits. However long the steps are.
#[test]
fn orientation_and_angular_velocity_are_those_of_the_tables() {
    let table = [
        (
            10.0,
            [-0.8036645189, -0.5951666499, 0.4643908766],
            [0.1229716371, 0.2080799102, -0.4188391786, -0.8753025020],
        ),
        (
            20.0,
            [0.0846010027, -0.9964650874, 0.0524637324],
            [-0.0555622888, 0.9968157478, 0.0172940590, -0.0545170845],
        ),
        (
            40.0,
            [-0.5706208052, 0.8212745562, 0.3300040926],
            [0.9521096086, -0.2595907513, 0.1071997944, -0.1208641349],
        ),
    ];
    for (time, w, [q0, q1, q2, q3]) in table {
        for step in [0.01, 0.5, 10.0] {
            let (spin, turn, _) = tumble(turn, step, time);
            let exact = Quaternion::new(q0, q1, q2, q3).coords;
            let off = (turn.coords * turn.coords.dot(&exact).signum() - exact).amax();
            println!("t = {time}, steps of {step}: {:.1e} {off:.1e}", (spin - Vector3::from(w)).amax());
            assert!((spin - Vector3::from(w)).amax() < 1e-9, "t = {time}, step {step}: {spin}");
            assert!(off < 1e-9, "t = {time}, step {step}: {turn}");
        }
    }
}

/// The step that stands for the series where turns are short is of fourth order.
#[test]
fn the_step_of_short_turns_is_of_fourth_order() {
    let (exact, ..) = tumble(turn, 10.0, 10.0);
    let errors = [0.2, 0.1, 0.05].map(|h| (tumble(short, h, 10.0).0 - exact).amax());
    let observed = (errors[1] / errors[2]).log2();
    println!("at 0.2, 0.1, 0.05: {errors:?}, order {observed:.3}");
    // Terms of the next order are a step's turn, 0.05, of the leading one.
    assert!((observed - 4.0).abs() < 0.1, "order {observed}");
}

/// Below a thousandth of a radian a step of Runge and Kutta stands for the series: 1e-15 / 100 apart, in any position and for a
/// rod as for a plate, but for the rounding of either.
#[test]
fn small_turns_are_as_exact_as_the_series() {
    for inertia in [INERTIA, Vector3::new(1.0, 30.0, 30.5), Vector3::new(1.0, 1.02, 1.98)] {
        for k in 0..200 {
            let part = |f: f64| (f64::from(k + 1) * f).fract() - 0.5;
            let q =
                UnitQuaternion::from_euler_angles(6.0 * part(0.618), 3.0 * part(0.414), 6.0 * part(0.732));
            let momentum = Vector3::new(part(0.236), part(0.303), part(0.172));
            let h = 0.999e-3 * inertia.min() / momentum.norm();
            let [one, other] = [turn as FreeTurn, series].map(|turn| turn(&q, &momentum, &inertia, h));
            let apart = (one.coords - other.coords).norm();
            assert!(apart < 4.0 * f64::EPSILON, "{apart:.1e}");
        }
    }
}

/// A block of edges 1 : 2 : 3 that is thrown turning about its middle axis: it flips again and again, and its turns must say
/// when, however long they are. A flip late by dt after n of them is the phase error.
#[test]
fn a_block_of_edges_1_2_3_flips_about_its_middle_axis_when_it_should() {
    let inertia = Vector3::new(13.0, 10.0, 5.0);
    let momentum = inertia.component_mul(&Vector3::new(0.02, 3.0, 0.01));
    // When the spin about the middle axis changes its sign, between two steps by a straight line.
    let flips = |h: f64| {
        let (mut q, mut found, mut before) = (UnitQuaternion::identity(), Vec::new(), 3.0);
        for step in 1.. {
            q = turn(&q, &momentum, &inertia, h);
            let now = spin(&q, &momentum, &inertia).y;
            if now * before < 0.0 {
                found.push(h * (f64::from(step) - now / (now - before)));
                if found.len() == 6 {
                    return found;
                }
            }
            before = now;
        }
        unreachable!("it flips")
    };
    let exact = flips(1e-3);
    let period = exact[5] - exact[3];
    assert!((period - (exact[4] - exact[2])).abs() < 1e-5 * period, "the flips are periodic");
    let late = [4e-3, 2e-3].map(|h| (flips(h)[5] - exact[5]).abs());
    println!("flips at {exact:.4?} s; the sixth is {late:?} s off with steps of 4 and 2 ms");
    // The straight line between two steps is off by a hundred-millionth of a turn at most.
    assert!(late[0] < 1e-8, "{late:?}");
}

/// A million steps of 0.02 rad: the energy walks with rounding alone.
#[test]
fn over_a_million_steps_the_energy_does_not_drift() {
    let (.., worst) = tumble(turn, 0.02, 20_000.0);
    println!("energy off by {worst:.3e}");
    assert!(worst < 1e6 * f64::EPSILON, "{worst:.3e}");
}

/// A top in a field of force that pulls on a point of its third axis, m g l = 2, its moments not those of a symmetric one:
/// the kick takes the torque in the middle of the drift, as the solver does. The whole is of second order, its energy swings
/// and does not drift, and the moment about the vertical, which nothing changes, is kept to rounding.
#[test]
fn with_torque_a_step_is_of_second_order_and_keeps_the_moment_about_the_vertical() {
    let pull = |q: &UnitQuaternion<f64>| (q * Vector3::z()).cross(&(-Vector3::z() * 2.0));
    let run = |h: f64| {
        let mut q = UnitQuaternion::from_euler_angles(0.6, 0.2, 0.0);
        let mut momentum = q * INERTIA.component_mul(&Vector3::new(0.1, 0.3, 4.0));
        let vertical = momentum.z;
        let height = |q: &UnitQuaternion<f64>| 2.0 * (q * Vector3::z()).z;
        let total = |q: &UnitQuaternion<f64>, l: &Vector3<f64>| energy(&spin(q, l, &INERTIA)) + height(q);
        let start = total(&q, &momentum);
        let mut worst = 0.0_f64;
        for _ in 0..(4.0 / h).round() as usize {
            q = turn(&q, &momentum, &INERTIA, 0.5 * h);
            momentum += pull(&q) * h;
            q = turn(&q, &momentum, &INERTIA, 0.5 * h);
            worst = worst.max((total(&q, &momentum) / start - 1.0).abs());
        }
        assert!((momentum.z / vertical - 1.0).abs() < 1e-13, "{}", momentum.z);
        (q, worst)
    };
    // Of second order as well, at a 40th of the step.
    let (fine, _) = run(2.5e-4);
    let seen = [0.02, 0.01].map(run);
    let errors = seen.map(|(q, _)| q.angle_to(&fine));
    let order = (errors[0] / errors[1]).log2();
    println!("{errors:?} rad, order {order:.3}; energy {:.2e}, {:.2e}", seen[0].1, seen[1].1);
    assert!((order - 2.0).abs() < 0.05, "order {order}");
    let order = (seen[0].1 / seen[1].1).log2();
    assert!((order - 2.0).abs() < 0.1, "energy of order {order}");
}

#[test]
fn a_body_of_equal_moments_turns_exactly_in_one_step_or_many() {
    let momentum = Vector3::new(0.3, -2.0, 0.7);
    let inertia = Vector3::repeat(5.043);
    let start = UnitQuaternion::from_euler_angles(0.2, 0.5, -1.0);
    let once = turn(&start, &momentum, &inertia, 3.0);
    let many = (0..300).fold(start, |q, _| turn(&q, &momentum, &inertia, 0.01));
    assert!(once.angle_to(&many) < 300.0 * f64::EPSILON);
}

/// What diverges ends all the same, so that the solver can say so.
#[test]
fn an_angular_momentum_beyond_all_bounds_does_not_hang() {
    for size in [1e30, f64::INFINITY, f64::NAN] {
        let momentum = Vector3::new(size, 1.0, 1.0);
        turn(&UnitQuaternion::identity(), &momentum, &INERTIA, 1e-3);
    }
}
