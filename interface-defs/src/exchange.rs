//! What a request asks of a solver: one path for every transport, of this crate or of others.

use crate::field::{Items, Layout};
use crate::header::{Command, RequestHeader, Status};
use crate::mesh::InterfaceMesh;
use crate::message::{Fault, FaultKind, Plan, Ready, pack, unpack};
use crate::selection::{Selected, Selection};
use crate::solver::{Solver, Window};
use serde::{Deserialize, Serialize};

/// What is kept of a solver and of its exchange.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    selected: Option<Selected>,
    state: Vec<u8>,
}

/// Let `solver`, which is not prepared yet, go on from what [`Exchange::save`] gave; returns what was selected then.
pub fn resume(solver: &mut dyn Solver, kept: &[u8]) -> Result<Option<Selected>, Fault> {
    let kept: Kept =
        unpack(kept).map_err(|e| Fault::broken(format!("its state that was kept cannot be read: {e}")))?;
    solver.resume(&kept.state)?;
    Ok(kept.selected)
}

/// The solver's side of the exchange of payloads: what is selected, and how long payloads are.
#[derive(Debug, Default)]
pub struct Exchange {
    mesh: InterfaceMesh,
    takes: Layout,
    gives: Layout,
    selection: Selection,
    /// Whether payloads are laid out for the selection.
    selected: bool,
    reach: Vec<u32>,
}

impl Exchange {
    /// Of a prepared solver.
    pub fn new(plan: &Plan, ready: &Ready) -> Self {
        Self {
            takes: Layout::new(&plan.takes, &ready.mesh, 0),
            gives: Layout::new(&plan.gives, &ready.mesh, ready.gauges.len()),
            selection: Selection::new(&ready.mesh),
            selected: false,
            reach: Vec::with_capacity(ready.mesh.node_count()),
            mesh: ready.mesh.clone(),
        }
    }

    /// The committed state of `solver`, and what is selected.
    pub fn save(&self, solver: &mut dyn Solver, commit: bool) -> Result<Vec<u8>, Fault> {
        if commit {
            solver.commit()?;
        }
        let selected = self.selected.then(|| self.selection.selected());
        Ok(pack(&Kept { selected, state: solver.save()? }))
    }

    /// Select what was selected when the state of `solver` was kept.
    pub fn select_again(&mut self, solver: &mut dyn Solver, kept: Selected) -> Result<(), Fault> {
        self.selection.select_again(&self.mesh, kept).map_err(Fault::broken)?;
        self.select_these(solver)
    }

    /// Do all of a request but what writes the answer; returns the answer's length.
    pub fn begin(
        &mut self,
        solver: &mut dyn Solver,
        header: &RequestHeader,
        payload: &[f64],
    ) -> Result<usize, Fault> {
        let command = command(header)?;
        if command.commits() {
            let _span = crate::profile!("commit");
            solver.commit()?;
        }
        self.select(solver, header, payload)?;
        let fields = match command.without_commit() {
            Command::State => 0,
            _ => self.takes.len(),
        };
        let expected = fields + header.listed as usize;
        if payload.len() != expected {
            let (window, sent) = (header.window, payload.len());
            let what = format!("window {window}: the coupler sent {sent} numbers, the plan makes {expected}");
            return Err(Fault::broken(what));
        }
        Ok(match command.without_commit() {
            Command::Reach => {
                self.reach.clear();
                solver.reach(&window(header), &payload[..fields], &mut self.reach)?;
                self.reach.len()
            }
            Command::State if self.selected => self.gives.len() + 2 * self.selection.pairs.len(),
            _ => self.gives.len(),
        })
    }

    /// Write the answer; returns how many numbers at its end are a list.
    pub fn write(
        &mut self,
        solver: &mut dyn Solver,
        header: &RequestHeader,
        payload: &[f64],
        output: &mut [f64],
    ) -> Result<u32, Fault> {
        let command = command(header)?;
        match command.without_commit() {
            Command::Reach => {
                output.iter_mut().zip(&self.reach).for_each(|(o, node)| *o = f64::from(*node));
                Ok(self.reach.len() as u32)
            }
            Command::State => {
                let (fields, list) = output.split_at_mut(self.gives.len());
                solver.committed(fields)?;
                let pairs = self.selection.pairs.iter().flatten();
                list.iter_mut().zip(pairs).for_each(|(o, place)| *o = f64::from(*place));
                Ok(list.len() as u32)
            }
            _ => {
                let _span = crate::profile!("solve", window = header.window, iteration = header.iteration);
                solver.solve(&window(header), &payload[..self.takes.len()], output)?;
                Ok(0)
            }
        }
    }

    /// Lay the payloads out as the request says.
    fn select(
        &mut self,
        solver: &mut dyn Solver,
        header: &RequestHeader,
        payload: &[f64],
    ) -> Result<(), Fault> {
        if header.selection == 0 {
            if std::mem::take(&mut self.selected) {
                solver.select(None)?;
                self.resize(&Items::of(&self.mesh));
            }
            return Ok(());
        }
        if header.listed == 0 {
            let missing = || Fault::broken("a request for a selection that was never made");
            return self.selected.then_some(()).ok_or_else(missing);
        }
        let too_short = || Fault::broken("a request lists more nodes than it has numbers");
        let (listed, nodes) = (header.listed as usize, header.nodes as usize);
        let list = payload.len().checked_sub(listed).map(|from| &payload[from..]).ok_or_else(too_short)?;
        let (nodes, pairs) = list.split_at_checked(nodes).ok_or_else(too_short)?;
        self.selection.set(&self.mesh, nodes.iter().map(|n| *n as u32)).map_err(Fault::broken)?;
        let (pairs, _) = pairs.as_chunks::<2>();
        self.selection.pairs.extend(pairs.iter().map(|pair| pair.map(|place| place as u32)));
        let places = self.selection.nodes.len() as u32;
        if let Some(pair) = self.selection.pairs.iter().find(|p| p[0] > p[1] || p[1] >= places) {
            let what = format!("a request couples places {pair:?} of {places} selected nodes");
            return Err(Fault::broken(what));
        }
        self.select_these(solver)
    }

    /// Lay the payloads out for the selection at hand.
    fn select_these(&mut self, solver: &mut dyn Solver) -> Result<(), Fault> {
        solver.select(Some(&mut self.selection))?;
        self.selected = true;
        let items = self.selection.items();
        self.resize(&items);
        Ok(())
    }

    fn resize(&mut self, items: &Items) {
        self.takes.resize(items);
        self.gives.resize(items);
    }
}

fn command(header: &RequestHeader) -> Result<Command, Fault> {
    let meaningless = || Fault::broken(format!("command {} has no meaning", header.command));
    Command::from_number(header.command).ok_or_else(meaningless)
}

fn window(header: &RequestHeader) -> Window {
    Window { number: header.window, iteration: header.iteration, start: header.start, length: header.length }
}

/// The status by which the coupler learns of a fault.
pub fn status_of(fault: &Fault) -> Status {
    if fault.kind == FaultKind::Beyond { Status::Beyond } else { Status::Failed }
}

/// The fault of a solver that failed without a word.
pub fn no_reason() -> Fault {
    Fault::window("failed without giving a reason")
}
