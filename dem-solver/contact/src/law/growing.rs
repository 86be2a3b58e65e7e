//! Friction that grows while a rock is in touch with the ground, and falls back in flight.
//!
//! `mu(s) = mu_min + 2/pi (mu_max - mu_min) atan(kappa s)`: s grows by the distance travelled by the rock's centre while anything of it
//! touches the terrain, and decays with `exp(-beta t)` else. One s for the rock, whatever spheres touch.
//!
//! Source: Leine et al. (2014), Multibody Syst. Dyn. 32, 241; Lu et al. (2019), Rock Mech. Rock Eng. 52, 2343.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Growth of friction from the coefficient of [`crate::law::tangential`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growing {
    /// Coefficient that it grows to.
    pub most: f64,
    /// Rate over the distance [1/m].
    pub growth: f64,
    /// Rate at which s decays in flight [1/s].
    pub relaxation: f64,
}

impl Growing {
    /// Coefficient after the distance `slip` [m], from `least` on.
    #[inline]
    pub fn coefficient(&self, least: f64, slip: f64) -> f64 {
        least + 2.0 / PI * (self.most - least) * (self.growth * slip).atan()
    }
}

/// The s of a rock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Slip {
    /// When it last touched [m].
    value: f64,
    /// When that was [s].
    until: f64,
    /// Rate at which it decays since [1/s].
    relaxation: f64,
}

impl Slip {
    /// At `time` [s].
    #[inline]
    pub fn at(&self, time: f64) -> f64 {
        self.value * (-self.relaxation * (time - self.until).max(0.0)).exp()
    }

    /// The rock touches from `start` [s] for `h` [s] at `speed` [m/s]; what it touches lets go with `relaxation` [1/s].
    pub fn touch(&mut self, start: f64, h: f64, speed: f64, relaxation: f64) {
        *self = Self { value: self.at(start) + speed * h, until: start + h, relaxation };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of mu over 1.5 m on hard ground, 2.2270 m, and a block on 45 degrees whose friction has grown to 1 after
    /// 3.128 m: both in closed form.
    #[test]
    fn friction_over_the_way_has_the_published_values() {
        let hard = Growing { most: 2.0, growth: 3.0, relaxation: 185.0 };
        let parts = 100_000;
        let h = 1.5 / f64::from(parts);
        let sum: f64 = (0..parts).map(|k| hard.coefficient(0.55, h * (f64::from(k) + 0.5)) * h).sum();
        assert!((sum - 2.2270).abs() < 5e-5, "{sum}");
        let block = Growing { most: 1.3, growth: 0.7, relaxation: 0.0 };
        assert!((block.coefficient(0.2, 3.128) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn it_grows_with_the_way_and_decays_in_flight() {
        let mut slip = Slip::default();
        slip.touch(1.0, 0.02, 17.0, 185.0);
        assert!((slip.at(1.02) - 0.34).abs() < 1e-15);
        assert!((slip.at(1.03) / 0.34 - (-1.85_f64).exp()).abs() < 1e-12);
        slip.touch(1.03, 0.01, 10.0, 50.0);
        let kept = 0.34 * (-1.85_f64).exp() + 0.1;
        assert!(
            (slip.at(1.04) - kept).abs() < 1e-12 && (slip.at(1.06) / kept - (-1.0_f64).exp()).abs() < 1e-12
        );
    }
}
