//! The terrain: triangles that never move, and a static tree over them.
//!
//! Everything here is in local coordinates, metres from a whole-numbered origin in the middle of the
//! terrain: survey coordinates of 2.6e6 m leave 5e-10 m to a double, local ones 1e-12 m. What a user
//! writes and reads has the origin added.
//!
//! - [`settings`]: the table `[terrain]`
//! - [`kept`]: a prepared surface in a file, for all tasks of a machine
//! - [`formats`]: from files to rasters, points, triangles
//! - [`raster`]: heights on a grid
//! - [`triangulation`]: from those to one surface, its holes refused or cut
//! - [`zones`]: which material lies where
//! - [`forest`]: where a rock in flight is slowed down
//! - [`queries`]: what is near, how high a point stands, for how long a flight is free
//! - [`ground`]: `dem-solver ground`, heights around a line for what is built there

pub mod forest;
pub mod formats;
pub mod ground;
pub mod kept;
pub mod queries;
pub use toolkit::raster;
pub mod settings;
pub mod system;
pub mod triangulation;
pub mod zones;

use dem_solid::geometry::box_tree::{Bounds, BoxTree, morton_order};
use dem_solid::geometry::shared_nodes::{Unshared, first_fault};
use dem_solid::geometry::{bounds, by_first_use, double_area, is_flat};
use dem_solid::row::Row;
use forest::Forest;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::TerrainSettings;
use std::collections::HashSet;
use std::path::PathBuf;
use toolkit::provenance::Running;
use toolkit::scene::Scene;
use triangulation::Triangulated;

/// The terrain. Triangles stand in the order of the tree; a triangle's number is its place there.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Terrain {
    /// What is added to local coordinates to give the user's [m].
    pub origin: Vector3<f64>,
    /// Corners, local [m].
    #[serde(skip)]
    pub nodes: Row<Vector3<f64>>,
    /// Corners of the triangles.
    #[serde(skip)]
    pub triangles: Row<[u32; 3]>,
    /// Zone of each triangle, as a place in [`Terrain::materials`]; empty where all are of the first.
    #[serde(skip)]
    pub zones: Vec<u8>,
    /// Materials by zone; the first is that of everything no zone names.
    #[serde(skip)]
    pub materials: Vec<String>,
    /// Forests by zone.
    #[serde(skip)]
    pub forests: Vec<Option<Forest>>,
    /// Lowest corner of the box around it, local [m].
    pub lowest: Vector3<f64>,
    /// Highest corner, local [m].
    pub highest: Vector3<f64>,
    /// What the user should know of it.
    pub notices: Vec<Diagnostic>,
    /// True if contacts are continuous over kinks.
    pub continuous: bool,
    /// True if it was made of a raster: all its triangles share the nodes at which they touch.
    regular: bool,
    /// Its hash, where it is known.
    content: String,
    #[serde(skip)]
    tree: BoxTree,
}

/// What the user should know of the terrain of a scene.
fn notice(what: String) -> Diagnostic {
    Diagnostic::warning(code::GEOMETRY, what).about("terrain")
}

impl Terrain {
    /// That of a scene: read, cut, joined with its zones.
    pub fn of(scene: &Scene, settings: &TerrainSettings) -> Result<Self, Diagnostic> {
        Self::with_kept(scene, settings, &[])
    }

    /// The same; a surface that was prepared before is looked for in these folders.
    pub fn with_kept(
        scene: &Scene,
        settings: &TerrainSettings,
        folders: &[PathBuf],
    ) -> Result<Self, Diagnostic> {
        let kept = kept::find(folders, scene, settings).map(Ok);
        let mut ground = kept.unwrap_or_else(|| triangulation::of(scene, settings).map(Self::new))?;
        settings.check_layers(scene)?;
        let zones = zones::Zones::of(scene, settings, &ground.origin)?;
        if ground.triangles.is_empty() {
            let file = scene.resolve(&settings.file);
            return Err(Diagnostic::in_file(file.display(), "the terrain has no triangle with an area"));
        }
        ground.materials = zones.materials.clone();
        ground.forests = zones.forests.clone();
        zones::check_polygons(scene, settings, ground.extent())?;
        if !zones.is_empty() {
            let middle =
                |t: &[u32; 3]| t.iter().map(|n| ground.nodes[*n as usize]).sum::<Vector3<f64>>() / 3.0;
            zones.check_use(scene, || ground.triangles.iter().map(middle))?;
            ground.zones = ground.triangles.iter().map(|t| zones.at(&middle(t))).collect();
        }
        Ok(ground)
    }

    /// Of one surface.
    pub fn new(relief: Triangulated) -> Self {
        let Triangulated { origin, mut nodes, mut triangles, mut notices, regular } = relief;
        let before = triangles.len();
        triangles.retain(|t| !is_flat(t.map(|n| nodes[n as usize]), THINNEST));
        if triangles.len() < before {
            let what = format!("{} triangles without area left out", before - triangles.len());
            notices.push(notice(what));
        }
        let corner = |t: usize, k: usize| nodes[triangles[t][k] as usize];
        let order = morton_order(triangles.len(), |t| (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0);
        triangles = order.into_iter().map(|t| triangles[t as usize]).collect();
        by_first_use(&mut nodes, &mut triangles);
        let tree = BoxTree::new(triangles.len(), |t| {
            let [low, high] = bounds(triangles[t].map(|n| nodes[n as usize]));
            Bounds::around(&low, &high)
        });
        // All nodes are of some triangle now.
        let [lowest, highest] = bounds(nodes.iter().copied());
        Self {
            origin,
            nodes: Row::own(nodes),
            triangles: Row::own(triangles),
            materials: vec![String::new()],
            forests: vec![None],
            lowest,
            highest,
            notices,
            regular,
            tree,
            ..Self::default()
        }
    }

    /// A hash of the surface.
    pub fn content(&self) -> String {
        if !self.content.is_empty() {
            return self.content.clone();
        }
        let mut hash = Running::default();
        self.origin.iter().for_each(|n| hash.add(&n.to_le_bytes()));
        hash.add(self.nodes.bytes());
        hash.add(self.triangles.bytes());
        hash.text()
    }

    /// Lowest and highest corner of the box around it, in the user's coordinates [m].
    pub fn extent(&self) -> [Vector3<f64>; 2] {
        [self.lowest + self.origin, self.highest + self.origin]
    }

    /// The first place at which two triangles touch without a common node.
    pub fn unshared(&self) -> Option<Unshared> {
        if self.regular { None } else { first_fault(&self.nodes, Vec::new(), &self.triangles) }
    }

    /// Corners of a triangle, local [m].
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vector3<f64>; 3] {
        self.triangles[triangle as usize].map(|n| self.nodes[n as usize])
    }

    /// Zone of a triangle, as a place in [`Terrain::materials`].
    #[inline]
    pub fn zone(&self, triangle: u32) -> u8 {
        self.zones.get(triangle as usize).copied().unwrap_or(0)
    }

    /// True if both triangles hold a node; numbers beyond the triangles, which are edges and corners, do not.
    pub fn share_a_node(&self, a: u32, b: u32) -> bool {
        let of = |key: u32| self.triangles.get(key as usize);
        of(a).zip(of(b)).is_some_and(|(a, b)| a.iter().any(|n| b.contains(n)))
    }

    /// Order the corners of all triangles so that their normals point out of the ground. A mesh of one winding keeps what
    /// hangs over; of one that does not agree with itself each triangle faces up. What the user should know.
    pub fn face_up(&mut self) -> Option<Diagnostic> {
        let rise = |t: &[u32; 3]| double_area(t.map(|n| self.nodes[n as usize])).z;
        // Those of a raster face up.
        let looked_at = if self.regular { &[][..] } else { &self.triangles };
        let down = looked_at.iter().filter(|t| rise(t) < 0.0).count();
        if down == 0 {
            return None;
        }
        let (all, whole) = (self.triangles.len(), self.triangles.iter().map(rise).sum::<f64>());
        let mixed = down < all && !self.is_of_one_winding();
        let turn = |t: &[u32; 3]| if !mixed || rise(t) < 0.0 { [t[0], t[2], t[1]] } else { *t };
        if mixed || whole < 0.0 {
            self.triangles = Row::own(self.triangles.iter().map(turn).collect());
        }
        let what =
            format!("the corners of its triangles run round in both directions ({down} of {all} face down)");
        mixed.then(|| notice(what).try_instead("each was taken to face up, so that nothing hangs over"))
    }

    /// True if no two triangles run along an edge in the same direction.
    fn is_of_one_winding(&self) -> bool {
        let mut seen = HashSet::with_capacity(3 * self.triangles.len());
        self.triangles
            .iter()
            .all(|[a, b, c]| [(a, b), (b, c), (c, a)].into_iter().all(|edge| seen.insert(edge)))
    }

    /// In words, with numbers.
    pub fn describe(&self) -> String {
        let size = [0, 1, 2].map(|k| format!("{:.1} m", (self.highest - self.lowest)[k])).join(" x ");
        let [from, to] = self.extent();
        let place =
            [(0, "x"), (1, "y"), (2, "z")].map(|(k, axis)| format!("{axis} {:.1} to {:.1}", from[k], to[k]));
        let [triangles, nodes] = [self.triangles.len(), self.nodes.len()];
        format!("terrain of {triangles} triangles and {nodes} nodes, {size}, {}", place.join(", "))
    }
}

/// Height of a triangle over its longest edge, in such edges, up to which it counts as without area. The normal of a
/// thinner one is a matter of rounding (nodes of 1e3 m, rounded to 1e-13 m, tilt it by 1e-6 rad and more), and the
/// edges that its neighbours leave are so close that a sphere touches them as one.
const THINNEST: f64 = 1e-7;

#[cfg(test)]
mod tests {
    use super::*;

    /// A step with an overhang: floor, mesh that leans out over it, top.
    fn overhang(turned: &[usize]) -> Terrain {
        let profile = [[-2.0, 0.0], [0.0, 0.0], [-0.5, 1.0], [2.0, 1.2]];
        let nodes =
            [0.0, 1.0].into_iter().flat_map(|y| profile.map(|[x, z]| Vector3::new(x, y, z))).collect();
        let mut triangles: Vec<[u32; 3]> =
            (0..3).flat_map(|i| [[i, i + 1, i + 5], [i, i + 5, i + 4]]).collect();
        turned.iter().for_each(|t| triangles[*t].swap(1, 2));
        Terrain::new(Triangulated {
            origin: Vector3::zeros(),
            nodes,
            triangles,
            notices: Vec::new(),
            regular: false,
        })
    }

    fn down(ground: &Terrain) -> usize {
        let rise = |t: &&[u32; 3]| {
            let [a, b, c] = t.map(|n| ground.nodes[n as usize]);
            (b - a).cross(&(c - a)).z < 0.0
        };
        ground.triangles.iter().filter(rise).count()
    }

    #[test]
    fn of_one_winding_what_hangs_over_stays_and_the_whole_is_turned_up() {
        let mut up = overhang(&[]);
        assert_eq!((down(&up), up.face_up(), down(&up)), (2, None, 2));
        let mut upside_down = overhang(&[0, 1, 2, 3, 4, 5]);
        assert_eq!((down(&upside_down), upside_down.face_up(), down(&upside_down)), (4, None, 2));
    }

    #[test]
    fn of_both_windings_each_triangle_faces_up_and_that_is_reported() {
        let mut mixed = overhang(&[0]);
        let notice = mixed.face_up().expect("a notice");
        assert!(notice.message.contains("3 of 6"), "{notice}");
        assert_eq!(down(&mixed), 0);
    }
}
