//! Which nodes of the net cross the interface, asked of both solvers anew.

use super::Coupling;
use crate::handshake::Agreement;
use crate::observer::CouplingError;
use crate::schedule::Span;
use crate::seat::{Answered, Ask};
use interface_defs::{Command, Failure};

impl Coupling<'_> {
    /// Select the nodes that cross anew: all of the committed state to the contact solver, which lists what it must see; that to
    /// the structure, which says how these nodes are coupled.
    pub(super) fn reselect(&mut self, span: Span, agreement: &mut Agreement) -> Result<(), CouplingError> {
        let Agreement { interface, dem, fem, patch, .. } = agreement;
        let Some(patch) = patch else { return Err(no_selection(self.dem.participant.name())) };
        self.counts.selections += 1;
        let all = patch.all();
        for side in [&mut *dem, &mut *fem] {
            side.request.resize(&all);
            side.layout.resize(&all);
        }
        let state = Ask {
            command: Command::State,
            selection: 0,
            listed: 0,
            nodes: 0,
            sends: 0,
            expects: Some(fem.layout.len()),
        };
        self.fem.send((span, 1), state, &mut |_| ())?;
        done(self.fem.receive(span, fem)?, self.fem.participant.name())?;
        interface.select(dem, fem, all.nodes, false, self.fem.participant.answer());
        interface.predict(self.settings.predictor, span.length);
        let reach = Ask { command: Command::Reach, sends: dem.request.len(), expects: Some(0), ..state };
        self.dem.send((span, 1), reach, &mut |payload| interface.write_motion(payload, 1, 0.0))?;
        done(self.dem.receive(span, dem)?, self.dem.participant.name())?;
        let breaks = |solver: &str, what: String| Failure::Contract { solver: solver.into(), what };
        patch
            .select(self.dem.participant.answer(), span.length)
            .map_err(|what| breaks(self.dem.participant.name(), what))?;
        let nodes = patch.nodes().len();
        let state = Ask { selection: 1, listed: nodes, nodes, sends: nodes, expects: None, ..state };
        self.fem.send((span, 1), state, &mut |list| patch.announce(list))?;
        done(self.fem.receive(span, fem)?, self.fem.participant.name())?;
        let answer = self.fem.participant.answer();
        let fields = answer.len() - self.fem.participant.listed();
        patch.set_pairs(&answer[fields..]).map_err(|what| breaks(self.fem.participant.name(), what))?;
        let items = patch.items();
        for side in [&mut *dem, &mut *fem] {
            side.request.resize(&items);
            side.layout.resize(&items);
        }
        if fields != fem.layout.len() {
            let what = format!(
                "its committed state has {fields} numbers, its fields and gauges make {}",
                fem.layout.len()
            );
            return Err(breaks(self.fem.participant.name(), what).into());
        }
        interface.select(dem, fem, nodes, true, &answer[..fields]);
        Ok(())
    }
}

/// An answer that only a solver with a part of the net may give, of one that has all.
pub(super) fn no_selection(solver: &str) -> CouplingError {
    let what = "answered status 3, beyond the selection, to a request for all nodes".into();
    Failure::Contract { solver: solver.into(), what }.into()
}

/// A request that cannot fail.
fn done(answered: Answered, solver: &str) -> Result<(), CouplingError> {
    match answered {
        Answered::Done => Ok(()),
        Answered::Failed(what) => Err(Failure::Contract { solver: solver.into(), what }.into()),
        Answered::Beyond => Err(no_selection(solver)),
    }
}
