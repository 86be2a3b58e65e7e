//! What this program reads of a scene and writes as results, for `rockfall schema`.

use crate::config::{FemConfig, GaugeConfig, StructureConfig};
use interface_defs::toolkit::schema::{Entry, Share, Tables};
use interface_defs::toolkit::start_from::{self, StartFrom};

/// Its tables and results.
pub fn share() -> Share {
    Tables::default()
        .key::<StructureConfig>("structure")
        .key::<FemConfig>("fem")
        .key::<Vec<GaugeConfig>>("gauge")
        .value::<StartFrom>(start_from::KEY, start_from::MEANING)
        .results(HISTORY)
        .results(MEASURES)
        .results(COUNTS)
        .results(FIELDS)
        .share()
}

const fn history(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("history.csv", name, unit, meaning)
}

const HISTORY: &[Entry] = &[
    history("reaction_{x,y,z}", "N", "force of all supports on the structure, mean over the row's window"),
    history("<gauge>_{ux,uy,uz}", "m", "gauge `displacement` at a point: since t = 0"),
    history("<gauge>_{ux,uy,uz}_mean", "m", "the same, mean over the nodes of a group"),
    history("<gauge>_{vx,vy,vz}", "m/s", "gauge `velocity` at a point"),
    history("<gauge>_{vx,vy,vz}_mean", "m/s", "the same, mean over the nodes of a group"),
    history("<gauge>_{fx,fy,fz}", "N", "gauge `force` at a point: force of the supports, mean over the row"),
    history("<gauge>_{fx,fy,fz}_sum", "N", "the same, sum over a group"),
    history(
        "<gauge>_force_{min,max}",
        "N",
        "smallest and largest magnitude of the support force at one node of a group",
    ),
    history("<gauge>_tension", "N", "gauge `tension` of one member: axial force, compression negative"),
    history(
        "<gauge>_tension_{min,max}",
        "N",
        "the same of the most compressed and the most stretched member of a group",
    ),
    history("<gauge>_elongation", "m", "gauge `elongation` of one member: against the length as modelled"),
    history("<gauge>_elongation_{min,max}", "m", "smallest and largest elongation of the members of a group"),
    history(
        "<gauge>_bending_moment",
        "N m",
        "gauge `bending_moment` of one beam: magnitude, of both planes together",
    ),
    history(
        "<gauge>_bending_moment_{min,max}",
        "N m",
        "the same of the least and the most bent beam of a group, at the more bent of its ends",
    ),
    history(
        "<gauge>_height",
        "m",
        "gauge `height`: height left between two groups; with `posts`, the least of the fields",
    ),
    history("<gauge>_height_<field>", "m", "the same of each field between two posts, from 1"),
    history("energy_kinetic_fem", "J", "kinetic energy of the structure"),
    history(
        "energy_potential_fem",
        "J",
        "potential energy of the structure in gravity and under constant loads",
    ),
    history("energy_stored_fem", "J", "elastic energy of the structure"),
    history(
        "energy_dissipated_fem",
        "J",
        "energy that brakes, plastic strain, friction, dashpots and rupture have dissipated",
    ),
    history(
        "energy_received_fem",
        "J",
        "work of the contact forces on the structure; along a path (`path_speed`) that of all loads",
    ),
    history("energy_loads_fem", "J", "work that loads with a history and pressures have done, negated"),
    history("energy_supports_fem", "J", "work that moving supports have done, negated"),
    history("load_factor", "1", "`fem.path_speed`: factor of the loads"),
    history(
        "negative_pivots",
        "1",
        "`fem.path_speed`: directions in which the equilibrium is unstable; 0 = it is stable",
    ),
];

const fn measure(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("summary.json", name, unit, meaning)
}

const MEASURES: &[Entry] = &[
    measure(
        "<gauge>_<quantity>_min",
        "",
        "smallest value of a gauge at any solver step, unit of the gauge; of a group's tension or elongation, that of the smallest member",
    ),
    measure("<gauge>_<quantity>_max", "", "largest value of a gauge at any solver step, unit of the gauge"),
    measure("<gauge>_height_end", "m", "gauge `height`: residual height at the end"),
    measure("<gauge>_height_<field>_end", "m", "the same of each field between two posts, from 1"),
    measure(
        "max_reaction",
        "N",
        "largest magnitude of the total support reaction, dead load included, at any solver step",
    ),
    measure("max_reaction_1ms", "N", "the same of its mean over any 1 ms; the one to compare"),
    measure("max_cable_force", "N", "largest axial force of any cable"),
    measure(
        "critical_load_factor",
        "1",
        "`fem.path_speed`: load factor of the first limit point or branch point",
    ),
    measure(
        "limit_point_<n>",
        "1",
        "`fem.path_speed`: load factor where the load turns back, one by one along the path",
    ),
    measure(
        "branch_point_<n>",
        "1",
        "`fem.path_speed`: load factor where another path of equilibrium crosses",
    ),
    measure("sag", "m", "sag of the structure at rest under its own weight"),
];

const fn count(name: &'static str, meaning: &'static str) -> Entry {
    Entry::new("summary.json: cost", name, "1", meaning)
}

const COUNTS: &[Entry] = &[
    count("newton_iterations", "Newton iterations, those of form finding included"),
    count(
        "skipped_windows",
        "committed windows in which nothing loaded or moved the structure, which was not computed",
    ),
    count("factorisations", "factorisations of the tangent matrix"),
    count("kept_factors", "factorisations saved, as the tangent had not changed"),
    count("refined_windows", "windows in which Newton failed and that were repeated with shorter steps"),
    count("refused_steps", "`fem.path_speed`, `fem.load_steps`: steps that were shortened and taken anew"),
    count("shifted_tangents", "steps with a tangent matrix that was not positive definite and was shifted"),
];

const fn field(file: &'static str, name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new(file, name, unit, meaning)
}

const FIELDS: &[Entry] = &[
    field(
        "fields/structure.pvd",
        "displacement",
        "m",
        "displacement of a node from the structure as modelled",
    ),
    field("fields/structure.pvd", "velocity", "m/s", "velocity of a node"),
    field("fields/structure.pvd", "part", "1", "number of the part, named in `structure_legend.json`"),
    field(
        "fields/structure.pvd",
        "group",
        "1",
        "number of the group of a line or node, named in `structure_legend.json`",
    ),
    field("fields/structure.pvd", "axial_force", "N", "axial force of a line; `tension` is its old name"),
    field("fields/structure.pvd", "stress", "Pa", "axial stress, where the section is known"),
    field("fields/structure.pvd", "utilisation", "1", "force over strength; 0 where no strength is given"),
    field(
        "fields/structure.pvd",
        "bending_moment_{1,2}_{start,end}",
        "N m",
        "bending moments of a beam at its two ends",
    ),
    field("fields/structure.pvd", "torsion", "N m", "torsional moment of a beam"),
    field("fields/structure.pvd", "slack", "1", "1 where nothing is carried"),
    field("fields/structure.pvd", "broken", "1", "1 where an element is broken"),
    field(
        "fields/structure_faces.pvd",
        "stress_{1,2}",
        "Pa",
        "largest and smallest principal stress of a membrane or shell",
    ),
    field("fields/structure_faces.pvd", "force_{1,2}", "N/m", "the same per width: stress times thickness"),
    field(
        "fields/structure_faces.pvd",
        "moment_{1,2}",
        "N m/m",
        "largest and smallest principal bending moment of a shell per width",
    ),
    field("fields/structure_faces.pvd", "slack", "1", "1 where a membrane carries nothing"),
];
