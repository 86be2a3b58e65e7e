//! How many blocks a year reach or exceed a value at a line, and the value of a return period: the releases by their rates, whatever
//! share of the members each has.
//!
//! The interval of a value of a return period is where that of its frequency holds one over the period (Woodruff 1952, J. Am. Stat. Assoc. 47).

use crate::bounds::{Part, between, of_frequency};
use interface_defs::message::Interval;

/// Return periods of which values are reported [years].
pub const PERIODS: [u32; 4] = [10, 30, 100, 300];

/// Name of the value of a return period of a quantity.
pub fn value_of(name: &str, years: u32) -> String {
    format!("{name}_{years}_years")
}

/// What comes from a release.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// Its blocks a year.
    pub rate: f64,
    /// Its members that were computed.
    pub all: u64,
    /// Largest values of those that come here, in ascending order.
    pub values: &'a [f64],
}

/// Blocks a year whose value reaches or exceeds this one.
pub fn reaching(sources: &[Source], value: f64) -> (f64, Interval) {
    count(sources, |v| v < value)
}

/// Blocks a year with a value that is not `below`.
fn count(sources: &[Source], below: impl Fn(f64) -> bool) -> (f64, Interval) {
    of_frequency(sources.iter().map(|&Source { rate, all, values }| {
        let count = values.len() - values.partition_point(|v| below(*v));
        Part { rate, count: count as u64, all }
    }))
}

/// The value that is reached once in so many years on average, between two of all values in ascending order, with its interval. `None`:
/// rocks come less often, or it lies above the largest one; it is not estimated from beyond what was found.
pub fn of_period(sources: &[Source], sorted: &[f64], years: f64) -> Option<(f64, Interval)> {
    let due = 1.0 / years;
    let found = |value: f64| reaching(sources, value).0;
    let rarer = sorted.partition_point(|v| found(*v) >= due);
    let pair = [sorted[rarer.checked_sub(1)?], *sorted.get(rarer)?];
    let [often, seldom] = pair.map(found);
    let value = between(pair, (often - due) / (often - seldom));
    let low = sorted.partition_point(|v| reaching(sources, *v).1.low >= Some(due));
    let high = sorted.partition_point(|v| count(sources, |other| other <= *v).1.high > Some(due));
    // Where nearly all of a release come here, a step may be longer than the interval.
    let high = sorted.get(high).map(|high| high.max(value));
    Some((value, Interval { low: low.checked_sub(1).map(|at| sorted[at]), high }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 1 to 10 of ten members, 0.1 blocks a year; one more value of another release, 0.05 a year.
    #[test]
    fn values_of_return_periods_lie_between_two_members_or_are_not_known() {
        let ten: Vec<f64> = (1..=10).map(f64::from).collect();
        let source = |rate, all, values| Source { rate, all, values };
        let one = [source(0.1, 10, &ten)];
        assert!((reaching(&one, 7.0).0 - 0.04).abs() < 1e-15);
        // 7 and more come 0.04 times a year, 8 and more 0.03 times.
        assert!(of_period(&one, &ten, 1.0 / 0.035).is_some_and(|(value, _)| (value - 7.5).abs() < 1e-9));
        assert!(of_period(&one, &ten, 9.0).is_none());
        assert!(of_period(&one, &ten, 300.0).is_none());
        let both = [one[0], source(0.05, 5, &[7.5])];
        let all = [&ten[..7], &[7.5], &ten[7..]].concat();
        assert!(
            (reaching(&both, 7.5).0 - 0.04).abs() < 1e-15 && (reaching(&both, 7.0).0 - 0.05).abs() < 1e-15
        );
        assert!(of_period(&both, &all, 1.0 / 0.045).is_some_and(|(value, _)| (value - 7.25).abs() < 1e-9));
    }

    /// Of many members of a known distribution the interval holds the true value, and narrows.
    #[test]
    fn intervals_of_return_periods_hold_the_value() {
        let mut before = f64::INFINITY;
        for count in [200_u32, 2_000, 20_000] {
            let values: Vec<f64> = (0..count).map(|k| (f64::from(k) + 0.5) / f64::from(count)).collect();
            let sources = [Source { rate: 0.2, all: count.into(), values: &values }];
            // 0.2 (1 - x) = 1 / 100.
            let (value, of) = of_period(&sources, &values, 100.0).expect("known");
            let [low, high] = of.ends().expect("enough");
            println!("{count}: {value} [{low}, {high}]");
            assert!((value - 0.95).abs() < 0.5 / f64::from(count) + 1e-9, "{value}");
            assert!(low < 0.95 && 0.95 < high && high - low < before);
            before = 0.5 * (high - low);
        }
        // Of 30 members none may reach what 2 % of all do.
        let values: Vec<f64> = (0..30).map(f64::from).collect();
        let sources = [Source { rate: 1.0, all: 30, values: &values }];
        let (_, of) = of_period(&sources, &values, 20.0).expect("known");
        assert!(of.low.is_some() && of.high.is_none(), "{of:?}");
    }
}
