//! `members.csv`: one row for each member, in order. Header names carry units.

use super::base::Base;
use super::member::Member;
use super::quantity::{QUANTITIES, Quantity as OfFall};
use super::record::Record;
use super::settings::Quantity;
use std::io::{self, BufWriter};
use std::path::Path;
use std::time::{Duration, Instant};
use toolkit::files::{self, Stream};
use toolkit::history::csv_text;
use toolkit::summary::RunStatus;

/// How often rows are made to outlast a power cut, and to be seen by others.
const SYNC: Duration = Duration::from_secs(1);

/// Columns before those of what varies.
const START: &str = "member,release,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s,orientation_w,orientation_x,orientation_y,\
                     orientation_z,wx_rad_per_s,wy_rad_per_s,wz_rad_per_s,volume_m3,mass_kg";

/// Columns after them, before those of the quantities.
const END: &str = "status,ending,end_x_m,end_y_m,end_z_m,end_vx_m_per_s,end_vy_m_per_s,end_vz_m_per_s";

/// A number with the digits that it takes to read it again; a zero has no sign.
fn text(value: f64) -> String {
    (value + 0.0).to_string()
}

/// The table on disk.
pub struct Table {
    rows: csv::Writer<BufWriter<Stream>>,
    synced: Instant,
}

impl Table {
    /// A new one, with its header.
    pub fn create(path: &Path, base: &Base) -> io::Result<Self> {
        let mut rows = csv::Writer::from_writer(BufWriter::new(files::create(path)?));
        let varied = base.study.variables.iter().map(|v| match v.quantity {
            Quantity::Key => csv_text(&v.name).into_owned(),
            _ => format!("vary_{}", v.name),
        });
        let own = |names: &'static str| names.split(',').map(String::from);
        let values = QUANTITIES.iter().map(OfFall::column).chain(["message".to_owned()]);
        rows.write_record(own(START).chain(varied).chain(own(END)).chain(values))?;
        Ok(Self { rows, synced: Instant::now() })
    }

    /// Add a row. What is not known of a member that failed stays empty.
    pub fn add(&mut self, base: &Base, member: &Member, record: &Record) -> io::Result<()> {
        let it = &record.outcome;
        let release = csv_text(&base.study.releases[member.release].name);
        let mut cells = vec![record.number.to_string(), release.into_owned()];
        let started = it.mass > 0.0;
        let mut number =
            |known: bool, value: f64| cells.push(if known { text(value) } else { String::new() });
        let start = it.start.iter().chain(&it.velocity).chain(&it.orientation).chain(&it.spin);
        start.chain(&[it.volume, it.mass]).for_each(|value| number(started, *value));
        for (variable, value) in base.study.variables.iter().zip(&member.values) {
            cells.push(match (variable.quantity, value) {
                (Quantity::Shape, _) => (member.prototype + 1).to_string(),
                (_, toml::Value::Float(number)) => text(*number),
                (_, toml::Value::String(words)) => csv_text(words).into_owned(),
                (_, other) => other.to_string(),
            });
        }
        cells.push(it.status.word().into());
        let ended = it.status != RunStatus::Failed;
        cells.push(if ended { it.how.word().into() } else { String::new() });
        let mut number = |value: f64| cells.push(if ended { text(value) } else { String::new() });
        it.end.iter().chain(&it.end_velocity).chain(&it.values).for_each(|value| number(*value));
        cells.push(csv_text(&it.message()).into_owned());
        self.rows.write_record(&cells)?;
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

impl Drop for Table {
    fn drop(&mut self) {
        let _ = self.rows.flush();
    }
}
