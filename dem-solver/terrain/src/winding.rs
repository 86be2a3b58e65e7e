//! Which side of a terrain is up.
//!
//! The order of a triangle's corners says it, where all triangles agree; files from different hands do not always.

use super::{Terrain, notice};
use interface_defs::diagnostic::Diagnostic;
use std::collections::HashSet;

impl Terrain {
    /// Order the corners of all triangles so that their normals point out of the ground. A mesh of one winding keeps what
    /// hangs over; of one that does not agree with itself each triangle faces up. What the user should know.
    pub fn face_up(&mut self) -> Option<Diagnostic> {
        let rise = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|n| self.nodes[n as usize]);
            (b - a).cross(&(c - a)).z
        };
        let down = self.triangles.iter().filter(|t| rise(t) < 0.0).count();
        if down == 0 {
            return None;
        }
        let (all, whole) = (self.triangles.len(), self.triangles.iter().map(rise).sum::<f64>());
        if down < all && !self.is_of_one_winding() {
            for at in 0..all {
                if rise(&self.triangles[at]) < 0.0 {
                    self.triangles[at].swap(1, 2);
                }
            }
            let what = format!(
                "the corners of its triangles run round in both directions ({down} of {all} face down)"
            );
            return Some(notice(what).try_instead("each was taken to face up, so that nothing hangs over"));
        }
        if whole < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        None
    }

    /// Whether no two triangles run along an edge in the same direction.
    fn is_of_one_winding(&self) -> bool {
        let mut seen = HashSet::with_capacity(3 * self.triangles.len());
        self.triangles
            .iter()
            .all(|[a, b, c]| [(a, b), (b, c), (c, a)].into_iter().all(|edge| seen.insert(edge)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::triangulation::Triangulated;
    use super::*;
    use nalgebra::Vector3;

    /// A step with an overhang: floor, mesh that leans out over it, top.
    fn overhang(turned: &[usize]) -> Terrain {
        let profile = [[-2.0, 0.0], [0.0, 0.0], [-0.5, 1.0], [2.0, 1.2]];
        let nodes =
            [0.0, 1.0].into_iter().flat_map(|y| profile.map(|[x, z]| Vector3::new(x, y, z))).collect();
        let mut triangles: Vec<[u32; 3]> =
            (0..3).flat_map(|i| [[i, i + 1, i + 5], [i, i + 5, i + 4]]).collect();
        turned.iter().for_each(|t| triangles[*t].swap(1, 2));
        Terrain::new(Triangulated { origin: Vector3::zeros(), nodes, triangles, notices: Vec::new() })
    }

    fn down(ground: &Terrain) -> usize {
        let rise = |t: &&[u32; 3]| {
            let [a, b, c] = t.map(|n| ground.nodes[n as usize]);
            (b - a).cross(&(c - a)).z < 0.0
        };
        ground.triangles.iter().filter(rise).count()
    }

    #[test]
    fn of_one_winding_what_hangs_over_stays_and_the_whole_is_turned_up() {
        let mut up = overhang(&[]);
        assert_eq!((down(&up), up.face_up(), down(&up)), (2, None, 2));
        let mut upside_down = overhang(&[0, 1, 2, 3, 4, 5]);
        assert_eq!((down(&upside_down), upside_down.face_up(), down(&upside_down)), (4, None, 2));
    }

    #[test]
    fn of_both_windings_each_triangle_faces_up_and_that_is_reported() {
        let mut mixed = overhang(&[0]);
        let notice = mixed.face_up().expect("a notice");
        assert!(notice.message.contains("3 of 6"), "{notice}");
        assert_eq!(down(&mixed), 0);
    }
}
