use super::*;
use crate::element::tests::checks::{Case, random};

fn rope(points: &[Vector3<f64>], stretch: f64, friction: f64) -> SlidingCable {
    let spans: Vec<_> = points.windows(2).map(|p| p[1] - p[0]).collect();
    SlidingCable {
        nodes: (0..points.len()).collect(),
        lengths: spans.iter().map(|s| s.norm() / stretch).collect(),
        spans,
        young: 1e9,
        area: 1e-4,
        density: 7850.0,
        prestress: 0.0,
        friction,
        radius: 0.0,
        rupture: Rupture::NEVER,
        memory: RopeMemory::default(),
    }
}

fn points() -> Vec<Vector3<f64>> {
    [[0.0, 0.0, 0.0], [1.0, 0.2, -0.3], [1.8, 1.0, 0.1], [2.5, 1.1, 0.9], [3.0, 0.0, 1.0]]
        .map(Vector3::from)
        .into()
}

#[test]
fn derivatives_rigid_motions_and_mass_are_consistent() {
    let mut noise = random(2);
    for friction in [0.0, 0.1, 0.4] {
        for stretch in [1.02, 0.97] {
            let rope = rope(&points(), stretch, friction);
            for _ in 0..6 {
                let u: Vec<f64> = (0..15).map(|_| 0.1 * noise()).collect();
                let points = points();
                let mut case = Case::new(&rope, &points, &u);
                // Friction takes work that is no function of the place.
                case.conservative = friction == 0.0;
                case.check_all(rope.density * rope.area * rope.total());
            }
        }
    }
}

#[test]
fn nodes_that_run_up_to_each_other_keep_a_slope_and_a_tangent() {
    let mut noise = random(5);
    for stretch in [1.02, 0.97] {
        let (rope, points) = (rope(&points(), stretch, 0.0), points());
        // The second inner node lies on the first, beside it, and just outside of what is blunted.
        for apart in [0.0, 0.3, 0.9, 1.1] {
            let mut u: Vec<f64> = (0..15).map(|_| 0.02 * noise()).collect();
            let least = BLUNT * rope.spans[1].norm();
            let aside = apart * least * Vector3::new(noise(), noise(), noise()).normalize();
            for c in 0..3 {
                u[6 + c] = u[3 + c] - rope.spans[1][c] + aside[c];
            }
            let case = Case::new(&rope, &points, &u);
            case.derivatives();
            assert!(case.force().iter().all(|f| f.is_finite()), "{apart}: {:?}", case.force());
        }
    }
}

#[test]
fn a_chain_of_aligned_nodes_is_one_long_cable() {
    // The patch test: inner nodes anywhere on the line feel nothing, the ends feel N of the whole.
    let line: Vec<_> = [0.0, 0.3, 0.5, 1.2].iter().map(|x| Vector3::new(*x, 0.0, 0.0)).collect();
    let rope = rope(&line, 1.01, 0.0);
    let u = [0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.02, 0.0, 0.0, 0.003, 0.0, 0.0];
    let force = Case::new(&rope, &[], &u).force();
    let total: f64 = 1.2 / 1.01;
    let (l, e) = (1.203, (1.203 * 1.203 - total * total) / (2.0 * total * total));
    let exact = 1e5 * e * l / total;
    assert!((force[9] / exact - 1.0).abs() < 1e-12 && force[3].abs() < 1e-10 * exact);
}

#[test]
fn friction_holds_the_ratio_of_the_capstan() {
    // V-F9: 90 degrees at mu = 0.2, 1.36910777 (9 digits); 180 degrees, 1.87445609.
    let quarter = [[0.0, -1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]].map(Vector3::from);
    let half = [[0.0, -1.0, 0.0], [0.0, 0.0, 0.0], [1e-13, -1.0, 0.0]].map(Vector3::from);
    for (points, ratio) in [(&quarter, 1.36910777), (&half, 1.87445609)] {
        let rope = rope(points, 1.0, 0.2);
        let mut u = [0.0; 9];
        u[1] = -0.001;
        let mut forces = [0.0; 2];
        rope.line_forces(&u, &rope.start_history(), &mut forces);
        assert!((forces[0] / forces[1] / ratio - 1.0).abs() < 1e-8, "{forces:?}");
    }
}

#[test]
fn what_it_was_asked_before_changes_no_answer() {
    let mut noise = random(13);
    for friction in [0.0, 0.2] {
        let asked = rope(&points(), 1.01, friction);
        let start = asked.start_history();
        let mut torn = start.clone();
        torn[BROKEN] = 1.0;
        let places: Vec<Vec<f64>> = (0..3).map(|_| (0..15).map(|_| 0.05 * noise()).collect()).collect();
        // The same place twice, another history there, a tangent in between, and back.
        for (place, history) in [(0, &start), (0, &start), (0, &torn), (1, &start), (2, &start), (0, &start)]
        {
            let (u, fresh) = (&places[place], asked.clone());
            let mut forces = [[0.0; 4]; 2];
            fresh.line_forces(u, history, &mut forces[0]);
            asked.line_forces(u, history, &mut forces[1]);
            assert_eq!(forces[0].map(f64::to_bits), forces[1].map(f64::to_bits));
            assert_eq!(fresh.clone().energy(u, history), asked.energy(u, history));
            let with_tangent = |rope: &SlidingCable| {
                let (mut force, mut k, mut after) = (vec![0.0; 15], vec![0.0; 225], history.clone());
                let mut answer = Answer {
                    force: &mut force,
                    tangent: Some(&mut k),
                    slack: Slack::Exact,
                    history: &mut after,
                    tension: 0.0,
                };
                rope.respond(Pace::default(), u, history, &mut answer);
                (force, k, after)
            };
            assert_eq!(with_tangent(&fresh.clone()), with_tangent(&asked));
        }
    }
}

#[test]
fn turned_around_it_pulls_the_same() {
    let there = rope(&points(), 1.01, 0.2);
    let mut reversed = points();
    reversed.reverse();
    let back = rope(&reversed, 1.01, 0.2);
    let mut noise = random(8);
    let u: Vec<f64> = (0..15).map(|_| 0.02 * noise()).collect();
    let turned: Vec<f64> = u.chunks(3).rev().flatten().copied().collect();
    let (a, b) = (Case::new(&there, &[], &u).force(), Case::new(&back, &[], &turned).force());
    for (a, b) in a.chunks(3).zip(b.chunks(3).rev()) {
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-8), "{a:?} {b:?}");
    }
}
