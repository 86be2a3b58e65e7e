//! Whether a program keeps the contract: a run that examines one of its solvers and goes through `PROTOCOL.md` clause by clause.

use crate::coupling::{Committed, Coupling, CouplingError, Observer};
use crate::guard::{Finding, Outcome};
use crate::settings::CouplingSettings;
use crate::side::Side;
use interface_defs::{
    Diagnostic, Failure, Fault, FieldSpec, Hello, Layout, OnProgress, Participant, Plan, Ready, Request,
    Sampling, Statistics, Status, clause, code, name,
};
use serde::Serialize;
use std::fmt::Write;

/// What was found about one clause, over all of the run.
#[derive(Debug, Clone, Serialize)]
pub struct Judged {
    /// Number of the clause.
    pub clause: &'static str,
    /// What it is about.
    pub title: &'static str,
    /// What was found.
    pub outcome: Outcome,
    /// The numbers, or why it could not be examined.
    pub what: String,
}

/// Clauses that concern a structure alone, and a contact solver alone.
const OF_STRUCTURES: [&str; 3] = [clause::SAMPLES, clause::HELD, clause::MASSES];
const OF_CONTACT: [&str; 1] = [clause::REACTION];
/// Clauses that every window of the run has kept if it came to its end.
const OF_WINDOWS: [&str; 6] =
    [clause::JOINS, clause::HEADER, clause::VERSION, clause::NUMBERS, clause::MESH, clause::INITIAL];

struct Quiet;

impl Observer for Quiet {
    fn prepared(&mut self, _: &Side, _: &Side, _: &[Diagnostic]) -> Result<(), Diagnostic> {
        Ok(())
    }
    fn committed(&mut self, _: &Committed) -> Result<(), Diagnostic> {
        Ok(())
    }
}

/// Run to `end_time` [s], and say of each clause whether the solver `of`, one of the two, keeps it. An error: the input is bad, or the
/// run has ended for another reason than the solver's.
pub fn conform(
    of: &str,
    (settings, end_time): (CouplingSettings, f64),
    (dem, fem): (&mut dyn Participant, &mut dyn Participant),
) -> Result<Vec<Judged>, CouplingError> {
    let is_structure = of == fem.name();
    let scene_known = settings.scene.is_some();
    let mut coupling = Coupling::new(settings, end_time, dem, fem);
    coupling.examination.of = Some(of.to_owned());
    coupling.limits.energy_error = f64::INFINITY;
    let ended = coupling.run(&mut Quiet, &mut |_| Ok(()));
    let ended = ended.and_then(|()| coupling.finish().map(|_| ()).map_err(CouplingError::from));
    let mut findings = std::mem::take(&mut coupling.examination.findings);
    let mut add = |clause, outcome, what: String| findings.push(Finding { clause, outcome, what });
    let windows = coupling.counts.windows;
    match ended {
        Ok(()) => {
            let kept = format!("in {windows} windows, to the end");
            OF_WINDOWS.into_iter().for_each(|clause| add(clause, Outcome::Kept, kept.clone()));
            if is_structure {
                add(clause::VELOCITY, Outcome::Kept, kept);
            }
        }
        Err(CouplingError::Failed(failure)) => match about(&failure, of) {
            Some((clause, what)) => add(clause, Outcome::Broken, what),
            None => return Err(failure.into()),
        },
        Err(CouplingError::NotConverged(why) | CouplingError::Diverged(why)) => {
            add(clause::JOINS, Outcome::Broken, format!("the run ended after {windows} windows: {why}"));
        }
        Err(error) => return Err(error),
    }
    if scene_known {
        add(clause::SCENE, Outcome::Kept, "it has read this scene, or does not compare".into());
    }
    let others: &[&str] = if is_structure { &OF_CONTACT } else { &OF_STRUCTURES };
    let all = clause::ALL.iter().filter(|(number, _)| !others.contains(number));
    Ok(all.map(|(clause, title)| judge(clause, title, &findings)).collect())
}

/// The clause that a failure of the solver `of` is about.
fn about(failure: &Failure, of: &str) -> Option<(&'static str, String)> {
    let what = failure.to_string();
    match failure {
        Failure::Contract { solver, clause, .. } if solver == of => {
            Some((clause.unwrap_or(clause::JOINS), what))
        }
        Failure::Lost { solver, .. } | Failure::Silent { solver, .. } if solver == of => {
            Some((clause::JOINS, what))
        }
        Failure::Absent { who, .. } if who == of => Some((clause::JOINS, what)),
        Failure::Fault { fault, .. } if fault.diagnostic.code == code::PROVENANCE => {
            Some((clause::SCENE, what))
        }
        Failure::Fault { solver, fault } if solver == of && !failure.is_input() => {
            Some((clause::JOINS, format!("it could not go on: {fault}")))
        }
        _ => None,
    }
}

/// The worst of what was found about a clause.
fn judge(clause: &'static str, title: &'static str, findings: &[Finding]) -> Judged {
    let of_it = || findings.iter().filter(|finding| finding.clause == clause);
    let worst = of_it().map(|finding| finding.outcome).max().unwrap_or(Outcome::NotExamined);
    let found: Vec<&str> = of_it().filter(|f| f.outcome == worst).map(|f| f.what.as_str()).collect();
    let nothing = "the run did not come to it";
    let what = match worst {
        Outcome::Broken => found[0],
        _ => found.last().copied().unwrap_or(nothing),
    };
    Judged { clause, title, outcome: worst, what: what.into() }
}

/// All of it for people, a line for each clause.
pub fn text(judged: &[Judged]) -> String {
    let mut text = String::new();
    for Judged { clause, title, outcome, what } in judged {
        let _ = writeln!(text, "{clause:<5} {:<13} {title}: {what}", outcome.words());
    }
    let count = |of| judged.iter().filter(|judged| judged.outcome == of).count();
    let all = [Outcome::Kept, Outcome::Broken, Outcome::Unsettled, Outcome::NotExamined];
    let [kept, broken, unsettled, open] = all.map(count);
    let unsettled = if unsettled > 0 { format!("{unsettled} not settled, ") } else { String::new() };
    let names = judged.iter().filter(|judged| judged.outcome == Outcome::Broken).map(|judged| judged.clause);
    let names =
        if broken > 0 { format!(" ({})", names.collect::<Vec<_>>().join(", ")) } else { String::new() };
    let _ = writeln!(text, "{kept} clauses kept, {broken} broken{names}, {unsettled}{open} not examined");
    text
}

/// The contact solver in the place of one: after some windows of nothing it presses on all nodes of the structure, and lets go again.
#[derive(Default)]
pub struct Load {
    masses: Vec<f64>,
    layout: Layout,
    answer: Vec<f64>,
    window: f64,
}

/// Windows without a force, and windows of one push; its acceleration [m/s2].
const NOTHING: f64 = 5.0;
const PUSH: f64 = 40.0;
const PRESS: f64 = 30.0;

impl Participant for Load {
    fn name(&self) -> &'static str {
        "dem"
    }

    fn hello(&mut self) -> Result<Hello, Failure> {
        let many = |name, sampling| FieldSpec { samples: 64, ..FieldSpec::nodal(name, 3, sampling) };
        Ok(Hello {
            program: "loads of rockfall conform".into(),
            repeats: Some(0.0),
            takes: vec![many(name::DISPLACEMENT, Sampling::FromStart)],
            gives: vec![many(name::FORCE, Sampling::Means), many(name::FORCE, Sampling::AtEnds)],
            ..Hello::default()
        })
    }

    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Failure> {
        let mesh = plan.partner_mesh.clone().unwrap_or_default();
        let mass = |node: usize| mesh.masses.get(node).copied().filter(|mass| mass.is_finite());
        self.masses = (0..mesh.node_count()).map(|node| mass(node).unwrap_or(1.0)).collect();
        self.window = plan.window;
        self.layout = Layout::new(&plan.gives, &mesh, 0);
        self.answer = vec![0.0; self.layout.len()];
        Ok(Ready { initial: self.answer.clone(), mesh, ..Ready::default() })
    }

    fn send(&mut self, request: Request, fill: interface_defs::Fill) -> Result<(), Failure> {
        fill(&mut vec![0.0; request.sends]);
        let header = request.header;
        for field in self.layout.fields() {
            let count = field.sample_count();
            for sample in 0..count {
                let at = header.start + header.length * (sample as f64 + 0.5) / count as f64;
                let phase = at / self.window - NOTHING;
                let press = if phase < 0.0 {
                    0.0
                } else {
                    PRESS * (phase * std::f64::consts::PI / PUSH).sin().powi(2)
                };
                let place = self.layout.sample(name::FORCE, field.sampling, sample).expect("of the field");
                let nodes = self.answer[place].chunks_exact_mut(3).zip(&self.masses);
                nodes.for_each(|(force, mass)| {
                    force.copy_from_slice(&[0.1, 0.2, -1.0].map(|c| c * press * mass))
                });
            }
        }
        Ok(())
    }

    fn receive(&mut self) -> Result<Status, Failure> {
        Ok(Status::Done)
    }

    fn answer(&self) -> &[f64] {
        &self.answer
    }

    fn listed(&self) -> usize {
        0
    }

    fn explain(&mut self) -> Result<Fault, Failure> {
        Ok(Fault::window("never asked"))
    }

    fn finish(&mut self, _: bool) -> Result<Statistics, Failure> {
        Ok(Statistics::default())
    }

    fn save(&mut self, _: bool) -> Result<Vec<u8>, Failure> {
        Ok(Vec::new())
    }

    fn resume(&mut self, _: &[u8]) -> Result<(), Failure> {
        Ok(())
    }
}
