//! Rest shapes of what Newton alone does not bring to rest, each checked by another method.

use crate::common::{Run, scene};
use fem_solver::FemSolver;
use fem_solver::config::Config;
use fem_solver::config::structure::FormFinding;
use fem_solver::equilibrium::form_finding::{Wanted, find_form};
use fem_solver::equilibrium::newton::Newton;
use fem_solver::model::Model;
use interface_defs::field::Sampling;
use interface_defs::message::Plan;
use interface_defs::solver::Solver;
use toolkit::program::Options;

const YOUNG: f64 = 8.227864894e9;
const AREA: f64 = 1.256637061e-5;
const DENSITY: f64 = 7850.0;
const GRAVITY: f64 = 9.81;

/// A square net of 3 m whose cables are too long by `slack` of their length.
fn slack_net(cells: usize, slack: f64) -> String {
    format!(
        r#"
end_time = 0.1
gravity = [0.0, 0.0, {:?}]
[structure]
generator = {{ type = "rectangular_net", cells = [{cells}, {cells}], spacing = {:?} }}
cable = {{ young = {YOUNG:?}, area = {AREA:?}, density = {DENSITY:?}, prestress = {:?}, tension_only = true }}
"#,
        -GRAVITY,
        3.0 / cells as f64,
        -YOUNG * slack
    )
}

/// The potential energy of a net of cables that carry no compression is convex: where every node is in balance it is
/// least, and no other rest shape lies lower. The balance is summed up here from the places of the nodes alone.
#[test]
fn nets_of_cables_that_are_too_long_hang_in_balance() {
    for (cells, slack) in [(16, 0.05), (16, 0.07), (30, 0.05), (30, 0.07), (45, 0.06)] {
        let run = Run::alone(&slack_net(cells, slack), 1e-4);
        let at = |node: usize| -> [f64; 3] {
            run.ready.mesh.coordinates[3 * node..][..3].try_into().expect("three numbers")
        };
        let (side, rest) = (cells + 1, 3.0 / cells as f64);
        let (mut force, mut largest) = (vec![[0.0; 3]; side * side], 0.0_f64);
        let edge = |i: usize| i == 0 || i == cells;
        let node = |i: usize, j: usize| j * side + i;
        for i in 0..side {
            for j in 0..side {
                for (k, l) in [(i + 1, j), (i, j + 1)] {
                    if k > cells || l > cells {
                        continue;
                    }
                    let (a, b) = (node(i, j), node(k, l));
                    let d: [f64; 3] = std::array::from_fn(|c| at(b)[c] - at(a)[c]);
                    let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
                    let strain = (length * length / (rest * rest) - 1.0) / 2.0;
                    let pull = (AREA * YOUNG * (strain - slack) * length / rest).max(0.0);
                    largest = largest.max(pull);
                    for c in 0..3 {
                        force[a][c] += pull * d[c] / length;
                        force[b][c] -= pull * d[c] / length;
                    }
                    for n in [a, b] {
                        force[n][2] -= 0.5 * DENSITY * AREA * rest * GRAVITY;
                    }
                }
            }
        }
        assert!(largest > 1.0, "{cells} {slack}: nothing is taut");
        for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
            let f = force[node(i, j)];
            let left = f.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!(
                edge(i) || edge(j) || left < 1e-7 * largest,
                "{cells} {slack}: {left} N of {largest} left"
            );
        }
        let lowest = (0..side * side).map(|n| at(n)[2]).fold(0.0, f64::min);
        println!("{cells} cells, {slack}: sag {lowest:.4} m, largest force {largest:.2} N");
        assert!(lowest < -0.3, "{lowest}");
    }
}

/// A barrier of three fields of 10 m with rings of `10 / cells` m: posts of 4 m on hinged feet that lean by `degrees`.
pub fn barrier(degrees: f64, cells: usize, friction: f64, rest: &str, damping: f64) -> String {
    let cell = 10.0 / cells as f64;
    let rope = |name: &str| {
        format!(
            "[[structure.parts]]\nname = \"{name}\"\nelement = \"sliding_cable\"\nyoung = 1e11\narea = 2.4e-4\n\
             density = 7850.0\nprestress = 5e7\nfriction = {friction:?}\n"
        )
    };
    let brake = |name: &str, force: f64| {
        format!(
            "[[structure.parts]]\nname = \"{name}\"\nelement = \"brake\"\nstiffness = 5e6\n\
             curve = [[0.03, {force:?}], [1.6, {:?}]]\nstroke = 1.4\nmass = 15.0\n",
            1.2 * force
        )
    };
    format!(
        r#"
end_time = 100.0
gravity = [0.0, 0.0, {:?}]
[structure]
form_finding = "{rest}"
damping = {damping:?}
supports = [{{ group = "feet", rotations = "z" }}, {{ group = "anchors" }}]
[structure.generator]
type = "barrier"
height = 4.0
net = "rings"
cells = [{cells}, {}]
anchor_rise = 0.0
lean = {:?}
[structure.cable]
young = 1e11
area = 2.4e-4
density = 7850.0
{}{}{}{}
[[structure.parts]]
name = "net"
element = "ring"
diameter = {cell:?}
perimeter = {:?}
perimeter_stiffness = 8e6
bending_stiffness = 1e5
mass = {:?}
[[structure.parts]]
name = "side_ropes"
element = "cable"
prestress = 5e7
[[structure.parts]]
name = "posts"
element = "beam"
young = 2.1e11
area = 5.4e-3
inertia = [2.5e-5, 9e-6]
torsion = 3e-7
density = 7850.0
"#,
        -GRAVITY,
        2 * cells / 5,
        4.0 * f64::to_radians(degrees).sin(),
        rope("top_rope"),
        rope("bottom_rope"),
        brake("rope_brakes", 1.2e5),
        brake("upslope_brakes", 7e4),
        2.82 * cell,
        1.89 * cell,
    )
}

/// An explicit run that begins there stays there, and the supports carry all the weight: neither knows of tangents.
#[test]
#[ignore = "long"]
fn a_ring_barrier_comes_to_rest_at_every_lean() {
    for cells in [10, 15, 20] {
        for degrees in [0.0, 5.0, 10.0, 20.0, 30.0] {
            for friction in [0.0, 0.2] {
                let begun = std::time::Instant::now();
                // Shortcuts would leave out what rests.
                let text = barrier(degrees, cells, friction, "static", 0.0);
                let solver = FemSolver::new(&scene(&text), &Options { out: None, shortcuts: false });
                let plan = Plan { end_time: 1.0, window: 1e-2, ..Plan::default() };
                let mut run = Run::of(solver.unwrap_or_else(|e| panic!("{e}")), plan);
                let took = begun.elapsed().as_secs_f64();
                let weight = GRAVITY * run.solver.model().mass.iter().sum::<f64>();
                let carried = run.value("reaction_z");
                let sag = run.measure("sag");
                let before = run.ready.mesh.coordinates.clone();
                (0..5).for_each(|_| run.step(1e-2, &[]));
                let energy = run.value("energy_kinetic_fem");
                println!(
                    "{cells} cells, {degrees} degrees, friction {friction}: {took:.2} s, lowest {sag:.4} m, moves with {energy:.1e} J, {} values",
                    before.len()
                );
                let what = format!("{cells} cells, {degrees} degrees, friction {friction}");
                assert!((carried / weight - 1.0).abs() < 1e-6, "{what}: {carried} N of {weight} N");
                // Where a node has run up to the head of a post, its short segment is softer under friction: the rope
                // creeps to its place there.
                let least = if friction > 0.0 { 1e-3 } else { 1e-9 };
                assert!(energy < least, "{what}: {energy} J");
            }
        }
    }
}

/// Fields of 10 m in 15 x 6 cells, rings as large as their diagonals; half as many rings as cells.
#[test]
fn a_barrier_of_rings_in_rows_at_45_degrees_comes_to_rest() {
    let cell = 10.0 / 15.0;
    let own = barrier(20.0, 15, 0.0, "static", 0.0);
    let own = own.replace("net = \"rings\"", "net = \"diagonal_rings\"");
    let (head, tail) = own.split_once("element = \"ring\"").expect("a ring");
    let (_, tail) = tail.split_once("[[structure.parts]]").expect("more parts");
    let diameter = cell * 2.0_f64.sqrt() * 1.02;
    let ring = format!(
        "element = \"wire_ring\"\nturns = 12\nwire_diameter = 3e-3\ndiameter = {diameter:?}\nstrength = 1.77e9\n"
    );
    let mut run = Run::alone(&format!("{head}{ring}[[structure.parts]]{tail}"), 1e-2);
    let rings = run.solver.model().elements.len();
    assert!(rings > 45 * 6 / 2, "{rings}");
    let weight = GRAVITY * run.solver.model().mass.iter().sum::<f64>();
    let carried = run.value("reaction_z");
    assert!((carried / weight - 1.0).abs() < 1e-3, "{carried} N of {weight} N");
    (0..5).for_each(|_| run.step(1e-2, &[]));
    let energy = run.value("energy_kinetic_fem");
    println!("moves with {energy:.1e} J");
    assert!(energy < 1e-6, "{energy} J");
}

/// Where posts stand and where they fall over, the barrier let go as modelled comes to the same place in time.
#[test]
#[ignore = "long"]
fn a_barrier_that_falls_and_swings_with_damping_ends_in_the_same_rest_shape() {
    for degrees in [0.0, 30.0] {
        let found = Run::alone(&barrier(degrees, 10, 0.0, "static", 0.0), 1e-2);
        let text = barrier(degrees, 10, 0.0, "none", 1.0);
        let mut let_go = Run::coupled(&text, 1e-2, Sampling::Means);
        let (model, rest) = (let_go.solver.model(), &found.ready.mesh.coordinates);
        let nodes = model.nodes.clone();
        let posts: Vec<usize> = (0..nodes.len()).filter(|node| model.rotation(*node, 0).is_some()).collect();
        let farthest = |run: &Run, of: &[usize]| {
            let away = of.iter().map(|node| {
                let u = run.displacement(*node);
                let off = (0..3).map(|c| nodes[*node][c] + u[c] - rest[3 * node + c]);
                (off.map(|x| x * x).sum::<f64>().sqrt(), *node)
            });
            away.fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a })
        };
        let energy = |run: &Run| run.value("energy_stored_fem") + run.value("energy_potential_fem");
        let_go.step(1e-3, &[]);
        let (first, begin) = (farthest(&let_go, &posts), energy(&let_go));
        while let_go.time < 16.0 {
            let_go.step(1e-2, &[]);
        }
        let (left, end, least) = (farthest(&let_go, &posts), energy(&let_go), energy(&found));
        println!(
            "{degrees} degrees: posts {:.3} m away at first, {:.2e} m in the end; energy {begin:.4} J, {end:.4} J, found {least:.4} J",
            first.0, left.0
        );
        assert!(left.0 < 5e-3 && first.0 > 5.0 * left.0, "{degrees}: {left:?} m of {first:?}");
        // Rings and brakes that yielded in the fall let the net hang lower.
        let fall = begin - least;
        assert!(
            (end - least).abs() < 1e-2 * begin.abs().max(fall),
            "{degrees}: {end} J, {least} J, {fall} J"
        );
    }
}

#[test]
fn form_finding_obeys_max_iterations() {
    let scene = scene(&slack_net(8, 0.0).replace("prestress = -0.0", "prestress = 1e6"));
    let config = Config::of(&scene).unwrap_or_else(|e| panic!("{e}"));
    let model = Model::build(&scene, &config).unwrap_or_else(|e| panic!("{e}"));
    let find = |most: Option<u32>| {
        let mut ends = Vec::new();
        let wanted = Wanted { model: &model, method: FormFinding::Static, most, basis: None };
        let (form, info) = find_form(wanted, &mut Newton::new(&model), &mut |n, _| {
            ends.push(n);
            Ok(())
        })
        .unwrap_or_else(|e| panic!("{e:?}"));
        assert!(ends.iter().enumerate().all(|(i, n)| *n == i as u64 + 1), "{ends:?}");
        assert_eq!(info.iterations, ends.len() as u64);
        (form.displacement, info.iterations)
    };
    let (by_newton, count) = find(None);
    assert!(count > 3 && count < 30, "{count}");
    // Two are not enough from the structure as modelled: it swings, and two are enough from near by.
    let (by_swinging, more) = find(Some(2));
    assert!(more > count, "{more} {count}");
    let off = by_newton.iter().zip(&by_swinging).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-9, "{off}");
    assert_eq!(find(Some(count as u32)), (by_newton, count));
}

#[test]
fn what_moves_for_ever_is_named() {
    // The brake gives way at 1 kN, and 200 kg hang on it.
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
supports = [{ nodes = [0] }]
masses = [{ nodes = [1], mass = 200.0 }]
[[structure.parts]]
name = "brake"
element = "brake"
cells = [[0, 1]]
stiffness = 1e6
curve = [[0.001, 1e3]]
mass = 1.0
"#;
    let mut solver = FemSolver::new(&scene(text), &Options { out: None, shortcuts: true }).unwrap();
    let message = solver
        .prepare(&Default::default(), &mut |_| Ok(()))
        .map(|_| ())
        .expect_err("it falls")
        .diagnostic
        .message;
    assert!(message.contains("does not come to rest: node 1"), "{message}");
}
