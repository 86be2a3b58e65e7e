//! What this program reads of a scene and writes as results, for `rockfall schema`.

use dem_contact::settings::{
    BoxSettings, ContactSettings, DemSettings, RockSettings, SpheresSettings, TerrainSettings,
};
use toolkit::schema::{Entry, Share, Tables};

/// Its tables and results.
pub fn share() -> Share {
    Tables::default()
        .key::<Vec<RockSettings>>("rock")
        .key::<Vec<ContactSettings>>("contact")
        .key::<TerrainSettings>("terrain")
        .key::<DemSettings>("dem")
        .key::<Vec<SpheresSettings>>("spheres")
        .key::<BoxSettings>("box")
        .results(HISTORY)
        .results(MEASURES)
        .results(COUNTS)
        .results(TRAJECTORY)
        .results(FIELDS)
        .share()
}

const fn history(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("history.csv", name, unit, meaning)
}

const HISTORY: &[Entry] = &[
    history("<rock>_{x,y,z}", "m", "position of the rock's centre of mass"),
    history("<rock>_{vx,vy,vz}", "m/s", "velocity of the rock's centre of mass"),
    history("<rock>_lowest", "m", "height of the lowest point of the rock's spheres, against gravity"),
    history("<rock>_{wx,wy,wz}", "rad/s", "angular velocity of the rock, along the axes of space"),
    history(
        "<rock>_orientation_{w,x,y,z}",
        "1",
        "orientation of the rock's shape as a unit quaternion, as `orientation` in the scene",
    ),
    history("energy_kinetic_dem", "J", "kinetic energy of all rocks, rotation included"),
    history("energy_potential_dem", "J", "potential energy of all rocks, counted from their start"),
    history("energy_stored_dem", "J", "energy of the springs of all contacts"),
    history(
        "energy_dissipated_dem",
        "J",
        "energy that dashpots, friction and rolling resistance have dissipated",
    ),
    history("energy_received_dem", "J", "work that the moving interface mesh has done on the rocks"),
    history("contacts", "1", "number of contacts"),
    history(
        "fastest",
        "m/s",
        "`[[spheres]]` alone: speed of the fastest sphere; beside rocks, terrain or a structure `{spheres}_fastest`",
    ),
    history(
        "centre_of_mass_{x,y,z}",
        "m",
        "`[[spheres]]` alone: centre of mass of all spheres; beside others `{spheres}_centre_of_mass_{x,y,z}`",
    ),
];

/// Of several rocks each name begins with `<rock>_`.
const fn measure(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("summary.json", name, unit, meaning)
}

const MEASURES: &[Entry] = &[
    measure("impact_speed", "m/s", "speed of the rock's centre of mass at first contact with the net"),
    measure("time_of_impact", "s", "time of the impact"),
    measure("impact_velocity_{x,y,z}", "m/s", "velocity of the centre of mass at the impact"),
    measure("impact_direction_{x,y,z}", "1", "unit vector of that velocity: the impact direction"),
    measure("impact_energy", "J", "kinetic energy of the rock at the impact"),
    measure(
        "max_deflection",
        "m",
        "impacts within 30 degrees of gravity: largest travel of the rock's lowest point (of its spheres) below the lowest \
         point of the net at rest, along gravity",
    ),
    measure(
        "max_travel",
        "m",
        "largest travel of the rock's centre from first contact along the impact direction",
    ),
    measure(
        "max_elongation",
        "m",
        "largest displacement of any node of the net from rest along the impact direction, until something of the structure tears",
    ),
    measure(
        "braking_time",
        "s",
        "first contact force to the first moment without speed along the impact direction",
    ),
    measure("rebound_speed", "m/s", "speed of the rock when its last contact ends on the rebound"),
    measure(
        "max_penetration",
        "1",
        "deepest overlap of a sphere over its radius; above 0.5 the contact law does not hold",
    ),
    measure(
        "max_penetration_of_rocks",
        "1",
        "the same of two rocks in contact, over the radius of the smaller sphere",
    ),
    measure("runout_distance", "m", "terrain: horizontal distance from start to rest"),
    measure("rest_{x,y,z}", "m", "terrain: where the rock's centre came to rest"),
    measure(
        "exit_distance",
        "m",
        "terrain: horizontal distance from the start to where the rock left the terrain",
    ),
    measure(
        "max_jump_height",
        "m",
        "terrain: largest height of the rock's lowest point above the terrain under its centre",
    ),
    measure("max_speed", "m/s", "terrain: largest speed of the rock's centre"),
    measure("max_kinetic_energy", "J", "terrain: largest kinetic energy, rotation included"),
    measure("impacts", "1", "terrain: number of impacts, each a contact after a flight"),
    measure(
        "contact_time_fraction",
        "1",
        "terrain: time in contact over the time to the end of the trajectory",
    ),
];

const fn count(name: &'static str, meaning: &'static str) -> Entry {
    Entry::new("summary.json: cost", name, "1", meaning)
}

const COUNTS: &[Entry] = &[
    count(
        "sub_steps",
        "steps of the solvers, those of the contact solver times rocks; repeated windows included",
    ),
    count("flight_windows", "windows in which nothing was in reach, solved in closed form"),
    count("flight_steps", "steps of free flight in closed form"),
    count("contact_evaluations", "contact pairs evaluated, one for each step"),
    count("candidate_refreshes", "searches of the broad phase"),
    count("neighbour_list_refreshes", "updates of the list of elements near a rock"),
];

const fn trajectory(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("trajectory.csv", name, unit, meaning)
}

const TRAJECTORY: &[Entry] = &[
    trajectory("time", "s", "time"),
    trajectory("rock", "1", "number of the rock, counted from 0"),
    trajectory("{x,y,z}", "m", "position of the centre of mass in the terrain's coordinates"),
    trajectory("{vx,vy,vz}", "m/s", "velocity of the centre of mass"),
    trajectory("{wx,wy,wz}", "rad/s", "angular velocity along the axes of space"),
    trajectory("energy_translation", "J", "kinetic energy of translation"),
    trajectory("energy_rotation", "J", "kinetic energy of rotation"),
    trajectory("energy_potential", "J", "potential energy, counted from the start of the rock"),
    trajectory(
        "jump_height",
        "m",
        "height of the lowest point above the terrain under the centre; empty beside the terrain",
    ),
    trajectory("contact", "1", "1 in contact, 0 in flight"),
    trajectory("impacts", "1", "number of impacts so far"),
];

const fn field(file: &'static str, name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new(file, name, unit, meaning)
}

const FIELDS: &[Entry] = &[
    field("fields/rocks.pvd", "radius", "m", "radius of a sphere, at its centre"),
    field("fields/rocks.pvd", "rock", "1", "number of the rock, counted from 0"),
    field("fields/rocks.pvd", "velocity", "m/s", "velocity of the sphere's centre"),
    field("fields/rock_surface.pvd", "", "", "surfaces of the true solids"),
    field("fields/terrain.vtu", "zone", "1", "number of the zone of a triangle"),
    field("fields/trajectory.vtu", "time", "s", "time along a trajectory"),
    field("fields/trajectory.vtu", "speed", "m/s", "speed along it"),
    field("fields/trajectory.vtu", "jump_height", "m", "jump height along it"),
    field("fields/trajectory.vtu", "rock", "1", "number of the rock"),
];
