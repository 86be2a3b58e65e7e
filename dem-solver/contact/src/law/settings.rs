//! `[[contact]]`: the law of a pair of materials, and its parameters.

use super::PartnerKind;
use super::elastic::Elastic;
use super::normal::LawName;
use super::own_keys::{self, Split};
use super::presets;
use interface_defs::diagnostic::{Diagnostic, code};
use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toolkit::scene::Scene;

// Keys that one law alone has are set aside in `own`, and read by that law.

/// The contact law of a pair of materials. A net and a terrain are rigid unless their modulus is given; two rocks in
/// contact are both elastic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", deny_unknown_fields)]
#[schemars(transform = with_own_keys)]
pub struct ContactSettings {
    /// Names of the two materials: that of the rock first, if the other is that of net, terrain or box. Default: every
    /// pair that no other table names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between: Option<[String; 2]>,
    /// Kind of ground whose values fill in what the table does not say: `bedrock`, `scree`, `meadow`, `soil`, `wetland` or
    /// `forest`, of `law = "ground"`. None is calibrated: docs/ground.md.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Normal law: `hertz_rock` (force ~ overlap^1.5 of the rock as a whole: does not depend on the number of spheres; for
    /// terrain), `hertz_mindlin` (the same of each sphere by its own radius), `linear` (force ~ overlap) or `ground` (terrain that
    /// gives way and remembers it; see docs/ground.md).
    pub law: LawName,
    /// Young's modulus of the rock [Pa]. `linear` takes it or `stiffness`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub young: Option<f64>,
    /// Poisson's ratio of the rock, 0 to 0.5. Needed with `young` and with friction (unless
    /// `stiffness_ratio` is given).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// Young's modulus of the other side [Pa]. Default: net and terrain are rigid, another rock is as `young`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partner_young: Option<f64>,
    /// Poisson's ratio of the other side. Needed with `partner_young`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partner_poisson: Option<f64>,
    /// Restitution coefficient of one contact as measured, above 0 up to 1 (no dashpot is built at 1).
    /// Exactly one of `restitution` and `damping_ratio`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<f64>,
    /// Damping ratio g in `c = 2 g sqrt(m* k)`; 0: no dashpot is built.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_ratio: Option<f64>,
    /// Coulomb coefficient (at rest, if `friction_dynamic` is given). Default 0: no tangential part is built.
    #[serde(default)]
    pub friction: f64,
    /// Coulomb coefficient in fast slip: `mu_d + (mu - mu_d) exp(-decay |v_t|)`. Default: as `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_dynamic: Option<f64>,
    /// How fast friction falls from `friction` to `friction_dynamic` [s/m]. Default 500.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_decay: Option<f64>,
    /// Terrain: coefficient to which friction grows with the distance s that the rock's centre travels in contact,
    /// `mu(s) = mu + 2/pi (mu_max - mu) atan(kappa s)`; in flight s decays with `exp(-beta t)`. Default: it does not grow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_max: Option<f64>,
    /// kappa of `friction_max` [1/m]. Required beside it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_growth: Option<f64>,
    /// beta of `friction_max` [1/s]. Required beside it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_relaxation: Option<f64>,
    /// Terrain, `ground` and `hertz_rock`: drag coefficient C of the ground that the rock ploughs through while it touches,
    /// `C rho A v^2 / 2` with the outline A below the surface. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scarring_drag: Option<f64>,
    /// Density of the ground for `scarring_drag` [kg/m3]. Default 1700.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground_density: Option<f64>,
    /// How the tangential spring follows the overlap. Default `unloading_scaled`, the one of the three
    /// that never creates energy.
    #[serde(default, skip_serializing_if = "TangentialName::is_default")]
    pub tangential: TangentialName,
    /// Tangential over normal stiffness. Default: Mindlin's, from the Poisson's ratios.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness_ratio: Option<f64>,
    /// Rolling resistance: limit of its moment over radius and normal force. Default 0: none is built.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rolling_friction: f64,
    /// Kind of rolling resistance. Default `constant`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rolling: Option<RollingName>,
    /// Damping ratio of the spring of `rolling = "spring"`. Default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rolling_damping: Option<f64>,
    /// Which mass a contact's dashpot is scaled with. Default `local`.
    #[serde(default)]
    pub effective_mass: EffectiveMass,
    /// The keys that the law alone has.
    #[serde(skip_deserializing, flatten)]
    #[schemars(skip)]
    pub own: toml::Table,
}

impl<'de> Deserialize<'de> for ContactSettings {
    fn deserialize<D: Deserializer<'de>>(table: D) -> Result<Self, D::Error> {
        let mut own = toml::Table::new();
        let common = Self::deserialize(Split { table, own: &mut own })?;
        Ok(Self { own, ..common })
    }
}

impl Serialize for ContactSettings {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, to)
    }
}

/// Adds to the schema the keys that one law alone has.
fn with_own_keys(schema: &mut Schema) {
    let Some(properties) = schema.get_mut("properties").and_then(|all| all.as_object_mut()) else { return };
    for law in LawName::ALL {
        let keys = law.keys();
        for (key, value) in keys.get("properties").and_then(|all| all.as_object()).into_iter().flatten() {
            let mut value = value.clone();
            let meaning = value.get("description").and_then(|text| text.as_str()).unwrap_or_default();
            value["description"] = format!("`law = \"{}\"` only. {meaning}", law.name()).into();
            properties.insert(key.clone(), value);
        }
    }
}

/// Least restitution that is computed.
const LEAST_RESTITUTION: f64 = 1e-6;

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// How the tangential spring follows the overlap.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TangentialName {
    /// The force changes by the increments of slip alone.
    Incremental,
    /// The same, and shrinks with the contact area as the contact unloads.
    #[default]
    UnloadingScaled,
    /// The force is the present stiffness times the slip since the touch.
    Secant,
}

impl TangentialName {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Kind of rolling resistance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RollingName {
    /// A moment of constant size against the spin (type A).
    Constant,
    /// A spring and a dashpot up to that moment (type C): it holds a rock at rest on a slope.
    Spring,
    /// `law = "ground"` with `ground_pressure` p: that of the rut, in place of `rolling_friction`. Only the front half of the print
    /// carries a rock that rolls on: `mu_r = 4 a / (3 pi R)` with `a = sqrt(2 F / (pi p))`.
    Rut,
}

/// Which mass m* a contact's dashpot is scaled with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EffectiveMass {
    /// The inertia that acts at the contact: the rock's share and the wire's, `1/m* = N_c/M + sum N_a^2/m_a`.
    /// Needs the nodal masses of the net; costs nothing else.
    #[default]
    Local,
    /// The rock's whole mass in every contact, as the reference implementation does. Light wires get
    /// force spikes and need far shorter steps; N contacts damp sqrt(N) times as much.
    Rock,
}

impl ContactSettings {
    /// Decay of friction where the scene does not say [s/m].
    pub const FRICTION_DECAY: f64 = 500.0;
    /// Density of the ground where the scene does not say [kg/m3].
    pub const GROUND_DENSITY: f64 = 1700.0;

    /// Refuse what makes no sense; this is table number `number`.
    pub(super) fn check(&self, scene: &Scene, number: usize) -> Result<(), Diagnostic> {
        let invalid = |key: &str, what: String| scene.invalid(&format!("contact.{number}.{key}"), what);
        if let Some(name) = &self.preset {
            let known = presets::ALL.map(|preset| preset.name).join(", ");
            if presets::named(name).is_none() {
                return Err(invalid("preset", format!("there is no ground `{name}`")).try_instead(known));
            }
            if self.law != LawName::Ground {
                let what =
                    format!("the preset `{name}` is of law = \"ground\", and this is `{}`", self.law.name());
                return Err(invalid("preset", what).try_instead("leave `preset` or `law` out"));
            }
        }
        let as_a_whole = matches!(self.law, LawName::HertzRock | LawName::Ground);
        if as_a_whole && self.effective_mass == EffectiveMass::Rock {
            let what = format!("`{}` knows the mass that its force acts on", self.law.name());
            return Err(invalid("effective_mass", what).try_instead("leave it out"));
        }
        if self.law == LawName::Ground && self.damping_ratio.is_some() {
            let what = "`ground` has no dashpot that this could be the ratio of".into();
            return Err(invalid("damping_ratio", what)
                .try_instead("write restitution, that of a slow impact: 0.25 on soft soil, 0.5 on bedrock"));
        }
        let above_zero = [
            ("young", self.young),
            ("partner_young", self.partner_young),
            ("stiffness_ratio", self.stiffness_ratio),
            ("friction_max", self.friction_max),
            ("friction_growth", self.friction_growth),
            ("scarring_drag", self.scarring_drag),
            ("ground_density", self.ground_density),
        ];
        for (key, value) in above_zero {
            if let Some(v) = value.filter(|v| *v <= 0.0) {
                return Err(invalid(key, format!("{key} = {v}: it must lie above 0")));
            }
        }
        self.check_law(scene, number)?;
        self.check_numbers(&invalid)?;
        let not_negative = [
            ("friction", Some(self.friction)),
            ("friction_dynamic", self.friction_dynamic),
            ("friction_decay", self.friction_decay),
            ("friction_relaxation", self.friction_relaxation),
            ("rolling_friction", Some(self.rolling_friction)),
            ("rolling_damping", self.rolling_damping),
        ];
        for (key, value) in not_negative {
            if let Some(v) = value.filter(|v| *v < 0.0) {
                let words = key.replace('_', " ");
                return Err(invalid(key, format!("a {words} of {v}: it must be 0 or more"))
                    .try_instead(format!("turn its sign round: {key} = {}", -v)));
            }
        }
        self.check_sides(&invalid)?;
        self.check_parts(&invalid)
    }

    /// `ground_pressure` of `law = "ground"` [Pa].
    pub(super) fn ground_pressure(&self) -> Option<f64> {
        let value = self.own.get("ground_pressure").filter(|_| self.law == LawName::Ground)?;
        value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
    }

    /// What only the law knows.
    fn check_law(&self, scene: &Scene, number: usize) -> Result<(), Diagnostic> {
        let place = |key: &str| format!("contact.{number}.{key}");
        let invalid = |key: &str, what: String| scene.invalid(&place(key), what);
        let name = self.law.name();
        let own = own_keys::of(self.law);
        if let Some(key) = self.own.keys().find(|key| !own.contains(*key)) {
            let owner = own_keys::owner(key).expect("others are refused when read").name();
            return Err(invalid(key, format!("`{key}` belongs to law = \"{owner}\", and this is `{name}`"))
                .try_instead(format!("leave it out, or write law = \"{owner}\"")));
        }
        // A Poisson's ratio that is missing is asked for later.
        let sides =
            self.young.map(|young| Elastic { own: (young, self.poisson.unwrap_or(0.0)), other: None });
        if matches!(self.law, LawName::HertzRock | LawName::HertzMindlin) && sides.is_none() {
            return Err(invalid("young", format!("`{name}` needs `young` [Pa]")));
        }
        self.law.build(&self.own, sides.as_ref()).map(drop).map_err(|refusal| {
            let code = if refusal.misread { code::WRONG_TYPE } else { code::INVALID_VALUE };
            invalid(&refusal.key, refusal.what).coded(code).try_if(refusal.cure)
        })
    }

    /// The moduli of both sides; `None` without `young`.
    pub fn sides(&self, partner: PartnerKind) -> Option<Elastic> {
        let own = self.young.zip(self.poisson)?;
        let given = self.partner_young.zip(self.partner_poisson);
        Some(Elastic { own, other: given.or((partner == PartnerKind::Rock).then_some(own)) })
    }

    /// What the force is in proportion to: the key and its value, if the table has one.
    pub fn strength(&self) -> Option<(&str, f64)> {
        let number =
            |value: &toml::Value| value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
        let own = || {
            let mut stiff = self.own.iter().filter(|(key, _)| !key.starts_with("restitution"));
            stiff.find_map(|(key, value)| Some((key.as_str(), number(value)?)))
        };
        self.young.map(|young| ("young", young)).or_else(own)
    }

    /// Poisson's ratio, restitution and damping ratio.
    fn check_numbers(&self, invalid: &dyn Fn(&str, String) -> Diagnostic) -> Result<(), Diagnostic> {
        match self.poisson {
            Some(nu) if !(0.0..=0.5).contains(&nu) => {
                return Err(invalid("poisson", format!("a Poisson's ratio of {nu}: 0 to 0.5 is possible"))
                    .try_instead("rock has 0.2 to 0.3; 25 % is poisson = 0.25"));
            }
            None if self.young.is_some() || (self.friction > 0.0 && self.stiffness_ratio.is_none()) => {
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
                    "restitution and damping_ratio define one thing twice".into(),
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
            (Some(e), None) if e > 0.0 && e < LEAST_RESTITUTION => {
                let what = format!("a restitution of {e:e}: its dashpot would ask for steps of no length");
                return Err(invalid("restitution", what)
                    .try_instead(format!("{LEAST_RESTITUTION:e} and more can be computed")));
            }
            (Some(e), None) if !(e > 0.0 && e <= 1.0) => {
                let what = format!("a restitution of {e}: above 0 up to 1 is possible");
                let percent =
                    (e > 1.0 && e <= 100.0).then(|| format!("; {e} % is restitution = {}", e / 100.0));
                let cure = "it is the speed after an impact over that before it";
                return Err(
                    invalid("restitution", what).try_instead(cure.to_owned() + &percent.unwrap_or_default())
                );
            }
            (None, Some(g)) if g < 0.0 => {
                return Err(invalid(
                    "damping_ratio",
                    format!("a damping ratio of {g}: it must be 0 or more"),
                ));
            }
            _ => {}
        }
        Ok(())
    }

    /// Whether this table names the pair, in either order; a table without names does not.
    pub fn names(&self, a: &str, b: &str) -> bool {
        self.between.as_ref().is_some_and(|[x, y]| (x == a && y == b) || (x == b && y == a))
    }
}

/// Check all tables: each for itself, no pair twice, and no material that is not among `known`.
pub fn check_all(contacts: &[ContactSettings], known: &[String], scene: &Scene) -> Result<(), Diagnostic> {
    for (number, contact) in contacts.iter().enumerate() {
        contact.check(scene, number)?;
        let twice = contacts[..number].iter().position(|other| match (&contact.between, &other.between) {
            (Some([a, b]), Some(_)) => other.names(a, b),
            (None, None) => true,
            _ => false,
        });
        if let Some(first) = twice {
            let key = if contact.between.is_some() { ".between" } else { "" };
            let what = match &contact.between {
                Some([a, b]) => format!("the pair `{a}`, `{b}` has a table already, number {}", first + 1),
                None => {
                    format!("two tables [[contact]] without `between`, the first is number {}", first + 1)
                }
            };
            return Err(scene
                .invalid(&format!("contact.{number}{key}"), what)
                .try_instead("keep one of them, or name another pair: between = [\"rock\", \"structure\"]"));
        }
        if let Some(unknown) = contact.between.iter().flatten().find(|name| !known.contains(name)) {
            return Err(scene
                .invalid(
                    &format!("contact.{number}.between"),
                    format!("nothing is of the material `{unknown}`"),
                )
                .try_instead(format!("the scene has {}", known.join(", "))));
        }
    }
    Ok(())
}

/// What the user must know of the presets of a scene.
pub fn of_presets(contacts: &[ContactSettings]) -> Vec<Diagnostic> {
    let of = |(number, contact): (usize, &ContactSettings)| {
        let preset = presets::named(contact.preset.as_deref()?)?;
        let rolls = contact.rolling_friction > 0.0 || contact.rolling == Some(RollingName::Rut);
        let cure = (!rolls).then(|| {
            "it says nothing of rolling_friction, without which round rocks do not stop on a slope: docs/ground.md has values to begin with"
                .to_owned()
        });
        let what = format!(
            "\"{}\" is uncalibrated: calibrate it on falls that were measured at the site ({})",
            preset.name, preset.source
        );
        let warned = Diagnostic::warning(code::TRUST, what).about(format!("contact.{number}.preset"));
        Some(warned.try_if(cure))
    };
    contacts.iter().enumerate().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> ContactSettings {
        toml::from_str(text).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn a_preset_fills_in_what_the_table_does_not_say_and_is_read_again_as_it_is_written() {
        for preset in presets::ALL {
            let found = table(&format!("preset = \"{}\"", preset.name));
            assert_eq!(found.restitution, Some(preset.restitution));
            assert_eq!(
                [found.friction, found.friction_growth.expect("named")],
                [preset.friction[0], preset.friction[1]]
            );
            assert_eq!(found.own["ground_modulus"].as_float(), Some(preset.modulus));
            let written = toml::to_string(&found).expect("valid");
            assert_eq!(table(&written), found, "{written}");
        }
        let own = table("restitution = 0.4\nground_stiffness = 3e5\npreset = \"soil\"\nfriction = 0.5");
        assert_eq!((own.restitution, own.friction), (Some(0.4), 0.5));
        assert!(own.own.contains_key("ground_stiffness") && !own.own.contains_key("ground_modulus"));
        let warned = of_presets(&[own]);
        assert!(
            warned[0].key.as_deref() == Some("contact.0.preset") && warned[0].code == code::TRUST,
            "{warned:?}"
        );
    }
}
