//! Parts against the structure that they are in.

use super::Judge;
use crate::config::Config;
use crate::element::part::{Key, Surroundings};
use crate::model::{Model, Part};
use interface_defs::diagnostic::Diagnostic;

/// Every part against the structure that it is in.
pub(super) fn judge(at: &mut Judge) -> Result<(), Diagnostic> {
    let Judge { scene, config, model, ref mut warnings } = *at;
    let extent = model.extent();
    for (i, (part, built)) in config.structure.parts.iter().zip(&model.parts).enumerate() {
        let key = Key { scene, key: format!("structure.parts.{i}") };
        let size = built.elements.iter().map(|e| {
            let nodes = model.elements[*e].nodes();
            nodes.iter().map(|n| (model.nodes[*n] - model.nodes[nodes[0]]).norm()).fold(0.0, f64::max)
        });
        let size = size.fold(0.0, f64::max);
        let pulled = || pulled(config, model, i);
        warnings.extend(part.judge(&Surroundings { key: &key, extent, size, pulled: &pulled })?);
    }
    Ok(())
}

/// The part with the largest prestress [N] that has a node in common with part number `of`, and that prestress.
fn pulled<'a>(config: &'a Config, model: &Model, of: usize) -> Option<(&'a str, f64)> {
    let nodes = |part: &Part| -> Vec<usize> {
        let cables = part.cables.iter().flat_map(|c| model.cables[*c].nodes);
        cables.chain(part.elements.iter().flat_map(|e| model.elements[*e].nodes().iter().copied())).collect()
    };
    let own = nodes(&model.parts[of]);
    let common = config.structure.cable.as_ref();
    let ropes = config.structure.parts.iter().zip(&model.parts).filter_map(|(part, built)| {
        let section = part.section(common)?;
        let (stress, area) = (section.prestress?, section.area?);
        let touches = nodes(built).iter().any(|node| own.contains(node));
        (touches && stress > 0.0).then(|| (part.name(), stress * area))
    });
    ropes.max_by(|a, b| a.1.total_cmp(&b.1))
}
