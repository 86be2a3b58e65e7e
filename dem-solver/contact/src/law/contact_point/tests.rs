//! Two bodies driven through one impact by the law alone, with the solver's scheme (position Verlet).
//!
//! The lever arms are the whole radii, as the tables have it: they stand for the limit of a small
//! overlap.

use super::*;
use crate::law::damping::Damping;
use crate::law::elastic::{Elastic, stiffness_ratio};
use crate::law::normal::Normal;
use crate::law::normal::hertz::Hertz;
use crate::law::restitution::ratio;
use crate::law::tangential::Tangential;
use crate::settings::{EffectiveMass, TangentialName};
use std::f64::consts::PI;

/// A sphere; its normal points along -z, it moves in x and z and turns about y.
#[derive(Debug, Clone, Copy)]
struct Ball {
    radius: f64,
    mass: f64,
    /// Along x and along the normal [m/s].
    velocity: [f64; 2],
    /// About y [rad/s].
    spin: f64,
}

impl Ball {
    fn new(radius: f64, density: f64) -> Self {
        Self { radius, mass: 4.0 / 3.0 * PI * radius.powi(3) * density, velocity: [0.0; 2], spin: 0.0 }
    }
}

/// Ball `a` touches `b` (infinite radius and mass: a mesh) until they part, `steps` in an undamped contact.
fn impact(law: &Law, a: &mut Ball, b: &mut Ball, steps: f64) {
    let radius = 1.0 / (1.0 / a.radius + 1.0 / b.radius);
    let mass = 1.0 / (1.0 / a.mass + 1.0 / b.mass);
    let speed = a.velocity[1] - b.velocity[1];
    let h = law.normal.impact(radius, mass, speed).1 / steps;
    let dashpot = law.damping.map_or(0.0, |d| 2.0 * d.ratio * mass.sqrt());
    let mut overlap = 0.0;
    let mut past = History::default();
    // Acceleration of each ball along x, along the normal, about y.
    let mut last = [[0.0_f64; 3]; 2];
    loop {
        let rate = |i: usize, ball: &Ball| {
            let v = |c: usize| ball.velocity[c] + 0.5 * h * last[i][c];
            [v(0), v(1), ball.spin + 0.5 * h * last[i][2]]
        };
        let (u, w) = (rate(0, a), rate(1, b));
        overlap += 0.5 * h * (a.velocity[1] - b.velocity[1]);
        if overlap <= 0.0 {
            return;
        }
        // The contact point of the first is at -R z from its centre, where spin s about y moves it by
        // -R s along x; that of the other at +R z.
        let rolls = |spin: f64, r: f64| if r.is_finite() { spin * r } else { 0.0 };
        let slip = u[0] - rolls(u[2], a.radius) - (w[0] + rolls(w[2], b.radius));
        let meeting = ContactPoint {
            normal: -Vector3::z(),
            overlap,
            radius,
            velocity: Vector3::new(slip, 0.0, -(u[1] - w[1])),
            spin: Vector3::zeros(),
            inertia: 0.0,
            dashpot,
            jump: Vector3::zeros(),
        };
        let answer = law.respond(&meeting, &past, h);
        past = answer.history(overlap);
        let (along, normal) = (answer.force.x, -answer.force.z);
        for (i, (ball, sign)) in [(&mut *a, 1.0), (&mut *b, -1.0)].into_iter().enumerate() {
            // Both sides are turned alike: -R z x f and +R z x (-f).
            let turned = if ball.radius.is_finite() { -along / (0.4 * ball.mass * ball.radius) } else { 0.0 };
            last[i] = [sign * along / ball.mass, sign * normal / ball.mass, turned];
            ball.velocity[0] += h * last[i][0];
            ball.velocity[1] += h * last[i][1];
            ball.spin += h * last[i][2];
        }
        overlap += 0.5 * h * (a.velocity[1] - b.velocity[1]);
    }
}

const WALL: Ball = Ball { radius: f64::INFINITY, mass: f64::INFINITY, velocity: [0.0; 2], spin: 0.0 };

const VARIANTS: [TangentialName; 3] =
    [TangentialName::Incremental, TangentialName::UnloadingScaled, TangentialName::Secant];

fn law(sides: Elastic, friction: f64, restitution: f64, history: TangentialName) -> Law {
    let ratio = if restitution < 1.0 { ratio(restitution, 2.5) } else { 0.0 };
    Law {
        yielding: None,
        growing: None,
        scarring: None,
        whole: false,
        normal: Normal::HertzMindlin(Hertz { modulus: sides.modulus() }),
        damping: (ratio > 0.0).then_some(Damping { ratio, mass: EffectiveMass::Rock }),
        tangential: (friction > 0.0).then_some(Tangential {
            friction,
            stiffness_ratio: sides.stiffness_ratio(),
            history,
            stiffening: 0.5,
            sliding: None,
        }),
        rolling: None,
        resistance: None,
    }
}

/// V-D1, the rows of two spheres, in steps: 1000 per contact, second order.
#[test]
fn two_equal_spheres_part_as_fast_as_they_met_and_exchange_what_they_had() {
    for (young, nu, density) in [(20e9, 0.25, 2500.0), (48e9, 0.20, 2800.0)] {
        let side = (young, nu);
        let it = law(Elastic { own: side, other: Some(side) }, 0.0, 1.0, VARIANTS[1]);
        let (mut a, mut b) = (Ball::new(0.01, density), Ball::new(0.01, density));
        (a.velocity[1], b.velocity[1]) = (15.0, -5.0);
        impact(&it, &mut a, &mut b, 1000.0);
        assert!((a.velocity[1] + 5.0).abs() < 1e-4 && (b.velocity[1] - 15.0).abs() < 1e-4, "{a:?} {b:?}");
    }
}

/// V-D5: all three variants. Accepted there: 2e-3 of e_t, and what follows for the spin from
/// `w' = 5/2 (1 - e_t) v_t / R`. Sticking at 5 degrees converges slowest: with 2e4 steps variant I is
/// still 1.3e-3 above the table, all others are within 4e-4.
#[test]
fn a_sphere_that_sticks_rebounds_as_each_variant_has_it() {
    let table = [
        (5.0, [(0.8888, -37.8), (0.8574, -48.5), (0.9491, -17.3)]),
        (10.0, [(0.7173, -191.4), (0.7145, -193.4), (0.7022, -201.7)]),
        (15.0, [(0.6308, -372.6), (0.6349, -368.6), (0.6334, -370.1)]),
        (20.0, [(0.6120, -517.6), (0.6225, -503.5), (0.6225, -503.5)]),
        (25.0, [(0.6292, -611.1), (0.6394, -594.4), (0.6394, -594.4)]),
        (30.0, [(0.6847, -614.7), (0.6847, -614.8), (0.6847, -614.8)]),
    ];
    for (degrees, columns) in table {
        for (history, (e_t, spin)) in VARIANTS.into_iter().zip(columns) {
            let it = law(Elastic { own: (380e9, 0.23), other: None }, 0.092, 0.98, history);
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let (mut a, mut contact_mesh) = (Ball::new(2.5e-3, 4000.0), WALL);
            a.velocity = [3.9 * sin, 3.9 * cos];
            impact(&it, &mut a, &mut contact_mesh, 2e4);
            let share = a.velocity[0] / (3.9 * sin);
            let accepted = if degrees < 6.0 { 2e-3 } else { 4e-4 };
            assert!((share - e_t).abs() < accepted, "{degrees} {history:?}: e_t {share} instead of {e_t}");
            // The sign of the table is the other way round.
            let accepted = 2.5 * accepted * 3.9 * sin / 2.5e-3 + 0.06;
            assert!((a.spin + spin).abs() < accepted, "{degrees} {history:?}: {} instead of {spin}", a.spin);
        }
    }
}

/// V-D6, all variants, with the mesh rigid in shear; and variant I with the shear modulus halved, as the
/// published benchmark has it. Printed to four and three digits.
#[test]
fn the_contact_point_rebounds_as_each_variant_has_it() {
    let steel = Elastic { own: (208e9, 0.3), other: None };
    let rebound = |it: &Law, psi1: f64| {
        let (mut a, mut contact_mesh) = (Ball::new(1e-5, 7850.0), WALL);
        a.velocity = [psi1 * 0.3 * 5.0, 5.0];
        impact(it, &mut a, &mut contact_mesh, 2e4);
        ((a.velocity[0] - 1e-5 * a.spin) / (0.3 * 5.0), -a.spin * 1e-5 / (0.3 * 5.0))
    };
    let table = [
        (0.33, [0.2631, 0.1685, 0.3147]),
        (1.0, [0.5035, 0.4150, 0.6668]),
        (2.0, [-0.1756, -0.1908, -0.2763]),
        (3.0, [-1.0430, -0.9886, -1.0013]),
        (4.0, [-1.5599, -1.3980, -1.3980]),
        (5.0, [-1.6358, -1.4356, -1.4356]),
        (6.0, [-1.0000, -0.9814, -0.9814]),
        (10.0, [3.0, 3.0, 3.0]),
    ];
    for (psi1, columns) in table {
        for (history, psi2) in VARIANTS.into_iter().zip(columns) {
            let (seen, w) = rebound(&law(steel, 0.3, 1.0, history), psi1);
            assert!((seen - psi2).abs() < 1e-3, "Psi1 {psi1} {history:?}: {seen} instead of {psi2}");
            assert!(psi1 < 10.0 || (w + 5.0).abs() < 1e-3, "W {w}");
        }
    }
    let mut halved = law(steel, 0.3, 1.0, TangentialName::Incremental);
    halved.tangential.as_mut().expect("friction").stiffness_ratio = 0.5 * stiffness_ratio(0.3);
    for (psi1, psi2) in
        [(1.009, -0.708), (2.0, -1.504), (2.991, -2.398), (3.34, -2.626), (4.006, -2.742), (5.0, -2.0)]
    {
        let (seen, _) = rebound(&halved, psi1);
        assert!((seen - psi2).abs() < 2e-3, "halved, Psi1 {psi1}: {seen} instead of {psi2}");
    }
}

/// Velocity of the contact point after the impact of a sphere that only spins, over the one before.
fn spinning(it: &Law, a: &Ball, b: &Ball, parameter: f64) -> f64 {
    let (mut a, mut b) = (*a, *b);
    // Spin parameter: w0 R / v_n over the friction coefficient.
    let before = parameter * 0.4 * 0.2;
    a.spin = before / a.radius;
    (a.velocity, b.velocity) = ([0.0, 0.2], [0.0, 0.0]);
    impact(it, &mut a, &mut b, 4e3);
    let surface = a.velocity[0]
        - a.spin * a.radius
        - (b.velocity[0] + if b.radius.is_finite() { b.spin * b.radius } else { 0.0 });
    surface / before
}

/// V-D7, test 6 and 8. Gross sliding is exact, whatever the variant: the contact point loses
/// `7/2 mu (1 + e) v_n`.
#[test]
fn a_spinning_sphere_that_slides_throughout_loses_what_friction_can_take() {
    let side = (70e9, 0.33);
    for history in VARIANTS {
        let it = law(Elastic { own: side, other: None }, 0.4, 0.5, history);
        for parameter in [6.0, 12.0] {
            let seen = spinning(&it, &Ball::new(0.1, 2700.0), &WALL, parameter);
            let exact = -1.0 + 3.5 * 1.5 / parameter;
            assert!((seen - exact).abs() < 1e-3, "{parameter}: {seen} instead of {exact}");
        }
    }
}

/// V-D7, test 8: a partner five times as large, a thousand times as dense and as stiff is a mesh but for
/// its curvature, which cancels in the dimensionless answer; its mass is 1.25e5 times as large, its
/// modulus adds 1e-3 of compliance, to which all parts respond alike.
#[test]
fn a_far_heavier_and_stiffer_partner_is_a_wall() {
    let side = (70e9, 0.33);
    for history in VARIANTS {
        let contact_mesh = law(Elastic { own: side, other: None }, 0.4, 0.5, history);
        let heavy = law(Elastic { own: side, other: Some((70e12, 0.33)) }, 0.4, 0.5, history);
        for parameter in [0.3, 1.0, 2.0, 4.0, 8.0] {
            let a = Ball::new(0.1, 2700.0);
            let on_mesh = spinning(&contact_mesh, &a, &WALL, parameter);
            let on_ball = spinning(&heavy, &a, &Ball::new(0.5, 2.7e6), parameter);
            assert!((on_mesh - on_ball).abs() < 1e-4, "{parameter} {history:?}: {on_mesh} {on_ball}");
        }
    }
}

/// V-D7, test 7: the contact points move together, so that nothing slips.
#[test]
fn two_spheres_that_turn_like_gears_do_not_rub() {
    let side = (70e9, 0.33);
    for history in VARIANTS {
        let it = law(Elastic { own: side, other: Some(side) }, 0.4, 0.5, history);
        let (mut a, mut b) = (Ball::new(0.1, 2700.0), Ball::new(0.1, 2700.0));
        (a.velocity, b.velocity) = ([0.0, 0.2], [0.0, -0.2]);
        (a.spin, b.spin) = (3.0, -3.0);
        impact(&it, &mut a, &mut b, 200.0);
        assert_eq!([a.velocity[0], b.velocity[0], a.spin, b.spin], [0.0, 0.0, 3.0, -3.0]);
        // e is that of the contact.
        assert!((a.velocity[1] + 0.1).abs() < 2e-3, "{}", a.velocity[1]);
    }
}
