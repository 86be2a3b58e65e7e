//! `rockfall schema`: the schema of a whole scene, what each program says of its tables put together, and that of a study; with
//! `--reference` the reference of all keys of a scene and of all results, as Markdown.
//!
//! Every word of it comes from the schema, that is from the doc comments of what the programs read.

use crate::check::plan::own_program;
use crate::front::stop::Stop;
use crate::new::fill;
use crate::run::children::{self, Events};
use interface_defs::diagnostic::code;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use toolkit::kit;
use toolkit::processes::Processes;
use toolkit::scene::KEYS;
use toolkit::schema::{Entry, Share, Tables};

const MEASURES: &str = "\
Measures, each with `value`, `unit` and, where it has one, `time_s`. With several rocks those of a rock begin with `<rock>_`. What is \
absent has its reason in `warnings`.

";

/// The whole page: of a scene, of a study, of a calibration, of the results.
pub fn text(share: &Share, study: &Share, calibration: &Share) -> String {
    let known: Vec<&str> = KEYS.into_iter().filter(|key| share.properties.contains_key(*key)).collect();
    let all = |share: &Share, required| {
        let keys: Vec<&str> = share.properties.keys().map(String::as_str).collect();
        ReferencePage::document(share, &keys, required, 3)
    };
    let values = [
        ("SCENE", ReferencePage::document(share, &known, "end_time", 2)),
        ("STUDY", all(study, "scene")),
        ("CALIBRATION", all(calibration, "study")),
        ("RESULTS", results(&[&share.results[..], &study.results].concat())),
        ("CODES", code::reference()),
    ];
    fill(include_str!("reference.txt").trim_end(), &values)
}

/// What a value is.
enum Kind<'a> {
    /// A number, a text, a list of such.
    Plain(String),
    /// One of some names, each with its meaning.
    Names(Vec<(&'a str, &'a str)>),
    /// A table, or a list of tables.
    Table { of: &'a Value, many: bool },
    /// A table of which one key says what else it holds; or a list of such.
    Tagged { variants: &'a [Value], many: bool },
}

impl<'a> Kind<'a> {
    fn of(schema: &'a Value, share: &'a Share) -> Self {
        let schema = resolved(schema, share);
        if let Some(variants) = schema.get("oneOf").and_then(Value::as_array) {
            let name = |v: &'a Value| Some((v.get("const")?.as_str()?, description(v)));
            return match variants.iter().map(name).collect() {
                Some(names) => Self::Names(names),
                None => Self::Tagged { variants, many: false },
            };
        }
        match schema.get("type").and_then(Value::as_str) {
            Some("array") => match schema.get("items").map(|items| Self::of(items, share)) {
                Some(Self::Table { of, .. }) => Self::Table { of, many: true },
                Some(Self::Tagged { variants, .. }) => Self::Tagged { variants, many: true },
                _ => Self::Plain(plain(schema)),
            },
            Some("object") if schema.get("properties").is_some() => Self::Table { of: schema, many: false },
            _ => Self::Plain(plain(schema)),
        }
    }

    fn is_plain(&self) -> bool {
        matches!(self, Self::Plain(_) | Self::Names(_))
    }

    /// In the column of types.
    fn name(&self) -> String {
        match self {
            Self::Plain(name) => name.clone(),
            Self::Names(_) => "name".into(),
            Self::Table { many, .. } | Self::Tagged { many, .. } => {
                if *many { "list of tables, below" } else { "table, below" }.into()
            }
        }
    }
}

/// A value without parts of its own, in words.
fn plain(schema: &Value) -> String {
    let number = |key: &str| schema.get(key).and_then(Value::as_u64);
    match schema.get("type").and_then(Value::as_str) {
        Some("number") => "number".into(),
        Some("integer") => "integer".into(),
        Some("boolean") => "true or false".into(),
        Some("string") => "text".into(),
        Some("object") => "table".into(),
        Some("array") => {
            let items = schema.get("items").map_or_else(|| "anything".into(), plain);
            let plural = match &items[..] {
                "text" => "texts".into(),
                "number" | "integer" => format!("{items}s"),
                other => format!("[{other}]"),
            };
            match (number("minItems"), number("maxItems")) {
                (Some(least), Some(most)) if least == most => format!("{least} {plural}"),
                _ => format!("list of {plural}"),
            }
        }
        _ => match schema.get("anyOf").and_then(Value::as_array) {
            Some(variants) => variants.iter().map(plain).collect::<Vec<_>>().join(" or "),
            None if schema.get("allOf").is_some() => "table".into(),
            None => "anything".into(),
        },
    }
}

/// What a reference refers to.
fn resolved<'a>(schema: &'a Value, share: &'a Share) -> &'a Value {
    let one = schema.get("allOf").and_then(|all| all.get(0)).unwrap_or(schema);
    let name = one.get("$ref").and_then(Value::as_str).and_then(|r| r.strip_prefix("#/definitions/"));
    name.and_then(|name| share.definitions.get(name)).unwrap_or(one)
}

fn description(schema: &Value) -> &str {
    schema.get("description").and_then(Value::as_str).unwrap_or("")
}

struct ReferencePage<'a> {
    share: &'a Share,
    text: String,
}

impl<'a> ReferencePage<'a> {
    /// A whole document: the values at its top, of which one is required, then its tables.
    fn document(share: &'a Share, known: &[&str], required: &str, level: usize) -> String {
        let plain = |key: &&str| Kind::of(&share.properties[*key], share).is_plain();
        let (values, tables): (Vec<&str>, Vec<&str>) = known.iter().copied().partition(plain);
        let top: Map<String, Value> =
            values.iter().map(|key| ((*key).to_owned(), share.properties[*key].clone())).collect();
        let mut page = Self { share, text: String::new() };
        page.keys(&top, &[required.into()], None);
        for key in tables {
            page.section(key, &share.properties[key], level);
        }
        page.text
    }

    /// A table of a scene, and the tables in it.
    fn section(&mut self, path: &str, schema: &'a Value, level: usize) {
        let kind = Kind::of(schema, self.share);
        let many = matches!(kind, Kind::Table { many: true, .. } | Kind::Tagged { many: true, .. });
        let title = if many { format!("[[{path}]]") } else { format!("[{path}]") };
        let _ = write!(self.text, "\n{} `{title}`\n\n", "#".repeat(level));
        let own = description(schema);
        match kind {
            Kind::Table { of, .. } => {
                self.paragraph(if own.is_empty() { description(of) } else { own });
                self.table(path, of, level, None);
            }
            Kind::Tagged { variants, .. } => {
                let items = schema.get("items").unwrap_or(schema);
                self.paragraph(if own.is_empty() { description(resolved(items, self.share)) } else { own });
                for variant in variants {
                    self.variant(path, variant, level + 1);
                }
            }
            Kind::Plain(_) | Kind::Names(_) => self.paragraph(own),
        }
    }

    /// One choice of a tagged table.
    fn variant(&mut self, path: &str, variant: &'a Value, level: usize) {
        let properties = variant.get("properties").and_then(Value::as_object);
        let tag = properties.and_then(|all| {
            all.iter().find_map(|(key, schema)| Some((key.as_str(), schema.get("const")?.as_str()?)))
        });
        let Some((key, name)) = tag else { return };
        let _ = write!(self.text, "\n{} `{path}` with `{key} = \"{name}\"`\n\n", "#".repeat(level));
        self.paragraph(description(variant));
        self.table(path, variant, level, Some(key));
    }

    fn table(&mut self, path: &str, schema: &'a Value, level: usize, tag: Option<&str>) {
        let Some(properties) = schema.get("properties").and_then(Value::as_object) else { return };
        let required: Vec<Value> =
            schema.get("required").and_then(Value::as_array).cloned().unwrap_or_default();
        self.keys(properties, &required, tag);
        for (key, inner) in properties {
            if Some(key.as_str()) != tag && !Kind::of(inner, self.share).is_plain() {
                self.section(&format!("{path}.{key}"), inner, level + 1);
            }
        }
    }

    /// The rows of a table, what is required first.
    fn keys(&mut self, properties: &Map<String, Value>, required: &[Value], tag: Option<&str>) {
        let needed = |key: &str| required.iter().any(|r| r == key);
        let mut rows: Vec<_> = properties.iter().filter(|(key, _)| Some(key.as_str()) != tag).collect();
        rows.sort_by_key(|(key, _)| !needed(key));
        if rows.is_empty() {
            return;
        }
        let _ = writeln!(self.text, "| key | type | unit | default | meaning |\n|---|---|---|---|---|");
        for (key, schema) in rows {
            let kind = Kind::of(schema, self.share);
            let own = description(schema);
            let (text, unit) = without_unit(if own.is_empty() && !kind.is_plain() {
                description(resolved(schema, self.share))
            } else {
                own
            });
            let (mut text, stated) = without_default(&text);
            let default = match (needed(key), stated, schema.get("default")) {
                (true, ..) => "**required**".into(),
                (false, Some(stated), _) => stated,
                (false, None, Some(value)) => format!("`{}`", toml_text(value)),
                (false, None, None) => String::new(),
            };
            if let Kind::Names(names) = &kind {
                for (name, meaning) in names {
                    let _ = write!(text, "<br>`{name}`: {meaning}");
                }
            }
            let (kind, default, text) = (kind.name(), cell(&default), cell(&text));
            let _ = writeln!(self.text, "| `{key}` | {kind} | {unit} | {default} | {text} |");
        }
    }

    fn paragraph(&mut self, text: &str) {
        if !text.is_empty() {
            let _ = writeln!(self.text, "{text}\n");
        }
    }
}

/// A table for each file of results.
fn results(all: &[Entry]) -> String {
    let mut text = String::new();
    for (at, Entry { file, .. }) in all.iter().enumerate() {
        if all[..at].iter().any(|entry| entry.file == *file) {
            continue;
        }
        let what = if file == "summary.json" { MEASURES } else { "" };
        let _ = write!(text, "\n### `{file}`\n\n{what}| name | unit | meaning |\n|---|---|---|\n");
        for entry in all.iter().filter(|entry| entry.file == *file) {
            let (name, meaning) = (entry.full_name(), cell(&entry.meaning));
            let name = if name.is_empty() { name } else { format!("`{name}`") };
            let _ = writeln!(text, "| {name} | {} | {meaning} |", entry.unit);
        }
    }
    text
}

/// Text in one cell of a table.
fn cell(text: &str) -> String {
    text.replace("\n\n", "<br>").replace('\n', " ").replace('|', "\\|")
}

/// A text without the first unit that stands in it in brackets, and that unit.
fn without_unit(text: &str) -> (String, String) {
    let is_unit = |inner: &str| {
        !inner.is_empty() && inner.chars().all(|c| "mskgNPadrJ/1234, -".contains(c)) && inner != "2"
    };
    for (at, _) in text.match_indices('[') {
        let inner = text[at + 1..].split(']').next().unwrap_or_default();
        if !text[..at].ends_with('`') && is_unit(inner) {
            let head = text[..at].trim_end();
            return (format!("{head}{}", &text[at + inner.len() + 2..]), inner.into());
        }
    }
    (text.into(), String::new())
}

/// A text without the sentence that begins with `Default`, and that sentence without the word.
fn without_default(text: &str) -> (String, Option<String>) {
    const WORD: &str = "Default";
    let starts = |at: usize| at == 0 || text[..at].ends_with(' ') || text[..at].ends_with('\n');
    let Some((at, _)) = text.match_indices(WORD).find(|(at, _)| starts(*at)) else {
        return (text.into(), None);
    };
    let rest = &text[at + WORD.len()..];
    let end = rest.match_indices(". ").next().map_or(rest.trim_end_matches('.').len(), |(end, _)| end);
    let default = rest[..end].trim_start_matches(':').trim().to_owned();
    let tail = rest[end..].trim_start_matches('.').trim_start();
    let head = text[..at].trim_end();
    (format!("{head}{}{tail}", if tail.is_empty() || head.is_empty() { "" } else { " " }), Some(default))
}

/// A value as a scene writes it.
fn toml_text(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(toml_text).collect::<Vec<_>>().join(", ")),
        Value::Object(map) => {
            let entries: Vec<String> = map.iter().map(|(k, v)| format!("{k} = {}", toml_text(v))).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        other => other.to_string(),
    }
}

/// Programs with tables of their own.
const PROGRAMS: [&str; 3] = ["dem-solver", "fem-solver", "coupler"];

/// Ask every program of this project for its share.
pub fn share() -> Result<Share, Stop> {
    let mut all = Tables::common().key::<Processes>("processes").share();
    for program in PROGRAMS {
        all.merge(ask(program, "schema")?).map_err(|name| {
            let what = format!("{program} and another program describe `{name}` differently");
            Stop::failed(code::NAME_TAKEN, what)
        })?;
    }
    Ok(all)
}

/// Ask the rocks' program, which computes studies, for the keys of one.
pub fn study() -> Result<Share, Stop> {
    ask("dem-solver", "study-schema")
}

/// Ask it for the keys of a calibration.
pub fn calibration() -> Result<Share, Stop> {
    ask("dem-solver", "calibration-schema")
}

/// The schema of a study of many releases.
pub fn of_study() -> Result<Value, Stop> {
    let what =
        "A study of rockfall: a scene of one fall, where rocks start, what varies. One TOML file, SI units.";
    Ok(study()?.document_of("Rockfall study", what, &["scene", "release"]))
}

/// The schema of a calibration.
pub fn of_calibration() -> Result<Value, Stop> {
    let what = "A calibration of rockfall: a study, what was observed of its falls, which values are sought. One TOML file, SI units.";
    Ok(calibration()?.document_of("Rockfall calibration", what, &["study"]))
}

/// The schema of a kit: the tables of a scene that it may hold, and its own.
pub fn of_kit() -> Result<Value, Stop> {
    let mut share = share()?;
    share.properties.retain(|key, _| kit::TABLES.contains(&key.as_str()));
    let about = json!({
        "description": "What the kit says of itself.", "type": "object", "additionalProperties": false,
        "properties": {
            "name": { "description": "Name. Default: that of its file.", "type": "string" },
            "class": { "description": "Class, EAD 340059-00-0106.", "type": "integer", "minimum": 0, "maximum": 8 },
            "energy": { "description": "Energy of its largest test (MEL) [J].", "type": "number", "exclusiveMinimum": 0 },
        },
    });
    share.properties.insert("kit".into(), about);
    let what = "A kit of rockfall: a whole barrier, which a scene takes with `kit` in [structure]. One TOML file, SI units.";
    Ok(share.document_of("Rockfall kit", what, &["structure"]))
}

fn ask(program: &str, command: &str) -> Result<Share, Stop> {
    let text = children::ask(&own_program(program)?, &[command.into()], &Events::watch()?)?;
    Share::from_json(&text).map_err(|e| {
        let what = format!("{program} {command}: {e}; are all programs of one version?");
        Stop::failed(code::CONTRACT, what)
    })
}

/// A schema as JSON text.
pub fn json(document: &Value) -> String {
    serde_json::to_string_pretty(document).expect("maps of text are valid JSON") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_and_default_move_from_the_text_into_their_columns() {
        let (text, unit) = without_unit("Speed [m/s] of `[2]`. Default 0.01. More.");
        assert_eq!((&text[..], &unit[..]), ("Speed of `[2]`. Default 0.01. More.", "m/s"));
        assert_eq!(without_default(&text), ("Speed of `[2]`. More.".into(), Some("0.01".into())));
        assert_eq!(without_default("By default none."), ("By default none.".into(), None));
        assert_eq!(without_default("Mass. Default: none"), ("Mass.".into(), Some("none".into())));
    }

    #[test]
    fn values_are_written_as_in_a_scene() {
        let value = serde_json::json!({ "type": "aitken", "initial": 0.5, "list": [1, 2.0] });
        assert_eq!(toml_text(&value), "{ initial = 0.5, list = [1, 2.0], type = \"aitken\" }");
    }
}
