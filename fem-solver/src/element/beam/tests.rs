use super::*;
use crate::element::tests::checks::{Case, random};
use nalgebra::UnitQuaternion;

fn beam() -> Beam {
    let span = Vector3::new(0.6, 0.3, 0.2);
    let a = span.cross(&Vector3::z()).normalize();
    Beam {
        nodes: [0, 1],
        span,
        axes: [a, span.cross(&a).normalize()],
        area: 1e-3,
        axial: 3e5,
        bending: [2e3, 5e3],
        torsion: 1e3,
        line_mass: 8.0,
        gyration: 0.05,
        radius: 0.0,
        rupture: Rupture::NEVER,
        fibres: None,
    }
}

/// A beam of HE 160 B in S235, 1 m long.
fn steel_beam(hardening: f64) -> Beam {
    let (section, young) = (Section::named("HE 160 B").expect("is known"), 2.1e11);
    let law =
        Law { hardening: vec![(0.0, 235e6), (1.0, 235e6 + hardening)], ..Law::elastic(young, 0.0, false) };
    let beam = beam();
    Beam {
        span: beam.span / beam.span.norm(),
        area: section.area(),
        axial: young * section.area(),
        bending: section.inertia().map(|i| young * i),
        torsion: young / 2.6 * section.torsion,
        line_mass: 42.6,
        fibres: Some(Arc::new(Fibres::new(section, law))),
        ..beam
    }
}

fn respond(beam: &Beam, u: &[f64], history: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (mut force, mut after) = (vec![0.0; 12], history.to_vec());
    let mut answer =
        Answer { force: &mut force, tangent: None, slack: Slack::Exact, history: &mut after, tension: 0.0 };
    beam.respond(Pace::default(), u, history, &mut answer);
    (force, after)
}

/// Displacements by a stretch [m] and turns of the ends about both cross axes and the beam [rad].
fn strained(beam: &Beam, stretch: f64, turns: [[f64; 3]; 2]) -> [f64; 12] {
    let along = beam.span.normalize();
    let turn = |[a, b, t]: [f64; 3]| beam.axes[1] * a + beam.axes[0] * b + along * t;
    let [first, second] = turns.map(turn);
    let mut u = [0.0; 12];
    for (at, vector) in [(3, first), (6, along * stretch), (9, second)] {
        u[at..at + 3].copy_from_slice(vector.as_slice());
    }
    u
}

#[test]
fn where_it_yields_force_and_tangent_are_derivatives_of_what_it_stores_and_dissipates() {
    let (beam, mut noise, mut flowed) = (steel_beam(2e9), random(7), 0);
    let positions = [Vector3::zeros(), beam.span];
    for _ in 0..20 {
        let mut draw = |size: f64| {
            let mut turn = || [0, 1, 2].map(|_| size * noise());
            let turns = [turn(), turn()];
            strained(&beam, 0.4 * size * noise(), turns)
        };
        let (_, mut history) = respond(&beam, &draw(0.05), &beam.start_history());
        let u = draw(0.06);
        // Moments in space are derivatives along turns from where the nodes are.
        let turned = respond(&beam, &u, &history).1;
        history[..BROKEN].copy_from_slice(&turned[..BROKEN]);
        flowed += usize::from(history[PLASTIC] > 0.0);
        let case = Case::new(&beam, &positions, &u).with_history(&history);
        case.derivatives();
        case.rigid_motion();
    }
    assert!(flowed > 15, "{flowed}");
}

#[test]
fn before_its_first_fibre_flows_it_is_the_elastic_beam_of_its_section() {
    let beam = steel_beam(0.0);
    let elastic = Beam { fibres: None, ..beam.clone() };
    for size in [1e-3, 3e-3, 6e-3] {
        let u = strained(&beam, 0.05 * size, [[size, 0.5 * size, size], [-size, 0.2 * size, 0.0]]);
        let (own, after) = respond(&beam, &u, &beam.start_history());
        let (other, _) = respond(&elastic, &u, &elastic.start_history());
        if after[PLASTIC] == 0.0 {
            let largest = other.iter().fold(0.0, |a: f64, f| a.max(f.abs()));
            assert!(own.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-9 * largest), "{size}");
        } else {
            assert!(size > 1e-3, "yields at {size}");
        }
    }
}

#[test]
fn bent_and_pulled_far_it_bears_what_its_plastic_section_bears_and_the_work_is_in_its_books() {
    // Rectangles: m = 1 - n^2 holds for the web of an H; here each alone, and both, against sums over the fibres by hand.
    let beam = steel_beam(0.0);
    let fibres = beam.fibres.as_ref().expect("yields").clone();
    let stress = 235e6;
    for (stretch, turn) in [(0.0, 0.2), (0.05, 0.0), (0.004, 0.2)] {
        let (steps, mut u, mut history) = (400, vec![0.0; 12], beam.start_history());
        let (mut work, mut force) = (0.0, vec![0.0; 12]);
        for step in 1..=steps {
            let part = f64::from(step) / f64::from(steps);
            let next = strained(&beam, stretch * part, [[turn * part, 0.0, 0.0], [-turn * part, 0.0, 0.0]]);
            let (after, now) = respond(&beam, &next, &history);
            let mean = |i: usize| 0.5 * (force[i] + after[i]);
            work += (0..12).map(|i| mean(i) * (next[i] - u[i])).sum::<f64>();
            (u, history, force) = (next.to_vec(), now, after);
        }
        let mut forces = [0.0];
        beam.line_forces(&u, &history, &mut forces);
        let moment = beam.moments(&u, &history)[0].abs();
        // All fibres flow to the side on which they lie of the line without strain, at so much below the middle.
        let line = stretch / (2.0 * turn).max(1e-12);
        let sign = |a: f64| if a + line > 0.0 { stress } else { -stress };
        let sum = |of: &dyn Fn(f64) -> f64| -> f64 {
            fibres.section.fibres.iter().map(|f| f.area * of(f.at[0])).sum()
        };
        let (n, m) = (sum(&|a| sign(a)), sum(&|a| sign(a) * a).abs());
        let scale = (stress * fibres.section.area(), stress * fibres.section.plastic()[0]);
        // Fibres next to that line stay elastic: 1 % at a curvature of 0.4/m.
        assert!((forces[0] - n).abs() < 0.01 * scale.0, "{} N, {n} N", forces[0]);
        assert!((moment - m).abs() < 0.01 * scale.1, "{moment} N m, {m} N m");
        let energy = beam.energy(&u, &history);
        assert!((work / (energy.stored + energy.dissipated) - 1.0).abs() < 1e-3, "{work} J, {energy:?}");
        assert!(energy.dissipated > 0.9 * work);
        // The share of the plastic section is what it bears.
        let share = forces[0].abs() / scale.0 + moment / scale.1;
        assert!((beam.plastic_utilisation(&u, &history) - share).abs() < 1e-6);
        // Back by a little: with the slope of the elastic beam.
        let back = strained(&beam, stretch, [[turn - 1e-4, 0.0, 0.0], [-turn + 1e-4, 0.0, 0.0]]);
        let unloaded = beam.moments(&back, &history)[0].abs();
        if turn > 0.0 {
            let slope = (moment - unloaded) / (2e-4 * beam.bending[0]);
            assert!((slope - 1.0).abs() < 0.02, "{slope}");
        }
    }
}

/// A history in which both nodes have turned by some vector, and the turn as degrees of freedom.
fn turned(turns: [Vector3<f64>; 2]) -> Vec<f64> {
    let mut history = beam().start_history();
    for (node, turn) in turns.iter().enumerate() {
        let q = UnitQuaternion::new(*turn);
        history[node * TURN + 3..][..4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
    }
    history
}

#[test]
fn derivatives_rigid_motions_and_mass_are_consistent_at_any_rotation() {
    let beam = beam();
    let mut noise = random(4);
    for _ in 0..20 {
        let whole = Vector3::new(noise(), noise(), noise()) * 5.0;
        let turn = UnitQuaternion::new(whole);
        let mut u = [0.0; 12];
        let moved = turn * beam.span - beam.span;
        for c in 0..3 {
            u[c] = 0.02 * noise();
            u[6 + c] = moved[c] + 0.02 * noise();
        }
        let small = || Vector3::new(0.3, -0.2, 0.25);
        let second = UnitQuaternion::new(small()) * turn;
        let history = turned([whole, second.scaled_axis()]);
        let positions = [Vector3::zeros(), beam.span];
        Case::new(&beam, &positions, &u).with_history(&history).check_all(beam.line_mass * beam.rest());
    }
}

#[test]
fn an_end_that_turns_across_its_chord_and_beyond_keeps_one_energy() {
    // 80 to 100 degrees, on both sides of where the parabola begins.
    let (beam, positions) = (beam(), [Vector3::zeros(), beam().span]);
    for degrees in [80.0_f64, 84.0, 84.5, 89.0, 91.0, 100.0] {
        let turn = beam.axes[1] * degrees.to_radians();
        let history = turned([turn, turn * 0.9]);
        Case::new(&beam, &positions, &[0.0; 12]).with_history(&history).derivatives();
    }
    let step = 1e-7;
    for s in [0.5, STEEPEST - step, STEEPEST + step, 0.9999] {
        let [(before, ..), (_, slope, bend), (after, ..)] = [arc(s - step), arc(s), arc(s + step)];
        // Third derivative below 3 / (1 - s^2)^2.5 = 3e5; rounding eps / h, and eps / h^2 of the curvature.
        assert!(((after - before) / (2.0 * step) - slope).abs() < 3e5 * step * step + 1e-8);
        assert!(((arc(s + step).1 - arc(s - step).1) / (2.0 * step) - bend).abs() < 3e5 * step + 1e-6, "{s}");
        assert_eq!(arc(-s), (-arc(s).0, slope, -bend));
    }
}

#[test]
fn small_deformations_have_the_stiffness_of_the_textbook() {
    // Patch: pure bending, pure twist, pure stretch of 1e-6; errors are of second order.
    let beam = beam();
    let (l, t) = (beam.span.norm(), beam.span.normalize());
    let mut u = [0.0; 12];
    let about = beam.axes[1] * 1e-6;
    (0..3).for_each(|c| (u[3 + c], u[9 + c]) = (-about[c], about[c]));
    let bent = Case::new(&beam, &[], &u).force();
    // Turning about the second cross axis bends in the plane of the first.
    let moment = vector(&bent, 9);
    assert!((moment - beam.bending[0] * 2.0 / l * about).norm() < 1e-6 * moment.norm(), "{moment}");
    let mut u = [0.0; 12];
    (0..3).for_each(|c| u[9 + c] = 1e-6 * t[c]);
    let twisted = Case::new(&beam, &[], &u).force();
    assert!((vector(&twisted, 9) - beam.torsion / l * 1e-6 * t).norm() < 1e-9 * beam.torsion * 1e-6);
    let mut u = [0.0; 12];
    (0..3).for_each(|c| u[6 + c] = 1e-6 * t[c]);
    let pulled = Case::new(&beam, &[], &u).force();
    assert!((vector(&pulled, 6) - beam.axial / l * 1e-6 * t).norm() < 1e-8 * beam.axial * 1e-6);
}
