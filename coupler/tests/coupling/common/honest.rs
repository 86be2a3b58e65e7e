//! An honest structure and an honest contact solver, small and with all gauges: a net of masses and springs, and a ball on its nodes.

use interface_defs::solver::OnProgress;
use interface_defs::*;
use std::f64::consts::PI;

/// Nodes in each of both directions, and their distance [m].
const SIDE: usize = 5;
const SPACING: f64 = 0.1;
pub const NODES: usize = SIDE * SIDE;
pub const MASS: f64 = 0.2;
const GROUND: f64 = 400.0;
const SPRING: f64 = 4000.0;
/// Longest own step of both [s].
pub const STEP: f64 = 1e-4;
/// Of the ball.
const BALL: f64 = 4.0;
const RADIUS: f64 = 0.15;
const STIFFNESS: f64 = 2e4;
const GRAVITY: f64 = 9.81;

/// A node of the edge.
pub fn is_held(node: usize) -> bool {
    let (row, column) = (node / SIDE, node % SIDE);
    row == 0 || column == 0 || row == SIDE - 1 || column == SIDE - 1
}

fn neighbours(node: usize) -> impl Iterator<Item = usize> {
    let (row, column) = (node / SIDE, node % SIDE);
    let near = move |other: &usize| (other / SIDE).abs_diff(row) + (other % SIDE).abs_diff(column) == 1;
    (0..NODES).filter(near)
}

pub fn coordinates() -> Vec<f64> {
    let half = SPACING * (SIDE - 1) as f64 / 2.0;
    let place =
        |node: usize| [(node % SIDE) as f64 * SPACING - half, (node / SIDE) as f64 * SPACING - half, 0.0];
    (0..NODES).flat_map(place).collect()
}

/// Energies as gauges.
fn energies(who: &str) -> Vec<Gauge> {
    super::energies(who)
}

/// Masses on springs, to ground and to each other, in every direction alike.
#[derive(Clone)]
pub struct Net {
    /// Steps end with half a kick that velocities do not show before the next one begins.
    pub leapfrog: bool,
    /// Which gauges it has.
    pub tells: bool,
    samples: usize,
    state: NetState,
    trial: NetState,
}

#[derive(Clone, Default)]
struct NetState {
    u: Vec<f64>,
    v: Vec<f64>,
    /// Half a kick that is due.
    due: Vec<f64>,
    received: f64,
}

impl Net {
    pub fn new(leapfrog: bool, tells: bool) -> Self {
        let none = vec![0.0; 3 * NODES];
        let state = NetState { u: none.clone(), v: none.clone(), due: none, received: 0.0 };
        Self { leapfrog, tells, samples: 1, trial: state.clone(), state }
    }

    fn springs(u: &[f64], i: usize) -> f64 {
        let (node, axis) = (i / 3, i % 3);
        neighbours(node).map(|other| SPRING * (u[3 * other + axis] - u[i])).sum::<f64>() - GROUND * u[i]
    }

    fn stored(u: &[f64]) -> f64 {
        -0.5 * (0..3 * NODES).map(|i| u[i] * Self::springs(u, i)).sum::<f64>()
    }

    fn step(&self, state: &mut NetState, h: f64, force: &[f64]) {
        let free = || (0..3 * NODES).filter(|i| !is_held(i / 3));
        let before = state.u.clone();
        if self.leapfrog {
            for i in free() {
                let kick = 0.5 * h * (force[i] + Self::springs(&before, i)) / MASS;
                state.v[i] += state.due[i] + kick;
                state.u[i] += h * state.v[i];
            }
            for i in free() {
                state.due[i] = 0.5 * h * (force[i] + Self::springs(&state.u, i)) / MASS;
            }
        } else {
            let middle: Vec<f64> = before.iter().zip(&state.v).map(|(u, v)| u + 0.5 * h * v).collect();
            for i in free() {
                state.v[i] += h * (force[i] + Self::springs(&middle, i)) / MASS;
                state.u[i] = middle[i] + 0.5 * h * state.v[i];
            }
        }
        state.received += (0..3 * NODES).map(|i| force[i] * (state.u[i] - before[i])).sum::<f64>();
    }

    fn write_gauges(&self, state: &NetState, out: &mut [f64]) {
        let kinetic = 0.5 * MASS * state.v.iter().map(|v| v * v).sum::<f64>();
        let middle = state.u[3 * (NODES / 2) + 2];
        let all = [kinetic, 0.0, Self::stored(&state.u), 0.0, state.received, middle];
        let told = if self.tells { &all[..] } else { &all[5..] };
        out.chunks_exact_mut(3).zip(told).for_each(|(gauge, value)| gauge.fill(*value));
    }
}

impl Solver for Net {
    fn hello(&self) -> Hello {
        let many = |name, sampling| FieldSpec { samples: 8, ..FieldSpec::nodal(name, 3, sampling) };
        Hello {
            program: "net".into(),
            scene: super::SCENE.into(),
            repeats: Some(0.0),
            takes: vec![many(name::FORCE, Sampling::Means)],
            gives: vec![many(name::DISPLACEMENT, Sampling::AtEnds), many(name::VELOCITY, Sampling::AtEnds)],
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        self.samples = plan.gives[0].samples as usize;
        let masses = (0..NODES).map(|node| if is_held(node) { f64::INFINITY } else { MASS }).collect();
        let mesh = InterfaceMesh { coordinates: coordinates(), masses, ..Default::default() };
        let mut gauges = if self.tells { energies("net") } else { Vec::new() };
        gauges.push(Gauge { extremes: true, ..Gauge::new("middle_uz", "m") });
        let mut initial = vec![0.0; Layout::new(&plan.gives, &mesh, gauges.len()).len()];
        let fields = initial.len() - 3 * gauges.len();
        self.write_gauges(&self.state, &mut initial[fields..]);
        Ok(Ready { mesh, gauges, initial, ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let (mut state, numbers) = (self.state.clone(), 3 * NODES);
        let part = Window { length: window.length / self.samples as f64, ..*window };
        let steps = part.steps(STEP);
        for sample in 0..self.samples {
            let force = &input[sample * numbers..(sample + 1) * numbers];
            (0..steps).for_each(|_| self.step(&mut state, part.length / steps as f64, force));
            let at = sample * numbers;
            output[at..at + numbers].copy_from_slice(&state.u);
            let at = (self.samples + sample) * numbers;
            output[at..at + numbers].copy_from_slice(&state.v);
        }
        self.write_gauges(&state, &mut output[2 * self.samples * numbers..]);
        self.trial = state;
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        self.state = self.trial.clone();
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(Statistics::default())
    }
}

/// A ball without friction that pushes the nodes it touches away from its centre.
#[derive(Clone)]
pub struct Ball {
    /// Whether it tells of its motion, and of its energies.
    pub tells_motion: bool,
    pub tells_energy: bool,
    samples: usize,
    nodes: Vec<f64>,
    state: BallState,
    trial: BallState,
    /// Lowest place that was committed [m].
    pub lowest: f64,
}

#[derive(Clone, Copy)]
struct BallState {
    x: [f64; 3],
    v: [f64; 3],
    received: f64,
}

impl Ball {
    pub fn new(tells_motion: bool, tells_energy: bool) -> Self {
        let state = BallState { x: [0.004, 0.002, RADIUS + 0.02], v: [0.0, 0.0, -2.5], received: 0.0 };
        let nodes = coordinates();
        Self { tells_motion, tells_energy, samples: 1, nodes, state, trial: state, lowest: state.x[2] }
    }

    /// Depth of a node at `place` in the ball at `x`, and the direction away from its centre.
    fn touch(x: [f64; 3], place: [f64; 3]) -> (f64, [f64; 3]) {
        let arm: [f64; 3] = std::array::from_fn(|c| place[c] - x[c]);
        let far = arm.iter().map(|a| a * a).sum::<f64>().sqrt();
        ((RADIUS - far).max(0.0), arm.map(|a| a / far))
    }

    fn place(&self, u: &[f64], node: usize) -> [f64; 3] {
        std::array::from_fn(|c| self.nodes[3 * node + c] + u[3 * node + c])
    }

    fn write_gauges(&self, state: &BallState, u: &[f64], out: &mut [f64]) {
        let kinetic = 0.5 * BALL * state.v.iter().map(|v| v * v).sum::<f64>();
        let depth = |node| Self::touch(state.x, self.place(u, node)).0;
        let stored = 0.5 * STIFFNESS * (0..NODES).map(|node| depth(node).powi(2)).sum::<f64>();
        let mut values = Vec::new();
        if self.tells_motion {
            values.extend(state.x.into_iter().chain(state.v).chain([0.0; 3]));
        }
        if self.tells_energy {
            values.extend([kinetic, BALL * GRAVITY * state.x[2], stored, 0.0, state.received]);
        }
        out.chunks_exact_mut(3).zip(values).for_each(|(gauge, value)| gauge.fill(value));
    }
}

impl Solver for Ball {
    fn hello(&self) -> Hello {
        let many = |name, sampling| FieldSpec { samples: 8, ..FieldSpec::nodal(name, 3, sampling) };
        Hello {
            program: "ball".into(),
            scene: super::SCENE.into(),
            repeats: Some(0.0),
            takes: vec![many(name::DISPLACEMENT, Sampling::FromStart)],
            gives: vec![many(name::FORCE, Sampling::Means)],
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mesh = plan.partner_mesh.clone().unwrap_or_default();
        self.samples = plan.gives[0].samples as usize;
        let mut gauges = Vec::new();
        if self.tells_motion {
            for (names, unit) in
                [(["x", "y", "z"], "m"), (["vx", "vy", "vz"], "m/s"), (["wx", "wy", "wz"], "rad/s")]
            {
                gauges.extend(names.map(|name| Gauge::new(format!("ball_{name}"), unit)));
            }
        }
        gauges.extend(if self.tells_energy { energies("ball") } else { Vec::new() });
        let mut initial = vec![0.0; Layout::new(&plan.gives, &mesh, gauges.len()).len()];
        let fields = initial.len() - 3 * gauges.len();
        self.write_gauges(&self.state, &vec![0.0; 3 * NODES], &mut initial[fields..]);
        Ok(Ready { mesh, gauges, initial, ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let (mut state, numbers) = (self.state, 3 * NODES);
        let part = Window { length: window.length / self.samples as f64, ..*window };
        let steps = part.steps(STEP);
        let h = part.length / steps as f64;
        output.fill(0.0);
        let mut end = vec![0.0; numbers];
        for sample in 0..self.samples {
            let (from, to) = input[sample * numbers..].split_at(numbers);
            for step in 0..steps {
                let share = (step as f64 + 0.5) / steps as f64;
                let u: Vec<f64> = (0..numbers).map(|i| from[i] + share * (to[i] - from[i])).collect();
                let middle: [f64; 3] = std::array::from_fn(|c| state.x[c] + 0.5 * h * state.v[c]);
                let mut total = [0.0, 0.0, -BALL * GRAVITY];
                for node in 0..NODES {
                    let (depth, away) = Self::touch(middle, self.place(&u, node));
                    for c in 0..3 {
                        let (force, i) = (STIFFNESS * depth * away[c], 3 * node + c);
                        total[c] -= force;
                        output[sample * numbers + i] += force / steps as f64;
                        state.received -= force * (to[i] - from[i]) / steps as f64;
                    }
                }
                for c in 0..3 {
                    state.v[c] += h * total[c] / BALL;
                    state.x[c] = middle[c] + 0.5 * h * state.v[c];
                }
            }
            end.copy_from_slice(&to[..numbers]);
        }
        self.write_gauges(&state, &end, &mut output[self.samples * numbers..]);
        self.trial = state;
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        self.state = self.trial;
        self.lowest = self.lowest.min(self.state.x[2]);
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(Statistics::default())
    }
}

/// Something that swings between -1 and 1 with the number of a solve.
pub fn swing(solves: u64) -> f64 {
    (solves as f64 * PI * 0.618).sin()
}
