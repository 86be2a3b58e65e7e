//! Why a step went wrong, with the numbers: what passed the gate and is yet too soft, too small or too long.

use crate::gate::landing::{LIMIT, stiffer, worst};
use crate::model::impact::Impact;
use crate::model::state::Against;
use crate::model::{Model, Span, name_of};
use dem_contact::law::normal::Normal;
use dem_contact::rock::{Motion, Rock};
use interface_defs::Fault;

/// How much more kinetic energy than start and gravity give shows that contact forces gain energy: further than what is
/// lost or made to the order of the scheme.
const GAINED: f64 = 1.1;

/// A surface that closes in so many times as fast as rock and impact is driven by the other solver.
const DRIVEN: f64 = 3.0;

/// Largest overlap over the radius that a cure aims at, below the bound.
const AIM: f64 = LIMIT;

/// A step of one rock in contact with something.
#[derive(Clone, Copy)]
pub struct Case<'a> {
    /// What is computed.
    pub model: &'a Model,
    /// Number of the rock.
    pub rock: usize,
    /// What it touches.
    pub against: Against,
    /// Number of the law, if there is one.
    pub law: Option<usize>,
    /// If it touches another rock.
    pub pair: Option<Pair>,
    /// Its first touch of the net.
    pub impact: Option<Impact>,
    /// The step.
    pub span: Span,
}

/// Two rocks that touch.
#[derive(Clone, Copy)]
pub struct Pair {
    /// Their numbers.
    pub rocks: [usize; 2],
    /// Smallest radius of their spheres [m].
    pub smallest: f64,
    /// Radius of one contact by the law [m].
    pub effective: f64,
    /// Effective mass in it [kg].
    pub mass: f64,
}

impl<'a> Case<'a> {
    /// Of rock number `rock`, under the first of its laws with what it touches.
    pub fn new(model: &'a Model, rock: usize, against: Against, span: Span) -> Self {
        let rows: &[Vec<u16>] = match against {
            Against::Net => &model.rows,
            Against::Terrain => &model.ground_rows,
            Against::Sides => &model.side_rows,
            Against::Rocks => &[],
        };
        let law = rows.get(rock).and_then(|row| row.first()).map(|law| usize::from(*law));
        Self { model, rock, against, law, pair: None, impact: None, span }
    }

    /// The rock.
    pub fn rock(&self) -> &Rock {
        &self.model.rocks[self.rock]
    }

    /// Who it is about, and when.
    fn whose(&self) -> String {
        let name = |rock: usize| name_of(self.model, rock);
        let rocks = match self.pair {
            Some(Pair { rocks: [a, b], .. }) => format!("rocks `{}` and `{}`", name(a), name(b)),
            None => format!("rock `{}`", name(self.rock)),
        };
        format!("{rocks} at {:.6} s", self.span.start)
    }

    /// Fail the window if the surface at `speed` [m/s] goes further in the step than this share of the radius of what touches.
    /// `moves` says what goes past what.
    pub fn check_stride(&self, now: &Motion, speed: f64, share: f64, moves: &str) -> Result<(), Fault> {
        let (h, radius) = (self.span.h, self.radius());
        let stride = speed * h;
        if stride <= share * radius {
            return Ok(());
        }
        let (whose, cure) = (self.whose(), self.too_far(now, speed, share));
        Err(Fault::window(format!(
            "{whose}: {moves} by {stride:.3e} m in one step of {h:.3e} s, more than {share} times the radius {radius:.3e} m of what \
             touches, and might pass through unseen; {cure}"
        )))
    }

    /// That `what` has happened, to a rock or between two at `speed` [m/s], and `why`.
    pub fn too_deep(&self, speed: f64, what: &str, why: &str) -> Fault {
        Fault::window(format!("{}, at {speed:.4} m/s{what}; {why}", self.whose()))
    }

    /// Why spheres overlap too deep where the surface closes in with up to `speed` [m/s].
    pub fn why_too_deep(&self, now: &Motion, speed: f64) -> String {
        if let Some(why) = self.made_energy(now, speed) {
            return why;
        }
        let own = now.velocity.norm();
        let landing = match self.pair {
            Some(_) => speed,
            None => self.impact.map_or(own, |i| i.velocity.norm().max(own)),
        };
        self.too_soft(landing)
    }

    /// True if wires touch the rock's faces.
    pub fn by_faces(&self) -> bool {
        matches!(self.against, Against::Net) && self.rock().faces.is_some()
    }

    /// Radius of what touches [m].
    pub fn radius(&self) -> f64 {
        let whole = match self.against {
            Against::Terrain => self.model.wholes[self.rock].as_ref(),
            Against::Sides => self.model.side_wholes[self.rock].as_ref(),
            _ => None,
        };
        let own = match whole {
            Some(whole) => whole.radius,
            None if matches!(self.against, Against::Net) => self.rock().radius_on_wires(),
            None => self.rock().smallest_radius,
        };
        self.pair.map_or(own, |pair| pair.smallest)
    }

    /// Why the surface goes too far in one step, at `speed` [m/s].
    fn too_far(&self, now: &Motion, speed: f64, share: f64) -> String {
        if let Some(why) = self.made_energy(now, speed) {
            return why;
        }
        let radius = self.radius();
        format!(
            "the step is too long for {speed:.4} m/s and spheres of that radius: write dem.time_step = {:.1e} or less, or \
             leave it out, or make larger spheres (cluster.smallest_radius)",
            share * radius / speed
        )
    }

    /// Why motion is not finite after `before`.
    pub fn not_finite(&self, before: &Motion, overlap: f64) -> String {
        let (speed, radius, modulus) =
            (before.velocity.norm(), self.rock().smallest_radius, self.modulus(" at "));
        let seen = format!(
            "before it moved with {speed:.4e} m/s, its spheres (smallest radius {radius:.3e} m) had overlapped by up to {overlap:.2} \
             radii{modulus}"
        );
        let why = self.made_energy(before, 0.0).unwrap_or_else(|| {
            format!(
                "the contact forces have diverged within the step of {:.3e} s, which is below the critical one of {:.3e} s \
                 for {:.4} m/s: shorten coupling.time_window, or dem.time_step where nothing is coupled",
                self.span.h, self.model.steps.critical, self.model.steps.speed
            )
        });
        format!("{seen}; {why}")
    }

    /// Modulus of the contact behind these words; nothing where the scene gives none.
    pub fn modulus(&self, before: &str) -> String {
        let young = self.law.and_then(|law| self.model.settings.contacts.get(law)?.young);
        young.map_or(String::new(), |young| format!("{before}E = {young:.3e} Pa"))
    }

    fn inside(&self) -> Option<String> {
        // A touch before the start is one that the start was already in.
        let inside = self.impact.map_or(self.span.start <= 0.0, |i| i.time < 0.0);
        inside.then(|| {
            format!(
                "they touched from the first step on, the rock starts inside: move rock.{}.position",
                self.rock
            )
        })
    }

    /// The reason, if energy was made: the step is unstable, or the rock or the surface is faster than it can have become.
    fn made_energy(&self, now: &Motion, closing: f64) -> Option<String> {
        let (h, critical) = (self.span.h, self.model.steps.critical);
        if h > critical * (1.0 + 1e-9) {
            return Some(format!(
                "the step of {h:.3e} s is above the critical step of {critical:.3e} s, contact forces grow from step to step: \
                 shorten dem.time_step below it, or leave it out"
            ));
        }
        let (rock, gravity) = (self.rock(), self.model.settings.gravity);
        let cure = match self.against {
            Against::Net => "shorten coupling.time_window, or couple strongly (coupling.scheme)",
            _ => "shorten dem.time_step",
        };
        let speed = now.velocity.norm();
        let kinetic = rock.kinetic_energy(now);
        let (most, whence) = match self.impact {
            Some(i) => {
                (i.energy + rock.mass * gravity.dot(&(now.position - i.position)).max(0.0), "the impact")
            }
            None => (0.5 * rock.mass * self.model.steps.speed.powi(2), "its start"),
        };
        if most > 0.0 && kinetic > GAINED * most {
            return Some(format!(
                "the rock moves with {speed:.4e} m/s and has {kinetic:.3e} J, more than the {most:.3e} J that {whence} and \
                 gravity give it: contact forces have made energy, {cure}"
            ));
        }
        let usual = self.impact.map_or(0.0, |i| i.velocity.norm()).max(speed);
        (matches!(self.against, Against::Net) && usual > 0.0 && closing > DRIVEN * usual).then(|| {
            format!(
                "nodes of the net move with up to {closing:.4e} m/s against a rock of {usual:.4} m/s: the structure or the \
                 exchange with it has made energy, {cure}, or fem.time_step"
            )
        })
    }

    fn too_soft(&self, speed: f64) -> String {
        let laws = self.model.laws.as_ref().zip(self.law);
        let Some((laws, law)) = laws else { return "the contact is too soft".into() };
        let rock = self.rock();
        let radius = self.radius();
        let (normal, mass, expected, times) = if let Some(Pair { smallest, effective, mass, .. }) = self.pair
        {
            let normal = &laws.rocks[law].normal;
            let expected = normal.deepest(effective, mass, speed) / smallest;
            (normal, mass, expected, (expected / AIM).powf(normal.powers().overlap))
        } else {
            let (normal, energy) = (&laws.surfaces[law].normal, 0.5 * rock.mass * speed * speed);
            (normal, rock.mass, worst(rock, normal, energy), stiffer(rock, normal, energy))
        };
        if expected <= AIM {
            if let Some(why) = self.inside() {
                return why;
            }
            return format!(
                "a landing at {speed:.4} m/s alone overlaps by {expected:.2} radii at most: it is pressed further than its own \
                 energy does it, shorten coupling.time_window, or raise contact.young"
            );
        }
        let stiffness = match laws.settings[law].strength() {
            Some(("young", young)) => {
                format!("raise contact.young from {young:.3e} to {:.2e} Pa", young * times)
            }
            Some((key, value)) => format!("raise contact.{key} from {value:.3e} to {:.2e}", value * times),
            None => format!("make it {times:.1} times as stiff"),
        };
        let large = radius * larger(normal, times);
        format!(
            "for {speed:.4} m/s and {mass:.4} kg the contact is too soft, {stiffness}, or make the spheres as large as {large:.2e} m \
             (cluster.smallest_radius, or fewer): either keeps the overlap below {AIM} radii even if nothing yields"
        )
    }
}

/// How many times as large a radius does as much as `times` the stiffness, at equal overlap over radius.
fn larger(normal: &Normal, times: f64) -> f64 {
    let powers = normal.powers();
    times.powf(1.0 / (powers.overlap + powers.radius))
}
