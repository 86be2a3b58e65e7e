//! `rockfall new`: a directory with scenes that run, and the commands to go on with. Nothing that is there is overwritten.

mod site;
mod solver;

use crate::front::shell;
use crate::front::stop::Stop;
use clap::Args;
use interface_defs::diagnostic::code;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use toolkit::exit::Exit;
use toolkit::files::{self, Dir};
use toolkit::screen::show;

/// What the command line asks for.
#[derive(Debug, Args)]
pub struct NewArguments {
    /// Directory to make; it may be there, and none of the files
    pub dir: PathBuf,
    /// The Walenstadt drop test: a concrete cube falls on a wire net
    #[arg(long, group = "kind")]
    drop_test: bool,
    /// A rock falls on the net of this mesh (.msh, .inp, .mdpa)
    #[arg(long, value_name = "MESH", group = "kind")]
    net: Option<PathBuf>,
    /// A solver of your own, from a template: c, cpp, fortran, python or rust
    #[arg(long, value_name = "LANGUAGE", group = "kind", value_parser = solver::LANGUAGES)]
    solver: Option<String>,
    #[command(flatten)]
    site: site::SiteArguments,
}

/// A file to write, by its name in the directory, and the commands that come next.
struct Project {
    files: Vec<(&'static str, String)>,
    next: Vec<String>,
}

/// Write the files.
pub fn new(request: &NewArguments) -> Result<Exit, Stop> {
    let dir = &request.dir;
    let file = |name: &str| shell::join([dir.join(name)]);
    let project = if request.drop_test {
        let scene = include_str!("../../scenes/walenstadt-exp1.toml");
        Project {
            files: vec![("drop-test.toml", scene.into())],
            next: vec![format!("rockfall run {}", file("drop-test.toml"))],
        }
    } else if let Some(mesh) = &request.net {
        let scene = fill(
            include_str!("net.toml"),
            &[("MESH", quoted(&from(dir, mesh)?)), ("TITLE", title("A rock falls on ", mesh))],
        );
        let scene_file = file("scene.toml");
        Project {
            files: vec![("scene.toml", scene)],
            next: ["check", "run"].map(|verb| format!("rockfall {verb} {scene_file}")).into(),
        }
    } else if let Some(language) = &request.solver {
        let readme = format!("cd {} # README.md says what it needs", shell::join([dir]));
        let next = vec![readme, "make test".into(), "rockfall run scene.toml".into()];
        Project { files: solver::files(language), next }
    } else {
        site::project(dir, request.site.completed(&mut ask)?)?
    };
    write(dir, &project)?;
    let names: Vec<&str> = project.files.iter().map(|(name, _)| *name).collect();
    show(&format!("{}: {}\n\n", dir.display(), names.join(", ")));
    project.next.iter().for_each(|line| show(&format!("  {line}\n")));
    Ok(Exit::Done)
}

/// All files, or none where one of them is there.
fn write(dir: &Path, project: &Project) -> Result<(), Stop> {
    const IGNORED: &str = ".gitignore";
    let ignore = [(IGNORED, "out/\n".to_owned())];
    let there = dir.join(IGNORED).exists();
    let all = || project.files.iter().chain(ignore.iter().filter(|_| !there));
    if let Some((name, _)) = all().find(|(name, _)| dir.join(name).exists()) {
        let what = format!("{} is there already; nothing was written", dir.join(name).display());
        return Err(Stop::input(code::FILE, what + "; choose another directory"));
    }
    let refused = |e| Stop::input(code::FILE, format!("{}: it cannot be written to: {e}", dir.display()));
    Dir::create(dir).map_err(refused)?;
    all().try_for_each(|(name, text)| files::write(&dir.join(name), text.as_bytes()).map_err(refused))
}

/// A question on the terminal; `None`: there is nobody to ask, or no answer.
fn ask(question: &str) -> Option<String> {
    if !std::io::stdin().is_terminal() || !std::io::stderr().is_terminal() {
        return None;
    }
    eprint!("{question}: ");
    let _ = std::io::stderr().flush();
    let mut answer = String::new();
    std::io::stdin().lock().read_line(&mut answer).ok()?;
    let answer = answer.trim();
    (!answer.is_empty()).then(|| answer.to_owned())
}

/// A template with its places `@KEY@` filled in.
pub fn fill(template: &str, values: &[(&str, String)]) -> String {
    values.iter().fold(template.to_owned(), |text, (key, value)| text.replace(&format!("@{key}@"), value))
}

/// A title, as TOML text, that ends with the name of a file.
fn title(text: &str, file: &Path) -> String {
    quoted(&(text.to_owned() + &file.file_stem().unwrap_or_default().to_string_lossy()))
}

/// As TOML text.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// The name of a file in a scene of the directory `dir`: from there where it lies in it, else as a whole.
fn from(dir: &Path, file: &Path) -> Result<String, Stop> {
    let absolute = |path: &Path| {
        let refused = |e| Stop::input(code::FILE, format!("{}: {e}", path.display()));
        std::path::absolute(path).map_err(refused)
    };
    if !file.is_file() {
        return Err(Stop::input(code::FILE, format!("{}: there is no such file", file.display())));
    }
    let (dir, file) = (absolute(dir)?, absolute(file)?);
    Ok(file.strip_prefix(&dir).unwrap_or(&file).display().to_string())
}
