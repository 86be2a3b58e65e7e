//! Structures from mesh files: the coarse net of V-F5 d) through every format, names, refusals.

use crate::common::{Run, check, off, scene};
use fem_solver::FemSolver;
use std::path::Path;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// The files of the net of 4 x 4 cells.
const FILES: [&str; 4] = ["net-5x5.msh", "net-5x5-v22.msh", "net-5x5.inp", "net-5x5.mdpa"];

/// The shipped mesh files.
fn data() -> String {
    format!("{}/../launch/scenes/data", env!("CARGO_MANIFEST_DIR"))
}

/// V-F5 d): its structure by `base`, its frame and its free nodes by name.
fn net(base: &str, frame: &str, inner: &str) -> String {
    format!(
        r#"
end_time = 1.0
[structure]
{base}
cable = {{ young = 1e8, area = 1e-4, density = 1.0, prestress = 1e7 }}
supports = [{{ group = "{frame}" }}]
loads = [{{ group = "{inner}", force = [0.0, 0.0, -10.0] }}]
[fem]
integrator = "generalized_alpha"
[[gauge]]
name = "net"
group = "net"
quantity = "tension"
[[gauge]]
name = "frame"
group = "{frame}"
quantity = "force"
"#
    )
}

/// Every byte of the start and of 5 windows under the same force.
fn answer(text: &str) -> Vec<u64> {
    let mut run = Run::coupled(text, 1e-2, interface_defs::Sampling::Means);
    let mut bits: Vec<u64> = run.ready.mesh.coordinates.iter().map(|x| x.to_bits()).collect();
    let mut random = crate::common::random(7);
    let force: Vec<f64> = (0..run.force_len).map(|_| 5.0 * random()).collect();
    for _ in 0..5 {
        run.step(1e-2, &force);
        bits.extend(run.output.iter().map(|x| x.to_bits()));
    }
    bits
}

#[test]
fn the_coarse_net_takes_its_shape_through_every_format_and_answers_as_the_generated_one() {
    let generator =
        r#"generator = { type = "rectangular_net", cells = [4, 4], spacing = 1.0, held = "none" }"#;
    let generated = answer(&net(generator, "edges", "interior"));
    for file in FILES {
        let text = net(&format!("mesh = \"{}/{file}\"", data()), "frame", "inner");
        let run = Run::alone(&text, 1e-2);
        let z = |i: usize, j: usize| run.ready.mesh.coordinates[3 * (5 * j + i) + 2];
        // V-F5 d), 12 digits.
        for (value, exact) in
            [(z(2, 2), -0.0112479531712), (z(1, 2), -0.00874841757852), (z(1, 1), -0.00687384001246)]
        {
            assert!(off(value, exact) < 2e-11, "{file}: {value} is not {exact}");
        }
        assert!(answer(&text) == generated, "{file}: an answer of other bytes than that of the generator");
    }
}

/// A directory with a mesh file and a scene that names it.
struct Files {
    dir: tempfile::TempDir,
}

impl Files {
    fn new(file: &str, content: &str) -> Self {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join(file), content).unwrap();
        Self { dir }
    }

    fn scene(&self, structure: &str) -> Scene {
        let path = self.dir.path().join("test.toml");
        std::fs::write(
            &path,
            format!("end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[structure]\n{structure}\n"),
        )
        .unwrap();
        Scene::load(&path, &[]).unwrap()
    }

    /// The message with which the scene is refused, without the directory.
    fn refused(&self, structure: &str) -> String {
        let error = match FemSolver::new(&self.scene(structure), &Options::default()) {
            Ok(_) => check(&self.scene(structure)).expect_err("must be refused"),
            Err(error) => error,
        };
        error.to_string().replace(&format!("{}/", self.dir.path().display()), "")
    }
}

/// A rope of two cables with a membrane beside it, nodes numbered 10, 20, ...
const MIXED: &str = "\
*NODE
10, 0, 0, 0
20, 1, 0, 0
30, 2, 0, 0
40, 1, 1, 0
50, 9, 9, 9
*ELEMENT, TYPE=T3D2, ELSET=rope
1, 10, 20
2, 20, 30
*ELEMENT, TYPE=S3, ELSET=skin
3, 10, 20, 40
*NSET, NSET=ends
10, 30
*NSET, NSET=top
40
";
const CABLE: &str = "cable = { young = 1e9, area = 1e-4, density = 7850.0 }";

#[test]
fn what_no_element_can_be_made_of_is_refused_with_its_group_and_kind() {
    let files = Files::new("mixed.inp", MIXED);
    let with = |more: &str| files.refused(&format!("mesh = \"mixed.inp\"\n{CABLE}\n{more}"));
    let message = with("supports = [{ group = \"ends\" }]");
    assert!(
        message.contains(
            "cables cannot be made of triangles of 3 nodes, and element 3 of the group `skin` is one"
        ),
        "{message}"
    );
    let message = with(
        "parts = [{ name = \"rope\", element = \"ring\", diameter = 1.0, perimeter_stiffness = 1.0, bending_stiffness = 1.0, mass = 1.0 }]",
    );
    assert!(
        message.contains("rings cannot be made of lines of 2 nodes, and element 1 of the group `rope`"),
        "{message}"
    );
    assert!(message.starts_with("test.toml:6:"), "{message}");
}

#[test]
fn parts_say_what_a_group_becomes_and_give_its_properties() {
    let files = Files::new("mixed.inp", MIXED);
    let scene = files.scene(&format!(
        "mesh = \"mixed.inp\"\n{CABLE}\nparts = [{{ name = \"rope\", element = \"cable\", area = 2e-4, radius = 0.01 }}, {{ name = \"skin\", \
         element = \"cable\", prestress = 1e6 }}]\nsupports = [{{ group = \"ends\" }}]"
    ));
    let solver = FemSolver::new(&scene, &Options::default()).unwrap();
    let model = solver.model();
    assert_eq!(
        model.cables.iter().map(|c| c.nodes).collect::<Vec<_>>(),
        [[0, 1], [1, 2], [0, 1], [1, 3], [3, 0]]
    );
    assert_eq!(model.cables.iter().map(|c| c.of.area).collect::<Vec<_>>(), [2e-4, 2e-4, 1e-4, 1e-4, 1e-4]);
    assert_eq!(model.cables.iter().map(|c| c.of.prestress).collect::<Vec<_>>(), [0.0, 0.0, 1e6, 1e6, 1e6]);
    let group = |name: &str| model.parts.iter().find(|g| g.name == name).unwrap().cables.clone();
    assert_eq!((group("rope"), group("skin")), (vec![0, 1], vec![2, 3, 4]));
    assert_eq!(model.node_name(3), "40 at (1, 1, 0)", "nodes are called as in the file");
    assert_eq!(model.node_count(), 4, "node 50 is left out");
    assert!(
        model.warnings[0].message.starts_with("1 nodes of the mesh belong to no element"),
        "{:?}",
        model.warnings
    );
}

#[test]
fn lines_that_follow_each_other_are_one_sliding_rope_and_a_triangle_is_a_membrane() {
    let files = Files::new("mixed.inp", MIXED);
    let scene = files.scene(
        "mesh = \"mixed.inp\"\nsupports = [{ group = \"ends\" }]\nparts = [{ name = \"rope\", element = \
         \"sliding_cable\", young = 1e9, area = 1e-4, density = 7850.0 }, { name = \"skin\", element = \"membrane\", \
         thickness = 1e-3, density = 1e3, young = [1e8] }]\nform_finding = \"none\"",
    );
    let solver = FemSolver::new(&scene, &Options::default()).unwrap();
    let model = solver.model();
    let nodes: Vec<_> = model.elements.iter().map(|e| e.nodes().to_vec()).collect();
    assert_eq!(nodes, [vec![0, 1, 2], vec![0, 1, 3]]);
    let part = |name: &str| model.parts.iter().find(|p| p.name == name).unwrap().elements.clone();
    assert_eq!((part("rope"), part("skin")), (vec![0], vec![1]));
    let branch = Files::new("mixed.inp", &MIXED.replace("2, 20, 30", "2, 20, 30\n4, 20, 40"));
    let message = branch.refused(
        "mesh = \"mixed.inp\"\nparts = [{ name = \"skin\", element = \"none\" }, { name = \"rope\", element = \
         \"sliding_cable\", young = 1e9, area = 1e-4, density = 7850.0 }]",
    );
    assert!(message.contains("more than two of them end at node 20"), "{message}");
}

#[test]
fn a_group_that_becomes_nothing_leaves_its_other_nodes_out() {
    let files = Files::new("mixed.inp", MIXED);
    let skin = "parts = [{ name = \"skin\", element = \"none\" }]\nsupports = [{ group = \"ends\" }]";
    let scene = files.scene(&format!("mesh = \"mixed.inp\"\n{CABLE}\n{skin}"));
    let report = check(&scene).unwrap();
    assert_eq!(report.numbers["nodes"], 3.0);
    assert!(
        report.warnings.iter().any(|w| w.message.starts_with("2 nodes of the mesh")),
        "{:?}",
        report.warnings
    );
    // A group that is bound keeps its nodes, and then they need an element.
    let message = files.refused(&format!(
        "mesh = \"mixed.inp\"\n{CABLE}\n{skin}\nloads = [{{ group = \"top\", force = [0.0, 0.0, 1.0] }}]"
    ));
    assert!(message.contains("node 40 at (1, 1, 0) is held by no element"), "{message}");
}

#[test]
fn each_fault_of_a_binding_is_named_with_its_place() {
    let files = Files::new("mixed.inp", MIXED);
    let skin = "{ name = \"skin\", element = \"none\" }";
    for (structure, place, words) in [
        ("mesh = \"other.inp\"".to_owned(), "test.toml:4:", "there is no mesh file other.inp"),
        ("mesh = \"test.toml\"".to_owned(), "test.toml: ", "known are .msh (Gmsh)"),
        (
            format!("mesh = \"mixed.inp\"\nparts = [{{ name = \"rop\", element = \"cable\" }}]\n{CABLE}"),
            "test.toml:5:",
            "did you mean `rope`? known here: `rope`, `skin`",
        ),
        (
            format!("mesh = \"mixed.inp\"\nparts = [{skin}, {skin}]\n{CABLE}"),
            "test.toml:5:",
            "element 3 is in the parts",
        ),
        (
            format!("mesh = \"mixed.inp\"\nparts = [{skin}]"),
            "test.toml:3:",
            "element 1 of the group `rope` is in no part, and there is no table [structure.cable]",
        ),
        (
            format!("mesh = \"mixed.inp\"\nparts = [{skin}]"),
            "test.toml:3:",
            "write [[structure.parts]] with name = \"rope\", element = \"cable\" and of = \"rope 20/1770\"",
        ),
        (
            format!(
                "mesh = \"mixed.inp\"\nparts = [{skin}, {{ name = \"rope\", element = \"cable\", young = 1e9 }}]"
            ),
            "test.toml:5:",
            "no area is stated here",
        ),
        (
            format!("mesh = \"mixed.inp\"\nparts = [{skin}]\n{CABLE}\nsupports = [{{ nodes = [0] }}]"),
            "test.toml:7:",
            "bound by names, not by node numbers",
        ),
        (
            format!("mesh = \"mixed.inp\"\nnodes = [[0.0, 0.0, 0.0]]\n{CABLE}"),
            "test.toml:5:",
            "takes no further nodes",
        ),
        (
            format!("mesh = \"mixed.inp\"\nparts = [{skin}]\n{CABLE}\nsupports = [{{ group = \"end\" }}]"),
            "test.toml:7:",
            "did you mean `ends`? known here: `ends`",
        ),
        (
            format!(
                "mesh = \"mixed.inp\"\n{CABLE}\ngenerator = {{ type = \"rectangular_net\", cells = [1, 1], spacing = 1.0 }}"
            ),
            "test.toml:4:",
            "either a mesh file or a generator",
        ),
        (format!("parts = [{skin}]\nnodes = [[0.0, 0.0, 0.0]]"), "test.toml:4:", "has no cells"),
    ] {
        let message = files.refused(&structure);
        assert!(message.starts_with(place), "{structure}: {message}");
        assert!(message.contains(words), "{structure}: {message}");
    }
    let twice = Files::new("twice.inp", &MIXED.replace("20, 1, 0, 0", "20, 0, 0, 0"));
    let message = twice.refused(&format!("mesh = \"twice.inp\"\n{CABLE}\nparts = [{skin}]"));
    assert!(message.contains("element 1 of the group `rope` has the length 0 m"), "{message}");
}

#[test]
fn a_group_of_the_file_called_supports_is_the_users() {
    let files = Files::new("mixed.inp", &MIXED.replace("NSET=ends", "NSET=supports"));
    let skin = "parts = [{ name = \"skin\", element = \"none\" }]";
    let scene_ = files
        .scene(&format!("mesh = \"mixed.inp\"\n{CABLE}\n{skin}\nsupports = [{{ group = \"supports\" }}]"));
    let solver = FemSolver::new(&scene_, &Options::default()).unwrap();
    let named: Vec<_> = solver.model().groups.iter().filter(|g| g.name == "supports").collect();
    assert_eq!(named.len(), 1);
    assert_eq!(named[0].nodes, [0, 2]);
}

#[test]
fn the_resolved_scene_of_a_mesh_builds_the_same_structure() {
    let text = net(&format!("mesh = \"{}/{}\"", data(), FILES[0]), "frame", "inner");
    let report = check(&scene(&text)).unwrap();
    let mut resolved = report.resolved.clone();
    resolved.insert("end_time".into(), 1.0.into());
    let again = check(&scene(&toml::to_string(&resolved).unwrap())).unwrap();
    assert_eq!(again.resolved, report.resolved);
    assert!(Path::new(again.resolved["structure"]["mesh"].as_str().unwrap()).is_file());
}

#[test]
fn nodes_numbered_without_a_pattern_are_brought_together_and_called_as_in_the_file() {
    // A rope of 40 cables whose nodes are numbered with large steps.
    let number = |i: usize| 1 + i * 17 % 41;
    let mut place = [0; 41];
    (0..41).for_each(|i| place[number(i) - 1] = i);
    let mut mesh = String::from("*NODE\n");
    place.iter().enumerate().for_each(|(n, i)| mesh += &format!("{}, {i}, 0, 0\n", n + 1));
    mesh += "*ELEMENT, TYPE=T3D2, ELSET=rope\n";
    (0..40).for_each(|i| mesh += &format!("{}, {}, {}\n", i + 1, number(i), number(i + 1)));
    mesh += &format!("*NSET, NSET=ends\n{}, {}\n", number(0), number(40));
    let files = Files::new("rope.inp", &mesh);
    let scene = files.scene(&format!("mesh = \"rope.inp\"\n{CABLE}\nsupports = [{{ group = \"ends\" }}]"));
    let solver = FemSolver::new(&scene, &Options::default()).unwrap();
    let model = solver.model();
    assert!(model.cables.iter().all(|c| c.nodes[0].abs_diff(c.nodes[1]) == 1), "{:?}", model.cables[0].nodes);
    let ends = model.groups.iter().find(|g| g.name == "ends").unwrap();
    assert_eq!(ends.nodes, [0, 40]);
    for (node, position) in model.nodes.iter().enumerate() {
        let name = format!("{} at ({}, 0, 0)", number(position.x as usize), position.x);
        assert_eq!(model.node_name(node), name);
    }
}
