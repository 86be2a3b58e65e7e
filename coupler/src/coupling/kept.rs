//! A run that was killed goes on: what the loop keeps of itself, and how it begins again from that.

use super::{Counts, Coupling, Gauges};
use crate::energy::Balance;
use crate::guard;
use crate::handshake::{Agreement, refuse};
use crate::interface::KeptInterface;
use crate::observer::{CouplingError, KeptRun, Observer};
use crate::patch::KeptPatch;
use crate::schedule::Schedule;
use interface_defs::diagnostic::code;
use interface_defs::{Failure, Fault};
use serde::{Deserialize, Serialize};
use toolkit::checkpoint::{pack, unpack};

/// What the loop takes from one window to the next.
#[derive(Serialize, Deserialize)]
struct KeptLoop {
    schedule: Schedule,
    counts: Counts,
    balance: Balance,
    gauges: Gauges,
    interface: KeptInterface,
    motion: guard::Motion,
    patch: Option<KeptPatch>,
    /// What the acceleration takes along.
    acceleration: Vec<u8>,
}

/// A checkpoint that cannot be gone on from.
fn of_checkpoint(fault: Fault) -> Failure {
    refuse(fault.diagnostic.coded(code::PROVENANCE))
}

impl Coupling<'_> {
    /// Between two windows: give the observer the state of all three, if it is time for that or if the run is `interrupted`.
    pub(super) fn keep_if_due(
        &mut self,
        schedule: &Schedule,
        agreement: &Agreement,
        observer: &mut dyn Observer,
        interrupted: bool,
    ) -> Result<(), CouplingError> {
        if !observer.is_due(interrupted) {
            return Ok(());
        }
        if let Some(who) = agreement.forgetful() {
            observer.cannot_keep(who);
            return Ok(());
        }
        self.report(observer)?;
        let (dem, fem) = (self.dem.save()?, self.fem.save()?);
        let acceleration = self.settings.acceleration.memory().map_or(Vec::new(), |memory| pack(memory));
        let kept = KeptLoop {
            schedule: schedule.clone(),
            counts: self.counts,
            balance: self.balance.clone(),
            gauges: self.gauges.clone(),
            interface: agreement.interface.kept(),
            motion: agreement.motion.clone(),
            patch: agreement.patch.as_ref().map(crate::patch::Patch::kept),
            acceleration,
        };
        let time = schedule.next().map_or(self.end_time, |span| span.start);
        observer.keep(time, KeptRun { dem, fem, coupling: pack(&kept) });
        Ok(())
    }

    /// Go on from `kept`; both solvers have been prepared and stand where they stood then.
    pub(super) fn go_on(&mut self, kept: &[u8], agreement: &mut Agreement) -> Result<Schedule, Failure> {
        let kept: KeptLoop = unpack(kept).map_err(of_checkpoint)?;
        let Agreement { interface, dem, fem, patch, motion, .. } = agreement;
        if let (Some(patch), Some(of_patch)) = (patch, kept.patch) {
            patch.go_on(of_patch).map_err(|what| of_checkpoint(Fault::broken(what)))?;
            if !patch.is_open() {
                let items = patch.items();
                for side in [&mut *dem, &mut *fem] {
                    side.request.resize(&items);
                    side.layout.resize(&items);
                }
                interface.select(dem, fem, items.nodes, true, &vec![0.0; fem.layout.len()]);
            }
        }
        interface.go_on(kept.interface);
        *motion = kept.motion;
        (self.counts, self.balance, self.gauges) = (kept.counts, kept.balance, kept.gauges);
        if let Some(memory) = self.settings.acceleration.memory() {
            *memory = unpack(&kept.acceleration).map_err(of_checkpoint)?;
        }
        Ok(kept.schedule)
    }
}
