//! `rockfall new`: what it writes runs as it is, and it overwrites nothing.

use std::process::{Command, Output};
use tests::{Bench, program, repository};

fn rockfall(bench: &Bench, words: &[&str]) -> Output {
    Command::new(program("rockfall")).args(words).current_dir(bench.path("")).output().expect("started")
}

fn done(bench: &Bench, words: &[&str]) -> String {
    let output = rockfall(bench, words);
    assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A layer with one feature in the coordinates of `launch/scenes/data/site.asc`.
fn layer(bench: &Bench, name: &str, kind: &str, coordinates: &str) {
    let text = format!(
        r#"{{"type":"Feature","properties":{{}},"geometry":{{"type":"{kind}","coordinates":{coordinates}}}}}"#
    );
    std::fs::write(bench.path(name), text).expect("written");
}

#[test]
fn a_site_runs_from_terrain_release_and_line_to_the_worst_rock_against_a_barrier() {
    let bench = Bench::new();
    let terrain = repository().join("launch/scenes/data/site.asc").display().to_string();
    layer(
        &bench,
        "cliff.geojson",
        "Polygon",
        "[[[2600005,1200045],[2600015,1200045],[2600015,1200055],[2600005,1200055],[2600005,1200045]]]",
    );
    layer(
        &bench,
        "meadow.geojson",
        "Polygon",
        "[[[2600200,1200000],[2600250,1200000],[2600250,1200080],[2600200,1200080],[2600200,1200000]]]",
    );
    layer(&bench, "line.geojson", "LineString", "[[2600120,1200065],[2600120,1200035]]");
    let site = ["new", "site", "--terrain", &terrain, "--release", "cliff.geojson", "--line", "line.geojson"];
    let more = ["--zone", "meadow=meadow.geojson", "--spheres", "20", "--count", "4", "--volume", "0.1"];
    let words: Vec<&str> = site.into_iter().chain(more).collect();
    let said = done(&bench, &words);
    let next: Vec<Vec<&str>> = (said.lines().filter_map(|line| line.strip_prefix("  rockfall ")))
        .map(|line| line.split(' ').collect())
        .collect();
    assert_eq!(next.len(), 3, "{said}");
    done(&bench, &["check", "site/fall.toml"]);
    // Few rocks are unreliable as a sample, which is another exit code.
    let study = rockfall(&bench, &next[1]);
    assert!(matches!(study.status.code(), Some(0 | 3)), "{}", String::from_utf8_lossy(&study.stderr));
    let members = std::fs::read_to_string(bench.path("out/study/members.csv")).expect("the table");
    assert_eq!(members.lines().count(), 5, "{members}");
    let barrier = [&next[2][..4], &["--scene-of", "1", "-o", "site/m1.toml"]].concat();
    done(&bench, &barrier);
    let checked = done(&bench, &["check", "site/m1.toml"]);
    assert!(checked.contains("3 processes"), "{checked}");
    // Nothing is overwritten, and nothing is half written.
    let again = rockfall(&bench, &words);
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("fall.toml is there already"));
    std::fs::create_dir(bench.path("half")).expect("made");
    std::fs::write(bench.path("half/kit.toml"), "mine").expect("written");
    let half: Vec<&str> = words.iter().map(|word| if *word == "site" { "half" } else { word }).collect();
    assert_eq!(rockfall(&bench, &half).status.code(), Some(2));
    assert!(!bench.path("half/fall.toml").exists());
}

#[test]
fn a_drop_test_a_net_and_a_solver_are_checked_as_they_are() {
    let bench = Bench::new();
    done(&bench, &["new", "a", "--drop-test"]);
    done(&bench, &["check", "a/drop-test.toml"]);
    let mesh = repository().join("launch/scenes/data/net-5x5.msh").display().to_string();
    done(&bench, &["new", "b", "--net", &mesh]);
    let mistaken = rockfall(&bench, &["check", "b/scene.toml"]);
    let said = String::from_utf8_lossy(&mistaken.stderr);
    assert!(said.contains("no group `boundary`") && said.contains("`frame`"), "{said}");
    done(&bench, &["check", "b/scene.toml", "--set", "structure.supports.0.group=frame"]);
    for language in ["c", "cpp", "fortran", "python", "rust"] {
        done(&bench, &["new", language, "--solver", language]);
        assert!(
            bench.path(language).join("Makefile").exists() && bench.path(language).join("README.md").exists()
        );
    }
    assert!(bench.path("a/.gitignore").exists());
}

#[test]
fn what_a_site_lacks_is_named() {
    let bench = Bench::new();
    let refused = |words: &[&str], what: &str| {
        let output = rockfall(&bench, &[&["new", "site"], words].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(what), "{words:?}: {said}");
        assert!(!bench.path("site").exists());
    };
    let terrain = repository().join("launch/scenes/data/site.asc").display().to_string();
    layer(&bench, "far.geojson", "Polygon", "[[[0,0],[1,0],[1,1],[0,0]]]");
    layer(&bench, "line.geojson", "LineString", "[[2600120,1200065],[2600120,1200035]]");
    refused(&[], "--terrain FILE and --release POLYGON");
    refused(&["--terrain", "no.tif", "--release", "far.geojson"], "no.tif: there is no such file");
    refused(&["--terrain", &terrain, "--release", "line.geojson"], "--release");
    refused(&["--terrain", &terrain, "--release", "far.geojson"], "--release, its middle");
    refused(&["--terrain", &terrain, "--release", "far.geojson", "--ground", "sand"], "scree");
    refused(&["--terrain", &terrain, "--release", "far.geojson", "--zone", "sand=x"], "no ground `sand`");
    refused(&["--terrain", &terrain, "--release", "far.geojson", "--volume=-1"], "--volume");
    refused(&["--drop-test", "--terrain", &terrain], "cannot be used with");
}
