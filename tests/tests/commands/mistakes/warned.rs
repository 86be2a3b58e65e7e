//! What someone might mean: one replacement in a scene, and the warning.

use super::Row;
use super::scenes::{CABLE, MESH, NET, SLOPE, SPHERES};

/// What someone might mean.
pub const WARNED: &[Row] = &[
    // Units.
    (
        "spacing of a net in cm",
        NET,
        ["spacing = 0.2", "spacing = 20.0"],
        ["16:13", "an extent of 565.6854 m", "are these centimetres"],
    ),
    (
        "modulus of a wire in MPa",
        NET,
        ["young = 1e11", "young = 1e5"],
        ["17:19", "softer than rubber", "in MPa, it would be 1e11 Pa"],
    ),
    (
        "modulus of a wire in kPa",
        NET,
        ["young = 1e11", "young = 1e8"],
        ["17:19", "softer than plastic", "in kPa, it would be 1e11"],
    ),
    (
        "diameter of a wire for its radius",
        NET,
        ["radius = 0.002", "radius = 0.004"],
        ["17:67", "twice the radius of a rod", "Then write 0.002"],
    ),
    ("density of steel in g/cm3", NET, ["7850.0", "7.85"], ["17:50", "that of a foam", "steel has 7850"]),
    (
        "prestress as a force",
        NET,
        ["radius = 0.002", "radius = 0.002, prestress = 5e10"],
        ["17:86", "more than any wire bears", "100 MPa is 1e8"],
    ),
    (
        "strain at rupture in percent",
        MESH,
        ["rupture_force = 6e4", "rupture_strain = 5.0"],
        ["23:18", "no percentage", "5 % is 0.05"],
    ),
    (
        "density of a rock in lb/ft3",
        SLOPE,
        ["2600.0", "165.0"],
        ["5:11", "a density of 165 kg/m3", "in lb/ft3, it would be 2643"],
    ),
    (
        "speed in km/h",
        NET,
        ["mass = 260.0", "velocity = [0.0, 0.0, -90.0]\nmass = 260.0"],
        ["6:12", "starts with 90 m/s", "it would be 25 m/s"],
    ),
    (
        "spin in degrees per second",
        SLOPE,
        ["density = 2600.0", "density = 2600.0\nangular_velocity = [0.0, 360.0, 0.0]"],
        ["6:20", "spins with 360 rad/s", "6.283 rad/s"],
    ),
    (
        "modulus of rock in MPa",
        SLOPE,
        ["3e10", "30000"],
        ["12:9", "a young of 3e4 Pa", "it would be 3e10 Pa"],
    ),
    (
        "friction as an angle",
        SLOPE,
        ["friction = 0.6", "friction = 31.0"],
        ["15:12", "slopes of 88 degrees hold", "would be 0.601"],
    ),
    (
        "rolling friction as a length in mm",
        SLOPE,
        ["friction = 0.6", "friction = 0.6\nrolling_friction = 50.0"],
        ["16:20", "a rolling friction of 50", "over the radius"],
    ),
    ("end_time in ms", NET, ["end_time = 0.8", "end_time = 800.0"], ["1:12", "7848 m/s", "end_time = 0.8"]),
    (
        "end_time shorter than the fall",
        NET,
        ["end_time = 0.8", "end_time = 0.1"],
        ["5:12", "does not reach the net", "it gets there at"],
    ),
    (
        "window in ms",
        NET,
        ["time_window = 2e-4", "time_window = 0.2"],
        ["25:15", "an impact is not resolved", "time_window = 2e-4"],
    ),
    (
        "interval of fields in ms",
        NET,
        ["fields = 0.05", "fields = 50.0"],
        ["28:10", "longer than the run", "fields = 0.05"],
    ),
    (
        "energy_error in percent",
        NET,
        ["+", "[limits]\nenergy_error = 10\n"],
        ["30:16", "a bound of 1000 %", "energy_error = 0.1"],
    ),
    (
        "deflection_error in percent",
        NET,
        ["+", "[limits]\ndeflection_error = 1\n"],
        ["30:20", "a bound of 100 %", "deflection_error = 0.01"],
    ),
    (
        "box of gravel in mm",
        SPHERES,
        ["[0.2, 0.2, 0.2]", "[200.0, 200.0, 200.0]"],
        ["7:1", "200 m x 200 m x 200 m", "200 mm is 0.2"],
    ),
    (
        "rest_time in ms",
        SLOPE,
        ["file = \"valley.asc\"", "file = \"valley.asc\"\nrest_time = 500.0"],
        ["10:13", "longer than the run", "500 ms is 0.5"],
    ),
    (
        "prestress in MPa",
        NET,
        ["radius = 0.002", "radius = 0.002, prestress = 100.0"],
        ["17:86", "strains it by 1.0e-9 only", "it would be 1e8 Pa"],
    ),
    // Signs.
    (
        "gravity up over a net",
        NET,
        ["-9.81", "9.81"],
        ["5:12", "does not reach the net", "gravity = [0.0, 0.0, -9.81]"],
    ),
    (
        "velocity away from the net",
        NET,
        ["[0.0, 0.0, 1.0]", "[0.0, 0.0, 1.0]\nvelocity = [0.0, 0.0, 12.0]"],
        ["5:12", "does not reach the net", "velocity = [0.0, 0.0, -12.0]"],
    ),
    (
        "depth counted as height",
        NET,
        ["[0.0, 0.0, 1.0]", "[0.0, 0.0, -1.0]"],
        ["5:12", "does not reach the net", "position = [0.0, 0.0, 1.0]"],
    ),
    (
        "slack for tension",
        NET,
        ["radius = 0.002", "radius = 0.002, prestress = -1e9"],
        ["17:86", "1.0 % longer", "a tension is above 0"],
    ),
    (
        "gravity up, a structure alone",
        CABLE,
        ["-9.81", "9.81"],
        ["2:11", "points up along z", "[0.0, 0.0, -9.81]"],
    ),
    // Others.
    (
        "rock beside the net",
        NET,
        ["[0.0, 0.0, 1.0]", "[3.5, 0.0, 1.0]"],
        ["5:12", "does not reach the net", "put the rock before it"],
    ),
    (
        "second rock beside the net",
        NET,
        [
            "[[contact]]",
            "[[rock]]\nname = \"stone\"\nposition = [9.0, 0.0, 1.0]\nmass = 60.0\nshape = { type = \"sphere\", radius = 0.18 }\n[[contact]]",
        ],
        ["11:12", "rock `stone` does not reach the net", "put the rock before it"],
    ),
    (
        "key that weak coupling ignores",
        NET,
        [
            "scheme = \"strong\"\ntime_window = 2e-4",
            "scheme = \"weak\"\ntime_window = 2e-5\nmax_iterations = 20",
        ],
        ["26:18", "nothing uses it", "scheme = \"strong\""],
    ),
    (
        "load on a support",
        CABLE,
        ["nodes = [1], force", "nodes = [2], force"],
        ["8:10", "moves nothing", "name nodes that are free"],
    ),
];
