//! `history.csv`: rows of numbers under a header of names with units.

use crate::message::Gauge;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Writes rows of numbers. Each row is handed to the system at once: what is written is on disk
/// even if the process is killed a moment later. Where the disk is full, the file ends with its last whole row.
pub struct History {
    file: File,
    path: PathBuf,
    columns: usize,
    row: String,
    /// Bytes of all whole rows.
    length: u64,
    looked_at: Instant,
}

/// How often is looked whether the file is still in its place.
const LOOK: Duration = Duration::from_secs(1);

/// Name of a column: `<name>_<unit>`, `/` as `_per_`; the unit `1` adds nothing.
pub fn column(name: &str, unit: &str) -> String {
    if unit.is_empty() || unit == "1" {
        name.to_owned()
    } else {
        format!("{name}_{}", unit.replace('/', "_per_"))
    }
}

/// Name of a gauge's column.
pub fn gauge_column(gauge: &Gauge) -> String {
    column(&gauge.name, &gauge.unit)
}

impl History {
    /// Create the file (an old one is overwritten) with a header of `columns`.
    pub fn create(path: &Path, columns: &[String]) -> io::Result<Self> {
        let mut header = csv::Writer::from_writer(Vec::new());
        header.write_record(columns).map_err(io::Error::from)?;
        let header = header.into_inner().map_err(|e| e.into_error())?;
        let mut history = Self {
            file: File::create(path)?,
            path: path.to_owned(),
            columns: columns.len(),
            row: String::with_capacity(26 * columns.len()),
            length: 0,
            looked_at: Instant::now(),
        };
        history.append(&header)?;
        Ok(history)
    }

    /// Go on with the file as it was when it had `length` bytes; what was written after that is cut off.
    pub fn go_on(path: &Path, columns: &[String], length: u64) -> io::Result<Self> {
        let mut file = File::options().read(true).write(true).open(path)?;
        let there = file.metadata()?.len();
        if there < length {
            let what = format!("it has {there} bytes, and had {length} when its run was kept");
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, what));
        }
        file.set_len(length)?;
        file.seek(SeekFrom::End(0))?;
        Ok(Self {
            file,
            path: path.to_owned(),
            columns: columns.len(),
            row: String::with_capacity(26 * columns.len()),
            length,
            looked_at: Instant::now(),
        })
    }

    /// Bytes of all whole rows, header included.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Append a row and hand it to the system. Numbers are written with the fewest digits that read
    /// back as the same number; one that is not finite leaves its field empty.
    ///
    /// Panics if the row does not fit the header.
    pub fn row(&mut self, values: &[f64]) -> io::Result<()> {
        assert_eq!(values.len(), self.columns, "a row must fit the header");
        self.row.clear();
        for value in values {
            write_number(&mut self.row, *value);
            self.row.push(',');
        }
        self.row.pop();
        self.row.push('\n');
        if self.looked_at.elapsed() > LOOK {
            self.looked_at = Instant::now();
            self.check()?;
        }
        let row = std::mem::take(&mut self.row);
        let written = self.append(row.as_bytes());
        self.row = row;
        written
    }

    /// Append all of `bytes` or nothing.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        if let Err(e) = self.file.write_all(bytes) {
            // Part of the row may be there; shorter takes no space.
            let cut =
                self.file.set_len(self.length).and_then(|()| self.file.seek(SeekFrom::Start(self.length)));
            let end =
                if cut.is_ok() { "the file ends with its last whole row" } else { "its last row is torn" };
            return Err(io::Error::new(e.kind(), format!("{e}; {end}")));
        }
        self.length += bytes.len() as u64;
        Ok(())
    }

    /// All rows are on the disk itself when this returns, and the file is still in its place.
    pub fn sync(&self) -> io::Result<()> {
        self.check()?;
        self.file.sync_data()
    }

    /// Rows of a file that was removed go nowhere, without an error of the system.
    fn check(&self) -> io::Result<()> {
        let (written, named) = (self.file.metadata()?, std::fs::metadata(&self.path));
        if named.is_ok_and(|named| (named.dev(), named.ino()) == (written.dev(), written.ino())) {
            return Ok(());
        }
        let what = format!("{} was removed or replaced while the run wrote to it", self.path.display());
        Err(io::Error::new(io::ErrorKind::NotFound, what))
    }
}

/// The shortest text that reads back as the same number; beyond 16 digits before the point, or 5 zeros
/// behind it, with an exponent.
fn write_number(out: &mut String, value: f64) {
    if value.is_finite() {
        let mut buffer = zmij::Buffer::new();
        let text = buffer.format_finite(value);
        out.push_str(text.strip_suffix(".0").unwrap_or(text));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_names_carry_the_unit() {
        assert_eq!(column("rock_vx", "m/s"), "rock_vx_m_per_s");
        assert_eq!(column("iterations", "1"), "iterations");
        assert_eq!(column("reaction_z", "N"), "reaction_z_N");
    }

    #[test]
    fn every_row_is_in_the_file_at_once_and_reads_back_bit_for_bit() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("history.csv");
        let columns = vec!["time_s".to_owned(), "a,\"b\"_m".to_owned(), "c".to_owned()];
        let mut history = History::create(&path, &columns).expect("created");
        let rows = [
            [0.1 + 0.2, -0.0, f64::MIN_POSITIVE],
            [1.0 / 3.0, 1e300, -5e-324],
            [9.999999e-6, 123456789012345680.0, 2.5],
        ];
        for (count, row) in rows.iter().enumerate() {
            history.row(row).expect("written");
            let mut reader = csv::Reader::from_path(&path).expect("read while the writer is open");
            assert_eq!(reader.headers().expect("a header").iter().collect::<Vec<_>>(), columns);
            let read: Vec<Vec<u64>> = reader
                .records()
                .map(|r| {
                    r.expect("a row").iter().map(|f| f.parse::<f64>().expect("a number").to_bits()).collect()
                })
                .collect();
            let expected: Vec<Vec<u64>> =
                rows[..=count].iter().map(|r| r.iter().map(|v| v.to_bits()).collect()).collect();
            assert_eq!(read, expected);
        }
    }

    #[test]
    fn a_file_that_is_gone_on_with_is_cut_back_to_its_length_and_goes_on_there() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("history.csv");
        let columns = ["a".to_owned(), "b".to_owned()];
        let mut history = History::create(&path, &columns).expect("created");
        history.row(&[1.0, 2.0]).expect("written");
        let kept = history.length();
        history.row(&[3.0, 4.0]).expect("written");
        drop(history);
        std::fs::OpenOptions::new()
            .append(true)
            .open(&path)
            .and_then(|mut f| f.write_all(b"5,"))
            .expect("torn");
        let mut history = History::go_on(&path, &columns, kept).expect("there");
        history.row(&[6.0, 7.0]).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("a file"), "a,b\n1,2\n6,7\n");
        assert!(History::go_on(&path, &columns, 1000).is_err());
    }

    #[test]
    fn a_number_that_is_not_finite_leaves_its_field_empty() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("history.csv");
        let mut history = History::create(&path, &["a".into(), "b".into()]).expect("created");
        history.row(&[f64::NAN, 1.0]).expect("written");
        assert_eq!(std::fs::read_to_string(path).expect("a file"), "a,b\n,1\n");
    }

    /// As on a full disk: the kernel takes a part of a row and refuses the rest.
    #[test]
    fn a_row_that_does_not_fit_is_not_torn() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("history.csv");
        // In a process of its own: the limit holds for all files of a process, those of other tests too.
        let test = std::env::current_exe().expect("this test");
        let status = std::process::Command::new(test)
            .args(["--ignored", "--exact", "toolkit::history::tests::rows_until_the_limit"])
            .env("ROCKFALL_LIMITED", &path)
            .stdout(std::process::Stdio::null())
            .status()
            .expect("started");
        assert!(status.success());
        let text = std::fs::read_to_string(&path).expect("a file");
        assert!(text.len() > 80 && text.len() <= 100 && text.ends_with('\n'), "{text}");
        assert!(text.lines().all(|line| line.split(',').count() == 3), "{text}");
    }

    #[test]
    #[ignore = "the inside of a_row_that_does_not_fit_is_not_torn"]
    fn rows_until_the_limit() {
        let path = std::env::var_os("ROCKFALL_LIMITED").expect("named by the test");
        crate::ipc::interrupt::install();
        let columns = ["a", "b", "c"].map(String::from);
        let mut history = History::create(Path::new(&path), &columns).expect("created");
        let limit = rustix::process::Rlimit { current: Some(100), maximum: Some(100) };
        rustix::process::setrlimit(rustix::process::Resource::Fsize, limit).expect("limited");
        let error = (0..100).find_map(|i| history.row(&[i as f64, 1.0 / 3.0, 2.0]).err()).expect("full");
        assert!(
            error.to_string().contains("os error") && error.to_string().contains("last whole row"),
            "{error}"
        );
    }

    #[test]
    fn rows_of_a_file_that_was_removed_are_not_lost_in_silence() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("history.csv");
        let mut history = History::create(&path, &["a".into()]).expect("created");
        history.row(&[1.0]).expect("written");
        history.sync().expect("in its place");
        std::fs::remove_file(&path).expect("removed");
        assert!(history.sync().expect_err("gone").to_string().contains("was removed or replaced"));
        history.looked_at -= 2 * LOOK;
        assert!(history.row(&[2.0]).is_err());
        std::fs::write(&path, "another").expect("written");
        assert!(history.sync().is_err());
    }

    #[test]
    fn a_row_allocates_nothing() {
        let dir = tempfile::tempdir().expect("a directory");
        let columns: Vec<String> = (0..200).map(|i| format!("c{i}")).collect();
        let mut history = History::create(&dir.path().join("history.csv"), &columns).expect("created");
        // Longest texts: 17 digits, sign, exponent.
        let row = vec![-1.234_567_890_123_456_7e-300; 200];
        history.row(&row).expect("written");
        let before = crate::toolkit::alloc::allocations();
        for _ in 0..10 {
            history.row(&row).expect("written");
        }
        assert_eq!(crate::toolkit::alloc::allocations(), before);
    }
}
