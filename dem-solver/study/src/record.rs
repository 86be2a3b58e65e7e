//! What is kept of a member, and its frame in a journal: length, content as in messages, a hash of both.

use super::base::Base;
use super::grid::Grid;
use super::quantity::{Ended, QUANTITIES};
use super::track::Track;
use dem_rocks::model::Model;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::ipc::run_id::fnv1a;
use interface_defs::message::{pack, unpack};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use toolkit::scene::Scene;
use toolkit::summary::RunStatus;

/// A hash of all that the results depend on: study, scene, terrain, spheres, program.
pub fn fingerprint(base: &Base, file: &Scene) -> String {
    let mut bytes = format!("{} {} ", env!("CARGO_PKG_VERSION"), base.shortcuts).into_bytes();
    bytes.extend(format!("{} {} ", file.fingerprint(), base.scene.fingerprint()).into_bytes());
    let mut take = |n: f64| bytes.extend(n.to_bits().to_le_bytes());
    base.ground.origin.iter().for_each(|n| take(*n));
    base.ground.nodes.iter().flat_map(|p| [p.x, p.y, p.z]).for_each(&mut take);
    // They may be in files.
    let releases = base.study.releases.iter().map(|release| release.place().corners);
    let lines = base.study.lines.iter().map(|line| &line.points[..]);
    releases.chain(lines).flatten().flatten().for_each(|n| take(*n));
    for rock in base.prototypes.iter().map(|p| &p.rock) {
        rock.spheres.iter().flat_map(|s| [s.centre.x, s.centre.y, s.centre.z, s.radius]).for_each(&mut take);
        take(rock.mass);
        rock.inertia.iter().for_each(|n| take(*n));
    }
    bytes.extend(base.ground.triangles.iter().flatten().flat_map(|n| n.to_le_bytes()));
    bytes.extend(&base.ground.zones);
    format!("{:016x}", fnv1a(&bytes))
}

/// How a member ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum How {
    /// It was not computed to an end.
    #[default]
    None,
    /// At rest on the terrain.
    Rest,
    /// It left the terrain.
    Out,
    /// It still moved when the time was over.
    Moving,
}

impl How {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Rest => "rest",
            Self::Out => "left",
            Self::Moving => "moving",
        }
    }
}

/// What became of a member. Lengths in m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Whether it is to be trusted.
    pub status: RunStatus,
    /// How it ended.
    pub how: How,
    /// Where its centre of mass started.
    pub start: [f64; 3],
    /// Its velocity there.
    pub velocity: [f64; 3],
    /// Its orientation there.
    pub orientation: [f64; 4],
    /// Its angular velocity there [rad/s].
    pub spin: [f64; 3],
    /// Its volume [m3].
    pub volume: f64,
    /// Its mass [kg].
    pub mass: f64,
    /// Where it ended.
    pub end: [f64; 3],
    /// Its velocity there.
    pub end_velocity: [f64; 3],
    /// The [`QUANTITIES`] of its fall.
    pub values: [f64; QUANTITIES.len()],
    /// Why it is not to be trusted.
    pub fault: Option<Diagnostic>,
}

impl Outcome {
    fn empty(status: RunStatus, fault: Option<Diagnostic>) -> Self {
        Self {
            status,
            how: How::None,
            start: [0.0; 3],
            velocity: [0.0; 3],
            orientation: [0.0; 4],
            spin: [0.0; 3],
            volume: 0.0,
            mass: 0.0,
            end: [0.0; 3],
            end_velocity: [0.0; 3],
            values: [0.0; QUANTITIES.len()],
            fault,
        }
    }

    /// Of a member that could not start.
    pub fn failed(fault: Diagnostic) -> Self {
        Self::empty(RunStatus::Failed, Some(fault))
    }

    /// Of one that starts as `model` has it.
    pub fn of_start(model: &Model) -> Self {
        let (rock, table) = (&model.rocks[0], &model.settings.rocks[0]);
        Self {
            start: table.position,
            velocity: table.velocity,
            orientation: table.orientation,
            spin: table.angular_velocity,
            volume: rock.solid.volume(),
            mass: rock.mass,
            ..Self::empty(RunStatus::Done, None)
        }
    }

    /// It could not be computed to its end.
    pub fn fail(&mut self, fault: Diagnostic) {
        (self.status, self.fault) = (RunStatus::Failed, Some(fault));
    }

    /// Its fall has ended like this.
    pub fn end(&mut self, fall: &Ended) {
        self.values = QUANTITIES.each_ref().map(|quantity| (quantity.of)(fall));
    }

    /// How far its end is from its start, seen from above [m].
    pub fn run_out(&self) -> f64 {
        let moved = Vector3::from(self.end) - Vector3::from(self.start);
        moved.xy().norm()
    }

    /// Why it is not to be trusted, in words.
    pub fn message(&self) -> String {
        self.fault.as_ref().map(Diagnostic::to_string).unwrap_or_default()
    }
}

/// A member with what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its number, from 1.
    pub number: u64,
    /// What is kept of its trajectory.
    pub track: Track,
    /// What became of it.
    pub outcome: Outcome,
}

/// Bytes of a frame before its content, and after it.
const HEAD: usize = 8;
const TAIL: usize = 8;

impl Record {
    /// The frame: its length, its content, a hash of both.
    pub fn frame(&self) -> Vec<u8> {
        let content = pack(self);
        let mut bytes = (content.len() as u64).to_le_bytes().to_vec();
        bytes.extend(content);
        let hash = fnv1a(&bytes);
        bytes.extend(hash.to_le_bytes());
        bytes
    }

    /// The record at the start of `bytes`, and the length of its frame; `None` where they do not begin with a whole one.
    pub fn read(bytes: &[u8]) -> Option<(Self, usize)> {
        let length = u64::from_le_bytes(*bytes.first_chunk::<HEAD>()?);
        let whole = usize::try_from(length).ok()?.checked_add(HEAD + TAIL)?;
        let (content, hash) = bytes.get(..whole)?.split_last_chunk::<TAIL>()?;
        if fnv1a(content) != u64::from_le_bytes(*hash) {
            return None;
        }
        Some((unpack(&content[HEAD..]).ok()?, whole))
    }

    /// Whether its cells and lines are those of the study: a file may have been made by others.
    pub fn fits(&self, base: &Base) -> bool {
        let cells = base.grid.as_ref().map_or(0, Grid::len);
        self.track.visits.iter().all(|visit| (visit.cell as usize) < cells)
            && self.track.crossings.iter().all(|crossing| usize::from(crossing.line) < base.lines.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Crossing, Visit};

    #[test]
    fn a_record_is_read_as_it_was_written_and_half_of_one_is_none() {
        let mut outcome = Outcome::failed(Diagnostic::new("why, \"so\"").try_instead("that"));
        outcome.how = How::Moving;
        outcome.values = std::array::from_fn(|k| k as f64 + 0.5);
        (outcome.end, outcome.mass) = ([0.25, -1.0, 7.0], 3.5);
        let track = Track {
            visits: vec![
                Visit { cell: 3, values: [1.0, 2.0, 0.5, 4.0] },
                Visit { cell: 9, values: [0.0; 4] },
            ],
            crossings: vec![Crossing { line: 1, values: [0.25; 13] }],
            path: vec![[1.0, 2.0, 3.0, 4.0]; 3],
        };
        let record = Record { number: 42, outcome, track };
        let frame = record.frame();
        assert_eq!(Record::read(&frame), Some((record.clone(), frame.len())));
        assert_eq!(Record::read(&[frame.clone(), vec![1, 2, 3]].concat()), Some((record, frame.len())));
        for cut in 0..frame.len() {
            assert_eq!(Record::read(&frame[..cut]), None, "{cut}");
        }
        for at in 0..frame.len() {
            let mut damaged = frame.clone();
            damaged[at] ^= 4;
            assert_eq!(Record::read(&damaged), None, "{at}");
        }
    }

    /// A frame of somebody who knows the hash: each count in it claims all that a number can say.
    #[test]
    fn a_frame_with_hostile_lengths_is_none() {
        let record =
            Record { number: 1, outcome: Outcome::failed(Diagnostic::new("x")), track: Track::default() };
        let frame = record.frame();
        for at in (0..frame.len() - TAIL).filter(|at| at + 8 <= frame.len() - TAIL) {
            for length in [u64::MAX, i64::MAX as u64, 1 << 40] {
                let mut hostile = frame[..frame.len() - TAIL].to_vec();
                hostile[at..at + 8].copy_from_slice(&length.to_le_bytes());
                hostile.extend(fnv1a(&hostile).to_le_bytes());
                // Some of these are other numbers of the record.
                let _ = Record::read(&hostile);
            }
        }
        let mut hostile = frame[..HEAD + 8].to_vec();
        hostile.extend([0xff; 8]);
        hostile[..HEAD].copy_from_slice(&16_u64.to_le_bytes());
        hostile.extend(fnv1a(&hostile).to_le_bytes());
        assert_eq!(Record::read(&hostile), None);
    }
}
