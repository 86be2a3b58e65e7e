//! The contract for Python: a solver in Python as one in Rust. Its arrays are views of shared memory, without copies.
//!
//! What a user sees is in `rockfall/solver.py`; its class `Adapter` is called from here. The coupler's end is [`host`].

mod host;

use common::{Side, pointer_to};
use interface_defs::solver::OnProgress;
use interface_defs::{
    Fault, FieldSpec, Gauge, Group, Hello, InterfaceMesh, Measure, Place, Plan, Progress, Ready, Role,
    Sampling, Solver, Statistics, Window, capability,
};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};
use std::ffi::{OsString, c_char, c_int};

/// The part of the package that is in Rust.
#[pymodule]
mod _rockfall {
    use super::*;
    #[pymodule_export]
    use crate::host::Host;

    /// Take part in the run that `argv` names; returns the exit code.
    #[pyfunction]
    fn serve(py: Python, adapter: Py<PyAny>, argv: Vec<OsString>) -> i32 {
        let solver = PySolver::new(py, adapter);
        py.detach(|| match solver {
            Ok(mut solver) => common::run(Ok(&mut solver), &argv),
            Err(fault) => common::run(Err(fault), &argv),
        })
    }

    /// The scene that `argv` names, with every default; empty without one.
    #[pyfunction]
    fn scene(py: Python, argv: Vec<OsString>) -> PyResult<Py<PyAny>> {
        let scene = common::scene(&argv).map_err(PyValueError::new_err)?;
        Ok(value(py, &toml::Value::Table(scene))?.unbind())
    }
}

fn value<'py>(py: Python<'py>, from: &toml::Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match from {
        toml::Value::Table(table) => {
            let dict = PyDict::new(py);
            table.iter().try_for_each(|(key, item)| dict.set_item(key, value(py, item)?))?;
            dict.into_any()
        }
        toml::Value::Array(items) => {
            let items: PyResult<Vec<_>> = items.iter().map(|item| value(py, item)).collect();
            PyList::new(py, items?)?.into_any()
        }
        toml::Value::String(text) => text.into_pyobject(py)?.into_any(),
        toml::Value::Integer(number) => number.into_pyobject(py)?.into_any(),
        toml::Value::Float(number) => number.into_pyobject(py)?.into_any(),
        toml::Value::Boolean(is) => is.into_pyobject(py)?.to_owned().into_any(),
        toml::Value::Datetime(date) => date.to_string().into_pyobject(py)?.into_any(),
    })
}

/// `rockfall.Field`.
#[derive(FromPyObject)]
struct PyField {
    name: String,
    components: u32,
    place: String,
    sampling: String,
    samples: u32,
}

impl TryFrom<PyField> for FieldSpec {
    type Error = PyErr;

    fn try_from(field: PyField) -> PyResult<Self> {
        let unknown = |what: &str, word: &str, known: &str| {
            PyValueError::new_err(format!("field {}: {what} {word:?}; there are {known}", field.name))
        };
        let place = match &*field.place {
            "node" => Place::Node,
            "line" => Place::Line,
            "face" => Place::Face,
            "whole" => Place::Whole,
            other => return Err(unknown("place", other, "node, line, face, whole")),
        };
        let sampling = match &*field.sampling {
            "at_ends" => Sampling::AtEnds,
            "from_start" => Sampling::FromStart,
            "means" => Sampling::Means,
            "once" => Sampling::Once,
            other => return Err(unknown("sampling", other, "at_ends, from_start, means, once")),
        };
        let PyField { name, components, samples, .. } = field;
        Ok(Self { name, components, place, sampling, samples, interface: 0 })
    }
}

/// `rockfall.Gauge`.
#[derive(FromPyObject)]
struct PyGauge {
    name: String,
    unit: String,
    role: String,
    extremes: bool,
}

impl TryFrom<PyGauge> for Gauge {
    type Error = PyErr;

    fn try_from(gauge: PyGauge) -> PyResult<Self> {
        let role = match &*gauge.role {
            "" => Role::None,
            "kinetic" => Role::Kinetic,
            "potential" => Role::Potential,
            "stored" => Role::Stored,
            "dissipated" => Role::Dissipated,
            "received" => Role::Received,
            other => {
                let what = "there are kinetic, potential, stored, dissipated, received";
                return Err(PyValueError::new_err(format!("gauge {}: role {other:?}; {what}", gauge.name)));
            }
        };
        Ok(Self { name: gauge.name, unit: gauge.unit, role, extremes: gauge.extremes })
    }
}

/// What `Adapter.hello` returns.
#[derive(FromPyObject)]
struct PyHello {
    program: String,
    repeats: Option<f64>,
    largest_window: f64,
    takes: Vec<PyField>,
    gives: Vec<PyField>,
    goes_on: bool,
}

/// A mesh: coordinates, lines, faces, radii of lines, masses as bytes, and groups of nodes.
#[derive(FromPyObject)]
struct PyMesh(Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>, Vec<(String, Vec<u32>)>);

/// What `Adapter.prepare` returns: a mesh, or `None` for the partner's, and gauges.
#[derive(FromPyObject)]
struct PyReady(Option<PyMesh>, Vec<PyGauge>);

/// What `Adapter.finish` returns: measures (name, value, unit), and counts.
#[derive(FromPyObject)]
struct PyEnded(Vec<(String, f64, String)>, Vec<(String, u64)>);

fn numbers<const N: usize, T>(bytes: &[u8], from: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|chunk| from(*chunk)).collect()
}

impl PyMesh {
    fn mesh(&self) -> InterfaceMesh {
        let Self(coordinates, lines, faces, line_radius, masses, groups) = self;
        let group = |(name, nodes): &(String, Vec<u32>)| Group { name: name.clone(), nodes: nodes.clone() };
        InterfaceMesh {
            coordinates: numbers(coordinates, f64::from_le_bytes),
            lines: numbers(lines, u32::from_le_bytes).as_chunks().0.to_vec(),
            faces: numbers(faces, u32::from_le_bytes).as_chunks().0.to_vec(),
            line_radius: numbers(line_radius, f64::from_le_bytes),
            masses: numbers(masses, f64::from_le_bytes),
            groups: groups.iter().map(group).collect(),
            ..Default::default()
        }
    }
}

/// A mesh as [`PyMesh`] takes it.
fn mesh_parts<'py>(py: Python<'py>, mesh: &InterfaceMesh) -> PyResult<Bound<'py, PyTuple>> {
    let floats = |of: &[f64]| PyBytes::new(py, &of.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>());
    let whole = |of: &[u32]| PyBytes::new(py, &of.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>());
    let groups: Vec<_> = mesh.groups.iter().map(|group| (group.name.clone(), group.nodes.clone())).collect();
    let parts = (
        floats(&mesh.coordinates),
        whole(mesh.lines.as_flattened()),
        whole(mesh.faces.as_flattened()),
        floats(&mesh.line_radius),
        floats(&mesh.masses),
        groups,
    );
    parts.into_pyobject(py)
}

/// Where each declared field lies in a payload, and how many samples of it, where the plan has it.
type Places = Vec<Option<(usize, usize, usize)>>;

fn places(side: &Side) -> Places {
    side.fields.iter().map(|place| place.as_ref().map(|(r, samples)| (r.start, r.end, *samples))).collect()
}

/// Sends progress while `prepare` runs, and nothing behind it.
#[pyclass(unsendable)]
struct Report(Option<common::Report>);

#[pymethods]
impl Report {
    fn __call__(&self, what: String, done: f64) -> PyResult<()> {
        let Some(report) = self.0 else { return Ok(()) };
        // SAFETY: it is there while `prepare` is called, and nothing else uses it meanwhile.
        unsafe { (*report)(Progress { what, done, options: Vec::new() }) }
            .map_err(|fault| PyRuntimeError::new_err(fault.to_string()))
    }
}

/// `PyBUF_READ` and `PyBUF_WRITE` of Python's own headers.
const READ: c_int = 0x100;
const WRITE: c_int = 0x200;

/// A view of memory. `Adapter` sees to it that no array on it outlives the call that it is for.
///
/// # Safety
/// `bytes` bytes are at `start` in that call.
unsafe fn view(py: Python<'_>, start: *mut c_char, bytes: usize, flags: c_int) -> PyResult<Bound<'_, PyAny>> {
    // SAFETY: as of this function; an empty list's pointer is not null.
    unsafe { Bound::from_owned_ptr_or_err(py, ffi::PyMemoryView_FromMemory(start, bytes as isize, flags)) }
}

/// A solver in Python as one in Rust.
struct PySolver {
    adapter: Py<PyAny>,
    hello: Hello,
    takes: Side,
    gives: Side,
}

impl PySolver {
    fn new(py: Python<'_>, adapter: Py<PyAny>) -> Result<Self, Fault> {
        let read = || -> PyResult<Hello> {
            let hello: PyHello = adapter.call_method0(py, "hello")?.extract(py)?;
            let specs =
                |fields: Vec<PyField>| fields.into_iter().map(FieldSpec::try_from).collect::<PyResult<_>>();
            Ok(Hello {
                program: hello.program,
                capabilities: hello.goes_on.then(|| capability::CHECKPOINT.to_owned()).into_iter().collect(),
                repeats: hello.repeats,
                takes: specs(hello.takes)?,
                gives: specs(hello.gives)?,
                largest_window: hello.largest_window,
                ..Hello::default()
            })
        };
        let hello = read().map_err(|error| fault(py, &adapter, error))?;
        Ok(Self { adapter, hello, takes: Side::default(), gives: Side::default() })
    }

    /// Call a function of the adapter; an exception becomes a fault.
    fn call<T>(&self, work: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<T>) -> Result<T, Fault> {
        Python::attach(|py| work(self.adapter.bind(py)).map_err(|error| fault(py, &self.adapter, error)))
    }
}

/// What an exception means for the run: `Adapter.explain` says it.
fn fault(py: Python<'_>, adapter: &Py<PyAny>, error: PyErr) -> Fault {
    let said = error.to_string();
    let explained = adapter.call_method1(py, "explain", (error.into_value(py),));
    let explained = explained.and_then(|it| it.extract::<(String, String)>(py));
    match explained {
        Ok((kind, what)) if kind == "input" => Fault::input(what),
        Ok((kind, what)) if kind == "window" => Fault::window(what),
        Ok((_, what)) => Fault::broken(what),
        Err(_) => Fault::broken(said),
    }
}

impl Solver for PySolver {
    fn hello(&self) -> Hello {
        self.hello.clone()
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        let report = pointer_to(progress);
        let made = self.call(|adapter| {
            let py = adapter.py();
            let report = Bound::new(py, Report(Some(report)))?;
            let partner = plan.partner_mesh.as_ref().map(|mesh| mesh_parts(py, mesh)).transpose()?;
            let made = adapter.call_method1("prepare", (plan.end_time, plan.window, partner, &report));
            report.borrow_mut().0 = None;
            let PyReady(own, gauges) = made?.extract()?;
            let mesh =
                own.as_ref().map(PyMesh::mesh).or_else(|| plan.partner_mesh.clone()).unwrap_or_default();
            let gauges = gauges.into_iter().map(Gauge::try_from).collect::<PyResult<_>>()?;
            Ok(Ready { mesh, gauges, ..Default::default() })
        });
        let mut ready = made?;
        ready.mesh.check().map_err(Fault::broken)?;
        (self.takes, self.gives) = Side::both(&self.hello.takes, &self.hello.gives, plan, &ready);
        let (takes, gives, gauges) = (places(&self.takes), places(&self.gives), self.gives.gauges.start);
        ready.initial = vec![0.0; self.gives.gauges.end];
        let (start, bytes) = (ready.initial.as_mut_ptr(), size_of_val(ready.initial.as_slice()));
        let started = Python::attach(|py| {
            let failed = |error| fault(py, &self.adapter, error);
            // SAFETY: the numbers stay where they are in this call.
            let output = unsafe { view(py, start.cast(), bytes, WRITE) }.map_err(failed)?;
            let done = self.adapter.call_method1(py, "start", (takes, gives, gauges, output));
            done.map(drop).map_err(failed)
        });
        if started.is_err() {
            // An array on them may have been kept.
            std::mem::forget(std::mem::take(&mut ready.initial));
        }
        started?;
        Ok(ready)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let (from, to) = (input.as_ptr().cast_mut().cast(), output.as_mut_ptr().cast());
        let (read, written) = (size_of_val(input), size_of_val(output));
        let asked = (window.number, window.iteration, window.start, window.length);
        Python::attach(|py| {
            let failed = |error| fault(py, &self.adapter, error);
            // SAFETY: input and output stay where they are in this call; the first is for reading.
            let (input, output) = unsafe {
                let input = view(py, from, read, READ).map_err(failed)?;
                (input, view(py, to, written, WRITE).map_err(failed)?)
            };
            let solved = self.adapter.call_method1(py, "solve", (asked, input, output));
            solved.map(drop).map_err(failed)
        })
    }

    fn commit(&mut self) -> Result<(), Fault> {
        self.call(|adapter| adapter.call_method0("commit").map(drop))
    }

    fn is_at_rest(&self) -> bool {
        self.call(|adapter| adapter.call_method0("at_rest")?.extract()).unwrap_or(false)
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        self.call(|adapter| adapter.call_method0("save")?.extract())
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Fault> {
        self.call(|adapter| adapter.call_method1("resume", (PyBytes::new(adapter.py(), state),)).map(drop))
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let PyEnded(measures, counts) = self.call(|adapter| adapter.call_method0("finish")?.extract())?;
        let measures = measures.into_iter().map(|(name, value, unit)| Measure::new(name, value, unit));
        Ok(Statistics { measures: measures.collect(), counts, ..Default::default() })
    }
}
