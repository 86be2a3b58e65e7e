//! Which points are worth their cost: no other is both cheaper and more accurate.

/// A point's cost and error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trade {
    /// [s]
    pub cost: f64,
    /// Relative.
    pub error: f64,
}

impl Trade {
    fn is_finite(&self) -> bool {
        self.cost.is_finite() && self.error.is_finite()
    }
}

/// Those that no other beats, the cheapest first.
pub fn front<P>(mut all: Vec<(P, Trade)>) -> Vec<(P, Trade)> {
    all.retain(|(_, trade)| trade.is_finite());
    all.sort_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost).then(a.error.total_cmp(&b.error)));
    let mut best = f64::INFINITY;
    all.retain(|(_, trade)| {
        let before = best;
        best = best.min(trade.error);
        trade.error < before
    });
    all
}

/// Those that would be on the front if they cost `factor` times less: the noise of one run may hide them.
pub fn near_front<P: Copy>(all: &[(P, Trade)], factor: f64) -> Vec<P> {
    let beaten =
        |one: &Trade| all.iter().any(|(_, other)| other.error <= one.error && other.cost < one.cost / factor);
    all.iter().filter(|(_, trade)| trade.is_finite() && !beaten(trade)).map(|(point, _)| *point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trades(all: &[(f64, f64)]) -> Vec<(usize, Trade)> {
        all.iter().map(|(cost, error)| Trade { cost: *cost, error: *error }).enumerate().collect()
    }

    fn places(all: Vec<(usize, Trade)>) -> Vec<usize> {
        all.into_iter().map(|(place, _)| place).collect()
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
        assert_eq!(places(front(all.clone())), [1, 3, 0]);
        // By definition.
        for (i, one) in &all {
            let beats = |(_, o): &(usize, Trade)| {
                o.cost <= one.cost && o.error <= one.error && (o.cost < one.cost || o.error < one.error)
            };
            let finite = one.cost.is_finite() && one.error.is_finite();
            assert_eq!(places(front(all.clone())).contains(i), finite && !all.iter().any(beats), "{i}");
        }
        assert!(front::<usize>(Vec::new()).is_empty());
    }

    #[test]
    fn what_noise_may_hide_is_near_the_front() {
        let all = trades(&[(1.0, 0.1), (1.4, 0.1), (1.6, 0.1), (1.6, 0.05), (3.0, 0.05)]);
        assert_eq!(near_front(&all, 1.5), [0, 1, 3]);
        assert_eq!(near_front(&all, 1.0), places(front(all)));
    }
}
