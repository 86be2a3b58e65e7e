//! A solver of rockfall's contract as a participant of a preCICE run.

use crate::hosted::{self, Hosted, field};
use crate::names::Names;
use crate::{input, said};
use interface_defs::{
    Command, Failure, Gauge, Hello, InterfaceMesh, Layout, Participant as _, Plan, RequestHeader, Sampling,
    Statistics, name,
};
use precice::Participant;
use serde_json::json;
use std::ffi::{OsStr, OsString};
use std::fmt::Write;
use std::ops::Range;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What the command line asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Part of the solver: dem (contact) or fem (structure)
    #[arg(value_parser = ["dem", "fem"])]
    role: String,
    /// The scene
    scene: PathBuf,
    /// Directory for results
    #[arg(long, default_value = "out", value_name = "DIR")]
    out: PathBuf,
    /// Seconds that an answer may take, of the solver or of the other participant
    #[arg(long, default_value_t = 600, value_name = "S")]
    timeout: u64,
    /// The solver and its arguments, behind `--`
    #[arg(last = true, value_name = "COMMAND", required = true)]
    command: Vec<OsString>,
}

/// Numbers of a payload that are read from data of preCICE.
struct Read {
    data: String,
    /// Whether at the window's end, or at its start.
    at_end: bool,
    to: Range<usize>,
}

/// Let the solver take part until the coupling is over.
pub fn join(names: &Names, structure: &OsStr, arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { role, scene, out, timeout, command } = arguments;
    let timeout = Duration::from_secs(*timeout);
    let unwritable = |e| input(format!("--out {}: {e}", out.display()));
    std::fs::create_dir_all(out).map_err(unwritable)?;
    let is_contact = role == "dem";
    let partner_mesh = is_contact.then(|| hosted::mesh_of(structure, scene, timeout)).transpose()?;
    let mut solver = Hosted::start(command, (role, scene, out), timeout)?;
    let hello = solver.remote().hello()?;
    if names.is_implicit() && hello.repeats.is_none() {
        let what = format!("{} cannot repeat a window: {} is not for it", hello.program, names.scheme.kind);
        return Err(input(what));
    }
    let plan = plan(names, &hello, partner_mesh)?;
    let ready = solver.remote().prepare(&plan, &mut |_| Ok(()))?;
    let (takes, gives) =
        (Layout::new(&plan.takes, &ready.mesh, 0), Layout::new(&plan.gives, &ready.mesh, ready.gauges.len()));
    let (reads, writes) = (reads(names, &takes, is_contact), writes(names, &gives));
    if reads.is_empty() || writes.is_empty() {
        let what = format!(
            "{} reads {:?} and writes {:?}: a contact solver reads Displacement [and Velocity] and writes Force, a structure the reverse",
            names.participant, names.reads, names.writes
        );
        return Err(input(what));
    }

    let (mut it, ids) = enter(names, &ready.mesh)?;
    if it.requires_initial_data().map_err(said)? {
        write_all(&mut it, names, &ids, &writes, &ready.initial)?;
    }
    it.initialize().map_err(said)?;

    let mut record = Record::new(&ready.gauges);
    let mut request = vec![0.0; takes.len()];
    let (mut number, mut iteration, mut commit_due, started) = (1, 1, false, Instant::now());
    // Times are products of whole numbers with a length, from where that length was another one.
    let (mut since, mut count, mut usual) = (0.0, 0u32, 0.0);
    while it.is_coupling_ongoing().map_err(said)? {
        // The committed state of the solver is the checkpoint; it is written with the first request of a window.
        it.requires_writing_checkpoint().map_err(said)?;
        let length = it.get_max_time_step_size().map_err(said)?;
        for Read { data, at_end, to } in &reads {
            let at = if *at_end { length } else { 0.0 };
            it.read_data(&names.mesh, data, &ids, at, &mut request[to.clone()]).map_err(said)?;
        }
        if is_contact && names.goes_ahead() {
            extrapolate(&takes, &mut request, length);
        }
        if (length - usual).abs() > 1e-9 * length {
            (since, count, usual) = (since + f64::from(count) * usual, 0, length);
        }
        let start = since + f64::from(count) * usual;
        let command = if std::mem::take(&mut commit_due) { Command::CommitAndSolve } else { Command::Solve };
        let command = command as u32;
        let header =
            RequestHeader { window: number, iteration, command, start, length, ..Default::default() };
        let answer = solver.solve(header, &request, gives.len())?;
        write_all(&mut it, names, &ids, &writes, answer)?;
        it.advance(length).map_err(said)?;
        if it.requires_reading_checkpoint().map_err(said)? {
            iteration += 1;
        } else {
            record.accept(start + length, iteration, &solver.remote().answer()[gives.gauges()]);
            (number, iteration, commit_due, count) = (number + 1, 1, true, count + 1);
        }
    }
    record.seconds = started.elapsed().as_secs_f64();
    it.finalize().map_err(said)?;
    let statistics = solver.finish(commit_due)?;
    std::fs::write(out.join("history.csv"), &record.rows).map_err(unwritable)?;
    let report = record.report(names, &hello.program, &statistics);
    std::fs::write(out.join("summary.json"), format!("{report:#}\n")).map_err(unwritable)?;
    println!("{report:#}");
    Ok(())
}

/// Connect as a participant, with the nodes of `mesh`.
pub fn enter(names: &Names, mesh: &InterfaceMesh) -> Result<(Participant, Vec<i32>), Failure> {
    let mut it = Participant::new(&names.participant, &names.config.to_string_lossy(), 0, 1).map_err(said)?;
    let mut ids = vec![0; mesh.node_count()];
    it.set_mesh_vertices(&names.mesh, &mesh.coordinates, &mut ids).map_err(said)?;
    if it.requires_mesh_connectivity_for(&names.mesh).map_err(said)? {
        let of = |nodes: &[u32]| nodes.iter().map(|node| ids[*node as usize]).collect::<Vec<_>>();
        it.set_mesh_edges(&names.mesh, &of(mesh.lines.as_flattened())).map_err(said)?;
        it.set_mesh_triangles(&names.mesh, &of(mesh.faces.as_flattened())).map_err(said)?;
    }
    Ok((it, ids))
}

/// What crosses: of what the solver can, what the configuration names.
fn plan(names: &Names, hello: &Hello, partner_mesh: Option<InterfaceMesh>) -> Result<Plan, Failure> {
    use Sampling::{AtEnds, FromStart, Means};
    let (mut takes, mut gives) = (Vec::new(), Vec::new());
    match partner_mesh {
        Some(_) => {
            takes.extend(field(&hello.takes, name::DISPLACEMENT, FromStart));
            let is_read = Names::of(&names.reads, "Velocity").next().is_some();
            takes.extend(field(&hello.takes, name::VELOCITY, FromStart).filter(|_| is_read));
            gives.extend(
                [Means, AtEnds].into_iter().filter_map(|sampling| field(&hello.gives, name::FORCE, sampling)),
            );
        }
        None => {
            takes.extend(
                [Means, AtEnds].into_iter().filter_map(|sampling| field(&hello.takes, name::FORCE, sampling)),
            );
            gives = hosted::motion(hello)?;
        }
    }
    let (end_time, window) = (names.scheme.end_time, names.scheme.window);
    let window = if window > 0.0 { window } else { end_time };
    Ok(Plan { end_time, window, takes, gives, partner_mesh, ..Plan::default() })
}

/// Where what is read goes. A structure that takes force at the window's end gets the data whose name says that, or else what there is.
fn reads(names: &Names, takes: &Layout, is_contact: bool) -> Vec<Read> {
    let mut reads = Vec::new();
    if is_contact {
        for (word, what) in [("Displacement", name::DISPLACEMENT), ("Velocity", name::VELOCITY)] {
            let Some((data, _)) = Names::of(&names.reads, word).next() else { continue };
            let places = [0, 1].map(|sample| takes.sample(what, Sampling::FromStart, sample));
            let both = places.into_iter().flatten().zip([false, true]);
            reads.extend(both.map(|(to, at_end)| Read { data: data.into(), at_end, to }));
        }
        return reads;
    }
    for sampling in [Sampling::Means, Sampling::AtEnds] {
        let Some(to) = takes.last(name::FORCE, sampling) else { continue };
        let of_end = sampling == Sampling::AtEnds;
        let all = || Names::of(&names.reads, "Force");
        let data = all().find(|(_, is)| *is == of_end).or_else(|| all().next());
        reads.extend(data.map(|(data, _)| Read { data: data.into(), at_end: true, to }));
    }
    reads
}

/// Which numbers of an answer are written to which data.
fn writes(names: &Names, gives: &Layout) -> Vec<(String, Range<usize>)> {
    let mut writes = Vec::new();
    for (word, what) in
        [("Force", name::FORCE), ("Displacement", name::DISPLACEMENT), ("Velocity", name::VELOCITY)]
    {
        for (data, of_end) in Names::of(&names.writes, word) {
            let is_mean = what == name::FORCE && !of_end;
            let sampling = if is_mean { Sampling::Means } else { Sampling::AtEnds };
            writes.extend(gives.last(what, sampling).map(|from| (data.to_owned(), from)));
        }
    }
    writes
}

fn write_all(
    it: &mut Participant,
    names: &Names,
    ids: &[i32],
    writes: &[(String, Range<usize>)],
    answer: &[f64],
) -> Result<(), Failure> {
    writes.iter().try_for_each(|(data, from)| {
        it.write_data(&names.mesh, data, ids, &answer[from.clone()]).map_err(said)
    })
}

/// In an explicit scheme whoever goes ahead does not know how the net moves in the window: it goes on with its velocity, as in the
/// weak scheme of the coupler.
fn extrapolate(takes: &Layout, request: &mut [f64], length: f64) {
    let of = |what, sample| takes.sample(what, Sampling::FromStart, sample);
    if let (Some(u), Some(v)) = (of(name::DISPLACEMENT, 1), of(name::VELOCITY, 0)) {
        (0..u.len()).for_each(|i| request[u.start + i] += length * request[v.start + i]);
    }
}

/// What is kept of a run.
struct Record {
    rows: String,
    windows: u64,
    iterations: u64,
    /// Name and unit of each gauge, and its smallest and largest value.
    gauges: Vec<(String, [f64; 2])>,
    seconds: f64,
}

impl Record {
    fn new(gauges: &[Gauge]) -> Self {
        let gauges =
            gauges.iter().map(|gauge| format!("{}_{}", gauge.name, gauge.unit.replace('/', "_per_")));
        let gauges: Vec<_> = gauges.map(|column| (column, [f64::INFINITY, f64::NEG_INFINITY])).collect();
        let mut rows = "time_s,iterations".to_owned();
        gauges.iter().for_each(|(column, _)| rows += &format!(",{column}"));
        Self { rows: rows + "\n", windows: 0, iterations: 0, gauges, seconds: 0.0 }
    }

    /// A window that ended at `time` [s], with three numbers for each gauge.
    fn accept(&mut self, time: f64, iterations: u32, numbers: &[f64]) {
        self.windows += 1;
        self.iterations += u64::from(iterations);
        let _ = write!(self.rows, "{time},{iterations}");
        for ([value, smallest, largest], (_, range)) in
            numbers.as_chunks::<3>().0.iter().zip(&mut self.gauges)
        {
            let _ = write!(self.rows, ",{value}");
            *range = [range[0].min(*smallest), range[1].max(*largest)];
        }
        self.rows.push('\n');
    }

    fn report(&self, names: &Names, program: &str, statistics: &Statistics) -> serde_json::Value {
        let measures = statistics
            .measures
            .iter()
            .map(|m| (m.name.clone(), json!({ "value": m.value, "unit": m.unit, "time_s": m.time })));
        let measures: serde_json::Map<_, _> = measures.collect();
        let gauges: serde_json::Map<_, _> =
            self.gauges.iter().map(|(name, range)| (name.clone(), json!(range))).collect();
        json!({
            "participant": names.participant, "scheme": names.scheme.kind, "solver": program,
            "windows": self.windows, "iterations": self.iterations, "loop_seconds": self.seconds,
            "solver_cpu_seconds": statistics.cpu_seconds, "measures": measures, "gauges": gauges,
        })
    }
}
