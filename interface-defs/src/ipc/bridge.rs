//! Both ends of a bridge, which passes a run's messages and windows to a solver that is elsewhere without changing a bit: one takes
//! the solver's place beside the coupler, the other one the coupler's place beside the solver.

use super::channel::FieldRequest;
use super::link::{self, Link, Look};
use super::memory::check_space;
use super::remote::{Host, HostOptions, Remote};
use super::run_id::RunId;
use super::serve::{self, Connection, Session, Work};
use super::wait::{Wait, is_orphan, launcher_lost};
use super::{interrupt, transport};
use crate::diagnostic::Diagnostic;
use crate::header::{AnswerHeader, RequestHeader, Status};
use crate::message::{
    Fault, FaultKind, FromSolver, Statistics, ToSolver, broken_at, decode, encode, pack, unpack,
};
use crate::participant::{Failure, Participant, Request};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::cell::RefCell;
use std::net::TcpListener;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Length of both headers [bytes].
const HEADER: usize = 64;

/// Of the coupler's patience that of the bridge: its reason comes first.
const SHARE: f64 = 0.9;

/// What a solver that is elsewhere is told: its frame holds these fields as section 3 of `PROTOCOL.md` writes them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Invitation {
    /// Longest time for an answer [s].
    pub timeout: f64,
    /// Its name in the run: `dem` or `fem`.
    pub name: String,
    /// Whether it must do without its savings.
    pub no_shortcuts: bool,
    /// Text of the scene.
    pub scene: String,
}

/// What came in the place of something else.
fn unexpected(link: &Link, kind: u8, due: &str) -> Failure {
    link.failure(format!("the other side sent a frame of kind {kind} in the place of {due}"))
}

fn send(link: &mut Link, message: &impl Serialize) -> Result<(), Failure> {
    link.send(link::MESSAGE, &encode(message), &[])
}

/// A header, and the bytes of the numbers behind it.
fn split<H: DeserializeOwned>(bytes: &[u8]) -> Option<(H, &[[u8; 8]])> {
    let (header, numbers) = bytes.split_at_checked(HEADER)?;
    let (numbers, rest) = numbers.as_chunks();
    rest.is_empty().then_some((unpack(header).ok()?, numbers))
}

/// A failure as the coupler is told.
fn fault(failure: &Failure) -> Fault {
    match failure {
        Failure::Fault { fault, .. } => fault.clone(),
        other => Fault::new(FaultKind::Broken, Diagnostic::error(crate::code::PROCESS, other.to_string())),
    }
}

/// Take the place of a solver in a run, and pass everything to whoever connects to `listener` and knows `token`. From then on
/// nobody else can connect.
pub fn listen(
    listener: TcpListener,
    token: &[u8],
    connection: &Connection,
    (scene, no_shortcuts): (String, bool),
) -> Result<(), Failure> {
    let timeout = SHARE * connection.timeout.as_secs_f64();
    let invited = invite(
        &listener,
        token,
        connection,
        Invitation { timeout, name: connection.name.clone(), no_shortcuts, scene },
    );
    let (mut link, hello) = invited.inspect_err(|failure| {
        let _ = serve::refuse(&fault(failure), connection);
    })?;
    drop(listener);
    serve::join(connection, |session| session.stand_in(&mut link, &hello))
}

/// Wait for the other side, and for who its solver is.
fn invite(
    listener: &TcpListener,
    token: &[u8],
    connection: &Connection,
    invitation: Invitation,
) -> Result<(Link, FromSolver), Failure> {
    let timeout = Duration::from_secs_f64(invitation.timeout);
    let until = Instant::now() + timeout;
    let mut look = || match connection.supervisor {
        Some(pid) if is_orphan(pid) => Err(launcher_lost("while the bridge waited".into())),
        _ => interrupted(),
    };
    let mut link = Link::accept(listener, token, timeout, &mut look)?;
    let late = link.failure(format!("its solver has not said who it is in {:.1} s", invitation.timeout));
    let mut look = || if Instant::now() > until { Err(late.clone()) } else { look() };
    let asked = link.send(link::SCENE, &pack(&invitation), &[]);
    let answer = match asked.and_then(|()| ask(&mut link, &ToSolver::Connect, &mut look, &mut |_| Ok(()))) {
        Ok(FromSolver::Fault(fault)) => Err(Failure::Fault { solver: connection.name.clone(), fault }),
        other => other,
    };
    let answer = answer.inspect_err(|failure| link.end(&failure.to_string()))?;
    Ok((link, answer))
}

/// The message with which the other side answers; progress that comes before goes to `progress`.
fn ask(
    link: &mut Link,
    message: &ToSolver,
    look: Look,
    progress: &mut dyn FnMut(FromSolver) -> Result<(), Failure>,
) -> Result<FromSolver, Failure> {
    send(link, message)?;
    loop {
        match link.receive(look)? {
            (link::MESSAGE, bytes) => match decode(&bytes).map_err(|e| {
                let place = broken_at(&bytes).map_or(String::new(), |place| format!("; {place}"));
                link.failure(format!("the other side {e}{place}"))
            })? {
                said @ FromSolver::Progress(_) => progress(said)?,
                answer => return Ok(answer),
            },
            (kind, _) => return Err(unexpected(link, kind, "a message")),
        }
    }
}

impl Session<'_> {
    /// Answer in the place of the solver at the other end, until the run is over.
    fn stand_in(&mut self, link: &mut Link, hello: &FromSolver) -> Result<(), Failure> {
        let Err(failure) = self.pass(link, hello) else { return self.linger() };
        link.end(&failure.to_string());
        match &failure {
            Failure::Aborted(_) => self.send(&FromSolver::Statistics(Statistics::default()))?,
            // The other side is at fault, or gone: whatever the coupler asks now, it is told.
            Failure::Transport(_) => {
                let fault = fault(&failure);
                let _ = self.decline(&fault);
            }
            _ => {}
        }
        Err(failure)
    }

    fn pass(&mut self, link: &mut Link, hello: &FromSolver) -> Result<(), Failure> {
        let mut longest = 0;
        loop {
            match self.wait(|| link.tend())? {
                Work::Message(ToSolver::Connect) => self.send(hello)?,
                Work::Message(ToSolver::Abort { reason }) => return Err(Failure::Aborted(reason)),
                Work::Message(message) => {
                    let answer = self.forward(link, &message)?;
                    if let (ToSolver::Prepare(plan), FromSolver::Ready(ready)) = (&message, &answer) {
                        self.offer(plan, ready)?;
                    }
                    self.send(&answer)?;
                    if matches!(message, ToSolver::Finish { .. }) {
                        return Ok(());
                    }
                }
                Work::Window(request) => {
                    let passed = exchange(link, &request).and_then(|answer| {
                        let answered = split::<AnswerHeader>(&answer);
                        let (header, numbers) = answered
                            .ok_or_else(|| link.failure("the other side sent an answer that is none"))?;
                        if numbers.len() > longest {
                            check_space(2 * 8 * numbers.len() as u64)?;
                            longest = numbers.len();
                        }
                        self.respond(&request, header, numbers)
                    });
                    if let Err(failure) = passed {
                        self.fail(&request)?;
                        return Err(failure);
                    }
                }
            }
        }
    }

    /// The answer of the other side to a message.
    fn forward(&self, link: &mut Link, message: &ToSolver) -> Result<FromSolver, Failure> {
        let ring = || self.bell.ring();
        let mut look = || match self.control.borrow_mut().poll(&ring)? {
            Some(ToSolver::Abort { reason }) => Err(Failure::Aborted(reason)),
            _ => Ok(()),
        };
        ask(link, message, &mut look, &mut |progress| {
            let mut control = self.control.borrow_mut();
            // A report that nobody waits for yet is passed over; the next one follows soon.
            if control.is_asked() { control.send(&progress, true, &ring) } else { Ok(()) }
        })
    }

    fn respond(
        &self,
        request: &FieldRequest,
        header: AnswerHeader,
        numbers: &[[u8; 8]],
    ) -> Result<(), Failure> {
        let failed = "cannot answer a window";
        let mut response = request.loan_slice_uninit(numbers.len()).map_err(transport(failed))?;
        *response.user_header_mut() = header;
        response.write_from_fn(|i| f64::from_le_bytes(numbers[i])).send().map_err(transport(failed))?;
        self.bell.ring();
        Ok(())
    }

    /// The window has failed; the coupler will ask why.
    fn fail(&self, request: &FieldRequest) -> Result<(), Failure> {
        self.respond(request, AnswerHeader::echo(request.user_header(), Status::Failed), &[])
    }

    /// Answer everything with `fault`, until the coupler ends the run.
    fn decline(&self, fault: &Fault) -> Result<(), Failure> {
        let message = FromSolver::Fault(fault.clone());
        if self.control.borrow().is_asked() {
            self.send(&message)?;
        }
        loop {
            match self.wait(|| Ok(()))? {
                Work::Window(request) => self.fail(&request)?,
                Work::Message(ToSolver::Abort { .. }) => {
                    return self.send(&FromSolver::Statistics(Statistics::default()));
                }
                Work::Message(_) => self.send(&message)?,
            }
        }
    }
}

/// Pass on a window, and wait for its answer.
fn exchange(link: &mut Link, request: &FieldRequest) -> Result<Vec<u8>, Failure> {
    link.send(link::REQUEST, &pack(request.user_header()), request.payload())?;
    match link.receive(&mut || Ok(()))? {
        (link::ANSWER, answer) => Ok(answer),
        (kind, _) => Err(unexpected(link, kind, "the answer to a window")),
    }
}

/// Connect to the bridge at `to`. It says what the solver is to be told.
pub fn connect(to: &str, token: &[u8], timeout: Duration) -> Result<(Link, Invitation), Failure> {
    let mut look = interrupted;
    let mut link = Link::connect(to, token, timeout, &mut look)?;
    match link.receive(&mut look)? {
        (link::SCENE, bytes) => {
            let read = unpack::<Invitation>(&bytes).map_err(|e| link.failure(e.to_string()))?;
            let timeout = Duration::try_from_secs_f64(read.timeout);
            link.timeout =
                timeout.map_err(|e| link.failure(format!("a timeout of {} s: {e}", read.timeout)))?;
            Ok((link, read))
        }
        (kind, _) => Err(unexpected(&link, kind, "a scene")),
    }
}

fn interrupted() -> Result<(), Failure> {
    if interrupt::requested() { Err(Failure::Interrupted) } else { Ok(()) }
}

/// Take the coupler's place beside the solver `name` in a run of its own, and pass on what comes by `link`. `look` is asked while the solver
/// is waited for; its failure ends the run.
pub fn lead(
    link: Link,
    name: &str,
    run: RunId,
    mut look: impl FnMut() -> Result<(), Failure> + 'static,
) -> Result<(), Failure> {
    let options = HostOptions { run, timeout: link.timeout, wait: Wait::Auto, supervisor: None };
    let (host, mut remotes) = Host::create(options, &[name])?;
    let link = Rc::new(RefCell::new(link));
    let tended = Rc::clone(&link);
    host.on_tick(move || tended.borrow_mut().tend().and_then(|()| look()));
    let ended = follow(&host, &mut remotes[0], &link);
    if let Err(failure) = &ended {
        link.borrow_mut().end(&failure.to_string());
        remotes[0].abort(&failure.to_string());
    }
    remotes[0].wait_gone();
    drop(remotes);
    host.close();
    ended
}

/// Ask the solver what comes, and send back what it answers.
fn follow(host: &Host, remote: &mut Remote, link: &RefCell<Link>) -> Result<(), Failure> {
    let mut is_prepared = false;
    let mut look = || {
        host.beat();
        interrupted()
    };
    loop {
        let received = link.borrow_mut().receive(&mut look)?;
        match received {
            (link::MESSAGE, bytes) => {
                let message =
                    decode(&bytes).map_err(|e| link.borrow().failure(format!("the other side {e}")))?;
                let answer = match answer(remote, &message, link) {
                    Err(Failure::Fault { fault, .. }) => FromSolver::Fault(fault),
                    other => other?,
                };
                is_prepared |= matches!(answer, FromSolver::Ready(_));
                send(&mut link.borrow_mut(), &answer)?;
                if let FromSolver::Statistics(_) = answer {
                    return Ok(());
                }
            }
            (link::REQUEST, bytes) if is_prepared => {
                let Some((header, numbers)) = split::<RequestHeader>(&bytes) else {
                    return Err(link.borrow().failure("the other side sent a request that is none"));
                };
                let request = Request { header, sends: numbers.len(), expects: None };
                remote.send(request, &mut |payload| {
                    payload.iter_mut().zip(numbers).for_each(|(to, from)| *to = f64::from_le_bytes(*from));
                })?;
                let status = remote.receive()?;
                let listed = remote.listed() as u32;
                let answer = AnswerHeader { listed, ..AnswerHeader::echo(&header, status) };
                link.borrow_mut().send(link::ANSWER, &pack(&answer), remote.answer())?;
            }
            (kind, _) => return Err(unexpected(&link.borrow(), kind, "a message or a request")),
        }
    }
}

fn answer(remote: &mut Remote, message: &ToSolver, link: &RefCell<Link>) -> Result<FromSolver, Failure> {
    match message {
        ToSolver::Connect => remote.hello().map(FromSolver::Hello),
        ToSolver::Prepare(plan) => {
            let mut progress = |said| {
                send(&mut link.borrow_mut(), &FromSolver::Progress(said)).map_err(|failure| fault(&failure))
            };
            remote.prepare(plan, &mut progress).map(FromSolver::Ready)
        }
        ToSolver::Explain => remote.explain().map(FromSolver::Fault),
        ToSolver::Finish { commit } => remote.finish(*commit).map(FromSolver::Statistics),
        ToSolver::Abort { reason } => Err(Failure::Aborted(reason.clone())),
        ToSolver::Save { commit } => remote.save(*commit).map(|state| FromSolver::Saved { state }),
        ToSolver::Resume { state } => remote.resume(state).map(|()| FromSolver::Resumed),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_have_the_bytes_of_the_page_and_numbers_keep_every_bit() {
        let header = RequestHeader { run: 1, sequence: 2, start: -0.0, nodes: 7, ..RequestHeader::default() };
        let mut bytes = pack(&header);
        assert_eq!(bytes.len(), HEADER);
        assert_eq!((bytes[0], bytes[8], bytes[39], bytes[56]), (1, 2, 0x80, 7));
        assert_eq!(pack(&AnswerHeader::echo(&header, Status::Rest)).len(), HEADER);
        let odd = [f64::from_bits(0x7ff0_0000_0000_0001), -0.0, 5e-324];
        bytes.extend(odd.iter().flat_map(|x| x.to_le_bytes()));
        let (back, numbers) = split::<RequestHeader>(&bytes).expect("read");
        assert_eq!((back, numbers.len()), (header, 3));
        assert!(numbers.iter().zip(odd).all(|(got, due)| *got == due.to_le_bytes()));
        assert!(
            split::<RequestHeader>(&bytes[..70]).is_none() && split::<RequestHeader>(&bytes[..63]).is_none()
        );
    }
}
