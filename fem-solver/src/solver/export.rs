//! `fem-solver export`: the structure of a scene as a file of another program.

use crate::write::deck::Deck;
use crate::write::write;
use clap::{ArgMatches, Args, FromArgMatches};
use interface_defs::diagnostic::Diagnostic;
use std::fmt::Write;
use toolkit::arguments::ExportArguments;
use toolkit::exit::Exit;
use toolkit::files;
use toolkit::program::Extra;
use toolkit::screen::show;

/// The subcommand.
pub const COMMAND: Extra = Extra { command, run };

fn command() -> clap::Command {
    ExportArguments::augment_args(
        clap::Command::new("export")
            .bin_name("rockfall export")
            .about("Write the structure of a scene for CalculiX or Abaqus, Kratos, or Gmsh"),
    )
}

fn run(matches: &ArgMatches) -> Result<Exit, Diagnostic> {
    let ExportArguments { input, to, at_rest } =
        ExportArguments::from_arg_matches(matches).map_err(|e| Diagnostic::new(e.to_string()))?;
    let (deck, warnings) = Deck::of(&input.load()?, at_rest)?;
    let (text, lost) = write(&deck, &to)?;
    files::write(&to, text.as_bytes())
        .map_err(|e| Diagnostic::in_file(to.display(), format!("it cannot be written: {e}")))?;
    let (nodes, elements, sets) =
        (deck.nodes.len(), deck.elements.len(), deck.node_sets.len() + deck.element_sets.len());
    let mut said = format!("{}: {nodes} nodes, {elements} elements, {sets} sets\n", to.display());
    let lost = lost.iter().map(|what| format!("not in this file: {what}"));
    for warning in warnings.iter().map(ToString::to_string).chain(lost) {
        let _ = writeln!(said, "warning: {warning}");
    }
    show(&said);
    Ok(Exit::Done)
}
