//! `rockfall run` with shell scripts in the place of the programs: who is started, how it is watched,
//! how it ends. Every wait has a limit; none asserts a time.

use rustix::process::{Pid, Signal, kill_process, test_kill_process};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// No test lasts longer.
const LIMIT: Duration = Duration::from_secs(60);

/// A script that says who it is and then goes on as `body`.
struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        Self { dir: tempfile::tempdir().expect("a directory") }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn script(&self, name: &str, body: &str) -> &Self {
        use std::os::unix::fs::PermissionsExt;
        let path = self.path(name);
        std::fs::write(
            &path,
            format!("#!/bin/sh\necho \"$0 $*\"\necho $$ > {}.pid\n{body}\n", path.display()),
        )
        .expect("written");
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).expect("executable");
        self
    }

    fn scene(&self, text: &str) -> &Self {
        std::fs::write(self.path("s.toml"), text).expect("written");
        self
    }

    /// A scene in which all three programs are the scripts `dem`, `fem` and `coupler`.
    fn coupled(&self, coupler: &str, dem: &str, fem: &str) -> &Self {
        self.script("coupler", coupler).script("dem", dem).script("fem", fem);
        self.scene("end_time = 1.0\n[[rock]]\n[coupling]\n[processes]\ndem = \"./dem\"\nfem = \"./fem --k 3\"\ncoupler = \"./coupler\"\n")
    }

    fn rockfall(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rockfall"));
        command.current_dir(self.dir.path()).args(arguments).stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn run(&self) -> (Option<i32>, String) {
        ended_with(&self.rockfall(&["run", "s.toml", "--out", "out"]).output().expect("started"))
    }

    fn log(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(&format!("out/log/{name}.log"))).expect("a log")
    }

    fn status(&self) -> String {
        let text = std::fs::read_to_string(self.path("out/summary.json")).expect("a summary");
        let summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        summary["status"].as_str().expect("a status").into()
    }

    /// Wait until the script has started.
    fn pid(&self, name: &str) -> Pid {
        let path = self.path(&format!("{name}.pid"));
        let pid = until(|| std::fs::read_to_string(&path).ok()?.trim().parse().ok());
        Pid::from_raw(pid).expect("a process")
    }

    /// Wait until a script has made this file.
    fn appears(&self, name: &str) {
        until(|| self.path(name).exists().then_some(()));
    }
}

fn ended_with(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn until<T>(mut ready: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(value) = ready() {
            return value;
        }
        assert!(started.elapsed() < LIMIT, "waited too long");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A process that nobody has waited for yet is a zombie: it has ended too.
fn has_ended(pid: Pid) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", pid.as_raw_nonzero())).unwrap_or_default();
    test_kill_process(pid).is_err() || stat.contains(") Z ")
}

fn ended(child: Child) -> (Option<i32>, String) {
    ended_with(&child.wait_with_output().expect("ended"))
}

const FOREVER: &str = "while :; do sleep 0.05; done";

#[test]
fn a_lone_solver_is_started_alone_and_the_record_says_how() {
    let bench = Bench::new();
    bench.script("dem", "exit 0").scene("end_time = 1.0\nprocesses.dem = \"./dem --k 3\"\n");
    let output = bench
        .rockfall(&["run", "s.toml", "--out", "out", "--set", "title=x y", "--no-shortcuts"])
        .output()
        .expect("started");
    assert_eq!(ended_with(&output), (Some(0), String::new()));
    assert!(String::from_utf8_lossy(&output.stdout).contains("done"));
    let log = bench.log("dem");
    assert!(log.contains("dem --k 3 run out/scene.toml --out out --no-shortcuts --supervisor "), "{log}");
    let record = std::fs::read_to_string(bench.path("out/run.json")).expect("a record");
    assert!(record.contains("\"s.toml\": \"fnv1a64:") && record.contains("--no-shortcuts"), "{record}");
    let scene = std::fs::read_to_string(bench.path("out/scene.toml")).expect("a scene");
    assert!(scene.contains("title = \"x y\"") && scene.contains("interval = 0.005"), "{scene}");
    assert_eq!(bench.status(), "done");
}

#[test]
fn a_coupled_run_starts_three_processes_with_one_run_id() {
    let bench = Bench::new();
    bench.coupled("exit 0", "exit 0", "exit 0");
    assert_eq!(bench.run(), (Some(0), String::new()));
    let id = |log: &str| log.split("--run ").nth(1).and_then(|r| r.split(' ').next()).map(String::from);
    let (coupler, dem, fem) = (bench.log("coupler"), bench.log("dem"), bench.log("fem"));
    assert!(
        id(&coupler).is_some() && id(&coupler) == id(&dem) && id(&dem) == id(&fem),
        "{coupler}{dem}{fem}"
    );
    assert!(coupler.contains("coupler run out/scene.toml --run "), "{coupler}");
    assert!(fem.contains("fem --k 3 serve out/scene.toml --run "), "{fem}");
    assert!(fem.contains(" --as fem --out out --timeout 60 --supervisor "), "{fem}");
}

#[test]
fn bad_input_starts_nothing_and_leaves_nothing() {
    let bench = Bench::new();
    bench.script("dem", "exit 0");
    for (scene, expected) in [
        ("[[rok]]\n", "s.toml:1:3: unknown key `rok`"),
        ("end_time = nan\n", "s.toml:1:12: `nan` is not a finite number"),
        ("end_time = 1\n", "the scene has neither a rock nor a structure"),
        ("end_time = 1\nprocesses.dem = \"./dam\"\n", "s.toml:2:17: there is no program ./dam"),
        ("processes.dem = \"./dem\"\n", "the key `end_time` is missing"),
        ("end_time = \n", "s.toml:1:"),
    ] {
        bench.scene(scene);
        let (code, message) = bench.run();
        assert_eq!(code, Some(2), "{scene}: {message}");
        assert!(message.contains(expected), "{scene}: {message}");
        assert_eq!(message.matches("error: ").count(), 1, "{message}");
    }
    assert!(!bench.path("dem.pid").exists() && !bench.path("out").exists());
}

#[test]
fn a_directory_that_holds_a_run_is_refused_unless_forced() {
    let bench = Bench::new();
    bench.script("dem", "exit 0").scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    assert_eq!(bench.run().0, Some(0));
    std::fs::remove_file(bench.path("dem.pid")).expect("removed");
    let (code, message) = bench.run();
    assert_eq!(code, Some(2));
    assert!(message.contains("holds a run already") && message.contains("--force"), "{message}");
    assert!(!bench.path("dem.pid").exists());
    let forced = bench.rockfall(&["run", "s.toml", "--out", "out", "--force"]).output().expect("started");
    assert_eq!(ended_with(&forced).0, Some(0));
}

#[test]
fn a_leader_that_is_killed_is_named_and_its_log_quoted() {
    let bench = Bench::new();
    bench.script("dem", "echo about to die\nkill -9 $$").scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    let (code, message) = bench.run();
    assert_eq!(code, Some(1));
    assert!(
        message.starts_with("error: dem was lost (killed by signal 9)\nlast lines of out/log/dem.log:\n"),
        "{message}"
    );
    assert!(message.ends_with("  | about to die\n"), "{message}");
    assert_eq!(bench.status(), "failed");
}

#[test]
fn a_coupler_that_names_the_lost_one_is_believed_and_nobody_is_left() {
    let bench = Bench::new();
    // The other solver ignores SIGTERM, and has a child that does so too. The coupler sees that one is gone.
    let stubborn = format!("trap '' TERM\nsleep 1000 &\necho $! > child.pid\n{FOREVER}");
    let seen = "while [ ! -e child.pid ] || [ ! -e fem.pid ] || \
                grep -qs 'State:.[^Z]' /proc/$(cat fem.pid)/status; do sleep 0.05; done";
    let error = r#"{"severity":"error","code":"process","key":"processes.fem","message":"fem was lost: in window 3"}"#;
    let coupler = format!("{seen}\necho '{error}' >> \"$ROCKFALL_DIAGNOSTICS\"\nexit 1");
    bench.coupled(&coupler, &stubborn, "sleep 0.1\nkill -9 $$");
    let (code, message) = bench.run();
    assert_eq!(code, Some(1), "{message}");
    assert!(
        message.starts_with("error: fem was lost: in window 3\nfem ended: killed by signal 9\n"),
        "{message}"
    );
    assert!(has_ended(bench.pid("dem")) && has_ended(bench.pid("child")), "{message}");
}

#[test]
fn a_solver_that_ends_before_the_coupler_can_see_it_is_named_from_here() {
    let bench = Bench::new();
    bench.coupled(FOREVER, FOREVER, "echo no licence\nexit 3");
    let (code, message) = bench.run();
    assert_eq!(code, Some(1), "{message}");
    assert!(message.starts_with("error: fem was lost (exit code 3)\n"), "{message}");
    assert!(message.contains("  | no licence"), "{message}");
    assert!(has_ended(bench.pid("coupler")) && has_ended(bench.pid("dem")));
}

#[test]
fn the_first_signal_ends_the_run_in_order_through_the_leader() {
    for signal in [Signal::INT, Signal::TERM] {
        let bench = Bench::new();
        let leader = format!(
            "trap 'echo error: interrupted >&2; touch signalled; exit 1' TERM\ntouch coupler.ready\n{FOREVER}"
        );
        let solver = "while [ ! -e signalled ]; do sleep 0.05; done";
        bench.coupled(&leader, solver, solver);
        let child = bench.rockfall(&["run", "s.toml", "--out", "out"]).spawn().expect("started");
        let members = ["coupler", "dem", "fem"].map(|name| bench.pid(name));
        bench.appears("coupler.ready");
        kill_process(Pid::from_child(&child), signal).expect("sent");
        let (code, message) = ended(child);
        assert_eq!((code, message.as_str()), (Some(1), "error: interrupted\n"));
        assert!(members.into_iter().all(has_ended));
        assert!(bench.path("signalled").exists());
        assert_eq!(bench.status(), "interrupted");
    }
}

#[test]
fn a_signal_that_comes_twice_at_once_ends_the_run_in_order() {
    let bench = Bench::new();
    let leader = format!(
        "trap 'touch heard; sleep 0.3; echo error: interrupted >&2; touch signalled; exit 1' TERM\ntouch coupler.ready\n{FOREVER}"
    );
    let solver = "while [ ! -e signalled ]; do sleep 0.05; done";
    bench.coupled(&leader, solver, solver);
    let child = bench.rockfall(&["run", "s.toml", "--out", "out"]).spawn().expect("started");
    bench.appears("coupler.ready");
    for signal in [Signal::INT, Signal::TERM] {
        kill_process(Pid::from_child(&child), signal).expect("sent");
    }
    assert_eq!(ended(child), (Some(1), "error: interrupted\n".into()));
    assert!(bench.path("signalled").exists());
}

#[test]
fn the_second_signal_kills() {
    let bench = Bench::new();
    let deaf = format!("trap 'touch heard' TERM INT\ntouch $0.ready\n{FOREVER}");
    bench.coupled(&deaf, &deaf, &deaf);
    let child = bench.rockfall(&["run", "s.toml", "--out", "out"]).spawn().expect("started");
    let members = ["coupler", "dem", "fem"].map(|name| bench.pid(name));
    for name in ["coupler.ready", "dem.ready", "fem.ready"] {
        bench.appears(name);
    }
    kill_process(Pid::from_child(&child), Signal::INT).expect("sent");
    // Two signals at once are one: the second is sent some time after the first has been handed on.
    bench.appears("heard");
    std::thread::sleep(Duration::from_millis(300));
    kill_process(Pid::from_child(&child), Signal::INT).expect("sent");
    assert_eq!(ended(child), (Some(1), "error: interrupted\n".into()));
    assert!(members.into_iter().all(has_ended));
}

#[test]
fn clean_says_what_it_removed() {
    let bench = Bench::new();
    let output = bench.rockfall(&["clean"]).output().expect("started");
    assert_eq!(ended_with(&output).0, Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).contains("remove"));
}

#[test]
fn check_starts_nothing_and_names_the_processes() {
    let bench = Bench::new();
    bench.coupled("exit 0", "exit 0", "exit 0");
    let output = bench.rockfall(&["check", "s.toml"]).output().expect("started");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(ended_with(&output).0, Some(0), "{text}");
    assert!(text.starts_with("s: 3 processes over shared memory, 1 s\n"), "{text}");
    assert!(text.contains("fem --k 3") && text.contains("named by the scene"), "{text}");
    let started =
        ["coupler", "dem", "fem"].iter().any(|name| Path::new(&bench.path(&format!("{name}.pid"))).exists());
    assert!(!started && !bench.path("out").exists());
}

/// Every program gets the scene with what the command line has changed, a foreign one too.
#[test]
fn a_foreign_solver_reads_the_resolved_scene_and_files_are_found() {
    let bench = Bench::new();
    bench.script("dem", "cp \"$2\" read.toml").scene(
        "end_time = 1.0\nprocesses.dem = \"./dem\"\ncustom.file = \"./rocks.csv\"\ncustom.stiffness = 1.0\n",
    );
    std::fs::write(bench.path("rocks.csv"), "x").expect("written");
    let sets = ["--set", "custom.stiffness=0.30000000000000004"];
    let output =
        bench.rockfall(&[&["run", "s.toml", "--out", "out"], &sets[..]].concat()).output().expect("started");
    assert_eq!(ended_with(&output), (Some(0), String::new()));
    let read: toml::Table =
        std::fs::read_to_string(bench.path("read.toml")).expect("copied").parse().expect("TOML");
    assert_eq!(read["custom"]["stiffness"].as_float(), Some(0.1 + 0.2));
    let file = read["custom"]["file"].as_str().expect("a path");
    assert!(Path::new(file).is_absolute() && Path::new(file).exists(), "{file}");
    let checked = bench
        .rockfall(&[&["check", "s.toml", "--resolved", "resolved.toml"], &sets[..]].concat())
        .output()
        .expect("started");
    assert_eq!(ended_with(&checked).0, Some(0));
    let body = |name: &str| {
        let text = std::fs::read_to_string(bench.path(name)).expect("there");
        text.lines().skip(1).map(String::from).collect::<Vec<_>>()
    };
    assert_eq!(body("resolved.toml"), body("read.toml"));
}

/// A directory and a scene whose names look like options stay what they are, in all programs.
#[test]
fn a_name_that_begins_with_a_dash_is_no_option() {
    let bench = Bench::new();
    bench.script("dem", "ls \"$4\" && cp \"$2\" read.toml");
    bench.scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    std::fs::rename(bench.path("s.toml"), bench.path("-s.toml")).expect("renamed");
    let words = ["run", "--out=-x", "--set=title=-y", "--", "-s.toml"];
    let output = bench.rockfall(&words).output().expect("started");
    assert_eq!(ended_with(&output), (Some(0), String::new()));
    assert!(bench.path("read.toml").exists() && bench.path("-x/summary.json").exists());
    let log = std::fs::read_to_string(bench.path("-x/log/dem.log")).expect("a log");
    assert!(log.contains("run ./-x/scene.toml --out ./-x --supervisor "), "{log}");
}

#[test]
fn check_answers_as_data_and_says_what_is_wrong_as_data() {
    let bench = Bench::new();
    bench.coupled("exit 0", "exit 0", "exit 0");
    let check = |scene: &str| {
        let output = bench.rockfall(&["check", scene, "--format", "json"]).output().expect("started");
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (output.status.code(), answer)
    };
    let (code, answer) = check("s.toml");
    assert_eq!((code, answer["scene"].as_str()), (Some(0), Some("s")));
    let processes = answer["processes"].as_array().expect("a list");
    assert_eq!(
        processes.iter().map(|p| p["name"].as_str()).collect::<Vec<_>>(),
        [Some("coupler"), Some("dem"), Some("fem")]
    );
    assert!(answer["warnings"].is_array(), "{answer}");
    bench.scene("end_time = 1.0\n[[rok]]\n");
    let (code, answer) = check("s.toml");
    let error = &answer["errors"][0];
    assert_eq!(
        (code, &error["severity"], &error["place"]["position"][0]),
        (Some(2), &"error".into(), &2.into())
    );
    assert_eq!(answer["errors"].as_array().map(Vec::len), Some(1));
}

/// 60 MB in no time: the beginning and the last words are kept.
#[test]
fn a_program_that_prints_without_end_fills_no_disk() {
    let bench = Bench::new();
    let body = "head -c 60000000 /dev/zero | tr '\\0' 'x' | fold -w 79\necho last words";
    bench.script("dem", body).scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    assert_eq!(bench.run(), (Some(0), String::new()));
    let log = bench.log("dem");
    assert!(log.len() < 20_000_000, "{}", log.len());
    assert!(log.contains("dem run out/scene.toml") && log.contains("bytes were left out here"));
    assert!(log.ends_with("last words\n"), "{}", &log[log.len() - 200..]);
}

#[test]
#[ignore = "long"]
fn a_long_run_says_how_far_it_is_where_stderr_is_no_terminal() {
    let bench = Bench::new();
    let body = "printf 'time_s,x\\n0.25,0\\n' > out/history.csv\nsleep 11";
    bench.script("dem", body).scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    assert_eq!(bench.run(), (Some(0), "0.2500 s of 1 s, 25.0 %, after 10 s\n".into()));
}

#[test]
fn a_second_run_into_one_directory_is_refused_and_the_first_is_not_disturbed() {
    let bench = Bench::new();
    let rows = "echo rows > out/history.csv; while [ ! -e go ]; do sleep 0.05; done";
    bench.script("dem", rows).scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    let first = bench.rockfall(&["run", "s.toml", "--out", "out"]).spawn().expect("started");
    until(|| bench.path("out/history.csv").exists().then_some(()));
    let record = std::fs::read_to_string(bench.path("out/run.json")).expect("a record");
    for extra in [&["--quiet"][..], &["--force"]] {
        let words = [&["run", "s.toml", "--out", "out"], extra].concat();
        let (code, message) = ended_with(&bench.rockfall(&words).output().expect("started"));
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains("is writing its results here") && message.contains("--out"), "{message}");
    }
    std::fs::write(bench.path("go"), "").expect("written");
    assert_eq!(ended(first), (Some(0), String::new()));
    assert_eq!(std::fs::read_to_string(bench.path("out/run.json")).expect("a record"), record);
    assert_eq!(std::fs::read_to_string(bench.path("out/history.csv")).expect("rows"), "rows\n");
    let summary: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(bench.path("out/summary.json")).expect("there"))
            .expect("JSON");
    let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
    let scene = std::fs::read_to_string(bench.path("out/scene.toml")).expect("a scene");
    let id = record["run"].as_str().expect("an id");
    assert!(summary["run"] == id && scene.lines().next().expect("a line").contains(id), "{summary} {scene}");
}

#[test]
fn a_directory_that_is_removed_meanwhile_is_not_a_run_that_is_done() {
    for replace in ["", "; mkdir out"] {
        let bench = Bench::new();
        let body = format!("rm -r out{replace}");
        bench.script("dem", &body).scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
        let (code, message) = bench.run();
        assert_eq!(code, Some(1), "{message}");
        assert!(message.contains("out: the directory of the results was removed or replaced"), "{message}");
        assert!(!bench.path("out/summary.json").exists());
    }
}

#[test]
fn nohup_is_respected() {
    let bench = Bench::new();
    bench.script("dem", "while [ ! -e go ]; do sleep 0.05; done");
    bench.scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    let mut command = Command::new("nohup");
    command.arg(env!("CARGO_BIN_EXE_rockfall")).args(["run", "s.toml", "--out", "out"]);
    command.current_dir(bench.dir.path()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("started");
    bench.pid("dem");
    kill_process(Pid::from_child(&child), Signal::HUP).expect("sent");
    std::thread::sleep(Duration::from_millis(300));
    std::fs::write(bench.path("go"), "").expect("written");
    assert_eq!(ended(child).0, Some(0));
    // Without it the closed terminal ends the run.
    let bench = Bench::new();
    bench.script("dem", FOREVER).scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    // The tests themselves may have been started with SIGHUP ignored, which a child inherits.
    let mut command = Command::new("env");
    command.args(["--default-signal=HUP", env!("CARGO_BIN_EXE_rockfall"), "run", "s.toml", "--out", "out"]);
    command.current_dir(bench.dir.path()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("started");
    let dem = bench.pid("dem");
    kill_process(Pid::from_child(&child), Signal::HUP).expect("sent");
    assert_eq!(ended(child), (Some(1), "error: interrupted\n".into()));
    assert!(has_ended(dem));
}

/// The checks of a scene may take long (a cluster of many spheres): a signal ends them, and nothing is left.
#[test]
fn a_signal_while_validating_ends_in_order() {
    for signal in [Signal::INT, Signal::TERM] {
        let bench = Bench::new();
        // A launcher beside which another dem-solver lies, which checks for ever.
        let launcher = bench.path("rockfall");
        std::fs::copy(env!("CARGO_BIN_EXE_rockfall"), &launcher).expect("copied");
        bench.script("dem-solver", FOREVER).scene("end_time = 1.0\n[[rock]]\n");
        let child = Command::new(&launcher)
            .current_dir(bench.dir.path())
            .args(["run", "s.toml", "--out", "out"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started");
        let check = bench.pid("dem-solver");
        kill_process(Pid::from_child(&child), signal).expect("sent");
        assert_eq!(ended(child), (Some(1), "error: interrupted\n".into()));
        assert!(has_ended(check) && !bench.path("out").exists());
    }
}

/// What a program of this project finds is read as data: what it prints besides is for people.
#[test]
fn a_check_is_believed_by_its_data_and_not_by_its_words() {
    let bench = Bench::new();
    let launcher = bench.path("rockfall");
    std::fs::copy(env!("CARGO_BIN_EXE_rockfall"), &launcher).expect("copied");
    let error = r#"{"severity":"error","code":"invalid-value","key":"rock.0.mass","message":"too light"}"#;
    let say = format!(
        "echo 'error: other words' >&2\nprintf '%s\\n' '{error}' '{error}' >> \"$ROCKFALL_DIAGNOSTICS\""
    );
    bench.script("dem-solver", &format!("{say}\nexit 2")).scene("end_time = 1.0\n[[rock]]\n");
    let run = || {
        let mut command = Command::new(&launcher);
        command.current_dir(bench.dir.path()).args(["run", "s.toml", "--out", "out"]);
        ended_with(&command.output().expect("started"))
    };
    assert_eq!(run(), (Some(2), "error: too light\n".into()));
    // One that says nothing as data is quoted.
    bench.script("dem-solver", "echo 'no licence' >&2\nexit 1");
    let (code, message) = run();
    assert!(
        code == Some(1) && message.contains("ended with exit code 1 and printed: no licence"),
        "{message}"
    );
}

#[test]
fn names_that_are_no_text_do_not_panic() {
    use std::os::unix::ffi::OsStrExt;
    let bench = Bench::new();
    bench
        .script("dem", "ls \"$4\" && cp \"$2\" read.toml")
        .scene("end_time = 1.0\nprocesses.dem = \"./dem\"\n");
    let name = |bytes: &[u8]| std::ffi::OsStr::from_bytes(bytes).to_owned();
    let scene = name(b"sc\xffene.toml");
    std::fs::rename(bench.path("s.toml"), bench.dir.path().join(&scene)).expect("renamed");
    let mut command = bench.rockfall(&["run"]);
    command.arg(&scene).arg("--out").arg(name(b"o\xffut"));
    let output = command.output().expect("started");
    assert_eq!(ended_with(&output), (Some(0), String::new()));
    assert!(
        bench.path("read.toml").exists()
            && bench.dir.path().join(name(b"o\xffut")).join("summary.json").exists()
    );
    for words in [&["run"][..], &["check"], &["clean"]] {
        let mut command = bench.rockfall(words);
        let output = command.arg(name(b"no\xff.toml")).output().expect("started");
        assert_eq!(ended_with(&output).0, Some(2), "{words:?}");
    }
}
