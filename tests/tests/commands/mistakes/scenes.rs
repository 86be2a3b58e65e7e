//! Scenes and files as users write them, without a mistake.

use std::f64::consts::TAU;

/// All of them, by name.
pub const ALL: [(&str, &str); 10] = [
    ("NET", NET),
    ("MESH", MESH),
    ("SLOPE", SLOPE),
    ("SPHERES", SPHERES),
    ("CABLE", CABLE),
    ("FALL", FALL),
    ("BARRIER", BARRIER),
    ("RINGS", RINGS),
    ("STUDY", STUDY),
    ("KIT", KIT),
];

/// A block above a generated net.
pub const NET: &str = r#"end_time = 0.8
gravity = [0.0, 0.0, -9.81]
[[rock]]
name = "block"
position = [0.0, 0.0, 1.0]
mass = 260.0
shape = { type = "box", size = [0.5, 0.5, 0.4] }
cluster.spheres = 64
[[contact]]
law = "hertz_mindlin"
young = 1e9
poisson = 0.2
restitution = 0.5
friction = 0.4
[structure]
generator = { type = "rectangular_net", cells = [20, 20], spacing = 0.2, center = [0.0, 0.0, 0.0] }
cable = { young = 1e11, area = 1.2e-5, density = 7850.0, radius = 0.002 }
damping = 5.0
[[gauge]]
name = "middle"
at = [0.0, 0.0, 0.0]
quantity = "displacement"
[coupling]
scheme = "strong"
time_window = 2e-4
[output]
interval = 0.01
fields = 0.05
"#;

/// A ball above a net from Gmsh.
pub const MESH: &str = r#"end_time = 0.8
gravity = [0.0, 0.0, -9.81]
[[rock]]
position = [2.0, 2.0, 1.0]
density = 2600.0
shape = { type = "sphere", radius = 0.3 }
[[contact]]
law = "hertz_mindlin"
young = 1e9
poisson = 0.2
restitution = 0.5
friction = 0.4
[structure]
mesh = "net.msh"
supports = [{ group = "frame" }]
[[structure.parts]]
name = "net"
element = "cable"
young = 1e11
area = 5e-5
density = 7850.0
radius = 0.004
rupture_force = 6e4
"#;

/// A block on a terrain.
pub const SLOPE: &str = r#"end_time = 5.0
gravity = [0.0, 0.0, -9.81]
[[rock]]
position = [2683010.0, 1247040.0, 1202.0]
density = 2600.0
shape = { type = "box", size = [0.8, 0.7, 0.6] }
cluster.spheres = 27
[terrain]
file = "valley.asc"
[[contact]]
law = "hertz_mindlin"
young = 3e10
poisson = 0.25
restitution = 0.3
friction = 0.6
"#;

/// Gravel in a box.
pub const SPHERES: &str = r#"end_time = 0.1
gravity = [0.0, 0.0, -9.81]
[[spheres]]
count = 300
radius = [0.009, 0.011]
density = 2500.0
[box]
lowest = [0.0, 0.0, 0.0]
highest = [0.2, 0.2, 0.2]
[[contact]]
law = "hertz_mindlin"
young = 1e7
poisson = 0.3
restitution = 0.3
friction = 0.5
"#;

/// A cable under a load, in statics.
pub const CABLE: &str = r#"end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
cables = [{ nodes = [0, 1] }, { nodes = [1, 2] }]
cable = { young = 1e11, area = 1e-4, density = 7850.0, prestress = 1e7 }
supports = [{ nodes = [0, 2] }]
loads = [{ nodes = [1], force = [0.0, 0.0, -500.0] }]
[[gauge]]
name = "middle"
at = [0.0, 0.0, 0.0]
quantity = "displacement"
[fem]
integrator = "static"
"#;

/// A block that flies into a barrier of one field.
pub const BARRIER: &str = r#"end_time = 0.5
gravity = [0.0, 0.0, -9.81]
[[rock]]
position = [0.0, -1.2, 2.0]
velocity = [0.0, 12.0, 0.0]
mass = 600.0
shape = { type = "ead_block", size = 0.7 }
cluster.spheres = 60
[[contact]]
law = "linear"
stiffness = 1e6
poisson = 0.2
restitution = 0.5
friction = 0.4
[structure]
supports = [{ group = "feet", rotations = "z" }, { group = "anchors" }]
[structure.generator]
type = "barrier"
fields = 1
lean = 1.0
cells = [6, 3]
[structure.cable]
young = 1e11
area = 1.6e-4
density = 7850.0
radius = 0.007
[[structure.parts]]
name = "net"
element = "cable"
area = 2.5e-5
radius = 0.003
[[structure.parts]]
name = "posts"
element = "beam"
young = 2.1e11
area = 5.4e-3
inertia = [2.5e-5, 9.2e-6]
torsion = 2e-7
density = 7850.0
radius = 0.08
[[structure.parts]]
name = "top_rope"
element = "sliding_cable"
young = 1e11
area = 1.6e-4
density = 7850.0
prestress = 5e7
radius = 0.007
[[structure.parts]]
name = "bottom_rope"
element = "sliding_cable"
young = 1e11
area = 1.6e-4
density = 7850.0
prestress = 5e7
radius = 0.007
[[structure.parts]]
name = "rope_brakes"
element = "brake"
stiffness = 5e6
curve = [[0.01, 5e4], [0.8, 7e4]]
stroke = 0.8
mass = 10.0
radius = 0.02
[[structure.parts]]
name = "upslope_brakes"
element = "brake"
stiffness = 5e6
curve = [[0.01, 5e4], [0.8, 7e4]]
stroke = 0.8
mass = 10.0
radius = 0.02
[[gauge]]
name = "feet"
group = "feet"
quantity = "force"
"#;

/// A ball above a net of rings.
pub const RINGS: &str = r#"end_time = 0.8
gravity = [0.0, 0.0, -9.81]
[[rock]]
position = [1.2, 1.2, 1.0]
mass = 150.0
shape = { type = "sphere", radius = 0.25 }
[[contact]]
law = "linear"
stiffness = 1e6
poisson = 0.2
restitution = 0.5
friction = 0.4
[structure]
[structure.generator]
type = "ring_net"
rings = [8, 8]
diameter = 0.3
[[structure.parts]]
name = "net"
element = "ring"
diameter = 0.3
perimeter_stiffness = 8e6
bending_stiffness = 1e5
mass = 0.5
radius = 0.007
"#;

/// A block that falls through nothing.
pub const FALL: &str = r#"end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[[rock]]
position = [0.0, 0.0, 10.0]
density = 2600.0
shape = { type = "box", size = [0.5, 0.4, 0.3] }
"#;

/// Twenty blocks on the terrain; the scene of one, `fall.toml`, is [`SLOPE`].
pub const STUDY: &str = r#"scene = "fall.toml"
seed = 1
[[release]]
name = "cliff"
polygon = [[2683004.0, 1247020.0], [2683012.0, 1247020.0], [2683012.0, 1247060.0], [2683004.0, 1247060.0]]
height = 1.0
count = 20
[vary]
volume = { lognormal = [0.3, 1.4] }
orientation = "uniform"
speed = { uniform = [0.0, 2.0] }
azimuth = { normal = [90.0, 15.0] }
[maps]
cell = 2.0
epsg = 2056
[[line]]
name = "road"
points = [[2683070.0, 1247005.0], [2683070.0, 1247075.0]]
"#;

/// A kit.
pub const KIT: &str = include_str!("../../../../launch/kits/example-100.toml");

/// Columns and rows of the terrain, its corner [m].
const COUNTS: [usize; 2] = [60, 40];
const CORNER: [f64; 2] = [2_683_000.0, 1_247_000.0];

/// Height of a cell [m]: a slope of one in two with bumps.
fn height(column: usize, row: usize) -> f64 {
    1200.0 - column as f64 + 0.3 * ((1.7 * column as f64 + 2.3 * row as f64) % TAU).sin()
}

/// The terrain as an ESRI grid with cells of `cell` m at `corner`, its heights by `show`.
pub fn grid(cell: f64, corner: [f64; 2], show: impl Fn(f64) -> String) -> String {
    let [columns, rows] = COUNTS;
    let [x, y] = corner;
    let mut text = format!(
        "ncols {columns}\nnrows {rows}\nxllcorner {x}\nyllcorner {y}\ncellsize {cell}\nNODATA_value -9999\n"
    );
    for row in 0..rows {
        let heights: Vec<String> = (0..columns).map(|column| show(height(column, row))).collect();
        text += &(heights.join(" ") + "\n");
    }
    text
}

/// A GeoTIFF of the same heights in single precision, packed by `compression` (1: not at all), with so many bands, its place by pixel
/// scale and tie point or turned, and geo keys.
pub fn tif(compression: u16, bands: u16, turned: bool, geo_keys: &[[u16; 2]]) -> Vec<u8> {
    let [columns, rows] = COUNTS;
    let heights = (0..rows).flat_map(|row| (0..columns).map(move |column| height(column, row) as f32));
    let data: Vec<u8> = heights.flat_map(|z| vec![z; bands.into()]).flat_map(f32::to_le_bytes).collect();
    let shorts = |values: &[u16]| (3u16, values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
    let long = |value: usize| (4u16, (value as u32).to_le_bytes().to_vec());
    let doubles = |values: &[f64]| (12u16, values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
    let north = CORNER[1] + 2.0 * rows as f64;
    let mut keys = vec![1, 1, 0, geo_keys.len() as u16];
    geo_keys.iter().for_each(|[key, value]| keys.extend([*key, 0, 1, *value]));
    let mut tags = vec![
        (256u16, long(columns)),
        (257, long(rows)),
        (258, shorts(&vec![32; bands.into()])),
        (259, shorts(&[compression])),
        (262, shorts(&[1])),
        (273, long(8)),
        (277, shorts(&[bands])),
        (278, long(rows)),
        (279, long(data.len())),
        (339, shorts(&vec![3; bands.into()])),
    ];
    match turned {
        false => {
            tags.push((33550, doubles(&[2.0, 2.0, 0.0])));
            tags.push((33922, doubles(&[0.0, 0.0, 0.0, CORNER[0], north, 0.0])));
        }
        true => {
            let rows = [[1.9, 0.5, 0.0, CORNER[0]], [0.5, -1.9, 0.0, north], [0.0; 4], [0.0, 0.0, 0.0, 1.0]];
            tags.push((34264, doubles(&rows.concat())));
        }
    }
    tags.push((34735, shorts(&keys)));
    // The image, what does not fit into the directory, the directory.
    let mut file = [b"II*\0".to_vec(), vec![0; 4], data].concat();
    let mut directory = (tags.len() as u16).to_le_bytes().to_vec();
    for (tag, (kind, mut bytes)) in tags {
        let count = bytes.len() / [0, 1, 1, 2, 4, 0, 0, 0, 0, 0, 0, 0, 8][usize::from(kind)];
        if bytes.len() > 4 {
            let at = file.len() as u32;
            file.extend(bytes);
            bytes = at.to_le_bytes().to_vec();
        }
        bytes.resize(4, 0);
        directory.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        directory.extend((count as u32).to_le_bytes());
        directory.extend(bytes);
    }
    let at = file.len() as u32;
    file[4..8].copy_from_slice(&at.to_le_bytes());
    [file, directory, vec![0; 4]].concat()
}

/// The same, right in everything.
pub fn valley() -> String {
    grid(2.0, CORNER, |z| format!("{z:.3}"))
}

/// The corner of the valley [m].
pub fn corner() -> [f64; 2] {
    CORNER
}

/// The valley as points, each line by `line` of its number, x, y and z.
pub fn points(line: impl Fn(usize, [f64; 3]) -> String) -> String {
    let [columns, rows] = COUNTS;
    let cell = |n: usize| {
        let (column, row) = (n % columns, n / columns);
        [CORNER[0] + 2.0 * column as f64, CORNER[1] + 2.0 * row as f64, height(column, row)]
    };
    (0..columns * rows).map(|n| line(n, cell(n)) + "\n").collect()
}

/// A box of 0.8 m x 0.7 m x 0.6 m in STL, times `scale`, without its first `left_out` triangles.
pub fn boulder(scale: f64, left_out: usize) -> String {
    let half = [0.4, 0.35, 0.3];
    let at = |i: usize| [0, 1, 2].map(|b| scale * if i >> b & 1 == 1 { half[b] } else { -half[b] });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).map(|t| t.map(at));
    stl(triangles.skip(left_out))
}

/// A slope of 80 m x 40 m in STL, each corner by `turn`.
pub fn hill(turn: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let at = |i: usize, j: usize| turn([2.0 * i as f64, 2.0 * j as f64, 100.0 - i as f64]);
    let cells = (0..20).flat_map(|j| (0..40).map(move |i| (i, j)));
    stl(cells.flat_map(|(i, j)| {
        [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    }))
}

fn stl(triangles: impl Iterator<Item = [[f64; 3]; 3]>) -> String {
    let mut text = String::from("solid s\n");
    for corners in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        corners.iter().for_each(|[x, y, z]| text += &format!("vertex {x} {y} {z}\n"));
        text += "endloop\nendfacet\n";
    }
    text + "endsolid s\n"
}

/// Spheres that fill the boulder, in lengths times `scale`, with these radii [m] and separators.
pub fn spheres(scale: f64, radius: f64, separator: &str) -> String {
    let mut text = String::new();
    for x in [-0.3, -0.1, 0.1, 0.3] {
        for y in [-0.25, 0.0, 0.25] {
            for z in [-0.2, 0.0, 0.2] {
                let numbers = [x, y, z, radius].map(|v| (scale * v).to_string());
                text += &(numbers.join(separator) + "\n");
            }
        }
    }
    text
}

/// The net of Gmsh, its nodes by `turn`.
pub fn mesh(turn: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let text = std::fs::read_to_string(tests::repository().join("launch/scenes/data/net-5x5-v22.msh"))
        .expect("a mesh");
    let (mut inside, mut out) = (false, String::new());
    for line in text.lines() {
        inside = (inside || line == "$Nodes") && line != "$EndNodes";
        let words: Vec<&str> = line.split(' ').collect();
        match (inside, &words[..]) {
            (true, [number, place @ ..]) if place.len() == 3 => {
                let [x, y, z] = turn([0, 1, 2].map(|a| place[a].parse().expect("a number")));
                out += &format!("{number} {x} {y} {z}\n");
            }
            _ => out += &format!("{line}\n"),
        }
    }
    out
}
