//! The contract: repeatable windows, samples, skipped windows, gauges, faults.

use crate::common::{Run, WALENSTADT, coupled_plan, off, random, scene, solver};
use fem_solver::FemSolver;
use fem_solver::equilibrium::newton::Failure;
use interface_defs::field::{Sampling, name};
use interface_defs::message::{FaultKind, Plan};
use interface_defs::solver::Solver;
use toolkit::program::Options;

const SCHEMES: [(&str, Sampling); 6] = [
    ("time_step = 2e-5", Sampling::Means),
    ("integrator = \"generalized_alpha\"", Sampling::Means),
    ("integrator = \"generalized_alpha\"\nrho_inf = 0.6", Sampling::Means),
    ("integrator = \"newmark\"\ntime_step = 1e-4", Sampling::AtEnds),
    ("integrator = \"bossak\"", Sampling::AtEnds),
    ("integrator = \"static\"", Sampling::AtEnds),
];

/// A small net with everything that has a history.
fn net(fem: &str) -> String {
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = {{ type = "rectangular_net", cells = [6, 5], spacing = 0.15 }}
damping = 15.0
cable = {{ young = 8e9, area = 1.2e-5, density = 7850.0, prestress = -1e6, radius = 0.002 }}
[[structure.groups]]
name = "patch"
nodes = [16, 17, 23, 24]
[[gauge]]
name = "patch"
group = "patch"
quantity = "displacement"
[[gauge]]
name = "patch"
group = "patch"
quantity = "tension"
[[gauge]]
name = "left"
group = "x_min"
quantity = "force"
[fem]
{fem}
"#
    )
}

fn force(run: &Run, seed: u64, size: f64) -> Vec<f64> {
    let mut noise = random(seed);
    (0..run.force_len).map(|_| size * noise()).collect()
}

#[test]
fn solving_a_b_a_gives_equal_bytes() {
    for (fem, sampling) in SCHEMES {
        let mut run = Run::coupled(&net(fem), 2e-4, sampling);
        for window in 0..4 {
            let (a, b) = (force(&run, 2 * window, 40.0), force(&run, 2 * window + 1, 80.0));
            run.solve(2e-4, &a).unwrap();
            let first = run.output.clone();
            run.solve(1e-4, &b).unwrap();
            assert_ne!(first, run.output);
            run.solve(2e-4, &a).unwrap();
            let bits = |x: &[f64]| x.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&first), bits(&run.output), "{fem}, window {window}");
            run.commit(2e-4);
        }
    }
}

#[test]
fn the_factor_of_a_committed_state_is_kept_and_changes_no_byte() {
    for (fem, sampling) in SCHEMES.into_iter().filter(|(fem, _)| fem.contains("integrator")) {
        let runs = [true, false].map(|shortcuts| {
            let taut = net(fem).replace("prestress = -1e6", "prestress = 1e8");
            let solver = FemSolver::new(&scene(&taut), &Options { out: None, shortcuts }).unwrap();
            Run::of(solver, coupled_plan(2e-4, sampling, 1, 1))
        });
        let [mut keeping, mut plain] = runs;
        for window in 0..6 {
            for iteration in 0..4 {
                let a = force(&plain, 10 * window + iteration, 40.0);
                keeping.solve(2e-4, &a).unwrap();
                plain.solve(2e-4, &a).unwrap();
                let bits = |x: &[f64]| x.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&keeping.output), bits(&plain.output), "{fem}, {window}, {iteration}");
            }
            keeping.commit(2e-4);
            plain.commit(2e-4);
        }
        let count = |run: &mut Run| (run.count("factorisations"), run.count("kept_factors"));
        let ((made, kept), (all, none)) = (count(&mut keeping), count(&mut plain));
        println!("{fem}: {made} factors made, {kept} kept; {all} made without keeping");
        assert_eq!((made + kept, none), (all, 0), "{fem}");
        // Where one factor does for the one step of a window, three later iterations find it there.
        assert!(kept > 0 || fem.contains("static") || fem.contains("time_step"), "{fem}: {kept}");
    }
}

#[test]
fn iterations_that_are_thrown_away_leave_no_trace_in_the_run() {
    for (fem, sampling) in SCHEMES {
        let mut runs = [0, 1].map(|_| Run::coupled(&net(fem), 2e-4, sampling));
        for window in 0..30 {
            let a = force(&runs[0], window, 40.0);
            let wild = force(&runs[0], window + 100, 900.0);
            runs[1].solve(1e-4, &wild).unwrap();
            for run in &mut runs {
                run.step(2e-4, &a);
            }
            assert_eq!(runs[0].output, runs[1].output, "{fem}");
        }
        let [a, b] = &mut runs;
        for measure in ["max_reaction", "max_reaction_1ms", "max_cable_force"] {
            assert_eq!(a.measure(measure), b.measure(measure), "{fem}: {measure}");
        }
    }
}

#[test]
fn several_forces_in_a_window_act_as_windows_of_their_own() {
    for (fem, sampling) in SCHEMES.into_iter().filter(|(fem, _)| !fem.contains("0.6")) {
        let mut long = Run::with(&net(fem), coupled_plan(2e-4, sampling, 4, 2));
        let mut short = Run::coupled(&net(fem), 5e-5, sampling);
        let forces = force(&long, 1, 40.0);
        long.step(2e-4, &forces);
        let part = forces.len() / 4;
        let middle = |run: &Run, sample| {
            let at = run.layout.sample(name::DISPLACEMENT, Sampling::AtEnds, sample).unwrap();
            run.output[at][3 * 17..3 * 18].to_vec()
        };
        for i in 0..4 {
            short.step(5e-5, &forces[i * part..(i + 1) * part]);
            if i == 1 {
                let (a, b) = (middle(&long, 0), middle(&short, 0));
                a.iter().zip(&b).for_each(|(a, b)| assert!((a - b).abs() < 1e-14, "{fem}: {a} {b}"));
            }
        }
        let (a, b) = (middle(&long, 1), middle(&short, 0));
        // Equal steps but for the rounding of their length; Newton stops at 1e-10 of the forces.
        a.iter().zip(&b).for_each(|(a, b)| assert!((a - b).abs() < 1e-13, "{fem}: {a} {b}"));
        let (a, b) = (long.value("energy_received_fem"), short.value("energy_received_fem"));
        assert!((a - b).abs() < 1e-9 * a.abs().max(1e-6), "{fem}: {a} {b}");
    }
}

#[test]
fn a_window_in_which_nothing_happens_is_skipped_and_answered_alike() {
    let mut run = Run::coupled(&net("time_step = 2e-5"), 1e-4, Sampling::Means);
    let initial = run.ready.initial.clone();
    for _ in 0..5 {
        run.step(1e-4, &[]);
        let close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-15 * b.abs();
        assert!(run.output.iter().zip(&initial).all(close));
    }
    assert_eq!((run.count("skipped_windows"), run.count("sub_steps")), (5, 0));
    let pushed = force(&run, 1, 10.0);
    run.step(1e-4, &pushed);
    run.step(1e-4, &[]);
    assert_eq!((run.count("skipped_windows"), run.count("sub_steps")), (5, 10), "it moves by now");
}

#[test]
fn a_support_that_begins_to_move_ends_the_rest() {
    let text = net("time_step = 2e-5").replace(
        "[[structure.groups]]",
        "[[structure.supports]]\ngroup = \"x_max\"\nmotion = [[1e-3, 0.0, 0.0, 0.0], [2e-3, 0.01, 0.0, 0.0]]\n[[structure.groups]]",
    );
    let mut run = Run::alone(&text, 5e-4);
    (0..4).for_each(|_| run.step(5e-4, &[]));
    assert_eq!(run.count("skipped_windows"), 2);
    assert!(run.value("energy_stored_fem") > 1e-3);
}

#[test]
fn skipping_changes_no_result_that_counts() {
    let text = net("time_step = 2e-5");
    let mut with = Run::coupled(&text, 1e-4, Sampling::Means);
    let plain = FemSolver::new(&scene(&text), &Options { out: None, shortcuts: false }).unwrap();
    let mut without = Run::of(plain, coupled_plan(1e-4, Sampling::Means, 1, 1));
    for window in 0..40 {
        let push = if window < 10 { Vec::new() } else { force(&with, window, 20.0) };
        with.step(1e-4, &push);
        without.step(1e-4, &push);
        let (a, b) = (with.value("patch_uz_mean"), without.value("patch_uz_mean"));
        // What static equilibrium leaves, 1e-12 of the forces, moves the net by no more.
        assert!((a - b).abs() < 1e-13, "{a} {b}");
    }
}

#[test]
fn reactions_add_up_to_weight_and_force_and_change_of_momentum() {
    for (fem, sampling) in SCHEMES {
        let mut run = Run::coupled(&net(fem), 2e-4, sampling);
        let weight = {
            let scene = scene(&net(fem));
            let config = fem_solver::config::Config::of(&scene).unwrap();
            let model = fem_solver::model::Model::build(&scene, &config).unwrap();
            9.81 * model.mass.iter().sum::<f64>()
        };
        assert!((run.value("reaction_z") - weight).abs() < 1e-9 * weight, "{fem}");
        // Held nodes take their own share of force and weight, whatever the rest does.
        let mut on_frame = vec![0.0; run.force_len];
        let samples = run.force_len / (3 * run.ready.mesh.node_count());
        for sample in on_frame.chunks_mut(run.force_len / samples) {
            sample[2] = -1000.0;
        }
        run.step(2e-4, &on_frame);
        let mean = sampling == Sampling::AtEnds || fem.contains("0.6");
        let factor = if mean && !fem.contains("static") { 0.5 } else { 1.0 };
        let reaction = run.value("reaction_z");
        // A load at the end grows from nothing: half of it as mean. Where both are taken, the end counts. Statics tells the end.
        assert!((reaction - weight - factor * 1000.0).abs() < 1e-8, "{fem}: {reaction}");
    }
}

#[test]
fn the_one_millisecond_mean_is_that_of_the_reactions_of_every_step() {
    let mut run = Run::coupled(&net("time_step = 5e-5"), 5e-5, Sampling::Means);
    let mut history: Vec<[f64; 3]> =
        vec![["reaction_x", "reaction_y", "reaction_z"].map(|c| run.value(c)); 20];
    let (mut mean, mut raw) = (0.0_f64, 0.0_f64);
    for window in 0..60 {
        let push = force(&run, window, 400.0);
        run.step(5e-5, &push);
        history.push(["reaction_x", "reaction_y", "reaction_z"].map(|c| run.value(c)));
        let last = &history[history.len() - 20..];
        let sum = |c: usize| last.iter().map(|r| r[c]).sum::<f64>() / 20.0;
        mean = mean.max([sum(0), sum(1), sum(2)].iter().map(|x| x * x).sum::<f64>().sqrt());
        let now = last[19];
        raw = raw.max(now.iter().map(|x| x * x).sum::<f64>().sqrt());
    }
    assert!((run.measure("max_reaction") - raw).abs() < 1e-9 * raw);
    // Times of steps carry rounding of 1e-16 s, which cuts a step of 5e-5 s by 1e-11.
    assert!((run.measure("max_reaction_1ms") - mean).abs() < 1e-9 * mean);
}

#[test]
fn the_interface_mesh_is_the_net_as_it_hangs() {
    let run = Run::coupled(&net(""), 1e-4, Sampling::Means);
    let mesh = &run.ready.mesh;
    mesh.check().unwrap();
    assert_eq!((mesh.node_count(), mesh.lines.len()), (42, 6 * 6 + 7 * 5));
    assert!(mesh.line_radius.iter().all(|r| *r == 0.002));
    assert!(mesh.masses[0].is_infinite() && mesh.masses[17] > 0.0);
    assert!(mesh.coordinates[3 * 17 + 2] < -1e-4, "it sags");
    assert_eq!(run.displacement(17), [0.0; 3], "displacements count from there");
    let names: Vec<_> = mesh.groups.iter().map(|g| g.name.as_str()).collect();
    assert!(names.contains(&"patch") && names.contains(&"supports"), "{names:?}");
}

#[test]
fn newton_that_fails_is_a_fault_of_the_window_with_its_numbers() {
    let fem = "integrator = \"newmark\"\nnewton = { max_iterations = 1 }";
    let mut run = Run::coupled(&net(fem), 1e-2, Sampling::AtEnds);
    let push = force(&run, 1, 1e4);
    let fault = run.solve(1e-2, &push).unwrap_err();
    assert_eq!(fault.kind, FaultKind::Window);
    assert!(
        fault.diagnostic.message.contains("after 1 iterations") && fault.diagnostic.message.contains("node "),
        "{fault}"
    );
}

#[test]
fn a_step_that_diverges_is_a_fault_of_the_window() {
    let mut run = Run::coupled(&net("time_step = 1e-3\nallow_unstable = true"), 1e-3, Sampling::Means);
    let push = force(&run, 1, 1.0);
    let mut fault = None;
    for _ in 0..2000 {
        if let Err(e) = run.solve(1e-3, &push) {
            fault = Some(e);
            break;
        }
        run.commit(1e-3);
    }
    let fault = fault.expect("steps of five times the critical one diverge");
    assert_eq!(fault.kind, FaultKind::Window);
    assert!(fault.diagnostic.message.contains("diverged"), "{fault}");
}

#[test]
fn a_plan_that_asks_for_the_unknown_is_refused() {
    let mut structure = solver(&net(""));
    let mut plan = coupled_plan(1e-4, Sampling::Means, 1, 1);
    plan.gives[0].name = "temperature".into();
    let fault = structure.prepare(&plan, &mut |_| Ok(())).unwrap_err();
    assert!(fault.diagnostic.message.contains("temperature"), "{fault}");
}

#[test]
fn a_mean_force_for_a_scheme_of_end_forces_is_a_warning() {
    let run = Run::with(&net("integrator = \"newmark\""), coupled_plan(1e-4, Sampling::Means, 1, 1));
    assert!(
        run.ready.warnings.iter().any(|w| w.message.contains("lag of half a window")),
        "{:?}",
        run.ready.warnings
    );
}

#[test]
fn form_finding_reports_and_can_be_stopped() {
    let mut structure = solver(WALENSTADT);
    let mut told = Vec::new();
    let mut listen = |p: interface_defs::message::Progress| {
        told.push(p.what);
        Ok(())
    };
    structure.prepare(&Plan::default(), &mut listen).unwrap();
    assert!(told.iter().any(|t| t.contains("form finding: iteration")), "{told:?}");
    let stop = interface_defs::message::Fault::interrupted();
    let fault = solver(WALENSTADT).prepare(&Plan::default(), &mut |_| Err(stop.clone())).unwrap_err();
    assert_eq!(fault.kind, FaultKind::Interrupted);
}

#[test]
fn field_files_are_written_at_multiples_of_their_interval() {
    let dir = tempfile::tempdir().unwrap();
    let text = format!("{}\n[output]\nfields = 2e-4\n", net("time_step = 2e-5"));
    let options = Options { out: Some(dir.path().to_owned()), shortcuts: true };
    let structure = FemSolver::new(&scene(&text), &options).unwrap();
    let mut run = Run::of(structure, coupled_plan(5e-5, Sampling::Means, 1, 1));
    (0..20).for_each(|_| run.step(5e-5, &[]));
    // What is still being written then is there.
    drop(run);
    let pvd = std::fs::read_to_string(dir.path().join("fields/structure.pvd")).unwrap();
    // t = 0, 0.2, ... 1 ms.
    assert_eq!(pvd.matches("<DataSet").count(), 6, "{pvd}");
    let file = std::fs::read_to_string(dir.path().join("fields/structure_000006.vtu")).unwrap();
    for field in ["displacement", "velocity", "axial_force", "stress", "slack", "broken"] {
        assert!(file.contains(&format!("Name=\"{field}\"")), "{field}");
    }
}

#[test]
fn faces_are_written_with_their_stresses() {
    let text = r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
supports = [{ nodes = [0, 1, 2, 3] }]
[[structure.parts]]
name = "skin"
element = "membrane"
cells = [[0, 1, 2], [0, 2, 3]]
thickness = 1e-3
density = 1000.0
young = [1e9]
prestress = [1e6, 1e6]
[output]
fields = 1e-3
"#;
    let dir = tempfile::tempdir().unwrap();
    let options = Options { out: Some(dir.path().to_owned()), shortcuts: true };
    let structure = FemSolver::new(&scene(text), &options).unwrap();
    let mut run = Run::of(structure, coupled_plan(1e-3, Sampling::Means, 1, 1));
    run.step(1e-3, &[]);
    run.solver.finish().unwrap();
    let file = std::fs::read_to_string(dir.path().join("fields/structure_faces_000002.vtu")).unwrap();
    for field in ["displacement", "stress_1", "stress_2", "slack"] {
        assert!(file.contains(&format!("Name=\"{field}\"")), "{field}");
    }
    let triangle = &run.solver.model().elements[0];
    // The prestress as a strain, and back.
    assert!(triangle.face_stresses(&[0.0; 9]).iter().all(|s| off(*s, 1e6) < 1e-14), "{triangle:?}");
}

#[test]
fn newton_that_fails_says_what_it_waits_for() {
    let run = Run::alone(&net("integrator = \"static\""), 1e-3);
    let model = run.solver.model();
    let failed = |moving, unstable| {
        let failure =
            Failure::NotConverged { iterations: 30, residual: 9e-5, limit: 2e-4, worst: 8, moving, unstable };
        failure.describe(model)
    };
    let words = failed(Some(1e-3), None);
    assert!(
        words.contains("9.00e-5 N of 2.00e-4 N allowed, but the last one still moved 1.00e-3 m"),
        "{words}"
    );
    let words = failed(None, Some(9));
    assert!(words.contains("largest at node 8 at (0.15, 0.15, 0) in x"), "{words}");
    assert!(
        words.ends_with("first at node 9 at (0.3, 0.15, 0) in x (free to move, slack, or buckled)"),
        "{words}"
    );
}
