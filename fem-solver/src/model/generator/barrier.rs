//! A barrier as a whole: posts, net, ropes, brakes, anchors.
//!
//! Geometry, names and sources are described at [`Barrier`].

use super::nets::{Contacts, Generated, MadeFor, diagonal_rings, named};
use super::site::Site;
use crate::config::generator::{Barrier, BarrierNet};
use crate::read::mesh::{ElementGroup, Kind, Mesh};
use nalgebra::Vector3;

/// Half of the width of a block of 3 200 kg [m].
const HALF_BLOCK: f64 = 0.6;

/// The barrier as a mesh with named parts; in axes of its own, or where `site` says.
pub fn barrier(table: &Barrier, site: Option<&Site>) -> Generated {
    let rise = (table.height * table.height - table.lean() * table.lean()).sqrt();
    let mut work = Work {
        table,
        site,
        mesh: Mesh::default(),
        parts: Vec::new(),
        post: Vector3::new(0.0, table.lean(), rise),
        at: BarrierNodes::default(),
    };
    match table.net {
        BarrierNet::Rings => work.rings(),
        BarrierNet::Square | BarrierNet::DiagonalRings => work.square_net(),
    }
    work.posts();
    work.bearing_ropes();
    work.upslope_ropes();
    work.finish()
}

/// A barrier in the making.
struct Work<'a> {
    table: &'a Barrier,
    /// Its place; `None`: in axes of its own.
    site: Option<&'a Site>,
    mesh: Mesh,
    parts: Vec<MadeFor>,
    /// Up along a post, of the post's length [m].
    post: Vector3<f64>,
    at: BarrierNodes,
}

/// Its nodes.
#[derive(Default)]
struct BarrierNodes {
    feet: Vec<usize>,
    heads: Vec<usize>,
    side_anchors: Vec<usize>,
    upslope_anchors: Vec<usize>,
    /// Every node of the net, and where along the line it lies, in fields.
    net: Vec<(usize, f64)>,
    /// Nodes of ropes and net along the feet, along the heads, and along the two sides, in order.
    bottom: Vec<usize>,
    top: Vec<usize>,
    sides: [Vec<usize>; 2],
}

impl Work<'_> {
    fn node(&mut self, at: Vector3<f64>) -> usize {
        self.mesh.nodes.push(at);
        self.mesh.nodes.len() - 1
    }

    /// Half of the length of the barrier [m].
    fn half(&self) -> f64 {
        0.5 * self.table.fields as f64 * self.table.spacing()
    }

    /// A point of the net: `fields` along the feet from the first, `along` the same in its own axes [m], `up` in parts of a post.
    fn in_net(&self, fields: f64, along: f64, up: f64) -> Vector3<f64> {
        match self.site {
            Some(site) => site.in_net(fields, up),
            None => Vector3::new(along - self.half(), 0.0, 0.0) + up * self.post,
        }
    }

    /// A node of the net, `cells` along it and `up` in parts of a post.
    fn net_node(&mut self, cells: f64, up: f64) {
        let per_field = self.table.cells[0] as f64;
        let cell = self.table.spacing() / per_field;
        let node = self.node(self.in_net(cells / per_field, cell * cells, up));
        self.at.net.push((node, cells / per_field));
    }

    /// Anchors beside the first and the last post; `rope` 0: of the bottom rope, 1: of the top rope.
    fn side_anchors(&self, rope: usize) -> [Vector3<f64>; 2] {
        if let Some(site) = self.site {
            return site.sides[rope];
        }
        let share = [0.5, 1.0][rope];
        let beyond = self.half() + share * self.table.side_distance;
        [-beyond, beyond].map(|x| Vector3::new(x, 0.0, 0.0))
    }

    /// The two anchors in the slope of post `k`.
    fn anchors_of(&self, k: usize) -> [Vector3<f64>; 2] {
        if let Some(site) = self.site {
            return site.upslope[k];
        }
        let x = self.table.spacing() * k as f64 - self.half();
        [-1.0, 1.0].map(|sign| {
            let across = sign * 0.25 * self.table.spacing();
            Vector3::new(x + across, -self.table.anchor_distance, self.table.anchor_rise())
        })
    }

    fn part(&mut self, group: &'static str, element: &'static str, elements: Vec<(Kind, Vec<usize>)>) {
        let elements = elements.iter().map(|(kind, nodes)| self.mesh.push(*kind, nodes)).collect();
        self.mesh.element_groups.push(ElementGroup { name: group.into(), elements });
        self.parts.push(MadeFor { group, element });
    }

    /// Cables between the ropes; along ropes there are none, the ropes are there. Or a ring in every second cell. Feet and heads are
    /// corners of the net.
    fn square_net(&mut self) {
        let [per_field, rows] = self.table.cells;
        let columns = per_field * self.table.fields;
        let number = |i: usize, j: usize| j * (columns + 1) + i;
        let mut cables = Vec::new();
        for j in 0..=rows {
            for i in 0..=columns {
                self.net_node(i as f64, j as f64 / rows as f64);
                if i < columns && j > 0 && j < rows {
                    cables.push((Kind::Line2, vec![number(i, j), number(i + 1, j)]));
                }
                if j < rows && i > 0 && i < columns {
                    cables.push((Kind::Line2, vec![number(i, j), number(i, j + 1)]));
                }
            }
        }
        self.at.bottom = (0..=columns).map(|i| number(i, 0)).collect();
        self.at.top = (0..=columns).map(|i| number(i, rows)).collect();
        self.at.sides = [0, columns].map(|i| (0..=rows).map(|j| number(i, j)).collect());
        self.at.feet = (0..=self.table.fields).map(|k| number(k * per_field, 0)).collect();
        self.at.heads = (0..=self.table.fields).map(|k| number(k * per_field, rows)).collect();
        if self.table.net == BarrierNet::DiagonalRings {
            let rings = diagonal_rings([columns, rows]).map(|ring| (Kind::Quad4, ring.to_vec()));
            self.part("net", "ring", rings.collect());
        } else {
            self.part("net", "cable", cables);
        }
    }

    /// A ring in each cell; feet and heads are nodes of the ropes alone.
    fn rings(&mut self) {
        let [per_field, rows] = self.table.cells;
        let columns = per_field * self.table.fields;
        let contacts = Contacts { rings: [columns, rows] };
        for [x, y] in contacts.places() {
            self.net_node(x, y / rows as f64);
        }
        for k in 0..=self.table.fields {
            let along = self.table.spacing() * k as f64;
            let foot = self.node(self.in_net(k as f64, along, 0.0));
            let head = self.node(self.in_net(k as f64, along, 1.0));
            self.at.feet.push(foot);
            self.at.heads.push(head);
            self.at.bottom.push(foot);
            self.at.top.push(head);
            if k < self.table.fields {
                let field = k * per_field..(k + 1) * per_field;
                self.at.bottom.extend(field.clone().map(|i| contacts.between(i, 0)));
                self.at.top.extend(field.map(|i| contacts.between(i, rows)));
            }
        }
        for (side, post, i) in [(0, 0, 0), (1, self.table.fields, columns)] {
            let nodes = (0..rows).map(|j| contacts.beside(i, j));
            self.at.sides[side] = std::iter::once(self.at.feet[post])
                .chain(nodes)
                .chain(std::iter::once(self.at.heads[post]))
                .collect();
        }
        let ring = |k: usize| (Kind::Quad4, contacts.of_ring(k % columns, k / columns).to_vec());
        self.part("net", "ring", (0..columns * rows).map(ring).collect());
    }

    fn posts(&mut self) {
        let (mut posts, count) = (Vec::new(), self.table.post_elements);
        for (foot, head) in self.at.feet.clone().into_iter().zip(self.at.heads.clone()) {
            let (from, to) = (self.mesh.nodes[foot], self.mesh.nodes[head]);
            let inner = (1..count).map(|i| self.node(from + (to - from) * (i as f64 / count as f64)));
            let nodes: Vec<usize> = inner.collect();
            let nodes = [&[foot], &nodes[..], &[head]].concat();
            posts.extend(nodes.windows(2).map(|pair| (Kind::Line2, pair.to_vec())));
        }
        self.part("posts", "beam", posts);
    }

    /// A node on the way from `anchor` to `towards`, a brake's length from the anchor.
    fn brake_end(&mut self, anchor: usize, towards: usize) -> usize {
        let (from, to) = (self.mesh.nodes[anchor], self.mesh.nodes[towards]);
        self.node(from + (to - from).normalize() * self.table.brake_length)
    }

    /// Top, bottom and side ropes, the brakes of the first two, and the ropes to the side.
    fn bearing_ropes(&mut self) {
        let sides = self.at.sides.clone().map(|nodes| (Kind::Row, nodes)).to_vec();
        self.part("side_ropes", "cable", sides);
        let mut brakes = Vec::new();
        let mut lateral = Vec::new();
        for (group, which, mut rope) in
            [("bottom_rope", 0, self.at.bottom.clone()), ("top_rope", 1, self.at.top.clone())]
        {
            let [before, behind] = self.side_anchors(which);
            let ends = [rope[0], rope[rope.len() - 1]];
            let [first, last] = [(before, ends[0]), (behind, ends[1])].map(|(at, end)| {
                let anchor = self.node(at);
                let brake = self.brake_end(anchor, end);
                self.at.side_anchors.push(anchor);
                brakes.push((Kind::Line2, vec![brake, anchor]));
                if group == "top_rope" {
                    lateral.push((Kind::Line2, vec![end, anchor]));
                }
                brake
            });
            rope.insert(0, first);
            rope.push(last);
            self.part(group, "sliding_cable", vec![(Kind::Row, rope)]);
        }
        self.part("rope_brakes", "brake", brakes);
        self.part("lateral_ropes", "cable", lateral);
    }

    /// Two ropes from each head to the slope, a quarter of a field to either side.
    fn upslope_ropes(&mut self) {
        let (mut ropes, mut brakes) = (Vec::new(), Vec::new());
        for k in 0..=self.table.fields {
            for at in self.anchors_of(k) {
                let anchor = self.node(at);
                let brake = self.brake_end(anchor, self.at.heads[k]);
                self.at.upslope_anchors.push(anchor);
                ropes.push((Kind::Line2, vec![self.at.heads[k], brake]));
                brakes.push((Kind::Line2, vec![brake, anchor]));
            }
        }
        self.part("upslope_ropes", "cable", ropes);
        self.part("upslope_brakes", "brake", brakes);
    }

    fn finish(mut self) -> Generated {
        let nodes = &self.mesh.nodes;
        let fields = (self.table.fields / 2) as f64 + 0.5;
        let middle = self.in_net(fields, self.table.spacing() * fields, 0.5);
        let BarrierNodes { feet, heads, side_anchors, upslope_anchors, net, .. } = &self.at;
        let inside = net.iter().filter(|(_, along)| (along - fields).abs() < 0.5 * (1.0 - 1e-9));
        let all = net.iter().map(|(n, _)| *n);
        let free: Vec<usize> = all.filter(|n| !feet.contains(n) && !heads.contains(n)).collect();
        // Feet and heads lie at its borders.
        let middle_field: Vec<usize> = inside.map(|(n, _)| *n).collect();
        let distance = |n: &usize| (nodes[*n] - middle).norm();
        let mut impact: Vec<usize> =
            middle_field.iter().copied().filter(|n| distance(n) <= HALF_BLOCK).collect();
        if impact.is_empty() {
            impact.extend(free.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))));
        }
        let anchors = [&side_anchors[..], upslope_anchors].concat();
        self.mesh.node_groups = [
            ("feet", feet),
            ("heads", heads),
            ("side_anchors", side_anchors),
            ("upslope_anchors", upslope_anchors),
            ("anchors", &anchors),
            ("free_net", &free),
            ("middle_field", &middle_field),
            ("impact", &impact),
        ]
        .map(|(name, nodes)| named(name, nodes))
        .to_vec();
        self.mesh.name_nodes();
        self.mesh.warnings.extend(self.site.iter().flat_map(|site| site.warnings.iter().cloned()));
        Generated { mesh: self.mesh, held: Vec::new(), parts: self.parts }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part<'a>(made: &'a Generated, name: &str) -> Vec<&'a [u32]> {
        let group = made.mesh.element_groups.iter().find(|g| g.name == name);
        let group = group.unwrap_or_else(|| panic!("there is no part {name}"));
        group.elements.iter().map(|e| made.mesh.nodes_of(&made.mesh.elements[*e as usize])).collect()
    }

    fn nodes<'a>(made: &'a Generated, name: &str) -> &'a [u32] {
        let group = made.mesh.node_groups.iter().find(|g| g.name == name);
        &group.unwrap_or_else(|| panic!("there is no group {name}")).nodes
    }

    fn length(made: &Generated, row: &[u32]) -> f64 {
        let at = |n: u32| made.mesh.nodes[n as usize];
        row.windows(2).map(|pair| (at(pair[1]) - at(pair[0])).norm()).sum()
    }

    fn all() -> [Generated; 3] {
        [BarrierNet::Square, BarrierNet::Rings, BarrierNet::DiagonalRings]
            .map(|net| barrier(&Barrier { net, lean: Some(1.0), cells: [6, 3], ..Barrier::default() }, None))
    }

    #[test]
    fn posts_ropes_and_brakes_have_the_lengths_of_the_drawing() {
        for made in all() {
            let posts = part(&made, "posts");
            assert_eq!(posts.len(), 4);
            assert!(posts.iter().all(|post| (length(&made, post) - 4.0).abs() < 1e-14));
            let head = made.mesh.nodes[nodes(&made, "heads")[0] as usize];
            assert!((head - Vector3::new(-15.0, 1.0, 15.0_f64.sqrt())).norm() < 1e-14);
            // From head to anchor: 5 m aside, 1 m back, sqrt(15) m down.
            let end = (25.0 + 1.0 + 15.0_f64).sqrt();
            let [top, bottom] = ["top_rope", "bottom_rope"].map(|name| length(&made, part(&made, name)[0]));
            // Sums of some twenty lengths of some metres.
            assert!((top - (30.0 + 2.0 * (end - 1.0))).abs() < 1e-13, "{top}");
            assert!((bottom - (30.0 + 2.0 * (2.5 - 1.0))).abs() < 1e-13, "{bottom}");
            for name in ["rope_brakes", "upslope_brakes"] {
                assert!(part(&made, name).iter().all(|brake| (length(&made, brake) - 1.0).abs() < 1e-14));
            }
            let upslope = (2.5 * 2.5 + 7.0 * 7.0 + (4.0 - 15.0_f64.sqrt()).powi(2)).sqrt() - 1.0;
            assert!(part(&made, "upslope_ropes").iter().all(|r| (length(&made, r) - upslope).abs() < 1e-14));
            assert!(part(&made, "lateral_ropes").iter().all(|r| (length(&made, r) - end).abs() < 1e-14));
            assert!(part(&made, "side_ropes").iter().all(|r| (length(&made, r) - 4.0).abs() < 1e-14));
        }
    }

    #[test]
    fn bearing_ropes_run_through_all_feet_and_heads_and_along_the_whole_edge_of_the_net() {
        for (made, edge) in all().iter().zip([19, 18 + 4]) {
            for (rope, posts) in [("bottom_rope", "feet"), ("top_rope", "heads")] {
                let row = part(made, rope)[0];
                assert_eq!(row.len(), edge + 2);
                assert!(nodes(made, posts).iter().all(|n| row.contains(n)), "{rope}");
                let x = |n: &u32| made.mesh.nodes[*n as usize].x;
                assert!(row.windows(2).all(|pair| x(&pair[0]) < x(&pair[1])), "{rope} runs forth and back");
            }
        }
    }

    #[test]
    fn the_parts_hang_together_through_shared_nodes() {
        for made in all() {
            let mut reached = vec![false; made.mesh.nodes.len()];
            reached[0] = true;
            let rows: Vec<&[u32]> = made.mesh.elements.iter().map(|e| made.mesh.nodes_of(e)).collect();
            let mut grown = true;
            while grown {
                grown = false;
                for row in &rows {
                    if row.iter().any(|n| reached[*n as usize]) && !row.iter().all(|n| reached[*n as usize]) {
                        row.iter().for_each(|n| reached[*n as usize] = true);
                        grown = true;
                    }
                }
            }
            assert!(reached.iter().all(|r| *r), "a node hangs on nothing");
            // Anchors end one element, or two: the top rope's brake and the lateral rope.
            for anchor in nodes(&made, "anchors") {
                let ends = rows.iter().filter(|row| row.contains(anchor)).count();
                assert!((1..=2).contains(&ends), "{ends} elements at an anchor");
            }
        }
    }

    #[test]
    fn groups_of_nodes_are_where_their_names_say() {
        for made in all() {
            assert_eq!((nodes(&made, "side_anchors").len(), nodes(&made, "upslope_anchors").len()), (4, 8));
            assert_eq!(nodes(&made, "anchors").len(), 12);
            let place = |n: &u32| made.mesh.nodes[*n as usize];
            // Their numbers, as the report of an approval test names them (docs/approval.md).
            let along = |group: &str| nodes(&made, group).iter().map(|n| place(n).x).collect::<Vec<_>>();
            assert_eq!(along("feet"), [-15.0, -5.0, 5.0, 15.0]);
            assert_eq!(along("side_anchors"), [-17.5, 17.5, -20.0, 20.0]);
            assert_eq!(along("upslope_anchors"), [-17.5, -12.5, -7.5, -2.5, 2.5, 7.5, 12.5, 17.5]);
            for (name, group) in [("rope_brakes", "side_anchors"), ("upslope_brakes", "upslope_anchors")] {
                let ends: Vec<u32> = part(&made, name).iter().map(|row| row[1]).collect();
                assert_eq!(ends, nodes(&made, group), "{name}");
            }
            assert!(nodes(&made, "middle_field").iter().all(|n| place(n).x.abs() < 5.0));
            let middle = Vector3::new(0.0, 0.5, 0.5 * 15.0_f64.sqrt());
            let nearest = |group: &str| {
                nodes(&made, group).iter().map(|n| (place(n) - middle).norm()).fold(f64::INFINITY, f64::min)
            };
            assert_eq!(nearest("impact"), nearest("free_net"), "the impact is in the middle of the barrier");
            for post in ["feet", "heads"] {
                assert!(nodes(&made, post).iter().all(|n| !nodes(&made, "free_net").contains(n)));
            }
        }
        let fine = barrier(&Barrier { cells: [40, 16], ..Barrier::default() }, None);
        // 0.25 m cells: the grid points of a circle of 2.4 cells.
        assert_eq!(nodes(&fine, "impact").len(), 21);
    }
}
