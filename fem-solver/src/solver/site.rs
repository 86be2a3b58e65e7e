//! `fem-solver site`: where a scene needs heights of the terrain. `rockfall` asks it, and has them made.

use crate::config::StructureConfig;
use crate::config::generator::Generator;
use crate::model::generator::area;
use crate::model::ground;
use clap::{ArgMatches, Args, FromArgMatches};
use interface_defs::diagnostic::Diagnostic;
use toolkit::exit::Exit;
use toolkit::ground::{Area, SiteArguments};
use toolkit::program::Extra;
use toolkit::scene::Scene;
use toolkit::screen::show;

/// The subcommand.
pub const COMMAND: Extra = Extra { command, run };

fn command() -> clap::Command {
    SiteArguments::augment_args(
        clap::Command::new("site").hide(true).about("Print where heights of the terrain are needed (JSON)"),
    )
}

fn run(matches: &ArgMatches) -> Result<Exit, Diagnostic> {
    let arguments = SiteArguments::from_arg_matches(matches).map_err(|e| Diagnostic::new(e.to_string()))?;
    let area = of(&arguments.input.load()?)?;
    show(&serde_json::to_string(&area).expect("numbers and text are valid JSON"));
    Ok(Exit::Done)
}

/// The area in which the structure of `scene` needs heights that it does not name.
pub fn of(scene: &Scene) -> Result<Option<Area>, Diagnostic> {
    let Some(structure) = scene.read::<StructureConfig>("structure")? else { return Ok(None) };
    if let Some(Generator::Barrier(barrier)) = &structure.generator
        && barrier.is_placed()
        && barrier.ground.is_none()
        && let Some(area) = area(scene, barrier, structure.ground.is_some())?
    {
        return Ok(Some(area));
    }
    ground::area(scene, &structure)
}
