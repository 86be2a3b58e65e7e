//! Each process killed in each phase: the others end by themselves, with exit code 1 and a message that
//! names the lost one; the rows of all committed windows are on disk; nothing is left behind.

use rustix::process::{Pid, Signal, kill_process};
use std::path::PathBuf;
use std::process::Child;
use std::time::{Duration, Instant};
use tests::{Bench, Ended, example, processes_with, rows, scene, until, word};

/// A run that rests in a phase.
struct Run {
    bench: Bench,
    child: Child,
    out: PathBuf,
}

impl Run {
    /// The structure sleeps in the phase: `preparing` or `in a window` (its tenth).
    fn resting(phase: &str, settings: &[&str]) -> Self {
        let bench = Bench::new();
        let mark = bench.path("mark");
        let (prepare, window) = if phase == "preparing" { (60, 0) } else { (0, 10) };
        let scene = bench.scene(&format!(
            "end_time = 1.0\n[coupling]\nscheme = \"weak\"\ntime_window = 1e-3\n[processes]\ntimeout = 20\n\
             dem = \"{}\"\nfem = \"{} {} {prepare} {window} 60\"\n",
            word(example("weight")),
            word(example("sleeper")),
            mark.display()
        ));
        let out = bench.path("out");
        let child = bench.rockfall(&scene, "out", settings).spawn().unwrap();
        until("the phase", || mark.exists().then_some(()));
        Self { bench, child, out }
    }

    /// Between windows: thousands of short ones follow each other, at a moment that nobody chose.
    fn between_windows() -> Self {
        let bench = Bench::new();
        let out = bench.path("out");
        let scene = scene("walenstadt-compare");
        let child = bench.rockfall(&scene, "out", &["--set", "end_time=1000.0"]).spawn().unwrap();
        until("some rows", || (rows(&out) > 200).then_some(()));
        Self { bench, child, out }
    }

    fn in_phase(phase: &str) -> Self {
        if phase == "between windows" { Self::between_windows() } else { Self::resting(phase, &[]) }
    }

    fn pid(&self, role: &str) -> Pid {
        let raw = if role == "rockfall" {
            self.child.id()
        } else {
            let word = self.bench.path("").display().to_string();
            let of_role = |line: &str| match role {
                "coupler" => line.contains("coupler run") || line.contains("/coupler "),
                other => line.contains(&format!("--as {other}")),
            };
            until(role, || processes_with(&word).into_iter().find(|(_, line)| of_role(line))).0
        };
        Pid::from_raw(raw as i32).unwrap()
    }

    fn signal(&self, role: &str, signal: Signal) {
        kill_process(self.pid(role), signal).unwrap();
    }

    /// Wait for all processes of the run; says how long that took.
    fn end(self) -> (Ended, Duration, Bench) {
        let started = Instant::now();
        let ended = tests::wait(self.child, self.out);
        let word = self.bench.path("").display().to_string();
        until("every process ends", || processes_with(&word).is_empty().then_some(()));
        (ended, started.elapsed(), self.bench)
    }
}

const PHASES: [&str; 3] = ["preparing", "in a window", "between windows"];

fn rows_are_whole(ended: &Ended, phase: &str) {
    match phase {
        "preparing" => assert_eq!(ended.rows(), 0),
        "in a window" => assert_eq!(ended.rows(), 9, "nine windows were committed"),
        _ => {
            let text = ended.history();
            let columns = text.lines().next().unwrap().split(',').count();
            assert!(text.ends_with('\n') && ended.rows() >= 200);
            assert!(text.lines().all(|line| line.split(',').count() == columns));
        }
    }
}

fn killed(role: &str, lost: &str) {
    for phase in PHASES {
        let run = Run::in_phase(phase);
        run.signal(role, Signal::KILL);
        let (ended, took, _bench) = run.end();
        println!("{role} killed {phase}: all ended after {:.2} s", took.as_secs_f64());
        assert_eq!(ended.code, Some(1), "{phase}: {}", ended.stderr);
        assert!(ended.stderr.contains(lost), "{phase}: {}", ended.stderr);
        rows_are_whole(&ended, phase);
        next_start_is_clean();
    }
}

/// The next start removes what a killed coupler could not.
fn next_start_is_clean() {
    for run in interface_defs::ipc::clean().expect("a directory of our own") {
        assert!(tests::shared_memory_of(&run).is_empty());
    }
}

#[test]
fn a_killed_structure_is_named() {
    killed("fem", "fem was lost");
}

#[test]
fn a_killed_contact_solver_is_named() {
    killed("dem", "dem was lost");
}

#[test]
fn a_killed_coupler_is_named() {
    killed("coupler", "coupler was lost");
}

#[test]
fn a_killed_launcher_takes_its_run_with_it() {
    for phase in PHASES {
        let run = Run::in_phase(phase);
        run.signal("rockfall", Signal::KILL);
        let (ended, took, _bench) = run.end();
        println!("rockfall killed {phase}: all ended after {:.2} s", took.as_secs_f64());
        assert_eq!(ended.code, None, "it was killed");
        rows_are_whole(&ended, phase);
        let log = std::fs::read_to_string(ended.out.join("log/coupler.log")).unwrap();
        assert!(log.contains("launcher was lost"), "{phase}: {log}");
        next_start_is_clean();
    }
}

#[test]
#[ignore = "long"]
fn an_interrupt_ends_a_run_in_order_in_any_phase() {
    for phase in PHASES {
        for signal in [Signal::INT, Signal::TERM] {
            let run = Run::in_phase(phase);
            run.signal("rockfall", signal);
            let (ended, took, _bench) = run.end();
            println!("interrupted {phase}: all ended after {:.2} s", took.as_secs_f64());
            assert_eq!(ended.code, Some(1), "{phase}: {}", ended.stderr);
            assert!(ended.stderr.contains("interrupted"), "{phase}: {}", ended.stderr);
            rows_are_whole(&ended, phase);
            assert_eq!(ended.summary()["status"], "interrupted", "{phase}");
        }
    }
}

#[test]
#[ignore = "long"]
fn a_slow_solver_is_waited_for_and_not_taken_for_dead() {
    let bench = Bench::new();
    let scene = bench.scene(&format!(
        "end_time = 0.02\n[coupling]\nscheme = \"weak\"\ntime_window = 1e-3\n[processes]\ntimeout = 20\n\
         dem = \"{}\"\nfem = \"{} {} 0 5 10\"\n",
        word(example("weight")),
        word(example("sleeper")),
        bench.path("mark").display()
    ));
    let ended = bench.done(&scene, "out", &[]);
    assert_eq!(ended.rows(), 20);
    let log = std::fs::read_to_string(ended.out.join("log/coupler.log")).unwrap();
    assert!(log.contains("waiting for fem: "), "{log}");
}

#[test]
#[ignore = "long"]
fn a_stopped_process_is_named_at_the_deadline() {
    for phase in ["preparing", "in a window"] {
        for (role, lost) in [("fem", "no answer from fem"), ("coupler", "coupler")] {
            let run = Run::resting(phase, &["--set", "processes.timeout=2"]);
            let stopped = run.pid(role);
            run.signal(role, Signal::STOP);
            let (ended, took, _bench) = {
                let (ended, took, bench) = run.end();
                (ended, took, bench)
            };
            println!("{role} stopped {phase}: all ended after {:.2} s", took.as_secs_f64());
            assert_eq!(ended.code, Some(1), "{role} {phase}: {}", ended.stderr);
            assert!(ended.stderr.contains(lost), "{role} {phase}: {}", ended.stderr);
            assert!(rustix::process::test_kill_process(stopped).is_err(), "no process outlives its run");
        }
    }
}
