//! The contact of a rock with the wall.
//!
//! A law is put together from parts that the scene names; a part that it does not name is not built:
//! - [`normal`]: elastic force along the normal, and its stiffness
//! - [`damping`]: dashpot, from a restitution coefficient by way of [`restitution`]
//! - [`tangential`]: incremental spring with Coulomb slip, whose history is the [`memory`]
//!
//! [`evaluate`] applies the law to all contacts of one rock at one instant; [`touch`] finds them.

pub mod damping;
pub mod evaluate;
pub mod memory;
pub mod normal;
pub mod restitution;
pub mod tangential;
pub mod touch;

use crate::settings::{ContactSettings, EffectiveMass};
use damping::Damping;
use normal::Normal;
use tangential::Tangential;

/// The law of every contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// Elastic force along the normal.
    pub normal: Normal,
    /// Dashpot; `None`: elastic.
    pub damping: Option<Damping>,
    /// Friction; `None`: smooth.
    pub tangential: Option<Tangential>,
}

impl Law {
    /// From the scene's table, which has been checked.
    pub fn new(settings: &ContactSettings) -> Self {
        let normal = Normal::new(settings);
        let ratio = match settings.restitution {
            Some(e) => normal.damping_ratio(e),
            None => settings.damping_ratio.unwrap_or(0.0),
        };
        let damping = (ratio > 0.0).then_some(Damping { ratio, mass: settings.effective_mass });
        let tangential = (settings.friction > 0.0).then(|| {
            Tangential::new(settings.friction, settings.poisson.expect("checked: friction needs it"))
        });
        Self { normal, damping, tangential }
    }

    /// The same with the rock's whole mass in every dashpot: for a wall whose masses are not told.
    pub fn without_local_masses(mut self) -> Self {
        if let Some(damping) = &mut self.damping {
            damping.mass = EffectiveMass::Rock;
        }
        self
    }

    /// In words, with numbers.
    pub fn describe(&self) -> String {
        let mut text = self.normal.describe();
        match &self.damping {
            Some(d) => {
                text += &format!(
                    ", damping ratio {:.6} scaled with {} mass",
                    d.ratio,
                    match d.mass {
                        EffectiveMass::Local => "the local",
                        EffectiveMass::Rock => "the rock's whole",
                    }
                )
            }
            None => text += ", no dashpot",
        }
        match &self.tangential {
            Some(t) => text += &format!(", friction {}", t.friction),
            None => text += ", no friction",
        }
        text
    }
}
