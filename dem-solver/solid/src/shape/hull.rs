//! The convex hull of points.

use super::surface::Surface;
use nalgebra::Vector3;
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::try_convex_hull;

/// Most points of which a hull is made.
pub const MOST_POINTS: usize = 100_000;

/// The hull of `points` [m]; `Err` says why there is none.
pub fn convex(points: &[Vector3<f64>]) -> Result<Surface, String> {
    if points.len() < 4 {
        return Err(format!("{} points span nothing: 4 are the fewest", points.len()));
    }
    if points.len() > MOST_POINTS {
        return Err(format!("{} points: up to {MOST_POINTS} are possible", points.len()));
    }
    if let Some(at) = points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        return Err(format!("point {} is not finite", at + 1));
    }
    // The same point twice is an error to the library and none to a user.
    let mut unique = points.to_vec();
    unique.sort_by(|a, b| {
        (0..3).map(|k| a[k].total_cmp(&b[k])).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    });
    unique.dedup();
    let given: Vec<Vector> = unique.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
    let (corners, triangles) =
        try_convex_hull(&given).map_err(|e| format!("the points have no convex hull with a volume: {e}"))?;
    let corners = corners.iter().map(|p| Vector3::new(p.x, p.y, p.z)).collect();
    let (surface, _) = Surface::from_indexed(corners, triangles).map_err(|flaw| {
        format!("the convex hull of the points is no clean surface (nearly coinciding points?): {flaw}")
    })?;
    Ok(surface)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::SolidIntegrals;

    #[test]
    fn the_hull_of_a_filled_box_is_the_box() {
        let mut points = Vec::new();
        for i in 0..125 {
            points.push(Vector3::new(f64::from(i % 5), f64::from(i / 5 % 5), f64::from(i / 25)));
        }
        points.push(points[17]);
        let hull = convex(&points).expect("a box");
        assert!((SolidIntegrals::of(&hull).volume - 64.0).abs() < 1e-12);
    }

    #[test]
    fn points_without_a_volume_are_refused() {
        let flat: Vec<_> = (0..9).map(|i| Vector3::new(f64::from(i % 3), f64::from(i / 3), 0.0)).collect();
        for points in [&flat[..3], &flat[..], &[Vector3::zeros(); 8]] {
            assert!(convex(points).is_err());
        }
        assert!(convex(&[Vector3::repeat(f64::NAN); 8]).expect_err("no number").contains("not finite"));
    }
}
