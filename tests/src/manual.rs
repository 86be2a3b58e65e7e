//! The pages that come with the repository, and what stands in them.

use crate::{Bench, example, repository, scene};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Every page of the repository, as a path from its folder.
pub fn pages() -> Vec<String> {
    fn below(dir: &Path, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(dir).expect("a directory") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            if path.is_dir()
                && !name.starts_with('.')
                && !["target", "manual", "out"].contains(&name.as_str())
            {
                below(&path, found);
            } else if name.ends_with(".md") {
                let own = path.strip_prefix(repository()).expect("in the repository");
                found.push(own.to_string_lossy().into_owned());
            }
        }
    }
    let mut found = Vec::new();
    below(&repository(), &mut found);
    found.sort();
    found
}

/// The text of a page.
pub fn text(page: &str) -> String {
    std::fs::read_to_string(repository().join(page)).unwrap_or_else(|e| panic!("{page}: {e}"))
}

/// A block of code in a page.
pub struct Block {
    /// What stands behind its fence.
    pub language: String,
    /// The line at which it begins.
    pub line: usize,
    /// Its lines.
    pub text: String,
}

/// The blocks of a page, in their order.
pub fn blocks(page: &str) -> Vec<Block> {
    let (mut found, mut open) = (Vec::<Block>::new(), false);
    for (line, content) in (1..).zip(text(page).lines()) {
        match content.trim_start().strip_prefix("```") {
            Some(language) if !open => {
                found.push(Block { language: language.to_owned(), line, text: String::new() });
                open = true;
            }
            Some(_) => open = false,
            None if open => found.last_mut().expect("begun").text += &format!("{content}\n"),
            None => {}
        }
    }
    found
}

/// The text of the blocks of a page in one language.
pub fn blocks_in(page: &str, language: &str) -> Vec<String> {
    blocks(page).into_iter().filter(|block| block.language == language).map(|block| block.text).collect()
}

/// A number as a page writes it: `-0.12`, `3 200`, `6e-5`.
struct Written {
    bytes: usize,
    decimals: usize,
    power: Option<i32>,
    value: f64,
    /// One in its last digit; zeros at the end of a whole number are none.
    unit: f64,
}

impl Written {
    /// The number at the beginning of `text`.
    fn at(text: &str) -> Option<Self> {
        let bytes = text.as_bytes();
        let digits =
            |from: usize| bytes[from.min(bytes.len())..].iter().take_while(|b| b.is_ascii_digit()).count();
        let first = usize::from(text.starts_with(['+', '-']));
        let mut end = first + digits(first);
        if end == first {
            return None;
        }
        // Thousands are set apart.
        let apart = end - first <= 3;
        while apart && bytes.get(end) == Some(&b' ') && digits(end + 1) == 3 {
            end += 4;
        }
        let whole: String = text[first..end].replace(' ', "");
        let zeros = whole.len() - whole.trim_end_matches('0').len();
        let mut unit = if zeros < whole.len() { 10_f64.powi(zeros as i32) } else { 1.0 };
        let decimals = if bytes.get(end) == Some(&b'.') { digits(end + 1) } else { 0 };
        if decimals > 0 {
            end += 1 + decimals;
            unit = 10_f64.powi(-(decimals as i32));
        }
        let signed = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let (from, count) = (end + 1, signed + digits(end + 1 + signed));
        let mut power = None;
        if bytes.get(end) == Some(&b'e') && count > signed {
            power = text[from..from + count].parse().ok();
            unit = 10_f64.powi(power? - decimals as i32);
            end = from + count;
        }
        let value = text[..end].replace(' ', "").parse().ok()?;
        Some(Self { bytes: end, decimals, power, value, unit })
    }

    /// To one in the last digit; nothing is NaN.
    fn is(&self, value: f64) -> bool {
        (self.value - value).abs() <= self.unit * (1.0 + 1e-9)
    }

    /// `value` with as many digits.
    fn renewed(&self, old: &str, value: f64) -> String {
        let value = (value / self.unit).round() * self.unit;
        let sign = if old.starts_with('+') && value >= 0.0 { "+" } else { "" };
        if self.power.is_some() {
            return format!("{sign}{value:.*e}", self.decimals);
        }
        let mut new = format!("{value:.*}", self.decimals);
        let whole = new.find('.').unwrap_or(new.len());
        if whole > 3 && (old.contains(' ') || self.decimals == 0) {
            (1..whole).rev().filter(|at| (whole - at) % 3 == 0).for_each(|at| new.insert(at, ' '));
        }
        sign.to_owned() + &new
    }
}

/// Where `literal` stands in `text` from `from` on: its end; any space of it is any white space of the page.
fn behind(text: &str, from: usize, literal: &str) -> Option<usize> {
    let (mut at, mut rest) = (from, literal);
    while let Some(c) = rest.chars().next() {
        rest = &rest[c.len_utf8()..];
        let here = text.get(at..)?;
        let step = if c == ' ' {
            here.len() - here.trim_start().len()
        } else {
            usize::from(here.starts_with(c)) * c.len_utf8()
        };
        if step == 0 {
            return None;
        }
        at += step;
    }
    Some(at)
}

/// Where the numbers stand that `template` has as `{}`, if it fits at `from`.
fn fitting(text: &str, from: usize, template: &str) -> Option<Vec<(usize, Written)>> {
    let mut parts = template.split("{}");
    let mut at = behind(text, from, parts.next()?)?;
    let mut found = Vec::new();
    for part in parts {
        let number = Written::at(&text[at..])?;
        let end = at + number.bytes;
        found.push((at, number));
        at = behind(text, end, part)?;
    }
    Some(found)
}

/// The only place of `page` that `template` fits.
fn only(page: &str, all: &str, template: &str) -> Vec<(usize, Written)> {
    let mut found: Vec<_> = all.char_indices().filter_map(|(from, _)| fitting(all, from, template)).collect();
    assert_eq!(found.len(), 1, "{page}: how often it has these words: {template}");
    found.remove(0)
}

/// The number that stands in `page` where `template` has `{}`.
pub fn quoted(page: &str, template: &str) -> f64 {
    only(page, &text(page), template)[0].1.value
}

/// The words of `page`, with `{}` for each of its numbers, are there once, and each number is that of `values` to one in its last digit.
///
/// With ROCKFALL_BLESS set a number that is not is written anew (one test at a time: `--test-threads=1`).
pub fn holds(page: &str, template: &str, values: &[f64]) {
    compare(page, template, values, Written::is);
}

/// The same of numbers that are left to chance, as those of a rock after many bounces or of a barrier that swings: the last bit of a
/// formula changes them. They are within a quarter of those of the page.
pub fn holds_about(page: &str, template: &str, values: &[f64]) {
    compare(page, template, values, |written, value| {
        written.is(value) || (value - written.value).abs() <= 0.25 * written.value.abs()
    });
}

fn compare(page: &str, template: &str, values: &[f64], is: impl Fn(&Written, f64) -> bool) {
    let mut all = text(page);
    let found = only(page, &all, template);
    assert_eq!(found.len(), values.len(), "{page}: {template}");
    let bless = std::env::var_os("ROCKFALL_BLESS").is_some();
    let off = found
        .iter()
        .zip(values)
        .filter(|((_, n), value)| if bless { !n.is(**value) } else { !is(n, **value) });
    let off: Vec<_> = off.map(|((at, n), value)| (*at..*at + n.bytes, n, *value)).collect();
    if bless {
        for (place, number, value) in off.into_iter().rev() {
            let new = number.renewed(&all[place.clone()], value);
            all.replace_range(place, &new);
        }
        std::fs::write(repository().join(page), all).expect("written");
        return;
    }
    let wrong: Vec<_> =
        off.iter().map(|(place, _, value)| format!("{} is {value}", &all[place.clone()])).collect();
    assert!(
        wrong.is_empty(),
        "{page}: {template}: {}; run this test with ROCKFALL_BLESS=1",
        wrong.join(", ")
    );
}

/// The rows that the example `rings` prints of a case: travel, and what belongs to it.
pub fn rings(case: &str) -> Vec<Vec<f64>> {
    let output = Command::new(example("rings")).args(case.split_whitespace()).output().expect("started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    rows.map(|row| row.split_whitespace().map(|n| n.parse().expect("a number")).collect()).collect()
}

/// The first four columns of such rows where `column` first reaches `value`, straight between rows.
pub fn reached(rows: &[Vec<f64>], column: usize, value: f64) -> Vec<f64> {
    let i = rows.iter().position(|row| row[column] >= value).expect("is reached");
    let share = (value - rows[i - 1][column]) / (rows[i][column] - rows[i - 1][column]);
    (0..4).map(|c| rows[i - 1][c] + share * (rows[i][c] - rows[i - 1][c])).collect()
}

/// A scene of the project without these tables.
pub fn without(bench: &Bench, name: &str, tables: &[&str]) -> PathBuf {
    let text = std::fs::read_to_string(scene(name)).expect("a scene");
    let mut taken = true;
    let kept = text.lines().filter(|line| {
        if line.starts_with('[') {
            taken = !tables.iter().any(|table| line.starts_with(table));
        }
        taken
    });
    bench.scene(&kept.map(|line| format!("{line}\n")).collect::<String>())
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn numbers_as_pages_write_them() {
        for (text, value, unit, bytes) in [
            ("3 200 kg", 3200.0, 100.0, 5),
            ("0.49514, 33 823", 0.49514, 1e-5, 7),
            ("33 823 N", 33823.0, 1.0, 6),
            ("+5.6e-5 s", 5.6e-5, 1e-6, 7),
            ("7e-6 |", 7e-6, 1e-6, 4),
            ("64 spheres", 64.0, 1.0, 2),
            ("0 |", 0.0, 1.0, 1),
        ] {
            let found = Written::at(text).expect("a number");
            assert_eq!((found.value, found.bytes), (value, bytes), "{text}");
            assert!((found.unit / unit - 1.0).abs() < 1e-9, "{text}: {}", found.unit);
        }
        assert!(Written::at("- |").is_none());
        let renewed = |old: &str, value: f64| Written::at(old).expect("a number").renewed(old, value);
        assert_eq!(renewed("33 823", 1234.4), "1 234");
        assert_eq!(renewed("+0.10", 0.126), "+0.13");
        assert_eq!(renewed("7e-6", 8.4e-6), "8e-6");
        assert_eq!(renewed("1 050", 1062.0), "1 060");
        let page = "one\ntwo 3.0 m\nand 4";
        assert_eq!(fitting(page, 0, "one two {} m and {}").map(|f| f.len()), Some(2));
        assert!(fitting(page, 0, "one two {} s").is_none());
    }
}
