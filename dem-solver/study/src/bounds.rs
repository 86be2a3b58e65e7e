//! Quantiles and shares of a sample, and how far they may be off: what is said of members holds for all rocks that could fall.
//!
//! Members count as drawn independently of each other. Latin hypercubes, Sobol's sequence, levels and several releases spread them more
//! evenly: intervals are then rather too wide. Order statistics bound quantiles whatever the distribution; an end of an interval lies
//! between two of them, so that it holds as often as it says, not more often.
//!
//! Sources: Wilson (1927), J. Am. Stat. Assoc. 22; Nyblom (1992), Stat. Probab. Lett. 14, which at the median is Hettmansperger and
//! Sheather (1986), Stat. Probab. Lett. 4; Zou and Donner (2008), Stat. Med. 27.

use interface_defs::message::Interval;
use statrs::function::factorial::ln_binomial;

/// Confidence of intervals, two-sided, and of upper bounds, one-sided.
pub const CONFIDENCE: f64 = 0.95;
/// The same of each side of an interval.
const SIDE: f64 = 0.5 + 0.5 * CONFIDENCE;
/// Standard deviations of a normal distribution that hold as much.
const DEVIATIONS: f64 = 1.959_963_984_540_054;

/// The quantile at a share (0 to 1) of numbers in ascending order, at least one, between two of them in proportion.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    between([sorted[below], sorted[above]], place - below as f64)
}

/// So far from the first to the second.
pub fn between([from, to]: [f64; 2], part: f64) -> f64 {
    // Not times an infinite difference.
    if part == 0.0 || from == to { from } else { from + part * (to - from) }
}

/// Wilson's interval of the share that `count` of `all` were found to be.
pub fn of_share(count: u64, all: u64) -> Interval {
    let (k, n, square) = (count as f64, all as f64, DEVIATIONS * DEVIATIONS);
    let middle = (k + 0.5 * square) / (n + square);
    let half = DEVIATIONS * (k * (n - k) / n + 0.25 * square).sqrt() / (n + square);
    Interval { low: Some((middle - half).max(0.0)), high: Some((middle + half).min(1.0)) }
}

/// So many members of a release, of all that were computed, and the blocks a year for which all of these stand.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    /// Blocks a year.
    pub rate: f64,
    /// Members that count.
    pub count: u64,
    /// All of the release, one at least.
    pub all: u64,
}

/// How many blocks a year parts of all releases stand for, with the interval: rates are taken as known, shares are not. Of one release it
/// is Wilson's times the rate. Of several the distances of the ends of each are added as errors that are independent of each other.
pub fn of_frequency(parts: impl Iterator<Item = Part>) -> (f64, Interval) {
    let (mut found, mut squares) = (0.0, [0.0; 2]);
    for Part { rate, count, all } in parts {
        let (share, of) = (count as f64 / all as f64, of_share(count, all));
        found += rate * share;
        for (sum, end) in squares.iter_mut().zip([of.low, of.high]) {
            *sum += (rate * (end.unwrap_or(share) - share)).powi(2);
        }
    }
    let [below, above] = squares.map(f64::sqrt);
    (found, Interval { low: Some((found - below).max(0.0)), high: Some(found + above) })
}

/// The smallest number k of rocks with `P(B <= k) >= confidence`, where B of `count` rocks lie below the quantile at `share`; that
/// probability, and the one of k - 1. `None`: there is none below `count`.
fn reaching(count: usize, share: f64, confidence: f64) -> Option<(usize, [f64; 2])> {
    let n = count as f64;
    // Below this the sum is nothing: ten deviations.
    let first = n * share - 10.0 * (1.0 + (n * share * (1.0 - share)).sqrt());
    let first = first.max(0.0) as usize;
    let (mut before, mut sum) = (0.0, 0.0);
    let mut log = ln_binomial(count as u64, first as u64)
        + first as f64 * share.ln()
        + (count - first) as f64 * (1.0 - share).ln();
    for k in first..count {
        sum += log.exp();
        if sum >= confidence {
            return Some((k, [before, sum]));
        }
        before = sum;
        log += ((count - k) as f64 / (k + 1) as f64 * share / (1.0 - share)).ln();
    }
    None
}

/// What a quantile does not exceed with [`CONFIDENCE`]: never less confidence, so an order statistic itself. `None`: the sample is too small.
pub fn upper(sorted: &[f64], share: f64) -> Option<f64> {
    reaching(sorted.len(), share, CONFIDENCE).map(|(k, _)| sorted[k])
}

/// Number of rocks from which on there is such a bound of the quantile at `share`.
pub fn least(share: f64) -> usize {
    ((1.0 - CONFIDENCE).ln() / share.ln()).ceil() as usize
}

/// Where in a sample of some size the two ends of the interval of a quantile lie.
#[derive(Debug, Clone, Copy)]
pub struct Ends {
    /// Counted from the largest value and from the smallest one: the place, and how far from the one before it.
    low: Option<(usize, f64)>,
    high: Option<(usize, f64)>,
}

impl Ends {
    /// Of the quantile at `share` (0 to 1) of `count` numbers.
    pub fn of(count: usize, share: f64) -> Self {
        let side = |share: f64| {
            let (k, [before, reached]) = reaching(count, share, SIDE)?;
            let odds = k as f64 * (1.0 - share) / ((count - k) as f64 * share);
            Some((k, 1.0 / (1.0 + odds * (reached - SIDE) / (SIDE - before))))
        };
        Self { low: side(1.0 - share), high: side(share) }
    }

    /// In this sample, in ascending order, of that size.
    pub fn on(&self, sorted: &[f64]) -> Interval {
        let last = sorted.len().saturating_sub(1);
        let low = |(k, part): (usize, f64)| between([(k.max(1) - 1), k].map(|k| sorted[last - k]), part);
        let high = |(k, part): (usize, f64)| between([(k.max(1) - 1), k].map(|k| sorted[k]), part);
        Interval { low: self.low.map(low), high: self.high.map(high).filter(|high| high.is_finite()) }
    }
}

/// Interval of the quantile at `share` (0 to 1) of what numbers in ascending order are a sample of.
pub fn of_quantile(sorted: &[f64], share: f64) -> Interval {
    Ends::of(sorted.len(), share).on(sorted)
}

#[cfg(test)]
mod tests;
