//! The schema of a whole scene: what each program says of its tables, put together; and that of a study.

use crate::children;
use crate::command_line::own_program;
use crate::events::Events;
use crate::stop::Stop;
use interface_defs::diagnostic::code;
use serde_json::Value;
use toolkit::processes::Processes;
use toolkit::schema::{Share, Tables};

/// Programs with tables of their own.
const PROGRAMS: [&str; 3] = ["dem-solver", "fem-solver", "coupler"];

/// Ask every program of this project for its share.
pub fn share() -> Result<Share, Stop> {
    let mut all = Tables::common().key::<Processes>("processes").share();
    for program in PROGRAMS {
        all.merge(ask(program, "schema")?).map_err(|name| {
            let what = format!("{program} and another program describe `{name}` differently");
            Stop::failed(code::NAME_TAKEN, what)
        })?;
    }
    Ok(all)
}

/// Ask the rocks' program, which computes studies, for the keys of one.
pub fn study() -> Result<Share, Stop> {
    ask("dem-solver", "study-schema")
}

fn ask(program: &str, command: &str) -> Result<Share, Stop> {
    let text = children::ask(&own_program(program)?, &[command.into()], &Events::watch()?)?;
    Share::from_json(&text).map_err(|e| {
        let what = format!("{program} {command}: {e}; are all programs of one version?");
        Stop::failed(code::CONTRACT, what)
    })
}

/// As JSON text.
pub fn text(document: &Value) -> String {
    serde_json::to_string_pretty(document).expect("maps of text are valid JSON") + "\n"
}
