//! The layout of a type that is kept, as a number: names, order and kinds of all that is in it.
//!
//! A kept state is bytes without names. The type's own `Deserialize` is followed over made-up values, and what it asks for is
//! noted. An enum is followed once for each of its variants.

use interface_defs::ipc::run_id::fnv1a;
use serde::de::value::Error;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Error as _, IntoDeserializer, MapAccess,
    SeqAccess, VariantAccess, Visitor,
};

/// Times that a type is followed at most; each takes other variants.
const PASSES: usize = 256;
/// Types inside each other at most: one may contain itself.
const DEPTH: u32 = 64;

/// The number of the layout of `S`.
pub fn layout<S: DeserializeOwned>() -> u64 {
    let mut notes = String::new();
    let (mut pass, mut passes) = (0, 1);
    while pass < passes.min(PASSES) {
        let trace = Trace { notes: &mut notes, passes: &mut passes, pass, stride: 1, depth: 0 };
        if S::deserialize(trace).is_err() {
            // A type that checks its values refuses those that are made up: what comes behind it is not seen.
            notes.push('!');
        }
        pass += 1;
    }
    fnv1a(notes.as_bytes())
}

/// What comes of a value.
type Made<'de, V> = Result<<V as Visitor<'de>>::Value, Error>;
type Name = &'static str;
type Names = &'static [&'static str];

struct Trace<'a> {
    notes: &'a mut String,
    /// Passes that are needed to see every variant.
    passes: &'a mut usize,
    pass: usize,
    /// Passes over which the variants of the enums around this place stay the same.
    stride: usize,
    depth: u32,
}

impl Trace<'_> {
    fn note(&mut self, what: &str) {
        self.notes.push_str(what);
        self.notes.push(' ');
    }

    fn inner(&mut self) -> Result<Trace<'_>, Error> {
        if self.depth == DEPTH {
            return Err(Error::custom("it contains itself"));
        }
        let Trace { pass, stride, depth, .. } = *self;
        Ok(Trace { notes: self.notes, passes: self.passes, pass, stride, depth: depth + 1 })
    }

    fn items<'de, V: Visitor<'de>>(mut self, what: &str, count: usize, visitor: V) -> Made<'de, V> {
        self.note(&format!("{what}{count}("));
        let value = visitor.visit_seq(Items { trace: self.inner()?, left: count });
        self.note(")");
        value
    }
}

macro_rules! values {
    ($($method:ident $visit:ident $value:expr;)*) => {$(
        fn $method<V: Visitor<'de>>(mut self, visitor: V) -> Made<'de, V> {
            self.note(stringify!($visit));
            visitor.$visit($value)
        }
    )*};
}

impl<'de> Deserializer<'de> for Trace<'_> {
    type Error = Error;

    values! {
        deserialize_bool visit_bool true;
        deserialize_i8 visit_i8 1;
        deserialize_i16 visit_i16 1;
        deserialize_i32 visit_i32 1;
        deserialize_i64 visit_i64 1;
        deserialize_i128 visit_i128 1;
        deserialize_u8 visit_u8 1;
        deserialize_u16 visit_u16 1;
        deserialize_u32 visit_u32 1;
        deserialize_u64 visit_u64 1;
        deserialize_u128 visit_u128 1;
        deserialize_f32 visit_f32 1.0;
        deserialize_f64 visit_f64 1.0;
        deserialize_char visit_char 'a';
        deserialize_str visit_str "a";
        deserialize_string visit_str "a";
        deserialize_bytes visit_bytes b"a";
        deserialize_byte_buf visit_bytes b"a";
    }

    fn deserialize_option<V: Visitor<'de>>(mut self, visitor: V) -> Made<'de, V> {
        self.note("option");
        visitor.visit_some(self.inner()?)
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
        visitor.visit_unit()
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(self, _: Name, visitor: V) -> Made<'de, V> {
        visitor.visit_unit()
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(mut self, _: Name, visitor: V) -> Made<'de, V> {
        visitor.visit_newtype_struct(self.inner()?)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
        self.items("list", 1, visitor)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Made<'de, V> {
        self.items("tuple", length, visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(self, _: Name, length: usize, visitor: V) -> Made<'de, V> {
        self.items("tuple", length, visitor)
    }

    fn deserialize_map<V: Visitor<'de>>(mut self, visitor: V) -> Made<'de, V> {
        self.note("map");
        visitor.visit_map(Items { trace: self.inner()?, left: 1 })
    }

    fn deserialize_struct<V: Visitor<'de>>(self, _: Name, fields: Names, visitor: V) -> Made<'de, V> {
        self.items(&fields.join(","), fields.len(), visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(mut self, _: Name, variants: Names, visitor: V) -> Made<'de, V> {
        self.note(&variants.join("|"));
        let mut inner = self.inner()?;
        let count = variants.len().max(1);
        let variant = (inner.pass / inner.stride) % count;
        inner.stride = inner.stride.saturating_mul(count);
        *inner.passes = inner.stride.max(*inner.passes);
        visitor.visit_enum(Variant(inner, variant as u32))
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
        self.deserialize_any(visitor)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Made<'de, V> {
        self.deserialize_any(visitor)
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Made<'de, V> {
        Err(Error::custom("bytes without names do not say what they are"))
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

struct Items<'a> {
    trace: Trace<'a>,
    left: usize,
}

impl<'de> SeqAccess<'de> for Items<'_> {
    type Error = Error;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Error> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        self.left = left;
        seed.deserialize(self.trace.inner()?).map(Some)
    }
}

impl<'de> MapAccess<'de> for Items<'_> {
    type Error = Error;

    fn next_key_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Error> {
        self.next_element_seed(seed)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Error> {
        seed.deserialize(self.trace.inner()?)
    }
}

/// A place in an enum, and the number of the variant that is followed.
struct Variant<'a>(Trace<'a>, u32);

impl<'de, 'a> EnumAccess<'de> for Variant<'a> {
    type Error = Error;
    type Variant = Trace<'a>;

    fn variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<(T::Value, Trace<'a>), Error> {
        Ok((seed.deserialize(self.1.into_deserializer())?, self.0))
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
