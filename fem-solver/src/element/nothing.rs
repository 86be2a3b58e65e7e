//! Of a group of a mesh nothing is made; its name is still good for supports, loads and gauges.

use super::cable_properties::CableConfig;
use super::part::{NewElements, PartCell, PartHead, PartSettings, StatedSection};
use crate::read::mesh::Kind;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Nothing: a group of a mesh that can still be held, loaded and gauged by its name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoPart {
    /// Name of the group.
    pub name: String,
}

impl PartHead for NoPart {
    fn name(&self) -> &str {
        &self.name
    }

    fn cells(&self) -> &[Vec<usize>] {
        &[]
    }

    fn plural(&self) -> &'static str {
        "nothing"
    }

    fn nodes(&self) -> (usize, usize) {
        (0, usize::MAX)
    }

    fn takes(&self, _kind: Kind) -> bool {
        true
    }
}

impl PartSettings for NoPart {
    fn build(&self, _cell: &PartCell, _made: &mut NewElements) -> Result<(), Diagnostic> {
        Ok(())
    }

    fn section(&self, _common: Option<&CableConfig>) -> Option<StatedSection> {
        None
    }

    fn makes_nothing(&self) -> bool {
        true
    }
}
