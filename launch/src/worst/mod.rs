//! `rockfall ensemble --barrier SCENE --worst N`: a study, and its worst members again, coupled, against a barrier in its place.
//!
//! The rocks' program computes the study, chooses the members and writes the scene of each; the structure's program says where the
//! barrier stands. Here each of these scenes is run, one after the other, and what came of them is put together.
//!
//! - [`table`]: chosen members with what became of them, and the results of all

mod table;

use crate::check::ground::{self, Scratch};
use crate::check::plan::own_program;
use crate::check::prepared::{self, Prepared};
use crate::front::stop::Stop;
use crate::report;
use crate::run::children::{self, Destination, Event, Events, Job, Rules};
use crate::run::progress::{Progress, far};
use crate::run::sweep::{self, Task};
use interface_defs::diagnostic::{Diagnostic, code};
use serde_json::json;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;
pub use table::outcome;
use table::{Case, Chosen, Generated};
use toolkit::arguments::{EnsembleArguments, Input};
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::ground::Area;
use toolkit::numbers::three;
use toolkit::owner::{Claim, Owner, holder};
use toolkit::run_dir::{self, BARRIER, CHOSEN};
use toolkit::scene::Scene;
use toolkit::summary::{RunStatus, Summary};
use toolkit::{files, manifest};

/// How often a member is looked at that another process runs.
const POLL_INTERVAL: Duration = Duration::from_millis(500);

/// How many members were chosen in the folder `dir` of a barrier, and how many of them are run; `None`: none were chosen.
pub fn progress(dir: &Path) -> Option<(usize, usize)> {
    let chosen = Chosen::read(&dir.join(CHOSEN)).ok()?.chosen;
    let is_run = |entry: &&serde_json::Value| sweep::is_kept(&dir.join(entry["member"].to_string()));
    Some((chosen.iter().filter(is_run).count(), chosen.len()))
}

/// The whole command.
pub fn worst(arguments: &EnsembleArguments, json: bool) -> Result<Exit, Stop> {
    let events = Events::watch()?;
    let Some(barrier) = &arguments.barrier else {
        return Err(Stop::input(code::ARGUMENT, "--barrier is missing"));
    };
    let (_, sets) = arguments.sets()?;
    let scene = Scene::load(barrier, &sets).map_err(|e| match prepared::is_study(barrier) {
        true => {
            let what = format!(
                "--barrier {}: this is a study, and the scene of a barrier is asked for here",
                barrier.display()
            );
            Stop::input(code::ARGUMENT, what).hinted("a scene with [structure], docs/line-barrier.md")
        }
        false => prepared::study(barrier).unwrap_or_else(|| e.into()),
    })?;
    let work = Work {
        arguments,
        barrier,
        site: site(&scene, sets, &events)?,
        scene,
        events: &events,
        quiet: arguments.computation.quiet || json,
        progress: Progress::new(arguments.computation.quiet || json, false, false),
    };
    if arguments.scene_of.is_some() || arguments.members.is_some() {
        return work.study();
    }
    let name = Scene::from_text(&arguments.study.display().to_string(), "")?;
    let out = run_dir::location(arguments.computation.dir.out.as_deref(), &name).join(BARRIER);
    if let Some(member) = arguments.run_worst {
        return work.one(&out, member);
    }
    if arguments.dry_run {
        return work.preview();
    }
    work.check(Some(out.parent().unwrap_or(&out)))?;
    let exit = work.study()?;
    if !matches!(exit, Exit::Done | Exit::Unreliable) {
        return Ok(exit);
    }
    if arguments.list_worst {
        // An unreliable study is said by the call that collects.
        let chosen = Chosen::read(&out.join(CHOSEN))?.chosen;
        let numbers = chosen.iter().map(|entry| format!("{}\n", entry["member"]));
        toolkit::screen::show(&numbers.collect::<String>());
        return Ok(Exit::Done);
    }
    let ended = work.cases(&out);
    if exit == Exit::Done {
        return ended;
    }
    // It is said once all is done, where it is read.
    let of_study = out.parent().and_then(|dir| Summary::read(dir).ok());
    Err(unreliable(Stop::of(of_study.unwrap_or_else(|| Summary::new(RunStatus::Unreliable))), ended))
}

/// How an unreliable study ends that was followed by runs which ended so.
fn unreliable(mut of_study: Stop, ended: Result<Exit, Stop>) -> Stop {
    if let Err(stop) = ended {
        of_study.exit = stop.exit;
        of_study.errors.extend(stop.errors);
    }
    of_study
}

/// Where the barrier of `scene` stands.
/// `sets` are values that take the place of those of its file.
fn site(scene: &Scene, sets: Vec<String>, events: &Events) -> Result<Area, Stop> {
    let program = own_program("fem-solver")?;
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

/// Whether results of all members are made, and not of some alone.
pub fn is_whole(arguments: &EnsembleArguments) -> bool {
    let EnsembleArguments { members, chunks, scene_of, dry_run, .. } = arguments;
    members.is_none() && chunks.is_none() && scene_of.is_none() && !dry_run
}

/// A study without a barrier, by its own program; then its report.
pub fn study(arguments: &EnsembleArguments) -> Result<Exit, Stop> {
    let name = Scene::from_text(&arguments.study.display().to_string(), "")?;
    let mut command = Command::new(own_program("dem-solver")?);
    command.args(std::env::args_os().skip_while(|word| word != "ensemble")).arg("--watched");
    let rules = Rules { grace: Some(children::GRACE_OF_RUN), ..Rules::default() };
    let job = Job { output: Destination::Inherited, ..Job::of(command) };
    let exit = children::one(job, rules, &Events::watch()?)?.0.exit();
    if matches!(exit, Exit::Done | Exit::Unreliable) {
        close(&run_dir::location(arguments.computation.dir.out.as_deref(), &name), &arguments.sets);
    }
    Ok(exit)
}

/// The report of the study in `dir`, unless it says `report = false`, and what lies there with it.
fn close(dir: &Path, sets: &[String]) {
    let file =
        files::read_text(&dir.join("study.toml")).ok().and_then(|text| text.parse::<toml::Table>().ok());
    let off = |table: &toml::Table| table.get("report").and_then(toml::Value::as_bool) == Some(false);
    let set = sets
        .iter()
        .rev()
        .filter_map(|set| set.parse().ok())
        .find(|set: &toml::Table| set.contains_key("report"));
    if !set.or(file).is_some_and(|table| off(&table)) {
        report::close(dir);
    }
    manifest::seal(dir);
}

/// What is done, and with what.
struct Work<'a> {
    arguments: &'a EnsembleArguments,
    barrier: &'a Path,
    scene: Scene,
    site: Area,
    events: &'a Events,
    quiet: bool,
    progress: Progress,
}

impl Work<'_> {
    /// The study's program with what all its calls have.
    fn command(&self) -> Result<Command, Stop> {
        let mut command = Command::new(own_program("dem-solver")?);
        command.arg("ensemble").arg(children::path(&self.arguments.study));
        command.arg("--barrier").arg(children::path(self.barrier));
        let site = serde_json::to_string(&self.site);
        let site = site.map_err(|e| Stop::failed(code::CONTRACT, e.to_string()))?;
        command.arg(format!("--site={site}")).arg("--watched");
        command.args(self.arguments.sets.iter().map(|set| format!("--set={set}")));
        if self.arguments.computation.savings.no_shortcuts {
            command.arg("--no-shortcuts");
        }
        if self.quiet {
            command.arg("--quiet");
        }
        Ok(command)
    }

    /// The study, a part of it, or the scene of one member, by its program. A study that is there is gone on with.
    fn study(&self) -> Result<Exit, Stop> {
        let it = self.arguments;
        let computation = &it.computation;
        let whole = it.scene_of.is_none() && it.members.is_none();
        let options = [
            it.scene_of.map(|number| format!("--scene-of={number}")),
            it.output.as_ref().map(|path| format!("--output={}", path.display())),
            it.members.as_ref().map(|members| format!("--members={members}")),
            whole.then(|| format!("--worst={}", it.worst)),
            whole.then(|| if computation.force { "--force" } else { "--resume" }.into()),
            computation.threads.map(|threads| format!("--threads={threads}")),
            computation.dir.out.as_ref().map(|dir| format!("--out={}", dir.display())),
        ];
        let mut command = self.command()?;
        command.args(options.into_iter().flatten());
        if it.list_worst {
            // The list alone is printed there.
            command.stdout(Stdio::null());
        }
        // What is wrong it has said itself.
        Ok(self.wait(Job { output: Destination::Inherited, ..Job::of(command) })?.exit())
    }

    fn wait(&self, job: Job) -> Result<children::End, Stop> {
        let rules = Rules { grace: Some(children::GRACE_OF_RUN), ..Rules::default() };
        Ok(children::one(job, rules, self.events)?.0)
    }

    /// What the study and the runs of its worst members would be, both checked.
    fn preview(&self) -> Result<Exit, Stop> {
        let seconds = self.check(None)?;
        let (form, json) = match self.arguments.format {
            Format::Text => ("text", false),
            Format::Json => ("json", true),
        };
        let mut command = self.command()?;
        command.args(["--dry-run", &format!("--format={form}")]);
        let text = self.wait(Job::of(command))?.text()?;
        let (barrier, worst) = (self.barrier.display().to_string(), self.arguments.worst);
        toolkit::screen::show(&if json {
            let broken = |e: serde_json::Error| Stop::failed(code::CONTRACT, e.to_string());
            let mut found: serde_json::Value = serde_json::from_str(&text).map_err(broken)?;
            found["barrier"] = json!({ "scene": barrier, "worst": worst, "seconds_per_run": seconds });
            format!("{found}\n")
        } else {
            let each =
                seconds.map_or(String::new(), |each| format!(", some {} s of wall time each", three(each)));
            format!("{text}{:<28} {barrier}: the worst {worst} members again, coupled{each}\n", "barrier")
        });
        Ok(Exit::Done)
    }

    /// Refuse a barrier that cannot be run with the study's rock and terrain, before the study is computed; what a run costs [s].
    fn check(&self, home: Option<&Path>) -> Result<Option<f64>, Stop> {
        let scratch = Scratch::new(home)?;
        let file = scratch.file("member.toml");
        let mut command = self.command()?;
        command.arg("--scene-of=1").arg("--output").arg(&file);
        self.wait(Job::of(command))?.text()?;
        let generated = Generated { file: file.display().to_string(), barrier: &self.scene };
        let input = Input { scene: file, sets: Vec::new() };
        let prepared = Prepared::of(&input, |_| None, self.events)
            .and_then(|prepared| Ok((prepared.doubts()?, prepared.numbers.expected_cost())));
        let of_barrier = |stop: Stop| {
            let errors = stop.errors.into_iter().map(|error| generated.placed(error)).collect();
            let (study, barrier) = (self.arguments.study.display(), self.barrier.display());
            let scene = format!("rockfall ensemble {study} --barrier {barrier} --scene-of 1");
            Stop { errors, ..stop }.hinted(&format!("this is of member 1 of the study; its scene: {scene}"))
        };
        let (doubts, cost) = prepared.map_err(of_barrier)?;
        for doubt in doubts.into_iter().filter(|_| !self.quiet) {
            tracing::warn!("{}", generated.placed(doubt));
        }
        Ok(cost)
    }

    /// Run one chosen member, unless it has been run. A task that an engine gives out twice waits for the first one.
    fn one(&self, dir: &Path, member: u64) -> Result<Exit, Stop> {
        let list = dir.join(CHOSEN);
        let first = "rockfall ensemble STUDY --barrier SCENE --worst N --list-worst computes the study and chooses them";
        let refuse = |what: String| Diagnostic::in_file(list.display(), what).try_instead(first);
        if !list.exists() {
            return Err(refuse("there is no such file: no members are chosen yet".into()).into());
        }
        let chosen = Chosen::read(&list)?.chosen;
        let Some(entry) = chosen.iter().find(|entry| entry["member"] == member) else {
            let what = format!("member {member} is none of the {} that are chosen", chosen.len());
            return Err(refuse(what).into());
        };
        let place = dir.join(member.to_string());
        while holder(&place).is_some() {
            if let Ok(Event::Signal) = self.events.receiver.recv_timeout(POLL_INTERVAL) {
                return Err(Stop::interrupted());
            }
        }
        if Case::finished(entry, &place)?.is_some() {
            return Ok(Exit::Done);
        }
        let case = self.run(entry, &place, [1, 1])?;
        // What its run says of itself is for the results of all. A run that has left nothing is worth another try.
        match Case::finished(entry, &place)? {
            Some(_) => Ok(Exit::Done),
            None => Err(Stop { exit: Exit::Failed, errors: case.reasons }),
        }
    }

    /// Run every chosen member that has not been run yet; write what came of all.
    fn cases(&self, dir: &Path) -> Result<Exit, Stop> {
        let chosen = Chosen::read(&dir.join(CHOSEN))?;
        let owner = Owner::claim(dir, &Claim { force: true, ..Claim::default() })?;
        let all = chosen.chosen.len();
        let mut cases: Vec<Case> = Vec::new();
        for entry in &chosen.chosen {
            let place = dir.join(entry["member"].to_string());
            let found = if self.arguments.computation.force { None } else { Case::finished(entry, &place)? };
            let case = found.map_or_else(|| self.run(entry, &place, [cases.len() + 1, all]), Ok);
            let kept =
                || format!("; {} of {all} members are computed; the same command goes on", cases.len());
            cases.push(case.map_err(|stop| stop.and(&kept()))?);
            table::write_rows(&chosen.columns, &cases, dir)
                .map_err(|e| Stop::failed(code::NOT_WRITTEN, format!("{}: {e}", dir.display())))?;
        }
        let mut summary = table::summary(&chosen, &cases, &self.barrier.display().to_string());
        owner.write_summary(&mut summary).map_err(|what| Stop::failed(code::NOT_WRITTEN, what))?;
        // With the study that it belongs to.
        close(dir.parent().unwrap_or(dir), &self.arguments.sets);
        if !self.arguments.computation.quiet {
            toolkit::screen::show(&table::screen(&summary, &cases, dir));
        }
        match summary.status {
            RunStatus::Done => Ok(Exit::Done),
            _ => Err(Stop::of(summary)),
        }
    }

    fn run(&self, entry: &serde_json::Value, place: &Path, [number, all]: [usize; 2]) -> Result<Case, Stop> {
        let scene = place.with_extension("toml");
        let shortcuts = !self.arguments.computation.savings.no_shortcuts;
        let task = Task { scene: &scene, sets: Vec::new(), dir: place, shortcuts, limit: f64::INFINITY };
        let of = format!("{number} of {all}: member {}", entry["member"]);
        let mut say = |seconds| self.progress.say(&format!("{of}: {}, after {seconds} s", far(place)));
        let case = Case::ended(entry, place, task.run(self.events, &mut say)?)?;
        self.progress.say(&format!("{of}: {}", case.words()));
        Ok(case)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unreliable_study_is_said_at_the_end_and_never_ends_as_done() {
        let trust = |what: &str| Stop { exit: Exit::Unreliable, ..Stop::failed(code::TRUST, what) };
        let of = |ended| unreliable(trust("unreliable: 3 of 40"), ended);
        assert_eq!(of(Ok(Exit::Done)), trust("unreliable: 3 of 40"));
        let both = of(Err(trust("unreliable: 1 of 2")));
        assert_eq!((both.exit, both.errors.len()), (Exit::Unreliable, 2));
        assert_eq!(of(Err(Stop::interrupted())).exit, Exit::Failed);
    }
}
