//! `[[contact]]`: the law of a pair of materials, and its parameters.

use super::PartnerKind;
use super::elastic::Elastic;
use super::normal::{LawName, Normal, names};
use super::presets;
use crate::keys::{Checked, Keys};
use interface_defs::diagnostic::{Diagnostic, code};
use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use toolkit::explain::of_reference;
use toolkit::scene::{KEYS, Scene, number, read_value};

// Keys that one law alone has are set aside in `own` (`ContactSettings::of`), and read by that law.

/// The contact law of a pair of materials. A net and a terrain are rigid unless their modulus is given; two rocks in
/// contact are both elastic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = with_own_keys)]
pub struct ContactSettings {
    /// Names of the two materials: that of the rock first, if the other is that of net, terrain or box. Default: every
    /// pair that no other table names.
    pub between: Option<[String; 2]>,
    /// Kind of ground whose values fill in what the table does not say: `bedrock`, `scree`, `meadow`, `soil`, `wetland` or
    /// `forest`, of `law = "ground"`. None is calibrated, and none sets `rolling_friction` or `rolling_friction_impact`: docs/ground.md.
    pub preset: Option<String>,
    /// Normal law. Required without `preset`.
    pub law: LawName,
    /// Young's modulus of the rock [Pa]. `linear` takes it or `stiffness`.
    pub young: Option<f64>,
    /// Poisson's ratio of the rock, 0 to 0.5. Needed with `young` and with friction (unless
    /// `stiffness_ratio` is given).
    pub poisson: Option<f64>,
    /// Young's modulus of the other side [Pa]. Default: net and terrain are rigid, another rock is as `young`.
    pub partner_young: Option<f64>,
    /// Poisson's ratio of the other side. Needed with `partner_young`.
    pub partner_poisson: Option<f64>,
    /// Restitution coefficient of one contact as measured, above 0 up to 1 (no dashpot is built at 1).
    /// Exactly one of `restitution` and `damping_ratio`.
    pub restitution: Option<f64>,
    /// Damping ratio g in `c = 2 g sqrt(m* k)`; 0: no dashpot is built.
    pub damping_ratio: Option<f64>,
    /// Coulomb coefficient (at rest, if `friction_dynamic` is given). Default 0: no tangential part is built.
    #[serde(default)]
    pub friction: f64,
    /// Coulomb coefficient in fast slip: `mu_d + (mu - mu_d) exp(-decay |v_t|)`. Default: as `friction`.
    pub friction_dynamic: Option<f64>,
    /// How fast friction falls from `friction` to `friction_dynamic` [s/m]. Default 500.
    pub friction_decay: Option<f64>,
    /// Terrain: coefficient to which friction grows with the distance s that the rock's centre travels in contact,
    /// `mu(s) = mu + 2/pi (mu_max - mu) atan(kappa s)`; in flight s decays with `exp(-beta t)`. Default: it does not grow.
    pub friction_max: Option<f64>,
    /// kappa of `friction_max` [1/m]. Required beside it.
    pub friction_growth: Option<f64>,
    /// beta of `friction_max` [1/s]. Required beside it.
    pub friction_relaxation: Option<f64>,
    /// Terrain, `ground` and `hertz_rock`: drag coefficient C of the ground that the rock ploughs through while it touches,
    /// `C rho A v^2 / 2` with the outline A below the surface. Default: none.
    pub scarring_drag: Option<f64>,
    /// Density of the ground for `scarring_drag` [kg/m3]. Default 1700.
    pub ground_density: Option<f64>,
    /// How the tangential spring follows the overlap. Default `unloading_scaled`, the one of the three
    /// that never creates energy.
    #[serde(default, skip_serializing_if = "is_default")]
    pub tangential: TangentialName,
    /// Tangential over normal stiffness. Default: Mindlin's, from the Poisson's ratios.
    pub stiffness_ratio: Option<f64>,
    /// Rolling resistance: limit of its moment over radius and load. On surfaces the load is the weight, and the moment acts on the rock while
    /// it rolls; between rocks it is the force of each contact. Calibrated at the same sites as `rolling_friction_impact`: 0.23, 0.08 and 0.32.
    /// Default 0: none is built.
    #[serde(default, skip_serializing_if = "is_default")]
    pub rolling_friction: f64,
    /// Losses of spin in impacts on terrain: limit of their moment over radius and the force beyond the weight. For rocks that hop it
    /// decides how far they run, and no preset sets it. Calibrated at two sites: 0.21 on a meadow, 0.52 on slopes with plants, 0.73 on hard
    /// ground of a quarry (docs/measured-falls.md). Default 0: none.
    pub rolling_friction_impact: Option<f64>,
    /// Kind of rolling resistance between rocks; on surfaces there is one, and `rut`. Default `constant`.
    pub rolling: Option<RollingName>,
    /// Damping ratio of the spring of `rolling = "spring"`. Default 0; on surfaces 0.3.
    pub rolling_damping: Option<f64>,
    /// Which mass a contact's dashpot is scaled with. Default `local`.
    #[serde(default)]
    pub effective_mass: EffectiveMass,
    /// The keys that the law alone has.
    #[serde(skip_deserializing, flatten)]
    #[schemars(skip)]
    pub own: toml::Table,
}

/// Adds to the schema the keys that one law alone has, and that a preset says the law.
fn with_own_keys(schema: &mut Schema) {
    schema.remove("required");
    let either = schemars::json_schema!({ "anyOf": [{ "required": ["law"] }, { "required": ["preset"] }] });
    schema.insert("anyOf".into(), either.get("anyOf").expect("as written").clone());
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

/// The law that has this key for its own.
fn owner(key: &str) -> Option<LawName> {
    LawName::ALL.iter().copied().find(|law| law.own_keys().iter().any(|own| own == key))
}

/// Least restitution that is computed.
const LEAST_RESTITUTION: f64 = 1e-6;

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
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

    /// All tables of a scene, unchecked.
    pub fn read(scene: &Scene) -> Result<Vec<Self>, Diagnostic> {
        let tables: Vec<toml::Table> = scene.read("contact")?.unwrap_or_default();
        let of = |(number, table)| Self::of(&format!("contact.{number}"), table);
        tables.into_iter().enumerate().map(|it| of(it).map_err(|e| scene.placed(e))).collect()
    }

    /// From the table at `key`: its preset fills in what it does not say, and keys that one law alone has are set aside.
    ///
    /// # Errors
    /// With the key that is not known or has another type, without a place.
    pub fn of(key: &str, mut table: toml::Table) -> Result<Self, Diagnostic> {
        presets::fill(&mut table);
        let known = names(&schemars::schema_for!(Self));
        let is_known = |name: &&String| known.contains(name) || KEYS.contains(&name.as_str());
        if let Some(name) = table.keys().find(|name| !is_known(name)) {
            let error = Diagnostic::error(code::UNKNOWN_KEY, format!("unknown key `{name}`"));
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            return Err(error.about(format!("{key}.{name}")).try_if(of_reference(name, &known)));
        }
        let (own, common) = table.into_iter().partition(|(key, _)| owner(key).is_some());
        Ok(Self { own, ..read_value(key, &toml::Value::Table(common))? })
    }

    /// Refuse what makes no sense; this is table number `number`.
    fn check(&self, scene: &Scene, number: usize) -> Checked {
        let keys = Keys::of(scene, format!("contact.{number}"));
        let name = self.law.name();
        if let Some(preset) = &self.preset {
            let known = presets::ALL.map(|preset| preset.name).join(", ");
            let what = format!("there is no ground `{preset}`");
            keys.refuse(presets::named(preset).is_none(), "preset", what, known)?;
            let due = presets::LAW;
            let what = format!("the preset `{preset}` is of law = \"{}\", and this is `{name}`", due.name());
            keys.refuse(self.law != due, "preset", what, "leave `preset` or `law` out")?;
        }
        let rocks_mass = self.law.kind().whole && self.effective_mass == EffectiveMass::Rock;
        let what = format!("`{name}` knows the mass that its force acts on");
        keys.refuse(rocks_mass, "effective_mass", what, "leave it out")?;
        keys.above_zero(&[
            ("young", self.young, ""),
            ("partner_young", self.partner_young, ""),
            ("stiffness_ratio", self.stiffness_ratio, ""),
            ("friction_max", self.friction_max, ""),
            ("friction_growth", self.friction_growth, ""),
            ("scarring_drag", self.scarring_drag, ""),
            ("ground_density", self.ground_density, ""),
        ])?;
        let law = self.check_law(&keys)?;
        let what = format!("`{name}` has no dashpot that this could be the ratio of");
        let cure = "write restitution, that of a slow impact: 0.25 on soft soil, 0.5 on bedrock";
        let has_ratio = law.rule().is_some() && self.damping_ratio.is_some();
        keys.refuse(has_ratio, "damping_ratio", what, cure)?;
        self.check_numbers(&keys)?;
        keys.not_negative(&[
            ("friction", Some(self.friction), ""),
            ("friction_dynamic", self.friction_dynamic, ""),
            ("friction_decay", self.friction_decay, ""),
            ("friction_relaxation", self.friction_relaxation, ""),
            ("rolling_friction", Some(self.rolling_friction), ""),
            ("rolling_friction_impact", self.rolling_friction_impact, ""),
            ("rolling_damping", self.rolling_damping, ""),
        ])?;
        self.check_parts(&keys, &law)
    }

    /// A number of the law's own keys.
    pub fn own_number(&self, key: &str) -> Option<f64> {
        self.own.get(key).and_then(number)
    }

    /// The law, by what it alone knows of its keys.
    fn check_law(&self, keys: &Keys) -> Checked<Normal> {
        let (name, own) = (self.law.name(), self.law.own_keys());
        if let Some(key) = self.own.keys().find(|key| !own.contains(*key)) {
            let owner = owner(key).expect("others are refused when read").name();
            return Err(keys
                .invalid(key, format!("`{key}` belongs to law = \"{owner}\", and this is `{name}`"))
                .try_instead(format!("leave it out, or write law = \"{owner}\"")));
        }
        let sides =
            self.young.map(|young| Elastic { own: (young, self.poisson.unwrap_or(0.0)), other: None });
        self.law.build(&self.own, sides.as_ref()).map_err(|e| keys.placed(e, "law"))
    }

    /// The two sides; `None` without `young`.
    pub fn sides(&self, partner: PartnerKind) -> Option<Elastic> {
        let own = self.young.zip(self.poisson)?;
        let given = self.partner_young.zip(self.partner_poisson);
        Some(Elastic { own, other: given.or((partner == PartnerKind::Rock).then_some(own)) })
    }

    /// The key that makes it stiff, with its value: `young`, else the law's own; its restitution is none of them.
    pub fn strength(&self) -> Option<(&str, f64)> {
        let own = || {
            let mut stiff = self.own.keys().filter(|key| !key.starts_with("restitution"));
            stiff.find_map(|key| Some((key.as_str(), self.own_number(key)?)))
        };
        self.young.map(|young| ("young", young)).or_else(own)
    }

    fn check_numbers(&self, keys: &Keys) -> Checked {
        let poissons = [
            ("poisson", self.poisson, "rock has 0.2 to 0.3; 25 % is poisson = 0.25"),
            ("partner_poisson", self.partner_poisson, ""),
        ];
        for (key, nu, cure) in poissons {
            let nu = nu.unwrap_or_default();
            let what = format!("a Poisson's ratio of {nu}: 0 to 0.5 is possible");
            keys.refuse(!(0.0..=0.5).contains(&nu), key, what, cure)?;
        }
        let shears = self.friction > 0.0 && self.stiffness_ratio.is_none();
        let what = "Poisson's ratio is needed with `young` and with friction";
        let cure = "write poisson = 0.2 for rock";
        keys.refuse(self.poisson.is_none() && (self.young.is_some() || shears), "poisson", what, cure)?;
        let both = self.restitution.is_some() && self.damping_ratio.is_some();
        keys.twice(["restitution", "damping_ratio"], both)?;
        let what = "the contact has neither restitution nor damping_ratio";
        let cure = "restitution = 1 is a contact without a dashpot";
        keys.refuse(self.restitution.is_none() && self.damping_ratio.is_none(), "restitution", what, cure)?;
        let e = self.restitution.unwrap_or(1.0);
        let what = format!("a restitution of {e:e}: its dashpot would ask for steps of no length");
        let cure = format!("{LEAST_RESTITUTION:e} and more can be computed");
        keys.refuse(e > 0.0 && e < LEAST_RESTITUTION, "restitution", what, cure)?;
        let percent = (e > 1.0 && e <= 100.0).then(|| format!("; {e} % is restitution = {}", e / 100.0));
        let cure = "it is the speed after an impact over that before it".to_owned();
        let what = format!("a restitution of {e}: above 0 up to 1 is possible");
        keys.refuse(!(e > 0.0 && e <= 1.0), "restitution", what, cure + &percent.unwrap_or_default())?;
        keys.not_negative(&[("damping_ratio", self.damping_ratio, "")])
    }

    /// Keys that go together, and those of parts that are not built.
    fn check_parts(&self, keys: &Keys, law: &Normal) -> Checked {
        let partner = (self.partner_young.is_some(), self.partner_poisson.is_some());
        let what = "partner_young is the partner of `young`, which is missing";
        keys.refuse(partner.0 && self.young.is_none(), "partner_young", what, "")?;
        let what = "Poisson's ratio of the partner is needed with `partner_young`";
        keys.refuse(partner == (true, false), "partner_poisson", what, "")?;
        let what = "partner_poisson without `partner_young`";
        keys.refuse(partner == (false, true), "partner_poisson", what, "leave it out: the partner is rigid")?;
        let most = self.friction_max.unwrap_or(f64::INFINITY);
        let what =
            format!("friction_max = {most} lies below friction = {}, from which it grows", self.friction);
        keys.refuse(most < self.friction, "friction_max", what, "are the two exchanged?")?;
        let (grows, growth, relaxes) =
            (self.friction_max.is_some(), self.friction_growth.is_some(), self.friction_relaxation.is_some());
        for (key, there) in [("friction_growth", growth), ("friction_relaxation", relaxes)] {
            let cure = "medium ground of RAMMS has friction_growth = 2.0 and friction_relaxation = 150.0";
            keys.refuse(grows && !there, "friction_max", format!("`friction_max` needs `{key}`"), cure)?;
        }
        let rut = self.rolling == Some(RollingName::Rut);
        let what = "the rut is that of ground which resists with a pressure";
        let cure = "write ground_pressure; or rolling = \"constant\" with rolling_friction";
        keys.refuse(rut && law.pressure().is_none(), "rolling", what, cure)?;
        let (slides, rolls) = (self.friction > 0.0, self.rolling_friction > 0.0);
        let springs = self.rolling == Some(RollingName::Spring);
        let (dynamic, decays) = (self.friction_dynamic.is_some(), self.friction_decay.is_some());
        let ploughs = self.scarring_drag.is_some();
        let wholes = LawName::ALL.iter().filter(|law| law.kind().whole);
        let wholes: Vec<String> = wholes.map(|law| format!("\"{}\"", law.name())).collect();
        let of_whole = format!("without law = {}", wholes.join(" or "));
        keys.idle(&[
            ("friction_dynamic", dynamic && !slides, "without `friction`"),
            ("friction_decay", decays && !dynamic, "without `friction_dynamic`"),
            ("stiffness_ratio", self.stiffness_ratio.is_some() && !slides, "without `friction`"),
            ("friction_max", grows && !slides, "without `friction`"),
            ("friction_max", grows && dynamic, "beside `friction_dynamic`"),
            ("friction_growth", growth && !grows, "without `friction_max`"),
            ("friction_relaxation", relaxes && !grows, "without `friction_max`"),
            ("scarring_drag", ploughs && !self.law.kind().whole, &of_whole),
            ("ground_density", self.ground_density.is_some() && !ploughs, "without `scarring_drag`"),
            ("rolling_friction", rut && rolls, "beside rolling = \"rut\""),
            ("rolling", self.rolling.is_some() && !rut && !rolls, "without `rolling_friction`"),
            ("rolling_damping", self.rolling_damping.is_some() && !springs, "without rolling = \"spring\""),
        ])
    }

    /// Whether this table names the pair, in either order; a table without names does not.
    pub fn names(&self, a: &str, b: &str) -> bool {
        self.between.as_ref().is_some_and(|[x, y]| (x == a && y == b) || (x == b && y == a))
    }
}

/// Check all tables: each for itself, no pair twice, and no material that is not among `known`.
pub fn check_all(contacts: &[ContactSettings], known: &[String], scene: &Scene) -> Checked {
    for (number, contact) in contacts.iter().enumerate() {
        contact.check(scene, number)?;
        let key = format!("contact.{number}.between");
        let twice = contacts[..number].iter().position(|other| match (&contact.between, &other.between) {
            (Some([a, b]), Some(_)) => other.names(a, b),
            (None, None) => true,
            _ => false,
        });
        if let Some(first) = twice.map(|first| first + 1) {
            let what = match &contact.between {
                Some([a, b]) => format!("the pair `{a}`, `{b}` has a table already, number {first}"),
                None => format!("two tables [[contact]] without `between`, the first is number {first}"),
            };
            let cure = "keep one of them, or name another pair: between = [\"rock\", \"structure\"]";
            return scene.refuse(&key, what, cure);
        }
        if let Some(unknown) = contact.between.iter().flatten().find(|name| !known.contains(name)) {
            let what = format!("nothing is of the material `{unknown}`");
            return scene.refuse(&key, what, format!("the scene has {}", known.join(", ")));
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
            "it says nothing of rolling_friction, without which round rocks do not stop on a slope: calibrate it too, docs/ground.md"
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
        ContactSettings::of("contact.0", text.parse().expect("TOML")).unwrap_or_else(|e| panic!("{e}"))
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
