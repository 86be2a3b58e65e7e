//! Which contact law is between what.

use dem_contact::contact::whole_rock::Whole;
use dem_contact::law::table::Laws;
use dem_contact::rock::Rock;
use dem_contact::settings::{RockSettings, Settings};
use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;

/// For each rock the numbers of its laws with `surfaces`. Errs with what is missing, and what to try.
pub fn rows(laws: &Laws, settings: &Settings, surfaces: &[String]) -> Result<Vec<Vec<u16>>, [String; 2]> {
    let row = |rock: &RockSettings| {
        laws.row(&rock.material, surfaces).map_err(|surface| no_table(&rock.material, surface))
    };
    settings.rocks.iter().map(row).collect()
}

/// That no law is between two materials, and what to try.
pub(crate) fn no_table(one: &str, other: &str) -> [String; 2] {
    [
        format!("no table [[contact]] is for `{one}` and `{other}`"),
        format!("add one with between = [\"{one}\", \"{other}\"], or one without `between` for all others"),
    ]
}

/// What the contact as a whole of each rock needs; all laws of a rock with the terrain are of that kind, or none.
pub fn whole_rocks(
    laws: &Laws,
    ground_rows: &[Vec<u16>],
    rocks: &[Rock],
    scene: &Scene,
) -> Result<Vec<Option<Whole>>, Diagnostic> {
    let of = |(at, rock): (usize, &Rock)| {
        let kind = |n: u16| {
            let name = laws.settings[n as usize].law;
            laws.surfaces[n as usize].whole.then_some(name)
        };
        let mut row = ground_rows.get(at).into_iter().flatten().map(|n| (*n, kind(*n)));
        let Some((_, first)) = row.next() else { return Ok(None) };
        match row.find(|(_, other)| *other != first) {
            Some((other, second)) => {
                let name = first.or(second).expect("one of two that differ").name();
                scene.refuse(
                    &format!("contact.{other}.law"),
                    format!(
                        "rock `{}` has `{name}` with one part of the terrain and another law with the next",
                        rock.name
                    ),
                    format!("write law = \"{name}\" in all its tables, or in none"),
                )
            }
            None => Ok(first.map(|_| whole(rock))),
        }
    };
    rocks.iter().enumerate().map(of).collect()
}

/// What a rock's contact as a whole needs.
fn whole(rock: &Rock) -> Whole {
    match rock.unscaled.as_deref() {
        // As in a study, where many sizes share one.
        Some((unscaled, scale)) => Whole::new(unscaled).scaled(*scale),
        None => Whole::new(rock),
    }
}

/// What the contact of rocks with each other as wholes needs of each; nothing where all are single spheres, or no law is of that kind.
pub fn whole_pairs(laws: Option<&Laws>, between: Option<&Between>, rocks: &[Rock]) -> Vec<Option<Whole>> {
    let Some((laws, between)) = laws.zip(between) else { return Vec::new() };
    if !between.laws.iter().any(|n| laws.rocks[usize::from(*n)].whole)
        || rocks.iter().all(|r| r.spheres.len() == 1)
    {
        return Vec::new();
    }
    rocks.iter().map(|rock| Some(whole(rock))).collect()
}

/// Which law is between two rocks, by the number of the material of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Between {
    /// For each rock the number of its material.
    material: Vec<u16>,
    /// Law numbers, a row for each material.
    laws: Vec<u16>,
    /// Number of materials.
    count: usize,
}

impl Between {
    /// `None` with one rock, or without any law. What no two rocks ask for is left open.
    pub fn new(laws: Option<&Laws>, settings: &Settings, scene: &Scene) -> Result<Option<Self>, Diagnostic> {
        let Some(laws) = laws.filter(|_| settings.rocks.len() > 1) else { return Ok(None) };
        let mut names: Vec<&str> = Vec::new();
        // The first rock of each material, and the second.
        let mut rocks: Vec<[Option<usize>; 2]> = Vec::new();
        let mut material = Vec::with_capacity(settings.rocks.len());
        for (at, rock) in settings.rocks.iter().enumerate() {
            let number = names.iter().position(|n| *n == rock.material).unwrap_or_else(|| {
                names.push(&rock.material);
                rocks.push([None; 2]);
                names.len() - 1
            });
            let place = rocks[number].iter_mut().find(|place| place.is_none());
            if let Some(place) = place {
                *place = Some(at);
            }
            material.push(number as u16);
        }
        let mut table = Vec::with_capacity(names.len() * names.len());
        for (a, one) in names.iter().enumerate() {
            for (b, other) in names.iter().enumerate() {
                let two = if a == b { (rocks[a][0], rocks[a][1]) } else { (rocks[a][0], rocks[b][0]) };
                match (laws.number(one, other), two) {
                    (Some(number), _) => table.push(number as u16),
                    (None, (Some(first), Some(second))) => {
                        let [first, second] = [first, second].map(|r| &settings.rocks[r].name);
                        let [what, advice] = no_table(one, other);
                        let what = format!("{what}, of which rocks `{first}` and `{second}` are");
                        return scene.refuse("rock", what, advice);
                    }
                    (None, _) => table.push(0),
                }
            }
        }
        Ok(Some(Self { material, laws: table, count: names.len() }))
    }

    /// Number of the law of two rocks.
    pub fn law(&self, a: usize, b: usize) -> usize {
        let [a, b] = [a, b].map(|r| usize::from(self.material[r]));
        usize::from(self.laws[a * self.count + b])
    }
}
