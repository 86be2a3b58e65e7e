//! Which spheres of a rock may touch which triangles of the terrain, and how far the rock is from it.
//!
//! Triangles around the rock are kept until it has moved by a margin, pairs until it has moved or turned
//! by a smaller skin. A pair knows how far apart it was when it was listed: until the rock has come that far it is not
//! looked at. Nothing of the terrain moves, and nothing here grows with its size.

use crate::contact::broad_phase::time_of_impact::Course;
use crate::rock::{Motion, Rock};
use dem_solid::geometry::sphere_tree::{Slab, SphereTree};
use dem_solid::geometry::triangle::{Face, Nearest};
use dem_terrain::Terrain;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// How much further than asked for pairs are listed: what the rock moves in [`STRIDES`] steps, at least and at most
/// these shares of the smallest radius, or (so that small spheres are not searched for all the time) the last one of
/// the rock's reach. Wider: fewer searches, more pairs that do not touch, which are cheap.
const SKIN: [f64; 3] = [0.05, 0.2, 0.05];
const STRIDES: f64 = 100.0;

/// Share by which spheres around triangles are taken larger, for rounding.
const ROUNDING: f64 = 1e-9;

/// Margin of the triangles that are kept, as a share of the rock's reach: at 10 m/s a look into the
/// terrain's tree each 20 ms for a rock of 0.8 m.
const MARGIN: f64 = 0.5;

/// A sphere and a triangle that may touch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TerrainPair {
    /// Number of the sphere in its rock.
    pub sphere: u32,
    /// Number of the triangle in the terrain.
    pub triangle: u32,
    /// Place of the triangle in [`TerrainPairs::faces`].
    pub face: u32,
    /// Distance of their surfaces when the pairs were searched, below 0 where they overlapped [m].
    pub gap: f64,
    /// Distance of the sphere's centre then [m].
    pub distance: f64,
}

/// The pairs of one sphere.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairsOfSphere {
    /// Number of the sphere in its rock.
    pub sphere: u32,
    /// Its first pair and the one after its last.
    ends: [u32; 2],
    /// Least gap, and least distance of the centre, of all of them [m].
    pub gap: f64,
    /// See `gap`.
    pub distance: f64,
}

/// The surroundings of one rock on the terrain. Nothing here is state.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct TerrainPairs {
    /// Triangles near the rock, ascending.
    near: Vec<u32>,
    /// The same as faces.
    pub faces: Vec<Face>,
    /// A sphere around each: centre and radius [m].
    round: Vec<(Vector3<f64>, f64)>,
    /// The place of one of them that was lately touched first.
    first: usize,
    near_at: Vector3<f64>,
    coverage: f64,
    /// Pairs that may touch, by sphere, then triangle.
    pub pairs: Vec<TerrainPair>,
    /// The same, sphere by sphere; of a rock that touches as a whole.
    pub spheres: Vec<PairsOfSphere>,
    searched: Option<(Vector3<f64>, UnitQuaternion<f64>)>,
    skin: f64,
    /// How deep inside the terrain a centre is looked for [m]; 0: only what touches from outside is listed.
    deep: f64,
    /// Depth of the deepest centre when the pairs were searched [m].
    deepest: f64,
    /// How far no point of the rock has moved further since the pairs were searched [m].
    pub moved: f64,
    /// Times that pairs were searched.
    pub searches: u64,
    /// Times that triangles were looked for.
    pub refreshes: u64,
}

impl TerrainPairs {
    /// Of `rock`, with room for what it usually touches; centres up to `deep` [m] inside are listed with the surface above.
    pub fn new(rock: &Rock, deep: f64) -> Self {
        let mut it = Self { coverage: f64::NEG_INFINITY, deep, deepest: deep, ..Self::default() };
        it.near.reserve(1024);
        it.faces.reserve(1024);
        it.round.reserve(1024);
        it.pairs.reserve(4 * rock.spheres.len() + 1024);
        it
    }

    /// Make sure that every pair that is nearer than `reach` [m] at `now` is listed, which is every one that
    /// touches where it is 0; the steps under way are `h` [s] long.
    pub fn update(
        &mut self,
        rock: &Rock,
        tree: &SphereTree,
        ground: &Terrain,
        now: &Motion,
        h: f64,
        reach: f64,
    ) {
        if let Some((position, orientation)) = &self.searched {
            self.moved = (now.position - position).norm();
            // The turn of a single sphere moves nothing.
            if rock.arm > 0.0 {
                self.moved += rock.rotation_since(orientation, now);
            }
            if self.moved + reach <= self.skin {
                return;
            }
        }
        let speed = now.velocity.norm() + now.angular_momentum.norm() / rock.inertia.min() * rock.arm;
        // Where centres may pass the surface the smallest sphere decides nothing.
        let size = if self.deep > 0.0 { SKIN[2] * tree.reach } else { rock.smallest_radius };
        let least = SKIN[0] * size;
        let most = (SKIN[1] * size).max(SKIN[2] * tree.reach);
        let skin = reach + (STRIDES * speed * h).clamp(least, most);
        // No centre has come deeper by more than the rock has moved, nor will before the next search by more than the skin.
        let since = if self.searched.is_some() { self.moved } else { f64::INFINITY };
        self.look_around(tree, ground, now, skin.max(self.deep));
        self.search(rock, tree, now, skin, self.deep.min(self.deepest + since + skin));
    }

    /// Make sure that every triangle that is nearer than `further` [m] to the rock's reach is kept.
    fn look_around(&mut self, tree: &SphereTree, ground: &Terrain, now: &Motion, further: f64) {
        let need = tree.reach + further;
        if (now.position - self.near_at).norm() + need <= self.coverage {
            return;
        }

        self.refreshes += 1;
        (self.near_at, self.coverage) = (now.position, need + MARGIN * tree.reach);
        // The pairs name places among the old ones.
        self.searched = None;
        let (near, faces, round) = (&mut self.near, &mut self.faces, &mut self.round);
        let coverage = self.coverage;
        self.first = 0;
        near.clear();
        faces.clear();
        round.clear();
        ground.about(&now.position, coverage, |t| {
            let corners = ground.corners(t);
            let [a, b, c] = &corners;
            let middle = (a + b + c) * (1.0 / 3.0);
            let square = (a - middle).norm_squared().max((b - middle).norm_squared());
            let radius = square.max((c - middle).norm_squared()).sqrt() * (1.0 + ROUNDING);
            let limit = coverage + radius;
            if (middle - now.position).norm_squared() <= limit * limit {
                near.push(t);
                faces.push(Face::new(corners));
                round.push((middle, radius));
            }
        });
    }

    /// For how long [s], at most `most`, a flying rock is certain to touch nothing of the terrain, 0 where it
    /// touches already; and whether that is so because it then may have come `far` [m], further than which nothing
    /// was looked at. It follows from the arguments alone, not from what happens to be kept.
    pub fn free_time(
        &mut self,
        rock: &Rock,
        tree: &SphereTree,
        ground: &Terrain,
        (now, gravity): (&Motion, &Vector3<f64>),
        [far, most]: [f64; 2],
    ) -> (f64, bool) {
        self.look_around(tree, ground, now, far);
        let course = Course::new(rock, tree, now, gravity);
        let end = course.after(far);
        let mut least = end.min(most);
        // Once one that is near has been asked most others are out of reach at a glance.
        let first = self.first;
        if let Some(face) = self.faces.get(first) {
            least = course.meets(tree, face, far, least);
        }
        let mut reach = tree.reach + course.distance(least).min(far);
        for (place, (middle, radius)) in self.round.iter().enumerate() {
            let limit = reach + radius;
            if (middle - now.position).norm_squared() > limit * limit || place == first {
                continue;
            }
            let sooner = course.meets(tree, &self.faces[place], far, least);
            if sooner < least {
                (least, self.first) = (sooner, place);
                reach = tree.reach + course.distance(least).min(far);
            }
        }
        (least, least == end)
    }

    /// True if a node of the terrain, one within what is kept, lies on a border: its triangles do not go all around it.
    pub fn is_on_border(&self, ground: &Terrain, node: u32) -> bool {
        let (mut triangles, mut others) = (0, 0);
        let of_node = |t: &&u32| ground.triangles[**t as usize].contains(&node);
        for t in self.near.iter().filter(of_node) {
            triangles += 1;
            for other in ground.triangles[*t as usize].into_iter().filter(|n| *n != node) {
                // Counted where it is named first.
                let before = self.near.iter().take_while(|b| *b != t).filter(of_node);
                others +=
                    usize::from(!before.into_iter().any(|b| ground.triangles[*b as usize].contains(&other)));
            }
        }
        others != triangles
    }

    /// The pairs of a sphere.
    pub fn pairs_of(&self, sphere: &PairsOfSphere) -> &[TerrainPair] {
        &self.pairs[sphere.ends[0] as usize..sphere.ends[1] as usize]
    }

    fn search(&mut self, rock: &Rock, tree: &SphereTree, now: &Motion, skin: f64, deep: f64) {
        self.searched = Some((now.position, now.orientation));
        (self.skin, self.moved) = (skin, 0.0);

        self.searches += 1;
        self.pairs.clear();
        let single = tree.single();
        let to_own = now.rotation().transpose();
        let pairs = &mut self.pairs;
        let reach = tree.reach + skin.max(deep);
        for (place, (middle, radius)) in self.round.iter().enumerate() {
            let limit = reach + radius;
            if (middle - now.position).norm_squared() > limit * limit {
                continue;
            }
            let (face, it, triangle) = (place as u32, &self.faces[place], self.near[place]);
            match single {
                Some(radius) => {
                    if it.off_plane(&now.position) <= radius + skin {
                        let distance = it.closest(&now.position).0.norm();
                        let gap = distance - radius;
                        if gap <= skin {
                            pairs.push(TerrainPair { sphere: 0, triangle, face, gap, distance });
                        }
                    }
                }
                None => {
                    let seen = it.seen(&to_own, &now.position);
                    // The tree holds the spheres with their radii.
                    tree.near_face(&Slab::new(&seen), skin, deep, |sphere, k| {
                        let (over, far) = (seen.over_plane(&sphere.centre), sphere.radius + skin);
                        // The plane is no further away than the triangle.
                        if over > far || over < -far.max(deep) {
                            return;
                        }
                        let distance = seen.closest(&sphere.centre).0.norm();
                        let gap = distance - sphere.radius;
                        if gap <= skin || (distance <= deep && over <= 0.0) {
                            pairs.push(TerrainPair { sphere: k, triangle, face, gap, distance });
                        }
                    });
                }
            }
        }
        self.pairs.sort_unstable_by_key(|p| (p.sphere, p.face));
        if deep > 0.0 {
            self.keep_what_is_inside(rock, now, skin);
        }
    }

    /// Of the pairs that are listed since the centre lies behind the triangle's plane, keep those of spheres that are inside:
    /// the nearest of all triangles says so.
    fn keep_what_is_inside(&mut self, rock: &Rock, now: &Motion, skin: f64) {
        let rotation = now.rotation();
        let mut pairs = std::mem::take(&mut self.pairs);
        let mut kept = 0;
        let mut first = 0;
        self.deepest = 0.0;
        self.spheres.clear();
        while first < pairs.len() {
            let number = pairs[first].sphere;
            let end = first + pairs[first..].iter().take_while(|p| p.sphere == number).count();
            let sphere = &rock.spheres[number as usize];
            let place = now.position + rotation * sphere.centre;
            let behind = |p: &TerrainPair| self.faces[p.face as usize].over_plane(&place) <= 0.0;
            let depth = if pairs[first..end].iter().any(behind) { self.depth(&place) } else { None };
            let inside = depth.is_some();
            self.deepest = self.deepest.max(depth.unwrap_or_default());
            let begin = kept;
            for at in first..end {
                let pair = pairs[at];
                // Inside, the sphere touches whatever it moves.
                if inside || pair.gap <= skin {
                    pairs[kept] =
                        TerrainPair { gap: if inside { f64::NEG_INFINITY } else { pair.gap }, ..pair };
                    kept += 1;
                }
            }
            if kept > begin {
                let least = |of: fn(&TerrainPair) -> f64| {
                    pairs[begin..kept].iter().map(of).fold(f64::INFINITY, f64::min)
                };
                let (gap, distance) = (least(|p| p.gap), least(|p| p.distance));
                self.spheres.push(PairsOfSphere {
                    sphere: number,
                    ends: [begin as u32, kept as u32],
                    gap,
                    distance,
                });
            }
            first = end;
        }
        pairs.truncate(kept);
        self.pairs = pairs;
    }

    /// How far a point lies behind the nearest of the kept triangles [m]; `None` before it.
    fn depth(&self, place: &Vector3<f64>) -> Option<f64> {
        let mut nearest = Nearest::default();
        for (face, (middle, radius)) in self.faces.iter().zip(&self.round) {
            let limit = nearest.square.sqrt() * (1.0 + ROUNDING) + radius;
            if (middle - place).norm_squared() <= limit * limit {
                nearest.take(face, place);
            }
        }
        nearest.is_inside().then(|| nearest.square.sqrt())
    }
}
