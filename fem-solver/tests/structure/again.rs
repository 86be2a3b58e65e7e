//! Runs that start from the end of another.

use crate::common::{Run, coupled_plan, off, scene};
use crate::fields::lines;
use crate::rest::barrier;
use fem_solver::FemSolver;
use fem_solver::config::structure::FormFinding;
use fem_solver::equilibrium::form_finding::{Basis, Wanted, find_form};
use fem_solver::equilibrium::newton::Newton;
use fem_solver::internal_force::assembly::Assembly;
use fem_solver::internal_force::assembly::Event;
use fem_solver::state::inherited::End;
use interface_defs::Sampling;
use interface_defs::diagnostic::code;
use interface_defs::message::{Plan, Statistics};
use interface_defs::solver::Solver;
use std::path::Path;
use toolkit::program::Options;
use toolkit::provenance::build_id;
use toolkit::run_dir::STRUCTURE_STATE;
use toolkit::state_file;
use toolkit::summary::{RunStatus, Summary};

/// Words of the refusal, and what was done to the state.
type Damage = (&'static str, fn(&mut End));

/// A brake, a rope with friction over two nodes, a cable that yields, a post: all that remembers something.
const FRAME: &str = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [2.0, 1.5, 0.5], [2.0, 1.5, -1.0]]
supports = [{ nodes = [0, 4] }, { nodes = [6], rotations = "xyz" }]
masses = [{ nodes = [1, 2, 3], mass = 30.0 }]
damping = 0.7
[[structure.parts]]
name = "brake"
element = "brake"
cells = [[0, 1]]
stiffness = 2e5
curve = [[0.01, 2e3], [0.8, 2.5e3]]
stroke = 0.8
mass = 2.0
[[structure.parts]]
name = "rope"
element = "sliding_cable"
cells = [[1, 2, 3, 4]]
young = 1e10
area = 1e-4
density = 7850.0
friction = 0.15
[[structure.parts]]
name = "wire"
element = "cable"
cells = [[2, 5]]
young = 1e10
area = 1e-5
density = 7850.0
hardening = [[0.0, 1e8], [0.1, 2e8]]
rupture_strain = 0.2
[[structure.parts]]
name = "stays"
element = "cable"
cells = [[5, 4], [5, 0]]
young = 1e10
area = 1e-5
density = 7850.0
[[structure.parts]]
name = "post"
element = "beam"
cells = [[6, 5]]
young = 2e11
area = 1e-3
inertia = [1e-7, 1e-7]
density = 7850.0
[[gauge]]
name = "brake"
group = "brake"
quantity = "elongation"
"#;

const STEP: f64 = 0.0078125; // 1 / 128: its multiples are exact

/// `text` with keys at its top.
fn with(top: &str, text: &str) -> String {
    format!("{top}\n{text}")
}

fn from(dir: &Path, at: &str) -> String {
    format!("start_from = {{ run = {:?}, at = \"{at}\" }}", dir.display().to_string())
}

fn solver(text: &str, out: Option<&Path>) -> FemSolver {
    let options = Options { out: out.map(Path::to_owned), shortcuts: true };
    FemSolver::new(&scene(text), &options).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(text: &str) -> String {
    FemSolver::new(&scene(text), &Options::default()).err().expect("must be refused").to_string()
}

/// The end of a run, as its program would leave it.
fn ended(run: &mut Run, dir: &Path, status: RunStatus) -> Statistics {
    let told = run.solver.finish().expect("is prepared");
    Summary::new(status).write(dir).expect("written");
    told
}

fn end(dir: &Path) -> End {
    state_file::read(&dir.join(STRUCTURE_STATE), 1).unwrap_or_else(|e| panic!("{e}"))
}

/// Windows without any force, from the state of `text`, its end left in `dir`.
fn alone(text: &str, windows: u64, dir: &Path) -> Run {
    let plan = Plan { end_time: windows as f64 * STEP, window: STEP, ..Plan::default() };
    let mut run = Run::of(solver(text, Some(dir)), plan);
    (0..windows).for_each(|_| run.step(STEP, &[]));
    ended(&mut run, dir, RunStatus::Done);
    run
}

/// A force on a node for `pushed` windows, then none, in `windows` altogether.
fn impact(
    text: &str,
    (node, force): (usize, [f64; 3]),
    (pushed, windows): (u64, u64),
    dir: Option<&Path>,
) -> Run {
    let mut plan = coupled_plan(STEP, Sampling::Means, 1, 1);
    plan.end_time = windows as f64 * STEP;
    let mut run = Run::of(solver(text, dir), plan);
    let mut push = vec![0.0; run.force_len];
    push[3 * node..3 * node + 3].copy_from_slice(&force);
    for window in 0..windows {
        run.step(STEP, if window < pushed { &push } else { &[] });
    }
    if let Some(dir) = dir {
        ended(&mut run, dir, RunStatus::Done);
    }
    run
}

#[test]
fn two_halves_of_a_run_are_the_whole_bit_by_bit() {
    for fem in [
        "integrator = \"central_difference\"\ntime_step = 6.103515625e-5",
        "integrator = \"generalized_alpha\"\ntime_step = 0.00390625",
        "integrator = \"bossak\"\ntime_step = 0.00390625",
        "integrator = \"newmark\"\ntime_step = 0.00390625",
    ] {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = |name: &str| {
            let dir = temp.path().join(name);
            std::fs::create_dir_all(&dir).expect("created");
            dir
        };
        // As modelled it is far from its rest shape: it falls and swings.
        let text = FRAME.replace("damping = 0.7", "damping = 0.7\nform_finding = \"none\"") + "[fem]\n" + fem;
        let whole = alone(&text, 64, &dir("whole"));
        let first = alone(&text, 32, &dir("first"));
        let second = alone(&with(&from(&dir("first"), "motion"), &text), 32, &dir("second"));
        let (a, b, half) = (end(&dir("whole")), end(&dir("second")), end(&dir("first")));
        assert!(half.velocity.iter().any(|v| v.abs() > 0.1) && half.history != a.history, "{fem}: it moves");
        assert_eq!((a.time, b.time), (0.5, 0.25));
        let bare = |mut end: End| {
            end.time = 0.0;
            end
        };
        assert_eq!(bare(a), bare(b), "{fem}");
        // The books go on, too.
        for name in ["energy_kinetic_fem", "energy_stored_fem", "energy_dissipated_fem", "brake_elongation"] {
            assert_eq!(second.value(name), whole.value(name), "{fem}: {name}");
        }
        assert!(whole.value("brake_elongation") > 0.02, "{}", whole.value("brake_elongation"));
        assert!(first.value("energy_dissipated_fem") > 0.0);
    }
}

/// At rest it starts where the run itself would come to rest: the second method is a long run with much damping.
/// A node that swings is held by the run that goes on: it stands still from the start, in every scheme.
#[test]
fn what_supports_hold_stands_still_though_it_moved_in_the_run_before() {
    for fem in ["", "integrator = \"newmark\"\n"] {
        let dir = tempfile::tempdir().expect("a directory");
        let head = "end_time = 1.0\n[structure]\nnodes = [[0.0, 0.0, 0.0]]\nmasses = [{ nodes = [0], mass = 1.0 }]\n\
                    springs = [{ nodes = [0], stiffness = [0.0, 0.0, 100.0] }]\n";
        let tail = format!(
            "[fem]\ntime_step = {STEP}\n{fem}[[gauge]]\nname = \"mass\"\nat = [0, 0, 0]\nquantity = \"displacement\"\n"
        );
        let thrown = format!(
            "{head}supports = [{{ nodes = [0], directions = \"xy\" }}]\nvelocities = [{{ nodes = [0], velocity = [0, 0, 1] }}]\n{tail}"
        );
        let swung = alone(&thrown, 10, dir.path());
        let place = swung.gauge("mass_uz")[0];
        assert!(place > 0.05, "{place}");
        let held = format!("{head}supports = [{{ nodes = [0] }}]\n{tail}");
        let other = tempfile::tempdir().expect("a directory");
        let on = alone(&with(&from(dir.path(), "motion"), &held), 20, other.path());
        // Counted from where it starts.
        assert_eq!(on.gauge("mass_uz"), [0.0; 3], "{fem}");
    }
}

#[test]
fn at_rest_it_starts_with_what_it_remembers_where_it_would_come_to_rest() {
    let temp = tempfile::tempdir().expect("a directory");
    let dir = temp.path();
    let text = FRAME.to_owned() + "[fem]\nintegrator = \"central_difference\"\ntime_step = 6e-5";
    let first = impact(&text, (2, [0.0, -4e3, -8e3]), (10, 40), Some(dir));
    let before = end(dir);
    let (elongation, dissipated) = (first.value("brake_elongation"), first.value("energy_dissipated_fem"));
    assert!(elongation > 0.1 && dissipated > 100.0, "{elongation} m, {dissipated} J");

    let second = Run::alone(&with(&from(dir, "rest"), &text), STEP);
    // The books begin anew; the energy stored is that of the shape now.
    assert_eq!(second.value("energy_dissipated_fem"), 0.0);
    assert_eq!((second.value("energy_kinetic_fem"), second.value("energy_received_fem")), (0.0, 0.0));
    // Brake: its travel is all that is left of its elongation, but for what the weight stretches it by.
    let left = second.value("brake_elongation");
    let travel = before.history[1];
    assert!(travel > 0.1 && (left - travel).abs() < 0.01, "{left} m, travel {travel} m");

    let damped = text.replace("damping = 0.7", "damping = 12.0");
    let settled = {
        let plan = Plan { end_time: 20.0, window: 0.25, ..Plan::default() };
        let mut run = Run::of(solver(&with(&from(dir, "motion"), &damped), None), plan);
        (0..80).for_each(|_| run.step(0.25, &[]));
        run
    };
    assert!(settled.value("energy_kinetic_fem") < 1e-4, "{} J", settled.value("energy_kinetic_fem"));
    assert!((settled.value("brake_elongation") - left).abs() < 2e-3, "{left} m");
}

/// Nothing of it yields, and it has one shape at rest: the second impact is the first again.
#[test]
fn what_is_elastic_gives_the_answer_of_the_first_impact_again() {
    let temp = tempfile::tempdir().expect("a directory");
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = { type = "rectangular_net", cells = [4, 4], spacing = 0.5 }
[structure.cable]
young = 1e9
area = 2e-5
density = 7850.0
prestress = 1e6
[fem]
integrator = "central_difference"
time_step = 5e-5
[[gauge]]
name = "middle"
at = [1.0, 1.0, 0.0]
quantity = "displacement"
"#;
    let force = (12, [0.0, 0.0, -200.0]);
    let first = impact(text, force, (8, 30), Some(temp.path()));
    let second = impact(&with(&from(temp.path(), "rest"), text), force, (8, 30), None);
    let rest = |run: &Run| run.ready.mesh.coordinates.clone();
    let apart = rest(&first).iter().zip(rest(&second)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-11, "{apart} m");
    let left = first.value("energy_kinetic_fem");
    assert!(left > 1e-2, "it swings as it is left: {left} J");
    for name in ["middle_uz", "energy_stored_fem", "energy_kinetic_fem", "energy_received_fem"] {
        let (a, b) = (first.value(name), second.value(name));
        assert!(off(a, b) < 1e-8, "{name}: {a} {b}");
    }
}

#[test]
fn what_was_torn_stays_torn_and_touches_nothing_from_the_start() {
    let temp = tempfile::tempdir().expect("a directory");
    let dir = temp.path();
    let text = FRAME.replace("rupture_strain = 0.2", "rupture_force = 9e2")
        + "[fem]\nintegrator = \"central_difference\"\ntime_step = 6e-5";
    let first = impact(&text, (2, [0.0, -8e3, -6e3]), (10, 40), Some(dir));
    let torn = end(dir).torn;
    assert_eq!(torn.len(), 1, "{torn:?}");
    drop(first);
    // As many lines as the mesh has, of which the wire is the seventh: two stays, the brake, three of the rope, the wire.
    let mut plan = coupled_plan(STEP, Sampling::Means, 1, 1);
    let again = solver(&with(&from(dir, "rest"), &text), Some(dir));
    plan.gives.extend(again.hello().gives.into_iter().filter(|f| f.name == "broken"));
    let mut run = Run::of(again, plan);
    let at = run.layout.sample("broken", Sampling::Once, 0).expect("is in the plan");
    let expected: Vec<f64> = (0..at.len()).map(|line| f64::from(u8::from(line == 6))).collect();
    assert_eq!(run.output[at.clone()], expected[..]);
    run.step(STEP, &[]);
    assert_eq!(run.output[at], expected[..]);
    let told = run.solver.finish().expect("prepared");
    let said = told.warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    assert!(said.contains("1 element was torn before, in the run that this one starts from"), "{said}");
    assert_eq!(told.torn, Some(Vec::new()));
    // The run has not come to its end: the state of the first is still there.
    assert_eq!(end(dir).torn, torn);
}

#[test]
fn a_state_with_numbers_that_do_not_fit_is_refused_as_a_damaged_file() {
    let temp = tempfile::tempdir().expect("a directory");
    let dir = temp.path();
    let text = FRAME.to_owned() + "[fem]\nintegrator = \"central_difference\"\ntime_step = 6e-5";
    drop(alone(&text, 2, dir));
    let whole = end(dir);
    let damages: [Damage; 7] = [
        ("numbers of history", |end| end.history.truncate(1)),
        ("displacements", |end| end.displacement.push(0.0)),
        ("accelerations", |end| end.acceleration = vec![0.0; 5]),
        ("element 4294967295 has torn", |end| {
            end.torn.push(Event { time: 0.1, element: u32::MAX, tension: 1e3 })
        }),
        ("not all of its", |end| end.displacement[0] = f64::NAN),
        ("not all of its", |end| end.velocity[1] = f64::INFINITY),
        ("not all of its", |end| end.booked[0] = f64::NEG_INFINITY),
    ];
    for (words, damage) in damages {
        let mut state = whole.clone();
        damage(&mut state);
        state_file::write(&dir.join(STRUCTURE_STATE), 1, &state).expect("written");
        for at in ["rest", "motion"] {
            let scene = scene(&with(&from(dir, at), &text));
            let error = FemSolver::new(&scene, &Options::default()).err().expect("must be refused");
            assert!(error.code == code::FILE_CONTENT && error.message.contains(words), "{error}");
        }
    }
    let refused = || {
        let scene = scene(&with(&from(dir, "rest"), &text));
        FemSolver::new(&scene, &Options::default()).err().expect("must be refused")
    };
    let mut foreign = whole;
    foreign.build.program = "0123456789abcdef".into();
    state_file::write(&dir.join(STRUCTURE_STATE), 1, &foreign).expect("written");
    let build = refused();
    state_file::write(&dir.join(STRUCTURE_STATE), 1, &7_u8).expect("written");
    let layout = refused();
    state_file::write(&dir.join(STRUCTURE_STATE), 2, &7_u8).expect("written");
    assert!(build.message.contains("program 0123456789abcdef)"), "{build}");
    assert_eq!(refused().code, code::PROVENANCE);
    for error in [build, layout] {
        assert!(error.code == code::PROVENANCE && error.message.contains(&build_id().program), "{error}");
    }
}

#[test]
fn a_state_of_another_structure_is_refused_with_what_differs() {
    let temp = tempfile::tempdir().expect("a directory");
    let dir = temp.path();
    let text = FRAME.to_owned() + "[fem]\nintegrator = \"central_difference\"\ntime_step = 6e-5";
    drop(alone(&text, 2, dir));
    let top = from(dir, "rest");
    let changed = |a: &str, b: &str| {
        assert!(text.contains(a), "{a}");
        refused(&with(&top, &text.replacen(a, b, 1)))
    };
    let longer = text.replace(", [2.0, 1.5, -1.0]]", ", [2.0, 1.5, -1.0], [9.0, 9.0, 9.0]]");
    let said = refused(&with(&top, &longer.replace("[[5, 4], [5, 0]]", "[[5, 4], [5, 7]]")));
    assert!(said.contains("it has 7 nodes, and this one 8"), "{said}");
    for (a, b, what) in [
        (
            "[2.0, 1.5, 0.5]",
            "[2.0, 1.5, 0.75]",
            "1 of its 7 nodes lie elsewhere, the farthest by 2.500e-1 m: node 5",
        ),
        ("young = 1e10\narea = 1e-4", "young = 2e10\narea = 1e-4", "strength of the part `rope` is another"),
        ("stroke = 0.8", "stroke = 0.7", "strength of the part `brake` is another"),
        ("rupture_strain = 0.2", "rupture_strain = 0.3", "strength of the part `wire` is another"),
        ("[[5, 4], [5, 0]]", "[[5, 0], [5, 4]]", "the elements of the part `stays` are at other nodes"),
        ("[[5, 4], [5, 0]]", "[[5, 4]]", "the part `stays` has 2 elements in it, and 1 in this one"),
        ("name = \"stays\"", "name = \"guys\"", "it has no part `guys`"),
        (
            "{ nodes = [0, 4] }",
            "{ nodes = [0, 4], motion = [[0.0, 0.1, 0.0, 0.0]] }",
            "the support of node 0 at (0, 0, 0) in x would jump",
        ),
    ] {
        let said = changed(a, b);
        assert!(said.starts_with("test.toml:1:14: ") && said.contains(what), "{b}: {said}");
    }
    // Supports, loads, damping and gauges may differ.
    for (a, b) in [
        ("damping = 0.7", "damping = 0.1"),
        ("mass = 30.0", "mass = 20.0"),
        ("{ nodes = [0, 4] }", "{ nodes = [0, 4, 5] }"),
    ] {
        drop(solver(&with(&top, &text.replacen(a, b, 1)), None));
    }
    let statics = text.replace("central_difference\"\ntime_step = 6e-5", "static\"");
    let said = refused(&with(&from(dir, "motion"), &statics));
    assert!(said.contains("statics has none"), "{said}");

    let whole = std::fs::read(dir.join(STRUCTURE_STATE)).expect("there");
    let mut bytes = whole.clone();
    bytes[100] ^= 1;
    std::fs::write(dir.join(STRUCTURE_STATE), &bytes).expect("written");
    let said = refused(&with(&top, &text));
    assert!(said.contains("it is damaged: the hash of its") && said.contains(STRUCTURE_STATE), "{said}");
    std::fs::write(dir.join(STRUCTURE_STATE), &whole[..whole.len() / 2]).expect("written");
    assert!(refused(&with(&top, &text)).contains("it is damaged"));
    let mut other = whole.clone();
    other[8] = 99;
    std::fs::write(dir.join(STRUCTURE_STATE), &other).expect("written");
    let said = refused(&with(&top, &text));
    assert!(said.contains("it is of version 99, and this program reads version 1"), "{said}");
    std::fs::write(dir.join(STRUCTURE_STATE), &whole).expect("written");
    Summary::new(RunStatus::Failed).write(dir).expect("written");
    assert!(refused(&with(&top, &text)).contains("its status is \"failed\""));
}

/// Least distance of the top rope from the bottom rope in each field of a field file, by samples 2.5 mm apart.
fn heights_from_file(file: &Path, [upper, lower, posts]: [f64; 3]) -> Vec<f64> {
    let (upper, lower, mut posts) = (lines(file, upper), lines(file, lower), lines(file, posts));
    posts.sort_by(|a, b| a[0].0.total_cmp(&b[0].0));
    let over = |rope: &[[(f64, f64); 2]], x: f64| -> Vec<f64> {
        let crosses = rope.iter().filter(|[a, b]| (a.0 - x) * (b.0 - x) <= 0.0 && a.0 != b.0);
        crosses.map(|[a, b]| a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0)).collect()
    };
    let field = |two: &[[(f64, f64); 2]]| {
        let (from, to) = (two[0][0].0.max(two[0][1].0), two[1][0].0.min(two[1][1].0));
        let samples = (0..=4000).map(|i| from + (to - from) * f64::from(i) / 4000.0);
        samples
            .map(|x| {
                let least = over(&upper, x).into_iter().fold(f64::INFINITY, f64::min);
                least - over(&lower, x).into_iter().fold(f64::NEG_INFINITY, f64::max)
            })
            .fold(f64::INFINITY, f64::min)
    };
    posts.windows(2).map(field).collect()
}

/// A ring barrier whose middle is pushed, let go, and starts again.
#[test]
fn a_pushed_barrier_keeps_its_elongations_and_its_heights_are_those_of_the_field_file() {
    let temp = tempfile::tempdir().expect("a directory");
    let dir = temp.path();
    let gauges = r#"
[[gauge]]
name = "left"
group = "top_rope"
above = "bottom_rope"
posts = "posts"
quantity = "height"
[[gauge]]
name = "brakes"
group = "rope_brakes"
quantity = "elongation"
[output]
interval = 0.0078125
fields = 0.0078125
"#;
    let text = barrier(20.0, 10, 0.0, "static", 0.0) + gauges;
    let windows = 28;
    let mut plan = coupled_plan(STEP, Sampling::Means, 1, 1);
    plan.end_time = windows as f64 * STEP;
    let mut run = Run::of(solver(&text, Some(dir)), plan);
    let impact =
        run.solver.model().groups.iter().find(|g| g.name == "impact").expect("is there").nodes.clone();
    let mut push = vec![0.0; run.force_len];
    impact.iter().for_each(|n| push[3 * *n as usize + 1] = 1.5e5 / impact.len() as f64);
    (0..windows).for_each(|w| run.step(STEP, if w < 16 { &push } else { &[] }));
    ended(&mut run, dir, RunStatus::Done);

    // The heights of the last row, from the field file of its time.
    let legend = std::fs::read_to_string(dir.join("fields/structure_legend.json")).expect("written");
    let legend: serde_json::Value = serde_json::from_str(&legend).expect("JSON");
    let part = |name: &str| {
        let (number, _) =
            legend["part"].as_object().expect("names").iter().find(|(_, n)| *n == name).expect("is there");
        number.parse().expect("a number")
    };
    let file = dir.join("fields/structure_000029.vtu");
    let seen = heights_from_file(&file, ["top_rope", "bottom_rope", "posts"].map(part));
    assert_eq!(seen.len(), 3);
    for (field, seen) in seen.iter().enumerate() {
        let told = run.measure(&format!("left_height_{}_end", field + 1));
        assert!((told - seen).abs() < 5e-3, "field {}: {told} m, {seen} m in the file", field + 1);
    }
    let all = [1, 2, 3].map(|f| run.measure(&format!("left_height_{f}_end")));
    assert_eq!(run.measure("left_height_end"), all.into_iter().fold(f64::INFINITY, f64::min));
    assert!(all[1] < 3.5 && all[1] < all[0] && all[1] < all[2], "{all:?}");

    let used = run.value("brakes_elongation_max");
    assert!(used > 0.1, "{used} m");
    // As it was left, without the load: what has gone through the brakes is gone.
    let held = text.replace("form_finding = \"static\"", "form_finding = \"none\"");
    let plan = Plan { end_time: 1.0, window: STEP, ..Plan::default() };
    let mut again = Run::of(solver(&with(&from(dir, "rest"), &held), None), plan);
    let same = |a: f64, b: f64| assert!((a - b).abs() <= 1e-9 * b.abs(), "{a} {b}");
    same(again.value("brakes_elongation_max"), used);
    same(again.value("left_height"), run.measure("left_height_end"));
    assert_eq!((again.value("energy_kinetic_fem"), again.value("energy_dissipated_fem")), (0.0, 0.0));
    same(again.value("energy_stored_fem"), run.value("energy_stored_fem"));
    let start = again.balance();
    (0..12).for_each(|_| again.step(STEP, &[]));
    assert!(again.value("energy_kinetic_fem") > 10.0, "it springs back");
    let of = again.value("energy_kinetic_fem") + again.value("energy_dissipated_fem");
    // A push that is larger by 1e-9 to 1e-4 leaves 1.4 to 5.6 J of some 700 J, nearly all of it in the first window.
    assert!((again.balance() - start).abs() < 2e-2 * of, "{} J of {of} J", again.balance() - start);
}

/// The vertical test: gravity along the slope, all rings slack after the push. Newton alone does not come to rest there, and the
/// swing of slack rings takes thousands of iterations. That it is at rest is seen without tangents.
#[test]
fn eased_rings_bring_a_pushed_net_to_rest_in_few_iterations() {
    let temp = tempfile::tempdir().expect("a directory");
    let dir = temp.path();
    let text = barrier(0.0, 15, 0.0, "static", 0.0).replace("[0.0, 0.0, -9.81]", "[0.0, 9.81, 0.0]");
    let mut plan = coupled_plan(STEP, Sampling::Means, 1, 1);
    plan.end_time = 40.0 * STEP;
    let mut run = Run::of(solver(&text, Some(dir)), plan);
    let groups = &run.solver.model().groups;
    let impact = groups.iter().find(|g| g.name == "impact").expect("is there").nodes.clone();
    let mut push = vec![0.0; run.force_len];
    impact.iter().for_each(|n| push[3 * *n as usize + 1] = 1e5 / impact.len() as f64);
    (0..40).for_each(|w| run.step(STEP, if w < 16 { &push } else { &[] }));
    ended(&mut run, dir, RunStatus::Done);

    let left = end(dir);
    let model = run.solver.model();
    let basis = Basis { displacement: &left.displacement, history: &left.history };
    let wanted = Wanted { model, method: FormFinding::Static, most: None, basis: Some(basis) };
    let found = find_form(wanted, &mut Newton::new(model), &mut |_, _| Ok(()));
    let (form, info) = found.unwrap_or_else(|failure| panic!("{}", failure.describe(model)));
    println!("{} iterations", info.iterations);
    assert!(info.iterations < 1000, "{} iterations", info.iterations);
    // The search leads no brake and no ring further than the push did: no more is dissipated than then. A little less, for
    // what still yielded in the last step, which was not over.
    let dissipated =
        |u: &[f64], history: &[f64]| Assembly::new(model).energy(&model.elements, u, history).dissipated;
    let before = dissipated(&left.displacement, &left.history);
    let after = dissipated(&form.displacement, &form.history);
    assert!(before > 1e3 && after <= before && after > 0.9999 * before, "{before} J, {after} J");

    // Shortcuts would leave out what rests.
    let again = scene(&with(&from(dir, "rest"), &text));
    let again = FemSolver::new(&again, &Options { out: None, shortcuts: false });
    let plan = Plan { end_time: 1.0, window: STEP, ..Plan::default() };
    let mut again = Run::of(again.unwrap_or_else(|e| panic!("{e}")), plan);
    let weight = 9.81 * again.solver.model().mass.iter().sum::<f64>();
    let carried = -again.value("reaction_y");
    assert!((carried / weight - 1.0).abs() < 1e-6, "{carried} N of {weight} N");
    (0..5).for_each(|_| again.step(STEP, &[]));
    assert!(again.value("energy_kinetic_fem") < 1e-9, "{} J", again.value("energy_kinetic_fem"));
}
