//! `trajectory.svg`: plan of the trajectories over the shaded terrain, with the structure as it stands at the start, a section of
//! the terrain along one straight axis, and jump height, speed and energy along it. Drawn from the rows, the terrain and the structure's mesh
//! alone; the same rows give the same bytes.

pub mod contours;
mod net;
mod page;
mod panels;
mod plan;
pub mod shade;
pub mod sheet;

use crate::model::Model;
use crate::model::state::Body;
use crate::results::trajectory::Row;
use dem_contact::interface_mesh::ContactMesh;
use dem_terrain::Terrain;
use nalgebra::Vector3;
use net::Net;
use page::{FEW, HeightMap, LEGEND, Line, NAMES, TrajectoryPoint, WIDTH, colour, dashes};
use panels::{CURVES, PANEL, Panels};
use plotters::prelude::*;
use sheet::{Area, Drawn, FINE, INK, Imprint, LEFT, draw_line, font, number, px};
use std::io;
use std::path::Path;

use toolkit::files;
pub use toolkit::run_dir::PICTURE;

/// Draw the trajectories, rows and bodies by rock, and the `mesh` of a structure into the file `path`.
pub fn write(
    path: &Path,
    model: &Model,
    ground: &Terrain,
    trajectories: &[Vec<Row>],
    bodies: &[Body],
    mesh: Option<&ContactMesh>,
    imprint: &Imprint,
) -> io::Result<()> {
    let down = model.settings.down();
    let point = |row: &Row| {
        let place = row.position();
        let height = ground.height(&(Vector3::from(place) - model.origin), &down);
        TrajectoryPoint { row: *row, ground: height.map(|h| place[2] - h) }
    };
    let lines: Vec<Line> = (model.rocks.iter().zip(trajectories).zip(bodies))
        .map(|((rock, rows), body)| {
            let most = &body.path;
            let peaks = [most.highest.0, most.fastest.0, most.most_energy.0 / 1000.0];
            Line { peaks, ..Line::new(rock.name.clone(), rows.iter().map(point).collect()) }
        })
        .collect();
    let extent = ground.extent().map(|corner| [corner.x, corner.y]);
    let terrain = HeightMap {
        extent,
        height: &|x, y| ground.highest_at(x, y),
        settings: model.settings.terrain.as_ref(),
    };
    let net = mesh.map_or(Net::default(), |mesh| Net::of(mesh, &model.origin));
    files::write(path, draw(&lines, &terrain, &net, imprint).map_err(io::Error::other)?.as_bytes())
}

/// The whole picture as SVG text. `lines` without points are left out.
fn draw(lines: &[Line], terrain: &HeightMap, net: &Net, imprint: &Imprint) -> Result<String, String> {
    let lines: Vec<&Line> = lines.iter().filter(|l| !l.points.is_empty()).collect();
    if lines.is_empty() {
        return Err("there is no trajectory to draw".into());
    }
    let plan = plan::Plan::new(&lines, terrain, net);
    let panels = Panels::new(&lines, terrain, net);
    let total = LEGEND + plan.height() + panels.section_height() + CURVES.len() as i32 * PANEL;
    sheet::page([WIDTH, total], imprint, &plan.image(LEGEND), |root| {
        let (legend, rest) = root.split_vertically(LEGEND * FINE);
        draw_legend(&legend, &lines, plan.has_net(), plan.interval())?;
        let (own, rest) = rest.split_vertically(plan.height() * FINE);
        plan.draw(&own, &lines)?;
        let (own, mut rest) = rest.split_vertically(panels.section_height() * FINE);
        panels.section(&own)?;
        for number in 0..CURVES.len() {
            let (own, below) = rest.split_vertically(PANEL * FINE);
            panels.curve(&own, number)?;
            rest = below;
        }
        Ok(())
    })
}

fn draw_legend(area: &Area, lines: &[&Line], has_net: bool, interval: Option<f64>) -> Drawn {
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
        let style = colour(number).stroke_width(px(2.0) as u32);
        draw_line(area, dashes(number, lines.len()), ends, style)?;
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
    if has_net {
        area.draw(&PathElement::new(vec![(px(x + 118.0), y), (px(x + 144.0), y)], net::style()))?;
        area.draw(&label(x + 150.0, "structure at the start"))?;
        x += 178.0;
    }
    let Some(interval) = interval else { return Ok(()) };
    let text = format!("contours every {} m", number(&interval));
    area.draw(&label(x + 118.0, &text))
}

#[cfg(test)]
mod tests {
    use super::sheet::RIGHT;
    use super::*;
    use interface_defs::InterfaceMesh;

    /// Bounces down a plane that falls 0.5 m in each metre of x.
    fn bounces(name: &str, y: f64) -> Line {
        let point = |k: usize| {
            let (x, phase) = (k as f64 * 0.1, (k % 50) as f64 / 50.0);
            let jump = 8.0 * phase * (1.0 - phase);
            let ground = 1500.0 - 0.5 * x;
            let mut row = Row([0.0; 17]);
            row.0[2..5].copy_from_slice(&[2_600_000.0 + x, 1_200_000.0 + y, ground + jump + 0.4]);
            (row.0[5], row.0[11], row.0[14]) = (10.0 + phase, 1e5 * (1.0 + phase), jump);
            row.0[15] = f64::from(u8::from(k.is_multiple_of(50)));
            TrajectoryPoint { row, ground: Some(ground) }
        };
        Line::new(name.into(), (0..501).map(point).collect())
    }

    fn drawn_with(lines: &[Line], net: &Net) -> String {
        let height = |x: f64, y: f64| {
            let beside = (y - 1_200_010.0).abs() > 18.0;
            (!beside).then_some(1500.0 - 0.5 * (x - 2_600_000.0))
        };
        let extent = [[2_599_990.0, 1_199_990.0], [2_600_060.0, 1_200_030.0]];
        draw(lines, &HeightMap { extent, height: &height, settings: None }, net, &Imprint::default())
            .expect("drawn")
    }

    fn drawn(lines: &[Line]) -> String {
        drawn_with(lines, &Net::default())
    }

    /// Ends of all lines in the colour of the structure [px], two by two.
    fn of_net(text: &str) -> Vec<[(f64, f64); 2]> {
        let own = text.lines().filter(|l| l.starts_with("<polyline") && l.contains("\"#003C42\""));
        let number = |t: &str| t.parse::<f64>().expect("a number") / f64::from(FINE);
        let point = |t: &str| t.split_once(',').map(|(x, y)| (number(x), number(y))).expect("a place");
        own.map(|l| {
            let points = l.split("points=\"").nth(1).and_then(|t| t.split('"').next()).expect("points");
            let mut points = points.split_whitespace().map(point);
            [points.next().expect("one"), points.next().expect("two")]
        })
        .collect()
    }

    /// A net across the trajectory 30 m down the slope, upright from 1485 to 1489 m, and a rope 15 m to the north of it.
    #[test]
    fn a_structure_is_drawn_where_it_stands_in_the_plan_and_in_the_section() {
        let origin = Vector3::new(2_600_000.0, 1_200_000.0, 0.0);
        let mut mesh = InterfaceMesh::default();
        for [x, y, z] in [
            [30.0, 9.0, 1485.0],
            [30.0, 11.0, 1485.0],
            [30.0, 9.0, 1489.0],
            [30.0, 11.0, 1489.0],
            [30.0, 25.0, 1489.0],
            [25.0, 25.0, 1491.0],
        ] {
            mesh.coordinates.extend([x, y, z]);
        }
        // The edge from 1 to 2 belongs to two triangles.
        (mesh.faces, mesh.lines) = (vec![[0, 1, 2], [1, 3, 2]], vec![[4, 5]]);
        let net = Net::of(&ContactMesh::new(&mesh).expect("a mesh"), &origin);
        assert_eq!(net.points().count(), 12, "six edges");
        let line = bounces("block", 10.0);
        let section = net.section(&line, &page::Axis::new(&line));
        assert_eq!(section.len(), 5, "without the rope: {section:?}");
        assert!(section.iter().flatten().all(|(x, _)| (x - 30.0).abs() < 1e-6), "{section:?}");
        let text = drawn_with(&[line], &net);
        assert!(text.contains("structure at the start"));
        let lines = of_net(&text);
        // The legend, then in the plan: the edges across once, the upright ones are points, the rope; in the section: an upright line,
        // in it again the part that is all of it, as it looks the same.
        assert_eq!(lines.len(), 4, "{lines:?}");
        let plot = f64::from(WIDTH - LEFT - RIGHT);
        // The terrain is cut to the trajectory and the structure: from 9 m before its start, which is 12 % of 50 m and 3 m.
        let extent = 2.0 * (0.12 * 50.0 + 3.0) + 50.0;
        let scale = plot / extent;
        let (across, rope, upright) = (lines[1], lines[2], lines[3]);
        let due = f64::from(LEFT) + 39.0 * scale;
        assert!(across.iter().all(|(x, _)| (x - due).abs() < 1.0), "{across:?} {due}");
        assert!(((across[0].1 - across[1].1).abs() - 2.0 * scale).abs() < 1.0, "{across:?} {scale}");
        assert!((rope[0].0 - rope[1].0 - 5.0 * scale).abs() < 1.0, "{rope:?}");
        // The section goes from 3 % of 50 m before the start to as much behind the end, at one scale.
        let scale = plot / 53.0;
        let due = f64::from(LEFT) + 31.5 * scale;
        assert!(upright.iter().all(|(x, _)| (x - due).abs() < 1.0), "{upright:?} {due}");
        assert!(((upright[0].1 - upright[1].1).abs() - 4.0 * scale).abs() < 1.5, "{upright:?}");
    }

    /// A rock that a net throws back lies before it in the section too.
    #[test]
    fn a_rock_that_comes_back_comes_back_in_the_section() {
        let mut line = bounces("block", 10.0);
        line.points.extend(line.points.clone().into_iter().rev());
        let axis = page::Axis::new(&line);
        let at = |k: usize| axis.of(line.seen(k));
        assert!(
            (at(500) - 50.0).abs() < 1e-6 && at(1001).abs() < 1e-6 && (axis.azimuth() - 90.0).abs() < 1e-6
        );
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
        assert!(text.contains("EPSG") || text.contains("coordinate system not named"));
        assert!(text.starts_with("<svg width=\"1000\"") && text.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn the_headings_give_the_largest_values_of_every_step_not_of_the_rows_alone() {
        let peaks = [2.0, 12.34, 250.0];
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
