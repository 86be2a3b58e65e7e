//! A prepared surface in a file: the first task of a study on a machine writes it, and those that map it hold it in memory once.
//!
//! The file begins with what it was made from: program, scene, terrain file. It ends with a hash of all that stands before.

use super::settings::TerrainSettings;
use super::{Terrain, system};
use dem_solid::geometry::box_tree::BoxTree;
use dem_solid::row::Row;
use interface_defs::message::{pack, unpack};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toolkit::files::{self, Map};
use toolkit::provenance::{self, Running, hash_of};
use toolkit::scene::Scene;

/// Name of the file in its folder.
pub const NAME: &str = "terrain.kept";
/// Bytes to a multiple of which its beginning is filled up.
const ALIGNED: usize = 64;

/// What stands before the surface: what it follows from, all that is short, and how many nodes, triangles and boxes of each level follow.
type Head = (String, Terrain, Vec<usize>);

/// What the surface follows from: the scene, the terrain's file, and what lies beside that.
fn key(scene: &Scene, settings: &TerrainSettings) -> io::Result<String> {
    let path = scene.resolve(&settings.file);
    let (file, _) = hash_of(files::input(&path)?)?;
    Ok(format!("{} {} {:?}", scene.fingerprint(), file.text(), system::of_file(&path)))
}

/// The surface that one of the folders holds.
pub(super) fn find(folders: &[PathBuf], scene: &Scene, settings: &TerrainSettings) -> Option<Terrain> {
    folders.iter().find_map(|folder| read(&folder.join(NAME), scene, settings).ok()?)
}

/// The surface in a file; `None`: it is another one, or damaged.
fn read(path: &Path, scene: &Scene, settings: &TerrainSettings) -> io::Result<Option<Terrain>> {
    let file = files::source(path)?;
    let map = Arc::new(Map::of(&file)?);
    let Some((own, ground, end)) = open(&map) else { return Ok(None) };
    // Read past the map, whose pages count for the process only where it looks at them.
    let (hash, _) = hash_of(file.take(end as u64))?;
    let is_sound = map[end..] == *hash.text().as_bytes() && own == key(scene, settings)?;
    Ok(is_sound.then_some(ground))
}

/// What a surface follows from, the surface, and where it ends.
fn open(map: &Arc<Map>) -> Option<(String, Terrain, usize)> {
    let rest = provenance::open(map).ok()?;
    let (length, rest) = rest.split_first_chunk::<8>()?;
    let head = rest.get(..usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    let mut at = (map.len() - rest.len() + head.len()).next_multiple_of(ALIGNED);
    let (key, mut ground, counts) = unpack::<Head>(head).ok()?;
    let [nodes, triangles, levels @ ..] = &counts[..] else { return None };
    ground.nodes = Row::shared(map, &mut at, *nodes)?;
    ground.triangles = Row::shared(map, &mut at, *triangles)?;
    let levels = levels.iter().map(|count| Row::shared(map, &mut at, *count)).collect::<Option<_>>()?;
    ground.tree = BoxTree { count: *triangles, levels };
    Some((key, ground, at))
}

impl Terrain {
    /// True if the surface is in memory once for all processes of the machine that use it.
    pub fn is_shared(&self) -> bool {
        self.nodes.is_shared()
    }

    /// Write the surface to a folder and go on with that which is there: memory of this process is free again.
    pub fn share(&mut self, folder: &Path, scene: &Scene, settings: &TerrainSettings) -> io::Result<()> {
        self.content = self.content();
        let levels = &self.tree.levels;
        let mut counts = vec![self.nodes.len(), self.triangles.len()];
        counts.extend(levels.iter().map(|level| level.len()));
        let head = pack(&(key(scene, settings)?, &*self, counts));
        let mut begin = [provenance::head(), (head.len() as u64).to_le_bytes().to_vec(), head].concat();
        begin.resize(begin.len().next_multiple_of(ALIGNED), 0);
        let mut parts = vec![&begin[..], self.nodes.bytes(), self.triangles.bytes()];
        parts.extend(levels.iter().map(Row::bytes));
        let mut hash = Running::default();
        parts.iter().for_each(|part| hash.add(part));
        let hash = hash.text();
        parts.push(hash.as_bytes());
        let path = folder.join(NAME);
        files::write_parts(&path, &parts)?;
        if let Some(Self { nodes, triangles, tree, .. }) = read(&path, scene, settings)? {
            (self.nodes, self.triangles, self.tree) = (nodes, triangles, tree);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_kept_surface_is_that_which_was_prepared_and_is_taken_as_it_was_written_alone() {
        let dir = tempfile::tempdir().expect("a directory");
        let grid = |last: &str| {
            format!("ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 2\n9 8 7\n6 5 5\n4 3 {last}\n")
        };
        let text = "[terrain]\nfile = \"t.asc\"\n";
        let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).expect("written");
        let load = || {
            let scene = Scene::load(&dir.path().join("scene.toml"), &[]).expect("a scene");
            let settings = TerrainSettings::of(&scene).expect("settings").expect("a terrain");
            (Terrain::with_kept(&scene, &settings, &[dir.path().into()]).expect("read"), scene, settings)
        };
        write("t.asc", &grid("1"));
        write("scene.toml", text);
        let (own, scene, settings) = load();
        let mut shared = own.clone();
        shared.share(dir.path(), &scene, &settings).expect("written");
        assert!(shared.is_shared() && !own.is_shared());
        let again = load().0;
        for shared in [&shared, &again] {
            assert!(shared.is_shared() && shared.content() == own.content());
            assert_eq!((&shared.nodes[..], &shared.triangles[..]), (&own.nodes[..], &own.triangles[..]));
            assert_eq!((shared.extent(), shared.unshared()), (own.extent(), None));
            let near = |ground: &Terrain| {
                let mut found = Vec::new();
                ground.about(&Vector3::zeros(), 1.5, |t| found.push(t));
                found
            };
            assert_eq!(near(shared), near(&own));
        }
        // Changed without a word: by a byte, cut, or in what it was made from.
        let path = dir.path().join(NAME);
        let bytes = std::fs::read(&path).expect("there");
        for at in (0..bytes.len()).step_by(7) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            for other in [&damaged[..], &bytes[..at]] {
                std::fs::remove_file(&path).expect("removed");
                std::fs::write(&path, other).expect("written");
                assert!(!load().0.is_shared(), "{at}");
            }
        }
        std::fs::remove_file(&path).expect("removed");
        std::fs::write(&path, &bytes).expect("written");
        write("t.asc", &grid("2"));
        assert!(!load().0.is_shared(), "another terrain");
        write("t.asc", &grid("1"));
        write("scene.toml", &format!("{text}nodata = \"cut\"\n"));
        assert!(!load().0.is_shared(), "another scene");
        write("scene.toml", text);
        assert!(load().0.is_shared());
    }
}
