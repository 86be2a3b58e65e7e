//! A plane rod that bends and stretches, by shooting: the other way to the curves of frames.
//!
//! ```text
//! x' = (1 + N / EA) cos a,  z' = (1 + N / EA) sin a,  a = a_0 + turn,  turn' = M / EI,  M' = n_x z' - n_z x'
//! ```
//!
//! along the rod at rest; `n` is the force of what lies ahead on what lies behind, `N` its part along the rod. Fourth order
//! Runge-Kutta; what the rod's start does not know is found by Newton from what its end must be. One displacement is given,
//! and the load is one of the unknowns: limit points are points as any other.

use crate::curves::Frame;
use nalgebra::{Matrix4, Vector4};

/// Steps of Runge-Kutta on each side.
const STEPS: usize = 60;

/// Force at the start (2), moment or turn there, load.
type Unknowns = Vector4<f64>;

#[derive(Clone, Copy)]
struct At {
    x: f64,
    z: f64,
    turn: f64,
    moment: f64,
}

/// The rod of a frame.
pub struct Rod<'a> {
    frame: &'a Frame,
    unknowns: Unknowns,
    before: Unknowns,
    moved: [f64; 2],
}

impl<'a> Rod<'a> {
    /// At rest, without load.
    pub fn new(frame: &'a Frame) -> Self {
        Self { frame, unknowns: Unknowns::zeros(), before: Unknowns::zeros(), moved: [0.0; 2] }
    }

    /// Where the watched corner is, and what is wrong at the end.
    fn shoot(&self, unknowns: &Unknowns) -> ([f64; 2], [f64; 3]) {
        let f = self.frame;
        let (bending, axial) = (f.young * f.inertia, f.young * f.area);
        let [nx, nz, third, load] = [unknowns[0], unknowns[1], unknowns[2], unknowns[3]];
        let mut n = [nx, nz];
        let (moment, turn) = if f.clamped { (third, 0.0) } else { (0.0, third) };
        let mut at = At { x: f.corners[0][0], z: f.corners[0][1], turn, moment };
        let mut loaded = [0.0; 2];
        for (side, ends) in f.corners.windows(2).enumerate() {
            let (dx, dz) = (ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
            let (length, angle) = (dx.hypot(dz), dz.atan2(dx));
            let slope = |a: &At| {
                let (sin, cos) = (angle + a.turn).sin_cos();
                let stretch = 1.0 + (n[0] * cos + n[1] * sin) / axial;
                let (x, z) = (stretch * cos, stretch * sin);
                At { x, z, turn: a.moment / bending, moment: n[0] * z - n[1] * x }
            };
            let add = |a: &At, b: &At, h: f64| At {
                x: a.x + h * b.x,
                z: a.z + h * b.z,
                turn: a.turn + h * b.turn,
                moment: a.moment + h * b.moment,
            };
            let steps = (STEPS / f.cuts.len()).max(6);
            let h = length / steps as f64;
            for _ in 0..steps {
                let k1 = slope(&at);
                let k2 = slope(&add(&at, &k1, 0.5 * h));
                let k3 = slope(&add(&at, &k2, 0.5 * h));
                let k4 = slope(&add(&at, &k3, h));
                for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                    at = add(&at, &k, weight * h / 6.0);
                }
            }
            if side + 1 == f.watched {
                let [x, z] = f.corners[side + 1];
                loaded = [at.x - x, at.z - z];
            }
            for (_, force) in f.loads.iter().filter(|(corner, _)| *corner == side + 1) {
                n = [n[0] - load * force[0], n[1] - load * force[1]];
            }
        }
        let end = f.corners[f.corners.len() - 1];
        let third = if f.clamped { at.turn } else { at.moment };
        // A foot that is free along z carries nothing there.
        let free = f
            .held
            .iter()
            .any(|(corner, directions)| *corner + 1 == f.corners.len() && !directions.contains('z'));
        (loaded, [at.x - end[0], if free { n[1] } else { at.z - end[1] }, third])
    }

    /// The load, and where the watched corner has moved, when that of the two displacements that has changed more since
    /// the last call is as in `moved`.
    pub fn follow(&mut self, moved: [f64; 2]) -> (f64, [f64; 2]) {
        let given = usize::from((moved[1] - self.moved[1]).abs() > (moved[0] - self.moved[0]).abs());
        let f = self.frame;
        let (bending, axial) = (f.young * f.inertia, f.young * f.area);
        let length: f64 = f.corners.windows(2).map(|c| (c[1][0] - c[0][0]).hypot(c[1][1] - c[0][1])).sum();
        let force = bending / (length * length);
        let scale = Vector4::new(
            force,
            force,
            if f.clamped { force * length } else { 1.0 },
            force / f.loads[0].1[0].hypot(f.loads[0].1[1]),
        );
        let wrong = |u: &Unknowns| {
            let (at, [a, b, c]) = self.shoot(u);
            let free = f.held.iter().any(|(corner, d)| *corner + 1 == f.corners.len() && !d.contains('z'));
            let (b, c) =
                (if free { b / axial } else { b / length }, if f.clamped { c } else { c / (force * length) });
            Vector4::new(a / length, b, c, (at[given] - moved[given]) / length)
        };
        let mut u = 2.0 * self.unknowns - self.before;
        for _ in 0..50 {
            let r = wrong(&u);
            if r.amax() < 1e-13 {
                break;
            }
            let mut k = Matrix4::zeros();
            for c in 0..4 {
                let h = 1e-6 * scale[c].max(u[c].abs());
                let (mut plus, mut minus) = (u, u);
                plus[c] += h;
                minus[c] -= h;
                k.set_column(c, &((wrong(&plus) - wrong(&minus)) / (2.0 * h) * scale[c]));
            }
            let step = k.lu().solve(&r).expect("a regular point").component_mul(&scale);
            u -= step;
        }
        let left = wrong(&u).amax();
        assert!(left < 1e-9, "the rod is not found at {moved:?}: {left:e}");
        (self.before, self.unknowns, self.moved) = (self.unknowns, u, moved);
        (u[3], self.shoot(&u).0)
    }
}
