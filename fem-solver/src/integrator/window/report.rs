//! What a window's answer says beside the samples of motion, and for which part of the interface mesh.

use super::answer::travel;
use super::{Engine, WindowSolver};
use crate::model::Model;
use interface_defs::selection::Selection;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What an answer says of the way to its state.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Booked {
    /// Largest distance that an interface node has moved [m]; 0 where nobody asks.
    pub(super) travel: f64,
    /// All numbers of the gauges.
    pub(super) gauges: Vec<f64>,
}

impl WindowSolver {
    /// Energies at the window's end, reactions and scene gauges over the window.
    pub(super) fn write_gauges(&mut self, model: &Model, output: &mut [f64]) {
        let internal = match &mut self.engine {
            Engine::Explicit(e) => &mut e.internal,
            Engine::Implicit(i) => &mut i.newton.internal,
            Engine::Path(p) => &mut p.corrector.internal,
        };
        self.energies.of(model, internal, &self.trial, &mut self.energy_now);
        let gauges = &mut output[self.answer.layout.len()..];
        let (triples, _) = gauges.as_chunks_mut::<3>();
        for (triple, energy) in triples.iter_mut().zip(&self.energy_now) {
            *triple = [*energy; 3];
        }
        if let (Engine::Path(_), [.., factor, _]) = (&self.engine, &mut triples[..self.energy_now.len()]) {
            let along = &self.trial.along;
            *factor = [factor[0], along.lowest.min(factor[0]), along.highest.max(factor[0])];
        }
        self.recorder.write(&mut gauges[3 * self.energy_now.len()..]);
        self.booked[0].gauges.clear();
        self.booked[0].gauges.extend_from_slice(gauges);
    }

    /// From now on inputs and answers are laid out for `selection`, or for the whole interface mesh. Names the pairs of nodes
    /// that the tangent couples, where a plan asks for it.
    pub fn select(&mut self, model: &Model, mut selection: Option<&mut Selection>) {
        match (&mut self.local, selection.as_deref_mut()) {
            (Some(local), selection) => local.select(model, selection),
            (None, Some(selection)) => selection.pairs.clear(),
            (None, None) => (),
        }
        let selected = selection.map(|s| (&s.nodes[..], s.items()));
        self.loads.select(&selected.map_or(self.answer.whole, |(_, items)| items));
        self.answer.select(selected);
        self.loaded = false;
        if let Some(local) = &mut self.local {
            local.locate(|field| self.answer.place(field));
        }
    }

    /// Write the committed state, reached at `time` [s], to `output`, as every sample of a window.
    pub fn write_committed(&mut self, model: &Model, time: f64, output: &mut [f64]) {
        self.answer.write_all(&self.committed, &self.origin, output);
        let Booked { travel, gauges } = &self.booked[1];
        self.answer.write_travel(*travel, output);
        output[self.answer.layout.len()..].copy_from_slice(gauges);
        if let Some(local) = &mut self.local {
            local.write(model, &self.committed, (time, false), output);
        }
    }

    /// Where a field with one value for the window lies in an answer.
    pub fn place(&self, field: &str) -> Option<Range<usize>> {
        self.answer.place(field)
    }

    /// Write how far the interface nodes have moved in the window that ends at `time` [s], and what a contact solver needs to
    /// move them itself from there, where the answer says so.
    pub(super) fn write_travel_and_local(&mut self, model: &Model, time: f64, output: &mut [f64]) {
        if self.answer.travel.is_some() {
            let (from, to) = (&self.committed.displacement, &self.trial.displacement);
            self.booked[0].travel = travel(from, to, self.nodes, self.answer.shown.selected());
            self.answer.write_travel(self.booked[0].travel, output);
        }
        if let Some(local) = &mut self.local {
            local.write(model, &self.trial, (time, self.skipped), output);
        }
    }
}
