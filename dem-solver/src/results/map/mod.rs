//! `trajectory.svg`: plan of the trajectories over the shaded terrain, a section of the terrain along them, and jump
//! height, speed and energy along them. Drawn from the rows and the terrain alone; the same rows give the same bytes.

mod contours;
pub(crate) mod page;
mod panels;
mod plan;
pub(crate) mod shade;

use crate::model::Model;
use crate::model::state::Body;
use crate::results::trajectory::Row;
use crate::terrain::Terrain;
use nalgebra::Vector3;
use page::{
    Area, Drawn, FEW, FINE, HeightMap, INK, LEFT, LEGEND, Line, NAMES, Peaks, TrajectoryPoint, WIDTH, colour,
    font, number, px,
};
use plotters::prelude::*;
use std::io;
use std::path::Path;

pub use interface_defs::toolkit::run_dir::PICTURE;

/// Draw the trajectories, rows and bodies by rock, into the file `path`.
pub fn write(
    path: &Path,
    model: &Model,
    ground: &Terrain,
    trajectories: &[Vec<Row>],
    bodies: &[Body],
) -> io::Result<()> {
    let down = model.settings.down();
    let point = |row: &Row| {
        let place = row.position();
        let height = ground.height(&(Vector3::from(place) - model.origin), &down);
        TrajectoryPoint {
            place,
            ground: height.map(|h| place[2] - h),
            jump: row.height(),
            speed: row.speed(),
            energy: row.kinetic_energy(),
            touches: row.touches(),
        }
    };
    let lines: Vec<Line> = (model.rocks.iter().zip(trajectories).zip(bodies))
        .map(|((rock, rows), body)| {
            let most = &body.path;
            let peaks = Peaks { jump: most.highest.0, speed: most.fastest.0, energy: most.most_energy.0 };
            Line { peaks, ..Line::new(rock.name.clone(), rows.iter().map(point).collect()) }
        })
        .collect();
    let top = ground.highest.z + 1.0;
    let height = |x: f64, y: f64| {
        let above = Vector3::new(x - model.origin.x, y - model.origin.y, top);
        ground.height(&above, &-Vector3::z()).map(|h| top - h + model.origin.z)
    };
    let corner = |v: &Vector3<f64>| [v.x + model.origin.x, v.y + model.origin.y];
    let terrain = HeightMap { extent: [corner(&ground.lowest), corner(&ground.highest)], height: &height };
    std::fs::write(path, draw(&lines, &terrain).map_err(io::Error::other)?)
}

/// The whole picture as SVG text. `lines` without points are left out.
pub fn draw(lines: &[Line], terrain: &HeightMap) -> Result<String, String> {
    let lines: Vec<&Line> = lines.iter().filter(|l| !l.points.is_empty()).collect();
    if lines.is_empty() {
        return Err("there is no trajectory to draw".into());
    }
    let plan = plan::Plan::new(&lines, terrain);
    let panels = panels::Panels::new(&lines);
    let heights = [plan.height(), panels.section_height(), panels::PANEL, panels::PANEL, panels::PANEL];
    let total = heights.iter().sum::<i32>() + LEGEND;
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, ((WIDTH * FINE) as u32, (total * FINE) as u32))
            .into_drawing_area();
        let drawn = draw_page(&root, &lines, &plan, &panels, heights).and_then(|()| root.present());
        drawn.map_err(|e| e.to_string())?;
    }
    Ok(finish(text, total, &plan))
}

fn draw_page(
    root: &Area,
    lines: &[&Line],
    plan: &plan::Plan,
    panels: &panels::Panels,
    heights: [i32; 5],
) -> Drawn {
    root.fill(&WHITE)?;
    let (legend, mut rest) = root.split_vertically(LEGEND * FINE);
    draw_legend(&legend, lines, plan.interval())?;
    let mut areas = Vec::with_capacity(heights.len());
    for height in heights {
        let (own, below) = rest.split_vertically(height * FINE);
        areas.push(own);
        rest = below;
    }
    plan.draw(&areas[0], lines)?;
    panels.section(&areas[1])?;
    panels.jumps(&areas[2])?;
    panels.speeds(&areas[3])?;
    panels.energies(&areas[4])
}

fn draw_legend(area: &Area, lines: &[&Line], interval: Option<f64>) -> Drawn {
    let title = match lines {
        [one] => format!("Trajectory of {}", one.name),
        many => format!("Trajectories of {} rocks", many.len()),
    };
    area.draw(&Text::new(title, (px(f64::from(LEFT)), px(10.0)), font(17.0)))?;
    let y = px(44.0);
    let mut x = f64::from(LEFT);
    let label = |x: f64, text: &str| Text::new(text.to_owned(), (px(x), y - px(6.5)), font(13.0));
    for (number, line) in lines.iter().enumerate().take(NAMES) {
        let ends = vec![(px(x), y), (px(x + 26.0), y)];
        area.draw(&PathElement::new(ends, colour(number).stroke_width(px(2.0) as u32)))?;
        area.draw(&label(x + 32.0, &line.name))?;
        x += 48.0 + 7.5 * line.name.chars().count() as f64;
    }
    if lines.len() > NAMES {
        let more = format!("and {} more", lines.len() - NAMES);
        area.draw(&label(x, &more))?;
        x += 16.0 + 7.5 * more.len() as f64;
    }
    area.draw(&Circle::new((px(x + 6.0), y), px(5.0), INK.stroke_width(px(1.5) as u32)))?;
    area.draw(&label(x + 16.0, "start"))?;
    if lines.len() <= FEW {
        area.draw(&Circle::new((px(x + 66.0), y), px(2.6), INK.filled()))?;
        area.draw(&label(x + 74.0, "impact"))?;
        x += 76.0;
    }
    let cross = Cross::new((px(x + 64.0), y), px(4.5), INK.stroke_width(px(1.8) as u32));
    area.draw(&cross)?;
    area.draw(&label(x + 74.0, "end"))?;
    let Some(interval) = interval else { return Ok(()) };
    let text = format!("contours every {} m", number(&interval));
    area.draw(&label(x + 118.0, &text))
}

/// The page at its size in pixels, with the shading behind the lines of the plan.
fn finish(text: String, total: i32, plan: &plan::Plan) -> String {
    let drawn = format!("width=\"{}\" height=\"{}\"", WIDTH * FINE, total * FINE);
    let text = text.replacen(&drawn, &format!("width=\"{WIDTH}\" height=\"{total}\""), 1);
    // Behind everything but the white page, which is the first thing drawn.
    match text.find("<rect").and_then(|at| text[at..].find("/>").map(|end| at + end + 2)) {
        Some(at) => format!("{}\n{}{}", &text[..at], plan.image(LEGEND), &text[at..]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bounces down a plane that falls 0.5 m in each metre of x.
    fn bounces(name: &str, y: f64) -> Line {
        let point = |k: usize| {
            let (x, phase) = (k as f64 * 0.1, (k % 50) as f64 / 50.0);
            let jump = 8.0 * phase * (1.0 - phase);
            let ground = 1500.0 - 0.5 * x;
            TrajectoryPoint {
                place: [2_600_000.0 + x, 1_200_000.0 + y, ground + jump + 0.4],
                ground: Some(ground),
                jump: Some(jump),
                speed: 10.0 + phase,
                energy: 1e5 * (1.0 + phase),
                touches: k.is_multiple_of(50),
            }
        };
        Line::new(name.into(), (0..501).map(point).collect())
    }

    fn drawn(lines: &[Line]) -> String {
        let height = |x: f64, y: f64| {
            let beside = (y - 1_200_010.0).abs() > 18.0;
            (!beside).then_some(1500.0 - 0.5 * (x - 2_600_000.0))
        };
        let extent = [[2_599_990.0, 1_199_990.0], [2_600_060.0, 1_200_030.0]];
        draw(lines, &HeightMap { extent, height: &height }).expect("drawn")
    }

    #[test]
    fn the_picture_has_coordinates_scale_north_and_the_largest_values_that_the_points_have() {
        let line = bounces("block", 10.0);
        assert!((line.length() - 50.0).abs() < 1e-9);
        assert_eq!(line.landings().count(), 10);
        let text = drawn(&[line]);
        let words = [
            "x (east) [m]",
            "y (north) [m]",
            "2600020",
            "1200010",
            "10 m",
            "N",
            "elevation [m]",
            "1490",
            "contours every 1 m",
        ];
        for word in words.into_iter().chain(["largest 2.00 m", "largest 11.0 m/s", "largest 198 kJ", "[kJ]"])
        {
            assert!(text.contains(&format!("\n{word}\n")) || text.contains(word), "no `{word}`");
        }
        assert!(text.contains("data:image/png;base64,"), "shading");
        assert!(text.starts_with("<svg width=\"1000\"") && text.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn the_headings_give_the_largest_values_of_every_step_not_of_the_rows_alone() {
        let peaks = Peaks { jump: 2.0, speed: 12.34, energy: 250e3 };
        let text = drawn(&[Line { peaks, ..bounces("block", 10.0) }]);
        for word in ["largest 2.00 m", "largest 12.3 m/s", "largest 250 kJ"] {
            assert!(text.contains(word), "no `{word}`");
        }
    }

    #[test]
    fn the_same_rows_give_the_same_bytes_and_many_rocks_a_small_file() {
        let many: Vec<Line> = (0..200).map(|n| bounces(&format!("rock_{n}"), 0.1 * n as f64)).collect();
        let text = drawn(&many);
        assert!(text == drawn(&many));
        assert!(text.len() < 3_000_000, "{} bytes", text.len());
        assert!(text.contains("Trajectories of 200 rocks") && text.contains("and 194 more"));
    }

    #[test]
    fn a_rock_that_does_not_move_and_a_terrain_that_is_nowhere_are_drawn() {
        let mut line = bounces("rock", 10.0);
        line.points.truncate(1);
        drawn(&[Line::new("rock".into(), line.points)]);
        let far = Line::new("rock".into(), bounces("rock", 1e4).points);
        drawn(&[far]);
    }
}
