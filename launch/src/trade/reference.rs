//! What a run is compared with: a value that the user gives, or what the finest runs tend to.

use super::result::Outcome;
use std::collections::BTreeMap;

/// Orders of convergence that are believed.
const ORDERS: std::ops::RangeInclusive<f64> = 0.5..=4.5;

/// Changes that hardly shrink are taken to leave at most so many times the last.
const MOST: f64 = 10.0;

/// Where a value comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// The user.
    Given,
    /// Three runs, each twice as fine as the one before, converge with this order, and their limit is extrapolated.
    Extrapolated {
        /// Order.
        order: f64,
    },
    /// The finest run: no order is observed.
    Finest,
}

/// The value of a measure to compare with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Value.
    pub value: f64,
    /// Where it comes from.
    pub source: Source,
    /// How far it may be off, relative; `None`: nothing is known of it.
    pub uncertainty: Option<f64>,
}

impl Known {
    /// Where it comes from, in words.
    pub fn words(&self) -> String {
        match self.source {
            Source::Given => "given by the user".into(),
            Source::Extrapolated { order } => {
                format!("extrapolated from the three finest runs, observed order {order:.1}")
            }
            Source::Finest if self.uncertainty.is_none() => "the only run".into(),
            Source::Finest => "the finest run; no order of convergence is observed".into(),
        }
    }
}

/// From the values of runs, each twice as fine as the one before.
///
/// Source: Richardson extrapolation, `f = f3 + (f3 - f2) / (2^p - 1)` with `p = log2((f1 - f2) / (f2 - f3))`.
pub fn limit(values: &[f64]) -> Option<Known> {
    let finest = *values.last()?;
    let relative = |difference: f64| deviation(finest + difference, finest).abs();
    let [.., first, second, third] = *values else {
        let uncertainty = values.len().checked_sub(2).map(|before| relative(values[before] - finest));
        return Some(Known { value: finest, source: Source::Finest, uncertainty });
    };
    let (before, last) = (first - second, second - third);
    let order = (before / last).log2();
    if before * last > 0.0 && ORDERS.contains(&order) {
        let value = third - last / (order.exp2() - 1.0);
        let uncertainty = Some(relative(value - third));
        return Some(Known { value, source: Source::Extrapolated { order }, uncertainty });
    }
    // Without an order: what is left of the changes if they go on to shrink as they did, and no less than the last.
    let ratio = relative(last) / relative(before);
    let uncertainty = Some(match ratio < 1.0 {
        true => relative(last) * (ratio / (1.0 - ratio)).clamp(1.0, MOST),
        false => relative(before).max(relative(last)),
    });
    Some(Known { value: finest, source: Source::Finest, uncertainty })
}

/// How far `value` is from `reference`, relative to it, with its sign; absolute where that is 0.
pub fn deviation(value: f64, reference: f64) -> f64 {
    if reference == 0.0 { value } else { (value - reference) / reference.abs() }
}

/// What runs are compared with, by measure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reference(pub Vec<(String, Known)>);

impl Reference {
    /// Of these measures, from runs each twice as fine as the one before; `given` takes precedence. A measure that the finest
    /// run lacks has none.
    pub fn of(measures: &[String], given: &BTreeMap<String, f64>, runs: &[&Outcome]) -> Self {
        let known = |name: &String| {
            if let Some(value) = given.get(name) {
                return Some(Known { value: *value, source: Source::Given, uncertainty: None });
            }
            runs.last()?.measure(name)?;
            let lacking = runs.iter().rposition(|run| run.measure(name).is_none()).map_or(0, |at| at + 1);
            let values: Vec<f64> = runs[lacking..].iter().filter_map(|run| run.measure(name)).collect();
            limit(&values)
        };
        Self(measures.iter().filter_map(|name| Some((name.clone(), known(name)?))).collect())
    }

    /// Deviations of a run, relative, with their signs; `None` if it lacks one of the measures.
    pub fn deviations(&self, run: &Outcome) -> Option<Vec<f64>> {
        self.0.iter().map(|(name, known)| Some(deviation(run.measure(name)?, known.value))).collect()
    }

    /// The largest of them.
    pub fn error(&self, run: &Outcome) -> Option<f64> {
        self.deviations(run).map(|all| all.iter().fold(0.0, |most: f64, d| most.max(d.abs())))
    }

    /// How far it may be off itself: the largest of its measures; `None` if nothing is known of one that is computed.
    pub fn uncertainty(&self) -> Option<f64> {
        let computed = self.0.iter().filter(|(_, known)| known.source != Source::Given);
        computed.map(|(_, known)| known.uncertainty).try_fold(0.0, |most: f64, u| Some(most.max(u?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::result::tests::done;

    #[test]
    fn the_limit_of_a_known_order_is_found() {
        // f(h) = 3 + 0.5 h^p.
        for order in [1.0, 2.0, 3.0] {
            let values: Vec<f64> = [1.0_f64, 0.5, 0.25].iter().map(|h| 3.0 + 0.5 * h.powf(order)).collect();
            let known = limit(&values).expect("three runs");
            assert!((known.value - 3.0).abs() < 1e-12, "{known:?}");
            let Source::Extrapolated { order: observed } = known.source else { panic!("{known:?}") };
            assert!((observed - order).abs() < 1e-9, "{observed}");
            assert!((known.uncertainty.expect("known") - (values[2] - 3.0) / values[2]).abs() < 1e-12);
        }
    }

    #[test]
    fn no_order_is_made_up() {
        // Back and forth, growing apart, unreasonably fast.
        for values in [[1.0, 1.1, 1.05], [1.0, 1.1, 1.3], [1.0, 1.1, 1.100_001]] {
            let known = limit(&values).expect("three runs");
            assert_eq!((known.source, known.value), (Source::Finest, values[2]), "{values:?}");
            let off = known.uncertainty.expect("known");
            let (before, last) = (values[0] - values[1], values[1] - values[2]);
            // All further changes together, if each is as much smaller: a geometric series, summed up term by term.
            let ratio = (last / before).abs();
            let rest: f64 = (1..200).map(|n| last.abs() * ratio.powi(n)).sum();
            let least = if ratio < 1.0 { rest.max(last.abs()) } else { before.abs().max(last.abs()) };
            assert!((off * values[2] - least).abs() < 1e-12, "{values:?}: {off}");
        }
        assert_eq!(limit(&[2.0]).map(|known| known.uncertainty), Some(None));
        assert_eq!(limit(&[]), None);
    }

    #[test]
    fn a_given_value_comes_first_and_a_run_without_a_measure_has_no_error() {
        let runs = [done("depth", 0.5, 1.0), done("depth", 0.4, 1.0)];
        let runs: Vec<_> = runs.iter().collect();
        let measures = ["depth".to_owned()];
        let given = Reference::of(&measures, &BTreeMap::from([("depth".to_owned(), 0.25)]), &runs);
        assert_eq!((given.error(runs[0]), given.uncertainty()), (Some(1.0), Some(0.0)));
        let own = Reference::of(&measures, &BTreeMap::new(), &runs);
        assert!((own.error(runs[0]).expect("there") - 0.25).abs() < 1e-12);
        assert!((own.uncertainty().expect("two runs") - 0.25).abs() < 1e-12);
        assert_eq!(own.error(&done("speed", 0.4, 1.0)), None);
        // A measure that came late: from the runs that have it.
        let late = [done("speed", 1.0, 1.0), done("depth", 0.4, 1.0)];
        let reference = Reference::of(&measures, &BTreeMap::new(), &late.iter().collect::<Vec<_>>());
        assert_eq!(reference.0[0].1.uncertainty, None);
    }
}
