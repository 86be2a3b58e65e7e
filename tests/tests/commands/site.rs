//! A barrier on a line of the terrain: heights made by the way, errors at the scene's own line, the same run again.

use std::path::Path;
use std::process::Command;
use tests::{Bench, program, scene};

/// The scene `slope-barrier`, its barrier on a line, paths from anywhere.
fn placed(bench: &Bench, line: &str) -> std::path::PathBuf {
    let file = scene("slope-barrier");
    let data = file.parent().expect("a directory").join("data");
    let text = std::fs::read_to_string(&file).expect("a scene");
    let text = text
        .replace("\"data/", &format!("\"{}/", data.display()))
        .replace("type = \"barrier\"", &format!("type = \"barrier\"\nline = {line}"));
    bench.scene(&text)
}

fn heights(file: &Path) -> (Vec<f64>, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(file).expect("a raster");
    let header =
        text.lines().take(5).map(|l| l.split(' ').nth(1).expect("a value").parse().expect("a number"));
    let header: Vec<f64> = header.collect();
    let row = |l: &str| l.split(' ').map(|z| z.parse().expect("a height")).collect();
    (header, text.lines().skip(6).map(row).collect())
}

#[test]
fn heights_are_made_of_the_terrain_and_the_resolved_scene_runs_again_as_it_is() {
    let bench = Bench::new();
    let file = placed(&bench, "[[-15.0, 0.5], [15.0, 0.5]]");
    let short = ["--set", "end_time=0.02"];
    let first = bench.done(&file, "out", &short);
    // The plane falls by 0.84 along y, and is 0.3 m below 0 at y = 0.
    let (header, rows) = heights(&first.out.join("ground.asc"));
    let [columns, count, west, south, cell] = header[..] else { panic!("{header:?}") };
    assert_eq!((rows.len() as f64, rows[0].len() as f64), (count, columns));
    for (j, row) in rows.iter().enumerate() {
        let y = south + cell * (count - 1.0 - j as f64);
        assert!(row.iter().all(|z| (z - (-0.84 * y - 0.3)).abs() < 1e-9), "y = {y}: {row:?}");
    }
    // Anchors 6 m above the line and 5 m beside it lie within.
    assert!(west <= -20.0 && west + cell * (columns - 1.0) >= 20.0 && south <= -5.5);
    let resolved = std::fs::read_to_string(first.out.join("scene.toml")).expect("a scene");
    let named = format!("ground = \"{}\"", first.out.join("ground.asc").display());
    assert!(resolved.contains(&named), "{resolved}");
    let again = bench.done(&first.out.join("scene.toml"), "again", &[]);
    let rows = |out: &Path| std::fs::read(out.join("history.csv")).expect("rows");
    assert!(rows(&first.out) == rows(&again.out), "the resolved scene gives other rows");
    assert!(!again.out.join("ground.asc").exists(), "a raster that the scene names is made again");
    let run = first.out.join("run.json");
    let record = std::fs::read_to_string(run).expect("a record");
    assert!(record.contains("out/ground.asc"), "its hash is on record: {record}");
}

#[test]
fn a_line_beside_the_terrain_is_refused_at_its_place_in_the_scene() {
    for (line, what) in [
        ("[[-15.0, 0.5], [45.0, 0.5]]", "the point x = 45, y = 0.5 m lies beside the terrain"),
        ("[[2.0, 0.5], [32.0, 0.5]]", "an anchor at the side stands at x = 34.50"),
        ("[[-15.0, 0.5]]", "1 points: a line has two at least"),
    ] {
        let bench = Bench::new();
        let file = placed(&bench, line);
        let text = std::fs::read_to_string(&file).expect("a scene");
        let row = text.lines().position(|l| l.starts_with("line = ")).expect("a line") + 1;
        for command in ["run", "check"] {
            let output = Command::new(program("rockfall"))
                .arg(command)
                .arg(&file)
                .current_dir(bench.path(""))
                .output()
                .expect("started");
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{said}");
            assert!(said.contains(&format!("scene.toml:{row}:8: {what}")), "{command}: {said}");
            assert!(!bench.path("out").exists(), "nothing is left of a refused run");
        }
    }
}

/// Hinged posts are held by upslope ropes alone: they must lean down the slope, or they fall up it.
#[test]
fn posts_that_fall_over_are_reported_before_the_start() {
    let bench = Bench::new();
    let file = placed(&bench, "[[-15.0, 0.5], [15.0, 0.5]]");
    for (lean, falls) in [("2.0", false), ("0.3", true)] {
        let output = Command::new(program("rockfall"))
            .args(["check", "--set", &format!("structure.generator.lean={lean}")])
            .arg(&file)
            .output()
            .expect("started");
        let text =
            String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}");
        assert_eq!(
            text.contains("degrees in form finding: it has fallen over"),
            falls,
            "lean {lean}: {text}"
        );
    }
}

#[test]
fn the_raster_can_be_made_by_hand() {
    let bench = Bench::new();
    let file = placed(&bench, "[[-15.0, 0.5], [15.0, 0.5]]");
    let out = bench.path("g.asc");
    let made = Command::new(program("dem-solver"))
        .args(["ground", "--line=-15,0.5,15,0.5", "--margin", "6.5", "--cell", "0.25", "-o"])
        .arg(&out)
        .arg(&file)
        .output()
        .expect("started");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let short = ["--set", "end_time=0.02"];
    let own = bench.done(&file, "own", &short);
    let (by_hand, by_itself) = (std::fs::read(&out), std::fs::read(own.out.join("ground.asc")));
    assert!(by_hand.expect("read") == by_itself.expect("read"));
    let ground = format!("structure.generator.ground=\"{}\"", out.display());
    let named = bench.done(&file, "named", &[&short[..], &["--set", &ground]].concat());
    let rows = |out: &Path| std::fs::read(out.join("history.csv")).expect("rows");
    assert!(rows(&own.out) == rows(&named.out));
}

/// A rock rolls and bounces for 20.1 s before it comes to the net: a window for each flight or stretch of 50 ms of it, in which the
/// structure does nothing, and usual windows of 0.2 ms for the last hundredths of a second alone.
#[test]
#[ignore = "long"]
fn a_fall_of_many_seconds_takes_few_windows_and_none_of_the_structure() {
    let bench = Bench::new();
    let ended = bench.done(&scene("site"), "out", &["--set", "end_time=15.05"]);
    let summary = ended.summary();
    let count = |table: &str, name: &str| summary[table][name].as_u64().expect("counted");
    let (windows, skipped) = (count("coupling", "windows"), count("cost", "skipped_windows"));
    println!("{windows} windows, {skipped} skipped");
    // 301 rows, and at 28 m/s a window of at most a radius for each 20 ms: 75 000 windows if all were usual ones.
    assert!(windows < 1500 && skipped == windows, "{windows} windows, {skipped} skipped");
    assert_eq!(ended.rows(), 301);
}
