//! `members.csv`: one row for each member, in order. Header names carry units.

use super::base::Base;
use super::member::Member;
use super::quantity::MEMBER_QUANTITIES;
use super::record::{Outcome, Record};
use super::settings::Varied;
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
type MemberRow = (Member, Record);

/// Whether what is known at the start, or at the end alone, is known of a member.
fn is_known(at_start: bool, outcome: &Outcome) -> bool {
    if at_start { outcome.mass > 0.0 } else { outcome.status != RunStatus::Failed }
}

/// Numbers of a member that could start; a zero has no sign.
fn started<const N: usize>((_, record): &MemberRow, of: impl Fn(&Outcome) -> [f64; N]) -> Option<[f64; N]> {
    is_known(true, &record.outcome).then(|| of(&record.outcome).map(|number| number + 0.0))
}

/// Add the columns of the quantities that are known then.
fn with_quantities(columns: Columns<'_, MemberRow>, at_start: bool) -> Columns<'_, MemberRow> {
    let own = MEMBER_QUANTITIES.iter().filter(|quantity| quantity.at_start == at_start);
    own.fold(columns, |columns, quantity| {
        columns.number(quantity.column(), move |(_, record): &MemberRow| {
            is_known(at_start, &record.outcome).then(|| quantity.value(&record.outcome))
        })
    })
}

/// Every column, in order. What is not known of a member that failed stays empty.
fn columns(base: &Base) -> Columns<'_, MemberRow> {
    let columns = Columns::new()
        .with("member", |(_, record): &MemberRow| record.number.to_string())
        .text("release", |(member, _)| base.study.releases[member.release].name.clone());
    let columns = columns
        .numbers(["x_m", "y_m", "z_m"], |row| started(row, |it| it.start))
        .numbers(["vx_m_per_s", "vy_m_per_s", "vz_m_per_s"], |row| started(row, |it| it.velocity))
        .numbers(["orientation_w", "orientation_x", "orientation_y", "orientation_z"], |row| {
            started(row, |it| it.orientation)
        })
        .numbers(["wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s"], |row| started(row, |it| it.spin));
    let mut columns = with_quantities(columns, true);
    for (at, variable) in base.study.varied().iter().enumerate() {
        let name = match variable.quantity {
            Varied::Key => csv_text(&variable.name).into_owned(),
            _ => format!("vary_{}", variable.name),
        };
        columns = columns.with(name, move |(member, _)| match (variable.quantity, &member.values[at]) {
            (Varied::Shape, _) => (member.prototype + 1).to_string(),
            (_, toml::Value::Float(number)) => (number + 0.0).to_string(),
            (_, toml::Value::String(words)) => csv_text(words).into_owned(),
            (_, other) => other.to_string(),
        });
    }
    let ending = |outcome: &Outcome| if is_known(false, outcome) { outcome.how.word() } else { "" };
    let columns = columns
        .with("status", |(_, record)| record.outcome.status.word().into())
        .with("ending", move |(_, record)| ending(&record.outcome).into());
    with_quantities(columns, false).text("message", |(_, record)| record.outcome.message())
}

/// The table on disk.
pub struct Table<'a> {
    base: &'a Base,
    columns: Columns<'a, MemberRow>,
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
