//! Reads a value of a scene into a type, and takes every number that it holds or none.
//!
//! The reader of the crate `toml` fills an array of three from a list of four and drops the last: `[0, 0, -9,81]` became
//! a gravity of 9. Here a list must be as long as what is read from it. What is wrong is a [`Mismatch`]: which key it is, what
//! stands there and what was asked for are data.

use super::tagged;
use serde::de::value::StringDeserializer;
use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, Error, Expected as Expectation, IntoDeserializer, MapAccess,
    SeqAccess, Unexpected, Visitor,
};
use serde::forward_to_deserialize_any;
use std::borrow::Cow;
use std::fmt;
use std::ops::Range;
use toml::de::{DeInteger, DeString, DeTable, DeValue};
use toml::{Spanned, Value};

/// What is expected: by the method that a type calls on its deserialiser, or in the words of a visitor that takes several types.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Expected {
    Number,
    Whole,
    WholeNotNegative,
    Bool,
    Text,
    Name,
    Array,
    ArrayOf(usize),
    Table,
    Prose(String),
}

/// What is wrong with a value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum What {
    /// Its name, and those that are known.
    UnknownField(String, Names),
    UnknownVariant(String, Names),
    MissingField(&'static str),
    /// What stands there.
    WrongType(Value, Expected),
    WrongValue(Value, Expected),
    /// How many there are, and what two of them may be: one number that a decimal comma has cut.
    WrongLength(usize, Expected, Option<String>),
    Other(String),
}

type Names = &'static [&'static str];

/// What a visitor makes of a value.
type Made<'de, V> = Result<<V as Visitor<'de>>::Value, Mismatch>;

/// What is wrong, with which key, and where in the text.
#[derive(Debug)]
pub(crate) struct Mismatch {
    pub what: What,
    /// Keys and numbers of items from the value that was read down to the fault, the last first.
    pub path: Vec<String>,
    pub span: Option<Range<usize>>,
}

impl Mismatch {
    fn at(mut self, span: Range<usize>) -> Self {
        self.span.get_or_insert(span);
        self
    }

    fn below(mut self, step: impl ToString) -> Self {
        self.path.push(step.to_string());
        self
    }
}

impl From<What> for Mismatch {
    fn from(what: What) -> Self {
        Self { what, path: Vec::new(), span: None }
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.what.fmt(f)
    }
}

impl std::error::Error for Mismatch {}

impl Error for Mismatch {
    fn custom<T: fmt::Display>(message: T) -> Self {
        What::Other(message.to_string()).into()
    }

    fn invalid_type(got: Unexpected, expected: &dyn Expectation) -> Self {
        What::WrongType(owned(got), Expected::Prose(expected.to_string())).into()
    }

    fn invalid_value(got: Unexpected, expected: &dyn Expectation) -> Self {
        What::WrongValue(owned(got), Expected::Prose(expected.to_string())).into()
    }

    fn invalid_length(found: usize, expected: &dyn Expectation) -> Self {
        What::WrongLength(found, Expected::Prose(expected.to_string()), None).into()
    }

    fn unknown_variant(name: &str, known: Names) -> Self {
        What::UnknownVariant(name.to_owned(), known).into()
    }

    fn unknown_field(name: &str, known: Names) -> Self {
        What::UnknownField(name.to_owned(), known).into()
    }

    fn missing_field(name: &'static str) -> Self {
        What::MissingField(name).into()
    }
}

/// What a visitor was given; places and what lists and tables hold are of no interest.
fn owned(got: Unexpected) -> Value {
    match got {
        Unexpected::Bool(value) => value.into(),
        Unexpected::Signed(number) => number.into(),
        Unexpected::Float(number) => number.into(),
        Unexpected::Seq => Value::Array(Vec::new()),
        Unexpected::Map => Value::Table(toml::Table::new()),
        Unexpected::Str(text) => text.into(),
        other => other.to_string().into(),
    }
}

fn whole(number: &DeInteger) -> Option<i128> {
    i128::from_str_radix(number.as_str(), number.radix()).ok()
}

fn float(text: &str) -> f64 {
    text.parse().expect("a float of TOML is one of the language")
}

/// The key under which the crate `toml` hands a date over, as text.
const DATE: &str = "$__toml_private_datetime";

/// One value of a scene.
pub(crate) struct Exact<'de>(pub Spanned<DeValue<'de>>);

impl<'de> Exact<'de> {
    /// Visit a value that `fits`, and refuse any other.
    fn expect<V: Visitor<'de>>(
        self,
        expected: Expected,
        fits: fn(&DeValue<'de>) -> bool,
        visitor: V,
    ) -> Made<'de, V> {
        if fits(self.0.get_ref()) {
            return self.deserialize_any(visitor);
        }
        Err(self.refused(|got| What::WrongType(got, expected)))
    }

    fn refused(self, what: impl FnOnce(Value) -> What) -> Mismatch {
        let span = self.0.span();
        Value::deserialize(self).map_or_else(|e| e, |got| Mismatch::from(what(got)).at(span))
    }

    fn integer<V: Visitor<'de>>(self, least: i128, most: i128, visitor: V) -> Made<'de, V> {
        let expected = if least < 0 { Expected::Whole } else { Expected::WholeNotNegative };
        if let DeValue::Integer(number) = self.0.get_ref()
            && !whole(number).is_some_and(|value| (least..=most).contains(&value))
        {
            return Err(self.refused(|got| What::WrongValue(got, expected)));
        }
        self.expect(expected, DeValue::is_integer, visitor)
    }
}

fn wrong_length(found: usize, needed: usize, number: Option<String>) -> Mismatch {
    What::WrongLength(found, Expected::ArrayOf(needed), number).into()
}

/// The number that a decimal comma may have cut in a list that is too long.
fn decimal_comma(items: &[Spanned<DeValue>]) -> Option<String> {
    let whole = |item: &Spanned<DeValue>| match item.get_ref() {
        DeValue::Integer(number) if number.radix() == 10 => Some(number.as_str().to_owned()),
        _ => None,
    };
    let numbers: Vec<_> = items.iter().map(whole).collect();
    // Only whole numbers are cut; what stands behind the comma has no sign. Of several the last is shown.
    let cut = |pair: &[Option<String>]| match pair {
        [Some(before), Some(after)] if after.starts_with(|c: char| c.is_ascii_digit()) => {
            Some(format!("{before}.{after}"))
        }
        _ => None,
    };
    numbers.windows(2).rev().find_map(cut)
}

/// Methods that take values of one type.
macro_rules! of_one_type {
    ($($method:ident: $expected:ident, $fits:expr;)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
            self.expect(Expected::$expected, $fits, visitor)
        }
    )*};
}

/// The same for whole numbers.
macro_rules! of_integers {
    ($($method:ident: $integer:ty;)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
            self.integer(<$integer>::MIN.into(), <$integer>::MAX.into(), visitor)
        }
    )*};
}

impl<'de> Deserializer<'de> for Exact<'de> {
    type Error = Mismatch;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
        let span = self.0.span();
        match self.0.into_inner() {
            DeValue::String(Cow::Borrowed(text)) => visitor.visit_borrowed_str(text),
            DeValue::String(Cow::Owned(text)) => visitor.visit_string(text),
            DeValue::Boolean(value) => visitor.visit_bool(value),
            DeValue::Float(number) => visitor.visit_f64(float(number.as_str())),
            DeValue::Integer(number) => {
                let value = whole(&number);
                match (value.and_then(|v| v.try_into().ok()), value.and_then(|v| v.try_into().ok())) {
                    (Some(signed), _) => visitor.visit_i64(signed),
                    (_, Some(unsigned)) => visitor.visit_u64(unsigned),
                    _ => Err(Mismatch::custom(format!("the integer {number} is too large"))),
                }
            }
            DeValue::Array(items) => {
                let mut items = Items(items.into_iter().collect::<Vec<_>>().into_iter(), 0);
                visitor.visit_seq(&mut items).and_then(|value| match items.0.len() {
                    0 => Ok(value),
                    rest => Err(wrong_length(items.1 + rest, items.1, None)),
                })
            }
            DeValue::Table(table) => Entries::of(table, None).visited_by(visitor),
            // As the crate hands a date over; to let it do so would compile every visitor for its reader, too.
            DeValue::Datetime(date) => {
                let key = Spanned::new(span.clone(), DATE.into());
                let value = Spanned::new(span.clone(), DeValue::String(date.to_string().into()));
                Entries::of(DeTable::from_iter([(key, value)]), None).visited_by(visitor)
            }
        }
        .map_err(|e| e.at(span))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _name: &'static str, visitor: V) -> Made<'de, V> {
        visitor.visit_newtype_struct(self)
    }

    /// The reader of the crate takes a list for the fields in their order: `processes = ["a"]` named a program.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: Names,
        visitor: V,
    ) -> Made<'de, V> {
        let span = self.0.span();
        match (name, fields, self.0.into_inner()) {
            (tagged::NAME, [tag], DeValue::Table(table)) => {
                Entries::of(table, Some(tag)).visited_by(visitor).map_err(|e| e.at(span))
            }
            (_, _, value) => {
                Self(Spanned::new(span, value)).expect(Expected::Table, DeValue::is_table, visitor)
            }
        }
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Made<'de, V> {
        if let DeValue::Array(items) = self.0.get_ref()
            && items.len() != length
        {
            let number = decimal_comma(items).filter(|_| items.len() > length);
            return Err(wrong_length(items.len(), length, number).at(self.0.span()));
        }
        self.expect(Expected::ArrayOf(length), DeValue::is_array, visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: Names,
        visitor: V,
    ) -> Made<'de, V> {
        let DeValue::String(text) = self.0.get_ref() else {
            return self.expect(Expected::Name, DeValue::is_str, visitor);
        };
        visitor
            .visit_enum(StringDeserializer::new(text.to_string()))
            .map_err(|e: Mismatch| e.at(self.0.span()))
    }

    of_one_type! {
        deserialize_bool: Bool, DeValue::is_bool;
        deserialize_f32: Number, |value| value.is_float() || value.is_integer();
        deserialize_f64: Number, |value| value.is_float() || value.is_integer();
        deserialize_str: Text, DeValue::is_str;
        deserialize_string: Text, DeValue::is_str;
        deserialize_identifier: Name, DeValue::is_str;
        deserialize_seq: Array, DeValue::is_array;
        deserialize_map: Table, DeValue::is_table;
    }

    of_integers! {
        deserialize_i8: i8;
        deserialize_i16: i16;
        deserialize_i32: i32;
        deserialize_i64: i64;
        deserialize_u8: u8;
        deserialize_u16: u16;
        deserialize_u32: u32;
        deserialize_u64: u64;
    }

    forward_to_deserialize_any! {
        char bytes byte_buf unit unit_struct tuple_struct ignored_any
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
        seed.deserialize(Exact(item)).map(Some).map_err(|e| e.at(span).below(self.1 - 1))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

type Entry<'de> = (Spanned<DeString<'de>>, Spanned<DeValue<'de>>);

/// The entries of a table that are left.
struct Entries<'de> {
    rest: std::vec::IntoIter<Entry<'de>>,
    /// The key that was read last.
    key: Option<Spanned<String>>,
    value: Option<Spanned<DeValue<'de>>>,
}

impl<'de> Entries<'de> {
    /// Those of a table, `first` before all others.
    fn of(table: DeTable<'de>, first: Option<&str>) -> Self {
        let mut entries: Vec<_> = table.into_iter().collect();
        entries.sort_by_key(|(key, _)| first.is_some_and(|first| key.get_ref() != first));
        Self { rest: entries.into_iter(), key: None, value: None }
    }

    fn visited_by<V: Visitor<'de>>(mut self, visitor: V) -> Made<'de, V> {
        visitor.visit_map(&mut self).map_err(|e| self.placed(e))
    }

    /// What a visitor finds wrong with the table, with the key that it means.
    fn placed(self, e: Mismatch) -> Mismatch {
        match (&e.what, self.key) {
            _ if e.span.is_some() => e,
            (What::UnknownField(name, _), Some(key)) if name == key.get_ref() => {
                let span = key.span();
                e.at(span).below(key.into_inner())
            }
            (What::MissingField(name), _) => {
                let name = *name;
                e.below(name)
            }
            _ => e,
        }
    }
}

impl<'de> MapAccess<'de> for &mut Entries<'de> {
    type Error = Mismatch;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Mismatch> {
        let Some((key, value)) = self.rest.next() else { return Ok(None) };
        let name = key.get_ref().to_string();
        (self.key, self.value) = (Some(Spanned::new(key.span(), name.clone())), Some(value));
        let name: StringDeserializer<Mismatch> = name.into_deserializer();
        seed.deserialize(name).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Mismatch> {
        let (Some(value), Some(key)) = (self.value.take(), &self.key) else {
            return Err(Mismatch::custom("a key without its value"));
        };
        let span = value.span();
        seed.deserialize(Exact(value)).map_err(|e| e.at(span).below(key.get_ref()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tagged;
    use serde::{Deserialize, Serialize};

    tagged! {
        #[derive(Debug, PartialEq, Serialize)]
        enum Outline by "type" (rename_all = "snake_case", deny_unknown_fields) {
            Box { size: [f64; 3] },
        }
    }

    tagged! {
        #[derive(Debug, PartialEq, Serialize)]
        enum Mark by "type" (rename_all = "snake_case") {
            Spot(Spot),
        }
    }

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Spot {
        x: f64,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Region {
        at: Option<[f64; 3]>,
        #[serde(default)]
        polygon: Vec<[f64; 2]>,
        shape: Option<Outline>,
        spot: Option<Mark>,
        pair: Option<(String, u8)>,
    }

    fn read(text: &str) -> Result<Region, (String, String)> {
        let table = DeTable::parse(text).expect("TOML");
        let value = Spanned::new(0..text.len(), DeValue::Table(table.into_inner()));
        let at = |e: Mismatch| (e.what.to_string(), text[e.span.expect("a place")].to_owned());
        Region::deserialize(Exact(value)).map_err(at)
    }

    #[test]
    fn a_list_is_as_long_as_what_is_read_from_it() {
        let all = read(
            "at = [1, 2.5, 3]\npolygon = [[0, 1], [2, 3]]\nshape = { type = \"box\", size = [1, 2, 3] }\nspot = { x = 4, type = \"spot\" }\npair = [\"a\", 7]",
        );
        let body = Region {
            at: Some([1.0, 2.5, 3.0]),
            polygon: vec![[0.0, 1.0], [2.0, 3.0]],
            shape: Some(Outline::Box { size: [1.0, 2.0, 3.0] }),
            spot: Some(Mark::Spot(Spot { x: 4.0 })),
            pair: Some(("a".into(), 7)),
        };
        assert_eq!(all, Ok(body));
        let refused = |text: &str, found: usize, needed: usize, place: &str| {
            let (message, at) = read(text).expect_err(text);
            assert_eq!(message, format!("{found} values where {needed} are needed"));
            assert_eq!(at, place);
        };
        refused("at = [0, 0, -9,81]", 4, 3, "[0, 0, -9,81]");
        refused("at = [0, 0]", 2, 3, "[0, 0]");
        refused("polygon = [[0, 1], [2, 3, 4]]", 3, 2, "[2, 3, 4]");
        refused("pair = [\"a\", 7, 8]", 3, 2, "[\"a\", 7, 8]");
        refused("shape = { type = \"box\", size = [1, 2, 3, 4] }", 4, 3, "[1, 2, 3, 4]");
    }

    #[test]
    fn what_is_wrong_is_known_by_type_and_key() {
        let refused = |text: &str, key: &str, what: What| {
            let table = DeTable::parse(text).expect("TOML");
            let value = Spanned::new(0..text.len(), DeValue::Table(table.into_inner()));
            let error = Region::deserialize(Exact(value)).expect_err(text);
            let path: Vec<_> = error.path.into_iter().rev().collect();
            assert_eq!((path.join(".").as_str(), error.what), (key, what), "{text}");
        };
        let wrong = What::WrongType;
        refused("at = [0, true, 0]", "at.1", wrong(true.into(), Expected::Number));
        refused("polygon = [[0, 1], 7]", "polygon.1", wrong(7.into(), Expected::ArrayOf(2)));
        refused(
            "polygon = 1979-05-27",
            "polygon",
            wrong(Value::Datetime("1979-05-27".parse().expect("a date")), Expected::Array),
        );
        refused("pair = [1.5, 2]", "pair.0", wrong(1.5.into(), Expected::Text));
        let value = |number: i64| What::WrongValue(number.into(), Expected::WholeNotNegative);
        refused("pair = [\"a\", 256]", "pair.1", value(256));
        refused("pair = [\"a\", -1]", "pair.1", value(-1));
        refused("shape = 3", "shape", wrong(3.into(), Expected::Table));
        refused("shape = { type = 3 }", "shape.type", wrong(3.into(), Expected::Name));
        refused("shape = { size = [1, 2, 3] }", "shape.type", What::MissingField("type"));
        refused("shape = { type = \"box\" }", "shape.size", What::MissingField("size"));
        let unknown = |name: &str, known| What::UnknownField(name.into(), known);
        let inside = "shape = { size = [1, 2, 3], type = \"box\", colour = 1 }";
        refused(inside, "shape.colour", unknown("colour", &["size"]));
        refused("spot = { z = 1, type = \"spot\", x = 2 }", "spot.z", unknown("z", &["x"]));
        refused("polygons = 1", "polygons", unknown("polygons", &["at", "polygon", "shape", "spot", "pair"]));
        let known = &["box"];
        refused("shape.type = \"bax\"", "shape.type", What::UnknownVariant("bax".into(), known));
    }

    #[test]
    fn a_tagged_table_is_written_with_its_name_first_and_read_wherever_that_stands() {
        let outline = Outline::Box { size: [1.0, 2.0, 3.0] };
        let value = toml::Value::try_from(&outline).expect("a table");
        assert_eq!(value.to_string(), "{ size = [1.0, 2.0, 3.0], type = \"box\" }");
        assert_eq!(crate::scene::read_value("shape", &value), Ok(outline));
        // Of another source than a scene it must come first.
        let mark = "{\"x\": 2.0, \"type\": \"spot\"}";
        assert!(serde_json::from_str::<Mark>(mark).is_err_and(|e| e.to_string().contains("`type`")));
        let spot: Mark = serde_json::from_str("{\"type\": \"spot\", \"x\": 2.0}").expect("a mark");
        assert_eq!(spot, Mark::Spot(Spot { x: 2.0 }));
        assert_eq!(serde_json::to_string(&spot).expect("JSON"), "{\"type\":\"spot\",\"x\":2.0}");
        assert!(serde_json::from_str::<Mark>("{}").is_err_and(|e| e.to_string().contains("`type`")));
    }
}
