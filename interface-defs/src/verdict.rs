//! What became of a rock, and what tore of a structure: data, whose sentence is their [`Display`](fmt::Display).

use serde::{Deserialize, Serialize};
use std::fmt;

/// Declares [`Fate`]: each with its name in result files, and in words.
macro_rules! fates {
    ($($(#[$about:meta])+ $fate:ident = $name:literal, $words:literal;)+) => {
        /// What became of a rock.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum Fate {
            $($(#[$about])+ #[serde(rename = $name)] $fate,)+
        }

        impl Fate {
            /// All of them, in the order in which they are counted.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$fate),+];

            /// Its name in result files.
            pub fn name(self) -> &'static str {
                [$($name),+][self as usize]
            }

            /// In words.
            pub fn words(self) -> &'static str {
                [$($words),+][self as usize]
            }
        }
    };
}

fates! {
    /// It touched the net, came to no speed along its impact direction, and the net held it.
    Stopped = "stopped", "stopped";
    /// It was stopped, then lost contact on the rebound.
    Rebounded = "rebounded", "rebounded";
    /// It went through the net.
    WentThrough = "went_through", "went through";
    /// It passed over the net.
    PassedOver = "passed_over", "passed over";
    /// It passed under the net.
    PassedUnder = "passed_under", "passed under";
    /// It passed beside the net.
    PassedBeside = "passed_beside", "passed beside";
    /// It came to rest, but not in a net.
    AtRest = "at_rest", "at rest";
    /// It left the terrain.
    LeftTerrain = "left_terrain", "left the terrain";
    /// It still moved at the end of the run, away from the net.
    StillMoving = "still_moving", "still moving";
    /// It was still being stopped at the end of the run.
    #[default]
    Undecided = "undecided", "undecided";
}

/// What became of one rock. Times in s, lengths in m, speeds in m/s; places in the scene's coordinates.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Name of the rock.
    pub rock: String,
    /// What became of it.
    pub fate: Fate,
    /// When: it was stopped, lost contact with the net for good, passed it, came to rest, left the terrain; else the end of the run.
    pub time: f64,
    /// Its speed then; of one that was still being stopped, along its impact direction.
    pub speed: f64,
    /// Where it was then.
    pub position: Option<[f64; 3]>,
    /// Largest travel of its centre along the impact direction since the first touch.
    pub travel: Option<f64>,
    /// From the first touch to the moment without speed along the impact direction.
    pub braking_time: Option<f64>,
    /// First touch of the net.
    pub impact: Option<Touch>,
    /// Speed across the impact direction when it had none along it, where that is worth saying.
    pub transverse_speed: Option<f64>,
    /// Time without contact between the first touch and the stop.
    pub gap: Option<Gap>,
    /// Distance from the net when it passed without a touch.
    pub clearance: Option<f64>,
    /// Whether the structure had torn by then.
    pub net_torn: bool,
    /// How it ended after it had left the net.
    pub then: Option<Ending>,
    /// What tore of the structure in the run. A contact solver does not know; the coupler fills it in.
    pub torn: Vec<Torn>,
}

/// First touch of a rock and a net.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Touch {
    /// When [s].
    pub time: f64,
    /// Speed of the rock [m/s].
    pub speed: f64,
}

/// Time in which nothing of the structure touched a rock that was then stopped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Contact was lost [s].
    pub from: f64,
    /// Contact came again [s].
    pub until: f64,
    /// Speed with which it came back [m/s].
    pub speed: f64,
}

/// How a rock ended, net or not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ending {
    /// [`Fate::AtRest`], [`Fate::LeftTerrain`] or [`Fate::StillMoving`].
    pub fate: Fate,
    /// When [s].
    pub time: f64,
    /// Where.
    pub position: [f64; 3],
    /// Its speed then [m/s].
    pub speed: f64,
    /// Whether it came to rest on terrain, before the end of the run.
    pub on_terrain: bool,
}

impl Verdict {
    /// On a rock that has ended so; whatever concerns a net is empty.
    pub fn of(rock: impl Into<String>, ending: Ending) -> Self {
        Self {
            rock: rock.into(),
            fate: ending.fate,
            time: ending.time,
            speed: ending.speed,
            position: Some(ending.position),
            ..Self::default()
        }
    }

    /// The same of a rock that a net has had to do with, and that ended as it says.
    #[must_use]
    pub fn at_net(self, fate: Fate, time: f64, speed: f64, position: Option<[f64; 3]>) -> Self {
        Self { fate, time, speed, position, ..self }
    }

    /// What else is to be said of a stop.
    fn stop(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if let Some(speed) = self.transverse_speed {
            write!(f, ", where it still moved with {speed:.2} m/s across its impact direction")?;
        }
        if let Some(Gap { from, until, speed }) = self.gap {
            write!(f, ", which counts from its first touch: from {from:.4} s to {until:.4} s ")?;
            write!(f, "nothing of the structure touched it, and it came back to it with {speed:.2} m/s")?;
        }
        Ok(())
    }
}

/// A place, to the centimetre.
struct At([f64; 3]);

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [x, y, z] = self.0;
        write!(f, "({x:.2}, {y:.2}, {z:.2})")
    }
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { time, speed, .. } = self;
        let at = At(self.position);
        match self.fate {
            Fate::LeftTerrain => write!(f, "left the terrain near {at} at {time:.3} s with {speed:.2} m/s"),
            Fate::AtRest if self.on_terrain => {
                write!(f, "came to rest on the terrain near {at} at {time:.3} s")
            }
            Fate::AtRest => write!(f, "was at rest near {at} at the end, at {time:.4} s"),
            _ => write!(f, "still moved with {speed:.2} m/s near {at} at the end, at {time:.4} s"),
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { time, speed, .. } = self;
        let near = self.position.map_or(String::new(), |at| format!(" near {}", At(at)));
        // What has torn hangs lower: a rock that broke a rope is over the net that is left.
        let net = if self.net_torn { "the torn structure" } else { "the net" };
        let (travel, braking) = (self.travel.unwrap_or(0.0), self.braking_time.unwrap_or(0.0));
        write!(f, "rock `{}` ", self.rock)?;
        match (self.fate, self.impact) {
            (Fate::Stopped, Some(impact)) => {
                let Touch { time, speed } = impact;
                // A run that begins in contact touches at 0, less rounding.
                let time = if time.abs() < 5e-5 { 0.0 } else { time };
                write!(f, "was stopped by the net in {braking:.4} s over {travel:.3} m, ")?;
                write!(f, "from {speed:.2} m/s at {time:.4} s")?;
                self.stop(f)?;
            }
            // Of a contact solver that gives no speed.
            (Fate::Stopped, None) => {
                write!(f, "was stopped by the net at {time:.4} s, {braking:.4} s after its first touch")?;
            }
            (Fate::Undecided, None) => {
                write!(f, "was still being stopped by the net at {time:.4} s")?;
            }
            (Fate::Rebounded, _) => {
                write!(f, "rebounded from the net with {speed:.2} m/s at {time:.4} s; ")?;
                write!(f, "it had been stopped in {braking:.4} s over {travel:.3} m")?;
                self.stop(f)?;
            }
            (Fate::Undecided, Some(Touch { time: touch, .. })) => {
                write!(f, "was still being stopped by the net at {time:.4} s: {speed:.2} m/s along its ")?;
                write!(f, "impact direction, {travel:.3} m after its first touch at {touch:.4} s")?;
            }
            (Fate::AtRest | Fate::LeftTerrain | Fate::StillMoving, _) => {
                let on_terrain = self.then.is_none_or(|then| then.on_terrain);
                let position = self.position.unwrap_or_default();
                return Ending { fate: self.fate, time: *time, position, speed: *speed, on_terrain }.fmt(f);
            }
            (passed, Some(Touch { time: touched, speed: with })) => {
                write!(f, "{} {net}: it touched at {touched:.4} s with {with:.2} m/s ", passed.words())?;
                write!(f, "and lost contact at {time:.4} s{near} with {speed:.2} m/s")?;
            }
            (passed, None) => {
                let clear = match (passed, self.clearance) {
                    (Fate::WentThrough, _) => " without touching it,".into(),
                    (_, Some(free)) => format!(" with a clearance of {free:.2} m,"),
                    (_, None) => String::new(),
                };
                write!(f, "{} {net}{clear}{near} at {time:.4} s with {speed:.2} m/s", passed.words())?;
            }
        }
        self.then.map_or(Ok(()), |then| write!(f, "; it {then}"))
    }
}

/// What tore of one part of a structure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Torn {
    /// Name of the part.
    pub part: String,
    /// How many of its elements tore.
    pub elements: u64,
    /// When the first of them did [s].
    pub first: f64,
    /// When the last of them did [s].
    pub last: f64,
    /// Axial force under which the first tore, below 0 in compression [N].
    pub force: f64,
    /// The first of them, by name or place.
    pub member: String,
}

impl fmt::Display for Torn {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { part, first, last, member, .. } = self;
        let kind = if self.force < 0.0 { " of compression" } else { "" };
        let force = format!("{:.1} kN{kind}", self.force.abs() / 1e3);
        match self.elements {
            1 => write!(f, "`{part}` tore at {first:.4} s under {force}: {member}"),
            n => {
                write!(f, "{n} elements of `{part}` tore from {first:.4} s to {last:.4} s, ")?;
                write!(f, "the first under {force}: {member}")
            }
        }
    }
}

/// That nothing tore where something could.
pub const NOTHING_TORE: &str = "nothing of the structure tore";

#[cfg(test)]
mod tests {
    use super::*;

    fn ending(fate: Fate) -> Ending {
        Ending { fate, time: 4.0, position: [1.0, 2.0, 3.5], speed: 7.25, on_terrain: fate == Fate::AtRest }
    }

    #[test]
    fn every_fate_has_a_sentence_that_names_it_and_its_numbers() {
        let free = Verdict::of("block", ending(Fate::StillMoving));
        let touched = Verdict {
            impact: Some(Touch { time: 1.0, speed: 25.0 }),
            travel: Some(4.5),
            braking_time: Some(0.25),
            ..free.clone()
        };
        for (verdict, sentence) in [
            (
                free.clone(),
                "rock `block` still moved with 7.25 m/s near (1.00, 2.00, 3.50) at the end, at 4.0000 s",
            ),
            (
                Verdict::of("block", ending(Fate::AtRest)),
                "rock `block` came to rest on the terrain near (1.00, 2.00, 3.50) at 4.000 s",
            ),
            (
                Verdict { braking_time: Some(0.25), ..free.clone() }.at_net(Fate::Stopped, 1.25, 0.0, None),
                "rock `block` was stopped by the net at 1.2500 s, 0.2500 s after its first touch",
            ),
            (
                free.clone().at_net(Fate::Undecided, 2.0, 0.0, None),
                "rock `block` was still being stopped by the net at 2.0000 s",
            ),
            (
                touched.clone().at_net(Fate::Stopped, 1.25, 0.0, None),
                "rock `block` was stopped by the net in 0.2500 s over 4.500 m, from 25.00 m/s at 1.0000 s",
            ),
            (
                Verdict { net_torn: true, then: Some(ending(Fate::LeftTerrain)), ..touched.clone() }.at_net(
                    Fate::WentThrough,
                    2.0,
                    9.0,
                    Some([0.0; 3]),
                ),
                "rock `block` went through the torn structure: it touched at 1.0000 s with 25.00 m/s and lost contact at \
                 2.0000 s near (0.00, 0.00, 0.00) with 9.00 m/s; it left the terrain near (1.00, 2.00, 3.50) at 4.000 s with 7.25 m/s",
            ),
            (
                Verdict { clearance: Some(1.0), ..free }.at_net(Fate::PassedOver, 2.0, 9.0, Some([0.0; 3])),
                "rock `block` passed over the net with a clearance of 1.00 m, near (0.00, 0.00, 0.00) at 2.0000 s with 9.00 m/s",
            ),
            (
                touched.at_net(Fate::Rebounded, 2.0, 3.0, None),
                "rock `block` rebounded from the net with 3.00 m/s at 2.0000 s; it had been stopped in 0.2500 s over 4.500 m",
            ),
        ] {
            assert_eq!(verdict.to_string(), sentence);
        }
    }

    #[test]
    fn names_of_fates_are_those_of_the_files() {
        for fate in Fate::ALL {
            assert_eq!(serde_name(fate), fate.name());
        }
    }

    /// The name under which serde writes it.
    fn serde_name(fate: Fate) -> String {
        use serde::de::IntoDeserializer;
        let read: Result<Fate, serde::de::value::Error> = Fate::deserialize(fate.name().into_deserializer());
        read.map(|known| known.name().to_owned()).expect("a fate")
    }

    #[test]
    fn torn_parts_are_named_with_force_and_time() {
        let one = Torn {
            part: "rope".into(),
            elements: 1,
            first: 0.3,
            last: 0.3,
            force: 3e5,
            member: "element 7".into(),
        };
        assert_eq!(one.to_string(), "`rope` tore at 0.3000 s under 300.0 kN: element 7");
        let many = Torn { elements: 3, last: 0.4, force: -1e3, ..one };
        assert!(
            many.to_string().starts_with(
                "3 elements of `rope` tore from 0.3000 s to 0.4000 s, the first under 1.0 kN of"
            )
        );
    }
}
