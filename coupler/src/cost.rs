//! What a run has cost, for `summary.json`: wall time by stage, exchanges, and of each process its time, memory and counts.

use crate::records::Records;
use interface_defs::Statistics;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::ipc::Remote;
use interface_defs::ipc::serve::with_cost;
use serde_json::json;
use std::time::Instant;
use toolkit::recorder::describe_processes;
use toolkit::summary::{Summary, totals};

/// When the run began, and when its loop ended.
pub(crate) struct Clock {
    /// The program has read its command line.
    pub started: Instant,
    /// The last window is committed, or the run has failed.
    pub loop_ended: Instant,
}

/// Fill `cost` of `summary`; `statistics` are those of the contact solver and of the structure's, if they could report them.
pub(crate) fn describe(
    summary: &mut Summary,
    records: &Records,
    clock: &Clock,
    statistics: Option<&(Statistics, Statistics)>,
    remotes: &[Remote],
) {
    let Clock { started, loop_ended } = *clock;
    let prepared = records.prepared_at().unwrap_or(loop_ended);
    let looping = (loop_ended - prepared).as_secs_f64();
    let exchanges: u64 = remotes.iter().map(|remote| remote.sequence).sum();
    let waited: f64 = remotes.iter().map(|remote| remote.waited).sum();
    let of_solvers: Vec<&Statistics> = statistics.iter().flat_map(|(dem, fem)| [dem, fem]).collect();
    if !of_solvers.is_empty() {
        describe_exchange(summary, exchanges, waited, &of_solvers);
    }
    let cost = &mut summary.cost;
    cost.insert("wall_s".into(), json!(started.elapsed().as_secs_f64()));
    cost.insert("loop_s".into(), json!(looping));
    let preparing = (prepared - started).as_secs_f64();
    let flying = (records.touched_at().unwrap_or(loop_ended) - prepared).as_secs_f64();
    let stages =
        [("prepare_s", preparing), ("flight_s", flying), ("impact_s", looping - flying), ("loop_s", looping)];
    cost.insert(
        "stages".into(),
        stages.map(|(stage, seconds)| (stage.to_owned(), json!(seconds))).into_iter().collect(),
    );
    cost.insert("exchanges".into(), json!(exchanges));
    cost.insert("windows".into(), summary.coupling.get("windows").cloned().unwrap_or_default());
    cost.insert("iterations".into(), summary.coupling.get("iterations").cloned().unwrap_or_default());
    totals(cost, &of_solvers);
    // A run that ended before its second window has none to count.
    let allocations = records.allocations().map(|n| ("allocations_after_first_window".into(), n));
    let counts = allocations.into_iter().collect();
    let own = with_cost(Statistics { counts, ..Statistics::default() }, 0.0);
    let solvers = ["dem", "fem"].into_iter().zip(of_solvers);
    describe_processes(summary, std::iter::once(("coupler", &own)).chain(solvers));
}

/// The mean time of an exchange beside the computing of the solvers.
fn describe_exchange(summary: &mut Summary, exchanges: u64, waited: f64, of_solvers: &[&Statistics]) {
    let inside: f64 = of_solvers.iter().map(|s| s.solve_seconds).sum();
    if of_solvers.iter().all(|s| s.solve_seconds > 0.0) && exchanges > 0 {
        let each = (waited - inside) / exchanges as f64;
        summary.cost.insert("exchange_microseconds".into(), json!(1e6 * each));
    } else {
        let why = "a solver does not report its seconds inside solve";
        summary.warnings.push(Diagnostic::absent("exchange_microseconds", why));
    }
}
