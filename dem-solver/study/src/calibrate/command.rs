//! `dem-solver calibrate`: a calibration from its file to its results.

use super::{CALIBRATION, Calibration};
use crate::command::{Study, no_study};
use crate::directory::Directory;
use clap::{ArgMatches, Args, FromArgMatches};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::ipc::interrupt;
use serde_json::json;
use toolkit::arguments::CalibrateArguments;
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::program::Extra;
use toolkit::scene::Scene;
use toolkit::screen::show;

/// The subcommand.
pub const COMMAND: Extra = Extra {
    command: || {
        CalibrateArguments::augment_args(
            clap::Command::new("calibrate")
                .bin_name("rockfall calibrate")
                .about("Parameters from observed falls: their ranges, what the data do not settle, and what is predicted"),
        )
    },
    run,
};

fn run(matches: &ArgMatches) -> Result<Exit, Diagnostic> {
    let mut arguments =
        CalibrateArguments::from_arg_matches(matches).map_err(|e| Diagnostic::new(e.to_string()))?;
    let json = arguments.answer.format == Format::Json;
    arguments.computation.quiet |= json;
    let ended = calibrate(&arguments, json);
    if let (true, Err(e)) = (json, &ended) {
        show(&format!("{}\n", json!({ "errors": [e] })));
    }
    ended
}

fn calibrate(arguments: &CalibrateArguments, json: bool) -> Result<Exit, Diagnostic> {
    let file = Scene::load_as(&CALIBRATION, &arguments.file, &arguments.sets)
        .map_err(|e| no_study(&arguments.file, CALIBRATION.name).unwrap_or(e))?;
    let computation = &arguments.computation;
    let directory = Directory::new(&computation.dir.of(&file));
    let calibration = Calibration::of(file, json)?;
    let base = calibration.base(!computation.savings.no_shortcuts, &directory)?;
    let study = Study::new(base, directory, computation).compared(&calibration);
    if !computation.quiet {
        study.warn();
    }
    interrupt::install();
    study.whole(&calibration.study)
}
