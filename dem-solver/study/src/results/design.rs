//! Checks of a barrier on a line: what it must be able to do, and whether it is.

use crate::bounds::{self, CONFIDENCE, quantile};
use crate::design::{Design, Level, Onr, UNI_QUANTILE, Uni};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::Measure;
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::numbers::short;

/// Of the members that pass a line, the largest values of each in ascending order.
#[derive(Debug, Clone, Copy)]
pub struct Passing<'a> {
    /// Kinetic energies [J].
    pub energy: &'a [f64],
    /// Heights of the centre above the ground [m].
    pub height: &'a [f64],
    /// Speeds [m/s].
    pub speed: &'a [f64],
    /// Their masses [kg].
    pub mass: &'a [f64],
}

/// A number of a check, and what it must not pass.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    standard: &'static str,
    name: &'static str,
    value: f64,
    unit: &'static str,
    how: String,
    /// What the barrier has.
    has: Option<f64>,
    /// Rocks that have more of it.
    more: Option<String>,
    /// Rocks that have more of it than the barrier.
    over: Option<String>,
    /// The same of the upper bound of its quantile: at most this with [`CONFIDENCE`]; `None`: too few rocks to say.
    bound: Option<f64>,
    /// Why nothing can be called sufficient.
    weak: Option<String>,
}

impl Row {
    /// A number, and how it was made.
    fn new(standard: &'static str, name: &'static str, value: f64, unit: &'static str, how: String) -> Self {
        Self { standard, name, value, unit, how, has: None, more: None, over: None, bound: None, weak: None }
    }

    /// The same, of which the barrier has so much, and which follows from a quantile of `sample` by `required`.
    fn judged(self, has: Option<f64>, sample: &Sample, quantile: f64, required: impl Fn(f64) -> f64) -> Self {
        let bound = bounds::upper(sample.values, quantile / 100.0).map(required);
        Self { has, bound, weak: sample.weakness(quantile), ..self }
    }

    /// With how many of the rocks that pass have more than the barrier.
    fn against(self, all: &[f64]) -> Self {
        let has = self.has.unwrap_or(f64::INFINITY);
        let above = all.iter().filter(|value| **value > has).count();
        let over = (above > 0).then(|| format!("{above} of {} rocks that pass have more", all.len()));
        Self { over, ..self }
    }

    /// Whether the barrier has it: for the table, and in words.
    fn finding(&self) -> Option<(&'static str, String)> {
        Some(match (self.has? >= self.value, &self.weak) {
            (false, _) => ("no", "not satisfied".into()),
            // What was found is not enough to say so.
            (true, Some(why)) => ("not judged", format!("not judged, {why}")),
            (true, None) if self.bound.is_some_and(|bound| self.has < Some(bound)) => {
                ("not judged", "not judged: more members may show that it is too weak".into())
            }
            (true, None) => ("yes", "satisfied".into()),
        })
    }

    fn is_satisfied(&self) -> bool {
        self.finding().is_some_and(|(satisfied, _)| satisfied == "yes")
    }
}

/// What a quantile is taken of.
struct Sample<'a> {
    values: &'a [f64],
    study: &'a Reliability,
}

impl Sample<'_> {
    fn at(&self, quantile_of: f64) -> Option<f64> {
        (!self.values.is_empty()).then(|| quantile(self.values, quantile_of / 100.0))
    }

    /// Why nothing can be called sufficient by this quantile [%].
    fn weakness(&self, quantile: f64) -> Option<String> {
        if self.study.is_unreliable {
            return Some("the study is unreliable".into());
        }
        let (count, least) = (self.values.len(), least(quantile));
        (count < least).then(|| {
            format!("{count} rocks are too few for a bound of the {quantile} % quantile, which takes {least}")
        })
    }
}

/// Number of rocks from which on the largest of them bounds a quantile [%].
fn least(quantile: f64) -> usize {
    bounds::least(quantile / 100.0)
}

/// What is known of a study as a whole before its lines are judged.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reliability {
    /// Too many of its members failed, are unreliable, or still moved.
    pub is_unreliable: bool,
    /// Warnings about its input.
    pub doubts: usize,
}

const UNI: &str = "UNI 11211-4";
const ONR: &str = "ONR 24810";

/// Names of the standards in measures.
fn key(standard: &str) -> &'static str {
    if standard == UNI { "uni" } else { "onr" }
}

fn of_uni(uni: &Uni, design: &Design, passing: &Passing, study: &Reliability) -> Option<Vec<Row>> {
    let [speeds, heights] = [passing.speed, passing.height].map(|values| Sample { values, study });
    let (speed, height) = (speeds.at(UNI_QUANTILE)?, heights.at(UNI_QUANTILE)?);
    let (trajectories, topography) = (uni.trajectories, uni.topography);
    let row = |name, value, unit, how| Row::new(UNI, name, value, unit, how);
    let fast = speed * trajectories * topography;
    let mass = uni.block_mass * uni.block_survey * uni.weight;
    let energy = 0.5 * mass * fast * fast;
    let (factor, level) = (uni.energy_factor(), if uni.level == Level::Maximum { "MEL" } else { "SEL" });
    let stated = |stated: bool| if stated { "stated" } else { "of the standard" };
    let high = height * trajectories * topography;
    let border = uni.free_border;
    let typical = speed;
    let (speed, height, block) = (short(speed), short(height), short(uni.block_mass));
    let of_speed =
        format!("{UNI_QUANTILE} % speed {speed} * trajectories {trajectories} * topography {topography}");
    let of_mass = format!("block {block} * survey {} * weight {}", uni.block_survey, uni.weight);
    let of_energy = format!("design energy * {factor} ({level}, {})", stated(uni.energy_factor.is_some()));
    let of_height = format!("{UNI_QUANTILE} % height of the centre {height} * {trajectories} * {topography}");
    let required = row("required_energy", energy * factor, "J", of_energy)
        .judged(design.barrier_energy, &speeds, UNI_QUANTILE, |speed| {
            energy * factor * (speed / typical).powi(2)
        })
        .against(passing.energy);
    let mut rows =
        vec![
            row("design_speed", fast, "m/s", of_speed),
            row("design_mass", mass, "kg", of_mass),
            row("design_energy", energy, "J", "half the design mass times the design speed squared".into()),
            Row { more: with_more(energy * factor, passing), ..required },
            row("design_height", high, "m", of_height),
            row("required_height", high + border, "m", format!("design height + free border {border}"))
                .judged(design.barrier_height, &heights, UNI_QUANTILE, |height| {
                    height * trajectories * topography + border
                }),
        ];
    if let Some((elongation, factor)) =
        design.barrier_elongation.zip(uni.distance_factor(design.barrier_fields))
    {
        let how = format!("elongation {elongation} * {factor} ({})", stated(uni.distance_factor.is_some()));
        let required = row("required_distance", elongation * factor, "m", how);
        rows.push(Row { has: design.distance, ..required });
    }
    Some(rows)
}

fn of_onr(onr: &Onr, design: &Design, passing: &Passing, study: &Reliability) -> Option<Vec<Row>> {
    let [energies, heights] = [passing.energy, passing.height].map(|values| Sample { values, study });
    let (energy, height) = (energies.at(onr.energy_quantile)?, heights.at(onr.height_quantile)?);
    let Onr { energy_quantile, height_quantile, energy_factor, height_factor } = *onr;
    let of_energy = format!("{energy_quantile} % energy {} * {energy_factor}", short(energy));
    let of_height = format!("{height_quantile} % height of the centre {} * {height_factor}", short(height));
    Some(vec![
        Row::new(ONR, "required_energy", energy * energy_factor, "J", of_energy)
            .judged(design.barrier_energy, &energies, energy_quantile, |energy| energy * energy_factor)
            .against(passing.energy),
        Row::new(ONR, "required_height", height * height_factor, "m", of_height).judged(
            design.barrier_height,
            &heights,
            height_quantile,
            |height| height * height_factor,
        ),
    ])
}

/// What a check of a line comes to.
#[derive(Debug, Default)]
pub struct Checked {
    /// Its numbers.
    pub measures: Vec<Measure>,
    /// A sentence for each standard.
    pub sentences: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
}

/// What a standard requires of a barrier: its name, the quantity, how much.
pub type Required = (&'static str, &'static str, f64);

/// Judge the barrier of the line `name` and write the table of its numbers to `path`; what the standards require.
pub fn write(
    path: &Path,
    name: &str,
    design: &Design,
    passing: &Passing,
    study: &Reliability,
    checked: &mut Checked,
) -> io::Result<Vec<Required>> {
    let mut required = Vec::new();
    let of_uni = design.uni_11211_4.as_ref().and_then(|uni| of_uni(uni, design, passing, study));
    let of_onr = design.onr_24810.as_ref().and_then(|onr| of_onr(onr, design, passing, study));
    checked.warnings.extend(design.uni_11211_4.as_ref().and_then(|uni| block(name, uni, passing)));
    if let Some(rows) = &of_uni {
        checked.warnings.extend(below_largest(name, rows));
    }
    let table = Columns::new()
        .with("standard", |row: &Row| row.standard.into())
        .with("quantity", |row| row.name.into())
        .number("value", |row| Some(row.value))
        .with("unit", |row| row.unit.into())
        .with("from", |row| row.more.as_ref().map_or(row.how.clone(), |more| format!("{}; {more}", row.how)))
        .number("upper_bound", |row| row.bound)
        .number("barrier", |row| row.has)
        .with("satisfied", |row| row.finding().map_or("", |(satisfied, _)| satisfied).into());
    let standards: Vec<_> = [of_uni, of_onr].into_iter().flatten().collect();
    for rows in &standards {
        for row in rows {
            required.push((row.standard, row.name, row.value));
            let measure = format!("{name}_{}_{}", key(row.standard), row.name);
            let bound = row.bound.map(|bound| Measure::new(format!("{measure}_upper"), bound, row.unit));
            checked.measures.push(Measure::new(measure, row.value, row.unit));
            checked.measures.extend(bound);
        }
        checked.sentences.push(sentence(name, rows, study));
    }
    files::write(path, table.csv(&standards.concat())?.as_bytes())?;
    let of_uni = design.uni_11211_4.as_ref().map(|_| UNI_QUANTILE);
    let of_onr = design.onr_24810.as_ref().map(|onr| onr.energy_quantile.max(onr.height_quantile));
    let most = of_uni.into_iter().chain(of_onr).fold(0.0, f64::max);
    let (count, due) = (passing.speed.len(), least(most));
    if count < due {
        let what = format!(
            "the line `{name}`: {count} rocks pass, and it takes {due} to bound the {most} % quantile of its design with {:.0} % confidence",
            100.0 * CONFIDENCE
        );
        let few = Diagnostic::warning(code::FEW_SAMPLES, what);
        checked.warnings.push(few.try_instead("more members are required"));
    }
    Ok(required)
}

/// Largest design block over the largest rock that passes of which nothing is said.
const HEAVY: f64 = 10.0;

/// What is said of a design block that is not one of the rocks that pass.
fn block(name: &str, uni: &Uni, passing: &Passing) -> Option<Diagnostic> {
    let (block, [least, most]) = (uni.block_mass, [*passing.mass.first()?, *passing.mass.last()?]);
    // Masses that do not vary are a density times a volume, rounded.
    let heavier = passing.mass.iter().filter(|mass| **mass > block * (1.0 + 1e-3)).count();
    if heavier == 0 && block <= HEAVY * most {
        return None;
    }
    let tonnes = 1e3 * block;
    let hint = match block < least && (least..=HEAVY * most).contains(&tonnes) {
        true => format!("were it in tonnes, it would be {} kg", short(tonnes)),
        false if heavier > 0 => "the energy that UNI 11211-4 requires is that of the lighter block".into(),
        false => "the energy that UNI 11211-4 requires is that of a rock that is not in this study".into(),
    };
    let ([block, least, most], count) = ([block, least, most].map(short), passing.mass.len());
    let what = format!(
        "the line `{name}`: block_mass = {block} kg, and the rocks that pass have {least} to {most} kg, {heavier} of {count} are heavier"
    );
    Some(Diagnostic::warning(code::UNUSUAL_VALUE, what).try_instead(hint))
}

/// Rocks that pass with more than this energy [J], in words.
fn with_more(required: f64, passing: &Passing) -> Option<String> {
    let largest = *passing.energy.last().filter(|largest| **largest > required)?;
    let above = passing.energy.iter().filter(|energy| **energy > required).count();
    let all = passing.energy.len();
    Some(format!("{above} of {all} rocks that pass have more energy, up to {} J", short(largest)))
}

/// What is said of an energy that some rock that passes has more of.
fn below_largest(name: &str, rows: &[Row]) -> Option<Diagnostic> {
    let (required, more) = rows.iter().find_map(|row| Some((row.value, row.more.as_ref()?)))?;
    let required = short(required);
    let what = format!(
        "the line `{name}`: {UNI} requires {required} J, and {more}: it takes the mass of the design block, the {UNI_QUANTILE} % speed \
         and no rotation"
    );
    Some(Diagnostic::warning(code::TRUST, what))
}

/// What a barrier must have, and whether it has it.
fn sentence(name: &str, rows: &[Row], study: &Reliability) -> String {
    let parts = rows.iter().filter(|row| row.name.starts_with("required")).map(|row| {
        let what = row.name.trim_start_matches("required_");
        let must = format!("{what} {} {}", short(row.value), row.unit);
        let bound = row
            .bound
            .map(|bound| format!(" (at most {} with {:.0} % confidence)", short(bound), 100.0 * CONFIDENCE));
        let must = must + &bound.unwrap_or_default();
        let more = row.more.as_ref().map_or(String::new(), |more| format!(" ({more})"));
        let must = must + &more;
        let Some((has, (_, finding))) = row.has.zip(row.finding()) else { return must };
        let over = row.over.as_ref().map_or(String::new(), |over| format!(" ({over})"));
        format!("{must}, the barrier has {}{over}: {finding}", short(has))
    });
    let parts: Vec<String> = parts.collect();
    let doubts = match study.doubts {
        0 => String::new(),
        _ if !rows.iter().any(Row::is_satisfied) => String::new(),
        1 => "; a warning about the input of this study is open".into(),
        count => format!("; {count} warnings about the input of this study are open"),
    };
    format!("line `{name}`, {}: required are {}{doubts}", rows[0].standard, parts.join("; "))
}

#[cfg(test)]
mod tests;
