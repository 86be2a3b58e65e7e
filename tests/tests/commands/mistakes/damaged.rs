//! Files of another kind, cut short, empty, damaged, or of something else than the scene takes them for.

use super::scenes::{self, CABLE, MESH, NET, SLOPE};
use super::{Mistake, beside};

/// `scene` with the file `name` beside it; what is said begins with `place`.
fn with(
    (what, scene): (&'static str, String),
    (name, content): (&'static str, impl Into<Vec<u8>>),
    [place, cause, cure]: [&'static str; 3],
) -> Mistake {
    let mut files = beside(if scene.contains("valley.asc") { SLOPE } else { "" });
    files.retain(|(other, _)| *other != name);
    files.push((name, content.into()));
    Mistake { what, scene, files, set: None, refused: true, place, cause, cure }
}

/// On the slope, with `name` as its terrain.
fn terrain(what: &'static str, file: (&'static str, impl Into<Vec<u8>>), said: [&'static str; 3]) -> Mistake {
    with((what, SLOPE.replace("valley.asc", file.0)), file, said)
}

/// The same where the rock starts on the hill of an STL file.
fn hill(what: &'static str, factor: f64, said: [&'static str; 3]) -> Mistake {
    let scene = SLOPE.replace("valley.asc", "hill.stl");
    let scene = scene.replace("[2683010.0, 1247040.0, 1202.0]", "[10.0, 20.0, 98.0]");
    with((what, scene), ("hill.stl", scenes::hill(|p| p.map(|x| factor * x))), said)
}

/// On the slope, with `shape` as its rock.
fn rock(
    (what, shape): (&'static str, &str),
    file: (&'static str, impl Into<Vec<u8>>),
    said: [&'static str; 3],
) -> Mistake {
    let block = "{ type = \"box\", size = [0.8, 0.7, 0.6] }\ncluster.spheres = 27";
    with((what, SLOPE.replace(block, shape)), file, said)
}

/// With another net.
fn net(what: &'static str, file: (&'static str, impl Into<Vec<u8>>), said: [&'static str; 3]) -> Mistake {
    with((what, MESH.replace("net.msh", file.0)), file, said)
}

/// No scene at all.
fn scene(what: &'static str, text: String, said: [&'static str; 3]) -> Mistake {
    with((what, text), ("none", ""), said)
}

/// All of them.
pub fn of_damaged_files() -> Vec<Mistake> {
    [kinds_of_terrain(), heights(), surfaces(), clusters(), nets(), other_scenes()]
        .into_iter()
        .flatten()
        .collect()
}

/// Other formats, and files that are cut or empty.
fn kinds_of_terrain() -> Vec<Mistake> {
    let (grid, known) = (scenes::valley(), "known are .asc, .tif");
    vec![
        terrain(
            "points named .laz",
            ("valley.laz", scenes::points(|_, [x, y, z]| format!("{x} {y} {z:.3}"))),
            ["valley.laz", "a list of points", "name it valley.xyz"],
        ),
        terrain(
            "surface named .asc",
            ("valley.asc", scenes::hill(|p| p)),
            ["valley.asc", "a surface (STL)", "name it valley.stl"],
        ),
        terrain(
            "LAS named .xyz",
            ("valley.xyz", b"LASF\0\0\0\0".to_vec()),
            ["valley.xyz", "it is LAS or LAZ", "name it valley.las"],
        ),
        terrain(
            "ZIP named .asc",
            ("valley.asc", b"PK\x03\x04\0\0".to_vec()),
            ["valley.asc", "a ZIP archive", "unpack it first"],
        ),
        terrain("shape file", ("valley.shp", ""), ["valley.shp", "`.shp` is no terrain", known]),
        terrain("ZIP", ("valley.zip", "PK"), ["valley.zip", "`.zip` is no terrain", known]),
        terrain("picture", ("valley.png", "PNG"), ["valley.png", "`.png` is no terrain", known]),
        terrain("no extension", ("valley", grid.clone()), ["valley", "no extension that says", known]),
        terrain("empty", ("valley.asc", ""), ["valley.asc", "the file is empty", ""]),
        terrain(
            "cut short",
            ("valley.asc", &grid.as_bytes()[..grid.len() / 2]),
            ["valley.asc:26", "the file ends after", "of 60 x 40 = 2400 heights"],
        ),
        terrain(
            "header in another language",
            ("valley.asc", grid.replace("ncols", "spalten")),
            ["valley.asc:1", "`spalten` is no line of the header", "ESRI grid"],
        ),
        with(
            ("terrain that nothing uses", format!("{CABLE}[terrain]\nfile = \"valley.asc\"\n")),
            ("valley.asc", grid),
            ["scene.toml:15:1", "nothing will use [terrain]", "leave [terrain] out"],
        ),
    ]
}

/// Other units, signs and marks.
fn heights() -> Vec<Mistake> {
    let (grid, lifted) = (scenes::valley(), |z: f64| format!("{z:.3}"));
    let depths = scenes::grid(2.0, scenes::corner(), |z| format!("{:.3}", -z));
    let mut all = vec![
        hill("hill in mm", 1e3, ["hill.stl", "nothing on Earth is as high", "in metres"]),
        hill("hill in km", 1e-3, ["scene.toml:4:12", "starts beside the terrain", "in kilometres"]),
        terrain(
            "cells in mm",
            ("valley.asc", scenes::grid(2000.0, scenes::corner(), lifted)),
            ["scene.toml:4:12", "starts beside the terrain", "is its cell size in millimetres?"],
        ),
        terrain(
            "cells below 0",
            ("valley.asc", scenes::grid(-2.0, scenes::corner(), lifted)),
            ["valley.asc:5", "cellsize = -2", "above 0"],
        ),
        terrain(
            "points in km",
            ("valley.xyz", scenes::points(|_, p| p.map(|x| format!("{:.6}", 1e-3 * x)).join(" "))),
            ["scene.toml:4:12", "starts beside the terrain", "in kilometres"],
        ),
        terrain(
            "too many heights",
            ("valley.asc", grid.clone() + "1 2 3\n"),
            ["valley.asc:47", "`1` follows the last of 2400 heights", ""],
        ),
        terrain(
            "cells without height",
            ("valley.asc", grid.replace("1200.000", "-9999")),
            ["valley.asc", "1 of 2400 cells have no height", "nodata = \"cut\""],
        ),
        terrain(
            "another mark of cells without height",
            ("valley.asc", grid.replace("1200.000", "-32768")),
            ["valley.asc", "a mark of cells without height", "nodata_value = -32768.0"],
        ),
        terrain(
            "heights with separators",
            ("valley.asc", grid.replace(" 11", " 1,1")),
            ["valley.asc:7", "`1,199.297` is no height", "row 1, column 2"],
        ),
        with(
            ("start and heights as depths", SLOPE.replace("1202.0", "-1190.0")),
            ("valley.asc", depths.clone()),
            ["scene.toml:9:8", "no land lies below", "turn their sign round"],
        ),
        terrain(
            "heights as depths",
            ("valley.asc", depths),
            ["scene.toml:9:8", "no land lies below", "turn their sign round"],
        ),
    ];
    all.iter_mut().filter(|m| m.what.ends_with("as depths")).for_each(|m| m.refused = false);
    all
}

fn surfaces() -> Vec<Mistake> {
    let of = |how: &str| format!("{{ type = \"mesh\", file = \"boulder.stl\"{how} }}\ncluster.spheres = 8");
    let whole = scenes::boulder(1.0, 0);
    let corners = (0..8).map(|i| format!("v {} {} {}\n", i & 1, i >> 1 & 1, i >> 2)).collect::<String>();
    let as_obj = of("").replace(".stl", ".obj");
    let mut small = rock(
        ("scale the wrong way", &of(", scale = 0.001")),
        ("boulder.stl", whole.clone()),
        ["scene.toml:6:9", "is 0.0008 m x 0.0007 m x 0.0006 m large", "leave scale out"],
    );
    small.refused = false;
    vec![
        small,
        rock(
            ("rock in cm", &of("")),
            ("boulder.stl", scenes::boulder(100.0, 0)),
            ["scene.toml:6:9", "80 m x 70 m x 60 m large", "scale = 0.01"],
        ),
        rock(
            ("grid for the rock", &of("")),
            ("boulder.stl", scenes::valley()),
            ["scene.toml:6:9", "the header claims", "cut off, or not STL"],
        ),
        rock(
            ("rock cut short", &of("")),
            ("boulder.stl", &whole.as_bytes()[..whole.len() / 2]),
            ["scene.toml:6:9", "the file ends with it: cut off?", "Save it anew"],
        ),
        rock(
            ("piece that is not there", &of(", piece = 3")),
            ("boulder.stl", whole),
            ["scene.toml:6:9", "there is no piece 3", "counted from 1"],
        ),
        rock(
            ("OBJ without faces", &as_obj),
            ("boulder.obj", corners),
            ["scene.toml:6:9", "8 corners (`v x y z`) and no faces", "cut off"],
        ),
    ]
}

fn clusters() -> Vec<Mistake> {
    let of = "{ type = \"box\", size = [0.8, 0.7, 0.6] }\ncluster.file = \"spheres.txt\"";
    let right = scenes::spheres(1.0, 0.1, " ");
    let without: String =
        right.lines().map(|line| line.rsplit_once(' ').expect("words").0.to_owned() + "\n").collect();
    // 3 m further along x.
    let beside: String = right
        .lines()
        .map(|line| {
            let (x, rest) = line.split_once(' ').expect("words");
            format!("{} {rest}\n", 3.0 + x.parse::<f64>().expect("a number"))
        })
        .collect();
    let fill = "fill a box of";
    vec![
        rock(
            ("cluster of a larger rock", of),
            ("spheres.txt", scenes::spheres(2.5, 0.1, " ")),
            ["scene.toml:7:16", fill, "name the shape that it is of"],
        ),
        rock(
            ("cluster of a smaller rock", of),
            ("spheres.txt", scenes::spheres(0.2, 0.1, " ")),
            ["scene.toml:7:16", fill, "name the shape that it is of"],
        ),
        rock(
            ("cluster beside its rock", of),
            ("spheres.txt", beside),
            ["scene.toml:7:16", "lies 3 m x 0 m x 0 m off that of the shape", "in the shape's own axes"],
        ),
        rock(
            ("cluster without radii", of),
            ("spheres.txt", without),
            ["scene.toml:7:16", "a number is missing at the end of the line", "x y z r"],
        ),
        rock(
            (
                "file and number",
                &of.replace(".file = \"spheres.txt\"", " = { spheres = 27, file = \"spheres.txt\" }"),
            ),
            ("spheres.txt", right),
            ["scene.toml:7:23", "is read from a file as it is", "keep one of"],
        ),
    ]
}

fn nets() -> Vec<Mistake> {
    let right = scenes::mesh(|p| p);
    let cut = |at: &str| right.as_bytes()[..right.find(at).expect("there")].to_vec();
    let kinds = "known are .msh (Gmsh), .inp";
    let renamed = right.replace("\"net\"", "\"wires\"");
    let start = right.find("$PhysicalNames").expect("there");
    let end = right.find("$Nodes").expect("there");
    let unnamed = right[..start].to_owned() + &right[end..];
    let mut warned = vec![
        net(
            "net on its edge",
            ("net.msh", scenes::mesh(|[x, y, z]| [x, z, y - 2.0])),
            ["scene.toml:4:12", "does not reach the net", "put the rock before it"],
        ),
        net(
            "net in cm",
            ("net.msh", scenes::mesh(|p| p.map(|x| 100.0 * x))),
            ["scene.toml:14:8", "an extent of 565.6854 m", "save the mesh in metres"],
        ),
    ];
    warned.iter_mut().for_each(|m| m.refused = false);
    warned.extend([
        net(
            "net with other groups",
            ("net.msh", renamed),
            ["scene.toml:17:8", "no group of elements `net`", "known here: `frame`, `inner`, `wires`"],
        ),
        net(
            "net without groups",
            ("net.msh", unnamed),
            ["scene.toml:17:8", "no group of elements `net`", "known here"],
        ),
        net(
            "net in binary",
            ("net.msh", b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Nodes\n\x05\xfe".to_vec()),
            ["net.msh:2", "this is a binary mesh", "gmsh -0"],
        ),
        net("net as STL", ("net.stl", scenes::hill(|p| p)), ["net.stl", "what kind of mesh this is", kinds]),
        net(
            "script of Gmsh",
            ("net.geo", "Point(1) = {0,0,0};\n"),
            ["net.geo", "what kind of mesh this is", kinds],
        ),
        net(
            "script named .msh",
            ("net.msh", "Point(1) = {0,0,0};\n"),
            ["net.msh:1", "begins with $MeshFormat, this file with `Point(1)`", "gmsh -0"],
        ),
        net(
            "net cut in its elements",
            ("net.msh", cut("$EndElements")),
            ["net.msh", "the file ends where", "save it anew"],
        ),
        net(
            "net cut in its nodes",
            ("net.msh", cut("\n20 ")),
            ["net.msh", "the file ends where", "save it anew"],
        ),
    ]);
    warned
}

fn other_scenes() -> Vec<Mistake> {
    let toml = "a scene is a text file in TOML";
    let utf16: Vec<u8> = [0xfeff].into_iter().chain(NET.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    vec![
        scene(
            "JSON",
            "{\"end_time\": 1.0}\n".into(),
            ["scene.toml:1:1", "expected key", "this looks like JSON"],
        ),
        scene("mesh", scenes::mesh(|p| p), ["scene.toml:1:12", "expected `=`", toml]),
        scene("grid", scenes::valley(), ["scene.toml:1:7", "expected `=`", toml]),
        with(
            ("UTF-16", String::new()),
            ("scene.toml", utf16),
            ["scene.toml", "this is text in UTF-16", "save the scene as plain text in UTF-8"],
        ),
    ]
}
