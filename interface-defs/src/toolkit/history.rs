//! `history.csv`: one row per committed window, header names with units.

use crate::message::Gauge;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Writes rows of numbers. Each row is handed to the system at once: what is written is on disk
/// even if the process is killed a moment later.
pub struct History {
    file: File,
    columns: usize,
    row: String,
}

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
        let mut header = csv::Writer::from_path(path).map_err(io::Error::from)?;
        header.write_record(columns).map_err(io::Error::from)?;
        let file = header.into_inner().map_err(|e| e.into_error())?;
        Ok(Self { file, columns: columns.len(), row: String::with_capacity(26 * columns.len()) })
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
        self.file.write_all(self.row.as_bytes())
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
    fn a_number_that_is_not_finite_leaves_its_field_empty() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("history.csv");
        let mut history = History::create(&path, &["a".into(), "b".into()]).expect("created");
        history.row(&[f64::NAN, 1.0]).expect("written");
        assert_eq!(std::fs::read_to_string(path).expect("a file"), "a,b\n,1\n");
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
