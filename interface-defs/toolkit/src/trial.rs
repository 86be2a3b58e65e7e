//! What a run of one solver costs, by the first part of it.

use crate::recorder::{Ledger, Windows};
use interface_defs::{Fault, Plan, Solver};
use std::time::{Duration, Instant};

/// A run that was computed as far as a limit of wall time let it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// Wall time of the preparation, and of the windows [s].
    pub prepared: f64,
    /// Likewise.
    pub wall: f64,
    /// Time that was reached [s].
    pub reached: f64,
    /// Whether it has come to its end, or to where it was to stop.
    pub ended: bool,
}

impl Trial {
    /// Run `solver` until `end_time` [s] with rows each `interval` [s], in windows no longer than `longest` [s]; for so long, or until it
    /// `stops`. With short windows it looks at the clock in time.
    pub fn new<S: Solver>(
        solver: &mut S,
        [end_time, interval, longest]: [f64; 3],
        limit: Duration,
        stops: impl Fn(&S) -> bool,
    ) -> Result<Self, Fault> {
        let windows = Windows::new(end_time, interval, longest);
        let begun = Instant::now();
        let plan = Plan { end_time, window: windows.length(), ..Plan::default() };
        let mut ledger = Ledger::new(solver.prepare(&plan, &mut |_| Ok(()))?, true)?;
        let prepared = begun.elapsed();
        let mut reached = 0.0;
        for step in windows {
            ledger.solve(solver, &step)?;
            reached = step.window.end();
            if solver.has_ended() || stops(solver) || begun.elapsed() >= prepared + limit {
                break;
            }
        }
        let ended = solver.has_ended() || stops(solver) || reached >= end_time;
        let wall = (begun.elapsed() - prepared).as_secs_f64();
        Ok(Self { prepared: prepared.as_secs_f64(), wall, reached, ended })
    }

    /// Wall time of the run until `end_time` [s]: an upper bound where a fall has not ended and may come to rest before [s].
    pub fn cost(&self, end_time: f64) -> f64 {
        self.prepared + if self.ended { self.wall } else { self.wall * end_time / self.reached }
    }
}
