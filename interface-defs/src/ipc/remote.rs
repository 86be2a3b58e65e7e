//! The coupler's side: creates the channels, waits for the solvers, exchanges payloads.

use super::channel::{
    self, Channels, ControlClient, FieldClient, FieldPending, FieldResponse, HEARTBEAT, Listener, Node,
    Notifier,
};
use super::control::{Caller, FRAME};
use super::domain::{Domain, Ownership};
use super::memory::check_space;
use super::run_id::RunId;
use super::wait::{self, Patience, Wait};
use super::{interrupt, transport};
use crate::clause;
use crate::header::{RequestHeader, Status};
use crate::message::{Fault, FromSolver, Hello, Plan, Ready, Statistics, ToSolver};
use crate::participant::{Failure, Fill, Participant, Request, payload_lengths};
use crate::solver::OnProgress;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, EventId};
use iceoryx2::service::port_factory::PortFactory;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Exchanges between two looks after the launcher.
const LOOK_AFTER: u64 = 256;

/// How long an answer to the first message is waited for at first, and twice as long each time after. A server whose first connection
/// to this client failed does not try again (iceoryx2 0.10: `Server::new` warns); it connects to the next client.
const CONNECT: Duration = Duration::from_millis(500);

/// How long a survivor is given to hear why the run ends.
const FAREWELL: Duration = Duration::from_millis(400);
/// A request that the one before still keeps out is dropped: only a solver that is gone has left that one there, and to wait for its
/// place would be for ever. Whoever waits for the answer finds out.
const NEVER_BLOCK: BackpressureStrategy = BackpressureStrategy::DiscardData;

/// How the coupler waits.
#[derive(Debug, Clone)]
pub struct HostOptions {
    /// The run.
    pub run: RunId,
    /// Deadline for one answer, and for a solver to appear.
    pub timeout: Duration,
    /// How to wait.
    pub wait: Wait,
    /// Process whose end ends the run (the launcher), if there is one.
    pub supervisor: Option<u32>,
}

type OnTick = Box<dyn FnMut() -> Result<(), Failure>>;

/// The run's owner: creates the channels of every solver before the first wait.
pub struct Host {
    shared: Rc<Shared>,
}

struct Shared {
    options: HostOptions,
    listener: Listener,
    heartbeats: Vec<Notifier>,
    /// Solvers that have joined, and must live from then on.
    joined: RefCell<Vec<String>>,
    /// What else is looked after while an answer is waited for.
    look: RefCell<OnTick>,
    domain: Domain,
    // Dropped last: ports, then node, then the run's lock.
    _node: Node,
    ownership: Ownership,
}

impl Host {
    /// Own the run and create the channels of the solvers `names`; returns them in that order.
    pub fn create(options: HostOptions, names: &[&str]) -> Result<(Self, Vec<Remote>), Failure> {
        let (domain, ownership) = Domain::own(&options.run)?;
        check_space(names.len() as u64 * 4 * (FRAME as u64 + 4096))?;
        let node = domain.node("coupler")?;
        let own_wake = channel::create_wake(&node, "coupler")?;
        let listener =
            own_wake.listener_builder().create().map_err(transport("cannot listen for wake-ups"))?;
        let channels: Vec<Channels> =
            names.iter().map(|name| Channels::create(&node, name)).collect::<Result<_, _>>()?;
        let heartbeats =
            channels.iter().map(|c| channel::notifier(&c.wake)).collect::<Result<Vec<_>, _>>()?;
        let shared = Rc::new(Shared {
            options,
            listener,
            heartbeats,
            joined: RefCell::default(),
            look: RefCell::new(Box::new(|| Ok(()))),
            domain,
            _node: node,
            ownership,
        });
        let made = names.iter().zip(channels).enumerate();
        let made = made.map(|(index, (name, channels))| Remote::new(name, index, channels, &shared));
        let remotes = made.collect::<Result<_, _>>()?;
        shared.domain.allocate()?;
        Ok((Self { shared }, remotes))
    }

    /// Give every solver a sign of life: to be called now and then while none of them is asked anything.
    pub fn beat(&self) {
        self.shared.beat();
    }

    /// While an answer is waited for `look` is asked some ten times a second; its failure ends the wait.
    pub fn on_tick(&self, look: impl FnMut() -> Result<(), Failure> + 'static) {
        *self.shared.look.borrow_mut() = Box::new(look);
    }

    /// End the run in shared memory: nothing of it is left. Call after the solvers have ended.
    ///
    /// Panics if a [`Remote`] of the run is still in use.
    pub fn close(self) {
        // Taken apart as a temporary: ports and node go with it, before their files do.
        let Shared { domain, ownership, .. } =
            Rc::into_inner(self.shared).expect("every remote is dropped before the run is closed");
        domain.remove(ownership);
    }
}

impl Shared {
    fn beat(&self) {
        for notifier in &self.heartbeats {
            let _ = notifier.notify_with_custom_event_id(EventId::new(HEARTBEAT));
        }
    }
}

/// A solver in another process.
pub struct Remote {
    name: String,
    index: usize,
    caller: Caller,
    channels: Channels,
    shared: Rc<Shared>,
    client: Option<FieldClient>,
    pending: Option<FieldPending>,
    asked: Request,
    response: Option<FieldResponse>,
    /// Requests sent so far.
    pub sequence: u64,
    sent_at: Instant,
    /// Seconds from sending requests to having their answers.
    pub waited: f64,
}

fn control_client(channels: &Channels, name: &str) -> Result<Option<ControlClient>, Failure> {
    let builder =
        channels.control.client_builder().initial_max_slice_len(FRAME).backpressure_strategy(NEVER_BLOCK);
    builder.create().map(Some).map_err(transport(format!("cannot create the control channel of {name}")))
}

impl Remote {
    fn new(name: &str, index: usize, channels: Channels, shared: &Rc<Shared>) -> Result<Self, Failure> {
        let client = control_client(&channels, name)?;
        let run = shared.options.run.number();
        Ok(Self {
            name: name.into(),
            index,
            caller: Caller { client, solver: name.into(), run },
            channels,
            shared: Rc::clone(shared),
            client: None,
            pending: None,
            asked: Request::default(),
            response: None,
            sequence: 0,
            sent_at: Instant::now(),
            waited: 0.0,
        })
    }

    fn patience<'a>(&'a self, must_live: bool, during: &'a dyn Fn() -> String) -> Patience<'a> {
        Patience {
            domain: &self.shared.domain,
            wait: self.shared.options.wait,
            partner: &self.name,
            must_live,
            during,
            deadline: self.shared.options.timeout,
            supervisor: self.shared.options.supervisor,
        }
    }

    /// The answer to the first message. While there is none the client is made anew, again and again.
    fn connect(&mut self) -> Result<FromSolver, Failure> {
        let (started, timeout) = (Instant::now(), self.shared.options.timeout);
        let mut patience = CONNECT;
        loop {
            match self.call(patience.min(timeout), &ToSolver::Connect, "in the handshake", &mut silent) {
                Err(Failure::Silent { solver, during, .. }) => {
                    let (waited, deadline) = (started.elapsed().as_secs_f64(), timeout.as_secs_f64());
                    if waited > deadline {
                        return Err(Failure::Silent { solver, during, waited, deadline });
                    }
                    tracing::debug!("{solver} has not answered in {waited:.1} s: connecting anew");
                    // A solver that is slow, and not deaf, must come to answer.
                    patience *= 2;
                    // The channel has room for one.
                    self.caller.client = None;
                    self.caller.client = control_client(&self.channels, &self.name)?;
                    self.shared.domain.allocate()?;
                }
                other => return other,
            }
        }
    }

    /// Send a message, pass on the progress that comes, return the message that ends it.
    fn call(
        &self,
        deadline: Duration,
        message: &ToSolver,
        during: &str,
        progress: OnProgress,
    ) -> Result<FromSolver, Failure> {
        let words = || during.to_string();
        let mut wait = |poll: &mut super::control::PollFrame| {
            self.channels_ring();
            let patience = Patience { deadline, ..self.patience(true, &words) };
            patience.until(&self.shared.listener, poll, || self.tick())
        };
        let (mut answer, mut more) = self.caller.call(message, &mut wait)?;
        while more {
            if let FromSolver::Progress(p) = answer {
                progress(p).map_err(|fault| Failure::Fault { solver: self.name.clone(), fault })?;
            }
            if interrupt::requested() {
                return Err(Failure::Interrupted);
            }
            (answer, more) = self.caller.next(&mut wait)?;
        }
        match answer {
            FromSolver::Fault(fault) if !matches!(message, ToSolver::Explain) => {
                Err(Failure::Fault { solver: self.name.clone(), fault })
            }
            other => Ok(other),
        }
    }

    /// Give every solver a sign of life, and see that the others still live.
    fn tick(&self) -> Result<(), Failure> {
        self.shared.beat();
        (self.shared.look.borrow_mut())()?;
        let joined = self.shared.joined.borrow();
        match joined.iter().find(|name| **name != self.name && !self.shared.domain.is_alive(name)) {
            Some(solver) => {
                let during = format!("while {} was at work", self.name);
                Err(Failure::Lost { solver: solver.clone(), during })
            }
            None => Ok(()),
        }
    }

    fn channels_ring(&self) {
        let _ = self.shared.heartbeats[self.index].notify();
    }

    /// An answer of another kind than the message asks for.
    fn unexpected(&self, asked: &ToSolver, got: &FromSolver) -> Failure {
        let (asked, got) = (format!("{asked:?}"), format!("{got:?}"));
        let [asked, got] = [&asked, &got].map(|text| text.split([' ', '(']).next().unwrap_or_default());
        Failure::breach(&self.name, clause::JOINS, format!("answered {asked} with {got}"))
    }

    /// Send it the reason why the run ends before its time. It is given a moment to hear it, no more.
    pub fn abort(&mut self, reason: &str) {
        self.pending = None;
        self.response = None;
        if !self.shared.domain.is_alive(&self.name) {
            return;
        }
        let until = Instant::now() + FAREWELL;
        let mut wait = |poll: &mut super::control::PollFrame| {
            self.channels_ring();
            loop {
                if let Some(answer) = poll()? {
                    return Ok(answer);
                }
                if Instant::now() > until {
                    return Err(Failure::Interrupted);
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        };
        let _ = self.caller.call(&ToSolver::Abort { reason: reason.into() }, &mut wait);
    }

    /// Wait until its process has left the run, but not for long.
    pub fn wait_gone(&self) {
        let until = Instant::now() + FAREWELL;
        while self.shared.domain.is_alive(&self.name) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

fn silent(_: crate::message::Progress) -> Result<(), Fault> {
    Ok(())
}

/// What an answer of the kind that the message asks for holds; one of another kind ends the function.
macro_rules! held {
    ($remote:ident, $asked:expr, $answer:expr, $kind:pat => $held:expr) => {
        match $answer {
            $kind => $held,
            other => return Err($remote.unexpected(&$asked, &other)),
        }
    };
}

/// What the answer to a message holds.
macro_rules! ask {
    ($remote:ident, $message:expr, $during:expr, $progress:expr, $kind:pat => $held:expr) => {{
        let message = $message;
        let answer = $remote.call($remote.shared.options.timeout, &message, $during, $progress)?;
        held!($remote, message, answer, $kind => $held)
    }};
}

impl Participant for Remote {
    fn name(&self) -> &str {
        &self.name
    }

    fn hello(&mut self) -> Result<Hello, Failure> {
        let during = || "at the start of the run: it has not joined".to_string();
        let there = || Ok((self.channels.control.dynamic_config().number_of_servers() > 0).then_some(()));
        self.patience(false, &during).until(&self.shared.listener, there, || self.tick())?;
        let hello = held!(self, ToSolver::Connect, self.connect()?, FromSolver::Hello(hello) => hello);
        self.shared.joined.borrow_mut().push(self.name.clone());
        Ok(hello)
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Failure> {
        let message = ToSolver::Prepare(plan.clone());
        let ready = ask!(self, message, "while preparing", progress, FromSolver::Ready(ready) => ready);
        let breaks = |what| Failure::breach(&self.name, clause::MESH, format!("its interface mesh: {what}"));
        ready.mesh.check().map_err(breaks)?;
        // Double the payload: iceoryx2 keeps one more chunk than is on loan.
        let longest = payload_lengths(plan, &ready).0 + ready.mesh.node_count();
        check_space(2 * 8 * longest as u64)?;
        let client = self
            .channels
            .field
            .client_builder()
            .initial_max_slice_len(longest.max(1))
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .backpressure_strategy(NEVER_BLOCK)
            .create()
            .map_err(transport(format!("cannot create the field channel of {}", self.name)))?;
        self.client = Some(client);
        self.shared.domain.allocate()?;
        Ok(ready)
    }

    fn send(&mut self, request: Request, fill: Fill) -> Result<(), Failure> {
        self.response = None;
        self.sequence += 1;
        // Answers that come at once leave the wait no time to look after the launcher: look here, too.
        if self.sequence.is_multiple_of(LOOK_AFTER)
            && let Some(pid) = self.shared.options.supervisor
            && wait::is_orphan(pid)
        {
            return Err(wait::launcher_lost(format!("before exchange {}", self.sequence)));
        }
        let header = RequestHeader { run: self.caller.run, sequence: self.sequence, ..request.header };
        self.asked = Request { header, ..request };
        // Words are put together only where they are needed: the field path allocates nothing.
        let failed = || format!("cannot send a window to {}", self.name);
        let client = self.client.as_ref().expect("prepared before the first window");
        let mut sample = client.loan_slice_uninit(request.sends).map_err(|e| transport(failed())(e))?;
        *sample.user_header_mut() = header;
        // SAFETY: the chunk is mapped shared memory, so its bytes are initialised (zero, or an
        // earlier payload), and every bit pattern is an f64.
        fill(unsafe { sample.payload_mut().assume_init_mut() });
        // SAFETY: as above.
        let sample = unsafe { sample.assume_init() };
        self.sent_at = Instant::now();
        self.pending = Some(sample.send().map_err(|e| transport(failed())(e))?);
        self.channels_ring();
        Ok(())
    }

    fn receive(&mut self) -> Result<Status, Failure> {
        let pending = self.pending.take().expect("receive follows send");
        let Request { header: asked, expects, .. } = self.asked;
        let failed = || format!("cannot read the answer of {}", self.name);
        let during = || {
            format!(
                "in window {} at t = {} s, iteration {}, exchange {}",
                asked.window, asked.start, asked.iteration, asked.sequence
            )
        };
        let poll = || pending.receive().map_err(|e| transport(failed())(e));
        let response = self.patience(true, &during).until(&self.shared.listener, poll, || self.tick())?;
        self.waited += self.sent_at.elapsed().as_secs_f64();
        let header = *response.user_header();
        if let Some(what) = header.mismatch(&asked) {
            return Err(Failure::breach(&self.name, clause::HEADER, what));
        }
        let status = Status::from_number(header.status).expect("compared with the request");
        let got = response.payload().len();
        let listed = header.listed as usize;
        let expected = expects.map_or(got, |fields| fields + listed);
        if matches!(status, Status::Done | Status::Rest) && (got != expected || got < listed) {
            let what = format!("its answer has {got} numbers, its fields and gauges make {expected}");
            return Err(Failure::breach(
                &self.name,
                clause::NUMBERS,
                format!("window {}: {what}", asked.window),
            ));
        }
        self.response = Some(response);
        Ok(status)
    }

    fn answer(&self) -> &[f64] {
        self.response.as_ref().expect("received before it is read").payload()
    }

    fn listed(&self) -> usize {
        self.response.as_ref().map_or(0, |response| response.user_header().listed as usize)
    }

    fn explain(&mut self) -> Result<Fault, Failure> {
        self.response = None;
        let during = "when asked why a window failed";
        Ok(ask!(self, ToSolver::Explain, during, &mut silent, FromSolver::Fault(fault) => fault))
    }

    fn finish(&mut self, commit: bool) -> Result<Statistics, Failure> {
        self.response = None;
        // From here on it may go.
        self.shared.joined.borrow_mut().retain(|name| *name != self.name);
        let (message, during) = (ToSolver::Finish { commit }, "at the end of the run");
        Ok(ask!(self, message, during, &mut silent, FromSolver::Statistics(statistics) => statistics))
    }

    fn save(&mut self, commit: bool) -> Result<Vec<u8>, Failure> {
        self.response = None;
        let (message, during) = (ToSolver::Save { commit }, "while its state was kept");
        Ok(ask!(self, message, during, &mut silent, FromSolver::Saved { state } => state))
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Failure> {
        let message = ToSolver::Resume { state: state.to_vec() };
        let during = "as it was to go on from a state that was kept";
        ask!(self, message, during, &mut silent, FromSolver::Resumed => Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ipc::channel::Bell;
    use crate::ipc::control::Listener as ControlListener;

    /// A process is counted as a server, is not scheduled for a moment, and only then can a client find it: the request that was
    /// sent meanwhile reaches nobody.
    #[test]
    fn a_message_that_reached_nobody_reaches_the_server_that_comes() {
        let run = RunId::new();
        let timeout = Duration::from_secs(20);
        let options = HostOptions { run: run.clone(), timeout, wait: Wait::Event, supervisor: None };
        let (host, remotes) = Host::create(options, &["fem"]).expect("created");
        let (joined, has_joined) = std::sync::mpsc::channel();
        let (called, was_called) = std::sync::mpsc::channel::<()>();
        let number = run.number();
        let solver = std::thread::spawn(move || {
            let node = Domain::find(&run)?.expect("owned").node("fem")?;
            let channels = Channels::open(&node, "fem", timeout)?;
            joined.send(()).expect("heard");
            was_called.recv().expect("called");
            let server = channels.control.server_builder().initial_max_slice_len(FRAME).create();
            let mut control = ControlListener::new(server.map_err(transport("a server"))?, number);
            while control.poll(&|| ())?.is_none() {
                std::thread::sleep(Duration::from_millis(1));
            }
            control.send(&FromSolver::Resumed, false, &|| ())?;
            while !control.is_fetched() {
                std::thread::sleep(Duration::from_millis(1));
            }
            Ok::<_, Failure>(())
        });
        has_joined.recv().expect("joined");
        let until = Instant::now() + timeout;
        let mut looks = 0;
        let answer = remotes[0].caller.call(&ToSolver::Connect, &mut |poll| {
            loop {
                if let Some(answer) = poll()? {
                    return Ok(answer);
                }
                // Sent, and looked for in vain.
                looks += 1;
                if looks == 1 {
                    called.send(()).expect("heard");
                }
                if Instant::now() > until {
                    return Err(Failure::Interrupted);
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        drop(remotes);
        if answer.is_ok() {
            solver.join().expect("joined").expect("answered");
            host.close();
        }
        assert_eq!(answer, Ok((FromSolver::Resumed, false)));
    }

    /// A solver that never sees the requests of the first client, as one whose first connection failed.
    fn answer_the_second_client(run: &RunId) -> Result<(), Failure> {
        let domain = Domain::find(run)?.expect("owned");
        let node = domain.node("fem")?;
        let channels = Channels::open(&node, "fem", Duration::from_secs(5))?;
        let bell = Bell::new(&channels.wake, &channel::open_wake(&node, "coupler", Duration::from_secs(5))?)?;
        let server = channels.control.server_builder().initial_max_slice_len(FRAME).create();
        let server = server.map_err(transport("a server"))?;
        let unseen = loop {
            match server.receive().map_err(transport("a request"))? {
                Some(request) => break request,
                None => std::thread::sleep(Duration::from_millis(1)),
            }
        };
        while unseen.is_connected() {
            std::thread::sleep(Duration::from_millis(1));
        }
        drop(unseen);
        let mut control = ControlListener::new(server, run.number());
        while control.poll(&|| bell.ring())?.is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        let hello = Hello { program: "deaf at first".into(), ..Hello::default() };
        control.send(&FromSolver::Hello(hello), false, &|| bell.ring())?;
        while !control.is_fetched() {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }

    /// In a thread of its own: a wait without limit fails the test, and does not hold it up.
    #[test]
    fn a_solver_that_missed_the_first_client_answers_the_next() {
        let timeout = Duration::from_secs(20);
        let (say, said) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let run = RunId::new();
            let options = HostOptions { run: run.clone(), timeout, wait: Wait::Event, supervisor: None };
            let (host, mut remotes) = Host::create(options, &["fem"]).expect("created");
            let solver = std::thread::spawn(move || answer_the_second_client(&run));
            let hello = remotes[0].hello();
            drop(remotes);
            solver.join().expect("joined").expect("answered");
            host.close();
            say.send(hello.expect("an answer").program).expect("somebody waits");
        });
        assert_eq!(said.recv_timeout(3 * timeout).as_deref(), Ok("deaf at first"));
    }
}
