//! `fem-solver export`: the structure of a scene as a document on standard output, which `rockfall export` asks for.

use crate::export::deck::Deck;
use clap::{ArgMatches, Args, FromArgMatches};
use interface_defs::diagnostic::Diagnostic;
use toolkit::arguments::StructureArguments;
use toolkit::exit::Exit;
use toolkit::program::Extra;
use toolkit::screen::show;

/// The subcommand.
pub const COMMAND: Extra = Extra { command, run };

fn command() -> clap::Command {
    StructureArguments::augment_args(
        clap::Command::new("export").about("Print the structure of a scene as structure.json"),
    )
}

fn run(matches: &ArgMatches) -> Result<Exit, Diagnostic> {
    let StructureArguments { input, at_rest } =
        StructureArguments::from_arg_matches(matches).map_err(|e| Diagnostic::new(e.to_string()))?;
    let deck = Deck::of(&input.load()?, at_rest)?;
    let text = serde_json::to_string(&deck).map_err(|e| Diagnostic::new(e.to_string()))?;
    show(&(text + "\n"));
    Ok(Exit::Done)
}
