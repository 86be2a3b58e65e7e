//! Mistakes on the command line itself.

use super::scenes::{self, NET};
use std::process::Command;
use tests::Bench;

/// Arguments, and words of the message. Beside them lie `scene.toml`, `one.toml`, the study `site.toml` of it, `boulder.stl`, `open.stl` and the file `results`.
const COMMANDS: &[(&[&str], &[&str])] = &[
    (&["check"], &["<SCENE>", "rockfall check"]),
    (&["scene.toml"], &["the command is missing", "rockfall run scene.toml"]),
    (&["chek", "scene.toml"], &["unrecognized subcommand", "'check'"]),
    (&["check", "."], &["this is a directory", "name the file in it"]),
    (&["check", "scene.toml", "scene.toml"], &["unexpected argument", "Usage"]),
    (&["run", "scene.toml", "other.toml"], &["unexpected argument 'other.toml'", "Usage"]),
    (&["check", "scne.toml"], &["there is no such file", "did you mean scene.toml"]),
    (&["run", "scene.toml", "--ot", "x"], &["unexpected argument '--ot'", "Usage"]),
    (&["run", "scene.toml", "--out"], &["a value is required for '--out <DIR>'"]),
    (&["run", "scene.toml", "--out", "results"], &["this is a file, and results need a directory"]),
    (&["run", "scene.toml", "--out", "scene.toml"], &["this is a file, and results need a directory"]),
    (&["run", "scene.toml", "--out", "held"], &["holds a run already", "--force"]),
    (&["check", "scene.toml", "--set", "end_time="], &["--set end_time=", "expected a number"]),
    (&["check", "scene.toml", "--set", "end_time=long"], &["--set end_time=long", "expected a number"]),
    (&["check", "scene.toml", "--set", "coupling=weak"], &["--set coupling=weak", "expected a table"]),
    (&["check", "scene.toml", "--set", "Coupling.scheme=weak"], &["unknown key `Coupling`", "`coupling`"]),
    (&["check", "scene.toml", "--set", "rock.3.mass=5"], &["`3` is no item of `rock`", "its number is 0"]),
    (&["ensemble", "study.toml", "--worst", "3"], &["--barrier <SCENE>", "Usage"]),
    (&["ensemble", "study.toml", "-o", "a.toml"], &["--scene-of <N>", "Usage"]),
    (&["ensemble", "study.toml", "--members", "1..2", "-o", "a.toml"], &["cannot be used with", "Usage"]),
    (&["ensemble", "scene.toml"], &["this is a scene, and a study is asked for here", "[[release]]"]),
    (&["check", "falls.toml"], &["falls.toml", "fall.toml"]),
    (
        &["ensemble", "falls.toml", "--barrier", "falls.toml"],
        &["this is a study, and the scene of a barrier is asked for here"],
    ),
    (&["ensemble", "study.toml", "--barrier", "none.toml"], &["none.toml", "there is no such file"]),
    (
        &["ensemble", "study.toml", "--barrier", "scene.toml"],
        &["does not stand on a line", "line = [[x, y], [x, y]]"],
    ),
    (&["cluster", "--spheres", "10", "-o", "a.xyzr"], &["<SHAPE>", "Usage"]),
    (&["cluster", "bolder.stl", "--spheres", "10", "-o", "a.xyzr"], &["no such file", "boulder.stl"]),
    (&["cluster", "open.stl", "--spheres", "10", "-o", "a.xyzr"], &["the surface is open", "--close-holes"]),
    (&["cluster", "boulder.stl", "--spheres", "0", "-o", "a.xyzr"], &["'0' for '--spheres <N>'"]),
    (&["check", "scene.toml", "--resolved", "held"], &["--resolved held", "not a regular file", "full.toml"]),
    (&["check", "scene.toml", "--resolved", "no/s.toml"], &["no/s.toml", "cannot be written"]),
    (
        &["run", "scene.toml", "--out", "/proc/rockfall"],
        &["/proc/rockfall", "no results can be written here"],
    ),
    (&["check", "scene.toml", "--set", "rock=3"], &["--set rock=3", "expected an array"]),
    (&["check", "scene.toml", "--set", "rock.0=3"], &["--set rock.0=3", "expected a table"]),
    (&["check", "scene.toml", "--set", "=3"], &["no path of keys", "write KEY=VALUE"]),
    (
        &["check", "site.toml", "--set", "release.0.count=many"],
        &["--set release.0.count=many", "whole number"],
    ),
    (&["check", "site.toml", "--set", "maps=3"], &["--set maps=3", "expected a table"]),
    (&["check", "scene.toml", "--format", "yaml"], &["'yaml' for '--format <FORM>'", "text, json"]),
    (&["run", "site.toml"], &["this is a study, not a scene", "rockfall ensemble site.toml"]),
    (&["trade", "site.toml"], &["this is a study, not a scene", "rockfall ensemble site.toml"]),
    (&["calibrate", "site.toml"], &["this is a study", "rockfall ensemble"]),
    (&["approve", "site.toml"], &["this is a study, not a kit", "rockfall ensemble site.toml"]),
    (&["approve", "scene.toml"], &["this is a scene, not a kit", "rockfall run scene.toml"]),
    (
        &["approve", "observed.toml"],
        &["this is a calibration, not a kit", "rockfall calibrate observed.toml"],
    ),
    (&["run", "observed.toml"], &["this is a calibration, not a scene", "rockfall calibrate observed.toml"]),
    (&["ensemble", "kit.toml"], &["this is a kit, and a study is asked for here", "rockfall approve"]),
    (&["calibrate", "kit.toml"], &["this is a kit, and a calibration is asked for here", "rockfall approve"]),
    (&["status", "results"], &["results: this is a file, and the directory of results is asked for here"]),
    (&["verify", "results"], &["results: this is a file, and the directory of results is asked for here"]),
    (&["run", "scene.toml", "--out", "."], &["the scene itself lies here", "name a directory of its own"]),
    (&["ensemble", "site.toml", "--barrier", "kit.toml", "--dry-run"], &["this is a kit, not a scene"]),
    (
        &["ensemble", "site.toml", "--members", "1..500"],
        &["--members: 1..500", "members of this study are 1..20"],
    ),
    (
        &["ensemble", "site.toml", "--members", "10..5"],
        &["--members: 10..5", "members of this study are 1..20"],
    ),
    (
        &["ensemble", "site.toml", "--scene-of", "500"],
        &["--scene-of: 500", "members of this study are 1..20"],
    ),
    (&["ensemble", "site.toml", "--threads", "0"], &["'0' for '--threads <N>'"]),
    (&["ensemble", "site.toml", "--until", "energy:0.1"], &["write a measure and a share of it"]),
    (&["export", "scene.toml"], &["--to <FILE>", "Usage"]),
    (&["export", "scene.toml", "--to", "a.xyz"], &["what kind of file to write", "known are .msh"]),
    (&["export", "one.toml", "--to", "a.inp"], &["no table [structure]", "write [structure]"]),
    (&["report", "none"], &["none: there is no summary.json"]),
    (&["status", "none"], &["none: there is no such directory"]),
    (&["verify", "none"], &["none: there is no such directory"]),
    (&["schema", "--kit", "--study"], &["cannot be used with", "Usage"]),
    (
        &["cluster", "boulder.stl", "--spheres", "10", "-o", "no/a.xyzr"],
        &["no file can be written", "no/a.xyzr"],
    ),
];

#[test]
fn a_command_line_that_no_one_can_mean_is_refused_and_changes_nothing() {
    let bench = Bench::new();
    bench.scene(NET);
    let write = |name: &str, text: String| std::fs::write(bench.path(name), text).expect("written");
    write("boulder.stl", scenes::boulder(1.0, 0));
    write("open.stl", scenes::boulder(1.0, 2));
    write("results", "mine\n".into());
    write("falls.toml", "scene = \"fall.toml\"\n[[release]]\npoints = [[0.0, 0.0]]\n".into());
    write("site.toml", scenes::STUDY.replace("fall.toml", "one.toml"));
    write("one.toml", scenes::SLOPE.into());
    write("kit.toml", scenes::KIT.into());
    write("observed.toml", "study = \"site.toml\"\n[[observed]]\nname = \"a\"\n".into());
    write("valley.asc", scenes::valley());
    std::fs::create_dir(bench.path("held")).expect("made");
    write("held/summary.json", "{}".into());
    let listed = || {
        let files = std::fs::read_dir(bench.path(""))
            .expect("listed")
            .chain(std::fs::read_dir(bench.path("held")).expect("listed"));
        let mut names: Vec<_> = files.map(|file| file.expect("a file").path()).collect();
        names.sort();
        names
    };
    let before = listed();
    for (arguments, words) in COMMANDS {
        let mut command = Command::new(tests::program("rockfall"));
        let output = command.args(*arguments).current_dir(bench.path("")).output().expect("started");
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {err}");
        assert_eq!(err.matches("error: ").count(), 1, "{arguments:?}: {err}");
        words.iter().for_each(|word| assert!(err.contains(word), "{arguments:?}: {word} is not in {err}"));
        assert_eq!(listed(), before, "{arguments:?}");
    }
    assert_eq!(std::fs::read_to_string(bench.path("results")).expect("there"), "mine\n");
}

#[test]
fn what_is_set_twice_is_named_and_the_last_one_counts() {
    let bench = Bench::new();
    bench.scene(NET);
    let arguments = ["check", "scene.toml", "--set", "end_time=0.7", "--set", "end_time=0.75"];
    let output = Command::new(tests::program("rockfall"))
        .args(arguments)
        .current_dir(bench.path(""))
        .output()
        .expect("started");
    let said =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("it is set twice: the last one counts, --set end_time=0.75"), "{said}");
}
