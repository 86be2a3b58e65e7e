//! When solvers are examined: at the start, at the first touch and more and more rarely while something touches, in the last window, and
//! before anything numerical is blamed. Nothing of it is committed.

use crate::guard::{self, Asked, Contact, Finding, Outcome};
use crate::handshake::Agreement;
use crate::schedule::Span;
use crate::solver_slot::SolverSlot;
use interface_defs::{Failure, Sampling, clause, name};
use std::cell::Cell;

/// After so many times as many windows with a touch solvers are examined again: in a run, and where that is its purpose.
const AGAIN: [u64; 2] = [4, 2];

/// What has been examined.
#[derive(Debug, Default)]
pub struct Examination {
    /// The solver of which all findings are kept, so that a breach does not end the run; `None`: both are examined, and it does.
    pub of: Option<String>,
    /// What was found.
    pub findings: Vec<Finding>,
    /// What looked broken in a run, and may also be what an honest scheme does.
    pub unsettled: Option<String>,
    /// Largest force between rock and net that was examined [N].
    largest: Cell<f64>,
    /// Windows with a touch: so far, and when it was examined last.
    touched: u64,
    examined: u64,
}

impl Examination {
    /// A window was accepted.
    pub fn accepted(&mut self, touches: bool) {
        self.touched += u64::from(touches);
    }

    /// Whether it is time, before a window, the last one of the run or not.
    pub fn is_due(&self, is_last: bool) -> bool {
        let times = AGAIN[usize::from(self.of.is_some())];
        let again = self.touched > self.examined && times.pow(self.touched.ilog(times)) == self.touched;
        again || is_last
    }

    /// Examine both solvers in the committed state from which `span` begins, a window of the scene's length; `gauges` are those of the last
    /// answers that were accepted, of the contact solver and of the structure.
    pub(crate) fn examine(
        &mut self,
        (dem, fem): (&mut SolverSlot, &mut SolverSlot),
        agreement: &mut Agreement,
        span: Span,
        gauges: [&[f64]; 2],
    ) -> Result<(), Failure> {
        let _span = interface_defs::profile!("examine", window = span.number);
        self.examined = self.touched;
        let Agreement { interface, bodies, meshes, dem: dem_side, fem: fem_side, patch, .. } = agreement;
        // Who moves nodes itself, of which a few are selected, is watched by its balance.
        if patch.as_ref().is_some_and(|patch| !patch.is_open()) {
            return Ok(());
        }
        if self.examines(fem) {
            let found = &mut self.findings;
            let mut asked = Asked { slot: fem, side: fem_side, span, iteration: 1, gauges: gauges[1], found };
            let ended = guard::examine_structure(&mut asked, &meshes[1], interface.committed());
            self.take(ended)?;
        }
        if self.examines(dem) && patch.is_none() {
            let account = &dem_side.account;
            let momentum = self.of.is_some() || !account.complete;
            let (coordinates, largest) = (&meshes[0].coordinates, &self.largest);
            let contact = Contact { bodies, largest, coordinates, momentum };
            let found = &mut self.findings;
            let mut asked = Asked { slot: dem, side: dem_side, span, iteration: 1, gauges: gauges[0], found };
            let ended = guard::examine_contact(&mut asked, &contact, &mut |length, to| {
                interface.predict(1, length);
                interface.write_motion(to, 1, 0.0);
            });
            self.take(ended)?;
        }
        if self.of.as_deref() == Some(dem.participant.name()) && patch.is_some() {
            let why = "it moves nodes of the net itself; try --set coupling.yielding_net=false";
            for clause in
                [clause::COMMITTED, clause::REPEATS, clause::LENGTH, clause::FORCE, clause::REACTION]
            {
                let (outcome, what) = (Outcome::NotExamined, why.to_owned());
                self.findings.push(Finding { clause, outcome, what });
            }
        }
        if self.of.is_none() {
            let open = |found: Finding| {
                (found.outcome == Outcome::Unsettled)
                    .then(|| format!("clause {}: {}", found.clause, found.what))
            };
            let open = self.findings.drain(..).filter_map(open).next_back();
            self.unsettled = open.or(self.unsettled.take());
        }
        Ok(())
    }

    fn examines(&self, slot: &SolverSlot) -> bool {
        self.of.as_ref().is_none_or(|of| of == slot.participant.name())
    }

    /// A breach ends a run; an examination goes on with what else there is.
    pub fn take(&mut self, ended: Result<(), Failure>) -> Result<(), Failure> {
        match ended {
            Err(Failure::Contract { what, clause: Some(clause), .. }) if self.of.is_some() => {
                self.findings.push(Finding { clause, outcome: Outcome::Broken, what });
                Ok(())
            }
            other => other,
        }
    }

    /// After the last window: two more that are committed, against one of twice the length.
    pub(crate) fn add_windows(
        &mut self,
        (dem, fem): (&mut SolverSlot, &mut SolverSlot),
        agreement: &mut Agreement,
        span: Span,
        gauges: [&[f64]; 2],
    ) -> Result<(), Failure> {
        let Agreement { interface, bodies, dem: dem_side, fem: fem_side, .. } = agreement;
        let (found, of_structure) = (&mut self.findings, self.of.as_deref() == Some(fem.participant.name()));
        let ended = if of_structure {
            let (u, v) = interface.committed();
            let start = [u, v].concat();
            let mut asked = Asked { slot: fem, side: fem_side, span, iteration: 1, gauges: gauges[1], found };
            let last =
                |what| fem_side.layout.last(what, Sampling::AtEnds).expect("chosen for every structure");
            let places = [last(name::DISPLACEMENT), last(name::VELOCITY)];
            let watched = |answer: &[f64]| places.clone().map(|place| &answer[place]).concat();
            guard::add_windows(&mut asked, &mut |_, _| (), &watched, &start)
        } else {
            let mut asked = Asked { slot: dem, side: dem_side, span, iteration: 1, gauges: gauges[0], found };
            // Who cannot repeat a window was asked for none, and was watched in all.
            if dem_side.hello.repeats.is_none() && !bodies.is_empty() {
                asked.kept(clause::VELOCITY, "bodies go through the run as their velocities say");
            }
            let watched = |answer: &[f64]| bodies.read(&answer[dem_side.layout.gauges()]).concat();
            let start = bodies.read(gauges[0]).concat();
            let mut still = |length, to: &mut [f64]| {
                interface.predict(0, length);
                interface.write_motion(to, 1, 0.0);
                guard::hold_still(dem_side, to);
            };
            guard::add_windows(&mut asked, &mut still, &watched, &start)
        };
        self.take(ended)
    }
}
