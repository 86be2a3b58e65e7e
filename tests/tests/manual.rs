//! The manual: every page is in its contents, every link leads somewhere, every command and option in it is there.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::{program, repository};

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// All pages that a reader may open.
fn pages() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for dir in [".", "docs", "interface-defs", "launch/scenes/data"] {
        let entries = std::fs::read_dir(repository().join(dir)).expect("a directory");
        found.extend(
            entries.map(|e| e.expect("an entry").path()).filter(|p| p.extension().is_some_and(|e| e == "md")),
        );
    }
    let bindings = repository().join("interface-defs/bindings");
    let below = [
        "",
        "c",
        "python",
        "golden",
        "templates/c",
        "templates/cpp",
        "templates/fortran",
        "templates/python",
        "templates/rust",
    ];
    found.extend(below.map(|dir| bindings.join(dir).join("README.md")));
    found.sort();
    found
}

/// Lines of a page outside of its code blocks.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut code = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        code ^= fence;
        !code && !fence
    })
}

/// Name of a heading in a link, as GitHub and mdBook make it.
fn anchor(heading: &str) -> String {
    let kept = heading.to_lowercase();
    kept.chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

fn anchors(text: &str) -> BTreeSet<String> {
    prose(text)
        .filter_map(|line| line.strip_prefix('#'))
        .map(|line| anchor(line.trim_start_matches('#').trim()))
        .collect()
}

#[test]
fn every_page_is_in_the_contents_and_has_its_question() {
    let docs = repository().join("docs");
    let (contents, questions) = (read(&docs.join("SUMMARY.md")), read(&docs.join("manual.md")));
    for page in pages().iter().filter(|page| page.starts_with(&docs)) {
        let name = page.file_name().expect("a name").to_string_lossy().into_owned();
        let listed = |text: &str| text.contains(&format!("({name}"));
        assert!(name == "SUMMARY.md" || listed(&contents), "{name} is not in SUMMARY.md");
        let internal = ["SUMMARY.md", "manual.md", "nightly.md"].contains(&name.as_str());
        assert!(internal || listed(&questions), "{name} answers no question in manual.md");
    }
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let mut broken = Vec::new();
    let docs = repository().join("docs");
    let contents = read(&docs.join("SUMMARY.md"));
    for page in pages() {
        let text = read(&page);
        for line in prose(&text) {
            for target in line.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
                if target.contains("://") || target.starts_with("mailto:") {
                    continue;
                }
                let (file, heading) =
                    target.split_once('#').map_or((target, None), |(file, h)| (file, Some(h)));
                let at = if file.is_empty() {
                    page.clone()
                } else {
                    page.parent().expect("a directory").join(file)
                };
                let known = |heading: &str| anchors(&read(&at)).contains(heading);
                // The site of the manual has the pages of its contents alone, and makes its own name of each link to a page.
                let listed = !page.starts_with(&docs)
                    || !file.ends_with(".md")
                    || contents.contains(&format!("({file})"));
                if !listed || !at.exists() || heading.is_some_and(|heading| !known(heading)) {
                    broken.push(format!("{}: {target}", page.display()));
                }
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Options of a command, by its help.
fn options(command: &str) -> BTreeSet<String> {
    let output = Command::new(program("rockfall")).args([command, "--help"]).output().expect("started");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "rockfall {command} is no command");
    let word = |c: char| !(c.is_ascii_alphanumeric() || c == '-');
    text.split(word).filter(|word| word.starts_with("--")).map(str::to_owned).collect()
}

#[test]
fn every_command_of_every_page_takes_the_options_that_it_has_there() {
    let mut known: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for page in pages().iter().filter(|page| !page.ends_with("CHANGELOG.md")) {
        let text = read(page);
        // Code between backticks, in blocks and in sentences.
        for code in text
            .split('`')
            .skip(1)
            .step_by(2)
            .chain(text.split("```sh\n").skip(1).filter_map(|b| b.split("```").next()))
        {
            for line in code.lines().filter_map(|line| line.trim().strip_prefix("rockfall ")) {
                let line = line.split(" -- ").next().expect("a part").split(" #").next().expect("a part");
                // What stands in quotes is one value.
                let bare: String = line.split('\'').step_by(2).collect();
                let mut words = bare.split_whitespace();
                let Some(command) = words.next().filter(|c| c.chars().all(|c| c.is_ascii_lowercase())) else {
                    continue;
                };
                seen += 1;
                let options = known.entry(command.to_owned()).or_insert_with(|| options(command));
                for option in words.filter(|word| word.starts_with("--") && word.len() > 2) {
                    let name: String =
                        option.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
                    if !options.contains(&name) {
                        wrong.push(format!("{}: rockfall {command} {name}", page.display()));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen > 100, "{seen} commands were found");
}
