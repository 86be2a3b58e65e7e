//! `rockfall ensemble --barrier SCENE --worst N`: a study, and its worst members again, coupled, against a barrier in its place.
//!
//! The rocks' program computes the study, chooses the members and writes the scene of each; the structure's program says where the
//! barrier stands. Here each of these scenes is run, one after the other, and what came of them is put together.
//!
//! - [`child`]: a program that is waited for; [`place`]: where in the user's file that is wrong which a member's scene has from it;
//!   [`case`]: a chosen member with what became of it; [`table`]: the results of all

mod case;
mod child;
mod place;
mod table;

use crate::command_line::beside;
use crate::estimate;
use crate::events::{Event, Events};
use crate::ground;
use crate::kind;
use crate::status;
use crate::stop::Stop;
use case::{Case, Chosen, OF};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::ipc::RunId;
use interface_defs::toolkit::arguments::{EnsembleArguments, Input};
use interface_defs::toolkit::exit::Exit;
use interface_defs::toolkit::ground::Area;
use interface_defs::toolkit::owner::{Claim, Owner, holder};
use interface_defs::toolkit::run_dir;
use interface_defs::toolkit::scene::Scene;
use interface_defs::toolkit::summary::{RunStatus, Summary};
use place::Generated;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Folder of the barrier in the directory of the study, and the list of members that the rocks' program leaves there.
pub const FOLDER: &str = "barrier";
const CHOSEN: &str = "chosen.json";

/// How often a member is looked at that another process runs.
const LOOK: Duration = Duration::from_millis(500);

/// How many members were chosen in the folder `dir` of a barrier, and how many of them are run; `None`: none were chosen.
pub fn progress(dir: &Path) -> Option<(usize, usize)> {
    let chosen = Chosen::read(&dir.join(CHOSEN)).ok()?.chosen;
    let is_run = |entry: &&serde_json::Value| dir.join(entry["member"].to_string()).join(OF).exists();
    Some((chosen.iter().filter(is_run).count(), chosen.len()))
}

/// The whole command.
pub fn worst(arguments: &EnsembleArguments, json: bool) -> Result<Exit, Stop> {
    let events = Events::watch().map_err(Stop::failed)?;
    let Some(barrier) = &arguments.barrier else { return Err(Stop::input("--barrier is missing")) };
    let (_, sets) = arguments.sets()?;
    let scene = Scene::load(barrier, &sets).map_err(|e| kind::study(barrier).unwrap_or_else(|| e.into()))?;
    let work = Work {
        arguments,
        barrier,
        site: site(&scene, sets, &events)?,
        scene,
        events: &events,
        quiet: arguments.quiet || json,
    };
    if arguments.scene_of.is_some() {
        return work.study(&work.of_member());
    }
    if arguments.members.is_some() {
        return work.study(&work.of_members());
    }
    let name = Scene::from_text(&arguments.study.display().to_string(), "")?;
    let out = run_dir::location(arguments.dir.out.as_deref(), &name).join(FOLDER);
    if let Some(member) = arguments.run_worst {
        return work.one(&out, member);
    }
    work.check()?;
    let exit = work.study(&work.of_all())?;
    if !matches!(exit, Exit::Done | Exit::Unreliable) {
        return Ok(exit);
    }
    if arguments.list_worst {
        // An unreliable study is said by the call that collects.
        let chosen = Chosen::read(&out.join(CHOSEN))?.chosen;
        let numbers = chosen.iter().map(|entry| format!("{}\n", entry["member"]));
        interface_defs::toolkit::screen::show(&numbers.collect::<String>());
        return Ok(Exit::Done);
    }
    let ended = work.cases(&out);
    if exit == Exit::Done {
        return ended;
    }
    // It is said once all is done, where it is read.
    let of_study = out.parent().and_then(|dir| Summary::read(dir).ok()?.message);
    Err(unreliable(of_study.unwrap_or_else(|| "the study is unreliable".into()), ended))
}

/// How an unreliable study ends that was followed by runs which ended so.
fn unreliable(of_study: String, ended: Result<Exit, Stop>) -> Stop {
    match ended {
        Ok(_) => Stop { exit: Exit::Unreliable, message: of_study },
        Err(stop) => Stop { message: format!("{of_study}\nerror: {}", stop.message), ..stop },
    }
}

/// Where the barrier of `scene` stands.
/// `sets` are values that take the place of those of its file.
fn site(scene: &Scene, sets: Vec<String>, events: &Events) -> Result<Area, Stop> {
    let program = program("fem-solver")?;
    let input = Input { scene: scene.path().to_owned(), sets };
    if let Some(area) = ground::area(&program, &input, events)? {
        return Ok(area);
    }
    let what = "the structure does not stand on a line of the terrain whose heights come from it";
    let advice = "a generated barrier with line = [[x, y], [x, y]] in the terrain's coordinates, or position, azimuth and length; \
                  without ground";
    let key = if scene.has("structure") { "structure.generator" } else { "structure" };
    Err(scene.invalid(key, what).try_instead(advice).into())
}

fn program(name: &str) -> Result<PathBuf, Stop> {
    let missing = |what| Diagnostic::new(what).try_instead("build all programs with cargo build --release");
    Ok(beside(name).map_err(missing)?)
}

/// What is done, and with what.
struct Work<'a> {
    arguments: &'a EnsembleArguments,
    barrier: &'a Path,
    scene: Scene,
    site: Area,
    events: &'a Events,
    quiet: bool,
}

impl Work<'_> {
    /// The study's program with what all its calls have.
    fn command(&self) -> Result<Command, Stop> {
        let mut command = Command::new(program("dem-solver")?);
        command.arg("ensemble").arg(&self.arguments.study).arg("--barrier").arg(self.barrier);
        let site = serde_json::to_string(&self.site).map_err(|e| Stop::failed(e.to_string()))?;
        command.arg("--site").arg(site);
        for set in &self.arguments.sets {
            command.args(["--set", set]);
        }
        if self.arguments.savings.no_shortcuts {
            command.arg("--no-shortcuts");
        }
        if self.quiet {
            command.arg("--quiet");
        }
        Ok(command)
    }

    /// Options of a call for the scene of one member.
    fn of_member(&self) -> Vec<String> {
        let number = self.arguments.scene_of.map(|number| format!("--scene-of={number}"));
        let output = self.arguments.output.as_ref().map(|path| format!("--output={}", path.display()));
        number.into_iter().chain(output).collect()
    }

    /// Options of a call for a part of the study.
    fn of_members(&self) -> Vec<String> {
        let it = self.arguments;
        let members = it.members.as_ref().map(|members| format!("--members={members}"));
        let threads = it.threads.map(|threads| format!("--threads={threads}"));
        let out = it.dir.out.as_ref().map(|dir| format!("--out={}", dir.display()));
        members.into_iter().chain(threads).chain(out).collect()
    }

    /// Options of the call that computes the study. A study that is there is gone on with.
    fn of_all(&self) -> Vec<String> {
        let it = self.arguments;
        let mut options = vec![format!("--worst={}", it.worst)];
        options.push(if it.force { "--force" } else { "--resume" }.into());
        options.extend(it.threads.map(|threads| format!("--threads={threads}")));
        options.extend(it.dir.out.as_ref().map(|dir| format!("--out={}", dir.display())));
        options
    }

    fn study(&self, options: &[String]) -> Result<Exit, Stop> {
        let mut command = self.command()?;
        if self.arguments.list_worst {
            // The list alone is printed there.
            command.stdout(Stdio::null());
        }
        let output = child::wait(command.args(options), self.events)?;
        Ok(match output.status.code() {
            Some(0) => Exit::Done,
            Some(2) => Exit::BadInput,
            Some(3) => Exit::Unreliable,
            _ => Exit::Failed,
        })
    }

    /// Refuse a barrier that cannot be run with the study's rock and terrain, before the study is computed.
    fn check(&self) -> Result<(), Stop> {
        let file = std::env::temp_dir().join(format!("rockfall-{}-member.toml", RunId::new()));
        let mut command = self.command()?;
        command.arg("--scene-of=1").arg("--output").arg(&file).stderr(Stdio::piped());
        let output = child::wait(&mut command, self.events)?;
        let said = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            let message = crate::verdict::error_in(&said).unwrap_or_else(|| said.trim().to_owned());
            return Err(match output.status.code() {
                Some(2) => Stop::input(message),
                _ => Stop::failed(message),
            });
        }
        let doubts = estimate::doubts(&Input { scene: file.clone(), sets: Vec::new() });
        let generated = Generated {
            file: file.display().to_string(),
            text: std::fs::read_to_string(&file).unwrap_or_default(),
            barrier: &self.scene,
        };
        // Where it cannot be removed it lies in the directory for such files.
        let _ = std::fs::remove_file(&file);
        let see = || {
            format!(
                "this is of member 1 of the study; its scene: rockfall ensemble {} --barrier {} --scene-of 1",
                self.arguments.study.display(),
                self.barrier.display()
            )
        };
        let doubts = doubts.map_err(|stop| Stop {
            message: format!("{}\n{}", generated.error(&stop.message), see()),
            ..stop
        })?;
        for doubt in doubts.iter().filter(|_| !self.quiet) {
            tracing::warn!("{}", generated.warning(doubt));
        }
        Ok(())
    }

    /// Run one chosen member, unless it has been run. A task that an engine gives out twice waits for the first one.
    fn one(&self, dir: &Path, member: u64) -> Result<Exit, Stop> {
        let list = dir.join(CHOSEN);
        let first = "rockfall ensemble STUDY --barrier SCENE --worst N --list-worst computes the study and chooses them";
        let refuse = |what: String| Diagnostic::in_file(list.display().to_string(), what).try_instead(first);
        if !list.exists() {
            return Err(refuse("there is no such file: no members are chosen yet".into()).into());
        }
        let chosen = Chosen::read(&list)?.chosen;
        let Some(entry) = chosen.iter().find(|entry| entry["member"] == member) else {
            return Err(
                refuse(format!("member {member} is none of the {} that are chosen", chosen.len())).into()
            );
        };
        let place = dir.join(member.to_string());
        while holder(&place).is_some() {
            if let Ok(Event::Signal) = self.events.receiver.recv_timeout(LOOK) {
                return Err(Stop::failed("interrupted"));
            }
        }
        if Case::finished(entry, &place).is_some() {
            return Ok(Exit::Done);
        }
        let case = self.run(entry, &place, [1, 1])?;
        if !self.quiet {
            Self::say(&case, 1, 1);
        }
        // What its run says of itself is for the results of all. A run that has left nothing is worth another try.
        match Case::finished(entry, &place) {
            Some(_) => Ok(Exit::Done),
            None => Err(Stop::failed(case.message)),
        }
    }

    /// Run every chosen member that has not been run yet; write what came of all.
    fn cases(&self, dir: &Path) -> Result<Exit, Stop> {
        let chosen = Chosen::read(&dir.join(CHOSEN))?;
        let owner = Owner::claim(dir, &Claim { force: true, ..Claim::default() })?;
        let mut cases: Vec<Case> = Vec::new();
        for entry in &chosen.chosen {
            let number = entry["member"].as_u64().unwrap_or_default();
            let place = dir.join(number.to_string());
            let found = if self.arguments.force { None } else { Case::finished(entry, &place) };
            let again = found.is_some();
            let case = match found {
                Some(case) => case,
                None => self.run(entry, &place, [cases.len() + 1, chosen.chosen.len()]).map_err(|stop| {
                    let kept = format!("{} of {} members are computed", cases.len(), chosen.chosen.len());
                    Stop { message: format!("{}; {kept}; the same command goes on", stop.message), ..stop }
                })?,
            };
            if !self.quiet && !again {
                Self::say(&case, cases.len() + 1, chosen.chosen.len());
            }
            cases.push(case);
            table::write_rows(&chosen.columns, &cases, dir)
                .map_err(|e| Stop::failed(format!("{}: {e}", dir.display())))?;
        }
        let mut summary = table::summary(&chosen, &cases, &self.barrier.display().to_string());
        owner.write_summary(&mut summary).map_err(Stop::failed)?;
        if !self.arguments.quiet {
            interface_defs::toolkit::screen::show(&table::screen(&summary, &cases, dir));
        }
        match summary.status {
            RunStatus::Done => Ok(Exit::Done),
            status => Err(Stop { exit: Exit::of(status), message: summary.message.unwrap_or_default() }),
        }
    }

    fn say(case: &Case, number: usize, all: usize) {
        eprintln!("{number} of {all}: member {}: {}", case.member(), case.words());
    }

    fn run(&self, entry: &serde_json::Value, place: &Path, [number, all]: [usize; 2]) -> Result<Case, Stop> {
        let rockfall = std::env::current_exe()
            .map_err(|e| Stop::failed(format!("rockfall itself is not found: {e}")))?;
        let mut command = Command::new(rockfall);
        command
            .arg("run")
            .arg(place.with_extension("toml"))
            .arg("--out")
            .arg(place)
            .args(["--force", "--quiet"]);
        if self.arguments.savings.no_shortcuts {
            command.arg("--no-shortcuts");
        }
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        let tell = |seconds| {
            let far = status::far(place).unwrap_or_else(|| "no row yet".into());
            eprintln!("{number} of {all}: member {}: {far}, after {seconds} s", entry["member"]);
        };
        let tell: &dyn Fn(u64) = if self.quiet { &|_| {} } else { &tell };
        let output = child::wait_telling(&mut command, self.events, tell)?;
        Case::ended(entry, place, &output).map_err(|e| Stop::failed(format!("{}: {e}", place.display())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unreliable_study_is_said_at_the_end_and_never_ends_as_done() {
        let of = |ended| unreliable("unreliable: 3 of 40".into(), ended);
        let alone = of(Ok(Exit::Done));
        assert_eq!((alone.exit, alone.message.as_str()), (Exit::Unreliable, "unreliable: 3 of 40"));
        let both = of(Err(Stop { exit: Exit::Unreliable, message: "unreliable: 1 of 2".into() }));
        assert_eq!(both.exit, Exit::Unreliable);
        assert_eq!(both.message, "unreliable: 3 of 40\nerror: unreliable: 1 of 2");
        assert_eq!(of(Err(Stop::failed("interrupted"))).exit, Exit::Failed);
    }
}
