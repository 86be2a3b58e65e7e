//! Points of a line or an area: written into the scene, or drawn on a map and saved as GeoJSON.
//!
//! `polygon = [[x, y], ...]`, `polygon = "cliff.geojson"`, `polygon = { file = "sources.geojson", name = "cliff" }` where the file has
//! several. Coordinates are those of the terrain: what a file says to be in degrees is refused.

use super::explain::nearest;
use super::input_error::InputError;
use super::input_file;
use super::scene::Scene;
use geojson::{Feature, FeatureCollection, GeoJson, GeometryValue, Position};
use schemars::generate::SchemaGenerator;
use schemars::{JsonSchema, Schema, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// What the points are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Each for itself.
    Points,
    /// A line through them.
    Line,
    /// An area around which they lie, closed by itself.
    Polygon,
}

/// Points [m] as they are written, each of type `P`, or the file that has them ([`Coordinates::read`]).
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Coordinates<P = [f64; 2]> {
    /// The points.
    Stated(Vec<P>),
    /// A file with one feature.
    File(PathBuf),
    /// A feature of a file.
    Feature(NamedFeature),
}

/// A feature of a file by the attribute `name`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedFeature {
    /// GeoJSON, from the directory of the scene.
    pub file: PathBuf,
    /// Its attribute `name`.
    pub name: String,
}

impl<P> Deref for Coordinates<P> {
    type Target = [P];

    /// The points; none before the file is read.
    fn deref(&self) -> &[P] {
        match self {
            Self::Stated(points) => points,
            Self::File(_) | Self::Feature(_) => &[],
        }
    }
}

impl<P> From<Vec<P>> for Coordinates<P> {
    fn from(points: Vec<P>) -> Self {
        Self::Stated(points)
    }
}

impl<P: Clone + From<[f64; 2]>> Coordinates<P> {
    /// The same with the points of its file in their place; `key` is where the scene has it.
    ///
    /// # Errors
    /// A file that is not there or no GeoJSON, in degrees, or without exactly one feature of this form.
    pub fn read(&self, form: Form, key: &str, scene: &Scene) -> Result<Self, InputError> {
        let (file, name) = match self {
            Self::Stated(_) => return Ok(self.clone()),
            Self::File(file) => (file, None),
            Self::Feature(feature) => (&feature.file, Some(feature.name.as_str())),
        };
        let refuse = |what: String| scene.invalid(key, format!("{}: {what}", file.display()));
        let path = scene.resolve(file);
        input_file::regular(&path).map_err(|e| {
            let refused = scene.invalid(key, e.headline());
            if let Some(hint) = e.hint() { refused.try_instead(hint) } else { refused }
        })?;
        let key = key.rsplit('.').next().unwrap_or(key);
        let found = features(&path).and_then(|all| chosen(&all, form, name, (key, file)));
        let places = found.map_err(|(what, hint)| refuse(what).try_if(hint))?;
        Ok(Self::Stated(places.into_iter().map(P::from).collect()))
    }
}

impl<'de, P: Deserialize<'de>> Deserialize<'de> for Coordinates<P> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AsWritten(PhantomData))
    }
}

/// By its type: not `untagged`, whose errors do not say what is wrong in a list of points.
struct AsWritten<P>(PhantomData<P>);

impl<'de, P: Deserialize<'de>> Visitor<'de> for AsWritten<P> {
    type Value = Coordinates<P>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("points [[x, y], ...], or the name of a GeoJSON file")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Self::Value, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(items)).map(Coordinates::Stated)
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
        Ok(Coordinates::File(text.into()))
    }

    fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<Self::Value, A::Error> {
        NamedFeature::deserialize(MapAccessDeserializer::new(entries)).map(Coordinates::Feature)
    }
}

impl<P: JsonSchema> JsonSchema for Coordinates<P> {
    fn schema_name() -> Cow<'static, str> {
        format!("Coordinates_of_{}", P::schema_name()).into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let points = generator.subschema_for::<Vec<P>>();
        let text = json_schema!({ "type": "string" });
        json_schema!({ "anyOf": [points, text, {
            "type": "object",
            "properties": { "file": text, "name": text },
            "required": ["file", "name"],
            "additionalProperties": false,
        }] })
    }
}

/// What is wrong with a file, and what to try.
type Refused = (String, Option<String>);

/// Coordinate systems in degrees as GeoJSON names them, without their authority's version.
const DEGREES: [&str; 4] = ["CRS84", "EPSG::4326", "EPSG:4326", "EPSG::4258"];
const AS_GEOJSON: &str =
    "save the layer as GeoJSON (in QGIS: Export > Save Features As), in the coordinate system of the terrain";

fn features(path: &Path) -> Result<Vec<Feature>, Refused> {
    let text = std::fs::read(path).map_err(|e| (format!("the file cannot be read: {e}"), None))?;
    let no_geojson = |what: String| (format!("this is no GeoJSON: {what}"), Some(AS_GEOJSON.into()));
    let text = String::from_utf8(text).map_err(|_| no_geojson("it is no text".into()))?;
    let read: GeoJson = text.parse().map_err(|e: geojson::Error| no_geojson(e.to_string()))?;
    let all = match read {
        GeoJson::FeatureCollection(all) => all,
        GeoJson::Feature(feature) => FeatureCollection::new([feature]),
        GeoJson::Geometry(geometry) => {
            FeatureCollection::new([Feature { geometry: Some(geometry), ..Feature::default() }])
        }
    };
    let system = all
        .foreign_members
        .as_ref()
        .and_then(|members| members.get("crs")?.get("properties")?.get("name")?.as_str().map(str::to_owned));
    if let Some(system) = system.filter(|system| DEGREES.iter().any(|degrees| system.ends_with(degrees))) {
        let what =
            format!("it is in degrees of longitude and latitude ({system}), and the terrain is in metres");
        return Err((what, Some(AS_GEOJSON.into())));
    }
    Ok(all.features)
}

/// The points of the one feature that is meant, or of all where each point is one for itself.
fn chosen(
    all: &[Feature],
    form: Form,
    name: Option<&str>,
    (key, file): (&str, &Path),
) -> Result<Vec<[f64; 2]>, Refused> {
    let names: Vec<String> = all.iter().filter_map(name_of).collect();
    let own: Vec<&Feature> =
        all.iter().filter(|f| name.is_none_or(|name| name_of(f).as_deref() == Some(name))).collect();
    if let Some(name) = name.filter(|_| own.is_empty()) {
        let what = match names.is_empty() {
            true => format!("none of its {} features has an attribute `name`", all.len()),
            false => format!("no feature is named `{name}`: there are {}", list(&names)),
        };
        return Err((what, nearest(name, &names).map(|near| format!("did you mean `{near}`?"))));
    }
    let mut found = Vec::new();
    for feature in &own {
        let Some(geometry) = &feature.geometry else { continue };
        found.extend(parts(&geometry.value, form)?.into_iter().map(|points| (name_of(feature), points)));
    }
    let what = match form {
        Form::Points => "point",
        Form::Line => "line",
        Form::Polygon => "polygon",
    };
    match found.len() {
        0 => {
            let kinds = own.iter().map(|f| f.geometry.as_ref().map_or("nothing", |g| g.value.type_name()));
            let mut kinds: Vec<String> = kinds.map(str::to_owned).collect();
            kinds.dedup();
            Err((format!("a {what} is needed, and there is none; features are: {}", list(&kinds)), None))
        }
        _ if form == Form::Points => Ok(found.into_iter().flat_map(|(_, points)| points).collect()),
        1 => Ok(found.swap_remove(0).1),
        count => {
            let named: Vec<String> = found.iter().filter_map(|(name, _)| name.clone()).collect();
            let hint = match named
                .first()
                .filter(|first| name.is_none() && named.iter().filter(|n| n == first).count() == 1)
            {
                Some(first) => format!("{key} = {{ file = \"{}\", name = \"{first}\" }}", file.display()),
                None => {
                    "give each feature an attribute `name` of its own, or save the one that is meant alone"
                        .into()
                }
            };
            let of = if named.is_empty() { String::new() } else { format!(": {}", list(&named)) };
            Err((format!("there are {count} {what}s{of}; one is needed"), Some(hint)))
        }
    }
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
    let value = feature.property("name").or_else(|| feature.property("Name"))?;
    value.as_str().map(str::to_owned).or_else(|| value.as_i64().map(|number| number.to_string()))
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

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "[[[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]]";

    fn feature(name: &str, kind: &str, coordinates: &str) -> String {
        let properties = if name.is_empty() { "{}".into() } else { format!("{{\"name\": {name}}}") };
        format!(
            "{{\"type\": \"Feature\", \"properties\": {properties}, \"geometry\": {{\"type\": \"{kind}\", \"coordinates\": \
             {coordinates}}}}}"
        )
    }

    fn collection(system: &str, features: &[String]) -> String {
        let crs = match system {
            "" => String::new(),
            system => {
                format!("\"crs\": {{\"type\": \"name\", \"properties\": {{\"name\": \"{system}\"}}}}, ")
            }
        };
        format!("{{\"type\": \"FeatureCollection\", {crs}\"features\": [{}]}}", features.join(", "))
    }

    /// What `it = VALUE` holds beside a file `a.geojson` of this text.
    fn read(value: &str, form: Form, text: &str) -> Result<Vec<[f64; 2]>, String> {
        let dir = tempfile::tempdir().expect("a directory");
        std::fs::write(dir.path().join("a.geojson"), text).expect("written");
        let file = dir.path().join("s.toml");
        std::fs::write(&file, format!("[custom]\nit = {value}\n")).expect("written");
        let scene = Scene::load(&file, &[]).expect("TOML");
        let table: std::collections::BTreeMap<String, Coordinates> =
            scene.read("custom").map_err(|e| e.to_string())?.expect("there");
        let read = table["it"].read(form, "custom.it", &scene).map_err(|e| e.to_string());
        read.map(|points| points.to_vec()).map_err(|e| e.replace(&format!("{}/", dir.path().display()), ""))
    }

    #[test]
    fn points_are_those_that_are_written_or_those_of_the_file() {
        let square = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
        let written = "[[0, 0], [4.0, 0], [4, 3], [0, 3]]";
        assert_eq!(read(written, Form::Polygon, "").as_ref(), Ok(&square));
        let one = collection("urn:ogc:def:crs:EPSG::2056", &[feature("", "Polygon", SQUARE)]);
        for text in [
            one.clone(),
            feature("", "MultiPolygon", &format!("[{SQUARE}]")),
            format!("{{\"type\": \"Polygon\", \"coordinates\": {SQUARE}}}"),
            // Beside features of another form.
            collection("", &[feature("", "Point", "[9, 9]"), feature("", "Polygon", SQUARE)]),
        ] {
            assert_eq!(read("\"a.geojson\"", Form::Polygon, &text).as_ref(), Ok(&square), "{text}");
        }
        let line = feature("", "LineString", "[[1, 2, 700.5], [3, 4.25, 701]]");
        assert_eq!(read("\"a.geojson\"", Form::Line, &line), Ok(vec![[1.0, 2.0], [3.0, 4.25]]));
        let points = [feature("", "MultiPoint", "[[1, 2], [3, 4]]"), feature("", "Point", "[5, 6]")];
        let due = vec![[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]];
        assert_eq!(read("\"a.geojson\"", Form::Points, &collection("", &points)), Ok(due));
        let (west, east) =
            (feature("\"west\"", "Polygon", "[[[9, 9], [8, 9], [8, 8]]]"), feature("7", "Polygon", SQUARE));
        let both = collection("", &[west, east]);
        let of = |name: &str| {
            read(&format!("{{ file = \"a.geojson\", name = \"{name}\" }}"), Form::Polygon, &both)
        };
        assert_eq!(of("west"), Ok(vec![[9.0, 9.0], [8.0, 9.0], [8.0, 8.0]]));
        assert_eq!(of("7"), Ok(square));
    }

    #[test]
    fn what_is_not_one_feature_of_the_form_is_refused_with_what_to_try() {
        let west = feature("\"west\"", "Polygon", SQUARE);
        let both = collection("", &[west.clone(), feature("\"east\"", "Polygon", SQUARE)]);
        let holes = feature("", "Polygon", "[[[0, 0], [4, 0], [4, 3]], [[1, 1], [2, 1], [2, 2]]]");
        let bare = [feature("", "Polygon", SQUARE), feature("", "Polygon", SQUARE)];
        let line = feature("", "LineString", "[[1, 2], [3, 4]]");
        let degrees = "urn:ogc:def:crs:OGC:1.3:CRS84";
        let file = "\"a.geojson\"";
        let named = |name: &str| format!("{{ file = \"a.geojson\", name = \"{name}\" }}");
        for (value, text, what, hint) in [
            (
                file,
                &both,
                "there are 2 polygons: `west`, `east`; one is needed",
                "it = { file = \"a.geojson\", name = \"west\" }",
            ),
            (
                file,
                &collection("", &bare),
                "there are 2 polygons; one is needed",
                "give each feature an attribute `name`",
            ),
            (file, &holes, "the polygon has holes", "draw it without"),
            (file, &line, "a polygon is needed, and there is none; features are: `LineString`", ""),
            (
                file,
                &collection(degrees, std::slice::from_ref(&west)),
                "it is in degrees of longitude and latitude (urn:",
                "system of the terrain",
            ),
            (file, &"PK\u{3}\u{4}".to_owned(), "this is no GeoJSON", "Export"),
            (file, &"{\"type\": \"Polygon\"}".to_owned(), "this is no GeoJSON", "Export"),
            (
                &named("wset"),
                &both,
                "no feature is named `wset`: there are `west`, `east`",
                "did you mean `west`?",
            ),
            (&named("a"), &collection("", &bare), "none of its 2 features has an attribute `name`", ""),
            (
                "\"b.geojson\"",
                &west,
                "b.geojson: there is no such file",
                "did you mean a.geojson, which lies there?",
            ),
            ("[[1, 2], [3]]", &west, "1", "2"),
            ("{ file = \"a.geojson\", nam = \"x\" }", &west, "nam", "name"),
            ("4", &west, "points [[x, y], ...], or the name of a GeoJSON file", ""),
        ] {
            let refused = read(value, Form::Polygon, text).expect_err(value);
            assert!(
                refused.contains("s.toml:2:") && refused.contains(what) && refused.contains(hint),
                "{refused}"
            );
        }
    }
}
