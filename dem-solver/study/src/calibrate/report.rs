//! What a calibration comes to: `calibration.json` for programs, `calibration.md` and the screen for people.

use super::inference::{Answer, Case, CaseTable, FEWEST, LEVEL, Posterior, Prediction, Verdict};
use super::{Calibration, NUMBERS, Observed, Parameter, Use};
use crate::base::Base;
use crate::directory::CALIBRATION;
use crate::record::{All, Record};
use crate::summary::Numbers;
use interface_defs::diagnostic::{Diagnostic, Severity, code};
use interface_defs::message::{Measure, Worse};
use serde_json::{Value, json};
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::numbers::{four, percent, three};
use toolkit::summary::Summary;

/// A sample of fewer values is hardly ever rejected, whatever the parameters.
const POWER: usize = 8;
/// What was left out is rejected below this.
const REJECTED: f64 = 0.05;
/// Parameters that depend on each other by more than this are hardly known by themselves.
const TOGETHER: f64 = 0.7;

impl Observed {
    /// What is said of its sample.
    fn verdict(&self, found: &Prediction) -> &'static str {
        match self.used {
            Use::Fit if found.farthest => "not reproduced",
            Use::Fit => "reproduced",
            Use::Predict if found.p < REJECTED => "rejected",
            Use::Predict if self.values.len() < POWER => "not rejected, no power",
            Use::Predict => "not rejected",
        }
    }
}

impl Calibration {
    /// The sets with what came of each, and what was observed.
    fn gather(&self, base: &Base, all: All) -> io::Result<(CaseTable, Case)> {
        let orders = [Use::Fit, Use::Predict].map(|used| self.members(base, used));
        let (mut falls, mut cases) = (Vec::<Record>::new(), Vec::<Case>::new());
        all(&mut |record| {
            falls.push(record.clone());
            if falls.len() as u64 == base.replicate() {
                let of = |own: &Observed| {
                    self.sample(base, own, &falls, &orders[usize::from(own.used == Use::Predict)])
                };
                let values = self.places.iter().map(|places| places[cases.len()]).collect();
                cases.push(Case { values, samples: self.observed.iter().map(of).collect() });
                falls.clear();
            }
            Ok(())
        })?;
        let fitted = self.observed.iter().map(|own| own.used == Use::Fit).collect();
        let samples = self.observed.iter().map(Observed::numbers).collect();
        Ok((CaseTable { cases, fitted }, Case { values: Vec::new(), samples }))
    }

    /// Write what follows from all falls into `dir`; the summary, and what the screen shows.
    pub fn conclude(&self, base: &Base, dir: &Path, all: All) -> Result<(Summary, String), Diagnostic> {
        let unwritten =
            |e: io::Error| Diagnostic::in_file(dir.display(), e.to_string()).coded(code::NOT_WRITTEN);
        let (table, observed) = self.gather(base, all).map_err(unwritten)?;
        let answer = table.answer(&observed).ok_or_else(|| self.too_few(&table))?;
        let mut numbers = Numbers::default();
        let mut kept = vec![false; table.cases.len()];
        answer.kept.iter().for_each(|(set, ..)| kept[*set] = true);
        all(&mut |record| {
            if kept[((record.number - 1) / base.replicate()) as usize] {
                numbers.add(record.number, &record.outcome);
            }
            Ok(())
        })
        .map_err(unwritten)?;
        let summary = self.summary(base, &answer, numbers);
        let data = self.data(base, &answer, &observed);
        let page = self.page(base, &answer, &observed);
        let [json, markdown, file] = CALIBRATION.map(|name| dir.join(name));
        files::write_json(&json, &data)
            .and_then(|()| files::write(&markdown, page.as_bytes()))
            .and_then(|()| files::write(&file, self.file.text().as_bytes()))
            .map_err(unwritten)?;
        Ok((summary, if self.json { format!("{data}\n") } else { page }))
    }

    /// That too few sets have what is compared, and of what.
    fn too_few(&self, table: &CaseTable) -> Diagnostic {
        let missing = |at: usize| table.cases.iter().filter(|case| case.samples[at].is_none()).count();
        let worst = (0..self.observed.len()).filter(|at| table.fitted[*at]).max_by_key(|at| missing(*at));
        let (name, missing) =
            worst.map_or_else(Default::default, |at| (self.observed[at].name(), missing(at)));
        let sets = table.cases.len();
        let what = format!(
            "{missing} of {sets} sets have fewer than 3 values of {name}: it takes {FEWEST} sets with all that is fitted"
        );
        Diagnostic::error(code::INVALID_VALUE, what)
            .try_instead("ranges with which rocks come so far, or more falls or sets")
    }

    /// The status, and what the user should know.
    fn summary(&self, base: &Base, answer: &Answer, numbers: Numbers) -> Summary {
        // The members of the sets that were kept: others are no concern of the answer.
        let mut summary = numbers.summary(base.study.most_failed);
        summary.measures.clear();
        summary.warnings.truncate(1);
        let (kept, sets) = (answer.kept.len(), self.places[0].len());
        for counts in &mut summary.warnings {
            counts.message = format!("in the {kept} of {sets} sets that count: {}", counts.message);
        }
        let settled = answer.parameters.iter().filter(|it| it.verdict == Verdict::Settled).count() as f64;
        let settled = Measure::new("parameters_settled", settled, "1");
        summary.measures.push(settled.ranked(Measure::ORDINARY, Worse::Neither));
        for (a, b, value) in answer.correlations.iter().filter(|it| it.2.abs() > TOGETHER) {
            let [a, b] = [a, b].map(|at| &self.parameters[*at].key);
            let what = format!(
                "{a} and {b} go together (correlation {value:.2}): the data settle a combination of both better than each"
            );
            summary.warnings.push(Diagnostic::of(Severity::Note, code::OTHER, what));
        }
        let mut doubts = std::mem::take(&mut summary.reasons);
        for (parameter, found) in self.parameters.iter().zip(&answer.parameters) {
            if found.verdict == Verdict::NotTrusted {
                let (key, held, widened) = (&parameter.key, percent(found.coverage), three(found.widened));
                let what = format!(
                    "the range of {key} held {held} of the sets that were taken as observed, and had to be widened by {widened}"
                );
                let cure = "more sets, or narrower ranges";
                doubts.push(Diagnostic::warning(code::TRUST, what).try_instead(cure));
            }
        }
        let fitted = self.observed.iter().zip(&answer.predictions).filter(|(own, _)| own.used == Use::Fit);
        let far = fitted
            .filter(|(_, found)| found.as_ref().is_some_and(|it| it.farthest))
            .map(|(own, _)| own.name());
        let far: Vec<String> = if answer.outside { vec!["what was observed".into()] } else { far.collect() };
        if !far.is_empty() {
            let what = format!(
                "{} is farther from what sets within these ranges give than in each of {} sets that were taken as observed",
                far.join(", "),
                answer.counts[1]
            );
            let cure = "check units, releases and rocks of the study, or try wider ranges or another law";
            doubts.push(Diagnostic::warning(code::TRUST, what).try_instead(cure));
        }
        if !doubts.is_empty() {
            summary.doubt(doubts);
        }
        summary.warnings.extend(base.warnings.iter().map(|w| base.scene.placed(w.clone())));
        summary
    }

    /// For programs.
    fn data(&self, base: &Base, answer: &Answer, observed: &Case) -> Value {
        let [complete, tried] = answer.counts;
        let parameters = self.parameters.iter().zip(&answer.parameters).map(|(it, found)| {
            let [low, median, high] = found.range.map(|place| it.value(place));
            json!({
                "key": it.key, "from": it.from, "to": it.to, "scale": it.scale,
                "low": low, "median": median, "high": high, "width": found.range[2] - found.range[0],
                "coverage": found.coverage, "widened": found.widened, "explained": found.explained, "verdict": found.verdict,
            })
        });
        let all = self.observed.iter().zip(&answer.predictions).zip(&observed.samples);
        let seen = all.map(|((own, found), sample)| {
            let numbers = found.iter().flat_map(|it| &it.ranges).zip(sample.iter().flatten()).zip(NUMBERS);
            let numbers = numbers.map(|(([low, median, high], observed), name)| {
                json!({ "name": name, "observed": observed, "low": low, "median": median, "high": high })
            });
            json!({
                "what": own.what, "line": own.line, "release": own.release, "use": own.used, "unit": own.what.bounds().0,
                "count": own.values.len(), "of": own.of, "numbers": numbers.collect::<Vec<_>>(),
                "p": found.as_ref().map(|it| it.p), "verdict": found.as_ref().map(|it| own.verdict(it)),
            })
        });
        let pairs = answer.correlations.iter().map(|(a, b, value)| {
            json!({ "parameters": [self.parameters[*a].key, self.parameters[*b].key], "value": value })
        });
        let samples = answer.kept.iter().map(|(set, weight, places)| {
            let values = self.parameters.iter().zip(places).map(|(it, place)| it.value(*place));
            json!({ "set": set + 1, "weight": weight, "values": values.collect::<Vec<_>>() })
        });
        json!({
            "version": env!("CARGO_PKG_VERSION"), "level": LEVEL, "sets": self.places[0].len(), "sets_complete": complete,
            "falls_per_set": base.replicate(), "taken_as_observed": tried, "outside": answer.outside,
            "parameters": parameters.collect::<Vec<_>>(), "correlations": pairs.collect::<Vec<_>>(),
            "observed": seen.collect::<Vec<_>>(), "samples": samples.collect::<Vec<_>>(),
        })
    }

    /// For people.
    fn page(&self, base: &Base, answer: &Answer, observed: &Case) -> String {
        let (sets, falls, kept, [complete, tried]) =
            (self.places[0].len(), base.replicate(), answer.kept.len(), answer.counts);
        let mut text = format!(
            "{sets} sets of parameters, {falls} falls with each; {complete} have 3 values of all that is fitted, of these the {kept} nearest \
             to what was observed count.\n\n"
        );
        type Sought<'a> = (&'a Parameter, &'a Posterior);
        let range = |(it, found): &Sought| found.range.map(|place| three(it.value(place)));
        let sought = Columns::new()
            .with("parameter", |(it, _): &Sought| it.key.clone())
            .with("prior range", |(it, _)| format!("{} to {}", three(it.from), three(it.to)))
            .with("median", |row| range(row)[1].clone())
            .with("90 % range", |row| range(row)[0].clone() + " to " + &range(row)[2])
            .with("range / prior", |(_, found)| format!("{:.0} %", 100.0 * (found.range[2] - found.range[0])))
            .with("coverage", |(_, Posterior { coverage, widened, .. })| {
                let wider = if *widened > 1.0 { format!(", widened by {widened:.2}") } else { String::new() };
                format!("{:.0} %{wider}", 100.0 * coverage)
            })
            .with("verdict", |(_, found)| found.verdict.sentence().into());
        text += &sought.markdown(&self.parameters.iter().zip(&answer.parameters).collect::<Vec<_>>());
        text += &format!(
            "Coverage: in how many of {tried} sets, taken as if observed, the range held the parameter before it was widened.\n\n"
        );
        type Seen<'a> = ((&'a Observed, &'a Option<Prediction>), &'a Option<Vec<f64>>);
        let mut seen = Columns::new()
            .with("observed", |((own, _), _): &Seen| {
                let used = if own.used == Use::Fit { "fitted" } else { "predicted" };
                format!("{} [{}], {used}", own.name(), own.what.bounds().0)
            })
            .with("values", |((own, _), _)| {
                own.values.len().to_string() + &own.of.map_or(String::new(), |of| format!(" of {of}"))
            });
        for (k, title) in ["10 %: observed, 90 % range", "50 %", "90 %"].into_iter().enumerate() {
            seen = seen.with(title, move |((_, found), sample)| match (found, sample) {
                (Some(found), Some(sample)) => {
                    let [low, _, high] = found.ranges[k].map(three);
                    format!("{}, {low} to {high}", three(sample[k]))
                }
                _ => "too few".into(),
            });
        }
        let seen = seen
            .with("p", |((_, found), _)| found.as_ref().map_or(String::new(), |it| format!("{:.2}", it.p)))
            .with("verdict", |((own, found), _)| {
                found.as_ref().map_or("not predicted", |it| own.verdict(it)).into()
            });
        let rows = self.observed.iter().zip(&answer.predictions).zip(&observed.samples);
        text += &seen.markdown(&rows.collect::<Vec<_>>());
        text += "For [vary] of a study, each parameter by itself:\n\n";
        for (it, found) in self.parameters.iter().zip(&answer.parameters) {
            let [low, median, high] = found.range.map(|place| four(it.value(place)));
            let (from, to) = (four(it.from), four(it.to));
            text += &format!(
                "    {} = {{ table = [[{from}, 0.0], [{low}, 0.05], [{median}, 0.5], [{high}, 0.95], [{to}, 1.0]] }}\n",
                it.key
            );
        }
        text + "\n"
    }
}
