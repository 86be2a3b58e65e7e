//! `members.csv`: one row for each member, in order. Header names carry units.

use super::base::Base;
use super::member::Member;
use super::record::{Outcome, QUANTITIES, Record};
use super::settings::Quantity;
use std::io::{self, BufWriter};
use std::path::Path;
use std::time::{Duration, Instant};
use toolkit::columns::Columns;
use toolkit::files::{self, Stream};
use toolkit::history::csv_text;
use toolkit::summary::RunStatus;

/// How often rows are made to outlast a power cut, and to be seen by others.
const SYNC: Duration = Duration::from_secs(1);

/// A member, with what became of it.
type Row = (Member, Record);

/// Numbers that are written with the digits that it takes to read them again; a zero has no sign.
fn of<const N: usize>(outcome: Option<&Outcome>, of: impl Fn(&Outcome) -> [f64; N]) -> Option<[f64; N]> {
    outcome.map(|outcome| of(outcome).map(|number| number + 0.0))
}

/// Of one that could start.
fn started((_, record): &Row) -> Option<&Outcome> {
    Some(&record.outcome).filter(|outcome| outcome.mass > 0.0)
}

/// Of one that was computed to an end.
fn ended((_, record): &Row) -> Option<&Outcome> {
    Some(&record.outcome).filter(|outcome| outcome.status != RunStatus::Failed)
}

/// Every column, in order. What is not known of a member that failed stays empty.
fn columns(base: &Base) -> Columns<'_, Row> {
    let mut columns = Columns::new()
        .with("member", |(_, record): &Row| record.number.to_string())
        .text("release", |(member, _)| base.study.releases[member.release].name.clone())
        .numbers(["x_m", "y_m", "z_m"], |row| of(started(row), |it| it.start))
        .numbers(["vx_m_per_s", "vy_m_per_s", "vz_m_per_s"], |row| of(started(row), |it| it.velocity))
        .numbers(["orientation_w", "orientation_x", "orientation_y", "orientation_z"], |row| {
            of(started(row), |it| it.orientation)
        })
        .numbers(["wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s"], |row| of(started(row), |it| it.spin))
        .numbers(["volume_m3", "mass_kg"], |row| of(started(row), |it| [it.volume, it.mass]));
    for (at, variable) in base.study.varied().iter().enumerate() {
        let name = match variable.quantity {
            Quantity::Key => csv_text(&variable.name).into_owned(),
            _ => format!("vary_{}", variable.name),
        };
        columns = columns.with(name, move |(member, _)| match (variable.quantity, &member.values[at]) {
            (Quantity::Shape, _) => (member.prototype + 1).to_string(),
            (_, toml::Value::Float(number)) => (number + 0.0).to_string(),
            (_, toml::Value::String(words)) => csv_text(words).into_owned(),
            (_, other) => other.to_string(),
        });
    }
    columns = columns
        .with("status", |(_, record)| record.outcome.status.word().into())
        .with("ending", |row| ended(row).map_or("", |it| it.how.word()).into())
        .numbers(["end_x_m", "end_y_m", "end_z_m"], |row| of(ended(row), |it| it.end))
        .numbers(["end_vx_m_per_s", "end_vy_m_per_s", "end_vz_m_per_s"], |row| {
            of(ended(row), |it| it.end_velocity)
        });
    for (at, quantity) in QUANTITIES.iter().enumerate() {
        columns = columns
            .number(quantity.column(), move |row| of(ended(row), |it| [it.values[at]]).map(|[value]| value));
    }
    columns.text("message", |(_, record)| record.outcome.message())
}

/// The table on disk.
pub struct Table<'a> {
    base: &'a Base,
    columns: Columns<'a, Row>,
    rows: csv::Writer<BufWriter<Stream>>,
    synced: Instant,
}

impl<'a> Table<'a> {
    /// A new one, with its header.
    pub fn create(path: &Path, base: &'a Base) -> io::Result<Self> {
        let mut rows = csv::Writer::from_writer(BufWriter::new(files::create(path)?));
        let columns = columns(base);
        rows.write_record(columns.names())?;
        Ok(Self { base, columns, rows, synced: Instant::now() })
    }

    /// Add a row.
    pub fn add(&mut self, record: Record) -> io::Result<()> {
        self.rows.write_record(self.columns.row(&(self.base.member(record.number), record)))?;
        if self.synced.elapsed() >= SYNC {
            self.sync()?;
        }
        Ok(())
    }

    /// Make all rows outlast a power cut.
    pub fn sync(&mut self) -> io::Result<()> {
        self.rows.flush()?;
        self.synced = Instant::now();
        self.rows.get_ref().get_ref().sync()
    }
}

impl Drop for Table<'_> {
    fn drop(&mut self) {
        let _ = self.rows.flush();
    }
}
