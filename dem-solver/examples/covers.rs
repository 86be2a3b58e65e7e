//! Clusters of 20 solids with 6 numbers of spheres: the error that is stated, and what points sampled on both
//! surfaces show; or the refusal.
//!
//! `cargo run --release -p dem-solver --example covers [-- N,N,... [SOLID...]]`

#[path = "../tests/behaviour/sampled.rs"]
mod sampled;
#[path = "../tests/behaviour/solids.rs"]
mod solids;

use dem_solver::cluster::{Bound, Fit, Wish, measured};
use interface_defs::ipc::serve::cpu_seconds;
use sampled::Sampled;

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

fn main() {
    let mut arguments = std::env::args().skip(1);
    let numbers: Vec<u32> = arguments.next().map_or(NUMBERS.to_vec(), |list| {
        list.split(',').map(|n| n.parse().unwrap_or_else(|e| panic!("{n}: {e}"))).collect()
    });
    let named: Vec<String> = arguments.collect();
    let solids = if named.is_empty() { SOLIDS.map(String::from).to_vec() } else { named };
    println!(
        "| solid | size [m] | N | made | largest: stated [mm] | sampled [mm] | of size [%] | bound [mm] | mean [mm] | volume [%] | s | |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for name in &solids {
        let surface = solids::solid(name);
        let bound = Bound::of(&surface, None);
        for asked in &numbers {
            let start = cpu_seconds();
            let wish = Wish { spheres: *asked, fit: Fit::Volume, smallest_radius: 0.0 };
            let (made, found) = measured(&surface, &wish, |_| ());
            let seconds = cpu_seconds() - start;
            let sampled = Sampled::of(&surface, &made);
            println!(
                "| {name} | {:.2} | {asked} | {} | {:.2} | {:.2} | {:.3} | {:.1} | {:.2} | {:+.2} | {seconds:.1} | {} |",
                surface.size(),
                made.len(),
                1e3 * found.largest(),
                1e3 * sampled.largest(),
                100.0 * found.largest() / surface.size(),
                1e3 * bound.largest,
                1e3 * found.surface_to_spheres.mean.max(found.spheres_to_surface.mean),
                100.0 * found.volume,
                if bound.passed(&made, &found, Fit::Volume).is_some() { "refused" } else { "" }
            );
        }
    }
}
