//! Validation before anything is started: each program checks the tables that are its own.

use crate::events::{Event, Events};
use crate::plan::{Member, Part, Plan};
use crate::stop::Stop;
use crate::verdict::error_in;
use interface_defs::toolkit::check::CheckReport;
use interface_defs::toolkit::exit::Exit;
use rustix::process::{Pid, Signal, kill_process_group};
use std::io;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Ask every own program of `plan` what it makes of the scene, all at once. The programs that the
/// scene names are not asked. What is wrong is told once, however many programs find it. A signal ends them all.
pub fn validate(
    plan: &Plan,
    scene: &Path,
    sets: &[String],
    events: &Events,
) -> Result<Vec<(Part, CheckReport)>, Stop> {
    let asked: Vec<&Member> = plan.members.iter().filter(|member| !member.foreign).collect();
    let mut groups = Vec::new();
    for (index, member) in asked.iter().enumerate() {
        let to_main = events.sender.clone();
        match ask(member, scene, sets) {
            Ok(child) => {
                groups.push((index, Pid::from_child(&child)));
                std::thread::spawn(move || to_main.send(Event::Checked(index, child.wait_with_output())));
            }
            Err(e) => to_main.send(Event::Checked(index, Err(e))).expect("this end listens"),
        }
    }
    let mut outcomes: Vec<Option<io::Result<Output>>> = asked.iter().map(|_| None).collect();
    let mut interrupted = false;
    while outcomes.iter().any(Option::is_none) {
        match events.receiver.recv().expect("this end sends, too") {
            Event::Checked(index, outcome) => outcomes[index] = Some(outcome),
            // They have nothing to lose.
            Event::Signal => {
                interrupted = true;
                let at_work = groups.iter().filter(|(index, _)| outcomes[*index].is_none());
                at_work.for_each(|(_, group)| {
                    let _ = kill_process_group(*group, Signal::KILL);
                });
            }
            Event::Ended(..) | Event::Progress(_) => {}
        }
    }
    if interrupted {
        return Err(Stop::failed("interrupted"));
    }
    let started = asked.into_iter().zip(outcomes.into_iter().flatten());
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
    // A group of its own: Ctrl-C reaches this program alone, which ends the checks.
    command.process_group(0).args(&member.arguments).arg("check").arg(scene).args(["--format", "json"]);
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
