//! Error over cost on logarithmic axes, with the front of what no other beats.

use plotters::prelude::*;
use toolkit::numbers::{percent, seconds, three};
use toolkit::picture::{self, COLOURS};

/// Cost [s] and error of a run.
pub type Place = (f64, f64);

/// What is drawn.
pub struct Scatter {
    /// Above it.
    pub title: String,
    /// Beside its axis of errors.
    pub error: &'static str,
    /// When it was drawn, at its foot.
    pub date: String,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// All runs that have an error, each with its group: the first is the scene's own arm.
    pub marks: Vec<(Place, usize)>,
    /// The front, the cheapest first, with what to write beside it.
    pub front: Vec<(Place, String)>,
    /// Errors at which a line is drawn.
    pub lines: &'static [f64],
}

const SIZE: (i32, i32) = (900, 620);
/// Left of the plot, height of a line of text, and width of a letter [px].
const LEFT: i32 = 82;
const LINE: i32 = 18;
const LETTER: i32 = 6;
const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(205, 205, 205);
/// Marks: corners, the turn of the first one [quarters of a circle], and how far from the middle lies what is between two of them.
const FORMS: [(u8, f64, f64); 7] = [
    (12, 0.0, 0.97),
    (3, -1.0, 0.5),
    (4, 0.5, 0.71),
    (5, -1.0, 0.4),
    (4, 0.0, 0.71),
    (3, 1.0, 0.5),
    (4, 0.0, 0.3),
];
/// Errors below are drawn there: the plot has no room for less.
const LEAST: f64 = 1e-7;

/// The picture as SVG; there is one mark at least.
pub fn draw(scatter: &Scatter) -> Result<String, String> {
    let mut text = String::new();
    let size = [SIZE.0, SIZE.1 + LINE * (scatter.front.len() as i32 + 2) + picture::FOOT];
    {
        let root = SVGBackend::with_string(&mut text, (size[0] as u32, size[1] as u32)).into_drawing_area();
        draw_page(&root, scatter).and_then(|()| root.present()).map_err(|e| e.to_string())?;
    }
    picture::close(&mut text, size, 1, &[Some(&scatter.date)]);
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

/// What marks mean, the plot, and below it what the numbers at the front mean.
fn draw_page(root: &Area, scatter: &Scatter) -> Drawn {
    root.fill(&WHITE)?;
    let (head, rest) = root.split_vertically(2 * LINE + 40);
    let (plot, words) = rest.split_vertically(SIZE.1 - 40);
    head.draw(&Text::new(scatter.title.as_str(), (LEFT, 12), font(19)))?;
    let (mut x, mut y) = (LEFT, 48);
    head.draw(&PathElement::new([(x, y), (x + 18, y)], INK.stroke_width(2)))?;
    head.draw(&Text::new("front", (x + 24, y - 7), font(13)))?;
    for (group, name) in scatter.groups.iter().enumerate() {
        x += 70;
        if x + 24 + LETTER * name.len() as i32 > SIZE.0 {
            (x, y) = (LEFT, y + LINE);
        }
        head.draw(&(EmptyElement::at((x + 9, y)) + mark(group)))?;
        head.draw(&Text::new(name.as_str(), (x + 24, y - 7), font(13)))?;
        x += LETTER * name.len() as i32 - 30;
    }
    chart(&plot, scatter)?;
    for (line, ((cost, error), settings)) in scatter.front.iter().enumerate() {
        let text = format!("{}: {settings}; {}, {}", line + 1, percent(*error), seconds(*cost));
        words.draw(&Text::new(text, (LEFT, LINE * line as i32), font(13)))?;
    }
    Ok(())
}

/// The mark of a group, about its place: groups differ in form as well as in colour.
fn mark(group: usize) -> Polygon<(i32, i32)> {
    let ((corners, turn, inner), (r, g, b)) = (FORMS[group % FORMS.len()], COLOURS[group % COLOURS.len()]);
    let corner = |k: u8| {
        let far = if k.is_multiple_of(2) { 6.0 } else { 6.0 * inner };
        let angle = std::f64::consts::PI * (0.5 * turn + f64::from(k) / f64::from(corners));
        ((far * angle.cos()).round() as i32, (far * angle.sin()).round() as i32)
    };
    Polygon::new((0..2 * corners).map(corner).collect::<Vec<_>>(), RGBColor(r, g, b).mix(0.8).filled())
}

fn chart(root: &Area, scatter: &Scatter) -> Drawn {
    let shown = |(cost, error): &Place| (*cost, error.max(LEAST));
    let costs = extent(scatter.marks.iter().map(|(place, _)| place.0), 1.6);
    let errors = extent(scatter.marks.iter().map(|(place, _)| shown(place).1), 2.5);
    let mut chart = ChartBuilder::on(root)
        .margin(14)
        .x_label_area_size(46)
        .y_label_area_size(LEFT - 14)
        .build_cartesian_2d(costs.clone().log_scale(), errors.clone().log_scale())?;
    // Of the numbers of a decade there is room for three.
    let number = |seconds: f64| {
        let first = seconds / 10_f64.powf((seconds.log10() + 1e-9).floor());
        if [1.0, 2.0, 5.0].iter().any(|it| (first - it).abs() < 0.01) {
            three(seconds)
        } else {
            String::new()
        }
    };
    chart
        .configure_mesh()
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .label_style(font(13))
        .axis_desc_style(font(15))
        .x_desc("processor time of a run [s]")
        .y_desc(scatter.error)
        .x_label_formatter(&|seconds| number(*seconds))
        .y_label_formatter(&|error| percent(*error))
        .draw()?;
    for accuracy in scatter.lines.iter().filter(|accuracy| errors.contains(accuracy)) {
        let ends = [(costs.start, *accuracy), (costs.end, *accuracy)];
        chart.draw_series(DashedLineSeries::new(ends, 6, 5, INK.mix(0.55).stroke_width(1)))?;
    }
    let front: Vec<(f64, f64)> = scatter.front.iter().map(|(place, _)| shown(place)).collect();
    chart.draw_series(LineSeries::new(front.iter().copied(), INK.stroke_width(2)))?;
    let marks = scatter.marks.iter();
    chart.draw_series(marks.map(|(place, group)| EmptyElement::at(shown(place)) + mark(*group)))?;
    chart.draw_series(front.iter().map(|place| Circle::new(*place, 9, INK.stroke_width(2))))?;
    chart.draw_series(front.iter().enumerate().map(|(number, place)| {
        EmptyElement::at(*place) + Text::new((number + 1).to_string(), (10, -17), font(13))
    }))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_is_a_mark_and_the_front_is_drawn_over_them() {
        let marks = [(1.0, 0.1, 0), (3.0, 0.01, 1), (2.0, 0.5, 0)];
        let scatter = Scatter {
            title: "Drop & test".into(),
            error: "error",
            date: "2026-01-01".into(),
            groups: vec!["as it is".into(), "strong".into()],
            marks: marks.iter().map(|(c, e, group)| ((*c, *e), *group)).collect(),
            front: vec![((1.0, 0.1), "window 2e-4".into()), ((3.0, 0.01), "scheme strong".into())],
            lines: &[0.1],
        };
        let svg = draw(&scatter).expect("drawn");
        // Three runs and two of the legend, and two rings of the front.
        assert_eq!([svg.matches("<polygon").count(), svg.matches("<circle").count()], [5, 2], "{svg}");
        assert!(svg.contains("1: window 2e-4; 10 %, 1 s") && svg.contains("Drop &amp; test"), "{svg}");
    }
}
