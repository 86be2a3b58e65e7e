//! `--until MEASURE:SHARE`: replicates are added to a study until a measure is known so well.

use super::base::Base;
use super::record::All;
use super::results::lines;
use super::summary::{Numbers, quantiles};
use interface_defs::diagnostic::{Diagnostic, Severity, code};
use interface_defs::message::Measure;
use std::io;
use toolkit::arguments::{Accuracy, EnsembleArguments};
use toolkit::explain::suggestion;
use toolkit::numbers::{percent, rounded};

/// Times the study's own members, the most unless the command says how many.
const TIMES: u64 = 10;

/// How well a measure is to be known, and how many replicates that may take.
pub struct Until<'a> {
    accuracy: &'a Accuracy,
    most: u64,
}

impl<'a> Until<'a> {
    /// What the command asks for; refused where the study has no such measure.
    pub fn of(arguments: &'a EnsembleArguments, base: &Base) -> Result<Option<Self>, Diagnostic> {
        let Some(accuracy) = &arguments.until else { return Ok(None) };
        let known: Vec<String> = lines::bounded(base).chain(quantiles()).collect();
        if !known.contains(&accuracy.measure) {
            let what = format!("this study has no measure `{}` with an interval", accuracy.measure);
            return Err(Diagnostic::in_file("--until", what).try_if(suggestion(&accuracy.measure, &known)));
        }
        if let Some(what) = base.study.unrepeatable() {
            return Err(Diagnostic::in_file("--until", what).try_instead("give distributions more levels"));
        }
        let members = arguments.at_most.unwrap_or(TIMES * base.members());
        let most = (members / base.replicate()).min(base.study.most_replicates());
        if most < base.study.replicates {
            let what = format!("{members}: the study itself has {} members", base.members());
            return Err(Diagnostic::in_file("--at-most", what).try_instead("a larger number"));
        }
        Ok(Some(Self { accuracy, most }))
    }

    /// Members up to which it goes, for the study `base`.
    pub fn members(&self, base: &Base) -> u64 {
        self.most * base.replicate()
    }

    /// Half of the interval of the measure over its value; infinite where it has none yet.
    fn found(&self, measures: &[Measure]) -> f64 {
        let known = measures.iter().find(|measure| measure.name == self.accuracy.measure);
        let share = known.and_then(|measure| {
            let [low, high] = measure.interval?.ends()?;
            Some(0.5 * (high - low) / measure.value.abs())
        });
        share.filter(|share| !share.is_nan()).unwrap_or(f64::INFINITY)
    }

    /// How many replicates to go on with after those of `base`, which are computed; `None`: these are enough, or there may be no more.
    pub fn next(&self, base: &Base, all: All) -> io::Result<Option<u64>> {
        let mut numbers = Numbers::default();
        all(&mut |record| {
            numbers.add(record.number, &record.outcome);
            Ok(())
        })?;
        let measures = [numbers.summary(1.0).measures, lines::measures(base, all)?].concat();
        let (over, now) = (self.found(&measures) / self.accuracy.share, base.study.replicates);
        if over <= 1.0 || now >= self.most {
            return Ok(None);
        }
        // An interval narrows with the square root: half of what is left at once, so that all is not read again for each replicate.
        let half = if over.is_finite() { 0.5 * over * over * now as f64 } else { 0.0 };
        Ok(Some((half as u64).clamp(now + 1, self.most)))
    }

    /// Whether the measure is known as well as it is to be, and what is said of it.
    pub fn judge(&self, base: &Base, measures: &[Measure]) -> Result<Diagnostic, Diagnostic> {
        let (found, members, name) = (self.found(measures), base.members(), &self.accuracy.measure);
        let due = percent(self.accuracy.share);
        if found <= self.accuracy.share {
            let found = percent(rounded(found, 2));
            let what = format!("{name} is known to {found} with {members} members, {due} were asked for");
            return Ok(Diagnostic::of(Severity::Note, code::OTHER, what));
        }
        let (so_far, more) = if found.is_finite() {
            let all = rounded(members as f64 * (found / self.accuracy.share).powi(2), 2);
            (format!("to {}", percent(rounded(found, 2))), format!("some {all} members may do"))
        } else {
            ("with no interval yet, or is 0".into(), "more members".into())
        };
        let what = format!(
            "{name} is known {so_far} with {members} members, the most that may be; {due} were asked for"
        );
        Err(Diagnostic::warning(code::FEW_SAMPLES, what)
            .try_instead(format!("--at-most with a larger number: {more}")))
    }
}
