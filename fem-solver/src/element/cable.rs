//! The two-node cable: total Lagrangian, Green-Lagrange strain, St. Venant-Kirchhoff, preX
use crate::read::Key;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A cable or truss between two nodes.
///
/// With the modelled span `D`, the unstretched length `L`, the relative displacement
/// `w = u_2 - u_1`, `d = D + w` and `s = w . (2 D + w)` (so that `l^2 = d . d = D^2 + s` without
/// the cancellation of two large squares):
///
/// ```text
/// e = (l^2 - L^2) / (2 L^2)          Green-Lagrange strain
/// S = s_0 + E e                      second Piola-Kirchhoff stress; >= 0 where tension only
/// q = S A / L = q_0 + c s            pull per length [N/m],  c = E A / (2 L^3)
/// f_2 = q d,  f_1 = -f_2             N = q l is the axial force
/// K_22 = 2 c d (x) d + q I           K_12 = -K_22, ...; 0 where slack
/// W = (q - b)(q + b) / (4 c)         b = max(q_0, 0) where tension only, else q_0: W = 0 as modelled
/// ```
///
/// Source: Crisfield (1991), Non-linear Finite Element Analysis, vol. 1, section 3.3.
#[derive(Debug, Clone, PartialEq)]
pub struct Cable {
    /// Its two nodes.
    pub nodes: [usize; 2],
    /// `D`, from the first node to the second as modelled [m].
    pub span: Vector3<f64>,
    /// Unstretched length `L` [m].
    pub length: f64,
    /// Young's modulus `E`, section `A`, stress `s_0` at the unstretched length and the like.
    pub of: CableConfig,
}

/// Answer of a cable: energy, pull on its second node, stiffness of that pull.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Stored energy, 0 as modelled [J].
    pub energy: f64,
    /// Internal force at the second node, `q d` [N]; the first has the opposite.
    pub pull: Vector3<f64>,
    /// Pull per length `q` [N/m].
    pub pull_per_length: f64,
    /// Tangent block `K_22` [N/m].
    pub tangent: Matrix3<f64>,
    /// Axial force `N = q l` [N].
    pub tension: f64,
    /// Whether it is slack: tension only, and shorter than where its stress begins.
    pub slack: bool,
}

impl Cable {
    /// `q_0`, pull per length as modelled, before any cut-off [N/m].
    pub fn initial_pull_per_length(&self) -> f64 {
        let excess = self.span.norm_squared() - self.length * self.length;
        self.of.prestress * self.of.area / self.length + self.slope() * excess
    }

    /// `c = E A / (2 L^3)`: growth of the pull per length with `l^2` [N/m3].
    pub fn slope(&self) -> f64 {
        self.of.young * self.of.area / (2.0 * self.length.powi(3))
    }

    /// Least pull per length: 0 where it carries no compression [N/m].
    pub fn floor(&self) -> f64 {
        if self.of.tension_only { 0.0 } else { f64::NEG_INFINITY }
    }

    /// Energy, force and tangent at the relative displacement `w = u_2 - u_1` [m].
    pub fn response(&self, w: &Vector3<f64>) -> Response {
        let s = w.dot(&(2.0 * self.span + w));
        let d = self.span + w;
        let (q0, c, floor) = (self.initial_pull_per_length(), self.slope(), self.floor());
        let elastic = q0 + c * s;
        let slack = elastic < floor;
        let q = if slack { floor } else { elastic };
        let base = q0.max(floor);
        let tangent = if slack {
            Matrix3::zeros()
        } else {
            2.0 * c * d * d.transpose() + Matrix3::from_diagonal_element(q)
        };
        Response {
            energy: (q - base) * (q + base) / (4.0 * c),
            pull: q * d,
            pull_per_length: q,
            tangent,
            tension: q * d.norm(),
            slack,
        }
    }

    /// Axial force at the relative displacement `w` [N]: that of [`Cable::response`] alone.
    pub fn tension(&self, w: &Vector3<f64>) -> f64 {
        let elastic = self.initial_pull_per_length() + self.slope() * w.dot(&(2.0 * self.span + w));
        let q = if elastic < self.floor() { self.floor() } else { elastic };
        q * (self.span + w).norm()
    }

    /// Axial stiffness of the unstretched cable, `E A / L` [N/m].
    pub fn axial_stiffness(&self) -> f64 {
        self.of.young * self.of.area / self.length
    }

    /// Mass that each of its nodes carries, `rho A L / 2` [kg].
    pub fn nodal_mass(&self) -> f64 {
        0.5 * self.of.density * self.of.area * self.length
    }
}

/// Default of a key.
pub(crate) fn yes() -> bool {
    true
}

/// Properties of a cable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CableConfig {
    /// Young's modulus [Pa].
    pub young: f64,
    /// Section [m2].
    pub area: f64,
    /// Density [kg/m3]; 0: without mass.
    pub density: f64,
    /// Second Piola-Kirchhoff stress as modelled [Pa]; below 0: slack. Default 0.
    #[serde(default)]
    pub prestress: f64,
    /// Whether it carries no compression. Default true.
    #[serde(default = "yes")]
    pub tension_only: bool,
    /// Radius for contact [m]. Default 0, a mathematical line.
    #[serde(default)]
    pub radius: f64,
}

impl CableConfig {
    /// Refuse what no cable can be, as `key` of the scene states it.
    pub fn check(&self, key: &Key) -> Result<(), Diagnostic> {
        key.positive(&[("young", self.young, "Pa"), ("area", self.area, "m2")])?;
        key.not_negative(&[("density", self.density, "kg/m3"), ("radius", self.radius, "m")])
    }

    /// A cable with these properties between two of the nodes at `positions` [m], unstretched at its own length [m] or as
    /// modelled.
    pub fn cable(&self, positions: &[Vector3<f64>], ends: [usize; 2], length: Option<f64>) -> Cable {
        let span = positions[ends[1]] - positions[ends[0]];
        Cable { nodes: ends, span, length: length.unwrap_or(span.norm()), of: self.clone() }
    }
}

/// Properties of a cable as far as they are stated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Stated {
    /// Young's modulus [Pa].
    pub young: Option<f64>,
    /// Section [m2].
    pub area: Option<f64>,
    /// Density [kg/m3].
    pub density: Option<f64>,
    /// Second Piola-Kirchhoff stress [Pa].
    pub prestress: Option<f64>,
    /// Whether it carries no compression.
    pub tension_only: Option<bool>,
    /// Radius for contact [m].
    pub radius: Option<f64>,
}

impl Stated {
    /// Properties of one cable, checked: those that `key` of the scene states, else those of all.
    pub fn complete(&self, key: &Key, common: Option<&CableConfig>) -> Result<CableConfig, Diagnostic> {
        let missing = |name: &str| {
            let what =
                format!("no {name} is stated here, and there is no [structure.cable] that states it for all");
            key.scene.invalid(&key.key, what)
        };
        let own = CableConfig {
            young: self.young.or(common.map(|c| c.young)).ok_or_else(|| missing("young"))?,
            area: self.area.or(common.map(|c| c.area)).ok_or_else(|| missing("area"))?,
            density: self.density.or(common.map(|c| c.density)).ok_or_else(|| missing("density"))?,
            prestress: self.prestress.or(common.map(|c| c.prestress)).unwrap_or(0.0),
            tension_only: self.tension_only.or(common.map(|c| c.tension_only)).unwrap_or(true),
            radius: self.radius.or(common.map(|c| c.radius)).unwrap_or(0.0),
        };
        own.check(key)?;
        Ok(own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    fn cable(prestress: f64, tension_only: bool) -> Cable {
        Cable {
            nodes: [0, 1],
            span: Vector3::new(0.1, -0.07, 0.05),
            length: 0.13,
            of: CableConfig {
                young: 8e9,
                area: 1.25e-5,
                density: 7850.0,
                prestress,
                tension_only,
                radius: 0.0,
            },
        }
    }

    fn vector(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-reach..reach).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn force_is_the_slope_of_the_energy_and_the_tangent_that_of_the_force(
            w in vector(0.02), prestress in -5e8..1e9, tension_only: bool,
        ) {
            let cable = cable(prestress, tension_only);
            let step = 1e-6;
            let here = cable.response(&w);
            // Third derivative of W is 6 c d per direction: truncation step^2 c l, and a kink of K where
            // the cable goes slack inside the step, at most E A / L times the step. Rounding eps W / step.
            let stiffness = 2.0 * cable.slope() * (cable.span + w).norm_squared() + here.pull_per_length.abs();
            let scale = cable.axial_stiffness() + stiffness;
            let at_kink = (0..3).any(|i| {
                let mut e = Vector3::zeros();
                e[i] = step;
                cable.response(&(w + e)).slack != cable.response(&(w - e)).slack
            });
            prop_assume!(!at_kink);
            for i in 0..3 {
                let mut e = Vector3::zeros();
                e[i] = step;
                let (plus, minus) = (cable.response(&(w + e)), cable.response(&(w - e)));
                let slope = (plus.energy - minus.energy) / (2.0 * step);
                let largest = cable.initial_pull_per_length().abs().max(here.pull_per_length);
                let energies = here.energy.abs() + largest * largest / (4.0 * cable.slope());
                let rounding = 4.0 * f64::EPSILON * energies / step;
                let truncation = 2.0 * cable.slope() * step * step;
                prop_assert!((slope - here.pull[i]).abs() <= rounding + truncation,
                    "{slope} is not {} in direction {i}", here.pull[i]);
                let change = (plus.pull - minus.pull) / (2.0 * step);
                // K is quadratic in w: its difference errs by c step^2; rounding of f is eps scale l.
                let rounding = 8.0 * f64::EPSILON * scale * 0.2 / step;
                prop_assert!((change - here.tangent.column(i)).norm() <= rounding + truncation);
            }
        }

        #[test]
        fn a_rigid_rotation_changes_no_energy_and_turns_the_force(
            w in vector(0.02), axis in vector(1.0), shift in vector(5.0), tension_only: bool,
        ) {
            let cable = cable(1e8, tension_only);
            let turn = Rotation3::new(axis);
            let before = cable.response(&w);
            // u_i = R (X_i + w_i) + shift - X_i: the shift drops out of u_2 - u_1 but for its rounding.
            let u1 = shift;
            let u2 = turn * (cable.span + w) - cable.span + shift;
            let after = cable.response(&(u2 - u1));
            let slip = f64::EPSILON * (8.0 + shift.norm());
            let stiffness = 2.0 * cable.slope() * 0.04 + before.pull_per_length.abs();
            prop_assert!((after.pull - turn * before.pull).norm() <= 4.0 * stiffness * slip);
            prop_assert!((after.energy - before.energy).abs() <= 4.0 * (before.pull.norm() + stiffness * slip) * slip
                + 8.0 * f64::EPSILON * cable.initial_pull_per_length().powi(2) / cable.slope());
        }
    }

    #[test]
    fn stress_strain_and_mass_have_their_closed_form() {
        let cable = Cable { span: Vector3::new(0.13, 0.0, 0.0), ..cable(2e7, false) };
        let stretched = cable.response(&Vector3::new(0.013, 0.0, 0.0));
        // l / L = 1.1: e = 0.105, N = A (s0 + E e) l / L.
        let exact = 1.25e-5 * (2e7 + 8e9 * 0.105) * 1.1;
        assert!((stretched.tension / exact - 1.0).abs() < 1e-14, "{}", stretched.tension);
        let axial = 1.25e-5 / 0.13 * (2e7 + 8e9 * 0.105 + 8e9 * 1.21);
        assert!((stretched.tangent[(0, 0)] / axial - 1.0).abs() < 1e-14);
        assert_eq!(cable.nodal_mass(), 0.5 * 7850.0 * 1.25e-5 * 0.13);
    }

    #[test]
    fn a_slack_cable_carries_nothing_and_stores_nothing_more() {
        let cable = cable(1e7, true);
        let near = cable.response(&(-0.3 * cable.span));
        let nearer = cable.response(&(-0.6 * cable.span));
        assert!(near.slack && near.pull == Vector3::zeros() && near.tangent == Matrix3::zeros());
        assert_eq!(near.energy, nearer.energy);
    }
}
