//! Start other programs, watch them, and leave none behind.
//!
//! Each child leads a process group of its own, so that Ctrl-C reaches this program alone, which ends the others in order; and
//! so that what a child has started ends with it. What is wrong a child of this project says as data, see [`Errors`].

use crate::front::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc::interrupt;
use rustix::fs::{FallocateFlags, MemfdFlags, OFlags, fallocate, fcntl_setfl, memfd_create};
use rustix::process::{Pid, Signal, kill_process_group};
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::FileExt;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Output, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};
use toolkit::arguments::Input;
use toolkit::exit::Exit;
use toolkit::progress::Line;
use toolkit::{files, screen};

/// What the others are given to end by themselves when a process has failed or the leader has ended.
const GRACE: Duration = Duration::from_secs(2);

/// The same when a solver has ended without a failure: its partner may have results left to write.
const GRACE_AFTER_SUCCESS: Duration = Duration::from_secs(10);

/// What the leader of a run is given before the others are asked to end, too: less than it waits for an answer of theirs.
const GRACE_ALONE: Duration = Duration::from_millis(700);

/// What the leader of a run is given to end it in order when the user interrupts it.
pub const GRACE_OF_LEADER: Duration = Duration::from_secs(5);

/// The same for a whole run or study, which gives some to its own processes.
pub const GRACE_OF_RUN: Duration = Duration::from_secs(10);

/// Between SIGTERM and SIGKILL.
const GRACE_BEFORE_KILL: Duration = Duration::from_millis(500);

/// A second signal so soon after the first is the same one, sent to this process and to its group, as `timeout` does.
const SAME_SIGNAL: Duration = Duration::from_millis(200);

/// First report of how long something takes, and the least time to the next one, which comes after a tenth more.
const FIRST_REPORT: Duration = Duration::from_secs(10);

/// The same where somebody waits for an answer.
pub const EARLY_REPORT: Duration = Duration::from_secs(2);

/// What is read of the errors of a child at most [bytes]: one that writes without end fills no memory.
const MAX_ERROR_BYTES: u64 = 1 << 20;

/// Where the output of a child goes.
pub enum Destination {
    /// Into this file, behind what is in it. With `progress` its stdout is watched for lines of it.
    Log {
        /// The file.
        file: PathBuf,
        /// Whether lines of progress are looked for.
        progress: bool,
    },
    /// It is captured for whoever has asked.
    Captured,
    /// Where the command says.
    Inherited,
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
    pub output: Destination,
}

impl Job {
    /// A program whose output is kept, with its file as its name.
    pub fn of(command: Command) -> Self {
        let name = command.get_program().to_string_lossy().into_owned();
        Self { name, command, input: None, output: Destination::Captured }
    }
}

/// How children are watched; by default each for itself, silently, and all are killed by a signal.
#[derive(Default)]
pub struct Rules<'a> {
    /// Whether the end of one ends all.
    pub together: bool,
    /// Whether one that has ended well leaves the others no more time than one that has failed: nobody has results to write.
    pub hurry: bool,
    /// What the first of them, which leads, is given to end in order after a signal; `None`: all are killed.
    pub grace: Option<Duration>,
    /// They are ended after this time.
    pub limit: Option<Duration>,
    /// Progress callback.
    pub progress: Option<&'a mut dyn FnMut(&Line)>,
    /// Callback with the seconds since the start, now and then.
    pub seconds: Option<&'a mut dyn FnMut(u64)>,
    /// When that is called first; by default after ten seconds.
    pub first: Option<Duration>,
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
        signalled_at: None,
        deadline: None,
        begun,
        limit,
        says: begun + rules.first.unwrap_or(FIRST_REPORT),
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

/// What a program of this project prints when it is asked; a signal kills it. After two seconds it is said on stderr that it is `doing` it.
pub fn ask_saying(doing: &str, command: Command, events: &Events) -> Result<String, Stop> {
    let mut say = |seconds: u64| eprintln!("{doing}: {seconds} s so far");
    let rules = Rules { seconds: Some(&mut say), first: Some(EARLY_REPORT), ..Rules::default() };
    one(Job::of(command), rules, events)?.0.text()
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
        let _ = file.rewind().and_then(|()| file.take(MAX_ERROR_BYTES).read_to_end(&mut bytes));
        screen::complaints(&String::from_utf8_lossy(&bytes))
    }
}

fn start(job: &mut Job, index: usize, to_main: &Sender<Event>) -> io::Result<Running> {
    let errors = Errors::new()?;
    let command = &mut job.command;
    command.process_group(0);
    // One that speaks for itself says it to whoever has started this one, too.
    if !matches!(job.output, Destination::Inherited) {
        command.env(screen::DIAGNOSTICS, errors.path());
    }
    command.stdin(if job.input.is_some() { Stdio::piped() } else { Stdio::null() });
    let (mut log, mut kept) = (None, None);
    match &job.output {
        Destination::Log { file, progress } => {
            let (bounded, file) = Log::open(file)?;
            kept = Some(bounded);
            command.stderr(file.try_clone()?);
            command.stdout(if *progress { Stdio::piped() } else { file.try_clone()?.into() });
            log = progress.then_some(file);
        }
        Destination::Captured => {
            command.stdout(Stdio::piped()).stderr(Stdio::piped());
        }
        Destination::Inherited => {}
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
    /// The one that leads was asked to end all in order.
    Leader,
    /// The others, too: one of them may be at work on a long window, for which the leader waits.
    Others,
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
    /// When the first signal came.
    signalled_at: Option<Instant>,
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
                self.looks = now + POLL_INTERVAL;
                self.running.iter_mut().filter_map(|one| one.log.as_mut()).for_each(Log::look);
            }
            let next = [self.deadline, self.limit].into_iter().flatten().fold(self.says, Instant::min);
            match events.receiver.recv_timeout(next.min(self.looks).saturating_duration_since(now)) {
                Ok(Event::Progress(line)) => self.rules.progress.iter_mut().for_each(|told| told(&line)),
                Ok(Event::Ended(index, output)) => self.ended(index, output),
                Ok(Event::Signal) => self.signalled(),
                Err(RecvTimeoutError::Timeout) => self.timed_out(Instant::now()),
                Err(RecvTimeoutError::Disconnected) => self.press(Pressure::Killed),
            }
        }
    }

    fn timed_out(&mut self, now: Instant) {
        if self.says <= now {
            let elapsed = self.begun.elapsed();
            self.says = now + FIRST_REPORT.max(elapsed / 10);
            let seconds = elapsed.as_secs();
            self.rules.seconds.iter_mut().for_each(|told| told(seconds));
        }
        if self.limit.is_some_and(|limit| limit <= now) {
            self.limit = None;
            self.outcome.too_slow = true;
            self.end_in_order();
        }
        if self.deadline.is_some_and(|deadline| deadline <= now) {
            match (self.pressure, self.rules.grace) {
                (Pressure::Leader, Some(grace)) if self.running.iter().skip(1).any(|one| one.alive) => {
                    self.ask_others(grace);
                }
                (Pressure::Terminated, _) => self.press(Pressure::Killed),
                _ => self.press(Pressure::Terminated),
            }
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
        let (name, forced, errors) = (one.name.clone(), self.pressure > Pressure::Others, one.errors.read());
        self.outcome.ends.push(End { index, name, status, forced, stdout, stderr, errors });
        if self.rules.together {
            let patient = index > 0 && status.success() && !self.rules.hurry;
            self.within(if patient { GRACE_AFTER_SUCCESS } else { GRACE });
        }
    }

    fn signalled(&mut self) {
        if self.outcome.interrupted {
            if self.signalled_at.is_some_and(|at| at.elapsed() < SAME_SIGNAL) {
                return;
            }
            self.press(if self.rules.together { Pressure::Killed } else { Pressure::Terminated });
            return;
        }
        self.outcome.interrupted = true;
        self.signalled_at = Some(Instant::now());
        self.end_in_order();
    }

    /// Through the one that leads, if that is there.
    fn end_in_order(&mut self) {
        match (self.running.first(), self.rules.grace) {
            (_, None) => self.press(Pressure::Killed),
            (Some(leader), Some(grace)) if leader.alive => {
                let _ = kill_process_group(leader.group, Signal::TERM);
                self.pressure = Pressure::Leader;
                self.within(if self.rules.together { GRACE_ALONE } else { grace });
            }
            _ => self.press(Pressure::Terminated),
        }
    }

    /// All must have ended within `grace` from now, or before if that is due already.
    fn within(&mut self, grace: Duration) {
        let at = Instant::now() + grace;
        self.deadline = Some(self.deadline.map_or(at, |before| before.min(at)));
    }

    /// Ask all but the one that leads to end, and give them `grace`.
    fn ask_others(&mut self, grace: Duration) {
        for one in self.running.iter().skip(1).filter(|one| one.alive) {
            let _ = kill_process_group(one.group, Signal::TERM);
        }
        self.pressure = Pressure::Others;
        self.deadline = Some(Instant::now() + grace);
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

/// What happens while other programs are at work: they end, they say how far they are, the user wants to stop.
pub enum Event {
    /// The process with this number has ended, with what it printed where that is kept.
    Ended(usize, io::Result<Output>),
    /// Ctrl-C, SIGTERM, or a closed terminal.
    Signal,
    /// How far the leader is.
    Progress(Line),
}

/// All that happens, from the start of the program on: a signal ends it in order at any moment.
pub struct Events {
    /// To it.
    pub sender: Sender<Event>,
    /// From it.
    pub receiver: Receiver<Event>,
}

impl Events {
    /// From now on signals are events. One that is ignored stays so, as `nohup` wants it.
    pub fn watch() -> Result<Self, Stop> {
        let (sender, receiver) = channel();
        let mut signals = signal_hook::iterator::Signals::new(interrupt::ending())
            .map_err(|e| Stop::failed(code::PROCESS, format!("signals cannot be watched: {e}")))?;
        // A file that reaches its largest size is an error of the write, and does not end the process.
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
        let to_main = sender.clone();
        std::thread::spawn(move || signals.forever().all(|_| to_main.send(Event::Signal).is_ok()));
        Ok(Self { sender, receiver })
    }

    /// Whether a signal has come. To be asked while nothing is at work: other events are passed over.
    pub fn interrupted(&self) -> bool {
        self.receiver.try_iter().any(|event| matches!(event, Event::Signal))
    }
}

/// What is kept of the beginning of a log, and of its end [bytes].
const KEPT: u64 = 8 << 20;
/// Interval at which the length of a log is looked at.
const POLL_INTERVAL: Duration = Duration::from_millis(250);

/// Where the output of a process goes.
pub fn log_file(dir: &Path, name: &str) -> PathBuf {
    dir.join(format!("{name}.log"))
}

/// A log that others write to, of bounded length: a program that prints without end fills no disk. A process writes into it itself,
/// so that its last words are there even if this program was killed. What lies between the beginning and the end is given back to
/// the disk while it goes on, and left out when it has ended.
#[derive(Debug)]
struct Log {
    file: File,
    /// Where the beginning ends.
    head: u64,
    /// Up to where what is behind the beginning was given back.
    freed: u64,
}

impl Log {
    /// Of the file at `path`, with a handle for those who write to it.
    fn open(path: &Path) -> io::Result<(Self, File)> {
        let to = files::append(path)?.into_file();
        // Two writers share it, and none overwrites the other; one that was created here appends too.
        fcntl_setfl(&to, OFlags::APPEND)?;
        let length = to.metadata()?.len();
        let file = files::reopen(path, length)?.into_file();
        let head = length + KEPT;
        Ok((Self { file, head, freed: head }, to))
    }

    /// Give back what is in the middle. A file system that cannot do that keeps it until the end.
    fn look(&mut self) {
        let end = self.file.metadata().map_or(0, |data| data.len()).saturating_sub(KEPT);
        if end > self.freed {
            let flags = FallocateFlags::PUNCH_HOLE | FallocateFlags::KEEP_SIZE;
            let _ = fallocate(&self.file, flags, self.freed, end - self.freed);
            self.freed = end;
        }
    }

    /// Nobody writes to it any more: leave the middle out.
    fn finish(&mut self) -> io::Result<()> {
        self.look();
        let length = self.file.metadata()?.len();
        // Somebody may have emptied it meanwhile.
        if self.freed == self.head || length < self.freed {
            return Ok(());
        }
        let kept = (length - self.freed).min(KEPT);
        let mut tail = vec![0; kept as usize];
        self.file.read_exact_at(&mut tail, length - kept)?;
        let line = tail.iter().position(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        let left_out = length - self.head - (tail.len() - line) as u64;
        let mut end = format!("\n[{left_out} bytes were left out here]\n").into_bytes();
        end.extend_from_slice(&tail[line..]);
        self.file.write_all_at(&end, self.head)?;
        self.file.set_len(self.head + end.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn the_beginning_and_the_end_are_kept_and_the_middle_takes_no_room() {
        use std::os::unix::fs::MetadataExt;
        let temp = tempfile::tempdir().expect("a directory");
        let path = log_file(temp.path(), "dem");
        let (mut log, mut to) = Log::open(&path).expect("opened");
        let line = |n: u64| format!("line {n:>10}\n");
        let lines = 5 * KEPT / 16;
        for n in 0..lines {
            to.write_all(line(n).as_bytes()).expect("written");
            if n % 100_000 == 0 {
                log.look();
            }
        }
        log.look();
        let data = path.metadata().expect("there");
        assert!(data.blocks() * 512 <= 3 * KEPT, "{} blocks of {} bytes", data.blocks(), data.len());
        log.finish().expect("shortened");
        let text = std::fs::read_to_string(&path).expect("text");
        assert!(text.len() as u64 <= 2 * KEPT + 100, "{}", text.len());
        assert!(text.starts_with(&line(0)) && text.ends_with(&line(lines - 1)));
        let note = text.lines().find(|line| line.ends_with("left out here]")).expect("it is said");
        let bytes: u64 = note[1..].split(' ').next().expect("a number").parse().expect("a number");
        let kept = text.len() as u64 - note.len() as u64 - 2;
        assert_eq!(bytes + kept, 16 * lines);
        // What is short stays as it is, and a second one goes on behind the first.
        let short = temp.path().join("short.log");
        for _ in 0..2 {
            let (mut log, mut to) = Log::open(&short).expect("opened");
            to.write_all(b"a\n").expect("written");
            log.finish().expect("nothing to do");
        }
        assert_eq!(std::fs::read(&short).expect("there"), b"a\na\n");
    }
}
