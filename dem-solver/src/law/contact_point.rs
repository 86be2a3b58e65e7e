//! The law applied to one contact at one instant: what two bodies that meet do to each other.
//!
//! The first body is a sphere of a rock, the other a wall or another sphere; the law does not see
//! which. The normal points from the first into the other, `v_n > 0` means approaching, the force on
//! the first is `-F_n n + f_t`, the other takes the opposite. Force and moment of a part that the law
//! does not have are not computed.
//!
//! Source: handbook 1.1 to 1.6.

use crate::law::Law;
use crate::law::normal::Load;
use crate::law::tangential::into_plane;
use nalgebra::Vector3;

/// Two bodies that meet. All vectors in one frame.
#[derive(Debug, Clone, Copy)]
pub struct Meeting {
    /// Unit vector from the first into the other.
    pub normal: Vector3<f64>,
    /// Overlap, above 0 [m].
    pub overlap: f64,
    /// Effective radius: the sphere's at a wall, `R1 R2 / (R1 + R2)` of two spheres [m].
    pub radius: f64,
    /// Velocity of the first past the other at the contact point [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity of the first past the other [rad/s]; read where there is rolling resistance.
    pub spin: Vector3<f64>,
    /// Least inertia against that spin, shared among the body's contacts [kg m2]; read likewise.
    pub inertia: f64,
    /// `2 g sqrt(m*)` [kg^(1/2)] of [`crate::law::damping::Damping::coefficient`], 0 without dashpot.
    pub dashpot: f64,
}

/// What a contact has from the step before, in the frame of the meeting.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Past {
    /// Force of the tangential spring [N].
    pub spring: Vector3<f64>,
    /// Moment of the rolling spring [N m].
    pub moment: Vector3<f64>,
    /// Overlap in the middle of the step before [m]; 0: there was none.
    pub overlap: f64,
    /// Displacement of the other since that step's end that no velocity has shown [m]: a net whose motion in the window
    /// before was predicted begins the next one where it really is.
    pub jump: Vector3<f64>,
}

/// What the contact does to the first body in the middle of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
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
    pub damped: f64,
    /// Power that friction and rolling resistance take from the motion [W].
    pub rubbed: f64,
    /// Energy of the tangential and rolling springs at the step's end [J].
    pub sheared: f64,
    /// Energy that the tangential spring has taken up by [`Past::jump`] [J].
    pub jumped: f64,
}

impl Law {
    /// The answer to `meeting` in the middle of a step of `h` [s] (0: at an instant that no step surrounds).
    #[inline]
    pub fn answer(&self, meeting: &Meeting, past: &Past, h: f64) -> Answer {
        let load = self.normal.load(meeting.radius, meeting.overlap);
        let mut pressed = load.force;
        if self.damping.is_some() {
            let viscous = meeting.dashpot * load.stiffness.sqrt() * meeting.velocity.dot(&meeting.normal);
            // Rocks do not stick.
            pressed = (load.force + viscous).max(0.0);
        }
        self.answer_pressed(load, pressed, meeting, past, h)
    }

    /// The same where elastic load and normal force [N] are known: parts along the surface.
    #[inline]
    pub fn answer_pressed(&self, load: Load, pressed: f64, meeting: &Meeting, past: &Past, h: f64) -> Answer {
        let normal = &meeting.normal;
        let approach = meeting.velocity.dot(normal);
        let zero = Vector3::zeros();
        let mut answer = Answer {
            load,
            force: normal * -pressed,
            moment: zero,
            spring: zero,
            rolled: zero,
            damped: (pressed - load.force) * approach,
            rubbed: 0.0,
            sheared: 0.0,
            jumped: 0.0,
        };
        if let Some(tangential) = &self.tangential {
            let slip = meeting.velocity - normal * approach;
            let mut spring =
                into_plane(&past.spring, normal) * tangential.carried(meeting.overlap, past.overlap);
            if past.jump != zero {
                let stiffness = tangential.stiffness_ratio * load.stiffness;
                let stretched = spring + (past.jump - normal * past.jump.dot(normal)) * stiffness;
                answer.jumped = (stretched.norm_squared() - spring.norm_squared()) / (2.0 * stiffness);
                spring = stretched;
            }
            let grip = tangential.grip(load.stiffness, meeting.dashpot, spring, slip, pressed, h);
            answer.force += grip.force;
            answer.rubbed -= grip.force.dot(&slip);
            answer.sheared += grip.energy;
            answer.spring = grip.spring;
        }
        if let Some(rolling) = &self.rolling {
            let turn = rolling.resist(&load, pressed, meeting, past, h);
            answer.moment = turn.moment;
            answer.rubbed -= turn.moment.dot(&meeting.spin);
            answer.sheared += turn.energy;
            answer.rolled = turn.spring;
        }
        answer
    }
}

#[cfg(test)]
mod tests;
