//! What can be observed of falls: the quantities of a study that have a name for it.

use crate::path_quantity::{Observable, PATH_QUANTITIES, PathQuantity};
use crate::quantity::{MEMBER_QUANTITIES, MemberQuantity};
use schemars::generate::SchemaGenerator;
use schemars::{JsonSchema, Schema, json_schema};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Value, json};
use std::borrow::Cow;
use std::sync::LazyLock;

/// What was observed of falls, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct What(pub &'static str);

/// All names.
static NAMES: LazyLock<Vec<&str>> = LazyLock::new(|| {
    let of_members = MEMBER_QUANTITIES.iter().filter_map(|it| it.observed);
    let mut names: Vec<&str> = of_members.map(|(name, _)| name).collect();
    for (name, _) in PATH_QUANTITIES.iter().filter_map(|it| it.observed) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
});

impl What {
    fn is(self, observed: Option<Observable>) -> bool {
        observed.is_some_and(|(name, _)| name == self.0)
    }

    /// What it is of a whole fall.
    pub fn of_member(self) -> Option<&'static MemberQuantity> {
        MEMBER_QUANTITIES.iter().find(|it| self.is(it.observed))
    }

    /// What it is where a rock crosses a line.
    pub fn at_line(self) -> Option<&'static PathQuantity> {
        PATH_QUANTITIES.iter().find(|it| self.is(it.observed))
    }

    /// Its unit, and the least value that can be observed.
    pub fn bounds(self) -> (&'static str, f64) {
        let of_member = self.of_member().and_then(|it| Some((it.unit, it.observed?.1)));
        let at_line = || self.at_line().and_then(|it| Some((it.unit, it.observed?.1)));
        of_member.or_else(at_line).unwrap_or_default()
    }

    /// In words.
    fn says(self) -> String {
        match (self.of_member(), self.at_line()) {
            (Some(of), None) => format!("{} [{}].", of.says, of.unit),
            (Some(of), Some(at)) => {
                format!("{} [{}]; at a line: {} at the first crossing.", of.says, of.unit, at.says)
            }
            (None, Some(at)) => format!("{} [{}] at the first crossing of a line.", at.says, at.unit),
            (None, None) => String::new(),
        }
    }
}

impl<'de> Deserialize<'de> for What {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        let known = NAMES.iter().find(|known| **known == name);
        known.map(|known| Self(known)).ok_or_else(|| D::Error::unknown_variant(&name, &NAMES))
    }
}

impl JsonSchema for What {
    fn schema_name() -> Cow<'static, str> {
        "What".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let of = |name: &&'static str| json!({ "type": "string", "const": name, "description": What(name).says() });
        json_schema!({ "description": "What was observed of falls.", "oneOf": NAMES.iter().map(of).collect::<Vec<Value>>() })
    }
}
