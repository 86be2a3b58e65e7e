//! A recording: all that the coupler and both solvers have said to each other in a run, in its order, in one file.
//!
//! The line `rockfall recording 1`, then entries: the length of each as 8 bytes (little-endian) and the entry as [`pack`] writes it. The first one
//! is the scene. A file that ends within an entry was cut off; what stands before that is good.

use crate::files::{self, Stream};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::{Fault, Hello, Plan, Ready, Statistics, pack, unpack};
use interface_defs::participant::{Failure, Fill, Participant, Request};
use interface_defs::solver::OnProgress;
use interface_defs::{RequestHeader, Status};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// First line of the file.
const TITLE: &str = "rockfall recording 1\n";

/// One thing that was said.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Entry {
    /// The resolved scene that all programs have read.
    Scene(String),
    /// A solver has joined.
    Hello(String, Hello),
    /// It was given its plan.
    Prepare(String, Box<(Plan, Ready)>),
    /// It was sent a request.
    Exchange(Exchange),
    /// It was asked why the last window failed.
    Explain(String, Fault),
    /// It was given the end.
    Finish(String, bool, Box<Statistics>),
}

/// A request and its answer.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Exchange {
    /// The solver.
    pub solver: String,
    /// Number of the window and iteration in it.
    pub window: (u64, u32),
    /// Number of the command.
    pub command: u32,
    /// Start and length of the window [s].
    pub span: (f64, f64),
    /// Selection, numbers that select, and how many of them are nodes.
    pub selection: (u32, u32, u32),
    /// Numbers of the answer without its list, where that is known before.
    pub expects: Option<u64>,
    /// What was sent.
    pub sent: Vec<f64>,
    /// Number of the status; 0 where no answer came.
    pub status: u32,
    /// The answer, and how many numbers at its end are a list.
    pub answer: Vec<f64>,
    /// See `answer`.
    pub listed: u64,
}

impl Exchange {
    /// The request, as it was.
    pub fn request(&self) -> Request {
        let (selection, listed, nodes) = self.selection;
        let header = RequestHeader {
            window: self.window.0,
            iteration: self.window.1,
            command: self.command,
            start: self.span.0,
            length: self.span.1,
            selection,
            listed,
            nodes,
            ..RequestHeader::default()
        };
        Request { header, sends: self.sent.len(), expects: self.expects.map(|n| n as usize) }
    }
}

/// The file while it is written.
#[derive(Debug)]
pub struct Writer(RefCell<BufWriter<Stream>>);

impl Writer {
    /// A new file at `path`, for a run of `scene`.
    pub fn create(path: &Path, scene: &str) -> io::Result<Self> {
        let mut file = BufWriter::new(files::create(path)?);
        file.write_all(TITLE.as_bytes())?;
        let writer = Self(RefCell::new(file));
        writer.write(&Entry::Scene(scene.into()))?;
        Ok(writer)
    }

    fn write(&self, entry: &Entry) -> io::Result<()> {
        let bytes = pack(entry);
        let mut file = self.0.borrow_mut();
        file.write_all(&(bytes.len() as u64).to_le_bytes())?;
        file.write_all(&bytes)
    }

    /// Everything is in the file.
    pub fn flush(&self) -> io::Result<()> {
        self.0.borrow_mut().flush()
    }
}

/// A solver of which everything is written down. Nothing of what is said changes.
pub struct Recorded<'a> {
    solver: &'a mut dyn Participant,
    file: &'a Writer,
    asked: Exchange,
}

impl<'a> Recorded<'a> {
    /// Write what `solver` says to `file`.
    pub fn new(solver: &'a mut dyn Participant, file: &'a Writer) -> Self {
        let asked = Exchange { solver: solver.name().into(), ..Exchange::default() };
        Self { solver, file, asked }
    }

    fn keep(&self, entry: impl FnOnce(String) -> Entry) -> Result<(), Failure> {
        let written = self.file.write(&entry(self.asked.solver.clone()));
        written.map_err(|e| Failure::Transport(format!("--record: it cannot be written: {e}")))
    }
}

impl Participant for Recorded<'_> {
    fn name(&self) -> &str {
        self.solver.name()
    }

    fn hello(&mut self) -> Result<Hello, Failure> {
        let hello = self.solver.hello()?;
        self.keep(|name| Entry::Hello(name, hello.clone()))?;
        Ok(hello)
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Failure> {
        let ready = self.solver.prepare(plan, progress)?;
        self.keep(|name| Entry::Prepare(name, Box::new((plan.clone(), ready.clone()))))?;
        Ok(ready)
    }

    fn send(&mut self, request: Request, fill: Fill) -> Result<(), Failure> {
        let header = request.header;
        self.asked.window = (header.window, header.iteration);
        self.asked.command = header.command;
        self.asked.span = (header.start, header.length);
        self.asked.selection = (header.selection, header.listed, header.nodes);
        self.asked.expects = request.expects.map(|n| n as u64);
        let sent = &mut self.asked.sent;
        self.solver.send(request, &mut |payload| {
            fill(payload);
            sent.clear();
            sent.extend_from_slice(payload);
        })
    }

    fn receive(&mut self) -> Result<Status, Failure> {
        let received = self.solver.receive();
        let Exchange { status, answer, listed, .. } = &mut self.asked;
        (*status, *listed) = (received.as_ref().map_or(0, |status| *status as u32), 0);
        answer.clear();
        if received.is_ok() {
            answer.extend_from_slice(self.solver.answer());
            *listed = self.solver.listed() as u64;
        }
        self.keep(|_| Entry::Exchange(self.asked.clone()))?;
        received
    }

    fn answer(&self) -> &[f64] {
        self.solver.answer()
    }

    fn listed(&self) -> usize {
        self.solver.listed()
    }

    fn explain(&mut self) -> Result<Fault, Failure> {
        let fault = self.solver.explain()?;
        self.keep(|name| Entry::Explain(name, fault.clone()))?;
        Ok(fault)
    }

    fn finish(&mut self, commit: bool) -> Result<Statistics, Failure> {
        let statistics = self.solver.finish(commit)?;
        self.keep(|name| Entry::Finish(name, commit, Box::new(statistics.clone())))?;
        Ok(statistics)
    }

    fn save(&mut self, commit: bool) -> Result<Vec<u8>, Failure> {
        self.solver.save(commit)
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Failure> {
        self.solver.resume(state)
    }
}

/// A recording that is read, entry by entry.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    file: BufReader<File>,
    /// Bytes that are left.
    left: u64,
    /// The scene of the run.
    pub scene: String,
    /// Whether the file ends within an entry.
    pub cut: bool,
}

impl Reader {
    /// Open the recording at `path`.
    ///
    /// # Errors
    /// A file that cannot be read, and one that is no recording.
    pub fn open(path: &Path) -> Result<Self, Diagnostic> {
        let unreadable = |e: io::Error| {
            Diagnostic::error(code::FILE, format!("{}: the recording cannot be read: {e}", path.display()))
        };
        let file = files::input(path).map_err(unreadable)?;
        let left = file.metadata().map_err(unreadable)?.len();
        let mut it = Self {
            path: path.into(),
            file: BufReader::new(file),
            left: left.saturating_sub(TITLE.len() as u64),
            scene: String::new(),
            cut: false,
        };
        let mut title = Vec::new();
        let read = (&mut it.file).take(TITLE.len() as u64).read_until(b'\n', &mut title);
        read.map_err(unreadable)?;
        match if title == TITLE.as_bytes() { it.next_entry()? } else { None } {
            Some(Entry::Scene(scene)) => it.scene = scene,
            _ => {
                return Err(
                    it.broken("it is no recording of `rockfall run --record`, or one of another version")
                );
            }
        }
        Ok(it)
    }

    fn broken(&self, what: impl std::fmt::Display) -> Diagnostic {
        Diagnostic::error(code::FILE_CONTENT, format!("{}: {what}", self.path.display()))
    }

    /// The next entry; `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read, or holds something else.
    pub fn next_entry(&mut self) -> Result<Option<Entry>, Diagnostic> {
        let mut size = [0; 8];
        self.cut = self.left > 0 && self.left < 8;
        if self.left < 8 {
            return Ok(None);
        }
        self.file.read_exact(&mut size).map_err(|e| self.broken(e))?;
        let size = u64::from_le_bytes(size);
        self.left -= 8;
        self.cut = size > self.left;
        if self.cut {
            return Ok(None);
        }
        let mut bytes = vec![0; size as usize];
        self.file.read_exact(&mut bytes).map_err(|e| self.broken(e))?;
        self.left -= size;
        unpack(&bytes).map(Some).map_err(|e| self.broken(e))
    }
}
