//! A solver whose memory allocations are counted from its second window on.

use super::alloc::allocations;
use crate::message::{Fault, Hello, Plan, Ready, Statistics};
use crate::selection::Selection;
use crate::solver::{OnProgress, Solver, Window};

/// Adds the count `allocations_after_first_window` to the statistics of `solver`. It counts where the
/// program's global allocator is [`CountingAllocator`](super::alloc::CountingAllocator), else it is 0.
pub struct Counted<S> {
    solver: S,
    committed: bool,
    count: u64,
}

impl<S: Solver> Counted<S> {
    /// Count for `solver`.
    pub fn new(solver: S) -> Self {
        Self { solver, committed: false, count: 0 }
    }

    fn count<T>(&mut self, work: impl FnOnce(&mut S) -> T) -> T {
        let before = allocations();
        let result = work(&mut self.solver);
        if self.committed {
            self.count += allocations() - before;
        }
        result
    }
}

impl<S: Solver> Solver for Counted<S> {
    fn hello(&self) -> Hello {
        self.solver.hello()
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        self.solver.prepare(plan, progress)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.count(|solver| solver.solve(window, input, output))
    }

    fn commit(&mut self) -> Result<(), Fault> {
        let outcome = self.count(Solver::commit);
        self.committed = true;
        outcome
    }

    fn select(&mut self, selection: Option<&mut Selection>) -> Result<(), Fault> {
        self.count(|solver| solver.select(selection))
    }

    fn committed(&mut self, output: &mut [f64]) -> Result<(), Fault> {
        self.count(|solver| solver.committed(output))
    }

    fn reach(&mut self, window: &Window, input: &[f64], nodes: &mut Vec<u32>) -> Result<(), Fault> {
        self.count(|solver| solver.reach(window, input, nodes))
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        self.solver.save()
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Fault> {
        self.solver.resume(state)
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let mut statistics = self.solver.finish()?;
        statistics.counts.push(("allocations_after_first_window".into(), self.count));
        Ok(statistics)
    }
}
