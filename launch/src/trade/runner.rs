//! One run of the scene with other settings.

use super::result::{Outcome, Status};
use crate::events::Events;
use crate::stop::Stop;
use crate::sweep::Task;
use interface_defs::diagnostic::{Diagnostic, code};
use std::path::Path;
use toolkit::arguments::Input;
use toolkit::exit::Exit;

/// Who computes.
pub trait Runner {
    /// The scene with these `--set`s, into the directory `dir`; ended after `limit` seconds. An error ends the study.
    fn run(&mut self, sets: &[String], dir: &Path, limit: f64) -> Result<Outcome, Stop>;
}

/// The real programs.
pub struct Programs<'a> {
    /// The scene, and what the user sets.
    pub input: &'a Input,
    /// Set in every run, beside what the study sets.
    pub always: Vec<String>,
    /// Signals, and runs that have ended.
    pub events: &'a Events,
}

impl Runner for Programs<'_> {
    fn run(&mut self, sets: &[String], dir: &Path, limit: f64) -> Result<Outcome, Stop> {
        let sets = self.input.sets.iter().chain(&self.always).chain(sets).map(String::as_str).collect();
        let task = Task { scene: &self.input.scene, sets, dir, shortcuts: true, limit };
        let ran = task.run(self.events, &mut |_| {})?;
        Ok(match ran.summary {
            _ if ran.too_slow => {
                let what = format!("ended after {limit:.1} s: slower than settings like these should be");
                let error = Diagnostic::error(code::LIMIT, what);
                Outcome::without_results(Status::Stopped, vec![error], ran.seconds)
            }
            Some(summary) => Outcome::of(&summary, ran.seconds),
            None if ran.exit == Exit::BadInput => {
                Outcome::without_results(Status::Refused, ran.errors, ran.seconds)
            }
            None => Outcome::without_results(Status::Failed, ran.errors, ran.seconds),
        })
    }
}
