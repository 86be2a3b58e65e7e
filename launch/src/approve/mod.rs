//! `rockfall approve`: a kit tested as for its approval, EAD 340059-00-0106 (before: ETAG 027): SEL 1, SEL 2, MEL.
//!
//! - [`site`]: the site of the test, the block, and the scene of each launch; [`layout`]: ropes, brakes, posts of the kit, and gauges of them
//! - [`vary`]: what is uncertain, one at a time
//! - [`launch`]: the runs, each kept
//! - [`measured`]: the numbers of a launch; [`judge`]: each criterion with its number and bound
//! - [`report`]: `approval.json`, `approval.csv`, what the screen shows

mod judge;
mod launch;
mod layout;
mod measured;
mod report;
mod site;
mod vary;

use crate::children::Events;
use crate::progress::Progress;
use crate::stop::Stop;
use clap::Args;
use interface_defs::diagnostic::{Diagnostic, code};
use judge::Result as Judged;
use std::path::{Path, PathBuf};
use toolkit::arguments::{AnswerForm, path};
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::manifest;
use toolkit::owner::{Claim, Owner};
use toolkit::screen::show;
use vary::Variation;

/// What the command line asks for.
#[derive(Debug, Clone, Args)]
pub struct Arguments {
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
    /// Form of the result.
    #[command(flatten)]
    pub answer: AnswerForm,
}

/// The test with one thing varied, or none, and how it was judged.
pub struct Case {
    /// What is varied; empty: nothing.
    pub name: String,
    /// Its launches, with their numbers.
    pub launches: Vec<measured::Launch>,
    /// Each criterion.
    pub criteria: Vec<judge::Criterion>,
}

impl Case {
    /// Over all criteria. What is not examined decides nothing.
    pub fn verdict(&self) -> Judged {
        let any = |result| self.criteria.iter().any(|criterion| criterion.result == result);
        if any(Judged::Fail) {
            Judged::Fail
        } else if any(Judged::NotSettled) || !any(Judged::Pass) {
            Judged::NotSettled
        } else {
            Judged::Pass
        }
    }

    /// Its name, also where nothing is varied.
    pub fn title(&self) -> &str {
        if self.name.is_empty() { "as defined" } else { &self.name }
    }
}

/// The whole command.
pub fn approve(arguments: &Arguments, json: bool) -> Result<Exit, Stop> {
    let events = Events::watch()?;
    let kit = site::Kit::read(arguments)?;
    let variations = vary::all(arguments, &kit.document)?;
    // Every case is checked before the first one starts.
    let tests = variations
        .iter()
        .map(|v| site::Test::of(&kit, v, &events))
        .collect::<Result<Vec<site::Test>, Stop>>()?;
    let out =
        arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}-approve", kit.stem())));
    let unwritten = |e: std::io::Error| {
        Stop::failed(code::NOT_WRITTEN, format!("{}: cannot be written: {e}", out.display()))
    };
    let _owner = Owner::claim(&out, &Claim { force: arguments.force, ..Claim::default() })?;
    if arguments.force {
        launch::remove(&out).map_err(unwritten)?;
    }
    let progress = Progress::new(arguments.quiet || arguments.answer.format == Format::Json, json, false);
    let runs = launch::Runs { out: &out, events: &events, progress: &progress };
    let mut cases: Vec<Case> = Vec::new();
    for (test, variation) in tests.iter().zip(&variations) {
        let (done, all) = (cases.len(), tests.len());
        let case = run(&runs.of(test, variation, [done + 1, all]), test, variation);
        let kept =
            || format!("; {done} of {all} cases are judged in {}; the same command goes on", out.display());
        cases.push(case.map_err(|stop| if stop.exit == Exit::BadInput { stop } else { stop.and(&kept()) })?);
        report::write(&kit, &cases, tests.len(), &out).map_err(unwritten)?;
    }
    progress.finish();
    manifest::seal(&out);
    match arguments.answer.format {
        Format::Json => show(&format!("{:#}\n", report::json(&kit, &cases, tests.len()))),
        Format::Text => show(&report::screen(&kit, &cases, &out)),
    }
    let open: Vec<&Case> = cases.iter().filter(|case| case.verdict() == Judged::NotSettled).collect();
    let Some(first) = open.first() else { return Ok(Exit::Done) };
    let why = first.criteria.iter().find(|c| c.result == Judged::NotSettled).map_or("", |c| c.why.as_str());
    let what =
        format!("not settled: {} of {} cases; the first, {}: {why}", open.len(), cases.len(), first.title());
    let stop = Stop::from(Diagnostic::error(code::TRUST, what));
    Err(Stop { exit: Exit::Unreliable, ..stop })
}

/// All launches of one case, judged.
fn run(case: &launch::OfCase, test: &site::Test, variation: &Variation) -> Result<Case, Stop> {
    let mut launches = Vec::new();
    if test.sel().is_some() {
        let first = case.launch(measured::Which::Sel1, None)?;
        // A block that was not stopped leaves nothing to launch a second one at.
        let second = match first.stopped && first.doubt.is_none() {
            true => Some(case.launch(measured::Which::Sel2, Some(&first))?),
            false => None,
        };
        launches.push(first);
        launches.extend(second);
    }
    launches.push(case.launch(measured::Which::Mel, None)?);
    let criteria = judge::all(test, &launches);
    Ok(Case { name: variation.name.clone(), launches, criteria })
}
