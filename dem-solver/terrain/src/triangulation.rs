//! From what a file holds (a raster of heights, points, triangles) to one surface with a local origin.

use super::formats::{self, Content};
use super::notice;
use super::raster::Raster;
use super::settings::{NoData, TerrainSettings};
use dem_solid::geometry::bounds;
use dem_solid::input::ReadError;
use dem_solid::random::SplitMix;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use spade::{
    DelaunayTriangulation, HasPosition, HierarchyHintGenerator, InsertionError, Point2, Triangulation,
};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use toolkit::scene::Scene;

/// One surface of triangles in local coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Triangulated {
    /// What is added to local coordinates to give the file's [m]; whole numbers.
    pub origin: Vector3<f64>,
    /// Corners, local [m].
    pub nodes: Vec<Vector3<f64>>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
    /// What the user should know of it.
    pub notices: Vec<Diagnostic>,
    /// True if its triangles share the nodes at which they touch, since they are cells of a raster.
    pub regular: bool,
}

/// Read the terrain of a scene.
pub fn of(scene: &Scene, settings: &TerrainSettings) -> Result<Triangulated, Diagnostic> {
    if settings.file.as_os_str().is_empty() {
        return scene.refuse("terrain.file", "the path is empty", "name a file, as in file = \"valley.asc\"");
    }
    let path = scene.resolve(&settings.file);
    let relief = match formats::terrain(&path, &settings.classes, settings.nodata_value)? {
        Content::Raster(raster) => from_raster(&raster, settings.nodata),
        Content::Points(points) => from_points(&points, settings.longest_edge),
        Content::Triangles { nodes, triangles, notices } => {
            let (origin, nodes) = localise(nodes);
            Ok(Triangulated { origin, nodes, triangles, notices, regular: false })
        }
    };
    relief.map_err(|e| e.in_file(&path))
}

/// A whole-numbered point in the middle, and the nodes from there.
fn localise(mut nodes: Vec<Vector3<f64>>) -> (Vector3<f64>, Vec<Vector3<f64>>) {
    let [lowest, highest] = bounds(nodes.iter().copied());
    let origin = middle(lowest, highest);
    nodes.iter_mut().for_each(|node| *node -= origin);
    (origin, nodes)
}

/// Rounded down, so that a terrain moved by whole metres has its origin moved by as much.
fn middle(lowest: Vector3<f64>, highest: Vector3<f64>) -> Vector3<f64> {
    let middle = (lowest * 0.5 + highest * 0.5).map(f64::floor);
    if middle.sum().is_finite() { middle } else { Vector3::zeros() }
}

/// Two triangles in each cell, cut along the diagonal whose ends are nearer in height: ridges and
/// gullies stay sharp.
pub fn from_raster(raster: &Raster, nodata: NoData) -> Result<Triangulated, ReadError> {
    let [columns, rows] = raster.counts;
    let missing = raster.heights.iter().filter(|z| z.is_nan()).count();
    let mut notices = Vec::new();
    if missing > 0 {
        if nodata == NoData::Refuse {
            let first = raster.heights.iter().position(|z| z.is_nan()).unwrap_or(0);
            let (all, row, column) = (raster.heights.len(), first / columns + 1, first % columns + 1);
            let what = format!(
                "{missing} of {all} cells have no height, the first in row {row} from the north and column {column}"
            );
            let cure = "fill them, or write nodata = \"cut\" under [terrain]: rocks fall through such holes";
            return Err(ReadError::new(what).try_instead(cure));
        }
        notices.push(notice(format!("{missing} cells without height are cut out")));
    }
    let known = || raster.heights.iter().copied().filter(|z| !z.is_nan());
    let [x0, y0] = raster.corner;
    let [dx, dy] = raster.spacing;
    let far = Vector3::new(
        x0 + dx * (columns - 1) as f64,
        y0 + dy * (rows - 1) as f64,
        known().fold(f64::NEG_INFINITY, f64::max),
    );
    let origin = middle(Vector3::new(x0, y0, known().fold(f64::INFINITY, f64::min)), far);
    // Cells of a survey are subtracted before they are multiplied: nothing of 2.6e6 m is left to round.
    let (x0, y0) = (x0 - origin.x, y0 - origin.y);
    let mut place = vec![u32::MAX; raster.heights.len()];
    let mut nodes = Vec::with_capacity(raster.heights.len() - missing);
    for (at, z) in raster.heights.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
        let (row, column) = (at / columns, at % columns);
        place[at] = nodes.len() as u32;
        nodes.push(Vector3::new(x0 + dx * column as f64, y0 + dy * (rows - 1 - row) as f64, z - origin.z));
    }
    let mut triangles = Vec::with_capacity(2 * columns.saturating_sub(1) * rows.saturating_sub(1));
    for row in 1..rows {
        for column in 1..columns {
            let at = row * columns + column;
            // West and east of the row above, west and east of this one.
            let four = [at - columns - 1, at - columns, at - 1, at];
            let [nw, ne, sw, se] = four.map(|i| place[i]);
            let height = four.map(|i| raster.heights[i]);
            let all = [nw, ne, sw, se];
            match all.iter().filter(|n| **n == u32::MAX).count() {
                0 if (height[0] - height[3]).abs() <= (height[1] - height[2]).abs() => {
                    triangles.extend([[sw, se, nw], [nw, se, ne]]);
                }
                0 => triangles.extend([[sw, se, ne], [sw, ne, nw]]),
                1 => {
                    // Counter-clockwise from south-west, the missing one left out.
                    let mut round = [sw, se, ne, nw].into_iter().filter(|n| *n != u32::MAX);
                    if let (Some(a), Some(b), Some(c)) = (round.next(), round.next(), round.next()) {
                        triangles.push([a, b, c]);
                    }
                }
                _ => {}
            }
        }
    }
    Ok(Triangulated { origin, nodes, triangles, notices, regular: true })
}

/// Delaunay triangles over x and y, those with an edge above `longest` [m] left out. Of points that stand over each other the highest is kept.
pub fn from_points(points: &[[f64; 3]], longest: Option<f64>) -> Result<Triangulated, ReadError> {
    let (origin, mut nodes) = localise(points.iter().map(|p| Vector3::from(*p)).collect());
    let before = nodes.len();
    // Spade refuses coordinates between 0 and 1e-42.
    let tiny = |v: f64| if v.abs() < 1e-30 { 0.0 } else { v };
    nodes.iter_mut().for_each(|n| (n.x, n.y) = (tiny(n.x), tiny(n.y)));
    nodes.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(b.z.total_cmp(&a.z)));
    nodes.dedup_by(|next, kept| next.x == kept.x && next.y == kept.y);
    let mut notices = Vec::new();
    if nodes.len() < before {
        let what = format!("{} points lie above or below another one", before - nodes.len());
        notices.push(notice(what).try_instead("the highest is kept"));
    }
    if is_line(&nodes) {
        return Err(no_surface(nodes.len()));
    }
    let joined = swept(&nodes, LOOKS * nodes.len().max(10_000)).unwrap_or_else(|| shuffled(&nodes));
    let mut triangles = joined.map_err(|e| format!("the points cannot be joined to triangles: {e}"))?;
    if let Some(longest) = longest {
        let edge = |a: u32, b: u32| (nodes[a as usize] - nodes[b as usize]).xy().norm();
        triangles.retain(|&[a, b, c]| edge(a, b).max(edge(b, c)).max(edge(c, a)) <= longest);
    }
    if triangles.is_empty() {
        return Err(no_surface(nodes.len()));
    }
    Ok(Triangulated { origin, nodes, triangles, notices, regular: false })
}

/// Looks at a place, by point, after which a sweep is given up. It takes 60 to 90 where points are spread over an area; where they
/// stand on lines it may take as many as there are points.
const LOOKS: usize = 200;

/// A place whose looks are counted down; a look too many unwinds.
struct Counted<'a> {
    place: Point2<f64>,
    left: &'a Cell<usize>,
}

impl HasPosition for Counted<'_> {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        let left =
            self.left.get().checked_sub(1).unwrap_or_else(|| resume_unwind(Box::new("too many looks")));
        self.left.set(left);
        self.place
    }
}

fn place(node: &Vector3<f64>) -> Point2<f64> {
    Point2::new(node.x, node.y)
}

/// Delaunay triangles by a sweep from the middle outwards; `None` if that takes more than `most` looks at a place.
fn swept(nodes: &[Vector3<f64>], most: usize) -> Option<Result<Vec<[u32; 3]>, InsertionError>> {
    let left = Cell::new(most);
    let places = nodes.iter().map(|n| Counted { place: place(n), left: &left }).collect();
    // What unwinds is lost with all that it held.
    catch_unwind(AssertUnwindSafe(|| {
        let mesh = DelaunayTriangulation::<Counted>::bulk_load_stable(places)?;
        Ok(mesh.inner_faces().map(|face| face.vertices().map(|v| v.index() as u32)).collect())
    }))
    .ok()
}

/// Delaunay triangles by inserting points in random order after three that span a large triangle. The expected number of flips
/// grows with that of the points wherever they stand, but it is slower than a sweep over an ordinary cloud.
///
/// Source: Guibas, Knuth, Sharir (1992), Randomized incremental construction of Delaunay and Voronoi diagrams, Algorithmica 7.
fn shuffled(nodes: &[Vector3<f64>]) -> Result<Vec<[u32; 3]>, InsertionError> {
    let from_first = |k: &usize| (nodes[*k] - nodes[0]).xy();
    let furthest = |measure: &dyn Fn(&usize) -> f64| {
        (0..nodes.len()).max_by(|a, b| measure(a).total_cmp(&measure(b))).unwrap_or(0)
    };
    let far = furthest(&|k| from_first(k).norm_squared());
    let beside = furthest(&|k| from_first(&far).perp(&from_first(k)).abs());
    let start = [0, far, beside];
    let mut rest: Vec<usize> = (0..nodes.len()).filter(|k| !start.contains(k)).collect();
    let mut chance = SplitMix(nodes.len() as u64);
    rest.sort_by_cached_key(|_| chance.bits());
    let order: Vec<usize> = start.into_iter().chain(rest).collect();
    let mut mesh = DelaunayTriangulation::<_, (), (), (), HierarchyHintGenerator<f64>>::new();
    for k in &order {
        mesh.insert(place(&nodes[*k]))?;
    }
    Ok(mesh.inner_faces().map(|face| face.vertices().map(|v| order[v.index()] as u32)).collect())
}

fn no_surface(count: usize) -> ReadError {
    format!("{count} points that span no surface: three that are not in line are needed").into()
}

/// Width of points over their length below which they are in line but for rounding. Joining such points takes a time that
/// grows with the square of their number.
const NARROW: f64 = 1e-9;

/// True if points are in line, seen from above.
fn is_line(points: &[Vector3<f64>]) -> bool {
    let Some(first) = points.first() else { return true };
    let from = |p: &Vector3<f64>| (p - first).xy();
    let far = points.iter().map(from).max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    let along = far.unwrap_or_default();
    points.iter().all(|p| along.perp(&from(p)).abs() <= NARROW * along.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_line_are_refused_at_once() {
        for [dx, dy] in [[1.0, 0.0], [0.0, 1.0], [0.5, 0.25], [0.1, 0.3]] {
            let line: Vec<[f64; 3]> =
                (0..200_000).map(f64::from).map(|k| [2.6e6 + dx * k, 1.2e6 + dy * k, k]).collect();
            let refused = from_points(&line, None).expect_err("no surface");
            assert!(refused.message.contains("span no surface"), "{refused:?}");
        }
        assert!(from_points(&[[0.0, 0.0, 1.0]; 5], None).is_err());
        let wide = [[0.0, 0.0, 1.0], [1.0, 1.0, 1.0], [2.0, 2.0, 1.0], [0.0, 1e-3, 2.0]];
        assert_eq!(from_points(&wide, None).map(|t| t.triangles.len()), Ok(2));
    }

    /// Points of a line with one far beside it, and of a square of them with a cross around: a sweep looks at each point
    /// thousands of times.
    #[test]
    fn points_on_lines_are_joined_without_a_sweep() {
        let line = (0..5000).map(|k| Vector3::new(f64::from(k), 0.0, 0.0));
        let beside: Vec<_> = line.chain([Vector3::new(10_000.0, 5000.0, 1.0)]).collect();
        let arm = (0..600).map(|k| 1.1 + 0.015 * f64::from(k));
        let arms = arm.flat_map(|r| [[r, 0.0], [-r, 0.0], [0.0, r], [0.0, -r]]);
        let square = (0..50 * 50).map(|k| [0.04 * f64::from(k % 50) - 1.0, 0.04 * f64::from(k / 50) - 1.0]);
        let cross: Vec<_> = arms.chain(square).map(|[x, y]| Vector3::new(x, y, 0.0)).collect();
        for (nodes, least) in [(beside, 4999), (cross, 9000)] {
            assert!(swept(&nodes, LOOKS * nodes.len()).is_none(), "a sweep takes too many looks");
            let triangles = shuffled(&nodes).expect("triangles");
            assert!(triangles.len() >= least, "{} triangles", triangles.len());
        }
    }

    #[test]
    fn both_ways_make_the_same_triangles_of_an_ordinary_cloud() {
        let mut chance = SplitMix(5);
        let nodes: Vec<_> = (0..3000).map(|_| Vector3::new(chance.share(), chance.share(), 0.0)).collect();
        let sorted = |triangles: Vec<[u32; 3]>| {
            let mut triangles: Vec<_> = triangles
                .into_iter()
                .map(|mut t| {
                    let least = (0..3).min_by_key(|k| t[*k]).unwrap_or(0);
                    t.rotate_left(least);
                    t
                })
                .collect();
            triangles.sort_unstable();
            triangles
        };
        let swept = swept(&nodes, LOOKS * nodes.len()).expect("an ordinary cloud").expect("triangles");
        assert_eq!(sorted(swept), sorted(shuffled(&nodes).expect("triangles")));
    }
}
