//! A scene, and not another file that belongs to this program: a study, or a barrier for one.

use crate::plan::Plan;
use crate::stop::Stop;
use interface_defs::diagnostic::code;
use std::path::Path;
use toolkit::arguments::Input;
use toolkit::files;
use toolkit::scene::Scene;

/// What a study has, and no scene.
const OF_STUDY: [&str; 2] = ["scene", "release"];
/// What a structure that waits for rocks has, and none alone.
const OF_BARRIER: [&str; 3] = ["contact", "dem", "coupling"];

/// The scene with who takes part in it.
pub fn load(input: &Input) -> Result<(Scene, Plan), Stop> {
    let scene = input.load().map_err(|e| study(&input.scene).unwrap_or_else(|| e.into()))?;
    let plan = Plan::of(&scene).map_err(|e| for_study(&scene, e.into()))?;
    Ok((scene, plan))
}

/// What is said of a study where a scene is asked for; `None`: it is none.
pub fn study(path: &Path) -> Option<Stop> {
    let text = String::from_utf8(files::read_input(path, files::TEXT).ok()?).ok()?;
    let table: toml::Table = text.parse().ok()?;
    let name = path.display();
    let says = format!("{name}: this is a study, not a scene; write rockfall ensemble {name}");
    OF_STUDY.iter().all(|key| table.contains_key(*key)).then(|| Stop::input(code::ARGUMENT, says))
}

/// A barrier that is run with the members of a study has no rock of its own.
fn for_study(scene: &Scene, stop: Stop) -> Stop {
    let alone = scene.has("structure") && !scene.has("rock") && !scene.has("spheres");
    if !alone || !OF_BARRIER.iter().any(|key| scene.has(key)) {
        return stop;
    }
    let name = scene.path().display();
    let cure = format!(
        "if it is a barrier for a study: rockfall ensemble STUDY --barrier {name}, which checks it with a rock of the study"
    );
    stop.hinted(&cure)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_and_a_barrier_for_one_are_named_as_what_they_are() {
        let temp = tempfile::tempdir().expect("a directory");
        let said = |name: &str, text: &str| {
            let scene = temp.path().join(name);
            std::fs::write(&scene, text).expect("written");
            let Err(stop) = load(&Input { scene, sets: Vec::new() }) else { panic!("{name} is a scene") };
            assert_eq!(stop.exit, toolkit::exit::Exit::BadInput);
            stop.errors[0].to_string()
        };
        let study = said("study.toml", "scene = \"fall.toml\"\n[[release]]\ncount = 2\n");
        assert!(study.contains("this is a study") && study.contains("rockfall ensemble "), "{study}");
        let barrier =
            said("barrier.toml", "end_time = 1.0\n[structure]\nfile = \"a\"\n[dem]\ntime_step = 1e-5\n");
        assert!(barrier.contains("nothing will use [dem]"), "{barrier}");
        assert!(barrier.contains("rockfall ensemble STUDY --barrier "), "{barrier}");
        let typo = said("scene.toml", "end_tim = 1.0\n");
        assert!(typo.contains("unknown key") && !typo.contains("ensemble"), "{typo}");
    }
}
