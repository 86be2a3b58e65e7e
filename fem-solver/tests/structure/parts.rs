//! How far each part was used, and the energy in it.

use crate::common::{Run, off};
use interface_defs::solver::Solver;
use interface_defs::{PartUse, ShareOf, Utilisation};

/// The rows at the end; their energies are all that there is.
fn parts(run: &mut Run) -> Vec<PartUse> {
    let parts = run.solver.finish().expect("ends").parts.expect("it says");
    let sum = |of: fn(&PartUse) -> f64| parts.iter().map(of).sum::<f64>();
    let (lost, held) = (run.value("energy_dissipated_fem"), run.value("energy_stored_fem"));
    assert!((sum(|part| part.dissipated) - lost).abs() <= 1e-12 * lost.abs(), "{parts:?}, {lost}");
    assert!((sum(|part| part.stored) - held).abs() <= 1e-9 * held.abs() + 1e-12, "{parts:?}, {held}");
    assert!(parts.is_sorted_by(|a, b| a.share() >= b.share()), "{parts:?}");
    parts
}

fn part<'a>(parts: &'a [PartUse], name: &str) -> (&'a PartUse, Utilisation) {
    let part = parts.iter().find(|part| part.part == name).expect(name);
    (part, part.utilisation.unwrap_or_default())
}

const SCHEMES: [&str; 4] = [
    "time_step = 1e-5",
    "integrator = \"generalized_alpha\"\ntime_step = 1e-3",
    "integrator = \"newmark\"\ntime_step = 1e-3",
    "integrator = \"static\"",
];

#[test]
fn a_rope_a_brake_and_an_anchor_in_a_row_are_used_by_one_force_and_keep_their_energies() {
    // Drawn by 0.5 m in 1 s, and back by 0.1 m: the brake gives 0.5 m less what 2e4 N stretch the others, of 1 m stroke.
    for fem in SCHEMES {
        let text = format!(
            r#"
end_time = 2.0
[structure]
form_finding = "none"
damping = 20.0
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
masses = [{{ nodes = [0, 1], mass = 1.0 }}]
groups = [{{ name = "anchor", nodes = [0] }}]
[[structure.supports]]
group = "anchor"
stiffness = 2e6
strength = 1e5
[[structure.supports]]
nodes = [2]
motion = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.0, 0.0], [1.2, 0.4, 0.0, 0.0]]
[[structure.supports]]
nodes = [1]
directions = "yz"
[[structure.parts]]
name = "brakes"
element = "brake"
cells = [[0, 1]]
stiffness = 1e7
curve = [[0.002, 2e4]]
stroke = 1.0
[[structure.parts]]
name = "ropes"
element = "cable"
cells = [[1, 2]]
young = 1e10
area = 1e-4
density = 7850.0
rupture_force = 4e4
[fem]
{fem}
"#
        );
        let mut run = Run::alone(&text, 1e-2);
        (0..120).for_each(|_| run.step(1e-2, &[]));
        let parts = parts(&mut run);
        let names: Vec<_> = parts.iter().map(|part| part.part.as_str()).collect();
        assert_eq!(names, ["ropes", "brakes", "anchor", "the rest"], "{fem}");
        let strain = (1.0 + 2.0 * 2e4 / 1e6_f64 * 0.98).sqrt() - 1.0;
        let travel = 0.5 - 2e4 / 2e6 - 2e4 / 1e7 - strain;
        let (brakes, used) = part(&parts, "brakes");
        assert_eq!(used.of, ShareOf::Travel);
        assert!(off(used.share, travel) < 0.01 && (used.time - 1.0).abs() < 0.03, "{fem}: {used:?} {travel}");
        assert!(off(brakes.dissipated, 2e4 * travel) < 0.01, "{fem}: {brakes:?}");
        for (name, share) in [("ropes", 0.5), ("anchor", 0.2)] {
            let (row, used) = part(&parts, name);
            assert!(off(used.share, share) < 0.04 && used.of == ShareOf::Force, "{fem}: {used:?}");
            assert!(row.dissipated == 0.0 && row.stored.abs() < 1.0, "{fem}: {row:?}");
        }
    }
}

#[test]
fn a_post_is_used_by_its_section_and_what_is_torn_wholly() {
    let text = |fracture: &str| {
        format!(
            r#"
end_time = 2.0
[structure]
form_finding = "none"
damping = 20.0
nodes = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
supports = [{{ nodes = [0], rotations = "xyz" }},
            {{ nodes = [1], directions = "z", motion = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.2]] }}]
[[structure.parts]]
name = "posts"
element = "beam"
cells = [[0, 1]]
section = "HE 160 B"
steel = "S235"
{fracture}
[fem]
integrator = "static"
"#
        )
    };
    let mut run = Run::alone(&text(""), 1e-2);
    let mut first = None;
    for _ in 0..100 {
        run.step(1e-2, &[]);
        let (used, plastic) =
            (part(&parts(&mut run), "posts").1, run.solver.finish().expect("ends").measures);
        // It is said to yield from the first fibre on that does, when not all of the section does.
        let yields = plastic.iter().any(|measure| measure.name == "max_plastic_strain");
        assert_eq!(used.of == ShareOf::Yielded, yields, "{used:?}");
        first = first.or(Some(used.share).filter(|_| yields));
    }
    assert!(first.is_some_and(|share| (0.6..0.95).contains(&share)), "{first:?}");
    let all = parts(&mut run);
    let (row, used) = part(&all, "posts");
    assert!(used.of == ShareOf::Yielded && off(used.share, 1.0) < 0.03, "{used:?}");
    assert!(off(row.dissipated, run.value("energy_dissipated_fem")) < 1e-12, "{row:?}");
    let mut run = Run::alone(&text("fracture_strain = 0.01"), 1e-2);
    (0..100).for_each(|_| run.step(1e-2, &[]));
    let all = parts(&mut run);
    assert!(part(&all, "posts").1.share >= 1.0 && part(&all, "posts").0.stored == 0.0, "{all:?}");
}

#[test]
fn parts_of_a_torn_net_sum_up_and_the_torn_one_is_used_wholly() {
    for fem in ["", "integrator = \"generalized_alpha\"\ntime_step = 1e-4"] {
        let text = format!(
            r#"
end_time = 1.0
[structure]
nodes = [[0.0, 0.0, 0.0], [0.15, 0.0, 0.0], [0.3, 0.0, 0.0]]
form_finding = "none"
masses = [{{ nodes = [1], mass = 0.5 }}]
cables = [{{ nodes = [0, 1], length = 0.2 }}]
cable = {{ young = 8.2e9, area = 1.25e-5, density = 7850.0 }}
[[structure.supports]]
nodes = [0]
[[structure.supports]]
nodes = [2]
motion = [[0.0, 0.0, 0.0, 0.0], [0.01, 0.2, 0.0, 0.0]]
[[structure.parts]]
name = "weak"
element = "cable"
cells = [[0, 1]]
rupture_force = 3e3
[[structure.parts]]
name = "strong"
element = "cable"
cells = [[1, 2]]
[fem]
{fem}
"#
        );
        let mut run = Run::alone(&text, 2e-3);
        (0..3).for_each(|_| run.step(2e-3, &[]));
        let all = parts(&mut run);
        let torn = run.solver.finish().unwrap().torn.unwrap();
        let (_, used) = part(&all, "weak");
        assert!(
            used.share >= 1.0 && used.share < 1.02 && (used.time - torn[0].first).abs() < 1e-4,
            "{all:?}"
        );
        assert!(all.last().unwrap().part == "the rest" || part(&all, "strong").0.utilisation.is_none());
    }
}

#[test]
fn rings_in_blocks_are_used_as_one_by_one_and_each_part_by_its_own() {
    // Two parts of the same rings, the second pulled less: what blocks say is what the gauge of every step says.
    let net = |name: &str, at: f64, speed: f64| {
        let corner = |k: usize| [[0.0, 0.0], [0.3, 0.0], [0.3, 0.3], [0.0, 0.3]][k];
        let nodes: Vec<[f64; 3]> =
            (0..12).map(|i| [at + corner(i % 4)[0] + (i / 4) as f64, corner(i % 4)[1], 0.0]).collect();
        (name.to_owned(), nodes, speed)
    };
    let nets = [net("first", 0.0, 8.0), net("second", 10.0, 4.0)];
    let nodes: Vec<[f64; 3]> = nets.iter().flat_map(|(_, nodes, _)| nodes.clone()).collect();
    let mut parts_text = String::new();
    let (mut supports, mut velocities, mut gauges) = (String::new(), String::new(), String::new());
    for (n, (name, _, speed)) in nets.iter().enumerate() {
        let cells: Vec<Vec<usize>> =
            (0..3).map(|ring| (0..4).map(|k| 12 * n + 4 * ring + k).collect()).collect();
        parts_text += &format!(
            "[[structure.parts]]\nname = \"{name}\"\nelement = \"ring\"\ncells = {cells:?}\ndiameter = 0.3\nperimeter = 1.0\n\
             perimeter_stiffness = 1e6\nbending_stiffness = 1e4\nmass = 0.5\nrupture_force = 1e5\n"
        );
        for cell in &cells {
            supports += &format!("{{ nodes = [{}] }}, ", cell[0]);
            velocities += &format!("{{ nodes = [{}], velocity = [{speed:?}, {speed:?}, 0.0] }}, ", cell[2]);
        }
        gauges += &format!("[[gauge]]\nname = \"{name}\"\ngroup = \"{name}\"\nquantity = \"tension\"\n");
    }
    let text = format!(
        "end_time = 1.0\n[structure]\nform_finding = \"none\"\nnodes = {nodes:?}\nsupports = [{supports}]\n\
         velocities = [{velocities}]\n{parts_text}{gauges}[fem]\ntime_step = 2e-6\n"
    );
    let mut run = Run::alone(&text, 1e-3);
    (0..40).for_each(|_| run.step(1e-3, &[]));
    let all = parts(&mut run);
    for name in ["first", "second"] {
        let largest = run.measure(&format!("{name}_tension_max"));
        let (_, used) = part(&all, name);
        assert!(largest > 100.0 && off(used.share, largest / 1e5) < 1e-3, "{name}: {used:?} {largest}");
    }
    assert_ne!(part(&all, "second").1.share, part(&all, "first").1.share);
}
