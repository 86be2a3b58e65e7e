//! `rockfall approve`: a kit tested as for its approval, EAD 340059-00-0106 (before: ETAG 027): SEL 1, SEL 2, MEL.
//!
//! - [`site`]: the site of the test, the block, and the scene of each launch; [`layout`]: ropes, brakes, posts of the kit, and gauges of them
//! - [`vary`]: what is uncertain, one at a time
//! - [`launch`]: the runs, each kept
//! - [`measured`]: the numbers of a launch; [`judge`]: each criterion with its number and bound
//! - [`report`]: `approval.json`, `approval.csv`, and `approval.txt`, which the screen shows, too; its page is `crate::report`'s

mod judge;
mod launch;
mod layout;
mod measured;
mod report;
mod site;
mod vary;

use crate::front::stop::{Stop, unwritten, write};
use crate::run::children::Events;
use crate::run::progress::Progress;
use clap::Args;
use interface_defs::diagnostic::{Diagnostic, Place, code};
use judge::Result as Judged;
use site::Which;
use std::path::{Path, PathBuf};
use toolkit::arguments::{AnswerForm, path};
use toolkit::check::Format;
use toolkit::columns::Columns;
use toolkit::exit::Exit;
use toolkit::files::Dir;
use toolkit::manifest;
use toolkit::numbers::three;
use toolkit::owner::{Claim, Owner};
use toolkit::run_dir;
use toolkit::scene::at;
use toolkit::screen::show;
use vary::Variation;

pub use report::status;

/// Directory of the runs.
const RUNS: &str = "runs";
/// That of the test as it is defined, which is the first of them.
const AS_DEFINED: &str = "as_defined";

/// What the command line asks for.
#[derive(Debug, Clone, Args)]
pub struct ApproveArguments {
    /// Kit file: [structure] with a barrier, [[gauge]], [kit]
    #[arg(value_name = "KIT", value_parser = path())]
    pub kit: PathBuf,
    /// Energy of the largest launch, MEL [kJ] [default: `energy` of the kit]
    #[arg(long, value_name = "KJ")]
    pub energy: Option<f64>,
    /// Energy of each of both SEL launches [kJ] [default: a third of MEL; below 250 kJ, class 0, there are none]
    #[arg(long, value_name = "KJ")]
    pub sel: Option<f64>,
    /// Speed of the block at impact [m/s]; the test asks for 25 at least
    #[arg(long, value_name = "M/S", default_value_t = 25.0)]
    pub speed: f64,
    /// Density of the block [kg/m3], 2500 to 3000
    #[arg(long, value_name = "KG/M3", default_value_t = 2614.0)]
    pub density: f64,
    /// Simulated time of a launch, before the block is brought to rest [s] [default: 0.6, more above 1000 kJ]
    #[arg(long, value_name = "S")]
    pub time: Option<f64>,
    /// Set a value of the kit or of the site, as in --set structure.generator.height=5 --set contact.0.restitution=0.3
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub sets: Vec<String>,
    /// What to vary, one at a time, repeatable: brake_force (factor), rope_friction, contact_friction, bundle_factor, place
    /// (post, edge_field, top_rope), or any numeric key [default: brake_force=0.8,1.2 rope_friction=0,0.1,0.3
    /// contact_friction=0.2,0.4,0.6 bundle_factor=1,2.6 place=post,edge_field,top_rope, less what the kit has]
    #[arg(long = "vary", value_name = "KEY=A,B")]
    pub vary: Vec<String>,
    /// Vary nothing: the test as it is defined alone
    #[arg(long, conflicts_with = "vary")]
    pub no_variations: bool,
    /// Directory of the runs and results [default: out/NAME-approve for the kit NAME.toml]
    #[arg(long, value_name = "DIR", value_parser = path(), help_heading = "Results")]
    pub out: Option<PathBuf>,
    /// Remove the runs that the directory holds, and begin anew
    #[arg(long, help_heading = "Results")]
    pub force: bool,
    /// Print nothing but the result and errors
    #[arg(long, help_heading = "Results")]
    pub quiet: bool,
    /// Check the kit, print the cases that would run and the wall time that each may take, and run nothing
    #[arg(long, help_heading = "Results")]
    pub dry_run: bool,
    /// Form of the result.
    #[command(flatten)]
    pub answer: AnswerForm,
}

/// The test with one thing varied, or none, and how it was judged.
pub struct Case {
    /// What is varied.
    pub name: String,
    /// Its launches, with their numbers.
    pub launches: Vec<measured::Launch>,
    /// Each criterion.
    pub criteria: Vec<judge::Criterion>,
}

impl Case {
    /// All launches, judged.
    fn of(runs: &launch::Runs, name: &str) -> Result<Self, Stop> {
        let mut launches = Vec::new();
        if runs.test.kit.sel.is_some() {
            let first = runs.launch(Which::Sel1, None)?;
            // A block that was not stopped leaves nothing to launch a second one at.
            let lands = first.stopped && first.doubt.is_none();
            let second = lands.then(|| runs.launch(Which::Sel2, Some(&first))).transpose()?;
            launches.extend(std::iter::once(first).chain(second));
        }
        launches.push(runs.launch(Which::Mel, None)?);
        let criteria = judge::all(runs.test, &launches);
        Ok(Self { name: name.to_owned(), launches, criteria })
    }

    /// Over all criteria. What is not examined decides nothing.
    pub fn verdict(&self) -> Judged {
        let any = |result: &Judged| self.criteria.iter().any(|criterion| criterion.result == *result);
        let decides = [Judged::Fail, Judged::NotSettled, Judged::Pass].into_iter().find(any);
        decides.unwrap_or(Judged::NotSettled)
    }
}

/// The whole command.
pub fn approve(arguments: &ApproveArguments, json: bool) -> Result<Exit, Stop> {
    let events = Events::watch()?;
    let kit = site::Kit::read(arguments)?;
    let variations = vary::all(arguments, &kit.document)?;
    // Every case is checked before the first one starts.
    let tests = variations.iter().map(|variation| site::Test::of(&kit, variation, &events));
    let tests = tests.collect::<Result<Vec<_>, Stop>>()?;
    let progress = Progress::new(arguments.quiet || arguments.answer.format == Format::Json, json, false);
    for warning in tests.iter().take(1).flat_map(|test| &test.warnings) {
        progress.say(&format!("warning: {warning}"));
    }
    if arguments.dry_run {
        show(&plan(&variations.iter().zip(&tests).collect::<Vec<_>>()));
        return Ok(Exit::Done);
    }
    let out =
        arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}-approve", kit.own.name())));
    refuse_other(&out)?;
    let _owner = Owner::claim(&out, &Claim { force: arguments.force, ..Claim::default() })?;
    let place = out.join(RUNS);
    if arguments.force && place.exists() {
        std::fs::remove_dir_all(&place).map_err(unwritten(&place))?;
    }
    if !place.exists() {
        report::write(&kit, &[], tests.len(), &out).map_err(unwritten(&out))?;
    }
    let (mut cases, all): (Vec<Case>, _) = (Vec::new(), tests.len());
    for (test, Variation { name, .. }) in tests.iter().zip(&variations) {
        let done = cases.len();
        let dir = place.join(folder(name));
        let label = format!("{} of {all}: {name}", done + 1);
        let runs = launch::Runs { test, dir, label, events: &events, progress: &progress };
        let kept =
            format!("; {done} of {all} cases are judged in {}; the same command goes on", out.display());
        let case = Case::of(&runs, name);
        cases.push(case.map_err(|stop| if stop.exit == Exit::BadInput { stop } else { stop.and(&kept) })?);
        report::write(&kit, &cases, all, &out).map_err(unwritten(&out))?;
    }
    progress.finish();
    let text = report::screen(&kit, &cases, &out);
    write(&out.join(report::TEXT), &text)?;
    if at(&kit.document, "output.report").and_then(toml::Value::as_bool) != Some(false) {
        crate::report::close(&out);
    }
    manifest::seal(&out);
    match arguments.answer.format {
        Format::Json => show(&format!("{:#}\n", report::json(&kit, &cases, all))),
        Format::Text => show(&text),
    }
    let open: Vec<&Case> = cases.iter().filter(|case| case.verdict() == Judged::NotSettled).collect();
    let Some(first) = open.first() else { return Ok(Exit::Done) };
    let why = first.criteria.iter().find(|c| c.result == Judged::NotSettled).map_or("", |c| c.why.as_str());
    let what = format!("not settled: {} of {all} cases; the first, {}: {why}", open.len(), first.name);
    Err(Stop { exit: Exit::Unreliable, ..Diagnostic::error(code::TRUST, what).into() })
}

/// Name of the directory of a case. A dotted key is no path, and what a user types may be one.
fn folder(case: &str) -> String {
    case.replace(['/', ' '], "_")
}

/// The cases that would run, and what each may take.
fn plan(cases: &[(&Variation, &site::Test)]) -> String {
    let cost = |case: &(&Variation, &site::Test)| launch::cost(case.1);
    let columns = Columns::new()
        .with("case", |case: &(&Variation, &site::Test)| case.0.name.clone())
        .with("launches", |case| (if case.1.kit.sel.is_some() { "SEL 1, SEL 2, MEL" } else { "MEL" }).into())
        .number("least s", |case| cost(case).map(|[least, _]| least))
        .number("most s", |case| cost(case).map(|[_, most]| most));
    let all = cases.iter().filter_map(cost).fold([0.0; 2], |all, of| [all[0] + of[0], all[1] + of[1]]);
    let [least, most] = all.map(|seconds| three(seconds / 60.0));
    let table = columns.aligned(cases);
    let why = "a block takes one to four runs to come to rest, which is known afterwards";
    format!(
        "{table}\nin all {least} to {most} minutes of wall time on a free machine: {why}; nothing was run\n"
    )
}

/// Whether a directory holds a test.
pub fn is_one(dir: &Path) -> bool {
    dir.join(run_dir::APPROVAL).exists() || dir.join(RUNS).join(AS_DEFINED).exists()
}

/// Refuse a directory that holds something else than a test: `--force` removes runs, and those of another study are none of ours.
fn refuse_other(out: &Path) -> Result<(), Stop> {
    let names: Vec<_> = Dir::open(out).and_then(|dir| dir.entries()).unwrap_or_default();
    if is_one(out) || names.iter().all(|(name, _)| name.to_string_lossy().starts_with('.')) {
        return Ok(());
    }
    let place = Place::file(out.display());
    let other = Diagnostic::error(code::RESULT_DIRECTORY, "this directory holds something else").at(place);
    Err(other.try_instead("choose another one with --out").into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One criterion that fails decides, then one that is not settled; without any that was examined nothing is settled.
    #[test]
    fn the_worst_criterion_decides_a_case_and_what_is_not_examined_none() {
        let case = |results: &[Judged]| {
            let criterion = |result: &Judged| judge::Criterion {
                launch: "MEL",
                name: "stopped",
                value: None,
                bound: None,
                unit: "1",
                result: *result,
                why: String::new(),
            };
            Case {
                name: "as defined".into(),
                launches: Vec::new(),
                criteria: results.iter().map(criterion).collect(),
            }
        };
        use Judged::{Fail, NotExamined, NotSettled, Pass};
        for (results, verdict) in [
            (&[Pass, Pass][..], Pass),
            (&[Pass, NotExamined], Pass),
            (&[Pass, NotSettled], NotSettled),
            (&[Pass, NotSettled, Fail, Pass], Fail),
            (&[NotExamined], NotSettled),
            (&[], NotSettled),
        ] {
            assert_eq!(case(results).verdict(), verdict, "{results:?}");
        }
    }
}
