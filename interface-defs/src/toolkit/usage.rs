//! Processor time and memory of this process, and a solver that is measured.

use crate::message::{Fault, Hello, Plan, Ready, Statistics};
use crate::solver::{OnProgress, Solver, Window};
use std::time::Instant;

/// Seconds of processor time of this process's threads, to the nanosecond; 0 if the system does not tell.
pub fn cpu_seconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let nanoseconds: u64 = tasks
        .flatten()
        .filter_map(|task| std::fs::read_to_string(task.path().join("schedstat")).ok())
        .filter_map(|text| text.split_whitespace().next()?.parse::<u64>().ok())
        .sum();
    nanoseconds as f64 * 1e-9
}

/// Largest resident memory of this process so far [bytes]; 0 if the system does not tell.
pub fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<u64>().ok()).unwrap_or(0) * 1024
}

/// A solver whose time and memory are told at the end, where it does not tell them itself.
pub struct Measured<S> {
    /// The solver.
    pub solver: S,
    seconds: f64,
}

impl<S> Measured<S> {
    /// `solver`, measured from now on.
    pub fn new(solver: S) -> Self {
        Self { solver, seconds: 0.0 }
    }
}

impl Solver for Measured<Box<dyn Solver>> {
    fn hello(&self) -> Hello {
        self.solver.hello()
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        self.solver.prepare(plan, progress)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let started = Instant::now();
        let outcome = self.solver.solve(window, input, output);
        self.seconds += started.elapsed().as_secs_f64();
        outcome
    }

    fn commit(&mut self) -> Result<(), Fault> {
        let started = Instant::now();
        let outcome = self.solver.commit();
        self.seconds += started.elapsed().as_secs_f64();
        outcome
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let mut told = self.solver.finish()?;
        if told.solve_seconds == 0.0 {
            told.solve_seconds = self.seconds;
        }
        if told.cpu_seconds == 0.0 {
            told.cpu_seconds = cpu_seconds();
        }
        if told.peak_memory == 0 {
            told.peak_memory = peak_memory();
        }
        Ok(told)
    }
}
