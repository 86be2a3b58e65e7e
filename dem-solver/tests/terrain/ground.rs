//! Heights around a line: those of the surface, at whole multiples of their distance, marked where there is none.

use dem_solver::terrain::ground::around;
use toolkit::ground::GroundArguments;
use toolkit::scene::Scene;

/// A plane in the coordinates of a survey, 20 m x 12 m in cells of 4 m, with one cell without height.
fn scene(dir: &std::path::Path) -> Scene {
    let mut text =
        "ncols 6\nnrows 4\nxllcenter 2600000\nyllcenter 1200000\ncellsize 4\nNODATA_value -9999\n".to_owned();
    for row in (0..4).rev() {
        for i in 0..6 {
            let height =
                if (i, row) == (5, 3) { -9999.0 } else { plane(4.0 * f64::from(i), 4.0 * f64::from(row)) };
            text += &format!("{height} ");
        }
        text.push('\n');
    }
    std::fs::write(dir.join("plane.asc"), text).expect("written");
    let file = dir.join("s.toml");
    std::fs::write(&file, "[terrain]\nfile = \"plane.asc\"\nnodata = \"cut\"\n[structure]\nline = 1\n")
        .expect("written");
    Scene::load(&file, &[]).expect("valid")
}

fn plane(x: f64, y: f64) -> f64 {
    1500.0 - 0.5 * x + 0.25 * y
}

fn arguments(scene: &Scene, line: &[f64]) -> GroundArguments {
    GroundArguments {
        input: toolkit::arguments::Input { scene: scene.path().to_owned(), sets: Vec::new() },
        line: line.to_vec(),
        margin: 5.0,
        cell: 0.5,
        epsg: None,
        key: Some("structure.line".into()),
        output: "g.asc".into(),
    }
}

#[test]
fn heights_are_those_of_the_surface_and_none_beside_it() {
    let dir = tempfile::tempdir().expect("a directory");
    let scene = scene(dir.path());
    let line = [2_600_004.2, 1_200_003.0, 2_600_014.0, 1_200_008.0];
    let raster = around(&scene, &arguments(&scene, &line)).expect("heights");
    // From -0.8 to 19 m and from -2 to 13 m, out to whole halves.
    assert_eq!(raster.corner, [2_599_999.0, 1_199_998.0]);
    assert_eq!(raster.counts, [41, 31]);
    let mut holes = 0;
    for (k, height) in raster.heights.iter().enumerate() {
        let x = -1.0 + 0.5 * (k % 41) as f64;
        let y = 13.0 - 0.5 * (k / 41) as f64;
        // Of the cell in whose corner there is no height, a triangle may be left.
        let beside = x >= 16.0 && y >= 8.0;
        let on_it = (0.0..=20.0).contains(&x) && (0.0..=12.0).contains(&y);
        if on_it && !beside {
            assert!((height - plane(x, y)).abs() < 1e-8, "{x} {y}: {height}");
        } else if !on_it || (x - 16.0) + (y - 8.0) > 4.0 {
            assert!(height.is_nan(), "{x} {y}: {height}");
            holes += 1;
        }
    }
    assert!(holes > 200, "{holes}");
}

#[test]
fn a_line_beside_the_terrain_is_refused_where_the_scene_states_it() {
    let dir = tempfile::tempdir().expect("a directory");
    let scene = scene(dir.path());
    let refused = |line: &[f64]| around(&scene, &arguments(&scene, line)).expect_err("refused").to_string();
    let beside = refused(&[2_600_004.0, 1_200_003.0, 2_600_021.0, 1_200_003.0]);
    assert!(
        beside.contains("s.toml:5:8: the point x = 2600021, y = 1200003 m lies beside the terrain"),
        "{beside}"
    );
    assert!(beside.contains("it has x 2600000.0 to 2600020.0"), "{beside}");
    assert!(refused(&[2_600_019.0, 1_200_011.0]).contains("or in a hole of it"));
    assert!(refused(&[1.0, 2.0, 3.0]).contains("3 numbers are no points"));
    let fine = GroundArguments { cell: 1e-4, ..arguments(&scene, &[2_600_004.0, 1_200_003.0]) };
    assert!(around(&scene, &fine).expect_err("too many").to_string().contains("heights 0.0001 m apart"));
}
