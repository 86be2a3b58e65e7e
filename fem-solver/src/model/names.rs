//! Elements in words: by the numbers of the mesh file where there is one, and by where they are.

use super::Model;
use super::cell::Made;
use nalgebra::Vector3;

impl Model {
    /// Remember what the mesh file calls its elements: `numbers`, of which `made` says what became of each.
    pub(super) fn number_elements(&mut self, numbers: &[u64], made: &[Made]) {
        self.element_numbers = [vec![None; self.elements.len()], vec![None; self.cables.len()]];
        let mut twice = [vec![false; self.elements.len()], vec![false; self.cables.len()]];
        for (number, made) in numbers.iter().zip(made) {
            for (kind, range) in [made.elements.clone(), made.cables.clone()].into_iter().enumerate() {
                for i in range {
                    twice[kind][i] |= self.element_numbers[kind][i].is_some();
                    self.element_numbers[kind][i] = Some(*number).filter(|_| !twice[kind][i]);
                }
            }
        }
    }

    /// Element number `element` as a member of a group, or its line number `line`: `element 3 of posts, (x y z) to (x y z)`.
    /// Its number is that of the mesh file, else it counts from 0 in its part.
    pub fn member_name(&self, element: usize, line: Option<usize>) -> String {
        let part = self.parts.iter().find(|p| p.elements.contains(&element));
        let place = part.and_then(|p| p.elements.iter().position(|e| *e == element));
        let nodes = self.elements[element].nodes();
        let number = self.element_numbers[0].get(element).copied().flatten();
        let head = head(number, place, part.map(|p| p.name.as_str()), element);
        let lines = self.elements[element].lines();
        match line.and_then(|line| lines.get(line)) {
            Some([a, b]) => format!("{head}, its segment {} to {}", self.place_name(*a), self.place_name(*b)),
            // Closed: a ring.
            None if lines.len() == nodes.len() => {
                let sum: Vector3<f64> = nodes.iter().map(|n| self.nodes[*n]).sum();
                format!("{head}, around {}", point(&(sum / nodes.len() as f64)))
            }
            None => {
                format!(
                    "{head}, {} to {}",
                    self.place_name(nodes[0]),
                    self.place_name(nodes[nodes.len() - 1])
                )
            }
        }
    }

    /// The same of cable number `cable`.
    pub fn cable_name(&self, cable: usize) -> String {
        let part = self.parts.iter().find(|p| p.cables.contains(&cable));
        let place = part.and_then(|p| p.cables.iter().position(|c| *c == cable));
        let number = self.element_numbers[1].get(cable).copied().flatten();
        let [a, b] = self.cables[cable].nodes.map(|n| self.place_name(n));
        format!("{}, {a} to {b}", head(number, place, part.map(|p| p.name.as_str()), cable))
    }

    fn place_name(&self, node: usize) -> String {
        point(&self.nodes[node])
    }
}

fn head(number: Option<u64>, place: Option<usize>, part: Option<&str>, overall: usize) -> String {
    let number = number.map_or_else(|| place.unwrap_or(overall).to_string(), |n| n.to_string());
    part.map_or_else(|| format!("element {number}"), |part| format!("element {number} of {part}"))
}

/// A point [m], to a tenth of a millimetre.
fn point(p: &Vector3<f64>) -> String {
    // Adding 0 makes 0 of -0.
    let [x, y, z] = [p.x, p.y, p.z].map(|c| (1e4 * c).round() / 1e4 + 0.0);
    format!("({x:?} {y:?} {z:?})")
}
