//! The table `[output]`: what is written, and how often.

use super::numbers::short;
use super::scene::Scene;
use interface_defs::diagnostic::{Diagnostic, code};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is written, and how often. An interval that is absent writes nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Interval of the rows of `history.csv` while nothing touches, and in a run without a coupler [s]; default
    /// `end_time / 200`.
    pub interval: f64,
    /// Interval of the field files in `fields/` [s]; absent: none are written.
    pub fields: Option<f64>,
    /// Whether the coupler writes `iterations.csv`.
    pub iterations: bool,
    /// Wall time between two checkpoints, from which a run that was killed goes on [s]; 0: none are written.
    pub checkpoint: f64,
    /// Whether `rockfall` writes `report.html`.
    pub report: bool,
}

/// Wall time between two checkpoints where the scene does not say [s]: what is lost at most, and some 1e-4 of a run's time.
const CHECKPOINT: f64 = 30.0;

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
    /// Wall time between two checkpoints, from which a run that was killed goes on with `--resume` [s]; 0: none are written.
    /// Default 30.
    checkpoint: Option<f64>,
    /// Whether `rockfall` writes `report.html`, the results as one page. Default: it does.
    report: Option<bool>,
}

/// Most rows and sets of field files of a run: beyond, a disk is full before the run ends.
const ROWS: f64 = 1e8;
const FILES: f64 = 1e5;

impl Output {
    /// From the scene; the whole table may be absent.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        let table: Table = scene.read("output")?.unwrap_or_default();
        for (key, interval, most, of) in [
            ("interval", table.interval, ROWS, "rows"),
            ("fields", table.fields, FILES, "sets of field files"),
        ] {
            let Some(seconds) = interval else { continue };
            let refuse = |what: String| scene.invalid(&format!("output.{key}"), what);
            if seconds <= 0.0 {
                return Err(refuse(format!("an interval of {seconds} s is none, it must lie above 0")));
            }
            // A missing end_time is another's complaint.
            let Ok(end_time) = scene.end_time() else { continue };
            if end_time / seconds > most {
                let what = format!(
                    "an interval of {seconds:e} s makes {:.1e} {of} until end_time = {end_time} s, more than {most:e}",
                    end_time / seconds
                );
                let cure = format!("times are in seconds: {key} = {}", end_time / 200.0);
                return Err(refuse(what).try_instead(cure));
            }
        }
        let checkpoint = table.checkpoint.unwrap_or(CHECKPOINT);
        if !(checkpoint >= 0.0 && checkpoint.is_finite()) {
            let what = format!("{checkpoint} s between two checkpoints: it must be 0 or above");
            return scene.refuse("output.checkpoint", what, "checkpoint = 0 writes none");
        }
        let interval = table.interval.map_or_else(|| scene.end_time().map(|end| end / 200.0), Ok)?;
        Ok(Self {
            interval,
            fields: table.fields,
            iterations: table.iterations,
            checkpoint,
            report: table.report.unwrap_or(true),
        })
    }

    /// Intervals that are longer than the run: nothing is written between its begin and its end.
    pub fn warnings(scene: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
        let table: Table = scene.read("output")?.unwrap_or_default();
        let end_time = scene.end_time()?;
        let said = |(key, interval): (&str, Option<f64>)| {
            let interval = interval.filter(|interval| *interval > end_time)?;
            let (shown, end) = (short(interval), short(end_time));
            let what = format!(
                "an interval of {shown} s is longer than the run, end_time = {end} s: nothing is written between its begin and its end"
            );
            let cure = format!("were it in milliseconds, it would be {key} = {}", short(1e-3 * interval));
            let warning = Diagnostic::warning(code::UNUSUAL_VALUE, what).about(format!("output.{key}"));
            Some(warning.try_instead(cure))
        };
        Ok([("interval", table.interval), ("fields", table.fields)].into_iter().filter_map(said).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_that_is_longer_than_the_run_is_named_with_what_it_would_be_in_milliseconds() {
        let said =
            |text: &str| Output::warnings(&Scene::from_text("s.toml", text).expect("a scene")).expect("read");
        assert_eq!(said("end_time = 2.0\n[output]\ninterval = 2.0\nfields = 0.1\n"), []);
        let [rows, fields] = &said("end_time = 2.0\n[output]\ninterval = 10.0\nfields = 50\n")[..] else {
            panic!("two warnings")
        };
        assert_eq!(
            [&rows.key, &fields.key],
            ["output.interval", "output.fields"].map(|key| Some(key.into())).each_ref()
        );
        let rows = rows.to_string();
        assert!(
            rows.starts_with("output.interval: an interval of 10 s") && rows.ends_with("interval = 0.01"),
            "{rows}"
        );
        assert!(fields.to_string().ends_with("fields = 0.05"), "{fields}");
    }
}
