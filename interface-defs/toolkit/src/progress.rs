//! `--progress json`: lines on stdout from which a launcher draws its bar.

use serde::{Deserialize, Serialize};
use std::io::Write;
use std::time::{Duration, Instant};

/// How often a line is printed.
const EVERY: Duration = Duration::from_millis(200);

/// Form of the progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Form {
    /// One JSON object per line.
    Json,
}

/// How far a run is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Simulated time [s].
    pub t: f64,
    /// End of the run [s].
    pub end: f64,
    /// Committed windows.
    pub windows: u64,
    /// Coupling iterations.
    pub iterations: u64,
    /// Residual of the last window, where there is one.
    pub residual: Option<f64>,
    /// What is being done.
    pub what: String,
}

impl Line {
    /// Seconds that are left, if the rest goes as fast as what was done in the time `elapsed` since it was at `from`.
    pub fn left(&self, elapsed: Duration, from: f64) -> Option<f64> {
        let done = self.t - from;
        (done > 0.0).then(|| elapsed.as_secs_f64() * (self.end - self.t).max(0.0) / done)
    }
}

/// Prints lines, some five a second.
#[derive(Debug, Default)]
pub struct Reporter {
    on: bool,
    last: Option<Instant>,
}

impl Reporter {
    /// One that prints, or one that does nothing.
    pub fn new(form: Option<Form>) -> Self {
        Self { on: form.is_some(), last: None }
    }

    /// Print a line if one is due.
    pub fn report(&mut self, line: impl FnOnce() -> Line) {
        if !self.on || self.last.is_some_and(|last| last.elapsed() < EVERY) {
            return;
        }
        self.last = Some(Instant::now());
        let mut out = std::io::stdout().lock();
        // Whoever reads progress may have gone; the run goes on.
        let _ = serde_json::to_writer(&mut out, &line());
        let _ = writeln!(out).and_then(|()| out.flush());
    }
}
