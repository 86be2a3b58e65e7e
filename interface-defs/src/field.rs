//! Fields: which numbers cross the interface in a window, and where they lie in the flat payload.
//!
//! A payload is one flat `[f64]`: field after field in the order of the plan, each sample-major,
//! then node-major, then component. An answer ends with three numbers per gauge: value, smallest
//! and largest over the solver's own steps in the window.

use crate::mesh::InterfaceMesh;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Names that version 1 gives a meaning. Any other name is passed on where giver and taker agree.
pub mod name {
    /// Displacement of the interface nodes since t = 0 [m], 3 components.
    pub const DISPLACEMENT: &str = "displacement";
    /// Velocity of the interface nodes [m/s], 3 components.
    pub const VELOCITY: &str = "velocity";
    /// Force on the interface nodes [N], 3 components.
    pub const FORCE: &str = "force";
    /// 1 for each node that the contact solver may touch in this window, else 0.
    pub const REACH: &str = "reach";
    /// 1 for each line that is broken and touches nothing any more, else 0: from the structure at the window's end, to the
    /// contact solver as committed when the window begins.
    pub const BROKEN: &str = "broken";
    /// Optional: d(force)/d(displacement) of the contacts, negated, one 3x3 block per node [N/m].
    pub const CONTACT_TANGENT: &str = "contact_tangent";
    /// Optional: d(force)/d(velocity) of the contacts, negated, one 3x3 block per node [N s/m].
    pub const CONTACT_DAMPING: &str = "contact_damping";
    /// Optional, for a mesh that yields in the contact solver: mass felt by a node [kg].
    pub const LOCAL_MASS: &str = "local_mass";
    /// Optional, for a yielding mesh: internal force plus load at the window's start [N], 3 components.
    pub const LOCAL_FORCE: &str = "local_force";
    /// Optional, for a yielding mesh: `[T/L, EA/L^3]` of each line, block `T/L I + EA/L^3 d d^T` [N/m, N/m3].
    pub const LOCAL_LINE_TANGENT: &str = "local_line_tangent";
    /// Optional, for a yielding mesh of any element: one 3x3 tangent block per node [N/m].
    pub const LOCAL_TANGENT: &str = "local_tangent";
    /// Optional, for a yielding mesh: mass-proportional damping alpha [1/s], one number.
    pub const LOCAL_DAMPING: &str = "local_damping";
}

/// What a field is attached to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Place {
    /// One item per node of the interface mesh.
    Node,
    /// One item per line of the interface mesh.
    Line,
    /// One item per face of the interface mesh.
    Face,
    /// One item for the whole interface.
    Whole,
}

/// Where in the window the samples of a field lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sampling {
    /// `samples` values at the ends of as many equal parts of the window; the last is the window's end.
    AtEnds,
    /// `samples` + 1 values: the window's start, then as [`Sampling::AtEnds`].
    FromStart,
    /// `samples` means over as many equal parts of the window.
    Means,
    /// One value, valid for the window as a whole; `samples` is 1.
    Once,
}

/// One field as a solver declares it (`samples` = the most it can do) or as the plan fixes it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FieldSpec {
    /// What it is; see [`name`].
    pub name: String,
    /// Numbers per item.
    pub components: u32,
    /// What it is attached to.
    pub place: Place,
    /// Where in the window its samples lie.
    pub sampling: Sampling,
    /// Number of parts of the window, at least 1.
    pub samples: u32,
}

impl FieldSpec {
    /// A nodal field with one sample.
    pub fn nodal(name: &str, components: u32, sampling: Sampling) -> Self {
        Self { name: name.into(), components, place: Place::Node, sampling, samples: 1 }
    }

    /// Numbers in one sample on `mesh`.
    pub fn sample_len(&self, mesh: &InterfaceMesh) -> usize {
        let items = match self.place {
            Place::Node => mesh.node_count(),
            Place::Line => mesh.lines.len(),
            Place::Face => mesh.faces.len(),
            Place::Whole => 1,
        };
        items * self.components as usize
    }

    /// Samples that travel per window.
    pub fn sample_count(&self) -> usize {
        match self.sampling {
            Sampling::AtEnds | Sampling::Means => self.samples as usize,
            Sampling::FromStart => self.samples as usize + 1,
            Sampling::Once => 1,
        }
    }
}

/// Where every field of a plan lies in the payload.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    places: Vec<(FieldSpec, usize, usize)>,
    fields_len: usize,
    gauges: usize,
}

impl Layout {
    /// Layout of `fields` on `mesh`, followed by three numbers for each of `gauges`.
    pub fn new(fields: &[FieldSpec], mesh: &InterfaceMesh, gauges: usize) -> Self {
        let mut at = 0;
        let places = fields
            .iter()
            .map(|f| {
                let sample = f.sample_len(mesh);
                let place = (f.clone(), at, sample);
                at += sample * f.sample_count();
                place
            })
            .collect();
        Self { places, fields_len: at, gauges }
    }

    /// Numbers in the whole payload.
    pub fn len(&self) -> usize {
        self.fields_len + 3 * self.gauges
    }

    /// True if nothing travels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where sample number `sample` of the field lies, or `None` if the plan does not name it.
    pub fn sample(&self, name: &str, sampling: Sampling, sample: usize) -> Option<Range<usize>> {
        let (_, start, len) = self.places.iter().find(|(f, ..)| f.name == name && f.sampling == sampling)?;
        Some(start + sample * len..start + (sample + 1) * len)
    }

    /// Where the last sample of the field lies (the window's end), or `None`.
    pub fn last(&self, name: &str, sampling: Sampling) -> Option<Range<usize>> {
        let (f, ..) = self.places.iter().find(|(f, ..)| f.name == name && f.sampling == sampling)?;
        self.sample(name, sampling, f.sample_count() - 1)
    }

    /// Where `[value, smallest, largest]` of gauge number `gauge` lie.
    pub fn gauge(&self, gauge: usize) -> Range<usize> {
        assert!(gauge < self.gauges, "gauge {gauge} of {}", self.gauges);
        self.fields_len + 3 * gauge..self.fields_len + 3 * gauge + 3
    }

    /// Where the numbers of all gauges lie.
    pub fn gauges(&self) -> Range<usize> {
        self.fields_len..self.len()
    }

    /// The field that holds number `index`: name, and its position in the sample. `None` for a gauge.
    pub fn owner(&self, index: usize) -> Option<(&FieldSpec, usize)> {
        let (f, start, len) = self
            .places
            .iter()
            .find(|(f, start, len)| (*start..start + len * f.sample_count()).contains(&index))?;
        Some((f, (index - start) % len))
    }

    /// Number of the gauge that holds number `index` of the payload, if a gauge does.
    pub fn gauge_owner(&self, index: usize) -> Option<usize> {
        (index >= self.fields_len && index < self.len()).then(|| (index - self.fields_len) / 3)
    }

    /// The fields, in order.
    pub fn fields(&self) -> impl Iterator<Item = &FieldSpec> {
        self.places.iter().map(|(f, ..)| f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_follow_each_other_and_gauges_come_last() {
        let mesh =
            InterfaceMesh { coordinates: vec![0.0; 12], lines: vec![[0, 1], [1, 2]], ..Default::default() };
        let mut motion = FieldSpec::nodal(name::DISPLACEMENT, 3, Sampling::FromStart);
        motion.samples = 2;
        let lines = FieldSpec { place: Place::Line, ..FieldSpec::nodal("x", 2, Sampling::Once) };
        let layout = Layout::new(&[motion, lines], &mesh, 2);
        assert_eq!(layout.sample(name::DISPLACEMENT, Sampling::FromStart, 0), Some(0..12));
        assert_eq!(layout.last(name::DISPLACEMENT, Sampling::FromStart), Some(24..36));
        assert_eq!(layout.sample("x", Sampling::Once, 0), Some(36..40));
        assert_eq!(layout.sample("x", Sampling::Means, 0), None);
        assert_eq!(layout.gauge(1), 43..46);
        assert_eq!(layout.len(), 46);
        assert_eq!(layout.owner(26).map(|(f, at)| (f.name.as_str(), at)), Some((name::DISPLACEMENT, 2)));
        assert_eq!(layout.gauge_owner(45), Some(1));
    }
}
