//! Limit points and branch points within a step along a path of equilibrium.
//!
//! At a limit point the load factor turns back, and a pivot of the tangent changes its sign with it. At a branch point
//! one does and the load goes on. A root is found between two probes of the step: of `df/ds` for the one, of the
//! determinant for the other. Where more changes than one, the step is halved until each stands alone, or all are one point.

use crate::state::{Critical, CriticalKind};

/// Sought of a load factor, relative.
const SHARP: f64 = 1e-6;
/// Part of a step in which all that changes counts as one point.
const ONE_POINT: f64 = 1e-6;
/// Most probes for one root.
const MOST_PROBES: usize = 60;

/// What is known of a place within the step.
#[derive(Debug, Clone, Copy)]
pub struct PathPoint {
    /// From the start of the step [m].
    pub way: f64,
    pub factor: f64,
    /// Change of the factor along the path [1/m].
    pub rate: f64,
    pub negative: usize,
    /// Logarithm of the magnitude of the tangent's determinant.
    pub log_determinant: f64,
}

/// The step has jumped from one path to another somewhere beyond this way [m].
#[derive(Debug, PartialEq)]
pub struct Jump(pub f64);

impl PathPoint {
    fn turns(&self, other: &Self) -> bool {
        (self.rate < 0.0) != (other.rate < 0.0)
    }

    /// Whether something changes between two places.
    pub fn differs(&self, other: &Self) -> bool {
        self.negative != other.negative || self.turns(other)
    }

    /// Determinant, relative to one whose logarithm is `scale`.
    fn determinant(&self, scale: f64) -> f64 {
        let size = (self.log_determinant - scale).clamp(-700.0, 700.0).exp();
        if self.negative.is_multiple_of(2) { size } else { -size }
    }
}

/// The search through one step of `length` [m].
pub struct CriticalSearch<'a> {
    /// A probe at a way from the start; none where Newton fails.
    pub probe: &'a mut dyn FnMut(f64) -> Option<PathPoint>,
    pub length: f64,
    /// Time at the start of the step [s], and along it [m/s].
    pub time: f64,
    pub speed: f64,
    pub found: &'a mut Vec<Critical>,
}

impl CriticalSearch<'_> {
    /// Find what changes between `low` and `high`.
    pub fn between(&mut self, low: PathPoint, high: PathPoint) -> Result<(), Jump> {
        let change = low.negative.abs_diff(high.negative);
        if !low.differs(&high) {
            return Ok(());
        }
        if change == 1 {
            return self.root(low, high);
        }
        if high.way - low.way <= ONE_POINT * self.length {
            continuous(&low, &high)?;
            let turns = low.turns(&high);
            if turns {
                self.record(&high, CriticalKind::Limit);
            }
            if change > usize::from(turns) || !turns {
                self.record(&high, CriticalKind::Branch);
            }
            return Ok(());
        }
        match (self.probe)(0.5 * (low.way + high.way)) {
            Some(middle) => {
                self.between(low, middle)?;
                self.between(middle, high)
            }
            None => Err(Jump(low.way)),
        }
    }

    /// One pivot changes its sign: by regula falsi with Illinois' halving, and halves in between.
    fn root(&mut self, mut low: PathPoint, mut high: PathPoint) -> Result<(), Jump> {
        let kind = if low.turns(&high) { CriticalKind::Limit } else { CriticalKind::Branch };
        let scale = low.log_determinant.max(high.log_determinant);
        let value = |p: &PathPoint| if kind == CriticalKind::Limit { p.rate } else { p.determinant(scale) };
        let (mut a, mut b) = (value(&low), value(&high));
        let mut best = if a.abs() < b.abs() { low } else { high };
        for round in 0..MOST_PROBES {
            let width = high.way - low.way;
            let sharp = SHARP * low.factor.abs().max(high.factor.abs());
            let steepest = low.rate.abs().max(high.rate.abs());
            if width <= 1e-12 * self.length || (round > 0 && steepest * width <= sharp) {
                break;
            }
            let falsi = low.way + width * a / (a - b);
            let way = if round % 4 == 3 || !falsi.is_finite() { low.way + 0.5 * width } else { falsi };
            let way = way.clamp(low.way + 1e-3 * width, high.way - 1e-3 * width);
            let Some(probe) = (self.probe)(way) else { break };
            let beyond =
                if kind == CriticalKind::Limit { low.turns(&probe) } else { low.negative != probe.negative };
            let estimate = probe.rate.abs() * (probe.way - best.way).abs();
            best = probe;
            if beyond {
                (high, b, a) = (probe, value(&probe), 0.5 * a);
            } else {
                (low, a, b) = (probe, value(&probe), 0.5 * b);
            }
            if round > 1 && estimate <= 1e-2 * sharp {
                break;
            }
        }
        continuous(&low, &high)?;
        self.record(&PathPoint { negative: high.negative, ..best }, kind);
        Ok(())
    }

    fn record(&mut self, at: &PathPoint, kind: CriticalKind) {
        let time = self.time + at.way / self.speed;
        self.found.push(Critical { time, factor: at.factor, negative: at.negative, kind });
    }
}

/// Whether one path leads from one place to another: the load changes as fast as it says at both.
fn continuous(low: &PathPoint, high: &PathPoint) -> Result<(), Jump> {
    let allowed = 10.0 * low.rate.abs().max(high.rate.abs()) * (high.way - low.way);
    let rounding = 1e-6 * low.factor.abs().max(high.factor.abs());
    let jump = (high.factor - low.factor).abs() > allowed + rounding;
    if jump { Err(Jump(low.way)) } else { Ok(()) }
}
