//! Supports, loads and gravity: what holds, what moves, what pulls.

use crate::config::Config;
use crate::config::scheme::Scheme;
use crate::config::structure::SupportEntry;
use crate::model::Model;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::toolkit::scene::Scene;

/// Motion of a support over the extent of the structure that no one can mean.
const FARTHEST: f64 = 5.0;
/// Strain of the stiffest cable by a load, from which on something is said.
const LONGER: f64 = 0.5;
/// Mass-proportional damping from which on something is said [1/s].
const HEAVY: f64 = 1e3;
/// Angle from which on something is said [rad]: two turns.
const MOST_TURN: f64 = 4.0 * std::f64::consts::PI;
/// Speed that no one can mean [m/s]: that of sound in steel.
const FASTEST: f64 = 5000.0;
/// End of a motion over that of the run from which on something is said.
const LATER: f64 = 100.0;

/// Supports that hold nothing, and structures that nothing holds.
pub fn judge(
    scene: &Scene,
    config: &Config,
    model: &Model,
    warnings: &mut Vec<String>,
) -> Result<(), Diagnostic> {
    let mut used = vec![false; model.node_count()];
    model.cables.iter().flat_map(|c| c.nodes).for_each(|n| used[n] = true);
    model.elements.iter().flat_map(|e| e.nodes()).for_each(|n| used[*n] = true);
    model.point_masses.iter().for_each(|m| used[m.node] = true);
    model.springs.iter().for_each(|s| used[s.node] = true);
    for (i, entry) in config.structure.supports.iter().enumerate() {
        let key = format!("structure.supports.{i}");
        let nodes = model.place(scene, &key, entry.place())?;
        if nodes.iter().all(|n| !used[*n]) {
            warnings
                .push(format!("{key}: {key} holds nothing: no element ends at its {} nodes", nodes.len()));
        }
    }
    judge_motions(scene, config, model, warnings)?;
    judge_loads(scene, config, model, warnings)?;
    judge_pressures(config, warnings);
    judge_histories(scene, config, warnings);
    judge_velocities(scene, config, model, warnings)?;
    let all_held = (0..model.node_count()).filter(|n| used[*n]).all(|n| model.fully_held(n));
    if all_held && model.moving.is_empty() && model.until.is_empty() && used.contains(&true) {
        let what = format!(
            "the supports hold all {} nodes of the structure: nothing of it can move",
            model.node_count()
        );
        let key = if config.structure.supports.is_empty() { "structure" } else { "structure.supports" };
        if !scene.has("rock") {
            // Someone may want its reactions alone.
            warnings.push(format!("{key}: {what}; hold the frame alone"));
            return Ok(());
        }
        return Err(scene
            .invalid(key, what)
            .try_instead("hold the frame alone, as in supports = [{ group = \"frame\" }]"));
    }
    if !model.held.contains(&true)
        && model.until.is_empty()
        && model.springs.is_empty()
        && model.ground.is_empty()
        && model.down.is_some()
    {
        warnings.push(
            "structure: nothing holds the structure: it falls; supports = [{ group = \"name of a group\" }]"
                .into(),
        );
    }
    Ok(())
}

/// Motions of supports that are longer than the structure, or take place after the end.
fn judge_motions(
    scene: &Scene,
    config: &Config,
    model: &Model,
    warnings: &mut Vec<String>,
) -> Result<(), Diagnostic> {
    let (extent, Ok(end_time)) = (model.extent(), scene.end_time()) else { return Ok(()) };
    for (i, entry) in config.structure.supports.iter().enumerate() {
        judge_release(entry, i, end_time, warnings);
        let key = format!("structure.supports.{i}.motion");
        let furthest = |row: &[f64; 4]| row[1..].iter().map(|u| u * u).sum::<f64>().sqrt();
        let most = entry.motion.iter().map(furthest).fold(0.0, f64::max);
        if extent > 0.0 && most > FARTHEST * extent {
            let what = format!(
                "a support moves by {most} m, and the whole structure has an extent of {extent:.4} m"
            );
            return Err(scene
                .invalid(&key, what)
                .try_instead("rows are [t, ux, uy, uz] in s and m: 100 mm is 0.1"));
        }
        if let Some(last) = entry.motion.last().map(|row| row[0]).filter(|last| *last > LATER * end_time) {
            warnings.push(format!(
                "{key}: it goes on until {last} s, and the run ends at end_time = {end_time} s; rows are [t, ux, uy, uz] in s \
                 and m: 100 ms is 0.1"
            ));
        }
    }
    Ok(())
}

/// Supports that let go after the end, and angles in degrees.
fn judge_release(entry: &SupportEntry, i: usize, end_time: f64, warnings: &mut Vec<String>) {
    if let Some(time) = entry.released_at.filter(|time| *time > end_time) {
        warnings.push(format!(
            "structure.supports.{i}.released_at: it lets go at {time} s, and the run ends at end_time = {end_time} s: 100 ms is \
             0.1"
        ));
    }
    let angles = entry.turning.iter().flat_map(|turning| &turning.angles);
    let most = angles.map(|row| row[1].abs()).fold(0.0, f64::max);
    if most > MOST_TURN {
        warnings.push(format!(
            "structure.supports.{i}.turning.angles: {most} rad are {:.1} turns; rows are [t, angle] in s and rad: 90 degrees \
             are 1.5708",
            most / std::f64::consts::TAU
        ));
    }
}

/// Loads that go straight into supports, or stretch cables as nothing is stretched.
fn judge_loads(
    scene: &Scene,
    config: &Config,
    model: &Model,
    warnings: &mut Vec<String>,
) -> Result<(), Diagnostic> {
    for (i, entry) in config.structure.loads.iter().enumerate() {
        let key = format!("structure.loads.{i}");
        let nodes = model.place(scene, &key, entry.place())?;
        let (force, rigid) = (norm(&entry.force), stiffest(model));
        if model.elements.is_empty() && force > LONGER * rigid && rigid > 0.0 {
            warnings.push(format!(
                "{key}.force: {force:e} N would stretch the stiffest cable of the structure to {:.1} times its length; a load of 5 kN \
                 is 5e3",
                1.0 + force / rigid
            ));
        }
        let held = |node: &usize| (0..3).all(|c| entry.force[c] == 0.0 || model.held[model.dof(*node, c)]);
        if entry.moment == [0.0; 3] && entry.force == [0.0; 3] {
            warnings.push(format!("{key}: force and moment are 0, so it loads nothing"));
        }
        if entry.moment == [0.0; 3] && entry.force != [0.0; 3] && !nodes.is_empty() && nodes.iter().all(held)
        {
            warnings.push(format!(
                "{key}: supports hold its {} nodes in the direction of the force, so it moves nothing; name nodes that are free",
                nodes.len()
            ));
        }
    }
    Ok(())
}

fn norm(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Largest product of modulus and section of all cables [N].
fn stiffest(model: &Model) -> f64 {
    model.cables.iter().map(|c| c.young * c.area).fold(0.0, f64::max)
}

/// Damping that stops whatever moves; loads and steps are judged elsewhere.
pub fn judge_damping(config: &Config, warnings: &mut Vec<String>) {
    let damping = config.structure.damping;
    if damping > HEAVY {
        warnings.push(format!(
            "structure.damping: at {damping:e} 1/s a velocity falls to a third within {:.1e} s; 5 % of critical damping at 10 Hz are \
             6.3 1/s",
            1.0 / damping
        ));
    }
}

/// Pressure from which on a unit is the likelier meaning [Pa]: 100 bar.
const HIGH: f64 = 1e7;

/// Pressures that load nothing, or burst whatever is built.
fn judge_pressures(config: &Config, warnings: &mut Vec<String>) {
    for (i, entry) in config.structure.pressures.iter().enumerate() {
        let (key, pressure) = (format!("structure.pressures.{i}.pressure"), entry.pressure);
        if pressure == 0.0 {
            warnings.push(format!("{key}: 0 Pa load nothing"));
        } else if pressure.abs() > HIGH {
            warnings.push(format!("{key}: {pressure:e} Pa are {:e} bar; 5 kPa are 5000.0", 1e-5 * pressure));
        }
    }
}

/// The histories of all loads, with their keys.
fn histories(config: &Config) -> impl Iterator<Item = (String, &Vec<[f64; 2]>)> {
    let of = |name: &'static str| move |i: usize| format!("structure.{name}.{i}.history");
    let (load, pressure) = (of("loads"), of("pressures"));
    let loads = config.structure.loads.iter().enumerate().map(move |(i, e)| (load(i), &e.history));
    let pressures = config.structure.pressures.iter().enumerate();
    loads.chain(pressures.map(move |(i, e)| (pressure(i), &e.history)))
}

/// What is said of rows of a history between which no step of `step` [s] ends, of a scheme that takes loads as they are at the
/// instants where it balances.
pub fn unseen_rows(config: &Config, step: f64) -> Vec<String> {
    if Scheme::of(&config.fem).is_none_or(|scheme| scheme.takes_mean_only()) {
        return Vec::new();
    }
    let unseen = |(key, rows): (String, &Vec<[f64; 2]>)| {
        let close = rows.windows(2).map(|pair| pair[1][0] - pair[0][0]).fold(f64::INFINITY, f64::min);
        (close < step * (1.0 - 1e-9)).then(|| {
            format!(
                "{key}: two rows are {close:.3e} s apart and steps are {step:.3e} s long: {} takes a load as it is at single instants, \
                 what lies between two of them is not seen; write fem.time_step = {close:.1e} or less, or use central_difference",
                config.fem.integrator.name()
            )
        })
    };
    histories(config).filter_map(unseen).collect()
}

/// Histories of loads that do nothing, or nothing before the end.
fn judge_histories(scene: &Scene, config: &Config, warnings: &mut Vec<String>) {
    let Ok(end_time) = scene.end_time() else { return };
    for (key, rows) in histories(config) {
        let Some(last) = rows.last().map(|row| row[0]) else { continue };
        // Before the first row the factor is that of the first row.
        let begins_later = rows.first().is_some_and(|row| row[1] == 0.0 && row[0] >= end_time);
        if rows.iter().all(|row| row[1] == 0.0) {
            warnings.push(format!("{key}: all factors are 0: it loads nothing"));
        } else if begins_later {
            warnings.push(format!(
                "{key}: it is 0 until {} s, and the run ends at end_time = {end_time} s, so it loads nothing; rows are [t, factor] in s: \
                 100 ms is 0.1",
                rows[0][0]
            ));
        } else if last > LATER * end_time {
            warnings.push(format!(
                "{key}: it goes on until {last} s, and the run ends at end_time = {end_time} s; rows are [t, factor] in s: \
                 100 ms is 0.1"
            ));
        }
    }
}

/// Velocities that no net has, and those of nodes that are held.
fn judge_velocities(
    scene: &Scene,
    config: &Config,
    model: &Model,
    warnings: &mut Vec<String>,
) -> Result<(), Diagnostic> {
    for (i, entry) in config.structure.velocities.iter().enumerate() {
        let key = format!("structure.velocities.{i}");
        let speed = entry.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        if speed > FASTEST {
            let what = format!("nodes start at {speed} m/s, faster than sound in steel");
            return Err(scene
                .invalid(&format!("{key}.velocity"), what)
                .try_instead("metres per second: 90 km/h is 25.0"));
        }
        let nodes = model.place(scene, &key, entry.place())?;
        let held =
            |node: &usize| (0..3).all(|c| entry.velocity[c] == 0.0 || model.held_first(model.dof(*node, c)));
        if speed > 0.0 && !nodes.is_empty() && nodes.iter().all(held) {
            warnings.push(format!(
                "{key}: supports hold its {} nodes in the direction of the velocity, so they stay at rest",
                nodes.len()
            ));
        }
    }
    Ok(())
}

/// Whether there is weight; where there are rocks, who computes them judges gravity.
pub fn judge_gravity(scene: &Scene, config: &Config, warnings: &mut Vec<String>) {
    if scene.has("rock") || !config.structure.dead_load {
        return;
    }
    let size = config.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    let table = &config.structure;
    let moved = !(table.loads.is_empty() && table.pressures.is_empty() && table.velocities.is_empty());
    if size == 0.0 && !scene.has("gravity") && !moved {
        warnings.push(
            "structure: there is no gravity: the structure has no weight; gravity = [0.0, 0.0, -9.81], or structure.dead_load = false"
                .into(),
        );
    }
    if size > 0.0 && config.gravity[2] > 0.9 * size {
        warnings.push(format!(
            "gravity: [{}, {}, {}] points up along z, so the structure hangs upward; usual is gravity = [0.0, 0.0, -9.81]",
            config.gravity[0], config.gravity[1], config.gravity[2]
        ));
    }
    if size > 50.0 {
        warnings
            .push(format!("gravity: it is {size} m/s2, on earth it is 9.81; gravity = [0.0, 0.0, -9.81]"));
    }
}
