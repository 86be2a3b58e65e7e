//! Four windows that do not count, asked of a structure before the first that does: a short one at rest, the same under a force,
//! half of it, and the second once more. What comes back shows what the structure does with a committed state, a length, a force,
//! its masses and its held nodes. A solver that keeps the contract is left as it was.

use super::{breach, clause};
use crate::side::Side;
use interface_defs::{
    Command, Failure, InterfaceMesh, Participant, Request, RequestHeader, Sampling, Status, name,
};

/// The probe's window, as a part of the scene's, and at most [s]: so short that springs and dampers have no part in what a force does.
const PART: f64 = 1e-2;
const LONGEST: f64 = 1e-6;
/// Force per mass, in each direction [m/s2].
const PUSH: f64 = 100.0;
/// Largest deviation of a response from what mass, force and length make it.
const LOOSE: f64 = 0.1;
/// Smallest share of the push that is taken for a response: supports may hold a node in some directions.
const FREE: f64 = 1e-2;

/// A structure that is probed.
struct Probe<'a> {
    fem: &'a mut dyn Participant,
    side: &'a Side,
    mesh: &'a InterfaceMesh,
    /// Length of the probe's windows, and of the scene's [s].
    length: f64,
    window: f64,
    asked: u32,
}

/// Where displacement and velocity at the end of a window lie in an answer.
fn ends(side: &Side, what: &str) -> std::ops::Range<usize> {
    side.layout.last(what, Sampling::AtEnds).expect("chosen for every structure")
}

/// Probe the structure `fem` of a run with windows of `window` [s].
pub fn probe(
    fem: &mut dyn Participant,
    side: &Side,
    mesh: &InterfaceMesh,
    window: f64,
) -> Result<(), Failure> {
    let Some(repeats) = side.hello.repeats else { return Ok(()) };
    let started = std::time::Instant::now();
    let mut probe = Probe { fem, side, mesh, length: (PART * window).min(LONGEST), window, asked: 0 };
    let length = probe.length;
    let Some(rest) = probe.solve(length, 0.0)? else { return Ok(()) };
    let Some(pushed) = probe.solve(length, 1.0)? else { return Ok(()) };
    let Some(half) = probe.solve(0.5 * length, 1.0)? else { return Ok(()) };
    let Some(again) = probe.solve(length, 1.0)? else { return Ok(()) };
    tracing::debug!("{} was examined in {:.0} us", probe.fem.name(), 1e6 * started.elapsed().as_secs_f64());
    probe.check_start(&rest)?;
    probe.check_repetition([&rest, &pushed, &again], repeats)?;
    probe.check_held(&rest, &pushed)?;
    probe.check_response(&rest, &pushed, &half)
}

impl Probe<'_> {
    /// Displacement in an answer.
    fn u<'n>(&self, answer: &'n [f64]) -> &'n [f64] {
        &answer[ends(self.side, name::DISPLACEMENT)]
    }

    /// Velocity in an answer.
    fn v<'n>(&self, answer: &'n [f64]) -> &'n [f64] {
        &answer[ends(self.side, name::VELOCITY)]
    }

    /// Velocity that the push makes [m/s].
    fn push(&self) -> f64 {
        PUSH * self.length
    }

    /// Force on a component of a node [N].
    fn force(&self, node: usize) -> f64 {
        let finite = |m: &&f64| m.is_finite();
        let mass = match self.mesh.masses.get(node) {
            Some(mass) if mass.is_finite() => *mass,
            _ => self.mesh.masses.iter().filter(finite).fold(0.0, |a: f64, b| a.max(*b)),
        };
        let mass = if mass > 0.0 { mass } else { 1.0 };
        mass * PUSH
    }

    /// Solve a window of `length` [s] under `times` the force. `None`: it cannot be done, and nothing is known.
    fn solve(&mut self, length: f64, times: f64) -> Result<Option<Vec<f64>>, Failure> {
        self.asked += 1;
        let header = RequestHeader {
            window: 1,
            iteration: self.asked,
            command: Command::Solve as u32,
            length,
            ..Default::default()
        };
        let request =
            Request { header, sends: self.side.request.len(), expects: Some(self.side.layout.len()) };
        let forces: Vec<f64> = (0..3 * self.mesh.node_count()).map(|i| times * self.force(i / 3)).collect();
        let layout = &self.side.request;
        self.fem.send(request, &mut |payload| {
            payload.fill(0.0);
            for field in layout.fields().filter(|field| field.name == name::FORCE) {
                let samples = 0..field.sample_count();
                for place in samples.filter_map(|i| layout.sample(name::FORCE, field.sampling, i)) {
                    payload[place].copy_from_slice(&forces);
                }
            }
        })?;
        if self.fem.receive()? != Status::Done {
            let fault = self.fem.explain()?;
            tracing::info!("{} is not examined: {fault}", self.fem.name());
            return Ok(None);
        }
        Ok(Some(self.fem.answer().to_vec()).filter(|answer| answer.iter().all(|x| x.is_finite())))
    }

    fn breach(&self, clause: &str, what: impl AsRef<str>) -> Failure {
        breach(self.fem.name(), clause, what)
    }

    /// A short window begins where the answer at t = 0 stands.
    fn check_start(&self, rest: &[f64]) -> Result<(), Failure> {
        let (u0, v0) = (self.u(&self.side.initial), self.v(&self.side.initial));
        let (u, v) = (self.u(rest), self.v(rest));
        let straight = |i: usize| 0.5 * self.length * (v[i] + v0[i]);
        let gone = |i: usize| u[i] - u0[i];
        let sum = |of: &dyn Fn(usize) -> f64| (0..u0.len()).map(of).sum::<f64>();
        let times = sum(&|i| gone(i) * straight(i)) / sum(&|i| straight(i) * straight(i));
        if (times * self.length / self.window - 1.0).abs() < LOOSE {
            let what =
                format!("a window of {:e} s takes it {times:.1} times as far as its velocity", self.length);
            return Err(self.breach(clause::LENGTH, what));
        }
        for (i, (u, v)) in u.iter().zip(v).enumerate() {
            let most =
                4.0 * self.length * (v - v0[i]).abs() + 1e-9 * (1.0 + u.abs()) + LOOSE * straight(i).abs();
            if (gone(i) - straight(i)).abs() > most {
                let (u0, node, component, length) = (u0[i], i / 3, i % 3, self.length);
                let what = format!(
                    "its answer at t = 0 has displacement {u0:e} m of node {node}, component {component}, and a window of \
                     {length:e} s from there ends at {u:e} m with the velocity {v:e} m/s"
                );
                return Err(self.breach(clause::INITIAL, what));
            }
        }
        Ok(())
    }

    /// The same window again, after another one, has the same answer.
    fn check_repetition(&self, [rest, first, again]: [&[f64]; 3], repeats: f64) -> Result<(), Failure> {
        let size = |numbers: &[f64]| numbers.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let mut worst: (f64, String) = (0.0, String::new());
        let places = [name::DISPLACEMENT, name::VELOCITY].map(|what| (ends(self.side, what), what));
        for (place, what) in places.into_iter().chain([(self.side.layout.gauges(), "gauges")]) {
            let (a, b) = (&first[place.clone()], &again[place]);
            let apart = a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            let share = if apart == 0.0 { 0.0 } else { apart / size(a).max(size(b)) };
            if share > worst.0 {
                worst = (share, what.to_string());
            }
        }
        let (share, what) = worst;
        if share <= repeats {
            return Ok(());
        }
        let numbers = format!(
            "one window solved twice, with another one between, has {what} that differ by {share:.1e} of their size"
        );
        let apart = |a, b| -> f64 { self.v(a).iter().zip(self.v(b)).map(|(a, b)| (a - b).abs()).sum() };
        if apart(first, again) > LOOSE * apart(first, rest) {
            let what = format!("{numbers}: a solve does not start from the committed state");
            return Err(self.breach(clause::COMMITTED, what));
        }
        let says = if repeats == 0.0 { "equal bytes".to_string() } else { format!("{repeats:e}") };
        Err(self.breach(clause::REPEATS, format!("{numbers}, Hello.repeats promises {says}")))
    }

    /// A node of infinite mass moves as it does whatever pushes it.
    fn check_held(&self, rest: &[f64], pushed: &[f64]) -> Result<(), Failure> {
        for (node, _) in self.mesh.masses.iter().enumerate().filter(|(_, mass)| mass.is_infinite()) {
            let at = 3 * node..3 * node + 3;
            let (free, loaded) = (&self.v(rest)[at.clone()], &self.v(pushed)[at]);
            let gained = free.iter().zip(loaded).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            if gained > FREE * self.push() {
                let (force, length) = (self.force(node), self.length);
                let what = format!(
                    "node {node} has infinite mass in its mesh, and {force:e} N over {length:e} s make it {gained:.3e} m/s faster"
                );
                return Err(self.breach(clause::HELD, what));
            }
        }
        Ok(())
    }

    /// Force, mass and length make the velocity.
    fn check_response(&self, rest: &[f64], pushed: &[f64], half: &[f64]) -> Result<(), Failure> {
        let free = |i: &usize| self.mesh.masses.get(i / 3).is_none_or(|mass| mass.is_finite());
        let gain = |answer, i: usize| self.v(answer)[i] - self.v(rest)[i];
        let gone = |answer, i: usize| self.u(answer)[i] - self.u(rest)[i];
        let numbers = || (0..self.v(rest).len()).filter(free);
        let sum = |of: &dyn Fn(usize) -> f64| numbers().map(of).sum::<f64>();
        let (whole, shorter) = (sum(&|i| gain(pushed, i).abs()), sum(&|i| gain(half, i).abs()));
        let went = sum(&|i| gone(pushed, i).abs());
        let count = numbers().count() as f64;
        if went > LOOSE * FREE * self.length * self.push() * count
            && whole <= FREE * FREE * went / self.length
        {
            let (length, went, gained) = (self.length, went / count, whole / count);
            let what = format!(
                "a force of {length:e} s moves its nodes by {went:.3e} m and gives them no velocity ({gained:.1e} m/s), on average"
            );
            return Err(self.breach(clause::VELOCITY, what));
        }
        if whole <= FREE * FREE * self.push() * count {
            // Nothing can be pushed here.
            return Ok(());
        }
        let ratio = shorter / whole;
        // A structure without inertia.
        if (ratio - 2.0).abs() < LOOSE {
            return Ok(());
        }
        if (ratio - 1.0).abs() < LOOSE {
            let what = format!(
                "the same force makes the same velocity in {:e} s as in half of it ({ratio:.3} times): the length of the window is \
                 not used",
                self.length
            );
            return Err(self.breach(clause::LENGTH, what));
        }
        self.check_samples(rest, pushed)?;
        self.check_work(pushed)?;
        self.check_masses(rest, pushed)
    }

    /// Under a constant force velocity grows from sample to sample.
    fn check_samples(&self, rest: &[f64], pushed: &[f64]) -> Result<(), Failure> {
        let first = self.side.layout.sample(name::VELOCITY, Sampling::AtEnds, 0);
        let (first, last) = (first.expect("chosen for every structure"), ends(self.side, name::VELOCITY));
        let gain = |place: &std::ops::Range<usize>| -> f64 {
            let pairs = pushed[place.clone()].iter().zip(&rest[place.clone()]);
            pairs.map(|(a, b)| (a - b).abs()).sum()
        };
        let share = gain(&first) / gain(&last);
        if first == last || share < 1.0 - LOOSE {
            return Ok(());
        }
        let what = format!(
            "under a constant force its first sample of velocity has {share:.3} of what the last has: samples are those at the \
             ends of equal parts of the window"
        );
        Err(self.breach(clause::SAMPLES, what))
    }

    /// The work of the push is what it says it received.
    fn check_work(&self, pushed: &[f64]) -> Result<(), Failure> {
        let side = self.side;
        if !side.account.receives {
            return Ok(());
        }
        let gone = self.u(pushed).iter().zip(self.u(&side.initial));
        let work: f64 = gone.enumerate().map(|(i, (u, u0))| self.force(i / 3) * (u - u0)).sum();
        let received =
            side.account.energies(&pushed[side.layout.gauges()]).received - side.account.start.received;
        let share = received / work;
        if self.believes(share) || work.abs() < f64::MIN_POSITIVE {
            return Ok(());
        }
        let what = format!(
            "forces that do {work:.3e} J on its nodes in {:e} s are received as {received:.3e} J: it takes {share:.3} times the force",
            self.length
        );
        Err(self.breach(clause::FORCE, what))
    }

    /// A structure that takes the force at the ends of windows may let it rise from nothing.
    fn believes(&self, share: f64) -> bool {
        let means = self.side.request.sample(name::FORCE, Sampling::Means, 0).is_some();
        let least = if means { 1.0 - LOOSE } else { 0.5 - LOOSE };
        (least..=1.0 + LOOSE).contains(&share)
    }

    fn check_masses(&self, rest: &[f64], pushed: &[f64]) -> Result<(), Failure> {
        let (v, v0) = (self.v(pushed), self.v(rest));
        for (node, mass) in self.mesh.masses.iter().enumerate().filter(|(_, mass)| mass.is_finite()) {
            let gained = (3 * node..3 * node + 3)
                .map(|i| v[i] - v0[i])
                .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
            let share = gained / self.push();
            if share.abs() > FREE && !self.believes(share) {
                let (force, length, shown) = (self.force(node), self.length, mass / share);
                let what = format!(
                    "node {node} has {mass:e} kg in its mesh, and {force:e} N over {length:e} s make it {gained:.3e} m/s faster: as \
                     {shown:.3e} kg"
                );
                return Err(self.breach(clause::MASSES, what));
            }
        }
        Ok(())
    }
}
