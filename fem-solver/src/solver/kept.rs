//! What the structure writes down of itself at the end of a committed window, and how it goes on from that.

use super::Prepared;
use crate::equilibrium::form_finding::Form;
use crate::equilibrium::newton::Info;
use crate::integrator::window::{KeptWindows, other_structure};
use crate::model::Model;
use crate::results::fields::{Fields, KeptFields};
use interface_defs::message::Fault;
use serde::{Deserialize, Serialize};
use std::path::Path;
use toolkit::checkpoint::{pack, unpack};
use toolkit::run_dir;

/// All that the next windows follow from.
#[derive(Serialize, Deserialize)]
pub(super) struct Kept {
    /// The form at t = 0 and what it took, so that it is not looked for again.
    pub(super) form: (Form, Info),
    windows: KeptWindows,
    /// End of the last window accepted [s].
    accepted: f64,
    fields: Option<KeptFields>,
}

impl Kept {
    /// What was kept of `model`.
    pub(super) fn read(bytes: &[u8], model: &Model) -> Result<Box<Self>, Fault> {
        let kept: Self = unpack(bytes)?;
        let Form { displacement, history, .. } = &kept.form.0;
        if (displacement.len(), history.len()) != (model.dof_count(), model.start_history().len()) {
            return Err(other_structure());
        }
        Ok(Box::new(kept))
    }
}

impl Prepared {
    /// What is committed, as bytes.
    pub(super) fn keep(&mut self) -> Result<Vec<u8>, Fault> {
        let fields = self.fields.as_mut().map(Fields::kept).transpose()?;
        Ok(pack(&Kept {
            form: self.form.clone(),
            windows: self.windows.kept(),
            accepted: self.accepted,
            fields,
        }))
    }

    /// Stand where `kept` was, with the files of results in `out` as they were then.
    pub(super) fn go_on(&mut self, model: &Model, kept: Kept, out: Option<&Path>) -> Result<(), Fault> {
        self.windows.go_on(model, kept.windows)?;
        (self.time, self.accepted) = (kept.accepted, kept.accepted);
        if let (Some(fields), Some(out), Some(kept)) = (self.fields.take(), out, kept.fields) {
            self.fields = Some(fields.go_on(&out.join(run_dir::FIELDS), kept)?);
        }
        Ok(())
    }
}
