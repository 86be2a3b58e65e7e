//! Seeds that this version writes itself: messages, states, journals, and a run that goes on.

use coupler::coupling::{Committed, Coupling, KeptRun, Observer};
use coupler::settings::CouplingSettings;
use coupler::side::Side;
use dem_solver::study::path_quantity::PathPoint;
use dem_solver::study::record::Journal;
use dem_solver::study::record::{Outcome, Record};
use dem_solver::study::track::{Crossing, Track, Visit};
use in_process::{Any, InProcess};
use interface_defs::Diagnostic;
use interface_defs::message::{Fault, FromSolver, Hello, Measure, Plan, Ready, Statistics, ToSolver, encode};
use interface_defs::message::{pack, unpack};
use std::ops::Range;
use std::path::Path;
use std::sync::OnceLock;
use toolkit::checkpoint::{Store, Subject};
use toolkit::program::Options;
use toolkit::provenance::{self, build_id};
use toolkit::scene::Scene;
use toolkit::summary::{RunStatus, Summary};

/// Places in a state file: its mark and version, the hash of what follows.
pub(super) struct Places {
    mark: Range<usize>,
    pub(super) version: Range<usize>,
    content: usize,
}
pub(super) const STATE: Places = Places { mark: 0..8, version: 8..12, content: 44 };
/// Version of `structure.state`.
pub(super) const STRUCTURE: u32 = 1;
/// What stands in a seed for the program that reads it: fuzzers are programs of their own.
const ANY_PROGRAM: &[u8] = b"@@@@@@@@@@@@@@@@@@@@@@@@@@@@@@@@";
/// The one file of the directory that a manifest is of.
pub(super) const HISTORY: &str = "time_s\n0\n1\n";

fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let mut at = 0;
    while at + from.len() <= bytes.len() {
        if bytes[at..].starts_with(from) {
            bytes[at..at + from.len()].copy_from_slice(to);
            at += from.len();
        } else {
            at += 1;
        }
    }
    bytes
}

/// A seed as this program would have written it.
pub(super) fn with_own_program(bytes: &[u8]) -> Vec<u8> {
    replaced(bytes, ANY_PROGRAM, build_id().program.as_bytes())
}

fn with_any_program(bytes: &[u8]) -> Vec<u8> {
    replaced(bytes, build_id().program.as_bytes(), ANY_PROGRAM)
}

/// What is behind the hash of each of these state files.
pub(super) fn contents(files: &[Vec<u8>]) -> Vec<Vec<u8>> {
    files.iter().map(|file| with_any_program(&file[STATE.content..])).collect()
}

/// The state file with this content.
pub(super) fn sealed(version: u32, content: &[u8]) -> Vec<u8> {
    let text = provenance::hash(content);
    let digits = text.strip_prefix("blake3:").expect("a hash").as_bytes();
    let hash = digits
        .chunks(2)
        .map(|two| u8::from_str_radix(std::str::from_utf8(two).expect("digits"), 16).expect("a number"));
    let mut bytes = checkpoint()[0][STATE.mark].to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend(hash);
    bytes.extend(content);
    bytes
}

pub(super) fn from_solver() -> Vec<Vec<u8>> {
    let hello = Hello { program: "dem-solver 1".into(), ..Hello::default() };
    let measure = Measure::new("a", 1.0, "m");
    let statistics = Statistics { measures: vec![measure], ..Statistics::default() };
    let messages = [
        FromSolver::Hello(hello),
        FromSolver::Ready(Ready::default()),
        FromSolver::Fault(Fault::broken("it broke")),
        FromSolver::Statistics(statistics),
        FromSolver::Saved { state: vec![1; 9] },
        FromSolver::Resumed,
    ];
    messages.iter().map(encode).collect()
}

pub(super) fn to_solver() -> Vec<Vec<u8>> {
    let messages = [
        ToSolver::Connect,
        ToSolver::Prepare(Plan::default()),
        ToSolver::Finish { commit: true },
        ToSolver::Abort { reason: "interrupted".into() },
        ToSolver::Resume { state: vec![1; 9] },
    ];
    messages.iter().map(encode).collect()
}

/// Written once: a reader asks for its version at every input.
pub(super) fn checkpoint() -> Vec<Vec<u8>> {
    static MADE: OnceLock<Vec<u8>> = OnceLock::new();
    let make = || {
        let dir = tempfile::tempdir().expect("a directory");
        let parts = vec![("dem".into(), vec![1; 40]), ("fem".into(), vec![2; 40])];
        Store::new(dir.path(), Subject::default(), 1.0, None).write(0.5, parts).expect("written");
        std::fs::read(dir.path().join("checkpoint/1.state")).expect("read")
    };
    vec![MADE.get_or_init(make).clone()]
}

pub(super) fn records() -> [Record; 2] {
    let failed = Outcome::failed(Diagnostic::new("member 1"));
    let track = Track {
        visits: vec![Visit { cell: 1, values: [1.0; 4] }],
        crossings: vec![Crossing {
            at: PathPoint { time: 2.0, speed: 2.0, ..PathPoint::default() },
            ..Crossing::default()
        }],
        ..Track::default()
    };
    [1, 2].map(|number| Record { number, outcome: failed.clone(), track: track.clone() })
}

pub(super) fn journal() -> Vec<Vec<u8>> {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("a");
    let (mut journal, _) = Journal::open(&path, "study").expect("opened").expect("alone");
    for record in records() {
        journal.add(&record).expect("added");
    }
    vec![with_any_program(&std::fs::read(&path).expect("read"))]
}

pub(super) fn summary() -> Vec<Vec<u8>> {
    let dir = tempfile::tempdir().expect("a directory");
    let mut summary = Summary::ended(RunStatus::Failed, Diagnostic::new("it broke").about("rock.0.mass"));
    summary.add(Measure::new("a", 1.0, "m"));
    summary.write(dir.path()).expect("written");
    vec![std::fs::read(dir.path().join("summary.json")).expect("read")]
}

pub(super) fn manifest() -> Vec<Vec<u8>> {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("history.csv"), HISTORY).expect("written");
    toolkit::manifest::write(dir.path()).expect("written");
    vec![std::fs::read(dir.path().join("manifest.json")).expect("read")]
}

/// Keeps the state of the run after some windows, and ends it some later; a run that goes on, before its first window.
struct Few {
    goes_on: bool,
    prepared: bool,
    windows: u32,
    kept: Option<KeptRun>,
}

/// Windows before the state is kept, and windows of a run.
const KEEP: u32 = 5;
const LAST: u32 = 8;

impl Observer for Few {
    fn prepared(&mut self, _: &Side, _: &Side, _: &[Diagnostic]) -> Result<(), Diagnostic> {
        self.prepared = true;
        if self.goes_on { Err(Diagnostic::new("enough")) } else { Ok(()) }
    }
    fn is_due(&mut self, _: bool) -> bool {
        self.windows == KEEP
    }
    fn keep(&mut self, _: f64, kept: KeptRun) {
        self.kept = Some(kept);
    }
    fn committed(&mut self, _: &Committed) -> Result<(), Diagnostic> {
        self.windows += 1;
        if self.windows > LAST { Err(Diagnostic::new("enough")) } else { Ok(()) }
    }
}

/// Some windows of a sphere on a cable, from a state that was kept or from the start; results in `out`. Whether it came to its end.
fn few(from: Option<KeptRun>, sets: &[String], out: Option<&Path>) -> (Few, bool) {
    let scene = Scene::load(&crate::scene("sphere-on-cable"), sets).expect("a scene");
    let options = Options { out: out.map(Path::to_path_buf), shortcuts: true };
    let dem = (dem_solver::PROGRAM.build)(&scene, &options).expect("a solver");
    let fem = (fem_solver::PROGRAM.build)(&scene, &options).expect("a solver");
    let (mut dem, mut fem) = (InProcess::new("dem", Any(dem)), InProcess::new("fem", Any(fem)));
    let settings = CouplingSettings::of(&scene).expect("settings");
    let mut coupling = Coupling::new(settings, scene.end_time().expect("a time"), &mut dem, &mut fem);
    coupling.resume = from;
    let mut observer = Few { goes_on: coupling.resume.is_some(), prepared: false, windows: 0, kept: None };
    let ended = coupling.run(&mut observer, &mut |_| Ok(())).is_ok() && coupling.finish().is_ok();
    (observer, ended)
}

/// The state of a run that is kept, as bytes.
pub(super) fn kept_run() -> Vec<Vec<u8>> {
    let kept = few(None, &[], None).0.kept.expect("kept");
    vec![with_any_program(&pack(&(kept.dem, kept.fem, kept.coupling)))]
}

/// Prepare a run that goes on from `bytes`; whether both solvers stand where they stood then. No window is computed: how long one takes
/// that begins with numbers of nobody's run says nothing.
pub(super) fn goes_on(bytes: &[u8]) -> bool {
    let Ok((dem, fem, coupling)) = unpack::<(Vec<u8>, Vec<u8>, Vec<u8>)>(bytes) else { return false };
    few(Some(KeptRun { dem, fem, coupling }), &[], None).0.prepared
}

/// `structure.state` of a short run.
pub(super) fn structure_state() -> Vec<Vec<u8>> {
    let dir = tempfile::tempdir().expect("a directory");
    assert!(few(None, &["end_time=5e-5".to_owned()], Some(dir.path())).1, "a run of five windows");
    vec![std::fs::read(dir.path().join("structure.state")).expect("read")]
}
