//! `fem-solver check`: what would be built, the critical step, the cost.

use crate::config::generator::Generator;
use crate::config::{Config, Integrator};
use crate::integrator::critical_step::typical_stiffness;
use crate::integrator::local;
use crate::integrator::start::{LOADED, Start};
use crate::internal_force::assembly::Assembly;
use crate::model::{Model, Part};
use crate::solver::FemSolver;
use crate::state::inherited::Inherited;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::field::FieldSpec;
use interface_defs::mesh::InterfaceMesh;
use interface_defs::message::Plan;
use interface_defs::solver::{Solver, Window};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use toolkit::check::CheckReport;
use toolkit::output::Output;
use toolkit::program::Options;
use toolkit::scene::Scene;
use toolkit::start_from::KEY;
use toolkit::trial::Trial;

/// Windows of one step that are timed, explicit and with equations to solve: half of them take longer than what is said.
const ROUNDS: [usize; 2] = [251, 5];

/// Wall time that a window of a trial takes at most, where steps are shorter [s].
const LOOK: f64 = 0.05;

/// Build the structure of a scene, find its form, and say what came of it. A run of it alone is tried for so long.
pub fn check(scene: &Scene, trial: Option<Duration>) -> Result<CheckReport, Diagnostic> {
    let config = Config::of(scene)?;
    let begun = Instant::now();
    let mut solver = FemSolver::new(scene, &Options::default())?;
    let start = Start::new(scene, &config, solver.model(), solver.inherited.as_ref(), None, &mut |_| Ok(()))
        .map_err(|fault| *fault.diagnostic)?;
    let prepared = begun.elapsed().as_secs_f64();
    let model = solver.model();
    let mut interface = model.interface_mesh(&start.form.displacement);
    // Masses are for contact alone, and JSON has no infinity for those that are held.
    let masses = std::mem::take(&mut interface.masses);
    let least = masses.iter().copied().filter(|m| m.is_finite()).fold(f64::INFINITY, f64::min);
    let sag = model.sag(&start.form.displacement);
    let elements = model.cables.len() + model.giving.start + model.springs.len() + model.point_masses.len();
    let per_node =
        (!interface.lines.is_empty()).then(|| mesh_length(&interface) / interface.node_count() as f64);
    let typical = typical_stiffness(model, &start.form.displacement, &start.form.history).unzip();
    let critical = (config.fem.integrator != Integrator::Static).then_some(start.critical_step);
    let numbers = [
        ("nodes", Some(model.node_count() as f64)),
        ("elements", Some(elements as f64)),
        ("least_interface_mass_kg", Some(least)),
        ("interface_length_per_node_m", per_node),
        ("interface_extent_m", narrower_extent(&interface.coordinates)),
        ("interface_stiffness_n_per_m", typical.0),
        ("interface_stiffness_mass_kg", typical.1),
        ("highest_frequency_rad_per_s", Some(start.frequency)),
        ("critical_step_s", critical),
        ("loaded_critical_step_s", critical.map(|step| LOADED * step)),
        ("time_step_s", Some(start.time_step)),
        ("tangents_for_contact", local::offered(model, &config.fem).is_ok().then_some(1.0)),
        ("sag_m", sag),
        ("prepare_s", Some(prepared)),
    ];
    let numbers = numbers.into_iter().filter_map(|(name, number)| Some((name.to_owned(), number?)));
    let mut numbers: BTreeMap<String, f64> = numbers.collect();
    let mut builds = describe(&config, model, &start, sag);
    builds.extend(solver.inherited.as_ref().map(Inherited::describe));
    let resolved = resolve(&config, &start, solver.inherited.as_ref())?;
    let warnings = start.warnings.clone();
    let step = start.time_step;
    let seconds = seconds_per_step(&mut solver, scene, &config, start)?;
    numbers.insert("seconds_per_step".into(), seconds);
    if let Some(limit) = trial {
        let mut alone = FemSolver::new(scene, &Options { shortcuts: true, ..Options::default() })?;
        let longest = alone.hello().largest_window.min(step * (LOOK / seconds).max(1.0));
        let times = [scene.end_time()?, Output::of(scene)?.interval, longest];
        // What a run says of such a fault it says with more words.
        if let Ok(trial) = Trial::new(&mut alone, times, limit, |_| false) {
            numbers.extend([("tried_s".into(), trial.reached), ("run_s".into(), trial.cost(times[0]))]);
            numbers.extend(trial.ended.then(|| ("ends_s".into(), trial.reached)));
        }
    }
    Ok(CheckReport {
        builds,
        numbers,
        warnings,
        resolved,
        interface: Some(interface),
        ..CheckReport::default()
    })
}

/// Length of all lines of the interface mesh [m].
fn mesh_length(mesh: &InterfaceMesh) -> f64 {
    let at = |node: u32| nalgebra::Vector3::from_column_slice(&mesh.coordinates[3 * node as usize..][..3]);
    mesh.lines.iter().map(|[a, b]| (at(*b) - at(*a)).norm()).sum()
}

/// The narrower side [m] of a net with nodes at `coordinates`: the second largest of its three extents. `None` if it has none.
fn narrower_extent(coordinates: &[f64]) -> Option<f64> {
    let mut extents = [0, 1, 2].map(|axis| {
        let along = coordinates.iter().skip(axis).step_by(3);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        high - low
    });
    extents.sort_by(f64::total_cmp);
    (extents[1] > 0.0 && extents[1].is_finite()).then_some(extents[1])
}

fn describe(config: &Config, model: &Model, start: &Start, sag: Option<f64>) -> Vec<String> {
    let mass: f64 = model.mass.iter().sum();
    let held = (0..model.node_count()).filter(|n| model.held_at_first(*n)).count();
    let (nodes, parts) = (model.node_count(), counts(model));
    let mut lines = vec![format!("structure: {nodes} nodes ({held} held), {mass:.4} kg; {parts}")];
    let at_rest = match start.at_rest {
        _ if start.motion.is_some() => "moves".to_owned(),
        true => "at rest in static equilibrium".to_owned(),
        false => format!("let go, {:.1e} of the support forces unbalanced", start.unbalanced),
    };
    let hangs = sag.map_or(String::new(), |sag| format!(", its lowest node {sag:.6} m below the supports"));
    lines.push(format!(
        "t = 0: {at_rest}{hangs}, largest cable force {:.4e} N ({} Newton iterations)",
        start.cable_force, start.form_finding.iterations
    ));
    lines.extend(on_ground(model, start));
    let step = if config.fem.load_steps.is_some() {
        "load steps that adapt".into()
    } else if start.time_step.is_finite() {
        format!("steps of at most {:.3e} s", start.time_step)
    } else {
        "one step per window".into()
    };
    lines.push(format!("integrator: {}, {step}", config.fem.integrator));
    lines
}

/// Nodes that may touch the ground, and those that do at t = 0, in words.
fn on_ground(model: &Model, start: &Start) -> Option<String> {
    let first = model.ground_contacts().next()?;
    let all = || model.ground_contacts().map(|contact| contact.stiffness);
    let (least, most) = all().fold((f64::INFINITY, 0.0_f64), |(l, m), k| (l.min(k), m.max(k)));
    let mut assembly = Assembly::new(model);
    let forces = model.ground.clone().zip(model.ground_contacts()).map(|(number, contact)| {
        let history = assembly.history(number, &start.form.history).to_vec();
        contact.force(assembly.gather(number, &start.form.displacement), &history)
    });
    let forces: Vec<_> = forces.filter(|force| force.norm() > 0.0).collect();
    let total = forces.iter().sum::<nalgebra::Vector3<f64>>().norm();
    let (friction, restitution) = (first.friction, first.restitution);
    let (nodes, touching) = (model.ground.len(), forces.len());
    Some(format!(
        "ground: {nodes} nodes may touch it (stiffness {least:.3e} to {most:.3e} N/m, friction {friction}, restitution {restitution}); at t = 0 \
         {touching} do, with {total:.4e} N"
    ))
}

/// Numbers of elements of each part, of springs and point masses, in words.
fn counts(model: &Model) -> String {
    let parts = &model.parts[..model.part_count];
    let size = |part: &Part| part.cables.len() + part.elements.len();
    let named: usize = parts.iter().map(size).sum();
    let all = model.cables.len() + model.giving.start;
    let mut counts = vec![(all.saturating_sub(named), "cables".to_owned())];
    counts.extend(parts.iter().map(|part| (size(part), format!("elements of `{}`", part.name))));
    counts.push((model.springs.len(), "springs".into()));
    counts.push((model.point_masses.len(), "point masses".into()));
    let built = counts.iter().filter(|(count, _)| *count > 0);
    built.map(|(count, what)| format!("{count} {what}")).collect::<Vec<_>>().join(", ")
}

/// The tables with every default in place.
fn resolve(config: &Config, start: &Start, inherited: Option<&Inherited>) -> Result<toml::Table, Diagnostic> {
    let mut fem = config.fem.resolved();
    if start.time_step.is_finite() {
        fem.time_step = Some(start.time_step);
    }
    let mut structure = config.structure.clone();
    structure.generator = structure.generator.as_ref().map(Generator::filled_in);
    let mut table = toml::Table::new();
    let broken = |e: toml::ser::Error| Diagnostic::new(format!("the resolved scene cannot be written: {e}"));
    table.insert("structure".into(), toml::Value::try_from(&structure).map_err(broken)?);
    table.insert("fem".into(), toml::Value::try_from(fem).map_err(broken)?);
    if let Some(from) = inherited {
        table.insert(KEY.into(), toml::Value::try_from(&from.origin).map_err(broken)?);
    }
    if !config.gauges.is_empty() {
        table.insert("gauge".into(), toml::Value::try_from(&config.gauges).map_err(broken)?);
    }
    Ok(table)
}

/// Measured wall time of one step [s] with the gauges of its window, one after the other under a force of its weight (at rest there
/// would be nothing to do): for the estimate of cost.
fn seconds_per_step(
    solver: &mut FemSolver,
    scene: &Scene,
    config: &Config,
    start: Start,
) -> Result<f64, Diagnostic> {
    let explicit = config.fem.integrator == Integrator::CentralDifference;
    let step = if start.time_step.is_finite() { start.time_step } else { 0.01 * scene.end_time()? };
    let takes: Vec<_> = solver.hello().takes.into_iter().map(|f| FieldSpec { samples: 1, ..f }).collect();
    let sources = takes.len();
    let rounds = ROUNDS[usize::from(!explicit)];
    let plan = Plan { end_time: rounds as f64 * step, window: step, takes, ..Plan::default() };
    let nodal = solver.model().mass.iter().flat_map(|m| [0.0, 0.0, -10.0 * m]);
    let force: Vec<f64> = std::iter::repeat_n(nodal, sources).flatten().collect();
    let ready = solver.begin(start, &plan).map_err(|fault| *fault.diagnostic)?;
    let mut output = ready.initial;
    // Each alone: what else the machine does at times makes few of them longer.
    let mut took = Vec::new();
    for round in 0..rounds {
        let window =
            Window { number: 1 + round as u64, iteration: 1, start: round as f64 * step, length: step };
        let started = Instant::now();
        // A step that fails has cost what it has cost; the run itself will show.
        let _ = solver.solve(&window, &force, &mut output).and_then(|()| solver.commit());
        took.push(started.elapsed().as_secs_f64());
    }
    took.sort_by(f64::total_cmp);
    Ok(took[took.len() / 2])
}
