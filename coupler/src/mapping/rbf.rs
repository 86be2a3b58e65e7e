//! Each contact node interpolates the structure nodes around it by radial basis functions and a linear polynomial.
//!
//! Of `neighbors` structure nodes around a contact node: `[Phi P; P^T 0] [w; m] = [phi; p]`, with Wendland's C2 function
//! `phi(r) = (1 - r/R)^4 (4 r/R + 1)`, R four times the distance of the farthest of them, and P the polynomials 1, x, y, z of their
//! places. Motions that are affine in space are reproduced, so that forces keep sum and moments. Along an axis in which these
//! nodes have no extent (a plane net), or beyond whose extent the contact node lies, nothing is extrapolated.
//! Source: Wendland (1995), Adv. Comput. Math. 4, 389; Beckert and Wendland (2001), Aerosp. Sci. Technol. 5, 125; local nodes as in
//! Rendall and Allen (2009), J. Comput. Phys. 228, 6231.

use super::{Mapper, Matrix};
use interface_defs::InterfaceMesh;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rstar::{RTree, primitives::GeomWithData};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Support of a function over the distance of the farthest neighbour: flat functions are the more accurate ones, and 16 nodes bear them.
const SUPPORT: f64 = 4.0;

/// Share of the largest extent of the neighbours below which they have none along an axis.
const FLAT: f64 = 1e-9;

/// Radial basis functions (Wendland C2) of the nearest structure nodes, with a linear polynomial: for nodes on one smooth surface.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rbf {
    /// Structure nodes that a contact node interpolates, 4 to 64.
    pub neighbors: usize,
}

impl Default for Rbf {
    fn default() -> Self {
        Self { neighbors: 16 }
    }
}

impl Mapper for Rbf {
    fn matrix(&self, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Result<Matrix, String> {
        let nodes = structure.coordinates.as_chunks::<3>().0.iter().zip(0..);
        let tree = RTree::bulk_load(nodes.map(|(p, node)| GeomWithData::new(*p, node)).collect());
        let points = contact.coordinates.as_chunks::<3>().0.iter();
        let rows: Result<Vec<_>, String> = points.map(|point| self.row(&tree, *point)).collect();
        Ok(Matrix::from_rows(structure.node_count(), rows?.into_iter()))
    }

    fn check(&self) -> Result<(), (&'static str, String)> {
        if (4..=64).contains(&self.neighbors) {
            return Ok(());
        }
        Err(("neighbors", format!("4 to 64 nodes can be interpolated, not {}", self.neighbors)))
    }
}

type Nodes = RTree<GeomWithData<[f64; 3], u32>>;

impl Rbf {
    fn row(&self, tree: &Nodes, point: [f64; 3]) -> Result<Vec<(u32, f64)>, String> {
        let (nodes, places) = self.neighbors(tree, point);
        if places[0].norm_squared() == 0.0 || nodes.len() == 1 {
            return Ok(vec![(nodes[0], 1.0)]);
        }
        let radius = SUPPORT * places.iter().map(|p| p.norm()).fold(0.0, f64::max);
        let axes = axes(&places);
        let (count, size) = (nodes.len(), nodes.len() + 1 + axes.len());
        let mut matrix = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        for (i, p) in places.iter().enumerate() {
            for (j, q) in places.iter().enumerate() {
                matrix[(i, j)] = wendland((p - q).norm() / radius);
            }
            right[i] = wendland(p.norm() / radius);
            for (row, value) in axes.iter().map(|axis| axis.dot(p) / radius).chain([1.0]).enumerate() {
                matrix[(count + row, i)] = value;
                matrix[(i, count + row)] = value;
            }
        }
        // The contact node is the origin: of the polynomials only the constant is not 0 there.
        right[size - 1] = 1.0;
        let weights = matrix.full_piv_lu().solve(&right).ok_or_else(|| {
            format!("the {count} nodes of the structure around {point:?} cannot be interpolated; try type = \"nearest_projection\"")
        })?;
        Ok(nodes.into_iter().zip(weights.iter().copied()).collect())
    }

    /// The nearest nodes, nearest first, and where they are from `point`. Of several at one place there is the first.
    fn neighbors(&self, tree: &Nodes, point: [f64; 3]) -> (Vec<u32>, Vec<Vector3<f64>>) {
        let from = Vector3::from(point);
        let mut found: Vec<(f64, u32, Vector3<f64>)> = Vec::new();
        for (node, square) in tree.nearest_neighbor_iter_with_distance_2(point) {
            // Nodes at the distance of the last one are all looked at: which of them are taken is for their numbers to decide.
            if found.len() >= self.neighbors && square > found[self.neighbors - 1].0 {
                break;
            }
            found.push((square, node.data, Vector3::from(*node.geom()) - from));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (mut nodes, mut places) = (Vec::new(), Vec::new());
        for (_, node, place) in found {
            if nodes.len() < self.neighbors && !places.contains(&place) {
                nodes.push(node);
                places.push(place);
            }
        }
        (nodes, places)
    }
}

/// `phi` at r/R.
fn wendland(r: f64) -> f64 {
    (1.0 - r).max(0.0).powi(4) * (4.0 * r + 1.0)
}

/// Principal axes of the places along which these have an extent that the origin does not leave.
fn axes(places: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    let spread: Matrix3<f64> = places.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let vectors = spread.symmetric_eigen().eigenvectors;
    let extent = |axis: &Vector3<f64>| places.iter().map(|p| axis.dot(&(p - mean)).abs()).fold(0.0, f64::max);
    let axes: Vec<Vector3<f64>> = vectors.column_iter().map(|axis| axis.into_owned()).collect();
    let largest = axes.iter().map(extent).fold(0.0, f64::max);
    axes.into_iter()
        .filter(|axis| extent(axis) > FLAT * largest && axis.dot(&mean).abs() <= extent(axis))
        .collect()
}
