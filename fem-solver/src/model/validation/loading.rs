//! What holds, moves and loads the structure: supports that hold nothing, motions and loads in another unit, gravity that points up.

use super::{Judge, warning};
use crate::config::Config;
use crate::config::scheme::Scheme;
use crate::element::part::Key;
use interface_defs::diagnostic::{Diagnostic, code};
use std::f64::consts::TAU;
use toolkit::ranges::Gate;

/// Motion of a support over the extent of the structure that is certainly wrong.
const FARTHEST: f64 = 5.0;
/// Strain of the stiffest cable by a load, from which on something is said.
const LONGER: f64 = 0.5;
/// End of a motion over that of the run from which on something is said.
const LATER: f64 = 100.0;
/// Mass-proportional damping from which on something is said [1/s].
const HEAVY: f64 = 1e3;

const ANGLE: Gate = Gate {
    key: "turning.angles",
    unit: "rad",
    usual: [0.0, 2.0 * TAU],
    says: ["", "are more than two turns"],
    units: &[("degrees", TAU / 360.0)],
    hint: "rows are [t, angle] in s and rad: 90 degrees are 1.5708",
    ..Gate::ANY
};
const SPEED: Gate = Gate {
    key: "velocity",
    unit: "m/s",
    possible: [0.0, 5000.0],
    usual: [0.0, 5000.0],
    says: ["", "is faster than sound in steel"],
    hint: "metres per second: 90 km/h is 25.0",
    ..Gate::ANY
};
/// Amount of a pressure.
const PRESSURE: Gate = Gate {
    key: "pressure",
    unit: "Pa",
    usual: [f64::MIN_POSITIVE, 1e7],
    says: ["load nothing", "are more than 100 bar"],
    hint: "5 kPa are 5000.0",
    ..Gate::ANY
};
const GRAVITY: Gate = Gate {
    key: "gravity",
    unit: "m/s2",
    usual: [0.0, 50.0],
    says: ["", "is more than five times that of the earth"],
    hint: "on earth it is 9.81: gravity = [0.0, 0.0, -9.81]",
    ..Gate::ANY
};

/// Supports that hold nothing, and structures that nothing holds.
pub(super) fn judge_supports(at: &mut Judge) -> Result<(), Diagnostic> {
    let Judge { scene, config, model, .. } = *at;
    let used = model.used();
    for (i, entry) in config.structure.supports.iter().enumerate() {
        let key = format!("structure.supports.{i}");
        let nodes = model.place(&Key { scene, key: key.clone() }, entry.place())?;
        if nodes.iter().all(|n| !used[*n]) {
            let what = format!("{key} holds nothing: no element ends at its {} nodes", nodes.len());
            at.warn(code::UNUSED_KEY, key, what, "");
        }
    }
    for (i, spring) in config.structure.springs.iter().enumerate() {
        if spring.stiffness == [0.0; 3] {
            let what = "all its stiffnesses are 0: it holds nothing";
            at.warn(code::UNUSED_KEY, format!("structure.springs.{i}"), what, "300 kN/m is 3e5");
        }
    }
    judge_lengths(at);
    judge_motions(at)?;
    judge_loads(at)?;
    for (i, entry) in config.structure.pressures.iter().enumerate() {
        PRESSURE.pass(scene, &format!("structure.pressures.{i}"), entry.pressure.abs(), at.warnings)?;
    }
    judge_histories(at);
    judge_gravity(at);
    let damping = config.structure.damping;
    if damping > HEAVY {
        let what = format!("at {damping:e} 1/s a velocity falls to a third within {:.1e} s", 1.0 / damping);
        let hint = "5 % of critical damping at 10 Hz are 6.3 1/s";
        at.warn(code::UNUSUAL_VALUE, "structure.damping", what, hint);
    }
    judge_velocities(at)?;
    let all_held = (0..model.node_count()).filter(|n| used[*n]).all(|n| model.fully_held(n));
    let for_ever = model.until.is_empty();
    if all_held && model.moving.is_empty() && for_ever && used.contains(&true) {
        let count = model.node_count();
        let what = format!("the supports hold all {count} nodes of the structure: nothing of it can move");
        let key = if config.structure.supports.is_empty() { "structure" } else { "structure.supports" };
        if scene.has("rock") {
            let hint = "hold the frame alone, as in supports = [{ group = \"frame\" }]";
            return Err(scene.invalid(key, what).coded(code::GEOMETRY).try_instead(hint));
        }
        // Someone may want its reactions alone.
        at.warn(code::GEOMETRY, key, what, "hold the frame alone");
        return Ok(());
    }
    if !model.is_supported() && model.ground.is_empty() && model.down.is_some() {
        let what = "nothing holds the structure: it falls";
        let hint = "supports = [{ group = \"name of a group\" }]";
        at.warn(code::GEOMETRY, "structure", what, hint);
    }
    Ok(())
}

/// Longest and shortest that a cable is usually made over the distance of its nodes.
const MADE: [f64; 2] = [0.9, 1.5];

/// Cables whose length is hardly that of the distance of their nodes.
fn judge_lengths(at: &mut Judge) {
    for (i, cable) in at.config.structure.cables.iter().enumerate() {
        let span = (at.model.nodes[cable.nodes[1]] - at.model.nodes[cable.nodes[0]]).norm();
        let Some(length) = cable.length.filter(|own| !(MADE[0]..=MADE[1]).contains(&(own / span))) else {
            continue;
        };
        let what = format!(
            "an unstretched length of {length} m between nodes {span:.4} m apart, a strain of {:.3}",
            span / length - 1.0
        );
        let hint = "metres, when nothing pulls it; left out it is the distance of its nodes";
        at.warn(code::UNUSUAL_VALUE, format!("structure.cables.{i}.length"), what, hint);
    }
}

/// Motions of supports that are longer than the structure, what takes place after the end, and angles in degrees.
fn judge_motions(at: &mut Judge) -> Result<(), Diagnostic> {
    let Judge { scene, config, model, .. } = *at;
    let (extent, Ok(end_time)) = (model.extent(), scene.end_time()) else { return Ok(()) };
    for (i, entry) in config.structure.supports.iter().enumerate() {
        let key = format!("structure.supports.{i}");
        if let Some(time) = entry.released_at.filter(|time| *time > end_time) {
            let what = format!("it lets go at {time} s, and the run ends at end_time = {end_time} s");
            at.warn(code::UNUSED_KEY, format!("{key}.released_at"), what, "100 ms is 0.1");
        }
        let angles = entry.turning.iter().flat_map(|turning| &turning.angles);
        ANGLE.pass(scene, &key, angles.map(|row| row[1].abs()).fold(0.0, f64::max), at.warnings)?;
        let key = format!("{key}.motion");
        let furthest = |row: &[f64; 4]| norm(&[row[1], row[2], row[3]]);
        let most = entry.motion.iter().map(furthest).fold(0.0, f64::max);
        if extent > 0.0 && most > FARTHEST * extent {
            let what = format!(
                "a support moves by {most} m, and the whole structure has an extent of {extent:.4} m"
            );
            return scene.refuse(&key, what, "rows are [t, ux, uy, uz] in s and m: 100 mm is 0.1");
        }
        let hint = "rows are [t, ux, uy, uz] in s and m: 100 ms is 0.1";
        at.warnings.extend(late(key, entry.motion.last().map(|row| row[0]), end_time, hint));
    }
    Ok(())
}

/// A warning about a table whose last row is far behind the end of the run.
fn late(key: String, last: Option<f64>, end_time: f64, hint: &str) -> Option<Diagnostic> {
    let last = last.filter(|last| *last > LATER * end_time)?;
    let what = format!("it goes on until {last} s, and the run ends at end_time = {end_time} s");
    Some(warning(code::LIKELY_UNIT, key, what, hint))
}

/// Loads that go straight into supports, or stretch cables as nothing is stretched.
fn judge_loads(at: &mut Judge) -> Result<(), Diagnostic> {
    let Judge { scene, config, model, .. } = *at;
    let supports = &config.structure.supports;
    for (i, _) in supports.iter().enumerate().filter(|(i, entry)| supports[..*i].contains(entry)) {
        let what = format!("row {i} is as one before it: it changes nothing");
        at.warn(code::UNUSED_KEY, format!("structure.supports.{i}"), what, "leave one of them out");
    }
    let rigid = model.cables.iter().map(|c| c.of.young * c.of.area).fold(0.0, f64::max);
    for (i, entry) in config.structure.loads.iter().enumerate() {
        let key = format!("structure.loads.{i}");
        let nodes = model.place(&Key { scene, key: key.clone() }, entry.place())?;
        let force = norm(&entry.force);
        if model.elements.is_empty() && force > LONGER * rigid && rigid > 0.0 {
            let times = 1.0 + force / rigid;
            let what = format!(
                "{force:e} N would stretch the stiffest cable of the structure to {times:.1} times its length"
            );
            at.warn(code::LIKELY_UNIT, format!("{key}.force"), what, "a load of 5 kN is 5e3");
        }
        if entry.moment != [0.0; 3] {
            continue;
        }
        if entry.force == [0.0; 3] {
            let what = "force and moment are 0, so it loads nothing";
            at.warn(code::UNUSED_KEY, key, what, "");
        } else if all_held(&nodes, &entry.force, |node, c| model.held[model.dof(node, c)]) {
            let count = nodes.len();
            let what =
                format!("supports hold its {count} nodes in the direction of the force, so it moves nothing");
            at.warn(code::UNUSED_KEY, key, what, "name nodes that are free");
        }
    }
    Ok(())
}

/// Whether all `nodes` are held in each direction in which `vector` points; there are some.
fn all_held(nodes: &[usize], vector: &[f64; 3], held: impl Fn(usize, usize) -> bool) -> bool {
    let stays = |node: &usize| (0..3).all(|c| vector[c] == 0.0 || held(*node, c));
    !nodes.is_empty() && nodes.iter().all(stays)
}

fn norm(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The histories of all loads, with their keys.
fn histories(config: &Config) -> impl Iterator<Item = (String, &Vec<[f64; 2]>)> {
    let table = &config.structure;
    let loads = table.loads.iter().enumerate().map(|(i, e)| ("loads", i, &e.history));
    let pressures = table.pressures.iter().enumerate().map(|(i, e)| ("pressures", i, &e.history));
    let all = loads.chain(pressures);
    all.map(|(name, i, history)| (format!("structure.{name}.{i}.history"), history))
}

/// Warnings about rows of a history between which no step of `step` [s] ends, of a scheme that takes loads as they are at the
/// instants where it balances.
pub fn unseen_rows(config: &Config, step: f64) -> Vec<Diagnostic> {
    if Scheme::of(&config.fem).is_none_or(|scheme| scheme.takes_mean_only()) {
        return Vec::new();
    }
    let unseen = |(key, rows): (String, &Vec<[f64; 2]>)| {
        let close = rows.windows(2).map(|pair| pair[1][0] - pair[0][0]).fold(f64::INFINITY, f64::min);
        (close < step * (1.0 - 1e-9)).then(|| {
            let what = format!(
                "two rows are {close:.3e} s apart and steps are {step:.3e} s long: {} takes a load as it is at single instants, \
                 what lies between two of them is not seen",
                config.fem.integrator
            );
            let hint = format!("write fem.time_step = {close:.1e} or less, or use central_difference");
            warning(code::TIME_STEP, key, what, &hint)
        })
    };
    histories(config).filter_map(unseen).collect()
}

/// Histories of loads that do nothing, or nothing before the end.
fn judge_histories(at: &mut Judge) {
    let Judge { scene, config, .. } = *at;
    let Ok(end_time) = scene.end_time() else { return };
    let hint = "rows are [t, factor] in s: 100 ms is 0.1";
    for (key, rows) in histories(config) {
        let Some([begin, factor]) = rows.first() else { continue };
        // Before the first row the factor is that of the first row.
        if rows.iter().all(|row| row[1] == 0.0) {
            at.warn(code::UNUSED_KEY, key, "all factors are 0: it loads nothing", "");
        } else if *factor == 0.0 && *begin >= end_time {
            let what = format!(
                "it is 0 until {begin} s, and the run ends at end_time = {end_time} s, so it loads nothing"
            );
            at.warn(code::LIKELY_UNIT, key, what, hint);
        } else {
            at.warnings.extend(late(key, rows.last().map(|row| row[0]), end_time, hint));
        }
    }
}

/// Velocities that no net has, and those of nodes that are held.
fn judge_velocities(at: &mut Judge) -> Result<(), Diagnostic> {
    let Judge { scene, config, model, .. } = *at;
    for (i, entry) in config.structure.velocities.iter().enumerate() {
        let key = format!("structure.velocities.{i}");
        let speed = norm(&entry.velocity);
        SPEED.pass(scene, &key, speed, at.warnings)?;
        let nodes = model.place(&Key { scene, key: key.clone() }, entry.place())?;
        let held = |node, c| model.held_first(model.dof(node, c));
        if speed > 0.0 && all_held(&nodes, &entry.velocity, held) {
            let count = nodes.len();
            let what = format!(
                "supports hold its {count} nodes in the direction of the velocity, so they stay at rest"
            );
            at.warn(code::UNUSED_KEY, key, what, "");
        }
    }
    Ok(())
}

/// Warn of missing weight or gravity that points up; where there are rocks, the contact solver judges gravity.
fn judge_gravity(at: &mut Judge) {
    let Judge { scene, config, .. } = *at;
    if scene.has("rock") || !config.structure.dead_load {
        return;
    }
    let [x, y, z] = config.gravity;
    let size = norm(&config.gravity);
    let table = &config.structure;
    let moved = !(table.loads.is_empty() && table.pressures.is_empty() && table.velocities.is_empty());
    if size == 0.0 && !scene.has("gravity") && !moved {
        let what = "there is no gravity: the structure has no weight";
        let hint = "gravity = [0.0, 0.0, -9.81], or structure.dead_load = false";
        at.warn(code::UNUSUAL_VALUE, "structure", what, hint);
    }
    if size > 0.0 && z > 0.9 * size {
        let what = format!("[{x}, {y}, {z}] points up along z, so the structure hangs upward");
        at.warn(code::UNUSUAL_VALUE, "gravity", what, "usual is gravity = [0.0, 0.0, -9.81]");
    }
    at.warnings.extend(GRAVITY.judge("", size));
}
