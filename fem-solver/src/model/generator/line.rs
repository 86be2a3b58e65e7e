//! The line of a barrier on the terrain: where its posts stand as seen from above, and what speaks against it.

use crate::config::generator::Barrier;
use crate::read::{positive, refuse};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Vector2, Vector3};
use toolkit::coordinates::{Coordinates, Form};
use toolkit::scene::Scene;

/// Longest and shortest field [m]; kits have 4 to 12 m.
const FIELD: [f64; 2] = [0.1, 200.0];
/// Largest turn of the line at a post [degrees].
const TURN: f64 = 60.0;

/// Refuse a point of `table` that is none, and an azimuth [degrees] that goes round more than once.
pub fn check_point(
    scene: &Scene,
    table: &str,
    (name, point): (&str, &[f64]),
    azimuth: f64,
) -> Result<(), Diagnostic> {
    if !(-360.0..=360.0).contains(&azimuth) {
        let what = format!("azimuth = {azimuth}: it must lie between -360 and 360 degrees");
        return Err(scene.invalid(&format!("{table}.azimuth"), what));
    }
    if !matches!(point.len(), 2 | 3) {
        let what = format!("a point of {} numbers: two or three are required", point.len());
        return refuse(scene, &format!("{table}.{name}"), what, "[x, y] on the ground, or [x, y, z]");
    }
    Ok(())
}

/// The line as the scene states it.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its points [m]; heights are 0 where they are not stated.
    pub points: Vec<Vector3<f64>>,
    /// Whether heights are stated.
    pub has_heights: bool,
    /// EPSG code of the layer that it was read from, if any.
    pub system: Option<u32>,
    /// The key that states it.
    pub key: &'static str,
}

impl Line {
    /// That of `table`, which has one.
    pub fn of(scene: &Scene, table: &Barrier) -> Result<Self, Diagnostic> {
        match (&table.line, &table.position) {
            (Some(_), Some(_)) => {
                let what = "line and position together define one thing twice";
                Err(scene.invalid("structure.generator.position", what).try_instead("keep one of them"))
            }
            (Some(line), None) => Self::stated(scene, table, line),
            (None, Some(middle)) => Self::around(scene, table, middle),
            (None, None) => {
                Err(scene.invalid("structure.generator", "the barrier has neither line nor position"))
            }
        }
    }

    fn stated(scene: &Scene, table: &Barrier, line: &Coordinates<Vec<f64>>) -> Result<Self, Diagnostic> {
        let key = "structure.generator.line";
        let line = line.read(Form::Line, key, scene)?;
        for (name, stated) in [("azimuth", table.azimuth), ("length", table.length)] {
            if stated.is_some() {
                let what = format!("`{name}` belongs to position: the line has its own");
                return refuse(scene, &format!("structure.generator.{name}"), what, "leave it out");
            }
        }
        if line.len() < 2 {
            let what = format!("{} points: a line has two at least", line.len());
            return Err(scene.invalid(key, what).try_instead("line = [[x, y], [x, y]]"));
        }
        let size = line[0].len();
        for (i, point) in line.iter().enumerate() {
            if !matches!(point.len(), 2 | 3) || point.len() != size {
                let what = format!("a point of {} numbers: each has two, or each has three", point.len());
                return refuse(scene, &format!("{key}.{i}"), what, "[x, y] on the ground, or [x, y, z]");
            }
        }
        let points =
            line.iter().map(|p| Vector3::new(p[0], p[1], p.get(2).copied().unwrap_or(0.0))).collect();
        Self { points, has_heights: size == 3, system: line.system(), key }.checked(scene, table)
    }

    fn around(scene: &Scene, table: &Barrier, middle: &[f64]) -> Result<Self, Diagnostic> {
        let key = "structure.generator.position";
        let (Some(azimuth), Some(length)) = (table.azimuth, table.length) else {
            let what = "position is the middle of the line: azimuth and length are required with it";
            return refuse(scene, key, what, "azimuth in degrees from y, clockwise; length in metres");
        };
        positive(scene, "structure.generator.length", length, "m")?;
        check_point(scene, "structure.generator", ("position", middle), azimuth)?;
        let at = Vector3::new(middle[0], middle[1], middle.get(2).copied().unwrap_or(0.0));
        let (sine, cosine) = azimuth.to_radians().sin_cos();
        let half = Vector3::new(sine, cosine, 0.0) * (0.5 * length);
        let points = vec![at - half, at + half];
        Self { points, has_heights: middle.len() == 3, system: None, key }.checked(scene, table)
    }

    fn checked(self, scene: &Scene, table: &Barrier) -> Result<Self, Diagnostic> {
        let fault = |i: usize, what: String| {
            let key = if self.points.len() == 2 { self.key.to_owned() } else { format!("{}.{i}", self.key) };
            scene.invalid(&key, what)
        };
        let pieces: Vec<Vector2<f64>> = self.points.windows(2).map(|p| (p[1] - p[0]).xy()).collect();
        let fields = self.fields(table.fields);
        if table.fields < pieces.len() {
            let (own, count) = (table.fields, pieces.len());
            let what =
                format!("{own} fields: the line has {count} pieces, and a post stands at each of its points");
            return refuse(scene, "structure.generator.fields", what, format!("fields = {count}"));
        }
        for (i, (piece, fields)) in pieces.iter().zip(&fields).enumerate() {
            let field = piece.norm() / *fields as f64;
            let [least, most] = FIELD;
            if !(least..=most).contains(&field) {
                let what = format!(
                    "fields of {field:.3} m as seen from above: posts stand {least} to {most} m apart"
                );
                let hint = "the line is in metres, in the coordinates of the terrain; or change `fields`";
                return Err(fault(i + 1, what).try_instead(hint));
            }
        }
        for (i, pair) in pieces.windows(2).enumerate() {
            let turn = pair[0].angle(&pair[1]).to_degrees();
            if turn > TURN {
                let what = format!("the line turns by {turn:.0} degrees here: {TURN} are possible");
                return Err(fault(i + 1, what).try_instead("put another point into the bend"));
            }
        }
        Ok(self)
    }

    /// How many of `total` fields each piece has: one more where fields are longest, again and again.
    pub fn fields(&self, total: usize) -> Vec<usize> {
        let lengths: Vec<f64> = self.points.windows(2).map(|p| (p[1] - p[0]).xy().norm()).collect();
        let mut fields = vec![1_usize; lengths.len()];
        for _ in lengths.len()..total {
            let field = |i: usize| lengths[i] / fields[i] as f64;
            // The first of equal ones.
            let longest = (0..lengths.len()).rev().max_by(|a, b| field(*a).total_cmp(&field(*b)));
            if let Some(longest) = longest {
                fields[longest] += 1;
            }
        }
        fields
    }

    /// Where the posts stand [m], in order; heights as stated.
    pub fn posts(&self, total: usize) -> Vec<Vector3<f64>> {
        let pieces = self.points.windows(2).zip(self.fields(total));
        let inner = pieces.flat_map(|(ends, fields)| {
            let (from, way) = (ends[0], ends[1] - ends[0]);
            (0..fields).map(move |k| from + way * (k as f64 / fields as f64))
        });
        inner.chain(self.points.last().copied()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[[f64; 2]]) -> Line {
        let points = points.iter().map(|p| Vector3::new(p[0], p[1], 0.0)).collect();
        Line { points, has_heights: false, system: None, key: "line" }
    }

    #[test]
    fn every_point_of_a_line_has_a_post_and_the_longest_field_is_as_short_as_can_be() {
        let bent = line(&[[0.0, 0.0], [30.0, 0.0], [42.0, 9.0]]);
        assert_eq!(bent.fields(2), [1, 1]);
        assert_eq!(bent.fields(5), [3, 2]);
        // Of all ways to part the fields, none has a shorter longest field.
        for total in 2..12 {
            let longest = |first: usize| (30.0 / first as f64).max(15.0 / (total - first) as f64);
            let best = (1..total).map(longest).fold(f64::INFINITY, f64::min);
            assert_eq!(longest(bent.fields(total)[0]), best, "{total}");
        }
        let posts = bent.posts(5);
        assert_eq!(posts.len(), 6);
        assert!(bent.points.iter().all(|p| posts.contains(p)));
        assert!((posts[1] - Vector3::new(10.0, 0.0, 0.0)).norm() < 1e-14);
    }

    #[test]
    fn an_azimuth_counts_from_north_clockwise() {
        let scene = Scene::from_text("s.toml", "title = \"x\"").expect("valid");
        let table = Barrier {
            position: Some(vec![100.0, 200.0, 7.0]),
            azimuth: Some(120.0),
            length: Some(40.0),
            ..Barrier::default()
        };
        let line = Line::of(&scene, &table).expect("a line");
        let half = Vector3::new(20.0 * 60.0_f64.to_radians().cos().hypot(0.0) * 3.0_f64.sqrt(), -10.0, 0.0);
        let middle = Vector3::new(100.0, 200.0, 7.0);
        assert!(
            (line.points[1] - middle - half).norm() < 1e-13
                && (line.points[0] - middle + half).norm() < 1e-13
        );
        assert!(line.has_heights);
    }
}
