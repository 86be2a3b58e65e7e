//! What the tests of the programs together share: where the programs are, a directory of one's own,
//! what a run left behind.

pub mod browser;
pub mod in_process;
pub mod manual;
pub mod readers;

use interface_defs::Fate;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use toolkit::summary::Summary;

/// Longest that a test waits for anything: a watchdog, not a claim about speed.
pub const LIMIT: Duration = Duration::from_secs(120);

/// Where Cargo puts programs: beside this test.
fn target_dir() -> PathBuf {
    let test = std::env::current_exe().expect("this test has a path");
    test.parent().and_then(Path::parent).expect("target/release/deps").to_path_buf()
}

/// One of our programs. Panics if it has not been built.
pub fn program(name: &str) -> PathBuf {
    built(target_dir().join(name))
}

/// One of the example solvers. Panics if it has not been built.
pub fn example(name: &str) -> PathBuf {
    built(target_dir().join("examples").join(name))
}

/// A path as a word of a command line, quoted where it has spaces.
pub fn word(path: impl AsRef<Path>) -> String {
    let text = path.as_ref().to_str().expect("UTF-8");
    shlex::try_quote(text).expect("no NUL").into_owned()
}

fn built(path: PathBuf) -> PathBuf {
    assert!(
        path.exists(),
        "{} is missing: build with `cargo build --release --workspace --examples`",
        path.display()
    );
    path
}

/// The repository.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_path_buf()
}

/// A scene that comes with the project.
pub fn scene(name: &str) -> PathBuf {
    repository().join("launch/scenes").join(format!("{name}.toml"))
}

/// A directory of one test's own, removed when it ends.
pub struct Bench {
    dir: tempfile::TempDir,
}

impl Default for Bench {
    fn default() -> Self {
        Self::new()
    }
}

impl Bench {
    /// An empty one.
    pub fn new() -> Self {
        Self { dir: tempfile::tempdir().expect("a directory") }
    }

    /// A path in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Write a scene into it.
    pub fn scene(&self, text: &str) -> PathBuf {
        let path = self.path("scene.toml");
        std::fs::write(&path, text).expect("written");
        path
    }

    /// Write the scene of a sphere of 0.1 m that falls with 3.132 m/s, as after half a metre, from `gap` [m] above the structure of
    /// the program `fem`.
    pub fn sphere_on(&self, fem: &str, scheme: &str, gap: f64) -> PathBuf {
        self.scene(&format!(
            r#"
end_time = 0.02
gravity = [0.0, 0.0, -9.81]
[[rock]]
position = [0.0, 0.0, {}]
velocity = [0.0, 0.0, -3.13209195]
density = 2500.0
shape = {{ type = "sphere", radius = 0.1 }}
[[contact]]
law = "hertz_mindlin"
young = 1e9
poisson = 0.25
restitution = 1.0
[dem]
time_step = 1e-5
[coupling]
scheme = "{scheme}"
time_window = 1e-5
[processes]
timeout = 20
fem = "{fem}"
"#,
            0.1 + gap
        ))
    }

    /// `rockfall run SCENE --out OUT ARGUMENTS`, not started yet.
    pub fn rockfall(&self, scene: &Path, out: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(program("rockfall"));
        command.arg("run").arg(scene).arg("--out").arg(self.path(out)).args(arguments);
        command
            .current_dir(self.dir.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Run a scene to its end.
    pub fn run(&self, scene: &Path, out: &str, arguments: &[&str]) -> Ended {
        Ended::of(self.rockfall(scene, out, arguments).output().expect("started"), self.path(out))
    }

    /// Run a scene to its end, which must be a good one.
    pub fn done(&self, scene: &Path, out: &str, arguments: &[&str]) -> Ended {
        let ended = self.run(scene, out, arguments);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ended
    }
}

/// A program that has ended.
pub struct Ended {
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// What it printed.
    pub stdout: String,
    /// What it complained about.
    pub stderr: String,
    /// Directory of its results.
    pub out: PathBuf,
}

impl Ended {
    /// From what a finished process gave.
    pub fn of(output: Output, out: PathBuf) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
            out,
        }
    }

    /// `summary.json`.
    pub fn summary(&self) -> serde_json::Value {
        let text = std::fs::read_to_string(self.out.join("summary.json")).expect("a summary");
        serde_json::from_str(&text).expect("JSON")
    }

    /// Warnings of the summary, each as the screen shows it.
    pub fn warnings(&self) -> Vec<String> {
        let summary = Summary::read(&self.out).expect("a summary");
        summary.warnings.iter().map(ToString::to_string).collect()
    }

    /// Codes of the warnings of the summary.
    pub fn codes(&self) -> Vec<String> {
        let summary = Summary::read(&self.out).expect("a summary");
        summary.warnings.iter().map(|warning| warning.code.to_string()).collect()
    }

    /// What became of each rock.
    pub fn fates(&self) -> Vec<Fate> {
        let summary = Summary::read(&self.out).expect("a summary");
        summary.verdict.iter().map(|verdict| verdict.fate).collect()
    }

    /// A measure of the summary.
    pub fn measure(&self, name: &str) -> f64 {
        let summary = self.summary();
        let value = summary["measures"][name]["value"].as_f64();
        value.unwrap_or_else(|| panic!("no measure {name} in {}", summary["measures"]))
    }

    /// `history.csv`, as text.
    pub fn history(&self) -> String {
        std::fs::read_to_string(self.out.join("history.csv")).expect("a history")
    }

    /// A column of `history.csv`.
    pub fn column(&self, name: &str) -> Vec<f64> {
        let text = self.history();
        let mut lines = text.lines();
        let header = lines.next().expect("a header");
        let at = header
            .split(',')
            .position(|c| c == name)
            .unwrap_or_else(|| panic!("no column {name} in {header}"));
        lines.map(|line| line.split(',').nth(at).expect("a field").parse().expect("a number")).collect()
    }

    /// Rows of `history.csv`; 0 if there is none.
    pub fn rows(&self) -> usize {
        rows(&self.out)
    }
}

/// Rows of the `history.csv` in `out`; 0 if there is none.
pub fn rows(out: &Path) -> usize {
    let text = std::fs::read_to_string(out.join("history.csv")).unwrap_or_default();
    text.lines().count().saturating_sub(1)
}

/// Seeds of a reader: files of its corpus, and what this version writes itself.
pub fn seeds(target: &readers::Target) -> Vec<Vec<u8>> {
    let dir = repository().join("tests/fuzz/corpus").join(target.name);
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(dir).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let kept = paths.iter().map(|path| std::fs::read(path).expect("a file"));
    kept.chain((target.made)()).collect()
}

/// Ask again until there is an answer. Panics at the watchdog's limit.
pub fn until<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(started.elapsed() < LIMIT, "{what}: nothing after {LIMIT:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Wait for a child with the watchdog's limit.
pub fn wait(mut child: Child, out: PathBuf) -> Ended {
    until("a child ends", || child.try_wait().expect("can be asked"));
    Ended::of(child.wait_with_output().expect("its output"), out)
}

/// Processes that live and whose command line names `word` (a path of the test's own directory).
pub fn processes_with(word: &str) -> Vec<(u32, String)> {
    let entries = std::fs::read_dir("/proc").expect("a process table").flatten();
    let mut found = Vec::new();
    for entry in entries {
        let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse::<u32>().ok()) else {
            continue;
        };
        let line = std::fs::read(entry.path().join("cmdline")).unwrap_or_default();
        let line = String::from_utf8_lossy(&line).replace('\0', " ");
        let state = std::fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
        let dead = state.rsplit(')').next().is_some_and(|rest| rest.trim_start().starts_with('Z'));
        if line.contains(word) && !dead {
            found.push((pid, line));
        }
    }
    found
}

/// What runs of this user have left in shared memory.
pub fn shared_memory_of(run: &str) -> Vec<String> {
    let names = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    let names = names.map(|e| e.file_name().to_string_lossy().into_owned());
    names.filter(|name| name.starts_with(&format!("rf_{run}"))).collect()
}
