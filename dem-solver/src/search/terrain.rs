//! Which spheres of a rock may touch which triangles of the terrain, and how far the rock is from it.
//!
//! Triangles around the rock are kept until it has moved by a margin, pairs until it has moved or turned
//! by a smaller skin. Nothing of the terrain moves, and nothing here grows with its size.

use super::pairs::{Pair, PairElement, PairList};
use super::tree::{Slab, SphereTree};
use crate::ground::Ground;
use crate::rock::{Motion, Rock};
use crate::wall::Kind;
use crate::wall::closest::on_face;
use crate::wall::motion::NodeMotion;
use nalgebra::{UnitQuaternion, Vector3};

/// Distance between surfaces up to which pairs are listed, as a share of the smallest radius.
const SKIN: f64 = 0.3;

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
    searched: Option<(Vector3<f64>, UnitQuaternion<f64>)>,
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
        it
    }

    /// Make sure that every pair that touches at `now` is listed.
    pub fn update(&mut self, rock: &Rock, tree: &SphereTree, ground: &Ground, now: &Motion) {
        let skin = SKIN * rock.smallest_radius;
        if let Some((position, orientation)) = &self.searched {
            let turn = orientation.inverse() * now.orientation;
            // A point at distance r moves by 2 r sin(angle / 2).
            if (now.position - position).norm() + 2.0 * turn.imag().norm() * rock.arm <= skin {
                return;
            }
        }
        let need = rock.reach + skin;
        if (now.position - self.near_at).norm() + need > self.coverage {
            self.refreshes += 1;
            (self.near_at, self.coverage) = (now.position, need + MARGIN * rock.reach);
            let near = &mut self.near;
            near.clear();
            ground.within(&now.position, self.coverage, |t| near.push(t));
        }
        self.search(tree, ground, now, skin);
    }

    fn search(&mut self, tree: &SphereTree, ground: &Ground, now: &Motion, skin: f64) {
        self.searched = Some((now.position, now.orientation));
        let list = &mut self.pairs;
        list.searches += 1;
        list.pairs.clear();
        list.elements.clear();
        list.numbers.clear();
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

/// Distance between the rock's spheres and the terrain [m], at most `limit`; 0 where they touch. It
/// follows from the arguments alone.
pub fn gap(rock: &Rock, tree: &SphereTree, ground: &Ground, now: &Motion, limit: f64) -> f64 {
    let to_own = now.rotation().transpose();
    let mut least = limit;
    ground.within(&now.position, rock.reach + limit, |number| {
        let [a, b, c] = ground.corners(number).map(|p| to_own * (p - now.position));
        let slab = Slab::new([&a, &b, &c]);
        tree.near_face(&slab, least, |sphere, _| {
            let apart = on_face(&sphere.centre, [&a, &b, &c]).to_point.norm() - sphere.radius;
            least = least.min(apart);
            least
        });
    });
    least.max(0.0)
}
