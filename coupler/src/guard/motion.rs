//! Displacement against the integral of velocity, window by window, and from which state a window began.

use super::{breach, clause};
use crate::schedule::Span;
use interface_defs::Failure;
use serde::{Deserialize, Serialize};

/// The motion of a window: at its start as committed, and at the ends of its parts as the structure answered; 3 numbers per node.
#[derive(Debug, Clone, Copy)]
pub struct Answered<'a> {
    /// Displacement and velocity at the start [m, m/s].
    pub start: (&'a [f64], &'a [f64]),
    /// Displacement at the ends of the parts [m].
    pub u: &'a [Vec<f64>],
    /// Velocity at the ends of the parts [m/s].
    pub v: &'a [Vec<f64>],
}

/// Sums over nodes, parts and windows, of squares [m2].
///
/// The defect of a part of length h is `u1 - u0 - h (v0 + v1)/2`, its bend `h (v1 - v0)`. A smooth motion of angular frequency w
/// has a defect of `w h / 12` of its bend; one that swings many times within a part has half of its bend, on average over
/// frequencies. What leaves that by far is no motion with these velocities, whatever the scheme.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Sums {
    defect: f64,
    bend: f64,
    /// Of the distance gone, of the integral of velocity, and of the product of the two.
    path: f64,
    integral: f64,
    product: f64,
    numbers: f64,
    /// What the last bits of displacements amount to.
    rounding: f64,
}

/// Largest defect over bend that is believed of a run, of root mean squares: a single swing has more where its period is that of
/// the windows to 1 %.
const MOST_DEFECT: f64 = 8.0;
/// So many windows make a run, rather than a chance; so many that are odd, each alike, likewise.
const FEW: u64 = 8;
const SOME: u64 = 3;
/// After so many windows one in so many is looked at.
const LONG: u64 = 64;
const NOW_AND_THEN: u64 = 4;
/// One window with more than this is looked at: a swing with almost the period of the window may have it.
const ODD_DEFECT: f64 = 2.0;
/// With less than this, another explanation of a window is taken for the true one.
const GOOD_DEFECT: f64 = 0.6;
/// What rounding and the tolerance of an implicit step leave of a distance.
const ROUNDING: f64 = 1e-6;
/// The same of a displacement that does not change [m].
const NOTHING: f64 = 1e-12;

impl Sums {
    /// One part of a window, of length `h` [s].
    fn add(&mut self, h: f64, (u0, v0): (&[f64], &[f64]), (u1, v1): (&[f64], &[f64])) {
        let mut sums = [[0.0; ABREAST]; 5];
        let parts = |x: &'_ [f64]| -> usize { x.len() / ABREAST * ABREAST };
        let whole = parts(u0);
        for at in (0..whole).step_by(ABREAST) {
            let of = |x: &[f64]| -> [f64; ABREAST] { std::array::from_fn(|i| x[at + i]) };
            let (u0, v0, u1, v1) = (of(u0), of(v0), of(u1), of(v1));
            for i in 0..ABREAST {
                let terms = terms(h, [u0[i], v0[i], u1[i], v1[i]]);
                sums.iter_mut().zip(terms).for_each(|(sum, term)| sum[i] += term);
            }
        }
        for i in whole..u0.len() {
            let terms = terms(h, [u0[i], v0[i], u1[i], v1[i]]);
            sums.iter_mut().zip(terms).for_each(|(sum, term)| sum[0] += term);
        }
        let [defect, bend, path, integral, product] = sums.map(|sum| sum.iter().sum::<f64>());
        let numbers = u0.len() as f64;
        // Places of bodies are coordinates, which may be large.
        let size = u0.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        let rounding = numbers * (4.0 * f64::EPSILON * size).powi(2);
        *self = self.plus(Self { defect, bend, path, integral, product, numbers, rounding });
    }

    fn of(h: f64, motion: &Answered) -> Self {
        let mut sums = Self::default();
        let mut from = motion.start;
        for (u, v) in motion.u.iter().zip(motion.v) {
            sums.add(h, from, (u, v));
            from = (u, v);
        }
        sums
    }

    fn plus(self, other: Self) -> Self {
        Self {
            defect: self.defect + other.defect,
            bend: self.bend + other.bend,
            path: self.path + other.path,
            integral: self.integral + other.integral,
            product: self.product + other.product,
            numbers: self.numbers + other.numbers,
            rounding: self.rounding + other.rounding,
        }
    }

    /// Whether distances and velocities can be those of one motion, with so many times its bend as defect.
    fn is_a_motion(&self, times: f64) -> bool {
        let nothing = NOTHING * NOTHING * self.numbers + self.rounding;
        let least = ROUNDING * ROUNDING * self.path.max(self.integral) + nothing;
        self.defect <= times * times * self.bend + least
    }

    fn numbers(&self) -> String {
        let [gone, integral, defect] = [self.path, self.integral, self.defect].map(f64::sqrt);
        format!(
            "its motion goes {gone:.3e} m, velocities make it {integral:.3e} m, and the two are {defect:.3e} m apart (roots of sums of \
             squares)"
        )
    }

    /// The number of times that the integral of velocity goes into the distance, at best.
    fn times(&self) -> f64 {
        self.product / self.integral
    }
}

/// Numbers that are worked on side by side.
const ABREAST: usize = 8;

fn terms(h: f64, [u0, v0, u1, v1]: [f64; 4]) -> [f64; 5] {
    let (gone, integral, bend) = (u1 - u0, 0.5 * h * (v0 + v1), h * (v1 - v0));
    let defect = gone - integral;
    [defect * defect, bend * bend, gone * gone, integral * integral, gone * integral]
}

/// Watches the motion that a solver answers with: of the structure's nodes, or of the bodies of a contact solver.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Motion {
    initial: (Vec<f64>, Vec<f64>),
    sums: Sums,
    /// The scene's window [s].
    window: f64,
    seen: u64,
    /// Windows that no single swing is likely to make.
    odd: u64,
    /// Whether a window so far did not start from the state of t = 0.
    has_left: bool,
    /// The first window was no motion: the second one says why.
    odd_start: Option<String>,
}

impl Motion {
    /// From the answer at t = 0, with windows of at most `window` [s].
    pub fn new(u: &[f64], v: &[f64], window: f64) -> Self {
        Self { initial: (u.to_vec(), v.to_vec()), window, ..Self::default() }
    }

    /// The window `span` of `solver` is to be accepted with this motion.
    pub fn watch(&mut self, solver: &str, span: Span, motion: &Answered) -> Result<(), Failure> {
        if self.passes_over(span) {
            self.seen += 1;
            return Ok(());
        }
        let h = span.length / motion.u.len().max(1) as f64;
        let now = Sums::of(h, motion);
        let before = self.sums;
        self.sums = before.plus(now);
        self.seen += 1;
        if !self.has_left {
            let same = self.initial.0.len() == motion.start.0.len();
            let from_initial = Answered { start: (&self.initial.0, &self.initial.1), ..*motion };
            self.has_left = !same || !Sums::of(h, &from_initial).is_a_motion(GOOD_DEFECT);
        }
        if now.is_a_motion(ODD_DEFECT) && self.odd_start.is_some() {
            return self.end(solver);
        }
        if now.is_a_motion(ODD_DEFECT) && self.sums.is_a_motion(MOST_DEFECT) {
            return Ok(());
        }
        self.odd += u64::from(!now.is_a_motion(ODD_DEFECT));
        let Span { number, start, length, .. } = span;
        // Made for a message alone: an odd window may be one of many.
        let at = || format!("window {number} of {length:e} s at t = {start} s: {}", now.numbers());
        if self.seen == 1 {
            // Who jumps goes further than velocity can make it.
            self.odd_start = (now.path > 4.0 * now.integral).then(at);
            return Ok(());
        }
        // One odd window may be chance, unless it is just what a certain mistake makes.
        if let Some(breach) = self.cause(solver, &at, span.length, [&before, &now]) {
            return Err(breach);
        }
        if self.seen < FEW || self.sums.is_a_motion(MOST_DEFECT) {
            return Ok(());
        }
        let (at, times) = (at(), now.times());
        let what = format!(
            "{at}, {times:.3} times as far; displacement must be the integral of velocity over each part of the window, from the \
             committed state"
        );
        Err(breach(solver, clause::VELOCITY, what))
    }

    /// What has been right for long is looked at now and then: it costs as much as the residual does. A window of another length is
    /// looked at always.
    fn passes_over(&self, span: Span) -> bool {
        let usual = (span.length / self.window - 1.0).abs() < 1e-3;
        usual && self.seen >= LONG && !self.seen.is_multiple_of(NOW_AND_THEN)
    }

    /// The run is over.
    pub fn end(&mut self, solver: &str) -> Result<(), Failure> {
        let Some(numbers) = self.odd_start.take() else { return Ok(()) };
        let what = format!("{numbers}; the first window does not start where its answer at t = 0 stands");
        Err(breach(solver, clause::INITIAL, what))
    }

    /// The mistake that makes a window of `length` [s] what it is, if there is one.
    fn cause(
        &self,
        solver: &str,
        at: &dyn Fn() -> String,
        length: f64,
        [before, now]: [&Sums; 2],
    ) -> Option<Failure> {
        if now.is_a_motion(ODD_DEFECT) {
            return None;
        }
        if now.integral <= ROUNDING * ROUNDING * now.path {
            let what = format!("{}; its velocity is not the rate of its displacement", at());
            return Some(breach(solver, clause::VELOCITY, what));
        }
        if !self.has_left && self.odd >= SOME {
            let what = format!(
                "{}; it starts from t = 0, as all windows before: it does not commit what was accepted",
                at()
            );
            return Some(breach(solver, clause::COMMIT, what));
        }
        let (times, longer) = (now.times(), self.window / length);
        let alike = now.product * now.product > 0.99 * now.path * now.integral;
        let smooth = before.defect < 0.01 * before.path;
        (smooth && alike && longer > 1.01 && (times / longer - 1.0).abs() < 0.1).then(|| {
            let what = format!("{}: {times:.3} times too far, as in a window of {:e} s", at(), self.window);
            breach(solver, clause::LENGTH, what)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Swings of any frequency, sampled as coarsely as one likes, several of them at once, are a motion.
    #[test]
    fn what_swings_within_a_window_is_believed() {
        for theta in [1e-3, 0.1, 1.0, 3.0, 5.0, 6.0, 6.6, 20.0, 100.3] {
            for modes in [1, 3] {
                let state = |t: f64| -> (Vec<f64>, Vec<f64>) {
                    (0..modes)
                        .map(|m| {
                            let w = theta * (1.0 + 0.37 * f64::from(m));
                            ((w * t).cos() / w, -(w * t).sin())
                        })
                        .unzip()
                };
                let (u, v) = state(0.3);
                let mut motion = Motion::new(&u, &v, 1.0);
                let mut start = (u, v);
                for n in 0..50_u32 {
                    let end = state(f64::from(n) + 1.3);
                    let span = Span { number: u64::from(n) + 1, start: f64::from(n), length: 1.0, level: 0 };
                    let (us, vs) = ([end.0.clone()], [end.1.clone()]);
                    let answered = Answered { start: (&start.0, &start.1), u: &us, v: &vs };
                    motion.watch("fem", span, &answered).unwrap_or_else(|e| panic!("{theta}, {modes}: {e}"));
                    start = end;
                }
            }
        }
    }

    /// Long after the start one window in four is looked at: enough for a velocity that is no longer reported.
    #[test]
    fn a_lie_that_begins_late_is_found_within_a_few_windows() {
        let h = 1e-3;
        let state = |n: u64| {
            let (t, w) = (n as f64 * h, 30.0);
            ((w * t).sin(), if n < 200 { w * (w * t).cos() } else { 0.0 })
        };
        let (u, v) = state(0);
        let mut motion = Motion::new(&[u], &[v], h);
        let found = (1..300).find(|n| {
            let ((u0, v0), (u1, v1)) = (state(n - 1), state(*n));
            let span = Span { number: *n, start: (n - 1) as f64 * h, length: h, level: 0 };
            let (us, vs) = ([vec![u1]], [vec![v1]]);
            let answered = Answered { start: (&[u0], &[v0]), u: &us, v: &vs };
            motion.watch("fem", span, &answered).is_err()
        });
        assert!(found.is_some_and(|n| (200..206).contains(&n)), "{found:?}");
    }
}
