//! Whose numbers the unknowns are: so that only numbers of one node are compared between two iterations.

/// Numbers of a node in each block: components of displacement or of velocity.
pub const COMPONENTS: usize = 3;

/// The places that each node of `new` has in `old` and in `new`, for the nodes in both. Both lists ascend.
pub fn common<'a>(old: &'a [u32], new: &'a [u32]) -> impl Iterator<Item = (usize, usize)> + 'a {
    let mut at = 0;
    new.iter().enumerate().filter_map(move |(place, node)| {
        at += old[at..].iter().take_while(|other| *other < node).count();
        (old.get(at) == Some(node)).then_some((at, place))
    })
}

/// Write `old` (blocks of [`COMPONENTS`] numbers for each of the nodes `before`) over `new` (the same for `now`), where a node is in both.
pub fn carry_over(old: &[f64], before: &[u32], new: &mut [f64], now: &[u32]) {
    let blocks = old.chunks_exact((COMPONENTS * before.len()).max(1));
    for (old, new) in blocks.zip(new.chunks_exact_mut((COMPONENTS * now.len()).max(1))) {
        for (from, to) in common(before, now) {
            new[COMPONENTS * to..][..COMPONENTS].copy_from_slice(&old[COMPONENTS * from..][..COMPONENTS]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn common_nodes_are_those_of_both_sets(a in prop::collection::btree_set(0..40u32, 0..20), b in prop::collection::btree_set(0..40u32, 0..20)) {
            let (old, new): (Vec<u32>, Vec<u32>) = (a.iter().copied().collect(), b.iter().copied().collect());
            let pairs: Vec<_> = common(&old, &new).collect();
            prop_assert!(pairs.iter().all(|&(o, n)| old[o] == new[n]));
            let found: BTreeSet<u32> = pairs.iter().map(|&(_, n)| new[n]).collect();
            prop_assert_eq!(found, a.intersection(&b).copied().collect::<BTreeSet<u32>>());
        }
    }

    #[test]
    fn each_block_is_carried_over_node_by_node() {
        let old = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0];
        let mut new = [0.0; 12];
        carry_over(&old, &[3, 7], &mut new, &[5, 7]);
        assert_eq!(new, [0.0, 0.0, 0.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 14.0, 15.0, 16.0]);
    }
}
