//! `rockfall replay`: one solver is asked again what a recording says that it was asked.

use crate::check::plan::own_program;
use crate::front::stop::Stop;
use crate::run::children::{self, Destination, Events, Job, Rules};
use clap::Args;
use interface_defs::RunId;
use interface_defs::diagnostic::code;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use toolkit::arguments::AnswerForm;
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::files::Scratch;
use toolkit::recording::{Entry, Reader};

/// What the command line asks for.
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// Recording that `rockfall run --record FILE` wrote
    file: PathBuf,
    /// Which solver is asked: dem (contact) or fem (structure)
    #[arg(long, value_name = "ROLE", value_parser = ["dem", "fem"])]
    role: String,
    /// Largest difference of an answer, as a share of the largest number of its field so far; 0: equal to the byte
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    tolerance: f64,
    /// Seconds that an answer may take
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    timeout: f64,
    #[command(flatten)]
    answer: AnswerForm,
    /// The solver and its arguments, behind `--`; without it, that of this project
    #[arg(last = true, value_name = "COMMAND")]
    command: Vec<OsString>,
}

/// Start the solver and whoever asks it.
pub fn replay(request: &ReplayArguments) -> Result<Exit, Stop> {
    let (role, scene) = (request.role.as_str(), Reader::open(&request.file)?.scene);
    let events = Events::watch()?;
    let (run, own) = (RunId::new().to_string(), |name| own_program(name).map(OsString::from));
    let scratch = tempfile::tempdir()
        .and_then(|dir| Scratch::new(dir.path(), "toml", scene.as_bytes()).map(|scene| (dir, scene)));
    let (dir, scene) = scratch.map_err(|e| Stop::failed(code::FILE, format!("a temporary file: {e}")))?;
    let (timeout, supervisor) = (request.timeout.to_string(), std::process::id().to_string());
    let mut leader = Command::new(own("coupler")?);
    leader.arg("replay").arg(children::path(&request.file)).args(["--as", role, "--run", &run]);
    leader.args(["--tolerance", &request.tolerance.to_string(), "--timeout", &timeout]);
    leader.args(["--supervisor", &supervisor]);
    if request.answer.format == Format::Json {
        leader.args(["--format", "json"]);
    }
    leader.stdout(Stdio::inherit()).stderr(Stdio::inherit());
    let mut words = request.command.clone();
    if words.is_empty() {
        let program = if role == "dem" { "dem-solver" } else { "fem-solver" };
        if let Some(other) = recorded_with(request, role)?.filter(|name| !name.starts_with(program)) {
            let what = format!("{role} was {other} in this recording: give its command behind --");
            return Err(Stop::input(code::ARGUMENT, what));
        }
        words.push(own(program)?);
    }
    let mut solver = Command::new(&words[0]);
    solver.args(&words[1..]).arg("serve").arg(scene.path()).args(["--run", &run, "--as", role]);
    solver.arg("--out").arg(dir.path()).args(["--timeout", &timeout, "--supervisor", &supervisor]);
    let jobs = vec![
        Job { name: "coupler".into(), command: leader, input: None, output: Destination::Inherited },
        Job { name: role.into(), output: Destination::Captured, ..Job::of(solver) },
    ];
    let rules = Rules { together: true, grace: Some(children::GRACE_OF_LEADER), ..Rules::default() };
    let outcome = children::watch(jobs, rules, &events)?;
    if outcome.interrupted {
        return Err(Stop::interrupted());
    }
    let of = |index| outcome.ends.iter().find(|end| end.index == index);
    let exit = of(0).map_or(Exit::Failed, children::End::exit);
    match of(1).filter(|end| exit == Exit::Failed && !end.forced && end.exit() != Exit::Done) {
        Some(end) => Err(Stop { exit, errors: end.reasons() }),
        None => Ok(exit),
    }
}

/// Which program a solver was in the recording.
fn recorded_with(request: &ReplayArguments, role: &str) -> Result<Option<String>, Stop> {
    let mut recording = Reader::open(&request.file)?;
    while let Some(entry) = recording.next_entry()? {
        match entry {
            Entry::Hello(of, hello) if of == role => return Ok(Some(hello.program)),
            Entry::Exchange(_) => break,
            _ => {}
        }
    }
    Ok(None)
}
