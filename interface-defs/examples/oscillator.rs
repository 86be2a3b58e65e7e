//! The smallest structure: one mass on a spring, hung where the scene's rock falls. Over the contract alone.
//!
//! In a scene: `[processes] fem = "target/release/examples/oscillator"`; by hand:
//! `oscillator serve SCENE --run ID --as fem`. Position Verlet under the mean force, mass 20 kg, 2e5 N/m.
use interface_defs::{ipc::Connection, solver::OnProgress, *};

const MASS: f64 = 20.0;
const SPRING: f64 = 2e5;

#[derive(Default)]
struct Oscillator {
    committed: [f64; 2], // displacement [m] and velocity [m/s] along z
    trial: [f64; 2],
}

impl Solver for Oscillator {
    fn hello(&self) -> Hello {
        let at_end = |name| FieldSpec::nodal(name, 3, Sampling::AtEnds);
        Hello {
            program: "oscillator".into(),
            repeats: Some(0.0), // it repeats a window to equal bytes
            takes: vec![FieldSpec::nodal(name::FORCE, 3, Sampling::Means)],
            gives: vec![at_end(name::DISPLACEMENT), at_end(name::VELOCITY)],
            largest_window: 1e-3, // well below its period of 63 ms
            ..Default::default()
        }
    }
    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mesh = InterfaceMesh { coordinates: vec![0.0; 3], masses: vec![MASS], ..Default::default() };
        let gauges = vec![Gauge { extremes: true, ..Gauge::new("oscillator_uz", "m") }];
        let initial = vec![0.0; Layout::new(&plan.gives, &mesh, gauges.len()).len()];
        Ok(Ready { mesh, gauges, initial, ..Default::default() })
    }
    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let ([u, v], h) = (self.committed, window.length);
        let middle = u + 0.5 * h * v;
        let v1 = v + h * (input[2] - SPRING * middle) / MASS;
        self.trial = [middle + 0.5 * h * v1, v1];
        output[..6].copy_from_slice(&[0.0, 0.0, self.trial[0], 0.0, 0.0, v1]);
        output[6..].fill(self.trial[0]);
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
    let ended = connection.and_then(|c| serve(&mut Oscillator::default(), &c).map_err(|e| e.to_string()));
    if let Err(what) = ended {
        eprintln!("error: {what}");
        std::process::exit(1);
    }
}
