//! What a scene gauge watches: one number, a mean or sum over nodes, or smallest and largest of the members of a group.

use crate::config::structure::Where;
use crate::config::{GaugeConfig, Quantity};
use crate::internal_force::assembly::Assembly;
use crate::model::Model;
use crate::read::Key;
use crate::results::height::Height;
use crate::state::State;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::message::Gauge;
use toolkit::scene::Scene;

/// What one scene gauge watches.
#[derive(Debug, Clone)]
pub enum Probe {
    /// Displacement since t = 0, mean over some nodes.
    Displacement(Vec<usize>),
    /// Velocity, mean over some nodes.
    Velocity(Vec<usize>),
    /// Force of the supports.
    Force(Vec<Foot>),
    /// Axial force, elongation or bending moment.
    Lines(Lines),
    /// Height between two groups.
    Height(Height),
}

impl Probe {
    /// The probe of the gauge with the key `key`.
    pub fn of(scene: &Scene, key: &str, model: &Model, gauge: &GaugeConfig) -> Result<Self, Diagnostic> {
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
            Quantity::Tension | Quantity::Elongation | Quantity::BendingMoment => {
                let lines = Lines::of(model, &nodes, gauge);
                if lines.count == 0 {
                    let kind = if gauge.quantity == Quantity::BendingMoment { "beam" } else { "cable" };
                    let what = format!("there is no {kind} at the gauge `{name}`");
                    return Err(scene.invalid(key, what));
                }
                Self::Lines(lines)
            }
        })
    }

    /// Members of which smallest and largest are reported; 0 where there is one value, a sum or a mean.
    pub fn members(&self) -> usize {
        let count = match self {
            Self::Force(feet) => feet.len(),
            Self::Lines(lines) => lines.count,
            Self::Displacement(_) | Self::Velocity(_) | Self::Height(_) => 0,
        };
        if count > 1 { count } else { 0 }
    }

    /// Numbers that it records: three components, one value, then smallest and largest of its members.
    pub fn slots(&self) -> usize {
        let own = match self {
            Self::Displacement(_) | Self::Velocity(_) | Self::Force(_) => 3,
            Self::Height(height) => height.count(),
            Self::Lines(_) => usize::from(self.members() == 0),
        };
        own + if self.members() > 0 { 2 } else { 0 }
    }

    /// Name of what its members are compared by.
    pub fn quantity(&self) -> (&'static str, &'static str) {
        match self {
            Self::Force(_) => ("force", "N"),
            Self::Lines(lines) => match lines.quantity {
                Quantity::Elongation => ("elongation", "m"),
                Quantity::BendingMoment => ("bending_moment", "N m"),
                _ => ("tension", "N"),
            },
            _ => ("tension", "N"),
        }
    }

    /// The gauges that report it, each with the number that it shows.
    pub fn declared(&self, name: &str) -> Vec<(Gauge, usize)> {
        let followed = |name: String, unit: &str| Gauge { extremes: true, ..Gauge::new(name, unit) };
        let vector = |letter: char, unit: &'static str, over: &str| {
            let axes = [(0, 'x'), (1, 'y'), (2, 'z')];
            axes.map(|(c, axis)| (followed(format!("{name}_{letter}{axis}{over}"), unit), c)).into()
        };
        let mean = |nodes: &[usize]| if nodes.len() > 1 { "_mean" } else { "" };
        let (quantity, unit) = self.quantity();
        match self {
            Self::Displacement(nodes) => vector('u', "m", mean(nodes)),
            Self::Velocity(nodes) => vector('v', "m/s", mean(nodes)),
            Self::Height(height) => {
                let slots = 0..height.count();
                slots.map(|i| (followed(format!("{name}_{}", Height::suffix(i)), "m"), i)).collect()
            }
            Self::Force(feet) if feet.len() == 1 => vector('f', "N", ""),
            Self::Lines(_) if self.members() == 0 => {
                vec![(followed(format!("{name}_{quantity}"), unit), 0)]
            }
            Self::Force(_) | Self::Lines(_) => {
                let first = if matches!(self, Self::Force(_)) { 3 } else { 0 };
                // The extremes of these are reported with the member that they belong to, as measures of the solver.
                let of_members =
                    |end: &str, slot| (Gauge::new(format!("{name}_{quantity}_{end}"), unit), slot);
                let mut all = if first > 0 { vector('f', unit, "_sum") } else { Vec::new() };
                all.extend([of_members("min", first), of_members("max", first + 1)]);
                all
            }
        }
    }

    /// A member in words.
    pub fn member_name(&self, model: &Model, member: usize) -> String {
        match self {
            Self::Force(feet) => format!("node {}", model.node_name(feet[member].node)),
            Self::Lines(lines) => lines.name(model, member),
            _ => String::new(),
        }
    }
}

/// A node that supports hold, and their springs.
#[derive(Debug, Clone)]
pub struct Foot {
    node: usize,
    /// Until when it is held in each direction [s]; minus infinity where it is not.
    held: [f64; 3],
    springs: [f64; 3],
}

impl Foot {
    /// Those of `nodes` that are held.
    fn of(model: &Model, nodes: &[usize]) -> Vec<Self> {
        let n = model.node_count();
        let springs = model.spring_dofs();
        let mut nodes = nodes.to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        let feet = nodes.into_iter().map(|node| Self {
            node,
            held: [0, 1, 2].map(|c| {
                let dof = model.dof(node, c);
                if model.held[dof] {
                    f64::INFINITY
                } else {
                    model.until.get(dof).copied().unwrap_or(f64::NEG_INFINITY)
                }
            }),
            springs: [0, 1, 2]
                .map(|c| springs.iter().filter(|(dof, _)| *dof == c * n + node).map(|(_, k)| k).sum()),
        });
        feet.filter(|f| {
            f.held.iter().any(|until| *until > f64::NEG_INFINITY) || f.springs.iter().any(|k| *k > 0.0)
        })
        .collect()
    }

    /// Force of its supports on the structure [N], where `force` is that of load and elements, in the step with its middle
    /// at `time` [s].
    pub fn reaction(&self, nodes: usize, force: &[f64], u: &[f64], time: f64) -> [f64; 3] {
        [0, 1, 2].map(|c: usize| {
            let dof = c * nodes + self.node;
            let held = if self.held[c] > time { force[dof] } else { 0.0 };
            -(held + self.springs[c] * u[dof])
        })
    }
}

/// Elements whose axial force, elongation or bending moment is recorded. A member is a line of an element (a segment of a
/// rope, a side of a ring); of an elongation or a moment, a whole element.
#[derive(Debug, Clone)]
pub struct Lines {
    cables: Vec<usize>,
    elements: Vec<usize>,
    /// Of beams at a point: which of their ends are there.
    ends: Vec<[bool; 2]>,
    quantity: Quantity,
    count: usize,
}

impl Lines {
    fn of(model: &Model, nodes: &[usize], gauge: &GaugeConfig) -> Self {
        let (mut cables, mut elements) = Self::elements(model, nodes, gauge);
        let quantity = gauge.quantity;
        let mut ends = Vec::new();
        if quantity == Quantity::BendingMoment {
            cables.clear();
            elements.retain(|e| model.elements[*e].has_moments());
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
        if self.quantity == Quantity::Tension { model.elements[element].force_count() } else { 1 }
    }

    /// The cables and the other elements that have lines.
    fn elements(model: &Model, nodes: &[usize], gauge: &GaugeConfig) -> (Vec<usize>, Vec<usize>) {
        let has_lines = |e: &usize| model.elements[*e].line_count() > 0;
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
    pub fn scan(
        &self,
        model: &Model,
        state: &State,
        assembly: &mut Assembly,
        forces: &mut [f64],
        mut take: impl FnMut(f64),
    ) {
        let u = &state.displacement;
        for cable in self.cables.iter().map(|c| &model.cables[*c]) {
            let w = model.relative(u, cable);
            take(if self.quantity == Quantity::Elongation {
                (cable.span + w).norm() - cable.span.norm()
            } else {
                cable.tension(&w)
            });
        }
        assembly.begin_reading();
        for (number, i) in self.elements.iter().enumerate() {
            let element = &model.elements[*i];
            if self.quantity == Quantity::Tension
                && let Some(tension) = assembly.ring_tension(*i, u, &state.history)
            {
                take(tension);
                continue;
            }
            let history = assembly.history(*i, &state.history);
            let own = assembly.gather(*i, u);
            match self.quantity {
                Quantity::Elongation => {
                    take(element.elongation(own));
                    continue;
                }
                Quantity::BendingMoment => {
                    let moments = element.moments(own, history);
                    let size = |end: usize| moments[end].hypot(moments[2 + end]);
                    let ends = (0..2).filter(|end| self.ends[number][*end]);
                    take(ends.map(size).fold(0.0, f64::max));
                    continue;
                }
                _ => {}
            }
            let forces = &mut forces[..element.line_count()];
            element.line_forces(own, history, forces);
            // What is broken carries nothing.
            let forces = &forces[..element.force_count()];
            forces.iter().for_each(|f| take(if f.is_nan() { 0.0 } else { *f }));
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
