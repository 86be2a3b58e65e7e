//! The law of contact between two materials.
//!
//! A law is put together from parts that the scene names; a part that it does not name is not built:
//! - [`normal`]: elastic force along the normal, and its stiffness
//! - [`damping`]: dashpot, from a restitution coefficient by way of [`restitution`]
//! - [`tangential`]: spring with Coulomb slip
//! - [`resistance`]: of a surface against rolling, [`rut`]: in ground that gives way; [`rolling`]: the same between rocks
//! - [`yielding`]: what ground that gives way remembers; [`growing`]: friction that grows with the distance on it; [`scarring`]: its drag
//!
//! [`contact_point`] applies the law to one contact, [`block`] to eight at a time; [`table`] knows which law a pair of
//! materials has, its moduli combined by [`elastic`].

pub mod block;
pub mod contact_point;
pub mod damping;
pub mod elastic;
pub mod growing;
pub mod normal;
pub mod presets;
pub mod resistance;
pub mod restitution;
pub mod rolling;
pub mod rut;
pub mod scarring;
pub mod settings;
pub mod table;
pub mod tangential;
pub mod yielding;

use damping::Damping;
use growing::Growing;
use normal::Normal;
use resistance::Resistance;
use rolling::Rolling;
use rut::Rut;
use scarring::Scarring;
use settings::{ContactSettings, EffectiveMass, RollingName};
use tangential::{Sliding, Tangential};
use yielding::Yielding;

/// A partner of a rock in contact.
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
    /// Of the rock as a whole ([`crate::contact::whole_rock`]).
    pub whole: bool,
    /// Dashpot; `None`: elastic.
    pub damping: Option<Damping>,
    /// What comes back of an impact, where the partner gives way; `None`: the normal force is elastic.
    pub yielding: Option<Yielding>,
    /// Friction; `None`: smooth.
    pub tangential: Option<Tangential>,
    /// Growth of friction on terrain; `None`: it does not grow.
    pub growing: Option<Growing>,
    /// Drag in the ground; `None`: none.
    pub scarring: Option<Scarring>,
    /// Rolling resistance of each contact, between rocks; `None`: they roll freely.
    pub rolling: Option<Rolling>,
    /// That of a surface, on the rock.
    pub resistance: Option<Resistance>,
}

impl Law {
    /// From the scene's table, which has been checked.
    pub fn new(settings: &ContactSettings, partner: PartnerKind) -> Self {
        let sides = settings.sides(partner);
        let normal = settings.law.build(&settings.own, sides.as_ref()).expect("the table has been checked");
        let yielding = normal.rule().map(|rule| Yielding {
            restitution: settings.restitution.expect("the table has been checked"),
            rule,
        });
        let ratio = match settings.restitution {
            _ if yielding.is_some() => 0.0,
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
        let rolls = settings.rolling_friction > 0.0;
        let rolling = (rolls && partner == PartnerKind::Rock).then(|| Rolling {
            kind: settings.rolling.unwrap_or(RollingName::Constant),
            friction: settings.rolling_friction,
            damping: settings.rolling_damping.unwrap_or(0.0),
            stiffening: normal.stiffening(),
        });
        let whole = settings.law.kind().whole;
        let growing = settings.friction_max.map(|most| Growing {
            most,
            growth: settings.friction_growth.expect("checked: beside friction_max"),
            relaxation: settings.friction_relaxation.expect("checked: beside friction_max"),
        });
        let scarring =
            settings.scarring_drag.filter(|_| whole && partner == PartnerKind::Surface).map(|drag| {
                Scarring { drag, density: settings.ground_density.unwrap_or(ContactSettings::GROUND_DENSITY) }
            });
        let pressure = normal.pressure().filter(|_| settings.rolling == Some(RollingName::Rut));
        let impact = settings.rolling_friction_impact.unwrap_or(0.0);
        let resists = rolls || pressure.is_some() || impact > 0.0;
        let resistance = (resists && partner == PartnerKind::Surface).then(|| Resistance {
            friction: settings.rolling_friction,
            impact,
            damping: settings.rolling_damping.unwrap_or(resistance::DAMPING),
            rut: pressure.map(|pressure| Rut { pressure }),
        });
        Self { normal, whole, damping, yielding, tangential, growing, scarring, rolling, resistance }
    }

    /// True if the forces depend on velocities.
    #[inline]
    pub fn needs_rates(&self) -> bool {
        self.damping.is_some() || self.tangential.is_some() || self.rolling.is_some()
    }

    /// True if contacts remember anything from step to step.
    #[inline]
    pub fn remembers(&self) -> bool {
        self.tangential.is_some() || self.rolling.is_some_and(|r| r.kind == RollingName::Spring)
    }

    /// In words, with numbers.
    pub fn describe(&self) -> String {
        let mut text = self.normal.describe();
        if self.whole {
            text += " of the rock as a whole";
        }
        text += &match (&self.damping, &self.yielding) {
            (_, Some(yielding)) => yielding.describe(),
            (Some(d), None) => {
                let whose = if d.mass == EffectiveMass::Local { "the local" } else { "the rock's whole" };
                format!(", damping ratio {:.6} scaled with {whose} mass", d.ratio)
            }
            (None, None) => ", no dashpot".into(),
        };
        text += &self.tangential.map_or(", no friction".into(), |t| format!(", friction {}", t.friction));
        if let Some(s) = self.tangential.and_then(|t| t.sliding) {
            text += &format!(" at rest and {} in slip", s.friction);
        }
        if let Some(g) = &self.growing {
            text += &format!(" that grows to {} over {} m and more", g.most, 1.0 / g.growth);
        }
        if let Some(s) = &self.scarring {
            text += &format!(", drag {} in ground of {} kg/m3", s.drag, s.density);
        }
        if let Some(r) = &self.resistance {
            text += &match r.rut {
                Some(_) => ", rolling resistance of its rut".into(),
                None => format!(", rolling friction {}", r.friction),
            };
            if r.impact > 0.0 {
                text += &format!(" and {} in impacts", r.impact);
            }
        }
        text
    }
}
