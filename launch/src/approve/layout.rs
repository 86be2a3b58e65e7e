//! The structure of a kit as its program builds it: which parts there are, what each member of them is, and gauges for the report.

use crate::children::{self, Events};
use crate::plan::own_program;
use crate::stop::Stop;
use interface_defs::InterfaceMesh;
use toml::{Table, Value};
use toolkit::arguments::Input;
use toolkit::check::CheckReport;
use toolkit::scene::at;

/// What all names of the gauges and groups begin with that are no kit's own.
pub const OWN: &str = "approve";
/// Along it heights count: normal to the reference slope, which is vertical.
const NORMAL: [f64; 3] = [0.0, 0.0, 1.0];

/// The structure at t = 0.
pub struct Layout {
    /// Nodes, lines, groups, at rest.
    pub mesh: InterfaceMesh,
    /// Its parts.
    pub parts: Vec<Part>,
    /// Its tables with every default.
    pub resolved: Table,
}

/// A part of it.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name of its group.
    pub name: String,
    /// What it is made of.
    pub element: String,
    /// Axial force at which it breaks [N].
    pub strength: Option<f64>,
    /// Whether it can break at all.
    pub can_break: bool,
    /// Of brakes: travel to the end stop [m].
    pub stroke: Option<f64>,
    /// Nodes of each brake or post.
    pub members: Vec<[u32; 2]>,
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
        let parts = parts.filter_map(|part| Part::of(part.as_table()?, &mesh)).collect();
        Ok(Self { mesh, parts, resolved: report.resolved })
    }

    /// A number of its generator.
    pub fn number(&self, key: &str) -> f64 {
        number(at(&self.resolved, &format!("structure.generator.{key}"))).unwrap_or(0.0)
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
        let of = |group: &'static str, name: &'static str| {
            self.group(group).iter().enumerate().map(move |(i, node)| (format!("{name}_{}", i + 1), *node))
        };
        of("feet", "foot")
            .chain(of("side_anchors", "side_anchor"))
            .chain(of("upslope_anchors", "upslope_anchor"))
            .collect()
    }

    /// The least y [m] of what lies in the way of a block that comes along y, of the half edge `half` around `[x, z]` of `centre`.
    pub fn in_the_way(&self, centre: [f64; 2], half: f64) -> Option<f64> {
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

    /// The groups and gauges that the report needs, for the block that hits at `centre`.
    pub fn gauges(&self, centre: [f64; 2], half: f64) -> (Vec<Table>, Vec<Table>) {
        let mut groups = Vec::new();
        let mut group = |name: String, nodes: &[u32]| {
            let nodes: Vec<Value> = nodes.iter().map(|node| i64::from(*node).into()).collect();
            groups.push(Table::from_iter([
                ("name".into(), name.clone().into()),
                ("nodes".into(), nodes.into()),
            ]));
            name
        };
        let gauge = |name: &str, group: &str, quantity: &str| {
            let entries = [("name", name), ("group", group), ("quantity", quantity)];
            entries.into_iter().map(|(key, value)| (key.to_owned(), value.into())).collect::<Table>()
        };
        let height = |name: &str, group: &str, above: &str| {
            let mut table = gauge(name, group, "height");
            table.insert("above".into(), above.into());
            table.insert("normal".into(), NORMAL.map(Value::from).to_vec().into());
            table
        };
        // Between the outer posts: beyond them the rope goes down to its anchors.
        let ends =
            |k: fn(f64, f64) -> f64| self.group("feet").iter().map(|node| self.node(*node)[0]).reduce(k);
        let (first, last) = (ends(f64::min).unwrap_or(0.0), ends(f64::max).unwrap_or(0.0));
        let above = |node: &u32| (first..=last).contains(&self.node(*node)[0]);
        let top: Vec<u32> = self.group("top_rope").iter().copied().filter(above).collect();
        let top = group(format!("{OWN}_top"), &top);
        let mut gauges = vec![height(&top, &top, "feet")];
        let mut left = height(&format!("{OWN}_left"), "top_rope", "bottom_rope");
        left.insert("posts".into(), "posts".into());
        gauges.push(left);
        let hit = group(format!("{OWN}_hit"), &self.hit(centre, half));
        gauges.push(height(&format!("{OWN}_net"), &hit, "feet"));
        for part in &self.parts {
            gauges.push(gauge(&part.gauge(), &part.name, "tension"));
            for (i, nodes) in part.members.iter().enumerate() {
                let name = group(part.member(i), nodes);
                gauges.push(gauge(&name, &name, "tension"));
                match part.element.as_str() {
                    "brake" => gauges.push(gauge(&name, &name, "elongation")),
                    "beam" => {
                        gauges.push(gauge(&name, &name, "bending_moment"));
                        let head = group(format!("{name}_head"), &nodes[1..]);
                        gauges.push(gauge(&head, &head, "displacement"));
                    }
                    _ => {}
                }
            }
        }
        for (name, node) in self.supports() {
            let name = group(format!("{OWN}_{name}"), &[node]);
            gauges.push(gauge(&name, &name, "force"));
        }
        (groups, gauges)
    }

    /// Nodes of the net in the way of the block, or the nearest one.
    fn hit(&self, centre: [f64; 2], half: f64) -> Vec<u32> {
        let off = |node: &u32| {
            let at = self.node(*node);
            (at[0] - centre[0]).abs().max((at[2] - centre[1]).abs())
        };
        let net = self.group("free_net");
        let inside: Vec<u32> = net.iter().copied().filter(|node| off(node) <= half).collect();
        let nearest = || net.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)));
        if inside.is_empty() { nearest().into_iter().collect() } else { inside }
    }
}

impl Part {
    fn of(table: &Table, mesh: &InterfaceMesh) -> Option<Self> {
        let text = |key: &str| table.get(key).and_then(Value::as_str).map(str::to_owned);
        let name = text("name")?;
        let group = mesh.groups.iter().find(|group| group.name == name)?;
        let inside = |line: &&[u32; 2]| line.iter().all(|node| group.nodes.contains(node));
        // Of ropes and nets the most loaded member is named; brakes and posts are reported each.
        let each = matches!(text("element")?.as_str(), "brake" | "beam");
        let lines = mesh.lines.iter().filter(inside).copied().filter(|_| each).collect();
        Some(Self {
            members: lines,
            element: text("element")?,
            strength: number(table.get("rupture_force")),
            can_break: ["rupture_force", "rupture_strain", "strength"]
                .iter()
                .any(|key| table.contains_key(*key)),
            stroke: number(table.get("stroke")),
            name,
        })
    }

    /// Whether it is the net, and not a part that connects.
    pub fn is_net(&self) -> bool {
        self.name == "net"
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

/// A number, as it may be written.
pub fn number(value: Option<&Value>) -> Option<f64> {
    value.and_then(|value| value.as_float().or_else(|| value.as_integer().map(|n| n as f64)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two lines that sag: one along x through the middle, one beside; a block sees the part of them in its way.
    #[test]
    fn what_is_in_the_way_of_a_block_is_found_also_between_nodes() {
        let mesh = InterfaceMesh {
            coordinates: vec![-4.0, 0.0, 1.0, 4.0, 0.8, 1.0, -4.0, -1.0, 3.0, 4.0, -1.0, 3.0],
            lines: vec![[0, 1], [2, 3]],
            line_radius: vec![0.01, 0.01],
            ..InterfaceMesh::default()
        };
        let layout = Layout { mesh, parts: Vec::new(), resolved: Table::new() };
        let least = layout.in_the_way([0.0, 1.0], 0.5).expect("the first line");
        assert!((least - (0.35 - 0.01)).abs() < 1e-12, "{least}");
        assert_eq!(layout.in_the_way([0.0, 2.6], 0.5), Some(-1.01));
        assert_eq!(layout.in_the_way([0.0, 2.0], 0.5), None);
        assert_eq!(layout.in_the_way([6.0, 1.0], 0.5), None);
    }
}
