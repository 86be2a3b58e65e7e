//! A solver that is asked for windows that do not count.

use super::{Finding, Outcome, breach, clause};
use crate::schedule::Span;
use crate::side::Side;
use crate::solver_slot::SolverSlot;
use interface_defs::Failure;

/// A solver that is asked, and what is known of it by then.
pub(crate) struct Asked<'e, 'a> {
    pub slot: &'e mut SolverSlot<'a>,
    pub side: &'e Side,
    /// A window of the scene's length, from its committed state on.
    pub span: Span,
    /// Number of the iteration that is asked for.
    pub iteration: u32,
    /// Numbers of its gauges in its committed state, three each.
    pub gauges: &'e [f64],
    pub found: &'e mut Vec<Finding>,
}

/// Share of the change in a window by which a repetition that does not start from the committed state is off, at least.
const FORGOTTEN: f64 = 0.1;

impl Asked<'_, '_> {
    /// Its name in the run.
    pub fn name(&self) -> String {
        self.slot.participant.name().to_owned()
    }

    /// What was found about a clause that is not broken.
    pub fn note(&mut self, clause: &'static str, outcome: Outcome, what: impl Into<String>) {
        let what = format!("t = {} s: {}", self.span.start, what.into());
        self.found.push(Finding { clause, outcome, what });
    }

    /// Note that a clause is kept.
    pub fn kept(&mut self, clause: &'static str, what: impl Into<String>) {
        self.note(clause, Outcome::Kept, what);
    }

    /// Note that a clause is kept, or if not `holds`, that it could not be examined.
    pub fn kept_if(&mut self, holds: bool, clause: &'static str, what: impl Into<String>) {
        self.note(clause, if holds { Outcome::Kept } else { Outcome::NotExamined }, what);
    }

    /// Note that a clause could not be examined.
    pub fn unknown(&mut self, clause: &'static str, why: impl Into<String>) {
        self.note(clause, Outcome::NotExamined, why);
    }

    /// It breaks a clause.
    pub fn breach(&self, clause: &'static str, what: impl Into<String>) -> Failure {
        breach(self.slot.participant.name(), clause, what)
    }

    /// Whether it may be asked, and to how much it repeats a window.
    pub fn repeats(&mut self, all: &[&'static str]) -> Option<f64> {
        let repeats = self.side.hello.repeats;
        if repeats.is_none() {
            let why = "it says that it cannot repeat a window";
            all.iter().for_each(|clause| self.unknown(clause, why));
        }
        repeats
    }

    /// Solve a window of `length` [s], whose payload is all 0 but for what `fill` writes. `None`: it cannot be done, and nothing is known.
    pub fn solve(
        &mut self,
        length: f64,
        fill: &mut dyn FnMut(&mut [f64]),
    ) -> Result<Option<Vec<f64>>, Failure> {
        let span = Span { length, ..self.span };
        let answer = self.slot.try_window((span, self.iteration), self.side, &mut |payload| {
            payload.fill(0.0);
            fill(payload);
        })?;
        Ok(answer.map_err(|why| tracing::info!("{} is not examined: {why}", self.name())).ok())
    }

    /// The same window again, after another one, has the same answer.
    pub fn check_repetition(
        &mut self,
        [before, first, again]: [&[f64]; 3],
        repeats: f64,
    ) -> Result<(), Failure> {
        let size = |numbers: &[f64]| numbers.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let layout = &self.side.layout;
        let fields = layout.fields().filter_map(|field| {
            let all = layout.sample(&field.name, field.sampling, 0)?.start
                ..layout.last(&field.name, field.sampling)?.end;
            Some((all, field.name.clone()))
        });
        let gauges =
            self.side.gauges.iter().enumerate().map(|(at, gauge)| (layout.gauge(at), gauge.name.clone()));
        let (mut worst, mut forgotten): ((f64, String), f64) = ((0.0, String::new()), 0.0);
        for (place, what) in fields.chain(gauges) {
            let (a, b) = (&first[place.clone()], &again[place.clone()]);
            let apart =
                |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            if a == b {
                continue;
            }
            let share = apart(a, b) / size(a).max(size(b));
            let changed = apart(a, &before[place]);
            forgotten = forgotten.max(apart(a, b) / changed.max(f64::MIN_POSITIVE));
            if share > worst.0 {
                worst = (share, what);
            }
        }
        let (share, what) = worst;
        let says = if repeats == 0.0 { "equal bytes".to_string() } else { format!("{repeats:e}") };
        if share <= repeats {
            self.kept(clause::REPEATS, format!("a window solved twice: {share:.1e}, promised {says}"));
            self.kept(clause::COMMITTED, "a window is the same after another one");
            return Ok(());
        }
        let numbers = format!(
            "one window solved twice, with another one between, has \"{what}\" that differs by {share:.1e} of its size"
        );
        if forgotten > FORGOTTEN {
            let what = format!("{numbers}: a solve does not start from the committed state");
            return Err(self.breach(clause::COMMITTED, what));
        }
        Err(self.breach(clause::REPEATS, format!("{numbers}, Hello.repeats promises {says}")))
    }
}
