//! A command line as a scene writes it, and the program that it means.

use interface_defs::diagnostic::{Diagnostic, code};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// Split at blanks; `'...'` and `"..."` keep what they enclose together.
pub fn split(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote: Option<char> = None;
    for c in text.chars() {
        match quote {
            Some(q) if c == q => quote = None,
            None if c == '"' || c == '\'' => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            None if c.is_whitespace() => words.extend(word.take()),
            _ => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    match quote {
        Some(q) => Err(format!("a quote {q} is not closed")),
        None if words.is_empty() => Err("the command line is empty".into()),
        None => Ok(words),
    }
}

/// The program file that `name` means: with a `/` counted from `base`, else beside this program or
/// on the search path. `Err` says where it was looked for.
pub fn find(name: &str, base: &Path) -> Result<PathBuf, String> {
    if name.contains('/') {
        let path = base.join(name);
        return match path.exists() {
            _ if is_program(&path) => Ok(path),
            true => Err(format!("{} is not a program that may be started", path.display())),
            false => Err(format!("there is no program {}", path.display())),
        };
    }
    let own = own_directory();
    let search = std::env::var_os("PATH").unwrap_or_default();
    let places = own.iter().cloned().chain(std::env::split_paths(&search));
    places.map(|dir| dir.join(name)).find(|path| is_program(path)).ok_or_else(|| {
        let own = own.map_or(String::new(), |dir| format!(" in {} or", dir.display()));
        format!("there is no program {name}{own} on the search path")
    })
}

/// A program of this project: beside this one.
pub fn own_program(name: &str) -> Result<PathBuf, Diagnostic> {
    let missing = |what: String| {
        Diagnostic::error(code::FILE, what).try_instead("build all programs with cargo build --release")
    };
    let dir = own_directory().ok_or_else(|| missing("the directory of this program is unknown".into()))?;
    let path = dir.join(name);
    let absent =
        || format!("the program {name} is missing: it belongs beside this one, in {}", dir.display());
    if is_program(&path) { Ok(path) } else { Err(missing(absent())) }
}

fn own_directory() -> Option<PathBuf> {
    std::env::current_exe().ok()?.parent().map(Path::to_path_buf)
}

fn is_program(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| m.is_file() && m.permissions().mode() & 0o111 != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_keep_words_together() {
        let words = |text: &str| split(text).expect("valid");
        assert_eq!(words("python3  solver.py\t--k 3"), ["python3", "solver.py", "--k", "3"]);
        assert_eq!(words("'my solver' --name \"a 'b'\" ''"), ["my solver", "--name", "a 'b'", ""]);
        assert_eq!(words("--k=\"1 2\""), ["--k=1 2"]);
        assert!(split("a 'b").expect_err("open").contains("not closed"));
        assert!(split("  ").is_err());
    }

    #[test]
    fn a_program_that_is_not_there_is_named_with_the_place() {
        assert!(find("./no-such", Path::new("/scenes")).expect_err("none").contains("/scenes/./no-such"));
        assert!(find("no-such-program-9f", Path::new("")).expect_err("none").contains("no-such-program-9f"));
        assert!(find("/etc/passwd", Path::new("")).expect_err("no program").contains("not a program"));
        assert!(find("sh", Path::new("")).is_ok());
    }
}
