//! Ground that gives way is terrain: with nothing else is it what its formulas say.

use crate::model::Model;
use crate::model::between::rows;
use dem_contact::settings::STRUCTURE;
use interface_defs::diagnostic::{Diagnostic, code};
use toolkit::scene::Scene;

/// Refuse a law of ground that gives way where it would be the law with a net, with the sides of a box, or between rocks.
pub fn check(model: &Model, scene: &Scene) -> Result<(), Diagnostic> {
    let Model { settings, laws: Some(laws), between, side_rows, .. } = model else { return Ok(()) };
    for (number, contact) in settings.contacts.iter().enumerate() {
        let keys = [
            ("friction_max", contact.friction_max),
            ("scarring_drag", contact.scarring_drag),
            ("rolling_friction_impact", contact.rolling_friction_impact),
        ];
        let named = keys.into_iter().find(|(_, value)| value.is_some() && settings.terrain.is_none());
        if let Some((key, _)) = named {
            let what = format!("`{key}` is of contacts with terrain, and the scene has none");
            let refused = scene.invalid(&format!("contact.{number}.{key}"), what);
            return Err(refused.coded(code::UNUSED_KEY).try_instead("leave it out"));
        }
    }
    let gives_way = |n: &u16| laws.surfaces[*n as usize].yielding.is_some();
    let refuse = |number: usize, what: String, cure: &str| {
        let name = settings.contacts[number].law.name();
        let what = format!("`{name}` is a contact of rocks with terrain, {what}");
        let refused = scene.invalid(&format!("contact.{number}.law"), what);
        Err(refused.coded(code::CONTRADICTION).try_instead(cure))
    };
    let Some(first) = (0..settings.contacts.len() as u16).find(gives_way) else { return Ok(()) };
    if settings.terrain.is_none() {
        return refuse(first.into(), "and the scene has none".into(), "add [terrain], or take hertz_mindlin");
    }
    let on_net = scene.has("structure").then(|| rows(laws, settings, &[STRUCTURE.to_owned()]).ok());
    let on_net = on_net.flatten().unwrap_or_default();
    let examples = settings.examples();
    let pairs = examples.iter().flat_map(|a| examples.iter().map(move |b| (*a, *b)));
    let own = |a: usize| a >= settings.named();
    let on_rocks: Vec<u16> = between
        .iter()
        .flat_map(|b| pairs.clone().filter(|(x, y)| x != y || own(*x)).map(|(x, y)| b.law(x, y) as u16))
        .collect();
    for (row, other, name) in [
        (on_net.concat(), "the structure", STRUCTURE),
        (side_rows.concat(), "the box", settings.sides.as_ref().map_or("box", |s| s.material.as_str())),
        (on_rocks, "another rock", settings.rocks[0].material.as_str()),
    ] {
        if let Some(number) = row.iter().find(|n| gives_way(n)) {
            let cure = format!(
                "add a table with between = [\"{}\", \"{name}\"] and law = \"hertz_mindlin\"",
                settings.rocks[0].material
            );
            return refuse((*number).into(), format!("and here also of one with {other}"), &cure);
        }
    }
    Ok(())
}
