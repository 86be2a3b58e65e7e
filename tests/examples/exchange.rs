//! What an exchange costs: coupler to solver and back, three processes, by payload and way of waiting.
//!
//! `cargo run --release -p tests --example exchange` prints one line per figure: median microseconds of one exchange
//! (two make a weak window), for payloads of 3, 3 000 and 300 000 doubles each way.
//!
//! With `-- load` it measures beside 0, 2 and 6 busy loops: seconds of a run of 5 000 windows (beside loops 500, which take as long)
//! by way of waiting, the ways taking turns, median of five, and how `auto` compares with the better of the other two.

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
        Hello { program: "echo".into(), ..Hello::default() }
    }
    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        let mesh = plan.partner_mesh.clone().unwrap_or_default();
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
    let mut args = std::env::args_os();
    if args.any(|a| a == "serve") {
        return Ok(serve(&mut Echo, &Connection::from_args(args)?)?);
    }
    if std::env::args().any(|a| a == "load") {
        return load();
    }
    println!("payload_doubles wait exchanges median_us p90_us");
    for doubles in [3usize, 3_000, 300_000] {
        for wait in WAYS {
            let rounds = if doubles > 100_000 { 1_000 } else { 10_000 };
            let mut times = measure(doubles, wait, rounds)?;
            times.sort_by(f64::total_cmp);
            let (median, p90) = (times[rounds / 2], times[rounds * 9 / 10]);
            println!("{doubles} {wait} {rounds} {median:.1} {p90:.1}");
        }
    }
    Ok(())
}

const WAYS: [Wait; 2] = [Wait::Auto, Wait::Event];

/// Loops that keep processors busy until they are dropped.
struct Busy(Vec<std::process::Child>);

impl Busy {
    fn start(count: usize) -> std::io::Result<Self> {
        let one = |_| std::process::Command::new("sh").args(["-c", "while :; do :; done"]).spawn();
        (0..count).map(one).collect::<Result<_, _>>().map(Self)
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill().and_then(|()| child.wait());
        }
    }
}

fn load() -> Result<(), Box<dyn std::error::Error>> {
    println!("busy_loops auto_s event_s auto_over_event");
    for count in [0, 2, 6] {
        let _busy = Busy::start(count)?;
        let mut seconds = [const { Vec::new() }; WAYS.len()];
        for _ in 0..5 {
            for (taken, wait) in seconds.iter_mut().zip(WAYS) {
                // Two exchanges a round.
                let rounds = if count == 0 { 5_000 } else { 500 };
                taken.push(measure(3, wait, rounds)?.iter().sum::<f64>() * 2.0 * 1e-6);
            }
        }
        let [auto, event] = seconds.map(|mut taken| {
            taken.sort_by(f64::total_cmp);
            taken[taken.len() / 2]
        });
        println!("{count} {auto:.4} {event:.4} {:.2}", auto / event);
    }
    Ok(())
}

/// Microseconds of one exchange, round by round.
fn measure(doubles: usize, wait: Wait, rounds: usize) -> Result<Vec<f64>, Box<dyn std::error::Error>> {
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
    let plan = Plan {
        takes: vec![field.clone()],
        gives: vec![field],
        partner_mesh: Some(mesh),
        ..Default::default()
    };
    for remote in &mut remotes {
        remote.hello()?;
        remote.prepare(&plan, &mut |_| Ok(()))?;
    }
    let mut times = Vec::with_capacity(rounds);
    for round in 0..rounds + 100 {
        let started = Instant::now();
        for remote in &mut remotes {
            let header = RequestHeader { command: Command::Solve as u32, length: 1.0, ..Default::default() };
            let request = Request { header, sends: doubles, expects: Some(doubles) };
            remote.send(request, &mut |payload| payload.fill(round as f64))?;
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
    Ok(times)
}
