//! What a window starts from and ends with, all at one instant.

use crate::contact::history::Memory;
use crate::contact::rocks::Held;
use crate::model::impact::ImpactRecord;
use crate::model::runout::RunOut;
use crate::rock::{Motion, Rock};
use crate::settings::Settings;
use nalgebra::Vector3;

/// State of all rocks at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Time [s].
    pub time: f64,
    /// The rocks.
    pub bodies: Vec<Body>,
    /// What they have with each other.
    pub encounters: Encounters,
    /// Energy dissipated since t = 0 by dashpots and friction [J].
    pub dissipated: f64,
    /// Work received through the wall since t = 0 [J].
    pub received: f64,
    /// Number of broken lines of the wall.
    pub broken: usize,
    /// Displacement of all nodes at this instant, as the window that ends here predicted it [m]; empty where no contact
    /// remembers its slip.
    pub predicted: Vec<f64>,
}

/// State of one rock.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Motion.
    pub motion: Motion,
    /// What its contacts remember, by sphere; empty without friction.
    pub memories: Vec<Memory>,
    /// What its contacts with the terrain remember, likewise.
    pub ground_memories: Vec<Memory>,
    /// With the sides of the box, likewise.
    pub side_memories: Vec<Memory>,
    /// Energy of their tangential springs [J].
    pub sheared: f64,
    /// Energy of the normal springs [J].
    pub elastic: f64,
    /// Number of contacts with wall and terrain.
    pub contacts: usize,
    /// Number of contacts with other rocks.
    pub met: usize,
    /// What the measures are made of.
    pub track: ImpactRecord,
    /// What is known of its trajectory over terrain.
    pub path: RunOut,
    /// How deep its spheres were pressed in.
    pub deepest: Depths,
}

/// What a rock's spheres are pressed into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// The structure.
    Net,
    /// The terrain.
    Terrain,
    /// Another rock.
    Rocks,
    /// The sides of the box.
    Sides,
}

impl Against {
    /// All of them.
    const ALL: [Self; 4] = [Self::Net, Self::Terrain, Self::Rocks, Self::Sides];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Net => "the net",
            Self::Terrain => "the terrain",
            Self::Rocks => "another rock",
            Self::Sides => "the box",
        }
    }
}

/// Largest overlap of a rock with each kind of partner, over the radius of the sphere (of two spheres the smaller), and
/// when [1, s]; 0 while nothing was touched.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Depths([(f64, f64); 4]);

impl Depths {
    /// Take in the largest overlap at `time` [s].
    pub fn take(&mut self, against: Against, overlap: f64, time: f64) {
        let deepest = &mut self.0[against as usize];
        if overlap > deepest.0 {
            *deepest = (overlap, time);
        }
    }

    /// The largest with one kind of partner.
    pub fn of(&self, against: Against) -> (f64, f64) {
        self.0[against as usize]
    }

    /// All that have been touched.
    pub fn each(&self) -> impl Iterator<Item = (Against, f64, f64)> + '_ {
        let all = Against::ALL.into_iter().zip(&self.0);
        all.filter(|(_, (overlap, _))| *overlap > 0.0)
            .map(|(against, (overlap, time))| (against, *overlap, *time))
    }

    /// The largest of all.
    pub fn largest(&self) -> Option<(f64, f64)> {
        self.each().map(|(_, overlap, time)| (overlap, time)).reduce(|a, b| if b.0 > a.0 { b } else { a })
    }
}

/// Contacts of rocks with each other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Encounters {
    /// What they remember, by pair of rocks, then of spheres; empty without friction.
    pub memories: Vec<Held>,
    /// Energy of their tangential springs [J].
    pub sheared: f64,
    /// Energy of their normal springs [J].
    pub elastic: f64,
    /// Their number.
    pub contacts: usize,
}

impl Encounters {
    /// Nothing touches any more.
    pub fn end(&mut self) {
        self.memories.clear();
        (self.sheared, self.elastic, self.contacts) = (0.0, 0.0, 0);
    }

    /// Room for the memories of `contacts` contacts.
    pub fn reserve(&mut self, contacts: usize) {
        self.memories.reserve(contacts.saturating_sub(self.memories.len()));
    }
}

impl State {
    /// At t = 0; positions count from `origin` [m].
    pub fn start(settings: &Settings, rocks: &[Rock], origin: &Vector3<f64>) -> Self {
        let at = |rock: &Rock, table| {
            let motion = rock.start(table, settings.gravity);
            Motion { position: motion.position - origin, ..motion }
        };
        let body = |(rock, table): (&Rock, _)| Body {
            motion: at(rock, table),
            memories: Vec::new(),
            ground_memories: Vec::new(),
            side_memories: Vec::new(),
            sheared: 0.0,
            elastic: 0.0,
            contacts: 0,
            met: 0,
            track: ImpactRecord::default(),
            path: RunOut::default(),
            deepest: Depths::default(),
        };
        Self {
            time: 0.0,
            bodies: rocks.iter().zip(&settings.rocks).map(body).collect(),
            encounters: Encounters::default(),
            dissipated: 0.0,
            received: 0.0,
            broken: 0,
            predicted: Vec::new(),
        }
    }

    /// Become `other`, without allocating while its memories fit.
    pub fn copy(&mut self, other: &Self) {
        (self.time, self.dissipated, self.received) = (other.time, other.dissipated, other.received);
        self.broken = other.broken;
        self.predicted.clone_from(&other.predicted);
        for (mine, theirs) in self.bodies.iter_mut().zip(&other.bodies) {
            mine.motion = theirs.motion;
            mine.memories.clone_from(&theirs.memories);
            mine.ground_memories.clone_from(&theirs.ground_memories);
            mine.side_memories.clone_from(&theirs.side_memories);
            (mine.sheared, mine.elastic) = (theirs.sheared, theirs.elastic);
            (mine.contacts, mine.met) = (theirs.contacts, theirs.met);
            (mine.track, mine.path, mine.deepest) = (theirs.track, theirs.path, theirs.deepest);
        }
        let (mine, theirs) = (&mut self.encounters, &other.encounters);
        mine.memories.clone_from(&theirs.memories);
        (mine.sheared, mine.elastic) = (theirs.sheared, theirs.elastic);
        mine.contacts = theirs.contacts;
    }
}

impl Body {
    /// Nothing touches net, terrain and box any more.
    pub fn part(&mut self) {
        self.memories.clear();
        self.ground_memories.clear();
        self.side_memories.clear();
        (self.sheared, self.elastic, self.contacts, self.met) = (0.0, 0.0, 0, 0);
    }

    /// Room for the memories of so many contacts with the net or with terrain, and with the sides of a box.
    pub fn reserve(&mut self, contacts: usize, sides: usize) {
        self.memories.reserve(contacts.saturating_sub(self.memories.len()));
        self.ground_memories.reserve(contacts.saturating_sub(self.ground_memories.len()));
        self.side_memories.reserve(sides.saturating_sub(self.side_memories.len()));
    }
}
