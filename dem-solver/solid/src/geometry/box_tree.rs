//! A tree of boxes over many items that never move: the triangles of a terrain, the spheres of a rock.
//!
//! The items stand in Morton order (bits of x, y, z interleaved, one scale for all axes). The lowest
//! level has a box around each four of them, each further level a box around four of the level below:
//! no pointers, 8 bytes per item, built by one sort. Boxes are kept in single precision, rounded
//! outwards: they only leave out, and what is left is tested in full precision.

use crate::row::{Plain, Row};
use nalgebra::Vector3;

/// Items in a lowest box, and boxes in a box.
const FOUR: usize = 4;
/// Most boxes that wait: three of each level and the last; 4^17 items are more than a `u32` numbers.
const MOST_WAITING: usize = 64;
/// Steps along an axis in a Morton code.
const CODE_STEPS: f64 = 2_097_151.0;

/// A box, rounded outwards to single precision.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Bounds {
    /// Lowest corner [m].
    pub lowest: [f32; 3],
    /// Highest corner [m].
    pub highest: [f32; 3],
}

// SAFETY: six numbers of one size.
unsafe impl Plain for Bounds {}

impl Bounds {
    /// Around nothing.
    pub const EMPTY: Self = Self { lowest: [f32::INFINITY; 3], highest: [f32::NEG_INFINITY; 3] };

    /// Around the box from `lowest` to `highest` [m].
    #[inline]
    pub fn around(lowest: &Vector3<f64>, highest: &Vector3<f64>) -> Self {
        let below = |v: f64| if f64::from(v as f32) > v { (v as f32).next_down() } else { v as f32 };
        let above = |v: f64| if f64::from(v as f32) < v { (v as f32).next_up() } else { v as f32 };
        Self { lowest: (*lowest).map(below).into(), highest: (*highest).map(above).into() }
    }

    /// Around both.
    #[inline]
    pub fn with(&self, other: &Self) -> Self {
        Self {
            lowest: std::array::from_fn(|axis| self.lowest[axis].min(other.lowest[axis])),
            highest: std::array::from_fn(|axis| self.highest[axis].max(other.highest[axis])),
        }
    }

    /// True if both have a point in common.
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        let mut meets = true;
        for axis in 0..3 {
            meets &= self.lowest[axis] <= other.highest[axis] && self.highest[axis] >= other.lowest[axis];
        }
        meets
    }

    /// Square of the distance from `point` [m2]; 0 inside.
    #[inline]
    pub fn square_to(&self, point: &Vector3<f64>) -> f64 {
        let mut square = 0.0;
        for axis in 0..3 {
            let at = point[axis];
            let beside = (f64::from(self.lowest[axis]) - at).max(at - f64::from(self.highest[axis])).max(0.0);
            square += beside * beside;
        }
        square
    }

    /// Middle and half edges [m].
    #[inline]
    pub fn middle_and_half(&self) -> (Vector3<f64>, Vector3<f64>) {
        let lowest = Vector3::from(self.lowest).cast::<f64>();
        let highest = Vector3::from(self.highest).cast::<f64>();
        ((lowest + highest) * 0.5, (highest - lowest) * 0.5)
    }
}

/// Highest bits of a Morton code, by which items are sorted first: an item takes 4 bytes there, and 24 in a sort of all at once.
const FIRST_BITS: u32 = 20;

/// The order in which the items have to stand: their numbers by Morton code, then number.
pub fn morton_order(count: usize, middle: impl Fn(usize) -> Vector3<f64>) -> Vec<u32> {
    let [lowest, highest] = super::bounds((0..count).map(&middle));
    let extent = (highest - lowest).max();
    let scale = if extent > 0.0 { CODE_STEPS / extent } else { 0.0 };
    let code = |i: u32| {
        let at = (middle(i as usize) - lowest) * scale;
        spread(at.x as u64) | spread(at.y as u64) << 1 | spread(at.z as u64) << 2
    };
    let all = 0..count as u32;
    // Few items have few first bits, too: no more groups than items.
    let bits = FIRST_BITS.min(usize::BITS - count.leading_zeros());
    let group = |i: u32| (code(i) >> (63 - bits)) as usize;
    let mut ends = vec![0_u32; (1 << bits) + 1];
    all.clone().for_each(|i| ends[group(i) + 1] += 1);
    (0..1 << bits).for_each(|at| ends[at + 1] += ends[at]);
    let mut order = vec![0; count];
    for i in all {
        let next = &mut ends[group(i)];
        order[*next as usize] = i;
        *next += 1;
    }
    let mut start = 0;
    for end in &ends[..1 << bits] {
        order[start..*end as usize].sort_by_cached_key(|i| code(*i));
        start = *end as usize;
    }
    order
}

/// The lowest 21 bits, each followed by two zeros.
fn spread(bits: u64) -> u64 {
    let mut x = bits & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// The tree. Items are numbered by their place in Morton order.
#[derive(Debug, Clone, Default)]
pub struct BoxTree {
    /// Number of items.
    pub count: usize,
    /// From the lowest level, of four items each, to the single box at the top.
    pub levels: Vec<Row<Bounds>>,
}

impl BoxTree {
    /// Over `count` items that stand in Morton order.
    pub fn new(count: usize, bounds: impl Fn(usize) -> Bounds) -> Self {
        let of = |i: usize| {
            let items = FOUR * i..count.min(FOUR * (i + 1));
            items.map(&bounds).fold(Bounds::EMPTY, |a, b| a.with(&b))
        };
        let mut levels = vec![Row::own((0..count.div_ceil(FOUR)).map(of).collect())];
        while let Some(level) = levels.last().filter(|level| level.len() > 1) {
            let around = |four: &[Bounds]| four.iter().fold(Bounds::EMPTY, |a, b| a.with(b));
            levels.push(Row::own(level.chunks(FOUR).map(around).collect()));
        }
        Self { count, levels }
    }

    /// Around everything.
    pub fn bounds(&self) -> Bounds {
        self.levels.last().and_then(|top| top.first()).copied().unwrap_or(Bounds::EMPTY)
    }

    /// Call `item` with the number of every item of the lowest boxes into which `enter` leads, in
    /// ascending order; `item` ends it by returning false. Allocates nothing.
    #[inline]
    pub fn visit(&self, mut enter: impl FnMut(&Bounds) -> bool, mut item: impl FnMut(usize) -> bool) {
        if self.count == 0 {
            return;
        }
        let mut waiting = [(0_u8, 0_u32); MOST_WAITING];
        waiting[0] = (self.levels.len() as u8 - 1, 0);
        let mut many = 1;
        while many > 0 {
            many -= 1;
            let (level, at) = waiting[many];
            if !enter(&self.levels[level as usize][at as usize]) {
                continue;
            }
            let first = FOUR * at as usize;
            if level == 0 {
                for number in first..self.count.min(first + FOUR) {
                    if !item(number) {
                        return;
                    }
                }
                continue;
            }
            let below = self.levels[level as usize - 1].len();
            for child in (first..below.min(first + FOUR)).rev() {
                waiting[many] = (level - 1, child as u32);
                many += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(count: usize) -> Vec<Bounds> {
        let at = |i: usize, f: f64| ((i as f64 + 0.3) * f).sin();
        let centre = |i: usize| Vector3::new(9.0 * at(i, 1.3), 3.0 * at(i, 2.7), at(i, 3.1));
        let order = morton_order(count, centre);
        let item = |i: &u32| {
            let half = Vector3::repeat(0.05 + 0.1 * at(*i as usize, 0.7).abs());
            Bounds::around(&(centre(*i as usize) - half), &(centre(*i as usize) + half))
        };
        order.iter().map(item).collect()
    }

    #[test]
    fn what_a_look_at_every_item_finds_is_found_in_ascending_order() {
        let query = Bounds { lowest: [-2.0, -1.0, -0.5], highest: [4.0, 1.5, 0.2] };
        for count in [0, 1, 3, 4, 5, 16, 17, 1000] {
            let items = items(count);
            let tree = BoxTree::new(count, |i| items[i]);
            let mut found = Vec::new();
            let keep = |i: usize| {
                if items[i].meets(&query) {
                    found.push(i);
                }
                true
            };
            tree.visit(|b| b.meets(&query), keep);
            let every: Vec<usize> = (0..count).filter(|i| items[*i].meets(&query)).collect();
            assert_eq!(found, every);
        }
    }

    #[test]
    fn items_stand_in_the_order_of_one_sort_of_all() {
        let at = |i: usize, f: f64| ((i as f64 + 0.3) * f).sin();
        // Many of one code among them.
        let middle =
            |i: usize| Vector3::new(9.0 * at(i / 3, 1.3), 3.0 * at(i / 3, 2.7), at(i / 3, 3.1).round());
        for count in [0, 1, 2, 7, 1000, 30_000] {
            let order = morton_order(count, middle);
            let [low, high] = crate::geometry::bounds((0..count).map(middle));
            let code = |i: &u32| {
                let at = (middle(*i as usize) - low) * (CODE_STEPS / (high - low).max().max(1e-9));
                spread(at.x as u64) | spread(at.y as u64) << 1 | spread(at.z as u64) << 2
            };
            let mut sorted: Vec<u32> = (0..count as u32).collect();
            sorted.sort_by_key(code);
            assert_eq!(order, sorted, "{count}");
        }
    }

    #[test]
    fn single_precision_never_cuts_off_what_double_precision_holds() {
        for v in [0.1, -0.1, 1e-30, 2.6e6 + 0.123_456_789, -1.0 / 3.0] {
            let at = Vector3::repeat(v);
            let bounds = Bounds::around(&at, &at);
            assert!(f64::from(bounds.lowest[0]) <= v && f64::from(bounds.highest[0]) >= v);
        }
    }

    #[test]
    fn a_visit_that_has_found_enough_ends() {
        let items = items(500);
        let tree = BoxTree::new(500, |i| items[i]);
        let mut seen = 0;
        tree.visit(
            |_| true,
            |_| {
                seen += 1;
                seen < 7
            },
        );
        assert_eq!(seen, 7);
    }
}
