//! A solver of rockfall's contract in a process of its own, with this program in the coupler's place.

use crate::input;
use interface_defs::ipc::{self, Host, Remote, Wait, remote::HostOptions};
use interface_defs::{
    Failure, FieldSpec, Hello, InterfaceMesh, Participant, Plan, Request, RequestHeader, RunId, Sampling,
    Statistics, Status, name,
};
use std::cell::RefCell;
use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::rc::Rc;
use std::time::Duration;

/// The solver, started and joined.
pub struct Hosted {
    child: Rc<RefCell<Child>>,
    remote: Option<Remote>,
    host: Option<Host>,
}

impl Hosted {
    /// Start `command` as `role` (`dem` or `fem`), with results in `out`.
    pub fn start(
        command: &[OsString],
        (role, scene, out): (&str, &Path, &Path),
        timeout: Duration,
    ) -> Result<Self, Failure> {
        let [program, own @ ..] = command else {
            return Err(input("which solver? give its command behind `--`"));
        };
        ipc::clean()?;
        let run = RunId::new();
        let options = HostOptions { run: run.clone(), timeout, wait: Wait::Auto, supervisor: None };
        let (host, mut remotes) = Host::create(options, &[role])?;
        let remote = remotes.remove(0);
        let mut solver = Command::new(program);
        solver
            .args(own)
            .arg("serve")
            .arg(scene)
            .args(["--run", run.as_str(), "--as", role])
            .arg("--out")
            .arg(out);
        solver.args(["--timeout", &timeout.as_secs_f64().to_string()]);
        solver.args(["--supervisor", &std::process::id().to_string()]).stdout(Stdio::null());
        let started = solver.spawn().map_err(|e| input(format!("{}: {e}", program.display())));
        let child = Rc::new(RefCell::new(started?));
        let (watched, role) = (Rc::clone(&child), role.to_owned());
        host.on_tick(move || match watched.borrow_mut().try_wait() {
            Ok(Some(status)) => Err(Failure::Lost { solver: role.clone(), during: format!("with {status}") }),
            _ => Ok(()),
        });
        Ok(Self { child, remote: Some(remote), host: Some(host) })
    }

    /// The solver.
    pub fn remote(&mut self) -> &mut Remote {
        self.remote.as_mut().expect("there until it is dropped")
    }

    /// Ask for the window that begins at `start` [s].
    pub fn solve(
        &mut self,
        header: RequestHeader,
        numbers: &[f64],
        expects: usize,
    ) -> Result<&[f64], Failure> {
        let remote = self.remote();
        let request = Request { header, sends: numbers.len(), expects: Some(expects) };
        remote.send(request, &mut |to| to.copy_from_slice(numbers))?;
        match remote.receive()? {
            Status::Done | Status::Rest => Ok(self.remote().answer()),
            _ => {
                let fault = remote.explain()?;
                Err(Failure::Fault { solver: remote.name().into(), fault })
            }
        }
    }

    /// End it in order.
    pub fn finish(mut self, commit: bool) -> Result<Statistics, Failure> {
        let statistics = self.remote().finish(commit)?;
        self.remote().wait_gone();
        let _ = self.child.borrow_mut().wait();
        Ok(statistics)
    }
}

impl Drop for Hosted {
    fn drop(&mut self) {
        if matches!(self.child.borrow_mut().try_wait(), Ok(None)) {
            self.remote().abort("the preCICE run has ended before its time");
            self.remote().wait_gone();
            let _ = self.child.borrow_mut().kill();
            let _ = self.child.borrow_mut().wait();
        }
        // The run can be closed once nothing of it is in use.
        drop(self.remote.take());
        if let Some(host) = self.host.take() {
            host.close();
        }
    }
}

/// Of the fields `all` of a solver those of this name and sampling, one sample of each in a window.
pub fn field(all: &[FieldSpec], name: &str, sampling: Sampling) -> Option<FieldSpec> {
    let found =
        all.iter().find(|field| field.name == name && field.sampling == sampling && field.interface == 0);
    found.map(|field| FieldSpec { samples: 1, ..field.clone() })
}

/// Displacement and velocity at the end of a window, which every structure gives.
pub fn motion(hello: &Hello) -> Result<Vec<FieldSpec>, Failure> {
    let of = |name| {
        let missing = || Failure::contract("fem", format!("{} does not give {name} (AtEnds)", hello.program));
        field(&hello.gives, name, Sampling::AtEnds).ok_or_else(missing)
    };
    Ok(vec![of(name::DISPLACEMENT)?, of(name::VELOCITY)?])
}

/// The interface mesh of the structure in `scene`, which `program` knows: it is prepared, and ended before the first window.
pub fn mesh_of(program: &OsStr, scene: &Path, timeout: Duration) -> Result<InterfaceMesh, Failure> {
    let out = std::env::temp_dir().join(format!("rockfall-precice-{}", RunId::new()));
    let mesh = || {
        let mut structure = Hosted::start(&[program.to_owned()], ("fem", scene, &out), timeout)?;
        let hello = structure.remote().hello()?;
        let plan = Plan { end_time: 1.0, window: 1.0, gives: motion(&hello)?, ..Plan::default() };
        let ready = structure.remote().prepare(&plan, &mut |_| Ok(()))?;
        structure.finish(false)?;
        Ok(ready.mesh)
    };
    let found = mesh();
    let _ = std::fs::remove_dir_all(&out);
    found
}
