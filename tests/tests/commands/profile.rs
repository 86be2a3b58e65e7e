//! `--profile`: one file of all processes, on one clock.

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use tests::{Bench, Ended, program, scene};

/// Times are written in microseconds, to a nanosecond.
const ROUNDED: f64 = 2e-3;

/// A span: process, thread, name, begin and end [us], what is said of it.
struct Span<'a> {
    place: (u64, u64),
    name: &'a str,
    begin: f64,
    end: f64,
    said: &'a Value,
}

impl Span<'_> {
    fn holds(&self, other: &Span) -> bool {
        self.begin <= other.begin + ROUNDED && other.end <= self.end + ROUNDED
    }
}

fn read(path: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(path).expect("a profile");
    serde_json::from_str(&text).expect("JSON")
}

/// Names of processes, and their spans.
fn sorted(events: &[Value]) -> (BTreeMap<&str, u64>, Vec<Span<'_>>) {
    let (mut processes, mut spans) = (BTreeMap::new(), Vec::new());
    for event in events {
        let number = |key: &str| event[key].as_f64().expect("a number");
        let (name, process) =
            (event["name"].as_str().expect("a name"), event["pid"].as_u64().expect("a process"));
        match event["ph"].as_str() {
            Some("M") => {
                assert_eq!(name, "process_name");
                processes.insert(event["args"]["name"].as_str().expect("a name"), process);
            }
            Some("X") => {
                let place = (process, event["tid"].as_u64().expect("a thread"));
                let begin = number("ts");
                spans.push(Span { place, name, begin, end: begin + number("dur"), said: &event["args"] });
            }
            _ => panic!("{event}"),
        }
    }
    (processes, spans)
}

/// Two spans of a thread do not cross: one holds the other, or it ends before that begins.
fn assert_nested(spans: &[Span]) {
    let mut threads: BTreeMap<_, Vec<&Span>> = BTreeMap::new();
    spans.iter().for_each(|span| threads.entry(span.place).or_default().push(span));
    for (thread, mut of) in threads {
        of.sort_by(|a, b| a.begin.total_cmp(&b.begin).then(b.end.total_cmp(&a.end)));
        let mut open: Vec<&Span> = Vec::new();
        for span in of {
            open.retain(|outer| outer.end > span.begin + ROUNDED);
            if let Some(outer) = open.last() {
                assert!(
                    outer.holds(span),
                    "{thread:?}: {} of {} crosses {}",
                    span.name,
                    span.said,
                    outer.name
                );
            }
            open.push(span);
        }
    }
}

fn cost(ended: &Ended, key: &str) -> f64 {
    ended.summary()["cost"][key].as_f64().unwrap_or_else(|| panic!("no {key}"))
}

#[test]
fn every_window_of_a_coupled_run_is_shown_in_all_processes_on_one_clock() {
    let bench = Bench::new();
    let file = bench.path("profile.json");
    let sets = ["--set", "end_time=0.04", "--set", "output.fields=0.01", "--set", "coupling.scheme=strong"];
    let arguments = [&sets[..], &["--profile", file.to_str().expect("text")]].concat();
    let ended = bench.run(&scene("cable-net"), "out", &arguments);
    let events = read(&file);
    let (processes, spans) = sorted(&events);
    assert_eq!(processes.keys().copied().collect::<Vec<_>>(), ["coupler", "dem", "fem"]);
    assert_nested(&spans);
    let of = |process: &str, name: &str| -> Vec<&Span> {
        spans.iter().filter(|span| span.place.0 == processes[process] && span.name == name).collect()
    };
    let loops = of("coupler", "loop");
    let [all] = loops[..] else { panic!("{} loops", loops.len()) };
    assert!(all.end - all.begin <= 1e6 * cost(&ended, "loop_s"));
    let (windows, passes) = (of("coupler", "window"), of("coupler", "pass"));
    assert_eq!(of("coupler", "commit").len() as f64, cost(&ended, "windows"));
    assert!(!windows.is_empty() && windows.iter().chain(&passes).all(|span| all.holds(span)));
    // What is asked to examine a solver is no part of a window.
    let examined = of("coupler", "examine");
    for process in ["dem", "fem"] {
        // While the coupler is in the pass that asked for it: the clock is one.
        let solves = of(process, "solve").into_iter().filter(|span| all.holds(span));
        let solved: Vec<_> = solves.filter(|span| !examined.iter().any(|of| of.holds(span))).collect();
        assert_eq!(solved.len(), passes.len(), "{process}");
        for span in solved {
            let asked = passes.iter().find(|pass| pass.holds(span)).expect("a pass");
            assert_eq!(asked.said, span.said, "{process}");
        }
        for name in ["prepare", "wait", "commit", "finish"] {
            assert!(!of(process, name).is_empty(), "{process}: {name}");
        }
    }
    for name in ["prepare", "wait", "write row", "finish"] {
        assert!(!of("coupler", name).is_empty(), "{name}");
    }
    let left = std::fs::read_dir(ended.out.join("log")).expect("logs").flatten();
    let left: Vec<_> = left.map(|entry| entry.file_name()).collect();
    assert_eq!(left.len(), 3, "parts are removed: {left:?}");
    // The same bytes without it.
    let without = bench.run(&scene("cable-net"), "without", &sets);
    assert_eq!((ended.code, ended.history()), (without.code, without.history()));
}

#[test]
fn a_solver_alone_writes_its_own_profile() {
    let bench = Bench::new();
    let file = bench.path("profile.json");
    let mut solver = Command::new(program("dem-solver"));
    solver
        .arg("run")
        .arg(scene("slope-cube"))
        .arg("--out")
        .arg(bench.path("out"))
        .arg("--profile")
        .arg(&file);
    let ended = Ended::of(solver.output().expect("started"), bench.path("out"));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let events = read(&file);
    let (processes, spans) = sorted(&events);
    assert_eq!(processes.keys().copied().collect::<Vec<_>>(), ["dem"]);
    assert_nested(&spans);
    let solved = spans.iter().filter(|span| span.name == "solve").count();
    assert_eq!(solved as f64, cost(&ended, "windows"));
}

#[test]
fn a_profile_that_cannot_be_written_is_refused_before_the_start() {
    let bench = Bench::new();
    let ended = bench.run(&scene("cable-net"), "out", &["--profile", "no-such-directory/profile.json"]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("--profile"), "{}", ended.stderr);
}
