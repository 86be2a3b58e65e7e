//! `rockfall export`: the structure of a scene as a file of another program.
//!
//! The structure's own program says what there is, as `structure.json`; the formats of other programs are written from it by the adapter
//! in Python, which this program has in itself, so that it is found wherever this one lies.

use crate::check::ground::Ground;
use crate::check::plan::own_program;
use crate::check::prepared;
use crate::front::stop::Stop;
use crate::run::children::{self, Events, Job, Rules};
use interface_defs::diagnostic::{Diagnostic, code};
use serde::Deserialize;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use toolkit::arguments::{ExportArguments, StructureArguments};
use toolkit::exit::Exit;
use toolkit::files;
use toolkit::screen::show;

/// Writes the formats of other programs from `structure.json`.
const WRITERS: &str = include_str!("../adapters/export/writers.py");

/// The extension of `structure.json` itself.
const NEUTRAL: &str = "json";
/// Extensions of the formats that are written from it.
const FORMATS: [&str; 3] = ["inp", "mdpa", "msh"];

/// What of `structure.json` is said on the screen.
#[derive(Deserialize)]
struct Said {
    nodes: Vec<serde::de::IgnoredAny>,
    elements: Vec<serde::de::IgnoredAny>,
    node_sets: Vec<serde::de::IgnoredAny>,
    element_sets: Vec<serde::de::IgnoredAny>,
    left_out: Vec<String>,
    warnings: Vec<String>,
}

/// Have it written, on the heights of the terrain where the structure stands on them.
pub fn export(arguments: &ExportArguments) -> Result<Exit, Stop> {
    let ExportArguments { structure: StructureArguments { input, at_rest }, to } = arguments;
    let format = format_of(to)?;
    let events = Events::watch()?;
    if format != NEUTRAL {
        // Before the form of a large net is found, which takes minutes.
        python(&["-V"], None, to, &events)?;
    }
    let (scene, plan) = prepared::load(input)?;
    let ground = Ground::of(&scene, &plan, input, None, &events)?;
    let mut words: Vec<OsString> = vec!["export".into()];
    words.extend(at_rest.then(|| "--at-rest".into()));
    words.extend(children::scene(ground.input()));
    let mut command = Command::new(own_program("fem-solver")?);
    command.args(words);
    let doing = if *at_rest { "finding the form of the structure" } else { "writing the structure" };
    let mut text = children::ask_saying(doing, command, &events)?;
    let said: Said = serde_json::from_str(&text)
        .map_err(|e| Stop::failed(code::PROCESS, format!("fem-solver has not printed a structure: {e}")))?;
    let mut lost = said.left_out;
    if format != NEUTRAL {
        let also;
        (text, also) = python(&["-c", WRITERS, format], Some(text.into_bytes()), to, &events)?;
        lost.extend(also.lines().map(str::to_owned));
    }
    files::write(to, text.as_bytes())
        .map_err(|e| Diagnostic::in_file(to.display(), format!("it cannot be written: {e}")))?;
    let sets = said.node_sets.len() + said.element_sets.len();
    let counts = format!("{} nodes, {} elements, {sets} sets", said.nodes.len(), said.elements.len());
    let mut shown = format!("{}: {counts}\n", to.display());
    let lost = lost.iter().map(|what| format!("not in this file: {what}"));
    for warning in said.warnings.into_iter().chain(lost) {
        let _ = writeln!(shown, "warning: {warning}");
    }
    show(&shown);
    Ok(Exit::Done)
}

/// The format that the extension of `to` says.
fn format_of(to: &Path) -> Result<&'static str, Diagnostic> {
    let extension = to.extension().and_then(|own| own.to_str()).unwrap_or_default().to_ascii_lowercase();
    let found = FORMATS.into_iter().chain([NEUTRAL]).find(|format| *format == extension);
    found.ok_or_else(|| {
        let what = "its name does not say what kind of file to write";
        let known =
            "known are .msh (Gmsh), .inp (CalculiX, Abaqus), .mdpa (Kratos) and .json (structure.json)";
        Diagnostic::in_file(to.display(), what).try_instead(known)
    })
}

/// What `python3` prints, and what it says on standard error, for the file `to`; of the user's own packages and variables it sees none.
fn python(
    words: &[&str],
    input: Option<Vec<u8>>,
    to: &Path,
    events: &Events,
) -> Result<(String, String), Stop> {
    let mut command = Command::new("python3");
    command.arg("-I").args(words);
    let job = Job { input, name: "python3".into(), ..Job::of(command) };
    let (end, _) = children::one(job, Rules::default(), events).map_err(|stop| {
        stop.hinted(
            "install Python 3.8 or later; or write --to structure.json here, and where there is python3: \
             launch/adapters/export/writers.py inp <structure.json >net.inp",
        )
    })?;
    let said = String::from_utf8_lossy(&end.stderr).into_owned();
    match end.exit() {
        Exit::BadInput => {
            let hint = "rename it in the scene or its mesh, or write another format";
            let refused = Diagnostic::in_file(to.display(), said.trim_end()).coded(code::UNKNOWN_NAME);
            Err(refused.try_instead(hint).into())
        }
        _ => Ok((end.text()?, said)),
    }
}
