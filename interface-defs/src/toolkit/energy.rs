//! The balance of energy, from gauges by their role.

use crate::message::{Gauge, Role};

/// Follows kinetic + potential + stored + dissipated energy less received work, which is constant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Balance {
    roles: Vec<Role>,
    initial: f64,
    /// Largest departure from the initial sum so far [J].
    pub imbalance: f64,
    /// Largest kinetic energy so far [J].
    pub kinetic: f64,
}

impl Balance {
    /// Balance of `gauges`, whose values at the start are `initial`; `None` if none has a role.
    pub fn new(gauges: &[Gauge], initial: impl IntoIterator<Item = f64>) -> Option<Self> {
        let roles: Vec<Role> = gauges.iter().map(|g| g.role).collect();
        if roles.iter().all(|r| *r == Role::None) {
            return None;
        }
        let mut balance = Self { roles, ..Self::default() };
        let (sum, kinetic) = balance.sums(initial);
        balance.initial = sum;
        balance.kinetic = kinetic;
        Some(balance)
    }

    /// Take in the values of the gauges at a later time.
    pub fn update(&mut self, values: impl IntoIterator<Item = f64>) {
        let (sum, kinetic) = self.sums(values);
        self.imbalance = self.imbalance.max((sum - self.initial).abs());
        self.kinetic = self.kinetic.max(kinetic);
    }

    /// Largest imbalance over largest kinetic energy; `None` where nothing has moved.
    pub fn error(&self) -> Option<f64> {
        (self.kinetic > 0.0).then(|| self.imbalance / self.kinetic)
    }

    fn sums(&self, values: impl IntoIterator<Item = f64>) -> (f64, f64) {
        let mut sums = (0.0, 0.0);
        for (role, value) in self.roles.iter().zip(values) {
            match role {
                Role::None => {}
                Role::Received => sums.0 -= value,
                Role::Potential | Role::Stored | Role::Dissipated => sums.0 += value,
                Role::Kinetic => {
                    sums.0 += value;
                    sums.1 += value;
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_departure_counts_relative_to_the_largest_kinetic_energy() {
        let gauge = |role| Gauge { role, ..Gauge::new("x", "J") };
        let gauges = [gauge(Role::Kinetic), gauge(Role::None), gauge(Role::Potential), gauge(Role::Received)];
        let mut balance = Balance::new(&gauges, [0.0, 7.0, 10.0, 0.0]).expect("has roles");
        assert_eq!(balance.error(), None);
        balance.update([8.0, 99.0, 1.0, 0.0]);
        balance.update([5.0, 0.0, 9.0, 4.0]);
        assert_eq!((balance.imbalance, balance.kinetic, balance.error()), (1.0, 8.0, Some(0.125)));
        assert_eq!(Balance::new(&[gauge(Role::None)], [1.0]), None);
    }
}
