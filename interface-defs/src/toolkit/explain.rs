//! A deserialiser's complaint in the user's words, with the nearest known name.

use std::ops::Range;
use toml::Spanned;
use toml::de::DeValue;

/// What is wrong, and what to try.
pub(crate) fn explain(raw: &str) -> (String, Option<String>) {
    if let Some((name, rest)) = named(raw, "unknown field `") {
        return (format!("unknown key `{name}`"), suggestion(&name, &quoted(rest)));
    }
    if let Some((name, rest)) = named(raw, "unknown variant `") {
        return (format!("unknown value `{name}`"), suggestion(&name, &quoted(rest)));
    }
    if let Some((name, _)) = named(raw, "missing field `") {
        let add = format!("add `{name} = ...` to this table; docs/reference.md has its keys and their units");
        return (format!("the key `{name}` is missing here"), Some(add));
    }
    for (theirs, ours) in [("invalid type: ", "wrong type: "), ("invalid value: ", "wrong value: ")] {
        if let Some((got, expected)) = raw.strip_prefix(theirs).and_then(|r| r.rsplit_once(", expected ")) {
            let expected = expectation(expected);
            let hint = of_type(got, &expected);
            return (format!("{ours}{got}, expected {expected}"), hint);
        }
    }
    if let Some((found, needed)) = lengths(raw) {
        let fewer = match needed {
            2 => Some("write two numbers, as in [1.0, 2.0]"),
            3 => Some("a vector has three numbers, [x, y, z]"),
            4 => Some(
                "a quaternion has four, [w, x, y, z]: no turn is [1, 0, 0, 0], an angle a in radians about z is \
                       [cos(a/2), 0, 0, sin(a/2)]",
            ),
            _ => None,
        };
        let hint = fewer.filter(|_| found < needed).map(str::to_owned);
        return (format!("{found} values where {needed} are needed"), hint);
    }
    if raw.starts_with("data did not match any variant") {
        return ("this has none of the forms that are known here".into(), None);
    }
    (raw.to_owned(), None)
}

/// What to try where a value is of another type: `got` as serde describes it.
fn of_type(got: &str, expected: &str) -> Option<String> {
    let text = got.strip_prefix("string \"").and_then(|rest| rest.strip_suffix('"')).map(str::trim);
    if let (Some(text), true) = (text, expected.contains("number")) {
        let digits =
            text.trim_end_matches(|c: char| c.is_alphanumeric() && !c.is_ascii_digit() || "/%*^".contains(c));
        let plain = [text, digits.trim_end()].into_iter().find(|t| t.parse::<f64>().is_ok())?;
        let bare = if plain == text { "quotes" } else { "quotes and without its unit, in SI units" };
        return Some(format!("write a number without {bare}: {plain}"));
    }
    if let Some(count) = expected.strip_prefix("an array of length ") {
        let listed = text.filter(|t| t.split(',').all(|n| n.trim().parse::<f64>().is_ok()));
        let shown = match (listed, count) {
            (Some(list), _) => format!("[{list}]"),
            (None, "3") => "[0.0, 0.0, -9.81]".into(),
            (None, "4") => "[1.0, 0.0, 0.0, 0.0]".into(),
            (None, "2") => "[1.0, 2.0]".into(),
            _ => return None,
        };
        return Some(format!("write {count} values in brackets, as in {shown}"));
    }
    None
}

/// What to try where the key `name` must be a table and is none, or is one and must not be.
pub(crate) fn as_table(name: &str, raw: &str) -> Option<String> {
    let (got, expected) = raw.strip_prefix("invalid type: ")?.rsplit_once(", expected ")?;
    if got == "map" && expected == "a string" {
        return Some(format!(
            "it is one value, and belongs among the keys of the table above: {name} = \"...\""
        ));
    }
    if expectation(expected) != "a table" {
        return None;
    }
    Some(match (name, got.split_once('`').and_then(|(_, rest)| rest.strip_suffix('`'))) {
        ("cluster", Some(number)) => format!("the number of spheres is cluster.spheres = {number}"),
        ("shape", _) => {
            "a shape has measures, as in shape = { type = \"box\", size = [0.8, 0.8, 0.8] }".into()
        }
        _ => format!("`{name}` holds keys, as in {name} = {{ key = value }}; docs/reference.md has them"),
    })
}

/// The key whose value stands at `span`.
pub(crate) fn key_at(node: &Spanned<DeValue>, span: &Range<usize>) -> Option<String> {
    match node.get_ref() {
        DeValue::Array(items) => items.iter().find_map(|item| key_at(item, span)),
        DeValue::Table(table) => table.iter().find_map(|(key, value)| {
            if value.span() == *span { Some(key.get_ref().to_string()) } else { key_at(value, span) }
        }),
        _ => None,
    }
}

/// How many values a list has and how many it must have, of a message that says so: "an array of length 3",
/// "3 elements in sequence".
fn lengths(raw: &str) -> Option<(usize, usize)> {
    let (found, expected) = raw.strip_prefix("invalid length ")?.split_once(", expected ")?;
    let needed = expected.split(' ').find_map(|word| word.parse().ok())?;
    Some((found.parse().ok()?, needed))
}

/// What to try where a list at `span` is too long, as `raw` says, and may hold a number that a decimal comma has cut.
pub(crate) fn decimal_comma(root: &Spanned<DeValue>, span: &Range<usize>, raw: &str) -> Option<String> {
    lengths(raw).filter(|(found, needed)| found > needed)?;
    let DeValue::Array(items) = node_at(root, span)?.get_ref() else { return None };
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
    let shown = numbers.windows(2).rev().find_map(cut)?;
    Some(format!("a decimal comma? a number is written with a point: {shown}"))
}

/// "did you mean ...", with all that is known.
pub fn suggestion<S: AsRef<str>>(name: &str, known: &[S]) -> Option<String> {
    if known.is_empty() {
        return Some("nothing may follow here".into());
    }
    let list = known.iter().map(|k| format!("`{}`", k.as_ref())).collect::<Vec<_>>().join(", ");
    Some(match nearest(name, known) {
        Some(near) => format!("did you mean `{near}`? known here: {list}"),
        None => format!("known here: {list}"),
    })
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

/// Where the fault really lies. A tagged or untagged enum is read from a copy without positions, so
/// that its error points to the whole table: look for what the message names inside.
pub(crate) fn pinpoint(root: &Spanned<DeValue>, span: Range<usize>, raw: &str) -> Range<usize> {
    let Some(inside) = node_at(root, &span) else { return span };
    if let Some((length, _)) = lengths(raw) {
        return list_of(inside, length).unwrap_or(span);
    }
    let wanted = if let Some((name, _)) = named(raw, "unknown field `") {
        return key_span(inside, &name).unwrap_or(span);
    } else if let Some((name, _)) = named(raw, "unknown variant `") {
        format!("string \"{name}\"")
    } else if let Some((got, _)) = raw.strip_prefix("invalid ").and_then(|r| r.rsplit_once(", expected ")) {
        let Some((_, got)) = got.split_once(": ") else { return span };
        got.to_owned()
    } else {
        return span;
    };
    let mut found = Vec::new();
    values(inside, &mut |value| {
        if describe(value.get_ref()).is_some_and(|text| text == wanted) {
            found.push(value.span());
        }
    });
    // Two equal values: either may be meant, so the table stays the answer.
    match found.as_slice() {
        [one] => one.clone(),
        _ => span,
    }
}

/// Where the list of `length` values stands, if there is one alone.
fn list_of(inside: &Spanned<DeValue>, length: usize) -> Option<Range<usize>> {
    let mut found = Vec::new();
    values(inside, &mut |value| {
        if let DeValue::Array(items) = value.get_ref()
            && items.len() == length
        {
            found.push(value.span());
        }
    });
    match found.as_slice() {
        [one] => Some(one.clone()),
        _ => None,
    }
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

/// The name in backticks after `start`, and what follows.
fn named<'a>(raw: &'a str, start: &str) -> Option<(String, &'a str)> {
    let (name, rest) = raw.strip_prefix(start)?.split_once('`')?;
    Some((name.to_owned(), rest))
}

fn quoted(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// A type of the program in words of the file.
fn expectation(rust: &str) -> String {
    match rust {
        "f64" | "f32" => "a number".into(),
        "usize" | "u64" | "u32" | "u16" | "u8" => "a whole number, not negative".into(),
        "isize" | "i64" | "i32" | "i16" | "i8" => "a whole number".into(),
        "a sequence" => "an array".into(),
        "a map" => "a table".into(),
        _ if rust.starts_with("struct ") || rust.contains("tagged enum ") => "a table".into(),
        _ if rust.starts_with("enum ") => "a name".into(),
        _ => rust.into(),
    }
}

/// A value as serde describes it when it is not expected.
fn describe(value: &DeValue) -> Option<String> {
    match value {
        DeValue::String(text) => Some(format!("string {text:?}")),
        DeValue::Integer(number) => Some(format!("integer `{number}`")),
        DeValue::Float(number) => {
            let value: f64 = number.as_str().parse().ok()?;
            let text = value.to_string();
            Some(format!("floating point `{}`", if text.contains('.') { text } else { text + ".0" }))
        }
        DeValue::Boolean(value) => Some(format!("boolean `{value}`")),
        DeValue::Datetime(_) | DeValue::Array(_) | DeValue::Table(_) => None,
    }
}

fn node_at<'a, 'i>(node: &'a Spanned<DeValue<'i>>, span: &Range<usize>) -> Option<&'a Spanned<DeValue<'i>>> {
    if node.span() == *span {
        return Some(node);
    }
    match node.get_ref() {
        DeValue::Array(items) => items.iter().find_map(|item| node_at(item, span)),
        DeValue::Table(table) => table.iter().find_map(|(_, value)| node_at(value, span)),
        _ => None,
    }
}

fn key_span(node: &Spanned<DeValue>, name: &str) -> Option<Range<usize>> {
    match node.get_ref() {
        DeValue::Array(items) => items.iter().find_map(|item| key_span(item, name)),
        DeValue::Table(table) => table
            .iter()
            .find(|(key, _)| key.get_ref() == name)
            .map(|(key, _)| key.span())
            .or_else(|| table.iter().find_map(|(_, value)| key_span(value, name))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_offered_only_if_it_is_near() {
        let known = ["young", "density", "time_step"];
        assert_eq!(nearest("yuong", &known), Some("young"));
        assert_eq!(nearest("timestep", &known), Some("time_step"));
        assert_eq!(nearest("time-step", &known), Some("time_step"));
        assert_eq!(nearest("colour", &known), None);
    }

    #[test]
    fn words_of_the_language_become_words_of_the_file() {
        assert_eq!(
            explain("invalid type: string \"a, expected b\", expected f64").0,
            "wrong type: string \"a, expected b\", expected a number"
        );
        assert_eq!(
            explain("invalid type: integer `1`, expected struct Dem").0,
            "wrong type: integer `1`, expected a table"
        );
        let (what, hint) = explain("unknown variant `week`, expected `weak` or `strong`");
        assert_eq!(what, "unknown value `week`");
        assert_eq!(hint.as_deref(), Some("did you mean `weak`? known here: `weak`, `strong`"));
    }

    #[test]
    fn a_value_of_another_type_is_shown_as_it_should_stand() {
        for (raw, cure) in [
            ("invalid type: string \"260\", expected f64", "without quotes: 260"),
            ("invalid type: string \"-0.5 kN\", expected f64", "without its unit, in SI units: -0.5"),
            ("invalid type: string \"0.2ms\", expected f64", "in SI units: 0.2"),
            ("invalid type: string \"0,0,3\", expected an array of length 3", "as in [0,0,3]"),
            ("invalid type: floating point `9.81`, expected an array of length 3", "[0.0, 0.0, -9.81]"),
            ("invalid length 3, expected an array of length 4", "[w, x, y, z]"),
            ("invalid length 2, expected an array of length 3", "[x, y, z]"),
            ("missing field `shape`", "add `shape = ...`"),
        ] {
            let hint = explain(raw).1.unwrap_or_default();
            assert!(hint.contains(cure), "{raw}: {hint}");
        }
        assert_eq!(explain("invalid type: string \"heavy\", expected f64").1, None);
        assert_eq!(
            as_table("cluster", "invalid type: integer `80`, expected struct Cluster").as_deref(),
            Some("the number of spheres is cluster.spheres = 80")
        );
        let one = as_table("material", "invalid type: map, expected a string");
        assert!(one.is_some_and(|text| text.ends_with("material = \"...\"")));
        assert_eq!(as_table("mass", "invalid type: string \"80\", expected f64"), None);
    }
}
