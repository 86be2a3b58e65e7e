//! Fields for a part of the interface mesh alone: the same numbers as for all of it.

use crate::common::{Run, random};
use interface_defs::field::{FieldSpec, Items, Layout, Place, Sampling, name};
use interface_defs::message::Plan;
use interface_defs::selection::Selection;
use interface_defs::solver::{Solver, Window};
use toolkit::alloc::allocations;

const SCHEMES: [(&str, &[Sampling]); 5] = [
    ("time_step = 2e-5", &[Sampling::Means]),
    ("integrator = \"generalized_alpha\"", &[Sampling::Means]),
    ("integrator = \"generalized_alpha\"\nrho_inf = 0.6", &[Sampling::Means, Sampling::AtEnds]),
    ("integrator = \"newmark\"\ntime_step = 1e-4", &[Sampling::AtEnds]),
    ("integrator = \"static\"", &[Sampling::AtEnds]),
];
const WINDOW: f64 = 4e-4;

/// A prestressed net of 6 x 5 cells whose cables tear under `strength` [N].
fn net(fem: &str, strength: f64) -> String {
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = {{ type = "rectangular_net", cells = [6, 5], spacing = 0.15 }}
damping = 15.0
loads = [{{ nodes = [30], force = [0.0, 1.0, 0.0], history = [[0.0, 0.0], [0.01, 50.0]] }}]
cable = {{ young = 8e9, area = 1.2e-5, density = 7850.0, prestress = 1e6, radius = 0.002 }}
[[structure.parts]]
name = "net"
element = "cable"
rupture_force = {strength:?}
[[gauge]]
name = "left"
group = "x_min"
quantity = "force"
[fem]
{fem}
"#
    )
}

fn plan(force: &[Sampling]) -> Plan {
    let field = |name, sampling, samples| FieldSpec { samples, ..FieldSpec::nodal(name, 3, sampling) };
    let once = |name, place| FieldSpec { place, ..FieldSpec::nodal(name, 1, Sampling::Once) };
    Plan {
        end_time: 1.0,
        window: WINDOW,
        takes: force.iter().map(|sampling| field(name::FORCE, *sampling, 2)).collect(),
        gives: vec![
            once(name::BROKEN, Place::Line),
            field(name::DISPLACEMENT, Sampling::AtEnds, 4),
            field(name::VELOCITY, Sampling::AtEnds, 2),
            once(name::TRAVEL, Place::Whole),
        ],
        partner_mesh: None,
        ..Plan::default()
    }
}

/// Where the numbers of a payload for a selection stand in one for all.
fn places(fields: &[FieldSpec], run: &Run, selection: &Selection, gauges: usize) -> Vec<usize> {
    let all = Layout::new(fields, &run.ready.mesh, gauges);
    let mut places = Vec::new();
    for field in fields {
        let numbers: Vec<u32> = match field.place {
            Place::Node => selection.nodes.clone(),
            Place::Line => selection.lines.clone(),
            _ => vec![0],
        };
        for sample in 0..field.sample_count() {
            let from = all.sample(&field.name, field.sampling, sample).expect("is in the plan").start;
            let components = field.components as usize;
            let items = numbers.iter().map(|n| from + *n as usize * components);
            places.extend(items.flat_map(|item| item..item + components));
        }
    }
    places.extend(all.gauges());
    places
}

/// Loads that swing, on the nodes of the selection alone.
fn force(run: &Run, window: u64, at: &[usize], size: f64) -> Vec<f64> {
    let (mut noise, mut force) = (random(window), vec![0.0; run.force_len]);
    at.iter().for_each(|i| force[*i] = size * noise());
    force
}

fn taken(of: &[f64], places: &[usize]) -> Vec<f64> {
    places.iter().map(|i| of[*i]).collect()
}

#[test]
fn what_is_selected_is_answered_as_among_all_bit_for_bit() {
    for (fem, sampling) in SCHEMES {
        let strength = if fem.contains("static") { 1e6 } else { 22.0 };
        let text = net(fem, strength);
        // Cables that cannot tear are pulled in another way, tile by tile where nothing else is there.
        let plain = text.replace("rupture_force", "#").replace("loads =", "#");
        for (text, tears) in [(text, !fem.contains("static")), (plain, false)] {
            compare(&text, sampling, tears);
        }
    }
}

/// Two patches, one after the other, then all: the answers are those of a structure of which all is sent.
fn compare(text: &str, sampling: &[Sampling], tears: bool) {
    let mut fields = plan(sampling);
    fields.gives.retain(|field| tears || field.name != name::BROKEN);
    let [mut all, mut part] = [0, 1].map(|_| Run::with(text, fields.clone()));
    let mesh = all.ready.mesh.clone();
    let mut selection = Selection::new(&mesh);
    let (mut broken, gauges) = (0.0, all.ready.gauges.len());
    for (window, first) in [9, 9, 9, 16, 16, 16, 0, 0].into_iter().enumerate() {
        let nodes = if first > 0 { vec![first, first + 1, first + 7, first + 8] } else { (0..42).collect() };
        selection.set(&mesh, nodes.iter().copied()).expect("nodes of the mesh");
        part.solver.select((first > 0).then_some(&mut selection)).expect("selects");
        let takes = places(&fields.takes, &all, &selection, 0);
        let gives = places(&fields.gives, &all, &selection, gauges);
        let load = force(&all, window as u64, &takes, 150.0);
        all.step(WINDOW, &load);
        part.output = vec![f64::NAN; gives.len()];
        part.step(WINDOW, &taken(&load, &takes));
        let mut expected = taken(&all.output, &gives);
        let mut own = Layout::new(&fields.gives, &mesh, gauges);
        own.resize(&Items { pairs: 0, ..selection.items() });
        let travel = own.sample(name::TRAVEL, Sampling::Once, 0).expect("is in the plan").start;
        if first > 0 {
            // That of the nodes that are not sent.
            assert!(part.output[travel] <= expected[travel]);
            expected[travel] = part.output[travel];
        }
        assert_eq!(part.output, expected, "window {window} of {text}");
        let answer = part.output.clone();
        part.output.fill(f64::NAN);
        part.solver.committed(&mut part.output).expect("is prepared");
        let mut motion = Layout::new(&fields.gives, &mesh, gauges);
        motion.resize(&Items { pairs: 0, ..selection.items() });
        let last = |field, answer: &[f64]| {
            answer[motion.last(field, Sampling::AtEnds).expect("is in the plan")].to_vec()
        };
        for field in [name::DISPLACEMENT, name::VELOCITY] {
            for sample in 0..2 {
                let at = motion.sample(field, Sampling::AtEnds, sample).expect("is in the plan");
                assert_eq!(part.output[at], last(field, &answer), "{field} of {text}");
            }
        }
        let flags = motion.sample(name::BROKEN, Sampling::Once, 0);
        broken += flags.clone().map_or(0.0, |at| answer[at].iter().sum::<f64>());
        for other in flags.into_iter().chain([motion.gauges()]) {
            assert_eq!(part.output[other.clone()], answer[other], "{text}");
        }
        let at = motion.sample(name::TRAVEL, Sampling::Once, 0).expect("is in the plan");
        assert_eq!(part.output[at.clone()], answer[at]);
    }
    assert_eq!(broken > 0.0, tears, "what tears of {text}");
}

#[test]
fn solving_a_b_a_gives_equal_bytes_whatever_is_selected() {
    let mut run = Run::with(&net("time_step = 2e-5", 1e4), plan(&[Sampling::Means]));
    let mesh = run.ready.mesh.clone();
    let mut selection = Selection::new(&mesh);
    let fields = plan(&[Sampling::Means]);
    let mut solve = |first: u32, size: f64, commit: bool| {
        selection.set(&mesh, [first, first + 1, first + 8].into_iter()).expect("nodes of the mesh");
        run.solver.select(Some(&mut selection)).expect("selects");
        let takes = places(&fields.takes, &run, &selection, 0);
        let load = taken(&force(&run, 3, &takes, size), &takes);
        run.output = vec![f64::NAN; places(&fields.gives, &run, &selection, run.ready.gauges.len()).len()];
        run.solve(WINDOW, &load).expect("a window");
        if commit {
            run.commit(WINDOW);
        }
        run.output.clone()
    };
    for _ in 0..3 {
        let first = solve(9, 80.0, false);
        let other = solve(24, 40.0, false);
        assert_ne!(first, other);
        assert_eq!(solve(9, 80.0, true), first);
    }
}

#[test]
fn travel_is_the_longest_way_of_any_node_that_is_not_selected() {
    let mut run = Run::with(&net("time_step = 2e-5", 1e4), plan(&[Sampling::Means]));
    let at = run.layout.sample(name::TRAVEL, Sampling::Once, 0).expect("is in the plan").start;
    let mut before = vec![0.0; 3 * run.ready.mesh.node_count()];
    let nodes: Vec<usize> = (0..run.force_len).collect();
    for window in 0..4 {
        let load = force(&run, window, &nodes, 50.0);
        run.step(WINDOW, &load);
        let now = run.layout.last(name::DISPLACEMENT, Sampling::AtEnds).expect("is in the plan");
        let now = run.output[now].to_vec();
        let ways = now.chunks(3).zip(before.chunks(3)).map(|(a, b)| {
            let way: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
            way[0].hypot(way[1]).hypot(way[2])
        });
        let longest = ways.fold(0.0, f64::max);
        assert!((run.output[at] / longest - 1.0).abs() < 1e-12 && longest > 1e-5, "{longest}");
        before = now;
    }
}

#[test]
fn what_was_not_solved_and_accepted_is_not_committed() {
    let mut run = Run::with(&net("time_step = 2e-5", 1e4), plan(&[Sampling::Means]));
    let nodes: Vec<usize> = (0..run.force_len).collect();
    let load = force(&run, 1, &nodes, 50.0);
    run.step(WINDOW, &load);
    let mut before = run.output.clone();
    run.solver.committed(&mut before).expect("is prepared");
    run.solve(WINDOW, &load).expect("a window");
    let solved = run.output.clone();
    run.solver.committed(&mut run.output).expect("is prepared");
    assert_eq!(run.output, before);
    assert_ne!(run.output, solved);
}

#[test]
fn windows_and_selections_allocate_nothing_after_the_first() {
    for (fem, sampling) in SCHEMES {
        let mut plan = plan(sampling);
        let local = |name, components, place| FieldSpec {
            place,
            ..FieldSpec::nodal(name, components, Sampling::Once)
        };
        if !fem.contains("static") {
            plan.gives.extend([
                local(name::LOCAL_FORCE, 3, Place::Node),
                local(name::LOCAL_FORCE_RATE, 3, Place::Node),
                local(name::LOCAL_TANGENT, 9, Place::Pair),
                local(name::LOCAL_DAMPING, 1, Place::Whole),
            ]);
        }
        let mut run = Run::with(&net(fem, 1e6), plan.clone());
        let mesh = run.ready.mesh.clone();
        let mut selection = Selection::new(&mesh);
        let mut gives = Layout::new(&plan.gives, &mesh, run.ready.gauges.len());
        let mut takes = Layout::new(&plan.takes, &mesh, 0);
        let input = vec![0.5; run.force_len];
        let mut output = vec![0.0; gives.len() + 1000];
        let mut counted = Vec::new();
        for first in [8, 16, 9, 23_u32] {
            let nodes = [first, first + 1, first + 7];
            selection.set(&mesh, nodes.into_iter()).expect("nodes of the mesh");
            let window = Window { number: 1, iteration: 1, start: run.time, length: WINDOW };
            let before = allocations();
            run.solver.select(Some(&mut selection)).expect("selects");
            gives.resize(&selection.items());
            takes.resize(&selection.items());
            let output = &mut output[..gives.len()];
            run.solver.committed(output).expect("is prepared");
            run.solver.solve(&window, &input[..takes.len()], output).expect("a window");
            run.solver.commit().expect("is prepared");
            counted.push(allocations() - before);
            run.time += WINDOW;
        }
        assert_eq!(counted[1..], [0; 3], "{fem}");
    }
}
