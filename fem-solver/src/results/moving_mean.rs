//! Mean of the support reaction over any time of one length, from its impulse.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Impulse since t = 0 at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    time: f64,
    impulse: [f64; 3],
}

/// The history of an impulse, as far back as the mean reaches, straight between the ends of steps.
///
/// The mean is taken at the end of each step: `|J(t) - J(t - span)| / span`. What a window adds
/// stays apart until it is committed.
#[derive(Debug, Clone)]
pub struct MovingMean {
    /// Length of the mean [s].
    span: f64,
    samples: VecDeque<Sample>,
    /// Number of them that are committed.
    committed: usize,
    /// Sample behind which `t - span` lay last.
    cursor: usize,
}

impl MovingMean {
    /// Over `span` [s], of a force that has been `at_rest` [N] before t = 0, with memory for `samples` steps within the span and a
    /// window.
    pub fn new(at_rest: [f64; 3], span: f64, samples: usize) -> Self {
        let samples = VecDeque::with_capacity(2 * samples);
        let mut mean = Self { span, samples, committed: 0, cursor: 0 };
        let before = Sample { time: -span, impulse: at_rest.map(|r| -r * span) };
        mean.go_on(vec![before, Sample { time: 0.0, impulse: [0.0; 3] }]);
        mean
    }

    /// The committed history, for a run that goes on.
    pub fn kept(&self) -> Vec<Sample> {
        self.samples.iter().take(self.committed).copied().collect()
    }

    /// Go on with that history.
    pub fn go_on(&mut self, kept: Vec<Sample>) {
        self.committed = kept.len();
        self.samples.clear();
        self.samples.extend(kept);
        self.begin();
    }

    /// A window begins, from what is committed.
    pub fn begin(&mut self) {
        self.samples.truncate(self.committed);
        self.cursor = 0;
    }

    /// A step ends at `time` and has added `impulse` [N s]. Returns the magnitude of the mean [N].
    pub fn push(&mut self, time: f64, impulse: [f64; 3]) -> f64 {
        let last = self.samples[self.samples.len() - 1].impulse;
        let impulse = [0, 1, 2].map(|c: usize| last[c] + impulse[c]);
        self.samples.push_back(Sample { time, impulse });
        let back = time - self.span;
        while self.cursor + 2 < self.samples.len() && self.samples[self.cursor + 1].time <= back {
            self.cursor += 1;
        }
        let (a, b) = (self.samples[self.cursor], self.samples[self.cursor + 1]);
        let part = if b.time > a.time { (back - a.time) / (b.time - a.time) } else { 1.0 };
        let squares = [0, 1, 2].map(|c: usize| {
            let before = a.impulse[c] + part * (b.impulse[c] - a.impulse[c]);
            (impulse[c] - before).powi(2)
        });
        squares.iter().sum::<f64>().sqrt() / self.span
    }

    /// The window is accepted.
    pub fn commit(&mut self) {
        let back = self.samples.back().map_or(0.0, |s| s.time) - self.span;
        while self.samples.len() > 2 && self.samples[1].time <= back {
            self.samples.pop_front();
        }
        self.committed = self.samples.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_force_is_its_own_mean_from_the_start() {
        let mut mean = MovingMean::new([3.0, 0.0, 4.0], 1e-3, 8);
        for window in 0..40 {
            mean.begin();
            for step in 0..3 {
                let time = (f64::from(window) + f64::from(step + 1) / 3.0) * 1e-4;
                let value = mean.push(time, [1e-4, 0.0, 4e-4 / 3.0]);
                // Differences of sums of some 1e-2 over 1e-3: rounding alone.
                assert!((value - 5.0).abs() < 1e-11, "{value}");
            }
            mean.commit();
        }
    }

    #[test]
    fn a_short_pulse_is_spread_over_one_millisecond_and_forgotten_after() {
        let mut mean = MovingMean::new([0.0; 3], 1e-3, 8);
        let mut values = Vec::new();
        for k in 1..=30 {
            mean.begin();
            mean.push(f64::from(k) * 1e-4, [9.0, 9.0, 9.0]);
            mean.begin();
            values.push(mean.push(f64::from(k) * 1e-4, [if k == 5 { 0.2 } else { 0.0 }, 0.0, 0.0]));
            mean.commit();
        }
        assert_eq!(values[3], 0.0);
        assert!((values[4] - 200.0).abs() < 1e-9 && (values[13] - 200.0).abs() < 1e-9);
        assert!(values[14].abs() < 1e-9 && values[29].abs() < 1e-9, "{values:?}");
    }

    #[test]
    fn a_step_longer_than_the_span_is_cut() {
        let mut mean = MovingMean::new([0.0; 3], 1e-3, 8);
        mean.begin();
        assert!((mean.push(4e-3, [8.0, 0.0, 0.0]) - 2000.0).abs() < 1e-9);
    }
}
