//! What follows from what crosses the interface, for a solver that does not report it itself: motion of the structure's nodes, force
//! of the contact, and the energies of both as their gauges say.
//!
//! The direction of the impact is that of the contact's force in the first window that has one. The net is deepest where no node has
//! gone further in it while there is contact: whatever pushes it has no speed along that direction then. The mean reaction follows from
//! the momentum `p` of the nodes with a mass, `R = dp/dt - F - m g`.

use crate::guard::Answered;
use crate::schedule::Span;
use interface_defs::verdict::{Fate, Verdict};
use interface_defs::{Measure, Statistics, Worse};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Least time over which the reaction is a mean [s].
const MEAN: f64 = 1e-3;

/// What has followed so far.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Derived {
    /// Masses of the structure's nodes [kg]; empty where they are not known.
    masses: Vec<f64>,
    gravity: Vector3<f64>,
    /// Start of the first window with a contact force, and end of the last one [s].
    touched: Option<(f64, f64)>,
    direction: Vector3<f64>,
    /// Displacements along the direction when the contact began [m].
    deepest: (f64, f64),
    impulse: Vector3<f64>,
    /// Kinetic energy in the contact solver before the first contact, and after the last [J].
    kinetic: Option<(f64, f64)>,
    kinetic_now: Option<f64>,
    /// Time [s], impulse of the contact [N s] and change of momentum [kg m/s] of the mean under way.
    mean: (f64, Vector3<f64>, Vector3<f64>),
    /// Largest mean reaction, and the end of its window [N, s].
    reaction: Option<(f64, f64)>,
}

/// A committed window as it crossed.
pub struct Crossed<'a> {
    /// The window.
    pub span: Span,
    /// Mean force on the structure's nodes over each part [N].
    pub force: &'a [Vec<f64>],
    /// Motion of these nodes.
    pub motion: Answered<'a>,
    /// Kinetic energy in the contact solver at its end [J], if its gauges say so.
    pub kinetic: Option<f64>,
}

fn vectors(field: &[f64]) -> impl Iterator<Item = Vector3<f64>> {
    field.as_chunks().0.iter().map(|v: &[f64; 3]| Vector3::from(*v))
}

impl Derived {
    /// Of a structure with these masses [kg], below `gravity` [m/s2].
    pub fn new(masses: &[f64], gravity: Vector3<f64>) -> Self {
        Self { masses: masses.into(), gravity, ..Self::default() }
    }

    /// Take in a window.
    pub fn book(&mut self, Crossed { span, force, motion, kinetic }: Crossed) {
        let before = std::mem::replace(&mut self.kinetic_now, kinetic);
        let part = span.length / force.len().max(1) as f64;
        let impulse: Vector3<f64> = force.iter().flat_map(|part| vectors(part)).sum::<Vector3<f64>>() * part;
        let touches = impulse != Vector3::zeros();
        if touches && self.touched.is_none() {
            self.direction = impulse.normalize();
            self.touched = Some((span.start, span.end()));
            self.kinetic = before.or(kinetic).map(|start| (start, start));
            self.deepest = (f64::NEG_INFINITY, span.start);
        }
        let Some((first, _)) = self.touched else { return };
        self.impulse += impulse;
        if touches {
            self.touched = Some((first, span.end()));
            self.kinetic = self.kinetic.zip(kinetic).map(|((start, _), now)| (start, now));
            for (at, u) in (1..).zip(motion.u) {
                let furthest = vectors(u).map(|u| u.dot(&self.direction)).fold(f64::NEG_INFINITY, f64::max);
                if furthest > self.deepest.0 {
                    self.deepest = (furthest, span.start + part * f64::from(at));
                }
            }
        }
        self.react(span, impulse, motion);
    }

    /// The mean reaction, once enough time has come together.
    fn react(&mut self, span: Span, impulse: Vector3<f64>, motion: Answered) {
        let Some(end) = motion.v.last().filter(|_| !self.masses.is_empty()) else { return };
        let moves = self.masses.iter().zip(vectors(end).zip(vectors(motion.start.1)));
        let moves = moves.filter(|(mass, _)| mass.is_finite());
        let momentum: Vector3<f64> = moves.map(|(mass, (now, then))| (now - then) * *mass).sum();
        let (time, pushed, changed) = &mut self.mean;
        *time += span.length;
        *pushed += impulse;
        *changed += momentum;
        if *time < MEAN * (1.0 - 1e-9) {
            return;
        }
        let weight = self.gravity * self.masses.iter().filter(|m| m.is_finite()).sum::<f64>();
        let reaction = ((*changed - *pushed) / *time - weight).norm();
        // Means over much longer windows say nothing of 1 ms.
        let short = *time < 2.0 * MEAN;
        self.mean = Default::default();
        if short && self.reaction.is_none_or(|(most, _)| reaction > most) {
            self.reaction = Some((reaction, span.end()));
        }
    }

    /// What the two solvers have left out.
    pub fn fill(&self, [dem, fem]: [&Statistics; 2]) -> Statistics {
        let mut found = Statistics::default();
        let mut add =
            |of: &Statistics, (name, rank): (&str, u16), value: f64, unit: &str, time: Option<f64>| {
                // Those of a rock begin with its name.
                if !of.measures.iter().any(|m| m.name.ends_with(name)) {
                    let measure = Measure::new(name, value, unit).at(time).ranked(rank, Worse::Larger);
                    found.measures.push(Measure { source: "coupler, from what crosses".into(), ..measure });
                }
            };
        if let Some((most, time)) = self.reaction {
            add(fem, ("max_reaction_1ms", 60), most, "N", Some(time));
        }
        let Some((first, last)) = self.touched.filter(|_| dem.verdicts.is_empty()) else { return found };
        let (deepest, turned) = self.deepest;
        add(dem, ("time_of_impact", 240), first, "s", None);
        add(dem, ("max_elongation", 50), deepest, "m", Some(turned));
        add(dem, ("contact_impulse", 245), self.impulse.norm(), "N s", None);
        let torn = fem.torn.as_ref().is_some_and(|torn| !torn.is_empty());
        let stops = turned < last && !torn;
        if stops {
            add(dem, ("braking_time", 120), turned - first, "s", None);
        }
        if let Some((before, after)) = self.kinetic {
            add(dem, ("impact_energy", 100), before, "J", Some(first));
            add(dem, ("rebound_energy", 130), after, "J", Some(last));
        }
        let fate = if stops { Fate::Stopped } else { Fate::Undecided };
        let time = if stops { turned } else { last };
        let verdict = Verdict {
            rock: "rock".into(),
            fate,
            time,
            braking_time: stops.then_some(turned - first),
            ..Verdict::default()
        };
        found.verdicts.push(verdict);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass on a spring that is pushed by a constant force while it goes down, and by less while it comes back.
    fn pushed(masses: &[f64]) -> Derived {
        let gravity = Vector3::new(0.0, 0.0, -10.0);
        let mut derived = Derived::new(masses, gravity);
        let h = 1e-3;
        let z = |t: f64| -0.2 * (20.0 * t).sin();
        let v = |t: f64| -4.0 * (20.0 * t).cos();
        for k in 0..150 {
            let start = h * f64::from(k);
            let end = start + h;
            let field = |value: f64| vec![0.0, 0.0, value, 0.0, 0.0, 0.0];
            let (u, w) = (vec![field(z(end))], vec![field(v(end))]);
            let (u0, v0) = (field(z(start)), field(v(start)));
            let force = vec![field(if (20..=120).contains(&k) { -300.0 } else { 0.0 })];
            let motion = Answered { start: (&u0, &v0), u: &u, v: &w };
            let span = Span { number: 1, start, length: h, level: 0 };
            derived.book(Crossed { span, force: &force, motion, kinetic: Some(50.0 - f64::from(k)) });
        }
        derived
    }

    #[test]
    fn impact_deepest_point_impulse_and_reaction_follow_from_motion_and_force() {
        let derived = pushed(&[2.0, f64::INFINITY]);
        let all = derived.fill([&Statistics::default(), &Statistics::default()]);
        let value = |name: &str| all.measures.iter().find(|m| m.name == name).expect(name).value;
        assert!((value("time_of_impact") - 0.02).abs() < 1e-12);
        assert!((value("max_elongation") - 0.2).abs() < 1e-4);
        let quarter = std::f64::consts::PI / 40.0;
        assert!((value("braking_time") - (quarter - 0.02)).abs() < 1e-3, "{}", value("braking_time"));
        assert!((value("contact_impulse") - 300.0 * 0.101).abs() < 1e-9);
        assert_eq!([value("impact_energy"), value("rebound_energy")], [31.0, -70.0]);
        // R = m a - F - m g, the largest where the mass is deepest: 2 * 80 + 300 + 20.
        assert!((value("max_reaction_1ms") / 480.0 - 1.0).abs() < 1e-3, "{}", value("max_reaction_1ms"));
        assert_eq!(all.verdicts[0].fate, Fate::Stopped);
    }

    #[test]
    fn what_a_solver_reports_itself_is_left_to_it() {
        let of =
            |name: &str| Statistics { measures: vec![Measure::new(name, 1.0, "N")], ..Statistics::default() };
        let all = pushed(&[]).fill([&of("block_time_of_impact"), &of("max_reaction_1ms")]);
        let names: Vec<_> = all.measures.iter().map(|m| m.name.as_str()).collect();
        assert!(!names.contains(&"time_of_impact") && !names.contains(&"max_reaction_1ms"), "{names:?}");
        assert!(names.contains(&"braking_time"));
    }
}
