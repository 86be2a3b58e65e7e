//! The quantities of a study, each declared once: those of a member ([`MEMBER_QUANTITIES`]) here, those of a rock at a place of its
//! path in [`super::path_quantity`]. A new one takes a line, and where it needs a number that is not kept yet, a field of [`Outcome`]
//! or [`PathPoint`](super::path_quantity::PathPoint).
//!
//! From the line follow: its column in `members.csv` or `lines/NAME.csv`, quantiles with intervals, attributes and rasters of the maps,
//! statistic, exceedance and curve of each line, what `calibrate` compares, what the worst members are chosen by, and the reference.

use super::path_quantity::{ANY, Observable, PATH_QUANTITIES, PathQuantity};
use super::record::Outcome;
use interface_defs::message::Worse;
use toolkit::history::column;

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
    }
}
