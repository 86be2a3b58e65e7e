//! What a fall costs, by the first part of it.

use crate::solver::DemSolver;
use interface_defs::{Fault, Plan, Solver};
use std::time::{Duration, Instant};
use toolkit::recorder::{Ledger, Windows};

/// Steps between two looks at the clock.
const LOOK: f64 = 1000.0;

/// A fall that was computed as far as a limit of wall time let it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// Wall time that it took [s].
    pub wall: f64,
    /// Time that was reached [s].
    pub reached: f64,
    /// Whether the fall has come to its end.
    pub ended: bool,
}

impl Trial {
    /// Compute the fall of `solver`, with rows each `interval` [s] until `end_time` [s], for so long.
    pub fn new(
        solver: &mut DemSolver,
        [end_time, interval]: [f64; 2],
        limit: Duration,
    ) -> Result<Self, Fault> {
        let window = interval.min(end_time);
        let ready = solver.prepare(&Plan { end_time, window, ..Plan::default() }, &mut |_| Ok(()))?;
        let mut ledger = Ledger::new(ready, true)?;
        let begun = Instant::now();
        let mut reached = 0.0;
        // With shorter windows than a run it is about as long at work, and looks at the clock in time.
        for step in Windows::new(end_time, interval, LOOK * solver.model().steps.step) {
            ledger.solve(solver, &step)?;
            reached = step.window.end();
            if solver.has_ended() || begun.elapsed() >= limit {
                break;
            }
        }
        let ended = solver.has_ended() || reached >= end_time;
        Ok(Self { wall: begun.elapsed().as_secs_f64(), reached, ended })
    }

    /// Wall time of a fall until `end_time` [s]: an upper bound where the fall has not ended and may come to rest before [s].
    pub fn cost(&self, end_time: f64) -> f64 {
        if self.ended { self.wall } else { self.wall * end_time / self.reached }
    }
}
