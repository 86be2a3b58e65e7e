//! The contacts of a rock with one partner at one instant, as the law sees them: whoever finds them adds a row for each, the law
//! answers all of them together, and what they amount to is summed up once.

use super::Law;
use super::pair::{Answer, Meeting, Past};
use nalgebra::Vector3;

/// The contacts and the answers, in the order in which they were added; buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    meetings: Vec<Meeting>,
    pasts: Vec<Past>,
    /// Runs of contacts with one law: its number, and where the run ends.
    runs: Vec<(u16, usize)>,
    /// What the law answered.
    pub answers: Vec<Answer>,
}

impl Rows {
    /// Room for so many contacts.
    pub fn reserve(&mut self, contacts: usize) {
        self.meetings.reserve(contacts);
        self.pasts.reserve(contacts);
        self.answers.reserve(contacts);
        // Each contact may have a law of its own.
        self.runs.reserve(contacts);
    }

    /// Begin anew.
    pub fn clear(&mut self) {
        self.meetings.clear();
        self.pasts.clear();
        self.runs.clear();
        self.answers.clear();
    }

    /// Add a contact under law number `law`.
    #[inline]
    pub fn push(&mut self, meeting: Meeting, past: Past, law: u16) {
        self.meetings.push(meeting);
        self.pasts.push(past);
        match self.runs.last_mut() {
            Some((known, end)) if *known == law => *end += 1,
            _ => self.runs.push((law, self.meetings.len())),
        }
    }

    /// Answer all contacts in the middle of a step of `h` [s]; `laws` are those that the numbers mean.
    pub fn answer(&mut self, laws: &[Law], h: f64) {
        self.answers.clear();
        let mut from = 0;
        for &(law, to) in &self.runs {
            let (meetings, pasts) = (&self.meetings[from..to], &self.pasts[from..to]);
            laws[law as usize].answers(meetings, pasts, h, &mut self.answers);
            from = to;
        }
    }
}

/// Sums over the contacts of a rock with one partner.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sums {
    /// Force on the rock [N].
    pub force: Vector3<f64>,
    /// Torque on the rock about its centre of mass [N m].
    pub torque: Vector3<f64>,
    /// Elastic energy of the normal springs [J].
    pub elastic: f64,
    /// Power of the dashpots along the normals [W].
    pub damped: f64,
    /// Power that tangential forces and rolling resistance take from the motion [W].
    pub rubbed: f64,
    /// Energy of the tangential and rolling springs after the step [J].
    pub sheared: f64,
    /// Energy that they have taken up between two windows ([`Past::jump`]) [J].
    pub jumped: f64,
    /// Largest overlap over radius.
    pub penetration: f64,
    /// Largest speed of the partner's surface past the rock's centre [m/s].
    pub fastest: f64,
}

impl Sums {
    /// Add a contact that counts `share` times, with its point at `arm` [m] from the centre of mass and the overlap
    /// `penetration` over its radius; the force on the rock [N].
    #[inline]
    pub fn add(&mut self, answer: &Answer, share: f64, arm: &Vector3<f64>, penetration: f64) -> Vector3<f64> {
        let force = answer.force * share;
        self.damped += answer.damped * share;
        self.rubbed += answer.rubbed * share;
        self.sheared += answer.sheared * share;
        self.jumped += answer.jumped * share;
        self.elastic += answer.load.energy * share;
        self.penetration = self.penetration.max(penetration);
        self.force += force;
        self.torque += arm.cross(&force) + answer.moment * share;
        force
    }
}
