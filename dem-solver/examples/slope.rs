//! Writes the generated slope that the project ships: 100 m long, 60 m wide, falls 60 m over three benches.
//!
//! `cargo run --release -p dem-solver --example slope -- launch/scenes/data/slope.asc`

use dem_solver::random::SplitMix;
use dem_solver::terrain::raster::Raster;
use std::path::Path;
use std::process::ExitCode;

#[path = "../tests/support/slope.rs"]
mod slope;
use slope::Slope;

fn main() -> ExitCode {
    let Some(file) = std::env::args().nth(1) else {
        eprintln!("error: name the file to write, as in slope.asc");
        return ExitCode::from(2);
    };
    let slope = Slope {
        corner: [2_600_000.0, 1_200_000.0],
        spacing: 0.5,
        counts: [241, 101],
        drop: 60.0,
        foot: 1_500.0,
        benches: 3,
        roughness: 0.05,
        seed: 1,
    };
    match slope.raster().write_asc(Path::new(&file)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {file}: {e}");
            ExitCode::FAILURE
        }
    }
}
