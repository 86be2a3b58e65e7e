//! Records of every step: support reactions, scene gauges, largest values.
//!
//! A gauge of the scene watches one number, a mean or sum over nodes, or smallest and largest of the members of a group.

use crate::config::structure::Where;
use crate::config::{GaugeConfig, Quantity};
use crate::element::SupportSpring;
use crate::equilibrium::form_finding::Form;
use crate::internal_force::assembly::Assembly;
use crate::model::Model;
use crate::read::Key;
use crate::results::height::Height;
use crate::results::moving_mean::MovingMean;
use crate::state::{Peaks, Range, State};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::message::{Gauge, Measure, Worse};
use nalgebra::Vector3;
use toolkit::scene::Scene;

/// Supports whose force is summed: held degrees of freedom, springs by their feet, and springs that give way.
#[derive(Debug, Clone)]
struct Supports {
    held: [Vec<usize>; 3],
    /// Those that let go, with the time until they do.
    until: [Vec<(usize, f64)>; 3],
    springs: [Vec<(usize, f64)>; 3],
    giving: Vec<Giving>,
    nodes: usize,
}

/// A support that gives way, and where its history begins.
type Giving = (usize, SupportSpring);

/// Force that stretches supports which give way [N].
fn pulls(of: &[Giving], nodes: usize, u: &[f64], history: &[f64]) -> Vector3<f64> {
    let pull = |(first, spring): &Giving| {
        let at = |c: usize| u[c * nodes + spring.node[0]];
        spring.pull(&Vector3::new(at(0), at(1), at(2)), &history[*first..])
    };
    of.iter().map(pull).sum()
}

impl Supports {
    /// Those of the whole structure, or of one node.
    fn of(model: &Model, only: Option<usize>) -> Self {
        let n = model.node_count();
        let nodes = only.map_or(0..n, |node| node..node + 1);
        let until = |dof: usize| model.until.get(dof).copied().filter(|t| t.is_finite()).map(|t| (dof, t));
        let dofs = |c: usize| nodes.clone().map(move |node| model.dof(node, c));
        let at = |dof: usize, c: usize| dof / n == c && nodes.contains(&(dof % n));
        let springs = model.spring_dofs();
        let giving = model.support_springs().filter(|(_, spring)| nodes.contains(&spring.node[0]));
        Self {
            until: [0, 1, 2].map(|c| dofs(c).filter_map(until).collect()),
            held: [0, 1, 2].map(|c| dofs(c).filter(|dof| model.held[*dof]).collect()),
            springs: [0, 1, 2].map(|c| springs.iter().copied().filter(|(dof, _)| at(*dof, c)).collect()),
            giving: giving.map(|(first, spring)| (first, spring.clone())).collect(),
            nodes: n,
        }
    }

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        let rigid = self.held.iter().all(Vec::is_empty) && self.until.iter().all(Vec::is_empty);
        rigid && self.springs.iter().all(Vec::is_empty) && self.giving.is_empty()
    }

    /// Force of the supports on the structure, where `force` is that of load and elements, less the inertia of held nodes that move, in the step with its middle at
    /// `time` [s].
    fn reaction(&self, force: &[f64], u: &[f64], history: &[f64], time: f64) -> [f64; 3] {
        let pulls = pulls(&self.giving, self.nodes, u, history);
        [0, 1, 2].map(|c: usize| {
            let held: f64 = self.held[c].iter().map(|dof| force[*dof]).sum();
            let springs: f64 = self.springs[c].iter().map(|(dof, k)| k * u[*dof]).sum();
            let still = self.until[c].iter().filter(|(_, until)| *until > time);
            -(held + springs + still.map(|(dof, _)| force[*dof]).sum::<f64>() + pulls[c])
        })
    }

    /// The same in a step.
    fn in_step(&self, step: &Step, history: &[f64]) -> [f64; 3] {
        self.reaction(step.force, step.middle, history, step.end - 0.5 * step.length)
    }
}

/// A step that is recorded.
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

/// Lengths of the means of the reaction [s].
pub const MEANS: [f64; 2] = [1e-3, 1e-2];

/// The recorder: gauges of the window at hand, and the impulse of the supports.
pub struct Recorder {
    total: Supports,
    /// Total support reaction at the start [N].
    pub at_rest: [f64; 3],
    probes: Vec<Probe>,
    /// Displacement at t = 0 [m].
    origin: Vec<f64>,
    /// Mean reactions over 1 ms and, where [`Model::vibrates`], over 10 ms.
    pub means: Vec<MovingMean>,
    /// Impulse of the window: of all supports, then of each probe of force, its sum and its members.
    impulses: Vec<[f64; 3]>,
    reaction: [Triple; 3],
    values: Vec<Triple>,
    elapsed: f64,
    /// Whether reactions are those of a row's end, as in statics.
    pub at_end: bool,
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
        let mut probes = Vec::new();
        for (i, gauge) in gauges.iter().enumerate() {
            let key = format!("gauge.{i}");
            let name = &gauge.name;
            let taken = |g: &GaugeConfig| g.name == *name && g.quantity == gauge.quantity;
            if name.is_empty() || gauges[..i].iter().any(taken) {
                let what = format!("the gauge `{name}` needs a name of its own");
                let hint = "its columns in history.csv begin with it, as name = \"middle_2\"";
                return scene.refuse(&format!("{key}.name"), what, hint);
            }
            if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
                let what = format!("`{name}` cannot begin a column: letters, digits, `_` and `-` can");
                return scene.refuse(&format!("{key}.name"), what, "middle_2 can");
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
            let (probe, gauges) = Probe::of(scene, &key, model, gauge)?;
            probes.push(probe);
            for own in gauges {
                if declared.iter().any(|d| d.name == own.name) {
                    let what = format!("two gauges give the column `{}`", own.name);
                    return scene.refuse(&format!("{key}.name"), what, "give this gauge another name");
                }
                declared.push(own);
            }
        }
        Ok((Probes(probes), declared))
    }

    /// A recorder that starts at t = 0 with `form`, where load and elements leave `force` to the supports; memory for
    /// so many `samples` of steps within each mean and a window.
    pub fn new(model: &Model, probes: &Probes, form: &Form, force: &[f64], samples: [usize; 2]) -> Self {
        let (total, origin) = (Supports::of(model, None), &form.displacement);
        let at_rest = total.reaction(force, origin, &form.history, f64::NEG_INFINITY);
        let probes = probes.0.clone();
        let impulses = |p: &Probe| if matches!(p.watch, Watch::Force(_)) { 1 + p.members } else { 0 };
        let impulses = 1 + probes.iter().map(impulses).sum::<usize>();
        Self {
            total,
            at_rest,
            origin: origin.clone(),
            means: MEANS[..1 + usize::from(model.vibrates())]
                .iter()
                .zip(samples)
                .map(|(span, samples)| MovingMean::new(at_rest, *span, samples))
                .collect(),
            impulses: vec![[0.0; 3]; impulses],
            reaction: [[0.0; 3]; 3],
            values: vec![[0.0; 3]; probes.iter().map(|probe| probe.slots).sum()],
            probes,
            elapsed: 0.0,
            at_end: false,
            line_forces: vec![0.0; model.elements.iter().map(|e| e.constants().lines).max().unwrap_or(0)],
        }
    }

    /// Smallest and largest of the members of each group, before the first step.
    pub fn groups(&self) -> Vec<Range> {
        vec![Range::default(); self.probes.iter().filter(|p| p.members > 0).count()]
    }

    /// A window begins.
    pub fn begin(&mut self) {
        self.means.iter_mut().for_each(MovingMean::begin);
        self.impulses.fill([0.0; 3]);
        let nothing = [0.0, f64::INFINITY, f64::NEG_INFINITY];
        self.reaction = [nothing; 3];
        self.values.fill(nothing);
        self.elapsed = 0.0;
    }

    /// A step is done; `state` is at its end, and there what is read of `elements`. Largest values so far are those of the
    /// structure, `peaks`, and of its `groups`.
    pub fn step(
        &mut self,
        model: &Model,
        (state, elements): (&State, &mut Assembly),
        step: &Step,
        peaks: &mut Peaks,
        groups: &mut [Range],
    ) {
        if self.at_end {
            self.impulses.fill([0.0; 3]);
            self.elapsed = 0.0;
        }
        self.elapsed += step.length;
        let reaction = self.total.in_step(step, &state.history);
        let impulse = reaction.map(|r| r * step.length);
        add(&mut self.impulses[0], impulse);
        for (triple, r) in self.reaction.iter_mut().zip(reaction) {
            widen(triple, r);
        }
        peaks.reaction.take(norm(&reaction), step.at);
        for ((mean, peak), span) in self.means.iter_mut().zip(&mut peaks.mean_reaction).zip(MEANS) {
            peak.take(mean.push(step.end, impulse), step.end - 0.5 * span);
        }
        peaks.take_tension(step.tension, step.at);
        if !self.probes.is_empty() {
            self.probe(model, (state, elements), step, groups);
        }
    }

    fn probe(
        &mut self,
        model: &Model,
        (state, elements): (&State, &mut Assembly),
        step: &Step,
        groups: &mut [Range],
    ) {
        let (mut at, mut impulse, mut group) = (0, 1, 0);
        let forces = &mut self.line_forces;
        for Probe { watch, members, slots } in &self.probes {
            let values = &mut self.values[at..at + slots];
            // Smallest and largest of the members at this instant.
            let (mut seen, mut next) = (Range::default(), 0);
            match watch {
                Watch::Lines(lines) if *members == 0 => {
                    lines.scan(model, (state, elements), forces, |value| record(&mut values[0], value));
                }
                Watch::Lines(lines) => {
                    lines.scan(model, (state, elements), forces, |value| {
                        seen.take(value, &mut next, step.end)
                    });
                    record(&mut values[0], seen.smallest.value);
                    record(&mut values[1], seen.largest.value);
                }
                Watch::Height(height) => {
                    height.scan(model, state, |slot, value| record(&mut values[slot], value));
                }
                Watch::Force(feet) => {
                    let (sums, own) = self.impulses[impulse..].split_at_mut(1);
                    let (mut sum, mut mean, mut next_mean) = ([0.0; 3], Range::default(), 0);
                    for (i, foot) in feet.iter().enumerate() {
                        let reaction = foot.supports.in_step(step, &state.history);
                        add(&mut sum, reaction);
                        if *members > 0 {
                            add(&mut own[i], reaction.map(|r| r * step.length));
                            seen.take(norm(&reaction), &mut next, step.at);
                            mean.take(norm(&own[i]) / self.elapsed, &mut next_mean, step.at);
                        }
                    }
                    add(&mut sums[0], sum.map(|r| r * step.length));
                    let sums = sum.into_iter().zip(sums[0].map(|impulse| impulse / self.elapsed));
                    let ends = [(seen.smallest, mean.smallest), (seen.largest, mean.largest)];
                    let ends = ends.map(|(now, mean)| (now.value, mean.value));
                    // There is no room for the ends without members.
                    for (value, (now, mean)) in values.iter_mut().zip(sums.chain(ends)) {
                        widen(value, now);
                        value[0] = mean;
                    }
                    impulse += 1 + members;
                }
                Watch::Displacement(nodes) | Watch::Velocity(nodes) => {
                    let share = 1.0 / nodes.len() as f64;
                    for (c, value) in values.iter_mut().enumerate() {
                        let dofs = nodes.iter().map(|node| model.dof(*node, c));
                        let sum: f64 = match watch {
                            Watch::Velocity(_) => dofs.map(|i| state.velocity[i]).sum(),
                            _ => dofs.map(|i| state.displacement[i] - self.origin[i]).sum(),
                        };
                        record(value, share * sum);
                    }
                }
            }
            if *members > 0 {
                groups[group].merge(&seen);
                group += 1;
            }
            at += slots;
        }
    }

    /// Write the triples of reactions and gauges of the window to `out`.
    pub fn write(&self, out: &mut [f64]) {
        let (triples, _) = out.as_chunks_mut::<3>();
        for (c, (to, triple)) in triples.iter_mut().zip(&self.reaction).enumerate() {
            *to = [self.impulses[0][c] / self.elapsed, triple[1], triple[2]];
        }
        triples[3..].copy_from_slice(&self.values);
    }
}

/// The scene's gauges.
pub struct Probes(Vec<Probe>);

impl Probes {
    /// Measures of single members and of the run's end at `state`, of the gauges of `configs`, at `time` [s].
    pub fn measures(&self, configs: &[GaugeConfig], model: &Model, state: &State, time: f64) -> Vec<Measure> {
        let mut measures = Vec::new();
        let mut groups = state.groups.iter();
        for (config, probe) in configs.iter().zip(&self.0) {
            if let Watch::Height(height) = &probe.watch {
                height.scan(model, state, |slot, value| {
                    let name = format!("{}_{}_end", config.name, Height::suffix(slot));
                    let measure = Measure::new(name, value, "m").at(time);
                    measures.push(measure.ranked(Measure::ORDINARY, Worse::Smaller));
                });
            }
            let Some(range) = (probe.members > 0).then(|| groups.next()).flatten() else { continue };
            let (quantity, unit) = probe.watch.quantity();
            let ends = [("min", range.smallest, Worse::Smaller), ("max", range.largest, Worse::Larger)];
            let ends = ends.into_iter().filter(|(_, extreme, _)| extreme.value.is_finite());
            for (end, extreme, worse) in ends {
                let name = format!("{}_{quantity}_{end}", config.name);
                let measure = Measure::new(name, extreme.value, unit).at(extreme.time);
                let member = probe.watch.member_name(model, extreme.member as usize);
                measures.push(measure.of_member(Some(member)).ranked(Measure::ORDINARY, worse));
            }
        }
        measures
    }
}

/// A gauge of the scene.
#[derive(Debug, Clone)]
struct Probe {
    watch: Watch,
    /// Members of which smallest and largest are reported; 0 where there is one value, a sum or a mean.
    members: usize,
    /// Numbers that it records: three components, one value, then smallest and largest of its members.
    slots: usize,
}

/// The number that a gauge watches.
#[derive(Debug, Clone)]
enum Watch {
    /// Displacement since t = 0, mean over some nodes.
    Displacement(Vec<usize>),
    /// Velocity, mean over some nodes.
    Velocity(Vec<usize>),
    /// Force of the supports.
    Force(Vec<Foot>),
    /// Axial force, elongation or bending moment.
    Lines(GaugedLines),
    /// Height between two groups.
    Height(Height),
}

impl Probe {
    /// The probe of the gauge with the key `key`, and the declaration of each of its numbers.
    fn of(
        scene: &Scene,
        key: &str,
        model: &Model,
        gauge: &GaugeConfig,
    ) -> Result<(Self, Vec<Gauge>), Diagnostic> {
        let watch = Watch::of(scene, key, model, gauge)?;
        let count = match &watch {
            Watch::Force(feet) => feet.len(),
            Watch::Lines(lines) => lines.count,
            Watch::Displacement(_) | Watch::Velocity(_) | Watch::Height(_) => 0,
        };
        let members = if count > 1 { count } else { 0 };
        let declared = watch.declared(&gauge.name, members);
        Ok((Self { watch, members, slots: declared.len() }, declared))
    }
}

impl Watch {
    fn of(scene: &Scene, key: &str, model: &Model, gauge: &GaugeConfig) -> Result<Self, Diagnostic> {
        let place = Where { nodes: None, group: gauge.group.as_deref(), at: gauge.at };
        let nodes = model.place(&Key { scene, key: key.into() }, place)?;
        if nodes.is_empty() {
            return Err(scene.invalid(key, "the group of this gauge has no nodes"));
        }
        let name = &gauge.name;
        Ok(match gauge.quantity {
            Quantity::Displacement => Self::Displacement(nodes),
            Quantity::Velocity => Self::Velocity(nodes),
            Quantity::Force => {
                let feet = Foot::of(model, &nodes);
                if feet.is_empty() {
                    let what = format!("no node of the gauge `{name}` is held: there is no support force");
                    return Err(scene.invalid(key, what));
                }
                Self::Force(feet)
            }
            Quantity::Height => Self::Height(Height::of(scene, key, model, nodes, gauge)?),
            Quantity::Tension | Quantity::Elongation | Quantity::BendingMoment | Quantity::Utilisation => {
                let lines = GaugedLines::of(model, &nodes, gauge);
                if lines.count == 0 {
                    let kind = if gauge.quantity == Quantity::BendingMoment { "beam" } else { "cable" };
                    let what = format!("there is no {kind} at the gauge `{name}`");
                    return Err(scene.invalid(key, what));
                }
                Self::Lines(lines)
            }
        })
    }

    /// Name and unit of what its members are compared by.
    fn quantity(&self) -> (&'static str, &'static str) {
        use Quantity::*;
        match self {
            Self::Force(_) => ("force", "N"),
            Self::Lines(lines) => match lines.quantity {
                Elongation => ("elongation", "m"),
                BendingMoment => ("bending_moment", "N m"),
                Utilisation => ("utilisation", "1"),
                Tension | Displacement | Velocity | Force | Height => ("tension", "N"),
            },
            Self::Displacement(_) | Self::Velocity(_) | Self::Height(_) => ("", ""),
        }
    }

    /// The gauges that report its numbers, in order.
    fn declared(&self, name: &str, members: usize) -> Vec<Gauge> {
        let gauge = |ending: String, unit: &str| Gauge::new(format!("{name}_{ending}"), unit);
        let vector = |letter: char, unit: &str, over: &str| {
            ['x', 'y', 'z'].map(|axis| gauge(format!("{letter}{axis}{over}"), unit)).into()
        };
        let mean = |nodes: &[usize]| if nodes.len() > 1 { "_mean" } else { "" };
        let (quantity, unit) = self.quantity();
        let mut all: Vec<Gauge> = match self {
            Self::Displacement(nodes) => vector('u', "m", mean(nodes)),
            Self::Velocity(nodes) => vector('v', "m/s", mean(nodes)),
            Self::Height(height) => (0..height.count()).map(|i| gauge(Height::suffix(i), "m")).collect(),
            Self::Force(_) => vector('f', "N", if members > 0 { "_sum" } else { "" }),
            Self::Lines(_) if members == 0 => vec![gauge(quantity.to_owned(), unit)],
            Self::Lines(_) => Vec::new(),
        };
        all.iter_mut().for_each(|gauge| gauge.extremes = true);
        if members > 0 {
            // The extremes of these are reported with the member that they belong to, as measures of the solver.
            all.extend(["min", "max"].map(|end| gauge(format!("{quantity}_{end}"), unit)));
        }
        all
    }

    /// A member in words.
    fn member_name(&self, model: &Model, member: usize) -> String {
        match self {
            Self::Force(feet) => format!("node {}", model.node_name(feet[member].node)),
            Self::Lines(lines) => lines.name(model, member),
            _ => String::new(),
        }
    }
}

/// A node that supports hold.
#[derive(Debug, Clone)]
struct Foot {
    node: usize,
    supports: Supports,
}

impl Foot {
    /// Those of `nodes` that are held.
    fn of(model: &Model, nodes: &[usize]) -> Vec<Self> {
        let mut nodes = nodes.to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        let feet = nodes.into_iter().map(|node| Self { node, supports: Supports::of(model, Some(node)) });
        feet.filter(|foot| !foot.supports.is_empty()).collect()
    }
}

/// Elements whose axial force, elongation or bending moment is recorded. A member is a line of an element (a segment of a
/// rope, a side of a ring); of an elongation or a moment, a whole element.
#[derive(Debug, Clone)]
struct GaugedLines {
    cables: Vec<usize>,
    elements: Vec<usize>,
    /// Of beams at a point: which of their ends are there.
    ends: Vec<[bool; 2]>,
    quantity: Quantity,
    count: usize,
}

impl GaugedLines {
    fn of(model: &Model, nodes: &[usize], gauge: &GaugeConfig) -> Self {
        let (mut cables, mut elements) = Self::elements(model, nodes, gauge);
        let quantity = gauge.quantity;
        let mut ends = Vec::new();
        if quantity == Quantity::BendingMoment {
            cables.clear();
            elements.retain(|e| model.elements[*e].constants().has_moments);
            let counts = |node: &usize| gauge.at.is_none() || nodes.contains(node);
            ends.extend(elements.iter().map(|e| {
                let own = model.elements[*e].nodes();
                [counts(&own[0]), counts(&own[1])]
            }));
        }
        let mut lines = Self { cables, elements, ends, quantity, count: 0 };
        let others = lines.elements.iter().map(|e| lines.members_of(model, *e)).sum::<usize>();
        lines.count = lines.cables.len() + others;
        lines
    }

    /// Members that an element has.
    fn members_of(&self, model: &Model, element: usize) -> usize {
        if self.quantity == Quantity::Tension { model.elements[element].constants().forces } else { 1 }
    }

    /// The cables and the other elements that have lines.
    fn elements(model: &Model, nodes: &[usize], gauge: &GaugeConfig) -> (Vec<usize>, Vec<usize>) {
        let has_lines = |e: &usize| model.elements[*e].constants().lines > 0;
        if let Some(part) = model.parts.iter().find(|p| Some(&p.name) == gauge.group.as_ref()) {
            return (part.cables.clone(), part.elements.iter().copied().filter(has_lines).collect());
        }
        let mut inside = vec![false; model.node_count()];
        nodes.iter().for_each(|n| inside[*n] = true);
        let single = gauge.at.is_some();
        let belongs = |own: &[usize]| {
            if single { own.iter().any(|n| inside[*n]) } else { own.iter().all(|n| inside[*n]) }
        };
        let cables = (0..model.cables.len()).filter(|c| belongs(&model.cables[*c].nodes)).collect();
        let elements = (0..model.elements.len()).filter(has_lines);
        (cables, elements.filter(|e| belongs(model.elements[*e].nodes())).collect())
    }

    /// Show `take` the value of each member, in order.
    fn scan(
        &self,
        model: &Model,
        (state, assembly): (&State, &mut Assembly),
        forces: &mut [f64],
        mut take: impl FnMut(f64),
    ) {
        use Quantity::*;
        let u = &state.displacement;
        for cable in self.cables.iter().map(|c| &model.cables[*c]) {
            let w = model.relative(u, cable);
            take(match self.quantity {
                Elongation => (cable.span + w).norm() - cable.span.norm(),
                Utilisation => 0.0,
                Tension | BendingMoment | Displacement | Velocity | Force | Height => cable.tension(&w),
            });
        }
        let mut read = 0;
        for (number, i) in self.elements.iter().enumerate() {
            let element = &model.elements[*i];
            if number < read {
                continue;
            }
            if self.quantity == Tension {
                // Mostly all of a block are watched, one after the other.
                let tensions = assembly.ring_tensions(*i, u, &state.history);
                let own = self.elements[number..].iter().zip(*i..).take(tensions.len());
                let run = own.take_while(|(own, next)| **own == *next).count();
                tensions[..run].iter().for_each(|tension| take(*tension));
                if run > 0 {
                    read = number + run;
                    continue;
                }
            }
            let history = assembly.history(*i, &state.history);
            let own = assembly.gather(*i, u);
            match self.quantity {
                Elongation => take(element.elongation(own)),
                BendingMoment => {
                    let moments = element.moments(own, history);
                    let size = |end: usize| moments[end].hypot(moments[2 + end]);
                    let ends = (0..2).filter(|end| self.ends[number][*end]);
                    take(ends.map(size).fold(0.0, f64::max));
                }
                Utilisation => {
                    take(element.largest_utilisation(own, history, &mut forces[..element.constants().lines]))
                }
                Tension | Displacement | Velocity | Force | Height => {
                    element.line_forces(own, history, &mut forces[..element.constants().lines]);
                    // What is broken carries nothing.
                    let forces = forces.iter().take(element.constants().forces);
                    forces.for_each(|f| take(if f.is_nan() { 0.0 } else { *f }));
                }
            }
        }
    }

    fn name(&self, model: &Model, member: usize) -> String {
        if let Some(cable) = self.cables.get(member) {
            return model.cable_name(*cable);
        }
        let mut left = member - self.cables.len();
        for element in &self.elements {
            let lines = self.members_of(model, *element);
            if left < lines {
                return model.member_name(*element, (lines > 1).then_some(left));
            }
            left -= lines;
        }
        String::new()
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
