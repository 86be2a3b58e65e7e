//! What crossed between the programs of a run, by its recording: a row for each exchange, and a picture over time.

use interface_defs::diagnostic::Diagnostic;
use interface_defs::{Layout, Plan, Ready, Sampling, Status, name};
use plotters::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use toolkit::numbers::three;
use toolkit::recording::{Entry, Exchange, Reader};
use toolkit::{picture, provenance};

/// One exchange; what its solver neither takes nor gives is absent, and so is all of a window on selected nodes.
#[derive(Debug, Serialize)]
pub struct Crossed {
    exchange: usize,
    solver: String,
    window: u64,
    iteration: u32,
    start_s: f64,
    length_s: f64,
    command: u32,
    /// 1: the last of its window. 0: an iterate before that, a window that was tried again, or an examination of the solver.
    accepted: u8,
    status: &'static str,
    sent_numbers: usize,
    answer_numbers: usize,
    max_displacement_m: Option<f64>,
    max_velocity_m_per_s: Option<f64>,
    #[serde(rename = "force_x_N")]
    force_x: Option<f64>,
    #[serde(rename = "force_y_N")]
    force_y: Option<f64>,
    #[serde(rename = "force_z_N")]
    force_z: Option<f64>,
}

/// All exchanges of a recording, in their order.
pub struct Rows {
    recording: Reader,
    layouts: Vec<(String, [Layout; 2])>,
    count: usize,
    /// Number of the last exchange of each window of each solver.
    last: BTreeMap<(String, u64), usize>,
}

impl Rows {
    /// Those of the recording in this file, which is read twice: what is the last of a window is known behind it.
    pub fn open(file: &Path) -> Result<Self, Diagnostic> {
        let (mut recording, mut last, mut count) = (Reader::open(file)?, BTreeMap::new(), 0);
        while let Some(entry) = recording.next_entry()? {
            if let Entry::Exchange(exchange) = entry {
                count += 1;
                last.insert((exchange.solver, exchange.window.0), count);
            }
        }
        Ok(Self { recording: Reader::open(file)?, layouts: Vec::new(), count: 0, last })
    }

    fn next_row(&mut self) -> Result<Option<Crossed>, Diagnostic> {
        while let Some(entry) = self.recording.next_entry()? {
            match entry {
                Entry::Prepare(solver, both) => {
                    let (Plan { takes, gives, .. }, Ready { mesh, gauges, .. }) = &*both;
                    let layouts = [Layout::new(takes, mesh, 0), Layout::new(gives, mesh, gauges.len())];
                    self.layouts.push((solver, layouts));
                }
                Entry::Exchange(exchange) => {
                    self.count += 1;
                    let layouts = self.layouts.iter().find(|(of, _)| *of == exchange.solver);
                    let mut row = row(self.count, &exchange, layouts.map(|(_, both)| both));
                    let last = self.last.get(&(exchange.solver, exchange.window.0));
                    row.accepted = u8::from(last == Some(&self.count));
                    return Ok(Some(row));
                }
                _ => {}
            }
        }
        if self.recording.cut {
            tracing::warn!("the recording ends within an entry: its run was killed");
        }
        Ok(None)
    }
}

impl Iterator for Rows {
    type Item = Result<Crossed, Diagnostic>;
    fn next(&mut self) -> Option<Self::Item> {
        self.next_row().transpose()
    }
}

fn row(number: usize, exchange: &Exchange, layouts: Option<&[Layout; 2]>) -> Crossed {
    let Exchange { solver, window, command, span, status, sent, answer, .. } = exchange;
    // Of selected nodes the fields lie elsewhere.
    let known = layouts.filter(|_| exchange.selection.0 == 0);
    let of = |what: &str, sampling: Sampling| {
        let sides = known.into_iter().flatten().zip([sent, answer]);
        sides.filter_map(move |(layout, payload)| payload.get(layout.last(what, sampling)?)).next()
    };
    let largest = |what: &str| {
        let field = of(what, Sampling::FromStart).or_else(|| of(what, Sampling::AtEnds))?;
        let size = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        Some(field.chunks_exact(3).map(size).fold(0.0, f64::max))
    };
    let force = of(name::FORCE, Sampling::Means).or_else(|| of(name::FORCE, Sampling::AtEnds));
    let sum = |axis: usize| force.map(|f| f.iter().skip(axis).step_by(3).sum::<f64>());
    Crossed {
        exchange: number,
        solver: solver.clone(),
        window: window.0,
        iteration: window.1,
        start_s: span.0,
        length_s: span.1,
        command: *command,
        accepted: 0,
        status: match Status::from_number(*status) {
            Some(Status::Done) => "done",
            Some(Status::Failed) => "failed",
            Some(Status::Beyond) => "beyond",
            Some(Status::Rest) => "rest",
            None => "none",
        },
        sent_numbers: sent.len(),
        answer_numbers: answer.len(),
        max_displacement_m: largest(name::DISPLACEMENT),
        max_velocity_m_per_s: largest(name::VELOCITY),
        force_x: sum(0),
        force_y: sum(1),
        force_z: sum(2),
    }
}

const SIZE: [i32; 2] = [900, 720 + picture::FOOT];
const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(205, 205, 205);
const ACCEPTED: RGBColor = RGBColor(3, 83, 164);
const TRIED: RGBColor = RGBColor(181, 101, 29);
/// Points of a curve: twice the width of the picture in pixels.
const POINTS: usize = 1800;

/// Displacement, force and iterations over time, as they crossed: each iterate as a dot, and a line through the last ones.
#[derive(Default)]
pub struct Picture {
    /// Time, value; of the first solver that gives or takes both.
    curves: [Vec<(f64, f64)>; 2],
    tried: [Vec<(f64, f64)>; 2],
    iterations: Vec<(f64, f64)>,
    solver: String,
}

impl Picture {
    pub fn add(&mut self, row: &Crossed) {
        let force = row.force_x.zip(row.force_y).zip(row.force_z);
        let (Some(u), Some(((x, y), z))) = (row.max_displacement_m, force) else { return };
        if self.solver.is_empty() {
            self.solver.clone_from(&row.solver);
        }
        if row.solver != self.solver || row.status != "done" && row.status != "rest" {
            return;
        }
        let time = row.start_s + row.length_s;
        let values = [u, (x * x + y * y + z * z).sqrt() / 1000.0];
        let to = if row.accepted == 1 { &mut self.curves } else { &mut self.tried };
        to.iter_mut().zip(values).for_each(|(curve, value)| curve.push((time, value)));
        if row.accepted == 1 {
            self.iterations.push((time, f64::from(row.iteration.max(1))));
        }
    }

    /// As SVG. `None`: nothing crossed that could be drawn.
    pub fn draw(&self, title: &str) -> Option<String> {
        let end = self.iterations.last()?.0;
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, SIZE.map(|length| length as u32).into());
            let root = root.into_drawing_area();
            root.fill(&WHITE).ok()?;
            self.page(&root.margin(0, picture::FOOT, 0, 0), title, end).and_then(|()| root.present()).ok()?;
        }
        picture::close(&mut text, SIZE, 1, &[Some(&provenance::now())]);
        Some(text)
    }

    fn page(
        &self,
        root: &DrawingArea<SVGBackend, plotters::coord::Shift>,
        title: &str,
        end: f64,
    ) -> Result<(), DrawingAreaErrorKind<io::Error>> {
        let font = |size: i32| ("sans-serif", size).into_font().color(&INK);
        let panels = root.titled(title, font(18))?.split_evenly((3, 1));
        let [u, force] = &self.curves;
        let of = [(u, &self.tried[0][..]), (force, &self.tried[1][..]), (&self.iterations, &[][..])];
        let names = ["largest displacement [m]", "resultant force [kN]", "iterations"];
        for ((panel, (curve, tried)), name) in panels.iter().zip(of).zip(names) {
            // By what was accepted: examinations push harder than anything in the run.
            let most = curve.iter().fold(0.0, |most: f64, (_, value)| most.max(*value));
            let most = if most > 0.0 { 1.2 * most } else { 1.0 };
            let whole = curve.iter().all(|(_, value)| value.fract() == 0.0);
            let mut chart = ChartBuilder::on(panel)
                .margin(8)
                .margin_right(20)
                .x_label_area_size(34)
                .y_label_area_size(74)
                .build_cartesian_2d(0.0..end, 0.0..most)?;
            chart
                .configure_mesh()
                .bold_line_style(GRID)
                .light_line_style(TRANSPARENT)
                .label_style(font(12))
                .axis_desc_style(font(13))
                .x_desc("time [s]")
                .y_desc(name)
                .y_label_formatter(&|value| {
                    if whole && value.fract() != 0.0 { String::new() } else { three(*value) }
                })
                .draw()?;
            let dot = |place: &(f64, f64)| Circle::new(*place, 2, TRIED.mix(0.5).filled());
            let shown = tried.iter().step_by(tried.len() / POINTS + 1).filter(|(_, value)| *value <= most);
            chart.draw_series(shown.map(dot))?;
            chart.draw_series(LineSeries::new(extremes(curve), ACCEPTED.stroke_width(2)))?;
        }
        Ok(())
    }
}

/// The curve by its smallest and its largest value in each of so many parts.
fn extremes(curve: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    let part = 2 * (curve.len() / POINTS + 1);
    if part == 2 {
        return curve.to_vec();
    }
    let ends = curve.chunks(part).filter_map(|part| {
        let (low, high) = (part.iter().min_by(by_value)?, part.iter().max_by(by_value)?);
        Some(if low.0 <= high.0 { [*low, *high] } else { [*high, *low] })
    });
    ends.flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::extremes;

    #[test]
    fn a_long_curve_keeps_its_peak() {
        let mut curve: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        curve[54_321].1 = 1.0;
        let drawn = extremes(&curve);
        assert!(drawn.len() < 4000 && drawn.contains(&(54_321.0, 1.0)), "{}", drawn.len());
        assert!(drawn.is_sorted_by(|a, b| a.0 <= b.0));
    }
}
