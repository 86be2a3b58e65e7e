//! Control messages in frames: each request frame is answered by exactly one response frame.
//!
//! A message longer than a frame travels in parts. The coupler sends part after part; each but the
//! last is answered by an empty frame (`part` = 0). The solver answers the last part with the first
//! part of its own message; the coupler fetches every further part, and every further message
//! while `more` = 1, with an empty frame of its own.

use super::channel::{ControlClient, ControlHeader, ControlRequest, ControlServer};
use super::transport;
use crate::clause;
use crate::message::{DecodeError, FromSolver, ToSolver, broken_at, decode, encode};
use crate::participant::Failure;

/// Longest frame [bytes].
pub const FRAME: usize = 64 * 1024;

/// A frame, as it was received or is to be sent.
type Frame = (ControlHeader, Vec<u8>);
/// A message, and whether another one follows it.
type Answer = Result<(FromSolver, bool), Failure>;

/// The frames of a message with their headers; `more`: another message follows it.
fn frames(run: u64, bytes: &[u8], more: bool) -> impl Iterator<Item = (ControlHeader, &[u8])> {
    let parts = bytes.len().div_ceil(FRAME) as u32;
    let header = move |part| ControlHeader { run, part, parts, more: more.into(), reserved: 0 };
    (1..).zip(bytes.chunks(FRAME)).map(move |(part, frame)| (header(part), frame))
}

/// The coupler's end.
pub(crate) struct Caller {
    /// Always there but while it is made anew.
    pub client: Option<ControlClient>,
    pub solver: String,
    pub run: u64,
}

impl Caller {
    /// Send `message` and return the first message that comes back. `wait` waits for one frame.
    pub fn call(&self, message: &ToSolver, wait: &mut WaitFrame) -> Answer {
        let (bytes, mut last) = (encode(message), None);
        for (header, frame) in frames(self.run, &bytes, false) {
            last = Some(self.exchange(header, frame, wait)?);
        }
        self.collect(last.expect("a message has a version byte"), wait)
    }

    /// The next message, after one that said that more follow.
    pub fn next(&self, wait: &mut WaitFrame) -> Answer {
        self.collect(self.fetch(wait)?, wait)
    }

    fn fetch(&self, wait: &mut WaitFrame) -> Result<Frame, Failure> {
        self.exchange(ControlHeader { run: self.run, ..Default::default() }, &[], wait)
    }

    fn collect(&self, (mut header, mut bytes): Frame, wait: &mut WaitFrame) -> Answer {
        for part in 1..header.parts {
            let (next, more_bytes) = self.fetch(wait)?;
            if (next.part, next.parts) != (part + 1, header.parts) {
                let (got, of, due, all) = (next.part, next.parts, part + 1, header.parts);
                let what = format!("sent part {got} of {of} where part {due} of {all} was expected");
                return Err(Failure::contract(&self.solver, what));
            }
            header = next;
            bytes.extend_from_slice(&more_bytes);
        }
        let message = decode(&bytes).map_err(|e| {
            let clause = if matches!(e, DecodeError::Protocol(_)) { clause::VERSION } else { clause::JOINS };
            let place = broken_at(&bytes).map_or(String::new(), |place| format!("; {place}"));
            Failure::breach(&self.solver, clause, format!("{e}{place}"))
        })?;
        Ok((message, header.more == 1))
    }

    fn exchange(&self, header: ControlHeader, frame: &[u8], wait: &mut WaitFrame) -> Result<Frame, Failure> {
        let failed = || format!("cannot send a message to {}", self.solver);
        let client = self.client.as_ref().expect("it is made anew between two messages");
        let send = || {
            let mut request = client.loan_slice_uninit(frame.len()).map_err(transport(failed()))?;
            *request.user_header_mut() = header;
            request.write_from_slice(frame).send().map_err(transport(failed()))
        };
        let mut pending = Some(send()?);
        let mut poll = || -> Result<Option<Frame>, Failure> {
            // iceoryx2 counts a server before a client can find it: what is sent in between has reached nobody, and is sent again.
            // Taken out before: there is room for one.
            let sent = pending.take().filter(|sent| sent.number_of_server_connections() > 0);
            let response = pending.insert(sent.map_or_else(&send, Ok)?).receive();
            let response =
                response.map_err(transport(format!("cannot read a message of {}", self.solver)))?;
            Ok(response.map(|r| (*r.user_header(), r.payload().to_vec())))
        };
        let (answer, bytes) = wait(&mut poll)?;
        if answer.run != self.run {
            let what = format!("answered run {:016x}, this is run {:016x}", answer.run, self.run);
            return Err(Failure::contract(&self.solver, what));
        }
        Ok((answer, bytes))
    }
}

/// Polls for one frame.
pub(crate) type PollFrame<'a> = dyn FnMut() -> Result<Option<Frame>, Failure> + 'a;
/// Waits for one frame, polling with what it is given.
pub(crate) type WaitFrame<'a> = dyn FnMut(&mut PollFrame) -> Result<Frame, Failure> + 'a;

/// The solver's end. Holds the request that is to be answered.
pub(crate) struct Listener {
    pub server: ControlServer,
    pub run: u64,
    request: Option<ControlRequest>,
    bytes: Vec<u8>,
    outgoing: Vec<Frame>,
    /// The request answered last: connected until the coupler has read the response.
    answered: Option<ControlRequest>,
}

impl Listener {
    pub fn new(server: ControlServer, run: u64) -> Self {
        Self { server, run, request: None, bytes: Vec::new(), outgoing: Vec::new(), answered: None }
    }

    /// Take what has come: a whole message, or nothing yet. `ring` wakes the coupler.
    pub fn poll(&mut self, ring: &dyn Fn()) -> Result<Option<ToSolver>, Failure> {
        // A request on loan, even an answered one, keeps the next from coming.
        self.answered = None;
        while let Some(request) =
            self.server.receive().map_err(transport("cannot read a message of the coupler"))?
        {
            let header = *request.user_header();
            if header.run != self.run {
                return Err(broken(format!("asked run {:016x}, this is run {:016x}", header.run, self.run)));
            }
            if header.part == 0 {
                // The coupler fetches: send what is left, or keep the request for what comes.
                self.request = Some(request);
                self.flush(ring)?;
                return Ok(None);
            }
            if header.part == 1 {
                self.bytes.clear();
            }
            self.bytes.extend_from_slice(request.payload());
            if header.part < header.parts {
                respond(&request, ControlHeader { run: self.run, ..Default::default() }, &[])?;
                ring();
                continue;
            }
            self.request = Some(request);
            return decode(&self.bytes).map(Some).map_err(|e| broken(e.to_string()));
        }
        Ok(None)
    }

    /// Whether the coupler waits for a message now.
    pub fn is_asked(&self) -> bool {
        self.request.is_some() && self.outgoing.is_empty()
    }

    /// Whether all of the last message has been fetched.
    pub fn is_sent(&self) -> bool {
        self.outgoing.is_empty()
    }

    /// Whether the coupler has read the last response.
    pub fn is_fetched(&self) -> bool {
        self.answered.as_ref().is_none_or(|request| !request.is_connected())
    }

    /// Answer, now or as soon as the coupler fetches it.
    pub fn send(&mut self, message: &FromSolver, more: bool, ring: &dyn Fn()) -> Result<(), Failure> {
        let bytes = encode(message);
        let frames = frames(self.run, &bytes, more).map(|(header, frame)| (header, frame.to_vec()));
        self.outgoing.extend(frames);
        self.flush(ring)
    }

    fn flush(&mut self, ring: &dyn Fn()) -> Result<(), Failure> {
        if self.outgoing.is_empty() {
            return Ok(());
        }
        if let Some(request) = self.request.take() {
            let (header, frame) = self.outgoing.remove(0);
            respond(&request, header, &frame)?;
            self.answered = Some(request);
            ring();
        }
        Ok(())
    }
}

fn respond(request: &ControlRequest, header: ControlHeader, frame: &[u8]) -> Result<(), Failure> {
    let failed = || "cannot answer the coupler".to_string();
    let mut response = request.loan_slice_uninit(frame.len()).map_err(transport(failed()))?;
    *response.user_header_mut() = header;
    response.write_from_slice(frame).send().map_err(transport(failed()))
}

/// The coupler breaks the contract.
pub(crate) fn broken(what: String) -> Failure {
    Failure::contract("the coupler", what)
}
