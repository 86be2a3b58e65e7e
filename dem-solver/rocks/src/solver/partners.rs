//! What the rocks of a scene may touch beside the structure: its terrain, each other, the sides of its box.

use crate::integrator::rock_stage::{DEEPEST_AT_START, RockStage};
use crate::model::between::{rows, whole_rocks};
use crate::model::state::State;
use crate::model::{Model, name_of};
use dem_contact::contact::broad_phase::cell_grid::Plane;
use dem_contact::contact::whole_rock::Whole;
use dem_contact::law::table::Laws;
use dem_contact::rock::Rock;
use dem_contact::settings::{BoxSettings, Settings};
use dem_terrain::Terrain;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use toolkit::scene::Scene;

/// How the rocks of a scene touch its terrain.
pub(super) struct OnTerrain {
    /// For each rock the numbers of its laws with the terrain's materials.
    pub(super) rows: Vec<Vec<u16>>,
    /// For each rock its contact as a whole, if it has that.
    pub(super) wholes: Vec<Option<Whole>>,
    /// What was chosen, and why.
    pub(super) choices: Vec<String>,
}

impl OnTerrain {
    pub(super) fn new(
        settings: &Settings,
        laws: Option<&Laws>,
        rocks: &[Rock],
        ground: &mut Terrain,
        scene: &Scene,
    ) -> Result<Self, Diagnostic> {
        let Some(laws) = laws else {
            let what = "there is terrain and no contact law: the rocks would fall through it";
            return Err(scene.invalid("terrain", what).try_instead("add a table [[contact]]"));
        };
        let rows = rows(laws, settings, &ground.materials)
            .map_err(|(what, advice)| scene.invalid("terrain", what).try_instead(advice))?;
        let wholes = whole_rocks(laws, &rows, rocks, scene)?;
        let mut choices = Vec::new();
        if wholes.iter().any(Option::is_some) {
            let mixed = ground.face_up();
            ground.notices.extend(mixed);
        }
        if wholes.iter().any(Option::is_none) {
            let (continuous, why) = settings.dem.contact_selection.choose("terrain", || ground.unshared());
            ground.continuous = continuous;
            choices.push(why);
        }
        Ok(Self { rows, wholes, choices })
    }
}

/// Refuse rocks that are in each other at the start.
pub(super) fn are_apart(model: &Model, state: &mut State, scene: &Scene) -> Result<(), Diagnostic> {
    let worst = RockStage::new(model).energy(model, state);
    let Some(([a, b], radii)) = worst.filter(|(_, radii)| *radii > DEEPEST_AT_START) else { return Ok(()) };
    let what = format!(
        "rock `{}` and rock `{}` overlap at the start, by {radii:.2} radii of the smaller sphere",
        name_of(model, a),
        name_of(model, b)
    );
    Err(scene.invalid(&model.settings.place_key(b), what).try_instead("move them apart"))
}

/// The sides of the box of a scene, seen from `origin` [m].
pub(super) fn planes(settings: &Settings, origin: &Vector3<f64>) -> Vec<Plane> {
    let planes = settings.sides.iter().flat_map(BoxSettings::planes);
    planes.map(|plane| Plane { offset: plane.offset - plane.normal.dot(origin), ..plane }).collect()
}

/// For each rock the number of its law with the sides of the box; empty without one.
pub(super) fn rows_with_box(
    laws: Option<&Laws>,
    settings: &Settings,
    scene: &Scene,
) -> Result<Vec<Vec<u16>>, Diagnostic> {
    let Some(sides) = &settings.sides else { return Ok(Vec::new()) };
    let laws = laws.ok_or_else(|| {
        scene
            .invalid("box", "there is a box and no contact law: the rocks would fall through its sides")
            .try_instead("add a table [[contact]]")
    })?;
    rows(laws, settings, std::slice::from_ref(&sides.material))
        .map_err(|(what, advice)| scene.invalid("box", what).try_instead(advice))
}
