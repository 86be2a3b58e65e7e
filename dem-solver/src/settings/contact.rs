//! `[[contact]]`: the law between a rock and the wall, and its parameters.

use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use serde::{Deserialize, Serialize};

/// One `[[contact]]`. The wall is rigid; the rock's material is given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactSettings {
    /// Normal law: `hertz_mindlin` (force ~ overlap^1.5) or `linear` (force ~ overlap).
    pub law: LawName,
    /// Young's modulus of the rock [Pa]. `linear` takes it or `stiffness`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub young: Option<f64>,
    /// Poisson's ratio of the rock, 0 to 0.5. Needed with `young` and with friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// `linear` only: normal stiffness of a contact [N/m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// Restitution coefficient of one contact as measured, above 0 up to 1 (no dashpot is built at 1).
    /// Exactly one of `restitution` and `damping_ratio`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<f64>,
    /// Damping ratio g in `c = 2 g sqrt(m* k)`; 0: no dashpot is built.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_ratio: Option<f64>,
    /// Coulomb coefficient. Default 0: no tangential part is built.
    #[serde(default)]
    pub friction: f64,
    /// Which mass a contact's dashpot is scaled with. Default `local`.
    #[serde(default)]
    pub effective_mass: EffectiveMass,
}

/// Normal law of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LawName {
    /// Hertz normal and Mindlin tangential stiffness, both growing with the overlap.
    HertzMindlin,
    /// Constant stiffnesses.
    Linear,
}

/// Which mass m* a contact's dashpot is scaled with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectiveMass {
    /// The inertia met at the contact: the rock's share and the wire's, `1/m* = N_c/M + sum N_a^2/m_a`.
    /// Needs the nodal masses of the wall; costs nothing else.
    #[default]
    Local,
    /// The rock's whole mass in every contact, as the reference implementation does. Light wires get
    /// force spikes and need far shorter steps; N contacts damp sqrt(N) times as much.
    Rock,
}

impl ContactSettings {
    /// Refuse what makes no sense.
    pub(super) fn check(&self, scene: &Scene) -> Result<(), InputError> {
        let invalid = |key: &str, what: String| scene.invalid(&format!("contact.0.{key}"), what);
        match (self.law, self.young, self.stiffness) {
            (LawName::HertzMindlin, _, Some(_)) => {
                return Err(invalid(
                    "stiffness",
                    "the stiffness of `hertz_mindlin` follows from `young`".into(),
                )
                .try_instead("leave it out, or write law = \"linear\""));
            }
            (LawName::HertzMindlin, None, None) => {
                return Err(invalid("young", "`hertz_mindlin` needs `young` [Pa]".into()));
            }
            (LawName::Linear, Some(_), Some(_)) => {
                return Err(invalid("stiffness", "young and stiffness together say one thing twice".into())
                    .try_instead("keep one of them"));
            }
            (LawName::Linear, None, None) => {
                return Err(invalid("stiffness", "`linear` needs `stiffness` [N/m] or `young` [Pa]".into()));
            }
            _ => {}
        }
        for (key, value) in [("young", self.young), ("stiffness", self.stiffness)] {
            if let Some(v) = value.filter(|v| *v <= 0.0) {
                return Err(invalid(key, format!("{key} = {v}: it must lie above 0")));
            }
        }
        match self.poisson {
            Some(nu) if !(0.0..=0.5).contains(&nu) => {
                return Err(invalid("poisson", format!("a Poisson's ratio of {nu}: 0 to 0.5 is possible")));
            }
            None if self.young.is_some() || self.friction > 0.0 => {
                return Err(invalid(
                    "poisson",
                    "Poisson's ratio is needed with `young` and with friction".into(),
                )
                .try_instead("write poisson = 0.2 for rock"));
            }
            _ => {}
        }
        match (self.restitution, self.damping_ratio) {
            (Some(_), Some(_)) => {
                return Err(invalid(
                    "damping_ratio",
                    "restitution and damping_ratio say one thing twice".into(),
                )
                .try_instead("keep one of them"));
            }
            (None, None) => {
                return Err(invalid(
                    "restitution",
                    "the contact has neither restitution nor damping_ratio".into(),
                )
                .try_instead("restitution = 1 is a contact without a dashpot"));
            }
            (Some(e), None) if !(e > 0.0 && e <= 1.0) => {
                return Err(invalid(
                    "restitution",
                    format!("a restitution of {e}: above 0 up to 1 is possible"),
                ));
            }
            (None, Some(g)) if g < 0.0 => {
                return Err(invalid(
                    "damping_ratio",
                    format!("a damping ratio of {g}: it must be 0 or more"),
                ));
            }
            _ => {}
        }
        if self.friction < 0.0 {
            return Err(invalid(
                "friction",
                format!("a friction of {}: it must be 0 or more", self.friction),
            ));
        }
        Ok(())
    }
}
