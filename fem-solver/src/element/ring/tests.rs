//! The laws against their own formulas; the element against differences; one ring of wire against fibres.

use super::mechanisms::Mechanism;
use super::tightening::{Bundle, Strength, Tightening};
use super::*;
use crate::element::Slack;
use crate::element::tests::checks::{Case, random};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Seven turns of 3 mm, 0.3 m wide.
const BUNDLE: Bundle = Bundle { turns: 7.0, wire: 3e-3, diameter: 0.3, young: 1.5e11, yields: 1.7e9 };

/// So many points on a circle of 0.3 m.
fn on_circle(count: usize) -> Vec<Vector3<f64>> {
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
    (0..count).map(|i| 0.15 * Vector3::new(angle(i).cos(), angle(i).sin(), 0.0)).collect()
}

/// From each to the next.
fn spans<const N: usize>(points: &[Vector3<f64>]) -> [Vector; N] {
    from_fn(|i| (points[(i + 1) % N] - points[i]).into())
}

fn ring_of(law: RingLaw, count: usize, mass: f64) -> Ring {
    Ring { nodes: (0..count).collect(), law, section: 0.0, mass, radius: 0.0 }
}

/// A ring of wire with its contacts on its circle.
fn wire_ring(contacts: usize, strength: Strength) -> (Ring, Vec<Vector3<f64>>) {
    let points = on_circle(contacts);
    let law = match contacts {
        2 => RingLaw::WireTwo(Wire::new(&BUNDLE, spans(&points), strength)),
        3 => RingLaw::WireThree(Wire::new(&BUNDLE, spans(&points), strength)),
        _ => RingLaw::WireFour(Wire::new(&BUNDLE, spans(&points), strength)),
    };
    (ring_of(law, contacts, 0.37), points)
}

const NEVER: f64 = f64::INFINITY;

#[test]
fn derivatives_rigid_motions_and_mass_of_wire_are_consistent() {
    let mut noise = random(9);
    for contacts in [2, 3, 4] {
        let (ring, points) = wire_ring(contacts, Strength::even(NEVER));
        for size in [0.03, 0.1, 0.4] {
            for drawn in [0.0, 0.06, 0.12] {
                let u: Vec<f64> = (0..3 * contacts).map(|_| size * noise()).collect();
                Case::new(&ring, &points, &u).with_history(&[0.0, 0.0, drawn]).check_all(0.37);
            }
        }
    }
}

#[test]
fn a_tight_ring_keeps_its_derivatives() {
    for contacts in [2, 3, 4] {
        let (ring, points) = wire_ring(contacts, Strength::even(NEVER));
        let taut = PI * 0.3 / Tightening::new(&BUNDLE, contacts).round;
        for part in [0.9, 0.99, 1.0, 1.002] {
            let u: Vec<f64> = points.iter().flat_map(|p| <[f64; 3]>::from(p * (part * taut - 1.0))).collect();
            Case::new(&ring, &points, &u).check_all(0.37);
        }
    }
}

#[test]
fn force_and_slope_have_no_jump() {
    for contacts in [2, 3, 4] {
        let law = Tightening::new(&BUNDLE, contacts);
        for most in [0.0, 0.8 * law.first_yield(), 1.5 * law.first_yield()] {
            let largest = f64::max(most, law.first_yield());
            let mut joints = vec![largest];
            joints.extend((0..4000).map(|i| (f64::from(i) / 3000.0 - 0.2) * largest));
            for e in joints {
                let h = 1e-9;
                let [before, after] = [-h, h].map(|h| law.pull(e + h, most));
                let scale = f64::max(before.slope, after.slope);
                // A kink would differ by a share of the slope; curvature differs by h / (the rounding of the corner).
                assert!((after.force - before.force).abs() <= 2.1 * h * scale, "{contacts} {e}");
                assert!(
                    (after.slope - before.slope).abs() <= 1e-3 * law.pull(largest, 0.0).slope,
                    "{contacts} {e}"
                );
            }
        }
    }
}

#[test]
fn a_round_ring_is_as_stiff_at_first_as_an_elastic_ring() {
    // Two points: E I / (0.149 R^3) of the diameter, which draws out twice as much polygon with half the force in a strand.
    let law = Tightening::new(&BUNDLE, 2);
    let stiffness = BUNDLE.first_stiffness();
    assert!((stiffness * 0.149 * 0.15_f64.powi(3) / (7.0 * 0.596412) - 1.0).abs() < 2e-3);
    let slope = law.pull(0.04 * law.first_yield(), 0.0).slope;
    assert!((4.0 * slope / stiffness - 1.0).abs() < 0.1, "{slope} {stiffness}");
    // Of the oval of a ring with four contacts, to the last digit.
    let (ring, _) = wire_ring(4, Strength::even(NEVER));
    let u = 1e-6;
    let pulled = [u, 0.0, 0.0, 0.0, -u, 0.0, -u, 0.0, 0.0, 0.0, u, 0.0];
    let stored = ring.energy(&pulled, &ring.start_history()).stored;
    assert!((stored / (0.5 * stiffness * (2.0 * u) * (2.0 * u)) - 1.0).abs() < 1e-3, "{stored}");
}

#[test]
fn a_plastic_ring_pulls_by_its_gap_and_what_it_takes_is_kept_or_dissipated() {
    for contacts in [2, 3, 4] {
        let law = Tightening::new(&BUNDLE, contacts);
        let (mp, stretch) = (BUNDLE.plastic_moment(), PI * 0.3 / (1.5e11 * BUNDLE.area()));
        let free = (PI * 0.3 - law.round) * (1.0 - BUNDLE.thickness() / 0.3);
        let (mut work, mut before, steps) = (0.0, law.pull(-0.02, 0.0), 40_000);
        let (from, to) = (-0.02, 1.01 * free);
        for i in 1..=steps {
            let e = from + (to - from) * f64::from(i) / f64::from(steps);
            let now = law.pull(e, before.most);
            work += 0.5 * (before.force + now.force) * (to - from) / f64::from(steps);
            if e > law.first_yield() {
                let gap = free - e + stretch * now.force;
                assert!((now.force * gap / (2.0 * mp) - 1.0).abs() < 1e-9);
            }
            let energy = law.energy(e, now.most);
            assert!(
                (energy.0 + energy.1 - work).abs() < 1e-4 * work.max(1.0),
                "{contacts} {e}: {work} {energy:?}"
            );
            assert!(energy.1 >= -1e-12);
            before = now;
        }
        // All the way back: what is left is what was dissipated, and a slack ring pulls with nothing.
        let most = before.most;
        let mut back = 0.0;
        for i in (0..steps).rev() {
            let e = from + (to - from) * f64::from(i) / f64::from(steps);
            let now = law.pull(e, most);
            back += 0.5 * (before.force + now.force) * (to - from) / f64::from(steps);
            before = now;
        }
        let (stored, dissipated) = law.energy(from, most);
        assert_eq!((before.force, before.slope, stored), (0.0, 0.0, 0.0));
        assert!((work - back - dissipated).abs() < 1e-4 * work, "{contacts}: {work} {back} {dissipated}");
    }
}

/// Rings of wires of elastic-plastic fibres with isotropic hardening (1 445 MPa, 1 700 at 0.5 % of plastic strain, 1 880 at 5 %), without
/// friction and thickness: share of the way to straight wires, and tension over `n 1 445 MPa d^3 / 6` [1/m].
const FIBRES: [(usize, [[f64; 2]; 8]); 3] = [
    (
        2,
        [
            [0.150, 2.74],
            [0.370, 9.26],
            [0.636, 21.95],
            [0.833, 42.87],
            [0.911, 74.07],
            [0.947, 117.63],
            [0.967, 175.58],
            [0.979, 250.0],
        ],
    ),
    (
        3,
        [
            [0.081, 2.74],
            [0.228, 9.26],
            [0.406, 21.95],
            [0.618, 42.87],
            [0.794, 74.07],
            [0.881, 117.63],
            [0.928, 175.58],
            [0.955, 250.0],
        ],
    ),
    (
        4,
        [
            [0.049, 2.74],
            [0.148, 9.26],
            [0.289, 21.95],
            [0.440, 42.87],
            [0.623, 74.07],
            [0.777, 117.63],
            [0.865, 175.58],
            [0.918, 250.0],
        ],
    ),
];

#[test]
fn a_ring_pulls_as_wires_of_fibres_do_at_two_three_and_four_points() {
    for (contacts, states) in FIBRES {
        let law = Tightening::new(&BUNDLE, contacts);
        let moment = BUNDLE.plastic_moment() * 1.445 / 1.7;
        for [part, over_moment] in states {
            // The bundle's thickness takes its share of the whole way.
            let e = part * (PI * 0.3 - law.round) * (1.0 - BUNDLE.thickness() / 0.3);
            let ratio = law.pull(e, 0.0).force / moment / over_moment;
            assert!((0.88..1.12).contains(&ratio), "{contacts} {part}: {ratio}");
        }
    }
}

#[test]
fn strength_falls_with_the_turn_through_the_shares_that_are_stated() {
    let strength = Strength::new(1e5, [0.55, 0.37]);
    for (degrees, share) in [(0.0, 1.0), (90.0, 0.55), (180.0, 0.37)] {
        assert!((strength.at(f64::to_radians(degrees)) / 1e5 - share).abs() < 1e-12, "{degrees}");
    }
    assert!(
        (0..180).all(|a| strength.at(f64::from(a).to_radians()) > strength.at(f64::from(a + 1).to_radians()))
    );
    assert_eq!(Strength::even(f64::INFINITY).at(3.0), f64::INFINITY);
}

#[test]
fn a_ring_breaks_where_it_is_turned_most_and_loses_what_it_stored() {
    for (contacts, share) in [(2, 0.37), (4, 0.55)] {
        let straight = 7.0 * 0.25 * PI * 9e-6 * 1.77e9;
        let (ring, points) = wire_ring(contacts, Strength::new(straight, [0.55, 0.37]));
        let law = Tightening::new(&BUNDLE, contacts);
        let drawn = |part: f64| -> Vec<f64> {
            points.iter().flat_map(|p| <[f64; 3]>::from(p * (part * PI * 0.3 / law.round - 1.0))).collect()
        };
        let (mut low, mut high) = (0.5, 1.1);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let breaks = ring.breaks(&drawn(middle), &mut ring.start_history());
            *(if breaks { &mut high } else { &mut low }) = middle;
        }
        let tension = ring.tension(&drawn(high), &ring.start_history());
        assert!((tension / (share * straight) - 1.0).abs() < 1e-9, "{contacts}: {tension}");
        let mut history = ring.start_history();
        history[PERIMETER] = law.pull(ring.length(&drawn(high)), 0.0).most;
        let had = ring.energy(&drawn(high), &history);
        assert!(ring.breaks(&drawn(high), &mut history));
        let has = ring.energy(&drawn(2.0), &history);
        assert!(
            has.stored.abs() < 1e-9
                && (had.stored + had.dissipated - has.dissipated).abs() < 1e-9 * has.dissipated
        );
    }
}

/// A ring of mechanisms with its nodes on a circle of 0.3 m.
fn ring(count: usize) -> (Ring, Vec<Vector3<f64>>) {
    let points = on_circle(count);
    let around = 2.0 * 0.15 * (PI / count as f64).sin() * count as f64;
    let perimeter = Mechanism::new(around * 1.02, 2e5, 3.0);
    let width = Mechanism::new(if count == 4 { 0.3 } else { 0.225 }, 1e4, 100.0);
    let law = match count {
        3 => {
            RingLaw::Three(Mechanisms { spans: spans(&points), perimeter, width, rupture: NEVER, ease: 0.0 })
        }
        _ => RingLaw::Four(Mechanisms { spans: spans(&points), perimeter, width, rupture: NEVER, ease: 0.0 }),
    };
    (ring_of(law, count, 0.8), points)
}

#[test]
fn derivatives_rigid_motions_and_mass_of_mechanisms_are_consistent() {
    let mut noise = random(9);
    for count in [3, 4] {
        let (ring, points) = ring(count);
        for _ in 0..20 {
            let u: Vec<f64> = (0..3 * count).map(|_| 0.1 * noise()).collect();
            Case::new(&ring, &points, &u).check_all(0.8);
        }
    }
}

#[test]
fn an_eased_ring_pulls_everywhere_and_its_corner_comes_back_as_the_range_narrows() {
    let exact = Mechanism::new(0.3, 1e4, 100.0);
    for ease in [1e3, 1.0, 1e-3] {
        for most in [0.0, 0.02] {
            // Slack to yielding, in steps that avoid the corners.
            for i in -40..40 {
                let l = 0.3 + most + (f64::from(i) + 0.3) * 5e-4;
                let (force, slope, now) = exact.eased_force(l, most, ease);
                let (without, then) = exact.force(l, most);
                assert!(slope > 0.0 && force >= without && force - without <= ease, "{ease} {l}: {force}");
                assert_eq!(now, then);
                let h = 1e-8;
                let difference = (exact.eased_force(l + h, most, ease).0
                    - exact.eased_force(l - h, most, ease).0)
                    / (2.0 * h);
                let rounding = 16.0 * f64::EPSILON * (force / h + slope / h);
                assert!(
                    (slope - difference).abs() <= 1e-4 * slope + rounding,
                    "{ease} {l}: {slope} {difference}"
                );
            }
        }
    }
    // Where it goes slack, the force of the corner is the whole range.
    let slack = 0.3 + 0.02 * (1.0 - exact.loading / exact.unloading);
    let at_corner = exact.eased_force(slack, 0.02, 7.0).0;
    assert!((at_corner - 7.0).abs() < 1e-6, "{at_corner}");
}

#[test]
fn it_unloads_steeper_than_it_loads_and_keeps_the_difference() {
    let (ring, points) = ring(4);
    // All nodes move outwards: widths grow by 2 d, the perimeter by 4 sqrt 2 d.
    let grown = |d: f64| points.iter().flat_map(|p| <[f64; 3]>::from(p.normalize() * d)).collect::<Vec<_>>();
    let mut history = ring.start_history();
    let mut work = 0.0;
    let steps = 4000;
    let path = (1..=steps).map(|i| 0.05 * f64::from(i) / f64::from(steps));
    let mut before = (0.0, 0.0);
    for d in path.clone().chain(path.rev()) {
        let u = grown(d);
        let case = Case::new(&ring, &[], &u).with_history(&history);
        let force: f64 = case.force().iter().zip(grown(1.0)).map(|(f, g)| f * g).sum();
        work += 0.5 * (force + before.1) * (d - before.0);
        before = (d, force);
        let mut after = history.clone();
        let mut force = [0.0; 12];
        let mut answer = Answer {
            force: &mut force,
            tangent: None,
            slack: Slack::Exact,
            history: &mut after,
            tension: 0.0,
        };
        ring.respond(Pace::default(), &u, &history, &mut answer);
        history = after;
    }
    let energy = ring.energy(&grown(before.0), &history);
    assert!(energy.stored.abs() < 1e-12, "{energy:?}");
    // The trapezoidal rule over kinks: some 1e-6 of 60 J.
    assert!((work - energy.dissipated).abs() < 1e-4 * work, "{work} {energy:?}");
    let u = 0.1 + 0.0;
    let (l, w) = (4.0 * std::f64::consts::SQRT_2 * 0.2 - 0.6 * std::f64::consts::SQRT_2 * 1.02, u);
    let exact = 0.5 * 2e5 * l * l * (1.0 - 1.0 / 3.0) + 2.0 * 0.5 * 1e4 * w * w * 0.99;
    assert!((energy.dissipated / exact - 1.0).abs() < 1e-9, "{} {exact}", energy.dissipated);
}
