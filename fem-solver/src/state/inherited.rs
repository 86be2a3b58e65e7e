//! The state that a run leaves at its end, and a run that starts from it.
//!
//! Elements keep their memory in histories alone, so displacements, velocities and histories are all that a structure is
//! at an instant. They mean something for the same model alone: the file says of which it is, part by part.

use crate::config::Integrator;
use crate::internal_force::assembly::Event;
use crate::model::Model;
use crate::state::State;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc::run_id::fnv1a;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::io;
use std::path::Path;
use toolkit::provenance::{BuildId, build_id};
use toolkit::scene::Scene;
use toolkit::start_from::{At, KEY, Origin};
use toolkit::state_file::{self, Unreadable};

/// Version of [`End`], written and read.
const VERSION: u32 = 1;
/// Hint for a state that cannot be used.
const AGAIN: &str = "run that scene again with this version";
/// Hint for a state that is not as it was written.
const COPIED: &str = "run that scene again with this version; a file that was copied must be copied as it is";
/// Difference of two places of a support [relative to the extent of the structure] that is one of rounding.
const SAME_PLACE: f64 = 1e-9;

/// State at the end of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// The build by which it was computed: what the histories of the elements mean is its own.
    pub build: BuildId,
    /// Its structure.
    model: Fingerprint,
    /// Integrator.
    integrator: String,
    /// When that run ended [s].
    pub time: f64,
    /// Displacement from the structure as modelled [m, rad].
    pub displacement: Vec<f64>,
    /// Velocity [m/s, rad/s].
    pub velocity: Vec<f64>,
    /// Acceleration [m/s2]; of implicit schemes.
    pub acceleration: Vec<f64>,
    /// History of all elements.
    pub history: Vec<f64>,
    /// Ruptures so far, each at its time in its own run.
    pub torn: Vec<Event>,
    /// Energy dissipated by damping, work of the interface force, of moving supports, of loads with a history, since the first run began [J].
    pub booked: [f64; 4],
}

/// Identity of the structure of a state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Fingerprint {
    /// Places of the nodes as modelled [m].
    nodes: Vec<[f64; 3]>,
    /// Nodes that have rotations.
    turning: Vec<u64>,
    /// The parts of the scene, and what is in none.
    parts: Vec<LeftPart>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LeftPart {
    name: String,
    elements: u64,
    /// Of the nodes of its elements, in order.
    connectivity: u64,
    /// Of all else that its elements are.
    properties: u64,
}

impl LeftPart {
    /// Of cables and other elements of `model`.
    fn of(name: &str, model: &Model, cables: &[usize], elements: &[usize]) -> Self {
        let (mut nodes, mut properties) = (Vec::new(), String::new());
        let mut add = |own: &[usize], element: &dyn Debug| {
            nodes.push(own.len());
            nodes.extend_from_slice(own);
            properties.push_str(&format!("{element:?}"));
        };
        cables.iter().map(|c| &model.cables[*c]).for_each(|cable| add(&cable.nodes, cable));
        elements.iter().map(|e| &model.elements[*e]).for_each(|element| add(element.nodes(), element));
        let nodes: Vec<u8> = nodes.iter().flat_map(|n| (*n as u64).to_le_bytes()).collect();
        Self {
            name: name.into(),
            elements: (cables.len() + elements.len()) as u64,
            connectivity: fnv1a(&nodes),
            properties: fnv1a(properties.as_bytes()),
        }
    }
}

impl Fingerprint {
    fn of(model: &Model) -> Self {
        let mut loose = [vec![true; model.cables.len()], vec![true; model.elements.len()]];
        let mut parts = Vec::new();
        for part in &model.parts[..model.part_count] {
            part.cables.iter().for_each(|c| loose[0][*c] = false);
            part.elements.iter().for_each(|e| loose[1][*e] = false);
            // A part is of cables or of other elements.
            let elements = if part.cables.is_empty() { &part.elements[..] } else { &[] };
            parts.push(LeftPart::of(&part.name, model, &part.cables, elements));
        }
        let [cables, elements] =
            loose.map(|loose| (0..loose.len()).filter(|i| loose[*i]).collect::<Vec<_>>());
        parts.push(LeftPart::of("the cables in no part", model, &cables, &[]));
        parts.push(LeftPart::of("the elements in no part", model, &[], &elements));
        Self {
            nodes: model.nodes.iter().map(|n| <[f64; 3]>::from(*n)).collect(),
            turning: model.turning.iter().map(|n| *n as u64).collect(),
            parts,
        }
    }

    /// In what `there`, of the run that is started from, differs from this.
    fn difference(&self, there: &Self, model: &Model) -> Option<String> {
        if self.nodes.len() != there.nodes.len() {
            return Some(format!("it has {} nodes, and this one {}", there.nodes.len(), self.nodes.len()));
        }
        let away = |i: usize| (Vector3::from(self.nodes[i]) - Vector3::from(there.nodes[i])).norm();
        let moved: Vec<usize> = (0..self.nodes.len()).filter(|i| self.nodes[*i] != there.nodes[*i]).collect();
        if let Some(farthest) = moved.iter().copied().max_by(|a, b| away(*a).total_cmp(&away(*b))) {
            let (off, node) = (away(farthest), model.node_name(farthest));
            let (count, all) = (moved.len(), self.nodes.len());
            return Some(format!(
                "{count} of its {all} nodes lie elsewhere, the farthest by {off:.3e} m: node {node}"
            ));
        }
        let named = |part: &LeftPart| match part.name.starts_with("the ") {
            true => part.name.clone(),
            false => format!("the part `{}`", part.name),
        };
        for part in &self.parts {
            let (own, name) = (named(part), &part.name);
            let Some(other) = there.parts.iter().find(|p| p.name == *name) else {
                return Some(format!("it has no part `{name}`"));
            };
            let (theirs, here) = (other.elements, part.elements);
            if theirs != here {
                return Some(format!("{own} has {theirs} elements in it, and {here} in this one"));
            }
            if other.connectivity != part.connectivity {
                return Some(format!("the elements of {own} are at other nodes in it"));
            }
            if other.properties != part.properties {
                return Some(format!("the material, section, length or strength of {own} is another in it"));
            }
        }
        if let Some(more) = there.parts.iter().find(|p| !self.parts.iter().any(|own| own.name == p.name)) {
            return Some(format!("it has {} too, and this one has not", named(more)));
        }
        (self.turning != there.turning).then(|| "other nodes of it have rotations".into())
    }
}

impl End {
    /// Of `state` at `time` [s], computed by `integrator`; `before` had torn before the run.
    pub fn new(model: &Model, state: &State, time: f64, integrator: &str, before: &[Event]) -> Self {
        Self {
            build: build_id().clone(),
            model: Fingerprint::of(model),
            integrator: integrator.into(),
            time,
            displacement: state.displacement.clone(),
            velocity: state.velocity.clone(),
            acceleration: state.acceleration.clone(),
            history: state.history.clone(),
            torn: [before, &state.events].concat(),
            booked: [state.dissipated, state.received, state.support_work, state.load_work],
        }
    }

    /// Write it to `path`, as a whole or not at all.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        state_file::write(path, VERSION, self)
    }
}

/// A structure that starts from the end of another run.
#[derive(Debug, Clone)]
pub struct Inherited {
    /// The state at the end of that run.
    pub end: End,
    /// Remarks for the user.
    pub warnings: Vec<Diagnostic>,
    /// The run and the way in which the structure starts from it, with an absolute path.
    pub origin: Origin,
}

impl Inherited {
    /// The state that `scene` starts from, if any; it must be of the same model.
    pub fn of(scene: &Scene, model: &Model, integrator: Integrator) -> Result<Option<Self>, Diagnostic> {
        let Some(origin) = Origin::of(scene)? else { return Ok(None) };
        if origin.at == At::Motion && integrator == Integrator::Static {
            let what = "at = \"motion\" goes on with the velocities of that run, and statics has none";
            let hint = "at = \"rest\", or an integrator with inertia in [fem]";
            return scene.refuse("start_from.at", what, hint);
        }
        let (file, warning) = origin.state(scene)?;
        let shown = file.display();
        let refused = |code, what, hint: &str| scene.invalid(KEY, what).coded(code).try_instead(hint);
        let end: End = state_file::read(&file, VERSION).map_err(|why| {
            let what = format!("the state {shown} cannot be used: {why}");
            match why {
                Unreadable::Foreign(_) => {
                    refused(code::PROVENANCE, format!("{what}; this is fem-solver {}", build_id()), AGAIN)
                }
                Unreadable::File(_) => refused(code::FILE, what, AGAIN),
                Unreadable::Damaged(_) => refused(code::FILE_CONTENT, what, COPIED),
            }
        })?;
        let (theirs, own) = (&end.build, build_id());
        if theirs != own {
            let what = format!(
                "the state {shown} was written by fem-solver {theirs}, and this is {own}: histories may differ"
            );
            return Err(refused(code::PROVENANCE, what, AGAIN));
        }
        if let Some(difference) = Fingerprint::of(model).difference(&end.model, model) {
            let what = format!("the structure of {} is another: {difference}", origin.run.display());
            let hint = "mesh, parts and materials must be those of that run; loads, supports, gauges and [fem] may differ";
            return Err(refused(code::PROVENANCE, what, hint));
        }
        let run = std::path::absolute(&origin.run).unwrap_or_else(|_| origin.run.clone());
        let origin = Origin { run, at: origin.at };
        let warnings = warning.map(|what| Diagnostic::warning(code::TRUST, what)).into_iter().collect();
        let inherited = Self { end, warnings, origin };
        inherited.check(scene, model)?;
        Ok(Some(inherited))
    }

    /// Refuse a state that does not fit, and supports that would jump.
    fn check(&self, scene: &Scene, model: &Model) -> Result<(), Diagnostic> {
        let (n, end, run) = (model.dof_count(), &self.end, self.origin.run.display());
        let damaged = |what: String| scene.invalid(KEY, what).coded(code::FILE_CONTENT).try_instead(AGAIN);
        let histories = model.start_history().len();
        let found = [&end.displacement, &end.velocity, &end.acceleration, &end.history].map(Vec::len);
        let expected = [n, n, n, histories];
        // Schemes without accelerations leave none.
        if ![expected, [n, n, 0, histories]].contains(&found) {
            return Err(damaged(format!(
                "the state of {run} has {found:?} displacements, velocities, accelerations and numbers of history, and this \
                 structure has {expected:?}"
            )));
        }
        let numbers = [&end.displacement[..], &end.velocity, &end.acceleration, &end.booked, &[end.time]];
        if let Some(Event { element, .. }) =
            end.torn.iter().find(|t| t.element as usize >= model.elements.len())
        {
            let what = format!("element {element} has torn in it, and there is none");
            return Err(damaged(format!("the state of {run} is damaged: {what}")));
        }
        if numbers.into_iter().flatten().any(|number| !number.is_finite()) {
            let what = "not all of its displacements, velocities and energies are finite";
            return Err(damaged(format!("the state of {run} is damaged: {what}")));
        }
        let near = SAME_PLACE * model.extent();
        let mut start = end.displacement.clone();
        model.prescribe_first(&mut start);
        let jump = (0..n).find(|dof| (start[*dof] - end.displacement[*dof]).abs() > near);
        let Some(dof) = jump else { return Ok(()) };
        let (name, left, begins) = (model.dof_name(dof), end.displacement[dof], start[dof]);
        let what = format!(
            "the support of {name} would jump: that run has left it at a displacement of {left} m, and its motion begins at \
             {begins} m here"
        );
        let hint = "begin the rows of its motion with the displacement at which that run has left it";
        scene.refuse(KEY, what, hint)
    }

    /// Velocity and acceleration at the end, for the scheme `integrator`: another one finds its accelerations itself. Nothing
    /// moves where the supports of `model` hold it, whatever it did before; those that move go on.
    pub fn motion(&self, model: &Model, integrator: &str) -> [Vec<f64>; 2] {
        let same = self.end.integrator == integrator;
        let acceleration = if same { self.end.acceleration.clone() } else { Vec::new() };
        let mut motion = [self.end.velocity.clone(), acceleration];
        for dof in (0..model.dof_count()).filter(|dof| model.held_first(*dof)) {
            if model.moving.iter().all(|(moving, _)| *moving != dof) {
                motion.iter_mut().filter_map(|of| of.get_mut(dof)).for_each(|number| *number = 0.0);
            }
        }
        motion
    }

    /// In a sentence, for whoever checks a scene.
    pub fn describe(&self) -> String {
        let how = match self.origin.at {
            At::Rest => "at rest",
            At::Motion => "moving on",
        };
        let torn = match self.end.torn.len() {
            0 => "nothing torn".to_owned(),
            count => format!("{count} elements torn"),
        };
        format!("starts from the end of {} ({} s), {how}: {torn}", self.origin.run.display(), self.end.time)
    }
}
