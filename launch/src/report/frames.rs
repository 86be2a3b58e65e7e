//! What is shown in space: the frames of a structure in `fields/`, rocks as `history.csv` has them, the terrain about them.

use super::curves::{bytes, floats};
use crate::report::table::Table;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde_json::{Map, Value, json};
use std::collections::{BTreeSet, HashMap};
use std::io;
use std::path::{Path, PathBuf};
use toolkit::run_dir::FIELDS;
use toolkit::summary::Summary;
use toolkit::vtu::{Loaded, series};

/// Bytes of all frames of a structure; of more some are left out, as evenly as may be.
const BYTES: usize = 2_400_000;
/// Most frames.
const FRAMES: usize = 200;
/// Most rows of the motion of a rock.
const POSES: usize = 3000;
/// Triangles of the terrain, about: of more, corners within a cell are one.
const TRIANGLES: f64 = 20_000.0;
/// Terrain is shown this share of their own extent beyond rocks and structure, and so far at least [m].
const MARGIN: (f64, f64) = (0.25, 5.0);
/// Of whole numbers of 16 bits the largest; the one below all others marks what is broken.
const LARGEST: f64 = 32_767.0;

/// Times [s] and files of a series.
type Files = [(f64, PathBuf)];

/// What is shown: all places are counted from `origin`.
struct Stage {
    origin: Vector3<f64>,
    /// The box about structure and rocks.
    extent: Option<[Vector3<f64>; 2]>,
    /// As the page takes it.
    data: Map<String, Value>,
}

/// All of it; `None` where nothing of it was written.
pub fn replay(
    dir: &Path,
    summary: &Summary,
    scene: &toml::Table,
    history: &Table,
) -> io::Result<Option<Value>> {
    let fields = dir.join(FIELDS);
    let [structures, surfaces] = [series(&fields, "structure")?, series(&fields, "rock_surface")?];
    let Some((_, any)) = structures.first().or(surfaces.first()) else { return Ok(None) };
    let origin = corner(&Loaded::open(any)?.floats("Points")?, 0);
    let gravity = scene.get("gravity").and_then(|of| of.clone().try_into::<[f64; 3]>().ok());
    let gravity = gravity.map_or(-Vector3::z(), Vector3::from);
    // The moment of the largest force.
    let timed = |name: &str| summary.measures.iter().find(|of| of.name == name && of.time.is_some());
    let peak = ["max_cable_force", "max_reaction_1ms", "max_reaction"].into_iter().find_map(timed);
    let impacts =
        summary.verdict.iter().filter_map(|of| Some(json!({ "rock": of.rock, "time": of.impact?.time })));
    let time = history.column("time_s");
    let mut stage = Stage { origin, extent: None, data: Map::new() };
    let data = [
        ("up", json!((-gravity).as_slice())),
        ("from", json!(time.first())),
        ("to", json!(time.last())),
        ("impacts", impacts.collect()),
        ("peak", json!(peak.map(|of| json!({ "name": of.name, "time": of.time })))),
    ];
    stage.data.extend(data.map(|(name, value)| (name.to_owned(), value)));
    stage.rocks(&surfaces, history)?;
    stage.structure(&structures, &fields, gravity, peak.and_then(|of| of.time))?;
    stage.terrain(&fields.join("terrain.vtu"))?;
    Ok(Some(stage.data.into()))
}

fn corner(points: &[f64], number: usize) -> Vector3<f64> {
    points.get(3 * number..3 * number + 3).map_or_else(Vector3::zeros, Vector3::from_column_slice)
}

/// Coordinates one after the other.
fn flat(places: &[Vector3<f64>]) -> impl Iterator<Item = f64> {
    places.iter().flat_map(|at| [at.x, at.y, at.z])
}

impl Stage {
    fn grow(&mut self, places: &[Vector3<f64>]) {
        for place in places {
            let [low, high] = self.extent.get_or_insert([*place; 2]);
            (*low, *high) = (low.inf(place), high.sup(place));
        }
    }

    /// Each rock: its surface about its centre, and its motion.
    fn rocks(&mut self, surfaces: &Files, history: &Table) -> io::Result<()> {
        self.data.insert("rocks".into(), json!([]));
        let Some((begin, file)) = surfaces.first() else {
            return Ok(());
        };
        let surface = Loaded::open(file)?;
        let (points, triangles) = (surface.floats("Points")?, surface.whole("connectivity")?);
        let numbers = surface.floats("rock")?;
        let time = history.column("time_s");
        let at = time.iter().position(|time| time >= begin).unwrap_or(0);
        let step = time.len().div_ceil(POSES).max(1);
        let rows: Vec<usize> = (0..time.len()).step_by(step).chain(time.len().checked_sub(1)).collect();
        let mut rocks = Vec::new();
        for (number, name) in history.rocks().enumerate() {
            let places = history.vector(name, ["_x_m", "_y_m", "_z_m"]);
            let turns = history.vector(name, ["w", "x", "y", "z"].map(|part| format!("_orientation_{part}")));
            let (Some(places), Some(turns)) = (places, turns) else { continue };
            let [w, x, y, z] = turns[at];
            let back = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).inverse();
            let is_own =
                |(face, _): &(usize, _)| numbers.get(*face).map_or(number == 0, |of| *of == number as f64);
            let own = triangles.chunks_exact(3).enumerate().filter(is_own).flat_map(|(_, nodes)| nodes);
            let about = |node: &u32| back * (corner(&points, *node as usize) - Vector3::from(places[at]));
            let corners: Vec<Vector3<f64>> = own.map(about).collect();
            let motion: Vec<Vector3<f64>> =
                rows.iter().map(|row| Vector3::from(places[*row]) - self.origin).collect();
            self.grow(&motion);
            let poses = rows
                .iter()
                .zip(&motion)
                .flat_map(|(row, at)| [at.x, at.y, at.z].into_iter().chain(turns[*row]));
            rocks.push(json!({
                "name": name, "corners": floats(flat(&corners)), "radius": corners.iter().map(|at| at.norm()).fold(0.0, f64::max),
                "times": floats(rows.iter().map(|row| time[*row])), "poses": floats(poses),
            }));
        }
        self.data.insert("rocks".into(), rocks.into());
        Ok(())
    }

    /// Lines, faces and frames of the structure. To either side of the origin there are 32 767 places along an axis.
    fn structure(
        &mut self,
        files: &Files,
        fields: &Path,
        gravity: Vector3<f64>,
        peak: Option<f64>,
    ) -> io::Result<()> {
        let Some((_, first)) = files.first() else { return Ok(()) };
        let first = Loaded::open(first)?;
        let is_lines = first.whole("offsets")?.first() == Some(&2);
        let lines = if is_lines { first.whole("connectivity")? } else { Vec::new() };
        let nodes = first.floats("Points")?.len() / 3;
        let mut faces = Vec::new();
        if let Some((_, file)) = series(fields, "structure_faces")?.first() {
            let file = Loaded::open(file)?;
            let (nodes, mut begin) = (file.whole("connectivity")?, 0);
            for end in file.whole("offsets")? {
                let own = nodes.get(begin..end as usize).unwrap_or_default();
                faces.extend((2..own.len()).flat_map(|k| [own[0], own[k - 1], own[k]]));
                begin = end as usize;
            }
        }
        if lines.iter().chain(&faces).any(|node| *node as usize >= nodes) {
            return Err(io::Error::other("the field files of the structure name nodes that there are not"));
        }
        let most = (BYTES / (6 * nodes + lines.len()).max(1)).clamp(2, FRAMES);
        let off = |number: &usize, time: f64| (files[*number].0 - time).abs();
        let nearest = |time: f64| (0..files.len()).min_by(|a, b| off(a, time).total_cmp(&off(b, time)));
        let evenly = (0..files.len()).step_by(files.len().div_ceil(most)).chain([files.len() - 1]);
        let chosen: BTreeSet<usize> = evenly.chain(peak.and_then(nearest)).collect();
        let (mut places, mut forces) = (Vec::new(), Vec::new());
        for number in &chosen {
            let frame = Loaded::open(&files[*number].1)?;
            let (points, force, broken) =
                (frame.floats("Points")?, frame.floats("axial_force")?, frame.floats("broken")?);
            places.extend((0..nodes).map(|node| corner(&points, node) - self.origin));
            let broken = broken.iter().map(|broken| *broken > 0.0).chain(std::iter::repeat(false));
            let force = force.iter().copied().chain(std::iter::repeat(0.0)).zip(broken);
            forces.extend(
                force.take(lines.len() / 2).map(|(force, broken)| if broken { f64::NAN } else { force }),
            );
        }
        self.grow(&places);
        let scale = flat(&places).map(f64::abs).fold(1e-9, f64::max) / LARGEST;
        let newton = forces.iter().map(|force| force.abs()).fold(1e-9, f64::max) / LARGEST;
        let whole = |value: f64, scale: f64| ((value / scale).round() as i16).to_le_bytes();
        let force = |value: &f64| if value.is_nan() { i16::MIN.to_le_bytes() } else { whole(*value, newton) };
        let data = [
            ("nodes", json!(nodes)),
            ("written", json!(files.len())),
            ("frames", chosen.iter().map(|number| files[*number].0).collect()),
            ("lines", json!(bytes(lines.iter().flat_map(|node| node.to_le_bytes())))),
            (
                "parts",
                json!(bytes(first.floats("part")?.iter().take(lines.len() / 2).map(|part| *part as u8))),
            ),
            ("faces", json!(bytes(faces.iter().flat_map(|node| node.to_le_bytes())))),
            ("scale", json!(scale)),
            ("places", json!(bytes(flat(&places).flat_map(|value| whole(value, scale))))),
            ("newton", json!(newton)),
            ("forces", json!(bytes(forces.iter().flat_map(force)))),
            ("axes", axes(&places[..nodes], gravity).map(|axis| json!(axis.as_slice())).to_vec().into()),
        ];
        self.data.extend(data.map(|(name, value)| (name.to_owned(), value)));
        Ok(())
    }

    /// Triangles of the terrain about structure and rocks, three corners each.
    fn terrain(&mut self, file: &Path) -> io::Result<()> {
        let Some([low, high]) = self.extent.filter(|_| file.exists()) else { return Ok(()) };
        let file = Loaded::open(file)?;
        let (points, triangles) = (file.floats("Points")?, file.whole("connectivity")?);
        let margin = (MARGIN.0 * (high - low).xy().max()).max(MARGIN.1);
        let place = |node: &u32| corner(&points, *node as usize) - self.origin;
        let is_near =
            |at: Vector3<f64>| (0..2).all(|k| at[k] >= low[k] - margin && at[k] <= high[k] + margin);
        let near = triangles.chunks_exact(3).filter(|nodes| nodes.iter().map(place).any(is_near));
        let near: Vec<&[u32]> = near.collect();
        let area = (high - low).xy().add_scalar(2.0 * margin).product();
        // What is small enough stays as it is: all of its corners lie in cells of their own.
        let cell = if near.len() as f64 > TRIANGLES { (2.0 * area / TRIANGLES).sqrt() } else { 1e-6 };
        let mut corners: HashMap<[i64; 3], Vector3<f64>> = HashMap::new();
        let mut all = Vec::new();
        for nodes in near {
            let cells = [0, 1, 2].map(|k| place(&nodes[k]).map(|of| (of / cell).round() as i64).into());
            if cells[0] != cells[1] && cells[1] != cells[2] && cells[2] != cells[0] {
                all.extend([0, 1, 2].map(|k| *corners.entry(cells[k]).or_insert_with(|| place(&nodes[k]))));
            }
        }
        self.data.insert("terrain".into(), floats(flat(&all)).into());
        Ok(())
    }
}

/// Directions of the elevation: along the structure, up in its plane, across it. Its plane is that in which its nodes lie best.
fn axes(places: &[Vector3<f64>], gravity: Vector3<f64>) -> [Vector3<f64>; 3] {
    let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    let spread: Matrix3<f64> = places.iter().map(|place| (place - mean) * (place - mean).transpose()).sum();
    let own = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| own.eigenvalues[*a].total_cmp(&own.eigenvalues[*b]));
    let [across, short, _] = order.map(|k| own.eigenvectors.column(k).into_owned());
    // To positive coordinates, where nothing else says which of two.
    let positive = |axis: Vector3<f64>| axis * (axis.x + 0.1 * axis.y + 0.5 * axis.z).signum();
    let rise = across * gravity.dot(&across) - gravity;
    // Against gravity where the structure stands; along its shorter side where it lies.
    let up = if rise.norm() > 0.5 * gravity.norm() { rise.normalize() } else { positive(short) };
    let along = positive(up.cross(&across));
    [along, up, along.cross(&up)]
}
