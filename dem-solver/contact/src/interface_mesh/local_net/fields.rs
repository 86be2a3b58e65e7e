//! Where a request has what a yielding net needs.

use crate::interface_mesh::motion::sample;
use interface_defs::{Layout, Plan, Sampling, name};
use std::ops::Range;

/// Where the request has what a yielding net needs, and the answer its motion.
#[derive(Debug, Clone, Default)]
pub struct LocalFields {
    pub(super) force: Vec<Range<usize>>,
    pub(super) residual: Option<Range<usize>>,
    pub(super) rate: Option<Range<usize>>,
    pub(super) tangent: Option<Range<usize>>,
    pub(super) damping: Option<Range<usize>>,
    /// Begin of each sample of the net's motion in the answer.
    pub(super) own: Vec<usize>,
}

impl LocalFields {
    /// Whether a plan has all that is needed.
    pub fn are_in(plan: &Plan) -> bool {
        let has = |name: &str| plan.takes.iter().any(|f| f.name == name);
        [name::LOCAL_FORCE, name::LOCAL_FORCE_RATE, name::LOCAL_TANGENT].into_iter().all(has)
    }

    /// Find the fields in the layouts of request and answer.
    pub fn lay_out(&mut self, takes: &Layout, gives: &Layout) {
        self.force.clear();
        self.force.extend((0..).map_while(|i| sample(takes, name::FORCE, Sampling::Means, i)));
        let once = |name| takes.sample(name, Sampling::Once, 0);
        (self.residual, self.rate) = (once(name::LOCAL_FORCE), once(name::LOCAL_FORCE_RATE));
        (self.tangent, self.damping) = (once(name::LOCAL_TANGENT), once(name::LOCAL_DAMPING));
        self.own.clear();
        let own = (0..).map_while(|i| sample(gives, name::DISPLACEMENT, Sampling::AtEnds, i));
        self.own.extend(own.map(|range| range.start));
    }

    /// Samples of the net's motion in the answer.
    pub fn own_samples(&self) -> usize {
        self.own.len()
    }
}
