//! A barrier on the terrain: where its feet, heads and anchors lie.
//!
//! Posts stand on the ground at their x and y, anchors lie on it; what is not stated comes from a raster of heights. The line is
//! taken so that the slope rises to its right: then along, down the slope and up are right-handed, as in the barrier's own axes.

use super::line::Line;
use crate::config::generator::{Barrier, Side};
use crate::read::heights::Heights;
use crate::read::refuse;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::{Vector2, Vector3};
use toolkit::scene::Scene;

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

/// Where a barrier stands.
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
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
}

impl Site {
    /// That of a barrier with a line.
    pub fn of(scene: &Scene, table: &Barrier) -> Result<Self, Diagnostic> {
        let line = Line::of(scene, table)?;
        let ground = ground(scene, table, &line)?;
        let place = Place { scene, table, line: &line, ground: ground.as_ref() };
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
fn ground(scene: &Scene, table: &Barrier, line: &Line) -> Result<Option<Heights>, Diagnostic> {
    let key = "structure.generator.ground";
    let Some(path) = &table.ground else {
        if line.has_heights {
            return Ok(None);
        }
        let what = "points of two numbers stand on the ground, and its heights are not known here";
        return Err(scene.invalid(line.key, what).try_instead(
            "name a raster with ground = \"FILE.asc\", or write [x, y, z]; in a scene with [terrain], `rockfall run` and `rockfall \
             check` make the raster",
        ));
    };
    if line.has_heights {
        let what = "the line has heights of its own: nothing will use the ground";
        return refuse(scene, key, what, "leave out the third number of each point, or ground");
    }
    Heights::read(scene, key, path).map(Some)
}

/// Everything that says where.
struct Place<'a> {
    scene: &'a Scene,
    table: &'a Barrier,
    line: &'a Line,
    ground: Option<&'a Heights>,
}

impl Place<'_> {
    fn site(&self) -> Result<Site, Diagnostic> {
        let mut feet = self.line.posts(self.table.fields);
        if let Some(ground) = self.ground {
            for (k, foot) in feet.iter_mut().enumerate() {
                *foot = self.on(ground, foot.xy(), &format!("post {}", k + 1))?;
            }
        }
        if self.uphill(&feet)? == Side::Left {
            feet.reverse();
        }
        let down: Vec<Vector2<f64>> = (0..feet.len()).map(|k| left(along(&feet, k))).collect();
        let lean = self.table.lean.unwrap_or_else(|| self.lean(&feet));
        let rise = (self.table.height.powi(2) - lean.powi(2)).sqrt();
        let posts = down.iter().map(|d| Vector3::new(d.x, d.y, 0.0) * lean + Vector3::z() * rise).collect();
        let sides = [self.beside(&feet, 0.5)?, self.beside(&feet, 1.0)?];
        let upslope = (0..feet.len()).map(|k| self.upslope(&feet, &down, k)).collect::<Result<_, _>>()?;
        let warnings = self.ground.map_or_else(Vec::new, |ground| off_ground(ground, &feet));
        Ok(Site { feet, posts, sides, upslope, warnings })
    }

    /// The point of the ground there.
    fn on(&self, ground: &Heights, at: Vector2<f64>, what: &str) -> Result<Vector3<f64>, Diagnostic> {
        let hint = "move the line to the terrain, with the anchors beside and above it";
        let height = ground.below(at.x, at.y, what);
        let height = height.or_else(|what| refuse(self.scene, self.line.key, what, hint))?;
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
            return refuse(self.scene, self.line.key, what, hint);
        };
        let away = self.table.anchor_distance;
        let mean = self.fall(ground, feet);
        if mean.abs() < 2.0 * SLOPE * away {
            let what = format!(
                "{away} m to its left the ground lies {mean:.2} m higher than to its right: no slope says where rocks come from"
            );
            return refuse(self.scene, self.line.key, what, hint);
        }
        Ok(if mean > 0.0 { Side::Left } else { Side::Right })
    }

    /// How much higher the ground lies an anchor's distance to the left of the line than to its right, on average [m].
    fn fall(&self, ground: &Heights, feet: &[Vector3<f64>]) -> f64 {
        let rise = |k: usize, sign: f64| {
            let at = feet[k].xy() + left(along(feet, k)) * (sign * self.table.anchor_distance);
            ground.at(at.x, at.y).map_or(0.0, |z| z - feet[k].z)
        };
        (0..feet.len()).map(|k| rise(k, 1.0) - rise(k, -1.0)).sum::<f64>() / feet.len() as f64
    }

    /// How far heads lie down the slope of the feet where the scene does not say [m]. The slope is that of the ground, or
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
