//! Tables that name what they are under one of their keys, as in `shape = { type = "box", size = [1.0, 1.0, 1.0] }`.
//!
//! serde's own reader of such enums keeps a copy of the table, which knows neither places nor keys. Here the entry with the name
//! is read first, and the others straight from where they stand.

use serde::de::value::MapAccessDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;
use std::fmt;

/// As this struct, whose one field is the key with the name, a tagged table is asked for. A deserialiser that knows it hands that
/// entry over first.
pub(crate) const NAME: &str = "$tagged";

/// Declares an enum that a table names under the key `$tag`; behind that stand further attributes of serde.
///
/// ```
/// toolkit::tagged! {
///     /// A solid.
///     #[derive(Debug, serde::Serialize)]
///     pub enum Solid by "type" (rename_all = "snake_case", deny_unknown_fields) {
///         /// A ball.
///         Ball { radius: f64 },
///     }
/// }
/// let solid: Solid = toml::from_str("radius = 2.0\ntype = \"ball\"")?;
/// assert_eq!(toml::to_string(&solid).as_deref(), Ok("type = \"ball\"\nradius = 2.0\n"));
/// # Ok::<(), toml::de::Error>(())
/// ```
#[macro_export]
macro_rules! tagged {
    ($(#[$about:meta])* $vis:vis enum $name:ident by $tag:literal ($($options:tt)*) { $($variants:tt)* }) => {
        $(#[$about])*
        #[serde(tag = $tag, $($options)*)]
        $vis enum $name { $($variants)* }

        const _: () = {
            type Whole = $name;

            // Without the tag it is read through `deserialize_enum`, to which `Tagged` hands the table over.
            #[derive(::serde::Deserialize)]
            #[serde(remote = "Whole", $($options)*)]
            #[allow(dead_code)]
            enum Untagged { $($variants)* }

            impl<'de> ::serde::Deserialize<'de> for $name {
                fn deserialize<D: ::serde::Deserializer<'de>>(table: D) -> Result<Self, D::Error> {
                    Untagged::deserialize($crate::tagged::Tagged { table, key: &[$tag] })
                }
            }
        };
    };
}

type Names = &'static [&'static str];

/// A table as the enum that its entry `key` names. It is what [`tagged!`](crate::tagged) reads from.
pub struct Tagged<D> {
    /// The table.
    pub table: D,
    /// Its key with the name.
    pub key: &'static [&'static str; 1],
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Tagged<D> {
    type Error = D::Error;

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: Names,
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.table.deserialize_struct(NAME, self.key, AsEnum { visitor, key: self.key[0] })
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.table.deserialize_any(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}

struct AsEnum<V> {
    visitor: V,
    key: &'static str,
}

impl<'de, V: Visitor<'de>> Visitor<'de> for AsEnum<V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a table with `{}`", self.key)
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<V::Value, M::Error> {
        let mut before = Vec::new();
        while let Some(key) = map.next_key::<String>()? {
            if key == self.key {
                let rest = Rest { before: before.into_iter(), value: None, map };
                return self.visitor.visit_enum(rest);
            }
            before.push((key, map.next_value()?));
        }
        Err(M::Error::missing_field(self.key))
    }
}

/// What is left of a table whose name is the value at hand.
struct Rest<M> {
    /// What stood before the name, where a deserialiser hands over entries in its own order.
    before: std::vec::IntoIter<(String, toml::Value)>,
    value: Option<toml::Value>,
    map: M,
}

impl<'de, M: MapAccess<'de>> EnumAccess<'de> for Rest<M> {
    type Error = M::Error;
    type Variant = Self;

    fn variant_seed<S: DeserializeSeed<'de>>(mut self, seed: S) -> Result<(S::Value, Self), M::Error> {
        Ok((self.map.next_value_seed(seed)?, self))
    }
}

impl<'de, M: MapAccess<'de>> MapAccess<'de> for Rest<M> {
    type Error = M::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, M::Error> {
        let Some((key, value)) = self.before.next() else { return self.map.next_key_seed(seed) };
        self.value = Some(value);
        seed.deserialize(key.into_deserializer()).map(Some)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, M::Error> {
        match self.value.take() {
            Some(value) => seed.deserialize(value).map_err(M::Error::custom),
            None => self.map.next_value_seed(seed),
        }
    }
}

impl<'de, M: MapAccess<'de>> VariantAccess<'de> for Rest<M> {
    type Error = M::Error;

    fn unit_variant(mut self) -> Result<(), M::Error> {
        match self.next_key::<String>()? {
            Some(key) => Err(M::Error::unknown_field(&key, &[])),
            None => Ok(()),
        }
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, M::Error> {
        seed.deserialize(MapAccessDeserializer::new(self))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _length: usize, visitor: V) -> Result<V::Value, M::Error> {
        visitor.visit_map(self)
    }

    fn struct_variant<V: Visitor<'de>>(self, _: Names, visitor: V) -> Result<V::Value, M::Error> {
        visitor.visit_map(self)
    }
}
