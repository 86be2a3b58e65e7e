//! A study on engines that give out tasks: HyperQueue and Slurm, by the scripts in `launch/engines`, started on this machine. Tasks
//! and workers are killed in the middle; the results are those of one process, byte for byte. Where an engine is not
//! installed, its test says `skipped: why` and passes.

use dem_solver::random::SplitMix;
use dem_solver::terrain::raster::Raster;
use rustix::process::{Pid, Signal, kill_process};
use std::collections::BTreeMap;
use std::fs;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tests::{Bench, processes_with, program, repository, until, wait};

#[path = "../../../dem-solver/tests/support/slope.rs"]
mod slope;
use slope::Slope;

const SCENE: &str = "end_time = 30.0\ngravity = [0.0, 0.0, -9.81]\n\
    [[rock]]\nname = \"block\"\nposition = [2600012.0, 1200020.0, 1070.0]\ndensity = 2600.0\n\
    shape = { type = \"box\", size = [0.8, 0.7, 0.6] }\ncluster.spheres = 60\n\
    [terrain]\nfile = \"slope.asc\"\n\
    [[contact]]\nlaw = \"hertz_rock\"\nyoung = 1e9\npoisson = 0.25\nrestitution = 0.2\nfriction = 0.6\n";

const STUDY: &str = "scene = \"fall.toml\"\nseed = 3\n\
    [[release]]\npolygon = [[2600005.0, 1200010.0], [2600015.0, 1200012.0], [2600010.0, 1200030.0]]\nheight = 1.0\ncount = 120\n\
    [vary]\norientation = \"uniform\"\nspeed = { uniform = [0.5, 4.0] }\ncontact.0.friction = { normal = [0.6, 0.05] }\n\
    [maps]\ncell = 2.0\nepsg = 2056\n[[line]]\nname = \"road\"\npoints = [[2600035.0, 1200005.0], [2600035.0, 1200035.0]]\n";

/// Tasks of the study.
const CHUNKS: &str = "20";

/// A directory with terrain, scene and study, and the results of one process.
struct Site {
    bench: Bench,
    alone: BTreeMap<PathBuf, Vec<u8>>,
}

impl Site {
    fn new() -> Self {
        let bench = Bench::new();
        let slope = Slope {
            corner: [2_600_000.0, 1_200_000.0],
            spacing: 1.0,
            counts: [121, 41],
            drop: 60.0,
            foot: 1000.0,
            benches: 3,
            roughness: 0.05,
            seed: 5,
        };
        slope.raster().write_asc(&bench.path("slope.asc")).expect("written");
        fs::write(bench.path("fall.toml"), SCENE).expect("written");
        fs::write(bench.path("study.toml"), STUDY).expect("written");
        let mut site = Self { bench, alone: BTreeMap::new() };
        let mut command = Command::new(program("rockfall"));
        command.arg("ensemble").arg(site.bench.path("study.toml")).arg("--out").arg(site.bench.path("alone"));
        let output = command.output().expect("started");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        site.alone = results(&site.bench.path("alone"));
        site
    }

    /// A script of `launch/engines` on the study, results to `on`.
    fn script(&self, program: &str, name: &str) -> Command {
        let mut command = Command::new(program);
        command.arg(repository().join("launch/engines").join(name)).current_dir(self.bench.path(""));
        command.env("ROCKFALL_BIN", tests::program("rockfall").parent().expect("a directory"));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Wait until so many chunks are complete.
    fn chunks(&self, count: usize) {
        until("chunks", || {
            let files = fs::read_dir(self.bench.path("on/chunks")).ok()?.flatten();
            let complete = files.filter(|file| file.path().extension().is_some_and(|end| end == "chunk"));
            (complete.count() >= count).then_some(())
        });
    }

    /// Kill one process at work on a chunk.
    fn kill_a_task(&self) {
        let word = self.bench.path("on").display().to_string();
        let task = until("a task", || {
            processes_with(&word).into_iter().find(|(_, line)| line.contains("--members"))
        });
        kill(task.0);
    }

    /// Processes that name this directory, none left.
    fn all_end(&self) {
        let word = self.bench.path("").display().to_string();
        until("all processes end", || processes_with(&word).is_empty().then_some(()));
    }

    fn compare(&self) {
        let on = results(&self.bench.path("on"));
        let names = |of: &BTreeMap<PathBuf, Vec<u8>>| of.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&on), names(&self.alone));
        for (name, bytes) in &self.alone {
            let text = |bytes: &[u8]| String::from_utf8_lossy(&bytes[..bytes.len().min(4000)]).into_owned();
            assert!(on[name] == *bytes, "{} differs: {} {}", name.display(), text(&on[name]), text(bytes));
        }
    }
}

fn kill(process: u32) {
    // It may have ended meanwhile.
    let _ = kill_process(Pid::from_raw(process as i32).expect("a process"), Signal::KILL);
}

/// Table, maps, lines, and the summary but for what one run alone has.
fn results(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for folder in ["maps", "lines"] {
        for file in fs::read_dir(dir.join(folder)).expect("a folder").flatten() {
            all.insert(Path::new(folder).join(file.file_name()), fs::read(file.path()).expect("read"));
        }
    }
    assert!(all.len() > 40, "{}", all.len());
    all.insert("members.csv".into(), fs::read(dir.join("members.csv")).expect("a table"));
    let summary = fs::read_to_string(dir.join("summary.json")).expect("a summary");
    let mut summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    // What it has cost, and the name of the process.
    for own in ["cost", "run"] {
        assert!(summary.as_object_mut().expect("a table").remove(own).is_some(), "{own}");
    }
    all.insert("summary.json".into(), summary.to_string().into_bytes());
    all
}

/// A process that is killed when the test is done with it.
struct Daemon(Child);

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Parts of a study cover all members, once each, in order.
#[test]
fn chunks_are_printed_as_the_option_members_takes_them() {
    let bench = Bench::new();
    fs::write(bench.path("study.toml"), STUDY).expect("written");
    for (count, lines) in [(1, 1), (7, 7), (1000, 120)] {
        let mut command = Command::new(program("rockfall"));
        command.arg("ensemble").arg(bench.path("study.toml")).args(["--chunks", &count.to_string()]);
        let output = command.output().expect("started");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let parts = text.lines().map(|line| {
            let (first, last) = line.split_once("..").expect("A..B");
            [first, last].map(|number| number.parse::<u64>().expect("a number"))
        });
        let parts: Vec<[u64; 2]> = parts.collect();
        assert_eq!(parts.len(), lines);
        let members: Vec<u64> = parts.iter().flat_map(|[first, last]| *first..=*last).collect();
        assert_eq!(members, (1..=120).collect::<Vec<_>>());
    }
}

/// Why a program is not there.
fn lacks(program: &str, arguments: &[&str]) -> Option<String> {
    let tried = Command::new(program).args(arguments).stdin(Stdio::null()).output();
    match tried {
        Err(e) => Some(format!("{program}: {e}")),
        Ok(output) if output.status.success() => None,
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            Some(format!("{program}: {}", said.lines().last().unwrap_or("it cannot be run")))
        }
    }
}

/// A HyperQueue server, with a worker of one core if `$2` says so, until its input ends.
const SERVER: &str = "import sys, hyperqueue\n\
    from hyperqueue.cluster import WorkerConfig\n\
    cluster = hyperqueue.LocalCluster(server_dir=sys.argv[1], worker_config=WorkerConfig(cores=1))\n\
    open(sys.argv[1] + '/ready', 'w').close()\n\
    sys.stdin.read()\n\
    cluster.stop()\n";

/// A worker of it in a process of its own. The interface starts workers beside a server of the same process alone: here this server's
/// address is replaced by that of the other one.
const WORKER: &str = "import shutil, sys, hyperqueue\n\
    from hyperqueue.cluster import WorkerConfig\n\
    server, own = sys.argv[1:]\n\
    cluster = hyperqueue.LocalCluster(server_dir=own)\n\
    shutil.copy(server + '/hq-current/access.json', own + '/hq-current/access.json')\n\
    cluster.start_worker(WorkerConfig(cores=1))\n\
    open(own + '/ready', 'w').close()\n\
    sys.stdin.read()\n";

/// Start a part of a HyperQueue; `place` and `dirs` are folders in the site.
fn part_of_hyperqueue(site: &Site, script: &str, dirs: &[&str]) -> Daemon {
    let paths: Vec<PathBuf> = dirs.iter().map(|dir| site.bench.path(dir)).collect();
    let own = paths.last().expect("a folder");
    fs::create_dir(own).expect("made");
    let mut command = Command::new("python3");
    command
        .args(["-c", script])
        .args(&paths)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let daemon = Daemon(command.spawn().expect("started"));
    until("a part of HyperQueue", || own.join("ready").exists().then_some(()));
    daemon
}

/// A task is killed, then a worker: another one takes over. A script that starts server and worker itself is killed with both, and
/// goes on. Both end with the results of one process.
#[test]
fn hyperqueue_ends_with_the_results_of_one_process() {
    if let Some(why) = lacks("python3", &["-c", "import hyperqueue"]) {
        println!("skipped: {why}");
        return;
    }
    let site = Site::new();
    let start = |arguments: &[&str]| {
        let mut script = site.script("python3", "on_hyperqueue.py");
        script.args(["study.toml", "--out", "on", "--chunks", CHUNKS]).args(arguments);
        script.spawn().expect("started")
    };
    let server = part_of_hyperqueue(&site, SERVER, &["server"]);
    let worker = part_of_hyperqueue(&site, WORKER, &["server", "worker"]);
    let script = start(&["--server", site.bench.path("server").to_str().expect("a name")]);
    site.chunks(2);
    site.kill_a_task();
    site.chunks(5);
    kill(worker.0.id());
    let ended = wait(script, site.bench.path("on"));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    site.compare();
    drop((worker, server));
    fs::remove_dir_all(site.bench.path("on")).expect("removed");
    let script = Daemon(start(&["--cores", "2"]));
    site.chunks(5);
    kill(script.0.id());
    drop(script);
    let ended = wait(start(&["--cores", "2"]), site.bench.path("on"));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    site.compare();
    site.all_end();
}

/// Study, barrier and options of the worst members against a barrier.
fn against_a_barrier() -> [PathBuf; 2] {
    let studies = repository().join("launch/scenes/studies");
    ["slope.toml", "barrier.toml"].map(|name| studies.join(name))
}

/// A directory with the results of one process, the worst three members against a barrier.
fn site_with_a_barrier() -> Site {
    let site = Site { bench: Bench::new(), alone: BTreeMap::new() };
    let [study, barrier] = against_a_barrier();
    let mut alone = Command::new(program("rockfall"));
    alone.arg("ensemble").arg(study).arg("--barrier").arg(barrier).args(["--worst", "3"]);
    let output = alone.arg("--out").arg(site.bench.path("alone")).output().expect("started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    site
}

/// A rock's process is killed as a run against the barrier is under way. Its task is tried again, and verdicts are those of one process.
fn survives_at_the_barrier(site: &Site, script: Child) {
    let task = until("a run against the barrier", || {
        let word = site.bench.path("on/barrier").display().to_string();
        processes_with(&word).into_iter().find(|(_, line)| line.contains("dem-solver"))
    });
    kill(task.0);
    let ended = wait(script, site.bench.path("on"));
    assert_eq!(ended.code, Some(0), "{} {}", ended.stdout, ended.stderr);
    for file in ["members.csv", "barrier/verdicts.csv", "barrier/chosen.json"] {
        let [own, wanted] =
            ["on", "alone"].map(|dir| fs::read_to_string(site.bench.path(dir).join(file)).expect("read"));
        assert_eq!(own, wanted, "{file}");
    }
}

#[test]
fn members_against_a_barrier_are_tasks_of_hyperqueue() {
    if let Some(why) = lacks("python3", &["-c", "import hyperqueue"]) {
        println!("skipped: {why}");
        return;
    }
    let site = site_with_a_barrier();
    let [study, barrier] = against_a_barrier();
    let mut script = site.script("python3", "on_hyperqueue.py");
    script.arg(study).arg("--barrier").arg(barrier).args(["--worst", "3", "--chunks", "4", "--cores", "2"]);
    survives_at_the_barrier(&site, script.args(["--out", "on"]).spawn().expect("started"));
    site.all_end();
}

#[test]
fn members_against_a_barrier_are_tasks_of_slurm() {
    if let Some(why) = lacks_slurm() {
        println!("skipped: {why}");
        return;
    }
    let site = site_with_a_barrier();
    let slurm = Slurm::start(site.bench.path("slurm"));
    let [study, barrier] = against_a_barrier();
    let mut script = site.script("sh", "on_slurm.sh");
    script.arg(study).arg("4").env("BARRIER", barrier).env("WORST", "3").env("OUT", site.bench.path("on"));
    let script = script.env("SLURM_CONF", slurm.dir.join("slurm.conf")).spawn().expect("started");
    survives_at_the_barrier(&site, script);
    drop(slurm);
    site.all_end();
}

/// A Slurm cluster of this machine alone.
struct Slurm {
    dir: PathBuf,
    /// In the order of their start.
    daemons: Vec<Daemon>,
}

impl Slurm {
    fn start(dir: PathBuf) -> Self {
        ["", "state", "spool"].iter().for_each(|name| fs::create_dir(dir.join(name)).expect("made"));
        let key = dir.join("key");
        // Of this cluster alone, for the time of the test.
        fs::write(&key, [7; 64]).expect("written");
        fs::set_permissions(&key, fs::Permissions::from_mode(0o400)).expect("set");
        let host = fs::read_to_string("/proc/sys/kernel/hostname").expect("a name");
        fs::write(dir.join("slurm.conf"), configuration(&dir, host.trim())).expect("written");
        let mut it = Self { dir, daemons: Vec::new() };
        let file = |option: &str, name: &str| format!("--{option}={}", it.dir.join(name).display());
        let files = [
            ("key-file", "key"),
            ("socket", "munge"),
            ("pid-file", "pid"),
            ("log-file", "log"),
            ("seed-file", "seed"),
        ];
        let files: Vec<String> = files.iter().map(|(option, name)| file(option, name)).collect();
        let mut munged = it.command("/usr/sbin/munged");
        it.daemons
            .push(Daemon(munged.args(["--foreground", "--force"]).args(files).spawn().expect("started")));
        until("munge", || it.dir.join("munge").exists().then_some(()));
        for program in ["/usr/sbin/slurmctld", "/usr/sbin/slurmd"] {
            it.daemons.push(Daemon(it.command(program).arg("-D").spawn().expect("started")));
        }
        until("a node", || it.says("sinfo", &["--noheader"]).contains("idle").then_some(()));
        it
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.dir.join("slurm.conf"));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    fn says(&self, program: &str, arguments: &[&str]) -> String {
        let output = self.command(program).args(arguments).stdout(Stdio::piped()).output().expect("started");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// The node as after a power cut, and switched on again: its daemon, what watches tasks, and tasks.
    fn lose_the_node(&mut self, site: &Site) {
        kill(self.daemons.pop().expect("slurmd").0.id());
        let word = site.bench.path("on").display().to_string();
        for (task, line) in processes_with(&word) {
            if line.contains("--members") {
                let script = parent(task);
                let of_slurm = [parent(script), script].into_iter().filter(|process| is_of_slurm(*process));
                of_slurm.chain([task]).for_each(kill);
            }
        }
        self.daemons.push(Daemon(self.command("/usr/sbin/slurmd").arg("-D").spawn().expect("started")));
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        // The last one first: they take their leave of each other.
        while let Some(mut daemon) = self.daemons.pop() {
            let _ = kill_process(Pid::from_child(&daemon.0), Signal::TERM);
            let begun = Instant::now();
            while begun.elapsed() < Duration::from_secs(10) && matches!(daemon.0.try_wait(), Ok(None)) {
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    }
}

/// Whether a process is one of a node: what watches a task, or the script that it runs.
fn is_of_slurm(process: u32) -> bool {
    let line = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    String::from_utf8_lossy(&line).contains("slurm")
}

/// The process that has started this one.
fn parent(process: u32) -> u32 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("PPid:"));
    line.and_then(|number| number.trim().parse().ok()).unwrap_or_default()
}

/// `slurm.conf` of a cluster in `dir`: one node, two processors, a lost node is noticed after five seconds.
fn configuration(dir: &Path, host: &str) -> String {
    let free = || {
        let socket = TcpListener::bind("127.0.0.1:0").expect("a port");
        socket.local_addr().expect("bound").port()
    };
    let (control, node) = (free(), free());
    let dir = dir.display();
    format!(
        "ClusterName=test\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={control}\nSlurmdPort={node}\n\
         SlurmUser=root\nSlurmdUser=root\nAuthType=auth/munge\nAuthInfo=socket={dir}/munge,cred_expire=5\nCredType=cred/munge\n\
         StateSaveLocation={dir}/state\nSlurmdSpoolDir={dir}/spool\nSlurmctldPidFile={dir}/ctld.pid\nSlurmdPidFile={dir}/d.pid\n\
         ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\nSwitchType=switch/none\n\
         SelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\nMpiDefault=none\nMailProg=/bin/true\nReturnToService=2\n\
         SlurmdTimeout=5\nBatchStartTimeout=2\nKillWait=1\nSchedulerParameters=sched_interval=1,batch_sched_delay=1\n\
         NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN\nPartitionName=all Nodes={host} Default=YES State=UP\n"
    )
}

/// Why a cluster of this test's own cannot be started.
fn lacks_slurm() -> Option<String> {
    let programs = ["sbatch", "sinfo", "/usr/sbin/slurmctld", "/usr/sbin/slurmd", "/usr/sbin/munged"];
    let lacking = |program: &&str| lacks("which", &[*program]).is_some();
    if let Some(program) = programs.into_iter().find(lacking) {
        return Some(format!("{program} is not installed"));
    }
    let root = rustix::process::geteuid().is_root();
    (!root).then(|| "a Slurm cluster of this test's own is started by root alone".into())
}

/// A task is killed, then the node: its tasks are queued again. The results are those of one process.
#[test]
fn slurm_ends_with_the_results_of_one_process() {
    if let Some(why) = lacks_slurm() {
        println!("skipped: {why}");
        return;
    }
    let site = Site::new();
    let mut slurm = Slurm::start(site.bench.path("slurm"));
    let mut script = site.script("sh", "on_slurm.sh");
    script
        .args(["study.toml", CHUNKS])
        .env("OUT", site.bench.path("on"))
        .env("SLURM_CONF", slurm.dir.join("slurm.conf"));
    let script = script.spawn().expect("started");
    site.chunks(2);
    site.kill_a_task();
    site.chunks(5);
    slurm.lose_the_node(&site);
    let ended = wait(script, site.bench.path("on"));
    assert_eq!(ended.code, Some(0), "{} {}", ended.stdout, ended.stderr);
    site.compare();
    drop(slurm);
    site.all_end();
}
