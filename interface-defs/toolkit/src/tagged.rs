//! Tables that name what they are under one of their keys, as in `shape = { type = "box", size = [1.0, 1.0, 1.0] }`.
//!
//! serde's own reader of such enums keeps a copy of the table, which knows neither places nor keys. Here the entry with the name
//! is read first, and the others straight from where they stand.

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, VariantAccess, Visitor};
use serde::forward_to_deserialize_any;
use std::fmt;

/// As this struct, whose one field is the key with the name, a tagged table is asked for. The deserialiser of scenes
/// ([`Exact`](crate::exact::Exact)) hands that entry over first; of another it must stand there.
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
/// let table: toml::Table = "radius = 2.0\ntype = \"ball\"".parse().expect("TOML");
/// let solid: Solid = toolkit::scene::read_value("shape", &table.into()).expect("a solid");
/// assert_eq!(toml::to_string(&solid).as_deref(), Ok("type = \"ball\"\nradius = 2.0\n"));
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
        match map.next_key::<String>()? {
            Some(key) if key == self.key => self.visitor.visit_enum(Rest(map)),
            _ => Err(M::Error::missing_field(self.key)),
        }
    }
}

/// What is left of a table whose name is the value at hand.
struct Rest<M>(M);

impl<'de, M: MapAccess<'de>> EnumAccess<'de> for Rest<M> {
    type Error = M::Error;
    type Variant = Self;

    fn variant_seed<S: DeserializeSeed<'de>>(mut self, seed: S) -> Result<(S::Value, Self), M::Error> {
        Ok((self.0.next_value_seed(seed)?, self))
    }
}

impl<'de, M: MapAccess<'de>> VariantAccess<'de> for Rest<M> {
    type Error = M::Error;

    fn unit_variant(mut self) -> Result<(), M::Error> {
        match self.0.next_key::<String>()? {
            Some(key) => Err(M::Error::unknown_field(&key, &[])),
            None => Ok(()),
        }
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, M::Error> {
        seed.deserialize(MapAccessDeserializer::new(self.0))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _length: usize, visitor: V) -> Result<V::Value, M::Error> {
        visitor.visit_map(self.0)
    }

    fn struct_variant<V: Visitor<'de>>(self, _: Names, visitor: V) -> Result<V::Value, M::Error> {
        visitor.visit_map(self.0)
    }
}
