//! The quantities of a rock at a place of its path, each declared once, in a line of [`PATH_QUANTITIES`].

use serde::{Deserialize, Serialize};
use toolkit::history::column;

/// What `calibrate` calls a quantity that can be observed, and the least value that an observation of it can have, in its unit. Of a
/// member and of a line the name is the same where both can be observed.
pub type Observable = (&'static str, f64);

/// Least value of what may be observed below 0.
pub const ANY: f64 = f64::MIN;

/// A member at a place of its path; from it follow the [`PATH_QUANTITIES`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PathPoint {
    /// When [s].
    pub time: f64,
    /// Where its centre is, local [m].
    pub position: [f64; 3],
    /// Velocity [m/s].
    pub velocity: [f64; 3],
    /// Height of its centre above the ground [m]; not a number beside the terrain and over holes in it.
    pub centre: f64,
    /// The same of its lowest point [m].
    pub height: f64,
    /// Speed [m/s].
    pub speed: f64,
    /// Kinetic energy, rotation included [J].
    pub energy: f64,
    /// That of rotation [J].
    pub rotation: f64,
}

/// A quantity of a rock at a place of its path.
#[derive(Debug, Clone, Copy)]
pub struct PathQuantity {
    /// Its name, by which the measures of lines begin, and its columns there.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// In words.
    pub says: &'static str,
    /// Its value.
    pub of: fn(&PathPoint) -> f64,
    /// Name of its column in the tables of crossings, without the unit.
    pub crossing: &'static str,
    /// Whether lines have its statistics: of each member that passes its largest value, which counts as this number where it is less.
    pub statistic: Option<f64>,
    /// Whether cells have the quantiles of its largest values: what the names of their files begin with, and their title without unit.
    pub raster: Option<[&'static str; 2]>,
    /// Whether within a flight it may be larger than at both ends of a piece.
    pub peaks_in_flight: bool,
    /// Whether the worst members on a barrier are chosen by it.
    pub chosen: bool,
    /// Whether it can be observed at a line.
    pub observed: Option<Observable>,
}

const fn on_path(
    name: &'static str,
    unit: &'static str,
    says: &'static str,
    crossing: &'static str,
    of: fn(&PathPoint) -> f64,
) -> PathQuantity {
    let (statistic, raster, peaks_in_flight, chosen, observed) = (None, None, false, false, None);
    PathQuantity { name, unit, says, of, crossing, statistic, raster, peaks_in_flight, chosen, observed }
}

impl PathQuantity {
    /// Name of its column in the tables of crossings.
    pub fn column(&self) -> String {
        column(self.crossing, self.unit)
    }

    /// Its value as a statistic of lines.
    pub fn statistic_of(&self, at: &PathPoint) -> f64 {
        let (value, least) = ((self.of)(at), self.statistic.unwrap_or(f64::MIN));
        // What is not a number stays so: at the border of the terrain a height is not known.
        if value < least { least } else { value }
    }

    /// Its title with its unit as pictures have it, energies in kJ, and what values are multiplied by for that.
    pub fn title(&self) -> (String, f64) {
        let (unit, scale) = if self.unit == "J" { ("kJ", 1e-3) } else { (self.unit, 1.0) };
        (format!("{} [{unit}]", self.says), scale)
    }
}

/// All quantities of places, in the order of the statistics.
pub const PATH_QUANTITIES: [PathQuantity; 6] = [
    PathQuantity {
        statistic: Some(f64::MIN),
        raster: Some(["kinetic_energy", "kinetic energy, rotation included"]),
        chosen: true,
        observed: Some(("energy", 0.0)),
        ..on_path("energy", "J", "kinetic energy, rotation included", "kinetic_energy", |it| it.energy)
    },
    PathQuantity {
        // Below 0 a rock is pressed into soft ground, and passes at its level.
        statistic: Some(0.0),
        raster: Some(["jump_height", "jump height of the lowest point"]),
        peaks_in_flight: true,
        chosen: true,
        observed: Some(("jump_height", ANY)),
        ..on_path("height", "m", "height of the lowest point", "passing_height", |it| it.height)
    },
    PathQuantity {
        // Against it the height of a barrier is judged.
        statistic: Some(f64::MIN),
        ..on_path("centre_height", "m", "height of the centre", "centre_height", |it| it.centre)
    },
    PathQuantity {
        statistic: Some(f64::MIN),
        raster: Some(["speed", "speed"]),
        observed: Some(("speed", 0.0)),
        ..on_path("speed", "m/s", "speed", "speed", |it| it.speed)
    },
    PathQuantity {
        raster: Some(["rotation_energy", "energy of rotation"]),
        ..on_path("rotation_energy", "J", "energy of rotation", "rotation_energy", |it| it.rotation)
    },
    on_path("translation_energy", "J", "energy without rotation", "translation_energy", |it| {
        it.energy - it.rotation
    }),
];

/// Number of quantities with rasters.
pub const RASTERS: usize = {
    let (mut at, mut count) = (0, 0);
    while at < PATH_QUANTITIES.len() {
        count += PATH_QUANTITIES[at].raster.is_some() as usize;
        at += 1;
    }
    count
};

/// Those of which lines have statistics.
pub fn statistics() -> impl Iterator<Item = &'static PathQuantity> + Clone {
    PATH_QUANTITIES.iter().filter(|quantity| quantity.statistic.is_some())
}

/// Those of which maps have rasters.
pub fn rasters() -> impl Iterator<Item = (&'static PathQuantity, [&'static str; 2])> + Clone {
    PATH_QUANTITIES.iter().filter_map(|quantity| Some((quantity, quantity.raster?)))
}

/// All quantities of places, those of these names first: tables keep the order of their columns, whatever is added.
pub fn in_order(first: &[&str]) -> Vec<&'static PathQuantity> {
    let place = |it: &&PathQuantity| first.iter().position(|name| *name == it.name).unwrap_or(first.len());
    let mut all: Vec<_> = PATH_QUANTITIES.iter().collect();
    all.sort_by_key(place);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_quantity_has_a_name_and_a_column_of_its_own() {
        let columns: BTreeSet<String> = PATH_QUANTITIES.iter().map(PathQuantity::column).collect();
        let names: BTreeSet<&str> = PATH_QUANTITIES.iter().map(|quantity| quantity.name).collect();
        assert_eq!([columns.len(), names.len()], [PATH_QUANTITIES.len(); 2]);
    }

    #[test]
    fn a_height_below_the_ground_counts_as_none_and_an_unknown_one_stays_unknown() {
        let height = statistics().find(|quantity| quantity.name == "height").expect("it has a statistic");
        let of = |height_of| height.statistic_of(&PathPoint { height: height_of, ..PathPoint::default() });
        assert_eq!([of(-0.2), of(0.3)], [0.0, 0.3]);
        assert!(of(f64::NAN).is_nan());
    }

    #[test]
    fn tables_keep_the_order_of_their_columns_and_the_rest_follows() {
        let names: Vec<&str> = in_order(&["speed", "height"]).iter().map(|quantity| quantity.name).collect();
        assert_eq!(names[..3], ["speed", "height", "energy"]);
        assert_eq!(names.len(), PATH_QUANTITIES.len());
    }
}
