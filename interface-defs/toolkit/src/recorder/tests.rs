//! Windows and rows.

use super::*;
use interface_defs::message::Role;

fn gauges() -> Vec<Gauge> {
    vec![
        Gauge { extremes: true, ..Gauge::new("z", "m") },
        Gauge { role: Role::Kinetic, ..Gauge::new("k", "J") },
    ]
}

/// Windows as the loops of a solver alone and of a member had them: a row each interval, each in equal parts.
#[test]
fn windows_are_parts_of_rows_and_their_times_are_products() {
    let ends = |end_time: f64, interval: f64, longest: f64| {
        let mut windows = Windows::new(end_time, interval, longest);
        let mut rows = vec![];
        let mut last = 0.0;
        let (mut count, mut copy) = (0, windows.clone());
        while let Some(step) = windows.next() {
            assert_eq!(copy.current(), Some(step));
            assert_eq!(copy.next(), Some(step));
            count += 1;
            assert_eq!((step.window.number, windows.solved()), (count, count));
            assert!(step.window.start == last && step.window.length > 0.0, "{step:?}");
            assert!(step.window.length <= longest * (1.0 + 1e-9));
            last = step.end;
            rows.extend(step.ends_row.then_some(step.end));
        }
        (rows, count)
    };
    assert_eq!(ends(1.0, 0.3, f64::INFINITY), (vec![0.3, 0.6, 0.3 * 3.0, 1.0], 4));
    // The last row has one window, the parts behind the end are none.
    assert_eq!(ends(1.0, 0.3, 0.1), (vec![0.3, 0.6, 0.3 * 3.0, 1.0], 10));
    assert_eq!(ends(0.5, 2.0, f64::INFINITY), (vec![0.5], 1));
    assert_eq!(ends(0.5, 2.0, 0.2), (vec![0.5], 3));
    let (mut windows, mut begun) = (Windows::new(1.0, 0.3, 0.1), Windows::new(1.0, 0.3, 0.1));
    begun.nth(4);
    windows.go_on(begun.clone()).expect("of the same run");
    assert_eq!(windows, begun);
    let refused = windows.go_on(Windows::new(1.0, 0.4, 0.1)).expect_err("of another");
    assert_eq!(refused.diagnostic.code, code::PROVENANCE);
}

#[test]
fn a_row_has_its_time_the_gauges_and_what_is_added_and_extremes_have_the_time_of_their_window() {
    let dir = tempfile::tempdir().expect("a directory");
    let mut recorder = Recorder::open(dir.path(), &[("a", &gauges())], &["residual"], None).expect("opened");
    assert_eq!(recorder.measures().count(), 0, "nothing was seen");
    for (time, z) in [(0.5, [1.0, -2.0, 3.0]), (1.0, [0.0, -1.0, 4.0])] {
        recorder.take(time, &[z, [7.0; 3]]);
        recorder.row().0.push(0.25);
        recorder.write().expect("written");
    }
    let kept = recorder.kept();
    recorder.row().0.clear();
    drop(recorder);
    let text = std::fs::read_to_string(dir.path().join(HISTORY)).expect("a file");
    assert_eq!(text, "time_s,z_m,k_J,residual\n0.5,1,7,0.25\n1,0,7,0.25\n");
    let recorder =
        Recorder::open(dir.path(), &[("a", &gauges())], &["residual"], Some(kept.clone())).expect("goes on");
    assert!(recorder.measures().all(|m| m.source == "a"));
    let measures: Vec<_> = recorder.measures().map(|m| (m.name, m.value, m.time)).collect();
    assert_eq!(measures, [("z_min".into(), -2.0, Some(0.5)), ("z_max".into(), 4.0, Some(1.0))]);
    let refused =
        Recorder::open(dir.path(), &[("a", &gauges()[1..])], &[], Some(kept)).err().expect("others");
    assert_eq!(refused.code, code::PROVENANCE);
}

#[test]
fn a_ledger_goes_on_with_its_own_gauges_alone_and_starts_from_finite_numbers() {
    let of = |initial: Vec<f64>| Ledger::new(Ready { gauges: gauges(), initial, ..Ready::default() }, true);
    let mut ledger = of(vec![1.0; 6]).expect("two gauges");
    ledger.go_on(ledger.kept()).expect("its own");
    let kept = KeptLedger { values: vec![1.0; 3], balance: None };
    assert_eq!(ledger.go_on(kept).expect_err("one gauge").diagnostic.code, code::PROVENANCE);
    assert_eq!(of(vec![1.0; 5]).expect_err("five numbers").diagnostic.code, code::CONTRACT);
    assert_eq!(of(vec![f64::NAN; 6]).expect_err("no numbers").diagnostic.code, code::NOT_FINITE);
}
