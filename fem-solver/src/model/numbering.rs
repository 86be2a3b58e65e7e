//! An order of nodes in which neighbours lie close.

/// Looks for a start that is far from everything, at most.
const LOOKS: usize = 4;

/// Nodes in an order in which neighbours lie close: breadth first, from a node at the end of the structure, the
/// neighbours of a node by the number of theirs. `pairs` are the neighbours. Source: Cuthill and McKee (1969), Proc. 24th
/// ACM Conf., 157; the start after George and Liu (1979), ACM TOMS 5, 284.
pub fn neighbours_together(pairs: &[[usize; 2]], nodes: usize) -> Vec<usize> {
    let mut around = neighbours(pairs, nodes);
    let degrees: Vec<usize> = around.iter().map(Vec::len).collect();
    around.iter_mut().for_each(|beside| beside.sort_by_key(|other| (degrees[*other], *other)));
    let mut order = Vec::with_capacity(nodes);
    let mut level = vec![None; nodes];
    for node in 0..nodes {
        if level[node].is_some() {
            continue;
        }
        let first = order.len();
        let mut depth = walk(node, &around, &mut level, &mut order);
        for _ in 0..LOOKS {
            // The last level, where few neighbours are, is the next end to begin at.
            let last = order[first..].iter().filter(|n| level[**n] == Some(depth));
            let start = *last.min_by_key(|n| (degrees[**n], **n)).expect("a walk has a last level");
            order[first..].iter().for_each(|n| level[*n] = None);
            order.truncate(first);
            let before = std::mem::replace(&mut depth, walk(start, &around, &mut level, &mut order));
            if depth <= before {
                break;
            }
        }
    }
    order
}

/// The neighbours of each of so many nodes.
fn neighbours(pairs: &[[usize; 2]], nodes: usize) -> Vec<Vec<usize>> {
    let mut around = vec![Vec::new(); nodes];
    for [a, b] in pairs {
        around[*a].push(*b);
        around[*b].push(*a);
    }
    around
}

/// The nodes of each part that hangs together, from its first node on.
pub(super) fn connected(pairs: &[[usize; 2]], nodes: usize) -> Vec<Vec<usize>> {
    let (around, mut level, mut parts) = (neighbours(pairs, nodes), vec![None; nodes], Vec::new());
    for first in 0..nodes {
        if level[first].is_none() {
            let mut part = Vec::new();
            walk(first, &around, &mut level, &mut part);
            parts.push(part);
        }
    }
    parts
}

/// Walk breadth first from `start` over the nodes without a level, which get theirs, and append them to `order`. Returns
/// the last level.
fn walk(start: usize, around: &[Vec<usize>], level: &mut [Option<usize>], order: &mut Vec<usize>) -> usize {
    let mut head = order.len();
    level[start] = Some(0);
    order.push(start);
    let mut depth = 0;
    while head < order.len() {
        let node = order[head];
        head += 1;
        let beyond = level[node].map_or(0, |l| l + 1);
        for other in &around[node] {
            if level[*other].is_none() {
                level[*other] = Some(beyond);
                depth = beyond;
                order.push(*other);
            }
        }
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of a square grid whose nodes have numbers without a pattern, and the mean distance of the numbers of pairs.
    fn grid(side: usize) -> Vec<[usize; 2]> {
        let mut numbers: Vec<usize> = (0..side * side).collect();
        let mut noise = crate::element::tests::checks::random(3);
        (1..side * side).rev().for_each(|i| numbers.swap(i, ((noise() + 0.5) * (i + 1) as f64) as usize));
        let mut pairs = Vec::new();
        for i in 0..side {
            for j in 0..side {
                let here = i * side + j;
                pairs.extend((j + 1 < side).then(|| [numbers[here], numbers[here + 1]]));
                pairs.extend((i + 1 < side).then(|| [numbers[here], numbers[here + side]]));
            }
        }
        pairs
    }

    #[test]
    fn a_square_grid_is_walked_along_its_diagonals() {
        let side = 20;
        let pairs = grid(side);
        let order = neighbours_together(&pairs, side * side);
        let mut place = vec![usize::MAX; side * side];
        order.iter().enumerate().for_each(|(new, old)| place[*old] = new);
        assert!(place.iter().all(|p| *p < side * side), "every node once");
        // From a corner neighbours are on diagonals next to each other, of at most `side` nodes.
        let farthest = pairs.iter().map(|[a, b]| place[*a].abs_diff(place[*b])).max();
        assert_eq!(farthest, Some(side));
    }

    #[test]
    fn nodes_without_neighbours_keep_their_order() {
        assert_eq!(neighbours_together(&[], 3), [0, 1, 2]);
    }
}
