//! What the solver would build of a scene, with which step and at what cost.

use crate::gate::{lengths::height, reach};
use crate::model::Model;
use crate::net_contact;
use crate::solver::DemSolver;
use dem_contact::rock::Rock;
use dem_contact::settings::{
    BoxSettings, ContactSettings, DemSettings, RockSettings, Settings, Shape, SpheresSettings,
    TerrainSettings,
};
use dem_terrain::Terrain;
use interface_defs::InterfaceMesh;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use serde::Serialize;
use std::time::Duration;
use toolkit::check::CheckReport;
use toolkit::output::Output;
use toolkit::program::Options;
use toolkit::scene::Scene;
use toolkit::trial::Trial;

/// Seconds per step and rock without contacts, as measured on one core of 2.5 GHz.
const SECONDS_PER_STEP: f64 = 2e-6;
/// Neighbours of a sphere that lies among others.
const NEIGHBOURS: f64 = 6.0;
/// Seconds per touching pair and step, likewise; of a rock's spheres with the lines of a net more, as most of them are looked at in vain.
const SECONDS_PER_PAIR: f64 = 5e-8;
const SECONDS_PER_LINE: f64 = 1.5e-7;
/// Seconds that the tables of a fall take, and with terrain its picture, likewise.
const SECONDS_OF_RESULTS: [f64; 2] = [1e-3, 0.35];
/// Steps of a fall that is tried between two looks at the clock.
pub const STEPS_PER_LOOK: f64 = 1000.0;

#[derive(Serialize)]
struct ResolvedTables<'a> {
    gravity: [f64; 3],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    rock: &'a [RockSettings],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    spheres: &'a [SpheresSettings],
    #[serde(rename = "box")]
    sides: Option<&'a BoxSettings>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    contact: &'a [ContactSettings],
    terrain: Option<&'a TerrainSettings>,
    dem: DemSettings,
}

/// Build everything of the scene but the net, and say what it is.
pub fn check(scene: &Scene) -> Result<CheckReport, Diagnostic> {
    check_with(scene, None, None)
}

/// The same with the `net` that the structure offers: rocks that start in it are refused. A fall is tried for so long, over terrain as
/// far as to the net: how much of it is flight, and when it ends, does not follow from a count of steps.
pub fn check_with(
    scene: &Scene,
    net: Option<&InterfaceMesh>,
    trial: Option<Duration>,
) -> Result<CheckReport, Diagnostic> {
    let mut solver = DemSolver::new(scene, &Options { out: None, shortcuts: true })?;
    let fem = scene.read::<toml::Table>("processes")?.is_some_and(|p| p.contains_key("fem"));
    if (fem || scene.has("structure")) && solver.model().laws.is_none() {
        return scene.refuse(
            "structure",
            "there is a net and no contact law: the rock would fall through it",
            "add a table [[contact]]",
        );
    }
    if let Some(what) = solver.idle_selection().filter(|_| !fem && !scene.has("structure")) {
        let refused = scene.invalid("dem.contact_selection", what);
        return Err(refused.coded(code::UNUSED_KEY).try_instead("leave it out"));
    }
    let mut near = Vec::new();
    if let Some(net) = net {
        near = solver.check_net(net).map_err(|fault| *fault.diagnostic)?;
    }
    let model = solver.model();
    let mut report = CheckReport {
        warnings: [solver.notices(), solver.cautions(), &near].concat(),
        ..CheckReport::default()
    };
    for group in &model.settings.spheres {
        let ([least, most], total, name) = (group.radii(), group.total(), &group.name);
        report
            .builds
            .push(format!("`{name}`: {total} spheres of {least} to {most} m radius, each a rock of its own"));
    }
    if !model.planes.is_empty() {
        report.builds.push(format!("box of {} planes", model.planes.len()));
    }
    for at in 0..model.settings.named() {
        add_rock(model, at, &mut report)?;
    }
    if let Some(ground) = &model.ground {
        add_terrain(model, ground, solver.choice(), &mut report);
    }
    add_steps(model, &mut report);
    add_cost(model, &mut report);
    report.numbers.extend(net_contact::numbers(model));
    let nodes = |net: &InterfaceMesh| {
        net.coordinates
            .chunks_exact(3)
            .map(|x| Vector3::from_column_slice(x) - model.origin)
            .collect::<Vec<_>>()
    };
    let net = net.map(nodes).and_then(reach::NetExtent::around);
    let arrival = net.as_ref().and_then(|net| reach::arrival(model, net));
    report.numbers.extend(arrival.map(|time| ("arrival_s".to_owned(), time)));
    let dem = &model.settings.dem;
    let dem = if model.settings.contacts.is_empty() { dem.clone() } else { dem.filled_in() };
    report.resolved = resolved(&model.settings, dem);
    let alone = !fem && !scene.has("structure");
    if let Some(limit) = trial.filter(|_| alone || model.ground.is_some() && net.is_some()) {
        try_fall(&mut solver, net.as_ref(), limit, scene, &mut report)?;
    }
    Ok(report)
}

fn add_rock(model: &Model, at: usize, report: &mut CheckReport) -> Result<(), Diagnostic> {
    let (rock, settings) = (&model.rocks[at], &model.settings.rocks[at]);
    let (name, shape, mass, [x, y, z]) =
        (&rock.name, rock.solid.shape.describe(), rock.mass, rock.inertia.into());
    let (count, origin, radius) = (rock.spheres.len(), &rock.origin, rock.smallest_radius);
    let more = if rock.has_equal_spheres() { "" } else { " and more" };
    report.builds.push(format!(
        "rock `{name}`: {shape}, {mass:.6} kg, moments of inertia {x:.4} {y:.4} {z:.4} kg m2, {count} spheres ({origin}) of \
         radius {radius:.6} m{more}"
    ));
    if rock.spheres.len() > 1 || !matches!(settings.shape, Shape::Sphere { .. }) {
        let accuracy = rock.accuracy(settings)?;
        report.builds.push(format!("rock `{}`: error of the spheres: {accuracy}", rock.name));
        report.numbers.insert(format!("{}_surface_error_m", rock.name), accuracy.largest());
        report.numbers.insert(format!("{}_volume_error", rock.name), accuracy.volume);
    }
    report.clusters.extend(rock.made.iter().map(|made| (rock.name.clone(), made.clone())));
    Ok(())
}

/// The cost of a step, and what it follows from.
fn add_cost(model: &Model, report: &mut CheckReport) {
    let (named, loose) = model.rocks.split_at(model.settings.named());
    // On a net with cells of a third of the rock, six rows of its spheres touch.
    let in_rows = |rock: &Rock| SECONDS_PER_LINE * 6.0 * (rock.spheres.len() as f64).cbrt();
    let pairs = loose.iter().map(|_| SECONDS_PER_PAIR * NEIGHBOURS).chain(named.iter().map(in_rows));
    let numbers = [
        ("seconds_per_step", pairs.map(|pairs| SECONDS_PER_STEP + pairs).sum()),
        ("spheres", model.rocks.iter().map(|rock| rock.spheres.len() as f64).sum()),
        ("mass_kg", loose.iter().chain(named).map(|rock| rock.mass).sum()),
    ];
    report.numbers.extend(numbers.map(|(name, value): (&str, f64)| (name.to_owned(), value)));
}

/// Try a fall for at most `limit`, as far as to the net: what it costs, and when it ends.
fn try_fall(
    solver: &mut DemSolver,
    net: Option<&reach::NetExtent>,
    limit: Duration,
    scene: &Scene,
    report: &mut CheckReport,
) -> Result<(), Diagnostic> {
    let model = solver.model();
    let (end, results) = (scene.end_time()?, SECONDS_OF_RESULTS[usize::from(model.ground.is_some())]);
    let longest = STEPS_PER_LOOK * model.steps.step;
    let arrives =
        |solver: &DemSolver| net.is_some_and(|net| net.is_near(solver.model(), solver.state(), longest));
    // As a run that writes them.
    solver.keeps_rows = true;
    // What a run says of such a fault it says with more words.
    let times = [end, Output::of(scene)?.interval, longest];
    if let Ok(trial) = Trial::new(&mut *solver, times, limit, arrives) {
        let numbers = [("tried_s", trial.reached), ("run_s", results + trial.cost(end))];
        report.numbers.extend(numbers.map(|(name, value)| (name.to_owned(), value)));
        let ended = if arrives(solver) { "arrival_s" } else { "ends_s" };
        report.numbers.extend(trial.ended.then(|| (ended.to_owned(), trial.reached)));
    }
    Ok(())
}

fn add_terrain(model: &Model, ground: &Terrain, choice: Option<&str>, report: &mut CheckReport) {
    report.builds.push(ground.describe());
    report.builds.extend(choice.map(str::to_owned));
    for (at, rock) in model.rocks.iter().enumerate().take(model.settings.named()) {
        if let Some(height) = height(ground, &model.settings, at) {
            let what = format!("rock `{}`: its centre starts {height:.2} m above the terrain", rock.name);
            report.builds.push(what);
        }
    }
    report.numbers.insert("triangles".into(), ground.triangles.len() as f64);
}

fn add_steps(model: &Model, report: &mut CheckReport) {
    let steps = &model.steps;
    match &model.laws {
        Some(laws) => {
            report.builds.extend(laws.describe());
            let (step, critical, speed) = (steps.step, steps.critical, steps.speed);
            let of = if model.ground.is_some() { "all its energy" } else { "free fall until end_time" };
            report.builds.push(format!(
                "step {step:.4e} s; critical {critical:.4e} s for a landing at {speed:.2} m/s ({of}) on a rigid fixed surface"
            ));
        }
        None => report.builds.push(format!("no contact; step {:.4e} s", steps.step)),
    }
    report.warnings.extend(above_critical(steps.step, steps.critical));
    let numbers = [
        ("critical_step_s", steps.critical),
        ("time_step_s", steps.step),
        ("contact_duration_s", steps.contact),
        ("longest_step_s", steps.longest),
    ];
    report.numbers.extend(numbers.map(|(name, value)| (name.to_owned(), value)));
}

/// What is said of a step [s] above the critical one.
pub(crate) fn above_critical(step: f64, critical: f64) -> Option<Diagnostic> {
    let what = || format!("{step:.3e} s lies above the critical step of {critical:.3e} s (allow_unstable)");
    (step > critical).then(|| Diagnostic::warning(code::TIME_STEP, what()).about("dem.time_step"))
}

/// The tables of a scene with all that was filled in.
pub(crate) fn resolved(settings: &Settings, dem: DemSettings) -> toml::Table {
    let tables = ResolvedTables {
        gravity: settings.gravity.into(),
        rock: &settings.rocks[..settings.named()],
        spheres: &settings.spheres,
        sides: settings.sides.as_ref(),
        contact: &settings.contacts,
        terrain: settings.terrain.as_ref(),
        dem,
    };
    toml::Table::try_from(tables).expect("tables of numbers and text are valid TOML")
}
