//! Validation before anything is started: each program checks the tables that are its own.

use crate::events::{Event, Events};
use crate::plan::{Member, Part, Plan};
use crate::stop::Stop;
use crate::verdict::error_in;
use interface_defs::InterfaceMesh;
use interface_defs::toolkit::arguments::Input;
use interface_defs::toolkit::check::CheckReport;
use interface_defs::toolkit::exit::Exit;
use rustix::process::{Pid, Signal, kill_process_group};
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Output, Stdio};

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
        let outcomes = ask_all(&members, |member| ask(member, input, net), events)?;
        for (member, outcome) in members.into_iter().zip(outcomes) {
            match read(member, outcome) {
                Ok(report) => reports.push((member.part, report)),
                Err(fault) if faults.contains(&fault) => {}
                Err(fault) => faults.push(fault),
            }
        }
    }
    if faults.is_empty() {
        return Ok(reports);
    }
    let exit = if faults.iter().any(|f| f.exit == Exit::BadInput) { Exit::BadInput } else { Exit::Failed };
    let reported: Vec<&str> = faults.iter().filter(|f| f.exit == exit).map(|f| f.message.as_str()).collect();
    Err(Stop { exit, message: reported.join("\nerror: ") })
}

/// What each of `members` answers when it is asked, all at once. A signal ends them all.
fn ask_all(
    members: &[&Member],
    ask: impl Fn(&Member) -> io::Result<Child>,
    events: &Events,
) -> Result<Vec<io::Result<Output>>, Stop> {
    let mut groups = Vec::new();
    for (index, member) in members.iter().enumerate() {
        let to_main = events.sender.clone();
        match ask(member) {
            Ok(child) => {
                groups.push((index, Pid::from_child(&child)));
                std::thread::spawn(move || to_main.send(Event::Checked(index, child.wait_with_output())));
            }
            Err(e) => to_main.send(Event::Checked(index, Err(e))).expect("this end listens"),
        }
    }
    let mut outcomes: Vec<Option<io::Result<Output>>> = members.iter().map(|_| None).collect();
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
    if interrupted { Err(Stop::failed("interrupted")) } else { Ok(outcomes.into_iter().flatten().collect()) }
}

/// Start the check of one program; the `net` goes to it over its stdin.
fn ask(member: &Member, input: &Input, net: Option<&InterfaceMesh>) -> io::Result<Child> {
    let mut command = Command::new(&member.program);
    // A group of its own: Ctrl-C reaches this program alone, which ends the checks.
    command
        .process_group(0)
        .args(&member.arguments)
        .arg("check")
        .arg(&input.scene)
        .args(["--format", "json"]);
    for set in &input.sets {
        command.args(["--set", set]);
    }
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let Some(net) = net.filter(|_| member.part == Part::Dem) else {
        return command.stdin(Stdio::null()).spawn();
    };
    let mut child = command.args(["--interface", "-"]).stdin(Stdio::piped()).spawn()?;
    if let Some(mut to) = child.stdin.take() {
        // A program that has ended by now says why itself.
        let _ = serde_json::to_vec(net).map_err(io::Error::from).and_then(|text| to.write_all(&text));
    }
    Ok(child)
}

fn read(member: &Member, outcome: io::Result<Output>) -> Result<CheckReport, Stop> {
    let program = member.program.display();
    let output = outcome.map_err(|e| Stop::input(format!("{program} cannot be started: {e}")))?;
    let said = String::from_utf8_lossy(&output.stderr);
    let error = error_in(&said)
        .unwrap_or_else(|| format!("{program} check ended with {} and printed: {said}", output.status));
    match output.status.code() {
        Some(0) => CheckReport::from_json(&String::from_utf8_lossy(&output.stdout))
            .map_err(|e| Stop::failed(format!("{program} check: {e}; are all programs of one version?"))),
        Some(2) => Err(Stop::input(error)),
        _ => Err(Stop::failed(error)),
    }
}
