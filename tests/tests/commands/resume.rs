//! Runs that were killed and go on: the same bytes as a run that nobody killed.
//!
//! First within this process, where a run can be cut at any window and every scheme is quick to try; then with all processes,
//! killed at random.

use coupler::coupling::{Committed, Coupling, KeptRun, Observer};
use coupler::settings::CouplingSettings;
use coupler::side::Side;
use in_process::{Any, InProcess};
use interface_defs::Diagnostic;
use interface_defs::message::Measure;
use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;
use std::time::{Duration, Instant};
use tests::{Bench, Ended, processes_with, scene, until};
use toolkit::checkpoint::Found;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// Collects the rows of a run, takes its state once, and cuts it some windows later, as a kill would.
struct Leg {
    /// Looks between two windows after which the state is taken; it is cut so many later.
    take_at: u64,
    looks: u64,
    rows: Vec<Vec<u64>>,
    /// The state, and the rows by then.
    kept: Option<(KeptRun, usize)>,
}

/// Windows that are computed for nothing before a cut.
const LOST: u64 = 3;

impl Observer for Leg {
    fn prepared(&mut self, _: &Side, _: &Side, _: &[Diagnostic]) -> Result<(), Diagnostic> {
        Ok(())
    }
    fn is_due(&mut self, _: bool) -> bool {
        self.looks += 1;
        self.looks == self.take_at
    }
    fn keep(&mut self, _: f64, kept: KeptRun) {
        self.kept = Some((kept, self.rows.len()));
    }
    fn committed(&mut self, c: &Committed) -> Result<(), Diagnostic> {
        let head = [c.span.start, c.span.length, c.iterations.into(), c.residual.displacement];
        let of_loop = [c.balance.imbalance, c.balance.structure_work, c.balance.mesh_work];
        let all = head.iter().chain(&of_loop).chain(c.dem).chain(c.fem);
        self.rows.push(all.map(|number| number.to_bits()).collect());
        if self.looks >= self.take_at.saturating_add(LOST) { Err(Diagnostic::new("cut")) } else { Ok(()) }
    }
}

/// A run, or what is left of one: its rows, and its measures if it came to its end.
fn leg(scene: &Scene, resume: Option<KeptRun>, take_at: u64) -> (Leg, Option<Vec<Measure>>) {
    let options = Options { out: None, shortcuts: true };
    let dem = (dem_solver::PROGRAM.build)(scene, &options).unwrap();
    let fem = (fem_solver::PROGRAM.build)(scene, &options).unwrap();
    let (mut dem, mut fem) = (InProcess::new("dem", Any(dem)), InProcess::new("fem", Any(fem)));
    let settings = CouplingSettings::of(scene).unwrap();
    let mut coupling = Coupling::new(settings, scene.end_time().unwrap(), &mut dem, &mut fem);
    coupling.resume = resume;
    let mut observer = Leg { take_at, looks: 0, rows: Vec::new(), kept: None };
    let outcome = coupling.run(&mut observer, &mut |_| Ok(()));
    if let Err(error) = outcome {
        assert_eq!(error.to_string(), "cut");
        return (observer, None);
    }
    let (dem, fem) = coupling.finish().unwrap();
    (observer, Some([dem.measures, fem.measures].concat()))
}

/// The scene whole, and in `legs` legs, each of which begins as new programs do: the same rows and measures, to the last bit.
fn goes_on(name: &str, sets: &[&str], legs: u64) {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let file = Path::new(name);
    let path = if file.exists() { file.to_owned() } else { scene(name) };
    let scene = Scene::load(&path, &sets).unwrap();
    let (whole, measures) = leg(&scene, None, u64::MAX);
    let measures = measures.expect("it comes to its end");
    let every = (whole.looks / legs).max(2);
    let (mut rows, mut resume, mut cuts) = (Vec::new(), None, 0);
    loop {
        let (mut part, end) = leg(&scene, resume, every);
        if let (None, Some((kept, by_then))) = (&end, part.kept.take()) {
            rows.extend(part.rows.drain(..by_then));
            (resume, cuts) = (Some(kept), cuts + 1);
            continue;
        }
        rows.append(&mut part.rows);
        let first = rows.iter().zip(&whole.rows).position(|(a, b)| a != b);
        let differs = |row: usize| {
            let pairs = rows[row].iter().zip(&whole.rows[row]).enumerate();
            let which: Vec<_> = pairs
                .filter(|(_, (a, b))| a != b)
                .map(|(at, (a, b))| (at, f64::from_bits(*a), f64::from_bits(*b)))
                .collect();
            format!("row {row} of {}: {which:?}", whole.rows.len())
        };
        assert!(first.is_none(), "{name} {sets:?}: {}", differs(first.unwrap_or(0)));
        assert_eq!((rows.len(), end), (whole.rows.len(), Some(measures)), "{name} {sets:?}");
        assert!(cuts + 1 >= legs, "{cuts} cuts");
        return;
    }
}

/// The drop test from just above the net.
const NEAR: [&str; 3] =
    ["rock.0.position=[0.0,0.0,0.16]", "rock.0.velocity=[0.0,0.0,-6.2565]", "limits.weak_window=1e9"];

fn near(name: &str, sets: &[&str], legs: u64) {
    goes_on(name, &[&NEAR[..], sets].concat(), legs);
}

#[test]
fn weak_windows_go_on() {
    near("walenstadt-compare", &["end_time=0.06"], 7);
    near("walenstadt-exp1", &["end_time=0.03", "contact.0.friction=0.4"], 5);
    goes_on("walenstadt-compare", &["end_time=0.66"], 5);
}

#[test]
fn strong_windows_with_friction_go_on() {
    let strong = ["coupling.scheme=strong", "coupling.time_window=2e-4", "end_time=0.03"];
    near("walenstadt-exp1", &strong, 5);
    near("walenstadt-exp1", &[&strong[..], &["coupling.samples=4"]].concat(), 3);
}

#[test]
fn accelerations_that_use_windows_before_go_on() {
    let of = |method: &str| {
        let acceleration = format!("coupling.acceleration={{type=\"{method}\",reused_windows=2}}");
        let sets = ["coupling.scheme=strong", "coupling.time_window=5e-4", "end_time=0.03", &acceleration];
        goes_on("cable-net", &sets, 4);
    };
    of("iqn_ils");
    goes_on("cable-net", &["coupling.scheme=strong", "coupling.time_window=1e-3", "end_time=0.05"], 4);
}

#[test]
fn a_yielding_net_goes_on() {
    let yields = ["coupling.scheme=strong", "coupling.yielding_net=true", "coupling.time_window=1e-3"];
    near("walenstadt-compare", &[&yields[..], &["end_time=0.1"]].concat(), 12);
    near("walenstadt-exp1", &[&yields[..], &["end_time=0.06"]].concat(), 9);
}

#[test]
fn implicit_structures_go_on() {
    for integrator in ["generalized_alpha", "newmark"] {
        let integrator = format!("fem.integrator={integrator}");
        let window =
            ["coupling.scheme=strong", "coupling.time_window=5e-4", "fem.time_step=5e-4", &integrator];
        near("walenstadt-compare", &[&window[..], &["end_time=0.012"]].concat(), 3);
    }
}

/// A sphere falls onto a wire of two segments, of which one breaks.
const TORN: &str = r#"
end_time = 0.05
gravity = [0.0, 0.0, -9.81]
rock = [{ position = [0.1, 0.0, 0.0505], velocity = [0.0, 0.0, -3.0], mass = 10.0, shape = { type = "sphere", radius = 0.05 } }]
contact = [{ law = "linear", stiffness = 1e6, restitution = 1.0 }]

[structure]
nodes = [[-0.2, 0.0, 0.0], [0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]
springs = [{ nodes = [0, 2], stiffness = [1e6, 1e6, 1e6] }]
form_finding = "none"
[[structure.parts]]
name = "strong"
element = "cable"
cells = [[0, 1]]
young = 1e10
area = 1e-4
density = 7850.0
[[structure.parts]]
name = "weak"
element = "cable"
cells = [[1, 2]]
young = 1e10
area = 1e-4
density = 7850.0
rupture_force = 5e3

[fem]
time_step = 1e-5
[coupling]
scheme = "weak"
time_window = 1e-5
"#;

#[test]
fn a_wire_that_breaks_goes_on() {
    let bench = Bench::new();
    let path = bench.scene(TORN);
    let path = path.to_str().unwrap();
    goes_on(path, &[], 9);
    goes_on(path, &["coupling.scheme=strong", "coupling.time_window=1e-4"], 9);
    let yields = ["coupling.scheme=strong", "coupling.yielding_net=true", "coupling.time_window=1e-3"];
    goes_on(path, &yields, 7);
}

#[test]
#[ignore = "long"]
fn a_barrier_with_sliding_ropes_goes_on() {
    let weak = ["coupling.scheme=weak", "coupling.time_window=2.5e-5", "dem.time_step=1.25e-5"];
    goes_on("barrier-impact", &[&weak[..], &["end_time=0.02"]].concat(), 4);
}

#[test]
#[ignore = "long"]
fn rock_terrain_and_barrier_go_on() {
    let yields = ["coupling.scheme=strong", "coupling.yielding_net=true", "coupling.time_window=2e-4"];
    goes_on("slope-barrier", &[&yields[..], &["end_time=0.65"]].concat(), 6);
}

/// Numbers at random, the same each time (Steele et al. (2014), OOPSLA 49, 453: SplitMix).
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % most
    }
}

fn arguments<'a>(sets: &[&'a str]) -> Vec<&'a str> {
    sets.iter().flat_map(|set| ["--set", set]).collect()
}

/// Kill one of the processes that write to `bench`, or all of them.
fn kill(bench: &Bench, dice: &mut Dice) {
    let all = processes_with(&bench.path("").display().to_string());
    let whom = dice.below(5) as usize;
    let chosen: Vec<u32> = match whom {
        0 => all.iter().map(|(pid, _)| *pid).collect(),
        _ => all.iter().map(|(pid, _)| *pid).cycle().nth(whom).into_iter().collect(),
    };
    for pid in chosen {
        // It may have ended by itself meanwhile.
        let _ = kill_process(Pid::from_raw(pid as i32).unwrap(), Signal::KILL);
    }
}

/// Run a scene into `parts`, killed `kills` times at random and resumed each time; how it ended, and how often it was killed.
fn killed(bench: &Bench, path: &Path, words: &[&str], kills: u64, dice: &mut Dice) -> (Ended, u64) {
    let out = bench.path("parts");
    let words = [words, &["--resume"]].concat();
    let newest = || Found::of(&out).newest.map_or(0, |newest| newest.number);
    let mut done = 0;
    loop {
        let before = newest();
        let mut child = bench.rockfall(path, "parts", &words).spawn().unwrap();
        if done < kills {
            // At any moment: mostly after some progress, now and then while it prepares.
            let anywhere = dice.below(6) == 0;
            let started = Instant::now();
            let moment = Duration::from_millis(dice.below(if anywhere { 400 } else { 60 }));
            until("progress", || {
                let ended = child.try_wait().unwrap().is_some();
                (ended || (if anywhere { started.elapsed() > moment } else { newest() > before }))
                    .then_some(())
            });
            std::thread::sleep(if anywhere { Duration::ZERO } else { moment });
            if child.try_wait().unwrap().is_none() {
                kill(bench, dice);
                done += 1;
            }
        }
        let ended = tests::wait(child, out.clone());
        let word = bench.path("").display().to_string();
        until("every process ends", || processes_with(&word).is_empty().then_some(()));
        if matches!(ended.code, Some(0 | 3)) {
            return (ended, done);
        }
        assert!(!matches!(ended.code, Some(2)), "{}", ended.stderr);
        assert!(done > 0, "{}", ended.stderr);
    }
}

/// Names and bytes of the files below `dir`.
fn files(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let mut all: Vec<_> = entries
        .filter(|entry| entry.path().is_file())
        .map(|e| (e.file_name().to_string_lossy().into_owned(), std::fs::read(e.path()).unwrap()))
        .collect();
    all.sort();
    all
}

fn same_results(whole: &Ended, parts: &Ended) {
    assert!(whole.history() == parts.history(), "history.csv differs");
    let trajectory = |of: &Ended| std::fs::read_to_string(of.out.join("trajectory.csv")).ok();
    assert!(trajectory(whole) == trajectory(parts), "trajectory.csv differs");
    assert_eq!(whole.summary()["measures"], parts.summary()["measures"]);
    assert_eq!(whole.summary()["verdict"], parts.summary()["verdict"]);
    let [of_whole, of_parts] = [whole, parts].map(|of| files(&of.out.join("fields")));
    let names = |of: &[(String, Vec<u8>)]| of.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&of_whole), names(&of_parts));
    for ((name, a), (_, b)) in of_whole.iter().zip(&of_parts) {
        assert!(a == b, "fields/{name} differs");
    }
    assert!(!parts.out.join("checkpoint").exists(), "a run that is over needs none");
}

/// Killed and resumed, with checkpoints each `interval` [s].
fn survives(name: &str, sets: &[&str], interval: &str, kills: u64, seed: u64) -> u64 {
    let bench = Bench::new();
    let checkpoint = format!("output.checkpoint={interval}");
    let words = arguments(&[sets, &[&checkpoint]].concat());
    let whole = bench.run(&scene(name), "whole", &words);
    assert!(matches!(whole.code, Some(0 | 3)), "{}", whole.stderr);
    let (parts, done) = killed(&bench, &scene(name), &words, kills, &mut Dice(seed));
    println!("{name}: killed {done} times");
    same_results(&whole, &parts);
    done
}

#[test]
fn a_coupled_run_survives_kills() {
    let sets = [&NEAR[..], &["end_time=0.06", "output.fields=0.01"]].concat();
    assert!(survives("walenstadt-compare", &sets, "0.02", 4, 1) > 0);
    let yields = ["coupling.scheme=strong", "coupling.yielding_net=true", "coupling.time_window=1e-3"];
    let sets = [&NEAR[..], &yields, &["end_time=0.3"]].concat();
    assert!(survives("walenstadt-compare", &sets, "0.01", 4, 2) > 0);
}

#[test]
#[ignore = "long"]
fn a_rock_on_terrain_survives_kills() {
    assert!(survives("slope-cube", &["output.fields=0.5"], "1e-6", 4, 3) > 0);
}

#[test]
#[ignore = "long"]
fn a_structure_alone_survives_kills() {
    assert!(survives("barrier-cables", &["output.fields=0.1"], "1e-6", 3, 4) > 0);
    assert!(survives("barrier", &[], "1e-6", 3, 5) > 0);
}

/// Killed after `summary.json` and before the rest: what is left to do is done by `--resume`.
#[test]
fn a_run_killed_between_its_summary_and_its_manifest_is_ended_in_order() {
    let bench = Bench::new();
    let words = arguments(&[&NEAR[..], &["end_time=0.03", "output.checkpoint=0.01"]].concat());
    let whole = bench.run(&scene("walenstadt-compare"), "parts", &words);
    let manifest = bench.path("parts/manifest.json");
    let sealed = std::fs::read(&manifest).expect("it was sealed");
    std::fs::remove_file(&manifest).unwrap();
    std::fs::create_dir(bench.path("parts/checkpoint")).unwrap();
    std::fs::write(bench.path("parts/checkpoint/1.state"), "an old one").unwrap();
    let parts = bench.run(&scene("walenstadt-compare"), "parts", &[&words[..], &["--resume"]].concat());
    assert_eq!(parts.code, whole.code, "{}", parts.stderr);
    assert!(!bench.path("parts/checkpoint").exists(), "a run that is over needs none");
    assert_eq!(std::fs::read(&manifest).expect("sealed again"), sealed);
}

/// A run of which two checkpoints are there, killed.
fn cut(bench: &Bench, words: &[&str]) {
    let second = bench.path("parts/checkpoint/2.state");
    let child = bench.rockfall(&scene("walenstadt-compare"), "parts", words).spawn().unwrap();
    until("two checkpoints", || second.exists().then_some(()));
    kill_process(Pid::from_child(&child), Signal::KILL).unwrap();
    tests::wait(child, bench.path("parts"));
    let word = bench.path("").display().to_string();
    until("every process ends", || processes_with(&word).is_empty().then_some(()));
}

#[test]
fn a_damaged_checkpoint_is_passed_over_for_the_one_before_and_without_any_a_run_begins_anew() {
    let bench = Bench::new();
    let words = arguments(&[&NEAR[..], &["end_time=0.06", "output.checkpoint=0.02"]].concat());
    let whole = bench.run(&scene("walenstadt-compare"), "whole", &words);
    let resumed = [&words[..], &["--resume"]].concat();
    cut(&bench, &words);
    let out = bench.path("parts");
    let status = || {
        tests::Ended::of(
            std::process::Command::new(tests::program("rockfall")).arg("status").arg(&out).output().unwrap(),
            out.clone(),
        )
    };
    let newest = Found::of(&out).newest.expect("two of them");
    let file = |number: u64| out.join(format!("checkpoint/{}.state", (number + 1) % 2 + 1));
    let bytes = std::fs::read(file(newest.number)).unwrap();
    std::fs::write(file(newest.number), &bytes[..bytes.len() / 2]).unwrap();
    let before = Found::of(&out).newest.expect("the one before");
    assert_eq!(before.number + 1, newest.number);
    let text = status().stdout;
    assert!(text.contains(&format!("--resume goes on at t = {:.6} s", before.time)), "{text}");
    let parts = bench.run(&scene("walenstadt-compare"), "parts", &resumed);
    assert!(
        parts.stdout.contains(&format!("the run goes on at t = {:.6} s", before.time)),
        "{}",
        parts.stdout
    );
    assert!(parts.stderr.contains("it is damaged"), "{}", parts.stderr);
    same_results(&whole, &parts);

    let again = bench.run(&scene("walenstadt-compare"), "parts", &resumed);
    assert_eq!(again.code, Some(0));
    assert!(again.stdout.contains("there is nothing to resume"), "{}", again.stdout);
    same_results(&whole, &again);

    std::fs::remove_dir_all(&out).unwrap();
    cut(&bench, &words);
    for number in [1, 2] {
        std::fs::write(file(number), "").unwrap();
    }
    assert!(status().stdout.contains("there is no checkpoint to go on from"));
    let anew = bench.run(&scene("walenstadt-compare"), "parts", &resumed);
    assert!(anew.stdout.contains("the run begins anew"), "{}", anew.stdout);
    same_results(&whole, &anew);
}

#[test]
fn a_run_of_another_scene_is_not_gone_on_with_and_nothing_of_it_is_lost() {
    let bench = Bench::new();
    let words = arguments(&[&NEAR[..], &["end_time=0.06", "output.checkpoint=0.02"]].concat());
    cut(&bench, &words);
    let before = std::fs::read(bench.path("parts/history.csv")).unwrap();
    let other = [&words[..], &["--set", "rock.0.mass=181.0", "--resume"]].concat();
    let refused = bench.run(&scene("walenstadt-compare"), "parts", &other);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    let said = &refused.stderr;
    assert!(
        said.contains("it holds a run of another scene, which differs in") && said.contains("`rock`"),
        "{said}"
    );
    assert_eq!(std::fs::read(bench.path("parts/history.csv")).unwrap(), before);
    assert!(Found::of(&bench.path("parts")).newest.is_some());
    // The scene that the run has written out is the same scene, and a deadline changes no result, but counts.
    let resolved = bench.path("parts/scene.toml");
    let parts = bench.run(&resolved, "parts", &["--resume", "--set", "processes.timeout=99.0"]);
    assert!(std::fs::read_to_string(&resolved).unwrap().contains("timeout = 99.0"));
    assert!(parts.stdout.contains("the run goes on at"), "{} {}", parts.stdout, parts.stderr);
    same_results(&bench.run(&scene("walenstadt-compare"), "whole", &words), &parts);
}

#[test]
fn an_interrupted_run_goes_on_where_it_was() {
    let bench = Bench::new();
    // Longer than the run takes: the checkpoint is that of the interrupt.
    let words = arguments(&[&NEAR[..], &["end_time=0.3", "output.checkpoint=1000.0"]].concat());
    let child = bench.rockfall(&scene("walenstadt-compare"), "parts", &words).spawn().unwrap();
    until("some rows", || (tests::rows(&bench.path("parts")) > 100).then_some(()));
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let ended = tests::wait(child, bench.path("parts"));
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    let kept = Found::of(&bench.path("parts")).newest.expect("one");
    let last = *ended.column("time_s").last().unwrap();
    assert!((kept.time - last).abs() < 1e-9, "{} {last}", kept.time);
    let parts = bench.run(&scene("walenstadt-compare"), "parts", &[&words[..], &["--resume"]].concat());
    same_results(&bench.run(&scene("walenstadt-compare"), "whole", &words), &parts);
}

/// `KILLS=200 cargo test --release -p tests --test commands as_many_kills -- --ignored --nocapture`
#[test]
#[ignore = "long"]
fn a_coupled_run_survives_as_many_kills_as_asked_for() {
    let kills = std::env::var("KILLS").map_or(40, |n| n.parse().unwrap());
    let short = ["coupling.time_window=1e-5", "fem.time_step=1e-5", "output.fields=0.05"];
    let done = survives("walenstadt-compare", &short, "0.02", kills, 7);
    assert_eq!(done, kills, "the run is too short");
}
