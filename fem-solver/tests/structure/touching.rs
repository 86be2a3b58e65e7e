//! Lines of the structure that touch each other: beams across each other, a rope round a peg, rings that pull at each other.

use crate::common::{Run, coupled_plan, off, random, solver};
use crate::loads::refused;
use interface_defs::Sampling;
use interface_defs::field::name;
use std::f64::consts::PI;

#[test]
#[ignore = "long"]
fn two_beams_across_each_other_share_a_force_as_springs_in_a_row_wherever_their_nodes_lie() {
    // Simply supported, L = 1 m, E I = 1 kN m2; the upper one is lowered by 2 mm. They cross at a node of both, of one, of none.
    let (length, bending, stiffness, lowered) = (1.0, 1e3, 1e6, 2e-3);
    for (lower, upper) in [(16, 16), (16, 17), (17, 17)] {
        let (mut nodes, mut parts, mut supports) = (Vec::new(), String::new(), String::new());
        for (name, count, z) in [("lower", lower, 0.0), ("upper", upper, 0.02)] {
            let first = nodes.len();
            nodes.extend((0..=count).map(|i| {
                let x = length * (f64::from(i) / f64::from(count) - 0.5);
                if z > 0.0 { [0.0, x, z] } else { [x, 0.0, z] }
            }));
            let cells: Vec<_> = (first + 1..nodes.len()).map(|node| [node - 1, node]).collect();
            parts += &format!(
                "[[structure.parts]]\nname = \"{name}\"\nelement = \"beam\"\ncells = {cells:?}\nradius = 0.01\nyoung = 1e9\n\
                 area = 1e-3\ninertia = [1e-6, 1e-6]\ndensity = 1000.0\n"
            );
            let down = if z > 0.0 { lowered } else { 0.0 };
            let ends = [first, nodes.len() - 1];
            supports += &format!(
                "[[structure.supports]]\nnodes = {ends:?}\nrotations = \"{}\"\nmotion = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, {:?}]]\n",
                if z > 0.0 { "y" } else { "x" },
                -down
            );
        }
        let text = format!(
            "end_time = 2.0\n[structure]\nnodes = {nodes:?}\ndamping = 30.0\nform_finding = \"none\"\n{supports}[structure.contact]\n\
             parts = [\"lower\", \"upper\"]\nstiffness = {stiffness:?}\n{parts}[[gauge]]\nname = \"pushed\"\nat = [-0.5, 0.0, 0.0]\n\
             quantity = \"force\"\n"
        );
        let mut run = Run::alone(&text, 0.01);
        (0..200).for_each(|_| run.step(0.01, &[]));
        // Between two nodes the force acts on both, and they say how far it goes.
        let soft = |count: u32| {
            let apart = if count.is_multiple_of(2) { 0.0 } else { length / f64::from(count) };
            let arm = 0.5 * (length - apart);
            arm * arm * (3.0 * length - 4.0 * arm) / (12.0 * bending)
        };
        let force = lowered / (1.0 / stiffness + soft(lower) + soft(upper));
        let pushed = 2.0 * run.value("pushed_fz").abs();
        assert!(off(pushed, force) < 2e-3, "{lower} {upper}: {pushed} N, {force} N");
        assert!(run.balance().abs() < 1e-3 * force * lowered, "{} J", run.balance());
    }
}

/// A rope of cables over a peg of 0.1 m that it touches over `PI`: 100 N at one end, the other drawn down.
fn over_a_peg(friction: f64) -> f64 {
    // Around the peg, not a circle through it.
    let (around, straight, radius) = (40_u32, 12_u32, 0.102 / (PI / 80.0).cos());
    let step = radius * PI / 40.0;
    let mut nodes: Vec<[f64; 3]> = Vec::new();
    nodes.extend((0..straight).map(|i| [-radius, 0.0, -step * f64::from(straight - i)]));
    nodes.extend((0..=around).map(|i| PI * f64::from(i) / f64::from(around)).map(|a| {
        let (s, c) = a.sin_cos();
        [-radius * c, 0.0, radius * s]
    }));
    nodes.extend((1..=straight).map(|i| [radius, 0.0, -step * f64::from(i)]));
    let last = nodes.len() - 1;
    let cells: Vec<_> = (1..nodes.len()).map(|node| [node - 1, node]).collect();
    let end = nodes[last];
    nodes.extend([[0.0, -0.2, 0.0], [0.0, 0.2, 0.0]]);
    let text = format!(
        "end_time = 0.5\n[structure]\nnodes = {nodes:?}\ndamping = 1000.0\nform_finding = \"none\"\n\
         loads = [{{ nodes = [0], force = [0.0, 0.0, -100.0], history = [[0.0, 0.0], [0.1, 1.0]] }}]\n\
         supports = [{{ nodes = [{}, {}] }}, {{ nodes = [{last}], directions = \"xyz\", motion = [[0.1, 0.0, 0.0, 0.0], \
         [0.5, 0.0, 0.0, -0.006]] }}]\n[structure.contact]\nparts = [\"rope\", \"peg\"]\nstiffness = 1e6\nfriction = {friction:?}\n\
         [[structure.parts]]\nname = \"rope\"\nelement = \"cable\"\ncells = {cells:?}\nradius = 2e-3\nyoung = 1e10\narea = 1e-5\n\
         density = 5e3\n[[structure.parts]]\nname = \"peg\"\nelement = \"cable\"\ncells = [[{}, {}]]\nradius = 0.1\nyoung = 1e9\n\
         area = 1e-4\ndensity = 1e4\n[[gauge]]\nname = \"drawn\"\nat = {end:?}\nquantity = \"force\"\n",
        last + 1,
        last + 2,
        last + 1,
        last + 2
    );
    let (mut run, mut mean) = (Run::alone(&text, 1e-3), 0.0);
    for window in 0..500 {
        run.step(1e-3, &[]);
        mean += if window >= 300 { run.value("drawn_fz").abs() / 200.0 } else { 0.0 };
    }
    let work = run.value("energy_supports_fem").abs();
    let missed = run.balance();
    assert!(missed.abs() < 0.02 * work, "{missed} J of {work} J, {mean} N");
    mean
}

#[test]
#[ignore = "long"]
fn a_rope_round_a_peg_holds_as_the_capstan_does() {
    for friction in [0.0, 0.1, 0.2] {
        let (drawn, exact) = (over_a_peg(friction), 100.0 * (friction * PI).exp());
        assert!(off(drawn, exact) < 0.03, "{friction}: {drawn} N, {exact} N");
    }
}

/// Two linked rings of 16 elastic beams in planes across each other, thrown apart and aside.
fn linked(friction: f64) -> String {
    let ring = |x: f64, upright: bool| {
        (0..16).map(move |i| (PI * f64::from(i) / 8.0).sin_cos()).map(move |(s, c)| {
            let [s, c] = [0.15 * s, 0.15 * c];
            if upright { [x + c, 0.01, s] } else { [x + c, s, 0.0] }
        })
    };
    let nodes: Vec<[f64; 3]> = ring(0.0, false).chain(ring(0.27, true)).collect();
    let cells: Vec<_> = (0..32).map(|i| [i, if i % 16 == 15 { i - 15 } else { i + 1 }]).collect();
    let groups = [(0..16).collect::<Vec<_>>(), (16..32).collect()];
    format!(
        "end_time = 0.1\n[structure]\nnodes = {nodes:?}\nform_finding = \"none\"\n\
         velocities = [{{ nodes = {:?}, velocity = [-2.0, 0.5, 0.0] }}, {{ nodes = {:?}, velocity = [3.0, 0.0, 1.0] }}]\n\
         [structure.contact]\nparts = [\"rings\"]\nstiffness = 1e6\nfriction = {friction:?}\n[[structure.parts]]\nname = \"rings\"\n\
         element = \"beam\"\ncells = {cells:?}\nradius = 4e-3\nsection = \"WIRES 7x3\"\nyoung = 1.5e11\ndensity = 7850.0\n",
        groups[0], groups[1]
    )
}

#[test]
fn rings_that_pull_at_each_other_keep_their_momentum_and_the_books_their_energy() {
    for friction in [0.0, 0.3] {
        let mut run = Run::with(&linked(friction), coupled_plan(1e-3, Sampling::Means, 1, 1));
        let momentum = |run: &Run| {
            let at = run.layout.last(name::VELOCITY, Sampling::AtEnds).expect("is in the plan");
            let masses = &run.ready.mesh.masses;
            [0, 1, 2].map(|c| {
                masses.iter().enumerate().map(|(i, m)| m * run.output[at.start + 3 * i + c]).sum::<f64>()
            })
        };
        let (before, kinetic) = (momentum(&run), run.value("energy_kinetic_fem"));
        let (mut touched, mut noise, books) = (0.0_f64, random(3), run.balance());
        for _ in 0..60 {
            // What a window answers depends on its start alone.
            run.solve(1e-3, &[]).expect("solved");
            let first = run.output.clone();
            let push: Vec<f64> = (0..run.force_len).map(|_| 100.0 * noise()).collect();
            run.solve(1e-3, &push).expect("solved");
            run.step(1e-3, &[]);
            assert!(first.iter().zip(&run.output).all(|(a, b)| a.to_bits() == b.to_bits()));
            touched = touched.max(run.value("energy_stored_fem"));
        }
        let after = momentum(&run);
        let size = before.iter().map(|p| p.abs()).sum::<f64>();
        assert!(before.iter().zip(after).all(|(a, b)| (a - b).abs() < 1e-10 * size), "{before:?} {after:?}");
        assert!(touched > 0.1 * kinetic, "{touched} J of {kinetic} J");
        let missed = run.balance() - books;
        assert!(missed.abs() < 5e-3 * kinetic, "{missed} J of {kinetic} J");
        assert_eq!(run.value("energy_dissipated_fem") > 1e-3 * kinetic, friction > 0.0);
    }
}

#[test]
fn what_cannot_touch_is_refused_where_it_stands() {
    let good = linked(0.3);
    solver(&good);
    for (from, to, words) in [
        ("[\"rings\"]\nstiffness", "[\"ring\"]\nstiffness", "there is no part `ring`"),
        ("stiffness = 1e6", "stiffness = 0.0", "it must lie above 0"),
        ("friction = 0.3", "friction = -0.3", "friction"),
        ("radius = 4e-3\n", "", "have no radius"),
        ("form_finding = \"none\"", "", "form finding knows nothing"),
        ("end_time", "fem = { integrator = \"static\" }\nend_time", "in explicit steps alone"),
    ] {
        let message = refused(&good.replacen(from, to, 1));
        assert!(message.contains(words), "{words}: {message}");
    }
}
