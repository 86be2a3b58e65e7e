//! A solver that takes part in a run which a coupler leads.

use super::alloc::allocations;
use super::owner;
use super::provenance::build_id;
use interface_defs::ipc::RunId;
use interface_defs::message::{Fault, Hello, Plan, Ready, Statistics, option};
use interface_defs::selection::Selection;
use interface_defs::solver::{OnProgress, Solver, Window};
use std::path::PathBuf;

/// It writes only into a directory that no other run owns. To the statistics of its solver it adds the count
/// `allocations_after_first_window`, which is 0 where the program's global allocator is not
/// [`CountingAllocator`](super::alloc::CountingAllocator).
pub(crate) struct Guest {
    solver: Box<dyn Solver>,
    out: PathBuf,
    run: RunId,
    /// Fingerprint of the scene, which all programs of the run compare.
    scene: String,
    committed: bool,
    count: u64,
}

impl Guest {
    pub fn new(solver: Box<dyn Solver>, out: PathBuf, run: RunId, scene: String) -> Self {
        Self { solver, out, run, scene, committed: false, count: 0 }
    }

    fn count<T>(&mut self, work: impl FnOnce(&mut dyn Solver) -> T) -> T {
        let before = allocations();
        let result = work(self.solver.as_mut());
        if self.committed {
            self.count += allocations() - before;
        }
        result
    }
}

impl Solver for Guest {
    fn hello(&self) -> Hello {
        let options = vec![(option::BUILD.to_owned(), build_id().to_string())];
        Hello { scene: self.scene.clone(), options, ..self.solver.hello() }
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        owner::refuse_stranger(&self.out, &self.run)?;
        self.solver.prepare(plan, progress)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.count(|solver| solver.solve(window, input, output))
    }

    fn commit(&mut self) -> Result<(), Fault> {
        let outcome = self.count(|solver| solver.commit());
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
