//! What is kept of a member: one frame of a journal. Numbers are little-endian; each frame ends with a hash of itself.

use super::base::Base;
use super::track::{Crossing, Track, Visit};
use dem_rocks::model::Model;
use interface_defs::ipc::run_id::fnv1a;
use interface_defs::toolkit::scene::Scene;
use interface_defs::toolkit::summary::RunStatus;

/// Version of a journal record; raise it when [`Outcome`] or [`Track`] changes.
const VERSION: u32 = 2;

/// A hash of all that the results depend on: study, scene, terrain, spheres, program.
pub fn fingerprint(base: &Base, file: &Scene) -> String {
    let mut bytes = format!("{} {} {} ", env!("CARGO_PKG_VERSION"), VERSION, base.shortcuts).into_bytes();
    bytes.extend(format!("{} {} ", file.fingerprint(), base.scene.fingerprint()).into_bytes());
    let mut take = |n: f64| bytes.extend(n.to_bits().to_le_bytes());
    base.ground.origin.iter().for_each(|n| take(*n));
    base.ground.nodes.iter().flat_map(|p| [p.x, p.y, p.z]).for_each(&mut take);
    // They may be in files.
    let releases = base.study.releases.iter().map(|release| release.place().corners());
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
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

/// What became of a member. Lengths in m, times in s, energies in J.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Whether it is to be trusted.
    pub status: RunStatus,
    /// Why not.
    pub message: String,
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
    /// When.
    pub time: f64,
    /// How far that is from the start, seen from above.
    pub run_out: f64,
    /// Largest speed of the centre of mass.
    pub speed: f64,
    /// Largest kinetic energy.
    pub energy: f64,
    /// Largest jump height.
    pub jump: f64,
    /// Impacts.
    pub impacts: u64,
    /// Share of the time in contact.
    pub contact: f64,
    /// Deepest overlap over the radius.
    pub penetration: f64,
    /// Largest imbalance of energy over that of the largest impact.
    pub energy_error: f64,
}

impl Outcome {
    fn empty(status: RunStatus, message: String) -> Self {
        Self {
            status,
            message,
            how: How::None,
            start: [0.0; 3],
            velocity: [0.0; 3],
            orientation: [0.0; 4],
            spin: [0.0; 3],
            volume: 0.0,
            mass: 0.0,
            end: [0.0; 3],
            end_velocity: [0.0; 3],
            time: 0.0,
            run_out: 0.0,
            speed: 0.0,
            energy: 0.0,
            jump: 0.0,
            impacts: 0,
            contact: 0.0,
            penetration: 0.0,
            energy_error: 0.0,
        }
    }

    /// Of a member that could not start.
    pub fn failed(message: String) -> Self {
        Self::empty(RunStatus::Failed, message)
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
            ..Self::empty(RunStatus::Done, String::new())
        }
    }

    /// It could not be computed to its end.
    pub fn fail(&mut self, message: String) {
        (self.status, self.message) = (RunStatus::Failed, message);
    }

    fn numbers(&self) -> Vec<f64> {
        let mut all = Vec::with_capacity(28);
        all.extend(self.start);
        all.extend(self.velocity);
        all.extend(self.orientation);
        all.extend(self.spin);
        all.extend([self.volume, self.mass]);
        all.extend(self.end);
        all.extend(self.end_velocity);
        all.extend([self.time, self.run_out, self.speed, self.energy, self.jump, self.impacts as f64]);
        all.extend([self.contact, self.penetration, self.energy_error]);
        all
    }

    fn from_numbers(status: RunStatus, message: String, how: How, numbers: &[f64]) -> Option<Self> {
        let mut rest = numbers.iter().copied();
        let mut next = || rest.next();
        let mut it = Self { how, ..Self::empty(status, message) };
        for slot in it.start.iter_mut().chain(&mut it.velocity).chain(&mut it.orientation).chain(&mut it.spin)
        {
            *slot = next()?;
        }
        (it.volume, it.mass) = (next()?, next()?);
        for slot in it.end.iter_mut().chain(&mut it.end_velocity) {
            *slot = next()?;
        }
        (it.time, it.run_out, it.speed, it.energy) = (next()?, next()?, next()?, next()?);
        (it.jump, it.impacts) = (next()?, next()? as u64);
        (it.contact, it.penetration, it.energy_error) = (next()?, next()?, next()?);
        Some(it)
    }
}

/// A member with what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Its number, from 1.
    pub number: u64,
    /// What became of it.
    pub outcome: Outcome,
    /// What is kept of its trajectory.
    pub track: Track,
}

/// Reads numbers from bytes, until they end.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        let count = usize::try_from(self.u64()?).ok()?;
        let bytes = self.take(count.checked_mul(8)?)?;
        Some(bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight"))).collect())
    }
}

impl Bytes<'_> {
    fn single(&mut self) -> Option<f32> {
        Some(f32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    fn four(&mut self) -> Option<[f32; 4]> {
        Some([self.single()?, self.single()?, self.single()?, self.single()?])
    }
}

fn track_of(rest: &mut Bytes) -> Option<Track> {
    let mut track = Track::default();
    for _ in 0..rest.u64()? {
        let cell = u32::from_le_bytes(rest.take(4)?.try_into().ok()?);
        track.visits.push(Visit { cell, values: rest.four()? });
    }
    for _ in 0..rest.u64()? {
        let line = u16::from_le_bytes(rest.take(2)?.try_into().ok()?);
        let mut values = [0.0; 13];
        for value in &mut values {
            *value = f64::from_bits(rest.u64()?);
        }
        track.crossings.push(Crossing { line, values });
    }
    for _ in 0..rest.u64()? {
        track.path.push(rest.four()?);
    }
    Some(track)
}

/// Bytes of a frame before its content, and after it.
const HEAD: usize = 8;
const TAIL: usize = 8;

impl Record {
    /// The frame: its length, its content, a hash of both.
    pub fn frame(&self) -> Vec<u8> {
        let mut bytes = vec![0; HEAD];
        bytes.extend(self.number.to_le_bytes());
        bytes.push(match self.outcome.status {
            RunStatus::Done => 0,
            RunStatus::Unreliable => 1,
            RunStatus::Failed | RunStatus::Interrupted => 2,
        });
        bytes.push(self.outcome.how as u8);
        bytes.extend((self.outcome.message.len() as u64).to_le_bytes());
        bytes.extend(self.outcome.message.as_bytes());
        let numbers = self.outcome.numbers();
        bytes.extend((numbers.len() as u64).to_le_bytes());
        bytes.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        self.track_bytes(&mut bytes);
        let length = (bytes.len() - HEAD) as u64;
        bytes[..HEAD].copy_from_slice(&length.to_le_bytes());
        let hash = fnv1a(&bytes);
        bytes.extend(hash.to_le_bytes());
        bytes
    }

    /// The record at the start of `bytes`, and the length of its frame; `None` where they do not begin with a whole one.
    pub fn read(bytes: &[u8]) -> Option<(Self, usize)> {
        let length = usize::try_from(Bytes(bytes).u64()?).ok()?;
        let whole = length.checked_add(HEAD + TAIL)?;
        let frame = bytes.get(..whole)?;
        let (content, hash) = frame.split_at(whole - TAIL);
        if fnv1a(content) != Bytes(hash).u64()? {
            return None;
        }
        let mut rest = Bytes(&content[HEAD..]);
        let number = rest.u64()?;
        let [status, how] = *rest.take(2)? else { return None };
        let status =
            [RunStatus::Done, RunStatus::Unreliable, RunStatus::Failed].get(usize::from(status)).copied()?;
        let how = [How::None, How::Rest, How::Out, How::Moving].get(usize::from(how)).copied()?;
        let words = usize::try_from(rest.u64()?).ok()?;
        let message = String::from_utf8(rest.take(words)?.to_vec()).ok()?;
        let outcome = Outcome::from_numbers(status, message, how, &rest.numbers()?)?;
        let track = track_of(&mut rest)?;
        Some((Self { number, outcome, track }, whole))
    }

    fn track_bytes(&self, bytes: &mut Vec<u8>) {
        let Track { visits, crossings, path } = &self.track;
        bytes.extend((visits.len() as u64).to_le_bytes());
        for visit in visits {
            bytes.extend(visit.cell.to_le_bytes());
            bytes.extend(visit.values.iter().flat_map(|v| v.to_le_bytes()));
        }
        bytes.extend((crossings.len() as u64).to_le_bytes());
        for crossing in crossings {
            bytes.extend(crossing.line.to_le_bytes());
            bytes.extend(crossing.values.iter().flat_map(|v| v.to_le_bytes()));
        }
        bytes.extend((path.len() as u64).to_le_bytes());
        bytes.extend(path.iter().flatten().flat_map(|v| v.to_le_bytes()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_read_as_it_was_written_and_half_of_one_is_none() {
        let mut outcome = Outcome::failed("why, \"so\"".into());
        outcome.how = How::Moving;
        let numbers: Vec<f64> = (0..outcome.numbers().len()).map(|k| k as f64 + 0.5).collect();
        outcome = Outcome::from_numbers(outcome.status, outcome.message, outcome.how, &numbers)
            .expect("all of them");
        outcome.impacts = 7;
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
}
