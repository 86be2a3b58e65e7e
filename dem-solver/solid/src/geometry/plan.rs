//! Lines and areas seen from above: length, area, places in them, sides that cross.

use interface_defs::diagnostic::Diagnostic;
use robust::{Coord, orient2d};
use toolkit::scene::Scene;

/// A point seen from above [m].
pub type Point = [f64; 2];

/// Length of a polyline [m].
pub fn length(line: &[Point]) -> f64 {
    line.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum()
}

fn distance(a: &Point, b: &Point) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Distance of a point from a polyline [m].
pub fn distance_from(line: &[Point], at: &Point) -> f64 {
    let from = |pair: &[Point]| {
        let way = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let off = [at[0] - pair[0][0], at[1] - pair[0][1]];
        let square = way[0] * way[0] + way[1] * way[1];
        let share = if square > 0.0 { (off[0] * way[0] + off[1] * way[1]) / square } else { 0.0 };
        let share = share.clamp(0.0, 1.0);
        (off[0] - share * way[0]).hypot(off[1] - share * way[1])
    };
    line.windows(2).map(from).fold(f64::INFINITY, f64::min)
}

/// The place at a share (0 to 1) of a polyline's length.
pub fn along(line: &[Point], share: f64) -> Point {
    let mut left = share * length(line);
    for pair in line.windows(2) {
        let step = distance(&pair[0], &pair[1]);
        if left <= step && step > 0.0 {
            let s = left / step;
            return [0, 1].map(|k| pair[0][k] + s * (pair[1][k] - pair[0][k]));
        }
        left -= step;
    }
    line[line.len() - 1]
}

/// Area of a polygon that does not cross itself [m2].
pub fn area(polygon: &[Point]) -> f64 {
    // From its first corner: survey coordinates would leave few digits.
    let [x, y] = polygon[0];
    let twice: f64 = sides(polygon).map(|[a, b]| (a[0] - x) * (b[1] - y) - (b[0] - x) * (a[1] - y)).sum();
    0.5 * twice.abs()
}

fn sides(polygon: &[Point]) -> impl Iterator<Item = [Point; 2]> + '_ {
    (0..polygon.len()).map(|k| [polygon[k], polygon[(k + 1) % polygon.len()]])
}

/// Refuse an area whose sides cross, or that is none; `key` is where the scene has it.
pub fn check_polygon(polygon: &[Point], key: &str, scene: &Scene) -> Result<(), Diagnostic> {
    if let Some([a, b]) = crossing(polygon) {
        let side = |k: usize| {
            let [from, to] = [polygon[k], polygon[(k + 1) % polygon.len()]];
            format!("from ({}, {}) to ({}, {})", from[0], from[1], to[0], to[1])
        };
        let what = format!("the polygon crosses itself: its side {} and {}", side(a), side(b));
        return scene.refuse(key, what, "list its corners in order around it, or make two of it");
    }
    if area(polygon) <= 0.0 {
        return Err(scene.invalid(key, "a polygon without area"));
    }
    Ok(())
}

/// Two sides of a polygon that cross or touch each other, neighbours at their common corner left out.
pub fn crossing(polygon: &[Point]) -> Option<[usize; 2]> {
    let all: Vec<[Point; 2]> = sides(polygon).collect();
    let count = all.len();
    for a in 0..count {
        for b in a + 1..count {
            let neighbours = b == a + 1 || (a == 0 && b == count - 1);
            if if neighbours { folds_back(&all[a], &all[b]) } else { cross(&all[a], &all[b]) } {
                return Some([a, b]);
            }
        }
    }
    None
}

fn turn(a: &Point, b: &Point, c: &Point) -> f64 {
    let at = |p: &Point| Coord { x: p[0], y: p[1] };
    orient2d(at(a), at(b), at(c))
}

/// True if two stretches have a point in common.
pub fn cross([a, b]: &[Point; 2], [c, d]: &[Point; 2]) -> bool {
    let between =
        |p: &Point, q: &Point, r: &Point| (0..2).all(|k| r[k] >= p[k].min(q[k]) && r[k] <= p[k].max(q[k]));
    let (t1, t2, t3, t4) = (turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b));
    if t1 * t2 < 0.0 && t3 * t4 < 0.0 {
        return true;
    }
    (t1 == 0.0 && between(a, b, c))
        || (t2 == 0.0 && between(a, b, d))
        || (t3 == 0.0 && between(c, d, a))
        || (t4 == 0.0 && between(c, d, b))
}

/// True if two sides with a common corner lie on each other.
fn folds_back([a, b]: &[Point; 2], [c, d]: &[Point; 2]) -> bool {
    let (corner, p, q) = if b == c { (b, a, d) } else { (a, b, c) };
    if turn(corner, p, q) != 0.0 {
        return p == corner || q == corner;
    }
    let dot: f64 = (0..2).map(|k| (p[k] - corner[k]) * (q[k] - corner[k])).sum();
    dot >= 0.0
}

/// An area, cut into strips along x between its corners: two numbers from 0 to 1 become a place in it, evenly.
#[derive(Debug, Clone, PartialEq)]
pub struct Area {
    corners: Vec<Point>,
    /// Beginnings and ends of the strips [m].
    edges: Vec<f64>,
    /// Area up to each edge [m2].
    sums: Vec<f64>,
}

impl Area {
    /// Of a polygon that does not cross itself.
    pub fn new(polygon: &[Point]) -> Self {
        let mut edges: Vec<f64> = polygon.iter().map(|p| p[0]).collect();
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let mut it = Self { corners: polygon.to_vec(), edges, sums: vec![0.0] };
        for pair in it.edges.clone().windows(2) {
            let [from, to] = it.widths(pair[0], pair[1]);
            let last = it.sums[it.sums.len() - 1];
            it.sums.push(last + 0.5 * (from + to) * (pair[1] - pair[0]));
        }
        it
    }

    /// The sides above each place of the strip between two edges, from below, as values at both edges.
    fn chords(&self, from: f64, to: f64) -> Vec<[f64; 2]> {
        let mut all: Vec<[f64; 2]> = sides(&self.corners)
            .filter_map(|[a, b]| {
                let (a, b) = if a[0] <= b[0] { (a, b) } else { (b, a) };
                let at = |x: f64| a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]);
                (a[0] <= from && b[0] >= to && b[0] > a[0]).then(|| [at(from), at(to)])
            })
            .collect();
        all.sort_by(|p, q| (p[0] + p[1]).total_cmp(&(q[0] + q[1])));
        all
    }

    /// Width of the area at both edges of a strip.
    fn widths(&self, from: f64, to: f64) -> [f64; 2] {
        let chords = self.chords(from, to);
        [0, 1].map(|k| chords.chunks_exact(2).map(|pair| pair[1][k] - pair[0][k]).sum())
    }

    /// The place for two numbers from 0 to 1.
    pub fn at(&self, u: f64, v: f64) -> Point {
        let total = self.sums[self.sums.len() - 1];
        let wanted = u * total;
        let strip = self.sums.partition_point(|sum| *sum <= wanted).clamp(1, self.edges.len() - 1) - 1;
        let (from, to) = (self.edges[strip], self.edges[strip + 1]);
        let [a, b] = self.widths(from, to);
        // a s + (b - a) s^2 / 2 = share of the strip, times (a + b) / 2.
        let share = ((wanted - self.sums[strip]) / (self.sums[strip + 1] - self.sums[strip])).clamp(0.0, 1.0);
        let right = share * (a + b);
        let s = if a + b > 0.0 { right / (a + (a * a + (b - a) * right).max(0.0).sqrt()) } else { share };
        let x = from + s * (to - from);
        let heights: Vec<f64> = self.chords(from, to).iter().map(|c| c[0] + s * (c[1] - c[0])).collect();
        let width: f64 = heights.chunks_exact(2).map(|pair| pair[1] - pair[0]).sum();
        let mut left = v * width;
        for pair in heights.chunks_exact(2) {
            if left <= pair[1] - pair[0] {
                return [x, pair[0] + left];
            }
            left -= pair[1] - pair[0];
        }
        [x, heights.last().copied().unwrap_or_default()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const L: [Point; 6] = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];

    #[test]
    fn lengths_and_areas_are_those_of_geometry() {
        assert_eq!(length(&[[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]]), 6.0);
        assert_eq!(along(&[[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]], 5.5 / 6.0), [3.0, 4.5]);
        assert_eq!(area(&L), 6.0);
        let far: Vec<Point> = L.iter().map(|[x, y]| [x + 2.6e6, y + 1.2e6]).collect();
        assert_eq!(area(&far), 6.0);
    }

    #[test]
    fn a_point_is_as_far_from_a_line_as_from_its_nearest_piece() {
        let line = [[0.0, 0.0], [3.0, 4.0], [3.0, 4.0], [3.0, 10.0]];
        for (at, due) in [([4.0, -3.0], 5.0), ([-3.0, -4.0], 5.0), ([7.0, 7.0], 4.0), ([6.0, 14.0], 5.0)] {
            assert!((distance_from(&line, &at) - due).abs() < 1e-14, "{at:?}");
        }
    }

    #[test]
    fn sides_that_cross_or_fold_back_are_found() {
        assert_eq!(crossing(&L), None);
        assert!(crossing(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]).is_some());
        assert!(crossing(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]]).is_some());
        assert!(crossing(&[[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]).is_some());
        assert_eq!(crossing(&[[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]]), None);
    }

    /// Shares of two parts of known area, and of a triangle below a chord; a point of every cell of the unit square is inside.
    #[test]
    fn places_are_spread_evenly_over_an_area() {
        let (n, of_l, of_triangle) = (400, Area::new(&L), Area::new(&[[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]));
        let (mut right, mut below) = (0, 0);
        for i in 0..n {
            for j in 0..n {
                let [u, v] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(n));
                let [x, y] = of_l.at(u, v);
                assert!(x >= 0.0 && y >= 0.0 && x <= 4.0 && y <= if x > 1.0 { 1.0 } else { 3.0 }, "{x} {y}");
                right += i32::from(x > 1.0);
                let [x, y] = of_triangle.at(u, v);
                assert!(x >= 0.0 && y >= 0.0 && x + y <= 2.0 + 1e-12, "{x} {y}");
                below += i32::from(x + y <= 1.0);
            }
        }
        let all = f64::from(n * n);
        assert!((f64::from(right) / all - 0.5).abs() < 2e-3, "{right}");
        assert!((f64::from(below) / all - 0.25).abs() < 2e-3, "{below}");
    }
}
