//! Which material lies where: polygons in the scene, or a raster of zone numbers.

use super::forest::Forest;
use super::formats;
use super::raster::Raster;
use super::settings::TerrainSettings;
use dem_solid::geometry::plan;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use toolkit::scene::Scene;

/// The zones of a terrain, in local coordinates. Zone 0 is everything else.
#[derive(Debug, Clone, Default)]
pub struct Zones {
    /// Materials by zone.
    pub materials: Vec<String>,
    /// Forests by zone.
    pub forests: Vec<Option<Forest>>,
    /// Corners, place of the material, number in the scene.
    polygons: Vec<(Vec<[f64; 2]>, u8, usize)>,
    raster: Option<Raster>,
    numbers: Vec<(i64, u8)>,
}

/// Refuse polygons that cross themselves, or lie beside the terrain, from `low` to `high`. Once for a terrain: the scenes of all members of a
/// study have the same.
pub fn check_polygons(
    scene: &Scene,
    settings: &TerrainSettings,
    [low, high]: [Vector3<f64>; 2],
) -> Result<(), Diagnostic> {
    for (number, zone) in settings.zone.iter().enumerate() {
        let Some(corners) = zone.polygon.as_deref() else { continue };
        let key = format!("terrain.zone.{number}.polygon");
        plan::check_polygon(corners, &key, scene)?;
        let range = |axis: usize| {
            let along = corners.iter().map(|c| c[axis]);
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
        };
        let [[x0, x1], [y0, y1]] = [range(0), range(1)];
        if x1 < low.x || x0 > high.x || y1 < low.y || y0 > high.y {
            let what = format!(
                "it covers nothing: it lies from ({x0:.1}, {y0:.1}) to ({x1:.1}, {y1:.1}), and the terrain from ({:.1}, {:.1}) to \
                 ({:.1}, {:.1})",
                low.x, low.y, high.x, high.y
            );
            return scene.refuse(&key, what, "corners are [x, y] in the terrain's coordinates, in metres; leave the zone out where it lies elsewhere");
        }
    }
    Ok(())
}

impl Zones {
    /// Those of a scene whose terrain has the origin `origin`.
    pub fn of(scene: &Scene, settings: &TerrainSettings, origin: &Vector3<f64>) -> Result<Self, Diagnostic> {
        let materials = vec![settings.material.clone()];
        let forests = vec![Forest::of(settings.forest_drag, settings.forest_height)];
        let mut zones = Self { materials, forests, ..Self::default() };
        for (number, zone) in settings.zone.iter().enumerate() {
            let forest = Forest::of(zone.forest_drag, zone.forest_height);
            let known = zones.materials.iter().zip(&zones.forests);
            let same = known.into_iter().position(|(m, f)| *m == zone.material && *f == forest);
            let place = same.unwrap_or_else(|| {
                zones.materials.push(zone.material.clone());
                zones.forests.push(forest);
                zones.materials.len() - 1
            }) as u8;
            if let Some(corners) = &zone.polygon {
                let local = corners.iter().map(|[x, y]| [x - origin.x, y - origin.y]).collect();
                zones.polygons.push((local, place, number));
            }
            if let Some(number) = zone.number {
                zones.numbers.push((number, place));
            }
        }
        if let Some(file) = &settings.zones {
            let mut raster = formats::raster(&scene.resolve(file))?;
            raster.corner = [raster.corner[0] - origin.x, raster.corner[1] - origin.y];
            zones.raster = Some(raster);
        }
        Ok(zones)
    }

    /// Refuse polygons without the middle of a triangle in them, whose middles these are: nothing would be of their material.
    pub fn check_use<I: Iterator<Item = Vector3<f64>>>(
        &self,
        scene: &Scene,
        middles: impl Fn() -> I,
    ) -> Result<(), Diagnostic> {
        for (corners, _, number) in &self.polygons {
            if !middles().any(|middle| contains(corners, middle.x, middle.y)) {
                let what = "it covers nothing: no triangle of the terrain has its middle in it, by which it belongs to a zone or not";
                return scene.refuse(
                    &format!("terrain.zone.{number}.polygon"),
                    what,
                    "draw it larger than a cell of the terrain, or leave it out",
                );
            }
        }
        Ok(())
    }

    /// True if everything is zone 0.
    pub fn is_empty(&self) -> bool {
        self.polygons.is_empty() && self.numbers.is_empty()
    }

    /// Zone at a local position; polygons count before the raster, the last one before the others.
    pub fn at(&self, position: &Vector3<f64>) -> u8 {
        let polygon =
            self.polygons.iter().rev().find(|(corners, ..)| contains(corners, position.x, position.y));
        if let Some((_, zone, _)) = polygon {
            return *zone;
        }
        let number = self.raster.as_ref().and_then(|raster| raster.nearest(position.x, position.y));
        let zone =
            |n: f64| self.numbers.iter().find(|(number, _)| *number as f64 == n).map(|(_, zone)| *zone);
        number.and_then(zone).unwrap_or(0)
    }
}

/// True if the polygon holds the point: the number of borders to the east of it is odd.
fn contains(corners: &[[f64; 2]], x: f64, y: f64) -> bool {
    let mut inside = false;
    let mut from = corners[corners.len() - 1];
    for &to in corners {
        if (from[1] > y) != (to[1] > y) && x < (to[0] - from[0]) * (y - from[1]) / (to[1] - from[1]) + from[0]
        {
            inside = !inside;
        }
        from = to;
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_polygon_counts_then_the_raster_then_the_rest() {
        let square = |a: f64, b: f64| vec![[a, a], [b, a], [b, b], [a, b]];
        let zones = Zones {
            materials: ["ground", "scree", "wood", "rock"].map(String::from).into(),
            forests: vec![None; 4],
            polygons: vec![(square(0.0, 4.0), 1, 0), (square(2.0, 6.0), 2, 1)],
            raster: Some(Raster {
                corner: [10.0, 0.0],
                spacing: [2.0; 2],
                counts: [2, 2],
                heights: vec![7.0, 8.0, 9.0, f64::NAN],
            }),
            numbers: vec![(7, 3), (9, 1)],
        };
        let at = |x, y| zones.at(&Vector3::new(x, y, 50.0));
        assert_eq!([at(1.0, 1.0), at(3.0, 3.0), at(5.0, 5.0), at(8.0, 8.0)], [1, 2, 2, 0]);
        // North-west has 7, north-east 8 without a material, south-west 9, south-east nothing.
        assert_eq!([at(9.1, 2.9), at(12.0, 2.0), at(10.0, -0.9), at(12.0, 0.0)], [3, 0, 1, 0]);
    }
}
