//! The law applied to one contact at one instant: what two bodies in contact do to each other.
//!
//! The first body is a sphere of a rock, the other a mesh or another sphere; the law does not see
//! which. The normal points from the first into the other, `v_n > 0` means approaching, the force on
//! the first is `-F_n n + f_t`, the other takes the opposite. Force and moment of a part that the law
//! does not have are not computed.
//!
//! Source: Thornton, Cummins and Cleary (2013), Powder Technology 233, 30 (Hertz, Mindlin, dashpot, Coulomb); a force that
//! ends where it would pull: Schwager and Poeschel (2007), Granular Matter 9, 465.

use crate::law::Law;
use crate::law::normal::Load;
use crate::law::tangential::{Slip, friction_force, into_plane, slip_rate};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Two bodies in contact. All vectors in one frame.
#[derive(Debug, Clone, Copy)]
pub struct ContactPoint {
    /// Unit vector from the first into the other.
    pub normal: Vector3<f64>,
    /// Overlap, above 0 [m].
    pub overlap: f64,
    /// Effective radius: the sphere's at a mesh, `R1 R2 / (R1 + R2)` of two spheres [m].
    pub radius: f64,
    /// Velocity of the first past the other at the contact point [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity of the first past the other [rad/s]; read where there is rolling resistance.
    pub spin: Vector3<f64>,
    /// Least inertia against that spin, shared among the body's contacts [kg m2]; read likewise.
    pub inertia: f64,
    /// `2 g sqrt(m*)` [kg^(1/2)] of [`crate::law::damping::Damping::coefficient`], 0 without dashpot.
    pub dashpot: f64,
    /// Displacement of the other since the step before that no velocity has shown [m]: a net whose motion in the window
    /// before was predicted begins the next one where it really is.
    pub jump: Vector3<f64>,
}

/// What a contact keeps from step to step, in the frame of the contact point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Force of the tangential spring at the step's end [N].
    pub spring: Vector3<f64>,
    /// Moment of the rolling spring at the step's end [N m].
    pub moment: Vector3<f64>,
    /// Overlap in the middle of the step [m]; 0: there was no contact.
    pub overlap: f64,
}

impl History {
    /// The same in another frame, to which `turn` turns vectors.
    #[inline]
    pub fn turned(&self, turn: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Self {
        Self { spring: turn(&self.spring), moment: turn(&self.moment), overlap: self.overlap }
    }
}

/// What the contact does to the first body in the middle of the step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Response {
    /// Elastic load along the normal.
    pub load: Load,
    /// Force, at the contact point [N].
    pub force: Vector3<f64>,
    /// Moment of the rolling resistance [N m].
    pub moment: Vector3<f64>,
    /// Tangential spring at the step's end [N].
    pub spring: Vector3<f64>,
    /// Rolling spring at the step's end [N m].
    pub rolled: Vector3<f64>,
    /// Power of the dashpot along the normal [W].
    pub damping_power: f64,
    /// Power that friction and rolling resistance take from the motion [W].
    pub friction_power: f64,
    /// Energy of the tangential and rolling springs at the step's end [J].
    pub tangential_energy: f64,
    /// Energy that the tangential spring has taken up by [`ContactPoint::jump`] [J].
    pub jump_energy: f64,
}

impl Response {
    /// What the contact keeps of it, with its `overlap` [m].
    #[inline]
    pub fn history(&self, overlap: f64) -> History {
        History { spring: self.spring, moment: self.rolled, overlap }
    }
}

impl Law {
    /// The response to `point` in the middle of a step of `h` [s] (0: at an instant that no step surrounds).
    #[inline]
    pub fn respond(&self, point: &ContactPoint, history: &History, h: f64) -> Response {
        let load = self.normal.load(point.radius, point.overlap);
        let normal_force = self.normal_force(&load, point.dashpot, point.velocity.dot(&point.normal));
        self.respond_along(load, normal_force, point, history, h)
    }

    /// The force along the normal [N] of a contact that closes in with `approach` [m/s]: the elastic one, and its dashpot.
    #[inline(always)]
    pub fn normal_force(&self, load: &Load, dashpot: f64, approach: f64) -> f64 {
        let both = load.force + dashpot * load.stiffness.sqrt() * approach;
        // Rocks do not stick.
        let pushed = if both > 0.0 { both } else { 0.0 };
        if self.damping.is_some() { pushed } else { load.force }
    }

    /// The response along the surface, where elastic load and normal force [N] are known.
    #[inline]
    pub fn respond_along(
        &self,
        load: Load,
        normal_force: f64,
        point: &ContactPoint,
        history: &History,
        h: f64,
    ) -> Response {
        let normal = &point.normal;
        let approach = point.velocity.dot(normal);
        let mut response = Response {
            load,
            force: normal * -normal_force,
            damping_power: (normal_force - load.force) * approach,
            ..Response::default()
        };
        if let Some(tangential) = &self.tangential {
            let stiffness = tangential.stiffness_ratio * load.stiffness;
            let mut spring = Vector3::from(into_plane(history.spring.into(), point.normal.into()))
                * tangential.carried(point.overlap, history.overlap);
            if point.jump != Vector3::zeros() {
                let stretched = spring + (point.jump - normal * point.jump.dot(normal)) * stiffness;
                response.jump_energy = (stretched.norm_squared() - spring.norm_squared()) / (2.0 * stiffness);
                spring = stretched;
            }
            let rate = slip_rate(point.velocity.into(), point.normal.into(), approach);
            let limit = tangential.coefficient(&rate.into()) * normal_force;
            let slip = Slip { rate, stiffness, dashpot: point.dashpot, limit, h };
            let friction = friction_force(spring.into(), &slip);
            response.force += Vector3::from(friction.force);
            response.friction_power = friction.power;
            response.tangential_energy = friction.energy;
            response.spring = friction.spring.into();
        }
        if let Some(rolling) = &self.rolling {
            let turn = rolling.resist(&load, normal_force, point, history, h);
            response.moment = turn.moment;
            response.friction_power -= turn.moment.dot(&point.spin);
            response.tangential_energy += turn.energy;
            response.rolled = turn.spring;
        }
        response
    }
}

#[cfg(test)]
mod tests;
