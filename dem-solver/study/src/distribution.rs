//! How a number of a study is distributed, by its quantiles: a number from 0 to 1 becomes a value.
//!
//! `{ uniform = [low, high] }`, `{ normal = [mean, standard deviation] }`, `{ lognormal = [median, factor] }` (two thirds of all
//! values lie between median / factor and median * factor), `{ power_law = [least, most, exponent] }` (the number of values above v falls
//! with v to the power -exponent), `{ table = [[value, share], ...] }`, `{ choice = [a, b], weights = [2, 1] }`, or one value. The two
//! normal ones are cut at three deviations, or `within = [low, high]`. `levels = n`: values of a full factorial.

use interface_defs::diagnostic::Diagnostic;
use schemars::generate::SchemaGenerator;
use schemars::{JsonSchema, Schema, json_schema};
use serde::Deserialize;
use statrs::distribution::{ContinuousCDF, Normal};
use std::borrow::Cow;
use toolkit::scene::{Scene, number};

/// Deviations from the middle beyond which normal values are cut off unless the study says where.
const TAILS: f64 = 3.0;

/// A distribution as it is written.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Spec {
    /// `[low, high]`: every value between is as likely as any other.
    uniform: Option<[f64; 2]>,
    /// `[mean, standard deviation]`.
    normal: Option<[f64; 2]>,
    /// `[median, factor]`: two thirds of all values lie between median / factor and median * factor.
    lognormal: Option<[f64; 2]>,
    /// `[least, most, exponent]`: the number of values above v falls with v to the power -exponent, up to the largest one.
    power_law: Option<[f64; 3]>,
    /// `[[value, share], ...]`: the share (0 to 1) of all values up to each, in ascending order from 0 to 1; linear between.
    table: Option<Vec<[f64; 2]>>,
    /// One of these values.
    #[schemars(with = "Option<Vec<serde_json::Value>>")]
    choice: Option<Vec<toml::Value>>,
    /// How often each value of `choice`. Default all alike.
    weights: Option<Vec<f64>>,
    /// `[low, high]`: where `normal` and `lognormal` are cut. Default three deviations.
    within: Option<[f64; 2]>,
    /// Number of values in a full factorial. Default none: drawn at random.
    levels: Option<u32>,
}

/// A number or a distribution, for editors; [`Distribution::of`] reads it.
pub struct Spread;

impl JsonSchema for Spread {
    fn schema_name() -> Cow<'static, str> {
        "Spread".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let spec = Spec::json_schema(generator);
        json_schema!({ "anyOf": [{ "type": "number" }, spec] })
    }
}

/// Keys of which one makes a table a distribution.
const FORMS: [&str; 6] = ["uniform", "normal", "lognormal", "power_law", "table", "choice"];

/// A distribution.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    form: Form,
    /// Number of levels of a full factorial.
    pub levels: u64,
}

#[derive(Debug, Clone, PartialEq)]
enum Form {
    /// One of these, and the share of all up to each.
    Choice(Vec<toml::Value>, Vec<f64>),
    Uniform([f64; 2]),
    /// Of the value, or of its logarithm: mean, deviation, and where it is cut.
    Normal {
        mean: f64,
        deviation: f64,
        within: [f64; 2],
        log: bool,
    },
    /// From the least to the largest value, and the exponent of the number above a value.
    PowerLaw {
        range: [f64; 2],
        exponent: f64,
    },
    /// Values, and the share of all up to each.
    Table(Vec<[f64; 2]>),
}

/// The normal distribution of mean 0 and deviation 1.
fn standard() -> Normal {
    Normal::new(0.0, 1.0).expect("a deviation above 0")
}

impl Distribution {
    /// Whether a value is one, and not a table of others.
    pub fn is_one(value: &toml::Value) -> bool {
        value.as_table().is_none_or(|table| FORMS.iter().any(|form| table.contains_key(*form)))
    }

    /// From the value at `key` of a study.
    pub fn of(value: &toml::Value, key: &str, study: &Scene) -> Result<Self, Diagnostic> {
        if !value.is_table() {
            return Ok(Self { form: Form::Choice(vec![value.clone()], vec![1.0]), levels: 1 });
        }
        if !Self::is_one(value) {
            let what = format!("a distribution has one of {}", FORMS.join(", "));
            return study.refuse(key, what, "write { uniform = [0.2, 0.4] }");
        }
        let spec = study.read_value::<Spec>(key, value)?;
        let levels = spec.levels.map_or(1, u64::from);
        let form = spec.form().map_err(|(what, cure)| study.invalid(key, what).try_instead(cure))?;
        let levels = if let Form::Choice(values, _) = &form { values.len() as u64 } else { levels };
        Ok(Self { form, levels })
    }

    /// The values of a choice.
    pub fn values(&self) -> Option<&[toml::Value]> {
        match &self.form {
            Form::Choice(values, _) => Some(values),
            _ => None,
        }
    }

    /// Smallest and largest value; `None` where some are not numbers.
    pub fn range(&self) -> Option<[f64; 2]> {
        match &self.form {
            Form::Choice(values, _) => {
                let around = [f64::INFINITY, f64::NEG_INFINITY];
                let wider = |[low, high]: [f64; 2], value| {
                    number(value).map(|number| [low.min(number), high.max(number)])
                };
                values.iter().try_fold(around, wider)
            }
            Form::Uniform(range) | Form::PowerLaw { range, .. } => Some(*range),
            Form::Table(rows) => Some([rows[0][0], rows[rows.len() - 1][0]]),
            Form::Normal { within, .. } => Some(*within),
        }
    }

    /// The values at both ends of the range; of a choice without numbers the first and the last.
    pub fn ends(&self) -> [toml::Value; 2] {
        match (&self.form, self.range()) {
            (Form::Choice(values, _), Some(range)) => {
                // As it is written: a whole number stays one.
                range.map(|end| values.iter().find(|v| number(v) == Some(end)).unwrap_or(&values[0]).clone())
            }
            (Form::Choice(values, _), None) => [values[0].clone(), values[values.len() - 1].clone()],
            (_, range) => range.unwrap_or([f64::NAN; 2]).map(toml::Value::Float),
        }
    }

    /// Whether its form has tails that `within` cuts.
    pub fn has_tails(&self) -> bool {
        matches!(self.form, Form::Normal { .. })
    }

    /// Of a choice, which one stands at the share `u` (0 to 1) of all.
    pub fn chosen(&self, u: f64) -> usize {
        match &self.form {
            Form::Choice(values, shares) => {
                shares.iter().position(|share| u < *share).unwrap_or(values.len() - 1)
            }
            _ => 0,
        }
    }

    /// The value below which the share `u` (0 to 1) of all lies.
    pub fn value(&self, u: f64) -> toml::Value {
        match &self.form {
            Form::Choice(values, _) => values[self.chosen(u)].clone(),
            _ => toml::Value::Float(self.quantile(u)),
        }
    }

    /// The same as a number; NaN where it is not a number.
    pub fn quantile(&self, u: f64) -> f64 {
        match &self.form {
            Form::Choice(values, _) => number(&values[self.chosen(u)]).unwrap_or(f64::NAN),
            Form::Uniform([low, high]) => low + u * (high - low),
            Form::PowerLaw { range: [least, most], exponent } => {
                let above_most = (most / least).powf(-exponent);
                (least * (1.0 - u * (1.0 - above_most)).powf(-1.0 / exponent)).clamp(*least, *most)
            }
            Form::Table(rows) => {
                let next = rows.partition_point(|[_, share]| *share < u).clamp(1, rows.len() - 1);
                let [[low, before], [high, share]] = [rows[next - 1], rows[next]];
                if share > before { low + (u - before) / (share - before) * (high - low) } else { low }
            }
            Form::Normal { mean, deviation, within, log } => {
                let scaled = |v: f64| ((if *log { v.ln() } else { v }) - mean) / deviation;
                let [low, high] = within.map(|v| standard().cdf(scaled(v)));
                let drawn = mean + deviation * standard().inverse_cdf(low + u * (high - low));
                (if *log { drawn.exp() } else { drawn }).clamp(within[0], within[1])
            }
        }
    }
}

/// What is wrong, and what to write instead.
type Wrong = (String, &'static str);

/// A range whose first number lies below its second.
fn rising(name: &str, [low, high]: [f64; 2]) -> Result<[f64; 2], Wrong> {
    match low >= high {
        true => {
            Err((format!("{name} = [{low}, {high}]: the first must lie below the second"), "[low, high]"))
        }
        false => Ok([low, high]),
    }
}

impl Spec {
    /// Refuse keys that do not go with each other.
    fn check(&self) -> Result<(), Wrong> {
        let Self { uniform, normal, lognormal, power_law, table, choice, weights, within, levels } = self;
        let has_tails = normal.is_some() || lognormal.is_some();
        let [law, rows] = [power_law.is_some(), table.is_some()];
        let forms = [uniform.is_some(), normal.is_some(), lognormal.is_some(), law, rows, choice.is_some()];
        let one = forms.iter().filter(|there| **there).count() == 1;
        let counted = levels.is_none_or(|levels| levels > 0 && choice.is_none());
        let what = format!("a distribution is one of {}", FORMS.join(", "));
        let rules = [
            (one, &what[..], "keep one of them"),
            (weights.is_none() || choice.is_some(), "`weights` belongs to `choice`", "leave it out"),
            (
                within.is_none() || has_tails,
                "`within` cuts the tails of normal and lognormal",
                "leave it out",
            ),
            (counted, "`levels`: one or more, of a distribution of numbers", "a choice has its own"),
        ];
        let broken = rules.into_iter().find(|(kept, ..)| !kept);
        broken.map_or(Ok(()), |(_, what, cure)| Err((what.into(), cure)))
    }

    fn form(self) -> Result<Form, Wrong> {
        self.check()?;
        let Self { uniform, normal, lognormal, power_law, table, choice, weights, within, .. } = self;
        let within = within.map(|range| rising("within", range)).transpose()?;
        if let Some(range) = uniform {
            return Ok(Form::Uniform(rising("uniform", range)?));
        }
        if let Some([mean, deviation]) = normal {
            if deviation <= 0.0 {
                let what = format!("a standard deviation of {deviation}: it must lie above 0");
                return Err((what, "[mean, standard deviation]"));
            }
            let within = within.unwrap_or([mean - TAILS * deviation, mean + TAILS * deviation]);
            return Ok(Form::Normal { mean, deviation, within, log: false });
        }
        if let Some([median, factor]) = lognormal {
            if median <= 0.0 || factor <= 1.0 || within.is_some_and(|[low, _]| low <= 0.0) {
                let what = format!(
                    "lognormal = [{median}, {factor}]: the median must lie above 0, the factor above 1, `within` above 0"
                );
                return Err((what, "two thirds of all lie between median / factor and median * factor"));
            }
            let within = within.unwrap_or([median / factor.powf(TAILS), median * factor.powf(TAILS)]);
            return Ok(Form::Normal { mean: median.ln(), deviation: factor.ln(), within, log: true });
        }
        if let Some([least, most, exponent]) = power_law {
            let range = rising("power_law", [least, most])?;
            if least <= 0.0 || exponent <= 0.0 {
                let what =
                    format!("power_law = [{least}, {most}, {exponent}]: least and exponent must lie above 0");
                return Err((what, "[least, most, exponent]"));
            }
            return Ok(Form::PowerLaw { range, exponent });
        }
        if let Some(rows) = table {
            let rises = rows.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] <= pair[1][1]);
            let ends = [rows.first(), rows.last()].map(|row| row.map(|[_, share]| *share));
            if !rises || rows.len() < 2 || ends != [Some(0.0), Some(1.0)] {
                let what =
                    "a table has the share of all values up to each: both ascend, the shares from 0 to 1";
                return Err((what.into(), "[[0.1, 0.0], [0.5, 0.7], [2.0, 1.0]]"));
            }
            return Ok(Form::Table(rows));
        }
        let values = choice.unwrap_or_default();
        if values.is_empty() {
            return Err(("a choice of nothing".into(), "name one value at least"));
        }
        let weights = weights.unwrap_or_else(|| vec![1.0; values.len()]);
        let sum: f64 = weights.iter().sum();
        if weights.len() != values.len() || weights.iter().any(|w| *w < 0.0) || sum <= 0.0 {
            let what = format!("{} weights for {} values", weights.len(), values.len());
            return Err((what, "as many weights as values, each 0 or more"));
        }
        let mut share = 0.0;
        let up_to = |weight: &f64| {
            share += weight / sum;
            share
        };
        Ok(Form::Choice(values, weights.iter().map(up_to).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Distribution {
        let table: toml::Table = toml::from_str(text).expect("TOML");
        let study = Scene::from_text("s.toml", "").expect("a document");
        Distribution::of(&table["v"], "vary.v", &study).unwrap_or_else(|e| panic!("{e}"))
    }

    /// The mean and the variance of many quantiles, by the midpoint rule.
    fn moments(d: &Distribution) -> (f64, f64) {
        let n = 20_000;
        let values: Vec<f64> = (0..n).map(|k| d.quantile((f64::from(k) + 0.5) / f64::from(n))).collect();
        let mean = values.iter().sum::<f64>() / f64::from(n);
        (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(n))
    }

    /// Against closed forms: mean and variance of a uniform and of a normal distribution that is cut at +- a deviations,
    /// `1 - 2 a phi(a) / (2 Phi(a) - 1)`; median and the two thirds of a lognormal one.
    #[test]
    fn quantiles_have_the_moments_of_their_distribution() {
        let (mean, variance) = moments(&of("v = { uniform = [2.0, 5.0] }"));
        assert!((mean - 3.5).abs() < 1e-9 && (variance - 0.75).abs() < 1e-6, "{mean} {variance}");
        let (mean, variance) = moments(&of("v = { normal = [10.0, 2.0], within = [7.0, 13.0] }"));
        let a: f64 = 1.5;
        let density = (-0.5 * a * a).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let exact = 4.0 * (1.0 - 2.0 * a * density / 0.866_385_597_462_284);
        assert!(
            (mean - 10.0).abs() < 1e-9 && (variance / exact - 1.0).abs() < 1e-4,
            "{mean} {variance} {exact}"
        );
        let wide = of("v = { lognormal = [0.5, 2.0], within = [1e-9, 1e9] }");
        assert!((wide.quantile(0.5) - 0.5).abs() < 1e-12);
        for (deviations, exact) in [(-1.0, 0.25), (1.0, 1.0), (2.0, 2.0)] {
            let u = standard().cdf(deviations);
            assert!((wide.quantile(u) / exact - 1.0).abs() < 1e-9, "{deviations}");
        }
        assert_eq!(of("v = { lognormal = [0.5, 2.0] }").range(), Some([0.0625, 4.0]));
    }

    /// Of a power law with exponent b from l to m the share above v is (v^-b - m^-b) / (l^-b - m^-b), and the mean of one with b = 1
    /// is ln(m / l) / (1 / l - 1 / m).
    #[test]
    fn a_power_law_and_a_table_have_the_quantiles_of_their_closed_forms() {
        for b in [0.4, 1.0, 2.5] {
            let (l, m) = (0.05_f64, 20.0_f64);
            let law = of(&format!("v = {{ power_law = [{l}, {m}, {b}] }}"));
            for u in [0.0, 0.1, 0.5, 0.9, 0.999, 1.0] {
                let v = law.quantile(u);
                let above = (v.powf(-b) - m.powf(-b)) / (l.powf(-b) - m.powf(-b));
                assert!((above - (1.0 - u)).abs() < 1e-12, "{b} {u}: {above}");
            }
            assert_eq!(law.range(), Some([l, m]));
            assert!(law.quantile(0.0) == l && (law.quantile(1.0) / m - 1.0).abs() < 1e-12);
        }
        let (mean, _) = moments(&of("v = { power_law = [0.5, 4.0, 1.0] }"));
        let exact = 8.0_f64.ln() / (2.0 - 0.25);
        assert!((mean / exact - 1.0).abs() < 1e-7, "{mean} {exact}");
        let table = of("v = { table = [[1.0, 0.0], [2.0, 0.5], [3.0, 0.5], [7.0, 1.0]] }");
        let values = [0.0, 0.25, 0.5, 0.75, 1.0].map(|u| table.quantile(u));
        assert_eq!(values, [1.0, 1.5, 2.0, 5.0, 7.0]);
        assert_eq!(table.range(), Some([1.0, 7.0]));
        // 0.5 * 1.5 + 0.5 * 5, nothing between 2 and 3.
        assert!((moments(&table).0 - 3.25).abs() < 1e-9 && table.quantile(0.5 + 1e-9) >= 3.0);
    }

    #[test]
    fn a_choice_is_made_by_its_weights() {
        let choice = of("v = { choice = [1, 2.5, 3], weights = [1, 2, 1] }");
        let drawn = [0.0, 0.24, 0.26, 0.74, 0.76, 0.999].map(|u| choice.quantile(u));
        assert_eq!(drawn, [1.0, 1.0, 2.5, 2.5, 3.0, 3.0]);
        assert_eq!((choice.range(), choice.levels), (Some([1.0, 3.0]), 3));
        assert_eq!(of("v = { choice = [2, 3.5, 1] }").ends(), [1.into(), 3.5.into()]);
        let fixed = of("v = 7");
        assert!(fixed.levels == 1 && fixed.quantile(0.3) == 7.0);
    }

    #[test]
    fn what_is_no_distribution_is_refused() {
        let study = Scene::from_text("s.toml", "").expect("a document");
        for (text, words) in [
            ("v = { uniform = [2.0, 1.0] }", "below the second"),
            ("v = { normal = [2.0, 0.0] }", "standard deviation of 0"),
            ("v = { lognormal = [2.0, 1.0] }", "the factor above 1"),
            ("v = { uniform = [1, 2], normal = [1, 2] }", "one of uniform"),
            ("v = { uniform = [1, 2], within = [1, 2] }", "cuts the tails"),
            ("v = { choice = [1, 2], weights = [1] }", "1 weights for 2 values"),
            ("v = { choice = [] }", "a choice of nothing"),
            ("v = { power_law = [2.0, 1.0, 1.0] }", "below the second"),
            ("v = { power_law = [0.0, 1.0, 1.0] }", "must lie above 0"),
            ("v = { table = [[1.0, 0.0], [2.0, 0.9]] }", "the shares from 0 to 1"),
            ("v = { table = [[1.0, 0.0], [1.0, 1.0]] }", "both ascend"),
            ("v = { unifrom = [1, 2] }", "has one of uniform"),
            ("v = { uniform = [1, 2], levles = 2 }", "unknown key `levles`"),
        ] {
            let table: toml::Table = toml::from_str(text).expect("TOML");
            let error = Distribution::of(&table["v"], "vary.v", &study).expect_err(text).to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
