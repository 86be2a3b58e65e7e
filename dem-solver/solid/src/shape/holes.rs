//! Small holes of a scanned surface, closed when asked for.
//!
//! The rim of a hole is a ring of edges with a triangle on one side only. It is filled by the triangles between
//! its corners that have the least area together, without new corners. Source: Barequet and Sharir (1995), Comput.
//! Aided Geom. Des. 12, 207.

use super::surface::{Surface, place};
use crate::geometry::double_area;
use crate::geometry::shared_nodes::free_edges;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// Widest hole that is closed, as a share of the surface's size: what a larger one hides is not known.
const WIDEST_HOLE: f64 = 0.1;

/// Most edges of a rim; the work grows with their third power.
const MOST_EDGES: usize = 400;

/// Close all holes of `surface`. What was done, or why it was not.
pub fn close(surface: &mut Surface) -> Result<Option<String>, String> {
    let rims = rims(surface);
    if rims.is_empty() {
        return Ok(None);
    }
    let size = surface.size();
    let mut filled = Vec::new();
    let mut area = 0.0;
    for rim in &rims {
        let corners: Vec<Vector3<f64>> = rim.iter().map(|p| surface.points[*p as usize]).collect();
        let widest = corners.iter().map(|p| (p - corners[0]).norm()).fold(0.0, f64::max);
        if widest > WIDEST_HOLE * size || rim.len() > MOST_EDGES {
            let (edges, at) = (rim.len(), place(&corners[0]));
            let (most, percent) = (WIDEST_HOLE * size, 100.0 * WIDEST_HOLE);
            return Err(format!(
                "the hole with {edges} edges near {at} is {widest:.3e} m wide: holes of up to {most:.3e} m, {percent:.0} % of \
                 the size, are closed; close it where the file comes from"
            ));
        }
        let triangles = fill(&corners);
        area += triangles.iter().map(|t| double_area(t.map(|k| corners[k])).norm()).sum::<f64>() / 2.0;
        filled.extend(triangles.iter().map(|t| t.map(|k| rim[k])));
    }
    surface.triangles.extend(filled);
    let s = if rims.len() == 1 { "hole was" } else { "holes were" };
    Ok(Some(format!("{} {s} closed, {area:.3e} m2 together", rims.len())))
}

/// The rings of edges with a triangle on one side only, each against the direction of its triangles.
fn rims(surface: &Surface) -> Vec<Vec<u32>> {
    let mut next: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for [a, b] in free_edges(&surface.triangles) {
        next.entry(a).or_default().insert(b);
        next.entry(b).or_default().insert(a);
    }
    let mut rims = Vec::new();
    while let Some((&start, _)) = next.iter().find(|(_, ends)| !ends.is_empty()) {
        let mut rim = vec![start];
        let mut here = start;
        // Where rims touch in a corner the first ring that closes is one.
        while let Some(to) = next.get_mut(&here).and_then(|ends| ends.pop_first()) {
            if let Some(ends) = next.get_mut(&to) {
                ends.remove(&here);
            }
            if let Some(at) = rim.iter().position(|p| *p == to) {
                rims.push(rim.split_off(at));
                rim.push(to);
            } else {
                rim.push(to);
            }
            here = to;
        }
    }
    rims
}

/// The triangles between the corners of a ring that have the least area together.
fn fill(corners: &[Vector3<f64>]) -> Vec<[usize; 3]> {
    let n = corners.len();
    let mut least = vec![vec![0.0_f64; n]; n];
    let mut apex = vec![vec![0_usize; n]; n];
    for length in 2..n {
        for from in 0..n - length {
            let to = from + length;
            least[from][to] = f64::INFINITY;
            for middle in from + 1..to {
                let own = double_area([corners[from], corners[middle], corners[to]]).norm();
                let sum = least[from][middle] + least[middle][to] + own;
                if sum < least[from][to] {
                    (least[from][to], apex[from][to]) = (sum, middle);
                }
            }
        }
    }
    let mut triangles = Vec::new();
    let mut stack = if n > 2 { vec![(0, n - 1)] } else { Vec::new() };
    while let Some((from, to)) = stack.pop() {
        if to - from > 1 {
            let middle = apex[from][to];
            triangles.push([from, middle, to]);
            stack.extend([(from, middle), (middle, to)]);
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::closed::Mend;
    use crate::shape::{SolidIntegrals, builtin};

    fn without(few: &[usize]) -> Surface {
        let mut ball = builtin::ellipsoid(Vector3::repeat(0.5), 3);
        let mut at = 0;
        ball.triangles.retain(|_| {
            at += 1;
            !few.contains(&(at - 1))
        });
        ball
    }

    fn closed(surface: Surface) -> Result<(Surface, Vec<String>), String> {
        let mend = Mend { close_holes: true, ..Mend::default() };
        Surface::mended(surface.points, surface.triangles, &mend)
    }

    /// Three single triangles that are missing are put back: the same volume; their area, by Heron's formula.
    #[test]
    fn missing_triangles_are_put_back_and_their_number_and_area_are_stated() {
        let whole = builtin::ellipsoid(Vector3::repeat(0.5), 3);
        let heron = |t: usize| {
            let [a, b, c] = whole.corners(t);
            let (x, y, z) = ((a - b).norm(), (b - c).norm(), (c - a).norm());
            let s = (x + y + z) / 2.0;
            (s * (s - x) * (s - y) * (s - z)).sqrt()
        };
        let gone = [3, 500, 1100];
        let holed = without(&gone);
        let flaw = Surface::from_indexed(holed.points.clone(), holed.triangles.clone()).expect_err("open");
        assert!(flaw.contains("--close-holes"), "{flaw}");
        let (surface, notes) = closed(holed).expect("closed");
        assert!(
            (SolidIntegrals::of(&surface).volume / SolidIntegrals::of(&whole).volume - 1.0).abs() < 1e-12
        );
        let area: f64 = gone.iter().map(|t| heron(*t)).sum();
        assert_eq!(notes[0], format!("3 holes were closed, {area:.3e} m2 together"));
    }

    /// A ring of triangles around one corner: the hole has six corners, its middle is cut off flat.
    #[test]
    fn a_hole_of_several_triangles_is_closed_by_those_of_the_least_area() {
        let whole = builtin::ellipsoid(Vector3::repeat(0.5), 3);
        let around: Vec<usize> =
            (0..whole.triangles.len()).filter(|t| whole.triangles[*t].contains(&100)).collect();
        let (surface, notes) = closed(without(&around)).expect("closed");
        assert_eq!(surface.triangles.len(), whole.triangles.len() - 2);
        assert!(notes[0].starts_with("1 hole was closed"), "{notes:?}");
        let lost = 1.0 - SolidIntegrals::of(&surface).volume / SolidIntegrals::of(&whole).volume;
        assert!(lost > 0.0 && lost < 2e-3, "{lost}");
    }

    #[test]
    fn a_wide_hole_stays_and_is_named() {
        let whole = builtin::ellipsoid(Vector3::repeat(0.5), 3);
        let cap: Vec<usize> =
            (0..whole.triangles.len()).filter(|t| whole.corners(*t).iter().all(|p| p.z > 0.3)).collect();
        let flaw = closed(without(&cap)).expect_err("too wide");
        assert!(flaw.contains("edges near") && flaw.contains("wide"), "{flaw}");
    }
}
