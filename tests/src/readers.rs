//! Everything that reads bytes from outside, as functions of these bytes: what fuzzing calls. None may panic, hang or take memory that its
//! input does not fill. What it answers matters for the seeds alone: at least one of each reader must be accepted.
//!
//! Behind a hash no changed byte would reach a reader: a target named `..._content` takes what the hash is of, and puts the hash itself.
//! States name the program that wrote them, so their seeds are made when they are needed ([`Target::made`]), not kept.

mod made;

use dem_solver::study;
use interface_defs::ipc::run_id::fnv1a;
use interface_defs::message::{FromSolver, ToSolver, decode};
use made::{STATE, with_own_program};
use std::path::Path;
use toolkit::checkpoint::Found;
use toolkit::coordinates::{Coordinates, Form};
use toolkit::scene::Scene;
use toolkit::summary::Summary;
use toolkit::{check, input_file, manifest, provenance, state_file};

/// A reader: its name, and what it does with bytes.
pub struct Target {
    /// Name, that of its folder in `tests/fuzz/corpus`.
    pub name: &'static str,
    /// Read the bytes; `dir` is an empty directory for the file that they are. Whether they were accepted.
    pub read: fn(dir: &Path, bytes: &[u8]) -> bool,
    /// Seeds that this version writes itself.
    pub made: fn() -> Vec<Vec<u8>>,
}

/// A reader of files with this extension.
macro_rules! of_file {
    ($name:literal, $extension:literal, $read:expr) => {
        of_file!($name, $extension, $read, Vec::new)
    };
    ($name:literal, $extension:literal, $read:expr, $made:expr) => {
        Target {
            name: $name,
            read: |dir, bytes| {
                let path = dir.join(concat!("input.", $extension));
                std::fs::write(&path, bytes).expect("written");
                let read: fn(&Path) -> bool = $read;
                read(&path)
            },
            made: $made,
        }
    };
}

fn terrain(path: &Path) -> bool {
    dem_solver::terrain::formats::terrain(path, &[2], None)
        .map(|content| drop(std::hint::black_box(content)))
        .is_ok()
}

fn surface(path: &Path) -> bool {
    dem_solver::shape::formats::read_surface(path, 1.0, &dem_solver::shape::closed::Mend::default()).is_ok()
}

fn mesh(path: &Path) -> bool {
    fem_solver::read::read(path).is_ok()
}

fn cluster(path: &Path) -> bool {
    dem_solver::cluster::files::read(path).is_ok()
}

/// A scene beside `path`, which its files count from.
fn beside(path: &Path) -> Scene {
    Scene::from_text(&path.with_file_name("scene.toml").display().to_string(), "").expect("a scene")
}

fn scene(scene: &Scene) -> bool {
    let settings = dem_solver::settings::Settings::of(scene).is_ok();
    let coupling = coupler::settings::CouplingSettings::of(scene).is_ok();
    scene.document().is_ok() && settings && coupling
}

fn structure_state(path: &Path) -> bool {
    state_file::read::<fem_solver::state::inherited::End>(path, made::STRUCTURE).is_ok()
}

/// The checkpoint of these bytes, in `dir`.
fn checkpoint(dir: &Path, bytes: &[u8]) -> bool {
    std::fs::create_dir_all(dir.join("checkpoint")).expect("a directory");
    std::fs::write(dir.join("checkpoint/1.state"), bytes).expect("written");
    matches!(Found::of(dir).usable(dir), Ok(Some(_)))
}

/// All of them.
pub const TARGETS: &[Target] = &[
    Target {
        name: "from_solver",
        read: |_, bytes| decode::<FromSolver>(bytes).is_ok(),
        made: made::from_solver,
    },
    Target { name: "to_solver", read: |_, bytes| decode::<ToSolver>(bytes).is_ok(), made: made::to_solver },
    of_file!("scene", "toml", |path| Scene::load(path, &[]).is_ok_and(|read| scene(&read))),
    Target {
        name: "set",
        read: |dir, bytes| {
            let (path, sets) = (dir.join("scene.toml"), String::from_utf8_lossy(bytes));
            std::fs::write(&path, "end_time = 1.0\n[[rock]]\nname = \"a\"\n").expect("written");
            let sets: Vec<String> = sets.split('\n').map(String::from).collect();
            Scene::load(&path, &sets).map(|read| scene(&read)).is_ok()
        },
        made: Vec::new,
    },
    of_file!("study", "toml", |path| {
        Scene::load_as(&toolkit::scene::STUDY, path, &[])
            .is_ok_and(|read| study::settings::StudySettings::of(&read).is_ok())
    }),
    of_file!("geojson", "geojson", |path| {
        [Form::Points, Form::Line, Form::Polygon]
            .map(|form| Coordinates::<[f64; 2]>::of_file(path).read(form, "points", &beside(path)).is_ok())
            .contains(&true)
    }),
    of_file!("interface", "json", |path| check::read_interface(path).is_ok()),
    of_file!("heights", "asc", |path| {
        fem_solver::read::heights::Heights::read(&beside(path), "structure.terrain", path).is_ok()
    }),
    of_file!("stl", "stl", surface),
    of_file!("obj", "obj", surface),
    of_file!("clu", "clu", cluster),
    of_file!("xyzr", "xyzr", cluster),
    of_file!("asc", "asc", terrain),
    of_file!("grd", "grd", terrain),
    of_file!("tif", "tif", terrain),
    of_file!("xyz", "xyz", terrain),
    of_file!("las", "las", terrain),
    of_file!("laz", "laz", terrain),
    Target {
        name: "prj",
        read: |dir, bytes| {
            let raster = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n";
            std::fs::write(dir.join("input.prj"), bytes).expect("written");
            std::fs::write(dir.join("input.asc"), raster).expect("written");
            terrain(&dir.join("input.asc"))
        },
        made: Vec::new,
    },
    of_file!("msh", "msh", mesh),
    of_file!("inp", "inp", mesh),
    of_file!("mdpa", "mdpa", mesh),
    of_file!("structure_state", "state", structure_state, made::structure_state),
    Target {
        name: "structure_state_content",
        read: |dir, bytes| {
            let path = dir.join("input.state");
            std::fs::write(&path, made::sealed(made::STRUCTURE, &with_own_program(bytes))).expect("written");
            structure_state(&path)
        },
        made: || made::contents(&made::structure_state()),
    },
    Target { name: "checkpoint", read: checkpoint, made: made::checkpoint },
    Target {
        name: "checkpoint_content",
        read: |dir, bytes| {
            let checkpoints = made::checkpoint();
            let version =
                checkpoints[0][STATE.version].try_into().map(u32::from_le_bytes).expect("four bytes");
            checkpoint(dir, &made::sealed(version, &with_own_program(bytes)))
        },
        made: || made::contents(&made::checkpoint()),
    },
    Target { name: "resume", read: |_, bytes| made::goes_on(&with_own_program(bytes)), made: made::kept_run },
    of_file!(
        "journal",
        "chunk",
        |path| {
            let own = with_own_program(&std::fs::read(path).expect("read"));
            std::fs::write(path, own).expect("written");
            study::record::complete(path, "study").is_ok_and(|found| !found.is_empty())
        },
        made::journal
    ),
    Target {
        name: "record_content",
        read: |_, bytes| {
            let mut frame = (bytes.len() as u64).to_le_bytes().to_vec();
            frame.extend(bytes);
            frame.extend(fnv1a(&frame).to_le_bytes());
            study::record::Record::read(&frame).is_some()
        },
        made: || made::records().iter().map(interface_defs::message::pack).collect(),
    },
    Target {
        name: "summary",
        read: |dir, bytes| {
            std::fs::write(dir.join("summary.json"), bytes).expect("written");
            Summary::read(dir).is_ok()
        },
        made: made::summary,
    },
    Target {
        name: "manifest",
        read: |dir, bytes| {
            std::fs::write(dir.join("history.csv"), made::HISTORY).expect("written");
            std::fs::write(dir.join("manifest.json"), bytes).expect("written");
            manifest::verify(dir).is_empty()
        },
        made: made::manifest,
    },
    of_file!("any", "bin", |path| {
        let hashed = toolkit::files::input(path).and_then(provenance::hash_of);
        input_file::regular(path).is_ok() && hashed.is_ok()
    }),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeds;

    /// A seed that no reader takes is found out by its checks at the door: nothing behind them is fuzzed.
    #[test]
    fn every_reader_accepts_one_of_its_seeds_and_survives_all_cut_short() {
        for target in TARGETS {
            let read = |bytes: &[u8]| (target.read)(tempfile::tempdir().expect("a directory").path(), bytes);
            let seeds = seeds(target);
            assert!(seeds.iter().any(|seed| read(seed)), "{}: {} seeds", target.name, seeds.len());
            for seed in seeds {
                for quarter in 1..4 {
                    read(&seed[..seed.len() * quarter / 4]);
                }
            }
        }
    }
}
