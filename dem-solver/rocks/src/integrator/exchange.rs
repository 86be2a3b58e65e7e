//! What crosses the interface in a window: where request and answer hold it, of which nodes, and for how long nothing will.

use crate::integrator::box_stage::BoxStage;
use crate::integrator::mesh_stage::MeshWindow;
use crate::integrator::schedule::Request;
use crate::integrator::secondary_impacts::bend;
use crate::integrator::window::RockIntegrator;
use crate::model::Model;
use crate::model::state::State;
use interface_defs::{Fault, Sampling, Selection, Window, name};

/// How much further than in the window begun last nodes may drift in those to come.
const AGAIN: f64 = 1.5;

impl RockIntegrator {
    /// Find the fields in the layouts of request and answer.
    pub(super) fn lay_out(&mut self) {
        let Self { takes, gives, fields, local, answer, .. } = self;
        fields.lay_out(takes);
        local.lay_out(takes, gives);
        answer.lay_out(gives);
        self.broken = takes.sample(name::BROKEN, Sampling::Once, 0);
        self.travel_at = takes.sample(name::TRAVEL, Sampling::Once, 0);
        self.free_time_at = gives.sample(name::FREE_TIME, Sampling::Once, 0);
    }

    /// From now on requests and answers are of the nodes of `selection`; `None`: of all. What `state` remembers of nodes goes
    /// with them.
    pub fn select(&mut self, selection: Option<&Selection>, state: &mut State) {
        let place = |node: u32| self.fields.place(node);
        match selection {
            Some(of) => state.select(place, of.nodes.iter().copied(), &mut self.remembered),
            None => state.select(place, 0..self.all.nodes as u32, &mut self.remembered),
        }
        let items = selection.map_or(self.all, Selection::items);
        self.takes.resize(&items);
        self.gives.resize(&items);
        self.fields.select(selection);
        self.lines.clear();
        self.lines.extend(selection.iter().flat_map(|s| &s.lines));
        self.lay_out();
        if let (Some(selection), Some(mesh), true) = (selection, &self.contact_mesh, self.is_local) {
            self.net.select(selection, &mesh.nodes, mesh.inverse_mass.as_deref());
        }
    }

    /// The nodes that windows as long as `window` need from `state` on, of an input that has all.
    pub fn reach(
        &mut self,
        model: &Model,
        state: &State,
        window: &Window,
        input: &[f64],
        nodes: &mut Vec<u32>,
    ) -> Result<(), Fault> {
        let Some(contact_mesh) = &self.contact_mesh else { return Ok(()) };
        self.fields.see(input);
        self.secondary_impacts.find(model, &self.rock_stage, state, window.length);
        let length = window.length;
        let view = MeshWindow::new(Request { model, input, length }, contact_mesh, &self.fields);
        // Of windows as long as this one: the flight before it may have been a hundred times as long.
        let drift = AGAIN * self.half_acceleration * length * length;
        nodes.clear();
        for ((stage, body), kick) in
            self.mesh_stages.iter_mut().zip(&state.bodies).zip(&self.secondary_impacts.displacements)
        {
            let bend = bend(model, body, window.length);
            nodes.extend_from_slice(stage.list(view, &body.motion, *kick + drift + bend)?);
        }
        nodes.sort_unstable();
        nodes.dedup();
        Ok(())
    }

    /// Make room in `state` for what its contacts remember.
    pub fn reserve(&self, state: &mut State) {
        let sides = self.sides.as_ref().map_or(0, BoxStage::most_contacts);
        for body in &mut state.bodies {
            body.reserve(self.most_contacts, sides);
        }
        state.between_rocks.reserve(self.rock_stage.most_contacts());
        let numbers = self.contact_mesh.as_ref().map_or(0, |contact_mesh| 3 * contact_mesh.nodes.len());
        state.predicted.reserve(numbers.saturating_sub(state.predicted.len()));
        if self.is_local {
            state.pushed.reserve(numbers.saturating_sub(state.pushed.len()));
        }
    }

    /// Say how long nothing will touch the net.
    pub(super) fn write_free_time(&self, request: Request, state: &State, output: &mut [f64]) {
        let (Some(at), Some(contact_mesh)) = (&self.free_time_at, &self.contact_mesh) else { return };
        let view = MeshWindow { travel: self.travel, ..MeshWindow::new(request, contact_mesh, &self.fields) };
        let times = self.mesh_stages.iter().zip(&state.bodies).map(|(stage, body)| {
            // Who touches is known to have no time, whatever else is near.
            let touches = body.contacts > 0 && stage.touches();
            if touches { 0.0 } else { stage.free_time(view, &body.motion) }
        });
        let others = if self.rock_stage.is_empty() { f64::INFINITY } else { request.length };
        output[at.start] = times.fold(others, f64::min);
    }

    /// Refuse a request that is not of the plan.
    pub(super) fn check_request(&self, window: &Window, input: &[f64], output: &[f64]) -> Result<(), Fault> {
        if !(window.length > 0.0 && window.length.is_finite()) {
            return Err(Fault::broken(format!("a window of {} s cannot be solved", window.length)));
        }
        let (takes, gives, has, room) = (self.takes.len(), self.gives.len(), input.len(), output.len());
        if (has, room) != (takes, gives) {
            return Err(Fault::broken(format!(
                "the request has {has} numbers and room for {room}, by the plan they are {takes} and {gives}"
            )));
        }
        Ok(())
    }
}
