//! Files that are not what a scene takes them for, in other units or damaged.

use super::scenes::{self, MESH, SLOPE};
use super::{Mistake, beside};

/// What the mistake is, the scene, the file beside it and its content, then place, cause and cure.
type File = (&'static str, String, &'static str, Vec<u8>, [&'static str; 3]);

const VALLEY: &str = "file = \"valley.asc\"";
const SURVEY: &str = "[2683010.0, 1247040.0, 1202.0]";
const SURFACE: &str = "{ type = \"mesh\", file = \"boulder.stl\" }\ncluster.spheres = 60";
const CLUSTER: &str = "{ type = \"box\", size = [0.8, 0.7, 0.6] }\ncluster.file = \"spheres.txt\"";

/// The slope with its rock at `place`.
fn at(place: &str) -> String {
    SLOPE.replace(SURVEY, place)
}

/// The slope with the terrain `name`.
fn named(name: &str) -> String {
    SLOPE.replace(VALLEY, &format!("file = \"{name}\""))
}

/// The slope with another shape and cluster.
fn rocky(how: &str) -> String {
    SLOPE.replace("{ type = \"box\", size = [0.8, 0.7, 0.6] }\ncluster.spheres = 27", how)
}

/// Another file in the place of `valley.asc`, `net.msh`, or a shape or cluster from a file.
pub fn of_files() -> Vec<Mistake> {
    let files = [terrains(), images(), coordinates(), rocks(), clusters(), nets()].into_iter().flatten();
    let refused = files.map(|(what, scene, name, content, [place, cause, cure])| {
        let mut all = beside(if scene.contains(VALLEY) { SLOPE } else { "" });
        all.retain(|(other, _)| *other != name);
        all.push((name, content));
        Mistake { what, scene, files: all, set: None, refused: true, place, cause, cure }
    });
    let heights = |what, heights: String, cause, cure| Mistake {
        what,
        scene: at(SURVEY),
        files: vec![("valley.asc", heights.into())],
        place: "scene.toml:9:8",
        cause,
        cure,
        ..Mistake::default()
    };
    let gentle =
        |show: fn(f64) -> String| scenes::grid(2.0, scenes::corner(), move |z| show(0.2 * (z - 1195.0)));
    let warned = [
        heights(
            "heights in whole metres",
            gentle(|z| format!("{:.0}", 1195.0 + z)),
            "are whole metres",
            "whose heights have decimals",
        ),
        heights(
            "steep heights in whole metres",
            scenes::grid(2.0, scenes::corner(), |z| format!("{:.0}", 1195.0 + 1.7 * (z - 1195.0))),
            "are whole metres in cells of 2 m",
            "whose heights have decimals",
        ),
        heights(
            "hillshade for the terrain",
            gentle(|z| format!("{:.0}", 150.0 + z)),
            "whole numbers from 0 to 255",
            "in metres, with decimals",
        ),
        heights(
            "heights all equal",
            gentle(|_| "1195".into()),
            "heights of the terrain are 1195 m",
            "hold heights?",
        ),
        heights(
            "one height that is an error",
            scenes::valley().replacen("1179.7", "1779.7", 1),
            "from all around it",
            "an error of the survey",
        ),
        Mistake {
            scene: at("[2683250.0, 1248000.0, 1202.0]"),
            ..heights(
                "terrain model of 50 m",
                scenes::grid(50.0, scenes::corner(), |z| format!("{z:.3}")),
                "50 m wide",
                "0.5 to 5 m cells",
            )
        },
        Mistake {
            what: "rock inside out",
            scene: rocky(SURFACE),
            files: vec![beside(SLOPE).remove(0), ("boulder.stl", scenes::boulder(-1.0, 0).into())],
            place: "scene.toml:3:1",
            cause: "inside out",
            cure: "turned to face outwards",
            ..Mistake::default()
        },
        Mistake {
            what: "cluster with diameters for radii",
            scene: rocky(CLUSTER),
            files: vec![beside(SLOPE).remove(0), ("spheres.txt", scenes::spheres(1.0, 0.2, " ").into())],
            place: "scene.toml:7:16",
            cause: "fill a box of 1 m x 0.9 m x 0.8 m",
            cure: "are its radii diameters",
            ..Mistake::default()
        },
        Mistake {
            what: "heights in km",
            scene: at(SURVEY),
            files: vec![(
                "valley.asc",
                scenes::grid(2.0, scenes::corner(), |z| format!("{:.6}", 1e-3 * z)).into(),
            )],
            place: "scene.toml:4:12",
            cause: "starts 1201 m above the terrain",
            cure: "in kilometres?",
            ..Mistake::default()
        },
    ];
    refused.chain(warned).collect()
}

/// Grids and points of another kind or in other units.
fn terrains() -> Vec<File> {
    vec![
        (
            "grid named .tif",
            named("valley.tif"),
            "valley.tif",
            scenes::valley().into(),
            ["valley.tif", "it is an ESRI grid", "name it valley.asc"],
        ),
        (
            "GeoTIFF named .asc",
            at(SURVEY),
            "valley.asc",
            b"II*\0\x08\0\0\0".to_vec(),
            ["valley.asc", "it is a GeoTIFF", "name it valley.tif"],
        ),
        (
            "points named .las",
            named("valley.las"),
            "valley.las",
            scenes::points(|_, [x, y, z]| format!("{x} {y} {z:.3}")).into(),
            ["valley.las", "a list of points", "name it valley.xyz"],
        ),
        (
            "cells in km",
            at(SURVEY),
            "valley.asc",
            scenes::grid(0.002, scenes::corner(), |z| format!("{z:.3}")).into(),
            ["valley.asc", "all of it would be a cliff", "in kilometres?"],
        ),
        (
            "degrees",
            at("[8.5401, 47.3702, 1202.0]"),
            "valley.asc",
            scenes::grid(2e-5, [8.54, 47.37], |z| format!("{z:.3}")).into(),
            ["valley.asc", "these are degrees", "gdalwarp"],
        ),
        (
            "heights in mm",
            at(SURVEY),
            "valley.asc",
            scenes::grid(2.0, scenes::corner(), |z| format!("{:.0}", 1e3 * z)).into(),
            ["valley.asc", "nothing on Earth is as high", "in metres"],
        ),
        (
            "heights in feet",
            at(SURVEY),
            "valley.asc",
            scenes::grid(2.0, scenes::corner(), |z| format!("{:.2}", z / 0.3048)).into(),
            ["scene.toml:4:12", "m below the terrain", "in feet?"],
        ),
        (
            "decimal commas",
            at(SURVEY),
            "valley.asc",
            scenes::valley().replace('.', ",").into(),
            ["valley.asc:7", "is no height", "a decimal comma?"],
        ),
    ]
}

/// Rasters that are no heights in metres along x and y.
fn images() -> Vec<File> {
    let of = |what, file: Vec<u8>, cause, cure| {
        (what, named("valley.tif"), "valley.tif", file, ["valley.tif", cause, cure])
    };
    let plane = [[1024, 1], [3072, 2056]];
    vec![
        of(
            "compressed by ZSTD",
            scenes::tif(50000, 1, false, &plane),
            "ZSTD",
            "gdal_translate -ot Float32 -co COMPRESS=DEFLATE",
        ),
        of(
            "compressed by LERC",
            scenes::tif(34887, 1, false, &plane),
            "unsupported",
            "gdal_translate -ot Float32 -co COMPRESS=DEFLATE",
        ),
        of("colour picture", scenes::tif(1, 3, false, &plane), "one band of heights", "gdal_translate -b 1"),
        of("raster that is turned", scenes::tif(1, 1, true, &plane), "turned against x and y", "gdalwarp"),
        of(
            "raster in degrees",
            scenes::tif(1, 1, false, &[[1024, 2], [2048, 4326]]),
            "degrees (geographic, EPSG:4326)",
            "gdalwarp",
        ),
        of(
            "map of a browser",
            scenes::tif(1, 1, false, &[[1024, 1], [3072, 3857]]),
            "stretches lengths",
            "gdalwarp",
        ),
        of(
            "heights in feet by their unit",
            scenes::tif(1, 1, false, &[plane[0], plane[1], [4099, 9002]]),
            "heights are in feet",
            "gdal_calc.py",
        ),
        of(
            "heights in feet by their code",
            scenes::tif(1, 1, false, &[plane[0], plane[1], [4096, 6360]]),
            "in US survey feet",
            "gdal_calc.py",
        ),
    ]
}

/// Terrains in other coordinates or axes.
fn coordinates() -> Vec<File> {
    vec![
        (
            "columns and rows exchanged",
            at(SURVEY),
            "valley.asc",
            scenes::valley().replace("ncols 60\nnrows 40", "ncols 40\nnrows 60").into(),
            ["valley.asc", "they are exchanged", "write ncols 60"],
        ),
        (
            "x and y exchanged",
            named("valley.xyz"),
            "valley.xyz",
            scenes::points(|_, [x, y, z]| format!("{y} {x} {z:.3}")).into(),
            ["scene.toml:4:12", "starts beside the terrain", "are x and y exchanged?"],
        ),
        (
            "points that are counted",
            named("valley.xyz"),
            "valley.xyz",
            scenes::points(|n, [x, y, z]| format!("{n} {x} {y} {z:.3}")).into(),
            ["valley.xyz", "counts the lines", "remove that column"],
        ),
        (
            "rock for the terrain",
            named("boulder.stl"),
            "boulder.stl",
            scenes::boulder(1.0, 0).into(),
            ["scene.toml:4:12", "starts beside the terrain", "the file of a rock?"],
        ),
        (
            "terrain on its side",
            named("hill.stl").replace(SURVEY, "[10.0, 20.0, 98.0]"),
            "hill.stl",
            scenes::hill(|[x, y, z]| [x, z, -y]).into(),
            ["scene.toml:4:12", "starts beside the terrain", "is y upward in the file?"],
        ),
    ]
}

/// Surfaces of rocks.
fn rocks() -> Vec<File> {
    vec![
        (
            "rock in mm",
            rocky(SURFACE),
            "boulder.stl",
            scenes::boulder(1e3, 0).into(),
            ["scene.toml:6:9", "800 m x 700 m x 600 m large", "scale = 0.001"],
        ),
        (
            "open rock",
            rocky(SURFACE),
            "boulder.stl",
            scenes::boulder(1.0, 2).into(),
            ["scene.toml:6:9", "the surface is open", "close_holes"],
        ),
        (
            "terrain for the rock",
            rocky(SURFACE),
            "boulder.stl",
            scenes::hill(|p| p).into(),
            ["scene.toml:6:9", "the surface is open", "[terrain] file"],
        ),
    ]
}

/// Spheres of a cluster.
fn clusters() -> Vec<File> {
    vec![
        (
            "cluster with a head line",
            rocky(CLUSTER),
            "spheres.txt",
            ("x,y,z,r\n".to_owned() + &scenes::spheres(1.0, 0.1, ",")).into(),
            ["scene.toml:7:16", "a line of column names?", "Put # before it"],
        ),
        (
            "cluster in mm",
            rocky(CLUSTER),
            "spheres.txt",
            scenes::spheres(1e3, 0.1, " ").into(),
            ["scene.toml:7:16", "fill a box of 800 m", "in millimetres"],
        ),
        (
            "cluster with semicolons",
            rocky(CLUSTER),
            "spheres.txt",
            scenes::spheres(1.0, 0.1, ";").into(),
            ["scene.toml:7:16", "not by semicolons", "blanks or commas"],
        ),
        (
            "surface for the cluster",
            rocky(CLUSTER),
            "spheres.txt",
            scenes::boulder(1.0, 0).into(),
            ["scene.toml:7:16", "a surface in STL", "type = \"mesh\""],
        ),
    ]
}

/// Meshes of nets.
fn nets() -> Vec<File> {
    vec![
        (
            "net in mm",
            MESH.into(),
            "net.msh",
            scenes::mesh(|p| p.map(|x| 1e3 * x)).into(),
            ["scene.toml:14:8", "an extent of 5656.8542 m", "scale it by 0.001"],
        ),
        (
            "net in km",
            MESH.into(),
            "net.msh",
            scenes::mesh(|p| p.map(|x| 1e-3 * x)).into(),
            ["scene.toml:14:8", "an extent of 0.0057 m", "scale it by 1000"],
        ),
        (
            "grid named .msh",
            MESH.into(),
            "net.msh",
            scenes::valley().into(),
            ["net.msh:1", "begins with $MeshFormat", "gmsh"],
        ),
    ]
}
