//! The structures of all shipped scenes and kits through every format that is written: what is read again is written to the same
//! file, is the same mesh, and answers to the same bytes.

use crate::common::{Run, coupled_plan, random};
use fem_solver::FemSolver;
use fem_solver::export::deck::Deck;
use interface_defs::Sampling;
use interface_defs::mesh::{Group, InterfaceMesh};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use toml::{Table, Value};
use toolkit::program::Options;
use toolkit::scene::Scene;

/// Every scene or kit with a structure; of one that stands on terrain, which raster of heights it takes, for which key.
const SCENES: [(&str, Option<(&str, &str)>); 15] = [
    ("scenes/barrier-cables.toml", None),
    ("scenes/barrier-impact.toml", None),
    ("scenes/barrier-sel.toml", None),
    ("scenes/barrier.toml", None),
    ("scenes/cable-net.toml", None),
    ("scenes/drape.toml", Some(("structure.ground.file", "steep.asc"))),
    ("scenes/site.toml", Some(("structure.generator.ground", "site.asc"))),
    ("scenes/slope-barrier.toml", None),
    ("scenes/sphere-on-cable.toml", None),
    ("scenes/sphere-on-plate-spring.toml", None),
    ("scenes/walenstadt-compare.toml", None),
    ("scenes/walenstadt-exp1.toml", None),
    ("scenes/walenstadt-exp2.toml", None),
    ("kits/example-100.toml", None),
    ("kits/example-1000.toml", None),
];

fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch")
}

/// What the adapter writes of `deck` in a format, and what it says that the format cannot hold.
fn write(deck: &Deck, format: &str) -> (String, Vec<String>) {
    let mut python = Command::new("python3")
        .arg(shipped().join("adapters/export/writers.py"))
        .arg(format)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("python3");
    let document = serde_json::to_vec(deck).expect("a document");
    python.stdin.take().expect("piped").write_all(&document).expect("read");
    let ended = python.wait_with_output().expect("ended");
    let [text, said] = [ended.stdout, ended.stderr].map(|bytes| String::from_utf8(bytes).expect("text"));
    assert!(ended.status.success(), "{said}");
    (text, said.lines().map(str::to_owned).collect())
}

/// A scene of the table; a kit as a scene names it.
fn shipped_scene(name: &str, ground: Option<(&str, &str)>) -> Scene {
    let path = shipped().join(name);
    if name.starts_with("kits") {
        let text = format!("end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[structure]\nkit = {:?}\n", path);
        return Scene::from_text("kit.toml", &text).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    let set = ground.map(|(key, file)| format!("{key}={:?}", shipped().join("scenes/data").join(file)));
    Scene::load(&path, &Vec::from_iter(set)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The scene with its structure from `mesh`: what counts nodes names the sets that the file has for it.
fn on_mesh(scene: &Scene, mesh: &Path, held: Option<&str>) -> Table {
    let mut document = scene.document().expect("it was read");
    let structure = document["structure"].as_table_mut().expect("a table");
    for key in ["kit", "generator", "place", "nodes", "cables", "groups"] {
        structure.remove(key);
    }
    for part in structure.get_mut("parts").and_then(Value::as_array_mut).into_iter().flatten() {
        part.as_table_mut().expect("a table").remove("cells");
    }
    for name in ["supports", "springs", "dampers", "masses", "loads", "velocities"] {
        let entries = structure.get_mut(name).and_then(Value::as_array_mut);
        for (i, entry) in entries.into_iter().flatten().enumerate() {
            let entry = entry.as_table_mut().expect("a table");
            if entry.remove("nodes").is_some() {
                entry.insert("group".into(), format!("{name}_{i}").into());
            }
        }
    }
    if let Some(held) = held {
        let supports = structure.entry("supports").or_insert_with(|| Value::Array(Vec::new()));
        let entry = Table::from_iter([("group".to_owned(), Value::from(held))]);
        supports.as_array_mut().expect("a list").insert(0, entry.into());
    }
    structure.insert("mesh".into(), mesh.display().to_string().into());
    structure.insert("renumber".into(), false.into());
    document
}

/// The mesh that a structure offers, its groups apart.
fn mesh(scene: &Scene) -> (InterfaceMesh, Vec<Group>) {
    let solver = FemSolver::new(scene, &Options::default()).unwrap_or_else(|e| panic!("{e}"));
    let mut mesh = solver.model().interface_mesh(&vec![0.0; solver.model().dof_count()]);
    let groups = std::mem::take(&mut mesh.groups);
    (mesh, groups)
}

/// Every byte of the start and of some windows under the same forces.
fn answer(scene: &Scene) -> Vec<u64> {
    let solver =
        FemSolver::new(scene, &Options { out: None, shortcuts: true }).unwrap_or_else(|e| panic!("{e}"));
    let window = 1e-3;
    let mut run = Run::of(solver, coupled_plan(window, Sampling::Means, 1, 1));
    let mut bits: Vec<u64> =
        run.ready.mesh.coordinates.iter().chain(&run.output).map(|x| x.to_bits()).collect();
    let mut random = random(7);
    let force: Vec<f64> = (0..run.force_len).map(|_| 5.0 * random()).collect();
    for _ in 0..3 {
        run.step(window, &force);
        bits.extend(run.output.iter().map(|x| x.to_bits()));
    }
    bits
}

#[test]
#[ignore = "long"]
fn each_shipped_structure_comes_back_from_every_format_and_answers_to_the_same_bytes() {
    come_back(&SCENES);
}

#[test]
fn a_shipped_structure_comes_back_from_every_format_and_answers_to_the_same_bytes() {
    come_back(&SCENES[..1]);
}

fn come_back(scenes: &[(&str, Option<(&str, &str)>)]) {
    let (dir, mut faults) = (tempfile::tempdir().expect("a directory"), Vec::new());
    for (name, ground) in scenes.iter().copied() {
        let scene = shipped_scene(name, ground);
        let deck = Deck::of(&scene, false).unwrap_or_else(|e| panic!("{name}: {e}"));
        let entries = scene.document().expect("read")["structure"]
            .get("supports")
            .and_then(Value::as_array)
            .map_or(0, Vec::len);
        let held = (deck.supports.len() > entries).then(|| deck.supports[0].set.clone());
        let (of_scene, groups) = mesh(&scene);
        let answered = answer(&scene);
        for extension in ["inp", "mdpa", "msh"] {
            let path = dir.path().join(format!("net.{extension}"));
            let (text, _) = write(&deck, extension);
            std::fs::write(&path, &text).expect("written");
            let again = Scene::from_text("again.toml", &on_mesh(&scene, &path, held.as_deref()).to_string());
            let again = again.unwrap_or_else(|e| panic!("{name}, {extension}: {e}"));
            let second = Deck::of(&again, false).unwrap_or_else(|e| panic!("{name}, {extension}: {e}"));
            let (second, _) = write(&second, extension);
            let mut same = |same: bool, what: &str| {
                if !same {
                    faults.push(format!("{name}, {extension}: {what}"));
                }
            };
            let differs = text.lines().zip(second.lines()).find(|(a, b)| a != b);
            same(text == second, &format!("written again it differs: {differs:?}"));
            let (of_file, read) = mesh(&again);
            same(of_scene.coordinates == of_file.coordinates, "other nodes");
            same(of_scene == of_file, "another mesh");
            for group in &groups {
                same(read.contains(group), &format!("the group `{}` is another", group.name));
            }
            same(answer(&again) == answered, "an answer of other bytes");
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// What the formats say of a structure with everything in it that they cannot hold.
#[test]
fn what_a_format_cannot_hold_is_named_by_part() {
    let scene = shipped_scene("scenes/barrier-impact.toml", None);
    let deck = Deck::of(&scene, false).expect("written");
    for (format, own) in
        [("inp", "`posts`: its torsion"), ("mdpa", "`posts`: that it yields"), ("msh", "prestress")]
    {
        let (text, lost) = write(&deck, format);
        for what in [
            "`net`: the law and the mass of its",
            "`top_rope`: that it slides",
            "`rope_brakes`: that it gives way",
            own,
        ] {
            let said = deck.left_out.iter().chain(&lost).any(|lost| lost.contains(what));
            assert!(said, "{format}: {what} is not in {lost:?}");
            assert!(
                text.lines().take(40).any(|line| line.contains(what)),
                "{format}: {what} is not at the head"
            );
        }
    }
}

#[test]
fn at_rest_nodes_are_where_form_finding_leaves_them() {
    let text = "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[structure]\n\
        generator = { type = \"rectangular_net\", cells = [4, 4], spacing = 1.0 }\n\
        cable = { young = 1e9, area = 1e-4, density = 7850.0, prestress = 1e7 }\n";
    let scene = Scene::from_text("net.toml", text).expect("valid");
    let lowest = |at_rest| {
        let deck = Deck::of(&scene, at_rest).expect("written");
        deck.nodes.iter().map(|node| node.at[2]).fold(f64::INFINITY, f64::min)
    };
    let report = fem_solver::solver::check::check(&scene, None).expect("valid");
    assert_eq!((lowest(false), -lowest(true)), (0.0, report.numbers["sag_m"]));
    assert!(report.numbers["sag_m"] > 1e-3);
}
