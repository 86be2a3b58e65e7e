//! Fields of which the coupler needs no number: they are passed on as they are.

use crate::side::Side;
use interface_defs::{FieldSpec, InterfaceMesh, Items, Layout, Place, Sampling, name};
use std::ops::Range;

/// Fields that are passed on.
#[derive(Debug, Clone, Default)]
pub struct Common {
    /// From the structure to the contact solver.
    pub to_contact: Vec<FieldSpec>,
    /// From the contact solver to the structure.
    pub to_structure: Vec<FieldSpec>,
}

/// Fields that one side gives and the other one takes, with `samples` parts per window. Names with a meaning of their own are handled
/// elsewhere.
pub fn common(gives: &[FieldSpec], takes: &[FieldSpec], samples: u32) -> Vec<FieldSpec> {
    let mut fields = Vec::new();
    for given in gives.iter().filter(|given| !name::ALL.contains(&given.name.as_str())) {
        let parts = if given.sampling == Sampling::Once { 1 } else { samples };
        let at_hand = |f: &FieldSpec| FieldSpec { samples: parts, ..f.clone() };
        let equal = |taken: &&FieldSpec| at_hand(taken) == at_hand(given);
        let most = takes.iter().find(equal).map_or(0, |taken| taken.samples.min(given.samples));
        if most >= parts && given.place != Place::Pair && given.interface == 0 {
            fields.push(at_hand(given));
        } else if takes.iter().any(|taken| taken.name == given.name) {
            tracing::warn!("the field \"{}\" is not passed on: its giver and its taker differ", given.name);
        }
    }
    fields
}

impl Common {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.to_contact.is_empty() && self.to_structure.is_empty()
    }

    /// Why a field cannot be passed on from mesh to mesh.
    pub fn check(&self, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Result<(), String> {
        let fits = |field: &FieldSpec| match field.place {
            Place::Node => structure.same_nodes(contact),
            Place::Line => structure.lines == contact.lines,
            Place::Face => structure.faces == contact.faces,
            Place::Whole | Place::Pair => true,
        };
        let mut fields = self.to_contact.iter().chain(&self.to_structure);
        let Some(FieldSpec { name, place, .. }) = fields.find(|field| !fits(field)) else { return Ok(()) };
        let [own, other] = [structure, contact].map(Items::of);
        Err(format!(
            "the field \"{name}\" is passed on as it is, {place:?} by {place:?}, and the meshes of both solvers differ: {} and {} \
             nodes, {} and {} lines, {} and {} faces",
            own.nodes, other.nodes, own.lines, other.lines, own.faces, other.faces
        ))
    }
}

/// A field of the structure, as committed and in its last answer.
#[derive(Debug, Clone)]
struct Held {
    field: FieldSpec,
    from: Range<usize>,
    to: Range<usize>,
    committed: Vec<f64>,
    trial: Vec<f64>,
    /// Whether it belongs to the straight motion that a window begins with, and to no later iterate.
    first: bool,
}

/// The fields that are passed on, between giver and taker.
#[derive(Debug, Clone, Default)]
pub struct Passing {
    to_contact: Vec<Held>,
    to_structure: Vec<(Range<usize>, Range<usize>)>,
}

/// All samples of a field in a payload, if it is there.
fn all(layout: &Layout, field: &FieldSpec) -> Option<Range<usize>> {
    let start = layout.sample(&field.name, field.sampling, 0)?.start;
    Some(start..layout.last(&field.name, field.sampling)?.end)
}

impl Passing {
    /// At t = 0: the fields `common`, and those of the structure that are `unknown` then: of a yielding net, until nodes are selected; its
    /// broken lines, until a window has ended.
    pub fn new<'f>(
        common: &Common,
        unknown: impl Iterator<Item = &'f FieldSpec>,
        dem: &Side,
        fem: &Side,
    ) -> Self {
        let of_start = [name::LOCAL_FORCE, name::LOCAL_FORCE_RATE];
        let held = |field: &FieldSpec, is_known: bool| {
            let (from, to) = (all(&fem.layout, field)?, all(&dem.request, field)?);
            let mut committed = fem.initial[from.clone()].to_vec();
            if !is_known {
                committed.fill(0.0);
            }
            let first = of_start.contains(&field.name.as_str());
            Some(Held { field: field.clone(), from, to, trial: committed.clone(), committed, first })
        };
        let common_ones = common.to_contact.iter().filter_map(|field| held(field, true));
        let fields = common.to_structure.iter();
        Self {
            to_contact: common_ones.chain(unknown.filter_map(|field| held(field, false))).collect(),
            to_structure: fields
                .filter_map(|field| Some((all(&dem.layout, field)?, all(&fem.request, field)?)))
                .collect(),
        }
    }

    /// Lay the fields out for the payloads as they are now, and begin from `state`, the structure's answer with its committed state.
    pub fn select(&mut self, dem: &Side, fem: &Side, state: &[f64]) {
        for held in &mut self.to_contact {
            held.from = all(&fem.layout, &held.field).unwrap_or_default();
            held.to = all(&dem.request, &held.field).unwrap_or_default();
            state[held.from.clone()].clone_into(&mut held.committed);
            held.trial.clone_from(&held.committed);
        }
    }

    /// What the structure gave, as committed.
    pub fn kept(&self) -> Vec<Vec<f64>> {
        self.to_contact.iter().map(|held| held.committed.clone()).collect()
    }

    /// Go on from there.
    pub fn go_on(&mut self, kept: Vec<Vec<f64>>) {
        self.to_contact.iter_mut().zip(kept).for_each(|(held, committed)| held.committed = committed);
    }

    /// What the structure gave, as committed, into the request to the contact solver.
    pub fn write_to_contact(&self, payload: &mut [f64], iteration: u32) {
        for held in &self.to_contact {
            let to = &mut payload[held.to.clone()];
            match iteration > 1 && held.first {
                true => to.fill(0.0),
                false => to.copy_from_slice(&held.committed),
            }
        }
    }

    /// What the contact solver gives, into the request to the structure for the same window.
    pub fn write_to_structure(&self, from_contact: &[f64], payload: &mut [f64]) {
        for (from, to) in &self.to_structure {
            payload[to.clone()].copy_from_slice(&from_contact[from.clone()]);
        }
    }

    /// Keep what the structure gives.
    pub fn take(&mut self, from_structure: &[f64]) {
        for held in &mut self.to_contact {
            held.trial.copy_from_slice(&from_structure[held.from.clone()]);
        }
    }

    /// Whether something broke in its last answer.
    pub fn breaks(&self) -> bool {
        self.to_contact.iter().any(|held| held.field.name == name::BROKEN && held.trial != held.committed)
    }

    /// Its last answer is accepted.
    pub fn commit(&mut self) {
        self.to_contact.iter_mut().for_each(|held| std::mem::swap(&mut held.committed, &mut held.trial));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_both_sides_name_alike_is_passed_on_and_nothing_else() {
        let field = |name: &str, samples| FieldSpec { samples, ..FieldSpec::nodal(name, 1, Sampling::Means) };
        let once = FieldSpec::nodal("wetness", 1, Sampling::Once);
        let gives = [field("heat", 8), field("noise", 2), field(name::FORCE, 8), once.clone()];
        let takes = [field("heat", 4), field("noise", 8), field(name::FORCE, 8), once];
        let names = |samples| -> Vec<(String, u32)> {
            common(&gives, &takes, samples).into_iter().map(|f| (f.name, f.samples)).collect()
        };
        assert_eq!(names(4), [("heat".to_string(), 4), ("wetness".to_string(), 1)]);
        assert_eq!(names(2).len(), 3, "both noises have two samples");
        let wider = FieldSpec { components: 3, ..FieldSpec::nodal("heat", 1, Sampling::Means) };
        assert!(common(&[wider], &takes, 1).is_empty(), "three components are not one");
    }
}
