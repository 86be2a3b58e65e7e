//! What no one can mean is refused before anything starts; what someone might mean is said, before or with the results.

use super::*;
use dem_solver::study::gate;
use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::STUDY as KIND;
use toolkit::scene::Scene;

/// What is wrong with a study is said before anything starts, at its place.
#[test]
fn what_is_wrong_with_a_study_is_said_at_its_place() {
    let cases: &[(&str, &str, &str, &str)] = &[
        ("seed = 3\n", "sede = 3\n", ":2:1", "unknown key `sede` at the top of the study"),
        ("\"fall.toml\"", "\"fal.toml\"", "fal.toml", "there is no such file"),
        ("scene = \"fall.toml\"\n", "", "study.toml", "the key `scene` is missing"),
        ("count = 14", "count = 0", ":6:9", "one member at least"),
        ("count = 14\n", "", ":3:1", "the key `count` is missing"),
        ("[2600010.0, 1200030.0]", "[2600010.0, 1210030.0]", ":5:60", "lies beside the terrain"),
        (
            "[[2600005.0, 1200010.0], [2600015.0, 1200012.0], ",
            "[[2600005.0, 1200010.0], ",
            ":5:11",
            "an area of three corners",
        ),
        (
            "[2600015.0, 1200012.0], [2600010.0, 1200030.0]",
            "[2600015.0, 1200012.0], [2600015.0, 1200010.0], [2600010.0, 1200030.0]",
            ":5:11",
            "the polygon crosses itself",
        ),
        (
            "points = [[2600020.5",
            "line = [[2600020.5, 1200020.25], [2600020.5, 1200021.0]]\npoints = [[2600020.5",
            ":7:1",
            "exactly one of points, line and polygon",
        ),
        ("height = 2.0", "height = -2.0", ":9:10", "0 (on the ground) or more"),
        ("orientation = \"uniform\"", "orientation = \"any\"", ":12:15", "is `uniform`"),
        (
            "speed = { uniform = [0.5, 4.0] }",
            "speed = { uniform = [4.0, 0.5] }",
            ":13:9",
            "the first must lie below",
        ),
        (
            "speed = { uniform = [0.5, 4.0] }",
            "speed = { normal = [1.0, 1.0] }",
            ":13:9",
            "values from -2 to 4",
        ),
        ("speed =", "sped =", ":13:8", "unknown quantity `sped`"),
        ("speed = { uniform = [0.5, 4.0] }", "speed = -2.0", ":13:9", "a value of -2: 0 or more is possible"),
        (
            "speed = { uniform = [0.5, 4.0] }",
            "speed = 3e5",
            ":13:9",
            "with speed = 300000: rock `block`: velocity = 300000 m/s",
        ),
        ("spin = 2.0", "mass = 100.0\nvolume = 1.0", ":14:8", "define one thing twice"),
        (
            "spin = 2.0",
            "density = 2.6",
            ":14:11",
            "with density = 2.6: rock `block`: density = 2.6 kg/m3 is very little",
        ),
        (
            "spin = 2.0",
            "density = { choice = [2600, 2.7e6, 2650] }",
            ":14:11",
            "with density = 2700000: rock `block`: density = 2700000 kg/m3 is very much",
        ),
        (
            "spin = 2.0",
            "density = { uniform = [50.0, 2700.0] }",
            ":14:11",
            "with density = 50: rock `block`: density = 50 kg/m3",
        ),
        (
            "spin = 2.0",
            "volume = { lognormal = [500.0, 6.0] }",
            ":14:10",
            "with volume = 108000: rock `block`: it is ",
        ),
        (
            "spin = 2.0",
            "shape = { choice = [{ type = \"sphere\", radius = 0.4 }, { type = \"sphere\", radius = 40.0 }] }",
            ":14:9",
            "it is 80 m x 80 m x 80 m large",
        ),
        (
            "contact.0.friction = { normal = [0.6, 0.05] }",
            "contact.0.young = { choice = [1e9, 30, 2e9] }",
            ":15:19",
            "with contact.0.young=30, dem.steps_per_contact=40: young = 30 Pa is the Young's modulus of no solid",
        ),
        (
            "cell = 2.0",
            "epsg = 99999",
            ":18:8",
            "epsg = 99999: the codes of coordinate systems go from 1024 to 32766",
        ),
        ("cell = 2.0", "epsg = 4326", ":18:8", "EPSG:4326 is in degrees"),
        ("contact.0.friction", "contact.0.fricton", ":15:21", "unknown key `fricton`"),
        ("contact.0.friction", "contact.3.friction", ":15:22", "is no item of `contact`"),
        (
            "contact.0.friction = { normal = [0.6, 0.05] }",
            "contact.0.law = \"hertz_mindlin\"",
            ":15:17",
            "is the same for all members",
        ),
        ("contact.0.friction", "output.interval", ":15:19", "cannot vary"),
        ("seed = 3\n", "seed = 3\nsampling = \"sobo\"\n", ":3:12", "unknown value `sobo`"),
        ("seed = 3\n", "seed = 3\nmost_failed = 2.0\n", ":3:15", "it is a share"),
        ("cell = 2.0", "cell = -2.0", ":18:8", "must lie above 0"),
        ("cell = 2.0", "cell = 1e-6", ":18:8", "on a terrain of 60 m x 40 m"),
        ("cell = 2.0", "cel = 2.0", ":18:1", "unknown key `cel`"),
        ("\"road\"", "\"a road\"", ":20:8", "cannot be the name of a file"),
        (
            "[[2600035.0, 1200005.0], [2600035.0, 1200035.0]]",
            "[[2600035.0, 1200005.0]]",
            ":21:10",
            "a line without length",
        ),
        (
            "[[2600035.0, 1200005.0], [2600035.0, 1200035.0]]",
            "[[35.0, 5.0], [35.0, 35.0]]",
            ":21:10",
            "lies beside the terrain",
        ),
    ];
    for (before, after, at, words) in cases {
        let study = STUDY.replace("most_failed = 0.2\n", "");
        assert!(study.contains(before), "{before}");
        let place = Place::new(&study.replacen(before, after, 1));
        let output = place.run("out", &[]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{after}: {said}");
        let headline = said.lines().find(|line| line.starts_with("error")).unwrap_or_default();
        assert!(headline.contains(at) && headline.contains(words), "{after}: {headline}");
        assert!(!place.path("out").exists(), "{after}");
    }
    let place = Place::new(STUDY);
    for (arguments, words) in [
        (["--members", "0..3"], "1..20"),
        (["--members", "5..21"], "1..20"),
        (["--members", "5"], "as in 1..100"),
    ] {
        let output = place.run("out", &arguments);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains(words), "{arguments:?}");
    }
}

/// What is to be doubted is said at its place in the study, before it starts.
#[test]
fn what_is_to_be_doubted_is_said_at_its_place() {
    let said = |place: &Place| {
        let file = Scene::load_as(&KIND, &place.path("study.toml"), &[]).expect("a study");
        let base = gate::read(&file, true, &[]).unwrap_or_else(|e| panic!("{e}"));
        let own =
            base.warnings.iter().filter(|w| w.place.as_ref().is_some_and(|p| p.file.ends_with("study.toml")));
        own.map(Diagnostic::to_string).collect::<Vec<_>>()
    };
    assert_eq!(said(&Place::new(STUDY)), Vec::<String>::new());
    let design = "[line.design.uni_11211_4]\nblock_mass = 6.0\ntrajectories = 1.1\ntopography = 1.02\nblock_survey = 1.05\n\
        weight = 1.0\nfree_border = 0.5\nlevel = \"SEL\"\n";
    let speed = "speed = { uniform = [0.5, 4.0] }";
    for (before, after, at, words) in [
        (
            "spin = 2.0",
            "volume = { choice = [0.5, 500.0] }",
            ":15:10",
            "with volume = 500: rock `block` has 1300000 kg in 500 m3; were it in litres, it would be 0.5 m3",
        ),
        ("spin = 2.0", "mass = { uniform = [0.3, 7.9] }", ":15:8", "were it in tonnes, it would be 7900 kg"),
        (
            "spin = 2.0",
            "density = { normal = [2650.0, 600.0] }",
            ":15:11",
            "with density = 4450: rock `block` has a density of 4450 kg/m3",
        ),
        ("spin = 2.0", "density = 165.0", ":15:11", "in lb/ft3, it would be 2643 kg/m3"),
        (
            "spin = 2.0",
            "spin = { uniform = [0.0, 90.0] }",
            ":15:8",
            "with spin = 90: rock `block` spins with 90 rad/s",
        ),
        (speed, "speed = 70.0", ":14:9", "were it in km/h, it would be 19.44 m/s"),
        (
            speed,
            "speed = 2.0\nazimuth = { uniform = [1.2, 1.9] }",
            ":15:11",
            "it would be 68.75 to 108.9 degrees",
        ),
        (
            speed,
            "speed = 2.0\nazimuth = 1.57",
            ":15:11",
            "in degrees, 1.57 here; were it in radians, it would be 89.95 degrees",
        ),
        (
            speed,
            "speed = 2.0\ndip = { uniform = [-30.0, 10.0] }",
            ":15:7",
            "a dip of -30 to 10 degrees: it counts below the horizontal, so this throws rocks upward",
        ),
        (
            "contact.0.friction = { normal = [0.6, 0.05] }",
            "contact.0.friction = { uniform = [0.5, 35.0] }",
            ":16:22",
            "were it an angle in degrees",
        ),
        (
            "1200005.0], [2600035.0, 1200035.0",
            "1200005.0], [2600035.0, 1200055.0",
            ":22:10",
            "15 m of 50 m of the line `road` lie beyond the terrain",
        ),
        (
            "1200035.0]]\n",
            &format!("1200035.0]]\n{design}"),
            ":24:14",
            "block_mass: 6 kg is very little; were it in tonnes, it would be 6000 kg; the blocks that barriers",
        ),
    ] {
        assert!(STUDY.contains(before), "{before}");
        let said = said(&Place::new(&STUDY.replacen(before, after, 1)));
        assert!(said.len() == 1 && said[0].contains(at) && said[0].contains(words), "{after}: {said:?}");
    }
    for (more, none) in [
        ("azimuth = 0.0", true),
        ("azimuth = 3", true),
        ("azimuth = { uniform = [80.0, 100.0] }", true),
        ("dip = 0.5", false),
    ] {
        let place = Place::new(&STUDY.replace("spin = 2.0", &format!("spin = 2.0\n{more}")));
        assert_eq!(said(&place).is_empty(), none, "{more}");
    }
    let place = Place::new(&STUDY.replace("cell = 2.0", "epsg = 25832"));
    place.write("slope.prj", "PROJCS[\"CH1903+ / LV95\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"2056\"]]");
    let said = said(&place);
    assert!(
        said.len() == 1 && said[0].contains("epsg = 25832, and the terrain's file says EPSG:2056"),
        "{said:?}"
    );
}

/// A line with a design that nothing passes: what is not made is said. Rocks that lie where they were put are counted.
#[test]
fn what_a_study_cannot_say_is_said() {
    let design = "[line.design.onr_24810]\nenergy_quantile = 99.0\nheight_quantile = 90.0\nenergy_factor = 1.15\nheight_factor = 1.3\n";
    let place = flights();
    let text = FLIGHTS.replace("height = 20.0", "height = 0.0").replace("azimuth = 90.0", "azimuth = 270.0");
    let text = text.replace("{ choice = [10.0, 14.0], weights = [3, 1] }", "0.0");
    place.write("study.toml", &format!("{text}{design}"));
    place.table("out", &[]);
    let summary = std::fs::read_to_string(place.path("out/summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let said = summary["warnings"].to_string();
    for words in [
        "the barrier on the line `road` is not judged by its design: no rock passes it",
        "4 of 4 members came to rest where they started, nearer than their own size: 1, 2, 3, 4;",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!place.path("out/lines/road_design.csv").exists());
}

/// A spreadsheet computes what begins with `=`.
#[test]
fn a_name_that_a_spreadsheet_would_compute_is_a_text_in_the_table() {
    let place =
        Place::new(&STUDY.replace("\"cliff\"", "\"=cmd|' /C calc'!A0\"").replace("count = 14", "count = 2"));
    let table = place.table("out", &[]);
    assert!(table.contains("\n1,'=cmd|") && !table.contains(",=cmd"), "{table}");
}

/// A terminal that waits for a pipe, or reads a device without end, would not come back.
#[test]
fn a_pipe_or_a_device_as_an_input_file_is_refused() {
    let place = Place::new(STUDY);
    let file = place.path("slope.asc");
    for kind in ["pipe", "device"] {
        std::fs::remove_file(&file).expect("removed");
        if kind == "pipe" {
            assert!(Command::new("mkfifo").arg(&file).status().expect("started").success());
        } else {
            std::os::unix::fs::symlink("/dev/zero", &file).expect("a link");
        }
        let output = place.run("out", &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains("this is no file"), "{said}");
    }
}

/// What another build has begun is refused by its journal, and stays as it is.
#[test]
fn a_study_that_another_build_has_begun_is_refused() {
    let place = Place::new(&STUDY.replace("count = 14", "count = 2"));
    place.table("out", &[]);
    let path = place.path("out/chunks/main.journal");
    let mut journal = std::fs::read(&path).expect("a journal");
    let line = journal.iter().position(|byte| *byte == b'\n').expect("a first line");
    // Mark, layout, program.
    journal[line + 1 + 4 + 8] ^= 1;
    std::fs::write(&path, &journal).expect("written");
    let output = place.run("out", &["--resume"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && said.contains("another build"), "{said}");
    assert_eq!(std::fs::read(&path).expect("a journal"), journal);
}
