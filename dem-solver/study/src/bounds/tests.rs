use super::*;
use crate::sampling::unit;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use statrs::distribution::{Binomial, ContinuousCDF, Discrete, DiscreteCDF, Normal};

/// Size of the samples, and how many of them.
const COUNT: u64 = 100;
const REPEATS: u64 = 20_000;

/// Samples of numbers from 0 to 1, each in ascending order.
fn samples(count: usize) -> impl Iterator<Item = Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(29);
    (0..REPEATS).map(move |_| {
        let mut all: Vec<f64> = (0..count).map(|_| unit(random.next_u64())).collect();
        all.sort_by(f64::total_cmp);
        all
    })
}

fn normal(u: f64) -> f64 {
    Normal::new(0.0, 1.0).expect("valid").inverse_cdf(u)
}

/// A distribution by its quantiles.
type Quantile = fn(f64) -> f64;

/// Of 20 000 studies of 100 members with a known distribution the interval holds the true quantile 93 to 97 % of the time; each end misses it in
/// 1 to 4 %. Where values are few, as numbers of impacts are, it holds it more often.
#[test]
fn intervals_of_quantiles_hold_the_true_one_as_often_as_they_say() {
    let continuous: [(&str, Quantile); 3] =
        [("normal", normal), ("lognormal", |u| normal(u).exp()), ("exponential", |u| -(-u).ln_1p())];
    let discrete: [(&str, Quantile); 2] =
        [("20 values", |u| (20.0 * u).floor()), ("rounded normal", |u| (2.0 * normal(u)).round())];
    let all: Vec<_> = continuous.iter().chain(&discrete).collect();
    let shares = [0.1, 0.5, 0.9, 0.95];
    let ends = shares.map(|share| Ends::of(COUNT as usize, share));
    // How often each end misses.
    let mut missed = vec![[[0_u64; 2]; 4]; all.len()];
    for sample in samples(COUNT as usize) {
        for ((_, of), missed) in all.iter().zip(&mut missed) {
            let values: Vec<f64> = sample.iter().map(|u| of(*u)).collect();
            for ((share, ends), missed) in shares.iter().zip(&ends).zip(missed) {
                let Interval { low, high } = ends.on(&values);
                // The smallest value up to which the share lies.
                let exact = of(share - 1e-12);
                missed[0] += u64::from(low.expect("100 are enough") > exact);
                missed[1] += u64::from(high.expect("100 are enough") < exact);
            }
        }
    }
    for (at, ((name, _), missed)) in all.iter().zip(missed).enumerate() {
        for (share, missed) in shares.iter().zip(missed) {
            let [below, above] = missed.map(|n| n as f64 / REPEATS as f64);
            let held = 1.0 - below - above;
            println!("q{:<4} {name:<15} held {held:.4}, beyond {below:.4} and {above:.4}", 100.0 * share);
            let is_discrete = at >= continuous.len();
            assert!(held > 0.93 && (held < 0.97 || is_discrete), "{name} {share}: {held}");
            assert!(is_discrete || [below, above].iter().all(|side| (0.01..0.04).contains(side)));
        }
    }
}

/// The upper bound of a design lies below the true quantile in 5 % of all samples at most; from 59 and 299 rocks on there is one.
#[test]
fn upper_bounds_are_too_low_in_five_percent_at_most() {
    for (share, counts) in [(0.9, [100, 250]), (0.95, [59, 100]), (0.99, [299, 500])] {
        for count in counts {
            let low = samples(count).filter(|u| upper(u, share).expect("enough") < share).count();
            let found = low as f64 / REPEATS as f64;
            let Some((_, [_, reached])) = reaching(count, share, CONFIDENCE) else { unreachable!("enough") };
            println!("q{} of {count}: too low in {found:.4}, exact {:.4}", 100.0 * share, 1.0 - reached);
            assert!(1.0 - reached <= 0.05, "{reached}");
            assert!((found - (1.0 - reached)).abs() < 4.0 * (0.05 / REPEATS as f64).sqrt(), "{found}");
        }
    }
    // By hand: 98 or fewer of 100 lie below the 95 % quantile with 1 - 0.95^100 - 100 * 0.05 * 0.95^99 = 96.3 %, 97 or fewer with 88.2 %.
    let ranks: Vec<f64> = (1..=100).map(f64::from).collect();
    assert_eq!((upper(&ranks, 0.95), upper(&[], 0.95), least(0.5)), (Some(99.0), None, 5));
    for (share, count) in [(0.95, 59), (0.99, 299)] {
        let ones = vec![1.0; count];
        assert_eq!((least(share), upper(&ones, share)), (count, Some(1.0)));
        assert_eq!(upper(&ones[1..], share), None);
    }
}

/// Over all outcomes of 100 members, exactly: no repeats, no chance.
#[test]
fn wilsons_interval_holds_the_true_share_as_often_as_it_says() {
    for percent in (5..=95).step_by(5) {
        let share = f64::from(percent) / 100.0;
        let binomial = Binomial::new(share, COUNT).expect("valid");
        let holds = |k: &u64| {
            let Interval { low, high } = of_share(*k, COUNT);
            low.is_some_and(|low| low <= share) && high.is_some_and(|high| share <= high)
        };
        let held: f64 = (0..=COUNT).filter(holds).map(|k| binomial.pmf(k)).sum();
        println!("share {share:.2}: held {held:.4}");
        assert!((0.93..0.97).contains(&held), "{share}: {held}");
    }
    // By hand: 3.8415 / 103.8415.
    let none = of_share(0, 100);
    assert!(
        none.low == Some(0.0) && none.high.is_some_and(|high| (high - 0.036_993).abs() < 1e-6),
        "{none:?}"
    );
}

/// Of two releases over all outcomes, exactly: whichever of them has the larger rate, and whatever their shares.
#[test]
fn intervals_of_frequencies_hold_the_true_one_as_often_as_they_say() {
    let counts = [60_u64, 40];
    let (mut least, mut sum, mut cases) = (1.0_f64, 0.0, 0.0);
    for ratio in [1.0, 5.0, 40.0] {
        for shares in [[0.5, 0.5], [0.1, 0.7], [0.3, 0.05], [0.05, 0.05], [0.9, 0.2]] {
            let rates = [0.02, 0.02 * ratio];
            let exact = rates[0] * shares[0] + rates[1] * shares[1];
            let [first, second] = [0, 1].map(|k| Binomial::new(shares[k], counts[k]).expect("valid"));
            let mut held = 0.0;
            for (j, k) in (0..=counts[0]).flat_map(|j| (0..=counts[1]).map(move |k| (j, k))) {
                let part = |at: usize, count| Part { rate: rates[at], count, all: counts[at] };
                let (_, Interval { low, high }) = of_frequency([part(0, j), part(1, k)].into_iter());
                let holds = low.is_some_and(|low| low <= exact) && high.is_some_and(|high| exact <= high);
                held += if holds { first.pmf(j) * second.pmf(k) } else { 0.0 };
            }
            println!("rates 1 : {ratio}, shares {shares:?}: held {held:.4}");
            assert!((0.92..0.985).contains(&held), "{held}");
            (least, sum, cases) = (least.min(held), sum + held, cases + 1.0);
        }
    }
    println!("least {least:.4}, mean {:.4}", sum / cases);
    // Of one release Wilson's, times the rate.
    let (found, of) = of_frequency(std::iter::once(Part { rate: 0.2, count: 7, all: 50 }));
    let share = of_share(7, 50);
    let times = |end: Option<f64>| 0.2 * end.expect("there is one");
    assert!((found - 0.028).abs() < 1e-15);
    for (end, due) in [(of.low, times(share.low)), (of.high, times(share.high))] {
        assert!(end.is_some_and(|end| (end - due).abs() < 1e-15), "{end:?} {due}");
    }
}

/// For a high quantile of few rocks there is no upper end: 2.5 % of all samples must lie below it altogether.
#[test]
fn a_sample_that_is_too_small_has_no_upper_end() {
    for (share, least) in [(0.5, 6), (0.9, 36), (0.95, 72), (0.99, 368)] {
        let values: Vec<f64> = (0..least).map(f64::from).collect();
        assert!(of_quantile(&values, share).high.is_some(), "{share}");
        assert_eq!(of_quantile(&values[1..], share).high, None, "{share}");
        // The other way round for the lowest ones.
        assert!(
            of_quantile(&values, 1.0 - share).low.is_some()
                && of_quantile(&values[1..], 1.0 - share).low.is_none()
        );
    }
    assert_eq!(of_quantile(&[], 0.5), Interval { low: None, high: None });
    let twenty: Vec<f64> = (0..20).map(f64::from).collect();
    assert!(of_quantile(&twenty, 0.95).low.is_some_and(|low| (13.0..17.0).contains(&low)));
}

/// Ranks against the cumulative distribution itself, up to studies of a million.
#[test]
fn ranks_are_those_of_the_binomial_distribution() {
    for count in [10, 100, 1000, 20_000] {
        for share in [0.01, 0.1, 0.5, 0.9, 0.99] {
            let Some((k, [before, reached])) = reaching(count, share, SIDE) else { continue };
            let binomial = Binomial::new(share, count as u64).expect("valid");
            assert!((binomial.cdf(k as u64) - reached).abs() < 1e-7, "{count} {share}: {reached}");
            assert!(before < SIDE && SIDE <= reached);
        }
    }
    // By the normal distribution: the rank is that of so many deviations above the mean.
    let (k, _) = reaching(1_000_000, 0.95, SIDE).expect("enough");
    let due = 950_000.0 + DEVIATIONS * (1e6_f64 * 0.95 * 0.05).sqrt();
    assert!((k as f64 - due).abs() < 2.0, "{k} {due}");
}

#[test]
fn quantiles_lie_between_two_members_in_proportion() {
    let values = [1.0, 2.0, 4.0, 8.0, 16.0];
    assert_eq!([0.0, 0.25, 0.5, 0.875, 1.0].map(|s| quantile(&values, s)), [1.0, 2.0, 4.0, 12.0, 16.0]);
    assert_eq!(quantile(&[3.0], 0.95), 3.0);
}
