//! Mapping between the structure's mesh and that of the contact solver: one sparse matrix H.
//!
//! Motion goes to the contact solver by H (*consistent*: rows sum to 1), force comes back by its transpose
//! (*conservative*): then `f_structure . u = f_contact . (H u)` for every displacement, to rounding.
//! Equal meshes are mapped node to node, whatever the scene names. Between others one must be named; how good it is at t = 0 is reported
//! (`quality`).
//! Source: Farhat, Lesoinne and Le Tallec (1998), Comput. Methods Appl. Mech. Engrg. 157, 95.

mod elements;
mod matrix;
mod nearest;
mod quality;
mod rbf;

pub use matrix::Matrix;
pub use quality::Quality;

use crate::registry::registry;
use interface_defs::{Diagnostic, InterfaceMesh, code};

/// Builds the matrix that takes motion from the structure's nodes to those of contact.
pub trait Mapper {
    /// H for these meshes, of which the structure's has nodes: a row per contact node, a column per structure node. `Err` says why it
    /// cannot.
    fn matrix(&self, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Result<Matrix, String>;

    /// What is wrong with its settings, as key and reason.
    fn check(&self) -> Result<(), (&'static str, String)> {
        Ok(())
    }
}

/// H for these meshes by the mapping that the scene names, if it names one, and how good it is where they differ. `Err` says why there is
/// none.
pub fn map(
    mapper: Option<&AnyMapper>,
    structure: &InterfaceMesh,
    contact: &InterfaceMesh,
) -> Result<(Matrix, Option<Quality>), Diagnostic> {
    if structure.same_nodes(contact) {
        return Ok((Matrix::identity(structure.node_count()), None));
    }
    let mapper = mapper.ok_or_else(|| {
        let [offered, used] = [structure, contact].map(InterfaceMesh::node_count);
        let what = format!(
            "coupling.mapping: the structure offers {offered} nodes, the contact solver works on {used}, or on the same number at \
             other places, and the scene does not say how one follows the other"
        );
        Diagnostic::error(code::MISSING_KEY, what).try_instead(
            "name coupling.mapping.type = \"nearest_projection\" (onto lines and faces), \"rbf\" (smooth) or \
             \"nearest_neighbor\" (node to node)",
        )
    })?;
    let cannot = |what: String| Diagnostic::error(code::GEOMETRY, format!("coupling.mapping: {what}"));
    if structure.node_count() == 0 {
        return Err(cannot("the structure's interface mesh has no nodes".into()));
    }
    let matrix = mapper.matrix(structure, contact).map_err(cannot)?;
    let quality = Quality::of(&matrix, structure, contact);
    Ok((matrix, Some(quality)))
}

registry! {
    /// Every mapping that `[coupling.mapping] type` may name.
    pub enum AnyMapper: Mapper {
        "identity" => nearest::Identity,
        "nearest_neighbor" => nearest::NearestNeighbor,
        "nearest_projection" => nearest::NearestProjection,
        "rbf" => rbf::Rbf,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A net of 5 by 4 cells of 0.5 m that sags, as lines or as faces.
    fn net(faces: bool) -> InterfaceMesh {
        let (columns, rows) = (6_u32, 5_u32);
        let mut mesh = InterfaceMesh::default();
        for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let (x, y) = (0.5 * f64::from(i), 0.5 * f64::from(j));
            mesh.coordinates.extend([x, y, sag(x, y)]);
            let node = j * columns + i;
            let (right, up) = (i + 1 < columns, j + 1 < rows);
            if faces && right && up {
                mesh.faces.extend([
                    [node, node + 1, node + columns],
                    [node + 1, node + 1 + columns, node + columns],
                ]);
            } else if !faces {
                mesh.lines.extend(
                    right.then_some([node, node + 1]).into_iter().chain(up.then_some([node, node + columns])),
                );
            }
        }
        mesh
    }

    fn sag(x: f64, y: f64) -> f64 {
        0.05 * (x * (2.5 - x) + y * (2.0 - y))
    }

    /// Points on the net's lines and faces.
    fn contact(structure: &InterfaceMesh) -> InterfaceMesh {
        let at = |shares: &[(u32, f64)]| -> [f64; 3] {
            std::array::from_fn(|c| {
                shares.iter().map(|(n, s)| s * structure.coordinates[3 * *n as usize + c]).sum()
            })
        };
        let on_lines = structure.lines.iter().map(|&[a, b]| at(&[(a, 0.7), (b, 0.3)]));
        let on_faces = structure.faces.iter().map(|&[a, b, c]| at(&[(a, 0.2), (b, 0.3), (c, 0.5)]));
        let coordinates = on_lines.chain(on_faces).flatten().collect();
        InterfaceMesh { coordinates, ..Default::default() }
    }

    /// `c + A x`: motion that is affine in space.
    fn affine(mesh: &InterfaceMesh) -> Vec<f64> {
        let rows = [[0.3, 0.1, -0.2, 0.4], [-0.1, 0.2, 0.3, 0.5], [0.7, -0.4, 0.1, -0.6]];
        let of = |[x, y, z]: [f64; 3]| rows.map(|[c, a, b, d]| c + a * x + b * y + d * z);
        mesh.coordinates.as_chunks::<3>().0.iter().flat_map(|p| of(*p)).collect()
    }

    /// Sum and moment about the origin of forces at the nodes.
    fn resultant(mesh: &InterfaceMesh, force: &[f64]) -> [f64; 6] {
        let mut sum = [0.0; 6];
        for (p, f) in mesh.coordinates.as_chunks::<3>().0.iter().zip(force.as_chunks::<3>().0) {
            for c in 0..3 {
                let (d, e) = ((c + 1) % 3, (c + 2) % 3);
                sum[c] += f[c];
                sum[3 + c] += p[d] * f[e] - p[e] * f[d];
            }
        }
        sum
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// Of every mapping that is registered: constants are kept, work and sum of forces are the same on both sides. Those of first order keep
    /// affine motions and moments, too. Sums of a hundred products of size 1.
    #[test]
    fn every_mapping_keeps_work_and_forces_and_those_of_first_order_affine_motions_and_moments() {
        for (name, faces) in AnyMapper::NAMES.iter().flat_map(|name| [(*name, false), (*name, true)]) {
            let mapper: AnyMapper =
                toml::from_str(&format!("type = \"{name}\"")).expect("defaults for every key");
            assert_eq!(mapper.check(), Ok(()), "{name}");
            let structure = net(faces);
            let contact = if name == "identity" { structure.clone() } else { contact(&structure) };
            let (matrix, quality) = map(Some(&mapper), &structure, &contact).expect("it can be mapped");
            let mut motion = vec![0.0; contact.coordinates.len()];
            matrix.consistent(&affine(&structure), &mut motion);
            let force: Vec<f64> = (0..motion.len()).map(|i| (1.0 + i as f64).sin()).collect();
            let mut mapped = vec![0.0; structure.coordinates.len()];
            matrix.conservative(&force, &mut mapped);
            let work = dot(&force, &motion);
            assert!(
                (work - dot(&mapped, &affine(&structure))).abs() < 1e-12 * work.abs().max(1.0),
                "{name}: work"
            );
            let (before, after) = (resultant(&contact, &force), resultant(&structure, &mapped));
            let kept = if name == "nearest_neighbor" { 3 } else { 6 };
            for c in 0..kept {
                assert!((before[c] - after[c]).abs() < 1e-11, "{name}: {before:?} {after:?}");
            }
            let error = motion.iter().zip(affine(&contact)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if name == "nearest_neighbor" {
                assert!(error > 1e-2, "it is of order 0");
            } else {
                assert!(error < 1e-12, "{name}: {error:e}");
                let warnings = quality.map_or(Vec::new(), |quality| quality.warnings());
                assert_eq!(warnings, [], "{name}");
            }
        }
    }

    /// A smooth motion that is not affine, on nodes of the surface that the net approximates: each finer mapping is nearer to it.
    #[test]
    fn projection_is_more_accurate_than_the_nearest_node_and_radial_basis_functions_more_than_projection() {
        let structure = net(true);
        let mut contact = contact(&structure);
        contact.coordinates.as_chunks_mut::<3>().0.iter_mut().for_each(|[x, y, z]| *z = sag(*x, *y));
        let wave = |mesh: &InterfaceMesh| -> Vec<f64> {
            mesh.coordinates
                .as_chunks::<3>()
                .0
                .iter()
                .flat_map(|[x, y, _]| [(2.0 * x + y).sin(), x * y, 0.0])
                .collect()
        };
        let error = |name: &str| {
            let mapper: AnyMapper =
                toml::from_str(&format!("type = \"{name}\"")).expect("defaults for every key");
            let (matrix, _) = map(Some(&mapper), &structure, &contact).expect("it can be mapped");
            let mut motion = vec![0.0; contact.coordinates.len()];
            matrix.consistent(&wave(&structure), &mut motion);
            motion.iter().zip(wave(&contact)).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
        };
        let [node, point, smooth] = ["nearest_neighbor", "nearest_projection", "rbf"].map(error);
        assert!(smooth < 0.5 * point && point < 0.5 * node, "{node} {point} {smooth}");
    }

    #[test]
    fn a_plane_net_has_no_slope_across_and_a_node_off_it_is_reported() {
        let mut structure = net(true);
        structure.coordinates.as_chunks_mut::<3>().0.iter_mut().for_each(|p| p[2] = 0.0);
        let contact = InterfaceMesh { coordinates: vec![1.1, 0.8, 0.0, 1.1, 0.8, 0.4], ..Default::default() };
        for mapper in ["rbf", "nearest_projection"] {
            let mapper: AnyMapper =
                toml::from_str(&format!("type = \"{mapper}\"")).expect("defaults for every key");
            let (matrix, quality) = map(Some(&mapper), &structure, &contact).expect("it can be mapped");
            let mut place = [0.0; 6];
            matrix.consistent(&structure.coordinates, &mut place);
            let off = |at: usize, exact: f64| (place[at] - exact).abs() < 1e-12;
            assert!(off(0, 1.1) && off(1, 0.8) && off(3, 1.1) && off(4, 0.8) && off(5, 0.0), "{place:?}");
            let warnings = quality.expect("the meshes differ").warnings();
            let [warning] = &warnings[..] else { panic!("{warnings:?}") };
            for part in ["1 of 2 nodes", "node 1 at (1.1000, 0.8000, 0.4000) m", "by 4.000e-1 m"] {
                assert!(warning.message.contains(part), "{part}: {warning}");
            }
        }
    }

    #[test]
    fn meshes_that_differ_are_refused_without_a_mapping_that_is_named() {
        let structure = net(false);
        let message =
            map(None, &structure, &contact(&structure)).expect_err("no mapping is named").to_string();
        for part in ["30 nodes", "49", "coupling.mapping.type", "nearest_projection", "rbf"] {
            assert!(message.contains(part), "{part}: {message}");
        }
        let (matrix, quality) = map(None, &structure, &structure.clone()).expect("equal meshes");
        assert!(matrix.is_identity());
        assert_eq!(quality, None);
    }
}
