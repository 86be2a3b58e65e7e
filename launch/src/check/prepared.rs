//! A scene before its start: that it is one, who takes part, what each program says of it, and what was chosen where it leaves something open.

use crate::check::choice::{self, Chosen};
use crate::check::ground::Ground;
use crate::check::numbers::Numbers;
use crate::check::plan::{Member, Part, Plan};
use crate::front::stop::Stop;
use crate::run::children::{self, EARLY_REPORT, Events, Job, Rules};
use crate::run::record;
use interface_defs::InterfaceMesh;
use interface_defs::diagnostic::{Diagnostic, Severity, code};
use std::path::{Path, PathBuf};
use std::process::Command;
use toml::Table;
use toolkit::arguments::Input;
use toolkit::check::CheckReport;
use toolkit::exit::Exit;
use toolkit::files;
use toolkit::limits::Limits;
use toolkit::once::each_once;
use toolkit::output::Output;
use toolkit::scene::Scene;

/// A scene that could be started.
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// Who takes part.
    pub plan: Plan,
    /// Heights that were made for it; they last as long as this.
    pub ground: Ground,
    /// What the programs say, with what was chosen.
    pub reports: Vec<(Part, CheckReport)>,
    /// What was chosen.
    pub chosen: Vec<Chosen>,
    /// The programs' numbers.
    pub numbers: Numbers,
}

impl Prepared {
    /// The scene of `input`; `home` is the directory of its results, if it is to have one. Nothing is started where it is refused.
    pub fn of(
        input: &Input,
        home: impl FnOnce(&Scene) -> Option<PathBuf>,
        events: &Events,
    ) -> Result<Self, Stop> {
        Self::tried(input, home, events, None)
    }

    /// The same; where that tells its cost, the run is tried for so long [s].
    pub fn tried(
        input: &Input,
        home: impl FnOnce(&Scene) -> Option<PathBuf>,
        events: &Events,
        trial: Option<f64>,
    ) -> Result<Self, Stop> {
        let (scene, plan) = load(input)?;
        let ground = Ground::of(&scene, &plan, input, home(&scene).as_deref(), events)?;
        let mut reports = validate(&plan, ground.input(), events, trial)?;
        let chosen = choice::complete(&scene, &plan, &mut reports)?;
        let numbers = Numbers::of(&reports, scene.end_time()?);
        Ok(Self { scene, plan, ground, reports, chosen, numbers })
    }

    /// The scene with every default and every choice filled in.
    pub fn resolved(&self) -> Result<Table, Diagnostic> {
        record::resolved(&self.scene, &self.plan, &self.reports)
    }

    /// What was chosen that a scene could name.
    pub fn choices(&self) -> impl Iterator<Item = &Chosen> {
        self.chosen.iter().filter(|choice| choice.is_of_scene())
    }

    /// What a program says.
    pub fn report(&self, part: Part) -> Option<&CheckReport> {
        self.reports.iter().find(|(of, _)| *of == part).map(|(_, report)| report)
    }

    /// What the user should know before the start, each once, with its place in the scene where it is about a key.
    ///
    /// An error: the run would take for ever.
    pub fn warnings(&self) -> Result<Vec<Diagnostic>, Diagnostic> {
        Ok(self.doubts()?.into_iter().map(|warning| self.scene.placed(warning)).collect())
    }

    /// The same without places.
    pub fn doubts(&self) -> Result<Vec<Diagnostic>, Diagnostic> {
        let of_cost = self.numbers.of_cost();
        if let Some(refused) = of_cost.clone().filter(|found| found.severity == Severity::Error) {
            return Err(self.scene.placed(refused));
        }
        let of_programs = self.reports.iter().flat_map(|(_, report)| report.warnings.iter().cloned());
        let of_tables = Output::warnings(&self.scene)?.into_iter().chain(Limits::of(&self.scene)?.warnings());
        let twice = self.scene.set_twice();
        let of_numbers = self.numbers.of_window().into_iter().chain(of_cost);
        Ok(each_once(of_programs.chain(of_numbers).chain(of_tables).chain(twice)))
    }
}

/// What a study has, and no scene.
const OF_STUDY: [&str; 2] = ["scene", "release"];
/// Tables that no scene has.
const ONLY_OF_STUDY: [&str; 4] = ["release", "vary", "maps", "line"];
/// What a structure that waits for rocks has, and none alone.
const OF_BARRIER: [&str; 3] = ["contact", "dem", "coupling"];

/// A scene, and not another file that belongs to this program, with who takes part in it.
pub fn load(input: &Input) -> Result<(Scene, Plan), Stop> {
    let scene = input.load().map_err(|e| study(&input.scene).unwrap_or_else(|| e.into()))?;
    let plan = Plan::of(&scene).map_err(|e| for_study(&scene, e.into()))?;
    Ok((scene, plan))
}

/// The tables of a file that has any.
fn tables(path: &Path) -> Option<toml::Table> {
    String::from_utf8(files::read_input(path, files::TEXT).ok()?).ok()?.parse().ok()
}

/// Whether it is a study, not a scene.
pub fn is_study(path: &Path) -> bool {
    tables(path).is_some_and(|table| OF_STUDY.iter().all(|key| table.contains_key(*key)))
}

/// Whether it is a calibration.
fn is_calibration(table: &toml::Table) -> bool {
    table.contains_key("study") && (table.contains_key("observed") || table.contains_key("parameter"))
}

/// What is said of a study or a kit where a scene is asked for; `None`: it is neither.
pub fn study(path: &Path) -> Option<Stop> {
    let table = tables(path)?;
    let name = path.display();
    let says = match () {
        () if is_study(path) => {
            format!("{name}: this is a study, not a scene; write rockfall ensemble {name}")
        }
        () if is_calibration(&table) => {
            format!("{name}: this is a calibration, not a scene; write rockfall calibrate {name}")
        }
        () if !table.contains_key("rock") && ONLY_OF_STUDY.iter().any(|key| table.contains_key(*key)) => {
            let missing = OF_STUDY.iter().filter(|key| !table.contains_key(**key));
            let missing = missing.map(|key| format!("`{key}`")).collect::<Vec<_>>().join(" and ");
            format!(
                "{name}: this looks like a study without {missing}; a study names a scene, scene = \"FILE\", and says in [[release]] where \
                 rocks start"
            )
        }
        () if table.contains_key("kit") => format!(
            "{name}: this is a kit, not a scene; rockfall approve {name} --dry-run checks it, and a scene takes it with kit = \"...\" in \
             [structure]"
        ),
        () => return None,
    };
    Some(Stop::input(code::ARGUMENT, says))
}

/// What is said of a study or a scene where a kit is asked for; `None`: it is neither.
pub fn no_kit(path: &Path) -> Option<Stop> {
    let table = tables(path)?;
    let name = path.display();
    let (kind, command) = match () {
        () if table.contains_key("kit") => return None,
        () if is_study(path) => ("study", "ensemble"),
        () if is_calibration(&table) => ("calibration", "calibrate"),
        () if table.contains_key("rock") || table.contains_key("end_time") => ("scene", "run"),
        () => return None,
    };
    let says = format!(
        "{name}: this is a {kind}, not a kit; rockfall {command} {name} computes it; a kit has [structure], [[gauge]] and [kit] alone"
    );
    Some(Stop::input(code::ARGUMENT, says))
}

/// A barrier that is run with the members of a study has no rock of its own.
fn for_study(scene: &Scene, stop: Stop) -> Stop {
    let alone = scene.has("structure") && !scene.has("rock") && !scene.has("spheres");
    if !alone || !OF_BARRIER.iter().any(|key| scene.has(key)) {
        return stop;
    }
    let name = scene.path().display();
    let cure = format!(
        "if it is a barrier for a study: rockfall ensemble STUDY --barrier {name}, which checks it with a rock of the study"
    );
    stop.hinted(&cure)
}

/// Ask every own program of `plan` what it makes of the scene, all at once; but the rocks' after the structure's, which
/// says where the net is. The programs that the scene names are not asked. What is wrong is reported once, however many
/// programs find it. A signal ends them all.
fn validate(
    plan: &Plan,
    input: &Input,
    events: &Events,
    trial: Option<f64>,
) -> Result<Vec<(Part, CheckReport)>, Stop> {
    let own = || plan.members.iter().filter(|member| !member.foreign);
    let has_net = own().any(|member| member.part == Part::Fem);
    let (later, now): (Vec<_>, Vec<_>) = own().partition(|member| has_net && member.part == Part::Dem);
    let mut reports = Vec::new();
    let mut faults: Vec<Stop> = Vec::new();
    for members in [now, later] {
        let net = reports.iter().find_map(|(_, report): &(Part, CheckReport)| report.interface.as_ref());
        let trial = (trial, !plan.is_coupled());
        let jobs =
            members.iter().map(|member| question(member, input, net, trial)).collect::<Result<_, _>>()?;
        // They have nothing to lose.
        let doing = if members.iter().any(|member| member.part == Part::Dem) {
            "reading the terrain, making spheres of the rocks, trying the fall"
        } else {
            "finding the form of the structure"
        };
        let mut say = |seconds: u64| eprintln!("{doing}: {seconds} s so far");
        // What is asked for a run is said by the run.
        let seconds: Option<&mut dyn FnMut(u64)> = if trial.0.is_some() { Some(&mut say) } else { None };
        let mut outcome =
            children::watch(jobs, Rules { seconds, first: Some(EARLY_REPORT), ..Rules::default() }, events)?;
        if outcome.interrupted {
            return Err(Stop::interrupted());
        }
        outcome.ends.sort_by_key(|end| end.index);
        for (member, end) in members.into_iter().zip(outcome.ends) {
            match end.text().and_then(|text| read(member, &text)) {
                Ok(report) => reports.push((member.part, report)),
                Err(fault) => faults.push(fault),
            }
        }
    }
    if faults.is_empty() {
        return Ok(reports);
    }
    let exit = if faults.iter().any(|f| f.exit == Exit::BadInput) { Exit::BadInput } else { Exit::Failed };
    let faults = faults.into_iter().filter(|fault| fault.exit == exit);
    Err(Stop { exit, errors: each_once(faults.flat_map(|fault| fault.errors)) })
}

/// The check of one program; the `net` goes to it over its stdin.
fn question(
    member: &Member,
    input: &Input,
    net: Option<&InterfaceMesh>,
    (trial, alone): (Option<f64>, bool),
) -> Result<Job, Stop> {
    let mut command = Command::new(&member.program);
    command.args(&member.arguments).arg("check").args(children::scene(input)).arg("--format=json");
    let trial = trial.filter(|_| member.part == Part::Dem || alone);
    command.args(trial.map(|seconds| format!("--try={seconds}")));
    let Some(net) = net.filter(|_| member.part == Part::Dem) else { return Ok(Job::of(command)) };
    command.arg("--interface=-");
    let input = serde_json::to_vec(net).map_err(|e| Stop::failed(code::CONTRACT, e.to_string()))?;
    Ok(Job { input: Some(input), ..Job::of(command) })
}

fn read(member: &Member, text: &str) -> Result<CheckReport, Stop> {
    CheckReport::from_json(text).map_err(|e| {
        let program = member.program.display();
        Stop::failed(code::CONTRACT, format!("{program} check: {e}; are all programs of one version?"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_and_a_barrier_for_one_are_named_as_what_they_are() {
        let temp = tempfile::tempdir().expect("a directory");
        let said = |name: &str, text: &str| {
            let scene = temp.path().join(name);
            std::fs::write(&scene, text).expect("written");
            let Err(stop) = load(&Input { scene, sets: Vec::new() }) else { panic!("{name} is a scene") };
            assert_eq!(stop.exit, toolkit::exit::Exit::BadInput);
            stop.errors[0].to_string()
        };
        let study = said("study.toml", "scene = \"fall.toml\"\n[[release]]\ncount = 2\n");
        assert!(study.contains("this is a study") && study.contains("rockfall ensemble "), "{study}");
        let barrier =
            said("barrier.toml", "end_time = 1.0\n[structure]\nfile = \"a\"\n[dem]\ntime_step = 1e-5\n");
        assert!(barrier.contains("nothing will use [dem]"), "{barrier}");
        assert!(barrier.contains("rockfall ensemble STUDY --barrier "), "{barrier}");
        let kit = said("kit.toml", "[kit]\nenergy = 1e5\n[structure]\ngenerator.type = \"barrier\"\n");
        assert!(kit.contains("this is a kit") && kit.contains("--dry-run checks it"), "{kit}");
        let typo = said("scene.toml", "end_tim = 1.0\n");
        assert!(typo.contains("unknown key") && !typo.contains("ensemble"), "{typo}");
    }
}
