//! The structure of a kit as its program builds it: which parts there are, what each member of them is, and gauges for the report.

use crate::check::plan::own_program;
use crate::front::stop::Stop;
use crate::run::children::{self, Events};
use interface_defs::InterfaceMesh;
use toml::{Table, Value};
use toolkit::arguments::Input;
use toolkit::check::CheckReport;
use toolkit::scene::{at, number};

/// What all names of the gauges and groups begin with that are no kit's own.
pub const OWN: &str = "approve";
/// The part that is the net; all others connect.
pub const NET: &str = "net";
/// Along it heights count: normal to the reference slope, which is vertical.
const NORMAL: [f64; 3] = [0.0, 0.0, 1.0];

/// The structure at t = 0.
pub struct Layout {
    /// Nodes, lines, groups, at rest.
    pub mesh: InterfaceMesh,
    /// Its parts.
    pub parts: Vec<BarrierPart>,
    /// Its tables with every default.
    pub resolved: Table,
}

/// A part of it.
#[derive(Debug, Clone)]
pub struct BarrierPart {
    /// Name of its group.
    pub name: String,
    /// What it is made of.
    pub element: String,
    /// Axial force at which it breaks [N].
    pub strength: Option<f64>,
    /// Whether it can break at all.
    pub can_break: bool,
    /// Of brakes: the stiffness of their elastic beginning [N/m].
    pub stiffness: Option<f64>,
    /// Of brakes: plastic travel to the end stop [m], and the length at which their force begins, where stated [m].
    pub stroke: Option<f64>,
    pub length: Option<f64>,
    /// Nodes of each brake or post; of a post from foot to head.
    pub members: Vec<Vec<u32>>,
}

impl Layout {
    /// Of the scene of `input`, whose rocks do not count.
    pub fn of(input: &Input, events: &Events) -> Result<Self, Stop> {
        let words = std::iter::once("check".into()).chain(children::scene(input));
        let words: Vec<_> = words.chain(std::iter::once("--format=json".into())).collect();
        let text = children::ask(&own_program("fem-solver")?, &words, events)?;
        let report = CheckReport::from_json(&text)?;
        let mesh = report.interface.unwrap_or_default();
        let parts = at(&report.resolved, "structure.parts").and_then(Value::as_array).into_iter().flatten();
        let parts = parts.filter_map(|part| BarrierPart::of(part.as_table()?, &mesh)).collect();
        Ok(Self { mesh, parts, resolved: report.resolved })
    }

    /// A number of its generator.
    pub fn number(&self, key: &str) -> f64 {
        at(&self.resolved, &format!("structure.generator.{key}")).and_then(number).unwrap_or(0.0)
    }

    /// Place of a node [m].
    pub fn node(&self, node: u32) -> [f64; 3] {
        let first = 3 * node as usize;
        [0, 1, 2].map(|k| self.mesh.coordinates[first + k])
    }

    /// Nodes of a group.
    pub fn group(&self, name: &str) -> &[u32] {
        self.mesh.groups.iter().find(|group| group.name == name).map_or(&[], |group| &group.nodes)
    }

    /// Nodes that are held: a name and a number each.
    pub fn supports(&self) -> Vec<(String, u32)> {
        let groups = ["feet", "side_anchors", "upslope_anchors"].map(|name| self.group(name));
        let of = |(group, name): (&[u32], &str)| -> Vec<(String, u32)> {
            group.iter().enumerate().map(|(i, node)| (format!("{name}_{}", i + 1), *node)).collect()
        };
        groups.into_iter().zip(["foot", "side_anchor", "upslope_anchor"]).flat_map(of).collect()
    }

    /// The least y [m] of what a block strikes that comes along y, with the half edge `half` around `[x, z]` of `centre`.
    pub fn first_struck(&self, centre: [f64; 2], half: f64) -> Option<f64> {
        let mut least = f64::INFINITY;
        for (line, [a, b]) in self.mesh.lines.iter().enumerate() {
            let (a, b) = (self.node(*a), self.node(*b));
            // The part of the line that lies within the square.
            let (mut from, mut to) = (0.0_f64, 1.0_f64);
            for (k, middle) in [0, 2].into_iter().zip(centre) {
                let (start, along) = (a[k] - middle, b[k] - a[k]);
                let (enters, leaves) = ((-half - start) / along, (half - start) / along);
                if along == 0.0 {
                    from = if start.abs() <= half { from } else { f64::INFINITY };
                } else {
                    (from, to) = (from.max(enters.min(leaves)), to.min(enters.max(leaves)));
                }
            }
            if from <= to {
                let radius = self.mesh.line_radius.get(line).copied().unwrap_or(0.0);
                let y = |share: f64| a[1] + share * (b[1] - a[1]);
                least = least.min(y(from).min(y(to)) - radius);
            }
        }
        least.is_finite().then_some(least)
    }

    /// The `groups` and the `gauge` that the report needs, for the block that hits at `centre`.
    pub fn gauges(&self, centre: [f64; 2], half: f64) -> Table {
        let (mut groups, mut gauges) = (String::new(), String::new());
        let mut gauge = |name: &str, group: &str, quantity: &str, more: &str| {
            gauges +=
                &format!("[[gauge]]\nname = {name:?}\ngroup = {group:?}\nquantity = {quantity:?}\n{more}\n");
        };
        let mut group = |name: &str, nodes: &[u32]| {
            groups += &format!("[[groups]]\nname = {name:?}\nnodes = {nodes:?}\n");
        };
        // Between the outer posts: beyond them the rope goes down to its anchors.
        let feet = || self.group("feet").iter().map(|node| self.node(*node)[0]);
        let posts = feet().fold(f64::INFINITY, f64::min)..=feet().fold(f64::NEG_INFINITY, f64::max);
        let above = |node: &u32| posts.contains(&self.node(*node)[0]);
        let top: Vec<u32> = self.group("top_rope").iter().copied().filter(above).collect();
        let [of_top, of_left, of_hit] = ["top", "left", "net"].map(|name| format!("{OWN}_{name}"));
        let hit = format!("{OWN}_hit");
        group(&of_top, &top);
        group(&hit, &self.hit(centre, half));
        let normal = format!("normal = {NORMAL:?}\nabove");
        gauge(&of_top, &of_top, "height", &format!("{normal} = \"feet\""));
        gauge(&of_left, "top_rope", "height", &format!("{normal} = \"bottom_rope\"\nposts = \"posts\""));
        gauge(&of_hit, &hit, "height", &format!("{normal} = \"feet\""));
        for part in &self.parts {
            gauge(&part.gauge(), &part.name, "tension", "");
            for (i, nodes) in part.members.iter().enumerate() {
                let name = part.member(i);
                group(&name, nodes);
                gauge(&name, &name, "tension", "");
                gauge(
                    &name,
                    &name,
                    if part.element == "brake" { "elongation" } else { "bending_moment" },
                    "",
                );
                if part.element != "brake" {
                    let head = format!("{name}_head");
                    group(&head, &nodes[nodes.len() - 1..]);
                    gauge(&head, &head, "displacement", "");
                }
            }
        }
        for (name, node) in self.supports() {
            let name = format!("{OWN}_{name}");
            group(&name, &[node]);
            gauge(&name, &name, "force", "");
        }
        (groups + &gauges).parse().expect("it is TOML")
    }

    /// Nodes of the net that the block strikes, or the nearest one.
    fn hit(&self, centre: [f64; 2], half: f64) -> Vec<u32> {
        let off = |node: &u32| {
            let at = self.node(*node);
            (at[0] - centre[0]).abs().max((at[2] - centre[1]).abs())
        };
        let net = self.group("free_net");
        let nearest = net.iter().map(off).fold(f64::INFINITY, f64::min);
        net.iter().copied().filter(|node| off(node) <= half.max(nearest)).collect()
    }
}

impl BarrierPart {
    fn of(table: &Table, mesh: &InterfaceMesh) -> Option<Self> {
        let text = |key: &str| table.get(key).and_then(Value::as_str).map(str::to_owned);
        let (name, element) = (text("name")?, text("element")?);
        let group = mesh.groups.iter().find(|group| group.name == name)?;
        // Of ropes and nets the most loaded member is named; brakes and posts are reported each.
        let each = matches!(element.as_str(), "brake" | "beam");
        let inside = |line: &&[u32; 2]| each && line.iter().all(|node| group.nodes.contains(node));
        let mut members: Vec<Vec<u32>> = Vec::new();
        for [a, b] in mesh.lines.iter().filter(inside).copied() {
            // A post consists of several beams, one above the other.
            match members.last_mut().filter(|post| post.last() == Some(&a)) {
                Some(post) => post.push(b),
                None => members.push(vec![a, b]),
            }
        }
        let breaks = ["rupture_force", "rupture_strain", "fracture_strain", "strength"];
        Some(Self {
            members,
            strength: table.get("rupture_force").and_then(number),
            can_break: breaks.iter().any(|key| table.contains_key(*key)),
            stiffness: table.get("stiffness").and_then(number),
            stroke: table.get("stroke").and_then(number),
            length: table.get("length").and_then(number),
            element,
            name,
        })
    }

    /// Name of the gauge of the whole part.
    pub fn gauge(&self) -> String {
        format!("{OWN}_{}", self.name)
    }

    /// Name of the gauges of a member.
    pub fn member(&self, i: usize) -> String {
        format!("{OWN}_{}_{}", self.name, i + 1)
    }
}

/// The table below a key, made where there is none.
pub fn table_at<'a>(document: &'a mut Table, key: &str) -> Option<&'a mut Table> {
    document.entry(key).or_insert_with(|| Table::new().into()).as_table_mut()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two lines that sag: one along x through the middle, one beside; a block strikes the part of them in its path.
    #[test]
    fn what_a_block_strikes_is_found_also_between_nodes() {
        let mesh = InterfaceMesh {
            coordinates: vec![-4.0, 0.0, 1.0, 4.0, 0.8, 1.0, -4.0, -1.0, 3.0, 4.0, -1.0, 3.0],
            lines: vec![[0, 1], [2, 3]],
            line_radius: vec![0.01, 0.01],
            ..InterfaceMesh::default()
        };
        let layout = Layout { mesh, parts: Vec::new(), resolved: Table::new() };
        let least = layout.first_struck([0.0, 1.0], 0.5).expect("the first line");
        assert!((least - (0.35 - 0.01)).abs() < 1e-12, "{least}");
        assert_eq!(layout.first_struck([0.0, 2.6], 0.5), Some(-1.01));
        assert_eq!(layout.first_struck([0.0, 2.0], 0.5), None);
        assert_eq!(layout.first_struck([6.0, 1.0], 0.5), None);
    }
}
