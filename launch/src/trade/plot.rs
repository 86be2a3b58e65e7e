//! Error over cost, both in decades, as SVG: a mark for each run, the front as a line.

use super::front::Trade;
use super::report::{percent, seconds};
use super::study::ACCURACIES;
use plotters::prelude::*;

/// What is drawn.
pub struct Picture {
    /// Above it.
    pub title: String,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// All runs that have an error, each with its group: the first is the scene's own arm.
    pub marks: Vec<(Trade, usize)>,
    /// The front, the cheapest first, with what to write beside it.
    pub front: Vec<(Trade, String)>,
}

const SIZE: (u32, u32) = (900, 620);
/// Height of a line of text below the plot [px].
const LINE: u32 = 17;
const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(205, 205, 205);
const COLOURS: [RGBColor; 6] = [
    RGBColor(3, 83, 164),
    RGBColor(193, 18, 31),
    RGBColor(0, 121, 107),
    RGBColor(123, 44, 191),
    RGBColor(181, 101, 29),
    RGBColor(90, 90, 90),
];
/// Errors below are drawn there: the plot has no room for less.
const LEAST: f64 = 1e-7;

/// The picture as SVG; there is one mark at least.
pub fn draw(picture: &Picture) -> Result<String, String> {
    let mut text = String::new();
    {
        let size = (SIZE.0, SIZE.1 + LINE * picture.front.len() as u32 + 10);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        page(&root, picture).and_then(|()| root.present()).map_err(|e| e.to_string())?;
    }
    Ok(text)
}

type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn font(size: i32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

/// From a bit below the least to a bit above the largest.
fn extent(values: impl Iterator<Item = f64>, room: f64) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    low / room..high * room
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// The plot, and below it what the numbers at the front mean.
fn page(root: &Area, picture: &Picture) -> Drawn {
    root.fill(&WHITE)?;
    let (plot, words) = root.split_vertically(SIZE.1);
    chart(&plot, picture)?;
    for (line, (trade, settings)) in picture.front.iter().enumerate() {
        let text = format!("{}: {settings}; {}, {}", line + 1, percent(trade.error), seconds(trade.cost));
        words.draw(&Text::new(text, (82, (LINE * line as u32) as i32), font(13)))?;
    }
    Ok(())
}

fn chart(root: &Area, picture: &Picture) -> Drawn {
    let shown = |trade: &Trade| (trade.cost, trade.error.max(LEAST));
    let costs = extent(picture.marks.iter().map(|(trade, _)| trade.cost), 1.6);
    let errors = extent(picture.marks.iter().map(|(trade, _)| shown(trade).1), 2.5);
    let mut chart = ChartBuilder::on(root)
        .caption(&picture.title, font(19))
        .margin(14)
        .x_label_area_size(46)
        .y_label_area_size(82)
        .build_cartesian_2d(costs.clone().log_scale(), errors.clone().log_scale())?;
    chart
        .configure_mesh()
        .bold_line_style(GRID)
        .light_line_style(GRID.mix(0.35))
        .label_style(font(13))
        .axis_desc_style(font(15))
        .x_desc("wall time of a run [s]")
        .y_desc("largest error of the measures")
        .x_label_formatter(&|s| format!("{s}"))
        .y_label_formatter(&|e| percent(*e))
        .draw()?;
    for accuracy in ACCURACIES.iter().filter(|accuracy| errors.contains(accuracy)) {
        let ends = [(costs.start, *accuracy), (costs.end, *accuracy)];
        chart.draw_series(DashedLineSeries::new(ends, 6, 5, INK.mix(0.55).stroke_width(1)))?;
    }
    let front: Vec<(f64, f64)> = picture.front.iter().map(|(trade, _)| shown(trade)).collect();
    chart
        .draw_series(LineSeries::new(front.iter().copied(), INK.stroke_width(2)))?
        .label("front")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], INK.stroke_width(2)));
    for (group, name) in picture.groups.iter().enumerate() {
        let colour = COLOURS[group % COLOURS.len()];
        let of_group = picture.marks.iter().filter(|(_, of)| *of == group);
        chart
            .draw_series(of_group.map(|(trade, _)| Circle::new(shown(trade), 4, colour.mix(0.75).filled())))?
            .label(name)
            .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
    }
    chart.draw_series(front.iter().map(|place| Circle::new(*place, 7, INK.stroke_width(2))))?;
    chart.draw_series(front.iter().enumerate().map(|(number, place)| {
        EmptyElement::at(*place) + Text::new((number + 1).to_string(), (9, -15), font(13))
    }))?;
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .label_font(font(13))
        .draw()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_is_a_mark_and_the_front_is_drawn_over_them() {
        let at = |cost, error| Trade { cost, error };
        let marks = [(1.0, 0.1, 0), (3.0, 0.01, 1), (2.0, 0.5, 0)];
        let picture = Picture {
            title: "Drop & test".into(),
            groups: vec!["as it is".into(), "strong".into()],
            marks: marks.iter().map(|(c, e, group)| (at(*c, *e), *group)).collect(),
            front: vec![(at(1.0, 0.1), "window 2e-4".into()), (at(3.0, 0.01), "scheme strong".into())],
        };
        let svg = draw(&picture).expect("drawn");
        // Three runs, two rings of the front, two of the legend.
        assert_eq!(svg.matches("<circle").count(), 7, "{svg}");
        assert!(svg.contains("1: window 2e-4; 10 %, 1 s") && svg.contains("Drop &amp; test"), "{svg}");
    }
}
