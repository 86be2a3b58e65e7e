//! Files of records: members as they are computed, one frame behind the other, whole whenever the process ends.
//!
//! A file begins with a line that says which study it belongs to, and with the build and the layout of its records. What a killed
//! process has left of a frame is cut off.

use super::record::Record;
use interface_defs::diagnostic::{Code, Diagnostic, code};
use std::fs::{File, TryLockError};
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use toolkit::files::{self, Dir, Stream};
use toolkit::provenance::{self, Reader};

/// What a file begins with.
const MAGIC: &str = "rockfall members 2";
/// How often what was written is made to outlast a power cut.
const SYNC: Duration = Duration::from_secs(1);
/// Longest frame that is read [bytes].
const LONGEST: u64 = 1 << 32;

/// That the journal at `path` cannot be used.
fn refused(path: &Path, code: Code, what: impl Into<String>) -> Diagnostic {
    Diagnostic::in_file(path.display().to_string(), what).coded(code)
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
    [format!("{MAGIC} {fingerprint}\n").into_bytes(), provenance::head::<Record>()].concat()
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
    let line = own.len() - provenance::head::<Record>().len();
    if !begins.starts_with(&own[..line]) {
        return Err(refused(path, code::PROVENANCE, "belongs to another study, scene or terrain"));
    }
    provenance::open::<Record>(&begins[line..], Reader::SameBuild)
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
    let mut length = [0; 8];
    match reader.read_exact(&mut length) {
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
        other => other?,
    }
    let content = u64::from_le_bytes(length);
    if content > LONGEST {
        return Ok(None);
    }
    frame.clear();
    frame.extend(length);
    reader.take(content + 8).read_to_end(frame)?;
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
    use crate::record::Outcome;
    use crate::track::Track;

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
