//! What is reported of a run: rows, measures, sentences, files. Nothing here changes a state.
//!
//! - [`gauges`]: the columns of `history.csv` that a scene asks for
//! - [`measures`]: the numbers of the summary, of an impact on the net and of a trajectory over terrain
//! - [`verdict`], with [`outline`]: what became of each rock, in a sentence
//! - [`trajectory`], [`fields`], [`map`]: files and the picture of the trajectories

use interface_defs::Fault;
use interface_defs::diagnostic::{Diagnostic, Severity, code};

pub mod fields;
pub mod gauges;
pub mod map;
pub mod measures;
pub mod outline;
pub mod trajectory;
pub mod verdict;

/// A warning of a result file that could not be written.
pub fn not_written(fault: Fault) -> Diagnostic {
    Diagnostic { severity: Severity::Warning, code: code::NOT_WRITTEN, ..*fault.diagnostic }
}
