//! The map of the code says what the code says: folders by their own first sentence, and files and functions that are there.

use std::path::{Path, PathBuf};
use tests::repository;

/// What stands in backticks in `text`, in order.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

fn page() -> String {
    std::fs::read_to_string(repository().join("ARCHITECTURE.md")).expect("the map")
}

/// Every folder with sources below `dir`, in the order of their paths: its `mod.rs` or `lib.rs`.
fn rooms(dir: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(dir).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    entries.sort();
    found.extend(entries.iter().filter(|path| path.ends_with("mod.rs") || path.ends_with("lib.rs")).cloned());
    let is_room = |path: &&PathBuf| {
        path.is_dir()
            && !["tests", "examples", "target", "data", "scenes"].iter().any(|name| path.ends_with(name))
    };
    entries.iter().filter(is_room).for_each(|path| rooms(path, found));
}

/// The first sentence of a file's own documentation.
fn sentence(path: &Path) -> String {
    let text = std::fs::read_to_string(path).expect("a source file");
    let lines = text.lines().map_while(|line| line.strip_prefix("//!")).map(str::trim);
    let paragraph: Vec<&str> = lines.take_while(|line| !line.is_empty()).collect();
    let paragraph = paragraph.join(" ");
    paragraph.split_inclusive(". ").next().unwrap_or_default().trim().to_owned()
}

/// The table of folders as the folders have it. With ROCKFALL_BLESS set it is written into the page.
#[test]
fn the_page_has_every_folder_with_its_own_first_sentence() {
    let root = repository();
    let mut files = Vec::new();
    for part in ["interface-defs", "coupler", "dem-solver", "fem-solver", "launch"] {
        rooms(&root.join(part), &mut files);
    }
    let row = |path: &PathBuf| {
        let folder = path.parent().and_then(|dir| dir.strip_prefix(&root).ok()).expect("in the repository");
        format!("| `{}` | {} |\n", folder.display(), sentence(path))
    };
    let table: String = files.iter().map(row).collect();
    let page = page();
    let (head, rest) = page.split_once("|---|---|\n").expect("the table of folders");
    let end = rest.find("\n\n").expect("its end") + 1;
    if std::env::var_os("ROCKFALL_BLESS").is_some() {
        let new = format!("{head}|---|---|\n{table}{}", &rest[end..]);
        std::fs::write(root.join("ARCHITECTURE.md"), new).expect("written");
        return;
    }
    assert!(files.len() > 40, "{}", files.len());
    assert_eq!(rest[..end], table, "run this test with ROCKFALL_BLESS=1");
}

/// Every path in backticks that names a file, counted from the folder that is named in front of it, and every function behind it.
#[test]
fn files_and_functions_are_where_the_page_says() {
    let page = page();
    let whole = quoted(&page).filter(|word| word.contains("/src/") && word.ends_with(".rs"));
    let gone: Vec<&str> = whole.filter(|path| !repository().join(path).exists()).collect();
    assert!(gone.is_empty(), "not there: {gone:?}");
    let (_, section) = page.split_once("## One window").expect("a section");
    let section = section.split("\n## ").next().expect("its end");
    let (mut folder, mut text, mut found) = (String::new(), String::new(), 0);
    let mut lost = Vec::new();
    for word in quoted(section) {
        if word.ends_with("/src") {
            folder = word.into();
        } else if word.ends_with(".rs") {
            let path = if word.contains("/src/") || word.starts_with("tests/") {
                word.into()
            } else {
                format!("{folder}/{word}")
            };
            match std::fs::read_to_string(repository().join(&path)) {
                Ok(content) => text = content,
                Err(_) => lost.push(path),
            }
        } else if !text.is_empty()
            && word.len() > 2
            && word.bytes().all(|c| c.is_ascii_lowercase() || c == b'_')
        {
            match text.contains(&format!("fn {word}")) {
                true => found += 1,
                false => lost.push(format!("{folder}: fn {word}")),
            }
        }
    }
    assert!(lost.is_empty() && found >= 15, "{found} found; not where ARCHITECTURE.md says: {lost:?}");
}
