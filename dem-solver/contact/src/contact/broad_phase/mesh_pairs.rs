//! Pairs of a sphere and a mesh element that may touch.
//!
//! A pair is listed while its surfaces are closer than a skin. The list is good until the mesh, seen
//! from the rock, has moved by the skin: nodes relative to the rock's centre, and spheres by the
//! rock's turn.

use crate::contact::broad_phase::mesh_elements::{NearList, inverse_square};
use crate::interface_mesh::motion::NodeMotion;
use crate::interface_mesh::{ContactMesh, Kind};
use crate::rock::{Motion, Rock};
use dem_solid::geometry::closest::{on_face, on_line};
use dem_solid::geometry::sphere_tree::SphereTree;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Skin as a share of the smallest radius. Wider: fewer searches, more pairs that do not touch.
const SKIN: f64 = 0.3;
/// Of a rock that touches by its faces: the same share of so much of its radius.
const THIN: f64 = 0.3;

/// A sphere and an element that may touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct MeshPair {
    /// Number of the sphere in its rock.
    pub sphere: u32,
    /// Place of the element in [`MeshPairs::elements`], which has the mesh's order.
    pub element: u32,
}

/// An element that some pair names.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct PairElement {
    /// What it is.
    pub kind: Kind,
    /// Its nodes, as places in [`MeshPairs::nodes`].
    pub nodes: [u32; 3],
    /// Radius around the line [m].
    pub radius: f64,
    /// Number in the mesh.
    pub number: u32,
}

/// The pairs of one rock.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct MeshPairs {
    /// The pairs, by sphere, then element.
    pub pairs: Vec<MeshPair>,
    /// Elements that pairs name, in the mesh's order.
    pub elements: Vec<PairElement>,
    /// Nodes of those elements, as places in [`NearList::nodes`].
    pub nodes: Vec<u32>,
    /// The node's number in the mesh, for each of `nodes`.
    pub numbers: Vec<u32>,
    /// Times that the pairs were searched.
    pub searches: u64,
    valid: bool,
    /// Distance between surfaces up to which pairs are listed [m].
    pub skin: f64,
    /// Nodes relative to the rock's centre when the pairs were searched [m].
    relative: Vec<Vector3<f64>>,
    orientation: UnitQuaternion<f64>,
    /// Straight flight of the rock, against which the mesh's displacement is measured.
    course: Drift,
    /// For each sample of the mesh's motion: how far a node is from where the search saw it, relative
    /// to the rock on its course [m].
    slack: Vec<f64>,
    /// The search within the segment under way: the share of the segment at which it was made.
    searched: Option<(usize, f64)>,
    place: Vec<u32>,
}

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Drift {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    since: f64,
}

impl Drift {
    fn at(&self, elapsed: f64) -> Vector3<f64> {
        self.position + self.velocity * (elapsed - self.since)
    }
}

/// An instant of a window: segment of the mesh's motion, share of it, and time since the start [s].
#[derive(Debug, Clone, Copy)]
pub struct Instant {
    /// Segment.
    pub segment: usize,
    /// Share of the segment, 0 to 1.
    pub along: f64,
    /// Time since the window's start [s].
    pub elapsed: f64,
}

impl Instant {
    /// The same for nodes of which nothing but this instant is known.
    pub fn alone(self) -> Self {
        Self { segment: 0, along: 0.0, ..self }
    }
}

impl MeshPairs {
    /// An empty list with room for what a rock usually touches.
    pub fn new(rock: &Rock, contact_mesh: &ContactMesh, segments: usize) -> Self {
        let nodes = contact_mesh.nodes.len();
        Self {
            pairs: Vec::with_capacity(4 * rock.spheres.len() + 1024),
            elements: Vec::with_capacity(contact_mesh.elements.len()),
            nodes: Vec::with_capacity(nodes),
            numbers: Vec::with_capacity(nodes),
            skin: SKIN * if rock.faces.is_some() { THIN * rock.mean_radius() } else { rock.smallest_radius },
            relative: Vec::with_capacity(nodes),
            slack: vec![0.0; segments + 1],
            place: vec![u32::MAX; nodes],
            ..Self::default()
        }
    }

    /// The list is no longer good: its nodes are not those of the near list.
    pub fn invalidate(&mut self) {
        self.valid = false;
    }

    /// A window begins at `start` with this motion of the near nodes.
    pub fn begin(&mut self, start: &Motion, nodes: &NodeMotion) {
        self.searched = None;
        self.course = Drift { position: start.position, velocity: start.velocity, since: 0.0 };
        if self.valid {
            self.measure(nodes, 0);
        }
    }

    /// Measure the slack of the samples from number `first` on.
    fn measure(&mut self, nodes: &NodeMotion, first: usize) {
        for s in first..self.slack.len() {
            let (segment, along) = if s == 0 { (0, 0.0) } else { (s - 1, 1.0) };
            self.slack[s] = self.moved(nodes, (segment, along), &self.course.at(nodes.segment * s as f64));
        }
    }

    /// How far a node at the share `along` of `segment` is from where the search saw it, relative to a rock at `rock` [m].
    fn moved(&self, nodes: &NodeMotion, (segment, along): (usize, f64), rock: &Vector3<f64>) -> f64 {
        let mut most = 0.0_f64;
        for (a, seen) in self.relative.iter().enumerate() {
            let apart = (nodes.position(segment, a, along) - rock - seen).norm_squared();
            most = if apart > most { apart } else { most };
        }
        most.sqrt()
    }

    /// True if every pair that touches at `now` is listed.
    pub fn is_good(&self, rock: &Rock, now: &Motion, at: Instant) -> bool {
        if !self.valid {
            return false;
        }
        // Relative motion is linear within a segment, its length therefore below the chord.
        let (from, first) = match self.searched {
            Some((segment, along)) if segment == at.segment => (along, 0.0),
            _ => (0.0, self.slack[at.segment]),
        };
        let share = if from < 1.0 { (at.along - from) / (1.0 - from) } else { 0.0 };
        let moved = first + (self.slack[at.segment + 1] - first) * share;
        let off_course = (now.position - self.course.at(at.elapsed)).norm();
        moved + off_course + rock.rotation_since(&self.orientation, now) <= self.skin
    }

    /// The same for nodes that stand where `nodes` has them at this instant, whatever their course.
    pub fn is_good_for(&self, rock: &Rock, now: &Motion, nodes: &NodeMotion) -> bool {
        // What is not valid may be of other nodes than these.
        self.valid
            && self.moved(nodes, (0, 0.0), &now.position) + rock.rotation_since(&self.orientation, now)
                <= self.skin
    }

    /// Search the pairs at `now`; of nodes without a course these are good until [`MeshPairs::is_good_for`] says no.
    pub fn search(
        &mut self,
        rock: &Rock,
        tree: &SphereTree,
        contact_mesh: &ContactMesh,
        (near, nodes): (&NearList, &NodeMotion),
        now: &Motion,
        at: Instant,
    ) {
        self.searches += 1;
        self.valid = true;
        self.orientation = now.orientation;
        self.relative.clear();
        for a in 0..near.nodes.len() {
            self.relative.push(nodes.position(at.segment, a, at.along) - now.position);
        }
        self.pairs.clear();
        self.elements.clear();
        self.nodes.clear();
        self.numbers.clear();
        self.place[..near.nodes.len()].fill(u32::MAX);
        let to_own = now.rotation().transpose();
        for element in &near.elements {
            let it = &contact_mesh.elements[element.number as usize];
            let [a, b, c] = element.nodes.map(|n| to_own * self.relative[n as usize]);
            // The tree holds the spheres with their radii.
            let grow = it.radius + self.skin;
            let lowest = a.inf(&b).inf(&c).add_scalar(-grow);
            let highest = a.sup(&b).sup(&c).add_scalar(grow);
            let edge = b - a;
            // A point is a line without length.
            let inverse = inverse_square(&edge);
            let place = self.elements.len() as u32;
            let before = self.pairs.len();
            let pairs = &mut self.pairs;
            if let Some(faces) = &rock.faces {
                // One pair says that the element is near.
                if !faces.is_beside([&a, &b], grow) {
                    pairs.push(MeshPair { sphere: 0, element: place });
                }
            } else {
                tree.near(&lowest, &highest, |sphere| {
                    let ball = &rock.spheres[sphere as usize];
                    let closest = match it.kind {
                        Kind::Face => on_face(&ball.centre, [&a, &b, &c]),
                        Kind::Line | Kind::Point => on_line(&ball.centre, &a, &edge, inverse),
                    };
                    let limit = ball.radius + grow;
                    if closest.to_point.norm_squared() <= limit * limit {
                        pairs.push(MeshPair { sphere, element: place });
                    }
                });
            }
            if self.pairs.len() > before {
                let nodes = element.nodes.map(|n| self.place_of(n, near));
                let number = element.number;
                self.elements.push(PairElement { kind: it.kind, nodes, radius: it.radius, number });
            }
        }
        self.pairs.sort_unstable();
        self.course = Drift { position: now.position, velocity: now.velocity, since: at.elapsed };
        self.searched = Some((at.segment, at.along));
        if nodes.has_course() {
            self.measure(nodes, at.segment + 1);
        }
    }

    fn place_of(&mut self, node: u32, near: &NearList) -> u32 {
        let place = &mut self.place[node as usize];
        if *place == u32::MAX {
            *place = self.nodes.len() as u32;
            self.nodes.push(node);
            self.numbers.push(near.nodes[node as usize]);
        }
        *place
    }
}
