//! Which spheres of a rock may touch which triangles of the terrain, and how far the rock is from it.
//!
//! Triangles around the rock are kept until it has moved by a margin, pairs until it has moved or turned
//! by a smaller skin. Nothing of the terrain moves, and nothing here grows with its size.

use super::pairs::{Pair, PairElement, PairList};
use super::tree::{Slab, SphereTree};
use crate::ground::Ground;
use crate::ground::look::arrival;
use crate::rock::{Motion, Rock};
use crate::wall::Kind;
use crate::wall::closest::on_face;
use crate::wall::motion::NodeMotion;
use nalgebra::{UnitQuaternion, Vector3};

/// How much further than asked for pairs are listed, as a share of the smallest radius: between these, what the
/// rock moves in [`STRIDES`] steps. Wider: fewer searches, more pairs that do not touch, which are cheap.
const SKIN: [f64; 2] = [0.05, 0.2];
const STRIDES: f64 = 100.0;

/// Margin of the triangles that are kept, as a share of the rock's reach: at 10 m/s a look into the
/// terrain's tree each 10 ms for a rock of 0.8 m.
const MARGIN: f64 = 0.25;

/// The surroundings of one rock on the terrain. Nothing here is state.
#[derive(Debug, Clone, Default)]
pub struct Surroundings {
    /// Triangles near the rock, ascending.
    near: Vec<u32>,
    near_at: Vector3<f64>,
    coverage: f64,
    /// Pairs that may touch.
    pub pairs: PairList,
    /// Their nodes, which stand still.
    pub nodes: NodeMotion,
    /// A corner of each element of the pairs, and its unit normal.
    pub planes: Vec<(Vector3<f64>, Vector3<f64>)>,
    searched: Option<(Vector3<f64>, UnitQuaternion<f64>)>,
    skin: f64,
    /// Times that triangles were looked for.
    pub refreshes: u64,
}

impl Surroundings {
    /// Of `rock`, with room for what it usually meets.
    pub fn new(rock: &Rock) -> Self {
        let mut it = Self { coverage: f64::NEG_INFINITY, ..Self::default() };
        it.near.reserve(1024);
        it.pairs.pairs.reserve(4 * rock.spheres.len() + 1024);
        it.pairs.elements.reserve(1024);
        it.pairs.nodes.reserve(3072);
        it.pairs.numbers.reserve(3072);
        it.nodes.reserve(3072, 1);
        it.planes.reserve(1024);
        it
    }

    /// Make sure that every pair that is nearer than `reach` [m] at `now` is listed, which is every one that
    /// touches where it is 0; the steps under way are `h` [s] long.
    pub fn update(
        &mut self,
        rock: &Rock,
        tree: &SphereTree,
        ground: &Ground,
        now: &Motion,
        h: f64,
        reach: f64,
    ) {
        if let Some((position, orientation)) = &self.searched {
            let turn = orientation.inverse() * now.orientation;
            // A point at distance r moves by 2 r sin(angle / 2).
            if (now.position - position).norm() + 2.0 * turn.imag().norm() * rock.arm + reach <= self.skin {
                return;
            }
        }
        let speed = now.velocity.norm() + now.angular_momentum.norm() / rock.inertia.min() * rock.arm;
        let [least, most] = SKIN.map(|share| share * rock.smallest_radius);
        let skin = reach + (STRIDES * speed * h).clamp(least, most);
        let need = tree.reach + skin;
        if (now.position - self.near_at).norm() + need > self.coverage {
            self.refreshes += 1;
            (self.near_at, self.coverage) = (now.position, need + MARGIN * tree.reach);
            let near = &mut self.near;
            near.clear();
            ground.within(&now.position, self.coverage, |t| near.push(t));
        }
        self.search(tree, ground, now, skin);
    }

    fn search(&mut self, tree: &SphereTree, ground: &Ground, now: &Motion, skin: f64) {
        self.searched = Some((now.position, now.orientation));
        self.skin = skin;
        let list = &mut self.pairs;
        list.searches += 1;
        list.pairs.clear();
        list.elements.clear();
        list.numbers.clear();
        self.planes.clear();
        let to_own = now.rotation().transpose();
        for &number in &self.near {
            let [a, b, c] = ground.corners(number).map(|p| to_own * (p - now.position));
            let (place, before) = (list.elements.len() as u32, list.pairs.len());
            let pairs = &mut list.pairs;
            // The tree holds the spheres with their radii.
            tree.near_face(&Slab::new([&a, &b, &c]), skin, |sphere, k| {
                let limit = sphere.radius + skin;
                if on_face(&sphere.centre, [&a, &b, &c]).to_point.norm_squared() <= limit * limit {
                    pairs.push(Pair { sphere: k, element: place });
                }
                skin
            });
            if list.pairs.len() > before {
                let nodes = ground.triangles[number as usize];
                list.elements.push(PairElement { kind: Kind::Face, nodes, radius: 0.0, number });
                list.numbers.extend(nodes);
                let [p, q, r] = ground.corners(number);
                let normal = (q - p).cross(&(r - p)).try_normalize(0.0).unwrap_or_default();
                self.planes.push((p, normal));
            }
        }
        list.pairs.sort_unstable();
        list.numbers.sort_unstable();
        list.numbers.dedup();
        for element in &mut list.elements {
            let place = |n: u32| list.numbers.partition_point(|m| *m < n) as u32;
            element.nodes = element.nodes.map(place);
        }
        list.nodes.clear();
        list.nodes.extend(0..list.numbers.len() as u32);
        self.nodes.hold(list.numbers.iter().map(|n| ground.nodes[*n as usize]));
    }
}

/// For how long [s], at most `most`, a flying rock is certain to touch nothing of the terrain; 0 where it
/// touches already. It follows from the arguments alone.
///
/// A triangle is convex: it lies behind the plane through its point that is closest to a sphere, and until
/// the sphere has reached that plane they cannot touch. Along the plane's normal the sphere's centre moves
/// with the rock and its spin, bent by gravity and by the turn. Triangles further than `far` [m] from the rock
/// are not looked at: no point of the rock goes that way sooner than its speed allows.
pub fn free_time(
    rock: &Rock,
    tree: &SphereTree,
    ground: &Ground,
    now: &Motion,
    gravity: &Vector3<f64>,
    far: f64,
    most: f64,
) -> f64 {
    let to_own = now.rotation().transpose();
    let [velocity, pull] = [now.velocity, *gravity].map(|v| to_own * v);
    let spin = (to_own * now.angular_momentum).component_div(&rock.inertia);
    let rate = now.angular_momentum.norm() / rock.inertia.min();
    // Largest acceleration of a point at the distance 1: the spin itself turns where the moments differ.
    let bend = rate * rate * (rock.inertia.max() / rock.inertia.min());
    let (speed, bow) = (velocity.norm() + rate * rock.arm, gravity.norm() + bend * rock.arm);
    let way = |time: f64| (speed + 0.5 * bow * time) * time;
    let mut least = arrival(far, speed, bow).min(most);
    let rounding = 1e-9 * tree.reach;
    let look = |number: u32, mut least: f64| {
        let [a, b, c] = ground.corners(number).map(|p| to_own * (p - now.position));
        let slab = Slab::new([&a, &b, &c]);
        tree.near_face(&slab, way(least), |sphere, _| {
            let to_point = on_face(&sphere.centre, [&a, &b, &c]).to_point;
            let distance = to_point.norm();
            let gap = distance - sphere.radius - rounding;
            if gap <= 0.0 {
                least = 0.0;
            } else if gap < way(least) {
                let normal = to_point / distance;
                let approach = (velocity + spin.cross(&sphere.centre)).dot(&normal);
                let bow = pull.dot(&normal).max(0.0) + bend * sphere.centre.norm();
                least = least.min(arrival(gap, approach, bow));
            }
            way(least)
        });
        least
    };
    // The nearest first: most others are then out of reach at a glance.
    let Some(nearest) = ground.nearest(&now.position, tree.reach + way(least).min(far)) else { return least };
    least = look(nearest, least);
    if least > 0.0 {
        ground.within(&now.position, tree.reach + way(least).min(far), |number| {
            if number != nearest && least > 0.0 {
                least = look(number, least);
            }
        });
    }
    least
}
