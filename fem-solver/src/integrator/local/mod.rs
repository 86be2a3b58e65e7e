//! The structure near selected nodes, so that a contact solver can move these nodes itself within a window:
//!
//! ```text
//! m u'' = F_contact + f + f' t - K (u - x - v t) - alpha m (u' - v)          f' = -K v with all nodes moving
//! ```
//!
//! `f` is all that accelerates a node but the interface force: internal force, springs, dashpots, mass-proportional damping,
//! dead load, loads with a history and pressures. `K` is the tangent of elements and springs, without that of pressures, and
//! its symmetric part where it has another. Nothing accelerates a node in a direction in which it is held, and
//! its way there is prescribed: force, rate, rows and columns are 0.

mod coupled;

use crate::config::FemConfig;
use crate::config::scheme::Scheme;
use crate::internal_force::assembly::{Assembly, Heading};
use crate::model::Model;
use crate::model::applied::Applied;
use crate::state::State;
use coupled::Coupled;
use interface_defs::field::{FieldSpec, Layout, Place, Sampling, name};
use interface_defs::message::Plan;
use interface_defs::selection::Selection;

/// A structure whose tangent couples more nodes than this with each, on average, does not offer it: a contact solver would be
/// slower with it than a second pass of the structure.
const MOST_PARTNERS: usize = 40;

/// Share of an implicit step by which tangents are taken ahead: the force there, taken back along its rate, is wrong by the
/// square of it.
const AHEAD: f64 = 1e-4;

/// Names and shapes of the fields.
const FIELDS: [(&str, u32, Place); 4] = [
    (name::LOCAL_FORCE, 3, Place::Node),
    (name::LOCAL_FORCE_RATE, 3, Place::Node),
    (name::LOCAL_TANGENT, 9, Place::Pair),
    (name::LOCAL_DAMPING, 1, Place::Whole),
];

/// The fields that a structure offers; or why it offers none.
pub fn offered(model: &Model, fem: &FemConfig) -> Result<Vec<FieldSpec>, String> {
    if fem.path_speed.is_some() || Scheme::of(fem).is_some_and(|scheme| !scheme.inertia) {
        return Err("statics has no inertia".into());
    }
    let pairs = |nodes: usize| nodes * (nodes - 1) / 2;
    let elements: usize = model.elements.iter().map(|element| pairs(element.nodes().len())).sum();
    let coupled = model.node_count() + model.cables.len() + elements;
    if coupled > MOST_PARTNERS * model.node_count() {
        return Err(format!(
            "its elements couple up to {coupled} pairs of its {} nodes, and the limit is {MOST_PARTNERS} for each node",
            model.node_count()
        ));
    }
    let field = |(name, components, place): (&str, u32, Place)| FieldSpec {
        place,
        ..FieldSpec::nodal(name, components, Sampling::Once)
    };
    Ok(FIELDS.map(field).to_vec())
}

/// Sums at each selected node and for each pair. Behind the last there is one more, for what belongs nowhere.
#[derive(Debug, Clone, Default)]
struct Sums {
    force: Vec<[f64; 3]>,
    rate: Vec<[f64; 3]>,
    tangent: Vec<[f64; 9]>,
}

impl Sums {
    fn clear(&mut self, nodes: usize, pairs: usize) {
        self.force.clear();
        self.force.resize(nodes + 1, [0.0; 3]);
        self.rate.clear();
        self.rate.resize(nodes + 1, [0.0; 3]);
        self.tangent.clear();
        self.tangent.resize(pairs + 1, [0.0; 9]);
    }
}

/// A degree of freedom of a selected node, the node's place, and stiffness [N/m] or viscosity [N s/m] there.
type AtDof = (usize, usize, f64);

/// Force, rate and tangent at the selected nodes.
pub struct Local {
    coupled: Coupled,
    assembly: Assembly,
    applied: Applied,
    spring_dofs: Vec<(usize, f64)>,
    springs: Vec<AtDof>,
    dashpots: Vec<AtDof>,
    /// Places and pairs of nodes that a support holds in some direction, now or later.
    held: Vec<u32>,
    held_pairs: Vec<u32>,
    sums: Sums,
    /// Whether the sums are those of a structure at rest, which stay as they are while it is.
    at_rest: bool,
    /// Time ahead at which tangents are taken [s].
    ahead: f64,
}

impl Local {
    /// For `model`, with all of its nodes selected; `None` if `plan` asks for nothing of this.
    ///
    /// `step` [s] is that of an implicit scheme. Its histories are those at the end of a window, where what flows has one
    /// stiffness ahead and another back. An explicit scheme's are those in the middle of its last step.
    pub fn new(model: &Model, plan: &Plan, step: Option<f64>) -> Option<Box<Self>> {
        if !FIELDS.iter().any(|(name, ..)| plan.gives.iter().any(|field| field.name == *name)) {
            return None;
        }
        let coupled = Coupled::new(model);
        let (nodes, pairs) = (model.node_count(), coupled.pairs.len());
        let mut sums = Sums::default();
        sums.clear(nodes, pairs);
        let mut local = Self {
            coupled,
            assembly: Assembly::new(model),
            applied: Applied::new(model),
            spring_dofs: model.spring_dofs(),
            springs: Vec::new(),
            dashpots: Vec::new(),
            held: Vec::with_capacity(nodes),
            held_pairs: Vec::with_capacity(pairs),
            sums,
            at_rest: false,
            ahead: step.map_or(0.0, |step| AHEAD * step),
        };
        local.find_rest(model);
        local.select(model, None);
        Some(Box::new(local))
    }

    /// Select nodes and name the pairs of them that are coupled; or all, without pairs.
    pub fn select(&mut self, model: &Model, selection: Option<&mut Selection>) {
        match selection {
            None => self.coupled.select(model, 0..model.node_count() as u32, false),
            Some(selection) => {
                self.coupled.select(model, selection.nodes.iter().copied(), true);
                selection.pairs.clear();
                selection.pairs.reserve(self.coupled.pairs.capacity());
                selection.pairs.extend_from_slice(&self.coupled.pairs);
            }
        }
        self.find_rest(model);
        self.at_rest = false;
    }

    /// Springs, dashpots and supports at the selected nodes.
    fn find_rest(&mut self, model: &Model) {
        let (n, coupled) = (model.node_count(), &self.coupled);
        let find = |of: &[(usize, f64)], to: &mut Vec<AtDof>| {
            to.clear();
            for (dof, amount) in of.iter().filter(|(dof, _)| *dof < 3 * n) {
                if let Some(place) = coupled.place(dof % n) {
                    to.push((*dof, place, *amount));
                }
            }
        };
        find(&self.spring_dofs, &mut self.springs);
        find(&model.dashpots, &mut self.dashpots);
        let supported = |place: u32| {
            let node = coupled.nodes[place as usize] as usize;
            (0..3)
                .map(|c| model.dof(node, c))
                .any(|dof| model.held[dof] || model.until.get(dof).is_some_and(|until| until.is_finite()))
        };
        self.held.clear();
        self.held.extend((0..coupled.nodes.len() as u32).filter(|place| supported(*place)));
        self.held_pairs.clear();
        let held = |place: &u32| self.held.binary_search(place).is_ok();
        let pairs = coupled.pairs.iter().enumerate().filter(|(_, pair)| pair.iter().any(held));
        self.held_pairs.extend(pairs.map(|(number, _)| number as u32));
    }

    /// Write the fields of `state` at `time` [s] to an answer of this layout; `skipped`: nothing has happened in the window that
    /// ends there.
    pub fn write(
        &mut self,
        model: &Model,
        state: &State,
        (time, skipped): (f64, bool),
        (layout, output): (&Layout, &mut [f64]),
    ) {
        if !(skipped && self.at_rest) {
            self.sum(model, state, time);
        }
        self.at_rest = skipped;
        let Sums { force, rate, tangent } = &self.sums;
        let numbers: [&[f64]; 4] = [
            force.as_flattened(),
            rate.as_flattened(),
            tangent.as_flattened(),
            std::slice::from_ref(&model.damping),
        ];
        for ((name, ..), numbers) in FIELDS.iter().zip(numbers) {
            if let Some(at) = layout.sample(name, Sampling::Once, 0) {
                let to = &mut output[at];
                to.copy_from_slice(&numbers[..to.len()]);
            }
        }
    }

    fn sum(&mut self, model: &Model, state: &State, time: f64) {
        let (nodes, coupled, sums) = (model.node_count(), &self.coupled, &mut self.sums);
        let (u, v) = (&state.displacement[..], &state.velocity[..]);
        sums.clear(coupled.nodes.len(), coupled.pairs.len());
        let dofs_of = |node: &u32| [0, 1, 2].map(|c: usize| c * nodes + *node as usize);
        for (force, node) in sums.force.iter_mut().zip(&coupled.nodes) {
            *force =
                dofs_of(node).map(|dof| model.dead_load[dof] - model.damping * model.dof_mass(dof) * v[dof]);
        }
        if !self.applied.is_empty() {
            self.applied.at(model, time);
            self.applied.press(model, u);
            for (force, node) in sums.force.iter_mut().zip(&coupled.nodes) {
                force.iter_mut().zip(dofs_of(node)).for_each(|(f, dof)| *f += self.applied.force[dof]);
            }
        }
        coupled::add_wires(&coupled.near_wires, (u, v), nodes, sums);
        let heading = Heading { u, v, ahead: self.ahead };
        coupled.add_elements(model, &mut self.assembly, heading, &state.history, sums);
        for (dof, place, amount) in self.springs.iter().copied() {
            let component = dof / nodes;
            sums.force[place][component] -= amount * u[dof];
            sums.rate[place][component] -= amount * v[dof];
            sums.tangent[coupled.pair(place as u32, place as u32) as usize][4 * component] += amount;
        }
        for (dof, place, amount) in self.dashpots.iter().copied() {
            sums.force[place][dof / nodes] -= amount * v[dof];
        }
        self.hold(model, time);
    }

    /// Take out what supports hold at `time` [s].
    fn hold(&mut self, model: &Model, time: f64) {
        let (coupled, sums) = (&self.coupled, &mut self.sums);
        let holds = |place: u32, c: usize| {
            model.holds(model.dof(coupled.nodes[place as usize] as usize, c), time, 0.0)
        };
        for place in &self.held {
            for c in (0..3).filter(|c| holds(*place, *c)) {
                sums.force[*place as usize][c] = 0.0;
                sums.rate[*place as usize][c] = 0.0;
            }
        }
        for number in &self.held_pairs {
            let [first, second] = coupled.pairs[*number as usize];
            let block = &mut sums.tangent[*number as usize];
            for c in 0..3 {
                if holds(first, c) {
                    block[3 * c..][..3].fill(0.0);
                }
                if holds(second, c) {
                    block.iter_mut().skip(c).step_by(3).for_each(|entry| *entry = 0.0);
                }
            }
        }
    }
}
