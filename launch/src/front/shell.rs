//! Words of a command line, as a shell reads them.

use std::ffi::OsStr;

/// A command line as a scene writes it, in its words. Errors: a quote is open, or there is no word.
pub fn split(text: &str) -> Result<Vec<String>, String> {
    match shlex::split(text) {
        None => Err("a quote is not closed, or a backslash ends it".into()),
        Some(words) if words.is_empty() => Err("the command line is empty".into()),
        Some(words) => Ok(words),
    }
}

/// These words as one line, which splits into them again.
pub fn join<W: AsRef<OsStr>>(words: impl IntoIterator<Item = W>) -> String {
    let words: Vec<String> = words.into_iter().map(|word| quoted(&word.as_ref().to_string_lossy())).collect();
    words.join(" ")
}

/// `key=value` stays as people write it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._=-+/:,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    // It refuses zeros alone, of which no argument has any.
    shlex::Quoter::new().allow_nul(true).quote(word).expect("nothing is refused").into_owned()
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
    fn joined_words_split_again() {
        let words = ["a", "b c", "", "d'e", "f\"g", "h\\", "#i", "it's \"j\""];
        assert_eq!(split(&join(words)).expect("valid"), words);
    }
}
