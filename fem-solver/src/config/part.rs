//! `[[structure.parts]]`: named sets of elements of one kind and one section.
//!
//! A part says what its elements are; its `cells` say between which nodes. A mesh file or a generator gives
//! the cells instead, in the group that bears the name of the part.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A part; `element` says of what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "element", rename_all = "snake_case")]
pub enum PartConfig {
    /// Cables or bars, one after the other along each cell, with hardening and rupture where stated. A triangle
    /// or quadrilateral of a mesh is a closed polygon of them, the wire of a ring; so is a cell whose last
    /// node is its first. Neighbours share nodes, never cables.
    Cable(CablePart),
    /// Ropes that slide over all of their nodes but the ends; lines of a mesh that follow each other are one rope.
    SlidingCable(SlidingCablePart),
    /// Energy-dissipating devices between two nodes.
    Brake(BrakePart),
    /// Beams between two nodes, with rotations.
    Beam(BeamPart),
    /// Rings of a ring net, by their 3 or 4 points of contact, around.
    Ring(RingPart),
    /// Triangles and quadrilaterals of membrane.
    Membrane(MembranePart),
    /// Thin shell, with rotations: triangles, and quadrilaterals that are split into two.
    Shell(ShellPart),
    /// Nothing: a group of a mesh that can still be held, loaded and gauged by its name.
    None(NoPart),
}

fn yes() -> bool {
    true
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// A part: what all have in common, and what its elements need.
macro_rules! part {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Name of the part; gauges, messages and meshes know it by that.
            pub name: String,
            /// Nodes of each element, counted from 0. Default: the elements of the mesh's group of that name.
            #[serde(default, skip_serializing_if = "Vec::is_empty")]
            pub cells: Vec<Vec<usize>>,
            /// Radius for contact [m]. Default 0, a mathematical line.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub radius: Option<f64>,
            /// Axial force at which an element breaks [N]. Default: never.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub rupture_force: Option<f64>,
            $($(#[$field_doc])* pub $field: $type,)*
        }
    };
}

part! {
    /// Cables or bars. `young` to `tension_only`, and `radius`: default what `[structure.cable]` says.
    CablePart {
        /// Young's modulus [Pa].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        young: Option<f64>,
        /// Section [m2].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        area: Option<f64>,
        /// Density [kg/m3].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        density: Option<f64>,
        /// Second Piola-Kirchhoff stress at the unstretched length [Pa]; below 0: slack.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        prestress: Option<f64>,
        /// Whether they carry no compression.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        tension_only: Option<bool>,
        /// Unstretched length of each [m]. Default the distance of its nodes.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        length: Option<f64>,
        /// Hardening: rows `[plastic strain, yield stress]` [-, Pa], the first at 0, constant beyond the
        /// last. Default none: elastic.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        hardening: Vec<[f64; 2]>,
        /// Green-Lagrange strain at which one breaks. Default: never.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rupture_strain: Option<f64>,
    }
}

part! {
    /// Sliding ropes.
    SlidingCablePart {
        /// Young's modulus [Pa].
        young: f64,
        /// Section [m2].
        area: f64,
        /// Density [kg/m3].
        density: f64,
        /// Second Piola-Kirchhoff stress at the unstretched length [Pa]; below 0: slack. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        prestress: f64,
        /// Unstretched length of each whole rope [m]. Default that of its polygon as modelled.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        length: Option<f64>,
        /// Coefficient of friction at inner nodes (capstan). Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        friction: f64,
        /// Green-Lagrange strain of the whole rope at which it breaks. Default: never.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rupture_strain: Option<f64>,
    }
}

part! {
    /// Brakes.
    BrakePart {
        /// Stiffness before it yields, on unloading, and beyond its stroke [N/m].
        stiffness: f64,
        /// Curve of a slow test: rows `[elongation, force]` [m, N], the first where it yields, at
        /// `force / stiffness` or more; constant beyond the last. Empty: elastic.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        curve: Vec<[f64; 2]>,
        /// Plastic travel at which it comes to its end stop [m]. Default: none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stroke: Option<f64>,
        /// Mass of each [kg]. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        mass: f64,
        /// Length at which its force begins [m]. Default the distance of its nodes.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        length: Option<f64>,
        /// Whether it carries no compression. Default true.
        #[serde(default = "yes")]
        tension_only: bool,
    }
}

part! {
    /// Beams.
    BeamPart {
        /// Young's modulus [Pa].
        young: f64,
        /// Shear modulus [Pa]. Default `young / 2.6`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shear: Option<f64>,
        /// Section [m2].
        area: f64,
        /// Second moments of area for bending towards `up`, and across it [m4].
        inertia: [f64; 2],
        /// Torsion constant [m4]. Default the sum of `inertia`, exact for circular sections.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        torsion: Option<f64>,
        /// Density [kg/m3]; `static` alone does without. Default 0.
        #[serde(default)]
        density: f64,
        /// A direction that lies in the plane of the first bending. Default z, or x for upright beams.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        up: Option<[f64; 3]>,
    }
}

part! {
    /// Rings.
    RingPart {
        /// Diameter of the ring [m].
        diameter: f64,
        /// Stiffness of its perimeter, beyond its length [N/m].
        perimeter_stiffness: f64,
        /// Stiffness of each diagonal, beyond the diameter [N/m].
        bending_stiffness: f64,
        /// Length of the perimeter at which it becomes taut [m]. Default that of the circle.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        perimeter: Option<f64>,
        /// Stiffness of unloading over that of loading, of the perimeter and of the diagonals. Default `[3, 100]`.
        #[serde(default = "unloading")]
        unloading: [f64; 2],
        /// Mass of each ring [kg].
        mass: f64,
    }
}

part! {
    /// Membranes: triangles and quadrilaterals.
    MembranePart {
        /// Thickness [m].
        thickness: f64,
        /// Density [kg/m3].
        density: f64,
        /// Young's modulus [Pa]: one number, isotropic; or two, of fibres along `along` and across it.
        young: Vec<f64>,
        /// Poisson's ratio, isotropic only. Default 0.3.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        poisson: Option<f64>,
        /// Shear modulus between the fibres [Pa], fibres only. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        shear: f64,
        /// Second Piola-Kirchhoff prestress along `along` and across it [Pa]. Default 0.
        #[serde(default)]
        prestress: [f64; 2],
        /// Direction of the first fibre, or of the prestress; its part in the plane counts. Default x, or z for faces
        /// normal to x.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        along: Option<[f64; 3]>,
        /// Whether it carries no compression, isotropic only. Default true.
        #[serde(default = "yes")]
        wrinkles: bool,
    }
}

part! {
    /// Thin shells: triangles. A quadrilateral is split into two of them, along its shorter diagonal.
    ShellPart {
        /// Thickness [m].
        thickness: f64,
        /// Density [kg/m3].
        density: f64,
        /// Young's modulus [Pa].
        young: f64,
        /// Poisson's ratio. Default 0.3.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        poisson: Option<f64>,
    }
}

/// A group of a mesh of which no element is made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoPart {
    /// Name of the group.
    pub name: String,
}

fn unloading() -> [f64; 2] {
    [3.0, 100.0]
}

impl PartConfig {
    /// Name, nodes of each element.
    pub fn head(&self) -> (&str, &[Vec<usize>]) {
        match self {
            Self::Cable(p) => (&p.name, &p.cells),
            Self::SlidingCable(p) => (&p.name, &p.cells),
            Self::Brake(p) => (&p.name, &p.cells),
            Self::Beam(p) => (&p.name, &p.cells),
            Self::Ring(p) => (&p.name, &p.cells),
            Self::Membrane(p) => (&p.name, &p.cells),
            Self::Shell(p) => (&p.name, &p.cells),
            Self::None(p) => (&p.name, &[]),
        }
    }

    /// Fewest and most nodes of an element.
    pub fn nodes(&self) -> (usize, usize) {
        match self {
            Self::Cable(_) | Self::SlidingCable(_) => (2, usize::MAX),
            Self::Brake(_) | Self::Beam(_) => (2, 2),
            Self::Ring(_) => (3, 4),
            Self::Membrane(_) | Self::Shell(_) => (3, 4),
            Self::None(_) => (0, usize::MAX),
        }
    }

    /// What its elements are, in the plural.
    pub fn elements(&self) -> &'static str {
        match self {
            Self::Cable(_) => "cables",
            Self::SlidingCable(_) => "sliding cables",
            Self::Brake(_) => "brakes",
            Self::Beam(_) => "beams",
            Self::Ring(_) => "rings",
            Self::Membrane(_) => "membranes",
            Self::Shell(_) => "shells",
            Self::None(_) => "nothing",
        }
    }
}
