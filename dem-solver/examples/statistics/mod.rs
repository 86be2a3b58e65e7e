//! Quantiles of samples, and whether two samples are of one distribution.

/// The value below which `share` of them lie.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let at = share * (values.len() - 1) as f64;
    let (low, high) = (values[at.floor() as usize], values[at.ceil() as usize]);
    low + (high - low) * at.fract()
}

/// A quantile, with the values one standard error of its rank away.
pub fn with_error(values: &[f64], share: f64) -> String {
    let error = (share * (1.0 - share) / values.len() as f64).sqrt();
    let [low, value, high] =
        [share - error, share, (share + error).min(1.0)].map(|s| quantile(values, s.max(0.0)));
    format!("{value:.4} ({low:.4} to {high:.4})")
}

/// Largest distance of two distributions, and that which one pair of samples in twenty exceeds (Kolmogorov, Smirnov).
pub fn distance(a: &[f64], b: &[f64]) -> (f64, f64) {
    let below =
        |values: &[f64], x: f64| values.iter().filter(|v| **v <= x).count() as f64 / values.len() as f64;
    let most = a.iter().chain(b).map(|x| (below(a, *x) - below(b, *x)).abs()).fold(0.0, f64::max);
    (most, 1.36 * (1.0 / a.len() as f64 + 1.0 / b.len() as f64).sqrt())
}
