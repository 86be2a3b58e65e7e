//! `dem-solver ensemble`: a study from its file to its results.

use super::base::Base;
use super::directory::{Directory, Index, MEMBERS, Reader};
use super::execute::compute;
use super::gate;
use super::journal::{Found, Journal, Refused};
use super::record::Record;
use super::results::{self, design::Reliability};
use super::settings::{STUDY, StudySettings};
use super::summary::Numbers;
use super::table::Table;
use super::worst::barrier::Barrier;
use super::worst::{self, Comings};
use clap::{ArgMatches, Args, FromArgMatches};
use interface_defs::diagnostic::{Diagnostic, Place, Severity, code};
use interface_defs::ipc::interrupt;
use interface_defs::ipc::serve::peak_memory;
use serde_json::json;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::time::{Duration, Instant};
use toolkit::arguments::{EnsembleArguments, MemberRange};
use toolkit::exit::Exit;
use toolkit::files;
use toolkit::owner::{Claim, Owner};
use toolkit::program::Extra;
use toolkit::progress::{Line, Reporter};
use toolkit::run_dir;
use toolkit::scene::Scene;
use toolkit::screen::{complain, show};
use toolkit::summary::RunStatus;

/// The subcommand.
pub const COMMAND: Extra = Extra { command, run };

/// How often the screen shows how far it is.
const SHOWN: Duration = Duration::from_millis(500);
/// The same in lines where the screen is no terminal.
const LINES: Duration = Duration::from_secs(30);

fn command() -> clap::Command {
    EnsembleArguments::augment_args(
        clap::Command::new("ensemble")
            .bin_name("rockfall ensemble")
            .about("Many releases of one rock on one terrain: a table with a row for each, quantiles"),
    )
}

/// How often a task that waits for another looks whether it has ended.
const LOOK: Duration = Duration::from_millis(100);

/// A chunk, asked for.
enum Claimed {
    /// Its journal, with what is in it already.
    Ours(Journal, Vec<Found>),
    /// It is complete.
    Done,
    /// A signal has ended the wait for another process.
    Interrupted,
}

/// How far it is, for those who look.
struct Progress {
    reporter: Reporter,
    bar: bool,
    lines: bool,
    total: u64,
    done: u64,
    begun: Instant,
    before: u64,
    shown: Option<Instant>,
}

impl Progress {
    fn step(&mut self) {
        self.done += 1;
        let (done, end) = (self.done, self.total);
        self.reporter.report(|| Line {
            t: done as f64,
            end: end as f64,
            windows: done,
            what: "members".into(),
            ..Line::default()
        });
        let due = match self.bar {
            true => self.shown.is_none_or(|shown| shown.elapsed() >= SHOWN),
            false => self.lines && self.shown.unwrap_or(self.begun).elapsed() >= LINES,
        };
        if due {
            self.shown = Some(Instant::now());
            let rate = (done - self.before) as f64 / self.begun.elapsed().as_secs_f64();
            let left = if rate > 0.0 { (end - done) as f64 / rate } else { 0.0 };
            let (from, to) = if self.bar { ("\r", "   ") } else { ("", "\n") };
            let _ = write!(io::stderr(), "{from}{done} of {end} members, {rate:.1}/s, {left:.0} s left{to}");
        }
    }

    fn end(&self) {
        if self.bar && self.shown.is_some() {
            let _ = writeln!(io::stderr());
        }
    }
}

/// Members that were computed here and now, and on how many threads.
struct Work {
    members: u64,
    threads: usize,
    seconds: f64,
}

struct Study<'a> {
    base: &'a Base,
    barrier: Option<&'a Barrier>,
    directory: Directory,
    arguments: &'a EnsembleArguments,
    threads: usize,
}

fn run(matches: &ArgMatches) -> Result<Exit, Diagnostic> {
    let arguments =
        EnsembleArguments::from_arg_matches(matches).map_err(|e| Diagnostic::new(e.to_string()))?;
    let (sets, of_barrier) = arguments.sets()?;
    let file = Scene::load_as(&STUDY, &arguments.study, &sets)?;
    if let Some(count) = arguments.chunks {
        let members = StudySettings::of(&file)?.members();
        let parts = MemberRange::parts(members, count);
        show(&parts.iter().map(|part| format!("{part}\n")).collect::<String>());
        return Ok(Exit::Done);
    }
    let (barrier, file) = Barrier::of(&arguments, &of_barrier, file)?;
    let out = arguments.dir.of(&file);
    let kept = [out.join(run_dir::CLUSTERS)];
    let base = gate::read(&file, !arguments.savings.no_shortcuts, &kept)?;
    let available = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = arguments.threads.map_or(available, |n| n as usize);
    let directory = Directory::new(&out);
    let study = Study { base: &base, barrier: barrier.as_ref(), directory, arguments: &arguments, threads };
    if let Some(range) = &arguments.members
        && (range.first == 0 || range.last > base.members() || range.first > range.last)
    {
        let what =
            format!("{}..{}: the members of this study are 1..{}", range.first, range.last, base.members());
        return Err(Diagnostic::in_file("--members", what));
    }
    if !arguments.quiet {
        base.warnings.iter().for_each(|warning| tracing::warn!("{}", base.scene.placed(warning.clone())));
        barrier.iter().flat_map(Barrier::notices).for_each(|notice| tracing::info!("{notice}"));
    }
    interrupt::install();
    if arguments.site.is_some() {
        // Started by `rockfall`: nothing goes on without it, so that the same command again finds the directory free.
        let watched = interrupt::end_with_parent();
        watched.map_err(|e| Diagnostic::new(format!("the end of rockfall cannot be watched: {e}")))?;
    }
    if let Some(number) = arguments.scene_of {
        return study.one_scene(number);
    }
    match &arguments.members {
        Some(range) => study.chunk(range.first, range.last, &file),
        None => study.whole(&file),
    }
}

impl Study<'_> {
    /// Write the scene of one member, with the barrier where one is named.
    fn one_scene(&self, number: u64) -> Result<Exit, Diagnostic> {
        let base = self.base;
        if number > base.members() {
            let what = format!("{number}: the members of this study are 1..{}", base.members());
            return Err(Diagnostic::in_file("--scene-of", what));
        }
        let text = match self.barrier {
            Some(barrier) => worst::scene_of_one(base, barrier, number)?,
            None => {
                let member = base.member(number);
                let body = toml::to_string(&base.scene_of(&member)?);
                base.head(&member, "") + &body.map_err(|e| Diagnostic::new(e.to_string()))?
            }
        };
        match &self.arguments.output {
            None => show(&text),
            Some(path) => files::write(path, text.as_bytes()).map_err(|e| {
                Diagnostic::in_file(path.display().to_string(), format!("cannot be written: {e}"))
            })?,
        }
        Ok(Exit::Done)
    }

    /// Make the directory that of this study.
    fn begin(&self, file: &Scene) -> Result<(), Diagnostic> {
        self.directory.begin(self.base, file).map_err(|e| self.of_another(e))
    }

    /// What to try where the directory holds another study.
    fn of_another(&self, e: Diagnostic) -> Diagnostic {
        match self.barrier {
            Some(_) => e.try_instead(
                "a study that was computed without the line of the barrier holds no rock that crosses it: choose another directory \
                 with --out, or begin anew with --force",
            ),
            None => e,
        }
    }

    fn progress(&self, total: u64, before: u64) -> Progress {
        Progress {
            reporter: Reporter::new(self.arguments.progress),
            bar: !self.arguments.quiet && io::stderr().is_terminal(),
            lines: !self.arguments.quiet,
            total,
            done: before,
            begun: Instant::now(),
            before,
            shown: None,
        }
    }

    fn fault(&self, what: impl std::fmt::Display) -> Diagnostic {
        Diagnostic::in_file(self.directory.place().display().to_string(), what.to_string())
    }

    /// The members from `first` to `last` into a file of their own, which gets its name when it is complete.
    fn chunk(&self, first: u64, last: u64, file: &Scene) -> Result<Exit, Diagnostic> {
        self.begin(file)?;
        let [done, part] = self.directory.chunk(first, last);
        let (mut journal, found) = match self.claim(&done, &part)? {
            Claimed::Ours(journal, found) => (journal, found),
            // A task that is given out twice does nothing the second time.
            Claimed::Done => return Ok(Exit::Done),
            Claimed::Interrupted => {
                complain(&interrupted("interrupted: the same command goes on where it was"));
                return Ok(Exit::Failed);
            }
        };
        let todo: Vec<u64> = (first + found.len() as u64..=last).collect();
        let mut progress = self.progress(last - first + 1, found.len() as u64);
        let mut fault = None;
        let whole = compute(self.base, &todo, self.threads, |record| {
            progress.step();
            journal.add(&record).map_err(|e| fault = Some(e)).is_ok()
        });
        progress.end();
        if let Some(e) = fault {
            complain(&unwritten(&part, &e));
            return Ok(Exit::Failed);
        }
        if !whole {
            complain(&interrupted("interrupted: the same command goes on where it was"));
            return Ok(Exit::Failed);
        }
        journal.finish(&done).map_err(|e| self.fault(e))?;
        Ok(Exit::Done)
    }

    /// The journal of a chunk. An engine that has lost sight of a task gives it out again while the first one is still at work:
    /// the second one waits for the first, whose lock ends with its process. How long a task may take is the engine's to say.
    fn claim(&self, done: &Path, part: &Path) -> Result<Claimed, Diagnostic> {
        let mut announced = false;
        while !done.exists() {
            match Journal::open(part, &self.base.fingerprint) {
                Ok((journal, found)) if !done.exists() => return Ok(Claimed::Ours(journal, found)),
                // The other one has ended meanwhile, and what was opened here is empty.
                Ok(_) => files::remove(part).map_err(|e| self.fault(e))?,
                Err(Refused::Taken) if interrupt::requested() => return Ok(Claimed::Interrupted),
                Err(Refused::Taken) => {
                    if !std::mem::replace(&mut announced, true) && !self.arguments.quiet {
                        tracing::warn!("{}: waiting for it", Refused::Taken.diagnostic(part));
                    }
                    std::thread::sleep(LOOK);
                }
                Err(refused) => return Err(refused.diagnostic(part)),
            }
        }
        Ok(Claimed::Done)
    }

    /// All members that no file has yet, then the results of all.
    fn whole(&self, file: &Scene) -> Result<Exit, Diagnostic> {
        let EnsembleArguments { force, resume, .. } = *self.arguments;
        if self.directory.has_begun() && !force && !resume {
            return Err(self.fault("this directory holds a study that has begun already").try_instead(
                "go on with it with --resume, begin anew with --force, or choose another with --out",
            ));
        }
        // Before the directory is claimed, which removes the summary: who is refused changes nothing.
        if !force {
            self.directory.holds(self.base, file).map_err(|e| self.of_another(e))?;
        }
        let out = self.directory.place();
        let before = files::read(&self.directory.path(run_dir::SUMMARY), files::TEXT).ok().filter(|_| !force);
        // What a study has written may stay; a run that another process writes there is refused.
        let owner =
            Owner::claim(out, &Claim { force: force || self.directory.has_begun(), ..Claim::default() })?;
        if force {
            self.directory.clear().map_err(|e| self.fault(e))?;
        }
        let (mut journal, mut index) = self.open(file).inspect_err(|_| {
            // A damaged chunk is found only now. It is the refusal that the user is told of.
            let _ = before.map(|summary| files::write(&self.directory.path(run_dir::SUMMARY), &summary));
        })?;
        let begun = Instant::now();
        let todo = index.missing();
        let outcome = self.fill(&mut index, &mut journal, &todo);
        drop(journal);
        match outcome {
            Ok(true) => {}
            Ok(false) => {
                let left = index.missing().len();
                let what = format!("interrupted: {left} of {} members are left", self.base.members());
                complain(&interrupted(&what).try_instead("go on with --resume"));
                return Ok(Exit::Failed);
            }
            Err(e) => {
                complain(&unwritten(out, &e));
                return Ok(Exit::Failed);
            }
        }
        let work = Work {
            members: todo.len() as u64,
            threads: self.threads,
            seconds: begun.elapsed().as_secs_f64(),
        };
        self.finish(&index, &owner, &work)
    }

    /// The journal, and all members that are computed already.
    fn open(&self, file: &Scene) -> Result<(Journal, Index), Diagnostic> {
        self.begin(file)?;
        let main = self.directory.main();
        let (journal, found) = Journal::open(&main, &self.base.fingerprint)
            .map_err(|refused| refused.diagnostic(&main).try_instead("begin anew with --force"))?;
        Ok((journal, self.directory.index(self.base, &found)?))
    }

    /// Compute what is missing; the table follows as far as all members before are known. False: a signal has ended it.
    fn fill(&self, index: &mut Index, journal: &mut Journal, todo: &[u64]) -> io::Result<bool> {
        let members = self.base.members();
        let mut table = Table::create(&self.directory.path(MEMBERS), self.base)?;
        let mut reader = index.reader();
        let mut due = 1;
        follow(self.base, index, &mut reader, &mut table, &mut due)?;
        let mut progress = self.progress(members, members - todo.len() as u64);
        let mut fault = None;
        let whole = compute(self.base, todo, self.threads, |record| {
            let mut keep = || {
                index.add(journal.add(&record)?);
                table.add(self.base, &self.base.member(record.number), &record)?;
                due = record.number + 1;
                follow(self.base, index, &mut reader, &mut table, &mut due)
            };
            progress.step();
            keep().map_err(|e| fault = Some(e)).is_ok()
        });
        progress.end();
        if let Some(e) = fault {
            return Err(e);
        }
        journal.sync()?;
        table.sync()?;
        Ok(whole)
    }

    /// Call `each` with every record, in order.
    fn each(&self, index: &Index, each: &mut dyn FnMut(&Record) -> io::Result<()>) -> io::Result<()> {
        let mut reader = index.reader();
        for number in 1..=self.base.members() {
            let record = reader.record(index, number)?.filter(|record| record.fits(self.base));
            each(&record.ok_or_else(|| io::Error::other(format!("member {number} is missing or damaged")))?)?;
        }
        Ok(())
    }

    /// Write what follows from all members, and say how it went.
    fn finish(&self, index: &Index, owner: &Owner, work: &Work) -> Result<Exit, Diagnostic> {
        let mut numbers = Numbers::default();
        let mut all = |each: &mut dyn FnMut(&Record) -> io::Result<()>| self.each(index, each);
        let mut comings = self.barrier.map(|barrier| Comings::new(self.base, barrier));
        all(&mut |record| {
            numbers.add(record.number, &record.outcome);
            comings.iter_mut().for_each(|comings| comings.add(record));
            Ok(())
        })
        .map_err(|e| self.fault(e))?;
        let mut summary = numbers.summary(self.base.study.most_failed);
        let study = Reliability {
            is_unreliable: summary.status != RunStatus::Done,
            doubts: self.base.warnings.len(),
        };
        let found = results::write(self.base, owner.dir(), &study, &mut all).map_err(|e| self.fault(e))?;
        let of_lines = found.sentences.into_iter();
        let notes = of_lines.map(|sentence| Diagnostic::of(Severity::Note, code::OTHER, sentence));
        summary.warnings.splice(1..1, notes);
        summary.measures.extend(found.measures);
        summary.warnings.extend(found.warnings);
        summary.warnings.extend(self.base.warnings.iter().map(|w| self.base.scene.placed(w.clone())));
        summary.cost.insert("wall_s".into(), json!(work.seconds));
        summary.cost.insert("members_computed".into(), json!(work.members));
        summary.cost.insert("threads".into(), json!(work.threads));
        if work.members > 0 {
            summary.cost.insert("members_per_second".into(), json!(work.members as f64 / work.seconds));
        }
        summary.cost.insert("peak_memory_bytes".into(), json!(peak_memory()));
        if let Err(what) = owner.write_summary(&mut summary) {
            complain(&Diagnostic::error(code::NOT_WRITTEN, what));
            return Ok(Exit::Failed);
        }
        if !self.arguments.quiet {
            show(&summary.table(owner.dir()));
        }
        if let Some((comings, barrier)) = comings.zip(self.barrier) {
            let count = self.arguments.worst as usize;
            comings.write(self.base, barrier, &owner.dir().join(worst::FOLDER), count)?;
        }
        if let Err(e) = owner.seal() {
            tracing::warn!("{}: no manifest: {e}", owner.dir().display());
        }
        // With a barrier more follows, and its command says it at its own end.
        if summary.status != RunStatus::Done && self.barrier.is_none() {
            summary.complain();
        }
        Ok(Exit::of(summary.status))
    }
}

fn interrupted(what: &str) -> Diagnostic {
    Diagnostic::error(code::INTERRUPTED, what)
}

fn unwritten(path: &Path, e: &io::Error) -> Diagnostic {
    Diagnostic::error(code::NOT_WRITTEN, e.to_string()).at(Place::file(path.display().to_string()))
}

/// Add to the table the members from `due` on that are known already.
fn follow(
    base: &Base,
    index: &Index,
    reader: &mut Reader,
    table: &mut Table,
    due: &mut u64,
) -> io::Result<()> {
    while *due <= base.members() {
        let Some(record) = reader.record(index, *due)? else { return Ok(()) };
        table.add(base, &base.member(*due), &record)?;
        *due += 1;
    }
    Ok(())
}
