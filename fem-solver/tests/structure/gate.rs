//! Mistakes of a user: certainly wrong is an error, possible but unusual a warning, each with numbers and the cure.

use crate::common::{check, scene};
use fem_solver::FemSolver;
use interface_defs::diagnostic::Severity;
use toolkit::program::Options;

/// A barrier of one field with everything in it.
const BARRIER: &str = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
supports = [{ group = "feet", rotations = "z" }, { group = "anchors" }]
[structure.generator]
type = "barrier"
fields = 1
cells = [10, 4]
[structure.cable]
young = 1e11
area = 1.6e-4
density = 7850.0
prestress = 5e7
radius = 0.01
[[structure.parts]]
name = "net"
element = "cable"
area = 2.5e-5
prestress = 2e6
radius = 0.004
rupture_force = 2.5e4
[[structure.parts]]
name = "posts"
element = "beam"
young = 2.1e11
area = 5.4e-3
inertia = [2.5e-5, 9.2e-6]
density = 7850.0
radius = 0.08
[[structure.parts]]
name = "top_rope"
element = "sliding_cable"
young = 1e11
area = 1.6e-4
density = 7850.0
prestress = 5e7
radius = 0.01
rupture_force = 2e5
[[structure.parts]]
name = "bottom_rope"
element = "sliding_cable"
young = 1e11
area = 1.6e-4
density = 7850.0
prestress = 5e7
radius = 0.01
[[structure.parts]]
name = "rope_brakes"
element = "brake"
stiffness = 5e6
curve = [[0.02, 5e4], [0.8, 6e4]]
stroke = 0.8
mass = 10.0
[[structure.parts]]
name = "upslope_brakes"
element = "brake"
stiffness = 5e6
curve = [[0.02, 5e4], [0.8, 6e4]]
mass = 10.0
[[gauge]]
name = "posts"
group = "posts"
quantity = "tension"
"#;

fn changed(from: &str, to: &str) -> String {
    assert!(BARRIER.contains(from), "{from}");
    BARRIER.replacen(from, to, 1)
}

/// The message with which a scene is refused before anything is computed.
fn refused(text: &str) -> String {
    match FemSolver::new(&scene(text), &Options::default()) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("must be refused: {text}"),
    }
}

/// Warnings of a scene, before anything is computed.
fn warned(text: &str) -> String {
    let solver = FemSolver::new(&scene(text), &Options::default()).unwrap_or_else(|e| panic!("{e}"));
    let warnings = &solver.model().warnings;
    assert!(warnings.iter().all(|w| w.severity == Severity::Warning), "{warnings:?}");
    warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_barrier_as_it_should_be_brings_no_warning() {
    assert_eq!(warned(BARRIER), "");
}

#[test]
fn posts_of_a_section_whose_weak_axis_faces_the_block_are_warned_of_with_what_to_write() {
    let elastic = "young = 2.1e11\narea = 5.4e-3\ninertia = [2.5e-5, 9.2e-6]\ndensity = 7850.0\n";
    let posts = |of: &str| BARRIER.replacen(elastic, of, 1);
    let weak = warned(&posts("section = \"HE 160 B\"\nsteel = \"S235\"\n"));
    let words = "structure.parts.1.up: `posts` stand with the weak axis of their section against what comes across the barrier; \
                 turn the web there with up = [0.0, 1.0, 0.0]";
    assert_eq!(weak, words);
    for stands in ["section = \"HE 160 B\"\nup = [0.0, 1.0, 0.0]\n", "section = \"CHS 101.6x6.3\"\n"] {
        assert_eq!(warned(&posts(&format!("{stands}steel = \"S235\"\n"))), "");
    }
    // On a line along y it is the other way, and `up` of a kit that was written for its own axes does not fit.
    let line = "type = \"barrier\"\nline = [[0.0, 0.0, 0.0], [0.0, -10.0, 0.0]]\nuphill = \"right\"";
    let own = "section = \"HE 160 B\"\nsteel = \"S235\"\nup = [0.0, 1.0, 0.0]\n";
    let placed = warned(&posts(own).replacen("type = \"barrier\"", line, 1));
    assert!(placed.contains("up = [1.0, 0.0, 0.0]"), "{placed}");
}

#[test]
fn what_is_certainly_wrong_is_refused_with_its_numbers_and_a_cure() {
    for (from, to, words, cure) in [
        (
            "young = 1e11",
            "young = 100.0",
            "young = 100 Pa is softer than rubber",
            "in GPa, it would be 1e11 Pa",
        ),
        (
            "young = 2.1e11",
            "young = 210.0",
            "young = 210 Pa is softer than rubber",
            "in GPa, it would be 2.1e11 Pa",
        ),
        ("density = 7850.0", "density = 7.85e-9", "lighter than air", "in t/mm3, it would be 7850 kg/m3"),
        (
            "density = 7850.0",
            "density = 7.85e12",
            "density = 7.85e12 kg/m3 is heavier than any metal",
            "7850",
        ),
        ("area = 1.6e-4", "area = 160.0", "a rod 14.273 m thick", "2.4e-4"),
        ("area = 2.5e-5", "area = 25.0", "a rod 5.642 m thick", "2.4e-4"),
        ("area = 5.4e-3", "area = 5400.0", "a rod 82.919 m thick", "2.4e-4"),
        (
            "inertia = [2.5e-5, 9.2e-6]",
            "inertia = [2.5e7, 9.2e6]",
            "a radius of gyration of 6.80e4 m",
            "2.49e-5",
        ),
        ("radius = 0.004", "radius = 4.0", "radius is 4 m, and the longest element of it has 1", "0.008"),
        ("radius = 0.08", "radius = 80.0", "radius is 80 m", "0.008"),
        ("rupture_force = 2e5", "rupture_force = 7.9e3", "the prestress alone is 8.0000e3 N", "3e5"),
        ("stroke = 0.8", "stroke = 800.0", "stroke is 800 m", "0.3"),
        ("curve = [[0.02, 5e4], [0.8, 6e4]]", "curve = [[20.0, 5e4], [800.0, 6e4]]", "curve is 800 m", "0.3"),
        ("fields = 1", "fields = 1\nspacing = 10000.0", "a spacing of 10000 m", "metres"),
        ("fields = 1", "fields = 300", "an extent of", "metres"),
        ("cells = [10, 4]", "cells = [10, 4]\nheight = 400.0", "a height of 400 m", "400 cm is 4.0"),
        // 5e7 Pa on 1.6e-4 m2.
        (
            "curve = [[0.02, 5e4], [0.8, 6e4]]",
            "curve = [[0.02, 50.0], [0.8, 60.0]]",
            "gives way under 60 N at most, and the prestress of `bottom_rope`, which ends at it, alone is 8.0000e3 N",
            "120 kN is 1.2e5",
        ),
        (
            "curve = [[0.02, 5e4], [0.8, 6e4]]",
            "curve = [[-0.02, 5e4], [-0.8, 6e4]]",
            "must not begin below 0",
            "upward",
        ),
        (
            "{ group = \"anchors\" }",
            "{ group = \"anchors\", motion = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 225.0, 0.0]] }",
            "moves by 225 m",
            "100 mm is 0.1",
        ),
        ("cells = [10, 4]", "cells = [1000000, 4000]", "too many", "[20, 20]"),
        ("cells = [10, 4]", "cells = [0, 4]", "is none", "[20, 20]"),
        ("cells = [10, 4]", "cells = [10, 4]\nheight = -4.0", "must lie above 0", "height"),
        ("cells = [10, 4]", "cells = [10, 4]\nheigth = 4.0", "heigth", "height"),
        ("group = \"feet\"", "group = \"feets\"", "no group `feets`", "did you mean `feet`?"),
        ("group = \"posts\"", "group = \"post\"", "no group `post`", "did you mean `posts`?"),
        (
            "name = \"top_rope\"",
            "name = \"toprope\"",
            "no group of elements `toprope`",
            "did you mean `top_rope`?",
        ),
        ("group = \"posts\"", "at = [0.0, 3.0, 0.0]", "the nearest, node", "m away"),
        (
            "[[gauge]]",
            "[[gauge]]\nname = \"posts\"\ngroup = \"posts\"\nquantity = \"tension\"\n[[gauge]]",
            "a name of its own",
            "posts",
        ),
    ] {
        let message = refused(&changed(from, to));
        assert!(message.starts_with("test.toml:"), "{to}: {message}");
        assert!(message.contains(words) && message.contains(cure), "{to}: {message}");
    }
}

#[test]
fn what_is_unusual_is_a_warning_with_its_numbers() {
    for (from, to, words) in [
        ("young = 1e11", "young = 1e5", "were it in MPa, it would be 1e11 Pa; 210 GPa"),
        ("young = 1e11", "young = 8228.0", "were it in MPa, it would be 8.228e9 Pa"),
        ("prestress = 5e7", "prestress = 50.0", "were it in MPa, it would be 5e7 Pa"),
        // 2e-11 of 1e11 Pa, of the part that has no modulus of its own.
        ("prestress = 2e6", "prestress = 2.0", "strains it by 2.0e-11 only (young is 1e11 Pa)"),
        ("prestress = 5e7", "prestress = 5e10", "more than any wire bears"),
        // -6e8 of 1e11.
        ("prestress = 2e6", "prestress = -6e8", "0.6 % longer than the distance of its nodes"),
        ("young = 1e11", "young = 1e8", "were it in kPa, it would be 1e11 Pa"),
        (
            "{ group = \"anchors\" }",
            "{ group = \"anchors\", motion = [[0.0, 0.0, 0.0, 0.0], [500.0, 0.0, 0.2, 0.0]] }",
            "it goes on until 500 s, and the run ends at end_time = 1 s",
        ),
        (
            "[structure.generator]",
            "[[structure.loads]]\ngroup = \"anchors\"\nforce = [0.0, 1e3, 0.0]\n[structure.generator]",
            "structure.loads.0: supports hold its",
        ),
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, 9.81]", "points up along z"),
        // A rod of 25 mm2 has a radius of sqrt(25 / pi) = 2.82 mm.
        ("radius = 0.004", "radius = 0.00564", "is it the diameter? Then write 0.00282"),
        ("young = 2.1e11", "young = 2.1e14", "stiffer than diamond"),
        (
            "density = 7850.0",
            "density = 7.85",
            "7.85 kg/m3 is that of a foam, or lighter than air; were it in g/cm3, it would be 7850 kg/m3",
        ),
        ("density = 7850.0", "density = 78500.0", "heavier than any metal"),
        ("area = 1.6e-4", "area = 1.6", "a rod 1.427 m thick"),
        ("radius = 0.004", "radius = 0.4", "radius: 0.4 m beside elements of"),
        ("radius = 0.004", "radius = 0.001", "the section of 0.000025 m2 alone has 2.82e-3 m"),
        ("inertia = [2.5e-5, 9.2e-6]", "inertia = [2.5e-2, 9.2e-3]", "a radius of gyration of"),
        ("rupture_force = 2.5e4", "rupture_force = 60.0", "a strength of 2.4e6 Pa, weaker than wood"),
        ("rupture_force = 2.5e4", "rupture_force = 2.5e4\nrupture_strain = 5.0", "5 % is 0.05"),
        (
            "curve = [[0.02, 5e4], [0.8, 6e4]]\nmass",
            "curve = [[0.02, 50.0], [0.8, 60.0]]\nmass",
            "gives way under 60 N at most",
        ),
        (
            "mass = 10.0",
            "mass = 10.0\nrupture_force = 4e4",
            "breaks under 40000 N, before it gives way under 50000 N",
        ),
        ("gravity = [0.0, 0.0, -9.81]", "", "there is no gravity"),
        (
            "gravity = [0.0, 0.0, -9.81]",
            "gravity = [0.0, 0.0, -9810.0]",
            "9810 m/s2 is more than five times that of the earth",
        ),
        ("fields = 1", "fields = 60", "are these centimetres or millimetres?"),
        (
            "supports = [{ group = \"feet\", rotations = \"z\" }, { group = \"anchors\" }]",
            "form_finding = \"none\"",
            "nothing holds the structure",
        ),
    ] {
        let said = warned(&changed(from, to));
        assert!(said.contains(words), "{to}: {said}");
    }
}

/// A square of wires from Gmsh, with coordinates times `scale` and an end of the last wire on a node of its own if `apart`.
fn mesh(scale: f64, apart: bool) -> String {
    let p = |x: f64, y: f64| format!("{} {} 0", scale * x, scale * y);
    let last = if apart { 5 } else { 1 };
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"net\"\n$EndPhysicalNames\n$Nodes\n5\n1 {}\n2 {}\n3 {}\n\
         4 {}\n5 {}\n$EndNodes\n$Elements\n4\n1 1 2 1 1 1 2\n2 1 2 1 1 2 3\n3 1 2 1 1 3 4\n4 1 2 1 1 4 {last}\n$EndElements\n",
        p(0.0, 0.0),
        p(1.0, 0.0),
        p(1.0, 1.0),
        p(0.0, 1.0),
        p(0.0, 0.0)
    )
}

#[test]
fn meshes_in_millimetres_open_meshes_and_what_is_no_mesh_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let text = |file: &str| {
        format!(
            "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[structure]\nmesh = {:?}\nsupports = [{{ at = [0.0, 0.0, 0.0] }}]\n[[structure.parts]]\nname \
             = \"net\"\nelement = \"cable\"\nyoung = 1e11\narea = 1e-5\ndensity = 7850.0\n",
            dir.path().join(file)
        )
    };
    let write = |name: &str, content: &str| std::fs::write(dir.path().join(name), content).unwrap();
    write("metres.msh", &mesh(1.0, false));
    // The fifth node belongs to no element and is left out.
    assert!(warned(&text("metres.msh")).contains("1 nodes of the mesh belong to no element"));
    write("millimetres.msh", &mesh(2000.0, false));
    let message = refused(&text("millimetres.msh"));
    assert!(message.contains("extent of 2828.4271 m") && message.contains("scale it by 0.001"), "{message}");
    write("apart.msh", &mesh(1.0, true));
    let said = warned(&text("apart.msh"));
    assert!(
        said.contains("1 nodes lie where another one does, first node 1 at (0, 0, 0) and node 5"),
        "{said}"
    );
    write("empty.msh", "");
    assert!(refused(&text("empty.msh")).contains("the file is empty"));
    assert!(refused(&text("none.msh")).contains("there is no mesh file"));
    std::fs::create_dir(dir.path().join("folder.msh")).unwrap();
    assert!(refused(&text("folder.msh")).contains("this is a directory"));
    let nodes = mesh(1.0, false);
    write("nodes.msh", &format!("{}$Elements\n0\n$EndElements\n", nodes.split("$Elements").next().unwrap()));
    let message = refused(text("nodes.msh").split("supports").next().unwrap());
    assert!(message.contains("the structure is empty"), "{message}");
}

#[test]
fn a_check_says_the_same_words() {
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
supports = [{ nodes = [0, 2] }]
[[structure.parts]]
name = "rope"
element = "cable"
cells = [[0, 1, 2]]
young = 1e9
area = 1e-4
density = 7850.0
rupture_strain = 5.0
"#;
    let said = warned(text);
    assert!(
        said.contains("structure.parts.0.rupture_strain: 5 is a strain, no percentage; 5 % is 0.05"),
        "{said}"
    );
    let report = check(&scene(text)).unwrap_or_else(|e| panic!("{e}"));
    assert!(report.warnings.iter().any(|w| w.to_string() == said), "{said}: {:?}", report.warnings);
}

#[test]
fn supports_that_hold_nothing_are_named() {
    // The corners of the grid stand at no wire where the net is of one row of free cells only: a group of bare nodes.
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = { type = "rectangular_net", cells = [3, 3], spacing = 0.5, boundary_cables = false }
supports = [{ group = "corners" }]
cable = { young = 1e11, area = 1e-5, density = 7850.0 }
"#;
    assert!(
        warned(text).contains("structure.supports.0 holds nothing: no element ends at its 4 nodes"),
        "{}",
        warned(text)
    );
    assert_eq!(warned(&text.replace("\"corners\"", "\"edges\"")), "");
}

#[test]
fn a_structure_that_cannot_move_and_a_wire_that_tears_by_its_weight_are_refused_at_their_key() {
    let net = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = { type = "rectangular_net", cells = [3, 3], spacing = 0.5 }
supports = [{ group = "edges" }, { group = "interior" }]
[[structure.parts]]
name = "net"
element = "cable"
young = 1e11
area = 1e-5
density = 7850.0
"#;
    assert!(warned(net).contains("the supports hold all 16 nodes"), "{}", warned(net));
    let rock =
        "[[rock]]\nposition = [0.75, 0.75, 1.0]\nmass = 10.0\nshape = { type = \"sphere\", radius = 0.1 }\n";
    let message = refused(&format!("{net}{rock}"));
    assert!(message.starts_with("test.toml:6:12: the supports hold all 16 nodes"), "{message}");
    assert!(message.contains("hold the frame alone"), "{message}");
    let weak = net.replace(", { group = \"interior\" }", "") + "rupture_force = 20.0\n";
    let message = check(&scene(&weak)).expect_err("tears").to_string();
    assert!(message.starts_with("test.toml:13:17: ") && message.contains("300 kN is 3e5"), "{message}");
}
