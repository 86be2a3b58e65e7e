//! Validation before anything is started: each program checks the tables that are its own.

use crate::children::{self, Job, Rules};
use crate::events::Events;
use crate::plan::{Member, Part, Plan};
use crate::stop::Stop;
use interface_defs::InterfaceMesh;
use interface_defs::diagnostic::{Diagnostic, code};
use std::process::Command;
use toolkit::arguments::Input;
use toolkit::check::CheckReport;
use toolkit::exit::Exit;

/// Ask every own program of `plan` what it makes of the scene, all at once; but the rocks' after the structure's, which
/// says where the net is. The programs that the scene names are not asked. What is wrong is reported once, however many
/// programs find it. A signal ends them all.
pub fn validate(plan: &Plan, input: &Input, events: &Events) -> Result<Vec<(Part, CheckReport)>, Stop> {
    let own = || plan.members.iter().filter(|member| !member.foreign);
    let has_net = own().any(|member| member.part == Part::Fem);
    let (later, now): (Vec<_>, Vec<_>) = own().partition(|member| has_net && member.part == Part::Dem);
    let mut reports = Vec::new();
    let mut faults: Vec<Stop> = Vec::new();
    for members in [now, later] {
        let net = reports.iter().find_map(|(_, report): &(Part, CheckReport)| report.interface.as_ref());
        let jobs = members.iter().map(|member| question(member, input, net)).collect::<Result<_, _>>()?;
        // They have nothing to lose.
        let mut outcome = children::watch(jobs, Rules::default(), events)?;
        if outcome.interrupted {
            return Err(Stop::interrupted());
        }
        outcome.ends.sort_by_key(|end| end.index);
        for (member, end) in members.into_iter().zip(outcome.ends) {
            match end.text().and_then(|text| read(member, &text)) {
                Ok(report) => reports.push((member.part, report)),
                Err(fault) => faults.push(fault),
            }
        }
    }
    if faults.is_empty() {
        return Ok(reports);
    }
    let exit = if faults.iter().any(|f| f.exit == Exit::BadInput) { Exit::BadInput } else { Exit::Failed };
    let mut errors: Vec<Diagnostic> = Vec::new();
    for error in faults.into_iter().filter(|fault| fault.exit == exit).flat_map(|fault| fault.errors) {
        if !errors.contains(&error) {
            errors.push(error);
        }
    }
    Err(Stop { exit, errors })
}

/// The check of one program; the `net` goes to it over its stdin.
fn question(member: &Member, input: &Input, net: Option<&InterfaceMesh>) -> Result<Job, Stop> {
    let mut command = Command::new(&member.program);
    command.args(&member.arguments).arg("check").args(children::scene(input)).arg("--format=json");
    let Some(net) = net.filter(|_| member.part == Part::Dem) else { return Ok(Job::of(command)) };
    command.arg("--interface=-");
    let input = serde_json::to_vec(net).map_err(|e| Stop::failed(code::CONTRACT, e.to_string()))?;
    Ok(Job { input: Some(input), ..Job::of(command) })
}

fn read(member: &Member, text: &str) -> Result<CheckReport, Stop> {
    CheckReport::from_json(text).map_err(|e| {
        let program = member.program.display();
        Stop::failed(code::CONTRACT, format!("{program} check: {e}; are all programs of one version?"))
    })
}
