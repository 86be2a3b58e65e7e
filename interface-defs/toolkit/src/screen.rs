//! Text on the screen. Whoever reads it may leave early (`rockfall check scene | head`); that ends
//! neither the program nor a run.

use interface_defs::diagnostic::Diagnostic;
use std::io::Write;

/// Names a file to which a program appends its errors as data, one JSON object a line, beside what it prints: from there whoever
/// started it knows what happened.
pub const DIAGNOSTICS: &str = "ROCKFALL_DIAGNOSTICS";

/// Text on stdout, as it is.
pub fn show(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// One error on stderr, and in the file of [`DIAGNOSTICS`].
pub fn complain(error: &Diagnostic) {
    let _ = writeln!(std::io::stderr(), "error: {error}");
    let Some(path) = std::env::var_os(DIAGNOSTICS) else { return };
    // What cannot be written is on the screen.
    if let (Ok(text), Ok(mut file)) =
        (serde_json::to_string(error), std::fs::File::options().append(true).open(path))
    {
        let _ = writeln!(file, "{text}");
    }
}

/// The errors that a program has left in the file of [`DIAGNOSTICS`], whose content is `text`.
pub fn complaints(text: &str) -> Vec<Diagnostic> {
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}
