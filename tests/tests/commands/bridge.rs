//! `rockfall bridge`: a solver behind TCP gives the bytes that it gives without, and whatever goes wrong ends in time with its reason.

use rustix::process::{Pid, Signal, kill_process};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use tests::{Bench, Ended, example, processes_with, program, repository, rows, scene, until, wait, word};

/// Longer than any test runs: for those in which something is lost.
const LONG: &str = "end_time=1000.0";

fn sphere(bench: &Bench, fem: &str) -> PathBuf {
    bench.sphere_on(fem, "strong", 0.005)
}

/// A port of this machine that nobody has.
fn port() -> u16 {
    TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("its address").port()
}

fn listen(port: u16) -> String {
    format!("rockfall bridge --listen 127.0.0.1:{port}")
}

fn connect(bench: &Bench, port: u16, arguments: &[&str], solver: &str) -> Child {
    let mut command = Command::new(program("rockfall"));
    command.arg("bridge").args(["--connect", &format!("127.0.0.1:{port}")]).args(arguments);
    command.arg("--").args(shlex::split(solver).expect("words")).current_dir(bench.path(""));
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started")
}

fn oscillator() -> String {
    word(example("oscillator"))
}

/// Wall time of the windows, for the reader of the test's output.
fn show_time(what: &str, ended: &Ended) {
    let cost = &ended.summary()["cost"];
    let (wall, exchanges) = (cost["loop_s"].as_f64(), cost["exchanges"].as_f64());
    if let (Some(wall), Some(exchanges)) = (wall, exchanges) {
        println!("{what}: {wall:.3} s, {exchanges} exchanges, {:.1} us each", 1e6 * wall / exchanges);
    }
}

fn is_equal(direct: &Ended, bridged: &Ended) {
    assert!(direct.rows() > 10 && direct.history() == bridged.history(), "history.csv");
    let [a, b] = [direct, bridged].map(Ended::summary);
    for key in ["measures", "verdict", "energy", "status"] {
        assert_eq!(a[key], b[key], "{key}");
    }
}

#[test]
fn an_oscillator_behind_a_bridge_gives_the_same_bytes() {
    let bench = Bench::new();
    let direct = bench.done(&sphere(&bench, &oscillator()), "direct", &[]);
    let at = port();
    let far = connect(&bench, at, &[], &oscillator());
    let bridged = bench.done(&sphere(&bench, &listen(at)), "bridged", &[]);
    let far = wait(far, bench.path(""));
    assert_eq!(far.code, Some(0), "{}", far.stderr);
    is_equal(&direct, &bridged);
    show_time("direct", &direct);
    show_time("bridge", &bridged);
}

/// Selected nodes, a yielding net, both sides behind bridges.
#[test]
fn both_solvers_of_this_project_give_the_same_bytes_behind_bridges() {
    let bench = Bench::new();
    let scene = scene("walenstadt-compare");
    let run = |out: &str, dem: &str, fem: &str| {
        let sets = [format!("processes.dem=\"{dem}\""), format!("processes.fem=\"{fem}\"")];
        bench.rockfall(&scene, out, &["--set", "end_time=0.3", "--set", &sets[0], "--set", &sets[1]])
    };
    let of = |name: &str| word(program(name));
    let direct = run("direct", &of("dem-solver"), &of("fem-solver")).output().expect("started");
    let direct = Ended::of(direct, bench.path("direct"));
    let ports = [port(), port()];
    let ends = [
        connect(&bench, ports[0], &[], &of("dem-solver")),
        connect(&bench, ports[1], &[], &of("fem-solver")),
    ];
    let bridged = run("bridged", &listen(ports[0]), &listen(ports[1])).output().expect("started");
    let bridged = Ended::of(bridged, bench.path("bridged"));
    assert_eq!(direct.code, bridged.code, "{}\n{}", direct.stderr, bridged.stderr);
    for end in ends {
        let end = wait(end, bench.path(""));
        assert_eq!(end.code, Some(0), "{}", end.stderr);
    }
    is_equal(&direct, &bridged);
    show_time("direct", &direct);
    show_time("bridge", &bridged);
}

#[test]
fn a_solver_in_python_written_from_the_page_alone_gives_the_bytes_of_the_one_in_rust() {
    if Command::new("python3").arg("-V").output().is_err() {
        println!("skipped: there is no python3");
        return;
    }
    let bench = Bench::new();
    let direct = bench.done(&sphere(&bench, &oscillator()), "direct", &[]);
    let at = port();
    let child = bench.rockfall(&sphere(&bench, &listen(at)), "bridged", &[]).spawn().expect("started");
    until("the bridge", || TcpListener::bind(("127.0.0.1", at)).is_err().then_some(()));
    let mut python = Command::new("python3");
    python
        .arg(repository().join("tests/tests/commands/bridge/oscillator.py"))
        .args(["127.0.0.1", &at.to_string()]);
    let python = python.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    let bridged = wait(child, bench.path("bridged"));
    let python = wait(python, bench.path(""));
    assert_eq!((bridged.code, python.code), (Some(0), Some(0)), "{}{}", bridged.stderr, python.stderr);
    is_equal(&direct, &bridged);
    show_time("python", &bridged);
}

/// Greet a bridge as a program of others would, and say the rest.
fn greet(at: u16, version: u32, rest: &[u8]) -> TcpStream {
    let mut stream = until("the bridge", || TcpStream::connect(("127.0.0.1", at)).ok());
    let greeting = [&b"rockfall"[..], &version.to_le_bytes(), &0u32.to_le_bytes(), rest].concat();
    stream.write_all(&greeting).expect("sent");
    stream
}

/// All that comes until the other side closes.
fn heard(mut stream: TcpStream) -> String {
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A run whose peer is a stream of the test's own: how it ends, in which time.
fn run_with(timeout: f64, peer: impl FnOnce(u16)) -> Ended {
    let (bench, at, started) = (Bench::new(), port(), Instant::now());
    let sets = format!("processes.timeout={timeout}");
    let scene = sphere(&bench, &listen(at));
    let child = bench.rockfall(&scene, "out", &["--set", LONG, "--set", &sets]).spawn().expect("started");
    peer(at);
    let ended = wait(child, bench.path("out"));
    println!("{:.1} s: {}", started.elapsed().as_secs_f64(), ended.stderr.trim());
    nothing_is_left(&bench);
    assert!(ended.stderr.contains(&format!("the bridge at 127.0.0.1:{at}: ")), "{}", ended.stderr);
    ended
}

fn nothing_is_left(bench: &Bench) {
    let word = bench.path("").display().to_string();
    until("every process ends", || processes_with(&word).is_empty().then_some(()));
}

fn fails(ended: &Ended, what: &str) {
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains(what), "{}", ended.stderr);
}

#[test]
fn a_peer_of_another_version_is_refused_and_the_run_says_so() {
    let ended = run_with(3.0, |at| {
        let said = heard(greet(at, 2, b""));
        assert!(said.starts_with("rockfall\u{1}\0\0\0") && said.contains("speaks version 2"), "{said:?}");
    });
    fails(&ended, "nobody has connected");
    fails(&ended, "it speaks version 2 of the bridge, this side speaks 1");
}

#[test]
fn an_oversized_frame_and_one_without_meaning_end_the_run() {
    for (head, due) in [
        (&[255, 255, 255, 255, 2][..], "a frame of 4294967295 bytes was announced"),
        (&[0, 0, 0, 0, 9], "a frame of kind 9 came"),
        (&[1, 0, 0, 0, 2, 4], "speaks protocol 4, this program speaks protocol 3"),
    ] {
        // The stream lives until the run has ended: its end is not what ends the run.
        let mut kept = None;
        let ended = run_with(20.0, |at| kept = Some(greet(at, 1, head)));
        fails(&ended, due);
        let said = heard(kept.expect("a stream"));
        assert!(said.contains(due), "{said:?}");
    }
}

#[test]
#[ignore = "long"]
fn a_peer_that_says_nothing_ends_the_run_in_time() {
    let mut kept = None;
    let ended = run_with(2.0, |at| kept = Some(greet(at, 1, b"")));
    fails(&ended, "its solver has not said who it is in 1.8 s");
    // One that does not even greet.
    let ended = run_with(2.0, |at| {
        kept = Some(until("the bridge", || TcpStream::connect(("127.0.0.1", at)).ok()));
    });
    fails(&ended, "the other side has connected and does not say who it is");
    let ended = run_with(2.0, |_| ());
    fails(&ended, "nobody has connected in 1.8 s");
}

#[test]
fn only_who_knows_the_token_is_the_solver() {
    let bench = Bench::new();
    for (name, token) in [("a", "0123456789abcdef\n"), ("b", "0123456789abcdeg"), ("c", "short")] {
        std::fs::write(bench.path(name), token).expect("written");
    }
    let file = |name: &str| bench.path(name).display().to_string();
    let at = port();
    let scene = sphere(&bench, &format!("{} --token-file {}", listen(at), file("a")));
    let child = bench.rockfall(&scene, "out", &[]).spawn().expect("started");
    for (token, due) in [
        (&["--token-file", &file("b")][..], "wrong token"),
        (&[], "wrong token"),
        (&["--token-file", &file("c")], "it must have 16 to 1024"),
    ] {
        let far = wait(connect(&bench, at, token, &oscillator()), bench.path(""));
        assert_eq!(far.code, Some(2), "{}", far.stderr);
        assert!(far.stderr.contains(due), "{}", far.stderr);
    }
    let far = connect(&bench, at, &["--token-file", &file("a")], &oscillator());
    let (ended, far) = (wait(child, bench.path("out")), wait(far, bench.path("")));
    assert_eq!((ended.code, far.code), (Some(0), Some(0)), "{}{}", ended.stderr, far.stderr);
}

#[test]
#[ignore = "long"]
fn an_address_that_other_machines_reach_takes_a_token() {
    for (address, due) in [
        ("0.0.0.0:4711", "other machines reach this address, and there is no token"),
        ("127.0.0.1", "write an address of this machine and a port"),
    ] {
        let bench = Bench::new();
        let ended = bench.run(&sphere(&bench, &format!("rockfall bridge --listen {address}")), "out", &[]);
        assert_eq!(ended.code, Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains(due), "{}", ended.stderr);
    }
}

#[test]
fn who_connects_to_something_else_is_told() {
    let bench = Bench::new();
    for (answer, due) in [
        (&b"HTTP/1.1 400 Bad Request\r\n"[..], "the other side is no bridge"),
        (b"rockfall\x07\0\0\0", "it speaks version 7 of the bridge, this side speaks 1"),
        (b"rockfall\x01\0\0\0\xff\xff\xff\xff\x01", "a frame of 4294967295 bytes was announced"),
    ] {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let at = listener.local_addr().expect("its address").port();
        let far = connect(&bench, at, &[], &oscillator());
        let (mut stream, _) = listener.accept().expect("somebody");
        stream.write_all(answer).expect("sent");
        let far = wait(far, bench.path(""));
        assert_eq!(far.code, Some(2), "{}", far.stderr);
        assert!(far.stderr.contains(due), "{}", far.stderr);
    }
    let far = wait(connect(&bench, port(), &["--timeout", "1"], &oscillator()), bench.path(""));
    assert!(
        far.code == Some(2) && far.stderr.contains("no connection: Connection refused"),
        "{}",
        far.stderr
    );
}

/// Whose process is killed or stopped in a run that goes on for long.
fn struck(who: &str, signal: Signal) -> (Ended, Ended) {
    let (bench, at) = (Bench::new(), port());
    let far = connect(&bench, at, &["--out", &bench.path("far").display().to_string()], &oscillator());
    let out = bench.path("out");
    let sets = ["--set", LONG, "--set", "processes.timeout=5"];
    let child = bench.rockfall(&sphere(&bench, &listen(at)), "out", &sets).spawn().expect("started");
    until("some rows", || (rows(&out) > 200).then_some(()));
    let second = TcpStream::connect(("127.0.0.1", at)).expect_err("the solver is there already");
    assert_eq!(second.kind(), std::io::ErrorKind::ConnectionRefused);
    let process = |part: &str, word: &str| {
        let all = processes_with(word);
        all.into_iter().find(|(_, line)| line.contains(part)).map(|(pid, _)| pid)
    };
    let pid = match who {
        "far" => Some(far.id()),
        "near" => process("bridge --listen", &at.to_string()),
        _ => process("oscillator serve", &bench.path("far").display().to_string()),
    };
    let pid = Pid::from_raw(pid.expect("a process") as i32).expect("above 0");
    let struck_at = Instant::now();
    kill_process(pid, signal).expect("sent");
    let ended = wait(child, out);
    let took = struck_at.elapsed();
    if signal == Signal::STOP {
        let _ = kill_process(pid, Signal::CONT);
    }
    let far = wait(far, bench.path(""));
    nothing_is_left(&bench);
    println!(
        "{who}, {signal:?}: {:.1} s, all {:.1} s",
        took.as_secs_f64(),
        struck_at.elapsed().as_secs_f64()
    );
    println!("  run: {}\n  far: {}", ended.stderr.trim(), far.stderr.trim());
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert_ne!(far.code, Some(0), "{}", far.stderr);
    (ended, far)
}

/// The other side was killed: what was on its way then decides how the system says so.
fn is_gone(ended: &Ended) {
    fails(ended, "the other side has closed the connection");
}

#[test]
fn whoever_is_killed_in_a_run_the_others_end_and_say_why() {
    let (run, _) = struck("far", Signal::KILL);
    is_gone(&run);
    let (run, far) = struck("near", Signal::KILL);
    fails(&run, "fem was lost");
    is_gone(&far);
    let (run, far) = struck("solver", Signal::KILL);
    fails(&run, "the other side has ended: ");
    fails(&far, "oscillator ended before the run was over: killed by signal 9");
}

#[test]
#[ignore = "long"]
fn whoever_stands_still_in_a_run_is_missed() {
    let (run, _) = struck("far", Signal::STOP);
    fails(&run, "nothing was heard of the other side");
    let (run, _) = struck("solver", Signal::STOP);
    fails(&run, "no answer from fem");
}

/// The other solver prepares for longer than anybody waits for an answer, and reports progress.
#[test]
#[ignore = "long"]
fn a_solver_that_is_asked_nothing_for_long_stays() {
    let (bench, at) = (Bench::new(), port());
    let scene = bench.scene(&format!(
        "end_time = 0.02\n[coupling]\nscheme = \"weak\"\ntime_window = 1e-3\n[processes]\ntimeout = 3\n\
         dem = \"{}\"\nfem = \"{} {} 6 0 0\"\n",
        listen(at),
        word(example("sleeper")),
        bench.path("mark").display()
    ));
    let far = connect(&bench, at, &[], &word(example("weight")));
    let (ended, far) = (bench.done(&scene, "out", &[]), wait(far, bench.path("")));
    assert_eq!((ended.rows(), far.code), (20, Some(0)), "{}", far.stderr);
}

#[test]
fn an_interrupt_of_the_run_ends_the_other_side() {
    let (bench, at) = (Bench::new(), port());
    let far = connect(&bench, at, &[], &oscillator());
    let out = bench.path("out");
    let child =
        bench.rockfall(&sphere(&bench, &listen(at)), "out", &["--set", LONG]).spawn().expect("started");
    until("some rows", || (rows(&out) > 200).then_some(()));
    kill_process(Pid::from_child(&child), Signal::INT).expect("sent");
    let (ended, far) = (wait(child, out), wait(far, bench.path("")));
    assert!(ended.code == Some(1) && ended.stderr.contains("interrupted"), "{}", ended.stderr);
    println!("far: {:?}: {}", far.code, far.stderr);
    nothing_is_left(&bench);
}

/// Two network namespaces, as two machines or containers have them.
struct Spaces([String; 2]);

impl Spaces {
    /// With a cable between 10.99.0.1 and 10.99.0.2; `Err`: why that cannot be had here.
    fn new() -> Result<Self, String> {
        let spaces = Self(["a", "b"].map(|end| format!("rf{}{end}", std::process::id())));
        let [a, b] = &spaces.0;
        for line in [
            format!("netns add {a}"),
            format!("netns add {b}"),
            format!("-n {a} link add v0 type veth peer name v0 netns {b}"),
            format!("-n {a} addr add 10.99.0.1/24 dev v0"),
            format!("-n {b} addr add 10.99.0.2/24 dev v0"),
            format!("-n {a} link set v0 up"),
            format!("-n {b} link set v0 up"),
        ] {
            let output = Command::new("ip").args(line.split(' ')).output().map_err(|e| format!("ip: {e}"))?;
            if !output.status.success() {
                return Err(format!("ip {line}: {}", String::from_utf8_lossy(&output.stderr).trim()));
            }
        }
        Ok(spaces)
    }

    fn command(&self, end: usize, command: &Command) -> Command {
        let mut inside = Command::new("ip");
        inside.args(["netns", "exec", &self.0[end]]).arg(command.get_program()).args(command.get_args());
        inside.stdout(Stdio::piped()).stderr(Stdio::piped());
        inside
    }
}

impl Drop for Spaces {
    fn drop(&mut self) {
        for name in &self.0 {
            let _ = Command::new("ip").args(["netns", "del", name]).output();
        }
    }
}

#[test]
#[ignore = "long"]
fn two_network_namespaces_give_the_same_bytes_and_a_cable_that_is_cut_is_noticed() {
    let spaces = match Spaces::new() {
        Ok(spaces) => spaces,
        Err(why) => return println!("skipped: {why}"),
    };
    let bench = Bench::new();
    std::fs::write(bench.path("token"), "0123456789abcdef").expect("written");
    let token = bench.path("token").display().to_string();
    let direct = bench.done(&sphere(&bench, &oscillator()), "direct", &[]);
    let scene = sphere(&bench, &format!("rockfall bridge --listen 10.99.0.1:4711 --token-file {token}"));
    let far = || {
        let mut far = Command::new(program("rockfall"));
        far.args(["bridge", "--connect", "10.99.0.1:4711", "--token-file", &token, "--"])
            .arg(example("oscillator"));
        spaces.command(1, &far).spawn().expect("started")
    };
    let near =
        |out, sets: &[&str]| spaces.command(0, &bench.rockfall(&scene, out, sets)).spawn().expect("started");
    let (child, end) = (near("bridged", &[]), far());
    let (bridged, end) = (wait(child, bench.path("bridged")), wait(end, bench.path("")));
    assert_eq!((bridged.code, end.code), (Some(0), Some(0)), "{}{}", bridged.stderr, end.stderr);
    is_equal(&direct, &bridged);
    show_time("direct", &direct);
    show_time("namespaces", &bridged);

    let (child, end) = (near("cut", &["--set", LONG, "--set", "processes.timeout=5"]), far());
    until("some rows", || (rows(&bench.path("cut")) > 200).then_some(()));
    let cut_at = Instant::now();
    let cut = Command::new("ip").args(["-n", &spaces.0[0], "link", "set", "v0", "down"]).status();
    assert!(cut.is_ok_and(|status| status.success()));
    let (ended, end) = (wait(child, bench.path("cut")), wait(end, bench.path("")));
    println!(
        "cut: {:.1} s: {}\n  far: {}",
        cut_at.elapsed().as_secs_f64(),
        ended.stderr.trim(),
        end.stderr.trim()
    );
    fails(&ended, "nothing was heard of the other side");
    fails(&end, "nothing was heard of the other side");
    nothing_is_left(&bench);
}
