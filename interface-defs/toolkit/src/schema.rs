//! What a program reads of a scene and writes as results, for editors and the reference.
//!
//! Every program prints its own share as JSON (hidden subcommand `schema`); `rockfall schema` puts them
//! together. The text is that of the doc comments of the settings, so that it cannot differ from what is read.

use super::history::column;
use super::limits::Limits;
use super::output;
use schemars::generate::{SchemaGenerator, SchemaSettings};
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

/// A number that a program writes into a result file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Where it stands: the name of a file in the output directory.
    pub file: String,
    /// Its name without unit; `<rock>`, `<gauge>` stand for names that the scene gives, `{x,y,z}` for one of these.
    pub name: String,
    /// Its unit, `1` for a number without.
    pub unit: String,
    /// What it is.
    pub meaning: String,
}

impl Entry {
    /// Whether this describes the result `name` of its file, the placeholders of [`Entry::name`] filled in. Columns
    /// bear their unit in their name.
    pub fn describes(&self, name: &str) -> bool {
        fits(&self.full_name(), name)
    }

    /// Its name as it stands in its file.
    pub fn full_name(&self) -> String {
        if self.file.ends_with(".csv") { column(&self.name, &self.unit) } else { self.name.to_string() }
    }
}

/// Whether `text` is `pattern` with something in the place of each `<...>`, and one of `a`, `b` in that of `{a,b}`.
fn fits(pattern: &str, text: &str) -> bool {
    let Some(at) = pattern.find(['<', '{']) else { return pattern == text };
    let (head, rest) = pattern.split_at(at);
    let Some(text) = text.strip_prefix(head) else { return false };
    let close = if rest.starts_with('<') { '>' } else { '}' };
    let Some((inner, tail)) = rest[1..].split_once(close) else { return false };
    if close == '}' {
        return inner.split(',').any(|one| text.strip_prefix(one).is_some_and(|t| fits(tail, t)));
    }
    (1..=text.len()).any(|n| text.is_char_boundary(n) && fits(tail, &text[n..]))
}

/// The share of one program in the schema.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Share {
    /// Schema of each top-level key that the program reads.
    pub properties: Map<String, Value>,
    /// What those refer to, by name.
    pub definitions: Map<String, Value>,
    /// What the program writes.
    pub results: Vec<Entry>,
}

/// Collects the share of a program.
#[must_use]
pub struct Tables {
    generator: SchemaGenerator,
    share: Share,
}

impl Default for Tables {
    fn default() -> Self {
        // Draft 7 is what editors for TOML know.
        Self { generator: SchemaSettings::draft07().into_generator(), share: Share::default() }
    }
}

impl Tables {
    /// The keys that all programs share.
    pub fn common() -> Self {
        Self::default()
            .value::<String>("title", "Title of the scene, for reports.")
            .value::<f64>("end_time", "Simulated time [s]. Required.")
            .value::<[f64; 3]>("gravity", "Gravity [m/s2], a vector. Default none: `[0, 0, 0]`.")
            .key::<output::Table>("output")
            .key::<Limits>("limits")
            .value::<Map<String, Value>>("custom", "Belongs to programs of others, and is not checked.")
    }

    /// The top-level key `key` holds a `T`: a table, or a list of tables as `Vec<T>`.
    pub fn key<T: JsonSchema>(mut self, key: &str) -> Self {
        let schema = self.generator.subschema_for::<T>();
        self.share.properties.insert(key.into(), tidied(schema));
        self
    }

    /// The same for a key that holds a plain value, with what it means.
    pub fn value<T: JsonSchema>(mut self, key: &str, meaning: &str) -> Self {
        let mut schema = self.generator.subschema_for::<T>();
        schema.insert("description".into(), json!(meaning));
        self.share.properties.insert(key.into(), tidied(schema));
        self
    }

    /// What the program writes, as a text: a line with a file, then one `name | unit | meaning` for each of its numbers.
    pub fn results(mut self, text: &str) -> Self {
        let mut file = "";
        for line in text.lines().map(str::trim) {
            match line.splitn(3, " | ").collect::<Vec<_>>()[..] {
                [name, unit, meaning] => {
                    let [file, name, unit, meaning] = [file, name, unit, meaning].map(str::to_owned);
                    self.share.results.push(Entry { file, name, unit, meaning });
                }
                _ => file = line,
            }
        }
        self
    }

    /// All of it.
    pub fn share(mut self) -> Share {
        for (name, schema) in self.generator.take_definitions(true) {
            let schema = Schema::try_from(schema).expect("definitions are schemas");
            self.share.definitions.insert(name, tidied(schema));
        }
        self.share
    }
}

impl Share {
    /// As JSON text, which another program reads back with [`Share::from_json`].
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("maps of text are valid JSON")
    }

    /// From JSON text.
    pub fn from_json(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|e| e.to_string())
    }

    /// Take in another program's share. Errs with the name that both use for different things.
    pub fn merge(&mut self, other: Self) -> Result<(), String> {
        let maps = [(&mut self.properties, other.properties), (&mut self.definitions, other.definitions)];
        for (own, others) in maps {
            for (name, schema) in others {
                if own.get(&name).is_some_and(|known| *known != schema) {
                    return Err(name);
                }
                own.insert(name, schema);
            }
        }
        self.results.extend(other.results);
        Ok(())
    }

    /// The schema of a whole scene.
    pub fn document(&self) -> Value {
        let what = "A scene of rockfall: one TOML file, SI units. A table that is absent builds nothing.";
        self.document_of("Rockfall scene", what, &["end_time"])
    }

    /// The schema of another kind of file, in which these keys are required.
    pub fn document_of(&self, title: &str, what: &str, required: &[&str]) -> Value {
        json!({
            "$schema": "http://json-schema.org/draft-07/schema#",
            "title": title,
            "description": what,
            "type": "object",
            "properties": self.properties,
            "required": required,
            "additionalProperties": false,
            "definitions": self.definitions,
        })
    }
}

/// TOML has no null, and a line of text no line breaks.
fn tidied(mut schema: Schema) -> Value {
    RecursiveTransform(tidy).transform(&mut schema);
    schema.to_value()
}

fn tidy(schema: &mut Schema) {
    let Some(map) = schema.as_object_mut() else { return };
    map.remove("format");
    if map.get("default").is_some_and(Value::is_null) {
        map.remove("default");
    }
    if let Some(Value::Array(types)) = map.get_mut("type") {
        types.retain(|t| t != "null");
        if let [only] = &types[..] {
            let only = only.clone();
            map.insert("type".into(), only);
        }
    }
    if let Some(Value::Array(any)) = map.get_mut("anyOf") {
        any.retain(|s| s.get("type") != Some(&json!("null")));
        if any.len() == 1 {
            let only = map.remove("anyOf").expect("is there");
            map.insert("allOf".into(), only);
        }
    }
    if let Some(Value::String(text)) = map.get_mut("description") {
        *text = paragraphs(text);
    }
}

/// Lines of a paragraph joined; paragraphs and rows of tables stay apart.
fn paragraphs(text: &str) -> String {
    let joined = |paragraph: &str| {
        let table = paragraph.trim_start().starts_with('|');
        paragraph.lines().map(str::trim).collect::<Vec<_>>().join(if table { "\n" } else { " " })
    };
    text.split("\n\n").map(joined).collect::<Vec<_>>().join("\n\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How a thing
    /// is made.
    #[derive(Serialize, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct Thing {
        /// Mass [kg],
        /// of all.
        mass: Option<f64>,
        /// Kind.
        kind: Option<Kind>,
    }

    /// Kind.
    #[derive(Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    enum Kind {
        /// Soft.
        Soft,
    }

    #[test]
    fn a_schema_has_no_null_and_says_what_the_doc_comments_say() {
        let share = Tables::default().key::<Vec<Thing>>("thing").value::<f64>("end", "End [s].").share();
        let text = serde_json::to_string(&share.document()).expect("JSON");
        assert!(!text.contains("null"), "{text}");
        let thing = &share.definitions["Thing"];
        assert_eq!(thing["description"], "How a thing is made.");
        assert_eq!(
            thing["properties"]["mass"],
            json!({"description": "Mass [kg], of all.", "type": "number"})
        );
        assert_eq!(thing["additionalProperties"], false);
        assert_eq!(share.properties["end"]["description"], "End [s].");
        let back = Share::from_json(&share.to_json()).expect("reads back");
        assert_eq!(back.document(), share.document());
    }

    #[test]
    fn two_shares_may_not_say_different_things_of_one_name() {
        let one = || Tables::default().value::<f64>("a", "one").share();
        let mut both = one();
        assert_eq!(both.merge(one()), Ok(()));
        assert_eq!(both.merge(Tables::default().value::<f64>("a", "two").share()), Err("a".into()));
    }

    #[test]
    fn placeholders_stand_for_any_name() {
        let one = |file: &str, name: &str, unit: &str| {
            Tables::default().results(&format!("{file}\n {name} | {unit} | what")).share().results.remove(0)
        };
        let entry = |name| one("history.csv", name, "m");
        assert!(entry("<rock>_{x,y}").describes("rock_2_y_m"));
        assert!(entry("<gauge>_<quantity>_min").describes("centre_uz_min_m"));
        assert!(one("history.csv", "iterations", "1").describes("iterations"));
        assert!(one("summary.json", "sag", "m").describes("sag"));
        assert!(!entry("<rock>_{x,y}").describes("_x_m"));
        assert!(!entry("<rock>_{x,y}").describes("rock_z_m"));
    }
}
