//! Paths of equilibrium of the literature on stability: limit points, branch points, snap-back.
//!
//! Frames are compared with rods by shooting (`elastica.rs`), point by point along the whole curve; the error of the beams falls
//! with the square of their length. Loads of the literature are named where they stand.

use crate::common::{Run, off};
use crate::curves::{Frame, Point, column, follow, lee, panel, toggle};
use crate::elastica::Rod;
use interface_defs::solver::Solver;

/// Largest difference between a curve and the rod's: of the load in units of `unit`, of the other displacement in units of
/// `length`.
fn off_rod(frame: &Frame, points: &[Point], unit: f64, length: f64) -> [f64; 2] {
    let mut rod = Rod::new(frame);
    points.iter().fold([0.0, 0.0], |worst, point| {
        let moved = [point.moved[0], point.moved[2]];
        let (load, at) = rod.follow(moved);
        let way = (at[0] - moved[0]).hypot(at[1] - moved[1]);
        [worst[0].max((load - point.load).abs() / unit), worst[1].max(way / length)]
    })
}

/// The measures of critical points: name, load factor, time.
fn critical(run: &mut Run) -> Vec<(String, f64, f64)> {
    let measures = run.solver.finish().expect("is prepared").measures;
    let points = measures.into_iter().filter(|m| m.name.contains("_point_"));
    points.map(|m| (m.name, m.value, m.time.expect("stands along the path"))).collect()
}

#[test]
fn lees_frame_is_followed_through_both_limits_and_both_turns() {
    // 400 mm further than its first limit point the load points up; the error is of second order all along.
    let off_by = |cuts: usize| {
        let frame = lee(cuts);
        let (mut run, points) = follow(&frame.text(1.0), 0.02, 92);
        let limits: Vec<f64> = critical(&mut run).iter().map(|(_, load, _)| *load).collect();
        assert_eq!(limits.len(), 2, "{limits:?}");
        // One direction is unstable between the limits, none before and behind.
        let (most, least) = (limits[0], limits[1]);
        let at = |sought: f64| points.iter().position(|p| (p.load - sought).abs() < 2e-3 * sought.abs());
        let (first, last) = (at(most).expect("a row near the limit"), at(least).expect("another"));
        for (i, point) in points.iter().enumerate() {
            if i + 3 < first || i > last + 3 {
                assert_eq!(point.negative, 0.0, "row {i}");
            } else if i > first + 3 && i + 3 < last {
                assert_eq!(point.negative, 1.0, "row {i}");
            }
            assert!(point.load <= most && point.load >= least - 1e-6 * most || i > last, "row {i}");
        }
        (off_rod(&frame, &points, 18552.0, 1.2), limits)
    };
    let ((coarse, _), (fine, limits)) = (off_by(2), off_by(4));
    assert!(fine[0] < 0.01 && fine[1] < 1e-3, "{fine:?}");
    assert!(fine[0] < 0.3 * coarse[0] && fine[1] < 0.3 * coarse[1], "{coarse:?} {fine:?}");
    // 18.552 kN: Schweizerhof and Wriggers (1986), CMAME 59, 261, with other elements.
    let (_, finer) = off_by(8);
    let richardson = |i: usize| finer[i] + (finer[i] - limits[i]) / 3.0;
    assert!(off(richardson(0), 18552.0) < 1e-3, "{limits:?} {finer:?}");
}

#[test]
fn a_column_with_a_bow_buckles_along_its_elastica() {
    // Bow L / 1000, 4 m: to a shortening of 0.8 m, 1.13 of Euler's load.
    let off_by = |beams: usize| {
        let frame = column(beams, 0.004);
        let (_, points) = follow(&frame.text(1.0), 0.01, 120);
        assert!(points.iter().all(|p| p.negative == 0.0), "a bow takes the branch away");
        assert!(points[119].moved[2] < -0.8, "{:?}", points[119]);
        off_rod(&frame, &points, 1.0, 4.0)[0]
    };
    let (coarse, fine) = (off_by(8), off_by(16));
    assert!(fine < 0.006 && fine < 0.3 * coarse, "{coarse} {fine}");
}

#[test]
fn a_straight_column_tells_eulers_load_and_that_it_goes_on_unstable() {
    let loads = |beams: usize| {
        let (mut run, points) = follow(&column(beams, 0.0).text(1.0), 0.004, 15);
        let found = critical(&mut run);
        let names: Vec<&str> = found.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(names, ["branch_point_1", "branch_point_2"]);
        for point in &points {
            let passed = found.iter().filter(|(_, load, _)| *load < point.load).count();
            assert_eq!(point.negative, passed as f64, "{point:?}");
        }
        let warnings = run.solver.finish().expect("is prepared").warnings;
        assert!(warnings.iter().any(|w| w.contains("unstable from the branch point")), "{warnings:?}");
        [found[0].1, found[1].1]
    };
    let (coarse, fine) = (loads(16), loads(32));
    for (mode, (a, b)) in [1.0, 4.0].into_iter().zip(coarse.into_iter().zip(fine)) {
        // A column that shortens by e = P / E A bends on a shorter length with curvatures per unit of the old one:
        // P (1 - e) = (n pi)^2 E I / L^2 (exact for a rod that stretches and bends).
        let strain = std::f64::consts::PI.powi(2) * 2.492e-5 / (16.0 * 5.381e-3);
        let exact = (1.0 - (1.0 - 4.0 * mode * strain).sqrt()) / (2.0 * strain);
        let richardson = b + (b - a) / 3.0;
        assert!(off(richardson, exact) < 1e-4 * mode, "mode {mode}: {a} {b}, {richardson} is not {exact}");
    }
}

#[test]
fn williams_toggle_snaps_through_as_its_rods_do() {
    let off_by = |cuts: usize| {
        let frame = toggle(cuts);
        let (mut run, points) = follow(&frame.text(1.0), 0.02, 35);
        let limits: Vec<f64> = critical(&mut run).iter().map(|(_, load, _)| *load).collect();
        assert_eq!(limits.len(), 2, "{limits:?}");
        (off_rod(&frame, &points, 80.0, 0.386)[0], limits)
    };
    let ((coarse, _), (fine, a), (_, b)) = (off_by(4), off_by(8), off_by(16));
    assert!(fine < 0.04 && fine < 0.3 * coarse, "{coarse} {fine}");
    // Between 33.5 and 34 lb: Williams (1964), Q. J. Mech. Appl. Math. 17, 451, his figure.
    let limit = b[0] + (b[0] - a[0]) / 3.0;
    assert!((33.5..34.0).contains(&limit), "{limit}");
}

#[test]
fn hinged_panels_snap_through_and_back() {
    // Sze, Liu and Lo (2004), Finite Elem. Anal. Des. 40, 1551, E = 3102.75 N/mm2: 2.2 kN at 12.7 mm; 585 N and some -380 N at
    // 6.35 mm, where the displacement turns back as well.
    for (thickness, cells, limit, least, allowed) in
        [(12.7, 4, 2220.0, 515.0, 0.05), (12.7, 8, 2220.0, 515.0, 0.015), (6.35, 8, 585.0, -380.0, 0.02)]
    {
        let (mut run, points) = follow(&panel(cells, thickness, 1.0), 2.0, 22);
        let found = critical(&mut run);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(off(found[0].1, limit) < 0.01 + 0.2 * allowed, "{thickness} mm: {found:?}");
        assert!(off(found[1].1, least) < allowed, "{thickness} mm: {found:?}");
        let back = points.windows(2).any(|p| p[1].moved[2] > p[0].moved[2] + 0.1);
        assert_eq!(back, thickness < 10.0, "snap-back");
        assert_eq!(points[21].negative, 0.0);
    }
}

#[test]
fn steps_along_a_path_are_its_own_and_not_those_of_the_output() {
    // Column with a bow, rows at every 2 mm, 50 mm and 1 m of the path: one curve.
    let curve = |window: f64, rows| follow(&column(16, 0.004).text(1.0), window, rows).1;
    let dense = curve(0.002, 500);
    for (window, rows) in [(0.05, 19), (0.9, 1)] {
        for point in curve(window, rows) {
            let depth = -point.moved[2];
            let after = dense.iter().position(|p| -p.moved[2] >= depth).expect("goes that far");
            let (a, b) = (dense[after - 1], dense[after]);
            let part = (depth + a.moved[2]) / (a.moved[2] - b.moved[2]);
            let load = a.load + part * (b.load - a.load);
            // Straight between rows: (2 mm)^2 / 8 of a curvature of at most 0.15 / (1 mm * 10 mm).
            assert!((load - point.load).abs() < 1e-4, "{window}: {load} {point:?}");
        }
    }
    // And one pair of limits of Lee's frame.
    let limits = |window: f64, rows| critical(&mut follow(&lee(2).text(1.0), window, rows).0);
    let dense = limits(0.01, 160);
    for (window, rows) in [(0.1, 16), (1.6, 1)] {
        for ((name, load, time), (other, same, when)) in dense.iter().zip(limits(window, rows)) {
            assert_eq!(*name, other);
            assert!(off(*load, same) < 1e-5, "{name}: {load} {same}");
            // The way along a path is a sum over its steps.
            assert!(off(*time, when) < 0.02, "{name}: {time} {when}");
        }
    }
}
