//! Pressure on triangles: it follows them, as a force on each corner of a third of pressure times area along the normal.
//!
//! ```text
//! f_a = p/6 n,   n = (b - a) x (c - a)          dn/da v = v x (b - c), and so on round the triangle
//! ```
//!
//! The stiffness of a single triangle is not symmetric; that of a surface is, but at its free edges, where the work of
//! pressure depends on the way. The solver takes the symmetric part.
//!
//! Source: Schweizerhof and Ramm (1984), Displacement dependent pressure loads in nonlinear finite element analyses,
//! Comput. Struct. 18, 1099.

use nalgebra::Vector3;
use std::array::from_fn;

/// Add the forces of `pressures` [Pa] on the faces of `loads` at the displacements `u` to `force` [N]. Returns the sum of
/// the squares of the forces on all corners [N2].
pub fn press(loads: &[TimedLoad], pressures: &[f64], u: &[f64], force: &mut [f64]) -> f64 {
    let mut squares = 0.0;
    for (load, pressure) in loads.iter().zip(pressures).filter(|(_, pressure)| **pressure != 0.0) {
        for face in &load.faces {
            let f = pressure / 6.0 * normal(&load.corners(face, u));
            squares += 3.0 * f.norm_squared();
            for node in face.nodes {
                for c in 0..3 {
                    force[c * load.node_count + node] += f[c];
                }
            }
        }
    }
    squares
}

/// Twice the area of a triangle along its normal [m2].
fn normal([a, b, c]: &[Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// Stiffness of a triangle due to the pressure, by rows: minus the derivative of its forces [N/m]. Local degrees
/// of freedom are x, y, z of one corner after the other.
pub fn face_tangent([a, b, c]: &[Vector3<f64>; 3], pressure: f64) -> [[f64; 9]; 9] {
    let columns = [c - b, a - c, b - a].map(|edge| -pressure / 6.0 * edge.cross_matrix());
    from_fn(|row| from_fn(|column| columns[column / 3][(row % 3, column % 3)]))
}

/// Degrees of freedom of a face in a structure of so many nodes.
pub fn dofs_of_face(face: &Face, node_count: usize) -> [usize; 9] {
    from_fn(|i| (i % 3) * node_count + face.nodes[i / 3])
}

/// One entry of loads with a history, or of pressures.
#[derive(Debug, Clone)]
pub struct TimedLoad {
    /// Factor of all of it over time.
    pub factor: Motion,
    /// Degrees of freedom and the force on each at the factor 1 [N, N m].
    pub forces: Vec<(usize, f64)>,
    /// Pressure on the faces at the factor 1 [Pa].
    pub pressure: f64,
    /// Faces that it acts on.
    pub faces: Vec<Face>,
    /// Number of nodes of the structure.
    pub node_count: usize,
}

/// A triangle under pressure.
#[derive(Debug, Clone)]
pub struct Face {
    /// Its nodes.
    pub nodes: [usize; 3],
    /// Their places as modelled [m].
    pub corners: [Vector3<f64>; 3],
}

impl TimedLoad {
    /// Corners of a face [m] at the displacements `u`.
    pub fn corners(&self, face: &Face, u: &[f64]) -> [Vector3<f64>; 3] {
        let n = self.node_count;
        [0, 1, 2].map(|i| {
            let node = face.nodes[i];
            face.corners[i] + Vector3::new(u[node], u[n + node], u[2 * n + node])
        })
    }
}

/// A displacement or a factor over time: straight between the rows of a table, constant before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    times: Vec<f64>,
    values: Vec<f64>,
    /// On a circle the values are angles [rad]: of cosine less 1, and of sine.
    circle: Option<[f64; 2]>,
}

impl Motion {
    /// From rows `[time [s], value]`. Refuses times that do not increase.
    pub fn new(rows: impl IntoIterator<Item = [f64; 2]>) -> Result<Self, String> {
        let (times, values): (Vec<f64>, Vec<f64>) =
            rows.into_iter().map(|[time, value]| (time, value)).unzip();
        if let Some([before, next]) = times.array_windows().find(|[before, next]| next <= before) {
            return Err(format!("the times of a table must increase, {next} s follows {before} s"));
        }
        Ok(Self { times, values, circle: None })
    }

    /// The same as angles [rad] on a circle: `cosine (cos a - 1) + sine sin a`.
    #[must_use]
    pub fn on_circle(self, cosine: f64, sine: f64) -> Self {
        Self { circle: Some([cosine, sine]), ..self }
    }

    /// A bound of its magnitude.
    pub fn size(&self) -> f64 {
        let most = self.values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        most * self.circle.map_or(1.0, |[cosine, sine]| cosine.hypot(sine))
    }

    /// Value at `time` [s].
    pub fn at(&self, time: f64) -> f64 {
        let value = self.straight(time);
        let Some([cosine, sine]) = self.circle else { return value };
        // cos a - 1 without cancellation.
        -2.0 * cosine * (0.5 * value).sin().powi(2) + sine * value.sin()
    }

    /// Value of the table at `time` [s].
    fn straight(&self, time: f64) -> f64 {
        let next = self.times.partition_point(|t| *t <= time);
        if next == 0 {
            return self.values.first().copied().unwrap_or(0.0);
        }
        if next == self.times.len() {
            return self.values[next - 1];
        }
        let (t0, t1) = (self.times[next - 1], self.times[next]);
        let (v0, v1) = (self.values[next - 1], self.values[next]);
        v0 + (v1 - v0) * ((time - t0) / (t1 - t0))
    }

    /// Mean value of the table from `start` to `end` [s], which lies behind it, to the last corner.
    pub fn mean(&self, start: f64, end: f64) -> f64 {
        let (mut time, mut value, mut sum) = (start, self.straight(start), 0.0);
        for (t, v) in self.corners(start, end).chain([(end, self.straight(end))]) {
            sum += 0.5 * (value + v) * (t - time);
            (time, value) = (t, v);
        }
        sum / (end - start)
    }

    /// Whether it stands still from `start` to `end` [s].
    pub fn rests(&self, start: f64, end: f64) -> bool {
        let value = self.straight(start);
        self.straight(end) == value && self.corners(start, end).all(|(_, v)| v == value)
    }

    /// The rows between `start` and `end` [s].
    fn corners(&self, start: f64, end: f64) -> impl Iterator<Item = (f64, f64)> {
        let all = self.times.iter().copied().zip(self.values.iter().copied());
        all.filter(move |(t, _)| *t > start && *t < end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(corners: [[f64; 3]; 3]) -> TimedLoad {
        TimedLoad {
            factor: Motion::new([[0.0, 1.0]]).expect("is one row"),
            forces: Vec::new(),
            pressure: 1.0,
            faces: vec![Face { nodes: [0, 1, 2], corners: corners.map(Vector3::from) }],
            node_count: 3,
        }
    }

    const CORNERS: [[f64; 3]; 3] = [[0.1, -0.2, 0.3], [1.2, 0.4, 0.0], [0.3, 1.5, 0.7]];

    #[test]
    fn a_face_gets_pressure_times_area_along_its_normal() {
        let load = load([[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
        let mut force = vec![0.0; 9];
        press(&[load], &[6.0], &[0.0; 9], &mut force);
        assert_eq!(force, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 6.0, 6.0, 6.0], "18 N along z");
    }

    #[test]
    fn the_stiffness_is_the_derivative_of_the_force() {
        let (load, pressure, step) = (load(CORNERS), 7.0, 1e-6);
        let u: Vec<f64> = (0..9).map(|i| 0.1 * f64::from(i).sin()).collect();
        let k = face_tangent(&load.corners(&load.faces[0], &u), pressure);
        let dofs = dofs_of_face(&load.faces[0], 3);
        for column in 0..9 {
            let force = |sign: f64| {
                let (mut at, mut force) = (u.clone(), vec![0.0; 9]);
                at[dofs[column]] += sign * step;
                press(std::slice::from_ref(&load), &[pressure], &at, &mut force);
                force
            };
            let (ahead, behind) = (force(1.0), force(-1.0));
            for row in 0..9 {
                let slope = -(ahead[dofs[row]] - behind[dofs[row]]) / (2.0 * step);
                assert!((k[row][column] - slope).abs() < 1e-8, "{row} {column}: {} {slope}", k[row][column]);
            }
        }
    }
}

#[cfg(test)]
mod motion_tests {
    use super::*;

    #[test]
    fn it_is_straight_between_rows_and_constant_outside() {
        let motion = Motion::new([[1.0, 0.0], [3.0, 4.0]]).expect("increases");
        assert_eq!([0.0, 1.0, 1.5, 3.0, 9.0].map(|t| motion.at(t)), [0.0, 0.0, 1.0, 4.0, 4.0]);
        assert!(motion.rests(0.0, 1.0) && motion.rests(3.0, 5.0));
        assert!(!motion.rests(0.5, 1.5) && !motion.rests(0.0, 9.0));
    }

    #[test]
    fn there_and_back_inside_a_window_is_no_rest() {
        let motion = Motion::new([[1.0, 0.0], [1.1, 1.0], [1.2, 0.0]]).expect("increases");
        assert!(!motion.rests(0.9, 1.3));
    }

    #[test]
    fn the_mean_counts_every_corner() {
        // A triangle of height 2 over 1 s to 3 s: an area of 2.
        let table = Motion::new([[1.0, 0.0], [2.0, 2.0], [3.0, 0.0]]).expect("increases");
        let mean = |a, b| table.mean(a, b);
        assert_eq!([mean(0.0, 4.0), mean(1.0, 2.0), mean(1.5, 2.5), mean(5.0, 6.0)], [0.5, 1.0, 1.5, 0.0]);
    }

    #[test]
    fn times_that_do_not_increase_are_refused() {
        assert!(Motion::new([[1.0, 0.0], [1.0, 1.0]]).is_err());
    }
}
