//! One participant in the loop: it is asked for a window, and its answer is checked.

use crate::schedule::Span;
use crate::side::Side;
use interface_defs::{
    Command, Failure, FaultKind, Fill, Participant, Request, RequestHeader, Statistics, Status, clause,
};

/// How a participant answered.
#[derive(Debug)]
pub(crate) enum Answered {
    /// As asked.
    Done,
    /// It could not; a shorter window may do. Why.
    Failed(String),
    /// It must see more nodes than are selected.
    Beyond,
}

/// What is asked beside the window.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ask {
    /// The command, without a commit.
    pub command: Command,
    /// 0: all nodes; 1: those selected.
    pub selection: u32,
    /// Numbers at the payload's end that select, and how many of them are nodes.
    pub listed: usize,
    pub nodes: usize,
    /// Numbers of the request, and of the answer's fields and gauges.
    pub sends: usize,
    pub expects: Option<usize>,
}

impl Ask {
    /// To solve a window, payloads as they are laid out for `side`.
    pub fn solve(side: &Side, selection: u32) -> Self {
        Self {
            command: Command::Solve,
            selection,
            listed: 0,
            nodes: 0,
            sends: side.request.len(),
            expects: Some(side.layout.len()),
        }
    }
}

/// A participant, and what it does not know yet.
pub(crate) struct SolverSlot<'a> {
    pub participant: &'a mut dyn Participant,
    /// Whether its last solve is accepted and it does not know yet.
    pub commit_due: bool,
    /// Whether it is at work on a request.
    pub asked: bool,
    /// Whether it was at rest, by its last answer.
    pub rests: bool,
}

impl<'a> SolverSlot<'a> {
    /// Of a participant that is at rest.
    pub fn new(participant: &'a mut dyn Participant) -> Self {
        Self { participant, commit_due: false, asked: false, rests: false }
    }

    /// Its state, its last solve committed if it was accepted.
    pub fn save(&mut self) -> Result<Vec<u8>, Failure> {
        self.participant.save(std::mem::take(&mut self.commit_due))
    }

    /// End it; its last solve is committed if it was accepted.
    pub fn finish(&mut self) -> Result<Statistics, Failure> {
        self.participant.finish(std::mem::take(&mut self.commit_due))
    }

    /// Ask for a window, or as `ask` says. The acceptance of the window before travels with the first request.
    pub fn send(&mut self, (span, iteration): (Span, u32), ask: Ask, fill: Fill) -> Result<(), Failure> {
        let commits = std::mem::take(&mut self.commit_due);
        let command = if commits { ask.command.after_commit() } else { ask.command };
        let header = RequestHeader {
            window: span.number,
            iteration,
            command: command as u32,
            start: span.start,
            length: span.length,
            selection: ask.selection,
            listed: ask.listed as u32,
            nodes: ask.nodes as u32,
            ..Default::default()
        };
        self.asked = true;
        self.participant.send(Request { header, sends: ask.sends, expects: ask.expects }, fill)
    }

    /// Ask for a window of `length` [s] from the committed state that does not count: what it answers, or why it does not.
    pub fn try_window(
        &mut self,
        (span, iteration): (Span, u32),
        side: &Side,
        fill: Fill,
    ) -> Result<Result<Vec<f64>, String>, Failure> {
        let rests = self.rests;
        self.send((span, iteration), Ask::solve(side, 0), fill)?;
        let answered = self.receive(span, side);
        self.rests = rests;
        match answered {
            Ok(Answered::Done) => {
                self.check_gauges(span, side)?;
                Ok(Ok(self.participant.answer().to_vec()))
            }
            Ok(Answered::Failed(why)) => Ok(Err(why)),
            Ok(Answered::Beyond) => Ok(Err("it must see nodes that are not selected".into())),
            Err(Failure::Fault { fault, .. }) if fault.kind != FaultKind::Interrupted => {
                Ok(Err(fault.to_string()))
            }
            Err(failure) => Err(failure),
        }
    }

    /// Wait for its answer, all numbers finite.
    pub fn receive(&mut self, span: Span, side: &Side) -> Result<Answered, Failure> {
        let status = self.participant.receive()?;
        self.asked = false;
        self.rests = status == Status::Rest;
        if status == Status::Beyond {
            return Ok(Answered::Beyond);
        }
        if status == Status::Failed {
            let fault = self.participant.explain()?;
            let solver = self.participant.name().to_string();
            return match fault.kind {
                FaultKind::Window => Ok(Answered::Failed(format!("{solver}: {fault}"))),
                _ => Err(Failure::Fault { solver, fault }),
            };
        }
        let payload = self.participant.answer();
        if is_finite(payload) {
            return Ok(Answered::Done);
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
        let what = format!(
            "window {} at t = {} s: {what} is {}; did it become unstable? its own steps may be above the critical one",
            span.number, span.start, payload[index]
        );
        Err(Failure::breach(self.participant.name(), clause::NUMBERS, what))
    }

    /// See that the gauges of its answer for a window are in their ranges.
    pub fn check_gauges(&self, span: Span, side: &Side) -> Result<(), Failure> {
        let Some(what) = side.out_of_range(self.participant.answer()) else { return Ok(()) };
        let what = format!("window {} at t = {} s: {what}", span.number, span.start);
        Err(Failure::breach(self.participant.name(), clause::NUMBERS, what))
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
