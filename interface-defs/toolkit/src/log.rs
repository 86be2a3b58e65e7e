//! Logs: to stderr, by audience. What a user should know is info, warn or error; what a developer
//! looks for is debug or trace. `RUST_LOG` chooses otherwise.

use std::io::IsTerminal;
use tracing_subscriber::EnvFilter;

/// Form of the log lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// One JSON object per line.
    Json,
}

/// Log to stderr from now on: warnings and errors, and with `hints` what is being done.
pub fn init(format: LogFormat, hints: bool) {
    let default = if hints { "info" } else { "warn" };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        // Said on stderr, which is what has failed: it would end the program.
        .log_internal_errors(false);
    // A second call (two tests in one process) keeps the first.
    let _ = match format {
        LogFormat::Json => builder.json().try_init(),
        LogFormat::Text => {
            builder.with_ansi(std::io::stderr().is_terminal()).with_target(false).without_time().try_init()
        }
    };
}
