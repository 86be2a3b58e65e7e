//! The solver's side: wait for requests, answer them, leave when the run is over.

use super::channel::{self, Bell, Channels, FieldRequest, FieldServer};
use super::control::{FRAME, Listener, broken};
use super::domain::Domain;
use super::memory::check_space;
use super::run_id::RunId;
use super::wait::{Patience, TIMEOUT, Wait, absent, is_orphan};
use super::{interrupt, transport};
use crate::exchange::{self, Exchange};
use crate::header::{AnswerHeader, Status};
use crate::message::{Fault, FromSolver, Plan, Ready, Statistics, ToSolver};
use crate::participant::{Failure, payload_lengths};
use crate::selection::Selected;
use crate::solver::Solver;
use iceoryx2::prelude::AllocationStrategy;
use std::cell::RefCell;
use std::ffi::OsString;
use std::time::{Duration, Instant};

/// How a solver joins a run: what `serve SCENE --run ID --as NAME ...` says.
#[derive(Debug, Clone)]
pub struct Connection {
    /// The run (`--run`).
    pub run: RunId,
    /// Its name in the run (`--as`): `dem` or `fem`.
    pub name: String,
    /// Longest time without a sign of life from the coupler (`--timeout`, seconds).
    pub timeout: Duration,
    /// How to wait (`--wait`).
    pub wait: Wait,
    /// Process whose end ends the run (`--supervisor`).
    pub supervisor: Option<u32>,
}

impl Connection {
    /// What the coupler, the launcher and `run.sh` append to a solver's command line; other
    /// arguments are passed over.
    pub fn from_args<A: Into<OsString>>(args: impl Iterator<Item = A>) -> Result<Self, String> {
        // A path that is no text belongs to an option that is passed over here.
        let mut args = args.map(|arg| arg.into().to_string_lossy().into_owned());
        let mut connection = Self {
            run: RunId::new(),
            name: String::new(),
            timeout: Duration::from_secs_f64(TIMEOUT),
            wait: Wait::default(),
            supervisor: None,
        };
        let mut run = None;
        while let Some(key) = args.next() {
            let mut value = || args.next().ok_or(format!("{key} needs a value"));
            match key.as_str() {
                "--run" => run = Some(value()?.parse()?),
                "--as" => connection.name = value()?,
                "--wait" => connection.wait = value()?.parse()?,
                "--timeout" => {
                    let seconds: f64 = value()?.parse().map_err(|e| format!("--timeout: {e}"))?;
                    connection.timeout =
                        Duration::try_from_secs_f64(seconds).map_err(|e| format!("--timeout: {e}"))?;
                }
                "--supervisor" => {
                    connection.supervisor = Some(value()?.parse().map_err(|e| format!("--supervisor: {e}"))?);
                }
                _ => {}
            }
        }
        connection.run = run.ok_or("which run? give --run ID")?;
        if connection.name.is_empty() {
            return Err("which part in the run? give --as dem or --as fem".into());
        }
        Ok(connection)
    }
}

/// Take part in a run until the coupler ends it.
///
/// Returns `Ok` when the run is done, and else the failure that ended it. Processor time and memory
/// of this process are added to the solver's statistics where it does not report them.
pub fn serve(solver: &mut dyn Solver, connection: &Connection) -> Result<(), Failure> {
    join(connection, |session| session.run(solver))
}

/// Join a run only to say that this solver cannot take part (its input is bad, say): the coupler then
/// ends the run with that message instead of waiting for a solver that never comes.
pub fn refuse(fault: &Fault, connection: &Connection) -> Result<(), Failure> {
    join(connection, |session| session.refuse(fault))
}

pub(super) fn join(
    connection: &Connection,
    work: impl FnOnce(&mut Session) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let domain = wait_for_coupler(connection)?;
    watch(&domain, connection);
    let node = domain.node(&connection.name)?;
    let channels = Channels::open(&node, &connection.name, connection.timeout)?;
    let coupler_wake = channel::open_wake(&node, "coupler", connection.timeout)?;
    let bell = Bell::new(&channels.wake, &coupler_wake)?;
    let control = channels
        .control
        .server_builder()
        .initial_max_slice_len(FRAME)
        .max_loaned_responses_per_request(1)
        .create()
        .map_err(transport("cannot create the control channel"))?;
    domain.allocate()?;
    bell.ring();
    let mut session = Session {
        connection,
        domain: &domain,
        control: RefCell::new(Listener::new(control, connection.run.number())),
        bell,
        channels: &channels,
        field: None,
        exchange: Exchange::default(),
        fault: None,
        solving: Duration::ZERO,
        selected: None,
    };
    work(&mut session)
}

/// From now on this process ends with its run, whatever it is at work on: a solver that computes for
/// minutes looks at nothing else meanwhile. One that waits notices by itself, sooner, and ends in order.
fn watch(domain: &Domain, connection: &Connection) {
    let (domain, supervisor) = (domain.clone(), connection.supervisor);
    let must_end = move || {
        if supervisor.is_some_and(is_orphan) {
            Some("the launcher was lost")
        } else if !domain.is_owned() {
            Some("the coupler was lost")
        } else {
            interrupt::requested().then_some("interrupted")
        }
    };
    interrupt::watch(LAST_WORDS, must_end, |why| {
        eprintln!("error: {why} while this solver was at work");
        std::process::exit(1);
    });
}

/// What it is given to end by itself.
const LAST_WORDS: Duration = Duration::from_millis(400);

fn wait_for_coupler(connection: &Connection) -> Result<Domain, Failure> {
    let started = Instant::now();
    let mut said = 0;
    loop {
        if let Some(domain) = Domain::find(&connection.run)? {
            return Ok(domain);
        }
        let waited = started.elapsed();
        if interrupt::requested() {
            return Err(Failure::Interrupted);
        }
        if waited > connection.timeout {
            return Err(absent("the coupler", waited, connection.timeout));
        }
        if waited.as_secs() / 2 > said {
            said = waited.as_secs() / 2;
            let (waited, timeout) = (waited.as_secs(), connection.timeout.as_secs());
            tracing::info!("waiting for the coupler: {waited} s of {timeout} s");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

pub(super) enum Work {
    Message(ToSolver),
    Window(FieldRequest),
}

pub(super) struct Session<'a> {
    connection: &'a Connection,
    domain: &'a Domain,
    pub control: RefCell<Listener>,
    pub bell: Bell,
    channels: &'a Channels,
    field: Option<FieldServer>,
    exchange: Exchange,
    fault: Option<Fault>,
    solving: Duration,
    /// What was selected when the state was kept from which the solver is to go on.
    selected: Option<Selected>,
}

impl Session<'_> {
    fn run(&mut self, solver: &mut dyn Solver) -> Result<(), Failure> {
        loop {
            match self.wait(|| Ok(()))? {
                Work::Window(request) => self.window(solver, &request)?,
                Work::Message(ToSolver::Connect) => self.send(&FromSolver::Hello(solver.hello()))?,
                Work::Message(ToSolver::Prepare(plan)) => self.prepare(solver, &plan)?,
                Work::Message(ToSolver::Explain) => {
                    let fault = self.fault.take().unwrap_or_else(exchange::no_reason);
                    self.send(&FromSolver::Fault(fault))?;
                }
                Work::Message(ToSolver::Save { commit }) => {
                    let _span = crate::profile!("save");
                    self.answer(self.exchange.save(solver, commit), |state| FromSolver::Saved { state })?;
                }
                Work::Message(ToSolver::Resume { state }) => {
                    let resumed = exchange::resume(solver, &state).map(|selected| self.selected = selected);
                    self.answer(resumed, |()| FromSolver::Resumed)?;
                }
                Work::Message(ToSolver::Finish { commit }) => {
                    let _span = crate::profile!("finish");
                    let committed = if commit { solver.commit() } else { Ok(()) };
                    let solving = self.solving.as_secs_f64();
                    self.answer(committed.and_then(|()| solver.finish()), |statistics| {
                        FromSolver::Statistics(with_cost(statistics, solving))
                    })?;
                    return self.linger();
                }
                Work::Message(ToSolver::Abort { reason }) => {
                    let _ = self.send(&FromSolver::Statistics(Statistics::default()));
                    return Err(Failure::Aborted(reason));
                }
            }
        }
    }

    fn refuse(&mut self, fault: &Fault) -> Result<(), Failure> {
        loop {
            if let Work::Message(_) = self.wait(|| Ok(()))? {
                self.send(&FromSolver::Fault(fault.clone()))?;
                return self.linger();
            }
        }
    }

    /// Wait for a message or a window. Windows are looked for first: they are the many. A failure of `on_tick` ends the wait.
    pub fn wait(&self, on_tick: impl FnMut() -> Result<(), Failure>) -> Result<Work, Failure> {
        let during = || "while waiting for its next request".to_string();
        let patience = Patience {
            domain: self.domain,
            wait: self.connection.wait,
            partner: "coupler",
            must_live: true,
            during: &during,
            deadline: self.connection.timeout,
            supervisor: self.connection.supervisor,
        };
        let poll = || {
            if let Some(server) = &self.field
                && let Some(request) = server.receive().map_err(transport("cannot read a window"))?
            {
                return Ok(Some(Work::Window(request)));
            }
            let message = self.control.borrow_mut().poll(&|| self.bell.ring())?;
            Ok(message.map(Work::Message))
        };
        patience.until(&self.bell.listener, poll, on_tick)
    }

    /// What was asked for, as `message` of it, or why it could not be done.
    fn answer<T>(
        &self,
        asked: Result<T, Fault>,
        message: impl FnOnce(T) -> FromSolver,
    ) -> Result<(), Failure> {
        self.send(&asked.map_or_else(FromSolver::Fault, message))
    }

    pub fn send(&self, message: &FromSolver) -> Result<(), Failure> {
        self.control.borrow_mut().send(message, false, &|| self.bell.ring())
    }

    fn prepare(&mut self, solver: &mut dyn Solver, plan: &Plan) -> Result<(), Failure> {
        let mut aborted = None;
        let mut report = |progress| {
            if interrupt::requested() {
                return Err(Fault::interrupted());
            }
            let mut control = self.control.borrow_mut();
            let lost = |e: Failure| Fault::broken(e.to_string());
            // A report that nobody waits for yet is passed over; the next one follows soon.
            if let Some(ToSolver::Abort { reason }) = control.poll(&|| self.bell.ring()).map_err(lost)? {
                aborted = Some(reason);
                return Err(Fault::broken("the run ends before its time"));
            }
            if control.is_asked() {
                control.send(&FromSolver::Progress(progress), true, &|| self.bell.ring()).map_err(lost)?;
            }
            Ok(())
        };
        let _span = crate::profile!("prepare");
        let outcome = solver.prepare(plan, &mut report);
        if let Some(reason) = aborted {
            self.send(&FromSolver::Statistics(Statistics::default()))?;
            return Err(Failure::Aborted(reason));
        }
        let outcome = outcome.and_then(|ready| {
            self.exchange = Exchange::new(plan, &ready);
            if let Some(selected) = self.selected.take() {
                self.exchange.select_again(solver, selected)?;
            }
            // The coupler is given the reason: it would wait for a process that is lost.
            self.offer(plan, &ready).map_err(|failure| Fault::broken(failure.to_string()))?;
            Ok(ready)
        });
        self.answer(outcome, FromSolver::Ready)
    }

    /// Create the channel of windows.
    pub fn offer(&mut self, plan: &Plan, ready: &Ready) -> Result<(), Failure> {
        // An answer may list all nodes, and that of a selection pairs: growth is allowed for.
        let longest = payload_lengths(plan, ready).1 + ready.mesh.node_count();
        check_space(2 * 8 * longest as u64)?;
        let server = self
            .channels
            .field
            .server_builder()
            .initial_max_slice_len(longest.max(1))
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .max_loaned_responses_per_request(1)
            .create()
            .map_err(transport("cannot create the field channel"))?;
        self.field = Some(server);
        self.domain.allocate()
    }

    fn window(&mut self, solver: &mut dyn Solver, request: &FieldRequest) -> Result<(), Failure> {
        let started = Instant::now();
        let header = *request.user_header();
        let _span = crate::profile!("answer", window = header.window, iteration = header.iteration);
        let run = self.connection.run.number();
        if header.run != run {
            return Err(broken(format!("asked run {:016x}, this is run {run:016x}", header.run)));
        }
        let input = request.payload();
        // What cannot be done is answered with a number that means nothing.
        let begun = self.exchange.begin(solver, &header, input);
        let length = begun.as_ref().map_or(1, |length| *length);
        let failed = "cannot answer a window";
        let mut response = request.loan_slice_uninit(length).map_err(transport(failed))?;
        // SAFETY: the chunk is mapped shared memory, so its bytes are initialised (zero, or an
        // earlier payload), and every bit pattern is an f64.
        let output = unsafe { response.payload_mut().assume_init_mut() };
        let outcome = begun.and_then(|_| self.exchange.write(solver, &header, input, output));
        let status = outcome.as_ref().map_or_else(exchange::status_of, |_| Status::of(solver));
        let listed = *outcome.as_ref().unwrap_or(&0);
        self.fault = outcome.err();
        // Before the answer goes: what follows is exchange.
        self.solving += started.elapsed();
        *response.user_header_mut() = AnswerHeader { listed, ..AnswerHeader::echo(&header, status) };
        // SAFETY: as above.
        unsafe { response.assume_init() }.send().map_err(transport(failed))?;
        self.bell.ring();
        Ok(())
    }

    /// The last message must not die with this process: stay until the coupler has fetched it.
    pub fn linger(&self) -> Result<(), Failure> {
        let until = Instant::now() + Duration::from_secs(1);
        while !self.control.borrow().is_sent() && Instant::now() < until {
            self.control.borrow_mut().poll(&|| self.bell.ring())?;
            std::thread::sleep(Duration::from_millis(1));
        }
        while !self.control.borrow().is_fetched() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }
}

/// `statistics` with what this process has spent, `solving` [s] of it inside the solver, where they do not say.
pub fn with_cost(mut statistics: Statistics, solving: f64) -> Statistics {
    if statistics.cpu_seconds <= 0.0 {
        statistics.cpu_seconds = cpu_seconds();
    }
    if statistics.solve_seconds == 0.0 {
        statistics.solve_seconds = solving;
    }
    if statistics.peak_memory == 0 {
        statistics.peak_memory = peak_memory();
    }
    statistics
}

/// Processor time of this process [s].
pub fn cpu_seconds() -> f64 {
    let cpu = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    cpu.tv_sec as f64 + cpu.tv_nsec as f64 * 1e-9
}

/// Largest resident memory of this process [bytes]; 0 if the system does not know.
pub fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches(" kB").trim().parse::<u64>().ok()).map_or(0, |kb| kb * 1024)
}
