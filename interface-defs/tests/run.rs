//! A whole run over shared memory: this program is the coupler, the solver and whoever starts both.

use interface_defs::ipc::remote::HostOptions;
use interface_defs::ipc::{Connection, Host, RunId, Wait};
use interface_defs::participant::{Failure, Participant, Request};
use interface_defs::solver::OnProgress;
use interface_defs::{
    Fault, FieldSpec, Hello, InterfaceMesh, Layout, Plan, Ready, RequestHeader, Sampling, Solver, Statistics,
    Status, Window, name, serve,
};
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output};
use std::time::Duration;

/// Says which of the three this process is.
const ROLE: &str = "ROCKFALL_TEST_ROLE";
/// The id of the run, for the solver.
const RUN: &str = "ROCKFALL_TEST_RUN";
/// Nodes of the interface: 480 kB in each direction.
const NODES: usize = 20_000;

/// Answers with what it was sent.
struct Mirror;

impl Solver for Mirror {
    fn hello(&self) -> Hello {
        Hello { program: "mirror".into(), ..Hello::default() }
    }
    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mesh = InterfaceMesh { coordinates: vec![0.0; 3 * NODES], ..Default::default() };
        let initial = vec![0.0; Layout::new(&plan.gives, &mesh, 0).len()];
        Ok(Ready { mesh, initial, ..Default::default() })
    }
    fn solve(&mut self, _: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        output.copy_from_slice(input);
        Ok(())
    }
    fn commit(&mut self) -> Result<(), Fault> {
        Ok(())
    }
    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(Statistics::default())
    }
}

/// This program again, as something else.
fn role(role: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("a program"));
    command.args(["--exact", "a_run_over_shared_memory", "--nocapture"]).env(ROLE, role);
    command
}

fn solve(run: RunId) -> Result<(), Failure> {
    let (timeout, wait) = (Duration::from_secs(20), Wait::Auto);
    serve(&mut Mirror, &Connection { run, name: "fem".into(), timeout, wait, supervisor: None })
}

fn couple() -> Result<(), Failure> {
    let run = RunId::new();
    let mut solver = role("solver").env(RUN, run.as_str()).spawn().expect("started");
    let options = HostOptions { run, timeout: Duration::from_secs(20), wait: Wait::Auto, supervisor: None };
    let outcome = Host::create(options, &["fem"]).and_then(|(host, mut remotes)| {
        let outcome = exchange(&mut remotes[0]);
        if let Err(failure) = &outcome {
            remotes[0].abort(&failure.to_string());
        }
        drop(remotes);
        let _ = solver.wait();
        host.close();
        outcome
    });
    let _ = solver.kill();
    let _ = solver.wait();
    outcome
}

fn exchange(fem: &mut impl Participant) -> Result<(), Failure> {
    let nodal = |name| vec![FieldSpec::nodal(name, 3, Sampling::AtEnds)];
    let plan = Plan {
        end_time: 1.0,
        window: 0.1,
        takes: nodal(name::FORCE),
        gives: nodal(name::VELOCITY),
        ..Plan::default()
    };
    fem.hello()?;
    fem.prepare(&plan, &mut |_| Ok(()))?;
    for window in 1..=10 {
        let header =
            RequestHeader { window, iteration: 1, command: 1, length: 0.1, ..RequestHeader::default() };
        let request = Request { header, sends: 3 * NODES, expects: Some(3 * NODES) };
        fem.send(request, &mut |payload| payload.fill(window as f64))?;
        assert_eq!(fem.receive()?, Status::Done);
        assert!(fem.answer().iter().all(|&x| x == window as f64));
    }
    fem.finish(false).map(|_| ())
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_run_over_shared_memory() {
    let work = match std::env::var(ROLE).as_deref() {
        Ok("solver") => solve(std::env::var(RUN).expect("given").parse().expect("an id")),
        Ok(_) => couple(),
        Err(_) => return from_outside(),
    };
    if let Err(failure) = work {
        eprintln!("error: {failure}");
        std::process::exit(1);
    }
    std::process::exit(0);
}

fn from_outside() {
    let runtime = tempfile::Builder::new().prefix("x").rand_bytes(5).tempdir_in("/tmp").expect("a directory");
    let private = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(runtime.path(), private).expect("changed");
    let output = role("coupler").env_remove("XDG_RUNTIME_DIR").output().expect("started");
    assert!(output.status.success(), "{}", said(&output));
    let output = role("coupler").env("XDG_RUNTIME_DIR", runtime.path()).output().expect("started");
    assert!(output.status.success() && runtime.path().join("rockfall").is_dir(), "{}", said(&output));
}

/// Shared memory of every size ends a run with a sentence, or is enough: no process is killed by a signal.
#[test]
fn shared_memory_of_any_size_ends_in_no_signal() {
    let mut ends = [0, 0];
    for kilobytes in (500..=13_000).step_by(500) {
        let mount = format!("mount -t tmpfs -o size={kilobytes}k tmpfs /dev/shm && exec \"$@\"");
        let coupler = role("coupler");
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "sh", "-c", &mount, "sh"]);
        command.arg(coupler.get_program()).args(coupler.get_args());
        let output = command.env(ROLE, "coupler").env_remove("XDG_RUNTIME_DIR").output().expect("started");
        let said = said(&output);
        if said.contains("unshare: ") || said.contains("mount: ") {
            return; // This machine lets nobody have a file system of their own.
        }
        match output.status.code() {
            Some(0) => ends[0] += 1,
            Some(1) if said.contains("shared memory") => ends[1] += 1,
            _ => panic!("{kilobytes} kB: {output:?}"),
        }
    }
    assert!(ends[0] > 0 && ends[1] > 0, "{ends:?}: too small and large enough were both tried");
}
