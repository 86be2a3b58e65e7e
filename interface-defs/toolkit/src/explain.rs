//! What a `Mismatch` is in the user's words, with what to try and the nearest known name.

use super::exact::{Expected, Mismatch, What};
use super::numbers::short;
use super::words::has_comma;
use interface_defs::diagnostic::{Code, Diagnostic, code};
use serde::de::Unexpected;
use std::fmt;
use toml::de::DeValue;
use toml::{Spanned, Value};

/// A value as serde describes it.
fn described(value: &Value) -> String {
    match value {
        Value::Boolean(value) => Unexpected::Bool(*value),
        Value::Integer(number) => Unexpected::Signed(*number),
        Value::Float(number) => Unexpected::Float(*number),
        Value::String(text) => Unexpected::Str(text),
        Value::Datetime(_) => Unexpected::Other("date"),
        Value::Array(_) => Unexpected::Seq,
        Value::Table(_) => Unexpected::Map,
    }
    .to_string()
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Number => "a number",
            Self::Whole => "a whole number",
            Self::WholeNotNegative => "a whole number, not negative",
            Self::Bool => "a boolean",
            Self::Text => "a string",
            Self::Name => "a name",
            Self::Array => "an array",
            Self::ArrayOf(length) => return write!(f, "an array of length {length}"),
            Self::Table => "a table",
            Self::Prose(words) => words,
        })
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::UnknownField(name, _) => write!(f, "unknown key `{name}`"),
            Self::UnknownVariant(name, _) => write!(f, "unknown value `{name}`"),
            Self::MissingField(name) => write!(f, "the key `{name}` is missing here"),
            Self::WrongType(got, expected) => {
                write!(f, "wrong type: {}, expected {expected}", described(got))
            }
            Self::WrongValue(got, expected) => {
                write!(f, "wrong value: {}, expected {expected}", described(got))
            }
            Self::WrongLength(found, Expected::ArrayOf(needed), _) => {
                write!(f, "{found} values where {needed} are needed")
            }
            Self::WrongLength(found, expected, _) => write!(f, "{found} values, expected {expected}"),
            Self::Other(words) => f.write_str(words),
        }
    }
}

impl What {
    fn code(&self) -> Code {
        match self {
            Self::UnknownField(..) => code::UNKNOWN_KEY,
            Self::UnknownVariant(..) => code::UNKNOWN_NAME,
            Self::MissingField(_) => code::MISSING_KEY,
            Self::WrongType(..) => code::WRONG_TYPE,
            Self::WrongLength(..) => code::WRONG_LENGTH,
            Self::WrongValue(..) | Self::Other(_) => code::INVALID_VALUE,
        }
    }
}

impl Mismatch {
    /// For the user, about the value at the dotted key `key` or below it; `top` are the keys that stand at the top of a scene.
    pub fn diagnostic(&self, key: &str, top: &[&str]) -> Diagnostic {
        let own = Some(key).filter(|key| !key.is_empty());
        let at =
            own.into_iter().chain(self.path.iter().rev().map(String::as_str)).collect::<Vec<_>>().join(".");
        Diagnostic::error(self.what.code(), self.what.to_string()).about(at).try_if(self.hint(key, top))
    }

    fn hint(&self, key: &str, top: &[&str]) -> Option<String> {
        match &self.what {
            What::UnknownField(name, _) if top.contains(&name.as_str()) => Some(format!(
                "`{name}` belongs to the scene, not to `{key}`: it must come before the first [table]; or are these two scenes?"
            )),
            What::UnknownField(name, known) | What::UnknownVariant(name, known) => of_reference(name, known),
            What::MissingField(name) => Some(format!(
                "add `{name} = ...` to this table; docs/reference.md has its keys and their units"
            )),
            What::WrongType(Value::Table(_), Expected::Array) => {
                let names = self.path.iter().rev().filter(|name| !is_item(name));
                let names: String = names.map(|name| format!(".{name}")).collect();
                Some(format!("there may be several of them, so brackets are double: [[{key}{names}]]"))
            }
            What::WrongType(got, expected) => {
                let name = self.path.first().filter(|name| !is_item(name));
                name.and_then(|name| as_table(name, got, expected)).or_else(|| of_type(got, expected))
            }
            What::WrongLength(_, _, Some(number)) => {
                Some(format!("a decimal comma? a number is written with a point: {number}"))
            }
            What::WrongLength(found, Expected::ArrayOf(needed), None) if found < needed => {
                let fewer = match needed {
                    2 => "write two numbers, as in [1.0, 2.0]",
                    3 => "a vector has three numbers, [x, y, z]",
                    4 => {
                        "a quaternion has four, [w, x, y, z]: no turn is [1, 0, 0, 0], an angle a in radians about z is \
                         [cos(a/2), 0, 0, sin(a/2)]"
                    }
                    _ => return None,
                };
                Some(fewer.into())
            }
            _ => None,
        }
    }
}

/// Whether a step of a path leads to an item of a list.
fn is_item(step: &str) -> bool {
    step.parse::<usize>().is_ok()
}

/// A unit in those of a scene; `None` of one that is not known here.
fn in_si(unit: &str) -> Option<f64> {
    Some(match unit {
        "m" | "kg" | "s" | "N" | "Pa" | "J" | "m/s" | "N/m" | "rad" => 1.0,
        "us" | "um" => 1e-6,
        "ms" | "mm" | "g" | "mm/s" => 1e-3,
        "cm" => 1e-2,
        "kN" | "kPa" | "kJ" | "km" | "t" | "kN/m" => 1e3,
        "MN" | "MPa" | "MJ" => 1e6,
        "GPa" => 1e9,
        "km/h" => 1.0 / 3.6,
        _ => return None,
    })
}

/// What to try where a value is of another type.
fn of_type(got: &Value, expected: &Expected) -> Option<String> {
    let text = got.as_str().map(str::trim);
    match expected {
        Expected::Number | Expected::Whole | Expected::WholeNotNegative => {
            let text = text?;
            if has_comma(text.as_bytes()) {
                let number = text.replace(',', ".");
                return Some(format!("a decimal comma? a number is written with a point: {number}"));
            }
            let digits = text
                .trim_end_matches(|c: char| c.is_alphanumeric() && !c.is_ascii_digit() || "/%*^".contains(c));
            if text.parse::<f64>().is_ok() {
                return Some(format!("write a number without quotes: {text}"));
            }
            let (number, unit) = (digits.trim_end().parse::<f64>().ok()?, text[digits.len()..].trim());
            let shown = in_si(unit)
                .map_or_else(|| " (m, kg, s, N, Pa)".into(), |of| format!(": {}", short(number * of)));
            Some(format!("write a number without quotes and without its unit, in SI units{shown}"))
        }
        Expected::ArrayOf(count) => {
            let listed = text.filter(|t| t.split(',').all(|n| n.trim().parse::<f64>().is_ok()));
            let shown = match (listed, count) {
                (Some(list), _) => format!("[{list}]"),
                (None, 3) => "[0.0, 0.0, -9.81]".into(),
                (None, 4) => "[1.0, 0.0, 0.0, 0.0]".into(),
                (None, 2) => "[1.0, 2.0]".into(),
                _ => return None,
            };
            Some(format!("write {count} values in brackets, as in {shown}"))
        }
        _ => None,
    }
}

/// What to try where the key `name` must be a table and is none, or is one and must not be.
fn as_table(name: &str, got: &Value, expected: &Expected) -> Option<String> {
    Some(match (name, got, expected) {
        (_, Value::Table(_), Expected::Text) => {
            format!("it is one value, and belongs among the keys of the table above: {name} = \"...\"")
        }
        ("cluster", Value::Integer(number), Expected::Table) => {
            format!("the number of spheres is cluster.spheres = {number}")
        }
        ("shape", _, Expected::Table) => {
            "a shape has measures, as in shape = { type = \"box\", size = [0.8, 0.8, 0.8] }".into()
        }
        (_, _, Expected::Table) => {
            format!("`{name}` holds keys, as in {name} = {{ key = value }}; docs/reference.md has them")
        }
        _ => return None,
    })
}

/// Names that are listed, where there are more the nearest [`NEAREST`] of them.
const LISTED: usize = 8;
const NEAREST: usize = 5;

/// "did you mean ...", with all that is known.
pub fn suggestion<S: AsRef<str>>(name: &str, known: &[S]) -> Option<String> {
    if known.is_empty() {
        return Some("nothing may follow here".into());
    }
    let all: Vec<&str> = known.iter().map(AsRef::as_ref).collect();
    Some(offered(nearest(name, known), &all, ""))
}

/// The same of keys and words of the reference, of many the nearest.
pub fn of_reference(name: &str, known: &[&str]) -> Option<String> {
    if known.len() <= LISTED {
        return suggestion(name, known);
    }
    // A name that has the other in it is nearer than its letters are.
    let has = |k: &str| k.contains(name) || name.contains(k);
    let mut listed = known.to_vec();
    listed.sort_by_key(|k| (!has(k), strsim::damerau_levenshtein(name, k)));
    listed.truncate(NEAREST);
    let more = format!(" and {} more, in docs/reference.md", known.len() - NEAREST);
    Some(offered(nearest(name, known), &listed, &more))
}

fn offered(near: Option<&str>, listed: &[&str], more: &str) -> String {
    let meant = near.map_or(String::new(), |near| format!("did you mean `{near}`? "));
    let list = listed.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", ");
    format!("{meant}known here: {list}{more}")
}

/// The known name that is nearest to `name`, if one is near: a third of its letters may differ.
pub(crate) fn nearest<'a, S: AsRef<str>>(name: &str, known: &'a [S]) -> Option<&'a str> {
    let plain = |s: &str| s.to_lowercase().replace('-', "_");
    let name = plain(name);
    known
        .iter()
        .map(AsRef::as_ref)
        .map(|k| (strsim::damerau_levenshtein(&name, &plain(k)), k))
        .filter(|(distance, k)| *distance <= (k.chars().count().max(name.chars().count()) / 3).max(1))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, k)| k)
}

/// Every value below `node`, itself included.
pub(crate) fn values<'i>(node: &Spanned<DeValue<'i>>, visit: &mut impl FnMut(&Spanned<DeValue<'i>>)) {
    visit(node);
    match node.get_ref() {
        DeValue::Array(items) => items.iter().for_each(|item| values(item, visit)),
        DeValue::Table(table) => table.iter().for_each(|(_, value)| values(value, visit)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_names_the_nearest_are_listed() {
        let many: Vec<String> = (0..20).map(|k| format!("key_{k}_of_many")).collect();
        let known: Vec<&str> = many.iter().map(String::as_str).chain(["friction_max", "friction"]).collect();
        let said = of_reference("frction", &known).unwrap_or_default();
        assert!(
            said.starts_with("did you mean `friction`? known here: `friction`, `friction_max`, `key_"),
            "{said}"
        );
        assert!(
            said.ends_with(" and 17 more, in docs/reference.md") && said.matches('`').count() == 12,
            "{said}"
        );
        assert_eq!(
            of_reference("a", &known[..2]).as_deref(),
            Some("known here: `key_0_of_many`, `key_1_of_many`")
        );
    }

    #[test]
    fn the_nearest_name_is_offered_only_if_it_is_near() {
        let known = ["young", "density", "time_step"];
        assert_eq!(nearest("yuong", &known), Some("young"));
        assert_eq!(nearest("timestep", &known), Some("time_step"));
        assert_eq!(nearest("time-step", &known), Some("time_step"));
        assert_eq!(nearest("colour", &known), None);
    }

    fn text(value: &str) -> Value {
        value.into()
    }

    #[test]
    fn a_mismatch_is_put_in_words_of_the_file() {
        let said = |what: What| what.to_string();
        assert_eq!(
            said(What::WrongType(text("a, expected b"), Expected::Number)),
            "wrong type: string \"a, expected b\", expected a number"
        );
        let what = What::WrongValue(9.0.into(), Expected::WholeNotNegative);
        assert_eq!(said(what), "wrong value: floating point `9.0`, expected a whole number, not negative");
        let known = &["weak", "strong"];
        let error = Mismatch::from(What::UnknownVariant("week".into(), known)).diagnostic("coupling", &[]);
        assert_eq!((error.message.as_str(), &error.code), ("unknown value `week`", &code::UNKNOWN_NAME));
        assert_eq!(error.hint.as_deref(), Some("did you mean `weak`? known here: `weak`, `strong`"));
    }

    #[test]
    fn a_value_of_another_type_is_shown_as_it_should_stand() {
        let hint = |what: What, path: &[&str]| {
            let path = path.iter().map(|name| (*name).to_owned()).collect();
            Mismatch { path, ..what.into() }.diagnostic("rock", &[]).hint
        };
        let wrong = What::WrongType;
        let short = |found, needed| What::WrongLength(found, Expected::ArrayOf(needed), None);
        for (what, cure) in [
            (wrong(text("260"), Expected::Number), "without quotes: 260"),
            (wrong(text("-0.5 kN"), Expected::Number), "without its unit, in SI units: -500"),
            (wrong(text("180 kg"), Expected::Number), "in SI units: 180"),
            (wrong(text("90 km/h"), Expected::Number), "in SI units: 25"),
            (wrong(text("3 feet"), Expected::Number), "in SI units (m, kg, s, N, Pa)"),
            (wrong(text("0.2ms"), Expected::Number), "in SI units: 0.0002"),
            (wrong(text("0,0,3"), Expected::ArrayOf(3)), "as in [0,0,3]"),
            (wrong(9.81.into(), Expected::ArrayOf(3)), "[0.0, 0.0, -9.81]"),
            (short(3, 4), "[w, x, y, z]"),
            (short(2, 3), "[x, y, z]"),
            (What::MissingField("shape"), "add `shape = ...`"),
            (wrong(Value::Table(toml::Table::new()), Expected::Array), "[[rock]]"),
        ] {
            let hint = hint(what.clone(), &[]).unwrap_or_default();
            assert!(hint.contains(cure), "{what:?}: {hint}");
        }
        assert_eq!(hint(wrong(text("heavy"), Expected::Number), &["mass"]), None);
        assert_eq!(
            hint(wrong(80.into(), Expected::Table), &["cluster"]).as_deref(),
            Some("the number of spheres is cluster.spheres = 80")
        );
        let one = hint(wrong(Value::Table(toml::Table::new()), Expected::Text), &["material"]);
        assert!(one.is_some_and(|text| text.ends_with("material = \"...\"")));
    }
}
