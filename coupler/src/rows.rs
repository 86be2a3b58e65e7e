//! Which committed windows become rows of `history.csv`: each one while anything touches and for an output interval after it (a
//! rock that is being braked leaves the net for moments), else one per interval, and the last one before a touch.

use interface_defs::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};
use toolkit::recorder::of_others;

/// Columns of the coupler itself, behind those of the solvers' gauges; the force comes first.
pub const OWN_COLUMNS: [&str; 7] = [
    "contact_force_x_N",
    "contact_force_y_N",
    "contact_force_z_N",
    "energy_imbalance_J",
    "energy_interface_defect_J",
    "iterations",
    "residual",
];

/// The rows of a run.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Interval between rows while nothing touches [s].
    interval: f64,
    /// Columns that are means over a row's time; the others are of its end.
    means: Vec<usize>,
    pending: Pending,
}

/// What the next row follows from: what a checkpoint keeps.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Pending {
    /// Sums of the means since the row written last, each times the window's length.
    sums: Vec<f64>,
    /// End of the row written last [s].
    written: f64,
    /// End of the last window with a touch [s].
    touched: f64,
    /// End of the row that has not been written [s].
    held: Option<f64>,
    row: Vec<f64>,
}

impl Rows {
    /// Rows of `columns` numbers, of which `means` are means, at least one per `interval` [s].
    pub fn new(columns: usize, means: Vec<usize>, interval: f64) -> Self {
        let pending = Pending {
            sums: vec![0.0; means.len()],
            written: 0.0,
            touched: f64::NEG_INFINITY,
            held: None,
            row: vec![0.0; columns],
        };
        Self { interval, means, pending }
    }

    /// What the next row follows from.
    pub fn kept(&self) -> Pending {
        self.pending.clone()
    }

    /// Go on from there.
    ///
    /// # Errors
    /// If those were rows with other columns.
    pub fn go_on(&mut self, kept: Pending) -> Result<(), Diagnostic> {
        let size = |pending: &Pending| (pending.sums.len(), pending.row.len());
        if size(&kept) != size(&self.pending) {
            return Err(of_others("columns"));
        }
        self.pending = kept;
        Ok(())
    }

    /// The window that ends with `values`, whose first is its end [s], and which began at `start` [s]. `write` gets each
    /// row that is due.
    pub fn take<E>(
        &mut self,
        start: f64,
        values: &[f64],
        touches: bool,
        mut write: impl FnMut(&[f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let time = values[0];
        if touches {
            self.pending.touched = time;
            self.flush(&mut write)?;
        }
        let Self { interval, means, pending } = &mut *self;
        values.clone_into(&mut pending.row);
        for (sum, column) in pending.sums.iter_mut().zip(means) {
            *sum += values[*column] * (time - start);
            // A row of one window has its own mean, to the last bit.
            if pending.written < start {
                pending.row[*column] = *sum / (time - pending.written);
            }
        }
        // In intervals, so that what rounding makes of a multiple does not count.
        let passed = |time: f64| (time / *interval * (1.0 + 1e-9)).floor();
        pending.held = Some(time);
        let touched = time <= pending.touched + *interval;
        if touched || passed(time) > passed(pending.written) { self.flush(&mut write) } else { Ok(()) }
    }

    /// Write the last row, if it has not been written.
    pub fn flush<E>(&mut self, write: &mut impl FnMut(&[f64]) -> Result<(), E>) -> Result<(), E> {
        let Some(time) = self.pending.held.take() else { return Ok(()) };
        self.pending.written = time;
        self.pending.sums.fill(0.0);
        write(&self.pending.row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows of 1 ms with a mean of `time^2`, touched from 12 to 15 ms, a row each 5 ms.
    fn rows() -> Vec<Vec<f64>> {
        let mut rows = Rows::new(2, vec![1], 5e-3);
        let mut written: Vec<Vec<f64>> = Vec::new();
        let mut write = |row: &[f64]| {
            written.push(row.to_vec());
            Ok::<(), ()>(())
        };
        for window in 0..28 {
            let (start, end) = (1e-3 * f64::from(window), 1e-3 * f64::from(window + 1));
            rows.take(start, &[end, end * end], (12..15).contains(&window), &mut write).expect("written");
        }
        rows.flush(&mut write).expect("written");
        written
    }

    #[test]
    fn flights_have_a_row_per_interval_and_one_before_the_touch_and_every_touched_window_has_one() {
        let ends: Vec<f64> = rows().iter().map(|row| (row[0] * 1e3).round()).collect();
        assert_eq!(ends, [5.0, 10.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0, 20.0, 25.0, 28.0]);
    }

    #[test]
    fn rows_times_their_lengths_are_the_impulse() {
        let mut before = 0.0;
        let sum: f64 = rows()
            .iter()
            .map(|row| {
                let length = row[0] - std::mem::replace(&mut before, row[0]);
                row[1] * length
            })
            .sum();
        let exact: f64 = (1..=28).map(|n| (1e-3 * f64::from(n)).powi(2) * 1e-3).sum();
        assert!((sum / exact - 1.0).abs() < 1e-12, "{sum} {exact}");
    }

    #[test]
    fn rows_that_were_kept_with_other_columns_are_refused() {
        let kept = Rows::new(3, vec![1, 2], 5e-3).kept();
        assert!(Rows::new(2, vec![1], 5e-3).go_on(kept.clone()).is_err(), "columns of more gauges");
        assert!(Rows::new(3, vec![1], 5e-3).go_on(kept.clone()).is_err(), "another kind of gauge");
        Rows::new(3, vec![1, 2], 5e-3).go_on(kept).expect("its own");
    }
}
