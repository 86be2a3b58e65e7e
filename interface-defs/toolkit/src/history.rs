//! `history.csv`: rows of numbers under a header of names with units.

use super::files::{self, Stream};
use super::provenance::{Running, hash_of};
use interface_defs::{Diagnostic, Gauge, code};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::io::{self, Read, Write};
use std::path::Path;
use std::time::{Duration, Instant};

/// Writes rows of numbers. Each row is handed to the system at once: what is written is on disk
/// even if the process is killed a moment later. Where the disk is full, the file ends with its last whole row.
pub struct History {
    file: Stream,
    columns: usize,
    row: String,
    /// Bytes of all whole rows.
    length: u64,
    /// Their hash.
    hash: Running,
    looked_at: Instant,
}

/// A file as it was when its run was kept.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mark {
    /// Bytes of all whole rows, header included.
    pub length: u64,
    /// Their hash.
    pub hash: String,
}

/// How often is looked whether the file is still in its place.
const LOOK: Duration = Duration::from_secs(1);

/// Name of a column: `<name>_<unit>`, `/` as `_per_`, `*` as `_`; the unit `1` adds nothing.
pub fn column(name: &str, unit: &str) -> String {
    if unit.is_empty() || unit == "1" {
        name.to_owned()
    } else {
        format!("{name}_{}", unit.replace('/', "_per_").replace('*', "_").replace(' ', ""))
    }
}

/// A text as it may stand in a cell of a table: a spreadsheet takes one that begins with `=`, `+`, `-`, `@`, a tab or a carriage
/// return for a formula and computes it, unless an apostrophe stands before it. Numbers are no such texts.
pub fn csv_text(text: &str) -> Cow<'_, str> {
    match text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err() {
        true => format!("'{text}").into(),
        false => text.into(),
    }
}

/// Name of a gauge's column.
pub fn gauge_column(gauge: &Gauge) -> String {
    column(&gauge.name, &gauge.unit)
}

impl History {
    /// Create the file (an old one is replaced) with a header of `columns`.
    pub fn create(path: &Path, columns: &[String]) -> io::Result<Self> {
        let mut header = csv::Writer::from_writer(Vec::new());
        header
            .write_record(columns.iter().map(|name| csv_text(name).into_owned()))
            .map_err(io::Error::from)?;
        let header = header.into_inner().map_err(|e| e.into_error())?;
        let mut history = Self::of(files::create(path)?, columns, 0, Running::default());
        history.append(&header)?;
        Ok(history)
    }

    /// Go on with the file as it was when it had the `mark`; what was written after that is cut off. An error of kind
    /// [`code::PROVENANCE`] ([`files::fault`]) if it was changed since.
    pub fn go_on(path: &Path, columns: &[String], mark: &Mark) -> io::Result<Self> {
        let (hash, length) = hash_of(files::source(path)?.take(mark.length))?;
        if (length, hash.text()) != (mark.length, mark.hash.clone()) {
            let Mark { length, .. } = mark;
            let what = format!(
                "its first {length} bytes are not those that its run wrote: it was changed or cut since"
            );
            let refused = Diagnostic::in_file(path.display(), what).coded(code::PROVENANCE);
            return Err(io::Error::other(refused.try_instead("run it anew with --force")));
        }
        Ok(Self::of(files::reopen(path, length)?, columns, length, hash))
    }

    fn of(file: Stream, columns: &[String], length: u64, hash: Running) -> Self {
        let row = String::with_capacity(26 * columns.len());
        Self { file, columns: columns.len(), row, length, hash, looked_at: Instant::now() }
    }

    /// What is written so far, for whoever goes on from here.
    pub fn mark(&self) -> Mark {
        Mark { length: self.length, hash: self.hash.text() }
    }

    /// Append a row and hand it to the system. Numbers are written with the fewest digits that read
    /// back as the same number; one that is not finite leaves its field empty.
    ///
    /// Panics if the row does not fit the header.
    pub fn row(&mut self, values: &[f64]) -> io::Result<()> {
        assert_eq!(values.len(), self.columns, "a row must fit the header");
        let _span = interface_defs::profile!("write row");
        self.row.clear();
        for value in values {
            write_number(&mut self.row, *value);
            self.row.push(',');
        }
        self.row.pop();
        self.row.push('\n');
        if self.looked_at.elapsed() > LOOK {
            self.looked_at = Instant::now();
            self.file.check()?;
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
            let end = match self.file.cut(self.length) {
                Ok(()) => "the file ends with its last whole row",
                Err(_) => "its last row is torn",
            };
            return Err(io::Error::new(e.kind(), format!("{e}; {end}")));
        }
        self.length += bytes.len() as u64;
        self.hash.add(bytes);
        Ok(())
    }

    /// All rows are on the disk itself when this returns, and the file is still in its place.
    pub fn sync(&self) -> io::Result<()> {
        self.file.check()?;
        self.file.sync()
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
        assert_eq!(column("posts_bending_moment", "N m"), "posts_bending_moment_Nm");
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
        let kept = history.mark();
        history.row(&[3.0, 4.0]).expect("written");
        drop(history);
        std::fs::OpenOptions::new()
            .append(true)
            .open(&path)
            .and_then(|mut f| f.write_all(b"5,"))
            .expect("torn");
        let mut history = History::go_on(&path, &columns, &kept).expect("there");
        history.row(&[6.0, 7.0]).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("a file"), "a,b\n1,2\n6,7\n");
        let long = Mark { length: 1000, hash: kept.hash.clone() };
        assert!(History::go_on(&path, &columns, &long).is_err());
        for at in 0..kept.length as usize {
            let mut bytes = std::fs::read(&path).expect("there");
            bytes[at] ^= 1;
            std::fs::write(&path, &bytes).expect("written");
            let refused =
                files::fault(History::go_on(&path, &columns, &kept).map(|_| ()).expect_err("changed"));
            assert_eq!(refused.diagnostic.code, code::PROVENANCE);
            assert!(refused.to_string().contains("history.csv"), "{refused}");
            bytes[at] ^= 1;
            std::fs::write(&path, &bytes).expect("written");
        }
    }

    #[test]
    fn a_name_that_a_spreadsheet_would_compute_is_a_text() {
        for (text, cell) in
            [("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"), ("@SUM(A1)", "'@SUM(A1)"), ("\t=1", "'\t=1")]
        {
            assert_eq!(csv_text(text), cell);
        }
        for plain in ["-1.5e-3", "+2", "rock 1", "", "a=b"] {
            assert_eq!(csv_text(plain), plain);
        }
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("history.csv");
        History::create(&path, &["time_s".into(), "=cmd_N".into()]).expect("created");
        assert_eq!(std::fs::read_to_string(path).expect("a file"), "time_s,'=cmd_N\n");
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
            .args(["--exact", "history::tests::rows_until_the_limit"])
            .env("ROCKFALL_LIMITED", &path)
            .stdout(std::process::Stdio::null())
            .status()
            .expect("started");
        assert!(status.success());
        let text = std::fs::read_to_string(&path).expect("a file");
        assert!(text.len() > 80 && text.len() <= 100 && text.ends_with('\n'), "{text}");
        assert!(text.lines().all(|line| line.split(',').count() == 3), "{text}");
    }

    /// The inside of the test above, and nothing where it is not the one that asks.
    #[test]
    fn rows_until_the_limit() {
        let Some(path) = std::env::var_os("ROCKFALL_LIMITED") else { return };
        interface_defs::ipc::interrupt::install();
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
        let before = crate::alloc::allocations();
        for _ in 0..10 {
            history.row(&row).expect("written");
        }
        assert_eq!(crate::alloc::allocations(), before);
    }
}
