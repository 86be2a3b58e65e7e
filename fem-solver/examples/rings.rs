//! The referee of ring nets: rings as chains of beams of elastic-plastic wires that touch each other, drawn slowly until their
//! strands bear no more. `docs/rings.md` has the figures.
//!
//! ```text
//! cargo run --release -p fem-solver --example rings -- chain beams=32 friction=0.1
//! cargo run --release -p fem-solver --example rings -- ring points=4
//! cargo run --release -p fem-solver --example rings -- panel rows=45 across=7 pitch=0.275
//! ```
//!
//! Columns: way of what is drawn [m], force on it, of one ring on all its points together [N], largest tension of a strand [N], work done, dissipated and kinetic energy [J], and
//! what of the work the books miss.

#[allow(dead_code)]
#[path = "../tests/structure/common.rs"]
mod common;

use common::Run;
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Rows of the table.
const ROWS: usize = 60;

/// What a case takes from the command line, and its defaults.
struct Options(HashMap<String, f64>);

impl Options {
    fn new(stated: impl Iterator<Item = String>) -> Self {
        let defaults = [
            // Turns of the wire, its diameter and that of the ring [m].
            ("turns", 7.0),
            ("wire", 3e-3),
            ("diameter", 0.3),
            // Beams around a ring.
            ("beams", 24.0),
            ("friction", 0.0),
            // Contact [N/m].
            ("stiffness", 5e7),
            // Speed [m/s] and way [m] of what is drawn; 0: that of the case.
            ("speed", 1.0),
            ("way", 0.0),
            // Mass over the true one.
            ("mass", 10.0),
            ("damping", 2.0),
            // Share of the critical step.
            ("step", 0.6),
            // At how many points one ring is drawn.
            ("points", 2.0),
            // Panel: angle of its rows [degrees], rings from the middle to the edge or along it, their distance [m], and the
            // shape of the punch: 0 a half sphere, 1 a cap of 1.2 m, 2 none: all nodes within its radius are drawn down.
            ("rows", 45.0),
            ("across", 7.0),
            ("pitch", 0.275),
            ("cap", 0.0),
            // Radius of the punch [m].
            ("punch", 0.5),
            // Panel of 0: beams that touch; 1: `wire_ring`, 2: `ring`, whose contacts are nodes, and whether the outermost of these are
            // fixed to the frame or slide along it.
            ("element", 0.0),
            ("fixed", 0.0),
        ];
        let mut all: HashMap<String, f64> = defaults.into_iter().map(|(k, v)| (k.into(), v)).collect();
        for option in stated {
            let (key, value) = option.split_once('=').unwrap_or_else(|| panic!("{option} is no KEY=NUMBER"));
            let value = value.parse().unwrap_or_else(|_| panic!("{value} is no number"));
            let known = all.insert(key.into(), value);
            assert!(known.is_some(), "there is no option {key}");
        }
        Self(all)
    }

    fn get(&self, key: &str) -> f64 {
        self.0[key]
    }

    /// Radius of the bundle [m], as `wire_ring` has it.
    fn bundle(&self) -> f64 {
        0.5 * self.get("wire") * ((4.0 * self.get("turns") - 1.0) / 3.0).sqrt()
    }
}

/// Where the frame's rods lie in the outermost rings, over their radius: where the wave of these is high.
const IN_RING: f64 = 0.9397;

/// Nodes and cells of a case.
#[derive(Default)]
struct Net {
    nodes: Vec<[f64; 3]>,
    /// Beams of rings, and one in four of them, of which tensions are followed.
    rings: Vec<[usize; 2]>,
    gauged: Vec<[usize; 2]>,
    /// Rods that stay, and those that are drawn: cells and radius [m].
    held: Vec<(Vec<[usize; 2]>, f64)>,
    drawn: Vec<(Vec<[usize; 2]>, f64)>,
    /// Way of each of the drawn nodes [m] per metre of way.
    ways: Vec<(usize, [f64; 3])>,
    /// Rings as elements, and how the frame holds some of their nodes.
    cells: Vec<Vec<usize>>,
    edge: Vec<(usize, &'static str)>,
}

impl Net {
    /// A ring through the points `at` an angle.
    fn ring(&mut self, beams: usize, at: impl Fn(f64) -> [f64; 3]) {
        let first = self.nodes.len();
        self.nodes.extend((0..beams).map(|i| at(TAU * i as f64 / beams as f64)));
        for i in 0..beams {
            let of = if i % 4 == 1 { &mut self.gauged } else { &mut self.rings };
            of.push([first + i, first + (i + 1) % beams]);
        }
    }

    /// A ring as an element around a point, whose contacts are those with its neighbours and with a frame on the outermost side.
    fn knots(&mut self, o: &Options, [x, y]: [f64; 2], (pitch, start): (f64, f64), edge: f64) {
        let out = 0.5 * o.get("diameter") * IN_RING;
        let mut around: Vec<(f64, [f64; 3], &'static str)> = Vec::new();
        for k in 0..4 {
            let a = start + 0.5 * PI * f64::from(k);
            let (s, c) = a.sin_cos();
            let next = [x + pitch * c, y + pitch * s];
            if next.iter().all(|z| z.abs() < edge + 1e-6) {
                around.push((a.rem_euclid(TAU), [x + 0.5 * pitch * c, y + 0.5 * pitch * s, 0.0], ""));
            }
        }
        for (a, [c, s]) in [(0.0, [1.0, 0.0]), (0.5, [0.0, 1.0]), (1.0, [-1.0, 0.0]), (1.5, [0.0, -1.0])] {
            if c * x + s * y > edge - 1e-6 {
                let slides = if c == 0.0 { "yz" } else { "xz" };
                let held = if o.get("fixed") > 0.0 { "xyz" } else { slides };
                around.push((a * PI, [x + out * c, y + out * s, 0.0], held));
            }
        }
        around.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut cell = Vec::new();
        for (_, at, held) in around {
            let same = |p: &[f64; 3]| (0..2).all(|c| (p[c] - at[c]).abs() < 1e-6);
            let node = self.nodes.iter().position(same).unwrap_or(self.nodes.len());
            if node == self.nodes.len() {
                self.nodes.push(at);
                self.edge.extend((!held.is_empty()).then_some((node, held)));
            }
            cell.push(node);
        }
        self.cells.push(cell);
    }

    /// A rod through points; without a `way` it stays.
    fn rod(&mut self, points: &[[f64; 3]], radius: f64, way: [f64; 3]) {
        let first = self.nodes.len();
        self.nodes.extend(points);
        let rod = ((first + 1..self.nodes.len()).map(|node| [node - 1, node]).collect(), radius);
        if way == [0.0; 3] {
            return self.held.push(rod);
        }
        self.drawn.push(rod);
        self.ways.extend((first..self.nodes.len()).map(|node| (node, way)));
    }

    /// The scene in which the drawn rods go `way` [m].
    fn scene(&self, o: &Options, way: f64) -> String {
        let (time, bundle) = (way / o.get("speed"), o.bundle());
        let nodes = format!("{:?}", self.nodes);
        let mut text = format!(
            "end_time = {time:?}\ngravity = [0.0, 0.0, 0.0]\n[structure]\nnodes = {nodes}\nform_finding = \"none\"\n\
             damping = {:?}\n",
            o.get("damping")
        );
        let mut parts = String::new();
        let mut names = vec!["rings".to_owned(), "gauged".to_owned()];
        for (name, cells) in [("rings", &self.rings), ("gauged", &self.gauged)] {
            if !self.cells.is_empty() {
                // Half of them in each, as both parts must have some.
                let half = self.cells.len() / 2;
                let cells = if name == "rings" { &self.cells[..half] } else { &self.cells[half..] };
                let element = if o.get("element") == 1.0 {
                    format!(
                        "element = \"wire_ring\"\nturns = {}\nwire_diameter = {:?}",
                        o.get("turns"),
                        o.get("wire")
                    )
                } else {
                    // R7, fitted to the test of its chain.
                    "element = \"ring\"\nperimeter = 0.888\nperimeter_stiffness = 0.56e6\nbending_stiffness = 0.073e6\nmass = 0.37"
                        .into()
                };
                parts += &format!(
                    "[[structure.parts]]\nname = \"{name}\"\ncells = {cells:?}\nradius = {bundle:?}\ndiameter = {:?}\n{element}\n",
                    o.get("diameter")
                );
                continue;
            }
            parts += &format!(
                "[[structure.parts]]\nname = \"{name}\"\nelement = \"beam\"\ncells = {cells:?}\nradius = {bundle:?}\n\
                 section = \"WIRES {}x{}\"\nyoung = 1.5e11\nyield_stress = 1.68e9\nhardening_modulus = 4e9\ndensity = {:?}\n",
                o.get("turns"),
                1e3 * o.get("wire"),
                7850.0 * o.get("mass")
            );
        }
        for (kind, rods) in [("held", &self.held), ("drawn", &self.drawn)] {
            for (i, (cells, radius)) in rods.iter().enumerate() {
                names.push(format!("{kind}{i}"));
                parts += &format!(
                    "[[structure.parts]]\nname = \"{kind}{i}\"\nelement = \"cable\"\ncells = {cells:?}\nradius = {radius:?}\n\
                     young = 1e9\narea = 1e-4\ndensity = 7850.0\n"
                );
            }
        }
        for (node, directions) in &self.edge {
            text += &format!("[[structure.supports]]\nnodes = [{node}]\ndirections = \"{directions}\"\n");
        }
        for [a, b] in self.held.iter().flat_map(|(cells, _)| cells) {
            text += &format!("[[structure.supports]]\nnodes = [{a}, {b}]\n");
        }
        for (node, [x, y, z]) in &self.ways {
            text += &format!(
                "[[structure.supports]]\nnodes = [{node}]\nmotion = [[0.0, 0.0, 0.0, 0.0], [{time:?}, {:?}, {:?}, {:?}]]\n",
                way * x,
                way * y,
                way * z
            );
        }
        let [stiffness, friction] = ["stiffness", "friction"].map(|key| o.get(key));
        text += &format!(
            "[structure.contact]\nparts = {names:?}\nstiffness = {stiffness:?}\nfriction = {friction:?}\n{parts}\
             [fem]\n{}[[gauge]]\nname = \"strand\"\ngroup = \"gauged\"\nquantity = \"tension\"\n",
            if self.rings.is_empty() {
                String::new()
            } else {
                format!("time_step = {:?}\n", o.get("step") * self.critical_step(o))
            }
        );
        text
    }

    /// The critical step [s]: a beam's own, `2 / w` with `w^2 = 4 E / (rho L^2)`, and two contacts at a node.
    fn critical_step(&self, o: &Options) -> f64 {
        let length = |[a, b]: [usize; 2]| {
            (0..3).map(|c| (self.nodes[a][c] - self.nodes[b][c]).powi(2)).sum::<f64>().sqrt()
        };
        let shortest = self.rings.iter().map(|cell| length(*cell)).fold(f64::INFINITY, f64::min);
        let density = 7850.0 * o.get("mass");
        let area = o.get("turns") * 0.25 * PI * o.get("wire").powi(2);
        let own = 4.0 * 1.5e11 / (density * shortest * shortest);
        2.0 / (own + 4.0 * o.get("stiffness") / (density * area * shortest)).sqrt()
    }
}

/// A chain of three rings in alternate planes between two pins.
fn chain(o: &Options) -> (Net, f64) {
    let (mut net, radius, bundle) = (Net::default(), 0.5 * o.get("diameter"), o.bundle());
    let pitch = 2.0 * (radius - bundle);
    for k in 0..3 {
        let x = f64::from(k) * pitch;
        net.ring(o.get("beams") as usize, |a| {
            let (s, c) = (radius * a.sin(), radius * a.cos());
            if k == 1 { [x + c, 0.0, s] } else { [x + c, s, 0.0] }
        });
    }
    let pin = |x: f64| [[x, 0.0, -0.1], [x, 0.0, 0.1]];
    let inner = radius - 2.0 * bundle;
    net.rod(&pin(-inner), bundle, [0.0; 3]);
    net.rod(&pin(2.0 * pitch + inner), bundle, [1.0, 0.0, 0.0]);
    (net, 0.56 * o.get("diameter") / 0.3)
}

/// One ring drawn evenly at its points; the way is that of a point.
fn ring(o: &Options) -> (Net, f64) {
    let (mut net, radius, bundle) = (Net::default(), 0.5 * o.get("diameter"), o.bundle());
    net.ring(o.get("beams") as usize, |a| [radius * a.cos(), radius * a.sin(), 0.0]);
    let points = o.get("points");
    for k in 0..points as usize {
        let (y, x) = (TAU * k as f64 / points).sin_cos();
        let at = radius - 2.0 * bundle;
        net.rod(&[[at * x, at * y, -0.1], [at * x, at * y, 0.1]], bundle, [x, y, 0.0]);
    }
    let polygon = points * (PI / points).sin();
    (net, 1.02 * radius * (PI / polygon - 1.0))
}

/// A panel of rings hung on the rods of a square frame, drawn down by a punch in its middle.
fn panel(o: &Options) -> (Net, f64) {
    let (mut net, radius, bundle) = (Net::default(), 0.5 * o.get("diameter"), o.bundle());
    let (pitch, across, beams) = (o.get("pitch"), o.get("across") as i32, o.get("beams") as usize);
    let turned = o.get("rows") > 0.0;
    // Rows at 45 degrees: centres of two square lattices, twice as wide in steps of half of that.
    let (step, start) = if turned { (pitch * 0.5_f64.sqrt(), 0.25 * PI) } else { (pitch, 0.0) };
    let middle = |i: i32| {
        if turned { f64::from(i) * step } else { (f64::from(i) - 0.5 * f64::from(across - 1)) * step }
    };
    let range = if turned { -across..across + 1 } else { 0..across };
    let edge = middle(range.end - 1);
    for i in range.clone() {
        for j in range.clone().filter(|j| !turned || (i + j + across) % 2 == 0) {
            let (x, y) = (middle(i), middle(j));
            if o.get("element") > 0.0 {
                net.knots(o, [x, y], (pitch, start), edge);
                continue;
            }
            // Over one neighbour and under it again: a wave of four periods, steep enough for the radii of both.
            let high = 2.6 * bundle;
            net.ring(beams, |a| {
                [x + radius * a.cos(), y + radius * a.sin(), high * (4.0 * (a - start)).sin()]
            });
        }
    }
    let (rod, frame) = (1e-3, edge + radius * IN_RING);
    let reach = frame + 0.3;
    // Nodes of elements are held without rods.
    let sides = if net.cells.is_empty() { vec![-frame, frame] } else { Vec::new() };
    for side in sides {
        net.rod(&[[side, -reach, rod], [side, reach, rod]], rod, [0.0; 3]);
        net.rod(&[[-reach, side, -1.5 * rod], [reach, side, -1.5 * rod]], rod, [0.0; 3]);
    }
    let (round, touch, down) = (o.get("punch"), 3.8 * bundle, [0.0, 0.0, -1.0]);
    if o.get("cap") == 2.0 {
        let within = |p: &[f64; 3]| p[0].hypot(p[1]) <= round;
        net.ways.extend((0..net.nodes.len()).filter(|n| within(&net.nodes[*n])).map(|n| (n, down)));
        // Contact wants something apart from the net.
        net.rod(&[[0.0, 0.0, 9.0], [1.0, 0.0, 9.0]], rod, [0.0; 3]);
    } else if o.get("cap") == 0.0 {
        net.rod(&[[0.0, 0.0, round + touch], [0.0, 0.0, round + touch + 2.0]], round, down);
    } else {
        // Tubes on a sphere of 1.2 m, the widest as wide as the punch.
        let (tube, sphere, count) = (0.03, 1.2_f64, 5);
        for k in 1..=count {
            let r = (round - tube) * f64::from(k) / f64::from(count);
            let z = touch + tube + sphere - (sphere * sphere - r * r).sqrt();
            let sides = (TAU * r / 0.1).ceil();
            let around = (0..=sides as u32).map(|i| TAU * f64::from(i) / sides);
            let points: Vec<_> = around.map(|a| [r * a.cos(), r * a.sin(), z]).collect();
            net.rod(&points, tube, down);
        }
    }
    let rings = net.cells.len().max((net.rings.len() + net.gauged.len()) / beams);
    println!("# frame {:.3} m wide, {rings} rings", 2.0 * frame);
    (net, 1.3)
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let case = arguments.next().unwrap_or_else(|| "chain".into());
    let o = Options::new(arguments);
    let (net, own_way) = match case.as_str() {
        "chain" => chain(&o),
        "ring" => ring(&o),
        "panel" => panel(&o),
        other => panic!("there is no case {other}: chain, ring, panel"),
    };
    let way = if o.get("way") > 0.0 { o.get("way") } else { own_way };
    let text = net.scene(&o, way);
    let (rows, window) = (ROWS, way / o.get("speed") / (ROWS * 20) as f64);
    let mut run = Run::alone(&text, window);
    println!("# {case} {:?}", o.0);
    println!(
        "# {:>8} {:>10} {:>10} {:>10} {:>10} {:>10} {:>9}",
        "way", "force", "strand", "work", "lost", "kinetic", "missed"
    );
    let mut before = 0.0;
    for row in 1..=rows {
        let mut strand: f64 = 0.0;
        for _ in 0..20 {
            run.step(window, &[]);
            strand = strand.max(run.value("strand_tension_max"));
        }
        let value = |name: &str| run.value(name);
        let work = -value("energy_supports_fem");
        let [lost, kinetic] = ["dissipated", "kinetic"].map(|of| value(&format!("energy_{of}_fem")));
        let gone = way * row as f64 / rows as f64;
        println!(
            "{gone:10.4} {:10.1} {strand:10.1} {work:10.2} {lost:10.2} {kinetic:10.3} {:9.4}",
            (work - before) / (way / rows as f64),
            run.balance() / work.abs().max(1e-9)
        );
        before = work;
    }
}
