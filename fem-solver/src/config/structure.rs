//! `[structure]`: a mesh file, a generated structure, or nodes and elements one by one.

use super::generator::Generator;
use crate::element::PartConfig;
use crate::element::cable::{CableConfig, Stated};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What is built. All lengths count in the structure as it is modelled, before form finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StructureConfig {
    /// A mesh file, instead of `nodes` and `cables`: `.msh` (Gmsh 2.2 and 4.1, ASCII), `.inp` (CalculiX,
    /// Abaqus) or `.mdpa` (Kratos), coordinates in metres. `parts` say what the elements of its groups
    /// become; lines in no part become cables. All else in the scene binds to the names of its groups.
    /// The path is relative to the scene file.
    pub mesh: Option<PathBuf>,
    /// Whether nodes of a mesh file are numbered anew inside, neighbours close to each other, where that halves their distances:
    /// steps are faster then, and results differ in their last digits from those in the order of the file. Default true.
    pub renumber: Option<bool>,
    /// A generated structure, instead of `nodes` and `cables`.
    pub generator: Option<Generator>,
    /// Where a structure in axes of its own stands. Default: where its coordinates say.
    pub place: Option<PlaceConfig>,
    /// The ground that nodes lie on. Without it the structure passes through the terrain.
    pub ground: Option<GroundConfig>,
    /// Contact of lines with lines. Without it parts of the structure pass through each other.
    pub contact: Option<ContactConfig>,
    /// Properties of every cable, also of a part, that does not state its own.
    pub cable: Option<CableConfig>,
    /// Nodes [m].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<[f64; 3]>,
    /// Cables between two nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cables: Vec<CableEntry>,
    /// Named sets of elements: cables with hardening and rupture, sliding ropes, brakes, beams, and more.
    /// A part without `cells` is that of the mesh's group of its name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartConfig>,
    /// Grounded dashpots.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dampers: Vec<DamperEntry>,
    /// Grounded springs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub springs: Vec<SpringEntry>,
    /// Point masses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masses: Vec<MassEntry>,
    /// Nodal loads, constant or with a history.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<LoadEntry>,
    /// Pressure on membranes and shells, constant or with a history.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pressures: Vec<PressureEntry>,
    /// Velocities at t = 0, after form finding. Default: the structure is at rest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub velocities: Vec<VelocityEntry>,
    /// Supports, fixed or moving.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub supports: Vec<SupportEntry>,
    /// Named sets of nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<GroupEntry>,
    /// Mass-proportional damping alpha [1/s]. Default 0.
    #[serde(default)]
    pub damping: f64,
    /// Whether gravity acts on the structure. Default true; false: it has inertia and no weight.
    #[serde(default = "crate::element::cable::yes")]
    pub dead_load: bool,
    /// State at t = 0: static equilibrium under the dead load (default), or as modelled.
    #[serde(default)]
    pub form_finding: FormFinding,
}

impl StructureConfig {
    /// Every entry that stands at nodes: name and position of its table, and where it stands.
    pub fn places(&self) -> impl Iterator<Item = (&'static str, usize, Where<'_>)> {
        macro_rules! places {
            ($($name:ident)*) => {
                [$(self.$name.iter().map(|e| (stringify!($name), e.place())).collect::<Vec<_>>(),)*]
            };
        }
        let tables = places!(supports springs dampers masses loads velocities);
        tables.into_iter().flat_map(|t| t.into_iter().enumerate().map(|(i, (name, place))| (name, i, place)))
    }
}

/// State at t = 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FormFinding {
    /// At rest in static equilibrium under the dead load.
    #[default]
    Static,
    /// The same, starting from the shape in which every cable keeps its force per length as modelled: for nets and
    /// ropes with prestress.
    ForceDensity,
    /// The same, starting from where dynamic relaxation leads: slow, and hard to upset. Bars that may be compressed can come
    /// to rest buckled.
    DynamicRelaxation,
    /// At rest as modelled, whatever forces that leaves.
    None,
}

/// A cable between two nodes; what it does not state comes from `[structure.cable]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CableEntry {
    /// Its two nodes, counted from 0.
    #[serde(deserialize_with = "two_nodes")]
    pub nodes: [usize; 2],
    /// Unstretched length [m]; default the distance of its nodes.
    pub length: Option<f64>,
    /// Young's modulus [Pa].
    pub young: Option<f64>,
    /// Section [m2].
    pub area: Option<f64>,
    /// Density [kg/m3].
    pub density: Option<f64>,
    /// Second Piola-Kirchhoff stress at the unstretched length [Pa].
    pub prestress: Option<f64>,
    /// Whether it carries no compression.
    pub tension_only: Option<bool>,
    /// Radius for contact [m].
    pub radius: Option<f64>,
}

impl CableEntry {
    /// The properties that it states itself.
    pub fn stated(&self) -> Stated {
        let Self { young, area, density, prestress, tension_only, radius, .. } = *self;
        Stated { young, area, density, prestress, tension_only, radius }
    }
}

/// Nodes by number (from 0), by group, or the node at a point: exactly one of the three.
#[derive(Debug, Clone, Copy)]
pub struct Where<'a> {
    /// By number.
    pub nodes: Option<&'a [usize]>,
    /// By group.
    pub group: Option<&'a str>,
    /// At a point [m].
    pub at: Option<[f64; 3]>,
}

/// Entries that stand at nodes: the fields of a place, and what they add.
macro_rules! entry {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Nodes by number, counted from 0.
            pub nodes: Option<Vec<usize>>,
            /// Nodes of a group.
            pub group: Option<String>,
            /// The node at a point of the structure as modelled [m].
            pub at: Option<[f64; 3]>,
            $($(#[$field_doc])* pub $field: $type,)*
        }

        impl $name {
            /// Where it stands.
            pub fn place(&self) -> Where<'_> {
                Where { nodes: self.nodes.as_deref(), group: self.group.as_deref(), at: self.at }
            }
        }
    };
}

entry! {
    /// A grounded spring at each of some nodes, without force as modelled.
    SpringEntry {
        /// Stiffness in x, y and z [N/m].
        stiffness: [f64; 3],
    }
}

entry! {
    /// A grounded dashpot at each of some nodes: `f = -c v`.
    DamperEntry {
        /// Viscosity in x, y and z [N s/m].
        viscosity: [f64; 3],
    }
}

entry! {
    /// A point mass at each of some nodes.
    MassEntry {
        /// Mass of each [kg].
        mass: f64,
    }
}

entry! {
    /// A load on each of some nodes.
    LoadEntry {
        /// Force on each [N].
        #[serde(default)]
        force: [f64; 3],
        /// Moment on each, where it has rotations [N m]. Default none.
        #[serde(default, skip_serializing_if = "is_nothing")]
        moment: [f64; 3],
        /// Factor of force and moment over time: rows `[t, factor]` [s, 1], straight between them, constant outside. Form
        /// finding takes that at t = 0. Its work is the column `energy_loads_fem`. Default: 1 at any time.
        #[serde(default, deserialize_with = "rows", skip_serializing_if = "Vec::is_empty")]
        history: Vec<[f64; 2]>,
    }
}

entry! {
    /// Velocity of each of some nodes at t = 0. Directions that supports hold stay at rest.
    VelocityEntry {
        /// Velocity of each [m/s].
        #[serde(default)]
        velocity: [f64; 3],
        /// Angular velocity of each, where it has rotations [rad/s]. Default none.
        #[serde(default, skip_serializing_if = "is_nothing")]
        angular_velocity: [f64; 3],
    }
}

/// Pressure on the faces of membranes and shells: it follows them, with their area and normal of the moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureEntry {
    /// A part, or a group of elements of the mesh.
    pub group: String,
    /// Pressure [Pa] along the normal of each face: that about which its nodes run counter-clockwise. Below 0: against it.
    pub pressure: f64,
    /// Factor of the pressure over time: rows `[t, factor]` [s, 1], straight between them, constant outside. Form finding
    /// takes that at t = 0. Default: 1 at any time.
    #[serde(default, deserialize_with = "rows", skip_serializing_if = "Vec::is_empty")]
    pub history: Vec<[f64; 2]>,
}

entry! {
    /// Nodes that are held, or moved.
    SupportEntry {
        /// Directions that are supported: letters of `xyz`. Default all.
        #[serde(default = "all_directions")]
        directions: String,
        /// Axes about which nodes with rotations are supported: letters of `xyz`. Default none: hinged.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        rotations: String,
        /// Prescribed displacement: rows `[t, ux, uy, uz]` [s, m], straight between them, constant outside.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        motion: Vec<[f64; 4]>,
        /// Prescribed turn about an axis, in place of `motion`: the nodes run on circles, in the directions and rotations that
        /// are supported.
        turning: Option<TurningConfig>,
        /// When they let go [s], at the end of the solver's step that is nearest. Default: never.
        released_at: Option<f64>,
        /// Stiffness of the ground or foundation [N/m]: in the supported directions a spring, the same in all of them, holds each
        /// node to where it stands as modelled. Default: it does not give at all. Supported `rotations` stay rigid.
        stiffness: Option<f64>,
        /// Force under which that spring of a node tears [N]; supported `rotations` hold on. Default: never.
        strength: Option<f64>,
    }
}

/// Turn of supports about an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TurningConfig {
    /// A point on the axis [m].
    pub through: [f64; 3],
    /// Direction of the axis, of any length; angles are right-handed about it.
    pub axis: [f64; 3],
    /// Rows `[t, angle]` [s, rad], straight between them, constant outside.
    pub angles: Vec<[f64; 2]>,
}

fn is_nothing(moment: &[f64; 3]) -> bool {
    *moment == [0.0; 3]
}

fn all_directions() -> String {
    "xyz".into()
}

/// A named set of nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroupEntry {
    /// Its name.
    pub name: String,
    /// Its nodes, counted from 0.
    pub nodes: Vec<usize>,
}

/// Rows of a history, at least one.
fn rows<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 2]>, D::Error> {
    let rows = Vec::<[f64; 2]>::deserialize(deserializer)?;
    if rows.is_empty() {
        return Err(serde::de::Error::custom(
            "a history without rows; rows are [t, factor], as [[0.0, 0.0], [0.5, 1.0]]",
        ));
    }
    Ok(rows)
}

/// Exactly two: an array would take the first two of more.
fn two_nodes<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<[usize; 2], D::Error> {
    let nodes = Vec::<usize>::deserialize(deserializer)?;
    <[usize; 2]>::try_from(nodes).map_err(|nodes| {
        serde::de::Error::custom(format!(
            "a cable has two nodes, here are {}; a part with element = \"cable\" takes cells of more",
            nodes.len()
        ))
    })
}

/// The ground under the structure: nodes that move are pushed off by it and held back by friction. Without this table the
/// structure passes through the terrain.
///
/// Each node is a sphere with the radius of the lines that end at it. The ground is a smooth surface through the heights of
/// a raster; beyond the raster there is none. Nodes that supports hold in all directions take no part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GroundConfig {
    /// Heights: an ESRI grid (`.asc`), from the directory of the scene. Default `structure.generator.ground`, or
    /// `structure.place.ground`; in a scene with `[terrain]` `rockfall` makes it of that by itself.
    pub file: Option<PathBuf>,
    /// Stiffness of each node in the ground [N/m], along the normal, and along the ground as long as it sticks. Default: its mass,
    /// but not more than that of half of the nodes, times (1000/s)^2: steps of up to 1 ms follow its motion.
    pub stiffness: Option<f64>,
    /// Coefficient of friction (Coulomb). The rest shape at t = 0 is without friction, as after a net has been shaken down;
    /// friction acts from there on.
    pub friction: f64,
    /// Speed of a node after a bounce over that before, above 0 and at most 1: what the dashpots beside both stiffnesses follow
    /// from. With 1 there are none, and nothing comes to rest.
    pub restitution: f64,
    /// Groups or parts whose nodes take part. Default: all nodes.
    pub groups: Option<Vec<String>>,
    /// Groups or parts whose nodes take no part.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub except: Vec<String>,
}

impl Default for GroundConfig {
    fn default() -> Self {
        Self {
            file: None,
            stiffness: None,
            friction: 0.5,
            restitution: 0.5,
            groups: None,
            except: Vec::new(),
        }
    }
}

/// Contact between lines of the structure that do not hang together, with friction: rings of one net, a net and a punch.
///
/// Each line is a cylinder with the radius of its part and round ends; where lines follow each other in a chain, they are one
/// rope. Lines connected by nodes never touch each other. `central_difference` alone, as modelled (`form_finding = "none"`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactConfig {
    /// Parts whose lines take part.
    pub parts: Vec<String>,
    /// Force per depth of two lines in each other [N/m], across, and along as long as they stick.
    pub stiffness: f64,
    /// Coefficient of friction (Coulomb). Default 0.
    #[serde(default)]
    pub friction: f64,
}

/// Where a mesh file, a generated net or a barrier in axes of its own stands: it is turned about z, then moved.
///
/// Points of the scene (`at` of supports, loads and gauges) and directions count where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaceConfig {
    /// Where the origin of its own axes comes to: `[x, y]` on the ground, or `[x, y, z]` [m], in the coordinates of the terrain.
    pub origin: Vec<f64>,
    /// Direction of its own x axis [degrees from y (north), clockwise as seen from above]. Default 90: along x (east).
    #[serde(default = "east")]
    pub azimuth: f64,
    /// Heights of the ground: an ESRI grid (`.asc`), from the directory of the scene. Default `structure.ground.file`; in a
    /// scene with `[terrain]` `rockfall` makes it of that by itself. With three numbers of `origin` nothing asks for it.
    pub ground: Option<PathBuf>,
    /// Whether z of each node counts from the ground below it, in place of from that below the origin: a flat net is draped
    /// so. Default false.
    #[serde(default)]
    pub draped: bool,
}

fn east() -> f64 {
    90.0
}
