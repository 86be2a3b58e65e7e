//! `calibrate` on falls of the program itself, with parameters that are known.

use super::*;
use serde_json::Value;

const SETTLED: [&str; 2] = ["contact.0.restitution", "contact.0.rolling_friction"];

const FALL: &str = "end_time = 60.0\ngravity = [0.0, 0.0, -9.81]\n\
    [[rock]]\nposition = [5.0, 20.0, 1030.0]\ndensity = 2600.0\nshape = { type = \"sphere\", radius = 0.4 }\n\
    [terrain]\nfile = \"slope.asc\"\n\
    [[contact]]\nlaw = \"hertz_rock\"\nyoung = 1e8\npoisson = 0.25\nrestitution = 0.3\nfriction = 0.6\nrolling_friction = 0.3\n";

const FALLS: &str = "scene = \"fall.toml\"\nmost_failed = 0.2\nsampling = \"random\"\n\
    [[release]]\nname = \"cliff\"\npolygon = [[2.0, 10.0], [6.0, 10.0], [6.0, 30.0], [2.0, 30.0]]\nheight = 3.0\ncount = 16\n\
    [[line]]\nname = \"road\"\npoints = [[15.0, 0.0], [15.0, 40.0]]\n\
    [vary]\nspeed = { uniform = [0.5, 4.0] }\nazimuth = 90.0\n";

/// A slope with a level foot, and waves on both: 20 m down over 30 m, then 90 m.
fn slope() -> Place {
    let place = Place::new(FALLS);
    place.write("fall.toml", FALL);
    let height = |column: i32, row: i32| {
        let (x, y) = (f64::from(column), f64::from(row));
        1000.0 + (20.0 - x / 1.5).max(0.0) + 0.02 * (1.7 * x + 0.4 * y).sin() * (0.9 * y - 0.3 * x).cos()
    };
    let rows =
        (0..41).map(|row| (0..121).map(|column| format!("{:.3} ", height(column, row))).collect::<String>());
    let head = "ncols 121\nnrows 41\nxllcenter 0\nyllcenter 0\ncellsize 1\n".to_owned();
    place.write("slope.asc", &(head + &rows.map(|row| row + "\n").collect::<String>()));
    place
}

impl Place {
    /// A calibration that is computed to its end, as data.
    fn calibrate(&self, text: &str, arguments: &[&str]) -> Value {
        let output = self.calibrated(text, arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!([Some(0), Some(3)].contains(&output.status.code()), "{said}");
        serde_json::from_slice(&output.stdout).expect("JSON")
    }

    fn calibrated(&self, text: &str, arguments: &[&str]) -> Output {
        self.write("calibrate.toml", text);
        let mut command = Command::new(env!("CARGO_BIN_EXE_dem-solver"));
        command.arg("calibrate").arg(self.path("calibrate.toml")).arg("--out").arg(self.path("calibration"));
        command.args(["--format", "json"]).args(arguments).output().expect("started")
    }
}

/// Slopes with known parameters, ten or TRIALS: their falls, observed, give ranges that hold them. What these data do not depend on is not settled.
#[test]
#[ignore = "long"]
fn known_parameters_lie_within_their_ranges() {
    let trials = std::env::var("TRIALS").map_or(10, |n| n.parse().expect("a count"));
    let (held, settled) = within_ranges(trials, 100);
    let least = 9 * trials / 10 - trials / 20;
    assert!(held.iter().all(|count| *count >= least), "{held:?}");
    assert!(settled[0] >= least && settled[1] >= least - trials / 20 && settled[2] == 0, "{settled:?}");
}

#[test]
fn known_parameters_of_one_slope_lie_within_their_ranges() {
    assert_eq!(within_ranges(1, 60).0, [1; 3]);
}

/// In how many of so many trials with so many sets of parameters each known one was within its range, and in how many it was settled.
fn within_ranges(trials: i32, sets: u32) -> ([i32; 3], [i32; 3]) {
    let place = slope();
    let ranges = [(SETTLED[0], [0.05, 0.8]), (SETTLED[1], [0.2, 0.5]), ("terrain.rest_speed", [0.01, 0.02])];
    let parameters: String = ranges
        .iter()
        .map(|(key, [from, to])| format!("[[parameter]]\nkey = \"{key}\"\nfrom = {from}\nto = {to}\n"))
        .collect();
    let (mut held, mut settled) = ([0; 3], [0; 3]);
    for trial in 0..trials {
        // Anywhere in the ranges: fractions of two irrational numbers.
        let known: Vec<f64> = (ranges.iter().zip([0.754_877_67, 0.569_840_29, 0.618_034]))
            .map(|((_, [from, to]), step)| from + (to - from) * (0.3 + step * f64::from(trial)).fract())
            .collect();
        let values: String =
            ranges.iter().zip(&known).map(|((key, _), value)| format!("{key} = {value}\n")).collect();
        place.write("study.toml", &(FALLS.to_owned() + &values));
        place.table(&format!("trial {trial}"), &["--set", &format!("seed={}", 100 + trial)]);
        let rows = rows(&place.read(&format!("trial {trial}")));
        let stops: Vec<f64> = rows.iter().map(|row| number(row, "run_out_m")).collect();
        let crossings =
            std::fs::read_to_string(place.path(&format!("trial {trial}/lines/road.csv"))).expect("a table");
        let crossings = super::rows(&crossings);
        let heights: Vec<f64> = (crossings.iter().filter(|row| row["crossing"] == "1"))
            .map(|row| number(row, "passing_height_m"))
            .collect();
        place.write("study.toml", FALLS);
        let text = format!(
            "study = \"study.toml\"\nsets = {sets}\n{parameters}[[observed]]\nwhat = \"stop\"\nvalues = {stops:?}\n\
             [[observed]]\nwhat = \"jump_height\"\nline = \"road\"\nof = 16\nvalues = {heights:?}\n"
        );
        let found = place.calibrate(&text, if trial > 0 { &["--resume"] } else { &[] });
        for (k, known) in known.iter().enumerate() {
            let own = &found["parameters"][k];
            let [low, high] = ["low", "high"].map(|end| own[end].as_f64().expect("a number"));
            held[k] += i32::from((low..=high).contains(known));
            settled[k] += i32::from(own["verdict"] == "settled");
            println!(
                "{trial} {} {known:.3}: {low:.3} to {high:.3} {} {}",
                own["key"], own["verdict"], own["coverage"]
            );
        }
    }
    println!("held {held:?}, settled {settled:?}");
    (held, settled)
}

/// The same bytes on any number of threads; wrong input is refused before anything starts, where it stands.
#[test]
#[ignore = "long"]
fn a_calibration_is_repeated_to_the_byte_and_refuses_what_cannot_be() {
    let place = slope();
    let text = |key: &str, observed: &str| {
        format!(
            "study = \"study.toml\"\nsets = 60\n[[parameter]]\nkey = \"{key}\"\nfrom = 0.1\nto = 0.5\n[[observed]]\n{observed}\n"
        )
    };
    let stop = "what = \"stop\"\nvalues = [20.0, 25.0, 30.0, 34.0]\n[[observed]]\nwhat = \"speed\"\nuse = \"predict\"\nvalues = [8.0, 9.0, 9.5]";
    let good = text(SETTLED[1], stop);
    for (wrong, said) in [
        (text("contact.0.frction", stop), "calibrate.toml"),
        (text("contact.1.friction", stop), "contact.1.friction"),
        (text("speed", stop), "`speed` varies from fall to fall"),
        (
            text(SETTLED[1], "what = \"speed\"\nline = \"rod\"\nvalues = [1.0, 2.0, 3.0]"),
            "the study has no line `rod`, but: road",
        ),
        (text(SETTLED[1], "what = \"stop\"\nvalues = [1.0]"), "3 are the least"),
        (text(SETTLED[1], "what = \"stop\"\nfile = \"none.csv\"\ncolumn = \"x\""), "none.csv cannot be read"),
        (good.replace("sets = 60", "sets = 5"), "from 60 to 100000"),
        (good.replace("from = 0.1", "from = 0.6"), "the first must lie below the second"),
        (good.replace("what = \"stop\"", "what = \"stops\""), "stops"),
    ] {
        let output = place.calibrated(&wrong, &[]);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}: {error}");
        assert!(error.contains(said), "{said}: {error}");
        assert!(!place.path("calibration").exists(), "{said}");
    }
    let one = place.calibrate(&good, &["--threads", "1"]);
    assert_eq!(
        one["observed"][1]["verdict"].as_str().map(|it| it.ends_with("no power") || it == "rejected"),
        Some(true)
    );
    let bytes = || std::fs::read(place.path("calibration/calibration.json")).expect("results");
    let before = bytes();
    place.calibrate(&good, &["--force", "--threads", "2"]);
    assert!(bytes() == before);
    assert_eq!(place.calibrated(&good, &[]).status.code(), Some(2));
    let more = place.calibrated(&good.replace("sets = 60", "sets = 61"), &["--resume"]);
    let said = String::from_utf8_lossy(&more.stderr).into_owned();
    assert!(said.contains("holds another study: parameters, sets, seed"), "{said}");
    // Other observations of as many falls are compared with the same falls.
    let other = place.calibrate(&good.replace("34.0", "33.0"), &["--resume"]);
    assert_ne!(other["observed"][0]["numbers"], one["observed"][0]["numbers"]);
}
