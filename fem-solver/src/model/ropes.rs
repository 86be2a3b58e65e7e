//! Ropes from lines that follow each other.

use super::cell::Cell;
use crate::read::mesh::Mesh;
use std::collections::HashMap;

/// Why lines make no ropes; nodes by position.
#[derive(Debug, PartialEq, Eq)]
pub enum Fault {
    /// More than two lines end at this node.
    Branch(usize),
    /// The rope through this node has no ends.
    Closed(usize),
}

impl Fault {
    /// In words.
    pub fn words(&self, mesh: &Mesh) -> String {
        let number = |n: usize| mesh.numbers.get(n).copied().unwrap_or(n as u64);
        match self {
            Self::Branch(node) => format!("more than two of them end at node {}", number(*node)),
            Self::Closed(node) => format!("that through node {} has no ends", number(*node)),
        }
    }
}

/// Join the lines that share an end: one cell for each rope, in the order and direction of its first line.
pub fn join(lines: Vec<Cell>) -> Result<Vec<Cell>, Fault> {
    let mut at: HashMap<usize, Vec<usize>> = HashMap::new();
    for (i, line) in lines.iter().enumerate() {
        for end in [line.nodes[0], line.nodes[line.nodes.len() - 1]] {
            let there = at.entry(end).or_default();
            there.push(i);
            if there.len() > 2 {
                return Err(Fault::Branch(end));
            }
        }
    }
    let mut used = vec![false; lines.len()];
    let mut ropes = Vec::new();
    for (first, line) in lines.iter().enumerate() {
        if std::mem::replace(&mut used[first], true) {
            continue;
        }
        let mut rope = line.clone();
        // Onwards from its last node; then the same from its first.
        for _ in 0..2 {
            loop {
                let end = rope.nodes[rope.nodes.len() - 1];
                let Some(next) = at[&end].iter().copied().find(|i| !used[*i]) else { break };
                used[next] = true;
                let mut nodes = lines[next].nodes.clone();
                if nodes[0] != end {
                    nodes.reverse();
                }
                rope.nodes.extend(&nodes[1..]);
                rope.from.extend(&lines[next].from);
            }
            rope.nodes.reverse();
        }
        if rope.nodes[0] == rope.nodes[rope.nodes.len() - 1] {
            return Err(Fault::Closed(rope.nodes[0]));
        }
        ropes.push(rope);
    }
    Ok(ropes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(nodes: &[[usize; 2]]) -> Vec<Cell> {
        let cell = |(i, n): (usize, &[usize; 2])| Cell { nodes: n.to_vec(), from: vec![i as u32] };
        nodes.iter().enumerate().map(cell).collect()
    }

    #[test]
    fn lines_in_any_order_and_direction_are_one_rope_for_each_chain() {
        let ropes = join(lines(&[[2, 3], [1, 2], [7, 8], [4, 3], [9, 8]])).unwrap();
        assert_eq!(ropes.iter().map(|r| &r.nodes[..]).collect::<Vec<_>>(), [&[1, 2, 3, 4][..], &[7, 8, 9]]);
        assert_eq!(ropes[0].from, [0, 3, 1]);
    }

    #[test]
    fn branches_and_loops_are_no_ropes() {
        assert_eq!(join(lines(&[[0, 1], [1, 2], [1, 3]])), Err(Fault::Branch(1)));
        assert_eq!(join(lines(&[[0, 1], [1, 2], [2, 0]])), Err(Fault::Closed(0)));
    }
}
