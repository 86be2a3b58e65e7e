//! What a study came to: counts of endings, quantiles over its members.

use super::bounds::{of_quantile, quantile};
use super::quantity::{MEMBER_QUANTITIES, MemberQuantity};
use super::record::{How, Outcome};
use interface_defs::diagnostic::{Diagnostic, Severity, code};
use interface_defs::message::{Interval, Measure, Worse};
use toolkit::limits::{Limits, NOTICED, TOO_SOFT};
use toolkit::numbers::percent;
use toolkit::summary::{RunStatus, Summary};

/// Shares of which quantiles are reported [%].
pub const SHARES: [u32; 5] = [10, 50, 90, 95, 99];

/// Name of the quantile at a share [%] of a quantity.
pub fn quantile_of(name: &str, share: u32) -> String {
    format!("{name}_q{share}")
}

/// Names of all quantiles of the summary.
pub fn quantiles() -> impl Iterator<Item = String> {
    ranked().flat_map(|(quantity, _)| SHARES.map(|share| quantile_of(quantity.name, share)))
}

/// Quantities of which there are quantiles, and in which direction these are worse.
fn ranked() -> impl Iterator<Item = (&'static MemberQuantity, Worse)> {
    MEMBER_QUANTITIES.iter().filter_map(|quantity| Some((quantity, quantity.quantiles?)))
}

/// What the screen shows before all else.
const FIRST: [&str; 3] = ["run_out_q50", "run_out_q95", "run_out_largest"];

/// From which share of a quantile on it is said how far it may lie below what is reported.
const WIDE: f64 = 0.01;

/// How many members are named.
const NAMED: usize = 10;

/// Values of one quantity: those that are known, and bounds from below of the others.
#[derive(Debug, Clone, Default)]
struct Values {
    known: Vec<f64>,
    at_least: Vec<f64>,
}

impl Values {
    /// All in ascending order, whatever the others come to: these as they were seen last, and behind all that are known.
    fn sorted(&self) -> [Vec<f64>; 2] {
        [None, Some(f64::INFINITY)].map(|behind| {
            let mut all = self.known.clone();
            all.extend(self.at_least.iter().map(|&seen| behind.unwrap_or(seen)));
            all.sort_by(f64::total_cmp);
            all
        })
    }
}

/// Counts and numbers of all members so far.
#[derive(Debug, Clone, Default)]
pub struct Numbers {
    members: u64,
    unreliable: u64,
    failed: u64,
    rest: u64,
    left: u64,
    moving: u64,
    /// Those at rest nearer to their start than their own size: how many, and the first of them.
    stayed: (u64, Vec<u64>),
    /// How many overlapped deeper than is noticed, and the deepest overlap, in radii.
    deep: (u64, f64),
    /// Of each quantity with quantiles.
    values: Vec<Values>,
    first: Option<(u64, String)>,
}

impl Numbers {
    /// Take in a member. One that failed counts as such alone; an unreliable one counts in the quantiles too.
    pub fn add(&mut self, number: u64, outcome: &Outcome) {
        self.members += 1;
        if outcome.status != RunStatus::Done {
            self.first.get_or_insert_with(|| (number, outcome.message()));
        }
        if matches!(outcome.status, RunStatus::Failed | RunStatus::Interrupted) {
            self.failed += 1;
            return;
        }
        self.unreliable += u64::from(outcome.status == RunStatus::Unreliable);
        self.rest += u64::from(outcome.how == How::Rest);
        self.left += u64::from(outcome.how == How::Out);
        self.moving += u64::from(outcome.how == How::Moving);
        if outcome.how == How::Rest && outcome.run_out() < outcome.volume.cbrt() {
            self.stayed.0 += 1;
            if self.stayed.1.len() < NAMED {
                self.stayed.1.push(number);
            }
        }
        self.deep.0 += u64::from(outcome.penetration > NOTICED);
        self.deep.1 = self.deep.1.max(outcome.penetration);
        self.values.resize_with(ranked().count(), Values::default);
        for (values, (quantity, _)) in self.values.iter_mut().zip(ranked()) {
            let ended = outcome.how == How::Rest || !quantity.at_rest;
            (if ended { &mut values.known } else { &mut values.at_least }).push((quantity.of)(outcome));
        }
    }

    /// That members overlapped deeper than is noticed, where the scene has no bound of its own that would make them unreliable.
    pub fn too_deep(&self, limits: &Limits) -> Option<Diagnostic> {
        let (deep, most) = self.deep;
        (deep > 0 && limits.penetration.is_none()).then(|| {
            let what = format!(
                "{deep} of {} members overlapped by more than {NOTICED} radii, the deepest by {most:.3}: there the contact law does not \
                 hold; they count in all shares and quantiles, and with limits.penetration = {NOTICED} each would be unreliable",
                self.members
            );
            Diagnostic::warning(code::TRUST, what).try_instead(TOO_SOFT)
        })
    }

    /// The summary; with more than the share `most_failed` of members that failed or are unreliable it is unreliable itself.
    pub fn summary(mut self, most_failed: f64) -> Summary {
        let mut summary = Summary::new(RunStatus::Done);
        self.counts(&mut summary);
        self.quantiles(&mut summary);
        summary.warnings.extend(self.stayed());
        let mut doubts = Vec::new();
        // What more members than `most_failed` have makes the study unreliable, what fewer have is a warning.
        let found = [self.moving(most_failed), self.untrusted(most_failed)];
        for (is_doubt, said) in found.into_iter().flatten() {
            (if is_doubt { &mut doubts } else { &mut summary.warnings }).push(said);
        }
        if !doubts.is_empty() {
            summary.doubt(doubts);
        }
        summary
    }

    /// How many ended how.
    fn counts(&self, summary: &mut Summary) {
        let Self { members, unreliable, failed, rest, left, moving, .. } = *self;
        let counts = format!(
            "of {members} members {rest} came to rest, {left} left the terrain, {moving} still moved at the end, {failed} failed; \
             {unreliable} of those computed are unreliable"
        );
        summary.warnings.push(Diagnostic::of(Severity::Note, code::OTHER, counts));
        for (name, count, worse) in [
            ("members", members, Worse::Neither),
            ("members_at_rest", rest, Worse::Neither),
            ("members_left", left, Worse::Larger),
            ("members_moving", moving, Worse::Larger),
            ("members_unreliable", unreliable, Worse::Larger),
            ("members_failed", failed, Worse::Larger),
        ] {
            summary.measures.push(Measure::new(name, count as f64, "1").ranked(Measure::ORDINARY, worse));
        }
    }

    /// Quantiles with their intervals and largest values of all quantities that have them.
    fn quantiles(&mut self, summary: &mut Summary) {
        let mut report = |name: String, value: f64, unit: &str, worse: Worse, interval: Option<Interval>| {
            let rank =
                FIRST.iter().position(|first| *first == name).map_or(Measure::ORDINARY, |at| 1 + at as u16);
            let measure = Measure::new(name, value, unit).ranked(rank, worse);
            summary.measures.push(Measure { interval, ..measure });
        };
        let (mut none, mut unknown, mut wide) = (Vec::new(), Vec::new(), Vec::new());
        self.values.resize_with(ranked().count(), Values::default);
        for (values, (&MemberQuantity { name, unit, .. }, worse)) in self.values.iter_mut().zip(ranked()) {
            if values.known.is_empty() && values.at_least.is_empty() {
                none.push(name);
                continue;
            }
            values.known.sort_by(f64::total_cmp);
            let sorted = values.sorted();
            for percent in SHARES {
                let (name, share) = (quantile_of(name, percent), f64::from(percent) / 100.0);
                let [least, most] = sorted.each_ref().map(|all| quantile(all, share));
                if most.is_infinite() {
                    unknown.push(format!("{name} (at least {least:.3} {unit})"));
                    continue;
                }
                // The lower end of the one, the upper end of the other.
                let [low, high] = sorted.each_ref().map(|all| of_quantile(all, share));
                let interval = Interval { low: low.low, high: high.high };
                report(name.clone(), most, unit, worse, Some(interval));
                if most - least > WIDE * most.abs() {
                    wide.push(format!("{name} from {least:.3} to {most:.3} {unit}"));
                }
            }
            let largest = format!("{name}_largest");
            match values.known.last().filter(|_| values.at_least.is_empty()) {
                Some(most) => report(largest, *most, unit, worse, None),
                None => unknown.push(largest),
            }
        }
        if !none.is_empty() {
            let what = format!("quantiles of {} absent: no member was computed", none.join(", "));
            summary.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
        }
        summary.warnings.extend(self.beyond(&wide, &unknown));
    }

    /// Members that did not come to rest, and what that does to quantiles: those that are `wide`, and those that are absent.
    fn beyond(&self, wide: &[String], unknown: &[String]) -> Option<Diagnostic> {
        let (computed, on) = (self.members - self.failed, self.left + self.moving);
        (on > 0 && computed > 0).then(|| {
            let mut what = format!(
                "{on} of {computed} members did not come to rest on the terrain ({} left it, {} still moved): in quantiles of \
                 run-out and time they count as having gone farther and longer than all others",
                self.left, self.moving
            );
            if !wide.is_empty() {
                what += &format!(", which may be too much: {}", wide.join(", "));
            }
            if !unknown.is_empty() {
                what += &format!("; absent: {}", unknown.join(", "));
            }
            let cure = "a larger terrain or a longer end_time may do";
            Diagnostic::warning(code::TRUST, what).try_instead(cure)
        })
    }

    /// Members that came to rest where they started.
    fn stayed(&self) -> Option<Diagnostic> {
        let ((stayed @ 1.., first), members) = (&self.stayed, self.members) else { return None };
        let named = first.iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
        let more = if *stayed > first.len() as u64 { ", ..." } else { "" };
        let what = format!(
            "{stayed} of {members} members came to rest where they started, nearer than their own size: {named}{more}; they count in \
             all shares and quantiles"
        );
        let cure =
            "for rocks that fall a speed in [vary], a height, or a release where the ground is steeper";
        Some(Diagnostic::warning(code::UNUSUAL_VALUE, what).try_instead(cure))
    }

    /// Members that still moved, and whether they are too many.
    fn moving(&self, most_failed: f64) -> Option<(bool, Diagnostic)> {
        let (moving, members, share) = (self.moving, self.members, self.moving as f64 / self.members as f64);
        (moving > 0).then(|| {
            let what = format!(
                "{moving} of {members} members ({}) still moved when the time was over: shares and quantiles at lines, maps and \
                 run-outs are of falls that are not at their end",
                percent(share)
            );
            let cure = match share > most_failed {
                true => format!("raise end_time, or allow it with most_failed = {share:.3}"),
                false => "raise end_time".into(),
            };
            (share > most_failed, Diagnostic::warning(code::TRUST, what).try_instead(cure))
        })
    }

    /// Members that failed or are unreliable, and whether they are too many.
    fn untrusted(&self, most_failed: f64) -> Option<(bool, Diagnostic)> {
        let ((number, why), members) = (self.first.as_ref()?, self.members);
        let bad = self.unreliable + self.failed;
        let share = bad as f64 / members as f64;
        let mut what = format!(
            "{bad} of {members} members ({}) failed or are unreliable; the first, member {number}: {why}",
            percent(share)
        );
        if share <= most_failed {
            return Some((false, Diagnostic::warning(code::TRUST, what)));
        }
        what += &format!("; more than most_failed = {most_failed}");
        let cure = "the column `message` of members.csv has all";
        Some((true, Diagnostic::warning(code::TRUST, what).try_instead(cure)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a member that ended so far from its start [m].
    fn ended(how: How, run_out: f64) -> Outcome {
        let mut outcome = Outcome::failed(Diagnostic::new("why"));
        (outcome.status, outcome.how, outcome.end[0]) = (RunStatus::Done, how, run_out);
        outcome
    }

    #[test]
    fn members_that_overlap_too_deep_are_counted_where_the_scene_has_no_bound() {
        let mut numbers = Numbers::default();
        for penetration in [0.1, 0.573, 0.52, 0.5] {
            let mut outcome = ended(How::Rest, 10.0);
            outcome.penetration = penetration;
            numbers.add(1, &outcome);
        }
        let said = numbers.too_deep(&Limits::default()).expect("two are").to_string();
        assert!(said.contains("2 of 4 members") && said.contains("the deepest by 0.573"), "{said}");
        let bound = Limits { penetration: Some(1.0), ..Limits::default() };
        assert_eq!(numbers.too_deep(&bound).map(|it| it.to_string()), None);
    }

    fn sentences(summary: &Summary) -> String {
        summary.warnings.iter().map(|warning| format!("{warning}\n")).collect()
    }

    /// Rocks at 10, 20, ... 60 m, then two that left the terrain 45 m and 90 m away. The real run-out of these lies beyond: with both
    /// behind all others, 50 % of eight lie within (40 m + 50 m) / 2; with them where they were seen, within (40 m + 45 m) / 2.
    #[test]
    fn rocks_that_left_count_as_having_gone_farther_than_all_others() {
        let mut numbers = Numbers::default();
        let mut add = |how, run_out| numbers.add(1, &ended(how, run_out));
        (1..=6).for_each(|k| add(How::Rest, 10.0 * f64::from(k)));
        add(How::Out, 45.0);
        add(How::Out, 90.0);
        let summary = numbers.summary(0.01);
        assert_eq!(summary.status, RunStatus::Done);
        assert_eq!(summary.measure("run_out_q10"), Some(17.0));
        assert_eq!(summary.measure("run_out_q50"), Some(45.0));
        // Eight are enough for both ends, and the upper one may be one of the two.
        let interval = summary.measures.iter().find(|m| m.name == "run_out_q50").and_then(|m| m.interval);
        assert!(
            interval.is_some_and(|of| of.high.is_none() && of.low.is_some_and(|low| low < 42.5)),
            "{interval:?}"
        );
        assert_eq!(summary.measure("run_out_q90"), None);
        assert_eq!(summary.measure("run_out_q99"), None);
        assert_eq!(summary.measure("run_out_largest"), None);
        let said = sentences(&summary);
        assert!(
            said.contains("2 of 8 members") && said.contains("run_out_q50 from 42.500 to 45.000 m"),
            "{said}"
        );
        assert!(said.contains("run_out_q90 (at least 69.000 m)") && !said.contains("q10"), "{said}");
    }

    /// Rocks of 0.8 m: one that comes to rest 0.79 m away has stayed, one 0.81 m away has not.
    #[test]
    fn members_that_stay_where_they_start_are_named() {
        let mut numbers = Numbers::default();
        for (number, run_out) in [(1, 50.0), (2, 0.79), (3, 0.81), (4, 0.0)] {
            numbers.add(number, &Outcome { volume: 0.512, ..ended(How::Rest, run_out) });
        }
        let said = sentences(&numbers.summary(0.01));
        assert!(
            said.contains("2 of 4 members came to rest where they started") && said.contains(": 2, 4;"),
            "{said}"
        );
    }

    #[test]
    fn members_that_still_move_are_said_and_too_many_make_the_study_unreliable() {
        let of = |moving: u64| {
            let mut numbers = Numbers::default();
            for number in 1..=100 {
                let how = if number <= moving { How::Moving } else { How::Rest };
                numbers.add(number, &ended(how, 0.0));
            }
            numbers.summary(0.01)
        };
        let (one, many) = (of(1), of(20));
        assert_eq!((one.status, many.status), (RunStatus::Done, RunStatus::Unreliable));
        assert!(sentences(&one).contains("1 of 100 members (1 %) still moved"), "{:?}", one.warnings);
        assert!(many.message.is_some_and(|m| m.contains("20 of 100") && m.contains("end_time")));
    }

    #[test]
    fn members_that_failed_are_counted_and_too_many_make_the_study_unreliable() {
        let mut numbers = Numbers::default();
        for number in 1..=99 {
            numbers.add(number, &ended(How::Rest, number as f64));
        }
        numbers.add(100, &Outcome::failed(Diagnostic::new("why")));
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
