//! Surface error of clusters against their number of spheres, for the built-in shapes; seconds of the processor.
//!
//! `cargo run --release -p dem-solver --example clusters [-- SHAPE...]`

use dem_solver::cluster::lattice::Lattice;
use dem_solver::cluster::{Accuracy, Fit, Wish, make};
use dem_solver::shape::Shape;
use interface_defs::ipc::serve::cpu_seconds;

const SHAPES: [&str; 8] = [
    "cube:0.41",
    "box:0.2,0.4,0.6",
    "sphere:0.2",
    "ead_block:0.41",
    "norm_rock_111:0.05",
    "norm_rock_221:0.05",
    "ellipsoid:0.3,0.2,0.15",
    "random_convex:0.5,0.4,0.3,7",
];
const NUMBERS: [u32; 5] = [64, 512, 1000, 4096, 20_000];

fn main() {
    let named: Vec<String> = std::env::args().skip(1).collect();
    let shapes = if named.is_empty() { SHAPES.map(String::from).to_vec() } else { named };
    println!(
        "lengths in mm; order: of the largest error, from the line above, against N\n{:28} {:>6} {:>9} {:>9} {:>9} {:>9} {:>8} {:>9} {:>6} {:>7} {:>7}",
        "shape",
        "N",
        "to mean",
        "to max",
        "back mean",
        "back max",
        "vol %",
        "smallest",
        "order",
        "make s",
        "meas. s"
    );
    for name in &shapes {
        let shape = Shape::parse(name, 1.0).unwrap_or_else(|e| panic!("{e}"));
        let (surface, _) = shape.surface(false).unwrap_or_else(|e| panic!("{e}"));
        let mut last: Option<(f64, f64)> = None;
        let mut line = |label: &str, spheres: Vec<dem_solver::geometry::sphere::Sphere>, made: f64| {
            let start = cpu_seconds();
            let found = Accuracy::of(&surface, &spheres);
            let n = spheres.len() as f64;
            let order = last.map_or(f64::NAN, |(m, e): (f64, f64)| (e / found.largest()).ln() / (n / m).ln());
            last = Some((n, found.largest()));
            let smallest = spheres.iter().map(|s| s.radius).fold(f64::INFINITY, f64::min);
            println!(
                "{label:28} {:6} {:9.4} {:9.4} {:9.4} {:9.4} {:8.3} {:9.4} {order:6.2} {made:7.2} {:7.2}",
                spheres.len(),
                1e3 * found.surface_to_spheres.mean,
                1e3 * found.surface_to_spheres.max,
                1e3 * found.spheres_to_surface.mean,
                1e3 * found.spheres_to_surface.max,
                100.0 * found.volume,
                1e3 * smallest,
                cpu_seconds() - start
            );
        };
        for spheres in if matches!(shape, Shape::Sphere { .. }) { &NUMBERS[..1] } else { &NUMBERS } {
            let spheres = *spheres;
            let start = cpu_seconds();
            let wish = Wish { spheres, fit: Fit::default(), smallest_radius: 0.0 };
            let made = make(&surface, &wish, |_| ());
            line(name, made, cpu_seconds() - start);
        }
        if let Shape::Box { size } = shape {
            for along in [4_u32, 10, 27] {
                line("  as a lattice", Lattice::within(size, along.pow(3)).expect("fits").spheres(), 0.0);
            }
        }
    }
}
