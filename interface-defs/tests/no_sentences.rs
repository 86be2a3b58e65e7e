//! No program takes a decision from a text that was written for people: what programs say to each other has types, codes and keys.

use std::path::{Path, PathBuf};

/// Literals with two words that are compared on purpose: part of a file's path, the literal, why.
const ALLOWED: &[(&str, &str, &str)] = &[(
    "vtu/read.rs",
    r#"<AppendedData encoding=\"base64\">\n_"#,
    "the mark of the file format where the data begin",
)];

/// What compares, searches or splits a text.
const COMPARISONS: [&str; 12] = [
    "starts_with(",
    "ends_with(",
    "strip_prefix(",
    "strip_suffix(",
    "contains(",
    "split_once(",
    "rsplit_once(",
    "split(",
    "rfind(",
    "find(",
    "== ",
    "!= ",
];

/// Source files of a crate.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() && !["tests", "examples", "benches", "target"].contains(&name) {
            sources(&path, found);
        } else if path.is_file()
            && name.ends_with(".rs")
            && !name.ends_with("tests.rs")
            && !name.ends_with("_golden.rs")
        {
            found.push(path);
        }
    }
}

/// `text` with a blank for each byte of a comment, and the places of its literals, without their quotes.
fn literals(text: &str) -> (String, Vec<(usize, usize)>) {
    let bytes = text.as_bytes();
    let (mut code, mut found, mut at) = (bytes.to_vec(), Vec::new(), 0);
    while at < bytes.len() {
        let rest = &bytes[at..];
        if rest.starts_with(b"//") {
            let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
            code[at..at + end].fill(b' ');
            at += end;
        } else if rest.starts_with(b"r\"") || rest.starts_with(b"r#\"") {
            let hashes = rest[1..].iter().take_while(|b| **b == b'#').count();
            let close = format!("\"{}", "#".repeat(hashes));
            let start = at + hashes + 2;
            let length = text[start..].find(&close).expect("a raw text ends");
            found.push((start, start + length));
            at = start + length + close.len();
        } else if rest.starts_with(b"'\"'") || rest.starts_with(b"'\\") {
            // A character, which may be a quote.
            at += 3 + usize::from(rest[1] == b'\\');
        } else if rest[0] == b'"' {
            let mut end = at + 1;
            while bytes[end] != b'"' {
                end += 1 + usize::from(bytes[end] == b'\\');
            }
            found.push((at + 1, end));
            at = end + 1;
        } else {
            at += 1;
        }
    }
    (String::from_utf8(code).expect("comments end where a character does"), found)
}

/// Where `code` has items for tests alone; braces in `literals` do not count.
fn tests_of(code: &str, literals: &[(usize, usize)]) -> Vec<(usize, usize)> {
    let mut plain = code.as_bytes().to_vec();
    literals.iter().for_each(|(from, until)| plain[*from..*until].fill(b' '));
    let starts = code.match_indices("#[cfg(test)]").map(|(at, _)| at);
    let end_of = |start: usize| {
        let mut depth = 0_usize;
        let ends = |(_, byte): &(usize, &u8)| {
            depth = match byte {
                b'{' => depth + 1,
                b'}' => depth.saturating_sub(1),
                _ => depth,
            };
            depth == 0 && matches!(byte, b'}' | b';')
        };
        plain[start..].iter().enumerate().find(ends).map_or(code.len(), |(length, _)| start + length)
    };
    starts.map(|start| (start, end_of(start))).collect()
}

/// Whether a blank stands between two letters.
fn is_sentence(text: &str) -> bool {
    let letters: Vec<char> = text.chars().collect();
    letters.windows(3).any(|w| w[0].is_ascii_alphabetic() && w[1] == ' ' && w[2].is_ascii_alphabetic())
}

/// Line and literal of each text in `text` that a program compares with a sentence.
fn compared(text: &str) -> Vec<(usize, &str)> {
    let (code, all) = literals(text);
    let tests = tests_of(&code, &all);
    let inside = |at: usize| tests.iter().any(|(from, until)| (*from..*until).contains(&at));
    let mut found = Vec::new();
    for (start, end) in all {
        let before = code[..start - 1].trim_end_matches(['r', 'b', '#', '&', '[']).trim_end_matches(' ');
        let before = before.trim_end().to_owned() + if before.ends_with('=') { " " } else { "" };
        let literal = &text[start..end];
        if !inside(start) && is_sentence(literal) && COMPARISONS.iter().any(|c| before.ends_with(c)) {
            found.push((text[..start].matches('\n').count() + 1, literal));
        }
    }
    found
}

#[test]
fn no_product_code_compares_or_splits_a_sentence() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the repository");
    let mut files = Vec::new();
    for product in ["coupler", "dem-solver", "fem-solver", "interface-defs", "launch"] {
        sources(&root.join(product), &mut files);
    }
    assert!(files.len() > 400, "{} files", files.len());
    let mut wrong = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).expect("a source file");
        let name = file.strip_prefix(root).expect("a path in it").display().to_string();
        let allowed =
            |literal: &str| ALLOWED.iter().any(|(path, one, _)| name.contains(path) && literal == *one);
        let found = compared(&text).into_iter().filter(|(_, literal)| !allowed(literal));
        wrong.extend(found.map(|(line, literal)| format!("{name}:{line}: {literal:?}")));
    }
    wrong.sort();
    assert!(
        wrong.is_empty(),
        "a text for people decides here; use a type, a code or a key:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn a_compared_sentence_is_found_and_a_shown_one_is_not() {
    let text = "fn f(t: &str) {\n    // t.contains(\"a comment here\")\n    t.starts_with('\"');\n    t.contains(\n        \
                \"was lost\",\n    );\n    if t == \"not so\" {}\n    t.split_once(\" = \");\n    say(\"a text for people\");\n}\n\
                #[cfg(test)]\nmod tests { fn g() { t.contains(\"only a {test\"); } }\nfn h() { t.find(r#\"in \"raw text\"#); }";
    assert_eq!(compared(text), [(5, "was lost"), (7, "not so"), (13, "in \"raw text")]);
}
