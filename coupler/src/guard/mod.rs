//! Guards against a solver that does other things than it says: who, what with its numbers, and which clause of `PROTOCOL.md`.

mod motion;
mod probe;

pub use motion::{Answered, Motion};
pub use probe::probe;

use crate::energy::Balance;
use crate::side::Side;
use interface_defs::{Failure, FieldSpec, Layout, Ready, Sampling, name};

/// Clauses of `PROTOCOL.md` by number.
pub mod clause {
    /// The scene that was read.
    pub const SCENE: &str = "5.1";
    /// The interface mesh.
    pub const MESH: &str = "5.2";
    /// Samples of a window.
    pub const SAMPLES: &str = "5.3";
    /// The answer at t = 0.
    pub const INITIAL: &str = "5.4";
    /// Every solve starts from the committed state.
    pub const COMMITTED: &str = "5.5";
    /// A commit is done.
    pub const COMMIT: &str = "5.6";
    /// The length of a window.
    pub const LENGTH: &str = "5.7";
    /// How well windows are repeated.
    pub const REPEATS: &str = "5.8";
    /// Velocity and displacement.
    pub const VELOCITY: &str = "5.9";
    /// Nodes of infinite mass.
    pub const HELD: &str = "5.10";
    /// Masses of nodes.
    pub const MASSES: &str = "5.11";
    /// Force that is taken, and its work.
    pub const FORCE: &str = "5.12";
}

/// A solver breaks a clause.
pub fn breach(solver: &str, clause: &str, what: impl AsRef<str>) -> Failure {
    Failure::contract(solver, format!("{} (PROTOCOL.md, clause {clause})", what.as_ref()))
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
        use clause::*;
        let all = [
            SCENE, MESH, SAMPLES, INITIAL, COMMITTED, COMMIT, LENGTH, REPEATS, VELOCITY, HELD, MASSES, FORCE,
        ];
        for number in all {
            let heads = page.lines().filter(|line| line.starts_with(&format!("**{number} "))).count();
            assert_eq!(heads, 1, "clause {number}");
        }
    }
}
