//! One participant in the loop: it is asked for a window, and its answer is checked.

use crate::handshake::Side;
use crate::schedule::Span;
use interface_defs::message::FaultKind;
use interface_defs::{Command, Failure, Participant, Request, RequestHeader, Statistics, Status};

/// A participant, and what it does not know yet.
pub(crate) struct Seat<'a> {
    pub participant: &'a mut dyn Participant,
    /// Whether its last solve is accepted and it does not know yet.
    pub commit_due: bool,
    /// Whether it is at work on a request.
    pub asked: bool,
}

impl<'a> Seat<'a> {
    /// Of a participant that is at rest.
    pub fn new(participant: &'a mut dyn Participant) -> Self {
        Self { participant, commit_due: false, asked: false }
    }

    /// End it; its last solve is committed if it was accepted.
    pub fn finish(&mut self) -> Result<Statistics, Failure> {
        self.participant.finish(std::mem::take(&mut self.commit_due))
    }

    /// Ask for a window. The acceptance of the window before travels with the first request.
    pub fn send(
        &mut self,
        span: Span,
        iteration: u32,
        side: &Side,
        fill: &mut dyn FnMut(&mut [f64]),
    ) -> Result<(), Failure> {
        let commits = std::mem::take(&mut self.commit_due);
        let command = if commits { Command::CommitAndSolve } else { Command::Solve };
        let header = RequestHeader {
            window: span.number,
            iteration,
            command: command as u32,
            start: span.start,
            length: span.length,
            ..Default::default()
        };
        self.asked = true;
        let request = Request { header, sends: side.request.len(), expects: side.layout.len() };
        self.participant.send(request, fill)
    }

    /// Wait for its answer, all numbers finite. `Some` is why this window failed.
    pub fn receive(&mut self, span: Span, side: &Side) -> Result<Option<String>, Failure> {
        let status = self.participant.receive()?;
        self.asked = false;
        if status == Status::Failed {
            let fault = self.participant.explain()?;
            let solver = self.participant.name().to_string();
            return match fault.kind {
                FaultKind::Window => Ok(Some(format!("{solver}: {fault}"))),
                _ => Err(Failure::Fault { solver, fault }),
            };
        }
        let payload = self.participant.answer();
        if is_finite(payload) {
            return Ok(None);
        }
        let index = payload.iter().position(|x| !x.is_finite()).expect("one is not finite");
        let what = match (side.layout.owner(index), side.layout.gauge_owner(index)) {
            (Some((field, at)), _) => {
                let components = field.components.max(1) as usize;
                format!("field \"{}\" at item {}, component {}", field.name, at / components, at % components)
            }
            (None, Some(gauge)) => format!("gauge \"{}\"", side.gauges[gauge].name),
            (None, None) => format!("number {index}"),
        };
        Err(Failure::Contract {
            solver: self.participant.name().into(),
            what: format!("window {} at t = {} s: {what} is {}", span.number, span.start, payload[index]),
        })
    }
}

/// Whether all numbers are finite: `0 x` is 0 for these alone. Eight sums, so that they run side by side.
fn is_finite(payload: &[f64]) -> bool {
    let mut sums = [0.0; 8];
    let chunks = payload.chunks_exact(8);
    let rest = chunks.remainder().iter().all(|x| x.is_finite());
    for chunk in chunks {
        for (sum, x) in sums.iter_mut().zip(chunk) {
            *sum += x * 0.0;
        }
    }
    rest && sums.iter().all(|sum| *sum == 0.0)
}
