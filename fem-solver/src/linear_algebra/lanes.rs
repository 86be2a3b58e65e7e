//! Loops over long vectors, as wide as the processor can, with sums in one fixed order.
//!
//! A sum is kept in [`LANES`] parts that are added at the end: the same parts whatever the width of
//! the processor's registers, so that these loops give the same bytes on every machine.

/// Parts of a sum that are kept apart.
pub const LANES: usize = 8;

pub(crate) use toolkit::wide;

/// `sum a_i b_i`, one after the other.
pub fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Length of a vector, likewise.
pub fn norm(x: &[f64]) -> f64 {
    inner(x, x).sqrt()
}

/// The parts of a sum and what is left over, added.
#[inline(always)]
pub fn total(lanes: [f64; LANES], rest: impl Iterator<Item = f64>) -> f64 {
    let mut total = 0.0;
    for lane in lanes {
        total += lane;
    }
    for value in rest {
        total += value;
    }
    total
}

/// Defines sums over vectors of one length (or none), each by the term that its numbers at one place add.
macro_rules! sums {
    ($($(#[$doc:meta])* $name:ident($($x:ident),*) = $term:expr;)*) => {wide! {$(
        $(#[$doc])*
        pub fn $name($($x: &[f64]),*) -> f64 {
            let n = [$($x.len()),*].into_iter().fold(usize::MAX, usize::min);
            $(let $x = $x[..n].as_chunks::<LANES>();)*
            let mut lanes = [0.0; LANES];
            for k in 0..n / LANES {
                $(let $x = &$x.0[k];)*
                for l in 0..LANES {
                    $(let $x = $x[l];)*
                    lanes[l] += $term;
                }
            }
            total(lanes, (0..n % LANES).map(|i| {
                $(let $x = $x.1[i];)*
                $term
            }))
        }
    )*}};
}

sums! {
    /// `sum a_i`.
    sum_of(a) = a;
    /// `sum a_i b_i`.
    dot(a, b) = a * b;
    /// `sum m_i v_i^2`.
    weighted_square(m, v) = m * (v * v);
    /// Work of the force `f` on the way from `before` to `after`: `sum f_i (after_i - before_i)`.
    work(f, after, before) = f * (after - before);
}

/// The same where the force acts on the degrees of freedom `at` alone, ascending: the same bytes.
pub fn work_at(at: &[u32], f: &[f64], after: &[f64], before: &[f64]) -> f64 {
    let one = |i: &u32| {
        let i = *i as usize;
        f[i] * (after[i] - before[i])
    };
    let (chunks, rest) = at.split_at(at.partition_point(|i| (*i as usize) < f.len() / LANES * LANES));
    let mut lanes = [0.0; LANES];
    for i in chunks {
        lanes[*i as usize % LANES] += one(i);
    }
    total(lanes, rest.iter().map(one))
}

wide! {
    /// `to = a + b`.
    pub fn add(to: &mut [f64], a: &[f64], b: &[f64]) {
        to.iter_mut().zip(a).zip(b).for_each(|((t, a), b)| *t = a + b);
    }

    /// `to += a`.
    pub fn add_to(to: &mut [f64], a: &[f64]) {
        to.iter_mut().zip(a).for_each(|(t, a)| *t += a);
    }

    /// `to -= a`.
    pub fn subtract_from(to: &mut [f64], a: &[f64]) {
        to.iter_mut().zip(a).for_each(|(t, a)| *t -= a);
    }

    /// Its square.
    fn longest_square(from: &[f64], to: &[f64], nodes: usize) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|c: usize| {
            let (from, to) = (&from[c * nodes..][..nodes], &to[c * nodes..][..nodes]);
            (from.as_chunks::<LANES>(), to.as_chunks::<LANES>())
        });
        let mut lanes = [0.0; LANES];
        let first = x.0.0.iter().zip(x.1.0);
        let others = y.0.0.iter().zip(y.1.0).zip(z.0.0.iter().zip(z.1.0));
        for ((x0, x1), ((y0, y1), (z0, z1))) in first.zip(others) {
            for l in 0..LANES {
                let (x, y, z) = (x1[l] - x0[l], y1[l] - y0[l], z1[l] - z0[l]);
                let square = x * x + y * y + z * z;
                lanes[l] = if square > lanes[l] { square } else { lanes[l] };
            }
        }
        let rest = (0..x.0.1.len()).map(|i| {
            let [x, y, z] = [x, y, z].map(|(from, to)| to.1[i] - from.1[i]);
            x * x + y * y + z * z
        });
        lanes.into_iter().chain(rest).fold(0.0, f64::max)
    }
}

/// Largest distance of any of so many nodes between two displacements, component-major.
pub fn longest_displacement(from: &[f64], to: &[f64], nodes: usize) -> f64 {
    longest_square(from, to, nodes).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_take_every_value() {
        let a: Vec<f64> = (1..=29).map(f64::from).collect();
        let b = vec![2.0; 29];
        assert_eq!((sum_of(&a), dot(&a, &b), weighted_square(&b, &b)), (435.0, 870.0, 29.0 * 8.0));
        assert_eq!(work(&b, &a, &b), 2.0 * (435.0 - 58.0));
    }

    #[test]
    fn work_at_a_few_places_is_that_of_all_bit_for_bit() {
        let wave = |speed: f64| (0..1003).map(|i| (speed * f64::from(i)).sin()).collect::<Vec<_>>();
        let (after, before, mut force) = (wave(0.3), wave(0.7), vec![0.0; 1003]);
        let at: Vec<u32> = (0..1003).filter(|i| i % 7 == 2 || *i > 998).collect();
        at.iter().for_each(|i| force[*i as usize] = f64::from(*i).cos());
        let all = work(&force, &after, &before);
        assert_eq!(work_at(&at, &force, &after, &before).to_bits(), all.to_bits());
        assert!(all.abs() > 1.0);
    }

    #[test]
    fn a_wide_sum_is_the_narrow_sum_bit_for_bit() {
        let a: Vec<f64> = (0..1003).map(|i| f64::from(i).sin() * 1e3).collect();
        let mut lanes = [0.0; LANES];
        (0..1000).for_each(|i| lanes[i % LANES] += a[i] * a[i]);
        let narrow = total(lanes, a[1000..].iter().map(|a| a * a));
        assert_eq!(dot(&a, &a).to_bits(), narrow.to_bits());
    }
}
