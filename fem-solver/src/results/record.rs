//! What is recorded at every step: support reactions, scene gauges, largest values.

use crate::config::{GaugeConfig, Quantity};
use crate::internal_force::assembly::Assembly;
use crate::model::Model;
use crate::read::refuse;
use crate::results::height::Height;
use crate::results::moving_mean::{MovingMean, Sample};
use crate::results::probe::Probe;
use crate::state::{Extreme, Peaks, Range, State};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::message::{Gauge, Measure, Worse};
use toolkit::scene::Scene;

/// Supports whose force is summed: held degrees of freedom, and springs by their feet.
#[derive(Debug, Clone)]
struct Supports {
    held: [Vec<usize>; 3],
    /// Those that let go, with the time until they do.
    until: [Vec<(usize, f64)>; 3],
    springs: [Vec<(usize, f64)>; 3],
}

impl Supports {
    fn of(model: &Model) -> Self {
        let n = model.node_count();
        let springs = model.spring_dofs();
        let until = |dof: usize| model.until.get(dof).copied().filter(|t| t.is_finite()).map(|t| (dof, t));
        Self {
            until: [0, 1, 2].map(|c| (0..n).filter_map(|i| until(model.dof(i, c))).collect()),
            held: [0, 1, 2].map(|c| (0..n).map(|i| model.dof(i, c)).filter(|dof| model.held[*dof]).collect()),
            springs: [0, 1, 2].map(|c| springs.iter().copied().filter(|(dof, _)| dof / n == c).collect()),
        }
    }

    /// Force of the supports on the structure, where `force` is that of load and elements, less the inertia of held nodes that move, in the step with its middle at
    /// `time` [s].
    fn reaction(&self, force: &[f64], u: &[f64], time: f64) -> [f64; 3] {
        [0, 1, 2].map(|c: usize| {
            let held: f64 = self.held[c].iter().map(|dof| force[*dof]).sum();
            let springs: f64 = self.springs[c].iter().map(|(dof, k)| k * u[*dof]).sum();
            let still = self.until[c].iter().filter(|(_, until)| *until > time);
            -(held + springs + still.map(|(dof, _)| force[*dof]).sum::<f64>())
        })
    }
}

/// What a step leaves to be recorded.
pub struct Step<'a> {
    /// Its end [s].
    pub end: f64,
    /// Its length [s].
    pub length: f64,
    /// Force of load and elements, less the inertia of held nodes that move, on every degree of freedom [N]: its mean over the step, in statics that at its end.
    pub force: &'a [f64],
    /// Displacement at which that holds [m].
    pub middle: &'a [f64],
    /// When it does [s].
    pub at: f64,
    /// Largest tension in it [N].
    pub tension: f64,
}

/// Value, smallest and largest of one number.
pub type Triple = [f64; 3];

/// The largest values so far, of a state.
pub struct Largest<'a> {
    /// Of the whole structure.
    pub peaks: &'a mut Peaks,
    /// Of the members of each group.
    pub groups: &'a mut [Range],
}

/// The recorder: gauges of the window at hand, and the impulse of the supports.
pub struct Recorder {
    total: Supports,
    probes: Vec<Probe>,
    /// For each declared gauge the number that it shows.
    slots: Vec<usize>,
    /// Displacement at t = 0 [m].
    origin: Vec<f64>,
    mean: MovingMean,
    /// Impulse of the window: of all supports, then of each probe of force, its sum and its members.
    impulses: Vec<[f64; 3]>,
    reaction: [Triple; 3],
    values: Vec<Triple>,
    elapsed: f64,
    /// In statics reactions are those of a row's end.
    at_end: bool,
    assembly: Assembly,
    line_forces: Vec<f64>,
}

impl Recorder {
    /// The scene's gauges, and the declarations of all numbers in the order of [`Recorder::write`].
    pub fn probes(
        scene: &Scene,
        model: &Model,
        gauges: &[GaugeConfig],
    ) -> Result<(Probes, Vec<Gauge>), Diagnostic> {
        let mut declared: Vec<Gauge> =
            ["x", "y", "z"].iter().map(|c| Gauge::new(format!("reaction_{c}"), "N")).collect();
        let mut probes = Probes { probes: Vec::new(), slots: Vec::new(), count: 0 };
        for (i, gauge) in gauges.iter().enumerate() {
            let key = format!("gauge.{i}");
            let name = &gauge.name;
            let taken = |g: &GaugeConfig| g.name == *name && g.quantity == gauge.quantity;
            if name.is_empty() || gauges[..i].iter().any(taken) {
                let what = format!("the gauge `{name}` needs a name of its own");
                let hint = "its columns in history.csv begin with it, as name = \"middle_2\"";
                return refuse(scene, &format!("{key}.name"), what, hint);
            }
            let of_heights = [
                ("above", gauge.above.is_some()),
                ("posts", gauge.posts.is_some()),
                ("normal", gauge.normal.is_some()),
            ];
            if gauge.quantity != Quantity::Height
                && let Some((word, _)) = of_heights.iter().find(|(_, stated)| *stated)
            {
                let what = format!("`{word}` is for quantity = \"height\", not for the gauge `{name}`");
                return Err(scene.invalid(&format!("{key}.{word}"), what));
            }
            if gauge.group.is_none() == gauge.at.is_none() {
                let what = "a gauge is at a point or of a group: write one of at, group";
                return Err(scene.invalid(&key, what));
            }
            let probe = Probe::of(scene, &key, model, gauge)?;
            for (own, slot) in probe.declared(&gauge.name) {
                if declared.iter().any(|d| d.name == own.name) {
                    let what = format!("two gauges give the column `{}`", own.name);
                    return refuse(scene, &format!("{key}.name"), what, "give this gauge another name");
                }
                declared.push(own);
                probes.slots.push(probes.count + slot);
            }
            probes.count += probe.slots();
            probes.probes.push(probe);
        }
        Ok((probes, declared))
    }

    /// A recorder that starts at t = 0 with the displacements `origin`, where load and elements
    /// leave `force` to the supports; memory for `samples` steps within 1 ms and a window.
    pub fn new(model: &Model, probes: &Probes, origin: &[f64], force: &[f64], samples: usize) -> Self {
        let total = Supports::of(model);
        let at_rest = total.reaction(force, origin, f64::NEG_INFINITY);
        let impulses = |p: &Probe| if matches!(p, Probe::Force(_)) { 1 + p.members() } else { 0 };
        let impulses = 1 + probes.probes.iter().map(impulses).sum::<usize>();
        Self {
            total,
            probes: probes.probes.clone(),
            slots: probes.slots.clone(),
            origin: origin.to_vec(),
            mean: MovingMean::new(at_rest, samples),
            impulses: vec![[0.0; 3]; impulses],
            reaction: [[0.0; 3]; 3],
            values: vec![[0.0; 3]; probes.count],
            elapsed: 0.0,
            at_end: false,
            assembly: Assembly::with_blocks(model),
            line_forces: vec![0.0; model.elements.iter().map(|e| e.line_count()).max().unwrap_or(0)],
        }
    }

    /// The same for statics, where all values of a row are of its end.
    #[must_use]
    pub fn at_end(self, at_end: bool) -> Self {
        Self { at_end, ..self }
    }

    /// Total support reaction at the start [N].
    pub fn total_reaction(&self, force: &[f64], u: &[f64]) -> [f64; 3] {
        self.total.reaction(force, u, f64::NEG_INFINITY)
    }

    /// Smallest and largest of the members of each group, before the first step.
    pub fn groups(&self) -> Vec<Range> {
        vec![Range::default(); self.probes.iter().filter(|p| p.members() > 0).count()]
    }

    /// A window begins.
    pub fn begin(&mut self) {
        self.mean.begin();
        self.impulses.fill([0.0; 3]);
        let nothing = [0.0, f64::INFINITY, f64::NEG_INFINITY];
        self.reaction = [nothing; 3];
        self.values.fill(nothing);
        self.elapsed = 0.0;
    }

    /// A step is done; `state` is at its end.
    pub fn step(&mut self, model: &Model, state: &State, step: &Step, largest: &mut Largest) {
        if self.at_end {
            self.impulses.fill([0.0; 3]);
            self.elapsed = 0.0;
        }
        self.elapsed += step.length;
        let reaction = self.total.reaction(step.force, step.middle, step.end - 0.5 * step.length);
        let impulse = reaction.map(|r| r * step.length);
        add(&mut self.impulses[0], impulse);
        for (triple, r) in self.reaction.iter_mut().zip(reaction) {
            widen(triple, r);
        }
        let peaks = &mut largest.peaks;
        peaks.reaction.take(norm(&reaction), step.at);
        peaks.reaction_1ms.take(self.mean.push(step.end, impulse), step.end - 0.5e-3);
        peaks.cable_force.take(step.tension, step.at);
        if !self.probes.is_empty() {
            self.probe(model, state, step, largest.groups);
        }
    }

    fn probe(&mut self, model: &Model, state: &State, step: &Step, groups: &mut [Range]) {
        let (mut at, mut impulse, mut group) = (0, 1, 0);
        let (assembly, forces) = (&mut self.assembly, &mut self.line_forces);
        for probe in &self.probes {
            let values = &mut self.values[at..at + probe.slots()];
            let members = probe.members();
            match probe {
                Probe::Lines(lines) if members == 0 => {
                    lines.scan(model, state, assembly, forces, |value| record(&mut values[0], value));
                }
                Probe::Lines(lines) => {
                    let mut seen = Extremes::default();
                    lines.scan(model, state, assembly, forces, |value| seen.take(value));
                    record(&mut values[0], seen.smallest.0);
                    record(&mut values[1], seen.largest.0);
                    groups[group].take(&seen, step.end);
                }
                Probe::Height(height) => {
                    height.scan(model, state, |slot, value| record(&mut values[slot], value));
                }
                Probe::Force(feet) => {
                    let (sums, own) = self.impulses[impulse..].split_at_mut(1);
                    let nodes = model.node_count();
                    let (mut sum, mut seen) = ([0.0; 3], Extremes::default());
                    let mut mean = Extremes::default();
                    for (i, foot) in feet.iter().enumerate() {
                        let reaction =
                            foot.reaction(nodes, step.force, step.middle, step.end - 0.5 * step.length);
                        add(&mut sum, reaction);
                        if members > 0 {
                            add(&mut own[i], reaction.map(|r| r * step.length));
                            seen.take(norm(&reaction));
                            mean.take(norm(&own[i]) / self.elapsed);
                        }
                    }
                    add(&mut sums[0], sum.map(|r| r * step.length));
                    for (value, (now, impulse)) in values.iter_mut().zip(sum.iter().zip(&sums[0])) {
                        widen(value, *now);
                        value[0] = impulse / self.elapsed;
                    }
                    if members > 0 {
                        for (value, (now, mean)) in values[3..]
                            .iter_mut()
                            .zip([(seen.smallest.0, mean.smallest.0), (seen.largest.0, mean.largest.0)])
                        {
                            widen(value, now);
                            value[0] = mean;
                        }
                        groups[group].take(&seen, step.at);
                    }
                    impulse += 1 + members;
                }
                Probe::Displacement(nodes) | Probe::Velocity(nodes) => {
                    let share = 1.0 / nodes.len() as f64;
                    for (c, value) in values.iter_mut().enumerate() {
                        let dofs = nodes.iter().map(|node| model.dof(*node, c));
                        let sum: f64 = match probe {
                            Probe::Velocity(_) => dofs.map(|i| state.velocity[i]).sum(),
                            _ => dofs.map(|i| state.displacement[i] - self.origin[i]).sum(),
                        };
                        record(value, share * sum);
                    }
                }
            }
            at += probe.slots();
            group += usize::from(members > 0);
        }
    }

    /// Write the triples of reactions and gauges of the window to `out`.
    pub fn write(&self, out: &mut [f64]) {
        let (triples, _) = out.as_chunks_mut::<3>();
        for (c, (to, triple)) in triples.iter_mut().zip(&self.reaction).enumerate() {
            *to = [self.impulses[0][c] / self.elapsed, triple[1], triple[2]];
        }
        triples[3..].iter_mut().zip(&self.slots).for_each(|(to, slot)| *to = self.values[*slot]);
    }

    /// The window is accepted.
    pub fn commit(&mut self) {
        self.mean.commit();
    }

    /// What it takes from one window to the next, for a run that goes on.
    pub fn kept(&self) -> Vec<Sample> {
        self.mean.kept()
    }

    /// Go on from there.
    pub fn go_on(&mut self, kept: Vec<Sample>) {
        self.mean.go_on(kept);
    }
}

/// What the scene's gauges watch.
pub struct Probes {
    probes: Vec<Probe>,
    slots: Vec<usize>,
    count: usize,
}

impl Probes {
    /// Whether there is a gauge of several members.
    pub fn has_groups(&self) -> bool {
        self.probes.iter().any(|p| p.members() > 0)
    }

    /// Measures of single members and of the run's end at `state`, of the gauges of `configs`, at `time` [s].
    pub fn measures(&self, configs: &[GaugeConfig], model: &Model, state: &State, time: f64) -> Vec<Measure> {
        let mut measures = Vec::new();
        let mut groups = state.groups.iter();
        for (config, probe) in configs.iter().zip(&self.probes) {
            if let Probe::Height(height) = probe {
                height.scan(model, state, |slot, value| {
                    let name = format!("{}_{}_end", config.name, Height::suffix(slot));
                    let measure = Measure::new(name, value, "m").at(time);
                    measures.push(measure.ranked(Measure::ORDINARY, Worse::Smaller));
                });
            }
            let Some(range) = (probe.members() > 0).then(|| groups.next()).flatten() else { continue };
            let (quantity, unit) = probe.quantity();
            let ends = [("min", range.smallest, Worse::Smaller), ("max", range.largest, Worse::Larger)];
            for (end, extreme, worse) in ends.into_iter().filter(|(_, extreme, _)| extreme.value.is_finite())
            {
                let name = format!("{}_{quantity}_{end}", config.name);
                let measure = Measure::new(name, extreme.value, unit).at(extreme.time);
                let member = probe.member_name(model, extreme.member as usize);
                measures.push(measure.of_member(Some(member)).ranked(Measure::ORDINARY, worse));
            }
        }
        measures
    }
}

/// Smallest and largest of the members at one instant: value, and which.
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    smallest: (f64, u32),
    largest: (f64, u32),
    next: u32,
}

impl Default for Extremes {
    fn default() -> Self {
        Self { smallest: (f64::INFINITY, 0), largest: (f64::NEG_INFINITY, 0), next: 0 }
    }
}

impl Extremes {
    /// The next member has this value.
    #[inline]
    fn take(&mut self, value: f64) {
        if value < self.smallest.0 {
            self.smallest = (value, self.next);
        }
        if value > self.largest.0 {
            self.largest = (value, self.next);
        }
        self.next += 1;
    }
}

impl Range {
    fn take(&mut self, seen: &Extremes, time: f64) {
        let extreme = |(value, member)| Extreme { value, member, time };
        if seen.smallest.0 < self.smallest.value {
            self.smallest = extreme(seen.smallest);
        }
        if seen.largest.0 > self.largest.value {
            self.largest = extreme(seen.largest);
        }
    }
}

fn norm(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn add(to: &mut [f64; 3], what: [f64; 3]) {
    to.iter_mut().zip(what).for_each(|(t, w)| *t += w);
}

fn widen(triple: &mut Triple, value: f64) {
    triple[1] = triple[1].min(value);
    triple[2] = triple[2].max(value);
}

fn record(triple: &mut Triple, value: f64) {
    triple[0] = value;
    widen(triple, value);
}
