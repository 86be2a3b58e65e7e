//! What passes each line: a table of crossings, exceedance curves, quantiles of energy, height and speed, each with its interval.

use super::design::{self, Checked, Passing as Rocks, Reliability};
use super::frequency::{PERIODS, Source, of_period, reaching, value_of};
use crate::base::Base;
use crate::bounds::{Part, of_frequency, of_quantile, of_share, quantile};
use crate::capacity::{COUNTED, FATES, fate};
use crate::path_quantity::{PathQuantity, in_order, statistics};
use crate::record::All;
use crate::settings::{BEHIND, ScreenLine, StudySettings};
use crate::summary::{SHARES, quantile_of};
use crate::track::Crossing;
use dem_rocks::results::map::sheet::{
    Axes, FINE, INK, Imprint, LEFT, RIGHT, draw_line, font, page, plot, px,
};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::{Interval, Measure, Worse};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::io;
use std::path::Path;
use toolkit::columns::Columns;
use toolkit::files;
use toolkit::history::column;
use toolkit::numbers::three;
use toolkit::summary::RunStatus;

/// Measures of a line that the screen shows first, with their ranks.
const RANKS: [(&str, u16); 9] = [
    ("passing_share", 5),
    ("passing_frequency", 6),
    ("behind_barrier_share", 7),
    ("behind_barrier_frequency", 7),
    ("energy_100_years", 8),
    ("height_100_years", 9),
    ("energy_q95", 10),
    ("energy_q99", 12),
    ("height_q95", 14),
];

/// Quantities of crossings in the order of their columns; what is not named here follows.
const COLUMNS: [&str; 6] =
    ["centre_height", "height", "speed", "energy", "translation_energy", "rotation_energy"];

/// The table of crossings: of a member, the number of the crossing, and the crossing.
fn columns(base: &Base) -> Columns<'_, (u64, u64, Crossing)> {
    let origin = base.ground.origin;
    let columns = Columns::new()
        .with("member", |(member, ..): &(u64, u64, Crossing)| member.to_string())
        .with("crossing", |(_, number, _)| number.to_string())
        .numbers(["time_s", "along_m"], |(.., it)| Some([it.at.time, it.along]))
        .numbers(["x_m", "y_m", "z_m"], move |(.., it)| {
            Some([0, 1, 2].map(|k| it.at.position[k] + origin[k]))
        });
    let columns = in_order(&COLUMNS).into_iter().fold(columns, |columns, quantity| {
        // Beside the terrain, or over a hole in it, a height is not known.
        let value = |it: &Crossing| Some((quantity.of)(&it.at)).filter(|value| !value.is_nan());
        columns.number(quantity.column(), move |(.., it)| value(it))
    });
    columns.numbers(["vx_m_per_s", "vy_m_per_s", "vz_m_per_s"], |(.., it)| Some(it.at.velocity))
}

/// A line as it is looked at: all that passes it, or what the barriers of other lines leave of that.
struct View<'a> {
    /// Its number.
    number: usize,
    line: &'a ScreenLine,
    /// What its results are called.
    name: String,
    /// Whether a member that another line's barrier has stopped is counted no more.
    behind: bool,
}

/// Every line without barriers, and, where another one has a barrier, with them.
fn views(study: &StudySettings) -> Vec<View<'_>> {
    let barriers = study.lines.iter().filter(|line| line.barrier.is_some()).count();
    let (mut all, lines) = (Vec::new(), study.lines.iter().enumerate());
    for (number, line) in lines {
        all.push(View { number, line, name: line.name.clone(), behind: false });
        if barriers > usize::from(line.barrier.is_some()) {
            all.push(View { number, line, name: format!("{}{BEHIND}", line.name), behind: true });
        }
    }
    all
}

/// For each line when its barrier stops a member with these crossings [s]; infinite where it does not.
fn stops(lines: &[ScreenLine], crossings: &[Crossing]) -> Vec<f64> {
    let of = |(number, line): (usize, &ScreenLine)| {
        let first =
            crossings.iter().find(|it| usize::from(it.line) == number).filter(|_| line.barrier.is_some());
        let stopped = first.filter(|it| fate(line.barrier, Some([it.at.energy, it.at.centre])) == 0);
        stopped.map_or(f64::INFINITY, |it| it.at.time)
    };
    lines.iter().enumerate().map(of).collect()
}

/// What passes one line.
struct Passages {
    /// Of each of the [`statistics`] the largest values of each member that passes, in ascending order.
    largest: Vec<Vec<f64>>,
    /// Their masses [kg], likewise.
    masses: Vec<f64>,
    /// The largest values by release, where blocks a year are known.
    of_release: Vec<Vec<Vec<f64>>>,
    /// How many members of each release have which fate.
    fates: Vec<[u64; FATES]>,
}

/// Members of each release that were computed, and its blocks a year where all are known.
struct Releases {
    computed: Vec<u64>,
    rates: Option<Vec<f64>>,
}

impl Releases {
    /// All members that were computed.
    fn computed(&self) -> u64 {
        self.computed.iter().sum()
    }

    /// Blocks a year of members that are counted by release.
    fn frequency(&self, counts: &[u64]) -> Option<(f64, Interval)> {
        let parts = self.rates.as_ref()?.iter().zip(counts).zip(&self.computed);
        Some(of_frequency(parts.map(|((&rate, &count), &all)| Part { rate, count, all })))
    }
}

/// Called with every crossing: number of its line, of its member, of the crossing.
type Each<'a> = &'a mut dyn FnMut(usize, &(u64, u64, Crossing)) -> io::Result<()>;

/// What passes the line of each view, and how many members were computed.
fn gather(base: &Base, views: &[View], all: All, each: Each) -> io::Result<(Vec<Passages>, Releases)> {
    let (rates, count) = (base.study.rates(), base.study.releases.len());
    let rated = rates.as_ref().map_or(0, Vec::len);
    let none = || vec![Vec::new(); statistics().count()];
    let of_line = || Passages {
        largest: none(),
        masses: Vec::new(),
        of_release: vec![none(); rated],
        fates: vec![[0; FATES]; count],
    };
    let mut passing: Vec<Passages> = views.iter().map(|_| of_line()).collect();
    let mut computed = vec![0_u64; count];
    all(&mut |record| {
        if record.outcome.status == RunStatus::Failed {
            return Ok(());
        }
        let release = base.release_of(record.number);
        computed[release] += 1;
        let stopped = stops(&base.study.lines, &record.track.crossings);
        for (passing, &View { number, line, behind, .. }) in passing.iter_mut().zip(views) {
            let others = stopped.iter().enumerate().filter(|(other, _)| behind && *other != number);
            let until = others.fold(f64::INFINITY, |until, (_, time)| until.min(*time));
            let mut most: Option<Vec<f64>> = None;
            let own = || {
                let crossings = record.track.crossings.iter();
                crossings.filter(move |it| usize::from(it.line) == number && it.at.time < until)
            };
            for (count, crossing) in (1..).zip(own()) {
                if !behind {
                    each(number, &(record.number, count, *crossing))?;
                }
                let most = most.get_or_insert_with(|| vec![f64::NEG_INFINITY; statistics().count()]);
                let all = most.iter_mut().zip(statistics());
                all.for_each(|(most, quantity)| *most = most.max(quantity.statistic_of(&crossing.at)));
            }
            passing.fates[release][fate(line.barrier, own().next().map(|c| [c.at.energy, c.at.centre]))] += 1;
            let Some(most) = most else { continue };
            passing.masses.push(record.outcome.mass);
            for all in std::iter::once(&mut passing.largest).chain(passing.of_release.get_mut(release)) {
                let known = all.iter_mut().zip(&most).filter(|(_, value)| value.is_finite());
                known.for_each(|(all, value)| all.push(*value));
            }
        }
        Ok(())
    })?;
    let sort = |values: &mut Vec<f64>| values.sort_by(f64::total_cmp);
    for Passages { largest, masses, of_release, .. } in &mut passing {
        largest.iter_mut().chain(of_release.iter_mut().flatten()).chain([masses]).for_each(sort);
    }
    // Of a release without a member nothing is known.
    let rates = rates.filter(|_| !computed.contains(&0));
    Ok((passing, Releases { computed, rates }))
}

impl Passages {
    /// The largest values of the statistic of this name.
    fn largest(&self, name: &str) -> &[f64] {
        let known = statistics().zip(&self.largest).find(|(quantity, _)| quantity.name == name);
        known.map_or(&[], |(_, values)| values)
    }

    /// What comes from each release, of each of the [`statistics`]; nothing where blocks a year are not known.
    fn sources(&self, Releases { computed, rates }: &Releases) -> Vec<Vec<Source<'_>>> {
        let Some(rates) = rates else { return Vec::new() };
        let of = |at: usize| {
            let all = rates.iter().zip(computed).zip(&self.of_release);
            all.map(|((&rate, &all), values)| Source { rate, all, values: &values[at] }).collect()
        };
        (0..self.largest.len()).map(of).collect()
    }

    /// Its measures, and values of which return periods are absent.
    fn measures(&self, View { line, name, .. }: &View, releases: &Releases) -> (Vec<Measure>, Vec<String>) {
        let (mut all, mut absent, computed) = (vec![], vec![], releases.computed());
        let mut report = |what: &str, value: f64, unit: &str, interval: Option<Interval>| {
            let rank = RANKS.iter().find(|(ranked, _)| *ranked == what).map_or(Measure::ORDINARY, |r| r.1);
            // A frequency says the same and more.
            let rank = if releases.rates.is_some() && unit == "1" { Measure::ORDINARY } else { rank };
            let measure = Measure::new(format!("{name}_{what}"), value, unit).ranked(rank, Worse::Larger);
            all.push(Measure { interval, ..measure });
        };
        report("passing", self.masses.len() as f64, "1", None);
        for (what, fates) in counted(line) {
            let of = |all: &[u64; FATES]| fates.iter().map(|fate| all[*fate]).sum();
            let counts: Vec<u64> = self.fates.iter().map(of).collect();
            let count = counts.iter().sum();
            let share = count as f64 / computed as f64;
            report(&share_of(what), share, "1", Some(of_share(count, computed)));
            if let Some((often, interval)) = releases.frequency(&counts) {
                report(&frequency_of(what), often, "1/year", Some(interval));
            }
        }
        let sources = self.sources(releases);
        for (at, (values, PathQuantity { name, unit, .. })) in
            self.largest.iter().zip(statistics()).enumerate()
        {
            let Some(most) = values.last() else { continue };
            for percent in SHARES {
                let share = f64::from(percent) / 100.0;
                let interval = Some(of_quantile(values, share));
                report(&quantile_of(name, percent), quantile(values, share), unit, interval);
            }
            report(&format!("{name}_largest"), *most, unit, None);
            for (years, sources) in PERIODS.into_iter().flat_map(|years| Some((years, sources.get(at)?))) {
                match of_period(sources, values, f64::from(years)) {
                    Some((value, interval)) => report(&value_of(name, years), value, unit, Some(interval)),
                    None => absent.push(value_of(name, years)),
                }
            }
        }
        (all, absent)
    }
}

/// Names of a share of all members, and of the blocks a year for which they stand.
fn share_of(what: &str) -> String {
    format!("{what}_share")
}

fn frequency_of(what: &str) -> String {
    format!("{what}_frequency")
}

/// What is counted at a line.
fn counted(line: &ScreenLine) -> impl Iterator<Item = (&'static str, &'static [usize])> {
    COUNTED.into_iter().take(if line.barrier.is_some() { COUNTED.len() } else { 1 })
}

/// Names of all measures of lines that have an interval.
pub fn bounded(base: &Base) -> impl Iterator<Item = String> {
    let is_rated = base.study.rates().is_some();
    views(&base.study).into_iter().flat_map(move |View { line, name, .. }| {
        let quantiles = statistics().flat_map(|it| SHARES.map(|share| quantile_of(it.name, share)));
        let of_periods = statistics().flat_map(|it| PERIODS.map(|years| value_of(it.name, years)));
        let frequencies = counted(line).map(|(what, _)| frequency_of(what));
        let rated = of_periods.chain(frequencies).filter(move |_| is_rated);
        let all = counted(line).map(|(what, _)| share_of(what)).chain(quantiles).chain(rated);
        all.map(move |what| format!("{name}_{what}"))
    })
}

/// The measures of all lines; nothing is written.
pub fn measures(base: &Base, all: All) -> io::Result<Vec<Measure>> {
    let views = views(&base.study);
    let (passing, releases) = gather(base, &views, all, &mut |_, _| Ok(()))?;
    let lines = views.iter().zip(&passing).filter(|_| releases.computed() > 0);
    Ok(lines.flat_map(|(view, passing)| passing.measures(view, &releases).0).collect())
}

/// Write tables and curves of all lines; add their measures.
pub fn write(
    base: &Base,
    dir: &Path,
    imprint: &Imprint,
    all: All,
    study: &Reliability,
    found: &mut Checked,
) -> io::Result<()> {
    let (mut tables, columns) = (Vec::new(), columns(base));
    for line in &base.study.lines {
        let mut table = csv::Writer::from_writer(files::create(&dir.join(format!("{}.csv", line.name)))?);
        table.write_record(columns.names())?;
        tables.push(table);
    }
    let views = views(&base.study);
    let (passing, releases) =
        gather(base, &views, all, &mut |line, row| Ok(tables[line].write_record(columns.row(row))?))?;
    let computed = releases.computed();
    tables.iter_mut().try_for_each(|table| table.flush())?;
    if releases.rates.is_none() && base.study.rates().is_some() {
        let what = "frequencies absent: there is a release of which no member was computed";
        found.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
    }
    let (mut before, mut rare) = (0, Vec::<(Vec<String>, String)>::new());
    for (view, passing) in views.iter().zip(&passing) {
        let View { line, name, behind, .. } = view;
        if computed == 0 {
            let what = format!("what passes the line `{name}` is not known: no member was computed");
            found.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
            continue;
        }
        let (measures, absent) = passing.measures(view, &releases);
        found.measures.extend(measures);
        match rare.iter_mut().find(|(known, _)| *known == absent) {
            Some((_, names)) => names.push_str(&format!(", `{name}`")),
            None => rare.push((absent, format!("`{name}`"))),
        }
        let count = passing.masses.len();
        if *behind {
            let (of, stopped) = (&line.name, before - count);
            found.sentences.push(format!(
                "line `{of}`: barriers on other lines stop {stopped} of the {before} rocks that come here before they do; {of}_... counts \
                 all of them, {name}_... without those"
            ));
        }
        before = count;
        if count > 0 {
            let marks = [marks(line), judged(view, passing, dir, study, found)?].concat();
            exceedance(&dir.join(format!("{name}_exceedance.csv")), passing, &releases)?;
            let svg = curves(name, &passing.largest, computed, &marks, imprint).map_err(io::Error::other)?;
            files::write(&dir.join(format!("{name}.svg")), svg.as_bytes())?;
        } else if !behind {
            found.warnings.extend(none_passes(line, computed));
        }
    }
    for (absent, lines) in rare.into_iter().filter(|(absent, _)| !absent.is_empty()) {
        let why = "rocks come less often, or it lies above the largest value that was found";
        found.sentences.push(format!("absent at {lines}: {}: {why}", absent.join(", ")));
    }
    Ok(())
}

/// What is absent at a line that none of so many rocks passes.
fn none_passes(ScreenLine { name, design, .. }: &ScreenLine, computed: u64) -> Vec<Diagnostic> {
    let what = format!("quantiles at the line `{name}` absent: none of {computed} rocks passes it");
    let mut said = vec![Diagnostic::warning(code::ABSENT_MEASURE, what)];
    if design.is_some() {
        let what = format!("the barrier on the line `{name}` is not judged by its design: no rock passes it");
        let cure = "is the line where rocks come, and end_time long enough?";
        said.push(Diagnostic::warning(code::FEW_SAMPLES, what).try_instead(cure));
    }
    said
}

/// Judge the barrier on a line by its design, where it has one; what the standards require of it.
fn judged(
    View { line, name, behind, .. }: &View,
    passing: &Passages,
    dir: &Path,
    study: &Reliability,
    found: &mut Checked,
) -> io::Result<Vec<Mark>> {
    let Some(design) = line.design.as_ref().filter(|_| !behind) else { return Ok(Vec::new()) };
    let [energy, height, speed] = ["energy", "centre_height", "speed"].map(|of| passing.largest(of));
    let rocks = Rocks { energy, height, speed, mass: &passing.masses };
    let path = dir.join(format!("{name}_design.csv"));
    let required = design::write(&path, name, design, &rocks, study, found)?.into_iter();
    let marks = required.filter_map(|(standard, quantity, value)| {
        let (_, of) = REQUIRED.iter().find(|(known, _)| *known == quantity)?;
        Some(Mark { of, what: format!("{standard} requires"), value, has: false })
    });
    Ok(marks.collect())
}

/// Rows of many members, about, and how many of the rarest have one each in any case.
const ROWS: usize = 10_000;
const RAREST: usize = 1000;

/// Of `count` members from the rarest on those that have a row, from 1.
fn rows(count: usize) -> impl Iterator<Item = usize> {
    let every = count.div_ceil(ROWS);
    (1..=count).filter(move |n| *n <= RAREST || n % every == 0 || *n == count)
}

/// How often each value is reached or exceeded, of the members that pass and of all; with blocks a year also how often in a year.
fn exceedance(path: &Path, passing: &Passages, releases: &Releases) -> io::Result<()> {
    let (largest, computed) = (&passing.largest, releases.computed());
    let mut table = csv::Writer::from_writer(files::create(path)?);
    let names = statistics().map(|it| column(it.name, it.unit));
    let sources = passing.sources(releases);
    let frequencies = statistics().zip(&sources).flat_map(|(PathQuantity { name, .. }, _)| {
        ["frequency_per_year", "frequency_per_year_low", "frequency_per_year_high", "return_period_years"]
            .map(|what| format!("{name}_{what}"))
    });
    let shares = ["passing", "all"].into_iter();
    let shares = shares.flat_map(|of| ["", "_low", "_high"].map(|end| format!("share_of_{of}{end}")));
    table.write_record(shares.chain(names).chain(frequencies))?;
    let count = largest[0].len();
    for reached in rows(count) {
        let shares = [count as u64, computed].map(|all| {
            let of = of_share(reached as u64, all);
            [Some(reached as f64 / all as f64), of.low, of.high]
        });
        let text = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let shares = shares.into_iter().flatten().map(text);
        // Of a quantity that is not known of all members there are fewer values.
        let value = |values: &Vec<f64>| values.len().checked_sub(reached).map(|at| values[at]);
        let values = largest.iter().map(|values| text(value(values)));
        let frequencies = largest.iter().zip(&sources).flat_map(|(values, sources)| {
            let of = value(values).map(|value| reaching(sources, value));
            let of = of.map(|(often, of)| [Some(often), of.low, of.high, Some(often.recip())]);
            of.unwrap_or_default().map(text)
        });
        table.write_record(shares.chain(values).chain(frequencies))?;
    }
    table.flush()
}

/// What a curve is looked at against.
#[derive(Clone)]
struct Mark {
    /// The statistic.
    of: &'static str,
    what: String,
    value: f64,
    /// Whether a barrier has it; else it is required of one.
    has: bool,
}

/// Quantities that a standard requires which are a statistic.
const REQUIRED: [(&str, &str); 2] = [("required_energy", "energy"), ("required_height", "centre_height")];

/// What the barrier on a line has, as far as it is known.
fn marks(line: &ScreenLine) -> Vec<Mark> {
    let stops = line.barrier.map_or([None; 2], |it| [Some(it.energy), Some(it.height)]);
    let tested = line.design.as_ref().map_or([None; 2], |it| [it.barrier_energy, it.barrier_height]);
    let all =
        [("barrier stops up to", stops), ("barrier has", tested)].into_iter().flat_map(|(what, values)| {
            let of = move |(of, value): (&'static str, Option<f64>)| {
                Some(Mark { of, what: what.into(), value: value?, has: true })
            };
            ["energy", "centre_height"].into_iter().zip(values).filter_map(of)
        });
    all.collect()
}

/// Width and height of a curve's panel, panels side by side, height of the page's title [px].
const PANEL: i32 = 380;
const HEIGHT: i32 = 364;
const BESIDE: usize = 3;
const TITLE: i32 = 36;
/// Steps of a curve that are drawn, each less than a sixth of a pixel high where there are more.
const STEPS: usize = 2000;
const CURVE: RGBColor = RGBColor(0, 90, 160);
const MARK: RGBColor = RGBColor(200, 80, 0);

/// Exceedance of energy, heights and speed, each share with its interval as a band, and what a barrier has and must have.
fn curves(
    name: &str,
    largest: &[Vec<f64>],
    computed: u64,
    marks: &[Mark],
    imprint: &Imprint,
) -> Result<String, String> {
    let drawn = largest.iter().zip(statistics()).filter(|(values, _)| !values.is_empty());
    let drawn: Vec<_> = drawn.map(|(values, it)| (values, it.name, it.title())).collect();
    let count = largest[0].len() as u64;
    let of = of_share(count, computed);
    let [share, low, high] = [Some(count as f64 / computed as f64), of.low, of.high]
        .map(|share| format!("{:.1}", 100.0 * share.unwrap_or(f64::NAN)));
    let title = format!(
        "Line {name}: {share} % [{low}, {high}] of all rocks pass; of these {count}, the share that reaches or exceeds (band: 95 % interval; marked: quantiles)"
    );
    let columns = if drawn.len() > BESIDE { 2 } else { drawn.len() };
    let rows = drawn.len().div_ceil(columns.max(1));
    // The title takes this width.
    let width = (PANEL * columns as i32).max(3 * PANEL);
    page([width, HEIGHT * rows as i32 + TITLE], imprint, "", |root| {
        let (head, rest) = root.split_vertically(TITLE * FINE);
        head.draw(&Text::new(title, (px(f64::from(LEFT)), px(10.0)), font(17.0)))?;
        for (panel, (values, name, (title, scale))) in rest.split_evenly((rows, columns)).iter().zip(drawn) {
            let marks: Vec<&Mark> = marks.iter().filter(|mark| mark.of == name).collect();
            let unit = title.split(['[', ']']).nth(1).unwrap_or_default();
            let highest = marks.iter().map(|mark| mark.value).fold(values[values.len() - 1], f64::max);
            // With room for the words to the right of the largest one.
            let most = (highest * scale).max(1e-9) * 1.9;
            let least = (values[0] * scale).min(0.0);
            let room = [12, RIGHT, 42, LEFT];
            let axes =
                Axes { room, titles: [&title, "share of those that pass"], numbers: [6, 6], grid: true };
            let chart = plot(panel, [[least, 0.0], [most, 1.0]], &axes)?;
            let plot = chart.plotting_area();
            let count = values.len();
            // A step down at each value, or at some of many, from where as many as `of` says reach it.
            let stairs = |of: &dyn Fn(u64) -> f64| -> Vec<(f64, f64)> {
                let mut before = count;
                let drawn = (0..count).rev().step_by(count.div_ceil(STEPS)).rev();
                let steps = drawn.flat_map(|k| {
                    let left = count - k - 1;
                    [std::mem::replace(&mut before, left), left].map(|n| (values[k] * scale, of(n as u64)))
                });
                std::iter::once((least, of(count as u64))).chain(steps).collect()
            };
            let interval = |reached| of_share(reached, count as u64);
            let mut band = stairs(&|reached| interval(reached).low.unwrap_or(0.0));
            band.extend(stairs(&|reached| interval(reached).high.unwrap_or(1.0)).into_iter().rev());
            plot.draw(&Polygon::new(band, CURVE.mix(0.18).filled()))?;
            let all = stairs(&|reached| reached as f64 / count as f64);
            plot.draw(&PathElement::new(all, CURVE.stroke_width(px(1.5) as u32)))?;
            // To the right of its line, where the curve is below.
            let style = font(12.0).pos(Pos::new(HPos::Left, VPos::Center));
            let label = |at, text: String, style| {
                let corner = (px(6.0 + 5.8 * text.chars().count() as f64), px(7.0));
                let ground = Rectangle::new([(px(3.0), px(-7.0)), corner], WHITE.mix(0.75).filled());
                plot.draw(&(EmptyElement::at(at) + ground + Text::new(text, (px(5.0), 0), style)))
            };
            // What a barrier has is a whole line, what is required a dashed one; both go up to their words.
            for (Mark { what, value, has, .. }, height) in marks.into_iter().zip([0.97, 0.89, 0.81, 0.73]) {
                let at = value * scale;
                let ends = vec![(at, 0.0), (at, height)];
                draw_line(plot, usize::from(!has), ends, MARK.stroke_width(px(1.6) as u32))?;
                label((at, height), format!("{what} {} {unit}", three(at)), style.color(&MARK))?;
            }
            for (share, height) in [(0.95, 0.26), (0.99, 0.16)] {
                let at = quantile(values, share) * scale;
                let of = of_quantile(values, share);
                let end = |end: Option<f64>| end.map_or("too few".into(), |end| three(end * scale));
                let (low, high) = (end(of.low), end(of.high));
                let ends = vec![(at, 0.0), (at, height)];
                plot.draw(&PathElement::new(ends, INK.stroke_width(px(1.0) as u32)))?;
                let text = format!("{:.0} %: {} {unit} [{low}, {high}]", 100.0 * share, three(at));
                label((at, height - 0.02), text, style.clone())?;
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_to_ten_thousand_members_have_a_row_each_and_of_more_the_rarest_do() {
        for count in [0, 1, 999, ROWS] {
            assert_eq!(rows(count).count(), count);
        }
        let of_many: Vec<usize> = rows(1_000_001).collect();
        assert_eq!(of_many[..RAREST], (1..=RAREST).collect::<Vec<_>>());
        assert_eq!(of_many[RAREST..RAREST + 2], [1010, 1111]);
        assert!(of_many.len() < ROWS + RAREST && of_many.last() == Some(&1_000_001));
    }
}
