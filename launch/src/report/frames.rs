//! What is shown in space: the frames of a structure in `fields/`, rocks as `history.csv` has them, the terrain about them.

use super::curves::{Table, bytes, floats};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use toolkit::files;
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

/// A box.
type Extent = [Vector3<f64>; 2];

/// All of it; `None` where nothing of it was written.
pub fn replay(
    dir: &Path,
    summary: &Summary,
    scene: &toml::Table,
    history: &Table,
) -> io::Result<Option<Value>> {
    let fields = dir.join(FIELDS);
    let [structures, surfaces] = [series(&fields, "structure")?, series(&fields, "rock_surface")?];
    let time = history.column("time_s").unwrap_or_default();
    let Some((_, any)) = structures.first().or(surfaces.first()) else { return Ok(None) };
    let origin = corner(&Loaded::open(any)?.floats("Points")?, 0);
    let mut extent = None;
    let rocks = rocks(&surfaces, history, origin, &mut extent)?;
    let gravity = scene.get("gravity").and_then(|of| of.clone().try_into::<[f64; 3]>().ok());
    let gravity = gravity.map_or(-Vector3::z(), Vector3::from);
    // The moment of the largest force.
    let named =
        |name: &str| summary.measures.iter().find(|measure| measure.name == name && measure.time.is_some());
    let peak = ["max_cable_force", "max_reaction_1ms", "max_reaction"].into_iter().find_map(named);
    let impacts = summary.verdict.iter().filter_map(|of| Some((of.rock.as_str(), of.impact?.time)));
    let ends = [time.first(), time.last()].map(|end| end.copied().unwrap_or(0.0));
    let mut all = json!({
        "rocks": rocks, "up": (-gravity).as_slice(), "from": ends[0], "to": ends[1],
        "impacts": impacts.map(|(rock, time)| json!({ "rock": rock, "time": time })).collect::<Vec<_>>(),
        "peak": peak.map(|of| json!({ "name": of.name, "time": of.time })),
    });
    structure(&structures, &fields, origin, gravity, peak.and_then(|of| of.time), &mut extent, &mut all)?;
    if let Some(extent) = extent {
        all["terrain"] = terrain(&fields.join("terrain.vtu"), origin, extent)?;
    }
    Ok(Some(all))
}

fn corner(points: &[f64], number: usize) -> Vector3<f64> {
    points.get(3 * number..3 * number + 3).map_or_else(Vector3::zeros, Vector3::from_column_slice)
}

fn grow(extent: &mut Option<Extent>, by: Vector3<f64>) {
    let [low, high] = extent.get_or_insert([by; 2]);
    (*low, *high) = (low.inf(&by), high.sup(&by));
}

/// Each rock: its surface about its centre, and its motion.
fn rocks(
    surfaces: &[(f64, PathBuf)],
    history: &Table,
    origin: Vector3<f64>,
    extent: &mut Option<Extent>,
) -> io::Result<Vec<Value>> {
    let (Some((begin, file)), Some(time)) = (surfaces.first(), history.column("time_s")) else {
        return Ok(Vec::new());
    };
    let surface = Loaded::open(file)?;
    let (points, triangles, numbers) =
        (surface.floats("Points")?, surface.whole("connectivity")?, surface.floats("rock")?);
    let at = time.iter().position(|time| time >= begin).unwrap_or(0);
    let step = time.len().div_ceil(POSES).max(1);
    let mut rocks = Vec::new();
    for (number, name) in history.rocks().enumerate() {
        let places = history.vector(name, ["_x_m", "_y_m", "_z_m"]);
        let turns =
            history.vector(name, ["_orientation_w", "_orientation_x", "_orientation_y", "_orientation_z"]);
        let (Some(places), Some(turns)) = (places, turns) else { continue };
        let place = |row: usize| Vector3::from(places[row]);
        let [w, x, y, z] = turns[at];
        let back = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).inverse();
        let is_own = |face: usize| numbers.get(face).map_or(number == 0, |of| *of == number as f64);
        let own = triangles.chunks_exact(3).enumerate().filter(|(face, _)| is_own(*face));
        let corners = own.flat_map(|(_, nodes)| {
            nodes.iter().map(|node| back * (corner(&points, *node as usize) - place(at)))
        });
        let corners: Vec<Vector3<f64>> = corners.collect();
        let rows = (0..time.len()).step_by(step).chain(time.len().checked_sub(1));
        let poses: Vec<usize> = rows.collect();
        poses.iter().for_each(|row| grow(extent, place(*row) - origin));
        let pose = |row: usize| (place(row) - origin).iter().copied().chain(turns[row]).collect::<Vec<_>>();
        rocks.push(json!({
            "name": name, "corners": floats(corners.iter().flat_map(|at| [at.x, at.y, at.z])),
            "radius": corners.iter().map(|at| at.norm()).fold(0.0, f64::max),
            "times": floats(poses.iter().map(|row| time[*row])),
            "poses": floats(poses.iter().flat_map(|row| pose(*row))),
        }));
    }
    Ok(rocks)
}

/// Lines, faces and frames of the structure, into `all`. Between the least and the largest coordinate there are 65 535 places.
fn structure(
    files: &[(f64, PathBuf)],
    fields: &Path,
    origin: Vector3<f64>,
    gravity: Vector3<f64>,
    peak: Option<f64>,
    extent: &mut Option<Extent>,
    all: &mut Value,
) -> io::Result<()> {
    let Some((_, first)) = files.first() else { return Ok(()) };
    let first = Loaded::open(first)?;
    let is_lines = first.whole("offsets")?.first() == Some(&2);
    let lines = if is_lines { first.whole("connectivity")? } else { Vec::new() };
    let nodes = first.floats("Points")?.len() / 3;
    let most = (BYTES / (6 * nodes + lines.len()).max(1)).clamp(2, FRAMES);
    let step = files.len().div_ceil(most).max(1);
    let nearest = |time: f64| {
        (0..files.len()).min_by(|a, b| (files[*a].0 - time).abs().total_cmp(&(files[*b].0 - time).abs()))
    };
    let mut chosen: Vec<usize> =
        (0..files.len()).step_by(step).chain([files.len() - 1]).chain(peak.and_then(nearest)).collect();
    chosen.sort_unstable();
    chosen.dedup();
    let (mut places, mut forces) = (Vec::new(), Vec::new());
    for number in &chosen {
        let frame = Loaded::open(&files[*number].1)?;
        let (points, broken) = (frame.floats("Points")?, frame.floats("broken")?);
        if points.len() != 3 * nodes {
            return Err(io::Error::other(format!(
                "{} has other nodes than the frame before",
                files[*number].1.display()
            )));
        }
        places.extend((0..nodes).map(|node| corner(&points, node) - origin));
        let force = frame.floats("axial_force")?;
        forces.extend((0..lines.len() / 2).map(|line| {
            let broken = broken.get(line).is_some_and(|broken| *broken > 0.0);
            if broken { f64::NAN } else { force.get(line).copied().unwrap_or(0.0) }
        }));
    }
    places.iter().for_each(|place| grow(extent, *place));
    let scale = places.iter().map(|place| place.amax()).fold(1e-9, f64::max) / LARGEST;
    let most = forces.iter().map(|force| force.abs()).fold(1e-9, f64::max) / LARGEST;
    let whole = |value: f64, scale: f64| ((value / scale).round() as i16).to_le_bytes();
    let force = |value: &f64| if value.is_nan() { i16::MIN.to_le_bytes() } else { whole(*value, most) };
    let legend: Value = files::read_json(&fields.join("structure_legend.json")).unwrap_or_default();
    let count = chosen.len();
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
    let own = json!({
        "nodes": nodes, "frames": chosen.iter().map(|number| files[*number].0).collect::<Vec<_>>(), "written": files.len(),
        "lines": bytes(lines.iter().flat_map(|node| node.to_le_bytes())),
        "parts": bytes(first.floats("part")?.iter().take(lines.len() / 2).map(|part| *part as u8)), "names": legend["part"],
        "faces": bytes(faces.iter().flat_map(|node| node.to_le_bytes())),
        "scale": scale, "places": bytes(places.iter().flat_map(|at| [at.x, at.y, at.z]).flat_map(|value| whole(value, scale))),
        "newton": most, "forces": bytes(forces.iter().flat_map(force)),
        "axes": axes(&places[..places.len() / count], gravity).map(|axis| [axis.x, axis.y, axis.z]),
    });
    if let (Value::Object(all), Value::Object(own)) = (all, own) {
        all.extend(own);
    }
    Ok(())
}

/// Directions of the elevation: along the structure, up in its plane, across it. Its plane is that in which its nodes lie best.
fn axes(places: &[Vector3<f64>], gravity: Vector3<f64>) -> [Vector3<f64>; 3] {
    let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    let spread: Matrix3<f64> = places.iter().map(|place| (place - mean) * (place - mean).transpose()).sum();
    let own = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| own.eigenvalues[*a].total_cmp(&own.eigenvalues[*b]));
    let [across, short, long] = order.map(|k| own.eigenvectors.column(k).into_owned());
    let down = gravity.try_normalize(0.0).unwrap_or(-Vector3::z());
    // Up against gravity where the structure stands; where it lies, along its shorter side, to z or y.
    let stands = (down - across * down.dot(&across)).norm() > 0.5;
    let up = if stands { -(down - across * down.dot(&across)).normalize() } else { short };
    let up = if stands || up.z + 0.5 * up.y >= 0.0 { up } else { -up };
    let along = if stands { up.cross(&across) } else { long };
    let along = if along.x + 0.5 * along.y >= 0.0 { along } else { -along };
    [along, up, along.cross(&up)]
}

/// Triangles of the terrain about `extent`, three corners each; null where there is none.
fn terrain(file: &Path, origin: Vector3<f64>, [low, high]: Extent) -> io::Result<Value> {
    if !file.exists() {
        return Ok(Value::Null);
    }
    let file = Loaded::open(file)?;
    let (points, triangles) = (file.floats("Points")?, file.whole("connectivity")?);
    let margin = (MARGIN.0 * (high - low).xy().max()).max(MARGIN.1);
    let place = |node: &u32| corner(&points, *node as usize) - origin;
    let is_near = |at: Vector3<f64>| (0..2).all(|k| at[k] >= low[k] - margin && at[k] <= high[k] + margin);
    let near: Vec<&[u32]> =
        triangles.chunks_exact(3).filter(|nodes| nodes.iter().map(place).any(is_near)).collect();
    let area = (high - low).xy().add_scalar(2.0 * margin).product();
    let cell = if near.len() as f64 > TRIANGLES { (2.0 * area / TRIANGLES).sqrt() } else { 0.0 };
    let (mut numbers, mut corners) = (HashMap::new(), Vec::new());
    let mut number = |node: &u32| {
        let at = place(node);
        let key = if cell > 0.0 {
            at.map(|of| (of / cell).floor() as i64).into()
        } else {
            [i64::from(*node), 0, 0]
        };
        *numbers.entry(key).or_insert_with(|| {
            corners.push(at);
            corners.len() as u32 - 1
        })
    };
    let kept = near.iter().map(|nodes| [number(&nodes[0]), number(&nodes[1]), number(&nodes[2])]);
    let kept: Vec<[u32; 3]> = kept.filter(|[a, b, c]| a != b && b != c && a != c).collect();
    Ok(json!({
        "corners": floats(corners.iter().flat_map(|at| [at.x, at.y, at.z])),
        "triangles": bytes(kept.iter().flatten().flat_map(|node| node.to_le_bytes())), "cell": cell,
    }))
}
