//! What no one can mean: one replacement in a scene, and the error.

use super::Row;
use super::scenes::{CABLE, FALL, MESH, NET, SLOPE, SPHERES};

/// What no one can mean.
pub const REFUSED: &[Row] = &[
    // Units.
    (
        "spacing of a net in mm",
        NET,
        ["spacing = 0.2", "spacing = 200.0"],
        ["16:13", "an extent of 5656.8542 m", "150 mm is 0.15"],
    ),
    (
        "modulus of a wire in GPa",
        NET,
        ["young = 1e11", "young = 100.0"],
        ["17:19", "young = 100 Pa is softer than rubber", "were it in GPa, it would be 1e11 Pa"],
    ),
    ("area of a wire in mm2", NET, ["1.2e-5", "12.0"], ["17:32", "a rod 3.909 m thick", "240 mm2 is 2.4e-4"]),
    (
        "radius of a wire in mm",
        NET,
        ["radius = 0.002", "radius = 2.0"],
        ["17:67", "radius is 2 m", "8 mm is 0.008"],
    ),
    (
        "density of steel in t/mm3",
        NET,
        ["7850.0", "7.85e-9"],
        ["17:50", "lighter than air", "in t/mm3, it would be 7850 kg/m3"],
    ),
    (
        "zone in local coordinates",
        SLOPE,
        ["+", "[[terrain.zone]]\npolygon = [[0, 0], [50, 0], [50, 40]]\nmaterial = \"forest\"\n"],
        ["17:11", "it covers nothing", "in the terrain's coordinates"],
    ),
    (
        "zone of which two corners are exchanged",
        SLOPE,
        [
            "+",
            "[[terrain.zone]]\npolygon = [[2683005, 1247010], [2683055, 1247050], [2683055, 1247010], [2683005, 1247050]]\n\
             material = \"forest\"\n",
        ],
        ["17:11", "the polygon crosses itself", "in order around it"],
    ),
    (
        "zone smaller than a cell",
        SLOPE,
        [
            "+",
            "[[terrain.zone]]\npolygon = [[2683020, 1247030], [2683020.01, 1247030], [2683020.01, 1247030.01]]\nmaterial = \"road\"\n",
        ],
        ["17:11", "no triangle of the terrain has its middle in it", "larger than a cell"],
    ),
    (
        "strength of a wire in kN",
        MESH,
        ["6e4", "60.0"],
        ["23:17", "breaks under 100 % of the dead load alone", "300 kN is 3e5"],
    ),
    (
        "mass of a block in tonnes",
        NET,
        ["mass = 260.0", "mass = 0.26"],
        ["6:8", "as in tonnes", "mass = 260.0"],
    ),
    (
        "density of a rock in g/cm3",
        SLOPE,
        ["2600.0", "2.6"],
        ["5:11", "density = 2.6 kg/m3", "in g/cm3 or t/m3, it would be 2600 kg/m3"],
    ),
    (
        "edges of a box in mm",
        NET,
        ["[0.5, 0.5, 0.4]", "[500, 500, 400]"],
        ["7:9", "500 m x 500 m x 400 m large", "in millimetres, it would be 0.5 m"],
    ),
    (
        "edges of a box in cm",
        NET,
        ["[0.5, 0.5, 0.4]", "[50, 50, 40]"],
        ["7:9", "50 m x 50 m x 40 m large", "in centimetres, it would be 0.5 m"],
    ),
    (
        "orientation by three angles",
        SLOPE,
        ["density = 2600.0", "density = 2600.0\norientation = [0.0, 0.0, 45.0]"],
        ["6:15", "3 values where 4 are needed", "[w, x, y, z]"],
    ),
    ("gravity in mm/s2", NET, ["-9.81", "-9810.0"], ["2:11", "in mm/s2?", "[0.0, 0.0, -9.81]"]),
    (
        "modulus of rock in GPa",
        SLOPE,
        ["3e10", "30"],
        ["12:9", "young = 30 Pa is the Young's modulus of no solid", "in GPa, it would be 3e10 Pa"],
    ),
    (
        "restitution in percent",
        SLOPE,
        ["restitution = 0.3", "restitution = 30"],
        ["14:15", "a restitution of 30", "restitution = 0.3"],
    ),
    (
        "damping ratio in percent",
        SLOPE,
        ["restitution = 0.3", "damping_ratio = 20"],
        ["14:17", "damping_ratio = 20 is more than 1", "in per cent, it would be 0.2"],
    ),
    (
        "Poisson's ratio in percent",
        SLOPE,
        ["poisson = 0.25", "poisson = 25"],
        ["13:11", "a Poisson's ratio of 25", "poisson = 0.25"],
    ),
    (
        "start in km",
        SLOPE,
        ["[2683010.0, 1247040.0, 1202.0]", "[2683.01, 1247.04, 1.202]"],
        ["4:12", "starts beside the terrain", "in kilometres? Then write position = [2683010.0"],
    ),
    (
        "start in longitude and latitude",
        SLOPE,
        ["2683010.0, 1247040.0", "8.5401, 47.3702"],
        ["4:12", "starts beside the terrain", "longitude and latitude"],
    ),
    (
        "window longer than the run",
        NET,
        ["time_window = 2e-4", "time_window = 2.0"],
        ["25:15", "longer than the run", "0.2 ms is 2e-4"],
    ),
    (
        "interval of rows in nanoseconds",
        NET,
        ["interval = 0.01", "interval = 1e-9"],
        ["27:12", "8.0e8 rows", "interval = 0.004"],
    ),
    (
        "penetration in percent",
        NET,
        ["+", "[limits]\npenetration = 50\n"],
        ["30:15", "a bound of 50 radii", "perhaps 0.5"],
    ),
    (
        "deadline in ms",
        NET,
        ["+", "[processes]\ntimeout = 60000000\n"],
        ["30:11", "a deadline of 60000000 s", "written in seconds"],
    ),
    (
        "motion of a support in mm",
        CABLE,
        [
            "{ nodes = [0, 2] }",
            "{ nodes = [0] }, { nodes = [2], motion = [[0.0, 0.0, 0.0, 0.0], [1.0, 100.0, 0.0, 0.0]] }",
        ],
        ["7:54", "moves by 100 m", "100 mm is 0.1"],
    ),
    (
        "radius of gravel in mm",
        SPHERES,
        ["[0.009, 0.011]", "[9.0, 11.0]"],
        ["5:10", "a sphere 22 m", "9 mm is 0.009"],
    ),
    (
        "rest_speed in mm/s",
        SLOPE,
        ["file = \"valley.asc\"", "file = \"valley.asc\"\nrest_speed = 10.0"],
        ["10:14", "not at rest", "10 mm/s is 0.01"],
    ),
    (
        "load with its unit",
        CABLE,
        ["-500.0", "\"-0.5 kN\""],
        ["8:44", "expected a number", "without its unit, in SI units: -500"],
    ),
    // Signs.
    (
        "gravity up on a terrain",
        SLOPE,
        ["-9.81", "9.81"],
        ["2:11", "points up", "gravity = [0.0, 0.0, -9.81]"],
    ),
    ("start under the terrain", SLOPE, ["1202.0", "1152.0"], ["4:12", "m below the terrain", "try position"]),
    (
        "friction below 0",
        NET,
        ["friction = 0.4", "friction = -0.4"],
        ["14:12", "friction = -0.4", "friction = 0.4"],
    ),
    (
        "corners of a box exchanged",
        SPHERES,
        [
            "lowest = [0.0, 0.0, 0.0]\nhighest = [0.2, 0.2, 0.2]",
            "lowest = [0.2, 0.2, 0.2]\nhighest = [0.0, 0.0, 0.0]",
        ],
        ["9:11", "reaches from 0.2 to 0 m", "exchange them"],
    ),
    // Others.
    (
        "key misspelt",
        NET,
        ["mass = 260.0", "masse = 260.0"],
        ["6:1", "unknown key `masse`", "did you mean `mass`?"],
    ),
    ("[rock] for [[rock]]", NET, ["[[rock]]", "[rock]"], ["3:1", "expected an array", "[[rock]]"]),
    (
        "no shape",
        NET,
        ["shape = { type = \"box\", size = [0.5, 0.5, 0.4] }\n", ""],
        ["3:1", "`shape` is missing", "docs/reference.md"],
    ),
    (
        "shape as text",
        NET,
        ["{ type = \"box\", size = [0.5, 0.5, 0.4] }", "\"box\""],
        ["7:9", "expected a table", "shape = { type = \"box\""],
    ),
    (
        "spheres as cluster = 64",
        NET,
        ["cluster.spheres = 64", "cluster = 64"],
        ["8:11", "expected a table", "cluster.spheres = 64"],
    ),
    (
        "gravity as one number",
        NET,
        ["[0.0, 0.0, -9.81]", "9.81"],
        ["2:11", "expected an array of length 3", "[0.0, 0.0, -9.81]"],
    ),
    (
        "decimal comma",
        NET,
        ["mass = 260.0", "mass = 260,0"],
        ["6:11", "unexpected key or value", "a decimal comma?"],
    ),
    (
        "number in quotes",
        NET,
        ["mass = 260.0", "mass = \"260\""],
        ["6:8", "expected a number", "without quotes: 260"],
    ),
    (
        "no law for a net",
        NET,
        [
            "[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e9\npoisson = 0.2\nrestitution = 0.5\nfriction = 0.4\n",
            "",
        ],
        ["9:1", "no contact law", "add a table [[contact]]"],
    ),
    (
        "every node held",
        MESH,
        ["{ group = \"frame\" }", "{ group = \"frame\" }, { group = \"inner\" }"],
        ["15:12", "hold all 25 nodes", "hold the frame alone"],
    ),
    (
        "net that nothing holds",
        MESH,
        ["supports = [{ group = \"frame\" }]\n", ""],
        ["13:1", "nothing holds node", "add supports"],
    ),
    (
        "group that is not there",
        NET,
        ["at = [0.0, 0.0, 0.0]\nq", "group = \"posts\"\nq"],
        ["21:9", "no group `posts`", "known here: `edges`"],
    ),
    (
        "mesh and generator",
        NET,
        ["[structure]", "[structure]\nmesh = \"net.msh\""],
        ["16:8", "either a mesh file or a generator", "keep either"],
    ),
    (
        "rock that starts in the net",
        NET,
        ["[0.0, 0.0, 1.0]", "[0.0, 0.0, 0.1]"],
        ["5:12", "starts inside the net", "try position"],
    ),
    (
        "table that nothing uses",
        SLOPE,
        ["+", "[coupling]\nscheme = \"weak\"\n"],
        ["16:1", "nothing will use [coupling]", "leave [coupling] out"],
    ),
    (
        "end_time below a table",
        FALL,
        ["end_time = 1.0\n", "[output]\nend_time = 1.0\n"],
        ["2:1", "unknown key `end_time`", "before the first [table]"],
    ),
    (
        "more spheres than fit",
        SPHERES,
        ["count = 300", "count = 30000"],
        ["4:9", "has room for 729", "fewer spheres"],
    ),
];
