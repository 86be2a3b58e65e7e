//! A point among the settings of a scene: the rungs of its knobs that are not the scene's own.

use super::knobs::{Class, Knob};
use crate::stability;
use std::collections::BTreeMap;

/// Rungs by knob; a knob at the scene's own value is left out.
pub type Point = BTreeMap<&'static str, i32>;

/// All points of a scene.
pub struct Space {
    /// Its knobs.
    pub knobs: Vec<Knob>,
    /// Dotted keys that the scene leaves open, so that what fills them may depend on others: every point that computes
    /// otherwise than the scene names them.
    pub open: Vec<String>,
}

/// `point` with the rung of one knob.
pub fn with(point: &Point, knob: &'static str, rung: i32) -> Point {
    let mut point = point.clone();
    point.insert(knob, rung);
    point.retain(|_, rung| *rung != 0);
    point
}

/// Rung of a knob.
pub fn rung(point: &Point, knob: &str) -> i32 {
    point.get(knob).copied().unwrap_or(0)
}

impl Space {
    /// The knob of this name.
    pub fn knob(&self, name: &str) -> Option<&Knob> {
        self.knobs.iter().find(|knob| knob.name == name)
    }

    /// Whether a knob changes anything there.
    pub fn uses(&self, point: &Point, knob: &Knob) -> bool {
        knob.needs.is_none_or(|(other, name)| {
            let value = self.knob(other).and_then(|other| other.value(rung(point, other.name)));
            value.as_deref() == Some(name)
        })
    }

    /// The numerical knobs that are to be turned and that change anything there.
    pub fn turned<'a>(&'a self, point: &'a Point) -> impl Iterator<Item = &'a Knob> {
        let knobs = self.knobs.iter().filter(|knob| knob.turned && knob.class == Class::Numerical);
        knobs.filter(|knob| self.uses(point, knob))
    }

    /// Whether the point changes the model.
    pub fn class(&self, point: &Point) -> Class {
        let changes = |knob: &&Knob| knob.class == Class::Model && point.contains_key(knob.name);
        if self.knobs.iter().any(|knob| changes(&knob)) { Class::Model } else { Class::Numerical }
    }

    /// The `--set`s of a point; `None` if a knob has no such rung.
    pub fn sets(&self, point: &Point) -> Option<Vec<String>> {
        let computes_otherwise =
            self.knobs.iter().any(|knob| knob.class == Class::Numerical && point.contains_key(knob.name));
        let mut all = Vec::new();
        for knob in &self.knobs {
            let there = rung(point, knob.name);
            let is_open = knob.keys().iter().any(|key| self.open.iter().any(|open| open == key));
            if there != 0 || (computes_otherwise && is_open) {
                all.extend(knob.sets(there)?);
            }
        }
        Some(all)
    }

    /// What is computed there: two points of one key compute the same. A solver's step is cut to a whole part of a window.
    pub fn key(&self, point: &Point) -> Option<String> {
        self.sets(point)?;
        let number = |name: &str| self.knob(name)?.as_number(rung(point, name));
        let part = number("window").map(|window| window / number("samples").unwrap_or(1.0));
        let mut words = Vec::new();
        for knob in self.knobs.iter().filter(|knob| self.uses(point, knob)) {
            let value = match (knob.name, part, knob.as_number(rung(point, knob.name))) {
                ("dem_step" | "fem_step", Some(part), Some(step)) => {
                    format!("{:.9e}", part / stability::steps(part, step) as f64)
                }
                _ => knob.value(rung(point, knob.name))?,
            };
            words.push(format!("{}={value}", knob.name));
        }
        Some(words.join(" "))
    }

    /// For people: what is not as in the scene.
    pub fn label(&self, point: &Point) -> String {
        let words: Vec<String> = (self.knobs.iter())
            .filter(|knob| point.contains_key(knob.name))
            .filter_map(|knob| Some(format!("{} {}", knob.name, knob.value(rung(point, knob.name))?)))
            .collect();
        if words.is_empty() { "the scene as it is".into() } else { words.join(", ") }
    }

    /// The scene, or with a name of one of its arms.
    pub fn arms(&self) -> Vec<Point> {
        let mut all = vec![Point::new()];
        for knob in self.knobs.iter().filter(|knob| knob.turned && knob.arm && knob.class == Class::Numerical)
        {
            all.extend((1..knob.names() as i32).map(|name| Point::from([(knob.name, name)])));
        }
        all
    }

    /// `point`, so many rungs finer in all that the reference refines.
    pub fn refined(&self, point: &Point, rungs: i32) -> Point {
        let mut out = point.clone();
        for knob in self.knobs.iter().filter(|knob| knob.refines && self.uses(point, knob)) {
            out = with(&out, knob.name, rung(point, knob.name) - rungs);
        }
        out
    }

    /// How many times dearer than `from` the point `to` may be. What is coarser is not counted as a saving.
    pub fn dearer(&self, from: &Point, to: &Point) -> f64 {
        let mut factor = 1.0;
        for knob in &self.knobs {
            let (a, b) = (rung(from, knob.name), rung(to, knob.name));
            let finer = if knob.names() > 0 { i32::from(a != b) } else { (a - b).max(0) };
            factor *= knob.growth.powi(finer);
        }
        factor
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::knobs::{Base, of};

    fn space(open: &[&str]) -> Space {
        let text = "[dem]\ntime_step = 1e-5\n[coupling]\nscheme = \"weak\"\ntime_window = 4e-5\nsamples = 1\ntolerance = 1e-4\n\
            absolute_tolerance = 1e-6\n[[contact]]\nyoung = 1e8\n";
        let resolved = text.parse().expect("TOML");
        let knobs = of(&Base { resolved: &resolved, in_use: &[("fem.time_step", 2e-5)] });
        Space { knobs, open: open.iter().map(|key| (*key).to_owned()).collect() }
    }

    #[test]
    fn steps_that_no_window_lets_be_longer_are_one_point() {
        let space = space(&[]);
        let key = |rungs: &[(&'static str, i32)]| space.key(&rungs.iter().copied().collect());
        assert_eq!(key(&[("dem_step", 2)]), key(&[("dem_step", 5)]), "cut to the window of 4e-5 s");
        assert_ne!(key(&[("dem_step", 1)]), key(&[("dem_step", 2)]));
        assert_ne!(key(&[("dem_step", 2), ("window", 1)]), key(&[("dem_step", 3), ("window", 1)]));
        // Weak coupling does not use its tolerance.
        assert_eq!(key(&[("tolerance", 1)]), key(&[]));
        assert_ne!(key(&[("tolerance", 1), ("scheme", 1)]), key(&[("scheme", 1)]));
    }

    #[test]
    fn what_the_scene_leaves_open_is_named_where_it_is_computed_otherwise() {
        let space = space(&["fem.time_step"]);
        let sets =
            |rungs: &[(&'static str, i32)]| space.sets(&rungs.iter().copied().collect()).expect("a point");
        assert!(sets(&[]).is_empty());
        assert_eq!(sets(&[("window", 1)]), ["coupling.time_window=8e-5", "fem.time_step=2e-5"]);
        assert_eq!(
            sets(&[("modulus", 1)]),
            ["contact.0.young=2.5e7"],
            "a model keeps the program's own choice"
        );
    }

    #[test]
    fn a_finer_point_costs_its_factors_and_a_coarser_one_no_less() {
        let space = space(&[]);
        let p = |rungs: &[(&'static str, i32)]| rungs.iter().copied().collect::<Point>();
        assert_eq!(space.dearer(&p(&[("window", 1)]), &p(&[("window", -1), ("dem_step", 3)])), 4.0);
        assert_eq!(space.refined(&p(&[]), 2), p(&[("window", -2), ("dem_step", -2), ("fem_step", -2)]));
        assert_eq!(space.arms(), [p(&[]), p(&[("scheme", 1)])]);
    }
}
