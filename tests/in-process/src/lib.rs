//! A solver in this process as the coupler sees it, for tests: no shared memory, no waiting.

use interface_defs::exchange::{self, Exchange, no_reason, status_of};
use interface_defs::message::{Fault, Hello, Plan, Ready, Statistics};
use interface_defs::participant::payload_lengths;
use interface_defs::selection::{Selected, Selection};
use interface_defs::solver::OnProgress;
use interface_defs::{Failure, Participant, Request, RequestHeader, Solver, Status, Window};

/// A solver in this process: the same behaviour as over shared memory, bit for bit.
pub struct InProcess<S> {
    name: String,
    /// The solver itself.
    pub solver: S,
    exchange: Exchange,
    input: Vec<f64>,
    output: Vec<f64>,
    pending: Option<RequestHeader>,
    fault: Option<Fault>,
    listed: usize,
    sequence: u64,
    /// What was selected when the state was kept from which it is to go on.
    selected: Option<Selected>,
}

impl<S: Solver> InProcess<S> {
    /// `solver` under the name `name`.
    pub fn new(name: &str, solver: S) -> Self {
        Self {
            name: name.into(),
            solver,
            exchange: Exchange::default(),
            input: Vec::new(),
            output: Vec::new(),
            pending: None,
            fault: None,
            listed: 0,
            sequence: 0,
            selected: None,
        }
    }

    fn fault(&self, fault: Fault) -> Failure {
        Failure::Fault { solver: self.name.clone(), fault }
    }
}

impl<S: Solver> Participant for InProcess<S> {
    fn name(&self) -> &str {
        &self.name
    }

    fn hello(&mut self) -> Result<Hello, Failure> {
        Ok(self.solver.hello())
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Failure> {
        let ready = self.solver.prepare(plan, progress).map_err(|f| self.fault(f))?;
        self.exchange = Exchange::new(plan, &ready);
        let (takes, gives) = payload_lengths(plan, &ready);
        self.input = Vec::with_capacity(takes + ready.mesh.node_count());
        self.output = vec![0.0; gives];
        if let Some(selected) = self.selected.take() {
            let Self { exchange, solver, .. } = self;
            exchange.select_again(solver, selected).map_err(|f| self.fault(f))?;
        }
        Ok(ready)
    }

    fn send(&mut self, request: Request, fill: &mut dyn FnMut(&mut [f64])) -> Result<(), Failure> {
        self.sequence += 1;
        self.input.resize(request.sends, 0.0);
        fill(&mut self.input);
        self.pending = Some(RequestHeader { sequence: self.sequence, ..request.header });
        Ok(())
    }

    fn receive(&mut self) -> Result<Status, Failure> {
        let header = self.pending.take().expect("receive follows send");
        let Self { solver, exchange, input, output, .. } = self;
        let outcome = exchange.begin(solver, &header, input).and_then(|length| {
            output.resize(length, 0.0);
            exchange.write(solver, &header, input, output)
        });
        let status = outcome.as_ref().map_or_else(status_of, |_| Status::of(&*solver));
        self.listed = *outcome.as_ref().unwrap_or(&0) as usize;
        self.fault = outcome.err();
        Ok(status)
    }

    fn answer(&self) -> &[f64] {
        &self.output
    }

    fn listed(&self) -> usize {
        self.listed
    }

    fn explain(&mut self) -> Result<Fault, Failure> {
        Ok(self.fault.take().unwrap_or_else(no_reason))
    }

    fn finish(&mut self, commit: bool) -> Result<Statistics, Failure> {
        if commit {
            self.solver.commit().map_err(|f| self.fault(f))?;
        }
        self.solver.finish().map_err(|f| self.fault(f))
    }

    fn save(&mut self, commit: bool) -> Result<Vec<u8>, Failure> {
        let Self { exchange, solver, .. } = self;
        exchange.save(solver, commit).map_err(|f| self.fault(f))
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Failure> {
        self.selected = exchange::resume(&mut self.solver, state).map_err(|f| self.fault(f))?;
        Ok(())
    }
}

/// A solver whose type is not known.
pub struct Any(pub Box<dyn Solver>);

impl Solver for Any {
    fn hello(&self) -> Hello {
        self.0.hello()
    }
    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        self.0.prepare(plan, progress)
    }
    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.0.solve(window, input, output)
    }
    fn commit(&mut self) -> Result<(), Fault> {
        self.0.commit()
    }
    fn select(&mut self, selection: Option<&mut Selection>) -> Result<(), Fault> {
        self.0.select(selection)
    }
    fn committed(&mut self, output: &mut [f64]) -> Result<(), Fault> {
        self.0.committed(output)
    }
    fn reach(&mut self, window: &Window, input: &[f64], nodes: &mut Vec<u32>) -> Result<(), Fault> {
        self.0.reach(window, input, nodes)
    }
    fn has_ended(&self) -> bool {
        self.0.has_ended()
    }
    fn is_at_rest(&self) -> bool {
        self.0.is_at_rest()
    }
    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        self.0.save()
    }
    fn resume(&mut self, state: &[u8]) -> Result<(), Fault> {
        self.0.resume(state)
    }
    fn finish(&mut self) -> Result<Statistics, Fault> {
        self.0.finish()
    }
}
