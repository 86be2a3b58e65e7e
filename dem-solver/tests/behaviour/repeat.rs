//! A solver is a function of (committed state, window, input), whatever was asked of it in between.

use crate::bench::{Bench, Setup, cube, fixed_plane, net};
use crate::wires::{tangled, wave};
use interface_defs::{Sampling, Solver, Window, name};
use nalgebra::Vector3;
use toolkit::alloc::allocations;

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|x| x.to_bits()).collect()
}

/// With friction and contact in most windows; reach is asked for too.
fn setup() -> Setup {
    Setup { reach: true, ..tangled(64, 1) }
}

#[test]
fn solving_a_then_b_then_a_gives_the_bytes_of_a() {
    let mut bench = setup().build();
    let mut contacts = 0.0;
    for window in 0..300 {
        wave(&mut bench, 1, 1e-4);
        bench.solve(1e-4).expect("solved");
        let (a, input) = (bits(&bench.output), bench.input.clone());
        // Another motion, far enough to renew every list; another length.
        bench.displace(1, |node, _| Vector3::new(0.01, -0.02, -0.05 - 1e-3 * (node % 7) as f64));
        let _ = bench.solve(1.3e-4);
        bench.input.copy_from_slice(&input);
        bench.solve(1e-4).expect("solved");
        assert_eq!(bits(&bench.output), a, "window {window}");
        contacts += bench.value("contacts");
        bench.commit(1e-4);
    }
    assert!(contacts > 100.0, "the test is about contact: {contacts}");
}

/// Lines that are broken in the request touch nothing, whatever was asked of others in between, and the spring energy of their
/// contacts is lost.
#[test]
fn what_is_broken_is_not_touched_and_no_detour_shows() {
    for selection in ["nearest", "continuous"] {
        let mut setup = Setup { broken: true, ..setup() };
        setup.scene = setup.scene.replace("[dem]", &format!("[dem]\ncontact_selection = \"{selection}\""));
        // From window number `torn` on all lines are broken. Returns all bytes, and contacts at each window's end.
        let run = |torn: usize, detours: bool| {
            let mut bench = setup.build();
            let (mut history, mut contacts) = (Vec::new(), Vec::new());
            for window in 0..300 {
                wave(&mut bench, 1, 1e-4);
                if detours {
                    bench.tear(|line| line % 2 == 0);
                    let _ = bench.solve(1e-4);
                    bench.tear(|_| false);
                    let _ = bench.solve(1.3e-4);
                }
                bench.tear(|_| window >= torn);
                let before = bench.value("energy_dissipated_dem");
                bench.advance(1e-4);
                if window == torn {
                    assert!(bench.value("energy_dissipated_dem") > before, "the springs' energy is lost");
                }
                if window >= torn {
                    assert_eq!(bench.value("contacts"), 0.0, "window {window}");
                    assert_eq!(bench.total_force(Sampling::Means), Vector3::zeros());
                }
                contacts.push(bench.value("contacts"));
                history.extend(bits(&bench.output));
            }
            (history, contacts)
        };
        let (_, contacts) = run(usize::MAX, false);
        let most = (0..contacts.len()).max_by(|a, b| contacts[*a].total_cmp(&contacts[*b])).expect("windows");
        assert!(contacts[most] > 0.0);
        assert!(run(most + 1, false).0 == run(most + 1, true).0, "a detour shows");
    }
}

/// The same run with and without detours in between, to the last bit over the whole history: the age
/// of the lists does not show.
#[test]
fn results_do_not_depend_on_when_candidates_were_searched() {
    let run = |detours: bool| {
        let mut bench = setup().build();
        let mut history = Vec::new();
        for window in 0..300 {
            if detours && window % 3 == 0 {
                bench.displace(0, |_, _| Vector3::new(0.0, 0.3, 0.0));
                bench.displace(1, |_, _| Vector3::new(0.0, 0.3, 0.0));
                let _ = bench.solve(5e-5);
            }
            wave(&mut bench, 1, 1e-4);
            bench.advance(1e-4);
            history.extend(bits(&bench.output));
        }
        history
    };
    assert_eq!(run(false), run(true));
}

#[test]
fn two_runs_are_equal_to_the_last_bit() {
    let run = || {
        let mut bench = setup().build();
        (0..200)
            .flat_map(|_| {
                wave(&mut bench, 1, 1e-4);
                bench.advance(1e-4);
                bits(&bench.output)
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

/// Falling onto a net, flight included.
fn fall(shape: &str, more: &str, shortcuts: bool) -> Bench {
    let scene = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nmass = 180.0\nposition = [0.0, 0.0, 0.8]\n{shape}\n{more}\n\
         [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\nrestitution = 0.8\nfriction = 0.4\n\
         [dem]\ntime_step = 5e-5\n"
    );
    Setup { shortcuts, ..Setup::new(scene, net(10, 0.15, 0.002)) }.build()
}

#[test]
fn flight_in_closed_form_is_stepping() {
    let cube = "shape = { type = \"box\", size = [0.41, 0.41, 0.41] }";
    let slab = "shape = { type = \"box\", size = [0.2, 0.4, 0.5] }";
    let spin = "angular_velocity = [1.0, 2.0, 0.5]\nvelocity = [0.1, 0.0, 1.0]";
    for (shape, more) in [(cube, ""), (cube, spin), (slab, spin), (slab, "velocity = [0.0, 0.0, 1.0]")] {
        let (mut fast, mut slow) = (fall(shape, more, true), fall(shape, more, false));
        for _ in 0..90 {
            fast.advance(2.5e-3);
            slow.advance(2.5e-3);
            assert_eq!(bits(&fast.output), bits(&slow.output), "at {}", fast.time);
        }
        let flights = |bench: &mut Bench| {
            let counts = bench.solver.finish().expect("finished").counts;
            counts.iter().find(|(name, _)| name == "flight_windows").expect("counted").1
        };
        assert!(flights(&mut fast) >= 90 && flights(&mut slow) == 0);
    }
}

#[test]
fn no_window_after_the_first_allocates() {
    let mut bench = setup().build();
    let (mut most, mut touched) = (0, 0.0);
    for window in 0..400 {
        wave(&mut bench, 1, 1e-4);
        let before = allocations();
        bench.solve(1e-4).expect("solved");
        bench.solver.commit().expect("committed");
        let made = allocations() - before;
        if window > 0 {
            most = most.max(made);
        }
        touched += bench.value("contacts");
        bench.time += 1e-4;
    }
    assert!(touched > 100.0);
    assert_eq!(most, 0);
}

/// Reach follows from state, window and input: it holds the nodes that are touched, and none afar.
#[test]
fn reach_names_the_nodes_that_may_be_touched() {
    let mut bench = setup().build();
    for _ in 0..300 {
        wave(&mut bench, 1, 1e-4);
        bench.advance(1e-4);
        let reach =
            bench.output[bench.gives.sample(name::REACH, Sampling::Once, 0).expect("planned")].to_vec();
        let forces = bench.force(Sampling::Means, 0);
        for (node, force) in forces.iter().enumerate() {
            assert!(
                *force == Vector3::zeros() || reach[node] == 1.0,
                "node {node} is loaded and not in reach"
            );
        }
        assert!(
            reach.iter().sum::<f64>() < 60.0,
            "{} of {} nodes in reach",
            reach.iter().sum::<f64>(),
            reach.len()
        );
    }
}

/// A long window in which the rock falls right through several lists, in many steps.
#[test]
fn one_long_window_has_the_steps_of_many_short_ones() {
    let scene = format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\n\
         restitution = 0.8\nfriction = 0.4\n[dem]\ntime_step = 5e-5\n",
        cube(64, "position = [0.0, 0.0, 1.0]\norientation = [0.9, 0.3, 0.1, 0.0]")
    );
    let run = |length: f64| {
        let mut bench = Setup { shortcuts: false, ..Setup::new(scene.clone(), fixed_plane(2.0, 4)) }.build();
        for _ in 0..(0.512 / length).round() as usize {
            bench.advance(length);
        }
        assert!(bench.value("energy_dissipated_dem") > 1.0, "it has touched");
        bench.position()
    };
    // Steps of 5e-5 s in windows of 0.128 s: the same 2560 steps per window but for the last bits of h.
    assert!((run(0.128) - run(1e-3)).norm() < 1e-9);
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_the_window() {
    let mut bench = setup().build();
    wave(&mut bench, 1, 1e-4);
    let mut solve = |number| {
        let window = Window { number, iteration: number as u32, start: 0.0, length: 1e-4 };
        bench.solver.solve(&window, &bench.input, &mut bench.output).expect("solved");
        bits(&bench.output)
    };
    assert_eq!(solve(1), solve(17));
}
