//! Fields: which numbers cross the interface in a window, and where they lie in the flat payload.
//!
//! A payload is one flat `[f64]`: field after field in the order of the plan, each sample-major,
//! then node-major, then component. An answer ends with three numbers per gauge: value, smallest
//! and largest over the solver's own steps in the window.

use crate::mesh::InterfaceMesh;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Names that this version gives a meaning. Any other name is passed on where giver and taker agree.
pub mod name {
    macro_rules! names {
        ($($(#[doc = $about:literal])+ $name:ident = $text:literal;)+) => {
            $($(#[doc = $about])+ pub const $name: &str = $text;)+
            /// All of them.
            pub const ALL: &[&str] = &[$($text),+];
        };
    }

    names! {
        /// Displacement of the interface nodes since t = 0 [m], 3 components.
        DISPLACEMENT = "displacement";
        /// Velocity of the interface nodes [m/s], 3 components.
        VELOCITY = "velocity";
        /// Force on the interface nodes [N], 3 components.
        FORCE = "force";
        /// 1 for each node that the contact solver may touch in this window, else 0.
        REACH = "reach";
        /// 1 for each line that is broken and touches nothing any more, else 0: from the structure at the window's end, to the
        /// contact solver as committed when the window begins.
        BROKEN = "broken";
        /// For a net that yields in the contact solver: internal force plus load at the window's start [N], 3 components.
        LOCAL_FORCE = "local_force";
        /// For a yielding net: how fast that force changes at the window's start, because all nodes move [N/s], 3 components.
        LOCAL_FORCE_RATE = "local_force_rate";
        /// For a yielding net: block of the tangent for each pair of selected nodes, `-d(force on the first)/d(displacement of
        /// the second)`, row by row [N/m], 9 components.
        LOCAL_TANGENT = "local_tangent";
        /// For a yielding net: mass-proportional damping alpha [1/s], one number.
        LOCAL_DAMPING = "local_damping";
        /// From a structure: largest distance that any interface node has moved in the window [m]; to the contact solver: the
        /// sum of these since it was asked for its reach, and what may come in this window.
        TRAVEL = "travel";
        /// From a contact solver: time from the window's end in which nothing touches the net [s], one number.
        FREE_TIME = "free_time";
    }
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
    /// One item per pair of coupled nodes among those selected ([`crate::selection::Selection::pairs`]).
    Pair,
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
    /// Number of the interface mesh that it belongs to, 0 = the first. This version knows no other.
    pub interface: u32,
}

impl FieldSpec {
    /// A nodal field with one sample.
    pub fn nodal(name: &str, components: u32, sampling: Sampling) -> Self {
        Self { name: name.into(), components, place: Place::Node, sampling, samples: 1, interface: 0 }
    }

    /// Numbers in one sample.
    pub fn sample_len(&self, items: &Items) -> usize {
        let items = match self.place {
            Place::Node => items.nodes,
            Place::Line => items.lines,
            Place::Face => items.faces,
            Place::Whole => 1,
            Place::Pair => items.pairs,
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

/// How many items of each kind the fields of a payload have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Items {
    /// Nodes.
    pub nodes: usize,
    /// Lines.
    pub lines: usize,
    /// Faces.
    pub faces: usize,
    /// Pairs of coupled nodes; none while all nodes of the mesh are sent.
    pub pairs: usize,
}

impl Items {
    /// All of a mesh.
    pub fn of(mesh: &InterfaceMesh) -> Self {
        Self { nodes: mesh.node_count(), lines: mesh.lines.len(), faces: mesh.faces.len(), pairs: 0 }
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
        let places = fields.iter().map(|f| (f.clone(), 0, 0)).collect();
        let mut layout = Self { places, fields_len: 0, gauges };
        layout.resize(&Items::of(mesh));
        layout
    }

    /// Lay the same fields out for other items.
    pub fn resize(&mut self, items: &Items) {
        let mut at = 0;
        for (field, start, sample) in &mut self.places {
            (*start, *sample) = (at, field.sample_len(items));
            at += *sample * field.sample_count();
        }
        self.fields_len = at;
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
        let mut places = self.places.iter();
        let holds = |start: usize, numbers: usize| (start..start + numbers).contains(&index);
        let (f, start, len) = places.find(|(f, start, len)| holds(*start, len * f.sample_count()))?;
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
