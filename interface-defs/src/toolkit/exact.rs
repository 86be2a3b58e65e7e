//! Reads a value of a scene into a type, and takes every number that it holds or none.
//!
//! The reader of the crate `toml` fills an array of three from a list of four and drops the last: `[0, 0, -9,81]` became
//! a gravity of 9. Here a list must be as long as what is read from it.

use serde::de::value::StringDeserializer;
use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;
use std::fmt;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue, ValueDeserializer};

/// What is wrong, and where in the text.
#[derive(Debug)]
pub(crate) struct Mismatch {
    pub message: String,
    pub span: Option<Range<usize>>,
}

impl Mismatch {
    fn at(mut self, span: Range<usize>) -> Self {
        self.span.get_or_insert(span);
        self
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Mismatch {}

impl Error for Mismatch {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self { message: message.to_string(), span: None }
    }
}

impl From<toml::de::Error> for Mismatch {
    fn from(error: toml::de::Error) -> Self {
        Self { message: error.message().to_owned(), span: error.span() }
    }
}

/// One value of a scene.
pub(crate) struct Exact<'de>(pub Spanned<DeValue<'de>>);

impl<'de> Exact<'de> {
    fn tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, Mismatch> {
        if let DeValue::Array(items) = self.0.get_ref()
            && items.len() != length
        {
            return Err(wrong_length(items.len(), length).at(self.0.span()));
        }
        self.deserialize_any(visitor)
    }
}

/// The words that `explain` knows.
fn wrong_length(found: usize, needed: usize) -> Mismatch {
    Mismatch::custom(format!("invalid length {found}, expected an array of length {needed}"))
}

impl<'de> Deserializer<'de> for Exact<'de> {
    type Error = Mismatch;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mismatch> {
        let span = self.0.span();
        match self.0.into_inner() {
            DeValue::Array(items) => {
                let mut items = Items(items.into_iter().collect::<Vec<_>>().into_iter(), 0);
                visitor.visit_seq(&mut items).and_then(|value| match items.0.len() {
                    0 => Ok(value),
                    rest => Err(wrong_length(items.1 + rest, items.1)),
                })
            }
            DeValue::Table(table) => visitor.visit_map(Entries::of(table)),
            leaf => Ok(ValueDeserializer::from(Spanned::new(span.clone(), leaf)).deserialize_any(visitor)?),
        }
        .map_err(|e| e.at(span))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mismatch> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        visitor.visit_newtype_struct(self)
    }

    /// The reader of the crate takes a list for the fields in their order: `processes = ["a"]` named a program.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        if let DeValue::Array(_) = self.0.get_ref() {
            return Err(Mismatch::custom("invalid type: sequence, expected a map").at(self.0.span()));
        }
        self.deserialize_any(visitor)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, Mismatch> {
        self.tuple(length, visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        self.tuple(length, visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        let span = self.0.span();
        let read = ValueDeserializer::from(self.0).deserialize_enum(name, variants, visitor);
        read.map_err(|e| Mismatch::from(e).at(span))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf unit unit_struct seq map
        identifier ignored_any
    }
}

/// The items of a list that are left, and how many were taken.
struct Items<'de>(std::vec::IntoIter<Spanned<DeValue<'de>>>, usize);

impl<'de> SeqAccess<'de> for &mut Items<'de> {
    type Error = Mismatch;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Mismatch> {
        let Some(item) = self.0.next() else { return Ok(None) };
        self.1 += 1;
        let span = item.span();
        seed.deserialize(Exact(item)).map(Some).map_err(|e| e.at(span))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

type Entry<'de> = (Spanned<DeString<'de>>, Spanned<DeValue<'de>>);

/// The entries of a table that are left.
struct Entries<'de> {
    rest: std::vec::IntoIter<Entry<'de>>,
    value: Option<Spanned<DeValue<'de>>>,
}

impl<'de> Entries<'de> {
    fn of(table: DeTable<'de>) -> Self {
        Self { rest: table.into_iter().collect::<Vec<_>>().into_iter(), value: None }
    }
}

impl<'de> MapAccess<'de> for Entries<'de> {
    type Error = Mismatch;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Mismatch> {
        let Some((key, value)) = self.rest.next() else { return Ok(None) };
        self.value = Some(value);
        let span = key.span();
        let name: StringDeserializer<Mismatch> = key.into_inner().into_owned().into_deserializer();
        seed.deserialize(name).map(Some).map_err(|e| e.at(span))
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Mismatch> {
        let value = self.value.take().ok_or_else(|| Mismatch::custom("a key without its value"))?;
        let span = value.span();
        seed.deserialize(Exact(value)).map_err(|e| e.at(span))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(tag = "type", rename_all = "snake_case")]
    enum Outline {
        Box { size: [f64; 3] },
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Region {
        at: Option<[f64; 3]>,
        #[serde(default)]
        polygon: Vec<[f64; 2]>,
        shape: Option<Outline>,
        pair: Option<(String, u8)>,
    }

    fn read(text: &str) -> Result<Region, (String, String)> {
        let table = DeTable::parse(text).expect("TOML");
        let value = Spanned::new(0..text.len(), DeValue::Table(table.into_inner()));
        let at = |e: Mismatch| (e.message, text[e.span.expect("a place")].to_owned());
        Region::deserialize(Exact(value)).map_err(at)
    }

    #[test]
    fn a_list_is_as_long_as_what_is_read_from_it() {
        let all = read(
            "at = [1, 2.5, 3]\npolygon = [[0, 1], [2, 3]]\nshape = { type = \"box\", size = [1, 2, 3] }\npair = [\"a\", 7]",
        );
        let body = Region {
            at: Some([1.0, 2.5, 3.0]),
            polygon: vec![[0.0, 1.0], [2.0, 3.0]],
            shape: Some(Outline::Box { size: [1.0, 2.0, 3.0] }),
            pair: Some(("a".into(), 7)),
        };
        assert_eq!(all, Ok(body));
        let refused = |text: &str, length: &str, place: &str| {
            let (message, at) = read(text).expect_err(text);
            assert!(message.contains(length), "{message}");
            assert_eq!(at, place);
        };
        refused("at = [0, 0, -9,81]", "invalid length 4, expected an array of length 3", "[0, 0, -9,81]");
        refused("at = [0, 0]", "invalid length 2, expected an array of length 3", "[0, 0]");
        refused("polygon = [[0, 1], [2, 3, 4]]", "invalid length 3", "[2, 3, 4]");
        refused("pair = [\"a\", 7, 8]", "invalid length 3", "[\"a\", 7, 8]");
        // A tagged table is read from a copy without places.
        let (message, _) = read("shape = { type = \"box\", size = [1, 2, 3, 4] }").expect_err("four");
        assert!(message.contains("invalid length 4"), "{message}");
    }
}
