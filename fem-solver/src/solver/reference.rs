//! What this program reads of a scene and writes as results, for `rockfall schema`.

use crate::config::{FemConfig, GaugeConfig, StructureConfig};
use toolkit::schema::{Entry, Share, Tables};
use toolkit::start_from::{self, StartFrom};
use toolkit::{kit, library};

/// Its tables and results.
pub fn share() -> Share {
    let mut share = Tables::default()
        .key::<StructureConfig>("structure")
        .key::<FemConfig>("fem")
        .key::<Vec<GaugeConfig>>("gauge")
        .value::<StartFrom>(start_from::KEY, start_from::MEANING)
        .results(RESULTS)
        .share();
    // It is put in place where a scene is read, and never seen here.
    let about = serde_json::json!({ "type": "string", "description": kit::MEANING });
    share.definitions["StructureConfig"]["properties"]["kit"] = about;
    let of = serde_json::json!({
        "type": "object",
        "required": ["name", library::KEY],
        "properties": { "name": { "type": "string" }, library::KEY: { "type": "string", "description": library::MEANING } },
    });
    share.definitions["PartConfig"]["oneOf"].as_array_mut().expect("one for each element").push(of);
    let parts = &mut share.definitions["StructureConfig"]["properties"]["parts"]["description"];
    *parts = format!("{} `of`: {}", parts.as_str().unwrap_or_default(), library::MEANING).into();
    share
}

/// The results, by files; one line an entry: name, unit, meaning.
macro_rules! entries {
    ($($file:literal => { $($name:literal, $unit:literal, $meaning:literal;)* })*) => {
        const RESULTS: &[Entry] = &[$($(Entry::new($file, $name, $unit, $meaning),)*)*];
    };
}

entries! {
    "history.csv" => {
        "reaction_{x,y,z}", "N", "force of all supports on the structure, mean over the row's window";
        "<gauge>_{ux,uy,uz}", "m", "gauge `displacement` at a point: since t = 0";
        "<gauge>_{ux,uy,uz}_mean", "m", "the same, mean over the nodes of a group";
        "<gauge>_{vx,vy,vz}", "m/s", "gauge `velocity` at a point";
        "<gauge>_{vx,vy,vz}_mean", "m/s", "the same, mean over the nodes of a group";
        "<gauge>_{fx,fy,fz}", "N", "gauge `force` at a point: force of the supports, mean over the row";
        "<gauge>_{fx,fy,fz}_sum", "N", "the same, sum over a group";
        "<gauge>_force_{min,max}", "N", "smallest and largest magnitude of the support force at one node of a group";
        "<gauge>_tension", "N", "gauge `tension` of one member: axial force, compression negative";
        "<gauge>_tension_{min,max}", "N", "the same of the most compressed and the most stretched member of a group";
        "<gauge>_elongation", "m", "gauge `elongation` of one member: against the length as modelled";
        "<gauge>_elongation_{min,max}", "m", "smallest and largest elongation of the members of a group";
        "<gauge>_bending_moment", "N m", "gauge `bending_moment` of one beam: magnitude, of both planes together";
        "<gauge>_bending_moment_{min,max}", "N m", "the same of the least and the most bent beam of a group, at the more bent of its ends";
        "<gauge>_utilisation", "1", "gauge `utilisation` of one member: share of its strength; of a beam that yields, of its plastic section";
        "<gauge>_utilisation_{min,max}", "1", "the same of the least and the most loaded member of a group";
        "<gauge>_height", "m", "gauge `height`: height left between two groups; with `posts`, the least of the fields";
        "<gauge>_height_<field>", "m", "the same of each field between two posts, from 1";
        "energy_kinetic_fem", "J", "kinetic energy of the structure";
        "energy_potential_fem", "J", "potential energy of the structure in gravity and under constant loads";
        "energy_stored_fem", "J", "elastic energy of the structure";
        "energy_dissipated_fem", "J", "energy that brakes, plastic strain, friction, dashpots and rupture have dissipated";
        "energy_received_fem", "J", "work of the contact forces on the structure; along a path (`path_speed`) that of all loads";
        "energy_loads_fem", "J", "work that loads with a history and pressures have done, negated";
        "energy_supports_fem", "J", "work that moving supports have done, negated";
        "load_factor", "1", "`fem.path_speed`: factor of the loads";
        "negative_pivots", "1", "`fem.path_speed`: directions in which the equilibrium is unstable; 0 = it is stable";
    }
    "summary.json" => {
        "<gauge>_<quantity>_min", "", "smallest value of a gauge at any solver step, unit of the gauge; of a group's tension or elongation, that of the smallest member";
        "<gauge>_<quantity>_max", "", "largest value of a gauge at any solver step, unit of the gauge";
        "<gauge>_height_end", "m", "gauge `height`: residual height at the end";
        "<gauge>_height_<field>_end", "m", "the same of each field between two posts, from 1";
        "max_reaction", "N", "largest magnitude of the total support reaction, dead load included, at any solver step";
        "max_reaction_1ms", "N", "the same of its mean over any 1 ms; the one to compare";
        "max_reaction_10ms", "N", "the same over any 10 ms, of a structure with posts or ropes that slide: they vibrate";
        "max_cable_force", "N", "largest axial force of any cable";
        "cable_force_beside", "N", "mean of the largest axial forces in the steps before and after that of `max_cable_force`: where it lies below, steps hardly resolve how wires swing";
        "max_plastic_strain", "1", "largest accumulated plastic strain of any beam at the end, and when that beam began to yield";
        "critical_load_factor", "1", "`fem.path_speed`: load factor of the first limit point or branch point";
        "limit_point_<n>", "1", "`fem.path_speed`: load factor where the load turns back, one by one along the path";
        "branch_point_<n>", "1", "`fem.path_speed`: load factor where another path of equilibrium crosses";
        "sag", "m", "sag of the structure at rest under its own weight";
    }
    "summary.json: cost" => {
        "newton_iterations", "1", "Newton iterations, those of form finding included";
        "skipped_windows", "1", "committed windows in which nothing loaded or moved the structure, which was not computed";
        "factorisations", "1", "factorisations of the tangent matrix";
        "kept_factors", "1", "factorisations saved, as the tangent had not changed";
        "refined_windows", "1", "windows in which Newton failed and that were repeated with shorter steps";
        "refused_steps", "1", "`fem.path_speed`, `fem.load_steps`: steps that were shortened and taken anew";
        "shifted_tangents", "1", "steps with a tangent matrix that was not positive definite and was shifted";
    }
    "fields/structure.pvd" => {
        "displacement", "m", "displacement of a node from the structure as modelled";
        "velocity", "m/s", "velocity of a node";
        "part", "1", "number of the part, named in `structure_legend.json`";
        "group", "1", "number of the group of a line or node, named in `structure_legend.json`";
        "axial_force", "N", "axial force of a line";
        "stress", "Pa", "axial stress, where the section is known";
        "utilisation", "1", "force over strength; of a beam that yields at least the sum of axial force and moments over those of the plastic section; 0 where no strength is given";
        "plastic_strain", "1", "largest accumulated plastic strain of a beam";
        "bending_moment_{1,2}_{start,end}", "N m", "bending moments of a beam at its two ends";
        "torsion", "N m", "torsional moment of a beam";
        "slack", "1", "1 where nothing is carried";
        "broken", "1", "1 where an element is broken";
    }
    "fields/structure_faces.pvd" => {
        "stress_{1,2}", "Pa", "largest and smallest principal stress of a membrane or shell";
        "force_{1,2}", "N/m", "the same per width: stress times thickness";
        "moment_{1,2}", "N m/m", "largest and smallest principal bending moment of a shell per width";
        "slack", "1", "1 where a membrane carries nothing";
    }
}
