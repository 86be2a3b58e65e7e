//! `[[contact]]` is one flat table: the keys that all laws have, and those of the law that it names.

use super::normal::LawName;
use super::presets;
use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Visitor};
use serde::forward_to_deserialize_any;
use std::fmt;
use std::sync::OnceLock;

/// The key that fills in others.
const PRESET: &str = "preset";

/// Names of a law's own keys.
pub fn of(law: LawName) -> Vec<String> {
    let schema = law.keys();
    let properties = schema.get("properties").and_then(|all| all.as_object());
    properties.map(|all| all.keys().cloned().collect()).unwrap_or_default()
}

/// The law that has this key for its own.
pub fn owner(key: &str) -> Option<LawName> {
    LawName::ALL.iter().copied().find(|law| of(*law).iter().any(|own| own == key))
}

/// The keys that `[[contact]]` may have: `fields`, and those of every law.
fn known(fields: &'static [&'static str]) -> &'static [&'static str] {
    static KNOWN: OnceLock<Vec<&'static str>> = OnceLock::new();
    let own = || LawName::ALL.iter().flat_map(|law| of(*law)).map(|key| &*key.leak());
    KNOWN.get_or_init(|| fields.iter().copied().chain(own()).collect())
}

/// Reads a table into a struct, and sets aside in `own` what belongs to laws.
pub struct Split<'a, D> {
    /// The table.
    pub table: D,
    /// What belongs to laws.
    pub own: &'a mut toml::Table,
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Split<'_, D> {
    type Error = D::Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.table.deserialize_map(Entries { visitor, fields, own: self.own })
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.table.deserialize_any(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

struct Entries<'a, V> {
    visitor: V,
    fields: &'static [&'static str],
    own: &'a mut toml::Table,
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Entries<'_, V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.visitor.expecting(f)
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<V::Value, M::Error> {
        let state = Filling::default();
        self.visitor.visit_map(Common { map, fields: self.fields, own: self.own, state })
    }
}

/// The entries that all laws have, then those that a preset adds.
struct Common<'a, M> {
    map: M,
    fields: &'static [&'static str],
    own: &'a mut toml::Table,
    state: Filling,
}

/// What is known of a table with `preset`.
#[derive(Default)]
struct Filling {
    /// Keys of the table.
    given: Vec<String>,
    preset: Option<String>,
    /// What the preset adds, once the table is read.
    added: Option<std::vec::IntoIter<(String, toml::Value)>>,
    /// The value of the key at hand, where it is not in the table or was read to be looked at.
    value: Option<toml::Value>,
}

impl<'de, M: MapAccess<'de>> MapAccess<'de> for Common<'_, M> {
    type Error = M::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, M::Error> {
        while let Some(key) = self.map.next_key::<String>()? {
            self.state.given.push(key.clone());
            if key == PRESET {
                let preset: String = self.map.next_value()?;
                self.state.value = Some(preset.clone().into());
                self.state.preset = Some(preset);
            }
            if self.fields.contains(&key.as_str()) {
                return seed.deserialize(key.into_deserializer()).map(Some);
            }
            if owner(&key).is_none() {
                return Err(M::Error::unknown_field(&key, known(self.fields)));
            }
            let value = self.map.next_value()?;
            self.own.insert(key, value);
        }
        let Filling { given, preset: Some(preset), added, value } = &mut self.state else { return Ok(None) };
        for (key, number) in added.get_or_insert_with(|| presets::fill(preset, given).into_iter()) {
            if self.fields.contains(&key.as_str()) {
                *value = Some(number);
                return seed.deserialize(key.into_deserializer()).map(Some);
            }
            self.own.insert(key, number);
        }
        Ok(None)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, M::Error> {
        match self.state.value.take() {
            Some(value) => seed.deserialize(value).map_err(M::Error::custom),
            None => self.map.next_value_seed(seed),
        }
    }
}
