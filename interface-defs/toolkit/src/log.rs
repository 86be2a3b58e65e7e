//! Logs: to stderr, by audience. What a user should know is info, warn or error; what a developer
//! looks for is debug or trace. `RUST_LOG` chooses otherwise.

use super::profile;
use interface_defs::Diagnostic;
use std::io::IsTerminal;
use std::path::Path;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::prelude::*;

/// Form of the log lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// One JSON object per line.
    Json,
}

/// Log to stderr from now on: warnings and errors, and with `hints` what is being done; and what this process does when to the file
/// `profile`, as `name`.
///
/// # Errors
/// If that file cannot be written.
pub fn init(
    format: LogFormat,
    hints: bool,
    (profile, name): (Option<&Path>, &str),
) -> Result<(), Diagnostic> {
    let default = Targets::new().with_default(if hints { LevelFilter::INFO } else { LevelFilter::WARN });
    let filter = std::env::var("RUST_LOG").ok().and_then(|text| text.parse().ok()).unwrap_or(default);
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        // Said on stderr, which is what has failed: it would end the program.
        .log_internal_errors(false);
    let lines = match format {
        LogFormat::Json => lines.json().boxed(),
        LogFormat::Text => {
            lines.with_ansi(std::io::stderr().is_terminal()).with_target(false).without_time().boxed()
        }
    };
    // A second call (two tests in one process) keeps the first.
    let all = tracing_subscriber::registry().with(lines.with_filter(filter));
    let _ = match profile {
        None => all.try_init(),
        Some(path) => {
            let unwritable = |e| Diagnostic::in_file(path.display(), format!("it cannot be written: {e}"));
            all.with(profile::begin(path, name).map_err(unwritable)?).try_init()
        }
    };
    Ok(())
}
