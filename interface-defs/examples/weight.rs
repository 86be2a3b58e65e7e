//! The smallest contact solver: a weight glued to every wall node, let go at t = 0. Over the contract alone.
//!
//! In a scene: `[processes] dem = "target/release/examples/weight"`; by hand:
//! `weight serve SCENE --run ID --as dem`. It has no state: its force follows from the wall's motion.
use interface_defs::ipc::serve::{Connection, serve};
use interface_defs::solver::OnProgress;
use interface_defs::*;

const WEIGHT: f64 = 0.5; // per node [N]
const DASHPOT: f64 = 0.2; // per node [N s/m]

struct Weight;

impl Solver for Weight {
    fn hello(&self) -> Hello {
        Hello {
            program: "weight".into(),
            repeats: Some(0.0), // it repeats a window to equal bytes
            takes: vec![FieldSpec::nodal(name::DISPLACEMENT, 3, Sampling::FromStart)],
            gives: vec![
                FieldSpec::nodal(name::FORCE, 3, Sampling::Means),
                FieldSpec::nodal(name::FORCE, 3, Sampling::AtEnds),
            ],
            ..Default::default()
        }
    }
    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mesh = plan.partner_mesh.clone().ok_or(Fault::input("a weight needs a wall to hang on"))?;
        let initial = vec![0.0; Layout::new(&plan.gives, &mesh, 0).len()];
        Ok(Ready { mesh, initial, ..Default::default() })
    }
    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let (start, end) = input.split_at(input.len() / 2);
        for (i, (u0, u1)) in start.iter().zip(end).enumerate() {
            let weight = if i % 3 == 2 { WEIGHT } else { 0.0 };
            let force = -weight - DASHPOT * (u1 - u0) / window.length;
            // Mean and end force are the same here; the plan asks for one or both.
            output.iter_mut().skip(i).step_by(start.len()).for_each(|f| *f = force);
        }
        Ok(())
    }
    fn commit(&mut self) -> Result<(), Fault> {
        Ok(())
    }
    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(Statistics::default())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    Ok(serve(&mut Weight, &Connection::from_args(std::env::args_os())?)?)
}
