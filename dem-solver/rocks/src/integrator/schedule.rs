//! How a window is cut into steps, and where in the mesh's motion they lie.

use crate::model::{Model, Span};
use dem_contact::contact::broad_phase::mesh_pairs::Instant;
use dem_contact::interface_mesh::local_net::NetStep;
use interface_defs::Window;
use num_integer::lcm;

/// Division of a window into steps.
#[derive(Debug, Clone, Copy)]
pub struct Cut {
    /// Steps in the window.
    pub steps: usize,
    /// Their length [s].
    pub h: f64,
    /// Parts of the window between the samples of the mesh's motion.
    pub segments: usize,
    /// Steps of this length since t = 0 before the window; `None` if its start is no multiple of them.
    first: Option<u64>,
}

impl Cut {
    /// Equal steps, none longer than `step` [s], none over the border of a segment or of one of
    /// `samples` equal parts: their work and their means are exact.
    ///
    /// `finer` times as many where a contact asks for it. A window that is as long as several of the `usual` length [s] has
    /// their steps, to the last bit.
    pub fn new(
        window: &Window,
        (step, usual): (f64, f64),
        segments: usize,
        samples: &[usize],
        finer: usize,
    ) -> Self {
        let unit = samples.iter().filter(|p| **p > 0).fold(segments, |unit, p| lcm(unit, *p));
        let steps = |window: &Window| window.steps(step).div_ceil(unit) * unit * finer;
        let whole = |time: f64| {
            let count = (time / usual).round();
            ((count * usual - time).abs() <= 1e-9 * usual && count.is_finite()).then_some(count as u64)
        };
        match (whole(window.length), whole(window.start)) {
            (Some(many @ 1..), Some(before)) => {
                let of_one = steps(&Window { length: usual, ..*window });
                let first = Some(before * of_one as u64);
                Self { steps: of_one * many as usize, h: usual / of_one as f64, segments, first }
            }
            _ => {
                let steps = steps(window);
                Self { steps, h: window.length / steps as f64, segments, first: None }
            }
        }
    }

    /// When step `step` of a window begins [s].
    fn begins(&self, window: &Window, step: usize) -> f64 {
        match self.first {
            Some(first) => (first + step as u64) as f64 * self.h,
            None => window.start + self.h * step as f64,
        }
    }

    /// The middle of step `step`.
    pub fn middle(&self, step: usize) -> Instant {
        self.within(step, 0.5)
    }

    /// The end of step `step`.
    pub fn end(&self, step: usize) -> Instant {
        self.within(step, 1.0)
    }

    fn within(&self, step: usize, share: f64) -> Instant {
        let per = self.steps / self.segments;
        let along = ((step % per) as f64 + share) / per as f64;
        Instant { segment: step / per, along, elapsed: (step as f64 + share) * self.h }
    }
}

/// What a window is computed from, beside the state.
#[derive(Clone, Copy)]
pub struct Request<'a> {
    /// What does not change.
    pub model: &'a Model,
    /// Motion of the mesh and what else was agreed.
    pub input: &'a [f64],
    /// Length of the window [s].
    pub length: f64,
}

/// A window as it is cut.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// What it is computed from.
    pub request: Request<'a>,
    /// The window.
    pub window: &'a Window,
    /// Its division into steps.
    pub cut: Cut,
}

/// Part number `part` of `parts` equal ones of the group of `steps` steps that begins with number `step`.
#[derive(Clone, Copy)]
pub struct SubStep<'a> {
    /// Its window.
    pub task: Task<'a>,
    /// First step of the group.
    pub step: usize,
    /// Steps in the group.
    pub steps: usize,
    /// Number of the part, from 0.
    pub part: usize,
    /// Parts of the group.
    pub parts: usize,
}

impl SubStep<'_> {
    /// Its length [s].
    fn length(&self) -> f64 {
        let h = self.task.cut.h;
        if self.parts == self.steps { h } else { h * self.steps as f64 / self.parts as f64 }
    }

    /// It as a step of the net, which is cut as the window is.
    pub fn of_net(&self) -> NetStep {
        let Cut { steps, h, segments, .. } = self.task.cut;
        NetStep { number: self.step, steps, h, segments }
    }

    /// When it is.
    pub fn span(&self) -> Span {
        let (first, h) = (self.task.cut.begins(self.task.window, self.step), self.length());
        Span { start: if self.part == 0 { first } else { first + h * self.part as f64 }, h }
    }

    /// Its end [s], and the step of the window that ends there, if one does, counted from 1.
    pub fn end(&self) -> (f64, Option<usize>) {
        let Task { window, cut, .. } = self.task;
        let next = self.part + 1;
        if next < self.parts && self.parts != self.steps {
            let Span { start, h } = self.span();
            return (start + h, None);
        }
        let step = self.step + if next == self.parts { self.steps } else { next };
        let end = if step == cut.steps { window.end() } else { cut.begins(window, step) };
        (end, Some(step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middles_and_ends_of_steps_lie_where_the_wall_is_at_that_time() {
        let cut = Cut { steps: 6, h: 0.5, segments: 2, first: None };
        let at = cut.middle(4);
        assert_eq!((at.segment, at.along, at.elapsed), (1, 0.5, 2.25));
        let at = cut.end(2);
        assert_eq!((at.segment, at.along, at.elapsed), (0, 1.0, 1.5));
    }

    #[test]
    fn no_step_reaches_over_a_sample_or_beyond_its_limit() {
        let window = Window { number: 1, iteration: 1, start: 0.0, length: 1e-3 };
        for (step, segments, samples, expected) in
            [(1e-3, 1, [1, 0], 1), (1e-4, 4, [4, 4], 12), (1e-4, 1, [3, 0], 12), (1.0, 8, [8, 0], 8)]
        {
            assert_eq!(Cut::new(&window, (step, 1e-3), segments, &samples, 1).steps, expected);
        }
    }

    #[test]
    fn a_long_window_has_the_steps_of_the_usual_ones_to_the_last_bit() {
        let (usual, step) = (3e-4, 7e-5);
        let of = |number: u64, many: u64| {
            let start = number as f64 * usual;
            let window =
                Window { number: 1, iteration: 1, start, length: (number + many) as f64 * usual - start };
            (window, Cut::new(&window, (step, usual), 1, &[2], 1))
        };
        let (long, cut) = of(7, 20);
        assert_eq!(cut.steps, 20 * 6, "each of five steps at least, an even number");
        for part in 0..20 {
            let (short, one) = of(7 + part as u64, 1);
            assert_eq!((one.steps, one.h.to_bits()), (6, cut.h.to_bits()));
            for step in 0..6 {
                let time = |window, cut: &Cut, step| cut.begins(window, step).to_bits();
                assert_eq!(time(&short, &one, step), time(&long, &cut, 6 * part + step));
            }
        }
        let half = Window { number: 1, iteration: 1, start: 0.0, length: 0.5 * usual };
        assert_eq!(Cut::new(&half, (step, usual), 1, &[], 1).h, 0.5 * usual / 3.0);
    }
}
