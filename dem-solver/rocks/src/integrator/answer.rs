//! Where an answer holds its fields.

use interface_defs::{FieldSpec, Layout, Sampling, name};
use std::ops::Range;

/// Where the answer's fields lie.
#[derive(Debug, Clone, Default)]
pub(super) struct Answer {
    pub(super) means: Vec<usize>,
    pub(super) ends: Vec<usize>,
    pub(super) reach: Option<Range<usize>>,
    pub(super) gauges: usize,
}

impl Answer {
    /// Find them in the layout of the answer.
    pub(super) fn lay_out(&mut self, gives: &Layout) {
        for (starts, sampling) in [(&mut self.means, Sampling::Means), (&mut self.ends, Sampling::AtEnds)] {
            let force = |f: &&FieldSpec| f.name == name::FORCE && f.sampling == sampling;
            let count = gives.fields().find(force).map_or(0, |f| f.samples as usize);
            starts.clear();
            starts.extend((0..count).filter_map(|i| Some(gives.sample(name::FORCE, sampling, i)?.start)));
        }
        self.reach = gives.sample(name::REACH, Sampling::Once, 0);
        self.gauges = gives.gauges().start;
    }
}
