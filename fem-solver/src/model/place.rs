//! From `[structure.place]` to where the nodes stand.

use crate::config::place::PlaceConfig;
use crate::config::structure::StructureConfig;
use crate::read::heights::Heights;
use crate::read::refuse;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use toolkit::scene::Scene;

/// Turn and move `nodes` [m] to the place of `table`, if it names one.
pub(super) fn put(
    scene: &Scene,
    table: &StructureConfig,
    nodes: &mut [Vector3<f64>],
) -> Result<(), Diagnostic> {
    let Some(place) = &table.place else { return Ok(()) };
    check(scene, table, place)?;
    let (sine, cosine) = place.azimuth.to_radians().sin_cos();
    let origin = Vector3::new(place.origin[0], place.origin[1], 0.0);
    for node in nodes.iter_mut() {
        // Along the azimuth, and to its left.
        let (x, y) = (node.x * sine - node.y * cosine, node.x * cosine + node.y * sine);
        *node = origin + Vector3::new(x, y, node.z);
    }
    if let Some(z) = place.origin.get(2) {
        nodes.iter_mut().for_each(|node| node.z += z);
        return Ok(());
    }
    let ground = ground(scene, table, place)?;
    let height = |at: &Vector3<f64>, what: &str| {
        ground.at(at.x, at.y).ok_or_else(|| {
            let what = format!(
                "{what} stands at x = {:.2}, y = {:.2} m, where there is no ground: its heights are known for {}, and may have holes",
                at.x, at.y, ground.extent()
            );
            scene.invalid("structure.place.origin", what).try_instead(
                "origin is in the coordinates of the terrain, azimuth in degrees from y, clockwise",
            )
        })
    };
    if place.draped {
        for (number, node) in nodes.iter_mut().enumerate() {
            node.z += height(node, &format!("node {number}"))?;
        }
    } else {
        let below = height(&origin, "the origin")?;
        nodes.iter_mut().for_each(|node| node.z += below);
    }
    Ok(())
}

/// The same table with heights that need no ground, for who asks where it stands as seen from above.
pub(super) fn flat(table: &StructureConfig) -> StructureConfig {
    let mut flat = table.clone();
    if let Some(place) = &mut flat.place {
        place.origin.resize(3, 0.0);
        place.draped = false;
    }
    flat
}

/// Whether the heights of a raster are asked for.
pub(super) fn needs_ground(table: &StructureConfig) -> bool {
    table.place.as_ref().is_some_and(|place| place.origin.len() == 2)
}

fn check(scene: &Scene, table: &StructureConfig, place: &PlaceConfig) -> Result<(), Diagnostic> {
    if table.generator.as_ref().is_some_and(|generator| generator.is_placed()) {
        let what = "the line or position of the barrier says where it stands, and place says it again";
        return Err(scene.invalid("structure.place", what).try_instead("leave out [structure.place]"));
    }
    if !matches!(place.origin.len(), 2 | 3) {
        let what = format!("a point of {} numbers: two or three are required", place.origin.len());
        return refuse(scene, "structure.place.origin", what, "[x, y] on the ground, or [x, y, z]");
    }
    if !(-360.0..=360.0).contains(&place.azimuth) {
        let what = format!("azimuth = {}: it must lie between -360 and 360 degrees", place.azimuth);
        return Err(scene.invalid("structure.place.azimuth", what));
    }
    let idle = |key: &str| {
        let what = format!("`{key}`: origin has a height of its own, and nothing will use the ground");
        scene
            .invalid(&format!("structure.place.{key}"), what)
            .try_instead(format!("leave out the third number of origin, or `{key}`"))
    };
    match place.origin.len() {
        3 if place.draped => Err(idle("draped")),
        3 if place.ground.is_some() => Err(idle("ground")),
        _ => Ok(()),
    }
}

fn ground(scene: &Scene, table: &StructureConfig, place: &PlaceConfig) -> Result<Heights, Diagnostic> {
    let of_contact = table.ground.as_ref().and_then(|ground| ground.file.as_ref());
    let Some(path) = place.ground.as_ref().or(of_contact) else {
        let what = "an origin of two numbers is on the ground, and its heights are not known here";
        return Err(scene.invalid("structure.place.origin", what).try_instead(
            "name a raster with ground = \"FILE.asc\", or write [x, y, z]; in a scene with [terrain], `rockfall run` and `rockfall \
             check` make the raster",
        ));
    };
    Heights::read(scene, "structure.place.ground", path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put_at(place: &str, mut nodes: Vec<Vector3<f64>>) -> Result<Vec<Vector3<f64>>, String> {
        let table: StructureConfig = toml::from_str(place).map_err(|e| e.to_string())?;
        let scene = Scene::from_text("s.toml", "title = \"x\"").expect("valid");
        put(&scene, &table, &mut nodes).map_err(|e| e.to_string())?;
        Ok(nodes)
    }

    #[test]
    fn x_points_along_the_azimuth_and_y_to_its_left() {
        let axes = vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
        for (azimuth, x, y) in [
            (90.0, Vector3::x(), Vector3::y()),
            (0.0, Vector3::y(), -Vector3::x()),
            (225.0, Vector3::new(-1.0, -1.0, 0.0).normalize(), Vector3::new(1.0, -1.0, 0.0).normalize()),
        ] {
            let origin = Vector3::new(2.6e6, 1.2e6, 1500.0);
            let text = format!("place = {{ origin = [2.6e6, 1.2e6, 1500.0], azimuth = {azimuth:?} }}");
            let put = put_at(&text, axes.clone()).expect("valid");
            for (is, exact) in put.iter().zip([Vector3::zeros(), x, y, Vector3::z()]) {
                assert!((is - origin - exact).norm() < 1e-9, "{azimuth}: {is}");
            }
        }
    }

    #[test]
    fn heights_count_from_the_ground_below_the_origin_or_below_each_node() {
        let dir = tempfile::tempdir().expect("a directory");
        let file = dir.path().join("g.asc");
        // z = 100 + 2 x + y from 0 to 20.
        let text = "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 20\n120 160\n100 140\n";
        std::fs::write(&file, text).expect("written");
        let nodes = vec![Vector3::zeros(), Vector3::new(3.0, 0.0, 0.5)];
        let place =
            |more: &str| format!("place = {{ origin = [10, 5], azimuth = 0.0, ground = {file:?}, {more} }}");
        let put = put_at(&place(""), nodes.clone()).expect("valid");
        assert!((put[1] - Vector3::new(10.0, 8.0, 125.5)).norm() < 1e-12, "{put:?}");
        let draped = put_at(&place("draped = true"), nodes.clone()).expect("valid");
        assert!((draped[1] - Vector3::new(10.0, 8.0, 128.5)).norm() < 1e-12, "{draped:?}");
        let beside =
            put_at(&place("draped = true"), vec![Vector3::new(-6.0, 0.0, 0.0)]).expect_err("refused");
        assert!(
            beside.contains("node 0 stands at x = 10.00, y = -1.00 m, where there is no ground"),
            "{beside}"
        );
        for (text, words) in [
            ("place = { origin = [1.0] }", "a point of 1 numbers"),
            ("place = { origin = [1.0, 2.0] }", "its heights are not known here"),
            ("place = { origin = [1.0, 2.0, 3.0], draped = true }", "origin has a height of its own"),
            ("place = { origin = [1.0, 2.0, 3.0], azimuth = 400.0 }", "between -360 and 360"),
            (
                "place = { origin = [1.0, 2.0, 3.0] }\ngenerator = { type = \"barrier\", position = [0, 0], azimuth = 0.0, length = 9.0 }",
                "says it again",
            ),
        ] {
            let message = put_at(text, nodes.clone()).expect_err("refused");
            assert!(message.contains(words), "{message}");
        }
    }
}
