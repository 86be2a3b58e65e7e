//! One run of the scene with other settings, as a program of its own: `rockfall run`, as a user would.

use super::result::{Outcome, Status};
use crate::events::{Event, Events};
use crate::stop::Stop;
use crate::verdict::error_in;
use interface_defs::toolkit::arguments::Input;
use interface_defs::toolkit::summary::Summary;
use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// Who computes.
pub trait Runner {
    /// The scene with these `--set`s, into the directory `dir`; ended after `limit` seconds. An error ends the study.
    fn run(&mut self, sets: &[String], dir: &Path, limit: f64) -> Result<Outcome, Stop>;
}

/// What a run is given to end in order, and then to disappear.
const GRACE: Duration = Duration::from_secs(10);

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
        let program = std::env::current_exe()
            .map_err(|e| Stop::failed(format!("rockfall itself is not found: {e}")))?;
        let begin = Instant::now();
        let mut command = Command::new(program);
        // A group of its own: Ctrl-C reaches this program alone, which ends the run.
        command
            .process_group(0)
            .arg("run")
            .arg(&self.input.scene)
            .arg("--quiet")
            .arg("--force")
            .arg("--out")
            .arg(dir);
        for set in self.input.sets.iter().chain(&self.always).chain(sets) {
            command.args(["--set", set]);
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let child =
            command.spawn().map_err(|e| Stop::failed(format!("rockfall run cannot be started: {e}")))?;
        let process = Pid::from_child(&child);
        let to_main = self.events.sender.clone();
        std::thread::spawn(move || to_main.send(Event::Checked(0, child.wait_with_output())));
        match self.wait(begin, limit) {
            Ended::ByItself(output) => Ok(read(&output, dir, begin.elapsed().as_secs_f64())),
            Ended::TooSlow => {
                self.end(process);
                let what = format!("ended after {limit:.1} s: slower than settings like these should be");
                Ok(Outcome::without_results(Status::Stopped, what, begin.elapsed().as_secs_f64()))
            }
            Ended::Interrupted => {
                self.end(process);
                Err(Stop::failed("interrupted"))
            }
        }
    }
}

enum Ended {
    ByItself(Output),
    TooSlow,
    Interrupted,
}

impl Programs<'_> {
    fn wait(&self, begin: Instant, limit: f64) -> Ended {
        let deadline = begin + Duration::from_secs_f64(limit.clamp(0.0, 1e7));
        loop {
            match self.events.receiver.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(Event::Checked(_, Ok(output))) => return Ended::ByItself(output),
                Ok(Event::Signal) => return Ended::Interrupted,
                // Waiting fails only for what is no child.
                Ok(Event::Checked(_, Err(_))) | Err(RecvTimeoutError::Disconnected) => {
                    return Ended::Interrupted;
                }
                Err(RecvTimeoutError::Timeout) => return Ended::TooSlow,
                Ok(_) => {}
            }
        }
    }

    /// End a run in order, and wait for it.
    fn end(&self, process: Pid) {
        for signal in [Signal::TERM, Signal::KILL] {
            let _ = kill_process(process, signal);
            let deadline = Instant::now() + GRACE;
            // A second Ctrl-C does not shorten it: the run ends within seconds.
            while let Ok(event) =
                self.events.receiver.recv_timeout(deadline.saturating_duration_since(Instant::now()))
            {
                if matches!(event, Event::Checked(..)) {
                    return;
                }
            }
        }
    }
}

/// What a run that has ended by itself left in `dir`.
fn read(output: &Output, dir: &Path, seconds: f64) -> Outcome {
    let printed = String::from_utf8_lossy(&output.stderr);
    let message = error_in(&printed).unwrap_or_else(|| printed.trim().to_owned());
    let exit = output.status.code();
    if exit == Some(2) {
        return Outcome::without_results(Status::Refused, message, seconds);
    }
    match Summary::read(dir) {
        Ok(summary) => {
            let mut outcome = Outcome::of(&summary, seconds);
            if outcome.status != Status::Done && !message.is_empty() {
                outcome.message = Some(message);
            }
            // The status has a column of its own.
            let word = format!("{}: ", outcome.status.word());
            outcome.message = outcome.message.map(|m| m.strip_prefix(&word).map_or(m.clone(), String::from));
            outcome
        }
        Err(e) => Outcome::without_results(Status::Failed, format!("{message} (no summary: {e})"), seconds),
    }
}

/// Where the files of run `number` are.
pub fn directory(out: &Path, number: usize) -> PathBuf {
    out.join(super::store::RUNS).join(format!("{number:03}"))
}
