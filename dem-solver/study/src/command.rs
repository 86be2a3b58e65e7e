//! `dem-solver ensemble`: a study from its file to its results.

use super::base::Base;
use super::calibrate::Calibration;
use super::directory::{Directory, Index};
use super::preview::Preview;
use super::record::{All, Found, Journal, Record, taken};
use super::results::design::Reliability;
use super::runner::Runner;
use super::settings::StudySettings;
use super::summary::Numbers;
use super::table::Table;
use super::until::Until;
use super::worst::BarrierHits;
use super::worst::barrier::Barrier;
use super::{gate, results};
use clap::{ArgMatches, Args, FromArgMatches};
use dem_terrain::kept;
use interface_defs::diagnostic::{Diagnostic, Place, Severity, code};
use interface_defs::ipc::interrupt;
use interface_defs::ipc::serve::peak_memory;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};
use toolkit::arguments::{Computation, EnsembleArguments, MemberRange};
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::owner::{Claim, Owner};
use toolkit::program::Extra;
use toolkit::progress::{Line, Reporter};
use toolkit::scene::{STUDY, Scene};
use toolkit::screen::{complain, show};
use toolkit::summary::{RunStatus, Summary};
use toolkit::{files, manifest, run_dir};

/// The subcommand.
pub const COMMAND: Extra = Extra { command, run };

/// How often the screen shows how far it is.
const BAR_INTERVAL: Duration = Duration::from_millis(500);
/// The same in lines where the screen is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(30);

fn command() -> clap::Command {
    EnsembleArguments::augment_args(
        clap::Command::new("ensemble")
            .bin_name("rockfall ensemble")
            .about("Many releases of one rock on one terrain: a table with a row for each, quantiles"),
    )
}

/// How often a task that waits for another looks whether it has ended.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// How far it is, for those who look.
struct Progress {
    reporter: Reporter,
    bar: bool,
    /// How often it is shown.
    every: Duration,
    line: Line,
    begun: Instant,
    before: f64,
    shown: Instant,
}

impl Progress {
    fn step(&mut self) {
        self.line.t += 1.0;
        self.line.windows += 1;
        self.reporter.report(|| self.line.clone());
        if self.shown.elapsed() >= self.every {
            self.shown = Instant::now();
            let (Line { t, end, .. }, elapsed) = (&self.line, self.begun.elapsed());
            let rate = (t - self.before) / elapsed.as_secs_f64();
            let left = self.line.left(elapsed, self.before).unwrap_or(0.0);
            let (from, to) = if self.bar { ("\r", "   ") } else { ("", "\n") };
            let _ = write!(io::stderr(), "{from}{t} of {end} members, {rate:.1}/s, {left:.0} s left{to}");
        }
    }

    fn end(&self) {
        if self.bar && self.shown > self.begun {
            let _ = writeln!(io::stderr());
        }
    }
}

pub(super) struct Study<'a> {
    base: Base,
    directory: Directory,
    computation: &'a Computation,
    threads: usize,
    /// How long reading and preparing has taken [s].
    load: f64,
    /// A barrier, and how many of the worst members are chosen for it.
    barrier: Option<(&'a Barrier, usize)>,
    until: Option<Until<'a>>,
    /// What its members are compared with.
    calibration: Option<&'a Calibration>,
}

fn run(matches: &ArgMatches) -> Result<Exit, Diagnostic> {
    let arguments =
        EnsembleArguments::from_arg_matches(matches).map_err(|e| Diagnostic::new(e.to_string()))?;
    let ended = ensemble(&arguments);
    if let (Format::Json, Err(e)) = (arguments.format, &ended) {
        show(&format!("{}\n", json!({ "errors": [e] })));
    }
    ended
}

fn ensemble(arguments: &EnsembleArguments) -> Result<Exit, Diagnostic> {
    let (sets, of_barrier) = arguments.sets()?;
    let file = Scene::load_as(&STUDY, &arguments.study, &sets)
        .map_err(|e| of_scene(&sets).or_else(|| no_study(&arguments.study, STUDY.name)).unwrap_or(e))?;
    if let Some(count) = arguments.chunks {
        let members = StudySettings::of(&file)?.members();
        let parts = MemberRange::parts(members, count);
        show(&parts.iter().map(|part| format!("{part}\n")).collect::<String>());
        return Ok(Exit::Done);
    }
    let (barrier, file) = Barrier::of(arguments, &of_barrier, file)?;
    let computation = &arguments.computation;
    let directory = Directory::new(&computation.dir.of(&file));
    let kept = [directory.path(run_dir::CLUSTERS)];
    let begun = Instant::now();
    // Of the tasks of a machine one prepares the terrain, and those that wait for it share its memory.
    let waits = arguments.members.is_some() && !kept[0].join(kept::NAME).exists();
    let turn = files::input(&arguments.study).ok().filter(|turn| waits && turn.lock().is_ok());
    let base = gate::read(&file, !computation.savings.no_shortcuts, &kept)?;
    let until = Until::of(arguments, &base)?;
    if let Some(range) = &arguments.members
        && (range.first == 0 || range.last > base.members() || range.first > range.last)
    {
        let what =
            format!("{}..{}: the members of this study are 1..{}", range.first, range.last, base.members());
        return Err(Diagnostic::in_file("--members", what));
    }
    let study = Study { until, ..Study::new(base, directory, computation) };
    if arguments.dry_run {
        let preview = Preview::new(&study.base, &file, study.threads)?;
        show(&match arguments.format {
            Format::Text => preview.text(),
            Format::Json => format!("{}\n", preview.json()),
        });
        return Ok(Exit::Done);
    }
    if !computation.quiet {
        study.warn();
        barrier.iter().flat_map(Barrier::notices).for_each(|notice| tracing::info!("{notice}"));
    }
    interrupt::install();
    if arguments.watched {
        // The same command again is to find the directory free.
        let watched = interrupt::end_with_parent();
        watched.map_err(|e| Diagnostic::new(format!("the end of rockfall cannot be watched: {e}")))?;
    }
    let load = begun.elapsed().as_secs_f64();
    let worst = arguments.worst as usize;
    let mut study = Study { barrier: barrier.as_ref().map(|barrier| (barrier, worst)), load, ..study };
    if let Some(number) = arguments.scene_of {
        return study.one_scene(number, arguments.output.as_deref());
    }
    match &arguments.members {
        Some(range) => {
            study.begin(&file)?;
            study.share_ground();
            drop(turn);
            study.chunk(range.first, range.last)
        }
        None => study.whole(&file),
    }
}

/// What is said of a scene where a study, or a calibration, is asked for; `None`: it is something else.
pub(super) fn no_study(path: &Path, asked: &str) -> Option<Diagnostic> {
    let table: toml::Table =
        String::from_utf8(files::read_input(path, files::TEXT).ok()?).ok()?.parse().ok()?;
    let has = |key: &str| table.contains_key(key);
    let (is, cure) = match () {
        () if has("scene") && has("release") => ("a study", "rockfall ensemble computes it"),
        () if has("study") => ("a calibration", "rockfall calibrate computes it"),
        () if has("kit") => ("a kit", "rockfall approve tests it"),
        () if has("end_time") => (
            "a scene",
            "rockfall run computes it; a study names it, scene = \"FILE\", and says in [[release]] where rocks start",
        ),
        () => return None,
    };
    if is.ends_with(asked) {
        return None;
    }
    let what = format!("this is {is}, and a {asked} is asked for here");
    Some(Diagnostic::in_file(path.display(), what).coded(code::ARGUMENT).try_instead(cure))
}

/// Tables and keys of a scene that a study varies.
const OF_SCENE: [&str; 7] = ["rock", "terrain", "contact", "dem", "limits", "gravity", "end_time"];

/// What is said of a `--set` of a key of the scene, which a study has in `[vary]`.
fn of_scene(sets: &[String]) -> Option<Diagnostic> {
    sets.iter().find_map(|set| {
        let key = set.strip_prefix("scene.").unwrap_or(set);
        let first = key.split(['.', '=']).next()?;
        if !OF_SCENE.contains(&first) {
            return None;
        }
        let what = "this is a key of the scene, not of the study";
        // Only keys of a table are varied.
        let cure = match key.split_once('=').is_some_and(|(name, _)| name.contains('.')) {
            true => format!("--set vary.{key} is it for all members of the study"),
            false => format!("write {key} in the scene, for all members of the study"),
        };
        Some(Diagnostic::in_file(format!("--set {set}"), what).coded(code::ARGUMENT).try_instead(cure))
    })
}

impl<'a> Study<'a> {
    /// A study whose results go to `directory`.
    pub(super) fn new(base: Base, directory: Directory, computation: &'a Computation) -> Self {
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = computation.threads.map_or(available, |n| n as usize);
        Self {
            base,
            directory,
            computation,
            threads,
            load: 0.0,
            barrier: None,
            until: None,
            calibration: None,
        }
    }

    /// The same, whose members are compared with what was observed.
    pub(super) fn compared(self, calibration: &'a Calibration) -> Self {
        Self { calibration: Some(calibration), ..self }
    }

    /// Say what the user should look at twice.
    pub(super) fn warn(&self) {
        let all = self.base.warnings.iter();
        all.for_each(|warning| tracing::warn!("{}", self.base.scene.placed(warning.clone())));
    }

    /// Write the scene of one member to a file or on the screen, with the barrier where one is named.
    fn one_scene(&self, number: u64, output: Option<&Path>) -> Result<Exit, Diagnostic> {
        let base = &self.base;
        if number > base.members() {
            let what = format!("{number}: the members of this study are 1..{}", base.members());
            return Err(Diagnostic::in_file("--scene-of", what));
        }
        let text = match self.barrier {
            Some((barrier, _)) => BarrierHits::new(base, barrier).scene_of_one(number)?,
            None => {
                let member = base.member(number);
                base.text(&member, "", &base.scene_of(&member)?)?
            }
        };
        match output {
            None => show(&text),
            Some(path) => files::write(path, text.as_bytes())
                .map_err(|e| Diagnostic::in_file(path.display(), format!("cannot be written: {e}")))?,
        }
        Ok(Exit::Done)
    }

    /// Make the directory that of this study.
    fn begin(&self, file: &Scene) -> Result<(), Diagnostic> {
        self.directory.begin(&self.base, file).map_err(|e| self.of_another(e))
    }

    /// Hold the terrain in memory once with the other tasks of this machine. Where that cannot be, this one has its own.
    fn share_ground(&mut self) {
        let (folder, base) = (self.directory.path(run_dir::CLUSTERS), &mut self.base);
        let terrain = Arc::get_mut(&mut base.ground).zip(base.settings.terrain.as_ref());
        let Some((ground, settings)) = terrain.filter(|(ground, _)| !ground.is_shared()) else { return };
        let shared = files::Dir::create(&folder).and_then(|_| ground.share(&folder, &base.scene, settings));
        if let Err(e) = shared {
            tracing::warn!("{}: the prepared terrain cannot be written: {e}", folder.display());
        }
    }

    /// What to try where the directory holds another study.
    fn of_another(&self, e: Diagnostic) -> Diagnostic {
        let cure = "a study that was computed without the line of the barrier holds no rock that crosses it: choose another directory with \
                    --out, or begin anew with --force";
        if self.barrier.is_some() { e.try_instead(cure) } else { e }
    }

    fn progress(&self, total: u64, before: u64) -> Progress {
        let (reporter, begun) = (Reporter::new(self.computation.progress), Instant::now());
        let bar = !self.computation.quiet && io::stderr().is_terminal();
        let every = match bar {
            _ if self.computation.quiet => Duration::MAX,
            true => BAR_INTERVAL,
            false => LINE_INTERVAL,
        };
        let (end, t) = (total as f64, before as f64);
        let line = Line { t, end, windows: before, what: "members".into(), ..Line::default() };
        Progress { reporter, bar, every, line, begun, before: t, shown: begun }
    }

    /// The members from `first` to `last` into a file of their own, which gets its name when it is complete.
    fn chunk(&self, first: u64, last: u64) -> Result<Exit, Diagnostic> {
        let [done, part] = self.directory.chunk(first, last);
        let interrupted = || {
            let what = "interrupted: the same command goes on where it was";
            failed(&Diagnostic::error(code::INTERRUPTED, what))
        };
        let (mut journal, found) = match self.claim(&done, &part)? {
            Some(ours) => ours,
            // A task that is given out twice does nothing the second time.
            None if done.exists() => return Ok(Exit::Done),
            None => return interrupted(),
        };
        let todo: Vec<u64> = (first + found.len() as u64..=last).collect();
        match self.compute(&todo, last - first + 1, &mut |record| journal.add(&record).map(drop)) {
            Err(e) => return failed(&unwritten(&part, &e)),
            Ok(false) => return interrupted(),
            Ok(true) => journal.finish(&done).map_err(|e| self.directory.fault(e))?,
        }
        Ok(Exit::Done)
    }

    /// Compute the members `todo` of `total` and give them to `keep` in their order. False: a signal has ended it.
    fn compute(
        &self,
        todo: &[u64],
        total: u64,
        keep: &mut dyn FnMut(Record) -> io::Result<()>,
    ) -> io::Result<bool> {
        let mut progress = self.progress(total, total - todo.len() as u64);
        let mut fault = Ok(());
        let whole = compute(&self.base, todo, self.threads, |record| {
            progress.step();
            fault = keep(record);
            fault.is_ok()
        });
        progress.end();
        fault.map(|()| whole)
    }

    /// The journal of a chunk. An engine that has lost sight of a task gives it out again while the first one is still at work:
    /// the second one waits for the first, whose lock ends with its process. How long a task may take is the engine's to say.
    ///
    /// `None`: it is complete, or a signal has ended the wait.
    fn claim(&self, done: &Path, part: &Path) -> Result<Option<(Journal, Vec<Found>)>, Diagnostic> {
        let mut announced = self.computation.quiet;
        while !done.exists() {
            match Journal::open(part, &self.base.fingerprint)? {
                Some(ours) if !done.exists() => return Ok(Some(ours)),
                // The other one has ended meanwhile, and what was opened here is empty.
                Some(_) => files::remove(part).map_err(|e| self.directory.fault(e))?,
                None if interrupt::requested() => break,
                None => {
                    if !std::mem::replace(&mut announced, true) {
                        tracing::warn!("{}: waiting for it", taken(part));
                    }
                    std::thread::sleep(POLL_INTERVAL);
                }
            }
        }
        Ok(None)
    }

    /// All members that no file has yet, then the results of all.
    pub(super) fn whole(mut self, file: &Scene) -> Result<Exit, Diagnostic> {
        let Computation { force, resume, .. } = *self.computation;
        if self.directory.has_begun() && !force && !resume {
            return Err(self
                .directory
                .fault("this directory holds a study that has begun already")
                .try_instead(
                    "go on with it with --resume, begin anew with --force, or choose another with --out",
                ));
        }
        // Before the directory is claimed, which removes the summary: who is refused changes nothing.
        if !force {
            self.directory.holds(&self.base, file).map_err(|e| self.of_another(e))?;
        }
        let out = self.directory.place();
        let before = files::read(&self.directory.path(run_dir::SUMMARY), files::TEXT).ok().filter(|_| !force);
        // What a study has written may stay; a run that another process writes there is refused.
        let owner =
            Owner::claim(out, &Claim { force: force || self.directory.has_begun(), ..Claim::default() })?;
        if force {
            self.directory.clear().map_err(|e| self.directory.fault(e))?;
        }
        let (mut journal, mut index) = self.open(file).inspect_err(|_| {
            // A damaged chunk is found only now. It is the refusal that the user is told of.
            let _ = before.map(|summary| files::write(&self.directory.path(run_dir::SUMMARY), &summary));
        })?;
        let begun = Instant::now();
        let mut computed = 0;
        loop {
            let members = self.base.members();
            let todo = index.missing(members);
            computed += todo.len();
            match self.fill(&mut index, &mut journal, &todo) {
                Ok(true) => {}
                Ok(false) => {
                    let left = index.missing(members).len();
                    let what = format!("interrupted: {left} of {members} members are left");
                    return failed(
                        &Diagnostic::error(code::INTERRUPTED, what).try_instead("go on with --resume"),
                    );
                }
                Err(e) => return failed(&unwritten(self.directory.place(), &e)),
            }
            let Some(until) = &self.until else { break };
            let next = until.next(&self.base, &mut |each| self.each(&mut index, each));
            let Some(replicates) = next.map_err(|e| self.directory.fault(e))? else { break };
            self.base.repeat(replicates);
            self.begin(file)?;
        }
        drop(journal);
        self.finish(&mut index, &owner, computed, begun.elapsed().as_secs_f64())
    }

    /// The journal, and all members that are computed already.
    fn open(&self, file: &Scene) -> Result<(Journal, Index), Diagnostic> {
        self.begin(file)?;
        let main = self.directory.main();
        let opened = Journal::open(&main, &self.base.fingerprint);
        let (journal, found) = opened
            .and_then(|ours| ours.ok_or_else(|| taken(&main)))
            .map_err(|refused| refused.try_instead("begin anew with --force"))?;
        let most = self.until.as_ref().map_or(self.base.members(), |until| until.members(&self.base));
        Ok((journal, self.directory.index(&self.base, &found, most)?))
    }

    /// Compute what is missing; the table follows as far as all members before are known. False: a signal has ended it.
    fn fill(&self, index: &mut Index, journal: &mut Journal, todo: &[u64]) -> io::Result<bool> {
        let mut table = Table::create(&self.directory.path(run_dir::MEMBERS), &self.base)?;
        follow(&self.base, index, &mut table, 1)?;
        let whole = self.compute(todo, self.base.members(), &mut |record| {
            index.add(journal.add(&record)?);
            let due = record.number + 1;
            table.add(record)?;
            follow(&self.base, index, &mut table, due)
        })?;
        journal.sync()?;
        table.sync()?;
        Ok(whole)
    }

    /// Call `each` with every record, in order.
    fn each(&self, index: &mut Index, each: &mut dyn FnMut(&Record) -> io::Result<()>) -> io::Result<()> {
        for number in 1..=self.base.members() {
            let record = index.record(number)?.filter(|record| record.fits(&self.base));
            each(&record.ok_or_else(|| io::Error::other(format!("member {number} is missing or damaged")))?)?;
        }
        Ok(())
    }

    /// Write what follows from all members, and say how it went.
    ///
    /// So many members were computed now, in so many `seconds`.
    fn finish(
        &self,
        index: &mut Index,
        owner: &Owner,
        computed: usize,
        seconds: f64,
    ) -> Result<Exit, Diagnostic> {
        let mut all = |each: &mut dyn FnMut(&Record) -> io::Result<()>| self.each(index, each);
        let (mut summary, shown, hits) = match self.calibration {
            Some(calibration) => match calibration.conclude(&self.base, owner.dir(), &mut all) {
                Ok((summary, shown)) => (summary, shown, None),
                Err(why) => return failed(&why),
            },
            None => {
                let (summary, hits) = self.results(owner, &mut all).map_err(|e| self.directory.fault(e))?;
                (summary, String::new(), hits)
            }
        };
        let mut cost = |name: &str, value: Value| drop(summary.cost.insert(name.into(), value));
        cost("load_s", json!(self.load));
        cost("wall_s", json!(seconds));
        cost("members_computed", json!(computed));
        cost("threads", json!(self.threads));
        if computed > 0 {
            cost("members_per_second", json!(computed as f64 / seconds));
        }
        cost("peak_memory_bytes", json!(peak_memory()));
        if let Err(what) = owner.write_summary(&mut summary) {
            return failed(&Diagnostic::error(code::NOT_WRITTEN, what));
        }
        show(&shown);
        if !self.computation.quiet {
            show(&summary.table(owner.dir()));
        }
        if let (Some(hits), Some((_, worst))) = (hits, self.barrier) {
            hits.write(&owner.dir().join(run_dir::BARRIER), worst)?;
        }
        manifest::seal(owner.dir());
        // With a barrier more follows, and its command says it at its own end.
        if summary.status != RunStatus::Done && self.barrier.is_none() {
            summary.complain();
        }
        Ok(Exit::of(summary.status))
    }

    /// Write what follows from all members; the summary, and what they bring to the line of a barrier.
    fn results(&self, owner: &Owner, all: All) -> io::Result<(Summary, Option<BarrierHits<'_>>)> {
        let mut numbers = Numbers::default();
        let mut hits = self.barrier.map(|(barrier, _)| BarrierHits::new(&self.base, barrier));
        all(&mut |record| {
            numbers.add(record.number, &record.outcome);
            hits.iter_mut().for_each(|hits| hits.add(record));
            Ok(())
        })?;
        let deep = numbers.too_deep(&self.base.limits);
        let mut summary = numbers.summary(self.base.study.most_failed);
        summary.warnings.extend(deep);
        let study = Reliability {
            is_unreliable: summary.status != RunStatus::Done,
            doubts: self.base.warnings.len(),
        };
        self.directory.sweep()?;
        // No task needs it any more.
        let prepared = self.directory.path(run_dir::CLUSTERS).join(kept::NAME);
        files::remove(&prepared)?;
        let found = results::write(&self.base, owner.dir(), &study, all)?;
        let of_lines = found.sentences.into_iter();
        let notes = of_lines.map(|sentence| Diagnostic::of(Severity::Note, code::OTHER, sentence));
        summary.warnings.splice(1..1, notes);
        summary.measures.extend(found.measures);
        summary.warnings.extend(found.warnings);
        summary.warnings.extend(self.base.warnings.iter().map(|w| self.base.scene.placed(w.clone())));
        match self.until.as_ref().map(|until| until.judge(&self.base, &summary.measures)) {
            Some(Ok(note)) => summary.warnings.insert(1, note),
            Some(Err(doubt)) => {
                let doubts = [std::mem::take(&mut summary.reasons), vec![doubt]].concat();
                summary.doubt(doubts);
            }
            None => {}
        }
        Ok((summary, hits))
    }
}

/// It ends here, and what was computed is kept.
fn failed(why: &Diagnostic) -> Result<Exit, Diagnostic> {
    complain(why);
    Ok(Exit::Failed)
}

fn unwritten(path: &Path, e: &io::Error) -> Diagnostic {
    Diagnostic::error(code::NOT_WRITTEN, e.to_string()).at(Place::file(path.display()))
}

/// Add to the table the members from `due` on that are known already.
fn follow(base: &Base, index: &mut Index, table: &mut Table, due: u64) -> io::Result<()> {
    for number in due..=base.members() {
        let Some(record) = index.record(number)? else { break };
        table.add(record)?;
    }
    Ok(())
}

/// Members that may be computed before one that takes long: what is known of them waits in memory.
const MAX_AHEAD: usize = 4096;
/// How long a core waits for the others before it looks again.
const WAIT: Duration = Duration::from_millis(2);

/// Compute the members `todo`, on `threads` threads; `take` gets them in that order. False: a signal, or `take`, has ended it.
fn compute(base: &Base, todo: &[u64], threads: usize, mut take: impl FnMut(Record) -> bool) -> bool {
    let (next, taken, ended) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    let (to_main, from_all) = channel::<(usize, Option<Record>)>();
    let work = |to_main: Sender<(usize, Option<Record>)>| {
        let mut runner = Runner::new(base);
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(number) = todo.get(at) else { return };
            while at > taken.load(Ordering::Relaxed) + MAX_AHEAD && !ended.load(Ordering::Relaxed) {
                std::thread::sleep(WAIT);
            }
            if ended.load(Ordering::Relaxed) || interrupt::requested() {
                let _ = to_main.send((at, None));
                return;
            }
            let outcome = runner.run(&base.member(*number));
            let record = outcome.map(|(outcome, track)| Record { number: *number, outcome, track });
            let stop = record.is_none();
            if to_main.send((at, record)).is_err() || stop {
                return;
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let to_main = to_main.clone();
            scope.spawn(|| work(to_main));
        }
        drop(to_main);
        let mut early = BTreeMap::new();
        let mut due = 0;
        for (at, record) in from_all {
            early.insert(at, record);
            while let Some(record) = early.remove(&due) {
                due += 1;
                taken.store(due, Ordering::Relaxed);
                if ended.load(Ordering::Relaxed) || !record.is_some_and(&mut take) {
                    ended.store(true, Ordering::Relaxed);
                }
            }
        }
        due == todo.len() && !ended.load(Ordering::Relaxed)
    })
}
