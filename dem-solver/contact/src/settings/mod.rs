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
use dem_terrain::settings::{rest_speed, rest_time};
pub use rock::{Cluster, RockSettings, Shape};
pub use spheres::{BoxSettings, SpheresSettings};

use crate::keys::Checked;
use crate::law::normal::LawName;
use crate::law::settings::check_all;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use toolkit::once::each_once;
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
            let cure = "add a table [[rock]] with position, mass and shape";
            return scene.refuse("rock", "the scene has no rock", cure);
        }
        rock::complete(&mut rocks, scene)?;
        let common = Self::without_rocks(scene)?;
        let group = placement::as_rocks(&common.spheres, &mut rocks, scene)?;
        let mut terrain = TerrainSettings::of(scene)?;
        let notices = terrain.as_mut().map_or(Ok(Vec::new()), |terrain| terrain.plant(scene))?;
        let it = Self { rocks, group, terrain, notices, ..common };
        check_all(&it.contacts, &it.materials(), scene)?;
        Ok(it)
    }

    /// Of separate spheres without rocks: read and check them.
    pub fn of_spheres(scene: &Scene) -> Result<Self, Diagnostic> {
        refuse_of_rocks(scene)?;
        let it = Self::without_rocks(scene)?;
        let materials = it.spheres.iter().map(|g| &g.material).chain(it.sides.iter().map(|b| &b.material));
        check_all(&it.contacts, &materials.cloned().collect::<Vec<_>>(), scene)?;
        if it.contacts.is_empty() {
            let what = "there are spheres and no contact law";
            return scene.refuse("spheres", what, "add a table [[contact]]");
        }
        Ok(it)
    }

    /// All but rocks and terrain, with the laws unchecked.
    fn without_rocks(scene: &Scene) -> Result<Self, Diagnostic> {
        let sides: Option<BoxSettings> = scene.read("box")?;
        if let Some(sides) = &sides {
            sides.check(scene)?;
        }
        let mut spheres: Vec<SpheresSettings> = scene.read("spheres")?.unwrap_or_default();
        spheres::complete(&mut spheres, sides.as_ref(), scene)?;
        let dem: DemSettings = scene.read("dem")?.unwrap_or_default();
        dem.check(scene)?;
        let output = Output::of(scene)?;
        Ok(Self {
            rocks: Vec::new(),
            spheres,
            group: Vec::new(),
            sides,
            contacts: ContactSettings::read(scene)?,
            terrain: None,
            dem,
            gravity: scene.gravity()?.into(),
            end_time: scene.end_time()?,
            interval: output.interval,
            fields: output.fields,
            notices: Vec::new(),
        })
    }

    /// Names of all materials that a law may name, each once.
    fn materials(&self) -> Vec<String> {
        let of_terrain = self.terrain.iter().flat_map(|terrain| {
            [&*terrain.material].into_iter().chain(terrain.zone.iter().map(|zone| &*zone.material))
        });
        let of_rocks = self.rocks.iter().map(|rock| &*rock.material);
        let of_box = self.sides.iter().map(|sides| &*sides.material);
        let names = each_once(of_rocks.chain([STRUCTURE]).chain(of_terrain).chain(of_box));
        names.into_iter().map(str::to_owned).collect()
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

    /// Speed [m/s] below which a rock is at rest once it has stayed there for a time [s].
    pub fn rest(&self) -> (f64, f64) {
        let terrain = self.terrain.as_ref();
        terrain.map_or_else(|| (rest_speed(), rest_time()), |terrain| (terrain.rest_speed, terrain.rest_time))
    }

    /// Direction of gravity; without gravity: -z.
    pub fn down(&self) -> Vector3<f64> {
        self.gravity.try_normalize(0.0).unwrap_or(-Vector3::z())
    }
}

/// Keys of `[[contact]]` that separate spheres do not have, and why.
pub const OF_ROCKS_IN_CONTACT: [(&str, &str); 4] = [
    ("effective_mass", "each contact of two spheres has their reduced mass, one with the [box] the sphere's"),
    ("friction_max", "it is of contacts with terrain"),
    ("scarring_drag", "it is of contacts with terrain"),
    ("rolling_friction_impact", "it is of contacts with terrain"),
];

/// The same of `[dem]`.
pub const OF_ROCKS_IN_DEM: [(&str, &str); 2] = [
    ("contact_selection", "a sphere touches each other sphere and each side of the [box] once"),
    ("rotation", "a sphere turns exactly"),
];

/// Refuse what rocks alone have.
fn refuse_of_rocks(scene: &Scene) -> Checked {
    let contacts: Vec<toml::Table> = scene.read("contact")?.unwrap_or_default();
    let dem: toml::Table = scene.read("dem")?.unwrap_or_default();
    let of = |(number, table)| (format!("contact.{number}"), table, &OF_ROCKS_IN_CONTACT[..]);
    let mut tables: Vec<_> = contacts.into_iter().enumerate().map(of).collect();
    tables.push(("dem".into(), dem, &OF_ROCKS_IN_DEM));
    for (place, table, _) in &tables {
        let name = table.get("law").and_then(|law| law.as_str()).unwrap_or_default();
        if LawName::ALL.iter().any(|law| law.name() == name && law.kind().whole) {
            let what = format!("`{name}` is a contact of rocks with terrain");
            let cure = "separate spheres take hertz_mindlin: each is a rock of its own";
            return scene.refuse(&format!("{place}.law"), what, cure);
        }
    }
    for (place, table, keys) in tables {
        if let Some((key, why)) = keys.iter().find(|(key, _)| table.contains_key(*key)) {
            let what = format!("`{key}` beside [[spheres]]: {why}");
            return scene.refuse(&format!("{place}.{key}"), what, "leave it out");
        }
    }
    Ok(())
}

/// Material of the structure's surface.
pub const STRUCTURE: &str = "structure";
