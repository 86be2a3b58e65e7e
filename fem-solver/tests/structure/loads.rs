//! Loads with a history, pressure on faces, velocities at t = 0: closed forms, work, faults of the input.

use crate::common::{Run, coupled_plan, off, scene};
use fem_solver::FemSolver;
use interface_defs::Sampling;
use interface_defs::toolkit::program::Options;
use std::f64::consts::PI;

/// Every integrator in time, as it stands in a scene.
const SCHEMES: [&str; 6] = [
    "integrator = \"central_difference\"",
    "integrator = \"generalized_alpha\"",
    "integrator = \"generalized_alpha\"\nrho_inf = 0.5",
    "integrator = \"generalized_alpha\"\nrho_inf = 0.0",
    "integrator = \"newmark\"",
    "integrator = \"bossak\"\nalpha = -0.1",
];
const MIDPOINT: &str = SCHEMES[1];

/// A mass of 1 kg on a spring of 100 N/m along z, 100 N times the factors of `history` on it.
fn oscillator(scheme: &str, step: f64, history: &str) -> String {
    format!(
        r#"
end_time = 10.0
[structure]
nodes = [[0.0, 0.0, 0.0]]
masses = [{{ nodes = [0], mass = 1.0 }}]
springs = [{{ nodes = [0], stiffness = [0.0, 0.0, 100.0] }}]
loads = [{{ nodes = [0], force = [0.0, 0.0, 100.0], history = {history} }}]
supports = [{{ nodes = [0], directions = "xy" }}]
[[gauge]]
name = "mass"
at = [0.0, 0.0, 0.0]
quantity = "displacement"
[fem]
time_step = {step:?}
{scheme}
"#
    )
}

#[test]
fn a_ramp_swings_an_oscillator_as_its_closed_form_says_with_an_error_of_second_order() {
    // w = 10: under a ramp over T, u = t/T - sin(w t)/(w T); then 1 + (sin w(t - T) - sin w t)/(w T). The corner at T lies
    // within a step.
    let (w, length) = (10.0, 0.5005);
    let exact = |t: f64| match t {
        t if t < length => t / length - (w * t).sin() / (w * length),
        _ => 1.0 + ((w * (t - length)).sin() - (w * t).sin()) / (w * length),
    };
    for scheme in SCHEMES {
        let worst = |step: f64| {
            let mut run = Run::alone(&oscillator(scheme, step, "[[0.0, 0.0], [0.5005, 1.0]]"), 0.05);
            let mut worst = 0.0_f64;
            for n in 1..=40 {
                run.step(0.05, &[]);
                worst = worst.max((run.value("mass_uz") - exact(0.05 * f64::from(n))).abs());
            }
            worst
        };
        let (coarse, fine) = (worst(2e-3), worst(1e-3));
        // w t (w h)^2 / 12 of the swing of 0.2 m at most, times 2 for the schemes that damp.
        assert!(fine < 2.0 * 20.0 * 1e-4 / 12.0 && coarse / fine > 3.0, "{scheme}: {coarse:.2e} {fine:.2e}");
    }
}

#[test]
fn a_half_sine_leaves_the_swing_of_its_closed_form() {
    // After sin(pi t / T) over T: u = -r / (1 - r^2) (sin w t + sin w (t - T)), r = pi / (T w).
    let (w, length, rows) = (10.0, 0.2, 100);
    let history: Vec<String> = (0..=rows)
        .map(|i| f64::from(i) / f64::from(rows))
        .map(|x| format!("[{:?}, {:?}]", x * length, (PI * x).sin()))
        .collect();
    let history = format!("[{}]", history.join(", "));
    let r = PI / (length * w);
    for scheme in [SCHEMES[0], MIDPOINT] {
        let mut run = Run::alone(&oscillator(scheme, 5e-4, &history), 0.05);
        for n in 1..=40 {
            run.step(0.05, &[]);
            let t = 0.05 * f64::from(n);
            let exact = -r / (1.0 - r * r) * ((w * t).sin() + (w * (t - length)).sin());
            // The table cuts pi^2 / (12 rows^2) off the impulse, the step shifts the phase by w t (w h)^2 / 12.
            let error = (run.value("mass_uz") - exact).abs();
            assert!(t < length || error < 2e-4, "{scheme} at {t}: off by {error:.2e}");
        }
    }
}

#[test]
fn the_work_of_a_load_with_a_history_closes_the_balance() {
    let history = "[[0.0, 0.0], [0.1234, 1.5], [0.2, -1.0], [0.7, 0.3]]";
    for scheme in SCHEMES {
        let error = |step: f64| {
            let mut run = Run::alone(&oscillator(scheme, step, history), 0.05);
            let start = run.balance();
            let mut most = 0.0_f64;
            for _ in 0..20 {
                run.step(0.05, &[]);
                most = most.max((run.balance() - start).abs());
            }
            assert!(run.value("energy_loads_fem").abs() > 1.0 && run.value("energy_potential_fem") == 0.0);
            most / run.value("energy_loads_fem").abs()
        };
        let (coarse, fine) = (error(2e-3), error(1e-3));
        // The midpoint rule has no error but Newton's.
        assert!(fine < 1e-8 || (fine < 1e-3 && coarse / fine > 3.0), "{scheme}: {coarse:.2e} {fine:.2e}");
    }
}

#[test]
fn before_its_history_begins_a_structure_rests_and_its_windows_are_skipped() {
    let history = "[[0.5, 0.4], [0.6, 1.0]]";
    let mut run = Run::alone(&oscillator(MIDPOINT, 1e-3, history), 0.1);
    // It hangs under the load of t = 0 in equilibrium.
    assert!((run.ready.mesh.coordinates[2] - 0.4).abs() < 1e-12);
    (0..10).for_each(|_| run.step(0.1, &[]));
    assert_eq!(run.count("skipped_windows"), 5);
    assert!(run.value("mass_uz").abs() > 0.1);
}

#[test]
fn statics_follows_the_history_of_its_loads_with_exact_work() {
    let mut run =
        Run::alone(&oscillator("integrator = \"static\"", 1.0, "[[0.0, 0.0], [1.0, 2.0], [1.5, 0.0]]"), 0.25);
    for n in 1..=6 {
        run.step(0.25, &[]);
        let t = 0.25 * f64::from(n);
        let factor = if t <= 1.0 { 2.0 * t } else { 2.0 * (1.5 - t) / 0.5 };
        assert!((run.value("mass_uz") - factor).abs() < 1e-9, "{t}: {}", run.value("mass_uz"));
        assert!((run.value("energy_loads_fem") + 50.0 * factor * factor).abs() < 1e-6);
        assert!((run.value("reaction_z") + 100.0 * factor).abs() < 1e-6);
    }
}

/// A quarter of a disc or of the octant of a sphere: a triangle of rows of nodes 0, 1, .. `n`, and the cells between them.
fn triangle(n: usize, at: impl Fn(f64, f64, f64) -> [f64; 3]) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let first = |row: usize| row * (row + 1) / 2;
    let (mut nodes, mut cells) = (Vec::new(), Vec::new());
    for row in 0..=n {
        for i in 0..=row {
            let share = |k: usize| k as f64 / n as f64;
            nodes.push(at(share(n - row), share(row - i), share(i)));
        }
    }
    for row in 0..n {
        for i in 0..=row {
            cells.push([first(row) + i, first(row + 1) + i, first(row + 1) + i + 1]);
            if i < row {
                cells.push([first(row) + i, first(row + 1) + i + 1, first(row) + i + 1]);
            }
        }
    }
    (nodes, cells)
}

/// The octant of a sphere of radius 1 m with its planes of symmetry held, the pressure of `pressures` on it.
fn octant(n: usize, material: &str, pressures: &str, fem: &str) -> String {
    let (nodes, cells) = triangle(n, |a, b, c| {
        let size = (a * a + b * b + c * c).sqrt();
        [a / size, b / size, c / size]
    });
    let plane = |c: usize| (0..nodes.len()).filter(|i| nodes[*i][c].abs() < 1e-12).collect::<Vec<_>>();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
form_finding = "none"
supports = [{{ group = "x0", directions = "x" }}, {{ group = "y0", directions = "y" }},
            {{ group = "z0", directions = "z" }}]
groups = [{{ name = "x0", nodes = {:?} }}, {{ name = "y0", nodes = {:?} }}, {{ name = "z0", nodes = {:?} }}]
{pressures}
[[structure.parts]]
name = "skin"
element = "membrane"
cells = {cells:?}
thickness = 1e-3
density = 1000.0
{material}
[[gauge]]
name = "x0"
group = "x0"
quantity = "force"
[fem]
{fem}
"#,
        plane(0),
        plane(1),
        plane(2)
    )
}

#[test]
fn a_sphere_under_pressure_has_the_stress_p_r_over_2_t() {
    let pressures =
        "pressures = [{ group = \"skin\", pressure = 1000.0, history = [[0.0, 0.0], [1.0, 1.0]] }]";
    let error = |n: usize| {
        let text = octant(n, "young = [1e9]\npoisson = 0.3", pressures, "integrator = \"static\"");
        let mut run = Run::with(&text, coupled_plan(1.0, Sampling::AtEnds, 1, 1));
        run.step(1.0, &[]);
        let model = run.solver.model();
        // p r (1 - nu) / (2 E t) of the radius: 3.5e-4. The pressure does half of p times the volume that it gains.
        let growth = -run.value("energy_loads_fem") / (0.5 * 1000.0 * 0.5 * PI);
        let stress: f64 = model
            .elements
            .iter()
            .map(|element| {
                let u: Vec<f64> = element.nodes().iter().flat_map(|node| run.displacement(*node)).collect();
                let [large, small] = element.face_stresses(&u);
                0.5 * (large + small)
            })
            .sum::<f64>()
            / model.elements.len() as f64;
        // In balance to rounding: the symmetry plane carries the pressure on the polygon that it cuts out.
        let outline: Vec<_> = model.nodes.iter().filter(|p| p.x.abs() < 1e-12).collect();
        let angle = |p: &nalgebra::Vector3<f64>| p.z.atan2(p.y);
        let mut outline = outline;
        outline.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        let area: f64 = outline.windows(2).map(|e| 0.5 * (e[0].y * e[1].z - e[0].z * e[1].y)).sum();
        let grown = area * (1.0 + 2.0 * growth);
        assert!(off(-run.value("x0_fx_sum"), 1000.0 * grown) < 1e-4, "{} {grown}", run.value("x0_fx_sum"));
        (off(stress, 1000.0 / 2e-3), off(growth, 3.5e-4))
    };
    let (coarse, fine) = (error(6), error(12));
    assert!(fine.0 < 0.01 && fine.1 < 0.02, "{fine:?}");
    assert!(coarse.0 / fine.0 > 3.0 && coarse.1 / fine.1 > 3.0, "{coarse:?} {fine:?}: of second order");
}

#[test]
fn a_soft_balloon_is_blown_up_in_a_few_iterations() {
    // A stretch of 10 % in ten steps: where the load stiffness is not in the tangent, each iteration leaves some percent
    // of the error before, and so few are not enough.
    let pressures = "pressures = [{ group = \"skin\", pressure = 3e4, history = [[0.0, 0.0], [1.0, 1.0]] }]";
    let text =
        octant(6, "young = [1e8]\npoisson = 0.3\nwrinkles = false", pressures, "integrator = \"static\"");
    let mut run = Run::with(&text, coupled_plan(0.1, Sampling::AtEnds, 1, 1));
    for n in 0..10 {
        let before = run.count("newton_iterations");
        run.step(0.1, &[]);
        let taken = run.count("newton_iterations") - before;
        assert!(n == 0 || taken <= 5, "{taken} iterations in step {n}");
    }
    let growth = run.displacement(0)[0];
    assert!(growth > 0.08, "{growth}");
    assert_eq!(run.count("refined_windows"), 0);
}

#[test]
fn the_work_of_pressure_closes_the_balance_in_every_scheme() {
    let pressures = "damping = 3.0\n\
                     pressures = [{ group = \"skin\", pressure = 1e4, history = [[0.0, 0.0], [0.01, 1.0], [0.02, 0.2]] }]";
    for scheme in SCHEMES {
        let error = |step: f64| {
            let fem = format!("time_step = {step:?}\n{scheme}");
            let text = octant(3, "young = [1e8]\npoisson = 0.3\nwrinkles = false", pressures, &fem);
            let mut run = Run::alone(&text, 4e-3);
            let start = run.balance();
            let (mut most, mut work) = (0.0_f64, 0.0_f64);
            for _ in 0..10 {
                run.step(4e-3, &[]);
                most = most.max((run.balance() - start).abs());
                work = work.max(run.value("energy_loads_fem").abs());
            }
            assert!(work > 10.0, "{work}");
            most / work
        };
        let (coarse, fine) = (error(2e-4), error(1e-4));
        // Elements without the mean stress of a step have an error of second order in the midpoint rule, too.
        assert!(fine < 0.02 && coarse / fine > 2.0, "{scheme}: {coarse:.2e} {fine:.2e}");
    }
}

/// A disc of radius 1 m, 1 cm thick, in rings of triangles; its rim is clamped.
fn plate(rings: usize, pressure: f64) -> String {
    let (mut nodes, mut cells) = (vec![[0.0, 0.0, 0.0]], Vec::new());
    let first = |ring: usize| if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    for ring in 1..=rings {
        for i in 0..6 * ring {
            let (r, angle) = (ring as f64 / rings as f64, PI * i as f64 / (3 * ring) as f64);
            nodes.push([r * angle.cos(), r * angle.sin(), 0.0]);
        }
        let node = |ring: usize, i: usize| if ring == 0 { 0 } else { first(ring) + i % (6 * ring) };
        for side in 0..6 {
            for i in 0..ring {
                let (outer, inner) = (side * ring + i, side * (ring - 1) + i);
                cells.push([node(ring - 1, inner), node(ring, outer), node(ring, outer + 1)]);
                if i + 1 < ring {
                    cells.push([node(ring - 1, inner), node(ring, outer + 1), node(ring - 1, inner + 1)]);
                }
            }
        }
    }
    let rim: Vec<_> = (first(rings)..nodes.len()).collect();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
supports = [{{ nodes = {rim:?}, rotations = "xyz" }}]
pressures = [{{ group = "plate", pressure = {pressure:?} }}]
[[structure.parts]]
name = "plate"
element = "shell"
cells = {cells:?}
thickness = 0.01
density = 0.0
young = 2.1e11
[fem]
integrator = "static"
"#
    )
}

#[test]
fn a_clamped_plate_bends_under_pressure_by_p_a4_over_64_d() {
    // Form finding takes a constant pressure, downward here: against the normals.
    let rigidity = 2.1e11 * 1e-6 / (12.0 * 0.91);
    let (exact, mut errors) = (-100.0 / (64.0 * rigidity), Vec::new());
    for rings in [4, 8] {
        let run = Run::alone(&plate(rings, -100.0), 1.0);
        errors.push(off(run.ready.mesh.coordinates[2], exact));
    }
    assert!(errors[1] < 0.02 && errors[0] / errors[1] > 2.5, "{errors:?}");
}

/// A bar of 1 m in 50 pieces along x, 1e7 Pa, 1e-4 m2, 1000 kg/m3 (c = 100 m/s), its first node held; all of it starts with
/// the velocity `v` along x.
fn bar(v: f64, scheme: &str) -> String {
    let nodes: Vec<_> = (0..=50).map(|i| [0.02 * f64::from(i), 0.0, 0.0]).collect();
    let cables: Vec<_> = (0..50).map(|i| format!("{{ nodes = [{i}, {}] }}", i + 1)).collect();
    let all: Vec<_> = (0..=50).collect();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
cables = [{}]
cable = {{ young = 1e7, area = 1e-4, density = 1000.0, tension_only = false }}
supports = [{{ nodes = [0] }}, {{ group = "all", directions = "yz" }}]
groups = [{{ name = "all", nodes = {all:?} }}]
velocities = [{{ group = "all", velocity = [{v:?}, 0.0, 0.0] }}]
[fem]
{scheme}
"#,
        cables.join(", ")
    )
}

#[test]
fn a_bar_that_hits_a_wall_carries_rho_c_v_and_rebounds() {
    // The wave runs there and back in 2 L / c = 20 ms; the wall gives A rho c v = 10 N as long, 2 m v = 0.2 N s in all (less
    // what the half mass of the held node does not have).
    for scheme in ["time_step = 1e-4", "time_step = 1e-4\nintegrator = \"generalized_alpha\""] {
        let mut run = Run::alone(&bar(-1.0, scheme), 2e-3);
        let moving = 0.1 * (1.0 - 0.01);
        assert!(off(run.value("energy_kinetic_fem"), 0.5 * moving) < 1e-12);
        let start = run.balance();
        let mut impulse = 0.0;
        for n in 0..10 {
            run.step(2e-3, &[]);
            impulse += 2e-3 * run.value("reaction_x");
            // Strains are 1 %, and a bar that is compressed is softer by 1.5 times that.
            if (1..8).contains(&n) {
                assert!(
                    off(run.value("reaction_x"), 10.0) < 0.03,
                    "{scheme} {n}: {}",
                    run.value("reaction_x")
                );
            }
            assert!((run.balance() - start).abs() < 2e-3 * start, "{scheme}: {}", run.balance() - start);
        }
        assert!(off(impulse, 2.0 * moving) < 0.02, "{scheme}: {impulse}");
        assert!(off(run.value("energy_kinetic_fem"), 0.5 * moving) < 0.05, "it flies back");
    }
}

/// The message with which a scene is refused.
fn refused(text: &str) -> String {
    match FemSolver::new(&scene(text), &Options::default()) {
        Ok(_) => panic!("must be refused: {text}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn what_no_one_can_mean_is_refused_where_it_stands() {
    let swing = |history: &str| oscillator(MIDPOINT, 1e-3, history);
    let message = refused(&swing("[[1.0, 0.0], [0.5, 1.0]]"));
    assert!(message.starts_with("test.toml:7:") && message.contains("0.5 s follows 1 s"), "{message}");
    let path =
        swing("[[0.0, 0.0], [1.0, 1.0]]").replace(MIDPOINT, "integrator = \"static\"\npath_speed = 1.0");
    assert!(refused(&path).contains("there is no history"), "{}", refused(&path));

    let skin = |pressures: &str| octant(2, "young = [1e9]", pressures, "integrator = \"static\"");
    let message = refused(&skin("pressures = [{ group = \"skinn\", pressure = 1.0 }]"));
    assert!(message.starts_with("test.toml:9:") && message.contains("`skin`"), "{message}");
    let turned = skin("pressures = [{ group = \"skin\", pressure = 1.0 }]").replace("[0, 1, 2]", "[0, 2, 1]");
    assert!(refused(&turned).contains("normals to opposite sides"), "{}", refused(&turned));

    let message = refused(&bar(-1.0, "integrator = \"static\""));
    assert!(message.starts_with("test.toml:9:") && message.contains("statics has no inertia"), "{message}");
    assert!(refused(&bar(-30000.0, "")).contains("faster than sound in steel"));
    let twice =
        bar(1.0, "").replace("velocities = [", "velocities = [{ nodes = [3], velocity = [0.5, 0.0, 0.0] }, ");
    assert!(refused(&twice).contains("has two velocities"), "{}", refused(&twice));
}

#[test]
fn what_someone_might_mean_is_warned_of() {
    let warned =
        |text: &str| FemSolver::new(&scene(text), &Options::default()).unwrap().model().warnings.join("\n");
    assert!(warned(&oscillator(MIDPOINT, 1e-3, "[[0.0, 0.0], [1.0, 0.0]]")).contains("it loads nothing"));
    assert!(warned(&oscillator(MIDPOINT, 1e-3, "[[0.0, 0.0], [5000.0, 1.0]]")).contains("100 ms is 0.1"));
    let held = bar(1.0, "").replace("velocity = [1.0, 0.0, 0.0]", "velocity = [0.0, 1.0, 0.0]");
    assert!(warned(&held).contains("they stay at rest"), "{}", warned(&held));
}

/// A cantilever of 10 m, E I = 1000 N m2, under a load that grows to `load` on its tip in 1 s.
fn cantilever(load: f64, fem: &str) -> String {
    let nodes: Vec<_> = (0..=20).map(|i| [0.5 * f64::from(i), 0.0, 0.0]).collect();
    let cells: Vec<_> = (0..20).map(|i| [i, i + 1]).collect();
    format!(
        r#"
end_time = 1.0
[structure]
nodes = {nodes:?}
supports = [{{ nodes = [0], rotations = "xyz" }}]
loads = [{{ nodes = [20], force = [0.0, 0.0, {load:?}], history = [[0.0, 0.0], [1.0, 1.0]] }}]
[[structure.parts]]
name = "post"
element = "beam"
cells = {cells:?}
young = 1e7
area = 1.0
inertia = [1e-4, 1e-4]
density = 1.0
[fem]
integrator = "static"
{fem}
[[gauge]]
name = "tip"
at = [10.0, 0.0, 0.0]
quantity = "displacement"
"#
    )
}

#[test]
fn load_steps_that_adapt_bend_a_cantilever_to_its_elastica_at_any_output_interval() {
    // Mattiasson (1981), Int. J. Numer. Meth. Eng. 17, 145: at P L^2 / E I = 10 the tip has gone 0.81061 L across and
    // 0.55500 L along.
    let tip = |window: f64| {
        let text = cantilever(100.0, "load_steps = { first = 0.01 }");
        let mut run = Run::alone(&text, window);
        let count = (1.0 / window).round() as usize;
        (0..count).for_each(|_| run.step(window, &[]));
        (run.value("tip_uz"), run.value("tip_ux"), run.count("sub_steps"))
    };
    let (once, often) = (tip(1.0), tip(0.05));
    for (across, along, _) in [once, often] {
        // 20 chords of the curve: some 1e-3 too short.
        assert!(off(across, 8.1061) < 3e-3 && off(along, -5.55) < 3e-3, "{across} {along}");
    }
    assert!((once.0 - often.0).abs() < 1e-7, "{once:?} {often:?}");
    assert!(once.2 < 90 && often.2 < 90, "{once:?} {often:?}");
}

#[test]
fn where_one_step_fails_load_steps_that_adapt_come_to_the_end() {
    let pressures = "pressures = [{ group = \"skin\", pressure = 3e4, history = [[0.0, 0.0], [1.0, 1.0]] }]";
    let text = |fem: &str| {
        let fem = format!("integrator = \"static\"\n{fem}");
        octant(6, "young = [1e8]\npoisson = 0.3", pressures, &fem)
    };
    let mut run = Run::with(&text(""), coupled_plan(1.0, Sampling::AtEnds, 1, 1));
    let fault = run.solve(1.0, &[]).expect_err("a slack balloon takes no such pressure at once");
    assert!(fault.message.contains("step 1 of 8"), "{}", fault.message);
    let growth = |window: f64| {
        let text = text("load_steps = { first = 0.1, shortest = 1e-6 }");
        let mut run = Run::with(&text, coupled_plan(window, Sampling::AtEnds, 1, 1));
        (0..(1.0 / window).round() as usize).for_each(|_| run.step(window, &[]));
        assert!(run.count("refused_steps") > 0);
        run.displacement(0)[0]
    };
    let (once, often) = (growth(1.0), growth(0.25));
    assert!(once > 0.08 && (once - often).abs() < 1e-7, "{once} {often}");
}

#[test]
fn load_steps_end_with_a_message_where_they_end() {
    // One iteration never does for what is not linear: every step fails, down to the shortest.
    let text =
        cantilever(100.0, "load_steps = { first = 0.01, shortest = 1e-3 }\n[fem.newton]\nmax_iterations = 1");
    let mut run = Run::alone(&text, 1.0);
    let fault = run.solve(1.0, &[]).expect_err("cannot be");
    for words in ["statics ends at t = 0", "after 1 iterations", "none below 1.000e-3 s", "fem.path_speed"] {
        assert!(fault.message.contains(words), "{}", fault.message);
    }
}

#[test]
fn load_steps_of_no_statics_are_refused() {
    let fem = "integrator = \"newmark\"\nload_steps = { first = 0.1 }";
    let message = refused(&cantilever(1.0, "").replace("integrator = \"static\"", fem));
    assert!(message.contains("are for static, not for newmark"), "{message}");
    assert!(refused(&cantilever(1.0, "load_steps = { first = 0.0 }")).contains("must lie above 0"));
    let message = refused(&cantilever(1.0, "load_steps = { first = 0.1, shortest = 0.2 }"));
    assert!(message.contains("longer than the first"), "{message}");
}
