//! The scenes that come with the project give the figures that stand in their first lines.

use tests::manual::holds;
use tests::{Bench, Ended, scene};

fn run(name: &str, sets: &[&str]) -> (Bench, Ended) {
    let bench = Bench::new();
    let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let ended = bench.done(&scene(name), "out", &words);
    (bench, ended)
}

fn close(what: &str, value: f64, expected: f64, relative: f64) {
    let error = value / expected - 1.0;
    assert!(error.abs() < relative, "{what}: {value} against {expected}, {:.3} % off", 100.0 * error);
}

const STRONG: [&str; 2] = ["coupling.scheme=strong", "coupling.time_window=2e-4"];

/// The rows of `walenstadt.md` for the comparison contact: spheres, deflection [m], 1 ms reaction [N].
const ROWS: [(u32, f64, f64); 3] =
    [(1, 0.55300, 32_110.0), (64, 0.49514, 33_830.0), (512, 0.48435, 33_760.0)];

/// The reference's digits hold under halving; deflection to 0.1 %, reaction to 1 %, as the issue asks.
#[test]
#[ignore = "long"]
fn the_drop_test_meets_the_independent_figures_weak_and_strong() {
    for (spheres, deflection, reaction) in ROWS {
        let count = spheres;
        let spheres = format!("rock.0.cluster.spheres={spheres}");
        let mut row = Vec::new();
        for scheme in [&[][..], &STRONG] {
            let mut sets = vec![spheres.as_str(), "end_time=0.78"];
            sets.extend(scheme);
            let (_bench, ended) = run("walenstadt-compare", &sets);
            close("max_deflection", ended.measure("max_deflection"), deflection, 1e-3);
            close("max_reaction_1ms", ended.measure("max_reaction_1ms"), reaction, 1e-2);
            // Free fall from rest to the first touch, which is where a sphere beside the wires reaches one: at 2.0 m at
            // the earliest, a radius (0.8 edges of the lattice) further down at the latest.
            let (speed, time) = (ended.measure("impact_speed"), ended.measure("time_of_impact"));
            assert!((speed - 9.81 * time).abs() < 1e-6, "{speed} m/s after {time} s");
            let further = speed * speed / (2.0 * 9.81) - 2.0;
            let radius = 0.8 * 0.41 / (f64::from(count).cbrt() + 0.6);
            assert!((-1e-4..radius).contains(&further), "{further} m below the net's lowest node");
            assert!((ended.measure("sag") - 0.05).abs() < 5e-5);
            // The converged scheme conserves: V-C2. 1e-3 is the bound for steps of 1e-5 s.
            let bound = if scheme.is_empty() { 1e-2 } else { 1e-3 };
            assert!(ended.measure("energy_error") < bound);
            row.push(["max_deflection", "max_reaction_1ms", "energy_error"].map(|name| ended.measure(name)));
        }
        let [weak, strong] = [row[0], row[1]];
        let values = [weak[0], strong[0], weak[1], strong[1], weak[2], strong[2]];
        holds(
            "docs/measured/drop-test.md",
            &format!("| {count} | {{}} | {{}} | {{}} / {{}} | {{}} / {{}} |"),
            &values,
        );
    }
}

/// By the law of the rock as a whole wires lie on the cube itself (docs/contact.md): its spheres change nothing, and it is stopped sooner than
/// under the paper's law, whose spheres are rounder the fewer they are.
#[test]
fn by_hertz_rock_the_drop_test_does_not_depend_on_the_spheres() {
    let found = [64, 512].map(|count| {
        let spheres = format!("rock.0.cluster.spheres={count}");
        let sets = [&[spheres.as_str(), "contact.0.law=hertz_rock", "end_time=0.78"], &STRONG[..]].concat();
        let (_bench, ended) = run("walenstadt-compare", &sets);
        assert!(ended.measure("energy_error") < 1e-4);
        ["max_deflection", "max_reaction_1ms"].map(|name| ended.measure(name))
    });
    let [[deflection, reaction], [other, also]] = found;
    close("max_deflection", other, deflection, 1e-7);
    // Found: 1.3e-6. The spheres still say how far a rock may reach, and so what is listed and solved when.
    close("max_reaction_1ms", also, reaction, 1e-5);
    close("max_deflection", deflection, 0.47042, 1e-4);
    assert!(deflection < ROWS[2].1, "{deflection}");
    for (row, values) in
        [("| 64 | 0.49514, 33 823", [deflection, reaction]), ("| 512 | 0.48433, 33 713", [other, also])]
    {
        holds("docs/measured/drop-test.md", &format!("{row} | {{}}, {{}} |"), &values);
    }
}

#[test]
fn the_second_experiment_meets_its_figures() {
    let sets = ["structure.cable.prestress=-1.35898e7", "rock.0.position=[0.0, 0.0, 2.105]", "end_time=0.78"];
    let (_bench, ended) = run("walenstadt-compare", &sets);
    close("max_deflection", ended.measure("max_deflection"), 0.45812, 1e-3);
    close("max_reaction_1ms", ended.measure("max_reaction_1ms"), 32_710.0, 1e-2);
    assert!((ended.measure("sag") - 0.1).abs() < 5e-5);
}

/// The imbalance is that of the solvers' own steps (order 2) once the coupling has converged.
#[test]
fn the_energy_error_falls_as_the_steps_are_halved() {
    let error = |step: &str| {
        let step = format!("dem.time_step={step}");
        let mut sets = vec![
            step.as_str(),
            "end_time=0.72",
            "coupling.tolerance=1e-8",
            "coupling.absolute_tolerance=1e-10",
        ];
        sets.extend(["coupling.scheme=strong", "coupling.time_window=1e-4"]);
        let (_bench, ended) = run("walenstadt-compare", &sets);
        ended.measure("energy_error")
    };
    let (coarse, fine) = (error("5e-5"), error("2.5e-5"));
    assert!(fine < coarse, "{fine:e} against {coarse:e}");
}

/// V-C6: the weak scheme carries 28 %, and is chaotic (-0.1542 to -0.1562 m): 2 % around the stored curve.
#[test]
fn the_cable_net_reproduces_the_stored_weak_run_and_its_excess_energy() {
    let (_bench, ended) = run("cable-net", &[]);
    close("centre_uz_min", ended.measure("centre_uz_min"), -0.155523, 2e-2);
    assert!(ended.measure("energy_error") > 1.0, "the scheme creates energy, and the balance shows it");
}

/// V-C6: strong at ten and twenty times the step is within 1 % of the converged answer.
#[test]
fn strong_coupling_converges_on_the_cable_net_with_long_windows() {
    for window in ["5e-4", "1e-3"] {
        let window = format!("coupling.time_window={window}");
        let sets = ["coupling.scheme=strong", window.as_str(), "dem.time_step=2e-5", "end_time=0.1"];
        let (_bench, ended) = run("cable-net", &sets);
        close("centre_uz_min", ended.measure("centre_uz_min"), -0.12166, 1e-2);
        assert_eq!(ended.summary()["coupling"]["windows_unconverged"], 0);
        // The same with the wire's inertia in the dashpot: another case, without that difficulty.
        let local: Vec<&str> = sets.iter().copied().chain(["contact.0.effective_mass=local"]).collect();
        let (_bench, ended) = run("cable-net", &local);
        close("centre_uz_min", ended.measure("centre_uz_min"), -0.1153, 1e-2);
        assert_eq!(ended.summary()["coupling"]["windows_halved"], 0);
    }
}

/// V-C3, first column: x down there, up here. Position Verlet on both sides, step 1e-5 s in a contact
/// of 1.9 ms: (dt/t_c)^2 pi^2 / 24 is 1e-5 of the overlap and of the speeds.
#[test]
fn a_sphere_on_a_plate_on_a_spring_moves_as_the_exact_solution() {
    let (_bench, ended) = run("sphere-on-plate-spring", &[]);
    let time = ended.column("time_s");
    let row = time.iter().position(|t| (t - 0.01).abs() < 1e-9).unwrap();
    let at = |column: &str, offset: f64| ended.column(column)[row] - offset;
    let start = 0.099019;
    close("sphere z", at("sphere_z_m", start), 0.00549203205, 2e-4);
    close("sphere v", at("sphere_vz_m_per_s", 0.0), 0.895549442, 1e-4);
    close("plate z", at("plate_uz_m", 0.0), -0.0169657067, 1e-4);
    let row = time.iter().position(|t| (t - 0.05).abs() < 1e-9).unwrap();
    let last = |column: &str| ended.column(column)[row];
    close("sphere z at 0.05 s", last("sphere_z_m") - start, 0.0334660097, 2e-4);
    close("plate z at 0.05 s", last("plate_uz_m"), 0.0211916386, 2e-4);
    assert!(ended.measure("energy_error") < 1e-4);
}

/// V-C5: dozens of small contacts; largest values to 1 %, not the history.
#[test]
fn a_sphere_on_a_cable_goes_as_deep_as_the_reference() {
    let (_bench, ended) = run("sphere-on-cable", &[]);
    close("node", ended.measure("centre_uz_min"), -0.1887047 + 0.000490494, 1e-2);
    let start = 0.019509505900295;
    let deepest = ended.column("sphere_z_m").into_iter().fold(f64::INFINITY, f64::min);
    // The sphere's own depth counts from the straight cable, as the node's.
    close("sphere", deepest - start - 0.000490494, -0.18565103, 1e-2);
}

#[test]
fn free_fall_is_one_process_that_falls_as_galileo_says() {
    let (_bench, ended) = run("free-fall", &[]);
    let (time, z) = (ended.column("time_s"), ended.column("rock_z_m"));
    let last = time.len() - 1;
    assert!((z[last] - (10.0 - 0.5 * 9.81)).abs() < 1e-12, "{}", z[last]);
    assert!(ended.summary()["cost"]["processes"]["coupler"].is_null());
    assert!(ended.summary()["cost"]["processes"]["fem"].is_null());
}
