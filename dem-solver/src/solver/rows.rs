//! Which contact law is between what.

use crate::contact::laws::Laws;
use crate::contact::whole::Whole;
use crate::rock::Rock;
use crate::settings::{RockSettings, Settings};
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;

/// For each rock the numbers of its laws with `walls`. Errs with what is missing, and what to try.
pub(super) fn rows(
    laws: &Laws,
    settings: &Settings,
    walls: &[String],
) -> Result<Vec<Vec<u16>>, (String, String)> {
    let row = |rock: &RockSettings| {
        laws.row(&rock.material, walls).map_err(|wall| {
            let rock = &rock.material;
            (
                format!("no table [[contact]] is for `{rock}` and `{wall}`"),
                format!(
                    "add one with between = [\"{rock}\", \"{wall}\"], or one without `between` for all others"
                ),
            )
        })
    };
    settings.rocks.iter().map(row).collect()
}

/// What the contact as a whole of each rock needs; all laws of a rock with the terrain are of that kind, or none.
pub(super) fn whole_rocks(
    laws: &Laws,
    ground_rows: &[Vec<u16>],
    rocks: &[Rock],
    scene: &Scene,
) -> Result<Vec<Option<Whole>>, InputError> {
    let of = |(at, rock): (usize, &Rock)| {
        let mut row = ground_rows.get(at).into_iter().flatten().map(|n| (*n, laws.walls[*n as usize].whole));
        let Some((_, whole)) = row.next() else { return Ok(None) };
        match row.find(|(_, other)| *other != whole) {
            Some((other, _)) => Err(scene
                .invalid(
                    &format!("contact.{other}.law"),
                    format!("rock `{}` has `hertz_rock` with one part of the terrain and another law with the next", rock.name),
                )
                .try_instead("write law = \"hertz_rock\" in all its tables, or in none")),
            None => Ok(whole.then(|| Whole::new(rock))),
        }
    };
    rocks.iter().enumerate().map(of).collect()
}

/// For each rock the numbers of its laws with all rocks, its own left open; `None` with one rock, or
/// without any law.
pub(super) fn rows_of_rocks(
    laws: Option<&Laws>,
    settings: &Settings,
    scene: &Scene,
) -> Result<Option<Vec<Vec<u16>>>, InputError> {
    let Some(laws) = laws.filter(|_| settings.rocks.len() > 1) else { return Ok(None) };
    let mut all = Vec::with_capacity(settings.rocks.len());
    for (a, one) in settings.rocks.iter().enumerate() {
        let mut row = Vec::with_capacity(settings.rocks.len());
        for (b, other) in settings.rocks.iter().enumerate() {
            match laws.number(&one.material, &other.material) {
                Some(number) => row.push(number as u16),
                None if a == b => row.push(0),
                None => {
                    let what = format!(
                        "no table [[contact]] is for `{}` and `{}`, of which rocks `{}` and `{}` are",
                        one.material, other.material, one.name, other.name
                    );
                    let advice = format!(
                        "add one with between = [\"{}\", \"{}\"], or one without `between` for all others",
                        one.material, other.material
                    );
                    return Err(scene.invalid("rock", what).try_instead(advice));
                }
            }
        }
        all.push(row);
    }
    Ok(Some(all))
}
