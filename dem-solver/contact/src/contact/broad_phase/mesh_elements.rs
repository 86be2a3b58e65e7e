//! Wall elements around a rock, and which of them it may reach in a window.

use crate::interface_mesh::motion::NodeMotion;
use crate::interface_mesh::{ContactMesh, Kind};
use crate::rock::{Motion, Rock};
use dem_solid::geometry::closest::{on_face, on_line};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// An element near a rock: its number in the mesh and its nodes in [`NearList::nodes`].
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct NearElement {
    /// Number in the mesh.
    pub number: u32,
    /// Its nodes, as places in [`NearList::nodes`].
    pub nodes: [u32; 3],
}

/// Elements that were within some distance of a rock's centre when the list was made.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct NearList {
    /// The elements, in the mesh's order, without broken ones.
    pub elements: Vec<NearElement>,
    /// Their nodes, each once.
    pub nodes: Vec<u32>,
    centre: Vector3<f64>,
    coverage: f64,
    /// Distance of the nearest element from the rock's centre when the list was made [m].
    pub nearest: f64,
    place: Vec<u32>,
}

impl NearList {
    /// An empty list with room for everything there is.
    pub fn new(contact_mesh: &ContactMesh) -> Self {
        Self {
            elements: Vec::with_capacity(contact_mesh.elements.len()),
            nodes: Vec::with_capacity(contact_mesh.nodes.len()),
            centre: Vector3::zeros(),
            coverage: f64::NEG_INFINITY,
            nearest: f64::NEG_INFINITY,
            place: vec![u32::MAX; contact_mesh.nodes.len()],
        }
    }

    /// True if every element within `need` [m] of `centre` is listed, now that no node is further
    /// than `moved` [m] from where it was when the list was made.
    pub fn covers(&self, centre: &Vector3<f64>, moved: f64, need: f64) -> bool {
        self.coverage - (centre - self.centre).norm() - moved >= need
    }

    /// How far from a rock at `at`, as it was when the list was made, nothing is left out [m]; and where that was.
    pub fn coverage(&self) -> (f64, Vector3<f64>) {
        (self.coverage, self.centre)
    }

    /// Distance of the nearest listed element from `centre` at the end of the window that `motion` is of [m].
    pub fn nearest_to(&self, contact_mesh: &ContactMesh, motion: &NodeMotion, centre: &Vector3<f64>) -> f64 {
        let at = |node: u32| motion.last(node as usize);
        let distances = self.elements.iter().map(|element| {
            let [a, b, c] = element.nodes.map(at);
            distance(contact_mesh.elements[element.number as usize].kind, centre, [&a, &b, &c])
        });
        distances.fold(f64::INFINITY, f64::min)
    }

    /// The list is no longer good.
    pub fn invalidate(&mut self) {
        (self.coverage, self.nearest) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    }

    /// List the elements within `coverage` [m] of `centre`; `at` gives each node's position [m].
    pub fn build(
        &mut self,
        contact_mesh: &ContactMesh,
        at: impl Fn(u32) -> Vector3<f64>,
        centre: Vector3<f64>,
        coverage: f64,
    ) {
        (self.centre, self.coverage) = (centre, coverage);
        for node in self.nodes.drain(..) {
            self.place[node as usize] = u32::MAX;
        }
        self.elements.clear();
        let mut nearest = f64::INFINITY;
        for (number, element) in (0..).zip(&contact_mesh.elements) {
            if contact_mesh.broken.get(number as usize) == Some(&true) {
                continue;
            }
            let [a, b, c] = element.nodes.map(&at);
            let distance = distance(element.kind, &centre, [&a, &b, &c]);
            nearest = nearest.min(distance);
            if distance > coverage {
                continue;
            }
            let nodes = element.nodes.map(|node| {
                let place = &mut self.place[node as usize];
                if *place == u32::MAX {
                    *place = self.nodes.len() as u32;
                    self.nodes.push(node);
                }
                *place
            });
            self.elements.push(NearElement { number, nodes });
        }
        self.nearest = nearest.min(FAR);
        if self.elements.is_empty() {
            // An empty list is good until the nearest element is near.
            self.coverage = self.nearest;
        }
    }
}

/// Coverage of a list of a mesh without elements [m].
const FAR: f64 = 1e9;

/// Distance of an element from `centre` [m].
fn distance(kind: Kind, centre: &Vector3<f64>, [a, b, c]: [&Vector3<f64>; 3]) -> f64 {
    let closest = match kind {
        Kind::Point => return (a - centre).norm(),
        Kind::Line => {
            let edge = b - a;
            on_line(centre, a, &edge, inverse_square(&edge))
        }
        Kind::Face => on_face(centre, [a, b, c]),
    };
    closest.to_point.norm()
}

/// `1 / |edge|^2`, 0 for an edge without length.
#[inline]
pub fn inverse_square(edge: &Vector3<f64>) -> f64 {
    let square = edge.norm_squared();
    if square > 0.0 { 1.0 / square } else { 0.0 }
}

/// How far a rock may come in a window in which nothing holds it up: what may be reached follows
/// from the committed state, the window and the mesh's motion alone.
#[derive(Debug, Clone, Copy)]
pub struct Sweep {
    /// Furthest that the centre flies [m].
    pub travel: f64,
    /// Allowance for everything that is not the straight flight of the unturned rock [m].
    allowance: f64,
    gravity: Vector3<f64>,
    length: f64,
}

/// Share of the smallest radius by which reach is widened: an element that comes this close counts.
const MARGIN: f64 = 0.1;

impl Sweep {
    /// For a window of `length` [s], the mesh's motion in `segments` parts, of a rock that something else than the mesh may
    /// throw `kick` [m] off its flight.
    pub fn new(
        rock: &Rock,
        motion: &Motion,
        gravity: &Vector3<f64>,
        (length, segments): (f64, usize),
        kick: f64,
    ) -> Self {
        let part = length / segments as f64;
        // A rock that is being braked leaves the flight by as much as its last acceleration says. On the ground that is the
        // acceleration of a contact that may be over long before the window is.
        let braked = 0.5 * (motion.acceleration - gravity).norm() * length * length;
        let braked = if kick > 0.0 { braked.min(kick) } else { braked };
        let bend = 0.125 * gravity.norm() * part * part;
        // However far it turns, a point of it stays within its reach.
        let turn = (motion.angular_momentum.norm() / rock.inertia.min() * length).min(2.0) * rock.reach;
        Self {
            travel: (motion.velocity.norm() + 0.5 * gravity.norm() * length) * length + braked,
            allowance: braked + bend + turn + kick + MARGIN * rock.smallest_radius,
            gravity: *gravity,
            length,
        }
    }

    /// Distance from the rock's centre within which elements may be reached, the mesh's own motion
    /// left out [m].
    pub fn need(&self, rock: &Rock, contact_mesh: &ContactMesh) -> f64 {
        rock.reach + contact_mesh.largest_radius + self.travel + self.allowance
    }

    /// Calls `found` with each listed element that the rock may reach; `found` ends it by returning
    /// false.
    ///
    /// An element counts if it overlaps the box around all spheres, seen from the flying rock, and was
    /// within [`Sweep::need`] (and its own displacement) at the start. Both conditions leave the list aside,
    /// so that equal input gives equal answers.
    pub fn reached(
        &self,
        rock: &Rock,
        motion: &Motion,
        contact_mesh: &ContactMesh,
        (near, nodes): (&NearList, &NodeMotion),
        boxes: &mut Vec<NodeBox>,
        mut found: impl FnMut(&NearElement) -> bool,
    ) {
        self.boxes(motion, near, nodes, boxes);
        let need = self.need(rock, contact_mesh);
        for element in &near.elements {
            let kind = contact_mesh.elements[element.number as usize].kind;
            let grow = self.allowance + contact_mesh.elements[element.number as usize].radius;
            let [a, b, c] = element.nodes.map(|n| &boxes[n as usize]);
            let lowest = a.lowest.inf(&b.lowest).inf(&c.lowest).add_scalar(-grow);
            let highest = a.highest.sup(&b.highest).sup(&c.highest).add_scalar(grow);
            let meets = |axis: usize| {
                lowest[axis] <= rock.highest_corner[axis] && highest[axis] >= rock.lowest_corner[axis]
            };
            if !(meets(0) && meets(1) && meets(2)) {
                continue;
            }
            let travel = a.travel.max(b.travel).max(c.travel);
            let [a, b, c] = element.nodes.map(|n| nodes.position(0, n as usize, 0.0));
            if distance(kind, &motion.position, [&a, &b, &c]) <= need + travel && !found(element) {
                return;
            }
        }
    }

    fn boxes(&self, motion: &Motion, near: &NearList, nodes: &NodeMotion, boxes: &mut Vec<NodeBox>) {
        let to_own = motion.rotation().transpose();
        let segments = nodes.segments();
        boxes.clear();
        for a in 0..near.nodes.len() {
            let start = nodes.position(0, a, 0.0);
            let first = to_own * (start - motion.position);
            let mut node = NodeBox { lowest: first, highest: first, travel: 0.0 };
            for s in 0..segments {
                let t = self.length * (s + 1) as f64 / segments as f64;
                let rock = motion.position + (motion.velocity + self.gravity * (0.5 * t)) * t;
                let position = nodes.position(s, a, 1.0);
                let seen = to_own * (position - rock);
                node.lowest = node.lowest.inf(&seen);
                node.highest = node.highest.sup(&seen);
                node.travel = node.travel.max((position - start).norm());
            }
            boxes.push(node);
        }
    }
}

/// Where a node is during a window, seen from the flying rock in its own axes.
#[derive(Debug, Clone, Copy)]
pub struct NodeBox {
    lowest: Vector3<f64>,
    highest: Vector3<f64>,
    /// Largest distance from its start in space [m].
    travel: f64,
}
