//! Where in the user's file that stands which is wrong in the scene of a member: most of that scene is the barrier's own.

use interface_defs::diagnostic::Diagnostic;
use toml::Value;
use toolkit::scene::Scene;

/// What a member's scene has from the study, or from both.
const OF_STUDY: [&str; 6] = ["rock", "terrain", "gravity", "contact", "end_time", "title"];

/// The scene of a member that was made to be checked.
pub struct Generated<'a> {
    /// Its file, as diagnostics name it.
    pub file: String,
    /// The barrier that it was made with.
    pub barrier: &'a Scene,
}

impl Generated<'_> {
    /// What is said of it, as something about the barrier's file where the key is from there.
    pub fn placed(&self, mut said: Diagnostic) -> Diagnostic {
        if said.key.as_deref().is_some_and(|key| self.is_of_barrier(key)) {
            return self.barrier.placed(Diagnostic { place: None, ..said });
        }
        if let Some(place) = said.place.as_deref_mut().filter(|place| place.file == self.file) {
            place.file = format!("the scene of member 1 against {}", self.barrier.path().display());
        }
        said
    }

    fn is_of_barrier(&self, key: &str) -> bool {
        let first = key.split('.').next().unwrap_or_default();
        !OF_STUDY.contains(&first)
            && self.barrier.document().is_ok_and(|table| has(&Value::Table(table), key))
    }
}

fn has(value: &Value, key: &str) -> bool {
    let found = key.split('.').try_fold(value, |value, part| match part.parse::<usize>() {
        Ok(at) => value.get(at),
        Err(_) => value.get(part),
    });
    found.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::diagnostic::{Place, code};

    #[test]
    fn what_is_wrong_is_named_in_the_file_of_the_user() {
        let own = "# mine\n[dem]\ntime_step = 1e-2\n[[structure.parts]]\nname = \"a\"\n[[structure.parts]]\nname = \"b\"\n";
        let barrier = Scene::from_text("barrier.toml", own).expect("valid");
        let generated = Generated { file: "/t/m.toml".into(), barrier: &barrier };
        let at = |key: &str| {
            let place = Place::in_text("/t/m.toml", "end_time = 1.5\n[dem]\ntime_step = 0.01\n", 33..37);
            Diagnostic::error(code::TIME_STEP, "too long").about(key).try_instead("shorten it").at(place)
        };
        let said = generated.placed(at("dem.time_step")).to_string();
        assert!(said.starts_with("barrier.toml:3:13: too long"), "{said}");
        assert!(said.contains("3 | time_step = 1e-2") && said.ends_with("= shorten it"), "{said}");
        assert!(generated.placed(at("structure.parts.1.name")).to_string().starts_with("barrier.toml:7:"));
        for key in ["rock.0.density", "dem.steps_per_contact"] {
            let said = generated.placed(at(key)).to_string();
            assert!(said.starts_with("the scene of member 1 against barrier.toml:3:"), "{said}");
        }
        let warning = Diagnostic::warning(code::OTHER, "a post has turned");
        assert_eq!(generated.placed(warning.clone()), warning);
        let long = Diagnostic::warning(code::TIME_STEP, "long").about("dem.time_step");
        assert_eq!(generated.placed(long).to_string(), "barrier.toml:3:13: dem.time_step: long");
    }
}
