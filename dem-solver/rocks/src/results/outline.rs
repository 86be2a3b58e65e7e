//! Where a rock is in relation to the net: in front of it, within its outline, over, beside or under it.
//!
//! All is seen along a direction, that of the impact or of the flight. A point lies within the outline if each of sixteen
//! rays from it, at right angles to that direction, crosses a line or an edge of the net: a net of any form has an outline
//! so, with its holes, and a rope that leads away from it adds nothing. Where the net lies along the direction is the
//! mean of what the rays cross, the nearer the more. Torn lines still count: a rock that leaves by a hole goes through.
//!
//! Nothing here is asked in a step: a rock that has lost contact is judged once each time it has moved on by its own size.

use dem_contact::contact::broad_phase::mesh_elements::inverse_square;
use dem_contact::interface_mesh::{ContactMesh, Kind};
use dem_contact::rock::{Motion, Rock};
use dem_solid::geometry::closest::{on_face, on_line};
use dem_terrain::queries::Parabola;
use interface_defs::verdict::Fate;
use nalgebra::Vector3;

/// Rays by which the net is found around a point.
const RAYS: usize = 16;

/// The net at one moment.
pub struct Outline<'a, F: Fn(u32) -> Vector3<f64>> {
    /// The net.
    pub contact_mesh: &'a ContactMesh,
    /// Position of a node [m].
    pub at: F,
}

/// The point of a net that is closest to another point.
#[derive(Debug, Clone, Copy)]
pub struct NearestOfNet {
    /// From the other point to it [m].
    pub to_point: Vector3<f64>,
    /// Radius of the line that it is on [m].
    pub radius: f64,
}

impl<F: Fn(u32) -> Vector3<f64>> Outline<'_, F> {
    /// The closest point to `centre`, of lines by their axes; `None` without any element.
    pub fn closest(&self, centre: &Vector3<f64>) -> Option<NearestOfNet> {
        let mut best: Option<(f64, NearestOfNet)> = None;
        for element in &self.contact_mesh.elements {
            let [a, b, c] = element.nodes.map(&self.at);
            let edge = b - a;
            let to_point = match element.kind {
                Kind::Face => on_face(centre, [&a, &b, &c]).to_point,
                Kind::Line | Kind::Point => on_line(centre, &a, &edge, inverse_square(&edge)).to_point,
            };
            let distance = to_point.norm() - element.radius;
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, NearestOfNet { to_point, radius: element.radius }));
            }
        }
        best.map(|(_, near)| near)
    }

    /// How far before `centre` the net lies along the unit vector `direction` [m], negative behind it;
    /// `None` outside of its outline.
    pub fn before(&self, centre: &Vector3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let across = any_normal(direction);
        let up = direction.cross(&across);
        let seen = |n: u32| {
            let to = (self.at)(n) - centre;
            [to.dot(&across), to.dot(&up), to.dot(direction)]
        };
        let mut rays = Rays::new();
        for element in &self.contact_mesh.elements {
            let own = element.own_nodes();
            if let [a, b] = *own {
                rays.cross(&seen(a), &seen(b));
            } else if let [a, b, c] = *own {
                let corners = [seen(a), seen(b), seen(c)];
                if let Some(depth) = within(&corners) {
                    return Some(depth);
                }
                (0..3).for_each(|k| rays.cross(&corners[k], &corners[(k + 1) % 3]));
            }
        }
        rays.mean()
    }

    /// Has a rock whose centre is at `centre`, moving along `direction`, the net behind it, and how did it get there?
    /// `None`: the net is before it.
    pub fn passed(&self, centre: &Vector3<f64>, direction: &Vector3<f64>, up: &Vector3<f64>) -> Option<Fate> {
        if let Some(before) = self.before(centre, direction) {
            return (before < 0.0).then_some(Fate::WentThrough);
        }
        let near = self.closest(centre)?;
        let before = near.to_point.dot(direction);
        (before < 0.0).then(|| side(&-(near.to_point - direction * before), up))
    }

    /// The closest that a rock in flight comes to the net: when [s] and where, within `horizon` [s] to either side.
    pub fn approach(&self, flight: &Parabola, horizon: f64) -> Option<(f64, Vector3<f64>, NearestOfNet)> {
        let (mut middle, mut half, mut best) = (0.0, horizon, None);
        // Thirty-two points of the flight, then ever closer around the best of them.
        for _ in 0..12 {
            let looks = (0..=32).map(|k| middle + half * (f64::from(k) / 16.0 - 1.0));
            let seen = looks.filter_map(|t| Some((t, self.closest(&flight.at(t))?)));
            let distance = |near: &NearestOfNet| near.to_point.norm() - near.radius;
            let (t, near) = seen.min_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1)))?;
            (middle, half, best) = (t, half / 12.0, Some((t, flight.at(t), near)));
        }
        best
    }
}

/// On which side of the net a rock is that lies `away` from its edge.
pub fn side(away: &Vector3<f64>, up: &Vector3<f64>) -> Fate {
    let (length, above) = (away.norm(), away.dot(up));
    match above {
        _ if above > length * std::f64::consts::FRAC_1_SQRT_2 => Fate::PassedOver,
        _ if above < -length * std::f64::consts::FRAC_1_SQRT_2 => Fate::PassedUnder,
        _ => Fate::PassedBeside,
    }
}

/// Free space between a rock and the closest point of the net [m].
pub fn clearance(rock: &Rock, motion: &Motion, near: &NearestOfNet) -> f64 {
    let Some(direction) = near.to_point.try_normalize(0.0) else { return 0.0 };
    let extent = rock.depth(motion, &direction) - motion.position.dot(&direction);
    near.to_point.norm() - near.radius - extent
}

/// A unit vector at right angles to another.
fn any_normal(direction: &Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    axis[direction.iamin()] = 1.0;
    direction.cross(&axis).normalize()
}

/// Depth at the origin of the triangle of these corners, if the origin lies in it as it is seen.
fn within(corners: &[[f64; 3]; 3]) -> Option<f64> {
    let [a, b, c] = corners;
    let area = |p: &[f64; 3], q: &[f64; 3]| p[0] * q[1] - p[1] * q[0];
    let shares = [area(b, c), area(c, a), area(a, b)];
    let total: f64 = shares.iter().sum();
    let inside = total != 0.0 && shares.iter().all(|s| s * total >= 0.0);
    inside.then(|| shares.iter().zip(corners).map(|(s, p)| s * p[2]).sum::<f64>() / total)
}

/// What rays from the origin cross: for each the nearest crossing, its distance and depth.
struct Rays {
    directions: [[f64; 2]; RAYS],
    nearest: [Option<(f64, f64)>; RAYS],
}

impl Rays {
    fn new() -> Self {
        // Not along the axes, which lines of nets like to follow.
        let angle = |k: usize| (k as f64 + 0.37) * std::f64::consts::TAU / RAYS as f64;
        let directions = std::array::from_fn(|k| [angle(k).cos(), angle(k).sin()]);
        Self { directions, nearest: [None; RAYS] }
    }

    fn cross(&mut self, a: &[f64; 3], b: &[f64; 3]) {
        for (direction, nearest) in self.directions.iter().zip(&mut self.nearest) {
            let off = |p: &[f64; 3]| direction[0] * p[1] - direction[1] * p[0];
            let (left, right) = (off(a), off(b));
            if (left >= 0.0) == (right >= 0.0) {
                continue;
            }
            let share = left / (left - right);
            let along = |p: &[f64; 3]| direction[0] * p[0] + direction[1] * p[1];
            let distance = along(a) + share * (along(b) - along(a));
            if distance >= 0.0 && nearest.is_none_or(|(least, _)| distance < least) {
                *nearest = Some((distance, a[2] + share * (b[2] - a[2])));
            }
        }
    }

    /// Mean depth of all crossings, the nearer the more; `None` if a ray crosses nothing.
    fn mean(&self) -> Option<f64> {
        let (mut sum, mut weights) = (0.0, 0.0);
        for nearest in &self.nearest {
            let (distance, depth) = (*nearest)?;
            let weight = 1.0 / distance.max(f64::MIN_POSITIVE.sqrt());
            (sum, weights) = (sum + weight * depth, weights + weight);
        }
        Some(sum / weights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::InterfaceMesh;

    /// An upright net of 4 x 2 cells of 0.5 m in the plane x = 1 + z / 10, from (y, z) = (0, 0) on.
    fn net() -> ContactMesh {
        let mut mesh = InterfaceMesh::default();
        for k in 0..3 {
            for j in 0..5 {
                let (y, z) = (0.5 * f64::from(j), 0.5 * f64::from(k));
                mesh.coordinates.extend([1.0 + 0.1 * z, y, z]);
                let a = (5 * k + j) as u32;
                mesh.lines.extend((j < 4).then_some([a, a + 1]));
                mesh.lines.extend((k < 2).then_some([a, a + 5]));
            }
        }
        ContactMesh::new(&mesh).expect("valid")
    }

    #[test]
    fn the_outline_of_a_net_is_its_rectangle_and_its_depth_is_that_of_its_plane() {
        let contact_mesh = net();
        let outline = Outline { contact_mesh: &contact_mesh, at: |n| contact_mesh.nodes[n as usize] };
        let along = Vector3::x();
        for k in 0..60 {
            for j in 0..100 {
                let (y, z) = (-0.487 + 0.031 * f64::from(j), -0.477 + 0.033 * f64::from(k));
                let before = outline.before(&Vector3::new(0.0, y, z), &along);
                let inside = (0.0..2.0).contains(&y) && (0.0..1.0).contains(&z);
                assert_eq!(before.is_some(), inside, "{y} {z}");
                if let Some(before) = before {
                    // A cell's wires are up to half a cell above or below.
                    assert!((before - 1.0 - 0.1 * z).abs() < 0.05, "{y} {z}: {before}");
                }
            }
        }
    }

    #[test]
    fn a_rope_that_leads_away_from_the_net_does_not_widen_its_outline() {
        let mut mesh = InterfaceMesh::default();
        mesh.coordinates
            .extend([1.0, 0.0, 0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 1.0, 1.0, 0.0, 1.0, -3.0, -1.0, 4.0]);
        mesh.coordinates.extend([-3.0, 3.0, 4.0]);
        mesh.lines = vec![[0, 1], [1, 2], [2, 3], [3, 0], [3, 4], [2, 5]];
        let contact_mesh = ContactMesh::new(&mesh).expect("valid");
        let outline = Outline { contact_mesh: &contact_mesh, at: |n| contact_mesh.nodes[n as usize] };
        assert!(outline.before(&Vector3::new(0.0, 1.0, 0.9), &Vector3::x()).is_some());
        assert!(outline.before(&Vector3::new(0.0, 1.0, 1.5), &Vector3::x()).is_none(), "over the top rope");
    }

    #[test]
    fn what_has_the_net_behind_it_has_passed_on_the_side_where_it_is() {
        let contact_mesh = net();
        let outline = Outline { contact_mesh: &contact_mesh, at: |n| contact_mesh.nodes[n as usize] };
        let (along, up) = (Vector3::x(), Vector3::z());
        let passed = |x: f64, y: f64, z: f64| outline.passed(&Vector3::new(x, y, z), &along, &up);
        assert_eq!(passed(0.5, 1.0, 0.6), None);
        assert_eq!(passed(1.5, 1.0, 0.6), Some(Fate::WentThrough));
        assert_eq!(passed(1.5, 1.0, 1.6), Some(Fate::PassedOver));
        assert_eq!(passed(1.5, 1.0, -0.6), Some(Fate::PassedUnder));
        assert_eq!(passed(1.5, 2.6, 0.6), Some(Fate::PassedBeside));
        assert_eq!(passed(0.5, 2.6, 0.6), None);
    }

    #[test]
    fn the_closest_approach_of_a_flight_is_that_of_the_parabola() {
        let contact_mesh = net();
        let outline = Outline { contact_mesh: &contact_mesh, at: |n| contact_mesh.nodes[n as usize] };
        let mut flight = Parabola {
            position: Vector3::new(1.1, 1.0, 3.0),
            velocity: Vector3::new(10.0, 0.0, 0.0),
            gravity: Vector3::zeros(),
        };
        // Straight, at right angles to the upright wires: 2 m over the top rope, which lies at x = 1.1.
        let (t, at, near) = outline.approach(&flight, 1.0).expect("a net");
        // A smallest distance is flat: its place is known to the root of rounding.
        assert!(t.abs() < 1e-7 && (at - flight.position).norm() < 1e-6, "{t}");
        assert!((near.to_point - Vector3::new(0.0, 0.0, -2.0)).norm() < 1e-6);
        // On a parabola: the distance at the found time is least.
        flight.gravity.z = -9.81;
        let (t, _, near) = outline.approach(&flight, 1.0).expect("a net");
        let distance = |t: f64| {
            let at = flight.position + (flight.velocity + flight.gravity * (0.5 * t)) * t;
            outline.closest(&at).expect("a net").to_point.norm()
        };
        let least = (0..=200_000).map(|k| distance(f64::from(k) * 1e-5 - 1.0)).fold(f64::INFINITY, f64::min);
        assert!((near.to_point.norm() - least).abs() < 1e-8 && t.abs() < 1.0, "{t} {least}");
    }
}
