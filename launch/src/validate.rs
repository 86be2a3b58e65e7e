//! Validation before anything is started: each program checks the tables that are its own.

use crate::plan::{Member, Part, Plan};
use crate::stop::Stop;
use crate::verdict::error_in;
use interface_defs::toolkit::check::CheckReport;
use interface_defs::toolkit::exit::Exit;
use std::io;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Ask every own program of `plan` what it makes of the scene, all at once. The programs that the
/// scene names are not asked. What is wrong is told once, however many programs find it.
pub fn validate(plan: &Plan, scene: &Path, sets: &[String]) -> Result<Vec<(Part, CheckReport)>, Stop> {
    let started: Vec<_> = plan
        .members
        .iter()
        .filter(|member| !member.foreign)
        .map(|member| (member, ask(member, scene, sets).and_then(|child| child.wait_with_output())))
        .collect();
    let mut reports = Vec::new();
    let mut faults: Vec<Stop> = Vec::new();
    for (member, outcome) in started {
        match read(member, outcome) {
            Ok(report) => reports.push((member.part, report)),
            Err(fault) if faults.contains(&fault) => {}
            Err(fault) => faults.push(fault),
        }
    }
    if faults.is_empty() {
        return Ok(reports);
    }
    let exit = if faults.iter().any(|f| f.exit == Exit::BadInput) { Exit::BadInput } else { Exit::Failed };
    let told: Vec<&str> = faults.iter().filter(|f| f.exit == exit).map(|f| f.message.as_str()).collect();
    Err(Stop { exit, message: told.join("\nerror: ") })
}

fn ask(member: &Member, scene: &Path, sets: &[String]) -> io::Result<std::process::Child> {
    let mut command = Command::new(&member.program);
    command.args(&member.arguments).arg("check").arg(scene).args(["--format", "json"]);
    for set in sets {
        command.args(["--set", set]);
    }
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()
}

fn read(member: &Member, outcome: io::Result<Output>) -> Result<CheckReport, Stop> {
    let program = member.program.display();
    let output = outcome.map_err(|e| Stop::input(format!("{program} cannot be started: {e}")))?;
    let said = String::from_utf8_lossy(&output.stderr);
    let told = error_in(&said)
        .unwrap_or_else(|| format!("{program} check ended with {} and said: {said}", output.status));
    match output.status.code() {
        Some(0) => CheckReport::from_json(&String::from_utf8_lossy(&output.stdout))
            .map_err(|e| Stop::failed(format!("{program} check: {e}; are all programs of one version?"))),
        Some(2) => Err(Stop::input(told)),
        _ => Err(Stop::failed(told)),
    }
}
