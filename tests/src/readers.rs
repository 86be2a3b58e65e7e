//! Everything that reads bytes from outside, as functions of these bytes: what fuzzing calls. None may panic, hang or take memory that its
//! input does not fill; what it answers does not matter.

use interface_defs::message::{FromSolver, ToSolver, decode};
use std::path::Path;
use toolkit::checkpoint::Found;
use toolkit::input_file;
use toolkit::scene::Scene;
use toolkit::state_file;
use toolkit::summary::Summary;

/// A reader: its name, and what it does with bytes.
pub struct Target {
    /// Name, that of its folder in `tests/fuzz/corpus`.
    pub name: &'static str,
    /// Read the bytes; `dir` is an empty directory for the file that they are.
    pub read: fn(&Path, &[u8]),
}

/// A reader of files with this extension.
macro_rules! of_file {
    ($name:literal, $extension:literal, $read:expr) => {
        Target {
            name: $name,
            read: |dir, bytes| {
                let path = dir.join(concat!("input.", $extension));
                std::fs::write(&path, bytes).expect("written");
                let read: fn(&Path) = $read;
                read(&path);
            },
        }
    };
}

fn terrain(path: &Path) {
    if let Ok(content) = dem_solver::terrain::formats::terrain(path, &[2], None) {
        std::hint::black_box(&content);
    }
}

fn surface(path: &Path) {
    let _ = dem_solver::shape::formats::read_surface(path, 1.0, &dem_solver::shape::closed::Mend::default());
}

fn mesh(path: &Path) {
    let _ = fem_solver::read::read(path);
}

/// All of them.
pub const TARGETS: &[Target] = &[
    Target { name: "from_solver", read: |_, bytes| drop(decode::<FromSolver>(bytes)) },
    Target { name: "to_solver", read: |_, bytes| drop(decode::<ToSolver>(bytes)) },
    of_file!("scene", "toml", |path| {
        if let Ok(scene) = Scene::load(path, &[]) {
            let _ = dem_solver::settings::Settings::of(&scene);
            let _ = coupler::settings::CouplingSettings::of(&scene);
            let _ = scene.document();
        }
    }),
    of_file!("stl", "stl", surface),
    of_file!("obj", "obj", surface),
    of_file!("clu", "clu", |path| drop(dem_solver::cluster::files::read(path))),
    of_file!("xyzr", "xyzr", |path| drop(dem_solver::cluster::files::read(path))),
    of_file!("asc", "asc", terrain),
    of_file!("grd", "grd", terrain),
    of_file!("tif", "tif", terrain),
    of_file!("xyz", "xyz", terrain),
    of_file!("las", "las", terrain),
    of_file!("laz", "laz", terrain),
    of_file!("msh", "msh", mesh),
    of_file!("inp", "inp", mesh),
    of_file!("mdpa", "mdpa", mesh),
    of_file!("structure_state", "state", |path| {
        let _ = state_file::read::<fem_solver::state::inherited::End>(path, 1);
    }),
    Target {
        name: "checkpoint",
        read: |dir, bytes| {
            std::fs::create_dir_all(dir.join("checkpoint")).expect("a directory");
            std::fs::write(dir.join("checkpoint/1.state"), bytes).expect("written");
            let _ = Found::of(dir).usable(dir);
        },
    },
    of_file!("journal", "chunk", |path| drop(dem_solver::study::journal::complete(path, "study"))),
    Target {
        name: "summary",
        read: |dir, bytes| {
            std::fs::write(dir.join("summary.json"), bytes).expect("written");
            let _ = Summary::read(dir);
        },
    },
    of_file!("any", "bin", |path| drop(input_file::regular(path))),
];
