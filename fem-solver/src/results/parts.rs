//! Utilisation of each part, and the energy stored and dissipated in it: a row for each part of the scene, for each group of
//! supports that give way, and for the rest.

use crate::equilibrium::form_finding::Form;
use crate::internal_force::assembly::Assembly;
use crate::model::{Model, Part};
use crate::state::State;
use interface_defs::{PartUse, ShareOf, Utilisation};

/// The rows, where all energy `stored` and `dissipated` [J] is that of `state`; energy that elements had dissipated `before` does not
/// count.
pub fn used(
    model: &Model,
    state: &State,
    [stored, dissipated]: [f64; 2],
    before: Option<&Form>,
) -> Vec<PartUse> {
    let (assembly, u) = (Assembly::new(model), &state.displacement[..]);
    let of = |part: &Part| {
        let cables = part.cables.iter().map(|cable| &model.cables[*cable]);
        let plain: f64 = cables.map(|cable| cable.response(&model.relative(u, cable)).energy).sum();
        let (mut energy, mut yielded) = ([plain, 0.0], false);
        for number in part.elements.iter().copied() {
            let element = &model.elements[number];
            let own = assembly.history(number, &state.history);
            yielded |= element.constants().plastic.is_some_and(|at| own[at] > 0.0);
            let now = element.energy(&assembly.gathered(number, u), own);
            energy[0] += now.stored;
            energy[1] += now.dissipated;
            if let Some(before) = before {
                let own = assembly.history(number, &before.history);
                let then = element.energy(&assembly.gathered(number, &before.displacement), own);
                energy[1] -= then.dissipated;
            }
        }
        (energy, yielded)
    };
    let mut rest = [stored, dissipated];
    let mut all: Vec<PartUse> = Vec::new();
    for (part, largest) in model.accounted().zip(&state.used_parts) {
        let ([stored, dissipated], yielded) = of(part);
        (rest[0], rest[1]) = (rest[0] - stored, rest[1] - dissipated);
        let of = if yielded && largest.of == ShareOf::Section { ShareOf::Yielded } else { largest.of };
        let utilisation = Some(Utilisation { of, ..*largest }).filter(|largest| largest.share > 0.0);
        all.push(PartUse { part: part.name.clone(), utilisation, dissipated, stored });
    }
    all.push(PartUse { part: "the rest".into(), utilisation: None, dissipated: rest[1], stored: rest[0] });
    all.sort_by(|a, b| b.share().total_cmp(&a.share()));
    all
}
