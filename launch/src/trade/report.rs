//! The study as a page (`trade.md`), as a table for programs (`trade.csv`), as a picture (`trade.svg`), and on the screen.

use super::budget::Budget;
use super::knobs::{Class, NET, Point, rung};
use super::result::{CABLE_FORCE, Known, RunOutcome, Status, deviation};
use super::study::{FINEST_ACCURACY, Finished, Recommended, Study};
use crate::front::shell;
use std::collections::BTreeSet;
use std::fmt::Write;
use toolkit::columns::Columns;
use toolkit::numbers::{percent, seconds, short, three};
use toolkit::provenance;

/// What the page says of the study besides its runs.
pub struct Facts {
    /// Name of the scene.
    pub scene: String,
    /// As the user named its file, and the values that are set, for lines to copy.
    pub command: String,
    /// Simulated time [s].
    pub end_time: f64,
    /// Whether there is a structure.
    pub structure: bool,
    /// Budget [s].
    pub budget: Budget,
    /// Processors.
    pub processors: usize,
}

impl Facts {
    /// Passes over both solvers in a millisecond of simulated time.
    fn passes_per_ms(&self, outcome: &RunOutcome) -> Option<f64> {
        outcome.passes.map(|passes| passes / (1e3 * self.end_time))
    }
}

/// A share with its sign.
fn signed(share: f64) -> String {
    if share > 0.0 { format!("+{}", percent(share)) } else { percent(share) }
}

/// One line of a message, not too long, that no table breaks at.
pub fn shortened(message: &str) -> String {
    const LONGEST: usize = 140;
    let line = message.lines().next().unwrap_or_default().replace('|', "/");
    match line.char_indices().nth(LONGEST) {
        Some((at, _)) => format!("{}...", &line[..at]),
        None => line,
    }
}

/// The page.
pub fn page(study: &Study, facts: &Facts) -> String {
    let Facts { scene, command, processors, .. } = facts;
    let (version, runs, date) = (env!("CARGO_PKG_VERSION"), study.runs.len(), provenance::now());
    let (used, budget) = (facts.budget.used_text(study), facts.budget);
    let mut text = format!(
        "# Accuracy against cost: {scene}\n\n`rockfall trade {command}`, version {version}, {date}: {runs} runs, one at a time, {used} of a \
         budget of {budget}, on {processors} processors. How to read it: `docs/trade.md`.\n\n"
    );
    references(study, &mut text);
    recommendations(study, facts, &mut text);
    numerical(study, facts, &mut text);
    models(study, &mut text);
    text
}

fn references(study: &Study, text: &mut String) {
    let scene = study.outcome(&Point::new());
    let reference = &study.reference;
    let known = |name: &String| reference.get(name);
    let with_unit = |value: f64, name: &String| format!("{} {}", short(value), unit(study, name));
    let table = Columns::new()
        .with("measure", |name: &String| format!("`{name}`"))
        .with("scene", |name| {
            let own = scene.and_then(|run| run.measure(name));
            own.map_or("absent".into(), |value| with_unit(value, name))
        })
        .with("reference", |name| known(name).map_or("none".into(), |known| with_unit(known.value, name)))
        .with("uncertainty", |name| known(name).and_then(|k| k.uncertainty).map_or("unknown".into(), percent))
        .with("source", |name| known(name).map_or("given by no run".into(), Known::words));
    let _ = write!(text, "## Reference\n\n{}", table.markdown(&study.measures));
    if let Some(off) = reference.uncertainty().filter(|off| *off > FINEST_ACCURACY) {
        let off = percent(off);
        let _ = writeln!(
            text,
            "The reference has an uncertainty of {off}: errors below that are not significant.\n"
        );
    }
}

/// Unit of a measure.
fn unit<'a>(study: &'a Study, name: &str) -> &'a str {
    study.runs.iter().find_map(|run| run.outcome.measures.get(name)).map_or("", |(_, unit)| unit)
}

fn recommendations(study: &Study, facts: &Facts, text: &mut String) {
    if let Some(why) = unknown(study, facts.budget) {
        let _ = writeln!(text, "## Recommended\n\n{why}.\n");
        return;
    }
    let recommended = study.recommended();
    let of =
        |one: &Recommended, words: &dyn Fn(&Point) -> String| one.point.as_ref().map_or("".into(), words);
    let table = Columns::new()
        .with("accuracy", |one: &Recommended| percent(one.accuracy))
        .with("settings", |one| {
            one.point.as_ref().map_or_else(|| unreached(study), |point| study.space.label(point))
        })
        .with("error", |one| of(one, &|point| error(study, study.outcome(point))))
        .with("processor time, median", |one| {
            of(one, &|point| {
                let runs = study.timed(point).len();
                let plural = if runs == 1 { "" } else { "s" };
                format!("{} ({runs} run{plural})", dash(study.cost(point), seconds))
            })
        })
        .with("run again: error", |one| {
            let unsaid = || "not run again: the budget is used up".into();
            of(one, &|point| {
                study.confirmation(point).map_or_else(unsaid, |run| again(study, one.accuracy, run))
            })
        })
        .with("run again: processor time", |one| {
            of(one, &|point| dash(study.confirmation(point).map(RunOutcome::cost), seconds))
        });
    let _ = write!(
        text,
        "## Recommended\n\nThe cheapest settings whose error stays within an accuracy for all measures, with what the reference may be off itself. It is the {}.\n\n",
        unvaried(study, facts)
    );
    text.push_str(&table.markdown(&recommended));
    lines(study, facts, &recommended, text);
}

/// The error of a recommendation that was run again, and whether it is confirmed.
fn again(study: &Study, accuracy: f64, run: &RunOutcome) -> String {
    match study.bound(run) {
        Some(bound) if bound <= accuracy => error(study, Some(run)),
        Some(_) => format!("not confirmed: {}", error(study, Some(run))),
        None => format!("not confirmed: {}", run.status.word()),
    }
}

/// The error of a run, and what it is at most.
fn error(study: &Study, run: Option<&RunOutcome>) -> String {
    let both = run.and_then(|run| Some((study.error(run)?, study.bound(run)?)));
    both.map_or("-".into(), |(error, bound)| format!("{}, at most {}", percent(error), percent(bound)))
}

/// What the errors say nothing of: whatever else would change the answer, with the largest change one rung finer, or as far as was tried.
fn unvaried(study: &Study, facts: &Facts) -> String {
    let largest = |name: &str| {
        let of = |run: &&Finished| run.point.contains_key(name) && run.outcome.status == Status::Done;
        let changes = study.explored().filter(of).flat_map(|run| {
            let each =
                study.measures.iter().filter_map(|measure| Some((measure, change(study, run, measure)?)));
            each.map(move |(measure, change)| (run, measure, change))
        });
        let finer = |run: &Finished| rung(&run.point, name) == -1.0;
        let (run, measure, change) =
            changes.max_by(|a, b| finer(a.0).cmp(&finer(b.0)).then(a.2.abs().total_cmp(&b.2.abs())))?;
        let value = study.space.knob(name)?.value(rung(&run.point, name))?;
        Some(format!("{name} ({value} changes {measure} by {})", signed(change)))
    };
    let models = study.space.knobs().iter().filter(|knob| knob.class == Class::Model);
    let models = models.map(|knob| largest(knob.name).unwrap_or(format!("{} (not tried)", knob.name)));
    let mesh = facts.structure && study.space.knob(NET).is_none();
    let mesh = mesh.then(|| "the mesh of the structure (not tried)".to_owned());
    let all: Vec<String> = models.chain(mesh).collect();
    let not = if all.is_empty() { String::new() } else { format!("; not in it: {}", all.join(", ")) };
    format!("error of scheme, windows, steps and tolerances{not}")
}

/// How far a measure of another model is from what the scene's own gives in the same windows and steps.
fn change(study: &Study, run: &Finished, measure: &str) -> Option<f64> {
    // A finer net has thinner wires, each of which carries less.
    if run.point.contains_key(NET) && measure == CABLE_FORCE {
        return None;
    }
    let own = study.outcome(&study.space.of_own_model(&run.point))?;
    Some(deviation(run.outcome.measure(measure)?, own.measure(measure)?))
}

/// The command of each recommendation, for those that are the same once.
fn lines(study: &Study, facts: &Facts, recommended: &[Recommended], text: &mut String) {
    let same = |a: &Recommended, b: &Recommended| a.point == b.point;
    for group in recommended.chunk_by(same) {
        let Some(sets) = group[0].point.as_ref().and_then(|point| study.space.sets(point)) else { continue };
        let sets: String = sets.iter().map(|set| format!(" --set {}", shell::join([set]))).collect();
        let accuracies: Vec<String> = group.iter().map(|one| percent(one.accuracy)).collect();
        *text += &format!("{}:\n\n```\nrockfall run {}{sets}\n```\n\n", accuracies.join(", "), facts.command);
    }
}

/// Why nothing is recommended; `None`: something is, or may be.
pub fn unknown(study: &Study, budget: Budget) -> Option<String> {
    if !study.is_alone() {
        return None;
    }
    let more = budget.of_reference(study).unwrap_or("a larger --budget".into());
    Some(format!(
        "nothing is recommended: the only run to compare with is the scene as it is, whose own error is unknown; the same command with \
         {more} adds two runs with finer steps and windows"
    ))
}

fn unreached(study: &Study) -> String {
    let best = study.front().pop().map(|(point, trade)| (percent(trade.error), study.space.label(point)));
    best.map_or("the error of no run is known".into(), |(error, settings)| {
        format!("not reached; the smallest error is {error}, with {settings}")
    })
}

/// How far a measure of a run is from its reference.
fn off(study: &Study, run: &Finished, name: &str) -> Option<f64> {
    Some(deviation(run.outcome.measure(name)?, study.reference.get(name)?.value))
}

/// A value in words, where there is one.
fn dash(value: Option<f64>, words: impl Fn(f64) -> String) -> String {
    value.map_or("-".into(), words)
}

fn numerical(study: &Study, facts: &Facts, text: &mut String) {
    let front: Vec<&Point> = study.front().into_iter().map(|(point, _)| point).collect();
    let error = |run: &Finished| study.error(&run.outcome).filter(|_| !study.is_alone());
    let is_marked = |run: &Finished| front.contains(&&run.point) && error(run).is_some();
    let mut table = Columns::new()
        .with("", |run: &&Finished| if is_marked(run) { "*".into() } else { String::new() })
        .with("settings", |run| study.space.label(&run.point))
        .with("status", |run| status(study, &run.outcome))
        .with("error", |run| dash(error(run), percent));
    for name in &study.measures {
        table = table.with(format!("`{name}`"), move |run| dash(off(study, run, name), signed));
    }
    table = table.with("processor [s]", |run| three(study.cost(&run.point).unwrap_or(run.outcome.cost())));
    let table = costs(table, study, facts, |run| run)
        .with("memory [MB]", |run| dash(run.outcome.memory.map(|bytes| 1e-6 * bytes), three))
        .with("runs", |run| study.timed(&run.point).len().max(1).to_string());
    text.push_str("## Settings of the scene's own model\n\n`*`: on the Pareto front, where no other run is both cheaper and more accurate.\n\n");
    text.push_str(&table.markdown(&sorted(study, Class::Numerical)));
}

fn models(study: &Study, text: &mut String) {
    let runs = sorted(study, Class::Model);
    if runs.is_empty() {
        return;
    }
    let mut table = Columns::new()
        .with("settings", |run: &&Finished| study.space.label(&run.point))
        .with("status", |run| status(study, &run.outcome));
    for name in &study.measures {
        table = table.with(format!("change of `{name}`"), move |run| dash(change(study, run, name), signed));
    }
    let table = table
        .with("`energy_error`", |run| dash(run.outcome.measure("energy_error"), percent))
        .with("processor [s]", |run| three(run.outcome.cost()));
    text.push_str("## Settings that change the model\n\nThese settings define another model, which is neither more nor less accurate than the scene's. Its measures are compared with those of the scene, both computed in the same windows and steps. They are never recommended.\n\n");
    text.push_str(&table.markdown(&runs));
}

/// How a run ended, and why not well.
fn status(study: &Study, outcome: &RunOutcome) -> String {
    if outcome.status == Status::Done {
        let lacks = study.measures.iter().filter(|name| outcome.measure(name).is_none());
        let lacks: Vec<&str> = lacks.map(String::as_str).collect();
        return if lacks.is_empty() { "done".into() } else { format!("done, without {}", lacks.join(", ")) };
    }
    why(outcome)
}

/// How a run ended, with what it said.
pub fn why(outcome: &RunOutcome) -> String {
    match outcome.message() {
        none if none.is_empty() => outcome.status.word().into(),
        message => format!("{}: {}", outcome.status.word(), shortened(&message)),
    }
}

/// First runs of a class: those with an error by their cost, then the others.
fn sorted(study: &Study, class: Class) -> Vec<&Finished> {
    let mut runs: Vec<&Finished> =
        study.explored().filter(|run| study.space.class(&run.point) == class).collect();
    let rank = |run: &Finished| {
        let good = run.outcome.status == Status::Done;
        (!good, study.cost(&run.point).unwrap_or(run.outcome.cost()))
    };
    runs.sort_by(|a, b| rank(a).0.cmp(&rank(b).0).then(rank(a).1.total_cmp(&rank(b).1)));
    runs
}

/// What a run costs, by stage and process, and how well it keeps its energy: the same columns for the page and for programs.
fn costs<'a, R>(
    table: Columns<'a, R>,
    study: &'a Study,
    facts: &'a Facts,
    of: impl Fn(&R) -> &Finished + Copy + 'a,
) -> Columns<'a, R> {
    let table = table
        .number("energy error", move |row| of(row).outcome.measure("energy_error"))
        .number("wall s", move |row| Some(of(row).outcome.wall))
        .number("loop s", move |row| of(row).outcome.time_loop);
    let processes: BTreeSet<&String> = study.runs.iter().flat_map(|run| run.outcome.cpu.keys()).collect();
    let table = processes.into_iter().fold(table, |table, name| {
        table.number(format!("cpu {name} s"), move |row| of(row).outcome.cpu.get(name).copied())
    });
    table.number("passes per ms", move |row| facts.passes_per_ms(&of(row).outcome))
}

/// All runs, repeats too, one a line.
pub fn table(study: &Study, facts: &Facts) -> Result<String, csv::Error> {
    let front: Vec<&Point> = study.front().into_iter().map(|(point, _)| point).collect();
    let class = |run: &Finished| study.space.class(&run.point);
    let is_own = |run: &Finished| class(run) == Class::Numerical;
    let mut table = Columns::new()
        .with("run", |(number, _): &(usize, &Finished)| (number + 1).to_string())
        .with("purpose", |(_, run)| format!("{:?}", run.purpose).to_lowercase())
        .with("class", |(_, run)| format!("{:?}", class(run)).to_lowercase())
        .with("on_front", |(_, run)| (is_own(run) && front.contains(&&run.point)).to_string())
        .text("settings", |(_, run)| study.space.label(&run.point))
        .text("sets", |(_, run)| run.sets.join(" "))
        .with("status", |(_, run)| run.outcome.status.word().into())
        .number("error", |(_, run)| study.error(&run.outcome).filter(|_| is_own(run)))
        .number("error_at_most", |(_, run)| study.bound(&run.outcome).filter(|_| is_own(run)));
    for name in &study.measures {
        table = table
            .number(name, move |(_, run)| run.outcome.measure(name))
            .number(format!("{name}_error"), move |(_, run)| off(study, run, name));
    }
    let table = table.number("processor s", |(_, run)| Some(run.outcome.cost()));
    let table = costs(table, study, facts, |(_, run)| run)
        .number("peak memory bytes", |(_, run)| run.outcome.memory)
        .number("command s", |(_, run)| Some(run.outcome.seconds))
        .text("message", |(_, run)| shortened(&run.outcome.message()));
    table.csv(&study.runs.iter().enumerate().collect::<Vec<_>>())
}

/// What the page begins with, for the screen.
pub fn screen(study: &Study, facts: &Facts) -> String {
    let mut text = String::new();
    references(study, &mut text);
    recommendations(study, facts, &mut text);
    text
}
