//! `rockfall conform`: whether a program keeps the interface contract, clause by clause.

use crate::check::plan::Part;
use crate::check::prepared::Prepared;
use crate::front::stop::{Stop, write};
use crate::run::children::{self, Destination, Events, Job, Rules, how};
use crate::run::record;
use crate::run::verdict::quote;
use clap::{Args, ValueEnum};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc::{self, RunId};
use std::path::{Path, PathBuf};
use std::process::Command;
use toolkit::arguments::{AnswerForm, Input, path};
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::files::Dir;
use toolkit::run_dir;
use toolkit::screen::show;

/// The scene that is run where none is named.
const SCENE: &str = include_str!("conform.toml");

/// A part that a program can take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Role {
    /// Contact solver
    Dem,
    /// Structure
    Fem,
}

/// What the command line asks for.
#[derive(Debug, Args)]
pub struct ConformArguments {
    /// Part that the program takes
    #[arg(long, value_enum)]
    role: Role,
    /// Scene whose data and partner are used [default: a small net, hit by a sphere or pressed on]
    #[arg(long, value_name = "SCENE", value_parser = path())]
    scene: Option<PathBuf>,
    /// Set a value of the scene, as in --set coupling.samples=4
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true)]
    sets: Vec<String>,
    #[command(flatten)]
    answer: AnswerForm,
    /// The program with its arguments; `serve SCENE --run ID --as ROLE ...` is added
    #[arg(last = true, required = true, value_name = "COMMAND")]
    command: Vec<String>,
}

/// Start the program with a partner and a coupler that examines it, and show what that found.
pub fn conform(request: &ConformArguments) -> Result<Exit, Stop> {
    let events = Events::watch()?;
    let scratch = tempfile::tempdir().map_err(|e| {
        Stop::failed(code::NOT_WRITTEN, format!("a directory for the run cannot be made: {e}"))
    })?;
    let dir = scratch.path();
    let scene = match &request.scene {
        Some(scene) => scene.clone(),
        None => {
            let scene = dir.join("conform.toml");
            write(&scene, SCENE)?;
            scene
        }
    };
    let part = if request.role == Role::Dem { Part::Dem } else { Part::Fem };
    let mut words = request.command.clone();
    if words[0].contains('/') {
        // In a scene a path counts from the directory of the scene.
        words[0] = children_path(&words[0])?;
    }
    let line = toml::Value::from(crate::front::shell::join(words));
    let mut sets = request.sets.clone();
    sets.push(format!("processes.{}={line}", part.name()));
    let prepared = Prepared::of(&Input { scene, sets }, |_| None, &events)?;
    if !prepared.plan.is_coupled() {
        let what = format!("--scene: it takes no other part than {}, and nothing is coupled", part.name());
        return Err(Stop::input(code::ARGUMENT, what));
    }
    let run = RunId::new();
    let file = dir.join(run_dir::SCENE);
    let mut resolved = prepared.resolved()?;
    let failed = |e| Stop::failed(code::NOT_WRITTEN, format!("{}: cannot be written: {e}", dir.display()));
    prepared.ground.keep(&dir.join(crate::check::ground::FILE), &mut resolved).map_err(failed)?;
    record::write_scene(&file, &prepared.scene, &resolved, Some(&run)).map_err(failed)?;
    let log = dir.join(run_dir::LOG);
    Dir::create(&log).map_err(failed)?;
    let _ = ipc::clean();

    // Without a scene of its own a structure is pressed on by the coupler itself.
    let alone = request.scene.is_none() && part == Part::Fem;
    let members = prepared.plan.members.iter().filter(|member| !alone || member.part != Part::Dem);
    let jobs = members.map(|member| {
        let leads = member.part == Part::Coupler;
        let mut command = Command::new(&member.program);
        command.args(&member.arguments).arg(if leads { "conform" } else { "serve" }).arg(&file);
        command.arg("--run").arg(run.as_str());
        command.arg("--supervisor").arg(std::process::id().to_string());
        let name = member.part.name();
        if leads {
            command.arg("--role").arg(part.name()).args(alone.then_some("--alone"));
            command.args((request.answer.format == Format::Json).then_some("--format=json"));
            return Job { name: name.into(), ..Job::of(command) };
        }
        command.arg("--as").arg(name).arg("--out").arg(dir.join("out"));
        command.arg("--timeout").arg(prepared.plan.processes.timeout.to_string());
        let output = Destination::Log { file: children::log_file(&log, name), progress: false };
        Job { name: name.into(), command, input: None, output }
    });
    let rules =
        Rules { together: true, hurry: true, grace: Some(children::GRACE_OF_LEADER), ..Rules::default() };
    let outcome = children::watch(jobs.collect(), rules, &events)?;
    if outcome.interrupted {
        return Err(Stop::interrupted());
    }
    let ended = |name: &str| outcome.ends.iter().find(|end| end.name == name);
    let Some(leader) = ended(Part::Coupler.name()) else { return Err(Stop::interrupted()) };
    show(&String::from_utf8_lossy(&leader.stdout));
    match (leader.exit(), ended(part.name())) {
        (exit, _) if !leader.stdout.is_empty() => Ok(exit),
        // Who has left before the coupler could see it.
        (_, Some(end)) if leader.forced || leader.errors.is_empty() => {
            let what =
                format!("{} ended before it joined: {}{}", end.name, how(end.status), quote(&log, &end.name));
            Err(Stop::failed(code::PROCESS, what))
        }
        (exit, _) => Err(Stop { exit, errors: leader.reasons() }),
    }
}

/// A path as it counts from here.
fn children_path(name: &str) -> Result<String, Diagnostic> {
    let absolute = std::path::absolute(Path::new(name));
    let absolute = absolute.map_err(|e| Diagnostic::error(code::FILE, format!("{name}: {e}")))?;
    Ok(absolute.display().to_string())
}
