//! A kind of part of `[[structure.parts]]`: the keys that a scene states, what they must be, and the elements they become.
//!
//! A part says what its elements are; its `cells` say between which nodes. A mesh file or a generator gives
//! the cells instead, in the group that bears the name of the part.

use super::AnyElement;
use super::cable::{Cable, CableConfig};
use crate::element::material::Rupture;
pub use crate::read::Key;
use crate::read::mesh::Kind;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::fmt::Debug;

/// Keys that all parts have, and the cells of which their elements are made.
#[derive(Debug, Clone, Copy)]
pub struct PartHead<'a> {
    /// Its name.
    pub name: &'a str,
    /// Nodes of each of its elements, as far as the scene states them.
    pub cells: &'a [Vec<usize>],
    /// Its elements in words, in the plural.
    pub plural: &'static str,
    /// Fewest and most nodes of an element.
    pub nodes: (usize, usize),
    /// Shapes of cells of which an element can be made; none where nothing is made of any.
    pub kinds: &'static [Kind],
}

/// A table with a [`PartHead`]; `part!` writes it.
pub trait PartTable: Debug {
    /// Its head.
    fn head(&self) -> PartHead<'_>;
}

/// A kind of part: implemented by the settings of an element, beside the element.
pub trait PartSettings: PartTable {
    /// Check the settings and make the elements of one cell.
    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic>;

    /// Refuse what is certainly wrong of elements with such surroundings; returns what is possible, but unusual.
    fn judge(&self, _at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        Ok(Vec::new())
    }

    /// Whether lines of a mesh that follow each other are one cell.
    fn joins_lines(&self) -> bool {
        false
    }

    /// Whether a cell of that shape is a closed polygon: its first node is its last one, too.
    fn closes(&self, _kind: Kind) -> bool {
        false
    }

    /// Whether its nodes turn and nothing resists that in dynamics.
    fn turns_without_inertia(&self) -> bool {
        false
    }

    /// A remark for the user on its so many cells with four nodes.
    fn remark(&self, _quadrilaterals: usize) -> Option<Diagnostic> {
        None
    }
}

/// One cell of a part, of which elements are made.
pub struct PartCell<'a> {
    /// Key of the part in the scene.
    pub key: &'a Key<'a>,
    /// The key below it to which errors of the cell belong.
    pub place: &'a str,
    /// Nodes of the cell.
    pub nodes: &'a [usize],
    /// All nodes as modelled [m].
    pub positions: &'a [Vector3<f64>],
    /// `[structure.cable]`.
    pub common: Option<&'a CableConfig>,
}

impl PartCell<'_> {
    /// Its first two nodes.
    pub fn ends(&self) -> [usize; 2] {
        [self.nodes[0], self.nodes[1]]
    }

    /// From each of its nodes to the next one [m].
    pub fn spans(&self) -> Vec<Vector3<f64>> {
        self.nodes.windows(2).map(|pair| self.positions[pair[1]] - self.positions[pair[0]]).collect()
    }

    /// The cell itself is at fault.
    pub fn invalid(&self, what: impl Into<String>) -> Diagnostic {
        self.key.invalid(self.place, what)
    }
}

/// Lists that take new elements.
pub struct NewElements<'a> {
    /// Elements that answer one by one.
    pub elements: &'a mut Vec<AnyElement>,
    /// Plain cables, which the kernel answers for at once.
    pub cables: &'a mut Vec<Cable>,
}

/// The structure around the elements of a part.
pub struct Surroundings<'a> {
    /// Key of the part in the scene.
    pub key: &'a Key<'a>,
    /// Extent of the whole structure [m].
    pub extent: f64,
    /// Largest distance of a node of one of its elements from the first one of it [m]; 0 without elements.
    pub size: f64,
    /// The part with the largest prestress that has a node in common with it, and that prestress [N].
    pub pulled: &'a dyn Fn() -> Option<(&'a str, f64)>,
}

impl Surroundings<'_> {
    /// A length that does not fit: `value` [m] of the key `name`, where `of` has `limit` [m].
    pub fn too_long(&self, name: &str, value: f64, of: &str, limit: f64) -> Diagnostic {
        let what = format!("{name} is {value} m, and {of} {limit:.4} m");
        self.key.invalid(name, what).try_instead("metres: 300 mm is 0.3")
    }
}

impl Key<'_> {
    /// When elements break: force [N] and strain as stated, above 0.
    pub fn rupture(&self, force: Option<f64>, strain: Option<f64>) -> Result<Rupture, Diagnostic> {
        let or_one = |stated: Option<f64>| stated.unwrap_or(1.0);
        self.positive(&[("rupture_force", or_one(force), "N"), ("rupture_strain", or_one(strain), "")])?;
        Ok(Rupture { force: force.unwrap_or(f64::INFINITY), strain: strain.unwrap_or(f64::INFINITY) })
    }

    /// Rows of the table `name`: abscissae that increase from 0 or above, ordinates above 0.
    pub fn check_table(&self, name: &str, rows: &[[f64; 2]]) -> Result<(), Diagnostic> {
        if let Some(row) = rows.iter().find(|row| !(row[1] > 0.0 && row.iter().all(|x| x.is_finite()))) {
            let what = format!("the row [{}, {}] must be finite, its second above 0", row[0], row[1]);
            return self.refuse(name, what, "forces and stresses in tension count upward");
        }
        if let Some(row) = rows.iter().find(|row| row[0] < 0.0) {
            let what = format!(
                "the row [{}, {}] must not begin below 0: elongations and strains count upward",
                row[0], row[1]
            );
            return self.refuse(name, what, "turn its sign round");
        }
        let falls = rows.windows(2).find(|pair| pair[1][0] <= pair[0][0]);
        let Some([before, next]) = falls else { return Ok(()) };
        let what = format!("the first column must increase, {} follows {}", next[0], before[0]);
        Err(self.invalid(name, what))
    }
}

/// Whether a key is left out of the resolved scene.
pub(super) fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Settings of a part: what its elements are called, how many nodes they have and of which shapes of cells they are made, what
/// all parts have in common, and what its elements need.
macro_rules! part {
    ($(#[$doc:meta])* $name:ident: $plural:literal, $nodes:tt nodes, $($kind:ident)|+ { $($(#[$field_doc:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Name of the part; gauges, messages and meshes know it by that.
            pub name: String,
            /// Nodes of each element, counted from 0. Default: the elements of the mesh's group of that name.
            #[serde(default, skip_serializing_if = "Vec::is_empty")]
            pub cells: Vec<Vec<usize>>,
            /// Radius for contact [m]. Default 0, a mathematical line; of a `wire_ring` that of its bundle.
            pub radius: Option<f64>,
            /// Axial force at which an element breaks [N]. Default: never.
            pub rupture_force: Option<f64>,
            $($(#[$field_doc])* pub $field: $type,)*
        }

        impl $crate::element::part::PartTable for $name {
            fn head(&self) -> $crate::element::part::PartHead<'_> {
                let kinds = &[$($crate::read::mesh::Kind::$kind),+];
                let (name, cells) = (&self.name, &self.cells);
                $crate::element::part::PartHead { name, cells, plural: $plural, nodes: $nodes, kinds }
            }
        }
    };
}
pub(crate) use part;

/// Nothing: a group of a mesh that can still be held, loaded and gauged by its name.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoPart {
    /// Name of the group.
    pub name: String,
}

impl PartTable for NoPart {
    fn head(&self) -> PartHead<'_> {
        PartHead { name: &self.name, cells: &[], plural: "nothing", nodes: (0, usize::MAX), kinds: &[] }
    }
}

impl PartSettings for NoPart {
    fn build(&self, _cell: &PartCell, _made: &mut NewElements) -> Result<(), Diagnostic> {
        Ok(())
    }
}
