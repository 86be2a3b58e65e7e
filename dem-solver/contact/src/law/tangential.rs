//! Tangential spring with Coulomb slip.
//!
//! Over a step h with slip rate v_t in the middle, `k_t = k_n 4 G* / E*` (Mindlin; with a rigid mesh
//! `k_n 2 (1 - nu) / (2 - nu)`) and dashpot `c_t = 2 g sqrt(m* k_t)`:
//! - `f = b f_0 - k_t v_t h/2` in the middle, from `f_0` at the start. Incremental: b = 1. Scaled on unloading:
//!   `b = min(sqrt(d / d_old), sqrt(k / k_old))` where the overlap shrinks, else 1: the grip goes with the contact area.
//!   Secant: b is the ratio of the stiffnesses, so that the force is `-k_t(d)` times the slip;
//! - limit `mu F_n`: an elastic part beyond it is scaled to it and has no dashpot; else the dashpot is
//!   scaled until the sum is at the limit. `mu = mu_d + (mu_s - mu_d) exp(-decay |v_t|)` where the scene
//!   names a dynamic coefficient;
//! - `f_1 = f - k_t v_t h/2`, within the limit.
//!
//! Two half increments make the middle force of second order; in stick, slip times force is then the
//! change of `f^2 / (2 k_t)` to rounding, so that a loss is a loss. Spin about the normal turns the
//! spring only with the tangent plane.
//!
//! Energy: on loading the incremental spring grows stiffer at constant force and loses energy, the
//! secant one gains it; on unloading the scaled and the secant one lose what goes with the stiffness,
//! the incremental one gains. Only the scaled one never creates energy, hence the default.
//!
//! Source: Thornton, Cummins and Cleary (2013), Powder Technology 233, 30, for incremental, scaled and secant springs; the order in which
//! spring and dashpot are cut at the limit is that of the reference implementation (KratosMultiphysics, Hertz viscous Coulomb).

use crate::law::settings::TangentialName;
use nalgebra::Vector3;

/// Friction of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tangential {
    /// Coulomb coefficient at rest.
    pub friction: f64,
    /// Tangential over normal stiffness.
    pub stiffness_ratio: f64,
    /// Dependence of the spring on the overlap.
    pub history: TangentialName,
    /// The power of the overlap with which the normal stiffness grows.
    pub stiffening: f64,
    /// Coefficient in fast slip, if it is another one.
    pub sliding: Option<Sliding>,
}

/// Friction in slip, below or above that at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sliding {
    /// Coulomb coefficient in fast slip.
    pub friction: f64,
    /// Rate at which it is reached [s/m].
    pub decay: f64,
}

/// What stretches the tangential spring of a contact in a step.
#[derive(Debug, Clone, Copy)]
pub struct Slip {
    /// Slip rate in its middle [m/s].
    pub rate: [f64; 3],
    /// Stiffness of the spring [N/m].
    pub stiffness: f64,
    /// `2 g sqrt(m*)` [kg^(1/2)].
    pub dashpot: f64,
    /// Largest force: the friction coefficient times the normal force [N].
    pub limit: f64,
    /// Length of the step [s]; 0: at an instant.
    pub h: f64,
}

/// Tangential force of one contact in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionForce {
    /// Force on the rock in the middle of the step [N].
    pub force: [f64; 3],
    /// Force of the spring alone at the step's end [N].
    pub spring: [f64; 3],
    /// Power that it takes from the motion [W].
    pub power: f64,
    /// Energy of the spring at the step's end [J].
    pub energy: f64,
}

#[inline(always)]
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn times(a: [f64; 3], by: f64) -> [f64; 3] {
    [a[0] * by, a[1] * by, a[2] * by]
}

/// The first where `first` is true.
#[inline(always)]
fn choose(first: bool, a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [if first { a[0] } else { b[0] }, if first { a[1] } else { b[1] }, if first { a[2] } else { b[2] }]
}

/// What of `velocity` [m/s] lies in the plane across `normal`, along which it is `approach`.
#[inline(always)]
pub fn slip_rate(velocity: [f64; 3], normal: [f64; 3], approach: f64) -> [f64; 3] {
    minus(velocity, times(normal, approach))
}

/// `force` laid into the plane across `normal`. It keeps its size, unless it stood so steeply to the
/// plane (60 degrees) that its direction there would be a guess.
#[inline(always)]
pub fn into_plane(force: [f64; 3], normal: [f64; 3]) -> [f64; 3] {
    let flat = minus(force, times(normal, dot(force, normal)));
    let (square, whole) = (dot(flat, flat), dot(force, force));
    let longer = (whole / square).sqrt();
    times(flat, if square > 0.25 * whole { longer } else { 1.0 })
}

/// The force of a spring that is stretched by `slip`; `spring` is what it had before [N], in the tangent plane and scaled.
///
/// One formula for one contact and for eight: without branches, both sides of each choice are computed and one is taken, so that
/// [`crate::law::block`] forms all lanes of a register at once.
#[inline(always)]
pub fn friction_force(spring: [f64; 3], slip: &Slip) -> FrictionForce {
    let Slip { rate, stiffness, dashpot, limit, h } = *slip;
    // Half an increment of slip.
    let half = times(rate, 0.5 * h * stiffness);
    let trial = minus(spring, half);
    let size = dot(trial, trial).sqrt();
    let slides = size > limit;
    // Sliding: cut, without dashpot.
    let cut = times(trial, limit / size);
    // Sticking: with the dashpot, shortened until both are within the limit.
    let viscous = times(rate, -dashpot * stiffness.sqrt());
    let limit2 = limit * limit;
    let sum = [trial[0] + viscous[0], trial[1] + viscous[1], trial[2] + viscous[2]];
    let (against, viscous2) = (dot(trial, viscous), dot(viscous, viscous));
    let beside = limit2 - dot(trial, trial);
    let room = if beside > 0.0 { beside } else { 0.0 };
    let share = ((against * against + viscous2 * room).sqrt() - against) / viscous2;
    let share = share.clamp(0.0, 1.0);
    // A spring at its limit and rounding above it, without a dashpot: the share would be 0 / 0.
    let share = if dot(sum, sum) <= limit2 || viscous2 == 0.0 { 1.0 } else { share };
    let stuck = [trial[0] + viscous[0] * share, trial[1] + viscous[1] * share, trial[2] + viscous[2] * share];
    let elastic = choose(slides, cut, trial);
    let force = choose(slides, cut, stuck);
    let end = minus(elastic, half);
    let size = dot(end, end).sqrt();
    let shorter = limit / size;
    let end = times(end, if size > limit { shorter } else { 1.0 });
    FrictionForce {
        force,
        spring: end,
        power: 0.0 - dot(force, rate),
        energy: 0.5 * dot(end, end) / stiffness,
    }
}

impl Tangential {
    /// What of the force of the spring is left as the overlap goes from `before` (0: there was none) to
    /// `overlap` [m].
    #[inline]
    pub fn carried(&self, overlap: f64, before: f64) -> f64 {
        match self.history {
            TangentialName::Incremental => 1.0,
            TangentialName::UnloadingScaled => left_on_unloading(overlap, before, self.stiffening),
            TangentialName::Secant if before > 0.0 => root_of_power(overlap / before, 2.0 * self.stiffening),
            TangentialName::Secant => 1.0,
        }
    }

    /// Coulomb coefficient at the slip rate `slip` [m/s]. A dependence on anything but `sliding` must be asked for in
    /// [`crate::law::block`] too, where eight contacts are computed at once.
    #[inline]
    pub fn coefficient(&self, slip: &Vector3<f64>) -> f64 {
        match &self.sliding {
            Some(s) => s.friction + (self.friction - s.friction) * (-s.decay * slip.norm()).exp(),
            None => self.friction,
        }
    }
}

/// What of a spring's force is left as its contact unloads from `before` to `overlap` [m]: it goes with the contact area, and
/// where the stiffness falls faster than that (`stiffening` above 1) with the root of the stiffness, so that no energy is made.
#[inline]
pub fn left_on_unloading(overlap: f64, before: f64, stiffening: f64) -> f64 {
    if overlap < before { root_of_power(overlap / before, stiffening.max(1.0)) } else { 1.0 }
}

/// `ratio^(power / 2)`.
#[inline]
fn root_of_power(ratio: f64, power: f64) -> f64 {
    if power == 1.0 {
        ratio.sqrt()
    } else if power == 0.0 {
        1.0
    } else {
        ratio.powf(0.5 * power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: Tangential = Tangential {
        friction: 0.5,
        stiffness_ratio: 0.8,
        history: TangentialName::UnloadingScaled,
        stiffening: 0.5,
        sliding: None,
    };

    /// The force with normal stiffness `stiffness` [N/m] under the normal force `normal` [N], and its spring.
    fn grip(
        law: &Tangential,
        [stiffness, dashpot, normal, h]: [f64; 4],
        spring: Vector3<f64>,
        rate: Vector3<f64>,
    ) -> [Vector3<f64>; 2] {
        let limit = law.coefficient(&rate) * normal;
        let slip = Slip { rate: rate.into(), stiffness: law.stiffness_ratio * stiffness, dashpot, limit, h };
        let found = friction_force(spring.into(), &slip);
        [found.force.into(), found.spring.into()]
    }

    #[test]
    fn in_stick_the_work_of_the_slip_is_the_energy_of_the_spring() {
        let slip = Vector3::new(0.3, -0.1, 0.0);
        let (mut spring, mut work) = (Vector3::new(0.0, 2.0, 0.0), 0.0);
        let before = 0.5 * spring.norm_squared() / (0.8 * 1e5);
        for _ in 0..10 {
            let [force, end] = grip(&LAW, [1e5, 0.0, 1e3, 1e-4], spring, slip);
            work -= force.dot(&slip) * 1e-4;
            spring = end;
        }
        let after = 0.5 * spring.norm_squared() / (0.8 * 1e5);
        // Ten sums of numbers as large as the energies.
        assert!((work - (after - before)).abs() < 20.0 * f64::EPSILON * after.max(before));
    }

    #[test]
    fn force_and_spring_stay_within_the_limit_and_oppose_the_slip() {
        for size in [0.0, 10.0, 49.0, 51.0, 500.0] {
            for dashpot in [0.0, 1.0, 300.0] {
                for slip in [Vector3::x(), -Vector3::x(), Vector3::y() * 0.01] {
                    let found = grip(&LAW, [1e5, dashpot, 100.0, 1e-5], Vector3::x() * size, slip);
                    assert!(found.iter().all(|f| f.norm() <= 50.0 * (1.0 + 1e-15)), "{found:?}");
                }
            }
        }
        let [sliding, _] = grip(&LAW, [1e5, 5.0, 100.0, 1.0], Vector3::zeros(), Vector3::x());
        assert!((sliding + Vector3::x() * 50.0).norm() < 1e-13);
    }

    #[test]
    fn friction_falls_from_rest_to_fast_slip() {
        let law = Tangential { sliding: Some(Sliding { friction: 0.2, decay: 5.0 }), ..LAW };
        for (speed, friction) in [(0.0, 0.5), (0.2, 0.2 + 0.3 / std::f64::consts::E), (100.0, 0.2)] {
            let slip = Vector3::y() * speed;
            let [force, _] = grip(&law, [1e5, 0.0, 100.0, 1e-9], Vector3::x() * 1e3, slip);
            assert!((force.norm() / (100.0 * friction) - 1.0).abs() < 1e-14, "{speed} m/s: {force:?}");
        }
    }

    #[test]
    fn the_spring_follows_the_overlap_as_its_variant_says() {
        let share = |history, stiffening, d| Tangential { history, stiffening, ..LAW }.carried(d, 1e-3);
        let (deeper, less) = (4e-3, 2.5e-4);
        assert_eq!(
            [share(TangentialName::Incremental, 0.5, deeper), share(TangentialName::Incremental, 0.5, less)],
            [1.0; 2]
        );
        let scaled = TangentialName::UnloadingScaled;
        assert_eq!([share(scaled, 0.5, deeper), share(scaled, 0.5, less)], [1.0, 0.5]);
        let secant = TangentialName::Secant;
        assert_eq!(
            [share(secant, 0.5, deeper), share(secant, 0.5, less), share(secant, 0.0, less)],
            [2.0, 0.5, 1.0]
        );
        // Where the stiffness goes with the overlap squared, its root is less than that of the overlap.
        assert_eq!([share(scaled, 2.0, less), share(secant, 2.0, less)], [0.25, 0.0625]);
        assert_eq!(Tangential { history: secant, ..LAW }.carried(1e-3, 0.0), 1.0);
    }

    /// The energy of the spring is f^2 / (2 k_t), and k_t goes with the overlap as the law says.
    #[test]
    fn unloading_makes_no_energy_however_fast_the_stiffness_falls() {
        for stiffening in [0.0, 0.5, 1.0, 1.7, 2.0, 4.0] {
            for less in [1e-6, 0.1, 0.5, 0.999] {
                let energy = left_on_unloading(less, 1.0, stiffening).powi(2) / less.powf(stiffening);
                assert!(energy <= 1.0 + 1e-14, "{stiffening} {less}: {energy}");
            }
        }
    }

    #[test]
    fn a_dashpot_against_the_spring_is_cut_where_the_sum_reaches_the_limit() {
        let [force, _] = grip(&LAW, [1e5, 1e3, 100.0, 1e-9], Vector3::x() * 40.0, Vector3::x());
        assert!((force + Vector3::x() * 50.0).norm() < 1e-10, "{force:?}");
    }

    /// Without a dashpot a spring that rounding leaves above its limit gave 0 / 0 where eight contacts were computed at once.
    #[test]
    fn a_spring_at_its_limit_without_a_dashpot_has_a_force() {
        for k in 0..1000 {
            let direction = Vector3::new(1.0, 0.3 + 1e-3 * f64::from(k), 0.7).normalize();
            let [force, end] = grip(&LAW, [1e5, 0.0, 1.0, 1e-4], direction * 0.5, Vector3::zeros());
            assert!((force.norm() - 0.5).abs() < 1e-15 && end == force, "{k}: {force:?}");
        }
    }

    #[test]
    fn laid_into_the_plane_a_force_keeps_its_size() {
        let normal = Vector3::new(1.0, 2.0, -0.5).normalize();
        let laid = |force: Vector3<f64>| Vector3::from(into_plane(force.into(), normal.into()));
        let flat = laid(Vector3::new(3.0, 0.1, 0.2));
        assert!(flat.dot(&normal).abs() < 1e-15);
        assert!((flat.norm() - Vector3::new(3.0_f64, 0.1, 0.2).norm()).abs() < 1e-15);
        assert_eq!(laid(Vector3::zeros()), Vector3::zeros());
        assert!(laid(normal * 5.0).norm() < 1e-14);
    }
}
