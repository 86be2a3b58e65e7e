//! What surrounds a run: who owns its directory, disks that are full, signals, programs on different scenes.

use rustix::process::{Pid, Signal, kill_process};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tests::{Bench, Ended, example, processes_with, program, rows, scene, until, word};

/// A watchdog: by the contract a run ends within 2 s of a signal; the rest is for a machine with other work.
const IN_TIME: Duration = Duration::from_secs(10);

/// One window that would compute for days: `run` alone, with rows only at its ends.
fn endless(solver: &str) -> (PathBuf, &'static [&'static str]) {
    match solver {
        "dem-solver" => (
            scene("free-fall"),
            &[
                "--no-shortcuts",
                "--set",
                "end_time=1000.0",
                "--set",
                "output.interval=1000.0",
                "--set",
                "dem.time_step=1e-8",
            ],
        ),
        _ => (
            scene("cable-net"),
            &[
                "--set",
                "structure.dead_load=true",
                "--set",
                "end_time=1000.0",
                "--set",
                "output.interval=1000.0",
                "--set",
                "fem.time_step=1e-8",
            ],
        ),
    }
}

fn spawn(command: &mut Command, bench: &Bench) -> Child {
    command.current_dir(bench.path("")).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("started")
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_raw(child.id() as i32).expect("a process"), signal).expect("sent");
}

/// Wait until the first row is written: from then on the solver is in its window.
fn in_window(out: &Path) {
    until("the first row", || (rows(out) == 1).then_some(()));
    std::thread::sleep(Duration::from_millis(200));
}

#[test]
#[ignore = "long"]
fn a_signal_ends_a_lone_solver_in_the_middle_of_a_window() {
    for solver in ["dem-solver", "fem-solver"] {
        for sent in [Signal::TERM, Signal::INT, Signal::HUP] {
            let bench = Bench::new();
            let out = bench.path("out");
            let (scene, words) = endless(solver);
            let child = spawn(
                // Whatever the tests themselves were told to ignore.
                Command::new("env")
                    .arg("--default-signal=HUP")
                    .arg(program(solver))
                    .arg("run")
                    .arg(scene)
                    .args(words)
                    .arg("--out")
                    .arg(&out),
                &bench,
            );
            in_window(&out);
            let started = Instant::now();
            signal(&child, sent);
            let ended = tests::wait(child, out);
            println!("{solver}, {sent:?}: ended after {:.2} s", started.elapsed().as_secs_f64());
            assert!(started.elapsed() < IN_TIME, "{solver} {sent:?}");
            assert_eq!(ended.code, Some(1), "{solver}: {}", ended.stderr);
            assert!(ended.stderr.contains("error: interrupted"), "{solver}: {}", ended.stderr);
            assert_eq!((ended.rows(), &ended.summary()["status"]), (1, &"interrupted".into()), "{solver}");
        }
    }
}

#[test]
fn a_lone_solver_ends_with_its_launcher() {
    let bench = Bench::new();
    let (scene, words) = endless("dem-solver");
    let child = bench.rockfall(&scene, "out", words).spawn().expect("started");
    let out = bench.path("out");
    in_window(&out);
    let started = Instant::now();
    signal(&child, Signal::KILL);
    let word = out.display().to_string();
    until("the solver ends", || processes_with(&word).is_empty().then_some(()));
    println!("launcher killed: ended after {:.2} s", started.elapsed().as_secs_f64());
    assert!(started.elapsed() < IN_TIME);
    let ended = tests::wait(child, out);
    assert_eq!(ended.summary()["status"], "failed");
    assert_eq!(ended.summary()["message"], "the launcher was lost");
}

#[test]
fn who_writes_into_the_directory_of_a_run_is_refused_whichever_program_it_is() {
    let bench = Bench::new();
    let (lone, words) = endless("dem-solver");
    let out = bench.path("out");
    let first = bench.rockfall(&lone, "out", words).spawn().expect("started");
    in_window(&out);
    let listing = || {
        let entries = std::fs::read_dir(&out).expect("listed").flatten();
        let mut names: Vec<_> =
            entries.map(|e| (e.file_name(), e.metadata().expect("known").len())).collect();
        names.sort();
        names
    };
    let before = listing();
    let alone = |name: &str| {
        let mut command = Command::new(program(name));
        command.arg("run").arg(if name == "coupler" { scene("cable-net") } else { lone.clone() });
        if name == "coupler" {
            command.args(["--run", "second"]);
        }
        command
    };
    for name in ["rockfall", "dem-solver", "coupler"] {
        let second = spawn(alone(name).arg("--force").arg("--out").arg(&out), &bench);
        let ended = tests::wait(second, out.clone());
        assert_eq!(ended.code, Some(2), "{name}: {}", ended.stderr);
        assert!(ended.stderr.contains("is writing its results here"), "{name}: {}", ended.stderr);
    }
    assert_eq!(before, listing());
    signal(&first, Signal::TERM);
    let ended = tests::wait(first, out);
    let record: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(ended.out.join("run.json")).expect("a record"))
            .expect("JSON");
    assert_eq!(ended.summary()["run"], record["run"]);
    assert_eq!(ended.summary()["status"], "interrupted");
}

/// A row that was not written is named, and what is there is whole.
fn rows_are_whole(ended: &Ended, error: &str) {
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains(error), "{}", ended.stderr);
    let text = ended.history();
    let columns = text.lines().next().expect("a header").split(',').count();
    assert!(text.len() > 8_000 && text.ends_with('\n'), "{} bytes", text.len());
    assert!(text.lines().all(|line| line.split(',').count() == columns));
}

/// Files may not grow beyond some kilobytes.
#[test]
fn a_row_that_cannot_be_written_is_named_and_not_torn() {
    let bench = Bench::new();
    let out = bench.path("out");
    let mut command = Command::new("sh");
    // Blocks of 512 bytes.
    command
        .args(["-c", "ulimit -f 24; exec \"$@\"", "sh"])
        .arg(program("rockfall"))
        .arg("run")
        .arg(scene("free-fall"));
    let child = spawn(command.args(["--set", "output.interval=0.001"]).arg("--out").arg(&out), &bench);
    let ended = tests::wait(child, out);
    rows_are_whole(&ended, "history.csv cannot be written: File too large (os error 27)");
    assert_eq!(ended.summary()["status"], "failed");
    assert!(!ended.out.join(".rockfall.lock").exists());
}

/// A full disk, where this test may mount one.
#[test]
fn a_full_disk_is_named() {
    let bench = Bench::new();
    let disk = bench.path("disk");
    std::fs::create_dir(&disk).expect("created");
    for (name, sets) in [("free-fall", "output.interval=0.0001"), ("cable-net", "end_time=0.05")] {
        let mounted =
            Command::new("mount").args(["-t", "tmpfs", "-o", "size=64k", "none"]).arg(&disk).output();
        if !mounted.is_ok_and(|output| output.status.success()) {
            return;
        }
        let child = bench.rockfall(&scene(name), "disk/out", &["--set", sets]).spawn();
        let ended = tests::wait(child.expect("started"), disk.join("out"));
        let outcome = std::panic::catch_unwind(|| rows_are_whole(&ended, "no space is left on the disk of "));
        assert!(Command::new("umount").arg("-l").arg(&disk).status().expect("started").success());
        outcome.unwrap_or_else(|_| panic!("{name}: {}", ended.stderr));
    }
}

#[test]
fn programs_on_different_scenes_refuse_to_couple() {
    let bench = Bench::new();
    let run = format!("d-{}", std::process::id());
    let start = |name: &str, verb: &str, words: &[&str]| {
        let mut command = Command::new(program(name));
        command
            .arg(verb)
            .arg(scene("cable-net"))
            .args(["--run", &run])
            .arg("--out")
            .arg(bench.path("out"))
            .args(words);
        spawn(&mut command, &bench)
    };
    let dem = start("dem-solver", "serve", &["--as", "dem"]);
    let fem = start("fem-solver", "serve", &["--as", "fem", "--set", "structure.damping=21.0"]);
    let coupler = tests::wait(start("coupler", "run", &[]), bench.path("out"));
    assert_eq!(coupler.code, Some(2), "{}", coupler.stderr);
    for part in ["fem (fem-solver", "and the coupler have read different scenes", "fnv1a64:"] {
        assert!(coupler.stderr.contains(part), "{part}: {}", coupler.stderr);
    }
    for child in [dem, fem] {
        assert_eq!(tests::wait(child, bench.path("out")).code, Some(1));
    }
}

#[test]
fn a_solver_that_was_never_started_is_not_said_to_be_alive() {
    let bench = Bench::new();
    let text = std::fs::read_to_string(scene("cable-net")).expect("a scene");
    let scene = bench.scene(&format!("{text}\n[processes]\ntimeout = 1.0\n"));
    let run = format!("n-{}", std::process::id());
    let child = spawn(Command::new(program("coupler")).arg("run").arg(scene).args(["--run", &run]), &bench);
    let ended = tests::wait(child, bench.path("out/scene"));
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(
        ended.stderr.contains("no answer from dem") && ended.stderr.contains("has not joined"),
        "{}",
        ended.stderr
    );
    assert!(!ended.stderr.contains("alive"), "{}", ended.stderr);
}

/// What `--set` changes reaches a foreign solver: it gets the resolved scene, which reads back bit for bit.
#[test]
fn every_program_is_started_on_the_resolved_scene() {
    let bench = Bench::new();
    let scene = bench.scene(&format!(
        "end_time = 0.01\n[coupling]\nscheme = \"weak\"\ntime_window = 1e-3\n[processes]\ndem = \"{}\"\nfem = \"{}\"\n",
        word(example("weight")),
        word(example("oscillator"))
    ));
    let ended: Ended = bench.done(&scene, "out", &["--set", "coupling.time_window=5e-4"]);
    let record: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(ended.out.join("run.json")).expect("a record"))
            .expect("JSON");
    let resolved = ended.out.join("scene.toml").display().to_string();
    for name in ["coupler", "dem", "fem"] {
        let words = record["processes"][name].as_array().expect("a command line").clone();
        assert!(words.contains(&resolved.as_str().into()) && !words.contains(&"--set".into()), "{words:?}");
    }
    // Every program by name and version; those of others by the hash of their file beside it.
    let programs = &record["programs"];
    let own = concat!("coupler ", env!("CARGO_PKG_VERSION"));
    assert_eq!(programs["coupler"]["name"], own, "{programs}");
    assert!(programs["coupler"]["build"].as_str().is_some_and(|b| b.contains("commit")), "{programs}");
    for name in ["dem", "fem"] {
        let program = &programs[name];
        assert!(program["name"].is_string() && program["hash"].is_string(), "{program}");
        assert!(program["build"].is_null(), "{program}");
    }
    assert_eq!(ended.rows(), 20);
}
