//! What a study came to: counts of endings, quantiles over its members.

use super::record::{How, Outcome};
use interface_defs::message::Measure;
use interface_defs::toolkit::limits::percent;
use interface_defs::toolkit::summary::{RunStatus, Summary};

/// Shares of which quantiles are reported [%].
pub const SHARES: [u32; 5] = [10, 50, 90, 95, 99];

/// The quantile at a share (0 to 1) of numbers in ascending order, at least one, between two of them in proportion.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// A quantity of every member: its name, its unit, where it is in an outcome, and of which members it is known.
struct Column {
    name: &'static str,
    unit: &'static str,
    of: fn(&Outcome) -> Option<f64>,
}

const COLUMNS: [Column; 6] = [
    Column { name: "run_out", unit: "m", of: |o| (o.how == How::Rest).then_some(o.run_out) },
    Column { name: "time", unit: "s", of: |o| (o.how == How::Rest).then_some(o.time) },
    Column { name: "max_speed", unit: "m/s", of: |o| Some(o.speed) },
    Column { name: "max_kinetic_energy", unit: "J", of: |o| Some(o.energy) },
    Column { name: "max_jump_height", unit: "m", of: |o| Some(o.jump) },
    Column { name: "impacts", unit: "1", of: |o| Some(o.impacts as f64) },
];

/// Counts and numbers of all members so far.
#[derive(Debug, Clone, Default)]
pub struct Numbers {
    members: u64,
    unreliable: u64,
    failed: u64,
    rest: u64,
    left: u64,
    moving: u64,
    values: [Vec<f64>; COLUMNS.len()],
    first: Option<(u64, String)>,
}

impl Numbers {
    /// Take in a member. One that failed counts as such alone; an unreliable one counts in the quantiles too.
    pub fn add(&mut self, number: u64, outcome: &Outcome) {
        self.members += 1;
        if outcome.status != RunStatus::Done {
            self.first.get_or_insert_with(|| (number, outcome.message.clone()));
        }
        match outcome.status {
            RunStatus::Done => {}
            RunStatus::Unreliable => self.unreliable += 1,
            RunStatus::Failed | RunStatus::Interrupted => {
                self.failed += 1;
                return;
            }
        }
        match outcome.how {
            How::None => {}
            How::Rest => self.rest += 1,
            How::Out => self.left += 1,
            How::Moving => self.moving += 1,
        }
        for (values, column) in self.values.iter_mut().zip(&COLUMNS) {
            values.extend((column.of)(outcome));
        }
    }

    /// The summary; with more than the share `most_failed` of members that failed or are unreliable it is unreliable itself.
    pub fn summary(mut self, most_failed: f64) -> Summary {
        let mut summary = Summary::new(RunStatus::Done);
        summary.verdict.push(format!(
            "of {} members {} came to rest, {} left the terrain, {} still moved at the end, {} failed; {} of those computed are \
             unreliable",
            self.members, self.rest, self.left, self.moving, self.failed, self.unreliable
        ));
        let mut report = |name: String, value: f64, unit: &str| {
            summary.measures.push(Measure { name, value, unit: unit.into(), time: None });
        };
        for (name, count) in [
            ("members", self.members),
            ("members_at_rest", self.rest),
            ("members_left", self.left),
            ("members_moving", self.moving),
            ("members_unreliable", self.unreliable),
            ("members_failed", self.failed),
        ] {
            report(name.into(), count as f64, "1");
        }
        let mut absent = Vec::new();
        for (values, column) in self.values.iter_mut().zip(&COLUMNS) {
            if values.is_empty() {
                absent.push(column.name);
                continue;
            }
            values.sort_by(f64::total_cmp);
            for share in SHARES {
                let value = quantile(values, f64::from(share) / 100.0);
                report(format!("{}_q{share}", column.name), value, column.unit);
            }
            report(format!("{}_largest", column.name), values[values.len() - 1], column.unit);
        }
        if !absent.is_empty() {
            summary.warnings.push(format!("quantiles of {} absent: no member has one", absent.join(", ")));
        }
        let bad = self.unreliable + self.failed;
        if let Some((number, why)) = self.first {
            let share = bad as f64 / self.members as f64;
            let what = format!(
                "{bad} of {} members ({}) failed or are unreliable; the first, member {number}: {why}",
                self.members,
                percent(share)
            );
            if share > most_failed {
                summary.status = RunStatus::Unreliable;
                summary.message = Some(format!(
                    "unreliable: {what}; more than most_failed = {most_failed}: the column `message` of members.csv has all"
                ));
            } else {
                summary.warnings.push(what);
            }
        }
        summary
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_two_members_in_proportion() {
        let values = [1.0, 2.0, 4.0, 8.0, 16.0];
        assert_eq!([0.0, 0.25, 0.5, 0.875, 1.0].map(|s| quantile(&values, s)), [1.0, 2.0, 4.0, 12.0, 16.0]);
        assert_eq!(quantile(&[3.0], 0.95), 3.0);
    }

    #[test]
    fn members_that_failed_are_counted_and_too_many_make_the_study_unreliable() {
        let mut numbers = Numbers::default();
        for number in 1..=99 {
            let outcome = Outcome {
                status: RunStatus::Done,
                how: How::Rest,
                run_out: number as f64,
                ..Outcome::failed(String::new())
            };
            numbers.add(number, &outcome);
        }
        numbers.add(100, &Outcome::failed("why".into()));
        let strict = numbers.clone().summary(0.009);
        let summary = numbers.summary(0.01);
        assert_eq!(summary.status, RunStatus::Done);
        assert_eq!(summary.measure("run_out_q50"), Some(50.0));
        assert!(summary.measure("run_out_q10").is_some_and(|value| (value - 10.8).abs() < 1e-12));
        assert_eq!(summary.measure("members_failed"), Some(1.0));
        assert_eq!(strict.status, RunStatus::Unreliable);
        let why = strict.message.unwrap_or_default();
        assert!(why.contains("1 of 100 members (1 %)") && why.contains("member 100: why"), "{why}");
    }
}
