//! The trajectory of a rock: savings, rest, leaving, what is reported, large coordinates.

use crate::bench::{Bench, dropped, plane};
use interface_defs::verdict::{Fate, Verdict};
use interface_defs::{Solver, Statistics};

/// A block on a slope of `slope` degrees.
fn block(slope: f64, friction: f64, more: &str) -> String {
    let (sin, cos) = (0.5 * slope.to_radians()).sin_cos();
    format!(
        "end_time = 20.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [0.0, 0.0, 0.7]\norientation = [{cos:?}, 0.0, {sin:?}, 0.0]\n\
         density = 2500.0\nshape = {{ type = \"box\", size = [0.8, 0.6, 0.5] }}\ncluster.spheres = 64\n[terrain]\n\
         file = \"t.obj\"\n[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.25\n\
         restitution = 0.4\nfriction = {friction:?}\n{more}"
    )
}

/// Ten bounces with friction on a plane: the same to the last bit.
#[test]
fn flight_in_closed_form_changes_nothing() {
    let scene = dropped(10.0, 1e9, 0.85, 0.3, "");
    let mesh = plane(10.0, [-10.0, 60.0], 40, 10);
    let run = |shortcuts| {
        let mut bench = Bench::new(&mesh, &scene, shortcuts);
        let mut places = Vec::new();
        while bench.solver.state().bodies[0].path.impacts < 11 {
            bench.advance(0.05);
            places.push(bench.position());
            assert!(bench.time < 12.0, "too few bounces");
        }
        let touches = bench.touches();
        let counts = bench.solver.finish().expect("finished").counts;
        let steps = counts.iter().find(|(name, _)| name == "sub_steps").expect("counted").1;
        (places, touches, steps)
    };
    let ((with, touch_with, few), (without, touch_without, many)) = (run(true), run(false));
    assert_eq!(with, without);
    assert_eq!(touch_with.len(), touch_without.len());
    assert!(few < many / 10);
}

/// The verdict on the one rock.
fn verdict(end: &Statistics) -> &Verdict {
    let [one] = &end.verdicts[..] else { panic!("one verdict: {:?}", end.verdicts) };
    one
}

#[test]
fn a_block_that_friction_holds_comes_to_rest_and_its_run_ends() {
    let mut bench = Bench::new(&plane(15.0, [-10.0, 60.0], 30, 10), &block(15.0, 0.6, ""), true);
    bench.run(0.05, 20.0);
    assert!(bench.solver.has_ended() && bench.time < 5.0, "{} s", bench.time);
    let end = bench.solver.finish().expect("finished");
    let measure = |name: &str| {
        end.measures.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}")).value
    };
    assert!((measure("rest_x") - bench.position().x).abs() < 1e-12);
    assert!(measure("runout_distance") < 2.0 && measure("impacts") >= 1.0, "{:?}", end.measures);
    assert!((0.05..1.0).contains(&measure("contact_time_fraction")));
    let (verdict, at) = (verdict(&end), bench.position());
    let place = format!("came to rest on the terrain near ({:.2}, {:.2}, {:.2}) at ", at.x, at.y, at.z);
    assert!(verdict.to_string().contains(&place), "{verdict}");
    assert_eq!(verdict.fate, Fate::AtRest);
    assert!((verdict.time - bench.time).abs() < 1e-9, "{verdict} {}", bench.time);
    // It fell 0.7 m less what its lowest corner needs.
    assert!(measure("max_speed") < (2.0_f64 * 9.81 * 0.7).sqrt() && measure("max_jump_height") < 0.7);
    let speed = bench.solver.state().bodies[0].motion.velocity.norm();
    assert!(speed < 0.01, "{speed}");
}

#[test]
fn a_block_that_slides_off_the_terrain_ends_there() {
    let mut bench = Bench::new(&plane(40.0, [-5.0, 20.0], 30, 10), &block(40.0, 0.2, ""), true);
    bench.run(0.05, 20.0);
    assert!(bench.solver.has_ended() && bench.time < 10.0, "{} s", bench.time);
    let end = bench.solver.finish().expect("finished");
    assert!(end.measures.iter().all(|m| m.name != "runout_distance"));
    let of = |name: &str| end.measures.iter().find(|m| m.name == name).map(|m| m.value);
    assert!(of("exit_distance").is_some());
    // At the border, with a step of contact at most, though the window goes on.
    let verdict = verdict(&end);
    assert_eq!(verdict.fate, Fate::LeftTerrain);
    let [x, ..] = verdict.position.expect("a place");
    let border = 20.0 * 40.0_f64.to_radians().cos();
    assert!((x - border).abs() < 0.01, "{verdict}");
    let (last, gone) = (bench.rows().last().map(|row| row[2]).expect("a row"), bench.position().x);
    assert!((last - border).abs() < 0.01 && gone > last, "{last} {gone} {border}");
    assert!(end.warnings.iter().any(|w| w.message.contains("left the terrain")), "{:?}", end.warnings);
    let text = std::fs::read_to_string(bench.dir.path().join("trajectory.svg")).expect("a picture");
    assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
}

#[test]
fn what_a_rock_does_beside_the_terrain_while_another_one_still_moves_does_not_count() {
    // Over a flat plane of 40 m: the first flies over its border, the second bounces in its middle for seconds.
    let rock = |place: [f64; 3], velocity: [f64; 3]| {
        format!(
            "[[rock]]\nposition = {place:?}\nvelocity = {velocity:?}\ndensity = 2500.0\n\
             shape = {{ type = \"sphere\", radius = 0.2 }}\n"
        )
    };
    let scene = format!(
        "end_time = 20.0\ngravity = [0.0, 0.0, -9.81]\n{}{}[terrain]\nfile = \"t.obj\"\n[[contact]]\nlaw = \"hertz_mindlin\"\n\
         young = 1e8\npoisson = 0.25\nrestitution = 0.9\n",
        rock([18.9, 0.0, 3.0], [5.0, 0.0, 0.0]),
        rock([0.0, 0.0, 3.0], [0.0, 0.0, 0.0])
    );
    let mut bench = Bench::new(&plane(0.0, [-20.0, 20.0], 4, 2), &scene, true);
    bench.run(0.05, 2.0);
    let rows = bench.rows();
    let end = bench.solver.finish().expect("finished");
    let measure = |name: &str| end.measures.iter().find(|m| m.name == name).expect(name);
    // It is over the border after 1.1 m at 5 m/s: what counts, and the last row, are there, though the window ends after 0.25 s.
    let exit = measure("rock_exit_distance");
    assert!((exit.value - 1.1).abs() < 1e-9 && (exit.time.expect("a time") - 0.22).abs() < 1e-9, "{exit:?}");
    assert!((measure("rock_max_speed").value - 5.0_f64.hypot(9.81 * 0.22)).abs() < 1e-9);
    // It is highest at its start, whatever is looked at afterwards.
    assert!((measure("rock_max_jump_height").value - 2.8).abs() < 1e-12);
    let last = rows.iter().filter(|row| row[1] == 0.0).map(|row| row[0]).fold(0.0, f64::max);
    assert!((last - 0.22).abs() < 1e-9, "{last}");
}

#[test]
fn rows_are_finer_in_contact_than_in_flight_and_their_energies_add_up() {
    let mut bench = Bench::new(&plane(30.0, [-10.0, 60.0], 1, 1), &dropped(30.0, 1e9, 0.7, 0.3, ""), true);
    bench.run(0.05, 3.0);
    let rows = bench.rows();
    let gaps = |touching: f64| {
        let mut gaps: Vec<f64> = rows
            .windows(2)
            .filter(|w| w[0][15] == touching && w[1][15] == touching)
            .map(|w| w[1][0] - w[0][0])
            .collect();
        gaps.sort_by(f64::total_cmp);
        gaps[gaps.len() / 2]
    };
    assert!(gaps(1.0) < 1e-3 && (gaps(0.0) - 0.05).abs() < 1e-9, "{} {}", gaps(1.0), gaps(0.0));
    assert!(rows.windows(2).all(|w| w[1][0] > w[0][0]), "rows go forward");
    // Until the first touch nothing is lost; 0.8 m of the drop show above the ground.
    let first = rows.iter().position(|r| r[15] == 1.0).expect("touches");
    let start: f64 = rows[0][11..14].iter().sum();
    for row in &rows[..first] {
        assert!((row[11..14].iter().sum::<f64>() - start).abs() < 1e-9 * rows[first][11]);
    }
    // Lowest point 1 m above where it touches; the ground under the centre lies 0.2 tan(30) sin(30) lower.
    let expected = 1.0 + 0.2 / 30_f64.to_radians().cos() - 0.2;
    assert!((rows[0][14] - expected).abs() < 1e-12, "{}", rows[0][14]);
}

/// Coordinates of a survey lose nothing: moved by whole metres that a double holds, the way is the same to
/// the last bit.
#[test]
fn a_terrain_at_2_6e6_m_gives_the_same_way_bit_for_bit() {
    let shift = nalgebra::Vector3::new(2_600_000.0, 1_200_000.0, 1_500.0);
    let run = |shift: nalgebra::Vector3<f64>| {
        // Heights and places of eighths of a metre stay exact when moved.
        let mut mesh = plane(30.0, [-10.0, 60.0], 20, 5);
        for node in &mut mesh.nodes {
            *node = node.map(|v| (v * 8.0).round() / 8.0) + shift;
        }
        let at: [f64; 3] = (nalgebra::Vector3::new(0.125, 0.0, 1.25) + shift).into();
        let text = dropped(30.0, 1e9, 0.7, 0.4, "");
        let scene = text.lines().map(|line| {
            if line.starts_with("position") { format!("position = {at:?}\n") } else { format!("{line}\n") }
        });
        let mut bench = Bench::new(&mesh, &scene.collect::<String>(), true);
        bench.run(0.05, 3.0);
        bench.solver.state().bodies[0].motion
    };
    let (here, there) = (run(nalgebra::Vector3::zeros()), run(shift));
    assert_eq!(here, there);
}

#[test]
fn a_window_solved_again_gives_the_same_bytes_whatever_was_solved_between() {
    let mut bench = Bench::new(&plane(15.0, [-10.0, 60.0], 30, 10), &block(15.0, 0.6, ""), true);
    let window = |start: f64, length: f64| interface_defs::Window { number: 1, iteration: 1, start, length };
    for _ in 0..12 {
        let start = bench.time;
        let mut first = bench.output.clone();
        let mut again = bench.output.clone();
        bench.solver.solve(&window(start, 0.05), &[], &mut first).expect("solved");
        bench.solver.solve(&window(start, 0.013), &[], &mut again).expect("solved");
        bench.solver.solve(&window(start, 0.05), &[], &mut again).expect("solved");
        assert_eq!(first, again);
        bench.advance(0.05);
        assert_eq!(first, bench.output);
    }
}

/// A block of three moments that tumbles at 7 rad/s for 1.5 s.
#[test]
fn a_tumbling_flight_in_closed_form_changes_nothing() {
    let scene = block(0.0, 0.5, "")
        .replace("0.0, 0.0, 0.7", "0.0, 0.0, 20.0")
        .replace("density", "angular_velocity = [1.0, 6.0, 3.0]\ndensity");
    let run = |shortcuts| {
        let mut bench = Bench::new(&plane(0.0, [-20.0, 20.0], 4, 4), &scene, shortcuts);
        let start = bench.solver.state().bodies[0].motion;
        bench.run(0.05, 1.5);
        let counts = bench.solver.finish().expect("finished").counts;
        let flown = counts.iter().find(|(name, _)| name == "flight_steps").expect("counted").1;
        let end = bench.solver.state().bodies[0].motion;
        assert_eq!(end.angular_momentum, start.angular_momentum);
        (end, flown)
    };
    let ((with, flown), (without, none)) = (run(true), run(false));
    assert!(flown > 0 && none == 0);
    assert_eq!(with, without);
}

/// A cube that lands on a corner, at half the speed that its terrain would allow: as many steps in this contact as the
/// scene asks for, and not as its largest face would need at the highest speed. The restitution errs by 2.5 / N^2
/// with N steps, 1e-3 with 50; the finer run by less.
#[test]
fn the_step_follows_the_contact_at_hand_within_the_error_that_the_scene_asks_for() {
    let scene = |dem: &str| {
        format!(
            "end_time = 5.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [0.0, 0.0, 1.2]\n\
             orientation = [0.88, 0.28, -0.36, 0.1]\ndensity = 2500.0\nshape = {{ type = \"box\", size = [0.6, 0.6, 0.6] }}\n\
             cluster.spheres = 512\n[terrain]\nfile = \"t.obj\"\n[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e9\n\
             poisson = 0.25\nrestitution = 0.5\nfriction = 0.0\n{dem}"
        )
    };
    let run = |dem: &str| {
        let mut bench = Bench::new(&plane(0.0, [-10.0, 10.0], 3, 3), &scene(dem), true);
        let mut touched = false;
        loop {
            bench.advance(2e-3);
            let body = &bench.solver.state().bodies[0];
            touched |= body.path.impacts > 0;
            if touched && body.contacts == 0 {
                break;
            }
            assert!(bench.time < 2.0, "never lands and leaves");
        }
        let counts = bench.solver.finish().expect("finished").counts;
        let steps = counts.iter().find(|(name, _)| name == "sub_steps").expect("counted").1;
        let step = bench.solver.model().steps.step;
        // The velocity with which it flew off, which gravity has changed since.
        let velocity = bench.solver.state().bodies[0].motion.velocity;
        (velocity + nalgebra::Vector3::z() * (9.81 * bench.time), steps, step)
    };
    let (own, few, step) = run("");
    let (fixed, many, _) = run(&format!("[dem]\ntime_step = {step:?}\n"));
    let off = (own - fixed).norm();
    println!("{few} steps instead of {many}, {off:.1e} m/s apart");
    assert!(few < many / 2, "{few} {many}");
    // The speed of the landing, 4 m/s, is what the restitution takes its share of; twice for the turn that goes with it.
    assert!(off < 2.0 * 1e-3 * 4.0, "{off:.2e}");
}

/// A ParaView scene of a terrain: its triangles, once, and the ways as lines, beside the series of the rocks.
#[test]
fn fields_hold_the_terrain_and_the_way_where_fields_are_named() {
    for (more, there) in [("[output]\nfields = 0.1\n", true), ("", false)] {
        let mut bench = Bench::new(&plane(15.0, [-10.0, 60.0], 30, 10), &block(15.0, 0.6, more), true);
        bench.run(0.05, 1.0);
        bench.solver.finish().expect("finished");
        let read = |name: &str| std::fs::read_to_string(bench.dir.path().join("fields").join(name));
        assert_eq!(read("terrain.vtu").is_ok(), there);
        if there {
            let terrain = read("terrain.vtu").expect("written");
            assert!(terrain.contains("NumberOfPoints=\"341\" NumberOfCells=\"600\""));
            let file = read("trajectory.vtu").expect("written");
            let number = |key: &str| -> usize {
                let text = file.split(key).nth(1).and_then(|t| t.split('"').nth(1)).expect("declared");
                text.parse().expect("a number")
            };
            // The rows, and more in long flights.
            assert!(number("NumberOfPoints=") >= bench.rows().len());
            assert_eq!(number("NumberOfCells="), number("NumberOfPoints=") - 1);
        }
    }
}

/// Lengths times s, times and speeds times sqrt(s), moduli times s: a block that falls on a slope, turns, slides and comes to rest does
/// the same, but for rounding, which each impact of its spheres magnifies. What a scene leaves open is told in its own measures:
/// the speed and time of rest are scaled here, since their defaults are not of the scene.
#[test]
fn a_slope_of_another_size_gives_the_same_way() {
    let run = |s: f64| {
        let (length, time) = (s, s.sqrt());
        let mut mesh = plane(15.0, [-10.0, 60.0], 30, 10);
        mesh.nodes.iter_mut().for_each(|n| *n *= length);
        let scene = block(15.0, 0.6, "")
            .replace("end_time = 20.0", &format!("end_time = {:?}", 20.0 * time))
            .replace(
                "[0.0, 0.0, 0.7]",
                &format!("[0.0, 0.0, {:?}]\nvelocity = [{:?}, 0.0, 0.0]", 0.7 * length, time),
            )
            .replace("[0.8, 0.6, 0.5]", &format!("{:?}", [0.8, 0.6, 0.5].map(|a| a * length)))
            .replace("young = 1e8", &format!("young = {:?}", 1e8 * length))
            .replace(
                "\"t.obj\"",
                &format!("\"t.obj\"\nrest_speed = {:?}\nrest_time = {:?}", 0.01 * time, 0.5 * time),
            );
        let mut bench = Bench::new(&mesh, &scene, true);
        bench.run(0.05 * time, 20.0 * time);
        assert!(bench.solver.has_ended(), "at rest");
        let end = bench.solver.finish().expect("finished");
        let measure = |name: &str| {
            end.measures.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}")).value
        };
        [
            bench.time / time,
            bench.position().x / length,
            bench.position().z / length,
            measure("runout_distance") / length,
            measure("max_speed") / time,
            measure("impacts"),
        ]
    };
    let own = run(1.0);
    for s in [0.1, 10.0] {
        let other = run(s);
        let off = own.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("scaled by {s}: {off:.1e} off; {own:?}");
        assert!(off < 1e-9, "{s}: {own:?} {other:?}");
    }
}

#[test]
fn a_rock_that_starts_below_or_beside_the_terrain_is_refused_with_a_place_that_is_free() {
    let mesh = plane(15.0, [-10.0, 60.0], 30, 10);
    let refused = |place: &str| {
        let dir = tempfile::tempdir().expect("a directory");
        std::fs::write(dir.path().join("t.obj"), mesh.obj()).expect("written");
        let text = block(15.0, 0.6, "").replace("[0.0, 0.0, 0.7]", place);
        let name = dir.path().join("s.toml").display().to_string();
        let scene = toolkit::scene::Scene::from_text(&name, &text).expect("a scene");
        dem_solver::DemSolver::new(&scene, &Default::default()).err().map(|e| e.to_string())
    };
    assert_eq!(refused("[0.0, 0.0, 0.7]"), None);
    let below = refused("[0.0, 0.0, -0.25]").expect("refused");
    assert!(below.contains(":4:12: rock `rock` starts 0.25 m below the terrain"), "{below}");
    let free = below.rsplit("position = ").next().expect("a place").trim().to_owned();
    assert_eq!(refused(&free), None);
    let beside = refused("[0.0, 11.0, 5.0]").expect("refused");
    assert!(beside.contains("starts beside the terrain, at (0, 11, 5)"), "{beside}");
}

/// A rock of spheres of many sizes that lands on its flanks: the box around it is not what it fills, and a contact a fifth of a
/// small radius deep inside of that box is a contact like others.
#[test]
fn a_rock_of_any_shape_goes_its_way_to_rest() {
    let scene = block(35.0, 0.6, "").replace("young = 1e8", "young = 3e10").replace(
        "shape = { type = \"box\", size = [0.8, 0.6, 0.5] }\ncluster.spheres = 64",
        "shape = { type = \"random_convex\", size = [1.2, 0.9, 0.7], seed = 4 }\ncluster.spheres = 200",
    );
    let mut mesh = plane(35.0, [-10.0, 60.0], 30, 10);
    // A run-out: beyond x = 20 m it is flat.
    for node in &mut mesh.nodes {
        node.z = node.z.max(-20.0 * 35.0_f64.to_radians().tan());
        node.x += (node.x - 20.0).max(0.0) * 2.0;
        node.y *= 10.0;
    }
    let mut bench = Bench::new(&mesh, &scene.replace("end_time = 20.0", "end_time = 60.0"), true);
    bench.run(0.05, 60.0);
    let end = bench.solver.finish().expect("finished");
    assert!(end.measures.iter().any(|m| m.name == "rest_x"), "{:?} {:?}", end.measures, end.warnings);
}
