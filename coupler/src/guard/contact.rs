//! What a contact solver does with windows that do not count: it repeats them, uses their length, its bodies move as their velocities
//! say, and where it touches, it pushes back harder the further the mesh is moved against it, and is pushed itself.

use super::asked::Asked;
use super::bodies::Bodies;
use super::clause;
use crate::schedule::Span;
use crate::side::Side;
use interface_defs::{Failure, Sampling, name};
use std::cell::Cell;
use std::ops::Range;

/// What is looked at.
const EXAMINED: [&str; 5] =
    [clause::COMMITTED, clause::REPEATS, clause::LENGTH, clause::FORCE, clause::REACTION];
/// Largest deviation of a body's path from what its velocities make it, beside a bend of its motion.
const MOST_APART: f64 = 0.02;
/// A way below this share of that leads from another place.
const STUCK: f64 = 0.1;
/// Largest deviation of work and of impulse.
const MOST_WORK_APART: f64 = 0.01;
const MOST_IMPULSE_APART: f64 = 0.1;
/// First distance by which the mesh is moved, how often one ten times as long is tried [m], and the change of force that is enough.
const MOVE: f64 = 1e-7;
const TIMES: i32 = 5;
const SEEN: f64 = 1e-3;
/// Below this share of the largest force so far a contact is about to end: under friction it slides off an edge however the mesh moves.
const ENDING: f64 = 0.05;

/// What is known beside the contact solver itself.
pub(crate) struct Contact<'e> {
    pub bodies: &'e Bodies,
    /// Largest force on its mesh that was examined so far [N].
    pub largest: &'e Cell<f64>,
    /// Nodes of its mesh at t = 0 [m].
    pub coordinates: &'e [f64],
    /// Whether momentum is to be looked at: where no balance of energy says as much.
    pub momentum: bool,
}

/// Examine a contact solver; `motion` writes the request for a window of a length, the mesh going on as it does by now.
pub(crate) fn examine_contact(
    asked: &mut Asked,
    contact: &Contact,
    motion: &mut dyn FnMut(f64, &mut [f64]),
) -> Result<(), Failure> {
    let Some(repeats) = asked.repeats(&EXAMINED) else { return Ok(()) };
    let length = asked.span.length;
    let Some(first) = asked.solve(length, &mut |to| motion(length, to))? else { return Ok(()) };
    let Some(half) = asked.solve(0.5 * length, &mut |to| motion(0.5 * length, to))? else { return Ok(()) };
    let Some(again) = asked.solve(length, &mut |to| motion(length, to))? else { return Ok(()) };
    asked.check_repetition([&half, &first, &again], repeats)?;
    let forces = Forces::of(asked, &first);
    let touches = forces.size() > 0.0;
    check_clock(asked, contact.bodies, &first, &half)?;
    if contact.bodies.is_empty() {
        let mut still = |length, to: &mut [f64]| {
            motion(length, to);
            hold_still(asked.side, to);
        };
        let mut pair = Vec::new();
        for length in [length, 0.5 * length] {
            let span = Span { length, ..asked.span };
            pair.push(asked.slot.try_window((span, 1), asked.side, &mut |to| still(length, to))?);
        }
        if let [Ok(long), Ok(short)] = &pair[..] {
            check_length(asked, long, short)?;
        }
    }
    if !touches {
        let why = "it touches nothing";
        [clause::FORCE, clause::REACTION].into_iter().for_each(|c| asked.unknown(c, why));
        return Ok(());
    }
    check_push(asked, motion, &forces, repeats, contact.largest)?;
    let mut payload = vec![0.0; asked.side.request.len()];
    motion(length, &mut payload);
    check_momentum(asked, contact, &payload, &first, &forces)
}

/// Forces on the nodes, a list for each part of the window.
struct Forces(Vec<Vec<f64>>);

impl Forces {
    fn of(asked: &Asked, answer: &[f64]) -> Self {
        let layout = &asked.side.layout;
        let means = layout.sample(name::FORCE, Sampling::Means, 0).is_some();
        let sampling = if means { Sampling::Means } else { Sampling::AtEnds };
        let parts = (0..).map_while(|part| layout.sample(name::FORCE, sampling, part));
        let count = layout.fields().find(|f| f.name == name::FORCE && f.sampling == sampling);
        let count = count.map_or(0, |field| field.sample_count());
        Self(parts.take(count).map(|place| answer[place].to_vec()).collect())
    }

    /// Mean over the window.
    fn mean(&self) -> Vec<f64> {
        let nodes = self.0.first().map_or(0, Vec::len);
        (0..nodes).map(|i| self.0.iter().map(|part| part[i]).sum::<f64>() / self.0.len() as f64).collect()
    }

    fn size(&self) -> f64 {
        self.0.iter().flatten().map(|f| f * f).sum::<f64>().sqrt()
    }
}

/// Places of the samples of a field of the request, from the window's start on.
fn samples(side: &Side, what: &str) -> Vec<Range<usize>> {
    let fields = side.request.fields().find(|f| f.name == what && f.sampling == Sampling::FromStart);
    let count = fields.map_or(0, |field| field.sample_count());
    (0..count).filter_map(|i| side.request.sample(what, Sampling::FromStart, i)).collect()
}

/// The mesh stays where it is.
pub(crate) fn hold_still(side: &Side, payload: &mut [f64]) {
    let displacement = samples(side, name::DISPLACEMENT);
    for place in displacement.iter().skip(1) {
        payload.copy_within(displacement[0].clone(), place.start);
    }
    samples(side, name::VELOCITY).into_iter().for_each(|place| payload[place].fill(0.0));
}

/// The bodies' path is the integral of their velocity over the window, and half of a window is not the whole.
fn check_clock(asked: &mut Asked, bodies: &Bodies, first: &[f64], half: &[f64]) -> Result<(), Failure> {
    if bodies.is_empty() {
        asked.unknown(clause::VELOCITY, "there are no gauges NAME_x and NAME_vx of a body's motion");
        return Ok(());
    }
    let (length, gauges) = (asked.span.length, asked.side.layout.gauges());
    let [x0, v0] = bodies.read(asked.gauges);
    let [x1, v1] = bodies.read(&first[gauges.clone()]);
    let [xh, vh] = bodies.read(&half[gauges]);
    let sum = |of: &dyn Fn(usize) -> f64| (0..x0.len()).map(of).sum::<f64>();
    let gone = |i: usize| x1[i] - x0[i];
    let way = |i: usize| length * (v0[i] + 4.0 * vh[i] + v1[i]) / 6.0;
    let norm = |of: &dyn Fn(usize) -> f64| sum(&|i| of(i) * of(i)).sqrt();
    let (went, ways) = (norm(&gone), norm(&way));
    let bend = norm(&|i| length * (v1[i] - v0[i])) + norm(&|i| length * (vh[i] - v0[i]));
    let rounding = 1e-9 + 8.0 * f64::EPSILON * norm(&|i| x0[i]);
    let share =
        |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| sum(&|i| a(i) * b(i)) / sum(&|i| b(i) * b(i));
    let of_way = share(&|i| xh[i] - x0[i], &gone);
    let of_speed = share(&|i| vh[i] - v0[i], &|i| v1[i] - v0[i]);
    let same = |share: f64| (share - 1.0).abs() < 0.05;
    if went > rounding && same(of_way) && (same(of_speed) || of_speed.is_nan()) {
        let what = format!(
            "its bodies go {went:.4e} m in a window of {length:e} s and as far in half of it ({of_way:.3} times): the length of the \
             window is not used"
        );
        return Err(asked.breach(clause::LENGTH, what));
    }
    let apart = norm(&|i| gone(i) - way(i));
    if went < STUCK * ways && apart > bend + rounding {
        let what = format!(
            "its bodies go {went:.4e} m in a window of {length:e} s from where they were accepted, their velocities integrate to {ways:.4e} m: it \
             does not commit what was accepted"
        );
        return Err(asked.breach(clause::COMMIT, what));
    }
    if apart > MOST_APART * ways + bend + rounding {
        let what = format!(
            "its bodies go {went:.4e} m in a window of {length:e} s, their velocities integrate to {ways:.4e} m: {:.3} times as far; does its \
             clock run as the window says?",
            share(&gone, &way)
        );
        return Err(asked.breach(clause::VELOCITY, what));
    }
    asked.kept(
        clause::VELOCITY,
        format!("bodies go {went:.4e} m, their velocities integrate to {ways:.4e} m"),
    );
    let shown = format!("half a window takes bodies {of_way:.3} times as far as a whole one");
    asked.kept_if(went > rounding, clause::LENGTH, shown);
    Ok(())
}

/// Of a solver that tells of no motion: half a window on a mesh that stands still is not the whole, where kinetic energy changes.
fn check_length(asked: &mut Asked, long: &[f64], short: &[f64]) -> Result<(), Failure> {
    let (account, gauges) = (&asked.side.account, asked.side.layout.gauges());
    let changes = account.energies(&long[gauges]).kinetic != account.energies(asked.gauges).kinetic;
    if long != short {
        asked.kept(clause::LENGTH, "half a window has another answer than the whole");
        return Ok(());
    }
    if !changes {
        asked.unknown(clause::LENGTH, "nothing is known to move in a window");
        return Ok(());
    }
    let what = format!(
        "what moves in a window of {:e} s has the same answer in half of it: the length of the window is not used",
        asked.span.length
    );
    Err(asked.breach(clause::LENGTH, what))
}

/// The mesh is moved against the force until that changes: it must grow, and do the work that is received.
fn check_push(
    asked: &mut Asked,
    motion: &mut dyn FnMut(f64, &mut [f64]),
    forces: &Forces,
    repeats: f64,
    largest: &Cell<f64>,
) -> Result<(), Failure> {
    let (length, mean) = (asked.span.length, forces.mean());
    let size = mean.iter().map(|f| f * f).sum::<f64>().sqrt();
    largest.set(largest.get().max(size));
    let most = mean.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
    let places = samples(asked.side, name::DISPLACEMENT);
    let speeds = samples(asked.side, name::VELOCITY);
    let parts = (places.len() - 1) as f64;
    let mut along_motion = None;
    for distance in (0..TIMES).map(|times| MOVE * 10_f64.powi(times)) {
        let step: Vec<f64> = mean.iter().map(|f| -distance * f / most).collect();
        let mut booked = Vec::new();
        let answer = asked.solve(length, &mut |to| {
            motion(length, to);
            for (part, place) in places.iter().enumerate() {
                let share = part as f64 / parts;
                to[place.clone()].iter_mut().zip(&step).for_each(|(u, step)| *u += share * step);
            }
            for place in speeds.iter().skip(1) {
                to[place.clone()].iter_mut().zip(&step).for_each(|(v, step)| *v += step / length);
            }
            booked = places.iter().map(|place| to[place.clone()].to_vec()).collect();
        })?;
        let Some(answer) = answer else { break };
        let pushed = Forces::of(asked, &answer);
        check_work(asked, &booked, &pushed, &answer)?;
        let change: Vec<f64> = pushed.mean().iter().zip(&mean).map(|(a, b)| a - b).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let norm = |a: &[f64]| dot(a, a).sqrt();
        if norm(&change) <= (10.0 * repeats).max(SEEN) * norm(&mean) {
            continue;
        }
        let along = dot(&change, &step) / (norm(&change) * norm(&step));
        let [before, after] = [norm(&mean), norm(&pushed.mean())];
        let numbers = format!(
            "the mesh goes {distance:e} m against a force of {before:.4e} N, which becomes {after:.4e} N"
        );
        // A contact that opens beside the others, or goes to the next sphere, jumps: a longer motion decides.
        if along > 0.2 {
            along_motion.get_or_insert(numbers);
            continue;
        }
        asked.kept_if(along < -0.2, clause::REACTION, numbers);
        return Ok(());
    }
    if let Some(numbers) = along_motion.filter(|_| size > ENDING * largest.get()) {
        let what = format!("{numbers}, and changes along the motion: contact must push back");
        return Err(asked.breach(clause::REACTION, what));
    }
    asked.unknown(clause::REACTION, "its force does not change with the motion of the mesh");
    Ok(())
}

/// The work that it received is that of the mean force on the mesh as it was moved.
fn check_work(
    asked: &mut Asked,
    motion: &[Vec<f64>],
    forces: &Forces,
    answer: &[f64],
) -> Result<(), Failure> {
    let side = asked.side;
    let means = side.layout.sample(name::FORCE, Sampling::Means, 0).is_some();
    if !side.account.receives || !means {
        let why = "no gauge gives the work that it received, or it gives no mean force";
        asked.unknown(clause::FORCE, why);
        return Ok(());
    }
    let (mut booked, mut size) = (0.0, 0.0);
    for (force, ends) in forces.0.iter().zip(motion.windows(2)) {
        for ((f, u0), u1) in force.iter().zip(&ends[0]).zip(&ends[1]) {
            booked -= f * (u1 - u0);
            size += (f * (u1 - u0)).abs();
        }
    }
    let received = side.account.energies(&answer[side.layout.gauges()]).received;
    let before = side.account.energies(asked.gauges).received;
    let (received, rounding) = (received - before, 1e-12 * before.abs() + 1e-15);
    let numbers =
        format!("forces on the mesh do {booked:.4e} J on it, it says that it received {received:.4e} J");
    if (booked - received).abs() > MOST_WORK_APART * size + rounding {
        return Err(asked.breach(clause::FORCE, numbers));
    }
    asked.kept(clause::FORCE, numbers);
    Ok(())
}

/// What pushes the mesh is pushed itself, about the same line.
fn check_momentum(
    asked: &mut Asked,
    contact: &Contact,
    request: &[f64],
    answer: &[f64],
    forces: &Forces,
) -> Result<(), Failure> {
    let unknown =
        "no single body gives place, velocity and kinetic energy, and flew without spin before it touched";
    let Some(body) = contact.bodies.single(asked.gauges).filter(|_| contact.momentum) else {
        asked.unknown(clause::REACTION, format!("momentum: {unknown}"));
        return Ok(());
    };
    let (length, mean) = (asked.span.length, forces.mean());
    let (nodes, _) = mean.as_chunks::<3>();
    let impulse: [f64; 3] = std::array::from_fn(|c| length * nodes.iter().map(|f| f[c]).sum::<f64>());
    let gauges = &answer[asked.side.layout.gauges()];
    let [_, velocity] = contact.bodies.read(gauges);
    let lost: [f64; 3] =
        std::array::from_fn(|c| body.mass * (body.velocity[c] + length * body.flight[c] - velocity[c]));
    let norm = |a: [f64; 3]| a.iter().map(|a| a * a).sum::<f64>().sqrt();
    let (given, taken) = (norm(impulse), norm(lost));
    let apart = norm(std::array::from_fn(|c| impulse[c] - lost[c]));
    let numbers = format!(
        "its forces give the mesh {given:.4e} N s, its body of {:.4e} kg loses {taken:.4e} N s",
        body.mass
    );
    // At the very first touch there is little to compare.
    let much = given.max(taken) > 0.1 * body.mass * length * norm(body.flight);
    if much && apart > MOST_IMPULSE_APART * given.max(taken) {
        return Err(asked.breach(clause::REACTION, numbers));
    }
    asked.kept_if(much, clause::REACTION, numbers);
    let spins = contact.bodies.spins(gauges).iter().any(|w| *w != 0.0);
    if spins || !body.tells_spin {
        let why = "moment: its body spins, or gives no spin";
        asked.unknown(clause::REACTION, why);
        return Ok(());
    }
    let (mut moment, mut lever) = ([0.0; 3], 0.0);
    let moved = samples(asked.side, name::DISPLACEMENT).pop().map_or(&[][..], |place| &request[place]);
    let nodes = nodes.iter().zip(contact.coordinates.as_chunks::<3>().0).zip(moved.as_chunks::<3>().0);
    for ((force, place), u) in nodes {
        let arm: [f64; 3] = std::array::from_fn(|c| place[c] + u[c] - body.place[c]);
        let turned = |a: usize, b: usize| arm[a] * force[b] - arm[b] * force[a];
        [turned(1, 2), turned(2, 0), turned(0, 1)].iter().zip(&mut moment).for_each(|(m, sum)| *sum += m);
        lever += norm(arm) * norm(*force);
    }
    let numbers = format!("its forces turn its body by {:.4e} N m, and it does not spin", norm(moment));
    if norm(moment) > MOST_IMPULSE_APART * lever {
        return Err(asked
            .breach(clause::REACTION, format!("{numbers}: forces of {lever:.4e} N m on the wrong nodes?")));
    }
    asked.kept(clause::REACTION, numbers);
    Ok(())
}
