//! The quantities of a study, each declared once: those of a member ([`MEMBER_QUANTITIES`]), and those of a rock at a place of its
//! path ([`PATH_QUANTITIES`]). A new one takes a line here, and where it needs a number that is not kept yet, a field of [`Outcome`]
//! or [`PathPoint`].
//!
//! From the line follow: its column in `members.csv` or `lines/NAME.csv`, quantiles with intervals, attributes and rasters of the maps,
//! statistic, exceedance and curve of each line, what `calibrate` compares, what the worst members are chosen by, and the reference.

use super::record::Outcome;
use super::track::PathPoint;
use interface_defs::message::Worse;
use toolkit::history::column;

/// What `calibrate` calls a quantity that can be observed, and the least value that an observation of it can have, in its unit. Of a
/// member and of a line the name is the same where both can be observed.
pub type Observable = (&'static str, f64);

/// A quantity of every member.
#[derive(Debug, Clone, Copy)]
pub struct MemberQuantity {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// In words.
    pub says: &'static str,
    /// Its value.
    pub of: fn(&Outcome) -> f64,
    /// Whether it is known of every member that could start, or of those alone that were computed to an end.
    pub at_start: bool,
    /// Whether the summary has its quantiles, and in which direction they are worse.
    pub quantiles: Option<Worse>,
    /// Whether trajectories and ends on the map have it.
    pub mapped: bool,
    /// Whether it is known of rocks that came to rest alone: of others it is at least that at which they were seen last.
    pub at_rest: bool,
    /// Whether it can be observed.
    pub observed: Option<Observable>,
}

/// Of the end of a member, or of its fall up to there.
const fn end(
    name: &'static str,
    unit: &'static str,
    says: &'static str,
    of: fn(&Outcome) -> f64,
) -> MemberQuantity {
    let (at_start, quantiles, mapped, at_rest, observed) = (false, None, false, false, None);
    MemberQuantity { name, unit, says, of, at_start, quantiles, mapped, at_rest, observed }
}

impl MemberQuantity {
    /// Name of its column.
    pub fn column(&self) -> String {
        column(self.name, self.unit)
    }

    /// Its value for a table: a zero has no sign.
    pub fn value(&self, outcome: &Outcome) -> f64 {
        (self.of)(outcome) + 0.0
    }
}

const NEITHER: Option<Worse> = Some(Worse::Neither);
const LARGER: Option<Worse> = Some(Worse::Larger);
/// Least value of what may be observed below 0.
const ANY: f64 = f64::MIN;

/// All quantities of members, in the order of their columns: what varies stands between those of the start and those of the end.
pub const MEMBER_QUANTITIES: [MemberQuantity; 17] = [
    MemberQuantity { at_start: true, mapped: true, ..end("volume", "m3", "volume", |it| it.volume) },
    MemberQuantity { at_start: true, mapped: true, ..end("mass", "kg", "mass", |it| it.mass) },
    MemberQuantity { observed: Some(("stop_x", ANY)), ..end("end_x", "m", "x of the end", |it| it.end[0]) },
    MemberQuantity { observed: Some(("stop_y", ANY)), ..end("end_y", "m", "y of the end", |it| it.end[1]) },
    end("end_z", "m", "z of the end", |it| it.end[2]),
    end("end_vx", "m/s", "velocity at the end, along x", |it| it.end_velocity[0]),
    end("end_vy", "m/s", "velocity at the end, along y", |it| it.end_velocity[1]),
    end("end_vz", "m/s", "velocity at the end, along z", |it| it.end_velocity[2]),
    MemberQuantity {
        quantiles: NEITHER,
        mapped: true,
        at_rest: true,
        ..end("time", "s", "time of the end", |it| it.time)
    },
    MemberQuantity {
        quantiles: LARGER,
        mapped: true,
        at_rest: true,
        observed: Some(("stop", 0.0)),
        ..end("run_out", "m", "horizontal distance from the start to the end", Outcome::run_out)
    },
    MemberQuantity {
        quantiles: LARGER,
        mapped: true,
        observed: Some(("speed", 0.0)),
        ..end("max_speed", "m/s", "largest speed of the centre", |it| it.path.fastest.0)
    },
    MemberQuantity {
        quantiles: LARGER,
        mapped: true,
        observed: Some(("energy", 0.0)),
        ..end("max_kinetic_energy", "J", "largest kinetic energy, rotation included", |it| {
            it.path.most_energy.0
        })
    },
    MemberQuantity {
        quantiles: LARGER,
        mapped: true,
        observed: Some(("jump_height", ANY)),
        ..end("max_jump_height", "m", "largest height of the lowest point above ground", |it| {
            it.path.highest.0
        })
    },
    MemberQuantity {
        quantiles: NEITHER,
        ..end("impacts", "1", "number of impacts", |it| it.path.impacts as f64)
    },
    end("contact_time_fraction", "1", "share of the time in contact", Outcome::contact_time_fraction),
    end("max_penetration", "1", "deepest overlap over the radius of the sphere", |it| it.penetration),
    end("energy_error", "1", "largest imbalance of energy over that of an impact", |it| it.energy_error),
];

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

/// The tables of members and of crossings, for the reference: a file, then its columns.
pub fn reference() -> String {
    let mut text = "members.csv\n{x,y,z} | m | centre of mass at the start\n{vx,vy,vz} | m/s | velocity at the start\n\
        orientation_{w,x,y,z} | 1 | orientation at the start, a quaternion\n{wx,wy,wz} | rad/s | angular velocity at the start\n"
        .to_owned();
    for MemberQuantity { name, unit, says, .. } in &MEMBER_QUANTITIES {
        text += &format!("{name} | {unit} | {says}\n");
    }
    text += "lines/NAME.csv\n";
    for PathQuantity { crossing, unit, says, .. } in &PATH_QUANTITIES {
        text += &format!("{crossing} | {unit} | {says}, where a rock crosses the line\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_quantity_has_a_name_and_a_column_of_its_own() {
        let columns: BTreeSet<String> = MEMBER_QUANTITIES.iter().map(MemberQuantity::column).collect();
        assert_eq!(columns.len(), MEMBER_QUANTITIES.len());
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
