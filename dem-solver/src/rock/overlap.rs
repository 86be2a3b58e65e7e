//! Whether two rocks have met. Contact between rocks is not part of this version, so that a run in
//! which they meet must end with a message.

use super::{Motion, Rock};
use crate::search::tree::SphereTree;

/// True if a sphere of `a` overlaps one of `b`, whose tree is `tree`.
pub fn met(a: &Rock, at: &Motion, b: &Rock, bt: &Motion, tree: &SphereTree) -> bool {
    let apart = at.position - bt.position;
    let largest = a.reach + b.reach;
    if apart.norm_squared() > largest * largest {
        return false;
    }
    a.spheres.iter().any(|sphere| {
        let centre = bt.orientation.inverse_transform_vector(&(at.orientation * sphere.centre + apart));
        let mut touches = false;
        tree.near(&centre.add_scalar(-sphere.radius), &centre.add_scalar(sphere.radius), |k| {
            let other = &b.spheres[k as usize];
            let sum = sphere.radius + other.radius;
            touches |= (other.centre - centre).norm_squared() < sum * sum;
        });
        touches
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Cluster, RockSettings, Shape};
    use interface_defs::toolkit::scene::Scene;
    use nalgebra::Vector3;

    #[test]
    fn rocks_have_met_when_spheres_overlap_not_when_their_bounds_do() {
        let settings = |position: [f64; 3]| RockSettings {
            name: "r".into(),
            material: "rock".into(),
            position,
            velocity: [0.0; 3],
            orientation: [1.0, 0.0, 0.0, 0.0],
            angular_velocity: [0.0; 3],
            mass: Some(1.0),
            density: None,
            shape: Shape::Box { size: [1.0; 3] },
            cluster: Some(Cluster::of(64)),
        };
        let place = |position| {
            let settings = settings(position);
            let scene = Scene::from_text("test.toml", "").expect("a scene");
            let (rock, _) = Rock::new(0, &settings, &scene).unwrap_or_else(|e| panic!("{e}"));
            let motion = rock.start(&settings, Vector3::zeros());
            (rock, motion)
        };
        let (a, at) = place([0.0; 3]);
        let tree = SphereTree::new(&a.spheres);
        for (position, expected) in [([0.999, 0.0, 0.0], true), ([1.001, 0.0, 0.0], false), ([0.0; 3], true)]
        {
            let (b, bt) = place(position);
            assert_eq!(met(&b, &bt, &a, &at, &tree), expected, "{position:?}");
        }
    }
}
