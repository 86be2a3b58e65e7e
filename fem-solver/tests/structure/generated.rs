//! Ring nets and the barrier: their rest shape, their balance, their refusals.

use crate::common::{Run, off, scene};
use fem_solver::FemSolver;
use toolkit::program::Options;

#[test]
fn a_ring_net_of_polygons_hangs_in_its_frame() {
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = { type = "ring_net", rings = [8, 6], diameter = 0.3, center = [0.0, 0.0, 0.0] }
cable = { young = 1e10, area = 2e-5, density = 7850.0 }
parts = [{ name = "net", element = "cable" }]
[[gauge]]
name = "net"
group = "net"
quantity = "tension"
"#;
    let mut run = Run::alone(text, 1e-4);
    assert_eq!(run.ready.mesh.lines.len(), 4 * 48, "four cables for each ring, none shared");
    let weight = 4.0 * 48.0 * 0.15 * 2.0_f64.sqrt() * 2e-5 * 7850.0 * 9.81;
    run.step(1e-4, &[]);
    assert!(off(run.value("reaction_z"), weight) < 1e-9, "{} is not {weight}", run.value("reaction_z"));
    let sag = run.measure("sag");
    assert!(sag > 1e-3 && sag < 0.1, "{sag}");
}

/// The scene `barrier-cables`.
fn barrier() -> String {
    let path = format!("{}/../launch/scenes/barrier-cables.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// `text` with `from` replaced, which must be in it.
fn with(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replace(from, to)
}

fn weight(run: &Run) -> f64 {
    let model = run.solver.model();
    -model.dead_load[2 * model.node_count()..].iter().sum::<f64>()
}

#[test]
fn the_barrier_of_cables_finds_its_shape_and_bears_a_push() {
    let mut run = Run::alone(&barrier(), 0.05);
    let weight = weight(&run);
    assert_eq!((run.solver.model().node_count(), run.ready.mesh.lines.len()), (557, 1036));
    let mut last = 0.0;
    for _ in 0..20 {
        run.step(0.05, &[]);
        // In balance: the residual lies below 1e-10 of the largest forces, some 5e4 N.
        assert!(
            (run.value("reaction_z") - weight).abs() < 1e-5,
            "{} is not {weight}",
            run.value("reaction_z")
        );
        assert!(run.value("reaction_y").abs() < 1e-5 && run.value("heads_fx_sum").abs() < 1e-5);
        assert!(run.value("push_fy_sum") > last, "the push grows with its way");
        last = run.value("push_fy_sum");
    }
    // As the scene says, six digits; an equilibrium does not depend on the way that led to it.
    for (gauge, expected) in [
        ("net_tension_max", 2227.30),
        ("top_rope_tension_max", 18963.3),
        ("bottom_rope_tension_max", 17032.5),
        ("brakes_tension_max", 8007.11),
    ] {
        assert!(off(run.value(gauge), expected) < 5e-6, "{gauge}: {}", run.value(gauge));
    }
}

#[test]
fn the_barrier_of_posts_sliding_ropes_and_brakes_hangs_in_balance() {
    let path = format!("{}/../launch/scenes/barrier.toml", env!("CARGO_MANIFEST_DIR"));
    let mut run = Run::alone(&std::fs::read_to_string(path).unwrap(), 0.005);
    let model = run.solver.model();
    // Posts, sliding ropes, brakes of ropes and of upslope ropes.
    let count = |name: &str| model.parts.iter().find(|p| p.name == name).unwrap().elements.len();
    let counts = ["posts", "top_rope", "bottom_rope", "rope_brakes", "upslope_brakes"].map(count);
    assert_eq!(counts, [4, 1, 1, 4, 8]);
    // Weight on what translates: the dead load on rotations follows it.
    let n = model.node_count();
    let weight = -model.dead_load[2 * n..3 * n].iter().sum::<f64>();
    run.step(0.005, &[]);
    // The residual lies below 1e-8 of the largest forces, some 4e5 N.
    assert!((run.value("reaction_z") - weight).abs() < 1e-2, "{} is not {weight}", run.value("reaction_z"));
}

#[test]
fn ropes_with_friction_hang_in_balance_too() {
    // Newton does not come to a form with friction; the one without it has one tension in each rope, which friction holds.
    let path = format!("{}/../launch/scenes/barrier.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let rough = with(&text, "element = \"sliding_cable\"", "element = \"sliding_cable\"\nfriction = 0.1");
    let (mut smooth, mut rough) = (Run::alone(&text, 0.005), Run::alone(&rough, 0.005));
    assert!(
        rough.ready.warnings.iter().any(|w| w.message.contains("with friction of the ropes no rest shape"))
    );
    assert_eq!(smooth.ready.mesh.coordinates, rough.ready.mesh.coordinates);
    for run in [&mut smooth, &mut rough] {
        run.step(1e-6, &[]);
    }
    for rope in ["top_rope_tension_max", "bottom_rope_tension_max"] {
        assert!(off(rough.value(rope), smooth.value(rope)) < 1e-6, "{}", rough.value(rope));
    }
}

#[test]
fn a_barrier_with_rings_hangs_in_balance() {
    let text = with(&barrier(), "cells = [20, 8]", "cells = [6, 3]\nnet = \"rings\"");
    let mut run = Run::alone(&text, 0.05);
    let weight = weight(&run);
    run.step(0.05, &[]);
    assert!((run.value("reaction_z") - weight).abs() < 1e-5, "{} is not {weight}", run.value("reaction_z"));
    // Each ring has its own four cables.
    let net = run.solver.model().parts.iter().find(|g| g.name == "net").unwrap();
    assert_eq!(net.cables.len(), 4 * 18 * 3);
}

#[test]
fn a_part_that_no_element_is_there_for_is_refused_with_its_name_and_kind() {
    let refused = |text: &str| match FemSolver::new(&scene(text), &Options::default()) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("must be refused"),
    };
    let text = barrier();
    for (from, to, words) in [
        (
            "{ name = \"posts\", element = \"none\" },",
            "",
            "the generated group `posts` is made for element = \"beam\"",
        ),
        (
            "{ name = \"top_rope\", element = \"cable\" },",
            "",
            "the generated group `top_rope` is made for element = \"sliding_cable\"",
        ),
        (
            "{ name = \"rope_brakes\", element = \"cable\" },",
            "",
            "the generated group `rope_brakes` is made for element = \"brake\"",
        ),
        (
            "{ name = \"posts\", element = \"none\" },",
            "{ name = \"post\", element = \"none\" },",
            "did you mean `posts`? known here: `net`, `posts`",
        ),
        (
            "{ name = \"top_rope\", element = \"cable\" }",
            "{ name = \"top_rope\", element = \"brake\", stiffness = 1e6 }",
            "brakes cannot be made of rows of nodes, and element 899 of the group `top_rope`",
        ),
        ("cells = [20, 8]", "lean = -4.0", "posts of 4 m cannot lean by -4 m"),
        ("cells = [20, 8]", "fields = 0", "one field at least"),
        ("cells = [20, 8]", "cells = [20, 0]", "is none"),
        ("cells = [20, 8]", "cells = [4000000000, 4000000000]", "too many"),
        ("cells = [20, 8]", "brake_length = 3.0", "does not fit into 2.5 m of rope"),
        ("cells = [20, 8]", "cels = [20, 8]", "unknown key `cels`"),
        (
            "type = \"barrier\"\ncells = [20, 8]",
            "type = \"ring_net\"\nrings = [2, 2]\ndiameter = 0.3\nheld = \"corners\"",
            "no nodes at its corners",
        ),
    ] {
        let message = refused(&with(&text, from, to));
        assert!(message.contains(words), "{to}: {message}");
    }
}
