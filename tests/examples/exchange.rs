//! What an exchange costs: coupler to solver and back, three processes, by payload and way of waiting.
//!
//! `cargo run --release -p tests --example exchange` prints one line per figure: median microseconds of one exchange
//! (two make a weak window), for payloads of 3, 3 000 and 300 000 doubles each way.

use interface_defs::header::Command;
use interface_defs::ipc::remote::{Host, HostOptions};
use interface_defs::ipc::serve::{Connection, serve};
use interface_defs::ipc::{RunId, Wait};
use interface_defs::solver::OnProgress;
use interface_defs::*;
use std::time::{Duration, Instant};

/// Answers with its input plus one: touches every number once.
struct Echo;

impl Solver for Echo {
    fn hello(&self) -> Hello {
        Hello {
            program: "echo".into(),
            capabilities: vec![],
            takes: vec![],
            gives: vec![],
            largest_window: f64::INFINITY,
        }
    }
    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mesh = plan.wall.clone().unwrap_or_default();
        let initial = vec![0.0; Layout::new(&plan.gives, &mesh, 0).len()];
        Ok(Ready { mesh, initial, ..Default::default() })
    }
    fn solve(&mut self, _: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        for (out, x) in output.iter_mut().zip(input) {
            *out = x + 1.0;
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
    let mut args = std::env::args();
    if args.any(|a| a == "serve") {
        return Ok(serve(&mut Echo, &Connection::from_args(args)?)?);
    }
    println!("payload_doubles wait exchanges median_us p90_us");
    for doubles in [3usize, 3_000, 300_000] {
        for wait in [Wait::Yield, Wait::Event] {
            let (median, p90, count) = measure(doubles, wait)?;
            println!("{doubles} {wait} {count} {median:.1} {p90:.1}");
        }
    }
    Ok(())
}

fn measure(doubles: usize, wait: Wait) -> Result<(f64, f64, usize), Box<dyn std::error::Error>> {
    let run = RunId::new();
    let timeout = Duration::from_secs(20);
    let names = ["dem", "fem"];
    let (host, mut remotes) =
        Host::create(HostOptions { run: run.clone(), timeout, wait, supervisor: None }, &names)?;
    let program = std::env::current_exe()?;
    let start = |name: &str| {
        let wait = wait.to_string();
        std::process::Command::new(&program)
            .args(["serve", "--run", &run.to_string(), "--as", name, "--wait", &wait])
            .spawn()
    };
    let mut children = names.map(start).into_iter().collect::<Result<Vec<_>, _>>()?;
    let field = FieldSpec::nodal("numbers", 3, Sampling::Once);
    let mesh = InterfaceMesh { coordinates: vec![0.0; doubles], ..Default::default() };
    let plan =
        Plan { takes: vec![field.clone()], gives: vec![field], wall: Some(mesh), ..Default::default() };
    for remote in &mut remotes {
        remote.hello()?;
        remote.prepare(&plan, &mut |_| Ok(()))?;
    }
    let rounds = if doubles > 100_000 { 1_000 } else { 10_000 };
    let mut times = Vec::with_capacity(rounds);
    for round in 0..rounds + 100 {
        let started = Instant::now();
        for remote in &mut remotes {
            let header = RequestHeader { command: Command::Solve as u32, length: 1.0, ..Default::default() };
            remote.send(header, &mut |payload| payload.fill(round as f64))?;
            remote.receive()?;
        }
        if round >= 100 {
            times.push(started.elapsed().as_secs_f64() / 2.0 * 1e6);
        }
    }
    for remote in &mut remotes {
        remote.finish(false)?;
    }
    drop(remotes);
    for child in &mut children {
        child.wait()?;
    }
    host.close();
    times.sort_by(f64::total_cmp);
    Ok((times[rounds / 2], times[rounds * 9 / 10], rounds))
}
