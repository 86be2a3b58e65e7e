//! The members of a study that are hardest on a barrier: which they are, and each as a scene with the barrier in its place.
//!
//! In turn the one with the most energy, the highest, the nearest to an end of the line. A study alone computes no net: `rockfall ensemble --barrier` has these scenes computed, one by one.
//!
//! - [`barrier`]: the scene of a member with the barrier

pub mod barrier;

use super::base::Base;
use super::member::Member;
use super::record::Record;
use super::runner::{Flight, Runner, flight_before};
use super::track::{Crossing, Track};
use barrier::Barrier;
use dem_solid::geometry::plan::{self, distance_from};
use interface_defs::diagnostic::Diagnostic;
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::io;
use std::path::Path;
use toolkit::files;
use toolkit::run_dir::{CHOSEN, CLUSTERS};
use toolkit::summary::RunStatus;

/// How a member comes to the line for the first time.
#[derive(Debug, Clone, PartialEq)]
pub struct Coming {
    member: u64,
    crossing: Crossing,
}

/// The first crossings of the barrier's line.
pub struct Comings<'a> {
    base: &'a Base,
    barrier: &'a Barrier,
    line: u16,
    computed: u64,
    all: Vec<Coming>,
}

/// What is known of a chosen member, by column.
type Row = Vec<(&'static str, Value)>;

impl<'a> Comings<'a> {
    /// None so far.
    pub fn new(base: &'a Base, barrier: &'a Barrier) -> Self {
        let line = base.study.lines.iter().position(|line| line.name == barrier.line);
        Self { base, barrier, line: line.unwrap_or_default() as u16, computed: 0, all: Vec::new() }
    }

    fn first<'t>(&self, track: &'t Track) -> Option<&'t Crossing> {
        track.crossings.iter().find(|crossing| crossing.line == self.line)
    }

    /// Take in a member.
    pub fn add(&mut self, record: &Record) {
        if record.outcome.status == RunStatus::Failed {
            return;
        }
        self.computed += 1;
        let first = self.first(&record.track).copied();
        self.all.extend(first.map(|crossing| Coming { member: record.number, crossing }));
    }

    fn arrivals(&self) -> Vec<Arrival> {
        let length = plan::length(&self.base.lines[usize::from(self.line)]);
        let of = |coming: &Coming| {
            let Crossing { energy, height, along, .. } = coming.crossing;
            Arrival { member: coming.member, energy, height, edge: along.min(length - along) }
        };
        self.all.iter().map(of).collect()
    }

    /// Write the scenes of the worst members, and which they are.
    pub fn write(&self, dir: &Path, count: usize) -> Result<(), Diagnostic> {
        let (base, barrier, arrivals) = (self.base, self.barrier, self.arrivals());
        if arrivals.is_empty() {
            let what = format!("no member of the study reaches the line `{}`", barrier.line);
            return Err(Diagnostic::in_file(barrier.file().display(), what)
                .try_instead("move the barrier, or look at maps/share.svg where rocks pass"));
        }
        let fault = |e: io::Error| Diagnostic::in_file(dir.display(), e.to_string());
        files::Dir::create(dir).map_err(fault)?;
        base.keep_clusters(&dir.join(CLUSTERS)).map_err(fault)?;
        let mut rows: Vec<Row> = Vec::new();
        for choice in choose(&arrivals, count) {
            let coming = &self.all[choice.at];
            let (text, flight) = self.scene(&base.member(coming.member), &coming.crossing)?;
            files::write(&dir.join(format!("{}.toml", coming.member)), text.as_bytes()).map_err(fault)?;
            rows.push(self.row(&choice, &arrivals[choice.at], flight.as_ref()));
        }
        let columns: Vec<&str> = rows.first().into_iter().flatten().map(|(name, _)| *name).collect();
        let named = |row: &Row| row.iter().map(|(name, value)| ((*name).into(), value.clone())).collect();
        let chosen: Vec<Map<String, Value>> = rows.iter().map(named).collect();
        let index = json!({
            "line": barrier.line, "members": base.members(), "computed": self.computed, "reach": arrivals.len(),
            "columns": columns, "chosen": chosen,
        });
        files::write_json(&dir.join(CHOSEN), &index).map_err(fault)
    }

    fn row(&self, choice: &Choice, arrival: &Arrival, flight: Option<&Flight>) -> Row {
        let Coming { member, crossing } = &self.all[choice.at];
        let [x, y, z] = [0, 1, 2].map(|axis| crossing.position[axis] + self.base.ground.origin[axis]);
        vec![
            ("member", json!(member)),
            ("chosen_for", json!(choice.reason)),
            ("rank", json!(choice.rank)),
            ("line_time_s", json!(crossing.time)),
            ("line_x_m", json!(x)),
            ("line_y_m", json!(y)),
            ("line_z_m", json!(z)),
            ("along_m", json!(crossing.along)),
            ("edge_m", json!(arrival.edge)),
            ("passing_height_m", json!(crossing.height)),
            ("centre_height_m", json!(crossing.centre)),
            ("speed_m_per_s", json!(crossing.speed)),
            ("kinetic_energy_J", json!(crossing.energy)),
            ("rotation_energy_J", json!(crossing.rotation)),
            ("start_time_s", json!(flight.map_or(0.0, |flight| flight.time))),
        ]
    }

    /// The scene of a member with the barrier: from a flight before the line on where there is one, else from its release.
    fn scene(&self, member: &Member, crossing: &Crossing) -> Result<(String, Option<Flight>), Diagnostic> {
        let (base, fault) = (self.base, Base::of_member(member));
        let line = &base.lines[usize::from(crossing.line)];
        let reach = base.model(member, None).map_err(&fault)?.rocks[0].reach;
        let is_far = |at| distance_from(line, &at) > self.barrier.margin + reach;
        let flight = flight_before(base, member, crossing.time, &is_far).map_err(fault)?;
        Ok((self.text(member, flight.as_ref(), crossing.time)?, flight))
    }

    /// The same from this flight on, or from the release, with a head that says so.
    fn text(&self, member: &Member, flight: Option<&Flight>, crossing: f64) -> Result<String, Diagnostic> {
        let table = self.barrier.with(self.base, member, flight, crossing)?;
        let from = flight.map_or("its release".into(), |flight| format!("its flight at {} s", flight.time));
        self.base.text(member, &format!(" against {}, from {from} on", self.barrier.name()), &table)
    }

    /// The scene of one member that has not been computed yet; one that does not reach the line starts at its release.
    pub fn scene_of_one(&self, number: u64) -> Result<String, Diagnostic> {
        let member = self.base.member(number);
        let track = Runner::new(self.base).run(&member).map(|(_, track)| track).unwrap_or_default();
        if let Some(crossing) = self.first(&track) {
            return Ok(self.scene(&member, crossing)?.0);
        }
        tracing::warn!(
            "member {number} does not reach the line of the barrier: its scene begins at its release"
        );
        self.text(&member, None, 0.0)
    }
}

/// What a member brings to the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival {
    /// Its number.
    pub member: u64,
    /// Kinetic energy [J].
    pub energy: f64,
    /// Height of its lowest point above the ground [m]; not a number where that is not known.
    pub height: f64,
    /// Distance from the nearer end of the line, along it [m].
    pub edge: f64,
}

/// Why a member is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    /// The member, by its place among all.
    pub at: usize,
    /// For which quantity.
    pub reason: &'static str,
    /// Its rank in that, from 1.
    pub rank: usize,
}

/// A quantity that is worse the larger it is: its name, and its value.
type Order = (&'static str, fn(&Arrival) -> f64);

/// The three orders, in the order of their turns.
const ORDERS: [Order; 3] = [("energy", |a| a.energy), ("height", |a| a.height), ("edge", |a| -a.edge)];

/// Choose `count` members, in turn the worst by each order that is not chosen yet. Of equal ones the first.
pub fn choose(arrivals: &[Arrival], count: usize) -> Vec<Choice> {
    let mut lists = ORDERS.map(|(reason, of)| {
        let mut list: Vec<usize> = (0..arrivals.len()).filter(|at| !of(&arrivals[*at]).is_nan()).collect();
        list.sort_by(|a, b| of(&arrivals[*b]).total_cmp(&of(&arrivals[*a])).then(a.cmp(b)));
        (reason, list.into_iter().enumerate())
    });
    let (mut chosen, mut known) = (Vec::new(), BTreeSet::new());
    let count = count.min(arrivals.len());
    while chosen.len() < count {
        let before = chosen.len();
        for (reason, list) in &mut lists {
            if chosen.len() < count
                && let Some((rank, at)) = list.find(|(_, at)| known.insert(*at))
            {
                chosen.push(Choice { at, reason, rank: rank + 1 });
            }
        }
        if chosen.len() == before {
            break;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_chosen_in_turn_and_each_once() {
        let of = |member, energy, height, edge| Arrival { member, energy, height, edge };
        let all = [
            of(1, 5.0, 1.0, 9.0),
            of(2, 9.0, 3.0, 8.0),
            of(3, 9.0, 2.0, 0.5),
            of(4, 1.0, f64::NAN, 1.0),
            of(5, 0.0, 0.0, 20.0),
        ];
        let names = |count| {
            let chosen = choose(&all, count);
            chosen.iter().map(|c| format!("{} {} {}", all[c.at].member, c.reason, c.rank)).collect::<Vec<_>>()
        };
        // The highest is the one with the most energy, the first of two: the next in height has its turn.
        assert_eq!(names(4), ["2 energy 1", "3 height 2", "4 edge 2", "1 energy 3"]);
        assert_eq!(names(2), names(4)[..2]);
        assert_eq!(names(20).len(), 5);
        assert_eq!(choose(&[], 3), []);
    }
}
