//! Elastic force along the normal: a law is one file, and two lines here.
//!
//! The file has the formula, the law's own keys of `[[contact]]` with their check, and its name; the line in [`laws`] makes it
//! known to scenes, to the error for a misspelt name, to the reference, and to every partner of a contact.

pub mod ground;
pub mod hertz;
pub mod linear;

use super::elastic::Elastic;
use super::restitution;
use ground::Rule;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::ops::Deref;
use toolkit::scene::read_value;

/// The laws by their names in a scene: [`LawName`] for the table, [`Normal`] for the contact. What a law does not say does not
/// compile.
macro_rules! laws {
    ($($name:literal => $kind:ident($law:ty): $meaning:literal,)+) => {
        /// Normal law of a contact.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub enum LawName {
            $(#[doc = $meaning] #[serde(rename = $name)] $kind,)+
        }

        impl LawName {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$kind),+];

            /// As the scene writes it.
            pub fn name(self) -> &'static str {
                match self { $(Self::$kind => $name,)+ }
            }

            /// What is known of it before it has parameters.
            pub fn kind(self) -> LawKind {
                match self { $(Self::$kind => <$law as NormalLaw>::kind(),)+ }
            }

            /// Schema of its own keys.
            pub(super) fn keys(self) -> schemars::Schema {
                // What it refers to stands in it: it becomes a part of another schema.
                let mut settings = schemars::generate::SchemaSettings::default();
                settings.inline_subschemas = true;
                let generator = settings.into_generator();
                match self { $(Self::$kind => generator.into_root_schema_for::<<$law as NormalLaw>::Keys>(),)+ }
            }

            /// Names of its own keys.
            pub fn own_keys(self) -> Vec<String> {
                names(&self.keys())
            }

            /// The law, from its own keys and the moduli of both sides.
            ///
            /// # Errors
            /// As [`NormalLaw::new`]; of one of its own keys in the reader's words where it cannot be read.
            pub fn build(self, own: &toml::Table, sides: Option<&Elastic>) -> Result<Normal, Diagnostic> {
                match self {
                    $(Self::$kind => {
                        let keys = read_value("", &own.clone().into())?;
                        Ok(Normal::$kind(<$law>::new(keys, sides)?))
                    })+
                }
            }
        }

        /// Elastic force along the normal.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Normal {
            $(#[doc = $meaning] $kind($law),)+
        }

        impl Normal {
            /// Load at effective radius `radius` [m] and `overlap` > 0 [m].
            #[inline(always)]
            pub fn load(&self, radius: f64, overlap: f64) -> Load {
                match self { $(Self::$kind(law) => law.load(radius, overlap),)+ }
            }

            /// The same of `N` contacts: stiffness [N/m], force [N], energy [J]. In columns of its own, which nothing else can
            /// lie in: else they are not computed in wide registers.
            #[inline(always)]
            pub fn loads<const N: usize>(&self, radius: &[f64; N], overlap: &[f64; N]) -> [[f64; N]; 3] {
                let mut columns = [[0.0; N]; 3];
                match self {
                    $(Self::$kind(law) => for l in 0..N {
                        let load = law.load(radius[l], overlap[l]);
                        (columns[0][l], columns[1][l], columns[2][l]) = (load.stiffness, load.force, load.energy);
                    })+
                }
                columns
            }

        }

        /// What is not asked for at every contact, whichever law it is.
        impl Deref for Normal {
            type Target = dyn NormalLaw;

            fn deref(&self) -> &Self::Target {
                match self { $(Self::$kind(law) => law,)+ }
            }
        }
    };
}

laws! {
    "hertz_mindlin" => HertzMindlin(hertz::HertzMindlin): "Hertz normal and Mindlin tangential stiffness, both growing with the overlap; each \
        sphere by its own radius.",
    "hertz_rock" => HertzRock(hertz::HertzRock): "The same of the rock as a whole, by its own radius: it does not depend on the number of spheres; \
        wires touch the faces of a convex rock itself. With faces of a structure it is `hertz_mindlin`.",
    "linear" => Linear(linear::Linear): "Constant stiffnesses.",
    "ground" => Ground(ground::Ground): "Ground that gives way below the rock as a whole and remembers its depth: on terrain alone (docs/ground.md).",
}

/// What is known of a law by its name alone.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LawKind {
    /// True if the rock touches as a whole ([`crate::contact::whole_rock`]), not each of its spheres by its own radius.
    pub whole: bool,
    /// The law with the same formula that touches as a whole, for what to try where spheres are too small.
    pub as_whole: Option<&'static str>,
}

/// Response of the normal law.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Load {
    /// Tangent stiffness [N/m].
    pub stiffness: f64,
    /// Elastic force [N].
    pub force: f64,
    /// Stored energy [J].
    pub energy: f64,
}

/// With which powers the energy of a contact grows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Powers {
    /// Of the overlap, n: force ~ overlap^(n-1), stiffness ~ overlap^(n-2).
    pub overlap: f64,
    /// Of the radius, at equal overlap.
    pub radius: f64,
    /// Duration of an elastic impact in deepest overlap over speed: the integral of `2 dx / sqrt(1 - x^n)` from 0 to 1, that is
    /// `2 sqrt(pi) G(1 + 1/n) / G(1/2 + 1/n)` with the gamma function G.
    pub rebound: f64,
}

impl Powers {
    /// Of a spring of constant stiffness.
    pub const LINEAR: Self = Self { overlap: 2.0, radius: 0.0, rebound: std::f64::consts::PI };
    /// Of a Hertz contact.
    pub const HERTZ: Self = Self { overlap: 2.5, radius: 0.5, rebound: 2.943_275_184_3 };
}

impl Load {
    /// Of a spring of constant stiffness [N/m].
    #[inline(always)]
    pub fn linear(stiffness: f64, overlap: f64) -> Self {
        let force = stiffness * overlap;
        Self { stiffness, force, energy: 0.5 * force * overlap }
    }

    /// Of a Hertz contact of `modulus` [Pa].
    #[inline(always)]
    pub fn hertz(modulus: f64, radius: f64, overlap: f64) -> Self {
        let stiffness = 2.0 * modulus * (radius * overlap).sqrt();
        let force = 2.0 / 3.0 * stiffness * overlap;
        Self { stiffness, force, energy: 0.4 * force * overlap }
    }
}

/// A law `F(R, d)` with `F = dU/dd` and `k = dF/dd`, U a power of the overlap d.
pub trait NormalLaw {
    /// Its own keys of `[[contact]]`, those that not all laws have: a struct that refuses unknown fields.
    type Keys: DeserializeOwned + JsonSchema
    where
        Self: Sized;

    /// From its keys and the moduli of both sides (`None`: the table has no `young`).
    ///
    /// # Errors
    /// With the key that is wrong, what is wrong with it and what to try.
    fn new(keys: Self::Keys, sides: Option<&Elastic>) -> Result<Self, Diagnostic>
    where
        Self: Sized;

    /// What is known of it by its name alone. Default: each sphere touches for itself.
    fn kind() -> LawKind
    where
        Self: Sized,
    {
        LawKind::default()
    }

    /// Load at effective radius `radius` [m] and `overlap` > 0 [m]. It is computed for eight contacts at once: `#[inline(always)]`.
    fn load(&self, radius: f64, overlap: f64) -> Load;

    /// With which powers its energy grows.
    fn powers(&self) -> Powers;

    /// In words, with numbers.
    fn describe(&self) -> String;

    /// Deepest overlap [m] of a sphere of `radius` [m] and `mass` [kg] that touches a fixed surface at `speed` [m/s], without dashpot.
    fn deepest(&self, radius: f64, mass: f64, speed: f64) -> f64 {
        (0.5 * mass * speed * speed / self.load(radius, 1.0).energy).powf(1.0 / self.powers().overlap)
    }

    /// The same, and the duration of that impact [s].
    fn impact(&self, radius: f64, mass: f64, speed: f64) -> (f64, f64) {
        let deepest = self.deepest(radius, mass, speed);
        (deepest, self.powers().rebound * deepest / speed)
    }

    /// Its modulus E* [Pa], of a law by Hertz.
    fn modulus(&self) -> Option<f64> {
        None
    }

    /// Pressure with which the ground resists whatever the depth [Pa], from which the rut below a rolling rock follows.
    fn pressure(&self) -> Option<f64> {
        None
    }

    /// Dependence of its restitution on the impact, of ground that gives way and remembers it; `None` for elastic laws.
    fn rule(&self) -> Option<Rule> {
        None
    }

    /// Damping ratio that gives the restitution `e`, in (0, 1].
    fn damping_ratio(&self, e: f64) -> f64 {
        restitution::ratio(e, self.powers().overlap)
    }

    /// The power of the overlap with which the stiffness grows.
    fn stiffening(&self) -> f64 {
        self.powers().overlap - 2.0
    }
}

/// Of a law that has no keys of its own.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoKeys {}

/// Names of the keys in a schema.
pub(super) fn names(schema: &schemars::Schema) -> Vec<String> {
    let properties = schema.get("properties").and_then(|all| all.as_object());
    properties.into_iter().flatten().map(|(key, _)| key.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Every law of the registry, from a modulus where it takes one, and with its own keys.
    fn all() -> Vec<Normal> {
        let sides = Elastic { own: (2e9, 0.25), other: None };
        let none = toml::Table::new();
        let mut laws = Vec::new();
        for law in LawName::ALL {
            let before = laws.len();
            laws.extend(law.build(&none, Some(&sides)).ok());
            for key in law.own_keys() {
                let own = [(key, toml::Value::Float(3e6))].into_iter().collect();
                laws.extend(law.build(&own, None).ok());
            }
            assert!(laws.len() > before, "{}", law.name());
        }
        laws
    }

    #[test]
    fn stiffness_and_energy_are_derivative_and_integral_of_the_force() {
        for law in all() {
            let (radius, d, step) = (0.07, 0.003, 1e-7);
            let at = |d| law.load(radius, d);
            // Central differences: relative error (step / d)^2 / 24 and rounding 1e-16 d / step.
            let slope = (at(d + step).force - at(d - step).force) / (2.0 * step);
            assert!((slope / at(d).stiffness - 1.0).abs() < 1e-8, "{law:?}");
            let power = (at(d + step).energy - at(d - step).energy) / (2.0 * step);
            assert!((power / at(d).force - 1.0).abs() < 1e-8, "{law:?}");
        }
    }

    #[test]
    fn the_energy_goes_with_the_powers_that_the_law_names() {
        for law in all() {
            let powers = law.powers();
            let energy = |radius, overlap| law.load(radius, overlap).energy;
            assert!(
                (energy(0.07, 0.006) / energy(0.07, 0.003) / 2.0_f64.powf(powers.overlap) - 1.0).abs()
                    < 1e-14
            );
            assert!(
                (energy(0.14, 0.003) / energy(0.07, 0.003) / 2.0_f64.powf(powers.radius) - 1.0).abs() < 1e-14
            );
        }
    }

    /// An impact, integrated by position Verlet: its depth, its duration, and with a dashpot its restitution.
    #[test]
    fn an_impact_is_as_deep_and_long_as_the_law_says_and_rebounds_as_asked() {
        let (radius, mass, speed) = (0.07, 3.0, 4.0);
        for law in all() {
            let (deepest, duration) = law.impact(radius, mass, speed);
            assert!((law.load(radius, deepest).energy / (0.5 * mass * speed * speed) - 1.0).abs() < 1e-14);
            for restitution in [1.0, 0.5] {
                let ratio = law.damping_ratio(restitution);
                let (mut x, mut v, mut t, mut most) = (0.0_f64, speed, 0.0, 0.0_f64);
                let h = duration / 20_000.0;
                for _ in 0..100_000 {
                    x += 0.5 * h * v;
                    let load = law.load(radius, x.max(0.0));
                    let c = 2.0 * ratio * (mass * load.stiffness).sqrt();
                    // The dashpot takes the mean velocity of the step.
                    let after = (v - h / mass * (load.force + 0.5 * c * v)) / (1.0 + 0.5 * h * c / mass);
                    let sticks = load.force + 0.5 * c * (v + after) < 0.0;
                    if x <= 0.0 || sticks {
                        break;
                    }
                    v = after;
                    (x, t) = (x + 0.5 * h * v, t + h);
                    most = most.max(x);
                }
                if restitution == 1.0 {
                    assert!(
                        (most / deepest - 1.0).abs() < 1e-4 && (t / duration - 1.0).abs() < 1e-3,
                        "{law:?} {most} {t}"
                    );
                }
                assert!((-v / speed / restitution - 1.0).abs() < 2e-3, "{law:?} {restitution}: {v}");
            }
        }
    }

    /// V-D1, all rows: two equal spheres have E*/2, R/2, m/2, a mesh E*, R, m. Printed to 9 digits.
    #[test]
    fn overlap_force_and_duration_of_an_impact_are_the_published_ones() {
        let mass = |radius: f64, density: f64| 4.0 / 3.0 * PI * radius.powi(3) * density;
        let rows = [
            (20e9, 0.25, 0.01, 2500.0, 20.0, 0.5, 3.683_040_26e-4, 7_108.241_28, 5.420_100_49e-5),
            (48e9, 0.20, 0.01, 2800.0, 20.0, 0.5, 2.741_127_02e-4, 10_696.889, 4.033_945_57e-5),
            (40e9, 0.35, 0.1, 1800.0, 0.2, 1.0, 5.212_328_83e-5, 7_232.681_03, 7.670_659_05e-4),
            (70e9, 0.30, 0.1, 2699.0, 0.2, 1.0, 4.971_717_52e-5, 11_369.858_3, 7.316_566_41e-4),
        ];
        for (young, nu, radius, density, speed, half, deepest, force, duration) in rows {
            let law = Normal::HertzMindlin(hertz::Hertz { modulus: half * young / (1.0 - nu * nu) });
            let (r, m) = (half * radius, half * mass(radius, density));
            let d = law.deepest(r, m, speed);
            assert!((d / deepest - 1.0).abs() < 5e-9, "{d} {deepest}");
            assert!((law.load(r, d).force / force - 1.0).abs() < 5e-8);
            assert!((law.impact(r, m, speed).1 / duration - 1.0).abs() < 5e-9);
        }
    }
}
