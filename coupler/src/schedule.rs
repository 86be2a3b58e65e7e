//! Which window comes next: full ones at multiples of the scene's window, halves where one failed, many at once where nothing
//! happens.
//!
//! Times are computed from whole numbers, never summed up: `(index + part/2^level) window`.
//!
//! A length that failed is remembered: shorter windows go on for a while before a longer one is tried again, and longer
//! each time that it fails again.

use serde::{Deserialize, Serialize};

/// Windows in order.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Schedule {
    window: f64,
    end: f64,
    min_window: f64,
    /// Full windows behind us.
    index: u64,
    /// Halvings of the current full window, and equal parts of that length behind us in it.
    level: u32,
    part: u64,
    /// Full windows that the next one is made of, where it is not halved.
    many: u64,
    /// Halvings that windows have as long as the failure of a longer one is remembered.
    kept: u32,
    /// Windows of that length since, and as many as there must be before a longer one is tried.
    since: u32,
    patience: u32,
    /// Whether the window under way is the trial of a longer one.
    trial: bool,
    /// Number of the window to come.
    number: u64,
}

/// Windows after which a longer one is tried again: at first, and at most.
const PATIENCE: [u32; 2] = [4, 64];

/// One window to solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Number, from 1.
    pub number: u64,
    /// Start [s].
    pub start: f64,
    /// Length [s].
    pub length: f64,
    /// How often the scene's window was halved for it.
    pub level: u32,
}

impl Span {
    /// End [s].
    pub fn end(&self) -> f64 {
        self.start + self.length
    }
}

impl Schedule {
    /// Windows of length `window` from 0 to `end`, halved down to `min_window` [s].
    pub fn new(window: f64, end: f64, min_window: f64) -> Self {
        Self { window, end, min_window, many: 1, patience: PATIENCE[0], number: 1, ..Self::default() }
    }

    /// Full windows of the run; the last may be shorter. An end that misses a multiple by rounding is that multiple.
    pub fn full_windows(&self) -> u64 {
        ((self.end / self.window) * (1.0 - 1e-12)).ceil().max(1.0) as u64
    }

    /// The window to solve next; `None` at the end.
    pub fn next(&self) -> Option<Span> {
        (self.index < self.full_windows()).then(|| {
            let parts = (1u64 << self.level) as f64;
            let many = if self.level == 0 { self.many } else { 1 };
            let behind = self.index + many;
            let last = behind >= self.full_windows();
            let full = match (last, many) {
                (true, _) => self.end - self.index as f64 * self.window,
                (false, 1) => self.window,
                (false, _) => behind as f64 * self.window - self.index as f64 * self.window,
            };
            let start = self.index as f64 * self.window + self.part as f64 / parts * full;
            Span { number: self.number, start, length: full / parts, level: self.level }
        })
    }

    /// Let the next window be as long as full windows fit into `time` [s], up to the next multiple of `interval` [s]; a window
    /// that has been halved stays as it is.
    pub fn lengthen(&mut self, time: f64, interval: f64) {
        if self.level > 0 || self.kept > 0 {
            return;
        }
        let start = self.index as f64 * self.window;
        let next_row = ((start / interval * (1.0 + 1e-9)).floor() + 1.0) * interval;
        let most = time.min(next_row - start) / self.window * (1.0 + 1e-9);
        self.many = if most >= 2.0 { (most as u64).min(self.full_windows() - self.index) } else { 1 };
    }

    /// Something touches in a window that was made longer: it begins anew in the usual length.
    pub fn shorten(&mut self) {
        self.number += 1;
        self.many = 1;
    }

    /// The window was committed: go on behind it.
    pub fn accept(&mut self) {
        self.number += 1;
        if self.level == 0 {
            self.index += std::mem::replace(&mut self.many, 1);
        } else {
            self.part += 1;
        }
        while self.level > 0 && self.part.is_multiple_of(2) {
            self.part /= 2;
            self.level -= 1;
        }
        if self.level == 0 && self.part > 0 {
            self.index += 1;
            self.part = 0;
        }
        if std::mem::take(&mut self.trial) {
            self.patience = PATIENCE[0];
        }
        self.keep();
    }

    /// Cut what comes next as finely as is remembered; try a longer one when it is time.
    fn keep(&mut self) {
        if self.level >= self.kept {
            self.since += u32::from(self.level == self.kept);
            return;
        }
        self.since += 1;
        // The borders of a longer window are reached: it is tried, or its halves follow.
        if self.since >= self.patience {
            (self.since, self.trial) = (0, true);
            self.kept -= 1;
        }
        let deeper = self.kept.saturating_sub(self.level);
        self.part <<= deeper;
        self.level += deeper;
    }

    /// Whether half of the next window is not shorter than allowed.
    pub fn can_halve(&self) -> bool {
        self.next().is_some_and(|span| span.length / 2.0 >= self.min_window * (1.0 - 1e-9) && self.level < 40)
    }

    /// The window failed: its first half is next. `false` if that is shorter than allowed.
    pub fn halve(&mut self) -> bool {
        if !self.can_halve() {
            return false;
        }
        self.number += 1;
        if self.level == 0 && self.many > 1 {
            self.many /= 2;
            return true;
        }
        if std::mem::take(&mut self.trial) {
            self.patience = (2 * self.patience).min(PATIENCE[1]);
        }
        self.level += 1;
        self.part *= 2;
        (self.kept, self.since) = (self.level, 0);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_windows_stand_at_exact_multiples() {
        let mut schedule = Schedule::new(1e-4, 0.03, 1e-6);
        let mut last = None;
        for index in 0..300 {
            let span = schedule.next().unwrap();
            assert_eq!(span.start, index as f64 * 1e-4);
            last = Some(span);
            schedule.accept();
        }
        assert_eq!(schedule.next(), None);
        assert!((last.unwrap().end() - 0.03).abs() < 1e-17);
    }

    #[test]
    fn a_failed_length_is_remembered_for_a_while() {
        let mut schedule = Schedule::new(1.0, 3.0, 0.25);
        assert!(schedule.halve());
        assert!(schedule.halve());
        assert!(!schedule.halve(), "below the smallest window");
        let mut seen = Vec::new();
        while let Some(span) = schedule.next() {
            seen.push((span.start, span.length));
            schedule.accept();
        }
        let quarters = [(0.0, 0.25), (0.25, 0.25), (0.5, 0.25), (0.75, 0.25)];
        let halves = [(1.0, 0.5), (1.5, 0.5), (2.0, 0.5), (2.5, 0.5)];
        assert_eq!(seen, [quarters, halves].concat());
    }

    /// Windows above half the length fail always: how many of them are tried?
    #[test]
    fn a_length_that_fails_again_and_again_is_tried_ever_more_seldom() {
        let mut schedule = Schedule::new(1.0, 1000.0, 0.1);
        let (mut failed, mut solved, mut time) = (0, 0, 0.0);
        while let Some(span) = schedule.next() {
            assert!((span.start - time).abs() < 1e-9);
            if span.length > 0.5 {
                failed += 1;
                assert!(schedule.halve());
            } else {
                solved += 1;
                time = span.end();
                schedule.accept();
            }
        }
        assert_eq!(solved, 2000);
        assert!(failed < 40, "{failed}");
    }

    #[test]
    fn a_window_in_flight_goes_as_far_as_time_and_the_next_row_allow() {
        let mut schedule = Schedule::new(1e-3, 0.1, 1e-5);
        schedule.lengthen(7.5e-3, 1e-2);
        assert!((schedule.next().unwrap().length - 7e-3).abs() < 1e-15);
        schedule.accept();
        schedule.lengthen(1.0, 1e-2);
        assert!((schedule.next().unwrap().length - 3e-3).abs() < 1e-15, "to the row at 10 ms");
        assert!(schedule.halve());
        assert_eq!(schedule.next().unwrap().length, 1e-3, "half of three, in whole windows");
        schedule.accept();
        schedule.lengthen(1.0, 1e-2);
        let long = schedule.next().unwrap();
        schedule.shorten();
        let usual = schedule.next().unwrap();
        assert!(
            long.length > 1.5e-3
                && usual.length == 1e-3
                && (usual.start, usual.number) == (long.start, long.number + 1)
        );
        schedule.accept();
        schedule.lengthen(5e-4, 1e-2);
        assert_eq!(schedule.next().unwrap().length, 1e-3);
        while schedule.next().is_some() {
            schedule.accept();
        }
    }

    #[test]
    fn the_last_window_ends_where_the_run_ends() {
        let mut schedule = Schedule::new(0.4, 1.0, 0.1);
        schedule.accept();
        schedule.accept();
        let span = schedule.next().unwrap();
        assert_eq!((span.start, span.end()), (0.8, 1.0));
        schedule.halve();
        schedule.accept();
        assert_eq!(schedule.next().unwrap().end(), 1.0);
        schedule.accept();
        assert_eq!(schedule.next(), None);
    }

    #[test]
    fn every_attempt_has_a_number_of_its_own() {
        let mut schedule = Schedule::new(1.0, 2.0, 0.1);
        let first = schedule.next().unwrap().number;
        schedule.halve();
        let half = schedule.next().unwrap().number;
        schedule.accept();
        assert_eq!((first, half, schedule.next().unwrap().number), (1, 2, 3));
    }
}
