//! Which programs a scene requires: presence decides; and where they are.

use interface_defs::diagnostic::{Diagnostic, code};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use toolkit::processes::Processes;
use toolkit::scene::Scene;

interface_defs::worded! {
    /// A part in a run, and its name there, in `[processes]` and of its log.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Part with name {
        /// Rocks and contact.
        Dem = "dem",
        /// The structure.
        Fem = "fem",
        /// Who couples the two.
        Coupler = "coupler",
    }
}

impl Part {
    /// This project's program for it.
    fn program(self) -> &'static str {
        match self {
            Self::Dem => "dem-solver",
            Self::Fem => "fem-solver",
            Self::Coupler => "coupler",
        }
    }
}

/// A program that takes part.
#[derive(Debug, Clone)]
pub struct Member {
    /// Its part.
    pub part: Part,
    /// Program file.
    pub program: PathBuf,
    /// Arguments that the scene names.
    pub arguments: Vec<String>,
    /// Whether the scene names it: then its tables are its own business.
    pub foreign: bool,
}

/// Who takes part, the coupler first if there is one.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The programs.
    pub members: Vec<Member>,
    /// `[processes]`
    pub processes: Processes,
}

impl Plan {
    /// What `scene` requires. A program that is not there is bad input.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        let processes = Processes::of(scene)?;
        let dem = scene.has("rock") || scene.has("spheres") || processes.dem.is_some();
        let fem = scene.has("structure") || processes.fem.is_some();
        let parts: &[Part] = match (dem, fem) {
            (true, true) => &[Part::Coupler, Part::Dem, Part::Fem],
            (true, false) => &[Part::Dem],
            (false, true) => &[Part::Fem],
            (false, false) => {
                let what = "the scene has neither a rock nor a structure: nothing would run";
                let nothing = Diagnostic::in_file(scene.path().display(), what);
                return Err(nothing.try_instead("add [[rock]], [structure] or both"));
            }
        };
        unused(scene, &processes)?;
        let members = parts.iter().map(|part| member(*part, &processes, scene)).collect::<Result<_, _>>()?;
        Ok(Self { members, processes })
    }

    /// Whether two solvers are coupled.
    pub fn is_coupled(&self) -> bool {
        self.members.len() > 1
    }
}

/// Refuse a table that no program will use. The tables of a solver that the scene names are its own business.
fn unused(scene: &Scene, processes: &Processes) -> Result<(), Diagnostic> {
    let dem = processes.dem.is_some();
    let fem = processes.fem.is_some() || scene.has("structure");
    let (rock, spheres) = (scene.has("rock"), scene.has("spheres"));
    let several =
        scene.read::<Vec<toml::Value>>("rock").is_ok_and(|rocks| rocks.is_some_and(|r| r.len() > 1));
    let touches = spheres || scene.has("terrain") || scene.has("box") || fem || several;
    let bodies = dem || rock || spheres;
    let both = bodies && fem;
    let (no_body, one_side) = (
        "the scene has neither [[rock]] nor [[spheres]]",
        "it takes a rock and a structure, and the scene has one of them",
    );
    let untouched = "there is nothing that the rock could touch";
    let all: &[(&str, bool, &str, &str)] = &[
        ("box", bodies, no_body, "add [[rock]]"),
        ("terrain", bodies, no_body, "add [[rock]]"),
        ("dem", bodies, no_body, "add [[rock]]"),
        ("contact", bodies, no_body, "add [[rock]]"),
        ("contact", dem || touches, untouched, "add [terrain], [box], [structure] or a second [[rock]]"),
        ("gauge", fem, "the scene has no [structure] to measure", "add [structure]"),
        ("fem", fem, "the scene has no [structure]", "add [structure]"),
        ("start_from", fem, "the scene has no [structure] that could start from a run", "add [structure]"),
        ("coupling", both, one_side, "add the other"),
        ("processes.coupler", both, one_side, "add the other"),
    ];
    let there = |key: &str| match key.split_once('.') {
        Some(_) => processes.coupler.is_some(),
        None => scene.has(key),
    };
    let found = all.iter().find(|(key, used, ..)| !used && there(key));
    let Some((key, _, why, cure)) = found else { return Ok(()) };
    let name = match *key {
        "contact" | "gauge" => format!("[[{key}]]"),
        "processes.coupler" | "start_from" => format!("`{key}`"),
        _ => format!("[{key}]"),
    };
    let unused = scene.invalid(key, format!("nothing will use {name}: {why}"));
    Err(unused.try_instead(format!("{cure}, or leave {name} out")))
}

fn member(part: Part, processes: &Processes, scene: &Scene) -> Result<Member, Diagnostic> {
    let named = match part {
        Part::Dem => &processes.dem,
        Part::Fem => &processes.fem,
        Part::Coupler => &processes.coupler,
    };
    let Some(line) = named else {
        let program = own_program(part.program())?;
        return Ok(Member { part, program, arguments: Vec::new(), foreign: false });
    };
    let refuse = |what: String| {
        let cure = "a name with / counts from the directory of the scene, as in fem = \"./my-solver --option 3\"; or leave the \
                    key out for this project's own program";
        scene.invalid(&format!("processes.{}", part.name()), what).try_instead(cure)
    };
    let mut words = crate::front::shell::split(line).map_err(refuse)?.into_iter();
    let name = words.next().unwrap_or_default();
    let base = scene.path().parent().unwrap_or(Path::new(""));
    // Absolute, so that the command line in the record can be run from anywhere.
    let program = find(&name, base).and_then(|path| std::path::absolute(path).map_err(|e| e.to_string()));
    Ok(Member { part, program: program.map_err(refuse)?, arguments: words.collect(), foreign: true })
}

/// The program file that `name` means: with a `/` counted from `base`, else beside this program or
/// on the search path. `Err` says where it was looked for.
fn find(name: &str, base: &Path) -> Result<PathBuf, String> {
    if name.contains('/') {
        let path = base.join(name);
        return match path.exists() {
            _ if is_program(&path) => Ok(path),
            true => Err(format!("{} is not a program that may be started", path.display())),
            false => Err(format!("there is no program {}", path.display())),
        };
    }
    let own = own_directory();
    let search = std::env::var_os("PATH").unwrap_or_default();
    let places = own.iter().cloned().chain(std::env::split_paths(&search));
    places.map(|dir| dir.join(name)).find(|path| is_program(path)).ok_or_else(|| {
        let own = own.map_or(String::new(), |dir| format!(" in {} or", dir.display()));
        format!("there is no program {name}{own} on the search path")
    })
}

/// A program of this project: beside this one.
pub fn own_program(name: &str) -> Result<PathBuf, Diagnostic> {
    let missing = |what: String| {
        Diagnostic::error(code::FILE, what).try_instead("build all programs with cargo build --release")
    };
    let dir = own_directory().ok_or_else(|| missing("the directory of this program is unknown".into()))?;
    let path = dir.join(name);
    let absent =
        || format!("the program {name} is missing: it belongs beside this one, in {}", dir.display());
    if is_program(&path) { Ok(path) } else { Err(missing(absent())) }
}

fn own_directory() -> Option<PathBuf> {
    std::env::current_exe().ok()?.parent().map(Path::to_path_buf)
}

fn is_program(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| m.is_file() && m.permissions().mode() & 0o111 != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(text: &str) -> Result<Vec<&'static str>, String> {
        // Own programs need not lie beside the test: name others, which are there.
        let scene = Scene::from_text("s.toml", text).map_err(|e| e.to_string())?;
        let plan = Plan::of(&scene).map_err(|e| e.to_string())?;
        Ok(plan.members.iter().map(|m| m.part.name()).collect())
    }

    #[test]
    fn presence_decides_who_takes_part() {
        assert_eq!(parts("processes.dem = \"sh\""), Ok(vec!["dem"]));
        assert_eq!(parts("[structure]\n[processes]\nfem = \"sh\""), Ok(vec!["fem"]));
        let both = "[[rock]]\n[coupling]\n[processes]\ndem = \"sh\"\nfem = \"sh -c 'x y'\"\ncoupler = \"sh\"";
        assert_eq!(parts(both), Ok(vec!["coupler", "dem", "fem"]));
        let error = parts("end_time = 1").expect_err("nothing");
        assert!(error.starts_with("s.toml: the scene has neither a rock nor a structure"), "{error}");
    }

    /// Parts need not be there: what nothing will use is found before they are looked for.
    #[test]
    fn a_table_that_nothing_will_use_is_refused_where_it_stands() {
        let rock = "[[rock]]\n";
        let dem = "[processes]\ndem = \"sh\"\n";
        let fem = "[structure]\n";
        let both = "[structure]\n[coupling]\n";
        for (text, place, what) in [
            (format!("{fem}[box]\n"), "2:1", "nothing will use [box]: the scene has neither"),
            (format!("{fem}[terrain]\n"), "2:1", "nothing will use [terrain]: the scene has neither"),
            (format!("{fem}[dem]\n"), "2:1", "nothing will use [dem]"),
            (format!("{fem}[[contact]]\n"), "2:1", "nothing will use [[contact]]: the scene has neither"),
            (format!("{rock}[[contact]]\n"), "2:1", "nothing that the rock could touch"),
            (format!("{rock}[[gauge]]\n"), "2:1", "nothing will use [[gauge]]: the scene has no [structure]"),
            (format!("{rock}[fem]\n"), "2:1", "nothing will use [fem]"),
            (format!("start_from = \"out/a\"\n{rock}"), "1:14", "nothing will use `start_from`"),
            (format!("{rock}[coupling]\n"), "2:1", "nothing will use [coupling]"),
            (format!("{fem}[coupling]\n"), "2:1", "nothing will use [coupling]"),
            (
                format!("{rock}[processes]\ncoupler = \"sh\"\n"),
                "3:11",
                "nothing will use `processes.coupler`",
            ),
            (format!("{dem}[gauge]\n"), "3:1", "nothing will use [[gauge]]"),
        ] {
            let error = parts(&text).expect_err(&text);
            assert!(error.starts_with(&format!("s.toml:{place}: ")) && error.contains(what), "{error}");
            assert!(error.contains("or leave "), "{error}");
        }
        // What a named program takes is its own business.
        for tables in ["[terrain]\n[box]\n[dem]\n[[contact]]\n", "[[rock]]\n[[contact]]\n"] {
            assert_eq!(parts(&format!("{dem}{tables}")), Ok(vec!["dem"]));
        }
        let foreign = "[processes]\ndem = \"sh\"\nfem = \"sh\"\ncoupler = \"sh\"\n";
        let tables = "[[gauge]]\n[fem]\n[coupling]\n[custom]\n[terrain]\n";
        assert_eq!(parts(&format!("{foreign}{tables}")), Ok(vec!["coupler", "dem", "fem"]));
        for used in [
            format!("{rock}{rock}[[contact]]\n"),
            format!("{rock}[[contact]]\n[terrain]\n"),
            format!("{rock}[[contact]]\n{both}"),
            format!("{rock}[box]\n[[contact]]\n"),
            "[[spheres]]\n[terrain]\n[[contact]]\n".to_owned(),
        ] {
            let said = parts(&used).err().unwrap_or_default();
            assert!(!said.contains("nothing will use"), "{said}");
        }
    }

    #[test]
    fn a_program_that_is_not_there_is_refused_at_its_line() {
        let error = parts("[processes]\nfem = \"./no-such --k 3\"").expect_err("missing");
        assert!(error.starts_with("s.toml:2:7: there is no program ./no-such"), "{error}");
        let error = parts("[processes]\nfen = \"sh\"").expect_err("unknown");
        assert!(error.contains("did you mean `fem`?"), "{error}");
        let error = parts("[processes]\nfem = \"sh\"\ntimeout = 0").expect_err("none");
        assert!(error.starts_with("s.toml:3:11: a deadline of 0 s"), "{error}");
        let error = parts("[processes]\nfem = \"sh\"\nwait = \"evnt\"").expect_err("unknown");
        assert!(error.contains("did you mean `event`?"), "{error}");
    }

    #[test]
    fn a_program_that_is_not_there_is_named_with_the_place() {
        assert!(find("./no-such", Path::new("/scenes")).expect_err("none").contains("/scenes/./no-such"));
        assert!(find("no-such-program-9f", Path::new("")).expect_err("none").contains("no-such-program-9f"));
        assert!(find("/etc/passwd", Path::new("")).expect_err("no program").contains("not a program"));
        assert!(find("sh", Path::new("")).is_ok());
    }
}
