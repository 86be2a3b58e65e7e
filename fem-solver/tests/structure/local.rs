//! What the structure tells a contact solver that moves nodes itself: force, rate and tangent near selected nodes.

use crate::common::{Run, random};
use interface_defs::diagnostic::code;
use interface_defs::field::{FieldSpec, Items, Layout, Place, Sampling, name};
use interface_defs::message::Plan;
use interface_defs::selection::Selection;
use interface_defs::solver::Solver;

/// Nodes along a side of the grid.
const SIDE: usize = 5;
const ALL: usize = SIDE * SIDE;
/// Step and window: so short that differences in time are derivatives.
const STEP: f64 = 1e-6;

const EXPLICIT: (&str, Sampling) = ("time_step = 1e-6", Sampling::Means);
const MIDPOINT: (&str, Sampling) =
    ("integrator = \"generalized_alpha\"\ntime_step = 1e-6\nnewton = { tolerance = 1e-13 }", Sampling::Means);
const BOSSAK: (&str, Sampling) =
    ("integrator = \"bossak\"\ntime_step = 1e-6\nnewton = { tolerance = 1e-13 }", Sampling::AtEnds);

const BARS: &str =
    "name = \"bars\"\nelement = \"cable\"\nrupture_force = 1e6\ncells = [[6, 12], [12, 18], [7, 11]]";
const RINGS: &str = "name = \"rings\"\nelement = \"ring\"\ndiameter = 0.25\nperimeter = 0.7999\nperimeter_stiffness = 1e5\n\
                     bending_stiffness = 1e4\nmass = 0.5\ncells = [[6, 7, 12, 11], [7, 8, 13, 12], [11, 12, 17, 16]]";
const WIRE_RINGS: &str = "name = \"rings\"\nelement = \"wire_ring\"\ndiameter = 0.26\nturns = 3\nwire_diameter = 2e-3\n\
                          cells = [[6, 7, 12, 11], [7, 8, 13, 12], [11, 12, 17, 16]]";
const ROPE: &str = "name = \"rope\"\nelement = \"sliding_cable\"\nyoung = 1e10\narea = 2e-5\ndensity = 7850.0\n\
                    prestress = 1e7\ncells = [[1, 6, 11, 12, 13, 18, 23]]";
const LOOP: &str = "name = \"loop\"\nelement = \"sliding_cable\"\nyoung = 1e10\narea = 2e-5\ndensity = 7850.0\n\
                    prestress = 1e7\ncells = [[6, 7, 12, 11, 6]]";
const BRAKE: &str = "name = \"brake\"\nelement = \"brake\"\nstiffness = 1e6\ncurve = [[1e-4, 2.0], [0.5, 1e4]]\n\
                     cells = [[6, 7], [7, 12], [12, 18], [8, 13], [11, 17]]";
const RUBBING: &str = "name = \"rope\"\nelement = \"sliding_cable\"\nyoung = 1e10\narea = 2e-5\ndensity = 7850.0\n\
                       prestress = 1e7\nfriction = 0.2\ncells = [[1, 6, 11, 12, 13, 18, 23]]";
const MEMBRANE: &str = "name = \"skin\"\nelement = \"membrane\"\nyoung = [1e8]\npoisson = 0.3\nthickness = 1e-3\n\
                        density = 1000.0\nwrinkles = false\ncells = [[6, 7, 12], [6, 12, 11], [7, 8, 13], [7, 13, 12]]";
const SHELL: &str = "name = \"plate\"\nelement = \"shell\"\nyoung = 1e8\npoisson = 0.3\nthickness = 5e-3\n\
                     density = 1000.0\ncells = [[6, 7, 12], [6, 12, 11], [7, 8, 13], [7, 13, 12]]";

/// A prestressed net that moves, of 5 x 5 nodes with its edges held, one node of them in a direction alone; `part` is in it.
fn grid(part: &str, more: &str, fem: &str) -> String {
    let nodes: Vec<[f64; 3]> = (0..ALL)
        .map(|i| [0.2 * (i % SIDE) as f64, 0.2 * (i / SIDE) as f64, 0.01 * (i as f64).sin()])
        .collect();
    let on_edge = |i: &usize| [0, SIDE - 1].contains(&(i % SIDE)) || [0, SIDE - 1].contains(&(i / SIDE));
    let edges: Vec<usize> = (0..ALL).filter(on_edge).filter(|i| *i != 2).collect();
    let inside: Vec<usize> = (0..ALL).filter(|i| !on_edge(i)).collect();
    let mut cables: Vec<String> = Vec::new();
    let between = |a: usize, b: usize| format!("{{ nodes = [{a}, {b}] }}");
    for i in 0..ALL {
        cables.extend((i % SIDE < SIDE - 1).then(|| between(i, i + 1)));
        cables.extend((i / SIDE < SIDE - 1).then(|| between(i + SIDE, i)));
    }
    let velocities: Vec<String> = inside
        .iter()
        .map(|i| {
            let v = [0.5, 1.1, 1.7].map(|c| (c * *i as f64).sin());
            format!("{{ nodes = [{i}], velocity = {v:?} }}")
        })
        .collect();
    let part = if part.is_empty() { String::new() } else { format!("[[structure.parts]]\n{part}") };
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
nodes = {nodes:?}
cables = [{}]
form_finding = "none"
damping = 15.0
velocities = [{}]
supports = [{{ nodes = {edges:?} }}, {{ nodes = [2], directions = "y" }}]
{more}
cable = {{ young = 8e9, area = 1.2e-5, density = 7850.0, prestress = 1e7 }}
{part}
[fem]
{fem}
"#,
        cables.join(", "),
        velocities.join(", ")
    )
}

fn plan(sampling: Sampling) -> Plan {
    let once =
        |name, components, place| FieldSpec { place, ..FieldSpec::nodal(name, components, Sampling::Once) };
    Plan {
        end_time: 1.0,
        window: STEP,
        takes: vec![FieldSpec::nodal(name::FORCE, 3, sampling)],
        gives: vec![
            FieldSpec::nodal(name::DISPLACEMENT, 3, Sampling::AtEnds),
            FieldSpec::nodal(name::VELOCITY, 3, Sampling::AtEnds),
            once(name::LOCAL_TANGENT, 9, Place::Pair),
            once(name::LOCAL_FORCE, 3, Place::Node),
            once(name::LOCAL_DAMPING, 1, Place::Whole),
            once(name::LOCAL_FORCE_RATE, 3, Place::Node),
        ],
        ..Plan::default()
    }
}

/// A structure of which some nodes are selected.
struct Near {
    run: Run,
    selection: Selection,
    layout: Layout,
}

impl Near {
    /// With all nodes selected.
    fn new(text: &str, sampling: Sampling) -> Self {
        let run = Run::with(text, plan(sampling));
        let selection = Selection::new(&run.ready.mesh);
        let layout = Layout::new(&plan(sampling).gives, &run.ready.mesh, run.ready.gauges.len());
        let mut near = Self { run, selection, layout };
        near.select(&(0..ALL as u32).collect::<Vec<_>>());
        near
    }

    fn select(&mut self, nodes: &[u32]) {
        self.selection.set(&self.run.ready.mesh, nodes.iter().copied()).expect("nodes of the mesh");
        self.run.solver.select(Some(&mut self.selection)).expect("selects");
        self.layout.resize(&self.selection.items());
        self.run.output = vec![f64::NAN; self.layout.len()];
        self.run.solver.committed(&mut self.run.output).expect("is prepared");
    }

    fn solve(&mut self, force: &[f64]) {
        self.run.solve(STEP, force).unwrap_or_else(|e| panic!("{e}"));
    }

    /// A window without force.
    fn step(&mut self) {
        self.solve(&[]);
        self.run.commit(STEP);
    }

    /// The local force without mass-proportional damping, which goes with the velocity.
    fn undamped(&self) -> Vec<f64> {
        let (force, velocity) = (self.field(name::LOCAL_FORCE), self.field(name::VELOCITY));
        let (alpha, masses) = (self.field(name::LOCAL_DAMPING)[0], &self.run.ready.mesh.masses);
        let damped = |i: usize| {
            if masses[i / 3].is_finite() && force[i] != 0.0 {
                alpha * masses[i / 3] * velocity[i]
            } else {
                0.0
            }
        };
        (0..force.len()).map(|i| force[i] + damped(i)).collect()
    }

    fn field(&self, field: &str) -> Vec<f64> {
        let at = self.layout.sample(field, Sampling::Once, 0);
        let at = at.or_else(|| self.layout.last(field, Sampling::AtEnds)).expect("is in the plan");
        self.run.output[at].to_vec()
    }

    /// The tangent times a vector over the selected nodes.
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for ([i, j], block) in self.pairs() {
            for r in 0..3 {
                for c in 0..3 {
                    product[3 * i + r] += block[3 * r + c] * x[3 * j + c];
                    if i != j {
                        product[3 * j + c] += block[3 * r + c] * x[3 * i + r];
                    }
                }
            }
        }
        product
    }

    fn pairs(&self) -> Vec<([usize; 2], Vec<f64>)> {
        let blocks = self.field(name::LOCAL_TANGENT);
        let pairs = self.selection.pairs.iter().map(|pair| pair.map(|place| place as usize));
        pairs.zip(blocks.chunks(9).map(<[f64]>::to_vec)).collect()
    }
}

fn largest(of: &[f64]) -> f64 {
    of.iter().fold(0.0, |most, x| x.abs().max(most))
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[track_caller]
fn near(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    let (off, size) = (largest(&minus(a, b)), largest(b));
    assert!(size > 0.0 && off <= tolerance * size, "{what}: {off:.3e} off of {size:.3e}");
}

/// Springs and a dashpot at nodes.
const GROUND: &str = "springs = [{ nodes = [12, 13], stiffness = [3e4, 2e4, 1e4] }]\n\
                      dampers = [{ nodes = [12], viscosity = [5.0, 0.0, 8.0] }]";

#[test]
fn the_tangent_is_the_change_of_the_force_with_the_displacement() {
    let cases = ["", BARS, RINGS, WIRE_RINGS, BRAKE, ROPE, LOOP, MEMBRANE].map(|part| (part, EXPLICIT));
    let implicit = ["", RINGS, WIRE_RINGS, BRAKE, ROPE, MEMBRANE]
        .into_iter()
        .flat_map(|part| [(part, MIDPOINT), (part, BOSSAK)]);
    for (part, (fem, sampling)) in cases.into_iter().chain(implicit) {
        let text = grid(part, "springs = [{ nodes = [12, 13], stiffness = [3e4, 2e4, 1e4] }]", fem);
        let mut structure = Near::new(&text, sampling);
        (0..200).for_each(|_| structure.step());
        for seed in 0..3 {
            let mut noise = random(seed);
            let push: Vec<f64> = (0..3 * ALL).map(|_| 200.0 * noise()).collect();
            let mut pushed = |sign: f64| {
                structure.solve(&push.iter().map(|f| sign * f).collect::<Vec<_>>());
                [structure.undamped(), structure.field(name::DISPLACEMENT)]
            };
            let ([above, far], [below, back]) = (pushed(1.0), pushed(-1.0));
            structure.solve(&[]);
            let expected = structure.times(&minus(&far, &back));
            near(&minus(&below, &above), &expected, 1e-6, &format!("{part} {fem}"));
        }
    }
}

#[test]
fn the_rate_is_the_change_of_the_force_with_time() {
    for part in ["", BARS, RINGS, WIRE_RINGS, BRAKE, ROPE, RUBBING, MEMBRANE, SHELL] {
        for (fem, sampling) in [EXPLICIT, MIDPOINT] {
            let springs = "springs = [{ nodes = [12, 13], stiffness = [3e4, 2e4, 1e4] }]";
            let mut structure = Near::new(&grid(part, springs, fem), sampling);
            (0..100).for_each(|_| structure.step());
            let before = structure.undamped();
            structure.step();
            let rate = structure.field(name::LOCAL_FORCE_RATE);
            structure.step();
            let after = structure.undamped();
            let slope: Vec<f64> = minus(&after, &before).iter().map(|f| f / (2.0 * STEP)).collect();
            near(&rate, &slope, 1e-4, &format!("{part} {fem}"));
        }
    }
}

#[test]
fn the_force_is_what_accelerates_a_node_beside_the_interface_force() {
    let loads = "loads = [{ nodes = [12], force = [300.0, 0.0, 0.0], history = [[0.0, 0.0], [1e-3, 5.0]] }]\n\
                 pressures = [{ group = \"skin\", pressure = 1e4, history = [[0.0, 0.5], [0.001, 1.0]] }]";
    for (part, more) in [("", ""), ("", GROUND), (RINGS, GROUND), (MEMBRANE, loads), (SHELL, GROUND)] {
        for scaling in ["", "\nmass_scaling = 2e-4"] {
            for (fem, sampling) in [EXPLICIT, MIDPOINT, BOSSAK] {
                if !scaling.is_empty() && fem != EXPLICIT.0 {
                    continue;
                }
                let mut structure = Near::new(&grid(part, more, &format!("{fem}{scaling}")), sampling);
                (0..100).for_each(|_| structure.step());
                let masses = structure.run.ready.mesh.masses.clone();
                let sampled = |s: &Near| [s.field(name::LOCAL_FORCE), s.field(name::VELOCITY)];
                let mut noise = random(5);
                let push: Vec<f64> = (0..3 * ALL).map(|_| 20.0 * noise()).collect();
                // A scheme that takes its acceleration at several instants has forgotten then that the force is new.
                for _ in 0..30 {
                    structure.solve(&push);
                    structure.run.commit(STEP);
                }
                let [fa, va] = sampled(&structure);
                structure.solve(&push);
                let [fb, vb] = sampled(&structure);
                let alpha = structure.field(name::LOCAL_DAMPING)[0];
                assert_eq!(alpha, 15.0);
                let (mut expected, mut found) = (Vec::new(), Vec::new());
                for i in (0..3 * ALL).filter(|i| masses[i / 3].is_finite() && *i != 3 * 2 + 1) {
                    let mean = 0.5 * (fa[i] + fb[i]) + push[i];
                    expected.push(mean / masses[i / 3]);
                    found.push((vb[i] - va[i]) / STEP);
                }
                near(&found, &expected, 2e-3, &format!("{part} {more} {fem} {scaling}"));
                let held: Vec<f64> =
                    (0..3 * ALL).filter(|i| !masses[i / 3].is_finite()).map(|i| fb[i]).collect();
                assert!(held.len() == 45 && held.iter().all(|f| *f == 0.0) && fb[3 * 2 + 1] == 0.0);
            }
        }
    }
}

#[test]
fn a_part_of_the_nodes_has_the_numbers_of_all_bit_for_bit() {
    for part in ["", BARS, RINGS, WIRE_RINGS, ROPE, LOOP, RUBBING, MEMBRANE, SHELL] {
        let mut structure = Near::new(&grid(part, GROUND, EXPLICIT.0), EXPLICIT.1);
        (0..20).for_each(|_| structure.step());
        let everything: Vec<u32> = (0..ALL as u32).collect();
        for nodes in [vec![6, 7, 12, 13], vec![2, 7, 11, 24], vec![12], everything.clone()] {
            structure.select(&everything);
            let (pairs, force) = (structure.pairs(), structure.field(name::LOCAL_FORCE));
            let rate = structure.field(name::LOCAL_FORCE_RATE);
            structure.select(&nodes);
            let of = |all: &[f64]| -> Vec<f64> {
                nodes.iter().flat_map(|n| &all[3 * *n as usize..][..3]).copied().collect()
            };
            assert_eq!(structure.field(name::LOCAL_FORCE), of(&force), "{part} {nodes:?}");
            assert_eq!(structure.field(name::LOCAL_FORCE_RATE), of(&rate), "{part} {nodes:?}");
            let place = |node: usize| nodes.iter().position(|n| *n as usize == node);
            let selected =
                pairs.into_iter().filter_map(|([i, j], block)| Some(([place(i)?, place(j)?], block)));
            assert_eq!(structure.pairs(), selected.collect::<Vec<_>>(), "{part} {nodes:?}");
            // A window's answer ends with the state that is committed then.
            structure.solve(&[]);
            let answer = structure.run.output.clone();
            structure.run.commit(STEP);
            structure.run.solver.committed(&mut structure.run.output).expect("is prepared");
            assert_eq!(structure.run.output, answer);
        }
        // All nodes without a selection: the same forces, and no pairs.
        structure.select(&everything);
        let (force, rate) = (structure.field(name::LOCAL_FORCE), structure.field(name::LOCAL_FORCE_RATE));
        structure.run.solver.select(None).expect("selects");
        structure.layout.resize(&Items::of(&structure.run.ready.mesh));
        structure.run.output = vec![f64::NAN; structure.layout.len()];
        structure.run.solver.committed(&mut structure.run.output).expect("is prepared");
        assert_eq!(structure.field(name::LOCAL_FORCE), force);
        assert_eq!(structure.field(name::LOCAL_FORCE_RATE), rate);
        assert!(structure.field(name::LOCAL_TANGENT).is_empty());
    }
}

#[test]
fn a_rope_couples_all_of_its_nodes_and_a_net_its_neighbours() {
    let count = |part: &str, nodes: &[u32]| {
        let mut structure = Near::new(&grid(part, "", EXPLICIT.0), EXPLICIT.1);
        structure.select(nodes);
        structure.selection.pairs.clone()
    };
    assert_eq!(count("", &[6, 7, 13]), [[0, 0], [0, 1], [1, 1], [2, 2]]);
    assert_eq!(count(ROPE, &[6, 7, 13]), [[0, 0], [0, 1], [0, 2], [1, 1], [2, 2]]);
    assert_eq!(count(ROPE, &[6, 13, 23]).len(), 6);
    assert_eq!(count(MEMBRANE, &[6, 12]), [[0, 0], [0, 1], [1, 1]]);
}

#[test]
fn what_is_torn_is_stiff_no_more() {
    let part = BARS.replace("1e6", "2e3");
    let mut structure = Near::new(&grid(&part, "", EXPLICIT.0), EXPLICIT.1);
    let block = |structure: &Near| {
        let pairs = structure.pairs();
        pairs.into_iter().find(|(pair, _)| *pair == [6, 12]).expect("are coupled").1
    };
    assert!(largest(&block(&structure)) > 1e3);
    let mut force = vec![0.0; 3 * ALL];
    (force[3 * 12], force[3 * 12 + 1]) = (5e4, 5e4);
    for _ in 0..1000 {
        structure.solve(&force);
        structure.run.commit(STEP);
    }
    let told = structure.run.solver.finish().expect("is prepared").warnings;
    assert!(told.iter().any(|w| w.code == code::RUPTURE && w.message.contains("(0.2 0.2")), "{told:?}");
    assert_eq!(block(&structure), [0.0; 9]);
}

#[test]
fn nothing_local_is_offered_where_there_is_no_inertia_or_too_much_is_coupled() {
    let offers = |text: &str| {
        let gives = crate::common::solver(text).hello().gives;
        gives.iter().any(|field| field.name == name::LOCAL_TANGENT)
    };
    let still = |fem: &str| grid("", "", fem).replace("velocities = ", "# ");
    assert!(offers(&still("")) && offers(&still(MIDPOINT.0)));
    assert!(!offers(&still("integrator = \"static\"")));
    // A rope over all of 100 nodes couples 50 pairs for each of them, over 60 of them 30.
    let rope = |nodes: usize| {
        let places: Vec<[f64; 3]> = (0..nodes).map(|i| [i as f64, 0.0, 0.0]).collect();
        let cell: Vec<usize> = (0..nodes).collect();
        format!(
            "end_time = 1.0\n[structure]\nnodes = {places:?}\nsupports = [{{ nodes = [0, {}] }}]\nform_finding = \"none\"\n\
             [[structure.parts]]\nname = \"rope\"\nelement = \"sliding_cable\"\nyoung = 1e10\narea = 2e-5\ndensity = 7850.0\n\
             cells = [{cell:?}]\n",
            nodes - 1
        )
    };
    assert!(offers(&rope(60)) && !offers(&rope(100)));
}
