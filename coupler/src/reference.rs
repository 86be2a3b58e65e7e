//! What this program reads of a scene and writes as results, for `rockfall schema`.

use crate::settings::Coupling;
use interface_defs::toolkit::schema::{Entry, Share, Tables};

/// Its table and results.
pub fn share() -> Share {
    Tables::default().key::<Coupling>("coupling").results(RESULTS).share()
}

const fn history(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("history.csv", name, unit, meaning)
}

const fn iteration(name: &'static str, unit: &'static str, meaning: &'static str) -> Entry {
    Entry::new("iterations.csv", name, unit, meaning)
}

const RESULTS: &[Entry] = &[
    history("time", "s", "end of the row's window"),
    history(
        "energy_imbalance",
        "J",
        "energy of the whole system that was made (above 0) or lost since the start",
    ),
    history(
        "energy_interface_defect",
        "J",
        "work on the structure minus work of the contact forces on the interface mesh",
    ),
    history("iterations", "1", "coupling iterations of the window"),
    history("residual", "1", "residual of the displacement at the accepted iteration [m]"),
    Entry::new(
        "summary.json",
        "energy_error",
        "1",
        "largest imbalance of the whole system's energy over the kinetic energy at impact",
    ),
    iteration("window", "1", "number of the window"),
    iteration("iteration", "1", "number of the iteration in it"),
    iteration("start", "s", "start of the window"),
    iteration("length", "s", "length of the window"),
    iteration("residual_displacement", "m", "residual of the displacement"),
    iteration("residual_velocity", "m", "residual of the velocity, times the window"),
    iteration(
        "increment",
        "m",
        "displacement of the interface mesh in the window, to which the residual is compared",
    ),
    iteration("factor", "1", "relaxation factor used"),
    iteration("seconds", "s", "wall time of the iteration"),
];
