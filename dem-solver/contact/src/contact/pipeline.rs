//! From contacts to forces: how the rock moves past its partner at each contact, what the law makes of it, and what all of them
//! amount to. Written once; a [`Partner`] says where its contacts are and takes the forces.
//!
//! The law and its source: [`crate::law::contact_point`].

use crate::law::Law;
use crate::law::block::{Block, WIDTH, WORTH};
use crate::law::contact_point::{ContactPoint, History, Response};
use crate::law::resistance::RollingLoad;
use nalgebra::{Matrix3, Vector3};

/// The contacts and the responses of their laws, in the order in which they were added; buffers that are used again and again.
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

    /// Add a contact under law number `law` of `laws`.
    #[inline(always)]
    pub fn push(&mut self, point: &ContactPoint, history: &History, law: u16, laws: &[Law]) {
        let fits = |block: &Block| block.law == law && !block.is_full();
        if self.used == 0 || !fits(&self.blocks[self.used - 1]) {
            self.begin(law, &laws[law as usize]);
        }
        self.blocks[self.used - 1].push(point, history);
    }

    #[inline(never)]
    fn begin(&mut self, number: u16, law: &Law) {
        if self.used == self.blocks.len() {
            self.blocks.push(Block::default());
        }
        self.blocks[self.used].begin(number, law);
        self.used += 1;
    }

    /// Let the laws, which the numbers mean, respond in the middle of a step of `h` [s].
    pub fn compute(&mut self, laws: &[Law], h: f64) {
        for block in &mut self.blocks[..self.used] {
            block.compute(&laws[block.law as usize], h);
        }
    }

    /// The responses.
    #[inline(always)]
    pub fn responses(&self) -> impl Iterator<Item = Response> + '_ {
        self.blocks[..self.used].iter().flat_map(|block| (0..block.count).map(|l| block.response(l)))
    }
}

/// Motion of a rock, in the frame of its contacts.
#[derive(Debug, Clone, Copy)]
pub struct Mover {
    /// Velocity of its centre of mass, less that of a partner that is a rock too [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity [rad/s].
    pub spin: Vector3<f64>,
    /// The same, less that of a partner that is a rock too.
    pub relative_spin: Vector3<f64>,
    /// Inertia against that spin, shared among the contacts [kg m2]; read where there is rolling resistance between rocks.
    pub inertia: f64,
}

/// Geometry of a contact.
#[derive(Debug, Clone, Copy)]
pub struct Site {
    /// Unit vector from the rock into the partner.
    pub normal: Vector3<f64>,
    /// Overlap, above 0 [m].
    pub overlap: f64,
    /// Effective radius [m].
    pub radius: f64,
    /// Radius that the overlap is compared with: of two spheres the smaller [m].
    pub smaller: f64,
    /// The contact point, from the rock's centre of mass [m].
    pub arm: Vector3<f64>,
    /// Multiplicity with which it counts.
    pub weight: f64,
}

/// A partner of a rock in contact.
pub trait Partner {
    /// One of its contacts.
    type Contact;

    /// Number of the law.
    fn law(&self, contact: &Self::Contact) -> u16;

    /// Geometry of the contact.
    fn site(&self, contact: &Self::Contact) -> Site;

    /// Velocity of the partner's point past the frame [m/s]. Default: it stands still.
    fn velocity(&self, _contact: &Self::Contact, _site: &Site) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// `2 g sqrt(m*)` of the dashpot of `law` [kg^(1/2)], see [`crate::law::damping`].
    fn dashpot(&mut self, contact: &Self::Contact, law: &Law) -> f64;

    /// What contact number `number` has from the step before, `law` being one that remembers.
    fn history(&mut self, number: usize, contact: &Self::Contact) -> History;

    /// Displacement that no velocity has shown, see [`ContactPoint::jump`]. Default: none.
    fn jump(&self, _contact: &Self::Contact) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// Keep what a contact takes to the next step.
    fn keep(&mut self, contact: &Self::Contact, site: &Site, history: History);

    /// Take the opposite of force [N] and moment [N m] on the rock. Default: nothing that feels them.
    fn react(&mut self, _touch: &Self::Contact, _site: &Site, _force: &Vector3<f64>, _moment: &Vector3<f64>) {
    }
}

/// Forces of `contacts` in the middle of a step of `h` [s] (0: at an instant that no step surrounds), in the frame of the contacts.
pub fn forces<P: Partner>(
    partner: &mut P,
    contacts: &[P::Contact],
    rock: &Mover,
    laws: &[Law],
    rows: &mut Rows,
    h: f64,
) -> Sums {
    let mut sums = Sums { contacts: contacts.len(), ..Sums::default() };
    // Columns for one or two contacts cost more than they save.
    if contacts.len() < WORTH {
        let mut few = [None; WORTH - 1];
        for (number, contact) in contacts.iter().enumerate() {
            few[number] = Some(state(partner, number, contact, rock, laws));
        }
        for (contact, (of, site, point, history)) in contacts.iter().zip(few.iter().flatten()) {
            let law = &laws[*of as usize];
            take(partner, contact, site, law, &law.respond(point, history, h), &mut sums);
        }
        return sums;
    }
    rows.used = 0;
    for (number, contact) in contacts.iter().enumerate() {
        let (of, _, point, history) = state(partner, number, contact, rock, laws);
        rows.push(&point, &history, of, laws);
    }
    rows.compute(laws, h);
    for (contact, response) in contacts.iter().zip(rows.responses()) {
        let site = partner.site(contact);
        let law = &laws[partner.law(contact) as usize];
        take(partner, contact, &site, law, &response, &mut sums);
    }
    sums
}

/// What the law of contact number `number` responds to.
#[inline(always)]
fn state<P: Partner>(
    partner: &mut P,
    number: usize,
    contact: &P::Contact,
    rock: &Mover,
    laws: &[Law],
) -> (u16, Site, ContactPoint, History) {
    let of = partner.law(contact);
    let law = &laws[of as usize];
    let site = partner.site(contact);
    let velocity = if law.needs_rates() {
        rock.velocity + rock.spin.cross(&site.arm) - partner.velocity(contact, &site)
    } else {
        Vector3::zeros()
    };
    let history = if law.remembers() { partner.history(number, contact) } else { History::default() };
    let point = ContactPoint {
        normal: site.normal,
        overlap: site.overlap,
        radius: site.radius,
        velocity,
        spin: rock.relative_spin,
        inertia: rock.inertia,
        dashpot: partner.dashpot(contact, law),
        jump: if history.overlap > 0.0 { partner.jump(contact) } else { Vector3::zeros() },
    };
    (of, site, point, history)
}

/// Add the response of a contact, to both sides.
#[inline(always)]
fn take<P: Partner>(
    partner: &mut P,
    contact: &P::Contact,
    site: &Site,
    law: &Law,
    response: &Response,
    sums: &mut Sums,
) {
    if law.remembers() {
        partner.keep(contact, site, response.history(site.overlap));
    }
    let force = sums.add(response, site);
    if let Some(resistance) = &law.resistance {
        sums.rolling.add(resistance, site.normal * -force.dot(&site.normal));
    }
    partner.react(contact, site, &force, &response.moment);
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
    pub damping_power: f64,
    /// Power that tangential forces and rolling resistance take from the motion [W].
    pub friction_power: f64,
    /// Energy of the tangential and rolling springs after the step [J].
    pub tangential_energy: f64,
    /// Energy that they have taken up between two windows ([`ContactPoint::jump`]) [J].
    pub jump_energy: f64,
    /// Energy lost to ground that gives way [J].
    pub yielded: f64,
    /// What presses it where rolling is resisted.
    pub rolling: RollingLoad,
    /// Number of contacts.
    pub contacts: usize,
    /// Largest overlap over radius.
    pub penetration: f64,
    /// Largest speed of the partner's surface past the rock's centre [m/s].
    pub fastest: f64,
}

impl Sums {
    /// Add a contact; the force on the rock [N].
    #[inline]
    pub fn add(&mut self, response: &Response, site: &Site) -> Vector3<f64> {
        let weight = site.weight;
        let force = response.force * weight;
        self.damping_power += response.damping_power * weight;
        self.friction_power += response.friction_power * weight;
        self.tangential_energy += response.tangential_energy * weight;
        self.jump_energy += response.jump_energy * weight;
        self.elastic += response.load.energy * weight;
        self.penetration = self.penetration.max(site.overlap / site.smaller);
        self.force += force;
        self.torque += site.arm.cross(&force) + response.moment * weight;
        force
    }

    /// Add those with another partner.
    pub fn add_all(&mut self, other: &Self) {
        self.force += other.force;
        self.torque += other.torque;
        self.elastic += other.elastic;
        self.damping_power += other.damping_power;
        self.friction_power += other.friction_power;
        self.tangential_energy += other.tangential_energy;
        self.jump_energy += other.jump_energy;
        self.yielded += other.yielded;
        self.rolling.add_all(&other.rolling);
        self.contacts += other.contacts;
        self.penetration = self.penetration.max(other.penetration);
        self.fastest = self.fastest.max(other.fastest);
    }

    /// Turn force and torque by `rotation` to another frame.
    pub fn turn(&mut self, rotation: &Matrix3<f64>) {
        self.force = rotation * self.force;
        self.torque = rotation * self.torque;
        self.rolling.turn(rotation);
    }
}
