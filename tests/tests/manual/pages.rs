//! The manual: every page is in its contents, every link leads somewhere, every command and option in it is there.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::{program, repository};

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// All pages that a reader may open.
fn pages() -> Vec<PathBuf> {
    tests::manual::pages().iter().map(|page| repository().join(page)).collect()
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
    for page in pages().iter().filter(|page| page.parent() == Some(&docs)) {
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
                let own = at.strip_prefix(&docs).unwrap_or(&at).display().to_string();
                let own = own.replace("measured/../", "");
                let listed = !page.starts_with(&docs)
                    || !file.ends_with(".md")
                    || contents.contains(&format!("({own})"));
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

/// Whether a scene, a study, ... may have the key at `path`.
fn takes(schema: &Value, root: &Value, path: &[&str]) -> bool {
    let Some((key, rest)) = path.split_first() else { return true };
    let of_list = key.parse::<usize>().is_ok().then(|| schema.get("items")).flatten();
    let own = schema.get("properties").and_then(|all| all.get(key)).or(of_list);
    let named = schema
        .get("$ref")
        .and_then(Value::as_str)
        .and_then(|name| root.pointer(name.trim_start_matches('#')));
    let parts =
        ["allOf", "anyOf", "oneOf"].into_iter().filter_map(|word| schema.get(word)?.as_array()).flatten();
    own.is_some_and(|own| takes(own, root, rest)) || parts.chain(named).any(|part| takes(part, root, path))
}

/// What a page names of the repository and of a scene is there: examples, options of scripts, sections of the nightly check, keys.
#[test]
fn examples_scripts_and_keys_of_every_page_are_there() {
    let schemas = [&[][..], &["--study"], &["--calibration"], &["--kit"]].map(|kind| -> Value {
        let output = Command::new(program("rockfall")).arg("schema").args(kind).output().expect("started");
        serde_json::from_slice(&output.stdout).expect("JSON")
    });
    let tables = |schema: &Value| {
        schema["properties"].as_object().expect("tables").keys().cloned().collect::<Vec<_>>()
    };
    let known = |key: &str| {
        let path: Vec<&str> = key.trim_start_matches("barrier.").split('.').collect();
        path[0] == "custom" || schemas.iter().any(|schema| takes(schema, schema, &path))
    };
    let nightly = read(&repository().join(".ci/nightly"));
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for page in pages().iter().filter(|page| !page.ends_with("CHANGELOG.md")) {
        let text = read(page).replace("\\\n", " ");
        let spans = text.split('`').map(|code| code.replace('\n', " "));
        for line in text.lines().map(str::to_owned).chain(spans) {
            let words: Vec<&str> =
                line.split([' ', '`', '(', ')', ',', '\'']).filter(|word| !word.is_empty()).collect();
            let mut is = |there: bool, what: &str| {
                seen += 1;
                if !there {
                    wrong.push(format!("{}: {what}", page.display()));
                }
            };
            for two in words.windows(2) {
                let example =
                    |dir: &str| repository().join(dir).join(format!("examples/{}.rs", two[1])).exists();
                match two[0] {
                    "--example" => {
                        let all = ["tests", "dem-solver", "fem-solver", "interface-defs"];
                        is(all.into_iter().any(example) || two[1] == "NAME", two[1]);
                    }
                    ".ci/nightly" if !two[1].starts_with('#') && line.trim_start().starts_with(".ci") => {
                        is(nightly.contains(&format!("{}() {{", two[1])), two[1]);
                    }
                    "--set" => {
                        let key = two[1].split('=').next().expect("a part").trim_matches('"');
                        let is_key = key.starts_with(|c: char| c.is_ascii_lowercase())
                            && key.contains('.')
                            && !key.contains("..");
                        is(!is_key || known(key), key);
                    }
                    _ => {}
                }
            }
            let script = words.iter().find(|word| word.ends_with(".py") && word.contains('/'));
            if let Some(script) = script.filter(|_| words[0].ends_with("python")) {
                is(repository().join(script).exists(), script);
                // The scripts of a folder share some.
                let beside = repository().join(script).parent().expect("a folder").join("falls.py");
                let script =
                    read(&repository().join(script)) + &std::fs::read_to_string(beside).unwrap_or_default();
                let options =
                    words.iter().take_while(|word| **word != "#").filter(|word| word.starts_with("--"));
                options.for_each(|option| {
                    is(
                        ["", "--"]
                            .iter()
                            .any(|dashes| script.contains(&option.replace("--", &format!("\"{dashes}")))),
                        option,
                    )
                });
            }
        }
        // A key in the text, by its table.
        for code in prose(&text)
            .filter(|line| !line.starts_with('#'))
            .flat_map(|line| line.split('`').skip(1).step_by(2))
        {
            let key = code.split(" = ").next().expect("a part");
            let written =
                key.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "._".contains(c));
            let file =
                ["pvd", "state", "vtu", "toml", "csv", "json", "py", "rs", "asc", "md", "svg", "html", "log"];
            let own = key.split_once('.').is_some_and(|(table, rest)| {
                !rest.is_empty() && tables(&schemas[0]).iter().any(|t| t == table) && !file.contains(&rest)
            });
            if written && own && !key.contains("..") {
                seen += 1;
                if !known(key) {
                    wrong.push(format!("{}: {key}", page.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen > 200, "{seen}");
}
