//! Frames over TCP, between the two ends of a bridge or with a solver that speaks TCP itself: `PROTOCOL.md`, section 7.

use crate::participant::Failure;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

/// First bytes of both greetings.
const MAGIC: &[u8; 8] = b"rockfall";
/// Version of the frames.
const VERSION: u32 = 1;
/// Longest token [bytes].
pub const LONGEST_TOKEN: usize = 1024;
/// Longest payload of a frame [bytes]. Memory is taken as its bytes arrive, and not before.
const LONGEST: usize = 1 << 30;
/// Length and kind.
const HEAD: usize = 5;
/// What a connection is given to say who it is.
const GREETING: Duration = Duration::from_secs(5);
/// Between two signs of life.
const PULSE: Duration = Duration::from_secs(1);
/// Who has given a sign of life once is lost after this time without any.
const SILENCE: Duration = Duration::from_secs(10);
/// How often a wait looks after everything else.
const TICK: Duration = Duration::from_millis(100);
/// Bytes that are read at once; also what may lie unread before it is asked for.
const CHUNK: usize = 1 << 14;

/// Asked some ten times a second in a wait; its failure ends it.
pub type Look<'a> = &'a mut dyn FnMut() -> Result<(), Failure>;

/// What a frame holds: it is over before its time, and why.
pub const END: u8 = 0;
/// What the solver is to read.
pub const SCENE: u8 = 1;
/// A control message.
pub const MESSAGE: u8 = 2;
/// A request for a window: header and numbers.
pub const REQUEST: u8 = 3;
/// Its answer, likewise.
pub const ANSWER: u8 = 4;
/// A sign of life, empty.
const BEAT: u8 = 5;

/// One connection.
pub struct Link {
    stream: TcpStream,
    /// Of which bridge, for messages.
    name: String,
    /// Longest time that a frame is waited for.
    pub timeout: Duration,
    incoming: Vec<u8>,
    /// When the other side was last heard, or asked for something.
    heard: Instant,
    spoke: Instant,
    /// Whether the other side gives signs of life.
    beats: bool,
}

/// The same in a time that tells nothing of where they differ.
fn is_same(a: &[u8], b: &[u8]) -> bool {
    let differ = |all, (x, y): (&u8, &u8)| std::hint::black_box(all | (x ^ y));
    a.len() == b.len() && a.iter().zip(b).fold(0, differ) == 0
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

impl Link {
    fn over(stream: TcpStream, name: String, timeout: Duration) -> Result<Self, Failure> {
        let set = stream
            .set_nonblocking(false)
            .and_then(|()| stream.set_nodelay(true))
            .and_then(|()| stream.set_read_timeout(Some(TICK)))
            .and_then(|()| stream.set_write_timeout(Some(timeout)));
        let (heard, spoke) = (Instant::now(), Instant::now());
        let link = Self { stream, name, timeout, incoming: Vec::new(), heard, spoke, beats: false };
        set.map_err(|e| link.failure(e))?;
        Ok(link)
    }

    /// Wait until somebody connects who knows the token; others are refused.
    pub fn accept(
        listener: &TcpListener,
        token: &[u8],
        timeout: Duration,
        look: Look,
    ) -> Result<Self, Failure> {
        let name = listener.local_addr().map_or_else(|e| e.to_string(), |at| at.to_string());
        let (started, mut refused) = (Instant::now(), String::new());
        loop {
            if let Ok((stream, from)) = listener.accept() {
                let link = Self::over(stream, format!("the bridge at {name}"), timeout);
                match link.and_then(|mut link| link.check(token, look).map(|()| link)) {
                    Err(failure @ Failure::Transport(_)) => {
                        tracing::warn!("refused a connection from {from}: {failure}");
                        refused = format!("; {from} was refused: {failure}");
                    }
                    other => return other,
                }
            } else {
                std::thread::sleep(TICK / 10);
            }
            look()?;
            if started.elapsed() > timeout {
                return Err(Failure::Transport(format!(
                    "the bridge at {name}: nobody has connected in {:.1} s{refused}; start `rockfall bridge --connect {name} -- \
                     COMMAND` on the other side, or raise processes.timeout",
                    timeout.as_secs_f64()
                )));
            }
        }
    }

    /// Who connects must greet as a bridge of this version, and know the token.
    fn check(&mut self, token: &[u8], look: Look) -> Result<(), Failure> {
        let until = Instant::now() + GREETING.min(self.timeout);
        let head = self.exactly(16, until, look)?;
        if head[..8] != *MAGIC {
            return Err(self.failure("the other side is no bridge"));
        }
        self.write(&[&MAGIC[..], &VERSION.to_le_bytes()].concat())?;
        let (version, length) = (u32_at(&head, 8), u32_at(&head, 12) as usize);
        if version != VERSION {
            return Err(self.refuse(&other_version(version)));
        }
        if length > LONGEST_TOKEN {
            return Err(self.refuse(&format!("a token of {length} bytes; it may have {LONGEST_TOKEN}")));
        }
        let given = self.exactly(length, until, look)?;
        if !is_same(&given, token) {
            return Err(self.refuse("wrong token: give both sides the same --token-file"));
        }
        Ok(())
    }

    fn refuse(&mut self, why: &str) -> Failure {
        self.end(why);
        self.failure(why)
    }

    /// Connect to a bridge that listens, again and again until it does.
    pub fn connect(to: &str, token: &[u8], timeout: Duration, look: Look) -> Result<Self, Failure> {
        let (name, started) = (format!("the bridge to {to}"), Instant::now());
        let broken = |e: &io::Error| {
            Failure::Transport(format!("{name}: no connection: {e}; does the run wait there?"))
        };
        let addresses: Vec<_> = to.to_socket_addrs().map_err(|e| broken(&e))?.collect();
        let stream = loop {
            let tried = addresses.iter().map(|address| TcpStream::connect_timeout(address, GREETING));
            match tried.reduce(Result::or).unwrap_or_else(|| Err(ErrorKind::AddrNotAvailable.into())) {
                Ok(stream) => break stream,
                Err(e) if started.elapsed() > timeout => return Err(broken(&e)),
                Err(_) => std::thread::sleep(TICK),
            }
            look()?;
        };
        let mut link = Self::over(stream, name, timeout)?;
        let length = token.len() as u32;
        link.write(&[&MAGIC[..], &VERSION.to_le_bytes(), &length.to_le_bytes(), token].concat())?;
        // The other side may still be at the greeting of another connection.
        let head = link.exactly(12, Instant::now() + 2 * GREETING, look)?;
        if head[..8] != *MAGIC {
            return Err(link.failure("the other side is no bridge; look at the port"));
        }
        match u32_at(&head, 8) {
            VERSION => Ok(link),
            other => Err(link.failure(other_version(other))),
        }
    }

    /// The bridge cannot go on.
    pub fn failure(&self, what: impl std::fmt::Display) -> Failure {
        Failure::Transport(format!("{}: {what}", self.name))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.spoke = Instant::now();
        self.stream.write_all(bytes).map_err(|e| self.broken(&e))
    }

    /// Send a frame: `head`, then numbers.
    pub fn send(&mut self, kind: u8, head: &[u8], numbers: &[f64]) -> Result<(), Failure> {
        let length = head.len() + 8 * numbers.len();
        if length > LONGEST {
            return Err(
                self.failure(format!("a frame of {length} bytes is to be sent; {LONGEST} are allowed"))
            );
        }
        let mut frame = Vec::with_capacity(HEAD + length);
        frame.extend_from_slice(&(length as u32).to_le_bytes());
        frame.push(kind);
        frame.extend_from_slice(head);
        frame.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        if kind != BEAT {
            self.heard = Instant::now();
        }
        self.write(&frame)
    }

    /// Say why it is over. Who is gone does not hear it.
    pub fn end(&mut self, why: &str) {
        let _ = self.send(END, why.as_bytes(), &[]);
    }

    fn closed(&self) -> Failure {
        self.failure("the other side has closed the connection; look at what was printed there, it may have been killed")
    }

    /// Who ends with something unread resets its connection; to the other side that is closed as well.
    fn broken(&self, error: &io::Error) -> Failure {
        match error.kind() {
            ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted | ErrorKind::BrokenPipe => {
                self.closed()
            }
            _ => self.failure(format!("the connection was lost ({error}); look at what was printed there")),
        }
    }

    /// Read what has come, waiting for it as long as the stream does; whether there was something.
    fn read(&mut self) -> Result<bool, Failure> {
        let mut chunk = [0; CHUNK];
        match self.stream.read(&mut chunk) {
            Ok(0) => Err(self.closed()),
            Ok(count) => {
                self.incoming.extend_from_slice(&chunk[..count]);
                self.heard = Instant::now();
                Ok(true)
            }
            Err(e)
                if matches!(
                    e.kind(),
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
                ) =>
            {
                Ok(false)
            }
            Err(e) => Err(self.broken(&e)),
        }
    }

    /// So many bytes of a greeting.
    fn exactly(&mut self, count: usize, until: Instant, look: Look) -> Result<Vec<u8>, Failure> {
        while self.incoming.len() < count {
            self.read()?;
            look()?;
            if Instant::now() > until {
                return Err(self.failure("the other side has connected and does not say who it is"));
            }
        }
        Ok(self.incoming.drain(..count).collect())
    }

    /// Kind and length of the next frame that is no sign of life, as far as it is known.
    fn next(&mut self) -> Result<Option<(u8, usize)>, Failure> {
        while self.incoming.len() >= HEAD {
            let (length, kind) = (u32_at(&self.incoming, 0) as usize, self.incoming[4]);
            let most = if kind == BEAT { 0 } else { LONGEST };
            if kind > BEAT {
                return Err(self.failure(format!("a frame of kind {kind} came, which has no meaning")));
            } else if length > most {
                let what =
                    format!("a frame of {length} bytes was announced; {most} are allowed of kind {kind}");
                return Err(self.failure(what));
            } else if kind == END && self.incoming.len() >= HEAD + length {
                let why = String::from_utf8_lossy(&self.incoming[HEAD..HEAD + length]);
                return Err(self.failure(format!("the other side has ended: {why}")));
            } else if kind != BEAT {
                return Ok(Some((kind, length)));
            }
            self.beats = true;
            self.incoming.drain(..HEAD);
        }
        Ok(None)
    }

    /// Give a sign of life, and miss those of the other side. `due`: it owes an answer.
    fn keep(&mut self, due: bool) -> Result<(), Failure> {
        if self.spoke.elapsed() > PULSE {
            self.send(BEAT, &[], &[])?;
        }
        let limit = if self.beats { SILENCE.min(self.timeout) } else { self.timeout };
        let quiet = self.heard.elapsed();
        if quiet > limit && (due || self.beats) {
            let [quiet, limit] = [quiet, limit].map(|time| time.as_secs_f64());
            return Err(self.failure(format!(
                "nothing was heard of the other side for {quiet:.1} s of {limit:.1} s; is it stopped, or the network down? if it \
                 needs longer, raise processes.timeout"
            )));
        }
        Ok(())
    }

    /// Wait for a frame. `look` is asked some ten times a second, and its failure ends the wait.
    pub fn receive(&mut self, look: Look) -> Result<(u8, Vec<u8>), Failure> {
        loop {
            if let Some((kind, length)) = self.next()?
                && self.incoming.len() >= HEAD + length
            {
                let rest = self.incoming.split_off(HEAD + length);
                let frame = std::mem::replace(&mut self.incoming, rest);
                return Ok((kind, frame[HEAD..].to_vec()));
            }
            self.read()?;
            look()?;
            self.keep(true)?;
        }
    }

    /// To be called some ten times a second while no frame is waited for: signs of life, and whether it is over.
    pub fn tend(&mut self) -> Result<(), Failure> {
        let _ = self.stream.set_nonblocking(true);
        let mut read = Ok(true);
        while self.incoming.len() < CHUNK && read == Ok(true) {
            read = self.read();
        }
        let _ = self.stream.set_nonblocking(false);
        // Its reason, before that it has closed the connection.
        self.next()?;
        read?;
        self.keep(false)
    }
}

fn other_version(version: u32) -> String {
    format!(
        "it speaks version {version} of the bridge, this side speaks {VERSION}; use matching builds of rockfall"
    )
}
