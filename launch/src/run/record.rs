//! What will run, on disk before it runs: `scene.toml` with every default, `run.json`. With `--resume`: whether the run in the
//! directory is the one that was asked for, and from where it goes on.

use crate::check::ground::Ground;
use crate::check::plan::{Member, Part, Plan};
use crate::front::shell;
use crate::front::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc::RunId;
use serde_json::{Map, Value, json};
use std::ffi::OsString;
use std::io;
use std::path::Path;
use std::time::{Duration, Instant};
use toml::Table;
use toolkit::check::CheckReport;
use toolkit::checkpoint::Found;
use toolkit::files::{self, Dir};
use toolkit::input_file::{self, named_files, with_absolute_files};
use toolkit::limits::Limits;
use toolkit::output::Output;
use toolkit::owner::holder;
use toolkit::processes::without_waiting;
use toolkit::provenance::{self, build_id};
use toolkit::run_dir::{self, HISTORY, RECORD, SCENE};
use toolkit::scene::Scene;
use toolkit::simd;
use toolkit::start_from::Origin;
use toolkit::summary::{RunStatus, Summary};

/// The scene with every `--set` and every default filled in, which runs again as it is from any
/// directory: paths of files that are there are absolute in it.
pub fn resolved(scene: &Scene, plan: &Plan, reports: &[(Part, CheckReport)]) -> Result<Table, Diagnostic> {
    let mut table = scene.document()?;
    for (_, report) in reports {
        table.extend(report.resolved.clone());
    }
    let fault = |e: toml::ser::Error| Diagnostic::new(format!("the resolved scene cannot be written: {e}"));
    table.insert("output".into(), Table::try_from(Output::of(scene)?).map_err(fault)?.into());
    table.insert("limits".into(), Table::try_from(Limits::of(scene)?).map_err(fault)?.into());
    // The coupler has filled in its defaults; the command lines are known best here.
    let mut processes: Table = table.remove("processes").and_then(|p| p.try_into().ok()).unwrap_or_default();
    if plan.is_coupled() || scene.has("processes") {
        processes.extend(Table::try_from(&plan.processes).map_err(fault)?);
    }
    for member in plan.members.iter().filter(|member| member.foreign) {
        let words =
            std::iter::once(member.program.display().to_string()).chain(member.arguments.iter().cloned());
        processes.insert(member.part.name().into(), shell::join(words).into());
    }
    if !processes.is_empty() {
        table.insert("processes".into(), processes.into());
    }
    with_absolute_files(&mut table, scene)?;
    Ok(table)
}

/// Write the resolved scene to `file`; `run` is the run that it is of.
pub fn write_scene(file: &Path, scene: &Scene, table: &Table, run: Option<&RunId>) -> io::Result<()> {
    let name: String =
        scene.path().display().to_string().chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    let run = run.map_or(String::new(), |run| format!(" for run {run}"));
    let version = env!("CARGO_PKG_VERSION");
    let head =
        format!("# {name} with every default filled in, by rockfall {version}{run}. Runs as it is.\n\n");
    let body = toml::to_string(table).map_err(io::Error::other)?;
    files::write(file, (head + &body).as_bytes())
}

/// Write the spheres that the check has made for `rock` beside the resolved scene, where the run looks for them.
pub fn write_cluster(out: &Path, rock: &str, text: &str) -> io::Result<()> {
    let dir = out.join(run_dir::CLUSTERS);
    Dir::create(&dir)?;
    files::write(&dir.join(format!("{rock}.xyzr")), text.as_bytes())
}

/// Write `run.json` to `out`: version, build, code path, date, run id, command lines, hashes of the programs and of the input files.
pub fn write_run(
    out: &Path,
    scene: &Scene,
    table: &Table,
    run: &RunId,
    commands: &[(&str, Vec<OsString>)],
) -> io::Result<()> {
    let hashes = hashes(scene, table)?;
    let shown = |word: &OsString| word.to_string_lossy().into_owned();
    let each = |of: &dyn Fn(&[OsString]) -> Value| -> Map<String, Value> {
        commands.iter().map(|(name, words)| ((*name).to_owned(), of(words))).collect()
    };
    let processes = each(&|words| words.iter().map(shown).collect());
    // What a scene names need not be readable to be started.
    let hash = |program: &OsString| provenance::program(Path::new(program)).ok();
    let programs = each(&|words| json!({ "path": shown(&words[0]), "hash": hash(&words[0]) }));
    let record = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "build": build_id(),
        "simd": simd::path().name(),
        "date": provenance::now(),
        "scene": scene.path().display().to_string(),
        "command_line": std::env::args_os().map(|word| shown(&word)).collect::<Vec<_>>(),
        "run": run.to_string(),
        "processes": processes,
        "programs": programs,
        "inputs": hashes,
    });
    files::write_json(&out.join(run_dir::RECORD), &record)
}

/// Hashes of the scene's file, as it was read, and of every file that it names, by path.
pub fn hashes(scene: &Scene, table: &Table) -> io::Result<Map<String, Value>> {
    let mut inputs = named_files(table);
    // A directory stands for the file in it that is read.
    if let Some(origin) = Origin::of(scene).map_err(io::Error::other)? {
        let state = std::path::absolute(origin.run.join(run_dir::STRUCTURE_STATE))?;
        inputs.extend(state.is_file().then_some(state));
    }
    let mut hashes = Map::new();
    let mut note = |path: &Path, bytes: &[u8]| {
        hashes.insert(path.display().to_string(), input_file::hash(bytes).into());
    };
    // As it was read: the resolved scene may have taken its place by now.
    note(scene.path(), scene.text().as_bytes());
    if let Some((kit, text)) = scene.kit() {
        note(&std::path::absolute(kit)?, text.as_bytes());
    }
    for path in inputs {
        note(&path, &files::read_input(&path, files::STATE)?);
    }
    Ok(hashes)
}

/// What `--resume` comes to.
#[derive(Debug)]
pub enum Resume {
    /// The run has come to its end before.
    Over(Box<Summary>),
    /// It goes on at this time [s], which it had reached.
    From(f64),
    /// There is nothing to go on from.
    Anew,
}

/// How long the processes of a run whose `rockfall` was killed may take to notice it and to end.
const LAST_WINDOW: Duration = Duration::from_secs(3);

/// Where a run was killed a moment ago, its processes may be at their last window: wait for them, unless `interrupted`.
pub fn await_end(out: &Path, mut interrupted: impl FnMut() -> bool) {
    let until = Instant::now() + LAST_WINDOW;
    while holder(out).is_some() && Instant::now() < until && !interrupted() {
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Look into `out`. Refused is a run of another scene, of other input files, or of another build of the program that `leads` it.
pub fn decide(
    out: &Path,
    scene: &Scene,
    resolved: &Table,
    ground: &Ground,
    leads: &Member,
) -> Result<Resume, Stop> {
    if holder(out).is_some() {
        // Who owns it is named where it is claimed.
        return Ok(Resume::Anew);
    }
    if !out.join(SCENE).exists() {
        let unknown = || refuse(out, format!("it holds rows of a run, and no {SCENE} that says of which"));
        return if out.join(HISTORY).exists() { Err(unknown()) } else { Ok(Resume::Anew) };
    }
    // Before the scene: another build may have other defaults.
    let newest = Found::of(out).usable(out)?;
    if let Some(newest) = newest.as_ref().filter(|_| !leads.foreign) {
        let now = provenance::program(&leads.program)
            .map_err(|e| Stop::input(code::FILE, format!("{}: {e}", leads.program.display())))?;
        newest.refuse_other_build(out, &now)?;
    }
    same_scene(out, resolved, ground)?;
    same_inputs(out, scene, resolved)?;
    if let Ok(summary) = Summary::read(out)
        && matches!(summary.status, RunStatus::Done | RunStatus::Unreliable)
    {
        return Ok(Resume::Over(Box::new(summary)));
    }
    Ok(newest.map_or(Resume::Anew, |newest| Resume::From(newest.time)))
}

fn refuse(out: &Path, what: String) -> Stop {
    Diagnostic::in_file(out.display(), what)
        .coded(code::RESULT_DIRECTORY)
        .try_instead("begin it anew with --force, or choose another directory with --out")
        .into()
}

/// The scene of the run, every default filled in, must be the one at hand.
fn same_scene(out: &Path, resolved: &Table, ground: &Ground) -> Result<(), Stop> {
    let path = out.join(SCENE);
    let read = files::read_text(&path).map_err(|e| refuse(out, format!("{SCENE} cannot be read: {e}")))?;
    let before: Table = read.parse().map_err(|e| refuse(out, format!("{SCENE} is none of a run: {e}")))?;
    let [mut before, mut now] = [before, resolved.clone()].map(without_waiting);
    // Made from the rest of the scene, and lies in this directory.
    [&mut before, &mut now].into_iter().for_each(|table| ground.forget(table));
    let keys = before.keys().chain(now.keys().filter(|key| !before.contains_key(*key)));
    // As it is written: a number that was given as a whole one is read as such.
    let text = |table: &Table, key: &String| table.get(key).map(toml::Value::to_string);
    let differs = |key: &&String| text(&before, key) != text(&now, key);
    let differing: Vec<String> = keys.filter(differs).map(|key| format!("`{key}`")).collect();
    if differing.is_empty() {
        return Ok(());
    }
    Err(refuse(out, format!("it holds a run of another scene, which differs in {}", differing.join(", "))))
}

/// The files that the scene names must be those that the run has read.
fn same_inputs(out: &Path, scene: &Scene, resolved: &Table) -> Result<(), Stop> {
    let run: Value = files::read_json(&out.join(RECORD)).unwrap_or_default();
    let now = hashes(scene, resolved).map_err(|e| Stop::input(code::FILE, e.to_string()))?;
    let own = scene.path().display().to_string();
    for (path, hash) in now.iter().filter(|(path, _)| **path != own) {
        let before = &run["inputs"][path];
        if before.is_string() && before != hash {
            return Err(refuse(out, format!("{path} is not what it was when the run began")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene_in(dir: &Path, text: &str) -> Scene {
        let path = dir.join("s.toml");
        std::fs::write(&path, text).expect("written");
        Scene::load(&path, &["title=changed".into()]).expect("valid")
    }

    #[test]
    fn the_resolved_scene_runs_again_as_it_is_from_elsewhere() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path().to_owned();
        std::fs::write(dir.join("net.msh"), "x").expect("written");
        std::fs::write(dir.join("steel"), "x").expect("written");
        let text = "end_time = 2\n[custom]\nfile = \"net.msh\"\nname = \"net\"\n[processes]\nfem = \"sh -c 'a b'\"\ntimeout = 5.0\n\
                    [structure]\nmesh = \"net.msh\"\n";
        let scene = scene_in(&dir, text);
        let plan = Plan::of(&scene).expect("a plan");
        let structure =
            "[structure]\nmesh = \"net.msh\"\nmaterial = \"steel\"\nsteps = 3\n".parse().expect("TOML");
        let report = CheckReport { resolved: structure, ..CheckReport::default() };
        let table = resolved(&scene, &plan, &[(Part::Fem, report)]).expect("resolved");
        let run = RunId::new();
        write_scene(&dir.join("scene.toml"), &scene, &table, Some(&run)).expect("written");
        write_run(&dir, &scene, &table, &run, &[("fem", vec!["/bin/sh".into()])]).expect("written");
        let again = Scene::load(&dir.join("scene.toml"), &[]).expect("valid");
        let read = again.document().expect("a table");
        assert_eq!(read["title"].as_str(), Some("changed"));
        assert_eq!(read["structure"]["steps"].as_integer(), Some(3));
        assert_eq!(read["structure"]["mesh"].as_str(), dir.join("net.msh").to_str());
        assert_eq!(read["structure"]["material"].as_str(), Some("steel"));
        // Whoever reads it finds the file beside the scene of the user, and not beside this one.
        assert_eq!(read["custom"]["file"].as_str(), dir.join("net.msh").to_str());
        assert_eq!(read["custom"]["name"].as_str(), Some("net"));
        assert!(again.text().lines().next().expect("a line").contains(&run.to_string()), "{}", again.text());
        assert_eq!(read["output"]["interval"].as_float(), Some(0.01));
        let plan_again = Plan::of(&again).expect("a plan");
        assert_eq!(plan_again.members[0].program, plan.members[0].program);
        assert_eq!(plan_again.members[0].arguments, ["-c", "a b"]);
        let record = std::fs::read_to_string(dir.join("run.json")).expect("written");
        assert!(record.contains(&run.to_string()), "{record}");
        let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
        assert_eq!(record["build"]["program"], build_id().program.as_str());
        assert_eq!(
            record["programs"]["fem"]["hash"],
            provenance::program(Path::new("/bin/sh")).expect("there")
        );
        // FNV-1a of one byte: (0xcbf29ce484222325 ^ 0x78) * 0x100000001b3, modulo 2^64.
        let net = &record["inputs"][dir.join("net.msh").display().to_string()];
        assert_eq!(net, "fnv1a64:af63f54c86021707");
    }
}
