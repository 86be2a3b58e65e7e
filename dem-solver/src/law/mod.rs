//! The law of contact between two materials.
//!
//! A law is put together from parts that the scene names; a part that it does not name is not built:
//! - [`normal`]: elastic force along the normal, and its stiffness
//! - [`damping`]: dashpot, from a restitution coefficient by way of [`restitution`]
//! - [`tangential`]: spring with Coulomb slip
//! - [`rolling`]: resistance against rolling
//!
//! [`contact_point`] applies the law to one contact, [`block`] to eight at a time; [`table`] knows which law a pair of
//! materials has, its moduli combined by [`elastic`].

pub mod block;
pub mod contact_point;
pub mod damping;
pub mod elastic;
pub mod normal;
pub mod own_keys;
pub mod restitution;
pub mod rolling;
pub mod settings;
pub mod table;
pub mod tangential;

use damping::Damping;
use normal::{LawName, Normal};
use rolling::Rolling;
use settings::{ContactSettings, EffectiveMass, RollingName};
use tangential::{Sliding, Tangential};

/// What a rock touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartnerKind {
    /// A surface (net, terrain, side of a box): rigid where the scene gives it no modulus.
    Surface,
    /// Another rock: as the first where the scene gives it no modulus.
    Rock,
}

/// The law of one pair of materials.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// Elastic force along the normal.
    pub normal: Normal,
    /// On terrain: of the rock as a whole ([`crate::contact::whole_rock`]).
    pub whole: bool,
    /// Dashpot; `None`: elastic.
    pub damping: Option<Damping>,
    /// Friction; `None`: smooth.
    pub tangential: Option<Tangential>,
    /// Rolling resistance; `None`: it rolls freely.
    pub rolling: Option<Rolling>,
}

impl Law {
    /// From the scene's table, which has been checked.
    pub fn new(settings: &ContactSettings, partner: PartnerKind) -> Self {
        let sides = settings.sides(partner);
        let normal = settings.law.build(&settings.own, sides.as_ref()).expect("the table has been checked");
        let ratio = match settings.restitution {
            Some(e) => normal.damping_ratio(e),
            None => settings.damping_ratio.unwrap_or(0.0),
        };
        let damping = (ratio > 0.0).then_some(Damping { ratio, mass: settings.effective_mass });
        let tangential = (settings.friction > 0.0).then(|| Tangential {
            friction: settings.friction,
            stiffness_ratio: settings.stiffness_ratio.unwrap_or_else(|| match &sides {
                Some(sides) => sides.stiffness_ratio(),
                None => elastic::stiffness_ratio(settings.poisson.expect("checked: friction needs it")),
            }),
            history: settings.tangential,
            stiffening: normal.stiffening(),
            sliding: settings.friction_dynamic.map(|friction| Sliding {
                friction,
                decay: settings.friction_decay.unwrap_or(ContactSettings::FRICTION_DECAY),
            }),
        });
        let rolling = (settings.rolling_friction > 0.0).then(|| Rolling {
            kind: settings.rolling.unwrap_or(RollingName::Constant),
            friction: settings.rolling_friction,
            damping: settings.rolling_damping.unwrap_or(0.0),
            stiffening: normal.stiffening(),
        });
        let whole = settings.law == LawName::HertzRock && partner == PartnerKind::Surface;
        Self { normal, whole, damping, tangential, rolling }
    }

    /// Whether the forces depend on velocities.
    pub fn needs_rates(&self) -> bool {
        self.damping.is_some() || self.tangential.is_some() || self.rolling.is_some()
    }

    /// Whether contacts remember anything from step to step.
    pub fn remembers(&self) -> bool {
        self.tangential.is_some() || self.rolling.is_some_and(|r| r.kind == RollingName::Spring)
    }

    fn use_rocks_mass(&mut self) {
        if let Some(damping) = &mut self.damping {
            damping.mass = EffectiveMass::Rock;
        }
    }

    /// In words, with numbers.
    pub fn describe(&self) -> String {
        let mut text = self.normal.describe();
        if self.whole {
            text += " of the rock as a whole with terrain";
        }
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
            Some(t) => {
                text += &format!(", friction {}", t.friction);
                if let Some(s) = &t.sliding {
                    text += &format!(" at rest and {} in slip", s.friction);
                }
            }
            None => text += ", no friction",
        }
        if let Some(r) = &self.rolling {
            text += &format!(", rolling friction {}", r.friction);
        }
        text
    }
}
