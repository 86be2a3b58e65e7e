//! Terrain files of every format: the same slope from each, and files that lie.

use crate::memory::peak;
use dem_solver::random::SplitMix;
use dem_solver::settings::{NoData, TerrainSettings};
use dem_solver::terrain::Terrain;
use dem_solver::terrain::raster::Raster;
use dem_solver::terrain::triangulation;
use nalgebra::Vector3;
use std::fmt::Write as _;
use std::path::Path;
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;
use toolkit::scene::Scene;

#[path = "../support/slope.rs"]
mod slope;
use slope::Slope;

/// 9 x 7 points each 2 m, from (2600000, 1200000), heights of whole millimetres around 1500 m.
fn slope() -> Slope {
    Slope {
        corner: [2.6e6, 1.2e6],
        spacing: 2.0,
        counts: [9, 7],
        drop: 8.0,
        foot: 1500.0,
        benches: 1,
        roughness: 0.1,
        seed: 3,
    }
}

/// World coordinates of its points.
fn points() -> Vec<[f64; 3]> {
    let raster = slope().raster();
    (0..63)
        .map(|i| [2.6e6 + 2.0 * (i % 9) as f64, 1.2e6 + 2.0 * (6 - i / 9) as f64, raster.heights[i]])
        .collect()
}

fn settings(file: &str) -> TerrainSettings {
    serde_json::from_value(serde_json::json!({ "file": file })).expect("settings")
}

/// Read `bytes` as the file `name`.
fn read(name: &str, bytes: &[u8], change: impl FnOnce(&mut TerrainSettings)) -> Result<Terrain, String> {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join(name), bytes).expect("written");
    let scene = Scene::from_text(&dir.path().join("s.toml").display().to_string(), "").expect("a scene");
    let mut settings = settings(name);
    change(&mut settings);
    let ground = Terrain::of(&scene, &settings)
        .map_err(|e| e.to_string().replace(&format!("{}/", dir.path().display()), ""))?;
    Ok(ground)
}

fn asc() -> Vec<u8> {
    let dir = tempfile::tempdir().expect("a directory");
    slope().raster().write_asc(&dir.path().join("t.asc")).expect("written");
    std::fs::read(dir.path().join("t.asc")).expect("read")
}

/// Rows from the south, limits at the nodes.
fn grd() -> Vec<u8> {
    let raster = slope().raster();
    let mut text = String::from("DSAA\n9 7\n2600000 2600016\n1200000 1200012\n0 2000\n");
    for row in raster.heights.chunks(9).rev() {
        row.iter().for_each(|z| write!(text, "{z} ").expect("text"));
        text.push('\n');
    }
    text.into_bytes()
}

fn xyz() -> Vec<u8> {
    let mut text = String::from("x,y,z\n");
    points().iter().for_each(|[x, y, z]| writeln!(text, "{x},{y},{z}").expect("text"));
    text.into_bytes()
}

fn tif() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).expect("an encoder");
    let mut image = encoder.new_image::<colortype::Gray64Float>(9, 7).expect("an image");
    image.encoder().write_tag(Tag::ModelPixelScaleTag, &[2.0, 2.0, 0.0][..]).expect("a tag");
    // The outer corner of the first pixel, north-west of its middle.
    image
        .encoder()
        .write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 2.6e6 - 1.0, 1.2e6 + 13.0, 0.0][..])
        .expect("a tag");
    image.encoder().write_tag(Tag::GdalNodata, "-9999").expect("a tag");
    image.write_data(&slope().raster().heights).expect("written");
    bytes.into_inner()
}

fn las(compressed: bool) -> Vec<u8> {
    las_of((1, 2), 0, compressed)
}

/// Of a version and a format of points: from 6 on each part of them is compressed in a layer of its own.
fn las_of(version: (u8, u8), format: u8, compressed: bool) -> Vec<u8> {
    let mut builder = las::Builder::from(version);
    builder.point_format = las::point::Format::new(format).expect("a format");
    builder.point_format.is_compressed = compressed;
    let millimetres = |offset| las::Transform { scale: 0.001, offset };
    builder.transforms = las::Vector { x: millimetres(2.6e6), y: millimetres(1.2e6), z: millimetres(1500.0) };
    let bytes = std::io::Cursor::new(Vec::new());
    let mut writer = las::Writer::new(bytes, builder.into_header().expect("a header")).expect("a writer");
    let gps_time = (format >= 6).then_some(0.0);
    for (i, [x, y, z]) in points().into_iter().enumerate() {
        // Trees 5 m high among them, of another class.
        for (up, class) in [(0.0, 2), (5.0, 5)].into_iter().take(1 + usize::from(i % 10 == 0)) {
            let classification = las::point::Classification::new(class).expect("a class");
            writer
                .write_point(las::Point { x, y, z: z + up, classification, gps_time, ..Default::default() })
                .expect("written");
        }
    }
    writer.into_inner().expect("closed").into_inner()
}

/// The triangles of the grid as a closed list, for STL and OBJ.
fn grid() -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let relief = triangulation::from_raster(&slope().raster(), NoData::Refuse).expect("a surface");
    (relief.nodes.iter().map(|n| n + relief.origin).collect(), relief.triangles)
}

fn obj() -> Vec<u8> {
    let (nodes, triangles) = grid();
    let mut text = String::from("# a slope\n");
    nodes.iter().for_each(|n| writeln!(text, "v {} {} {}", n.x, n.y, n.z).expect("text"));
    triangles
        .iter()
        .for_each(|[a, b, c]| writeln!(text, "f {}/1 {}/2/3 {}//4", a + 1, b + 1, c + 1).expect("text"));
    text.into_bytes()
}

fn stl_text() -> Vec<u8> {
    let (nodes, triangles) = grid();
    let mut text = String::from("solid slope\n");
    for t in triangles {
        text += " facet normal 0 0 1\n  outer loop\n";
        t.iter()
            .map(|n| nodes[*n as usize])
            .for_each(|n| writeln!(text, "   vertex {} {} {}", n.x, n.y, n.z).expect("text"));
        text += "  endloop\n endfacet\n";
    }
    (text + "endsolid slope\n").into_bytes()
}

fn stl_binary() -> Vec<u8> {
    let (nodes, triangles) = grid();
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        bytes.extend([0; 12]);
        // With an origin of its own: in single precision 2.6e6 m are too coarse.
        let local = |n: u32| nodes[n as usize] - Vector3::new(2.6e6, 1.2e6, 1500.0);
        t.iter()
            .flat_map(|n| local(*n).iter().map(|v| *v as f32).collect::<Vec<_>>())
            .for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn every() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("t.asc", asc()),
        ("t.tif", tif()),
        ("t.grd", grd()),
        ("t.xyz", xyz()),
        ("t.las", las(false)),
        ("t.laz", las(true)),
        ("layers.laz", las_of((1, 4), 6, true)),
        ("t.obj", obj()),
        ("t.stl", stl_text()),
        ("b.stl", stl_binary()),
    ]
}

#[test]
fn every_format_gives_the_same_slope_to_a_billionth_of_a_metre() {
    let heights: std::collections::HashMap<[i64; 2], f64> =
        points().iter().map(|[x, y, z]| ([*x as i64, *y as i64], *z)).collect();
    for (name, bytes) in every() {
        let ground = read(name, &bytes, |_| {}).unwrap_or_else(|e| panic!("{e}"));
        // Points in a square grid may be joined across either diagonal, and slivers at the border dropped.
        assert_eq!(ground.triangles.len(), 96, "{name}");
        assert_eq!(ground.nodes.len(), 63, "{name}");
        let origin = if name == "b.stl" { Vector3::new(2.6e6, 1.2e6, 1500.0) } else { Vector3::zeros() };
        // Single precision of some 10 m against steps of a double at 2.6e6 m.
        let tolerance = if name == "b.stl" { 1e-6 } else { 1e-9 };
        for node in ground.nodes.iter() {
            let place = node + ground.origin + origin;
            let height = heights[&[place.x.round() as i64, place.y.round() as i64]];
            assert!((place.z - height).abs() < tolerance, "{name}: {} {height}", place.z);
            assert!((place.xy() - place.xy().map(f64::round)).norm() < tolerance, "{name}");
        }
    }
}

#[test]
fn holes_are_refused_with_their_place_or_cut_out() {
    let mut raster = slope().raster();
    raster.heights[3 * 9 + 4] = f64::NAN;
    let dir = tempfile::tempdir().expect("a directory");
    raster.write_asc(&dir.path().join("t.asc")).expect("written");
    let bytes = std::fs::read(dir.path().join("t.asc")).expect("read");
    let refused = read("t.asc", &bytes, |_| {}).expect_err("a hole");
    assert!(
        refused.starts_with(
            "t.asc: 1 of 63 cells have no height, the first in row 4 from the north and column 5"
        ),
        "{refused}"
    );
    assert!(refused.contains("nodata = \"cut\""), "{refused}");
    let height = slope().raster().heights[3 * 9 + 4];
    let grid = String::from_utf8(grd()).expect("text").replacen(&format!("{height} "), "1.70141e+38 ", 1);
    for (name, bytes) in [("t.asc", bytes), ("t.grd", grid.into_bytes())] {
        // Of the four cells around it one triangle each is left.
        let cut = read(name, &bytes, |s| s.nodata = NoData::Cut).expect("cut");
        assert_eq!((cut.nodes.len(), cut.triangles.len()), (62, 92), "{name}");
        let at = |x: f64, y: f64| {
            cut.height(&(Vector3::new(2.6e6 + x, 1.2e6 + y, 1600.0) - cut.origin), &-Vector3::z())
        };
        assert!(at(8.1, 6.1).is_none() && at(3.0, 3.0).is_some() && at(-0.1, 3.0).is_none(), "{name}");
    }
}

#[test]
fn the_height_above_a_node_is_that_of_the_file() {
    let ground = read("t.asc", &asc(), |_| {}).expect("a terrain");
    for [x, y, z] in points() {
        let above = ground.height(&(Vector3::new(x, y, z + 3.0) - ground.origin), &-Vector3::z());
        assert!((above.expect("on it") - 3.0).abs() < 1e-9);
        let below = ground.height(&(Vector3::new(x, y, z - 0.5) - ground.origin), &-Vector3::z());
        assert!((below.expect("on it") + 0.5).abs() < 1e-9);
    }
}

#[test]
fn zones_are_found_by_polygon_and_by_raster() {
    let text = "[terrain]\nfile = \"t.asc\"\nmaterial = \"rock\"\nzones = \"z.asc\"\n\
                [[terrain.zone]]\nmaterial = \"scree\"\nnumber = 7\n\
                [[terrain.zone]]\nmaterial = \"wood\"\npolygon = [[2600008, 1200000], [2600016, 1200000], [2600016, 1200012], [2600008, 1200012]]\n";
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("t.asc"), asc()).expect("written");
    let zones = "ncols 2\nnrows 1\nxllcorner 2600000\nyllcorner 1200000\ncellsize 6\n7 7\n";
    std::fs::write(dir.path().join("z.asc"), zones).expect("written");
    let scene = Scene::from_text(&dir.path().join("s.toml").display().to_string(), text).expect("a scene");
    let terrain: TerrainSettings = scene.read("terrain").expect("valid").expect("there");
    let ground = Terrain::of(&scene, &terrain).expect("a terrain");
    assert_eq!(ground.materials, ["rock", "scree", "wood"]);
    for t in 0..ground.triangles.len() as u32 {
        let middle = ground.corners(t).iter().sum::<Vector3<f64>>() / 3.0 + ground.origin;
        let expected = if middle.x > 2_600_008.0 {
            2
        } else if middle.y < 1_200_006.0 {
            1
        } else {
            0
        };
        assert_eq!(ground.zone(t), expected, "{middle}");
    }
}

/// Trees of class 5 are above the ground; taken in, the highest of two points over each other counts.
#[test]
fn classes_of_points_are_chosen_in_the_scene() {
    let top = |classes: Vec<u8>| {
        let ground = read("t.laz", &las(true), |s| s.classes = classes).expect("a terrain");
        ground.highest.z + ground.origin.z
    };
    assert!(top(vec![2]) < 1509.0 && top(vec![]) > 1510.0);
    let error = read("t.laz", &las(true), |s| s.classes = vec![9]).expect_err("none");
    assert!(error.starts_with("t.laz: none of its 70 points is of class 9"), "{error}");
}

#[test]
fn a_fault_is_told_with_file_and_line() {
    let head = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
    for (name, text, expected) in [
        ("t.asc", format!("{head}1 2 3\n4 five 6\n"), "t.asc:7: `five` is no height (row 2, column 2)"),
        ("t.asc", format!("{head}1 2 3\n4 5\n"), "t.asc:8: the file ends after 5 of 3 x 2 = 6 heights"),
        ("t.asc", format!("{head}1 2 3\n4 5 6 7\n"), "t.asc:7: `7` follows the last of 6 heights"),
        ("t.asc", "ncols 3\nnrows -2\n".into(), "t.asc:2: nrows = -2: it must be a whole number above 0"),
        (
            "t.asc",
            "ncols 3\nnrows 2\n1 2 3 4 5 6".into(),
            "t.asc: the header has no `xllcorner`; is this an ESRI grid?",
        ),
        (
            "t.asc",
            head.replace("ncols 3", "ncols 900000000"),
            "t.asc: the header promises 900000000 x 2 heights, and the file has 59 bytes",
        ),
        ("t.xyz", "# points\n1 2 3\n1 2\n".into(), "t.xyz:3: the line has no z"),
        ("t.xyz", "1 2 3\n4 5 nan\n".into(), "t.xyz:2: `nan` is no z"),
        (
            "t.xyz",
            "0 0 0\n1 1 1\n2 2 2\n".into(),
            "t.xyz: 3 points that span no surface: three that are not in line are needed",
        ),
        ("t.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n".into(), "t.obj:3: corner 3 of a file of 2 corners"),
        ("t.stl", "solid a\nfacet\nvertex 0 0 zero\n".into(), "t.stl:3: `zero` is not a number"),
        (
            "t.dem",
            "1".into(),
            "t.dem: `.dem` is no terrain that can be read; known are .asc, .tif, .grd, .xyz, .las, .laz, .stl, .obj",
        ),
    ] {
        let error = read(name, text.as_bytes(), |_| {}).expect_err(expected);
        assert_eq!(error.lines().next(), Some(expected));
    }
}

/// Must-show 7: each file cut off at many places, emptied, replaced by another format, with bytes changed at
/// random (the same ones in each run). It is read or refused by a message with its name; nothing panics.
#[test]
fn no_file_however_damaged_brings_a_reader_down() {
    let files = every();
    let (mut refused, mut taken) = (0, 0);
    let mut most = 0;
    let mut try_it = |name: &str, bytes: &[u8]| {
        let (read, peak) = peak(|| read(name, bytes, |_| {}));
        // Batches of 4 MiB, tables of the decoders. An image may have shrunk to a 1100th, and its pixels with their
        // triangles take 250 bytes each.
        let each = if name.ends_with(".tif") { 1100 * 250 } else { 3000 };
        assert!(peak < (32 << 20) + each * bytes.len(), "{name} of {} bytes took {peak}", bytes.len());
        most = most.max(peak);
        match read {
            Ok(ground) => {
                assert!(!ground.triangles.is_empty());
                taken += 1;
            }
            Err(error) => {
                assert!(error.starts_with(name), "{name}: {error}");
                refused += 1;
            }
        }
    };
    for (name, bytes) in &files {
        for other in &files {
            try_it(name, &other.1);
        }
        for length in (0..bytes.len()).step_by(bytes.len() / 40 + 1) {
            try_it(name, &bytes[..length]);
        }
        try_it(name, &[0xff; 4096]);
        try_it(name, &[0; 4096]);
        let mut seed = 11_u64;
        let mut random = |below: usize| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as usize % below
        };
        for round in 0..300 {
            let mut changed = bytes.clone();
            // The head, where lengths and counts stand, is hit as often as everything else together.
            let reach = if round % 2 == 0 { bytes.len().min(400) } else { bytes.len() };
            for _ in 0..=random(4) {
                changed[random(reach)] =
                    [0, 0xff, 0x7f, 0x80, b'9', b'-', b'e', random(256) as u8][random(8)];
            }
            try_it(name, &changed);
        }
    }
    println!("{taken} read, {refused} refused, {most} bytes at most");
    assert!(refused > 500 && taken > 100);
}

/// Lengths that a header or a chunk claims are compared with the file before there is room made for them.
#[test]
fn lengths_that_lie_make_no_room() {
    let with = |bytes: &[u8], at: usize, value: u32| {
        let mut changed = bytes.to_vec();
        changed[at..at + 4].copy_from_slice(&value.to_le_bytes());
        changed
    };
    let refused = |name: &str, bytes: &[u8], expected: &str| {
        let (error, peak) = peak(|| read(name, bytes, |_| {}).expect_err("a lie"));
        assert!(error.contains(expected), "{error}");
        assert!(peak < (8 << 20), "{name}: {peak} bytes");
    };
    let layers = las_of((1, 4), 6, true);
    let points = u32::from_le_bytes(layers[96..100].try_into().expect("4 bytes")) as usize;
    // The first chunk: a point of 30 bytes, their number, the lengths of nine layers.
    let sizes = points + 8 + 30 + 4;
    for layer in 0..9 {
        refused("l.laz", &with(&layers, sizes + 4 * layer, 2_000_000_000), "its chunk 1 at byte");
    }
    refused("l.laz", &with(&layers, 105, 0xffff_ffff), "bytes");
    refused("t.laz", &with(&las(true), 107, 3_000_000_000), "promises 3000000000 points");
    refused("t.las", &with(&las(false), 107, 1_000_000), "promises 1000000 points");
    let mut head = stl_binary();
    head.truncate(84);
    refused("t.stl", &with(&head, 80, 80_000_000), "80000000 triangles");
    let asc = "ncols 40000\nnrows 40000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n";
    refused("t.asc", asc.as_bytes(), "40000 x 40000 heights");
}

#[test]
fn a_missing_file_is_named_and_the_scene_is_checked() {
    let of = |text: &str| -> String {
        let text = format!(
            "end_time = 1.0\n[[rock]]\nposition = [0.0, 0.0, 1.0]\nmass = 1.0\nshape = {{ type = \"sphere\", radius = 0.1 }}\n{text}"
        );
        let scene = Scene::from_text("s.toml", &text).expect("TOML");
        let options = toolkit::program::Options { out: None, shortcuts: true };
        dem_solver::DemSolver::new(&scene, &options).err().expect("refused").to_string()
    };
    assert!(of("[terrain]\nfile = \"no/such.asc\"").starts_with("no/such.asc: there is no such file"));
    assert!(of("[terrain]\nfil = \"t.asc\"").contains("did you mean `file`?"));
    let twice = of("[terrain]\nfile = \"t.asc\"\n[[terrain.zone]]\nmaterial = \"a\"\n");
    assert!(twice.contains("the zone has neither polygon nor number"), "{twice}");
    assert!(!Path::new("no").exists());
}
