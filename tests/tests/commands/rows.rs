//! Rows of `history.csv` of a coupled run: each window in contact, else one per interval, and the one before the touch.

use tests::{Bench, Ended, scene};

fn drop_test(bench: &Bench, out: &str, interval: &str) -> Ended {
    // A support of its own, and a rope whose name says that it is none.
    let gauges = "gauge=[{ name = \"held\", quantity = \"force\", at = [1.95, 0.0, 0.0] }, \
                  { name = \"reaction\", quantity = \"tension\", at = [0.0, 0.0, 0.0] }]";
    let sets = ["end_time=0.66", interval, gauges].map(|set| ["--set", set]).concat();
    bench.done(&scene("walenstadt-compare"), out, &sets)
}

fn impulse(run: &Ended, column: &str) -> f64 {
    let mut before = 0.0;
    let time = run.column("time_s").into_iter();
    time.zip(run.column(column)).map(|(t, force)| force * (t - std::mem::replace(&mut before, t))).sum()
}

#[test]
fn a_flight_has_a_row_per_interval_and_contact_one_per_window() {
    let bench = Bench::new();
    let sparse = drop_test(&bench, "sparse", "output.interval=0.05");
    let every = drop_test(&bench, "every", "output.interval=5e-5");
    let impact = sparse.measure("time_of_impact");
    let time = sparse.column("time_s");
    let first = time.iter().position(|t| *t >= impact).expect("a row of the first touch");
    // 0.05, 0.10, ... 0.60, the last window before the touch, then windows of 5e-5 s.
    assert_eq!(first, 13);
    for (row, t) in time[..12].iter().enumerate() {
        assert!((t - 0.05 * (row + 1) as f64).abs() < 1e-9, "row {row} at {t} s");
    }
    assert!(time[first] - time[first - 1] < 5.1e-5, "{} {}", time[first - 1], time[first]);
    let windows = time[first..].windows(2).all(|pair| pair[1] - pair[0] < 5.1e-5);
    assert!(windows && (time.last().expect("rows") - 0.66).abs() < 1e-9);
    assert_eq!(every.column("time_s").len(), 13_200);
    for column in ["reaction_z_N", "held_fz_N"] {
        let (some, all) = (impulse(&sparse, column), impulse(&every, column));
        assert!((some / all - 1.0).abs() < 1e-9, "{column}: {some} {all}");
    }
    // A tension is that of the row's end, whatever it is called.
    let tension = |run: &Ended, at: f64| {
        let rows = run.column("time_s").into_iter().zip(run.column("reaction_tension_max_N"));
        rows.into_iter().find(|(t, _)| (t - at).abs() < 1e-9).expect("a row").1
    };
    assert_eq!(tension(&sparse, 0.5), tension(&every, 0.5));
}
