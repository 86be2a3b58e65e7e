//! Nothing wrong passes for done: exploded runs fail, doubtful ones are unreliable, and both say why.

use tests::{Bench, Ended, scene};
use toolkit::limits::Limits;
use toolkit::scene::Scene;

fn run(name: &str, sets: &[&str]) -> (Bench, Ended) {
    let bench = Bench::new();
    let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", *set]).collect();
    let ended = bench.run(&scene(name), "out", &words);
    (bench, ended)
}

fn text(value: &serde_json::Value) -> &str {
    value.as_str().expect("text")
}

/// Largest change of the sum of all energies of both solvers, from the rows [J].
fn imbalance(ended: &Ended) -> f64 {
    let sums = ["kinetic", "potential", "stored", "dissipated"]
        .iter()
        .flat_map(|kind| ["dem", "fem"].map(|side| ended.column(&format!("energy_{kind}_{side}_J"))))
        .reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect())
        .expect("energies");
    sums.iter().map(|sum| (sum - sums[0]).abs()).fold(0.0, f64::max)
}

#[test]
fn a_run_that_explodes_fails_at_once_keeps_its_rows_and_names_the_cause() {
    let (_bench, ended) = run("walenstadt-compare", &["coupling.time_window=2e-4"]);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    let summary = ended.summary();
    assert_eq!(summary["status"], "failed");
    let message = text(&summary["message"]);
    for word in
        ["diverged: at t = 0.6", "J at impact", "weak window of 2e-4 s", "coupling.time_window", "strong"]
    {
        assert!(message.contains(word), "{word} is not in: {message}");
    }
    assert!(ended.stderr.contains("error: the computation has diverged"), "{}", ended.stderr);
    // The rock touches at 0.6386 s: rows until then and a little longer, not to the end at 1.14 s.
    let time = ended.column("time_s");
    let last = time.last().expect("rows");
    assert!(*last > 0.6386 && *last < 0.75, "{last}");
    // Beyond ten times the bound, relative to the weight of 180 kg times 2 m.
    let relative = imbalance(&ended) / (180.0 * 9.81 * 2.0);
    assert!(relative > 1.0, "{relative}");
}

/// A contact on one large sphere is too stiff for weak windows of 1e-4 s: it makes a tenth of the energy at impact.
const DOUBTFUL: [&str; 3] = ["rock.0.cluster.spheres=1", "coupling.time_window=1e-4", "end_time=0.8"];

#[test]
fn a_run_beyond_a_bound_is_unreliable_with_exit_code_3_and_says_which_by_how_much_and_what_to_try() {
    let (_bench, ended) = run("walenstadt-compare", &DOUBTFUL);
    assert_eq!(ended.code, Some(3), "{}", ended.stderr);
    let summary = ended.summary();
    assert_eq!(summary["status"], "unreliable");
    let error = ended.measure("energy_error");
    assert!(error > 0.1 && error < 1.0, "{error}");
    // The same from the rows. The impact is one of the moments at which contact begins: not slower than after the fall of
    // 2 m, not faster than ever.
    let reference = summary["energy"]["reference_J"].as_f64().expect("a number");
    let (rock, net) = (ended.column("energy_kinetic_dem_J"), ended.column("energy_kinetic_fem_J"));
    let kinetic = rock.iter().zip(&net).map(|(rock, net)| rock + net).fold(0.0, f64::max);
    assert!(reference >= 180.0 * 9.81 * 2.0 && reference <= kinetic, "{reference} {kinetic}");
    let from_rows = imbalance(&ended) / reference;
    assert!((error / from_rows - 1.0).abs() < 1e-9, "{error} {from_rows}");
    assert!((summary["energy"]["energy_error"].as_f64().expect("a number") - error).abs() < 1e-15);
    let message = text(&summary["message"]);
    let percent = format!("energy_error is {:.1} %", 100.0 * error);
    for word in [&percent, "above limits.energy_error = 10 %", "arose between the solvers", "coupling.scheme"]
    {
        assert!(message.contains(word), "{word} is not in: {message}");
    }
    assert!(ended.stderr.contains("error: unreliable: "), "{}", ended.stderr);
    assert!(ended.stdout.contains("status") && ended.stdout.contains("unreliable"), "{}", ended.stdout);
    // It was computed to its end.
    assert!((ended.column("time_s").last().expect("rows") - 0.8).abs() < 1e-9);
}

#[test]
fn raised_bounds_let_the_same_run_be_done_and_stand_in_the_resolved_scene() {
    let raised = [
        "limits.energy_error=2.0",
        "limits.residual=50.0",
        "limits.weak_window=20.0",
        "limits.deflection_error=1.0",
    ];
    let sets = [&DOUBTFUL[..], &raised].concat();
    let (_bench, ended) = run("walenstadt-compare", &sets);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let resolved = Scene::load(&ended.out.join("scene.toml"), &[]).expect("a scene");
    let limits = Limits {
        energy_error: 2.0,
        residual: Some(50.0),
        weak_window: 20.0,
        deflection_error: Some(1.0),
        ..Limits::default()
    };
    assert_eq!(Limits::of(&resolved).expect("valid"), limits);
}

#[test]
fn bounds_that_no_run_can_keep_and_unknown_ones_are_refused_before_the_start() {
    for (set, says) in [
        ("limits.energy_error=0.0", "a bound of 0 would be passed by every run"),
        ("limits.energy=0.1", "unknown key `energy`"),
    ] {
        let (_bench, ended) = run("free-fall", &[set]);
        assert_eq!(ended.code, Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains(says) && ended.stderr.contains(set), "{}", ended.stderr);
        assert!(!ended.out.exists(), "nothing was started");
    }
}

#[test]
fn a_penetration_beyond_its_bound_is_unreliable() {
    let (_bench, within) = run("walenstadt-compare", &["end_time=0.8"]);
    assert_eq!(within.code, Some(0), "{}", within.stderr);
    let deepest = within.measure("max_penetration");
    let bound = format!("limits.penetration={}", 0.9 * deepest);
    let (_bench, beyond) = run("walenstadt-compare", &["end_time=0.8", &bound]);
    assert_eq!(beyond.code, Some(3), "{}", beyond.stderr);
    let summary = beyond.summary();
    let message = text(&summary["message"]);
    assert!(message.contains(&format!("max_penetration is {deepest:.3} radii")), "{message}");
    assert!(message.contains("raise contact.young"), "{message}");
    assert_eq!(beyond.history(), within.history(), "a bound judges and changes nothing");
}

/// A block of 1 000 kg that lies on a plane: with the overlap that carries its weight, so that nothing moves, or without.
fn block(overlap: f64) -> String {
    format!(
        "end_time = 0.5\ngravity = [0.0, 0.0, -9.81]\n[terrain]\nfile = \"flat.asc\"\n[[rock]]\n\
         position = [0.0, 0.0, {:?}]\nmass = 1000.0\nshape = {{ type = \"sphere\", radius = 0.5 }}\n[[contact]]\n\
         law = \"linear\"\nstiffness = 1e7\nrestitution = 0.5\n",
        0.5 - overlap
    )
}

#[test]
fn a_block_at_rest_has_a_small_energy_error_or_none_with_its_reason() {
    for overlap in [0.0, 1000.0 * 9.81 / 1e7] {
        let bench = Bench::new();
        let flat = "ncols 3\nnrows 3\nxllcorner -3\nyllcorner -3\ncellsize 2\n0 0 0\n0 0 0\n0 0 0\n";
        std::fs::write(bench.path("flat.asc"), flat).expect("written");
        let ended = bench.done(&bench.scene(&block(overlap)), "out", &[]);
        let summary = ended.summary();
        match summary["measures"]["energy_error"]["value"].as_f64() {
            Some(error) => assert!(error < 0.01, "{overlap}: {error}"),
            None => {
                let said = ended.warnings();
                assert!(
                    said.iter().any(|w| w.contains("energy_error is absent: nothing has moved")),
                    "{said:?}"
                );
            }
        }
    }
}

#[test]
fn the_screen_shows_ten_numbers_then_warnings_then_where_the_files_are() {
    let (_bench, ended) = run("walenstadt-compare", &["end_time=0.66", "dem.time_step=2e-5"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let verdict = ended.summary()["verdict"].as_array().expect("a list").len();
    let lines: Vec<&str> = ended.stdout.lines().collect();
    let is_warning = |line: &str| line.starts_with("warning: ");
    let status = lines.iter().position(|l| l.starts_with("status ")).expect("a status");
    assert_eq!(status, verdict, "{}", ended.stdout);
    let first_warning = lines.iter().position(|line| is_warning(line)).unwrap_or(lines.len() - 1);
    assert_eq!(first_warning - status - 1, 10, "{}", ended.stdout);
    assert!(lines[first_warning..lines.len() - 1].iter().all(|line| is_warning(line)), "{}", ended.stdout);
    let last = lines.last().expect("lines");
    assert!(last.starts_with("results") && last.contains(&ended.out.display().to_string()), "{last}");
    // Every number that is shown is that of the summary, to six digits.
    for line in &lines[status + 1..first_warning] {
        let mut words = line.split_whitespace();
        let (name, shown) = (words.next().expect("a name"), words.next().expect("a number"));
        let shown: f64 = shown.parse().expect("a number");
        assert!((shown - ended.measure(name)).abs() <= 1e-5 * shown.abs(), "{line}");
    }
}

/// A barrier's posts and ropes vibrate, hardly damped: starts that differ by rounding give reactions that differ by percents.
#[test]
#[ignore = "long"]
fn what_is_left_to_chance_in_a_barrier_is_within_what_each_run_says_of_itself() {
    let sets = ["end_time=0.9", "coupling.scheme=weak"];
    let runs = ["rock.0.mass=800.0", "rock.0.mass=800.0000008", "rock.0.mass=800.0008"]
        .map(|mass| run("slope-barrier", &[&sets[..], &[mass]].concat()));
    let known = |ended: &Ended, name: &str| {
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let measure = &ended.summary()["measures"][name];
        let number = |key: &str| measure[key].as_f64().expect("a number");
        (number("value"), number("uncertainty"), text(&measure["uncertainty_by"]).to_owned())
    };
    for name in ["max_reaction_1ms", "max_reaction_10ms", "max_cable_force", "max_travel"] {
        let of_runs: Vec<_> = runs.iter().map(|(_bench, ended)| known(ended, name)).collect();
        let mut values: Vec<f64> = of_runs.iter().map(|of| of.0).collect();
        values.sort_by(f64::total_cmp);
        for (value, off, _) in &of_runs {
            assert!((value - values[1]).abs() <= *off, "{name}: {of_runs:?}");
        }
        if name == "max_reaction_1ms" {
            assert!(of_runs.iter().all(|of| of.2 == "vibration"), "{of_runs:?}");
            // Else the test shows nothing.
            assert!(values[2] - values[0] > 1e-3 * values[1], "the runs do not differ: {values:?}");
        }
    }
}
