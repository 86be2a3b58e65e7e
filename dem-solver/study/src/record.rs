//! What is kept of a member, from which all its quantities follow ([`super::quantity`]); and the files of such records.
//!
//! In a file members stand as they are computed, one frame (length, content as in messages, a hash of both) behind the other, whole
//! whenever the process ends. It begins with a line that says which study it belongs to, and with the build and the layout of its
//! records. What a killed process has left of a frame is cut off.

use super::base::Base;
use super::grid::Grid;
use super::settings::of_falls;
use super::track::Track;
use dem_rocks::model::Model;
use dem_rocks::model::runout::RunOut;
use interface_defs::diagnostic::{Code, Diagnostic, code};
use interface_defs::ipc::run_id::fnv1a;
use interface_defs::message::{pack, unpack};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fs::{File, TryLockError};
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use toolkit::files::{self, Dir, Stream};
use toolkit::provenance;
use toolkit::scene::Scene;
use toolkit::summary::RunStatus;

/// A hash of all that a member's record depends on: study, scene, terrain, spheres, program. What is judged afterwards is not in it.
pub fn fingerprint(base: &Base, file: &Scene) -> Result<String, Diagnostic> {
    let mut bytes = format!("{} {} ", env!("CARGO_PKG_VERSION"), base.shortcuts).into_bytes();
    bytes.extend(format!("{} {} ", of_falls(file.document()?), base.scene.fingerprint()).into_bytes());
    let mut take = |n: f64| bytes.extend(n.to_bits().to_le_bytes());
    // They may be in files.
    let releases = base.study.releases.iter().map(|release| release.place().corners);
    let lines = base.study.lines.iter().map(|line| &line.points[..]);
    releases.chain(lines).flatten().flatten().for_each(|n| take(*n));
    for rock in base.prototypes.iter().map(|p| &p.rock) {
        rock.spheres.iter().flat_map(|s| [s.centre.x, s.centre.y, s.centre.z, s.radius]).for_each(&mut take);
        take(rock.mass);
        rock.inertia.iter().for_each(|n| take(*n));
    }
    bytes.extend(base.ground.content().as_bytes());
    bytes.extend(&base.ground.zones);
    Ok(format!("{:016x}", fnv1a(&bytes)))
}

interface_defs::worded! {
    /// How a member ended.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub enum How with word {
        /// It was not computed to an end.
        #[default]
        None = "",
        /// At rest on the terrain.
        Rest = "rest",
        /// It left the terrain.
        Out = "left",
        /// It still moved when the time was over.
        Moving = "moving",
    }
}

/// What became of a member. Lengths in m.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Whether it is to be trusted.
    pub status: RunStatus,
    /// How it ended.
    pub how: How,
    /// Where its centre of mass started.
    pub start: [f64; 3],
    /// Its velocity there.
    pub velocity: [f64; 3],
    /// Its orientation there.
    pub orientation: [f64; 4],
    /// Its angular velocity there [rad/s].
    pub spin: [f64; 3],
    /// Its volume [m3].
    pub volume: f64,
    /// Its mass [kg].
    pub mass: f64,
    /// Where it ended.
    pub end: [f64; 3],
    /// Its velocity there.
    pub end_velocity: [f64; 3],
    /// When it ended [s].
    pub time: f64,
    /// What was followed on its course.
    pub path: RunOut,
    /// Deepest overlap over the radius.
    pub penetration: f64,
    /// Largest imbalance of energy over that of the largest impact.
    pub energy_error: f64,
    /// Why it is not to be trusted.
    pub fault: Option<Diagnostic>,
}

impl Outcome {
    /// Of a member that could not start.
    pub fn failed(fault: Diagnostic) -> Self {
        Self { status: RunStatus::Failed, fault: Some(fault), ..Self::default() }
    }

    /// Of one that starts as `model` has it.
    pub fn of_start(model: &Model) -> Self {
        let (rock, table) = (&model.rocks[0], &model.settings.rocks[0]);
        Self {
            start: table.position,
            velocity: table.velocity,
            orientation: table.orientation,
            spin: table.angular_velocity,
            volume: rock.solid.volume(),
            mass: rock.mass,
            ..Self::default()
        }
    }

    /// It could not be computed to its end.
    pub fn fail(&mut self, fault: Diagnostic) {
        (self.status, self.fault) = (RunStatus::Failed, Some(fault));
    }

    /// How far its end is from its start, seen from above [m].
    pub fn run_out(&self) -> f64 {
        let moved = Vector3::from(self.end) - Vector3::from(self.start);
        moved.xy().norm()
    }

    /// Share of its time in which it touched.
    pub fn contact_time_fraction(&self) -> f64 {
        if self.time > 0.0 { self.path.in_contact / self.time } else { 0.0 }
    }

    /// Why it is not to be trusted, in words.
    pub fn message(&self) -> String {
        self.fault.as_ref().map(Diagnostic::to_string).unwrap_or_default()
    }
}

/// A member with what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its number, from 1.
    pub number: u64,
    /// What is kept of its trajectory.
    pub track: Track,
    /// What became of it.
    pub outcome: Outcome,
}

/// Calls what it is given with every record, in order.
pub type All<'a> = &'a mut dyn FnMut(&mut dyn FnMut(&Record) -> io::Result<()>) -> io::Result<()>;

/// Bytes of a frame before its content, and after it.
const HEAD: usize = 8;
const TAIL: usize = 8;

impl Record {
    /// The frame: its length, its content, a hash of both.
    pub fn frame(&self) -> Vec<u8> {
        let content = pack(self);
        let mut bytes = (content.len() as u64).to_le_bytes().to_vec();
        bytes.extend(content);
        let hash = fnv1a(&bytes);
        bytes.extend(hash.to_le_bytes());
        bytes
    }

    /// The record at the start of `bytes`, and the length of its frame; `None` where they do not begin with a whole one.
    pub fn read(bytes: &[u8]) -> Option<(Self, usize)> {
        let length = u64::from_le_bytes(*bytes.first_chunk::<HEAD>()?);
        let whole = usize::try_from(length).ok()?.checked_add(HEAD + TAIL)?;
        let (content, hash) = bytes.get(..whole)?.split_last_chunk::<TAIL>()?;
        if fnv1a(content) != u64::from_le_bytes(*hash) {
            return None;
        }
        Some((unpack(&content[HEAD..]).ok()?, whole))
    }

    /// Whether its cells and lines are those of the study: a file may have been made by others.
    pub fn fits(&self, base: &Base) -> bool {
        let cells = base.grid.as_ref().map_or(0, Grid::cells);
        self.track.visits.iter().all(|visit| (visit.cell as usize) < cells)
            && self.track.crossings.iter().all(|crossing| usize::from(crossing.line) < base.lines.len())
    }
}

/// What a file begins with.
const MAGIC: &str = "rockfall members 2";
/// How often what was written is made to outlast a power cut.
const SYNC: Duration = Duration::from_secs(1);
/// Longest frame that is read [bytes].
const LONGEST: u64 = 1 << 32;

/// That the journal at `path` cannot be used.
fn refused(path: &Path, code: Code, what: impl Into<String>) -> Diagnostic {
    Diagnostic::in_file(path.display(), what).coded(code)
}

/// That another process writes to the journal at `path`.
pub fn taken(path: &Path) -> Diagnostic {
    refused(path, code::OTHER, "another process is computing these members")
}

fn fault(path: &Path) -> impl Fn(io::Error) -> Diagnostic {
    move |e| refused(path, code::FILE, format!("cannot be read or written: {e}"))
}

/// What a file of this study begins with: a line, then what wrote its records.
fn head(fingerprint: &str) -> Vec<u8> {
    [format!("{MAGIC} {fingerprint}\n").into_bytes(), provenance::head()].concat()
}

/// A record's place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Found {
    /// Number of the member.
    pub number: u64,
    /// Where its frame begins [bytes].
    pub at: u64,
}

/// All whole frames of the file at `path`, and where they end. A file without a whole head ends at 0.
fn scan(file: &File, path: &Path, fingerprint: &str) -> Result<(Vec<Found>, u64), Diagnostic> {
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let (own, mut begins) = (head(fingerprint), Vec::new());
    reader.by_ref().take(own.len() as u64).read_to_end(&mut begins).map_err(fault(path))?;
    if begins.len() < own.len() && own.starts_with(&begins) {
        return Ok((Vec::new(), 0));
    }
    let line = own.len() - provenance::head().len();
    if !begins.starts_with(&own[..line]) {
        return Err(refused(path, code::PROVENANCE, "belongs to another study, scene or terrain"));
    }
    provenance::open(&begins[line..])
        .map_err(|of_another| refused(path, of_another.code, of_another.message))?;
    let (mut found, mut at) = (Vec::new(), own.len() as u64);
    let mut frame = Vec::new();
    while let Some(record) = next(&mut reader, &mut frame).map_err(fault(path))? {
        found.push(Found { number: record.number, at });
        at += frame.len() as u64;
    }
    Ok((found, at))
}

/// The next whole frame.
fn next(reader: &mut impl Read, frame: &mut Vec<u8>) -> io::Result<Option<Record>> {
    frame.clear();
    reader.by_ref().take(HEAD as u64).read_to_end(frame)?;
    let length = frame.first_chunk::<HEAD>().map(|length| u64::from_le_bytes(*length));
    let Some(length) = length.filter(|length| *length <= LONGEST) else { return Ok(None) };
    reader.take(length + TAIL as u64).read_to_end(frame)?;
    Ok(Record::read(frame).map(|(record, _)| record))
}

/// The records of a complete file.
pub fn complete(path: &Path, fingerprint: &str) -> Result<Vec<Found>, Diagnostic> {
    Ok(scan(&files::source(path).map_err(fault(path))?, path, fingerprint)?.0)
}

/// Reads records of a file, best in their order.
pub struct Records {
    reader: BufReader<File>,
    frame: Vec<u8>,
}

impl Records {
    /// Of a file.
    pub fn open(path: &Path) -> io::Result<Self> {
        Ok(Self { reader: BufReader::with_capacity(1 << 16, files::source(path)?), frame: Vec::new() })
    }

    /// The record at a place.
    pub fn at(&mut self, at: u64) -> io::Result<Record> {
        let here = self.reader.stream_position()?;
        // Within what is in memory already nothing is read again.
        self.reader.seek_relative(at as i64 - here as i64)?;
        next(&mut self.reader, &mut self.frame)?
            .ok_or_else(|| io::Error::other("a record that was there is damaged"))
    }
}

/// A file that records are added to.
pub struct Journal {
    path: PathBuf,
    file: Stream,
    end: u64,
    synced: Instant,
}

impl Journal {
    /// Create a file, or go on with it: its records, what is left of half a frame cut off. `None`: another process writes to it.
    pub fn open(path: &Path, fingerprint: &str) -> Result<Option<(Self, Vec<Found>)>, Diagnostic> {
        let mut file = files::append(path).map_err(fault(path))?;
        // On a file system without locks two processes at one chunk write the same bytes.
        if let Err(TryLockError::WouldBlock) = file.file().try_lock() {
            return Ok(None);
        }
        let (found, mut end) = scan(file.file(), path, fingerprint)?;
        file.cut(end).map_err(fault(path))?;
        if end == 0 {
            let head = head(fingerprint);
            file.write_all(&head).map_err(fault(path))?;
            end = head.len() as u64;
        }
        Ok(Some((Self { path: path.to_owned(), file, end, synced: Instant::now() }, found)))
    }

    /// Add a record; where it stands.
    pub fn add(&mut self, record: &Record) -> io::Result<Found> {
        let frame = record.frame();
        let found = Found { number: record.number, at: self.end };
        self.file.write_all(&frame)?;
        self.end += frame.len() as u64;
        if self.synced.elapsed() >= SYNC {
            self.file.sync()?;
            self.synced = Instant::now();
        }
        Ok(found)
    }

    /// Make what was written outlast a power cut.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync()
    }

    /// It is complete: give it its name, which nobody sees before.
    pub fn finish(self, name: &Path) -> io::Result<()> {
        self.file.sync()?;
        std::fs::rename(&self.path, name)?;
        Dir::open(name.parent().unwrap_or(name))?.sync()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path_quantity::PathPoint;
    use crate::track::{Crossing, Track, Visit};

    #[test]
    fn a_record_is_read_as_it_was_written_and_half_of_one_is_none() {
        let mut outcome = Outcome::failed(Diagnostic::new("why, \"so\"").try_instead("that"));
        outcome.how = How::Moving;
        (outcome.time, outcome.path.impacts) = (2.5, 7);
        (outcome.end, outcome.mass) = ([0.25, -1.0, 7.0], 3.5);
        let track = Track {
            visits: vec![
                Visit { cell: 3, values: [1.0, 2.0, 0.5, 4.0] },
                Visit { cell: 9, values: [0.0; 4] },
            ],
            crossings: vec![Crossing {
                line: 1,
                along: 0.25,
                at: PathPoint { speed: 4.0, ..PathPoint::default() },
            }],
            path: vec![[1.0, 2.0, 3.0, 4.0]; 3],
        };
        let record = Record { number: 42, outcome, track };
        let frame = record.frame();
        assert_eq!(Record::read(&frame), Some((record.clone(), frame.len())));
        assert_eq!(Record::read(&[frame.clone(), vec![1, 2, 3]].concat()), Some((record, frame.len())));
        for cut in 0..frame.len() {
            assert_eq!(Record::read(&frame[..cut]), None, "{cut}");
        }
        for at in 0..frame.len() {
            let mut damaged = frame.clone();
            damaged[at] ^= 4;
            assert_eq!(Record::read(&damaged), None, "{at}");
        }
    }

    /// A frame of somebody who knows the hash: each count in it claims all that a number can say.
    #[test]
    fn a_frame_with_hostile_lengths_is_none() {
        let record =
            Record { number: 1, outcome: Outcome::failed(Diagnostic::new("x")), track: Track::default() };
        let frame = record.frame();
        for at in (0..frame.len() - TAIL).filter(|at| at + 8 <= frame.len() - TAIL) {
            for length in [u64::MAX, i64::MAX as u64, 1 << 40] {
                let mut hostile = frame[..frame.len() - TAIL].to_vec();
                hostile[at..at + 8].copy_from_slice(&length.to_le_bytes());
                hostile.extend(fnv1a(&hostile).to_le_bytes());
                // Some of these are other numbers of the record.
                let _ = Record::read(&hostile);
            }
        }
        let mut hostile = frame[..HEAD + 8].to_vec();
        hostile.extend([0xff; 8]);
        hostile[..HEAD].copy_from_slice(&16_u64.to_le_bytes());
        hostile.extend(fnv1a(&hostile).to_le_bytes());
        assert_eq!(Record::read(&hostile), None);
    }

    fn record(number: u64) -> Record {
        Record {
            number,
            outcome: Outcome::failed(Diagnostic::new(format!("member {number}"))),
            track: Track::default(),
        }
    }

    /// Cut at every length a journal goes on to the same bytes as one that was never cut.
    #[test]
    fn a_journal_that_was_cut_anywhere_goes_on_to_the_same_bytes() {
        let temp = tempfile::tempdir().expect("a directory");
        let (whole, cut) = (temp.path().join("whole"), temp.path().join("cut"));
        let (mut journal, found) = Journal::open(&whole, "abc").expect("opened").expect("free");
        assert!(found.is_empty());
        let places: Vec<Found> = (1..=3).map(|n| journal.add(&record(n)).expect("added")).collect();
        drop(journal);
        let bytes = std::fs::read(&whole).expect("read");
        assert_eq!(complete(&whole, "abc").expect("whole"), places);
        for length in 0..=bytes.len() {
            std::fs::write(&cut, &bytes[..length]).expect("written");
            let (mut journal, found) =
                Journal::open(&cut, "abc").unwrap_or_else(|e| panic!("{length}: {e:?}")).expect("free");
            assert_eq!(found, places[..found.len()]);
            for n in found.len()..3 {
                journal.add(&record(n as u64 + 1)).expect("added");
            }
            drop(journal);
            assert_eq!(std::fs::read(&cut).expect("read"), bytes, "{length}");
        }
        let mut records = Records::open(&whole).expect("opened");
        for at in [2, 0, 1] {
            assert_eq!(records.at(places[at].at).expect("there"), record(places[at].number));
        }
    }

    #[test]
    fn a_journal_of_another_study_or_of_a_running_process_is_refused() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("a");
        let (journal, _) = Journal::open(&path, "abc").expect("opened").expect("free");
        assert!(Journal::open(&path, "abc").expect("read").is_none());
        drop(journal);
        assert!(Journal::open(&path, "abd").is_err_and(|e| e.code == code::PROVENANCE));
        assert!(complete(&path, "abd").is_err_and(|e| e.code == code::PROVENANCE));
    }

    #[test]
    fn a_journal_of_another_build_is_refused_and_names_both() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("a");
        drop(Journal::open(&path, "abc").expect("opened"));
        let mut bytes = std::fs::read(&path).expect("read");
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        std::fs::write(&path, &bytes).expect("written");
        let refused = Journal::open(&path, "abc").err().expect("refused");
        let (own, theirs) = (&provenance::build_id().program, String::from_utf8_lossy(&bytes[last - 31..]));
        assert_eq!(refused.code, code::PROVENANCE);
        assert!(refused.message.contains(own) && refused.message.contains(&*theirs), "{refused}");
        assert_eq!(std::fs::read(&path).expect("read"), bytes, "nothing is changed");
    }

    /// A length that no file has, and one of a record that nothing follows: the frames end there.
    #[test]
    fn hostile_lengths_end_a_journal() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("a");
        let (mut journal, _) = Journal::open(&path, "abc").expect("opened").expect("free");
        let first = journal.add(&record(1)).expect("added");
        drop(journal);
        let whole = std::fs::read(&path).expect("read");
        for length in [u64::MAX, LONGEST, 1 << 31, 0] {
            std::fs::write(&path, [&whole[..], &length.to_le_bytes(), &[7; 20]].concat()).expect("written");
            assert_eq!(complete(&path, "abc").expect("read"), [first], "{length}");
        }
        std::fs::remove_file(&path).expect("removed");
        std::os::unix::fs::symlink(temp.path().join("elsewhere"), &path).expect("a link");
        assert!(Journal::open(&path, "abc").is_err() && !temp.path().join("elsewhere").exists());
    }
}
