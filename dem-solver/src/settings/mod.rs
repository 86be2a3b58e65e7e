//! The tables of a scene that belong to this solver: `[[rock]]`, `[[contact]]`, `[terrain]`, `[dem]`; or
//! `[[spheres]]`, `[box]`, `[[contact]]`, `[dem]`.
//!
//! Every struct here is what the user writes: names, units and defaults stand at its fields.

pub mod contact;
pub mod dem;
pub mod limits;
pub mod rock;
pub mod spheres;
pub mod terrain;

pub use contact::{ContactSettings, EffectiveMass, HierarchyName, LawName, RollingName, TangentialName};
pub use dem::{ContactSelection, DemSettings, Rotation};
pub use rock::{Cluster, RockSettings, Shape};
pub use spheres::{BoxSettings, SpheresSettings};
pub use terrain::{NoData, TerrainSettings, ZoneSettings};

use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::output::Output;
use interface_defs::toolkit::scene::Scene;
use nalgebra::Vector3;

/// All that this solver takes from a scene, checked, with defaults filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// `[[rock]]`, at least one.
    pub rocks: Vec<RockSettings>,
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
    /// What the user should know of the names in the scene.
    pub notices: Vec<String>,
}

impl Settings {
    /// Read and check them.
    pub fn of(scene: &Scene) -> Result<Self, InputError> {
        let mut rocks: Vec<RockSettings> = scene.read("rock")?.unwrap_or_default();
        if scene.has("spheres") {
            return Err(scene
                .invalid(
                    "spheres",
                    "[[spheres]] beside [[rock]]: there is no contact between separate spheres and rocks in this version",
                )
                .try_instead("keep one of the two"));
        }
        if scene.has("box") {
            return Err(unused(
                scene,
                "box",
                "only separate spheres touch its sides, and the scene has no [[spheres]]",
            ));
        }
        if rocks.is_empty() {
            return Err(scene
                .invalid("rock", "the scene has no rock")
                .try_instead("add a table [[rock]] with position, mass and shape"));
        }
        rock::complete(&mut rocks, scene)?;
        if scene.has("box") {
            return Err(scene
                .invalid("box", "[box] beside [[rock]]: in this version a box holds [[spheres]] only, rocks do not touch it")
                .try_instead("leave it out, or model its sides as [terrain] or [structure]"));
        }
        let mut contacts: Vec<ContactSettings> = scene.read("contact")?.unwrap_or_default();
        let mut dem: DemSettings = scene.read("dem")?.unwrap_or_default();
        let scale = dem.rename_scale(scene)?;
        dem.check(scene)?;
        if dem.threads.is_some() {
            return Err(scene
                .invalid("dem.threads", "`threads` beside [[rock]]: they share the work of [[spheres]] only")
                .try_instead("leave it out"));
        }
        let notes = [
            contact::rename_hierarchy(&mut contacts, &mut dem, scene)?,
            contact::rename_partner(&mut contacts, scene)?,
            scale,
        ];
        let terrain: Option<TerrainSettings> = scene.read("terrain")?;
        if let Some(terrain) = &terrain {
            terrain.check(scene)?;
        }
        contact::check_all(&contacts, &materials(&rocks, terrain.as_ref()), scene)?;
        let output = Output::of(scene)?;
        Ok(Self {
            rocks,
            contacts,
            terrain,
            dem,
            gravity: scene.gravity()?.into(),
            end_time: scene.end_time()?,
            interval: output.interval,
            fields: output.fields,
            notices: notes.into_iter().flatten().collect(),
        })
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
    pub walls: Option<BoxSettings>,
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
    /// What the user should know of the names in the scene.
    pub notices: Vec<String>,
}

impl GranularSettings {
    /// Read and check them.
    pub fn of(scene: &Scene) -> Result<Self, InputError> {
        if scene.has("rock") || scene.has("structure") {
            let key = if scene.has("rock") { "rock" } else { "structure" };
            return Err(scene
                .invalid(
                    key,
                    format!("[[spheres]] beside `{key}`: separate spheres have contact with each other and a [box] only"),
                )
                .try_instead("keep one of the two"));
        }
        refuse_of_rocks(scene)?;
        let walls: Option<BoxSettings> = scene.read("box")?;
        if let Some(walls) = &walls {
            walls.check(scene)?;
        }
        let mut groups: Vec<SpheresSettings> = scene.read("spheres")?.unwrap_or_default();
        spheres::complete(&mut groups, walls.as_ref(), scene)?;
        let mut contacts: Vec<ContactSettings> = scene.read("contact")?.unwrap_or_default();
        let mut notices: Vec<String> = contact::rename_partner(&mut contacts, scene)?.into_iter().collect();
        let mut known: Vec<String> = groups.iter().map(|g| g.material.clone()).collect();
        known.extend(walls.iter().map(|w| w.material.clone()));
        contact::check_all(&contacts, &known, scene)?;
        if contacts.is_empty() {
            return Err(scene
                .invalid("spheres", "there are spheres and no contact law")
                .try_instead("add a table [[contact]]"));
        }
        let mut dem: DemSettings = scene.read("dem")?.unwrap_or_default();
        notices.extend(dem.rename_scale(scene)?);
        dem.check(scene)?;
        crate::gate::gravity::check(scene.gravity()?.into(), false, scene)?;
        Ok(Self {
            spheres: groups,
            walls,
            contacts,
            dem,
            gravity: scene.gravity()?.into(),
            end_time: scene.end_time()?,
            fields: Output::of(scene)?.fields,
            notices,
        })
    }
}

/// A table that nothing will use.
fn unused(scene: &Scene, key: &str, why: &str) -> InputError {
    scene.invalid(key, format!("nothing will use [{key}]: {why}")).try_instead(format!("leave [{key}] out"))
}

/// Keys of `[[contact]]` that rocks alone have.
pub const OF_ROCKS_IN_CONTACT: [&str; 2] = ["effective_mass", "hierarchy"];

/// Keys of `[dem]` that rocks alone have.
pub const OF_ROCKS_IN_DEM: [&str; 2] = ["contact_selection", "rotation"];

/// Refuse beside `[[spheres]]` what rocks alone have.
fn refuse_of_rocks(scene: &Scene) -> Result<(), InputError> {
    if scene.has("terrain") {
        return Err(scene
            .invalid("terrain", "[terrain] beside [[spheres]]: in this version separate spheres touch each other and a [box] only")
            .try_instead("leave it out, or use [[rock]]"));
    }
    let contacts: Vec<toml::Table> = scene.read("contact")?.unwrap_or_default();
    let dem: toml::Table = scene.read("dem")?.unwrap_or_default();
    let of_rocks = |table: &toml::Table| table.get("law").and_then(|law| law.as_str()) == Some("hertz_rock");
    if let Some(number) = contacts.iter().position(of_rocks) {
        return Err(scene
            .invalid(&format!("contact.{number}.law"), "`hertz_rock` is a contact of rocks with terrain")
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
        "rotation" => "a sphere turns exactly by any scheme",
        _ => "a sphere touches each other sphere and each side of the [box] once",
    };
    Err(scene.invalid(&place, format!("`{key}` beside [[spheres]]: {why}")).try_instead("leave it out"))
}

/// Material of the structure's surface.
pub const STRUCTURE: &str = "structure";

/// Names of all materials of the scene, each once: those of the rocks, the structure's, the terrain's.
fn materials(rocks: &[RockSettings], terrain: Option<&TerrainSettings>) -> Vec<String> {
    let of_rocks = rocks.iter().map(|r| r.material.as_str());
    let of_terrain = terrain.into_iter().flat_map(|t| {
        [t.material.as_str()].into_iter().chain(t.zone.iter().map(|zone| zone.material.as_str()))
    });
    let mut names: Vec<String> = Vec::new();
    for name in of_rocks.chain([STRUCTURE]).chain(of_terrain) {
        if !names.iter().any(|n| n == name) {
            names.push(name.into());
        }
    }
    names
}
