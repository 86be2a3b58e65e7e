//! Start other programs, watch them, and leave none behind.
//!
//! Each child leads a process group of its own, so that Ctrl-C reaches this program alone, which ends the others in order; and
//! so that what a child has started ends with it. What is wrong a child of this project says as data, see [`Errors`].

use crate::events::{Event, Events};
use crate::logs::{self, Log};
use crate::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, code};
use rustix::fs::{MemfdFlags, memfd_create};
use rustix::process::{Pid, Signal, kill_process_group};
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, Write};
use std::os::fd::AsRawFd;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender};
use std::time::{Duration, Instant};
use toolkit::arguments::Input;
use toolkit::exit::Exit;
use toolkit::progress::Line;
use toolkit::screen;

/// What the others are given to end by themselves when a process has failed or the leader has ended.
const GRACE: Duration = Duration::from_secs(2);

/// The same when a solver has ended without a failure: its partner may have results left to write.
const GRACE_AFTER_SUCCESS: Duration = Duration::from_secs(10);

/// What the leader of a run is given to end it in order when the user interrupts it.
pub const GRACE_OF_LEADER: Duration = Duration::from_secs(5);

/// The same for a whole run or study, which gives some to its own processes.
pub const GRACE_OF_RUN: Duration = Duration::from_secs(10);

/// Between SIGTERM and SIGKILL.
const GRACE_BEFORE_KILL: Duration = Duration::from_millis(500);

/// How often it is said how long something takes.
const SAID: Duration = Duration::from_secs(30);

/// Most of what is read of the errors of a child [bytes].
const MOST: u64 = 1 << 20;

/// Where the output of a child goes.
pub enum Goes {
    /// Into this file, behind what is in it. With `progress` its stdout is watched for lines of it.
    Log {
        /// The file.
        file: PathBuf,
        /// Whether lines of progress are looked for.
        progress: bool,
    },
    /// It is kept for whoever has asked.
    Kept,
    /// Where the command says.
    Shown,
}

/// A process to start.
pub struct Job {
    /// Name, in messages and of its log.
    pub name: String,
    /// Program and arguments.
    pub command: Command,
    /// For its stdin.
    pub input: Option<Vec<u8>>,
    /// Its output.
    pub output: Goes,
}

impl Job {
    /// A program whose output is kept, with its file as its name.
    pub fn of(command: Command) -> Self {
        let name = command.get_program().to_string_lossy().into_owned();
        Self { name, command, input: None, output: Goes::Kept }
    }
}

/// What is said while children are at work.
pub enum Said<'a> {
    /// A line of progress.
    Line(&'a Line),
    /// Seconds since the start, now and then.
    Seconds(u64),
}

/// How children are watched; by default each for itself, silently, and all are killed by a signal.
#[derive(Default)]
pub struct Rules<'a> {
    /// Whether the end of one ends all.
    pub together: bool,
    /// What the first of them, which leads, is given to end in order after a signal; `None`: all are killed.
    pub grace: Option<Duration>,
    /// They are ended after this time.
    pub limit: Option<Duration>,
    /// Who is told how far they are.
    pub say: Option<&'a mut dyn FnMut(Said)>,
}

/// How a process has ended.
#[derive(Debug, Clone)]
pub struct End {
    /// Its place among the jobs.
    pub index: usize,
    /// Name.
    pub name: String,
    /// Exit code or signal.
    pub status: ExitStatus,
    /// Whether it was ended from here, because it did not end by itself.
    pub forced: bool,
    /// What it printed, where that is kept.
    pub stdout: Vec<u8>,
    /// The same of its stderr.
    pub stderr: Vec<u8>,
    /// What it said to be wrong.
    pub errors: Vec<Diagnostic>,
}

impl End {
    /// Its exit code; that of one that was killed is that of a failure.
    pub fn exit(&self) -> Exit {
        match self.status.code() {
            Some(0) => Exit::Done,
            Some(2) => Exit::BadInput,
            Some(3) => Exit::Unreliable,
            _ => Exit::Failed,
        }
    }

    /// What it printed; an error: it did not end well, and why.
    pub fn text(&self) -> Result<String, Stop> {
        match self.exit() {
            Exit::Done => Ok(String::from_utf8_lossy(&self.stdout).into_owned()),
            exit => Err(Stop { exit, errors: self.reasons() }),
        }
    }

    /// Why it did not end well: what it said, else how it ended and what it printed.
    pub fn reasons(&self) -> Vec<Diagnostic> {
        if !self.errors.is_empty() {
            return self.errors.clone();
        }
        let printed = String::from_utf8_lossy(&self.stderr);
        let what =
            format!("{} ended with {} and printed: {}", self.name, how(self.status), printed.trim_end());
        vec![Diagnostic::error(code::PROCESS, what)]
    }
}

/// Exit code or signal, in words.
pub fn how(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit code {code}"),
        (None, Some(signal)) => {
            let full = ": memory that it had mapped could not be had, as on a full /dev/shm or disk";
            format!("killed by signal {signal}{}", if signal == Signal::BUS.as_raw() { full } else { "" })
        }
        (None, None) => "an unknown status".into(),
    }
}

/// How all have ended.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// In the order in which they ended.
    pub ends: Vec<End>,
    /// Whether the user has interrupted them.
    pub interrupted: bool,
    /// Whether they have taken too long.
    pub too_slow: bool,
}

/// Run `jobs`, the first of which leads, until all have ended.
///
/// An error: one could not be started; then none is running.
pub fn watch(jobs: Vec<Job>, rules: Rules, events: &Events) -> Result<Outcome, Stop> {
    let begun = Instant::now();
    let limit = rules.limit.and_then(|limit| begun.checked_add(limit));
    let mut watch = Watch {
        running: Vec::with_capacity(jobs.len()),
        outcome: Outcome::default(),
        pressure: Pressure::None,
        deadline: None,
        begun,
        limit,
        says: begun + SAID,
        looks: begun,
        rules,
    };
    for (index, mut job) in jobs.into_iter().enumerate() {
        let started = start(&mut job, index, &events.sender).map(|running| watch.running.push(running));
        if let Err(e) = started {
            watch.press(Pressure::Killed);
            watch.until_all_ended(events);
            let program = job.command.get_program().display();
            return Err(Stop::input(code::PROCESS, format!("{program} cannot be started: {e}")));
        }
    }
    watch.until_all_ended(events);
    for Running { name, log, .. } in &mut watch.running {
        if let Some(Err(e)) = log.as_mut().map(Log::finish) {
            tracing::warn!("the log of {name} cannot be shortened: {e}");
        }
    }
    Ok(watch.outcome)
}

/// Run one program to its end; a signal ends both.
pub fn one(job: Job, rules: Rules, events: &Events) -> Result<(End, bool), Stop> {
    let outcome = watch(vec![job], rules, events)?;
    match outcome.ends.into_iter().next() {
        Some(end) if !outcome.interrupted => Ok((end, outcome.too_slow)),
        _ => Err(Stop::interrupted()),
    }
}

/// What a program of this project prints when it is asked; a signal kills it.
pub fn ask(program: &Path, arguments: &[OsString], events: &Events) -> Result<String, Stop> {
    let mut command = Command::new(program);
    command.args(arguments);
    one(Job::of(command), Rules::default(), events)?.0.text()
}

/// A path as an argument, which no program takes for an option.
pub fn path(path: &Path) -> PathBuf {
    let option = path.as_os_str().as_encoded_bytes().starts_with(b"-");
    if option { Path::new(".").join(path) } else { path.into() }
}

/// The scene and its `--set`s as arguments.
pub fn scene(input: &Input) -> Vec<OsString> {
    let sets = input.sets.iter().map(|set| format!("--set={set}").into());
    std::iter::once(path(&input.scene).into()).chain(sets).collect()
}

/// Where a child writes its errors as data: memory of this process, which is no file that anybody could put something else in the
/// place of, and which leaves nothing behind.
struct Errors(File);

impl Errors {
    fn new() -> io::Result<Self> {
        Ok(Self(memfd_create("rockfall-errors", MemfdFlags::CLOEXEC)?.into()))
    }

    /// As another process of this user opens it.
    fn path(&self) -> String {
        format!("/proc/{}/fd/{}", std::process::id(), self.0.as_raw_fd())
    }

    fn read(&self) -> Vec<Diagnostic> {
        let (mut file, mut bytes) = (&self.0, Vec::new());
        // What cannot be read is in the log.
        let _ = file.rewind().and_then(|()| file.take(MOST).read_to_end(&mut bytes));
        screen::complaints(&String::from_utf8_lossy(&bytes))
    }
}

fn start(job: &mut Job, index: usize, to_main: &Sender<Event>) -> io::Result<Running> {
    let errors = Errors::new()?;
    let command = &mut job.command;
    command.process_group(0);
    // One that speaks for itself says it to whoever has started this one, too.
    if !matches!(job.output, Goes::Shown) {
        command.env(screen::DIAGNOSTICS, errors.path());
    }
    command.stdin(if job.input.is_some() { Stdio::piped() } else { Stdio::null() });
    let (mut log, mut kept) = (None, None);
    match &job.output {
        Goes::Log { file, progress } => {
            let (bounded, file) = Log::open(file)?;
            kept = Some(bounded);
            command.stderr(file.try_clone()?);
            command.stdout(if *progress { Stdio::piped() } else { file.try_clone()?.into() });
            log = progress.then_some(file);
        }
        Goes::Kept => {
            command.stdout(Stdio::piped()).stderr(Stdio::piped());
        }
        Goes::Shown => {}
    }
    let mut child = command.spawn()?;
    tracing::info!("{} is process {}", job.name, child.id());
    let group = Pid::from_child(&child);
    if let Some((log, stdout)) = log.and_then(|log| Some((log, child.stdout.take()?))) {
        let to_main = to_main.clone();
        std::thread::spawn(move || read_progress(BufReader::new(stdout), log, &to_main));
    }
    if let Some((input, mut stdin)) = job.input.take().and_then(|input| Some((input, child.stdin.take()?))) {
        // A program that has ended by now says why itself.
        std::thread::spawn(move || stdin.write_all(&input));
    }
    let to_main = to_main.clone();
    std::thread::spawn(move || to_main.send(Event::Ended(index, child.wait_with_output())));
    Ok(Running { name: job.name.clone(), group, alive: true, errors, log: kept })
}

/// Lines of progress go to the bar, all else to the log.
fn read_progress(lines: impl BufRead, mut log: impl Write, to_main: &Sender<Event>) {
    for line in lines.lines().map_while(Result::ok) {
        let _ = match serde_json::from_str(&line) {
            Ok(progress) => to_main.send(Event::Progress(progress)).map_err(io::Error::other),
            Err(_) => writeln!(log, "{line}"),
        };
    }
}

/// How far the ending of children has gone.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Pressure {
    None,
    Terminated,
    Killed,
}

struct Running {
    name: String,
    group: Pid,
    alive: bool,
    errors: Errors,
    log: Option<Log>,
}

struct Watch<'a> {
    running: Vec<Running>,
    outcome: Outcome,
    pressure: Pressure,
    /// When the next step of their ending is due.
    deadline: Option<Instant>,
    begun: Instant,
    /// When they have taken too long.
    limit: Option<Instant>,
    /// When it is next said how long they take.
    says: Instant,
    /// When their logs are next looked at.
    looks: Instant,
    rules: Rules<'a>,
}

impl Watch<'_> {
    fn until_all_ended(&mut self, events: &Events) {
        while self.running.iter().any(|r| r.alive) {
            let now = Instant::now();
            if self.looks <= now {
                self.looks = now + logs::LOOK;
                self.running.iter_mut().filter_map(|one| one.log.as_mut()).for_each(Log::look);
            }
            let next = [self.deadline, self.limit].into_iter().flatten().fold(self.says, Instant::min);
            match events.receiver.recv_timeout(next.min(self.looks).saturating_duration_since(now)) {
                Ok(Event::Progress(line)) => self.say(Said::Line(&line)),
                Ok(Event::Ended(index, output)) => self.ended(index, output),
                Ok(Event::Signal) => self.signalled(),
                Err(RecvTimeoutError::Timeout) => self.timed_out(Instant::now()),
                Err(RecvTimeoutError::Disconnected) => self.press(Pressure::Killed),
            }
        }
    }

    fn say(&mut self, what: Said) {
        if let Some(say) = &mut self.rules.say {
            say(what);
        }
    }

    fn timed_out(&mut self, now: Instant) {
        if self.says <= now {
            self.says = now + SAID;
            self.say(Said::Seconds(self.begun.elapsed().as_secs()));
        }
        if self.limit.is_some_and(|limit| limit <= now) {
            self.limit = None;
            self.outcome.too_slow = true;
            self.end_in_order();
        }
        if self.deadline.is_some_and(|deadline| deadline <= now) {
            let next = if self.pressure == Pressure::None { Pressure::Terminated } else { Pressure::Killed };
            self.press(next);
        }
    }

    fn ended(&mut self, index: usize, output: io::Result<Output>) {
        let one = &mut self.running[index];
        one.alive = false;
        // What it has started itself must not outlive it. The group's number cannot have been given
        // away: as long as one of the group lives it is taken, and else this comes at once.
        let _ = kill_process_group(one.group, Signal::KILL);
        // Waiting fails only for what is no child; then nothing is known of it.
        let (status, stdout, stderr) = output.map(|it| (it.status, it.stdout, it.stderr)).unwrap_or_default();
        tracing::info!("{} ended: {status}", one.name);
        let (name, forced, errors) = (one.name.clone(), self.pressure > Pressure::None, one.errors.read());
        self.outcome.ends.push(End { index, name, status, forced, stdout, stderr, errors });
        if self.rules.together {
            self.within(if index > 0 && status.success() { GRACE_AFTER_SUCCESS } else { GRACE });
        }
    }

    fn signalled(&mut self) {
        if self.outcome.interrupted {
            self.press(if self.rules.together { Pressure::Killed } else { Pressure::Terminated });
            return;
        }
        self.outcome.interrupted = true;
        self.end_in_order();
    }

    /// Through the one that leads, if that is there.
    fn end_in_order(&mut self) {
        match (self.running.first(), self.rules.grace) {
            (_, None) => self.press(Pressure::Killed),
            (Some(leader), Some(grace)) if leader.alive => {
                let _ = kill_process_group(leader.group, Signal::TERM);
                self.within(grace);
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
