//! The spheres that may be the furthest in a direction, and those that touch a plane together.

use dem_solid::geometry::sphere::Sphere;
use dem_solid::shape::{Surface, builtin};
use nalgebra::Vector3;

/// Times that a patch of directions is cut in four: at last patches of 0.5 degrees.
const CUTS: usize = 6;

/// A sphere touches a plane with others if it ends within this share of the smallest radius of the
/// furthest one.
const TOGETHER: f64 = 0.1;

/// All spheres of which one is the furthest in any direction, ascending.
///
/// Over a patch of directions within an angle `a` of its middle no sphere gains more than
/// `a |c_j - c_k|` on another: one that lies further behind in the middle is out. Patches are cut until few spheres are left.
pub fn of(spheres: &[Sphere]) -> Vec<u32> {
    let patches = builtin::ellipsoid(Vector3::repeat(1.0), 0);
    let mut outer = vec![false; spheres.len()];
    let all: Vec<u32> = (0..spheres.len() as u32).collect();
    for t in 0..patches.triangles.len() {
        narrow(spheres, &patches.corners(t), &all, CUTS, &mut outer);
    }
    (0..spheres.len() as u32).filter(|k| outer[*k as usize]).collect()
}

fn narrow(spheres: &[Sphere], patch: &[Vector3<f64>; 3], some: &[u32], cuts: usize, outer: &mut [bool]) {
    let middle = patch.iter().sum::<Vector3<f64>>().normalize();
    // The chord of half the angle is a bound for the change of a unit vector.
    let change = patch.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
    let end = |k: u32| {
        let s = &spheres[k as usize];
        s.centre.dot(&middle) + s.radius
    };
    let first = some.iter().copied().max_by(|a, b| end(*a).total_cmp(&end(*b)).then(b.cmp(a)));
    let Some(first) = first else { return };
    let (furthest, place) = (end(first), spheres[first as usize].centre);
    let left: Vec<u32> = some
        .iter()
        .copied()
        .filter(|k| {
            furthest - end(*k) <= change * (spheres[*k as usize].centre - place).norm() * (1.0 + 1e-12)
        })
        .collect();
    if cuts == 0 || left.len() < 2 {
        left.iter().for_each(|k| outer[*k as usize] = true);
        return;
    }
    let [a, b, c] = *patch;
    let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
    for part in [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]] {
        narrow(spheres, &part, &left, cuts - 1, outer);
    }
}

/// How many spheres of the smallest radius would be as stiff together, at equal overlap, as those that
/// touch a plane at once, the plane lying along a triangle of `surface`.
///
/// By Hertz the stiffness at an overlap goes with the root of the radius.
pub fn facing(spheres: &[Sphere], surface: &Surface) -> f64 {
    let smallest = spheres.iter().map(|s| s.radius).fold(f64::INFINITY, f64::min);
    // Of a surface of many triangles some, evenly: faces of a rock have many each.
    let step = (surface.triangles.len() / 2000).max(1);
    let along = |direction: Vector3<f64>| {
        let end = |s: &Sphere| s.centre.dot(&direction) + s.radius;
        let furthest = spheres.iter().map(end).fold(f64::NEG_INFINITY, f64::max);
        let touching = spheres.iter().filter(|s| end(s) >= furthest - TOGETHER * smallest);
        touching.map(|s| (s.radius / smallest).sqrt()).sum::<f64>()
    };
    (0..surface.triangles.len()).step_by(step).map(|t| along(surface.normal(t))).fold(1.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dem_solid::cluster::lattice::Lattice;

    #[test]
    fn the_furthest_sphere_in_any_direction_is_among_the_outermost() {
        let at = |i: u32, f: f64| (f64::from(i) * f).sin();
        let spheres: Vec<Sphere> = (0..600)
            .map(|i| Sphere {
                centre: Vector3::new(at(i, 1.3), at(i, 2.7) * 0.5, at(i, 3.1)),
                radius: 0.01 + 0.2 * at(i, 0.7).powi(4),
            })
            .collect();
        let outer = of(&spheres);
        assert!(outer.len() < 200, "{}", outer.len());
        for i in 0..20_000 {
            let u = Vector3::new(at(i, 4.1), at(i, 5.9), at(i, 0.37)).normalize();
            let end = |k: u32| spheres[k as usize].centre.dot(&u) + spheres[k as usize].radius;
            let furthest = (0..600).map(end).fold(f64::NEG_INFINITY, f64::max);
            assert_eq!(outer.iter().map(|k| end(*k)).fold(f64::NEG_INFINITY, f64::max), furthest);
        }
    }

    #[test]
    fn the_spheres_of_a_lattice_that_face_a_plane_are_those_of_its_largest_side() {
        let lattice = Lattice::within([0.2, 0.4, 0.6], 500).expect("fits");
        let [_, y, z] = lattice.counts.map(f64::from);
        let surface = builtin::cuboid(Vector3::new(0.2, 0.4, 0.6));
        assert_eq!(facing(&lattice.spheres(), &surface), y * z);
    }
}
