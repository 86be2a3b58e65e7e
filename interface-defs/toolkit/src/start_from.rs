//! `start_from`: a run whose structure starts where that of another run has ended.

use super::run_dir::{STRUCTURE_STATE, SUMMARY};
use super::scene::Scene;
use super::summary::{RunStatus, Summary};
use interface_defs::diagnostic::{Diagnostic, code};
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde::{Deserialize as DeriveDeserialize, Serialize};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// The key of the scene.
pub const KEY: &str = "start_from";

/// What it means, for the reference.
pub const MEANING: &str = "The structure starts where that of a finished run has ended: directory of that run. It keeps what its \
    elements remember (plastic strain, elongation of brakes, slip of ropes, what is torn), without the rocks of that run. Mesh, \
    parts and materials must be the same; loads, supports, damping, gauges and the integrator may differ. \
    `start_from = \"DIR\"` is `start_from = { run = \"DIR\", at = \"rest\" }`: at rest in the static equilibrium that is left \
    under the dead load, found by `structure.form_finding` (`none`: in the shape of the end); energies dissipated and received \
    count from 0 again. `at = \"motion\"`: it goes on with the velocities and energies of the end. Time begins at 0 in both.";

/// The run that a structure starts from: see [`MEANING`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum StartFrom {
    /// Directory of the results of that run. The structure starts at rest.
    Run(PathBuf),
    /// The same, with how it starts.
    How(Origin),
}

/// Where another run has ended, and how this one goes on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, DeriveDeserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// Directory of the results of that run.
    pub run: PathBuf,
    /// How the structure starts. Default `rest`.
    #[serde(default)]
    pub at: At,
}

/// How a structure starts from the end of another run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, DeriveDeserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum At {
    /// At rest, in the static equilibrium that its histories leave under its dead load: the rocks are taken out, and what
    /// swung has come to rest. Found by `structure.form_finding`; with `"none"` it starts in the shape of the end.
    #[default]
    Rest,
    /// With the velocities of the end: it moves on.
    Motion,
}

impl<'de> Deserialize<'de> for StartFrom {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = StartFrom;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the directory of a run, or { run = \"DIR\", at = \"rest\" }")
            }
            fn visit_str<E>(self, text: &str) -> Result<StartFrom, E> {
                Ok(StartFrom::Run(text.into()))
            }
            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<StartFrom, M::Error> {
                Origin::deserialize(MapAccessDeserializer::new(map)).map(StartFrom::How)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl StartFrom {
    fn parts(self) -> Origin {
        match self {
            Self::Run(run) => Origin { run, at: At::default() },
            Self::How(from) => from,
        }
    }
}

impl Origin {
    /// What the scene says, with the path as seen from here; `None` where it says nothing.
    pub fn of(scene: &Scene) -> Result<Option<Self>, Diagnostic> {
        let Some(from) = scene.read::<StartFrom>(KEY)?.map(StartFrom::parts) else { return Ok(None) };
        if from.run.as_os_str().is_empty() {
            return Err(scene.invalid(KEY, "start_from names no directory"));
        }
        Ok(Some(Self { run: scene.resolve(&from.run), ..from }))
    }

    /// Where the directory may be instead.
    fn elsewhere(&self, scene: &Scene) -> String {
        let from_scene = scene.path().parent().unwrap_or(Path::new(""));
        let as_typed = self.run.strip_prefix(from_scene).unwrap_or(&self.run);
        let counts = "the path counts from the directory of the scene file";
        match std::fs::canonicalize(as_typed) {
            Ok(here) if here.is_dir() => format!("{counts}; from here it is {}", here.display()),
            _ => format!("{counts}; it is that of the results of a run (its --out)"),
        }
    }

    /// The file with the state at the end of that run, if the run has come to its end; what should be known of that run.
    pub fn state(&self, scene: &Scene) -> Result<(PathBuf, Option<String>), Diagnostic> {
        let shown = self.run.display();
        let refuse = |what: String| scene.invalid(KEY, what);
        if !self.run.is_dir() {
            return scene.refuse(KEY, format!("there is no directory {shown}"), self.elsewhere(scene));
        }
        let summary = Summary::read(&self.run).map_err(|e| match e.kind() {
            io::ErrorKind::NotFound => {
                refuse(format!("the run in {shown} has not come to its end: it has no {SUMMARY}"))
                    .try_instead("wait until it has ended, or run it again")
            }
            _ => {
                refuse(format!("the {SUMMARY} of {shown} is of another version of this project, or damaged"))
                    .coded(code::PROVENANCE)
                    .try_instead("run that scene again with this version")
            }
        })?;
        let warning = match summary.status {
            RunStatus::Done => None,
            RunStatus::Unreliable => Some(format!(
                "{KEY}: the run in {shown} is unreliable{}, and so is what starts from it",
                summary.message.map_or(String::new(), |why| format!(" ({why})"))
            )),
            status @ (RunStatus::Failed | RunStatus::Interrupted) => {
                let why = summary.message.map_or(String::new(), |why| format!(": {why}"));
                let status = status.word();
                let what =
                    format!("the run in {shown} did not come to its end, its status is \"{status}\"{why}");
                return scene.refuse(KEY, what, "start from a run that is done");
            }
        };
        let file = self.run.join(STRUCTURE_STATE);
        if !file.is_file() {
            let what = format!("the run in {shown} has left no state of a structure ({STRUCTURE_STATE})");
            let cure =
                "start from a run with [structure], made by this version; one of rocks alone leaves none";
            return scene.refuse(KEY, what, cure);
        }
        Ok((file, warning))
    }
}

/// Refuse to write the results of `scene` to `out` where they would take the place of those that it starts from.
pub fn refuse_own(scene: &Scene, out: &Path) -> Result<(), Diagnostic> {
    let Some(from) = Origin::of(scene)? else { return Ok(()) };
    let place = |path: &Path| std::fs::canonicalize(path).ok();
    if place(out).is_some() && place(out) == place(&from.run) {
        let what = format!("the run would start from its own directory of results, {}", out.display());
        return scene.refuse(KEY, what, "choose another directory for the results with --out");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from(text: &str) -> Result<Option<Origin>, String> {
        let scene = Scene::from_text("dir/s.toml", text).map_err(|e| e.to_string())?;
        Origin::of(&scene).map_err(|e| e.to_string())
    }

    #[test]
    fn a_directory_alone_means_at_rest_and_paths_count_from_the_scene() {
        let at = |run: &str, at| Ok(Some(Origin { run: run.into(), at }));
        assert_eq!(from(""), Ok(None));
        assert_eq!(from("start_from = \"out/a\""), at("dir/out/a", At::Rest));
        assert_eq!(from("start_from = { run = \"/a\" }"), at("/a", At::Rest));
        assert_eq!(from("start_from = { run = \"../a\", at = \"motion\" }"), at("dir/../a", At::Motion));
        for (text, place, what) in [
            ("start_from = \"\"", "1:14", "names no directory"),
            ("start_from = 3", "1:14", "the directory of a run"),
            ("start_from = { at = \"rest\" }", "1:14", "`run`"),
            ("start_from = { run = \"a\", at = \"moving\" }", "1:32", "`moving`"),
            ("start_from = { run = \"a\", when = 3 }", "1:27", "`when`"),
        ] {
            let error = from(text).expect_err(text);
            assert!(error.starts_with(&format!("dir/s.toml:{place}: ")) && error.contains(what), "{error}");
        }
    }

    #[test]
    fn what_cannot_be_started_from_is_named() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("s.toml");
        std::fs::write(&path, "start_from = \"first\"\n").expect("written");
        let scene = Scene::load(&path, &[]).expect("valid");
        let found = || Origin::of(&scene).expect("valid").expect("there").state(&scene);
        let refused = || found().expect_err("refused").to_string();
        assert!(refused().contains("there is no directory"), "{}", refused());
        let dir = temp.path().join("first");
        std::fs::create_dir(&dir).expect("created");
        assert!(refused().contains("has no summary.json"), "{}", refused());
        for status in [RunStatus::Failed, RunStatus::Interrupted] {
            let summary = Summary { message: Some("because".into()), ..Summary::new(status) };
            summary.write(&dir).expect("written");
            let said = refused();
            assert!(said.contains(status.word()) && said.contains("because"), "{said}");
        }
        Summary::new(RunStatus::Done).write(&dir).expect("written");
        assert!(refused().contains("has left no state of a structure"), "{}", refused());
        std::fs::write(dir.join(STRUCTURE_STATE), "x").expect("written");
        assert_eq!(found().expect("there"), (dir.join(STRUCTURE_STATE), None));
        Summary::new(RunStatus::Unreliable).write(&dir).expect("written");
        assert!(found().expect("there").1.is_some_and(|w| w.contains("unreliable")));
        refuse_own(&scene, &temp.path().join("second")).expect("another");
        let own = refuse_own(&scene, &temp.path().join("./first")).expect_err("its own").to_string();
        assert!(own.contains("its own directory of results") && own.contains("--out"), "{own}");
    }
}
