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
        return (format!("the key `{name}` is missing here"), None);
    }
    for (theirs, ours) in [("invalid type: ", "wrong type: "), ("invalid value: ", "wrong value: ")] {
        if let Some((got, expected)) = raw.strip_prefix(theirs).and_then(|r| r.rsplit_once(", expected ")) {
            return (format!("{ours}{got}, expected {}", expectation(expected)), None);
        }
    }
    if let Some((found, needed)) = lengths(raw) {
        return (format!("{found} values where {needed} are needed"), None);
    }
    if raw.starts_with("data did not match any variant") {
        return ("this has none of the forms that are known here".into(), None);
    }
    (raw.to_owned(), None)
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
}
