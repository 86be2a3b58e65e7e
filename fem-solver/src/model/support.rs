//! Tables in time: prescribed motion of supports, factors of loads.

/// A displacement or a factor over time: straight between the rows of a table, constant before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    times: Vec<f64>,
    values: Vec<f64>,
    /// On a circle the values are angles [rad]: of cosine less 1, and of sine.
    circle: Option<[f64; 2]>,
}

impl Motion {
    /// From rows `(time [s], value)`. Refuses times that do not increase.
    pub fn new(rows: &[(f64, f64)]) -> Result<Self, String> {
        if let Some(pair) = rows.windows(2).find(|pair| pair[1].0 <= pair[0].0) {
            return Err(format!(
                "the times of a table must increase, {} s follows {} s",
                pair[1].0, pair[0].0
            ));
        }
        let (times, values) = rows.iter().copied().unzip();
        Ok(Self { times, values, circle: None })
    }

    /// The same as angles [rad] on a circle: `cosine (cos a - 1) + sine sin a`.
    #[must_use]
    pub fn on_circle(self, cosine: f64, sine: f64) -> Self {
        Self { circle: Some([cosine, sine]), ..self }
    }

    /// A bound of its magnitude.
    pub fn size(&self) -> f64 {
        let most = self.values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        most * self.circle.map_or(1.0, |[cosine, sine]| cosine.hypot(sine))
    }

    /// Value at `time` [s].
    pub fn at(&self, time: f64) -> f64 {
        let value = self.straight(time);
        let Some([cosine, sine]) = self.circle else { return value };
        // cos a - 1 without cancellation.
        -2.0 * cosine * (0.5 * value).sin().powi(2) + sine * value.sin()
    }

    /// Value of the table at `time` [s].
    fn straight(&self, time: f64) -> f64 {
        let next = self.times.partition_point(|t| *t <= time);
        if next == 0 {
            return self.values.first().copied().unwrap_or(0.0);
        }
        if next == self.times.len() {
            return self.values[next - 1];
        }
        let (t0, t1) = (self.times[next - 1], self.times[next]);
        let (v0, v1) = (self.values[next - 1], self.values[next]);
        v0 + (v1 - v0) * ((time - t0) / (t1 - t0))
    }

    /// Mean value of the table from `start` to `end` [s], which lies behind it, to the last corner.
    pub fn mean(&self, start: f64, end: f64) -> f64 {
        let (mut time, mut value, mut sum) = (start, self.straight(start), 0.0);
        let inside = self.times.iter().zip(&self.values).filter(|(t, _)| **t > start && **t < end);
        for (t, v) in inside.map(|(t, v)| (*t, *v)).chain([(end, self.straight(end))]) {
            sum += 0.5 * (value + v) * (t - time);
            (time, value) = (t, v);
        }
        sum / (end - start)
    }

    /// Whether it stands still from `start` to `end` [s].
    pub fn rests(&self, start: f64, end: f64) -> bool {
        let value = self.straight(start);
        let inside = self.times.iter().zip(&self.values).filter(|(t, _)| **t > start && **t < end);
        self.straight(end) == value && inside.map(|(_, v)| v).all(|v| *v == value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_straight_between_rows_and_constant_outside() {
        let motion = Motion::new(&[(1.0, 0.0), (3.0, 4.0)]).expect("increases");
        assert_eq!([0.0, 1.0, 1.5, 3.0, 9.0].map(|t| motion.at(t)), [0.0, 0.0, 1.0, 4.0, 4.0]);
        assert!(motion.rests(0.0, 1.0) && motion.rests(3.0, 5.0));
        assert!(!motion.rests(0.5, 1.5) && !motion.rests(0.0, 9.0));
    }

    #[test]
    fn there_and_back_inside_a_window_is_no_rest() {
        let motion = Motion::new(&[(1.0, 0.0), (1.1, 1.0), (1.2, 0.0)]).expect("increases");
        assert!(!motion.rests(0.9, 1.3));
    }

    #[test]
    fn the_mean_counts_every_corner() {
        // A triangle of height 2 over 1 s to 3 s: an area of 2.
        let table = Motion::new(&[(1.0, 0.0), (2.0, 2.0), (3.0, 0.0)]).expect("increases");
        let mean = |a, b| table.mean(a, b);
        assert_eq!([mean(0.0, 4.0), mean(1.0, 2.0), mean(1.5, 2.5), mean(5.0, 6.0)], [0.5, 1.0, 1.5, 0.0]);
    }

    #[test]
    fn times_that_do_not_increase_are_refused() {
        assert!(Motion::new(&[(1.0, 0.0), (1.0, 1.0)]).is_err());
    }
}
