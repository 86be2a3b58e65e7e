//! `--profile`: what a process does, and when, as trace events that Perfetto and `chrome://tracing` show.
//!
//! The crates that write this form do not fit: with `tracing-chrome` 0.7 every process has the number 1 and a zero of time of its own,
//! so that processes cannot be shown on one clock. Here all count from the start of the machine (CLOCK_MONOTONIC).

use super::files::{self, Stream};
use interface_defs::PROFILE;
use rustix::time::{ClockId, clock_gettime};
use serde::de::IgnoredAny;
use serde_json::{Map, Value, json};
use std::fmt::Debug;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::{Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;

/// Where the events of this process go. Of the process, as its subscriber is, which is never dropped.
static FILE: OnceLock<Mutex<BufWriter<Stream>>> = OnceLock::new();

/// Begin the file of this process, `name` in the picture.
///
/// # Errors
/// If it cannot be written.
pub fn begin<S: Subscriber + for<'a> LookupSpan<'a>>(path: &Path, name: &str) -> io::Result<impl Layer<S>> {
    let (mut file, process) = (BufWriter::new(files::create(path)?), std::process::id());
    let name = json!({ "ph": "M", "name": "process_name", "pid": process, "args": { "name": name } });
    write!(file, "[\n{name}")?;
    let _ = FILE.set(Mutex::new(file));
    Ok(Events.with_filter(Targets::new().with_target(PROFILE, Level::TRACE)))
}

/// End it: from here on it is JSON as a whole. What cannot be written is missing in the picture, and no fault of the run.
pub fn end() {
    with_file(|file| write!(file, "\n]\n").and_then(|()| file.flush()));
}

fn with_file(write: impl FnOnce(&mut BufWriter<Stream>) -> io::Result<()>) {
    if let Some(file) = FILE.get() {
        let _ = write(&mut file.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

/// File of the process `name` of a run whose logs lie in `dir`.
pub fn part(dir: &Path, name: &str) -> PathBuf {
    dir.join(format!("{name}.profile.log"))
}

/// Write all events of `parts` to `file`, and remove them. Of a process that was killed, what it had written.
///
/// # Errors
/// If a part cannot be read, or the file not be written.
pub fn join(file: Stream, parts: impl IntoIterator<Item = PathBuf>) -> io::Result<()> {
    let (mut file, mut between) = (BufWriter::new(file), "[\n");
    for part in parts {
        // There is none of a program that does not know the option.
        let Some(source) = files::if_there(files::source(&part))? else { continue };
        for line in BufReader::new(source).split(b'\n') {
            let line = line?;
            let event = line.strip_suffix(b",").unwrap_or(&line);
            // The last line of a process that was killed is torn.
            if event.starts_with(b"{") && serde_json::from_slice::<IgnoredAny>(event).is_ok() {
                file.write_all(between.as_bytes())?;
                file.write_all(event)?;
                between = ",\n";
            }
        }
        files::remove(&part)?;
    }
    write!(file, "{}\n]\n", if between == "[\n" { between } else { "" })?;
    file.flush()
}

/// Writes a span as an event when it ends.
struct Events;

/// When a span began [ns], and what is said of it.
struct Begun(i64, Fields);

fn now() -> i64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}

/// Number of this thread: spans of one nest, those of two may cross.
fn thread() -> u64 {
    static THREADS: AtomicU64 = AtomicU64::new(1);
    thread_local!(static THREAD: u64 = THREADS.fetch_add(1, Ordering::Relaxed));
    THREAD.with(|number| *number)
}

impl<S: Subscriber + for<'a> LookupSpan<'a>> Layer<S> for Events {
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let mut fields = Fields::default();
        attributes.record(&mut fields);
        if let Some(span) = context.span(id) {
            span.extensions_mut().insert(Begun(now(), fields));
        }
    }

    fn on_close(&self, id: Id, context: Context<'_, S>) {
        let end = now();
        let Some(span) = context.span(&id) else { return };
        let Some(Begun(begin, Fields(fields))) = span.extensions_mut().remove() else { return };
        let [at, took] = [begin, end - begin].map(|ns| ns as f64 / 1e3);
        let event = json!({
            "ph": "X", "name": span.name(), "ts": at, "dur": took, "pid": std::process::id(), "tid": thread(), "args": fields,
        });
        with_file(|file| write!(file, ",\n{event}"));
    }
}

#[derive(Default)]
struct Fields(Map<String, Value>);

impl Visit for Fields {
    fn record_u64(&mut self, field: &Field, value: u64) {
        self.0.insert(field.name().into(), value.into());
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.0.insert(field.name().into(), value.into());
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.0.insert(field.name().into(), format!("{value:?}").into());
    }
}
