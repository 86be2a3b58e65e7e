//! `rockfall run --refine`: the scene once more with half the windows and steps, and what that changes.

use crate::check::numbers::Numbers;
use crate::front::stop::Stop;
use crate::run::children::Events;
use crate::run::sweep::Task;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::{Found, Measure, Uncertainty};
use std::path::Path;
use toml::Table;
use toolkit::columns::Columns;
use toolkit::exit::Exit;
use toolkit::limits::Limits;
use toolkit::numbers::{percent, short};
use toolkit::run_dir;
use toolkit::scene::at;
use toolkit::screen::show;
use toolkit::summary::{RunStatus, Summary};

/// Where the results of the second run go, in the directory of the first.
const DIR: &str = "refined";
/// A difference between steps and half of them is half of the error, or more of one that falls faster.
const OF_DIFFERENCE: f64 = 2.0;

/// Windows and steps of a resolved scene, half as long.
fn half(resolved: &Table, numbers: &Numbers) -> Vec<String> {
    let named = |key: &str| at(resolved, key).and_then(|value| value.as_float());
    let mut sets = Vec::new();
    for (key, own) in
        [("coupling.time_window", None), ("dem.time_step", None), ("fem.time_step", numbers.net.step)]
    {
        let own = own.filter(|step: &f64| step.is_finite());
        sets.extend(named(key).or(own).map(|value| format!("{key}={:e}", 0.5 * value)));
    }
    let steps = named("dem.steps_per_contact").filter(|_| named("dem.time_step").is_none());
    sets.extend(steps.map(|steps| format!("dem.steps_per_contact={}", 2.0 * steps)));
    sets
}

/// Run the scene in `out` again, and state in `first` by how much its measures may be off.
pub fn refine(
    first: &mut Summary,
    out: &Path,
    (resolved, numbers, limits): (&Table, &Numbers, &Limits),
    (shortcuts, quiet): (bool, bool),
    events: &Events,
) -> Result<(), Stop> {
    let sets = half(resolved, numbers);
    if sets.is_empty() {
        let what = "--refine: the scene has no windows or steps of fixed length that could be halved";
        first.warnings.push(Diagnostic::warning(code::TRUST, what));
        return Ok(());
    }
    let (scene, dir) = (out.join(run_dir::SCENE), out.join(DIR));
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    let task = Task { scene: &scene, sets, dir: &dir, shortcuts, limit: f64::INFINITY };
    let ran = task.run(events, &mut |_| ())?;
    let fine = ran.summary.filter(|_| matches!(ran.exit, Exit::Done | Exit::Unreliable));
    let Some(fine) = fine else {
        let why = ran.errors.first().map_or(String::new(), |error| format!(": {error}"));
        let what = format!("--refine: the run with half the steps failed{why}");
        first.warnings.push(Diagnostic::warning(code::TRUST, what));
        return Ok(());
    };
    if !quiet {
        show(&table(first, &fine));
    }
    absorb(first, &fine, limits);
    Ok(())
}

/// Both values of each measure that matters, and their difference.
fn table(first: &Summary, fine: &Summary) -> String {
    let mut ranked: Vec<&Measure> = first.measures.iter().filter(|m| m.rank < Measure::ORDINARY).collect();
    ranked.sort_by_key(|measure| measure.rank);
    let both = ranked.into_iter().filter_map(|measure| Some((measure, fine.measure(&measure.name)?)));
    let table = Columns::new()
        .with("half the steps:", |(measure, _): &(&Measure, f64)| measure.name.clone())
        .with("before", |(measure, _)| short(measure.value))
        .with("after", |(_, other)| short(*other))
        .with("unit", |(measure, _)| measure.unit.clone())
        .with("difference", |(measure, other)| {
            let off = other - measure.value;
            if measure.value == 0.0 { short(off) } else { percent((off / measure.value).abs()) }
        });
    table.aligned(&both.collect::<Vec<_>>())
}

/// Uncertainty, status and warnings of the first run, from the finer one.
fn absorb(first: &mut Summary, fine: &Summary, limits: &Limits) {
    for measure in &mut first.measures {
        let other = fine.measures.iter().find(|other| other.name == measure.name);
        let chance = measure.uncertainty.filter(|known| known.by == Found::Vibration);
        measure.uncertainty = other.map(|other| {
            let value = OF_DIFFERENCE * (other.value - measure.value).abs();
            match chance {
                // Two runs may be alike by chance.
                Some(known) => Uncertainty { value: known.value.map(|chance| chance.max(value)), ..known },
                None => Uncertainty { value: Some(value), by: Found::Refinement, beyond: false },
            }
        });
    }
    let by_estimate = |reason: &Diagnostic| {
        reason.code == code::NEAR_RUPTURE || reason.key.as_deref() == Some(Limits::OF_MEASURES)
    };
    // What the estimate had said is known better now.
    if first.status == RunStatus::Unreliable && first.reasons.iter().all(by_estimate) {
        (first.status, first.message) = (RunStatus::Done, None);
        first.reasons.clear();
    }
    let count = |summary: &Summary| -> u64 { summary.torn.iter().flatten().map(|torn| torn.elements).sum() };
    let (tore, tear) = (count(first), count(fine));
    first.warnings.retain(|warning| warning.key.as_deref() != Some(Limits::OF_MEASURES));
    let mut reasons = limits.of_measures(first, "shorten windows and steps");
    if tore != tear {
        let what =
            format!("what tore depends on the step: elements that did: {tore}, with half the steps {tear}");
        reasons.insert(0, Diagnostic::error(code::NEAR_RUPTURE, what));
    }
    if first.status == RunStatus::Done && !reasons.is_empty() {
        first.doubt(reasons);
    }
}
