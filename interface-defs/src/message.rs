//! Control messages: handshake, preparation, faults, statistics.
//!
//! Encoding: one byte with the version of the contract ([`PROTOCOL`]), then bincode 2, `standard` configuration with
//! fixed-size integers (little-endian; enum variant as u32; length of text and lists as u64), so
//! that any language can write them. They never travel on the field path.

use crate::diagnostic::{Code, Diagnostic, code};
use crate::field::FieldSpec;
use crate::mesh::InterfaceMesh;
use crate::part::PartUse;
use crate::verdict::{Torn, Verdict};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::fmt;

/// Version of the contract that this crate speaks; a message of another one is refused.
pub const PROTOCOL: u8 = 3;

/// Capability words of a [`Hello`]; further words may be declared and are passed over.
pub mod capability {
    /// The solver takes fields for selected nodes alone: see [`crate::selection`].
    pub const SELECTS: &str = "selects";
    /// The solver can write down its committed state and go on from it in another run.
    pub const CHECKPOINT: &str = "checkpoint";
}

/// Names of further values of a [`Hello`].
pub mod option {
    /// The build of the program, in words for people: its commit, a hash of it. Recorded, and nothing else.
    pub const BUILD: &str = "build";
}

/// Further values of a message by name, so that later versions may add some. Unknown names are passed over.
pub type NamedValues = Vec<(String, String)>;

/// From the coupler to a solver.
#[expect(clippy::large_enum_variant, reason = "a run has five such messages")]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ToSolver {
    /// Who are you? Answered by [`FromSolver::Hello`].
    Connect,
    /// Build everything. Answered by any number of [`FromSolver::Progress`], then [`FromSolver::Ready`].
    Prepare(Plan),
    /// Why did the last solve fail? Answered by [`FromSolver::Fault`].
    Explain,
    /// The run is over: commit the last solve if `commit`. Answered by [`FromSolver::Statistics`].
    Finish {
        /// Whether the last solve was accepted.
        commit: bool,
    },
    /// The run ends before its time. Answered by an empty [`FromSolver::Statistics`]; then leave.
    Abort {
        /// Why, for the user.
        reason: String,
    },
    /// Write the committed state down, after the commit of the last solve if `commit`; the run goes on. Answered by
    /// [`FromSolver::Saved`]. Asked only of solvers that declare [`capability::CHECKPOINT`].
    Save {
        /// Whether the last solve was accepted.
        commit: bool,
    },
    /// Before [`ToSolver::Prepare`]: the run goes on from a state that this solver has written down. Answered by
    /// [`FromSolver::Resumed`].
    Resume {
        /// What it wrote.
        state: Vec<u8>,
    },
}

/// From a solver to the coupler. A [`FromSolver::Fault`] may take the place of any answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum FromSolver {
    /// Who it is and what it can do.
    Hello(Hello),
    /// Still at work on its preparation.
    Progress(Progress),
    /// Prepared.
    Ready(Ready),
    /// It could not do what was asked.
    Fault(Fault),
    /// What it did, at the end.
    Statistics(Statistics),
    /// The committed state, in a form of its own.
    Saved {
        /// All that it needs to go on.
        state: Vec<u8>,
    },
    /// It will go on from the state that it was given.
    Resumed,
}

/// Who a solver is and what it can do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// Program and version, for messages.
    pub program: String,
    /// Words of [`capability`].
    pub capabilities: Vec<String>,
    /// Fingerprint of the scene that it read; the coupler refuses a solver whose fingerprint is not its own. Empty: it
    /// is not compared.
    pub scene: String,
    /// How well it repeats a window: solving A, B, A from one committed state gives both A equal to this relative
    /// tolerance, 0 = equal bytes. `None`: it cannot repeat a window, and is coupled weakly.
    pub repeats: Option<f64>,
    /// Fields it can take, each with the most samples it can take. A structure that lists mean
    /// force takes the mean as its load; one that lists force at the end takes that.
    pub takes: Vec<FieldSpec>,
    /// Fields it can give, each with the most samples it can give.
    pub gives: Vec<FieldSpec>,
    /// Longest window that it can solve [s], infinite if there is no limit.
    pub largest_window: f64,
    /// See [`option`].
    pub options: NamedValues,
}

impl Default for Hello {
    /// Of a solver without limits, that takes and gives nothing.
    fn default() -> Self {
        Self {
            program: String::new(),
            capabilities: Vec::new(),
            scene: String::new(),
            repeats: None,
            takes: Vec::new(),
            gives: Vec::new(),
            largest_window: f64::INFINITY,
            options: Vec::new(),
        }
    }
}

impl Hello {
    /// Whether it has declared the capability.
    pub fn can(&self, capability: &str) -> bool {
        self.capabilities.iter().any(|c| c == capability)
    }

    /// What it says of its build, if it does.
    pub fn build(&self) -> Option<&str> {
        self.options.iter().find(|(name, _)| name == option::BUILD).map(|(_, build)| build.as_str())
    }
}

/// What a solver is to prepare for.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// End of the run [s].
    pub end_time: f64,
    /// Length of the scene's windows [s]. While nothing touches one may last as long as several, up to [`Hello::largest_window`].
    pub window: f64,
    /// Fields of each request, in this order.
    pub takes: Vec<FieldSpec>,
    /// Fields of each answer, in this order; the gauges of [`Ready`] follow.
    pub gives: Vec<FieldSpec>,
    /// For a contact solver: the structure's interface mesh at t = 0.
    pub partner_mesh: Option<InterfaceMesh>,
    /// Further interface meshes, of this structure or of others: numbers 1, 2, ... of [`FieldSpec::interface`]. None in
    /// this version.
    pub more_meshes: Vec<InterfaceMesh>,
    /// None in this version.
    pub options: NamedValues,
}

/// How far the preparation is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// What is being done, with its numbers.
    pub what: String,
    /// Share that is done, 0 to 1; NaN if unknown.
    pub done: f64,
    /// None in this version.
    pub options: NamedValues,
}

/// A prepared solver.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Ready {
    /// The interface mesh that it uses. A structure offers it, a contact solver says what it made of it.
    pub mesh: InterfaceMesh,
    /// Named numbers that come with every answer.
    pub gauges: Vec<Gauge>,
    /// An answer as it would stand at t = 0: fields of the plan, then three numbers per gauge.
    pub initial: Vec<f64>,
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
    /// Further interface meshes: numbers 1, 2, ... of [`FieldSpec::interface`]. None in this version.
    pub more_meshes: Vec<InterfaceMesh>,
    /// None in this version.
    pub options: NamedValues,
}

/// What part a gauge has in the balance of energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// None: it is recorded and nothing else.
    None,
    /// Kinetic energy [J].
    Kinetic,
    /// Potential energy of dead load [J].
    Potential,
    /// Stored (elastic) energy [J].
    Stored,
    /// Energy dissipated since t = 0 [J], integrated from the forces that dissipate.
    Dissipated,
    /// Work received through the interface since t = 0 [J].
    Received,
}

/// A named number of a solver: value, smallest and largest come with every answer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gauge {
    /// Name, in `snake_case`, without the unit.
    pub name: String,
    /// Unit: `m`, `m/s`, `N`, `J`, `1`.
    pub unit: String,
    /// Part in the balance of energy.
    pub role: Role,
    /// Whether its smallest and largest value over the run are results of their own.
    pub extremes: bool,
}

impl Gauge {
    /// A gauge without a part in the balance of energy.
    pub fn new(name: impl Into<String>, unit: &str) -> Self {
        Self { name: name.into(), unit: unit.into(), role: Role::None, extremes: false }
    }

    /// Whether it is a mean over a window, so that values times lengths are the impulse; all others are of its end.
    pub fn is_mean(&self) -> bool {
        const OF_SUPPORTS: [&str; 8] =
            ["_fx", "_fy", "_fz", "_fx_sum", "_fy_sum", "_fz_sum", "_force_min", "_force_max"];
        const OF_THE_END: [&str; 3] = ["_tension", "_tension_min", "_tension_max"];
        let ends_in = |all: &[&str]| all.iter().any(|end| self.name.ends_with(end));
        self.unit == "N" && !ends_in(&OF_THE_END) && (self.name.contains("reaction") || ends_in(&OF_SUPPORTS))
    }
}

/// What kind of fault it is, and so what becomes of the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultKind {
    /// The user's input is wrong: the run ends with exit code 2.
    Input,
    /// This window cannot be solved as asked: a shorter one may succeed.
    Window,
    /// The solver cannot go on: the run ends with exit code 1.
    Broken,
    /// The user has interrupted the solver.
    Interrupted,
    /// A contact solver must see nodes that are not selected: the coupler asks which.
    Beyond,
}

/// Why a solver did not do what was asked: what, where, the numbers, what to try.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// What becomes of the run.
    pub kind: FaultKind,
    /// For the user.
    pub diagnostic: Box<Diagnostic>,
    /// None in this version.
    pub options: NamedValues,
}

impl Fault {
    /// Of this kind.
    pub fn new(kind: FaultKind, diagnostic: Diagnostic) -> Self {
        Self { kind, diagnostic: Box::new(diagnostic), options: Vec::new() }
    }

    fn coded(kind: FaultKind, code: Code, message: impl Into<String>) -> Self {
        Self::new(kind, Diagnostic::error(code, message))
    }

    /// The user's input is wrong.
    pub fn input(message: impl Into<String>) -> Self {
        Self::coded(FaultKind::Input, code::INVALID_VALUE, message)
    }

    /// This window cannot be solved; a shorter one may.
    pub fn window(message: impl Into<String>) -> Self {
        Self::coded(FaultKind::Window, code::NOT_CONVERGED, message)
    }

    /// The contact solver must see nodes that are not selected.
    pub fn beyond(message: impl Into<String>) -> Self {
        Self::coded(FaultKind::Beyond, code::OTHER, message)
    }

    /// The solver cannot go on.
    pub fn broken(message: impl Into<String>) -> Self {
        Self::coded(FaultKind::Broken, code::OTHER, message)
    }

    /// The user has interrupted the solver.
    pub fn interrupted() -> Self {
        Self::coded(FaultKind::Interrupted, code::INTERRUPTED, "interrupted")
    }
}

impl From<Diagnostic> for Fault {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::new(FaultKind::Input, diagnostic)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.diagnostic.fmt(f)
    }
}

impl std::error::Error for Fault {}

/// In which direction a measure is worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Worse {
    /// A larger value is worse: forces, deflections, errors.
    Larger,
    /// A smaller value is worse: the most compressed post.
    Smaller,
    /// Neither.
    Neither,
}

/// A result of the whole run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[must_use]
pub struct Measure {
    /// Name, in `snake_case`, without the unit. No two programs may give one name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// When it occurred [s], where it has a time.
    pub time: Option<f64>,
    /// Member of a group in which it was, where it is of a group.
    pub member: Option<String>,
    /// Its place among the measures on the screen: the smallest are shown first. Those that decide have ranks below
    /// [`Measure::ORDINARY`].
    pub rank: u16,
    /// In which direction it is worse.
    pub worse: Worse,
    /// Program that gave it; empty: the one that sends it.
    pub source: String,
    /// How far it may be off. Whoever judges the whole run fills it in: it does not cross the interface.
    #[serde(skip)]
    pub uncertainty: Option<Uncertainty>,
    /// Of a statistic of many runs where the true one lies, with a confidence of 95 %. It does not cross the interface either.
    #[serde(skip)]
    pub interval: Option<Interval>,
}

/// Where a statistic lies that is known from a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Its ends; `None`: the sample is too small for one.
    pub low: Option<f64>,
    /// The upper one.
    pub high: Option<f64>,
}

impl Interval {
    /// Both ends, where the sample is large enough.
    pub fn ends(&self) -> Option<[f64; 2]> {
        Some([self.low?, self.high?])
    }
}

/// How far a measure may be off, either way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// In the unit of the measure; `None`: not known.
    pub value: Option<f64>,
    /// How it was found.
    pub by: Found,
    /// Whether it is above its bound of `[limits]`: then the measure is not to be trusted.
    pub beyond: bool,
}

/// How an uncertainty was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// Estimated from the balance of energy up to the time of the measure, and from how forces swing about it.
    Estimate,
    /// From a second run with half the steps.
    Refinement,
    /// Not known: it depends on what tore before, which small differences decide.
    Rupture,
    /// Not known: the rock slipped through meshes of the net, or was still being stopped at the end, and small differences decide
    /// between which wires it passed.
    Passage,
    /// From how far a reaction swings about its mean over 10 ms: posts and ropes that slide vibrate, hardly damped, and small
    /// differences decide how large a peak is. No step makes that smaller.
    Vibration,
}

impl Measure {
    /// Rank of a measure that matters no more than others.
    pub const ORDINARY: u16 = 1000;

    /// A measure of ordinary rank, without time and member.
    pub fn new(name: impl Into<String>, value: f64, unit: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value,
            unit: unit.into(),
            time: None,
            member: None,
            rank: Self::ORDINARY,
            worse: Worse::Neither,
            source: String::new(),
            uncertainty: None,
            interval: None,
        }
    }

    /// The same at this time [s], where there is one.
    pub fn at(mut self, time: impl Into<Option<f64>>) -> Self {
        self.time = time.into();
        self
    }

    /// The same of this member of a group.
    pub fn of_member(mut self, member: Option<String>) -> Self {
        self.member = member;
        self
    }

    /// The same with this place on the screen, and worse in this direction.
    pub fn ranked(mut self, rank: u16, worse: Worse) -> Self {
        (self.rank, self.worse) = (rank, worse);
        self
    }
}

/// What a solver did in the run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Results of the committed windows.
    pub measures: Vec<Measure>,
    /// What became of each rock, from a contact solver.
    pub verdicts: Vec<Verdict>,
    /// What tore of the structure, a part each, in the order of their first ruptures; `None`: nothing of it can.
    pub torn: Option<Vec<Torn>>,
    /// How far each part of the structure was used, the largest utilisation first; `None`: it does not say.
    pub parts: Option<Vec<PartUse>>,
    /// Counts of work done and work skipped, by name.
    pub counts: Vec<(String, u64)>,
    /// What the user should know; also each expected measure that is absent, with the reason.
    pub warnings: Vec<Diagnostic>,
    /// Seconds of processor time; 0 = not reported.
    pub cpu_seconds: f64,
    /// Wall seconds inside `solve` and `commit`; 0 = not reported.
    pub solve_seconds: f64,
    /// Largest memory in use [bytes]; 0 = not reported.
    pub peak_memory: u64,
    /// None in this version.
    pub options: NamedValues,
}

/// Why a message could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DecodeError {
    /// The other side speaks another version of the contract (`None`: the message is empty).
    Protocol(Option<u8>),
    /// The bytes are not such a message.
    Malformed(String),
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Protocol(Some(v)) => {
                write!(
                    f,
                    "speaks protocol {v}, this program speaks protocol {PROTOCOL}; use matching versions"
                )
            }
            Self::Protocol(None) => f.write_str("sent an empty message"),
            Self::Malformed(why) => write!(f, "sent a message that cannot be read: {why}"),
        }
    }
}

impl std::error::Error for DecodeError {}

/// Encode a [`ToSolver`] or [`FromSolver`]: version byte, then bincode.
pub fn encode<M: Serialize>(message: &M) -> Vec<u8> {
    let mut bytes = vec![PROTOCOL];
    append(message, &mut bytes);
    bytes
}

/// Decode what [`encode`] wrote.
///
/// # Errors
/// A message of another version, an empty one, and bytes that are no such message.
pub fn decode<M: DeserializeOwned>(bytes: &[u8]) -> Result<M, DecodeError> {
    match bytes.split_first() {
        Some((&PROTOCOL, rest)) => unpack(rest),
        other => Err(DecodeError::Protocol(other.map(|(version, _)| *version))),
    }
}

/// Of a message of a solver that cannot be read: which one it is, in which of its fields, and from which byte on.
pub fn broken_at(bytes: &[u8]) -> Option<String> {
    let variant = u32::from_le_bytes(bytes.get(1..5)?.try_into().ok()?);
    let (mut at, all) = (5, bytes.len());
    macro_rules! walk {
        ($message:ident { $($field:ident: $kind:ty),+ }) => {{
            // A field that is forgotten here does not compile.
            let _ = |$message { $($field),+ }: $message| { $(let _: $kind = $field;)+ };
            $(match length_of::<$kind>(&bytes[at..]) {
                Some(length) => at += length,
                None => {
                    let (message, field) = (stringify!($message), stringify!($field));
                    return Some(format!("it is a {message}, whose field \"{field}\" does not fit from byte {at} of {all} on"));
                }
            })+
            stringify!($message)
        }};
    }
    let message = match variant {
        0 => walk!(Hello {
            program: String, capabilities: Vec<String>, scene: String, repeats: Option<f64>, takes: Vec<FieldSpec>,
            gives: Vec<FieldSpec>, largest_window: f64, options: NamedValues
        }),
        2 => walk!(Ready {
            mesh: InterfaceMesh, gauges: Vec<Gauge>, initial: Vec<f64>, warnings: Vec<Diagnostic>, more_meshes: Vec<InterfaceMesh>,
            options: NamedValues
        }),
        _ => return Some(format!("it is message {variant} in {all} bytes")),
    };
    Some(format!("it is a {message} that ends at byte {at} of {all}"))
}

/// Bytes of such a value at the beginning of `bytes`.
fn length_of<T: DeserializeOwned>(bytes: &[u8]) -> Option<usize> {
    let config = bincode::config::standard().with_fixed_int_encoding().with_limit::<MIDDLE>();
    bincode::serde::decode_from_slice::<T, _>(bytes, config).ok().map(|(_, read)| read)
}

/// [`pack`] behind what `bytes` hold.
pub fn append<T: Serialize>(value: &T, bytes: &mut Vec<u8>) {
    let config = bincode::config::standard().with_fixed_int_encoding();
    bincode::serde::encode_into_std_write(value, bytes, config).expect("writing to memory cannot fail");
}

/// Bytes of something that a program keeps for itself, without a version.
pub fn pack<T: Serialize>(value: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    append(value, &mut bytes);
    bytes
}

/// Bounds of memory for what is read [bytes]: messages in words, meshes of some 100 000 and some ten million nodes, states of runs.
const SHORT: usize = 1 << 16;
const MIDDLE: usize = 1 << 24;
const LONG: usize = 1 << 30;
const LONGEST: usize = 1 << 33;

/// What [`pack`] made, all of it. A length that the bytes claim takes memory up to the bound above their own length at most.
pub fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, DecodeError> {
    let config = bincode::config::standard().with_fixed_int_encoding();
    // The memory that a text takes is bounded before its bytes are looked for, and the bound is a part of the type.
    let decoded = match bytes.len() {
        0..SHORT => bincode::serde::decode_from_slice(bytes, config.with_limit::<SHORT>()),
        SHORT..MIDDLE => bincode::serde::decode_from_slice(bytes, config.with_limit::<MIDDLE>()),
        MIDDLE..LONG => bincode::serde::decode_from_slice(bytes, config.with_limit::<LONG>()),
        LONG.. => bincode::serde::decode_from_slice(bytes, config.with_limit::<LONGEST>()),
    };
    let (value, read) = decoded.map_err(|e| DecodeError::Malformed(e.to_string()))?;
    if read != bytes.len() {
        return Err(DecodeError::Malformed(format!("{} bytes are left over", bytes.len() - read)));
    }
    Ok(value)
}
