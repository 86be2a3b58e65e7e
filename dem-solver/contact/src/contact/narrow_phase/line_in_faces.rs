//! A straight line in a convex polyhedron: under which face each part of it lies, and how deep.
//!
//! The depth of a point is its distance from the nearest face, from within. Below each face it is linear along the line, so the
//! depth is the lowest of some straight lines over the share t of the length: a chain of patches, each below one face.

use crate::law::normal::Load;
use crate::rock::faces::Face;
use nalgebra::Vector3;

/// A part of a line below one face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Number of the face.
    pub face: u32,
    /// Its ends, as shares of the line's length.
    pub ends: [f64; 2],
    /// Depth at its ends [m].
    pub depths: [f64; 2],
}

impl Patch {
    /// The load of a foundation of `stiffness` [N/m] over the whole length, and at which share of the length its force acts: the
    /// integrals of `k d dt` (force), `k d^2 / 2 dt` (energy) and `k dt` (stiffness).
    pub fn load(&self, stiffness: f64) -> (Load, f64) {
        let ([from, to], [a, b]) = (self.ends, self.depths);
        let part = stiffness * (to - from);
        let load = Load {
            stiffness: part,
            force: part * 0.5 * (a + b),
            energy: part * (a * a + a * b + b * b) / 6.0,
        };
        (load, from + (to - from) * (a + 2.0 * b) / (3.0 * (a + b)))
    }
}

/// Calls `found` with each patch of the line from `start` along `edge` [m] below `faces`, which its own `radius` [m] thickens.
/// `below` is a buffer.
pub fn patches(
    faces: &[Face],
    [start, edge]: [&Vector3<f64>; 2],
    radius: f64,
    below: &mut Vec<[f64; 2]>,
    mut found: impl FnMut(Patch),
) {
    below.clear();
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for face in faces {
        let (depth, slope) = (face.offset + radius - face.normal.dot(start), -face.normal.dot(edge));
        if slope > 0.0 {
            from = from.max(-depth / slope);
        } else if slope < 0.0 {
            to = to.min(-depth / slope);
        } else if depth <= 0.0 {
            return;
        }
        if from >= to {
            return;
        }
        below.push([depth, slope]);
    }
    let at = |[depth, slope]: [f64; 2], t: f64| depth + slope * t;
    let lower = |a: &(usize, [f64; 2]), b: &(usize, [f64; 2])| {
        at(a.1, from).total_cmp(&at(b.1, from)).then(a.1[1].total_cmp(&b.1[1]))
    };
    let Some((mut face, _)) = below.iter().copied().enumerate().min_by(lower) else { return };
    // Slopes fall from patch to patch, so this ends.
    loop {
        let own = below[face];
        let (mut end, mut next) = (to, None);
        for (other, line) in below.iter().enumerate().filter(|(_, line)| line[1] < own[1]) {
            let crossing = ((line[0] - own[0]) / (own[1] - line[1])).max(from);
            let sooner = crossing < end;
            let steeper = crossing == end && next.is_some_and(|n: usize| line[1] < below[n][1]);
            if sooner || steeper {
                (end, next) = (crossing, Some(other));
            }
        }
        let depths = [from, end].map(|t| at(own, t).max(0.0));
        if end > from && depths[0] + depths[1] > 0.0 {
            found(Patch { face: face as u32, ends: [from, end], depths });
        }
        let Some(next) = next else { return };
        (from, face) = (end, next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rock::faces::Faces;
    use crate::rock::solid::Solid;
    use crate::settings::Shape;

    fn faces(shape: Shape) -> Faces {
        Faces::of(&Solid::new(&shape).expect("built in").0.drawn).expect("convex")
    }

    fn chain(of: &Faces, a: Vector3<f64>, b: Vector3<f64>, radius: f64) -> Vec<Patch> {
        let mut found = Vec::new();
        patches(&of.planes, [&a, &(b - a)], radius, &mut Vec::new(), |patch| found.push(patch));
        found
    }

    #[test]
    fn a_line_across_a_cube_has_a_patch_below_each_face() {
        let cube = faces(Shape::Box { size: [1.0; 3] });
        // Along x, 0.1 m below the upper face: 45 degrees at the ends.
        let across = chain(&cube, Vector3::new(-1.0, 0.0, 0.4), Vector3::new(1.0, 0.0, 0.4), 0.0);
        assert_eq!(across.len(), 3);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(across[1].ends[0], 0.3) && near(across[1].ends[1], 0.7), "{across:?}");
        assert!(near(across[1].depths[0], 0.1) && near(across[0].ends[0], 0.25), "{across:?}");
        assert!(chain(&cube, Vector3::new(-1.0, 0.0, 0.6), Vector3::new(1.0, 0.0, 0.6), 0.09).is_empty());
        assert_eq!(chain(&cube, Vector3::new(-1.0, 0.0, 0.6), Vector3::new(1.0, 0.0, 0.6), 0.11).len(), 3);
    }

    /// Against a sum over 40 000 points, for lines through a block of 26 faces.
    #[test]
    fn patches_integrate_the_depth_exactly() {
        let block = faces(Shape::EadBlock { size: 1.0 });
        let corner = |k: u32| {
            let at = |i: u32| 1.2 * (f64::from(k * 7 + i * 13) * 0.618_034).fract() - 0.6;
            Vector3::new(at(1), at(2), at(3))
        };
        let mut touched = 0;
        for k in 0..40 {
            let (a, b) = (corner(2 * k), corner(2 * k + 1));
            let (mut force, mut energy, mut moment) = (0.0, 0.0, 0.0);
            let parts = 40_000;
            for i in 0..parts {
                let t = (f64::from(i) + 0.5) / f64::from(parts);
                let point = a + (b - a) * t;
                let depth = block.planes.iter().map(|f| f.offset + 0.01 - f.normal.dot(&point));
                let depth = depth.fold(f64::INFINITY, f64::min).max(0.0) / f64::from(parts).sqrt();
                energy += 0.5 * depth * depth;
                force += depth / f64::from(parts).sqrt();
                moment += t * depth / f64::from(parts).sqrt();
            }
            let loads: Vec<_> = chain(&block, a, b, 0.01).iter().map(|patch| patch.load(1.0)).collect();
            let sum = |of: fn(&(Load, f64)) -> f64| loads.iter().map(of).sum::<f64>();
            assert!((sum(|l| l.0.force) - force).abs() < 1e-8, "{k}: {} {force}", sum(|l| l.0.force));
            assert!((sum(|l| l.0.energy) - energy).abs() < 1e-8, "{k}");
            assert!((sum(|l| l.0.force * l.1) - moment).abs() < 1e-8, "{k}");
            touched += usize::from(force > 0.0);
        }
        assert!(touched > 20, "{touched}");
    }

    /// The force on the ends is the derivative of the energy by their positions.
    #[test]
    fn forces_are_derivatives_of_the_energy() {
        let block = faces(Shape::EadBlock { size: 1.0 });
        let ends = [Vector3::new(-0.7, 0.13, 0.41), Vector3::new(0.55, -0.2, 0.46)];
        let energy = |[a, b]: [Vector3<f64>; 2]| {
            chain(&block, a, b, 0.01).iter().map(|patch| patch.load(3e3).0.energy).sum::<f64>()
        };
        let patches = chain(&block, ends[0], ends[1], 0.01);
        assert!(patches.len() >= 3, "{patches:?}");
        for end in 0..2 {
            for axis in 0..3 {
                let moved = |by: f64| {
                    let mut ends = ends;
                    ends[end][axis] += by;
                    energy(ends)
                };
                let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                let force = |patch: &Patch| {
                    let (load, at) = patch.load(3e3);
                    let share = if end == 0 { 1.0 - at } else { at };
                    -load.force * share * block.planes[patch.face as usize].normal[axis]
                };
                let force: f64 = patches.iter().map(force).sum();
                assert!((slope - force).abs() < 1e-5 * 60.0, "{end} {axis}: {slope} {force}");
            }
        }
    }
}
