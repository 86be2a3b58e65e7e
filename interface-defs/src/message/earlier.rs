//! Messages of a solver of protocol 2: warnings and faults were texts, and there were no verdicts.

use super::{FaultKind, Gauge, Hello, Measure, NamedValues, Progress, Ready, Statistics};
use crate::diagnostic::{Diagnostic, code};
use crate::mesh::InterfaceMesh;
use serde::Deserialize;

/// The version.
pub(super) const VERSION: u8 = 2;

#[derive(Deserialize)]
pub(super) enum FromSolver {
    Hello(Hello),
    Progress(Progress),
    Ready {
        mesh: InterfaceMesh,
        gauges: Vec<Gauge>,
        initial: Vec<f64>,
        warnings: Vec<String>,
        more_meshes: Vec<InterfaceMesh>,
        options: NamedValues,
    },
    Fault {
        kind: FaultKind,
        message: String,
        options: NamedValues,
    },
    Statistics {
        measures: Vec<(String, f64, String, Option<f64>)>,
        counts: Vec<(String, u64)>,
        warnings: Vec<String>,
        cpu_seconds: f64,
        solve_seconds: f64,
        peak_memory: u64,
        options: NamedValues,
    },
    Saved {
        state: Vec<u8>,
    },
    Resumed,
}

fn warnings(texts: Vec<String>) -> Vec<Diagnostic> {
    texts.into_iter().map(|text| Diagnostic::warning(code::OTHER, text)).collect()
}

impl From<FromSolver> for super::FromSolver {
    fn from(message: FromSolver) -> Self {
        match message {
            FromSolver::Hello(hello) => Self::Hello(hello),
            FromSolver::Progress(progress) => Self::Progress(progress),
            FromSolver::Ready { mesh, gauges, initial, warnings: texts, more_meshes, options } => {
                Self::Ready(Ready { mesh, gauges, initial, warnings: warnings(texts), more_meshes, options })
            }
            FromSolver::Fault { kind, message, options } => {
                let diagnostic = Box::new(Diagnostic::error(code::OTHER, message));
                Self::Fault(super::Fault { kind, diagnostic, options })
            }
            FromSolver::Statistics {
                measures,
                counts,
                warnings: texts,
                cpu_seconds,
                solve_seconds,
                peak_memory,
                options,
            } => {
                let measure = |(name, value, unit, time): (String, f64, String, Option<f64>)| {
                    Measure::new(name, value, unit).at(time)
                };
                Self::Statistics(Statistics {
                    measures: measures.into_iter().map(measure).collect(),
                    verdicts: Vec::new(),
                    torn: None,
                    counts,
                    warnings: warnings(texts),
                    cpu_seconds,
                    solve_seconds,
                    peak_memory,
                    options,
                })
            }
            FromSolver::Saved { state } => Self::Saved { state },
            FromSolver::Resumed => Self::Resumed,
        }
    }
}
