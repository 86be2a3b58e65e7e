//! What passes each line: a table of crossings, exceedance curves, quantiles of energy, height and speed.

use super::All;
use super::design::{self, Checked, Passing as Rocks, Reliability};
use super::picture::short;
use crate::base::Base;
use crate::summary::{SHARES, quantile};
use crate::track::place;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::{Measure, Worse};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::io;
use std::path::Path;
use toolkit::files::{self, Stream};
use toolkit::history::column;
use toolkit::summary::RunStatus;

/// Columns of the table of crossings, after member and number of the crossing.
const COLUMNS: &str = "time_s,along_m,x_m,y_m,z_m,centre_height_m,passing_height_m,speed_m_per_s,kinetic_energy_J,\
                       rotation_energy_J,vx_m_per_s,vy_m_per_s,vz_m_per_s";

/// The largest values of each member that passes: name, unit, which column.
const LARGEST: [(&str, &str, usize); 4] = [
    ("energy", "J", place::ENERGY),
    ("height", "m", place::HEIGHT),
    ("centre_height", "m", place::CENTRE),
    ("speed", "m/s", place::SPEED),
];

/// What passes one line.
struct Passing {
    table: csv::Writer<Stream>,
    /// Largest values of each member that passes.
    largest: [Vec<f64>; LARGEST.len()],
    /// Their masses [kg].
    masses: Vec<f64>,
}

/// Write tables and curves of all lines; add their measures.
pub fn write(base: &Base, dir: &Path, all: All, study: &Reliability, found: &mut Checked) -> io::Result<()> {
    let mut passing = Vec::new();
    for line in &base.study.lines {
        let mut table = csv::Writer::from_writer(files::create(&dir.join(format!("{}.csv", line.name)))?);
        table.write_record(["member", "crossing"].into_iter().chain(COLUMNS.split(',')))?;
        passing.push(Passing { table, largest: Default::default(), masses: Vec::new() });
    }
    let origin = [base.ground.origin.x, base.ground.origin.y, base.ground.origin.z];
    let mut computed = 0_u64;
    all(&mut |record| {
        if record.outcome.status == RunStatus::Failed {
            return Ok(());
        }
        computed += 1;
        for (number, passing) in passing.iter_mut().enumerate() {
            let mut most: Option<[f64; LARGEST.len()]> = None;
            let own = record.track.crossings.iter().filter(|crossing| usize::from(crossing.line) == number);
            for (count, crossing) in (1..).zip(own) {
                let mut values = crossing.values;
                (0..3).for_each(|axis| values[place::POSITION + axis] += origin[axis]);
                let cells = values.iter().map(|v| if v.is_nan() { String::new() } else { v.to_string() });
                let numbers = [record.number.to_string(), count.to_string()];
                passing.table.write_record(numbers.into_iter().chain(cells))?;
                let most = most.get_or_insert([f64::NEG_INFINITY; LARGEST.len()]);
                most.iter_mut().zip(LARGEST).for_each(|(most, (_, _, at))| *most = most.max(values[at]));
            }
            let Some(most) = most else { continue };
            passing.masses.push(record.outcome.mass);
            // Beside the terrain, or over a hole in it, a height is not known.
            let known = passing.largest.iter_mut().zip(most).filter(|(_, value)| value.is_finite());
            known.for_each(|(all, value)| all.push(value));
        }
        Ok(())
    })?;
    for (line, mut passing) in base.study.lines.iter().zip(passing) {
        passing.table.flush()?;
        let name = &line.name;
        let count = passing.largest[0].len();
        if computed == 0 {
            let what = format!("what passes the line `{name}` is not known: no member was computed");
            found.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
            continue;
        }
        let share = count as f64 / computed as f64;
        let mut report = |what: &str, value: f64, unit: &str| {
            let rank = RANKS.iter().find(|(ranked, _)| *ranked == what).map_or(Measure::ORDINARY, |r| r.1);
            let measure = Measure::new(format!("{name}_{what}"), value, unit);
            found.measures.push(measure.ranked(rank, Worse::Larger));
        };
        report("passing", count as f64, "1");
        report("passing_share", share, "1");
        if count == 0 {
            let what = format!("quantiles at the line `{name}` absent: none of {computed} rocks passes it");
            found.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, what));
            if line.design.is_some() {
                let what = format!(
                    "the barrier on the line `{name}` is not judged by its design: no rock passes it"
                );
                let cure = "is the line where rocks come, and end_time long enough?";
                found.warnings.push(Diagnostic::warning(code::FEW_SAMPLES, what).try_instead(cure));
            }
            continue;
        }
        for (values, (what, unit, _)) in passing.largest.iter_mut().zip(LARGEST) {
            values.sort_by(f64::total_cmp);
            let Some(most) = values.last().copied() else { continue };
            for share in SHARES {
                report(&format!("{what}_q{share}"), quantile(values, f64::from(share) / 100.0), unit);
            }
            report(&format!("{what}_largest"), most, unit);
        }
        if let Some(design) = &line.design {
            let [energy, _, height, speed] = &passing.largest;
            let path = dir.join(format!("{name}_design.csv"));
            passing.masses.sort_by(f64::total_cmp);
            let rocks = Rocks { energy, height, speed, mass: &passing.masses };
            let checked = design::write(&path, name, design, &rocks, study)?;
            found.measures.extend(checked.measures);
            found.sentences.extend(checked.sentences);
            found.warnings.extend(checked.warnings);
        }
        exceedance(&dir.join(format!("{name}_exceedance.csv")), &passing.largest, computed)?;
        let mut svg = String::new();
        curves(&mut svg, name, &passing.largest, share).map_err(|e| io::Error::other(e.to_string()))?;
        files::write(&dir.join(format!("{name}.svg")), svg.as_bytes())?;
    }
    Ok(())
}

/// Measures of a line that the screen shows first, with their ranks.
const RANKS: [(&str, u16); 4] =
    [("passing_share", 5), ("energy_q95", 10), ("energy_q99", 12), ("height_q95", 14)];

/// How often each value is reached or exceeded, of the members that pass and of all.
fn exceedance(path: &Path, largest: &[Vec<f64>; LARGEST.len()], computed: u64) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(files::create(path)?);
    let names = LARGEST.map(|(name, unit, _)| column(name, unit));
    table.write_record(["share_of_passing", "share_of_all"].map(String::from).into_iter().chain(names))?;
    let count = largest[0].len();
    for reached in 1..=count {
        let shares = [reached as f64 / count as f64, reached as f64 / computed as f64];
        // Of a quantity that is not known of all members there are fewer values.
        let value = |values: &Vec<f64>| values.len().checked_sub(reached).map(|at| values[at].to_string());
        let values = largest.iter().map(|values| value(values).unwrap_or_default());
        table.write_record(shares.map(|v| v.to_string()).into_iter().chain(values))?;
    }
    table.flush()
}

/// Exceedance of energy, passing height and speed.
fn curves(
    svg: &mut String,
    name: &str,
    largest: &[Vec<f64>; LARGEST.len()],
    share: f64,
) -> Result<(), Box<dyn std::error::Error>> {
    let page = SVGBackend::with_string(svg, (1080, 400)).into_drawing_area();
    page.fill(&WHITE)?;
    let share = 100.0 * share;
    let title =
        format!("Line {name}: {share:.1} % of all rocks pass; of these, the share that reaches or exceeds");
    let page = page.titled(&title, ("sans-serif", 18))?;
    let panels = page.split_evenly((1, 3));
    for (panel, (at, title)) in panels.iter().zip([
        (0, "kinetic energy, rotation included [kJ]"),
        (1, "height of the lowest point [m]"),
        (3, "speed [m/s]"),
    ]) {
        let values = &largest[at];
        if values.is_empty() {
            continue;
        }
        let scale = if at == 0 { 1e-3 } else { 1.0 };
        // With room for the words to the right of the largest one.
        let most = (values[values.len() - 1] * scale).max(1e-9) * 1.3;
        let least = (values[0] * scale).min(0.0);
        let mut chart = ChartBuilder::on(panel)
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(48)
            .build_cartesian_2d(least..most, 0.0..1.0)?;
        let number = |value: &f64| short(*value);
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(title).y_labels(6).x_labels(6).x_label_formatter(&number).y_label_formatter(&number);
        mesh.light_line_style(WHITE).draw()?;
        let count = values.len() as f64;
        let steps = values.iter().enumerate().flat_map(|(k, v)| {
            [(v * scale, 1.0 - k as f64 / count), (v * scale, 1.0 - (k + 1) as f64 / count)]
        });
        let all = std::iter::once((least, 1.0)).chain(steps);
        chart.draw_series(LineSeries::new(all, RGBColor(180, 40, 45).stroke_width(2)))?;
        for (share, height) in [(0.95, 0.26), (0.99, 0.16)] {
            let at = quantile(values, share) * scale;
            chart.draw_series(LineSeries::new([(at, 0.0), (at, height)], BLACK))?;
            let label = format!(" {:.0} %: {}", 100.0 * share, short(at));
            // To the right of its line, where the curve is below.
            let style = TextStyle::from(("sans-serif", 12)).pos(Pos::new(HPos::Left, VPos::Center));
            chart.draw_series(std::iter::once(Text::new(label, (at, height - 0.02), style)))?;
        }
    }
    page.present()?;
    Ok(())
}
