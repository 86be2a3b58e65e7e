//! What a rock touches: the wall that the structure moves, or the terrain. Both give elements with
//! numbers; a contact asks them who neighbours whom, and what inertia it meets.

use super::Wall;
use super::hierarchy::Crossings;
use crate::ground::Ground;

/// A contact partner.
#[derive(Debug, Clone, Copy)]
pub enum Surface<'a> {
    /// The mesh of the structure.
    Wall(&'a Wall),
    /// The terrain, which never moves.
    Ground(&'a Ground),
}

impl Surface<'_> {
    /// The crossings of wires, where contacts are continuous over kinks.
    pub fn crossings(&self) -> Option<&Crossings> {
        match self {
            Self::Wall(wall) => wall.crossings.as_ref(),
            Self::Ground(ground) => ground.crossings.as_ref(),
        }
    }

    /// True if two elements hold a common node. Numbers beyond the elements, which are crossings, do not.
    pub fn share_a_node(&self, a: u32, b: u32) -> bool {
        match self {
            Self::Wall(wall) => {
                let of = |key: u32| wall.elements.get(key as usize);
                of(a).zip(of(b)).is_some_and(|(a, b)| a.shares_a_node(b))
            }
            Self::Ground(ground) => ground.share_a_node(a, b),
        }
    }

    /// `sum N_a^2 / m_a` of a point with these nodes and weights [1/kg]; 0 where masses are not told, or
    /// where nothing moves.
    #[inline]
    pub fn inverse_mass(&self, nodes: [u32; 3], [na, nb, nc]: [f64; 3]) -> f64 {
        let Self::Wall(Wall { inverse_mass: Some(inverse), .. }) = self else { return 0.0 };
        let [a, b, c] = nodes.map(|n| inverse[n as usize]);
        na * na * a + nb * nb * b + nc * nc * c
    }
}
