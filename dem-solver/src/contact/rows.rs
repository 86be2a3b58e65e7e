//! The contacts of a rock with one partner at one instant, as the law sees them: whoever finds them adds a row for each, the law
//! answers all of them together, and what they amount to is summed up once.

use crate::law::Law;
use crate::law::block::{Block, WIDTH};
use crate::law::contact_point::{Answer, Meeting, Past};
use nalgebra::Vector3;

/// The contacts and the answers, in the order in which they were added; buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    blocks: Vec<Block>,
    /// Blocks in use.
    used: usize,
}

impl Rows {
    /// Room for so many contacts of one law.
    pub fn reserve(&mut self, contacts: usize) {
        let blocks = contacts.div_ceil(WIDTH).max(self.blocks.len());
        self.blocks.resize(blocks, Block::default());
    }

    /// Begin anew.
    pub fn clear(&mut self) {
        self.used = 0;
    }

    /// Add a contact under law number `law` of `laws`.
    #[inline(always)]
    pub fn push(&mut self, meeting: Meeting, past: Past, law: u16, laws: &[Law]) {
        let fits = |block: &Block| block.law == law && !block.is_full();
        if self.used == 0 || !fits(&self.blocks[self.used - 1]) {
            self.begin(law, &laws[law as usize]);
        }
        self.blocks[self.used - 1].push(&meeting, &past);
    }

    #[inline(never)]
    fn begin(&mut self, number: u16, law: &Law) {
        if self.used == self.blocks.len() {
            self.blocks.push(Block::default());
        }
        self.blocks[self.used].begin(number, law);
        self.used += 1;
    }

    /// Answer all contacts in the middle of a step of `h` [s]; `laws` are those that the numbers mean.
    pub fn answer(&mut self, laws: &[Law], h: f64) {
        for block in &mut self.blocks[..self.used] {
            block.compute(&laws[block.law as usize], h);
        }
    }

    /// The answers.
    #[inline(always)]
    pub fn answers(&self) -> impl Iterator<Item = Answer> + '_ {
        self.blocks[..self.used].iter().flat_map(|block| (0..block.count).map(|l| block.answer(l)))
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
