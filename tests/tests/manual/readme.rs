//! The scenes of `docs/own-rock.md`, `own-net.md` and `solvers.md`, as a reader copies them, on files of a reader's own.

use std::fmt::Write;
use std::path::Path;
use tests::manual::blocks_in;
use tests::{Bench, example, repository};

/// A boulder of eight faces in ASCII STL, 1.2 m x 0.9 m x 0.8 m.
fn boulder() -> String {
    let corners = [[0.6, 0.0, 0.0], [0.0, 0.45, 0.0], [0.0, 0.0, 0.4]];
    let mut text = "solid boulder\n".to_owned();
    for octant in 0..8_u32 {
        let sign = |axis: u32| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let mut face = corners.map(|c| [sign(0) * c[0], sign(1) * c[1], sign(2) * c[2]]);
        // Outward on every face.
        if sign(0) * sign(1) * sign(2) < 0.0 {
            face.swap(1, 2);
        }
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in face {
            let _ = writeln!(text, "vertex {x} {y} {z}");
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid boulder\n"
}

/// A slope in survey coordinates that falls to the east and flattens out.
fn valley() -> String {
    let (columns, rows) = (140, 120);
    let mut text = format!(
        "ncols {columns}\nnrows {rows}\nxllcorner 2683000\nyllcorner 1247000\ncellsize 1\nNODATA_value -9999\n"
    );
    for _ in 0..rows {
        for column in 0..columns {
            let x = column as f64 + 0.5;
            let _ = write!(text, "{:.3} ", 1200.0 - 40.0 * (1.0 - (-x / 40.0).exp()));
        }
        text.push('\n');
    }
    text
}

fn write(dir: &Path, name: &str, text: &str) {
    std::fs::write(dir.join(name), text).expect("written");
}

#[test]
#[ignore = "long"]
fn the_scenes_of_the_tutorial_run_on_files_of_ones_own() {
    let bench = Bench::new();
    let dir = bench.path("");
    let one = |page: &str| -> String { blocks_in(page, "toml").remove(0) };
    let (fall, net) = (one("docs/own-rock.md"), one("docs/own-net.md"));
    let mesh = repository().join("launch/scenes/data/net-5x5-v22.msh");
    let mesh = std::fs::read_to_string(mesh).expect("a mesh").replace("\"net\"", "\"wires\"");
    for (name, text) in [
        ("boulder.stl", boulder()),
        ("valley.asc", valley()),
        ("net.msh", mesh),
        ("fall.toml", fall.clone()),
        ("net.toml", net.clone()),
    ] {
        write(&dir, name, &text);
    }

    let ended = bench.done(&dir.join("fall.toml"), "fall", &[]);
    assert!(ended.out.join("trajectory.svg").exists());
    assert!(ended.measure("impacts") >= 1.0 && ended.measure("energy_error") < 0.01);

    let ended = bench.done(&dir.join("net.toml"), "net", &[]);
    assert!(ended.out.join("fields/structure.pvd").exists());
    assert!(ended.measure("sag") > 0.0);

    // The rock of the first scene over the net of the second, which is at z = 0.
    let from = |word: &str| fall.find(word).expect("the table");
    let rock =
        fall[from("[[rock]]")..from("[terrain]")].replace("2683010.0, 1247060.0, 1202.0", "2.1, 1.9, 1.0");
    write(&dir, "both.toml", &format!("{net}\n{rock}\n{}", &fall[from("[[contact]]")..]));
    let ended = bench.run(&dir.join("both.toml"), "both", &[]);
    // A heavy rock on thin wires: whether it is trusted to the end is the run's own judgement.
    assert!(matches!(ended.code, Some(0 | 3)), "{}", ended.stderr);
    assert!(ended.measure("impact_speed") > 1.0);
    assert!(ended.stdout.contains("of `wires` tore"), "{}", ended.stdout);
}

#[test]
fn the_scene_with_a_foreign_solver_runs() {
    let bench = Bench::new();
    let scene = blocks_in("docs/solvers.md", "toml").remove(0);
    let named = "\"target/release/examples/oscillator\"";
    assert!(scene.contains(named), "{scene}");
    let text = scene.replace(named, &format!("{:?}", example("oscillator")));
    let ended = bench.done(&bench.scene(&text), "out", &[]);
    // From 0.3 m above the mass it falls with sqrt(2 g h), and the soft spring throws it back.
    assert!((ended.measure("impact_speed") / (2.0 * 9.81 * 0.3_f64).sqrt() - 1.0).abs() < 1e-6);
    assert!(ended.measure("rebound_speed") > 0.5);
}
