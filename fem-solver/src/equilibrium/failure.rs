//! Why an iteration, a step or form finding has no solution.

use crate::model::Model;
use interface_defs::message::Fault;

/// Why there is no solution.
#[derive(Debug, Clone)]
pub enum Failure {
    /// The residual did not become small.
    NotConverged {
        /// Iterations done.
        iterations: u32,
        /// Norm of the last residual [N].
        residual: f64,
        /// What it had to be [N].
        limit: f64,
        /// Degree of freedom with the largest residual.
        worst: usize,
        /// Where the residual is small enough, but the last iterations still moved by more than 1e-6 of the
        /// whole way: how far the last one moved [m].
        moving: Option<f64>,
        /// Degree of freedom of the first pivot that was not positive, if the last tangent had to be shifted.
        unstable: Option<usize>,
    },
    /// The tangent stays indefinite, whatever is added to it.
    Unstable {
        /// Degree of freedom with the pivot that is not positive.
        dof: usize,
    },
    /// A path of equilibrium turns by more than a step may, however short.
    Turns {
        /// By how much [rad].
        angle: f64,
    },
    /// Something breaks before there is anything to touch it.
    Broken {
        /// Number of the element.
        element: usize,
        /// What it carried [N].
        tension: f64,
        /// Share of the dead load that acted.
        part: f64,
    },
    /// Something does not come to rest: the fastest node, its speed [m/s], and how many are about as fast.
    Moves(usize, f64, usize),
    /// Whoever listens to the progress has stopped it.
    Stopped(Fault),
}

impl Failure {
    /// In words, with the names of nodes.
    pub fn describe(&self, model: &Model) -> String {
        match self {
            Self::NotConverged { iterations, residual, limit, worst, moving, unstable } => {
                let what = match moving {
                    Some(way) => format!(
                        "Newton did not converge: after {iterations} iterations the residual is small enough, {residual:.2e} N \
                         of {limit:.2e} N allowed, but the last one still moved {way:.2e} m"
                    ),
                    None => format!(
                        "Newton did not converge: residual {residual:.2e} N > {limit:.2e} N after {iterations} iterations, \
                         largest at {}",
                        model.dof_name(*worst)
                    ),
                };
                let free = unstable.map_or(String::new(), |dof| {
                    format!(
                        "; the tangent is not positive, first at {} (free to move, slack, or buckled)",
                        model.dof_name(dof)
                    )
                });
                what + &free
            }
            Self::Unstable { dof } => format!(
                "no stable equilibrium: a pivot at {} is not positive (slack, not connected to a support, or buckled)",
                model.dof_name(*dof)
            ),
            Self::Turns { angle } => format!(
                "the path of equilibrium turns by {:.0} degrees within its shortest step: it ends here, or jumps",
                angle.to_degrees()
            ),
            Self::Broken { element, tension, part } => format!(
                "{} breaks under {:.0} % of the dead load alone, at {tension:.4e} N",
                model.member_name(*element, None),
                100.0 * part
            ),
            Self::Moves(node, speed, count) => format!(
                "it does not come to rest: node {} moves at {speed:.2e} m/s, and {count} nodes in all at a tenth of that or more",
                model.node_name(*node)
            ),
            Self::Stopped(fault) => fault.to_string(),
        }
    }
}
