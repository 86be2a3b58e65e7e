//! A net of masses and springs as the structure of a run.
//!
//! 7 x 7 nodes, the edge held; position Verlet, steps of 0.1 ms at most; it repeats a window to equal bytes.
use interface_defs::{ipc::Connection, solver::OnProgress, *};

const SIDE: usize = 7; // nodes along an edge
const NODES: usize = SIDE * SIDE;
const CENTRE: usize = NODES / 2;
const SPACING: f64 = 0.5; // [m]
const REST: f64 = 0.49; // length of a spring without force [m]
const MASS: f64 = 1.0; // of a node [kg]
const STIFFNESS: f64 = 5e4; // of a spring [N/m]
const STEP: f64 = 1e-4; // the longest [s]

type Nodes = [[f64; 3]; NODES];

#[derive(Clone, Copy)]
struct State {
    u: Nodes, // displacement from t = 0 [m]
    v: Nodes, // velocity [m/s]
}

struct Net {
    x: Nodes, // position at t = 0 [m]
    springs: Vec<[u32; 2]>,
    held: [bool; NODES],
    committed: State,
    trial: State,
}

impl Net {
    fn new() -> Self {
        let (mut x, mut held, mut springs) = ([[0.0; 3]; NODES], [false; NODES], Vec::new());
        for n in 0..NODES {
            let (i, j) = (n % SIDE, n / SIDE);
            x[n] = [SPACING * (i as f64 - 3.0), SPACING * (j as f64 - 3.0), 0.0];
            held[n] = i == 0 || j == 0 || i == SIDE - 1 || j == SIDE - 1;
            if i + 1 < SIDE {
                springs.push([n as u32, n as u32 + 1]);
            }
            if j + 1 < SIDE {
                springs.push([n as u32, (n + SIDE) as u32]);
            }
        }
        let rest = State { u: [[0.0; 3]; NODES], v: [[0.0; 3]; NODES] };
        Self { x, springs, held, committed: rest, trial: rest }
    }
    /// Add the forces of all springs [N].
    fn add_forces(&self, u: &Nodes, f: &mut Nodes) {
        for &[a, b] in &self.springs {
            let (a, b) = (a as usize, b as usize);
            let d: [f64; 3] = std::array::from_fn(|k| (self.x[b][k] + u[b][k]) - (self.x[a][k] + u[a][k]));
            let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            let pull = STIFFNESS * (length - REST) / length;
            for k in 0..3 {
                f[a][k] += pull * d[k];
                f[b][k] -= pull * d[k];
            }
        }
    }
}

impl Solver for Net {
    fn hello(&self) -> Hello {
        let at_end = |name| FieldSpec::nodal(name, 3, Sampling::AtEnds);
        Hello {
            program: "net (Rust)".into(),
            repeats: Some(0.0),
            takes: vec![FieldSpec::nodal(name::FORCE, 3, Sampling::Means)],
            gives: vec![at_end(name::DISPLACEMENT), at_end(name::VELOCITY)],
            largest_window: 1e-3,
            ..Default::default()
        }
    }
    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mesh = InterfaceMesh {
            coordinates: self.x.as_flattened().to_vec(),
            lines: self.springs.clone(),
            line_radius: vec![0.01; self.springs.len()],
            masses: self.held.map(|held| if held { f64::INFINITY } else { MASS }).to_vec(),
            ..Default::default()
        };
        let gauges = [("centre_uz", "m"), ("reaction_z", "N")];
        let gauges = gauges.map(|(name, unit)| Gauge { extremes: true, ..Gauge::new(name, unit) }).to_vec();
        let initial = vec![0.0; Layout::new(&plan.gives, &mesh, gauges.len()).len()];
        Ok(Ready { mesh, gauges, initial, ..Default::default() })
    }
    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let State { mut u, mut v } = self.committed;
        let steps = window.steps(STEP);
        let h = window.length / steps as f64;
        let (load, _) = input.as_chunks::<3>();
        let (mut uz, mut reaction) =
            ([0.0, f64::INFINITY, -f64::INFINITY], [0.0, f64::INFINITY, -f64::INFINITY]);
        for _ in 0..steps {
            for n in 0..NODES {
                for k in 0..3 {
                    u[n][k] += 0.5 * h * v[n][k];
                }
            }
            let mut f = [[0.0; 3]; NODES];
            self.add_forces(&u, &mut f);
            let mut support = 0.0;
            for n in 0..NODES {
                if self.held[n] {
                    support -= f[n][2] + load[n][2];
                    continue;
                }
                for k in 0..3 {
                    v[n][k] += h * (f[n][k] + load[n][k]) / MASS;
                    u[n][k] += 0.5 * h * v[n][k];
                }
            }
            uz = [u[CENTRE][2], uz[1].min(u[CENTRE][2]), uz[2].max(u[CENTRE][2])];
            reaction =
                [reaction[0] + support / steps as f64, reaction[1].min(support), reaction[2].max(support)];
        }
        self.trial = State { u, v };
        let numbers = u.iter().chain(&v).flatten().chain(&uz).chain(&reaction);
        output.iter_mut().zip(numbers).for_each(|(to, from)| *to = *from);
        Ok(())
    }
    fn commit(&mut self) -> Result<(), Fault> {
        self.committed = self.trial;
        Ok(())
    }
    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(Statistics::default())
    }
}

fn main() {
    let connection = Connection::from_args(std::env::args_os());
    let ended = connection.and_then(|c| serve(&mut Net::new(), &c).map_err(|e| e.to_string()));
    if let Err(what) = ended {
        eprintln!("error: {what}");
        std::process::exit(1);
    }
}
