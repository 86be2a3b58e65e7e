//! Acceleration: the residual of one coupling iteration becomes the next iterate.

mod aitken;
mod anderson;
mod constant;
mod iqn_ils;
mod secants;

use crate::registry::registry;
pub use secants::Secants;

/// Turns the residual of one coupling iteration into the next iterate.
pub trait Acceleration {
    /// Forget the iterations of the window before; the next has so many unknowns at most.
    fn start_window(&mut self, _most: usize) {}

    /// Overwrite `x` with the next iterate, given `residual = H(x) - x` (same length, one unit: metres).
    ///
    /// `nodes` says whose numbers these are: ascending numbers of the structure's interface nodes. `x` consists of blocks
    /// (samples of displacement, then of velocity), each with three numbers for each of `nodes`. The nodes may differ
    /// between two iterations, the number of blocks may not.
    fn update(&mut self, x: &mut [f64], residual: &[f64], nodes: &[u32]);

    /// Relaxation factor used last.
    fn factor(&self) -> f64;

    /// What it takes from one window to the next, where it takes anything.
    fn memory(&mut self) -> Option<&mut Secants> {
        None
    }

    /// What is wrong with its settings, as key and reason.
    fn check(&self) -> Checked {
        Ok(())
    }
}

/// What is wrong with settings, as key and reason.
pub type Checked = Result<(), (&'static str, String)>;

/// The factor of the first iteration of each window.
fn check_first(key: &'static str, factor: f64) -> Checked {
    match factor > 0.0 && factor <= 1.0 {
        true => Ok(()),
        false => Err((key, format!("the first factor must lie in (0, 1], it is {factor}"))),
    }
}

registry! {
    /// Every acceleration that `[coupling.acceleration] type` may name.
    pub enum AnyAcceleration: Acceleration {
        "none" => constant::NoRelaxation,
        "constant" => constant::Constant,
        "aitken" => aitken::Aitken,
        "anderson" => anderson::Anderson,
        "iqn_ils" => iqn_ils::IqnIls,
    }
}

impl Default for AnyAcceleration {
    fn default() -> Self {
        Self::Aitken(Aitken::default())
    }
}

/// `x <- x + factor residual`.
fn relax(x: &mut [f64], residual: &[f64], factor: f64) {
    for (x, r) in x.iter_mut().zip(residual) {
        *x += factor * r;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Iterates of `x = 1 - 0.2 x` from 0.3, three equal unknowns.
    fn iterates(method: &mut dyn Acceleration) -> Vec<f64> {
        method.start_window(3);
        let mut x = [0.3; 3];
        (0..60)
            .map(|_| {
                let residual = x.map(|x| 1.0 - 1.2 * x);
                method.update(&mut x, &residual, &[0]);
                assert_eq!(x[0], x[1]);
                x[0]
            })
            .collect()
    }

    /// What every method must do, whichever are registered.
    #[test]
    fn each_converges_on_a_soft_interface_and_forgets_the_window_before() {
        for name in AnyAcceleration::NAMES {
            let text = format!("type = \"{name}\"");
            let mut method: AnyAcceleration = toml::from_str(&text).expect("defaults for every key");
            assert_eq!(method.check(), Ok(()), "{name}");
            let first = iterates(&mut *method);
            assert!((first[59] - 1.0 / 1.2).abs() < 1e-12, "{name}: {}", first[59]);
            assert_eq!(first, iterates(&mut *method), "{name}");
            assert!(method.factor() > 0.0, "{name}");
        }
    }
}
