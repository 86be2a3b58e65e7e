//! What a structure does with windows that do not count: a short one at rest, the same under a force, half of it, under a force of
//! another sign at each node, and the second once more. What comes back shows what it does with a committed state, a length, a force,
//! its masses and its held nodes. A solver that keeps the contract is left as it was.

use super::asked::Asked;
use super::{Outcome, clause};
use crate::side::Side;
use interface_defs::{Failure, InterfaceMesh, Sampling, name};

/// What is looked at.
const EXAMINED: [&str; 8] = [
    clause::SAMPLES,
    clause::INITIAL,
    clause::COMMITTED,
    clause::LENGTH,
    clause::REPEATS,
    clause::HELD,
    clause::MASSES,
    clause::FORCE,
];
/// The examination's window, as a part of the scene's, and at most [s]: so short that springs and dampers have no part in what a force does.
const PART: f64 = 1e-2;
const LONGEST: f64 = 1e-6;
/// Force per mass, in each direction [m/s2]; in a window more, if it is no more than what moves the structure anyway.
const PUSH: f64 = 100.0;
/// Largest deviation of a response from what mass, force and length make it.
const LOOSE: f64 = 0.1;
/// The same of a way from what its velocity makes it.
const CLOCK: f64 = 0.02;
/// Smallest share of the push that is taken for a response: supports may hold a node in some directions.
const FREE: f64 = 1e-2;
/// A step that begins with half a kick, or with two, looks like this, or nearer to 1; from eight steps on it does not.
const KICKS: std::ops::RangeInclusive<f64> = 0.45..=2.1;
/// Windows of the scene over which masses are measured then, each by what it has more than half of it, and how near to that of one step
/// a mass is that is wrong.
const SOME: [f64; 3] = [2.0, 4.0, 8.0];
const WRONG: f64 = 0.15;

/// A structure that is examined.
struct Structure<'s, 'e, 'a> {
    asked: &'s mut Asked<'e, 'a>,
    mesh: &'s InterfaceMesh,
    /// Committed displacement and velocity, in the mesh's order.
    committed: (&'s [f64], &'s [f64]),
    length: f64,
    /// Force per mass [m/s2].
    push: f64,
}

/// Where displacement and velocity at the end of a window lie in an answer.
fn ends(side: &Side, what: &str) -> std::ops::Range<usize> {
    side.layout.last(what, Sampling::AtEnds).expect("chosen for every structure")
}

/// A sign for each number of the mesh, none of which follows from its neighbours.
fn sign(i: usize) -> f64 {
    let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    if (mixed >> 40).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// Examine a structure, with what it has committed.
pub(crate) fn examine_structure(
    asked: &mut Asked,
    mesh: &InterfaceMesh,
    committed: (&[f64], &[f64]),
) -> Result<(), Failure> {
    let Some(repeats) = asked.repeats(&EXAMINED) else { return Ok(()) };
    let length = (PART * asked.span.length).min(LONGEST);
    let mut it = Structure { asked, mesh, committed, length, push: PUSH };
    let Some(rest) = it.solve(length, &|_| 0.0)? else { return Ok(()) };
    let faster = it.v(&rest).iter().zip(committed.1).fold(0.0, |most: f64, (v, v0)| most.max((v - v0).abs()));
    it.push = it.push.max(faster / length);
    let Some(pushed) = it.solve(length, &|_| 1.0)? else { return Ok(()) };
    let Some(half) = it.solve(0.5 * length, &|_| 1.0)? else { return Ok(()) };
    let Some(half_rest) = it.solve(0.5 * length, &|_| 0.0)? else { return Ok(()) };
    let Some(mixed) = it.solve(length, &sign)? else { return Ok(()) };
    let Some(again) = it.solve(length, &|_| 1.0)? else { return Ok(()) };
    it.asked.check_repetition([&rest, &pushed, &again], repeats)?;
    it.check_start(&rest)?;
    it.check_held(&rest, &pushed)?;
    let fastest = it.v(&rest).iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    if repeats * fastest > 0.1 * LOOSE * it.push() {
        let why = "what a short force does is less than what repeated windows differ by";
        for clause in [clause::SAMPLES, clause::LENGTH, clause::MASSES, clause::FORCE] {
            it.asked.unknown(clause, why);
        }
        return Ok(());
    }
    it.check_response([&rest, &pushed, &half_rest, &half, &mixed])
}

/// Two windows one after the other go where one of twice the length goes, of what `watched` finds in an answer; the first is committed.
pub(crate) fn add_windows(
    asked: &mut Asked,
    fill: &mut dyn FnMut(f64, &mut [f64]),
    watched: &dyn Fn(&[f64]) -> Vec<f64>,
    start: &[f64],
) -> Result<(), Failure> {
    // Who cannot go back has the first window behind it before the other two begin.
    if asked.repeats(&[clause::COMMIT]).is_none() {
        return Ok(());
    }
    let length = asked.span.length;
    let mut ask = |asked: &mut Asked, length| {
        asked.solve(length, &mut |to| fill(length, to)).map(|answer| answer.map(|answer| watched(&answer)))
    };
    let Some(whole) = ask(asked, 2.0 * length)? else { return Ok(()) };
    asked.iteration = 2;
    let Some(first) = ask(asked, length)? else { return Ok(()) };
    asked.iteration = 1;
    // Of several solves the last one is committed.
    asked.slot.commit_due = true;
    asked.span.start += length;
    let Some(second) = ask(asked, length)? else { return Ok(()) };
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    let (off, went, halfway) = (apart(&whole, &second), apart(&whole, start), apart(&whole, &first));
    let numbers = format!(
        "two windows of {length:e} s end {off:.3e} from where one of twice the length ends, which goes {went:.3e} (displacements and \
         velocities)"
    );
    let size: f64 = whole.iter().map(|x| x * x).sum::<f64>().sqrt();
    if went <= 1e-9 * size {
        asked.unknown(clause::COMMIT, "nothing moves");
        return Ok(());
    }
    if off > 0.25 * went.max(halfway) {
        return Err(asked.breach(clause::COMMIT, numbers));
    }
    asked.kept(clause::COMMIT, numbers);
    Ok(())
}

impl Structure<'_, '_, '_> {
    /// Displacement in an answer.
    fn u<'n>(&self, answer: &'n [f64]) -> &'n [f64] {
        &answer[ends(self.asked.side, name::DISPLACEMENT)]
    }

    /// Velocity in an answer.
    fn v<'n>(&self, answer: &'n [f64]) -> &'n [f64] {
        &answer[ends(self.asked.side, name::VELOCITY)]
    }

    /// Velocity that the push makes [m/s].
    fn push(&self) -> f64 {
        self.push * self.length
    }

    /// Force on a component of a node [N].
    fn force(&self, node: usize) -> f64 {
        let finite = |m: &&f64| m.is_finite();
        let mass = match self.mesh.masses.get(node) {
            Some(mass) if mass.is_finite() => *mass,
            _ => self.mesh.masses.iter().filter(finite).fold(0.0, |a: f64, b| a.max(*b)),
        };
        let mass = if mass > 0.0 { mass } else { 1.0 };
        mass * self.push
    }

    /// Solve a window of `length` [s] under the push, at each number of the mesh so many times.
    fn solve(&mut self, length: f64, times: &dyn Fn(usize) -> f64) -> Result<Option<Vec<f64>>, Failure> {
        let forces: Vec<f64> =
            (0..3 * self.mesh.node_count()).map(|i| times(i) * self.force(i / 3)).collect();
        let layout = &self.asked.side.request;
        self.asked.solve(length, &mut |payload| {
            for field in layout.fields().filter(|field| field.name == name::FORCE) {
                let samples = 0..field.sample_count();
                for place in samples.filter_map(|i| layout.sample(name::FORCE, field.sampling, i)) {
                    payload[place].copy_from_slice(&forces);
                }
            }
        })
    }

    /// A short window begins where the committed state stands, and goes where its velocity says.
    fn check_start(&mut self, rest: &[f64]) -> Result<(), Failure> {
        let (u0, v0) = self.committed;
        let (u, v) = (self.u(rest), self.v(rest));
        let (length, start) = (self.length, self.asked.span.start);
        let straight = |i: usize| 0.5 * length * (v[i] + v0[i]);
        let gone = |i: usize| u[i] - u0[i];
        let sum = |of: &dyn Fn(usize) -> f64| (0..u0.len()).map(of).sum::<f64>();
        let times = sum(&|i| gone(i) * straight(i)) / sum(&|i| straight(i) * straight(i));
        let says = || format!("a window of {length:e} s takes it {times:.3} times as far as its velocity");
        if (times * length / self.asked.span.length - 1.0).abs() < LOOSE {
            return Err(self.asked.breach(clause::LENGTH, says()));
        }
        let bend = sum(&|i| (length * (v[i] - v0[i])).powi(2)) + (1e-15 * sum(&|i| u[i].abs())).powi(2);
        let [way, ways] = [&gone as &dyn Fn(usize) -> f64, &straight].map(|of| sum(&|i| of(i) * of(i)));
        let alike = times * (ways / way).sqrt();
        if (times - 1.0).abs() > CLOCK && bend < 1e-4 * ways && alike > 0.99 {
            let what = format!("{}; is its velocity wrong, or does its clock run at another rate?", says());
            return Err(self.asked.breach(clause::VELOCITY, what));
        }
        for (i, (u, v)) in u.iter().zip(v).enumerate() {
            let most = 4.0 * length * (v - v0[i]).abs() + 1e-9 * (1.0 + u.abs()) + LOOSE * straight(i).abs();
            if (gone(i) - straight(i)).abs() > most {
                let (u0, node, component) = (u0[i], i / 3, i % 3);
                let stands = if start == 0.0 { "its answer at t = 0 has" } else { "its committed state has" };
                let what = format!(
                    "{stands} displacement {u0:.6e} m of node {node}, component {component}, and a window of {length:e} s from there \
                     ends at {u:.6e} m with the velocity {v:.4e} m/s"
                );
                if start == 0.0 {
                    return Err(self.asked.breach(clause::INITIAL, what));
                }
                let what = format!("it does not commit what was accepted: {what}");
                return Err(self.asked.breach(clause::COMMIT, what));
            }
        }
        let shown = format!("a window of {length:e} s begins at the committed state");
        self.asked.kept(if start == 0.0 { clause::INITIAL } else { clause::COMMIT }, shown);
        Ok(())
    }

    /// A node of infinite mass moves as it does whatever pushes it.
    fn check_held(&mut self, rest: &[f64], pushed: &[f64]) -> Result<(), Failure> {
        for (node, _) in self.mesh.masses.iter().enumerate().filter(|(_, mass)| mass.is_infinite()) {
            let at = 3 * node..3 * node + 3;
            let (free, loaded) = (&self.v(rest)[at.clone()], &self.v(pushed)[at]);
            let gained = free.iter().zip(loaded).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            if gained > FREE * self.push() {
                let (force, length) = (self.force(node), self.length);
                let what = format!(
                    "node {node} has infinite mass in its mesh, and {force:e} N over {length:e} s make it {gained:.3e} m/s faster"
                );
                return Err(self.asked.breach(clause::HELD, what));
            }
        }
        let held = self.mesh.masses.iter().filter(|mass| mass.is_infinite()).count();
        self.asked.kept_if(held > 0, clause::HELD, format!("{held} nodes have infinite mass"));
        Ok(())
    }

    /// Force, mass and length make the velocity.
    fn check_response(&mut self, [rest, pushed, half_rest, half, mixed]: [&[f64]; 5]) -> Result<(), Failure> {
        let free = |i: &usize| self.mesh.masses.get(i / 3).is_none_or(|mass| mass.is_finite());
        let numbers: Vec<usize> = (0..self.v(rest).len()).filter(free).collect();
        let gain = |answer, i: usize| self.v(answer)[i] - self.v(rest)[i];
        let gone = |answer, i: usize| self.u(answer)[i] - self.u(rest)[i];
        let sum = |of: &dyn Fn(usize) -> f64| numbers.iter().map(|i| of(*i)).sum::<f64>();
        let (whole, shorter) =
            (sum(&|i| gain(pushed, i).abs()), sum(&|i| (self.v(half)[i] - self.v(half_rest)[i]).abs()));
        let went = sum(&|i| gone(pushed, i).abs());
        let (count, length, push) = (numbers.len() as f64, self.length, self.push());
        if went > LOOSE * FREE * length * push * count && whole <= FREE * FREE * went / length {
            let (went, gained) = (went / count, whole / count);
            let what = format!(
                "a force of {length:e} s moves its nodes by {went:.3e} m and gives them no velocity ({gained:.1e} m/s), on average"
            );
            return Err(self.asked.breach(clause::VELOCITY, what));
        }
        if whole <= FREE * FREE * push * count {
            return self.check_unmoved(&numbers);
        }
        let ratio = shorter / whole;
        if (ratio - 2.0).abs() < LOOSE {
            let why = "half of the window gives twice the velocity: statics, without inertia";
            for clause in [clause::SAMPLES, clause::MASSES, clause::FORCE] {
                self.asked.unknown(clause, why);
            }
            return Ok(());
        }
        if (ratio - 1.0).abs() < LOOSE {
            let what = format!(
                "the same force makes the same velocity in {length:e} s as in half of it ({ratio:.3} times): the length of the window \
                 is not used"
            );
            return Err(self.asked.breach(clause::LENGTH, what));
        }
        // A force on one number of the mesh moves this one most of all.
        let own = sum(&|i| sign(i) * gain(mixed, i) * gain(pushed, i));
        let [a, b] = [pushed, mixed].map(|answer| sum(&|i| gain(answer, i).powi(2)));
        let alike = own / (a * b).sqrt();
        let along = sum(&|i| gain(pushed, i)) / whole;
        self.asked.kept(clause::LENGTH, format!("half of a window makes {ratio:.3} of the velocity"));
        self.check_samples(rest, pushed)?;
        if along < 0.0 || alike.is_nan() || alike < 0.5 {
            let what = format!(
                "forces move its nodes in another direction: as one they follow by {along:.3}, each by itself by {alike:.3} of their \
                 velocity; {}",
                if along < -0.9 {
                    "is the sign of the force turned?"
                } else {
                    "all of the force is taken, once, at its node"
                }
            );
            return Err(self.asked.breach(clause::FORCE, what));
        }
        self.check_work(pushed)?;
        self.check_masses(rest, pushed)
    }

    /// Nothing can be pushed. Nodes that cannot move have infinite mass.
    fn check_unmoved(&mut self, numbers: &[usize]) -> Result<(), Failure> {
        // What takes its time to answer, and what hangs by stiff supports alone, moves in a longer window.
        let length = self.asked.span.length;
        let (rest, pushed) = (self.solve(length, &|_| 0.0)?, self.solve(length, &|_| 1.0)?);
        let (Some(rest), Some(pushed)) = (rest, pushed) else { return Ok(()) };
        if numbers.is_empty() || self.u(&rest) != self.u(&pushed) {
            for clause in [clause::MASSES, clause::FORCE] {
                self.asked.unknown(clause, "all of its nodes are held");
            }
            return Ok(());
        }
        let (node, force) = (numbers[0] / 3, self.force(numbers[0] / 3));
        let what = format!(
            "{force:e} N on each node, as on node {node}, for {length:e} s move nothing: a force is taken, and a node that cannot move has \
             infinite mass"
        );
        Err(self.asked.breach(clause::FORCE, what))
    }

    /// Under a constant force velocity grows from sample to sample.
    fn check_samples(&mut self, rest: &[f64], pushed: &[f64]) -> Result<(), Failure> {
        let first = self.asked.side.layout.sample(name::VELOCITY, Sampling::AtEnds, 0);
        let (first, last) =
            (first.expect("chosen for every structure"), ends(self.asked.side, name::VELOCITY));
        let gain = |place: &std::ops::Range<usize>| -> f64 {
            let pairs = pushed[place.clone()].iter().zip(&rest[place.clone()]);
            pairs.map(|(a, b)| (a - b).abs()).sum()
        };
        let share = gain(&first) / gain(&last);
        if first == last {
            self.asked.unknown(clause::SAMPLES, "the scene has one sample per window");
            return Ok(());
        }
        let what = format!(
            "under a constant force its first sample of velocity has {share:.3} of what the last has"
        );
        if share < 1.0 - LOOSE {
            self.asked.kept(clause::SAMPLES, what);
            return Ok(());
        }
        let what = format!("{what}: samples are those at the ends of equal parts of the window");
        Err(self.asked.breach(clause::SAMPLES, what))
    }

    /// The work of the push is what it says it received.
    fn check_work(&mut self, pushed: &[f64]) -> Result<(), Failure> {
        let side = self.asked.side;
        // From a force at the end of a window before, work is counted as the structure's own scheme has it.
        let means = side.request.sample(name::FORCE, Sampling::Means, 0).is_some();
        if !side.account.receives || (!means && self.asked.span.start > 0.0) {
            self.asked.kept(clause::FORCE, "every node follows its force; no gauge gives the work of it");
            return Ok(());
        }
        let gone = self.u(pushed).iter().zip(self.committed.0);
        let work: f64 = gone.enumerate().map(|(i, (u, u0))| self.force(i / 3) * (u - u0)).sum();
        let before = side.account.energies(self.asked.gauges).received;
        let received = side.account.energies(&pushed[side.layout.gauges()]).received - before;
        let share = received / work;
        let numbers = format!(
            "forces do {work:.3e} J on its nodes in {:e} s, it received {received:.3e} J",
            self.length
        );
        let rounding = 1e-12 * before.abs().max(1e-3);
        if self.believes(share) || (received - work).abs() <= rounding {
            self.asked.kept(clause::FORCE, numbers);
            return Ok(());
        }
        Err(self.asked.breach(clause::FORCE, format!("{numbers}: it takes {share:.3} times the force")))
    }

    /// A structure that takes the force at the ends of windows may let it rise from nothing.
    fn believes(&self, share: f64) -> bool {
        let means = self.asked.side.request.sample(name::FORCE, Sampling::Means, 0).is_some();
        let least = if means { 1.0 - LOOSE } else { 0.5 - LOOSE };
        (least..=1.0 + LOOSE).contains(&share)
    }

    fn check_masses(&mut self, rest: &[f64], pushed: &[f64]) -> Result<(), Failure> {
        let (v, v0) = (self.v(pushed), self.v(rest));
        // Of each node the direction in which it moves most: supports may hold the others.
        let (mut numbers, mut odd) = (Vec::new(), None);
        for (node, mass) in self.mesh.masses.iter().enumerate().filter(|(_, mass)| mass.is_finite()) {
            let gained = |i: &usize| (v[*i] - v0[*i]).abs();
            let most = (3 * node..3 * node + 3).max_by(|a, b| gained(a).total_cmp(&gained(b)));
            let most = most.expect("three directions");
            let share = (v[most] - v0[most]) / self.push();
            if share.abs() <= FREE {
                continue;
            }
            numbers.push((most, *mass));
            if !self.believes(share) && odd.is_none() {
                odd = Some((node, *mass, v[most] - v0[most], share));
            }
        }
        let masses: f64 = numbers.iter().map(|(_, mass)| mass).sum();
        let mean =
            numbers.iter().map(|(i, mass)| mass * (v[*i] - v0[*i])).sum::<f64>() / (masses * self.push());
        if masses == 0.0 {
            self.asked.unknown(clause::MASSES, "it knows no masses, or all of its nodes are held");
            return Ok(());
        }
        let shown = format!("{masses:.4e} kg answer as {:.4e} kg", masses / mean);
        let Some((node, mass, gained, share)) = odd else {
            self.asked.kept(clause::MASSES, shown);
            return Ok(());
        };
        if KICKS.contains(&mean) {
            let Some(shares) = self.long_shares(&numbers, &shown)? else { return Ok(()) };
            // What springs take grows with the square of time.
            let free = |at: usize| shares[at] + (shares[at] - shares[at + 1]) / 3.0;
            let right = [0, 1].into_iter().any(|at| (free(at) - 1.0).abs() <= LOOSE);
            if right || (free(0) / mean - 1.0).abs() > WRONG {
                let what =
                    format!("{shown} in {:e} s, and over more and more windows by {shares:.3?}", self.length);
                self.asked.kept_if(right, clause::MASSES, what);
                return Ok(());
            }
        }
        let (force, length, as_if) = (self.force(node), self.length, mass / share);
        let what = format!(
            "node {node} has {mass:.4e} kg in its mesh, and {force:.4e} N over {length:e} s make it {gained:.3e} m/s faster: as {as_if:.3e} kg"
        );
        Err(self.asked.breach(clause::MASSES, what))
    }

    /// What the push makes of its masses over eight and more steps, by what a window has more than half of it: half a kick at the
    /// start is in both. `None`: such windows cannot be solved.
    fn long_shares(&mut self, numbers: &[(usize, f64)], seen: &str) -> Result<Option<Vec<f64>>, Failure> {
        let window = self.asked.span.length;
        self.push = PUSH;
        let (mut before, mut shares) = (None, Vec::new());
        for length in std::iter::once(1.0).chain(SOME).map(|times| times * window) {
            let too_long = length > self.asked.side.hello.largest_window;
            let mut solve = |kick: f64| if too_long { Ok(None) } else { self.solve(length, &|_| kick) };
            let (Some(rest), Some(pushed)) = (solve(0.0)?, solve(1.0)?) else {
                let most = self.asked.side.hello.largest_window;
                let why = format!(
                    "either its masses are wrong, or its steps begin with half a kick: a window of {length:e} s would show which, and it \
                     takes {most:e} s at most"
                );
                self.asked.note(clause::MASSES, Outcome::Unsettled, format!("{seen}: {why}"));
                return Ok(None);
            };
            let gained = |i: usize| self.v(&pushed)[i] - self.v(&rest)[i];
            let gain: f64 = numbers.iter().map(|(i, mass)| mass * gained(*i)).sum();
            if let Some(half) = before.replace(gain) {
                shares.push((gain - half) / (0.5 * length));
            }
        }
        let push = PUSH * numbers.iter().map(|(_, mass)| mass).sum::<f64>();
        Ok(Some(shares.into_iter().map(|share| share / push).collect()))
    }
}
