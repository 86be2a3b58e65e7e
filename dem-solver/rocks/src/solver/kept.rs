//! What the solver writes down of itself at the end of a committed window, and how it goes on from that.

use super::{DemSolver, prepared};
use crate::integrator::window::KeptIntegrator;
use crate::model::state::State;
use crate::results::fields::{FieldFiles, KeptFields};
use crate::results::trajectory::Trajectory;
use interface_defs::Fault;
use serde::{Deserialize, Serialize};
use toolkit::checkpoint::{pack, unpack};
use toolkit::history::Mark;

/// All that the next windows follow from.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Kept {
    state: State,
    integrator: KeptIntegrator,
    fields: Option<KeptFields>,
    /// `trajectory.csv` as it was.
    trajectory: Option<Mark>,
}

impl Kept {
    pub(super) fn read(bytes: &[u8]) -> Result<Box<Self>, Fault> {
        unpack(bytes).map(Box::new)
    }
}

impl DemSolver {
    /// What is committed, as bytes.
    pub(super) fn keep(&mut self) -> Result<Vec<u8>, Fault> {
        let run = prepared(self.run.as_ref(), "for its state")?;
        let (integrator, state) = run.kept(&self.committed);
        let fields = self.fields.as_mut().map(FieldFiles::kept).transpose()?;
        let trajectory = self.trajectory.as_ref().map(Trajectory::kept).transpose()?;
        Ok(pack(&Kept { state, integrator, fields, trajectory }))
    }

    /// Open the files of results: new ones, or those of a run that goes on from `kept`.
    pub(super) fn open_files(&mut self, kept: Option<&mut Kept>) -> Result<(), Fault> {
        (self.fields, self.trajectory) = (None, None);
        let Some(out) = self.options.out.clone() else { return Ok(()) };
        let (fields, trajectory) = match kept {
            Some(kept) => (kept.fields.take(), kept.trajectory.take()),
            None => (None, None),
        };
        if let Some(interval) = self.model.settings.fields {
            let dir = out.join("fields");
            match fields {
                Some(kept) => self.fields = Some(FieldFiles::go_on(&dir, interval, &self.model, kept)?),
                None => {
                    self.fields = Some(FieldFiles::create(&dir, interval, &self.model)?);
                    self.write_fields()?;
                }
            }
        }
        if self.model.ground.is_some() && self.model.settings.named() > 0 {
            self.trajectory = Some(match trajectory {
                Some(mark) => Trajectory::go_on(&out, &mark)?,
                None => Trajectory::create(&out, &self.model, &self.committed)?,
            });
        }
        Ok(())
    }

    /// Stand where `kept` was.
    pub(super) fn go_on(&mut self, kept: Kept) {
        let Some(run) = &mut self.run else { return };
        run.go_on(kept.integrator);
        self.committed = kept.state;
        run.reserve(&mut self.committed);
        self.trial = self.committed.clone();
        run.reserve(&mut self.trial);
    }
}
