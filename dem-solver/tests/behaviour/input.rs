//! Bad input, and runs that must stop: what is wrong, where, the numbers.

use crate::bench::{Bench, Setup, cube, fixed_plane, net, sphere};
use dem_solver::DemSolver;
use dem_solver::check::check;
use interface_defs::diagnostic::code;
use interface_defs::message::FaultKind;
use interface_defs::{FieldSpec, Plan, Sampling, Solver, name};
use nalgebra::Vector3;
use toolkit::program::Options;
use toolkit::scene::Scene;

const ROCK: &str = "position = [0.0, 0.0, 1.0]";
const CONTACT: &str = "[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\nrestitution = 0.9\n";

fn scene(text: &str) -> Scene {
    Scene::from_text("test.toml", text).expect("a scene")
}

fn refused(text: &str) -> String {
    let options = Options::default();
    match DemSolver::new(&scene(text), &options) {
        Ok(_) => panic!("not refused: {text}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn what_makes_no_sense_is_refused_with_its_place() {
    let rock = cube(64, ROCK);
    let with =
        |rock: &str, contact: &str| format!("end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n{rock}\n{contact}");
    let cases = [
        (with("", ""), "no rock"),
        (with(&rock.replace("mass = 180.0", ""), ""), "neither mass nor density"),
        (with(&rock.replace("mass = 180.0", "mass = 1.0\ndensity = 2.0"), ""), "one thing twice"),
        (with(&rock.replace("mass = 180.0", "mass = -1.0"), ""), "test.toml:4:8: mass = -1 kg"),
        (with(&rock.replace("mass = 180.0", "masss = 1.0"), ""), "did you mean `mass`"),
        (with(&rock.replace("= 64", "= 50001"), ""), "1 to 50000"),
        (with(&rock.replace("\"box\"", "\"bax\""), ""), "unknown value `bax`"),
        (with(&rock.replace("0.41]", "0.0]"), ""), "an edge of 0 m"),
        (with(&format!("{rock}\norientation = [0, 0, 0, 0]"), ""), "no orientation"),
        (with(&format!("{rock}\nname = \"a b\""), ""), "cannot begin a column"),
        (
            with(&format!("{rock}\n{}", cube(1, "position = [5.0, 0.0, 0.0]\nname = \"rock\"")), ""),
            "two rocks are named",
        ),
        (
            with(&sphere(0.1, 1.0, "position = [0.0, 0.0, 0.0]\ncluster.spheres = 8"), ""),
            "a sphere is one sphere",
        ),
        (with(&rock, &format!("{CONTACT}{CONTACT}")), "two tables [[contact]] without `between`"),
        (with(&rock, &CONTACT.replace("young = 1e8", "")), "needs `young`"),
        (
            with(&rock, &CONTACT.replace("young = 1e8", "young = 1e8\nstiffness = 1.0")),
            "`stiffness` belongs to law = \"linear\"",
        ),
        (with(&rock, &CONTACT.replace("poisson = 0.2", "")), "Poisson's ratio is needed"),
        (with(&rock, &CONTACT.replace("poisson = 0.2", "poisson = 0.6")), "0 to 0.5"),
        (with(&rock, &CONTACT.replace("restitution = 0.9", "restitution = 0.0")), "above 0 up to 1"),
        (with(&rock, &CONTACT.replace("restitution = 0.9", "")), "neither restitution nor damping_ratio"),
        (with(&rock, &CONTACT.replace("\"hertz_mindlin\"", "\"hertz\"")), "unknown value `hertz`"),
        (with(&rock, &format!("{CONTACT}friction = -0.1")), "0 or more"),
        (with(&rock, &format!("{CONTACT}[dem]\ntime_step = 0.1")), "above the critical step"),
        (with(&rock, &format!("{CONTACT}[dem]\nrotation = \"midpiont\"")), "unknown value `midpiont`"),
        (
            with(&rock, &format!("{CONTACT}[dem]\ntime_step = 1e-5\nsteps_per_contact = 50")),
            "one thing twice",
        ),
        (
            with(&rock, &format!("{CONTACT}[dem]\ntime_step = 1e-5\ntime_step_scale = 0.5")),
            "keep one of time_step and time_step_scale",
        ),
        (with(&rock, &format!("{CONTACT}[dem]\ntime_step_scale = 1.5")), "above 0 and at most 1"),
        (
            with(&format!("{rock}\n{}", cube(1, "position = [0.3, 0.0, 1.0]")), CONTACT),
            "overlap at the start",
        ),
    ];
    for (text, expected) in cases {
        let message = refused(&text);
        assert!(message.contains(expected), "{expected:?} is not in:\n{message}\n{text}");
        assert!(message.starts_with("test.toml"), "{message}");
    }
}

#[test]
fn a_step_above_the_critical_one_is_taken_where_the_scene_allows_it() {
    let text = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n{}{CONTACT}[dem]\ntime_step = 0.1\nallow_unstable = true\n",
        cube(64, ROCK)
    );
    let report = check(&scene(&text)).expect("allowed");
    assert!(report.warnings[0].code == code::TIME_STEP, "{:?}", report.warnings);
}

/// The resolved scene runs again as it is, and resolves to itself.
#[test]
fn the_resolved_tables_read_back_to_the_same_check() {
    let text = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, 0.0]\n{}{CONTACT}",
        cube(70, "position = [0, 0, 1]\nangular_velocity = [0.1, 0, 0]")
    );
    let first = check(&scene(&text)).expect("checked");
    let again = format!("end_time = 1.0\n{}", first.resolved);
    let second = check(&scene(&again)).expect("checked");
    assert_eq!(first, second);
    assert_eq!(first.numbers["spheres"], 64.0);
    assert_eq!(first.numbers["mass_kg"], 180.0);
    assert!(first.numbers["time_step_s"] < first.numbers["critical_step_s"]);
}

#[test]
fn a_wall_without_a_contact_law_is_refused() {
    let mut solver =
        DemSolver::new(&scene(&format!("end_time = 1.0\n{}", cube(1, ROCK))), &Options::default())
            .unwrap_or_else(|e| panic!("{e}"));
    let plan =
        Plan { end_time: 1.0, window: 1e-3, partner_mesh: Some(fixed_plane(1.0, 1)), ..Plan::default() };
    let fault = solver.prepare(&plan, &mut |_| Ok(())).expect_err("no law");
    assert_eq!(fault.kind, FaultKind::Input);
    assert!(fault.diagnostic.message.contains("[[contact]]"));
}

#[test]
fn a_plan_that_asks_for_what_was_not_offered_is_refused() {
    let text = format!("end_time = 1.0\n{}{CONTACT}", cube(1, ROCK));
    let try_plan = |field: FieldSpec| {
        let mut solver = DemSolver::new(&scene(&text), &Options::default()).unwrap_or_else(|e| panic!("{e}"));
        let contact_mesh = Some(fixed_plane(1.0, 1));
        let plan = Plan {
            end_time: 1.0,
            window: 1e-3,
            partner_mesh: contact_mesh,
            gives: vec![field],
            ..Plan::default()
        };
        solver.prepare(&plan, &mut |_| Ok(())).expect_err("not offered").diagnostic.message
    };
    assert!(try_plan(FieldSpec::nodal("contact_tangent", 9, Sampling::Once)).contains("contact_tangent"));
    let many = FieldSpec { samples: 65, ..FieldSpec::nodal(name::FORCE, 3, Sampling::Means) };
    assert!(try_plan(many).contains("1 to 64"));
}

fn falling(velocity: f64, young: &str, step: f64) -> Bench {
    let text = format!(
        "end_time = 1.0\n{}{}[dem]\ntime_step = {step:e}\nallow_unstable = true\n",
        cube(4096, &format!("position = [0.0, 0.0, 0.2051]\nvelocity = [0.0, 0.0, -{velocity:?}]")),
        CONTACT.replace("1e8", young)
    );
    let mut contact_mesh = net(8, 0.15, 0.0);
    contact_mesh.masses = vec![f64::INFINITY; contact_mesh.node_count()];
    Setup::new(text, contact_mesh).build()
}

fn fault_of(bench: &mut Bench, length: f64) -> String {
    for _ in 0..10_000 {
        match bench.solve(length) {
            Ok(()) => bench.commit(length),
            Err(fault) => {
                assert_eq!(fault.kind, FaultKind::Window, "{fault}");
                return fault.diagnostic.message;
            }
        }
    }
    panic!("no fault");
}

#[test]
fn a_wall_that_is_pushed_through_the_spheres_fails_the_window() {
    let message = fault_of(&mut falling(6.0, "1e4", 2e-5), 1e-3);
    for word in
        ["past the centre of sphere", "m/s", "overlap of", "E = 1.000e4 Pa", "the contact is too soft"]
    {
        assert!(message.contains(word), "{word}: {message}");
    }
    // What it says to write does it, on a net that nothing moves.
    let advised = message.split("from 1.000e4 to ").nth(1).and_then(|rest| rest.split(' ').next());
    let advised: f64 = advised.and_then(|young| young.parse().ok()).expect("a modulus");
    let mut bench = falling(6.0, &format!("{advised:e}"), 2e-5);
    for _ in 0..60 {
        bench.solve(1e-3).unwrap_or_else(|fault| panic!("{fault}"));
        bench.commit(1e-3);
    }
}

#[test]
fn a_step_in_which_the_wall_could_pass_unseen_fails_the_window() {
    let message = fault_of(&mut falling(30.0, "1e9", 1e-3), 1e-3);
    for word in ["might pass through unseen", "step of 1.000e-3 s is above the critical step"] {
        assert!(message.contains(word), "{word}: {message}");
    }
    let message = fault_of(&mut falling(60.0, "1e4", 2e-4), 1e-3);
    for word in ["might pass through unseen", "for 60.0000 m/s", "write dem.time_step = "] {
        assert!(message.contains(word), "{word}: {message}");
    }
}

#[test]
fn a_displacement_that_is_not_finite_fails_the_window_and_names_the_node() {
    let mut bench = falling(6.0, "1e8", 2e-5);
    bench.displace(1, |node, _| Vector3::repeat(if node == 40 { f64::NAN } else { 0.0 }));
    let message = bench.solve(1e-4).expect_err("NaN").diagnostic.message;
    assert!(message.contains("node 40"), "{message}");
    bench.input.fill(0.0);
    bench.solve(1e-4).expect("the state is as before");
}

/// A structure that was not moved: its nodes stand still and have a velocity, which the dashpot sees.
#[test]
fn a_wall_held_still_by_the_predictor_damps_with_its_transmitted_velocity() {
    let force = |velocity: f64| {
        let text = format!(
            "end_time = 1.0\n{}[[contact]]\nlaw = \"linear\"\nstiffness = 1e6\ndamping_ratio = 0.1\n[dem]\ntime_step = 1e-6\n",
            sphere(0.1, 2500.0, "position = [0.0, 0.0, 0.099]")
        );
        let mut bench = Setup::new(text, fixed_plane(1.0, 1)).build();
        for sample in 0..2 {
            let range = bench.takes.sample(name::VELOCITY, Sampling::FromStart, sample).expect("planned");
            for v in bench.input[range].chunks_exact_mut(3) {
                v[2] = velocity;
            }
        }
        bench.advance(1e-6);
        (-bench.total_force(Sampling::Means).z, bench.value("energy_received_dem"))
    };
    // c = 2 g sqrt(m k) with the one contact's whole mass, 10.472 kg; the mesh comes at 1 m/s.
    let mass = 4.0 / 3.0 * std::f64::consts::PI * 2.5_f64;
    let dashpot = 0.2 * (mass * 1e6).sqrt();
    let ((still, _), (moving, received)) = (force(0.0), force(1.0));
    assert!(((moving - still) / dashpot - 1.0).abs() < 1e-9, "{still} {moving} {dashpot}");
    assert_eq!(received, 0.0, "what does not move does no work");
}

#[test]
fn a_request_that_is_not_of_the_plan_is_refused() {
    let mut bench = falling(6.0, "1e8", 2e-5);
    assert!(bench.solve(0.0).expect_err("no length").diagnostic.message.contains("window of 0 s"));
    bench.input.pop();
    assert!(bench.solve(1e-3).expect_err("short").diagnostic.message.contains("by the plan they are"));
}

#[test]
fn several_rocks_have_their_own_gauges_and_fall_alike() {
    let text = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n{}{}{CONTACT}",
        cube(8, "position = [0.0, 0.0, 1.0]"),
        sphere(0.2, 2500.0, "position = [2.0, 0.0, 1.0]")
    );
    let mut bench = Setup::new(text, fixed_plane(8.0, 1)).build();
    bench.advance(0.1);
    assert_eq!(bench.value("rock_z"), bench.value("rock_2_z"));
    assert_eq!(bench.value("rock_2_lowest"), bench.value("rock_2_z") - 0.2);
    for _ in 0..500 {
        bench.advance(1e-3);
    }
    let measures = bench.solver.finish().expect("finished").measures;
    for name in ["rock_impact_speed", "rock_2_impact_speed"] {
        assert!(measures.iter().any(|m| m.name == name), "{measures:?}");
    }
}

#[test]
fn field_files_are_written_at_each_interval_and_at_the_start() {
    let dir = tempfile::tempdir().expect("a directory");
    let text = format!("end_time = 1.0\n{}[output]\nfields = 0.1\n", cube(8, "position = [0.0, 0.0, 1.0]"));
    let options = Options { out: Some(dir.path().to_owned()), shortcuts: true };
    let mut solver = DemSolver::new(&scene(&text), &options).unwrap_or_else(|e| panic!("{e}"));
    let plan = Plan { end_time: 1.0, window: 0.05, ..Plan::default() };
    let mut output = solver.prepare(&plan, &mut |_| Ok(())).expect("prepared").initial;
    for number in 0..20 {
        let window = interface_defs::Window {
            number: number + 1,
            iteration: 1,
            start: 0.05 * number as f64,
            length: 0.05,
        };
        solver.solve(&window, &[], &mut output).expect("solved");
        solver.commit().expect("committed");
    }
    // What is still being written then is there.
    drop(solver);
    for series in ["rocks", "rock_surface"] {
        let pvd = std::fs::read_to_string(dir.path().join(format!("fields/{series}.pvd"))).expect("a series");
        assert_eq!(pvd.matches("<DataSet").count(), 11, "{pvd}");
    }
}

/// Soft contacts last for very many critical steps where damping is strong: half the critical step is what counts, and
/// it counts when the scene that was filled in runs again.
#[test]
fn a_filled_in_scene_takes_the_same_step() {
    let steps = |text: &str| DemSolver::new(&scene(text), &Options::default()).expect("valid").model().steps;
    let rock = cube(64, "position = [0.0, 0.0, 1.0]\nangular_velocity = [0.0, 0.0, 30.0]");
    for (contact, share) in [(CONTACT.to_owned(), false), (CONTACT.replace("0.9", "0.001"), true)] {
        let text = format!("end_time = 1.0\n{rock}{contact}");
        let first = steps(&text);
        assert_eq!(first.step == 0.5 * first.critical, share, "{first:?}");
        let resolved = dem_solver::check::check(&scene(&text)).expect("valid").resolved;
        assert_eq!(resolved["dem"]["time_step_scale"].as_float(), Some(0.5));
        assert_eq!(steps(&format!("end_time = 1.0\n{resolved}")).step, first.step);
    }
}
