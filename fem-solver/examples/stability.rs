//! Draws `docs/stability.svg`: paths of equilibrium of the literature on stability, and what they are compared with.
//!
//! ```text
//! cargo run --release -p fem-solver --example stability -- docs/stability.svg
//! ```
//!
//! Lines: computed, solid where stable, thin where not. Dots: rods by shooting, Euler's elastica, the theory of the shallow
//! arch; at the panels the limits of the literature. `tests/structure/paths.rs` holds all of it.

#[allow(dead_code)]
#[path = "../tests/structure/common.rs"]
mod common;
#[path = "../tests/structure/curves.rs"]
mod curves;
#[path = "../tests/structure/elastica.rs"]
mod elastica;

use curves::{ARCH, Frame, Point, arch, column, follow, lee, panel, toggle, turning};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::error::Error;
use std::f64::consts::PI;

/// One diagram: its name, what stands along its axes, its curves, and its dots.
struct Diagram {
    name: &'static str,
    axes: [&'static str; 2],
    curves: Vec<Vec<(f64, f64, bool)>>,
    dots: Vec<(f64, f64)>,
}

/// Displacement downwards in units of `length` and load in units of `unit`, and whether it is stable.
fn curve(points: &[Point], component: usize, length: f64, unit: f64) -> Vec<(f64, f64, bool)> {
    let at_rest = std::iter::once((0.0, 0.0, true));
    at_rest
        .chain(points.iter().map(|p| (p.moved[component] / length, p.load / unit, p.negative == 0.0)))
        .collect()
}

/// The loads of the frame's rod at every so many points of a curve.
fn rod(frame: &Frame, points: &[Point], every: usize, length: f64, unit: f64) -> Vec<(f64, f64)> {
    let mut rod = elastica::Rod::new(frame);
    let loads: Vec<_> =
        points.iter().map(|p| (p.moved[2] / length, rod.follow([p.moved[0], p.moved[2]]).0 / unit)).collect();
    loads.into_iter().skip(every - 1).step_by(every).collect()
}

fn lees_frame() -> Diagram {
    let frame = lee(8);
    let points = follow(&frame.text(1.0), 0.01, 184).1;
    Diagram {
        name: "Lee's frame",
        axes: ["vertical displacement of the load [m]", "load [kN]"],
        dots: rod(&frame, &points, 8, -1.0, 1e3),
        curves: vec![curve(&points, 2, -1.0, 1e3)],
    }
}

fn williams_toggle() -> Diagram {
    let frame = toggle(16);
    let points = follow(&frame.text(1.0), 0.01, 70).1;
    Diagram {
        name: "Williams' toggle",
        axes: ["displacement of the apex [in]", "load [lb]"],
        dots: rod(&frame, &points, 4, -1.0, 1.0),
        curves: vec![curve(&points, 2, -1.0, 1.0)],
    }
}

fn columns() -> Diagram {
    let bowed = column(32, 0.004);
    let of_bow = follow(&bowed.text(1.0), 0.01, 120).1;
    let straight = column(32, 0.0).text(1.0);
    let on = follow(&straight, 0.0005, 40).1;
    let turned = follow(&turning(&straight), 0.01, 120).1;
    let mut curves = vec![curve(&of_bow, 2, -4.0, 1.0), curve(&turned, 2, -4.0, 1.0)];
    curves.push(curve(&on, 2, -4.0, 1.0).into_iter().filter(|(_, load, _)| *load < 1.35).collect());
    Diagram {
        name: "Euler's column, straight and with a bow of L/1000",
        axes: ["shortening / L", "load / Euler's"],
        dots: rod(&bowed, &of_bow, 6, -4.0, 1.0),
        curves,
    }
}

fn shallow_arch() -> Diagram {
    let [half, rise, bending, slender] = ARCH;
    let k = bending * (PI / (2.0 * half)).powi(4);
    let symmetric =
        |a: f64| k * (rise - a) + k * (slender * slender - (a * slender / rise).powi(2)) / 4.0 * a;
    let text = arch(32).text(1.0);
    let branch_at = rise * (1.0 - 16.0 / (slender * slender)).sqrt();
    let places = |count: usize, from: f64, to: f64| {
        (1..count).map(move |i| from + (to - from) * i as f64 / count as f64)
    };
    let mut dots: Vec<_> = places(28, rise, -1.15 * rise).map(|a| (rise - a, symmetric(a) / 1e3)).collect();
    dots.extend(places(10, branch_at, -branch_at).map(|a| (rise - a, k * (rise + 3.0 * a) / 1e3)));
    Diagram {
        name: "Shallow arch with a branch",
        axes: ["displacement of the crown [m]", "load [kN/m]"],
        curves: vec![
            curve(&follow(&text, 0.0025, 86).1, 2, -1.0, 1e3),
            curve(&follow(&turning(&text), 0.0025, 100).1, 2, -1.0, 1e3),
        ],
        dots,
    }
}

fn hinged_panel(name: &'static str, thickness: f64, ways: usize, dots: Vec<(f64, f64)>) -> Diagram {
    let of = |cells: usize| {
        let points = follow(&panel(cells, thickness, 1.0), 0.5, ways).1;
        curve(&points, 2, -1.0, 1e3)
    };
    Diagram { name, axes: ["displacement of the load [mm]", "load [kN]"], curves: vec![of(8), of(16)], dots }
}

/// From the smallest to the largest number, and a little more on both sides.
fn span(numbers: impl Iterator<Item = f64> + Clone) -> std::ops::Range<f64> {
    let low = numbers.clone().fold(f64::INFINITY, f64::min);
    let high = numbers.fold(f64::NEG_INFINITY, f64::max);
    low - 0.04 * (high - low)..high + 0.06 * (high - low)
}

fn draw<B: DrawingBackend>(on: &DrawingArea<B, Shift>, diagram: &Diagram) -> Result<(), Box<dyn Error>>
where
    B::ErrorType: 'static,
{
    let all = diagram.curves.iter().flatten();
    let (x, y) = (span(all.clone().map(|p| p.0)), span(all.map(|p| p.1)));
    let mut chart = ChartBuilder::on(on)
        .caption(diagram.name, ("sans-serif", 17))
        .margin(10)
        .x_label_area_size(38)
        .y_label_area_size(52)
        .build_cartesian_2d(x, y)?;
    let grid = RGBColor(225, 225, 225);
    chart
        .configure_mesh()
        .x_desc(diagram.axes[0])
        .y_desc(diagram.axes[1])
        .label_style(("sans-serif", 13))
        .bold_line_style(grid)
        .light_line_style(TRANSPARENT)
        .draw()?;
    let colours = [RGBColor(20, 80, 160), RGBColor(190, 90, 20), RGBColor(90, 90, 90)];
    for (points, colour) in diagram.curves.iter().zip(colours) {
        for pair in points.windows(2) {
            let width = if pair[1].2 { 3 } else { 1 };
            let ends = pair.iter().map(|p| (p.0, p.1));
            chart.draw_series(LineSeries::new(ends, colour.stroke_width(width)))?;
        }
    }
    chart.draw_series(diagram.dots.iter().map(|dot| Circle::new(*dot, 3, BLACK.stroke_width(1))))?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).unwrap_or_else(|| "docs/stability.svg".into());
    let diagrams = [
        lees_frame(),
        williams_toggle(),
        columns(),
        shallow_arch(),
        hinged_panel("Hinged panel, 12.7 mm", 12.7, 56, vec![(10.7, 2.2)]),
        hinged_panel("Hinged panel, 6.35 mm", 6.35, 104, vec![(13.2, 0.585), (16.2, -0.377)]),
    ];
    let root = SVGBackend::new(&file, (1000, 1080)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, diagram) in root.split_evenly((3, 2)).iter().zip(&diagrams) {
        draw(area, diagram)?;
    }
    root.present()?;
    println!("{file}");
    Ok(())
}
