//! Scene text: its tables, and where in the file a value stands.
//!
//! A scene is one TOML file. A program reads the top-level tables that are its own into structs
//! with `deny_unknown_fields`; an error, wherever it arises, names line and column of the file.

use super::exact::{Exact, Mismatch};
use super::explain::{of_reference, values};
use super::files;
use super::kit::{self, About, Kit};
use super::library;
use super::regular_file;
use super::syntax;
use interface_defs::diagnostic::{Code, Diagnostic, Place, code};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Every key that may stand at the top of a scene.
pub const KEYS: [&str; 18] = [
    "title",
    "end_time",
    "gravity",
    "start_from",
    "rock",
    "spheres",
    "box",
    "contact",
    "terrain",
    "structure",
    "gauge",
    "dem",
    "fem",
    "coupling",
    "processes",
    "output",
    "limits",
    "custom",
];

/// The table that belongs to foreign programs and is not checked.
const UNCHECKED: &str = "custom";

/// What a document is, and every key that may stand at its top.
#[derive(Debug, PartialEq, Eq)]
pub struct Kind {
    /// In a word: `scene`.
    pub name: &'static str,
    /// The keys.
    pub keys: &'static [&'static str],
}

/// A scene.
static SCENE: Kind = Kind { name: "scene", keys: &KEYS };

/// A kit file.
static KIT: Kind = Kind { name: "kit", keys: &kit::TABLES };

/// A study of many releases.
pub static STUDY: Kind = Kind {
    name: "study",
    keys: &[
        "title",
        "scene",
        "seed",
        "sampling",
        "replicates",
        "release",
        "vary",
        "maps",
        "line",
        "most_failed",
        "report",
    ],
};

/// A scene: text of its file, with every `--set` in place.
#[derive(Debug, Clone)]
pub struct Scene {
    path: PathBuf,
    text: String,
    overrides: Vec<Override>,
    kind: &'static Kind,
    /// The barrier that it names, from a file of its own.
    kit: Option<Kit>,
    /// What is read in place of the text and of every `--set`, where a program has changed values.
    patch: Option<Arc<str>>,
    /// From which byte on the text follows from another file, and which.
    added: Option<(usize, PathBuf)>,
}

impl Scene {
    /// Read the scene at `path` and put every `key=value` of `sets` in place.
    ///
    /// Refuses text that is no TOML, unknown top-level keys, numbers that are not finite (except in
    /// `[custom]`), and a set that cannot be applied.
    pub fn load(path: &Path, sets: &[String]) -> Result<Self, Diagnostic> {
        Self::load_as(&SCENE, path, sets)
    }

    /// The same for a document of another kind, such as a study of many scenes.
    pub fn load_as(kind: &'static Kind, path: &Path, sets: &[String]) -> Result<Self, Diagnostic> {
        let bytes = regular_file::read(path, files::TEXT)?;
        Self::new(kind, path.to_owned(), syntax::decode(path, bytes)?, sets)
    }

    /// A kit file as a document of its own, and what it says of itself.
    pub fn load_kit(path: &Path) -> Result<(Self, About), Diagnostic> {
        let kit = Self::load_as(&KIT, path, &[])?;
        let about: About = kit.read("kit")?.unwrap_or_default();
        if let Some(class) = about.class.filter(|class| *class > 8) {
            return Err(kit.invalid("kit.class", format!("there is no class {class}: they are 0 to 8")));
        }
        if let Some(energy) = about.energy.filter(|energy| *energy <= 0.0) {
            return Err(kit.invalid("kit.energy", format!("the energy is {energy} J, it must lie above 0")));
        }
        if !kit.has("structure") {
            let what = "the kit has no table [structure]: there is no barrier in it";
            let cure = "write [structure.generator] with type = \"barrier\", and [[structure.parts]]";
            return kit.refuse("structure", what, cure);
        }
        if at(&kit.document()?, kit::KEY).is_some() {
            return kit.refuse(kit::KEY, "a kit cannot be made of another kit", "write its parts here");
        }
        Ok((kit, about))
    }

    /// A scene from text; `name` stands for its file.
    pub fn from_text(name: &str, text: &str) -> Result<Self, Diagnostic> {
        Self::new(&SCENE, name.into(), text.into(), &[])
    }

    fn new(kind: &'static Kind, path: PathBuf, text: String, sets: &[String]) -> Result<Self, Diagnostic> {
        let mut base = text.len() + 1;
        let mut overrides = Vec::with_capacity(sets.len());
        for set in sets {
            overrides.push(Override::parse(set, base)?);
            base += set.len() + 1;
        }
        let mut scene = Self { path, text, overrides, kind, kit: None, patch: None, added: None };
        if let Some((name, span)) = scene.named_kit()? {
            let file = scene.resolve(Path::new(&name));
            // What is wrong with the file as a whole is said where it is named.
            let named = |e: Diagnostic| match e.place.as_ref().and_then(|place| place.position) {
                Some(_) => e,
                None => Diagnostic { message: format!("the kit {}: {}", file.display(), e.message), ..e }
                    .about(kit::KEY)
                    .at(scene.place(span)),
            };
            let (kit, _) = Self::load_kit(&file).map_err(named)?;
            scene.kit = Some(Kit::new(&file, kit.text(), base));
        }
        scene.check()?;
        Ok(scene)
    }

    /// The kit that it names, and where it does.
    fn named_kit(&self) -> Result<Option<(String, Range<usize>)>, Diagnostic> {
        if self.kind != &SCENE {
            return Ok(None);
        }
        let mut tree = self.own_tree()?;
        // A --set of what is in the kit has no place in the scene yet.
        let is_kit = |set: &&Override| set.path.iter().map(|(name, _)| name.as_str()).eq(kit::KEY.split('.'));
        self.overrides.iter().filter(is_kit).try_for_each(|set| set.set_in_table(&mut tree, 0))?;
        let structure = tree.get("structure").and_then(|value| value.get_ref().as_table());
        let Some(value) = structure.and_then(|table| table.get("kit")) else { return Ok(None) };
        match value.get_ref().as_str() {
            Some(name) => Ok(Some((name.to_owned(), value.span()))),
            None => {
                let what = format!(
                    "the kit is a text, the name of its file, and not: {}",
                    value.get_ref().type_str()
                );
                Err(self.error(code::WRONG_TYPE, value.span(), what).about(kit::KEY))
            }
        }
    }

    /// The same document with `more` behind its text, which follows from the file `of`: what is wrong there is said of that file.
    pub fn with_more(self, more: &str, of: &Path) -> Result<Self, Diagnostic> {
        let sets: Vec<String> = self.sets().map(str::to_owned).collect();
        let added = Some((self.text.len(), of.to_owned()));
        Ok(Self { added, ..Self::new(self.kind, self.path, self.text + more, &sets)? })
    }

    fn check(&self) -> Result<(), Diagnostic> {
        let tree = self.tree()?;
        let mut fault: Option<(Range<usize>, String)> = None;
        for (key, value) in &tree {
            let name: &str = key.get_ref();
            if !self.kind.keys.contains(&name) {
                let what = format!("unknown key `{name}` at the top of the {}", self.kind.name);
                let error = self.error(code::UNKNOWN_KEY, key.span(), what).about(name);
                return Err(error.try_if(of_reference(name, self.kind.keys)));
            }
            if name == "title" && value.get_ref().as_str().is_none() {
                let what = format!("the title is a text, and not: {}", value.get_ref().type_str());
                let error = self.error(code::WRONG_TYPE, value.span(), what).about(name);
                return Err(error.try_instead("write it in quotes: title = \"...\""));
            }
            if name != UNCHECKED {
                values(value, &mut |v| {
                    if let DeValue::Float(number) = v.get_ref()
                        && !number.as_str().parse::<f64>().is_ok_and(f64::is_finite)
                        && fault.as_ref().is_none_or(|(at, _)| v.span().start < at.start)
                    {
                        fault = Some((v.span(), number.to_string()));
                    }
                });
            }
        }
        match fault {
            Some((span, number)) => {
                Err(self.error(code::NOT_FINITE, span, format!("`{number}` is not a finite number")))
            }
            None => Ok(()),
        }
    }

    /// The same scene with the values of `document`, which a program has made of its own. It is read in place of the text;
    /// errors still point to where the text has the key.
    #[must_use]
    pub fn patched(&self, document: toml::Table) -> Self {
        Self { patch: Some(document.to_string().into()), ..self.clone() }
    }

    /// Path of its file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its name: that of its file, without the extension.
    pub fn name(&self) -> String {
        self.path.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned())
    }

    /// Text of its file, without any `--set`.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Text of its own file alone, and the file that more of its text follows from.
    pub fn parts(&self) -> (&str, Option<&Path>) {
        match &self.added {
            Some((length, from)) => (&self.text[..*length], Some(from)),
            None => (&self.text, None),
        }
    }

    /// The file of the kit that it names, and its text.
    pub fn kit(&self) -> Option<(&Path, &str)> {
        self.kit.as_ref().map(|kit| (kit.path.as_path(), kit.text()))
    }

    /// Warnings of what is set twice.
    pub fn set_twice(&self) -> Vec<Diagnostic> {
        let key =
            |set: &Override| set.path.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(".");
        let keys: Vec<String> = self.overrides.iter().map(key).collect();
        let again =
            keys.iter().zip(&self.overrides).enumerate().filter(|(i, (key, _))| keys[..*i].contains(key));
        let what = |set: &Override| format!("it is set twice: the last one counts, --set {}", set.text);
        again.map(|(_, (key, set))| Diagnostic::warning(code::UNUSED_KEY, what(set)).about(key)).collect()
    }

    /// Every `--set` as it was typed.
    pub fn sets(&self) -> impl Iterator<Item = &str> {
        self.overrides.iter().map(|set| set.text.as_str())
    }

    /// Fingerprint of what was read: of the file's bytes, and of every `--set` and the kit behind them, each after a byte 0.
    /// Programs of one run compare it, see [`Hello::scene`](interface_defs::message::Hello::scene).
    pub fn fingerprint(&self) -> String {
        let mut bytes = self.text.clone().into_bytes();
        for text in self.sets().chain(self.kit().map(|(_, text)| text)) {
            bytes.push(0);
            bytes.extend_from_slice(text.as_bytes());
        }
        regular_file::hash(&bytes)
    }

    /// Whether it has this top-level key.
    pub fn has(&self, key: &str) -> bool {
        self.values().is_ok_and(|tree| tree.contains_key(key))
    }

    /// A top-level key (value, table, array of tables) as `T`; `None` if it is absent.
    ///
    /// An unknown key, an unknown name or a wrong type is an error with line, column and nearest name.
    pub fn read<T: DeserializeOwned>(&self, key: &str) -> Result<Option<T>, Diagnostic> {
        let Some(value) = self.values()?.remove(key) else { return Ok(None) };
        T::deserialize(Exact(value)).map(Some).map_err(|e| self.refused(key, &e))
    }

    /// What another document has at the dotted key `key` of this one as `T`; errors are located as those of [`Scene::read`].
    pub fn read_value<T: DeserializeOwned>(&self, key: &str, value: &toml::Value) -> Result<T, Diagnostic> {
        read_value(key, value).map_err(|e| self.placed(e))
    }

    fn refused(&self, key: &str, error: &Mismatch) -> Diagnostic {
        let diagnostic = error.diagnostic(key, &KEYS);
        match &error.span {
            Some(span) if self.patch.is_none() => diagnostic.at(self.place(span.clone())),
            _ => self.placed(diagnostic),
        }
    }

    /// The whole scene with every `--set` in place, unchecked.
    pub fn document(&self) -> Result<toml::Table, Diagnostic> {
        let mut table = toml::Table::new();
        for (key, value) in self.values()? {
            let key = key.into_inner().into_owned();
            let value = toml::Value::deserialize(Exact(value)).map_err(|e| self.refused(&key, &e))?;
            table.insert(key, value);
        }
        Ok(table)
    }

    /// An error about the value at a dotted key (`rock.0.mass`): located there, or at the nearest
    /// table above it that the scene has.
    pub fn invalid(&self, key: &str, message: impl Into<String>) -> Diagnostic {
        self.placed(Diagnostic::new(message).about(key))
    }

    /// The same as a refusal, with what to write instead.
    pub fn refuse<T>(
        &self,
        key: &str,
        message: impl Into<String>,
        cure: impl Into<String>,
    ) -> Result<T, Diagnostic> {
        Err(self.invalid(key, message).try_instead(cure))
    }

    /// A diagnostic with the place of its key; one that has a place, or no key, as it is.
    pub fn placed(&self, diagnostic: Diagnostic) -> Diagnostic {
        let Some(key) = diagnostic.key.as_deref().filter(|_| diagnostic.place.is_none()) else {
            return diagnostic;
        };
        let place = match self.tree().ok().and_then(|tree| nearest_span(&tree, key)) {
            Some(span) => self.place(span),
            None => Place::file(self.path.display()),
        };
        diagnostic.at(place)
    }

    /// `relative` as a path from the directory of the scene file; an absolute path stays as it is.
    pub fn resolve(&self, relative: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(relative)
    }

    /// `end_time` [s]: required, finite, above 0.
    pub fn end_time(&self) -> Result<f64, Diagnostic> {
        match self.read::<f64>("end_time")? {
            Some(t) if t > 0.0 => Ok(t),
            Some(t) => Err(self.invalid("end_time", format!("the end time is {t} s, it must lie above 0"))),
            None => {
                let missing =
                    self.invalid("end_time", "the key `end_time` is missing").coded(code::MISSING_KEY);
                let cure =
                    "write the simulated time in seconds at the top of the scene, as in end_time = 1.5";
                Err(missing.try_instead(cure))
            }
        }
    }

    /// `gravity` [m/s2]; absent means none.
    pub fn gravity(&self) -> Result<[f64; 3], Diagnostic> {
        Ok(self.read("gravity")?.unwrap_or_default())
    }

    /// The text as a tree with positions, with the kit and every `--set` in place. It is parsed anew each time: some
    /// microseconds, and nothing that borrows from itself.
    fn tree(&self) -> Result<DeTable<'_>, Diagnostic> {
        let mut tree = self.own_tree()?;
        if let Some(kit) = &self.kit {
            kit.fill(&mut tree);
        }
        for set in &self.overrides {
            set.set_in_table(&mut tree, 0)?;
        }
        if let Some(kit) = &self.kit {
            kit.settle(&mut tree);
        }
        library::fill(&mut tree).map_err(|(span, what, cure)| {
            self.error(code::UNKNOWN_NAME, span, what).about("structure.parts.of").try_instead(cure)
        })?;
        Ok(tree)
    }

    /// The text of its own file alone.
    fn own_tree(&self) -> Result<DeTable<'_>, Diagnostic> {
        let tree = DeTable::parse(&self.text).map_err(|e| {
            let span = e.span().unwrap_or(0..0);
            let hint = syntax::hint(&self.path, &self.text, span.start);
            self.error(code::SYNTAX, span, e.message()).try_if(hint)
        })?;
        Ok(tree.into_inner())
    }

    /// What is read: the text, or what a program has put in its place.
    fn values(&self) -> Result<DeTable<'_>, Diagnostic> {
        match &self.patch {
            Some(patch) => Ok(printed(patch)),
            None => self.tree(),
        }
    }

    fn error(&self, code: Code, span: Range<usize>, message: impl Into<String>) -> Diagnostic {
        Diagnostic::error(code, message).at(self.place(span))
    }

    fn place(&self, span: Range<usize>) -> Place {
        if let Some((_, file)) =
            self.added.as_ref().filter(|(from, _)| (*from..self.text.len()).contains(&span.start))
        {
            return Place::file(file.display());
        }
        if let Some(kit) = self.kit.as_ref().filter(|kit| span.start >= kit.base) {
            let own = span.start - kit.base..span.end.max(kit.base) - kit.base;
            return Place::in_text(&kit.path.display().to_string(), kit.text(), own);
        }
        let set =
            self.overrides.iter().find(|set| (set.base..set.base + set.text.len() + 1).contains(&span.start));
        match set {
            Some(set) => {
                Place::in_argument(&set.text, span.start - set.base..span.end.max(set.base) - set.base)
            }
            None => Place::in_text(&self.path.display().to_string(), &self.text, span),
        }
    }
}

/// A number, as it may be written; `None` for any other value.
pub fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// The value at a dotted key of a document, as `rock.0.mass`.
pub fn at<'a>(document: &'a toml::Table, key: &str) -> Option<&'a toml::Value> {
    let mut parts = key.split('.');
    let first = document.get(parts.next()?)?;
    parts.try_fold(first, |value, part| match part.parse::<usize>() {
        Ok(item) if value.is_array() => value.get(item),
        _ => value.get(part),
    })
}

/// What a program has printed as TOML.
fn printed(text: &str) -> DeTable<'_> {
    DeTable::parse(text).expect("a printed table is TOML").into_inner()
}

/// A value that stands in no text as `T`.
///
/// # Errors
/// With the key at fault, which begins with `key`, and without a place.
pub fn read_value<T: DeserializeOwned>(key: &str, value: &toml::Value) -> Result<T, Diagnostic> {
    let text = toml::Table::from_iter([("value".to_owned(), value.clone())]).to_string();
    let value = printed(&text).remove("value").expect("it was printed");
    T::deserialize(Exact(value)).map_err(|e| e.diagnostic(key, &KEYS))
}

/// Position of the value at a dotted key, or of the nearest table above it.
fn nearest_span(tree: &DeTable, key: &str) -> Option<Range<usize>> {
    let mut names = key.split('.');
    let mut node: &Spanned<DeValue> = tree.get(names.next()?)?;
    for name in names {
        let below = match node.get_ref() {
            DeValue::Table(table) => table.get(name),
            DeValue::Array(items) => name.parse().ok().and_then(|index: usize| items.get(index)),
            _ => None,
        };
        match below {
            Some(next) => node = next,
            None => break,
        }
    }
    Some(node.span())
}

/// One `--set`. Its positions count on behind the text of the file, so that one number tells both apart.
#[derive(Debug, Clone)]
struct Override {
    /// The argument as typed.
    text: String,
    /// Where its text begins.
    base: usize,
    path: Vec<(String, Range<usize>)>,
    /// The value as that of a key `v`, behind so many blanks that positions in it are those of all text.
    line: String,
    value_at: usize,
}

impl Override {
    /// From `path=value`; its positions begin at `base`.
    fn parse(text: &str, base: usize) -> Result<Self, Diagnostic> {
        let refuse = |what: &str| {
            Diagnostic::error(code::ARGUMENT, what)
                .at(Place::in_argument(text, 0..text.len()))
                .try_instead("write KEY=VALUE, as in --set coupling.scheme=weak or --set rock.0.mass=180")
        };
        let (key, written) = text.split_once('=').ok_or_else(|| refuse("there is no `=`"))?;
        let as_line = format!("{key} = 0");
        let mut path = Vec::new();
        let mut table = DeTable::parse(&as_line).map_err(|_| refuse("this is no path of keys"))?.into_inner();
        loop {
            let mut entries = table.into_iter();
            let (Some((name, value)), None) = (entries.next(), entries.next()) else {
                return Err(refuse("this is no path of keys"));
            };
            path.push((name.get_ref().to_string(), name.span()));
            match value.into_inner() {
                DeValue::Table(inner) => table = inner,
                _ => break,
            }
        }
        let value_at = base + text.len() - written.trim_start().len();
        let line = format!("{}v={}", " ".repeat(value_at - 2), written.trim());
        Ok(Self { text: text.to_owned(), base, path, line, value_at })
    }

    /// Set the value in `table`, to which `depth` names of its path lead; tables that are not there are made.
    fn set_in_table<'a>(&'a self, table: &mut DeTable<'a>, depth: usize) -> Result<(), Diagnostic> {
        let (name, span) = &self.path[depth];
        let span = span.start + self.base..span.end + self.base;
        let key = || Spanned::new(span.clone(), Cow::Borrowed(name.as_str()));
        if depth + 1 == self.path.len() {
            table.remove(name.as_str());
            table.insert(key(), self.value());
            return Ok(());
        }
        if !table.contains_key(name.as_str()) {
            table.insert(key(), Spanned::new(span.clone(), DeValue::Table(DeTable::new())));
        }
        self.descend(table.get_mut(name.as_str()).expect("it is there, or was just made"), depth + 1)
    }

    fn descend<'a>(&'a self, node: &mut Spanned<DeValue<'a>>, depth: usize) -> Result<(), Diagnostic> {
        match node.get_mut() {
            DeValue::Table(table) => self.set_in_table(table, depth),
            DeValue::Array(items) => {
                let count = items.len();
                let (name, _) = &self.path[depth];
                let place = name.parse().ok().and_then(|index: usize| items.get_mut(index));
                let item = place.ok_or_else(|| {
                    let last = match count {
                        0 => "which is empty".into(),
                        1 => "which holds one item; its number is 0".into(),
                        n => format!("which holds {n} items, numbered 0 to {}", n - 1),
                    };
                    self.refuse(depth, format!("`{name}` is no item of `{}`, {last}", self.prefix(depth)))
                })?;
                if depth + 1 == self.path.len() {
                    *item = self.value();
                    Ok(())
                } else {
                    self.descend(item, depth + 1)
                }
            }
            other => {
                let kind = other.type_str();
                Err(self
                    .refuse(depth, format!("`{}` is a value ({kind}), it holds no keys", self.prefix(depth))))
            }
        }
    }

    fn prefix(&self, depth: usize) -> String {
        self.path[..depth].iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(".")
    }

    fn refuse(&self, depth: usize, what: String) -> Diagnostic {
        Diagnostic::error(code::ARGUMENT, what).at(Place::in_argument(&self.text, self.path[depth].1.clone()))
    }

    /// The value, read as TOML, else as text.
    fn value(&self) -> Spanned<DeValue<'_>> {
        let read = DeTable::parse(&self.line).ok().and_then(|line| line.into_inner().remove("v"));
        read.filter(|value| value.span().end == self.line.len()).unwrap_or_else(|| {
            let text = Cow::Borrowed(&self.line[self.value_at..]);
            Spanned::new(self.value_at..self.line.len(), DeValue::String(text))
        })
    }
}

#[cfg(test)]
mod tests;
