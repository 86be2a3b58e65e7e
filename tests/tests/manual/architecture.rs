//! The map of the code says what the code says: folders by their own first sentence, and files and functions that are there.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use tests::repository;

/// What stands in backticks in `text`, in order.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

fn page() -> String {
    std::fs::read_to_string(repository().join("ARCHITECTURE.md")).expect("the map")
}

/// Every folder with sources below `dir`, in the order of their paths: its `mod.rs` or `lib.rs`, or the `main.rs` of a program without.
fn rooms(dir: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(dir).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    entries.sort();
    let own = |name: &str| entries.iter().find(|path| path.ends_with(name));
    found.extend(own("mod.rs").or(own("lib.rs")).or(own("main.rs")).cloned());
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
    let recipes = std::fs::read_to_string(repository().join("CONTRIBUTING.md")).expect("the recipes");
    let whole = quoted(&page).filter(|word| word.contains("/src/") && word.ends_with(".rs"));
    let of_recipes = quoted(&recipes).filter(|word| {
        ["coupler/", "dem-solver/", "fem-solver/", "interface-defs/", "launch/", "tests/"]
            .iter()
            .any(|folder| word.starts_with(folder))
            && word.ends_with(".rs")
            && !word.contains("NAME")
    });
    let gone: Vec<&str> = whole.chain(of_recipes).filter(|path| !repository().join(path).exists()).collect();
    assert!(gone.is_empty(), "not there: {gone:?}");
    let (_, section) = page.split_once("## One window").expect("a section");
    let (section, _) = section.split_once("## Invariants").expect("its end");
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
    assert!(lost.is_empty() && found >= 25, "{found} found; not where ARCHITECTURE.md says: {lost:?}");
}

/// A module by the names that lead to it from the root of its crate.
type Module = Vec<String>;

/// The source of each module of the crate whose sources are in `dir`, without lines of comment and without its tests.
fn modules(dir: &Path, at: &Module, found: &mut BTreeMap<Module, String>) {
    for entry in std::fs::read_dir(dir).expect("a folder") {
        let path = entry.expect("an entry").path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).expect("a name").to_owned();
        let below = || [at.clone(), vec![stem.clone()]].concat();
        if path.is_dir() {
            modules(&path, &below(), found);
        } else if path.extension().is_some_and(|ending| ending == "rs") && stem != "tests" {
            let module = if ["lib", "main", "mod"].contains(&&*stem) { at.clone() } else { below() };
            let text = std::fs::read_to_string(&path).expect("a source file");
            let product = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            let code = product.lines().filter(|line| !line.trim_start().starts_with("//"));
            *found.entry(module).or_default() += &code.collect::<Vec<_>>().join("\n");
        }
    }
}

/// The paths of a use tree, each written out.
fn written_out(tree: &str) -> Vec<String> {
    let Some((head, rest)) = tree.split_once('{') else { return vec![tree.trim().to_owned()] };
    let inside = rest.rsplit_once('}').map_or(rest, |(inside, _)| inside);
    let mut depth = 0;
    let branches = inside.split(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    let paths = branches.filter(|branch| !branch.trim().is_empty()).flat_map(written_out);
    paths.map(|path| format!("{}{path}", head.trim())).collect()
}

/// What the module `of` names: the innermost module of each path in its code.
fn named(of: &Module, code: &str, all: &BTreeMap<Module, String>) -> BTreeSet<Module> {
    let trees = code.split("use ").skip(1).filter_map(|rest| rest.split_once(';'));
    let mut paths: Vec<String> = trees.flat_map(|(tree, _)| written_out(tree)).collect();
    let in_place = code.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
    paths.extend(in_place.filter(|path| path.contains("::")).map(str::to_owned));
    let module = |path: &String| {
        let mut names = path.split("::").map(str::trim).peekable();
        let mut module = match names.peek() {
            Some(&"crate") => Module::new(),
            Some(&"super" | &"self") => of.clone(),
            Some(&child) if code.contains(&format!("mod {child};")) => of.clone(),
            _ => return None,
        };
        for name in names {
            match name {
                "crate" | "self" => {}
                "super" => drop(module.pop()),
                name => {
                    module.push(name.to_owned());
                    if !all.contains_key(&module) {
                        module.pop();
                        break;
                    }
                }
            }
        }
        // A folder's own file and what is in the folder are one.
        (!module.starts_with(of) && !of.starts_with(&module)).then_some(module)
    };
    paths.iter().filter_map(module).collect()
}

/// Modules that use each other, one through the other, in the crate at `src`.
fn circle(src: &Path) -> Option<Vec<Module>> {
    let mut all = BTreeMap::new();
    modules(src, &Module::new(), &mut all);
    let mut uses: BTreeMap<&Module, BTreeSet<Module>> =
        all.iter().map(|(module, code)| (module, named(module, code, &all))).collect();
    // What uses nothing that is left, or what nothing that is left uses, is in no circle.
    loop {
        let before = uses.len();
        let left: BTreeSet<Module> = uses.keys().map(|module| (*module).clone()).collect();
        uses.retain(|_, used| used.iter().any(|module| left.contains(module)));
        let used: BTreeSet<Module> = uses.values().flatten().cloned().collect();
        uses.retain(|module, _| used.contains(*module));
        if uses.len() == before {
            break;
        }
    }
    (!uses.is_empty()).then(|| uses.into_keys().cloned().collect())
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let (root, mut crates) = (repository(), 0);
    let own = ["interface-defs", "coupler", "dem-solver", "fem-solver", "launch"].map(|name| root.join(name));
    let inner = own.iter().flat_map(|dir| std::fs::read_dir(dir).expect("a folder"));
    let inner: Vec<PathBuf> = inner.map(|entry| entry.expect("an entry").path()).collect();
    for src in own.iter().chain(&inner).map(|dir| dir.join("src")).filter(|src| src.is_dir()) {
        crates += 1;
        assert_eq!(circle(&src), None, "they form a circle in {}", src.display());
    }
    assert!(crates > 8, "{crates}");
}

#[test]
fn a_circle_is_found_through_braces_and_paths_in_place() {
    let temp = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| std::fs::write(temp.path().join(name), text).expect("written");
    write("lib.rs", "mod a;\nmod b;\nmod c;\nuse a::A;\n");
    write("a.rs", "use crate::{b::{B, Other}, std::fmt};\n");
    write("b.rs", "fn f() -> super::c::C {}\n");
    write("c.rs", "pub struct C;\n// use crate::a::A;\n");
    assert_eq!(circle(temp.path()), None);
    write("c.rs", "pub struct C(crate::a::A);\n");
    assert_eq!(circle(temp.path()).map(|modules| modules.len()), Some(3));
}
