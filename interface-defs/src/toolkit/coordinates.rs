//! Points of a line or an area: written into the scene, or drawn on a map and saved as GeoJSON.
//!
//! `polygon = [[x, y], ...]`, `polygon = "cliff.geojson"`, `polygon = { file = "sources.geojson", name = "cliff" }` where the file has
//! several. Coordinates are those of the terrain: what a file says to be in degrees is refused.

mod layer;

use super::input_error::InputError;
use super::input_file;
use super::scene::Scene;
use schemars::generate::SchemaGenerator;
use schemars::{JsonSchema, Schema, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;
use std::path::PathBuf;

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
        let found = layer::features(&path).and_then(|all| layer::points(&all, form, name, (key, file)));
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

#[cfg(test)]
mod tests;
