//! How far runs are: on a terminal (simulated time, windows, iterations, residual, expected end), and by the files of a run.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, IsTerminal, Read, Seek, SeekFrom};
use std::path::Path;
use std::time::{Duration, Instant};
use toolkit::files;
use toolkit::progress::Line;
use toolkit::run_dir::{HISTORY, SCENE};
use toolkit::scene::number;

/// Bytes at the end of a table in which its last row is looked for.
const TAIL: u64 = 1 << 16;
/// Parts of the bar's length.
const PARTS: u64 = 1000;

/// What is shown while runs are at work.
pub struct Progress {
    quiet: bool,
    json: bool,
    moving: Option<ProgressBar>,
    /// When the simulated time began to move, and from where.
    since: Option<(Instant, f64)>,
}

impl Progress {
    /// Lines on stderr, or with `json` in the log; `moves`: and on a terminal what is at work.
    pub fn new(quiet: bool, json: bool, moves: bool) -> Self {
        let moves = moves && !quiet && !json && io::stderr().is_terminal();
        let moving = moves.then(ProgressBar::new_spinner);
        moving.iter().for_each(|moving| moving.enable_steady_tick(Duration::from_millis(200)));
        Self { quiet, json, moving, since: None }
    }

    /// Whether it shows what is at work.
    pub fn moves(&self) -> bool {
        self.moving.is_some()
    }

    /// A line that stays.
    pub fn say(&self, line: &str) {
        match &self.moving {
            _ if self.json => tracing::info!("{line}"),
            _ if self.quiet => {}
            Some(moving) => moving.println(line),
            None => eprintln!("{line}"),
        }
    }

    /// What is at work.
    pub fn begin(&self, what: &str) {
        self.moving.iter().for_each(|moving| moving.set_message(what.to_owned()));
    }

    /// How far it is, as a process has reported.
    pub fn update(&mut self, line: &Line) {
        let Some(bar) = self.moving.as_ref().filter(|_| line.t > 0.0) else { return self.begin(&line.what) };
        let (since, from) = *self.since.get_or_insert_with(|| {
            let style = ProgressStyle::with_template("{spinner} {bar:24} {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_length(PARTS);
            (Instant::now(), line.t)
        });
        bar.set_position(((line.t / line.end).clamp(0.0, 1.0) * PARTS as f64) as u64);
        bar.set_message(describe(line, line.left(since.elapsed(), from)));
    }

    /// Take it off the screen.
    pub fn finish(&self) {
        self.moving.iter().for_each(ProgressBar::finish_and_clear);
    }
}

fn describe(line: &Line, left: Option<f64>) -> String {
    let mut text = format!("{:.4} of {} s, {} windows", line.t, line.end, line.windows);
    if line.iterations > 0 {
        text += &format!(", {} iterations", line.iterations);
    }
    if let Some(residual) = line.residual {
        text += &format!(", residual {residual:.1e}");
    }
    if let Some(left) = left {
        text += &format!(", {left:.0} s left");
    }
    text
}

/// How far the run in a directory is by its last row.
pub fn far(dir: &Path) -> String {
    let time = || -> Option<f64> { last_row(&dir.join(HISTORY))?.split(',').next()?.parse().ok() };
    // It is written once the scene has been checked.
    let scene = || files::read_text(&dir.join(SCENE)).ok()?.parse::<toml::Table>().ok();
    let Some(time) = time() else {
        let hangs = scene().is_none_or(|scene| scene.contains_key("structure"));
        let search = if hangs { ": the shape of the structure at rest is being searched" } else { "" };
        return format!("no row yet{search}");
    };
    let end_time = scene().and_then(|scene| scene.get("end_time").and_then(number));
    let share = end_time.map_or(String::new(), |end| format!(" of {end} s, {:.1} %", 100.0 * time / end));
    format!("{time:.4} s{share}")
}

/// The last whole row of a table.
fn last_row(path: &Path) -> Option<String> {
    let mut file = files::source(path).ok()?;
    let length = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(TAIL))).ok()?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let whole = &text[..=text.rfind('\n')?];
    whole.lines().next_back().map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn before_the_first_row_a_shape_at_rest_is_searched_where_there_is_a_structure() {
        let temp = tempfile::tempdir().expect("a directory");
        let far_with = |scene: &str, rows: &str| {
            std::fs::write(temp.path().join(SCENE), scene).expect("written");
            std::fs::write(temp.path().join(HISTORY), rows).expect("written");
            far(temp.path())
        };
        assert!(far_with("[structure]\n", "time_s\n").contains("at rest is being searched"));
        assert_eq!(far_with("end_time = 8\n", "time_s\n"), "no row yet");
        assert_eq!(far_with("end_time = 8\n", "time_s\n2\n"), "2.0000 s of 8 s, 25.0 %");
    }

    #[test]
    fn the_bar_tells_time_windows_iterations_residual_and_expected_end() {
        let line = Line {
            t: 0.5,
            end: 2.0,
            windows: 7,
            iterations: 21,
            residual: Some(1.5e-6),
            what: String::new(),
        };
        assert_eq!(line.left(Duration::from_secs(1), 0.25), Some(6.0));
        assert_eq!(line.left(Duration::from_secs(1), 0.5), None);
        assert_eq!(
            describe(&line, Some(6.0)),
            "0.5000 of 2 s, 7 windows, 21 iterations, residual 1.5e-6, 6 s left"
        );
        let alone = Line { iterations: 0, residual: None, ..line };
        assert_eq!(describe(&alone, None), "0.5000 of 2 s, 7 windows");
    }
}
