//! The members of a study that are hardest on a barrier: which they are, and each as a scene with the barrier in its place.
//!
//! In turn the one with the most energy, the highest, the nearest to an end of the line. A study alone computes no net: `rockfall ensemble --barrier` has these scenes computed, one by one.
//!
//! - [`barrier`]: the scene of a member with the barrier

pub mod barrier;

use super::base::Base;
use super::member::Member;
use super::path_quantity::{PATH_QUANTITIES, in_order};
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
pub struct BarrierHit {
    member: u64,
    crossing: Crossing,
}

/// The first crossings of the barrier's line.
pub struct BarrierHits<'a> {
    base: &'a Base,
    barrier: &'a Barrier,
    line: u16,
    computed: u64,
    all: Vec<BarrierHit>,
}

/// What is known of a chosen member, by column.
type ChosenRow = Vec<(String, Value)>;

impl<'a> BarrierHits<'a> {
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
        self.all.extend(first.map(|crossing| BarrierHit { member: record.number, crossing }));
    }

    /// Distance of a crossing from the nearer end of the line, along it [m].
    fn edge(&self, crossing: &Crossing) -> f64 {
        let length = plan::length(&self.base.lines[usize::from(self.line)]);
        crossing.along.min(length - crossing.along)
    }

    /// Write the scenes of the worst members, and which they are.
    pub fn write(&self, dir: &Path, count: usize) -> Result<(), Diagnostic> {
        let (base, barrier) = (self.base, self.barrier);
        if self.all.is_empty() {
            let what = format!("no member of the study reaches the line `{}`", barrier.line);
            return Err(Diagnostic::in_file(barrier.file().display(), what)
                .try_instead("move the barrier, or look at maps/share.svg where rocks pass"));
        }
        let fault = |e: io::Error| Diagnostic::in_file(dir.display(), e.to_string());
        files::Dir::create(dir).map_err(fault)?;
        base.keep_clusters(&dir.join(CLUSTERS)).map_err(fault)?;
        let mut rows: Vec<ChosenRow> = Vec::new();
        // In turn the worst by each of these quantities, and the nearest to an end of the line.
        let by = || PATH_QUANTITIES.iter().filter(|quantity| quantity.chosen);
        let mut orders: Vec<(&str, Vec<f64>)> = by()
            .map(|it| (it.name, self.all.iter().map(|hit| (it.of)(&hit.crossing.at)).collect()))
            .collect();
        orders.push(("edge", self.all.iter().map(|hit| -self.edge(&hit.crossing)).collect()));
        for choice in choose(&orders, count) {
            let hit = &self.all[choice.at];
            let (text, flight) = self.scene(&base.member(hit.member), &hit.crossing)?;
            files::write(&dir.join(format!("{}.toml", hit.member)), text.as_bytes()).map_err(fault)?;
            rows.push(self.row(&choice, flight.as_ref()));
        }
        let columns: Vec<String> = rows.first().into_iter().flatten().map(|(name, _)| name.clone()).collect();
        let chosen: Vec<Map<String, Value>> = rows.into_iter().map(Map::from_iter).collect();
        let index = json!({
            "line": barrier.line, "members": base.members(), "computed": self.computed, "reach": self.all.len(),
            "columns": columns, "chosen": chosen,
        });
        files::write_json(&dir.join(CHOSEN), &index).map_err(fault)
    }

    fn row(&self, choice: &Choice, flight: Option<&Flight>) -> ChosenRow {
        let BarrierHit { member, crossing } = &self.all[choice.at];
        let [x, y, z] = [0, 1, 2].map(|axis| crossing.at.position[axis] + self.base.ground.origin[axis]);
        let mut row: ChosenRow = vec![
            ("member".into(), json!(member)),
            ("chosen_for".into(), json!(choice.reason)),
            ("rank".into(), json!(choice.rank)),
            ("line_time_s".into(), json!(crossing.at.time)),
            ("line_x_m".into(), json!(x)),
            ("line_y_m".into(), json!(y)),
            ("line_z_m".into(), json!(z)),
            ("along_m".into(), json!(crossing.along)),
            ("edge_m".into(), json!(self.edge(crossing))),
        ];
        let all = in_order(&["height", "centre_height", "speed", "energy"]).into_iter();
        // Quantities that are results of their own: others follow from them.
        let own = all.filter(|it| it.statistic.is_some() || it.raster.is_some());
        row.extend(own.map(|it| (it.column(), json!((it.of)(&crossing.at)))));
        row.push(("start_time_s".into(), json!(flight.map_or(0.0, |flight| flight.time))));
        row
    }

    /// The scene of a member with the barrier: from a flight before the line on where there is one, else from its release.
    fn scene(&self, member: &Member, crossing: &Crossing) -> Result<(String, Option<Flight>), Diagnostic> {
        let (base, fault) = (self.base, Base::of_member(member));
        let line = &base.lines[usize::from(crossing.line)];
        let reach = base.model(member, None).map_err(&fault)?.rocks[0].reach;
        let is_far = |at| distance_from(line, &at) > self.barrier.margin + reach;
        let flight = flight_before(base, member, crossing.at.time, &is_far).map_err(fault)?;
        Ok((self.text(member, flight.as_ref(), crossing.at.time)?, flight))
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

/// Why a member is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice<'a> {
    /// The member, by its place among all.
    pub at: usize,
    /// For which quantity.
    pub reason: &'a str,
    /// Its rank in that, from 1.
    pub rank: usize,
}

/// Choose `count` members, in turn the worst by each order that is not chosen yet. Of equal ones the first. An order is a name, and a
/// value of each member, the worse the larger; what is not a number is in none.
pub fn choose<'a>(orders: &[(&'a str, Vec<f64>)], count: usize) -> Vec<Choice<'a>> {
    let list = |(reason, values): &(&'a str, Vec<f64>)| {
        let mut list: Vec<usize> = (0..values.len()).filter(|at| !values[*at].is_nan()).collect();
        list.sort_by(|a, b| values[*b].total_cmp(&values[*a]).then(a.cmp(b)));
        (*reason, list.into_iter().enumerate())
    };
    let mut lists: Vec<_> = orders.iter().map(list).collect();
    let (mut chosen, mut known) = (Vec::new(), BTreeSet::new());
    loop {
        let before = chosen.len();
        for (reason, list) in &mut lists {
            if chosen.len() < count
                && let Some((rank, at)) = list.find(|(_, at)| known.insert(*at))
            {
                chosen.push(Choice { at, reason, rank: rank + 1 });
            }
        }
        if chosen.len() == before {
            return chosen;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_chosen_in_turn_and_each_once() {
        let orders = [
            ("energy", vec![5.0, 9.0, 9.0, 1.0, 0.0]),
            ("height", vec![1.0, 3.0, 2.0, f64::NAN, 0.0]),
            ("edge", vec![-9.0, -8.0, -0.5, -1.0, -20.0]),
        ];
        let names = |count| {
            let chosen = choose(&orders, count);
            chosen.iter().map(|c| format!("{} {} {}", c.at + 1, c.reason, c.rank)).collect::<Vec<_>>()
        };
        // The highest is the one with the most energy, the first of two: the next in height has its turn.
        assert_eq!(names(4), ["2 energy 1", "3 height 2", "4 edge 2", "1 energy 3"]);
        assert_eq!(names(2), names(4)[..2]);
        assert_eq!(names(20).len(), 5);
        assert_eq!(choose(&[("energy", vec![])], 3), []);
    }
}
