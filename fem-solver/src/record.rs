//! What is recorded at every step: support reactions, scene gauges, largest values.

use crate::assembly::Assembly;
use crate::config::structure::Where;
use crate::config::{GaugeConfig, Quantity};
use crate::model::Model;
use crate::moving_mean::MovingMean;
use crate::newton::spring_dofs;
use crate::state::{Peaks, State};
use interface_defs::message::Gauge;
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use nalgebra::Vector3;

/// Supports whose force is summed: held degrees of freedom, and springs by their feet.
#[derive(Debug, Clone)]
struct Supports {
    held: [Vec<usize>; 3],
    springs: [Vec<(usize, f64)>; 3],
}

impl Supports {
    fn of(model: &Model, nodes: impl Fn(usize) -> bool) -> Self {
        let n = model.node_count();
        let springs = spring_dofs(model);
        Self {
            held: [0, 1, 2].map(|c| {
                (0..n).filter(|i| nodes(*i)).map(|i| model.dof(i, c)).filter(|dof| model.held[*dof]).collect()
            }),
            springs: [0, 1, 2]
                .map(|c| springs.iter().copied().filter(|(dof, _)| dof / n == c && nodes(dof % n)).collect()),
        }
    }

    fn is_empty(&self) -> bool {
        self.held.iter().all(Vec::is_empty) && self.springs.iter().all(Vec::is_empty)
    }

    /// Force of the supports on the structure, where `force` is that of load and elements.
    fn reaction(&self, force: &[f64], u: &[f64]) -> [f64; 3] {
        [0, 1, 2].map(|c: usize| {
            let held: f64 = self.held[c].iter().map(|dof| force[*dof]).sum();
            let springs: f64 = self.springs[c].iter().map(|(dof, k)| k * u[*dof]).sum();
            -(held + springs)
        })
    }
}

/// What one scene gauge watches.
#[derive(Debug, Clone)]
enum Probe {
    Displacement(Vec<usize>),
    Velocity(Vec<usize>),
    Force(Supports),
    Lines(Lines),
    Height(Height),
}

/// A group above another.
#[derive(Debug, Clone)]
struct Height {
    nodes: Vec<usize>,
    above: Vec<usize>,
    up: Vector3<f64>,
}

impl Height {
    fn of(
        scene: &Scene,
        key: &str,
        model: &Model,
        nodes: Vec<usize>,
        gauge: &GaugeConfig,
    ) -> Result<Self, InputError> {
        let Some(below) = gauge.above.as_deref() else {
            return Err(scene
                .invalid(
                    key,
                    format!("the gauge `{}` does not say above what its height is taken", gauge.name),
                )
                .try_instead("add above = \"name of a group\""));
        };
        let place = Where { nodes: None, group: Some(below), at: None };
        let above = model.place(scene, &format!("{key}.above"), place)?;
        match model.down {
            Some(down) => Ok(Self { nodes, above, up: -down }),
            None => Err(scene.invalid(key, "a height counts against gravity, and there is none")),
        }
    }

    fn value(&self, model: &Model, state: &State) -> f64 {
        let height =
            |node: &usize| self.up.dot(&(model.nodes[*node] + model.vector(&state.displacement, *node)));
        let lowest = self.nodes.iter().map(height).fold(f64::INFINITY, f64::min);
        lowest - self.above.iter().map(height).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Elements whose axial force, or elongation, is recorded.
#[derive(Debug, Clone)]
struct Lines {
    cables: Vec<usize>,
    elements: Vec<usize>,
    elongation: bool,
}

impl Lines {
    fn of(model: &Model, nodes: &[usize], gauge: &GaugeConfig) -> Self {
        let elongation = gauge.quantity == Quantity::Elongation;
        if let Some(part) = model.parts.iter().find(|p| Some(&p.name) == gauge.group.as_ref()) {
            return Self { cables: part.cables.clone(), elements: part.elements.clone(), elongation };
        }
        let single = gauge.at.is_some();
        let belongs = |own: &[usize]| {
            let inside = |n: &usize| nodes.contains(n);
            if single { own.iter().any(inside) } else { own.iter().all(inside) }
        };
        let cables = (0..model.cables.len()).filter(|c| belongs(&model.cables[*c].nodes)).collect();
        let lines = (0..model.elements.len()).filter(|e| !model.elements[*e].lines().is_empty());
        let elements = lines.filter(|e| belongs(model.elements[*e].nodes())).collect();
        Self { cables, elements, elongation }
    }

    fn is_empty(&self) -> bool {
        self.cables.is_empty() && self.elements.is_empty()
    }

    fn largest(&self, model: &Model, state: &State, assembly: &mut Assembly, forces: &mut [f64]) -> f64 {
        let u = &state.displacement;
        let cables = self.cables.iter().map(|c| {
            let cable = &model.cables[*c];
            let w = model.relative(u, cable);
            if self.elongation {
                (cable.span + w).norm() - cable.span.norm()
            } else {
                cable.response(&w).tension
            }
        });
        let mut largest = cables.fold(f64::NEG_INFINITY, f64::max);
        for i in &self.elements {
            let element = &model.elements[*i];
            let history = assembly.history(*i, &state.history);
            let own = assembly.gather(*i, u);
            if self.elongation {
                largest = largest.max(element.elongation(own));
                continue;
            }
            let forces = &mut forces[..element.line_count()];
            element.line_forces(own, history, forces);
            // What is broken carries nothing.
            largest = forces.iter().map(|f| if f.is_nan() { 0.0 } else { *f }).fold(largest, f64::max);
        }
        largest
    }
}

/// What a step leaves to be recorded.
pub struct Step<'a> {
    /// Its end [s].
    pub end: f64,
    /// Its length [s].
    pub length: f64,
    /// Mean force of load and elements on every degree of freedom [N].
    pub force: &'a [f64],
    /// Displacement at which that holds [m].
    pub middle: &'a [f64],
    /// Largest tension in it [N].
    pub tension: f64,
}

/// Value, smallest and largest of one number.
pub type Triple = [f64; 3];

/// The recorder: gauges of the window at hand, and the impulse of the supports.
pub struct Recorder {
    total: Supports,
    probes: Vec<Probe>,
    /// Displacement at t = 0 [m].
    origin: Vec<f64>,
    mean: MovingMean,
    /// Impulse of the window: of all supports, then of each probe of force.
    impulses: Vec<[f64; 3]>,
    reaction: [Triple; 3],
    values: Vec<Triple>,
    elapsed: f64,
    assembly: Assembly,
    line_forces: Vec<f64>,
}

impl Recorder {
    /// The scene's gauges, and the declarations of all numbers in the order of [`Recorder::write`].
    pub fn probes(
        scene: &Scene,
        model: &Model,
        gauges: &[GaugeConfig],
    ) -> Result<(Probes, Vec<Gauge>), InputError> {
        let mut declared: Vec<Gauge> =
            ["x", "y", "z"].iter().map(|c| Gauge::new(format!("reaction_{c}"), "N")).collect();
        let mut probes = Vec::new();
        for (i, gauge) in gauges.iter().enumerate() {
            let key = format!("gauge.{i}");
            if gauge.name.is_empty()
                || gauges[..i].iter().any(|g| g.name == gauge.name && g.quantity == gauge.quantity)
            {
                let what = format!("the gauge `{}` needs a name of its own", gauge.name);
                return Err(scene.invalid(&format!("{key}.name"), what));
            }
            if gauge.above.is_some() && gauge.quantity != Quantity::Height {
                let what =
                    format!("`above` is for quantity = \"height\", not for the gauge `{}`", gauge.name);
                return Err(scene.invalid(&format!("{key}.above"), what));
            }
            let place = Where { nodes: None, group: gauge.group.as_deref(), at: gauge.at };
            if gauge.group.is_none() == gauge.at.is_none() {
                return Err(
                    scene.invalid(&key, "a gauge stands at a point or for a group: write one of at, group")
                );
            }
            let nodes = model.place(scene, &key, place)?;
            if nodes.is_empty() {
                return Err(scene.invalid(&key, "the group of this gauge has no nodes"));
            }
            let (probe, names, unit) = match gauge.quantity {
                Quantity::Displacement => (Probe::Displacement(nodes), vec!["ux", "uy", "uz"], "m"),
                Quantity::Velocity => (Probe::Velocity(nodes), vec!["vx", "vy", "vz"], "m/s"),
                Quantity::Force => {
                    let supports = Supports::of(model, |node| nodes.contains(&node));
                    if supports.is_empty() {
                        let what = format!(
                            "no node of the gauge `{}` is held: there is no support force",
                            gauge.name
                        );
                        return Err(scene.invalid(&key, what));
                    }
                    (Probe::Force(supports), vec!["fx", "fy", "fz"], "N")
                }
                Quantity::Height => {
                    (Probe::Height(Height::of(scene, &key, model, nodes, gauge)?), vec!["height"], "m")
                }
                Quantity::Tension | Quantity::Elongation => {
                    let lines = Lines::of(model, &nodes, gauge);
                    if lines.is_empty() {
                        let what = format!("there is no cable at the gauge `{}`", gauge.name);
                        return Err(scene.invalid(&key, what));
                    }
                    let (name, unit) = if lines.elongation { ("elongation", "m") } else { ("tension", "N") };
                    (Probe::Lines(lines), vec![name], unit)
                }
            };
            declared.extend(
                names
                    .iter()
                    .map(|n| Gauge { extremes: true, ..Gauge::new(format!("{}_{n}", gauge.name), unit) }),
            );
            probes.push(probe);
        }
        Ok((Probes(probes), declared))
    }

    /// A recorder that starts at t = 0 with the displacements `origin`, where load and elements
    /// leave `force` to the supports; memory for `samples` steps within 1 ms and a window.
    pub fn new(model: &Model, probes: &Probes, origin: &[f64], force: &[f64], samples: usize) -> Self {
        let total = Supports::of(model, |_| true);
        let at_rest = total.reaction(force, origin);
        let count = probes
            .0
            .iter()
            .map(|p| if matches!(p, Probe::Lines(_) | Probe::Height(_)) { 1 } else { 3 })
            .sum();
        let forces = probes.0.iter().filter(|p| matches!(p, Probe::Force(_))).count();
        Self {
            total,
            probes: probes.0.clone(),
            origin: origin.to_vec(),
            mean: MovingMean::new(at_rest, samples),
            impulses: vec![[0.0; 3]; 1 + forces],
            reaction: [[0.0; 3]; 3],
            values: vec![[0.0; 3]; count],
            elapsed: 0.0,
            assembly: Assembly::new(model),
            line_forces: vec![0.0; model.elements.iter().map(|e| e.line_count()).max().unwrap_or(0)],
        }
    }

    /// Total support reaction [N].
    pub fn total_reaction(&self, force: &[f64], u: &[f64]) -> [f64; 3] {
        self.total.reaction(force, u)
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
    pub fn step(&mut self, model: &Model, state: &State, step: &Step, peaks: &mut Peaks) {
        self.elapsed += step.length;
        let reaction = self.total.reaction(step.force, step.middle);
        let impulse = reaction.map(|r| r * step.length);
        add(&mut self.impulses[0], impulse);
        for (triple, r) in self.reaction.iter_mut().zip(reaction) {
            widen(triple, r);
        }
        let middle = step.end - 0.5 * step.length;
        let size = reaction.iter().map(|r| r * r).sum::<f64>().sqrt();
        peaks.reaction.take(size, middle);
        peaks.reaction_1ms.take(self.mean.push(step.end, impulse), step.end - 0.5e-3);
        peaks.cable_force.take(step.tension, middle);
        if !self.probes.is_empty() {
            self.probe(model, state, step);
        }
    }

    fn probe(&mut self, model: &Model, state: &State, step: &Step) {
        let (mut at, mut force) = (0, 1);
        for probe in &self.probes {
            match probe {
                Probe::Lines(lines) => {
                    let largest = lines.largest(model, state, &mut self.assembly, &mut self.line_forces);
                    record(&mut self.values[at], largest);
                    at += 1;
                }
                Probe::Height(height) => {
                    record(&mut self.values[at], height.value(model, state));
                    at += 1;
                }
                Probe::Force(supports) => {
                    let reaction = supports.reaction(step.force, step.middle);
                    add(&mut self.impulses[force], reaction.map(|r| r * step.length));
                    let impulse = self.impulses[force];
                    let components = reaction.iter().zip(impulse.iter());
                    for (value, (reaction, impulse)) in self.values[at..].iter_mut().zip(components) {
                        widen(value, *reaction);
                        value[0] = impulse / self.elapsed;
                    }
                    force += 1;
                    at += 3;
                }
                Probe::Displacement(nodes) | Probe::Velocity(nodes) => {
                    let share = 1.0 / nodes.len() as f64;
                    for c in 0..3 {
                        let dofs = nodes.iter().map(|node| model.dof(*node, c));
                        let sum: f64 = match probe {
                            Probe::Velocity(_) => dofs.map(|i| state.velocity[i]).sum(),
                            _ => dofs.map(|i| state.displacement[i] - self.origin[i]).sum(),
                        };
                        record(&mut self.values[at + c], share * sum);
                    }
                    at += 3;
                }
            }
        }
    }

    /// Write the triples of reactions and gauges of the window to `out`.
    pub fn write(&self, out: &mut [f64]) {
        let (triples, _) = out.as_chunks_mut::<3>();
        for (c, (to, triple)) in triples.iter_mut().zip(&self.reaction).enumerate() {
            *to = [self.impulses[0][c] / self.elapsed, triple[1], triple[2]];
        }
        triples[3..].iter_mut().zip(&self.values).for_each(|(to, triple)| *to = *triple);
    }

    /// The window is accepted.
    pub fn commit(&mut self) {
        self.mean.commit();
    }
}

/// What the scene's gauges watch.
pub struct Probes(Vec<Probe>);

impl Probes {
    /// Heights [m] at `state`, of the gauges of `configs` that tell one, by their names.
    pub fn heights<'a>(
        &'a self,
        configs: &'a [GaugeConfig],
        model: &'a Model,
        state: &'a State,
    ) -> impl Iterator<Item = (&'a str, f64)> {
        configs.iter().zip(&self.0).filter_map(|(config, probe)| match probe {
            Probe::Height(height) => Some((config.name.as_str(), height.value(model, state))),
            _ => None,
        })
    }
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
