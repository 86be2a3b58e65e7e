//! A structure that takes its time, for tests of deadlines and of processes that are lost.
//!
//! `sleeper MARK PREPARE WINDOW SECONDS serve SCENE --run ID --as fem`: sleeps PREPARE seconds while
//! preparing (reporting progress), and SECONDS in window number WINDOW; before each sleep it creates the
//! file MARK. Otherwise one node that does not move.
use interface_defs::ipc::serve::{Connection, serve};
use interface_defs::solver::OnProgress;
use interface_defs::*;
use std::time::Duration;

struct Sleeper {
    mark: String,
    prepare: f64,
    window: u64,
    seconds: f64,
}

impl Solver for Sleeper {
    fn hello(&self) -> Hello {
        Hello {
            program: "sleeper".into(),
            repeats: Some(0.0), // it repeats a window to equal bytes
            takes: vec![FieldSpec::nodal(name::FORCE, 3, Sampling::Means)],
            gives: vec![
                FieldSpec::nodal(name::DISPLACEMENT, 3, Sampling::AtEnds),
                FieldSpec::nodal(name::VELOCITY, 3, Sampling::AtEnds),
            ],
            ..Default::default()
        }
    }
    fn prepare(&mut self, _: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        if self.prepare > 0.0 {
            std::fs::write(&self.mark, "preparing").map_err(|e| Fault::broken(e.to_string()))?;
        }
        let naps = (self.prepare / 0.1) as u32;
        for nap in 0..naps {
            std::thread::sleep(Duration::from_millis(100));
            progress(Progress {
                what: "sleeping".into(),
                done: f64::from(nap) / f64::from(naps),
                ..Default::default()
            })?;
        }
        let mesh =
            InterfaceMesh { coordinates: vec![0.0; 3], masses: vec![f64::INFINITY], ..Default::default() };
        Ok(Ready { mesh, initial: vec![0.0; 6], ..Default::default() })
    }
    fn solve(&mut self, window: &Window, _: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        if window.number == self.window {
            std::fs::write(&self.mark, "in a window").map_err(|e| Fault::broken(e.to_string()))?;
            std::thread::sleep(Duration::from_secs_f64(self.seconds));
        }
        output.fill(0.0);
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
    let args: Vec<String> = std::env::args().collect();
    let number = |i: usize| args[i].parse::<f64>();
    let mut solver = Sleeper {
        mark: args[1].clone(),
        prepare: number(2)?,
        window: number(3)? as u64,
        seconds: number(4)?,
    };
    ipc::interrupt::install();
    Ok(serve(&mut solver, &Connection::from_args(args.into_iter())?)?)
}
