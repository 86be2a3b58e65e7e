//! Solids to cover: slabs, columns, discs, shells, limbs, scans, beside the built-in shapes.

use dem_solver::shape::surface::joined;
use dem_solver::shape::{Shape, Surface, builtin};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// A closed surface by its name: a shape as a command line names it, or one of those below.
pub fn solid(name: &str) -> Surface {
    let (surface, _) = match name {
        "disc" => revolved(&[[0.0, -0.05], [0.5, -0.05], [0.5, 0.05], [0.0, 0.05]], false, 48),
        "column" => revolved(&[[0.0, -1.0], [0.1, -1.0], [0.1, 1.0], [0.0, 1.0]], false, 32),
        "ring" => {
            let around = |k: u32| f64::from(k) / 16.0 * TAU;
            let profile: Vec<_> =
                (0..16).map(|k| [0.4 + 0.1 * around(k).cos(), 0.1 * around(k).sin()]).collect();
            revolved(&profile, true, 48)
        }
        "pipe" => revolved(&[[0.27, -0.5], [0.3, -0.5], [0.3, 0.5], [0.27, 0.5]], true, 48),
        "bowl" => {
            let arc = |k: u32, r: f64| {
                let angle = f64::from(k) / 12.0 * TAU / 4.0;
                [r * angle.sin(), -r * angle.cos()]
            };
            let inner = (0..=12).rev().map(|k| arc(k, 0.44));
            let profile: Vec<_> = (0..=12).map(|k| arc(k, 0.5)).chain(inner).collect();
            revolved(&profile, false, 48)
        }
        "L" => blocks(&[[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [0, 1, 0], [0, 2, 0]], 0.2),
        "jack" => {
            let mut cells = vec![[0, 0, 0]];
            for axis in 0..3 {
                for at in [-2, -1, 1, 2] {
                    let mut cell = [0; 3];
                    cell[axis] = at;
                    cells.push(cell);
                }
            }
            blocks(&cells, 0.15)
        }
        "star" => star(),
        "scan" => scan(),
        _ => Shape::parse(name, 1.0).and_then(|s| s.surface(true)).unwrap_or_else(|e| panic!("{e}")),
    };
    surface
}

fn closed(points: Vec<Vector3<f64>>, triangles: Vec<[u32; 3]>) -> (Surface, Vec<String>) {
    Surface::from_indexed(points, triangles).unwrap_or_else(|flaw| panic!("{flaw}"))
}

/// A profile (radius, height) turned about z; from axis to axis, or closed in itself.
pub fn revolved(profile: &[[f64; 2]], ring: bool, around: u32) -> (Surface, Vec<String>) {
    let mut points = Vec::new();
    let rows: Vec<Vec<u32>> = profile
        .iter()
        .map(|[radius, height]| {
            let first = points.len() as u32;
            let many = if *radius > 0.0 { around } else { 1 };
            for k in 0..many {
                let angle = f64::from(k) / f64::from(many) * TAU;
                points.push(Vector3::new(radius * angle.cos(), radius * angle.sin(), *height));
            }
            (0..around).map(|k| first + k % many).collect()
        })
        .collect();
    let mut triangles = Vec::new();
    for row in 0..if ring { rows.len() } else { rows.len() - 1 } {
        let (a, b) = (&rows[row], &rows[(row + 1) % rows.len()]);
        for k in 0..around as usize {
            let next = (k + 1) % around as usize;
            triangles.extend([[a[k], a[next], b[next]], [a[k], b[next], b[k]]]);
        }
    }
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    closed(points, triangles)
}

/// Cubes of a grid that share faces, as one surface.
fn blocks(cells: &[[i32; 3]], edge: f64) -> (Surface, Vec<String>) {
    let mut soup = Vec::new();
    for cell in cells {
        let middle = Vector3::from(cell.map(f64::from));
        for axis in 0..3 {
            for side in [-1, 1] {
                let mut other = *cell;
                other[axis] += side;
                if cells.contains(&other) {
                    continue;
                }
                let out = Vector3::ith(axis, 0.5 * f64::from(side));
                let (u, v) = (Vector3::ith((axis + 1) % 3, 0.5), Vector3::ith((axis + 2) % 3, 0.5));
                let v = v * f64::from(side);
                let [a, b, c, d] = [-u - v, u - v, u + v, v - u].map(|p| (middle + out + p) * edge);
                soup.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let (points, triangles) = joined(&soup);
    Surface::from_indexed(points, triangles).unwrap_or_else(|flaw| panic!("{flaw}"))
}

/// A ball with twelve blunt limbs.
fn star() -> (Surface, Vec<String>) {
    let mut ball = builtin::ellipsoid(Vector3::repeat(1.0), 3);
    let tips = builtin::ellipsoid(Vector3::repeat(1.0), 0).points;
    for p in &mut ball.points {
        let near = tips.iter().map(|tip| tip.dot(p)).fold(-1.0, f64::max);
        *p *= 0.2 + 0.3 * ((near - 1.0) / 0.04).exp();
    }
    closed(ball.points, ball.triangles)
}

/// A block as a scanner sees it: humps, hollows, and noise of the instrument.
fn scan() -> (Surface, Vec<String>) {
    let mut ball = builtin::ellipsoid(Vector3::repeat(1.0), 3);
    for (k, p) in ball.points.iter_mut().enumerate() {
        let hump = (5.0 * p.x + 1.0).sin() * (4.0 * p.y).cos() + 0.7 * (6.0 * p.z + 2.0 * p.x).sin();
        let noise = (12.9898 * k as f64).sin() * 43758.5453;
        *p *= 0.5 + 0.06 * hump + 0.004 * (noise - noise.floor() - 0.5);
        *p = p.component_mul(&Vector3::new(1.2, 0.9, 0.7));
    }
    closed(ball.points, ball.triangles)
}
