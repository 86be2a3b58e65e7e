//! What this program reads of a scene and writes as results, for `rockfall schema`.

use crate::settings::CouplingSettings;
use toolkit::schema::{Share, Tables};

/// Its table and results.
pub fn share() -> Share {
    Tables::default().key::<CouplingSettings>("coupling").results(include_str!("results.txt")).share()
}
