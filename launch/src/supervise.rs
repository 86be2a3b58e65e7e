//! Start the processes of a run, watch them, and leave none behind.
//!
//! Each child leads a process group of its own, so that Ctrl-C reaches this program alone, which
//! ends the run in order; and so that what a child has started ends with it.

use crate::events::{Event, Events};
use crate::progress::Bar;
use rustix::process::{Pid, Signal, kill_process_group};
use std::ffi::OsString;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

/// What the others are given to end by themselves when a process has failed or the leader has ended.
const GRACE: Duration = Duration::from_secs(2);

/// The same when a solver has ended without a failure: its partner may have results left to write.
const GRACE_AFTER_SUCCESS: Duration = Duration::from_secs(10);

/// What the leader is given to end the run in order when the user interrupts it.
const GRACE_AFTER_SIGNAL: Duration = Duration::from_secs(5);

/// Between SIGTERM and SIGKILL.
const GRACE_BEFORE_KILL: Duration = Duration::from_millis(500);

/// A process to start.
pub struct Job {
    /// Name, in messages and of its log.
    pub name: &'static str,
    /// Program and arguments.
    pub words: Vec<OsString>,
}

/// How a process has ended.
#[derive(Debug, Clone)]
pub struct End {
    /// Name.
    pub name: &'static str,
    /// Exit code or signal.
    pub status: ExitStatus,
    /// Whether it was ended from here, because it did not end by itself.
    pub forced: bool,
}

/// How all have ended.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// In the order in which they ended.
    pub ends: Vec<End>,
    /// Whether the user has interrupted the run.
    pub interrupted: bool,
}

/// How far the ending of a run has gone.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Pressure {
    None,
    Terminated,
    Killed,
}

struct Running {
    name: &'static str,
    group: Pid,
    alive: bool,
}

/// Run `jobs`, the first of which leads, until all have ended. Their output goes to `log`.
///
/// An error: one could not be started; then none is running.
pub fn supervise(
    jobs: &[Job],
    log: &Path,
    bar: &mut Bar,
    progress: bool,
    events: &Events,
) -> Result<Outcome, String> {
    let Events { sender, receiver } = events;
    let mut watch = Watch {
        running: Vec::with_capacity(jobs.len()),
        outcome: Outcome::default(),
        pressure: Pressure::None,
        deadline: None,
    };
    for (index, job) in jobs.iter().enumerate() {
        match start(job, &log_path(log, job.name), index == 0 && progress, index, sender) {
            Ok(group) => watch.running.push(Running { name: job.name, group, alive: true }),
            Err(e) => {
                watch.press(Pressure::Killed);
                watch.until_all_ended(receiver, bar);
                return Err(format!("{} cannot be started: {e}", job.words[0].display()));
            }
        }
    }
    watch.until_all_ended(receiver, bar);
    Ok(watch.outcome)
}

/// Where the output of a process goes.
pub fn log_path(log: &Path, name: &str) -> PathBuf {
    log.join(format!("{name}.log"))
}

fn start(job: &Job, log: &Path, progress: bool, index: usize, to_main: &Sender<Event>) -> io::Result<Pid> {
    // Appending: two writers share it, and none overwrites the other.
    let file = OpenOptions::new().create(true).append(true).open(log)?;
    let mut command = Command::new(&job.words[0]);
    command.args(&job.words[1..]).stdin(Stdio::null()).stderr(file.try_clone()?).process_group(0);
    command.stdout(if progress { Stdio::piped() } else { file.try_clone()?.into() });
    let mut child = command.spawn()?;
    tracing::info!("{} is process {}", job.name, child.id());
    let group = Pid::from_child(&child);
    if let Some(stdout) = child.stdout.take() {
        let to_main = to_main.clone();
        std::thread::spawn(move || read_progress(BufReader::new(stdout), file, &to_main));
    }
    let to_main = to_main.clone();
    std::thread::spawn(move || to_main.send(Event::Ended(index, child.wait())));
    Ok(group)
}

/// Lines of progress go to the bar, all else to the log.
fn read_progress(lines: impl BufRead, mut log: File, to_main: &Sender<Event>) {
    for line in lines.lines().map_while(Result::ok) {
        let _ = match serde_json::from_str(&line) {
            Ok(progress) => to_main.send(Event::Progress(progress)).map_err(io::Error::other),
            Err(_) => writeln!(log, "{line}"),
        };
    }
}

struct Watch {
    running: Vec<Running>,
    outcome: Outcome,
    pressure: Pressure,
    deadline: Option<Instant>,
}

impl Watch {
    fn until_all_ended(&mut self, receiver: &Receiver<Event>, bar: &mut Bar) {
        while self.running.iter().any(|r| r.alive) {
            let event = match self.deadline {
                Some(at) => receiver.recv_timeout(at.saturating_duration_since(Instant::now())),
                None => receiver.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match event {
                Ok(Event::Progress(line)) => bar.update(&line),
                Ok(Event::Ended(index, status)) => self.ended(index, status),
                Ok(Event::Signal) => self.signalled(),
                // All checks have ended before.
                Ok(Event::Checked(..)) => {}
                Err(RecvTimeoutError::Timeout) if self.pressure == Pressure::None => {
                    self.press(Pressure::Terminated);
                }
                Err(_) => self.press(Pressure::Killed),
            }
        }
    }

    fn ended(&mut self, index: usize, status: io::Result<ExitStatus>) {
        let one = &mut self.running[index];
        one.alive = false;
        // What it has started itself must not outlive it. The group's number cannot have been given
        // away: as long as one of the group lives it is taken, and else this comes at once.
        let _ = kill_process_group(one.group, Signal::KILL);
        // Waiting fails only for what is no child; then nothing is known of it.
        let status = status.unwrap_or_default();
        let forced = self.pressure > Pressure::None;
        let name = one.name;
        tracing::info!("{name} ended: {status}");
        self.outcome.ends.push(End { name, status, forced });
        self.within(if index > 0 && status.success() { GRACE_AFTER_SUCCESS } else { GRACE });
    }

    fn signalled(&mut self) {
        if self.outcome.interrupted {
            self.press(Pressure::Killed);
            return;
        }
        self.outcome.interrupted = true;
        match self.running.first() {
            Some(leader) if leader.alive => {
                let _ = kill_process_group(leader.group, Signal::TERM);
                self.within(GRACE_AFTER_SIGNAL);
            }
            _ => self.press(Pressure::Terminated),
        }
    }

    /// All must have ended within `grace` from now, or before if that is due already.
    fn within(&mut self, grace: Duration) {
        let at = Instant::now() + grace;
        self.deadline = Some(self.deadline.map_or(at, |before| before.min(at)));
    }

    fn press(&mut self, pressure: Pressure) {
        let signal = if pressure == Pressure::Killed { Signal::KILL } else { Signal::TERM };
        for one in self.running.iter().filter(|r| r.alive) {
            let _ = kill_process_group(one.group, signal);
        }
        self.pressure = pressure;
        self.deadline = (pressure < Pressure::Killed).then(|| Instant::now() + GRACE_BEFORE_KILL);
    }
}
