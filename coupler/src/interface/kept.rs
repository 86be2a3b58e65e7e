//! What the interface takes from one window to the next, for a run that goes on.

use super::Interface;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The committed side of an [`Interface`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeptInterface {
    u: Vec<f64>,
    v: Vec<f64>,
    broken: Vec<f64>,
    /// Fields that are passed on.
    passed: Vec<Vec<f64>>,
    passing: Vec<Vec<f64>>,
    /// Mean forces: of the last iteration, of the one before, and committed.
    forces: [Vec<Vec<f64>>; 3],
    judged: Vec<bool>,
    in_reach: Vec<Range<usize>>,
}

impl Interface {
    /// What the next window follows from.
    pub fn kept(&self) -> KeptInterface {
        KeptInterface {
            u: self.committed_u.clone(),
            v: self.committed_v.clone(),
            broken: self.committed_broken.clone(),
            passed: self.passed.iter().map(|field| field.committed.clone()).collect(),
            passing: self.passing.kept(),
            forces: [self.force.clone(), self.force_before.clone(), self.committed_force.clone()],
            judged: self.judged.clone(),
            in_reach: self.in_reach.clone(),
        }
    }

    /// Go on from there, with payloads laid out as they were.
    pub fn go_on(&mut self, kept: KeptInterface) {
        let KeptInterface { u, v, broken, passed, passing, forces, judged, in_reach } = kept;
        (self.committed_u, self.committed_v) = (u, v);
        self.broken.clone_from(&broken);
        self.committed_broken = broken;
        self.passed.iter_mut().zip(passed).for_each(|(field, committed)| field.committed = committed);
        self.passing.go_on(passing);
        [self.force, self.force_before, self.committed_force] = forces;
        (self.judged, self.in_reach) = (judged, in_reach);
    }
}
