//! `rockfall export`: the structure of a scene as a file of another program, which the structure's own program writes.

use crate::children::{self, Events};
use crate::ground::Ground;
use crate::plan::own_program;
use crate::prepared;
use crate::stop::Stop;
use std::ffi::OsString;
use std::process::Command;
use toolkit::arguments::ExportArguments;
use toolkit::exit::Exit;
use toolkit::screen::show;

/// Have it written, on the heights of the terrain where the structure stands on them.
pub fn export(arguments: &ExportArguments) -> Result<Exit, Stop> {
    let ExportArguments { input, to, at_rest } = arguments;
    let events = Events::watch()?;
    let (scene, plan) = prepared::load(input)?;
    let ground = Ground::of(&scene, &plan, input, None, &events)?;
    let mut words: Vec<OsString> = vec!["export".into(), "--to".into(), to.into()];
    words.extend(at_rest.then(|| "--at-rest".into()));
    words.extend(children::scene(ground.input()));
    let mut command = Command::new(own_program("fem-solver")?);
    command.args(words);
    let doing = if *at_rest { "finding the form of the structure" } else { "writing the structure" };
    show(&children::ask_saying(doing, command, &events)?);
    Ok(Exit::Done)
}
