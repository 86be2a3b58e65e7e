//! What passes each line: a table of crossings, exceedance curves, quantiles of energy, height and speed, each with its interval.

use super::design::{self, Checked, Passing as Rocks, Reliability};
use super::frequency::{PERIODS, Source, of_period, reaching, value_of};
use crate::base::Base;
use crate::bounds::{Part, of_frequency, of_quantile, of_share, quantile};
use crate::capacity::{Capacity, FATES};
use crate::record::All;
use crate::settings::ScreenLine;
use crate::summary::{SHARES, quantile_of};
use crate::track::Crossing;
use dem_rocks::results::map::sheet::{Axes, FINE, INK, LEFT, RIGHT, font, page, plot, px};
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

/// A statistic of what passes a line: of each member that passes its largest value.
struct Statistic {
    name: &'static str,
    unit: &'static str,
    of: fn(&Crossing) -> f64,
    /// Title of its curve, and what its values are multiplied by there.
    curve: Option<(&'static str, f64)>,
}

/// All of them. A new one takes a line here.
const STATISTICS: [Statistic; 4] = [
    statistic("energy", "J", |it| it.energy, Some(("kinetic energy, rotation included [kJ]", 1e-3))),
    statistic("height", "m", |it| it.height, Some(("height of the lowest point [m]", 1.0))),
    statistic("centre_height", "m", |it| it.centre, None),
    statistic("speed", "m/s", |it| it.speed, Some(("speed [m/s]", 1.0))),
];

const fn statistic(
    name: &'static str,
    unit: &'static str,
    of: fn(&Crossing) -> f64,
    curve: Option<(&'static str, f64)>,
) -> Statistic {
    Statistic { name, unit, of, curve }
}

/// Measures of a line that the screen shows first, with their ranks.
const RANKS: [(&str, u16); 7] = [
    (SHARE, 5),
    (FREQUENCY, 6),
    ("energy_100_years", 8),
    ("height_100_years", 9),
    ("energy_q95", 10),
    ("energy_q99", 12),
    ("height_q95", 14),
];

/// The table of crossings: of a member, the number of the crossing, and the crossing.
fn columns(base: &Base) -> Columns<'_, (u64, u64, Crossing)> {
    let origin = base.ground.origin;
    Columns::new()
        .with("member", |(member, ..): &(u64, u64, Crossing)| member.to_string())
        .with("crossing", |(_, number, _)| number.to_string())
        .numbers(["time_s", "along_m"], |(.., it)| Some([it.time, it.along]))
        .numbers(["x_m", "y_m", "z_m"], move |(.., it)| Some([0, 1, 2].map(|k| it.position[k] + origin[k])))
        // Beside the terrain, or over a hole in it, a height is not known.
        .number("centre_height_m", |(.., it)| Some(it.centre).filter(|height| !height.is_nan()))
        .number("passing_height_m", |(.., it)| Some(it.height).filter(|height| !height.is_nan()))
        .numbers(["speed_m_per_s", "kinetic_energy_J", "rotation_energy_J"], |(.., it)| {
            Some([it.speed, it.energy, it.rotation])
        })
        .numbers(["vx_m_per_s", "vy_m_per_s", "vz_m_per_s"], |(.., it)| Some(it.velocity))
}

/// What passes one line.
#[derive(Default)]
struct Passing {
    /// Largest values of each member that passes, in ascending order.
    largest: [Vec<f64>; STATISTICS.len()],
    /// Their masses [kg], likewise.
    masses: Vec<f64>,
    /// The largest values by release, where blocks a year are known.
    of_release: Vec<[Vec<f64>; STATISTICS.len()]>,
    /// How many members of each release the barrier stops and not, where there is one.
    fates: Vec<[u64; FATES.len()]>,
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
        let parts = self.rates.as_ref()?.iter().zip(&self.computed).zip(counts);
        Some(of_frequency(parts.map(|((rate, all), count)| Part {
            per_year: *rate,
            count: *count,
            all: *all,
        })))
    }
}

/// Called with every crossing: number of its line, of its member, of the crossing.
type Each<'a> = &'a mut dyn FnMut(usize, &(u64, u64, Crossing)) -> io::Result<()>;

/// What passes each line, and how many members were computed.
fn gather(base: &Base, all: All, each: Each) -> io::Result<(Vec<Passing>, Releases)> {
    let mut rates = base.study.rates();
    let count = base.study.releases.len();
    let by_release = || vec![Default::default(); if rates.is_some() { count } else { 0 }];
    let mut passing: Vec<Passing> =
        base.lines.iter().map(|_| Passing { of_release: by_release(), ..Passing::default() }).collect();
    let mut computed = vec![0_u64; count];
    all(&mut |record| {
        if record.outcome.status == RunStatus::Failed {
            return Ok(());
        }
        let release = base.release_of(record.number);
        computed[release] += 1;
        for (number, passing) in passing.iter_mut().enumerate() {
            let mut most: Option<[f64; STATISTICS.len()]> = None;
            let own = record.track.crossings.iter().filter(|crossing| usize::from(crossing.line) == number);
            for (count, crossing) in (1..).zip(own) {
                each(number, &(record.number, count, *crossing))?;
                let most = most.get_or_insert([f64::NEG_INFINITY; STATISTICS.len()]);
                most.iter_mut().zip(&STATISTICS).for_each(|(most, it)| *most = most.max((it.of)(crossing)));
            }
            let Some(most) = most else { continue };
            let mut own =
                record.track.crossings.iter().filter(|crossing| usize::from(crossing.line) == number);
            if let Some((barrier, first)) = base.study.lines[number].barrier.zip(own.next()) {
                passing.fates.resize(count, [0; FATES.len()]);
                passing.fates[release][barrier.fate(first)] += 1;
            }
            passing.masses.push(record.outcome.mass);
            for all in [Some(&mut passing.largest), passing.of_release.get_mut(release)].into_iter().flatten()
            {
                let known = all.iter_mut().zip(most).filter(|(_, value)| value.is_finite());
                known.for_each(|(all, value)| all.push(value));
            }
        }
        Ok(())
    })?;
    let sort = |values: &mut Vec<f64>| values.sort_by(f64::total_cmp);
    for Passing { largest, masses, of_release, .. } in &mut passing {
        largest.iter_mut().chain(of_release.iter_mut().flatten()).chain([masses]).for_each(sort);
    }
    // Of a release without a member nothing is known.
    rates = rates.filter(|_| !computed.contains(&0));
    Ok((passing, Releases { computed, rates }))
}

/// Share of the members that passes.
const SHARE: &str = "passing_share";
/// Rocks that do not come to a barrier.
const NOT_REACHED: &str = "not_reached";
/// What a barrier does not stop, and its rank on the screen.
const BEHIND: &str = "behind_barrier";
const RANK_BEHIND: u16 = 7;
/// Blocks a year that pass.
const FREQUENCY: &str = "frequency";

impl Passing {
    /// What comes from each release of one of the [`STATISTICS`]; nothing where blocks a year are not known.
    fn sources(&self, statistic: usize, releases: &Releases) -> Vec<Source<'_>> {
        let known = releases.rates.iter().flatten().zip(&releases.computed).zip(&self.of_release);
        known
            .map(|((rate, computed), all)| Source {
                per_year: *rate,
                computed: *computed,
                values: &all[statistic],
            })
            .collect()
    }

    /// Its measures, at the line `name`; and which values of return periods are absent, with why.
    fn measures(&self, name: &str, releases: &Releases) -> (Vec<Measure>, Vec<(String, &'static str)>) {
        let (mut all, mut absent, computed) = (Vec::new(), Vec::new(), releases.computed());
        let mut report = |what: &str, value: f64, unit: &str, interval: Option<Interval>| {
            let rank = RANKS.iter().find(|(ranked, _)| *ranked == what).map_or(Measure::ORDINARY, |r| r.1);
            let measure = Measure::new(format!("{name}_{what}"), value, unit).ranked(rank, Worse::Larger);
            all.push(Measure { interval, ..measure });
        };
        let count = self.masses.len() as u64;
        report("passing", count as f64, "1", None);
        report(SHARE, count as f64 / computed as f64, "1", Some(of_share(count, computed)));
        let counts: Vec<u64> = self.of_release.iter().map(|all| all[0].len() as u64).collect();
        if let Some((often, interval)) = releases.frequency(&counts) {
            report(FREQUENCY, often, "1/year", Some(interval));
        }
        for (at, (values, Statistic { name, unit, .. })) in self.largest.iter().zip(&STATISTICS).enumerate() {
            let Some(most) = values.last() else { continue };
            for percent in SHARES {
                let share = f64::from(percent) / 100.0;
                let interval = Some(of_quantile(values, share));
                report(&quantile_of(name, percent), quantile(values, share), unit, interval);
            }
            report(&format!("{name}_largest"), *most, unit, None);
            let sources = self.sources(at, releases);
            for years in PERIODS.into_iter().filter(|_| !sources.is_empty()) {
                match of_period(&sources, values, f64::from(years)) {
                    Ok((value, interval)) => report(&value_of(name, years), value, unit, Some(interval)),
                    Err(why) => absent.push((value_of(name, years), why)),
                }
            }
        }
        (all, absent)
    }

    /// Share, and where it is known frequency, of what a barrier at the line `name` does; and a sentence that says so.
    fn behind(&self, name: &str, barrier: &Capacity, releases: &Releases) -> (Vec<Measure>, String) {
        let fates = |of: &dyn Fn(&[u64; FATES.len()]) -> u64| -> Vec<u64> {
            let none = [0; FATES.len()];
            (0..releases.computed.len()).map(|at| of(self.fates.get(at).unwrap_or(&none))).collect()
        };
        let reached = fates(&|all| all.iter().sum());
        let not_reached =
            releases.computed.iter().zip(&reached).map(|(all, reached)| all - reached).collect();
        let stopped = FATES.iter().enumerate().map(|(at, fate)| (*fate, fates(&|all| all[at])));
        let all = std::iter::once((NOT_REACHED, not_reached)).chain(stopped);
        let all = all.chain([(BEHIND, fates(&|all| all[1] + all[2]))]);
        let (mut measures, mut said) = (Vec::new(), Vec::new());
        for (fate, counts) in all {
            let (count, computed) = (counts.iter().sum::<u64>(), releases.computed());
            let mut report = |what: &str, value: f64, unit: &str, interval: Interval| {
                let rank = if fate == BEHIND { RANK_BEHIND } else { Measure::ORDINARY };
                let worse = if fate == BEHIND { Worse::Larger } else { Worse::Neither };
                let measure = Measure::new(format!("{name}_{fate}_{what}"), value, unit).ranked(rank, worse);
                measures.push(Measure { interval: Some(interval), ..measure });
            };
            let (share, interval) = (count as f64 / computed as f64, of_share(count, computed));
            report("share", share, "1", interval);
            let often = releases.frequency(&counts);
            if let Some((often, interval)) = often {
                report(FREQUENCY, often, "1/year", interval);
            }
            let often = often.map_or(String::new(), |(often, _)| format!(" ({} a year)", three(often)));
            said.push(format!("{} {} %{often}", fate.replace('_', " "), three(100.0 * share)));
        }
        let (energy, height) = (three(1e-3 * barrier.energy), three(barrier.height));
        let said = said.join(", ");
        (
            measures,
            format!("barrier of {energy} kJ and {height} m at the line `{name}`, of all rocks: {said}"),
        )
    }
}

/// Names of all measures of lines that have an interval.
pub fn bounded(base: &Base) -> impl Iterator<Item = String> {
    let is_rated = base.study.rates().is_some();
    base.study.lines.iter().flat_map(move |line| {
        let quantiles = STATISTICS.iter().flat_map(|it| SHARES.map(|share| quantile_of(it.name, share)));
        let of_periods = STATISTICS.iter().flat_map(|it| PERIODS.map(|years| value_of(it.name, years)));
        let frequencies = std::iter::once(FREQUENCY.to_owned()).chain(of_periods).filter(move |_| is_rated);
        let at_barrier = [NOT_REACHED, BEHIND].into_iter().chain(FATES).filter(|_| line.barrier.is_some());
        let at_barrier = at_barrier.flat_map(move |fate| {
            let frequency = is_rated.then(|| format!("{fate}_{FREQUENCY}"));
            [Some(format!("{fate}_share")), frequency].into_iter().flatten()
        });
        let all = std::iter::once(SHARE.to_owned()).chain(quantiles).chain(frequencies).chain(at_barrier);
        all.map(|what| format!("{}_{what}", line.name))
    })
}

/// The measures of all lines; nothing is written.
pub fn measures(base: &Base, all: All) -> io::Result<Vec<Measure>> {
    let (passing, releases) = gather(base, all, &mut |_, _| Ok(()))?;
    let lines = base.study.lines.iter().zip(&passing).filter(|_| releases.computed() > 0);
    let of = |(line, passing): (&ScreenLine, &Passing)| {
        let barrier = line.barrier.map(|barrier| passing.behind(&line.name, &barrier, &releases).0);
        [passing.measures(&line.name, &releases).0, barrier.unwrap_or_default()].concat()
    };
    Ok(lines.flat_map(of).collect())
}

/// Write tables and curves of all lines; add their measures.
pub fn write(base: &Base, dir: &Path, all: All, study: &Reliability, found: &mut Checked) -> io::Result<()> {
    let (mut tables, columns) = (Vec::new(), columns(base));
    for line in &base.study.lines {
        let mut table = csv::Writer::from_writer(files::create(&dir.join(format!("{}.csv", line.name)))?);
        table.write_record(columns.names())?;
        tables.push(table);
    }
    let (passing, releases) =
        gather(base, all, &mut |line, row| Ok(tables[line].write_record(columns.row(row))?))?;
    let computed = releases.computed();
    tables.iter_mut().try_for_each(|table| table.flush())?;
    if let Some(without) =
        releases.computed.iter().position(|n| *n == 0).filter(|_| base.study.rates().is_some())
    {
        let release = &base.study.releases[without].name;
        let what = format!("frequencies at lines absent: no member of the release `{release}` was computed");
        found.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
    }
    for (line, passing) in base.study.lines.iter().zip(passing) {
        let name = &line.name;
        let mut warn = |code, what: String| found.warnings.push(Diagnostic::warning(code, what));
        if computed == 0 {
            let what = format!("what passes the line `{name}` is not known: no member was computed");
            warn(code::ABSENT_MEASURE, what);
            continue;
        }
        let (measures, absent) = passing.measures(name, &releases);
        found.measures.extend(measures);
        found.sentences.extend(said_of(name, &absent));
        if let Some(barrier) = &line.barrier {
            let (measures, sentence) = passing.behind(name, barrier, &releases);
            found.measures.extend(measures);
            found.sentences.push(sentence);
        }
        if passing.masses.is_empty() {
            let what = format!("quantiles at the line `{name}` absent: none of {computed} rocks passes it");
            warn(code::ABSENT_MEASURE, what);
            if line.design.is_some() {
                let what = format!(
                    "the barrier on the line `{name}` is not judged by its design: no rock passes it"
                );
                let cure = "is the line where rocks come, and end_time long enough?";
                found.warnings.push(Diagnostic::warning(code::FEW_SAMPLES, what).try_instead(cure));
            }
            continue;
        }
        if let Some(design) = &line.design {
            let [energy, _, height, speed, ..] = &passing.largest;
            let path = dir.join(format!("{name}_design.csv"));
            let rocks = Rocks { energy, height, speed, mass: &passing.masses };
            design::write(&path, name, design, &rocks, study, found)?;
        }
        exceedance(&dir.join(format!("{name}_exceedance.csv")), &passing, &releases)?;
        let svg = curves(name, &passing.largest, computed).map_err(io::Error::other)?;
        files::write(&dir.join(format!("{name}.svg")), svg.as_bytes())?;
    }
    Ok(())
}

/// Shares of an exceedance curve, each with its interval.
const EXCEEDED: [&str; 6] = [
    "share_of_passing",
    "share_of_passing_low",
    "share_of_passing_high",
    "share_of_all",
    "share_of_all_low",
    "share_of_all_high",
];

/// Which values of return periods are not known at the line `name`, by the reason.
fn said_of(name: &str, absent: &[(String, &'static str)]) -> Vec<String> {
    let mut said: Vec<(&str, String)> = Vec::new();
    for (what, why) in absent {
        match said.iter_mut().find(|(known, _)| known == why) {
            Some((_, all)) => *all += &format!(", {what}"),
            None => said.push((why, what.clone())),
        }
    }
    said.into_iter().map(|(why, all)| format!("absent at the line `{name}`: {all}: {why}")).collect()
}

/// How often each value is reached or exceeded, of the members that pass and of all; with blocks a year also how often in a year.
fn exceedance(path: &Path, passing: &Passing, releases: &Releases) -> io::Result<()> {
    let (largest, computed) = (&passing.largest, releases.computed());
    let mut table = csv::Writer::from_writer(files::create(path)?);
    let names = STATISTICS.iter().map(|it| column(it.name, it.unit));
    let sources: [Vec<Source>; STATISTICS.len()] = std::array::from_fn(|at| passing.sources(at, releases));
    let rated = STATISTICS.iter().zip(&sources).filter(|(_, sources)| !sources.is_empty());
    let frequencies = rated.flat_map(|(it, _)| {
        let often = format!("{}_{FREQUENCY}_per_year", it.name);
        let period = format!("{}_return_period_years", it.name);
        ["", "_low", "_high"].map(|end| format!("{often}{end}")).into_iter().chain([period])
    });
    table.write_record(EXCEEDED.map(String::from).into_iter().chain(names).chain(frequencies))?;
    let count = largest[0].len();
    for reached in 1..=count {
        let shares = [count as u64, computed].map(|all| {
            let of = of_share(reached as u64, all);
            [Some(reached as f64 / all as f64), of.low, of.high]
        });
        let text = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let shares = shares.into_iter().flatten().map(text);
        // Of a quantity that is not known of all members there are fewer values.
        let value = |values: &Vec<f64>| values.len().checked_sub(reached).map(|at| values[at]);
        let values = largest.iter().map(|values| text(value(values)));
        let rated = largest.iter().zip(&sources).filter(|(_, sources)| !sources.is_empty());
        let frequencies = rated.flat_map(|(values, sources)| {
            let of = value(values).map(|value| reaching(sources, value));
            let often = of.map(|(often, _)| often);
            let [low, high] = [of.and_then(|(_, it)| it.low), of.and_then(|(_, it)| it.high)];
            [often, low, high, often.map(f64::recip)].map(text)
        });
        table.write_record(shares.chain(values).chain(frequencies))?;
    }
    table.flush()
}

/// Width of a curve's panel, height of the page and of its title [px].
const PANEL: i32 = 380;
const HEIGHT: i32 = 400;
const TITLE: i32 = 36;
const CURVE: RGBColor = RGBColor(180, 40, 45);

/// Exceedance of energy, passing height and speed, each share with its interval as a band.
fn curves(name: &str, largest: &[Vec<f64>; STATISTICS.len()], computed: u64) -> Result<String, String> {
    let drawn = largest.iter().zip(&STATISTICS).filter(|(values, _)| !values.is_empty());
    let drawn: Vec<_> = drawn.filter_map(|(values, it)| Some((values, it.curve?))).collect();
    let count = largest[0].len() as u64;
    let of = of_share(count, computed);
    let [share, low, high] = [Some(count as f64 / computed as f64), of.low, of.high]
        .map(|share| format!("{:.1}", 100.0 * share.unwrap_or(f64::NAN)));
    let title = format!(
        "Line {name}: {share} % [{low}, {high}] of all rocks pass; of these {count}, the share that reaches or exceeds (band: 95 % interval)"
    );
    page([PANEL * drawn.len() as i32, HEIGHT], "", |root| {
        let (head, rest) = root.split_vertically(TITLE * FINE);
        head.draw(&Text::new(title, (px(f64::from(LEFT)), px(10.0)), font(17.0)))?;
        for (panel, (values, (title, scale))) in rest.split_evenly((1, drawn.len())).iter().zip(drawn) {
            // With room for the words to the right of the largest one.
            let most = (values[values.len() - 1] * scale).max(1e-9) * 1.9;
            let least = (values[0] * scale).min(0.0);
            let room = [12, RIGHT, 42, LEFT];
            let axes =
                Axes { room, titles: [title, "share of those that pass"], numbers: [6, 6], grid: true };
            let chart = plot(panel, [[least, 0.0], [most, 1.0]], &axes)?;
            let plot = chart.plotting_area();
            let count = values.len();
            // A step down at each value, from where as many as `of` says reach it.
            let stairs = |of: &dyn Fn(u64) -> f64| -> Vec<(f64, f64)> {
                let steps = values.iter().enumerate().flat_map(|(k, v)| {
                    [count - k, count - k - 1].map(|reached| (v * scale, of(reached as u64)))
                });
                std::iter::once((least, of(count as u64))).chain(steps).collect()
            };
            let interval = |reached| of_share(reached, count as u64);
            let mut band = stairs(&|reached| interval(reached).low.unwrap_or(0.0));
            band.extend(stairs(&|reached| interval(reached).high.unwrap_or(1.0)).into_iter().rev());
            plot.draw(&Polygon::new(band, CURVE.mix(0.18).filled()))?;
            let all = stairs(&|reached| reached as f64 / count as f64);
            plot.draw(&PathElement::new(all, CURVE.stroke_width(px(1.5) as u32)))?;
            for (share, height) in [(0.95, 0.26), (0.99, 0.16)] {
                let at = quantile(values, share) * scale;
                let of = of_quantile(values, share);
                let end = |end: Option<f64>| end.map_or("too few".into(), |end| three(end * scale));
                let (low, high) = (end(of.low), end(of.high));
                plot.draw(&PathElement::new(
                    vec![(at, 0.0), (at, height)],
                    INK.stroke_width(px(1.0) as u32),
                ))?;
                let label = format!(" {:.0} %: {} [{low}, {high}]", 100.0 * share, three(at));
                // To the right of its line, where the curve is below.
                let style = font(12.0).pos(Pos::new(HPos::Left, VPos::Center));
                plot.draw(&Text::new(label, (at, height - 0.02), style))?;
            }
        }
        Ok(())
    })
}
