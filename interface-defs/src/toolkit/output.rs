//! The table `[output]`: what is written, and how often.

use super::input_error::InputError;
use super::scene::Scene;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is written, and how often. An interval that is absent writes nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Interval of the rows of `history.csv` while nothing touches, and in a run without a coupler [s]; default
    /// `end_time / 200`.
    pub interval: f64,
    /// Interval of the field files in `fields/` [s]; absent: none are written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fields: Option<f64>,
    /// Whether the coupler writes `iterations.csv`.
    pub iterations: bool,
}

/// What is written, and how often.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Table {
    /// Interval of the rows of `history.csv` [s]; in a coupled run, while nothing touches: then each window has a row.
    /// Default: `end_time / 200`.
    interval: Option<f64>,
    /// Interval of the field files in `fields/` [s]. Default: none are written.
    fields: Option<f64>,
    /// Whether the coupler writes `iterations.csv`.
    #[serde(default)]
    iterations: bool,
}

/// Most rows and sets of field files of a run: beyond, a disk is full before the run ends.
const ROWS: f64 = 1e8;
const FILES: f64 = 1e5;

impl Output {
    /// From the scene; the whole table may be absent.
    pub fn of(scene: &Scene) -> Result<Self, InputError> {
        let table: Table = scene.read("output")?.unwrap_or_default();
        for (key, interval) in [("interval", table.interval), ("fields", table.fields)] {
            if let Some(seconds) = interval.filter(|i| *i <= 0.0) {
                let what = format!("an interval of {seconds} s is none, it must lie above 0");
                return Err(scene.invalid(&format!("output.{key}"), what));
            }
        }
        for (key, interval, most, of) in [
            ("interval", table.interval, ROWS, "rows"),
            ("fields", table.fields, FILES, "sets of field files"),
        ] {
            // A missing end_time is another's complaint.
            let (Some(seconds), Ok(end_time)) = (interval, scene.end_time()) else { continue };
            if end_time / seconds > most {
                let what = format!(
                    "an interval of {seconds:e} s makes {:.1e} {of} until end_time = {end_time} s, more than {most:e}",
                    end_time / seconds
                );
                let cure = format!("times are in seconds: {key} = {}", end_time / 200.0);
                return Err(scene.invalid(&format!("output.{key}"), what).try_instead(cure));
            }
        }
        let interval = match table.interval {
            Some(interval) => interval,
            None => scene.end_time()? / 200.0,
        };
        Ok(Self { interval, fields: table.fields, iterations: table.iterations })
    }
}
