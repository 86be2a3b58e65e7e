//! A run of one solver alone: windows of the output interval, rows from its gauges.

use super::checkpoint::{self, Checkpoint, Store, Subject};
use super::energy;
use super::limits::{Evidence, Limits, cure};
use super::output::Output;
use super::owner::Owner;
use super::progress::{Line, Reporter};
use super::recorder::{KeptLedger, KeptRows, Ledger, Recorder, Windows, broken, describe_processes};
use super::scene::Scene;
use super::summary::{RunStatus, Summary, totals};
use super::uncertainty::{self, Known};
use interface_defs::{
    Diagnostic, Fault, FaultKind, Measure, Plan, Progress, Ready, Solver, Statistics, capability, code,
    ipc::{interrupt, serve::with_cost, wait::is_orphan},
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::time::Instant;

/// Where the results go, and who looks on.
pub(crate) struct Stage<'a> {
    /// Name of the solver's part: `dem`.
    pub role: &'a str,
    /// Directory of the results.
    pub owner: &'a Owner,
    /// Process whose end ends the run.
    pub supervisor: Option<u32>,
    /// Bounds of trust.
    pub limits: Limits,
    /// To whom is reported how far the run is.
    pub reporter: Reporter,
    /// From where the run goes on, if it does not begin.
    pub resume: Option<Checkpoint>,
}

impl Stage<'_> {
    /// Whether the run must end before its time.
    fn look(&self) -> Result<(), Fault> {
        if interrupt::requested() {
            return Err(Fault::interrupted());
        }
        match self.supervisor.filter(|pid| is_orphan(*pid)) {
            Some(pid) => Err(Fault::broken(format!("the launcher (process {pid}) was lost"))),
            None => Ok(()),
        }
    }

    fn preparing(&mut self, end: f64, progress: &Progress) -> Result<(), Fault> {
        tracing::info!("{}", progress.what);
        self.reporter.report(|| Line { end, what: progress.what.clone(), ..Line::default() });
        self.look()
    }
}

struct Solo<'a> {
    solver: &'a mut dyn Solver,
    ledger: Ledger,
    recorder: Recorder,
    windows: Windows,
    checkpoints: Store,
}

/// What is kept of a run beside the state of its solver.
#[derive(Serialize, Deserialize)]
struct Kept {
    ledger: KeptLedger,
    rows: KeptRows,
    windows: Windows,
}

/// Name of the part of a checkpoint that is [`Kept`].
const KEPT: &str = "run";

/// Run `solver` over the scene's time; rows and summary go to `out`.
///
/// The summary has been written when this returns `Ok`, whatever its status. An error is bad input
/// that only the preparation could find.
pub(crate) fn run(stage: &mut Stage, solver: &mut dyn Solver, scene: &Scene) -> Result<Summary, Diagnostic> {
    let owner = stage.owner;
    let out = owner.dir();
    let output = Output::of(scene)?;
    let end_time = scene.end_time()?;
    let hello = solver.hello();
    // The solver may not take windows as long as the interval of the rows.
    let windows = Windows::new(end_time, output.interval, hello.largest_window);
    let plan = Plan { end_time, window: windows.length(), ..Plan::default() };
    let started = Instant::now();
    let resume = stage.resume.take();
    let asked = resume.as_ref().map_or(Ok(()), |from| solver.resume(from.part(stage.role)?));
    let mut report = |progress| stage.preparing(end_time, &progress);
    let preparing = interface_defs::profile!("prepare");
    let mut ready = match asked.and_then(|()| solver.prepare(&plan, &mut report)) {
        Ok(ready) => ready,
        Err(fault) if fault.kind == FaultKind::Input => return Err(*fault.diagnostic),
        Err(fault) => {
            let mut summary = ended_by(fault);
            owner.conclude(&mut summary);
            return Ok(summary);
        }
    };
    drop(preparing);
    let prepared = started.elapsed().as_secs_f64();
    let warnings = std::mem::take(&mut ready.warnings);
    let (mut summary, mut balance) = (Summary::new(RunStatus::Done), None);
    let checkpoints = match hello.can(capability::CHECKPOINT) && output.checkpoint > 0.0 {
        true => Store::new(out, Subject::of(scene)?, output.checkpoint, resume.as_ref()),
        false => Store::none(),
    };
    let outcome =
        Solo::new(solver, ready, stage, windows, checkpoints, resume.as_ref()).and_then(|mut solo| {
            let outcome = solo.advance(stage, end_time);
            solo.describe(&mut summary);
            balance.clone_from(&solo.ledger.balance);
            outcome.and_then(|()| solo.recorder.sync().map_err(broken))
        });
    if let Err(fault) = outcome {
        let Summary { status, message, reasons, .. } = ended_by(fault);
        summary = Summary { status, message, reasons, ..summary };
    }
    let gauges = std::mem::take(&mut summary.measures);
    summary.warnings.splice(0..0, warnings);
    summary.warnings.extend(resume.map(|from| checkpoint::of_last_part(from.time)));
    let _span = interface_defs::profile!("finish");
    let statistics = solver.finish().unwrap_or_else(|fault| {
        summary.warnings.push(Diagnostic::warning(code::ABSENT_MEASURE, format!("no statistics: {fault}")));
        Statistics::default()
    });
    if let Err(taken) = summary.take(&hello.program, &statistics) {
        summary.fail(taken);
    }
    summary.measures.extend(gauges.into_iter().map(|m| Measure { source: hello.program.clone(), ..m }));
    let chance = summary.chance();
    uncertainty::estimate(&mut summary.measures, Known { balance: balance.as_ref(), chance, mean: 0.0 });
    stage.limits.judge(&mut summary, &Evidence { energy: cure(stage.role).into(), ..Evidence::default() });
    uncertainty::scatter(&mut summary.measures);
    let (own, total) = (with_cost(statistics, 0.0), started.elapsed().as_secs_f64());
    summary.cost.insert("wall_s".into(), json!(total));
    summary.cost.insert("stages".into(), json!({ "prepare_s": prepared, "loop_s": total - prepared }));
    totals(&mut summary.cost, &[&own]);
    describe_processes(&mut summary, [(stage.role, &own)]);
    owner.conclude(&mut summary);
    Ok(summary)
}

fn ended_by(fault: Fault) -> Summary {
    let status = match fault.kind {
        FaultKind::Interrupted => RunStatus::Interrupted,
        _ => RunStatus::Failed,
    };
    Summary::ended(status, *fault.diagnostic)
}

impl<'a> Solo<'a> {
    fn new(
        solver: &'a mut dyn Solver,
        ready: Ready,
        stage: &Stage,
        windows: Windows,
        checkpoints: Store,
        resume: Option<&Checkpoint>,
    ) -> Result<Self, Fault> {
        let kept: Option<Kept> =
            resume.map(|from| from.part(KEPT).and_then(checkpoint::unpack)).transpose()?;
        // What a contact solver stores is held in contacts.
        let ledger = Ledger::new(ready, stage.role == "dem")?;
        let (kept, rows) = kept.map(|kept| ((kept.ledger, kept.windows), kept.rows)).unzip();
        let recorder =
            Recorder::open(stage.owner.dir(), &[(&solver.hello().program, ledger.gauges())], &[], rows)
                .map_err(broken)?;
        let mut solo = Self { solver, ledger, recorder, windows, checkpoints };
        match kept {
            None => {
                solo.recorder.take(0.0, solo.ledger.values());
                solo.recorder.write().map_err(broken)?;
            }
            Some((ledger, windows)) => {
                solo.ledger.go_on(ledger)?;
                solo.windows.go_on(windows)?;
            }
        }
        Ok(solo)
    }

    /// Before a window: whether the run must end, and a checkpoint if it is time for one, or if the user has interrupted the run.
    fn look(&mut self, stage: &Stage, time: f64) -> Result<(), Fault> {
        let looked = stage.look();
        let interrupted = matches!(&looked, Err(fault) if fault.kind == FaultKind::Interrupted);
        if self.checkpoints.is_due(interrupted) {
            let (solver, recorder) = (&mut *self.solver, &self.recorder);
            let kept =
                Kept { ledger: self.ledger.kept(), rows: recorder.kept(), windows: self.windows.clone() };
            self.checkpoints.keep(time, || {
                let state = solver.save().map_err(|fault| *fault.diagnostic)?;
                recorder.sync()?;
                Ok(vec![(stage.role.to_owned(), state), (KEPT.to_owned(), checkpoint::pack(&kept))])
            });
        }
        looked
    }

    /// Windows until `end_time`, a row where one is due.
    fn advance(&mut self, stage: &mut Stage, end_time: f64) -> Result<(), Fault> {
        let _span = interface_defs::profile!("loop");
        while let Some(step) = self.windows.current() {
            self.look(stage, step.window.start)?;
            self.windows.next();
            self.ledger.solve(self.solver, &step)?;
            self.recorder.take(step.end, self.ledger.values());
            if let Some(fault) = self.ledger.diverged(step.end, &stage.limits, cure(stage.role)) {
                self.recorder.write().map_err(broken)?;
                return Err(fault);
            }
            let (t, windows) = (step.end, self.windows.solved());
            stage.reporter.report(|| Line { t, end: end_time, windows, ..Line::default() });
            if step.ends_row {
                self.recorder.write().map_err(broken)?;
                if self.solver.has_ended() {
                    break;
                }
            }
        }
        Ok(())
    }

    /// What the gauges have shown.
    fn describe(&self, summary: &mut Summary) {
        summary.measures.extend(self.recorder.measures());
        summary.cost.insert("windows".into(), json!(self.windows.solved()));
        let Some(balance) = &self.ledger.balance else {
            summary.warnings.push(energy::absent("the solver does not report its energies"));
            return;
        };
        summary.energy.insert("kinetic_largest_J".into(), json!(balance.kinetic));
        balance.describe(summary);
    }
}

#[cfg(test)]
mod tests;
