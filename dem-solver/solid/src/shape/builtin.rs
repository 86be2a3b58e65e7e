//! Shapes that need no file.

use super::surface::Surface;
use crate::random::SplitMix;
use nalgebra::Vector3;
use std::collections::HashMap;

/// A box with these edges [m] around the origin.
pub fn cuboid(size: Vector3<f64>) -> Surface {
    let corner = |c: u32| {
        let sign = |bit: u32| if c & bit == 0 { -0.5 } else { 0.5 };
        Vector3::new(sign(1), sign(2), sign(4)).component_mul(&size)
    };
    // Each face by its corners, counter-clockwise from outside.
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Surface { points: (0..8).map(corner).collect(), triangles }
}

/// A box with these edges [m] around the origin whose edges and corners are cut off at a quarter of
/// each: 24 corners, 18 rectangles and 8 triangles, 17/24 of the box's volume.
///
/// With equal edges it is the concrete block of EAD 340059-00-0106 (before: ETAG 027) and the norm
/// rock "1:1:1"; with edges 2 : 2 : 1 the norm rock "2:2:1" of the Chant Sura experiments (Caviezel et
/// al. (2019), Earth Surf. Dynam. 7, 199). The standard's drawing was not at hand: the cut follows from the extents
/// of the published point files for 1 m3 (1.122 m; 1.41363 x 1.41363 x 0.70682 m, 24 points each). A
/// cube cut like this at a quarter has 1 m3 at 1.1218 m; at a third it would at 1.235 m.
pub fn cut_cube(size: Vector3<f64>) -> Surface {
    let corner = |i: usize| {
        let half = |k: usize| if k == i / 8 { 0.5 } else { 0.25 };
        Vector3::from_fn(|k, _| if (i % 8) >> k & 1 == 0 { -half(k) } else { half(k) })
    };
    let mut points: Vec<Vector3<f64>> = (0..24).map(corner).collect();
    let mut triangles = Vec::with_capacity(44);
    for code in 0..27 {
        let normal = Vector3::new(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1).map(f64::from);
        let highest = points.iter().map(|p| p.dot(&normal)).fold(f64::NEG_INFINITY, f64::max);
        if highest <= 0.0 {
            continue;
        }
        let mut face: Vec<u32> =
            (0..24).filter(|i| points[*i as usize].dot(&normal) > highest - 1e-9).collect();
        let middle = face.iter().map(|i| points[*i as usize]).sum::<Vector3<f64>>() / face.len() as f64;
        let first = points[face[0] as usize] - middle;
        let turn = |i: &u32| {
            let arm = points[*i as usize] - middle;
            first.cross(&arm).dot(&normal).atan2(first.dot(&arm) * normal.norm())
        };
        face.sort_by(|a, b| turn(a).total_cmp(&turn(b)));
        triangles.extend((2..face.len()).map(|k| [face[0], face[k - 1], face[k]]));
    }
    points.iter_mut().for_each(|p| p.component_mul_assign(&size));
    Surface { points, triangles }
}

/// An ellipsoid with these semi-axes [m] around the origin: an icosahedron whose triangles are cut in
/// four `levels` times, `20 * 4^levels` triangles with their corners on the ellipsoid.
pub fn ellipsoid(semi_axes: Vector3<f64>, levels: u32) -> Surface {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut points: Vec<Vector3<f64>> = Vec::new();
    for axis in 0..3 {
        for (one, two) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            let mut p = Vector3::zeros();
            p[(axis + 1) % 3] = one;
            p[(axis + 2) % 3] = two;
            points.push(p.normalize());
        }
    }
    // Neighbours are 2 apart before normalising: 63.4 degrees, 2 / sqrt(1 + golden^2).
    let near = |a: usize, b: usize| (points[a] - points[b]).norm() < 1.1;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outwards = points[a].dot(&points[b].cross(&points[c])) > 0.0;
                    triangles.push(if outwards { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut finer = Vec::with_capacity(triangles.len() * 4);
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push((points[i as usize] + points[j as usize]).normalize());
                    points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    points.iter_mut().for_each(|p| p.component_mul_assign(&semi_axes));
    Surface { points, triangles }
}

/// A convex polyhedron by chance: the hull of `count` points on and in an ellipsoid, stretched to fill a
/// box with edges `size` [m] around the origin. The same seed gives the same polyhedron on every machine.
pub fn random_convex(size: Vector3<f64>, count: u32, seed: u64) -> Result<Surface, String> {
    let mut random = SplitMix(seed);
    let mut chance = || random.share();
    let points: Vec<Vector3<f64>> = (0..count)
        .map(|_| {
            // A direction without preference, and a depth of up to a fifth: flat faces and blunt corners.
            loop {
                let p = Vector3::new(chance(), chance(), chance()) * 2.0 - Vector3::repeat(1.0);
                let length = p.norm();
                if (0.1..=1.0).contains(&length) {
                    return p * ((0.8 + 0.2 * chance()) / length);
                }
            }
        })
        .collect();
    let mut hull = super::hull::convex(&points)?;
    let (lowest, highest) = hull.bounds();
    for p in &mut hull.points {
        *p = (*p - (lowest + highest) / 2.0).component_div(&(highest - lowest)).component_mul(&size);
    }
    Ok(hull)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::SolidIntegrals;
    use std::f64::consts::PI;

    fn is_sound(surface: &Surface) {
        let (again, notes) =
            Surface::from_indexed(surface.points.clone(), surface.triangles.clone()).expect("sound");
        assert!(notes.is_empty(), "{notes:?}");
        assert_eq!(again.triangles.len(), surface.triangles.len());
    }

    #[test]
    fn every_shape_is_closed_faces_outwards_and_is_centred() {
        let size = Vector3::new(0.2, 0.4, 0.6);
        let random = random_convex(size, 40, 7).expect("a hull");
        for surface in [cuboid(size), cut_cube(size), ellipsoid(size, 3)] {
            is_sound(&surface);
            assert!(SolidIntegrals::of(&surface).centre.norm() < 1e-15);
        }
        is_sound(&random);
        let (lowest, highest) = random.bounds();
        assert!((highest - lowest - size).norm() < 1e-15);
    }

    /// The published extents of the norm rocks of 1 m3, three digits after the point.
    #[test]
    fn norm_rocks_of_one_cubic_metre_have_the_published_extents() {
        for (ratio, published) in [([1.0, 1.0, 1.0], [1.122, 1.122]), ([2.0, 2.0, 1.0], [1.4136, 0.7068])] {
            let unit = cut_cube(ratio.into());
            assert_eq!((unit.points.len(), unit.triangles.len()), (24, 44));
            let volume = SolidIntegrals::of(&unit).volume;
            assert!((volume / ratio.iter().product::<f64>() - 17.0 / 24.0).abs() < 1e-15);
            let scale = (1.0 / volume).cbrt();
            // They were made from 1.122 m, which is 0.02 % above the exact 1.1218 m.
            for (edge, published) in [(ratio[0] * scale, published[0]), (ratio[2] * scale, published[1])] {
                assert!((edge / published - 1.0).abs() < 2.5e-4, "{edge} {published}");
            }
        }
    }

    /// An inscribed polyhedron lacks volume in proportion to the squared edge.
    #[test]
    fn an_ellipsoid_comes_nearer_to_its_volume_with_the_second_order() {
        let axes = Vector3::new(0.5, 0.3, 0.2);
        let exact = 4.0 / 3.0 * PI * axes.iter().product::<f64>();
        let lack = |levels| 1.0 - SolidIntegrals::of(&ellipsoid(axes, levels)).volume / exact;
        assert!((lack(3) / lack(4) - 4.0).abs() < 0.1, "{} {}", lack(3), lack(4));
    }

    #[test]
    fn a_seed_is_a_rock() {
        let size = Vector3::repeat(1.0);
        let rock = |seed| random_convex(size, 30, seed).expect("a hull");
        assert_eq!(rock(3), rock(3));
        assert_ne!(rock(3), rock(4));
    }
}
