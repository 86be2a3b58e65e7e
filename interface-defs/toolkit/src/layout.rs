//! The layout of a type that is kept, as a number: names, order and kinds of all that is in it.
//!
//! A kept state is bytes without names. The type's own `Deserialize` is followed over made-up values, and what it asks for is
//! noted. An enum is followed once for each of its variants.

use interface_defs::ipc::run_id::fnv1a;
use serde::de::value::{Error, MapDeserializer, SeqDeserializer, U32Deserializer};
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Error as _, IntoDeserializer, VariantAccess,
    Visitor,
};
use serde::forward_to_deserialize_any;
use std::cell::RefCell;
use std::iter::{once, repeat_n};

/// Times that a type is followed at most; each takes other variants.
const PASSES: usize = 256;
/// Types inside each other at most: one may contain itself.
const DEPTH: u32 = 64;

/// The number of the layout of `S`.
pub fn layout<S: DeserializeOwned>() -> u64 {
    // What was asked for, and the passes that are needed to see every variant.
    let seen = RefCell::new((String::new(), 1));
    let mut pass = 0;
    while pass < seen.borrow().1.min(PASSES) {
        if S::deserialize(Trace { seen: &seen, pass, stride: 1, depth: 0 }).is_err() {
            // A type that checks its values refuses those that are made up: what comes behind it is not seen.
            seen.borrow_mut().0.push('!');
        }
        pass += 1;
    }
    fnv1a(seen.borrow().0.as_bytes())
}

/// What comes of a value.
type Made<'de, V> = Result<<V as Visitor<'de>>::Value, Error>;
type Names = &'static [&'static str];

/// A place in a type.
#[derive(Clone, Copy)]
struct Trace<'a> {
    seen: &'a RefCell<(String, usize)>,
    pass: usize,
    /// Passes over which the variants of the enums around this place stay the same.
    stride: usize,
    depth: u32,
}

impl<'a> Trace<'a> {
    /// Note what is asked for here; returns the places inside of it.
    fn note(self, what: &str) -> Result<Self, Error> {
        let notes = &mut self.seen.borrow_mut().0;
        notes.push_str(what);
        notes.push(' ');
        match self.depth {
            DEPTH => Err(Error::custom("it contains itself")),
            depth => Ok(Self { depth: depth + 1, ..self }),
        }
    }

    fn items<'de, V: Visitor<'de>>(self, what: &str, count: usize, visitor: V) -> Made<'de, V> {
        let inner = self.note(&format!("{what}{count}("))?;
        let value = visitor.visit_seq(SeqDeserializer::new(repeat_n(inner, count)))?;
        self.note(")")?;
        Ok(value)
    }
}

impl<'de> IntoDeserializer<'de, Error> for Trace<'_> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

macro_rules! values {
    ($($method:ident($($name:ident)?) $visit:ident $value:expr;)*) => {$(
        fn $method<V: Visitor<'de>>(self, $($name: &'static str,)? visitor: V) -> Made<'de, V> {
            let inner = self.note(stringify!($visit))?;
            visitor.$visit($value(inner))
        }
    )*};
}

impl<'de> Deserializer<'de> for Trace<'_> {
    type Error = Error;

    values! {
        deserialize_bool() visit_bool |_| true;
        deserialize_i8() visit_i8 |_| 1;
        deserialize_i16() visit_i16 |_| 1;
        deserialize_i32() visit_i32 |_| 1;
        deserialize_i64() visit_i64 |_| 1;
        deserialize_u8() visit_u8 |_| 1;
        deserialize_u16() visit_u16 |_| 1;
        deserialize_u32() visit_u32 |_| 1;
        deserialize_u64() visit_u64 |_| 1;
        deserialize_f32() visit_f32 |_| 1.0;
        deserialize_f64() visit_f64 |_| 1.0;
        deserialize_char() visit_char |_| 'a';
        deserialize_str() visit_str |_| "a";
        deserialize_string() visit_str |_| "a";
        deserialize_option() visit_some |inner| inner;
        deserialize_newtype_struct(_name) visit_newtype_struct |inner| inner;
        deserialize_map() visit_map |inner| MapDeserializer::new(once((inner, inner)));
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
        self.items("list", 1, visitor)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Made<'de, V> {
        self.items("tuple", length, visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        length: usize,
        visitor: V,
    ) -> Made<'de, V> {
        self.items("tuple", length, visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(self, _: &'static str, fields: Names, visitor: V) -> Made<'de, V> {
        self.items(&fields.join(","), fields.len(), visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(self, _: &'static str, variants: Names, visitor: V) -> Made<'de, V> {
        let inner = self.note(&variants.join("|"))?;
        let count = variants.len().max(1);
        let stride = inner.stride.saturating_mul(count);
        let passes = stride.max(self.seen.borrow().1);
        self.seen.borrow_mut().1 = passes;
        let variant = (inner.pass / inner.stride) % count;
        visitor.visit_enum(Variant(Trace { stride, ..inner }, variant as u32))
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Made<'de, V> {
        Err(Error::custom("bytes without names do not say what they are"))
    }

    fn is_human_readable(&self) -> bool {
        false
    }

    forward_to_deserialize_any! { i128 u128 bytes byte_buf unit unit_struct identifier ignored_any }
}

/// A place in an enum, and the number of the variant that is followed.
struct Variant<'a>(Trace<'a>, u32);

impl<'de, 'a> EnumAccess<'de> for Variant<'a> {
    type Error = Error;
    type Variant = Trace<'a>;

    fn variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<(T::Value, Trace<'a>), Error> {
        Ok((seed.deserialize(U32Deserializer::new(self.1))?, self.0))
    }
}

impl<'de> VariantAccess<'de> for Trace<'_> {
    type Error = Error;

    fn unit_variant(self) -> Result<(), Error> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Error> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Made<'de, V> {
        self.items("tuple", length, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(self, fields: Names, visitor: V) -> Made<'de, V> {
        self.items(&fields.join(","), fields.len(), visitor)
    }
}

#[cfg(test)]
mod tests {
    #![allow(dead_code)]
    use super::*;
    use serde::Deserialize;
    use std::collections::BTreeMap;

    macro_rules! kept {
        ($name:ident { $($field:ident: $kind:ty),* }) => {{
            #[derive(Deserialize)]
            struct $name { $($field: $kind),* }
            layout::<$name>()
        }};
    }

    #[test]
    fn a_renamed_added_or_retyped_field_is_another_layout_and_the_name_of_the_type_is_none() {
        let base = kept!(A { mass: f64, at: [f64; 3], count: Option<u32> });
        assert_eq!(base, kept!(B { mass: f64, at: [f64; 3], count: Option<u32> }));
        let others = [
            kept!(A { weight: f64, at: [f64; 3], count: Option<u32> }),
            kept!(A { at: [f64; 3], mass: f64, count: Option<u32> }),
            kept!(A { mass: f64, at: [f64; 2], count: Option<u32> }),
            kept!(A { mass: f64, at: [f64; 3], count: Option<i32> }),
            kept!(A { mass: f64, at: [f64; 3], count: u32 }),
            kept!(A { mass: f64, at: Vec<f64>, count: Option<u32> }),
            kept!(A { mass: f64, at: [f64; 3], count: Option<u32>, more: bool }),
            kept!(A { mass: f64, at: [f64; 3], count: BTreeMap<u32, u32> }),
        ];
        for (i, other) in others.iter().enumerate() {
            assert_ne!(*other, base, "{i}");
        }
    }

    #[test]
    fn every_variant_of_an_enum_in_an_enum_is_seen() {
        macro_rules! of {
            ($inner:ty) => {{
                #[derive(Deserialize)]
                enum Inner {
                    First,
                    Second(u8),
                    Third { deep: $inner },
                }
                #[derive(Deserialize)]
                enum Outer {
                    One(f64),
                    Two { inner: Vec<Inner> },
                }
                layout::<(Outer, u8)>()
            }};
        }
        assert_eq!(of!(f64), of!(f64));
        assert_ne!(of!(f64), of!(f32));
    }

    #[test]
    fn a_type_that_contains_itself_has_a_layout() {
        #[derive(Deserialize)]
        struct Tree {
            value: f64,
            branches: Vec<Tree>,
        }
        assert_eq!(layout::<Tree>(), layout::<Tree>());
        assert_ne!(layout::<Tree>(), layout::<Vec<f64>>());
    }
}
