//! What this program reads of a scene and writes as results, for `rockfall schema`.

use dem_contact::settings::{
    BoxSettings, ContactSettings, DemSettings, RockSettings, SpheresSettings, TerrainSettings,
};
use toolkit::schema::{Entry, Share, Tables};

/// Its tables and results.
pub fn share() -> Share {
    let surfaces = Entry::new(
        "fields/rock_surface.pvd",
        "rock",
        "1",
        "surfaces of the true solids: number of the rock of a triangle, counted from 0",
    );
    Tables::default()
        .key::<Vec<RockSettings>>("rock")
        .key::<Vec<ContactSettings>>("contact")
        .key::<TerrainSettings>("terrain")
        .key::<DemSettings>("dem")
        .key::<Vec<SpheresSettings>>("spheres")
        .key::<BoxSettings>("box")
        .results(&[Entry::table(RESULTS), vec![surfaces], Entry::table(ON_TERRAIN)].concat())
        .share()
}

/// As [`Entry::table`] reads it. Of several rocks each measure in the summary begins with `<rock>_`.
const RESULTS: &str = "
history.csv
    <rock>_{x,y,z} | m | position of the rock's centre of mass
    <rock>_{vx,vy,vz} | m/s | velocity of the rock's centre of mass
    <rock>_lowest | m | height of the lowest point of the rock's spheres, against gravity
    <rock>_{wx,wy,wz} | rad/s | angular velocity of the rock, along the axes of space
    <rock>_orientation_{w,x,y,z} | 1 | orientation of the rock's shape as a unit quaternion, as `orientation` in the scene
    energy_kinetic_dem | J | kinetic energy of all rocks, rotation included
    energy_potential_dem | J | potential energy of all rocks, counted from their start
    energy_stored_dem | J | energy of the springs of all contacts
    energy_dissipated_dem | J | energy that dashpots, friction and rolling resistance have dissipated
    energy_received_dem | J | work that the moving interface mesh has done on the rocks
    contacts | 1 | number of contacts
    fastest | m/s | `[[spheres]]` alone: speed of the fastest sphere; beside rocks, terrain or a structure `{spheres}_fastest`
    centre_of_mass_{x,y,z} | m | `[[spheres]]` alone: centre of mass of all spheres; beside others `{spheres}_centre_of_mass_{x,y,z}`
summary.json
    impact_speed | m/s | speed of the rock's centre of mass at first contact with the net
    time_of_impact | s | time of the impact
    impact_velocity_{x,y,z} | m/s | velocity of the centre of mass at the impact
    impact_direction_{x,y,z} | 1 | unit vector of that velocity: the impact direction
    impact_energy | J | kinetic energy of the rock at the impact
    max_deflection | m | impacts within 30 degrees of gravity: largest travel of the rock's lowest point (of its spheres) below the lowest point of the net at rest, along gravity
    max_travel | m | largest travel of the rock's centre from first contact along the impact direction
    max_elongation | m | largest displacement of any node of the net from rest along the impact direction, until something of the structure tears
    braking_time | s | first contact force to the first moment without speed along the impact direction
    rebound_speed | m/s | speed of the rock when its last contact ends on the rebound
    max_penetration | 1 | deepest overlap of a sphere over its radius; above 0.5 the contact law does not hold
    max_penetration_of_rocks | 1 | the same of two rocks in contact, over the radius of the smaller sphere
    runout_distance | m | terrain: horizontal distance from start to rest
    rest_{x,y,z} | m | terrain: where the rock's centre came to rest
    exit_distance | m | terrain: horizontal distance from the start to where the rock left the terrain
    max_jump_height | m | terrain: largest height of the rock's lowest point above the terrain under its centre, the first flight from the release included
    max_speed | m/s | terrain: largest speed of the rock's centre
    max_kinetic_energy | J | terrain: largest kinetic energy, rotation included
    impacts | 1 | terrain: number of impacts, each a contact after a flight
    contact_time_fraction | 1 | terrain: time in contact over the time to the end of the trajectory
summary.json: cost
    sub_steps | 1 | steps of the solvers, those of the contact solver times rocks; repeated windows included
    flight_windows | 1 | windows in which nothing was in reach, solved in closed form
    flight_steps | 1 | steps of free flight in closed form
    contact_evaluations | 1 | contact pairs evaluated, one for each step
    candidate_refreshes | 1 | searches of the broad phase
    neighbour_list_refreshes | 1 | updates of the list of elements near a rock
trajectory.csv
    time | s | time
    rock | 1 | number of the rock, counted from 0
    {x,y,z} | m | position of the centre of mass in the terrain's coordinates
    {vx,vy,vz} | m/s | velocity of the centre of mass
    {wx,wy,wz} | rad/s | angular velocity along the axes of space
    energy_translation | J | kinetic energy of translation
    energy_rotation | J | kinetic energy of rotation
    energy_potential | J | potential energy, counted from the start of the rock
    jump_height | m | height of the lowest point above the terrain under the centre; empty beside the terrain
    contact | 1 | 1 in contact, 0 in flight
    impacts | 1 | number of impacts so far
fields/rocks.pvd
    radius | m | radius of a sphere, at its centre
    rock | 1 | number of the rock, counted from 0
    velocity | m/s | velocity of the sphere's centre
";

/// Likewise, where there is terrain.
const ON_TERRAIN: &str = "
fields/terrain.vtu
    zone | 1 | number of the zone of a triangle
fields/trajectory.vtu
    time | s | time along a trajectory
    speed | m/s | speed along it
    jump_height | m | jump height along it
    rock | 1 | number of the rock
";
