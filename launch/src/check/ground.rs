//! Heights of the terrain for a structure that stands or lies on it and names none: where they are needed the structure's program
//! says, and the rocks' program writes them.
//!
//! Neither of the two knows the other. What a scene names itself is left as it is, and so is a scene without terrain.

use crate::check::plan::{Part, Plan};
use crate::front::stop::Stop;
use crate::run::children::{self, Events, ask};
use interface_defs::diagnostic::code;
use rustix::process::getuid;
use std::ffi::OsString;
use std::fs::Permissions;
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use toml::Table;
use toolkit::arguments::Input;
use toolkit::files;
use toolkit::ground::Area;
use toolkit::scene::{Scene, at};

/// Name of the raster in the directory of a run.
pub const FILE: &str = "ground.asc";

/// The raster that was made for a scene, if it takes one; removed with it.
#[derive(Debug)]
pub struct Ground {
    input: Input,
    made: Option<Made>,
}

/// A raster in a file of its own, and the key of the scene that names it.
#[derive(Debug)]
struct Made {
    key: String,
    file: PathBuf,
    /// Where it lies.
    _scratch: Scratch,
}

impl Ground {
    /// That of `scene`, as it is loaded from `input`; its file lies in the directory `home` of the results, if there is one.
    pub fn of(
        scene: &Scene,
        plan: &Plan,
        input: &Input,
        home: Option<&Path>,
        events: &Events,
    ) -> Result<Self, Stop> {
        let mut ground = Self { input: input.clone(), made: None };
        let own = |part: Part| plan.members.iter().find(|m| m.part == part && !m.foreign);
        let (Some(structure), Some(rocks)) = (own(Part::Fem), own(Part::Dem)) else { return Ok(ground) };
        if !may_take_one(&scene.document()?) {
            return Ok(ground);
        }
        let Some(area) = area(&structure.program, input, events)? else { return Ok(ground) };
        let scratch = Scratch::new(home)?;
        let made = Made { key: area.wants.clone(), file: scratch.file(FILE), _scratch: scratch };
        let mut words: Vec<OsString> = vec!["ground".into()];
        words.extend(children::scene(input));
        words.extend(area.options().into_iter().map(OsString::from));
        words.extend(["-o".into(), made.file.clone().into_os_string()]);
        ask(&rocks.program, &words, events)?;
        let name = toml::Value::from(made.file.display().to_string());
        ground.input.sets.push(format!("{}={name}", made.key));
        ground.made = Some(made);
        Ok(ground)
    }

    /// The scene with the raster named in it.
    pub fn input(&self) -> &Input {
        &self.input
    }

    /// Write it to `file`, and name that in the resolved scene.
    pub fn keep(&self, file: &Path, resolved: &mut Table) -> io::Result<()> {
        let Some(made) = &self.made else { return Ok(()) };
        files::write(file, &files::read(&made.file, files::STATE)?)?;
        let absolute = std::path::absolute(file)?;
        name(resolved, &made.key, Some(&absolute.display().to_string()));
        Ok(())
    }

    /// Leave it out of the resolved scene: who runs that has it made again.
    pub fn forget(&self, resolved: &mut Table) {
        if let Some(made) = &self.made {
            name(resolved, &made.key, None);
        }
    }
}

/// Whether a scene has terrain, and a structure on a line, in a place or on the ground, without heights of its own: all others cost
/// nothing.
fn may_take_one(document: &Table) -> bool {
    let has = |key: &str| at(document, &format!("structure.{key}")).is_some();
    let stands = (has("generator.line") || has("generator.position")) && !has("generator.ground");
    let stands = stands || (has("place") && !has("place.ground"));
    document.contains_key("terrain") && (stands || (has("ground") && !has("ground.file")))
}

/// Write or remove a text at a dotted key.
fn name(table: &mut Table, key: &str, value: Option<&str>) {
    let (path, last) = key.rsplit_once('.').unwrap_or(("", key));
    let inner = path.split('.').try_fold(table, |table, key| table.get_mut(key)?.as_table_mut());
    match (inner, value) {
        (Some(table), Some(value)) => drop(table.insert(last.into(), value.into())),
        (Some(table), None) => drop(table.remove(last)),
        (None, _) => {}
    }
}

/// Where the structure's program needs heights for the scene.
pub fn area(program: &Path, input: &Input, events: &Events) -> Result<Option<Area>, Stop> {
    let words: Vec<OsString> = std::iter::once("site".into()).chain(children::scene(input)).collect();
    serde_json::from_str(&ask(program, &words, events)?).map_err(|e| {
        let what = format!("{} site: {e}; are all programs of one version?", program.display());
        Stop::failed(code::CONTRACT, what)
    })
}

/// It is removed with what is in it when this ends.
#[derive(Debug)]
pub struct Scratch {
    dir: TempDir,
    // Dropped after what lies in them.
    _made: Parents,
}

/// Directories that were not there before, the innermost first.
#[derive(Debug)]
struct Parents(Vec<PathBuf>);

impl Scratch {
    /// In the directory `home` of the results, which is made if it is not there; without one, or where others can write to it too,
    /// in that of this user for such files.
    pub fn new(home: Option<&Path>) -> Result<Self, Stop> {
        let place = home.map_or_else(of_user, Path::to_path_buf);
        Self::within(&place).map_err(|e| {
            Stop::input(code::FILE, format!("{}: nothing can be written here: {e}", place.display()))
        })
    }

    fn within(place: &Path) -> io::Result<Self> {
        let missing = place.ancestors().take_while(|dir| !dir.as_os_str().is_empty() && !dir.exists());
        let made = Parents(missing.map(Path::to_path_buf).collect());
        std::fs::create_dir_all(place)?;
        // Whoever can write to it can put another directory in the place of this one.
        let place = if is_closed(place) { place.to_owned() } else { of_user() };
        let own = Permissions::from_mode(0o700);
        let dir = tempfile::Builder::new()
            .prefix(".rockfall-")
            .permissions(own)
            .tempdir_in(std::path::absolute(place)?)?;
        Ok(Self { dir, _made: made })
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
}

impl Drop for Parents {
    fn drop(&mut self) {
        // One that holds something by now stays.
        self.0.iter().for_each(|dir| drop(std::fs::remove_dir(dir)));
    }
}

/// `$XDG_RUNTIME_DIR` if it is this user's, else the directory for temporary files.
fn of_user() -> PathBuf {
    let own = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|dir| is_closed(dir));
    own.unwrap_or_else(std::env::temp_dir)
}

/// Whether a directory is this user's, and nobody else can write to it.
fn is_closed(dir: &Path) -> bool {
    let closed =
        |it: std::fs::Metadata| it.is_dir() && it.uid() == getuid().as_raw() && it.mode() & 0o022 == 0;
    dir.metadata().is_ok_and(closed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_line_on_terrain_without_heights_takes_a_raster() {
        let takes = |text: &str| may_take_one(&text.parse().expect("TOML"));
        let line = "[structure.generator]\nline = [[0, 0], [1, 1]]\n";
        assert!(takes(&format!("[terrain]\n{line}")));
        assert!(takes("[terrain]\n[structure.generator]\nposition = [0, 0]\n"));
        assert!(!takes(line));
        assert!(!takes(&format!("[terrain]\n{line}ground = \"g.asc\"\n")));
        assert!(!takes("[terrain]\n[structure.generator]\ntype = \"barrier\"\n"));
        for table in ["ground", "place"] {
            assert!(
                takes(&format!("[terrain]\n[structure.{table}]\n"))
                    && !takes(&format!("[structure.{table}]\n"))
            );
        }
        assert!(!takes("[terrain]\n[structure.ground]\nfile = \"g.asc\"\n"));
    }

    #[test]
    fn the_resolved_scene_names_what_was_kept_and_nothing_else() {
        let mut table: Table = "a.b = { c = 1 }\nd = 2".parse().expect("TOML");
        let before = table.clone();
        name(&mut table, "a.b.file", Some("x.asc"));
        assert_eq!(table["a"]["b"]["file"].as_str(), Some("x.asc"));
        name(&mut table, "a.b.file", None);
        name(&mut table, "d.file", Some("x.asc"));
        name(&mut table, "e.file", Some("x.asc"));
        assert_eq!(table, before);
    }

    #[test]
    fn it_is_closed_to_others_and_leaves_nothing_behind() {
        let temp = tempfile::tempdir().expect("a directory");
        let home = temp.path().join("out/study");
        let scratch = Scratch::new(Some(&home)).expect("made");
        let file = scratch.file("member.toml");
        std::fs::write(&file, "x").expect("written");
        let dir = file.parent().expect("a directory").metadata().expect("there");
        assert_eq!((dir.mode() & 0o777, dir.uid()), (0o700, getuid().as_raw()));
        drop(scratch);
        assert!(!temp.path().join("out").exists());
        std::fs::create_dir(temp.path().join("out")).expect("made");
        let scratch = Scratch::new(Some(&home)).expect("made");
        std::fs::write(home.join("summary.json"), "x").expect("written");
        drop(scratch);
        let left: Vec<_> = std::fs::read_dir(&home).expect("kept").collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }

    #[test]
    fn two_of_one_directory_are_two() {
        let temp = tempfile::tempdir().expect("a directory");
        std::fs::set_permissions(temp.path(), Permissions::from_mode(0o755)).expect("set");
        let [one, other] = [0; 2].map(|_| Scratch::new(Some(temp.path())).expect("made"));
        assert_ne!(one.file("a"), other.file("a"));
        assert!(one.file("a").starts_with(temp.path()));
        std::fs::set_permissions(temp.path(), Permissions::from_mode(0o777)).expect("set");
        let elsewhere = Scratch::new(Some(temp.path())).expect("made");
        assert!(!elsewhere.file("a").starts_with(temp.path()), "others could put something else there");
    }
}
