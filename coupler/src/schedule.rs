//! Which window comes next: full ones at multiples of the scene's window, halves where one failed.
//!
//! Times are computed from whole numbers, never summed up: `(index + part/2^level) window`.

/// Windows in order.
#[derive(Debug, Clone)]
pub struct Schedule {
    window: f64,
    end: f64,
    min_window: f64,
    /// Full windows behind us.
    index: u64,
    /// Halvings of the current full window, and equal parts of that length behind us in it.
    level: u32,
    part: u64,
    /// Number of the window to come.
    number: u64,
}

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
        Self { window, end, min_window, index: 0, level: 0, part: 0, number: 1 }
    }

    /// Full windows of the run; the last may be shorter. An end that misses a multiple by rounding is that multiple.
    pub fn full_windows(&self) -> u64 {
        ((self.end / self.window) * (1.0 - 1e-12)).ceil().max(1.0) as u64
    }

    /// The window to solve next; `None` at the end.
    pub fn next(&self) -> Option<Span> {
        (self.index < self.full_windows()).then(|| {
            let parts = (1u64 << self.level) as f64;
            let last = self.index + 1 == self.full_windows();
            let full = if last { self.end - self.index as f64 * self.window } else { self.window };
            let start = self.index as f64 * self.window + self.part as f64 / parts * full;
            Span { number: self.number, start, length: full / parts, level: self.level }
        })
    }

    /// The window was committed: go on behind it.
    pub fn accept(&mut self) {
        self.number += 1;
        self.part += 1;
        while self.level > 0 && self.part.is_multiple_of(2) {
            self.part /= 2;
            self.level -= 1;
        }
        if self.level == 0 {
            self.index += 1;
            self.part = 0;
        }
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
        self.level += 1;
        self.part *= 2;
        self.number += 1;
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
    fn a_failed_window_comes_back_in_halves_and_the_full_length_at_the_next_multiple() {
        let mut schedule = Schedule::new(1.0, 3.0, 0.25);
        assert!(schedule.halve());
        assert!(schedule.halve());
        assert!(!schedule.halve(), "below the smallest window");
        let mut seen = Vec::new();
        while let Some(span) = schedule.next() {
            seen.push((span.start, span.length));
            schedule.accept();
        }
        assert_eq!(seen, [(0.0, 0.25), (0.25, 0.25), (0.5, 0.5), (1.0, 1.0), (2.0, 1.0)]);
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
