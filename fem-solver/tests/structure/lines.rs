//! Long barriers: rest shapes in a time that grows with the number of fields, and what is said where there is none.

use crate::common::{Run, scene, solver};
use crate::rest::barrier;
use fem_solver::config::Config;
use fem_solver::element::Slack;
use fem_solver::equilibrium::newton::Newton;
use fem_solver::internal_force::tangent::Tangent;
use fem_solver::model::Model;

/// Rings of 0.5 m between posts that lean by 25 degrees.
fn line(fields: usize) -> String {
    let text = barrier(25.0, 20, 0.0, "static", 0.0).replace("anchor_rise = 0.0", "anchor_rise = 4.0");
    text.replace("height = 4.0", &format!("height = 4.0\nfields = {fields}"))
}

fn model(text: &str) -> Model {
    let scene = scene(text);
    let config = Config::of(&scene).unwrap_or_else(|e| panic!("{e}"));
    Model::build(&scene, &config).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn lines_of_8_and_20_fields_come_to_rest_in_as_many_iterations_as_one_of_3() {
    for fields in [3, 8, 20] {
        let mut run = Run::alone(&line(fields), 1e-4);
        let weight = 9.81 * run.solver.model().mass.iter().sum::<f64>();
        let carried = run.value("reaction_z");
        assert!((carried / weight - 1.0).abs() < 1e-6, "{fields} fields: {carried} N of {weight} N");
        let count = run.count("newton_iterations");
        println!("{fields} fields: {count} iterations");
        // Some 70, whatever the length.
        assert!(count < 150, "{fields} fields: {count} iterations");
        (0..20).for_each(|_| run.step(1e-4, &[]));
        let energy = run.value("energy_kinetic_fem");
        assert!(energy < 1e-9, "{fields} fields: {energy} J");
    }
}

/// An iteration costs what its factor has numbers: a rope over the whole line would square them.
#[test]
fn the_factor_of_a_line_grows_with_its_fields() {
    let numbers = |fields| {
        let tangent = Tangent::new(&model(&line(fields)));
        tangent.matrix.cholesky.factor_len() as f64 / fields as f64
    };
    let (short, long) = (numbers(3), numbers(30));
    assert!(long < 1.1 * short, "{short} numbers a field, {long}");
}

#[test]
fn a_rope_in_pieces_is_the_rope_as_a_whole() {
    let model = model(&line(3).replace("cells = [20, 8]", "cells = [6, 3]"));
    let mut random = {
        let mut state = 1_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        }
    };
    let u: Vec<f64> = (0..model.dof_count()).map(|_| 0.05 * random()).collect();
    let (mut sparse, mut whole) = (Tangent::new(&model), Tangent::whole(&model));
    assert!(sparse.matrix.cholesky.factor_len() < whole.matrix.cholesky.factor_len());
    let inertia = vec![1e7; model.dof_count()];
    let b: Vec<f64> = sparse.dofs.iter().map(|_| random()).collect();
    for slack in [Slack::Exact, Slack::Regularised(1e-6), Slack::Taut] {
        let [x, y] = [&mut sparse, &mut whole].map(|tangent| {
            tangent.assemble(&model, &u, &model.start_history(), 0.7, slack);
            tangent.add_diagonal(&inertia, 1.0);
            tangent.factorise().expect("inertia holds everything");
            let mut x = b.clone();
            tangent.matrix.solve(&mut x);
            x
        });
        let size = y.iter().fold(0.0, |a, b| f64::max(a, b.abs()));
        let off = x.iter().zip(&y).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-10 * size, "{slack:?}: {off} of {size}");
    }
}

#[test]
fn a_post_that_falls_is_named_where_no_rest_shape_is_found() {
    // A post without ropes falls over, and 200 kg draw out a brake that gives way at 1 kN.
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [0.0, 1.0, 4.0], [9.0, 0.0, 0.0], [9.0, 0.0, -1.0]]
supports = [{ nodes = [0], rotations = "z" }, { nodes = [2] }]
masses = [{ nodes = [3], mass = 200.0 }]
[[structure.parts]]
name = "posts"
element = "beam"
cells = [[0, 1]]
young = 2.1e11
area = 5.4e-3
inertia = [2.5e-5, 9e-6]
torsion = 3e-7
density = 7850.0
[[structure.parts]]
name = "brake"
element = "brake"
cells = [[2, 3]]
stiffness = 1e6
curve = [[0.001, 1e3]]
mass = 1.0
"#;
    let fault = refusal(text);
    assert!(fault.0.contains("of posts") && fault.0.contains("it falls over"), "{}", fault.0);
    assert!(fault.1.contains("structure.generator.lean"), "{}", fault.1);
}

/// Message and hint with which a structure is refused.
fn refusal(text: &str) -> (String, String) {
    use interface_defs::solver::Solver;
    let outcome = solver(text).prepare(&Default::default(), &mut |_| Ok(()));
    let diagnostic = outcome.map(|_| ()).expect_err("it falls").diagnostic;
    (diagnostic.message.clone(), diagnostic.hint.clone().unwrap_or_default())
}

#[test]
fn the_search_for_a_rest_shape_says_what_it_does_and_can_be_stopped() {
    use fem_solver::config::structure::FormFinding;
    use fem_solver::equilibrium::form_finding::{Wanted, find_form};
    use fem_solver::equilibrium::newton::Failure;
    use interface_defs::message::Fault;
    // Upright posts fall: a search of a thousand iterations.
    let model = model(&line(3).replace("lean = ", "lean = 0.0 #"));
    let wanted = Wanted { model: &model, method: FormFinding::Static, most: None, basis: None };
    let mut count = 0;
    let stopped = find_form(wanted, &mut Newton::new(&model), &mut |_, _| {
        count += 1;
        if count == 300 { Err(Fault::interrupted()) } else { Ok(()) }
    });
    assert!(matches!(stopped, Err(Failure::Stopped(_))) && count == 300, "{count}");
}
