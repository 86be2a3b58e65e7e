//! The members of a study that are hardest on a barrier: which they are, and each as a scene with the barrier in its place.
//!
//! A study alone computes no net: `rockfall ensemble --barrier` has these scenes computed, one by one.
//!
//! - [`choose`](mod@choose): which members; [`barrier`]: the scene of a member with the barrier

pub mod barrier;
pub mod choose;

use super::base::Base;
use super::member::Member;
use super::record::Record;
use super::runner::{Flight, Runner, flight_before};
use super::track::{Crossing, place};
use barrier::Barrier;
use choose::{Arrival, Choice, choose};
use dem_solid::geometry::plan::{self, distance_from};
use interface_defs::diagnostic::Diagnostic;
use serde_json::{Value, json};
use std::io;
use std::path::Path;
use toolkit::files;
use toolkit::run_dir;
use toolkit::summary::RunStatus;

/// Which members were chosen, and what they bring to the line.
pub const CHOSEN: &str = "chosen.json";

/// What is known of a chosen member.
const COLUMNS: &str = "member,chosen_for,rank,line_time_s,line_x_m,line_y_m,line_z_m,along_m,edge_m,passing_height_m,centre_height_m,\
                       speed_m_per_s,kinetic_energy_J,rotation_energy_J,start_time_s";

/// How a member comes to the line for the first time.
#[derive(Debug, Clone, PartialEq)]
pub struct Coming {
    member: u64,
    crossing: Crossing,
}

/// The first crossings of the barrier's line.
#[derive(Debug, Default)]
pub struct Comings {
    line: u16,
    computed: u64,
    all: Vec<Coming>,
}

impl Comings {
    /// None so far.
    pub fn new(base: &Base, barrier: &Barrier) -> Self {
        let line = base.study.lines.iter().position(|line| line.name == barrier.line);
        Self { line: line.unwrap_or_default() as u16, ..Self::default() }
    }

    /// Take in a member.
    pub fn add(&mut self, record: &Record) {
        if record.outcome.status == RunStatus::Failed {
            return;
        }
        self.computed += 1;
        let first = record.track.crossings.iter().find(|crossing| crossing.line == self.line);
        self.all.extend(first.map(|crossing| Coming { member: record.number, crossing: *crossing }));
    }

    fn arrivals(&self, base: &Base) -> Vec<Arrival> {
        let length = plan::length(&base.lines[usize::from(self.line)]);
        let of = |coming: &Coming| {
            let values = &coming.crossing.values;
            let along = values[place::ALONG];
            Arrival {
                member: coming.member,
                energy: values[place::ENERGY],
                height: values[place::HEIGHT],
                edge: along.min(length - along),
            }
        };
        self.all.iter().map(of).collect()
    }

    /// Write the scenes of the worst members, and which they are.
    pub fn write(&self, base: &Base, barrier: &Barrier, dir: &Path, count: usize) -> Result<(), Diagnostic> {
        let arrivals = self.arrivals(base);
        if arrivals.is_empty() {
            let what = format!("no member of the study reaches the line `{}`", barrier.line);
            return Err(Diagnostic::in_file(barrier.file().display().to_string(), what)
                .try_instead("move the barrier, or look at maps/share.svg where rocks pass"));
        }
        let fault = |e: io::Error| Diagnostic::in_file(dir.display().to_string(), e.to_string());
        files::Dir::create(dir).map_err(fault)?;
        base.keep_clusters(&dir.join(run_dir::CLUSTERS)).map_err(fault)?;
        let mut rows = Vec::new();
        for choice in choose(&arrivals, count) {
            let (coming, member) = (&self.all[choice.at], base.member(self.all[choice.at].member));
            let (text, flight) = scene(base, barrier, &member, &coming.crossing)?;
            let file = format!("{}.toml", member.number);
            files::write(&dir.join(&file), text.as_bytes()).map_err(fault)?;
            rows.push(row(base, &member, coming, &arrivals[choice.at], &choice, flight.as_ref()));
        }
        let index = json!({
            "line": barrier.line, "members": base.members(), "computed": self.computed, "reach": arrivals.len(),
            "columns": COLUMNS.split(',').collect::<Vec<_>>(), "chosen": rows,
        });
        let text = serde_json::to_string_pretty(&index).map_err(io::Error::from).map_err(fault)?;
        files::write(&dir.join(CHOSEN), (text + "\n").as_bytes()).map_err(fault)
    }
}

/// The scene of a member with the barrier: from a flight before the line on where there is one, else from its release.
pub fn scene(
    base: &Base,
    barrier: &Barrier,
    member: &Member,
    crossing: &Crossing,
) -> Result<(String, Option<Flight>), Diagnostic> {
    let fault = Base::of_member(member);
    let time = crossing.values[place::TIME];
    let line = &base.lines[usize::from(crossing.line)];
    let reach = base.model(member, None).map_err(&fault)?.rocks[0].reach;
    let is_far = |at| distance_from(line, &at) > barrier.margin + reach;
    let flight = flight_before(base, member, time, &is_far).map_err(fault)?;
    let table = barrier.with(base, member, flight.as_ref(), time)?;
    Ok((text(base, barrier, member, flight.as_ref(), &table)?, flight))
}

/// A scene with a head that says from where on it is computed.
fn text(
    base: &Base,
    barrier: &Barrier,
    member: &Member,
    flight: Option<&Flight>,
    table: &toml::Table,
) -> Result<String, Diagnostic> {
    let from = flight.map_or("its release".into(), |flight| format!("its flight at {} s", flight.time));
    base.text(member, &format!(" against {}, from {from} on", barrier.name()), table)
}

/// The same of one member that has not been computed yet; one that does not reach the line starts at its release.
pub fn scene_of_one(base: &Base, barrier: &Barrier, number: u64) -> Result<String, Diagnostic> {
    let member = base.member(number);
    let line = Comings::new(base, barrier).line;
    let track = Runner::new(base).run(&member).map(|(_, track)| track).unwrap_or_default();
    if let Some(crossing) = track.crossings.iter().find(|crossing| crossing.line == line) {
        return Ok(scene(base, barrier, &member, crossing)?.0);
    }
    tracing::warn!("member {number} does not reach the line of the barrier: its scene begins at its release");
    let table = barrier.with(base, &member, None, 0.0)?;
    text(base, barrier, &member, None, &table)
}

fn row(
    base: &Base,
    member: &Member,
    coming: &Coming,
    arrival: &Arrival,
    choice: &Choice,
    flight: Option<&Flight>,
) -> Value {
    let values = &coming.crossing.values;
    let at = |axis: usize| values[place::POSITION + axis] + base.ground.origin[axis];
    json!({
        "member": member.number, "chosen_for": choice.reason, "rank": choice.rank,
        "line_time_s": values[place::TIME], "line_x_m": at(0), "line_y_m": at(1), "line_z_m": at(2),
        "along_m": values[place::ALONG], "edge_m": arrival.edge,
        "passing_height_m": values[place::HEIGHT], "centre_height_m": values[place::CENTRE],
        "speed_m_per_s": values[place::SPEED],
        "kinetic_energy_J": values[place::ENERGY], "rotation_energy_J": values[place::ROTATION],
        "start_time_s": flight.map_or(0.0, |flight| flight.time),
    })
}
