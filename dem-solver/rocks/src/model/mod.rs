//! What a run computes with: the prepared scene, and the state of its rocks at one instant.
//!
//! - [`between`]: which contact law is between what
//! - [`critical`]: the largest stable step
//! - [`state`]: what a window starts from and ends with
//! - [`impact`], [`runout`]: what a state holds of a rock's impact on the net, and of its trajectory over terrain

pub mod between;
pub mod critical;
pub mod impact;
pub mod runout;
pub mod state;

use between::Between;
use dem_contact::contact::broad_phase::cell_grid::Plane;
use dem_contact::contact::whole_rock::Whole;
use dem_contact::law::Law;
use dem_contact::law::table::Laws;
use dem_contact::rock::{Motion, Rock};
use dem_contact::settings::Settings;
use dem_solid::geometry::sphere_tree::SphereTree;
use dem_terrain::Terrain;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Counts of work done since the start, repeated windows included.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Own steps, times rocks.
    pub sub_steps: u64,
    /// Windows in which nothing was in reach, solved in closed form.
    pub flight_windows: u64,
    /// Steps flown in closed form.
    pub flight_steps: u64,
    /// Evaluations of a contact.
    pub contact_evaluations: u64,
}

/// What does not change in a run.
pub struct Model {
    /// What the scene says.
    pub settings: Settings,
    /// The rocks.
    pub rocks: Vec<Rock>,
    /// A tree over the spheres of each.
    pub trees: Vec<SphereTree>,
    /// The terrain; those who compute on one terrain at the same time share it.
    pub ground: Option<Arc<Terrain>>,
    /// What is added to the positions of a state to give the user's [m]; zero without terrain.
    pub origin: Vector3<f64>,
    /// The laws of contact; `None`: nothing is touched.
    pub laws: Option<Laws>,
    /// For each rock the number of its law with the structure.
    pub rows: Vec<Vec<u16>>,
    /// For each rock the numbers of its laws with the materials of the terrain.
    pub ground_rows: Vec<Vec<u16>>,
    /// For each rock with such a law there what its contact with the terrain as a whole needs.
    pub wholes: Vec<Option<Whole>>,
    /// The same for the sides of its box, of rocks of more than one sphere.
    pub side_wholes: Vec<Option<Whole>>,
    /// The same for other rocks; empty where no two touch as wholes.
    pub pair_wholes: Vec<Option<Whole>>,
    /// Which law is between two rocks; `None`: they do not touch each other.
    pub between: Option<Between>,
    /// The sides of the box.
    pub planes: Vec<Plane>,
    /// For each rock the number of its law with them; empty without a box.
    pub side_rows: Vec<Vec<u16>>,
    /// The step.
    pub steps: Steps,
    /// True if savings may be used.
    pub shortcuts: bool,
}

impl Model {
    /// Of rocks that touch nothing yet; positions of a state count from `origin` [m].
    pub fn new(settings: Settings, rocks: Vec<Rock>, trees: Vec<SphereTree>, origin: Vector3<f64>) -> Self {
        Self {
            laws: Laws::new(&settings.contacts),
            wholes: vec![None; rocks.len()],
            side_wholes: vec![None; rocks.len()],
            pair_wholes: Vec::new(),
            settings,
            rocks,
            trees,
            ground: None,
            origin,
            rows: Vec::new(),
            ground_rows: Vec::new(),
            between: None,
            planes: Vec::new(),
            side_rows: Vec::new(),
            steps: Steps::default(),
            shortcuts: false,
        }
    }

    /// The laws of contact with all but other rocks.
    pub fn surfaces(&self) -> &[Law] {
        self.laws.as_ref().map_or(&[], |laws| &laws.surfaces)
    }

    /// True if the terrain gives way below rock number `rock`.
    pub fn gives_way(&self, rock: usize) -> bool {
        let row = self.ground_rows.get(rock).into_iter().flatten();
        row.into_iter().any(|law| self.surfaces()[*law as usize].yielding.is_some())
    }

    /// Motion of rock number `rock` at the start, its position counted from the origin.
    pub fn start(&self, rock: usize) -> Motion {
        let motion = self.rocks[rock].start(&self.settings.rocks[rock], self.settings.gravity);
        Motion { position: motion.position - self.origin, ..motion }
    }
}

/// What limits and what sets the step ([`critical`]).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Steps {
    /// The step that is taken [s].
    pub step: f64,
    /// Largest stable step [s]; infinite without contact.
    pub critical: f64,
    /// Duration of the shortest contact [s]; infinite without contact.
    pub contact: f64,
    /// Stiffness of one contact in a flat landing [N/m]; 0 without contact.
    pub stiffness: f64,
    /// Speed of the landing that is assumed [m/s].
    pub speed: f64,
    /// Longest step that resolves the contact, the rocks' turning and their travel, whatever the scene names [s].
    pub longest: f64,
}

/// A step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// When it begins [s].
    pub start: f64,
    /// Its length [s].
    pub h: f64,
}

impl Span {
    /// Its middle [s].
    pub fn middle(&self) -> f64 {
        self.start + 0.5 * self.h
    }
}

/// Name of a rock.
pub fn name_of(model: &Model, rock: usize) -> &str {
    &model.rocks[rock].name
}

/// Where `is_below` ends between `low` and `high`, from above, after so many halvings.
pub fn halved(mut low: f64, mut high: f64, halvings: usize, is_below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if is_below(middle) { low = middle } else { high = middle }
    }
    high
}
