//! Brakes, rings, membranes and shells: against the structure that they are in.

use crate::config::Config;
use crate::config::part::PartConfig;
use crate::model::{Model, Part};
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;

/// Brakes, rings, membranes and shells against the structure that they are in.
pub fn judge(
    scene: &Scene,
    config: &Config,
    model: &Model,
    warnings: &mut Vec<String>,
) -> Result<(), InputError> {
    let extent = model.extent();
    let too_long = |key: String, name: &str, value: f64, of: &str, limit: f64| {
        let what = format!("{name} is {value} m, and {of} {limit:.4} m");
        scene.invalid(&format!("{key}.{name}"), what).try_instead("metres: 300 mm is 0.3")
    };
    for (i, (part, built)) in config.structure.parts.iter().zip(&model.parts).enumerate() {
        let key = format!("structure.parts.{i}");
        let size = built.elements.iter().map(|e| {
            let nodes = model.elements[*e].nodes();
            nodes.iter().map(|n| (model.nodes[*n] - model.nodes[nodes[0]]).norm()).fold(0.0, f64::max)
        });
        let size = size.fold(0.0, f64::max);
        match part {
            PartConfig::Brake(p) => {
                let travel = p.curve.last().map_or(0.0, |row| row[0]);
                for (name, value) in [("stroke", p.stroke.unwrap_or(0.0)), ("curve", travel)] {
                    if value > 10.0 * extent {
                        return Err(too_long(
                            key,
                            name,
                            value,
                            "the whole structure has an extent of",
                            extent,
                        ));
                    }
                }
                let most = p.curve.iter().map(|row| row[1]).fold(0.0, f64::max);
                if let Some((rope, pull)) =
                    pulled(config, model, i).filter(|(_, pull)| most > 0.0 && most <= *pull)
                {
                    let what = format!(
                        "curve: the brake gives way under {most} N at most, and the prestress of `{rope}`, which ends at it, \
                         alone is {pull:.4e} N"
                    );
                    return Err(scene.invalid(&format!("{key}.curve"), what).try_instead(
                        "rows are [elongation in m, force in N]: 120 kN is 1.2e5; or less prestress",
                    ));
                }
                if most > 0.0 && most < 1e3 {
                    warnings.push(format!(
                        "{key}.curve: the brake gives way under {most} N at most; 120 kN is 1.2e5"
                    ));
                }
                if let (Some(force), Some(first)) = (p.rupture_force, p.curve.first())
                    && force <= first[1]
                {
                    warnings.push(format!(
                        "{key}.rupture_force: the brake breaks under {force} N, before it gives way under {} N",
                        first[1]
                    ));
                }
            }
            PartConfig::Ring(p) if size > 0.0 && p.diameter > 20.0 * size => {
                return Err(too_long(key, "diameter", p.diameter, "its nodes lie within", size));
            }
            PartConfig::Ring(p) if size > 0.0 && !(0.5..=2.0).contains(&(p.diameter / size)) => {
                warnings
                    .push(format!("{key}.diameter: {} m, and its nodes lie {size:.4} m apart", p.diameter));
            }
            PartConfig::Membrane(p) if size > 0.0 && p.thickness > size => {
                return Err(too_long(key, "thickness", p.thickness, "its triangles have sides of", size));
            }
            PartConfig::Shell(p) if size > 0.0 && p.thickness > size => {
                return Err(too_long(key, "thickness", p.thickness, "its triangles have sides of", size));
            }
            _ => {}
        }
    }
    Ok(())
}

/// The part with the largest prestress [N] that has a node in common with part `brake`, and that prestress.
fn pulled<'a>(config: &'a Config, model: &Model, brake: usize) -> Option<(&'a str, f64)> {
    let nodes = |part: &Part| -> Vec<usize> {
        let cables = part.cables.iter().flat_map(|c| model.cables[*c].nodes);
        cables.chain(part.elements.iter().flat_map(|e| model.elements[*e].nodes().iter().copied())).collect()
    };
    let of_brake = nodes(&model.parts[brake]);
    let common = config.structure.cable.as_ref();
    let ropes = config.structure.parts.iter().zip(&model.parts).filter_map(|(part, built)| {
        let (stress, area) = match part {
            PartConfig::Cable(p) => {
                (p.prestress.or(common.map(|c| c.prestress))?, p.area.or(common.map(|c| c.area))?)
            }
            PartConfig::SlidingCable(p) => (p.prestress, p.area),
            _ => return None,
        };
        let touches = nodes(built).iter().any(|node| of_brake.contains(node));
        (touches && stress > 0.0).then(|| (part.head().0, stress * area))
    });
    ropes.max_by(|a, b| a.1.total_cmp(&b.1))
}
