//! `rockfall replay`: one solver is asked again what a recording says that it was asked; without a command, what crossed as a table.

use crate::children::{self, Events, Goes, Job, Rules};
use crate::plan::own_program;
use crate::stop::Stop;
use clap::Args;
use interface_defs::RunId;
use interface_defs::diagnostic::code;
use interface_defs::{Layout, Plan, Ready, Sampling, Status, name};
use std::ffi::OsString;
use std::fmt::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use toolkit::arguments::AnswerForm;
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::files::{self, Scratch};
use toolkit::recording::{Entry, Exchange, Reader};
use toolkit::screen::show;

/// What the command line asks for.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Recording that `rockfall run --record FILE` wrote
    file: PathBuf,
    /// Which solver is asked: dem (contact) or fem (structure)
    #[arg(long, value_name = "ROLE", value_parser = ["dem", "fem"], required_unless_present = "table")]
    role: Option<String>,
    /// Largest difference of an answer, as a share of the largest number of its field so far; 0: equal to the byte
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    tolerance: f64,
    /// Seconds that an answer may take
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    timeout: f64,
    /// Write what crossed to this file as CSV, a row for each exchange, and ask no solver
    #[arg(long, value_name = "FILE", conflicts_with_all = ["role", "command"])]
    table: Option<PathBuf>,
    #[command(flatten)]
    answer: AnswerForm,
    /// The solver and its arguments, behind `--`; without it, that of this project
    #[arg(last = true, value_name = "COMMAND")]
    command: Vec<OsString>,
}

/// Ask the solver, or write the table.
pub fn replay(request: &Arguments) -> Result<Exit, Stop> {
    let recording = Reader::open(&request.file)?;
    match (&request.table, &request.role) {
        (Some(table), _) => {
            let (text, exchanges) = self::table(recording)?;
            files::write(table, text.as_bytes()).map_err(|e| {
                Stop::input(code::FILE, format!("{}: it cannot be written: {e}", table.display()))
            })?;
            show(&format!("{exchanges} exchanges: {}\n", table.display()));
            Ok(Exit::Done)
        }
        (None, role) => ask(request, role.as_deref().unwrap_or_default(), &recording.scene),
    }
}

/// Start the solver and whoever asks it.
fn ask(request: &Arguments, role: &str, scene: &str) -> Result<Exit, Stop> {
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
        words.push(own(if role == "dem" { "dem-solver" } else { "fem-solver" })?);
    }
    let mut solver = Command::new(&words[0]);
    solver.args(&words[1..]).arg("serve").arg(scene.path()).args(["--run", &run, "--as", role]);
    solver.arg("--out").arg(dir.path()).args(["--timeout", &timeout, "--supervisor", &supervisor]);
    let jobs = vec![
        Job { name: "coupler".into(), command: leader, input: None, output: Goes::Shown },
        Job { name: role.into(), output: Goes::Kept, ..Job::of(solver) },
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

/// A row for each exchange, and how many they are.
fn table(mut recording: Reader) -> Result<(String, usize), Stop> {
    let mut text =
        "exchange,solver,window,iteration,start_s,length_s,command,status,sent_numbers,answer_numbers,\
                    max_displacement_m,max_velocity_m_per_s,force_x_N,force_y_N,force_z_N\n"
            .to_string();
    let (mut layouts, mut exchanges) = (Vec::new(), 0);
    while let Some(entry) = recording.next_entry()? {
        match entry {
            Entry::Prepare(solver, both) => {
                let (Plan { takes, gives, .. }, Ready { mesh, gauges, .. }) = &*both;
                layouts.push((solver, [Layout::new(takes, mesh, 0), Layout::new(gives, mesh, gauges.len())]));
            }
            Entry::Exchange(exchange) => {
                exchanges += 1;
                let layout = layouts.iter().find(|(of, _)| *of == exchange.solver).map(|(_, both)| both);
                row(&mut text, exchanges, &exchange, layout);
            }
            _ => {}
        }
    }
    if recording.cut {
        tracing::warn!("the recording ends within an entry: its run was killed");
    }
    Ok((text, exchanges))
}

fn row(text: &mut String, number: usize, exchange: &Exchange, layouts: Option<&[Layout; 2]>) {
    let Exchange { solver, window, command, span, status, sent, answer, .. } = exchange;
    let word = match Status::from_number(*status) {
        Some(Status::Done) => "done",
        Some(Status::Failed) => "failed",
        Some(Status::Beyond) => "beyond",
        Some(Status::Rest) => "rest",
        None => "none",
    };
    let _ = write!(
        text,
        "{number},{solver},{},{},{},{},{command},{word},{},{}",
        window.0,
        window.1,
        span.0,
        span.1,
        sent.len(),
        answer.len()
    );
    // Of selected nodes the fields lie elsewhere.
    let known = layouts.filter(|_| exchange.selection.0 == 0);
    let of = |what: &str, sampling: Sampling| {
        let sides = known.into_iter().flatten().zip([sent, answer]);
        sides.filter_map(move |(layout, payload)| payload.get(layout.last(what, sampling)?)).next()
    };
    for what in [name::DISPLACEMENT, name::VELOCITY] {
        let field = of(what, Sampling::FromStart).or_else(|| of(what, Sampling::AtEnds));
        let size = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        let largest = field.map(|f| f.chunks_exact(3).map(size).fold(0.0, f64::max));
        let _ = write!(text, ",{}", largest.map_or(String::new(), |v| v.to_string()));
    }
    let force = of(name::FORCE, Sampling::Means).or_else(|| of(name::FORCE, Sampling::AtEnds));
    for axis in 0..3 {
        let sum = force.map(|f| f.iter().skip(axis).step_by(3).sum::<f64>());
        let _ = write!(text, ",{}", sum.map_or(String::new(), |v| v.to_string()));
    }
    text.push('\n');
}
