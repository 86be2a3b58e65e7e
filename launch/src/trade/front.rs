//! Which points are worth their cost: no other is both cheaper and more accurate.

/// A point's cost and error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trade {
    /// [s]
    pub cost: f64,
    /// Relative.
    pub error: f64,
}

/// The places of those that no other beats, the cheapest first.
pub fn front(all: &[Trade]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..all.len()).filter(|i| all[*i].cost.is_finite() && all[*i].error.is_finite()).collect();
    order.sort_by(|a, b| all[*a].cost.total_cmp(&all[*b].cost).then(all[*a].error.total_cmp(&all[*b].error)));
    let mut best = f64::INFINITY;
    order.retain(|i| {
        let better = all[*i].error < best;
        best = best.min(all[*i].error);
        better
    });
    order
}

/// The places of those that would be on the front if they cost `factor` times less: the noise of one run may hide them.
pub fn near_front(all: &[Trade], factor: f64) -> Vec<usize> {
    let beaten =
        |one: &Trade| all.iter().any(|other| other.error <= one.error && other.cost < one.cost / factor);
    (0..all.len())
        .filter(|i| all[*i].cost.is_finite() && all[*i].error.is_finite() && !beaten(&all[*i]))
        .collect()
}

/// The cheapest whose error is at most `accuracy`.
pub fn cheapest(all: &[Trade], accuracy: f64) -> Option<usize> {
    front(all).into_iter().find(|i| all[*i].error <= accuracy)
}

/// The most accurate.
pub fn best(all: &[Trade]) -> Option<usize> {
    front(all).pop()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trades(all: &[(f64, f64)]) -> Vec<Trade> {
        all.iter().map(|(cost, error)| Trade { cost: *cost, error: *error }).collect()
    }

    #[test]
    fn the_front_holds_those_that_no_other_beats() {
        let all = trades(&[
            (4.0, 0.001),
            (1.0, 0.1),
            (2.0, 0.2),
            (2.0, 0.05),
            (3.0, 0.05),
            (f64::NAN, 0.0),
            (0.5, f64::INFINITY),
        ]);
        assert_eq!(front(&all), [1, 3, 0]);
        // By definition.
        for (i, one) in all.iter().enumerate() {
            let beats = |o: &Trade| {
                o.cost <= one.cost && o.error <= one.error && (o.cost < one.cost || o.error < one.error)
            };
            let finite = one.cost.is_finite() && one.error.is_finite();
            assert_eq!(front(&all).contains(&i), finite && !all.iter().any(beats), "{i}");
        }
    }

    #[test]
    fn what_noise_may_hide_is_near_the_front() {
        let all = trades(&[(1.0, 0.1), (1.4, 0.1), (1.6, 0.1), (1.6, 0.05), (3.0, 0.05)]);
        assert_eq!(near_front(&all, 1.5), [0, 1, 3]);
        assert_eq!(near_front(&all, 1.0), front(&all));
    }

    #[test]
    fn the_cheapest_at_an_accuracy_and_the_best() {
        let all = trades(&[(4.0, 0.001), (1.0, 0.1), (2.0, 0.05)]);
        assert_eq!(cheapest(&all, 0.1), Some(1));
        assert_eq!(cheapest(&all, 0.03), Some(0));
        assert_eq!(cheapest(&all, 1e-4), None);
        assert_eq!(best(&all), Some(0));
        assert_eq!(best(&[]), None);
    }
}
