//! Rings of wire against tests of rings, in statics, implicit and explicit steps: chains of three, five rings, one ring.
//!
//! Break force and extension of the tests: Guo, Net_panel_analysis, Zenodo 6482654, whose inputs they are.

use crate::common::{Run, off, solver};
use crate::loads::refused;
use interface_defs::message::Plan;

/// Three ways to pull.
const WAYS: [&str; 3] = ["static", "generalized_alpha", "central_difference"];
/// Length of a window [s].
const WINDOW: f64 = 2.5e-4;

/// A scene of rings of 0.3 m between `nodes`: in 0.5 s to 0.44 and in another to 0.56 of the whole way [m] of each of `drawn`. Gauges at
/// the last of these.
fn rings(nodes: &[[f64; 2]], cells: &str, drawn: &[(usize, [f64; 2])], part: &str) -> String {
    let last = drawn[drawn.len() - 1].0;
    let nodes: Vec<_> = nodes.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
    let drawn: String = drawn
        .iter()
        .map(|(node, [x, y])| {
            let to = |part: f64| format!("{:?}, {:?}, 0.0", part * x, part * y);
            let way = format!("[[0.0, 0.0, 0.0, 0.0], [0.5, {}], [1.5, {}]]", to(0.44), to(0.56));
            format!("[[structure.supports]]\nnodes = [{node}]\nmotion = {way}\n")
        })
        .collect();
    format!(
        r#"
end_time = 1.5
[structure]
nodes = {nodes:?}
damping = 20.0
{drawn}
[[structure.parts]]
name = "rings"
element = "wire_ring"
cells = {cells}
diameter = 0.3
{part}
[fem]
integrator = "WAY"
[[gauge]]
name = "strand"
group = "rings"
quantity = "tension"
[[gauge]]
name = "pull"
at = {:?}
quantity = "force"
[[gauge]]
name = "end"
at = {:?}
quantity = "displacement"
"#,
        nodes[last], nodes[last],
    )
}

/// `turns` of a wire of so many metres and 1 770 MPa.
fn wire(turns: u32, diameter: f64) -> String {
    format!("turns = {turns}\nwire_diameter = {diameter:?}\nstrength = 1.77e9")
}

/// Largest pull and strand force [N], and how far the end had gone then [m], when the last node is drawn until something breaks.
fn broken(text: &str) -> [[f64; 3]; 3] {
    WAYS.map(|way| {
        let mut run = Run::alone(&text.replace("WAY", way), WINDOW);
        let mut most = [0.0; 3];
        loop {
            run.step(WINDOW, &[]);
            let pull = run.value("pull_fx");
            // What breaks in a window has no tension at its end.
            most[1] = f64::max(most[1], run.value("strand_tension_max"));
            if pull > most[0] {
                (most[0], most[2]) = (pull, run.value("end_ux"));
            } else if pull < 0.5 * most[0] && most[0] > 5e3 {
                return most;
            }
        }
    })
}

/// All ways come to the same, to 1 %.
fn equal(ways: &[[f64; 3]; 3]) {
    for way in ways {
        assert!(way.iter().zip(ways[0]).all(|(a, b)| off(*a, b) < 0.01), "{ways:?}");
    }
}

#[test]
fn chains_of_three_rings_break_at_the_force_and_extension_of_their_tests() {
    // Turns, wire [m], force [N], extension [m]. The force follows from a fit to these chains, the extension from none.
    for (turns, diameter, force, extension) in [
        (4, 3e-3, 30.1e3, 0.515),
        (5, 3e-3, 44.9e3, 0.519),
        (7, 3e-3, 69.7e3, 0.509),
        (9, 3e-3, 80.5e3, 0.490),
        (12, 3e-3, 110.9e3, 0.491),
        (16, 3e-3, 177.7e3, 0.476),
        (19, 3e-3, 209.4e3, 0.472),
        (3, 2.2e-3, 9.87e3, 0.5212),
        (4, 2.2e-3, 17.57e3, 0.5174),
    ] {
        let nodes = [[0.0, 0.0], [0.3, 0.0], [0.6, 0.0], [0.9, 0.0]];
        let drawn = [(0, [0.0; 2]), (3, [1.0, 0.0])];
        let held = "[[structure.supports]]\nnodes = [1, 2]\ndirections = \"yz\"\n[[structure.parts]]";
        let text = rings(&nodes, "[[0, 1], [1, 2], [2, 3]]", &drawn, &wire(turns, diameter));
        let ways = broken(&text.replacen("[[structure.parts]]", held, 1));
        equal(&ways);
        println!("R{turns}, {diameter} m: {:.2} kN, {:.0} mm", ways[0][0] / 1e3, 1e3 * ways[0][2]);
        for [pull, _, end] in ways {
            assert!(off(pull, force) < 0.1, "R{turns}, {diameter} m: {pull} N, not {force}");
            assert!(off(end, extension) < 0.05, "R{turns}, {diameter} m: {end} m, not {extension}");
        }
    }
}

/// A ring with four neighbours, each of which is drawn at its three other contacts, `part` of them.
fn five(part: &str) -> String {
    let around = [[0.15, 0.0], [0.0, 0.15], [-0.15, 0.0], [0.0, -0.15]];
    let (mut nodes, mut cells) = (around.to_vec(), vec![vec![0, 1, 2, 3]]);
    for (own, [x, y]) in around.into_iter().enumerate() {
        // To its left, its right, and ahead.
        let first = nodes.len();
        nodes.extend([[2.0 * x - y, 2.0 * y + x], [2.0 * x + y, 2.0 * y - x], [3.0 * x, 3.0 * y]]);
        cells.push(vec![own, first + 1, first + 2, first]);
    }
    // Right across is last: its pull is that of its ring.
    let outside = (4..nodes.len()).filter(|n| *n != 6).chain([6]);
    let drawn: Vec<_> = outside.map(|n| (n, nodes[n].map(|x| x / 0.45 * 0.1))).collect();
    rings(&nodes, &format!("{cells:?}"), &drawn, part)
}

#[test]
fn a_ring_with_four_neighbours_breaks_at_the_strand_force_of_its_tests() {
    for (turns, share) in [(5, 0.551), (7, 0.554), (9, 0.559)] {
        let ways = broken(&five(&wire(turns, 3e-3)));
        equal(&ways);
        let wires = f64::from(turns) * 0.25 * std::f64::consts::PI * 9e-6 * 1.77e9;
        for [_, strand, _] in ways {
            assert!(off(strand / wires, share) < 0.1, "R{turns}: {} not {share}", strand / wires);
        }
    }
}

/// R7 of 3 mm as wires of elastic-plastic fibres (`element/wire_ring/tests.rs`): strand force [N], and the share of what straight wires
/// would allow to which two contacts have drawn it out, and four.
const FIBRES: [(f64, f64, f64); 4] =
    [(124.7, 0.150, 0.049), (421.5, 0.370, 0.148), (999.1, 0.636, 0.289), (1951.0, 0.833, 0.440)];

#[test]
fn one_ring_pulls_by_its_law_and_as_fibres_do_at_two_points_and_at_four() {
    let (moment, section) = (7.0 * 1.7e9 * 2.7e-8 / 6.0, 7.0 * 7.0686e-6);
    for contacts in [2_usize, 4] {
        let angle = |i: usize| std::f64::consts::TAU * (i as f64 / contacts as f64);
        let nodes: Vec<_> = (1..=contacts).map(|i| [0.15 * angle(i).cos(), 0.15 * angle(i).sin()]).collect();
        let drawn: Vec<_> = nodes.iter().copied().enumerate().collect();
        let text =
            rings(&nodes, &format!("{:?}", [(0..contacts).collect::<Vec<_>>()]), &drawn, &wire(7, 3e-3));
        let half = (std::f64::consts::PI / contacts as f64).sin();
        let round = contacts as f64 * 0.3 * half;
        let free = (0.3 * std::f64::consts::PI - round) * (1.0 - 0.03);
        for way in WAYS {
            let mut run = Run::alone(&text.replace("WAY", way), WINDOW);
            let (mut e, mut fibres) = (0.0, FIBRES.iter().peekable());
            while e < 0.98 * free {
                run.step(WINDOW, &[]);
                e = run.value("end_ux") / 0.15 * round;
                let strand = run.value("strand_tension");
                if let Some((force, two, four)) = fibres.peek().copied()
                    && e > free * if contacts == 2 { two } else { four }
                {
                    fibres.next();
                    assert!(off(strand, *force) < 0.15, "{contacts} {way}: {strand} N, fibres {force} N");
                }
                if e > 0.6 * free {
                    let gap = free - e + 0.3 * std::f64::consts::PI * strand / (1.5e11 * section);
                    assert!(
                        off(strand * gap, 2.0 * moment) < 0.01,
                        "{contacts} {way} at {e} m: {strand} N, gap {gap} m"
                    );
                }
            }
            assert!(fibres.next().is_none());
        }
    }
}

/// A ring drawn at two of its contacts, between springs of 1 mN/m at the others.
fn alone(part: &str) -> String {
    let nodes = [[0.0, 0.15], [0.0, -0.15], [-0.15, 0.0], [0.15, 0.0]];
    let text = rings(&nodes, "[[0, 2, 1, 3]]", &[(2, [0.0; 2]), (3, [0.172 / 0.56, 0.0])], part);
    let weak = "springs = [{ nodes = [0, 1], stiffness = [1e-3, 1e-3, 1e-3] }]\ndamping";
    text.replace("WAY", "static").replacen("damping", weak, 1)
}

#[test]
fn statics_comes_through_a_ring_that_tightens_between_weak_springs_in_few_steps_and_in_many() {
    let wire = "turns = 12\nwire_diameter = 3e-3";
    let old = "perimeter = 0.878\nperimeter_stiffness = 0.93e6\nbending_stiffness = 0.12e6\nmass = 0.63";
    for (element, part) in [("wire_ring", wire), ("ring", old)] {
        let text = alone(part).replace("\"wire_ring\"", &format!("\"{element}\""));
        let pulls = [1, 20, 200].map(|steps| {
            let window = 1.5 / f64::from(steps);
            let mut run = Run::of(solver(&text), Plan { end_time: 1.5, window, ..Plan::default() });
            (0..steps).for_each(|_| run.step(window, &[]));
            run.value("pull_fx")
        });
        assert!(pulls.iter().all(|pull| off(*pull, pulls[0]) < 1e-6 && *pull > 1e5), "{element}: {pulls:?}");
    }
}

/// A net of 6 x 4 rings that touch, or overlap where they are larger than their cells.
fn net(part: &str) -> String {
    format!(
        "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[structure]\n\
         generator = {{ type = \"ring_net\", rings = [6, 4], diameter = 0.3 }}\n\
         [[structure.parts]]\nname = \"net\"\nelement = \"wire_ring\"\n{part}"
    )
}

#[test]
fn a_net_of_wire_rings_hangs_in_its_frame_with_the_weight_of_its_wires() {
    let mut run = Run::alone(&net("diameter = 0.3\nturns = 7\nwire_diameter = 3e-3"), 1e-3);
    let wires = std::f64::consts::PI * 0.3 * 7.0 * 0.25 * std::f64::consts::PI * 9e-6 * 7850.0;
    assert_eq!(run.ready.mesh.lines.len(), 4 * 24);
    assert!(run.ready.mesh.line_radius.iter().all(|radius| off(*radius, 4.5e-3) < 1e-12));
    run.step(1e-3, &[]);
    assert!(off(run.value("reaction_z"), 24.0 * wires * 9.81) < 1e-9, "{}", run.value("reaction_z"));
    let sag = run.measure("sag");
    assert!(sag > 0.02 && sag < 0.2, "{sag}");
}

#[test]
fn what_no_ring_of_wire_can_be_is_refused_where_it_stands() {
    let good = "diameter = 0.3\nturns = 7\nwire_diameter = 3e-3\nstrength = 1.77e9";
    solver(&net(good));
    for (from, to, words) in [
        ("turns = 7", "turns = 0", "turns is 0"),
        ("3e-3", "3.0", "7 turns make a bundle 9.0000 m thick"),
        (
            "diameter = 0.3\n",
            "diameter = 0.2\n",
            "the wire of a ring is 0.6283 m long, and the perimeter of its contacts 0.8485 m",
        ),
        ("diameter = 0.3\n", "diameter = 0.27\n", "needs cells 0.90 times as wide: of its diameter"),
        ("1.77e9", "1770.0", "pascals: 1 770 MPa is 1.77e9"),
        ("1.77e9", "1.77e9\nrupture_force = 1e5", "not by both"),
        ("1.77e9", "1.77e9\ncontact_strength = [0.3, 0.5]", "must fall from 90 to 180 degrees"),
        ("strength = 1.77e9", "contact_strength = [0.5, 0.3]", "there is no strength"),
        ("1.77e9", "1.77e9\nyield_stress = 2e9", "above its strength"),
        ("1.77e9", "1.77e9\nbundle_factor = 3.0", "must lie between 1 and 2.6"),
    ] {
        let message = refused(&net(&good.replacen(from, to, 1)));
        assert!(message.contains(words), "{words}: {message}");
    }
}
