//! Paths of equilibrium of the literature on stability: limit points, branch points, snap-back.
//!
//! Frames are compared with rods by shooting (`elastica.rs`), point by point along the whole curve; the error of the beams falls
//! with the square of their length. Loads of the literature are named where they stand.

use crate::common::{Run, off};
use crate::curves::{ARCH, Frame, Point, arch, column, follow, lee, panel, toggle, turning};
use crate::elastica::Rod;
use interface_defs::diagnostic::code;
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
        assert!(
            warnings.iter().any(|w| w.message.contains("unstable from the branch point")),
            "{warnings:?}"
        );
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
    // 2.2 kN at 12.7 mm; 585 N and -377 N at 6.35 mm, where the displacement turns back as well: Sabir and Lock (1972),
    // Variational methods in engineering, 7/54; Sze, Liu and Lo (2004), Finite Elem. Anal. Des. 40, 1551. What these do not
    // give is held by the mesh: from 4 to 8 to 12 cells the limits change less and less.
    let limits = |thickness: f64, cells: usize| {
        let (mut run, points) = follow(&panel(cells, thickness, 1.0), 2.0, 22);
        let found = critical(&mut run);
        let names: Vec<_> = found.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(names, ["limit_point_1", "limit_point_2"], "{thickness} mm, {cells} cells");
        let back = points.windows(2).any(|p| p[1].moved[2] > p[0].moved[2] + 0.1);
        assert_eq!(back, thickness < 10.0, "snap-back");
        assert_eq!(points[21].negative, 0.0);
        [found[0].1, found[1].1]
    };
    for (thickness, most, least) in [(12.7, 2200.0, None), (6.35, 585.0, Some(-377.0))] {
        let [coarse, middle, fine] = [4, 8, 12].map(|cells| limits(thickness, cells));
        for i in 0..2 {
            let (first, second) = ((middle[i] - coarse[i]).abs(), (fine[i] - middle[i]).abs());
            assert!(second < 0.5 * first && second < 0.01 * fine[i].abs(), "{coarse:?} {middle:?} {fine:?}");
        }
        assert!(off(fine[0], most) < 0.012, "{thickness} mm: {fine:?}");
        // The literature is read from figures there.
        assert!(least.is_none_or(|least| off(fine[1], least) < 0.03), "{thickness} mm: {fine:?}");
    }
}

/// Complete elliptic integrals of the first and second kind, by the arithmetic-geometric mean.
fn elliptic(modulus: f64) -> [f64; 2] {
    let (mut a, mut b, mut c) = (1.0, (1.0 - modulus * modulus).sqrt(), modulus);
    let (mut sum, mut power) = (0.5 * c * c, 0.5);
    while c > 1e-15 {
        (a, b, c) = (0.5 * (a + b), (a * b).sqrt(), 0.5 * (a - b));
        power *= 2.0;
        sum += power * c * c;
    }
    let first = 0.5 * std::f64::consts::PI / a;
    [first, first * (1.0 - sum)]
}

#[test]
fn a_straight_column_turns_into_eulers_elastica() {
    // Euler (1744): P / P_E = (2 K / pi)^2, shortening / L = 2 (1 - E / K), of the modulus sin (a / 2), a the turn of its ends.
    let off_by = |beams: usize| {
        // So slender that it bends without shortening: P / E A = 3e-6.
        let mut frame = column(beams, 0.0);
        frame.inertia *= 1e-3;
        frame.loads[0].1[1] *= 1e-3;
        let (mut run, points) = follow(&turning(&frame.text(1.0)), 0.02, 120);
        let found = critical(&mut run);
        assert_eq!(found.len(), 1, "{found:?}");
        let worst = points.iter().fold(0.0_f64, |worst, point| {
            assert_eq!(point.negative, 0.0, "{point:?}");
            let (mut low, mut high) = (0.0, 1.0 - 1e-12);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let [first, second] = elliptic(middle);
                let short = 4.0 * 2.0 * (1.0 - second / first);
                (low, high) = if short < -point.moved[2] { (middle, high) } else { (low, middle) };
            }
            let load = (2.0 * elliptic(low)[0] / std::f64::consts::PI).powi(2);
            worst.max((load - point.load).abs())
        });
        assert!(points[119].moved[2] < -1.0, "{:?}", points[119]);
        (worst, found[0].1)
    };
    let ((coarse, a), (fine, b)) = (off_by(16), off_by(32));
    assert!(fine < 0.003 && fine < 0.3 * coarse, "{coarse} {fine}");
    assert!(off(b + (b - a) / 3.0, 1.0) < 1e-5, "{a} {b}");
}

#[test]
fn a_shallow_arch_buckles_sideways_before_its_limit() {
    // Of the amplitudes a of the sine and b of two half waves, with k = E I (pi / L)^4 and the thrust
    // H = E A (pi / 2 L)^2 (a0^2 - a^2 - 4 b^2): p = k (a0 - a) + H (pi / L)^2 a; b is free where H = 4 E I (pi / L)^2, and the
    // path is p = k (a0 + 3 a) there. Fung and Kaplan (1952), NACA TN 2840. The arch is so shallow that the theory errs by (pi rise / L)^2.
    let [half, rise, bending, slender] = ARCH;
    let k = bending * (std::f64::consts::PI / (2.0 * half)).powi(4);
    let gyration = rise / slender;
    let symmetric = |a: f64| k * (rise - a) + k * (rise * rise - a * a) / (4.0 * gyration * gyration) * a;
    let branch_at = (rise * rise - 16.0 * gyration * gyration).sqrt();
    let limit_at = ((rise * rise - 4.0 * gyration * gyration) / 3.0).sqrt();
    let (branch, limit) = (symmetric(branch_at), symmetric(limit_at));
    // Three times that, and beams of a thirty-second of the span.
    let small = 0.004 * limit;

    let (mut run, points) = follow(&arch(32).text(1.0), 0.005, 44);
    for point in &points {
        assert!((point.load - symmetric(rise + point.moved[2])).abs() < small, "{point:?}");
        assert!(point.moved[0].abs() < 1e-9, "stays symmetric: {point:?}");
    }
    let found = critical(&mut run);
    let names: Vec<_> = found.iter().map(|(name, ..)| name.as_str()).collect();
    assert_eq!(names, ["branch_point_1", "limit_point_1", "limit_point_2", "branch_point_2"]);
    let loads = [branch, limit, symmetric(-limit_at), symmetric(-branch_at)];
    for ((name, load, _), exact) in found.iter().zip(loads) {
        assert!((load - exact).abs() < small, "{name}: {load} is not {exact}");
    }

    let (mut run, points) = follow(&turning(&arch(32).text(1.0)), 0.005, 60);
    let mut sideways = 0;
    for point in &points {
        let a = rise + point.moved[2];
        let exact = if point.negative > 0.0 { k * (rise + 3.0 * a) } else { symmetric(a) };
        assert!((point.load - exact).abs() < small, "{point:?} is not {exact}");
        sideways += usize::from(point.negative > 0.0);
    }
    assert!(sideways > 10, "{points:?}");
    assert!(off(critical(&mut run)[0].1, branch) < 0.004);
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

#[test]
fn a_path_goes_over_the_corner_where_a_slack_cable_goes_taut() {
    // A soft bar of 1 m, and beside it a stiff cable of 1.05 m: in series with nothing, so that both loads add up,
    // E A (l^2 / L^2 - 1) / 2 (l / L) each.
    let text = r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
cables = [
    { nodes = [0, 1], young = 1e7, tension_only = false },
    { nodes = [0, 1], young = 1e11, length = 1.05 },
]
cable = { young = 1e11, area = 1e-4, density = 0.0 }
supports = [{ nodes = [0] }, { nodes = [1], directions = "yz" }]
loads = [{ nodes = [1], force = [1.0, 0.0, 0.0] }]
[fem]
integrator = "static"
path_speed = 1.0
[[gauge]]
name = "watched"
at = [1.0, 0.0, 0.0]
quantity = "displacement"
"#;
    let pull = |axial: f64, rest: f64, u: f64| {
        let stretch = (1.0 + u) / rest;
        if stretch > 1.0 { 0.5 * axial * (stretch * stretch - 1.0) * stretch } else { 0.0 }
    };
    for (window, rows) in [(0.003, 33), (0.1, 1)] {
        let (mut run, points) = follow(text, window, rows);
        assert!(run.count("refused_steps") > 0, "the corner is seen");
        for point in points {
            let u = point.moved[0];
            let exact = pull(1e3, 1.0, u) + pull(1e7, 1.05, u);
            assert!(off(point.load, exact) < 1e-9, "{u}: {} is not {exact}", point.load);
            assert_eq!(point.negative, 0.0);
        }
    }
}

#[test]
fn what_tears_along_a_path_does_so_at_its_strength() {
    // A weak cable beside three strong ones, torn in the middle of a step of any length.
    let text = r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]]
supports = [{ nodes = [0, 2, 3, 4] }]
loads = [{ nodes = [1], force = [1.0, 0.2, -1.0] }]
cable = { young = 1e11, area = 1e-4, density = 0.0 }
[[structure.parts]]
name = "weak"
element = "cable"
cells = [[0, 1]]
rupture_force = 5e4
[[structure.parts]]
name = "strong"
element = "cable"
cells = [[1, 2], [1, 3], [1, 4]]
prestress = 1e7
[fem]
integrator = "static"
path_speed = 1.0
[[gauge]]
name = "watched"
at = [1.0, 0.0, 0.0]
quantity = "displacement"
"#;
    for (window, rows) in [(0.01, 20), (0.2, 1)] {
        let (mut run, points) = follow(text, window, rows);
        let warnings = run.solver.finish().expect("is prepared").warnings;
        let torn = warnings.iter().find(|w| w.code == code::RUPTURE).expect("tears");
        let force: f64 =
            torn.message.split("under ").nth(1).and_then(|w| w.split(' ').next()).unwrap().parse().unwrap();
        assert!((5e4..5e4 * 1.002).contains(&force), "{torn}");
        assert!(points[rows - 1].load > 1e5, "and goes on: {points:?}");
    }
}
