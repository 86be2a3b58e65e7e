//! A rock as a whole on ground that gives way ([`crate::law::yielding`]).
//!
//! One depth and one memory for the rock, whatever spheres touch and whatever zones they lie in: the equivalent overlap of all its
//! contacts. The law is that of the ground below the sphere that is pressed in most; where another takes over, the force stays.

use super::terrain::{Group, Seat, WholeRockContact, WholeRockContacts};
use super::{Pressed, Whole};
use crate::contact::history::SurfaceHistory;
use crate::contact::pipeline::Sums;
use crate::law::Law;
use crate::law::table::SurfaceLaws;
use crate::law::yielding::{Dent, Pressing};
use crate::rock::{Motion, Rock};

impl Sums {
    /// Add the drag of the ground under `law` on a rock of `radius` [m] that is in by `depth` [m].
    pub(super) fn scar(&mut self, law: &Law, radius: f64, depth: f64, now: &Motion) {
        let Some(scarring) = &law.scarring else { return };
        let force = scarring.force(radius, depth, &now.velocity);
        self.force += force;
        self.damping_power -= force.dot(&now.velocity);
    }
}

impl Sums {
    /// Add the rolling resistance of the rut under `law` on a rock of `radius` [m] that the ground pushes with `force` [N].
    fn roll(&mut self, law: &Law, (radius, force): (f64, f64), rock: &Rock, now: &Motion, h: f64) {
        let Some(rut) = &law.rut else { return };
        let spin = rock.spin(now);
        let moment = rut.moment(radius, force, &spin, rock.inertia.min(), h);
        self.torque += moment;
        self.friction_power -= moment.dot(&spin);
    }
}

impl WholeRockContacts {
    /// Those that touch.
    fn touching(&self) -> impl Iterator<Item = &WholeRockContact> {
        self.contacts.iter().filter(|c| c.overlap > 0.0)
    }

    /// The equivalent overlap of all that touch [m], and the law below the one that is pressed in most; `None` if none touches.
    fn seat(&self, whole: &Whole, laws: SurfaceLaws) -> Option<(f64, u16)> {
        let (mut sum, mut most) = (0.0, (0.0, 0));
        for contact in self.touching() {
            let part = whole.part(contact.sphere, contact.overlap);
            sum += part;
            if part > most.0 {
                most = (part, contact.triangle);
            }
        }
        let overlap = whole.equivalent(sum);
        (overlap > f64::MIN_POSITIVE).then(|| (overlap, laws.number(most.1)))
    }

    /// Energy of the contacts that were found, as far as it may come back [J].
    pub(super) fn energy_on_ground(&self, whole: &Whole, laws: SurfaceLaws, dent: &Dent) -> f64 {
        let Some((overlap, law)) = self.seat(whole, laws) else { return 0.0 };
        // The memory is that of the step's middle; another law takes over in the next.
        let law = if dent.deepest > 0.0 { dent.law } else { law };
        dent.stored(&laws.laws[law as usize], whole.radius, overlap)
    }

    /// As [`WholeRockContacts::forces`]; `dent` is what the ground remembers from the step before, and then after this one.
    pub(super) fn forces_on_ground(
        &mut self,
        rock: &Rock,
        whole: &Whole,
        laws: SurfaceLaws,
        now: &Motion,
        h: f64,
        (before, dent): (&[SurfaceHistory], &mut Dent),
    ) -> Sums {
        let mut histories = std::mem::take(&mut self.histories);
        histories.clear();
        let mut sums = Sums { fastest: now.velocity.norm(), ..Sums::default() };
        if let Some((overlap, number)) = self.seat(whole, laws) {
            if dent.law != number {
                let both = [dent.law, number].map(|n| &laws.laws[n as usize]);
                sums.yielded += dent.pass_to(number, both, whole.radius, overlap);
            }
            let law = &laws.laws[number as usize];
            let pressed = Pressed { overlap, stiffness: 0.0, force: 0.0, energy: 0.0 };
            let mut group = Group {
                law,
                pressed,
                weights: 0.0,
                rate: 0.0,
                travel: 0.0,
                viscous: 0.0,
                mass: 0.0,
                seated: [0.0; 2],
            };
            Self::weigh(&mut group, whole, self.touching(), rock, now);
            let (rate, mass) = (group.rate, group.mass);
            let felt =
                dent.press(law, whole.radius, &Pressing { overlap, rate, travel: group.travel * h, mass });
            let (force, stiffness) = (felt.load.force, felt.load.stiffness);
            group.pressed = Pressed { stiffness, force, energy: felt.load.energy, ..pressed };
            group.seated = [felt.dashpot * group.weights, 2.0 * felt.ratio].map(|c| c * group.mass.sqrt());
            sums.yielded += felt.lost;
            sums.elastic += felt.load.energy;
            if force > 0.0 {
                sums.scar(law, whole.radius, overlap, now);
                sums.roll(law, (whole.radius, force * group.weights), rock, now, h);
                let seat = Seat { group: &group, rock, whole, now, spin: rock.spin(now), h, before };
                self.touching().for_each(|contact| seat.add(contact, &mut histories, &mut sums));
            }
            let deepest = self.touching().map(|c| c.overlap).fold(0.0, f64::max);
            sums.penetration = sums.penetration.max(deepest / whole.radius);
        } else {
            *dent = Dent::default();
        }
        self.histories = histories;
        sums
    }
}
