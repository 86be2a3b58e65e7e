//! The strategy with a runner that computes nothing: values and costs follow formulas.

use super::budget::Budget;
use super::knobs::{Base, Point, Space, Start, of};
use super::plan::RUNS;
use super::result::tests::done;
use super::result::{Purpose, RunOutcome, Status};
use super::store::{Identity, Store};
use super::study::Study;
use super::{Explorer, TradeArguments, report};
use crate::front::stop::Stop;
use crate::run::progress::Progress;
use crate::run::sweep::Build;
use clap::Parser;
use interface_defs::diagnostic::{Diagnostic, code};
use std::collections::BTreeMap;
use std::path::Path;

/// Limit of the measure.
const EXACT: f64 = 2.0;
/// Weak coupling fails beyond this window [s].
const STABLE: f64 = 5e-4;

fn why(what: &str) -> Vec<Diagnostic> {
    vec![Diagnostic::error(code::OTHER, what)]
}

/// A coupled scene: second order in the window and in the contact solver's step.
#[derive(Default)]
struct Formula {
    runs: Vec<BTreeMap<String, String>>,
    /// So many more runs, then Ctrl-C.
    left: Option<usize>,
    /// Every fifth run is slower by this share.
    noise: f64,
    /// Every third run takes so many times longer than its processor time.
    busy: f64,
}

impl Formula {
    fn run(&mut self, sets: &[String], _: &Path, limit: f64) -> Result<RunOutcome, Stop> {
        if self.left == Some(0) {
            return Err(Stop::interrupted());
        }
        self.left = self.left.map(|left| left - 1);
        let sets: BTreeMap<String, String> =
            sets.iter().filter_map(|set| set.split_once('=')).map(|(k, v)| (k.into(), v.into())).collect();
        let number =
            |key: &str, own: f64| sets.get(key).map_or(own, |value| value.parse().expect("a number"));
        let window = number("coupling.time_window", 1e-4);
        let step = number("dem.time_step", 2.5e-5).min(window);
        let strong = sets.get("coupling.scheme").is_some_and(|scheme| scheme == "strong");
        let young = number("contact.0.young", 1e8);
        let steps = 1e-4 / window * if strong { 4.0 } else { 1.0 } + 0.2 * 2.5e-5 / step;
        let noise = if self.runs.len() % 5 == 2 { 1.0 + self.noise } else { 1.0 };
        let cpu = steps * noise;
        let wall = if self.runs.len() % 3 == 1 { cpu * self.busy.max(1.0) } else { cpu };
        self.runs.push(sets);
        if wall > limit {
            return Ok(RunOutcome::without_results(Status::Stopped, why("too slow"), limit));
        }
        if !strong && window > STABLE {
            return Ok(RunOutcome::without_results(Status::Failed, why("diverged | here"), 0.1));
        }
        let error = 0.002 * (window / 1e-4).powi(2) + 1e-4 * (step / 2.5e-5).powi(2);
        let mut outcome = done("max_deflection", EXACT * (1.0 + error) * (1e8 / young).powf(0.1), wall);
        outcome.passes = Some(1.0 / window);
        outcome.cpu.insert("dem".into(), cpu);
        Ok(outcome)
    }
}

fn arguments(words: &[&str]) -> TradeArguments {
    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        arguments: TradeArguments,
    }
    Program::parse_from(["trade", "s.toml", "--quiet"].iter().chain(words)).arguments
}

fn study(given: &[(&str, f64)]) -> Study {
    let text = "[coupling]\nscheme = \"weak\"\ntime_window = 1e-4\n[dem]\ntime_step = 2.5e-5\n[[contact]]\nyoung = 1e8\n";
    let knobs = of(&Base { resolved: &text.parse().expect("TOML"), in_use: &[] });
    Study {
        space: Space { starts: vec![Start { knobs, pinned: Vec::new() }] },
        measures: Vec::new(),
        given: given.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
        runs: Vec::new(),
        reference: super::result::Reference::default(),
    }
}

fn identity() -> Identity {
    let (build, foreign) = (Build::new(), Build::new());
    Identity { scene: "s".into(), inputs: serde_json::Map::new(), build, foreign }
}

/// One session of a study in `out`.
fn session(study: &mut Study, runner: &mut Formula, out: &Path, words: &[&str]) -> Result<(), Stop> {
    let arguments = arguments(words);
    let mut store = Store::open(out, &identity(), false).expect("opened");
    study.runs = store.load(&study.space).expect("of this build");
    let (progress, budget) = (Progress::new(true, false, false), arguments.budget());
    let mut runner = |sets: &[String], dir: &Path, limit: f64| runner.run(sets, dir, limit);
    let mut work = Explorer { runner: &mut runner, store: &mut store, progress: &progress, budget };
    work.explore(study, &arguments.measures, super::plan::next)
}

fn front(study: &Study) -> Vec<&Point> {
    study.front().into_iter().map(|(point, _)| point).collect()
}

fn whole(budget: &str) -> (Study, Formula) {
    let temp = tempfile::tempdir().expect("a directory");
    let (mut study, mut runner) = (study(&[]), Formula::default());
    session(&mut study, &mut runner, temp.path(), &["--budget", budget]).expect("explored");
    (study, runner)
}

#[test]
fn the_reference_is_known_and_the_cheapest_settings_are_found() {
    let (study, _) = whole("10000");
    let known = study.reference.0[0].1;
    let off = known.uncertainty.expect("known");
    assert!((known.value / EXACT - 1.0).abs() < off && off < 1e-3, "{known:?}");
    assert!(known.words().contains("order 2.0"), "{}", known.words());
    // Every point that the formula allows on the ladders, by brute force.
    for one in study.recommended() {
        let mut best = f64::INFINITY;
        for (w, s) in (-6..=8).flat_map(|w| (-6..=8).map(move |s| (w, s))) {
            let (window, step) = (1e-4 * 2.0_f64.powi(w), 2.5e-5 * 2.0_f64.powi(s));
            let step = step.min(window);
            let error = 0.002 * (window / 1e-4).powi(2) + 1e-4 * (step / 2.5e-5).powi(2);
            let strong = window > STABLE;
            let cost = 1e-4 / window * if strong { 4.0 } else { 1.0 } + 0.2 * 2.5e-5 / step;
            if error <= one.accuracy - 2.0 * off {
                best = best.min(cost);
            }
        }
        let point = one.point.expect("reached");
        let cost = study.cost(&point).expect("ran");
        assert!(cost <= 1.1 * best, "{}: {cost} against {best}, {}", one.accuracy, study.space.label(&point));
    }
}

#[test]
fn a_failed_run_is_a_row_and_never_on_the_front_and_a_model_is_not_recommended() {
    let (study, _) = whole("10000");
    let failed: Vec<_> = study.explored().filter(|run| run.outcome.status == Status::Failed).collect();
    assert!(!failed.is_empty());
    let front = front(&study);
    for run in study.explored().filter(|run| front.contains(&&run.point)) {
        assert_eq!(run.outcome.status, Status::Done);
        assert!(!run.point.contains_key("modulus"));
    }
    let facts = report::Facts {
        scene: "s".into(),
        command: "s.toml".into(),
        end_time: 1.0,
        structure: true,
        budget: Budget::Time(1e4),
        processors: 2,
    };
    let page = report::page(&study, &facts);
    let rows: Vec<&str> = page.lines().filter(|line| line.contains("failed: diverged / here")).collect();
    assert_eq!(rows.len(), failed.len(), "{page}");
    assert!(rows.iter().all(|row| !row.contains("| * ")), "{page}");
    assert!(page.contains("modulus 4e8"), "{page}");
    let table = report::table(&study, &facts).expect("a table");
    assert_eq!(table.lines().count(), study.runs.len() + 1);
}

#[test]
fn candidates_are_repeated_in_turn_and_each_recommendation_is_run_again() {
    let (study, _) = whole("10000");
    for point in front(&study) {
        assert!(study.timed(point).len() >= RUNS, "{}", study.space.label(point));
    }
    for one in study.recommended() {
        let point = one.point.expect("reached");
        let again = study.confirmation(&point).expect("run again");
        assert!(study.error(again).expect("done") <= one.accuracy);
    }
    // In turn: no point twice in a row while several have as few runs.
    let repeats: Vec<&Point> =
        study.runs.iter().filter(|run| run.purpose == Purpose::Repeat).map(|run| &run.point).collect();
    let several = study.front().len() > 2;
    assert!(several && repeats.windows(2).filter(|pair| pair[0] == pair[1]).count() <= 1, "{repeats:?}");
}

#[test]
fn a_noisy_machine_does_not_decide() {
    let temp = tempfile::tempdir().expect("a directory");
    let (mut noisy, mut runner) = (study(&[]), Formula { noise: 0.4, ..Formula::default() });
    session(&mut noisy, &mut runner, temp.path(), &["--budget", "10000"]).expect("explored");
    let (quiet, _) = whole("10000");
    let costs = |study: &Study| -> Vec<f64> {
        let points = study.recommended().into_iter().map(|one| one.point.expect("reached"));
        points.map(|point| quiet.cost(&point).expect("the quiet study has run it, too")).collect()
    };
    for (noisy, quiet) in costs(&noisy).into_iter().zip(costs(&quiet)) {
        assert!(noisy <= 1.15 * quiet, "{noisy} s where {quiet} s would do");
    }
    let times = |point: &Point| noisy.timed(point).iter().map(|run| run.cost()).collect::<Vec<_>>();
    let scattered =
        front(&noisy).into_iter().filter(|p| times(p).iter().any(|time| *time != times(p)[0])).count();
    assert!(scattered > 0, "the noise has hit no candidate: this test says nothing");
}

/// Where other programs take the processors from some of the runs, the same is recommended.
#[test]
fn a_busy_machine_does_not_decide() {
    let temp = tempfile::tempdir().expect("a directory");
    let (mut busy, mut runner) = (study(&[]), Formula { busy: 4.0, ..Formula::default() });
    session(&mut busy, &mut runner, temp.path(), &["--budget", "20000"]).expect("explored");
    let slowed = |run: &super::study::Finished| run.outcome.wall > 2.0 * run.outcome.cost();
    assert!(busy.explored().filter(|run| slowed(run)).count() > 5);
    assert_eq!(busy.recommended(), whole("10000").0.recommended());
}

#[test]
fn a_number_of_runs_is_kept_and_a_larger_one_goes_on_without_repeating() {
    let temp = tempfile::tempdir().expect("a directory");
    let (mut first, mut second, mut runner) = (study(&[]), study(&[]), Formula::default());
    session(&mut first, &mut runner, temp.path(), &["--runs", "2"]).expect("explored");
    let enough = Budget::Runs(2).of_reference(&first).expect("known");
    assert!(
        first.runs.len() <= 2
            && report::unknown(&first, Budget::Runs(2)).is_some_and(|why| why.contains(&enough))
    );
    let mut again = study(&[]);
    session(&mut again, &mut runner, temp.path(), &enough.split(' ').collect::<Vec<_>>()).expect("explored");
    assert_eq!(report::unknown(&again, Budget::Runs(2)), None);
    session(&mut second, &mut runner, temp.path(), &["--runs", "20"]).expect("explored");
    assert_eq!((second.runs.len(), runner.runs.len()), (20, 20), "none was repeated");
}

#[test]
fn the_budget_is_kept_and_a_larger_one_goes_on_without_repeating() {
    let temp = tempfile::tempdir().expect("a directory");
    let (mut first, mut runner) = (study(&[]), Formula::default());
    session(&mut first, &mut runner, temp.path(), &["--budget", "30"]).expect("explored");
    assert!(first.spent() <= 30.0 && first.spent() > 10.0, "{}", first.spent());
    let so_far = runner.runs.len();
    // The same again: nothing is left that fits.
    let mut second = study(&[]);
    session(&mut second, &mut runner, temp.path(), &["--budget", "30"]).expect("explored");
    assert_eq!((runner.runs.len(), second.runs.len()), (so_far, so_far));
    session(&mut second, &mut runner, temp.path(), &["--budget", "2m"]).expect("explored");
    assert!(second.runs.len() > so_far && second.spent() <= 120.0, "{}", second.spent());
    let keys: Vec<_> = second.explored().map(|run| &run.key).collect();
    let unique: std::collections::BTreeSet<_> = keys.iter().collect();
    assert_eq!(keys.len(), unique.len(), "no point is explored twice");
}

#[test]
fn an_interrupted_study_gives_in_the_end_what_an_uninterrupted_one_gives() {
    let temp = tempfile::tempdir().expect("a directory");
    let mut broken = study(&[]);
    let mut runner = Formula { left: Some(7), ..Formula::default() };
    let stopped = session(&mut broken, &mut runner, temp.path(), &["--budget", "500"]);
    assert_eq!(stopped, Err(Stop::interrupted()));
    runner.left = None;
    let mut resumed = study(&[]);
    session(&mut resumed, &mut runner, temp.path(), &["--budget", "500"]).expect("explored");
    let (whole, _) = whole("500");
    let sets = |study: &Study| study.runs.iter().map(|run| run.sets.clone()).collect::<Vec<_>>();
    assert_eq!(sets(&resumed), sets(&whole));
}

#[test]
fn a_given_reference_spares_the_refinements_and_a_misspelt_measure_is_refused() {
    let temp = tempfile::tempdir().expect("a directory");
    let (mut given, mut runner) = (study(&[("max_deflection", EXACT)]), Formula::default());
    session(&mut given, &mut runner, temp.path(), &["--budget", "10000"]).expect("explored");
    assert!(given.refinements().len() == 1, "{}", given.refinements().len());
    let error = given.outcome(&Point::new()).and_then(|run| given.error(run)).expect("done");
    assert!((error - 0.0021).abs() < 1e-12, "{error}");
    let other = tempfile::tempdir().expect("a directory");
    let refused =
        session(&mut study(&[]), &mut Formula::default(), other.path(), &["--measure", "max_deflexion"]);
    let message = refused.expect_err("misspelt").errors[0].to_string();
    assert!(message.contains("did you mean `max_deflection`?"), "{message}");
}

#[test]
fn a_run_that_is_slower_than_it_should_be_is_ended() {
    let temp = tempfile::tempdir().expect("a directory");
    let arguments = arguments(&["--budget", "1000"]);
    let mut store = Store::open(temp.path(), &identity(), false).expect("opened");
    let mut study = study(&[]);
    let (mut formula, progress, budget) =
        (Formula::default(), Progress::new(true, false, false), Budget::Time(1000.0));
    let mut runner = |sets: &[String], dir: &Path, limit: f64| {
        if sets.iter().any(|set| set.ends_with("strong")) {
            assert!(limit < 100.0, "{limit}");
            return Ok(RunOutcome::without_results(Status::Stopped, why("too slow"), limit));
        }
        formula.run(sets, dir, limit)
    };
    let mut work = Explorer { runner: &mut runner, store: &mut store, progress: &progress, budget };
    work.explore(&mut study, &arguments.measures, super::plan::next).expect("explored");
    let stopped = study.runs.iter().filter(|run| run.outcome.status == Status::Stopped);
    assert!(stopped.clone().count() > 0);
    assert!(stopped.clone().all(|run| !front(&study).contains(&&run.point)));
    assert!(study.recommended()[0].point.is_some());
}

/// The formula's weak coupling breaks at one window, which is found to the factor that is promised.
#[test]
fn a_push_ends_where_the_scene_breaks() {
    use super::atlas::{Atlas, NARROW, page};
    let temp = tempfile::tempdir().expect("a directory");
    let arguments = arguments(&["--budget", "10000"]);
    let mut store = Store::open(temp.path(), &identity(), false).expect("opened");
    let mut study = study(&[]);
    let (mut formula, progress, budget) =
        (Formula::default(), Progress::new(true, false, false), Budget::Time(1e4));
    let mut runner = |sets: &[String], dir: &Path, limit: f64| formula.run(sets, dir, limit);
    let mut work = Explorer { runner: &mut runner, store: &mut store, progress: &progress, budget };
    work.explore(&mut study, &arguments.measures, super::plan::next_of_atlas).expect("explored");
    let (found, next) = Atlas { study: &study, budget }.all();
    assert_eq!(next, None);
    let one = |name: &str, strong: bool| {
        let at = found
            .iter()
            .find(|f| f.push.knob.name == name && study.space.arm_of(&f.push.from).is_empty() != strong);
        at.unwrap_or_else(|| panic!("{name} was not pushed"))
    };
    let window = one("window", false);
    let (holds, (breaks, symptom)) = (window.holds.expect("held"), window.breaks.clone().expect("broke"));
    assert!(holds <= STABLE && STABLE < breaks && breaks / holds <= NARROW, "{holds} {breaks}");
    assert!(symptom.contains("diverged / here"), "{symptom}");
    // Strong coupling has an error of 10 % where 0.002 (H / 1e-4)^2 is 0.1.
    let strong = one("window", true);
    let exact = 1e-4 * (0.1_f64 / 0.002).sqrt();
    let (holds, breaks) = (strong.holds.expect("held"), strong.breaks.clone().expect("broke").0);
    assert!(holds <= exact && exact < breaks * 1.01 && breaks / holds <= NARROW, "{holds} {exact} {breaks}");
    // Windows break before the contact solver's step does.
    let step = one("dem_step", false);
    assert!(
        step.breaks.is_none() && step.note.as_deref().is_some_and(|note| note.contains("never longer")),
        "{step:?}"
    );
    assert!(step.holds.expect("held") <= window.holds.expect("held"));
    // A contact of another stiffness is another model: its measures are no error, and the formula never fails.
    let stiff = found.iter().find(|f| f.push.knob.name == "modulus" && !f.push.coarser).expect("pushed");
    assert!(
        stiff.breaks.is_none() && stiff.note.as_deref().is_some_and(|n| n.contains("nothing changed")),
        "{stiff:?}"
    );
    let soft = found.iter().find(|f| f.push.knob.name == "modulus" && f.push.coarser).expect("pushed");
    assert!(stiff.holds > Some(1e8) && soft.holds < Some(1e8), "{stiff:?} {soft:?}");
    let facts = report::Facts {
        scene: "s".into(),
        command: "s.toml".into(),
        end_time: 1.0,
        structure: true,
        budget: Budget::Time(1e4),
        processors: 2,
    };
    let page = page(&study, &found, &facts);
    assert_eq!(page.lines().filter(|line| line.starts_with("| ")).count(), found.len() + 1, "{page}");
}

/// A budget for one run gives no error, and so no recommendation: it says which budget would, and that one does.
#[test]
fn a_scene_that_is_only_compared_with_itself_is_not_recommended() {
    let temp = tempfile::tempdir().expect("a directory");
    let (mut first, mut runner) = (study(&[]), Formula::default());
    session(&mut first, &mut runner, temp.path(), &["--budget", "2"]).expect("explored");
    assert_eq!((first.refinements().len(), first.recommended()), (1, Vec::new()));
    let facts = report::Facts {
        scene: "s".into(),
        command: "s.toml".into(),
        end_time: 1.0,
        structure: true,
        budget: Budget::Time(2.0),
        processors: 2,
    };
    let enough = facts.budget.of_reference(&first).expect("known");
    let page = report::page(&first, &facts);
    assert!(page.contains("nothing is recommended") && page.contains(&enough), "{page}");
    assert!(!page.contains("rockfall run"), "{page}");
    assert!(!report::screen(&first, &facts).contains(" %"), "{}", report::screen(&first, &facts));
    let mut second = study(&[]);
    session(&mut second, &mut runner, temp.path(), &enough.split(' ').collect::<Vec<_>>()).expect("explored");
    assert!(second.refinements().len() > 2 && !second.is_alone(), "{}", second.refinements().len());
    // A value that the user gives is known.
    let other = tempfile::tempdir().expect("a directory");
    let mut given = study(&[("max_deflection", EXACT)]);
    session(&mut given, &mut Formula::default(), other.path(), &["--budget", "2"]).expect("explored");
    assert!(!given.is_alone() && given.recommended()[0].point.is_some());
}
