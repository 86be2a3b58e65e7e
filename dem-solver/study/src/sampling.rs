//! Numbers from 0 to 1 for every member and everything that varies.
//!
//! Each is a function of the study's seed, the release, the member's place in it and the name of what varies, whatever was
//! asked for before: members can be computed in any order and anywhere. A quantity that is added changes no other one, but
//! with Sobol's sequence, whose dimensions are counted. A replicate that is added changes no member before it: a Latin hypercube is
//! followed by another one, all others go on.

use super::settings::Sampling;
use interface_defs::ipc::run_id::fnv1a;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The numbers of one release.
#[derive(Debug, Clone)]
pub struct Sampler {
    sampling: Sampling,
    seed: u64,
    release: usize,
    /// Members of a replicate.
    count: u64,
    /// Of Latin hypercubes, one behind the other, the part that each member has, for each dimension.
    parts: Vec<Vec<u32>>,
    /// What varies, one name for each number that is drawn.
    names: Vec<String>,
    /// For a full factorial the number of levels; 0: none, the number is random.
    levels: Vec<u64>,
}

fn generator(seed: u64, stream: &str) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(fnv1a(stream.as_bytes()));
    random
}

/// The 53 bits that a double from 0 to 1 holds.
pub(crate) fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

impl Sampler {
    /// For release number `release` with `count` members in each of so many replicates; `names`: what varies, and its levels.
    pub fn new(
        sampling: Sampling,
        seed: u64,
        release: usize,
        [count, replicates]: [u64; 2],
        names: Vec<(String, u64)>,
    ) -> Self {
        let (names, levels): (Vec<String>, Vec<u64>) = names.into_iter().unzip();
        let mut it = Self { sampling, seed, release, count, parts: Vec::new(), names, levels };
        if sampling == Sampling::LatinHypercube {
            let of =
                |dimension| (0..replicates).flat_map(|replicate| it.shuffled(dimension, replicate)).collect();
            it.parts = (0..it.names.len()).map(of).collect();
        }
        it
    }

    /// The parts of a dimension in an order of its own in each replicate.
    fn shuffled(&self, dimension: usize, replicate: u64) -> Vec<u32> {
        let again = if replicate > 0 { format!("replicate {replicate} ") } else { String::new() };
        let stream = format!("{again}part {} {}", self.release, self.names[dimension]);
        let mut random = generator(self.seed, &stream);
        let mut parts: Vec<u32> = (0..self.count as u32).collect();
        for last in (1..parts.len()).rev() {
            // Of 64 bits for a number of 32: no place is preferred by more than 2e-10.
            let other = ((u128::from(random.next_u64()) * (last as u128 + 1)) >> 64) as usize;
            parts.swap(last, other);
        }
        parts
    }

    fn random(&self, dimension: usize, index: u64) -> f64 {
        let mut random = generator(self.seed, &format!("{} {}", self.release, self.names[dimension]));
        random.set_word_pos(2 * u128::from(index));
        unit(random.next_u64())
    }

    /// Number `dimension` of the member at `index` of the release.
    pub fn at(&self, dimension: usize, index: u64) -> f64 {
        match self.sampling {
            Sampling::Random => self.random(dimension, index),
            Sampling::LatinHypercube => {
                let part = f64::from(self.parts[dimension][index as usize]);
                (part + self.random(dimension, index)) / self.count as f64
            }
            Sampling::Sobol => {
                let seed = fnv1a(format!("{} {}", self.seed, self.release).as_bytes()) as u32;
                f64::from(sobol_burley::sample(index as u32, dimension as u32, seed))
            }
            Sampling::FullFactorial => {
                let before: u64 = self.levels[..dimension].iter().map(|l| (*l).max(1)).product();
                match self.levels[dimension] {
                    0 => self.random(dimension, index),
                    levels => ((index / before % levels) as f64 + 0.5) / levels as f64,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampler(sampling: Sampling, seed: u64, count: u64) -> Sampler {
        let names = ["a", "b", "c"].map(|name| (name.to_owned(), 0));
        Sampler::new(sampling, seed, 0, [count, 1], names.into())
    }

    #[test]
    fn a_number_depends_on_nothing_but_seed_member_and_name() {
        for sampling in [Sampling::Random, Sampling::LatinHypercube, Sampling::Sobol] {
            let (one, again) = (sampler(sampling, 7, 100), sampler(sampling, 7, 100));
            let forward: Vec<f64> = (0..300).map(|k| one.at(k % 3, (k / 3) as u64)).collect();
            let mut backward: Vec<f64> = (0..300).rev().map(|k| again.at(k % 3, (k / 3) as u64)).collect();
            backward.reverse();
            assert_eq!(forward, backward);
            let other = sampler(sampling, 8, 100);
            assert_ne!(forward[..3], [0, 1, 2].map(|d| other.at(d, 0)));
            assert!(forward.iter().all(|u| (0.0..1.0).contains(u)));
        }
    }

    /// Each of the equal parts has one member; the means are those of evenly spread numbers.
    #[test]
    fn members_of_a_latin_hypercube_share_out_every_distribution() {
        let it = sampler(Sampling::LatinHypercube, 3, 50);
        for dimension in 0..3 {
            let mut parts: Vec<usize> = (0..50).map(|k| (50.0 * it.at(dimension, k)) as usize).collect();
            assert_ne!(parts, (0..50).collect::<Vec<_>>());
            parts.sort_unstable();
            assert_eq!(parts, (0..50).collect::<Vec<_>>());
        }
    }

    /// Members of three replicates: the first are those of one alone, and each Latin hypercube shares out every distribution by itself, in
    /// an order of its own.
    #[test]
    fn replicates_follow_without_changing_what_was_before() {
        let names = || ["a", "b"].map(|name| (name.to_owned(), 0)).to_vec();
        for sampling in [Sampling::Random, Sampling::LatinHypercube, Sampling::Sobol] {
            let [one, three] = [1, 3].map(|n| Sampler::new(sampling, 7, 0, [50, n], names()));
            let of = |it: &Sampler, range: std::ops::Range<u64>| -> Vec<f64> {
                range.map(|k| it.at(1, k)).collect()
            };
            assert_eq!(of(&one, 0..50), of(&three, 0..50));
            if sampling == Sampling::LatinHypercube {
                let parts =
                    |range| -> Vec<u64> { of(&three, range).iter().map(|u| (50.0 * u) as u64).collect() };
                let all = [parts(0..50), parts(50..100), parts(100..150)];
                assert!(all[0] != all[1] && all[1] != all[2]);
                for mut parts in all {
                    parts.sort_unstable();
                    assert_eq!(parts, (0..50).collect::<Vec<_>>());
                }
            }
        }
    }

    /// Random numbers have mean 1/2 and variance 1/12 within four standard errors, and neighbours do not depend on each other; in
    /// each of 8 x 8 fields of two dimensions Sobol's first 64 numbers have one.
    #[test]
    fn random_numbers_are_independent_and_sobol_numbers_even() {
        let it = sampler(Sampling::Random, 11, 40_000);
        let n = 40_000.0;
        let values: Vec<f64> = (0..40_000).map(|k| it.at(1, k)).collect();
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - 0.5).powi(2)).sum::<f64>() / n;
        let together = values.windows(2).map(|p| (p[0] - 0.5) * (p[1] - 0.5)).sum::<f64>() / n;
        assert!((mean - 0.5).abs() < 4.0 * (1.0 / 12.0 / n).sqrt(), "{mean}");
        assert!((variance - 1.0 / 12.0).abs() < 4.0 * (1.0 / 180.0 / n).sqrt(), "{variance}");
        assert!(together.abs() < 4.0 / 12.0 / n.sqrt(), "{together}");
        let it = sampler(Sampling::Sobol, 5, 64);
        let mut fields = [0; 64];
        (0..64).for_each(|k| fields[(8.0 * it.at(0, k)) as usize * 8 + (8.0 * it.at(1, k)) as usize] += 1);
        assert_eq!(fields, [1; 64]);
    }

    #[test]
    fn a_full_factorial_has_every_combination_once() {
        let names = vec![("place".into(), 2), ("turn".into(), 0), ("e".into(), 3), ("mu".into(), 2)];
        let it = Sampler::new(Sampling::FullFactorial, 1, 0, [12, 1], names);
        let mut all: Vec<[u64; 3]> =
            (0..12).map(|k| [(0, 2.0), (2, 3.0), (3, 2.0)].map(|(d, l)| (l * it.at(d, k)) as u64)).collect();
        all.sort_unstable();
        let expected: Vec<[u64; 3]> = (0..12).map(|k| [k / 6, k / 2 % 3, k % 2]).collect();
        assert_eq!(all, expected);
        assert_ne!(it.at(1, 0), it.at(1, 1));
    }
}
