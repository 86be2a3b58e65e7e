//! A cluster beside the scene that it was made for: `rockfall run` makes it once, before the start, and the run reads it. A study
//! keeps those of its rocks in its directory, for later starts, tasks and runs against a barrier.
//!
//! The file begins with a key: a hash of the surface, of what was asked for, and of the spheres themselves. One that is of
//! another shape, or that was changed by hand, has another key, and the cluster is made again.

use super::bound::Bound;
use super::files;
use super::wish::Wish;
use crate::geometry::sphere::Sphere;
use crate::shape::Surface;
use std::path::{Path, PathBuf};
use toolkit::files::{Dir, TEXT, read_input};
use toolkit::input_file::hash;
use toolkit::run_dir;
use toolkit::scene::Scene;

/// Of the program.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The line that holds the key.
const KEY: &str = "# key: ";

/// Ending of the name of such a file.
const ENDING: &str = "xyzr";

/// The folder beside a scene where clusters may lie.
pub fn folder(scene: &Scene) -> PathBuf {
    scene.resolve(Path::new(run_dir::CLUSTERS))
}

/// The file of the rock `name`; of a study with several shapes number `shape` of them, from 1.
pub fn file(folder: &Path, name: &str, shape: Option<usize>) -> PathBuf {
    folder.join(shape.map_or_else(|| format!("{name}.{ENDING}"), |shape| format!("{name}_{shape}.{ENDING}")))
}

/// Files of a folder that may hold the cluster of the rock `name`: its own, and those of a study with several shapes.
fn files_of(folder: &Path, name: &str) -> Vec<PathBuf> {
    let Ok(entries) = Dir::open(folder).and_then(|dir| dir.entries()) else { return Vec::new() };
    let is_shape = |path: &Path| {
        let number = path.file_stem().and_then(|stem| stem.to_str()?.strip_prefix(name)?.strip_prefix('_'));
        path.extension().is_some_and(|e| e == ENDING) && number.is_some_and(|n| n.parse::<usize>().is_ok())
    };
    let paths = entries.iter().map(|(name, _)| folder.join(name));
    let shapes: Vec<PathBuf> = paths.filter(|path| is_shape(path)).collect();
    [vec![file(folder, name, None)], shapes].concat()
}

/// The spheres of the rock `name` of the first folder that holds them for this surface and wish, and the file.
pub fn find(
    folders: &[PathBuf],
    name: &str,
    surface: &Surface,
    wish: &Wish,
    bound: &Bound,
) -> Option<(Vec<Sphere>, PathBuf)> {
    let mut files = folders.iter().flat_map(|folder| files_of(folder, name));
    files.find_map(|file| Some((read(&file, surface, wish, bound)?, file)))
}

/// The text of the file for a cluster that was made of `surface`.
pub fn text(surface: &Surface, wish: &Wish, bound: &Bound, spheres: &[Sphere]) -> String {
    let made = format!("made by dem-solver {VERSION}: the spheres [m] of a rock, in its shape's own axes");
    let key = key(surface, wish, bound, spheres);
    files::text(&[made], spheres).replacen('\n', &format!("\n{KEY}{key}\n"), 1)
}

/// The spheres of the file, if it was written for this surface and wish.
pub fn read(file: &Path, surface: &Surface, wish: &Wish, bound: &Bound) -> Option<Vec<Sphere>> {
    let bytes = read_input(file, TEXT).ok()?;
    let spheres = files::read_text(&bytes).ok()?;
    let stated = std::str::from_utf8(&bytes).ok()?.lines().find_map(|line| line.strip_prefix(KEY))?;
    (stated == key(surface, wish, bound, &spheres)).then_some(spheres)
}

fn key(surface: &Surface, wish: &Wish, bound: &Bound, spheres: &[Sphere]) -> String {
    let mut bytes = format!("{VERSION} {wish:?} {bound:?}").into_bytes();
    let points = surface.points.iter().flat_map(|p| [p.x, p.y, p.z]);
    let numbers = points.chain(spheres.iter().flat_map(|s| [s.centre.x, s.centre.y, s.centre.z, s.radius]));
    bytes.extend(numbers.flat_map(|n| n.to_bits().to_le_bytes()));
    bytes.extend(surface.triangles.iter().flatten().flat_map(|k| k.to_le_bytes()));
    hash(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::Fit;
    use crate::shape::builtin;
    use nalgebra::Vector3;

    #[test]
    fn a_kept_cluster_is_taken_for_the_same_wish_alone_and_as_it_was_written() {
        let surface = builtin::cuboid(Vector3::new(0.3, 0.2, 0.1));
        let wish = Wish { spheres: 2, fit: Fit::Volume, smallest_radius: 0.0 };
        let bound = Bound::of(&surface, None);
        let ball = |x: f64| Sphere { centre: Vector3::new(x, 1.0 / 3.0, 1e-7), radius: 0.1 + x };
        let spheres = vec![ball(0.01), ball(0.02)];
        let dir = tempfile::tempdir().expect("a directory");
        let file = dir.path().join("rock.xyzr");
        let read = |surface: &Surface, wish: &Wish, bound: &Bound| read(&file, surface, wish, bound);
        assert_eq!(read(&surface, &wish, &bound), None, "there is none");
        let written = text(&surface, &wish, &bound, &spheres);
        std::fs::write(&file, &written).expect("written");
        assert_eq!(read(&surface, &wish, &bound).as_ref(), Some(&spheres), "bit for bit");
        assert_eq!(read(&surface, &Wish { spheres: 3, ..wish }, &bound), None);
        assert_eq!(read(&surface, &Wish { fit: Fit::Inside, ..wish }, &bound), None);
        assert_eq!(read(&surface, &wish, &Bound::of(&surface, Some(0.1))), None);
        let other = builtin::cuboid(Vector3::new(0.3, 0.2, 0.100_000_1));
        assert_eq!(read(&other, &wish, &Bound::of(&surface, None)), None);
        // Beside those of other shapes of one study.
        let found = |name: &str| find(&[dir.path().to_owned()], name, &surface, &wish, &bound);
        assert_eq!(found("rock"), Some((spheres.clone(), file.clone())));
        assert_eq!(found("roc"), None);
        let shape = super::file(dir.path(), "rock", Some(12));
        std::fs::rename(&file, &shape).expect("renamed");
        assert_eq!(found("rock"), Some((spheres.clone(), shape.clone())));
        std::fs::rename(&shape, &file).expect("renamed");
        std::fs::write(&file, written.replace("0.12", "0.13")).expect("written");
        assert_eq!(read(&surface, &wish, &bound), None, "changed by hand");
    }
}
