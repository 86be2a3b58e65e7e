//! `rockfall bridge`: a solver that is elsewhere takes part in a run, over TCP.

use crate::front::stop::Stop;
use crate::run::children;
use clap::Args;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc::{self, Connection, interrupt, link::LONGEST_TOKEN};
use interface_defs::{Failure, RunId};
use rustix::process::{Pid, Signal, kill_process_group};
use std::cell::RefCell;
use std::ffi::OsString;
use std::net::{TcpListener, ToSocketAddrs};
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::rc::Rc;
use std::time::{Duration, Instant};
use toolkit::exit::Exit;
use toolkit::files::{self, Dir, Scratch};
use toolkit::input_file;
use toolkit::program::seconds;

/// Shortest token [bytes]: a shorter one can be guessed.
const SHORTEST_TOKEN: usize = 16;

/// What the solver is given to end by itself when the run is over.
const SOLVER_GRACE: Duration = Duration::from_secs(2);

/// What the command line asks for.
#[derive(Debug, Args)]
pub struct BridgeArguments {
    /// Beside the run: wait here in the solver's place. An address that other machines reach takes a token
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "connect", required_unless_present = "connect")]
    listen: Option<String>,
    /// On the other side: connect to the bridge that waits there, and start COMMAND as its solver
    #[arg(long, value_name = "HOST:PORT")]
    connect: Option<String>,
    /// File with 16 to 1024 characters that both sides must know
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Directory in which the solver that --connect starts writes [default: one that is removed at the end]
    #[arg(long, value_name = "DIR", requires = "connect")]
    out: Option<PathBuf>,
    /// Seconds for which --connect tries until a bridge waits there
    #[arg(long, value_name = "S", default_value_t = ipc::TIMEOUT, value_parser = seconds)]
    timeout: f64,
    /// Of --connect, behind `--`: the solver and its arguments. Of --listen: serve SCENE --run ID --as NAME ..., which a run adds
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true, value_name = "COMMAND")]
    words: Vec<OsString>,
}

/// One end of a bridge.
pub fn bridge(request: &BridgeArguments) -> Result<Exit, Stop> {
    interrupt::install();
    let token = token(request)?;
    match (&request.listen, &request.connect) {
        (Some(at), _) => listen(at, &token, request),
        (None, to) => connect(to.as_deref().unwrap_or_default(), &token, request),
    }
}

/// What the file of the token holds; none without one.
fn token(request: &BridgeArguments) -> Result<Vec<u8>, Stop> {
    let Some(file) = &request.token_file else { return Ok(Vec::new()) };
    let bytes = input_file::read(file, 2 * LONGEST_TOKEN as u64)?;
    let token = bytes.trim_ascii();
    if (SHORTEST_TOKEN..=LONGEST_TOKEN).contains(&token.len()) {
        return Ok(token.to_vec());
    }
    let what = format!("a token of {} bytes; it must have {SHORTEST_TOKEN} to {LONGEST_TOKEN}", token.len());
    let cure = format!("openssl rand -hex 32 > {}", file.display());
    Err(Diagnostic::in_file(file.display(), what).try_instead(cure).into())
}

fn stop(failure: Failure) -> Stop {
    let exit = if failure.is_input() { Exit::BadInput } else { Exit::Failed };
    Stop { exit, errors: vec![Diagnostic::from(&failure)] }
}

/// Before anything was started.
fn unstarted(failure: Failure) -> Stop {
    let exit = if failure == Failure::Interrupted { Exit::Failed } else { Exit::BadInput };
    Stop { exit, ..stop(failure) }
}

/// In the place of a solver.
fn listen(at: &str, token: &[u8], request: &BridgeArguments) -> Result<Exit, Stop> {
    let refuse = |what: String, cure: &str| {
        let what = format!("--listen {at}: {what}");
        Stop::from(Diagnostic::error(code::ARGUMENT, what).try_instead(cure))
    };
    let [serve, scene, ..] = &request.words[..] else {
        return Err(refuse("the run is missing".into(), "serve SCENE --run ID --as fem, as a run adds it"));
    };
    if serve != "serve" {
        let cure = "rockfall bridge --listen ADDRESS as a command in [processes] of a scene; a solver is started by --connect";
        return Err(refuse(format!("the command {} is none of it", serve.display()), cure));
    }
    let connection = Connection::from_args(request.words.iter());
    let connection = connection.map_err(|what| refuse(what, "see rockfall help bridge"))?;
    let form = "write an address of this machine and a port that is free, as in 127.0.0.1:4711";
    let addresses: Vec<_> = at.to_socket_addrs().map_err(|e| refuse(e.to_string(), form))?.collect();
    if token.is_empty() && !addresses.iter().all(|address| address.ip().is_loopback()) {
        let what =
            "other machines reach this address, and there is no token: whoever connects would be the solver";
        let cure = "give both sides the same --token-file FILE (openssl rand -hex 32 > FILE), or listen at 127.0.0.1";
        return Err(refuse(what.into(), cure));
    }
    let listener = TcpListener::bind(&addresses[..]).map_err(|e| refuse(e.to_string(), form))?;
    listener.set_nonblocking(true).map_err(|e| refuse(e.to_string(), form))?;
    let scene = String::from_utf8_lossy(&input_file::read(scene.as_ref(), files::TEXT)?).into_owned();
    let no_shortcuts = request.words.iter().any(|word| word == "--no-shortcuts");
    ipc::bridge::listen(listener, token, &connection, (scene, no_shortcuts)).map_err(stop)?;
    Ok(Exit::Done)
}

/// In the place of the coupler.
fn connect(to: &str, token: &[u8], request: &BridgeArguments) -> Result<Exit, Stop> {
    let timeout = Duration::from_secs_f64(request.timeout);
    let (mut link, invitation) = ipc::bridge::connect(to, token, timeout).map_err(unstarted)?;
    let unwritten = |e| Stop::failed(code::NOT_WRITTEN, format!("a directory for the solver: {e}"));
    let dir = tempfile::tempdir().map_err(unwritten)?;
    let scene = Scratch::new(dir.path(), "toml", invitation.scene.as_bytes()).map_err(unwritten)?;
    let out = request.out.as_deref().map_or(Ok(dir.path().into()), std::path::absolute).map_err(unwritten)?;
    Dir::create(&out).map_err(unwritten)?;
    let run = RunId::new();
    let mut command = Command::new(&request.words[0]);
    command.args(&request.words[1..]).arg("serve").arg(scene.path());
    command.args(["--run", run.as_str(), "--as", &invitation.name]).arg("--out").arg(&out);
    command.args(["--timeout", &invitation.timeout.to_string()]);
    command.args(["--supervisor", &std::process::id().to_string()]);
    if invitation.no_shortcuts {
        command.arg("--no-shortcuts");
    }
    let started = command.process_group(0).stdin(Stdio::null()).spawn();
    let program = request.words[0].display().to_string();
    let child = started.map_err(|e| {
        let what = format!("{program} cannot be started: {e}");
        link.end(&what);
        Stop::input(code::PROCESS, what)
    })?;
    tracing::info!("{program} is process {}, the {} of a run at {to}", child.id(), invitation.name);
    let solver = Rc::new(RefCell::new(Solver(child)));
    let watched = Rc::clone(&solver);
    let ended =
        ipc::bridge::lead(link, &invitation.name, run, move || match watched.borrow_mut().0.try_wait() {
            Ok(Some(status)) => Err(Failure::Transport(format!(
                "{program} ended before the run was over: {}; see what it printed",
                children::how(status)
            ))),
            _ => Ok(()),
        });
    let until = Instant::now() + SOLVER_GRACE;
    while Instant::now() < until && matches!(solver.borrow_mut().0.try_wait(), Ok(None)) {
        std::thread::sleep(Duration::from_millis(10));
    }
    ended.map_err(stop)?;
    Ok(Exit::Done)
}

/// The solver, with all that it has started: none of it outlives this value.
struct Solver(Child);

impl Drop for Solver {
    fn drop(&mut self) {
        let _ = kill_process_group(Pid::from_child(&self.0), Signal::KILL);
        let _ = self.0.wait();
    }
}
