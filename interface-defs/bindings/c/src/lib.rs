//! The contract for C, C++, Fortran and whatever calls C: a struct of functions, and plain pointers to what is exchanged.
//!
//! `include/rockfall_solver.h` is made from this file by a test, and holds its documentation. Nothing unwinds into the caller: a
//! panic of a function, or its error, becomes a fault with its text, which ends the run.

use common::{Report, Side, as_planned, pointer_to};
use interface_defs::solver::OnProgress;
use interface_defs::{
    Fault, FaultKind, FieldSpec, Gauge, Hello, InterfaceMesh, Measure, Place, Plan, Progress, Ready, Role,
    Sampling, Solver, Statistics, Window, capability, code,
};
use std::cell::{Cell, RefCell};
use std::ffi::{CStr, OsString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::{null, null_mut};
use std::slice;
use std::sync::LazyLock;

/// A function did what it was asked.
pub const RF_OK: c_int = 0;
/// The user's input is wrong: the run ends with exit code 2 (in `prepare`; later with 1).
pub const RF_INPUT: c_int = 1;
/// This window cannot be solved: the coupler tries a shorter one, if the solver repeats.
pub const RF_WINDOW: c_int = 2;
/// The solver cannot go on: the run ends with exit code 1. So does any other number.
pub const RF_BROKEN: c_int = 3;

/// One item per node of the interface mesh.
pub const RF_NODE: u32 = 0;
/// One item per line.
pub const RF_LINE: u32 = 1;
/// One item per face.
pub const RF_FACE: u32 = 2;
/// One item for the whole interface.
pub const RF_WHOLE: u32 = 3;

/// `samples` values, at the ends of as many equal parts of the window; the last is the window's end.
pub const RF_AT_ENDS: u32 = 0;
/// `samples` + 1 values: the window's start, then as `RF_AT_ENDS`.
pub const RF_FROM_START: u32 = 1;
/// `samples` means over as many equal parts of the window.
pub const RF_MEANS: u32 = 2;
/// One value for the window.
pub const RF_ONCE: u32 = 3;

/// A gauge without a part in the balance of energy.
pub const RF_NO_ROLE: u32 = 0;
/// Kinetic energy [J].
pub const RF_KINETIC: u32 = 1;
/// Potential energy of dead load [J].
pub const RF_POTENTIAL: u32 = 2;
/// Stored (elastic) energy [J].
pub const RF_STORED: u32 = 3;
/// Energy dissipated since t = 0 [J].
pub const RF_DISSIPATED: u32 = 4;
/// Work received through the interface since t = 0 [J].
pub const RF_RECEIVED: u32 = 5;

/// A field of the exchange. Its array is `[samples][items][components]`, the last index the fastest
/// (Fortran: `(components, items, samples)`).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct RfField {
    /// `"force"` [N], `"displacement"` from t = 0 [m], `"velocity"` [m/s], or another name of PROTOCOL.md, section 6.
    pub name: *const c_char,
    /// Numbers per item: 3 for a vector.
    pub components: u32,
    /// `RF_NODE`, `RF_LINE`, `RF_FACE` or `RF_WHOLE`.
    pub place: u32,
    /// `RF_AT_ENDS`, `RF_FROM_START`, `RF_MEANS` or `RF_ONCE`.
    pub sampling: u32,
    /// Declared: the most parts of a window that the solver can do. In a plan: those that travel, 0 if the field does not.
    pub samples: u32,
}

/// The interface mesh at t = 0. What is `NULL` is empty. A node that no line and no face holds is a contact point of its own.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct RfMesh {
    /// Number of nodes.
    pub nodes: usize,
    /// `[nodes][3]` [m].
    pub coordinates: *const f64,
    /// Number of lines (wires, cables, edges).
    pub lines: usize,
    /// `[lines][2]`, nodes from 0.
    pub line_nodes: *const u32,
    /// `[lines]` [m]; `NULL`: all zero.
    pub line_radius: *const f64,
    /// Number of faces.
    pub faces: usize,
    /// `[faces][3]`, nodes from 0.
    pub face_nodes: *const u32,
    /// `[nodes]` [kg], infinite where a node is held; `NULL`: not known.
    pub masses: *const f64,
}

/// A named number that comes with every answer. It becomes the column `NAME_UNIT` of history.csv, and with `extremes` the measures
/// `NAME_min` and `NAME_max`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct RfGauge {
    /// In `snake_case`, without the unit. One in N whose name contains `reaction` is a mean over the window, all others are
    /// values at its end.
    pub name: *const c_char,
    /// `"m"`, `"m/s"`, `"N"`, `"J"` or `"1"`.
    pub unit: *const c_char,
    /// `RF_NO_ROLE`, or its part in the balance of energy.
    pub role: u32,
    /// 1: its smallest and largest value over the run are results of their own; else 0.
    pub extremes: u32,
}

/// What the run is to be.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct RfPlan {
    /// End of the run [s].
    pub end_time: f64,
    /// Length of the scene's windows [s]. Single windows may be shorter, or longer up to `largest_window`.
    pub window: f64,
    /// The solver's `takes`, in its order, each with the samples that travel.
    pub takes: *const RfField,
    /// The solver's `gives`, in the same way.
    pub gives: *const RfField,
    /// For a contact solver the structure's mesh; for a structure `NULL`.
    pub partner: *const RfMesh,
}

/// What `prepare` fills in. It is copied when `prepare` returns.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct RfReady {
    /// A structure offers its mesh here. A contact solver leaves the partner's mesh as it is, or writes its own.
    pub mesh: RfMesh,
    /// `[gauge_count]`.
    pub gauges: *const RfGauge,
    /// Number of gauges.
    pub gauge_count: usize,
}

/// A time window, as the coupler asks for it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct RfWindow {
    /// Number of the window, from 1.
    pub number: u64,
    /// Coupling iteration in the window, from 1.
    pub iteration: u64,
    /// Start [s]. Never sum up lengths: this is the time.
    pub start: f64,
    /// Length [s].
    pub length: f64,
}

/// A solver: what it is, and functions that do its work. Each gets `data`, and returns `RF_OK` or another of these numbers, after
/// `rf_explain` with the reason. What is `NULL` where that is allowed is not called.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct RfSolver {
    /// Name and version, for messages.
    pub program: *const c_char,
    /// The solver's own, given to each function.
    pub data: *mut c_void,
    /// How well it repeats a window: solving A, B, A from one committed state gives both A equal to this share of each field; 0:
    /// equal bytes. Below 0: it cannot repeat a window, and is coupled weakly.
    pub repeats: f64,
    /// Longest window that it can solve [s]; 0: no limit. Eight windows of the scene let clause 5.11 of `PROTOCOL.md` be settled.
    pub largest_window: f64,
    /// `[take_count]`: what it can take.
    pub takes: *const RfField,
    /// Number of these.
    pub take_count: usize,
    /// `[give_count]`: what it can give.
    pub gives: *const RfField,
    /// Number of these.
    pub give_count: usize,
    /// Build everything, and fill in `ready`. May take long: call `rf_progress` at least once a second then.
    pub prepare: Option<
        unsafe extern "C-unwind" fn(data: *mut c_void, plan: *const RfPlan, ready: *mut RfReady) -> c_int,
    >,
    /// Write the answer as it stands at t = 0: as `solve` does. `NULL`: all of it is zero.
    pub start: Option<
        unsafe extern "C-unwind" fn(data: *mut c_void, gives: *const *mut f64, gauges: *mut f64) -> c_int,
    >,
    /// Advance the committed state over the window, into a state that is not committed yet. `takes[i]` and `gives[i]` are the arrays
    /// of the declared fields in their order, `NULL` for one that the plan does not have; write every number of `gives`.
    /// `gauges` is `[gauge_count][3]`: value, smallest and largest over the solver's own steps. May be called any number of
    /// times for a window, always from the committed state: equal input gives equal numbers. The arrays are valid in this call alone.
    pub solve: Option<
        unsafe extern "C-unwind" fn(
            data: *mut c_void,
            window: *const RfWindow,
            takes: *const *const f64,
            gives: *const *mut f64,
            gauges: *mut f64,
        ) -> c_int,
    >,
    /// Accept the last solve: its end is the committed state from now on.
    pub commit: Option<unsafe extern "C-unwind" fn(data: *mut c_void) -> c_int>,
    /// The run is over: write files, call `rf_measure`. May be `NULL`.
    pub finish: Option<unsafe extern "C-unwind" fn(data: *mut c_void) -> c_int>,
    /// 1: nothing of it will move any more unless the other solver moves it; else 0. May be `NULL`.
    pub at_rest: Option<unsafe extern "C-unwind" fn(data: *mut c_void) -> c_int>,
    /// The committed state as bytes, valid until the next call, from which `resume` can go on in another run. Both or none: with them
    /// a run that was killed goes on.
    pub save: Option<
        unsafe extern "C-unwind" fn(data: *mut c_void, bytes: *mut *const u8, length: *mut usize) -> c_int,
    >,
    /// Before `prepare`, which then gives the same answers as at t = 0 but leaves the solver in this state.
    pub resume:
        Option<unsafe extern "C-unwind" fn(data: *mut c_void, bytes: *const u8, length: usize) -> c_int>,
}

thread_local! {
    static REASON: RefCell<Option<String>> = const { RefCell::new(None) };
    static MEASURES: RefCell<Vec<Measure>> = const { RefCell::new(Vec::new()) };
    static BAD_KEY: RefCell<Option<String>> = const { RefCell::new(None) };
    static PROGRESS: Cell<Option<Report>> = const { Cell::new(None) };
}

static SCENE: LazyLock<Result<toml::Table, String>> = LazyLock::new(|| common::scene(&arguments()));

fn arguments() -> Vec<OsString> {
    std::env::args_os().collect()
}

/// Take part in the run that this program's own command line names; returns its exit code. Ends when the run does.
///
/// # Safety
/// All pointers in `solver` are valid until it returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rf_serve(solver: *const RfSolver) -> c_int {
    let served = catch_unwind(|| {
        // SAFETY: as of this function.
        let adapter = unsafe { Adapter::new(solver) };
        match adapter {
            Ok(mut adapter) => common::run(Ok(&mut adapter), &arguments()),
            Err(fault) => common::run(Err(fault), &arguments()),
        }
    });
    served.unwrap_or(1)
}

/// The reason for what a function is about to return, for the user: what, where, the numbers, what to try.
///
/// # Safety
/// `reason` is a text that ends with a zero, or `NULL`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rf_explain(reason: *const c_char) {
    // SAFETY: as of this function.
    REASON.set(unsafe { text(reason) });
}

/// Say how far `prepare` is, with the share that is done (0 to 1). Other than 0: the run ends, return this number at once.
///
/// # Safety
/// `what` is a text that ends with a zero, or `NULL`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rf_progress(what: *const c_char, done: f64) -> c_int {
    // SAFETY: as of this function.
    let what = unsafe { text(what) }.unwrap_or_default();
    let Some(report) = PROGRESS.get() else { return RF_OK };
    let progress = Progress { what, done, options: Vec::new() };
    // SAFETY: it is there while `prepare` is called, and nothing else uses it meanwhile.
    match catch_unwind(AssertUnwindSafe(|| unsafe { (*report)(progress) })) {
        Ok(Ok(())) => RF_OK,
        Ok(Err(fault)) => {
            REASON.set(Some(fault.to_string()));
            RF_BROKEN
        }
        Err(panic) => {
            REASON.set(Some(said(panic.as_ref())));
            RF_BROKEN
        }
    }
}

/// In `finish`: a result of the whole run, for summary.json. Its name is in `snake_case`, without the unit.
///
/// # Safety
/// `name` and `unit` are texts that end with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rf_measure(name: *const c_char, value: f64, unit: *const c_char) {
    // SAFETY: as of this function.
    let (name, unit) = unsafe { (text(name), text(unit)) };
    let measure = Measure::new(name.unwrap_or_default(), value, unit.unwrap_or_default());
    MEASURES.with_borrow_mut(|all| all.push(measure));
}

/// A number of the scene by its dotted key, as `"rock.0.mass"` or `"custom.stiffness"`; `otherwise` where the scene does not have
/// it. What is there and no number ends the run with a message. The table `[custom]` of a scene belongs to programs like yours.
///
/// # Safety
/// `key` is a text that ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rf_number(key: *const c_char, otherwise: f64) -> f64 {
    // SAFETY: as of this function.
    let key = unsafe { text(key) }.unwrap_or_default();
    number(&key)
        .unwrap_or_else(|what| {
            BAD_KEY.set(Some(what));
            None
        })
        .unwrap_or(otherwise)
}

fn number(key: &str) -> Result<Option<f64>, String> {
    let scene = SCENE.as_ref().map_err(String::clone)?;
    let mut words = key.split('.');
    let mut at = words.next().and_then(|word| scene.get(word));
    for word in words {
        at = at.and_then(|value| match value {
            toml::Value::Array(items) => word.parse::<usize>().ok().and_then(|index| items.get(index)),
            value => value.get(word),
        });
    }
    match at {
        None => Ok(None),
        Some(toml::Value::Float(number)) => Ok(Some(*number)),
        Some(toml::Value::Integer(number)) => Ok(Some(*number as f64)),
        Some(other) => Err(format!("{key} is {other}, a number was expected")),
    }
}

/// # Safety
/// `from` is a text that ends with a zero, or `NULL`.
unsafe fn text(from: *const c_char) -> Option<String> {
    // SAFETY: as of this function.
    (!from.is_null()).then(|| unsafe { CStr::from_ptr(from) }.to_string_lossy().into_owned())
}

/// What a panic says.
fn said(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a text").to_owned()
}

/// Call one of a solver's functions.
fn call(name: &str, function: impl FnOnce() -> c_int) -> Result<(), Fault> {
    REASON.set(None);
    let kind = match catch_unwind(AssertUnwindSafe(function)) {
        Ok(RF_OK) => match BAD_KEY.take() {
            None => return Ok(()),
            Some(what) => return Err(Fault::input(what)),
        },
        Ok(RF_INPUT) => (FaultKind::Input, code::INVALID_VALUE),
        Ok(RF_WINDOW) => (FaultKind::Window, code::NOT_CONVERGED),
        Ok(_) => (FaultKind::Broken, code::OTHER),
        Err(panic) => return Err(Fault::broken(format!("{name}: {}", said(panic.as_ref())))),
    };
    let reason =
        REASON.take().unwrap_or(format!("{name} failed without a reason: it may say one by rf_explain"));
    Err(Fault::new(kind.0, interface_defs::Diagnostic::error(kind.1, reason)))
}

/// # Safety
/// `from` points to `count` values, or is `NULL`, which is an error where there is one.
unsafe fn list<'a, T>(from: *const T, count: usize, what: &str) -> Result<&'a [T], Fault> {
    match (from.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(Fault::broken(format!("{what}: {count} of them at NULL"))),
        // SAFETY: as of this function.
        (false, _) => Ok(unsafe { slice::from_raw_parts(from, count) }),
    }
}

/// # Safety
/// Texts in it end with a zero, or are `NULL`.
unsafe fn spec(field: &RfField) -> Result<FieldSpec, Fault> {
    // SAFETY: as of this function.
    let name = unsafe { text(field.name) }.filter(|name| !name.is_empty());
    let name = name.ok_or_else(|| Fault::broken("a field without a name"))?;
    let place = match field.place {
        RF_NODE => Place::Node,
        RF_LINE => Place::Line,
        RF_FACE => Place::Face,
        RF_WHOLE => Place::Whole,
        other => return Err(Fault::broken(format!("field {name}: place {other} has no meaning"))),
    };
    let sampling = match field.sampling {
        RF_AT_ENDS => Sampling::AtEnds,
        RF_FROM_START => Sampling::FromStart,
        RF_MEANS => Sampling::Means,
        RF_ONCE => Sampling::Once,
        other => return Err(Fault::broken(format!("field {name}: sampling {other} has no meaning"))),
    };
    if field.components == 0 || field.samples == 0 {
        let (components, samples) = (field.components, field.samples);
        return Err(Fault::broken(format!(
            "field {name}: {components} components and {samples} samples; each is at least 1"
        )));
    }
    Ok(FieldSpec {
        name,
        components: field.components,
        place,
        sampling,
        samples: field.samples,
        interface: 0,
    })
}

/// # Safety
/// Its texts end with a zero, or are `NULL`.
unsafe fn gauge(gauge: &RfGauge) -> Result<Gauge, Fault> {
    // SAFETY: as of this function.
    let (name, unit) = unsafe { (text(gauge.name), text(gauge.unit)) };
    let name = name.ok_or_else(|| Fault::broken("a gauge without a name"))?;
    let role = match gauge.role {
        RF_NO_ROLE => Role::None,
        RF_KINETIC => Role::Kinetic,
        RF_POTENTIAL => Role::Potential,
        RF_STORED => Role::Stored,
        RF_DISSIPATED => Role::Dissipated,
        RF_RECEIVED => Role::Received,
        other => return Err(Fault::broken(format!("gauge {name}: role {other} has no meaning"))),
    };
    Ok(Gauge { name, unit: unit.unwrap_or_default(), role, extremes: gauge.extremes != 0 })
}

/// # Safety
/// Its pointers have as many values as it says.
unsafe fn mesh(mesh: &RfMesh) -> Result<InterfaceMesh, Fault> {
    // SAFETY: as of this function.
    unsafe {
        let given = |from: *const f64, count| list(from, if from.is_null() { 0 } else { count }, "numbers");
        Ok(InterfaceMesh {
            coordinates: list(mesh.coordinates, 3 * mesh.nodes, "coordinates")?.to_vec(),
            lines: list(mesh.line_nodes, 2 * mesh.lines, "line_nodes")?.as_chunks().0.to_vec(),
            faces: list(mesh.face_nodes, 3 * mesh.faces, "face_nodes")?.as_chunks().0.to_vec(),
            line_radius: given(mesh.line_radius, mesh.lines)?.to_vec(),
            masses: given(mesh.masses, mesh.nodes)?.to_vec(),
            ..Default::default()
        })
    }
}

/// A mesh as C sees it, without copies.
fn view(mesh: &InterfaceMesh) -> RfMesh {
    fn at<T>(of: &[T]) -> *const T {
        if of.is_empty() { null() } else { of.as_ptr() }
    }
    RfMesh {
        nodes: mesh.node_count(),
        coordinates: at(&mesh.coordinates),
        lines: mesh.lines.len(),
        line_nodes: at(mesh.lines.as_flattened()),
        line_radius: at(&mesh.line_radius),
        faces: mesh.faces.len(),
        face_nodes: at(mesh.faces.as_flattened()),
        masses: at(&mesh.masses),
    }
}

/// A solver in C as one in Rust.
struct Adapter<'a> {
    c: &'a RfSolver,
    program: String,
    takes: Vec<FieldSpec>,
    gives: Vec<FieldSpec>,
    take_side: Side,
    give_side: Side,
    take_at: Vec<*const f64>,
    give_at: Vec<*mut f64>,
}

impl Adapter<'_> {
    /// # Safety
    /// All pointers in it are valid as long as it lives.
    unsafe fn new(solver: *const RfSolver) -> Result<Self, Fault> {
        // SAFETY: as of this function.
        unsafe {
            let c = solver.as_ref().ok_or_else(|| Fault::broken("no solver: rf_serve(NULL)"))?;
            let specs = |from, count, what| -> Result<Vec<FieldSpec>, Fault> {
                list(from, count, what)?.iter().map(|field| spec(field)).collect()
            };
            for (name, is_there) in [
                ("prepare", c.prepare.is_some()),
                ("solve", c.solve.is_some()),
                ("commit", c.commit.is_some()),
            ] {
                if !is_there {
                    return Err(Fault::broken(format!("the solver has no function {name}")));
                }
            }
            if let Some(what) = BAD_KEY.take() {
                return Err(Fault::input(what));
            }
            Ok(Self {
                c,
                program: text(c.program).unwrap_or_default(),
                takes: specs(c.takes, c.take_count, "takes")?,
                gives: specs(c.gives, c.give_count, "gives")?,
                take_side: Side::default(),
                give_side: Side::default(),
                take_at: Vec::new(),
                give_at: Vec::new(),
            })
        }
    }

    /// Where the fields of this answer are.
    fn point(&mut self, output: &mut [f64]) -> *mut f64 {
        let start = output.as_mut_ptr();
        let at = |place: &Option<(std::ops::Range<usize>, usize)>| {
            place.as_ref().map_or(null_mut(), |(range, _)| start.wrapping_add(range.start))
        };
        self.give_at.clear();
        self.give_at.extend(self.give_side.fields.iter().map(at));
        start.wrapping_add(self.give_side.gauges.start)
    }
}

impl Solver for Adapter<'_> {
    fn hello(&self) -> Hello {
        let can_go_on = self.c.save.is_some() && self.c.resume.is_some();
        Hello {
            program: self.program.clone(),
            capabilities: can_go_on.then(|| capability::CHECKPOINT.to_owned()).into_iter().collect(),
            repeats: (self.c.repeats >= 0.0).then_some(self.c.repeats),
            takes: self.takes.clone(),
            gives: self.gives.clone(),
            largest_window: if self.c.largest_window > 0.0 { self.c.largest_window } else { f64::INFINITY },
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        let c = self.c;
        let planned = |of: *const RfField, declared: &[FieldSpec], all: &[FieldSpec]| -> Vec<RfField> {
            let with = |(i, field)| {
                // SAFETY: it has as many fields as were read from it.
                let declared: RfField = unsafe { *of.add(i) };
                RfField { samples: as_planned(field, all).map_or(0, |f| f.samples), ..declared }
            };
            declared.iter().enumerate().map(with).collect()
        };
        let takes = planned(c.takes, &self.takes, &plan.takes);
        let gives = planned(c.gives, &self.gives, &plan.gives);
        let partner = plan.partner_mesh.as_ref().map(view);
        let asked = RfPlan {
            end_time: plan.end_time,
            window: plan.window,
            takes: takes.as_ptr(),
            gives: gives.as_ptr(),
            partner: partner.as_ref().map_or(null(), |mesh| mesh),
        };
        let mut ready = RfReady {
            mesh: partner.unwrap_or_else(|| view(&InterfaceMesh::default())),
            gauges: null(),
            gauge_count: 0,
        };
        PROGRESS.set(Some(pointer_to(progress)));
        // SAFETY: a function of the caller of `rf_serve`, with what it is to get.
        let prepared = call("prepare", || {
            c.prepare.map_or(RF_BROKEN, |f| unsafe { f(c.data, &raw const asked, &raw mut ready) })
        });
        PROGRESS.set(None);
        prepared?;
        // SAFETY: what `prepare` has filled in.
        let (mesh, gauges) = unsafe {
            let gauges = list(ready.gauges, ready.gauge_count, "gauges")?;
            (mesh(&ready.mesh)?, gauges.iter().map(|of| gauge(of)).collect::<Result<Vec<_>, _>>()?)
        };
        mesh.check().map_err(Fault::broken)?;
        let mut ready = Ready { mesh, gauges, ..Default::default() };
        (self.take_side, self.give_side) = Side::both(&self.takes, &self.gives, plan, &ready);
        let mut initial = vec![0.0; self.give_side.gauges.end];
        let gauges = self.point(&mut initial);
        if let Some(start) = c.start {
            // SAFETY: as above.
            call("start", || unsafe { start(c.data, self.give_at.as_ptr(), gauges) })?;
        }
        ready.initial = initial;
        Ok(ready)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let c = self.c;
        let gauges = self.point(output);
        let at = |place: &Option<(std::ops::Range<usize>, usize)>| {
            place.as_ref().map_or(null(), |(range, _)| input[range.clone()].as_ptr())
        };
        self.take_at.clear();
        self.take_at.extend(self.take_side.fields.iter().map(at));
        let window = RfWindow {
            number: window.number,
            iteration: window.iteration.into(),
            start: window.start,
            length: window.length,
        };
        let (takes, gives) = (self.take_at.as_ptr(), self.give_at.as_ptr());
        // SAFETY: a function of the caller of `rf_serve`, with what it is to get.
        call("solve", || {
            c.solve.map_or(RF_BROKEN, |f| unsafe { f(c.data, &raw const window, takes, gives, gauges) })
        })
    }

    fn commit(&mut self) -> Result<(), Fault> {
        // SAFETY: as above.
        call("commit", || self.c.commit.map_or(RF_BROKEN, |f| unsafe { f(self.c.data) }))
    }

    fn is_at_rest(&self) -> bool {
        // SAFETY: as above.
        self.c.at_rest.is_some_and(|f| {
            catch_unwind(AssertUnwindSafe(|| unsafe { f(self.c.data) } == 1)).unwrap_or(false)
        })
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        let (mut bytes, mut length) = (null(), 0);
        // SAFETY: as above.
        unsafe {
            call("save", || {
                self.c.save.map_or(RF_BROKEN, |f| f(self.c.data, &raw mut bytes, &raw mut length))
            })?;
            Ok(list(bytes, length, "bytes")?.to_vec())
        }
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Fault> {
        let (bytes, length) = (state.as_ptr(), state.len());
        // SAFETY: as above.
        call("resume", || self.c.resume.map_or(RF_BROKEN, |f| unsafe { f(self.c.data, bytes, length) }))
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        if let Some(finish) = self.c.finish {
            // SAFETY: as above.
            call("finish", || unsafe { finish(self.c.data) })?;
        }
        Ok(Statistics { measures: MEASURES.take(), ..Default::default() })
    }
}

#[cfg(test)]
mod tests;
