//! The command lines of a run.

use super::RunArguments;
use crate::check::plan::{Member, Part, Plan};
use crate::front::shell;
use crate::run::children;
use interface_defs::RunId;
use interface_defs::ipc::Wait;
use std::ffi::OsString;
use std::path::Path;
use toolkit::owner::Owner;
use toolkit::{profile, run_dir};

/// Program and arguments of each process by its name. The leader is told whether it shows how far it is, and whether it goes on.
pub fn commands(
    plan: &Plan,
    request: &RunArguments,
    owner: &Owner,
    (show, goes_on): (bool, bool),
) -> Vec<(&'static str, Vec<OsString>)> {
    let of = |(index, member): (usize, &Member)| {
        let mut words = words(member, plan, request, (owner.dir(), owner.run()));
        words.extend(["--supervisor".into(), std::process::id().to_string().into()]);
        if index == 0 && show {
            words.extend(["--progress", "json"].map(OsString::from));
        }
        words.extend((index == 0 && goes_on).then(|| OsString::from("--resume")));
        (member.part.name(), words)
    };
    plan.members.iter().enumerate().map(of).collect()
}

/// The command line of a member, program first: what the scene names, and what makes it take part. All get the resolved scene, in which
/// every default and `--set` is filled in, so that all compute the same.
fn words(member: &Member, plan: &Plan, request: &RunArguments, (out, run): (&Path, &RunId)) -> Vec<OsString> {
    let mut words: Vec<OsString> = vec![member.program.clone().into()];
    words.extend(member.arguments.iter().map(OsString::from));
    let leads = !plan.is_coupled() || member.part == Part::Coupler;
    words.push(if leads { "run" } else { "serve" }.into());
    words.push(out.join(run_dir::SCENE).into());
    let mut option = |name: &str, value: OsString| words.extend([name.into(), value]);
    if plan.is_coupled() {
        option("--run", run.to_string().into());
        if !leads {
            option("--as", member.part.name().into());
        }
    }
    option("--out", out.into());
    if !leads {
        option("--timeout", plan.processes.timeout.to_string().into());
        // A solver of another make may not know how `auto` waits.
        if plan.processes.wait != Wait::Auto {
            option("--wait", plan.processes.wait.to_string().into());
        }
    }
    // A solver of another make may not know it.
    if request.profiling.profile.is_some() && !member.foreign {
        option("--profile", profile::part(&out.join(run_dir::LOG), member.part.name()).into());
    }
    if request.savings.no_shortcuts {
        words.push("--no-shortcuts".into());
    }
    if let Some(file) = request.record.as_ref().filter(|_| leads) {
        words.extend(["--record".into(), children::path(file).into()]);
    }
    words
}

/// What does the same as a run, a command a line, as a shell reads it: the resolved scene, then each program.
pub fn by_hand(plan: &Plan, request: &RunArguments, (out, run): (&Path, &RunId)) -> String {
    let line = |words: &[OsString]| shell::join(words) + "\n";
    let mut check = vec!["rockfall".into(), "check".into()];
    check.extend(children::scene(&request.input));
    check.extend(["--resolved".into(), out.join(run_dir::SCENE).into()]);
    let force = request.results.force.then(|| OsString::from("--force"));
    let programs = plan.members.iter().enumerate().map(|(at, member)| {
        let mut words = words(member, plan, request, (out, run));
        words.extend(force.clone().filter(|_| at == 0));
        line(&words)
    });
    format!("mkdir -p {} && {}", shell::join([out]), line(&check)) + &programs.collect::<String>()
}
