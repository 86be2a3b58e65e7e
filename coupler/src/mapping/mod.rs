//! Mapping between the structure's mesh and that of the contact solver: one sparse matrix H.
//!
//! Motion goes to the contact solver by H (*consistent*: rows sum to 1), force comes back by its transpose
//! (*conservative*): then `f_structure . u = f_contact . (H u)` for every displacement, to rounding.
//! Source: Farhat, Lesoinne and Le Tallec (1998), Comput. Methods Appl. Mech. Engrg. 157, 95.

mod identity;
mod matrix;
mod nearest_neighbor;

pub use matrix::Matrix;

use crate::registry::registry;
use interface_defs::InterfaceMesh;

/// Builds the matrix that takes motion from the structure's nodes to those of contact.
pub trait Mapper {
    /// H for these meshes: a row per contact node, a column per structure node. `Err` says why it cannot.
    fn matrix(&self, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Result<Matrix, String>;
}

registry! {
    /// Every mapping that `[coupling.mapping] type` may name.
    pub enum AnyMapper: Mapper {
        "identity" => identity::Identity,
        "nearest_neighbor" => nearest_neighbor::NearestNeighbor,
    }
}
