//! `[terrain]`: the file, what lies where on it, and when a rock has come to its end.

use super::formats::{self, Reader};
use super::system;
use interface_defs::diagnostic::{Diagnostic, code};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use toolkit::coordinates::{Coordinates, Form};
use toolkit::scene::Scene;

/// The terrain, the materials on it, and when a rock is at rest. With it, a run without a structure ends when every rock
/// has come to rest or has left the terrain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TerrainSettings {
    /// The file, from the directory of the scene, of one of [`formats`]. Metres, z upwards.
    #[schemars(description = format!("The file, from the directory of the scene: {}. Metres, z upwards.", formats::described()))]
    pub file: PathBuf,
    /// Cells of a raster without height. Default `refuse`.
    #[serde(default)]
    pub nodata: NoData,
    /// Height [m] that marks cells without height, beside the one that the raster declares.
    pub nodata_value: Option<f64>,
    /// Points of these classes are taken from `.las` and `.laz`; default `[2]`, ground. Empty: all.
    #[serde(default = "ground_class")]
    pub classes: Vec<u8>,
    /// Points: triangles with a longer edge [m] are cut out, such as those across a bay of the outline.
    pub longest_edge: Option<f64>,
    /// Material of everything that no zone names. Default `ground`.
    #[serde(default = "ground_name")]
    pub material: String,
    /// Forest where no zone lies: `open`, `medium` or `dense`, the drag of 20, 35 and 50 m2 of trunks per hectare. It fills in
    /// `forest_drag` and `forest_height`, uncalibrated.
    pub forest: Option<ForestName>,
    /// Drag of that forest on a rock over its velocity [kg/s]. Default: none.
    pub forest_drag: Option<f64>,
    /// Height over the ground up to which it acts on the rock's centre [m]. Default 30.
    pub forest_height: Option<f64>,
    /// Raster of zone numbers, which `[[terrain.zone]]` gives materials by `number`.
    pub zones: Option<PathBuf>,
    /// Materials of parts of the terrain, by polygon or number. Of polygons that overlap the last counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zone: Vec<ZoneSettings>,
    /// Speed [m/s] of the fastest point of a rock below which it may be at rest. Default 0.01.
    #[serde(default = "rest_speed")]
    pub rest_speed: f64,
    /// Time [s] for which it must stay below, touching the terrain. Default 0.5.
    #[serde(default = "rest_time")]
    pub rest_time: f64,
}

/// What to do with cells without height.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoData {
    /// They are an error that says where.
    #[default]
    Refuse,
    /// A hole, through which rocks fall.
    Cut,
}

/// The material of a part of the terrain: exactly one of `polygon` and `number`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZoneSettings {
    /// Its material.
    pub material: String,
    /// Corners `[x, y]` [m], closed by itself, or a GeoJSON file.
    pub polygon: Option<Coordinates>,
    /// Number in the raster `zones`.
    pub number: Option<i64>,
    /// Forest in it, as `terrain.forest`. Default: none, whatever stands around it.
    pub forest: Option<ForestName>,
    /// As `terrain.forest_drag` [kg/s].
    pub forest_drag: Option<f64>,
    /// As `terrain.forest_height` [m].
    pub forest_height: Option<f64>,
}

/// A stand of trees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForestName {
    /// 20 m2 of trunks per hectare: 250 kg/s.
    Open,
    /// 35 m2: 500 kg/s.
    Medium,
    /// 50 m2: 750 kg/s.
    Dense,
}

/// Effective height of a stand where the scene does not say [m].
const FOREST_HEIGHT: f64 = 30.0;

/// Refuse values that do not lie above 0; `place` is the table in which these keys are.
fn positive(scene: &Scene, place: &str, values: &[(&str, Option<f64>)]) -> Result<(), Diagnostic> {
    match values.iter().find_map(|(key, value)| Some((key, value.filter(|v| *v <= 0.0)?))) {
        Some((key, v)) => {
            Err(scene.invalid(&format!("{place}.{key}"), format!("{key} = {v}: it must lie above 0")))
        }
        None => Ok(()),
    }
}

/// Fill in what `forest` names; what the user must know of it.
fn plant(
    place: &str,
    (name, drag, height): (Option<ForestName>, &mut Option<f64>, &mut Option<f64>),
    scene: &Scene,
) -> Result<Option<Diagnostic>, Diagnostic> {
    positive(scene, place, &[("forest_drag", *drag), ("forest_height", *height)])?;
    if let Some(name) = name {
        drag.get_or_insert(name.drag());
    }
    if drag.is_none() && height.is_some() {
        let what = "`forest_height` without `forest_drag` does nothing";
        return scene.refuse(&format!("{place}.forest_height"), what, "write forest = \"medium\"");
    }
    if drag.is_some() {
        height.get_or_insert(FOREST_HEIGHT);
    }
    Ok(name.map(|_| {
        let what = "its drag is uncalibrated: calibrate it on falls that were measured at the site (RAMMS)";
        Diagnostic::warning(code::TRUST, what).about(format!("{place}.forest"))
    }))
}

fn ground_class() -> Vec<u8> {
    vec![2]
}

fn ground_name() -> String {
    "ground".into()
}

/// Speed below which a rock may be at rest, if nothing else is said [m/s].
pub fn rest_speed() -> f64 {
    0.01
}

/// Time for which it must stay below, if nothing else is said [s].
pub fn rest_time() -> f64 {
    0.5
}

/// Speed at which nothing is at rest [m/s].
const FAST: f64 = 1.0;
/// Most materials on one terrain.
const MOST_MATERIALS: usize = 255;

impl TerrainSettings {
    /// Those of a scene, with the corners of zones that are in files in their place, checked.
    pub fn of(scene: &Scene) -> Result<Option<Self>, Diagnostic> {
        let Some(mut settings) = scene.read::<Self>("terrain")? else { return Ok(None) };
        for (i, zone) in settings.zone.iter_mut().enumerate() {
            if let Some(polygon) = &mut zone.polygon {
                *polygon = polygon.read(Form::Polygon, &format!("terrain.zone.{i}.polygon"), scene)?;
            }
        }
        settings.check(scene)?;
        Ok(Some(settings))
    }

    /// Refuse zones of a layer in another coordinate system than the terrain's file names.
    pub fn check_layers(&self, scene: &Scene) -> Result<(), Diagnostic> {
        let own = system::of_file(&scene.resolve(&self.file)).map(u32::from);
        for (i, zone) in self.zone.iter().enumerate() {
            if let Some(polygon) = &zone.polygon {
                polygon.check_system(own, &format!("terrain.zone.{i}.polygon"), scene)?;
            }
        }
        Ok(())
    }

    /// Fill in what the names of forests stand for; what the user must know of them.
    pub fn plant(&mut self, scene: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
        let own = (self.forest, &mut self.forest_drag, &mut self.forest_height);
        let mut notes: Vec<Diagnostic> = plant("terrain", own, scene)?.into_iter().collect();
        for (i, zone) in self.zone.iter_mut().enumerate() {
            let of_zone = (zone.forest, &mut zone.forest_drag, &mut zone.forest_height);
            notes.extend(plant(&format!("terrain.zone.{i}"), of_zone, scene)?);
        }
        Ok(notes)
    }

    /// Refuse keys that the file leaves without use.
    fn check_use(&self, scene: &Scene) -> Result<(), Diagnostic> {
        let reader = formats::reader(&self.file);
        let raster = matches!(reader, Some(Reader::Raster(_)));
        let classified = matches!(reader, Some(Reader::ClassifiedPoints(_)));
        let points = classified || matches!(reader, Some(Reader::Points(_)));
        let numbered = self.zone.iter().any(|zone| zone.number.is_some());
        let idle = [
            ("nodata", self.nodata != NoData::default() && !raster, "belongs to rasters"),
            ("nodata_value", self.nodata_value.is_some() && !raster, "belongs to rasters"),
            ("classes", self.classes != ground_class() && !classified, "belongs to .las and .laz"),
            ("longest_edge", self.longest_edge.is_some() && !points, "belongs to points"),
            ("zones", self.zones.is_some() && !numbered, "gives numbers that no [[terrain.zone]] has"),
        ];
        match idle.into_iter().find(|(_, idle, _)| *idle) {
            Some((key, _, why)) => Err(scene
                .invalid(&format!("terrain.{key}"), format!("`{key}` {why}: nothing will use it"))
                .coded(code::UNUSED_KEY)
                .try_instead(format!("leave `{key}` out"))),
            None => Ok(()),
        }
    }

    /// Refuse what makes no sense.
    pub fn check(&self, scene: &Scene) -> Result<(), Diagnostic> {
        let (speed, time) = (Some(self.rest_speed), Some(self.rest_time));
        let lengths = [("rest_speed", speed), ("rest_time", time), ("longest_edge", self.longest_edge)];
        positive(scene, "terrain", &lengths)?;
        if self.rest_speed > FAST {
            let what = format!("rest_speed = {} m/s: a rock that fast is not at rest", self.rest_speed);
            return scene.refuse(
                "terrain.rest_speed",
                what,
                format!("it is written in m/s: 10 mm/s is {}", rest_speed()),
            );
        }
        self.check_use(scene)?;
        if self.zone.len() > MOST_MATERIALS {
            let what = format!("{} zones: {MOST_MATERIALS} are possible", self.zone.len());
            return Err(scene.invalid("terrain.zone", what));
        }
        for (i, zone) in self.zone.iter().enumerate() {
            let refuse = |name: &str, what: String| scene.invalid(&format!("terrain.zone.{i}.{name}"), what);
            match (&zone.polygon, zone.number) {
                (Some(_), Some(_)) => {
                    let what = "polygon and number together define one thing twice";
                    return Err(refuse("number", what.into()).try_instead("keep one of them"));
                }
                (None, None) => {
                    let what = "the zone has neither polygon nor number: it lies nowhere";
                    return Err(refuse("material", what.into()));
                }
                (Some(corners), None) if corners.len() < 3 => {
                    let what = format!("{} corners span no area: 3 are needed", corners.len());
                    return Err(refuse("polygon", what));
                }
                (None, Some(number)) if self.zones.is_none() => {
                    let what = format!("zone number {number} without a raster of zone numbers");
                    let cure = "write zones = \"zones.asc\" under [terrain], or a polygon";
                    return Err(refuse("number", what).try_instead(cure));
                }
                _ => {}
            }
        }
        Ok(())
    }
}
