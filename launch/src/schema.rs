//! The schema of a whole scene: what each program says of its tables, put together; and that of a study.

use crate::command_line::beside;
use crate::stop::Stop;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::toolkit::processes::Processes;
use interface_defs::toolkit::schema::{Share, Tables};
use serde_json::Value;
use std::process::{Command, Stdio};

/// Programs with tables of their own.
const PROGRAMS: [&str; 3] = ["dem-solver", "fem-solver", "coupler"];

/// Ask every program of this project for its share.
pub fn share() -> Result<Share, Stop> {
    let mut all = Tables::common().key::<Processes>("processes").share();
    for program in PROGRAMS {
        all.merge(ask(program, "schema")?).map_err(|name| {
            Stop::failed(format!("{program} and another program describe `{name}` differently"))
        })?;
    }
    Ok(all)
}

/// Ask the rocks' program, which computes studies, for the keys of one.
pub fn study() -> Result<Share, Stop> {
    ask("dem-solver", "study-schema")
}

fn ask(program: &str, command: &str) -> Result<Share, Stop> {
    let file = beside(program)
        .map_err(|what| Diagnostic::new(what).try_instead("build all programs with cargo build --release"))?;
    let output = Command::new(&file)
        .arg(command)
        .stdin(Stdio::null())
        .output()
        .map_err(|e| Diagnostic::new(format!("{} cannot be started: {e}", file.display())))?;
    Share::from_json(&String::from_utf8_lossy(&output.stdout)).map_err(|e| {
        let said = String::from_utf8_lossy(&output.stderr);
        Stop::failed(format!("{program} {command}: {e}; are all programs of one version? It printed: {said}"))
    })
}

/// As JSON text.
pub fn text(document: &Value) -> String {
    serde_json::to_string_pretty(document).expect("maps of text are valid JSON") + "\n"
}
