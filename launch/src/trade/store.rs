//! The directory of a study: which scene it is of, and every finished run, so that the same command goes on with it.

use super::knobs::Space;
use super::study::Finished;
use crate::front::stop::{Stop, write};
use crate::run::sweep::{self, Build};
use interface_defs::diagnostic::{Diagnostic, Place};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use toolkit::files::{self, Dir};
use toolkit::owner::{Claim, Owner};

/// Directories of the runs.
const RUNS: &str = "runs";
/// What the study is of.
const STUDY: &str = "study.json";

/// What a study is of: runs of another are not comparable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Fingerprint of the scene with the user's `--set`s.
    pub scene: String,
    /// Hashes of the files that it names.
    pub inputs: Map<String, Value>,
    /// Of the project.
    pub build: Build,
    /// Those that the scene names instead.
    pub foreign: Build,
}

/// The directory of a study, owned as long as this lives.
pub struct Store {
    out: PathBuf,
    _owner: Owner,
    /// Number of the last run.
    last: usize,
}

impl Store {
    /// Open the study of `identity` in `out`. That of another scene is refused, or with `force` removed.
    pub fn open(out: &Path, identity: &Identity, force: bool) -> Result<Self, Stop> {
        let fault =
            |e: io::Error| Diagnostic::in_file(out.display(), format!("no study can be written here: {e}"));
        let owner = Owner::claim(out, &Claim { force, ..Claim::default() })?;
        let place = out.join(STUDY);
        let known: Option<Identity> = files::read_json(&place).ok();
        if force || known.as_ref() != Some(identity) {
            if place.exists() {
                if !force {
                    return Err(another(out, known.as_ref(), identity).into());
                }
                files::if_there(std::fs::remove_dir_all(out.join(RUNS))).map_err(fault)?;
            }
            files::write_json(&place, identity).map_err(fault)?;
        }
        Dir::create(&out.join(RUNS)).map_err(fault)?;
        Ok(Self { out: out.to_owned(), _owner: owner, last: 0 })
    }

    /// All finished runs, in their order.
    ///
    /// An error: programs of another build computed one.
    pub fn load(&mut self, space: &Space) -> Result<Vec<Finished>, Diagnostic> {
        let mut all = Vec::new();
        while let Some((_, kept)) = sweep::kept::<Finished<BTreeMap<String, f64>>>(&self.next())? {
            let Finished { point, key, purpose, sets, outcome } = kept;
            let known = |(name, rung): (&String, &f64)| Some((space.knob(name)?.name, *rung));
            let Some(point) = point.iter().map(known).collect() else { break };
            all.push(Finished { point, key, purpose, sets, outcome });
            self.last += 1;
        }
        Ok(all)
    }

    /// Directory of the next run.
    pub fn next(&self) -> PathBuf {
        self.out.join(RUNS).join(format!("{:03}", self.last + 1))
    }

    /// Keep what the next run gave.
    pub fn keep(&mut self, run: &Finished) -> Result<(), Stop> {
        let dir = self.next();
        self.last += 1;
        sweep::keep(&dir, &run.key, run)
    }

    /// Write a file of the study.
    pub fn write(&self, name: &str, text: &str) -> Result<PathBuf, Stop> {
        let path = self.out.join(name);
        write(&path, text)?;
        Ok(path)
    }
}

fn another(out: &Path, there: Option<&Identity>, identity: &Identity) -> Diagnostic {
    let what = match there {
        Some(there) if there.scene != identity.scene => {
            "of another scene, or of this one with other --set values"
        }
        Some(there) if there.inputs != identity.inputs => "of this scene with other input files",
        Some(there) => {
            let other = sweep::of_other_build(&there.build, &identity.build)
                .or_else(|| sweep::of_other_build(&there.foreign, &identity.foreign));
            match other {
                Some(other) => return other.at(Place::file(out.display())),
                None => "with other programs in its scene",
            }
        }
        None => "that this version cannot read",
    };
    Diagnostic::in_file(
        out.display(),
        format!("this directory holds a study {what}; its runs cannot be compared"),
    )
    .try_instead("choose another directory with --out, or remove its runs with --force")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::knobs::{Knob, Point, Start};
    use crate::trade::result::Purpose;
    use crate::trade::result::tests::done;
    use interface_defs::diagnostic::code;

    fn identity(scene: &str, build: &str) -> Identity {
        let build = Build::from([("coupler".into(), Some(build.into()))]);
        Identity { scene: scene.into(), inputs: Map::new(), build, foreign: Build::new() }
    }

    #[test]
    fn a_study_goes_on_and_another_scene_is_refused_unless_forced() {
        let temp = tempfile::tempdir().expect("a directory");
        let out = temp.path().join("study");
        let knobs = vec![Knob::number("window", "coupling.time_window", 1e-4)];
        let space = Space { starts: vec![Start { knobs, pinned: Vec::new() }] };
        let point = Point::from([("window", -1.0)]);
        let run = Finished {
            key: space.key(&point).expect("a point"),
            purpose: Purpose::Explore,
            sets: space.sets(&point).expect("a point"),
            outcome: done("depth", 0.25, 1.5),
            point,
        };
        let mut store = Store::open(&out, &identity("a", "1"), false).expect("new");
        assert!(store.load(&space).expect("of this build").is_empty());
        store.keep(&run).expect("kept");
        // One that was not finished.
        std::fs::create_dir_all(store.next()).expect("created");
        drop(store);
        let mut store = Store::open(&out, &identity("a", "1"), false).expect("the same");
        let runs = store.load(&space).expect("of this build");
        assert_eq!(runs.len(), 1);
        assert_eq!(runs[0], run);
        assert!(store.next().ends_with("runs/002"));
        drop(store);
        let refused = Store::open(&out, &identity("a", "2"), false).err().expect("another build");
        let said = &refused.errors[0];
        assert!(
            said.code == code::PROVENANCE && said.message.contains("coupler 1, and this is coupler 2"),
            "{said}"
        );
        let refused = Store::open(&out, &identity("b", "1"), false).err().expect("another");
        assert!(
            refused.errors[0].to_string().contains("of another scene")
                && refused.errors[0].to_string().contains("--force"),
            "{}",
            refused.errors[0]
        );
        assert_eq!(refused.exit, toolkit::exit::Exit::BadInput);
        let mut store = Store::open(&out, &identity("b", "1"), true).expect("forced");
        assert!(store.load(&space).expect("of this build").is_empty());
    }
}
