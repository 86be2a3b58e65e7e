//! A sparse matrix over nodes: the same weights for each of the three components.

/// H in compressed rows: a row per contact node, a column per structure node.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    columns: usize,
    starts: Vec<u32>,
    entries: Vec<(u32, f64)>,
    identity: bool,
}

impl Matrix {
    /// Row n is 1 at column n.
    pub fn identity(nodes: usize) -> Self {
        let rows = (0..nodes as u32).map(|n| vec![(n, 1.0)]);
        Self { identity: true, ..Self::from_rows(nodes, rows) }
    }

    /// From each row's columns and weights.
    pub fn from_rows(columns: usize, rows: impl Iterator<Item = Vec<(u32, f64)>>) -> Self {
        let (mut starts, mut entries) = (vec![0], Vec::new());
        for row in rows {
            entries.extend(row);
            starts.push(entries.len() as u32);
        }
        Self { columns, starts, entries, identity: false }
    }

    /// Number of contact nodes.
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether the meshes are equal.
    pub fn is_identity(&self) -> bool {
        self.identity
    }

    /// Columns and weights of a contact node.
    pub fn row(&self, row: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// `contact = H structure`, 3 components per node: displacement and velocity.
    ///
    /// Panics if a length does not match the meshes this matrix was built for; of equal meshes it takes parts, too, alike on both sides.
    pub fn consistent(&self, structure: &[f64], contact: &mut [f64]) {
        if self.identity {
            contact.copy_from_slice(structure);
            return;
        }
        assert_eq!((structure.len(), contact.len()), (3 * self.columns, 3 * self.rows()));
        for (row, out) in contact.chunks_exact_mut(3).enumerate() {
            let mut sum = [0.0; 3];
            for &(column, weight) in self.row(row) {
                for (s, x) in sum.iter_mut().zip(&structure[3 * column as usize..]) {
                    *s += weight * x;
                }
            }
            out.copy_from_slice(&sum);
        }
    }

    /// `structure = H^T contact`, 3 components per node: force. Total force and work are conserved.
    ///
    /// Panics as [`Matrix::consistent`] does.
    pub fn conservative(&self, contact: &[f64], structure: &mut [f64]) {
        if self.identity {
            structure.copy_from_slice(contact);
            return;
        }
        assert_eq!((structure.len(), contact.len()), (3 * self.columns, 3 * self.rows()));
        structure.fill(0.0);
        for (row, force) in contact.chunks_exact(3).enumerate() {
            for &(column, weight) in self.row(row) {
                for (s, f) in structure[3 * column as usize..].iter_mut().zip(force) {
                    *s += weight * f;
                }
            }
        }
    }

    /// Mark in `structure` (one flag per node) the nodes that contact nodes marked in `contact` follow.
    pub fn mark(&self, contact: &[f64], structure: &mut [bool]) {
        structure.fill(false);
        for (row, _) in contact.iter().enumerate().filter(|(_, mark)| **mark != 0.0) {
            for &(column, _) in self.row(row) {
                structure[column as usize] = true;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Rounding of two sums of some 60 products of size 1.
        #[test]
        fn force_and_motion_do_equal_work_on_both_sides(
            rows in prop::collection::vec(prop::collection::vec((0..6u32, 0.0..1.0f64), 1..4), 1..9),
            seed in prop::collection::vec(-1.0..1.0f64, 64),
        ) {
            let h = Matrix::from_rows(6, rows.iter().cloned());
            let u = &seed[..18];
            let f: Vec<f64> = (0..3 * h.rows()).map(|i| seed[63 - i]).collect();
            let (mut contact, mut force) = (vec![0.0; f.len()], vec![0.0; 18]);
            h.consistent(u, &mut contact);
            h.conservative(&f, &mut force);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            prop_assert!((dot(&f, &contact) - dot(&force, u)).abs() < 1e-13);
        }
    }

    #[test]
    fn the_identity_is_the_matrix_of_ones() {
        let h = Matrix::identity(2);
        let plain = Matrix::from_rows(2, [vec![(0, 1.0)], vec![(1, 1.0)]].into_iter());
        let u = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let (mut a, mut b) = ([0.0; 6], [0.0; 6]);
        h.consistent(&u, &mut a);
        plain.consistent(&u, &mut b);
        assert_eq!(a, b);
        h.conservative(&u, &mut a);
        plain.conservative(&u, &mut b);
        assert_eq!(a, b);
    }
}
