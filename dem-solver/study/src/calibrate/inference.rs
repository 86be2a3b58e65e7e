//! Which parameters go with what was observed, from a table of parameters that were tried and what came of each: approximate Bayesian
//! computation. There is no formula for the likelihood of a fall, but falls can be computed.
//!
//! Samples are compared by few numbers. These become one number for each parameter, its linear prediction from all of them (Fearnhead and
//! Prangle 2012, J. R. Stat. Soc. B 74, 419): first over all cases, then over the half that is nearest. The nearest of these are kept,
//! weighted by Epanechnikov's kernel, and moved to what was observed along a linear regression (Beaumont, Zhang and Balding 2002,
//! Genetics 162, 2025), of parameters on a logistic scale, which stays within the prior range (Blum and François 2010, Stat. Comput. 20, 63).
//!
//! Whether that holds is measured by the table itself: cases near to what was observed are taken as if observed, one after the other
//! (Prangle et al. 2014, Aust. N. Z. J. Stat. 56, 309). Ranges that hold less often than they say are widened by as much as that takes, as in
//! conformal prediction (Romano, Patterson and Candès 2019, NeurIPS 32).

use crate::bounds::quantile;
use nalgebra::{DMatrix, DMatrixView};
use serde::Serialize;

/// What ranges hold.
pub const LEVEL: f64 = 0.9;
/// Share of all cases that is kept.
const NEAREST: f64 = 0.3;
/// Share on which the predictions that are compared are made.
const HALF: f64 = 0.5;
/// Of each coefficient, over the variance that its variable has.
const PENALTY: f64 = 0.01;
/// Most cases that are taken as if observed.
const TRIALS: usize = 100;
/// Fewest cases that can be computed with.
pub const FEWEST: usize = 40;
/// A range wider than this share of what was searched says next to nothing: before the data it was 0.9.
const WIDE: f64 = 0.75;
/// Least share of the variance that data must explain to have settled a parameter.
const EXPLAINED: f64 = 0.1;
/// A range that has to be widened by more than this is one of another posterior.
const MOST_WIDENED: f64 = 2.0;

/// One set of parameters that was tried, and what came of it.
#[derive(Debug, Clone, Default)]
pub struct Case {
    /// Where each parameter lies in its range, from 0 to 1.
    pub values: Vec<f64>,
    /// Of each observable the numbers by which its sample is compared; `None`: there are too few values.
    pub samples: Vec<Option<Vec<f64>>>,
}

/// All of them.
pub struct CaseTable {
    /// The cases.
    pub cases: Vec<Case>,
    /// Which observables are fitted; the others are predicted.
    pub fitted: Vec<bool>,
}

interface_defs::worded! {
    /// Whether data settle a parameter.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Verdict with sentence {
        /// They do.
        Settled = "settled",
        /// The range is as wide as what was searched, or cases that were taken as observed were not found again.
        NotSettled = "not settled by these data",
        /// The range of cases that were taken as observed held too few of them.
        NotTrusted = "not trusted",
    }
}

/// What data say of a parameter; places in its range, from 0 to 1.
#[derive(Debug, Clone)]
pub struct Posterior {
    /// 5, 50 and 95 %.
    pub range: [f64; 3],
    /// In how many of the cases that were taken as observed the range held the parameter, before it was widened.
    pub coverage: f64,
    /// What both sides of the range were multiplied by.
    pub widened: f64,
    /// Share of the variance of the prior range that is explained in these cases.
    pub explained: f64,
    /// What follows.
    pub verdict: Verdict,
}

/// What is predicted of an observable.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// 5, 50 and 95 % of each number by which samples are compared.
    pub ranges: Vec<[f64; 3]>,
    /// In which share of the cases that were taken as observed the sample was as far off, or farther.
    pub p: f64,
    /// Whether it was in none of them.
    pub farthest: bool,
}

/// All that follows.
pub struct Answer {
    /// Of each parameter.
    pub parameters: Vec<Posterior>,
    /// Of each observable; `None`: too few cases have it.
    pub predictions: Vec<Option<Prediction>>,
    /// The cases that were kept: number, weight, and where the parameters lie when moved to what was observed.
    pub kept: Vec<(usize, f64, Vec<f64>)>,
    /// Correlation of each pair of parameters among these.
    pub correlations: Vec<(usize, usize, f64)>,
    /// Whether what was observed is farther from all cases than any that was taken as if observed: then a regression says nothing.
    pub outside: bool,
    /// How many cases had all that is fitted, and how many of these were taken as if observed.
    pub counts: [usize; 2],
}

/// Values with weights, in ascending order.
struct Weighted(Vec<(f64, f64)>);

impl Weighted {
    fn new(mut all: Vec<(f64, f64)>) -> Self {
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self(all)
    }

    /// The value below which this share lies, between the middles of two weights in proportion.
    fn quantile(&self, share: f64) -> f64 {
        let goal = share * self.0.iter().map(|(_, weight)| weight).sum::<f64>();
        let (mut below, mut last) = (0.0, None::<(f64, f64)>);
        for (value, weight) in &self.0 {
            let middle = below + 0.5 * weight;
            if middle >= goal {
                return last
                    .map_or(*value, |(at, before)| before + (goal - at) / (middle - at) * (value - before));
            }
            (below, last) = (below + weight, Some((middle, *value)));
        }
        last.map_or(f64::NAN, |(_, value)| value)
    }

    fn range(&self) -> [f64; 3] {
        [0.5 - 0.5 * LEVEL, 0.5, 0.5 + 0.5 * LEVEL].map(|share| self.quantile(share))
    }

    fn deviation(&self) -> f64 {
        let sum = |of: &dyn Fn(f64) -> f64| self.0.iter().map(|(v, w)| w * of(*v)).sum::<f64>();
        let (all, mean) = (sum(&|_| 1.0), sum(&|v| v) / sum(&|_| 1.0));
        (sum(&|v| (v - mean).powi(2)) / all).sqrt()
    }
}

fn logit(u: f64) -> f64 {
    let u = u.clamp(1e-9, 1.0 - 1e-9);
    (u / (1.0 - u)).ln()
}

fn logistic(z: f64) -> f64 {
    1.0 / (1.0 + (-z).exp())
}

/// `a b`, column by column: the product of whole matrices is left to a crate that fuses products with sums where the processor can.
fn product(a: &DMatrix<f64>, b: &DMatrixView<f64>) -> DMatrix<f64> {
    let mut product = DMatrix::zeros(a.nrows(), b.ncols());
    product.column_iter_mut().zip(b.column_iter()).for_each(|(mut to, b)| to.gemv(1.0, a, &b, 0.0));
    product
}

/// Coefficients of a penalised linear regression of all columns of `y` on a constant and the columns of `x`.
fn regression(x: &DMatrix<f64>, y: &DMatrix<f64>, weights: &[f64]) -> DMatrix<f64> {
    let full = x.clone().insert_column(0, 1.0);
    let mut weighted = full.clone();
    weighted.row_iter_mut().zip(weights).for_each(|(mut row, weight)| row *= *weight);
    let mut normal = weighted.tr_mul(&full);
    let sum: f64 = weights.iter().sum();
    for k in 1..normal.nrows() {
        // About the mean; of a column that is constant any number does.
        let variance = normal[(k, k)] / sum - (normal[(0, k)] / sum).powi(2);
        normal[(k, k)] += sum * (PENALTY * variance).max(1e-12 * (1.0 + normal[(k, k)] / sum));
    }
    let right = weighted.tr_mul(y);
    normal.lu().solve(&right).unwrap_or_else(|| DMatrix::zeros(full.ncols(), y.ncols()))
}

/// Cases near to what was observed.
struct Near {
    /// The cases that were kept, with their weights.
    kept: Vec<(usize, f64)>,
    /// How their predictions of each parameter differ from that of what was observed.
    offsets: DMatrix<f64>,
    /// All cases, the nearest first.
    order: Vec<usize>,
    /// How far off the farthest of those that were kept is.
    widest: f64,
}

impl Near {
    /// Numbers of the kept cases, where `of` has them, as if they were observed: with their weights.
    fn moved(&self, of: &dyn Fn(usize) -> Option<f64>) -> Vec<(f64, f64)> {
        let there: Vec<(usize, f64, f64)> = (self.kept.iter().enumerate())
            .filter_map(|(row, (case, weight))| Some((row, of(*case)?, *weight)))
            .collect();
        let x = self.offsets.select_rows(there.iter().map(|(row, ..)| row));
        let y = DMatrix::from_iterator(there.len(), 1, there.iter().map(|(_, value, _)| *value));
        let weights: Vec<f64> = there.iter().map(|(.., weight)| *weight).collect();
        let found = regression(&x, &y, &weights);
        let slope = found.rows(1, x.ncols());
        let moved = y - product(&x, &slope);
        moved.iter().copied().zip(weights).collect()
    }
}

impl CaseTable {
    /// All numbers that are fitted, one behind the other; `None` where some are missing.
    fn fitted(&self, case: &Case) -> Option<Vec<f64>> {
        let own = case.samples.iter().zip(&self.fitted).filter(|(_, fitted)| **fitted);
        own.map(|(sample, _)| sample.clone()).collect::<Option<Vec<_>>>().map(|all| all.concat())
    }

    /// The cases near to `observed`, of all but `skip`.
    fn near(&self, observed: &[f64], skip: Option<usize>) -> Near {
        let used = self.cases.iter().enumerate().filter(|(at, _)| Some(*at) != skip);
        let mut used: Vec<(usize, Vec<f64>)> =
            used.filter_map(|(at, case)| Some((at, self.fitted(case)?))).collect();
        let all = used.len();
        let (mut order, mut found) = (Vec::new(), DMatrix::zeros(0, 0));
        let mut distances: Vec<f64> = Vec::new();
        for share in [HALF, NEAREST] {
            let parameters = self.cases[0].values.len();
            let x = DMatrix::from_fn(used.len(), observed.len(), |row, k| used[row].1[k] - observed[k]);
            let y =
                DMatrix::from_fn(used.len(), parameters, |row, k| logit(self.cases[used[row].0].values[k]));
            let slope = regression(&x, &y, &vec![1.0; used.len()]);
            let offsets = product(&x, &slope.rows(1, observed.len()));
            let mut by: Vec<(f64, usize)> = offsets.row_iter().map(|row| row.norm()).zip(0..).collect();
            by.sort_by(|a, b| a.0.total_cmp(&b.0));
            if order.is_empty() {
                order = by.iter().map(|(_, row)| used[*row].0).collect();
            }
            by.truncate((share * all as f64).ceil() as usize);
            found = offsets.select_rows(by.iter().map(|(_, row)| row));
            used = by.iter().map(|(_, row)| used[*row].clone()).collect();
            distances = by.iter().map(|(distance, _)| *distance).collect();
        }
        let widest = distances.last().map_or(1.0, |last| 1.001 * last).max(f64::MIN_POSITIVE);
        let weights = distances.iter().map(|distance| 1.0 - (distance / widest).powi(2));
        let kept = used.iter().map(|(at, _)| *at).zip(weights).collect();
        Near { kept, offsets: found, order, widest }
    }

    /// How far off an observable is: the largest distance of its numbers from what is predicted, in standard deviations, as the share of the
    /// predicted samples that are as far off; with the ranges.
    fn predicted(&self, near: &Near, observed: &Case, of: usize) -> Option<Prediction> {
        let own = observed.samples[of].as_ref()?;
        let sample = |case: usize| self.cases[case].samples[of].as_ref();
        if near.kept.iter().filter(|(case, _)| sample(*case).is_some()).count() < FEWEST / 4 {
            return None;
        }
        let moved: Vec<Vec<(f64, f64)>> =
            (0..own.len()).map(|k| near.moved(&|case| Some(sample(case)?[k]))).collect();
        let known: Vec<Weighted> = moved.iter().map(|all| Weighted::new(all.clone())).collect();
        let scale: Vec<(f64, f64)> =
            known.iter().map(|all| (all.quantile(0.5), all.deviation().max(f64::MIN_POSITIVE))).collect();
        let off = |value: &dyn Fn(usize) -> f64| {
            let all = scale.iter().enumerate().map(|(k, (middle, one))| (value(k) - middle).abs() / one);
            all.fold(0.0, f64::max)
        };
        let limit = off(&|k| own[k]);
        let (mut beyond, mut all) = (0.0, 0.0);
        for (row, (_, weight)) in moved[0].iter().enumerate() {
            all += weight;
            beyond += if off(&|k| moved[k][row].0) >= limit { *weight } else { 0.0 };
        }
        // Beyond all samples the distance itself says which of two is farther off.
        let p = if beyond > 0.0 { beyond / all } else { -limit };
        Some(Prediction { ranges: known.iter().map(Weighted::range).collect(), p, farthest: false })
    }

    /// What `observed` says of the parameters, and what follows for what was left out. `None`: too few cases have all that is fitted.
    pub fn answer(&self, observed: &Case) -> Option<Answer> {
        let known = self.fitted(observed)?;
        let complete = self.cases.iter().filter(|case| self.fitted(case).is_some()).count();
        if complete < FEWEST {
            return None;
        }
        let near = self.near(&known, None);
        let parameters = self.cases[0].values.len();
        let moved = |near: &Near, k: usize| near.moved(&|case| Some(logit(self.cases[case].values[k])));
        let trials: Vec<usize> = near.order.iter().copied().take(TRIALS).collect();
        let nearby: Vec<Near> = (trials.iter())
            .map(|at| self.near(&self.fitted(&self.cases[*at]).expect("it is complete"), Some(*at)))
            .collect();
        let posterior = |k: usize| {
            // By how much the range of each case must be widened to hold it, and how far off its middle is.
            let mut needed = Vec::with_capacity(trials.len());
            let mut error = 0.0;
            for (at, near) in trials.iter().zip(&nearby) {
                let [low, middle, high] = Weighted::new(moved(near, k)).range();
                let own = logit(self.cases[*at].values[k]);
                let side = if own > middle { high - middle } else { middle - low };
                needed.push((own - middle).abs() / side.max(f64::MIN_POSITIVE));
                error += (logistic(middle) - logistic(own)).powi(2) / trials.len() as f64;
            }
            let coverage = needed.iter().filter(|it| **it <= 1.0).count() as f64 / needed.len() as f64;
            needed.sort_by(f64::total_cmp);
            // This share is found from few cases: with its standard error, the range rather holds more often than it says.
            let place = LEVEL + (LEVEL * (1.0 - LEVEL) / needed.len() as f64).sqrt();
            let widened = quantile(&needed, place.min(1.0)).max(1.0);
            let [low, middle, high] = Weighted::new(moved(&near, k)).range();
            let wider = |end: f64| logistic(middle + widened * (end - middle));
            let range = [wider(low), logistic(middle), wider(high)];
            // The variance of a place that is as likely everywhere is 1/12.
            let explained = 1.0 - 12.0 * error;
            let verdict = match () {
                () if widened > MOST_WIDENED => Verdict::NotTrusted,
                () if range[2] - range[0] > WIDE || explained < EXPLAINED => Verdict::NotSettled,
                () => Verdict::Settled,
            };
            Posterior { range, coverage, widened, explained, verdict }
        };
        let prediction = |of: usize| {
            let mut own = self.predicted(&near, observed, of)?;
            let tried = trials.iter().zip(&nearby);
            let tried: Vec<f64> =
                tried.filter_map(|(at, near)| Some(self.predicted(near, &self.cases[*at], of)?.p)).collect();
            let beyond = tried.iter().filter(|p| **p <= own.p).count();
            own.farthest = beyond == 0;
            own.p = (1 + beyond) as f64 / (1 + tried.len()) as f64;
            Some(own)
        };
        let all: Vec<Vec<(f64, f64)>> = (0..parameters).map(|k| moved(&near, k)).collect();
        let kept = near.kept.iter().enumerate();
        let kept = kept.map(|(row, (case, weight))| {
            (*case, *weight, all.iter().map(|own| logistic(own[row].0)).collect())
        });
        let pairs = (0..parameters).flat_map(|a| (a + 1..parameters).map(move |b| (a, b)));
        Some(Answer {
            parameters: (0..parameters).map(posterior).collect(),
            predictions: (0..self.fitted.len()).map(prediction).collect(),
            kept: kept.collect(),
            correlations: pairs.map(|(a, b)| (a, b, correlation(&all[a], &all[b]))).collect(),
            outside: nearby.iter().all(|own| own.widest < near.widest),
            counts: [complete, trials.len()],
        })
    }
}

/// Of two numbers of the same cases, with the same weights.
fn correlation(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
    let sum: f64 = a.iter().map(|(_, weight)| weight).sum();
    let mean = |of: &dyn Fn(usize) -> f64| (0..a.len()).map(|k| a[k].1 * of(k)).sum::<f64>() / sum;
    let [first, second] = [a, b].map(|all| mean(&|k| all[k].0));
    let product =
        |x: &[(f64, f64)], mx: f64, y: &[(f64, f64)], my: f64| mean(&|k| (x[k].0 - mx) * (y[k].0 - my));
    product(a, first, b, second)
        / (product(a, first, a, first) * product(b, second, b, second)).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests;
