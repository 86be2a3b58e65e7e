//! Documented limits from both sides: inside nothing is said, beyond a warning names the value and the range, and what cannot be is
//! refused. That answers are right inside stands in `extremes`, `borders`, `granular` and the terrain's tests.

use crate::bench::sphere;
use dem_solver::DemSolver;
use dem_solver::check::check;
use interface_defs::diagnostic::Diagnostic;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// A scene with one rock, `keys` in place of those that it has.
fn scene(keys: &[(&str, String)]) -> String {
    let mut text = "end_time = 1.0\n".to_owned()
        + &sphere(0.1, 2500.0, "position = [0.0, 0.0, 1.0]\nvelocity = [0.0, 0.0, -1.0]")
            .replace("density = 2500.0", "mass = 10.0")
        + "[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\nrestitution = 0.5\nfriction = 0.5\n";
    for (key, value) in keys {
        let line =
            text.lines().find(|l| l.starts_with(&format!("{key} ="))).unwrap_or_else(|| panic!("no {key}"));
        text = text.replace(&line.to_owned(), &format!("{key} = {value}"));
    }
    text
}

fn notices(text: &str) -> Result<Vec<Diagnostic>, String> {
    let scene = Scene::from_text("test.toml", text).expect("a scene");
    let solver = DemSolver::new(&scene, &Options::default()).map_err(|e| e.to_string())?;
    Ok(solver.notices().to_vec())
}

#[test]
fn within_the_documented_limits_nothing_is_said_and_beyond_each_of_them_a_warning_names_it() {
    let number = |v: f64| format!("{v:?}");
    let speed = |v: f64| format!("[0.0, 0.0, {v:?}]");
    type Write<'a> = &'a dyn Fn(f64) -> String;
    // Key, how it is written, values inside, values beyond.
    let cases: [(&str, Write, &[f64], &[f64]); 6] = [
        ("mass", &number, &[1e-3, 1.0, 1e6], &[0.9e-3, 1.1e6]),
        ("velocity", &speed, &[0.0, -1e-3, -100.0], &[-101.0, 1e3]),
        ("young", &number, &[1e5, 1e9, 1e12], &[0.9e5, 1.1e12]),
        ("restitution", &number, &[0.01, 0.5, 1.0], &[0.009]),
        ("friction", &number, &[0.0, 1.0, 10.0], &[10.1]),
        ("position", &speed, &[2.6e6, -1e7], &[1.1e7]),
    ];
    for (key, write, inside, beyond) in cases {
        for &value in inside {
            let said = notices(&scene(&[(key, write(value))])).unwrap_or_else(|e| panic!("{e}"));
            assert!(said.is_empty(), "{key} = {value}: {said:?}");
        }
        for &value in beyond {
            let text = scene(&[(key, write(value))]);
            let said = notices(&text).unwrap_or_else(|e| panic!("{e}"));
            let named = said.len() == 1 && said[0].message.contains(&format!("{:e}", value.abs()));
            assert!(named && said[0].message.contains("is tested"), "{key} = {value}: {said:?}");
            // Also before anything runs.
            let report = check(&Scene::from_text("test.toml", &text).expect("a scene")).expect("checked");
            assert!(report.warnings.contains(&said[0]), "{:?}", report.warnings);
        }
    }
}

#[test]
fn what_cannot_be_is_refused_with_the_value_and_its_place() {
    for (key, value, expected) in [
        ("mass", "0.0", "must lie above 0"),
        ("mass", "-1e-3", "must lie above 0"),
        ("young", "0.0", "must lie above 0"),
        ("restitution", "0.0", "above 0 up to 1"),
        ("restitution", "1.01", "above 0 up to 1"),
        ("friction", "-0.01", "0 or more"),
        ("mass", "nan", "finite"),
        ("velocity", "[0.0, inf, 0.0]", "finite"),
    ] {
        let refusal = Scene::from_text("test.toml", &scene(&[(key, value.into())]))
            .map_err(|e| e.to_string())
            .and_then(|s| DemSolver::new(&s, &Options::default()).map_err(|e| e.to_string()).map(|_| ()));
        let message = refusal.expect_err(&format!("{key} = {value} is not refused"));
        assert!(
            message.contains(expected) && message.starts_with("test.toml:"),
            "{key} = {value}: {message}"
        );
    }
}
