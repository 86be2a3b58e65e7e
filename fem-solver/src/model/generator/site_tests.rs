//! A barrier on the terrain against the same barrier in its own axes, and against the ground.

use super::*;
use crate::config::generator::{BarrierNet, Side};
use crate::read::mesh::Mesh;
use nalgebra::{Rotation3, Vector3};
use toolkit::coordinates::Coordinates;

fn made(table: &Barrier, file: Option<&str>) -> Result<Generated, String> {
    let dir = tempfile::tempdir().expect("a directory");
    let mut table = table.clone();
    if let Some(text) = file {
        let path = dir.path().join("g.asc");
        std::fs::write(&path, text).expect("written");
        table.ground = Some(path);
    }
    let scene = Scene::from_text("s.toml", "title = \"x\"").expect("valid");
    generate(&scene, &Generator::Barrier(table)).map_err(|e| e.to_string())
}

fn of_group(mesh: &Mesh, name: &str) -> Vec<Vector3<f64>> {
    let group = mesh.node_groups.iter().find(|g| g.name == name);
    group.expect("a group").nodes.iter().map(|n| mesh.nodes[*n as usize]).collect()
}

/// An ESRI grid of heights 1 m apart from -40 to 40 m.
fn grid(height: impl Fn(f64, f64) -> f64) -> String {
    let mut text = "ncols 81\nnrows 81\nxllcenter -40\nyllcenter -40\ncellsize 1\n".to_owned();
    for row in 0..81 {
        let line: Vec<String> =
            (0..81).map(|i| height(f64::from(i) - 40.0, 40.0 - f64::from(row)).to_string()).collect();
        text += &(line.join(" ") + "\n");
    }
    text
}

/// 50 m wide grids of a slope that falls to `azimuth` [degrees from y, clockwise], by `tangent`.
fn slope(azimuth: f64, tangent: f64) -> impl Fn(f64, f64) -> f64 {
    let (sine, cosine) = azimuth.to_radians().sin_cos();
    move |x, y| 100.0 - tangent * (x * sine + y * cosine)
}

#[test]
fn on_level_feet_it_is_the_barrier_in_own_axes_turned_and_moved() {
    for (net, azimuth, uphill) in [
        (BarrierNet::Square, 90.0, Side::Right),
        (BarrierNet::Rings, 17.0, Side::Right),
        (BarrierNet::Rings, 200.0, Side::Left),
    ] {
        let own = Barrier { net, lean: Some(1.5), cells: [6, 3], fields: 3, ..Barrier::default() };
        let placed = Barrier {
            position: Some(vec![10.0, -20.0, 700.0]),
            azimuth: Some(azimuth),
            length: Some(30.0),
            uphill: Some(uphill),
            ..own.clone()
        };
        let (own, placed) = (made(&own, None).expect("valid"), made(&placed, None).expect("valid"));
        // Along the line, or against it where the slope rises to its left.
        let against = if uphill == Side::Left { 180.0 } else { 0.0 };
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), (90.0 - azimuth + against).to_radians());
        assert_eq!(own.mesh.nodes.len(), placed.mesh.nodes.len());
        for (a, b) in own.mesh.nodes.iter().zip(&placed.mesh.nodes) {
            let there = turn * a + Vector3::new(10.0, -20.0, 700.0);
            // 700 m are rounded to 1e-13 m.
            assert!((there - b).norm() < 1e-12, "{net:?}: {there} {b}");
        }
        assert_eq!(own.mesh.elements, placed.mesh.elements);
        // Of nodes as near to the middle as each other, rounding chooses: not compared.
        let groups = |made: &Generated| {
            made.mesh.node_groups.iter().filter(|g| g.name != "impact").cloned().collect::<Vec<_>>()
        };
        assert_eq!(groups(&own), groups(&placed));
    }
}

#[test]
fn feet_and_anchors_lie_on_the_ground_and_heads_lean_down_the_slope() {
    // Falls to the south-east by 30 degrees; the line runs across, and 10 degrees off.
    let ground = slope(135.0, 30.0_f64.to_radians().tan());
    let text = grid(&ground);
    for azimuth in [45.0, 225.0, 62.0] {
        let table = Barrier {
            position: Some(vec![0.0, 0.0]),
            azimuth: Some(azimuth),
            length: Some(30.0),
            lean: Some(2.0),
            net: BarrierNet::Rings,
            cells: [6, 3],
            ..Barrier::default()
        };
        let mesh = made(&table, Some(&text)).expect("valid").mesh;
        for group in ["feet", "side_anchors", "upslope_anchors"] {
            for at in of_group(&mesh, group) {
                assert!((at.z - ground(at.x, at.y)).abs() < 1e-9, "{group} at {at}");
            }
        }
        let (feet, heads) = (of_group(&mesh, "feet"), of_group(&mesh, "heads"));
        let down = Vector3::new(1.0, -1.0, 0.0).normalize();
        for (foot, head) in feet.iter().zip(&heads) {
            let post = head - foot;
            assert!((post.norm() - 4.0).abs() < 1e-12);
            // Square to the line, which is off by 17 degrees at most.
            let off = (azimuth - 45.0_f64).to_radians().cos().abs();
            assert!((post.dot(&down) - 2.0 * off).abs() < 1e-12, "{post}");
        }
        // Of two anchors of a post, both lie above its foot, on the other side than its head leans to.
        let anchors = of_group(&mesh, "upslope_anchors");
        assert!(anchors.chunks(2).zip(&feet).all(|(pair, foot)| pair.iter().all(|a| a.z > foot.z + 2.0)));
    }
}

#[test]
fn a_bent_line_has_a_post_at_each_of_its_points() {
    let text = grid(slope(180.0, 0.5));
    let line = vec![vec![-20.0, 0.0], vec![0.0, 4.0], vec![10.0, 4.0]];
    let table = Barrier { line: Some(line.clone().into()), fields: 3, cells: [4, 2], ..Barrier::default() };
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("line.geojson");
    let drawn = "{\"type\": \"LineString\", \"coordinates\": [[-20, 0], [0, 4, 900], [10, 4]]}";
    std::fs::write(&file, drawn).expect("written");
    let of_file = Barrier { line: Some(Coordinates::of_file(file)), ..table.clone() };
    let of_file = made(&of_file, Some(&text)).expect("valid");
    let made = made(&table, Some(&text)).expect("valid");
    assert_eq!(of_file.mesh.nodes, made.mesh.nodes, "drawn on a map, whose heights do not count");
    let feet = of_group(&made.mesh, "feet");
    assert_eq!(feet.len(), 4);
    for point in line {
        let ground = 100.0 + 0.5 * point[1];
        assert!(
            feet.iter().any(|f| (f - Vector3::new(point[0], point[1], ground)).norm() < 1e-9),
            "{point:?}"
        );
    }
    assert!(made.mesh.warnings.is_empty(), "{:?}", made.mesh.warnings);
}

#[test]
fn ground_far_above_or_below_the_bottom_rope_is_reported() {
    // A wave along the line: a post stands at each trough, or at each crest.
    for (sign, so) in [(1.0, "above"), (-1.0, "below")] {
        let text = grid(|x, y| sign * 0.4 * (1.0 - (std::f64::consts::TAU * x / 10.0).cos()) - 0.6 * y);
        let table = Barrier {
            line: Some(vec![vec![-10.0, 0.0], vec![10.0, 0.0]].into()),
            fields: 2,
            cells: [4, 2],
            ..Barrier::default()
        };
        let warnings = made(&table, Some(&text)).expect("valid").mesh.warnings;
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        // Bilinear between points 1 m apart: the crest at 5 m is one of them.
        assert!(warnings[0].message.contains(&format!("0.80 m {so} the bottom rope")), "{warnings:?}");
    }
}

#[test]
fn what_no_one_can_mean_is_refused_with_its_reason() {
    let text = grid(slope(180.0, 0.5));
    let across = Barrier { line: Some(vec![vec![-15.0, 0.0], vec![15.0, 0.0]].into()), ..Barrier::default() };
    let line = |points: &[&[f64]]| Some(points.iter().map(|p| p.to_vec()).collect::<Vec<_>>().into());
    let flat = grid(|_, _| 7.0);
    let holed = grid(|x, y| if x > 17.0 && y < 1.0 { -9999.0 } else { 0.5 * y });
    let cases: [(Barrier, Option<&str>, &str); 16] = [
        (across.clone(), None, "stand on the ground, and its heights are not known here"),
        (across.clone(), Some(&flat), "no slope says where rocks come from"),
        (across.clone(), Some(&holed), "an anchor at the side stands at x = 17.50, y = 0.00 m"),
        (Barrier { line: line(&[&[0.0, 0.0]]), ..across.clone() }, Some(&text), "1 points: a line has two"),
        (
            Barrier { line: line(&[&[0.0, 0.0], &[5.0]]), ..across.clone() },
            Some(&text),
            "a point of 1 numbers",
        ),
        (
            Barrier { line: line(&[&[0.0, 0.0], &[9.0, 0.0, 1.0]]), ..across.clone() },
            Some(&text),
            "a point of 3 numbers",
        ),
        (
            Barrier { line: line(&[&[0.0, 0.0], &[0.0, 0.0]]), ..across.clone() },
            Some(&text),
            "fields of 0.000 m",
        ),
        (
            Barrier { line: line(&[&[0.0, 0.0], &[3e3, 0.0]]), ..across.clone() },
            Some(&text),
            "fields of 1000.000 m",
        ),
        (
            Barrier { line: line(&[&[50.0, 0.0], &[80.0, 0.0]]), ..across.clone() },
            Some(&text),
            "post 1 stands at x = 50.00",
        ),
        (
            Barrier { line: line(&[&[0.0, 0.0], &[9.0, 0.0], &[5.0, 9.0]]), ..across.clone() },
            Some(&text),
            "turns by 114 degrees",
        ),
        (
            Barrier { fields: 1, line: line(&[&[0.0, 0.0], &[9.0, 0.0], &[18.0, 1.0]]), ..across.clone() },
            Some(&text),
            "the line has 2 pieces",
        ),
        (Barrier { position: Some(vec![0.0, 0.0]), ..across.clone() }, Some(&text), "define one thing twice"),
        (
            Barrier { position: Some(vec![0.0, 0.0]), ..Barrier::default() },
            Some(&text),
            "azimuth and length are required",
        ),
        (
            Barrier { spacing: Some(10.0), ..across.clone() },
            Some(&text),
            "`spacing`: the posts stand on a line",
        ),
        (
            Barrier { anchor_rise: Some(4.0), ..across.clone() },
            Some(&text),
            "`anchor_rise`: the anchors lie on the ground",
        ),
        (
            Barrier { azimuth: Some(4.0), ..Barrier::default() },
            None,
            "`azimuth`: there is neither line nor position",
        ),
    ];
    for (table, ground, what) in cases {
        let refused = made(&table, ground).expect_err(what);
        assert!(refused.contains(what), "{refused}");
    }
    let known = Barrier { line: line(&[&[0.0, 0.0, 5.0], &[30.0, 0.0, 5.0]]), ..across };
    assert!(made(&known, None).expect_err("no side").contains("on which side of the line the slope rises"));
    assert!(made(&known, Some(&text)).expect_err("twice").contains("the line has heights of its own"));
    assert!(made(&Barrier { uphill: Some(Side::Left), ..known }, None).is_ok());
}

#[test]
fn an_uphill_that_contradicts_the_ground_is_told_with_both_facts() {
    // Rises to the north by 0.5: to the left of a line that runs east.
    let text = grid(slope(180.0, 0.5));
    let across = Barrier {
        position: Some(vec![0.0, 0.0]),
        azimuth: Some(90.0),
        length: Some(30.0),
        ..Barrier::default()
    };
    let warned = |uphill| {
        let table = Barrier { uphill, ..across.clone() };
        let warnings = made(&table, Some(&text)).expect("valid").mesh.warnings;
        warnings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert!(warned(None).is_empty() && warned(Some(Side::Left)).is_empty());
    let [warning] = &warned(Some(Side::Right))[..] else { panic!("one warning") };
    let both = warning.contains("uphill = \"right\"")
        && warning.contains("to its left")
        && warning.contains("6.00 m higher");
    assert!(both, "{warning}");
}
