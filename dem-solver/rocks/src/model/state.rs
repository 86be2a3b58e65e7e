//! What a window starts from and ends with, all at one instant.

use crate::model::Model;
use crate::model::impact::ImpactRecord;
use crate::model::runout::RunOut;
use dem_contact::contact::history::SurfaceHistory;
use dem_contact::contact::rocks::RockHistory;
use dem_contact::law::growing::Slip;
use dem_contact::law::resistance::RollingState;
use dem_contact::law::yielding::PlasticIndentation;
use dem_contact::rock::{Flight, Motion};
use serde::{Deserialize, Serialize};

/// State of all rocks at one instant.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Time [s].
    pub time: f64,
    /// The rocks.
    pub bodies: Vec<Body>,
    /// What they have with each other.
    pub between_rocks: BetweenRocks,
    /// Energy dissipated since t = 0 by dashpots and friction [J].
    pub dissipated: f64,
    /// Work received through the mesh since t = 0 [J].
    pub received: f64,
    /// Number of broken lines of the mesh.
    pub broken: usize,
    /// Displacement of the nodes that are sent at this instant, as the window that ends here predicted it [m]; empty where no
    /// contact remembers its slip.
    pub predicted: Vec<f64>,
    /// Acceleration of the selected nodes by contact forces at this instant [m/s2], where the net is advanced here; empty without
    /// contact.
    pub pushed: Vec<f64>,
    /// How many times finer than the scene says the steps are, because a contact on the net's own masses asks for it.
    pub finer: usize,
}

/// State of one rock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Motion.
    pub motion: Motion,
    /// The flight under way, if nothing acted on it in the last step.
    pub flight: Option<Flight>,
    /// What its contacts remember, by sphere; empty without friction.
    pub histories: Vec<SurfaceHistory>,
    /// What its contacts with the terrain remember, likewise.
    pub terrain_histories: Vec<SurfaceHistory>,
    /// What ground that gives way remembers of it.
    pub dent: PlasticIndentation,
    /// Distance slid, for friction that grows with it.
    pub slip: Slip,
    /// What it takes from step to step as its rolling is resisted.
    pub rolling: RollingState,
    /// With the sides of the box, likewise.
    pub box_histories: Vec<SurfaceHistory>,
    /// Energy of their tangential springs [J].
    pub tangential_energy: f64,
    /// Energy of the normal springs [J].
    pub elastic: f64,
    /// Number of contacts with mesh and terrain.
    pub contacts: usize,
    /// Number of contacts with other rocks.
    pub rock_contacts: usize,
    /// What the measures are made of.
    pub track: ImpactRecord,
    /// What is known of its trajectory over terrain.
    pub path: RunOut,
    /// Deepest overlaps of its spheres.
    pub deepest: Depths,
}

interface_defs::worded! {
    /// What a rock's spheres are pressed into.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Against with words {
        /// The structure.
        Net = "the net",
        /// The terrain.
        Terrain = "the terrain",
        /// Another rock.
        Rocks = "another rock",
        /// The sides of the box.
        Sides = "the box",
    }
}

impl Against {
    /// All of them.
    const ALL: [Self; 4] = [Self::Net, Self::Terrain, Self::Rocks, Self::Sides];
}

/// Largest overlap of a rock with each kind of partner, over the radius of the sphere (of two spheres the smaller), and
/// when [1, s]; 0 while nothing was touched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BetweenRocks {
    /// What they remember, by pair of rocks, then of spheres; empty without friction.
    pub histories: Vec<RockHistory>,
    /// Energy of their tangential springs [J].
    pub tangential_energy: f64,
    /// Energy of their normal springs [J].
    pub elastic: f64,
    /// Their number.
    pub contacts: usize,
}

impl BetweenRocks {
    /// Nothing touches any more.
    pub fn end(&mut self) {
        self.histories.clear();
        (self.tangential_energy, self.elastic, self.contacts) = (0.0, 0.0, 0);
    }

    /// Room for the histories of `contacts` contacts.
    pub fn reserve(&mut self, contacts: usize) {
        self.histories.reserve(contacts.saturating_sub(self.histories.len()));
    }
}

impl Body {
    /// In motion, with nothing behind it.
    pub fn new(motion: Motion) -> Self {
        Self {
            motion,
            flight: None,
            histories: Vec::new(),
            terrain_histories: Vec::new(),
            dent: PlasticIndentation::default(),
            slip: Slip::default(),
            rolling: RollingState::default(),
            box_histories: Vec::new(),
            tangential_energy: 0.0,
            elastic: 0.0,
            contacts: 0,
            rock_contacts: 0,
            track: ImpactRecord::default(),
            path: RunOut::default(),
            deepest: Depths::default(),
        }
    }
}

impl State {
    /// At t = 0.
    pub fn start(model: &Model) -> Self {
        let bodies = (0..model.rocks.len()).map(|rock| Body::new(model.start(rock)));
        Self { bodies: bodies.collect(), finer: 1, ..Self::default() }
    }

    /// Remember these nodes from now on, whose places among those before `place` says; `room` is used again and again.
    pub fn select(
        &mut self,
        place: impl Fn(u32) -> Option<u32>,
        nodes: impl Iterator<Item = u32> + Clone,
        room: &mut Vec<f64>,
    ) {
        for (vector, unknown) in [(&mut self.predicted, f64::NAN), (&mut self.pushed, 0.0)] {
            if vector.is_empty() {
                continue;
            }
            room.clone_from(vector);
            vector.clear();
            for node in nodes.clone() {
                let known = place(node).and_then(|at| room.get(3 * at as usize..3 * at as usize + 3));
                vector.extend_from_slice(known.unwrap_or(&[unknown; 3]));
            }
        }
    }

    /// Become `other`, without allocating while its histories fit.
    pub fn copy(&mut self, other: &Self) {
        let mut bodies = std::mem::take(&mut self.bodies);
        for (mine, theirs) in bodies.iter_mut().zip(&other.bodies) {
            *mine = Body {
                histories: refilled(&mut mine.histories, &theirs.histories),
                terrain_histories: refilled(&mut mine.terrain_histories, &theirs.terrain_histories),
                box_histories: refilled(&mut mine.box_histories, &theirs.box_histories),
                ..*theirs
            };
        }
        let histories = refilled(&mut self.between_rocks.histories, &other.between_rocks.histories);
        *self = Self {
            bodies,
            between_rocks: BetweenRocks { histories, ..other.between_rocks },
            predicted: refilled(&mut self.predicted, &other.predicted),
            pushed: refilled(&mut self.pushed, &other.pushed),
            ..*other
        };
    }
}

/// What a list holds in the room of another.
pub(crate) fn refilled<T: Clone>(room: &mut Vec<T>, from: &Vec<T>) -> Vec<T> {
    room.clone_from(from);
    std::mem::take(room)
}

impl Body {
    /// Nothing touches net, terrain and box any more.
    pub fn part(&mut self) {
        self.histories.clear();
        self.terrain_histories.clear();
        self.box_histories.clear();
        self.dent = PlasticIndentation::default();
        (self.tangential_energy, self.elastic, self.contacts, self.rock_contacts) = (0.0, 0.0, 0, 0);
    }

    /// Room for the histories of so many contacts with the net or with terrain, and with the sides of a box.
    pub fn reserve(&mut self, contacts: usize, sides: usize) {
        self.histories.reserve(contacts.saturating_sub(self.histories.len()));
        self.terrain_histories.reserve(contacts.saturating_sub(self.terrain_histories.len()));
        self.box_histories.reserve(sides.saturating_sub(self.box_histories.len()));
    }
}
