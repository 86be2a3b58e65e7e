//! Runs of one solver alone.

use super::*;
use crate::owner::Claim;
use crate::run_dir::HISTORY;
use interface_defs::{Gauge, Hello, OnProgress, Role, Window};

/// A body in free fall; past `fails_at` it cannot be solved.
struct Fall {
    /// What its potential energy is reported as, relative to what it is.
    shown: f64,
    committed: [f64; 2],
    trial: [f64; 2],
    fails_at: f64,
    longest: f64,
    windows: Vec<Window>,
}

const G: f64 = 10.0;

impl Fall {
    fn new(fails_at: f64, longest: f64) -> Self {
        Self { shown: 1.0, committed: [0.0; 2], trial: [0.0; 2], fails_at, longest, windows: Vec::new() }
    }

    fn answer(state: [f64; 2]) -> [f64; 9] {
        let [z, v] = state;
        let (kinetic, potential) = (0.5 * v * v, G * z);
        [z, z, z + 1.0, kinetic, kinetic, kinetic, potential, potential, potential]
    }
}

impl Solver for Fall {
    fn hello(&self) -> Hello {
        Hello { program: "fall".into(), largest_window: self.longest, ..Hello::default() }
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        assert!(plan.window <= self.longest);
        progress(Progress { what: "nothing to do".into(), done: 1.0, ..Progress::default() })?;
        let gauge = |name: &str, unit, role| Gauge { role, ..Gauge::new(name, unit) };
        let gauges = vec![
            Gauge { extremes: true, ..Gauge::new("z", "m") },
            gauge("energy_kinetic", "J", Role::Kinetic),
            gauge("energy_potential", "J", Role::Potential),
        ];
        Ok(Ready { gauges, initial: Self::answer([0.0; 2]).to_vec(), ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, _: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        if window.end() > self.fails_at {
            return Err(Fault::window("the ground is missing"));
        }
        let ([z, v], h) = (self.committed, window.length);
        self.trial = [z + v * h - 0.5 * G * h * h, v - G * h];
        self.windows.push(*window);
        output.copy_from_slice(&Self::answer(self.trial));
        output[6..].iter_mut().for_each(|potential| *potential *= self.shown);
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        self.committed = self.trial;
        Ok(())
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        Ok(Statistics { counts: vec![("flights".into(), 3)], ..Statistics::default() })
    }
}

fn run_fall(fall: &mut Fall, text: &str) -> (Summary, Vec<Vec<f64>>) {
    let dir = tempfile::tempdir().expect("a directory");
    let scene = Scene::from_text("s.toml", text).expect("TOML");
    let owner = Owner::claim(dir.path(), &Claim::default()).expect("free");
    let limits = Limits::of(&scene).expect("valid");
    let mut stage = Stage {
        role: "dem",
        owner: &owner,
        supervisor: None,
        limits,
        reporter: Reporter::default(),
        resume: None,
    };
    let summary = run(&mut stage, fall, &scene).expect("good input");
    assert_eq!(Summary::read(dir.path()).expect("written").status, summary.status);
    let history = std::fs::read_to_string(dir.path().join(HISTORY)).expect("rows");
    let mut lines = history.lines();
    assert_eq!(lines.next(), Some("time_s,z_m,energy_kinetic_J,energy_potential_J"));
    let number = |text: &str| text.parse::<f64>().expect("a number");
    (summary, lines.map(|line| line.split(',').map(number).collect()).collect())
}

#[test]
fn a_solver_alone_gives_a_row_per_interval_and_the_end() {
    let mut fall = Fall::new(f64::INFINITY, f64::INFINITY);
    let (summary, rows) = run_fall(&mut fall, "end_time = 1.0\noutput.interval = 0.3");
    assert_eq!(rows.iter().map(|r| r[0]).collect::<Vec<_>>(), [0.0, 0.3, 0.6, 0.3 * 3.0, 1.0]);
    // Exact solution; a handful of roundings of numbers of order 5.
    assert!((rows[4][1] + 0.5 * G).abs() < 1e-14 * 5.0 * 10.0, "{:?}", rows[4]);
    assert_eq!((summary.status, summary.message.as_deref()), (RunStatus::Done, None));
    let measures: Vec<_> = summary.measures.iter().map(|m| (m.name.as_str(), m.value, m.time)).collect();
    assert_eq!(measures[..2], [("z_min", rows[4][1], Some(1.0)), ("z_max", 1.0, Some(0.0))]);
    assert_eq!(measures[2].0, "energy_error");
    assert!(summary.measures.iter().all(|m| m.source == "fall"));
    assert_eq!(summary.cost["windows"], 4);
    assert_eq!(summary.cost["processes"]["dem"]["counts"]["flights"], 3);
    assert!(summary.energy["energy_error"].as_f64().expect("a number") < 1e-14);
}

#[test]
fn the_largest_window_of_the_solver_is_kept_and_rows_stay_where_they_are() {
    let mut fall = Fall::new(f64::INFINITY, 0.1);
    let (_, rows) = run_fall(&mut fall, "end_time = 1.0\noutput.interval = 0.25");
    assert_eq!(rows.iter().map(|r| r[0]).collect::<Vec<_>>(), [0.0, 0.25, 0.5, 0.75, 1.0]);
    assert_eq!(fall.windows.len(), 12);
    for pair in fall.windows.windows(2) {
        assert!((pair[1].start - pair[0].end()).abs() <= f64::EPSILON, "no gap: {pair:?}");
    }
}

#[test]
fn energy_that_comes_from_nowhere_is_a_warning() {
    let mut fall = Fall::new(f64::INFINITY, f64::INFINITY);
    assert!(run_fall(&mut fall, "end_time = 1.0").0.warnings.is_empty());
    let mut fall = Fall { shown: 0.98, ..Fall::new(f64::INFINITY, f64::INFINITY) };
    let (summary, _) = run_fall(&mut fall, "end_time = 1.0");
    // 1 J of 50 J of potential energy is not reported: it seems created, and does not count in the 50 J of speed.
    let error = summary.measure("energy_error").expect("a number");
    assert!((error - 1.0 / 49.0).abs() < 1e-9, "{error}");
    assert_eq!(summary.status, RunStatus::Done);
    assert!(
        summary.warnings[0].message.starts_with("energy_error is 2.04 % at 1.000000 s"),
        "{:?}",
        summary.warnings
    );
    let mut fall = Fall { shown: 0.8, ..Fall::new(f64::INFINITY, f64::INFINITY) };
    let (summary, _) = run_fall(&mut fall, "end_time = 1.0");
    assert_eq!(summary.status, RunStatus::Unreliable);
    let message = summary.message.expect("says why");
    assert!(
        message
            .starts_with("unreliable: energy_error is 25 % at 1.000000 s, above limits.energy_error = 10 %"),
        "{message}"
    );
    let mut fall = Fall { shown: 0.8, ..Fall::new(f64::INFINITY, f64::INFINITY) };
    let (summary, _) = run_fall(&mut fall, "end_time = 1.0\nlimits.energy_error = 0.3");
    assert_eq!(summary.status, RunStatus::Done);
}

#[test]
fn a_run_whose_energy_explodes_ends_at_once_and_keeps_its_rows() {
    let mut fall = Fall { shown: 0.2, ..Fall::new(f64::INFINITY, f64::INFINITY) };
    let (summary, rows) = run_fall(&mut fall, "end_time = 1.0\noutput.interval = 0.1");
    assert_eq!(summary.status, RunStatus::Failed);
    // Three windows in a row beyond ten times the bound, then the end.
    assert_eq!(rows.len(), 4);
    let message = summary.message.expect("says why");
    assert!(message.contains("diverged: at t = 0.3") && message.contains("shorten the steps"), "{message}");
    assert!((summary.measures.last().expect("one").value - 4.0).abs() < 1e-9, "{:?}", summary.measures);
}

#[test]
fn rows_default_to_two_hundred() {
    let (_, rows) = run_fall(&mut Fall::new(f64::INFINITY, f64::INFINITY), "end_time = 0.7");
    assert_eq!(rows.len(), 201);
}

#[test]
fn a_run_that_fails_keeps_its_rows_and_says_when_and_why() {
    let (summary, rows) =
        run_fall(&mut Fall::new(0.55, f64::INFINITY), "end_time = 1\noutput.interval = 0.25");
    assert_eq!(rows.len(), 3);
    assert_eq!(summary.status, RunStatus::Failed);
    assert_eq!(summary.message.as_deref(), Some("from 0.5 s to 0.75 s: the ground is missing"));
}
