//! Pairs of spheres of two rocks that may touch, and for how long two rocks are certain not to.
//!
//! A pair is listed while its surfaces are closer than a skin. The list is good until the second rock,
//! seen from the first, has moved by the skin: by the displacement of its centre and by its turn.

use crate::contact::broad_phase::cell_grid::{SpherePair, SpherePairs};
use crate::rock::{Motion, Rock};
use dem_solid::geometry::sphere_tree::SphereTree;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Skin as a share of the smallest radius. Wider: fewer searches, more pairs that do not touch.
const SKIN: f64 = 0.3;

/// Share of both reaches by which the bounding spheres are larger than the rocks, for rounding.
const ROUNDING: f64 = 1e-9;

/// The second of two rocks as the first sees it: in the first one's own frame.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    /// Its centre of mass [m].
    pub position: Vector3<f64>,
    /// From its own frame to the first one's.
    pub orientation: UnitQuaternion<f64>,
}

impl Pose {
    /// Of the rock that moves as `second`, seen from the one that moves as `first`.
    pub fn new(first: &Motion, second: &Motion) -> Self {
        Self {
            position: first.orientation.inverse_transform_vector(&(second.position - first.position)),
            orientation: first.orientation.inverse() * second.orientation,
        }
    }

    /// The turn as a matrix.
    pub fn rotation(&self) -> Matrix3<f64> {
        self.orientation.to_rotation_matrix().into_inner()
    }
}

/// The candidates of two rocks.
#[derive(Debug, Clone, Default)]
pub struct RockPairs {
    /// Numbers of the spheres of the first and of the second, ascending.
    pub pairs: Vec<[u32; 2]>,
    /// Pose of the second when the list was made.
    made: Option<Pose>,
    skin: f64,
    found: Vec<u32>,
    /// Times that the list was made.
    pub searches: u64,
}

impl RockPairs {
    /// Of rocks `a` and `b`, with room for the pairs of their surfaces.
    pub fn new(a: &Rock, b: &Rock) -> Self {
        // Each sphere of one face may lie between four of the other's.
        let surface = |rock: &Rock| {
            let n = rock.spheres.len() as f64;
            n.min(6.0 * n.powf(2.0 / 3.0)) as usize
        };
        let few = surface(a).min(surface(b));
        Self {
            pairs: Vec::with_capacity((16 * few + 64).min(a.spheres.len() * b.spheres.len())),
            skin: SKIN * a.smallest_radius.min(b.smallest_radius),
            found: Vec::with_capacity(b.spheres.len()),
            ..Self::default()
        }
    }

    /// Make the list good for `b` at `pose`, seen from `a`. Beyond the bounding spheres nothing is listed.
    pub fn update(&mut self, a: (&Rock, &SphereTree), b: (&Rock, &SphereTree), pose: &Pose) {
        if are_apart(a.1, b.1, &pose.position) {
            self.pairs.clear();
            self.made = None;
            return;
        }
        let reach = b.1.reach;
        let good = self.made.is_some_and(|made| {
            let travel = (pose.position - made.position).norm();
            travel + made.orientation.angle_to(&pose.orientation) * reach <= self.skin * (1.0 - ROUNDING)
        });
        if !good {
            self.search(a, b, pose);
        }
    }

    fn search(&mut self, (a, a_tree): (&Rock, &SphereTree), (b, b_tree): (&Rock, &SphereTree), pose: &Pose) {
        self.searches += 1;
        self.made = Some(*pose);
        self.pairs.clear();
        self.found.clear();
        let (turn, skin) = (pose.rotation(), self.skin);
        // The box around the first rock, in the second one's frame.
        let middle = (a.lowest_corner + a.highest_corner) * 0.5;
        let half = (a.highest_corner - a.lowest_corner) * 0.5;
        let centre = turn.tr_mul(&(middle - pose.position));
        let half = turn.transpose().abs() * half;
        let found = &mut self.found;
        b_tree.near(&(centre - half).add_scalar(-skin), &(centre + half).add_scalar(skin), |k| found.push(k));
        for &second in &self.found {
            let sphere = &b.spheres[second as usize];
            let centre = pose.position + turn * sphere.centre;
            let wide = sphere.radius + skin;
            let pairs = &mut self.pairs;
            a_tree.near(&centre.add_scalar(-wide), &centre.add_scalar(wide), |first| {
                let other = &a.spheres[first as usize];
                let limit = wide + other.radius;
                if (centre - other.centre).norm_squared() <= limit * limit {
                    pairs.push([first, second]);
                }
            });
        }
        self.pairs.sort_unstable();
    }
}

/// Skin of the list of [`NearRocks`], as a share of the smallest reach.
const WIDE: f64 = 1.0;

/// Which of many rocks may touch: those whose bounding spheres are closer than a skin, found on a grid. The list is good until
/// some rock has moved by half of the skin.
#[derive(Debug, Clone, Default)]
pub struct NearRocks {
    list: SpherePairs,
    position: Vec<Vector3<f64>>,
    reach: Vec<f64>,
    skin: f64,
}

impl NearRocks {
    /// Of rocks that reach so far from their centres of mass [m].
    pub fn new(reach: Vec<f64>) -> Self {
        let skin = WIDE * reach.iter().copied().fold(f64::INFINITY, f64::min);
        Self { position: Vec::with_capacity(reach.len()), reach, skin, ..Self::default() }
    }

    /// Make the list good for rocks at `position` [m]; true if it is another one now.
    pub fn update(&mut self, position: impl Iterator<Item = Vector3<f64>>) -> bool {
        self.position.clear();
        self.position.extend(position);
        let near = |(x, before): (&Vector3<f64>, &Vector3<f64>)| {
            (x - before).norm() <= 0.5 * self.skin * (1.0 - ROUNDING)
        };
        let known = self.list.reference.len() == self.position.len();
        if known && self.position.iter().zip(&self.list.reference).all(near) {
            return false;
        }
        let pair = |_, second| SpherePair { second, ..SpherePair::default() };
        self.list.build(&self.position, &self.reach, &[], self.skin, pair);
        true
    }

    /// The pairs, the smaller number first, by the second, then by the first.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        // The pairs themselves stand by their first: for each the end of those with it.
        let first = |pair: u32| self.list.start.partition_point(|start| *start <= pair) - 1;
        (0..self.reach.len()).flat_map(move |second| {
            let back = self.list.back_start[second] as usize..self.list.back_start[second + 1] as usize;
            self.list.back[back].iter().map(move |pair| [first(*pair), second])
        })
    }

    /// Times that the list was made.
    pub fn searches(&self) -> u64 {
        self.list.searches
    }
}

/// True if the bounding spheres of two rocks, their centres `apart` [m], have no point in common.
pub fn are_apart(a: &SphereTree, b: &SphereTree, apart: &Vector3<f64>) -> bool {
    let limit = (a.reach + b.reach) * (1.0 + ROUNDING);
    apart.norm_squared() > limit * limit
}

/// Time in which two rocks that fly freely from `first` and `second` are certain not to touch [s].
///
/// The same gravity bends both parabolas, so that the centres pass each other on a straight line.
pub fn free_time(a: &SphereTree, b: &SphereTree, first: &Motion, second: &Motion) -> f64 {
    let apart = second.position - first.position;
    if !are_apart(a, b, &apart) {
        return 0.0;
    }
    let limit = (a.reach + b.reach) * (1.0 + ROUNDING);
    let velocity = second.velocity - first.velocity;
    // |apart + velocity t|^2 = limit^2, the smaller root in the form that does not cancel.
    let (square, closing) = (velocity.norm_squared(), -apart.dot(&velocity));
    let rest = apart.norm_squared() - limit * limit;
    let under = closing * closing - square * rest;
    if closing <= 0.0 || under < 0.0 {
        return f64::INFINITY;
    }
    rest / (closing + under.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Cluster, RockSettings, Shape};
    use toolkit::scene::Scene;

    fn cube(spheres: u32, edge: f64) -> Rock {
        let settings = RockSettings {
            name: "r".into(),
            material: "rock".into(),
            position: [0.0; 3],
            velocity: [0.0; 3],
            orientation: [1.0, 0.0, 0.0, 0.0],
            angular_velocity: [0.0; 3],
            mass: Some(1.0),
            density: None,
            shape: Shape::Box { size: [edge; 3] },
            cluster: Some(Cluster::of(spheres)),
            scale: None,
        };
        let scene = Scene::from_text("test.toml", "").expect("a scene");
        Rock::new(0, &settings, &scene, &[]).unwrap_or_else(|e| panic!("{e}")).0
    }

    fn motion(position: Vector3<f64>, turn: Vector3<f64>, velocity: Vector3<f64>) -> Motion {
        Motion {
            position,
            velocity,
            orientation: UnitQuaternion::from_scaled_axis(turn),
            angular_momentum: Vector3::zeros(),
            acceleration: Vector3::zeros(),
            torque: Vector3::zeros(),
        }
    }

    /// However old the list is: whatever overlaps is in it, in one order.
    #[test]
    fn every_pair_of_spheres_that_overlaps_is_listed_while_two_rocks_move_past_each_other() {
        let (a, b) = (cube(64, 1.0), cube(125, 0.7));
        let trees = [SphereTree::new(&a.spheres), SphereTree::new(&b.spheres)];
        let mut list = RockPairs::new(&a, &b);
        let mut touched = 0;
        for i in 0..400 {
            let t = 0.01 * f64::from(i);
            let first = motion(Vector3::new(5.0, 0.1 * t, 0.0), Vector3::new(0.3, t, 0.0), Vector3::zeros());
            let place = Vector3::new(7.0 - t, 0.2, -0.3 + 0.1 * t);
            let second = motion(place, Vector3::new(0.0, -0.4, 0.7 * t), Vector3::zeros());
            let pose = Pose::new(&first, &second);
            list.update((&a, &trees[0]), (&b, &trees[1]), &pose);
            assert!(list.pairs.is_sorted());
            let at = |rock: &Rock, m: &Motion, k: usize| m.position + m.orientation * rock.spheres[k].centre;
            for k in 0..a.spheres.len() {
                for l in 0..b.spheres.len() {
                    let reach = a.spheres[k].radius + b.spheres[l].radius;
                    if (at(&a, &first, k) - at(&b, &second, l)).norm() < reach {
                        touched += 1;
                        assert!(list.pairs.binary_search(&[k as u32, l as u32]).is_ok(), "{i}: {k} {l}");
                    }
                }
            }
        }
        assert!(touched > 1000 && list.searches < 150, "{touched} in {} searches", list.searches);
    }

    #[test]
    fn two_parabolas_are_free_until_the_bounding_spheres_touch_and_for_ever_if_they_pass() {
        let rock = cube(1, 2.0);
        let tree = SphereTree::new(&rock.spheres);
        let at = |x: f64, y: f64, vx: f64| {
            motion(Vector3::new(x, y, 0.0), Vector3::zeros(), Vector3::new(vx, 0.0, 3.0))
        };
        let time = free_time(&tree, &tree, &at(0.0, 0.0, 1.0), &at(10.0, 0.0, -1.0));
        // A gap of 8 m closes at 2 m/s; the bounding spheres are larger by one part in 1e9.
        assert!(time <= 4.0 && time > 4.0 - 2e-9, "{time}");
        assert_eq!(free_time(&tree, &tree, &at(0.0, 0.0, 1.0), &at(10.0, 2.1, -1.0)), f64::INFINITY);
        assert_eq!(free_time(&tree, &tree, &at(0.0, 0.0, -1.0), &at(10.0, 0.0, 1.0)), f64::INFINITY);
        assert_eq!(free_time(&tree, &tree, &at(0.0, 0.0, 0.0), &at(1.9, 0.0, 1.0)), 0.0);
    }
}
