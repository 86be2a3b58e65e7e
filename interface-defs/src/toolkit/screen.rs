//! Text on the screen. Whoever reads it may leave early (`rockfall check scene | head`); that ends
//! neither the program nor a run.

use std::io::Write;

/// Text on stdout, as it is.
pub fn show(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// One error on stderr.
pub fn complain(message: &str) {
    let _ = writeln!(std::io::stderr(), "error: {message}");
}
