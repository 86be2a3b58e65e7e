//! Where the fields that the coupler knows lie in the four payloads.

use crate::side::Side;
use interface_defs::{Layout, Sampling, name};
use std::ops::Range;

/// Where the fields that the coupler knows lie in the four payloads.
#[derive(Debug, Clone, Default)]
pub struct Places {
    /// `[sample]`: start, then the ends of the parts; to the contact solver.
    pub dem_displacement: Vec<Range<usize>>,
    /// As `dem_displacement`; empty if the contact solver takes no velocity.
    pub dem_velocity: Vec<Range<usize>>,
    /// Means over the parts, from the contact solver; empty if not agreed.
    pub dem_force: Vec<Range<usize>>,
    /// At the ends of the parts, from the contact solver; empty if not agreed.
    pub dem_end_force: Vec<Range<usize>>,
    /// From the contact solver.
    pub reach: Option<Range<usize>>,
    /// To the contact solver: its broken lines.
    pub dem_broken: Option<Range<usize>>,
    /// To the structure.
    pub force: Vec<Range<usize>>,
    /// To the structure.
    pub end_force: Vec<Range<usize>>,
    /// From the structure.
    pub displacement: Vec<Range<usize>>,
    /// From the structure.
    pub velocity: Vec<Range<usize>>,
    /// From the structure: its broken lines.
    pub broken: Option<Range<usize>>,
    /// To the contact solver: means over the parts of the force under which the motion sent was computed.
    pub star: Vec<Range<usize>>,
    /// From the contact solver: its own motion of the net at the ends of the parts.
    pub own: Vec<Range<usize>>,
    /// From the structure.
    pub travel: Option<Range<usize>>,
    /// To the contact solver: the sum of what came, and what may come.
    pub dem_travel: Option<Range<usize>>,
    /// From the contact solver.
    pub free_time: Option<Range<usize>>,
}

impl Places {
    /// From the layouts of the four payloads, with `samples` parts per window.
    pub fn new(dem: &Side, fem: &Side, samples: usize) -> Self {
        let mut places = Self::default();
        places.lay_out(dem, fem, samples);
        places
    }

    /// The same fields lie elsewhere.
    pub fn lay_out(&mut self, dem: &Side, fem: &Side, samples: usize) {
        let (to_dem, from_dem, to_fem, from_fem) = (&dem.request, &dem.layout, &fem.request, &fem.layout);
        let all = |ranges: &mut Vec<Range<usize>>, layout: &Layout, name, sampling, count: usize| {
            ranges.clear();
            ranges.extend((0..count).filter_map(|i| layout.sample(name, sampling, i)));
        };
        use Sampling::{AtEnds, FromStart, Means, Once};
        all(&mut self.dem_displacement, to_dem, name::DISPLACEMENT, FromStart, samples + 1);
        all(&mut self.dem_velocity, to_dem, name::VELOCITY, FromStart, samples + 1);
        all(&mut self.star, to_dem, name::FORCE, Means, samples);
        all(&mut self.dem_force, from_dem, name::FORCE, Means, samples);
        all(&mut self.dem_end_force, from_dem, name::FORCE, AtEnds, samples);
        all(&mut self.own, from_dem, name::DISPLACEMENT, AtEnds, samples);
        all(&mut self.force, to_fem, name::FORCE, Means, samples);
        all(&mut self.end_force, to_fem, name::FORCE, AtEnds, samples);
        all(&mut self.displacement, from_fem, name::DISPLACEMENT, AtEnds, samples);
        all(&mut self.velocity, from_fem, name::VELOCITY, AtEnds, samples);
        self.reach = from_dem.sample(name::REACH, Once, 0);
        self.dem_broken = to_dem.sample(name::BROKEN, Once, 0);
        self.broken = from_fem.sample(name::BROKEN, Once, 0);
        self.travel = from_fem.sample(name::TRAVEL, Once, 0);
        self.dem_travel = to_dem.sample(name::TRAVEL, Once, 0);
        self.free_time = from_dem.sample(name::FREE_TIME, Once, 0);
    }
}
