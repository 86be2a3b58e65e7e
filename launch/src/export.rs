//! `rockfall export`: the structure of a scene as a file of another program, which the structure's own program writes.

use crate::children::{self, Events, ask};
use crate::ground::Ground;
use crate::plan::own_program;
use crate::prepared;
use crate::stop::Stop;
use std::ffi::OsString;
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
    show(&ask(&own_program("fem-solver")?, &words, &events)?);
    Ok(Exit::Done)
}
