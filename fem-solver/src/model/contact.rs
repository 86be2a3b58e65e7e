//! From `[structure.contact]` to lines that touch each other, and what is certainly wrong there.

use super::Model;
use super::numbering::connected;
use crate::config::structure::FormFinding;
use crate::config::{Config, Integrator};
use crate::read::{Key, nearest};
use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;

/// Contacts that the lightest node may have at once, for the critical step.
const AT_ONCE: f64 = 2.0;

/// A line that touches others.
#[derive(Debug, Clone, Copy)]
pub struct ContactLine {
    /// Its nodes.
    pub nodes: [usize; 2],
    /// Its radius [m].
    pub radius: f64,
    /// Number of its body: lines that hang together by nodes.
    pub body: usize,
    /// Length from each end over which it shares a contact with the line that follows there [m]; 0 where none does.
    pub overlap: [f64; 2],
}

/// Lines that touch each other.
#[derive(Debug, Clone)]
pub struct ContactLines {
    /// All of them, chains in the order of their parts.
    pub lines: Vec<ContactLine>,
    /// Force per depth [N/m].
    pub stiffness: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

impl ContactLines {
    /// Those of the scene; `None` where it names none.
    pub(super) fn of(scene: &Scene, config: &Config, model: &Model) -> Result<Option<Self>, Diagnostic> {
        let Some(table) = &config.structure.contact else { return Ok(None) };
        let key = Key { scene, key: "structure.contact".into() };
        key.positive(&[("stiffness", table.stiffness, "N/m")])?;
        key.not_negative(&[("friction", table.friction, "")])?;
        if config.fem.integrator != Integrator::CentralDifference {
            let what = "lines touch each other in explicit steps alone";
            return scene.refuse("structure.contact", what, "fem.integrator = \"central_difference\"");
        }
        if config.structure.form_finding != FormFinding::None {
            let what = "form finding knows nothing of lines that touch each other";
            return scene.refuse("structure.contact", what, "structure.form_finding = \"none\"");
        }
        let mut lines = Vec::new();
        for (i, name) in table.parts.iter().enumerate() {
            let of_part = |part: &&super::Part| part.name == *name;
            let Some(part) = model.parts.iter().find(of_part) else {
                let names: Vec<_> = model.parts.iter().map(|part| part.name.as_str()).collect();
                let hint = nearest(name, &names, "there are no parts here");
                return key.refuse(&format!("parts.{i}"), format!("there is no part `{name}`"), &hint);
            };
            let cables = part.cables.iter().map(|c| &model.cables[*c]).map(|c| (c.nodes, c.of.radius));
            let others = part.elements.iter().map(|e| &model.elements[*e]).flat_map(|e| {
                let radius = e.constants().radius;
                e.lines().into_iter().map(move |nodes| (nodes, radius))
            });
            let first = lines.len();
            lines.extend(cables.chain(others).map(|(nodes, radius)| ContactLine {
                nodes,
                radius,
                body: 0,
                overlap: [0.0; 2],
            }));
            if lines[first..].iter().any(|line| line.radius <= 0.0) {
                let what = format!("lines of `{name}` have no radius: they would touch nothing");
                return key.refuse(&format!("parts.{i}"), what, "write radius in the part, in metres");
            }
        }
        hang_together(&mut lines, model);
        if lines.iter().all(|line| line.body == lines[0].body) {
            let what = "all its lines hang together by nodes: nothing touches";
            return scene.refuse("structure.contact", what, "name parts of which some are apart");
        }
        Ok(Some(Self { lines, stiffness: table.stiffness, friction: table.friction }))
    }

    /// A bound of what contacts add to the highest angular frequency [rad/s], by their squares: each node of a pair as light as the
    /// lightest.
    pub fn frequency(&self, model: &Model) -> f64 {
        let nodes = self.lines.iter().flat_map(|line| line.nodes).filter(|node| !model.fully_held(*node));
        let lightest = nodes.map(|node| model.mass[node]).fold(f64::INFINITY, f64::min);
        (AT_ONCE * self.stiffness * 2.0 / lightest).sqrt()
    }
}

/// Number the bodies, and let lines overlap where they follow each other.
fn hang_together(lines: &mut [ContactLine], model: &Model) {
    let pairs: Vec<_> = lines.iter().map(|line| line.nodes).collect();
    let (mut bodies, mut ends) = (vec![0; model.node_count()], vec![0; model.node_count()]);
    for (number, part) in connected(&pairs, model.node_count()).into_iter().enumerate() {
        part.into_iter().for_each(|node| bodies[node] = number);
    }
    pairs.as_flattened().iter().for_each(|node| ends[*node] += 1);
    for line in lines {
        line.body = bodies[line.nodes[0]];
        let length = (model.nodes[line.nodes[1]] - model.nodes[line.nodes[0]]).norm();
        let follows = |node: usize| ends[node] > 1;
        line.overlap =
            line.nodes.map(|node| if follows(node) { line.radius.min(0.25 * length) } else { 0.0 });
    }
}
