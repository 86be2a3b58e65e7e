//! Writes the generated terrain of `launch/scenes/site.toml`: 400 m down the slope (x), 80 m across (y), points 2 m apart.
//!
//! `cargo run --release -p dem-solver --example site -- launch/scenes/data/site.asc`
//!
//! The fall along x is 0.70, on a bench 0.06, below it 0.62, then 0.42, at the foot 0.05; from one to the next over some metres
//! as a logistic curve of 2 m. Across it lies a hollow of 0.0015 (y - 40 m)^2, and on all of it waves of 0.1 m: sine of 11 m
//! along, of 13 m across. Heights are rounded to centimetres.

use dem_solver::terrain::raster::Raster;
use std::f64::consts::TAU;
use std::path::Path;
use std::process::ExitCode;

/// Height at x = 0 in the middle [m].
const TOP: f64 = 1750.0;
/// Where a fall begins [m], and which.
const FALLS: [[f64; 2]; 5] = [[0.0, 0.70], [140.0, 0.06], [175.0, 0.62], [325.0, 0.42], [370.0, 0.05]];
/// Length of the logistic curve [m].
const BLEND: f64 = 2.0;

/// Height [m] at a place [m from the lower left corner].
fn height(x: f64, y: f64) -> f64 {
    // The integral of 1 / (1 + exp(-(x - at) / BLEND)) from 0.
    let after = |at: f64| BLEND * (((x - at) / BLEND).exp().ln_1p() - (-at / BLEND).exp().ln_1p());
    let bends: f64 = FALLS.windows(2).map(|pair| (pair[1][1] - pair[0][1]) * after(pair[1][0])).sum();
    let waves = 0.1 * (TAU * x / 11.0).sin() * (TAU * y / 13.0).sin();
    TOP - FALLS[0][1] * x - bends + waves + 0.0015 * (y - 40.0).powi(2)
}

fn main() -> ExitCode {
    let Some(file) = std::env::args().nth(1) else {
        eprintln!("error: name the file to write, as in site.asc");
        return ExitCode::from(2);
    };
    let (spacing, counts) = (2.0, [201, 41]);
    let at = |k: usize| spacing * k as f64;
    let row = |row: usize| {
        (0..counts[0]).map(move |i| (height(at(i), at(counts[1] - 1 - row)) * 100.0).round() / 100.0)
    };
    let heights = (0..counts[1]).flat_map(row).collect();
    let raster = Raster { corner: [2_600_000.0, 1_200_000.0], spacing: [spacing; 2], counts, heights };
    match raster.write_asc(Path::new(&file)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {file}: {e}");
            ExitCode::FAILURE
        }
    }
}
