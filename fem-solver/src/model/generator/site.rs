//! A barrier on the terrain: its line as seen from above, and where its feet, heads and anchors lie.
//!
//! Posts stand on the ground at their x and y, anchors lie on it; what is not stated comes from a raster of heights. The line is
//! taken so that the slope rises to its right: then along, down the slope and up are right-handed, as in the barrier's own axes.

use crate::config::generator::{Barrier, Side};
use crate::read::heights::Heights;
use interface_defs::diagnostic::{Diagnostic, code};
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
        return scene.refuse(&format!("{table}.{name}"), what, "[x, y] on the ground, or [x, y, z]");
    }
    Ok(())
}

/// The line as the scene states it.
#[derive(Debug, Clone, PartialEq)]
pub struct BarrierLine {
    /// Its points [m]; heights are 0 where they are not stated.
    pub points: Vec<Vector3<f64>>,
    /// Whether heights are stated.
    pub has_heights: bool,
    /// EPSG code of the layer that it was read from, if any.
    pub system: Option<u32>,
    /// The key that states it.
    pub key: &'static str,
}

impl BarrierLine {
    /// That of `table`, which has one.
    pub fn of(scene: &Scene, table: &Barrier) -> Result<Self, Diagnostic> {
        match (&table.line, &table.position) {
            (Some(_), Some(_)) => {
                let what = "line and position together define one thing twice";
                scene.refuse("structure.generator.position", what, "keep one of them")
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
                return scene.refuse(&format!("structure.generator.{name}"), what, "leave it out");
            }
        }
        if line.len() < 2 {
            let what = format!("{} points: a line has two at least", line.len());
            return scene.refuse(key, what, "line = [[x, y], [x, y]]");
        }
        let size = line[0].len();
        for (i, point) in line.iter().enumerate() {
            if !matches!(point.len(), 2 | 3) || point.len() != size {
                let what = format!("a point of {} numbers: each has two, or each has three", point.len());
                return scene.refuse(&format!("{key}.{i}"), what, "[x, y] on the ground, or [x, y, z]");
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
            return scene.refuse(key, what, "azimuth in degrees from y, clockwise; length in metres");
        };
        super::key(scene).positive(&[("length", length, "m")])?;
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
            return scene.refuse("structure.generator.fields", what, format!("fields = {count}"));
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

    /// Number of `total` fields that each piece has: one more where fields are longest, again and again.
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

    /// Feet of the posts [m], in order; heights as stated.
    pub fn posts(&self, total: usize) -> Vec<Vector3<f64>> {
        let pieces = self.points.windows(2).zip(self.fields(total));
        let inner = pieces.flat_map(|(ends, fields)| {
            let (from, way) = (ends[0], ends[1] - ends[0]);
            (0..fields).map(move |k| from + way * (k as f64 / fields as f64))
        });
        inner.chain(self.points.last().copied()).collect()
    }
}

/// Least difference of the ground on both sides of the line, over its distance from there: a fall of so much counts as a slope.
const SLOPE: f64 = 0.02;
/// The ground above or below the bottom rope of which it is warned [m].
const OFF_GROUND: f64 = 0.5;
/// How much steeper than the normal of the slope a post stands [degrees]: manuals of kits state 75 degrees to the slope.
const OFF_NORMAL: f64 = 15.0;
/// Least lean from the vertical [degrees]: head and net must push against the upslope ropes by more than these pull as they sag. Posts of 4 m
/// with ropes of 22 mm and brakes of 15 kg turn by 1 degree from there, at slopes of 10 to 55 degrees; from 20 degrees inner posts turn by
/// 16, along the barrier, and from 15 some fall.
const LEAST_LEAN: f64 = 25.0;
/// Looks at the ground below a field.
const LOOKS: usize = 20;

/// The place of a barrier.
#[derive(Debug, Clone)]
pub struct Site {
    /// Feet of the posts [m].
    pub feet: Vec<Vector3<f64>>,
    /// From foot to head [m].
    pub posts: Vec<Vector3<f64>>,
    /// Anchors beside the first and the last post, of the bottom rope and of the top rope [m].
    pub sides: [[Vector3<f64>; 2]; 2],
    /// Two anchors in the slope for each post [m].
    pub upslope: Vec<[Vector3<f64>; 2]>,
    /// Remarks for the user.
    pub warnings: Vec<Diagnostic>,
}

impl Site {
    /// That of a barrier with a line.
    pub fn of(scene: &Scene, table: &Barrier) -> Result<Self, Diagnostic> {
        let line = BarrierLine::of(scene, table)?;
        let ground = ground(scene, table, &line)?;
        let place = SiteInput { scene, table, line: &line, ground: ground.as_ref() };
        place.site()
    }

    /// A point of the net: `along` in fields from the first post, `up` in parts of a post.
    pub fn in_net(&self, along: f64, up: f64) -> Vector3<f64> {
        let field = (along as usize).min(self.feet.len() - 2);
        let share = along - field as f64;
        let at = |post: usize| self.feet[post] + up * self.posts[post];
        at(field) * (1.0 - share) + at(field + 1) * share
    }
}

/// The raster of the scene; required where the line has no heights.
fn ground(scene: &Scene, table: &Barrier, line: &BarrierLine) -> Result<Option<Heights>, Diagnostic> {
    let key = "structure.generator.ground";
    let Some(path) = &table.ground else {
        if line.has_heights {
            return Ok(None);
        }
        let what = "points of two numbers stand on the ground, and its heights are not known here";
        return scene.refuse(line.key, what, "name a raster with ground = \"FILE.asc\", or write [x, y, z]; in a scene with [terrain], `rockfall run` and `rockfall \
             check` make the raster");
    };
    if line.has_heights {
        let what = "the line has heights of its own: nothing will use the ground";
        return scene.refuse(key, what, "leave out the third number of each point, or ground");
    }
    Heights::read(scene, key, path).map(Some)
}

/// What a site is made from.
struct SiteInput<'a> {
    scene: &'a Scene,
    table: &'a Barrier,
    line: &'a BarrierLine,
    ground: Option<&'a Heights>,
}

impl SiteInput<'_> {
    fn site(&self) -> Result<Site, Diagnostic> {
        let mut feet = self.line.posts(self.table.fields);
        if let Some(ground) = self.ground {
            for (k, foot) in feet.iter_mut().enumerate() {
                *foot = self.on(ground, foot.xy(), &format!("post {}", k + 1))?;
            }
        }
        let uphill = self.uphill(&feet)?;
        let against = self.ground.and_then(|ground| self.against(ground, &feet, uphill));
        if uphill == Side::Left {
            feet.reverse();
        }
        let down: Vec<Vector2<f64>> = (0..feet.len()).map(|k| left(along(&feet, k))).collect();
        let lean = self.table.lean.unwrap_or_else(|| self.lean(&feet));
        let rise = (self.table.height.powi(2) - lean.powi(2)).sqrt();
        let posts = down.iter().map(|d| Vector3::new(d.x, d.y, 0.0) * lean + Vector3::z() * rise).collect();
        let sides = [self.beside(&feet, 0.5)?, self.beside(&feet, 1.0)?];
        let upslope = (0..feet.len()).map(|k| self.upslope(&feet, &down, k)).collect::<Result<_, _>>()?;
        let mut warnings = self.ground.map_or_else(Vec::new, |ground| off_ground(ground, &feet));
        warnings.extend(against);
        Ok(Site { feet, posts, sides, upslope, warnings })
    }

    /// The point of the ground there.
    fn on(&self, ground: &Heights, at: Vector2<f64>, what: &str) -> Result<Vector3<f64>, Diagnostic> {
        let hint = "move the line to the terrain, with the anchors beside and above it";
        let height = ground.below(at.x, at.y, what);
        let height = height.or_else(|what| self.scene.refuse(self.line.key, what, hint))?;
        Ok(Vector3::new(at.x, at.y, height))
    }

    /// The side on which the slope rises.
    fn uphill(&self, feet: &[Vector3<f64>]) -> Result<Side, Diagnostic> {
        if let Some(side) = self.table.uphill {
            return Ok(side);
        }
        let hint = "uphill = \"left\" or \"right\", seen from its first point";
        let Some(ground) = self.ground else {
            let what = "without ground it is not known on which side of the line the slope rises";
            return self.scene.refuse(self.line.key, what, hint);
        };
        let away = self.table.anchor_distance;
        let mean = self.fall(ground, feet);
        if mean.abs() < 2.0 * SLOPE * away {
            let what = format!(
                "{away} m to its left the ground lies {mean:.2} m higher than to its right: no slope says where rocks come from"
            );
            return self.scene.refuse(self.line.key, what, hint);
        }
        Ok(if mean > 0.0 { Side::Left } else { Side::Right })
    }

    /// A warning if the slope rises on the other side than the scene says.
    fn against(&self, ground: &Heights, feet: &[Vector3<f64>], stated: Side) -> Option<Diagnostic> {
        let (away, mean) = (self.table.anchor_distance, self.fall(ground, feet));
        let (side, other, higher) = match stated {
            Side::Left => ("left", "right", -mean),
            Side::Right => ("right", "left", mean),
        };
        let what = format!(
            "uphill = \"{side}\", and {away} m to its {other}, seen from the first point of the line, the ground lies {higher:.2} m higher \
             than to its {side}: the barrier stands with its back to the slope"
        );
        let hint = format!("leave out `uphill`, or write \"{other}\"; as it is where rocks come from below");
        (higher >= 2.0 * SLOPE * away).then(|| {
            Diagnostic::warning(code::CONTRADICTION, what)
                .about("structure.generator.uphill")
                .try_instead(hint)
        })
    }

    /// Height by which the ground lies higher an anchor's distance to the left of the line than to its right, on average [m].
    fn fall(&self, ground: &Heights, feet: &[Vector3<f64>]) -> f64 {
        let rise = |k: usize, sign: f64| {
            let at = feet[k].xy() + left(along(feet, k)) * (sign * self.table.anchor_distance);
            ground.at(at.x, at.y).map_or(0.0, |z| z - feet[k].z)
        };
        (0..feet.len()).map(|k| rise(k, 1.0) - rise(k, -1.0)).sum::<f64>() / feet.len() as f64
    }

    /// Distance of the heads down the slope from the feet where the scene does not say [m]. The slope is that of the ground, or
    /// that in which the anchors lie.
    fn lean(&self, feet: &[Vector3<f64>]) -> f64 {
        let rise = self.ground.map_or(self.table.anchor_rise(), |ground| 0.5 * self.fall(ground, feet).abs());
        let slope = (rise / self.table.anchor_distance).atan();
        self.table.height * (slope - OFF_NORMAL.to_radians()).max(LEAST_LEAN.to_radians()).sin()
    }

    /// Anchors beyond the first and the last post, at `share` of the distance; without ground on the line, drawn out.
    fn beside(&self, feet: &[Vector3<f64>], share: f64) -> Result<[Vector3<f64>; 2], Diagnostic> {
        let last = feet.len() - 1;
        let anchor = |end: usize, next: usize| {
            let out = feet[end] - feet[next];
            let at = feet[end] + out * (share * self.table.side_distance / out.xy().norm());
            self.ground.map_or(Ok(at), |ground| self.on(ground, at.xy(), "an anchor at the side"))
        };
        Ok([anchor(0, 1)?, anchor(last, last - 1)?])
    }

    /// Anchors in the slope above post `k`, a quarter of a field to either side.
    fn upslope(
        &self,
        feet: &[Vector3<f64>],
        down: &[Vector2<f64>],
        k: usize,
    ) -> Result<[Vector3<f64>; 2], Diagnostic> {
        let table = self.table;
        let one = |sign: f64| {
            let beside = match sign < 0.0 {
                true if k > 0 => feet[k - 1] - feet[k],
                true => feet[k] - feet[k + 1],
                false if k + 1 < feet.len() => feet[k + 1] - feet[k],
                false => feet[k] - feet[k - 1],
            };
            let at =
                feet[k] + 0.25 * beside - Vector3::new(down[k].x, down[k].y, 0.0) * table.anchor_distance;
            match self.ground {
                Some(ground) => self.on(ground, at.xy(), &format!("an upslope anchor of post {}", k + 1)),
                None => Ok(at + Vector3::z() * table.anchor_rise()),
            }
        };
        Ok([one(-1.0)?, one(1.0)?])
    }
}

/// Direction of the line at post `k`, as seen from above, halfway between those of the fields beside it.
fn along(feet: &[Vector3<f64>], k: usize) -> Vector2<f64> {
    let way = |a: usize, b: usize| (feet[b] - feet[a]).xy().normalize();
    let last = feet.len() - 1;
    match k {
        0 => way(0, 1),
        k if k == last => way(last - 1, last),
        k => (way(k - 1, k) + way(k, k + 1)).normalize(),
    }
}

/// A quarter turn to the left, as seen from above.
fn left(way: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-way.y, way.x)
}

/// Fields whose bottom rope, straight from foot to foot, the ground leaves far above or below it.
fn off_ground(ground: &Heights, feet: &[Vector3<f64>]) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    for (k, pair) in feet.windows(2).enumerate() {
        let over = (1..LOOKS).filter_map(|look| {
            let at = pair[0] + (pair[1] - pair[0]) * (look as f64 / LOOKS as f64);
            ground.at(at.x, at.y).map(|z| (z - at.z, at))
        });
        let most = over.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        if let Some((over, at)) = most.filter(|(over, _)| over.abs() > OFF_GROUND) {
            let (where_to, so) =
                if over > 0.0 { ("above", "the net hangs in it") } else { ("below", "rocks may pass there") };
            let (a, b, over, x, y) = (k + 1, k + 2, over.abs(), at.x, at.y);
            let what = format!(
                "between posts {a} and {b} the ground lies {over:.2} m {where_to} the bottom rope, at x = {x:.2}, y = {y:.2} m: {so}"
            );
            warnings.push(Diagnostic::warning(code::PLACE, what).about("structure.generator.line"));
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[[f64; 2]]) -> BarrierLine {
        let points = points.iter().map(|p| Vector3::new(p[0], p[1], 0.0)).collect();
        BarrierLine { points, has_heights: false, system: None, key: "line" }
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
        let line = BarrierLine::of(&scene, &table).expect("a line");
        let half = Vector3::new(20.0 * 60.0_f64.to_radians().cos().hypot(0.0) * 3.0_f64.sqrt(), -10.0, 0.0);
        let middle = Vector3::new(100.0, 200.0, 7.0);
        assert!(
            (line.points[1] - middle - half).norm() < 1e-13
                && (line.points[0] - middle + half).norm() < 1e-13
        );
        assert!(line.has_heights);
    }
}
