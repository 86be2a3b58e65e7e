//! `rockfall calibrate`: which values of parameters go with falls that were observed, and what they predict of falls that were left out.
//!
//! A replicate of a study is computed with each of many sets of parameters, by the machinery of every study (threads, journal, resume).
//! From each set samples are taken as what was observed was taken; [`inference`] compares, [`report`] says what follows.

pub mod command;
pub mod inference;
pub mod report;
mod what;

use crate::base::Base;
use crate::bounds::quantile;
use crate::directory::Directory;
use crate::gate;
use crate::record::Record;
use crate::sampling::Sampler;
use crate::settings::{REPLICATES, Release, Sampling, StudySettings};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::ipc::run_id::fnv1a;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toml::{Table, Value};
use toolkit::exit::Exit;
use toolkit::program::Extra;
use toolkit::scene::{Kind, STUDY, Scene};
use toolkit::schema::{Share, Tables};
use toolkit::screen::show;
use toolkit::summary::RunStatus;
use toolkit::{files, run_dir};
use what::What;

/// What a calibration file may hold at its top.
pub static CALIBRATION: Kind =
    Kind { name: "calibration", keys: &["title", "study", "sets", "falls", "seed", "parameter", "observed"] };

/// Names of the numbers by which samples are compared, and behind them that of the share that reaches a line.
pub const NUMBERS: [&str; 6] = ["10 %", "50 %", "90 %", "mean", "deviation", "share"];
/// Fewest values of a sample that is compared.
const FEWEST: usize = 3;
/// Fewest and most sets of parameters.
const SETS: [u32; 2] = [60, 100_000];

/// How the values of a parameter are spread before anything is observed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// Evenly in their logarithm: as many from 1 to 10 as from 10 to 100.
    Log,
}

/// A parameter that is sought: one value for all falls.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// A key of the scene as in `[vary]` of a study, as `contact.0.restitution`, or a number of the rock there. Not one that varies in the study.
    pub key: String,
    /// Least value of the prior range.
    pub from: f64,
    /// Largest value of the prior range.
    pub to: f64,
    /// How values are spread over it. Default `linear`.
    #[serde(default)]
    pub scale: Scale,
}

impl Parameter {
    /// The value at a place in the range, from 0 to 1.
    pub fn value(&self, place: f64) -> f64 {
        match self.scale {
            Scale::Linear => self.from + place * (self.to - self.from),
            Scale::Log => self.from * (self.to / self.from).powf(place),
        }
    }
}

/// What observed values are for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Use {
    /// Parameters follow from them.
    #[default]
    Fit,
    /// They are left out, and compared with what is predicted: of other falls than those that are fitted.
    Predict,
}

/// Values of one kind that were observed, one for each fall.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Observed {
    /// What was observed.
    pub what: What,
    /// Name of a line of the study, where it was observed there. Not of stops.
    pub line: Option<String>,
    /// Name of a release of the study, where it was observed of rocks from there alone.
    pub release: Option<String>,
    /// The values, three or more.
    #[serde(default)]
    pub values: Vec<f64>,
    /// A CSV file with the values, in place of `values`.
    pub file: Option<PathBuf>,
    /// Its column, by the name in its first line.
    pub column: Option<String>,
    /// At a line the number of falls that were watched: with it the share that reaches the line is compared too.
    pub of: Option<u32>,
    /// What it is for. Default `fit`.
    #[serde(default, rename = "use")]
    pub used: Use,
}

impl Observed {
    /// Falls that it takes to have as many values.
    fn falls(&self) -> u64 {
        let count = self.values.len() as u64;
        // Where it is not known how many fell, about every second one may have reached the line.
        self.of.map_or(if self.line.is_some() { 2 * count } else { count }, u64::from)
    }

    /// In words.
    fn name(&self) -> String {
        let of = |word: &str, name: &Option<String>| {
            name.as_ref().map_or(String::new(), |name| format!(" {word} {name}"))
        };
        format!("{}{}{}", self.what.0, of("at", &self.line), of("from", &self.release))
    }

    /// The numbers by which its values are compared.
    fn numbers(&self) -> Option<Vec<f64>> {
        numbers(&self.values, self.of.map(|of| self.values.len() as f64 / f64::from(of)))
    }

    /// With the values of its file in their place.
    fn read(&mut self, key: &str, file: &Scene) -> Result<(), Diagnostic> {
        match (&self.file, &self.column) {
            (None, None) => {}
            (Some(_), _) if !self.values.is_empty() => {
                return file.refuse(key, "values stand here and in a file", "leave one of the two out");
            }
            (Some(path), Some(column)) => {
                self.values = column_of(&file.resolve(path), column)
                    .map_err(|what| file.invalid(&format!("{key}.file"), what))?;
            }
            _ => {
                let cure = "file = \"stops.csv\", column = \"run_out_m\"";
                return file.refuse(key, "`file` and `column` belong together", cure);
            }
        }
        let (What(name), (unit, least)) = (self.what, self.what.bounds());
        if let Some(wrong) = self.values.iter().find(|value| !(**value >= least && value.is_finite())) {
            return Err(
                file.invalid(&format!("{key}.values"), format!("{name} = {wrong} {unit}: it cannot be"))
            );
        }
        if self.values.len() < FEWEST {
            let what = format!("{} values: {FEWEST} are the least that are compared", self.values.len());
            return file.refuse(key, what, "values = [82.1, 95.0, 101.6], or file and column of a CSV file");
        }
        Ok(())
    }
}

/// The tables of a list of tables.
fn tables<'a>(document: &'a mut Table, key: &str) -> impl Iterator<Item = &'a mut Table> {
    let all = document.get_mut(key).and_then(Value::as_array_mut);
    all.into_iter().flatten().filter_map(Value::as_table_mut)
}

/// The numbers in a column of a CSV file; empty cells are left out.
fn column_of(path: &Path, column: &str) -> Result<Vec<f64>, String> {
    let name = path.display();
    let bytes = files::read_input(path, files::TEXT).map_err(|e| format!("{name} cannot be read: {e}"))?;
    let mut rows = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
    let header = rows.headers().map_err(|e| format!("{name}: {e}"))?.clone();
    let Some(at) = header.iter().position(|it| it == column) else {
        let known = header.iter().collect::<Vec<_>>().join(", ");
        return Err(format!("{name} has no column `{column}`, but {known}"));
    };
    let mut found = Vec::new();
    for (row, line) in rows.records().zip(2..) {
        let row = row.map_err(|e| format!("{name}: {e}"))?;
        match row.get(at).unwrap_or_default() {
            "" => {}
            cell => found
                .push(cell.parse().map_err(|_| format!("{name}, line {line}: `{cell}` is not a number"))?),
        }
    }
    Ok(found)
}

/// The numbers by which a sample is compared, and behind them the share of falls that reached a line. `None`: there are too few values.
pub fn numbers(sample: &[f64], share: Option<f64>) -> Option<Vec<f64>> {
    if sample.len() < FEWEST {
        return None;
    }
    let mut sorted = sample.to_vec();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len() as f64;
    let mean = sorted.iter().sum::<f64>() / count;
    let deviation = (sorted.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    let quantiles = [0.1, 0.5, 0.9].map(|share| quantile(&sorted, share));
    Some(quantiles.into_iter().chain([mean, deviation]).chain(share).collect())
}

/// A calibration, checked as far as that goes without terrain.
pub struct Calibration {
    file: Scene,
    /// What is sought.
    pub parameters: Vec<Parameter>,
    /// What was observed.
    pub observed: Vec<Observed>,
    /// Where each parameter lies in its range, from 0 to 1, for each set.
    places: Vec<Vec<f64>>,
    /// The study that is computed: its own with the parameters in `[vary]`, a replicate for each set.
    study: Scene,
    /// Falls of each release in a replicate: those that are compared with what is fitted, and with what is predicted.
    pools: Vec<[u64; 2]>,
    /// Whether the answer is for programs.
    json: bool,
}

impl Calibration {
    /// Read and check it.
    pub fn of(file: Scene, json: bool) -> Result<Self, Diagnostic> {
        let Some(path) = file.read::<PathBuf>("study")? else {
            return file.refuse("study", "the key `study` is missing", "study = \"study.toml\"");
        };
        let study = Scene::load_as(&STUDY, &file.resolve(&path), &[])?;
        let settings = StudySettings::of(&study)?;
        let parameters: Vec<Parameter> = file.read("parameter")?.unwrap_or_default();
        let mut observed: Vec<Observed> = file.read("observed")?.unwrap_or_default();
        for (at, own) in observed.iter_mut().enumerate() {
            own.read(&format!("observed.{at}"), &file)?;
        }
        let [sets, seed] = [("sets", 200), ("seed", 1)]
            .map(|(key, default)| file.read::<u32>(key).map(|given| given.unwrap_or(default)));
        let (sets, seed) = (sets?, seed?);
        if !(SETS[0]..=SETS[1]).contains(&sets) {
            let what = format!("sets = {sets}: from {} to {} are possible", SETS[0], SETS[1]);
            return file.refuse("sets", what, "200 for two parameters, more for more");
        }
        let names = parameters.iter().map(|parameter| (parameter.key.clone(), 0)).collect();
        let sampler = Sampler::new(Sampling::LatinHypercube, u64::from(seed), 0, [u64::from(sets), 1], names);
        let of = |dimension| (0..u64::from(sets)).map(|set| sampler.at(dimension, set)).collect();
        let places = (0..parameters.len()).map(of).collect();
        let mut it = Self { file, parameters, observed, places, study, pools: Vec::new(), json };
        it.check(&settings)?;
        let falls = it.file.read::<u32>("falls")?.unwrap_or(0);
        it.pools = it.pools_of(&settings, u64::from(falls));
        it.study = it.study.patched(it.document(sets, seed)?);
        Ok(it)
    }

    fn check(&self, study: &StudySettings) -> Result<(), Diagnostic> {
        let file = &self.file;
        if self.parameters.is_empty() {
            let cure = "[[parameter]] with key = \"contact.0.friction\", from = 0.2, to = 0.8";
            return file.refuse("parameter", "no parameter is sought", cure);
        }
        if !self.observed.iter().any(|own| own.used == Use::Fit) {
            let cure = "[[observed]] with what = \"stop\" and values = [...]";
            return file.refuse("observed", "nothing is observed from which parameters could follow", cure);
        }
        for (at, Parameter { key, from, to, scale }) in self.parameters.iter().enumerate() {
            let place = format!("parameter.{at}");
            let least = if *scale == Scale::Log { 0.0 } else { f64::NEG_INFINITY };
            if !(*from < *to && *from > least) {
                let what = format!(
                    "from {from} to {to}: the first must lie below the second, and with `log` above 0"
                );
                return file.refuse(&format!("{place}.from"), what, "from = 0.2, to = 0.8");
            }
            if self.parameters[..at].iter().any(|other| other.key == *key) {
                return Err(file.invalid(&format!("{place}.key"), format!("`{key}` is sought twice")));
            }
            if study.varied().iter().any(|variable| variable.name == *key) {
                let what =
                    format!("`{key}` varies from fall to fall in the study, and one value for all is sought");
                return file.refuse(&format!("{place}.key"), what, "leave it out of [vary] of the study");
            }
        }
        for (at, own) in self.observed.iter().enumerate() {
            let place = |key: &str| format!("observed.{at}.{key}");
            let lines: Vec<&str> = study.lines.iter().map(|line| &line.name[..]).collect();
            let releases: Vec<&str> = study.releases.iter().map(|release| &release.name[..]).collect();
            match (&own.line, own.what.of_member(), own.what.at_line()) {
                (Some(_), _, None) => {
                    return file.refuse(&place("line"), "a stop is nowhere on a line", "leave `line` out");
                }
                (None, None, _) => {
                    let what = format!("{} is observed at a line alone", own.what.0);
                    return file.refuse(&place("what"), what, "line = \"road\", a line of the study");
                }
                _ => {}
            }
            for (key, name, known) in [("line", &own.line, lines), ("release", &own.release, releases)] {
                if let Some(name) = name.as_deref().filter(|name| !known.contains(name)) {
                    let what = format!("the study has no {key} `{name}`, but: {}", known.join(", "));
                    return Err(file.invalid(&place(key), what));
                }
            }
            if let Some(of) = own.of
                && (own.line.is_none() || (of as usize) < own.values.len())
            {
                let what = format!("of = {of} falls, and {} values", own.values.len());
                let cure = "of all falls that were watched those that reached the line have values";
                return file.refuse(&place("of"), what, cure);
            }
        }
        Ok(())
    }

    /// Falls of each release: as the study shares them out, as many as each observable takes, and no fewer than `falls`.
    fn pools_of(&self, study: &StudySettings, falls: u64) -> Vec<[u64; 2]> {
        let counts: Vec<u64> = study.releases.iter().map(|release| release.count()).collect();
        let all: u64 = counts.iter().sum();
        let of = |(release, count): (&Release, &u64)| {
            [Use::Fit, Use::Predict].map(|used| {
                let own: Vec<&Observed> = self.observed.iter().filter(|it| it.used == used).collect();
                let most = |of: Option<&str>| {
                    let named = own.iter().filter(|it| it.release.as_deref() == of);
                    named.map(|it| it.falls()).max().unwrap_or(0)
                };
                let least = if own.is_empty() { 0 } else { falls };
                most(Some(&release.name)).max((most(None).max(least) * count).div_ceil(all))
            })
        };
        study.releases.iter().zip(&counts).map(of).collect()
    }

    /// The study that is computed. Falls are independent of each other, as those that were observed are.
    fn document(&self, sets: u32, seed: u32) -> Result<Table, Diagnostic> {
        let mut document = self.study.document()?;
        // Another stream of random numbers than that of the study itself, which may be what is compared.
        let seed = (fnv1a(format!("calibration {seed}").as_bytes()) >> 1) as i64;
        document.insert("sampling".into(), "random".into());
        document.insert("seed".into(), seed.into());
        document.insert(REPLICATES.into(), i64::from(sets).into());
        document.remove("maps");
        if self.observed.iter().all(|own| own.line.is_none()) {
            document.remove("line");
        }
        for (release, pools) in tables(&mut document, "release").zip(&self.pools) {
            release.remove("blocks_per_year");
            release.insert("count".into(), (pools.iter().sum::<u64>().max(1) as i64).into());
        }
        for line in tables(&mut document, "line") {
            line.remove("design");
            line.remove("barrier");
        }
        let vary = document.entry("vary").or_insert_with(|| Table::new().into());
        for Parameter { key, from, to, .. } in &self.parameters {
            let range = Table::from_iter([("uniform".into(), Value::from(vec![*from, *to]))]);
            vary.as_table_mut().map(|vary| vary.insert(key.clone(), range.into()));
        }
        Ok(document)
    }

    /// What is said of a parameter where the study has it, at its place in the file.
    fn moved(&self, said: Diagnostic) -> Diagnostic {
        let own = |it: &Parameter| said.key.as_deref() == Some(&format!("vary.{}", it.key));
        match self.parameters.iter().position(own) {
            None => said,
            Some(at) => {
                self.file.placed(Diagnostic { place: None, ..said }.about(format!("parameter.{at}.key")))
            }
        }
    }

    /// The study with its terrain, and the values of each set.
    fn base(&self, shortcuts: bool, directory: &Directory) -> Result<Base, Diagnostic> {
        let kept = [directory.path(run_dir::CLUSTERS)];
        let mut base = gate::read(&self.study, shortcuts, &kept).map_err(|e| self.moved(e))?;
        base.warnings = std::mem::take(&mut base.warnings).into_iter().map(|said| self.moved(said)).collect();
        for (parameter, places) in self.parameters.iter().zip(&self.places) {
            let at = base.study.varied().iter().position(|variable| variable.name == parameter.key);
            let values = places.iter().map(|place| parameter.value(*place)).collect();
            base.shared.push((at.expect("it is in [vary]"), values));
        }
        let own = format!("{} {:?}", base.fingerprint, base.shared);
        base.fingerprint = format!("{:016x}", fnv1a(own.as_bytes()));
        Ok(base)
    }

    /// Members of a replicate, from 0, that are compared with what is fitted, or predicted: releases take turns in proportion.
    fn members(&self, base: &Base, used: Use) -> Vec<usize> {
        let mut all = Vec::new();
        for (release, [fit, predict]) in self.pools.iter().enumerate() {
            let (first, count) = if used == Use::Fit { (0, *fit) } else { (*fit, *predict) };
            let own = (0..count)
                .map(|k| ((k as f64 + 0.5) / count as f64, (base.starts[release] + first + k) as usize));
            all.extend(own);
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, member)| member).collect()
    }

    /// What would have been observed of a fall.
    fn value(&self, base: &Base, own: &Observed, record: &Record) -> Option<f64> {
        let outcome = &record.outcome;
        if outcome.status == RunStatus::Failed {
            return None;
        }
        let value = match (&own.line, own.what.at_line(), own.what.of_member()) {
            (Some(name), Some(at_line), _) => {
                let line = base.study.lines.iter().position(|line| line.name == *name)?;
                (at_line.of)(&record.track.crossings.iter().find(|it| usize::from(it.line) == line)?.at)
            }
            (_, _, of_member) => (of_member?.of)(outcome),
        };
        Some(value).filter(|value| value.is_finite())
    }

    /// The sample of a set as what was observed was taken: of its falls in `order` as many as were watched, or as have so many values.
    fn sample(&self, base: &Base, own: &Observed, falls: &[Record], order: &[usize]) -> Option<Vec<f64>> {
        let from = |member: &&usize| {
            own.release
                .as_ref()
                .is_none_or(|name| base.study.releases[base.release_of(**member as u64 + 1)].name == *name)
        };
        let watched = own.of.map_or(usize::MAX, |of| of as usize);
        let values =
            order.iter().filter(from).take(watched).filter_map(|at| self.value(base, own, &falls[*at]));
        let most = if own.of.is_some() { usize::MAX } else { own.values.len() };
        let values: Vec<f64> = values.take(most).collect();
        numbers(&values, own.of.map(|of| values.len() as f64 / f64::from(of)))
    }
}

/// The hidden subcommand that prints it as JSON.
pub const SCHEMA: Extra = Extra {
    command: || {
        clap::Command::new("calibration-schema")
            .about("Print the JSON schema of a calibration file")
            .hide(true)
    },
    run: |_| {
        show(&share().to_json());
        Ok(Exit::Done)
    },
};

/// Keys of a calibration file, with their texts.
pub fn share() -> Share {
    Tables::default()
        .value::<String>("title", "Title of the calibration, for reports.")
        .value::<String>("study", "Study of which a replicate is computed with each set of parameters; relative to the file.")
        .value::<u32>("sets", "Number of sets of parameters that are tried, a Latin hypercube over their ranges. Default 200.")
        .value::<u32>(
            "falls",
            "Least number of falls with each set to compare with what is fitted, and as many with what is predicted. Default as many as were observed.",
        )
        .value::<u32>("seed", "Another number, other sets and falls. Default 1.")
        .key::<Vec<Parameter>>("parameter")
        .key::<Vec<Observed>>("observed")
        .share()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_a_calibration_is_described_and_no_other() {
        let share = share();
        let mut known: Vec<&str> = share.properties.keys().map(String::as_str).collect();
        let mut read = CALIBRATION.keys.to_vec();
        known.sort_unstable();
        read.sort_unstable();
        assert_eq!(known, read);
    }

    #[test]
    fn a_column_is_read_by_its_name_and_what_is_not_a_number_has_its_line() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("a.csv");
        std::fs::write(&path, "block, stop\n1, 80.5\n2,\n3, 91\n").expect("written");
        assert_eq!(column_of(&path, "stop"), Ok(vec![80.5, 91.0]));
        assert!(column_of(&path, "stops").is_err_and(|e| e.contains("no column `stops`, but block, stop")));
        std::fs::write(&path, "stop\n80.5\nfar\n").expect("written");
        assert!(column_of(&path, "stop").is_err_and(|e| e.contains("line 3: `far` is not a number")));
    }
}
