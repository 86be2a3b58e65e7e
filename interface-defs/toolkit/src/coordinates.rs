//! Points of a line or an area: written into the scene, or drawn on a map and saved as GeoJSON.
//!
//! `polygon = [[x, y], ...]`, `polygon = "cliff.geojson"`, `polygon = { file = "sources.geojson", name = "cliff" }` where the file has
//! several. Coordinates are those of the terrain: what a file says to be in degrees is refused.

mod layer;

use super::files;
use super::input_file;
use super::scene::Scene;
use interface_defs::diagnostic::{Diagnostic, code};
use schemars::generate::SchemaGenerator;
use schemars::{JsonSchema, Schema, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;
use std::path::PathBuf;

const AS_GEOJSON: &str =
    "save the layer as GeoJSON (in QGIS: Export > Save Features As), in the coordinate system of the terrain";

interface_defs::worded! {
    /// What the points are.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Form with word {
        /// Each for itself.
        Points = "point",
        /// A line through them.
        Line = "line",
        /// An area around which they lie, closed by itself.
        Polygon = "polygon",
    }
}

/// Points [m], each of type `P`: as they are written, or of a file ([`Coordinates::read`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinates<P = [f64; 2]> {
    points: Vec<P>,
    /// The file that they are to be read from.
    source: Option<Source>,
    /// EPSG code of the layer that they were read from.
    system: Option<u32>,
}

/// A feature of a file, the only one or by its attribute `name`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Source {
    /// GeoJSON, from the directory of the scene.
    file: PathBuf,
    /// Its attribute `name`: text or a whole number.
    #[serde(deserialize_with = "text_or_number")]
    name: Option<String>,
}

impl<P> Deref for Coordinates<P> {
    type Target = [P];

    /// The points; none before the file is read.
    fn deref(&self) -> &[P] {
        &self.points
    }
}

impl<P> From<Vec<P>> for Coordinates<P> {
    fn from(points: Vec<P>) -> Self {
        Self { points, source: None, system: None }
    }
}

impl<P: Clone + From<[f64; 2]>> Coordinates<P> {
    /// Those of the one feature of a file, not read yet.
    pub fn of_file(file: impl Into<PathBuf>) -> Self {
        Self::unread(Source { file: file.into(), name: None })
    }

    /// The same with the points of its file in their place; `key` is where the scene has it.
    ///
    /// # Errors
    /// A file that is not there or no GeoJSON, in degrees, or without exactly one feature of this form.
    pub fn read(&self, form: Form, key: &str, scene: &Scene) -> Result<Self, Diagnostic> {
        let Some(Source { file, name }) = &self.source else { return Ok(self.clone()) };
        let path = scene.resolve(file);
        let text = input_file::read(&path, files::TEXT)
            .map_err(|e| scene.invalid(key, e.headline()).coded(e.code).try_if(e.hint))?;
        let own = key.rsplit('.').next().unwrap_or(key);
        let read = layer::Layer::read(text)
            .and_then(|layer| Ok((layer.points(form, name.as_deref(), (own, file))?, layer.epsg())));
        let (places, system) = read.map_err(|(what, hint)| {
            let what = format!("{}: {what}", file.display());
            scene.invalid(key, what).coded(code::FILE_CONTENT).try_if(hint)
        })?;
        Ok(Self { points: places.into_iter().map(P::from).collect(), source: None, system })
    }
}

impl<P> Coordinates<P> {
    fn unread(source: Source) -> Self {
        Self { points: Vec::new(), source: Some(source), system: None }
    }

    /// EPSG code of the layer that they were read from, if it names one.
    pub fn system(&self) -> Option<u32> {
        self.system
    }

    /// Refuse those of a layer in another coordinate system than that of the terrain, where both are known.
    ///
    /// # Errors
    /// Two codes that differ.
    pub fn check_system(&self, terrain: Option<u32>, key: &str, scene: &Scene) -> Result<(), Diagnostic> {
        match self.system.zip(terrain) {
            Some((own, terrain)) if own != terrain => {
                let what = format!("its layer is in EPSG:{own}, and the terrain in EPSG:{terrain}");
                Err(scene.invalid(key, what).coded(code::PLACE).try_instead(AS_GEOJSON))
            }
            _ => Ok(()),
        }
    }
}

impl<P: Serialize> Serialize for Coordinates<P> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.source {
            None => self.points.serialize(serializer),
            Some(Source { file, name: None }) => file.serialize(serializer),
            Some(named) => named.serialize(serializer),
        }
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
        Vec::deserialize(SeqAccessDeserializer::new(items)).map(Coordinates::from)
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
        Ok(Coordinates::unread(Source { file: text.into(), name: None }))
    }

    fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<Self::Value, A::Error> {
        Source::deserialize(MapAccessDeserializer::new(entries)).map(Coordinates::unread)
    }
}

fn text_or_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    match toml::Value::deserialize(deserializer)? {
        toml::Value::String(text) => Ok(Some(text)),
        toml::Value::Integer(number) => Ok(Some(number.to_string())),
        other => {
            let due = "the attribute `name` of a feature: text or a whole number";
            Err(D::Error::invalid_type(Unexpected::Other(other.type_str()), &due))
        }
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
            "properties": { "file": text, "name": { "type": ["string", "integer"] } },
            "required": ["file", "name"],
            "additionalProperties": false,
        }] })
    }
}

#[cfg(test)]
mod tests;
