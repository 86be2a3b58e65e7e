//! Ropes and brakes as they are tested: pulled between two points, slowly and fast, in statics, implicit and explicit steps.

use crate::common::{Run, off};

/// Three ways to pull.
const WAYS: [&str; 3] = ["static", "generalized_alpha", "central_difference"];

/// A part of 10 m that is drawn by `speed` [m/s].
fn drawn(part: &str, way: &str, speed: f64) -> String {
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, 0.0]
[structure]
form_finding = "none"
nodes = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]
supports = [
  {{ nodes = [0] }},
  {{ nodes = [1], motion = [[0.0, 0.0, 0.0, 0.0], [1.0, {speed:?}, 0.0, 0.0]] }},
]
[[structure.parts]]
name = "part"
cells = [[0, 1]]
{part}
[fem]
integrator = "{way}"
time_step = 1e-4
[[gauge]]
name = "part"
group = "part"
quantity = "tension"
[[gauge]]
name = "part"
group = "part"
quantity = "elongation"
"#
    )
}

/// Force [N] at each elongation [m] until the end.
fn curve(part: &str, way: &str, speed: f64, window: f64) -> Vec<(f64, f64)> {
    let mut run = Run::alone(&drawn(part, way, speed), window);
    let steps = (1.0 / window).round() as usize;
    (0..steps)
        .map(|_| {
            run.step(window, &[]);
            (run.value("part_elongation"), run.value("part_tension"))
        })
        .collect()
}

#[test]
fn a_rope_stretches_and_breaks_as_its_catalogue_says() {
    // 22 mm, 1 770 MPa: 305 kN by the tables, of which terminations keep 0.9; 94.5 GPa over 0.46 d^2.
    let rope = "rope = { diameter = 0.022, grade = 1.77e9 }";
    for element in ["cable", "sliding_cable"] {
        for way in WAYS {
            let curve = curve(&format!("element = \"{element}\"\n{rope}"), way, 0.4, 5e-3);
            let most = curve.iter().map(|(_, force)| *force).fold(0.0, f64::max);
            assert!(off(most, 0.9 * 305e3) < 0.02, "{element}, {way}: {most} N");
            let (stretch, force) = curve[9];
            let rigidity = force / (stretch / 10.0);
            assert!(off(rigidity, 94.5e9 * 0.46 * 0.022 * 0.022) < 0.02, "{element}, {way}: {rigidity} N");
            assert_eq!(curve.last().expect("rows").1, 0.0, "{element}, {way}: it is torn");
        }
    }
}

#[test]
fn a_brake_gives_way_as_its_curve_says_slowly_and_fast() {
    let brake = "element = \"brake\"\nstiffness = 5e6\ncurve = [[0.03, 1.2e5], [1.6, 1.5e5]]\nstroke = 1.6\n\
                 speed = [[5.0, 1.2], [10.0, 1.3]]";
    // Slowly, in statics: the curve. At 8 m/s 1.26 times as much.
    for (way, speed, factor) in [
        ("static", 1.0, 1.0),
        ("generalized_alpha", 1e-3, 1.0),
        ("generalized_alpha", 1.0, 1.04),
        ("central_difference", 1.0, 1.04),
    ] {
        for (elongation, force) in curve(brake, way, speed, 5e-3) {
            if elongation > 0.05 {
                let slow = 1.2e5 + 3e4 * (elongation - 0.03) / 1.57;
                assert!(off(force, factor * slow) < 0.01, "{way}, {speed} m/s, {elongation} m: {force} N");
            }
        }
    }
    for way in ["generalized_alpha", "central_difference"] {
        let rows = curve(brake, way, 8.0, 5e-3);
        let flowing: Vec<_> = rows.iter().filter(|(way, _)| (0.05..1.5).contains(way)).collect();
        for (elongation, force) in &flowing {
            let slow = 1.2e5 + 3e4 * (elongation - 0.03) / 1.57;
            assert!(off(*force, 1.26 * slow) < 0.02, "{way}, {elongation} m: {force} N");
        }
        assert!(flowing.len() > 30, "{}", flowing.len());
    }
}
