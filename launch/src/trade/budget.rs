//! What a study may cost, and a run that it asks for.

use super::knobs::Point;
use super::result::Purpose;
use super::study::Study;
use std::fmt;
use toolkit::numbers::seconds;

/// Share of the budget up to which runs of the reference may start.
pub const REFERENCE: f64 = 0.35;

/// Longest that a run may take where runs are counted instead of their time [s].
const A_DAY: f64 = 86_400.0;

/// What a study may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// Wall time of all runs together [s].
    Time(f64),
    /// So many runs, however long these take: what is tried depends less on how busy the machine is.
    Runs(u32),
}

impl Budget {
    /// How much it is: seconds or runs.
    pub fn whole(self) -> f64 {
        match self {
            Self::Time(seconds) => seconds,
            Self::Runs(runs) => runs.into(),
        }
    }

    /// How long a run may take [s], of which that much time would be enough.
    pub fn limit(self, enough: f64) -> f64 {
        match self {
            Self::Time(_) => enough,
            Self::Runs(_) => A_DAY,
        }
    }

    /// How much of it `study` has used, and what one more run of so many seconds takes.
    fn used(self, study: &Study, run: f64) -> (f64, f64) {
        match self {
            Self::Time(_) => (study.spent(), run),
            Self::Runs(_) => (study.runs.len() as f64, 1.0),
        }
    }

    /// Whether one more run of so many seconds fits into this share of it.
    pub fn holds(self, study: &Study, run: f64, share: f64) -> bool {
        let (used, more) = self.used(study, run);
        used + more <= share * self.whole()
    }

    /// How much of it `study` has used, in words.
    pub fn used_text(self, study: &Study) -> String {
        match self {
            Self::Time(_) => seconds(study.spent()),
            Self::Runs(_) => study.runs.len().to_string(),
        }
    }

    /// The option with which the scene gets two finer runs, so that something is known of its error.
    pub fn of_reference(self, study: &Study) -> Option<String> {
        let finer = |rungs| study.space.refined(&Point::new(), rungs);
        let missing = [1.0, 2.0].map(finer).into_iter().filter(|point| study.outcome(point).is_none());
        match self {
            Self::Time(_) => {
                let needed: f64 = missing.map(|point| study.estimate(&point)).sum::<Option<f64>>()?;
                Some(format!("--budget {:.0}m", ((study.spent() + needed) / REFERENCE / 60.0).ceil()))
            }
            Self::Runs(_) => {
                let runs = study.runs.len() + missing.count();
                Some(format!("--runs {:.0}", (runs as f64 / REFERENCE).ceil()))
            }
        }
    }
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Time(time) => f.write_str(&seconds(*time)),
            Self::Runs(runs) => write!(f, "{runs} runs"),
        }
    }
}

/// A run to make.
#[derive(Debug, Clone, PartialEq)]
pub struct NextRun {
    /// Its settings.
    pub point: Point,
    /// Why.
    pub purpose: Purpose,
    /// It is ended after this time [s].
    pub limit: f64,
}
