//! The tables of a scene that belong to this solver: `[[rock]]`, `[[spheres]]`, `[[contact]]`, `[terrain]`, `[box]`, `[dem]`.
//!
//! Spheres without rocks, terrain and structure are computed by `granular`; beside them each is a rock of its own.
//!
//! Every struct here is what the user writes: names, units and defaults stand at its fields.

pub mod dem;
pub mod limits;
pub mod placement;
pub mod rock;
pub mod spheres;

pub use crate::law::settings::{ContactSettings, EffectiveMass, RollingName, TangentialName};
pub use dem::{ContactSelection, DemSettings, Rotation};
pub use dem_terrain::settings::{NoData, TerrainSettings, ZoneSettings};
pub use rock::{Cluster, RockSettings, Shape};
pub use spheres::{BoxSettings, SpheresSettings};

use crate::law::settings::check_all;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use toolkit::output::Output;
use toolkit::scene::Scene;

/// All that this solver takes from a scene, checked, with defaults filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// `[[rock]]`, and after them a rock for each sphere of `[[spheres]]`.
    pub rocks: Vec<RockSettings>,
    /// `[[spheres]]`.
    pub spheres: Vec<SpheresSettings>,
    /// For each rock that is a sphere of `[[spheres]]` the number of that table.
    pub group: Vec<u16>,
    /// `[box]`.
    pub sides: Option<BoxSettings>,
    /// `[[contact]]`, at most one for each pair of materials and one for all others.
    pub contacts: Vec<ContactSettings>,
    /// `[terrain]`.
    pub terrain: Option<TerrainSettings>,
    /// `[dem]`.
    pub dem: DemSettings,
    /// `gravity` [m/s2].
    pub gravity: Vector3<f64>,
    /// `end_time` [s].
    pub end_time: f64,
    /// `[output] interval` of the rows of a run alone [s].
    pub interval: f64,
    /// `[output] fields`: interval of the field files [s].
    pub fields: Option<f64>,
    /// What the user should know of it.
    pub notices: Vec<Diagnostic>,
}

impl Settings {
    /// Read and check them.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        let mut rocks: Vec<RockSettings> = scene.read("rock")?.unwrap_or_default();
        if rocks.is_empty() && !scene.has("spheres") {
            return Err(scene
                .invalid("rock", "the scene has no rock")
                .try_instead("add a table [[rock]] with position, mass and shape"));
        }
        rock::complete(&mut rocks, scene)?;
        let sides: Option<BoxSettings> = scene.read("box")?;
        if let Some(sides) = &sides {
            sides.check(scene)?;
        }
        let mut groups: Vec<SpheresSettings> = scene.read("spheres")?.unwrap_or_default();
        spheres::complete(&mut groups, sides.as_ref(), scene)?;
        let group = placement::as_rocks(&groups, &mut rocks, scene)?;
        let contacts: Vec<ContactSettings> = scene.read("contact")?.unwrap_or_default();
        let dem: DemSettings = scene.read("dem")?.unwrap_or_default();
        dem.check(scene)?;
        if dem.threads.is_some() {
            return Err(scene
                .invalid(
                    "dem.threads",
                    "`threads` beside [[rock]], [terrain] or [structure]: they share the work of [[spheres]] alone",
                )
                .try_instead("leave it out"));
        }
        let mut terrain = TerrainSettings::of(scene)?;
        let mut forests = Vec::new();
        if let Some(terrain) = &mut terrain {
            forests = terrain.plant(scene)?;
        }
        let known = materials(&rocks, terrain.as_ref(), sides.as_ref());
        check_all(&contacts, &known, scene)?;
        let output = Output::of(scene)?;
        Ok(Self {
            rocks,
            spheres: groups,
            group,
            sides,
            contacts,
            terrain,
            dem,
            gravity: scene.gravity()?.into(),
            end_time: scene.end_time()?,
            interval: output.interval,
            fields: output.fields,
            notices: forests,
        })
    }

    /// Number of rocks with a table `[[rock]]`; those that come after are spheres.
    pub fn named(&self) -> usize {
        self.rocks.len() - self.group.len()
    }

    /// The table of the scene that rock number `at` comes from: `rock.2`, `spheres.0`.
    pub fn table(&self, at: usize) -> String {
        match at.checked_sub(self.named()) {
            None => format!("rock.{at}"),
            Some(sphere) => format!("spheres.{}", self.group[sphere]),
        }
    }

    /// The key that says where rock number `at` starts.
    pub fn place_key(&self, at: usize) -> String {
        let table = self.table(at);
        match at.checked_sub(self.named()).map(|sphere| &self.spheres[usize::from(self.group[sphere])]) {
            None => format!("{table}.position"),
            Some(group) if group.file.is_some() => format!("{table}.file"),
            Some(_) => format!("{table}.lowest"),
        }
    }

    /// The rocks of `[[rock]]`, and of each table `[[spheres]]` the smallest and the largest one: what holds for these holds for
    /// all of the table.
    pub fn examples(&self) -> Vec<usize> {
        let named = self.named();
        let mut all: Vec<usize> = (0..named).collect();
        for number in 0..self.spheres.len() {
            let of = (0..self.group.len()).filter(|k| usize::from(self.group[*k]) == number);
            let radius = |k: &usize| match self.rocks[named + k].shape {
                Shape::Sphere { radius } => radius,
                _ => 0.0,
            };
            let smallest = of.clone().min_by(|a, b| radius(a).total_cmp(&radius(b)));
            let largest = of.max_by(|a, b| radius(a).total_cmp(&radius(b)));
            all.extend(smallest.map(|k| named + k));
            all.extend(largest.filter(|_| largest != smallest).map(|k| named + k));
        }
        all
    }

    /// Direction of gravity; without gravity: -z.
    pub fn down(&self) -> Vector3<f64> {
        self.gravity.try_normalize(0.0).unwrap_or(-Vector3::z())
    }
}

/// All that many separate spheres take from a scene, checked, with defaults filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct GranularSettings {
    /// `[[spheres]]`, at least one.
    pub spheres: Vec<SpheresSettings>,
    /// `[box]`.
    pub sides: Option<BoxSettings>,
    /// `[[contact]]`, at least one.
    pub contacts: Vec<ContactSettings>,
    /// `[dem]`.
    pub dem: DemSettings,
    /// `gravity` [m/s2].
    pub gravity: Vector3<f64>,
    /// `end_time` [s].
    pub end_time: f64,
    /// `[output] fields`: interval of the field files [s].
    pub fields: Option<f64>,
}

impl GranularSettings {
    /// Read and check them.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        refuse_of_rocks(scene)?;
        let sides: Option<BoxSettings> = scene.read("box")?;
        if let Some(sides) = &sides {
            sides.check(scene)?;
        }
        let mut groups: Vec<SpheresSettings> = scene.read("spheres")?.unwrap_or_default();
        spheres::complete(&mut groups, sides.as_ref(), scene)?;
        let contacts: Vec<ContactSettings> = scene.read("contact")?.unwrap_or_default();
        let mut known: Vec<String> = groups.iter().map(|g| g.material.clone()).collect();
        known.extend(sides.iter().map(|w| w.material.clone()));
        check_all(&contacts, &known, scene)?;
        if contacts.is_empty() {
            return Err(scene
                .invalid("spheres", "there are spheres and no contact law")
                .try_instead("add a table [[contact]]"));
        }
        let dem: DemSettings = scene.read("dem")?.unwrap_or_default();
        dem.check(scene)?;
        Ok(Self {
            spheres: groups,
            sides,
            contacts,
            dem,
            gravity: scene.gravity()?.into(),
            end_time: scene.end_time()?,
            fields: Output::of(scene)?.fields,
        })
    }
}

/// Keys of `[[contact]]` that rocks alone have.
pub const OF_ROCKS_IN_CONTACT: [&str; 3] = ["effective_mass", "friction_max", "scarring_drag"];

/// Keys of `[dem]` that rocks alone have.
pub const OF_ROCKS_IN_DEM: [&str; 2] = ["contact_selection", "rotation"];

/// Refuse beside `[[spheres]]` what rocks alone have.
fn refuse_of_rocks(scene: &Scene) -> Result<(), Diagnostic> {
    let contacts: Vec<toml::Table> = scene.read("contact")?.unwrap_or_default();
    let dem: toml::Table = scene.read("dem")?.unwrap_or_default();
    let of_rocks = |table: &toml::Table| {
        let name = table.get("law").and_then(|law| law.as_str());
        ["hertz_rock", "ground"].into_iter().find(|of_terrain| name == Some(of_terrain))
    };
    let first = contacts.iter().enumerate().find_map(|(number, table)| Some((number, of_rocks(table)?)));
    if let Some((number, name)) = first {
        return Err(scene
            .invalid(&format!("contact.{number}.law"), format!("`{name}` is a contact of rocks with terrain"))
            .try_instead("separate spheres take hertz_mindlin: each is a rock of its own"));
    }
    let of_contacts = contacts.iter().enumerate().flat_map(|(number, table)| {
        let keys = OF_ROCKS_IN_CONTACT.into_iter().filter(|key| table.contains_key(*key));
        keys.map(move |key| (format!("contact.{number}.{key}"), key))
    });
    let of_dem = OF_ROCKS_IN_DEM.into_iter().filter(|key| dem.contains_key(*key));
    let mut found = of_contacts.chain(of_dem.map(|key| (format!("dem.{key}"), key)));
    let Some((place, key)) = found.next() else { return Ok(()) };
    let why = match key {
        "effective_mass" => {
            "each contact of two spheres has their reduced mass, one with the [box] the sphere's"
        }
        "rotation" => "a sphere turns exactly",
        "friction_max" | "scarring_drag" => "it is of contacts with terrain",
        _ => "a sphere touches each other sphere and each side of the [box] once",
    };
    Err(scene.invalid(&place, format!("`{key}` beside [[spheres]]: {why}")).try_instead("leave it out"))
}

/// Material of the structure's surface.
pub const STRUCTURE: &str = "structure";

/// Names of all materials of the scene, each once: those of the rocks, the structure's, the terrain's, the box's.
fn materials(
    rocks: &[RockSettings],
    terrain: Option<&TerrainSettings>,
    sides: Option<&BoxSettings>,
) -> Vec<String> {
    let of_rocks = rocks.iter().map(|r| r.material.as_str());
    let of_terrain = terrain.into_iter().flat_map(|t| {
        [t.material.as_str()].into_iter().chain(t.zone.iter().map(|zone| zone.material.as_str()))
    });
    let mut names: Vec<String> = Vec::new();
    let of_box = sides.map(|sides| sides.material.as_str());
    for name in of_rocks.chain([STRUCTURE]).chain(of_terrain).chain(of_box) {
        if !names.iter().any(|n| n == name) {
            names.push(name.into());
        }
    }
    names
}
