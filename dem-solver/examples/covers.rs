//! Clusters of 20 solids with 6 numbers of spheres: the error that is stated, and what points sampled on both
//! surfaces show; or the refusal.
//!
//! `cargo run --release -p dem-solver --example covers [-- N,N,... [SOLID...]]`

#[path = "../tests/behaviour/solids.rs"]
mod solids;

use dem_solver::cluster::{Accuracy, Bound, Fit, Wish, make};
use dem_solver::rock::Sphere;
use dem_solver::shape::Surface;
use interface_defs::ipc::serve::cpu_seconds;
use nalgebra::Vector3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;

const SOLIDS: [&str; 20] = [
    "cube:0.41",
    "box:0.2,0.4,0.6",
    "box:2,1,0.2",
    "box:2,1,0.1",
    "box:2,0.2,0.2",
    "sphere:0.2",
    "ellipsoid:0.3,0.2,0.15",
    "ellipsoid:1,0.1,0.1",
    "ead_block:0.41",
    "norm_rock_221:0.05",
    "random_convex:0.5,0.4,0.3,7",
    "disc",
    "column",
    "ring",
    "pipe",
    "bowl",
    "L",
    "jack",
    "star",
    "scan",
];
const NUMBERS: [u32; 6] = [8, 64, 300, 1000, 4000, 20_000];

/// Points on all spheres.
const POINTS: usize = 100_000;

/// The largest distance that samples show: of points of the solid's surface outside of all spheres from the nearest of
/// these, and of points of spheres outside of all others from that surface, if nothing lies between: what is closed in
/// between spheres touches nothing. A library measures distances to the surface, each sphere is looked at.
fn sampled(surface: &Surface, spheres: &[Sphere]) -> f64 {
    let points: Vec<Vector> = surface.points.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
    let mesh = TriMesh::new(points, surface.triangles.clone()).expect("a mesh");
    let nearest = |p: &Vector3<f64>| {
        let found = mesh.project_local_point(Vector::new(p.x, p.y, p.z), false).point;
        Vector3::new(found.x, found.y, found.z)
    };
    let free = |from: &Vector3<f64>, to: &Vector3<f64>, own: usize| {
        let way = to - from;
        spheres.iter().enumerate().filter(|(k, _)| *k != own).all(|(_, s)| {
            let share = (way.dot(&(s.centre - from)) / way.norm_squared()).clamp(0.0, 1.0);
            (from + way * share - s.centre).norm() >= s.radius
        })
    };
    let gap = |p: &Vector3<f64>, except: usize| {
        let each = spheres.iter().enumerate().filter(|(k, _)| *k != except);
        each.map(|(_, s)| (p - s.centre).norm() - s.radius).fold(f64::INFINITY, f64::min)
    };
    let mut largest = 0.0_f64;
    let many = (POINTS / spheres.len()).clamp(5, 1000);
    for (own, sphere) in spheres.iter().enumerate() {
        for k in 0..many {
            let z = 1.0 - (2 * k + 1) as f64 / many as f64;
            let angle = 2.399_963 * k as f64;
            let r = (1.0 - z * z).sqrt();
            let p = sphere.centre + Vector3::new(r * angle.cos(), r * angle.sin(), z) * sphere.radius;
            let touch = nearest(&p);
            let distance = (touch - p).norm();
            // Only what could be the largest is looked at.
            if distance > largest && gap(&p, own) > 0.0 && free(&p, &touch, own) {
                largest = distance;
            }
        }
    }
    let total: f64 = (0..surface.triangles.len()).map(|t| surface.area(t)).sum();
    for t in 0..surface.triangles.len() {
        let [a, b, c] = surface.corners(t);
        let rows = ((surface.area(t) / total * 8000.0).sqrt().ceil() as usize).max(2);
        for i in 0..=rows {
            for j in 0..=rows - i {
                let p = a + (b - a) * (i as f64 / rows as f64) + (c - a) * (j as f64 / rows as f64);
                largest = largest.max(gap(&p, usize::MAX));
            }
        }
    }
    largest
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let numbers: Vec<u32> = arguments.next().map_or(NUMBERS.to_vec(), |list| {
        list.split(',').map(|n| n.parse().unwrap_or_else(|e| panic!("{n}: {e}"))).collect()
    });
    let named: Vec<String> = arguments.collect();
    let solids = if named.is_empty() { SOLIDS.map(String::from).to_vec() } else { named };
    println!(
        "| solid | size [m] | asked | made | stated [mm] | sampled [mm] | bound [mm] | volume [%] | s | |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for name in &solids {
        let surface = solids::solid(name);
        let bound = Bound::of(&surface, None);
        for asked in &numbers {
            let start = cpu_seconds();
            let made =
                make(&surface, &Wish { spheres: *asked, fit: Fit::Volume, smallest_radius: 0.0 }, |_| ());
            let found = Accuracy::of(&surface, &made);
            let seconds = cpu_seconds() - start;
            println!(
                "| {name} | {:.2} | {asked} | {} | {:.2} | {:.2} | {:.1} | {:+.2} | {seconds:.1} | {} |",
                surface.size(),
                made.len(),
                1e3 * found.largest(),
                1e3 * sampled(&surface, &made),
                1e3 * bound.largest,
                100.0 * found.volume,
                if bound.passed(&made, &found, Fit::Volume).is_some() { "refused" } else { "" }
            );
        }
    }
}
