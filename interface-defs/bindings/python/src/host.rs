//! The other end of the contract for Python: a solver in a process of its own, with this program in the coupler's place.
//!
//! What a user sees is in `rockfall/host.py`; its class `Host` calls what is here.

use crate::{Places, PyField, PyMesh, mesh_parts, places};
use common::Side;
use interface_defs::ipc::{self, Remote, Wait, remote::HostOptions};
use interface_defs::{
    Command as Asks, Failure, Fault, FieldSpec, Hello, Participant, Place, Plan, Request, RequestHeader,
    RunId, Sampling, Status,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use std::cell::RefCell;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::rc::Rc;
use std::time::Duration;

/// What its user gets as `rockfall.Fault`.
fn raised(py: Python<'_>, failure: &Failure) -> PyErr {
    let kind = if failure.is_input() { "input" } else { "broken" };
    let fault = || py.import("rockfall.solver")?.getattr("Fault")?.call1((failure.to_string(), kind));
    fault().map_or_else(|error| error, PyErr::from_value)
}

/// A declared field as `rockfall.Field` takes it.
type Declared = (String, &'static str, u32, &'static str, u32);

fn declared(fields: &[FieldSpec]) -> Vec<Declared> {
    let of = |field: &FieldSpec| {
        let sampling = match field.sampling {
            Sampling::AtEnds => "at_ends",
            Sampling::FromStart => "from_start",
            Sampling::Means => "means",
            Sampling::Once => "once",
        };
        let place = match field.place {
            Place::Node => "node",
            Place::Line => "line",
            Place::Face => "face",
            Place::Whole => "whole",
            // Of selected nodes alone, which this host does not ask for.
            Place::Pair => return None,
        };
        Some((field.name.clone(), sampling, field.components, place, field.samples))
    };
    fields.iter().filter_map(of).collect()
}

/// Program, to what share it repeats a window, what it takes and gives.
type Declares = (String, Option<f64>, Vec<Declared>, Vec<Declared>);

/// A prepared solver: mesh, gauges (name, unit), places of fields in requests and answers, where gauges begin, lengths of both, and the answer
/// as it stands at t = 0.
type Prepared<'py> =
    (Bound<'py, PyTuple>, Vec<(String, String)>, Places, Places, usize, usize, Bound<'py, PyBytes>);

/// Measures (name, value, unit, time [s]), and processor time [s].
type Ended = (Vec<(String, f64, String, Option<f64>)>, f64);

/// The solver, started and joined.
#[pyclass(unsendable)]
pub struct Host {
    child: Rc<RefCell<Child>>,
    remote: Option<Remote>,
    host: Option<ipc::Host>,
    expects: usize,
}

#[pymethods]
impl Host {
    /// Start `command` in the role `dem` or `fem`.
    #[new]
    fn start(
        py: Python<'_>,
        command: Vec<OsString>,
        role: &str,
        scene: PathBuf,
        out: PathBuf,
        timeout: f64,
    ) -> PyResult<Self> {
        let timeout = Duration::from_secs_f64(timeout);
        let begin = || -> Result<_, Failure> {
            ipc::clean()?;
            let run = RunId::new();
            let options = HostOptions { run: run.clone(), timeout, wait: Wait::Auto, supervisor: None };
            Ok((run, ipc::Host::create(options, &[role])?))
        };
        let (run, (host, mut remotes)) = begin().map_err(|failure| raised(py, &failure))?;
        let (program, own) = command.split_first().expect("a program, as `rockfall.Host` has checked");
        let mut solver = Command::new(program);
        solver.args(own).arg("serve").arg(scene).args(["--run", run.as_str(), "--as", role]);
        solver.arg("--out").arg(out).args(["--timeout", &timeout.as_secs_f64().to_string()]);
        solver.args(["--supervisor", &std::process::id().to_string()]).stdout(Stdio::null());
        let child = match solver.spawn() {
            Ok(child) => Rc::new(RefCell::new(child)),
            Err(error) => {
                drop(remotes);
                host.close();
                let fault = Fault::input(format!("{}: {error}", program.display()));
                return Err(raised(py, &Failure::Fault { solver: role.into(), fault }));
            }
        };
        let (watched, role) = (Rc::clone(&child), role.to_owned());
        host.on_tick(move || match watched.borrow_mut().try_wait() {
            Ok(Some(status)) => Err(Failure::Lost { solver: role.clone(), during: format!("with {status}") }),
            _ => Ok(()),
        });
        Ok(Self { child, remote: Some(remotes.remove(0)), host: Some(host), expects: 0 })
    }

    /// What it declares.
    fn hello(&mut self, py: Python<'_>) -> PyResult<Declares> {
        let Hello { program, repeats, takes, gives, .. } = self.ask(py, Remote::hello)?;
        Ok((program, repeats, declared(&takes), declared(&gives)))
    }

    fn prepare<'py>(
        &mut self,
        py: Python<'py>,
        times: (f64, f64),
        takes: Vec<PyField>,
        gives: Vec<PyField>,
        partner: Option<PyMesh>,
    ) -> PyResult<Prepared<'py>> {
        let (end_time, window) = times;
        let specs =
            |fields: Vec<PyField>| fields.into_iter().map(FieldSpec::try_from).collect::<PyResult<Vec<_>>>();
        let (takes, gives) = (specs(takes)?, specs(gives)?);
        let partner_mesh = partner.as_ref().map(PyMesh::mesh);
        let plan = Plan { end_time, window, takes, gives, partner_mesh, ..Plan::default() };
        let ready = self.ask(py, |remote| remote.prepare(&plan, &mut |_| Ok(())))?;
        let (takes, gives) = Side::both(&plan.takes, &plan.gives, &plan, &ready);
        self.expects = gives.gauges.end;
        let gauges = ready.gauges.iter().map(|gauge| (gauge.name.clone(), gauge.unit.clone())).collect();
        let initial: Vec<u8> = ready.initial.iter().flat_map(|x| x.to_le_bytes()).collect();
        let (mesh, initial) = (mesh_parts(py, &ready.mesh)?, PyBytes::new(py, &initial));
        let (asked, first) = (takes.gauges.end, gives.gauges.start);
        Ok((mesh, gauges, places(&takes), places(&gives), first, asked, initial))
    }

    /// The answer to these numbers in a window (number, iteration, start, length), after a commit of the last one if `commit`.
    fn solve<'py>(
        &mut self,
        py: Python<'py>,
        asked: (u64, u32, f64, f64),
        commit: bool,
        numbers: &[u8],
    ) -> PyResult<Bound<'py, PyBytes>> {
        let (window, iteration, start, length) = asked;
        let command = if commit { Asks::CommitAndSolve } else { Asks::Solve } as u32;
        let header = RequestHeader { window, iteration, command, start, length, ..Default::default() };
        let (numbers, _) = numbers.as_chunks::<8>();
        let request = Request { header, sends: numbers.len(), expects: Some(self.expects) };
        let answer = self.ask(py, |remote| {
            remote.send(request, &mut |to| {
                to.iter_mut().zip(numbers).for_each(|(to, number)| *to = f64::from_le_bytes(*number));
            })?;
            match remote.receive()? {
                Status::Done | Status::Rest => {
                    Ok(remote.answer().iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
                }
                _ => {
                    let fault = remote.explain()?;
                    Err(Failure::Fault { solver: remote.name().into(), fault })
                }
            }
        })?;
        Ok(PyBytes::new(py, &answer))
    }

    /// End it in order.
    fn finish(&mut self, py: Python<'_>, commit: bool) -> PyResult<Ended> {
        let statistics = self.ask(py, |remote| {
            let statistics = remote.finish(commit)?;
            remote.wait_gone();
            Ok(statistics)
        })?;
        let _ = self.child.borrow_mut().wait();
        self.close();
        let measures = statistics.measures.into_iter().map(|m| (m.name, m.value, m.unit, m.time));
        Ok((measures.collect(), statistics.cpu_seconds))
    }

    /// End it, in the middle of the run, too; nothing of the run is left. Harmless if it is done twice.
    fn close(&mut self) {
        let Some(mut remote) = self.remote.take() else { return };
        if matches!(self.child.borrow_mut().try_wait(), Ok(None)) {
            remote.abort("the run has ended before its time");
            remote.wait_gone();
            let _ = self.child.borrow_mut().kill();
            let _ = self.child.borrow_mut().wait();
        }
        // The run can be closed once nothing of it is in use.
        drop(remote);
        if let Some(host) = self.host.take() {
            host.close();
        }
    }
}

impl Host {
    fn ask<T>(
        &mut self,
        py: Python<'_>,
        work: impl FnOnce(&mut Remote) -> Result<T, Failure>,
    ) -> PyResult<T> {
        let ended = || Failure::Transport("the solver has ended: a host is for one run".into());
        let remote = self.remote.as_mut().ok_or_else(|| raised(py, &ended()))?;
        work(remote).map_err(|failure| raised(py, &failure))
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.close();
    }
}
