//! Heights of the terrain for a structure that stands or lies on it and names none: where they are needed the structure's program
//! says, and the rocks' program writes them.
//!
//! Neither of the two knows the other. What a scene names itself is left as it is, and so is a scene without terrain.

use crate::children::{self, ask};
use crate::events::Events;
use crate::plan::{Part, Plan};
use crate::scratch::Scratch;
use crate::stop::Stop;
use interface_defs::diagnostic::code;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use toml::Table;
use toolkit::arguments::Input;
use toolkit::files;
use toolkit::ground::Area;
use toolkit::scene::Scene;

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
    let table = |key: &str| document.get("structure").and_then(|s| s.get(key));
    let has = |of: &str, key: &str| table(of).is_some_and(|t| t.get(key).is_some());
    let stands = (has("generator", "line") || has("generator", "position")) && !has("generator", "ground");
    let stands = stands || (table("place").is_some() && !has("place", "ground"));
    document.contains_key("terrain") && (stands || (table("ground").is_some() && !has("ground", "file")))
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
}
