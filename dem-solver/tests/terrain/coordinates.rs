//! Coordinates, units and marks of terrain files: what is not in metres is refused by name, what is scaled is scaled.

use dem_solver::settings::{NoData, TerrainSettings};
use dem_solver::terrain::Terrain;
use std::path::Path;
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;
use toolkit::scene::Scene;

const HEIGHTS: [f64; 6] = [1500.0, 1501.0, 1502.0, 1503.0, 1504.5, 1505.0];

/// What a GeoTIFF of 3 x 2 pixels of 10 m says beside its heights.
#[derive(Default)]
struct Says<'a> {
    keys: &'a [(u16, u16)],
    text: &'a str,
    metadata: &'a str,
    third: [f64; 2],
    mask: bool,
}

fn tif(heights: &[f64; 6], says: &Says) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).expect("an encoder");
    let mut image = encoder.new_image::<colortype::Gray64Float>(3, 2).expect("an image");
    let tags = image.encoder();
    let [scale, tie] = says.third;
    tags.write_tag(Tag::ModelPixelScaleTag, &[10.0, 10.0, scale][..]).expect("a tag");
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 2.6e6, 1.2e6, tie][..]).expect("a tag");
    if !says.keys.is_empty() {
        let mut directory = vec![1_u16, 1, 0, says.keys.len() as u16];
        says.keys.iter().for_each(|(key, value)| directory.extend([*key, 0, 1, *value]));
        tags.write_tag(Tag::GeoKeyDirectoryTag, &directory[..]).expect("a tag");
    }
    if !says.text.is_empty() {
        tags.write_tag(Tag::GeoAsciiParamsTag, says.text).expect("a tag");
    }
    if !says.metadata.is_empty() {
        tags.write_tag(Tag::Unknown(42_112), says.metadata).expect("a tag");
    }
    image.write_data(heights).expect("written");
    if says.mask {
        let mut image = encoder.new_image::<colortype::Gray8>(3, 2).expect("an image");
        image.encoder().write_tag(Tag::NewSubfileType, 4_u32).expect("a tag");
        image.write_data(&[255, 255, 0, 255, 255, 255]).expect("written");
    }
    bytes.into_inner()
}

fn read_in(dir: &Path, name: &str, change: impl FnOnce(&mut TerrainSettings)) -> Result<[f64; 2], String> {
    let scene = Scene::from_text(&dir.join("s.toml").display().to_string(), "").expect("a scene");
    let mut settings: TerrainSettings =
        serde_json::from_value(serde_json::json!({ "file": name })).expect("settings");
    change(&mut settings);
    let ground = Terrain::of(&scene, &settings).map_err(|e| e.to_string())?;
    Ok([ground.lowest.z + ground.origin.z, ground.highest.z + ground.origin.z])
}

/// Lowest and highest point.
fn read(name: &str, bytes: &[u8], change: impl FnOnce(&mut TerrainSettings)) -> Result<[f64; 2], String> {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join(name), bytes).expect("written");
    read_in(dir.path(), name, change)
}

#[test]
fn a_geotiff_in_degrees_or_feet_or_with_a_mask_is_refused_with_the_cure() {
    let of = |says: &Says| read("t.tif", &tif(&HEIGHTS, says), |_| {});
    let metres = Says { keys: &[(1024, 1), (3072, 2056), (3076, 9001)], ..Says::default() };
    assert_eq!(of(&metres), Ok([1500.0, 1505.0]));
    let refused = |says: Says, words: [&str; 2]| {
        let error = of(&says).expect_err(words[0]);
        assert!(words.iter().all(|w| error.contains(w)), "{words:?}: {error}");
    };
    refused(
        Says { keys: &[(1024, 2), (2048, 4326)], ..Says::default() },
        ["degrees (geographic, EPSG:4326)", "gdalwarp"],
    );
    refused(
        Says { keys: &[(1024, 1), (3076, 9003)], ..Says::default() },
        ["US survey feet of 0.3048006 m", "gdalwarp"],
    );
    refused(
        Says { keys: &[(1024, 1), (3076, 9001), (4099, 9002)], ..Says::default() },
        ["heights are in feet", "0.3048"],
    );
    refused(
        Says {
            keys: &[(1024, 1), (3072, 2227)],
            text: "NAD83 / California zone 3 (ftUS)|",
            ..Says::default()
        },
        ["US survey feet", "gdalwarp"],
    );
    let unit =
        "<GDALMetadata><Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item></GDALMetadata>";
    refused(Says { metadata: unit, ..Says::default() }, ["heights are in feet", "gdal_calc"]);
    refused(Says { mask: true, ..Says::default() }, ["a mask of pixels without height", "-dstnodata"]);
}

#[test]
fn heights_are_scaled_and_shifted_as_the_file_says() {
    let raw = HEIGHTS.map(|z| (z - 1000.0) * 10.0);
    let metadata = "<GDALMetadata>\n<Item name=\"OFFSET\" sample=\"0\" role=\"offset\">1000</Item>\n\
                    <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.1</Item>\n</GDALMetadata>";
    let by_metadata = read("t.tif", &tif(&raw, &Says { metadata, ..Says::default() }), |_| {});
    let by_pixel_scale = read("t.tif", &tif(&raw, &Says { third: [0.1, 1000.0], ..Says::default() }), |_| {});
    for [low, high] in [by_metadata.expect("scaled"), by_pixel_scale.expect("scaled")] {
        assert!((low - 1500.0).abs() < 1e-9 && (high - 1505.0).abs() < 1e-9, "{low} {high}");
    }
}

#[test]
fn a_mark_of_cells_without_height_that_the_file_does_not_declare_is_named_and_can_be_declared() {
    let mut holes = HEIGHTS;
    holes[2] = -32_768.0;
    let bytes = tif(&holes, &Says::default());
    let error = read("t.tif", &bytes, |_| {}).expect_err("a cliff of kilometres");
    assert!(
        error.contains("1 of 6 cells have the height -3.2768e4 m")
            && error.contains("nodata_value = -32768.0"),
        "{error}"
    );
    let declared = |nodata| {
        move |s: &mut TerrainSettings| {
            s.nodata_value = Some(-32_768.0);
            s.nodata = nodata;
        }
    };
    assert!(
        read("t.tif", &bytes, declared(NoData::Refuse))
            .expect_err("a hole")
            .contains("1 of 6 cells have no height")
    );
    assert_eq!(read("t.tif", &bytes, declared(NoData::Cut)), Ok([1500.0, 1505.0]));
}

#[test]
fn a_projection_file_beside_the_terrain_is_read() {
    let dir = tempfile::tempdir().expect("a directory");
    let asc = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2 3\n4 5 6\n";
    std::fs::write(dir.path().join("t.asc"), asc).expect("written");
    assert!(read_in(dir.path(), "t.asc", |_| {}).is_ok());
    let prj = "GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\"],UNIT[\"Degree\",0.0174532925199433]]";
    std::fs::write(dir.path().join("t.prj"), prj).expect("written");
    let error = read_in(dir.path(), "t.asc", |_| {}).expect_err("degrees");
    assert!(error.contains("degrees (GCS_WGS_1984)") && error.contains("by t.prj"), "{error}");
}

#[test]
fn decimal_commas_and_what_is_no_file_are_named() {
    let asc = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2 3\n4 5,5 6\n";
    let error = read("t.asc", asc.as_bytes(), |_| {}).expect_err("a comma");
    assert!(error.contains("t.asc:7: `5,5` is no height") && error.contains("with a point: 5.5"), "{error}");
    for text in ["2600000,5 1200000,5 1500,25\n", "2600000,5;1200000,5;1500,25\n"] {
        let error = read("t.xyz", text.as_bytes(), |_| {}).expect_err("a comma");
        assert!(error.contains("t.xyz:1: `2600000,5`") && error.contains("2600000.5"), "{error}");
    }
    let commas = "0,0,1\n10,0,2\n0,10,3\n10, 10, 4\n";
    assert!(read("t.xyz", commas.as_bytes(), |_| {}).is_ok(), "commas that separate");
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("slope.asc"), asc).expect("written");
    std::fs::create_dir(dir.path().join("dir.asc")).expect("made");
    std::os::unix::net::UnixListener::bind(dir.path().join("pipe.asc")).expect("a socket");
    let of = |name: &str| read_in(dir.path(), name, |_| {}).expect_err(name);
    assert!(of("slop.asc").contains("did you mean slope.asc"));
    assert!(of("dir.asc").contains("this is a directory"));
    assert!(of("pipe.asc").contains("a device, a pipe or a socket"));
}

#[test]
fn keys_of_a_terrain_that_its_file_leaves_without_use_are_refused() {
    let of = |text: &str| -> String {
        let text = format!(
            "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [0.0, 0.0, 1.0]\nmass = 1.0\n\
             shape = {{ type = \"sphere\", radius = 0.1 }}\n[terrain]\n{text}\n"
        );
        let scene = Scene::from_text("s.toml", &text).expect("TOML");
        let options = toolkit::program::Options { out: None, shortcuts: true };
        dem_solver::DemSolver::new(&scene, &options).err().expect("refused").to_string()
    };
    for (text, key) in [
        ("file = \"t.stl\"\nnodata = \"cut\"", "nodata"),
        ("file = \"t.xyz\"\nnodata_value = 0.0", "nodata_value"),
        ("file = \"t.asc\"\nclasses = [2, 9]", "classes"),
        ("file = \"t.tif\"\nlongest_edge = 5.0", "longest_edge"),
        ("file = \"t.tif\"\nzones = \"z.asc\"", "zones"),
    ] {
        let message = of(text);
        assert!(message.starts_with("s.toml:9:") && message.contains(&format!("`{key}` ")), "{message}");
        assert!(message.contains("nothing will use it") && message.contains("leave"), "{message}");
    }
}
