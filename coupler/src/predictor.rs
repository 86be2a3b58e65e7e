//! Where the structure will be: the first iterate of a window.

/// Extrapolate displacement by `order` (0: it stays, 1: it goes on with its velocity) to `ahead` [s]
/// after the committed state. Source: handbook 3.2; order 2 gains nothing and fails earlier.
pub fn predict(order: u32, u: &[f64], v: &[f64], ahead: f64, predicted: &mut [f64]) {
    let step = if order == 0 { 0.0 } else { ahead };
    for ((p, u), v) in predicted.iter_mut().zip(u).zip(v) {
        *p = u + step * v;
    }
}
