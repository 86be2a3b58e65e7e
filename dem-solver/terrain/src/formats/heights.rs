//! Heights that no terrain has: marks of cells without height that the file does not declare, degrees in place of metres.

use super::super::notice;
use crate::raster::Raster;
use dem_solid::geometry::double_area;
use dem_solid::input::ReadError;
use interface_defs::diagnostic::Diagnostic;

/// Area seen from the side over that from above, of a terrain that is more likely to lie on its side: slopes of 63 degrees.
const STEEP: f64 = 2.0;
/// What is written where there is no height.
const MARKS: [f64; 12] = [
    0.0, -1.0, -99.0, -999.0, -9999.0, -99_999.0, 9999.0, 99_999.0, -32_768.0, -32_767.0, 32_767.0, 65_535.0,
];
/// Higher and deeper than anything on Earth [m].
const FURTHEST: f64 = 12_000.0;
/// Least gap between a mark and all heights [m], and over the range of those.
const GAP: f64 = 100.0;
/// Range of heights over the extent on the map from which on the map must be in degrees.
const STEEPEST: f64 = 20.0;

/// Refuse a raster whose cells hold marks for heights, or that lies in degrees.
pub fn of_raster(raster: &Raster) -> Result<(), ReadError> {
    let known = || raster.heights.iter().copied().filter(|z| !z.is_nan());
    marks(known, raster.heights.len(), "cells")?;
    let [dx, dy] = raster.spacing;
    let [columns, rows] = raster.counts;
    let far = [raster.corner[0] + dx * columns as f64, raster.corner[1] + dy * rows as f64];
    degrees([raster.corner, far], range(known()))
}

/// The same of points.
pub fn of_points(points: &[[f64; 3]]) -> Result<(), ReadError> {
    let heights = || points.iter().map(|p| p[2]);
    marks(heights, points.len(), "points")?;
    let axis = |a: usize| range(points.iter().map(|p| p[a]));
    let ([x0, x1], [y0, y1]) = (axis(0), axis(1));
    degrees([[x0, y0], [x1, y1]], range(heights()))
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// The lowest and the highest height: is one of them a mark?
fn marks<I: Iterator<Item = f64>>(heights: impl Fn() -> I, count: usize, of: &str) -> Result<(), ReadError> {
    let [low, high] = range(heights());
    for mark in [low, high] {
        let [next_low, next_high] = range(heights().filter(|z| *z != mark));
        let gap = if mark == low { next_low - mark } else { mark - next_high };
        // Nothing else, or nothing at all.
        if !gap.is_finite() {
            continue;
        }
        let others_are_heights = next_low > -FURTHEST && next_high < FURTHEST;
        let known = MARKS.contains(&mark) || mark.abs() > FURTHEST && others_are_heights;
        if known && gap > GAP && gap > next_high - next_low {
            let cells = heights().filter(|z| *z == mark).count();
            let what = format!(
                "{cells} of {count} {of} have the height {mark:e} m, and all others {next_low} to {next_high} m: a mark of \
                 {of} without height that the file does not declare"
            );
            let cure =
                format!("write nodata_value = {mark:?} under [terrain], and nodata = \"cut\" or fill them");
            return Err(ReadError::new(what).try_instead(cure));
        }
    }
    on_earth([low, high])
}

/// The same of the corners of triangles, whose heights are along z.
pub fn of_triangles(
    nodes: &[nalgebra::Vector3<f64>],
    triangles: &[[u32; 3]],
) -> Result<Option<Diagnostic>, ReadError> {
    on_earth(range(nodes.iter().map(|n| n.z)))?;
    let mut sums = [0.0; 3];
    for corners in triangles.iter().map(|t| t.map(|n| nodes[n as usize])) {
        let area = 0.5 * double_area(corners);
        (0..3).for_each(|axis| sums[axis] += area[axis].abs());
    }
    let [x, y, z] = sums;
    Ok((y > STEEP * z || x > STEEP * z).then(|| {
        let axis = if y > x { "y" } else { "x" };
        let most = x.max(y);
        let cure = format!(
            "z is upward here, and a mesh whose upward axis is {axis} must be turned when it is exported"
        );
        notice(format!(
            "seen along {axis} it is {most:.4e} m2 large, seen from above only {z:.4e} m2: it is upright"
        ))
        .try_instead(cure)
    }))
}

fn on_earth([low, high]: [f64; 2]) -> Result<(), ReadError> {
    if low < -FURTHEST || high > FURTHEST {
        let what = format!("heights from {low:e} to {high:e} m: nothing on Earth is as high or as deep");
        return Err(ReadError::new(what).try_instead(
            "heights are in metres; a mark of cells without height is named with nodata_value",
        ));
    }
    Ok(())
}

/// A map of some degrees whose heights are metres is a mesh.
fn degrees([[x0, y0], [x1, y1]]: [[f64; 2]; 2], [low, high]: [f64; 2]) -> Result<(), ReadError> {
    let extent = (x1 - x0).max(y1 - y0);
    if extent <= 0.0 || high - low <= STEEPEST * extent {
        return Ok(());
    }
    let may_be = x0 >= -360.0 && x1 <= 360.0 && y0 >= -90.0 && y1 <= 90.0;
    let (what, cure) = if may_be {
        let map = format!("x from {x0} to {x1} and y from {y0} to {y1}, with heights from {low} to {high} m");
        let cure = "project it to metres, as with gdalwarp -t_srs EPSG:CODE IN OUT";
        (map + ": these are degrees, and a scene is in metres", cure)
    } else {
        let map = format!("a map of {:.4} m x {:.4} m with heights from {low} to {high} m", x1 - x0, y1 - y0);
        let cure = "are its cells or coordinates in kilometres? They are in metres, as the heights";
        (map + ": all of it would be a cliff", cure)
    };
    Err(ReadError::new(what).try_instead(cure))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn raster(heights: &[f64], spacing: f64) -> Raster {
        Raster {
            corner: [7.5, 46.5],
            spacing: [spacing; 2],
            counts: [heights.len() / 2, 2],
            heights: heights.to_vec(),
        }
    }

    fn judged(heights: &[f64], spacing: f64) -> Result<(), String> {
        of_raster(&raster(heights, spacing)).map_err(|e| e.in_file(Path::new("t.asc")).to_string())
    }

    #[test]
    fn an_undeclared_mark_is_named_with_its_count_and_what_to_write() {
        let rest = [1500.0, 1510.5, 1520.0, 1530.0];
        let with = |mark: f64| [&rest[..], &[mark, mark]].concat();
        for mark in [0.0, -9999.0, -32_768.0, 65_535.0, f64::from(f32::MIN), f64::from(f32::MAX)] {
            let refused = judged(&with(mark), 25.0).expect_err("a mark");
            assert!(refused.starts_with("t.asc: 2 of 6 cells have the height"), "{refused}");
            assert!(
                refused.contains(&format!("write nodata_value = {mark:?} under"))
                    && refused.contains("1500 to 1530 m")
            );
        }
        assert_eq!(judged(&with(1400.0), 25.0), Ok(()));
        // The sea beside a coast, a steep cliff, all at sea level.
        assert_eq!(judged(&[0.0, 0.0, 3.0, 250.0, 400.0, 20.0], 250.0), Ok(()));
        assert_eq!(judged(&[0.0; 6], 25.0), Ok(()));
        let high = judged(&[1.5e6, 1.6e6, 1.52e6, 1.53e6, 1.51e6, 1.5e6], 25.0).expect_err("in millimetres");
        assert!(high.contains("1.6e6 m") && high.contains("in metres"), "{high}");
    }

    #[test]
    fn degrees_are_known_by_the_slope_that_they_would_make() {
        let heights = [1500.0, 1510.5, 1520.0, 1530.0, 1600.0, 1550.0];
        let refused = judged(&heights, 2.0 / 3600.0).expect_err("two arc seconds");
        assert!(refused.contains("these are degrees") && refused.contains("7.5"), "{refused}");
        assert_eq!(judged(&heights, 10.0), Ok(()));
        let points: Vec<[f64; 3]> =
            heights.iter().zip(0..).map(|(z, i)| [7.5 + 1e-3 * f64::from(i), 46.0, *z]).collect();
        assert!(of_points(&points).expect_err("degrees").message.contains("these are degrees"));
    }
}
