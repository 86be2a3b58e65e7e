//! Releases, lines and zones that are drawn on a map: the same study as with the points written into it.

use super::{Place, SCENE, STUDY};

const CLIFF: &str = "[[2600005.0, 1200010.0], [2600015.0, 1200012.0], [2600010.0, 1200030.0]]";
const SEEDS: &str = "[[2600020.5, 1200020.25], [2600018.0, 1200022.0]]";
const ROAD: &str = "[[2600035.0, 1200005.0], [2600035.0, 1200035.0]]";
const MEADOW: &str =
    "[[2600025.0, 1200000.0], [2600045.0, 1200000.0], [2600045.0, 1200040.0], [2600025.0, 1200040.0]]";

/// A layer as QGIS saves it, in a Swiss system.
fn layer(features: &[(&str, &str, &str)]) -> String {
    let features = features.iter().map(|(name, kind, coordinates)| {
        format!(
            "{{ \"type\": \"Feature\", \"properties\": {{ \"fid\": 1, \"name\": \"{name}\" }}, \"geometry\": {{ \"type\": \"{kind}\", \
             \"coordinates\": {coordinates} }} }}"
        )
    });
    format!(
        "{{ \"type\": \"FeatureCollection\", \"name\": \"layer\", \"crs\": {{ \"type\": \"name\", \"properties\": {{ \"name\": \
         \"urn:ogc:def:crs:EPSG::2056\" }} }}, \"features\": [ {} ] }}\n",
        features.collect::<Vec<_>>().join(", ")
    )
}

/// An area in a file: its last corner is the first again.
fn ring(corners: &str) -> String {
    let first = &corners[1..corners.find(']').expect("a corner") + 1];
    format!("{}, {first}]", &corners[..corners.len() - 1])
}

fn scene(polygon: &str) -> String {
    let meadow = format!("[[terrain.zone]]\nmaterial = \"meadow\"\npolygon = {polygon}\n");
    let law = "between = [\"rock\", \"meadow\"]\nlaw = \"hertz_rock\"\nyoung = 5e8\npoisson = 0.25\nrestitution = 0.1\nfriction = 0.9\n";
    SCENE.replace("name = \"block\"", "name = \"block\"\nmaterial = \"rock\"").replace(
        "[[contact]]\n",
        &format!("{meadow}[[contact]]\n{law}[[contact]]\nbetween = [\"rock\", \"ground\"]\n"),
    )
}

#[test]
fn a_study_that_is_drawn_on_a_map_is_that_with_its_points_written() {
    let place = Place::new(STUDY);
    place.write("fall.toml", &scene(MEADOW));
    let written = place.table("written", &[]);
    let files = place.files("written");
    let areas = |corners: &str| {
        let (cliff, meadow) = (ring(corners), ring(MEADOW));
        layer(&[
            ("cliff", "Polygon", &format!("[{cliff}]")),
            ("meadow", "MultiPolygon", &format!("[[{meadow}]]")),
        ])
    };
    place.write("areas.geojson", &areas(CLIFF));
    place.write("road.geojson", &layer(&[("road", "LineString", ROAD)]));
    place.write("seeds.geojson", &layer(&[("seeds", "MultiPoint", SEEDS)]));
    place.write("fall.toml", &scene("{ file = \"areas.geojson\", name = \"meadow\" }"));
    let drawn = STUDY
        .replace(CLIFF, "{ file = \"areas.geojson\", name = \"cliff\" }")
        .replace(SEEDS, "\"seeds.geojson\"")
        .replace(ROAD, "\"road.geojson\"");
    assert!(drawn.matches("geojson").count() == 3, "{drawn}");
    place.write("study.toml", &drawn);
    assert_eq!(place.table("drawn", &["--threads", "2"]), written);
    assert!(place.files("drawn") == files);
    // The scene of a member needs none of the files: it runs anywhere.
    let one = place.run("drawn", &["--scene-of", "3"]);
    let one = String::from_utf8_lossy(&one.stdout).into_owned();
    assert!(one.contains("2600045.0") && !one.contains("geojson"), "{one}");
    // Another area, another study.
    place.write(
        "areas.geojson",
        &areas("[[2600005.0, 1200010.0], [2600015.0, 1200012.0], [2600010.0, 1200031.0]]"),
    );
    let resumed = place.run("drawn", &["--resume"]);
    assert_eq!(resumed.status.code(), Some(2));
    let said = String::from_utf8_lossy(&resumed.stderr).into_owned();
    assert!(said.contains("holds another study"), "{said}");
}

#[test]
fn a_drawn_release_of_several_areas_or_beside_the_terrain_is_refused_at_its_place() {
    let place = Place::new(&STUDY.replace(CLIFF, "\"areas.geojson\""));
    for (file, words) in [
        (
            layer(&[
                ("west", "Polygon", &format!("[{}]", ring(CLIFF))),
                ("east", "Polygon", &format!("[{}]", ring(CLIFF))),
            ]),
            "areas.geojson: there are 2 polygons: `west`, `east`; one is needed",
        ),
        (
            layer(&[("west", "Polygon", "[[[7.4, 46.9], [7.5, 46.9], [7.5, 47.0], [7.4, 46.9]]]")]),
            "it may be in degrees of longitude and latitude",
        ),
        (
            layer(&[(
                "west",
                "Polygon",
                "[[[1200010, 2600005], [1200012, 2600015], [1200030, 2600010], [1200010, 2600005]]]",
            )]),
            "x and y may be exchanged",
        ),
        (layer(&[("west", "LineString", ROAD)]), "a polygon is needed, and there is `LineString`"),
    ] {
        place.write("areas.geojson", &file);
        let refused = place.run("out", &[]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(said.contains("study.toml:6:11") && said.contains(words), "{said}");
    }
    assert!(!place.path("out").exists());
}

/// A layer may say in which coordinate system it is, and so may the terrain.
#[test]
fn a_layer_in_another_coordinate_system_than_the_terrain_is_refused() {
    let area = layer(&[("west", "Polygon", &format!("[{}]", ring(CLIFF)))]);
    let (road, meadow) =
        (layer(&[("", "LineString", ROAD)]), layer(&[("", "Polygon", &format!("[{}]", ring(MEADOW)))]));
    let place = Place::new(&STUDY.replace(CLIFF, "\"a.geojson\"").replace(ROAD, "\"road.geojson\""));
    place.write("slope.prj", "PROJCRS[\"CH1903+ / LV95\",ID[\"EPSG\",2056]]");
    place.write("fall.toml", &scene("\"meadow.geojson\""));
    let other = |text: &str| text.replace("EPSG::2056", "EPSG::21781");
    for (wrong, words) in [
        (0, "study.toml:6:11: its layer is in EPSG:21781, and the terrain in EPSG:2056"),
        (1, "study.toml:22:10: its layer is in EPSG:21781"),
        (2, "fall.toml:14:11: its layer is in EPSG:21781"),
    ] {
        for (number, (name, text)) in
            [("a.geojson", &area), ("road.geojson", &road), ("meadow.geojson", &meadow)]
                .into_iter()
                .enumerate()
        {
            place.write(name, &if number == wrong { other(text) } else { text.clone() });
        }
        let refused = place.run("out", &[]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains(words), "{words}: {said}");
    }
}

/// Heights for a barrier are taken from a scene with drawn zones too.
#[test]
fn heights_are_taken_from_a_terrain_with_drawn_zones() {
    let place = Place::new(STUDY);
    place.write("fall.toml", &scene("\"meadow.geojson\""));
    place.write("meadow.geojson", &layer(&[("", "Polygon", &format!("[{}]", ring(MEADOW)))]));
    place.write("slope.prj", "PROJCRS[\"CH1903+ / LV95\",ID[\"EPSG\",2056]]");
    for (epsg, code) in [("--epsg=2056", 0), ("--epsg=21781", 2)] {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_dem-solver"))
            .arg("ground")
            .arg(place.path("fall.toml"))
            .args(["--line=2600030,1200020,2600030,1200030", epsg, "-o"])
            .arg(place.path("heights.asc"))
            .output()
            .expect("started");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{said}");
        let words = "the layer of the line is in EPSG:21781, and the terrain in EPSG:2056";
        assert_eq!(said.contains(words), code == 2, "{said}");
    }
}
