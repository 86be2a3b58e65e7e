//! The terrain seen from above in light from the north-west, as an image.

use base64::Engine as _;

/// Direction from which the light comes: north-west, 45 degrees high.
const LIGHT: [f64; 3] = [-0.5, 0.5, std::f64::consts::FRAC_1_SQRT_2];

/// Heights at the middles of equal cells, row by row from the south.
pub struct ShadedGrid {
    /// West and south edge [m].
    pub corner: [f64; 2],
    /// Edge of a cell [m].
    pub cell: f64,
    /// Cells along x and y.
    pub counts: [usize; 2],
    /// Height of each [m], where there is terrain.
    pub heights: Vec<Option<f64>>,
}

impl ShadedGrid {
    /// Of `height`, from `lowest` to `highest` x and y, `most` cells along the longer side.
    pub fn new(
        [lowest, highest]: [[f64; 2]; 2],
        most: usize,
        height: &dyn Fn(f64, f64) -> Option<f64>,
    ) -> Self {
        let size = [highest[0] - lowest[0], highest[1] - lowest[1]];
        let cell = (size[0].max(size[1]) / most as f64).max(f64::MIN_POSITIVE);
        let counts = size.map(|s| ((s / cell).round() as usize).clamp(1, most));
        let middle = |n: usize, axis: usize| lowest[axis] + cell * (n as f64 + 0.5);
        let heights = (0..counts[1])
            .flat_map(|j| (0..counts[0]).map(move |i| (i, j)))
            .map(|(i, j)| height(middle(i, 0), middle(j, 1)))
            .collect();
        Self { corner: lowest, cell, counts, heights }
    }

    /// Height of a cell [m].
    pub fn at(&self, i: usize, j: usize) -> Option<f64> {
        if i < self.counts[0] && j < self.counts[1] { self.heights[j * self.counts[0] + i] } else { None }
    }

    /// Smallest and largest height [m].
    pub fn range(&self) -> Option<(f64, f64)> {
        let known = || self.heights.iter().flatten().copied();
        let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
        (low <= high).then_some((low, high))
    }

    /// Slope along an axis, from the neighbours that there are.
    fn slope(&self, [i, j]: [usize; 2], axis: usize, here: f64) -> f64 {
        let beside = |step: isize| {
            let mut at = [i, j];
            at[axis] = at[axis].checked_add_signed(step)?;
            self.at(at[0], at[1])
        };
        match (beside(-1), beside(1)) {
            (Some(a), Some(b)) => (b - a) / (2.0 * self.cell),
            (Some(a), None) => (here - a) / self.cell,
            (None, Some(b)) => (b - here) / self.cell,
            (None, None) => 0.0,
        }
    }

    /// Brightness of a cell, 0 to 255.
    fn brightness(&self, i: usize, j: usize) -> Option<u8> {
        let here = self.at(i, j)?;
        let normal = [-self.slope([i, j], 0, here), -self.slope([i, j], 1, here), 1.0];
        let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        let cosine = normal.iter().zip(LIGHT).map(|(n, l)| n * l).sum::<f64>() / length;
        Some((140.0 + 115.0 * cosine.max(0.0)).round().min(255.0) as u8)
    }

    /// A grey image, north up, as text for `href`; white where there is no terrain.
    pub fn image(&self) -> Result<String, png::EncodingError> {
        let [width, height] = self.counts;
        let shades: Vec<u8> = (0..height)
            .rev()
            .flat_map(|j| (0..width).map(move |i| self.brightness(i, j).unwrap_or(255)))
            .collect();
        href([width, height], &shades, |encoder| {
            encoder.set_color(png::ColorType::Grayscale);
            encoder.set_compression(png::Compression::High);
            encoder.set_filter(png::Filter::Adaptive);
        })
    }
}

/// Cells of colours with transparency, row by row from the north, as text for `href`.
///
/// # Errors
/// If there are not four bytes for each cell.
pub fn coloured(counts: [usize; 2], pixels: &[u8]) -> Result<String, png::EncodingError> {
    href(counts, pixels, |encoder| encoder.set_color(png::ColorType::Rgba))
}

fn href(
    [width, height]: [usize; 2],
    pixels: &[u8],
    set: impl FnOnce(&mut png::Encoder<&mut Vec<u8>>),
) -> Result<String, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_depth(png::BitDepth::Eight);
    set(&mut encoder);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes)))
}
