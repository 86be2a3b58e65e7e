//! The study as a page (`trade.md`), as a table for programs (`trade.csv`), and on the screen.

use super::knobs::Class;
use super::point::Point;
use super::result::{Outcome, Status};
use super::study::{Finished, Recommended, Study};
use interface_defs::toolkit::summary::{short, three};
use std::fmt::Write;

/// What the page says of the study besides its runs.
pub struct Facts {
    /// Name of the scene.
    pub scene: String,
    /// As the user named its file, and the values that are set, for lines to copy.
    pub command: String,
    /// Simulated time [s].
    pub end_time: f64,
    /// Budget [s].
    pub budget: f64,
    /// Processors.
    pub processors: usize,
}

/// A share as a percentage of three digits.
pub fn percent(share: f64) -> String {
    format!("{} %", three(100.0 * share))
}

/// A share with its sign.
fn signed(share: f64) -> String {
    if share > 0.0 { format!("+{}", percent(share)) } else { percent(share) }
}

/// Seconds as a person writes them.
pub fn seconds(value: f64) -> String {
    if value >= 100.0 {
        format!("{:.0} min {:02.0} s", (value / 60.0).floor(), value % 60.0)
    } else {
        format!("{} s", three(value))
    }
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
    let mut text = String::new();
    let _ = writeln!(text, "# Accuracy against cost: {}\n", facts.scene);
    let _ = writeln!(
        text,
        "`rockfall trade {}`, version {}: {} runs, one at a time, {} of a budget of {}, on {} processors. How to read it: `docs/trade.md`.\n",
        facts.command,
        env!("CARGO_PKG_VERSION"),
        study.runs.len(),
        seconds(study.spent()),
        seconds(facts.budget),
        facts.processors
    );
    references(study, &mut text);
    recommendations(study, facts, &mut text);
    numerical(study, facts, &mut text);
    models(study, &mut text);
    text
}

fn references(study: &Study, text: &mut String) {
    text.push_str("## Reference\n\n| measure | scene | reference | may be off by | where it comes from |\n|---|---|---|---|---|\n");
    let scene = study.outcome(&Point::new());
    let reference = &study.reference;
    for name in &study.measures {
        let own = scene.and_then(|run| run.measures.get(name));
        let unit = unit(study, name);
        let known = reference.0.iter().find(|(measure, _)| measure == name).map(|(_, known)| known);
        let off = known.and_then(|known| known.uncertainty).map_or("unknown".into(), percent);
        let value = known.map_or("none".into(), |known| format!("{} {unit}", short(known.value)));
        let _ = writeln!(
            text,
            "| `{name}` | {} | {value} | {off} | {} |",
            own.map_or("absent".into(), |(value, unit)| format!("{} {unit}", short(*value))),
            known.map_or("no run gives it".into(), super::reference::Known::words)
        );
    }
    let finest = study.accuracies.iter().copied().fold(f64::INFINITY, f64::min);
    if let Some(off) = reference.uncertainty().filter(|off| *off > finest) {
        let _ = writeln!(
            text,
            "\nThe reference itself may be off by {}: errors below that say nothing.",
            percent(off)
        );
    }
    text.push('\n');
}

/// Unit of a measure.
fn unit<'a>(study: &'a Study, name: &str) -> &'a str {
    study.runs.iter().find_map(|run| run.record.outcome.measures.get(name)).map_or("", |(_, unit)| unit)
}

fn recommendations(study: &Study, facts: &Facts, text: &mut String) {
    if let Some(why) = unknown(study) {
        let _ = writeln!(text, "## Recommended\n\n{why}.\n");
        return;
    }
    text.push_str("## Recommended\n\nThe cheapest settings that keep an accuracy in all measures, at the scene's own model.\n\n");
    text.push_str("| accuracy | settings | error | wall time, median | run again: error | run again: wall time |\n|---|---|---|---|---|---|\n");
    let recommended = study.recommended();
    for one in &recommended {
        let accuracy = percent(one.accuracy);
        let Some(point) = &one.point else {
            let _ = writeln!(text, "| {accuracy} | {} | | | | |", unreached(study));
            continue;
        };
        let error = |run: Option<&Outcome>| run.and_then(|run| study.error(run));
        let again = study.confirmation(point);
        let _ = writeln!(
            text,
            "| {accuracy} | {} | {} | {} ({} run{}) | {} | {} |",
            study.space.label(point),
            error(study.outcome(point)).map_or("-".into(), percent),
            study.cost(point).map_or("-".into(), seconds),
            study.timed(point).len(),
            if study.timed(point).len() == 1 { "" } else { "s" },
            match (again, error(again)) {
                (None, _) => "not run again: no budget was left".into(),
                (Some(run), None) => format!("does not hold: {}", run.status.word()),
                (Some(_), Some(error)) if error > one.accuracy =>
                    format!("does not hold: {}", percent(error)),
                (Some(_), Some(error)) => percent(error),
            },
            again.map_or("-".into(), |run| seconds(run.wall))
        );
    }
    text.push('\n');
    lines(study, facts, &recommended, text);
}

/// The command of each recommendation, for those that are the same once.
fn lines(study: &Study, facts: &Facts, recommended: &[Recommended], text: &mut String) {
    let same = |a: &Recommended, b: &Recommended| a.point == b.point;
    for group in recommended.chunk_by(same) {
        let Some(sets) = group[0].point.as_ref().and_then(|point| study.space.sets(point)) else { continue };
        let sets: String = sets.iter().fold(String::new(), |all, set| all + " --set " + &quoted(set));
        let accuracies: Vec<String> = group.iter().map(|one| percent(one.accuracy)).collect();
        let _ =
            writeln!(text, "{}:\n\n```\nrockfall run {}{sets}\n```\n", accuracies.join(", "), facts.command);
    }
}

/// As a shell reads it as one word.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._=-+/:,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Why nothing is recommended; `None`: something is, or may be.
pub fn unknown(study: &Study) -> Option<String> {
    if !study.is_alone() {
        return None;
    }
    let budget = super::plan::budget_of_reference(study);
    let more = budget.map_or("a larger --budget".into(), |b| format!("--budget {:.0}m", (b / 60.0).ceil()));
    Some(format!(
        "nothing is recommended: the scene as it is is the only run to compare with, and its own error is not known; the same command \
         with {more} adds two runs with finer steps and windows"
    ))
}

fn unreached(study: &Study) -> String {
    let trades = study.trades();
    let numbers: Vec<_> = trades.iter().map(|(_, trade)| *trade).collect();
    match super::front::best(&numbers) {
        Some(best) => format!(
            "nothing reached it; the best is {} with {}",
            percent(numbers[best].error),
            study.space.label(trades[best].0)
        ),
        None => "no run has an error".into(),
    }
}

fn numerical(study: &Study, facts: &Facts, text: &mut String) {
    let front = study.front();
    let processes = processes(study);
    text.push_str("## Settings that compute the scene's own model\n\n`*`: on the front, nothing is both cheaper and more accurate.\n\n");
    let errors: String = study.measures.iter().map(|name| format!(" `{name}` |")).collect();
    let cpu: String = processes.iter().map(|name| format!(" CPU {name} [s] |")).collect();
    let _ = writeln!(
        text,
        "| | settings | status | error |{errors} `energy_error` | wall [s] | loop [s] |{cpu} passes per ms | memory [MB] | runs |"
    );
    let _ = writeln!(text, "|{}", "---|".repeat(10 + study.measures.len() + processes.len()));
    for run in sorted(study, Class::Numerical) {
        let outcome = &run.record.outcome;
        let reference = &study.reference;
        let error = study.error(outcome).filter(|_| !study.is_alone());
        let mark = if front.contains(&run.point) && error.is_some() { "*" } else { "" };
        let _ = write!(text, "| {mark} | {} | {} |", study.space.label(&run.point), status(study, outcome));
        let _ = write!(text, " {} |", error.map_or("-".into(), percent));
        for name in &study.measures {
            let known = reference.0.iter().find(|(measure, _)| measure == name);
            let off = outcome
                .measure(name)
                .zip(known)
                .map(|(v, (_, known))| super::reference::deviation(v, known.value));
            let _ = write!(text, " {} |", off.map_or("-".into(), signed));
        }
        let _ = write!(text, " {} |", outcome.measure("energy_error").map_or("-".into(), percent));
        let cost = study.cost(&run.point).unwrap_or(outcome.wall);
        let _ = write!(text, " {} | {} |", three(cost), outcome.time_loop.map_or("-".into(), three));
        for name in &processes {
            let _ = write!(text, " {} |", outcome.cpu.get(name).map_or("-".into(), |s| three(*s)));
        }
        let per_ms = outcome.passes.map(|passes| passes / (1e3 * facts.end_time));
        let memory = outcome.memory.map(|bytes| 1e-6 * bytes);
        let dash = |value: Option<f64>| value.map_or("-".into(), three);
        let _ = writeln!(
            text,
            " {} | {} | {} |",
            dash(per_ms),
            dash(memory),
            study.timed(&run.point).len().max(1)
        );
    }
    text.push('\n');
}

fn models(study: &Study, text: &mut String) {
    let runs = sorted(study, Class::Model);
    let Some(scene) = study.outcome(&Point::new()).filter(|_| !runs.is_empty()) else { return };
    text.push_str("## Settings that change the model\n\nThey are no more or less accurate than the scene, they are another model: its measures beside those of the scene, both computed in the scene's own steps. No recommendation chooses them.\n\n");
    let changes: String = study.measures.iter().map(|name| format!(" change of `{name}` |")).collect();
    let _ = writeln!(text, "| settings | status |{changes} `energy_error` | wall [s] |");
    let _ = writeln!(text, "|{}", "---|".repeat(4 + study.measures.len()));
    for run in runs {
        let outcome = &run.record.outcome;
        let _ = write!(text, "| {} | {} |", study.space.label(&run.point), status(study, outcome));
        for name in &study.measures {
            let change = outcome
                .measure(name)
                .zip(scene.measure(name))
                .map(|(v, own)| super::reference::deviation(v, own));
            let _ = write!(text, " {} |", change.map_or("-".into(), signed));
        }
        let energy = outcome.measure("energy_error").map_or("-".into(), percent);
        let _ = writeln!(text, " {energy} | {} |", three(outcome.wall));
    }
    text.push('\n');
}

/// How a run ended, and why not well.
fn status(study: &Study, outcome: &Outcome) -> String {
    if outcome.status == Status::Done {
        let lacks: Vec<&str> = study
            .measures
            .iter()
            .filter(|name| outcome.measure(name).is_none())
            .map(String::as_str)
            .collect();
        return if lacks.is_empty() { "done".into() } else { format!("done, without {}", lacks.join(", ")) };
    }
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
        let good = run.record.outcome.status == Status::Done;
        (!good, study.cost(&run.point).unwrap_or(run.record.outcome.wall))
    };
    runs.sort_by(|a, b| rank(a).0.cmp(&rank(b).0).then(rank(a).1.total_cmp(&rank(b).1)));
    runs
}

/// Names of the processes of any run.
fn processes(study: &Study) -> Vec<String> {
    let mut names: Vec<String> =
        study.runs.iter().flat_map(|run| run.record.outcome.cpu.keys().cloned()).collect();
    names.sort();
    names.dedup();
    names
}

/// All runs, repeats too, one a line.
pub fn table(study: &Study, facts: &Facts) -> Result<String, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    let front = study.front();
    let processes = processes(study);
    let mut head: Vec<String> =
        ["run", "purpose", "class", "on_front", "settings", "sets", "status", "error"]
            .map(String::from)
            .to_vec();
    head.extend(study.measures.iter().flat_map(|name| [name.clone(), format!("{name}_error")]));
    head.extend(["energy_error", "wall_s", "loop_s", "command_s"].map(String::from));
    head.extend(processes.iter().map(|name| format!("cpu_{name}_s")));
    head.extend(["passes_per_ms", "peak_memory_bytes", "message"].map(String::from));
    out.write_record(&head)?;
    let reference = &study.reference;
    for (number, run) in study.runs.iter().enumerate() {
        let outcome = &run.record.outcome;
        let text = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let class = study.space.class(&run.point);
        let mut row = vec![
            (number + 1).to_string(),
            format!("{:?}", run.record.purpose).to_lowercase(),
            format!("{class:?}").to_lowercase(),
            (class == Class::Numerical && front.contains(&run.point)).to_string(),
            study.space.label(&run.point),
            run.record.sets.join(" "),
            outcome.status.word().into(),
            text(study.error(outcome).filter(|_| class == Class::Numerical)),
        ];
        for name in &study.measures {
            let known = reference.0.iter().find(|(measure, _)| measure == name);
            row.push(text(outcome.measure(name)));
            row.push(text(
                outcome.measure(name).zip(known).map(|(v, (_, k))| super::reference::deviation(v, k.value)),
            ));
        }
        row.extend(
            [outcome.measure("energy_error"), Some(outcome.wall), outcome.time_loop, Some(outcome.seconds)]
                .map(text),
        );
        row.extend(processes.iter().map(|name| text(outcome.cpu.get(name).copied())));
        row.extend([outcome.passes.map(|p| p / (1e3 * facts.end_time)), outcome.memory].map(text));
        row.push(shortened(&outcome.message()));
        out.write_record(&row)?;
    }
    let bytes = out.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The recommendations, for the screen.
pub fn screen(study: &Study) -> String {
    let mut text = String::new();
    for (name, known) in &study.reference.0 {
        let off = known.uncertainty.map_or(String::new(), |u| format!(", may be off by {}", percent(u)));
        let unit = unit(study, name);
        let _ =
            writeln!(text, "reference    {name} = {} {unit} ({}{off})", short(known.value), known.words());
    }
    for one in study.recommended() {
        let what = match &one.point {
            None => unreached(study),
            Some(point) => {
                let again = study.confirmation(point);
                let error = again.and_then(|run| study.error(run));
                let confirmed = match (again, error) {
                    (None, _) => "not run again".into(),
                    (Some(run), Some(error)) if error <= one.accuracy => {
                        format!("run again: {}, {}", percent(error), seconds(run.wall))
                    }
                    (Some(_), _) => "run again: does not hold".into(),
                };
                let cost = study.cost(point).map_or("-".into(), seconds);
                let error = study.error_at(point).map_or("-".into(), percent);
                format!("{}: error {error}, {cost}; {confirmed}", study.space.label(point))
            }
        };
        let _ = writeln!(text, "{:<12} {what}", percent(one.accuracy));
    }
    text
}
