//! The map of the code names files and functions that are there.

use tests::repository;

/// What stands in backticks in `text`, in order.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Every path in the tables and lists of `ARCHITECTURE.md` that names a file of a crate, counted from the folder that is named in
/// front of it.
#[test]
fn the_files_and_functions_of_a_window_are_where_the_map_says() {
    let page = std::fs::read_to_string(repository().join("ARCHITECTURE.md")).expect("the map");
    let section = page.split("## One window, file by file").nth(1).expect("a section");
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
            && word.chars().all(|c| c.is_ascii_lowercase() || c == '_')
            && word.len() > 2
        {
            let is_key = ["max_iterations", "element"].contains(&word);
            match is_key || text.contains(&format!("fn {word}")) {
                true => found += 1,
                false => lost.push(format!("{folder}: fn {word}")),
            }
        }
    }
    assert!(lost.is_empty() && found >= 20, "{found} found; not where ARCHITECTURE.md says: {lost:?}");
}
