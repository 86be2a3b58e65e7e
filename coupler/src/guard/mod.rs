//! Guards against a solver that does other things than it says: who, what with its numbers, and which clause of `PROTOCOL.md`.

mod asked;
mod bodies;
mod contact;
mod motion;
mod structure;

pub(crate) use asked::Asked;
pub use bodies::Bodies;
pub(crate) use contact::{Contact, examine_contact, hold_still};
pub use motion::{Answered, Motion};
pub(crate) use structure::{add_windows, examine_structure};

use crate::energy::Balance;
use crate::side::Side;
use interface_defs::{Failure, FieldSpec, Layout, Ready, Sampling, name};

pub use interface_defs::clause;

/// A solver breaks a clause.
pub fn breach(solver: &str, clause: &'static str, what: impl Into<String>) -> Failure {
    Failure::breach(solver, clause, what)
}

interface_defs::worded! {
    /// What an examination says of one clause.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Outcome with words {
        /// It could not be examined.
        NotExamined = "not examined",
        /// It is kept.
        Kept = "kept",
        /// It looks broken, and what a scheme may do looks the same.
        Unsettled = "not settled",
        /// It is broken.
        Broken = "BROKEN",
    }
}

/// What was found about one clause.
#[derive(Debug, Clone)]
pub struct Finding {
    /// Its number.
    pub clause: &'static str,
    /// What was found.
    pub outcome: Outcome,
    /// The numbers, or why it could not be examined.
    pub what: String,
}

/// The answer at t = 0 must be as long as the fields on its mesh and its gauges make it. The layout has room for several interface
/// meshes; the loop couples one.
pub fn check_ready(solver: &str, gives: &[FieldSpec], ready: &Ready) -> Result<(), Failure> {
    if !ready.more_meshes.is_empty() {
        let meshes = ready.more_meshes.len() + 1;
        let what = format!(
            "it offers {meshes} interface meshes, this version couples one: send it as Ready.mesh alone"
        );
        return Err(breach(solver, clause::MESH, what));
    }
    let nodes = ready.mesh.node_count();
    let expected = Layout::new(gives, &ready.mesh, ready.gauges.len()).len();
    let got = ready.initial.len();
    if got == expected {
        let Some(at) = ready.initial.iter().position(|x| !x.is_finite()) else { return Ok(()) };
        let what = format!("number {at} of its answer at t = 0 is {}", ready.initial[at]);
        return Err(breach(solver, clause::INITIAL, what));
    }
    let gauges = 3 * ready.gauges.len();
    let per_node = (expected - gauges) / nodes.max(1);
    let fits = per_node > 0 && got > gauges && (got - gauges).is_multiple_of(per_node);
    let other_samples = |samples| {
        let fields: Vec<_> = gives.iter().map(|f| FieldSpec { samples, ..f.clone() }).collect();
        Layout::new(&fields, &ready.mesh, ready.gauges.len()).len() == got
    };
    let what = format!("its answer at t = 0 has {got} numbers, its fields and gauges make {expected}");
    let asked = gives.iter().map(|f| f.samples).max().unwrap_or(1);
    if fits {
        let theirs = (got - gauges) / per_node;
        let what = format!("{what}: as for {theirs} nodes, its mesh has {nodes}");
        return Err(breach(solver, clause::MESH, what));
    }
    let samples = (1..=64).find(|samples| other_samples(*samples)).map_or(String::new(), |samples| {
        format!(": as for {samples} samples per window, the plan asks for {asked}")
    });
    Err(breach(solver, clause::SAMPLES, format!("{what}{samples}")))
}

/// Largest difference of the work that a solver says it received from what was booked, relative to the largest work of the run.
///
/// With a mean force both are the force times the distance, to rounding. A structure that takes the force at the ends of its windows
/// integrates it by its own scheme, and is not compared.
const MOST_WORK_APART: f64 = 0.01;

/// The work that the solver `solver` says it received must be what was booked: the mean force times the distance.
pub fn check_work(solver: &str, side: &Side, balance: &Balance, of_structure: bool) -> Result<(), Failure> {
    let takes_ends = side.request.fields().any(|f| f.name == name::FORCE && f.sampling == Sampling::AtEnds);
    if !side.account.receives || (of_structure && takes_ends) {
        return Ok(());
    }
    let Some((booked, received, size)) = balance.work_apart(of_structure) else { return Ok(()) };
    let apart = (booked - received).abs() / size;
    tracing::debug!(
        "{solver}: work booked {booked:e} J, received {received:e} J: {apart:e} of {size:e} J apart"
    );
    if apart <= MOST_WORK_APART {
        return Ok(());
    }
    let what = format!(
        "it says that it received {received:.4e} J through the interface, the forces that were exchanged did {booked:.4e} J: \
         {:.3} times that; does it take all of the force, once, and count its work?",
        received / booked
    );
    Err(breach(solver, clause::FORCE, what))
}

#[cfg(test)]
mod tests {
    use super::clause;

    /// The page that a solver is written from has every clause that a message names, once.
    #[test]
    fn every_clause_that_is_named_is_in_the_page() {
        let page = include_str!("../../../interface-defs/PROTOCOL.md");
        for (number, _) in clause::ALL {
            let heads = page.lines().filter(|line| line.starts_with(&format!("**{number} "))).count();
            assert_eq!(heads, 1, "clause {number}");
        }
    }
}
