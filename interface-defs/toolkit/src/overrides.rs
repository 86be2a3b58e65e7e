//! `--set key=value`: a value that takes the place of one in the scene.

use interface_defs::diagnostic::{Diagnostic, Place, code};
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// One `--set`. Its positions count on behind the text of the file, so that one number tells both apart.
#[derive(Debug, Clone)]
pub(crate) struct Override {
    /// The argument as typed.
    pub text: String,
    /// Where its text begins.
    pub base: usize,
    path: Vec<(String, Range<usize>)>,
    /// The value as that of a key `v`, behind so many blanks that positions in it are those of all text.
    line: String,
    value_at: usize,
}

impl Override {
    /// From `path=value`; its positions begin at `base`.
    pub fn parse(text: &str, base: usize) -> Result<Self, Diagnostic> {
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

    /// Set the value in `root`; tables that are not there are made.
    pub fn apply<'a>(&'a self, root: &mut DeTable<'a>) -> Result<(), Diagnostic> {
        self.set_in_table(root, 0)
    }

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
