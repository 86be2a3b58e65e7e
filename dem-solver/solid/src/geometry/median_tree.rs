//! A binary tree of boxes over items of which the nearest is asked for: the triangles of a rock's surface, the spheres of a
//! cluster. Each node is split at the median of its items.
//!
//! Beside it there is [`super::box_tree`], for items of which all in a region are asked for. Both were
//! measured beside `Bvh` of parry: `docs/performance.md`.

use nalgebra::Vector3;
use std::ops::Range;

/// Most nodes that wait: one of each level; 2^63 items are more than a `u32` numbers.
const MOST_WAITING: usize = 64;

/// By what the items of a node are split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Their place along an axis.
    Axis(usize),
    /// Their size.
    Size,
}

/// A box around items.
pub struct MedianNode<X> {
    /// Lowest corner [m].
    pub lowest: Vector3<f64>,
    /// Highest corner [m].
    pub highest: Vector3<f64>,
    /// What else is known of them.
    pub more: X,
    /// First item of a leaf, else number of the right child (the left one follows its parent).
    first: u32,
    /// Items of a leaf; 0: not a leaf.
    count: u32,
}

impl<X> MedianNode<X> {
    /// Square of the distance of a point from the box [m2]; 0 inside.
    #[inline]
    pub fn square_to(&self, point: &Vector3<f64>) -> f64 {
        let mut square = 0.0;
        for axis in 0..3 {
            let d = (self.lowest[axis] - point[axis]).max(point[axis] - self.highest[axis]).max(0.0);
            square += d * d;
        }
        square
    }

    /// Places of the items of a leaf.
    #[inline]
    pub fn items(&self) -> Option<Range<usize>> {
        (self.count > 0).then(|| self.first as usize..(self.first + self.count) as usize)
    }
}

/// The tree.
pub struct MedianTree<X> {
    nodes: Vec<MedianNode<X>>,
    /// Numbers of the items, leaf by leaf: the item at each place.
    pub order: Vec<u32>,
}

impl<X> MedianTree<X> {
    /// Over `count` items, at least one, up to `leaf` in a leaf. `describe` gives the box around some of them, what else is known of them,
    /// and by what they are to be split; `place` and `size` what an item has of that.
    pub fn new(
        count: usize,
        leaf: usize,
        describe: impl Fn(&[u32]) -> ([Vector3<f64>; 2], X, Split),
        place: impl Fn(u32) -> Vector3<f64>,
        size: impl Fn(u32) -> f64,
    ) -> Self {
        let value = |item: u32, split| match split {
            Split::Axis(axis) => place(item)[axis],
            Split::Size => size(item),
        };
        let mut tree = Self { nodes: Vec::with_capacity(count), order: Vec::new() };
        let mut order: Vec<u32> = (0..count as u32).collect();
        tree.build(&mut order, 0, leaf, &describe, &value);
        tree.order = order;
        tree
    }

    fn build(
        &mut self,
        order: &mut [u32],
        first: u32,
        leaf: usize,
        describe: &impl Fn(&[u32]) -> ([Vector3<f64>; 2], X, Split),
        value: &impl Fn(u32, Split) -> f64,
    ) {
        let ([lowest, highest], more, split) = describe(order);
        let at = self.nodes.len();
        self.nodes.push(MedianNode { lowest, highest, more, first, count: order.len() as u32 });
        if order.len() <= leaf {
            return;
        }
        let half = order.len() / 2;
        // Ties by number: the same tree on every machine.
        order.select_nth_unstable_by(half, |a, b| {
            value(*a, split).total_cmp(&value(*b, split)).then(a.cmp(b))
        });
        let (left, right) = order.split_at_mut(half);
        self.build(left, first, leaf, describe, value);
        self.nodes[at].count = 0;
        self.nodes[at].first = self.nodes.len() as u32;
        self.build(right, first + half as u32, leaf, describe, value);
    }

    /// A node; the root is number 0.
    pub fn node(&self, number: u32) -> &MedianNode<X> {
        &self.nodes[number as usize]
    }

    /// What else is known of a node, to be changed.
    pub fn more_mut(&mut self, number: u32) -> &mut X {
        &mut self.nodes[number as usize].more
    }

    /// Left and right child of a node that is no leaf.
    #[inline]
    pub fn children(&self, number: u32) -> [u32; 2] {
        [number + 1, self.nodes[number as usize].first]
    }

    /// Call `leaf` with the places of the items of every leaf into which `enter` leads, until it returns false. Of two
    /// children the one with the smaller `bound` comes first; `enter` is given a node's bound too.
    #[inline]
    pub fn nearest_first(
        &self,
        bound: impl Fn(&MedianNode<X>) -> f64,
        mut enter: impl FnMut(f64, &MedianNode<X>) -> bool,
        mut leaf: impl FnMut(Range<usize>) -> bool,
    ) {
        let mut waiting = [(0_u32, 0.0_f64); MOST_WAITING];
        waiting[0].1 = bound(&self.nodes[0]);
        let mut many = 1;
        while many > 0 {
            many -= 1;
            let (at, least) = waiting[many];
            let node = &self.nodes[at as usize];
            if !enter(least, node) {
                continue;
            }
            if let Some(items) = node.items() {
                if !leaf(items) {
                    return;
                }
                continue;
            }
            let [left, right] = self.children(at).map(|child| (child, bound(&self.nodes[child as usize])));
            let (near, far) = if left.1 <= right.1 { (left, right) } else { (right, left) };
            (waiting[many], waiting[many + 1]) = (far, near);
            many += 2;
        }
    }

    /// The same in the order of the places.
    #[inline]
    pub fn visit(&self, enter: impl Fn(&MedianNode<X>) -> bool, leaf: impl FnMut(Range<usize>) -> bool) {
        self.nearest_first(|_| 0.0, |_, node| enter(node), leaf);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    fn points(count: usize) -> Vec<Vector3<f64>> {
        let at = |i: usize, f: f64| ((i as f64 + 0.3) * f).sin();
        (0..count).map(|i| Vector3::new(9.0 * at(i, 1.3), 3.0 * at(i, 2.7), at(i, 3.1))).collect()
    }

    fn tree(points: &[Vector3<f64>]) -> MedianTree<()> {
        let describe = |some: &[u32]| {
            let [low, high] = crate::geometry::bounds(some.iter().map(|k| points[*k as usize]));
            ([low, high], (), Split::Axis((high - low).iamax()))
        };
        MedianTree::new(points.len(), 4, describe, |k| points[k as usize], |_| 0.0)
    }

    #[test]
    fn the_nearest_is_that_of_all_and_most_are_left_out() {
        for count in [1, 4, 5, 1000] {
            let points = points(count);
            let tree = tree(&points);
            let from = Vector3::new(2.0, -1.0, 0.3);
            let (best, seen) = (Cell::new(f64::INFINITY), Cell::new(0));
            tree.nearest_first(
                |node| node.square_to(&from),
                |square, _| square < best.get(),
                |items| {
                    for place in items {
                        seen.set(seen.get() + 1);
                        let point = points[tree.order[place] as usize];
                        best.set(best.get().min((point - from).norm_squared()));
                    }
                    true
                },
            );
            let every = points.iter().map(|p| (p - from).norm_squared()).fold(f64::INFINITY, f64::min);
            assert_eq!(best.get(), every);
            assert!(count < 1000 || seen.get() < 100, "{}", seen.get());
        }
    }

    #[test]
    fn a_visit_names_each_item_once_in_the_order_of_the_places_and_ends_when_a_leaf_says_so() {
        let tree = tree(&points(37));
        let mut places = Vec::new();
        tree.visit(
            |_| true,
            |items| {
                places.extend(items);
                true
            },
        );
        assert_eq!(places, (0..37).collect::<Vec<_>>());
        let mut numbers = tree.order.clone();
        numbers.sort_unstable();
        assert_eq!(numbers, (0..37).collect::<Vec<_>>());
        let mut leaves = 0;
        tree.visit(
            |_| true,
            |_| {
                leaves += 1;
                leaves < 3
            },
        );
        assert_eq!(leaves, 3);
    }
}
