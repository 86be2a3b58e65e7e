//! A generated slope: a steep face above benches above a run-out, roughness from a seed. To try things out
//! on, and to measure with; the terrain that the project ships is made by it. Who includes it imports `Raster` and `SplitMix`.

use super::{Raster, SplitMix};

/// A slope that falls along x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Lower left corner [m].
    pub corner: [f64; 2],
    /// Distance of its points [m].
    pub spacing: f64,
    /// Points along x and y.
    pub counts: [usize; 2],
    /// Fall from the top to the flat run-out [m].
    pub drop: f64,
    /// Height of the foot [m].
    pub foot: f64,
    /// Number of benches.
    pub benches: usize,
    /// Standard deviation of the roughness [m], evenly spread over wavelengths of 2 to 32 points.
    pub roughness: f64,
    /// Seed of the roughness.
    pub seed: u64,
}

impl Slope {
    /// Height [m] at the fraction `s` of its length along x, 0 to 1, without roughness.
    ///
    /// The last quarter is flat. Before it, the smooth profile `(1 - s)^1.5` carries benches: a wave that
    /// takes away up to nine tenths of the slope, as often as there are benches.
    fn profile(&self, s: f64) -> f64 {
        let along = (s / 0.75).min(1.0);
        let turn = 2.0 * std::f64::consts::PI * self.benches as f64;
        let wave = if self.benches > 0 { 0.9 * (turn * along).sin() / turn } else { 0.0 };
        let t = (along - wave).clamp(0.0, 1.0);
        self.foot + self.drop * (1.0 - t).powf(1.5)
    }

    /// Its heights, rounded to millimetres.
    pub fn raster(&self) -> Raster {
        let [nx, ny] = self.counts;
        let mut heights = Vec::with_capacity(nx * ny);
        for row in 0..ny {
            let j = ny - 1 - row;
            for i in 0..nx {
                let s = i as f64 / (nx - 1).max(1) as f64;
                let z = self.profile(s) + self.rough(i, j);
                heights.push((z * 1000.0).round() / 1000.0);
            }
        }
        Raster { corner: self.corner, spacing: [self.spacing; 2], counts: self.counts, heights }
    }

    /// Value noise in five octaves of equal weight.
    fn rough(&self, i: usize, j: usize) -> f64 {
        let octave = |k: u32| {
            let cell = 2_usize << k;
            let (u, v) = ((i % cell) as f64 / cell as f64, (j % cell) as f64 / cell as f64);
            let ease = |t: f64| t * t * (3.0 - 2.0 * t);
            let (u, v) = (ease(u), ease(v));
            let at = |di: usize, dj: usize| self.random(k, i / cell + di, j / cell + dj);
            (at(0, 0) * (1.0 - u) + at(1, 0) * u) * (1.0 - v) + (at(0, 1) * (1.0 - u) + at(1, 1) * u) * v
        };
        // Evenly spread numbers from -1 to 1 have a variance of 1/3, interpolated ones some 0.55 of it.
        self.roughness * (0..5).map(octave).sum::<f64>() / (5.0_f64 * 0.55 / 3.0).sqrt()
    }

    /// A number from -1 to 1 that belongs to a corner of the noise.
    fn random(&self, octave: u32, i: usize, j: usize) -> f64 {
        let mut x = self.seed ^ (i as u64) << 32 ^ (j as u64) << 8 ^ u64::from(octave);
        for _ in 0..3 {
            x = SplitMix(x).bits();
        }
        (x >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
