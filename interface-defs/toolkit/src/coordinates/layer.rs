//! A layer of a map in a GeoJSON file (RFC 7946, and the member `crs` that programs still write).

use super::{AS_GEOJSON, Form};
use crate::explain::nearest;
use geojson::{Feature, FeatureCollection, GeoJson, GeometryValue, Position};
use std::collections::BTreeSet;
use std::path::Path;

/// What is wrong with a file, and what to try.
pub type Refused = (String, Option<String>);

/// Coordinate systems in degrees as GeoJSON names them, without their authority's version.
const DEGREES: [&str; 4] = ["CRS84", "EPSG::4326", "EPSG:4326", "EPSG::4258"];

/// Its features.
pub struct Layer {
    features: Vec<Feature>,
    /// The coordinate system that it names.
    system: Option<String>,
}

impl Layer {
    /// That of the text of a GeoJSON file whose coordinates are not in degrees.
    pub fn read(text: Vec<u8>) -> Result<Self, Refused> {
        let no_geojson = |what: String| (format!("this is no GeoJSON: {what}"), Some(AS_GEOJSON.into()));
        let text = String::from_utf8(text).map_err(|_| no_geojson("it is no text".into()))?;
        // Some programs begin a file with a mark of its encoding.
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let read: GeoJson = text.parse().map_err(|e: geojson::Error| no_geojson(e.to_string()))?;
        let all = match read {
            GeoJson::FeatureCollection(all) => all,
            GeoJson::Feature(feature) => FeatureCollection::new([feature]),
            GeoJson::Geometry(geometry) => {
                FeatureCollection::new([Feature { geometry: Some(geometry), ..Feature::default() }])
            }
        };
        let system = all.foreign_members.as_ref().and_then(|members| {
            members.get("crs")?.get("properties")?.get("name")?.as_str().map(str::to_owned)
        });
        if let Some(system) = &system
            && DEGREES.iter().any(|degrees| system.ends_with(degrees))
        {
            let what = format!(
                "it is in degrees of longitude and latitude ({system}), and the terrain is in metres"
            );
            return Err((what, Some(AS_GEOJSON.into())));
        }
        Ok(Self { features: all.features, system })
    }

    /// EPSG code of the coordinate system that it names.
    pub fn epsg(&self) -> Option<u32> {
        let (authority, code) = self.system.as_deref()?.rsplit_once(':')?;
        authority.contains("EPSG").then(|| code.parse().ok())?
    }

    /// The points of the one feature that is meant, or of all where each point is one for itself. `key` and `file` are what the scene has.
    pub fn points(
        &self,
        form: Form,
        name: Option<&str>,
        (key, file): (&str, &Path),
    ) -> Result<Vec<[f64; 2]>, Refused> {
        let own = named(&self.features, name)?;
        let mut found = Vec::new();
        for feature in &own {
            let Some(geometry) = &feature.geometry else { continue };
            found.extend(parts(&geometry.value, form)?.into_iter().map(|points| (name_of(feature), points)));
        }
        let count = found.len();
        if count == 0 {
            return Err((none_of(&own, form), None));
        }
        if form == Form::Points {
            return Ok(found.into_iter().flat_map(|(_, points)| points).collect());
        }
        if count == 1 {
            return Ok(found.swap_remove(0).1);
        }
        if own.len() == 1 {
            let hint =
                "make a feature of each part (in QGIS: Vector > Geometry Tools > Multipart to Singleparts)";
            let what = format!("the feature has {count} parts; a {} is needed", form.word());
            return Err((what, Some(hint.into())));
        }
        let names: Vec<String> = found.into_iter().filter_map(|(name, _)| name).collect();
        let alone =
            |first: &&String| name.is_none() && names.iter().filter(|name| name == first).count() == 1;
        let hint = match names.first().filter(alone) {
            Some(first) => format!("{key} = {{ file = \"{}\", name = \"{first}\" }}", file.display()),
            None => {
                "give each feature an attribute `name` of its own, or save the one that is meant alone".into()
            }
        };
        let of = if names.is_empty() { String::new() } else { format!(": {}", list(&names)) };
        Err((format!("there are {count} {}s{of}; one is needed", form.word()), Some(hint)))
    }
}

/// The features of this name, at least one.
fn named<'a>(all: &'a [Feature], name: Option<&str>) -> Result<Vec<&'a Feature>, Refused> {
    let Some(name) = name else { return Ok(all.iter().collect()) };
    let own: Vec<&Feature> = all.iter().filter(|f| name_of(f).as_deref() == Some(name)).collect();
    if !own.is_empty() {
        return Ok(own);
    }
    let names: Vec<String> = all.iter().filter_map(name_of).collect();
    let what = match names.is_empty() {
        true if all.is_empty() => "the file has no feature".into(),
        true => format!("none of its {} features has an attribute `name`{}", all.len(), attributes(all)),
        false => format!("no feature is named `{name}`: there are {}", list(&names)),
    };
    Err((what, nearest(name, &names).map(|near| format!("did you mean `{near}`?"))))
}

/// The attributes that there are.
fn attributes(all: &[Feature]) -> String {
    let keys = all.iter().filter_map(|f| f.properties.as_ref()).flat_map(|properties| properties.keys());
    let keys: Vec<String> = keys.collect::<BTreeSet<_>>().into_iter().cloned().collect();
    if keys.is_empty() { String::new() } else { format!("; attributes are {}", list(&keys)) }
}

/// What there is in place of what is needed.
fn none_of(all: &[&Feature], form: Form) -> String {
    let kind = |feature: &&Feature| {
        feature.geometry.as_ref().map_or("a feature without geometry", |geometry| geometry.value.type_name())
    };
    let mut kinds: Vec<String> = all.iter().map(|feature| kind(feature).to_owned()).collect();
    kinds.sort();
    kinds.dedup();
    let what = if kinds.is_empty() {
        "the file has no feature".into()
    } else {
        format!("there is {}", list(&kinds))
    };
    format!("a {} is needed, and {what}", form.word())
}

/// Most names that are listed.
const LISTED: usize = 8;

fn list(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(LISTED).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > LISTED { ", ..." } else { "" };
    shown.join(", ") + more
}

/// Its attribute `name`, of text or a number.
fn name_of(feature: &Feature) -> Option<String> {
    let value = ["name", "Name", "NAME"].iter().find_map(|key| feature.property(key))?;
    let number = || value.as_f64().filter(|number| number.fract() == 0.0).map(|number| number.to_string());
    value.as_str().map(str::to_owned).or_else(number)
}

/// What of this form a geometry holds: each point, each line, each area.
fn parts(geometry: &GeometryValue, form: Form) -> Result<Vec<Vec<[f64; 2]>>, Refused> {
    let line = |positions: &[Position]| positions.iter().map(place).collect::<Result<Vec<_>, _>>();
    match (geometry, form) {
        (GeometryValue::Point { coordinates }, Form::Points) => Ok(vec![vec![place(coordinates)?]]),
        (GeometryValue::MultiPoint { coordinates }, Form::Points) => Ok(vec![line(coordinates)?]),
        (GeometryValue::LineString { coordinates }, Form::Line) => Ok(vec![line(coordinates)?]),
        (GeometryValue::MultiLineString { coordinates }, Form::Line) => {
            coordinates.iter().map(|part| line(part)).collect()
        }
        (GeometryValue::Polygon { coordinates }, Form::Polygon) => Ok(vec![outline(coordinates)?]),
        (GeometryValue::MultiPolygon { coordinates }, Form::Polygon) => {
            coordinates.iter().map(|part| outline(part)).collect()
        }
        (GeometryValue::GeometryCollection { geometries }, _) => {
            let all: Result<Vec<_>, _> = geometries.iter().map(|part| parts(&part.value, form)).collect();
            Ok(all?.concat())
        }
        _ => Ok(Vec::new()),
    }
}

/// Corners of an area; in a file the last is the first again.
fn outline(rings: &[Vec<Position>]) -> Result<Vec<[f64; 2]>, Refused> {
    if rings.len() > 1 {
        let hint = "draw it without holes, or as several polygons";
        return Err(("the polygon has holes".into(), Some(hint.into())));
    }
    let mut corners: Vec<[f64; 2]> = rings.iter().flatten().map(place).collect::<Result<_, _>>()?;
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    Ok(corners)
}

/// Height is left out: the ground has its own.
fn place(position: &Position) -> Result<[f64; 2], Refused> {
    match position.as_slice() {
        [x, y, ..] if x.is_finite() && y.is_finite() => Ok([*x, *y]),
        other => Err((format!("a position of {other:?}: it has x and y"), None)),
    }
}
