//! What the rocks of a scene may touch beside the structure: its terrain, each other, the sides of its box.

use crate::integrator::rock_stage::{DEEPEST_AT_START, RockStage};
use crate::model::between::{rows, whole_rocks};
use crate::model::state::State;
use crate::model::{Model, name_of};
use dem_contact::contact::broad_phase::cell_grid::Plane;
use dem_contact::law::table::Laws;
use dem_contact::settings::STRUCTURE;
use dem_terrain::Terrain;
use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;

/// Give the rocks their laws with the terrain, and those that touch it as a whole what that needs. What was chosen where the scene leaves
/// it open, and why.
pub(super) fn lay_on_terrain(
    model: &mut Model,
    ground: &mut Terrain,
    scene: &Scene,
) -> Result<Option<String>, Diagnostic> {
    let laws = laws_with(
        model,
        "terrain",
        "there is terrain and no contact law: the rocks would fall through it",
        scene,
    )?;
    let rows = rows(laws, &model.settings, &ground.materials)
        .map_err(|[what, advice]| scene.invalid("terrain", what).try_instead(advice))?;
    let wholes = whole_rocks(laws, &rows, &model.rocks, scene)?;
    if wholes.iter().any(Option::is_some) {
        let mixed = ground.face_up();
        ground.notices.extend(mixed);
    }
    let spheres = wholes.iter().any(Option::is_none);
    (model.ground_rows, model.wholes) = (rows, wholes);
    Ok(spheres.then(|| {
        let selection = model.settings.dem.contact_selection;
        let (continuous, why) = selection.choose("terrain", || ground.unshared());
        ground.continuous = continuous;
        why
    }))
}

/// Let wires touch the faces of the rocks whose law with the structure is that of the rock as a whole.
pub(super) fn touch_by_faces(model: &mut Model) {
    let Some(laws) = &model.laws else { return };
    for (rock, table) in model.rocks.iter_mut().zip(&model.settings.rocks) {
        let law = laws.number(&table.material, STRUCTURE).map(|number| &laws.surfaces[number]);
        if law.is_some_and(|law| law.foundation().is_some()) {
            rock.touch_by_faces();
        }
    }
}

/// The laws of a scene whose table `key` needs one.
fn laws_with<'a>(model: &'a Model, key: &str, missing: &str, scene: &Scene) -> Result<&'a Laws, Diagnostic> {
    model.laws.as_ref().ok_or_else(|| scene.invalid(key, missing).try_instead("add a table [[contact]]"))
}

/// Refuse rocks that are in each other at the start.
pub(super) fn are_apart(model: &Model, state: &mut State, scene: &Scene) -> Result<(), Diagnostic> {
    let worst = RockStage::new(model).energy(model, state);
    let Some(([a, b], radii)) = worst.filter(|(_, radii)| *radii > DEEPEST_AT_START) else { return Ok(()) };
    let [one, two] = [a, b].map(|rock| name_of(model, rock));
    let what = format!(
        "rock `{one}` and rock `{two}` overlap at the start, by {radii:.2} radii of the smaller sphere"
    );
    scene.refuse(&model.settings.place_key(b), what, "move them apart")
}

/// Put the sides of the scene's box around the rocks, if it has one.
pub(super) fn enclose(model: &mut Model, scene: &Scene) -> Result<(), Diagnostic> {
    let Some(sides) = &model.settings.sides else { return Ok(()) };
    let missing = "there is a box and no contact law: the rocks would fall through its sides";
    let laws = laws_with(model, "box", missing, scene)?;
    let rows = rows(laws, &model.settings, std::slice::from_ref(&sides.material))
        .map_err(|[what, advice]| scene.invalid("box", what).try_instead(advice))?;
    let seen = |plane: Plane| Plane { offset: plane.offset - plane.normal.dot(&model.origin), ..plane };
    let planes = sides.planes().into_iter().map(seen).collect();
    let wholes = whole_rocks(laws, &rows, &model.rocks, scene)?;
    (model.planes, model.side_wholes) = (planes, wholes);
    // One sphere is its own whole.
    for (whole, rock) in model.side_wholes.iter_mut().zip(&model.rocks) {
        whole.take_if(|_| rock.spheres.len() == 1);
    }
    model.side_rows = rows;
    Ok(())
}
